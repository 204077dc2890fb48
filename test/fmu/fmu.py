"""FMUs of `kinetree export --fmu` in a small importer, against `kinetree run`.

fmu.py COMMAND IMPORTER SOURCE-ROOT

The environment variable KT_FMI_SCHEMA names a folder with the schemas of FMI 3.0 (modelica/fmi-standard, schema), and
KT_FMUSIM the program fmusim of modelica/Reference-FMUs. What is not there is skipped with a message.
"""
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree
import zipfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, skip

COMMAND, IMPORTER = (str(pathlib.Path(word).resolve()) for word in sys.argv[1:3])
SCENES = pathlib.Path(sys.argv[3]) / "apps/scenes"
STEP, STEPS = 0.01, 200  # s between values; the fixed steps of the scenes divide it

# Own steps of 1 ms, so that the end of each is a time at which a step of an FMU may end, too.
FIXED = ["double-pendulum", "four-bar", "arm7", "bouncing-ball", "lugre", "furuta-pendulum", "cart-pole"]
EXCHANGED = {"double-pendulum": 1e-12, "four-bar": 1e-12, "arm7": 1e-12}  # rounding; measured: 0, 4e-15, 0
# fmusim writes 16 digits. In model exchange its method has a tolerance of 1e-10, and the run has its own error.
FMUSIM = {"cs": 1e-13, "me": 1e-5}


def run(*words):
    ended = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    return ended.returncode, ended.stdout, ended.stderr


def rows(text):
    return [[float(number) for number in line.split(",")] for line in text.splitlines()
            if line and line[0] in "-0123456789n"]


def fixed_scene(name, folder):
    """A bundled scene with rk4 and steps of 1 ms."""
    text = re.sub(r"^simulate: \{.*\}$", "simulate:", (SCENES / f"{name}.yaml").read_text(), flags=re.M)
    text = re.sub(r"^  (integrator|tolerance|step|duration|max_step|interval):.*\n", "", text, flags=re.M)
    text = text.replace("simulate:\n", f"simulate:\n  integrator: rk4\n  step: 0.001\n  duration: {STEP * STEPS}\n")
    path = folder / f"{name}.yaml"
    path.write_text(text)
    return path


class Fmu:
    def __init__(self, scene, folder, *options):
        self.folder = folder / (scene.stem + "-fmu")
        archive = folder / f"{scene.stem}.fmu"
        self.status, _, self.errors = run(COMMAND, "export", "--fmu", scene, "--out", archive, *options)
        if self.status != 0:
            return
        shutil.rmtree(self.folder, ignore_errors=True)
        with zipfile.ZipFile(archive) as opened:
            opened.extractall(self.folder)
        self.archive, self.description = archive, self.folder / "modelDescription.xml"
        self.root = xml.etree.ElementTree.parse(self.description).getroot()
        self.variables = {v.get("name"): v for v in self.root.find("ModelVariables")}
        self.states = sum(v.get("derivative") is not None for v in self.variables.values())
        self.binary = next((self.folder / "binaries").glob("*/*.so"))

    def reference(self, name):
        return self.variables[name].get("valueReference")

    def outputs(self):
        return ["0"] + [v.get("valueReference") for v in self.variables.values() if v.get("causality") == "output"]

    def play(self, mode, *references):
        token = self.root.get("instantiationToken")
        return run(IMPORTER, self.binary, self.folder / "resources", token, mode, STEP, STEPS, self.states,
                   *(references or self.outputs()))


def records(scene, *options):
    _, text, errors = run(COMMAND, "run", scene, "--interval", STEP, "--quiet", "--out", "-", *options)
    return rows(text) or [[math.nan]], errors


def differences(ours, theirs):
    """The largest difference of two tables of numbers; NaN if their sizes differ."""
    if [len(row) for row in ours] != [len(row) for row in theirs]:
        return math.nan
    pairs = [(a, b) for r, s in zip(ours, theirs) for a, b in zip(r, s) if not (a != a and b != b)]
    found = [abs(a - b) for a, b in pairs]
    return math.nan if not found or any(x != x for x in found) else max(found)


