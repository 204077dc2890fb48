"""Compiles the engine of live pages for WebAssembly.

compile.py core CLANG KINETREE-FMU.c OUTPUT.o
    the source of FMUs, which has the core, the scene reader and the functions of FMI
compile.py module CLANG ROOT CORE.o OUTPUT.wasm.gz DEPENDENCIES SOURCE.c...
    the functions of the page, linked with it: the functions that apps/browser/engine.js calls, and what they need.
    DEPENDENCIES is a rule for ninja.

Sizes decide over speed: a page is loaded more often than a long run is made. zopfli, where the machine has it, compresses by 5 % better
than Python's gzip. Sums and products are rounded one by one, as on
other processors. Instructions for vectors (-msimd128) are left out: the SLP vectoriser and the vector combiner of clang 14 then exchange
lanes of a sum in kt_planar_pass_revolute. Inertias of planar trees are wrong, and test/browser/engine.py fails for
apps/scenes/chain.yaml. The source has no part in it: -fno-slp-vectorize cures the sum, and so does -mllvm
-disable-vector-combine. The undefined-behaviour sanitizer finds nothing in these scenes.
"""
# SPDX-License-Identifier: Apache-2.0
import gzip
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

FLAGS = ["--target=wasm32-wasi", "--sysroot=/usr", "-std=c17", "-Oz", "-fno-math-errno", "-ffp-contract=off",
         "-ffunction-sections", "-fdata-sections", "-fvisibility=hidden", "-D_XOPEN_SOURCE=700", "-Wno-psabi"]
STACK = 1 << 20  # bytes
CALLS = ("malloc", "free", "fmi3SetFloat64", "fmi3GetFloat64", "fmi3EnterInitializationMode", "fmi3ExitInitializationMode",
         "fmi3DoStep", "fmi3GetNumberOfContinuousStates", "fmi3GetContinuousStates",
         "sin", "cos", "exp")  # for test/browser/engine.py
STOREYS = ("math", "model", "mechanics", "motion", "study", "files", "output")


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"compile.py: {' '.join(map(str, words[:3]))} ... failed\n{done.stderr}")


def calls_of_page(sources):
    """The functions that page.c declares for the page."""
    page = next(pathlib.Path(source) for source in sources if source.endswith("page.c"))
    return re.findall(r"^KT_PAGE\([^(]*?(\w+)\(", page.read_text(), re.M)


def compress(module):
    zopfli = shutil.which("zopfli")
    if zopfli is None:
        return gzip.compress(module.read_bytes(), 9, mtime=0)
    return subprocess.run([zopfli, "--i5", "-c", str(module)], capture_output=True, check=True).stdout


def compile_module(clang, root, core, output, dependencies, *sources):
    root = pathlib.Path(root)
    include = [f"-I{root / path}" for path in ("apps/browser", "apps/fmu", "apps/kinetree", "include", *(f"lib/{s}" for s in STOREYS))]
    read = set()
    with tempfile.TemporaryDirectory() as folder:
        objects = []
        for i, source in enumerate(sources):
            objects.append(pathlib.Path(folder, f"{i}.o"))
            run(clang, *FLAGS, *include, "-DNDEBUG", "-DKT_NO_LAPACK=1", "-DKT_ISA=baseline", "-MD", "-MF", f"{objects[-1]}.d", "-c", source, "-o", objects[-1])
            read.update(pathlib.Path(f"{objects[-1]}.d").read_text().replace("\\\n", " ").split()[1:])
        module = pathlib.Path(folder, "kinetree.wasm")
        run(clang, *FLAGS[:2], "-mexec-model=reactor", *objects, core, "-lm", "-Wl,--gc-sections", "-Wl,--strip-all", "-Wl,--wrap=fopen", "-Wl,--stack-first",
            f"-Wl,-z,stack-size={STACK}", *(f"-Wl,--export={name}" for name in (*CALLS, *calls_of_page(sources))), "-o", module)
        pathlib.Path(output).write_bytes(compress(module))
    pathlib.Path(dependencies).write_text(f"{output}: {' '.join(sorted(read))}\n")


def main():
    if sys.argv[1] == "core":
        clang, source, output = sys.argv[2:]
        run(clang, *FLAGS, "-w", "-c", source, "-o", output)
    else:
        compile_module(*sys.argv[2:])


main()
