"""peers COMMAND: `kinetree accuracy --peers` with engines that the test makes: one of closed form, and ones that fail."""
# SPDX-License-Identifier: Apache-2.0
import csv
import math
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish

COMMAND = str(pathlib.Path(sys.argv[1]).resolve())
ERROR = 1e-4  # rad, that the engine of closed form makes at its coarsest step, and half of it at each half
SPIN, RISE, GRAVITY = 3.0, 2.0, 9.81
SCENE = f"""kinetree: 1
name: wheel and stone
gravity: [0, 0, -{GRAVITY}]
bodies:
  - {{name: wheel, mass: 2, inertia: [1, 1, 2], joint: {{type: revolute, axis: z, velocity: {SPIN}}}}}
  - {{name: stone, mass: 1, inertia: [1, 1, 1], joint: {{type: prismatic, axis: z, at: [1, 0, 0], velocity: {RISE}}}}}
simulate: {{duration: 2.5, step: 0.01, integrator: rk4}}
"""
# The program of the engine; {body} is Python that sees the request.
PROGRAM = """#!{python}
import math, os, signal, sys
ERROR, SPIN, RISE, GRAVITY = {error}, {spin}, {rise}, {gravity}
if sys.argv[1:] == ["--methods"]:
    print({name!r})
    print("A {kind}")
    sys.exit(0)
method, setting, interval, records, mjcf, scene = sys.argv[1:7]
setting, interval, records = float(setting), float(interval), int(records)
assert open(mjcf).read().startswith("<mujoco") and open(scene).read().startswith("kinetree: 1")
def row(t, error):
    a = 0.5 * (SPIN * t + error)
    return [0.001, 7, t, 0, 0, 0, math.cos(a), 0, 0, math.sin(a), 1, 0, RISE * t - 0.5 * GRAVITY * t * t, 1, 0, 0, 0]
def table(error, rows=records + 1):
    print("cpu,evaluations,time," + ",".join(f"{{axis}}.{{body}}" for body in ("wheel", "stone") for axis in "xyzwijk"))
    for k in range(rows):
        print(",".join(repr(x) for x in row(k * interval, error if k == records // 2 else 0.0)))
{body}
"""
ENGINES = {
    "exact": ("step", "table(ERROR * setting / interval)"),
    "short": ("step", "table(0.0, 3)"),
    "mute": ("tolerance", "sys.exit(3)"),
    "vocal": ("step", "print('the wheel is too round', file=sys.stderr)\nsys.exit(1)"),
    "crash": ("step", "os.kill(os.getpid(), signal.SIGSEGV)"),
    "endless": ("step", "while True: pass"),
    "nameless": ("step", "print('cpu,evaluations,time')\nfor k in range(records + 1): print('1,1,1')"),
    "numberless": ("step", "table(float('nan'))"),
}
REASONS = {"short": "its table has 3 rows", "mute": "status 3 and printed no reason", "vocal": "the wheel is too round",
           "crash": "signal 11", "endless": "takes too long", "nameless": "no body 'wheel'", "numberless": "no setting comes near"}


def make(folder):
    for name, (kind, body) in ENGINES.items():
        path = folder / f"kinetree-peer-{name}"
        path.write_text(PROGRAM.format(python=sys.executable, error=ERROR, spin=SPIN, rise=RISE, gravity=GRAVITY,
                                       name=f"{name.capitalize()} 1.0", kind=kind, body=body))
        path.chmod(0o755)
    (folder / "scene.yaml").write_text(SCENE)


def study(folder, path, *more):
    environment = dict(os.environ, PATH=path, TMPDIR=str(folder))
    return subprocess.run([COMMAND, "accuracy", "scene.yaml", "--peers", "--integrators", "rk4", "--steps", "0.01",
                           "--plot", "/dev/null", "--goal", "1e-3,3e-5", "--budget", "2", *more],
                          cwd=folder, env=environment, capture_output=True, text=True)


def points(folder, engine):
    with open(folder / "out.csv", newline="") as file:
        return [row for row in csv.DictReader(file) if row["variant"] == f"{engine.capitalize()} 1.0"]


def check_exact(folder, ran):
    """Errors of the engine of closed form are those that it makes; its steps halve."""
    problems = []
    found = points(folder, "exact")
    for k, row in enumerate(found):
        known, observed = ERROR * 0.5**k, float(row["error.position"])
        if not abs(observed - known) <= 1e-9:
            problems.append(f"point {k}: error {observed:g}, expected {known:g} within 1e-9")
        if row["kind"] != "step" or float(row["cpu"]) != 0.001 or row["evaluations"] != "7" or row["status"] not in ("ok", "below the reference"):
            problems.append(f"point {k}: {row}")
    if len(found) < 4:
        problems.append(f"{len(found)} points, at least 4 expected")
    line = next((line for line in ran.stdout.splitlines() if "Exact 1.0 A" in line), "")
    if f"{2.5 / 200 / 4:.2g}" not in line or "least" not in line:
        problems.append(f"the table has '{line}'")
    claim("errors_of_a_closed_form_are_found", problems)


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        make(folder)
        ran = study(folder, name, "--out", "out.csv")
        if ran.returncode != 0:
            claim("the_study_ends_well", [f"status {ran.returncode}: {ran.stderr}"])
            finish()
        check_exact(folder, ran)
        for engine, reason in REASONS.items():
            line = next((line for line in ran.stdout.splitlines() if f"{engine.capitalize()} 1.0" in line), "no line")
            claim(f"{engine}_is_a_failure_with_its_reason", [] if "fails: " in line and reason in line else [line])
            usable = [row for row in points(folder, engine) if row["status"] == "ok"]
            claim(f"{engine}_has_no_usable_point", [str(usable)] if usable else [])
        left = [entry.name for entry in folder.iterdir() if entry.name.startswith("kinetree-") and not entry.name.startswith("kinetree-peer-")]
        claim("no_file_is_left", left)
        none = study(folder, str(folder / "nowhere"))
        claim("without_engines_the_remedy_is_named", [] if none.returncode == 1 and "bench/run engines" in none.stderr else [str(none)])
        both = study(folder, name, "--vary", "gravity[2]=1,2")
        claim("one_study_at_a_time", [] if both.returncode == 1 and "--vary" in both.stderr else [str(both)])
    finish()


if __name__ == "__main__":
    main()
