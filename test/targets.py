#!/usr/bin/env python3
"""Prints what must be built for tests: test/targets.py BUILD-DIRECTORY [--but SUITE...]

One path a line, relative to the build directory, for ninja; the tests are all but those of the suites. A test that is a
script needs the targets that it names.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import os
import subprocess
import sys


def introspect(build, what):
    return json.loads(subprocess.run(["meson", "introspect", what, build], check=True, stdout=subprocess.PIPE).stdout)


def main(build, *suites):
    left_out = {f"kinetree:{suite}" for suite in suites} - {"kinetree:--but"}
    tests = [test for test in introspect(build, "--tests") if not left_out & set(test["suite"])]
    needed = {target for test in tests for target in test["depends"]}
    files = [name for target in introspect(build, "--targets") if target["id"] in needed for name in target["filename"]]
    print("\n".join(sorted(os.path.relpath(name, build) for name in files)))


main(*sys.argv[1:])
