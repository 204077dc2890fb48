"""view_kinds KINETREE: pages of every joint, loop and effect, alone and in random scenes, in a headless Chromium.

A page loads without a word on the console, shows its bodies, and its picture has painted pixels. Random scenes put every effect that acts in a
joint into joints, into coordinates of loops, and into sliders that stand for a number, as an import makes them of tendons. Robots: the arrows of
drives fit their links, a robot that moves stays in the picture, and notes take at most two lines.

KT_VIEW_SEEDS=100 takes more random scenes.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import browser
from claims import claim, finish, note, skip

KINETREE = os.path.abspath(sys.argv[1])
WIDTH, HEIGHT = 560, 420
PAINTED_LEAST = 60  # pixels

# Pixels of the picture that are not paper, painted and read in one task; bodies under some pixel; whether the page stands.
SEEN = """(() => {
    const page = window.kinetree, canvas = document.getElementById("picture"), {width, height} = canvas;
    if (page === undefined || page.figure === null)
        return {painted: NaN, seen: 0};
    Object.keys(page.shown).forEach((layer) => { page.shown[layer] = true; });
    page.set_time(page.times[1]);
    page.paint();
    const flat = new OffscreenCanvas(width, height).getContext("2d");
    flat.drawImage(canvas, 0, 0);
    const pixels = flat.getImageData(0, 0, width, height).data;
    let painted = 0;
    for (let i = 4; i < pixels.length; i += 4)
        painted += [0, 1, 2].some((k) => pixels[i + k] !== pixels[k]) ? 1 : 0;
    const seen = page.figure.pick(page.pose(), page.shown, width, height, 0, 0, width, height);
    return {painted, seen: new Set([...seen].filter((n) => n > 0)).size};
})()"""


def kinetree(*words, folder, text=None):
    return subprocess.run([KINETREE, *map(str, words)], cwd=folder, input=text, capture_output=True, text=True)


def trouble(page, folder, name, text, *words):
    """What is wrong with the page of a scene or robot; a scene that cannot be run still has a page that shows why."""
    file = f"{folder}/{name}"
    pathlib.Path(file).write_text(text)
    run = kinetree("view", file, "--view", "page.html", "--quiet", *words, folder=folder)
    if not os.path.exists(f"{folder}/page.html"):
        return [f"{name}: no page: {run.stderr.strip()}"]
    page.open(f"{folder}/page.html")
    os.remove(f"{folder}/page.html")
    complaints = page.complaints()
    if complaints:
        return [f"{name}: {word}" for word in complaints[:3]]
    found = page.evaluate(SEEN)
    return [] if found["painted"] >= PAINTED_LEAST and found["seen"] > 0 else [f"{name}: {found}"]


def check_types(page, folder):
    """The example of each joint, loop and effect, from the help itself."""
    made = kinetree("help", "--types", folder=folder).stdout
    scenes = re.findall(r"^### (joint|loop|effect): (\w+)\n.*?^```yaml\n(.*?)^```$", made, flags=re.M | re.S)
    note(f"{len(scenes)} types of joints, loops and effects")
    claim("all_types_have_examples", [] if len(scenes) >= 40 else [f"{len(scenes)}"])
    claim("each_type_has_a_page", [word for noun, name, text in scenes for word in
                                   trouble(page, folder, f"{noun}-{name}.yaml", text, "--duration", "0.02", "--interval", "0.01")])


# ---- random scenes -----------------------------------------------------------------------------------------------------

JOINTS = ("fixed", "revolute", "prismatic", "screw", "cylindrical", "planar", "universal", "spherical", "free")
SCALAR = ("revolute", "prismatic", "screw")
LOOPS = {"spherical": {}, "inline": {"axis": "z"}, "inplane": {"axis": "z"}, "distance": {}, "parallel": {}, "coaxial": {"axis": "z"},
         "orthogonal": {"axis": "x", "axis2": "y"}, "revolute": {"axis": "z"}, "prismatic": {"axis": "z"}, "cylindrical": {"axis": "x"},
         "planar": {"axis": "x"}, "weld": {}, "universal": {"axis": "x", "axis2": "y"}, "screw": {"axis": "z", "pitch": 0.02}}
IN_JOINT = ({"type": "joint_spring", "stiffness": 2, "rest": 0.1}, {"type": "joint_damper", "damping": 0.1},
            {"type": "joint_friction", "coulomb": 0.1, "viscous": 0.01, "smoothing": 0.01},
            {"type": "joint_limit", "lower": -0.2, "upper": 0.4, "stiffness": 50, "damping": 1}, {"type": "motor", "torque": 0.3},
            {"type": "servo", "target": 0.2, "stiffness": 5, "damping": 1, "limit": 3}, {"type": "expression", "force": "-0.1*t"})
ON_BODIES = ({"type": "spring", "stiffness": 3, "length": 0.2}, {"type": "attraction", "strength": 0.1},
             {"type": "bushing", "stiffness": [5] * 6, "damping": [1] * 6})
# Loops with coordinates that a motor may act in.
DRIVEN = ("revolute", "prismatic", "cylindrical")


def vector(rng, size=0.5):
    return [round(rng.uniform(-size, size), 3) for _ in range(3)]


def random_body(rng, i, names):
    joint = {"type": rng.choice(JOINTS if i > 0 else JOINTS[1:])}
    if joint["type"] not in ("fixed", "spherical", "free"):
        joint["axis"] = rng.choice("xyz")
    joint |= {"pitch": 0.05} if joint["type"] == "screw" else {}
    joint |= {"axis2": {"x": "y", "y": "z", "z": "x"}[joint["axis"]]} if joint["type"] == "universal" else {}
    joint |= {"at": vector(rng)} if joint["type"] != "free" else {}
    shape = rng.choice([None, {"type": "box", "size": [0.1, 0.2, 0.05]}, {"type": "sphere", "radius": 0.1}, {"type": "rod", "to": [0.3, 0, 0]},
                        {"type": "cylinder", "radius": 0.05, "length": 0.2, "axis": "y"}])
    body = {"name": f"b{i}", "joint": joint, "mass": 1, "inertia": [0.02, 0.03, 0.04], "markers": {"tip": vector(rng, 0.2)}}
    body |= {"shape": shape} if shape else {}
    return body | ({"parent": rng.choice(names)} if names and joint["type"] != "free" and rng.random() < 0.7 else {})


def random_number(rng, i, joints):
    """A slider without mass that a coupling moves, as an import makes of a tendon."""
    chosen = rng.sample(joints, min(len(joints), rng.randint(1, 3)))
    return ({"name": f"n{i}", "joint": {"type": "prismatic"}},
            {"name": f"tendon{i}", "type": "coupling", "coefficients": {f"n{i}": -1, **{name: rng.choice((0.5, 1, -2)) for name in chosen}}})


def random_scene(seed):
    rng, bodies, loops, effects = random.Random(seed), [], [], []
    for i in range(rng.randint(2, 7)):
        bodies.append(random_body(rng, i, [body["name"] for body in bodies]))
    names, scalar = [b["name"] for b in bodies], [b["name"] for b in bodies if b["joint"]["type"] in SCALAR]
    coordinates = list(scalar)
    for i in range(rng.randint(0, 2) if scalar else 0):
        body, loop = random_number(rng, i, scalar)
        bodies.append(body)
        loops.append(loop)
        coordinates.append(body["name"])
    if rng.random() < 0.6:  # from the world to the last body, which may not close: the page of that shows why
        kind = rng.choice(list(LOOPS))
        end = {"body": names[-1], "at": vector(rng, 0.1)}
        loops.append({"name": "shut", "type": kind, "between": [{"body": "world", "at": vector(rng, 0.2)}, end], **LOOPS[kind]})
        coordinates += ["shut"] if kind in ("revolute", "prismatic") else []
    if scalar and rng.random() < 0.3:
        loops.append({"name": "moved", "type": "motion", "joint": scalar[0], "position": {"polynomial": [0, 0.1]}})
    effects += [{**effect, "joint": rng.choice(coordinates)} for effect in IN_JOINT if coordinates and rng.random() < 0.6]
    effects += [{**effect, "between": ["world", f"{rng.choice(names)}.tip"]} for effect in ON_BODIES if rng.random() < 0.4]
    effects += [{"type": "contact", "point": f"{names[0]}.tip", "radius": 0.02, "plane": "world", "stiffness": 1e3}] if rng.random() < 0.3 else []
    scene = {"kinetree": 1, "name": f"random {seed}", "gravity": [0, 0, -9.81], "bodies": bodies}
    return json.dumps(scene | ({"loops": loops} if loops else {}) | ({"effects": effects} if effects else {}), indent=1)


def check_random(page, folder):
    """Scenes that the description rejects (a loop that cannot be closed at all, bodies without inertia) have no page and do not count."""
    faults, pages, rejected = [], 0, {}
    for seed in range(int(os.environ.get("KT_VIEW_SEEDS", 24))):
        found = trouble(page, folder, f"random-{seed}.json", random_scene(seed), "--duration", "0.02", "--interval", "0.01", "--integrator", "rk4", "--step", "0.01")
        if found and "no page" in found[0]:
            rejected[seed] = found[0][-150:]
        else:
            pages += 1
            faults += found
    note(f"random scenes: {pages} pages; rejected: {rejected}")
    claim("random_scenes_have_pages", faults + ([] if pages >= 2 * len(rejected) else [f"{pages} pages of {pages + len(rejected)} scenes"]))


# ---- robots ------------------------------------------------------------------------------------------------------------

TENDON = """<mujoco model="tendon"><worldbody>
  <body name="left"><joint name="l" type="slide" axis="1 0 0"/><geom type="sphere" size="0.1"/></body>
  <body name="right" pos="1 0 0"><joint name="r" type="slide" axis="1 0 0"/><geom type="sphere" size="0.1"/></body></worldbody>
