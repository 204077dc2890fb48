"""Complaints of users about FMUs of other tools, as tests (fmu.py): a crash on a damaged state, a hang after a rollback,
parameters that instances share, and elements of XML in a wrong order. Others are in fmu.py: liblapack and newer
symbols of glibc (check_binary), and undefined units (check_page)."""
# SPDX-License-Identifier: Apache-2.0
import multiprocessing
import random

from archive import Fmu
from claims import claim, note
from events import SCENE
from instance import Instance

DAMAGED, ROLLBACKS, PATIENCE = 400, 50, 240  # PATIENCE: s, for a process that must end
ORDER = {3: ["ModelExchange", "CoSimulation", "ScheduledExecution", "UnitDefinitions", "TypeDefinitions",
             "LogCategories", "DefaultExperiment", "ModelVariables", "ModelStructure", "Annotations"],
         2: ["ModelExchange", "CoSimulation", "UnitDefinitions", "TypeDefinitions", "LogCategories",
             "DefaultExperiment", "VendorAnnotations", "ModelVariables", "ModelStructure"]}
# FMI 3.0 names kinds of unknowns, FMI 2.0 groups.
STRUCTURE = {3: ["Output", "ContinuousStateDerivative", "ClockedState", "InitialUnknown", "EventIndicator"],
             2: ["Outputs", "Derivatives", "InitialUnknowns"]}


def in_process(work, *arguments):
    """The result of a function in a process of its own; a text if that crashes or does not end."""
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(False)
    process = context.Process(target=lambda: sender.send(work(*arguments)))
    process.start()
    sender.close()
    try:
        result = receiver.recv() if receiver.poll(PATIENCE) else "it does not end"
    except EOFError:
        process.join()
        result = f"it ends with {process.exitcode}"
    if process.is_alive() and result == "it does not end":
        process.kill()
    process.join()
    return result


def damage_states(fmu, exchange):
    """Restores states with damaged bytes and of other sizes. Returns how many were rejected, and how many accepted."""
    numbers, counts = random.Random(1), [0, 0]
    instance = Instance(fmu, exchange)
    if not exchange:
        for _ in range(6):
            instance.step(0.1)
    block, time = instance.keep()
    for k in range(DAMAGED):
        bytes_ = bytearray(block)
        for _ in range(numbers.choice((1, 1, 4, 64))):
            bytes_[numbers.randrange(len(bytes_))] = numbers.choice((0, 1, 127, 128, 255, numbers.randrange(256)))
        if k % 8 == 0:
            bytes_ = bytes_[:numbers.randrange(1, len(bytes_))]
        if bytes_ == block:
            continue
        try:
            instance.restore((bytes(bytes_), time))
            counts[1] += 1
            instance.states() if exchange else instance.step(0.05)
        except RuntimeError:
            counts[0] += 1
        instance.restore((block, time))
    return counts


def check_damage(fmu):
    problems = []
    for exchange in (False, True):
        result = in_process(damage_states, fmu, exchange)
        note(f"{'model exchange' if exchange else 'co-simulation'}: damaged states rejected and accepted: {result}")
        problems += [] if isinstance(result, list) and result[0] >= DAMAGED / 2 and result[1] == 0 else [str(result)]
    claim("damaged_states_are_rejected", problems)


def roll_back(fmu):
    """Returns to a state before and after an event, again and again. Returns the different results."""
    results = []
    instance = Instance(fmu)
    for _ in range(4):
        instance.step(0.1)
    kept = instance.keep()
    for k in range(ROLLBACKS):
        for size in ((0.3,) if k % 2 else (0.05, 0.25)):
            instance.step(size)
        results.append((k % 2, instance.time, *instance.get("position.drop", "velocity.drop", "position.turn")))
        instance.restore(kept)
    return sorted(set(results))


def check_rollback(fmu):
    results = in_process(roll_back, fmu)
    note(f"{ROLLBACKS} rollbacks, results {results}")
    fine = isinstance(results, list) and len(results) == 2 and all(abs(r[1] - 0.7) < 1e-12 for r in results)
    claim("rollbacks_end_and_have_equal_bits", [] if fine else [str(results)])


def pushed_scene(folder):
    """x = offset + F t^2 / 2 m."""
    scene = folder / "shared.yaml"
    scene.write_text("kinetree: 1\nparameters: {m: 2, offset: 0}\nbodies:\n"
                     "  - {name: block, mass: =m, joint: {name: slide, type: prismatic, axis: x, position: =offset}}\n"
                     "simulate: {integrator: rk4, step: 0.001, duration: 1}\noutput: {record: [position]}\n")
    return scene


