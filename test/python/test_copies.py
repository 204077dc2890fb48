"""Copies: pickles, deep copies and checkpoints of simulations continue with equal bits, and damaged checkpoints are rejected."""
# SPDX-License-Identifier: Apache-2.0
import copy
import pickle
import random

import numpy as np
import pytest

import kinetree as kt

# Events set parameters of the model: an effect and a joint depend on them.
GEARS = """
kinetree: 1
parameters: {ratio: 3, stiffness: 400, torque: =2*ratio}
bodies:
  - {name: motor, joint: {type: revolute, position: 1}, mass: 1, inertia: [0.1, 0.1, 0.1]}
  - {name: wheel, joint: {type: revolute, at: [1, 0, 0]}, mass: 8, inertia: [2, 2, 2]}
effects:
  - {type: expression, joint: wheel, force: torque}
  - {type: joint_spring, joint: motor, stiffness: =stiffness}
events:
  - {name: shift, when: velocity.wheel > 2, then: {set: {ratio: 0.6*ratio, stiffness: 0.25*stiffness}}}
simulate: {duration: 2}
"""


def test_pickles_and_copies_continue_with_equal_bits(scenes):
    scene = kt.load(scenes / "double-pendulum.yaml")
    simulation = scene.simulation(step=1e-3, duration=1.0)
    simulation.advance(0.3)
    other, third = pickle.loads(pickle.dumps(simulation)), copy.deepcopy(simulation)
    for each in (simulation, other, third):
        each.advance(0.6)
    assert (simulation.positions == other.positions).all() and (simulation.velocities == third.velocities).all()
    assert pickle.loads(pickle.dumps(scene)).model.nv == scene.model.nv
    block = simulation.save()
    before = simulation.positions.copy()
    simulation.advance(0.8)
    simulation.restore(block)
    assert (simulation.positions == before).all()
    with pytest.raises(kt.ArgumentError):
        simulation.restore(block[:-8])


def test_a_checkpoint_continues_to_another_duration(scenes):
    """The motion is that of one simulation of the longer duration. Other settings are rejected in words of Python."""
    scene = kt.load(scenes / "double-pendulum.yaml")
    short, long, coarse = scene.simulation(step=1e-3, duration=1.0), scene.simulation(step=1e-3, duration=2.0), scene.simulation(step=2e-3, duration=1.0)
    short.advance(1.0)
    block = short.save()
    other = scene.simulation(step=1e-3, duration=2.0)
    other.restore(block)
    other.advance(2.0)
    long.advance(1.0)
    long.advance(2.0)
    assert other.time == long.time == 2.0
    assert np.array_equal(other.state, long.state)
    third = scene.simulation(step=1e-3, duration=2.0)
    third.restore(block)
    times = third.run()["time"]
    assert times[0] == 1.0 and times[-1] == 2.0 and np.array_equal(third.state, long.state)
    with pytest.raises(kt.ArgumentError, match="restore: it was made with a step of 0.001, and this simulation has 0.002; `set_state` takes over") as caught:
        coarse.restore(block)
    assert "kt_" not in str(caught.value)


def test_a_checkpoint_with_other_bytes_is_rejected(scenes):
    """C trusts indices in a checkpoint: a simulation that continued from such bytes ended the interpreter."""
    draw = random.Random(1)
    for name in ("double-pendulum", "shot", "humanoid"):
        simulation = kt.load(scenes / f"{name}.yaml").simulation(step=1e-3, duration=1.0)
        simulation.advance(0.05)
        block, state = simulation.save(), simulation.state.copy()
        for at in [*range(0, 16), *(draw.randrange(len(block)) for _ in range(200))]:
            other = bytearray(block)
            other[at] ^= 1 << draw.randrange(8)
            with pytest.raises(kt.ArgumentError, match="restore: the checkpoint is damaged"):
                simulation.restore(bytes(other))
        assert np.array_equal(simulation.state, state)
        simulation.restore(bytearray(block))


def test_parameters_that_events_set_belong_to_one_simulation():
    scene = kt.Scene(GEARS)
    run = scene.run()
    first, second = scene.simulation(), scene.simulation()
    first.advance(1.5)
    wanted = scene.simulation().run()
    assert np.array_equal(wanted["q"][:, 0], run["position.motor"]), "the command has the same bits, while the first simulation has shifted"
    records = second.run()
    assert np.array_equal(records["q"], wanted["q"]) and np.array_equal(scene.simulation(model=scene.model.copy()).run()["q"], wanted["q"])
    assert first.event_count("shift") == 1 and abs(first.states[1] - 100) < 1e-12


def test_parameters_that_events_set_return_with_a_state():
    scene = kt.Scene(GEARS)
    simulation = scene.simulation()
    simulation.advance(0.2)
    block = simulation.save()
    simulation.advance(2.0)
    end = simulation.state.copy()
    for other in (copy.deepcopy(simulation), pickle.loads(pickle.dumps(simulation))):
        simulation.advance(2.2)
        other.advance(2.2)
        assert np.array_equal(simulation.state, other.state)
        simulation.restore(block)
        simulation.advance(2.0)
    assert np.array_equal(simulation.state, end)
    simulation.restore(block)
    simulation.advance(2.0)
    assert np.array_equal(simulation.state, end)
    simulation.set_state(0.0, scene.model.initial[0])
    assert simulation.states[1] == 400
    simulation.advance(0.2)
    simulation.advance(2.0)
    assert np.array_equal(simulation.state, end)


