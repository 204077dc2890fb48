"""Ladders, nets and rows of loops that share bodies: how the cost grows with their number, and how well the loops close."""
# SPDX-License-Identifier: Apache-2.0
import math
import os
import re
import shutil
import subprocess

from table import Table

SHAPES = [("ladder", "two hanging chains of rods in space, with rungs of given length"),
          ("net", "three hanging chains in a plane, with rods between them"),
          ("grid", "three rows of parallelograms on each other"),
          ("chained", "a row of four-bars that share their cranks"),
          ("spherical", "a row of four-bars in space whose axes meet in a point"),
          ("bennett", "a row of Bennett's linkages")]
SIZES = [10, 100, 1000, 10000]
COUNTED = [100, 400]  # sizes whose instructions are counted
GROWTH = 1.1
CLOSURE = 1e-12
SECONDS = 0.2
TEXT = [
    "Loops that share bodies, as in the published benchmarks of closed chains. *Growth* is the exponent of the number of cells:",
    f"the instructions of an evaluation of the accelerations at {COUNTED[0]} and {COUNTED[1]} cells are counted by valgrind, at the lowest",
    "level of the instruction set. *Closure*",
    "is the largest gap of a loop over the length of the mechanism. It is taken after a projection from 1e-6 away, and after ten",
    "steps of `rk4` of 1 ms; the larger one counts. A mechanism of n cells is n metres long. Rows in space and grids have dependent",
    "equations: more equations than the rank."]
TIMES = ["The exponent of the time belongs to the size of the line and a tenth of it. Below 100 cells dense matrices are often faster, so",
         "the exponent from 10 to 100 is larger than 1. From 1000 cells on the data no longer fit into the caches of a processor."]


def run(context, *words, tool=()):
    program = os.path.join(context.programs, "bench-book-meshes")
    ended = subprocess.run([*tool, program, *map(str, words)], capture_output=True, text=True)
    if ended.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, words))}: {ended.stderr.strip() or ended.returncode}")
    return ended


def instructions(context, shape, cells):
    tool = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "--toggle-collect=kt_bars_accelerate"]
    return int(re.search(r"Collected : (\d+)", run(context, shape, cells, 0, tool=tool).stderr).group(1))


def plain(number):
    """Three digits without an exponent."""
    return f"{float(f'{number:.3g}'):.10g}"


def add_shape(context, shape, kept, times):
    gap, small = 0.0, None
    for cells in SIZES[:2] if context.short else SIZES:
        freedoms, equations, rank, projected, stepped, seconds = run(context, shape, cells, 0.01 if context.short else SECONDS).stdout.split(",")
        both = [float(projected), float(stepped)]
        gap = max(both) if all(map(math.isfinite, both)) else math.nan
        kept.add(shape, cells, int(freedoms), int(equations), int(rank), "closure", observed=gap, bound=CLOSURE)
        seconds = float(seconds)
        times.add(shape, cells, plain(1e6 * seconds), plain(1e6 * seconds / cells), None if small is None else f"{math.log10(seconds / small):.2f}")
        small = seconds


def tables(context):
    columns = ["mechanism", "cells", "coordinates", "equations", "rank", "what", "observed", "bound", "verdict"]
    kept = Table("meshes", "Ladders, nets and rows of loops", columns, TEXT)
    times = Table("meshes-times", "Ladders, nets and rows of loops: times", ["mechanism", "cells", "us", "us a cell", "exponent"], TIMES, timed=True)
    if not context.programs or not os.path.exists(os.path.join(context.programs, "bench-book-meshes")):
        kept.text = ["The build has no `bench-book-meshes`."]
        return [kept]
    counts = shutil.which("valgrind") and not context.short
    for shape, _ in SHAPES:
        try:
            add_shape(context, shape, kept, times)
            if counts:
                few, many = (instructions(context, shape, cells) for cells in COUNTED)
                growth = math.log(many / few) / math.log(COUNTED[1] / COUNTED[0])
                kept.add(shape, f"{COUNTED[0]} to {COUNTED[1]}", "-", "-", "-", "growth", observed=growth, bound=GROWTH)
        except (RuntimeError, subprocess.CalledProcessError) as failed:
            kept.violations.append(str(failed))
    kept.text += [f"- *{shape}*: {words}" for shape, words in SHAPES]
    if not counts:
        kept.text += ["", "The growth was not counted: " + ("the short form leaves it out." if context.short else "valgrind is not on this machine.")]
    return [kept, times]
