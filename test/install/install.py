"""What is installed is complete: a program finds it by pkg-config or CMake alone, and runs, linked either way.

install.py BUILD-DIRECTORY HAS-MODULE HAS-SCENE HAS-COMMAND HAS-REFERENCE HAS-DOCS C-COMPILER...
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, skip

# Reaches what each library needs of others: LAPACK, a reader of YAML, one of XML.
PROGRAM = """
#include <kinetree/experimental.h>
#include <kinetree/kinetree.h>
#include <stdio.h>
typedef void call(void);
int main(void) {{
    call *const reached[] = {{{calls}}};
    return reached[0] == NULL || puts(kt_version()) < 0;
}}
"""
REACHED = {"study": ["kt_modes_evaluate", "kt_constraint_formulation_create"], "scene": ["kt_modes_evaluate", "kt_robot_read", "kt_scene_read"]}


def program_of(package):
    part = next((name for name in REACHED if name in package), "")
    return PROGRAM.format(calls=", ".join(f"(call *){name}" for name in REACHED.get(part, ["kt_modes_evaluate"])))


def run(*command, environment=None):
    return subprocess.run([str(part) for part in command], capture_output=True, text=True, env=environment)


def build_and_run(compiler, folder, package, pkg_environment, libdir, static, whole=False):
    """Problems; the libraries named by pkg-config make the program, and it prints the version. whole: nothing is loaded at run time."""
    flags = run("pkg-config", "--cflags", "--libs", *(["--static"] if static else []), package, environment=pkg_environment)
    if flags.returncode != 0:
        return flags.stderr.splitlines()
    names = ("kinetree-scene", "kinetree-study", "kinetree")
    words = [f"-l:lib{word[2:]}.a" if static and word[2:] in names else word for word in shlex.split(flags.stdout)]
    words += ["-static"] if whole else []
    source, program = folder / "program.c", folder / "program"
    source.write_text(program_of(package))
    made = run(*compiler, source, "-o", program, *words)
    if made.returncode != 0:
        return [" ".join(words)] + made.stderr.splitlines()
    ran = run(program, environment={**os.environ, "LD_LIBRARY_PATH": "" if static else str(libdir)})
    version = run("pkg-config", "--modversion", package, environment=pkg_environment).stdout
    return [] if ran.returncode == 0 and ran.stdout == version else [f"prints {ran.stdout!r}, not {version!r}", ran.stderr]


def demo(root):
    """Problems; all scenes but one are taken away, so that those listed are not the source tree's."""
    scenes = sorted(root.rglob("share/kinetree/scenes/*.yaml"))
    for path in scenes[1:]:
        path.rename(path.with_suffix(".away"))
    environment = {name: value for name, value in os.environ.items() if name not in ("LD_LIBRARY_PATH", "KINETREE_SCENES")}
    ran = run(next(root.rglob("bin/kinetree")), "demo", environment=environment)
    for path in scenes[1:]:
        path.with_suffix(".away").rename(path)
    listed = [line.split()[0] for line in ran.stdout.splitlines()]
    if next(root.rglob("libkinetree-hdf5.so"), None):
        written = run(next(root.rglob("bin/kinetree")), "run", scenes[0], "--duration", "0.01", "--quiet", "--out", root / "records.h5", environment=environment)
        if written.returncode != 0 or not (root / "records.h5").is_file():
            return written.stderr.splitlines() or ["no HDF5"]
    return [] if len(scenes) > 1 and listed == [scenes[0].stem] else [f"status {ran.returncode}, lists {listed}"] + ran.stderr.splitlines()


CMAKE = """
cmake_minimum_required(VERSION 3.16)
project(stranger C)
find_package(kinetree 0.2 REQUIRED COMPONENTS {target})
add_executable(program program.c)
target_link_libraries(program kinetree::{target})
"""

# The requested version, and whether 0.2.0 satisfies the request. A range needs CMake 3.19; 0.2...<0.3 is no range to an older one.
VERSIONS = [("", True), ("0.2", True), ("0.2.0", True), ("0.2.0 EXACT", True), ("0.2.0...0.4", True), ("0.1...<0.3", True), ("0.1...0.2.0", True),
            ("0", False), ("0.1", False), ("0.1.0", False), ("0.2.1", False), ("0.3", False), ("1.2", False), ("0.2.1 EXACT", False),
            ("0.2.1...0.4", False), ("0.1...<0.2.0", False)]

