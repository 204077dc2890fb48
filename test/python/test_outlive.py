"""Use after free is impossible: valgrind and AddressSanitizer watch parts of objects that are gone."""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig

import pytest

import kinetree as kt

PROGRAM = pathlib.Path(__file__).with_name("outlive.py")


def under_valgrind(scenes, *words):
    """Only accesses of memory that is not there: of its values Python computes with some that it never set."""
    environment = {**os.environ, "PYTHONMALLOC": "malloc", "OPENBLAS_NUM_THREADS": "1"}
    return subprocess.run([shutil.which("valgrind"), "-q", "--undef-value-errors=no", "--leak-check=no", "--error-exitcode=9",
                           f"--suppressions={PROGRAM.with_name('loader.supp')}", sys.executable, PROGRAM, scenes, *words],
                          env=environment, capture_output=True, text=True)


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not on this machine")
def test_no_part_reads_memory_of_an_owner_that_is_gone(scenes):
    done = under_valgrind(scenes)
    print("      ", done.stdout.strip())
    assert done.returncode == 0 and "parts outlive" in done.stdout, done.stderr[-3000:]


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not on this machine")
def test_valgrind_sees_a_read_after_free(scenes):
    done = under_valgrind(scenes, "broken")
    assert done.returncode == 9 and "Invalid read" in done.stderr, done.stderr[-2000:]


def linked(module):
    """Options that link the libraries of a module."""
    listed = subprocess.run(["readelf", "-d", module], check=True, capture_output=True, text=True).stdout
    return [f"-l:{name}" for name in re.findall(r"\(NEEDED\).*\[(.*?)\]", listed) if not name.startswith("ld-")]


@pytest.fixture(scope="module")
def sanitized(tmp_path_factory):
    """The environment of a package whose extension module has AddressSanitizer."""
    package, compiler = pathlib.Path(kt.__file__).parent, shutil.which("gcc")
    libraries = package.parents[2] / "lib"
    if not (package / "_kinetree.c").exists() or not (libraries / "libkinetree-scene.so").exists():
        pytest.skip("the package is not in a build directory with shared libraries")
    runtime = compiler and subprocess.run([compiler, "-print-file-name=libasan.so"], capture_output=True, text=True).stdout.strip()
    if not runtime or not os.path.isabs(runtime):
        pytest.skip("AddressSanitizer of gcc is not on this machine")
    folder = tmp_path_factory.mktemp("sanitized")
    shutil.copytree(package, folder / "kinetree", ignore=lambda _, names: [each for each in names if not each.endswith((".py", ".typed"))])
    subprocess.run([compiler, "-fsanitize=address", "-w", "-shared", "-fPIC", "-DPy_LIMITED_API=0x03090000",
                    f"-I{PROGRAM.parents[2] / 'include'}", f"-I{PROGRAM.parents[2] / 'apps/kinetree'}", f"-I{sysconfig.get_path('include')}", package / "_kinetree.c", "-o",
                    folder / "kinetree/_kinetree.abi3.so", package.parents[1] / "kinetree/libkinetree-command.a",
                    libraries / "libkinetree-picture.a", f"-L{libraries}", f"-Wl,-rpath,{libraries}",
                    *linked(package / "_kinetree.abi3.so")], check=True)
    return {**os.environ, "LD_PRELOAD": runtime, "ASAN_OPTIONS": "detect_leaks=0", "PYTHONMALLOC": "malloc", "PYTHONPATH": str(folder),
            "OPENBLAS_NUM_THREADS": "1"}


@pytest.mark.parametrize("words", [[], ["broken"]])
def test_address_sanitizer_sees_a_read_after_free_and_no_other(scenes, sanitized, words):
    done = subprocess.run([sys.executable, PROGRAM, scenes, *words], env=sanitized, capture_output=True, text=True)
    print("      ", done.stdout.strip() or done.stderr.strip().splitlines()[1])
    if words:
        assert done.returncode != 0 and "heap-use-after-free" in done.stderr, done.stderr[-2000:]
    else:
        assert done.returncode == 0 and "parts outlive" in done.stdout, done.stderr[-3000:]
