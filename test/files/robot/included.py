"""included KINETREE: random folders of files that include each other, with --allow and --search, against the rule written in Python.

A file may be included from the folder of the robot, from folders of --allow and of --search, links followed, any number of times, but not within
itself. MJCF looks for a name next to the robot, then next to the file that has it. SDF looks for NAME or model://NAME, a folder or a file, next to the robot,
then in folders of --search. It looks for package://NAME in folders of --search alone, for other://NAME nowhere, and for a model of a server where Gazebo keeps it, then there. What is
nowhere is left out, and a world of which nothing is left is an error. A light is not missed.
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import random
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from claims import claim, finish, note

KINETREE = os.path.abspath(sys.argv[1])
FOLDERS = ("robot", "robot/sub", "common", "allowed", "allowed/deep", "found/models")
BODY = '<body name="{}"><joint/><geom type="sphere" size="0.1" mass="1"/></body>'
LINK = "<link name='{}'><inertial><mass>1</mass></inertial></link>"


class Rejected(Exception):
    pass


def is_within(path, folders):
    real = os.path.realpath(path)
    return any(real.startswith(os.path.realpath(folder) + "/") for folder in folders)


# ---- MJCF --------------------------------------------------------------------------------------------------------------

def make_mjcf(rng, root):
    """Files by number, the first of which is the robot: path, and names that they include."""
    paths = ["robot/robot.xml"] + [f"{rng.choice(FOLDERS)}/p{i}.xml" for i in range(1, rng.randint(2, 6))]
    files = {}
    for i, path in enumerate(paths):
        below = paths[i + 1:] if rng.random() < 0.93 else paths
        names = []
        for target in rng.choices(below, k=rng.randint(0, 2)) if below else []:
            at = rng.choice([os.path.dirname(path), "robot"])
            names.append(f"{root}/{target}" if rng.random() < 0.1 else os.path.relpath(target, at))
        files[path] = names
    for path, names in files.items():
        os.makedirs(os.path.dirname(f"{root}/{path}"), exist_ok=True)
        text = "".join(f'<include file="{name}"/>' for name in names)
        kind = "mujoco" if path == paths[0] else "mujocoinclude"
        own = BODY.format("own") if path == paths[0] else '<frame>' + BODY.format("") + '</frame>'
        pathlib.Path(f"{root}/{path}").write_text(f"<{kind}><worldbody>{own.replace(chr(32) + 'name=' + chr(34) * 2, '')}</worldbody>{text}</{kind}>")
    return files


def count_mjcf(root, files, roots, path, within=()):
    """How many bodies a file brings along; Rejected where it, or one in it, may not be included."""
    if os.path.realpath(path) in within:
        raise Rejected
    total = 1
    for name in files[os.path.relpath(os.path.realpath(path), root)]:
        tries = [os.path.join(folder, name) for folder in (f"{root}/robot", os.path.dirname(path))]
        chosen = next((one for one in tries if os.path.exists(one)), tries[0])
        if not os.path.exists(chosen) or not is_within(chosen, roots):
            raise Rejected
        total += count_mjcf(root, files, roots, chosen, (*within, os.path.realpath(path)))
    return total


# ---- SDF ---------------------------------------------------------------------------------------------------------------

def make_sdf(rng, root):
    """A world that includes models, folders or single files, some of which lie next to it, on the search path, or where Gazebo keeps models of servers.

    Returns whether the world has a model of its own, and of each included name whether it is one of a light alone, and whether it is found with and
    without a search path.
    """
    names = [f"m{i}{rng.choice(('', '.sdf'))}" for i in range(rng.randint(1, 4))]
    included, includes = [], ""
    os.makedirs(f"{root}/robot", exist_ok=True)
    for name in names:
        place, is_file = rng.choice(["robot", "found/models", "common", "kept", None]), name.endswith(".sdf")
        is_served, is_light, version = place == "kept" or (not is_file and rng.random() < 0.2), rng.random() < 0.2, rng.choice((None, 1, 7, 8))
        newest = rng.choice((7, 12, 341))
        folder = {"kept": f"kept/fuel.gazebosim.org/the owner/models/{name}/{newest}"}.get(place, f"{place}/{name}")
        file = f"{root}/{folder}" if is_file and place != "kept" else f"{root}/{folder}/model.sdf"
        if place:
            os.makedirs(os.path.dirname(file), exist_ok=True)
            inner = "<light name='sun' type='point'/>" if is_light else f"<model name='{name[:2]}'>{LINK.format('l')}</model>"
            pathlib.Path(file).write_text(f"<sdf version='1.9'>{inner}</sdf>")
        if place == "kept" and rng.random() < 0.5:  # an older one has another body
            older = pathlib.Path(file).parents[1] / "2"
            older.mkdir()
            (older / "model.sdf").write_text(f"<sdf version='1.9'><model name='old'>{LINK.format('l')}{LINK.format('k')}</model></sdf>")
        prefix = rng.choice(("model://", "")) if place != "found/models" or rng.random() < 0.7 else "package://"
        name_there = name.upper() if place == "kept" else name
        is_other = prefix == "package://" and rng.random() < 0.3
        prefix = "other://" if is_other else prefix
        if is_served and rng.random() < 0.3:  # codes of letters
            name_there = f"%{ord(name_there[0]):02X}{name_there[1:]}"
        owner = "The%20Owner"
        if is_served and rng.random() < 0.2:  # a slash, or the end of a text, is no part of a name
            owner, is_other = rng.choice(("%2E%2fThe%20Owner", "The%20Owner%00")), True
        uri = f"https://fuel.gazebosim.org/1.0/{owner}/models/{name_there}{f'/{version}' if version else ''}" if is_served else prefix + name
        includes += f"<include><uri>{uri}</uri></include>"
        is_there = place == "kept" and version in (None, newest) or place == "robot" and not is_served
        is_there = is_there and not is_other
        included.append((is_light, is_there, is_there or (place == "found/models" and not is_other)))
    own = rng.random() < 0.3
    pathlib.Path(f"{root}/robot/robot.sdf").write_text(
        f"<sdf version='1.9'><world name='w'>{includes}{f'<model name=' + repr('own') + '>' + LINK.format('l') + '</model>' if own else ''}</world></sdf>")
    return own, included


# ---- the cases ---------------------------------------------------------------------------------------------------------

def run_import(root, file, rng):
    """Bodies of the scene, None where it is rejected, with the words; and which folders were named."""
    words, named = [], []
    for option, folder in (("--allow", "allowed"), ("--allow", "common"), ("--search", "found/models")):
        if rng.random() < 0.5:
            named.append((option, f"{root}/{folder}"))
    for option in ("--allow", "--search"):
        folders = ":".join(folder for name, folder in named if name == option)
        words += [option, folders] if folders else []
    clean = {key: value for key, value in os.environ.items() if key not in ("KINETREE_SEARCH", "ROS_PACKAGE_PATH", "GZ_SIM_RESOURCE_PATH", "GAZEBO_MODEL_PATH")}
    clean.pop("GZ_FUEL_CACHE_PATH", None)
    clean[rng.choice(("GZ_FUEL_CACHE_PATH", "IGN_FUEL_CACHE_PATH"))] = f"{root}/kept"
    run = subprocess.run([KINETREE, "import", f"{root}/{file}", *words], capture_output=True, text=True, env=clean)
    count = run.stdout.count("\n  - name: ") if run.returncode == 0 else None
    return count, run.stderr, [folder for _, folder in named], any(name == "--search" for name, _ in named)


def check(seed, folder):
    rng, root = random.Random(seed), os.path.realpath(f"{folder}/{seed}")
    for name in FOLDERS:
        os.makedirs(f"{root}/{name}")
    if seed % 2:
        files = make_mjcf(rng, root)
        found, words, named, _ = run_import(root, "robot/robot.xml", rng)
        try:
            wanted = count_mjcf(root, files, [f"{root}/robot", *named], f"{root}/robot/robot.xml")
        except Rejected:
            wanted = None
        kind = "circle" if "circle" in words else "alone" if "alone" in words else words[-80:]
    else:
        own, included = make_sdf(rng, root)
        found, words, named, searches = run_import(root, "robot/robot.sdf", rng)
        there = [(is_light, searched if searches else alone) for is_light, alone, searched in included]
        wanted, lost = own + sum(is_there and not is_light for is_light, is_there in there), sum(not is_there for _, is_there in there)
        if wanted > 0 and (lost > 0) != ("nor on the search path" in words):
            return f"seed {seed}: {lost} models are not there: {words}", wanted
        wanted = wanted if wanted > 0 or lost == 0 else None
        kind = "no body" if "no body is left" in words else words[-80:]
    if found == wanted and (found is not None or kind in ("circle", "alone", "no body")):
        return None, wanted
    return f"seed {seed}: {found} bodies, wanted {wanted}: {words[-300:]}", wanted


def main():
    with tempfile.TemporaryDirectory() as folder:
        results = [check(seed, folder) for seed in range(300)]
    rejected = sum(wanted is None for _, wanted in results)
    note(f"300 folders: {rejected} are to be rejected, others have {sum(wanted or 0 for _, wanted in results)} bodies")
    claim("files_are_included_by_the_rule", [fault for fault, _ in results if fault])
    claim("both_kinds_of_cases_occur", [] if 50 < rejected < 250 else [f"{rejected}"])
    finish()


main()