def check_shared(fmu):
    """Instances with own masses, fixed and tunable, that step by turns."""
    one, two = Instance(fmu, m=4.0, offset=1.0), Instance(fmu)
    for instance in (one, two):
        instance.set(**{"input.slide": 3.0})
    for _ in range(10):
        one.step(0.1)
        two.step(0.1)
    found = [*one.get("position.slide", "m", "offset"), *two.get("position.slide", "m", "offset")]
    expected = [1 + 3 / 8, 4, 1, 3 / 4, 2, 0]
    worst = max(abs(a - b) for a, b in zip(found, expected))
    note(f"{found}, expected {expected}; largest difference {worst:.1e}, bound 1e-13")
    claim("instances_share_no_parameters", [] if worst <= 1e-13 else [str(found)])


def check_start(fmu):
    """An instance takes over the initialization of another one, which begins at 5 s, and then gets a parameter. Its
    scene began at 0 s then, and the first step ended at once."""
    problems = []
    for exchange in (False, True):
        one, two = (Instance(fmu, exchange, start, initializes=True) for start in (5.0, 0.0))
        two.restore(one.keep())
        two.set(offset=1.0, **{"input.slide": 3.0})
        two.call("ExitInitializationMode")
        if not exchange:
            two.step(0.1)
        found, expected = two.get("time", "position.slide"), [5.0, 1.0] if exchange else [5.1, 1 + 3 * 0.1 ** 2 / 4]
        note(f"{found}, expected {expected}, bound 1e-13")
        problems += [] if max(abs(a - b) for a, b in zip(found, expected)) <= 1e-13 else [str(found)]
    claim("a_state_of_the_initialization_holds_its_start", problems)


def check_steps(fmu):
    """Steps that do not go forwards."""
    instance, problems = Instance(fmu), []
    instance.step(0.1)
    for size, words in ((-0.01, "-0.01 s is not finite and above zero"), (0.0, "0 s is not finite and above zero"),
                        (float("nan"), "nan s is not finite and above zero"), (1e-18, "does not change the time, 0.1")):
        try:
            instance.step(size)
            problems += [f"{size} s is accepted"]
        except RuntimeError as error:
            problems += [] if words in str(error) else [f"{size} s: {error}"]
    claim("steps_that_do_not_go_forwards_are_rejected_in_words", problems)


def in_order(names, order):
    places = [order.index(name) if name in order else -1 for name in names]
    return -1 not in places and places == sorted(places)


def check_order(folder):
    scene, problems = folder / "located.yaml", []
    for version in (3, 2):
        root = Fmu(scene, folder, "--fmi", version, "--input", "turn").root
        top, inner = [e.tag for e in root], [e.tag for e in root.find("ModelStructure")]
        note(f"FMI {version}: {top}")
        problems += [] if in_order(top, ORDER[version]) and len(top) >= 7 else [str(top)]
        problems += [] if in_order(inner, STRUCTURE[version]) and len(set(inner)) >= 3 else [str(inner)]
    claim("elements_are_in_the_order_of_the_standard", problems)


def check_experiment(folder):
    """A scene without a duration, such as that of `run --duration 0 --scene`, has no step of 0 s for importers."""
    scene, found = folder / "timeless.yaml", []
    for duration in (0, 2):
        scene.write_text("kinetree: 1\nbodies:\n  - {name: block, mass: 1, joint: {type: prismatic, axis: x}}\n"
                         f"simulate: {{duration: {duration}}}\n")
        found.append(Fmu(scene, folder).root.find("DefaultExperiment").attrib)
    wanted = [{"startTime": "0"}, {"startTime": "0", "stopTime": "2", "stepSize": "0.002"}]
    claim("experiments_have_times_above_zero_or_none", [] if found == wanted else [str(found)])


def check_complaints(folder):
    scene = folder / "located.yaml"
    scene.write_text(SCENE)
    check_order(folder)
    check_experiment(folder)
    fmu = Fmu(scene, folder)
    check_damage(fmu)
    check_rollback(fmu)
    check_steps(fmu)
    block = Fmu(pushed_scene(folder), folder, "--input", "slide")
    check_shared(block)
    check_start(block)
