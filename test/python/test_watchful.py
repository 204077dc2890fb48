"""A simulation that Python drives warns as the command does: of its start, its step and its energy."""
# SPDX-License-Identifier: Apache-2.0
import pickle
import re
import warnings

import numpy as np
import pytest

import kinetree as kt

BOX = """<robot name="box"><link name="base"><inertial><mass value="4"/><inertia ixx="0.03" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.3 0.2 0.1"/></geometry></collision></link>
<link name="arm"><inertial><origin xyz="0 0 -0.1"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hip" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="9" velocity="9"/></joint></robot>"""

PENDULUM = """
kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: arm, joint: {type: revolute, axis: y, position: 1.2}, mass: 1, com: [0.5, 0, 0], inertia: [0, 0.0833333333333, 0.0833333333333]}
simulate: {duration: 2}
"""


def caught(act):
    """The texts of the warnings of a call."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        act()
    return [str(each.message) for each in found if issubclass(each.category, kt.KinetreeWarning)]


@pytest.fixture
def box(tmp_path):
    (tmp_path / "box.urdf").write_text(BOX)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return kt.load(tmp_path / "box.urdf", floating=True, ground=0)


def dropped(box, step):
    """With rk4, whose steps of 1 ms are too long for the contacts; the scene itself chooses radau5."""
    simulation = box.simulation(step=step, duration=2.0, integrator="rk4")
    q = simulation.positions.copy()
    q[2] = 0.2
    simulation.set_state(0.0, q)
    return simulation


def ways(box, step):
    """The ways in which a program moves a simulation to its end."""
    def loop(simulation):
        for _ in simulation:
            pass

    def ticks(simulation):
        while simulation.time < 2.0 - 1e-9:
            simulation.tick(step)

    def steps(simulation):
        while simulation.time < 2.0:
            simulation.step()

    for way in (loop, ticks, steps, lambda simulation: simulation.advance(2.0), lambda simulation: simulation.run(),
                lambda simulation: simulation.control(lambda t, q, v: np.zeros(len(v)))):
        simulation = dropped(box, step)
        yield simulation, caught(lambda: way(simulation))


def test_a_box_that_flies_is_reported_in_each_way_to_move_it(box, held):
    for simulation, found in ways(box, 1e-3):
        held(1 / simulation.positions[2], 1.0, "a height of more than 1 m, inverse")
        codes = [each["code"] for each in simulation.warnings]
        assert codes.count("energy") == 1 and sum("energy rises" in each for each in found) == 1, codes
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(kt.KinetreeWarning, match="energy rises"):
            for _ in dropped(box, 1e-3):
                pass


def test_the_energy_of_a_motion_is_known_before_a_fault(held):
    """A mass falls by 0.25 m, 2.4525 J per kg, onto a floor on which steps of 0.01 s fail within a few steps."""
    body = {"name": "p", "joint": {"type": "prismatic", "axis": "z", "position": 0.3}, "mass": 1, "markers": {"c": [0, 0, 0]}}
    floor = {"type": "contact", "point": "p.c", "radius": 0.05, "plane": "world", "axis": "z", "stiffness": 1e6}
    scene = kt.Scene({"kinetree": 1, "gravity": [0, 0, -9.81], "bodies": [body], "effects": [floor], "simulate": {"duration": 1}})
    found = caught(lambda: [None for _ in scene.simulation(step=0.01, integrator="rk4")])
    energies = [float(each) for words in found for each in re.findall(r"times the energy of the motion \(([-+.\de]+) J\)", words)]
    print("      ", found)
    assert len(energies) == 1
    held(abs(energies[0] / 2.4525 - 1), 0.1, "off the energy of the fall")


def test_an_unstable_step_is_reported():
    scene = kt.Scene(PENDULUM + "effects: [{name: d, type: joint_damper, joint: arm, damping: 940}]\n")
    simulation = scene.simulation(step=5e-4)
    found = caught(lambda: [None for _ in simulation])
    assert not found and not simulation.warnings
    simulation, failing = scene.simulation(step=2e-3), scene.simulation(step=2e-3)
    caught(lambda: [simulation.tick(2e-3) for _ in range(10)] and simulation.advance(0.3))
    assert "unstable_step" in [each["code"] for each in simulation.warnings]
    assert caught(lambda: simulation.advance(0.31)) == []

    def fail():
        with pytest.raises(kt.StepError, match="not finite"):
            failing.advance(2.0)
    assert any("are too long for rk4 to be stable" in each for each in caught(fail))


def test_small_steps_are_not_reported(box, held):
    for simulation, found in ways(box, 5e-5):
        held(abs(simulation.positions[2] - 0.0499), 1e-3, "m, the height of a box at rest")
        assert not found and {each["code"] for each in simulation.warnings} == {"left_out"}, found


def test_the_words_are_those_of_the_command():
    scene = kt.Scene(PENDULUM.replace("{duration: 2}", "{duration: 2, integrator: rk4, step: 0.25}"))
    simulation = scene.simulation()
    caught(simulation.run)

    def without_time(texts):  # a run also watches the scale of energies between its records
        return [re.sub(r"from t = \S+ s", "", each) for each in texts]
    run = caught(scene.run)
    assert without_time(run) == without_time(caught(lambda: scene.simulation().run())) and len(run) == 2
    assert [each["code"] for each in simulation.warnings] == [each["code"] for each in scene.run(quiet=True).warnings]


def test_energy_is_watched_without_torques_and_from_each_new_start(held):
    scene = kt.Scene(PENDULUM)
    assert not caught(lambda: scene.simulation(step=1e-3).advance(2.0))
    coarse = scene.simulation(step=0.25, integrator="euler")
    assert any("the total energy is off" in each for each in caught(lambda: coarse.advance(2.0)))
    driven = scene.simulation(step=1e-3)

    def push():
        for each in driven:
            each.torque[0] = 5.0
    assert not caught(push) and driven.torque[0] == 5.0
    jumping = scene.simulation(step=1e-3)

    def kick():
        for k, each in enumerate(jumping):
            if k % 500 == 499:
                each.jump(v=[float(k)**0.5])
    assert not caught(kick)
    held(abs(jumping.velocities[0]) < 10, 0, "it was not kicked")


def test_a_verdict_comes_within_a_loop_without_an_end():
    simulation = kt.Scene(PENDULUM).simulation(step=0.1, integrator="euler", duration=1e9)

    def ticks():
        for _ in range(3000):
            simulation.tick(0.1)
    assert any("energy" in each for each in caught(ticks))


def test_notes_of_a_load_are_warnings(tmp_path):
    (tmp_path / "box.urdf").write_text(BOX)
    found = caught(lambda: kt.load(tmp_path / "box.urdf", floating=True, ground=0))
    assert any("m deep in the ground" in each for each in found) and any("act as stops" in each for each in found), found
    simulation = kt.load(tmp_path / "box.urdf", floating=True, ground=0).simulation(step=1e-5, duration=1e-4, integrator="rk4")
    assert not [each for each in caught(lambda: simulation.advance(1e-4)) if "m deep in the ground" in each]
    assert any("m deep in the ground" in each["what"] for each in simulation.warnings)


def test_the_watch_changes_no_bit_and_copies_are_watched(box, held):
    fast, slow = dropped(box, 1e-3), dropped(box, 1e-3)
    caught(lambda: fast.advance(1.0))
    for k in range(1000):
        caught(lambda: slow.tick(1e-3))
        assert not (k % 100) or slow.warnings is not None
    held(np.abs(fast.state - slow.state).max(), 0.0, "a state by one call and by 1000")
    again = pickle.loads(pickle.dumps(dropped(box, 1e-3)))
    caught(lambda: again.advance(2.0))
    assert any(each["code"] == "energy" for each in again.warnings)
    forced = kt.Simulation(kt.Model(kt.Scene(PENDULUM), effects=[kt.JointForce("arm", lambda t, q, v: -v)]), step=1e-2)
    assert not caught(lambda: forced.advance(1.0)) and forced.warnings == []


def test_values_that_assembly_moves_are_reported():
    """Loops that the given angles leave open: the run, and a simulation from its first step on, name the values."""
    def bar(name, parent, length, at, angle):
        return kt.Body(name, parent=parent, joint=kt.revolute("y", at=at, position=angle), mass=1, shape=kt.shape.rod(to=[length, 0, 0]), markers={"end": [length, 0, 0]})

    def linkage(rocker):
        bars = [bar("crank", None, 0.3, [0, 0, 0], -1.0), bar("coupler", "crank", 0.9, [0.3, 0, 0], 0.5), bar("rocker", None, 0.6, [0.8, 0, 0], rocker)]
        return kt.mechanism(bars, loops=[kt.loop.revolute(name="pin", between=["coupler.end", "rocker.end"], axis="y")])

    scene = linkage(-1.5)
    simulation = scene.simulation(step=1e-3, duration=0.01)
    start = simulation.positions.copy()
    for found, warnings_of in ((caught(lambda: scene.run(duration=0.01)), scene.run(duration=0.01, quiet=True).warnings),
                               (caught(lambda: simulation.tick(1e-3)), simulation.warnings)):
        assert sum("assembly moved initial values that the scene gives: crank position from -1 to" in each for each in found) == 1, found
        moved = [each for each in warnings_of if each["code"] == "start_moved"]
        assert len(moved) == 1 and moved[0]["value"] == 3 and f"rocker position from -1.5 to {start[2]:.6g}" in moved[0]["what"]
    assert not caught(lambda: simulation.tick(1e-3))
    closed = kt.mechanism([bar("arm", None, 0.3, [0, 0, 0], -1.0)], gravity=[0, 0, -9.81])
    assert not caught(lambda: closed.run(duration=0.01)) and not caught(lambda: closed.simulation(step=1e-3, duration=0.01).tick(1e-3))
