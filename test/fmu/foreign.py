"""Foreign programs on the FMUs of all bundled scenes: schemas, fmusim, and FMI Library (fmu.py)."""
# SPDX-License-Identifier: Apache-2.0
import ctypes
import math
import os
import pathlib
import re
import shutil
import tempfile
import zipfile

from archive import COMMAND, FIXED, SCENES, STEP, STEPS, WORKS, Fmu, differences, fixed_scene, records, rows, run
from claims import claim, note, skip

# fmusim with the method of the scene (cs), and with CVODE at a tolerance of 1e-10 (me). The run has its own error: the
# rope a tolerance of 1e-4, the ball impacts of 2 MN/m^1.5, and the rocket a balance that is a difference of 1.6e5 J.
FMUSIM_BOUND, INTERVALS = 2e-5, 200
FMUSIM_LOOSE = {"rope": 1e-3, "rolling-ball": 5e-4, "rocket": 3e-4}


# Inputs of all kinds: joints, a servo, motions.
INPUTS = {"servo-arm": "elbow,elbow_drive", "quarter-car": "wash,ramp.position"}


def check_schema(folder):
    schema, xmllint = os.environ.get("KT_FMI_SCHEMA"), shutil.which("xmllint")
    if not schema or not xmllint:
        skip("descriptions_are_valid", "KT_FMI_SCHEMA names no folder of schemas, or xmllint is not on this machine")
        return
    problems = []
    for version, file in ((3, "fmi3ModelDescription.xsd"), (2, "fmi2Merged.xsd")):
        if not (pathlib.Path(schema) / file).is_file():
            skip(f"descriptions_of_fmi_{version}_are_valid", f"KT_FMI_SCHEMA has no {file}")
            continue
        cases = [(scene, []) for scene in sorted(SCENES.glob("*.yaml"))]
        cases += [(SCENES / f"{stem}.yaml", ["--input", names]) for stem, names in INPUTS.items()]
        for scene, words in cases:
            fmu = Fmu(scene, folder, "--fmi", version, *words)
            if fmu.status != 0:
                note(f"{scene.stem}: {fmu.errors.strip()}")
                continue
            status, _, errors = run(xmllint, "--noout", "--schema", pathlib.Path(schema) / file, fmu.description)
            problems += [f"{scene.stem}, {version}: {errors}"] if status != 0 else []
    claim("descriptions_are_valid", problems)


def play_foreign(fmusim, words, stop, archive, out):
    """The rows of a foreign importer, and its messages. The last of the rows of a time is that after its event."""
    out.unlink(missing_ok=True)
    status, said, errors = run(fmusim, *words, "--tolerance", 1e-10, "--log-level", "ok", "--output-interval",
                               repr(stop / INTERVALS), "--stop-time", repr(stop), "--output-file", out, archive)
    text = out.read_text() if status == 0 else ""
    return {round(row[0], 9): row for row in rows(text)}, (said + errors).strip()


def largest_relative(ours, theirs, works, least=INTERVALS):
    """The largest difference over the larger of 1 and the column's size; columns in `works` must be NaN in ours."""
    common = sorted(set(ours) & set(theirs))
    if len(common) < least or any(len(ours[t]) != len(theirs[t]) for t in common):
        return math.nan
    worst = 0.0
    for k in range(1, len(ours[common[0]])):
        pairs = [(ours[t][k], theirs[t][k]) for t in common]
        if k in works:
            worst = worst if all(math.isnan(a) for a, _ in pairs) else math.nan
            continue
        size = max([1.0] + [abs(b) for _, b in pairs if b == b])
        found = [abs(a - b) / size for a, b in pairs if not (a != a and b != b)]
        worst = math.nan if any(x != x for x in found) else max([worst, *found])
        if math.isnan(worst):
            break
    return worst


