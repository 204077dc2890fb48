"""Inputs of FMUs in the place of functions of time (fmu.py)."""
# SPDX-License-Identifier: Apache-2.0
import math

from archive import COMMAND, STEP, STEPS, Fmu, differences, records, rows, run
from claims import claim, note
from instance import REAL, SIZE, Instance, reals

# A motion, a servo, a motor, a force and a spring. FUNCTIONS takes the place of the functions of the five.
SCENE = """kinetree: 1
parameters: {goal: 0.2, w: 3}
gravity: [0, 0, -9.81]
bodies:
  - {name: cart, joint: {type: prismatic, axis: x}, mass: 2, shape: {type: box, size: [0.2, 0.2, 0.2]}}
  - {name: arm, parent: cart, joint: {type: revolute, axis: y}, mass: 1, com: [0.3, 0, 0], inertia: [0.1, 0.1, 0.1]}
  - {name: tip, parent: arm, joint: {type: revolute, axis: y, at: [0.6, 0, 0]}, mass: 0.5, com: [0.2, 0, 0],
     inertia: [0.02, 0.02, 0.02]}
effects:
  - {name: hold, type: servo, joint: arm, target: TARGET, stiffness: 50, damping: 4, limit: 30}
  - {name: push, type: motor, joint: tip, torque: TORQUE}
  - {name: wind, type: force, at: {body: tip, at: [0.3, 0, 0]}, value: [0, 0, VALUE]}
  - {name: coil, type: joint_spring, joint: tip, stiffness: 3, damping: 0.1, rest: REST}
  - {name: law, type: expression, joint: tip, force: "-0.1*w*velocity.tip"}
loops:
  - {name: drive, type: motion, joint: cart, position: POSITION}
EVENTS
simulate: {integrator: rk4, step: 0.001, duration: DURATION}
output: {record: [position, velocity, acceleration, energy]}
"""
WORDS = ("TARGET", "TORQUE", "VALUE", "REST", "POSITION")
LIST = "hold.target,push,wind,coil,drive"
NAMES = ("input.hold.target", "input.push.torque", "input.wind.value[2]", "input.coil.rest", "input.drive.position")
ORDERS = (2, 1, 1, 2, 3)
ENDINGS = ("", ".rate", ".acceleration")
# f, f', f'' of each function, and its text.
WAVES = (("=goal", lambda t: (0.2, 0, 0)),
         ("0.5*sin(6*t)", lambda t: (0.5 * math.sin(6 * t), 0, 0)),
         ("0.3*cos(2*t)", lambda t: (0.3 * math.cos(2 * t), 0, 0)),
         ("0.1*t", lambda t: (0.1 * t, 0.1, 0)),
         ("0.2*sin(w*t)", lambda t: (0.2 * math.sin(3 * t), 0.6 * math.cos(3 * t), -1.8 * math.sin(3 * t))))
# Functions that inputs with their derivatives continue exactly, and constants.
POWERS = (("{polynomial: [0.2, 0.3]}", lambda t: (0.2 + 0.3 * t, 0.3, 0)), ("0.4", lambda t: (0.4, 0, 0)),
          ("0.25", lambda t: (0.25, 0, 0)), ("{polynomial: [0.1, -0.2]}", lambda t: (0.1 - 0.2 * t, -0.2, 0)),
          ("{polynomial: [0.05, 0.1, 0.07]}", lambda t: (0.05 + 0.1 * t + 0.07 * t * t, 0.1 + 0.14 * t, 0.14)))
# A motion alone, whose third derivative is not continued.
MOTION = (("0.2", lambda t: (0.2, 0, 0)), *POWERS[1:3],
          ("0", lambda t: (0, 0, 0)), WAVES[4])
# Measured: 1e-16, 5e-3, 2e-3.
EXACT, HELD, SLOPE = 1e-13, 1e-2, 1e-8


def signal_scene(folder, name, waves, events="", duration=STEP * STEPS):
    text = SCENE.replace("EVENTS", events).replace("DURATION", repr(duration))
    for word, (form, _) in zip(WORDS, waves):
        text = text.replace(word, form if form[0] in "{=0" and "*" not in form else f'"{form}"')
    path = folder / f"{name}.yaml"
    path.write_text(text)
    return path


