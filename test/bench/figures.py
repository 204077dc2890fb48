"""The figures that a benchmark writes are whole, and those that are no matter of speed are right.

figures.py PROGRAM OPTION...
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

TIMES = ["least_s", "low_s", "median_s", "high_s"]


def run(*command):
    return subprocess.run(command, capture_output=True, text=True)


def order_problems(row):
    times = [float(row[name]) for name in TIMES]
    if not times[0] > 0.0 or times != sorted(times):
        yield f"n = {row['n']} {row['call']}: {times}"
    if int(row["rounds"]) < 5 or int(row["repetitions"]) < 1:
        yield f"n = {row['n']} {row['call']}: {row['rounds']} rounds of {row['repetitions']}"


def memory_problems(rows):
    """Bytes of each further body, from one length of chain to the next: the same, but that arrays (some 30) are rounded up to
    64 bytes, names grow longer, and their table doubles."""
    sizes = sorted({int(row["n"]): int(row["model_bytes"]) + int(row["data_bytes"]) for row in rows}.items())
    slopes = [(b - a) / (n - m) for (m, a), (n, b) in zip(sizes, sizes[1:]) if n - m >= 100]
    note("bytes a further body: " + " ".join(f"{slope:.0f}" for slope in slopes))
    if len(slopes) < 3:
        return ["too few lengths"]
    return [] if max(slopes) < 1.05 * min(slopes) else ["memory is not linear"]


def main():
    program, *options = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        name = pathlib.Path(folder) / "figures.csv"
        measured = run(program, "--csv", str(name), *options)
        claim("results_are_to_be_trusted", [] if measured.returncode == 0 else
              [f"status {measured.returncode}", *measured.stdout.splitlines(), *measured.stderr.splitlines()])
        with open(name, encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
    note(f"{len(rows)} rows")
    claim("every_row_has_every_column",
          [str(row) for row in rows if None in row or None in row.values()] if rows else ["no rows"])
    claim("every_length_is_printed",
          [f"n = {n}" for n in sorted({row["n"] for row in rows}, key=int)
           if not any(line.split()[:1] == [n] for line in measured.stdout.splitlines())])
    claim("samples_are_ordered", [problem for row in rows for problem in order_problems(row)])
    if rows and "allocations" in rows[0]:
        claim("nothing_allocates_after_set_up",
              [f"n = {row['n']} {row['call']}: {row['allocations']}" for row in rows if row["allocations"] != "0"])
    if rows and "model_bytes" in rows[0]:
        claim("memory_is_linear", memory_problems(rows))

    claim("help_is_no_mistake", [] if run(program, "--help").returncode == 0 else ["--help fails"])
    claim("mistakes_are_told",
          [" ".join(words) for words in (["--max", "0"], ["--max", "many"], ["--seconds", "-1"], ["--isa", "v9"],
                                         ["--what"], ["10"], ["--max", "1", "--csv", "no/such/folder/figures.csv"])
           for said in [run(program, *words)] if said.returncode != 2 or not said.stderr])
    finish()


main()
