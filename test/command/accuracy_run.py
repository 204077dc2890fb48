"""Errors that `accuracy` prints are those of `run`, and its recommendations meet their goals in `run`.

accuracy_run.py [--all] COMMAND SCENES

The test has a reference and a norm of its own. The reference is a run in absolute coordinates, or with another plan, at
the tightest tolerance that works. An error of `run` is the largest distance from it at the records of the study. With
each method, printed errors must agree within 1 %, or within the uncertainty of both references. The quick test takes a
sample of scenes and methods; --all takes 40 scenes, all methods and the recommendations.
"""
import csv
import io
import math
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

ALL = "--all" in sys.argv
COMMAND, SCENES = [word for word in sys.argv[1:] if word != "--all"]
# Scenes and durations, s.
QUICK = {"shot": 0.6, "cart-pole": 1.5, "slider-crank-spring": 0.5, "four-bar": 0.5}
LONG = {**QUICK, "andrews": 0.03, "bicycle-point": 1, "bricard": 1, "chain": 1, "double-pendulum": 2, "dc-motor": 1,
        "conical-pendulum": 2, "engine-mounts": 0.5, "five-bar": 1, "flip": 1, "flyball-governor": 2,
        "furuta-pendulum": 1, "ground-resonance": 1, "hooke-shaft": 1, "lag-dampers": 1, "lagrange-top": 0.5,
        "leaking-pendulum": 2, "mathieu": 2, "n-four-bar-2": 1, "pendulum": 3, "pid-arm": 1, "point-pendulum": 2,
        "precessing-top": 0.5, "quarter-car": 1, "rocket": 1, "rod-chain-3": 1, "scissor-lift": 0.5, "servo-arm": 1,
        "slider-crank": 0.5, "spherical-pendulum": 2, "spinning-top": 0.5, "stephenson": 0.5, "tethered-satellites": 10,
        "three-body": 2, "trolley": 1, "walking-beam-pump": 0.5, "watt": 0.5, "hydraulic-cylinder": 0.2, "bead": 1}
TOLERANCES = "1e-4,1e-6,1e-8"


def kinetree(*words):
    return subprocess.run([COMMAND, *map(str, words)], capture_output=True, text=True, timeout=600)


def kinds(path, columns):
    """The columns of each joint, and whether they are a length, an angle, a rotation or a free joint."""
    text = pathlib.Path(path).read_text()
    found = []
    for name in dict.fromkeys(re.match(r"position\.([^\[]+)", c)[1] for c in columns if c.startswith("position.")):
        own = [i for i, c in enumerate(columns) if c == f"position.{name}" or c.startswith(f"position.{name}[")]
        joint = re.search(rf"- \{{?name: {re.escape(name)}[,\n].*?type: (\w+)", text, re.S)
        kind = joint[1] if joint else "revolute"
        if len(own) == 1:
            found.append((own, "length" if kind == "prismatic" else "angle"))
        elif kind == "universal":
            found += [([i], "angle") for i in own]
        elif len(own) == 4:
            found.append((own, "rotation"))
        elif len(own) == 7:
            found += [(own[:3], "length"), (own[3:], "rotation")]
        else:
            return None
    return found


def distance(kind, a, b, length):
    if kind == "angle":
        return abs(math.remainder(a[0] - b[0], 2.0 * math.pi))
    if kind == "length":
        return math.dist(a, b) / length
    dot = abs(sum(x * y for x, y in zip(a, b)))
    sine = math.sqrt(sum((x - y if sum(p * q for p, q in zip(a, b)) > 0 else x + y)**2 for x, y in zip(a, b)))
    return 4.0 * math.asin(min(1.0, 0.5 * sine)) if dot > 0.5 else 2.0 * math.acos(min(1.0, dot))


def run(path, duration, records, *words):
    ended = kinetree("run", path, "--duration", repr(duration), "--interval", repr(duration / records), "--record", "position",
                     "--out", "-", "--quiet", *words)
    if ended.returncode not in (0, 1) or not ended.stdout:
        return None, None
    rows = list(csv.reader(io.StringIO(ended.stdout)))
    times = [float(row[0]) for row in rows[1:]]
    if abs(times[-1] - duration) > 1e-9 * duration:
        return None, None
    return rows[0], [[float(x) if x else math.nan for x in row] for row in rows[1:]]


def error_between(parts, length, a, b):
    return max(distance(kind, [x[i] for i in own], [y[i] for i in own], length) for x, y in zip(a, b) for own, kind in parts)


