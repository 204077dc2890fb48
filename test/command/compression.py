#!/usr/bin/env python3
"""What a run tells once, and in its summary: a distance that pushes, with its force and its time; an angle of a loop that has passed
half a turn; a path around a surface whose length jumps; joints that move no mass.

compression.py KINETREE
"""
# SPDX-License-Identifier: Apache-2.0
import json
import math
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note  # noqa: E402

kinetree = sys.argv[1]
folder = pathlib.Path(tempfile.mkdtemp())

BALL = """kinetree: 1
gravity: [0, -9.81, 0]
bodies:
  - {name: ball, joint: {type: planar, axis: z, position: [X, Y, 0], velocity: [0, V, 0]}, mass: 2, inertia: [1, 1, 1], markers: {centre: [0, 0, 0]}}
loops:
  - {name: rope, type: distance, between: [world, ball.centre]}
simulate: {duration: 1, tolerance: 1e-10}
output: {interval: 0.001}
"""


def run(text, name, *more):
    scene = folder / f"{name}.yaml"
    scene.write_text(text)
    done = subprocess.run([kinetree, "run", scene, "--out", folder / f"{name}.csv", "--summary", folder / f"{name}.json", *more],
                          capture_output=True, text=True, check=False, timeout=60)
    return done, json.loads((folder / f"{name}.json").read_text())


# From rest next to the top it pushes with m g sin at once; below the level of its centre it pulls, with 3 m g sin less what
# it began with, sin the height over the length.
done, summary = run(BALL.replace("X", "0.8").replace("Y", "0.6").replace("V", "0"), "over")
says = [line for line in done.stderr.splitlines() if "pushes" in line]
note("\n".join(says))
pushes = summary["compression"].get("rope", {})
error = abs(pushes.get("force", math.nan) - 2 * 9.81 * 0.6)
note(f"push {pushes.get('force')} N, of {2 * 9.81 * 0.6}: error {error:.2e}")
claim("a_rope_that_starts_above_its_level_pushes_and_is_told_once",
      [] if len(says) == 1 and "'rope'" in says[0] and "11.8 N" in says[0] and error <= 1e-9 and pushes["since"] == 0 else [says, pushes])

done, absolute = run(BALL.replace("X", "0.8").replace("Y", "0.6").replace("V", "0"), "over", "--formulation", "absolute")
error = abs(absolute["compression"].get("rope", {}).get("force", math.nan) - 2 * 9.81 * 0.6)
note(f"in absolute coordinates: error {error:.2e}")
claim("so_it_is_in_absolute_coordinates", [] if error <= 1e-9 and "distance 'rope' pushes" in done.stderr else [done.stderr])

# The last of twenty, and of three hundred, which are too many to be watched.
for number in (20, 300):
    arms = "".join(f"  - {{name: b{k}, joint: {{type: planar, axis: z, position: [{3 * k + 0.8}, {-0.6 if k < number - 1 else 0.6}, 0]}}, mass: 2, inertia: [1, 1, 1]}}\n"
                   for k in range(number))
    ropes = "".join(f"  - {{name: r{k}, type: distance, between: [{{body: world, at: [{3 * k}, 0, 0]}}, b{k}]}}\n" for k in range(number))
    done, summary = run(f"kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n{arms}loops:\n{ropes}simulate: {{duration: 0.01, tolerance: 1e-8}}\n", f"many{number}")
    if number == 20:
        claim("the_last_of_twenty_is_told", [] if list(summary["compression"]) == ["r19"] else [summary["compression"]])
    else:
        claim("those_that_are_not_watched_are_told", [] if "watched in the first 256; the forces of the other 44" in done.stderr else [done.stderr])

# Thrown upwards from its level with v^2 = 2 g l it goes slack where 3 sin = 2, and pushes from there on.
done, summary = run(BALL.replace("X", "1").replace("Y", "0").replace("V", str(math.sqrt(2 * 9.81))), "up")
rows = [line.split(",") for line in (folder / "up.csv").read_text().splitlines()]
height = {float(row[0]): float(row[2]) for row in rows[1:]}
since = summary["compression"]["rope"]["since"]
before = max(t for t in height if t < since)
note(f"it pushes from {since} s on, at the height {height[since]}, and not at {height[before]}")
claim("it_pushes_from_the_height_of_two_thirds_on", [] if height[before] <= 2 / 3 <= height[since] else [since])

