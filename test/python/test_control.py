"""Control loops: torques by a view, laws of Python and of C, events that act, and checkpoints within a loop."""
# SPDX-License-Identifier: Apache-2.0
import copy
import ctypes
import gc
import pathlib
import shutil
import signal
import subprocess
import weakref

import numpy as np
import pytest

import kinetree as kt

ROOT = pathlib.Path(__file__).resolve().parents[2]
LAW = """
#include <kinetree/kinetree.h>
int law(void *user, double t, const double *q, const double *v, double *tau) {
    (void)user;
    (void)t;
    for (int i = 0; i < 7; i++)
        tau[i] = -20 * q[i] - 4 * v[i];
    return t > 0.9 ? 1 : 0;
}
int spring(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    (void)user, (void)t, (void)v, (void)balance;
    force[0] = -40 * (q - 2);
    return 0;
}
int height(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error, (void)user;
    *value = at->q[0] - 1.0;
    return 0;
}
"""
BALL = """
kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: ball, joint: {type: prismatic, axis: z, position: 2}, mass: 1, shape: {type: sphere, radius: 0.1}}
simulate: {duration: 1}
"""


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """A library of functions that the compiler of this machine made."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("cc is not on this machine")
    folder = tmp_path_factory.mktemp("law")
    (folder / "law.c").write_text(LAW)
    subprocess.run([compiler, "-O2", "-shared", "-fPIC", "-ffp-contract=off", f"-I{ROOT / 'include'}", "-o", folder / "law.so", folder / "law.c"], check=True)
    return ctypes.CDLL(str(folder / "law.so"))


def arm(scenes, duration=0.5, **options):
    return kt.load(scenes / "arm7.yaml").simulation(step=1e-3, integrator="rk4", duration=duration, **options)


def by_turns(simulation, law):
    for each in simulation:
        each.torque[:] = law(each.time, each.positions, each.velocities)
    return simulation.state.copy()


def test_a_loop_ends_with_its_time_a_fault_or_a_stop_and_only_once(scenes):
    simulation = arm(scenes, duration=0.01)
    turns = iter(simulation)
    assert iter(turns) is turns and next(turns) is simulation and simulation.time == 0.0
    assert len(list(turns)) == 9 and list(turns) == [] and list(simulation) == []
    failing = kt.JointForce("ball", lambda t, q, v: 1 / (t < 0.0055))
    falling = kt.Simulation(kt.Model(kt.Scene(BALL), effects=[failing]), step=1e-3, duration=0.01)
    turns, count = iter(falling), 0
    with pytest.raises(ZeroDivisionError):
        for _ in turns:
            count += 1
    assert count == 6 and list(turns) == []
    assert [len(simulation.run()["time"]) for _ in range(2)] == [1, 0]
    simulation.advance(0.02)
    with pytest.raises(kt.ArgumentError, match="the run ends at 0.01 s, and the simulation is at 0.02 s"):
        simulation.run()
    stopping = kt.Scene(BALL).simulation(step=1e-3, duration=1)
    stopping.on("low", lambda at: at.q[0] - 1.9, stop=True)
    ended = sum(1 for _ in stopping)
    print("       turns until the event:", ended)
    assert ended == 143 and stopping.stopped == "low"  # 0.1 m in 0.1428 s


def test_times_before_the_present_one_are_rejected_with_the_name_of_the_argument(scenes):
    simulation = arm(scenes, duration=1)
    simulation.advance(0.01)
    with pytest.raises(kt.ArgumentError, match="^t: 0.005.* s must be a time not before the current one"):
        simulation.advance(0.005)
    with pytest.raises(kt.ArgumentError, match="^until: 0.005.* s is not after the current time"):
        simulation.step(until=0.005)


def test_an_iterator_without_a_simulation_has_no_turn(scenes):
    made = type(iter(arm(scenes)))
    try:
        empty = made()
    except TypeError:
        return
    assert list(empty) == []


def test_all_ways_to_set_torques_have_equal_bits(scenes, compiled):
    def law(t, q, v):
        return -20 * q - 4 * v

    by_view, by_call, by_python, by_c = (arm(scenes) for _ in range(4))
    by_turns(by_view, law)
    for each in by_call:
        each.set_torque(law(each.time, each.positions, each.velocities))
    by_python.control(law)
    by_c.control(compiled.law)
    assert by_view.time == 0.5 and by_view.counts["steps"] == 500
    assert not np.array_equal(by_view.positions, arm(scenes, duration=0.5).run()["q"][-1])
    for other in (by_call, by_python, by_c):
        assert np.array_equal(other.state, by_view.state) and other.time == 0.5


def test_feedback_is_its_formula(scenes, held):
    gain = np.hstack([20 * np.eye(7), 4 * np.eye(7)])
    gain[2, 5] = 3.0
    q, v, torque = np.linspace(-0.3, 0.3, 7), np.linspace(0, 1, 7), np.linspace(1, 2, 7)
    python, turns, whole = (arm(scenes) for _ in range(3))
    by_turns(python, lambda t, at, rate: torque + gain @ np.concatenate([q - at, v - rate]))
    law = turns.feedback(gain, q=q, v=v, torque=torque)
    for _ in turns:
        law()
    whole.control(whole.feedback(gain, q=q, v=v, torque=torque))
    held(np.abs(turns.state - python.state).max(), 1e-10, "rad and rad/s")
    assert np.array_equal(turns.state, whole.state)
    law.q[:] = np.nan
    law()
    with pytest.raises(kt.StepError, match="torque is nan"):
        turns.tick(1e-3)
    with pytest.raises(kt.ArgumentError, match=r"gain: expected shape \(7, 14\), got \(7, 7\)"):
        turns.feedback(np.eye(7))
    with pytest.raises(kt.ArgumentError, match="another simulation"):
        whole.control(law)


def test_torques_that_are_not_finite_leave_the_previous_ones(scenes):
    simulation, other = arm(scenes), arm(scenes)
    wrong, good = np.full(7, np.nan), np.linspace(1, 2, 7)
    for each in (simulation, other):
        each.set_torque(good)
    with pytest.raises(kt.StepError, match="torque is nan"):
        simulation.set_torque(wrong)
    assert np.array_equal(simulation.torque, good)
    simulation.torque[3] = np.inf
    with pytest.raises(kt.StepError, match="torque is inf"):
        simulation.tick(1e-3)
    with pytest.raises(kt.StepError, match="torque is nan"):
        simulation.control(lambda t, q, v: wrong, until=0.01)
    assert np.array_equal(simulation.torque, good) and simulation.time == 0.0
    simulation.tick(1e-3)
    other.tick(1e-3)
    assert np.array_equal(simulation.state, other.state)


def test_period_of_a_loop_is_above_zero(scenes):
    for period in (0.0, -1.0):
        with pytest.raises(kt.ArgumentError, match=f"period: expected a time above zero, got {period}"):
            arm(scenes).control(lambda t, q, v: None, period=period)


def test_feedback_takes_differences_of_quaternions(held):
    scene = kt.mechanism([kt.Body("top", joint=kt.joint.spherical(), mass=1, inertia=[1, 1, 1])])
    simulation = scene.simulation(step=1e-3, duration=10)
    wanted = scene.model.add(scene.model.initial[0], [0.5, -0.4, 0.3])
    simulation.control(simulation.feedback(np.hstack([4 * np.eye(3), 4 * np.eye(3)]), q=wanted))
    held(np.abs(scene.model.subtract(wanted, simulation.positions)).max(), 1e-6, "rad")


def test_a_law_ends_its_loop_and_its_exception_reaches_the_caller(scenes, compiled):
    simulation = arm(scenes, duration=2)
    simulation.control(compiled.law)
    assert 0.9 < simulation.time < 0.9025
    simulation.control(lambda t, q, v: None if t > 1.0 else np.zeros(7))
    assert 1.0 < simulation.time < 1.0025
    with pytest.raises(ZeroDivisionError):
        simulation.control(lambda t, q, v: 1 / 0)
    with pytest.raises(kt.ArgumentError, match=r"the result of the law: expected shape \(7,\)"):
        simulation.control(lambda t, q, v: np.zeros(6))
    with pytest.raises(kt.ArgumentError, match="wrap an address"):
        simulation.control(12345)
    with pytest.raises(kt.Busy):
        simulation.control(lambda t, q, v: simulation.tick(1e-3))
    simulation.control(lambda t, q, v: np.zeros(7), until=1.1)
    assert abs(simulation.time - 1.1) < 1e-12


def test_compiled_forces_and_events_are_those_of_python(compiled, held):
    scene = kt.Scene(BALL)
    ends = []
    for spring, height in ((compiled.spring, compiled.height), (lambda t, q, v: -40 * (q - 2), lambda at: at.q[0] - 1.9),
                           (kt.Compiled(ctypes.cast(compiled.spring, ctypes.c_void_p).value, compiled), lambda at: at.q[0] - 1.9)):
        simulation = kt.Simulation(kt.Model(scene, effects=[kt.JointForce("ball", spring)]), step=1e-3, integrator="rk4", duration=0.5)
        simulation.on("low", height, stop=True, direction="falling")
        simulation.advance(0.1)
        ends.append(simulation.positions[0])
    assert ends[0] == ends[1] == ends[2]
    free = scene.simulation(duration=1, tolerance=1e-10)
    free.on("low", compiled.height, stop=True)
    free.run()
    held(abs(free.time - np.sqrt(2 / 9.81)), 1e-12, "time of the event, s")


def test_the_action_of_an_event_may_change_the_motion(held):
    simulation = kt.Scene(BALL).simulation(duration=1.2, tolerance=1e-11)
    bounces = []

    def bounce(at):
        bounces.append(at.time)
        at.jump(v=-0.5 * at.velocities)

    simulation.on("floor", lambda at: at.q[0], bounce, direction="falling")
    simulation.run()
    fall = np.sqrt(4 / 9.81)
    held(abs(bounces[0] - fall), 1e-10, "first bounce, s")
    rise = 0.5 * 9.81 * fall
    held(abs(simulation.positions[0] - (rise * (1.2 - fall) - 0.5 * 9.81 * (1.2 - fall) ** 2)), 1e-8, "height at the end, m")


def test_a_checkpoint_keeps_the_torques(scenes):
    simulation = arm(scenes)
    simulation.torque[:] = np.linspace(1, 2, 7)
    simulation.advance(0.1)
    other = copy.deepcopy(simulation)
    assert np.array_equal(other.torque, simulation.torque) and other.torque is not simulation.torque
    for each in (simulation, other):
        each.advance(0.3)
    assert np.array_equal(simulation.state, other.state)
    plain = arm(scenes)
    plain.advance(0.3)
    assert not np.array_equal(plain.state, simulation.state)


def test_a_tick_takes_every_number(scenes):
    def moved(*ticks):
        simulation = kt.load(scenes / "arm7.yaml").simulation(step=1e-3, integrator="rk4", duration=9.0)
        simulation.torque[:] = 1.0
        for tick in ticks:
            tick(simulation)
        return simulation

    floats = moved(*[lambda each: each.tick(0.25)] * 3, lambda each: each.tick(1.0))
    mixed = moved(lambda each: each.tick(np.float64(0.25)), lambda each: each.tick(np.float32(0.25)), lambda each: each.tick(period=0.25), lambda each: each.tick(1))
    assert floats.time == mixed.time == 1.75 and np.array_equal(floats.state, mixed.state)
    for wrong, kind in (("x", TypeError), (None, TypeError), (-1.0, kt.ArgumentError), (float("nan"), kt.ArgumentError), (0, kt.ArgumentError)):
        with pytest.raises(kind, match="period"):
            mixed.tick(wrong)
    with pytest.raises(TypeError, match="period"):
        mixed.tick()
    with pytest.raises(TypeError):
        mixed.tick(1e-3, 1e-3)
    assert floats.time == mixed.time and np.array_equal(floats.state, mixed.state)


def test_torques_that_stay_do_not_restart_a_multistep_method(scenes):
    ticks, whole = (kt.load(scenes / "arm7.yaml").simulation(step=1e-3, integrator="ab4", duration=0.1) for _ in range(2))
    for each in (ticks, whole):
        each.torque[:] = 1.0
    for _ in range(100):
        ticks.torque[:] = np.ones(7)
        ticks.tick(1e-3)
    whole.advance(0.1)
    print("       evaluations of 100 steps:", ticks.counts["evaluations"], whole.counts["evaluations"])
    assert np.array_equal(ticks.state, whole.state) and ticks.counts == whole.counts


def test_sensors_are_those_of_closed_forms_and_of_the_command(scenes, held):
    rod = kt.mechanism([kt.Body("rod", joint=kt.revolute("y", position=np.pi / 2), mass=2, shape=kt.rod(to=[1, 0, 0]))], gravity=[0, 0, -9.81])
    seen = rod.simulation(step=1e-3, sensors=["acceleration", "reaction", "energy"]).sense()
    held(np.abs(seen["reaction"][1] - [0, 0, 0, 0, 0, 2 * 9.81]).max(), 1e-14 * 20, "wrench of the pin, N m and N")
    held(abs(seen["energy"][1] + 2 * 9.81 * 0.5), 1e-14, "J")
    bar = kt.load(scenes / "four-bar.yaml")
    run = bar.run(duration=0.2, record="acceleration,reaction", integrator="rk4", step=1e-3, interval=0.1)
    simulation = bar.simulation(step=1e-3, integrator="rk4", sensors=["acceleration", "reaction"])
    simulation.advance(0.1)
    seen = simulation.sense()
    a = [column[1] for column in run.matching("acceleration.*").values()]
    assert len(a) == bar.model.nv and np.array_equal(seen["acceleration"], a)
    assert seen["loop_reaction"].shape == (1, 6)
    for i, body in enumerate(bar.model.bodies[1:], 1):
        wrench = [run[f"reaction.{body}.{each}"][1] for each in ("mx", "my", "mz", "fx", "fy", "fz")]
        held(np.abs(seen["reaction"][i] - wrench).max(), 0.0, f"reaction of {body}, N and N m")
    for wrong in (["acceleraton"], ["momentum"], "energy"):  # `sense` has no momentum
        with pytest.raises(kt.ArgumentError, match="sensors: expected a list of acceleration, energy, reaction, got"):
            bar.simulation(step=1e-3, sensors=wrong)


class Interrupted(Exception):
    """Raised by the handler of a signal."""


def interrupt(*_):
    raise Interrupted


def looped(simulation):
    for _ in simulation:
        pass


def test_a_signal_ends_each_call_with_its_exception(scenes):
    """The handler usually runs before the first line of a function that C calls. Its exception was lost: a loop ended in silence."""
    before = signal.signal(signal.SIGALRM, interrupt)
    effects = [kt.JointForce("crank", lambda t, q, v: 0.0)]
    scene = kt.load(scenes / "four-bar.yaml")
    uses = {"law": lambda s: s.control(lambda t, q, v: np.zeros(3)), "record": lambda s: s.run(), "loop": looped, "force": lambda s: s.advance(900.0),
            "event": lambda s: (s.on("never", lambda at: 1.0), s.advance(900.0))}
    ended = {}
    try:
        for name, use in uses.items():
            for _ in range(5):
                simulation = scene.simulation(step=1e-3, duration=1000.0, effects=effects if name == "force" else ())
                with pytest.raises(Interrupted):
                    signal.setitimer(signal.ITIMER_REAL, 0.02)
                    use(simulation)
                ended[name] = simulation.time
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert all(0.0 < t < 900.0 for t in ended.values()), ended


def test_a_loop_that_an_action_keeps_dies_with_its_simulation(scenes):
    class Controller:
        def __init__(self):
            self.simulation = kt.load(scenes / "four-bar.yaml").simulation(step=1e-3, duration=1.0)
            self.turns = iter(self.simulation)
            self.simulation.on("late", lambda at: at.t - 0.5, self.act)

        def act(self, simulation):
            pass

    controller = Controller()
    next(controller.turns)
    simulation = weakref.ref(controller.simulation)
    del controller
    gc.collect()
    assert simulation() is None


def test_contacts_have_the_force_on_the_first_body():
    ball = {"name": "ball", "mass": 2, "inertia": [1, 1, 1],
            "joint": {"type": "free", "position": {"position": [0, 0, 0.1]}, "velocity": {"linear": [5, 0, 0]}}}
    contact = {"name": "c", "type": "contact", "point": "ball", "radius": 0.1, "plane": "world", "axis": "z", "restitution": 0, "friction": 0.3}
    scene = kt.Scene({"kinetree": 1, "gravity": [0, 0, -9.81], "bodies": [ball], "effects": [contact]})
    simulation = scene.simulation(duration=1, sensors=["reaction"])
    simulation.advance(0.1)
    [found] = simulation.contacts()
    assert found["name"] == "c" and not found["sticks"]
    assert np.allclose(found["force"], [-5.886, 0, 19.62], atol=1e-12)
    assert np.allclose(found["normal"], [0, 0, 1]) and abs(found["point"][2]) < 1e-15
    assert found["slip"] @ found["force"] < 0
    with pytest.raises(kt.ArgumentError, match="reactions"):
        scene.simulation(duration=1).contacts()
