"""Tunable parameters of FMUs (fmu.py)."""
# SPDX-License-Identifier: Apache-2.0
import math
import re

from archive import SCENES, STEP, STEPS, Fmu
from claims import claim, note
from instance import Instance

# A mass, a spring, a damper, gravity and a number that follows; `off` is a number of the start alone, and `gain` of a
# formula, so that both are fixed.
SLED = """kinetree: 1
parameters: {m: 2, lump: 0.4, k: 30, c: 0.5, g: 1.5, off: 0.1, gain: 0.2, half: =m/2, double: =2*off, rate: =gain*2}
gravity: [=g, 0, 0]
bodies:
  - {name: block, mass: =m, joint: {name: slide, type: prismatic, axis: x, position: =double}}
  - {name: tail, parent: block, mass: =half, joint: {name: turn, type: revolute, axis: z}, com: [0.3, 0, 0]}
  - {name: lump, parent: tail, mass: =lump, shape: {type: sphere, radius: 0.2},
     joint: {name: roll, type: revolute, axis: x, at: [0, 0.3, 0]}}
effects:
  - {name: spring, type: joint_spring, joint: slide, stiffness: =k, rest: 0}
  - {name: damper, type: joint_damper, joint: turn, damping: =c}
  - {name: law, type: expression, joint: turn, force: "-gain*position.turn"}
simulate: {integrator: rk4, step: 0.001, duration: 2}
output: {record: [position, velocity, energy, acceleration]}
EVENTS
"""
ROLES = {"m": "tunable", "lump": "tunable", "k": "tunable", "c": "tunable", "g": "tunable", "off": "fixed", "gain": "fixed",
         "half": "tunable", "double": "fixed", "rate": "fixed"}
CHANGES = {"m": 3.5, "lump": 1.1, "k": 12, "c": 0.1, "g": -2}
RATES = 1e-14  # relative to the largest derivative; measured: 0
# Joints with one coordinate, a loop, quaternions, auxiliary states.
STRUCTURES = ("arm7", "four-bar", "spinning-top", "dc-motor", "conical-pendulum")


def sled(folder, name, events=""):
    path = folder / f"{name}.yaml"
    path.write_text(SLED.replace("EVENTS", events))
    return path


def check_roles(folder):
    fmu = Fmu(sled(folder, "sled"), folder)
    found = {name: fmu.variables[name].get("variability") for name in ROLES}
    causes = {name: fmu.variables[name].get("causality") for name in ROLES}
    followers = {name for name, cause in causes.items() if cause == "calculatedParameter"}
    wrong = [f"{name}: {found[name]}" for name in ROLES if found[name] != ROLES[name]]
    wrong += sorted(followers ^ {"half", "double", "rate"})
    claim("parameters_are_tunable_where_the_engine_can_change_them", wrong)


def tune_halfway(instance, names, changes):
    """Rows of a run in which parameters change at half time."""
    table = [instance.get(*names)]
    for k in range(STEPS):
        if k == STEPS // 2:
            instance.set(**changes)
        instance.step(STEP)
        table.append(instance.get(*names))
    return table


def largest(ours, theirs):
    found = [abs(a - b) for r, s in zip(ours, theirs) for a, b in zip(r, s)]
    return math.nan if len(ours) != len(theirs) or not found or any(x != x for x in found) else max(found)


def check_tuning(folder):
    """A change between two steps has the bits of an event that sets the parameters at the same time."""
    sets = ", ".join(f"{name}: {value}" for name, value in CHANGES.items())
    scene = sled(folder, "sled-events", f'events: [{{name: tune, when: t - 1, then: {{set: {{{sets}}}}}}}]\n')
    fmu, event = Fmu(sled(folder, "sled"), folder), Fmu(scene, folder)
    names = ["time"] + [name for name in fmu.variables if name.split(".")[0] in ("position", "velocity", "energy")]
    instance, other = Instance(fmu), Instance(event)
    ours, theirs = tune_halfway(instance, names, CHANGES), tune_halfway(other, names, {})
    found = largest(ours, theirs)
    moved = largest(ours[-1:], tune_halfway(Instance(fmu), names, {})[-1:])
    half, = instance.get("half")
    note(f"sled: the largest difference from an event is {found:g}, bound 0; the change moves it by {moved:.2g}, "
         f"bound >= 0.1; half = {half:g}")
    claim("tuning_has_the_bits_of_an_event", [] if found == 0.0 and moved >= 0.1 and half == 1.75 else [str(found)])
    statuses = [instance.try_set(off=0.3), instance.try_set(half=3), instance.try_set(gain=0.3), instance.try_set(m=-1)]
    again = instance.get("m", "off", "half")
    note(f"statuses {statuses}, bound 3; values {again}")
    claim("what_cannot_be_tuned_is_rejected", [] if statuses == [3] * 4 and again == [3.5, 0.1, 1.75] else
          [str(statuses), str(again), *instance.messages])


