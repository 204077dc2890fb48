"""FMUs that a scene couples (effects of the type `fmu`), in `kinetree` as a whole.

couple.py COMMAND SAMPLED GUEST-2 GUEST-3 COMPILER...

GUEST-2 and GUEST-3 are binaries of guest.c for both versions of FMI. The environment variable KT_REFERENCE_FMUS names a folder with the
sources of modelica/Reference-FMUs. They are built with the compiler, and their published results are compared. If it
is not set, this claim is skipped.
"""
import csv
import json
import math
import os
import pathlib
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zipfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, skip

COMMAND, SAMPLED, *GUESTS = (str(pathlib.Path(word).resolve()) for word in sys.argv[1:5])
COMPILER = sys.argv[5:]
FOLDERS = {2: {"x86_64": "linux64"}.get(platform.machine(), f"{platform.machine()}-linux"), 3: f"{platform.machine()}-linux"}
STEP = 0.01

VARIABLES = [("angle", 0, "input", "rad"), ("rate", 1, "input", "rad/s"), ("stiffness", 2, "parameter", None),
             ("damping", 3, "parameter", None), ("torque", 4, "output", "N.m"), ("delayed", 5, "output", None),
             ("integral", 6, "output", None), ("count", 10, "output", None), ("last", 11, "parameter", None),
             ("fails", 12, "parameter", None), ("off", 20, "input", None)]


def describe(version, simulates=True, saves=True, rate="rad/s", torque="N.m"):
    words = []
    for name, reference, causality, unit in VARIABLES:
        kind = "Float64" if reference < 10 else "Int32" if reference < 20 else "Boolean"
        varies = {"parameter": "fixed"}.get(causality, "continuous" if kind == "Float64" else "discrete")
        start = "" if causality == "output" else f' start="{"false" if kind == "Boolean" else 1 if name == "stiffness" else 0}"'
        unit = f' unit="{dict(rate=rate, torque=torque).get(name, unit)}"' if unit else ""
        head = f'name="{name}" valueReference="{reference}" causality="{causality}" variability="{varies}"'
        kind = {"Float64": "Real", "Int32": "Integer"}.get(kind, kind) if version == 2 else kind
        words.append(f"<ScalarVariable {head}><{kind}{unit}{start}/></ScalarVariable>" if version == 2 else f"<{kind} {head}{unit}{start}/>")
    token, state = ("guid", "state") if version == 2 else ("instantiationToken", "State")
    can = f' canGetAndSetFMU{state}="true" canSerializeFMU{state}="true"' if saves else ""
    return (f'<?xml version="1.0" encoding="UTF-8"?>\n<fmiModelDescription fmiVersion="{version}.0" modelName="guest" {token}="{{guest}}">'
            f'<{"CoSimulation" if simulates else "ModelExchange"} modelIdentifier="guest"{can}/>'
            '<UnitDefinitions><Unit name="rad"><BaseUnit rad="1"/></Unit><Unit name="rad/s"><BaseUnit rad="1" s="-1"/></Unit>'
            '<Unit name="deg/s"><BaseUnit rad="1" s="-1" factor="0.017453292519943295"/></Unit>'
            '<Unit name="N.m"><BaseUnit kg="1" m="2" s="-2"/></Unit>'
            '<Unit name="kN.m"><BaseUnit kg="1" m="2" s="-2" factor="1000"/></Unit></UnitDefinitions>'
            f'<ModelVariables>{"".join(words)}</ModelVariables><ModelStructure/></fmiModelDescription>')


def pack(path, version, binary, where=None, resources=False, **how):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", describe(version, **how))
        archive.write(binary, f"binaries/{where or FOLDERS[version]}/guest.so")
        if resources:
            archive.writestr("resources/table.txt", "1 2 3\n")
    return path


SCENE = """kinetree: 1
gravity: [0, -9.81, 0]
parameters: {gain: 20}
bodies:
  - {name: arm, joint: {type: revolute, axis: z, position: 30 deg}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}
states: {n: {rate: 0}, u: {rate: 0}, before: {rate: 0}}
effects:
  - {type: joint_damper, joint: arm, damping: 0.1}
  - type: fmu
    name: pd
    file: FILE
    step: 0.01
    inputs: {angle: position.arm, rate: velocity.arm, off: 0}
    outputs: {torque: arm, count: n}
    parameters: {stiffness: =gain, damping: 3}
simulate: {duration: 1, integrator: rk4, step: 0.001}
output: {interval: 0.01, record: [position, velocity, state]}
"""


