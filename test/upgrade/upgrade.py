"""upgrade.py KINETREE INCLUDE LIBRARIES PROGRAM.c... [--keep RELEASE]: scenes and programs of earlier releases still run.

Each folder beside this script has the name of a release, and holds what a user of that release had: scenes, robots, programs in C, and
the results of that release. A scene keeps its meaning: the last record of a run agrees with the result of the release. A program keeps
compiling and prints the same numbers. Results may differ by the tolerance of the run, since a release may choose other steps.

--keep RELEASE writes the results of the scenes and programs of that folder with the present version. Do this once, at the release.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

HERE = pathlib.Path(__file__).resolve().parent
KINETREE, INCLUDE, LIBRARIES = map(os.path.abspath, sys.argv[1:4])
KEPT = sys.argv[-1] if sys.argv[-2] == "--keep" else None
PROGRAMS = [pathlib.Path(word).resolve() for word in sys.argv[4:] if word.endswith(".c")]
SCENES = (".yaml", ".urdf", ".xml", ".sdf")
BOUND = 1e-6 # of the largest value of a kind, with steps of 1e-10


def last_record(scene):
    """The names of the columns and the last record of a run."""
    ran = subprocess.run([KINETREE, "run", scene, "--tolerance", "1e-10", "--quiet", "--out", "-"] + ["--duration", "1.5"],
                         capture_output=True, text=True)
    if ran.returncode != 0:
        return {"fault": ran.stderr[-400:]}
    lines = ran.stdout.strip().split("\n")
    return dict(zip(lines[0].split(","), map(float, lines[-1].split(","))))


def difference(now, then):
    """The largest difference of a column, over the largest value of a kind (position, velocity, ...)."""
    if set(then) - set(now):
        return math.nan, f"no {sorted(set(then) - set(now))[:3]}: {now.get('fault', '')}"
    sizes = {}
    then = {name: value for name, value in then.items() if not name.startswith("constraint.")} # rounding
    for name, value in then.items():
        kind = name.split(".")[0]
        sizes[kind] = max(sizes.get(kind, 1e-12), abs(value))
    worst = max(then, key=lambda name: abs(now[name] - then[name]) / sizes[name.split(".")[0]])
    return abs(now[worst] - then[worst]) / sizes[worst.split(".")[0]], worst


def printed(folder, source):
    """What a program in C prints."""
    program = pathlib.Path(folder) / source.stem
    made = subprocess.run([os.environ.get("CC", "cc"), source, "-I", INCLUDE, f"-L{LIBRARIES}", f"-Wl,-rpath,{LIBRARIES}", "-lkinetree-scene", "-lkinetree", "-lm", "-o", program],
                          capture_output=True, text=True)
    if made.returncode != 0:
        return made.stderr[-400:]
    return subprocess.run([program], capture_output=True, text=True, cwd=source.parent).stdout


def agree(now, then):
    """Equal words, and equal numbers up to their last printed digit."""
    number = r"-?\d+\.\d+(?:e[-+]\d+)?"
    if re.sub(number, "#", now) != re.sub(number, "#", then):
        return False
    return all(abs(float(a) - float(b)) <= 2 * 10.0 ** -len(b.split("e")[0].split(".")[1]) * 10.0 ** float((b.split("e") + ["0"])[1])
               for a, b in zip(re.findall(number, now), re.findall(number, then)))


def check(release, folder):
    scenes = sorted(path for path in release.iterdir() if path.suffix in SCENES)
    programs = [path for path in PROGRAMS if path.parent == release]
    results = release / "results.json"
    now = {path.name: last_record(path) if path in scenes else printed(folder, path) for path in scenes + programs}
    if release.name == KEPT:
        results.write_text(json.dumps(now, indent=1) + "\n")
    then = json.loads(results.read_text())
    far = {path.name: difference(now[path.name], then[path.name]) for path in scenes}
    name = max(far, key=lambda one: far[one][0] if far[one][0] == far[one][0] else math.inf)
    note(f"{release.name}: {len(scenes)} scenes, largest difference {far[name][0]:.2e} in {far[name][1]} of {name}, bound {BOUND:g}; {len(programs)} programs")
    claim(f"scenes_of_{release.name}_keep_their_meaning", [f"{one}: {value} {column}" for one, (value, column) in far.items() if not value <= BOUND])
    claim(f"programs_of_{release.name}_compile_and_print_their_numbers", [f"{one.name}: {now[one.name]}" for one in programs if not agree(now[one.name], then[one.name])])
    claim(f"nothing_of_{release.name}_is_lost", sorted(set(then) ^ set(now)) + [one.name for one in release.glob("*.c") if one not in programs] + ([] if len(scenes) >= 10 and len(programs) >= 2 else ["too few"]))


if shutil.which(os.environ.get("CC", "cc")) is None:
    sys.exit(77)
with tempfile.TemporaryDirectory() as temporary:
    for one in sorted(path for path in HERE.iterdir() if path.is_dir() and path.name[0].isdigit()):
        check(one, temporary)
finish()
