#!/usr/bin/env python3
"""Recorded angular velocities and accelerations are the derivatives of recorded orientations, in random mechanisms; and the recorded
singular value is that of the printed Jacobian, by numpy.

    rotation_columns.py [--seeds FIRST:END] KINETREE

With the quaternion p(t) of a body, w = 2 p' p* has world axes and p* w p body axes. p' is a central difference of order six of the
records, and w' likewise of the recorded w. The body components of w' are also the derivatives of the body components of w.
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
    print("[  SKIPPED ] reference/rotation_columns: numpy is not on this machine")
    sys.exit(77)

here = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(here / "oracle"), str(here.parent)]
from claims import claim, finish, note  # noqa: E402
from scenes import document, random_scene  # noqa: E402

STEP = 2.5e-4
# Over the largest value of the body's own rates along the records. The difference's error is h^6/140 of the seventh derivative:
# 2e-9 for a time constant of 2 ms. Beyond is what the tolerance of the run leaves of a difference, 1e-12/h.
BOUND = {"angular velocity": 2e-8, "angular acceleration": 2e-8, "body components": 1e-12, "singular value": 1e-8}
STENCIL = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / (60.0 * STEP)


def product(p, r):
    """Of quaternions, w x y z, row by row."""
    w = p[:, :1] * r[:, :1] - np.sum(p[:, 1:] * r[:, 1:], axis=1, keepdims=True)
    return np.hstack([w, p[:, :1] * r[:, 1:] + r[:, :1] * p[:, 1:] + np.cross(p[:, 1:], r[:, 1:])])


def derivative(x):
    return sum(c * x[k : len(x) - 6 + k] for k, c in enumerate(STENCIL))


def read(file):
    rows = list(csv.reader(file.open()))
    return {name: np.array([float(row[k]) for row in rows[1:]]) for k, name in enumerate(rows[0])}


def run(program, *words):
    return subprocess.run([program, *map(str, words)], capture_output=True, text=True, timeout=120)


def rotations(table, body, worst):
    p = np.array([table[f"orientation.{body}.{c}"] for c in "wxyz"]).T
    signs = np.cumprod(np.concatenate([[1.0], np.where(np.sum(p[1:] * p[:-1], axis=1) < 0.0, -1.0, 1.0)]))
    p = p * signs[:, None]
    w, wb = (np.array([table[f"angular_velocity.{body}.{f}{c}"] for c in "xyz"]).T for f in ("", "body_"))
    a, ab = (np.array([table[f"angular_acceleration.{body}.{f}{c}"] for c in "xyz"]).T for f in ("", "body_"))
    star, inner = p * np.array([1.0, -1.0, -1.0, -1.0]), slice(3, -3)
    scale = 1.0 + np.max(np.abs(w)) + np.max(np.abs(a))

    def see(what, error):
        ratio = float(np.max(np.abs(error))) / scale / BOUND[what]
        worst[what] = max(worst.get(what, 0.0), ratio) if np.isfinite(ratio) else np.inf

    see("angular velocity", 2.0 * product(derivative(p), star[inner])[:, 1:] - w[inner])
    see("angular acceleration", derivative(w) - a[inner])
    see("angular acceleration", derivative(wb) - ab[inner])
    for world, own in ((w, wb), (a, ab)):
        see("body components", product(product(star, np.hstack([np.zeros((len(p), 1)), world])), p)[:, 1:] - own)


def singular_value(program, scene, table, worst):
    """At the start, where `evaluate` prints the matrix."""
    printed = run(program, "evaluate", scene)
    if printed.returncode != 0:
        return False
    jacobian = np.array(json.loads(printed.stdout)["constraint"]["jacobian"])
    values = np.linalg.svd(jacobian, compute_uv=False)
    if not values[0] > 0.0:
        return False  # an equation that holds whatever the joints do
    rank = int(np.sum(values > 1e-9 * values[0]))
    error = abs(table["constraint.singular_value"][0] - values[rank - 1]) / values[0] / BOUND["singular value"]
    worst["singular value"] = max(worst.get("singular value", 0.0), error) if np.isfinite(error) else np.inf
    return True


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", default="0:60")
    parser.add_argument("program", metavar="KINETREE")
    options = parser.parse_args()
    worst, faults, turned, closed = {}, [], 0, 0
    for seed in range(*map(int, options.seeds.split(":"))):
        scene = random_scene(seed)
        scene["simulate"].update(duration=0.006)
        record = ["position", "velocity", "orientation", "angular velocity", "angular acceleration"]
        scene["output"] = {"interval": STEP, "record": record + (["singular value"] if scene.get("loops") else [])}
        with tempfile.TemporaryDirectory() as folder:
            file, records = pathlib.Path(folder) / "scene.yaml", pathlib.Path(folder) / "records.csv"
            file.write_text(document(scene))
            ran = run(options.program, "run", file, "--quiet", "--out", records)
            if ran.returncode == 3:
                continue  # near a singular position: reference/oracle counts them
            if ran.returncode != 0:
                faults.append(f"seed {seed}: {ran.stderr.strip()}")
                continue
            table, here_ = read(records), {}
            for body in scene["bodies"]:
                rotations(table, body["name"], here_)
                turned += 1
            if scene.get("loops"):
                closed += singular_value(options.program, file, table, here_)
        for what, ratio in here_.items():
            if not ratio <= 1.0:
                faults.append(f"seed {seed}: {what} is off by {ratio:.2g} of its bound")
            worst[what] = max(worst.get(what, 0.0), ratio)
    note(f"{turned} bodies, {closed} Jacobians; worst over bound: " + ", ".join(f"{k} {v:.2g}" for k, v in sorted(worst.items())))
    if turned < 50 or closed < 10:
        faults.append("too few mechanisms were compared")
    claim("recorded_rotations_and_singular_values_are_those_of_orientations_and_jacobians", faults)
    finish()


main()
