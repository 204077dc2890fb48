"""csv_table KINETREE: tables of functions of time in CSV files: values, units, end slopes, and faults with the file's line and column.

A clamped cubic spline whose end slopes are those of a cubic polynomial is that polynomial, whatever the rows. A natural spline of the
same rows is not, since the polynomial bends at its ends.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import math
import pathlib
import random
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE = sys.argv[1]
SCENE = """kinetree: 1
bodies:
  - {{name: rotor, joint: {{type: revolute}}, mass: 1, inertia: [1, 1, 1]}}
effects:
  - {{type: motor, name: drive, joint: rotor, torque: {torque}}}
simulate: {{duration: {duration}, tolerance: 1e-9}}
output: {{interval: {interval}, record: [position, effect]}}
"""
DRIVEN = """kinetree: 1
bodies:
  - {{name: rotor, joint: {{type: revolute}}, mass: 1, inertia: [1, 1, 1]}}
loops:
  - {{name: drive, type: motion, joint: rotor, position: {position}}}
simulate: {{duration: {duration}, tolerance: 1e-9}}
output: {{interval: {interval}, record: [position, velocity]}}
"""


def run(folder, text, *words):
    (folder / "scenes").mkdir(exist_ok=True)
    (folder / "scenes/s.yaml").write_text(text)
    return subprocess.run([KINETREE, "run", folder / "scenes/s.yaml", "--quiet", "--out", folder / "s.csv", *words], capture_output=True, text=True)


def column(folder, name):
    rows = list(csv.reader((folder / "s.csv").open()))
    at = rows[0].index(name)
    return [(float(row[0]), float(row[at])) for row in rows[1:]]


def worst(pairs, function):
    errors = [abs(y - function(t)) for t, y in pairs]
    return max(errors) if errors and all(math.isfinite(e) for e in errors) else math.inf


def polynomials(folder):
    draw, problems, largest, natural = random.Random(7), [], 0.0, math.inf
    for case in range(20):
        c = [draw.uniform(-2, 2) for _ in range(4)]
        times = sorted([0.0, 1.5] + [draw.uniform(0.05, 1.45) for _ in range(draw.randint(0, 9))])
        value = lambda t: c[0] + c[1] * t + c[2] * t**2 + c[3] * t**3
        lines = [f"# case {case}", "", '"time [ms]", spare ,"torque [N m]"'] + [f"{1e3 * t!r}, x, {value(t)!r}" for t in times]
        (folder / "scenes").mkdir(exist_ok=True)
        (folder / "scenes/drive.csv").write_text("\r\n".join(lines))
        slopes = [c[1], c[1] + 3 * c[2] + 6.75 * c[3]]
        for keys in (f", slopes: [{slopes[0]!r}, {slopes[1]!r}]", ""):
            table = f"{{table: drive.csv, value: torque, interpolation: cubic{keys}}}"
            ran = run(folder, SCENE.format(torque=table, duration=1.5, interval=0.0625), "--scene", folder / "scenes/written.yaml")
            if ran.returncode != 0:
                return [ran.stderr]
            error = worst(column(folder, "effect.drive.torque [N m]"), value)
            if keys:
                largest = max(largest, error)
                again = subprocess.run([KINETREE, "run", folder / "scenes/written.yaml", "--quiet", "--out", folder / "s.csv", "--duration", "0"], capture_output=True, text=True)
                problems += [again.stderr] if again.returncode != 0 else []
            else:
                natural = min(natural, error)
    note(f"clamped splines are off a cubic by {largest:.2g} (bound 1e-12), natural ones by {natural:.2g} at least")
    return problems + ([] if largest <= 1e-12 else ["a clamped spline is not the polynomial"]) + ([] if natural > 1e-6 else ["the natural one is"])


def angles(folder):
    (folder / "scenes/q.csv").write_text("t,shoulder [deg],elbow\n0,10,0\n1,40,1\n2,10,0\n")
    table = "{table: q.csv, value: shoulder, interpolation: cubic, slopes: [0, 0 deg]}"
    ran = run(folder, DRIVEN.format(position=table, duration=2, interval=0.125))
    if ran.returncode != 0:
        return [ran.stderr]
    deg = math.pi / 180
    expected = lambda t: (10 + 30 * (3 * min(t, 2 - t) ** 2 - 2 * min(t, 2 - t) ** 3)) * deg  # by symmetry with slope 0 at 1 s
    error = worst(column(folder, "position.rotor"), expected)
    note(f"angles in degrees are off by {error:.2g} rad (bound 1e-12)")
    (folder / "scenes/q.csv").write_text("t,shoulder\n0,10\n1,40\n2,10\n")
    stated = "{table: q.csv, unit: deg, time_unit: s, interpolation: cubic, slopes: [0, 0]}"
    ran = run(folder, DRIVEN.format(position=stated, duration=2, interval=0.125))
    same = ran.returncode == 0 and worst(column(folder, "position.rotor"), expected) <= 1e-12
    return ([] if error <= 1e-12 else ["an angle is off"]) + ([] if same else ["a unit of the scene is not that of a header: " + ran.stderr])


FAULTS = [  # the file, the keys, where, words
    ("t,y\n0,1\n1,x2\n", "", "d.csv:3:3: ", "expected a finite number, found 'x2'"),
    ("t,y\n0,1\n1,\n", "", "d.csv:3:3: ", "expected a finite number, found ''"),
    ("t,y\n0,1\n1,1e999\n", "", "d.csv:3:3: ", "expected a finite number, found '1e999'"),
    ("t,y\n0,1\n1,nan\n", "", "d.csv:3:3: ", "expected a finite number"),
    ("t,y\n0,1\n2,1\n1,1\n", "", "d.csv:4:1: ", "the time 1 s follows 2 s; times must increase"),
    ("t,y\n0,1\n\n# two\n0,1\n", "", "d.csv:5:1: ", "the time 0 s follows 0 s"),
    ("t,y\n0,1\n1\n", "", "d.csv:3:1: ", "the row has 1 cell, and column 2 is needed"),
    ("t,y\n0,1\n", "", "d.csv:2:1: ", "less than two rows"),
    ("", "", "d.csv:1:1: ", "no header"),
    ("t,speed,force\n0,1,2\n1,1,2\n", "", "d.csv:1:1: ", "give `value` the name of a column; they are t,speed,force"),
    ("t,speed,force\n0,1,2\n1,1,2\n", ", value: forse", "d.csv:1:1: ", "there is no column 'forse'; did you mean 'force'?"),
    ("a,y\n0,1\n1,1\n", "", "d.csv:1:1: ", "give `time` the name of a column"),
    ("t,y,y\n0,1,1\n1,1,1\n", ", value: y", "d.csv:1:1: ", "two columns have the name"),
    ("t,y [furlong]\n0,1\n1,1\n", "", "d.csv:1:6: ", "the unit 'furlong' is unknown"),
    ("t,y [kN m]\n0,1\n1,1\n", ", unit: N m", "d.csv:1:6: ", "the header states the unit 'kN m', and `unit` states 'N m'"),
    ("t,y\n0,1\n1,1\n", ", unit: degrees", "d.csv:1:3: ", "there is no unit 'degrees'"),
    ("t,y [deg]\n0,1\n1,1\n", "", "d.csv:1:3: ", "the values here are in N m, and 'deg' measures another quantity"),
    ("t,y [N]\n0,1\n1,1\n", "", "d.csv:1:3: ", "the values here are in N m, and 'N' measures another quantity"),
    ("t,y\n0,1\n1,1\n", ", unit: mm", "d.csv:1:3: ", "the values here are in N m, and 'mm' measures another quantity"),
    ("t [mm],y\n0,1\n1,1\n", "", "d.csv:1:1: ", "the values here are in s, and 'mm' measures another quantity"),
    ("t;y\n0;1\n1;1\n", ", value: y, time: t", "d.csv:1:1: ", "there is no column 't'"),
    ("t,y\n0,1\n1,1\n", ", slopes: [0, 0]", "s.yaml:5:", "`interpolation: cubic`"),
    ("t,y\n0,1\n1,1\n", ", interpolation: cubic, slopes: [0, 0, 0]", "s.yaml:5:", "a list of two numbers"),
]


def faults(folder):
    problems = []
    for text, keys, where, words in FAULTS:
        (folder / "scenes/d.csv").write_text(text)
        ran = run(folder, SCENE.format(torque=f"{{table: d.csv{keys}}}", duration=1, interval=0.5))
        if ran.returncode != 2 or where not in ran.stderr or words not in ran.stderr or "s.yaml:5:" not in ran.stderr:
            problems.append(f"{text!r}{keys}: status {ran.returncode}, {ran.stderr.strip()!r}")
    ran = run(folder, SCENE.format(torque="{table: absent.csv}", duration=1, interval=0.5))
    problems += [] if ran.returncode == 2 and "absent.csv" in ran.stderr else [f"an absent file: {ran.stderr}"]
    ran = run(folder, SCENE.format(torque="{table: [[0, 0], [1, 1]], unit: N m}", duration=1, interval=0.5))
    problems += [] if ran.returncode == 2 and "'unit' is of a column of a file" in ran.stderr else [f"a key of a list: {ran.stderr}"]
    note(f"{len(FAULTS) + 2} faults")
    return problems


TWO = """kinetree: 1
bodies:
  - {name: turn, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}
  - {name: slide, joint: {type: prismatic}, mass: 1, inertia: [1, 1, 1]}
