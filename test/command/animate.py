"""animate KINETREE SCENES SUPPRESSIONS: `draw --animate` writes one SVG that moves by itself, and shows the motion of `run`.

Markers are crosses, whose middles are read from the values of their animation. The scale of the page and the records of `run` say where
they belong; only the origin of the page is free.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as tree

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE, SCENES = sys.argv[1], pathlib.Path(sys.argv[2])
os.environ["LSAN_OPTIONS"] = f"print_suppressions=0:suppressions={sys.argv[3]}"
SVG = "{http://www.w3.org/2000/svg}"
NUMBER = re.compile(r"-?[0-9]*\.?[0-9]+")
BYTES = 300000
# Ends of lines are rounded to a tenth of a unit of the page, after they were cut at a hundredth.
BOUND = 0.12
# The same for the difference of two ends from a pivot, of which each is rounded.
ROUNDINGS = 0.4
POST = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: arm, joint: {type: revolute, axis: z, velocity: 6.283185307179586}, mass: 1, markers: {m: [1, 0, 0]}, shape: {type: sphere, radius: 0.05, at: [1, 0, 0]}}
  - {name: post, joint: {type: fixed}, shape: {type: cylinder, radius: 0.3, length: 2}}
simulate: {duration: 1}
"""


def draw(folder, scene, *words):
    """The picture, as text and as a tree, and what the command said."""
    out = pathlib.Path(folder) / "moving.svg"
    ended = subprocess.run([KINETREE, "draw", scene, "--animate", "--out", out, *words], cwd=folder, capture_output=True, text=True)
    text = out.read_text() if ended.returncode == 0 else ""
    return text, tree.fromstring(text.encode()) if text else None, ended


def frames_of(path):
    """The values of the shape of a path at all frames; one where it does not move."""
    for animate in path.iter(SVG + "animate"):
        if animate.get("attributeName") == "d":
            return animate.get("values").split(";")
    return [path.get("d")]


def crosses_of(root):
    """The middles of the crosses, at all frames: a line across, and behind it a line down through its middle."""
    paths = [path for path in root.iter(SVG + "path") if path.get("stroke-width") == "1.1"]
    found = []
    for across, down in zip(paths, paths[1:]):
        a, b = ([[float(x) for x in NUMBER.findall(d)] for d in frames_of(path)] for path in (across, down))
        if len(a) != len(b) or any(len(x) != 4 or len(y) != 4 for x, y in zip(a, b)):
            continue
        if all(abs(p[1] - p[3]) < 0.2 and abs(q[0] - q[2]) < 0.2 and abs((p[0] + p[2]) / 2 - q[0]) < 0.2 for p, q in zip(a, b)):
            found.append([((p[0] + p[2]) / 2, (q[1] + q[3]) / 2) for p, q in zip(a, b)])
    return found


def scale_of(root):
    """Units of the page a metre, of the bar at the lower right."""
    words = ["".join(text.itertext()) for text in root.iter(SVG + "text")]
    length = next(float(word.split()[0]) * {"m": 1, "mm": 1e-3, "km": 1e3}[word.split()[1]] for word in words if re.fullmatch(r"[0-9.e-]+ (m|mm|km)", word))
    for path in root.iter(SVG + "path"):
        numbers = [float(x) for x in NUMBER.findall(path.get("d"))]
        if path.get("stroke-width") == "1.2" and len(numbers) == 12 and path.get("d").count("M") == 3:
            return (numbers[6] - numbers[4]) / length
    return float("nan")


def records_of(folder, scene, marker, seconds, count):
    """Where `run` has a marker at as many instants."""
    out = pathlib.Path(folder) / "records.csv"
    subprocess.run([KINETREE, "run", scene, "--duration", str(seconds), "--interval", f"{seconds / (count - 1):.17g}", "--markers", marker, "--out", out, "--quiet"],
                   cwd=folder, check=True, capture_output=True)
    return [(float(row[f"marker.{marker}.x"]), float(row[f"marker.{marker}.y"])) for row in csv.DictReader(out.open(newline=""))][:count]


def largest_distance(places, records, scale):
    """Of crosses from records, with the origin of the page where both agree in the mean."""
    x = sum(p[0] - scale * r[0] for p, r in zip(places, records)) / len(places)
    y = sum(p[1] + scale * r[1] for p, r in zip(places, records)) / len(places)
    return max(max(abs(p[0] - scale * r[0] - x), abs(p[1] + scale * r[1] - y)) for p, r in zip(places, records))


