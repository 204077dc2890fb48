"""switched KINETREE: what a scene releases and engages, in records and summary: two rows at an instant, columns of zeros where a loop is off,
the loss in the energies, no warning of it, and whether it is on at the end; and what hard contacts warn of.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE = sys.argv[1]
os.environ["LSAN_OPTIONS"] = f"print_suppressions=0:suppressions={pathlib.Path(__file__).resolve().with_name('suppressions.txt')}"  # of pictures
DASHED = re.compile(r'stroke-dasharray(?::3,3;"|="3 3") d="(M [^"]*)"')  # of cairo 1.16 and of 1.18
# 0.3 at 10 rad/s and 0.5 at -2 rad/s: 2.5 rad/s together, and 13.5 J of 16 J lost.
CLUTCH = """kinetree: 1
name: clutch
bodies:
  - {name: engine, joint: {type: revolute, velocity: 10}, mass: 1, inertia: [0.3, 0.3, 0.3]}
  - {name: load, joint: {type: revolute, velocity: -2}, mass: 1, inertia: [0.5, 0.5, 0.5]}
loops:
  - {name: clutch, type: coupling, coefficients: {engine: 1, load: -1}, offset: 6, switched: off}
effects:
  - {type: motor, name: drive, joint: engine, torque: 1, switched: off}
events:
  - {name: grip, when: position.engine - position.load - 6, direction: rising, limit: 1, then: {engage: clutch}}
  - {name: pull, when: t - 1, direction: rising, then: {engage: drive}}
simulate: {duration: 2}
output: {record: [position, velocity, energy, balance, reaction, multiplier, effect]}
"""

# Dry friction of 2 N m slips until both turn alike; then it sticks by 0.5 / 0.8 of the drive's 1 N m, until it is released.
PLATES = """kinetree: 1
name: plates
bodies:
  - {name: engine, joint: {type: revolute, velocity: 10}, mass: 1, inertia: [0.3, 0.3, 0.3]}
  - {name: load, parent: engine, joint: {type: revolute, velocity: -10}, mass: 1, inertia: [0.5, 0.5, 0.5]}
effects:
  - {name: plates, type: joint_friction, joint: load, coulomb: 2, static: 3, stribeck: 0, stick: true, switched: off}
  - {name: drive, type: motor, joint: engine, torque: 1}
events:
  - {name: close, when: t - 0.5, then: {engage: plates}}
  - {name: open, when: t - 3, then: {release: plates}}
simulate: {duration: 4}
output: {record: [position, velocity, energy, balance, reaction, multiplier, effect]}
"""

# It falls onto three feet, with so much friction that slow slip of one foot depends on that of the others.
FEET = {"p0": "[0.25, -0.0006227, -0.1]", "p1": "[-0.07735, 0.2377, -0.1]", "p2": "[-0.1668, -0.1862, -0.1]"}
STOOL = f"""kinetree: 1
name: stool
gravity: [0, 0, -9.81]
bodies:
  - name: body
    joint:
      type: free
      position: {{position: [0, 0, 0.15]}}
      velocity: {{linear: [0.0749, 0.7165, 0], angular: [-0.4489, 0.4981, 0.3394]}}
    mass: 2
    inertia: [0.03, 0.03, 0.03]
    markers: {{{", ".join(f"{name}: {at}" for name, at in FEET.items())}}}
effects:
""" + "".join(f"  - {{name: {name}, type: contact, point: body.{name}, plane: world, restitution: 0, friction: 2.165}}\n" for name in FEET) + """simulate: {duration: 0.6, integrator: dopri5, tolerance: 1e-11}
"""
# Friction wedges this rod while its slip is slow: slip has no direction a moment later.
ROD = """kinetree: 1
name: rod
gravity: [0, 0, -9.81]
bodies:
  - name: rod
    joint:
      type: free
      position: {position: [0, 0, 0.24154985], orientation: {axis: [0, 1, 0], angle: 0.48148934}}
      velocity: {linear: [-0.579, 0.899, 1.3174756], angular: [-2.911, 2.973, 1.258]}
    mass: 2
    inertia: [0.01, 0.1666667, 0.1666667]
    markers: {head: [0.5, 0, 0], foot: [-0.5, 0, 0]}
