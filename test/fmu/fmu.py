"""FMUs of `kinetree export --fmu` in a small importer, against `kinetree run`.

fmu.py COMMAND IMPORTER SOURCE-ROOT

The environment variable KT_FMI_SCHEMA names a folder with the schemas of FMI 3.0 (modelica/fmi-standard, schema) and
with that of FMI 2.0 in one file, fmi2Merged.xsd. KT_FMUSIM is the program fmusim of modelica/Reference-FMUs, and
KT_FMILIB the shared library of modelon-community/fmi-library. KT_FMPY is a Python with the package fmpy. What is not
there is skipped with a message.
"""
# SPDX-License-Identifier: Apache-2.0
import math
import os
import pathlib
import re
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from archive import (COMMAND, FIXED, PAGE, SCENES, STEP, STEPS, WORKS, Fmu, differences, fixed_scene, records,
                     rows, run)
from claims import claim, finish, note, skip
from complaints import check_complaints
from events import check_events
from footholds import check_footholds
from foreign import check_fmpy, check_fmusim, check_fmusim_early, check_fmusim_inputs, check_library, check_schema
from instance import REAL, SIZE, Instance, reals
from recovery import check_recovery
from second import check_second
from signals import check_signals
from steps import check_steps
from tables import check_tables
from tunable import check_tunables
from uses import check_uses

EXCHANGED = {"double-pendulum": 1e-12, "four-bar": 1e-12, "arm7": 1e-12}  # rounding; measured: 0, 4e-15, 0
# Trees, quaternions, loops, own states, masses that change, drives, contacts; with inputs. Bounds: relative to the
# largest derivative; those of outputs, and of loops, are of both differences.
SLOPES = {"arm7": "shoulder_yaw,elbow", "four-bar": "crank", "servo-arm": "base_yaw_drive,elbow_drive.target,elbow",
          "mathieu": "shaker", "swashplate": "drive", "dc-motor": "rotor", "bricard": None, "stewart": None,
          "quarter-car": "ramp,wash", "rocket": None, "spinning-top": None, "torus-marble": None, "three-body": None}
# Names of the structured convention: parts are identifiers, or have quotes, and may have indices.
PART = r"(?:[A-Za-z_][A-Za-z0-9_]*|'[A-Za-z0-9_-]+')(?:\[\d+\])?"
STRUCTURED = re.compile(rf"{PART}(?:\.{PART})*|der\({PART}(?:\.{PART})*\)", re.A)
RATES, OUTPUTS, ADJOINT = 1e-9, 1e-9, 1e-10


def other_bits(scene, what, text):
    """Why values of the FMU have other bits than the records of a run."""
    theirs, _ = records(scene)
    # A run also records at events, between the steps.
    times = {row[0] for row in rows(text)}
    theirs = [row for row in theirs if row[0] in times]
    found = differences(rows(text), theirs)
    counts = [line for line in text.splitlines() if line.startswith("allocations")]
    note(f"{scene.stem}, {what}: largest difference {found:g}, bound 0; {counts}, bound 0")
    return ([] if found == 0.0 else [f"{scene.stem}: the largest difference is {found:g}"]) + \
        ([] if counts and set(counts) == {"allocations 0"} else [f"{scene.stem}: steps allocate"])


def same_bits(scene, fmu, *modes):
    """Plays the modes one after the other, each in a process of its own."""
    text = ""
    for mode in modes:
        status, said, errors = fmu.play(mode)
        if status != 0:
            return [f"{scene.stem}, {mode}: {errors.strip()}"]
        text += said
    return other_bits(scene, modes[0].partition("=")[0], text)


def check_cosimulation(folder):
    bits, early, serial, process, second = [], [], [], [], []
    state = folder / "state"
    for name in FIXED:
        scene = fixed_scene(name, folder)
        fmu = Fmu(scene, folder)
        if fmu.status != 0:
            bits.append(fmu.errors)
            continue
        bits += same_bits(scene, fmu, "cs")
        early += same_bits(scene, fmu, "early")
        serial += same_bits(scene, fmu, "serial")
        process += same_bits(scene, fmu, f"save={state}", f"load={state}")
        second += same_bits(scene, fmu, "two")
    claim("cosimulation_has_the_bits_of_a_run_and_allocates_nothing", bits)
    claim("event_mode_early_returns_and_intermediate_updates_keep_the_bits_and_allocate_nothing", early)
    claim("another_instance_continues_a_serialised_state_with_equal_bits", serial)
    claim("another_process_continues_a_serialised_state_with_equal_bits", process)
    claim("a_second_instance_changes_nothing", second)


