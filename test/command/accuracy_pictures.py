"""accuracy_pictures COMMAND SOURCES: the work-precision diagrams of the pages are redrawn, and have the same structure.

Times differ from machine to machine, and the best method of a family may differ with them. Compared are: the size, the
words of title and axes, the slopes, rings and the legend. Each curve of the legend is a method with its order, and the
curves and those that are left out are all methods."""
# SPDX-License-Identifier: Apache-2.0
import os
import re
import subprocess
import sys
import tempfile

COMMAND, SOURCES = sys.argv[1], sys.argv[2]
PICTURES = os.path.join(SOURCES, "apps", "pictures")
PAGE = os.path.join(SOURCES, "include", "pages", "method-measurements.md")
# A few settings and a part of a long motion suffice for the structure.
QUICK = ["--steps", "1e-4,5e-5", "--tolerances", "1e-3,1e-5,1e-7", "--budget", "20", "--quiet", "--out", "/dev/null"]
COARSE = ["--steps", "2e-3", "--tolerances", "1e-3,1e-5", "--budget", "20", "--quiet", "--out", "/dev/null"]
PART = {"flyball-governor": ["--duration", "1"]}
# Methods of scenes of which the picture has chosen methods.
CHOSEN = {"bouncing-ball": ["rkc2", "rk4", "dopri5", "radau5", "steps"]}
FIXED = {"least for its error", "recommended", "no longer falls"}
failed = 0


def check(name, fine, shown=""):
    global failed
    print(f"       {name}: {'ok' if fine else 'FAILED'} {shown}")
    failed += not fine


def texts(svg):
    return [re.sub(r"&#(\d+);", lambda m: chr(int(m[1])), t) for t in re.findall(r"<text[^>]*>([^<]*)</text>", svg)]


def methods():
    """{name: order} of all methods."""
    lines = subprocess.run([COMMAND, "integrators"], capture_output=True, text=True, check=True).stdout.splitlines()
    found = [re.match(r"(\S+) +(\d+) +\d+ ", line) for line in lines[1:]]
    return {m[1]: int(m[2]) for m in found if m}


def structure(svg):
    words = texts(svg)
    curves = [re.fullmatch(r"(\S+), order (\d+)", w) for w in words]
    left = [re.fullmatch(r"and (\d+) more", w) for w in words]
    axes = [w for w in words if "simulated second" in w or w.startswith("Position error")]
    return {"size": re.search(r'viewBox="([^"]*)"', svg)[1], "title": words[0], "axes": axes,
            "fans": words.count("order"), "legend": sorted(FIXED & set(words)),
            "curves": {m[1]: int(m[2]) for m in curves if m}, "left out": sum(int(m[1]) for m in left if m),
            "rings": sum(w.startswith("for ") for w in words)}


known = methods()
with open(PAGE) as file:
    page = file.read()
shown = re.findall(r"apps/pictures/accuracy-([\w-]+)\.svg", page)
check("pictures on the page", {"andrews", "bouncing-ball", "flyball-governor"} <= set(shown), str(shown))
for scene in shown:
    with open(os.path.join(PICTURES, f"accuracy-{scene}.svg")) as file:
        there = structure(file.read())
    width, height = there["size"].split()[2:]
    chosen = CHOSEN.get(scene)
    expected = {m: p for m, p in {**known, "steps": 1}.items() if m in (chosen or known)}
    with tempfile.TemporaryDirectory() as work:
        path = os.path.join(work, "drawn.svg")
        subprocess.run([COMMAND, "accuracy", os.path.join(SOURCES, "apps", "scenes", scene + ".yaml"), *(QUICK if not chosen else COARSE), *PART.get(scene, []), "--size",
                        f"{width}x{height}", "--plot", path, *(["--integrators", ",".join(chosen)] if chosen else [])], check=True)
        with open(path) as file:
            drawn = structure(file.read())
    for key in ("size", "title", "axes", "fans"):
        check(f"{scene}: {key}", there[key] == drawn[key], f"{there[key]}, {drawn[key]}")
    for name, one in (("committed", there), ("drawn", drawn)):
        curves = one["curves"]
        check(f"{scene}, {name}: at most eight curves", 3 <= len(curves) <= 8, str(sorted(curves)))
        check(f"{scene}, {name}: methods with their orders", all(expected.get(m) == p for m, p in curves.items()))
        check(f"{scene}, {name}: all others are counted", len(curves) + one["left out"] == len(expected), str(one["left out"]))
        check(f"{scene}, {name}: time stepping is drawn with events", "steps" in curves or "steps" not in expected)
        check(f"{scene}, {name}: the front is drawn", "least for its error" in one["legend"])
    check(f"{scene}: recommended points", there["rings"] >= 2 and "recommended" in there["legend"], str(there["rings"]))
sys.exit(failed > 0)