"""
FITS = [  # what has the table, units that fit, units that do not; without a unit numbers are in SI units
    ("loops: [{{name: l, type: motion, joint: turn, position: {f}}}]", "rad deg 1", "mm rpm s N"),
    ("loops: [{{name: l, type: motion, joint: slide, position: {f}}}]", "m mm 1", "rad deg m/s kg"),
    ("loops: [{{name: l, type: rates, coefficients: {{turn: 1}}, rate: {f}}}]", "rad/s rpm deg/s deg 1", "m/s m N"),
    ("loops: [{{name: l, type: rates, coefficients: {{slide: 1}}, rate: {f}}}]", "m/s km/h 1", "rad/s m deg"),
    ("effects: [{{type: motor, joint: turn, torque: {f}}}]", "N m,kN m,1", "N,rad,W"),
    ("effects: [{{type: motor, joint: slide, torque: {f}}}]", "N kN 1", "mm,N m,Pa"),
    ("effects: [{{type: servo, joint: slide, stiffness: 1, target: {f}}}]", "mm 1", "deg N"),
    ("effects: [{{type: force, at: turn, value: [0, 0, {f}]}}]", "kN 1", "mm,N m"),
    ("effects: [{{type: torque, on: turn, value: [{f}, 0, 0]}}]", "N m,N mm,1", "N,deg"),
    ("effects: [{{type: torque, on: turn, value: [{{sum: [1, {f}]}}, 0, 0]}}]", "N m,1", "N,mm"),
    ("effects: [{{type: motor, joint: turn, torque: {{product: [{f}, {f}]}}}}]", "N mm 1", ""),
]


def fitting_units(folder):
    problems, count = [], 0
    for what, right, wrong in FITS:
        for units, status in ((right, 0), (wrong, 2)):
            for unit in units.split("," if "," in units else None):
                (folder / "scenes/f.csv").write_text(f"t,y [{unit}]\n0,0\n1,1e-3\n")
                text = TWO + what.format(f="{table: f.csv}") + "\nsimulate: {duration: 0.1}\n"
                ran = run(folder, text)
                count += 1
                if ran.returncode != status or (status == 2 and f"'{unit}' measures another quantity" not in ran.stderr):
                    problems.append(f"{what}, {unit}: status {ran.returncode}, {ran.stderr.strip()!r}")
    note(f"{count} units")
    return problems


BRACKETS = [  # header, choice, whether the numbers are taken as they are; rows of the position of a joint that turns
    ("t,y (deg)", ', value: "y (deg)"', False), ("t,y[deg]", ', value: "y[deg]"', False), ("t,y(deg)", ', value: "y(deg)"', False),
    ("t (ms),y", ', time: "t (ms)", value: y', False), ("t,y (rad)", ', value: "y (rad)"', True), ("t,y[2]", ', value: "y[2]"', True),
    ("t,y (mean)", ', value: "y (mean)"', True), ("t,y (mm)", ', value: "y (mm)"', True), ("t,y[min]", ', value: "y[min]"', True),
    ("t,y (deg)", ', value: "y (deg)", unit: rad', True), ("t (ms),y", ', time: "t (ms)", value: y, time_unit: s', True)]


def brackets(folder):
    problems = []
    for header, choice, taken in BRACKETS:
        (folder / "scenes/b.csv").write_text(header + "\n0,0\n1,0.5\n")
        ran = run(folder, DRIVEN.format(position=f"{{table: b.csv{choice}}}", duration=1, interval=0.25))
        if taken:
            problems += [] if ran.returncode == 0 and worst(column(folder, "position.rotor"), lambda t: 0.5 * t) <= 1e-12 else [f"{header}: {ran.stderr}"]
        elif ran.returncode != 2 or "states a unit that is not read" not in ran.stderr:
            problems.append(f"{header}: status {ran.returncode}, {ran.stderr}")
    note(f"{len(BRACKETS)} headers")
    return problems


def torques(folder):
    problems = []
    for unit, factor in (("N m", 1), ("N mm", 1e-3), ("N cm", 1e-2), ("mN m", 1e-3), ("kN m", 1e3)):
        (folder / "scenes/u.csv").write_text(f"t,y [{unit}]\n0,0\n1,3\n")
        ran = run(folder, SCENE.format(torque="{table: u.csv}", duration=1, interval=0.25))
        error = worst(column(folder, "effect.drive.torque [N m]"), lambda t: 3 * t * factor) / factor if ran.returncode == 0 else math.nan
        note(f"torques in {unit} are off by {error:.2g}, relative to 3 N m (bound 3e-15)")
        problems += [] if error <= 1e-15 * 3 else [f"{unit}: {ran.stderr}"]
    return problems


with tempfile.TemporaryDirectory() as name:
    place = pathlib.Path(name)
    claim("clamped_splines_of_files_are_the_polynomials_of_their_rows", polynomials(place))
    claim("columns_have_the_units_of_their_headers_or_of_the_scene", angles(place))
    claim("torques_of_files_have_the_units_of_mechanics", torques(place))
    claim("a_unit_in_other_brackets_is_not_ignored", brackets(place))
    claim("a_unit_measures_the_quantity_that_the_function_is", fitting_units(place))
    claim("faults_of_files_are_told_with_line_and_column", faults(place))
finish()