def check_exchange(folder):
    """The importer and the run take the same steps of 10 ms with the same method."""
    problems = []
    for name, bound in EXCHANGED.items():
        scene = fixed_scene(name, folder)
        fmu = Fmu(scene, folder)
        status, text, errors = fmu.play("me")
        theirs, _ = records(scene, "--step", STEP)
        found = differences(rows(text), theirs) if status == 0 else math.nan
        note(f"{name}: largest difference {found:g}, bound {bound:g}; {text.splitlines()[-1:]}")
        if not found <= bound:
            problems.append(f"{name}: {found:g} {errors.strip()}")
        if "allocations 0" not in text:
            problems.append(f"{name}: model exchange allocates")
    claim("model_exchange_follows_the_run_of_the_same_method", problems)


def slopes_of(scene, folder, inputs):
    """The errors of derivatives: of rates, of outputs, and of the adjoint; with the words of the importer."""
    fmu = Fmu(scene, folder, *(["--input", inputs] if inputs else []))
    if fmu.status != 0 or fmu.root.find("ModelExchange") is None:
        return [math.nan] * 3, fmu.errors
    rate = next(v for v in fmu.variables.values() if v.get("derivative") is not None)
    given = [f"{v.get('valueReference')}=0.3" for v in fmu.variables.values() if v.get("causality") == "input"]
    shown = [v.get("valueReference") for name, v in fmu.variables.items() if v.get("causality") == "output"
             and name not in WORKS]
    status, text, errors = fmu.play(f"slopes={rate.get('derivative')},{rate.get('valueReference')}", *shown, *given,
                                    step=2e-4, steps=5)
    found = [line for line in text.splitlines() if line.startswith("slopes ")]
    return [float(x) for x in found[0][7:].split(",")] if status == 0 and found else [math.nan] * 3, errors


def check_slopes(folder):
    problems = []
    for name, inputs in SLOPES.items():
        (rates, outputs, adjoint), errors = slopes_of(SCENES / f"{name}.yaml", folder, inputs)
        note(f"{name}: derivatives of rates differ by {rates:.1e}, bound {RATES:g}; of outputs by {outputs:.1e}, bound "
             f"{OUTPUTS:g}; adjoint by {adjoint:.1e}, bound {ADJOINT:g}")
        if not (rates <= RATES and outputs <= OUTPUTS and adjoint <= ADJOINT):
            problems.append(f"{name}: {rates}, {outputs}, {adjoint} {errors}")
    claim("directional_and_adjoint_derivatives_are_those_of_differences", problems)


def check_norms(folder):
    """An importer leaves the norm of a quaternion. Outputs are those of the unit quaternion, and so are derivatives."""
    instance = Instance(Fmu(SCENES / "spinning-top.yaml", folder), exchange=True)
    knowns = [name for name in instance.fmu.variables if name.startswith("q.")][:4]
    unknowns = [name.replace("q.", "position.") for name in knowns]
    state, turn, width, size = instance.states(), (0.3, -0.2, 0.5, 0.1), 1e-3, SIZE(4)
    state[:4] = [1.1 * x for x in state[:4]]
    instance.rates(0.0, state)
    found = (REAL * 4)()
    instance.call("GetDirectionalDerivative", instance.references(unknowns), size, instance.references(knowns), size,
                  reals(turn), size, found, size)
    wanted = [0.0] * 4
    for k, weight in ((-2, 1), (-1, -8), (1, 8), (2, -1)):
        instance.rates(0.0, [x + k * width * d for x, d in zip(state, turn)] + state[4:])
        wanted = [x + weight * y / (12 * width) for x, y in zip(wanted, instance.get(*unknowns))]
    worst = max(abs(x - y) for x, y in zip(found, wanted))
    note(f"a quaternion of norm 1.1: derivatives differ by {worst:.1e}, bound 1e-11")
    claim("derivatives_of_outputs_are_those_of_the_unit_quaternion", [] if len(knowns) == 4 and worst <= 1e-11
          else [f"{list(found)}, {wanted}"])


