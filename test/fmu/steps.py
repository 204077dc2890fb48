"""Events within a step of co-simulation (fmu.py): early returns, event mode and intermediate updates, against closed
forms and runs."""
# SPDX-License-Identifier: Apache-2.0
import ctypes
import math

from archive import Fmu
from claims import claim, note
from events import EXACT, SCENE, expected
from instance import Instance

COMMUNICATION = 0.1  # s
G, BOUNCE = 10.0, 0.8
# A block that slides to a hard stop at 0.317 m, where it bounces back with half of its speed.
IMPACT = """kinetree: 1
bodies: [{name: block, mass: 2, joint: {name: slide, type: prismatic, axis: x, velocity: 1}}]
effects: [{type: joint_limit, joint: slide, upper: 0.317, restitution: 0.5}]
simulate: {integrator: rk4, step: 0.001, duration: 1}
output: {record: [position, velocity]}
"""


# A pendulum with an adaptive method, and an event every 18 ms.
SWING = """kinetree: 1
bodies: [{name: arm, mass: 2, com: [0, -1, 0], joint: {type: revolute, axis: z, velocity: 3}, inertia: [1, 1, 1]}]
events: [{name: tick, when: "sin(173*t)", then: record}]
simulate: {integrator: dopri5, tolerance: 1e-6, duration: 2}
output: {record: [position, velocity]}
"""


def play(instance, end, each=lambda flags: None):
    """Steps up to communication points, in parts if the instance returns early. Returns the parts that were early."""
    early, point, over, size = [], 1, False, COMMUNICATION
    while instance.time < end - 1e-9 and not over:
        flags = instance.step(size)
        each(flags)
        over = flags[1]
        size = COMMUNICATION
        if flags[2]:
            early.append(instance.time)
            size = point * COMMUNICATION - instance.time
        else:
            point += 1
        if flags[0]:
            instance.call("EnterEventMode")
            over = instance.update_discrete()[0][1]
            instance.call("EnterStepMode") if not over else None
    return early, over


def begin(instance):
    """Leaves the event mode that follows the initialization."""
    instance.update_discrete()
    instance.call("EnterStepMode")
    return instance


def largest(errors):
    return math.nan if not errors or any(e != e for e in errors) else max(errors)


def check_located(fmu):
    """The ball is before its impact at the end of a step that it ends, and behind it after event mode."""
    times, seen = expected(), []
    instance = begin(Instance(fmu, event_mode=True, early=True))

    def each(flags):
        if flags[0]:
            before = instance.get("velocity.drop")[0]
            kept = instance.keep()
            instance.call("EnterEventMode")
            changed = instance.update_discrete()[0][3]
            seen.append((instance.time, before, instance.get("velocity.drop")[0], changed, flags))
            instance.restore(kept)  # in step mode, before the event
    early, over = play(instance, 2.5, each)
    worst = largest([abs(a - b) for a, b in zip([s[0] for s in seen], times)] if len(seen) == len(times) else [math.nan])
    note(f"events at {[s[0] for s in seen]}; largest error {worst:.1e} s, bound {EXACT:g}; over: {over}")
    inner = [t for t in early if abs(t - 0.7) > EXACT]  # the damper changes at a communication point
    fine = worst <= EXACT and over and len(inner) == len(times) - 1
    claim("steps_end_early_at_events_of_closed_forms", [] if fine else [str(seen), str(early)])
    bounce = [(abs(s[1] + G * t), abs(s[2] - BOUNCE * G * t), s[3]) for s, t in zip(seen[:1], times)]
    note(f"velocities before and behind the first bounce are off by {bounce}, bound 1e-8; the state changed")
    claim("event_mode_lies_between_the_states_before_and_behind_an_event",
          [] if bounce and max(bounce[0][:2]) <= 1e-8 and bounce[0][2] else [str(seen)])
    rejected = instance.status("EnterContinuousTimeMode")
    note(f"continuous-time mode in co-simulation: status {rejected}, expected 3")
    claim("continuous_time_mode_is_rejected_in_cosimulation", [] if rejected == 3 else [str(rejected)])


def check_abilities(fmu):
    """Early returns without event mode end behind the event; without early returns no step is shorter."""
    behind, times = [], expected()
    instance = Instance(fmu, early=True)
    early, over = play(instance, 2.5, lambda flags: behind.append((instance.time, flags, *instance.get("velocity.drop"))))
    first = next((b for b in behind if b[1][2]), (math.nan, [], math.nan))
    errors = [abs(first[0] - times[0]), abs(first[2] - BOUNCE * G * times[0])]
    note(f"the first early step is off by {errors[0]:.1e} s and {errors[1]:.1e} m/s, bounds {EXACT:g} and 1e-8")
    fine = errors[0] <= EXACT and errors[1] <= 1e-8 and over and not any(b[1][0] for b in behind)
    claim("early_returns_without_event_mode_end_behind_the_event", [] if fine else [str(behind)])
    instance, flags = begin(Instance(fmu, event_mode=True)), []
    early, over = play(instance, 2.5, flags.append)
    needed = [k + 1 for k, f in enumerate(flags) if f[0]]
    note(f"without early returns: event mode after the steps {needed}, expected [7]; early: {early}; over: {over}")
    claim("event_mode_without_early_returns_has_the_events_of_communication_points",
          [] if needed == [7] and not early and over else [str(flags)])
    instance, flags = Instance(fmu), []
    early, over = play(instance, 2.5, flags.append)
    both = [f for f in flags if f[0] or f[2]]
    note(f"an importer without both: {len(both)} flags of events or early returns, bound 0; over: {over}")
    claim("events_are_handled_inside_without_these_abilities", [] if not both and over and len(flags) > 10
          else [str(flags)])