def other_bits(scene, what, text):
    """Why values of the FMU have other bits than the records of a run."""
    theirs, _ = records(scene)
    # A run also records at events, between the steps.
    times = {row[0] for row in rows(text)}
    theirs = [row for row in theirs if row[0] in times]
    found = differences(rows(text), theirs)
    counts = [line for line in text.splitlines() if line.startswith("allocations")]
    note(f"{scene.stem}, {what}: largest difference {found:g}, bound 0; {counts}, bound 0")
    return ([] if found == 0.0 else [f"{scene.stem}: the largest difference is {found:g}"]) + \
        ([] if counts and set(counts) == {"allocations 0"} else [f"{scene.stem}: steps allocate"])


def same_bits(scene, fmu, *modes):
    """Plays the modes one after the other, each in a process of its own."""
    text = ""
    for mode in modes:
        status, said, errors = fmu.play(mode)
        if status != 0:
            return [f"{scene.stem}, {mode}: {errors.strip()}"]
        text += said
    return other_bits(scene, modes[0].partition("=")[0], text)


def check_cosimulation(folder):
    bits, serial, process, second = [], [], [], []
    state = folder / "state"
    for name in FIXED:
        scene = fixed_scene(name, folder)
        fmu = Fmu(scene, folder)
        if fmu.status != 0:
            bits.append(fmu.errors)
            continue
        bits += same_bits(scene, fmu, "cs")
        serial += same_bits(scene, fmu, "serial")
        process += same_bits(scene, fmu, f"save={state}", f"load={state}")
        second += same_bits(scene, fmu, "two")
    claim("cosimulation_has_the_bits_of_a_run_and_allocates_nothing", bits)
    claim("another_instance_continues_a_serialised_state_with_equal_bits", serial)
    claim("another_process_continues_a_serialised_state_with_equal_bits", process)
    claim("a_second_instance_changes_nothing", second)


def check_exchange(folder):
    """The importer and the run take the same steps of 10 ms with the same method."""
    problems = []
    for name, bound in EXCHANGED.items():
        scene = fixed_scene(name, folder)
        fmu = Fmu(scene, folder)
        status, text, errors = fmu.play("me")
        theirs, _ = records(scene, "--step", STEP)
        found = differences(rows(text), theirs) if status == 0 else math.nan
        note(f"{name}: largest difference {found:g}, bound {bound:g}; {text.splitlines()[-1:]}")
        if not found <= bound:
            problems.append(f"{name}: {found:g} {errors.strip()}")
        if "allocations 0" not in text:
            problems.append(f"{name}: model exchange allocates")
    claim("model_exchange_follows_the_run_of_the_same_method", problems)


def check_values(folder):
    """A parameter and an input of the FMU act as a setting of a run and as a constant force do."""
    scene = folder / "slide.yaml"
    scene.write_text("kinetree: 1\nparameters: {m: 2, half: =m/2}\nbodies:\n"
                     "  - {name: block, mass: =m, joint: {name: slide, type: prismatic, axis: [1, 0, 0]}}\n"
                     f"simulate: {{integrator: rk4, step: 0.001, duration: {STEP * STEPS}}}\n")
    fmu = Fmu(scene, folder, "--input", "slide")
    follower, own = fmu.variables["half"].get("causality"), fmu.variables["m"].get("causality")
    status, text, errors = fmu.play("cs", "0", fmu.reference("position.slide"), fmu.reference("half"),
                                    fmu.reference("m") + "=4", fmu.reference("input.slide") + "=3")
    last = rows(text)[-1] if status == 0 else [math.nan] * 3
    expected = 0.5 * 3 / 4 * (STEP * STEPS) ** 2
    note(f"position {last[1]:.15g}, expected {expected:.15g}, bound 1e-13")
    fine = abs(last[1] - expected) <= 1e-13 and last[2] == 2.0
    claim("inputs_and_parameters_act", [] if fine else [str(last), errors])
    claim("a_parameter_that_follows_others_is_calculated",
          [] if (follower, own) == ("calculatedParameter", "parameter") else [f"half: {follower}, m: {own}"])


