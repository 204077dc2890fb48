#!/usr/bin/env python3
"""Whether a legged robot in MJCF or URDF stands after a drop, here and in MuJoCo of today.

    drop.py KINETREE MODEL KP,KV [--pose NUMBERS] [--height M] [--drop M] [--duration S] [--timestep S]
            [--servo PART=KP,KV]... [--shift PART=RAD]... [--integrator METHOD]

Each joint with an actuator gets a servo that holds its position of the start; without actuators, each joint of one freedom. The start is that of
`--pose` (numbers of all joints but the root's, in the order of the file, separated by commas), or 0. `--servo` gives other gains to joints whose
name has a part, and `--shift` moves their targets. The integrator of the command is the usual one, or that of `--integrator`. The robot first stands for the duration, from the height of the file or that of `--height`. The drop starts 10 cm above the
height at which it rests. Contacts have elliptic cones and an impratio of 10, and MuJoCo's integrator is `implicitfast`. KT_MUJOCO_WASM names the
folder of npm's @mujoco/mujoco; without it, the robot is dropped here alone.
"""
# SPDX-License-Identifier: Apache-2.0
import argparse
import csv
import io
import math
import os
import pathlib
import subprocess
import xml.etree.ElementTree as tree

SCRIPT = pathlib.Path(__file__).with_name("mujoco_wasm.mjs")
NUMBERS = {"free": 7, "ball": 4}


def joints_of(root, body):
    """(name, numbers of its position) of each joint below a body, in MuJoCo's order."""
    for e in body:
        if e.tag in ("joint", "freejoint"):
            kind = "free" if e.tag == "freejoint" else e.get("type") or inherited(root, e)
            yield e.get("name"), NUMBERS.get(kind, 1)
        elif e.tag == "body":
            yield from joints_of(root, e)


def inherited(root, joint):
    """The type of a joint by its class."""
    for default in root.iter("default"):
        if default.get("class") == joint.get("class") and joint.get("class"):
            found = default.find("joint")
            return found.get("type") if found is not None else None
    return None


def model_of(arguments):
    """The model in MJCF. One in URDF is exported, with its collisions that are boxes in place of its other shapes."""
    if not arguments.model.endswith(".urdf"):
        return tree.parse(arguments.model).getroot()
    ran = subprocess.run([arguments.kinetree, "export", arguments.model, "--floating", "--mjcf", "--out", "-", "--quiet"], capture_output=True,
                         text=True, check=True)
    root = tree.fromstring(ran.stdout)
    bodies = {body.get("name"): body for body in root.iter("body")}
    for body in bodies.values():
        for geom in body.findall("geom"):
            body.remove(geom)
    for assets in root.findall("asset"):
        root.remove(assets)
    for link in tree.parse(arguments.model).getroot().findall("link"):
        for collision in link.findall("collision"):
            box, origin = collision.find("geometry/box"), collision.find("origin")
            if box is not None and link.get("name") in bodies:
                place = origin.get("xyz", "0 0 0") if origin is not None else "0 0 0"
                size = " ".join(str(0.5 * float(x)) for x in box.get("size").split())
                tree.SubElement(bodies[link.get("name")], "geom", type="box", size=size, pos=place, conaffinity="0")
    return root


