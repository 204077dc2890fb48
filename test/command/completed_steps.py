"""completed_steps KINETREE: fixed steps on hard contacts that fail, or in which contacts change without end, are completed by a
time step. The run reports this once, and the forces of its records obey the laws of contact_oracle.py.

In a random scene of contact_scenes.py, contacts open and close in turns, and slow slip turns. A ball that bounces between two walls
10,000 times within a step of 1 s is no such step, because the time goes on. With 1e7 impacts a step, no time step follows the ball.
In another random scene, slip reverses within steps of 5 ms. It comes to rest after few reversals, so that no step stalls.
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
from contact_oracle import BOUND, OF_MEANS, Law, Record
from contact_scenes import Scene

KINETREE = sys.argv[1]
STEP, INTERVAL = 1e-3, 1e-4  # s
RUNS = [(200045, "rk4", 0.005)]  # scene, integrator, duration in s
WALLS = """kinetree: 1
gravity: [0, 0, 0]
bodies:
  - {{name: ball, joint: {{type: prismatic, axis: x, position: {half:g}, velocity: 10}}, mass: 2}}
effects:
  - {{type: joint_limit, name: wall, joint: ball, lower: 0, upper: {gap:g}, restitution: 1}}
simulate: {{duration: 2, step: 1, integrator: rk4}}
output: {{interval: 0.125, record: [position, velocity]}}
"""
# The times of 20,000 impacts at 10 m/s are exact to four units of rounding each, 2 s at most.
ROUNDING = 20000 * 10 * 4 * sys.float_info.epsilon * 2 / 2

def run(place, scene, integrator, duration, step=STEP, interval=INTERVAL):
    """The exit status, the records, the summary and the messages of a run. 1: the run takes more than a minute."""
    document = scene.document(duration)
    document["output"]["interval"] = interval
    path, out, summary = (pathlib.Path(place) / name for name in ("scene.yaml", "out.csv", "summary.json"))
    path.write_text(json.dumps(document))
    command = [KINETREE, "run", str(path), "--out", str(out), "--summary", str(summary), "--integrator", integrator, "--step", str(step)]
    try:
        ran = subprocess.run(command, capture_output=True, text=True, timeout=60)
    except subprocess.TimeoutExpired:
        return 1, [], {}, ""
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
            if (record not in within or law in OF_MEANS) and not value <= BOUND:
                broken.append(f"scene {number}: {law}: {value:.3g} > {BOUND:g}: {where}")
claim("fixed_steps_that_fail_or_have_no_end_are_completed", ended)
claim("the_run_reports_completed_steps_once", reported)
claim("records_with_means_lie_within_the_completed_step", means)
claim("records_obey_the_laws_before_within_and_behind_a_completed_step", broken[:10])
with tempfile.TemporaryDirectory() as place:
    status, _, summary, _ = run(place, Scene(940017, False, False), "rk4", 0.2, 5e-3, 0.1)
evaluations = summary["cost"]["evaluations"] if status == 0 else math.inf
note(f"slip that reverses: exit status {status}, {evaluations} evaluations (bound 4000; without the count of reversals, more than a minute)")
claim("slip_that_reverses_within_a_step_comes_to_rest",
      [] if evaluations <= 4000 and "completed" not in summary["contacts"] else [f"exit status {status}, {evaluations} evaluations"])


def bounce(gap):
    """Runs a ball that bounces between two walls: the exit status, the summary, the places and the messages."""
    with tempfile.TemporaryDirectory() as place:
        path, out, summary = (pathlib.Path(place) / name for name in ("walls.yaml", "walls.csv", "summary.json"))
        path.write_text(WALLS.format(gap=gap, half=gap / 2))
        ran = subprocess.run([KINETREE, "run", str(path), "--out", str(out), "--summary", str(summary)], capture_output=True, text=True)
        with open(out) as file:
            places = [float(row["position.ball"]) for row in csv.DictReader(file)]
        return ran.returncode, json.loads(summary.read_text()), places, ran.stderr.strip()[:300]


status, summary, places, messages = bounce(1e-3)
apart = max(abs(x - 5e-4) for x in places)  # each record is a whole number of periods
note(f"walls 1 mm apart: exit status {status}, {summary['contacts']}, at most {apart:.2e} m off (bound {ROUNDING:.2e})")
claim("a_run_with_10000_impacts_a_step_goes_on",
      [] if status == 0 and summary["contacts"]["impacts"] == 20000 and "completed" not in summary["contacts"] and apart <= ROUNDING
      else [f"exit status {status}, {summary['contacts']}, {apart} m: {messages}"])
status, summary, places, messages = bounce(1e-6)
claim("a_run_ends_if_a_time_step_does_not_find_its_impulses",
      [] if status == 4 and "has not found its impulses" in messages and all(0 <= x <= 1e-6 for x in places)
      else [f"exit status {status}, places {places[:4]} m: {messages}"])
finish()
