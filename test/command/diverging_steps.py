"""run warns at the end of a run whose fixed steps diverge, and does not warn of motions that grow by themselves. Lines of
a sweep report the same runs.

Arguments: the program, and optionally a seed and a number of scenes. Each scene has an auxiliary state, so that its
energy is not watched. Decays and oscillations just outside of the region of stability diverge. The oracle is the
method's polynomial of stability. Pendulums from the upright position, exponentials, flutter and late pulses grow, with
steps that resolve them.
"""
# SPDX-License-Identifier: Apache-2.0
import cmath
import csv
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish

program = sys.argv[1]
seed, count = (int(sys.argv[2]), int(sys.argv[3])) if len(sys.argv) > 3 else (41, 8)
random.seed(seed)
CODE = "diverging_steps"
unlike = []

# Coefficients of R(z): 1/k! up to the order, then those of the tables (dopri5: HNW II.5).
POLYNOMIAL = {"heun": [1, 1, 1 / 2], "rk4": [1, 1, 1 / 2, 1 / 6, 1 / 24],
              "dopri5": [1, 1, 1 / 2, 1 / 6, 1 / 24, 1 / 120, 1 / 600]}


def gain(method, z):
    return abs(sum(c * z**k for k, c in enumerate(POLYNOMIAL[method])))


def scene(method, step, steps, states, force):
    lines = "\n".join(f'  {name}: {{rate: "{rate}", initial: {first}}}' for name, rate, first in states)
    return f"""kinetree: 1
gravity: [0, 0, 0]
bodies:
  - {{name: mass, joint: {{type: prismatic, axis: x, position: 0.1, velocity: 0.2}}, mass: 1}}
states:
{lines}
effects:
  - {{type: expression, joint: mass, force: "{force}"}}
simulate: {{duration: {step * steps!r}, integrator: {method}, step: {step!r}}}
"""


def run(text):
    with tempfile.TemporaryDirectory() as folder:
        open(folder + "/scene.yaml", "w").write(text)
        ran = subprocess.run([program, "run", folder + "/scene.yaml", "--out", "/dev/null",
                              "--summary", folder + "/s.json"], capture_output=True, text=True)
        root = json.load(open(folder + "/s.json")) if ran.returncode == 0 else {"warnings": []}
        swept = [subprocess.run([program, "sweep", folder + "/scene.yaml", "--vary", "bodies.mass.mass=1,1,1", "--out", "-",
                                 *way], capture_output=True, text=True).stdout for way in ([], ["--one-by-one"])]
    if ran.returncode == 0:
        lines = [line for text in swept for line in csv.DictReader(text.splitlines())]
        wanted = [warning["what"] for warning in root["warnings"] if warning["code"] == CODE] or [""]
        status = "integration" if wanted[0] else "done"
        if len(lines) != 6 or any(line["status"] != status or line["why"] != wanted[0] for line in lines):
            unlike.append((text, wanted, [(line["status"], line["why"]) for line in lines]))
    return ran, [warning for warning in root["warnings"] if warning["code"] == CODE]


def growing_rate(method, direction, steps):
    """z = h lambda along a direction, whose gain over half of the run is between 1e4 and 1e40."""
    most = 10 ** (40 / (steps / 2))
    least = 10 ** (4 / (steps / 2))
    wanted = math.exp(random.uniform(math.log(least), math.log(most)))
    size = next(r / 1000 for r in range(500, 60000) if gain(method, r / 1000 * direction) > wanted)
    return size * direction


wrong = []
for _ in range(count):
    method, steps, step = random.choice(list(POLYNOMIAL)), random.randint(60, 600), 10 ** random.uniform(-4, -1)
    z = growing_rate(method, cmath.exp(1j * math.pi * random.uniform(0.6, 1.0)), steps)
    a, w = z.real / step, z.imag / step
    states = [("p", f"({a!r})*p - ({w!r})*r", 0.3), ("r", f"({w!r})*p + ({a!r})*r", 0.1)]
    ran, found = run(scene(method, step, steps, states, "sin(t) - position.mass"))
    told = ran.stderr.count("the integration diverges")
    if ran.returncode != 0 or len(found) != 1 or told != 1 or not found[0]["value"] >= 100.0:
        wrong.append((method, steps, z, ran.returncode, len(found), told, ran.stderr[:200]))
claim("diverging_states_are_reported_once_with_their_growth", wrong)

wrong = []
for _ in range(count):
    method, steps = random.choice(list(POLYNOMIAL)), random.randint(100, 1000)
    step = 1.0 / random.randint(20, 200)
    until = step * steps
    rate = random.uniform(5, 60) / until
    w = random.uniform(0.05, 0.3) / step
    late = random.uniform(0.6, 0.95) * until
    grows = random.choice([
        ([("x", f"{rate!r}*x", 1e-3)], "sin(t)"),
        ([("x", "sin(t)", 0)], f"exp({min(rate, 15 / until)!r}*t)"),
        ([("x", "-x", 1)], f"{rate * rate!r}*sin(position.mass)"),
        ([("x", f"{rate!r}*x - {w!r}*y", 1e-3), ("y", f"{w!r}*x + {rate!r}*y", 0)], "0"),
        ([("x", f"1e6*exp(-((t - {late!r})/{3 * step!r})^2) - x", 1e-3)], "x - position.mass"),
        ([("x", "x*x", 0.9 / until)], "x"),
    ])
    ran, found = run(scene(method, step, steps, *grows))
    if ran.returncode != 0 or found:
        wrong.append((method, step, steps, grows, ran.returncode, [one["what"] for one in found], ran.stderr[:200]))
claim("motions_that_grow_by_themselves_have_no_such_warning", wrong)
claim("lines_of_sweeps_report_the_same_runs", unlike)
finish()