def tables_of(fmu, names, end):
    """The early returns, and rows at communication points: with early returns, and without this ability."""
    for instance in (begin(Instance(fmu, event_mode=True, early=True)), Instance(fmu)):
        table = []

        def each(flags):
            if not flags[2]:
                table.append([instance.time, *instance.get(*names)])
        early, _ = play(instance, end, each)
        yield early, table


def check_rest(folder):
    """An impact on a hard stop is an event, too. The rest of a step has the bits of a step in one part."""
    fmus = []
    for name, text in (("impact", IMPACT), ("swing", SWING)):
        scene = folder / f"{name}.yaml"
        scene.write_text(text)
        fmus.append(Fmu(scene, folder))
    (early, table), (none, whole) = tables_of(fmus[0], ["position.slide", "velocity.slide"], 1.0)
    at, v = (early or [math.nan])[0], table[-1][2] if table else math.nan
    note(f"early returns at {early}, expected [0.317], and without this ability {none}; {len(table)} rows with equal "
         f"bits: {table == whole}; the last velocity {v}, expected -0.5, bounds 1e-9")
    fine = len(early) == 1 and not none and table == whole and len(table) == 10 and abs(v + 0.5) <= 1e-9
    claim("an_impact_ends_a_step_and_the_rest_has_equal_bits",
          [] if fine and abs(at - 0.317) <= EXACT else [str(table), str(whole)])
    (early, table), (none, whole) = tables_of(fmus[1], ["position.arm", "velocity.arm"], 2.0)
    same = sum(a == b for a, b in zip(table, whole))
    note(f"dopri5: {len(early)} early returns, {same} of {len(table)} rows with equal bits")
    claim("steps_in_many_parts_have_equal_bits", [] if len(early) >= 100 and not none and same == len(table) == 20
          else [str(table), str(whole)])


def check_updates(fmu):
    """Intermediate updates: each step of 1 ms, variables that are read there, and a return that is requested."""
    seen, rejected, request, state = [], [], {}, ctypes.c_void_p()

    def update(environment, time, set_requested, get_allowed, finished, may_return, returns, at):
        seen.append((time, *instance.get("time", "position.turn", "position.drop"), set_requested, get_allowed, finished,
                     may_return))
        rejected.append(instance.try_set(bounce=0.5) == 3 and instance.status("GetFMUState", ctypes.byref(state)) == 3
                       and instance.status("Reset") == 3)
        if request and time >= request["when"]:
            returns[0], at[0] = True, request["at"]
    instance = Instance(fmu, early=True, update=update)
    instance.step(COMMUNICATION)
    times = [s[0] for s in seen]
    steps = largest([abs(t - 0.001 * (k + 1)) for k, t in enumerate(times)])
    fall = largest([abs(s[3] - (1.25 - G / 2 * s[0] ** 2)) for s in seen])
    turn = largest([abs(s[2] - (1 - math.exp(-0.4 * s[0])) / 0.4) for s in seen])
    flags = {(s[0] == s[1], *s[4:]) for s in seen}
    note(f"{len(seen)} updates, expected 100; times are off by {steps:.1e} s, positions by {fall:.1e} m and {turn:.1e} "
         f"rad, bounds 1e-12; flags {flags}")
    claim("intermediate_updates_read_variables_at_each_step",
          [] if len(seen) == 100 and max(steps, fall, turn) <= 1e-12 and flags == {(True, False, True, True, True)}
          else [str(seen)])
    note(f"settings, states and resets were rejected in {sum(rejected)} of {len(rejected)} updates")
    claim("intermediate_updates_change_nothing", [] if rejected and all(rejected) else [str(rejected)])
    ends = []
    for when, at in ((0.15, 0.1625), (0.18, 0.0), (0.0, 0.19025), (0.0, math.nan)):
        request.update(when=when, at=at)
        flags = instance.step(COMMUNICATION)
        ends.append((instance.time, flags))
        request.clear()
    expected_ends = [0.1625, 0.18, 0.19025, 0.191]
    worst = largest([abs(t - e) for (t, _), e in zip(ends, expected_ends)])
    note(f"requested returns at {[t for t, _ in ends]}, off by {worst:.1e} s, bound 1e-12")
    claim("a_requested_return_ends_the_step",
          [] if worst <= 1e-12 and all(f == [False, False, True] for _, f in ends) else [str(ends)])
    instance = Instance(fmu, update=update)
    request.update(when=0.05, at=0.05)
    seen.clear()
    flags = instance.step(COMMUNICATION)
    note(f"not allowed: the step ends at {instance.time}, expected 0.1; flags {flags}; may return: {seen[0][-1]}")
    claim("a_return_that_is_not_allowed_is_not_made",
          [] if instance.time == COMMUNICATION and flags == [False] * 3 and not any(s[-1] for s in seen) else [str(flags)])


