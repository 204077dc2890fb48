"""native COMMAND SOURCE-ROOT: `kinetree run --native` and `sweep --native`: records, the cache, and what is rejected."""
# SPDX-License-Identifier: Apache-2.0
import csv
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, skip

COMMAND, SCENES = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve() / "apps/scenes"
EPS = 2.0**-52
# trees, effects, auxiliary states, loops that pass singular positions, driven joints, quaternions, fixed steps, implicit methods
COMPARED = """andrews arm7 bead bricard cart-pole conical-pendulum dc-motor double-pendulum engine-mounts fishing-rod five-bar flapping-wings
 flyball-governor four-bar hooke-shaft humanoid lugre n-four-bar-2 n-four-bar-40 peaucellier pid-arm point-pendulum precessing-top puck
 scissor-lift servo-arm shot slider-crank sleeve spinning-top stephenson stewart three-body trolley watt
 articulated-rotor flap-track landing-gear mathieu swashplate quarter-car bicycle rolling-disc skate constant-velocity torus-marble nose-wheel-shimmy""".split()
# A body without mass follows another one: the inertia of its joint alone is zero.
GEARED = """kinetree: 1
bodies:
  - {name: lead, joint: {type: prismatic, axis: z}}
  - {name: load, joint: {type: prismatic, axis: z, at: [1, 0, 0]}, mass: 2}
loops:
  - {name: gear, type: coupling, coefficients: {lead: 1, load: -2}}
simulate: {duration: 1}
"""
PLAIN = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: rod, joint: {type: revolute, axis: y, position: 1}, mass: 2, com: [0, 0, -0.4], inertia: [0.1, 0.1, 0.01]}
simulate: {duration: 1}
"""


def run(folder, *words, **variables):
    environment = {**os.environ, "XDG_CACHE_HOME": str(pathlib.Path(folder, "cache")), **variables}
    return subprocess.run([COMMAND, "run", *map(str, words)], capture_output=True, text=True, cwd=folder, env=environment)


def columns(folder, name):
    rows = list(csv.reader(pathlib.Path(folder, name).open()))
    return {name: [float(row[k] or "nan") for row in rows[1:]] for k, name in enumerate(rows[0])}


def records(folder, *words):
    """The columns of a run, and its summary."""
    made = run(folder, *words, "--out", "out.csv", "--summary", "out.json")
    if made.returncode != 0:
        return None, None, made.stderr
    return columns(folder, "out.csv"), json.loads(pathlib.Path(folder, "out.json").read_text()), made.stderr


def differences(one, other):
    """The largest difference, and the largest value, of each quantity: all columns up to the first dot."""
    found = {}
    for name, column in one.items():
        worst = found.setdefault(name.split(".")[0], [0.0, 0.0])
        pairs = [(a, b) for a, b in zip(column, other[name]) if a == a]
        worst[0] = max([worst[0]] + [abs(a - b) for a, b in pairs])
        worst[1] = max([worst[1]] + [abs(a) for a, b in pairs])
    return found


def compare(folder, name):
    """The library's own records change by rounding if its tolerance does by a part of 1e-9: all its steps are others.
    Step sizes follow from rounding where they follow from tiny errors, which changes records by a part of the tolerance."""
    scene = SCENES / f"{name}.yaml"
    library, summary, words = records(folder, scene)
    native, _, native_words = records(folder, scene, "--native")
    if library is None or native is None:
        return [f"{words}{native_words}"]
    problems = [] if len(library["time"]) == len(native["time"]) else ["another number of records"]
    tolerance, near = summary["method"].get("tolerance"), []
    for part in (1e-9, -1e-9, 3e-9) if tolerance else ():
        text = f"{tolerance['relative'] * (1 + part)!r},{tolerance['absolute'] * (1 + part)!r}"
        near.append(differences(library, records(folder, scene, "--tolerance", text)[0]))
    ratio, where = 0.0, ""
    for quantity, (difference, size) in differences(library, native).items():
        allowed = 1000 * EPS * size + max([0.0] + [10 * other[quantity][0] for other in near])
        if tolerance:
            allowed += 5 * (tolerance["relative"] * size + tolerance["absolute"])
        if quantity != "constraint" and difference > ratio * allowed:
            ratio, where = difference / allowed, f"{quantity}: observed {difference:.2g} bound {allowed:.2g}"
    note(f"{name}: ratio {ratio:.2g}  {where}")
    problems += [f"{where}"] if ratio > 1.0 else []
    problems += [] if " accelerations" in native_words else [f"no report: {native_words}"]
    return problems


def compiler(folder):
    """A compiler that fails once a file of the name `broken` exists, and counts its calls."""
    path = pathlib.Path(folder, "counting-cc")
    path.write_text(f"#!/bin/sh\necho call >>{folder}/calls\nif [ -e {folder}/broken ]; then echo 'no disk, says the compiler' >&2; exit 3; fi\nexec cc \"$@\"\n")
    path.chmod(0o755)
    return path


def calls(folder):
    path = pathlib.Path(folder, "calls")
    return path.read_text().count("call") if path.exists() else 0


def check_cache(folder):
    path, scene = compiler(folder), pathlib.Path(folder, "rod.yaml")
    scene.write_text(PLAIN)
    first = run(folder, scene, "--native", CC=str(path))
    claim("first_run_compiles", [] if first.returncode == 0 and calls(folder) == 1 and "the compiler took" in first.stderr else [first.stderr])
    pathlib.Path(folder, "broken").touch()
    second = run(folder, scene, "--native", CC=str(path))
    claim("second_run_calls_no_compiler", [] if second.returncode == 0 and calls(folder) == 1 and "in the cache" in second.stderr else [second.stderr])
    heavy = run(folder, scene, "--native", "--set", "bodies.rod.mass=3", "--out", "heavy.csv", CC=str(path))
    light = run(folder, scene, "--set", "bodies.rod.mass=3", "--out", "light.csv")
    fine, off = heavy.returncode + light.returncode == 0 and calls(folder) == 1, {"energy": (0.0, 0.0)}
    if fine:
        off = differences(columns(folder, "heavy.csv"), columns(folder, "light.csv"))
    note(f"another mass: energy differs by {off['energy'][0]:.2g}, bound {1e-9 * off['energy'][1]:.2g}")
    claim("other_numbers_take_the_same_file", [] if fine and off["energy"][0] < 1e-9 * off["energy"][1] else [heavy.stderr])
    failed = run(folder, scene, "--native", "--set", "bodies.rod.joint.type=prismatic", CC=str(path))
    expected = failed.returncode == 4 and "status 3" in failed.stderr and "no disk, says the compiler" in failed.stderr and "leave --native out" in failed.stderr
    claim("a_compiler_that_fails_is_an_error_with_its_words", [] if expected else [failed.stderr])
    kept = sorted(p.name for p in pathlib.Path(folder, "cache/kinetree").iterdir())
    claim("nothing_but_whole_files_is_kept", [] if len(kept) == 1 and kept[0].endswith(".so") else kept)
    pathlib.Path(folder, "broken").unlink()
    library = pathlib.Path(folder, "cache/kinetree", kept[0])
    library.write_bytes(b"no library")
    again = run(folder, scene, "--native", CC=str(path))
    claim("a_damaged_file_is_compiled_again", [] if again.returncode == 0 and library.stat().st_size > 1000 else [again.stderr])
    library.chmod(0o666)
    foreign = run(folder, scene, "--native", CC=str(path))
    claim("a_file_that_others_can_write_is_not_loaded", [] if foreign.returncode == 4 and "others can write" in foreign.stderr else [foreign.stderr])
    library.unlink()
    together = [subprocess.Popen([COMMAND, "run", scene, "--native", "--out", f"{k}.csv"], cwd=folder, stderr=subprocess.PIPE, text=True,
                                 env={**os.environ, "XDG_CACHE_HOME": f"{folder}/cache", "CC": str(path)}) for k in range(4)]
    words = [process.communicate()[1] for process in together]
    alike = len({pathlib.Path(folder, f"{k}.csv").read_bytes() for k in range(4)}) == 1
    kept = [p.name for p in pathlib.Path(folder, "cache/kinetree").iterdir()]
    claim("processes_at_the_same_time_share_the_file", [] if all(p.returncode == 0 for p in together) and alike and len(kept) == 1 else [*words, *kept])


def check_resumed(folder):
    """A checkpoint is written at each record, and the run continues from the last one."""
    scene = SCENES / "arm7.yaml"
    whole = run(folder, scene, "--native", "--out", "whole.csv", "--checkpoint", "state", "--checkpoint-interval", "1e-9")
    part = pathlib.Path(folder, "whole.csv").read_bytes()
    again = run(folder, scene, "--native", "--out", "whole.csv", "--resume", "state")
    same = pathlib.Path(folder, "whole.csv").read_bytes() == part
    claim("runs_continue_with_native", [] if whole.returncode + again.returncode == 0 and same else [whole.stderr, again.stderr])
    without = run(folder, scene, "--out", "whole.csv", "--resume", "state")
    claim("runs_continue_with_the_same_choice", [] if without.returncode == 1 and "had --native; give it here, too" in without.stderr else [without.stderr])


def check_rejections(folder):
    scene = pathlib.Path(folder, "rod.yaml")
    scene.write_text(PLAIN)
    geared = pathlib.Path(folder, "geared.yaml")
    geared.write_text(GEARED)
    for name, words, status, message, variables in (
            ("a_missing_compiler_is_an_error", [scene], 4, "install gcc or clang", {"CC": "no-such-compiler"}),
            ("a_compiler_that_reorders_sums_is_rejected", [scene], 4, "sums must keep their order", {"CC": "cc\t-O1 -ffast-math"}),
            ("a_long_variable_is_rejected", [scene], 4, "set it to a script", {"CC": "cc" + 30 * " -O1"}),
            ("a_folder_of_temporary_files_that_is_missing_is_named", [scene], 4, "made in /proc/none", {"XDG_CACHE_HOME": "/proc/none", "TMPDIR": "/proc/none"}),
            ("wires_along_a_helix_are_rejected", [SCENES / "spiral-wire.yaml"], 2, "wire: code for this loop cannot be generated", {}),
            ("contacts_are_rejected", [SCENES / "bouncing-ball.yaml"], 2, "switched, or contacts close", {}),
            ("events_that_set_numbers_are_rejected", [SCENES / "parachute.yaml"], 2, "its events set numbers of the model", {}),
            ("masses_that_vary_are_rejected", [SCENES / "rocket.yaml"], 2, "a mass that changes with time", {}),
            ("joints_without_inertia_are_rejected", [geared], 2, "lead: code for accelerations divides by the inertia", {}),
            ("long_code_is_rejected", [SCENES / "rope.yaml"], 2, "slower than the library", {}),
            ("other_formulations_are_rejected", [scene, "--formulation", "absolute"], 2, "absolute formulation", {}),
            ("other_reductions_are_rejected", [SCENES / "four-bar.yaml", "--reduction", "svd"], 2, "its own reduction", {})):
        made = run(folder, *words, "--native", "--out", "rejected.csv", **variables)
        left = pathlib.Path(folder, "rejected.csv").exists()
        expected = made.returncode == status and message in made.stderr and made.stderr.count("leave --native out") == 1 and not left
        claim(name, [] if expected else [f"status {made.returncode}: {made.stderr}"])
    quiet = run(folder, scene, "--native", "--quiet")
    claim("quiet_runs_report_nothing", [] if quiet.returncode == 0 and quiet.stderr == "" else [quiet.stderr])
    chain = pathlib.Path(folder, "chain.yaml")
    chain.write_text(subprocess.run([COMMAND, "make", "chain", "--links", "13"], capture_output=True, text=True, check=True).stdout)
    slow, plain = run(folder, chain, "--native", "--duration", "0.1", "--out", "slow.csv"), run(folder, chain, "--duration", "0.1", "--out", "plain.csv")
    same = slow.returncode + plain.returncode == 0 and pathlib.Path(folder, "slow.csv").read_bytes() == pathlib.Path(folder, "plain.csv").read_bytes()
    claim("a_long_planar_chain_runs_by_the_library", [] if same and "faster for planar trees" in slow.stderr else [slow.stderr])
    closed = run(folder, scene, "--native", XDG_CACHE_HOME="/proc/none", HOME="/proc/none")
    claim("without_a_folder_a_run_warns_and_goes_on", [] if closed.returncode == 0 and "cannot be kept" in closed.stderr and "accelerations" in closed.stderr else [closed.stderr])


# scene, value that varies, its range, whether one run at a time is asked for
SWEPT = (("stewart", "bodies.platform.mass", "10:20:4", False), ("andrews", "bodies.K1.mass", "0.04:0.05:4", False),
         ("rolling-disc", "bodies.steady.mass", "1:2:4", False), ("torus-marble", "loops.ring.surface.torus.radius", "0.9:1.1:3", False),
         ("arm7", "bodies.elbow.mass", "2:4:3", True))
STEPS = ("--set", "simulate={duration: 0.03, integrator: rk4, step: 1e-4}", "--set", "output.interval=0.001")


def sweep(folder, out, *words, **variables):
    environment = {**os.environ, "XDG_CACHE_HOME": str(pathlib.Path(folder, "cache")), **variables}
    made = subprocess.run([COMMAND, "sweep", *map(str, words), "--out", out], capture_output=True, text=True, cwd=folder, env=environment)
    lines = list(csv.DictReader(pathlib.Path(folder, out).open())) if made.returncode == 0 else []
    return made, lines


def compare_sweep(folder, path, scene, name, values, is_single):
    """All runs share one file, to which each passes its own numbers."""
    words = (SCENES / f"{scene}.yaml", "--vary", f"{name}={values}", *STEPS)
    before = calls(folder)
    _, library = sweep(folder, "library.csv", *words)
    made, native = sweep(folder, "native.csv", *words, "--native", *(("--one-by-one",) if is_single else ()), CC=str(path))
    if not library or len(library) != len(native):
        return [made.stderr]
    problems = [] if calls(folder) == before + 1 else [f"{calls(folder) - before} calls of the compiler"]
    problems += [] if f"--native: {len(native)} runs with" in made.stderr else [made.stderr]
    ratio, moved = 0.0, 0.0
    for column in library[0]:
        pairs = [(float(a[column] or "nan"), float(b[column] or "nan")) for a, b in zip(library, native)] if column not in ("run", "status", "why") else []
        size = max([1e-9] + [abs(a) for a, b in pairs if a == a])
        if column != name and not column.startswith(("constraint", "energy.error")):
            ratio = max([ratio] + [abs(a - b) / (1e-10 * max(size, 1.0)) if a == a or b == b else 0.0 for a, b in pairs])
            moved = max([moved] + [abs(a - pairs[0][0]) for a, b in pairs if a == a])
    problems += [] if ratio <= 1.0 else [f"ratio {ratio:.2g} of the bound 1e-10"]
    problems += [] if moved > 1e-4 else ["the runs do not differ"]
    note(f"{scene}: ratio {ratio:.2g}, runs differ by {moved:.2g}")
    return [f"{scene}: {problem}" for problem in problems]


def check_sweeps(folder):
    path = compiler(folder)
    claim("sweeps_have_the_lines_of_the_library", [p for swept in SWEPT for p in compare_sweep(folder, path, *swept)])
    words = (SCENES / "andrews.yaml", "--vary", "bodies.K1.mass=0.04:0.05:5", *STEPS, "--native")
    before = calls(folder)
    one, _ = sweep(folder, "1.csv", *words, "--jobs", "1", CC=str(path))
    two, _ = sweep(folder, "2.csv", *words, "--jobs", "2", CC=str(path))
    same = one.returncode + two.returncode == 0 and pathlib.Path(folder, "1.csv").read_bytes() == pathlib.Path(folder, "2.csv").read_bytes()
    claim("threads_share_the_file_and_change_no_byte", [] if same and calls(folder) == before else [one.stderr, two.stderr])
    weight = pathlib.Path(folder, "weight.yaml")
    weight.write_text(PLAIN.replace("-9.81", "=g").replace("kinetree: 1", "kinetree: 1\nparameters: {g: -9.81}"))
    made, lines = sweep(folder, "zero.csv", weight, "--vary", "g=-9,-10,0", "--native", "--one-by-one", CC=str(path))
    expected = len(lines) == 3 and "--native: 2 runs with" in made.stderr and "1 by the library, since the structure differs" in made.stderr
    claim("runs_of_another_structure_take_the_library", [] if expected else [made.stderr])
    words = (SCENES / "arm7.yaml", "--vary", "bodies.elbow.mass=2:4:3", *STEPS)
    made, _ = sweep(folder, "tree.csv", *words, "--native", CC=str(path))
    sweep(folder, "plain.csv", *words)
    same = pathlib.Path(folder, "tree.csv").read_bytes() == pathlib.Path(folder, "plain.csv").read_bytes()
    claim("sweeps_of_trees_take_the_lanes_of_the_library", [] if same and "runs of a tree at a time" in made.stderr else [made.stderr])
    made, _ = sweep(folder, "reject.csv", SCENES / "bouncing-ball.yaml", "--vary", "bodies.ball.mass=1,2", "--native", CC=str(path))
    left = pathlib.Path(folder, "reject.csv").exists()
    claim("sweeps_that_cannot_be_generated_are_rejected", [] if made.returncode == 2 and "leave --native out" in made.stderr and not left else [made.stderr])


def main():
    if shutil.which("cc") is None:
        skip("native", "there is no compiler of the name cc")
        finish()
    with tempfile.TemporaryDirectory() as folder:
        problems = [f"{name}: {problem}" for name in COMPARED for problem in compare(folder, name)]
        claim("records_of_bundled_scenes_are_those_of_the_library", problems)
    for check in (check_cache, check_resumed, check_rejections, check_sweeps):
        with tempfile.TemporaryDirectory() as folder:
            check(folder)
    finish()


main()
