"""The figures of bench/realtime are whole; nothing is allocated after the first step, and the stack is shallow.

realtime.py PROGRAM OPTION...
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

SCENES = {"cart-pole": (2, 2, 0), "arm7": (9, 7, 0), "humanoid": (30, 53, 0), "leg with four-bar": (4, 2, 1), "leg with hard stops": (4, 2, 4)}
STACK = 65536  # bytes; a thread of a control program has a multiple


def run(*command):
    return subprocess.run(command, capture_output=True, text=True)


def main():
    program, *options = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        name = pathlib.Path(folder) / "figures.csv"
        measured = run(program, "--csv", str(name), *options)
        claim("results_are_to_be_trusted", [] if measured.returncode == 0 else
              [f"status {measured.returncode}", *measured.stdout.splitlines(), *measured.stderr.splitlines()])
        with open(name, encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
    for line in measured.stdout.splitlines():
        note(line)
    claim("every_row_has_every_column",
          [str(row) for row in rows if None in row or None in row.values() or "" in row.values()])
    seen = [(row["scene"], row["mode"]) for row in rows]
    claim("every_scene_is_measured_in_both_modes",
          [] if seen == [(scene, mode) for mode in ("free", "paced") for scene in SCENES] else [str(seen)])
    claim("scenes_are_what_they_say",
          [str(row) for row in rows
           if SCENES[row["scene"]] != tuple(int(row[key]) for key in ("bodies", "freedoms", "loops"))])
    claim("steps_are_as_many_as_asked_for",
          [str(row) for row in rows if row["steps"] != {"free": options[1], "paced": options[3]}[row["mode"]]])
    claim("times_are_ordered",
          [str(row) for row in rows
           if not 0.0 < float(row["median_s"]) <= float(row["p99_9_s"]) <= float(row["max_s"])])
    claim("nothing_allocates_after_the_first_step", [str(row) for row in rows if row["allocations"] != "0"])
    claim("stack_is_shallow",
          [f"{row['scene']}: {row['stack_bytes']}" for row in rows if not 0 < int(row["stack_bytes"]) < STACK])
    sensing = run(program, "--sensors", "--markdown", "--steps", options[1], "--paced", "0")
    table = [[cell.strip() for cell in line.strip("|\n").split("|")] for line in sensing.stdout.splitlines()]
    head, lines = (table[0], table[2:]) if len(table) > 2 else ([], [])
    claim("sensors_are_told_in_markdown",
          [] if sensing.returncode == 0 and [line[0] for line in lines] == list(SCENES) else [sensing.stdout, sensing.stderr])
    claim("sensors_allocate_nothing_either",
          [str(line) for line in lines if dict(zip(head, line)).get("allocations") != "0"])
    claim("help_is_no_mistake", [] if run(program, "--help").returncode == 0 else ["--help fails"])
    claim("mistakes_are_told",
          [" ".join(words) for words in (["--steps", "1"], ["--paced", "1"], ["--steps", "many"], ["--what"], ["10"],
                                         ["--steps", "2", "--csv", "no/such/folder/figures.csv"])
           for said in [run(program, *words)] if said.returncode != 2 or not said.stderr])
    finish()


main()
