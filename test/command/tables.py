#!/usr/bin/env python3
"""Lookup tables in scenes: closed forms of motions, files, faults, written scenes, and generated C.

    tables.py KINETREE
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import ctypes
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note  # noqa: E402

KINETREE = sys.argv[1]
FOLDER = pathlib.Path(tempfile.mkdtemp())
PROBLEMS = []


def call(*words):
    return subprocess.run([KINETREE, *map(str, words)], capture_output=True, text=True, cwd=FOLDER)


def write(name, text):
    path = FOLDER / name
    path.write_text(text)
    return path


def run(text, *more, name="scene.yaml"):
    path = write(name, "kinetree: 1\n" + text)
    done = call("run", path, "--out", "out.csv", *more)
    if done.returncode != 0:
        raise SystemExit(f"{done.stderr}\n{text}")
    with (FOLDER / "out.csv").open() as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


def near(what, found, wanted, bound):
    error = abs(found - wanted) / max(1.0, abs(wanted))
    note(f"{what}: {found:.15g} against {wanted:.15g}, error {error:.2g}, bound {bound:g}")
    if not error <= bound:
        PROBLEMS.append(f"{what}: {found!r} is not {wanted!r}")


def done_with(problems):
    found = problems[:]
    problems.clear()
    return found


ENGINE = """tables: {torque: {%s, outside: extend}}
bodies:
  - {name: crank, joint: {type: revolute, axis: x}, mass: 1, inertia: [0.2, 0.2, 0.2]}
effects:
  - {name: engine, type: expression, joint: crank, force: "torque(velocity.crank, 0.5)"}
simulate: {duration: 0.5, integrator: dop853, tolerance: 1e-12}
output: {interval: 0.25, record: [position, velocity, acceleration], columns: {drive: "torque(velocity.crank, 0.5)"}}
"""


def map_of(speed, throttle):
    return 100 * throttle - 0.5 * speed + 0.2 * speed * throttle


def engine():
    """T(w, u) is bilinear: 0.2 w' = 50 - 0.4 w at u = 0.5, and w = 125 (1 - exp(-2 t))."""
    rows = [[w, u, map_of(w, u)] for w in (0, 30, 100) for u in (0, 0.25, 1)]
    inline = run(ENGINE % f"rows: {json.dumps(rows)}")
    text = "# measured\nspeed [rpm],throttle,torque [N m]\n"
    text += "".join(f"{w * 30 / math.pi!r},{u!r},{z!r}\n" for w, u, z in rows)
    write("map.csv", text)
    table = run(ENGINE % "rows: map.csv, x: speed, y: throttle, value: torque")
    for name, found in (("in the scene", inline), ("in a file", table)):
        for row in found:
            w = 125 * (1 - math.exp(-2 * row["time"]))
            near(f"speed, {name}, t = {row['time']}", row["velocity.crank"], w, 1e-10)
            near(f"torque, {name}, t = {row['time']}", row["drive"], map_of(w, 0.5), 1e-10)
    return done_with(PROBLEMS)


CAM = """gravity: [0, 0, -9.81]
tables: {lift: {rows: %s, interpolation: cubic, outside: repeat}}
bodies:
  - {name: cam, joint: {type: revolute, axis: y, position: 0.4, velocity: 9}, mass: 3, inertia: [0.01, 0.01, 0.01]}
  - {name: follower, joint: {type: prismatic, axis: z}, mass: 0.5}
loops:
  - {name: contact, type: coupling, coefficients: {follower: 1}, formula: "-lift(position.cam)"}
initial: {hold: [cam]}
simulate: {duration: 1.5, integrator: %s, tolerance: 1e-11}
output: {interval: 0.05, record: [position, velocity, acceleration]}
"""


def spline(rows, x):
    """The spline that repeats itself, with its derivatives, from the dense linear equations of its curvatures."""
    n = len(rows) - 1
    t, y = numpy.array(rows).T
    h = numpy.diff(t)
    a, b = numpy.zeros((n, n)), numpy.zeros(n)
    for k in range(n):
        before = (k - 1) % n
        a[k, before] += h[before]
        a[k, k] += 2 * (h[before] + h[k])
        a[k, (k + 1) % n] += h[k]
        b[k] = 6 * ((y[k + 1] - y[k]) / h[k] - (y[k] - y[before] if k else y[n] - y[n - 1]) / h[before])
    m = numpy.linalg.solve(a, b)
    x = t[0] + (x - t[0]) % (t[-1] - t[0])
    k = min(int(numpy.searchsorted(t, x, side="right")) - 1, n - 1)
    s, m0, m1 = x - t[k], m[k], m[(k + 1) % n]
    slope = (y[k + 1] - y[k]) / h[k] - h[k] * (2 * m0 + m1) / 6
    third = (m1 - m0) / h[k]
    return (y[k] + s * (slope + s * (m0 / 2 + s * third / 6)), slope + s * (m0 + s * third / 2), m0 + s * third)


