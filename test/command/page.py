"""page KINETREE SCENES: the page that `kinetree view` writes, in a headless Chromium: it loads in silence, draws, plays, seeks, and takes
names for names. Of the bundled scenes it takes some dozen, which have every kind of solid, joint, symbol and plane; KT_VIEW_ALL=1 takes all (half a
second each).

The page's own numbers of what is under each pixel tell which bodies are seen; colours are read from a picture of the whole page.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import time
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import browser
from claims import claim, finish, note, skip

KINETREE, SCENES = sys.argv[1:]
WIDTH, HEIGHT = 560, 420
PAGE_BYTES = 150_000
DOZEN = ("articulated-rotor", "bicycle", "chain", "engine-mounts", "four-bar", "humanoid", "n-four-bar-40", "puck", "rolling-ball", "rope", "stewart",
         "tethered-satellites", "trolley")

# Which bodies are seen at two times, and which have solids.
SEEN = """(() => {
    const page = window.kinetree, {width, height} = document.getElementById("picture"), seen = new Set();
    for (const s of [0, 0.4]) {
        page.set_time(page.times[0] + s * (page.times[1] - page.times[0]));
        for (const n of page.figure.pick(page.pose(), page.shown, width, height, 0, 0, width, height))
            if (n > 0)
                seen.add(page.figure.things[n - 1].body);
    }
    return {seen: [...seen], solid: [...new Set(page.data.solids.map((s) => s.body))], frames: page.motion.frames};
})()"""
PAINTED = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


def kinetree(*words, folder, text=None):
    return subprocess.run([KINETREE, *words], cwd=folder, input=text, capture_output=True, text=True)


def pixels_of(png):
    """Rows of [red, green, blue] of a PNG with eight bits a channel, without interlace."""
    at, data, (width, height, _, kind) = 8, b"", struct.unpack(">IIBB", png[16:26])
    while at < len(png):
        size, name = struct.unpack(">I4s", png[at:at + 8])
        data += png[at + 8:at + 8 + size] if name == b"IDAT" else b""
        at += size + 12
    raw, step = zlib.decompress(data), {2: 3, 6: 4}[kind]
    rows, before, at = [], bytearray(step * width), 0
    for _ in range(height):
        filter_, row = raw[at], bytearray(raw[at + 1:at + 1 + step * width])
        at += 1 + step * width
        for i in range(len(row)):
            a, b, c = row[i - step] if i >= step else 0, before[i], before[i - step] if i >= step else 0
            if filter_ == 1:
                row[i] = (row[i] + a) & 255
            elif filter_ == 2:
                row[i] = (row[i] + b) & 255
            elif filter_ == 3:
                row[i] = (row[i] + (a + b) // 2) & 255
            elif filter_ == 4:
                p = a + b - c
                row[i] = (row[i] + min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]) & 255
        rows.append([row[i:i + 3] for i in range(0, len(row), step)])
        before = row
    return rows


def of_colour(rows, colour):
    """Pixels whose colour is this one, lighter or darker: the direction in the cube of colours is what light leaves alone."""
    size, count = sum(x * x for x in colour) ** 0.5, 0
    for row in rows:
        for pixel in row:
            norm = sum(x * x for x in pixel) ** 0.5
            if 60 < norm < 330 and sum(x * y for x, y in zip(pixel, colour)) > 0.995 * norm * size:
                count += 1
    return count


def check_scenes(page, folder):
    """Bundled scenes: not a word on the console, no request, and most bodies with a solid are seen somewhere (a few are inside others)."""
    words, unseen, slow = [], [], 0.0
    for scene in sorted(pathlib.Path(SCENES).glob("*.yaml")):
        if scene.stem not in DOZEN and not os.environ.get("KT_VIEW_ALL"):
            continue
        run = kinetree("view", scene, "--quiet", folder=folder)
        if run.returncode != 0:
            words.append(f"{scene.stem}: {run.stderr}")
            continue
        path, start = f"{folder}/{scene.stem}.html", time.monotonic()
        page.open(path)
        result = page.evaluate(SEEN)
        slow = max(slow, time.monotonic() - start)
        words += [f"{scene.stem}: {word}" for word in page.complaints()]
        found, wanted = len(set(result["seen"]) & set(result["solid"])), len(result["solid"])
        if not (wanted > 0 and found >= 0.6 * wanted and result["frames"] > 100):
            unseen.append(f"{scene.stem}: {found} of {wanted} bodies with solids are seen, {result['frames']} frames")
        os.remove(path)
    note(f"slowest scene, s: {slow:.2f}")
    claim("bundled_scenes_load_in_silence", words)
    claim("bundled_scenes_show_their_bodies", unseen)


def check_colours(page, path):
    """The three bodies of the four-bar, by their colours on the page, light and dark."""
    for scheme, blue in (("light", (0, 114, 178)), ("dark", (56, 139, 253))):
        page.resize(WIDTH, HEIGHT, scheme)
        page.open(path)
        page.evaluate("document.querySelectorAll('aside').forEach((one) => one.remove()); kinetree.shown.traces = false; kinetree.fit()")
        page.evaluate("document.getElementById('curves').remove()")
        page.evaluate(PAINTED)
        rows = pixels_of(page.picture())[60:HEIGHT - 60]
        counts = {name: of_colour(rows, colour) for name, colour in (("crank", blue), ("coupler", (213, 94, 0)), ("rocker", (0, 158, 115)))}
        note(f"pixels by colour, {scheme}: {counts}")
        claim(f"bodies_have_their_colours_{scheme}", [f"{name}: {n} pixels" for name, n in counts.items() if n < 300])


def check_time(page, path):
    """Buttons, keys and the slider move the time; resizing paints anew."""
    page.resize(WIDTH, HEIGHT)
    page.open(path)
    faults = []

    def expect(what, expression, wanted):
        found = page.evaluate(expression)
        if found != wanted:
            faults.append(f"{what}: {found}, not {wanted}")

    def key(name, code=0):
        for kind in ("keyDown", "keyUp"):
            page.call("Input.dispatchKeyEvent", type=kind, key=name, text=" " if name == " " else "", windowsVirtualKeyCode=code)

    expect("rests at first where motion is to be reduced", "kinetree.is_playing", False)
    key("ArrowRight", 39)
    expect("an arrow steps by a frame", "kinetree.time === kinetree.motion.times[1]", True)
    key("End", 35)
    expect("End is the last frame", "kinetree.time === kinetree.times[1]", True)
    key("Home", 36)
    expect("Home is the first", "kinetree.time", 0)
    page.evaluate("document.getElementById('slider').value = 30; document.getElementById('slider').dispatchEvent(new Event('input'))")
    expect("the slider seeks", "kinetree.time === kinetree.motion.times[30]", True)
    expect("and is told", "document.getElementById('slider').getAttribute('aria-valuetext')", page.evaluate("`${show_number(kinetree.time)} seconds`"))
    page.evaluate("document.getElementById('play').click()")
    page.evaluate("new Promise((done) => { const look = () => kinetree.time > kinetree.motion.times[35] ? done() : setTimeout(look, 20); look(); })", 30)
    key(" ", 32)
    expect("the space bar pauses", "[kinetree.is_playing, document.getElementById('play').getAttribute('aria-label')]", [False, "Play"])
    before = page.evaluate("kinetree.pictures")
    page.evaluate("kinetree.fit()")
    for width, height in ((400, 700), (300, 900), (WIDTH, HEIGHT), (1000, 300), (400, 700)):
        page.resize(width, height)
        page.evaluate(PAINTED)
        expect(f"all points are in a window of {width} x {height}", """(() => {
            const {width, height} = document.getElementById("picture"), {matrix: m} = kinetree.camera.look(width, height, [0, 0, 0]);
            return kinetree.points(40).every(([x, y, z]) => [0, 1].every((k) =>
                Math.abs(m[k] * x + m[k + 4] * y + m[k + 8] * z + m[k + 12]) <= Math.abs(m[3] * x + m[7] * y + m[11] * z + m[15])));
        })()""", True)
    expect("a narrow window is painted anew, and nothing is cut off", f"kinetree.pictures > {before} && document.documentElement.scrollWidth <= 400", True)
    expect("its parts are one below the other", """(() => {
        const edge = (selector, side) => document.querySelector(selector).getBoundingClientRect()[side];
        return edge("#stage", "bottom") <= edge("aside", "top") + 1 && edge("aside", "bottom") <= edge("#curves", "top") + 1;
    })()""", True)
    page.evaluate("kinetree.seek(kinetree.times[1]); kinetree.paint()")
    expect("a trace has the colours of the theme", """(() => {
        const colour = () => JSON.stringify([...kinetree.figure.paths[0].past.numbers.bits.slice(3, 4)]), before = colour();
        document.getElementById("theme").click();
        kinetree.paint();
        const other = colour();
        document.getElementById("theme").click();
        kinetree.paint();
        return before !== other && before === colour();
    })()""", True)
    expect("every control has a name", """[...document.querySelectorAll("button, input, select, canvas")].filter((one) => !(one.getAttribute("aria-label")
        || one.textContent.trim() || one.closest("label")?.textContent.trim())).map((one) => one.outerHTML)""", [])
    claim("time_moves_by_buttons_keys_and_slider", faults + page.complaints())


# Numbers that arrows (a cylinder and a cone each) consist of near the end of the motion, by what is shown.
ARROWS = """((shown) => {
    const {figure} = kinetree, of_all = {...kinetree.shown, reaction: false, contact: false, effect: false, axes: false};
    kinetree.seek(kinetree.times[0] + 0.999 * (kinetree.times[1] - kinetree.times[0]));
    kinetree.pose();
    figure.update(kinetree.time, kinetree.poses, {...of_all, ...shown});
    return figure.arrows.map((batch) => batch.numbers.used).reduce((a, b) => a + b);
})"""


def check_arrows(page, folder):
    """A ball that has come to rest on its plane under a spring: an arrow of the contact, one of the spring; nothing acts across the slide."""
    scene = """kinetree: 1
