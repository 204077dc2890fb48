"""What the test scripts share: each claim prints a line as a test does (runner.c), with what speaks against it."""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import subprocess
import sys

_failed = 0


def claim(name, problems):
    """States a claim; it holds where the list of problems is empty."""
    global _failed
    for problem in problems:
        print(f"       {problem}")
    print(f"[{'  FAILED  ' if problems else '       OK '}] {name}")
    if problems:
        _failed += 1


def skip(name, reason):
    """States that a claim cannot be tested on this machine, and why; test/count.py counts it."""
    print(f"[  SKIPPED ] {name}: {reason}")


def output_of(*command):
    """What a program prints of files that the build makes; where it cannot read them, its words end the test."""
    ended = subprocess.run(command, capture_output=True, text=True)
    if ended.returncode != 0:
        words = ended.stderr.strip().splitlines()[:3] or [f"it ends with {ended.returncode}"]
        claim(f"{pathlib.Path(command[0]).name}_reads_what_was_built", [*words, "build all of it first, by ninja in the build directory"])
        finish()
    return ended.stdout


def note(text):
    print(f"       {text}")


def finish():
    sys.exit(1 if _failed else 0)