def cam():
    """Energy: (I + m f'^2) w^2 / 2 + m g f stays; the angle follows from no closed form, and this relation from all of it."""
    degrees, lifts = (0, 50, 110, 180, 260, 300, 360), (0, 0.004, 0.033, 0.05, 0.03, 0.006, 0)
    rows = [[math.radians(d), z] for d, z in zip(degrees, lifts)]
    for method in ("dop853", "radau5"):
        start = None
        for row in run(CAM % (json.dumps(rows), method)):
            f, slope, bend = spline(rows, row["position.cam"])
            w = row["velocity.cam"]
            near("lift", row["position.follower"], f, 1e-13)
            near("velocity of the follower", row["velocity.follower"], slope * w, 1e-13)
            near("acceleration of the follower", row["acceleration.follower"], slope * row["acceleration.cam"] + bend * w * w, 1e-13)
            energy = 0.5 * (0.01 + 0.5 * slope**2) * w**2 + 0.5 * 9.81 * f
            start = energy if start is None else start
            near(f"energy, {method}, t = {row['time']}", energy, start, 1e-10)
    return done_with(PROBLEMS)


def written():
    write("lift.csv", "angle [deg],lift [mm]\n0,0\n90,20\n180,5\n360,0\n")
    text = CAM.replace("rows: %s", "rows: lift.csv") % "dop853"
    run(text, "--duration", "0", "--scene", "whole.yaml")  # with its start, as the end of a longer run would be written
    moved = FOLDER / "elsewhere"
    moved.mkdir()
    whole = (FOLDER / "whole.yaml").read_text().replace("duration: 0", "duration: 1.5")
    if "csv" in whole:
        return ["the written scene names a file"]
    first = run(text)
    again = run(whole.split("kinetree: 1\n", 1)[1], name="elsewhere/whole.yaml")
    for one, two in zip(first, again, strict=True):
        for key in one:
            near(f"{key} at {one['time']}", two[key], one[key], 1e-12)
    return done_with(PROBLEMS)


def outside():
    text = (ENGINE % "rows: [[0, 5], [10, 5]]").replace("(velocity.crank, 0.5)", "(velocity.crank)").replace("outside: extend", "outside: reject")
    write("scene.yaml", "kinetree: 1\n" + text)
    done = call("run", "scene.yaml", "--out", "out.csv")
    note(done.stderr.strip())
    wanted = "of a table is behind its last row, at 10"
    return [] if done.returncode == 4 and wanted in done.stderr else [f"status {done.returncode}, {done.stderr!r}"]


def faults():
    body = "bodies: [{name: b, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}]\n"
    effect = "effects: [{type: expression, joint: b, force: \"%s\"}]\n"
    write("bad.csv", "x,z\n0,1\n0,2\n")
    cases = (
        ("tables: {f: [[0, 0], [1, 1]]}\n" + body + effect % "g(t)", "there is no function 'g'"),
        ("tables: {f: [[0, 0], [0, 1]]}\n" + body + effect % "f(t)", "inputs must increase"),
        ("tables: {f: bad.csv}\n" + body + effect % "f(t)", "inputs must increase"),
        ("tables: {f: none.csv}\n" + body + effect % "f(t)", "none.csv"),
        ("tables: {sin: [[0, 0], [1, 1]]}\n" + body, "has a meaning of its own"),
        ("tables: {f: {rows: [[0, 0], [1, 1]], y: a}}\n" + body, "is the column of a file"),
        ("tables: {f: {rows: [[0, 0], [1, 1]], outside: repeat}}\n" + body, "the same value in its first and last row"),
        ("tables: {f: [[0, 0], [1, 1]]}\n" + body + "effects: [{type: motor, joint: b, torque: \"f(t)\"}]\n", "calls no lookup table"),
        ("tables: {f: [[0, 0], [1, 1]]}\n" + body + "loops: [{name: c, type: coupling, formula: \"f(position.b)\"}]\n", "jumps at its rows"),
    )
    problems = []
    for text, wanted in cases:
        write("scene.yaml", "kinetree: 1\n" + text)
        done = call("check", "scene.yaml")
        note(done.stderr.strip().splitlines()[0] if done.stderr else "no message")
        if done.returncode == 0 or wanted not in done.stderr or "scene.yaml:" not in done.stderr:
            problems.append(f"{wanted!r} is not in {done.stderr!r}")
    return problems


