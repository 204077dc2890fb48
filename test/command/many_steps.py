"""run warns once, while it runs, if adaptive steps are so short that the rest of the run needs millions of them.

Arguments: the program. Random oscillators, dampers and functions of time whose rates have closed forms: the warning names the
cause with that rate, and the length of steps. Runs that take few steps have no such warning.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import math
import pathlib
import random
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish

program = sys.argv[1]


def scene(stiffness, damping, torque, until):
    return f"""kinetree: 1
gravity: [0, 0, 0]
bodies:
  - {{name: mass, joint: {{type: prismatic, axis: x, position: 0.01}}, mass: 2}}
effects:
  - {{type: joint_spring, joint: mass, stiffness: {stiffness}}}
  - {{type: joint_damper, joint: mass, damping: {damping}}}
  - {{type: expression, joint: mass, force: "{torque}"}}
simulate: {{duration: 5, integrator: dopri5, tolerance: 1e-8, until: "t - {until}"}}
output: {{interval: 0.01}}
"""


def run(text):
    with tempfile.TemporaryDirectory() as folder:
        open(folder + "/scene.yaml", "w").write(text)
        ran = subprocess.run([program, "run", folder + "/scene.yaml", "--out", "/dev/null", "--summary", folder + "/s.json"],
                             capture_output=True, text=True)
        root = json.load(open(folder + "/s.json")) if ran.returncode == 0 else {"warnings": []}
    found = [warning for warning in root["warnings"] if warning["code"] == "many_steps"]
    return ran, root, found


def judge(text, pattern, expected, tolerance):
    """What is wrong with the warning of a scene; `expected`: the number that the pattern finds."""
    ran, root, found = run(text)
    wrong = []
    if ran.returncode != 0 or len(found) != 1 or ran.stderr.count("the rest of the run needs some") != 1:
        return [(ran.returncode, len(found), ran.stderr[:300])]
    number = re.search(pattern, found[0]["what"])
    if number is None or not abs(float(number.group(1)) / expected - 1.0) < tolerance:
        wrong.append((found[0]["what"], expected))
    mean = root["end"]["time"] / root["cost"]["steps"] if "end" in root else root["time"] / root["cost"]["steps"]
    if not 0.2 < found[0]["value"] / mean < 5.0 or found[0]["unit"] != "s":
        wrong.append(("step", found[0]["value"], mean))
    return wrong


random.seed(41)
wrong = []
for _ in range(4):
    w = 10 ** random.uniform(5.5, 6.5)
    wrong += judge(scene(2 * w * w, 0, "0", 2e4 / w), r"undamped oscillation of ([-+.e0-9]+) Hz \(mass\)", w / (2 * math.pi), 1e-3)
claim("oscillations_are_named_with_their_frequency", wrong)

wrong = []
for _ in range(4):
    d = 10 ** random.uniform(6.5, 7.5)
    wrong += judge(scene(0, 2 * d, "100", 5e4 / d), r"is a decay of ([-+.e0-9]+) /s", d, 1e-3)
claim("decays_are_named_with_their_rate", wrong)

wrong = []
for _ in range(2):
    w = 10 ** random.uniform(6, 6.5)
    wrong += judge(scene(1, 0, f"sin({w}*t)", 2e4 / w), r"change their shape every ([-+.e0-9]+) s", 0.5 * math.pi / w, 0.2)
claim("functions_of_time_are_named_with_their_pieces", wrong)

ran, root, found = run(scene(100, 1, "sin(3*t)", 5.5))
claim("usual_runs_have_no_such_warning", found + ([] if ran.returncode == 0 else [ran.stderr]))
finish()