def write_model(arguments, path, height):
    """The model with servos and a floor; its keyframe is the start, at a height, or at that of the file. Returns the height of its position zero."""
    root = model_of(arguments)
    world = root.find("worldbody")
    actuated = [e.get("joint") for part in root.findall("actuator") for e in part if e.get("joint")]
    for tag in ("actuator", "keyframe", "sensor"):
        for part in root.findall(tag):
            root.remove(part)
    option = root.find("option")
    option = option if option is not None else tree.SubElement(root, "option")
    option.attrib.update(cone="elliptic", impratio="10", integrator="implicitfast", solver="Newton", iterations="100")
    if arguments.timestep:
        option.set("timestep", arguments.timestep)
    if not any(e.get("type") == "plane" for e in world.iter("geom")):
        tree.SubElement(world, "geom", type="plane", size="0 0 1")
    base = next(e for e in world.findall("body") if next(joints_of(root, e), None) is not None)
    place = [float(x) for x in base.get("pos", "0 0 0").split()]
    joints = list(joints_of(root, world))
    actuated = actuated if any(actuated) else [name for name, count in joints if count == 1]
    is_free = joints[0][1] == 7  # else three slides and a ball
    reference = place if is_free else [float(e.get("ref", "0")) for e in base.findall("joint")[:3]]
    first, offset = (1, 0.0) if is_free else (4, place[2] - reference[2])
    place = list(reference)
    pose = [float(x) for x in arguments.pose.split(",")] if arguments.pose else []
    pose += [0.0] * (sum(count for _, count in joints[first:]) - len(pose))
    if height is not None:
        place[2] = height - offset
    at, start = 0, {}
    for name, count in joints[first:]:
        start[name] = pose[at]
        at += count
    shifts = [(part, float(shift)) for part, shift in (text.split("=") for text in arguments.shift)]
    servos = [("", arguments.gains)] + [text.split("=") for text in arguments.servo]
    actuator = tree.SubElement(root, "actuator")
    for name in actuated:
        kp, kv = [gains for part, gains in servos if part in name][-1].split(",")
        tree.SubElement(actuator, "position", joint=name, kp=kp, kv=kv, ctrllimited="false", forcelimited="false")
    tree.SubElement(tree.SubElement(root, "keyframe"), "key", name="k", qpos=" ".join(map(str, place + [1.0, 0.0, 0.0, 0.0] + pose)),
                    ctrl=" ".join(str(start[name] + sum(shift for part, shift in shifts if part in name)) for name in actuated))
    tree.ElementTree(root).write(path)
    return offset


def state_here(arguments, path, offset):
    """Height and upright direction's cosine of the root after the duration; None: the run stopped."""
    ran = subprocess.run([arguments.kinetree, "run", path, "--contacts", "--keyframe", "k", "--duration", arguments.duration, "--record", "position",
                          "--interval", arguments.duration, "--integrator", arguments.integrator, "--out", "-", "--quiet"], capture_output=True, text=True)
    rows = list(csv.reader(io.StringIO(ran.stdout)))
    if ran.returncode or len(rows) < 2:
        print(ran.stderr.strip()[-300:])
        return None
    last = [float(x) for x in rows[-1][1:8]]
    return last[2] + offset, upright(last[3:7])


def upright(q):
    return 1.0 - 2.0 * (q[1] ** 2 + q[2] ** 2)


def state_in_mujoco(arguments, path, offset):
    package = os.environ.get("KT_MUJOCO_WASM")
    if not package:
        return None
    ran = subprocess.run(["node", SCRIPT, package, f"rest={arguments.duration}", path], capture_output=True, text=True)
    words = ran.stdout.split()
    if len(words) < 10 or words[1] != "read":
        print(" ".join(words[1:40]))
        return None
    q = [float(x) for x in words[3:10]]
    return q[2] + offset, upright(q[3:7])


def verdict(state, height):
    if state is None:
        return "no result"
    stands = state[0] > 0.9 * height and state[1] > 0.95
    return f"{'stands' if stands else 'falls'}, height {state[0]:.5f} m, upright by {math.degrees(math.acos(max(-1.0, min(1.0, state[1])))):.3f} deg"


def main():
    parser = argparse.ArgumentParser()
    for name in ("kinetree", "model", "gains"):
        parser.add_argument(name)
    for name, default in (("--pose", ""), ("--drop", "0.1"), ("--height", ""), ("--duration", "10"), ("--timestep", ""), ("--integrator", "auto")):
        parser.add_argument(name, default=default)
    for name in ("--servo", "--shift"):
        parser.add_argument(name, action="append", default=[])
    arguments = parser.parse_args()
    path = pathlib.Path(arguments.model).resolve().parent / ".drop.xml"  # beside its meshes
    try:
        offset = write_model(arguments, path, float(arguments.height) if arguments.height else None)
        rest = state_here(arguments, path, offset)
        print(f"rest here: {verdict(rest, rest[0] if rest else 0.0)}")
        if rest:
            print(f"rest in MuJoCo: {verdict(state_in_mujoco(arguments, path, offset), rest[0])}")
            write_model(arguments, path, rest[0] + float(arguments.drop))
            print(f"drop here: {verdict(state_here(arguments, path, offset), rest[0])}")
            print(f"drop in MuJoCo: {verdict(state_in_mujoco(arguments, path, offset), rest[0])}")
    finally:
        if not os.environ.get("KT_KEEP"):
            path.unlink(missing_ok=True)


main()
