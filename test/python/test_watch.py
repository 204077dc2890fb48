"""What a simulation of this package does as the command does it: the integrator of the scene, its present state, and no silence."""
# SPDX-License-Identifier: Apache-2.0
import ctypes
import pickle

import numpy as np
import pytest

import kinetree as kt

STIFF = """
kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: arm, joint: {type: revolute, axis: y, position: 0.5}, mass: 1, com: [0.5, 0, 0], inertia: [0, 0.0833333333333, 0.0833333333333]}
effects:
  - {name: d, type: joint_damper, joint: arm, damping: 94}
simulate: {duration: 1, integrator: radau5, step: 1.0e-2}
"""


def test_a_step_keeps_the_integrator_of_the_scene(held):
    scene = kt.Scene(STIFF)
    stepped, plain = scene.simulation(step=1e-2), scene.simulation()
    for each in (stepped, plain):
        each.advance(1.0)
    assert stepped.integrator == plain.integrator == "radau5"
    assert np.array_equal(stepped.state, plain.state)
    run = scene.run(step=1e-2)
    assert run.summary["method"]["integrator"] == "radau5"
    held(abs(stepped.positions[0] - run["position.arm"][-1]), 0.0, "simulation(step) against run(step), rad")
    nameless = kt.Scene(STIFF.replace("integrator: radau5, ", "")).simulation(step=1e-3)
    assert nameless.integrator == "rk4" and scene.simulation(step=1e-3, integrator="rk4").integrator == "rk4"


ARM = """
kinetree: 1
gravity: [0, 0, -9.81]
parameters: {m: 1}
bodies:
  - {name: arm, joint: {type: revolute, axis: y}, mass: =m, com: [0.5, 0, 0], inertia: [0, 0.0833333333333, 0.0833333333333], markers: {tip: [1, 0, 0]}}
simulate: {duration: 1}
"""


def test_an_event_or_a_force_that_is_no_number_is_rejected():
    scene = kt.Scene(ARM)
    for wrong, match in ((lambda at: at.q[0] > 1.0, "expected a number, such as"), (lambda at: bool(at.q[0] > 1.0), "expected a number, such as"),
                         (lambda at: at.q > 1.0, "expected a number, such as"), (lambda at: None, "expected a number"), (lambda at: "1", "expected a number"),
                         (lambda at: np.ma.masked_less(at.q, 9.0), "1 of 1 values are masked"), (lambda at: [1.0, 2.0], "expected a number")):
        simulation = scene.simulation(tolerance=1e-9, duration=1.0)
        simulation.on("low", wrong, stop=True)
        with pytest.raises(kt.ArgumentError, match=f"the result of the event: {match}"):
            simulation.run()
    for right in (lambda at: at.q[0] - 1.0, lambda at: at.q - 1.0, lambda at: np.float32(at.q[0] - 1.0)):
        simulation = scene.simulation(tolerance=1e-9, duration=1.0)
        simulation.on("low", right, stop=True)
        simulation.run()
        assert simulation.stopped == "low"
    with pytest.raises(kt.ArgumentError, match="the result of the force: expected a number"):
        kt.Simulation(kt.Model(scene, effects=[kt.JointForce("arm", lambda t, q, v: q > 0.1)]), step=1e-3).advance(0.1)


def test_a_compiled_function_of_another_type_is_rejected():
    scene, d, i, p = kt.Scene(ARM), ctypes.c_double, ctypes.c_int, ctypes.c_void_p
    D = ctypes.POINTER(d)
    law = ctypes.CFUNCTYPE(i, p, d, D, D, D)(lambda user, t, q, v, tau: 1)
    scene.simulation(step=1e-3).control(law)
    for result, *arguments in ((i, p, d, D, D), (d, p, d, D, D, D), (i, p, d, D, D, ctypes.POINTER(ctypes.c_float)), (i, p, ctypes.c_float, D, D, D), (i, D, D, D, D, D)):
        wrong = ctypes.CFUNCTYPE(result, *arguments)(lambda *_: 1)
        with pytest.raises(kt.ArgumentError, match=r"law: expected a function int \(void \*, double, double \*, double \*, double \*\), got"):
            scene.simulation(step=1e-3).control(wrong)
    with pytest.raises(kt.ArgumentError, match="function: expected a function"):
        kt.JointForce("arm", law)
    with pytest.raises(kt.ArgumentError, match="function: expected a function"):
        scene.simulation(step=1e-3).on("event", law)
    numba = pytest.importorskip("numba", reason="numba is not on this machine")
    types = numba.types
    wrong = numba.cfunc(types.float64(types.float64, types.float64, types.float64))(lambda t, q, v: -q)
    with pytest.raises(kt.ArgumentError, match=r"got float64 \(float64, float64, float64\)"):
        kt.JointForce("arm", wrong)