<tendon><fixed name="split" damping="1" stiffness="3"><joint joint="l" coef="0.5"/><joint joint="r" coef="0.5"/></fixed></tendon>
<actuator><position tendon="split" kp="10"/><motor joint="l"/></actuator>
<contact><exclude body1="left" body2="right"/></contact>
<keyframe><key qpos="0 0"/></keyframe><custom><numeric name="x" data="1"/></custom></mujoco>
"""

# A body of a metre with fingers of some centimetres that motors drive, without a ground under it.
ROBOT = """<mujoco model="robot"><worldbody><body name="trunk" pos="0 0 1"><freejoint/><geom type="box" size="0.5 0.4 0.3"/>
  <body name="arm" pos="0.5 0 0"><joint name="shoulder" axis="0 1 0" damping="1"/><geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.05"/>
    <body name="finger" pos="0.4 0 0"><joint name="knuckle" axis="0 0 1" damping="0.1"/><geom type="capsule" fromto="0 0 0 0.06 0 0" size="0.008"/></body></body>
  </body></worldbody><actuator><motor name="a" joint="shoulder"/><motor name="b" joint="knuckle"/></actuator></mujoco>
"""

# Cylinders above a floor, each of which touches it in 32 points.
CYLINDERS = """<mujoco model="cylinders"><worldbody><geom type="plane" size="1 1 1"/><body pos="0 0 0.5"><freejoint/>{}</body></worldbody></mujoco>
"""
CYLINDER = '<geom type="cylinder" size="0.1 0.1" pos="0 0 {}"/>'
POINTS = """(() => ({points: kinetree.data.effects.filter(({type}) => type === "contact").length,
    ticked: [...document.querySelectorAll("#layers label")].find((one) => one.textContent === "Contact points").querySelector("input").checked}))()"""

# At twenty times: the share of the picture by which the farthest end of a solid is outside of it; radii of drives and what the links reach.
INSIDE = """(() => {
    const page = window.kinetree, {width, height} = document.getElementById("picture");
    let worst = -1;
    for (let k = 0; k < 20; k++) {
        page.set_time(page.times[0] + (k / 19) * (page.times[1] - page.times[0]));
        const view = page.pose();
        for (const {body, at, turn: turned, half} of page.data.solids)
            for (const s of [-1, 1]) {
                const xy = to_page(view, point_of(page.poses, body, add(at, turn(turned, [0, 0, s * half[2]]))));
                worst = Math.max(worst, ...xy.map((x) => Math.abs(2 * x - 1) - 1));
            }
    }
    page.shown.drives = true;
    page.paint();
    const rings = page.data.effects.filter(({type}) => type === "motor").map(({joint}) => page.data.joints[joint])
        .map(({ring, body}) => [ring, page.figure.reach(body)]);
    return {worst, follows: page.follows, rings, size: page.data.size, first: page.notes[0]};
})()"""
# How far the axes of the world reach out of the picture, and how long they are in it, as shares of its width and height.
AXES = """(() => {
    const page = window.kinetree, view = page.pose(), ends = page.world_axes().map((p) => to_page(view, p));
    const worst = Math.max(...ends.flat().map((x) => Math.abs(2 * x - 1) - 1));
    return {worst, longest: Math.max(...ends.map(([x, y]) => Math.hypot(x - ends[0][0], y - ends[0][1])))};
})()"""
DRIVE = """kinetree: 1
bodies:
  - {name: sun, joint: {type: revolute, axis: z, velocity: 3}, mass: 1, inertia: [0.1, 0.1, 0.2]}
  - {name: ring, joint: {type: revolute, axis: z}, mass: 2, inertia: [0.3, 0.3, 0.6]}
  - {name: wheel, joint: {type: revolute, axis: z, at: [0, 0, 0.4]}, mass: 2, inertia: [0.3, 0.3, 0.6]}
