"""What is installed is complete: a program finds it by pkg-config or CMake alone, and runs, linked either way.

install.py BUILD-DIRECTORY HAS-MODULE HAS-SCENE HAS-COMMAND HAS-DOCS C-COMPILER...
"""
import os
import pathlib
import shlex
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish

PROGRAM = """
#include <kinetree/kinetree.h>
#include <stdio.h>
int main(void) { return puts(kt_version()) < 0; }
"""


def run(*command, environment=None):
    return subprocess.run([str(part) for part in command], capture_output=True, text=True, env=environment)


def build_and_run(compiler, folder, package, pkg_environment, libdir, static):
    """Problems; the libraries named by pkg-config make the program, and it prints the version."""
    flags = run("pkg-config", "--cflags", "--libs", *(["--static"] if static else []), package, environment=pkg_environment)
    if flags.returncode != 0:
        return flags.stderr.splitlines()
    names = ("kinetree-scene", "kinetree")
    words = [f"-l:lib{word[2:]}.a" if static and word[2:] in names else word for word in shlex.split(flags.stdout)]
    source, program = folder / "program.c", folder / "program"
    source.write_text(PROGRAM)
    made = run(*compiler, source, "-o", program, *words)
    if made.returncode != 0:
        return [" ".join(words)] + made.stderr.splitlines()
    ran = run(program, environment={**os.environ, "LD_LIBRARY_PATH": "" if static else str(libdir)})
    version = run("pkg-config", "--modversion", package, environment=pkg_environment).stdout
    return [] if ran.returncode == 0 and ran.stdout == version else [f"prints {ran.stdout!r}, not {version!r}", ran.stderr]


CMAKE = """
cmake_minimum_required(VERSION 3.16)
project(stranger C)
find_package(kinetree 0.1 REQUIRED COMPONENTS {targets})
add_executable(program program.c)
target_link_libraries(program kinetree::{target})
"""


def build_with_cmake(folder, root, target, libdir):
    """Problems; a project of somebody else finds the installed package, and its program prints the version."""
    project = folder / f"cmake-{target}"
    project.mkdir()
    (project / "program.c").write_text(PROGRAM)
    (project / "CMakeLists.txt").write_text(CMAKE.format(target=target, targets=target))
    prefix = next(path for path in root.rglob("lib*") if (path / "cmake" / "kinetree").is_dir()).parent
    for command in (["cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={prefix}"],
                    ["cmake", "--build", project / "build"]):
        made = run(*command)
        if made.returncode != 0:
            return (made.stdout + made.stderr).splitlines()
    ran = run(project / "build" / "program", environment={**os.environ, "LD_LIBRARY_PATH": str(libdir)})
    return [] if ran.returncode == 0 and ran.stdout.strip() else [f"prints {ran.stdout!r}", ran.stderr]


def main():
    build, has_module, has_scene, has_command, has_docs, *compiler = sys.argv[1:]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        root = folder / "root"
        made = run("meson", "install", "-C", build, "--no-rebuild", "--destdir", root)
        claim("installs", [] if made.returncode == 0 else (made.stdout + made.stderr).splitlines())

        found = {path.relative_to(root).as_posix() for path in root.rglob("*")}
        wanted = ["/include/kinetree/kinetree.h", "/libkinetree.so", "/libkinetree.so.0", "/libkinetree.a", "/kinetree.pc", "/cmake/kinetree/kinetreeConfig.cmake"]
        wanted += ["/libkinetree-lapack.so"] if has_module == "true" else []
        wanted += ["/libkinetree-scene.so", "/libkinetree-scene.a", "/kinetree-scene.pc"] if has_scene == "true" else []
        wanted += ["/bin/kinetree"] if has_command == "true" else []
        wanted += ["/share/doc/kinetree/html/index.html"] if has_docs == "true" else []
        claim("installs_every_part", [f"no {part}" for part in wanted if not any(path.endswith(part) for path in found)])
        claim("installs_nothing_private",
              [path for path in found if path.endswith((".c", "meson.build")) or path.count("kernels")])

        pc = next(root.rglob("kinetree.pc"), None)
        if pc:
            environment = {**os.environ, "PKG_CONFIG_LIBDIR": f"{pc.parent}:" + run(
                "pkg-config", "--variable=pc_path", "pkg-config").stdout.strip()}
            # The prefix as seen from here: the packages found on the system keep theirs.
            text = pc.read_text()
            for path in pc.parent.glob("kinetree*.pc"):
                text = path.read_text()
                prefix = next(line[7:] for line in text.splitlines() if line.startswith("prefix="))
                path.write_text(text.replace(f"prefix={prefix}", f"prefix={root}{prefix}", 1))
            for package in ["kinetree"] + (["kinetree-scene"] if has_scene == "true" else []):
                for static in (False, True):
                    claim(f"program_links_{package.replace('-', '_')}_{'statically' if static else 'shared'}",
                          build_and_run(compiler, folder, package, environment, pc.parent.parent, static))
            if shutil.which("cmake"):
                for target in ["kinetree", "static"] + (["scene", "scene-static"] if has_scene == "true" else []):
                    claim(f"cmake_finds_{target.replace('-', '_')}", build_with_cmake(folder, root, target, pc.parent.parent))
                claim("cmake_refuses_what_is_not_there",
                      [] if build_with_cmake(folder, root, "moon", pc.parent.parent) else ["it found kinetree::moon"])
    finish()


main()
