"""Errors that `accuracy` prints are those of `run`, and its recommendations meet their goals in `run`.

accuracy_run.py [--all] COMMAND SCENES

The test has a reference and a norm of its own. The reference is a run in absolute coordinates, or with another plan, at
the tightest tolerance that works. An error of `run` is the largest distance from it at the records of the study. With
each method, printed errors must agree within 1 %, or within the uncertainty of both references. The quick test takes a
sample of scenes and methods; --all takes 46 scenes, all methods and the recommendations.

Three scenes have hard contacts. Their errors are those outside of windows about the events of the reference. The test
takes the events from the summary of its own reference.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import json
import pathlib
import re
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note
from errors_of_runs import error_between, kinds, kinetree, run

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
CONTACTS = {"clutch": 2, "bouncing-ball": 5, "rocking-block": 2} # all methods of --all, and time stepping
CHOSEN = ["rk4", "dopri5", "auto", "radau5", "steps"]
TOLERANCES = "1e-4,1e-6,1e-8"


def find_reference(path, duration, records):
    """Two solutions that share no equations, or no method, and their columns."""
    found = []
    for words in (("--formulation", "absolute", "--integrator", "dop853"), ("--plan", "spatial", "--integrator", "dop853"),
                  ("--plan", "spatial", "--integrator", "tsit5")):
        for tolerance in ("1e-13", "1e-12", "1e-11"):
            head, rows = run(COMMAND, path, duration, records, "--tolerance", tolerance, *words)
            if rows:
                found.append((head, rows))
                break
    return found


def methods():
    return [line.split()[0] for line in kinetree(COMMAND, "integrators").stdout.partition("\n\n")[0].splitlines()[1:]]


def events_of(path, duration, interval):
    """The instants of hard contacts and events, from the summary of a run."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "summary.json"
        kinetree(COMMAND, "run", path, "--duration", repr(duration), "--interval", repr(interval), "--integrator", "dop853", "--tolerance",
                 "1e-13", "--out", "/dev/null", "--summary", out, "--quiet")
        return [mark["time"] for mark in json.loads(out.read_text())["marks"]]


class Study:
    """A study of a scene, with its own reference and norm."""

    def __init__(self, path, duration, *words):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "points.csv"
            ended = kinetree(COMMAND, "accuracy", path, "--duration", repr(duration), "--out", out, "--plot", "/dev/null", *words)
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
        self.kept = self.outside_of_windows(path)
        self.own = max((self.distance(own[0], other) for other in own[1:]), default=0.0)

    def outside_of_windows(self, path):
        """The records that are compared."""
        width = re.search(r"windows of \+-(\S+) s about", self.text)
        times = [i * self.duration / self.records for i in range(self.records + 1)]
        events = events_of(path, self.duration, self.duration / self.records) if width else []
        return [i for i, t in enumerate(times) if all(abs(t - event) > float(width[1]) for event in events)]

    def distance(self, a, b):
        return error_between(self.parts, self.length, [a[i] for i in self.kept], [b[i] for i in self.kept])

    def error(self, path, method, kind, setting):
        words = ("--integrator", method, f"--{kind}", setting)
        if method == "steps":
            words = ("--set", "simulate.contact=steps", "--set", f"simulate.step={setting}")
        head, rows = run(COMMAND, path, self.duration, self.records, *words)
        return self.distance(self.reference, rows) if rows and head == self.columns else None

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
    contacts = list(CONTACTS.items()) if ALL else list(CONTACTS.items())[:1]
    points += sum(check_errors(name, duration, CHOSEN) for name, duration in contacts)
    note(f"{points} points")
    names = LONG.items() if ALL else list(QUICK.items())[:2]
    told = sum(check_recommendations(name, duration, "10" if ALL else "3") for name, duration in names)
    note(f"{told} recommendations")
    finish()


main()
