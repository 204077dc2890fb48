#!/usr/bin/env python3
"""Linkages that pass a singular position at a distance d, from zero to a tenth: their energy is kept, or the run says why not.

    band.py [--full] [--families A,B] [--runs A,B] [--distance D]... [--jobs N] [--keep DIRECTORY]
            [--duration S] [--patience S] [--forms PRELOAD] [--sample N --seed S [--csv FILE] [--first I]] KINETREE

Every family is a linkage with a singular position on its way, whose lengths are off by d: at d = 0 the motion meets the position, otherwise
its path bends next to it, within some sqrt(d), and a method that looks across the bend gains or loses energy. A run must do one of these:
  .  keep the total energy, or where effects do work the account of energy: to 1e-7 J (LIMIT) at a tolerance of 1e-11; at the default tolerance,
     which by itself lets some 1e-7 to 2e-6 J go in 10 s at d = 0.1, to 1e-7 of the largest kinetic energy or of the works that the account
     adds up, if these are above 1 J (the scale of kt_energy_watch; if it was
     never near a singular position, it is the tolerance that costs more: then it is to keep 1e-7 J at 1e-11); with fixed steps, whose error
     is the caller's choice, to the 1e-3 of the energy from which on the watch of energies must speak
  t  say in a warning of the summary what is not sure: with adaptive steps that positions closer than rounding decide the way, and that only at
     distances up to ROUNDING (where two loops fold at once ROUNDING_FOLDED); with fixed steps that steps are too long
  r  reject a linkage that is rigid if its lengths are off by d
  d  move a linkage that is rigid if its lengths are off by d in the sense of least squares, and say by how much its loops disagree
     (`initial.tolerance`): what they miss the positions of their motion by does work
  e  with fixed steps, end with an error on the way
Wrong are X without a word, T a warning where the distance is above rounding, V the advice to take a smaller tolerance, which does not help
there, E another error, O no end in --patience seconds of CPU time, C an account of energy that takes more evaluations than the motion.
Without --full there are some distances of some families and methods (30 s); with it thirteen distances a decade from 1e-16 to 0.1, both signs
and zero, of every family by every method (RUNS), for hours: choose some by --families and --runs. Runs can be combined (dop853+absolute); with
--forms, which names the library that is made of asked_form.c, forms of groups, too (radau5+fronts).
With --sample N distances, of either sign and log-uniform, families, methods, formulations, reductions and forms are random instead (SAMPLED). Each
of the N has a line in --csv, too; it depends on the seed and on its number alone, so that --first I goes on where another sample ended, and what
it names can be asked again by --families, --runs and --distance.
"""
# SPDX-License-Identifier: Apache-2.0
import argparse
import concurrent.futures
import functools
import json
import math
import os
import pathlib
import random
import resource
import signal
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from claims import claim, finish, note  # noqa: E402

LIMIT = 1e-7
FIXED_LIMIT = 1e-3
# A residual of 1e-15, to which loops are closed, is 1e-6 of such a bend, and 1e-7 J of 0.1 J. Where two loops fold at once, the smallest
# direction is d itself, not its root, for as long as one of them swings through: there the residual is 1e-9 of a radian.
ROUNDING = 1e-9
ROUNDING_FOLDED = 1e-6
FOLDED = {"scissor_lift", "sarrus_flat"}
KEPT = ".tred"
TOLD = ("'singular'", "'singular_energy'")
TOLD_FIXED = (*TOLD, "energ", "steps")


# Scenes. A scene is written as JSON, which is YAML.


def rod(name, length, angle, at=None, parent=None, mass=1.0, velocity=0.0, along="x", **more):
    to = [length, 0, 0] if along == "x" else [0, length, 0]
    joint = {"type": "revolute", "axis": "z", "at": at or [0, 0, 0], "position": angle, "velocity": velocity, **more}
    body = {"name": name, "joint": joint, "mass": mass, "shape": {"type": "rod", "to": to}, "markers": {"tip": to}}
    return {**body, "parent": parent} if parent else body