name: ball
gravity: [0, 0, -9.81]
bodies:
  - name: ball
    joint: {type: prismatic, axis: z, position: 0.098}
    mass: 0.5
    shape: {type: sphere, radius: 0.1}
    markers: {centre: [0, 0, 0]}
effects:
  - {type: spring, between: [ball.centre, world], stiffness: 8, length: 1}
  - {type: contact, point: ball.centre, radius: 0.1, plane: world, stiffness: 1e4, exponent: 1.5}
"""
    run = kinetree("view", "-", "--view", "ball.html", "--duration", "0.02", "--quiet", folder=folder, text=scene)
    page.open(f"{folder}/ball.html")
    counts = [page.evaluate(f"{ARROWS}({shown})") for shown in ("{}", "{contact: true}", "{effect: true}", "{reaction: true, contact: true, effect: true}")]
    one = counts[1]
    note(f"numbers of arrows: {counts}")
    claim("forces_of_contacts_and_effects_are_arrows", ([run.stderr] if run.returncode else []) + page.complaints() +
          ([] if one > 0 and counts == [0, one, one, 2 * one] else [f"{counts}"]))


# Points of the lines of a path around a drum of radius 0.1 m at the origin: their number, and the least distance from its axis.
PATH = """(() => {
    const {motion} = window.kinetree, ends = [...Array(motion.line_count).keys()].flatMap((i) => line_at(motion, 0, i));
    return [ends.length, Math.min(...ends.map(([x, , z]) => Math.hypot(x + motion.centre[0], z + motion.centre[2])))];
})()"""


def check_path(page, folder):
    scene = """kinetree: 1
