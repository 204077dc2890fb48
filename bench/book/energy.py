"""Energy at the step sizes of reinforcement learning: MuJoCo, semi-implicit Euler and the library for the same cost."""
# SPDX-License-Identifier: Apache-2.0
import math
import os
import subprocess

from table import Table

HERE = os.path.dirname(os.path.abspath(__file__))
# scene, step (s), where the step is used
PROBLEMS = [("acrobot", 0.2, "Gymnasium, Acrobot-v1"), ("acrobot", 0.05, "a quarter of it"),
            ("cart-pole", 0.02, "Gymnasium, CartPole-v1 and InvertedPendulum"),
            ("double-pendulum", 0.01, "Gymnasium, InvertedDoublePendulum"), ("double-pendulum", 0.002, "Gymnasium, Hopper and Walker2d")]
DURATION = 20.0
TEXT = [
    "Three mechanisms that cannot lose energy run for 20 s with the steps of Gymnasium (commit 3f0476a8c). *Error* is the",
    "largest change of the energy over the largest kinetic energy. `kinetree export --mjcf` writes the file for MuJoCo. Lines",
    "with `dopri5` and `dop853` have adaptive steps, with no more evaluations than `rk4`. Without such a line, no tolerance",
    "within these evaluations ends the run. The bound is the error of MuJoCo's RK4. `rk4` of the library takes the same",
    "steps, so it must have the same error. Semi-implicit Euler is the method of PyBullet and of MuJoCo's Euler."]
# columns of the page
PAGE = {"MuJoCo, Euler": ("MuJoCo", "Euler"), "MuJoCo, RK4": ("MuJoCo", "RK4"), "`rk4`": ("Kinetree", "rk4"),
        "`dopri5`, adaptive": ("Kinetree", "dopri5"), "`dop853`, adaptive": ("Kinetree", "dop853")}
# the same method in another order of operations, on a chaotic motion of 20 s
ROUNDING = 1e-3
# where adaptive steps lose, and why
LOSSES = {("acrobot", 0.2): "behind: with 20 evaluations a second, no error estimate holds"}


def measure(context, scene, step):
    path, mjcf = os.path.join(HERE, "scenes", "energy", scene + ".yaml"), os.path.join(context.work, scene + ".xml")
    subprocess.run([context.kinetree, "export", "--mjcf", path, "--quiet", "--out", mjcf], check=True, stderr=subprocess.DEVNULL)
    ended = subprocess.run([os.path.join(context.programs, "bench-book-energy"), path, mjcf, str(DURATION), str(step)],
                           capture_output=True, text=True)
    if ended.returncode != 0:
        raise RuntimeError(f"{scene} at {step:g} s: {ended.stderr.strip()}")
    return [line.split(",") for line in ended.stdout.splitlines()[1:]]


def tables(context):
    table = Table("energy", "Energy at the steps of reinforcement learning",
                  ["mechanism", "step, s", "used by", "engine", "method", "evaluations", "observed", "bound", "verdict"], TEXT)
    if not context.programs or not os.path.exists(os.path.join(context.programs, "bench-book-energy")):
        table.text = ["The build has no `bench-book-energy`."]
        return [table]
    page = Table("energy-page", "", ["mechanism, step", *PAGE])
    for scene, step, where in PROBLEMS:
        try:
            lines = measure(context, scene, step)
        except RuntimeError as failed:
            table.violations.append(str(failed))
            continue
        errors = {(line[0].split()[0], line[1]): float(line[3]) for line in lines if line[3]}
        page.add(f"{scene.replace('-', ' ')}, {step:g} s", *(errors.get(key) for key in PAGE.values()))
        known = next((float(line[3]) for line in lines if line[0].startswith("MuJoCo") and line[1] == "RK4"), None)
        for engine, method, evaluations, error in lines:
            if not error:
                table.add(scene, step, where, engine, method, "-", "-", "-", "-")
            elif engine == "Kinetree" and method not in ("semi-implicit Euler", "rk4") and (scene, step) in LOSSES:
                table.add(scene, step, where, engine, method, evaluations, float(error), "-", LOSSES[scene, step])
            elif engine == "Kinetree" and method != "semi-implicit Euler" and known is not None:
                table.add(scene, step, where, engine, method, evaluations, observed=float(error), bound=known * (1.0 + ROUNDING))
            else:
                table.add(scene, step, where, engine, method, evaluations, float(error), "-", "-")
                if not math.isfinite(float(error)):
                    table.violations.append(f"{scene} at {step:g} s, {engine} {method}: {error}")
    return [table, page]