def scene(bodies, loops, hold=(), effects=(), gravity=(0, -9.81, 0), driven=False):
    """The account of what a drive supplies is a quadrature over steps: a pendulum next to the drive sees to it that there are some."""
    if driven:
        bodies = [*bodies, rod("clock", 0.1, -1.0, at=[0, 5, 0], mass=0.1)]
    s = {"kinetree": 1, "gravity": list(gravity), "bodies": bodies, "loops": loops, "initial": {"hold": list(hold)}}
    return {**s, "effects": list(effects)} if effects else s


def pin(a, b, name="close", **more):
    return {"name": name, "type": "revolute", "between": [a, b], **more}


def four_bar(ground, crank, coupler, rocker, angle, crossed=False, rate=0.0, effects=(), drive=None, masses=(1, 2, 1)):
    """Closed at a crank's angle: the rocker's tip is on either side of the line from the crank's tip to the rocker's pivot."""
    x, y = crank * math.cos(angle), crank * math.sin(angle)
    dx, dy = ground - x, -y
    s = math.hypot(dx, dy)
    c = max(-1.0, min(1.0, (coupler**2 + s**2 - rocker**2) / (2.0 * coupler * s)))
    tilt = math.atan2(dy, dx) + (-1 if crossed else 1) * math.acos(c)
    tip = (x + coupler * math.cos(tilt), y + coupler * math.sin(tilt))
    other = math.atan2(tip[1], tip[0] - ground)
    bodies = [
        rod("crank", crank, angle, mass=masses[0], velocity=rate),
        rod("coupler", coupler, tilt - angle, at=[crank, 0, 0], parent="crank", mass=masses[1]),
        rod("rocker", rocker, other, at=[ground, 0, 0], mass=masses[2]),
    ]
    loops = [pin("coupler.tip", "rocker.tip")]
    if drive:
        loops.append({"name": "drive", "type": "motion", "joint": "crank", "position": {"polynomial": [angle, *drive]}})
    return scene(bodies, loops, [] if drive else ["crank"], effects, driven=bool(drive))


def change_point(d):
    return four_bar(2.5, 1.0 + d, 2.0, 1.5, math.radians(120))


def change_point_damped(d):
    return four_bar(2.5, 1.0 + d, 2.0, 1.5, math.radians(120), effects=[{"type": "joint_damper", "joint": "crank", "damping": 1e-3}])


def change_point_motor(d):
    return four_bar(2.5, 1.0 + d, 2.0, 1.5, math.radians(120), effects=[{"type": "motor", "joint": "crank", "torque": 0.01}])


def change_point_driven(d):
    """A crank longer than 1 m cannot turn round."""
    return four_bar(2.5, 1.0 - abs(d), 2.0, 1.5, math.radians(120), drive=[2.0])


def parallelogram(d):
    return four_bar(2.0, 1.0 + d, 2.0, 1.0, 1.0, rate=3.0)


def antiparallelogram(d):
    return four_bar(2.0, 1.0 + d, 2.0, 1.0, 1.2, crossed=True, rate=9.0)


def parallelogram_damped(d):
    return four_bar(2.0, 1.0, 2.0 + d, 1.0, 1.0, rate=6.0, effects=[{"type": "joint_damper", "joint": "rocker", "damping": 0.05}])


def parallelogram_driven(d):
    return four_bar(2.0, 1.0 - abs(d), 2.0, 1.0, 0.4, drive=[1.7])


def rhombus(d):
    return four_bar(1.0, 1.0, 1.0 + d, 1.0, 1.0, rate=2.0)


def kite(d):
    return four_bar(2.0 + d, 1.0, 1.0, 2.0, 2.0, rate=1.0)


