"""deflected.py KINETREE: modes that are drawn and animated are those of `modes --json`, at an amplitude that can be seen.

Random trees of pivots, slides and balls with springs and dampers, whose damping makes modes complex, and random four-bars. The page gives each
body a screw relative to its parent. Held against the shape in joint coordinates; against the loops; and against all corners of all solids at
3,600 phases, for the amplitude. A picture is held against the closed form of a pendulum.
"""
# SPDX-License-Identifier: Apache-2.0
import base64
import json
import math
import os
import pathlib
import random
import re
import struct
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE, = sys.argv[1:]
os.environ["LSAN_OPTIONS"] = f"print_suppressions=0:suppressions={pathlib.Path(__file__).resolve().with_name('suppressions.txt')}"  # of pictures
SHARE, TURN, PHASES = 0.12, 0.4, 3600


def kinetree(*words, folder, text=None):
    return subprocess.run([KINETREE, *words], cwd=folder, input=text, capture_output=True, text=True)


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def add(a, b):
    return [x + y for x, y in zip(a, b)]


def turned(q, u):
    w, v = q[0], list(q[1:])
    a = add(cross(v, u), [w * x for x in u])
    return add(u, [2 * x for x in cross(v, a)])


def read_page(path):
    text = pathlib.Path(path).read_text()
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)[1])
    raw = base64.b64decode(re.search(r'<script type="text/plain" id="motion">(.*?)</script>', text, re.S)[1])
    count = len(data["bodies"]) - 1
    places = struct.unpack_from(f"<{3 * count}f", raw, 8)
    turns = struct.unpack_from(f"<{4 * count}h", raw, 8 + 12 * count)
    poses = [([0.0] * 3, [1.0, 0.0, 0.0, 0.0])]
    for i in range(count):
        q = [x / 32767 for x in turns[4 * i:4 * i + 4]]
        norm = math.hypot(*q)
        poses.append((add(places[3 * i:3 * i + 3], data["centre"]), [x / norm for x in q]))
    return data, poses


def random_tree(rng):
    """Bodies on each other or on the ground, each held by springs and dampers."""
    bodies, effects = [], []

    def point(reach):
        return [round(rng.uniform(-reach, reach), 3) for _ in range(3)]

    for i in range(rng.randint(1, 7)):
        kind = rng.choice(["revolute", "prismatic", "revolute", "spherical"])
        on = "world" if i == 0 or rng.random() < 0.2 else f"b{rng.randrange(i)}"
        joint = {"type": kind, "at": point(0.5)}
        if kind != "spherical":
            joint["axis"] = point(1)
        body = {"name": f"b{i}", "mass": 1.0, "com": point(0.3), "inertia": [0.02, 0.03, 0.025], "joint": joint,
                "shape": {"type": "rod", "from": point(0.3), "to": point(0.6), "radius": round(rng.uniform(0.01, 0.1), 3)}}
        bodies.append({**body, **({} if on == "world" else {"parent": on})})
        damping = rng.choice([0, round(rng.uniform(0, 5), 3)])
        if kind == "spherical":
            effects += [{"type": "spring", "between": [{"body": on, "at": point(0.9)}, {"body": f"b{i}", "at": point(0.4)}],
                         "stiffness": round(rng.uniform(50, 500), 2), "damping": damping, "length": 0.05} for _ in range(4)]
        else:
            effects.append({"type": "joint_spring", "joint": f"b{i}", "stiffness": round(rng.uniform(20, 500), 2), "damping": damping})
    return {"kinetree": 1, "gravity": [0, 0, 0], "bodies": bodies, "effects": effects}