def check_rates(folder):
    """Derivatives of states in co-simulation: friction that sticks, an event that sets a parameter, own states."""
    problems = []
    for name, event, has_own in (("clutch", ("t - 3", "t - 1"), False), ("thruster-lag", ("", ""), True)):
        scene = fixed_scene(name, folder)
        scene.write_text(re.sub(r"record: \[", "record: [acceleration, ", scene.read_text().replace(*event)))
        fmu = Fmu(scene, folder)
        joints = [word[len("acceleration."):] for word in fmu.variables if word.startswith("acceleration.")]
        names = [f"acceleration.{j}" for j in joints] + [f"der(v.{j})" for j in joints]
        own = [word for word in fmu.variables if has_own and word.startswith("der(x.")]
        status, text, errors = fmu.play("cs", "0", *map(fmu.reference, names + own + [f"state.{w[6:-1]}" for w in own]))
        table, n = rows(text) if status == 0 else [], len(joints)
        rates = [abs(row[1 + k] - row[1 + n + k]) for row in table for k in range(n)]
        # An own state has no column of its rate: Simpson's rule from its values, on steps of 10 ms.
        first, m = 1 + 2 * n, len(own)
        slopes = [abs((c[first + m + k] - a[first + m + k]) / STEP * 3 - a[first + k] - 4 * b[first + k] - c[first + k])
                  for a, b, c in zip(table, table[1:], table[2:]) for k in range(m)]
        worst = [max(rates, default=math.nan), max(slopes, default=0.0 if not own else math.nan)]
        note(f"{name}: accelerations differ by {worst[0]:g}, bound 1e-9; rates of states by {worst[1]:g}, bound 1e-6")
        problems += [] if worst[0] <= 1e-9 and worst[1] <= 1e-6 else [f"{name}: {worst} {errors}"]
    claim("derivatives_of_cosimulation_are_those_of_the_motion", problems)


def check_values(folder):
    """A parameter and an input of the FMU act as a setting of a run and as a constant force do."""
    scene = folder / "slide.yaml"
    scene.write_text("kinetree: 1\nparameters: {m: 2, half: =m/2}\nbodies:\n"
                     "  - {name: block, mass: =m, joint: {name: slide, type: prismatic, axis: [1, 0, 0]}}\n"
                     f"simulate: {{integrator: rk4, step: 0.001, duration: {STEP * STEPS}}}\n"
                     "output: {record: [position, acceleration]}\n")
    fmu = Fmu(scene, folder, "--input", "slide")
    follower, own = fmu.variables["half"].get("causality"), fmu.variables["m"].get("causality")
    status, text, errors = fmu.play("cs", "0", fmu.reference("position.slide"), fmu.reference("half"),
                                    fmu.reference("m") + "=4", fmu.reference("input.slide") + "=3")
    last = rows(text)[-1] if status == 0 else [math.nan] * 3
    expected = 0.5 * 3 / 4 * (STEP * STEPS) ** 2
    note(f"position {last[1]:.15g}, expected {expected:.15g}, bound 1e-13")
    fine = abs(last[1] - expected) <= 1e-13 and last[2] == 2.0
    claim("inputs_and_parameters_act", [] if fine else [str(last), errors])
    # At mass 2: acceleration 1/2 m/s2 for each newton, which is also the rate of v.
    names = ["position.slide", "acceleration.slide", "der(v.slide)", "der(q.slide)"]
    status, text, errors = fmu.play("gain", *map(fmu.reference, names), fmu.reference("input.slide") + "=3")
    gains = rows(text)[-1] if status == 0 else [math.nan]
    note(f"gains {gains}, expected [0, 0.5, 0.5, 0], bound 1e-15")
    fine = len(gains) == 4 and all(abs(a - b) <= 1e-15 for a, b in zip(gains, (0.0, 0.5, 0.5, 0.0)))
    claim("derivatives_by_inputs_in_cosimulation_are_those_of_the_mass", [] if fine else [str(gains), errors])
    claim("a_parameter_that_follows_others_is_calculated",
          [] if (follower, own) == ("calculatedParameter", "parameter") else [f"half: {follower}, m: {own}"])