def test_masked_arrays_and_overlapping_outputs_are_rejected(scenes):
    scene = kt.load(scenes / "arm7.yaml")
    model, data = scene.model, scene.model.data()
    n, masked = model.nv, np.ma.masked_less(np.arange(7.0), 2.0)
    for call in (lambda: data.forward_dynamics(masked), lambda: scene.simulation(step=1e-3).set_torque(masked), lambda: model.add(masked, masked),
                 lambda: model.batch(7).forward_dynamics(np.ma.masked_less(np.ones((7, 7)), 2.0)), lambda: scene.sweep(duration=masked),
                 lambda: kt.Scene({"kinetree": 1, "gravity": np.ma.masked_less(np.arange(3.0), 2.0)})):
        with pytest.raises(kt.ArgumentError, match="values are masked; replace them"):
            call()
    assert np.array_equal(data.forward_dynamics(np.ma.masked_less(np.ones(7), 0.0)), data.forward_dynamics(np.ones(7)))
    block, square = np.zeros(2 * n), np.zeros((n, n), order="F")
    A, B = np.zeros((2 * n, 2 * n), order="F"), np.zeros((2 * n, n), order="F")
    for call in (lambda: data.step(1e-3, out=(block[:n], block[:n])), lambda: data.step(1e-3, out=(block[:n], block[n - 1:2 * n - 1])),
                 lambda: data.forward_derivatives(out=(square,) * 3), lambda: data.step_derivatives(1e-3, out=(A, A[:, :n])),
                 lambda: data.assemble(out=(block[:n], block[:n])), lambda: model.batch(1, method="rk4").step(1e-3, 1, out=(B.T[:1, :n].copy(),) * 2)):
        with pytest.raises(kt.ArgumentError, match=r"out\[1\]: it shares memory with another output"):
            call()
    for call in (lambda: model.add(block[:n], np.ones(n), out=block[1:n + 1]), lambda: data.step(1e-3, block[:n], out=(block[1:n + 1], np.zeros(n))),
                 lambda: data.step_derivatives(1e-3, A[:n, 0], out=(A, B))):
        with pytest.raises(kt.ArgumentError, match="it shares memory with a part of an input"):
            call()
    q, v = np.full(n, 0.1), np.full(n, 0.2)
    wanted = [each.copy() for each in data.step(1e-3, q, v)]
    assert all(map(np.array_equal, data.step(1e-3, q, v, out=(q, v)), wanted))


def test_options_without_a_value_need_a_right_name(scenes, tmp_path):
    scene = kt.load(scenes / "pendulum.yaml")
    for wrong in (None, False):
        with pytest.raises(kt.ArgumentError, match="run: there is no option 'durations'; did you mean 'duration'"):
            scene.run(durations=wrong)
        with pytest.raises(kt.ArgumentError, match="modes: there is no option 'jsn'"):
            scene.modes(jsn=wrong)
    assert len(scene.run(duration=0.1, integrator=None, plot=None, max_step=None)) > 1
    file = tmp_path / "rod.urdf"
    file.write_text('<robot name="r"><link name="base"/><link name="rod"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
                    '</inertial></link><joint name="j" type="continuous"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/></joint></robot>')
    assert kt.load(file, keyframe=None, ground=None, floating=None).model.nv == 1
    with pytest.raises(kt.ArgumentError, match="there is no option 'keyfram' of robots"):
        kt.load(file, keyfram=None)


def test_failed_runs_of_a_sweep_warn():
    scene = kt.Scene(ARM)
    with pytest.warns(kt.KinetreeWarning, match=r"1 of 3 runs of the sweep failed. The first is run 1 with m = -1: .*mass is -1"):
        table = scene.sweep(m=[1, -1, 2])
    assert list(table["status"]) == ["done", "scene", "done"]


def test_a_copy_of_a_model_serves_one_simulation(held):
    scene = kt.Scene(ARM)
    own = scene.model.copy()
    first = scene.simulation(step=1e-3, model=own)
    first.advance(0.1)
    second = scene.simulation(step=1e-3, model=own)
    for call in (lambda: first.advance(0.2), lambda: first.set("arm.mass", 2.0), lambda: list(first)):
        with pytest.raises(kt.Busy, match="it serves the latest one"):
            call()
    second.set("arm.mass", 2.0)
    second.advance(0.1)
    alone = scene.simulation(step=1e-3, model=scene.model.copy())
    alone.set("arm.mass", 2.0)
    alone.advance(0.1)
    assert not np.array_equal(second.state, first.state)
    held(np.abs(second.state - alone.state).max(), 0.0, "against a simulation with a copy of its own")


PRESENT = """
kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: arm, joint: {type: revolute, axis: y}, mass: 1, com: [0.5, 0, 0], inertia: [0, 0.0833333333333, 0.0833333333333], markers: {tip: [1, 0, 0]}}
states: {lag: {initial: 0.5, rate: "3*(position.arm - lag)"}}
effects:
  - {name: s, type: joint_spring, joint: arm, stiffness: 100, switched: on}
  - {name: lagging, type: expression, joint: arm, force: "-20*lag + 7*sin(5*t)"}
simulate: {duration: 2, tolerance: 1.0e-10}
"""