def windows(n, length):
    """Cranks 0 to n that stand, couplers 1 to n; length(kind, k) of each."""
    bodies = [rod("crank0", length(0, 0), 0.0, along="y", velocity=-1.0)]
    loops = []
    for k in range(1, n + 1):
        before = length(0, k - 1)
        bodies.append(rod(f"coupler{k}", length(1, k), 0.0, at=[0, before, 0], parent=f"crank{k - 1}", velocity=1.0))
        bodies.append(rod(f"crank{k}", length(0, k), 0.0, at=[k, 0, 0], along="y", velocity=-1.0))
        loops.append(pin(f"coupler{k}.tip", f"crank{k}.tip", name=f"window{k}"))
    return scene(bodies, loops, ["crank0"])


def two_windows(d):
    return windows(2, lambda kind, k: 1.0 + d * (kind == 0 and k == 1))


def two_windows_all(d):
    return windows(2, lambda kind, k: 1.0 + d * math.sin(1.0 + 2.3 * k + 4.1 * kind))


def ten_windows(d):
    return windows(10, lambda kind, k: 1.0 + d * math.sin(1.0 + 2.3 * k + 4.1 * kind))


def forty_windows(d):
    return windows(40, lambda kind, k: 1.0 + d * math.sin(1.0 + 2.3 * k + 4.1 * kind))


def slider(name, x, y, velocity=0.0):
    joint = {"type": "prismatic", "axis": "x", "at": [0, y, 0], "position": x, "velocity": velocity}
    return {"name": name, "joint": joint, "mass": 2.0, "shape": {"type": "box", "size": [0.1, 0.1, 0.1]}, "markers": {"pin": [0, 0, 0]}}


def slider_crank(offset, crank, rod_length, angle, rate=0.0, effects=(), drive=None, side=1):
    x, y = crank * math.cos(angle), crank * math.sin(angle)
    tilt = math.asin((offset - y) / rod_length)
    tilt = tilt if side > 0 else math.pi - tilt
    bodies = [
        rod("crank", crank, angle, velocity=rate),
        rod("rod", rod_length, tilt - angle, at=[crank, 0, 0], parent="crank"),
        slider("slider", x + rod_length * math.cos(tilt), offset),
    ]
    loops = [pin("rod.tip", "slider.pin")]
    if drive:
        loops.append({"name": "drive", "type": "motion", "joint": "slider", "position": drive})
    return scene(bodies, loops, [] if drive else ["crank"], effects, driven=bool(drive))


def slider_crank_equal(d):
    """Crank and rod of equal length: where the crank stands across, the slider's pin lies on the crank's, and both may turn as one."""
    return slider_crank(d, 1.0, 1.0, 0.6, rate=4.0)


def slider_crank_lengths(d):
    return slider_crank(0.0, 1.0, 1.0 + abs(d), 0.6, rate=4.0)


def slider_crank_damped(d):
    return slider_crank(d, 1.0, 1.0, 0.6, rate=6.0, effects=[{"type": "joint_damper", "joint": "slider", "damping": 0.1}])


def toggle(d):
    """The slider is driven to within d of its dead point, once a second, and back: angles go through at d = 0, and turn back else."""
    reach, stroke = 1.5, 0.2
    x = reach - abs(d) - stroke
    angle = math.acos((1.0 + x * x - 0.25) / (2.0 * x))
    drive = {"sine": {"amplitude": 0.5 * stroke, "frequency": 0.5, "phase": -math.pi / 2.0, "offset": reach - abs(d) - 0.5 * stroke}}
    return slider_crank(0.0, 1.0, 0.5, angle, drive=drive)


def off_axis(x, angle):
    return {"axis": [1, 0, 0], "angle": angle}


