"""Dynamics from Python against closed forms, differences and each other."""
# SPDX-License-Identifier: Apache-2.0
import copy
import pickle
import re

import numpy as np
import pytest

import kinetree as kt

TREES = ["double-pendulum", "cart-pole", "arm7", "humanoid"]


def test_a_rod_on_a_pin_has_the_accelerations_of_its_closed_form(held):
    rod = kt.mechanism([kt.Body("rod", joint=kt.revolute("y"), mass=1.7, shape=kt.rod(to=[0.8, 0, 0]))], gravity=[0, 0, -9.81])
    data = rod.model.data()
    for angle in np.linspace(-3, 3, 13):
        exact = 1.5 * 9.81 / 0.8 * np.cos(angle)  # a turn about y lowers the tip
        held(abs(data.forward_dynamics(np.array([angle]), np.zeros(1))[0] - exact), 1e-13 * 20, "rad/s^2")
    held(abs(data.mass_matrix()[0, 0] - 1.7 * 0.64 / 3), 1e-15)


def test_forward_dynamics_inverts_inverse_dynamics(scenes, held, random_state):
    for name in TREES:
        model = kt.load(scenes / f"{name}.yaml").model
        data = model.data()
        for seed in range(5):
            q, v, a = random_state(model, seed)
            tau = data.inverse_dynamics(q, v, a) - data.effect_forces(q, v)
            back = data.forward_dynamics(q, v, tau)
            held(np.abs(back - a).max(), 1e-9 * max(1.0, np.abs(a).max()), name)


def test_derivatives_are_those_of_differences(scenes, held, random_state):
    for name in ["double-pendulum", "cart-pole"]:
        model = kt.load(scenes / f"{name}.yaml").model
        data = model.data()
        q, v, tau = random_state(model, 3)
        dq, dv, dtau = data.forward_derivatives(q, v, tau)
        A, B = data.step_derivatives(1e-3, q, v, tau)
        h = 1e-6
        for i in range(model.nv):
            e = np.zeros(model.nv)
            e[i] = h
            by_q = (data.forward_dynamics(model.add(q, e), v, tau) - data.forward_dynamics(model.add(q, -e), v, tau)) / (2 * h)
            by_v = (data.forward_dynamics(q, v + e, tau) - data.forward_dynamics(q, v - e, tau)) / (2 * h)
            by_tau = (data.forward_dynamics(q, v, tau + e) - data.forward_dynamics(q, v, tau - e)) / (2 * h)
            scale = 1 + max(np.abs(dq).max(), np.abs(dv).max(), np.abs(dtau).max())
            held(max(np.abs(by_q - dq[:, i]).max(), np.abs(by_v - dv[:, i]).max(), np.abs(by_tau - dtau[:, i]).max()) / scale, 1e-7, f"{name} {i}")
            up, down = data.step(1e-3, q, v + e, tau), data.step(1e-3, q, v - e, tau)
            column = np.concatenate([model.subtract(up[0], down[0]), up[1] - down[1]]) / (2 * h)
            held(np.abs(column - A[:, model.nv + i]).max(), 1e-7, f"{name} step {i}")
            up, down = data.step(1e-3, q, v, tau + e), data.step(1e-3, q, v, tau - e)
            column = np.concatenate([model.subtract(up[0], down[0]), up[1] - down[1]]) / (2 * h)
            held(np.abs(column - B[:, i]).max(), 1e-8, f"{name} step by tau {i}")


LAG = """
kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: arm, joint: {type: revolute, axis: y, position: 0.4}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}
states: {lag: {initial: 0.5, rate: "3*(position.arm - lag)"}}
effects: [{type: expression, joint: arm, force: "-20*lag"}]
"""


