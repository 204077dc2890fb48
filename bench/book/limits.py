"""Cost against the limit: instructions and arithmetic of one evaluation, next to the fewest operations that are known.

Valgrind's tool lackey counts; the difference of two runs belongs to the evaluations. The fewest operations are those of the
file that `kinetree export --c` writes for the same mechanism: it has no zeros, no loops over joints and no memory."""
# SPDX-License-Identifier: Apache-2.0
import os
import re
import shutil
import subprocess

from table import Table

SCENES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "apps", "scenes")
MORE = 10  # evaluations of the longer run beyond those of the shorter one
TEXT = [
    "One evaluation, for each body. *Instructions* and *arithmetic* (instructions of the vector unit) are counted by valgrind, whose",
    "processor has AVX2, or with SSE2 where valgrind does not know an instruction (*level*). *Least* is the number of products,",
    "sums and divisions of the generated C of the same mechanism: zeros, axes and constant products are folded there. For eight",
    "states in lanes, counts are for a state, and the least is that number over the states in a vector. The library reads the",
    "mechanism from memory instead. Per body it loads inertias,",
    "frames and the state of the parent, and stores results for the second and third sweep; loads, stores and addresses are most",
    "of its instructions. Its arithmetic exceeds the least because it treats axes and centres of mass as general vectors. In",
    "vectors of four numbers one instruction replaces up to four operations; in lanes it replaces one operation of each state. For",
    "loops no least number is known.",
    "Counts belong to a compiler and a processor; so the table is not among those with equal bytes."]


def chain(count, planar):
    """A chain as a scene, in space with general bodies, or in a plane."""
    lines = ["kinetree: 1", "gravity: [0, -9.81, 0]", "bodies:"]
    for i in range(count):
        axis = "z" if planar or i % 2 else "y"
        inertia = "[0.1, 0.1, 0.1]" if planar else "[0.1, 0.12, 0.14, 0.01, 0.02, 0.03]"
        parent = f", parent: link{i - 1}" if i else ""
        at = "[0, 0, 0]" if i == 0 else "[1, 0, 0]" if planar else "[0.9, 0.1, 0.2]"
        com = "[0.5, 0, 0]" if planar else "[0.4, 0.05, 0.1]"
        lines.append(f"  - {{name: link{i}{parent}, mass: 1, com: {com}, inertia: {inertia}, joint: {{type: revolute, axis: {axis}, at: {at}, position: 0.3, velocity: 0.2}}}}")
    return "\n".join(lines + ["simulate: {duration: 1, integrator: rk4, step: 0.01}"]) + "\n"


def classes(work):
    """(name, path of the scene, function, whether generated C is possible)."""
    for name, text in [("space", chain(32, False)), ("plane", chain(32, True))]:
        with open(os.path.join(work, f"chain-{name}.yaml"), "w") as file:
            file.write(text)
    return [("chain of 32, in space", os.path.join(work, "chain-space.yaml"), "forward", True),
            ("chain of 32, in a plane", os.path.join(work, "chain-plane.yaml"), "forward", True),
            ("chain of 32, in space: eight states in lanes", os.path.join(work, "chain-space.yaml"), "lanes", True),
            ("humanoid", os.path.join(SCENES, "humanoid.yaml"), "forward", True),
            ("arm of seven axes", os.path.join(SCENES, "arm7.yaml"), "forward", True),
            ("arm of seven axes: derivatives", os.path.join(SCENES, "arm7.yaml"), "derivatives", True),
            ("row of 40 windows", os.path.join(SCENES, "n-four-bar-40.yaml"), "forward", False),
            ("rope held at both ends", os.path.join(SCENES, "rope.yaml"), "forward", False)]


def count(program, scene, function, times, *level):
    """Instructions, instructions of the vector unit, and the line that the program prints."""
    ended = subprocess.run(["valgrind", "--tool=lackey", "--detailed-counts=yes", program, scene, function, str(times), *level], capture_output=True, text=True)
    if ended.returncode != 0:
        raise RuntimeError(f"{os.path.basename(scene)}: {ended.stderr.strip().splitlines()[-1]}")
    number = lambda pattern: int(re.search(pattern, ended.stderr).group(1).replace(",", ""))
    vector = sum(number(rf" {kind} +[\d,]+ +[\d,]+ +([\d,]+)") for kind in ("F64", "V128", "V256"))
    return number(r"guest instrs: +([\d,]+)"), vector, ended.stdout


def count_calls(program, scene, function):
    """The counts of one call and of MORE, and the level. Some versions of valgrind do not know all instructions of AVX2."""
    for level in ([], ["base"]):
        try:
            return [count(program, scene, function, times, *level) for times in (1, 1 + MORE)], "SSE2" if level else "AVX2"
        except RuntimeError:
            if level:
                raise


def least(context, scene, function):
    """Operations of the generated function."""
    out = os.path.join(context.work, "limit.c")
    name = {"forward": "forward", "lanes": "forward", "derivatives": "forward_derivatives"}[function]
    subprocess.run([context.kinetree, "export", "--c", scene, "--functions", name, "--out", out, "--quiet"], check=True, capture_output=True)
    with open(out) as file:
        found = re.findall(r"Operations: (\d+) products, (\d+) sums, (\d+) divisions", file.read())
    return sum(map(int, found[-1]))


def tables(context):
    table = Table("limits-times", "Cost against the limit, for each body",
                  ["class", "bodies", "level", "instructions", "arithmetic", "least", "arithmetic over least", "bytes"], TEXT, timed=True)
    program = context.programs and os.path.join(context.programs, "bench-book-limits")
    if context.short:
        return []
    if not program or not os.path.exists(program) or not shutil.which("valgrind"):
        table.text = ["The build has no `bench-book-limits`, or valgrind is not on this machine."]
        return [table]
    for name, scene, function, is_tree in classes(context.work):
        try:
            (few, many), level = count_calls(program, scene, function)
            bodies, size, states, width = map(int, few[2].split(","))
            instructions, vector = ((b - a) / MORE / bodies / states for a, b in zip(few[:2], many[:2]))
            fewest = least(context, scene, function) / bodies / width if is_tree else None
        except (RuntimeError, subprocess.CalledProcessError) as failed:
            table.violations.append(str(failed))
            continue
        table.add(name, bodies, level, f"{instructions:.0f}", f"{vector:.0f}", "-" if fewest is None else f"{fewest:.0f}",
                  "-" if fewest is None else f"{vector / fewest:.2f}", f"{size / bodies / states:.0f}")
    return [table]
