"""Compares a table of a run with a published table.

The first line of a published table names the columns of a run, with a minus in front if the source counts the quantity
the other way. The first column is the time. Columns of one kind make a quantity. With r the published and s the own
values of a quantity at the published times t_k, its error is

    e = max_k max_i |s_i(t_k) - r_i(t_k)| / max(max_k |r(t_k)|, floor)

so a component that is zero does not count relative to itself. A quaternion and its negative are the same rotation."""
# SPDX-License-Identifier: Apache-2.0
import csv
import math
import re

# pattern of a column, quantity
KINDS = [(r"marker\..*\.[xyz]", "position"), (r"marker\..*\.v[xyz]", "velocity"), (r"marker\..*\.a[xyz]", "acceleration"),
         (r"orientation\..*", "orientation"), (r"angular_velocity\..*", "angular velocity"),
         (r"angular_acceleration\..*", "angular acceleration"), (r"(reaction|bearing)\..*\.f[xyz]", "force"),
         (r"(reaction|bearing)\..*\.m[xyz]", "moment"), (r"position\..*", "coordinate"), (r"velocity\..*", "rate"),
         (r"acceleration\..*", "second rate"), (r"effect\..*", "effect")]
# A quantity whose largest published value is smaller is zero in the source: its error is absolute, in its SI unit.
FLOOR = 1e-6


def kind(column):
    return next((name for pattern, name in KINDS if re.fullmatch(pattern, column.lstrip("-"))), column.lstrip("-"))


def read(path):
    """Names and rows of a table; a cell that is not a number is NaN."""
    with open(path, newline="") as file:
        lines = csv.reader(file)
        names = next(lines)
        return names, [[number(cell) for cell in line] for line in lines]


def number(text):
    try:
        return float(text)
    except ValueError:
        return math.nan


def at_times(names, rows, columns, times):
    """The values of columns of a run at published times, which must be among its records."""
    position = {name.split(" ")[0]: k for k, name in enumerate(names)}
    missing = [c for c in columns if c.lstrip("-") not in position]
    if missing:
        raise ValueError(f"the run has no column {missing[0].lstrip('-')}")
    found, k = [], 0
    for t in times:
        near = 1e-9 * max(1.0, abs(t))
        while k < len(rows) and rows[k][0] < t - near:
            k += 1
        if k == len(rows) or not abs(rows[k][0] - t) <= near:
            raise ValueError(f"the run has no record at t = {t:g} s")
        found.append([-rows[k][position[c[1:]]] if c.startswith("-") else rows[k][position[c]] for c in columns])
    return found


def align(own, published):
    """The quaternion of the same rotation on the published side."""
    if sum(a * b for a, b in zip(own, published)) < 0.0:
        return [-a for a in own]
    return own


def errors(reference, run):
    """{quantity: (error, largest published value)} of a run; both are (names, rows)."""
    names, rows = reference
    times = [row[0] for row in rows]
    found = {}
    for name in dict.fromkeys(kind(column) for column in names[1:]):
        where = [k for k, column in enumerate(names) if k > 0 and kind(column) == name]
        own = at_times(*run, [names[k] for k in where], times)
        published = [[row[k] for k in where] for row in rows]
        if name == "orientation":
            own = [align(a, b) for a, b in zip(own, published)]
        largest = max(math.hypot(*row) for row in published)
        error = worst(abs(a - b) for x, y in zip(own, published) for a, b in zip(x, y))
        found[name] = (error / (largest if largest > FLOOR else 1.0), largest)
    return found


def worst(values):
    """The largest value; NaN if one of them is."""
    largest = 0.0
    for value in values:
        if math.isnan(value):
            return math.nan
        largest = max(largest, value)
    return largest
