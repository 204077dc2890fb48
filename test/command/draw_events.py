"""draw_events KINETREE SUPPRESSIONS [SEEDS]: subcommands that follow a motion follow that of `run`, with events and `until`.

Random scenes release and engage loops, set parameters, and stop. `run` to a time T gives a result, from which a second scene starts:
its picture at the start is the oracle for the picture that `draw --at T` makes of the first scene. The end of the run and the counts of
its events are compared with those of `sweep` and `view`. Subcommands that leave events out report it.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import json
import math
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE = sys.argv[1]
os.environ["LSAN_OPTIONS"] = f"print_suppressions=0:suppressions={sys.argv[2]}"
SEEDS = range(int(sys.argv[3]) if len(sys.argv) > 3 else 12)
NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")
DASHED = re.compile(r'stroke-dasharray(?::5,4;"|="5 4") d="([^"]*)"')  # of cairo 1.16 and of 1.18
# Positions differ by the tolerance of two runs, and numbers of pictures are cut after the second decimal.
BOUND = 0.05


def scene_of(seed):
    """A stone on a string and a pendulum with a spring, with random events; and a time within or behind the run."""
    r = random.Random(seed)
    cut, stiffer, caught = r.uniform(0.1, 0.9), r.uniform(0.2, 1.2), r.uniform(0.3, 1.5)
    events = [f"{{name: cut, when: t - {cut:.4f}, then: {{release: string}}}}"]
    if r.random() < 0.7:
        events.append(f"{{name: stiffer, when: t - {stiffer:.4f}, then: {{set: {{k: {r.uniform(20, 90):.3f}}}}}}}")
    if r.random() < 0.7:
        events.append(f"{{name: turned, when: position.arm - {r.uniform(-0.2, 0.2):.4f}, limit: {r.randint(1, 3)}, then: {{set: {{k: 1.5*k}}}}}}")
    if r.random() < 0.5:
        events.append(f"{{name: push, when: t - {caught:.4f}, then: {{engage: gust}}}}")
    if r.random() < 0.3:
        events.append(f"{{name: enough, when: t - {r.uniform(0.8, 2.0):.4f}, then: stop}}")
    until = r.choice(["", f', until: "marker.stone.c.y < {r.uniform(-4, -1):.3f}"', f', until: "t > {r.uniform(0.5, 1.6):.4f}"'])
    text = f"""kinetree: 1
name: random
gravity: [0, -9.81, 0]
parameters: {{k: {r.uniform(2, 30):.3f}}}
bodies:
  - {{name: stone, joint: {{type: planar, position: [1, 0, 0]}}, mass: 1, shape: {{type: box, size: [0.2, 0.1, 0.1]}}, markers: {{c: [0, 0, 0], side: [0.1, 0, 0]}}}}
  - {{name: arm, joint: {{type: revolute, at: [3, 0, 0], position: {r.uniform(0.4, 1.2):.3f}}}, mass: 1, shape: {{type: rod, to: [0, -1, 0]}}, markers: {{tip: [0, -1, 0]}}}}
loops:
  - {{name: string, type: distance, between: [world, stone.side], length: 1.1}}
effects:
  - {{name: spring, type: joint_spring, joint: arm, stiffness: =k}}
  - {{name: gust, type: force, at: stone.c, value: [{r.uniform(3, 9):.2f}, 0, 0], switched: off}}