def check_times(folder):
    """Starts at other times than 0, and the times of jumps in functions of time."""
    scene = folder / "push.yaml"
    scene.write_text("kinetree: 1\nbodies:\n"
                     "  - {name: block, mass: 2, joint: {name: slide, type: prismatic, axis: [1, 0, 0]}}\n"
                     "effects:\n"
                     "  - {name: wave, type: motor, joint: slide, force: {sine: {amplitude: 3, frequency: 0.5}}}\n"
                     f"simulate: {{integrator: rk4, step: 0.001, duration: {STEP * STEPS}}}\n")
    fmu, start, omega = Fmu(scene, folder), 1.25, math.pi
    status, text, errors = fmu.play(f"start={start}", "0", fmu.reference("position.slide"))
    last = rows(text)[-1] if status == 0 else [math.nan] * 2
    time, span = start + STEP * STEPS, STEP * STEPS
    # x'' = 3/2 sin(w t), at rest at the start: x' = 3/2 (cos w t0 - cos w t) / w
    expected = 1.5 / omega * (math.cos(omega * start) * span - (math.sin(omega * time) - math.sin(omega * start)) / omega)
    note(f"at {last[0]:g} s position {last[1]:.15g}, expected {expected:.15g}, bound 1e-12")
    claim("a_run_starts_at_another_time", [] if abs(last[1] - expected) <= 1e-12 and abs(last[0] - time) <= 1e-12
          else [str(last), errors])
    ramp = "{ramp: {from: 0, to: 3, start: 0.5, end: 1.25}}"
    scene.write_text(scene.read_text().replace("{sine: {amplitude: 3, frequency: 0.5}}", ramp))
    status, text, errors = Fmu(scene, folder).play("me", "0")
    found = [float(line[5:]) for line in text.splitlines() if line.startswith("next ")]
    note(f"times of events {found}, expected [0.5, 1.25], bound 0")
    claim("jumps_of_functions_of_time_are_announced", [] if found == [0.5, 1.25] else [str(found), errors])


def check_rejections(folder):
    body = "kinetree: 1\nbodies: [{name: b, joint: {type: prismatic, axis: x}%s}]\n"
    (folder / "plain.yaml").write_text(body % ", mass: 1")
    run(COMMAND, "run", folder / "plain.yaml", "--duration", 1, "--out", os.devnull, "--summary", folder / "other.json")
    corners = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
    faces = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
    (folder / "b.stl").write_text("solid b\n" + "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join("vertex %g %g %g\n" % corners[i] for i in face) +
        "endloop\nendfacet\n" for face in faces) + "endsolid b\n")
    (folder / "t.csv").write_text("time,f\n0,1\n1,2\n")
    cases = {
        "from": (", mass: 1", "initial: {from: other.json}\n", "initial.from"),
        "formulation": (", mass: 1", "simulate: {formulation: absolute}\n", "simulate.formulation"),
        "steps": (", mass: 1", "effects: [{type: joint_limit, joint: b, lower: 0, restitution: 0}]\nsimulate: {contact: steps, step: 1e-2}\n", "which an FMU does not have"),
        "mesh": ("", "meshes: [{body: b, file: b.stl, density: 1}]\n", "it reads other files"),
        "whole_name": ("", f"meshes: [{{body: b, file: {folder}/b.stl, density: 1}}]\n", "leave out density"),
        "table": (", mass: 1", f"effects: [{{type: motor, joint: b, force: {{table: {folder}/t.csv, value: f}}}}]\n", "write its rows here"),
    }
    problems = []
    for name, (mass, line, words) in cases.items():
        scene = folder / f"{name}.yaml"
        scene.write_text(body % mass + line)
        fmu = Fmu(scene, folder)
        if fmu.status == 0 or words not in fmu.errors:
            problems.append(f"{name}: status {fmu.status}, {fmu.errors}")
    claim("what_cannot_be_exported_is_rejected", problems)
    fmu = Fmu(fixed_scene("bouncing-ball", folder), folder)
    status, _, errors = fmu.play("me")
    claim("model_exchange_is_not_offered_with_hard_contacts",
          [] if fmu.root.find("ModelExchange") is None and status != 0 and "use co-simulation" in errors else [errors])


