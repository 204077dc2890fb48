"""Use after free is impossible: valgrind watches parts of objects that are gone."""
import os
import pathlib
import shutil
import subprocess
import sys

import pytest

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