def check_fmusim(folder):
    """Every bundled scene, with its own method, in a foreign importer: no complaint, and the numbers of the run."""
    fmusim = os.environ.get("KT_FMUSIM")
    if not fmusim:
        skip("fmusim_agrees", "KT_FMUSIM names no program")
        return
    problems, worst, count = [], {"cs": (0.0, ""), "me": (0.0, "")}, 0
    for scene, version in [(scene, version) for scene in sorted(SCENES.glob("*.yaml")) for version in (3, 2)]:
        fmu = Fmu(scene, folder, "--fmi", version)
        if fmu.status != 0:
            problems.append(f"{scene.stem}: {fmu.errors.strip()}")
            continue
        stop = min(float(fmu.root.find("DefaultExperiment").get("stopTime")), 0.97)  # not at a kink of a drive
        _, text, errors = run(COMMAND, "run", scene, "--duration", repr(stop), "--interval", repr(stop / INTERVALS),
                              "--quiet", "--out", "-")
        theirs = {round(row[0], 9): row for row in rows(text)}
        works = [k for k, name in enumerate(text.partition("\n")[0].split(","))
                 if name in WORKS]
        for mode in ("cs", "me"):
            if fmu.root.find({"cs": "CoSimulation", "me": "ModelExchange"}[mode]) is None:
                continue
            words = ["--interface-type", mode] + (["--solver", "cvode"] if mode == "me" else [])
            ours, complaint = play_foreign(fmusim, words, stop, fmu.archive, folder / "foreign.csv")
            found = largest_relative(ours, theirs, works if mode == "me" else [])
            bound = FMUSIM_LOOSE.get(scene.stem, FMUSIM_BOUND)
            count += 1
            if not found <= worst[mode][0] and scene.stem not in FMUSIM_LOOSE:
                worst[mode] = found, scene.stem
            if scene.stem in FMUSIM_LOOSE:
                note(f"{scene.stem}, FMI {version}, {mode}: relative difference {found:g}, bound {bound:g}")
            if not found <= bound or complaint:
                problems.append(f"{scene.stem}, FMI {version}, {mode}: difference {found:g}, bound {bound:g}; {complaint}")
    for mode, (found, stem) in worst.items():
        note(f"{mode}: largest relative difference {found:g} ({stem}), bound {FMUSIM_BOUND:g}")
    claim("fmusim_runs_every_bundled_scene_and_agrees", problems + ([] if count >= 200 else [f"only {count} runs"]))


# Motions of bundled scenes as inputs, with f, f' and f'', and the largest f'''. Within a step of co-simulation of h seconds f''
# is held, so that the velocity has an error of at most f''' h^2 / 2 at its end. fmusim interpolates rows of the file in time.
WASH = 3 * math.pi
DRIVEN = {("mathieu", "shaker.position"): (lambda t: (0.5 * math.cos(2 * t), -math.sin(2 * t), -2 * math.cos(2 * t)), 4),
          ("quarter-car", "wash.position"): (lambda t: (0.02 * math.sin(WASH * t), 0.02 * WASH * math.cos(WASH * t),
                                                        -0.02 * WASH ** 2 * math.sin(WASH * t)), 0.02 * WASH ** 3),
          ("swashplate", "drive.position"): (lambda t: (40 * t, 40, 0), 0)}


def check_fmusim_inputs(folder):
    """fmusim drives motions of bundled scenes from a file: the numbers of the run with the functions of the scene."""
    fmusim = os.environ.get("KT_FMUSIM")
    if not fmusim:
        skip("fmusim_drives_motions", "KT_FMUSIM names no program")
        return
    problems, stop, table = [], 0.97, folder / "inputs.csv"
    for (stem, name), (f, third) in DRIVEN.items():
        scene = SCENES / f"{stem}.yaml"
        times = [0.0001 * k for k in range(9701)]
        table.write_text(",".join(["time"] + [f"input.{name}{ending}" for ending in ("", ".rate", ".acceleration")]) + "\n" +
                         "".join(",".join(map(repr, (t, *f(t)))) + "\n" for t in times))
        given = [word for ending, x in zip(("", ".rate", ".acceleration"), f(0.0))
                 for word in ("--start-value", f"input.{name}{ending}", repr(x))]
        _, text, _ = run(COMMAND, "run", scene, "--duration", repr(stop), "--interval", repr(stop / INTERVALS), "--quiet",
                         "--out", "-")
        theirs = {round(row[0], 9): row for row in rows(text)}
        works = [k for k, column in enumerate(text.partition("\n")[0].split(",")) if column in WORKS]
        for version, mode in ((3, "cs"), (2, "cs"), (3, "me"), (2, "me")):
            fmu = Fmu(scene, folder, "--fmi", version, "--input", name)
            words = ["--interface-type", mode, "--input-file", table] + (["--solver", "cvode"] if mode == "me" else [])
            ours, complaint = play_foreign(fmusim, words + given, stop, fmu.archive, folder / "driven.csv")
            found = largest_relative(ours, theirs, works if mode == "me" else [])
            bound = FMUSIM_BOUND + (third * (stop / INTERVALS) ** 2 / 2 if mode == "cs" else 0)
            still, _ = play_foreign(fmusim, words[:2] + words[4:], stop, fmu.archive, folder / "driven.csv")
            moved = largest_relative(still, theirs, works if mode == "me" else [])
            note(f"{stem}, FMI {version}, {mode}: relative difference {found:.1e}, bound {bound:.1e}; without inputs "
                 f"{moved:.1e}, bound >= 0.01")
            problems += [] if found <= bound and moved >= 0.01 and not complaint else [f"{stem}: {found:g} {complaint}"]
    claim("fmusim_drives_motions", problems)