done, summary = run(BALL.replace("X", "0.6").replace("Y", "-0.8").replace("V", "0"), "under")
claim("a_rope_that_pulls_alone_is_not_told", [] if summary["compression"] == {} and "pushes" not in done.stderr else [summary["compression"]])
# A hinge of a loop about a tilted axis, on a body that no joint holds: its angle is the one nearest to the start, 0, and jumps by
# a turn where it has turned by half a one, at 3.5 rad/s without a spring worth the name after 0.9 s. In a plane turns are counted.
FLYWHEEL = """kinetree: 1
bodies:
  - {name: wheel, joint: {type: free, velocity: {angular: [0, 2.1, 2.8]}}, mass: 1, inertia: [1, 1, 1]}
loops:
  - {name: hinge, type: revolute, between: [world, wheel], axis: [0, 0.6, 0.8]}
effects:
  - {type: joint_spring, joint: hinge, stiffness: 1e-9, rest: 0}
simulate: {duration: DURATION, tolerance: 1e-9}
output: {interval: 0.01}
"""
done, summary = run(FLYWHEEL.replace("DURATION", "2"), "half_turn")
found = [warning for warning in summary["warnings"] if warning["code"] == "half_turn"]
error = abs(found[0]["time"] - math.pi / 3.5) if found else math.nan
note(f"jumps {error:.3g} s after {math.pi / 3.5:.3g} s, records are 0.01 s apart")
claim("an_angle_that_jumps_at_half_a_turn_is_told_once_with_its_loop_and_time",
      [] if len(found) == 1 and error <= 0.01 and "loop 'hinge', in which a joint_spring acts" in done.stderr else [done.stderr, found])
done, summary = run(FLYWHEEL.replace("DURATION", "0.88"), "less")
claim("within_half_a_turn_nothing_is_told", [w for w in summary["warnings"] if w["code"] == "half_turn"])
done, summary = run(FLYWHEEL.replace("DURATION", "2").replace("free, velocity: {angular: [0, 2.1, 2.8]}", "planar, axis: [0, 0.6, 0.8], velocity: [0, 0, 3.5]"), "counted")
claim("where_turns_are_counted_nothing_is_told", [w for w in summary["warnings"] if w["code"] == "half_turn"])

# A cord without force leads over a cylinder of 0.25 m from -1 m to a ball at the height 0.1 m, which moves towards the axis at 1 m/s
# and enters the surface. The cord is straight from there on. It is bent by its free length s, and by an arc up to the ball.
CORD = """kinetree: 1
gravity: [0, 0, 0]
bodies:
  - {name: ball, joint: {type: prismatic, axis: x, at: [1, 0, 0.1], velocity: -1}, mass: 2}
effects:
  - {name: cord, type: expression, path: [{body: world, at: [-1, 0, 0]}, {body: world, at: [0, 0, 0], radius: 0.25, axis: y}, ball], force: "0*length"}
simulate: {duration: DURATION}
output: {interval: 0.2}
"""
away, free = math.sqrt(0.25**2 - 0.1**2), math.sqrt(1 - 0.25**2)
arc = math.pi - math.asin(0.1 / 0.25) - math.atan(free / 0.25)
jump = math.hypot(1 + away, 0.1) - (free + 0.25 * arc)
for name, more in (("cord", ()), ("cord_steps", ("--integrator", "rk4", "--step", "0.02"))):
    done, summary = run(CORD.replace("DURATION", "2"), name, *more)
    found = [warning for warning in summary["warnings"] if warning["code"] == "path_jump"]
    errors = [abs(found[0]["time"] - 1 + away), abs(found[0]["value"] - jump)] if found else [math.nan]
    note(f"{name}: it jumps by {jump:.6g} m; errors {max(errors):.2e}")
    claim(f"a_{name}_that_a_point_within_a_surface_cuts_is_told_once", [] if len(found) == 1 and max(errors) <= 1e-9 and
          "the path of effect 'cord' jumps" in done.stderr and "entry 3 of the path, on 'ball', enters the surface of entry 2, on 'world'" in done.stderr
          else [done.stderr, found])
done, summary = run(CORD.replace("DURATION", "0.75"), "cord_whole")
claim("before_that_no_jump_is_told", [w for w in summary["warnings"] if w["code"] == "path_jump"])
done, summary = run(CORD.replace("DURATION", "2").replace("0.1]", "0.3]"), "cord_over")
claim("a_cord_that_leaves_the_surface_does_not_jump", [w for w in summary["warnings"] if w["code"] == "path_jump"])

