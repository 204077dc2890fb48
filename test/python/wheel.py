"""`pip install .` works in a new environment without a network: wheel.py SOURCE-ROOT BUILD-ROOT.

All temporary files are beside the build directory, and the package is compiled as that directory is. Paths from there to the sources are
then the same, and ccache has the objects, which take nine tenths of the time.
"""
# SPDX-License-Identifier: Apache-2.0
import json
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

PROGRAM = """
import kinetree as kt
scene = kt.mechanism([kt.Body("rod", joint=kt.revolute("y", position=0.5), mass=1, shape=kt.rod(to=[1, 0, 0]))], gravity=[0, 0, -9.81])
run = scene.run(duration=0.1)
simulation = scene.simulation(duration=0.1)
simulation.advance(0.1)
print(kt.__version__, len(run) > 10 and abs(run["position.rod"][-1] - simulation.positions[0]) < 1e-9)
"""

# What an installation can break: the module, the command and its scenes. python/package has the same sources, and runs all tests.
SAMPLE = ("reachable or bits_of_the_command or has_a_line_for_each or equal_bits or example_of_the_specification or bits_of_single_calls"
          " or closed_form or layout or data_cannot_be_moved")


def words(*command, **options):
    run = subprocess.run([str(part) for part in command], capture_output=True, text=True, **options)
    return [] if run.returncode == 0 else [f"status {run.returncode}", *(run.stdout + run.stderr).splitlines()[-20:]], run.stdout


def settings(build):
    """Those of the build directory. Without ccache, half of the time is that of levels of the instruction set and of the optimiser."""
    options = {"levels": "baseline", "optimization": "0"}
    if shutil.which("ccache"):
        with open(pathlib.Path(build) / "meson-info/intro-buildoptions.json", encoding="utf-8") as file:
            known = {option["name"]: option["value"] for option in json.load(file)}
        options = {name: known[name] for name in ("levels", "optimization", "c_args", "werror")}
    return shlex.join(f"-D{name}={','.join(value) if isinstance(value, list) else str(value).lower()}" for name, value in options.items())


def broken(folder):
    """What the metadata of the installed package lack."""
    [info] = folder.glob("venv/lib/python*/site-packages/kinetree-*.dist-info")
    text = (info / "METADATA").read_text()
    return [*([] if "License-File: LICENSE" in text and (info / "licenses/LICENSE").exists() else ["no licence"]),
            *re.findall(r"\]\((?!https?:|#)[^)]*\)|<img [^>]*src=\"(?!http)[^>]*", text)]


def left(folder):
    """The files and folders that an uninstallation leaves."""
    return [str(path) for path in (folder / "venv").rglob("*") if "kinetree" in str(path.relative_to(folder)) and path.suffix != ".pyc"]


def main():
    root, build = sys.argv[1:]
    with tempfile.TemporaryDirectory(prefix="wheel-", dir=pathlib.Path(build).parent) as name:
        folder = pathlib.Path(name)
        problems, _ = words(sys.executable, "-m", "venv", "--system-site-packages", folder / "venv")
        if problems:
            skip("pip_installs_the_package", "this Python has no venv")
            return finish()
        python = folder / "venv/bin/python"
        environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1", "TMPDIR": str(pathlib.Path(build).parent), "CCACHE_NOHASHDIR": "1"}
        problems, _ = words(python, "-m", "pip", "install", "--no-index", "--no-build-isolation", "--no-deps",
                            f"--config-settings=setup-args={settings(build)}", root, env=environment)
        claim("pip_installs_the_package", problems)
        if not problems:
            clean = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "KINETREE_COMMAND")}
            problems, said = words(python, "-c", PROGRAM, cwd=folder, env=clean)
            claim("the_package_runs_a_mechanism_without_a_file", problems or ([] if said.strip().endswith("True") else [said]))
            problems, said = words(folder / "venv/bin/kinetree", "demo", cwd=folder, env=clean)
            claim("the_command_finds_its_scenes", problems or ([] if "double-pendulum" in said else [said]))
            problems, said = words(python, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", SAMPLE, f"{root}/test/python", cwd=folder,
                                   env={**clean, "PYTHONDONTWRITEBYTECODE": "1"})
            claim("the_installed_package_passes_its_tests", problems or ([] if " passed" in said and " failed" not in said else [said]))
            _, listed = words("ls", *folder.glob("venv/lib/python*/site-packages/kinetree"))
            claim("the_module_has_the_stable_interface", [] if "_kinetree.abi3.so" in listed else [listed])
            claim("the_metadata_have_a_licence_and_no_broken_link", broken(folder))
            problems, said = words(python, "-m", "pip", "uninstall", "-y", "kinetree", env=environment)
            claim("nothing_of_the_package_is_left_after_it", problems + left(folder))
            problems, _ = words(python, "-m", "pip", "install", "--no-index", "--no-build-isolation", "--no-deps",
                                f"--config-settings=setup-args={settings(build)}", "-e", root, env=environment)
            claim("pip_installs_the_package_in_place", problems)
            problems, said = words(python, "-c", "import kinetree as kt\nprint(kt.__file__)\n" + PROGRAM, cwd=folder, env=clean)
            claim("a_package_in_place_has_the_sources_of_the_checkout",
                  problems or ([] if said.startswith(str(pathlib.Path(root).resolve() / "apps/python/kinetree")) and said.strip().endswith("True") else [said]))
            problems, said = words(python, "-m", "pip", "uninstall", "-y", "kinetree", env=environment)
            claim("no_file_of_a_package_in_place_is_left_after_it", problems + left(folder))
    finish()


main()
