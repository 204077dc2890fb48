"""What README.md shows works as it stands.

readme.py README BUILD-ROOT INCLUDE-DIRECTORY COMMAND-OR-EMPTY C-COMPILER...

- a block of C that has a main is compiled against the shared library, and run;
- a block of YAML with a line "kinetree: 1" passes "kinetree check", and is there for the shell under the name that a
  comment of its own gives it ("# pendulum.yaml"), or as scene-1.yaml and so on;
- a line of a shell block that begins with "kinetree " is run, in the same folder, in the order of the page.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

WARNINGS = ["-std=c17", "-Wall", "-Wextra", "-Werror"]


def blocks(text):
    """(line, language, body) of each fenced block."""
    for found in re.finditer(r"^```(\w*)[^\n]*\n(.*?)^```\s*$", text, flags=re.S | re.M):
        yield text.count("\n", 0, found.start()) + 1, found[1], found[2]


def failure(command, folder, environment):
    try:
        run = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=60)
    except subprocess.TimeoutExpired:
        return ["takes more than a minute"]
    if run.returncode == 0:
        return []
    return [f"status {run.returncode}"] + (run.stdout + run.stderr).splitlines()[-20:]


class Page:
    def __init__(self, build, include, command, compiler, folder):
        self.include, self.compiler, self.folder, self.scenes = include, compiler, pathlib.Path(folder), 0
        self.libraries = build / "lib"
        self.command = command
        self.environment = {**os.environ, "LC_ALL": "C", "LD_LIBRARY_PATH": str(self.libraries)}
        if command:
            self.environment["PATH"] = f"{pathlib.Path(command).parent}:{os.environ['PATH']}"

    def c(self, line, body):
        if not re.search(r"\bint\s+main\b", body):
            return
        source, program = self.folder / f"line-{line}.c", self.folder / f"line-{line}"
        source.write_text(body)
        libraries = [f"-l{name}" for name in ("kinetree-scene", "kinetree")
                     if (self.libraries / f"lib{name}.so").exists()]
        problems = failure([*self.compiler, *WARNINGS, f"-I{self.include}", source, "-o", program,
                            f"-L{self.libraries}", *libraries, "-lm"], self.folder, self.environment)
        claim(f"C program at line {line} compiles", problems)
        if not problems:
            claim(f"C program at line {line} runs", failure([program], self.folder, self.environment))

    def yaml(self, line, body):
        if not re.search(r"^kinetree: 1\b", body, flags=re.M):
            return
        self.scenes += 1
        named = re.search(r"^#\s*([\w.-]+\.yaml)\s*$", body, flags=re.M)
        scene = self.folder / (named[1] if named else f"scene-{self.scenes}.yaml")
        scene.write_text(body)
        claim(f"scene at line {line} is right", failure([self.command, "check", scene.name], self.folder,
                                                        self.environment) if self.command else ["no command was built"])

    def sh(self, line, body):
        for offset, text in enumerate(body.splitlines(), 1):
            if text.startswith("kinetree "):
                claim(f"line {line + offset}: {text}",
                      failure(["bash", "-c", text], self.folder, self.environment) if self.command
                      else ["no command was built"])


def main():
    readme, build, include, command, *compiler = sys.argv[1:]
    found = list(blocks(pathlib.Path(readme).read_text()))
    note(f"{len(found)} blocks")
    claim("page has blocks", [] if found else ["none"])
    with tempfile.TemporaryDirectory() as folder:
        page = Page(pathlib.Path(build), include, command, compiler, folder)
        for line, language, body in found:
            handler = {"c": page.c, "yaml": page.yaml, "sh": page.sh}.get(language)
            if handler:
                handler(line, body)
    finish()


main()
