"""The stable interface of the library is that of its version.

abi.py INCLUDE-DIRECTORY DUMP LAYOUT VERSION [C-COMPILER...]     compares the headers with those of the last release
abi.py --update INCLUDE-DIRECTORY DUMP LAYOUT C-COMPILER...      writes both files of a release

A dump has a line for each function, struct, enumeration, callback type and constant of the stable headers, which kinetree.h
includes: its name, and a sum of its declaration without comments and white space. A binary or a program of the last release depends on these. New
names break nothing. A name that is gone or has another declaration needs another interface version (the SONAME), which is
MAJOR.MINOR before 1.0 and MAJOR after it. Structs of options may grow at their end: they tell their size.

The text does not show that a struct has moved a member of one which contains it. Where abidiff and abidw (libabigail) are
installed, they compare sizes and offsets with LAYOUT, an archive of what abidw wrote of the release. Both are taken from a
library of empty functions, so that they depend on the headers alone.
"""
# SPDX-License-Identifier: Apache-2.0
import hashlib
import lzma
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note


def version_of(text):
    return re.search(r'#define KT_VERSION "(.*)"', text)[1]


def interface_of(version):
    major, minor, *_ = version.split(".")
    return f"{major}.{minor}" if major == "0" else major


def headers(include, umbrella="kinetree.h"):
    """The stable headers, or those of another umbrella."""
    found = re.findall(r'^#include "(kinetree/\w+\.h)"', (include / "kinetree" / umbrella).read_text(), flags=re.M)
    return [include / name for name in sorted(found)]


def functions(text):
    """The declarations of functions in a header."""
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S).replace("\\\n", " ")
    return re.findall(r"^KT_API (.*?);", re.sub(r"^\s*#.*$", "", text, flags=re.M).replace("KT_CHECKED", ""), flags=re.S | re.M)


def declarations(include, umbrella="kinetree.h"):
    """Name and text of everything that a program can depend on, without comments and white space."""
    found = {}
    for path in headers(include, umbrella):
        text = re.sub(r"/\*.*?\*/", "", path.read_text(), flags=re.S).replace("\\\n", " ")
        for line in re.findall(r"^#define (KT_\w+.*)$", text, flags=re.M):
            name = re.match(r"\w+", line)[0]
            if not name.startswith("KT_VERSION"):
                found[f"#{name}"] = line
        text = re.sub(r"^\s*#.*$", "", text, flags=re.M).replace("KT_CHECKED", "")
        for declaration in re.findall(r"^KT_API (.*?);", text, flags=re.S | re.M):
            found[re.search(r"(kt_\w+)\(", declaration)[1]] = declaration
        for kind, name, body in re.findall(r"^typedef (struct|union|enum) (\w+) \{(.*?)^\}", text, flags=re.S | re.M):
            found[f"{kind} {name}"] = body
        for declaration in re.findall(r"^typedef ([^{};]*?\([^{};]*?\));", text, flags=re.S | re.M):
            found[f"callback {re.search(r'(kt_[a-z_0-9]+)[)]?[(]', declaration)[1]}"] = declaration
    return {name: re.sub(r"\s+", "", body) for name, body in found.items()}


def sum_of(body):
    return hashlib.sha256(body.encode()).hexdigest()[:12]


def entry(name, body):
    """What the dump has of a declaration: its sum, and of what may grow the length, too."""
    return f"{sum_of(body)}/{len(body)}" if re.fullmatch(r"struct kt_\w+_options", name) else sum_of(body)


def is_same(body, then):
    wanted, _, length = then.partition("/")
    return sum_of(body[:int(length)] if length else body) == wanted


def read(dump):
    first, *lines = dump.read_text().splitlines()
    return first, dict(line.rsplit(" ", 1) for line in lines)


def broken(now, then):
    return [f"{name} is gone" if name not in now else f"{name} has changed"
            for name in sorted(then) if name not in now or not is_same(now[name], then[name])]


# ---- sizes and offsets, by libabigail ------------------------------------------------------------------------------------

# Options grow at their end. What contains them by value moves, and is reported.
SUPPRESSED = """[suppress_type]
  type_kind = struct
  name_regexp = ^kt_[a-z_]*_options$
  has_data_member_inserted_at = end
  has_size_change = yes
"""