def random_four_bar(rng):
    a, b, c = (round(rng.uniform(0.4, 0.9), 3) for _ in range(3))

    def link(name, length, **more):
        return {"name": name, "mass": 1.0, "shape": {"type": "rod", "to": [length, 0, 0], "radius": 0.02}, "markers": {"tip": [length, 0, 0]}, **more}

    pivot = {"type": "revolute", "axis": "z"}
    return {"kinetree": 1, "gravity": [0, -9.81, 0],
            "bodies": [link("crank", a, joint={**pivot, "position": round(rng.uniform(-2.4, -0.8), 3)}),
                       link("coupler", b, parent="crank", joint={**pivot, "at": [a, 0, 0], "position": 0.9}),
                       link("rocker", c, joint={**pivot, "at": [0.8, 0, 0], "position": -1.8})],
            "loops": [{"name": "close", "type": "revolute", "between": ["coupler.tip", "rocker.tip"], "axis": "z"}],
            "effects": [{"type": "joint_damper", "joint": "crank", "damping": round(rng.uniform(0, 1), 3)}]}


def twists_of(data, poses, mode, part):
    """The angular velocity and that of the origin of each body, in the world, from the screws relative to the parents."""
    twists = [([0.0] * 3, [0.0] * 3)]
    for i, body in enumerate(data["bodies"][1:], 1):
        w, v = mode["screws"][12 * i + 6 * part:12 * i + 6 * part + 3], mode["screws"][12 * i + 6 * part + 3:12 * i + 6 * part + 6]
        at, q = poses[body["parent"]]
        on, apart = twists[body["parent"]], [x - y for x, y in zip(poses[i][0], at)]
        angular = add(on[0], turned(q, w))
        twists.append((angular, add(add(on[1], turned(q, v)), cross(angular, apart))))
    return twists


def check_joints(data, poses, mode, shape):
    """A pivot turns about its axis through its place, a slide moves along it, both by what the shape states, which may be scaled."""
    worst, size = 0.0, max(1e-300, *(math.hypot(*x) for xs in shape.values() for x in xs))
    for joint in data["joints"]:
        axis = turned(joint["turn"], [0, 0, 1])
        for part in range(2):
            w, v = (mode["screws"][12 * joint["body"] + 6 * part + 3 * k:][:3] for k in range(2))
            amounts = [x[part] for x in shape[joint["name"]]]
            if joint["type"] == "revolute":
                expected = [amounts[0] * x for x in axis], [amounts[0] * x for x in cross(joint["at"], axis)]
            elif joint["type"] == "prismatic":
                expected = [0, 0, 0], [amounts[0] * x for x in axis]
            else: # the place of a ball stays; how it turns is in the child's axes
                expected = w, cross(joint["at"], w)
                worst = max(worst, abs(math.hypot(*w) - math.hypot(*amounts)) / size)
            worst = max(worst, *(abs(x - y) / size for x, y in zip(w + v, expected[0] + expected[1])))
    return worst


def check_loops(data, poses, twists):
    worst = 0.0
    for loop in data["loops"]:
        rates = []
        for end in loop["ends"]:
            angular, linear = twists[end["body"]]
            rates.append(add(linear, cross(angular, turned(poses[end["body"]][1], end["at"]))))
        worst = max(worst, math.dist(*rates))
    return worst