def bennett(d):
    b = math.sqrt(3.0)
    q2 = 2.7468773240153332

    def bar(name, parent, at, turn, length, mass, q, velocity=0.0):
        joint = {"type": "revolute", "axis": "z", "at": [at, 0, 0], "position": q, "velocity": velocity}
        if turn:
            joint["rotation"] = {"axis": [1, 0, 0], "angle": turn}
        body = {"name": name, "joint": joint, "mass": mass, "shape": {"type": "rod", "to": [length, 0, 0], "radius": 0.05}}
        return {**body, "parent": parent} if parent else body

    bodies = [
        bar("first", None, 0.0, 0.0, 1.0 + d, 1.0, 1.0, 0.5),
        bar("second", "first", 1.0 + d, math.pi / 6.0, b, 1.7, q2),
        bar("third", "second", b, math.pi / 3.0, 1.0, 1.0, -1.0),
    ]
    ends = [
        {"body": "third", "at": [1, 0, 0], "rotation": {"axis": [1, 0, 0], "angle": math.pi / 6.0}},
        {"body": "world", "at": [-b, 0, 0], "rotation": {"axis": [1, 0, 0], "angle": -math.pi / 3.0}},
    ]
    return scene(bodies, [{"name": "close", "type": "revolute", "between": ends, "axis": "z"}], ["first"])


def bennett_flat(d):
    """Equal bars and twists of +-: Bennett's equilateral linkage passes positions where all bars lie on a line."""
    def bar(name, parent, at, turn, length, q, velocity=0.0):
        joint = {"type": "revolute", "axis": "z", "at": [at, 0, 0], "position": q, "velocity": velocity}
        if turn:
            joint["rotation"] = {"axis": [1, 0, 0], "angle": turn}
        body = {"name": name, "joint": joint, "mass": 1.0, "shape": {"type": "rod", "to": [length, 0, 0], "radius": 0.05}}
        return {**body, "parent": parent} if parent else body

    alpha = math.pi / 6.0  # beta = pi - alpha: sin beta = sin alpha, equal bars
    beta = math.pi - alpha
    q1 = 1.0
    q2 = 2.0 * math.atan(math.sin(0.5 * (beta + alpha)) / math.sin(0.5 * (beta - alpha)) / math.tan(0.5 * q1))
    bodies = [
        bar("first", None, 0.0, 0.0, 1.0 + d, q1, 3.0),
        bar("second", "first", 1.0 + d, alpha, 1.0, q2),
        bar("third", "second", 1.0, beta, 1.0, -q1),
    ]
    ends = [
        {"body": "third", "at": [1, 0, 0], "rotation": {"axis": [1, 0, 0], "angle": alpha}},
        {"body": "world", "at": [-1.0, 0, 0], "rotation": {"axis": [1, 0, 0], "angle": -beta}},
    ]
    return scene(bodies, [{"name": "close", "type": "revolute", "between": ends, "axis": "z"}], ["first"])


def bricard(d):
    def link(name, parent, axis, at, to, size):
        joint = {"type": "revolute", "axis": axis, "at": at}
        body = {"name": name, "joint": joint, "mass": 1.0, "shape": {"type": "box", "size": size, "at": [0.5 * x for x in to]}, "markers": {"end": to}}
        return {**body, "parent": parent} if parent else body

    bodies = [
        link("rod1", None, "y", [0, 0, 0], [1 + d, 0, 0], [1, 0.1, 0.1]),
        link("rod2", "rod1", "z", [1 + d, 0, 0], [0, -1, 0], [0.1, 1, 0.1]),
        link("rod3", "rod2", "x", [0, -1, 0], [0, 0, 1], [0.1, 0.1, 1]),
        link("rod4", "rod3", "y", [0, 0, 1], [-1, 0, 0], [1, 0.1, 0.1]),
        link("rod5", "rod4", "z", [-1, 0, 0], [0, 1, 0], [0.1, 1, 0.1]),
    ]
    return scene(bodies, [{"name": "close", "type": "revolute", "between": ["rod5.end", {"body": "world", "at": [0, 0, 1]}], "axis": "x"}])