simulate: {duration: 1}
"""
ARM = """kinetree: 1
gravity: [0, 0, -9.81]
bodies: [{name: arm, joint: {type: revolute, axis: y, position: 1.57}, mass: 1, shape: {type: rod, to: [0, 0, -1]}}]
simulate: {duration: 0.2}
"""
NOTES = """(() => {
    const box = document.getElementById("note"), line = parseFloat(getComputedStyle(box).lineHeight), all = window.kinetree.notes;
    const closed = document.getElementById("notes").getBoundingClientRect().height;
    document.getElementById("notes").open = true;
    return {lines: closed / line, below: getComputedStyle(box).paddingBottom, notes: all.length, listed: document.querySelectorAll("#others li").length};
})()"""


def check_robots(page, folder):
    faults = trouble(page, folder, "tendon.xml", TENDON, "--duration", "0.1")
    page.resize(380, HEIGHT)  # a narrow window
    found = page.evaluate(NOTES)
    page.resize(WIDTH, HEIGHT)
    note(f"notes of a robot with a tendon: {found}")
    claim("a_drive_of_a_tendon_leaves_the_page_whole", faults)
    claim("notes_take_two_lines_and_are_all_listed",
          [] if found["lines"] <= 2.9 and found["below"] == "0px" and found["notes"] > 2 and found["listed"] == found["notes"] else [f"{found}"])
    faults = trouble(page, folder, "robot.xml", ROBOT, "--duration", "5")
    found = page.evaluate("kinetree.fit(), " + INSIDE)
    note(f"a robot that falls 120 m: {found}")
    claim("a_robot_that_moves_stays_in_the_picture", faults + ([] if found["follows"] and found["worst"] <= 0 else [f"{found}"]))
    claim("the_first_note_is_a_change_of_the_motion", [] if "has no ground and falls" in found["first"] else [found["first"]])
    claim("drives_scale_with_their_links", [f"{found}" for ring, reach in found["rings"] if not 0.1 * reach <= ring <= 0.6 * reach] +
          ([] if len(found["rings"]) == 2 else [f"{found['rings']}"]))
    faults = []
    for count, is_shown in ((50, True), (51, False)):  # a cylinder touches a plane in two points
        text = CYLINDERS.format("".join(CYLINDER.format(round(0.2 * i, 1)) for i in range(count)))
        faults += trouble(page, folder, "cylinders.xml", text, "--duration", "0.1", "--contacts")
        found = page.evaluate(POINTS)
        faults += [] if found == {"points": 2 * count, "ticked": is_shown} else [f"{found}"]
    claim("dots_of_more_than_a_hundred_contact_points_are_not_shown_at_first", faults)


def check_axes(page, folder):
    """A drive that is long along the view only, and an arm that moves little: the axes are in the picture."""
    faults = []
    for name, text in (("drive.yaml", DRIVE), ("arm.yaml", ARM)):
        faults += trouble(page, folder, name, text)
        for direction in ("[0, 0, 1]", "[0, -1, 0]", "[1, 0, 0]", "unit([1, -1, 1])"):
            found = page.evaluate(f"kinetree.look_from({direction}), " + AXES)
            note(f"{name} from {direction}: {found}, bounds 0 and 0.02")
            faults += [] if found["worst"] <= 0 and found["longest"] >= 0.02 else [f"{name} from {direction}: {found}"]
    claim("axes_of_the_world_are_not_cut_off", faults)


# Pairs of texts in the chart that cover each other, without the names of events, which are upright.
COVERED = """(() => {
    const page = window.kinetree, boxes = [], context = CanvasRenderingContext2D.prototype, write = context.fillText;
    context.fillText = function (text, x, y) {
        const width = this.measureText(text).width, left = x - {left: 0, center: 0.5, right: 1}[this.textAlign] * width;
        if (this.getTransform().b === 0)
            boxes.push({text, left, right: left + width, top: y - 5, bottom: y + 5});
        return write.apply(this, arguments);
    };
    page.chart.paint(page.chart.theme);
    context.fillText = write;
    const cover = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
    return {texts: boxes.length, pairs: boxes.flatMap((a, i) => boxes.slice(i + 1).filter((b) => cover(a, b)).map((b) => `${a.text} | ${b.text}`))};
})()"""
STILL = """kinetree: 1
bodies:
  - {name: turns, joint: {type: revolute, axis: z}, mass: 1, inertia: [1, 1, 1]}
  - {name: slides, joint: {type: prismatic, axis: x}, mass: 1}
simulate: {duration: 1}
"""


def check_chart(page, folder):
    """Charts of four units: numbers of all lengths, and units, do not cover each other."""
    faults, texts = [], 0
    for k, size in enumerate((0, 3e-9, 0.02, 7, 1234.5)):
        text = STILL.replace("axis: z}", f"axis: z, velocity: {size}}}").replace("axis: x}", f"axis: x, velocity: {7 * size}, position: {size * 1e3}}}")
        faults += trouble(page, folder, f"still-{k}.yaml", text)
        found = page.evaluate(COVERED)
        texts += found["texts"]
        faults += [f"{size}: {pair}" for pair in found["pairs"]]
    note(f"{texts} texts in five charts")
    claim("texts_of_a_chart_do_not_cover_each_other", faults + ([] if texts > 50 else ["too few texts"]))


def main():
    if browser.find() is None:
        skip("command/view_kinds", "Chromium is not on this machine")
        sys.exit(77)
    page = browser.Browser(WIDTH, HEIGHT)
    try:
        with tempfile.TemporaryDirectory() as folder:
            check_types(page, folder)
            check_random(page, folder)
            check_robots(page, folder)
            check_axes(page, folder)
            check_chart(page, folder)
    finally:
        page.close()
    finish()


main()