events:
""" + "".join(f"  - {event}\n" for event in events) + f"""simulate: {{duration: 2, tolerance: 1e-10{until}}}
"""
    return text, r.choice([cut, stiffer, r.uniform(0.3, 2.0), r.uniform(0.3, 2.0), r.uniform(0.3, 2.0), 1.9])


def run(path, *words):
    ended = subprocess.run([KINETREE, *words], cwd=path, capture_output=True, text=True)
    return ended


def numbers_of(svg):
    """The picture without its texts: what is between its numbers, and these."""
    text = re.sub(r"<text.*?</text>\n", "", svg.read_text())
    return NUMBER.split(text), [float(n) for n in NUMBER.findall(text)]


def difference(a, b):
    """The largest distance of numbers of two pictures; infinite where they have other shapes."""
    (words, x), (others, y) = numbers_of(a), numbers_of(b)
    if words != others or len(x) != len(y):
        return float("inf")
    return max((abs(p - q) for p, q in zip(x, y)), default=0.0)


wrong, worst, stopped, released = [], 0.0, 0, 0
apart = []
for seed in SEEDS:
    text, time = scene_of(seed)
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder)
        (path / "a.yaml").write_text(text)
        ran = run(path, "run", "a.yaml", "--duration", f"{time:.17g}", "--out", "a.csv", "--summary", "a.json", "--quiet")
        if ran.returncode != 0:
            wrong.append(f"seed {seed}: run ends with {ran.returncode}: {ran.stderr}")
            continue
        summary = json.loads((path / "a.json").read_text())
        last = float(list(csv.DictReader((path / "a.csv").open(newline="")))[-1]["time"])
        stopped += last < time
        released += summary["events"]["cut"]
        (path / "b.yaml").write_text(text.replace("simulate:", "initial: {from: a.json}\nsimulate:"))
        drawn = run(path, "draw", "a.yaml", "--at", f"{time:.17g}", "--out", "a.svg")
        oracle = run(path, "draw", "b.yaml", "--out", "b.svg")
        if drawn.returncode or oracle.returncode:
            wrong.append(f"seed {seed}: draw ends with {drawn.returncode}, {oracle.returncode}: {drawn.stderr}{oracle.stderr}")
            continue
        off = difference(path / "a.svg", path / "b.svg")
        worst = max(worst, off)
        if not off < BOUND:
            wrong.append(f"seed {seed}: t = {time}: off by {off} of {BOUND}")
        if (last < time) != ("the run ends at" in drawn.stderr):
            wrong.append(f"seed {seed}: the end at {last} before {time}: {drawn.stderr}")
        # Other subcommands that follow the motion.
        run(path, "sweep", "a.yaml", "--set", f"simulate.duration={time:.17g}", "--vary", "gravity[0]=0:0:1", "--out", "s.csv", "--quiet")
        line = list(csv.DictReader((path / "s.csv").open(newline="")))[0]
        run(path, "view", "a.yaml", "--duration", f"{time:.17g}", "--view", "v.html", "--summary", "v.json", "--quiet")
        seen = json.loads((path / "v.json").read_text())
        counts = {name: int(line[f"event.{name}"]) for name in summary["events"] if name != "until"}
        if abs(float(line["time"]) - last) > 1e-9 or any(summary["events"][name] != count for name, count in counts.items()):
            apart.append(f"seed {seed}: sweep ends at {line['time']} with {counts}, run at {last} with {summary['events']}")
        if seen["events"] != summary["events"]:
            apart.append(f"seed {seed}: view has {seen['events']}, run {summary['events']}")
note(f"{len(SEEDS)} scenes, {stopped} of them ended by an event, {released} strings cut: off by {worst:.3f} of {BOUND}")
claim("draw_at_a_time_shows_the_state_that_run_records_there", wrong)
claim("random_scenes_are_stopped_and_released", [] if stopped > 1 and released > 2 else [f"{stopped}, {released}"])
claim("sweep_and_view_end_where_run_ends", apart)

PATH = re.compile(r' d="(M [^"]*)"')
with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder)
    text = scene_of(0)[0]
    (path / "a.yaml").write_text(text)
    left_out = []
    for words in (["stability", "a.yaml"], ["equilibrium", "a.yaml"], ["modes", "a.yaml", "--period", "1"]):
        said = run(path, *words).stderr
        if not re.search(r"event 'cut'( and others are| is) left out", said):
            left_out.append(f"{words}: {said}")
    claim("subcommands_without_events_report_it", left_out)
    # A run of two halves: what an event has set in the first one holds in the second.
    (path / "k.yaml").write_text("""kinetree: 1