def sarrus(d, spring=True):
    def leg(name, parent, axis, at, q):
        joint = {"type": "revolute", "axis": axis, "at": at, "position": q}
        body = {"name": name, "joint": joint, "mass": 1.0, "shape": {"type": "rod", "to": [0, 0, 1], "radius": 0.03}}
        return {**body, "parent": parent} if parent else body

    platform = leg("platform", "upper1", "y", [0, 0, 1], 0.6)
    platform.update({"mass": 5.0, "shape": {"type": "box", "size": [1, 1, 0.1], "at": [-0.5, 0.5, 0]}})
    bodies = [
        leg("lower1", None, "y", [1, 0, 0], 0.6),
        leg("upper1", "lower1", "y", [0, 0, 1 + d], -1.2),
        platform,
        leg("lower2", None, "x", [0, 1, 0], -0.6),
        leg("upper2", "lower2", "x", [0, 0, 1], 1.2),
    ]
    ends = [{"body": "upper2", "at": [0, 0, 1]}, {"body": "platform", "at": [-1, 1, 0]}]
    effects = [{"type": "spring", "between": [{"body": "world", "at": [1, 0, 0]}, "platform"], "stiffness": 300, "length": 1.3}] if spring else ()
    return scene(bodies, [{"name": "close", "type": "revolute", "between": ends, "axis": "x"}], effects=effects, gravity=(0, 0, -9.81))


def sarrus_flat(d):
    """Without its spring the platform falls through the position in which both legs are folded."""
    return sarrus(d, spring=False)


def scissor_lift(d, stages=2):
    """Without a spring it sinks through the position in which all bars lie flat."""
    bodies, loops, up = [], [], None
    for k in range(1, stages + 1):
        length = 1.0 + (d if k == 1 else 0.0)
        at, q = ([0, 0, 0], math.pi / 4.0) if k == 1 else ([0.5, 0, 0], -math.pi / 2.0)
        a = {"name": f"a{k}", "joint": {"type": "revolute", "axis": "z", "at": at, "position": q}, "mass": 0.5,
             "shape": {"type": "rod", "to": [length, 0, 0]}, "markers": {"foot": [0, 0, 0], "top": [length, 0, 0]}}
        if up:
            a["parent"] = up
        b = {"name": f"b{k}", "parent": f"a{k}", "joint": {"type": "revolute", "axis": "z", "at": [0.5, 0, 0], "position": math.pi / 2.0}, "mass": 0.5,
             "shape": {"type": "rod", "from": [-0.5, 0, 0], "to": [0.5, 0, 0]}, "markers": {"foot": [-0.5, 0, 0], "top": [0.5, 0, 0]}}
        bodies += [a, b]
        if k == 1:
            loops.append({"name": "floor", "type": "inplane", "between": ["world", "b1.foot"], "axis": "y"})
        else:
            loops.append(pin(f"a{k - 1}.top", f"b{k}.foot", name=f"pin{k}"))
        up = f"b{k}"
    return scene(bodies, loops)