bodies:
  - name: ball
    joint: {type: free, position: {position: [0.4, 0, -0.5]}}
    mass: 1
    shape: {type: sphere, radius: 0.05}
effects:
  - type: expression
    path: [{body: world, at: [-0.3, 0, -0.4]}, {body: world, radius: 0.1, axis: y, side: [0, 0, 1]}, ball]
    force: "-length"
"""
    run = kinetree("view", "-", "--view", "path.html", "--duration", "0.02", "--quiet", folder=folder, text=scene)
    page.open(f"{folder}/path.html")
    count, least = page.evaluate(PATH)
    note(f"ends of lines: {count}; least distance from the axis: {least}")
    claim("paths_lead_around_their_surfaces", ([run.stderr] if run.returncode else []) + page.complaints() +
          ([] if count == 28 and abs(least - 0.1) < 1e-6 else [f"{count} ends, {least} m from the axis"]))


DIFFERENTIAL = """kinetree: 1
name: differential
bodies:
""" + "".join(f"  - {{name: {name}, joint: {{type: revolute, axis: y, at: [0, {y}, 0]}}, mass: 2, shape: {{type: cylinder, radius: {r}, length: 0.1, axis: y}}}}\n"
              for name, y, r in (("ring", 0, 0.15), ("left", 0.2, 0.1), ("right", -0.2, 0.1))) + """loops:
  - {name: mean, type: coupling, coefficients: {left: 0.5, right: 0.5, ring: -1}}
