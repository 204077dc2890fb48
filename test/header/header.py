"""Each public header compiles alone, and twice, in every language that may include it.

header.py INCLUDE-DIRECTORY C-COMPILER... [-- C++-COMPILER...]
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, skip

WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
STANDARDS = ["c99", "c11", "c17", "gnu2x", "c++17"]


def compile_text(compiler, standard, include, text):
    language = "c++" if "++" in standard else "c"
    command = compiler[language] + ["-x", language, f"-std={standard}", *WARNINGS, "-fsyntax-only", f"-I{include}", "-"]
    return subprocess.run(command, input=text, capture_output=True, text=True,
                          env={**os.environ, "LC_ALL": "C"})


def main():
    include = pathlib.Path(sys.argv[1])
    split = sys.argv.index("--") if "--" in sys.argv else len(sys.argv)
    compiler = {"c": sys.argv[2:split], "c++": sys.argv[split + 1:]}
    standards = [s for s in STANDARDS if "++" not in s or compiler["c++"]]
    if standards != STANDARDS:
        skip("headers compile in C++", "there is no C++ compiler on this machine")
    known = [s for s in standards if compile_text(compiler, s, include, "extern int probe;\n").returncode == 0]
    note("standards: " + ", ".join(known))
    claim("compiler knows the standards that count", [s for s in standards if s not in known and s != "gnu2x"])
    headers = sorted(include.glob("kinetree/*.h"))
    claim("there are headers", [] if headers else [f"none in {include}"])
    for header in headers:
        line = f'#include "kinetree/{header.name}"\n'
        problems = []
        for standard in known:
            run = compile_text(compiler, standard, include, line * 2)
            if run.returncode != 0:
                problems += [f"{standard}:"] + run.stderr.splitlines()
        claim(f"{header.name} compiles alone", problems)
    finish()


main()