# A rope begins at a point of the rim, up to rounding: 0.2 is 0.3 - 0.1. It leads around half of the pulley. Where its point is within the
# pulley it is straight, and that is told.
RIM = """kinetree: 1
bodies:
  - {name: load, joint: {type: prismatic, axis: z, at: [0.4, 0, -0.5]}, mass: 6}
effects:
  - {name: rope, type: expression, path: [{body: world, at: [X, 0, 0]}, {body: world, at: [0.3, 0, 0], radius: 0.1, axis: y, side: [0, 0, 1]}, load], force: "0*length"}
simulate: {duration: 0.01}
output: {record: [effect]}
"""
for place, expected, inside in ((0.2, 0.1 * math.pi + 0.5, []), (0.25, math.hypot(0.15, 0.5), [0.05])):
    done, summary = run(RIM.replace("X", str(place)), "rim")
    found = [w["value"] for w in summary["warnings"] if w["code"] == "path_inside"]
    length = float((folder / "rim.csv").read_text().splitlines()[1].split(",")[3])
    errors = [abs(length - expected), *(abs(a - b) for a, b in zip(found, inside, strict=False))]
    note(f"from {place} m the rope has {length:.12g} m; errors {max(errors):.2e}, bound 1e-12; {len(found)} warnings of {len(inside)}")
    claim(f"a_rope_from_{place}_has_its_length", [] if max(errors) <= 1e-12 and len(found) == len(inside) else [length, found, done.stderr])

# A load rises below a pulley, over which its rope leads. The rope loses its way where the line from its other end to the load is a
# tangent of the pulley, below which the load is about to enter it.
PULLEY = """kinetree: 1
bodies:
  - {name: load, joint: {type: prismatic, axis: z, at: [0.19, 0, -1], velocity: 1}, mass: 2}
effects:
  - {name: rope, type: expression, path: [{body: world, at: [-0.2, 0, -2]}, {body: world, at: [0, 0, 0], radius: 0.2, axis: y, side: [0, 0, 1]}, load], force: "0*length"}
simulate: {duration: 0.935}
"""
tangent = math.atan2(-2, -0.2) + math.acos(0.2 / math.hypot(2, 0.2))
lost = 1 + (0.2 - 0.19 * math.cos(tangent)) / math.sin(tangent)
done, summary = run(PULLEY, "pulley")
found = [warning for warning in summary["warnings"] if warning["code"] == "path_jump"]
claim("a_rope_that_changes_its_way_is_told", [] if len(found) == 1 and abs(found[0]["time"] - lost) <= 1e-9 and "the path changes its way around the surface of entry 2, on 'world'" in done.stderr
      else [done.stderr, found])

# A box slides and spins on the corners of its face. Four corners share its weight in several ways, with other directions of slip at
# each, so that the motion is not decided from the start on. Three corners share it in one way.
SLIDE = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: box, joint: {type: free, position: {position: [0, 0, 0.15]}, velocity: {linear: [1, 0.4, 0], angular: [0, 0, 2]}}, mass: 2,
     shape: {type: box, size: [0.4, 0.6, 0.3]}, markers: {p0: [-0.2, -0.3, -0.15], p1: [0.2, -0.3, -0.15], p2: [-0.2, 0.3, -0.15], p3: [0.2, 0.3, -0.15]}}
effects:
"""
for corners in (4, 3):
    effects = "".join(f"  - {{name: c{k}, type: contact, point: box.p{k}, plane: world, restitution: 0, friction: 0.3}}\n" for k in range(corners))
    done, summary = run(SLIDE + effects + "simulate: {duration: 0.1}\n", f"slide{corners}")
    found, contacts = [w for w in summary["warnings"] if w["code"] == "friction_undecided"], summary["contacts"]
    if corners == 4:
        told = "first at 'c" in done.stderr and "share a load in several ways" in done.stderr and "Painleve" not in done.stderr
        claim("corners_that_share_a_load_in_several_ways_are_told_with_their_first_time", [] if told and len(found) == 1 and found[0]["time"] == 0
              and contacts["redundant"] == contacts["undecided"] > 0 and contacts["first_undecided"]["contact"] in ("c0", "c1", "c2", "c3")
              else [done.stderr, summary["contacts"], found])
    else:
        claim("three_corners_share_it_in_one_way", [found, contacts] if found or contacts["undecided"] else [])

# Joints that move no mass are told and listed, and what is given of their places where the balance of forces moves it.
done, summary = run("""kinetree: 1
bodies:
  - {name: node, joint: {type: prismatic, position: 0.5}}
  - {name: block, joint: {type: prismatic, position: 1}, mass: 2}
effects:
  - {type: joint_spring, joint: node, stiffness: 30}
  - {type: spring, between: [node, block], stiffness: 10, length: 0.2}
simulate: {duration: 0.1}
""", "massless")
moved = {change["joint"]: change["to"] for change in summary["moved"]}
error = abs(moved.get("node", math.nan) - 0.2)
note(f"a node that is given at 0.5 m is at 0.2 m, where 30 x = 10 (1 - x - 0.2): error {error:.2e}")
claim("joints_that_move_no_mass_are_told_and_listed",
      [] if "joint 'node' moves no mass" in done.stderr and "the balance of forces" in done.stderr and summary["massless"] == ["node"]
      and error <= 1e-15 and summary["acceleration"]["node"] is None else [done.stderr, summary["moved"]])

finish()
