"""Stubs and the reference page are what the descriptors and the docstrings make; types reject what does not exist."""
# SPDX-License-Identifier: Apache-2.0
import importlib.util
import os
import pathlib
import re
import subprocess
import sys

import pytest

import kinetree as kt

ROOT = pathlib.Path(__file__).resolve().parents[2]


def made_by(script):
    return subprocess.run([sys.executable, ROOT / "apps/python/reference" / script], capture_output=True, text=True, check=True,
                          env={**os.environ, "PYTHONPATH": str(pathlib.Path(kt.__file__).parents[1])}).stdout


def differences(one, other):
    return [(a, b) for a, b in zip(one.splitlines() + [""], other.splitlines() + [""]) if a != b][:3] or one == other


def test_the_stub_is_made_of_the_descriptors():
    stub = made_by("stubs.py")
    assert differences((ROOT / "apps/python/kinetree/_types.pyi").read_text(), stub) is True
    for kind in ("joint", "loop", "effect", "shape"):
        part = stub[stub.index(f"class _{kind.capitalize()}:"):].partition("\n\n\n")[0]
        assert all(f"    def {name}(self" in part for name in dir(getattr(kt, kind))), kind
    assert re.search(r"def spring\(self, \*, between: Sequence\[End\],[^)]*stiffness: Number = 0\.0", re.sub(r"\s+", " ", stub))


def test_the_reference_page_has_each_public_name():
    page = (ROOT / "include/pages/python-reference.md").read_text()
    assert differences(page, made_by("page.py")) is True
    for name in kt.__all__:
        found = getattr(kt, name)
        assert f"\n## {name}\n" in page or f"`kt.{name}`" in page, name
        members = [each for each in vars(found) if not each.startswith("_")] if isinstance(found, type) else []
        assert not [each for each in members if callable(getattr(found, each)) and f"\n### {name}.{each}\n" not in page], name


@pytest.mark.skipif(importlib.util.find_spec("mypy") is None, reason="mypy is not on this machine")
def test_mypy_rejects_types_and_keywords_that_do_not_exist(tmp_path):
    program = tmp_path / "program.py"
    program.write_text("import kinetree as kt\n"
                       "kt.effect.sprng()\n"
                       "kt.effect.spring(between=['a', 'b'], stifness=3)\n"
                       "kt.loop.spherical()\n"
                       "kt.effect.spring(between=['a', 'b'], stiffness='=k', length=0.2)\n"
                       "kt.load('four-bar').simulation(step=1e-3).positions.shape\n"
                       "kt.load('four-bar').simulation(stpe=1e-3)\n")
    said = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--cache-dir", os.devnull, program], capture_output=True, text=True, cwd=tmp_path,
                          env={**os.environ, "MYPYPATH": str(pathlib.Path(kt.__file__).parents[1])}).stdout
    lines = {int(number) for number in re.findall(r"program\.py:(\d+): error", said)}
    assert lines == {2, 3, 4, 7}, said
