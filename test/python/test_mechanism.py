"""Loops, contacts, inverse kinematics and identification at a state, against other formulations."""
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

import kinetree as kt

BALL = """
kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: ball, joint: {type: prismatic, axis: z, position: 0.095}, mass: 2, com: [0, 0, 0], inertia: [0.01, 0.01, 0.01]}
effects:
  - {name: floor, type: contact, point: ball, plane: world, axis: z, radius: 0.1, stiffness: 1.0e4, exponent: 1}
"""


@pytest.fixture
def four_bar(scenes):
    model = kt.load(scenes / "four-bar.yaml").model
    data = model.data()
    data.assemble()
    return model, data


def test_equations_of_loops_are_those_of_differences_and_of_motion(four_bar, held):
    model, data = four_bar
    q, v, h = data.q.copy(), data.v.copy(), 1e-6
    found = data.loop_equations(q, v)
    assert found["jacobian"].shape == (len(model.equations), model.nv) and set(model.equations) == set(model.loops)
    held(np.abs(found["residual"]).max(), 1e-12, "m and rad, of a closed state")
    columns = [(data.loop_equations(model.add(q, h * e), v)["residual"] - data.loop_equations(model.add(q, -h * e), v)["residual"]) / (2 * h)
               for e in np.eye(model.nv)]
    held(np.abs(found["jacobian"] - np.array(columns).T).max(), 1e-8, "the Jacobian against differences")
    tau = np.array([1.0, 2.0, 3.0])
    a = data.forward_dynamics(q, v, tau)
    held(np.abs(found["jacobian"] @ v - found["rate"]).max(), 1e-12, "velocities")
    held(np.abs(found["jacobian"] @ a - found["drift"]).max(), 1e-9, "accelerations")
    left = data.inverse_dynamics(q, v, a) - tau - data.effect_forces(q, v)
    held(np.abs(left - found["jacobian"].T @ data.multipliers(q, v, tau)).max(), 1e-9, "N m, the equations of motion")
    joints, loops = data.reactions(q, v, tau)
    assert joints.shape == (model.body_count, 6) and loops.shape == (len(model.loops), 6)
    mass = sum(model.get(f"{name}.mass") for name in model.bodies[1:])
    h = 1e-4
    ahead, behind = (data.kinematics(model.add(q, s * h * v + 0.5 * h * h * a), v + s * h * a).momentum()[3:] for s in (1, -1))
    ground = joints[model.body("crank")][3:] + joints[model.body("rocker")][3:] + mass * model.get("gravity")
    held(np.abs((ahead - behind) / (2 * h) - ground).max(), 1e-4 * np.abs(ground).max(), "N, the change of momentum against the reactions of the ground")


def test_assembly_holds_joints(four_bar, held):
    model, data = four_bar
    start = data.q.copy()
    start[0] += 0.2
    closed, _ = data.assemble(start, data.v, hold=["crank"])
    held(abs(closed[0] - start[0]), 0.0, "rad, the crank that is held")
    held(np.abs(data.loop_equations(closed)["residual"]).max(), 1e-10, "m")
    with pytest.raises(kt.ArgumentError, match="there is no joint 'crankk'; did you mean 'crank'"):
        data.assemble(start, hold=["crankk"])
    with pytest.raises(kt.ArgumentError, match="hold: expected a list"):
        data.assemble(start, hold="crank")


