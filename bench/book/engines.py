"""Other engines on the same scenes: processor time for an error, by `kinetree accuracy --peers`.

Each engine runs its own methods at its own ladder of steps. Errors are those of joints at 200 records, against the
study's reference."""
# SPDX-License-Identifier: Apache-2.0
import csv
import math
import os
import subprocess

from table import Table

SCENES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "apps", "scenes")
# scene, duration (s)
PROBLEMS = [("double-pendulum", 3), ("rod-chain-5", 2), ("arm7", 1), ("lagrange-top", 2), ("four-bar", 2), ("bricard", 5), ("andrews", 0.03)]
GOALS = [1e-3, 1e-6]
PAGE_GOAL = 1e-6
PAGE = ["SUNDIALS", "MuJoCo", "Simbody", "ODE"]
BUDGET = 6  # s of processor time of the study; each method of an engine gets a part of as much
TEXT = [
    "`kinetree accuracy SCENE --peers` runs each scene here and in other engines. A cell has the milliseconds of processor time",
    "that a simulated second costs, with the method and its step or tolerance, at the cheapest setting that keeps the goal.",
    "*Least* is the smallest error that the engine reaches. MuJoCo reads what `kinetree export --mjcf` writes; its constraints",
    "are soft by design, with a time constant of two steps. ODE has free bodies and constraints. *Observed* is the time here over",
    "the engine's. An engine without a cell does not reach the goal, or cannot run the scene: the table states why."]


def read_points(path):
    """{(engine, method): points} of a study; the engine is empty for the library's own methods."""
    curves = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            curves.setdefault((row["variant"], row["method"]), []).append(row)
    return curves


def usable(row):
    return row["status"] in ("ok", "below the reference") and row["cpu"] != ""


def cheapest(curves, goal):
    """(seconds, method, setting) of the cheapest point that keeps the goal; None."""
    found = [(float(row["cpu"]), method, float(row["setting"]), row["kind"]) for (_, method), rows in curves.items() for row in rows
             if usable(row) and float(row["error.position"]) <= goal]
    return min(found) if found else None


def least(curves):
    errors = [float(row["error.position"]) for rows in curves.values() for row in rows if usable(row)]
    return min(errors) if errors else None


def cell(setting, duration):
    return "-" if setting is None else f"{setting[1]}, {setting[3]} {setting[2]:.2g}: {1e3 * setting[0] / duration:.3g}"


def measure(context, scene, duration):
    """The points of the study, and {engine: reason} of those that fail."""
    path = os.path.join(context.work, scene + "-engines.csv")
    environment = dict(os.environ, PATH=context.programs + os.pathsep + os.environ["PATH"])
    ended = subprocess.run([context.kinetree, "accuracy", os.path.join(SCENES, scene + ".yaml"), "--peers", "--out", path, "--plot", "/dev/null",
                            "--duration", str(duration), "--budget", str(BUDGET)], env=environment, capture_output=True, text=True)
    if ended.returncode != 0:
        raise RuntimeError(f"{scene}: {ended.stderr.strip()}")
    reasons = dict(line.strip().split("fails: ") for line in ended.stdout.splitlines() if "fails: " in line)
    return read_points(path), {name.strip(): reason for name, reason in reasons.items()}


def compare(table, curves, reasons, scene, duration):
    own = {key: rows for key, rows in curves.items() if key[0] == ""}
    for engine in sorted({key[0] for key in curves if key[0]}):
        theirs = {key: rows for key, rows in curves.items() if key[0] == engine}
        if least(theirs) is None:
            table.add(scene, engine, "-", "-", "-", "-", "-", "-", next((reason for name, reason in reasons.items() if name.startswith(engine)), "fails"))
            continue
        for goal in GOALS:
            ours, other = cheapest(own, goal), cheapest(theirs, goal)
            if ours is None and other is None:
                continue
            ratio = math.inf if ours is None else 0.0 if other is None else ours[0] / other[0]
            table.add(scene, engine, goal, cell(ours, duration), cell(other, duration), least(theirs), observed=ratio, bound=1.0)


def add_to_page(page, curves, reasons, scene, duration):
    """The cheapest times at the goal of the page; the least error, or the reason, of an engine that does not reach it."""
    cells = []
    for engine in ["", *PAGE]:
        theirs = {key: rows for key, rows in curves.items() if key[0].split(" ")[0] == engine}
        best, error = cheapest(theirs, PAGE_GOAL), least(theirs)
        reason = next((reason for name, reason in reasons.items() if name.startswith(engine)), "fails") if engine else "-"
        cells.append(f"{best[1]}: {1e3 * best[0] / duration:.3g}" if best else reason if error is None else f"- ({error:.1g})")
    page.add(scene, *cells)


def tables(context):
    table = Table("engines-times", "Other engines: milliseconds of processor time for a simulated second",
                  ["scene", "engine", "goal", "Kinetree", "engine's", "least", "observed", "bound", "verdict"], TEXT, timed=True)
    if not context.programs or not any(name.startswith("kinetree-peer-") for name in os.listdir(context.programs)):
        table.text = ["The build has no program `kinetree-peer-NAME`: MuJoCo, ODE and SUNDIALS were not found."]
        return [table]
    if context.short: # times only
        return []
    page = Table("engines-page-times", "", ["scene", "Kinetree", *PAGE], timed=True)
    for scene, duration in PROBLEMS:
        try:
            points = measure(context, scene, duration)
            compare(table, *points, scene, duration)
            add_to_page(page, *points, scene, duration)
        except RuntimeError as failed:
            table.violations.append(str(failed))
    return [table, page]