# Two rods of equal length and width, which cross each other in the picture.
RODS = """kinetree: 1
gravity: [0, -9.81, 0]
bodies:
  - {name: upper, mass: 1, shape: {type: rod, to: [0, -1, 0]}, markers: {end: [0, -1, 0]}, joint: {type: revolute, axis: z, position: 120 deg}}
  - {name: lower, parent: upper, mass: 1, shape: {type: rod, to: [0, -1, 0]}, markers: {tip: [0, -1, 0]}, joint: {type: revolute, axis: z, at: [0, -1, 0], position: 30 deg}}
simulate: {duration: 10}
"""


def rods_of(root):
    """The ends of each drawn line at all frames: those of lines that move and have the width of a body."""
    paths = [path for path in root.iter(SVG + "path") if float(path.get("stroke-width") or 0) > 3]
    frames = [[[float(x) for x in NUMBER.findall(d)] for d in frames_of(path)] for path in paths]
    return [f for f in frames if len(f) > 1 and all(len(ends) == 4 for ends in f)]


def check_between_frames(folder):
    """In the middle between two key frames, a viewer shows the mean of both. There, each drawn rod is the mean of the rod that `run` has
    in these frames. Elements that exchange their bodies would show the mean of different rods."""
    seconds = 5
    pathlib.Path(folder, "rods.yaml").write_text(RODS)
    _, root, ended = draw(folder, "rods.yaml", "--until", str(seconds))
    rods = rods_of(root) if root is not None else []
    if not rods:
        return claim("rods_keep_their_pins_between_key_frames", ["no line moves: " + ended.stderr])
    count, scale, worst = len(rods[0]), scale_of(root), 0.0
    ends, tips = (records_of(folder, "rods.yaml", marker, seconds, count) for marker in ("upper.end", "lower.tip"))
    x, y = rods[0][0][0], rods[0][0][1]
    held = [[(x, y, x + scale * e[0], y - scale * e[1]), (x + scale * e[0], y - scale * e[1], x + scale * t[0], y - scale * t[1])] for e, t in zip(ends, tips)]
    for k in range(count - 1):
        expected = [[(a + b) / 2 for a, b in zip(*pair)] for pair in zip(held[k], held[k + 1])]
        for rod in rods:
            drawn = [(a + b) / 2 for a, b in zip(rod[k], rod[k + 1])]
            worst = max(worst, min(max(abs(a - b) for a, b in zip(drawn, e)) for e in expected))
    note(f"{len(rods)} lines, {count} frames: off by {worst:.3f} between frames, bound {ROUNDINGS}")
    claim("rods_keep_their_pins_between_key_frames", [] if worst < ROUNDINGS else [f"a rod of {scale:.0f} units is off by {worst:.1f}"])


# A stone on a string that is cut: the string is drawn as long as it holds.
CUT = """kinetree: 1
gravity: [0, -9.81, 0]
bodies: [{name: stone, joint: {type: planar, position: [1, 0, 0]}, mass: 1, shape: {type: sphere, radius: 0.05}, markers: {c: [0, 0, 0]}}]
loops: [{name: string, type: distance, between: [world, stone], length: 1}]
events: [{name: cut, when: t - 0.5, then: {release: string}}]
simulate: {duration: 3, until: "marker.stone.c.y < -3"}
"""

