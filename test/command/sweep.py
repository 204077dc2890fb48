#!/usr/bin/env python3
"""Sweeps: what runs there are, what their lines say against closed forms, and the same bytes by threads, parts and breaks.

sweep.py COMMAND [--fewer]

--fewer: smaller sweeps, as sanitizers need no large ones.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import math
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

from swept import BOUNCE, FALL, check, command, fewer, finish, rows, run, same


def grids():
    lines = rows(run("fall.yaml", "--vary", "g=1:3:3", "--vary", "m=log:1:100:3", "--out", "-").stdout)
    same("runs of a grid", len(lines), 9)
    same("the last axis runs fastest", [(float(l["g"]), round(float(l["m"]), 9)) for l in lines[:4]],
         [(1.0, 1.0), (1.0, 10.0), (1.0, 100.0), (2.0, 1.0)])
    worst = max(abs(float(l["position.stone.end"]) + float(l["g"]) * 2.0) for l in lines)
    check("z = -g t^2 / 2, m", worst, 1e-12)
    worst = max(abs(float(l["energy.kinetic.max"]) - 0.5 * float(l["m"]) * (2 * float(l["g"])) ** 2) / float(l["m"]) for l in lines)
    check("kinetic energy at the end, J/kg", worst, 1e-11)
    lines = rows(run("fall.yaml", "--vary", "m=1,2.5,1e3", "--columns", "position.stone", "--out", "-").stdout)
    one = run("fall.yaml", "--vary", "g=1:3:1", "--out", "-")
    same("a range of one value", ([float(l["g"]) for l in rows(one.stdout)], "a range of one value is its first end" in one.stderr), ([1.0], True))
    same("a list", [float(l["m"]) for l in lines], [1.0, 2.5, 1000.0])
    same("columns", list(lines[0])[7:], ["position.stone.end", "position.stone.min", "position.stone.max"] + ["why"])


def samples():
    lines = rows(run("fall.yaml", "--vary", "g=1:2", "--vary", "m=1:2", "--sample", "sobol:255", "--columns", "position.stone", "--out", "-").stdout)
    points = [(float(l["g"]) - 1, float(l["m"]) - 1) for l in lines] + [(0.0, 0.0)]  # the first point of the sequence is left out
    for bits in range(9):  # a (0, 2)-sequence: of 2^8 points one in each elementary interval of area 2^-8
        cells = {(int(x * 2 ** bits), int(y * 2 ** (8 - bits))) for x, y in points}
        same(f"Sobol: elementary intervals {2 ** bits} x {2 ** (8 - bits)}", len(cells), 256)
    lines = rows(run("fall.yaml", "--vary", "g=1:2", "--vary", "m=log:1:16", "--sample", "latin:64", "--seed", "3", "--columns", "position.stone", "--out", "-").stdout)
    same("Latin hypercube: strata of g", len({int((float(l["g"]) - 1) * 64) for l in lines}), 64)
    same("Latin hypercube: strata of log m", len({int(math.log(float(l["m"]), 16) * 64) for l in lines}), 64)
    text = run("fall.yaml", "--random", "g=normal(9.81,0.5)", "--random", "m=lognormal(0,0.25)", "--repeats", "2000", "--seed", "1", "--columns", "position.stone", "--out", "-").stdout
    lines = rows(text)
    values = [float(l["g"]) for l in lines]
    mean = sum(values) / len(values)
    check("normal: mean, in its deviations", abs(mean - 9.81) / (0.5 / math.sqrt(2000)), 4)
    deviation = math.sqrt(sum((v - mean) ** 2 for v in values) / len(values))
    check("normal: deviation", abs(deviation / 0.5 - 1), 4 / math.sqrt(4000))
    logs = [math.log(float(l["m"])) for l in lines]
    check("lognormal: deviation", abs(math.sqrt(sum(v * v for v in logs) / len(logs)) / 0.25 - 1), 4 / math.sqrt(4000))
    correlation = sum((v - mean) * w for v, w in zip(values, logs)) / len(logs) / deviation / 0.25
    check("two random values are independent", abs(correlation), 4 / math.sqrt(2000))
    pathlib.Path("cases.csv").write_text("m,g\n1,2\n3,4\n5,6\n")
    lines = rows(run("fall.yaml", "--from", "cases.csv", "--out", "-").stdout)
    same("a table", [(l["m"], l["g"]) for l in lines], [("1", "2"), ("3", "4"), ("5", "6")])


def angles():
    """Values with units are those of --set, to the bit; an angle is no mass."""
    pathlib.Path("hinge.yaml").write_text("""kinetree: 1
