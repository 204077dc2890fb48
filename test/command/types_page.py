"""The page of all types, which the command makes of the descriptors: each of its scenes is right and runs, and its pictures are there.

types_page.py COMMAND PAGES
"""
# SPDX-License-Identifier: Apache-2.0
import concurrent.futures
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

COMMAND, PAGES = sys.argv[1], pathlib.Path(sys.argv[2])


def kinetree(*words, status=0):
    """Standard output where the command ends as it should; standard error where it should fail."""
    run = subprocess.run([COMMAND, *words], capture_output=True, text=True)
    if run.returncode != status:
        return None
    return run.stderr if status else run.stdout


def trouble(folder, name, text):
    """What is wrong with a scene: its check doubts it, or its run does not give a line for each record."""
    path = pathlib.Path(folder) / f"{name}.yaml"
    path.write_text(text)
    check = subprocess.run([COMMAND, "check", path], capture_output=True, text=True)
    run = subprocess.run([COMMAND, "run", path, "--out", "-", "--duration", "0.05", "--interval", "0.01"], capture_output=True, text=True)
    records = len(run.stdout.splitlines()) - 1
    found = [f"check: {line}" for line in check.stderr.splitlines() if "warning" in line or check.returncode]
    return found + ([f"run: {run.stderr or records}"] if run.returncode or records != 6 else [])


def main():
    made = kinetree("help", "--types") or ""
    claim("page_is_made_when_the_site_is_built", [f"{path} is stored" for path in PAGES.glob("types.md")])

    sections = re.findall(r"^### (\w+): (\w+)\n(.*?)^((?:    [^\n]*\n)+)\n.*?^```yaml\n(.*?)^```$", made, flags=re.M | re.S)
    note(f"{len(sections)} types")
    claim("types_are_there", [] if len(sections) > 40 else [f"{len(sections)}"])
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(2) as pool:
        found = pool.map(lambda s: trouble(folder, f"{s[0]}-{s[1]}", s[4]), sections)
        for (noun, name, *_), wrong in zip(sections, found):
            claim(f"scene_is_right_and_runs: {noun} {name}", wrong)
    alone = {("function", "constant"): r"torque: [\d.]+}", ("function", "expression"): r'torque: "[^"]+"}'}  # without the type's name
    claim("scene_shows_its_type", [f"{noun} {name}" for noun, name, _, _, scene in sections
                                   if not re.search(alone.get((noun, name), rf"\b{name}\b"), scene.partition("bodies:")[2])])

    shown = {name for text in (made, *(one.read_text() for one in PAGES.glob("*.md")))
             for name in re.findall(r"\(pictures/([\w-]+\.svg)\)", text)}
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, PAGES / "draw.py", folder], check=True)
        drawn = {path.name: path.read_text() for path in pathlib.Path(folder).iterdir()}
    stored = {path.name: path.read_text() for path in (PAGES / "pictures").iterdir()}
    claim("joints_loops_and_effects_have_pictures",
          [f"{noun} {name}" for noun, name, *_ in sections if noun in ("joint", "loop", "effect") and f"{noun}-{name}.svg" not in shown])
    claim("pictures_are_what_draw_py_makes",
          sorted(name for name in {*drawn, *stored, *shown} if not drawn.get(name) == stored.get(name) or name not in shown))

    helps = {name: kinetree("help", name) or "" for name in {name for _, name, *_ in sections}}
    flat = {name: re.sub(r"\s+", " ", text) for name, text in helps.items()}
    claim("help_of_a_type_has_its_formula", [f"{noun} {name}" for noun, name, _, formula, _ in sections
                                             if f"{noun} {name}: " not in flat[name] or re.sub(r"\s+", " ", formula).strip() not in flat[name]])
    said = kinetree("help", "revolut", status=1) or ""
    claim("misspelt_type_is_told", [] if "did you mean 'revolute'?" in said else [said])
    said = kinetree("help", "--types", "revolute", status=1) or ""
    claim("all_types_take_no_name", [] if "takes neither a name nor another option" in said else [said])
    finish()


main()