def rope(d, n=24):
    """A chain over a span half its length, folded on the line between its ends but for d: one equation depends on the other there."""
    bodies, parent = [], None
    for k in range(n):
        back = (k // (n // 4)) % 4 == 1
        angle = (math.pi if back else 0.0) + d * math.sin(1.7 * k)
        total = sum(b["joint"]["position"] for b in bodies)
        bodies.append(rod(f"link{k}", 0.1, angle - total, at=[0.1, 0, 0] if parent else None, parent=parent, mass=0.1))
        parent = f"link{k}"
        span = 0.1 * n / 2.0
    return scene(bodies, [pin(f"link{n - 1}.tip", {"body": "world", "at": [span, 0, 0]})])


FAMILIES = {
    f.__name__: f
    for f in (
        change_point, change_point_damped, change_point_motor, change_point_driven, parallelogram, antiparallelogram, parallelogram_damped,
        parallelogram_driven, rhombus, kite, two_windows, two_windows_all, ten_windows, forty_windows, slider_crank_equal,
        slider_crank_lengths, slider_crank_damped, toggle, bennett, bennett_flat, bricard, sarrus, sarrus_flat, scissor_lift, rope,
    )
}  # fmt: skip
ONE_SIDED = {"change_point_driven", "parallelogram_driven", "slider_crank_lengths", "toggle", "rope"}
RIGID = {"bennett", "bennett_flat", "bricard"}  # off by d they cannot move: to be rejected, or at rest, is right

RUNS = {
    "auto": [],
    "dopri5": ["--integrator", "dopri5"],
    "dop853": ["--integrator", "dop853"],
    "radau5": ["--integrator", "radau5"],
    "rodas5p": ["--integrator", "rodas5p"],
    "rk4": ["--integrator", "rk4", "--step", "1e-3"],
    "svd": ["--reduction", "svd"],
    "partition": ["--reduction", "partition"],
    "absolute": ["--formulation", "absolute"],
    "spatial": ["--plan", "spatial"],
    "spatial-svd": ["--plan", "spatial", "--reduction", "svd"],
    "spatial-dop853": ["--plan", "spatial", "--integrator", "dop853"],
    "mass": ["--metric", "mass"],
}
TIGHT = ["--tolerance", "1e-11"]
RUNS.update({f"{name}-tight": [*RUNS[name], *TIGHT] for name in ("auto", "dop853", "radau5", "svd", "partition", "absolute", "spatial")})
LONG = {"forty_windows": 2.0, "ten_windows": 5.0, ("rope", "radau5"): 1.0}  # of the last the start matters, at rest
SLOW = {"absolute": 4.0, "svd": 4.0}  # of what is run without --full these two take half, and pass their position within the first seconds

# Forms of groups, by what asked_form.c reads: structure and excluded forms (kt_structure, 1 << kt_group_form).
FORMS = {
    "dense": {"KT_ASKED_STRUCTURE": "1", "KT_EXCLUDED_FORMS": str(1 << 1)},
    "fronts": {"KT_ASKED_STRUCTURE": "2", "KT_EXCLUDED_FORMS": str(1 << 1 | 1 << 3 | 1 << 4)},
    "delassus": {"KT_ASKED_STRUCTURE": "2", "KT_EXCLUDED_FORMS": str(1 << 1 | 1 << 3)},
    "front4": {"KT_ASKED_STRUCTURE": "2", "KT_EXCLUDED_FORMS": str(1 << 1 | 1 << 4)},
}
SAMPLED = [["auto", "dopri5", "dop853", "radau5"], ["", "", "absolute"], ["", "", "spatial"], ["", "", "svd", "partition", "mass"]]


# What is run without --full: a choice of families by the default method, two of them by others, too, and pairs whose
# errors are the hardest to notice (ALSO: at the default distances, or at their own). Left out are the largest, for their time.
LEFT_OUT = {"ten_windows", "forty_windows"}
EVERY_METHOD = {"dopri5", "dop853", "radau5", "rk4", "svd", "partition", "absolute", "spatial", "mass", "auto-tight"}
EVERY_RUN = {"change_point", "slider_crank_equal"}
ALSO = {
    ("toggle", "dop853"): [], ("parallelogram_driven", "svd"): [], ("parallelogram_driven", "partition"): [], ("parallelogram_driven", "spatial"): [],
    ("sarrus", "absolute"): [], ("change_point_driven", "dop853"): [], ("rope", "radau5"): [], ("change_point", "rodas5p"): [1.259e-14, 2.15e-14],
}  # fmt: skip


def distances(full, one_sided):
    if full:
        d = [0.1 * 10.0 ** (-k / 13.0) for k in range(13 * 15 + 1)]
        return [0.0, *d] if one_sided else [*(-x for x in d), 0.0, *reversed(d)]
    return [0.0, 1e-10, 1e-6] if one_sided else [-1e-6, 3.16e-14, 1e-10, 1e-8]


class Result:
    def __init__(self, sign, d, drift=math.nan, words="", steps=0, cpu=0.0):
        self.sign, self.d, self.drift, self.words, self.steps, self.cpu = sign, d, drift, words, steps, cpu


def options_of(name):
    """Options of the command for a run, or for several combined."""
    return [word for part in name.split("+") for word in RUNS.get(part, [])]


def environment_of(o, name):
    """Forms of groups that a run asks for."""
    asked = [FORMS[part] for part in name.split("+") if part in FORMS]
    more = {"LD_PRELOAD": str(pathlib.Path(o.forms).resolve()), **asked[0]} if asked else {}
    return {**os.environ, "OPENBLAS_NUM_THREADS": "1", **more}


def limit_time(seconds):
    """Time of the processor, which others that run at the same time do not take."""
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), math.ceil(seconds) + 1))