parameters: {tilt: 30 deg}
gravity: [0, -9.81, 0]
bodies: [{name: arm, joint: {type: revolute, position: =tilt}, mass: 2, com: [1, 0, 0], inertia: [0.1, 0.1, 0.1]}]
simulate: {duration: 1}
""")
    ends = []
    for value in ("10 deg", "60 deg"):
        subprocess.run([command, "run", "hinge.yaml", "--set", f"tilt={value}", "--record", "position", "--quiet", "--out", "a.csv"], check=True)
        ends.append(rows(pathlib.Path("a.csv").read_text())[-1]["position.arm"])
    for words in (["tilt=10 deg,60 deg"], ["bodies.arm.joint.position=10 deg, 60 deg"], ["tilt=10 deg:60 deg:2"], ["tilt=log:10 deg:60 deg:2"], ["tilt=0.17453292519943295 rad,60 deg"]):
        lines = rows(run("hinge.yaml", "--vary", *words, "--one-by-one", "--columns", "position.arm", "--out", "-").stdout)
        same(f"ends of {words}", [l["position.arm.end"] for l in lines], ends)
        same("its values are in radians", float(lines[0][words[0].partition("=")[0]]), 0.17453292519943295)
    values = [float(l["tilt"]) for l in rows(run("hinge.yaml", "--random", "tilt=uniform(10 deg,20 deg)", "--repeats", "20", "--quiet", "--out", "-").stdout)]
    same("random angles", all(0.17 < v < 0.35 for v in values) and len(values) == 20, True)
    told = run("hinge.yaml", "--vary", "bodies.arm.mass=10 deg,60 deg", "--out", "-", code=2).stderr
    same("an angle is no mass", "found the angle" in told, True)
    pathlib.Path("angles.csv").write_text("tilt\n10 deg\n60 deg\n")
    lines = rows(run("hinge.yaml", "--from", "angles.csv", "--one-by-one", "--columns", "position.arm", "--out", "-").stdout)
    same("angles of a table", [l["position.arm.end"] for l in lines], ends)
    for words in (["--vary", "tilt=10:60 deg:3"], ["--vary", "tilt=10 deg:60:3"], ["--vary", "tilt=10 deg,20,30 deg"], ["--random", "tilt=normal(1,2 deg)"]):
        told = run("hinge.yaml", *words, "--out", "-", code=1).stderr
        same(f"units of some values only: {words[1]}", "tilt: some values are angles with a unit" in told, True)
    same("zero needs no unit", len(rows(run("hinge.yaml", "--vary", "tilt=0:60 deg:3", "--out", "-").stdout)), 3)
    pathlib.Path("angles.csv").write_text("tilt\n10 deg\n60\n")
    same("nor in a table", "angles.csv tilt: some values are" in run("hinge.yaml", "--from", "angles.csv", "--out", "-", code=2).stderr, True)
    pathlib.Path("angles.csv").write_text("bodies.arm.mass [kg],tilt [deg]\n1,10\n")
    told = run("hinge.yaml", "--from", "angles.csv", "--out", "-", code=2).stderr
    same("a name with a unit", "angles.csv:1: 'bodies.arm.mass [kg]': names of values that vary have no unit; write 'bodies.arm.mass'" in told, True)
    pathlib.Path("angles.csv").write_text(" bodies.arm.com[0] , tilt \n1,10 deg\n")
    same("blanks around names", list(rows(run("hinge.yaml", "--from", "angles.csv", "--out", "-").stdout)[0])[1:3], ["bodies.arm.com[0]", "tilt"])
    for more, count in (([], 1), (["--quiet"], 0)):
        told = run("hinge.yaml", "--vary", "tilt=10:60:3", "--out", "-", *more).stderr
        same(f"whole radians are warned of {count} times", told.count("10 is in radians, 1.59 turns. Write '10 deg'"), count)
    told = run("hinge.yaml", "--vary", "tilt=0.1,0.2,10,0.3", "--out", "-").stderr
    same("whole radians of a later run", told.count("10 is in radians, 1.59 turns. Write '10 deg'"), 1)
    told = run("hinge.yaml", "--vary", "tilt=0,0.2,60", "--set", "bodies.arm.joint.rotation={axis: [0, 0, 1], angle: 45}", "--out", "-").stderr
    same("radians that vary beside others", [told.count(f"{x} is in radians") for x in (45, 60)], [1, 1])


def other_columns():
    """Lines with other columns are rejected in words."""
    text = run("fall.yaml", "--vary", "g=1:2:30", "--quiet", "--out", "-").stdout
    other = text.replace(",why", ",lanes,why")
    pathlib.Path("own.csv").write_text(text)
    pathlib.Path("other.csv").write_text(other)
    told = run("--merge", "own.csv", "other.csv", "--out", "both.csv", code=1).stderr
    same("such parts are not merged", "has other columns than" in told and "the first part" in told, True)
    pathlib.Path("f.csv.partial").write_text(other)
    told = run("fall.yaml", "--vary", "g=1:2:30", "--resume", "--out", "f.csv", code=1).stderr
    same("nor continued", "has other columns than" in told and "this sweep" in told, True)
    pathlib.Path("f.csv.partial").write_text("".join(text.splitlines(keepends=True)[:10]))
    told = run("fall.yaml", "--vary", "g=1:2:31", "--resume", "--out", "f.csv", code=1).stderr
    same("nor by a sweep that agrees in the first run alone", "run 1 has another number or other values in" in told, True)
    run("fall.yaml", "--vary", "g=1:2:30", "--quiet", "--resume", "--out", "f.csv")
    same("lines of its own kind are", [r["g"] for r in rows(pathlib.Path("f.csv").read_text())], [r["g"] for r in rows(text)])


def bytes_of(*arguments):
    run("fall.yaml", *arguments, "--quiet", "--out", "x.csv")
    return pathlib.Path("x.csv").read_bytes()


def parts_of_other_sweeps():
    """FILE.shard names the sweep: lines of other values, scenes or settings are not joined."""
    def part(k, out, *arguments):
        run("fall.yaml", *arguments, "--quiet", "--shard", f"{k}/3", "--out", out)
    grid = ["--vary", "g=1:2:7"]
    part(1, "a1.csv", *grid)
    for k, other in enumerate((["--vary", "g=5:6:7"], ["--vary", "g=log:1:2:7"], ["--vary", "g=1:2:8"], ["--vary", "g=1:2:7", "--set", "m=2"],
                               ["--random", "g=uniform(1,2)", "--repeats", "7"])):
        part(2, "other.csv", *other)
        told = run("--merge", "a1.csv", "other.csv", "--out", "joined.csv", code=1).stderr
        same(f"part {k} is of another sweep", "other.csv is a part of another sweep than a1.csv" in told, True)
        same("nothing is written", pathlib.Path("joined.csv").exists(), False)
    text = pathlib.Path("fall.yaml").read_text()
    pathlib.Path("fall.yaml").write_text(text + "# another scene\n")
    part(2, "other.csv", *grid)
    pathlib.Path("fall.yaml").write_text(text)
    same("and so is one of another scene", "another sweep" in run("--merge", "a1.csv", "other.csv", "--out", "joined.csv", code=1).stderr, True)
    told = run("--merge", "a1.csv", "--out", "joined.csv", code=4).stderr
    same("one part alone lacks the others", "5 of 7 runs are in none of the parts, from run 2 on; joined.csv has the others" in told, True)
    pathlib.Path("a1.csv.shard").rename("kept.shard")
    told = run("--merge", "a1.csv", "--out", "joined.csv").stderr
    same("without FILE.shard nothing is known", "there is no a1.csv.shard: whether" in told, True)
    shutil.copy("other.csv", "a1.csv")
    shutil.copy("kept.shard", "a1.csv.shard")
    same("FILE.shard of another part", "a1.csv has run 2, and a1.csv.shard lists the runs 0 to 1" in run("--merge", "a1.csv", "--out", "x.csv", code=1).stderr, True)
    pathlib.Path("a1.csv.shard").write_text("{}")
    same("FILE.shard that is no such file", "does not name the runs" in run("--merge", "a1.csv", "--out", "x.csv", code=2).stderr, True)
    run("fall.yaml", *grid, "--quiet", "--out", "a1.csv")
    same("a whole sweep has no FILE.shard", pathlib.Path("a1.csv.shard").exists(), False)


def equal_bytes():
    sweep = ["--vary", "g=1:2:301", "--random", "m=uniform(1,2)"]
    whole = bytes_of(*sweep, "--jobs", "1")
    same("four threads", bytes_of(*sweep, "--jobs", "4") == whole, True)
    for k in (1, 2, 3):
        run("fall.yaml", *sweep, "--quiet", "--shard", f"{k}/3", "--out", f"part{k}.csv")
    run("--merge", "part3.csv", "part1.csv", "part2.csv", "--out", "merged.csv")
    same("three parts", pathlib.Path("merged.csv").read_bytes() == whole, True)
    runs = len(whole.splitlines()) - 1
    for parts, missing, first in (((3, 1), runs // 3, runs // 3), ((1, 2), runs - 2 * runs // 3, 2 * runs // 3)):
        told = run("--merge", *(f"part{k}.csv" for k in parts), "--out", "merged.csv", code=4).stderr
        same("runs in no part are an error", f"{missing} of {runs} runs are in none of the parts, from run {first} on" in told, True)
    run("--merge", "merged.csv", "part3.csv", "--out", "twice.csv")  # parts that were merged are a part
    same("merged twice", pathlib.Path("twice.csv").read_bytes() == whole, True)
    for cut in (40, len(whole) // 3, len(whole) - 5):  # within the first line, a line, the last one
        pathlib.Path("x.csv").unlink(missing_ok=True)
        pathlib.Path("x.csv.partial").write_bytes(whole[:cut])
        same(f"broken off after {cut} bytes", bytes_of(*sweep, "--resume") == whole, True)
    pathlib.Path("x.csv").unlink()
    pathlib.Path("x.csv.partial").write_bytes(whole[:len(whole) // 3])
    told = run("fall.yaml", *sweep, "--set", "simulate.duration=1", "--resume", "--out", "x.csv", code=1).stderr
    same("another scene is rejected", "belongs to another scene or sweep" in told, True)


PENDULUM = """kinetree: 1
parameters: {a: 1, b: 2, tolerance: 1e-8}
gravity: [0, -9.81, 0]
bodies:
  - {name: upper, joint: {type: revolute, position: =a}, mass: 1, com: [0, -1, 0], inertia: [0, 0, 0]}
  - {name: lower, parent: upper, joint: {type: revolute, at: [0, -1, 0], position: =b}, mass: 1, com: [0, -1, 0], inertia: [0, 0, 0]}