def test_a_reset_simulation_has_the_bits_of_a_new_one(scenes):
    for name in ("four-bar", "arm7", "shot"):
        simulation, fresh = (kt.load(scenes / f"{name}.yaml").simulation(step=1e-3, duration=0.2) for _ in range(2))
        simulation.torque[:] = 0.5
        simulation.advance(0.1)
        simulation.reset()
        assert simulation.time == 0.0 and not simulation.torque.any()
        for each in (simulation, fresh):
            each.advance(0.2)
        assert np.array_equal(simulation.state, fresh.state) and simulation.counts == fresh.counts
    gears = kt.Scene(GEARS).simulation()
    gears.advance(2.0)
    end = gears.state.copy()
    gears.reset()
    gears.advance(2.0)
    assert np.array_equal(gears.state, end)


def test_events_come_before_a_reset(scenes):
    simulation = kt.load(scenes / "double-pendulum.yaml").simulation(step=1e-3, duration=1.0)
    simulation.on("down", lambda at: at.q[0] + 0.5, stop=True)
    simulation.advance(1.0)
    assert simulation.stopped == "down"
    time = simulation.time
    simulation.reset()
    simulation.advance(1.0)
    assert simulation.time == time and simulation.event_count("down") == 1
    simulation.on("late", lambda at: at.q[1])
    with pytest.raises(kt.ArgumentError, match="add events before the first step"):
        simulation.reset()


def test_a_deep_copy_has_events_forces_and_parameters_of_its_own(scenes):
    scene, seen = kt.load(scenes / "double-pendulum.yaml"), []
    spring = kt.JointForce("upper", lambda t, q, v: -3 * q)
    simulation = kt.Simulation(kt.Model(scene, effects=[spring]).copy(), step=1e-3, duration=1.0)
    simulation.set("upper.mass", 2.5)
    simulation.on("passes", lambda at: at.q[0] + 0.2, lambda each: seen.append(each), direction="falling")
    simulation.advance(0.1)
    other = copy.deepcopy(simulation)
    for each in (simulation, other):
        each.advance(0.9)
    assert np.array_equal(simulation.state, other.state) and seen == [simulation, other]
    other.set("upper.mass", 5.0)
    assert simulation.model.get("upper.mass") == 2.5 and other.model.get("upper.mass") == 5.0
    for each, what in ((simulation, "events of Python"), (simulation.model, "functions of Python")):
        with pytest.raises(TypeError, match=what):
            pickle.dumps(each)


def test_a_copied_batch_keeps_the_times_of_its_states():
    """A force by a function of time: v = 3 (1 - cos(pi t)) / (2 pi)."""
    model = kt.Scene("""
kinetree: 1
bodies: [{name: block, mass: 2, joint: {name: slide, type: prismatic, axis: x}}]
effects: [{type: motor, joint: slide, force: {sine: {amplitude: 3, frequency: 0.5}}}]
""").model
    batch = model.batch(11, method="rk4")
    batch.step(0.01, 50)
    copies = [copy.deepcopy(batch), pickle.loads(pickle.dumps(batch))]
    for each in (batch, *copies):
        each.step(0.01, 50)
        assert np.abs(each.rows(each.v) - 3 / np.pi).max() < 1e-9 and np.array_equal(each.v, batch.v)
    assert np.abs(batch.t.ravel()[:11] - 1.0).max() < 1e-13
    batch.t[:] = 1.5
    assert np.abs(batch.rows(batch.forward_dynamics()) + 1.5).max() < 1e-14
    for call in (lambda: batch.forward_dynamics(t=0.5), lambda: batch.step(0.01, 1, t=0.5)):
        with pytest.raises(kt.ArgumentError, match="t: it needs Q; without Q a batch computes the states in its memory"):
            call()


def test_a_copy_of_a_model_keeps_its_parameters(scenes):
    scene = kt.load(scenes / "double-pendulum.yaml")
    model = scene.model.copy()
    for name, value in (("upper.mass", 4.0), ("lower.com", [0.5, 0.1, 0.0]), ("upper.mass", 3.0)):
        model.set(name, value)
    q, v = np.array([0.3, -0.2]), np.array([1.0, 2.0])
    wanted = model.data().forward_dynamics(q, v, q)
    assert not np.array_equal(wanted, scene.model.data().forward_dynamics(q, v, q))
    for other in (copy.deepcopy(model), pickle.loads(pickle.dumps(model)), model.copy()):
        assert np.array_equal(other.data().forward_dynamics(q, v, q), wanted) and other is not model
        other.set("upper.mass", 1.0)
        assert model.get("upper.mass") == 3.0
    simulation = scene.simulation(step=1e-3, model=model)
    simulation.set("lower.mass", 0.5)
    simulation.advance(0.1)
    other = pickle.loads(pickle.dumps(simulation))
    for each in (simulation, other):
        each.advance(0.2)
    assert np.array_equal(simulation.state, other.state) and other.model.get("lower.mass") == 0.5


def test_a_scene_is_read_again_from_another_folder(scenes, tmp_path, monkeypatch):
    (tmp_path / "ball.yaml").write_text((scenes / "double-pendulum.yaml").read_text())
    monkeypatch.chdir(tmp_path)
    block = pickle.dumps(kt.load("ball.yaml", set={"bodies.upper.mass": 3}))
    monkeypatch.chdir("/")
    assert pickle.loads(block).model.get("upper.mass") == 3