def values_at(waves, t):
    """The inputs at a time: value, rate and acceleration as far as there are variables."""
    return {name + ending: x for name, order, (_, f) in zip(NAMES, ORDERS, waves)
            for ending, x in zip(ENDINGS[:order], f(t))}


def play(instance, waves, names, step, steps):
    table = [instance.get(*names)]
    for _ in range(steps):
        instance.set(**values_at(waves, instance.time))
        instance.step(step)
        table.append(instance.get(*names))
    return table


def columns_of(fmu):
    return ["time"] + [name for name, v in fmu.variables.items() if v.get("causality") == "output"
                       and name.split(".")[0] in ("position", "velocity", "acceleration")]


def check_variables(folder):
    """Names, units, start values and places of the inputs, in both versions."""
    expected = {"input.hold.target": ("rad", 0.2), "input.hold.target.rate": ("rad/s", 0), "input.push.torque": ("N.m", 0),
                "input.wind.value[0]": ("N", 0), "input.wind.value[1]": ("N", 0), "input.wind.value[2]": ("N", 0.3),
                "input.coil.rest": ("rad", 0), "input.coil.rest.rate": ("rad/s", 0), "input.drive.position": ("m", 0),
                "input.drive.position.rate": ("m/s", 0), "input.drive.position.acceleration": ("m/s2", 0)}
    wrong = []
    for version in (3, 2):
        fmu = Fmu(signal_scene(folder, "waves", WAVES), folder, "--fmi", version, "--input", LIST)
        inputs = {name: v if version == 3 else v[0] for name, v in fmu.variables.items() if v.get("causality") == "input"}
        found = {name: (v.get("unit"), float(v.get("start"))) for name, v in inputs.items()}
        wrong += [] if found == expected else [f"FMI {version}: {found}"]
        if version == 2:
            variables = list(fmu.root.find("ModelVariables"))
            wrong += [v.get("name") for v in variables if v[0].get("derivative") is not None
                      and v.get("name") != f"der({variables[int(v[0].get('derivative')) - 1].get('name')})"]
    note(f"{len(expected)} inputs; {len(wrong)} wrong, bound 0")
    claim("functions_of_time_become_inputs_with_units_and_start_values", wrong)


def check_exchange_rates(folder):
    """In model exchange the equations are those of the scene with its functions, at any time and state."""
    ours, theirs = (Fmu(signal_scene(folder, name, WAVES), folder, *words)
                    for name, words in (("driven", ["--input", LIST]), ("own", [])))
    one, other, worst, moved = Instance(ours, exchange=True), Instance(theirs, exchange=True), 0.0, math.inf
    names = columns_of(ours)[1:]
    for instance in (one, other):
        instance.update_discrete()
        instance.call("EnterContinuousTimeMode")
    for k in range(1, 20):
        t = 0.1 * k
        (q, v, _), shift = WAVES[4][1](t), math.sin(7 * k)
        y = [q, 0.3 + shift, -0.2, v, 0.5, -0.7 * shift]
        still = one.rates(t, y)
        one.set(**values_at(WAVES, t))
        a, b = one.rates(t, y), other.rates(t, y)
        size = max(map(abs, b))
        worst = max(worst, max(abs(x - z) for x, z in zip(a + one.get(*names), b + other.get(*names))) / size)
        moved = min(moved, max(abs(x - z) for x, z in zip(a, still)) / size)
    note(f"rates and outputs differ by {worst:.1e} of the largest, bound 1e-14; inputs move them by {moved:.1e}, bound 1e-3")
    claim("inputs_give_model_exchange_the_equations_of_the_functions",
          [] if worst <= 1e-14 and moved >= 1e-3 else [f"{worst}, {moved}"])