def generated():
    """Every kind of table in one scene, at several states: the generated acceleration against that of `run` at its start."""
    text = """tables:
  line: {rows: [[-1, 2], [0.5, 1], [2, 4]], outside: hold}
  curve: {rows: [[-1, 2], [0.5, 1], [2, 4], [3, 3]], interpolation: cubic, outside: extend}
  cycle: {rows: [[0, 1], [1, 2], [1.7, 0.5], [2.5, 1]], interpolation: monotone, outside: repeat}
  grid: {rows: [[-1, 0, 1], [-1, 2, 3], [0, 0, 2], [0, 2, 7], [2, 0, 0], [2, 2, 1]], outside: hold}
  strict: {rows: [[-9, 1], [0, 3], [9, 5]]}
bodies:
  - {name: a, joint: {type: revolute, axis: x, position: %r, velocity: %r}, mass: 1, inertia: [0.2, 0.2, 0.2]}
  - {name: b, joint: {type: prismatic, axis: x}, mass: 0.7}
loops:
  - {name: c, type: coupling, coefficients: {b: 1}, formula: "-cycle(position.a)"}
initial: {hold: [a]}
effects:
  - {name: e, type: expression, joint: a, force: "line(position.a) + curve(velocity.a) + grid(position.a, velocity.a)*strict(position.a)"}
simulate: {duration: 0.001}
output: {record: [position, velocity, acceleration]}
"""
    library = None
    for q, v in ((-2.5, -1.5), (0.3, 0.7), (1.2, 3.7), (4.1, 0.1), (-0.2, 2.5)):
        row = run(text % (q, v))[0]
        if library is None:
            done = call("export", "--c", "scene.yaml", "--functions", "acceleration", "--fold", "--out", "plant.c")
            if done.returncode != 0:
                return [done.stderr]
            built = subprocess.run(["cc", "-O1", "-ffp-contract=off", "-shared", "-fPIC", "-o", FOLDER / "plant.so", FOLDER / "plant.c", "-lm"],
                                   capture_output=True, text=True)
            if built.returncode != 0:
                return [built.stderr[:500]]
            library = ctypes.CDLL(str(FOLDER / "plant.so"))
        two = ctypes.c_double * 2
        position, velocity = two(row["position.a"], row["position.b"]), two(row["velocity.a"], row["velocity.b"])
        found = two()
        code = library.plant_acceleration(None, ctypes.c_double(0.0), position, velocity, None, two(), found)
        near(f"code of the generated function at {q}", code, 0, 0)
        for k, name in enumerate("ab"):
            near(f"acceleration of {name} at {q}", found[k], row[f"acceleration.{name}"], 1e-12)
    return done_with(PROBLEMS)


def linearised():
    """A slider on a spring whose force is a table: omega^2 = -F'(q) / m, from the bilinear cell and from the parabola of three rows."""
    text = """tables:
  pull: {rows: [[-1, 4], [0.5, 1], [2, -5]], interpolation: monotone}
  map: {rows: [[-1, 0, 0], [-1, 1, 3], [2, 0, 0], [2, 1, -3]]}
bodies:
  - {name: a, joint: {type: prismatic, axis: x, position: 0.2}, mass: 0.7}
effects:
  - {name: e, type: expression, joint: a, force: "%s"}
simulate: {duration: 1}
"""
    # at its equilibrium, in the second interval: p_1 = (w1 + w2) / (w1 / e0 + w2 / e1), p_2 = ((2 h1 + h0) e1 - h1 e0) / (h0 + h1)
    p0, p1, e, h = 2 / (1 / -2 + 1 / -4), -5.0, -4.0, 1.5
    cubic = [(p0 + p1 - 2 * e) / h**2, (3 * e - 2 * p0 - p1) / h, p0, 1.0]
    at = min((root.real for root in numpy.roots(cubic) if abs(root.imag) < 1e-9 and 0 < root.real < h))
    slope = numpy.polyval(numpy.polyder(cubic), at)
    for formula, stiffness in (("pull(position.a)", -slope), ("map(position.a, 0.5)", 1.0)):
        write("scene.yaml", "kinetree: 1\n" + text % formula)
        done = call("modes", "scene.yaml", "--json")
        if done.returncode != 0:
            return [done.stderr]
        found = max(abs(2 * math.pi * mode["frequency"]) for mode in json.loads(done.stdout)["modes"])
        near(f"frequency with {formula}, rad/s", found, math.sqrt(stiffness / 0.7), 1e-12)
    return done_with(PROBLEMS)


CLAIMS = {linearised: "linearised_equations_have_the_slopes_of_tables",
          engine: "an_engine_map_has_the_motion_of_its_differential_equation",
          cam: "a_measured_cam_moves_its_follower_and_keeps_its_energy",
          written: "a_written_scene_contains_the_rows_of_files",
          outside: "outside_its_rows_a_rejecting_table_ends_the_run_with_its_input",
          faults: "faults_of_tables_have_a_place_and_a_remedy",
          generated: "generated_c_has_the_accelerations_of_the_library"}
for test, name in CLAIMS.items():
    claim(name, test())
finish()