def check_states(folder):
    """Rollback, another instance, and reset, each with parameters that changed in between."""
    fmu = Fmu(sled(folder, "sled"), folder)
    names = [name for name in fmu.variables if name.split(".")[0] in ("position", "velocity", "energy")]

    def finish_run(instance, steps):
        for _ in range(steps):
            instance.step(STEP)
        return instance.get(*names, "m", "half")

    one = Instance(fmu, k=25)
    finish_run(one, 50)
    before = one.keep()
    plain = finish_run(one, 50)
    one.restore(before)
    one.set(m=5)
    tuned = one.keep()
    changed = finish_run(one, 50)
    one.restore(before)
    back = finish_run(one, 50)
    other = Instance(fmu)
    other.restore(tuned)
    passed = finish_run(other, 50)
    one.status("Reset")
    fresh = one.get("m", "half", "k")
    problems = [] if back == plain and passed == changed and plain != changed else [f"{plain}, {back}, {passed}"]
    note(f"after a reset: {fresh}")
    claim("states_hold_tunable_parameters", problems + ([] if fresh == [2, 1, 30] else [str(fresh)]))


def check_exchange_of(fmu, name, start):
    """The difference of derivatives between a tuned model and one that was initialised so, and that which tuning makes."""
    value = start * 1.05 + (0.01 if start == 0 else 0)
    tuned, given, plain = Instance(fmu, True), Instance(fmu, True, **{name: value}), Instance(fmu, True)
    tuned.set(**{name: value})
    tables = []
    for instance in (tuned, given, plain):
        instance.update_discrete()
        instance.call("EnterContinuousTimeMode")
        rejected = instance.try_set(**{name: 2 * value + 1})
        states = [y + 0.01 * math.sin(k + 1) for k, y in enumerate(plain.states())]
        tables.append(instance.rates(0.25, states))
        instance.free()
    size = max(1.0, *map(abs, tables[1]))
    return largest(tables[:1], tables[1:2]) / size, largest(tables[:1], tables[2:]), rejected


def check_exchange(folder):
    """Every tunable parameter of the bundled scenes, in event mode."""
    problems, count, worst, moved = [], 0, 0.0, 0
    for scene in [sled(folder, "sled"), *sorted(SCENES.glob("*.yaml"))]:
        if not re.search(r"^parameters:", scene.read_text(), re.M):
            continue
        fmu = Fmu(scene, folder)
        tunable = [v for v in fmu.variables.values()
                   if v.get("causality") == "parameter" and v.get("variability") == "tunable"]
        for v in tunable if fmu.root.find("ModelExchange") is not None else []:
            found, change, rejected = check_exchange_of(fmu, v.get("name"), float(v.get("start")))
            count, worst, moved = count + 1, max(worst, found), moved + (change > 0.0)
            if not found <= RATES or rejected != 3:
                problems.append(f"{scene.stem}, {v.get('name')}: {found:g}, status {rejected}")
    note(f"{count} parameters, bound >= 20; {moved} of them change derivatives; the largest difference is {worst:.1e}, "
         f"bound {RATES:g}")
    claim("tuning_acts_as_a_value_of_the_initialization",
          problems + ([] if count >= 20 and moved >= count - 3 else [f"{count}, {moved}"]))


def check_structure(folder):
    """Rates change with all states on which they depend by the description, and with no other one."""
    problems, count = [], 0
    for name in STRUCTURES:
        fmu = Fmu(SCENES / f"{name}.yaml", folder)
        rates = {v.get("valueReference"): v.get("derivative") for v in fmu.variables.values() if v.get("derivative")}
        states = list(rates.values())
        instance = Instance(fmu, True)
        instance.update_discrete()
        instance.call("EnterContinuousTimeMode")
        base = [y + 0.3 * math.sin(k + 1) for k, y in enumerate(instance.states())]
        before, changes = instance.rates(0.25, base), []
        for k in range(len(states)):
            after = instance.rates(0.25, [y + (0.05 if i == k else 0) for i, y in enumerate(base)])
            changes.append([b - a for a, b in zip(before, after)])
        for unknown in fmu.root.iter("ContinuousStateDerivative"):
            i, stated = list(rates).index(unknown.get("valueReference")), unknown.get("dependencies")
            moves = {states[k] for k in range(len(states)) if changes[k][i] != 0.0}
            if stated is None:
                continue
            count += 1
            gain = max(abs(changes[states.index(known)][i] - 0.05) for known in stated.split())
            if moves != set(stated.split()) or unknown.get("dependenciesKind") != "constant" or not gain <= 1e-15:
                problems.append(f"{name}, rate {i}: {moves} instead of {stated}, {gain:g}")
        instance.free()
    note(f"{count} rates with dependencies, bound >= 10")
    claim("dependencies_are_those_of_the_equations", problems + ([] if count >= 10 else [f"only {count}"]))


def check_tunables(folder):
    check_roles(folder)
    check_tuning(folder)
    check_states(folder)
    check_exchange(folder)
    check_structure(folder)