def check_held(folder):
    """Constant inputs have the bits of a run, and polynomials are exact. Motions have errors of order three in the step,
    forces of order one."""
    constants = [(repr(f(0)[0]), f) for _, f in POWERS]
    scene = signal_scene(folder, "constant", constants)
    fmu = Fmu(scene, folder, "--input", LIST)
    kept = [fmu.reference(name) for name in columns_of(fmu)]
    _, text, errors = fmu.play("cs", *kept)
    theirs = [[row[int(k)] for k in kept] for row in records(scene)[0]]
    found = differences(rows(text), theirs)
    note(f"constants: largest difference {found:g}, bound 0; {text.splitlines()[-1:]}")
    claim("inputs_that_are_not_set_have_the_bits_of_a_run_and_allocate_nothing",
          [] if found == 0.0 and "allocations 0" in text else [errors, str(found)])
    errors = []
    for waves, steps in ((POWERS, STEPS), (WAVES, STEPS), (WAVES, 2 * STEPS), (MOTION, STEPS), (MOTION, 2 * STEPS)):
        scene = signal_scene(folder, "held", waves)
        fmu = Fmu(scene, folder, "--input", LIST)
        names = ["time", "position.cart"] + ([] if waves is MOTION else ["position.arm", "position.tip"])
        step = STEP * STEPS / steps
        table = play(Instance(fmu, **values_at(waves, 0.0)), waves, names, step, steps)
        theirs = [[row[k] for k in [int(fmu.reference(n)) for n in names]] for row in records(scene)[0]]
        errors.append(differences(table[::steps // STEPS], theirs))
    forces, motions = errors[1] / errors[2], errors[3] / errors[4]
    note(f"polynomials: error {errors[0]:.1e}, bound {EXACT:g}; waves: {errors[1]:.1e}, bound {HELD:g}")
    note(f"at half the step: forces {forces:.2f} times less, bounds 1.8, 2.2; motions {motions:.2f}, bounds 7, 9")
    claim("inputs_of_cosimulation_continue_with_their_derivatives",
          [] if errors[0] <= EXACT and errors[1] <= HELD and 1.8 <= forces <= 2.2 and 7 <= motions <= 9 else [str(errors)])


def check_again(folder):
    """Each step begins with the values of the inputs, also if they are not set again, or equal a part of its end."""
    fmu, wrong, step = Fmu(signal_scene(folder, "again", POWERS), folder, "--input", LIST), [], 0.125
    names = [f"input.drive.position{ending}" for ending in ENDINGS]
    # Behind a step from 0 the cart is at v h + a h^2 / 2: at 0 with the rate -v, and at a h^2 / 2.
    for first, second, expected in (((0, -0.0625, 1), None, (0, 0.0625)), ((0, 0, 1), (0, 0.125, 1), (0.0234375, 0.25))):
        instance = Instance(fmu, **dict(zip(names, first)))
        instance.step(step)
        instance.set(**dict(zip(names, second or ())))
        instance.step(step)
        found = instance.get("position.cart", "velocity.cart")
        note(f"two steps from {first}: {found}, expected {expected}, bound 1e-12")
        wrong += [] if differences([found], [expected]) <= 1e-12 else [str(found)]
    claim("each_step_begins_with_the_values_of_its_inputs", wrong)


def check_released(folder):
    """A motion that an event releases is an input as long as it acts; all others act all the time."""
    events = "events: [{name: free, when: t - 0.505, then: {release: drive}, limit: 1}]"
    scene = signal_scene(folder, "released", POWERS, events)
    fmu = Fmu(scene, folder, "--input", LIST)
    names = ["time", "position.cart", "position.arm", "position.tip"]
    table = play(Instance(fmu, **values_at(POWERS, 0.0)), POWERS, names, STEP, STEPS)
    times = {row[0] for row in table}
    theirs = [[row[k] for k in [int(fmu.reference(n)) for n in names]] for row in records(scene)[0] if row[0] in times]
    found, free = differences(table, theirs), max(abs(row[1] - POWERS[4][1](row[0])[0]) for row in table)
    note(f"largest difference {found:.1e}, bound 1e-9; the free cart leaves the motion by {free:.2g}, bound >= 1e-3")
    claim("inputs_of_loops_act_until_an_event_releases_them", [] if found <= 1e-9 and free >= 1e-3 else [f"{found}, {free}"])


def check_start(folder):
    """Values that are set before the run: the state of the start has them, also at another time."""
    fmu, wrong = Fmu(signal_scene(folder, "start", WAVES), folder, "--input", LIST), []
    for exchange in (False, True):
        for start in (0.0, 1.5):
            instance = Instance(fmu, exchange, start, **{"input.drive.position": 0.4, "input.drive.position.rate": -0.25})
            found = instance.get("position.cart", "velocity.cart", "input.drive.position")
            note(f"start {start:g}: {found}, expected [0.4, -0.25, 0.4], bound 1e-12")
            wrong += [] if differences([found], [[0.4, -0.25, 0.4]]) <= 1e-12 else [str(found)]
            instance.free()
    instance = Instance(fmu, **{"input.drive.position": 0.4})
    instance.step(STEP)
    instance.status("Reset")
    again = instance.get("input.drive.position", "input.wind.value[2]", "position.cart")
    note(f"after a reset: {again}, expected [0, 0.3, 0]")
    claim("inputs_that_are_set_before_the_run_give_its_start", wrong + ([] if again == [0, 0.3, 0] else [str(again)]))


def check_blocks(folder):
    """Rollback and another instance continue with the inputs of the state, with equal bits."""
    fmu, wrong = Fmu(signal_scene(folder, "blocks", WAVES), folder, "--input", LIST), []
    names = columns_of(fmu) + list(values_at(WAVES, 0.0))
    one = Instance(fmu, **values_at(WAVES, 0.0))
    play(one, WAVES, names, STEP, 20)
    kept = one.keep()
    one.set(**{"input.push.torque": 0.7})
    waiting = one.keep()
    end = [one.get(*names)] + [(one.step(STEP), one.get(*names))[1] for _ in range(20)]
    other = Instance(fmu)
    for instance in (one, other):
        instance.restore(waiting)
        again = [instance.get(*names)] + [(instance.step(STEP), instance.get(*names))[1] for _ in range(20)]
        wrong += [] if again == end else ["another end"]
    other.restore(kept)
    back = [other.get(*names)] + [(other.step(STEP), other.get(*names))[1] for _ in range(20)]
    wrong += [] if back != end else ["the torque that was set behind the state stays"]
    note(f"{len(wrong)} faults, bound 0")
    claim("states_hold_the_inputs_in_the_place_of_functions", wrong)


def slope_of(instance, unknowns, known):
    size, found = SIZE(len(unknowns)), (REAL * len(unknowns))()
    status = instance.status("GetDirectionalDerivative", instance.references(unknowns), size,
                             instance.references([known]), SIZE(1), reals([1.0]), SIZE(1), found, size)
    return list(found) if status == 0 else None


def difference_of(instance, unknowns, known, width=1e-3):
    """Differences of order four."""
    value, = instance.get(known)
    total = [0.0] * len(unknowns)
    for k, weight in ((-2, 1), (-1, -8), (1, 8), (2, -1)):
        instance.set(**{known: value + k * width})
        total = [x + weight * y / (12 * width) for x, y in zip(total, instance.get(*unknowns))]
    instance.set(**{known: value})
    return total


def slope_faults(scene, folder, modes=(True, False)):
    """Derivatives by each input: in model exchange all, in co-simulation those that leave the state alone. Returns
    faults and the unknowns."""
    fmu, wrong, worst = Fmu(scene, folder, "--input", LIST), [], {}
    unknowns = [name for name in fmu.variables if name.startswith("der(")] + columns_of(fmu)[1:]
    for exchange in modes:
        instance = Instance(fmu, exchange, **values_at(WAVES, 0.3))
        if exchange:
            instance.update_discrete()
            instance.call("EnterContinuousTimeMode")
        worst[exchange] = 0.0
        for known in values_at(WAVES, 0.0):
            moves = known in ("input.drive.position", "input.drive.position.rate") and not exchange
            found, before = slope_of(instance, unknowns, known), len(instance.messages)
            if moves:
                fine = found is None and "use model exchange" in instance.messages[before - 1]
                wrong += [] if fine else [f"{known}: {found}"]
                continue
            expected = difference_of(instance, unknowns, known)
            size = max([1.0, *map(abs, expected)])
            error = max(abs(a - b) for a, b in zip(found, expected)) / size if found else math.nan
            worst[exchange] = worst[exchange] if error <= worst[exchange] else error
            needed = "rate" not in known and (exchange or "position" not in known) or "acceleration" in known
            wrong += [f"{known} has no derivative"] if needed and not any(found or []) else []
        instance.free()
    note(", ".join(f"{'model exchange' if exchange else 'co-simulation'}: relative difference {error:.1e}"
                   for exchange, error in worst.items()) + f", bound {SLOPE:g}")
    return wrong + ([] if max(worst.values()) <= SLOPE else [str(worst)]), unknowns


def check_each_slope(folder):
    faults, unknowns = slope_faults(signal_scene(folder, "slopes", WAVES), folder)
    claim("derivatives_by_each_input_are_those_of_differences", faults)
    check_undisturbed(folder, unknowns)
    # Friction sticks on a block and slips in a joint, so that the model of their set is made at run time.
    scene = signal_scene(folder, "sticky", WAVES)
    text = scene.read_text().replace(
        "effects:\n", "  - {name: block, joint: {type: prismatic, axis: x}, mass: 1}\neffects:\n" +
        "".join(f"  - {{name: dry_{joint}, type: joint_friction, joint: {joint}, coulomb: 0.3, stribeck: 0, "
                "stick: true}\n" for joint in ("block", "arm")))
    scene.write_text(text)
    claim("derivatives_with_friction_that_sticks_are_those_of_differences",
          slope_faults(scene, folder, (False,))[0])


def check_undisturbed(folder, unknowns):
    """A run goes on as if there had been no derivatives, also with methods that have a memory of earlier steps."""
    wrong = []
    for method in ("rk4", "ab2", "bdf2"):
        scene = signal_scene(folder, f"undisturbed-{method}", WAVES)
        scene.write_text(scene.read_text().replace("rk4", method))
        fmu, ends = Fmu(scene, folder, "--input", f"{LIST},tip"), []
        for known in (None, "input.wind.value[2]", "input.tip"):
            instance = Instance(fmu)  # inputs that rest: a jump would begin the method anew
            for _ in range(20):
                instance.step(STEP)
                fine = known is None or slope_of(instance, unknowns, known) is not None
                wrong += [] if fine else [f"{method}: {instance.messages[-1:]}"]
            ends.append(instance.get(*columns_of(fmu)))
            instance.free()
        found = max(differences(ends[:1], [end]) for end in ends[1:])
        note(f"{method}: a run with derivatives between its steps differs by {found:g}, bound 0")
        wrong += [] if found == 0.0 else [f"{method}: {found}"]
    claim("derivatives_leave_the_run_alone", wrong)


def check_contacts(folder):
    """A block of 2 kg with friction on the ground, which is pushed and lifted. Contacts keep their mode in derivatives: 0
    of one that sticks, 1/m of one that is open, none of one that slips."""
    scene, pushed, found = folder / "lift.yaml", "input.pull.value[0]", []
    scene.write_text("kinetree: 1\ngravity: [0, 0, -10]\nbodies:\n"
                     "  - {name: x, joint: {name: sx, type: prismatic, axis: x}, mass: 0.5}\n"
                     "  - {name: b, parent: x, mass: 2, joint: {name: sz, type: prismatic, axis: z}, markers: {c: [0, 0, 0]}}\n"
                     "effects:\n  - {name: ground, type: contact, point: b.c, radius: 0, plane: world, restitution: 0, friction: 0.3}\n"
                     "  - {name: pull, type: force, at: b, value: [0, 0, 0]}\nsimulate: {duration: 1}\n")
    fmu = Fmu(scene, folder, "--input", "pull")
    for push, lift in ((1, 15), (1, 25), (8, 0)):
        instance = Instance(fmu, **{pushed: push, "input.pull.value[2]": lift})
        instance.step(STEP)
        found.append(slope_of(instance, ["der(v.sx)", "der(v.sz)"], pushed))
    note(f"derivatives {found}, expected [[0, 0], [0.4, 0], None], bound 1e-12; {instance.messages}")
    fine = differences([x or [] for x in found[:2]], [[0.0, 0.0], [0.4, 0.0]]) <= 1e-12 and found[2] is None and \
        "that slips" in instance.messages[-1]
    claim("derivatives_keep_the_mode_of_contacts", [] if fine else [str(found)])


def check_event_mode(folder):
    """In event mode inputs act behind the events that are due, at the time of the event."""
    events = 'events: [{name: kick, when: t - 0.105, then: {set: {velocity.tip: "velocity.tip + 1"}}}]'
    fmu = Fmu(signal_scene(folder, "kick", WAVES, events), folder, "--input", LIST)
    instance = Instance(fmu, event_mode=True, early=True)
    instance.update_discrete()
    instance.call("EnterStepMode")
    due = False
    while not due and instance.time < 0.2:
        due = instance.step(STEP)[0]
    instance.call("EnterEventMode")
    before = instance.get("velocity.tip", "position.cart")
    instance.set(**{"input.drive.position": 0.01, "input.push.torque": 0.5})
    waiting = instance.get("velocity.tip", "position.cart")
    instance.update_discrete()
    behind = instance.get("velocity.tip", "position.cart")
    note(f"at {instance.time:g} s: {before}, {waiting}, behind the event {behind}")
    fine = before == waiting and abs(behind[0] - before[0] - 1) < 1e-9 and abs(behind[1] - 0.01) < 1e-12
    claim("inputs_of_event_mode_act_behind_the_events", [] if fine and abs(instance.time - 0.105) < 1e-9 else [str(behind)])


def check_names(folder):
    """Names that are no inputs are rejected, with the nearest name, the names that can be, or the reason."""
    scene = signal_scene(folder, "names", WAVES)
    thrust = folder / "thrust.yaml"
    thrust.write_text("kinetree: 1\nbodies:\n  - {name: rocket, joint: {type: prismatic, axis: z}, mass: \"3 - 0.1*t\"}\neffects:\n"
                      "  - {name: engine, type: thrust, at: rocket, mass: \"3 - 0.1*t\", exhaust: [0, 0, -100]}\n"
                      "loops:\n  - {name: rod, type: distance, between: [world, {body: rocket, at: [1, 0, 0]}]}\n")
    wrong, words = [], []
    for path, name, expected in ((scene, "hold.targt", "did you mean 'hold.target'?"), (scene, "crat", "did you mean 'cart'?"),
                                 (scene, "nothing", "inputs can be cart, arm, tip, hold.target, push.torque"),
                                 (scene, "law", "has no function of time; its joint can have a force as an input: tip"),
                                 (scene, "drive.rate", "no function of time of the scene"), (scene, "", "inputs can be"),
                                 (scene, "tip,tip", "--input names 'tip' twice; remove one"), (scene, "push,push.torque", "names the input 'push.torque' twice"),
                                 (thrust, "engine", "the body loses it, too"), (thrust, "rod", "has no function of time")):
        status, _, errors = run(COMMAND, "export", "--fmu", path, "--input", name, "--out", folder / "names.fmu")
        wrong += [] if status == 1 and expected in errors else [f"{name}: status {status}, {errors}"]
        words.append(name)
    note(f"{len(words)} names, {len(wrong)} accepted or with another message, bound 0")
    claim("names_that_are_no_inputs_are_rejected_with_a_reason", wrong)
    slide = folder / "slide-motor.yaml"
    found = []
    for key in ("force", "torque"):
        slide.write_text("kinetree: 1\nbodies: [{name: b, mass: 2, joint: {name: s, type: prismatic, axis: x}}]\n"
                         f"effects: [{{name: m, type: motor, joint: s, {key}: \"t\"}}]\nsimulate: {{duration: 1}}\n")
        for name in ("m", "m.torque", "m.force"):
            fmu = Fmu(slide, folder, "--input", f"{name},s")
            found += [sorted(n for n, v in fmu.variables.items() if v.get("causality") == "input")] if fmu.status == 0 else [fmu.errors]
    note(f"a motor in a sliding joint: {found}")
    claim("a_force_has_either_name_of_its_key", [] if found == [["input.m.force", "input.s"]] * 6 else [str(found)])


def check_signals(folder):
    check_variables(folder)
    check_exchange_rates(folder)
    check_held(folder)
    check_again(folder)
    check_released(folder)
    check_start(folder)
    check_blocks(folder)
    check_each_slope(folder)
    check_contacts(folder)
    check_event_mode(folder)
    check_names(folder)