parameters: {k: 5}
bodies: [{name: arm, joint: {type: revolute, position: 0.5}, mass: 1, inertia: [1, 1, 1]}]
effects: [{name: spring, type: joint_spring, joint: arm, stiffness: =k}]
events: [{name: stiffer, when: t - 0.3, limit: 1, then: {set: {k: 50}}}]
simulate: {duration: 1}
""")
    run(path, "run", "k.yaml", "--duration", "0.5", "--out", "half.csv", "--summary", "half.json", "--quiet")
    ends = []
    for words in (["--out", "whole.csv"], ["--duration", "0.5", "--from", "half.json", "--out", "rest.csv"]):
        ran = run(path, "run", "k.yaml", "--quiet", *words)
        rows = list(csv.DictReader((path / words[-1]).open(newline=""))) if ran.returncode == 0 else []
        ends.append(float(rows[-1]["position.arm"]) if rows else float("nan"))
    note(f"after 1 s: {ends[0]}, in two halves {ends[1]}")
    claim("what_events_have_set_holds_in_a_run_that_goes_on", [] if abs(ends[0] - ends[1]) < 1e-7 else [str(ends)])
    # An object that is let go at 0.5 s, and the end of the scene at y = -3: free fall from there.
    (path / "f.yaml").write_text("""kinetree: 1
gravity: [0, -9.81, 0]
bodies: [{name: stone, joint: {type: prismatic, axis: y}, mass: 1, shape: {type: sphere, radius: 0.05}, markers: {c: [0, 0, 0]}}]
loops: [{name: lock, type: coupling, coefficients: {stone: 1}, offset: 0}]
events: [{name: cut, when: t - 0.5, then: {release: lock}}]
simulate: {duration: 2, until: "position.stone < -3"}
""")
    end = 0.5 + (6 / 9.81) ** 0.5
    strobe = run(path, "draw", "f.yaml", "--strobe", "5", "--trace", "stone.c", "--out", "f.svg")
    words = re.findall(r">([^<]*)</text>", (path / "f.svg").read_text())
    claim("strobes_and_paths_end_with_the_run", [] if strobe.returncode == 0 and any(w.startswith(f"5 states from 0 to {end:.4g} s") for w in words) else [str(words), strobe.stderr])
    late = run(path, "draw", "f.yaml", "--at", "0,1,5,6", "--out", "l.svg")
    times = [w for w in re.findall(r">([0-9.]+) s</text>", (path / "l.svg").read_text())]
    claim("times_behind_the_end_of_a_run_are_reported", [] if late.returncode == 0 and times == ["0", "1", f"{end:.4g}"] and
          f"--at 6: the run ends at t = {end:.6g} s, by 'until'" in late.stderr else [str(times), late.stderr])
    (path / "g.yaml").write_text((path / "f.yaml").read_text().replace(', until: "position.stone < -3"', ""))
    behind = run(path, "draw", "g.yaml", "--at", "5", "--out", "g.svg")
    claim("times_behind_the_duration_are_reported", [] if behind.returncode == 0 and "--at 5 is after the end of the scene's run, 2 s" in behind.stderr else [behind.stderr])
    for words in (["--strobe", "3"], ["--animate"]):
        behind = run(path, "draw", "g.yaml", *words, "--until", "5", "--out", "g.svg")
        claim(f"{words[0][2:]}_behind_the_duration_is_reported",
              [] if behind.returncode == 0 and "--until 5 is after the end of the scene's run, 2 s" in behind.stderr else [behind.stderr])
    within = run(path, "draw", "g.yaml", "--at", "2", "--out", "g.svg")
    claim("times_within_it_are_not", [] if within.stderr.startswith("picture: g.svg\n") else [within.stderr])
    # A box that falls from rest. Its height, 1 m, is the scale of the picture. Numbers are cut at a tenth of a unit, and 1 m has 37 or more.
    (path / "h.yaml").write_text("""kinetree: 1