effects:
  - {type: motor, joint: ring, torque: 5}
"""
BALL = """kinetree: 1
name: ball
gravity: [0, 0, -9.81]
bodies:
  - {name: ball, joint: {type: prismatic, axis: z, position: 0.098}, mass: 0.5, shape: {type: sphere, radius: 0.1}, markers: {centre: [0, 0, 0]}}
  - {name: block, joint: {type: prismatic, axis: x, at: [0.5, 0, 0]}, mass: 500, shape: {type: box, size: [0.1, 0.1, 0.1]}, markers: {c: [0, 0, 0]}}
effects:
  - {type: contact, point: ball.centre, radius: 0.1, plane: world, stiffness: 1e4, exponent: 1.5}
  - {type: spring, between: [block.c, {body: world, at: [0.9, 0, 0]}], stiffness: 1e6, length: 0.1}
"""
# Until the picture rests, drawn as well as can be, however busy the machine is; the page tells it, and 20 s are enough.
RESTED = """new Promise((done) => {
    const {kinetree} = window, begin = performance.now();
    const rests = () => !kinetree.is_stale && (kinetree.is_fine || kinetree.quality === 0);
    const look = () => requestAnimationFrame(rests() || performance.now() - begin > 20000 ? () => requestAnimationFrame(done) : look);
    look();
})"""


def check_seen(page, folder):
    """Arrows within solids shine through them: of the motor in its gear, of the dashes of a coupling, of the contact on its ball, next to a
    spring that pulls 50,000 times as much."""
    counts = {}
    for name, text, layer in (("differential", DIFFERENTIAL, "drives"), ("ball", BALL, "contact")):
        run = kinetree("view", "-", "--view", f"{name}.html", "--duration", "0.02", "--quiet", folder=folder, text=text)
        if run.returncode:
            counts[name] = run.stderr
            continue
        page.resize(WIDTH, HEIGHT)
        page.open(f"{folder}/{name}.html")
        pictures = []
        for shown in ("true", "false"):
            page.evaluate(f"kinetree.pause(); kinetree.camera.aim([0, 1, 0.01]); kinetree.fit(); kinetree.shown.{layer} = {shown}; kinetree.is_stale = true; {RESTED}")
            pictures.append(pixels_of(page.picture()))
        counts[name] = sum(a != b for rows in zip(*pictures) for a, b in zip(*rows))
    note(f"pixels that arrows within solids change: {counts}")
    claim("arrows_within_bodies_are_seen", [f"{name}: {count}" for name, count in counts.items() if not (isinstance(count, int) and count > 100)])


def check_rest(page, folder):
    """A picture that rests is drawn as well as can be; names lie over none of the others; a chart begins with positions."""
    run = kinetree("view", "-", "--view", "rest.html", "--duration", "0.2", "--quiet", folder=folder, text=DIFFERENTIAL)
    page.resize(WIDTH, HEIGHT)
    page.open(f"{folder}/rest.html")
    page.evaluate("kinetree.pause(); kinetree.camera.aim([0, 1, 0]); kinetree.fit(); kinetree.shown.names = true; kinetree.quality = 3; kinetree.is_stale = true")
    first = page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(document.getElementById('picture').width))))")
    page.evaluate(RESTED)
    last, boxes, chosen = page.evaluate("""[document.getElementById("picture").width,
        [...document.querySelectorAll("#names span")].map((one) => one.getBoundingClientRect()).map((b) => [b.left, b.right, b.top, b.bottom]),
        kinetree.chart.chosen.map((i) => kinetree.data.columns[i].name)]""")
    over = [(a, b) for i, a in enumerate(boxes) for b in boxes[:i]
            if min(a[1], b[1]) > max(a[0], b[0]) + 0.5 and min(a[3], b[3]) > max(a[2], b[2]) + 0.5]
    note(f"width of a coarse picture and of one that rests: {first}, {last}; {len(boxes)} names; the chart begins with {chosen}")
    words = ([run.stderr] if run.returncode else []) + page.complaints()
    claim("a_picture_that_rests_is_fine", words + ([] if last > 1.5 * first else [f"{first}, {last}"]))
    claim("names_lie_over_no_names", [f"{pair}" for pair in over] + ([] if len(boxes) == 3 else [f"{len(boxes)} names"]))
    claim("a_chart_begins_with_what_moves", [] if chosen and all(name.startswith("position.") for name in chosen) else [f"{chosen}"])


# Numbers of lines, without and with what springs, stops, drives and couplings add.
SYMBOLS = """["springs", "drives"].map((layer) => [false, true].map((is_on) => {
    const {figure} = kinetree;
    kinetree.pose();
    figure.update(kinetree.time, kinetree.poses, {...kinetree.shown, springs: false, drives: false, [layer]: is_on});
    return figure.thick.numbers.used + figure.thin.numbers.used + figure.drives.numbers.used;
}))"""


def check_symbols(page, folder):
    """What acts in a joint or between joints has lines, each kind by itself."""
    faults, bodies = [], "".join(f"  - {{name: {name}, joint: {{type: revolute, axis: z, at: [{x}, 0, 0]}}, mass: 1, shape: {{type: rod, to: [1, 0, 0]}}}}\n"
                                 for name, x in (("a", 0), ("b", 2)))
    for layer, text in ((0, "effects: [{type: joint_spring, joint: b, stiffness: 1}]"), (0, "effects: [{type: joint_limit, joint: b, stiffness: 1, upper: 1}]"),
                        (1, "effects: [{type: motor, joint: b, torque: 1}]"), (1, "loops: [{name: l, type: coupling, coefficients: {a: 1, b: 1}}]"),
                        (1, "loops: [{name: l, type: motion, joint: b, position: {polynomial: [0, 1]}}]")):
        run = kinetree("view", "-", "--view", "s.html", "--duration", "0.1", "--quiet", folder=folder, text=f"kinetree: 1\nname: s\nbodies:\n{bodies}{text}\n")
        page.open(f"{folder}/s.html")
        counts = page.evaluate(SYMBOLS)
        faults += ([run.stderr] if run.returncode else []) + page.complaints()
        faults += [] if counts[layer][1] > counts[layer][0] and counts[1 - layer][0] == counts[1 - layer][1] else [f"{text}: {counts}"]
    claim("what_acts_in_joints_has_symbols", faults)


# Bushings that are under some pixel of the first picture.
BUSHINGS = """(() => {
    const page = window.kinetree, {width, height} = document.getElementById("picture");
    const seen = page.figure.pick(page.pose(), page.shown, width, height, 0, 0, width, height);
    return [...new Set(seen)].filter((n) => n > 0).map((n) => page.figure.things[n - 1].text).filter((text) => text.startsWith("bushing")).sort();
})()"""


def check_bushings(page, folder):
    """The mounts at the front of the engine and at its right are seen from where the view begins; the left one is behind it."""
    run = kinetree("view", f"{SCENES}/engine-mounts.yaml", "--duration", "0.02", "--quiet", folder=folder)
    page.resize(WIDTH, HEIGHT)
    page.open(f"{folder}/engine-mounts.html")
    found = page.evaluate(BUSHINGS)
    note(f"bushings that are seen: {found}")
    claim("bushings_are_seen_and_named", ([run.stderr] if run.returncode else []) + page.complaints() +
          ([] if "bushing mount_front between world and engine" in found and len(found) == 2 else [f"{found}"]))


FEET = """kinetree: 1
name: feet
bodies:
  - {name: crate, joint: {type: free, position: {position: [0, 0, 0.1]}}, mass: 1, shape: {type: box, size: [0.4, 0.4, 0.2]}}