# Scenes with events of their own, impacts, a stop, and friction that sticks.
EARLY = ("parachute", "rocking-block", "bouncing-ball", "clutch", "trebuchet")


def check_fmusim_early(folder):
    """fmusim with event mode, early returns and records of intermediate updates: the numbers at its output times."""
    fmusim = os.environ.get("KT_FMUSIM")
    if not fmusim:
        skip("fmusim_uses_event_mode_and_early_returns", "KT_FMUSIM names no program")
        return
    problems, more = [], 0
    for stem in EARLY:
        fmu, tables = Fmu(SCENES / f"{stem}.yaml", folder), []
        stop = float(fmu.root.find("DefaultExperiment").get("stopTime"))
        for words in ([], ["--early-return-allowed"], ["--early-return-allowed", "--event-mode-used"],
                      ["--early-return-allowed", "--event-mode-used", "--record-intermediate-values"]):
            table, complaint = play_foreign(fmusim, ["--interface-type", "cs", *words], stop, fmu.archive,
                                            folder / "early.csv")
            tables.append(table)
            found = largest_relative(table, tables[0], [], INTERVALS / 2)
            note(f"{stem} {' '.join(words)}: {len(table)} rows, relative difference {found:.1e}, bound {FMUSIM_BOUND:g}")
            problems += [] if found <= FMUSIM_BOUND and not complaint else [f"{stem} {words}: {found:g}; {complaint}"]
        sizes = list(map(len, tables))
        problems += [] if sizes[0] <= sizes[1] <= sizes[2] < sizes[3] else [f"{stem}: rows {sizes}"]
        more += sizes[0] < sizes[2]
    claim("fmusim_uses_event_mode_and_early_returns", problems + ([] if more >= 3 else [f"{more} scenes with events"]))


VALIDATE = "import sys\nfrom fmpy.validation import validate_fmu\nfor path in sys.argv[1:]:\n    print(validate_fmu(path))"


def check_fmpy(folder):
    """FMPy finds no fault: schemas, names of variables, units, and the structure of the model."""
    python = os.environ.get("KT_FMPY")
    if not python:
        skip("fmpy_finds_no_fault", "KT_FMPY names no Python with the package fmpy")
        return
    problems, count = [], 0
    for version in (3, 2):
        archives = []
        for scene in sorted(SCENES.glob("*.yaml")):
            fmu = Fmu(scene, folder, "--fmi", version)
            archives += [fmu.archive.rename(folder / f"{scene.stem}-{version}.fmu")] if fmu.status == 0 else []
        for stem, names in INPUTS.items():
            fmu = Fmu(SCENES / f"{stem}.yaml", folder, "--fmi", version, "--input", names)
            archives.append(fmu.archive.rename(folder / f"{stem}-driven-{version}.fmu"))
        broken = folder / f"broken-{version}.fmu"  # FMPy must find something there
        with zipfile.ZipFile(archives[0]) as good, zipfile.ZipFile(broken, "w") as bad:
            text = good.read("modelDescription.xml").decode()
            bad.writestr("modelDescription.xml", re.sub('name="position', 'name="2 position', text, count=1))
        status, said, errors = run(python, "-c", VALIDATE, *archives, broken)
        found = [line for line in said.splitlines() if line.startswith("[")]
        count += len(archives)
        problems += [f"FMI {version}: status {status}: {errors}"] if status != 0 or len(found) != len(archives) + 1 else []
        problems += [f"{archive.stem}: {line}" for archive, line in zip(archives, found) if line != "[]"]
        problems += [f"FMI {version}: no fault in a wrong name"] if found[-1:] == ["[]"] else []
        note(f"FMI {version}: {len(archives)} archives; a wrong name: {found[-1:]}")
    claim("fmpy_finds_no_fault", problems + ([] if count >= 140 else [f"only {count} archives"]))


