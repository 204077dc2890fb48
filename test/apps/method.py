"""method.py KINETREE SOURCES: the chapter on the method is right.

Its program, apps/notes/four_bar.py, has the states of `kinetree run` to 1e-12: two implementations of the equations that share no code. The
numbers of the pages are those that the program computes, in the digits of the pages.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import importlib.util
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, skip

KINETREE, SOURCES = sys.argv[1], pathlib.Path(sys.argv[2])
BOUND, DURATION, STEP = 1e-12, 0.3, 1e-4
JOINTS = ("crank", "coupler", "rocker")

try:
    import numpy as np
except ImportError:
    skip("the_program_of_the_chapter_has_the_states_of_run", "numpy is not on this machine")
    finish()

specification = importlib.util.spec_from_file_location("four_bar", SOURCES / "apps/notes/four_bar.py")
four_bar = importlib.util.module_from_spec(specification)
specification.loader.exec_module(four_bar)

PAGE = (SOURCES / "include/pages/method.md").read_text()
SCENE = re.search(r"^```yaml\n(.*?)^```", PAGE, flags=re.S | re.M)[1]


def check_states(folder):
    u, v = four_bar.start()
    scene = pathlib.Path(folder) / "four-bar.yaml"
    scene.write_text(SCENE)
    ended = subprocess.run([KINETREE, "run", scene, "--duration", str(DURATION), "--step", str(STEP), "--interval", "0.1", "--out", "out.csv", "--quiet"], cwd=folder, capture_output=True, text=True)
    if ended.returncode != 0:
        return claim("the_program_of_the_chapter_has_the_states_of_run", [ended.stderr])
    with open(pathlib.Path(folder) / "out.csv", newline="") as file:
        records = [[float(row[f"{kind}.{joint}"]) for kind in ("position", "velocity") for joint in JOINTS] for row in csv.DictReader(file)]
    worst, last = 0.0, round(DURATION / STEP)
    for k in range(last + 1):
        if k % round(0.1 / STEP) == 0:
            worst = max(worst, np.abs(np.concatenate([u, v]) - records[k // round(0.1 / STEP)]).max())
        if k < last:
            u, v = four_bar.step(u, v, STEP)
    note(f"states are apart by {worst:.1e}, bound {BOUND}")
    claim("the_program_of_the_chapter_has_the_states_of_run", [] if len(records) == 4 and worst <= BOUND else [f"apart by {worst:.1e}, {len(records)} records"])


def numbers_of_pages():
    """(page, numbers of the page with their signs, in the digits of the page)."""
    u, v = four_bar.start()
    _, jacobian, right = four_bar.loop(u, v)
    mass, force = four_bar.tree(u, v)
    q1, r1, q2 = four_bar.factor(jacobian)
    particular = q1 @ np.linalg.solve(r1.T, right)
    reduced, load = (q2.T @ mass @ q2)[0, 0], (q2.T @ (force - mass @ particular))[0]
    acceleration = four_bar.acceleration(u, v)
    multipliers = np.linalg.lstsq(jacobian.T, force - mass @ acceleration, rcond=None)[0]
    sign, pivoted = np.sign(q2[0, 0]), four_bar.factor(jacobian[::-1])[1]  # the second row is longer: P exchanges the rows
    yield "method-trees", [*u, *v[1:]], 6
    yield "method-dynamics", [mass[0, 0], mass[0, 1], *force], 6
    yield "method-loops", [*jacobian.ravel(), *right], 6
    yield "method-reduction", [pivoted[0, 0], pivoted[0, 1], pivoted[1, 1], *(sign * q2[:, 0]), sign * v @ q2[:, 0]], 6
    yield "method-projection", [*particular, reduced, sign * load, sign * load / reduced, *acceleration, *multipliers], 6


def gaps():
    """The gap after a step of 20 ms, that of 2,000 steps of 1 ms, and the errors of energy, without and with the projection."""
    u, v = four_bar.start()
    first, project = four_bar.energy(u, v), four_bar.project
    found = {}
    for name, rule in (("open", lambda u, v: (u, v)), ("closed", project)):
        four_bar.project = rule
        if name == "open":
            x, _ = four_bar.step(u, v, 0.02)
            found["one step"] = np.abs(four_bar.loop(x, v)[0]).max()
        x, w = u, v
        for _ in range(2000):
            x, w = four_bar.step(x, w, 1e-3)
        found[name], found[name + " energy"] = np.abs(four_bar.loop(x, w)[0]).max(), abs(four_bar.energy(x, w) - first)
    four_bar.project = project
    return found


def check_numbers():
    problems, count = [], 0
    for page, numbers, digits in numbers_of_pages():
        shown = set(re.findall(r"-?\d+(?:\.\d+)?", (SOURCES / f"include/pages/{page}.md").read_text()))
        wanted = [f"{number:.{digits}f}".rstrip("0").rstrip(".") for number in numbers]
        count += len(wanted)
        problems += [f"{page}.md lacks {number}" for number in wanted if not {number, number.ljust(number.find(".") + 1 + digits, "0")} & shown]
    found, text = gaps(), (SOURCES / "include/pages/method-drift.md").read_text()
    for value, shown in ((found["one step"], "4.05e-07"), (found["open"], "8.18e-09"), (found["closed energy"], "2.0e-09"), (found["open energy"], "2.0e-08")):
        count += 1
        problems += [] if f"{value:.{2 if len(shown) == 8 else 1}e}" == shown and shown in text else [f"method-drift.md: {shown}, computed {value:.2e}"]
    problems += [] if found["closed"] < 1e-14 else [f"the projected loop is open by {found['closed']:.1e}"]
    note(f"{count} numbers; projected gap {found['closed']:.1e} m")
    claim("numbers_of_the_chapter_are_computed", problems)


with tempfile.TemporaryDirectory() as folder:
    check_states(folder)
    check_numbers()
finish()
