"""Forces on points by functions of Python and of C, and effects that several models share."""
# SPDX-License-Identifier: Apache-2.0
import ctypes
import gc
import pathlib
import shutil
import subprocess

import numpy as np
import pytest

import kinetree as kt

ROOT = pathlib.Path(__file__).resolve().parents[2]
PULL = """
#include <kinetree/kinetree.h>
int pull(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches, kt_effect_balance *balance) {
    const kt_vec3 d = kt_vec3_sub(ends[1].point, ends[0].point);
    (void)user, (void)t, (void)balance;
    wrenches[0].force = kt_vec3_scale(30.0, d);
    wrenches[1].force = kt_vec3_scale(-30.0, d);
    return 0;
}
"""
TWO = """
kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: ball, joint: {type: free, position: {position: [0.3, 0, 0]}, velocity: {linear: [1, 0, 0], angular: [0, 0, 2]}}, mass: 1, inertia: [0.1, 0.2, 0.3],
     markers: {rim: [0.1, 0, 0]}}
  - {name: slider, joint: {type: prismatic, axis: z}, mass: 2, inertia: [1, 1, 1]}
simulate: {duration: 1}
"""
SPRING = "effects: [{type: spring, between: [ball.rim, slider], stiffness: 30, length: 0}]\n"


def pull(t, ends):
    d = ends[1].point - ends[0].point
    return [30 * d, -30 * d]


def ended(scene, *forces):
    simulation = scene.simulation(step=1e-3, integrator="rk4", effects=list(forces))
    simulation.advance(0.5)
    return simulation.state.copy()


def test_a_force_between_points_is_that_of_a_spring(held):
    by_spring, by_python = ended(kt.Scene(TWO + SPRING)), ended(kt.Scene(TWO), kt.PointForce(["ball.rim", "slider"], pull, "pull"))
    by_place = ended(kt.Scene(TWO), kt.PointForce([("ball", [0.1, 0, 0]), "slider"], lambda t, ends: np.array(pull(t, ends))))
    held(np.abs(by_python - by_spring).max(), 1e-11, "of all numbers of the state")
    assert np.array_equal(by_python, by_place) and np.abs(by_python - ended(kt.Scene(TWO))).max() > 0.1


def test_a_compiled_force_between_points_has_the_bits_of_python(tmp_path):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("cc is not on this machine")
    (tmp_path / "pull.c").write_text(PULL)
    subprocess.run([compiler, "-O2", "-shared", "-fPIC", "-ffp-contract=off", f"-I{ROOT / 'include'}", "-o", tmp_path / "pull.so", tmp_path / "pull.c"], check=True)
    compiled = ctypes.CDLL(str(tmp_path / "pull.so")).pull
    assert np.array_equal(ended(kt.Scene(TWO), kt.PointForce(["ball.rim", "slider"], compiled)), ended(kt.Scene(TWO), kt.PointForce(["ball.rim", "slider"], pull)))


def test_a_wrench_on_a_body_has_the_acceleration_of_newton_and_euler(held):
    """At rest, without gravity: the force over the mass, and the moment over the inertia."""
    scene = kt.Scene(TWO.replace("gravity: [0, 0, -9.81]\n", "").replace(", velocity: {linear: [1, 0, 0], angular: [0, 0, 2]}", ""))
    wrench = np.array([0.01, 0.03, 0.06, 1.0, 2.0, 3.0])
    data = kt.Model(scene, effects=[kt.PointForce(["ball"], lambda t, ends: wrench)]).data()
    a = data.forward_dynamics()
    data.kinematics(a=a)
    held(np.abs(data.acceleration("ball") - wrench[3:]).max(), 1e-14, "m/s^2")
    held(np.abs(data.jacobian("ball")[:3] @ a - wrench[:3] / [0.1, 0.2, 0.3]).max(), 1e-14, "rad/s^2")


def test_a_function_of_a_force_sees_the_motion_of_its_point(held):
    seen = []
    model = kt.Model(kt.Scene(TWO), effects=[kt.PointForce(["ball.rim"], lambda t, ends: seen.append((t, ends[0])) or np.zeros(3))])
    data = model.data()
    data.forward_dynamics(t=0.75)
    data.kinematics()
    t, end = seen[-1]
    held(np.abs(end.point - data.position("ball.rim")).max() + np.abs(end.velocity - data.velocity("ball.rim")).max(), 1e-15, "m and m/s")
    held(np.abs(end.omega - data.jacobian("ball")[:3] @ data.v).max() + np.abs(end.axes - data.pose("ball")[0]).max(), 1e-15, "rad/s")
    assert t == 0.75


def test_a_wrong_force_on_a_point_names_its_fault():
    def fails(t, ends):
        raise KeyError("broken")

    with pytest.raises(KeyError):
        ended(kt.Scene(TWO), kt.PointForce(["ball"], fails))
    with pytest.raises(kt.ArgumentError, match=r"the result of the force: expected numbers of shape \(2, 3\) or \(2, 6\), got \(3,\)"):
        ended(kt.Scene(TWO), kt.PointForce(["ball", "slider"], lambda t, ends: np.zeros(3)))
    with pytest.raises(kt.ModelError, match="did you mean 'ball'"):
        kt.Model(kt.Scene(TWO), effects=[kt.PointForce(["bal"], pull)])
    for wrong in ("ball", [], ["a", "b", "c"]):
        with pytest.raises(kt.ArgumentError, match="points: expected a list of one or two points"):
            kt.PointForce(wrong, pull)
    for wrong in ([7], [("ball", [1, 2])], [("ball",)]):
        with pytest.raises(kt.ArgumentError, match="points: expected"):
            kt.Model(kt.Scene(TWO), effects=[kt.PointForce(wrong, pull)])
    for wrong in (kt.JointForce("slider", lambda t, q, v: 0.0), [pull], "x", None):
        with pytest.raises(kt.ArgumentError, match="effects: expected a list of JointForce and PointForce"):
            kt.Model(kt.Scene(TWO), effects=wrong)


def test_models_may_share_an_effect():
    """The second model must not end the life of what C refers to in the first one."""
    spring = kt.JointForce("slider", lambda t, q, v: -50.0 * q)
    models = [kt.Model(kt.Scene(TWO), effects=[spring]) for _ in range(5)]
    del spring
    gc.collect()
    results = [model.data().forward_dynamics() for model in models]
    assert all(np.array_equal(each, results[0]) for each in results)
