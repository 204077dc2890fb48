"""What README.md and the pages of the API show works as it stands, and so does what the headers show.

readme.py BUILD-ROOT SOURCE-ROOT COMMAND-OR-EMPTY C-COMPILER...

Of a page, in a folder of its own in which `apps` is that of the sources:
- a block of C that has a main is compiled against the shared library, and run; any other is compiled as the headers' are;
- a block of text after it is what it prints, to the last character;
- a block of YAML is a whole scene, with a line "kinetree: 1": it passes "kinetree check", and is there for the shell under
  the name that a comment of its own gives it ("# pendulum.yaml", in XML "<!-- arm.urdf -->" or .xml), or as scene-1.yaml and so on;
- so is a scene or a robot of a page that this one links to, if its name stands in the text, in backticks;
- a block of Python is run with the package of the build directory;
- a line of a shell block begins with "kinetree " and is run, in the order of the page; with "cc " it is for the reader;
- a fault "NAME.yaml:LINE:COLUMN: ... 'WRONG' ...; did you mean 'RIGHT'?" is what "kinetree check" reports if WRONG stands for
  RIGHT at that place of the page's scene NAME.yaml.

Of a header, the blocks of C in its comments are compiled together: what begins with "static" as it stands, all else as
the body of a function that is given what FRAGMENT names.
"""
# SPDX-License-Identifier: Apache-2.0
import functools
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "test"), str(ROOT / "test/house"), str(ROOT / "include/site")]
import document
from claims import claim, finish, note, skip
from folders import ROOMS

WRITTEN = {"kinetree.c", "kinetree-experimental.h"}  # by apps/amalgamate; pages name them
GENERATED = {"python-reference.md"}  # from docstrings, which test/python compares
WARNINGS = ["-std=c17", "-Wall", "-Wextra", "-Werror"]
HEAD = "#include <kinetree/experimental.h>\n#include <kinetree/kinetree.h>\n#include <stdio.h>\n#include <stdlib.h>\n#include <string.h>\n"
FRAGMENT = """
kt_status fragment_{line}(const kt_model *model, kt_data *data, kt_simulation *simulation, double *q, double *v, double *a,
                          double *tau, double *y, size_t n, kt_integrator_callbacks callbacks,
                          kt_description description, kt_run run, double (*cpu_seconds)(void *), kt_error error,
                          kt_status status);
kt_status fragment_{line}(const kt_model *model, kt_data *data, kt_simulation *simulation, double *q, double *v, double *a,
                          double *tau, double *y, size_t n, kt_integrator_callbacks callbacks,
                          kt_description description, kt_run run, double (*cpu_seconds)(void *), kt_error error,
                          kt_status status) {{
    {{
{body}
    }}
    return status;
}}
"""


def blocks(text):
    """(line, language, body) of each fenced block."""
    for found in re.finditer(r"^```([\w{}]*)[^\n]*\n(.*?)^```\s*$", text, flags=re.S | re.M):
        yield text.count("\n", 0, found.start()) + 1, found[1], found[2]


def header_blocks(text):
    """(line, body) of each block of C in the comments of a header."""
    for comment in re.finditer(r"/\*.*?\*/", text, flags=re.S):
        lines, i = document.content(comment[0]), 0
        while i < len(lines):
            end = document.verbatim(lines, i)
            if end > i and document.is_code(lines[i:end]):
                yield text.count("\n", 0, comment.start()) + 1 + i, "\n".join(line[4:] for line in lines[i:end]) + "\n"
            i = max(i + 1, end)


NAMED = re.compile(r"^(?:#|<!--)\s*([\w.-]+\.(?:yaml|urdf|xml|sdf))(?:\s*-->)?\s*$", flags=re.M)


def named_scenes(found):
    """{name: body} of the scenes of a page that name themselves."""
    return {named[1]: body for _, language, body in found if language in ("yaml", "xml") and (named := NAMED.search(body))}