def amplitude_of(data, poses, mode, real, imaginary):
    """The largest distance of a corner over all phases and at the start, and the largest rotation."""
    corners, turn = [], 0.0
    for solid in data["solids"]:
        i, half = solid["body"], solid["half"]
        for k in range(8):
            at = add(solid["at"], turned(solid["turn"], [h if k >> n & 1 else -h for n, h in enumerate(half)]))
            arm = turned(poses[i][1], at)
            corners.append([add(t[i][1], cross(t[i][0], arm)) for t in (real, imaginary)])
        turn = max(turn, *(math.hypot(*(math.cos(f) * x - math.sin(f) * y for x, y in zip(real[i][0], imaginary[i][0])))
                           for f in (math.pi * n / 180 for n in range(180))))

    def farthest(phase):
        c, s = math.cos(phase), math.sin(phase)
        return max(math.hypot(*(c * x - s * y for x, y in zip(a, b))) for a, b in corners)

    coarse = max(range(PHASES // 20), key=lambda n: farthest(math.pi * 20 * n / PHASES))
    largest = max(farthest(math.pi * (20 * coarse + n) / PHASES) for n in range(-20, 21))
    return mode["amplitude"] * largest, mode["amplitude"] * farthest(mode["phase"]), mode["amplitude"] * turn


def check_random(folder, seed, make, problems, worst):
    scene = make(random.Random(seed))
    (pathlib.Path(folder) / "s.json").write_text(json.dumps(scene))
    ran = kinetree("modes", "s.json", "--at", "equilibrium" if "loops" in scene else "initial", "--json", "--view", "s.html", folder=folder)
    if ran.returncode != 0:
        if "loops" not in scene or "closed" not in ran.stderr and "equilibrium" not in ran.stderr:
            problems.append(f"seed {seed}: exit {ran.returncode}: {ran.stderr[:300]}")
        return 0
    shapes = [mode for mode in json.loads(ran.stdout)["modes"] if not mode["neutral"]]
    if not (pathlib.Path(folder) / "s.html").exists() or not shapes:
        return 0
    data, poses = read_page(pathlib.Path(folder) / "s.html")
    (pathlib.Path(folder) / "s.html").unlink()
    if len(data["modes"]) != min(len(shapes), 40):
        problems.append(f"seed {seed}: {len(data['modes'])} modes for {len(shapes)}")
    for mode, shape in zip(data["modes"], shapes):
        real, imaginary = (twists_of(data, poses, mode, part) for part in range(2))
        worst["joints"] = max(worst["joints"], check_joints(data, poses, mode, shape["position"]))
        worst["loops"] = max(worst["loops"], check_loops(data, poses, real), check_loops(data, poses, imaginary))
        largest, start, turn = amplitude_of(data, poses, mode, real, imaginary)
        limit = SHARE * data["size"]
        worst["amplitude"] = max(worst["amplitude"], abs(max(largest / limit, turn / TURN) - 1), abs(start / largest - 1))
        frequency = shape["frequency"] if shape["imaginary"] > 0 else 0
        if not (abs(mode["frequency"] - frequency) <= 1e-7 * abs(frequency)):
            problems.append(f"seed {seed}: {mode['frequency']} Hz for {frequency}")
    return len(shapes)


def check_pages(folder):
    problems, worst, modes = [], {"joints": 0.0, "loops": 0.0, "amplitude": 0.0}, 0
    for seed in range(24):
        modes += check_random(folder, seed, random_tree, problems, worst)
    looped = sum(check_random(folder, seed, random_four_bar, problems, worst) for seed in range(24))
    note(f"{modes} modes of trees, {looped} of four-bars: joints {worst['joints']:.1e}, loops {worst['loops']:.1e}, amplitude {worst['amplitude']:.1e}")
    bounds = {"joints": 1e-6, "loops": 2e-4, "amplitude": 1e-3} # quaternions of a page have 16 bits
    problems += [f"{name}: {worst[name]:.2e} > {bound:.0e}" for name, bound in bounds.items() if not worst[name] <= bound]
    problems += [] if modes >= 60 and looped >= 10 else [f"only {modes} and {looped} modes"]
    claim("a_page_of_modes_moves_bodies_by_the_shapes_of_json", problems)


def crosses_of(svg):
    """The centres of crosses, which stand for markers: two lines of 6.4 units over each other."""
    lines = [tuple(map(float, x)) for x in re.findall(r'd="M ([\d.]+) ([\d.]+) L ([\d.]+) ([\d.]+)', svg)]
    flat = [((x + u) / 2, y) for x, y, u, v in lines if abs(y - v) < 1e-3 and abs(abs(u - x) - 6.4) < 0.02]
    tall = [(x, (y + v) / 2) for x, y, u, v in lines if abs(x - u) < 1e-3 and abs(abs(v - y) - 6.4) < 0.02]
    return [p for p in flat if any(math.dist(p, q) < 0.02 for q in tall)]


def check_picture(folder):
    """A pendulum of 1 m, a marker in its middle and one at its end: both on a line that is turned by the amplitude."""
    scene = {"kinetree": 1, "name": "swing", "gravity": [0, -9.81, 0],
             "bodies": [{"name": "arm", "mass": 1.0, "joint": {"type": "revolute", "axis": "z", "position": -math.pi / 2},
                         "shape": {"type": "rod", "to": [1, 0, 0], "radius": 0.01}, "markers": {"middle": [0.5, 0, 0], "end": [0.9, 0, 0]}}]}
    (pathlib.Path(folder) / "p.json").write_text(json.dumps(scene))
    ran = kinetree("modes", "p.json", "--plot", "p.svg", folder=folder)
    svg, problems = (pathlib.Path(folder) / "p.svg").read_text() if ran.returncode == 0 else "", [ran.stderr] if ran.returncode else []
    crosses = sorted(crosses_of(svg), key=lambda p: p[1])
    if len(crosses) != 2:
        problems.append(f"{len(crosses)} crosses")
    else:
        (x, y), (u, v) = crosses
        size = math.hypot(1.02, 0.02, 0.02) # of the box around the rod
        expected = math.atan(SHARE * size / math.hypot(1.0, 0.01)) # without the hemisphere; displaced along a straight line
        angle = abs(math.atan2(u - x, v - y))
        note(f"angle {angle:.6f} rad, closed form {expected:.6f}")
        problems += [] if abs(angle - expected) < 2e-4 else [f"turned by {angle}, closed form {expected}"]
    frequency = math.sqrt(9.81 * 0.5 * 3) / (2 * math.pi)
    problems += [] if f"1: {frequency:.3f}"[:7] in svg else [f"no frequency {frequency}"]
    problems += [] if "deflected by at most 0.12 m, 12 % of its size" in svg else ["no words for the amplitude"]
    claim("a_picture_deflects_a_pendulum_by_the_amplitude_it_states", problems)


def check_bars(folder):
    """--bars draws joints. A mode of a state alone moves no body, and its panel states this."""
    ran = kinetree("modes", "p.json", "--plot", "b.svg", "--bars", folder=folder)
    faults = [] if ran.returncode == 0 and "in step with what moves most" in (pathlib.Path(folder) / "b.svg").read_text() else [ran.stderr or "no bars"]
    scene = json.loads((pathlib.Path(folder) / "p.json").read_text())
    scene["states"] = {"charge": {"initial": 1, "rate": "-2*charge"}}
    (pathlib.Path(folder) / "c.json").write_text(json.dumps(scene))
    ran = kinetree("modes", "c.json", "--plot", "c.svg", "--view", "c.html", folder=folder)
    svg = (pathlib.Path(folder) / "c.svg").read_text() if ran.returncode == 0 else ""
    faults += [] if "(no body moves)" in (pathlib.Path(folder) / "c.html").read_text() else ["the page does not say that no body moves"]
    faults += [] if "decay, time constant 0.5 s (no body moves)" in svg and svg.count("no body moves") == 1 else [f"{ran.returncode}: {ran.stderr} {svg[-300:]}"]
    claim("bars_are_there_and_modes_without_a_moving_body_say_so", faults)


def check_words(folder):
    faults = []
    for words, expected in ((["view", "p.json", "--modes", "--duration", "2"], "leave out --duration"), (["run", "p.json", "--modes"], "--modes"),
                            (["modes", "p.json", "--bars"], "--plot FILE goes with it"), (["modes", "p.json", "--view", "p.htm"], ".html"),
                            (["modes", "p.json", "--period", "1", "--view", "p.html"], "--view")):
        ran = kinetree(*words, folder=folder)
        if ran.returncode != 1 or expected not in ran.stderr:
            faults.append(f"{words}: {ran.returncode}, {ran.stderr[:200]}")
    ran = kinetree("view", "p.json", "--modes", folder=folder)
    if ran.returncode != 0 or not (pathlib.Path(folder) / "p.html").exists():
        faults.append(f"view --modes: {ran.returncode}, {ran.stderr[:200]}")
    claim("view_and_modes_reject_options_that_have_no_meaning_together", faults)


def main():
    with tempfile.TemporaryDirectory() as folder:
        check_pages(folder)
        check_picture(folder)
        check_bars(folder)
        check_words(folder)
    finish()


main()