simulate: {duration: 1, tolerance: =tolerance}
output: {columns: {both: position.upper + position.lower}}
"""


def lanes():
    """Runs that start elsewhere, or have other masses, are computed in lanes: each has the bytes that it has as the only one of a part."""
    pathlib.Path("pendulum.yaml").write_text(PENDULUM)
    starts = 2 if fewer else 6
    runs = 2 * starts
    sweep = ["pendulum.yaml", "--vary", f"a=0.5:2:{starts}", "--vary", "tolerance=1e-9,1e-4"]
    told = run(*sweep, "--jobs", "1", "--out", "lanes.csv").stderr
    same("all in lanes", f"{runs} of them in lanes" in told and "one by one" not in told, True)
    for k in range(runs):
        run(*sweep, "--quiet", "--shard", f"{k + 1}/{runs}", "--out", f"one{k}.csv")
    run("--merge", *(f"one{k}.csv" for k in range(runs)), "--out", "ones.csv")
    same("the bytes of single runs", pathlib.Path("lanes.csv").read_bytes() == pathlib.Path("ones.csv").read_bytes(), True)
    four_bar = str(pathlib.Path(__file__).parents[2] / "apps/scenes/four-bar.yaml")
    for scene, body in (("pendulum.yaml", "upper"), (four_bar, "crank")):
        sweep = [scene, "--vary", f"bodies.{body}.mass=1:7:3", "--vary", "gravity[1]=-1,-9", "--set", "simulate.duration=0.5"]
        told = run(*sweep, "--jobs", "1", "--out", "lanes.csv").stderr
        same("all in lanes", "6 of them in lanes" in told and "one by one" not in told, True)
        run(*sweep, "--quiet", "--shard", "4/6", "--out", "one.csv")
        same("the bytes of a single run", pathlib.Path("lanes.csv").read_text().split("\n")[4],
             pathlib.Path("one.csv").read_text().split("\n")[1])
    told = run("pendulum.yaml", "--vary", "a=0.5,1", "--jobs", "8", "--out", "x.csv").stderr
    same("threads without runs do not count", "2 of them in lanes, up to" in told and "up to 0 at" not in told, True)
    told = run("pendulum.yaml", "--vary", "bodies.upper.joint.armature=1,2", "--jobs", "1", "--out", "x.csv").stderr
    same("why others are not", "one by one, not in lanes: its model differs" in told, True)
    loop = ["--set", "effects=[{type: joint_spring, joint: close, stiffness: 3}]", "--set", "simulate.duration=0.1"]
    told = run(four_bar, *loop, "--vary", "gravity[1]=-1,-9", "--jobs", "1", "--out", "x.csv").stderr
    same("an effect in a loop", "one by one, not in lanes: it has loops" in told, True)
    stop = ["--set", "effects=[{type: joint_limit, joint: upper, lower: -0.1, restitution: 0}]", "--set", "simulate.duration=0.5"]
    told = run("pendulum.yaml", *stop, "--vary", "bodies.upper.mass=1,2", "--jobs", "1", "--out", "x.csv").stderr
    same("a hard stop", "one by one, not in lanes: it has hard contacts, stops or slack ropes" in told, True)
    told = run("pendulum.yaml", "--vary", "bodies.upper.mass=1,-1,-2", "--jobs", "1", "--out", "x.csv").stderr
    same("why the first failed", "2 of them failed\n  the first failure: bodies.upper.mass=-1: body 'upper': mass is -1; it cannot be negative "
         "(the column 'why' has all reasons)\n" in told, True)


EVENTFUL = """kinetree: 1
parameters: {a: 1, k: 2}
gravity: [0, -9.81, 0]
bodies:
  - {name: upper, joint: {type: revolute, position: =a}, mass: 1, com: [0, -1, 0], inertia: [0, 0, 0]}
  - {name: lower, parent: upper, joint: {type: revolute, at: [0, -1, 0]}, mass: 1, com: [0, -1, 0], inertia: [0, 0, 0], markers: {tip: [0, -1, 0]}}