class Bench:
    def __init__(self, folder):
        self.folder, self.empty = folder, folder / "temporary %41"  # characters that a URI escapes
        self.empty.mkdir()
        self.binary = dict(zip((2, 3), GUESTS))
        self.fmu = {version: pack(folder / f"guest{version}.fmu", version, self.binary[version]) for version in (2, 3)}
        self.leaks = []

    def scene(self, name, *edits, fmu=None):
        text = SCENE.replace("FILE", str(fmu or self.fmu[3]))
        for before, after in edits:
            assert before in text, before
            text = text.replace(before, after)
        path = self.folder / f"{name}.yaml"
        path.write_text(text)
        return path

    def run(self, *words, kill=None):
        """Exit code, standard output, standard error. Folders that remain are noted."""
        ended = subprocess.run([COMMAND, *map(str, words)], capture_output=True, text=True, env={**os.environ, "TMPDIR": str(self.empty)}, cwd=self.folder)
        left = list(self.empty.iterdir())
        if left:
            self.leaks.append(f"{' '.join(map(str, words))} leaves {left[0].name}")
        for folder in left:
            shutil.rmtree(folder)
        return ended.returncode, ended.stdout, ended.stderr

    def rows(self, scene, *options):
        out = self.folder / f"{scene.stem}.csv"
        code, _, words = self.run("run", scene, "--out", out, "--quiet", *options)
        if code != 0:
            return [], f"{scene.stem}: exit {code}: {words.strip()}"
        with out.open() as file:
            return list(csv.DictReader(file)), None

    def result(self, scene, *options):
        """The text of the records."""
        rows, wrong = self.rows(scene, *options)
        return wrong or (self.folder / f"{scene.stem}.csv").read_text()


def numbers(rows, name):
    return [float(row[name]) for row in rows]


def sampled_law(b):
    """The FMU and a program with the same law: equal bits, since both have the same steps and the same sums."""
    problems = []
    plant = b.folder / "plant.yaml"
    text = SCENE[:SCENE.index("  - type: fmu")] + "  - {type: expression, joint: arm, force: u}\n" + SCENE[SCENE.index("simulate:"):]
    plant.write_text(text.replace("states: {n: {rate: 0}, u: {rate: 0}, before: {rate: 0}}", "states: {u: {rate: 0}}"))
    ended = subprocess.run([SAMPLED, plant, str(STEP), "20", "3", "100"], capture_output=True, text=True)
    law = [line.split(",") for line in ended.stdout.splitlines()]
    rows, wrong = b.rows(b.scene("pd"))
    if wrong or ended.returncode != 0 or len(rows) != 101 or len(law) != 100:
        return [wrong or f"{len(rows)} rows, {len(law)} of the program, {ended.stderr}"]
    worst = 0.0
    for row, (_, q, v) in zip(rows[1:], law):
        worst = max(worst, abs(float(row["position.arm"]) - float(q)), abs(float(row["velocity.arm"]) - float(v)))
    note(f"largest difference {worst:g}, bound 0; the arm moves by {abs(float(law[-1][1]) - math.pi / 6):.3g} rad")
    if not worst == 0.0 or not abs(float(law[-1][1]) - math.pi / 6) > 0.1:
        problems.append(f"the motions differ by {worst:g}")
    return problems


def both_versions(b):
    """FMI 2.0 and 3.0."""
    third, second = b.result(b.scene("third")), b.result(b.scene("second", fmu=b.fmu[2]))
    return [] if third == second and third.count("\n") == 102 else [f"{len(third)} and {len(second)} characters differ: {third[:200]} {second[:200]}"]


HOLD = [("outputs: {torque: arm, count: n}", "outputs: {torque: u, count: n, delayed: before}"), ("angle: position.arm, rate: velocity.arm", 'angle: "sin(7*t)"'),
        ("damping: 3}", "damping: 0}"), ("gain: 20", "gain: -1"), ("record: [position, velocity, state]", "record: [state]")]


