"""The library's integrator against SUNDIALS on the same right-hand side: error against evaluations and processor time.

bench/book/solvers.c runs both. For each goal of the error, the cheapest setting counts, if all finer settings of the same
method keep the goal, too. A run that is more than a hundredth of the goal's decades lucky does not count thereby."""
# SPDX-License-Identifier: Apache-2.0
import math
import os
import re
import subprocess

import picture
from table import Table

SCENES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "apps", "scenes")
OWN_SCENES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "scenes")
# name, scene, duration (s), evaluations that a run may take
PROBLEMS = [("double pendulum", f"{SCENES}/double-pendulum.yaml", 3, 300000),
            ("chain of five rods", f"{SCENES}/rod-chain-5.yaml", 2, 300000),
            ("arm of seven axes", f"{SCENES}/arm7.yaml", 1, 300000),
            ("Lagrange's top", f"{SCENES}/lagrange-top.yaml", 2, 300000),
            ("Andrews' squeezer", f"{SCENES}/andrews.yaml", 0.03, 300000),
            ("Bricard's ring", f"{SCENES}/bricard.yaml", 10, 300000),
            ("slider-crank", f"{SCENES}/slider-crank-spring.yaml", 10, 300000),
            ("spatial four-bar", f"{OWN_SCENES}/modelica/four-bar-1.yaml", 5, 300000),
            ("car axis", f"{OWN_SCENES}/ivp/car-axis.yaml", 3, 300000),
            ("five-bar, stiff", f"{SCENES}/five-bar.yaml", 1, 100000),
            ("flyball governor, stiff", f"{SCENES}/flyball-governor.yaml", 1, 100000)]
SHORT = ["double pendulum", "Bricard's ring"]
PAGE_GOAL = 1e-6
GOALS = [1e-4, 1e-6, 1e-8, 1e-10]
TEXT = [
    "`bench/book/solvers.c` gives one right-hand side to the library's integrator and to CVODE, ARKODE and IDA. Each method",
    "runs at two tolerances a decade. The table has the fewest evaluations with which a position at the end keeps the goal, if",
    "all finer settings of the method keep it, too. Evaluations for Jacobians count. Both sides use dense Jacobians by",
    "differences. *Observed* is the ratio to ARKODE, whose methods take single steps, as those of the library do. CVODE and",
    "IDA are multistep methods of variable order. They need fewer evaluations where *over CVODE, IDA* exceeds 1, but more",
    "processor time for each: `times.md` has the ratio of times to all solvers of SUNDIALS, with the bound 1."]
# the methods of SUNDIALS: a step of a one-step method starts anew, and those of a multistep method use past steps
ONE_STEP, MULTISTEP = ("erk5", "erk8", "dirk5"), ("cvode-adams", "cvode-bdf", "ida")
OWN = ("dopri5", "tsit5", "dop853", "rkc4", "rodas5p", "radau5", "auto")


def measure(program, problem, short):
    """Lines of the program as dictionaries, and its first line; the short form has no times and no long runs."""
    limits = ["20000", "0"] if short else [str(problem[3]), "0.02"]
    ended = subprocess.run([program, problem[1], str(problem[2]), *limits], capture_output=True, text=True)
    if ended.returncode != 0:
        raise RuntimeError(f"{problem[0]}: {ended.stderr.strip()}")
    first, names, *lines = ended.stdout.splitlines()
    return first.lstrip("# "), [dict(zip(names.split(","), line.split(","))) for line in lines]


def cheapest(lines, methods, goal, key):
    """(cost, method, tolerance) of the cheapest setting of some methods that keeps the goal; None if there is none."""
    found = []
    for method in methods:
        for line in reversed([line for line in lines if line["method"] == method]):
            if not line["error"]:  # too slow at this tolerance
                continue
            if not float(line["error"]) <= goal:
                break
            found.append((float(line[key]), method, line["tolerance"]))
    return min(found) if found else None


def named(setting, unit):
    return "-" if setting is None else f"{setting[1]}: {unit * setting[0]:.4g}"


def ratio(own, other):
    return math.inf if own is None else 0.0 if other is None else own[0] / other[0]


def compare(table, lines, problem, key, unit):
    """A row for each goal; the bound is the cost of the one-step methods of SUNDIALS, for times that of all its methods."""
    for goal in GOALS:
        own, single, multiple = (cheapest(lines, methods, goal, key) for methods in (OWN, ONE_STEP, MULTISTEP))
        if own is None and single is None and multiple is None:
            continue
        bounded = ratio(own, single) if key == "evaluations" else max(ratio(own, single), ratio(own, multiple))
        table.add(problem, goal, named(own, unit), named(single, unit), named(multiple, unit),
                  ratio(own, multiple), observed=bounded, bound=1.0)


def add_to_page(page, lines, problem):
    """The cheapest times at the goal of the page."""
    page.add(problem, *(named(cheapest(lines, methods, PAGE_GOAL, "seconds"), 1e3) for methods in (OWN, ONE_STEP, MULTISTEP)))


def curves(lines):
    """{name: points} of the picture."""
    found = {}
    for line in lines:
        if line["error"] and float(line["error"]) > 0.0:
            found.setdefault(line["method"], []).append((float(line["evaluations"]), float(line["error"])))
    return found


def tables(context):
    columns = ["problem", "goal", "Kinetree", "ARKODE", "CVODE, IDA", "over CVODE, IDA", "observed", "bound", "verdict"]
    counts = Table("solvers", "SUNDIALS on the same equations: evaluations", columns, TEXT)
    times = Table("solvers-times", "SUNDIALS on the same equations: milliseconds of processor time", columns, timed=True)
    page = Table("solvers-page-times", "", ["problem", "Kinetree", "ARKODE", "CVODE, IDA"], timed=True)
    points = Table("solvers-points-times", "", ["problem", "family", "method", "tolerance", "error", "evaluations", "seconds", "fault"], timed=True)
    program = context.programs and os.path.join(context.programs, "bench-book-solvers")
    if not program or not os.path.exists(program):
        counts.text = ["The build has no `bench-book-solvers`: SUNDIALS (libsundials-dev) was not found."]
        return [counts]
    for problem in PROBLEMS:
        if context.short and problem[0] not in SHORT:
            continue
        try:
            first, lines = measure(program, problem, context.short)
        except RuntimeError as failed:
            counts.violations.append(str(failed))
            continue
        compare(counts, lines, problem[0], "evaluations", 1.0)
        if context.short:
            continue
        compare(times, lines, problem[0], "seconds", 1e3)
        add_to_page(page, lines, problem[0])
        for line in lines:
            points.add(problem[0], *line.values())
        picture.write(os.path.join(context.directory, "solvers-" + re.sub("[^a-z]+", "-", problem[0].lower()) + ".svg"), problem[0],
                      "evaluations of the right-hand side", "error at the end, rad or m", curves(lines))
    counts.text = TEXT + ["", f"Version: {first.split(',')[0]}, each solver with its defaults and the same tolerance, relative and absolute."]
    return [counts] if context.short else [counts, times, points, page]