effects:
  - {type: contact, point: {body: crate, at: [0.2, 0, -0.1]}, plane: world, stiffness: 1e4}
  - {name: heel, type: contact, point: {body: crate, at: [-0.2, 0, -0.1]}, plane: world, stiffness: 1e4}
  - {type: contact, point: {body: crate, at: [0, 0.2, -0.1]}, plane: world, stiffness: 1e4}
"""


def check_contact_names(page, folder):
    """Contacts without a name have names that differ: their places in the list of effects, as in records."""
    run = kinetree("view", "-", "--view", "feet.html", "--duration", "0.02", "--quiet", folder=folder, text=FEET)
    page.open(f"{folder}/feet.html")
    found = page.evaluate("""kinetree.figure.things.map((thing) => thing.text).filter((text) => text.startsWith("contact"))""")
    wanted = [f"contact {name} of crate and world" for name in ("effect[0]", "heel", "effect[2]")]
    claim("contacts_without_a_name_are_told_apart", ([run.stderr] if run.returncode else []) + page.complaints() + ([] if found == wanted else [f"{found}, wanted {wanted}"]))


HOSTILE = "</script><img src=x onerror=document.title='taken'>"


def check_names(page, folder):
    """A name is a name, whatever it looks like: that of a scene is free text."""
    scene = f"""kinetree: 1
