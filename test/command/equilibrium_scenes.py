#!/usr/bin/env python3
"""What `kinetree equilibrium` answers is at rest: random scenes with limits, contacts, motors, springs and loops, judged by
`kinetree evaluate` alone.

    equilibrium_scenes.py [--seeds FIRST:END] [--jobs N] KINETREE

An answer is right if the scene that it writes, whose velocities are zero, has no acceleration, as `evaluate` says; a rejection
ends with status 4 and names what still accelerates. For each scene both are asked, the nearest equilibrium and where it settles.
Positions with a residual acceleration are told with their seed. How many have an answer at all is told, and must not become less.
"""
# SPDX-License-Identifier: Apache-2.0
import argparse
import concurrent.futures
import json
import math
import pathlib
import random
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note  # noqa: E402

# Accelerations at rest, relative to those that the scene starts with or 1: forces are rounded to some 1e-12, stiffnesses of 1e4
# times roundings of positions are as much, and four-bars near their dead points multiply both.
REST = 1e-9
FEWEST = {"--nearest": 0.75, "": 0.6}  # share of scenes with an answer: many have motors that nothing balances


def evaluate(program, scene):
    done = subprocess.run([program, "evaluate", "-"], input=scene, capture_output=True, text=True, timeout=100)
    if done.returncode != 0:
        return None, done.stderr.strip()
    return json.loads(done.stdout)["acceleration"], ""


def largest(x):
    if isinstance(x, dict):
        return max((largest(value) for value in x.values()), default=0.0)
    if isinstance(x, list):
        return max((largest(value) for value in x), default=0.0)
    return abs(x) if math.isfinite(x) else math.inf


def vector(r, size=1.0):
    return [r.uniform(-size, size) for _ in range(3)]


def body(r, name, parent, joint):
    inertia = r.uniform(0.02, 0.5)
    return {"name": name, "parent": parent, "joint": joint, "mass": r.uniform(0.2, 3), "com": vector(r, 0.6),
            "inertia": [inertia] * 3, "markers": {"tip": vector(r)}}  # fmt: skip


def joint_effects(r, name, slides):
    size = 30 if slides else 4
    position = r.uniform(-3, 3)
    return [
        {"type": "motor", "joint": name, ("force" if slides else "torque"): r.uniform(-size, size)},
        {"type": "joint_limit", "joint": name, r.choice(["lower", "upper"]): position, "stiffness": 10 ** r.uniform(0, 4),
         "damping": r.choice([0, 1])},
        {"type": "joint_spring", "joint": name, "stiffness": 10 ** r.uniform(-1, 2), "rest": position},
        {"type": "joint_friction", "joint": name, "coulomb": r.uniform(0, 2), "smoothing": 0.01},
        {"type": "servo", "joint": name, "target": position, "stiffness": 10 ** r.uniform(0, 3), "damping": 1, "limit": size},
    ]  # fmt: skip


def tree_effects(r, bodies):
    name = r.choice(bodies)["name"]
    return [
        {"type": "spring", "between": [{"body": "world", "at": vector(r, 2)}, f"{name}.tip"], "stiffness": 10 ** r.uniform(0, 3),
         "length": r.uniform(0, 1)},
        {"type": "contact", "point": f"{name}.tip", "plane": {"body": "world", "at": [0, r.uniform(-2, 0), 0]}, "axis": "y",
         "stiffness": 10 ** r.uniform(2, 4), "exponent": r.choice([1, 1.5]), "dissipation": 0.1},
        {"type": "force", "at": f"{name}.tip", "value": vector(r, 5)},
    ]  # fmt: skip