def feedthrough(b):
    """Between points k and k + 1: the count is k, a direct output is of point k, one of the last step of point k - 1."""
    problems = []
    for interval, integrator, step in ((0.0033, "rk4", 0.01), (0.0047, "dopri5", 0.013), (0.05, "dopri5", 0.007), (0.0301, "rk4", 0.0017)):
        edits = [*HOLD, ("interval: 0.01", f"interval: {interval}"), ("step: 0.01\n", f"step: {step}\n")]
        if integrator == "dopri5":
            edits.append(("integrator: rk4, step: 0.001", "integrator: dopri5, tolerance: 1e-8"))
        rows, wrong = b.rows(b.scene("hold", *edits))
        if wrong:
            return [wrong]
        law = lambda k: math.sin(7 * (k * step)) if k >= 0 else 0.0
        worst = 0.0
        for row in rows[1:]:
            t = float(row["time"])
            k = math.floor(t / step)
            if abs(t / step - round(t / step)) < 1e-6:
                continue  # rounding decides on which side of a point the row is
            off = max(abs(float(row["state.u"]) - law(k)), abs(float(row["state.before"]) - law(k - 1)), abs(float(row["state.n"]) - k))
            worst = off if not off <= worst else worst
        bound = 7 * 4 * 2.3e-16 + 4.5e-16
        note(f"steps of {step} s, a row every {interval} s, {integrator}: {worst:.3g} off, bound {bound:.3g} (four units of rounding of the time, two of the sine)")
        if not worst <= bound or len(rows) < 20:
            problems.append(f"steps of {step} s, a row every {interval} s: {worst:g} off, {len(rows)} rows")
    return problems


def parameter_of_scene(b):
    """An output sets a parameter that numbers of the scene follow: the damping of a joint."""
    scene = b.scene("sets", ("parameters: {gain: 20}", "parameters: {gain: 1, c: 0.1}"), ("damping: 0.1}", "damping: =2*c}"),
                    ("outputs: {torque: arm, count: n}", "outputs: {torque: c}"), ("angle: position.arm, rate: velocity.arm", "angle: -0.4"), ("damping: 3}", "damping: 0}"))
    fixed = b.folder / "fixed.yaml"
    fixed.write_text(SCENE[:SCENE.index("  - type: fmu")].replace("damping: 0.1}", "damping: 0.8}") + SCENE[SCENE.index("simulate:"):])
    rows, wrong = b.rows(scene)
    other, wrong_too = b.rows(fixed)
    if wrong or wrong_too:
        return [wrong or wrong_too]
    worst = max(abs(x - y) for x, y in zip(numbers(rows, "position.arm"), numbers(other, "position.arm")))
    held = set(numbers(rows, "state.c"))
    note(f"the damper has {held}; {worst:g} off a scene with this damping, bound 0")
    return [] if worst == 0.0 and held == {0.4} else [f"{worst:g} off, c is {held}"]


def ends(b):
    """The FMU ends the simulation, as `until` does."""
    problems = []
    for version in (2, 3):
        summary = b.folder / "ends.json"
        scene = b.scene("ends", ("damping: 3}", "damping: 3, last: 37}"), fmu=b.fmu[version])
        code, _, words = b.run("run", scene, "--out", b.folder / "ends.csv", "--summary", summary)
        found = json.loads(summary.read_text()) if summary.exists() else {}
        time_ = found.get("time", {}).get("end") if isinstance(found.get("time"), dict) else found.get("time")
        note(f"FMI {version}: exit {code}, ended by {found.get('ended_by')}, {words.splitlines()[0] if words else ''}")
        if code != 0 or found.get("ended_by") != "pd" or "ended the simulation at t = 0.37 s" not in words:
            problems.append(f"FMI {version}: exit {code}, {words}")
    return problems


