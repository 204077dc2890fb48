"""joint_names KINETREE: joints with names of their own move as those that bear the names of their bodies, to the bit, and everything that
refers to a joint or tells one does so by its name.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE = sys.argv[1]

# Every kind of reference: relations, drives, what is held, effects, formulas, events, columns.
SCENE = """kinetree: 1
name: references
gravity: [0, -9.81, 0]
bodies:
  - {name: a, joint: {type: revolute, NAME_a axis: z, position: 0.3, velocity: 1}, mass: 1, shape: {type: rod, to: [1, 0, 0]}, markers: {tip: [1, 0, 0]}}
  - {name: b, parent: a, joint: {type: revolute, NAME_b axis: z, at: [1, 0, 0], position: 0.2}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}
  - {name: c, parent: b, joint: {type: revolute, NAME_c axis: z, at: [1, 0, 0]}, mass: 1, shape: {type: rod, to: [0.5, 0, 0]}}
  - {name: d, joint: {type: prismatic, NAME_d axis: x, at: [0, -2, 0]}, mass: 3}
  - {name: e, joint: {type: prismatic, NAME_e axis: x, at: [0, -3, 0]}, mass: 2}
  - {name: f, joint: {type: spherical, NAME_f at: [3, 0, 0]}, mass: 1, com: [0.2, 0.1, 0], inertia: [0.1, 0.2, 0.2]}
loops:
  - {name: gear, type: coupling, coefficients: {JOINT_a: 1, JOINT_c: -2}}
  - {name: drive, type: motion, joint: JOINT_d, position: {sine: {amplitude: 0.1, frequency: 1}}}
initial: {hold: [JOINT_a]}
effects:
  - {type: joint_spring, joint: JOINT_b, stiffness: 5}
  - {type: joint_damper, joint: JOINT_a, damping: 0.2}
  - {type: joint_friction, joint: JOINT_b, coulomb: 0.1}
  - {type: joint_limit, joint: JOINT_e, lower: -1, upper: 1, stiffness: 1000}
  - {type: motor, joint: JOINT_b, torque: 0.3}
  - {type: servo, joint: JOINT_e, target: 0.2, stiffness: 10, damping: 1}
FORMULAS
simulate: {duration: 0.4, integrator: rk4, step: 0.001}
output: {interval: 0.1, record: [position, velocity, acceleration, energy, constraint, reaction], markers: [a.tip]}
"""
FORMULAS = '  - {type: expression, joint: JOINT_e, force: "-2*velocity.JOINT_e + position.JOINT_a"}'
OWN = {"a": "shoulder", "b": "a", "c": "b-1", "d": "c", "e": "slider", "f": "ball"}  # others' names among them


def scene_of(names, formulas):
    """The scene whose joints bear these names; None: those of the bodies."""
    text = SCENE.replace("FORMULAS", FORMULAS if formulas else "")
    for body, own in OWN.items():
        text = text.replace(f"NAME_{body} ", f"name: {own}, " if names else "").replace(f"JOINT_{body}", own if names else body)
    return text


def run(folder, text, *options):
    """Header, rows, summary."""
    path = pathlib.Path(folder) / "scene.yaml"
    path.write_text(text)
    done = subprocess.run([KINETREE, "run", path, "--out", "-", "--summary", pathlib.Path(folder) / "s.json", *options],
                          capture_output=True, text=True, timeout=120)
    if done.returncode != 0:
        return None, [done.stderr], {}
    lines = done.stdout.splitlines()
    return lines[0].split(","), lines[1:], json.loads((pathlib.Path(folder) / "s.json").read_text())


def renamed(column):
    kind, *rest = column.split(".")
    if kind not in ("position", "velocity", "acceleration", "reaction"):
        return column
    name, index = rest[0].split("[")[0], rest[0][len(rest[0].split("[")[0]):]
    return ".".join([kind, OWN.get(name, name) + index, *rest[1:]])


faults = {"same_bits": [], "columns_bear_the_names": [], "summary_bears_the_names": []}
with tempfile.TemporaryDirectory() as folder:
    for formulas, options in ((True, ()), (False, ("--formulation", "absolute")), (True, ("--plan", "spatial"))):
        header, rows, summary = run(folder, scene_of(False, formulas), *options)
        own_header, own_rows, own_summary = run(folder, scene_of(True, formulas), *options)
        if header is None or own_header is None:
            faults["same_bits"].append((rows if header is None else own_rows)[0])
            continue
        note(f"{' '.join(options) or 'tree'}: {len(rows)} records of {len(header)} columns")
        if rows != own_rows or len(rows) < 5:
            faults["same_bits"].append(f"{options}: {sum(a != b for a, b in zip(rows, own_rows))} of {len(rows)} records differ")
        wrong = [own for column, own in zip(header, own_header) if renamed(column) != own]
        if wrong:
            faults["columns_bear_the_names"].append(f"{options}: {wrong}")
        for part in ("position", "velocity", "acceleration"):
            if {OWN[name]: value for name, value in summary[part].items()} != own_summary[part]:
                faults["summary_bears_the_names"].append(f"{options}: {part} {own_summary[part]}")

    # A result goes on by the names of joints, and what is written can be read.
    path = pathlib.Path(folder) / "scene.yaml"
    end = pathlib.Path(folder) / "end.yaml"
    path.write_text(scene_of(True, True))
    subprocess.run([KINETREE, "run", path, "--out", "/dev/null", "--scene", end], check=True, capture_output=True, timeout=120)
    written = end.read_text() if end.exists() else ""
    header, rows, _ = run(folder, written)
    lost = [own for own in OWN.values() if f"name: {own}" not in written] + ([] if header else rows)
    claim("names_are_written_and_read_again", lost)
    wrong = {"unknown": ("joint: JOINT_b, stiffness", "joint: slidre, stiffness", "did you mean 'slider'"),
             "of_another_body": ("joint: JOINT_b, stiffness", "joint: e, stiffness", "did you mean 'slider'"),
             "taken": ("NAME_e", "name: f,", "choose another"),
             "no_name": ("NAME_e", "name: 7th,", "is not valid")}
    told = []
    for case, (old, new, words) in wrong.items():
        text = SCENE.replace(old, new)
        text = text.replace("NAME_f ", "")
        for body, own in OWN.items():
            text = text.replace(f"NAME_{body} ", f"name: {own}, ").replace(f"JOINT_{body}", own if body != "f" else "f")
        path.write_text(text.replace("FORMULAS", "").replace("joint: slider", "joint: f7" if case in ("taken", "no_name") else "joint: slider"))
        done = subprocess.run([KINETREE, "check", path], capture_output=True, text=True, timeout=60)
        if done.returncode != 2 or words not in done.stderr:
            told.append(f"{case}: {done.returncode}, {done.stderr}")
    claim("faults_suggest_names_of_joints", told)
for name, found in faults.items():
    claim(name, found)
finish()
