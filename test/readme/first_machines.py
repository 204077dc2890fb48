"""first_machines.py KINETREE PAGE: the machines of the page for beginners, run as it says, against the calculations by hand that it shows.

Bounds: the tolerance of the runs over their time; where an oscillation dies away, what is left of it; where a record has to meet an extreme, what
lies between two records.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE, PAGE = sys.argv[1:]


def close(what, observed, expected, bound):
    """What speaks against `observed` being `expected`."""
    ratio = abs(observed - expected) / bound
    note(f"{what}: observed {observed:.12g}, expected {expected:.12g}, bound {bound:g}, ratio {ratio:.3g}")
    return [] if ratio <= 1.0 else [f"{what} is {observed}, not {expected}"]


def main():
    page = pathlib.Path(PAGE).read_text()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for body in re.findall(r"^```yaml\n(.*?)^```", page, flags=re.S | re.M):
            (folder / re.search(r"^# (\S+\.yaml)$", body, flags=re.M)[1]).write_text(body)
        faults, results, lines = [], {}, []
        for scene in sorted(folder.glob("*.yaml")):
            run = subprocess.run([KINETREE, "run", scene.name, "--quiet", "--summary", "summary.json"], cwd=folder, capture_output=True, text=True)
            faults += [f"{scene.name}: {run.stderr}"] if run.returncode or run.stderr else []
            results[scene.stem] = json.loads((folder / "summary.json").read_text())
            if scene.stem == "crank-press":
                lines = list(csv.DictReader((folder / "crank-press.csv").read_text().splitlines()))
        claim("five_machines_run_without_a_word", faults + ([] if len(results) == 5 else [f"{sorted(results)}"]))
        line = min(lines, key=lambda one: abs(float(one["time"]) - 0.1))
        claim("ram_of_the_press_is_where_the_triangle_says",
              close("ram, m", float(line["position.ram"]), 0.1 * math.cos(1) + math.sqrt(0.16 - 0.01 * math.sin(1) ** 2), 1e-9) +
              ([] if f"{float(line['position.ram']):.5f}" in page else ["the page has another number"]))
        swing = results["crane"]["columns"]["position.load"]["min"]
        claim("load_of_the_crane_swings_to_twice_the_deflection", close("swing, rad", swing, -2 * math.atan(1 / 9.81), 5e-6))
        strut = results["suspension"]
        claim("suspension_carries_the_weight",
              close("force, N", strut["columns"]["effect.strut.force"]["end"], -2943, 2943 * math.exp(-2.5 * 6) * 4) +
              close("deflection, m", strut["position"]["car"], -2943 / 20e3, 2943 / 20e3 * math.exp(-2.5 * 6) * 4))
        hoist = results["hoist"]
        claim("drum_of_the_hoist_gains_what_the_reduced_inertia_says",
              close("drum, rad/s", hoist["velocity"]["drum"], 10, 1e-9) + close("power, W", hoist["columns"]["effect.drive.power"]["end"], 500, 1e-7))
        wheel = results["grinder"]
        claim("wheel_stops_after_the_turns_that_its_energy_lasts",
              close("angle, rad", wheel["position"]["wheel"], 225, 1e-6) + close("heat, J", wheel["balance"]["dissipated"], 900, 1e-6))
    finish()


main()