def check_binary(folder):
    """The binary depends on libc and libm alone, and exports FMI alone."""
    fmu = Fmu(fixed_scene("arm7", folder), folder)
    _, text, _ = run("readelf", "-dW", fmu.binary)
    needed = set(re.findall(r"NEEDED.*\[(\w+)\.so", text))
    _, symbols, _ = run("readelf", "--dyn-syms", "-W", fmu.binary)
    exported = [line.split()[-1] for line in symbols.splitlines() if " UND " not in line and " GLOBAL " in line]
    versions = sorted({tuple(int(n) for n in v.split(".")) for v in re.findall(r"GLIBC_([\d.]+)", symbols)})
    megabytes = [path.stat().st_size / 1e6 for path in (fmu.binary, fmu.archive)]
    glibc = ".".join(map(str, versions[-1]))
    note(f"{megabytes[0]:.1f} MB, the archive {megabytes[1]:.1f} MB; needs {sorted(needed)}, glibc {glibc}")
    foreign = [name for name in exported if not name.startswith(("fmi2", "fmi3"))]
    claim("the_binary_needs_libc_and_libm_alone", sorted(needed - {"libc", "libm", "ld-linux-x86-64"}))
    stated = float(re.search(r"The binary has ([\d.]+) MB", PAGE.read_text())[1])
    if sys.argv[4] == "small":
        claim("the_binary_has_the_size_that_the_page_states",
              [] if abs(megabytes[0] - stated) < 0.1 else [f"{megabytes[0]:.2f} MB, the page states {stated} MB"])
    else:
        skip("the_binary_has_the_size_that_the_page_states", "this build has a large one")
    licence = fmu.folder / "documentation/licenses/license.txt"
    claim("the_archive_has_the_licence", [] if licence.exists() and licence.read_text() == (PAGE.parents[2] / "LICENSE").read_text()
          else ["it is missing, or another one"])
    # Debian 11 has glibc 2.31.
    stated = re.search(r"needs glibc (\d+)\.(\d+)", PAGE.read_text())
    least = tuple(int(number) for number in stated.groups()) if stated else (0, 0)
    newest = sorted({word for word in re.findall(r"\w+@GLIBC_[\d.]+", symbols) if word.endswith("_" + glibc)})
    note(f"newest symbols: {newest}; the page states {least}")
    claim("the_oldest_glibc_is_the_one_that_the_page_states", [] if versions[-1] == least else newest)
    claim("the_binary_loads_on_debian_11", [] if versions[-1] <= (2, 31) else newest)
    few = [] if len(exported) >= 110 else [f"only {len(exported)} functions"]
    claim("the_binary_exports_fmi_alone", foreign + few)


def check_scenes(folder):
    """The FMU of every bundled scene starts. It reads the scene in flow style, with its own reader."""
    problems, count, wrong, quoted = [], 0, [], 0
    for scene in sorted(SCENES.glob("*.yaml")):
        fmu = Fmu(scene, folder)
        if fmu.status != 0:
            problems.append(f"{scene.stem}: {fmu.errors.strip()}")
            continue
        wrong += [f"{scene.stem}: {name}" for name in fmu.variables if not STRUCTURED.fullmatch(name)]
        quoted += sum("'" in name for name in fmu.variables)
        status, text, errors = fmu.play("cs", "0", step=1e-3, steps=1)
        count += 1
        problems += [] if status == 0 and len(rows(text)) == 2 else [f"{scene.stem}: {errors.strip()}"]
    note(f"{count} scenes")
    note(f"{len(wrong)} wrong names, bound 0; {quoted} names with quotes")
    claim("names_are_structured", wrong[:10] + ([] if quoted >= 100 else [f"only {quoted} names with quotes"]))
    claim("every_bundled_scene_starts", problems + ([] if count >= 70 else [f"only {count} scenes"]))


def check_names_of_users(folder):
    """Events with any characters, and parameters with the name of a column: the description is XML, names are unique
    and structured, and each parameter acts."""
    scene, problems = folder / "named.yaml", []
    scene.write_text("kinetree: 1\nparameters: {time: 2, m: 1.5}\nbodies:\n"
                     "  - {name: cart, mass: =m, joint: {type: prismatic, axis: x, position: =time, velocity: 1}}\nevents:\n"
                     "  - {name: 'a<b & \"c\" it''s', when: position.cart - 9, then: record}\n"
                     "  - {name: 1st hit, when: position.cart - 8, then: record}\n"
                     "  - {name: gr\u00f6\u00dfe, when: position.cart - 7, then: record}\n"
                     "  - {name: left-hit, when: position.cart - 6, then: record}\n"
                     "simulate: {integrator: rk4, step: 0.001, duration: 1}\noutput: {columns: {m: 2*position.cart}}\n")
    events = [r"event.'a<b & \"c\" it\'s'", "event.'1st hit'", "event.'gr%C3%B6%C3%9Fe'", "event.'left-hit'"]
    for version in (2, 3):
        fmu = Fmu(scene, folder, "--fmi", version)
        count = len(list(fmu.root.find("ModelVariables")))
        found = [name for name in fmu.variables if name.startswith("event.")]
        problems += [] if count == len(fmu.variables) and found == events else [f"FMI {version}: {found}, {count} names"]
    one = Instance(fmu, **{"parameters.time": 3.0, "parameters.m": 4.0})
    values = one.get("position.cart", "m", "parameters.time", "time", "parameters.m")
    problems += [] if values == [3, 6, 3, 0, 4] else [str(values)]
    claim("names_of_events_and_parameters_are_unique_and_structured", problems)