class Library:
    """FMI Library: its complaints about an archive, and its co-simulation of one of FMI 3.0."""

    LOG = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p)
    TELL = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)

    class Callbacks(ctypes.Structure):
        _fields_ = [("memory", ctypes.c_void_p * 4), ("log", ctypes.c_void_p), ("level", ctypes.c_int),
                    ("context", ctypes.c_void_p), ("text", ctypes.c_char * 65536)]

    def __init__(self, path):
        self.library, self.complaints = ctypes.CDLL(path), []
        own, cast = ctypes.CDLL(None), lambda f: ctypes.cast(f, ctypes.c_void_p).value
        self.log = self.LOG(lambda c, module, level, text: self.complaints.append(text.decode()))
        self.tell = self.TELL(lambda environment, status, category, text: self.complaints.append(text.decode()))
        memory = (ctypes.c_void_p * 4)(*(cast(f) for f in (own.malloc, own.calloc, own.realloc, own.free)))
        self.callbacks = self.Callbacks(memory, cast(self.log), 3)  # warnings and errors

    def pointer(self, name, *arguments):
        function = getattr(self.library, name)
        function.restype = ctypes.c_void_p
        return ctypes.c_void_p(function(*arguments))

    def read(self, archive, folder, version):
        """Unpacks and parses an archive. The result is false if it cannot be read."""
        context = self.pointer("fmi_import_allocate_context", ctypes.byref(self.callbacks))
        self.library.fmi_import_get_fmi_version(context, str(archive).encode(), str(folder).encode())
        return self.pointer(f"fmi{version}_import_parse_xml", context, str(folder).encode(), None)

    def play(self, fmu, folder, references, step, steps):
        """Rows of co-simulation with FMI 3.0."""
        def call(name, *arguments):
            if getattr(self.library, "fmi3_import_" + name)(fmu, *arguments) != 0:
                raise RuntimeError(f"{name}: {self.complaints}")
        real, flags, last, table = ctypes.c_double, [ctypes.c_bool() for _ in range(3)], ctypes.c_double(), []
        numbers, size = (ctypes.c_double * len(references))(), ctypes.c_size_t(len(references))
        call("create_dllfmu", 4, None, self.tell)
        call("instantiate_co_simulation", b"one", str(folder / "resources").encode() + b"/", False, False, False, False,
             None, ctypes.c_size_t(0), None)
        call("enter_initialization_mode", False, real(0), real(0), False, real(0))
        call("exit_initialization_mode")
        for k in range(steps + 1):
            if k > 0:
                call("do_step", real((k - 1) * step), real(step), True, *map(ctypes.byref, flags), ctypes.byref(last))
            call("get_float64", (ctypes.c_uint32 * len(references))(*references), size, numbers, size)
            table.append(list(numbers))
        self.library.fmi3_import_free_instance(fmu)
        self.library.fmi3_import_destroy_dllfmu(fmu)
        return table


def check_library(folder):
    """FMI Library reads every bundled scene without a complaint, and scenes with fixed steps have the bits of the run."""
    path = os.environ.get("KT_FMILIB")
    if not path:
        skip("fmi_library_agrees", "KT_FMILIB names no shared library")
        return
    library, problems, read = Library(path), [], 0
    for scene, version in [(scene, version) for scene in sorted(SCENES.glob("*.yaml")) for version in (3, 2)]:
        with tempfile.TemporaryDirectory() as other:
            fmu = Fmu(scene, folder, "--fmi", version)
            read += bool(library.read(fmu.archive, other, version))
            problems += [f"{scene.stem}, FMI {version}: {text}" for text in library.complaints]
            library.complaints.clear()
    note(f"{read} archives read")
    claim("fmi_library_reads_every_bundled_scene", problems + ([] if read >= 140 else [f"only {read} archives"]))
    problems = []
    for name in FIXED:
        scene = fixed_scene(name, folder)
        fmu = Fmu(scene, folder)
        with tempfile.TemporaryDirectory() as other:
            unpacked = pathlib.Path(other)
            opened = library.read(fmu.archive, unpacked, 3)
            table = library.play(opened, unpacked, [int(word) for word in fmu.outputs()], STEP, STEPS)
        times = {row[0] for row in table}
        found = differences(table, [row for row in records(scene)[0] if row[0] in times])
        note(f"{name}: largest difference {found:g}, bound 0")
        problems += [] if found == 0.0 else [f"{name}: {found:g}"]
    claim("fmi_library_has_the_bits_of_a_run", problems)