gravity: [0, 0, -9.81]
bodies: [{name: box, joint: {type: prismatic, axis: z}, mass: 1, shape: {type: box, size: [0.5, 0.5, 1]}}]
simulate: {duration: 1, tolerance: 1e-10}
""")
    outline, wrong, worst = re.compile(r"M ?([\d.]+) ([\d.]+) ?L ?\1 ([\d.]+) ?L ?([\d.]+) \3 ?L ?\4 \2 ?Z"), [], 0.0
    for end in (0.1, 0.2, 0.4, 0.5, 0.8, 1, 1.6):
        for words in (["--strobe", "4"], ["--strobe", "7"], ["--animate"]):
            run(path, "draw", "h.yaml", *words, "--until", str(end), "--out", "h.svg")
            ends = [(float(a), float(b)) for _, a, b, _ in outline.findall((path / "h.svg").read_text())]
            fallen = (max(ends[-1]) - max(ends[0])) / abs(ends[0][1] - ends[0][0])
            off = abs(fallen - 4.905 * end * end) / (1 + 4.905 * end * end)
            worst = max(worst, off)
            if not off < 0.01 or words[0] == "--strobe" and len(ends) != int(words[1]):
                wrong.append(f"{words} up to {end} s: {len(ends)} boxes, the last one {fallen} m below the first")
    note(f"the last state is off by {worst:.4f} of 0.01 of the height of the picture")
    claim("the_last_state_is_that_at_the_end_whatever_the_rounding", wrong)
    # A slack rope is drawn as a curve straight below its chord that is about as long as the rope, for a chord of 1 m or less. A taut rope is a straight line.
    wrong = []
    for x, z in ((1, 0), (-0.6, -0.3), (0, -0.5), (0.1, 0.8)):
        for length in ("1.0001", "1.25", "1 + 0.5*t", "2", None):
            chord = (x * x + z * z) ** 0.5
            (path / "rope.yaml").write_text(f"""kinetree: 1
gravity: [0, 0, -9.81]
bodies: [{{name: load, joint: {{type: planar, axis: y, position: [{-z}, {x}, 0]}}, mass: 1, shape: {{type: sphere, radius: 0.01}}}}]
loops: [{{name: rope, type: distance, between: [world, load], slack: true, restitution: 0{f', length: "{length}"' if length else ""}}}]
simulate: {{duration: 1}}
""")
            run(path, "draw", "rope.yaml", "--at", "0,0.001", "--out", "rope.svg")
            svg = (path / "rope.svg").read_text()
            drawn = [[float(n) for n in NUMBER.findall(d)] for d in DASHED.findall(svg)]
            page = [float(n) for n in re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', svg).groups()]
            expected = eval(length, {"t": 0}) if length else chord
            points = drawn[0] if drawn else []
            at = [points[k:k + 2] for k in range(0, len(points), 2)]
            if len(at) not in (2, 4):
                wrong.append(f"{(x, z)}, {length}: {drawn}")
                continue
            scale = math.dist(at[0], at[-1]) / chord
            if len(at) == 4:
                thirds = [at[0][0] + (at[3][0] - at[0][0]) * k / 3 for k in (1, 2)]
                if max(abs(p[0] - third) for p, third in zip(at[1:3], thirds)) > 0.01 * scale:
                    wrong.append(f"{(x, z)}, {length}: the rope does not hang straight down")
                curve = [[sum(w * p[k] for w, p in zip(((1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s * s * (1 - s), s**3), at)) for k in (0, 1)] for s in (i / 200 for i in range(201))]
                at = curve
                below = curve[100][1] - 0.5 * (curve[0][1] + curve[-1][1])
                if below < -0.01 * scale:
                    wrong.append(f"{(x, z)}, {length}: the rope rises by {-below / scale} m")
            if not all(0 < c < size for p in at for c, size in zip(p, page)):
                wrong.append(f"{(x, z)}, {length}: the rope leaves the page of {page}")
            found = sum(math.dist(p, q) for p, q in zip(at, at[1:])) / scale
            if not abs(found / max(expected, chord) - 1) < 0.01:
                wrong.append(f"{(x, z)}, {length}: {found} m are drawn, the rope has {expected} m")
    claim("slack_ropes_sag_and_taut_ropes_are_straight", wrong)
finish()