def check_settings(folder):
    """Settings of the export, with formulas, quotes and units, act as those of a run."""
    scene = folder / "settings.yaml"
    scene.write_text("kinetree: 1\nname: 'An arm, \"left\"'\nparameters: {m: 2, angle: 30 deg, reach: '=2*m'}\nbodies:\n"
                     "  - {name: arm, mass: =m, com: [=reach, 0, 0], inertia: [1, 1, 1],\n"
                     "     joint: {name: pin, type: revolute, axis: [0, 1, 0], position: =angle}}\n"
                     f"simulate: {{integrator: rk4, step: 0.001, duration: {STEP * STEPS}}}\n")
    words = ["--set", "m=3", "--set", "reach==hypot(m, 4)/5", "--set", "bodies[0].inertia=[1, 2, '=m - 1']"]
    fmu = Fmu(scene, folder, *words)
    status, text, errors = fmu.play("cs") if fmu.status == 0 else (1, "", fmu.errors)
    theirs, complaint = records(scene, *words)
    found = differences(rows(text), theirs)
    note(f"largest difference {found:g}, bound 0")
    claim("settings_of_the_export_act", [] if found == 0.0 else [errors + complaint])


def check_page(folder):
    """The page has every function of the binary, no other one, and every capability flag of both descriptions."""
    page = PAGE.read_text()
    scene = fixed_scene("arm7", folder)
    fmus = [Fmu(scene, folder, "--fmi", version) for version in (3, 2)]
    _, symbols, _ = run("readelf", "--dyn-syms", "-W", fmus[-1].binary)
    exported = set(re.findall(r"\b(fmi[23][A-Z]\w+)", symbols))
    named = set(re.findall(r"`(fmi[23][A-Z]\w+)`", page)) - {"fmi2Discard", "fmi2Terminated"}
    note(f"{len(exported)} functions, {len(named)} on the page")
    flags = {key for fmu in fmus for kind in ("ModelExchange", "CoSimulation") for key in fmu.root.find(kind).keys()}
    defined = [{unit.get("name") for unit in fmu.root.iter("Unit")} for fmu in fmus]
    undefined = {v.get("unit") for fmu, units in zip(fmus, defined) for v in fmu.root.find("ModelVariables").iter()
                 if v.get("unit") is not None and v.get("unit") not in units}
    claim("all_units_are_defined", sorted(undefined) + ([] if all(map(len, defined)) else ["no units"]))
    unnamed = sorted(key for key in flags - {"modelIdentifier"} if f"`{key}`" not in page)
    claim("the_page_has_every_function_and_flag", sorted(exported ^ named) + unnamed +
          ([] if len(exported) >= 110 else [f"only {len(exported)} functions"]))


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        check_cosimulation(folder)
        check_second(folder)
        check_exchange(folder)
        check_rates(folder)
        check_slopes(folder)
        check_norms(folder)
        check_values(folder)
        check_times(folder)
        check_tunables(folder)
        check_signals(folder)
        check_events(folder)
        check_footholds(folder)
        check_steps(folder)
        check_complaints(folder)
        check_recovery(folder)
        check_uses(folder)
        check_tables(folder)
        check_rejections(folder)
        check_scenes(folder)
        check_names_of_users(folder)
        check_settings(folder)
        check_binary(folder)
        check_page(folder)
        check_schema(folder)
        check_fmusim(folder)
        check_fmusim_early(folder)
        check_fmusim_inputs(folder)
        check_fmpy(folder)
        check_library(folder)
    finish()


main()