def run(program, family, d, options, duration, keep, patience, environment):
    with tempfile.TemporaryDirectory() as folder:
        where = pathlib.Path(keep or folder)
        file = where / f"{family}{d:+.6e}.yaml"
        file.write_text(json.dumps(FAMILIES[family](d)))
        summary = pathlib.Path(folder) / "summary.json"
        command = [program, "run", str(file), "--out", "-", "--summary", str(summary), "--duration", repr(duration)]
        command += ["--interval", repr(duration / 200.0), "--record", "energy,balance", *options]
        limit = functools.partial(limit_time, patience)
        done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False, preexec_fn=limit)
        if done.returncode == -signal.SIGXCPU:
            return Result("O", d, words="time is over", cpu=patience)
        if done.returncode:
            words = done.stderr.strip().splitlines()
            ends = [w for w in words if w.startswith("kinetree: t = ")]
            sign = "e" if "--step" in options and ends else "r" if family in RIGID and done.returncode == 3 else "E"
            return Result(sign, d, words=f"exit {done.returncode}: " + (ends or words or [""])[0])
        found = json.loads(summary.read_text())
    drift, steps, cpu = found["balance"]["drift"], found["cost"]["steps"], found["cost"]["cpu_seconds"]
    drift = math.nan if drift is None else drift
    header, *rows = [line.split(",") for line in done.stdout.splitlines()]
    kinetic = max(float(row[header.index("energy.kinetic")]) for row in rows)
    fixed = "--step" in options
    if found["cost"]["balance_evaluations"] > found["cost"]["evaluations"]:
        return Result("C", d, drift, f"{found['cost']['balance_evaluations']} evaluations for the account of energy", steps, cpu)
    works = max(abs(found["balance"][of]) for of in ("supplied", "dissipated"))
    limit = FIXED_LIMIT * kinetic if fixed else LIMIT if "--tolerance" in options else LIMIT * max(1.0, kinetic, works)
    if drift <= limit:
        return Result(".", d, drift, "", steps, cpu)
    told = [w for w in map(str, found["warnings"]) if any(t in w for t in (TOLD_FIXED if fixed else TOLD))]
    vain = [w for w in map(str, found["warnings"]) if "Take a" in w and "tolerance" in w and not fixed]
    if told:
        if vain:
            return Result("V", d, drift, vain[0], steps, cpu)
        rounding = ROUNDING_FOLDED if family in FOLDED else ROUNDING
        return Result("t" if fixed or abs(d) <= rounding else "T", d, drift, told[0], steps, cpu)
    if family in RIGID and found["disagreement"]:
        return Result("d", d, drift, "", steps, cpu)
    if found["singular"]["near"] == 0 and not fixed and "--tolerance" not in options:
        return run(program, family, d, [*options, *TIGHT], duration, keep, patience, environment)
    return Result("X", d, drift, "", steps, cpu)


def wanted(o):
    """Pairs of family and run."""
    for family in o.families.split(",") if o.families else FAMILIES:
        for name in o.runs.split(",") if o.runs else RUNS:
            chosen = o.full or o.families or o.runs or name == "auto" or (name in EVERY_METHOD and family in EVERY_RUN)
            chosen = chosen or (family, name) in ALSO
            if chosen and (o.full or o.families or family not in LEFT_OUT):
                yield family, name


