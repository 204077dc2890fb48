"""The example scripts of the package run without a warning, keep their claims, and hold under mypy --strict."""
# SPDX-License-Identifier: Apache-2.0
import importlib.util
import os
import pathlib
import subprocess
import sys

import pytest

import kinetree as kt

EXAMPLES = sorted((pathlib.Path(__file__).resolve().parents[2] / "apps/python/examples").glob("*.py"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs(path, tmp_path):
    if path.stem == "trajectory":
        pytest.importorskip("scipy", reason="scipy is not on this machine")
    done = subprocess.run([sys.executable, "-W", "error::UserWarning", path], capture_output=True, text=True, cwd=tmp_path)
    print("      ", done.stdout.strip().replace("\n", "\n       "))
    assert done.returncode == 0 and done.stdout, done.stderr[-2000:]


@pytest.mark.skipif(importlib.util.find_spec("mypy") is None, reason="mypy is not on this machine")
def test_the_examples_hold_under_mypy_strict(tmp_path):
    said = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports", "--cache-dir", os.devnull, *EXAMPLES], capture_output=True,
                          text=True, cwd=tmp_path, env={**os.environ, "MYPYPATH": str(pathlib.Path(kt.__file__).parents[1])})
    assert said.returncode == 0 and len(EXAMPLES) >= 10, said.stdout
