"""FMUs after an error of the importer, and after a return to an earlier state (fmu.py)."""
# SPDX-License-Identifier: Apache-2.0
import ctypes
import math
import re

from archive import COMMAND, SCENES, Fmu, run
from claims import claim, note
from complaints import in_process
from instance import SIZE, Instance, reals

SCENE = """kinetree: 1
parameters: {m: 2, reach: 1}
bodies:
  - {name: cart, mass: =m, joint: {name: slide, type: prismatic, axis: x}}
  - {name: arm, parent: cart, mass: 1, com: [=reach, 0, 0], inertia: [1, 1, 1],
     joint: {name: pin, type: revolute, axis: y}}
simulate: {integrator: rk4, step: 0.001, duration: 1}
output: {record: [position]}
"""
# The loop closes for lengths above zero alone.
DRIVEN = """kinetree: 1
bodies:
  - {name: one, mass: 1, joint: {type: prismatic, axis: x}}
loops:
  - {name: rod, type: distance, between: [{body: world, at: [1, 0, 0]}, one], length: 1}
simulate: {integrator: rk4, step: 0.001, duration: 1}
output: {record: [position]}
"""
APART = """kinetree: 1
bodies:
  - {name: cart, mass: 1, joint: {type: prismatic, axis: x, velocity: 3}}
initial: {hold: [cart]}
loops:
  - {name: drive, type: motion, joint: cart, position: {polynomial: [0, 3]}}
simulate: {duration: 1}
"""


def written(folder, name, text, *options):
    scene = folder / f"{name}.yaml"
    scene.write_text(text)
    return Fmu(scene, folder, *options)


def rejected(instance, words, call, *arguments):
    """Faults unless a call fails with these words."""
    count = len(instance.messages)
    status = instance.status(call, *arguments)
    said = instance.messages[count:]
    return [] if status == 3 and any(words in text for text in said) else [f"{call}: status {status}, {said}"]


def set_wrongly(fmu, exchange):
    """Gives parameters with which the scene cannot be compiled, calls further functions, and gives right ones."""
    problems = []
    instance = Instance(fmu, exchange, initializes=True)
    kept = instance.keep()
    for wrong in ({"m": -1.0}, {"reach": 1e300}):
        instance.set(**wrong)
        problems += rejected(instance, "body '", "ExitInitializationMode")
        problems += rejected(instance, "", "DoStep", ctypes.c_double(0), ctypes.c_double(0.1), ctypes.c_bool(True),
                             *(ctypes.byref(ctypes.c_double()) for _ in range(4)))
        instance.set(m=4.0, reach=0.5)
        problems += [] if instance.get("m", "reach") == [4.0, 0.5] else [str(instance.get("m", "reach"))]
        instance.set(**wrong)
        instance.restore(kept)
        problems += [] if instance.get("m", "reach") == [2.0, 1.0] else ["the state has other parameters"]
    instance.set(m=-1.0)
    instance.try_set(m=-2.0)
    instance.call("Reset")
    return problems


def check_wrong_parameters(folder):
    fmu = written(folder, "wrong", SCENE)
    problems = []
    for exchange in (False, True):
        result = in_process(set_wrongly, fmu, exchange)
        note(f"{'model exchange' if exchange else 'co-simulation'}: {result}")
        problems += result if isinstance(result, list) else [result]
    claim("wrong_parameters_can_be_set_again_and_earlier_states_restored", problems)


def check_wrong_inputs(folder):
    """A length of -1 cannot be closed. The state that was kept before has the length 1."""
    instance = Instance(written(folder, "driven", DRIVEN, "--input", "rod"), initializes=True)
    kept = instance.keep()
    instance.set(**{"input.rod.length": -1.0})
    problems = rejected(instance, "", "ExitInitializationMode")
    try:
        instance.restore(kept)
        problems += [] if instance.get("input.rod.length") == [1.0] else ["the length differs"]
    except RuntimeError as error:
        problems.append(str(error))
    claim("a_state_is_restored_after_a_wrong_input", problems)


def leave_loops(instance):
    """Moves the state off the loops, and enters event mode behind the completed step."""
    flags = [ctypes.c_bool() for _ in range(2)]
    instance.call("EnterContinuousTimeMode")
    instance.rates(0.0, [x + 1e-3 * (k + 1) for k, x in enumerate(instance.states())])
    instance.call("CompletedIntegratorStep", ctypes.c_bool(True), *map(ctypes.byref, flags))
    instance.call("EnterEventMode")
    return flags[0].value


def check_projection(folder):
    """A state that is kept in event mode has the projection before it; a reset instance has none."""
    instance = Instance(Fmu(SCENES / "four-bar.yaml", folder), exchange=True)
    start = instance.states()
    leaves = leave_loops(instance)
    kept, results = instance.keep(), []
    for _ in range(2):
        results.append((instance.update_discrete(), instance.states()))
        instance.restore(kept)
    other = Instance(instance.fmu, exchange=True)
    leave_loops(other)
    other.call("Reset")
    other.call("EnterInitializationMode", ctypes.c_bool(False), ctypes.c_double(0), ctypes.c_double(0),
               ctypes.c_bool(False), ctypes.c_double(0))
    other.call("ExitInitializationMode")
    moves, anew = other.update_discrete()[0][3], other.states()
    moved = [result[0][0][3] for result in results]
    note(f"the step leaves the loops: {leaves}; updates move states: {moved}, after a reset: {moves}")
    claim("updates_of_a_restored_state_have_equal_bits",
          [] if leaves and results[0] == results[1] and all(moved) else [str(results)])
    claim("a_reset_instance_forgets_a_projection", [] if not moves and anew == start else [f"{moves}, {anew}"])