def random_tree(r):
    bodies, effects = [], []
    for k in range(r.randint(1, 4)):
        kind = r.choice(["revolute", "revolute", "revolute", "prismatic", "spherical"])
        joint = {"type": kind, "at": vector(r), "rotation": {"rpy": vector(r, 3)}}
        if kind != "spherical":
            joint |= {"axis": r.choice("xyz"), "position": r.uniform(-3, 3)}
        name = f"b{k}"
        bodies.append(body(r, name, r.choice(["world"] + [b["name"] for b in bodies]), joint))
        if kind != "spherical":
            chosen = joint_effects(r, name, kind == "prismatic")
            effects += r.sample(chosen, r.randint(0, 2)) if kind == "revolute" else r.sample(chosen[1:3], 1)
    return bodies, [], effects + r.sample(tree_effects(r, bodies), r.randint(0, 2))


def random_four_bar(r):
    crank, coupler, rocker = r.uniform(0.4, 0.8), r.uniform(1.5, 2), r.uniform(1.2, 1.6)
    bar = lambda name, parent, at, length, angle: {  # noqa: E731
        "name": name, "parent": parent, "joint": {"type": "revolute", "axis": "z", "at": at, "position": angle}, "mass": length,
        "shape": {"type": "rod", "to": [length, 0, 0]}, "markers": {"tip": [length, 0, 0]}}  # fmt: skip
    bodies = [bar("b0", "world", [0, 0, 0], crank, r.uniform(-3, 3)), bar("b1", "b0", [crank, 0, 0], coupler, 0.3),
              bar("b2", "world", [2, 0, 0], rocker, 1.5)]  # fmt: skip
    loops = [{"name": "pin", "type": "revolute", "between": ["b1.tip", "b2.tip"], "axis": "z"}]
    effects = r.sample(joint_effects(r, "b0", False), r.randint(0, 2))
    return bodies, loops, effects + r.sample(tree_effects(r, bodies), r.randint(0, 1))


def random_scene(seed):
    r = random.Random(seed)
    bodies, loops, effects = random_four_bar(r) if seed % 5 == 4 else random_tree(r)
    return {"kinetree": 1, "name": f"scene {seed}", "gravity": [0, -9.81, 0], "bodies": bodies, "loops": loops, "effects": effects}


def judge(program, seed):
    """For each way of asking: 'rest', 'none', or what is wrong."""
    scene = random_scene(seed)
    if not scene["effects"]:
        del scene["effects"]
    if not scene["loops"]:
        del scene["loops"]
    text = json.dumps(scene)
    start, problem = evaluate(program, text)
    if start is None:
        return {way: f"seed {seed}: {problem}" for way in FEWEST}
    found = {}
    for way in FEWEST:
        command = [program, "equilibrium", "-", "--scene", "-"] + ([way] if way else [])
        done = subprocess.run(command, input=text, capture_output=True, text=True, timeout=300)
        if done.returncode == 4 and "accelerat" in done.stderr:
            found[way] = "none"
            continue
        rest, problem = evaluate(program, done.stdout) if done.returncode == 0 else (None, done.stderr.strip())
        left = math.inf if rest is None else largest(rest) / max(1.0, largest(start))
        found[way] = "rest" if left <= REST else f"seed {seed} {way}: acceleration {left:.3g} is left {problem}"
    return found


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", default="0:500")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("program")
    arguments = parser.parse_args()
    first, end = (int(number) for number in arguments.seeds.split(":"))
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        results = list(pool.map(lambda seed: judge(arguments.program, seed), range(first, end)))
    for way, fewest in FEWEST.items():
        words = "nearest" if way else "settled"
        answers = [result[way] for result in results]
        wrong = [answer for answer in answers if answer not in ("rest", "none")]
        share = answers.count("rest") / len(answers)
        note(f"{words}: {answers.count('rest')} at rest, {answers.count('none')} rejected, {len(wrong)} wrong, of {len(answers)}")
        claim(f"{words}_positions_are_at_rest_or_rejected", wrong)
        claim(f"{words}_positions_are_found", [] if share >= fewest else [f"share {share:.3g}, lower bound {fewest}"])
    finish()


if __name__ == "__main__":
    main()