def tip_acceleration(simulation):
    """Of a rod about the y axis, from its angle, its speed and its acceleration: by hand."""
    q, v, a = simulation.positions[0], simulation.velocities[0], simulation.acceleration()[0]
    return np.array([-np.cos(q) * v * v - np.sin(q) * a, 0.0, np.sin(q) * v * v - np.cos(q) * a])


def test_data_of_a_simulation_are_its_present_state(held):
    simulation = kt.Scene(PRESENT).simulation()
    simulation.advance(0.2)
    inertia = 0.0833333333333 + 0.25
    for is_on in (True, False, True):
        simulation.switch("s", is_on)
        simulation.torque[:] = 3.0
        data, q = simulation.data(), simulation.positions[0]
        force = 3.0 - 20 * simulation.states[0] + 7 * np.sin(5 * simulation.time) - 100 * q * is_on + 0.5 * 9.81 * np.cos(q)
        held(abs(data.forward_dynamics()[0] - force / inertia), 1e-11, "the closed form, rad/s^2")
        held(abs(simulation.acceleration()[0] - force / inertia), 1e-11, "the simulation, rad/s^2")
        held(np.abs(data.acceleration("arm.tip") - tip_acceleration(simulation)).max(), 1e-11, "of the tip, m/s^2")
        A, B = simulation.step_derivatives(h=1e-3)
        for i in range(3):  # central differences of steps of a scene that has the spring or not
            text = PRESENT if is_on else PRESENT.replace("stiffness: 100", "stiffness: 0")
            other, ends = kt.Scene(text).model.data(), []
            for shift in (1e-5, -1e-5):
                state = simulation.state.copy()
                state[i] += shift
                ends.append(np.concatenate(other.step(1e-3, state[:1], state[1:2], [3.0], x=state[2:], t=simulation.time)))
            held(np.abs(A[:, i] - (ends[0] - ends[1]) / 2e-5).max(), 1e-8, f"column {i} of A against differences")
        simulation.advance(simulation.time + 0.1)


def test_data_have_the_loops_that_are_on(held):
    rod = "mass: 1, com: [0.5, 0, 0], inertia: [0, 0.0833333333333, 0.0833333333333], markers: {tip: [1, 0, 0]}"
    scene = kt.Scene(f"""
kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {{name: arm, joint: {{type: revolute, axis: y}}, {rod}}}
  - {{name: low, parent: arm, joint: {{type: revolute, axis: y, at: [1, 0, 0]}}, {rod}}}
loops:
  - {{name: pin, type: revolute, axis: y, between: [low.tip, {{body: world, at: [2, 0, 0]}}], switched: on}}
""")
    simulation = scene.simulation(step=1e-3)
    simulation.switch("pin", False)
    data = simulation.data()
    tree = np.linalg.solve(data.mass_matrix(), -data.bias())
    held(np.abs(data.forward_dynamics() - tree).max(), 1e-12, "without the loop, rad/s^2")
    assert np.abs(scene.model.data().forward_dynamics() - tree).max() > 1.0
    with pytest.raises(TypeError, match="pickle the simulation"):
        pickle.dumps(data)


def test_accelerations_that_nobody_computed_are_rejected(held):
    data = kt.Scene(ARM).model.data()
    for state in ((), ([0.3], [1.0])):
        data.kinematics(*state)
        with pytest.raises(kt.ArgumentError, match="nobody has computed the accelerations of this state"):
            data.acceleration("arm.tip")
    data.forward_dynamics()
    data.kinematics()
    held(np.abs(data.acceleration("arm.tip") - [0.0, 0.0, -1.5 * 9.81]).max(), 1e-10, "of a rod that falls, m/s^2")
    data.kinematics([0.0], [2.0], [0.0])
    held(np.abs(data.acceleration("arm.tip") - [-4.0, 0.0, 0.0]).max(), 1e-14, "with a = 0 the part of velocities, m/s^2")


def test_time_stepping_has_no_forces_at_a_state():
    scene = kt.Scene({"kinetree": 1, "gravity": [0, 0, -9.81], "bodies": [{"name": "ball", "joint": {"type": "prismatic", "axis": "z"}, "mass": 1}],
                      "effects": [{"type": "joint_limit", "joint": "ball", "lower": 0, "restitution": 0}],
                      "simulate": {"duration": 1, "contact": "steps", "step": 1e-3}})
    simulation = scene.simulation()
    simulation.advance(0.1)
    data = simulation.data()
    assert data.position("ball")[2] == simulation.positions[0]
    for call in (data.forward_dynamics, data.effect_forces, simulation.step_derivatives):
        with pytest.raises(kt.ArgumentError, match="its contacts act over a step"):
            call()
    with pytest.raises(kt.ArgumentError, match="nobody has computed"):
        data.acceleration("ball")