def scenes_of_others(text, scenes):
    """(name, body) of the named scenes of linked pages whose names stand in the text, in backticks."""
    for linked in re.findall(r"\]\(([\w-]+\.md)", text):
        yield from ((name, body) for name, body in scenes.get(linked, {}).items() if f"`{name}`" in text)


FAULT = re.compile(r"^    (([\w.-]+\.yaml):(\d+):(\d+): .*'([\w.-]+)'[^']*; did you mean '([\w.-]+)'\?)$", flags=re.M)


def failure(command, folder, environment, printed=None):
    """What is wrong with a command; what it prints is added to the list `printed`."""
    try:
        run = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=600)
    except subprocess.TimeoutExpired:
        return ["takes more than a minute"]
    if printed is not None:
        printed.append(run.stdout)
    if run.returncode == 0:
        return []
    return [f"status {run.returncode}"] + (run.stdout + run.stderr).splitlines()[-20:]


@functools.lru_cache(None)
def python_with_package(folder):
    """The first Python that imports the package of a build directory; None: there is none."""
    environment = {**os.environ, "PYTHONPATH": folder}
    for name in (sys.executable, "/usr/bin/python3"):
        if subprocess.run([name, "-c", "import kinetree; kinetree.ffi"], env=environment, capture_output=True).returncode == 0:
            return name
    return None


OPTIONAL = ["scipy", "pandas", "matplotlib"]


@functools.lru_cache(None)
def has_module(interpreter, name):
    return subprocess.run([interpreter, "-c", f"import {name}"], capture_output=True).returncode == 0


