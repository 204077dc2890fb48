"""export_c COMMAND SOURCE-ROOT: the command line of `kinetree export --c`: files, rejections, exit statuses."""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import platform
import re
import resource
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

from exported import BOUNCE, export, rejected

SCENES = pathlib.Path(sys.argv[2]).resolve() / "apps/scenes"
# a weight that pulls over a wheel
ROPE = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: block, joint: {type: prismatic, axis: x}, mass: 2}
  - {name: weight, joint: {type: prismatic, axis: z, at: [1.1, 0, -0.6]}, mass: 1}
effects:
  - {name: rope, type: expression, path: [block, {body: world, at: [1, 0, -0.1], radius: 0.1, axis: y, side: [1, 0, 1]}, weight], force: "-20*length"}
"""


GROWTH = 2.0  # from 50 links to 100; a matrix of all coordinates, written as a graph, takes 5 times as much


def check_memory(folder):
    """The first programs that take much: a peak is that of all programs so far."""
    peaks = []
    for links in (50, 100):
        chain = pathlib.Path(folder, "chain.yaml")
        chain.write_text(subprocess.run([sys.argv[1], "make", "chain", "--links", str(links)], capture_output=True, text=True, check=True).stdout)
        made = export(folder, "--c", chain, "--out", "chain.c", "--functions", "forward")
        peaks.append(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024 if made.returncode == 0 else float("nan"))
    growth = peaks[1] / peaks[0]
    note(f"{peaks[0]:.1f} MB for 50 links, {peaks[1]:.1f} MB for 100: observed growth {growth:.2f}, bound {GROWTH}")
    claim("memory_of_long_chains_grows_with_their_length", [] if growth <= GROWTH else [f"growth {growth}"])


ALL = "forward,inverse,bias,mass,effects,acceleration,energy,inverse_derivatives,forward_derivatives,effect_derivatives,heun,rk4," \
      "semi_implicit,heun_derivatives,rk4_derivatives,loops,project"


def check_names(folder, scene):
    """Public names are NAME_function. No name of the source alone may be one of them, whatever NAME is."""
    made = export(folder, "--c", scene, "--out", "zz.c", "--functions", ALL)
    header, source = (pathlib.Path(folder, f"zz.{end}").read_text() if made.returncode == 0 else made.stderr for end in "hc")
    public = set(re.findall(r"\bzz_(\w+)", header))
    own = set(re.findall(r"^(?:static|typedef|#\s*define|enum)\b[^\n(;]*?\b(\w+) ?(?:\(|;|=|\[|$)", source, re.M)) | set(re.findall(r"^#\s*define (\w+)", source, re.M))
    note(f"{len(public)} public names, {len(own)} of the source alone")
    alike = sorted(name for name in own for end in public if name.endswith("_" + end) and not name.startswith("zz_"))
    claim("names_do_not_collide_whatever_the_file_is_called", alike + ([] if len(public) > 20 and len(own) > 20 else ["too few names"]))


# Names that are keywords of C or C++, or names of the generated source. Two differ in a dash alone.
WORDS = """kinetree: 1
gravity: [0, 0, -9.81]
parameters: {int: 2, double: 0.3, template: 5}
bodies:
  - {name: int, joint: {type: revolute, axis: z, name: goto}, mass: =int, com: [=double, 0, 0], inertia: [0.1, 0.2, 0.3], markers: {class: [0.6, 0, 0], new: [1, 2, 3]}}
  - {name: class, parent: int, joint: {type: revolute, axis: y, at: [0.6, 0, 0], name: switch}, mass: 1, com: [0.2, 0.1, 0], inertia: [0.1, 0.2, 0.3], markers: {class: [0.6, 0, 0], operator: [0, 1, 0]}}
  - {name: real, parent: class, joint: {type: revolute, axis: y, at: [0.6, 0, 0], name: q}, mass: 1, inertia: [0.1, 0.2, 0.3], markers: {a-b: [1, 2, 3], a_b: [1, 2, 4]}}
  - {name: gravity-x, parent: real, joint: {type: spherical, at: [0.6, 0, 0], name: k}, mass: 1, inertia: [0.1, 0.2, 0.3]}
  - {name: gravity_x, parent: real, joint: {type: prismatic, axis: x, name: w}, mass: 1, inertia: [0.1, 0.2, 0.3]}
states: {static: {initial: 0.1, rate: "-template*static + position.goto"}}
effects:
  - {name: if, type: joint_spring, joint: goto, stiffness: 1, rest: 10 deg}
  - {name: static, type: expression, joint: switch, force: "static - position.q^3"}
