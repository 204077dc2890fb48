"""The exercises of the notes print the figures of include/pages/notes.md, each with its number, and no other; and the
commands of that page and of notes-applications.md run.

notes.py PROGRAM SOURCE-ROOT COMMAND-OR-EMPTY
"""
# SPDX-License-Identifier: Apache-2.0
import math
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "test")]
from claims import claim, finish, note

program, root = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
command = pathlib.Path(sys.argv[3]).resolve() if len(sys.argv) > 3 else None
page = "".join((root / "include/pages" / name).read_text() for name in ("notes.md", "notes-applications.md"))
run = subprocess.run([program], capture_output=True, text=True)
claim("the_program_ends_well", [run.stderr] if run.returncode else [])
printed = {line.split()[0]: float(line.split()[1]) for line in run.stdout.splitlines()}
shown = {}
for name, sign, text in re.findall(r"`([\w.]+)` ([=<>]) (-?[\d.]+(?:e-?\d+)?)", page):
    shown[name] = (sign, text)
wrong = []
for name, (sign, text) in shown.items():
    if name not in printed:
        wrong.append(f"{name}: not printed")
        continue
    value, bound = printed[name], float(text)
    if sign == "=":
        mantissa, _, exponent = text.partition("e")
        digits = len(mantissa.partition(".")[2])
        bound, value = 0.51 * 10.0 ** (int(exponent or 0) - digits), value - bound
    if sign == ">":
        bound, value = 1.0, bound / value
    note(f"{name}: {value:.3g}, bound {bound:.3g}")
    if not abs(value) <= bound or math.isnan(value):
        wrong.append(f"{name}: {printed[name]!r}, the page has {sign} {text}")
claim("every_figure_of_the_page_is_the_programs", wrong + ([] if len(shown) > 80 else [f"{len(shown)} figures"]))
claim("every_figure_of_the_program_is_on_the_page", [f"{name}: not on the page" for name in sorted(set(printed) - set(shown))])
if command:
    failed = []
    for line in re.findall(r"^kinetree (.*)$", page, flags=re.M):
        result = subprocess.run([command] + line.split(), cwd=root, capture_output=True, text=True)
        if result.returncode != 0:
            failed.append(line + ": " + result.stderr)
    claim("commands_of_the_page_run", failed)
finish()
