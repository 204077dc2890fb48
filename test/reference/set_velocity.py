#!/usr/bin/env python3
"""Velocities that events set, in random mechanisms, against the least change that numpy finds under the printed Jacobian.

    set_velocity.py [--seeds FIRST:END] KINETREE

An event at t = 0.002 sets one to three velocities. The rows before and behind it give v and w. With the Jacobian A of the loops there,
which `evaluate` prints of the scene as it is written at that instant, w is v + d: of all d with A d = 0 that give what can be given,
in the order of the file, the shortest. What loops decide stays, and the summary has a warning of it. The balance closes.
"""
# SPDX-License-Identifier: Apache-2.0
import argparse
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

try:
    import numpy as np
except ImportError:
    print("[  SKIPPED ] reference/set_velocity: numpy is not on this machine")
    sys.exit(77)

here = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(here / "oracle"), str(here.parent)]
from claims import claim, finish, note  # noqa: E402
from scenes import document, random_scene  # noqa: E402

BOUND = 1e-7  # of the largest velocity and value: rounding, over what a set velocity has left of a direction (1e-2 at least, else not compared)
LEAST = 1e-2
TIME = 0.002


def expected(jacobian, v, at, given):
    """Null space by singular values, and the shortest d by pseudo-inverses, one velocity after the other. None: a case that is close."""
    _, s, rows = np.linalg.svd(jacobian)
    rank = int(np.sum(s > 1e-9 * max(1.0, s[0]))) if len(s) else 0
    basis = rows[rank:].T
    if rank and s[rank - 1] < 1e-3 * s[0]:
        return None
    taken, missed, w = [], 0, v
    for k in range(len(at)):
        trial = basis[[at[i] for i in taken] + [at[k]], :]
        left = np.linalg.svd(trial, compute_uv=False)[-1] if trial.shape[1] >= trial.shape[0] else 0.0
        if 1e-12 < left < LEAST:
            return None
        if left < LEAST:
            missed += abs(w[at[k]] - given[k]) > 1e-8 * (1.0 + abs(given[k]))
            continue
        taken.append(k)
        rows_ = basis[[at[i] for i in taken], :]
        w = v + basis @ np.linalg.pinv(rows_) @ np.array([given[i] - v[at[i]] for i in taken])
    return w, missed


def one(program, seed, folder):
    rng, scene = np.random.default_rng(seed), random_scene(seed)
    file, records = folder / "scene.yaml", folder / "records.csv"
    scene["simulate"].pop("formulation", None)
    scene["simulate"].update(duration=TIME)
    scene["output"] = {"interval": TIME, "record": ["position", "velocity", "balance"]}
    file.write_text(document(scene))

    def run(*words):
        return subprocess.run([program, *map(str, words)], capture_output=True, text=True, timeout=120)

    if run("run", file, "--quiet", "--out", records, "--scene", folder / "end.yaml").returncode != 0:
        return None
    names = [name for name in next(csv.reader(records.open())) if name.startswith("velocity.")]
    if not names:
        return None
    matrix = json.loads(run("evaluate", folder / "end.yaml").stdout)["constraint"]["jacobian"]
    jacobian = np.array(matrix) if matrix else np.zeros((0, len(names)))
    if any(word in file.read_text() for word in ("type: motion", "{sine:", "{ramp:", "{table:", "{polynomial:")):
        return None  # functions of time begin anew in a scene that is written
    at = list(rng.choice(len(names), size=min(len(names), int(rng.integers(1, 4))), replace=False))
    given = [float(x) for x in rng.uniform(-2, 2, len(at))]
    values = ", ".join(f'"{names[a]}": "{names[a]} + {g!r}"' for a, g in zip(at, given))
    scene["simulate"]["duration"] = 2 * TIME
    scene["output"]["interval"] = 0.7 * TIME
    text = document(scene) + f'\nevents: [{{name: set, when: "t - {TIME}", then: {{set: {{{values}}}}}}}]\n'
    file.write_text(text)
    ran = run("run", file, "--quiet", "--out", records, "--summary", folder / "summary.json")
    if ran.returncode != 0:
        return f"status {ran.returncode}: {ran.stderr.strip()}"
    rows = list(csv.reader(records.open()))
    columns = [rows[0].index(name) for name in names]
    table = [[float(x) for x in row] for row in rows[1:]]
    pair = max(k for k in range(1, len(table)) if abs(table[k - 1][0] - TIME) < 1e-9 and abs(table[k][0] - TIME) < 1e-9)
    v, w = (np.array([table[k][c] for c in columns]) for k in (pair - 1, pair))
    found = expected(jacobian, v, at, [v[a] + g for a, g in zip(at, given)])
    if found is None:
        return None
    scale = 1.0 + np.max(np.abs(v)) + np.max(np.abs(found[0]))
    error = float(np.max(np.abs(w - found[0]))) / scale / BOUND
    balance = rows[0].index("energy.balance")
    drift = abs(table[pair][balance] - table[pair - 1][balance]) / (1.0 + abs(table[pair][balance]) + scale**2) / BOUND
    codes = [warning["code"] for warning in json.load((folder / "summary.json").open())["warnings"]]
    warned = "set_velocity" in codes
    if "energy" in codes:
        return "it warns of the energy that the event supplies"
    if warned != (found[1] > 0):
        return f"{found[1]} velocities cannot be set, and it {'warns' if warned else 'is silent'}"
    return max(error, drift), len(jacobian) > 0, warned


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", default="0:100")
    parser.add_argument("program", metavar="KINETREE")
    options = parser.parse_args()
    faults, worst, count, closed, warned = [], 0.0, 0, 0, 0
    for seed in range(*map(int, options.seeds.split(":"))):
        with tempfile.TemporaryDirectory() as folder:
            result = one(options.program, seed, pathlib.Path(folder))
        if isinstance(result, str):
            faults.append(f"seed {seed}: {result}")
        elif result is not None:
            count, closed, warned = count + 1, closed + result[1], warned + result[2]
            worst = max(worst, result[0]) if np.isfinite(result[0]) else np.inf
            if not result[0] <= 1.0:
                faults.append(f"seed {seed}: off by {result[0]:.2g} of the bound")
    note(f"{count} mechanisms, {closed} with loops, {warned} with a warning; worst over bound {worst:.2g}")
    if count < 20 or closed < 10 or warned < 1:
        faults.append("too few mechanisms were compared")
    claim("velocities_that_events_set_change_the_others_by_the_least", faults)
    finish()


main()