def check_refusals(folder):
    body = "kinetree: 1\nbodies: [{name: b, joint: {type: prismatic, axis: x}%s}]\n"
    (folder / "plain.yaml").write_text(body % ", mass: 1")
    run(COMMAND, "run", folder / "plain.yaml", "--duration", 1, "--out", os.devnull, "--summary", folder / "other.json")
    corners = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
    faces = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
    (folder / "b.stl").write_text("solid b\n" + "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join("vertex %g %g %g\n" % corners[i] for i in face) +
        "endloop\nendfacet\n" for face in faces) + "endsolid b\n")
    cases = {
        "from": (", mass: 1", "initial: {from: other.json}\n", "initial.from"),
        "formulation": (", mass: 1", "simulate: {formulation: absolute}\n", "simulate.formulation"),
        "mesh": ("", "meshes: [{body: b, file: b.stl, density: 1}]\n", "it reads other files"),
    }
    problems = []
    for name, (mass, line, words) in cases.items():
        scene = folder / f"{name}.yaml"
        scene.write_text(body % mass + line)
        fmu = Fmu(scene, folder)
        if fmu.status == 0 or words not in fmu.errors:
            problems.append(f"{name}: status {fmu.status}, {fmu.errors}")
    claim("what_cannot_be_exported_is_rejected", problems)
    fmu = Fmu(fixed_scene("bouncing-ball", folder), folder)
    status, _, errors = fmu.play("me")
    claim("model_exchange_is_not_offered_with_events",
          [] if fmu.root.find("ModelExchange") is None and status != 0 and "use co-simulation" in errors else [errors])


def check_binary(folder):
    """The binary depends on libc and libm alone, and exports FMI alone."""
    fmu = Fmu(fixed_scene("arm7", folder), folder)
    _, text, _ = run("readelf", "-dW", fmu.binary)
    needed = set(re.findall(r"NEEDED.*\[(\w+)\.so", text))
    _, symbols, _ = run("readelf", "--dyn-syms", "-W", fmu.binary)
    exported = [line.split()[-1] for line in symbols.splitlines() if " UND " not in line and " GLOBAL " in line]
    versions = sorted({tuple(int(n) for n in v.split(".")) for v in re.findall(r"GLIBC_([\d.]+)", symbols)})
    megabytes = [path.stat().st_size / 1e6 for path in (fmu.binary, fmu.archive)]
    glibc = ".".join(map(str, versions[-1]))
    note(f"{megabytes[0]:.1f} MB, the archive {megabytes[1]:.1f} MB; needs {sorted(needed)}, glibc {glibc}")
    foreign = [name for name in exported if not name.startswith("fmi3")]
    claim("the_binary_needs_libc_and_libm_alone", sorted(needed - {"libc", "libm", "ld-linux-x86-64"}))
    few = [] if len(exported) >= 60 else [f"only {len(exported)} functions"]
    claim("the_binary_exports_fmi_alone", foreign + few)


def check_schema(folder):
    schema, xmllint = os.environ.get("KT_FMI_SCHEMA"), shutil.which("xmllint")
    if not schema or not xmllint:
        skip("descriptions_are_valid", "KT_FMI_SCHEMA names no folder of schemas, or xmllint is not on this machine")
        return
    problems = []
    for scene in sorted(SCENES.glob("*.yaml")):
        fmu = Fmu(scene, folder)
        if fmu.status != 0:
            note(f"{scene.stem}: {fmu.errors.strip()}")
            continue
        status, _, errors = run(xmllint, "--noout", "--schema", pathlib.Path(schema) / "fmi3ModelDescription.xsd",
                                fmu.description)
        problems += [f"{scene.stem}: {errors}"] if status != 0 else []
    claim("descriptions_are_valid", problems)


def check_fmusim(folder):
    fmusim = os.environ.get("KT_FMUSIM")
    if not fmusim:
        skip("fmusim_agrees", "KT_FMUSIM names no program")
        return
    problems = []
    for name in ("double-pendulum", "four-bar"):
        scene = fixed_scene(name, folder)
        fmu, out = Fmu(scene, folder), folder / f"{name}.csv"
        for words in (["--interface-type", "cs"], ["--interface-type", "me", "--solver", "cvode"]):
            status, _, errors = run(fmusim, *words, "--tolerance", 1e-10, "--output-interval", STEP,
                                    "--stop-time", STEP * STEPS, "--output-file", out, fmu.archive)
            ours = rows(out.read_text()) if status == 0 else [[math.nan]]
            ours = list({row[0]: row for row in ours}.values())  # the last of those of a time: after its event
            found = differences(ours, records(scene)[0])
            bound = FMUSIM[words[1]]
            note(f"{name}, {words[1]}: largest difference {found:g}, bound {bound:g}")
            problems += [] if found <= bound else [f"{name}, {words[1]}: {found:g} {errors}"]
    claim("fmusim_agrees", problems)


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        check_cosimulation(folder)
        check_exchange(folder)
        check_values(folder)
        check_refusals(folder)
        check_binary(folder)
        check_schema(folder)
        check_fmusim(folder)
    finish()


main()