def test_two_rollouts_have_equal_bits_with_auxiliary_states():
    model = kt.Scene(LAG).model
    data = model.data()

    def rollout(x):
        q, v = model.initial
        for i in range(20):
            q, v, x = data.step(0.01, q, v, x=x, t=0.01 * i)
        return np.concatenate([q, v, x])

    first = rollout(model.initial_x)
    assert np.array_equal(data.x, [0.5]), "a step leaves the data as they are"
    assert np.array_equal(rollout(model.initial_x), first)
    assert not np.array_equal(rollout([0.6]), first)
    simulation = kt.Scene(LAG).simulation(step=0.01, duration=0.2)
    simulation.run()
    assert np.array_equal(np.concatenate([simulation.positions, simulation.velocities]), first[:2])
    q, v = model.initial
    A, again = data.step_derivatives(0.01, q, v)[0], data.step_derivatives(0.01, q, v, x=[0.5])[0]
    assert A.shape == (3, 3) and np.array_equal(A, again) and np.array_equal(data.x, [0.5])
    data.x = [0.6]
    assert np.array_equal(data.step(0.01)[2], data.step(0.01, x=[0.6])[2])


def test_two_rollouts_of_a_batch_have_equal_bits_with_auxiliary_states():
    model = kt.Scene(LAG).model
    batch = model.batch(5, method="rk4")
    Q, V, X = np.linspace(-1, 1, 5)[:, None], np.zeros((5, 1)), np.linspace(0, 1, 5)[:, None]
    first = batch.step(0.01, 20, Q, V, X=X)
    assert all(np.array_equal(a, b) for a, b in zip(batch.step(0.01, 20, Q, V, X=X), first))
    data = model.data()
    for i in range(5):
        q, v, x = Q[i], V[i], X[i]
        for _ in range(20):
            q, v, x = data.step(0.01, q, v, x=x)
        assert np.array_equal(np.concatenate([q, v, x]), [first[0][i, 0], first[1][i, 0], first[2][i, 0]])
    initial = batch.step(0.01, 1, Q, V)[2]
    assert np.array_equal(initial, batch.step(0.01, 1, Q, V, X=np.full((5, 1), 0.5))[2])
    assert batch.forward_dynamics(Q, V, X=X)[4, 0] != batch.forward_dynamics(Q, V)[4, 0]


def test_the_jacobian_of_a_point_is_its_velocity(scenes, held, random_state):
    model = kt.load(scenes / "double-pendulum.yaml").model
    data = model.data()
    for seed in range(5):
        q, v, _ = random_state(model, seed)
        data.kinematics(q, v)
        name = model.bodies[-1]
        held(np.abs(data.jacobian(name)[3:] @ v - data.velocity(name)).max(), 1e-13)
        rotation, origin = data.pose(name)
        held(np.abs(rotation.T @ rotation - np.eye(3)).max(), 1e-14)
        held(np.abs(origin - data.position(name)).max(), 0.0)


def test_a_batch_has_the_bits_of_single_calls(scenes, random_state):
    for name in TREES:
        model = kt.load(scenes / f"{name}.yaml").model
        data, count = model.data(), 37
        states = [random_state(model, seed) for seed in range(count)]
        Q, V, TAU = (np.array([state[k] for state in states]) for k in range(3))
        for threads in (1, 2):
            batch = model.batch(count, threads=threads)
            A = batch.forward_dynamics(Q, V, TAU)
            assert all((A[i] == data.forward_dynamics(*states[i])).all() for i in range(count))
            assert (batch.inverse_dynamics(Q, V, A)[5] == data.inverse_dynamics(Q[5], V[5], A[5])).all()
    batch = model.batch(count, method="rk4")
    Q2, V2 = batch.step(1e-3, 1, Q, V, TAU)
    q2, v2 = data.step(1e-3, Q[7], V[7], TAU[7])
    assert (Q2[7] == q2).all() and (V2[7] == v2).all()