def test_inverse_kinematics_of_an_arm_and_of_a_linkage(scenes, four_bar, held):
    arm = kt.mechanism([kt.Body("upper", joint=kt.revolute("y", position=0.3), mass=1, shape=kt.rod(to=[1, 0, 0])),
                        kt.Body("lower", parent="upper", joint=kt.revolute("y", at=[1, 0, 0], position=0.5), mass=1, shape=kt.rod(to=[0.8, 0, 0]), markers={"tip": [0.8, 0, 0]})])
    data = arm.model.data()
    q, distance = data.inverse_kinematics({"lower.tip": [0.9, np.nan, 0.7]})
    held(distance, 1e-10, "m, a target within reach")
    place = data.kinematics(q).position("lower.tip")
    held(np.abs(place[[0, 2]] - [0.9, 0.7]).max(), 1e-10, "m")
    cosine = (0.9**2 + 0.7**2 - 1 - 0.64) / 1.6
    held(abs(abs(q[1]) - np.arccos(cosine)), 1e-9, "rad, the elbow in closed form")
    q, distance = data.inverse_kinematics({"lower.tip": [3.0, 0.0, 4.0]}, [0.1, 0.1])
    held(abs(distance - 3.2), 1e-9, "m, a target that is out of reach: 5 m less 1.8 m")
    held(np.abs(data.q - [0.3, 0.5]).max(), 0.0, "rad, the state of the object")
    q, _ = data.inverse_kinematics({"lower.tip": [0.9, 0.0, 0.7]}, hold=["upper"])
    held(abs(q[0] - 0.3), 0.0, "rad, a joint that is held")
    model, linkage = four_bar
    marker = "crank.tip"
    target = linkage.kinematics(linkage.assemble(linkage.q + [0.3, 0, 0], hold=["crank"])[0]).position(marker)
    q, distance = linkage.inverse_kinematics({marker: target})
    held(distance, 1e-10, "m, a marker of a linkage")
    held(np.abs(linkage.loop_equations(q)["residual"]).max(), 1e-12, "m, its loops")
    with pytest.raises(kt.ArgumentError, match="targets: expected a mapping"):
        linkage.inverse_kinematics(target)


def test_contacts_have_forces_and_points(held):
    scene = kt.Scene(BALL)
    data = scene.model.data()
    [contact] = data.contacts()
    held(abs(contact["depth"] - 0.005), 1e-15, "m")
    held(np.abs(contact["force"] - [0, 0, 50.0]).max(), 1e-9, "N, the spring of the floor")
    held(np.abs(contact["point"] - [0, 0, -0.005]).max(), 1e-12, "m, the lowest point")
    [quantities] = data.effect_quantities()
    assert quantities["name"] == "floor" and quantities["type"] == "contact" and scene.model.effect_types == [("floor", "contact")]
    held(abs(quantities["normal"] - 50.0), 1e-9, "N")
    assert data.contacts([0.2]) == []
    kinetic, potential = data.kinematics([0.095], [2.0]).energy()
    held(abs(kinetic - 4.0) + abs(potential - (2 * 9.81 * 0.095 + 0.5 * 1e4 * 0.005**2)), 1e-12, "J, with the energy of the floor")
    simulation = scene.simulation(step=1e-4, sensors=["energy"])
    sensed, computed = simulation.sense()["energy"], simulation.data().energy()
    held(max(abs(one - other) for one, other in zip(sensed, computed)), 1e-12, "J, by a sensor and by data")


def test_a_regressor_gives_forces_and_base_parameters_identify_them(scenes, random_state, held):
    model = kt.load(scenes / "arm7.yaml").model
    data, draw = model.data(), np.random.default_rng(7)
    values, base = np.array(list(model.dynamic_parameters.values())), data.base_parameters()
    rows, forces = [], []
    for seed in range(40):
        q, v, a = *random_state(model, seed)[:2], draw.standard_normal(model.nv)
        Y, tau = data.regressor(q, v, a), data.inverse_dynamics(q, v, a)
        held(np.abs(Y @ values - tau).max(), 1e-9 * max(1, np.abs(tau).max()), "N m, linear in the parameters")
        held(np.abs(Y - Y[:, base.columns] @ base.matrix).max(), 1e-6 * np.abs(Y).max(), "the other columns depend on those of the base")
        rows.append(Y[:, base.columns])
        forces.append(tau)
    found = np.linalg.lstsq(np.concatenate(rows), np.concatenate(forces), rcond=None)[0]
    held(np.abs(found - base.matrix @ values).max(), 1e-6, "base parameters from forces")
    assert len(base.names) == len(base.columns) == np.linalg.matrix_rank(np.concatenate(rows)) and len(model.dynamic_parameters) == Y.shape[1]


def test_parameters_loops_limits_and_integrators_are_listed(scenes):
    model = kt.load(scenes / "four-bar.yaml").model
    for name in model.parameters:
        model.get(name)
    assert {"gravity", "crank.mass", "rocker.inertia"} <= set(model.parameters) and set(model.loops.values()) == {"revolute"}
    spring = kt.mechanism([kt.Body("a", joint=kt.prismatic("x"), mass=1)], effects=[kt.effect.joint_spring(name="s", joint="a", stiffness=3)]).model
    assert "effect s.stiffness" in spring.parameters and spring.get("effect s.stiffness") == 3.0
    assert kt.integrators()["rk4"] == "explicit" and len(kt.integrators()) == kt.lib.kt_method_count()