def layout(include, compiler, folder):
    """What abidw writes of a library of empty functions with these headers."""
    source, library = folder / "interface.c", folder / "libinterface.so"
    lines = ['#include "kinetree/kinetree.h"']
    for path in headers(include):
        for declaration in functions(path.read_text()):
            declaration = re.sub(r"KT_PRINTF\(.*?\)", "", declaration)
            lines.append(f"KT_API {declaration} {{ __builtin_trap(); }}")
    source.write_text("\n".join(lines) + "\n")
    subprocess.run([*compiler, "-std=c17", "-g", "-gdwarf-4", "-w", "-fPIC", "-shared", f"-I{include}", "-o", library, source], check=True)
    command = ["abidw", "--no-corpus-path", "--no-comp-dir-path", "--no-elf-needed", "--no-show-locs", library]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def moved(now, then, folder):
    """Functions that abidiff finds changed or gone."""
    for name, text in (("now", now), ("then", then), ("suppressed", SUPPRESSED)):
        (folder / name).with_suffix(".abi").write_text(text)
    found = subprocess.run(["abidiff", "--suppressions", folder / "suppressed.abi", "--no-added-syms", folder / "then.abi", folder / "now.abi"],
                           capture_output=True, text=True)
    if found.returncode & 3:
        raise SystemExit(f"abidiff: {found.stdout}{found.stderr}")
    return [line.strip() for line in found.stdout.splitlines() if re.match(r"\s*\[[CD]\] ", line)]


def changed_headers(include, folder, old, new):
    """A copy of the headers in which something else stands."""
    copy = folder / "include"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(include, copy)
    for path in (copy / "kinetree").glob("*.h"):
        path.write_text(path.read_text().replace(old, new))
    return copy


def judge_layout(include, archive, versions, compiler):
    if not compiler or not shutil.which("abidiff") or not shutil.which("abidw"):
        note("sizes and offsets are not compared: libabigail (abidiff, abidw) is not installed")
        return
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        now, then = layout(include, compiler, folder), lzma.decompress(archive.read_bytes()).decode()
        changes = moved(now, then, folder)
        note(f"abidiff: {len(changes)} functions see other sizes or offsets, or are gone")
        claim("sizes_and_offsets_change_with_the_version_alone", problems(*versions, changes))
        wider = layout(changed_headers(include, folder, "} kt_pose;", "    double more;\n} kt_pose;"), compiler, folder)
        claim("a_struct_that_grows_is_noticed", [] if moved(wider, now, folder) else ["it is not"])
        longer = layout(changed_headers(include, folder, "} kt_batch_options;", "    double more;\n} kt_batch_options;"), compiler, folder)
        claim("options_may_grow_at_their_end", moved(longer, now, folder))


def problems(version, released, changes):
    if interface_of(version) != interface_of(released) or not changes:
        return []
    return [f"{version} has the interface version {interface_of(released)} of {released}: raise the version"] + changes


def main():
    if sys.argv[1] == "--update":
        include, dump, archive = (pathlib.Path(argument) for argument in sys.argv[2:5])
        version = version_of((include / "kinetree/status.h").read_text())
        dump.write_text("\n".join([version] + [f"{name} {entry(name, body)}" for name, body in sorted(declarations(include).items())]) + "\n")
        with tempfile.TemporaryDirectory() as name:
            archive.write_bytes(lzma.compress(layout(include, sys.argv[5:], pathlib.Path(name)).encode(), preset=9 | lzma.PRESET_EXTREME))
        return
    include, dump, archive, version = (*(pathlib.Path(argument) for argument in sys.argv[1:4]), sys.argv[4])
    now = declarations(include)
    experimental = declarations(include, "experimental.h")
    released, then = read(dump)
    then = {name: body for name, body in then.items() if name not in experimental}  # 0.1.0 made no difference
    changes = broken(now, then)
    note(f"{len(now)} stable declarations, {sum(not re.search('[ #]', name) for name in now)} functions; since {released}: {len(changes)} changed or gone, {len(now.keys() - then.keys())} new")
    claim("headers_have_declarations", [] if len(now) > 500 and len(then) > 500 else [f"{len(now)}, {len(then)}"])
    claim("functions_are_stable_or_experimental", sorted(now.keys() & experimental.keys()) +
          ([] if "kt_model_compile" in now and "kt_dae_create" in experimental else ["kt_model_compile or kt_dae_create is in the wrong part"]))
    claim("interface_changes_with_the_version_alone", problems(version, released, changes))
    sums = {name: entry(name, body) for name, body in now.items()}
    struct = next(name for name in now if name.startswith("struct "))
    without = {name: body for name, body in now.items() if name != struct}
    claim("a_struct_that_is_gone_or_changed_is_noticed",
          [] if problems(released, released, broken(without, sums)) and
          problems(released, released, broken({**now, struct: "other"}, sums)) and
          not problems(released, released, broken({**now, "struct new": "other"}, sums)) else ["it is not"])
    options = "struct kt_batch_options"
    claim("options_may_grow_at_their_end_alone",
          [] if not broken({**now, options: now[options] + "doublemore;"}, sums) and
          broken({**now, options: "doublemore;" + now[options]}, sums) else ["they may not, or anywhere"])
    judge_layout(include, archive, (version, released), sys.argv[5:])
    finish()


main()
