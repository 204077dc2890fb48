"""The source of FMUs is C: types and global names of the core and of the scene reader do not clash in one file.

names.py KINETREE-FMU.c COMPILER...

In seconds: the compiler reads the file and makes no code.
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

SOURCE, COMPILER = sys.argv[1], sys.argv[2:]
ended = subprocess.run([*COMPILER, "-std=c17", "-fno-math-errno", "-Wno-psabi", "-fsyntax-only", SOURCE], capture_output=True, text=True)
errors = [line for line in ended.stderr.splitlines() if "error" in line]
note(f"{len(errors)} errors, bound 0; exit status {ended.returncode}, bound 0")
claim("no_names_clash_in_the_source_of_fmus", errors[:5] or ([f"exit status {ended.returncode}"] if ended.returncode != 0 else []))
finish()
