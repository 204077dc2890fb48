"""swing_up PROGRAM: iLQR with exact derivatives of steps reaches its goals, and the adjoint gradient vanishes there."""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

NUMBER = r"([0-9.e+-]+)"

run = subprocess.run([sys.argv[1]], capture_output=True, text=True, timeout=600)
note(run.stdout.strip().replace("\n", "\n       "))
claim("program_ends_well", [] if run.returncode == 0 and not run.stderr else [f"status {run.returncode}: {run.stderr}"])
found = re.findall(rf"^(.+): cost {NUMBER} -> {NUMBER} in (\d+) iterations, gradient {NUMBER}, "
                   rf"distance from the goal {NUMBER}$", run.stdout, flags=re.M)
claim("both_mechanisms_are_there", [] if [line[0] for line in found] == ["cart-pole", "leg"] else [run.stdout])
# As measured: 2.8 and 1.5 from 4,900 and 57,500; distances 0.007 and 0.011, of which rk4's steps are a part; gradients
# 2e-7 and 1e-4 of that of the largest input's effort.
claim("costs_fall_a_thousandfold", [line for line in found if not float(line[2]) < 1e-3 * float(line[1])])
claim("the_adjoint_gradient_vanishes", [line for line in found if not float(line[4]) < 1e-3])
claim("another_method_reaches_the_goal", [line for line in found if not float(line[5]) < 0.03])
claim("iterations_end_by_themselves", [line for line in found if not int(line[3]) < 200])
finish()
