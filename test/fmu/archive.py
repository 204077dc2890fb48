"""FMUs that `kinetree export --fmu` writes, and runs of their scenes, for the tests in this folder."""
# SPDX-License-Identifier: Apache-2.0
import math
import pathlib
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree
import zipfile

COMMAND, IMPORTER = (str(pathlib.Path(word).resolve()) for word in sys.argv[1:3])
SCENES, PAGE = (pathlib.Path(sys.argv[3]) / word for word in ("apps/scenes", "include/pages/fmu.md"))
STEP, STEPS = 0.01, 200  # s between values; the fixed steps of the scenes divide it
# Own steps of 1 ms, so that the end of each is a time at which a step of an FMU may end, too.
FIXED = ["double-pendulum", "four-bar", "arm7", "bouncing-ball", "lugre", "furuta-pendulum", "cart-pole"]
WORKS = ("energy.dissipated", "energy.supplied", "energy.balance")  # integrals: NaN in model exchange


def run(*words):
    ended = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    return ended.returncode, ended.stdout, ended.stderr


def rows(text):
    return [[float(number) for number in line.split(",")] for line in text.splitlines()
            if line and line[0] in "-0123456789n"]


def fixed_scene(name, folder):
    """A bundled scene with rk4 and steps of 1 ms."""
    text = re.sub(r"^simulate: \{.*\}$", "simulate:", (SCENES / f"{name}.yaml").read_text(), flags=re.M)
    text = re.sub(r"^  (integrator|tolerance|step|duration|max_step|interval):.*\n", "", text, flags=re.M)
    text = text.replace("simulate:\n", f"simulate:\n  integrator: rk4\n  step: 0.001\n  duration: {STEP * STEPS}\n")
    path = folder / f"{name}.yaml"
    path.write_text(text)
    return path


class Fmu:
    def __init__(self, scene, folder, *options):
        self.folder = folder / (scene.stem + "-fmu")
        archive = folder / f"{scene.stem}.fmu"
        self.status, _, self.errors = run(COMMAND, "export", "--fmu", scene, "--out", archive, *options)
        if self.status != 0:
            return
        shutil.rmtree(self.folder, ignore_errors=True)
        with zipfile.ZipFile(archive) as opened:
            opened.extractall(self.folder)
        self.archive, self.description = archive, self.folder / "modelDescription.xml"
        self.root = xml.etree.ElementTree.parse(self.description).getroot()
        self.variables = {v.get("name"): v for v in self.root.find("ModelVariables")}
        self.states = sum(v.get("derivative") is not None for v in self.variables.values())
        self.binary = next((self.folder / "binaries").glob("*/*.so"))

    def reference(self, name):
        return self.variables[name].get("valueReference")

    def outputs(self):
        return ["0"] + [v.get("valueReference") for v in self.variables.values() if v.get("causality") == "output"]

    def play(self, mode, *references, step=STEP, steps=STEPS):
        token = self.root.get("instantiationToken")
        return run(IMPORTER, self.binary, self.folder / "resources", token, mode, step, steps, self.states,
                   *(references or self.outputs()))


def records(scene, *options):
    _, text, errors = run(COMMAND, "run", scene, "--interval", STEP, "--quiet", "--out", "-", *options)
    return rows(text) or [[math.nan]], errors


def differences(ours, theirs):
    """The largest difference of two tables of numbers; NaN if their sizes differ."""
    if [len(row) for row in ours] != [len(row) for row in theirs]:
        return math.nan
    pairs = [(a, b) for r, s in zip(ours, theirs) for a, b in zip(r, s) if not (a != a and b != b)]
    found = [abs(a - b) for a, b in pairs]
    return math.nan if not found or any(x != x for x in found) else max(found)
