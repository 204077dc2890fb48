#!/usr/bin/env python3
"""What becomes of files of robots: a row of Markdown for each, of bodies, degrees of freedom, loops and notes.

    robots.py KINETREE FOLDER|PACKAGE.deb...      of a package of Debian what it contains (`apt-get download PACKAGE`)

Files that are no robots (other XML) are passed over, and in folders those called scene*, which stand another file's robot on a floor, and
those below `assets`, which are parts. A file that is rejected has the reason in place of numbers; the last line sums up.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import pathlib
import re
import subprocess
import sys
import tempfile

kinetree = sys.argv[1]
NOTE = "(?:^|[0-9]: | )(?:note|warning): "
ROOTS = {"robot": "URDF", "mujoco": "MJCF", "sdf": "SDF"}


def format_of(path):
    head = re.sub(rb"<\?.*?\?>|<!--.*?-->", b"", path.read_bytes()[:20000], flags=re.S)
    found = re.search(rb"<\s*([A-Za-z_]+)", head)
    return ROOTS.get(found[1].decode()) if found else None


def run(*words):
    return subprocess.run([kinetree, *words], capture_output=True, text=True, timeout=60)


def row(path, name):
    scene = run("import", path, "--verbose")
    notes = re.findall(NOTE + "(.*)", scene.stderr)
    if scene.returncode:
        first = next((line for line in scene.stderr.splitlines() if not re.search(NOTE, line)), "?")
        reason = re.sub(r"^.*?:[0-9]+:[0-9]+: ", "", first)
        return f"| {name} | {format_of(path)} | | | | rejected: {reason if len(reason) < 120 else reason[:117] + '...'} |", "rejected"
    bodies = len(re.findall(r"^  - name: ", scene.stdout.split("\nloops:")[0].split("\neffects:")[0], flags=re.M))
    loops = len(re.findall(r"^  - \{?name: ", scene.stdout.split("\nloops:")[1].split("\neffects:")[0], flags=re.M)) if "\nloops:" in scene.stdout else 0
    done = run("run", path, "--duration", "1e-4", "--out", "/dev/null", "--summary", "-")
    dofs = json.loads(done.stdout)["freedom"]["minimal"] if done.returncode == 0 else "-"
    kinds = "; ".join(sorted({kind for pattern, kind in KINDS for n in notes if re.search(pattern, n)}))
    return f"| {name} | {format_of(path)} | {bodies} | {dofs} | {loops} | {kinds} |", "run" if done.returncode == 0 else "read"


KINDS = [("meshes that are not found", "missing meshes"), ("far larger than the robot", "large collisions"), ("contacts", "contacts"), ("do not concern|not known here", "extensions"), ("smooth", "smooth friction"), ("that move freely|lets move freely", "free root"),
         ("fixed to the world", "fixed root"), ("impossible inertias", "odd inertias"), ("without a mass or an inertia", "standard masses"), ("no link has a mass", "no masses"),
         ("of their geoms|of their collisions", "masses by shapes"), ("close loops", "loops"), ("soft equal", "soft equalities"), ("a force or an eq|' is left out", "some forces"), ("freely has no ground|freely falls", "no ground"),
         ("keyframes", "keyframes"), ("limits of position", "limits"), ("nor on the search path", "missing files"), ("cannot be read", "missing files"),
         ("two axes|after the first|not at the origin", "joints on bodies of their own"), ("motors|servos", "controls"), ("transmissions", "transmissions")]


def files_of(argument, folder):
    path = pathlib.Path(argument)
    if path.suffix == ".deb":
        subprocess.run(["dpkg", "-x", path, folder], check=True)
        subprocess.run(["find", folder, "-name", "*.gz", "-exec", "gunzip", "-f", "{}", "+"], check=True)
        path = pathlib.Path(folder)
    return path, sorted(f for f in path.rglob("*") if f.is_file() and f.suffix in (".urdf", ".sdf", ".world", ".xml") and format_of(f))


def name_of(path, base, argument):
    """The file's name after that of its package, or of the folders that it is in."""
    return f"{pathlib.Path(argument).name.split('_')[0]}: {path.name}" if argument.endswith(".deb") else str(path.relative_to(base))


def main():
    counts = {}
    print("| file | format | bodies | degrees of freedom | loops | notes |\n|---|---|---|---|---|---|")
    for argument in sys.argv[2:]:
        with tempfile.TemporaryDirectory() as folder:
            base, files = files_of(argument, folder)
            if not argument.endswith(".deb"):
                files = [f for f in files if not f.name.startswith("scene") and "assets" not in f.parts]
            for path in files:
                text, result = row(path, name_of(path, base, argument))
                counts[result] = counts.get(result, 0) + 1
                print(text)
    print("\n" + ", ".join(f"{n} {k}" for k, n in sorted(counts.items())))


main()
