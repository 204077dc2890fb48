"""What all tests of the package share: scenes, and a line for each test as test/count.py counts them."""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib

import numpy as np
import pytest

SCENES = pathlib.Path(__file__).resolve().parents[2] / "apps/scenes"


def pytest_runtest_logreport(report):
    if report.when == "call" or report.outcome != "passed" and report.when == "setup":
        mark = {"passed": "       OK ", "failed": "  FAILED  ", "skipped": "  SKIPPED "}[report.outcome]
        reason = f": {report.longrepr[2]}" if report.outcome == "skipped" else ""
        print(f"\n[{mark}] {report.nodeid.split('::')[-1]}{reason}")


@pytest.fixture
def scenes():
    return SCENES


@pytest.fixture
def held():
    """held(observed, bound): prints both, and fails on NaN."""
    def check(observed, bound, what=""):
        observed = float(observed)
        print(f"       {what or 'observed'} {observed:.3g}, bound {bound:.3g}")
        assert observed <= bound
    return check


@pytest.fixture
def random_state():
    """A state of a model near its initial one, for a seed."""
    def make(model, seed):
        draw = np.random.default_rng(seed)
        q, v = model.initial
        return model.add(q, 0.5 * draw.standard_normal(model.nv)), draw.standard_normal(model.nv), draw.standard_normal(model.nv)
    return make


os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
