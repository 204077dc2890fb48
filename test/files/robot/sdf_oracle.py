#!/usr/bin/env python3
"""Models in SDF, as the command reads them, against another reading from the specification alone (sdf_reading.py).

    sdf_oracle.py KINETREE FILE.sdf...     more files by KT_SDF_FILES (of any origin, trees and loops)

Of each: masses, the number of degrees of freedom, the place of every link and the accelerations from rest, at the start and, of trees,
at random positions of the joints.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import math
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[2]), str(pathlib.Path(__file__).resolve().parent)]
from claims import claim, finish, note  # noqa: E402
from sdf_reading import Motion, Reading, apply, dot, turned  # noqa: E402

kinetree, files = sys.argv[1], sys.argv[2:] + os.environ.get("KT_SDF_FILES", "").split()
BOUND = 1e-11  # of the largest; measured: 2e-13, of matrices whose condition is 1e3
SCALAR = ("revolute", "prismatic", "screw")


def run(*words):
    return subprocess.run([kinetree, *words], capture_output=True, text=True, timeout=120)


def bodies_of(text):
    """Names, parents, types and names of joints of a scene as `import` writes it."""
    bodies, at = {}, None
    for line in text.split("\nloops:")[0].split("\neffects:")[0].splitlines():
        found = re.match(r"  - name: (\S+)", line)
        if found:
            at = bodies[found[1]] = {"parent": None, "type": "fixed", "joint": found[1]}
        found = re.match(r"    parent: (\S+)", line)
        if found:
            at["parent"] = found[1]
        found = re.match(r"      (type|name): (\S+)", line)
        if found and at is not None:
            at[{"type": "type", "name": "joint"}[found[1]]] = found[2]
    return bodies


def explain(reading, bodies):
    """What each body's joint is: (joint of SDF, number of its motion), or a link that is free."""
    links = {f.path(reading.root): f for f in reading.links}
    joints = {f.path(reading.root): f for f in reading.joints}

    def link_under(name):
        """The link that a body stands on, or that stands on it by joints of bodies that are none."""
        while name is not None and name not in links:
            name = bodies[name]["parent"]
        return links[name] if name is not None and not links[name].static else None

    def link_above(name):
        while name not in links:
            name = next(b for b in bodies if bodies[b]["parent"] == name)
        return links[name]

    meaning = {}
    for name, body in bodies.items():
        if body["type"] == "fixed":
            continue
        if body["type"] == "free":
            meaning[name] = links[name]
            continue
        ends = {link_under(body["parent"]), link_above(name)}
        fitting = [j for j in joints.values() if j.motions and {j.parent, j.child} == ends]
        assert len(fitting) == 1, f"{name}: {len(fitting)} joints"
        j = fitting[0]
        first = len(j.motions) == 2 and body["parent"] in bodies and body["parent"] not in links
        lower = len(j.motions) == 2 and name in links and not first
        meaning[name] = j, int(first or lower) if len(j.motions) == 2 else 0
    return meaning


def between(reading, bodies, meaning):
    """Of a joint of two axes, the body nearer to the world has the first, unless the joint carries its parent."""
    for j in reading.joints:
        own = [b for b, m in meaning.items() if isinstance(m, tuple) and m[0] is j]
        if len(own) == 2:
            low, high = own if depth(bodies, own[0]) < depth(bodies, own[1]) else own[::-1]
            meaning[low], meaning[high] = (j, 0), (j, 1)


def depth(bodies, name):
    return 0 if bodies[name]["parent"] is None else 1 + depth(bodies, bodies[name]["parent"])


def place(text, positions):
    """Writes positions into a scene, behind the types of joints."""
    out, name = [], None
    for line in text.splitlines():
        found = re.match(r"  - name: (\S+)", line)
        name = found[1] if found else name
        out.append(line)
        if re.match(r"      type: (revolute|prismatic|screw)", line) and name in positions:
            out.append(f"      position: {positions[name]!r}")
    return "\n".join(out) + "\n"