loops: [{name: namespace, type: spherical, between: [real, {body: world, at: [1.3, 0, 0]}]}]
"""
STRICT = ["-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror", "-fsyntax-only"]


def check_words(folder):
    """Files are correct C99, and their headers are correct C++, whatever the names of the scene are."""
    pathlib.Path(folder, "words.yaml").write_text(WORDS)
    made = export(folder, "--c", "words.yaml", "--out", "words.c", "--functions", "forward,inverse,mass,effects,states,markers,rk4,project")
    pathlib.Path(folder, "words.cpp").write_text('#include "words.h"\nint main() { return words_NQ == 9 ? 0 : 1; }\n')
    problems, calls = [] if made.returncode == 0 else [made.stderr], 0
    for standard, source, compilers in (("c99", "words.c", ("gcc", "clang")), ("c++11", "words.cpp", ("g++", "clang++"))):
        for compiler in filter(shutil.which, compilers if made.returncode == 0 else ()):
            ran = subprocess.run([compiler, f"-std={standard}", *STRICT, source], cwd=folder, capture_output=True, text=True)
            calls += 1
            problems += [] if ran.returncode == 0 else [f"{compiler}: {ran.stderr[:600]}"]
    note(f"{calls} compilations without warnings")
    claim("names_that_are_keywords_make_correct_files", problems)
    taken = re.findall(r"^    words_number (\w+);", pathlib.Path(folder, "words.h").read_text() if made.returncode == 0 else "", re.M)
    twice = sorted({name for name in taken if taken.count(name) > 1})
    claim("names_of_parameters_differ", twice + ([] if "gravity_x_2_mass" in taken else ["gravity-x and gravity_x have one name"]))


def check_arithmetic(folder, scene):
    """A reordered sum, or one with more digits than a number has, makes sines that are wrong."""
    if shutil.which("cc") is None:
        return
    export(folder, "--c", scene, "--out", "zz.c", "--functions", "forward")
    cases = {"": 0, "-ffast-math": 1, "-Dzz_FLOAT -ffast-math": 1, "-Ofast": 1}
    if platform.machine() == "x86_64":
        cases |= {"-mfpmath=387": 1, "-Dzz_FLOAT -mfpmath=387": 1}
    for flags, status in cases.items():
        made = subprocess.run(["cc", "-std=c99", "-fsyntax-only", *flags.split(), "zz.c"], cwd=folder, capture_output=True, text=True)
        expected = made.returncode == status and ("must" in made.stderr) == bool(status)
        claim(f"arithmetic_is_that_of_numbers{flags.replace('-', '_').replace(' ', '')}", [] if expected else [made.stderr or "it compiles"])


def main():
    with tempfile.TemporaryDirectory() as folder:
        check_memory(folder)
        check_arithmetic(folder, SCENES / "four-bar.yaml")
        check_words(folder)
        check_names(folder, SCENES / "four-bar.yaml")
    arm, loop, effects = SCENES / "arm7.yaml", SCENES / "four-bar.yaml", SCENES / "servo-arm.yaml"
    rejected("standard_output_cannot_hold_two_files", 1, "give --out FILE.c", "--c", arm)
    rejected("out_ends_with_c", 1, "give --out FILE.c", "--c", arm, "--out", "arm.txt")
    rejected("name_begins_with_a_letter", 1, "must begin with a letter", "--c", arm, "--out", "7.c")
    rejected("name_has_no_dash", 1, "'my-arm' must begin with a letter", "--c", arm, "--out", "my-arm.c")
    rejected("name_has_63_letters_at_most", 1, "must have at most 63 letters", "--c", arm, "--out", "a" * 64 + ".c")
    rejected("unknown_function_has_a_proposal", 1, "did you mean 'inverse'?", "--c", arm, "--out", "arm.c", "--functions", "forward,invers")
    rejected("unknown_function_is_named_also_without_a_file", 1, "--functions has no 'nonsense'", "--c", arm, "--functions", "nonsense")
    rejected("one_format_at_a_time", 1, "one of them", "--c", "--urdf", arm, "--out", "arm.c")
    rejected("functions_belong_to_c", 1, "option of --c", "--mjcf", arm, "--functions", "mass")
    rejected("fold_belongs_to_c", 1, "option of --c", "--mjcf", arm, "--fold")
    for scene, reason in {"bouncing-ball": "effect 'floor': code for it cannot be generated: it acts on one side only; contacts and stops with a stiffness",
                          "clutch": "effect 'plates': code for it cannot be generated: its friction sticks and slips; friction without 'stick'"}.items():
        rejected(f"hard_effects_are_rejected_with_an_alternative_{scene.replace('-', '_')}", 2, reason, "--c", SCENES / f"{scene}.yaml", "--out", "arm.c")
    rejected("wires_along_a_helix_are_rejected", 2, "wire: code for this loop cannot be generated (the nearest point of a helix or a spline follows from an iteration; a line or a circle can", "--c", SCENES / "spiral-wire.yaml", "--out", "arm.c", "--functions", "forward")
    with tempfile.TemporaryDirectory() as folder:
        rope = pathlib.Path(folder, "rope.yaml")
        rope.write_text(ROPE)
        rejected("forces_along_paths_are_rejected", 2, "it acts along a path", "--c", rope, "--out", "rope.c", "--functions", "effects")
    rejected("scene_must_exist", 2, "nothing.yaml", "--c", "nothing.yaml", "--out", "arm.c")
    rejected("changes_need_joints_without_quaternions", 2, "use kt_step_derivatives", "--c", SCENES / "humanoid.yaml", "--out", "arm.c", "--functions", "rk4_derivatives")
    with tempfile.TemporaryDirectory() as folder:
        made = export(folder, "--c", arm, "--out", "my_arm.c")
        source, header = pathlib.Path(folder, "my_arm.c"), pathlib.Path(folder, "my_arm.h")
        written = made.returncode == 0 and source.is_file() and header.is_file()
        claim("both_files_are_written", [] if written else [made.stderr])
        claim("names_begin_with_the_file", [] if written and "int my_arm_forward(" in header.read_text() else ["no my_arm_forward"])
        claim("four_functions_by_default", [] if written and header.read_text().count("\nint my_arm_") == 4 else ["not four"])
        made = export(folder, "--c", arm, "--out", "a" * 63 + ".c")
        claim("names_of_63_letters_are_whole", [] if made.returncode == 0 and '#include "' + "a" * 63 + '.h"' in pathlib.Path(folder, "a" * 63 + ".c").read_text() else [made.stderr])
        claim("source_includes_its_header", [] if written and '#include "my_arm.h"' in source.read_text() else ["another include"])
        mass = "bodies.tool.mass=2.75"
        made = export(folder, "--c", arm, "--out", "set.c", "--set", mass)
        claim("set_applies", [] if "(number)2.75, /* tool_mass */" in pathlib.Path(folder, "set.c").read_text() else [made.stderr])
        made = export(folder, "--c", effects, "--out", "servo.c")
        claim("effects_are_noted", [] if made.returncode == 0 and "forces of effects" in made.stderr else [made.stderr])
        made = export(folder, "--c", effects, "--out", "step.c", "--functions", "rk4")
        step = pathlib.Path(folder, "step.h")
        claim("steps_have_effects_and_the_time", [] if step.is_file() and "int step_rk4(const step_model *model, step_number t," in step.read_text() else [made.stderr])
        made = export(folder, "--c", SCENES / "pid-arm.yaml", "--out", "pid.c", "--functions", "heun")
        pid = pathlib.Path(folder, "pid.h")
        claim("steps_have_auxiliary_states", [] if pid.is_file() and "pid_real *next_x);" in pid.read_text() else [made.stderr])
        made = export(folder, "--c", loop, "--out", "bar.c", "--functions", "forward,project")
        bar = pathlib.Path(folder, "bar.h")
        claim("loops_have_a_projection", [] if bar.is_file() and "int bar_project(" in bar.read_text() else [made.stderr])
        pathlib.Path(folder, "bounce.yaml").write_text(BOUNCE)
        pathlib.Path(folder, "until.yaml").write_text(BOUNCE.replace("duration: 3", "duration: 3, until: t > 2"))
        made = export(folder, "--c", "bounce.yaml", "--out", "b.c", "--functions", "rk4,states")
        claim("events_are_noted", [] if made.returncode == 0 and "left out: events (1); a program" in made.stderr and "states that they set" in made.stderr else [made.stderr])
        header = pathlib.Path(folder, "b.h").read_text()
        claim("auxiliary_states_are_listed_by_name", [] if " *    0  auxiliary state k: x[0]\n *    1  auxiliary state heat: x[1]\n" in header else [header[:900]])
        made = export(folder, "--c", "until.yaml", "--out", "u.c")
        claim("until_is_an_event", [] if "events (2, `until` among them)" in made.stderr else [made.stderr])
        made = export(folder, "--c", loop, "--out", "bar.c")
        claim("nothing_is_noted_without_events", [] if made.stderr == "" and "auxiliary state " not in pathlib.Path(folder, "bar.h").read_text() else [made.stderr])
        large = export(folder, "--c", SCENES / "humanoid.yaml", "--out", "large.c", "--functions", "forward_derivatives")
        claim("sources_beyond_2_MB_are_reported", [] if "large.c has " in large.stderr and " MB" in large.stderr and "warning" not in made.stderr else [large.stderr, made.stderr])
    finish()


main()