name: "{HOSTILE}<!--<script>"
bodies:
  - name: rod
    joint: {{type: revolute, axis: z}}
    mass: 1
    shape: {{type: rod, to: [1, 0, 0]}}
"""
    run = kinetree("view", "-", "--duration", "1", "--quiet", folder=folder, text=scene)
    page.open(f"{folder}/scene.html")
    title = page.evaluate("[document.getElementById('title').textContent, document.images.length]")
    claim("hostile_names_do_nothing", ([run.stderr] if run.returncode else []) + page.complaints() +
          ([] if title == [HOSTILE + "<!--<script>", 0] else [f"title and images: {title}"]))


def check_sizes(path, long):
    """The page without its data, and ten seconds of the humanoid at 60 Hz."""
    text = pathlib.Path(path).read_text()
    bare = re.sub(r'(<script type="(?:application/json|text/plain)"[^>]*>)[^<]*', r"\1", text)
    note(f"bytes of the page, of the humanoid's ten seconds: {(len(bare), os.path.getsize(long))}")
    claim("page_is_small", [] if len(bare) < PAGE_BYTES else [f"{len(bare)} bytes"])
    claim("ten_seconds_of_the_humanoid_are_small", [] if os.path.getsize(long) < 2_000_000 else [f"{os.path.getsize(long)} bytes"])


def check_large(page, folder):
    """1,000 bodies: thirty pictures a second, or the page says what it leaves out."""
    scene = kinetree("make", "chain", "--links", "1000", folder=folder).stdout
    run = kinetree("view", "-", "--view", "long.html", "--duration", "0.05", "--interval", "5e-4", "--quiet", "--integrator", "rk4", "--step", "5e-4", folder=folder, text=scene)
    page.resize(WIDTH, HEIGHT)
    page.open(f"{folder}/long.html")
    page.evaluate("document.getElementById('repeat').click(); document.getElementById('play').click()")
    page.evaluate("new Promise((done) => setTimeout(done, 1500))")
    pace, notes = page.evaluate("[kinetree.pace, kinetree.notes.join(' ')]")
    note(f"1,000 bodies: pictures a second, notes: {(pace, notes)}")
    claim("a_thousand_bodies_play_or_say_so", ([run.stderr] if run.returncode else []) + page.complaints() +
          ([] if pace and (pace > 29 or "draws slowly" in notes) else [f"{pace} pictures a second, and no word"]))


def check_modes(page, folder):
    """Joints hold at three times the amplitude; a mode that is chosen moves, and after a period everything is where it was."""
    run = kinetree("modes", f"{SCENES}/fishing-rod.yaml", "--view", "modes.html", folder=folder)
    page.open(f"{folder}/modes.html")
    page.evaluate("kinetree.choose_mode(3), kinetree.modes.size = 3, 0")
    apart = page.evaluate("""(() => {const k = kinetree, at = (t) => { const p = new Float32Array(k.poses.length); k.pose_at(t, p); return p; };
        const poses = at(0.1 * k.times[1]), rest = k.modes.rest, start = at(0), end = at(k.times[1]);
        const far = (a, b) => Math.max(...k.data.bodies.map((_, i) => norm(sub([...a.subarray(8 * i, 8 * i + 3)], [...b.subarray(8 * i, 8 * i + 3)]))));
        const open = Math.max(...k.data.joints.map(({on, at: p, body}) => norm(sub(point_of(poses, on, p), [...poses.subarray(8 * body, 8 * body + 3)]))));
        return [open, far(poses, rest), far(start, end)]; })()""")
    note(f"joints open by {apart[0]:.1e} m, moved by {apart[1]:.2g} m, after a period off by {apart[2]:.1e} m")
    claim("modes_move_and_joints_hold", ([run.stderr] if run.returncode else []) + page.complaints() +
          ([] if apart[0] < 1e-5 and apart[1] > 0.1 and apart[2] < 1e-5 else [f"{apart}"]))


NEAR = """kinetree: 1
bodies: [{name: arm, joint: {type: revolute, velocity: 1}, mass: 1, inertia: [1, 1, 1]}]
events: [{name: passes the angle of half a radian for the first time after a very long way, when: position.arm > 0.5, then: record}]
simulate: {duration: 1}
output: {columns: {near: 84.0314 + 1e-4*position.arm}}
"""


def check_chart(page, folder):
    """Labels of nearly equal values differ, and a long name of an event is shortened, not squeezed."""
    run = kinetree("view", "-", "--view", "near.html", "--quiet", folder=folder, text=NEAR)
    page.open(f"{folder}/near.html")
    page.evaluate(PAINTED)
    drawn, columns = page.evaluate("""(() => {
        const chart = kinetree.chart, drawn = [], own = CanvasRenderingContext2D.prototype.fillText;
        chart.chosen = [kinetree.data.columns.findIndex((one) => one.name === "near")];
        CanvasRenderingContext2D.prototype.fillText = function (text, x, y, most) { drawn.push([text, this.textAlign, this.measureText(text).width, most ?? null]); };
        chart.paint(chart.theme);
        CanvasRenderingContext2D.prototype.fillText = own;
        return [drawn, kinetree.data.columns.map((one) => one.name)];
    })()""")
    names = [one for one in drawn if one[0].startswith("passes")]
    labels = [text for text, align, _, _ in drawn if align == "right" and not text.startswith("passes")]
    note(f"labels {labels}; names {names}")
    claim("labels_of_nearly_equal_values_differ", page.complaints() + ([run.stderr] if run.returncode else [])
          + ([] if len(labels) > 2 and len(set(labels)) == len(labels) and any("84.031" in one[0] and one[1] == "left" for one in drawn) else [f"{drawn}, {columns}"]))
    claim("names_of_events_are_shortened_in_charts", [] if len(names) == 1 and "\u2026" in names[0][0] and names[0][3] is None else [f"{names}"])


def check_long(page, folder):
    """100,000 frames."""
    run = kinetree("view", f"{SCENES}/pendulum.yaml", "--interval", "1e-4", "--duration", "10", "--quiet", folder=folder)
    page.open(f"{folder}/pendulum.html")
    frames = page.evaluate("kinetree.step(1e9), kinetree.motion.frames")
    claim("a_hundred_thousand_frames_load", ([run.stderr] if run.returncode else []) + page.complaints() + ([] if frames == 100001 else [f"{frames} frames"]))


def main():
    if browser.find() is None:
        skip("command/page", "Chromium is not on this machine")
        sys.exit(77)
    page = browser.Browser(WIDTH, HEIGHT)
    try:
        with tempfile.TemporaryDirectory() as folder:
            times = {}

            def timed(name, act, *words):
                start = time.monotonic()
                act(*words)
                times[name] = round(time.monotonic() - start, 1)

            kinetree("view", f"{SCENES}/four-bar.yaml", "--quiet", "--view", "page.html", folder=folder)
            kinetree("view", f"{SCENES}/humanoid.yaml", "--quiet", "--duration", "10", "--interval", repr(1 / 60), "--view", "ten.html", folder=folder)
            check_sizes(f"{folder}/page.html", f"{folder}/ten.html")
            timed("scenes", check_scenes, page, folder)
            timed("colours", check_colours, page, f"{folder}/page.html")
            timed("time", check_time, page, f"{folder}/page.html")
            timed("arrows", check_arrows, page, folder)
            timed("path", check_path, page, folder)
            timed("symbols", check_symbols, page, folder)
            timed("seen", check_seen, page, folder)
            timed("rest", check_rest, page, folder)
            timed("chart", check_chart, page, folder)
            timed("bushings", check_bushings, page, folder)
            timed("contacts", check_contact_names, page, folder)
            timed("names", check_names, page, folder)
            timed("large", check_large, page, folder)
            timed("modes", check_modes, page, folder)
            timed("long", check_long, page, folder)
            note(f"seconds: {times}")
    finally:
        page.close()
    finish()


main()