def compare(reading, bodies, meaning, positions, result):
    """The worst ratio to the bound, and what it is of."""
    q = {m: positions.get(b, 0.0) for b, m in meaning.items() if isinstance(m, tuple)}
    for m in list(q):
        if m[0].element.get("type") == "ball":
            q.pop(m)
    motion = Motion(reading, q, [m for m in meaning.values() if not isinstance(m, tuple)])
    worst = [(0.0, "nothing")]
    for f in reading.links:
        seen = result["pose"][f.path(reading.root)]["position"]
        scale = 1.0 + max(map(abs, motion.pose[f][1]))
        worst.append((max(abs(a - b) for a, b in zip(seen, motion.pose[f][1])) / (BOUND * scale), f"place of {f.name}"))
    a, index, n = motion.accelerations()
    seen = result["acceleration"]
    scale = max(map(abs, seen)) + 1.0
    for c, value in zip(result["coordinates"], seen):
        joint, part = re.fullmatch(r"([^\[]+)(?:\[(\d)\])?", c).groups()
        name = next(b for b in bodies if bodies[b]["joint"] == joint or b == joint)
        m = meaning[name]
        if not isinstance(m, tuple):
            i, r = index[m], motion.pose[m][0]
            lever = apply(r, [-x for x in m.com])
            alpha, centre = a[i:i + 3], a[i + 3:i + 6]
            linear = [centre[0] + alpha[1] * lever[2] - alpha[2] * lever[1], centre[1] + alpha[2] * lever[0] - alpha[0] * lever[2],
                      centre[2] + alpha[0] * lever[1] - alpha[1] * lever[0]]
            expected = (linear + apply(turned(r), alpha))[int(part)]
        elif m[0].element.get("type") == "ball":
            relative = [(a[index[m[0].child] + k] if m[0].child else 0.0) - (a[index[m[0].parent] + k] if m[0].parent else 0.0)
                        for k in range(3)]
            expected = apply(turned(motion.pose[m[0].child][0]), relative)[int(part)]
        else:
            expected = dot(motion.rate_row(m[0], m[1], n, index), a)
        worst.append((abs(value - expected) / (BOUND * scale) if math.isfinite(value) else math.inf, f"acceleration of {c}"))
    return max(worst), motion.mobility


def moving_mass(reading):
    still, before = {None} | {f for f in reading.links if f.static}, 0
    while len(still) > before:
        before = len(still)
        for j in reading.joints:
            if j.motions == [] and (j.parent in still or j.child in still):
                still |= {j.parent, j.child}
    return sum(f.mass for f in reading.links if f not in still)


def check(file):
    problems = []
    done = run("import", file)
    if done.returncode:
        return [done.stderr]
    reading, bodies = Reading(file), bodies_of(done.stdout)
    meaning = explain(reading, bodies)
    between(reading, bodies, meaning)
    is_tree = "\nloops:" not in done.stdout
    generator = random.Random(7)
    for trial in range(6 if is_tree else 1):
        positions = {b: generator.uniform(-1.0, 1.0) for b in bodies if trial and bodies[b]["type"] in SCALAR}
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as scene:
            scene.write(place(done.stdout, positions))
            scene.flush()
            result = json.loads(run("evaluate", scene.name).stdout)
        (ratio, what), mobility = compare(reading, bodies, meaning, positions, result)
        note(f"{pathlib.Path(file).name}: observed {ratio * BOUND:.2g}, bound {BOUND:g}, ratio {ratio:.2g} ({what})")
        if not ratio <= 1.0:
            problems.append(f"{file}: {what} is off by {ratio * BOUND:.3g}")
        mass = moving_mass(reading)
        if not abs(result["mass"]["total"] - mass) <= 1e-13 * mass:
            problems.append(f"{file}: the mass is {result['mass']['total']}, not {mass}")
    minimal = json.loads(run("run", file, "--duration", "1e-6", "--out", "/dev/null", "--summary", "-").stdout)["freedom"]["minimal"]
    note(f"{pathlib.Path(file).name}: {minimal} degrees of freedom")
    if minimal != mobility:
        problems.append(f"{file}: {minimal} degrees of freedom, not {mobility}")
    return problems


for file in files:
    claim(f"{pathlib.Path(file).stem}_moves_as_another_reading_says", check(file))
finish()