effects:
""" + "".join(f"  - {{name: {name}, type: contact, point: rod.{name}, plane: world, radius: 0.01, restitution: 0.22, friction: 2.96}}\n" for name in ("head", "foot")) + """simulate: {duration: 0.5, step: 0.004, integrator: rk4}
"""

with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder)
    (path / "clutch.yaml").write_text(CLUTCH)
    (path / "rod.yaml").write_text(ROD)
    rod = subprocess.run([KINETREE, "run", "rod.yaml", "--out", "rod.csv", "--summary", "rod.json"], cwd=path, capture_output=True, text=True)
    wedged = json.loads((path / "rod.json").read_text())
    (path / "plates.yaml").write_text(PLATES)
    (path / "stool.yaml").write_text(STOOL)
    stool = subprocess.run([KINETREE, "run", "stool.yaml", "--out", "stool.csv", "--summary", "stool.json"], cwd=path, capture_output=True, text=True)
    fallen = json.loads((path / "stool.json").read_text())
    opened = subprocess.run([KINETREE, "run", "plates.yaml", "--out", "plates.csv", "--summary", "plates.json", "--view", "plates.html"], cwd=path,
                            capture_output=True, text=True)
    note(opened.stderr.strip())
    plates = list(csv.DictReader((path / "plates.csv").open(newline="")))
    ends = json.loads((path / "plates.json").read_text())
    ran = subprocess.run([KINETREE, "run", "clutch.yaml", "--out", "out.csv", "--summary", "sum.json", "--view", "out.html"], cwd=path,
                         capture_output=True, text=True)
    note(ran.stderr.strip())
    # The coupling loads no bearing, which has a warning of its own.
    other = ran.stderr.replace("warning: the reactions of the joints engine, load lack the forces of clutch", "")
    claim("it_runs_without_a_warning", [] if ran.returncode == 0 and "warning" not in other else [ran.stderr])
    summary = json.loads((path / "sum.json").read_text())
    rows = list(csv.DictReader((path / "out.csv").open(newline="")))
    drawn = {}
    for name in ("clutch", "plates"):
        run = [KINETREE, "run", f"{name}.yaml", "--quiet", "--record", "position", "--out", f"{name}-again.csv"]
        subprocess.run([*run, "--summary", f"{name}-again.json", "--plot", f"{name}-run.svg"], cwd=path, check=True)
        subprocess.run([KINETREE, "plot", f"{name}-again.csv", "--marks", f"{name}-again.json", "--out", f"{name}-plot.svg"], cwd=path, check=True)
        subprocess.run([KINETREE, "plot", f"{name}-again.csv", "--out", f"{name}-bare.svg"], cwd=path, check=True)
        drawn[name] = [DASHED.findall((path / f"{name}-{kind}.svg").read_text()) for kind in ("run", "plot", "bare")]
        drawn[name].append(json.loads((path / f"{name}-again.json").read_text())["marks"])
    unmarked = subprocess.run([KINETREE, "plot", "out.csv", "--marks", "stool.json", "--x", "position.load"], cwd=path, capture_output=True, text=True)
    markless = subprocess.run([KINETREE, "plot", "out.csv", "--marks", "clutch.yaml"], cwd=path, capture_output=True, text=True)
    rejected = subprocess.run([KINETREE, "run", "clutch.yaml", "--formulation", "absolute", "--out", "-"], cwd=path, capture_output=True, text=True)
plates = [{key.split(" [")[0]: float(value) for key, value in row.items()} for row in plates]
rows = [{key.split(" [")[0]: float(value) for key, value in row.items()} for row in rows]
pairs = [(a, b) for a, b in zip(rows, rows[1:]) if a["time"] == b["time"]]
claim("an_instant_has_two_rows", [] if [round(a["time"], 9) for a, _ in pairs] == [0.5, 1.0] else [str([a["time"] for a, _ in pairs])])
(before, behind), (idle, driven) = pairs


def near(what, observed, expected):
    note(f"{what}: {observed}, expected {expected}")
    return [] if abs(observed - expected) < 1e-9 else [f"{what}: {observed}, not {expected}"]


claim("both_turn_together_behind_it", near("engine", behind["velocity.engine"], 2.5) + near("load", behind["velocity.load"], 2.5))
claim("the_loss_is_in_the_balance", near("J", behind["energy.dissipated"] - before["energy.dissipated"], 13.5))
claim("the_balance_is_closed", near("J", rows[-1]["energy.balance"], rows[0]["energy.balance"]))
claim("what_is_off_is_zero", near("clutch", before["reaction.clutch.multiplier"], 0.0) + near("drive", idle["effect.drive.torque"], 0.0))
# The drive accelerates 0.8 kg m^2 by 1 N m, and the clutch bears what the load takes of it.
claim("what_is_on_is_not", near("drive", driven["effect.drive.torque"], 1.0) + near("clutch", abs(driven["reaction.clutch.multiplier"]), 0.625))
claim("the_summary_says_what_is_on", [] if summary["switched"] == {"clutch": True, "drive": True} and summary["events"]["grip"] == 1 else [str(summary["switched"])])
claim("friction_is_opened_and_closed_without_a_warning", [] if opened.returncode == 0 and "warning" not in opened.stderr else [opened.stderr])
(free, slips), (sticks, open_again) = [(a, b) for a, b in zip(plates, plates[1:]) if a["time"] == b["time"]]
claim("released_friction_is_zero", near("torque", free["effect.plates.torque"], 0.0) + near("stick", free["reaction.plates.stick.multiplier"], 0.0) +
      near("torque", open_again["effect.plates.torque"], 0.0) + near("stick", open_again["reaction.plates.stick.multiplier"], 0.0))
claim("engaged_it_slips_and_sticks", near("torque", abs(slips["effect.plates.torque"]), 2.0) + near("stick", slips["reaction.plates.stick.multiplier"], 0.0) +
      near("torque", abs(sticks["effect.plates.torque"]), 0.625) + near("stick", abs(sticks["reaction.plates.stick.multiplier"]), 0.625))
claim("the_summary_says_that_it_is_released", [] if ends["switched"] == {"plates.stick": False, "plates": False} and ends["contacts"]["sticks"] == 1
      and ends["contacts"]["slips"] == 0 else [str(ends["switched"]), str(ends["contacts"])])
note(f"stool: {fallen['cost']['evaluations']} evaluations")
claim("slow_slip_of_several_feet_has_directions_and_comes_to_rest", [] if stool.returncode == 0 and "warning" not in stool.stderr and fallen["warnings"] == []
      and fallen["contacts"]["unconverged"] == 0 and fallen["cost"]["evaluations"] < 5000 else [stool.stderr, str(fallen["cost"]), str(fallen["contacts"])])
capped = [warning for warning in wedged["warnings"] if warning["code"] == "contact_capped"]
claim("slow_slip_without_a_direction_is_a_warning", [] if rod.returncode == 0 and len(capped) == 1 and capped[0]["value"] == wedged["contacts"]["unconverged"] > 0
      and "direction of slow slip did not converge" in rod.stderr else [rod.stderr, str(wedged["contacts"]), str(wedged["warnings"])])
claim("the_summary_lists_events_and_transitions", [] if [(round(m["time"], 9), m["name"]) for m in drawn["clutch"][3]] == [(0.5, "grip"), (1.0, "pull")]
      and [m["name"] for m in drawn["plates"][3]] == ["close", "plates.stick", "open"] else [str(drawn["clutch"][3]), str(drawn["plates"][3])])
claim("a_plot_of_finished_records_has_the_marks_of_the_run", [f"{name}: {run} {plot} {bare}" for name, (run, plot, bare, marks) in drawn.items()
      if len(plot) != len(marks) or run[:len(plot)] != plot or bare != []])
claim("marks_are_rejected_where_they_cannot_be_drawn", [] if unmarked.returncode == 1 and "with the time as x" in unmarked.stderr and markless.returncode == 2
      and "it is no summary" in markless.stderr else [unmarked.stderr, markless.stderr])
claim("the_absolute_formulation_rejects", [] if rejected.returncode != 0 and "formulation: tree" in rejected.stderr else [rejected.stderr])
finish()