with tempfile.TemporaryDirectory() as folder:
    check_between_frames(folder)
    for name, markers, seconds in (("double-pendulum", ["upper.bob", "lower.bob"], 5), ("four-bar", ["crank.tip", "coupler.middle", "rocker.tip"], 4)):
        scene = SCENES / f"{name}.yaml"
        text, root, ended = draw(folder, scene, "--until", str(seconds), "--names")
        if root is None:
            claim(f"{name}_is_drawn", [ended.stderr])
            continue
        note(f"{name}: {len(text)} bytes of {BYTES}")
        claim(f"{name}_is_small_and_has_no_script", [] if len(text) < BYTES and "<script" not in text and "javascript" not in text and " on" not in re.sub(r">[^<]*<", "><", text)
              else [f"{len(text)} bytes"])
        claim(f"{name}_is_light_or_dark_as_its_page", [] if "prefers-color-scheme:dark" in text and "{fill:#ffffff}" in text and "{fill:#0d1117}" in text else [text[:900]])
        durations = {float(a.get("dur")[:-1]) for a in root.iter(SVG + "animate")}
        counts = {len(a.get("values").split(";")) for a in root.iter(SVG + "animate")}
        claim(f"{name}_plays_in_real_time_for_ever", [] if durations == {float(seconds)} and all(a.get("repeatCount") == "indefinite" for a in root.iter(SVG + "animate"))
              and len(counts) == 1 and min(counts) > 8 * seconds else [f"{durations} {counts}"])
        count = max(counts)
        scale = scale_of(root)
        crosses = crosses_of(root)
        best = {}
        for marker in markers:
            records = records_of(folder, scene, marker, seconds, count)
            best[marker] = min((largest_distance(c, records, scale) for c in crosses if len(c) == len(records)), default=float("inf"))
        note(f"{name}: {count} frames, {len(crosses)} crosses, off by {best} of {BOUND}")
        claim(f"markers_of_{name}_are_where_run_has_them", [] if all(off < BOUND for off in best.values()) else [str(best)])
    fast, root, _ = draw(folder, SCENES / "four-bar.yaml", "--until", "4", "--speed", "2")
    claim("speed_is_times_real_time", [] if root is not None and {a.get("dur") for a in root.iter(SVG + "animate")} == {"2s"} else [fast[:300]])
    pathlib.Path(folder, "cut.yaml").write_text(CUT)
    text, root, ended = draw(folder, "cut.yaml", "--trace", "stone.c")
    scenes = [] if root is None else [g for g in root.iter(SVG + "g") if g.get("visibility")]
    dashed = [sum("stroke-dasharray" in path.attrib and path.get("pathLength") is None for path in g.iter(SVG + "path")) for g in scenes]
    last = float(re.search(r">0 to ([0-9.]+) s", text).group(1)) if text else float("nan")
    times = [animate.get("keyTimes").split(";") for g in scenes for animate in g.findall(SVG + "animate")]
    note(f"string: {dashed} dashed lines, {times} of {last} s")
    claim("what_is_released_is_seen_no_longer", [] if dashed == [1, 0] and abs(float(times[0][1]) * last - 0.5) < 0.05 and times[0][1] == times[1][1] else [str(dashed), str(times)])
    claim("the_animation_ends_with_the_run", [] if abs(last - 1.003) < 1e-3 else [str(last)])
    grown = [] if root is None else [[float(x) for x in a.get("values").split(";")] for a in root.iter(SVG + "animate") if a.get("attributeName") == "stroke-dashoffset"]
    claim("a_path_grows_with_the_motion", [] if grown and all(v[0] == 1 and v[-1] == 0 and v == sorted(v, reverse=True) for v in grown) else [str(grown)[:200]])
    # A ball runs around a post, away from the viewer at first: dashes are in front of the post in the second half alone. In the first,
    # the path is in front of the ball itself, by less than the radius of the ball: 0.05 m of 4.6 m.
    pathlib.Path(folder, "post.yaml").write_text(POST)
    text, root, ended = draw(folder, "post.yaml", "--trace", "arm.m", "--view", "0,25")
    fronts = [] if root is None else [a for a in root.iter(SVG + "animate") if a.get("attributeName") == "stroke-dasharray"]
    dashes = [(float(time), sum(float(x) for x in value.split()[2:-1:2])) for a in fronts
              for time, value in list(zip(a.get("keyTimes").split(";"), a.get("values").split(";")))[1:]]
    far, near = [d for time, d in dashes if time < 0.7], [d for time, d in dashes if time > 0.85]
    note(f"{len(fronts)} scenes with dashes in front of the post, the last with {near[-1:]} of the path")
    claim("a_path_is_before_what_it_passes_in_front_of", [] if near and max(far, default=0) < 0.01 and min(near) > 0.1 else [str(dashes)[:300] + ended.stderr])
    grown = [] if root is None else [[float(x) for x in a.get("values").split(";")] for a in root.iter(SVG + "animate") if a.get("attributeName") == "stroke-dashoffset"]
    # The arc of an ellipse with the axes 1 and sin(25 degrees), from its far end, after a part of a turn.
    steps = [math.hypot(math.sin(a), math.sin(math.radians(25)) * math.cos(a)) for a in (2 * math.pi * (i + 0.5) / 3600 for i in range(3600))]
    off = max((abs(1 - value - sum(steps[: 3600 * k // (len(grown[0]) - 1)]) / sum(steps)) for k, value in enumerate(grown[0])), default=1) if grown else 1
    note(f"the length of the path is off by {off:.2g} of the whole")
    claim("a_path_grows_as_it_is_seen", [] if off < 2e-3 else [str(grown)[:200]])
    for words, told in ((["--at", "1"], "leave out --at and --strobe"), (["--out", "a.bmp"], "ends in .svg"), ):
        rejected = subprocess.run([KINETREE, "draw", "cut.yaml", "--animate", *words], cwd=folder, capture_output=True, text=True)
        claim(f"rejected_with_{words[0][2:]}", [] if rejected.returncode == 1 and told in rejected.stderr else [rejected.stderr])
    slow = subprocess.run([KINETREE, "draw", "cut.yaml", "--speed", "2"], cwd=folder, capture_output=True, text=True)
    claim("a_speed_needs_an_animation", [] if slow.returncode == 1 and "--animate goes with it" in slow.stderr else [slow.stderr])
finish()