class Page:
    def __init__(self, name, build, include, command, compiler, folder):
        self.name, self.include, self.compiler, self.folder = name, include, compiler, pathlib.Path(folder)
        self.scenes, self.fragments, self.printed = 0, [], []
        self.libraries = build / "lib"
        self.command = command
        self.environment = {**os.environ, "LC_ALL": "C", "LD_LIBRARY_PATH": str(self.libraries)}
        self.environment.update(PYTHONPATH=str(build / "apps/python"), KINETREE_COMMAND=str(command), PYTHONDONTWRITEBYTECODE="1", MALLOC_PERTURB_="")
        if command:
            self.environment["PATH"] = f"{pathlib.Path(command).parent}:{os.environ['PATH']}"

    def fail(self, *command, printed=None):
        return failure(command, self.folder, self.environment, printed)

    def c(self, line, body):
        if not re.search(r"\bint\s+main\b", body):
            self.fragments.append((line, body))
            return
        source, program = self.folder / f"line-{line}.c", self.folder / f"line-{line}"
        source.write_text(body)
        libraries = [f"-l{name}" for name in ("kinetree-scene", "kinetree")
                     if (self.libraries / f"lib{name}.so").exists()]
        one_file = [f"-I{self.include}/kinetree"] if '#include "kinetree.h"' in body else []  # as apps/amalgamate names it
        problems = self.fail(*self.compiler, *WARNINGS, f"-I{self.include}", *one_file, source, "-o", program,
                             f"-L{self.libraries}", *libraries, "-lm")
        claim(f"{self.name}:{line}: C program compiles", problems)
        if not problems:
            claim(f"{self.name}:{line}: C program runs", self.fail(program, printed=self.printed))

    def python(self, line, body):
        interpreter = python_with_package(self.environment.get("PYTHONPATH", ""))
        if interpreter is None:
            skip(f"{self.name}:{line}: Python", "no Python on this machine has the package")
            self.printed.append(None)
            return
        missing = [name for name in OPTIONAL if re.search(rf"^(?:import|from) {name}\b", body, flags=re.M) and not has_module(interpreter, name)]
        if missing:
            skip(f"{self.name}:{line}: Python", f"this Python has no {missing[0]}")
            self.printed.append(None)
            return
        script = self.folder / f"line-{line}.py"
        script.write_text(body)
        claim(f"{self.name}:{line}: Python runs", self.fail(interpreter, script.name, printed=self.printed))

    def text(self, line, body):
        seen = self.printed.pop() if self.printed else "no program\n"
        if seen is None:  # it was skipped
            return
        claim(f"{self.name}:{line}: the program prints it", [] if seen == body else ["it prints:", *seen.splitlines()])

    def compile_fragments(self):
        """All together; none is run."""
        if not self.fragments:
            return
        whole = [body if body.startswith("static ") else FRAGMENT.format(line=line, body=body)
                 for line, body in sorted(self.fragments, key=lambda block: not block[1].startswith("static "))]
        source = self.folder / "fragments.c"
        source.write_text(HEAD + "\n".join(whole))
        lines = ", ".join(str(line) for line, _ in self.fragments)
        claim(f"{self.name}:{lines}: C compiles",
              self.fail(*self.compiler, *WARNINGS, "-Wno-unused-parameter", "-Wno-unused-but-set-parameter",
                        "-fsyntax-only", f"-I{self.include}", source))

    def scene(self, line, body):
        self.scenes += 1
        named = NAMED.search(body)
        scene = self.folder / (named[1] if named else f"scene-{self.scenes}.yaml")
        scene.write_text(body)
        claim(f"{self.name}:{line}: scene is right",
              self.fail(self.command, "check", scene.name) if self.command else ["no command was built"])

    def has_browser_engine(self):
        return self.command is not None and (pathlib.Path(self.command).parents[1] / "browser/kinetree.wasm.gz").exists()

    def sh(self, line, body):
        for offset, text in enumerate(body.splitlines(), 1):
            if "--live" in text and not self.has_browser_engine():
                skip(f"{self.name}:{line + offset}: {text}", "the engine for browsers was not built (-Dbrowser=enabled)")
            elif text.startswith("kinetree "):
                claim(f"{self.name}:{line + offset}: {text}",
                      self.fail("bash", "-c", text) if self.command else ["no command was built"])
            elif not text.startswith("cc "):
                claim(f"{self.name}:{line + offset}: {text}", ["a line that nothing tests"])

    def faults(self, text, scenes):
        for shown, name, line, column, wrong, right in FAULT.findall(text):
            if name not in scenes:
                continue
            lines = scenes[name].splitlines()
            there = lines[int(line) - 1][int(column) - 1:] if int(line) <= len(lines) else ""
            if not there.startswith(right):
                claim(f"{self.name}: {shown}", [f"the scene has '{there}' there"])
                continue
            lines[int(line) - 1] = lines[int(line) - 1][:int(column) - 1] + wrong + there[len(right):]
            (self.folder / name).write_text("\n".join(lines) + "\n")
            seen = subprocess.run([self.command, "check", name], cwd=self.folder, env=self.environment, capture_output=True, text=True)
            claim(f"{self.name}: {shown}", [] if shown in seen.stderr.splitlines() + seen.stdout.splitlines() else [seen.stderr])

    def take(self, found):
        for line, language, body in found:
            if language.startswith("{"):  # words of the site, such as {admonition}
                continue
            handler = {"c": self.c, "text": self.text, "yaml": self.scene, "xml": self.scene, "sh": self.sh, "python": self.python}.get(language)
            if handler:
                handler(line, body)
            else:
                claim(f"{self.name}:{line}: block", [f"of a kind that nothing tests: '{language}'"])
        self.compile_fragments()


def benchmarks(root, pages):
    """Benchmarks that pages name and that there are not."""
    there = set(re.search(r'^names="(.*)"', (root / "bench/run").read_text(), flags=re.M)[1].split())
    return [f"{page.name}: {name}" for page in pages
            for name in re.findall(r"bench/run ([a-z]+)", page.read_text()) if name not in there]