def ask(o, family, name, d):
    duration = min(o.duration, LONG.get((family, name), LONG.get(family, o.duration)))
    if not (o.full or o.families or o.runs or o.sample):
        duration = min(duration, SLOW.get(name, duration))
    return run(o.program, family, d, options_of(name), duration, o.keep, o.patience, environment_of(o, name))


def problem(family, name, r):
    return f"{family}, {name}, d = {r.d!r}: {r.sign} {r.drift:.2e} J, {r.steps} steps  {r.words[:300]}"


def compare(o, pool, family, name):
    """One line; returns what is wrong."""
    own = [] if o.full else ALSO.get((family, name), [])
    all_d = o.distance or own or distances(o.full, family in ONE_SIDED)
    results = list(pool.map(lambda d: ask(o, family, name, d), all_d))
    worst = max(results, key=lambda r: (r.sign not in KEPT, r.drift if r.drift == r.drift else -1.0))
    bad = [r for r in results if r.sign not in KEPT]
    signs, cpu = "".join(r.sign for r in results), max(r.cpu for r in results)
    note(f"{family:21s} {name:14s} {signs}  worst {worst.drift:.1e} J at d = {worst.d:+.1e}, most {cpu:.2f} s of CPU time")
    sys.stdout.flush()
    return [problem(family, name, r) for r in bad]


def draw_sample(o, index):
    """A random family, run and distance, which depend on the seed and the index alone."""
    rng = random.Random(f"{o.seed} {index}")
    family = rng.choice(sorted(o.families.split(",") if o.families else FAMILIES))
    parts = [rng.choice(of) for of in SAMPLED]
    form = rng.choice(["", *FORMS])
    d = 10.0 ** rng.uniform(-16.0, -1.0) * (1.0 if family in ONE_SIDED else rng.choice((-1.0, 1.0)))
    parts.append(form if o.forms and parts[-1] not in ("svd", "partition") else "")
    return family, "+".join(part for part in parts if part), d


def sample(o, pool):
    """Random runs, a line each in --csv; returns what is wrong."""
    def one(index):
        family, name, d = draw_sample(o, index)
        return index, family, name, ask(o, family, name, d)

    wrong, counts = [], {}
    with open(o.csv or os.devnull, "a", encoding="utf-8") as lines:
        for index, family, name, r in pool.map(one, range(o.first, o.first + o.sample)):
            values = [o.seed, index, family, name, repr(r.d), r.sign, f"{r.drift:.3e}", r.steps, f"{r.cpu:.2f}", json.dumps(r.words[:160])]
            print(*values, sep=",", file=lines, flush=True)
            counts[r.sign] = counts.get(r.sign, 0) + 1
            if r.sign not in KEPT:
                wrong.append(problem(family, name, r))
    note(", ".join(f"{sign} {count}" for sign, count in sorted(counts.items())))
    return wrong


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--full", action="store_true")
    p.add_argument("--families", default="")
    p.add_argument("--runs", default="")
    p.add_argument("--distance", type=float, action="append")
    p.add_argument("--jobs", type=int, default=2)
    p.add_argument("--keep", help="a directory for the scenes")
    p.add_argument("--duration", type=float, default=10.0)
    p.add_argument("--patience", type=float, default=60.0)
    p.add_argument("--forms", help="the library of asked_form.c")
    p.add_argument("--sample", type=int, default=0)
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--first", type=int, default=0)
    p.add_argument("--csv")
    p.add_argument("program")
    o = p.parse_args()
    with concurrent.futures.ThreadPoolExecutor(o.jobs) as pool:
        wrong = sample(o, pool) if o.sample else [line for family, name in wanted(o) for line in compare(o, pool, family, name)]
    claim("linkages_next_to_singular_positions_keep_their_energy_or_say_why_not", wrong)
    finish()


if __name__ == "__main__":
    main()