def test_a_batch_takes_a_sequence_of_joint_forces(scenes, random_state):
    model, count, samples, steps, h = kt.load(scenes / "arm7.yaml").model, 11, 3, 7, 1 / 1024
    states = [random_state(model, seed) for seed in range(count)]
    Q, V = (np.array([state[k] for state in states]) for k in range(2))
    TAU = np.array([[random_state(model, 100 * seed + k)[2] for k in range(samples)] for seed in range(count)])
    batch = model.batch(count, threads=2, method="rk4")
    Q1, V1 = batch.step(h, steps, Q, V, TAU, hold=2)  # samples 0 0 1 1 2 2 2
    for i in range(count):
        simulation = kt.Simulation(model, step=h, integrator="rk4")
        simulation.set_state(0.0, Q[i], V[i])
        for k in range(steps):
            simulation.torque[:] = TAU[i, min(k // 2, samples - 1)]
            simulation.step()
        assert (simulation.positions == Q1[i]).all() and (simulation.velocities == V1[i]).all()
    batch.step(h, 0, Q, V)
    batch.step(h, 6, TAU=TAU)  # the states in the memory, two steps a sample
    Q2, V2 = batch.step(h, 6, Q, V, TAU)
    assert (batch.rows(batch.q) == Q2).all() and (Q2 != Q1).any()
    constant = model.batch(count, method="rk4").step(h, 6, Q, V, TAU[:, 0])
    assert (batch.step(h, 6, Q, V, TAU[:, :1])[0] == constant[0]).all() and (batch.step(h, 6, Q, V, TAU[:, 0])[0] == constant[0]).all()
    for wrong in ({"TAU": TAU[:, :, :-1]}, {"TAU": TAU[:-1]}, {"TAU": TAU, "hold": 0}, {"TAU": TAU[:, 0], "hold": 1}):
        with pytest.raises(kt.Error):
            batch.step(h, 6, Q, V, **wrong)
    with pytest.raises(kt.Error, match="no multiple"):
        batch.step(h, 7, Q, V, TAU)


def test_friction_of_a_hard_contact_is_set_at_run_time(held):
    g, tilt, mu, t1 = 9.81, 0.35, 0.1, 0.25
    scene = kt.Scene(f"""
kinetree: 1
gravity: [{g * np.sin(tilt):.17g}, 0, {-g * np.cos(tilt):.17g}]
bodies:
  - {{name: slide, joint: {{type: prismatic, axis: x}}, mass: 1}}
  - {{name: foot, parent: slide, joint: {{type: prismatic, axis: z, position: 0.1}}, mass: 1}}
effects: [{{name: floor, type: contact, point: foot, radius: 0.1, plane: world, axis: z, friction: 0.8, restitution: 0}}]
""")
    model = scene.model.copy()
    simulation = scene.simulation(model=model, step=1e-3, duration=10.0)
    simulation.advance(t1)
    held(abs(simulation.positions[0]), 1e-12, "sticks, m")
    simulation.set("effect floor.friction", mu)
    simulation.advance(1.0)
    pull = g * (np.sin(tilt) - 0.5 * mu * np.cos(tilt))  # half of the weight presses
    held(abs(simulation.positions[0] - 0.5 * pull * (1.0 - t1) ** 2), 1e-9, "slides, m")
    assert model.get("effect floor.friction") == mu
    for wrong in (-0.1, float("nan")):
        with pytest.raises(kt.Error):
            simulation.set("effect floor.friction", wrong)


def test_parameters_of_a_copy_change_the_dynamics(held):
    rod = kt.mechanism([kt.Body("rod", joint=kt.revolute("y"), mass=1.0, shape=kt.rod(to=[1, 0, 0]))], gravity=[0, 0, -9.81])
    copy = rod.model.copy()
    before = copy.get("rod.mass")
    copy.set("rod.mass", 3.0)
    assert before == 1.0 and copy.get("rod.mass") == 3.0 and rod.model.get("rod.mass") == 1.0
    mass = copy.data().mass_matrix()[0, 0]
    held(abs(mass - (3 * 0.25 + (1 / 12))), 1e-14, "inertia about the pin")  # the moment about the centre stays
    with pytest.raises(kt.Error, match="mas"):
        copy.set("rod.mas", 2.0)


def test_a_loop_is_closed_at_the_place_of_its_body():
    text = """
kinetree: 1
gravity: [0, 0, 0]
bodies:
  - {name: rod, joint: {type: planar}, mass: 1, shape: {type: rod, to: [1, 0, 0]}, markers: {tip: [1, 0, 0]}}
loops:
  - {name: pin, type: spherical, between: [{body: world, at: [5, 5, 0]}, {body: rod, at: [0, 0, 0]}], switched: off}
"""
    model = kt.Scene(text).model.copy()
    data = model.data()
    data.kinematics([0.3, 0.2, 0.5])
    place = data.place("pin")
    assert np.abs(place[:3] - [0.3, 0.2, 0]).max() < 1e-15
    model.set("loop pin.place", place)
    assert np.abs(np.asarray(model.get("loop pin.place")) - place).max() < 1e-15
    for ask, name in ((data.place, "pn"), (data.position, "ro"), (data.position, "rod.ti")):
        with pytest.raises(kt.ArgumentError, match="did you mean '(pin|rod|tip)'"):
            ask(name)
    with pytest.raises(kt.Error, match="leaves the plane"):
        model.set("loop pin.place", [0, 0, 1, 0, 0, 0])


LEG = """
kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: foot, joint: {type: free, position: {position: [0.3, -0.2, 0.5]}, velocity: {linear: [0.7, 0.4, 0.2], angular: [0.5, -0.3, 1.1]}},
     mass: 0.5, inertia: [0.01, 0.02, 0.03], markers: {sole: [0.01, 0, -0.05]}}
  - {name: trunk, parent: foot, joint: {type: revolute, axis: y, at: [0, 0, 0.1]}, mass: 2, com: [0, 0, 0.3], inertia: [0.1, 0.2, 0.1]}
effects:
  - {type: joint_spring, joint: trunk, stiffness: 80, damping: 1}
  - {name: floor, type: contact, point: trunk, plane: world, restitution: 0}
loops: [{name: hold, type: weld, between: [foot.sole, world], switched: off}]
simulate: {duration: 2, integrator: rk4, step: 0.001}
"""
EVENTS = """
events:
  - {name: lands, when: marker.foot.sole.z, direction: falling, limit: 1, then: {engage_here: hold}}
  - {name: lets go, when: t - 0.6, then: {release: hold}}
"""


def test_footholds_of_events_are_kept():
    """By checkpoints, pickles and copies."""
    scene, times = kt.Scene(LEG + EVENTS), [0.2, 0.45, 0.55, 0.65]
    one, other, blocks = scene.simulation(), scene.simulation(), []
    for time in times:
        one.advance(time)
        blocks.append(one.save())
    other.advance(0.5)
    assert np.abs(other.states[:2] - [0.3, -0.2]).max() > 0.1
    for k in reversed(range(len(times))):
        other.restore(blocks[k])
        for time in times[k + 1:]:
            other.advance(time)
        assert np.array_equal(other.positions, one.positions) and np.array_equal(other.states, one.states), times[k]
    other.restore(blocks[1])
    for copied in (pickle.loads(pickle.dumps(other)), copy.deepcopy(other)):
        for time in times[2:]:
            copied.advance(time)
        assert np.array_equal(copied.positions, one.positions)


def test_a_program_sets_a_foothold():
    """An event of Python does what engage_here of a scene does, to the last bit."""
    model = kt.Scene(LEG).model.copy()
    data, seen, losses = model.data(), model.data(), []
    simulation = model.scene.simulation(model=model)

    def height(instant):
        seen.kinematics(instant.q)
        return seen.position("foot.sole")[2]

    def land(at):
        data.kinematics(at.positions)
        at.set("loop hold.place", data.place("hold"))
        losses.append(at.switch("hold"))

    simulation.on("lands", height, land, direction="falling")
    simulation.advance(0.5)
    scene = kt.Scene(LEG + EVENTS).simulation()
    scene.advance(0.5)
    assert len(losses) == 1 and losses[0] > 1
    assert np.array_equal(simulation.positions, scene.positions) and np.array_equal(simulation.velocities, scene.velocities)
    assert simulation.switch("hold", False) == 0
    with pytest.raises(kt.ArgumentError, match="no loop or effect"):
        simulation.switch("hald")
    with pytest.raises(kt.ArgumentError, match="switch by themselves"):
        simulation.switch("floor")
    with pytest.raises(kt.ArgumentError, match="no `switched` in the scene"):
        kt.Scene(LEG.replace(", switched: off", "").replace("[foot.sole, world]", "[foot.sole, {body: world, at: [0.31, -0.2, 0.45]}]")).simulation().switch("hold")


def test_names_in_the_documentation_of_get_are_names():
    text = """
kinetree: 1
bodies:
  - {name: arm, joint: {type: revolute, axis: z}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}
effects:
  - {name: spring, type: joint_spring, joint: arm, stiffness: 3}
"""
    model = kt.Scene(text).model
    names = re.findall('``"([^"]+)"``', kt.Model.get.__doc__)
    assert len(names) == 4 and model.get("effect spring.stiffness") == 3.0
    for name in names:
        model.get(name)
