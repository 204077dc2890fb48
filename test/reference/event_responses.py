#!/usr/bin/env python3
"""Events that read accelerations, reactions and angular rates happen where the recorded columns pass their values.

    event_responses.py [--seeds FIRST:END] KINETREE

Closed form: a point on a massless rod of 1 m that falls from the horizontal by phi has the reaction 3 m g sin(phi) along the rod and
the angular acceleration -g cos(phi). Random mechanisms: of a column that varies the value halfway between two records is watched.
Columns are written by the records of the simulation, events evaluate the equations in the state by themselves.
"""
# SPDX-License-Identifier: Apache-2.0
import argparse
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile

try:
    import numpy as np
except ImportError:
    print("[  SKIPPED ] reference/event_responses: numpy is not on this machine")
    sys.exit(77)

here = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(here / "oracle"), str(here.parent)]
from claims import claim, finish, note  # noqa: E402
from scenes import document, random_scene  # noqa: E402

BOUND = 1e-7  # of the column's range: its change within the event's time, 4 units of rounding, and the tolerance, 1e-12, through two derivatives
RESPONSES = ("acceleration.", "reaction.", "marker.", "angular_velocity.", "angular_acceleration.")
FALL = """kinetree: 1
gravity: [0, -9.81, 0]
bodies:
  - {name: rod, joint: {type: revolute, axis: z}, mass: 1, com: [1, 0, 0], inertia: [0, 0, 0], markers: {tip: [1, 0, 0]}}
states: {drop: {rate: -velocity.rod}}
events:
  - {name: tension, when: "hypot(reaction.rod.fx, reaction.rod.fy) > 15", then: record}
  - {name: level, when: marker.rod.tip.ay, then: record}
  - {name: half, when: angular_acceleration.rod.body_z + 9.81/2, then: {set: {drop: angular_velocity.rod.z + acceleration.rod}}}
simulate: {duration: 2, tolerance: 1e-12, until: reaction.rod.fy > 28}
output: {record: [position, velocity, acceleration, state]}
"""


def run(program, *words):
    return subprocess.run([program, *map(str, words)], capture_output=True, text=True, timeout=120)


def rows_of(file):
    rows = list(csv.reader(file.open()))
    return rows[0], [[float(x) for x in row] for row in rows[1:]]


def closed_form(program, folder):
    file, records = folder / "fall.yaml", folder / "records.csv"
    file.write_text(FALL)
    ran = run(program, "run", file, "--quiet", "--out", records, "--summary", folder / "summary.json")
    if ran.returncode != 0:
        return [f"status {ran.returncode}: {ran.stderr.strip()}"]
    names, rows = rows_of(records)
    expected = {"tension": math.asin(15 / 29.43), "level": math.asin(math.sqrt(1 / 3)), "half": math.pi / 3, "until": math.asin(math.sqrt(28 / 29.43))}
    marks = {mark["name"]: mark["time"] for mark in json.load((folder / "summary.json").open())["marks"]}
    faults = []
    for name, phi in expected.items():
        found = [-row[names.index("position.rod")] for row in rows if abs(row[0] - marks.get(name, -1.0)) < 1e-12]
        error = max((abs(x - phi) for x in found), default=math.nan)
        note(f"{name} at phi = {phi:.6f}: off by {error:.2g} rad (bound 1e-10)")
        if not error <= 1e-10:
            faults.append(f"{name} happens elsewhere")
    after = [row for row in rows if abs(row[0] - marks.get("half", -1.0)) < 1e-12][-1]
    error = abs(after[names.index("state.drop")] - after[names.index("velocity.rod")] - after[names.index("acceleration.rod")])
    note(f"a state that is set by an acceleration is off by {error:.2g} (bound 1e-10)")
    return faults if error <= 1e-10 else [*faults, "the state that is set has another value"]


def one(program, seed, folder):
    rng, scene = np.random.default_rng(seed), random_scene(seed)
    file, records = folder / "scene.yaml", folder / "records.csv"
    scene["simulate"].pop("formulation", None)
    scene["simulate"].update(duration=0.02)
    markers = [f"{body['name']}.m" for body in scene["bodies"]]
    kinds = ["acceleration", "reaction", "marker velocity", "marker acceleration", "angular velocity", "angular acceleration"]
    scene["output"] = {"interval": 1e-4, "record": kinds, "markers": markers}
    file.write_text(document(scene))
    if run(program, "run", file, "--quiet", "--out", records).returncode != 0:
        return None
    names, rows = rows_of(records)
    table = np.array(rows)
    spread = np.ptp(table, axis=0)
    # joints with a quaternion or several coordinates have brackets, which are fine; markers' own positions are no responses
    able = [k for k, name in enumerate(names) if name.startswith(RESPONSES) and name.rsplit(".", 1)[1] not in ("x", "y", "z", "vx", "vy", "vz") or name.startswith("angular")]
    able = [k for k in able if spread[k] > 1e-6 * (1.0 + np.max(np.abs(table[:, k])))]
    if not able:
        return None
    column = int(rng.choice(able))
    x, row = table[:, column], int(rng.integers(20, 180))
    level = 0.5 * float(x[row] + x[row + 1])
    below = x < level
    crossings = int(np.sum(below[1:] != below[:-1]))
    if np.min(np.abs(x - level)) < 1e-6 * spread[column] or crossings == 0:
        return None
    file.write_text(document(scene) + f'\nevents: [{{name: watch, when: "{names[column]} - ({level!r})", then: record}}]\n')
    ran = run(program, "run", file, "--quiet", "--out", records, "--summary", folder / "summary.json")
    if ran.returncode != 0:
        return f"{names[column]}: status {ran.returncode}: {ran.stderr.strip()}"
    count = json.load((folder / "summary.json").open())["events"]["watch"]
    times = [mark["time"] for mark in json.load((folder / "summary.json").open())["marks"] if mark["name"] == "watch"]
    _, rows = rows_of(records)
    errors = [abs(r[column] - level) / spread[column] / BOUND for r in rows for t in times if r[0] == t]
    if count != crossings:
        return f"{names[column]} passes {level:g} {crossings} times, and {count} events happen"
    return (max(errors) if errors else math.inf), names[column].split(".")[0]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", default="0:60")
    parser.add_argument("program", metavar="KINETREE")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        claim("events_of_a_falling_rod_are_at_their_angles", closed_form(options.program, pathlib.Path(folder)))
    faults, worst, kinds = [], 0.0, {}
    for seed in range(*map(int, options.seeds.split(":"))):
        with tempfile.TemporaryDirectory() as folder:
            result = one(options.program, seed, pathlib.Path(folder))
        if isinstance(result, str):
            faults.append(f"seed {seed}: {result}")
        elif result is not None:
            kinds[result[1]] = kinds.get(result[1], 0) + 1
            worst = max(worst, result[0])
            if not result[0] <= 1.0:
                faults.append(f"seed {seed}: {result[1]} is off by {result[0]:.2g} of the bound")
    note(f"events of {kinds}; worst over bound {worst:.2g}")
    if sum(kinds.values()) < 20 or len(kinds) < 4:
        faults.append("too few were compared")
    claim("events_happen_where_recorded_columns_pass_their_values", faults)
    finish()


main()