CMAKE_VERSIONS = """
cmake_minimum_required(VERSION 3.19)
project(asker C)
foreach(asked IN ITEMS {asked})
  string(REPLACE " " ";" words "${{asked}}")
  unset(kinetree_DIR CACHE)
  find_package(kinetree ${{words}} QUIET)
  message(STATUS "asked=${{asked}} found=${{kinetree_FOUND}} version=${{kinetree_VERSION}}")
endforeach()
set(CMAKE_SIZEOF_VOID_P 4)
unset(kinetree_DIR CACHE)
find_package(kinetree QUIET)
message(STATUS "asked=other pointers found=${{kinetree_FOUND}} version=${{kinetree_VERSION}}")
"""


def configure(project, prefix):
    return run("cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={prefix}")


def versions_by_cmake(folder, prefix):
    """Problems; the package is found by the versions that it satisfies, and by no other, nor by other sizes of pointers."""
    project = folder / "cmake-versions"
    project.mkdir()
    asked = " ".join(f'"{version}"' for version, _ in VERSIONS)
    (project / "CMakeLists.txt").write_text(CMAKE_VERSIONS.format(asked=asked))
    made = configure(project, prefix)
    said = dict(re.findall(r"asked=(.*) found=(\d)", made.stdout))
    wanted = {version: str(int(good)) for version, good in VERSIONS} | {"other pointers": "0"}
    return [f"version {version!r}: found is {said.get(version)}, not {good}" for version, good in wanted.items()
            if said.get(version) != good] + (made.stderr.splitlines() if made.returncode else [])


def build_with_cmake(folder, prefix, target, libdir, whole=False):
    """Problems; a project of somebody else finds the installed package, and its program prints the version."""
    project = folder / f"cmake-{target}{'-whole' if whole else ''}"
    project.mkdir()
    (project / "program.c").write_text(program_of(target))
    (project / "CMakeLists.txt").write_text(CMAKE.format(target=target) + ("target_link_options(program PRIVATE -static)\n" if whole else ""))
    for made in (configure(project, prefix), run("cmake", "--build", project / "build")):
        if made.returncode != 0:
            return (made.stdout + made.stderr).splitlines()
    ran = run(project / "build" / "program", environment={**os.environ, "LD_LIBRARY_PATH": str(libdir)})
    return [] if ran.returncode == 0 and ran.stdout.strip() else [f"prints {ran.stdout!r}", ran.stderr]


def why_not_whole(compiler, folder):
    """Why no program can be linked with -static on this machine; "": it can."""
    source = folder / "empty.c"
    source.write_text("#include <math.h>\nint main(int n, char **words) { return words[0] ? (int)sin(n) : 1; }\n")
    made = run(*compiler, "-static", source, "-o", folder / "empty", "-lm")
    return made.stderr.strip()


