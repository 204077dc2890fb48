"""completed_steps KINETREE: fixed steps on hard contacts that fail, or in which contacts change without end, are completed by a
time step. The run reports this once, and the forces of its records obey the laws of contact_oracle.py.

In a random scene of contact_scenes.py, contacts open and close in turns, and slow slip turns. In a second scene, a ball bounces
between two walls 10,000 times within a step, so that no time step of this length follows it.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note
from contact_oracle import BOUND, Law, Record
from contact_scenes import Scene

KINETREE = sys.argv[1]
STEP, INTERVAL = 1e-3, 1e-4  # s
RUNS = [(200045, "rk4", 0.005)]  # scene, integrator, duration in s
WALLS = """kinetree: 1
gravity: [3, 0, 0]
bodies:
  - {name: ball, joint: {type: prismatic, axis: x, position: 5e-4, velocity: 10}, mass: 2}
effects:
  - {type: joint_limit, name: wall, joint: ball, lower: 0, upper: 1e-3, restitution: 1}
simulate: {duration: 2, step: 1, integrator: rk4}
output: {interval: 0.125, record: [position, velocity]}
"""
# Within a time step, gaps and rates change, and forces are means.
WITHIN = ("Newton's law of a body", "Euler's law of a body", "normal forces push", "friction is inside its cone")


def run(place, scene, integrator, duration):
    """The exit status, the records, the summary and the messages of a run."""
    document = scene.document(duration)
    document["output"]["interval"] = INTERVAL
    path, out, summary = (pathlib.Path(place) / name for name in ("scene.yaml", "out.csv", "summary.json"))
    path.write_text(json.dumps(document))
    command = [KINETREE, "run", str(path), "--out", str(out), "--summary", str(summary), "--integrator", integrator, "--step", str(STEP)]
    ran = subprocess.run(command, capture_output=True, text=True)
    with open(out) as file:
        rows = [{name: float(x) if x else math.nan for name, x in row.items()} for row in csv.DictReader(file)]
    return ran.returncode, [Record(scene, row) for row in rows], json.loads(summary.read_text()), ran.stderr


ended, reported, broken, means = [], [], [], []
for number, integrator, duration in RUNS:
    scene = Scene(number, number % 2 == 0, False)
    with tempfile.TemporaryDirectory() as place:
        status, records, summary, messages = run(place, scene, integrator, duration)
    completed = summary["contacts"].get("completed", {"steps": 0, "time": math.nan, "mean_records": -1})
    warned = [w for w in summary["warnings"] if w["code"] == "step_completed"]
    note(f"scene {number}: exit status {status}, {completed}")
    ended += [] if status == 0 and len(records) == round(duration / INTERVAL) + 1 else [f"scene {number}: {messages.strip()[:300]}"]
    if not (completed["steps"] > 0 and len(warned) == 1 and warned[0]["value"] == completed["steps"]
            and warned[0]["time"] == completed["time"] and messages.count("a time step over contacts completed") == 1):
        reported.append(f"scene {number}: {completed}, {warned}, {messages.strip()[:300]}")
    begin = completed["time"]
    end = math.ceil(begin / STEP) * STEP if begin == begin else math.nan
    within = [r for r in records if begin < r.row["time"] < end + 1e-9]
    if not (completed["steps"] == 1 and completed["mean_records"] == len(within) > 0):
        means.append(f"scene {number}: {completed}, {len(within)} records from {begin} s to {end} s")
    for record in records:
        for law, (value, where) in Law(scene, record, STEP).worst.items():
            if (record not in within or law in WITHIN) and not value <= BOUND:
                broken.append(f"scene {number}: {law}: {value:.3g} > {BOUND:g}: {where}")
claim("fixed_steps_that_fail_or_have_no_end_are_completed", ended)
claim("the_run_reports_completed_steps_once", reported)
claim("records_with_means_lie_within_the_completed_step", means)
claim("records_obey_the_laws_before_within_and_behind_a_completed_step", broken[:10])
with tempfile.TemporaryDirectory() as place:
    path = pathlib.Path(place) / "walls.yaml"
    path.write_text(WALLS)
    ran = subprocess.run([KINETREE, "run", str(path), "--out", str(path.with_suffix(".csv"))], capture_output=True, text=True)
    with open(path.with_suffix(".csv")) as file:
        places = [float(row["position.ball"]) for row in csv.DictReader(file)]
claim("a_run_ends_if_a_time_step_does_not_find_its_impulses",
      [] if ran.returncode == 4 and "has not found its impulses" in ran.stderr and all(0 <= x <= 1e-3 for x in places)
      else [f"exit status {ran.returncode}, places {places[:4]} m: {ran.stderr.strip()[:300]}"])
finish()
