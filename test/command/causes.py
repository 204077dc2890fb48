"""causes.py KINETREE: messages name the cause of a fault, and all faults at once.

Each case is a scene with known faults. Every word of a case must be in the printed messages, and nothing that a case excludes.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish

KINETREE, = sys.argv[1:]
TURN = {"type": "revolute", "axis": "z"}
WHEEL = {"mass": 1, "inertia": [1, 1, 1]}
ROD = {"mass": 1, "shape": {"type": "rod", "to": [1, 0, 0]}}
DOWN = [0, 0, -9.81]


def scene(**parts):
    return json.dumps({"kinetree": 1, "gravity": DOWN, **parts})


def bodies(*joints):
    return [{"name": "ab"[i], "joint": joint, **WHEEL} for i, joint in enumerate(joints)]


FAULTY = """kinetree: 1
gravty: [0, 0, -9.81]
bodies:
  - name: crank
    joint: {type: revolut, axis: [0, 0, 0]}
    mass: -1
  - name: rod
    parent: crnak
    inertia: [1, 1, 5]
    mass: .nan
  - name: rod
"""
# Two bodies of one name, one of which may have been meant to have the name that is missing.
DOUBLED = scene(bodies=[{"name": "link-1", "joint": TURN, **WHEEL}, {"name": "link-1", "joint": TURN, **WHEEL}, {"name": "tip", "parent": "link-2", "joint": TURN, **WHEEL}])
DRIVES = scene(bodies=bodies(TURN, TURN), loops=[{"name": "gear", "type": "coupling", "coefficients": {"a": 1, "b": -1}},
                                                {"name": "m1", "type": "motion", "joint": "a", "position": "t"}, {"name": "m2", "type": "motion", "joint": "b", "position": "2*t"}])
BALL = [{"name": "p", "joint": {"type": "prismatic", "axis": "z", "velocity": -1}, "mass": 1}]
STOP = [{"name": "floor", "type": "joint_limit", "joint": "p", "lower": 0, "restitution": 0.5}]
LOOPED = scene(bodies=[{"name": "arm", "joint": {"type": "revolute", "axis": "y"}, **ROD, "markers": {"tip": [1, 0, 0]}},
                       {"name": "rod", "parent": "arm", "joint": {"type": "spherical", "at": [1, 0, 0]}, **ROD, "markers": {"tip": [1, 0, 0]}}],
               loops=[{"name": "s", "type": "spherical", "between": ["rod.tip", {"body": "world", "at": [1, 1, 0]}]}])
# The angle rises through pi, where atan2 jumps down, and later through 0.5.
ANGLE = scene(bodies=[{"name": "a", "joint": {**TURN, "position": 2, "velocity": 1}, **WHEEL, "markers": {"m": [1, 0, 0]}}],
              events=[{"name": "jump", "when": "atan2(marker.a.m.y, marker.a.m.x) - 0.5", "direction": "falling", "limit": 1, "then": "record"},
                      {"name": "root", "when": "atan2(marker.a.m.y, marker.a.m.x) - 0.5", "direction": "rising", "limit": 1, "then": "record"}], simulate={"duration": 6})
BRAKE = scene(bodies=bodies({"type": "prismatic", "axis": "x"}, TURN), loops=[{"name": "gear", "type": "coupling", "coefficients": {"a": 1, "b": -1}}],
              effects=[{"name": "brake", "type": "joint_friction", "joint": "a", "coulomb": 1, "stick": True}])


def read(quantity):
    return scene(bodies=bodies(TURN, TURN), loops=[{"name": "gear", "type": "coupling", "coefficients": {"a": 1, "b": -2}}],
                 effects=[{"name": "f", "type": "expression", "joint": "a", "force": quantity}])


CASES = {
    "check_finds_all_eight_faults": (FAULTY, ["check"], ["2:1: unknown key 'gravty'", "5:19: body 'crank': joint.type", "5:34: body 'crank': joint.axis is zero", "6:11: body 'crank': mass",
                                                         "8:13: body 'rod': parent 'crnak'", "9:14: body 'rod': inertia", "10:11: body 'rod': mass", "11:11: body 'rod': name"], []),
    "names_that_a_second_body_may_have_lost_are_no_faults": (DOUBLED, ["check"], ["name 'link-1' is that of bodies"], ["parent"]),
    "drives_of_one_degree_of_freedom_are_named": (DRIVES, ["check"], ["drives 'm1' and 'm2' determine the same degree of freedom"], []),
    "reactions_do_not_exist_in_forces": (read("reaction.gear.multiplier"), ["check"], ["reactions follow from all forces", "events (`when`) and columns only"], []),
    "accelerations_do_not_exist_in_forces": (read("acceleration.a"), ["check"], ["accelerations follow from all forces"], []),
    "misspelt_names_are_suggested": (read("velocty.a"), ["check"], ["did you mean 'velocity.a'?"], ["follow from all forces"]),
    "slender_rods_need_a_radius": (scene(bodies=[{"name": "rod", "joint": {"type": "spherical"}, **ROD}]), ["check"], ["Give its shape a 'radius'"], []),
    "slender_rods_in_loops_need_a_radius": (LOOPED, ["check"], ["body 'rod' is a rod without a radius", "its turn about its own axis", "Give its shape a `radius`"], []),
    "impacts_at_the_start_are_reported": (scene(bodies=BALL, effects=STOP, simulate={"duration": 0.01}), ["run", "--out", "out.csv"], ["1 impact at t = 0 dissipates 0.375 J"], []),
    "jumps_of_angles_are_reported": (ANGLE, ["run", "--out", "out.csv"], ["event 'jump' has happened at a jump of atan2"], ["event 'root' has happened at a jump"]),
    "friction_that_sticks_is_the_cause_and_no_loop": (BRAKE, ["export", "--c", "--out", "out.c"], ["effect 'brake': code for it cannot be generated: its friction sticks"], ["gear"]),
}

with tempfile.TemporaryDirectory() as folder:
    for name, (text, words, wanted, excluded) in CASES.items():
        path = pathlib.Path(folder) / "scene.yaml"
        path.write_text(text)
        ended = subprocess.run([KINETREE, words[0], path, *words[1:]], cwd=folder, capture_output=True, text=True)
        claim(name, [f"'{word}' is not in: {ended.stderr}" for word in wanted if word not in ended.stderr] +
              [f"'{word}' is in: {ended.stderr}" for word in excluded if word in ended.stderr])
finish()