def sources_named(root, pages):
    """Names and files of the sources that pages tell of, and that there are not: each word in backticks which is a path below the
    root, NAME.c or NAME.h, or begins with kt_; capitals stand for what a reader puts in."""
    files = [path.relative_to(root).as_posix() for folder in ("lib", "include", "apps", "test", "bench", ".ci")
             for path in (root / folder).rglob("*")]
    words = set(re.findall(r"\w+", "\n".join((root / name).read_text() for name in files if name.endswith((".c", ".h")))))
    for page in pages:
        text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.S | re.M)
        for quoted in re.findall(r"`([^`\n]+)`", text):
            word = quoted.split()[0].rstrip("/")
            if re.search(r"(?<![A-Z])(NAME|FOLDER|FILE|TARGET|RELEASE)(?![A-Z])|[*<>$]", word):
                continue
            if re.match(r"(lib|include|apps|test|bench|\.ci)/", word):
                if word not in files:
                    yield f"{page.name}: {word} is not there"
            elif re.fullmatch(r"[\w-]+\.[ch]", word):
                if word not in WRITTEN and not any(name.endswith(f"/{word}") for name in files):
                    yield f"{page.name}: there is no file {word}"
            elif re.fullmatch(r"(?:kt|KT)_\w+(?:\.\w+)?(?:\(\))?", word):
                if not set(re.findall(r"\w+", word)) <= words:
                    yield f"{page.name}: there is no {word}"


def main():
    build, root, command, *compiler = sys.argv[1:]
    root = pathlib.Path(root)
    pages = [root / "README.md", *sorted((root / "include/pages").glob("*.md"))]
    sources = [(page, list(blocks(page.read_text()))) for page in pages]
    sources += [(header, [(line, "c", body) for line, body in header_blocks(header.read_text())])
                for header in sorted((root / "include/kinetree").glob("*.h"))]
    note(f"{sum(len(found) for _, found in sources)} blocks")
    claim("page has blocks", [] if sources[0][1] else ["none"])
    claim("headers have blocks", [] if any(found for path, found in sources if path.suffix == ".h") else ["none"])
    scenes = {path.name: named_scenes(found) for path, found in sources}
    for path, found in sources:
        if path.name in GENERATED:
            continue
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "apps").symlink_to(root / "apps")
            for name, body in scenes_of_others(path.read_text(), scenes):
                (pathlib.Path(folder) / name).write_text(body)
            page = Page(path.name, pathlib.Path(build), root / "include", command, compiler, folder)
            page.take(found)
            if command and path.suffix == ".md":
                page.faults(path.read_text(), scenes[path.name])
    asked = {word: subprocess.run([root / "apps/quickstart", word], capture_output=True, text=True, timeout=60) for word in ("--help", "--hepl")}
    claim("quickstart answers to options and builds nothing then",
          [done.stdout + done.stderr for word, done in asked.items()
           if "[BUILD-DIRECTORY]" not in done.stdout or (done.returncode == 0) != (word == "--help")])
    inputs = subprocess.run(["ninja", "-C", build, "-t", "query", "command"], capture_output=True, text=True).stdout.split()
    claim("quickstart builds all files that the command copies",
          [name for name in ("kinetree-fmu.so", "kinetree-fmu.c") if command and (pathlib.Path(build) / "apps/fmu").is_dir() and
           not any(path.endswith(f"apps/fmu/{name}") for path in inputs)] +
          ([] if '"$build" command' in (root / "apps/quickstart").read_text() else ["it builds another target"]))
    claim("benchmarks that pages name are there", benchmarks(root, pages))
    claim("names and files of the sources that pages tell of are there", list(sources_named(root, pages)))
    table = (root / "include/pages/c-interface.md").read_text()
    claim("the table of c-interface.md has every header", [path.name for path in sorted((root / "include/kinetree").glob("*.h"))
                                                        if path.name != "kinetree.h" and f"`{path.name}`" not in table])
    table = (root / "include/pages/architecture.md").read_text().partition("| storey | room | content |")[2].partition("\n\n")[0]
    listed = [room for row in table.splitlines()[2:] for room in re.findall(r"`(\w+)`", row.split("|")[2])]
    claim("architecture.md lists the rooms of lib in their order", [] if listed == ROOMS else [" ".join(listed), " ".join(ROOMS)])
    finish()


main()