def failures(b):
    """Wrong files and scenes, each with the words and the exit status that it must give."""
    folder, problems = b.folder, []
    (folder / "text.fmu").write_text("no archive\n")
    with zipfile.ZipFile(folder / "bare.fmu", "w") as archive:
        archive.writestr("readme.txt", "none")
    with zipfile.ZipFile(folder / "broken.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", "<fmiModelDescription fmiVersion='3.0'>\n<CoSimulation")
    with zipfile.ZipFile(folder / "first.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", "<fmiModelDescription fmiVersion='1.0'/>")
    with zipfile.ZipFile(folder / "climbs.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", describe(3))
        archive.write(b.binary[3], f"binaries/{FOLDERS[3]}/guest.so")
        archive.writestr("../outside.txt", "x")
    with zipfile.ZipFile(folder / "text-binary.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", describe(3))
        archive.writestr(f"binaries/{FOLDERS[3]}/guest.so", "no binary")
    whole = pathlib.Path(b.binary[3]).read_bytes()
    (folder / "half.so").write_bytes(whole[:len(whole) // 3])
    pack(folder / "cut.fmu", 3, folder / "half.so")
    with zipfile.ZipFile(folder / "reference.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", describe(3).replace('valueReference="3"', 'valueReference="4294967299"'))
    pack(folder / "elsewhere.fmu", 3, b.binary[3], where="riscv-none")
    pack(folder / "exchange.fmu", 3, b.binary[3], simulates=False)
    pack(folder / "mixed.fmu", 3, b.binary[2])
    inputs, outputs, parameters = "angle: position.arm", "torque: arm", "damping: 3"
    cases = [("missing", [("FILE", "nowhere.fmu")], 2, "missing.yaml:9:5: effect 'pd': ", "nowhere.fmu cannot be read: No such file"),
             ("text", [("FILE", "text.fmu")], 2, "text.yaml:9:5: effect 'pd': ", "is no FMU: it is no zip archive"),
             ("bare", [("FILE", "bare.fmu")], 2, "bare.yaml:9:5: ", "has no modelDescription.xml"),
             ("broken", [("FILE", "broken.fmu")], 2, "modelDescription.xml:2:", "no well-formed XML"),
             ("first", [("FILE", "first.fmu")], 2, "FMI 1.0", "export it with FMI 2.0 or 3.0"),
             ("elsewhere", [("FILE", "elsewhere.fmu")], 2, "elsewhere.yaml:9:5: ", f"has no binary for this system, binaries/{FOLDERS[3]}/guest.so"),
             ("exchange", [("FILE", "exchange.fmu")], 2, "exchange.yaml:9:5: ", "has no co-simulation, but model exchange alone"),
             ("mixed", [("FILE", "mixed.fmu")], 2, "mixed.yaml:9:5: ", "its binary has no function fmi3"),
             ("climbs", [("FILE", "climbs.fmu")], 2, "climbs.yaml:9:5: ", "leads out of the archive"),
             ("loads", [("FILE", "text-binary.fmu")], 2, "loads.yaml:9:5: ", "its binary cannot be loaded"),
             ("cut", [("FILE", "cut.fmu")], 2, "cut.yaml:9:5: ", "its binary is cut off; export the FMU again"),
             ("reference", [("FILE", "reference.fmu")], 2, "reference.yaml:9:5: ", "the valueReference '4294967299' of its variable 'damping' is no whole number of 32 bits"),
             ("input", [(inputs, "angel: position.arm")], 2, "input.yaml:13:14: ", "FMU 'pd' has no variable 'angel'; did you mean 'angle'?"),
             ("stranger", [(inputs, "voltage_of_motor: position.arm")], 2, "stranger.yaml:13:14: ", "FMU 'pd' has no variable 'voltage_of_motor'; these can be an input: 'angle'"),
             ("output", [(outputs, "torqe: arm")], 2, "output.yaml:14:15: ", "did you mean 'torque'?"),
             ("parameter", [(parameters, "dampin: 3")], 2, "parameter.yaml:15:36: ", "did you mean 'damping'?"),
             ("role", [(inputs, "torque: position.arm")], 2, "role.yaml:13:14: ", "is no variable that can be an input: its causality is 'output'"),
             ("whole", [(parameters, "last: 2.5")], 2, "whole.yaml:15:36: ", "2.5 is no value of its variable 'last', which is Int32"),
             ("joint", [(outputs, "torque: amr")], 2, "joint.yaml:14:23: ", "did you mean 'arm'?"),
             ("formula", [(inputs, "angle: position.amr")], 2, "formula.yaml:13:21: ", "position.amr"),
             ("key", [("inputs:", "input:")], 2, "key.yaml:13:5: ", "did you mean 'inputs'?"),
             ("step", [("step: 0.01\n", "step: 0\n")], 2, "step.yaml:12:11: ", "must be greater than 0"),
             ("twice", [(outputs + ", count: n", "count: n, delayed: n")], 2, "twice.yaml:14:14: ", "two outputs set 'n'"),
             ("fails", [(parameters, "damping: 3, fails: 5")], 4, "event 'pd' at t = 0.05 s: FMU 'pd' at t = 0.04 s: DoStep returned an error: step 5 of the guest fails", "FMU 'pd' at t = 0.04 s: step 5 of the guest fails, category logStatusError"),
             ("early", [(parameters, "damping: 3, fails: -5")], 4, "event 'pd' at t = 0.05 s: FMU 'pd' at t = 0.04 s: ", "the step returned early, which this importer does not allow"),
             ("infinite", [(inputs, 'angle: "1/(t-0.02)"')], 4, "event 'pd' at t = 0.02 s: FMU 'pd' at t = 0.02 s: ", "is no value of its variable 'angle'")]
    for name, edits, status, *words in cases:
        edits = [(before.replace("FILE", str(b.fmu[3])), after) for before, after in edits]
        code, _, errors = b.run("run", b.scene(name, *edits), "--out", folder / f"{name}.csv")
        missing = [word for word in words if word not in errors]
        if code != status or missing:
            problems.append(f"{name}: exit {code} instead of {status}, without {missing}: {errors.strip()[:300]}")
        if status == 2 and name != "mixed":  # the functions of a binary are found as it is loaded, which runs it
            code, _, errors = b.run("check", folder / f"{name}.yaml")
            if code != 2 or any(word not in errors for word in words):
                problems.append(f"{name}: check exits with {code}: {errors.strip()[:300]}")
    note(f"{len(cases)} wrong files and scenes")
    return problems


def doubts(b):
    """Units that differ and inputs without a value are warnings."""
    pack(b.folder / "degrees.fmu", 3, b.binary[3], rate="deg/s", torque="kN.m")
    scene = b.scene("degrees", (", off: 0", ""), fmu=b.folder / "degrees.fmu")
    code, _, errors = b.run("check", scene)
    note(errors.strip().replace("\n", " | ")[:300])
    words = ["degrees.yaml:13:35: warning: units differ: 'rate' is in deg/s, and the scene has rad/s here; convert it in a formula",
             "degrees.yaml:14:15: warning: units differ: 'torque' is in kN.m, and the scene has N m here; make the output a parameter, and convert that in the formulas that use it",
             "1 input, 'off', keeps the start value"]
    return [f"exit {code}, without '{word}': {errors}" for word in words if word not in errors or code != 0]


def subcommands(b):
    """All subcommands that follow the motion have the FMU; the others reject or report it."""
    problems, scene = [], b.scene("whole-motion")
    rows, wrong = b.rows(scene)
    table = b.folder / "sweep.csv"
    code, _, errors = b.run("sweep", scene, "--vary", "gain=5,20,40", "--vary", "effects.pd.step=0.01,0.05", "--out", table, "--quiet")
    lines = list(csv.DictReader(table.open())) if code == 0 else []
    for line in lines:
        again, wrong = b.rows(scene, "--set", f"gain={line['gain']}", "--set", f"effects.pd.step={line['effects.pd.step']}")
        if wrong or again[-1]["position.arm"] != line["position.arm.end"]:
            problems.append(f"gain {line['gain']}: {wrong or again[-1]['position.arm']} instead of {line['position.arm.end']}")
    if len({line["position.arm.end"] for line in lines}) != 6:
        problems.append(f"sweep: exit {code}, {len(lines)} lines: {errors.strip()[:300]}")
    for words in (("view", scene, "--view", b.folder / "v.html"), ("draw", scene, "--at", "0,0.5", "--out", b.folder / "d.svg"), ("draw", scene, "--strobe", "4", "--out", b.folder / "e.svg"),
                  ("check", scene), ("info", scene)):
        code, _, errors = b.run(*words)
        if code != 0:
            problems.append(f"{words[0]}: exit {code}: {errors.strip()[:300]}")
    for words, text in ((("run", scene, "--out", b.folder / "s.csv", "--scene", b.folder / "s.yaml"), "FMU 'pd' begins anew in this scene"), (("stability", scene), "FMU 'pd' is left out"), (("accuracy", scene), "FMU 'pd' is left out"), (("evaluate", scene), "FMU 'pd' is left out"),
                        (("modes", scene), "FMU 'pd' is left out"), (("equilibrium", scene), "FMU 'pd' is left out"), (("export", "--fmu", scene, "--out", b.folder / "x.fmu"), "export: FMU 'pd': "),
                        (("export", "--c", scene, "--out", b.folder / "x.c"), "export: FMU 'pd': "), (("export", "--mjcf", scene, "--out", b.folder / "x.xml"), "export: FMU 'pd': ")):
        code, _, errors = b.run(*words)
        note(f"{words[0]}: exit {code}: {next((line for line in errors.splitlines() if 'pd' in line), '')[:150]}")
        if text not in errors:
            problems.append(f"{words[0]}: exit {code}, without {text}: {errors.strip()[:300]}")
    written, again = b.folder / "s.yaml", b.folder / "s-again.yaml"
    start, wrong = b.rows(written)
    code, _, errors = b.run("run", written, "--duration", "0", "--out", b.folder / "s.csv", "--scene", again)
    if wrong or start[0]["position.arm"] != rows[-1]["position.arm"] or float(start[-1]["state.n"]) != 99 or code != 0:
        problems.append(f"the written scene: {wrong or (start[0], start[-1], errors)}")
    elif written.read_text().split("effects:")[1] != again.read_text().split("effects:")[1].replace("duration: 0", "duration: 1"):
        problems.append(f"it is written anew as {again.read_text()} instead of {written.read_text()}")
    note(f"{len(lines)} runs of a sweep have the ends of single runs, bit for bit")
    return problems


def checkpoints(b):
    """A run that was killed goes on with equal bits; an FMU without serialisation is rejected."""
    problems = []
    for version in (2, 3):
        edits = [("duration: 1,", "duration: 600,"), ("interval: 0.01,", "interval: 0.2,"), ("outputs: {torque: arm, count: n}", "outputs: {torque: arm, count: n, integral: u}")]
        scene = b.scene(f"long{version}", *edits, fmu=b.fmu[version])
        whole = b.result(scene)
        out, saved = b.folder / "part.csv", b.folder / "part.saved"
        for path in b.folder.glob("part.*"):
            path.unlink()
        process = subprocess.Popen([COMMAND, "run", scene, "--out", out, "--checkpoint", saved, "--checkpoint-interval", "0.02", "--quiet"], env={**os.environ, "TMPDIR": str(b.empty)})
        begin = time.monotonic()
        while process.poll() is None and time.monotonic() - begin < 60 and not (saved.exists() and saved.stat().st_size > 0):
            time.sleep(0.005)
        time.sleep(0.05)
        killed = process.poll() is None
        if killed:
            process.send_signal(signal.SIGKILL)
        process.wait()
        left = list(b.empty.iterdir())
        code, _, errors = b.run("run", scene, "--out", out, "--resume", saved, "--quiet")
        note(f"FMI {version}: killed {killed}, resumed with exit {code}, {len(left)} temporary folders after the kill")
        if not killed or code != 0 or out.read_text() != whole or left:
            problems.append(f"FMI {version}: killed {killed}, exit {code}, {errors.strip()[:300]}, left {left}")
    pack(b.folder / "forgets.fmu", 3, b.binary[3], saves=False)
    code, _, errors = b.run("run", b.scene("forgets", fmu=b.folder / "forgets.fmu"), "--out", b.folder / "f.csv", "--checkpoint", b.folder / "f.saved")
    if code != 1 or "its state cannot be saved" not in errors:
        problems.append(f"without serialisation: exit {code}: {errors.strip()[:300]}")
    return problems


def own_export(b):
    """A plant that Kinetree has exported, coupled by Kinetree: the columns of its own run."""
    plant = b.folder / "swing.yaml"
    plant.write_text("kinetree: 1\nname: swing\ngravity: [0, -9.81, 0]\nbodies:\n  - {name: bob, joint: {type: revolute, axis: z, position: 1}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}\n"
                     "simulate: {integrator: rk4, step: 0.001, duration: 0.5}\noutput: {interval: 0.01}\n")
    own, wrong = b.rows(plant)
    for version in (2, 3):
        code, _, errors = b.run("export", "--fmu", plant, "--fmi", str(version), "--out", b.folder / f"swing{version}.fmu")
        if code != 0:
            if "not" in errors and "FMU" in errors and "build" in errors:
                skip("kinetree_couples_its_own_fmus", errors.strip())
                return None
            return [f"export: exit {code}: {errors.strip()[:300]}"]
        scene = b.scene(f"swings{version}", ("inputs: {angle: position.arm, rate: velocity.arm, off: 0}", "inputs: {}"), ("outputs: {torque: arm, count: n}", "outputs: {position.bob: n, velocity.bob: u}"),
                        ("    parameters: {stiffness: =gain, damping: 3}\n", ""), ("duration: 1,", "duration: 0.506,"), ("interval: 0.01,", "interval: 0.002,"), fmu=b.folder / f"swing{version}.fmu")
        rows, wrong = b.rows(scene)
        if wrong:
            return [wrong]
        worst = max(abs(float(rows[5 * k + 2]["state.n"]) - float(row["position.bob"])) for k, row in enumerate(own))
        note(f"FMI {version}: {len(own)} points, {worst:g} off its own run, bound 0; it moves by {abs(float(own[-1]['position.bob']) - 1):.3g} rad")
        if not worst == 0.0 or not abs(float(own[-1]["position.bob"]) - 1) > 0.1:
            return [f"FMI {version}: {worst:g} off"]
    return []


# Model: step, duration, outputs, further inputs. Booleans and whole numbers are compared, too.
REFERENCE = {"BouncingBall": (0.01, 3.0, {"h": "h", "v": "v"}, {}), "Dahlquist": (0.1, 10.0, {"x": "x"}, {}), "Stair": (0.2, 9.0, {"counter": "counter"}, {}),
             "VanDerPol": (0.01, 20.0, {"x0": "x0", "x1": "x1"}, {})}


def build_reference(b, source, model, version):
    folder = b.folder / f"{model}{version}"
    binaries = folder / "binaries" / FOLDERS[version]
    binaries.mkdir(parents=True, exist_ok=True)
    subprocess.run([*COMPILER, "-w", "-O1", "-ffp-contract=off", "-shared", "-fPIC", "-fvisibility=hidden", "-DDISABLE_PREFIX", f"-DFMI_VERSION={version}", f"-I{source}/include", f"-I{source}/{model}",
                    f"{source}/src/fmi{version}Functions.c", f"{source}/src/cosimulation.c", f"{source}/{model}/model.c", "-lm", "-o", str(binaries / f"{model}.so")], check=True)
    path = b.folder / f"{model}{version}.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.write(source / model / f"FMI{version}.xml", "modelDescription.xml")
        archive.write(binaries / f"{model}.so", f"binaries/{FOLDERS[version]}/{model}.so")
    return path


def run_reference(b, source, model, version):
    step, duration, outputs, _ = REFERENCE[model]
    published = list(csv.DictReader((source / model / f"{model}_out.csv").open()))
    scene = b.folder / f"{model}-{version}.yaml"
    states = ", ".join(f"{name}: {{rate: 0}}" for name in outputs.values())
    scene.write_text("kinetree: 1\nbodies:\n  - {name: arm, joint: {type: revolute}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}\n"
                     f"states: {{{states}}}\neffects:\n  - {{type: fmu, name: f, file: {build_reference(b, source, model, version)}, step: {step}, outputs: {{{', '.join(f'{k}: {v}' for k, v in outputs.items())}}}}}\n"
                     f"simulate: {{duration: {duration + 0.6 * step}, integrator: rk4, step: {step}}}\noutput: {{interval: {step / 5}}}\n")
    rows, wrong = b.rows(scene)
    if wrong:
        return math.nan, 0, wrong
    worst, count = 0.0, 0
    if model == "Stair" and (len(rows) != 5 * (len(published) - 1) + 2 or float(rows[-1]["state.counter"]) != 10):
        return math.nan, 0, f"it must end the run at 9 s with a row for its last value, not after {len(rows)} rows"
    for line in published[:-1] if model == "Stair" else published:
        k = round(float(line["time"]) / step)
        for name, state in outputs.items():
            off = abs(float(rows[5 * k + 2][f"state.{state}"]) - float(line[name]))  # held from point k on
            worst, count = off if not off <= worst else worst, count + 1
    return worst, count, None


def feed(b, source, version):
    """Feedthrough: each input of a type is the output of this type at once."""
    types = ["Float64_continuous", "Float64_discrete", "Int32"] + (["Float32_continuous", "Int8", "UInt8", "Int16", "UInt16", "UInt32", "Int64", "UInt64"] if version == 3 else []) + ["Boolean"]
    value = {"Boolean": "1", "Float64_continuous": '"sin(t)"', "Float64_discrete": '"2*t"', "Float32_continuous": "0.75"}
    names = [kind.lower() for kind in types]
    scene = b.folder / f"feed{version}.yaml"
    scene.write_text("kinetree: 1\nbodies:\n  - {name: arm, joint: {type: revolute}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}\n"
                     f"states: {{{', '.join(f'{name}: {{rate: 0}}' for name in names)}}}\neffects:\n  - type: fmu\n    name: f\n    file: {build_reference(b, source, 'Feedthrough', version)}\n    step: 0.1\n"
                     f"    inputs: {{{', '.join(f'{kind}_input: ' + value.get(kind, '7') for kind in types)}}}\n    outputs: {{{', '.join(f'{kind}_output: {name}' for kind, name in zip(types, names))}}}\n"
                     "simulate: {duration: 2.05, integrator: rk4, step: 0.1}\noutput: {interval: 0.05}\n")
    rows, wrong = b.rows(scene)
    if wrong:
        return math.nan, wrong
    want = {"Boolean": lambda t: 1.0, "Float64_continuous": math.sin, "Float64_discrete": lambda t: 2 * t, "Float32_continuous": lambda t: 0.75}
    worst = 0.0
    for row in rows[1::2]:  # between two points
        t = 0.1 * math.floor(float(row["time"]) / 0.1)
        for kind, name in zip(types, names):
            off = abs(float(row[f"state.{name}"]) - want.get(kind, lambda t: 7.0)(t))
            worst = off if not off <= worst else worst
    return worst, None


def references(b):
    folder = os.environ.get("KT_REFERENCE_FMUS")
    if not folder:
        skip("reference_fmus_have_the_published_results", "KT_REFERENCE_FMUS names no folder with modelica/Reference-FMUs")
        return None
    source, problems = pathlib.Path(folder), []
    for version in (2, 3):
        for model in REFERENCE:
            worst, count, wrong = run_reference(b, source, model, version)
            note(f"{model}, FMI {version}: {count} values, {worst:g} off, bound 1e-12 (digits of the table)")
            if wrong or not worst <= 1e-12:
                problems.append(f"{model}, FMI {version}: {wrong or worst}")
        worst, wrong = feed(b, source, version)
        note(f"Feedthrough, FMI {version}: {worst:g} off, bound 1e-15")
        if wrong or not worst <= 1e-15:
            problems.append(f"Feedthrough, FMI {version}: {wrong or worst}")
    return problems


def memory(b):
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        skip("no_memory_is_lost_or_misused", "valgrind is not there")
        return None
    problems = []
    for name, edits, status in (("clean", [], 0), ("clean-end", [("damping: 3}", "damping: 3, last: 7}")], 0), ("clean-fault", [("damping: 3}", "damping: 3, fails: 7}")], 4)):
        for version in (2, 3):
            scene = b.scene(name, ("duration: 1,", "duration: 0.2,"), *edits, fmu=b.fmu[version])
            ended = subprocess.run([valgrind, "-q", "--error-exitcode=99", "--leak-check=full", "--errors-for-leak-kinds=definite,indirect", "--show-leak-kinds=definite,indirect", COMMAND, "run", scene, "--out", "-", "--quiet"], capture_output=True, text=True)
            if ended.returncode != status:
                problems.append(f"{name}, FMI {version}: exit {ended.returncode}: {ended.stderr[-600:]}")
    return problems


def main():
    with tempfile.TemporaryDirectory() as name:
        b = Bench(pathlib.Path(name))
        for words, check in (("a_law_in_an_fmu_equals_a_sampled_law_in_c_bit_for_bit", sampled_law), ("fmi_2_and_3_give_equal_bits", both_versions),
                             ("outputs_are_held_from_their_point_to_the_next", feedthrough), ("outputs_set_parameters_of_the_scene", parameter_of_scene),
                             ("an_fmu_ends_the_run_as_until_does", ends), ("wrong_files_and_scenes_are_rejected_with_their_places", failures),
                             ("units_that_differ_and_inputs_without_a_value_are_warnings", doubts), ("all_subcommands_obey_or_report_the_fmu", subcommands),
                             ("a_killed_run_is_resumed_with_equal_bits", checkpoints), ("kinetree_couples_its_own_fmus", own_export),
                             ("reference_fmus_have_the_published_results", references), ("no_memory_is_lost_or_misused", memory)):
            problems = check(b)
            if problems is not None:
                claim(words, problems)
        claim("no_temporary_folder_is_left", b.leaks)
        scene = b.scene("resources", fmu=pack(b.folder / "resources.fmu", 3, b.binary[3], resources=True))
        b.leaks = []
        result = b.result(scene)
        claim("an_fmu_with_resources_leaves_no_folder", b.leaks + ([] if result.count("\n") == 102 else [result[:300]]))
    finish()


main()