def main():
    build, has_module, has_scene, has_command, has_reference, has_docs, *compiler = sys.argv[1:]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        root = folder / "root"
        made = run("meson", "install", "-C", build, "--no-rebuild", "--destdir", root)
        claim("installs", [] if made.returncode == 0 else (made.stdout + made.stderr).splitlines())

        found = {path.relative_to(root).as_posix() for path in root.rglob("*")}
        header = next(root.rglob("include/kinetree/status.h")).read_text()
        interface = re.search(r'KT_VERSION "(0\.\d+|[1-9]\d*)', header)[1]  # the SONAME
        wanted = ["/include/kinetree/kinetree.h", "/include/kinetree/experimental.h", "/libkinetree.so", f"/libkinetree.so.{interface}", "/libkinetree.a", "/kinetree.pc", "/cmake/kinetree/kinetreeConfig.cmake"]
        wanted += ["/libkinetree-study.so", "/libkinetree-study.a", "/kinetree-study.pc"]
        wanted += ["/libkinetree-lapack.so"] if has_module == "true" else []
        wanted += ["/libkinetree-scene.so", "/libkinetree-scene.a", "/kinetree-scene.pc"] if has_scene == "true" else []
        wanted += ["/bin/kinetree"] if has_command == "true" else []
        if has_command == "true" and has_reference == "true":
            made = run(pathlib.Path(build) / "apps/kinetree/kinetree", "help").stdout.partition("\nUsage:")[2].partition("\nExit")[0]
            subcommands = re.findall(r"^  (\w+) +\S", made, flags=re.M)
            claim("there_are_subcommands", [] if "run" in subcommands else subcommands)
            wanted += [f"/share/man/man1/{page}.1" for page in ["kinetree", *(f"kinetree-{name}" for name in subcommands)]]
            wanted += ["/share/bash-completion/completions/kinetree.bash", "/share/zsh/site-functions/_kinetree",
                       "/share/fish/vendor_completions.d/kinetree.fish"]
        source = "/lib/kinetree/kinetree-fmu.c"  # of FMUs with --sources
        wanted += ["/share/doc/kinetree/html/index.html"] if has_docs == "true" else []
        claim("installs_every_part", [f"no {part}" for part in wanted if not any(path.endswith(part) for path in found)])
        claim("installs_nothing_private",
              [path for path in found if path.endswith((".c", "meson.build")) and not path.endswith(source) or path.count("kernels")])

        if has_command == "true":
            claim("installed_command_runs_where_it_lies_with_the_scenes_beside_it", demo(root))

        no_whole = why_not_whole(compiler, folder)
        pc = next(root.rglob("kinetree.pc"), None)
        if pc:
            environment = {**os.environ, "PKG_CONFIG_LIBDIR": f"{pc.parent}:" + run(
                "pkg-config", "--variable=pc_path", "pkg-config").stdout.strip()}
            # The prefix as seen from here: the packages found on the system keep theirs.
            prefix = re.search(r"^prefix=(.*)$", pc.read_text(), re.M)[1]
            for path in pc.parent.glob("kinetree*.pc"):
                path.write_text(path.read_text().replace(f"prefix={prefix}", f"prefix={root}{prefix}", 1))
            prefix = f"{root}{prefix}"
            for package in ["kinetree", "kinetree-study"] + (["kinetree-scene"] if has_scene == "true" else []):
                for static in (False, True):
                    claim(f"program_links_{package.replace('-', '_')}_{'statically' if static else 'shared'}",
                          build_and_run(compiler, folder, package, environment, pc.parent.parent, static))
                if no_whole:
                    skip(f"program_links_{package.replace('-', '_')}_wholly", no_whole)
                else:
                    claim(f"program_links_{package.replace('-', '_')}_wholly",
                          build_and_run(compiler, folder, package, environment, pc.parent.parent, True, True))
        # Before an installation, by the files that a build directory has for this.
        before = pathlib.Path(build) / "meson-uninstalled"
        if before.is_dir():
            own = {**os.environ, "PKG_CONFIG_PATH": str(before)}
            for package in ["kinetree", "kinetree-study"] + (["kinetree-scene"] if has_scene == "true" else []):
                claim(f"program_links_{package.replace('-', '_')}_that_is_not_installed",
                      build_and_run(compiler, folder, package, own, pathlib.Path(build) / "lib", False))
        if pc and shutil.which("cmake"):
            libdir = pc.parent.parent
            for target in ["kinetree", "static", "study", "study-static"] + (["scene", "scene-static"] if has_scene == "true" else []):
                claim(f"cmake_finds_{target.replace('-', '_')}", build_with_cmake(folder, prefix, target, libdir))
                if "static" in target and not no_whole:
                    claim(f"cmake_links_{target.replace('-', '_')}_wholly", build_with_cmake(folder, prefix, target, libdir, True))
            claim("cmake_rejects_what_is_not_there",
                  [] if build_with_cmake(folder, prefix, "moon", libdir) else ["it found kinetree::moon"])
            claim("cmake_finds_the_versions_that_it_satisfies", versions_by_cmake(folder, prefix))
        elif pc:
            skip("cmake_finds_the_package", "CMake is not on this machine")
    finish()


main()