def find_reference(path, duration, records):
    """Two solutions that share no equations, or no method, and their columns."""
    found = []
    for words in (("--formulation", "absolute", "--integrator", "dop853"), ("--plan", "spatial", "--integrator", "dop853"),
                  ("--plan", "spatial", "--integrator", "tsit5")):
        for tolerance in ("1e-13", "1e-12", "1e-11"):
            head, rows = run(path, duration, records, "--tolerance", tolerance, *words)
            if rows:
                found.append((head, rows))
                break
    return found


def methods():
    return [line.split()[0] for line in kinetree("integrators").stdout.partition("\n\n")[0].splitlines()[1:]]


class Study:
    """A study of a scene, with its own reference and norm."""

    def __init__(self, path, duration, *words):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "points.csv"
            ended = kinetree("accuracy", path, "--duration", repr(duration), "--out", out, "--plot", "/dev/null", *words)
            self.text = ended.stdout
            self.points = list(csv.DictReader(out.open(newline=""))) if out.exists() else []
        head = re.search(r"^  (\S+) s in (\d+) records", self.text, re.M)
        self.fault = None if head else (ended.stderr.strip().splitlines() or ["no output"])[-1]
        if self.fault:
            return
        self.duration, self.records = float(head[1]), int(head[2])
        length = re.search(r"lengths over (\S+) m", self.text)
        self.length = float(length[1]) if length else 1.0
        self.uncertainty = float(re.search(r"they differ by (\S+)", self.text)[1])
        references = find_reference(path, self.duration, self.records)
        self.columns, self.reference = references[0] if references else (None, None)
        self.parts = kinds(path, self.columns) if references else None
        if len(references) < 2 or self.parts is None:
            self.fault = "no reference of the test's own, or a joint that the test does not have"
            return
        own = [rows for head, rows in references if head == self.columns]
        self.own = max((error_between(self.parts, self.length, own[0], other) for other in own[1:]), default=0.0)

    def error(self, path, method, kind, setting):
        head, rows = run(path, self.duration, self.records, "--integrator", method, f"--{kind}", setting)
        return error_between(self.parts, self.length, self.reference, rows) if rows and head == self.columns else None

    def room(self, error):
        return 0.01 * error + 2.0 * (self.uncertainty + self.own)


def check_errors(name, duration, chosen):
    path = f"{SCENES}/{name}.yaml"
    steps = f"{duration / 397:.3g},{duration / 1601:.3g}"
    study = Study(path, duration, "--integrators", ",".join(chosen), "--steps", steps, "--tolerances", TOLERANCES, "--budget", "30")
    if study.fault:
        claim(f"printed_errors_are_those_of_run: {name}", [study.fault])
        return 0
    wrong, worst = [], 0.0
    for point in study.points:
        if point["status"] not in ("ok", "below the reference"):
            continue
        printed, found = float(point["error.position"]), study.error(path, point["method"], point["kind"], point["setting"])
        if found is None:
            wrong.append(f"{point['method']} at {point['kind']} {point['setting']}: run fails")
            continue
        worst = max(worst, abs(printed - found) / study.room(max(printed, found)))
        if abs(printed - found) > study.room(max(printed, found)):
            wrong.append(f"{point['method']} at {point['kind']} {point['setting']}: printed {printed:.4g}, of run {found:.4g}")
    note(f"{name}: {len(study.points)} points, worst difference {worst:.2g} of the bound, own uncertainty {study.own:.2g}")
    claim(f"printed_errors_are_those_of_run: {name}", wrong + ([] if study.points else ["no point"]))
    return len(study.points)


def check_recommendations(name, duration, budget):
    path = f"{SCENES}/{name}.yaml"
    study = Study(path, duration, "--budget", budget, "--goal", "1e-3,1e-5,1e-7")
    wrong = [study.fault] if study.fault else []
    told = re.findall(r"^for (\S+) \S+ use (\S+) with (step|tolerance) ([\d.e+-]+)(?:,([\d.e+-]+))?", study.text, re.M)
    for goal, method, kind, setting, absolute in told if not wrong else []:
        error = study.error(path, method, kind, f"{setting},{absolute}" if absolute else setting)
        if error is None or error > float(goal) + study.own:
            wrong.append(f"{method} with {kind} {setting} has {error} for {goal}")
    claim(f"recommendations_meet_their_goals_in_run: {name}", wrong + ([] if told or wrong else ["no recommendation"]))
    return len(told)


def main():
    chosen = methods() if ALL else ["rk4", "ab4", "bdf2", "rkc4", "dopri5", "auto", "rodas5p", "radau5"]
    points = sum(check_errors(name, duration, chosen) for name, duration in (LONG if ALL else QUICK).items())
    note(f"{points} points")
    names = LONG.items() if ALL else list(QUICK.items())[:2]
    told = sum(check_recommendations(name, duration, "10" if ALL else "3") for name, duration in names)
    note(f"{told} recommendations")
    finish()


main()