def check_far_states(folder):
    """A state that an importer tries, whose loops cannot be closed, is kept and restored as it is."""
    problems, fmu = [], Fmu(SCENES / "rope.yaml", folder)
    instance, other = Instance(fmu, exchange=True), Instance(fmu, exchange=True)
    start = instance.states()
    far = [x + 1.0 for x in start]
    for trial in (far, start):
        instance.call("SetContinuousStates", reals(trial), SIZE(len(trial)))
        kept = instance.keep()
        for one in (instance, other):
            one.call("SetContinuousStates", reals(start), SIZE(len(start)))
            one.restore(kept)
            problems += [] if one.states() == trial else [f"{one.states()} instead of {trial}"]
    claim("states_off_the_loops_are_kept_and_restored", problems)
    # A drive with an auxiliary state, whose importer follows it without reading outputs, is far from the last run.
    text = (SCENES / "four-bar.yaml").read_text().replace("velocity: 10", "velocity: 0")
    text = text.replace("initial:\n", 'states: {x: {initial: 1, rate: "-x"}}\ninitial:\n').replace(
        "loops:\n", "loops:\n  - {name: drive, type: motion, joint: crank, position: {polynomial: [1.0471975511965976, 0]}}\n")
    fmu = written(folder, "far", text, "--input", "drive")
    instance, other = Instance(fmu, exchange=True), Instance(fmu, exchange=True)
    for angle in range(60, 391, 2):
        instance.set(**{"input.drive.position": math.radians(angle)})
        instance.update_discrete()
    states = instance.states()
    instance.call("EnterContinuousTimeMode")
    instance.rates(0.0, states)
    kept = instance.keep()
    for one in (instance, other):
        one.restore(kept)
    claim("states_far_from_the_last_run_are_restored",
          [] if instance.states() == other.states() == states and len(states) > 2 else [f"{states}"])


def check_early_states(folder):
    """Time and states of model exchange are those of its run."""
    instance = Instance(written(folder, "early", SCENE), exchange=True, initializes=True)
    states, words = instance.states(), "are set in event mode or continuous-time mode"
    problems = rejected(instance, words, "SetTime", ctypes.c_double(1))
    problems += rejected(instance, words, "SetContinuousStates", reals([1.0] * len(states)), SIZE(len(states)))
    instance.call("ExitInitializationMode")
    problems += [] if instance.get("time") == [0.0] and instance.states() == states else ["they were set"]
    claim("time_and_states_are_rejected_before_the_run", problems)


def call_nothing(library, names):
    """The statuses of functions without an instance."""
    return sorted({getattr(library, name)(None, None, None, None, None, None, None, None, None, None)
                   for name in names})


def check_no_instance(folder):
    """An importer goes on after an instantiation that failed."""
    fmu = written(folder, "none", SCENE)
    _, symbols, _ = run("readelf", "--dyn-syms", "-W", fmu.binary)
    names = sorted(set(re.findall(r"\b(fmi[23][A-Z]\w+)", symbols)))
    # Lists without members are fine; these functions have no instance, or nothing to do.
    idle = re.compile(r"Instantiate|FreeInstance|GetVersion|GetTypesPlatform|FreeFMU|EvaluateDiscrete|(Get|Set)("
                      r"Float32|U?Int\d+|Integer|Boolean|String|Binary|Clock|Interval|Shift|Real(In|Out)put|OutputD)|"
                      r"Status$")
    called = [name for name in names if not idle.search(name)]
    result = in_process(call_nothing, ctypes.CDLL(str(fmu.binary)), called)
    note(f"{len(called)} functions, statuses {result}")
    claim("functions_without_an_instance_return_an_error", [] if result == [3] and len(called) >= 40 else [str(result)])


def check_no_start(folder):
    """The scene runs, but not with its drive as an input, which begins at rest."""
    scene = folder / "apart.yaml"
    scene.write_text(APART)
    fine = Fmu(scene, folder)
    status, _, errors = run(COMMAND, "export", "--fmu", scene, "--input", "drive", "--out", folder / "no.fmu")
    is_right = fine.status == 0 and status == 3 and not (folder / "no.fmu").exists()
    claim("an_fmu_that_would_not_start_is_not_written",
          [] if is_right and "would not start" in errors and "begin at rest" in errors
          else [f"{fine.errors}, {status}, {errors}"])


def check_recovery(folder):
    check_wrong_parameters(folder)
    check_wrong_inputs(folder)
    check_projection(folder)
    check_far_states(folder)
    check_early_states(folder)
    check_no_instance(folder)
    check_no_start(folder)
