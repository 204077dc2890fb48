"""What the libraries import, export and hold, read from their symbols.

nm.py INCLUDE-DIRECTORY CORE.a CORE.so STUDY.a STUDY.so [SCENE.a SCENE.so PICTURE.a]
"""
# SPDX-License-Identifier: Apache-2.0
import collections
import fnmatch
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, output_of

# Whatever an object of the core may call. All of it is bounded, reads and writes only what it is given, and allocates
# nothing (qsort does, printf prints, getenv and time are hidden inputs: they are not here).
CORE_MAY_IMPORT = [
    "kt_*",
    # mathematics
    "fabs", "sqrt", "cbrt", "fma", "fmod", "fmin", "fmax", "copysign", "ldexp", "frexp", "scalbn", "modf",
    "nextafter", "sin", "cos", "tan", "sincos", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh",
    "atanh", "exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "pow", "floor", "ceil", "trunc", "round", "rint",
    "nearbyint", "lround", "llround", "remainder", "erf", "powl",
    # memory and text
    "memcpy", "memmove", "memset", "memcmp", "memchr", "strlen", "strnlen", "strcmp", "strncmp", "strchr", "strrchr",
    "strstr", "strcspn", "strspn", "snprintf", "vsnprintf",
    # linear algebra in the caller's workspace
    "LAPACKE_d*_work", "cblas_d*",
    # what compilers call by themselves
    "bcmp", "_GLOBAL_OFFSET_TABLE_", "__stack_chk_fail", "__cpu_model", "__cpu_indicator_init", "__muldc3", "__divdc3",
]
# Sources that work before the first evaluation, or to make memory for those who do not bring their own.
SET_UP = ["base/aligned.c", "base/decimal.c", "base/pool.c", "parts/builder.c", "compile/check_description.c",
          "compile/check_model.c", "compile/compile.c", "compile/rank_disagreement.c", "compile/one_sided.c"]
SET_UP_MAY_IMPORT = ["malloc", "calloc", "realloc", "free", "qsort", "strtod"]
# Threads of a batch, outside the core.
THREADED = ["compare/threads.c"]
THREADED_MAY_IMPORT = ["pthread_*"]
# The scene library reads files, and may allocate; it never prints or ends the program.
SCENE_MAY_NOT_IMPORT = [
    "printf", "vprintf", "puts", "putchar", "perror", "stdout", "stderr", "exit", "_exit", "_Exit", "quick_exit",
    "abort", "__assert_fail", "atexit", "signal", "raise", "setlocale", "longjmp",
]


def matches(name, patterns):
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def plain(symbol):
    """Without the version, and fortified names under their own: __memcpy_chk is memcpy."""
    symbol = symbol.split("@")[0]
    fortified = re.fullmatch(r"__(\w+)_chk", symbol)
    return fortified[1] if fortified else symbol


def imports(archive):
    """(object, symbol) for what each object of an archive does not define itself."""
    for line in output_of("nm", "-A", "--undefined-only", archive).splitlines():
        place, kind, symbol = line.split()[0], *line.split()[-2:]
        assert kind in "Uwv", line
        yield place.rstrip(":").split(":")[-1].split("/")[-1], plain(symbol)


def is_among(object_name, sources):
    return matches(object_name, ["*_" + source.replace("/", "_") + ".o" for source in sources])


def writable_variables(archive):
    """What an object would keep from one call to the next. Tables of pointers are in .data.rel.ro: constant once loaded. Templates
    of initialisers, which gcc puts into .data, have no name, and so nothing writes to them."""
    place = "?"
    for line in output_of("objdump", "-t", archive).splitlines():
        if ":     file format" in line:
            place = line.split(":")[0]
        found = re.search(r" O (\.(?:t?data|t?bss)\S*)\t([0-9a-f]+) (\S+)$", line)
        if found and not found[1].startswith(".data.rel.ro") and int(found[2], 16) > 0:
            yield f"{place}: {found[3]}, {int(found[2], 16)} bytes in {found[1]}"


def exports(shared):
    return {line.split()[-1].split("@")[0] for line in output_of("nm", "-D", "--defined-only", shared).splitlines()}


def declared(headers, mark):
    """Names that follow the mark in these headers, and their headers."""
    names = {}
    for header in headers:
        text = re.sub(r"/\*.*?\*/|^#.*?(?<!\\)$", "", header.read_text(), flags=re.S | re.M)
        for declaration in re.findall(rf"\b{mark}\b([^;{{]*)", text):
            name = re.search(r"\b(kt_\w+)\s*(?:\(|$|\[|=)", declaration.strip())
            names[name[1] if name else declaration.strip()] = header.name
    return names


def main():
    include, core, core_shared, study, study_shared, *scene = [pathlib.Path(argument) for argument in sys.argv[1:]]
    problems = []
    seen = collections.Counter()
    for place, symbol in [*imports(core), *imports(study)]:
        seen[place] += 1
        allowed = CORE_MAY_IMPORT + (SET_UP_MAY_IMPORT if is_among(place, SET_UP) else [])
        allowed += THREADED_MAY_IMPORT if is_among(place, THREADED) else []
        if not matches(symbol, allowed):
            problems.append(f"{place} imports {symbol}")
    note(f"{sum(seen.values())} imports of {len(seen)} objects")
    claim("core_imports_only_what_computes", problems if seen else ["no imports were read"])
    claim("core_keeps_nothing_between_calls", [*writable_variables(core), *writable_variables(study)])

    found = {core_shared.name: exports(core_shared), study_shared.name: exports(study_shared)}
    claim("core_exports_nothing_of_the_study", sorted(found[core_shared.name] & found[study_shared.name]))
    if scene:
        claim("scene_library_never_prints_or_exits",
              [f"{place} imports {symbol}" for place, symbol in imports(scene[0]) if symbol in SCENE_MAY_NOT_IMPORT])
        claim("scene_library_keeps_nothing_between_calls", list(writable_variables(scene[0])))
        found[scene[1].name] = exports(scene[1])
    everything = set().union(*found.values())
    public = declared(sorted(include.glob("kinetree/*.h")), "KT_API")
    inner = declared(sorted((include.parent / "lib").rglob("*.h")), "KT_INNER")
    note(f"{len(everything)} exported, {len(public)} declared, {len(inner)} for the study, scene and picture libraries alone")
    others = [*imports(study), *(imports(scene[0]) if scene else []), *(imports(scene[2]) if scene else [])]
    used = {symbol for _, symbol in others} & found[core_shared.name] - public.keys()
    claim("inner_exports_are_those_that_other_libraries_use",
          sorted(inner.keys() ^ used if scene else used - inner.keys()))
    claim("exports_begin_with_kt",
          [f"{library} exports {name}" for library, names in found.items() for name in sorted(names)
           if not name.startswith("kt_")] if everything else ["no exports were read"])
    claim("exports_are_declared", [f"{name} is in no public header" for name in sorted(everything - public.keys() - inner.keys())])
    claim("declarations_are_exported",
          [f"{header}: {name} is in no library" for name, header in public.items()
           if name not in everything and (scene or header != "scene.h")])
    finish()


main()
