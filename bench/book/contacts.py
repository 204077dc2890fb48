"""Hard contacts in other engines: a block, a robot and a heap, by `bench-contact-engines`."""
# SPDX-License-Identifier: Apache-2.0
import csv
import math
import os
import subprocess

from table import Table, show

PROGRAM = "bench-contact-engines"
TEXT = [
    "The same spheres, planes and mechanisms in this engine, MuJoCo and ODE. *Error* is the largest distance from the closed form (block)",
    "or from a run with events at a tolerance of 1e-12 (quadruped). The heap is chaotic: its error is the largest speed of a centre at the",
    "end. *Depth* is the largest penetration at the records. *MuJoCo* has the defaults of that engine, whose contacts are soft by design.",
    "*MuJoCo, stiff* has time constants of two steps, the elliptic cone and the solver against slip. *ODE* has `dWorldStep`, and *ODE,",
    "quick* has `dWorldQuickStep`. The controller of the quadruped is the same in all engines: its torques are constant for 1 ms."]


def number(text):
    return float(text) if text else math.nan


def setting_of(row):
    value = float(row["setting"])
    return f"{1e3 * value:g} ms" if row["kind"] == "step" else f"{value:g}"


def tables(context):
    if context.short: # times only
        return []
    table = Table("contacts-times", "Hard contacts in other engines",
                  ["scene", "engine", "setting", "measured", "depth, m", "ms a second", "observed", "bound", "verdict"], TEXT, timed=True)
    program, path = os.path.join(context.programs or "", PROGRAM), os.path.join(context.work, "contacts.csv")
    if not context.programs or not os.path.exists(program):
        table.text = [f"The build has no `{PROGRAM}`."]
        return [table]
    ended = subprocess.run([program, "--csv", path], capture_output=True, text=True)
    if ended.returncode != 0:
        table.violations.append(f"{PROGRAM}: {ended.stderr.strip() or ended.returncode}")
    page = Table("contacts-page-times", "", ["scene", "engine", "long steps", "shorter steps", "short steps"], timed=True)
    cells = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            cost = f"{float('%.2g' % (1e3 * float(row['seconds']) / float(row['duration_s']))):g}"
            error, depth, bound = (number(row[name]) for name in ("error", "depth_m", "bound"))
            known = {"observed": error, "bound": bound} if not math.isnan(bound) else {}
            table.add(row["scene"], row["engine"], setting_of(row), row["measured"], depth, cost, *([] if known else [error, "-", "-"]), **known)
            cell = row["words"] or f"{show(error)}, {show(depth)}, {cost}"
            cells.setdefault((row["scene"], row["engine"]), []).append(f"{setting_of(row)}: {cell}")
    for (scene, engine), found in cells.items():
        page.add(scene, engine, *found, *["-"] * (3 - len(found)))
    return [table, page]
