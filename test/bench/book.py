"""The validation book in its short form: it keeps its bounds, sees a wrong digit and a NaN, and writes the same bytes twice."""
# SPDX-License-Identifier: Apache-2.0
import csv
import filecmp
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

BOOK = pathlib.Path(sys.argv[1]).resolve()
KINETREE, REST = sys.argv[2], sys.argv[3:]
sys.path.insert(0, str(BOOK.parent))
import compare
import references
from table import VIOLATED, Table


def run(directory):
    return subprocess.run([sys.executable, str(BOOK), KINETREE, "--short", "-o", directory, *REST], capture_output=True, text=True)


def timed(name):
    return name.endswith("-times.csv") or name in ("times.md", "machine.txt")


def files_of(directory):
    return sorted(os.path.relpath(os.path.join(at, name), directory) for at, _, names in os.walk(directory) for name in names)


def index_problems():
    """Every table and scene of the book belongs to one entry, and every set to a source with a licence."""
    index, problems = references.load(), []
    named = {f"{g['name']}/{e['name']}.csv" for g in index["sets"] for e in g["entries"] if "table" not in e}
    found = {str(p.relative_to(BOOK.parent / "references")) for p in (BOOK.parent / "references").glob("*/*.csv")}
    problems += [f"{name} is in one of index and folder only" for name in sorted(named ^ found)]
    scenes = {os.path.realpath(references.scene_of(g, e)) for g in index["sets"] for e in g["entries"]}
    problems += [f"{p} has no entry" for p in (BOOK.parent / "scenes").glob("*/*.yaml")
                 if os.path.realpath(p) not in scenes and p.parent.name in {g["name"] for g in index["sets"]}]
    problems += [f"set {g['name']} has no source" for g in index["sets"] if not index["sources"][g["source"]]["licence"]]
    return problems


def wrong_digit_problems():
    """The published table itself as a run has no error; with one value off by a thousandth of the largest, that error."""
    names, rows = compare.read(BOOK.parent / "references" / "adams" / "universal-3.csv")
    signs = [-1.0 if name.startswith("-") else 1.0 for name in names]
    same = ([name.lstrip("-") for name in names], [[a * s for a, s in zip(row, signs)] for row in rows])
    problems = [f"{q}: error {e} of a table with itself" for q, (e, _) in compare.errors((names, rows), same).items() if e != 0.0]
    largest = compare.errors((names, rows), same)["force"][1]
    same[1][7][names.index("-reaction.rod.fy")] += 1e-3 * largest
    error = compare.errors((names, rows), same)["force"][0]
    note(f"a force off by 1e-3 of the largest: error {error:.6g}")
    if not abs(error - 1e-3) < 1e-12:
        problems.append(f"a force off by 1e-3 of the largest has the error {error}")
    same[1][3][names.index("-reaction.rod.fy")] = math.nan
    if not math.isnan(compare.errors((names, rows), same)["force"][0]):
        problems.append("a force that is not a number has an error that is one")
    return problems


def verdict_problems():
    table = Table("t", "", ["observed", "bound", "verdict"])
    for observed in (1.0, math.nan, 0.5):
        table.add(observed=observed, bound=0.75)
    verdicts = [row[-1] for row in table.rows]
    return [] if verdicts == [VIOLATED, VIOLATED, "kept"] and len(table.violations) == 2 else [f"verdicts {verdicts}"]


def page_problems(directory):
    """The tables between marks on the pages are those that the book has just written. Its short form has no times."""
    marks = re.compile(r"<!-- bench/run book: ([a-z-]+) -->\n(.*?)<!-- end -->", re.S)
    problems, count = [], 0
    for path in sorted((BOOK.parents[2] / "include" / "pages").glob("*.md")):
        for name, text in marks.findall(path.read_text()):
            if timed(name + ".csv") or not os.path.exists(os.path.join(directory, name + ".csv")):
                continue
            count += 1
            with open(os.path.join(directory, name + ".csv"), newline="") as file:
                rows = ["| " + " | ".join(row) + " |" for row in csv.reader(file)]
            rows.insert(1, "|" + "---|" * (len(rows[0].split(" | "))))
            if text.splitlines() != rows:
                problems.append(f"{path.name}: the table '{name}' is another one; bench/run book --short --pages writes it")
    return problems or ([] if count else ["no page has a table of the book"])


def main():
    claim("each_table_and_scene_has_an_entry_with_a_source", index_problems())
    claim("a_wrong_digit_and_a_nan_are_errors", wrong_digit_problems())
    claim("more_than_the_bound_and_nan_violate_it", verdict_problems())
    with tempfile.TemporaryDirectory() as one, tempfile.TemporaryDirectory() as two:
        first = run(one)
        note(first.stdout.strip().splitlines()[-1] if first.stdout.strip() else "no output")
        claim("the_short_book_keeps_its_bounds",
              [] if first.returncode == 0 else [f"exit status {first.returncode}", *first.stdout.splitlines()[-5:], *first.stderr.splitlines()[-5:]])
        second = run(two)
        names = files_of(one)
        differing = [n for n in names if n in files_of(two) and not timed(n) and not filecmp.cmp(os.path.join(one, n), os.path.join(two, n), shallow=False)]
        claim("two_books_have_the_same_bytes", differing + ([] if names == files_of(two) and "book.md" in names and second.returncode == 0
                                                           else ["the folders differ"]))
        claim("the_pages_have_the_tables_of_the_book", page_problems(one))
    finish()


main()
