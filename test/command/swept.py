"""Shared by the tests of sweeps: scenes, calls of the command, and counted checks.

A test says
    finish([part, ...])
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import os
import pathlib
import subprocess
import sys
import tempfile

command = os.path.realpath(sys.argv[1])
os.environ["LSAN_OPTIONS"] = f"print_suppressions=0:suppressions={pathlib.Path(__file__).resolve().with_name('suppressions.txt')}"  # of pictures
fewer = "--fewer" in sys.argv
passed = failed = 0


def check(what, observed, bound, ratio=None):
    """Prints observed, bound and ratio; a NaN fails."""
    global passed, failed
    good = observed <= bound
    ratio = observed / bound if bound else float(observed)
    print(f"{'ok  ' if good else 'FAIL'} {what}: observed {observed:.6g}, bound {bound:.6g}, ratio {ratio:.3g}")
    passed, failed = passed + good, failed + (not good)


def same(what, observed, expected):
    check(f"{what} ({observed!r:.60}, expected {expected!r:.60})" if observed != expected else what, int(observed != expected), 0)


def run(*arguments, code=0):
    done = subprocess.run([command, "sweep", *arguments], capture_output=True, text=True, check=False)
    if done.returncode != code:
        print(done.stderr)
    same(f"exit code of {' '.join(arguments)[:70]}", done.returncode, code)
    return done


def rows(text):
    return list(csv.DictReader(text.splitlines()))


FALL = """kinetree: 1
parameters: {g: 9.81, m: 2}
gravity: [0, 0, =-g]
bodies: [{name: stone, joint: {type: prismatic, axis: z}, mass: =m}]
simulate: {duration: 2}
output: {record: [position, energy]}
"""

BOUNCE = """kinetree: 1
parameters: {v: 3, h: 1, g: 9.81}
gravity: [0, 0, =-g]
bodies: [{name: stone, joint: {type: prismatic, axis: z, position: =h, velocity: =v}, mass: 1}]
effects: [{name: air, type: joint_damper, joint: stone, damping: 0.1}]
events: [{name: apex, when: velocity.stone, direction: falling, then: record}]
simulate: {duration: 5, until: position.stone < 0}
output: {record: [position, velocity, energy], columns: {height: 2*position.stone}}
"""


def finish(parts):
    """Runs the parts in an empty folder, and ends the test."""
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        pathlib.Path("fall.yaml").write_text(FALL)
        pathlib.Path("bounce.yaml").write_text(BOUNCE)
        for part in parts:
            part()
    print(f"{passed} passed, {failed} failed")
    sys.exit(failed > 0)