states: {lag: {rate: "position.lower - 3*lag"}}
effects:
  - {type: expression, joint: lower, force: "-k*lag*max(sin(9*t), 0.1)"}
  - {type: joint_limit, joint: upper, upper: 0.5, stiffness: 100, damping: 1}
events:
  - {name: turn, when: velocity.lower, then: {set: {k: "1.1*k"}}}
  - {name: low, when: "marker.lower.tip.y < -1.9", then: record}
simulate: {duration: 2, tolerance: 1e-8, until: "marker.lower.tip.x > 1.3"}
output: {columns: {strength: k*lag}}
"""


def eventful():
    """Runs with events, what these set, formulas, auxiliary states and stops are computed in lanes: the bytes of one by one."""
    pathlib.Path("eventful.yaml").write_text(EVENTFUL)
    scenes = pathlib.Path(__file__).parents[2] / "apps/scenes"
    for scene, axis in (("eventful.yaml", "a=0.5:2:12"), ("eventful.yaml", "bodies.lower.mass=1:2:9"), ("bounce.yaml", "v=1:9:9"),
                        (str(scenes / "lugre.yaml"), "simulate.tolerance=1e-9,1e-8,1e-7,1e-6"), (str(scenes / "furuta-pendulum.yaml"), "gravity[2]=-5:-9:5")):
        sweep = [scene, "--vary", axis, "--set", "simulate.duration=2"]
        told = run(*sweep, "--jobs", "1", "--out", "lanes.csv").stderr
        same(f"{axis}: all in lanes", "of them in lanes" in told and "one by one" not in told, True)
        told = run(*sweep, "--jobs", "1", "--one-by-one", "--out", "ones.csv").stderr
        same(f"{axis}: one by one, and told", "all one by one, not in lanes: --one-by-one" in told, True)
        run(*sweep, "--quiet", "--jobs", "3", "--out", "threads.csv")
        one, *others = (pathlib.Path(name).read_bytes() for name in ("ones.csv", "lanes.csv", "threads.csv"))
        same(f"{axis}: the bytes of runs one by one", [other == one for other in others], [True, True])
        lines = rows(one.decode())
        same(f"{axis}: all are done", {line["status"] for line in lines}, {"done"})
        if scene == "eventful.yaml":
            same(f"{axis}: some are stopped", 0 < sum(float(line["time"]) < 2 for line in lines) < len(lines), True)
            same(f"{axis}: events happen", sum(int(line["event.turn"]) + int(line["event.low"]) for line in lines) > len(lines), True)


ARMED = """kinetree: 1
parameters: {J: 0}
gravity: [0, 0, -9.81]
bodies:
  - name: base
    joint: {type: spherical, velocity: [0.3, 0.4, 0.5], armature: [=J, =J, =J]}
    mass: 3
    inertia: [0.4, 0.5, 0.6]
  - {name: a, parent: base, joint: {type: revolute, axis: [0.1, 0.2, 1], at: [0.1, 0, 0], velocity: 1}, mass: 1, com: [0.3, 0.1, 0.2], inertia: [0.1, 0.11, 0.12]}
  - {name: b, parent: a, joint: {type: spherical, at: [0.7, 0.1, 0.2]}, mass: 1, com: [0.3, 0.1, 0], inertia: [0.1, 0.11, 0.12]}
  - {name: c, parent: base, joint: {type: revolute, axis: [0.2, 1, 0.3], at: [0.1, 0.7, 0], velocity: 1}, mass: 1, com: [0.2, 0.3, 0], inertia: [0.1, 0.11, 0.12]}
  - {name: d, parent: c, joint: {type: universal, axis: x, axis2: y, at: [0.4, 0.2, 0.3]}, mass: 1, com: [0.2, 0.3, 0], inertia: [0.1, 0.11, 0.12]}
