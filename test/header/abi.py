"""The interface of the library is that of its version.

abi.py INCLUDE-DIRECTORY DUMP VERSION     compares the headers with the dump of the last release
abi.py --update INCLUDE-DIRECTORY DUMP    writes the dump of a release

A dump has a line for each function, struct, enumeration, callback type and constant of the public headers: its name, and a
sum of its declaration without comments and white space. A binary or a program of the last release depends on these. New
names break nothing. A name that is gone or has another declaration needs another interface version (the SONAME), which is
MAJOR.MINOR before 1.0 and MAJOR after it.
"""
import hashlib
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note


def version_of(text):
    return re.search(r'#define KT_VERSION "(.*)"', text)[1]


def interface_of(version):
    major, minor, *_ = version.split(".")
    return f"{major}.{minor}" if major == "0" else major


def declarations(include):
    """Name and text of everything that a program can depend on."""
    found = {}
    for path in sorted((include / "kinetree").glob("*.h")):
        if path.name in ("kinetree.h", "compat.h"):
            continue
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
    return {name: hashlib.sha256(re.sub(r"\s+", "", body).encode()).hexdigest()[:12] for name, body in found.items()}


def read(dump):
    first, *lines = dump.read_text().splitlines()
    return first, dict(line.rsplit(" ", 1) for line in lines)


def broken(now, then):
    return [f"{name} is gone" if name not in now else f"{name} has changed"
            for name in sorted(then) if now.get(name) != then[name]]


def problems(version, released, changes):
    if interface_of(version) != interface_of(released) or not changes:
        return []
    return [f"{version} has the interface version {interface_of(released)} of {released}: raise the version"] + changes


def main():
    if sys.argv[1] == "--update":
        include, dump = pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
        version = version_of((include / "kinetree/status.h").read_text())
        dump.write_text("\n".join([version] + [f"{name} {body}" for name, body in sorted(declarations(include).items())]) + "\n")
        return
    include, dump, version = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    now = declarations(include)
    released, then = read(dump)
    changes = broken(now, then)
    note(f"{len(now)} declarations; since {released}: {len(changes)} changed or gone, {len(now.keys() - then.keys())} new")
    claim("headers_have_declarations", [] if len(now) > 500 and len(then) > 500 else [f"{len(now)}, {len(then)}"])
    claim("interface_changes_with_the_version_alone", problems(version, released, changes))
    struct = next(name for name in then if name.startswith("struct "))
    without = {name: body for name, body in then.items() if name != struct}
    claim("a_struct_that_is_gone_or_changed_is_noticed",
          [] if problems(released, released, broken(without, then)) and
          problems(released, released, broken({**then, struct: "other"}, then)) and
          not problems(released, released, broken({**then, "struct new": "other"}, then)) else ["it is not"])
    finish()


main()
