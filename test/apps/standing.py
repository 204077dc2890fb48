"""Forces of feet that slip nowhere: standing.py PROGRAM

A convex quadratic program has one solution, and a point is it if it fulfils the conditions that the program prints: the
equations (the accelerations come out as asked), the friction pyramids, no multiplier below zero, and a gradient that the
equations and the active sides bear.
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from embedded import below, claim, finish, note

ran = subprocess.run([sys.argv[1]], capture_output=True, text=True, timeout=600)
for line in ran.stdout.splitlines():
    note(line)
claim("program_succeeds", [] if ran.returncode == 0 and not ran.stderr else [f"{ran.returncode}: {ran.stderr}"])
NUMBER = r"(\S+)"
PATTERN = re.compile(rf"^(.*?) +effort +{NUMBER}, +(\d+) sides active, +(\d+) steps; missed: acceleration {NUMBER}, forces {NUMBER} N, "
                     rf"cones {NUMBER} N, gradient {NUMBER}; least multiplier {NUMBER}$", re.M)
solved = {found[0]: [float(x) for x in found[1:]] for found in PATTERN.findall(ran.stdout)}
claim("seven_commands_have_forces", [] if len(solved) == 7 else [f"{len(solved)}: {list(solved)}"])
# Measured 1.4e-13 of all: rounding of forces of 100 N.
claim("accelerations_come_out", below("m/s^2", max(s[3] for s in solved.values()), 1e-11))
claim("feet_bear_what_was_asked", below("N", max(s[4] for s in solved.values()), 1e-11))
claim("no_foot_slips", below("N outside of a pyramid", max(s[5] for s in solved.values()), 1e-9))
claim("the_gradient_vanishes", below("of the effort", max(s[6] for s in solved.values()), 1e-11))
claim("no_multiplier_is_negative", [f"{name}: {s[7]}" for name, s in solved.items() if s[7] < 0.0])
claim("friction_matters_in_two", [] if sum(s[1] > 0 for s in solved.values()) == 2 else ["it does in another number"])
claim("too_much_is_rejected", [] if "forward 9 m/s^2   no forces within friction" in ran.stdout else ["it is not"])
again = [s[0] for name, s in solved.items() if name.endswith("still")]
claim("a_foot_that_was_lifted_bears_as_before", [] if len(again) == 2 and again[0] == again[1] else [f"{again}"])
finish()