def check_kept(fmu):
    """Events that have not taken effect are in the state; an instance without event mode rejects it."""
    one = begin(Instance(fmu, event_mode=True, early=True))
    early, _ = play(one, 0.4)
    flags = one.step(COMMUNICATION + 0.05)
    flags = flags if flags[0] else one.step(0.2)
    one.call("EnterEventMode")
    kept = one.keep()
    other, plain = Instance(fmu, event_mode=True, early=True), Instance(fmu)
    other.restore(kept)
    try:
        plain.restore(kept)
        accepted = True
    except RuntimeError:
        accepted = False
    ends = []
    for instance in (one, other):
        over = instance.update_discrete()[0][1]
        instance.call("EnterStepMode")
        at = instance.time
        early, over = play_on(instance, 1.2)
        ends.append((at, early, over, instance.get("position.drop", "velocity.drop", "position.turn")))
    note(f"events due: {flags}; ends {ends}; accepted without event mode: {accepted}")
    claim("another_instance_continues_before_an_event_with_equal_bits",
          [] if flags[0] and ends[0] == ends[1] and len(ends[0][1]) >= 1 and not accepted else [str(ends)])


def play_on(instance, end):
    early, over = [], False
    while instance.time < end - 1e-9 and not over:
        flags = instance.step(end - instance.time)
        over = flags[1]
        early += [instance.time] if flags[2] else []
        if flags[0]:
            instance.call("EnterEventMode")
            over = instance.update_discrete()[0][1]
            instance.call("EnterStepMode") if not over else None
    return early, over


def check_tuned(folder):
    """A mass that changes in event mode does so behind the impact that is due, before the update or behind it."""
    scene, ends = folder / "tuned.yaml", []
    scene.write_text(IMPACT.replace("mass: 2", "mass: =m").replace("bodies:", "parameters: {m: 2}\nbodies:").replace(
        "restitution: 0.5}]", "restitution: 0.5}, {type: joint_spring, joint: slide, stiffness: 3}]"))
    fmu = Fmu(scene, folder)
    for order in ("set, update", "update, set", "update"):
        instance = begin(Instance(fmu, event_mode=True, early=True))
        flags = instance.step(0.9)
        instance.call("EnterEventMode")
        for word in order.split(", "):
            instance.set(m=3.0) if word == "set" else instance.update_discrete()
        instance.call("EnterStepMode")
        ends.append((flags[0], instance.time, *instance.get("velocity.slide")))
        instance.step(0.25)
        ends[-1] += (instance.time, *instance.get("position.slide", "velocity.slide"))
    off = abs(ends[0][-2] - ends[2][-2])
    note(f"{ends}; the mass moves the end by {off:.1e} m, bound >= 1e-3")
    claim("parameters_change_behind_the_events_that_are_due",
          [] if ends[0] == ends[1] and ends[0][0] and ends[0][2] < 0 and off >= 1e-3 else [str(ends)])


def check_flags(fmu, folder):
    """The description tells what instances do; a scene without events does not return early by itself."""
    calm = folder / "calm.yaml"
    calm.write_text(IMPACT.replace("effects: [{type: joint_limit, joint: slide, upper: 0.317, restitution: 0.5}]\n", ""))
    wanted = {"hasEventMode": "true", "providesIntermediateUpdate": "true",
              "canReturnEarlyAfterIntermediateUpdate": "true", "canHandleVariableCommunicationStepSize": "true"}
    problems = []
    for one, early in ((fmu, "true"), (Fmu(folder / "impact.yaml", folder), "true"), (Fmu(calm, folder), None)):
        flags = one.root.find("CoSimulation").attrib
        problems += [f"{key}: {flags.get(key)}" for key, value in wanted.items() if flags.get(key) != value]
        problems += [] if flags.get("mightReturnEarlyFromDoStep") == early else [f"early returns: {flags}"]
        problems += [name for name, v in one.variables.items()
                     if (v.get("intermediateUpdate") == "true") != (v.get("causality") == "output")]
    claim("flags_of_cosimulation_are_true", problems)


def check_steps(folder):
    scene = folder / "located.yaml"
    scene.write_text(SCENE)
    fmu = Fmu(scene, folder)
    check_located(fmu)
    check_abilities(fmu)
    check_rest(folder)
    check_updates(fmu)
    check_kept(fmu)
    check_tuned(folder)
    check_flags(fmu, folder)