def test_limits_of_a_robot_are_listed(tmp_path):
    (tmp_path / "r.urdf").write_text('<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
                                     '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="2" effort="3" velocity="4"/></joint></robot>')
    with pytest.warns(kt.KinetreeWarning, match="do not act"):
        model = kt.load(tmp_path / "r.urdf").model
    assert model.limits == {"j": {"lower": -1.0, "upper": 2.0, "velocity": 4.0, "effort": 3.0}}


def test_each_state_of_a_batch_may_have_parameters_of_its_own(held):
    scene = kt.mechanism([kt.Body("arm", joint=kt.revolute("y", position=0.3), mass=1, shape=kt.rod(to=[1, 0, 0]))], gravity=[0, 0, -9.81])
    model, masses = scene.model, np.linspace(0.5, 4.0, 10)
    batch = model.batch(10, method="rk4")
    singles = []
    for k, mass in enumerate(masses):
        own = model.copy()
        own.set("arm.com", [0.1 * mass, 0, 0])
        batch.set_model(k, own)
        singles.append(own.data().forward_dynamics([0.3], [0.0], [0.0])[0])
    found = batch.forward_dynamics(np.full((10, 1), 0.3))[:, 0]
    held(np.abs(found - singles).max(), 0.0, "rad/s^2, of a batch and of single calls")
    assert len(set(found)) == 10
    for wrong in (model, None):
        with pytest.raises(kt.ArgumentError, match="model: expected a copy"):
            batch.set_model(0, wrong)
    with pytest.raises(kt.ArgumentError, match="state: expected an integer from 0 to 9"):
        batch.set_model(10, own)


def test_gradients_of_a_rollout_are_those_of_differences(scenes, held):
    model = kt.load(scenes / "arm7.yaml").model
    data, draw, h = model.data(), np.random.default_rng(3), 1e-6
    inputs, q, v = draw.standard_normal((20, model.nv)), 0.3 * draw.standard_normal(model.nq), draw.standard_normal(model.nv)
    weight = draw.standard_normal(2 * model.nv)

    def cost(step, t, q, v, tau):
        state = np.concatenate([q, v])
        return 0.5 * state @ state + weight @ state + 0.1 * tau @ tau, state + weight, 0.2 * tau

    def value(inputs, q, v):
        return data.rollout_gradient(1e-3, inputs, cost, q=q, v=v).value

    found = data.rollout_gradient(1e-3, inputs, cost, q=q, v=v)
    along = draw.standard_normal(inputs.shape)
    slope = (value(inputs + h * along, q, v) - value(inputs - h * along, q, v)) / (2 * h)
    held(abs(slope - np.sum(found.by_inputs * along)) / abs(slope), 1e-6, "by the inputs, relative")
    xi, dv = draw.standard_normal(model.nv), draw.standard_normal(model.nv)
    slope = (value(inputs, model.add(q, h * xi), v + h * dv) - value(inputs, model.add(q, -h * xi), v - h * dv)) / (2 * h)
    held(abs(slope - found.by_start @ np.concatenate([xi, dv])) / abs(slope), 1e-6, "by the start, relative")
    again = data.rollout_gradient(1e-3, inputs, cost, q=q, v=v, checkpoints=3)
    held(abs(again.value - found.value) + np.abs(again.by_inputs - found.by_inputs).max(), 0.0, "with three checkpoints")
    with pytest.raises(ZeroDivisionError):
        data.rollout_gradient(1e-3, inputs, lambda *_: 1 / 0)
    with pytest.raises(kt.ArgumentError, match="the gradient by tau: expected"):
        data.rollout_gradient(1e-3, inputs, lambda *_: (0.0, np.zeros(14), np.zeros(3)))
    for wrong, name in ((dict(inputs=np.zeros((0, 7))), "method"), (dict(inputs=np.zeros(7)), "inputs"), (dict(inputs=inputs, method="ab4"), "method")):
        with pytest.raises(kt.ArgumentError, match=f"^{name}: "):
            data.rollout_gradient(1e-3, cost=cost, **wrong)
