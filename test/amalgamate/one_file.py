"""The core in one file (apps/amalgamate) against the library.

one_file.py COMPILER SOURCE-ROOT FOLDER BITS.c [SCENE.a STUDY.a CORE.a]

Writes kinetree.c and its two headers, compiles them once, and runs sampled test programs of the suite with them. With the
archives of the library, states of all bundled scenes are compared to the last bit.
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, skip

STEPS = 100
FLAGS = ["-std=c17", "-O1", "-fno-math-errno", "-Wno-psabi", "-Wall", "-Wextra", "-Werror"]
STOREYS = ("math", "model", "mechanics", "motion", "study", "files", "output")
TEST_FLAGS = ["-std=c17", "-O1", "-D_POSIX_C_SOURCE=200809L", "-UNDEBUG", "-Iinclude", *(f"-Ilib/{storey}" for storey in STOREYS), "-Itest"]
LAPACK = ["-llapacke", "-lopenblas"]
MODES = {"plain": []}
CPP_FLAGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
CPP_PROGRAM = """#include "kinetree-experimental.h"
int main() {
    kt_model *model = nullptr;
    kt_error error = {};
    const kt_description empty = kt_description_default();
    const kt_status status = kt_model_compile(&empty, nullptr, &model, &error);
    kt_model_free(model);
    return status == KT_OK && kt_integrator_size(kt_method_find("rk4"), 2) > 0 ? 0 : 1;
}
"""
WRONG_CALLS = {"": "give the folder of the sources and a folder", ". --small": "there is no option '--small'",
               "apps out": "'apps' has no lib/meson.build", ". README.md": "the folder 'README.md' cannot be made"}

# Programs of the suite with the sources of each, in test/.
TREE = [f"mechanics/dynamics/{name}.c" for name in ("oracle", "oracle_motion", "rewrite", "tree")]
TANGLE = [*TREE, *(f"mechanics/constraint/{name}.c" for name in ("linkage", "tangle", "tangle_dense"))]
PROBLEMS, SCENES = "motion/integrator/problems.c", "motion/simulation/scenes.c"
SAMPLE = {
    "mechanics/dynamics/aba": TREE, "mechanics/dynamics/rnea": TREE, "mechanics/dynamics/planar": TREE, "mechanics/dynamics/published": TREE,
    "model/effect/jacobian": [], "mechanics/evaluate/custom_loop": TANGLE, "mechanics/evaluate/reaction": TANGLE,
    "mechanics/assembly/order": TANGLE, "motion/integrator/order": [PROBLEMS], "motion/integrator/radau": [PROBLEMS],
    "motion/simulation/gap": [SCENES], "motion/contact/feet": [SCENES],
    "motion/simulation/checkpoint": [SCENES, "mechanics/dynamics/tree.c"],
}


class Bench:
    def __init__(self, compiler, root, folder):
        self.compiler, self.root, self.folder, self.objects = compiler, root, folder, {}

    def run(self, *command, cwd=None):
        """The output, or None after the errors have been printed."""
        ended = subprocess.run(command, capture_output=True, text=True, cwd=cwd or self.root)
        if ended.returncode != 0:
            for line in (ended.stderr or ended.stdout).splitlines()[:20]:
                note(line)
        return ended.stdout if ended.returncode == 0 else None

    def engine(self, name, flags):
        """The object of kinetree.c with these macros, or None."""
        out = self.folder / f"{name}.o"
        done = self.run(self.compiler, *FLAGS, *flags, "-c", "kinetree.c", "-o", str(out), cwd=self.folder)
        return None if done is None else str(out)

    def test_object(self, source):
        if source not in self.objects:
            out = self.folder / (pathlib.Path(source).name.removesuffix(".c") + f"-{len(self.objects)}.o")
            done = self.run(self.compiler, *TEST_FLAGS, "-c", str(self.root / "test" / source), "-o", str(out))
            self.objects[source] = None if done is None else str(out)
        return self.objects[source]

    def program(self, name, sources, libraries):
        objects = [self.test_object(source) for source in sources]
        out = self.folder / name.replace("/", "-")
        if None in objects or self.run(self.compiler, *objects, *libraries, "-lm", "-o", str(out)) is None:
            return None
        return str(out)


def bits(bench, name, source, archives):
    # The reader has its own copy of some sources of the core.
    libraries = ["-Wl,--allow-multiple-definition", *archives, "-lyaml", "-lexpat", *LAPACK, "-lpthread"]
    program = bench.program(name, [source], libraries)
    return program and bench.run(program, "apps/scenes", str(STEPS))


def compare_bits(bench, engine, source, archives):
    scene, study, core = archives
    ours, theirs = (bits(bench, name, source, [last, scene, study, last])
                    for name, last in (("bits-one", engine), ("bits-library", core)))
    problems = [] if ours and theirs else ["a program could not be built or run"]
    if not problems:
        pairs = list(zip(ours.splitlines(), theirs.splitlines()))
        started = sum(" a " in line for line in theirs.splitlines())
        problems = [f"{b.split()[0]} has other bits" for a, b in pairs if a != b]
        note(f"{len(pairs)} scenes, {started} with states after {STEPS} steps, {len(problems)} with other bits")
        problems += [] if started >= 60 else ["less than 60 scenes have states"]
    claim("states_of_bundled_scenes_have_the_bits_of_the_library", problems)


def run_sample(bench, engine):
    problems = []
    for name, sources in SAMPLE.items():
        program = bench.program(name, [f"{name}.c", *sources, "check.c", "fixture.c", "random.c", "runner.c"], [engine, *LAPACK])
        if program is None or bench.run(program) is None:
            problems.append(f"{name} fails")
    note(f"{len(SAMPLE)} programs of the suite")
    claim("sampled_tests_of_the_suite_pass_with_one_file", problems)


def check_wrong_calls(root):
    problems = []
    for words, message in WRONG_CALLS.items():
        ended = subprocess.run([sys.executable, "apps/amalgamate/amalgamate.py", *words.split()], capture_output=True, text=True, cwd=root)
        if ended.returncode != 1 or message not in ended.stderr or "Traceback" in ended.stderr:
            problems.append(f"'{words}': {ended.stderr[-300:] or 'it is accepted'}")
    claim("wrong_calls_are_rejected_with_a_remedy", problems)


def check_page(bench, name, engine):
    """The program of the page, with the engine in place of the library. It links: no part calls one that is left out."""
    page = (bench.root / "include/pages/one-file.md").read_text()
    shown = re.search(r"^```c\n(.*?)^```\n\n```text\n(.*?)^```$", page, flags=re.S | re.M)
    (bench.folder / "pendulum.c").write_text(shown[1])
    program = str(bench.folder / "pendulum")
    libraries = LAPACK if name == "full" else []
    made = bench.run(bench.compiler, "-std=c17", "-O2", "pendulum.c", engine, *libraries, "-lm", "-o", program, cwd=bench.folder)
    printed = None if made is None else bench.run(program)
    claim(f"the_program_of_the_page_runs_with_{name}", [] if printed == shown[2] else [f"it prints {printed}"])


def check_cpp(bench, engine):
    """C++ programs include the header, and call the object that a C compiler made."""
    own = pathlib.Path(bench.compiler)
    compiler = shutil.which(str(own.with_name({"gcc": "g++", "clang": "clang++"}[own.name])))
    if compiler is None:
        skip("cpp_programs_call_the_engine", f"{own.name} has no compiler of C++ beside it")
        return
    (bench.folder / "program.cpp").write_text(CPP_PROGRAM)
    problems = []
    for standard in ("c++11", "c++20"):
        program = str(bench.folder / f"program-{standard}")
        made = bench.run(compiler, f"-std={standard}", *CPP_FLAGS, "program.cpp", engine, *LAPACK, "-lm", "-o", program, cwd=bench.folder)
        if made is None or bench.run(program) is None:
            problems.append(f"{standard} fails")
    claim("cpp_programs_call_the_engine", problems)


def main():
    compiler, root, folder = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    folder.mkdir(parents=True, exist_ok=True)
    bench = Bench(compiler, root, folder)
    written = bench.run(sys.executable, "apps/amalgamate/amalgamate.py", str(root), str(folder))
    claim("the_script_writes_both_files", [] if written is not None else ["it fails"])
    for name, flags in MODES.items():
        engine = bench.engine(name, flags)
        claim(f"{name}_compiles_without_warnings", [] if engine else ["it does not compile"])
        if engine:
            check_page(bench, name, engine)
            undefined = bench.run("nm", "--undefined-only", engine) or "__assert_fail"
            claim(f"{name}_has_no_asserts", ["it calls __assert_fail"] if "__assert_fail" in undefined else [])
    fast = subprocess.run([compiler, *FLAGS, "-ffast-math", "-fsyntax-only", "kinetree.c"], cwd=folder, capture_output=True, text=True)
    expected = fast.returncode != 0 and "sums must keep their order" in fast.stderr
    claim("a_compiler_that_reorders_sums_is_rejected", [] if expected else [fast.stderr[:400] or "it compiles"])
    check_wrong_calls(root)
    engine = bench.engine("full", ["-DKINETREE_FULL"])
    claim("full_compiles_without_warnings", [] if engine else ["it does not compile"])
    if engine:
        check_page(bench, "full", engine)
        check_cpp(bench, engine)
        run_sample(bench, engine)
        if len(sys.argv) > 5:
            compare_bits(bench, engine, sys.argv[4], [str(pathlib.Path(name).resolve()) for name in sys.argv[5:8]])
    finish()


main()