loops:
  - {name: close, type: spherical, between: [{body: b, at: [0.1, 0.8, 0.3]}, d]}
events:
  - {name: arm, when: t - 0.05, then: {set: {J: 0.5}}, limit: 1}
simulate: {duration: 0.3, tolerance: 1e-9, integrator: dopri5}
"""


def armed():
    """An event gives a joint below a loop in space armature, which lanes do not compute there: runs go on by themselves."""
    pathlib.Path("armed.yaml").write_text(ARMED)
    sweep = ["armed.yaml", "--vary", "gravity[0]=0:0.3:4", "--jobs", "1"]
    told = run(*sweep, "--out", "lanes.csv").stderr
    same("runs of a loop in space are in lanes at first", "of them in lanes" in told, True)
    run(*sweep, "--quiet", "--one-by-one", "--out", "ones.csv")
    one, together = (pathlib.Path(name).read_text() for name in ("ones.csv", "lanes.csv"))
    same("armature by an event: the bytes of runs one by one", one == together, True)
    same("the event happens", {line["event.arm"] for line in rows(one)}, {"1"})


def quoted():
    """An event whose name has a comma and quotes keeps its column."""
    pathlib.Path("quoted.yaml").write_text(ARMED.replace("{name: arm, when", """{name: 'arm, "late"', when"""))
    lines = rows(run("quoted.yaml", "--vary", "gravity[0]=0:0.3:2", "--out", "-").stdout)
    same("the event has its name and happens once", {line['event.arm, "late"'] for line in lines}, {"1"})
    same("runs are done", {line["status"] for line in lines}, {"done"})


LIGHTER = """kinetree: 1
parameters: {a: 1, G: 9.81}
gravity: [0, 0, =-G]
bodies: [{name: stone, joint: {type: prismatic, axis: z}, mass: 1}]
events: [{name: lighter, when: t - a, then: {set: {G: 0}}, limit: 1}]
simulate: {duration: 2}
"""


def lighter():
    """An event sets gravity in scenes that are read anew for each run, as its formula follows from what varies: v = -9.81 a."""
    pathlib.Path("lighter.yaml").write_text(LIGHTER)
    done = run("lighter.yaml", "--vary", "a=0.5:1.5:3", "--jobs", "1", "--out", "lighter.csv")
    same("the scene is read anew", "read anew for each run" in done.stderr, True)
    for line in rows(pathlib.Path("lighter.csv").read_text()):
        same(f"a={line['a']}: done, one event", (line["status"], line["event.lighter"]), ("done", "1"))
        check(f"a={line['a']}: velocity", abs(float(line["velocity.stone.end"]) / (9.81 * float(line["a"])) + 1), 8 * sys.float_info.epsilon)


def killed():
    """Killed for real, wherever it is; the rest is the same."""
    sweep = ["fall.yaml", "--vary", "g=1:2:400" if fewer else "g=1:2:4000", "--quiet", "--out", "k.csv"]
    run(*sweep)
    whole = pathlib.Path("k.csv").read_bytes()
    pathlib.Path("k.csv").unlink()
    breaks = 0
    while breaks < 3 and not pathlib.Path("k.csv").exists():
        process = subprocess.Popen([command, "sweep", *sweep, *(["--resume"] if breaks else [])])
        time.sleep(0.05)
        process.send_signal(signal.SIGKILL)
        process.wait()
        breaks += 1
    if not pathlib.Path("k.csv").exists():
        run(*sweep, "--resume")
    same(f"after {breaks} kills", pathlib.Path("k.csv").read_bytes() == whole, True)


def alone(scene, name, value, line):
    """The numbers of a run alone, those of its line: the same bits."""
    done = subprocess.run([command, "run", scene, "--set", f"{name}={value}", "--quiet", "--out", "a.csv", "--summary", "a.json"], check=False)
    same(f"{scene}, {name}={value}: exit code", done.returncode, 0)
    records = rows(pathlib.Path("a.csv").read_text())
    summary = json.loads(pathlib.Path("a.json").read_text())
    for column in (c for c in records[0] if c != "time" and f"{c}.end" in line):
        values = [r[column] for r in records]
        same(f"{scene}, {name}={value}: {column} at the end", line[f"{column}.end"], values[-1])
        same(f"{scene}, {name}={value}: its range", (float(line[f"{column}.min"]), float(line[f"{column}.max"])), (min(map(float, values)), max(map(float, values))))
    same(f"{scene}, {name}={value}: steps", int(line["steps"]), summary["cost"]["steps"])
    return summary


def as_alone():
    """Runs of a sweep, whose scene is read once, against runs alone."""
    lines = rows(run("bounce.yaml", "--vary", "v=1,4,7", "--jobs", "1", "--out", "-").stdout)
    same("own columns and events have cells", "height.end" in lines[0] and "event.apex" in lines[0], True)
    for line in lines:
        summary = alone("bounce.yaml", "v", line["v"], line)
        same(f"events at v={line['v']}", int(line["event.apex"]), summary["events"]["apex"])
    for path in ("simulate.tolerance", "bodies.stone.mass", "effects.air.damping")[:1 if fewer else 3]:
        for line in rows(run("bounce.yaml", "--vary", f"{path}=1e-3,1e-2", "--jobs", "1", "--out", "-").stdout):
            alone("bounce.yaml", path, line[path], line)
    told = run("bounce.yaml", "--vary", "v=1:2:5", "--out", "b.csv").stderr
    same("read once: nothing is told", "anew" in told, False)
    pathlib.Path("formula.yaml").write_text(BOUNCE.replace("until: position.stone < 0", "until: position.stone < h/2"))
    told = run("formula.yaml", "--vary", "h=1:2:5", "--jobs", "2", "--out", "b.csv").stderr
    same(f"a formula of it: told with its place ({told.strip()[-60:]!r})", "read anew" in told and "formula.yaml:7:" in told, True)
    for line in rows(pathlib.Path("b.csv").read_text()):
        alone("formula.yaml", "h", line["h"], line)
    pathlib.Path("from.yaml").write_text(BOUNCE + "initial: {from: a.csv}\n")
    same("a state from a file is rejected", "initial.from" in run("from.yaml", "--vary", "g=1,2", code=2).stderr, True)


def rank_of(process):
    environment = pathlib.Path(f"/proc/{process}/environ").read_bytes().split(b"\0")
    return next((int(e.split(b"=")[1]) for e in environment if e.startswith(b"OMPI_COMM_WORLD_RANK=")), -1)


def kill_a_rank(mpirun, lines):
    """Once some lines are there."""
    for _ in range(1000):
        if pathlib.Path(lines).exists() and pathlib.Path(lines).stat().st_size > 5000:
            break
        time.sleep(0.01)
    children = pathlib.Path(f"/proc/{mpirun.pid}/task/{mpirun.pid}/children").read_text().split()
    victims = [int(c) for c in children if rank_of(c) == 3]
    same("a rank to kill", len(victims), 1)
    for victim in victims:
        os.kill(victim, signal.SIGKILL)


def ranks():
    """Four processes of MPI: the bytes of one; and where one is killed."""
    told = subprocess.run([command, "sweep", "fall.yaml", "--vary", "g=1,2", "--out", "-"], capture_output=True, text=True, check=False,
                          env={**os.environ, "OMPI_COMM_WORLD_SIZE": "4"})
    if "built without MPI" in told.stderr:
        same("without MPI: exit code", told.returncode, 1)
        return
    same("one process of MPI", told.returncode, 0)
    if shutil.which("mpirun") is None:
        print("skipped: mpirun is not on this machine")
        return
    pathlib.Path("slow.yaml").write_text(FALL.replace("duration: 2", "duration: 2, integrator: rk4, step: 1e-4"))
    sweep = ["slow.yaml", "--vary", "g=1:2:240", "--quiet"]
    run(*sweep, "--out", "p.csv")
    whole = pathlib.Path("p.csv").read_bytes()
    mpirun = ["mpirun", "--oversubscribe", "-n", "4"]
    own = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    subprocess.run([*mpirun, command, "sweep", *sweep, "--out", "q.csv"], env=own, check=True, timeout=120)
    same("four ranks", pathlib.Path("q.csv").read_bytes() == whole, True)
    pathlib.Path("q.csv").unlink()
    process = subprocess.Popen([*mpirun, "--enable-recovery", command, "sweep", *sweep, "--out", "q.csv"], env=own, stderr=subprocess.PIPE, text=True)
    kill_a_rank(process, "q.csv.partial")
    told = process.communicate(timeout=120)[1]
    same("a rank is killed, and MPI may go on", (pathlib.Path("q.csv").read_bytes() == whole, "done again" in told), (True, True))
    pathlib.Path("q.csv").unlink()
    process = subprocess.Popen([*mpirun, command, "sweep", *sweep, "--out", "q.csv"], env=own, stderr=subprocess.DEVNULL)
    kill_a_rank(process, "q.csv.partial")
    process.wait(timeout=120)
    same("a rank is killed, and MPI ends all: resumed", pathlib.Path("q.csv").exists(), False)
    subprocess.run([*mpirun, command, "sweep", *sweep, "--resume", "--out", "q.csv"], env=own, check=True, timeout=120)
    same("the bytes of an unbroken sweep", pathlib.Path("q.csv").read_bytes() == whole, True)


def accuracy():
    """A study for each value of a parameter: lines as those of a sweep, and what they say against studies alone."""
    arguments = ["swing.yaml", "--integrators", "rk4,dopri5", "--goal", "1e-4,1e-7", "--budget", "0.5", "--quiet"]
    pathlib.Path("swing.yaml").write_text("kinetree: 1\nparameters: {L: 1}\ngravity: [0, -9.81, 0]\n"
                                          "bodies: [{name: arm, joint: {type: revolute, position: 60 deg}, mass: 1, com: [0, =-L, 0], inertia: [0, 0, 0]}]\n"
                                          "simulate: {duration: \"=2*sqrt(L)\"}\n")
    done = subprocess.run([command, "accuracy", *arguments, "--vary", "L=0.01,1", "--out", "l.csv"], capture_output=True, text=True, check=False)
    same("accuracy along L", (done.returncode, done.stderr), (0, ""))
    lines = rows(pathlib.Path("l.csv").read_text())
    same("a line a value", [(float(l["L"]), l["status"]) for l in lines], [(0.01, "done"), (1.0, "done")])
    # Motions are the same in time sqrt(L / g), and so are the durations: a tenth of the time, ten times the evaluations a second.
    ratio = float(lines[0]["evaluations.0.0001"]) / float(lines[1]["evaluations.0.0001"])
    check("evaluations a second over sqrt(1 / L)", abs(math.log(ratio / 10)), math.log(2))
    check("a smaller error costs more", float(lines[1]["evaluations.0.0001"]), float(lines[1]["evaluations.1e-07"]))
    told = subprocess.run([command, "accuracy", *arguments, "--vary", "L=1,2", "--plot", "p.svg"], capture_output=True, text=True, check=False)
    same("no picture of several", (told.returncode, "single study" in told.stderr), (1, True))


def functionals():
    """Means, root mean squares and integrals against closed forms and, where HDF5 is there, against numpy on the kept records."""
    pathlib.Path("sway.yaml").write_text("kinetree: 1\nparameters: {w: 1}\nbodies: [{name: a, joint: {type: prismatic, velocity: =w}, mass: 1}]\n"
                                         "effects: [{type: joint_spring, joint: a, stiffness: =w^2}]\n"
                                         "simulate: {duration: 2}\noutput: {record: [position], interval: 0.001}\n")
    lines = rows(run("sway.yaml", "--vary", "w=1,2,5", "--functionals", "rms,mean,integral,max", "--columns", "position.a", "--out", "-").stdout)
    same("cells in the order of the option", list(lines[0])[7:11], [f"position.a.{f}" for f in ("rms", "mean", "integral", "max")])
    for line in lines:  # x = sin(w t)
        w = float(line["w"])
        integral, squares = (1 - math.cos(2 * w)) / w, 1 - math.sin(4 * w) / (4 * w)
        for name, exact in (("integral", integral), ("mean", integral / 2), ("rms", math.sqrt(squares / 2))):
            check(f"{name} at w = {w:g}", abs(float(line[f"position.a.{name}"]) - exact), w * w * 0.001 ** 2)
    for arguments, words in ((["rms,median"], "not 'median'"), (["rms,rms"], "names 'rms' twice"), ([""], "the list is empty")):
        same(f"words of --functionals {arguments[0]}", words in run("sway.yaml", "--vary", "w=1,2", "--functionals", *arguments, "--out", "-", code=1).stderr, True)
    same("one by one the same bytes", run("sway.yaml", "--vary", "w=1:2:9", "--functionals", "rms,mean", "--one-by-one", "--out", "-").stdout,
         run("sway.yaml", "--vary", "w=1:2:9", "--functionals", "rms,mean", "--out", "-").stdout)
    # The records of a run have the bits that the sweep has seen, with two rows where an event writes them.
    lines = rows(run("bounce.yaml", "--vary", "v=1,2,3", "--functionals", "rms,mean,integral,end", "--out", "-").stdout)
    worst = compared = 0
    for line in lines:
        subprocess.run([command, "run", "bounce.yaml", "--set", f"v={line['v']}", "--quiet", "--out", "f.csv"], check=True)
        table = rows(pathlib.Path("f.csv").read_text())
        time = [float(r[next(iter(r))]) for r in table]
        for name in list(table[0])[1:]:
            value = [float(r[name]) for r in table]
            column = name.split(" [")[0]
            trapezoid = lambda y: math.fsum(0.5 * (time[i + 1] - time[i]) * (y[i] + y[i + 1]) for i in range(len(y) - 1))
            expected = {"integral": trapezoid(value), "mean": trapezoid(value) / (time[-1] - time[0]),
                        "rms": math.sqrt(trapezoid([v * v for v in value]) / (time[-1] - time[0])), "end": value[-1]}
            for cell, number in expected.items():
                worst = max(worst, abs(float(line[f"{column}.{cell}"]) - number) / max(1.0, abs(number)))
                compared += 1
    check("functionals against the records of the same runs", worst, 1e-12)
    same("many of them", compared >= 36, True)


def reason():
    """Runs that end at speeds above that of light are none that are done, and energies that nothing watches have no error."""
    pathlib.Path("driven.yaml").write_text("kinetree: 1\nparameters: {k: 100}\nbodies: [{name: a, joint: {type: prismatic}, mass: 1}]\n"
                                           "effects: [{type: joint_spring, joint: a, stiffness: =k}, {type: motor, joint: a, force: \"sin(t)\"}]\n"
                                           "simulate: {duration: 4, step: 0.01, integrator: euler}\n")
    # By Euler's method each step multiplies the amplitude by sqrt(1 + k h^2): by this all 400 steps.
    stiffnesses = [1, 100, 1e3, 2e3, 4e3, 1e5, 1e8]
    growth = [0.5 * 400 * math.log10(1 + k * 1e-4) for k in stiffnesses]
    for way in ([], ["--one-by-one"]):
        lines = rows(run("driven.yaml", "--vary", "k=" + ",".join(f"{k:g}" for k in stiffnesses), "--out", "-", *way).stdout)
        same("done, but for those that grow by 1e4 and more", [l["status"] for l in lines], ["integration" if g > 4 else "done" for g in growth])
        same("whose steps diverge", [("the integration diverges" in l["why"]) for l in lines], [4 < g < 9 for g in growth])
        same("which say so", [("above that of light" in l["why"]) for l in lines], [g > 9 for g in growth])
        check("values up to then, m/s", max(abs(float(l[f"velocity.a.{end}"])) for l in lines for end in ("end", "min", "max")), 299792458.0)
        same("no error of an energy that nothing watches", {l["energy.error"] for l in lines}, {""})
    lines = rows(run("driven.yaml", "--vary", "k=1,100", "--set", "output.record=[balance]", "--out", "-").stdout)
    same("there is one of a balance", all(float(l["energy.error"]) > 0 for l in lines), True)
    lines = rows(run("fall.yaml", "--vary", "m=1,2", "--out", "-").stdout)
    same("and of what keeps its energy", all(l["energy.error"] != "" for l in lines), True)


def faults():
    lines = rows(run("fall.yaml", "--vary", "m=-1,1", "--out", "-").stdout)
    same("a run that fails is a line", [l["status"] for l in lines], ["scene", "done"])
    same("and says why", "m" in lines[0]["why"] and lines[0]["position.stone.end"] == "", True)
    for arguments, words in ((["--vary", "g=1:2:0"], "FROM:TO:COUNT"), (["--vary", "g=1:2"], "--sample"), (["--vary", "g"], "NAME=VALUES"),
                             (["--vary", "g=1 m,2 m"], "or angles such as 10 deg"), (["--random", "g=normal(1,-0.1)"], "--random g: the deviation is negative; give 0 or more"),
                             (["--random", "g=lognormal(1 deg,1 deg)"], "leave the units out"),
                             (["--vary", "g=1", "--vary", "g=2"], "twice"), (["--random", "g=normal(1)"], "normal(MEAN,DEVIATION)"),
                             (["--vary", "g=log:-1:2:3"], "above zero"), ([], "nothing is varied"), (["--vary", "g=1:2", "--sample", "sobol"], "sobol:COUNT"),
                             (["--vary", "g=1,2", "--columns", "position.stona"], "did you mean 'position.stone'"),
                             (["--vary", "parameters.gg=1,2"], "nothing in the scene uses the parameter 'gg'; did you mean 'g'?"),
                             (["--vary", "g=1,2", "--vary", "parameters.nonsense=1,2"], "'nonsense'; write =NAME where it is meant"),
                             (["--vary", "parameters.base=1,2", "--set", "parameters.top==2*base"], "nothing in the scene uses the parameter 'base'"),
                             (["--vary", "g=1,2", "--shard", "4/3"], "K/N")):
        same(f"words of {arguments}", words in run("fall.yaml", *arguments, "--out", "-", code=1).stderr, True)
    same("a missing table", "cannot be read" in run("fall.yaml", "--from", "none.csv", "--out", "-", code=2).stderr, True)
    same("a fault of the scene", "no parameter 'q'" in run("fall.yaml", "--vary", "q=1,2", code=2).stderr, True)


finish((grids, samples, angles, other_columns, parts_of_other_sweeps, equal_bytes, lanes, eventful, armed, quoted, lighter, killed, as_alone, ranks, accuracy, functionals, reason, faults))
