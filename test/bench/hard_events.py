"""Motions with events hold their bounds next to other engines, and the table of contact-measurements.md has the errors that are measured.

hard_events.py PROGRAM SOURCE-ROOT OPTION...
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

# What is rounding differs with compilers; errors of other engines scatter with their versions' order of operations.
ROUNDING, ROUNDING_FACTOR, FACTOR, OTHERS_FACTOR = 1e-13, 10.0, 2.0, 10.0


def cells(line):
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def page_table(root):
    """The engines of the table's head, and its rows."""
    lines = (root / "include/pages/contact-measurements.md").read_text().splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("| | error | Kinetree |"))
    rows = []
    for line in lines[first + 2:]:
        if not line.startswith("|"):
            break
        rows.append(cells(line))
    return cells(lines[first])[2:], rows


def is_near(shown, found, factor):
    """What is rounding may be less by any factor; NaN is near to nothing."""
    least = 0.0 if shown < ROUNDING else shown / factor
    return least <= found <= shown * factor


def number(text):
    """What a cell has; None: words, which an engine that gives up has there."""
    try:
        return float(text)
    except ValueError:
        return None


def differences(name, shown, row, said):
    """`said`: what the program prints, with the versions of the engines that it has."""
    for engine, figure, column in zip(name, shown, ("kinetree", "mujoco", "ode")):
        own = column == "kinetree"
        if not own and engine not in said:
            continue
        found, figure = number(row[column]), float(figure)
        factor = OTHERS_FACTOR if not own else ROUNDING_FACTOR if figure < ROUNDING else FACTOR
        if found is None or not is_near(figure, found, factor):
            yield f"{row['case']}, {engine}: the page has {figure:g}, measured {row[column]}"


def main():
    program, root, *options = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        name = pathlib.Path(folder) / "hard.csv"
        run = subprocess.run([program, "--csv", str(name), *options], capture_output=True, text=True)
        note(run.stdout + run.stderr)
        claim("bounds_hold", [] if run.returncode == 0 else [f"status {run.returncode}"])
        with open(name, encoding="utf-8", newline="") as file:
            measured = [row for row in csv.DictReader(file) if not row["measured"].startswith("processor time")]
    engines, rows = page_table(pathlib.Path(root))
    claim("the_page_has_every_motion", [] if len(rows) == len(measured) > 0 else [f"{len(rows)} rows, {len(measured)} motions"])
    claim("the_page_has_their_errors",
          [each for row, found in zip(rows, measured) for each in differences(engines, row[2:], found, run.stdout)])
    finish()


main()
