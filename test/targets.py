#!/usr/bin/env python3
"""Prints what must be built for some tests: test/targets.py BUILD-DIRECTORY TEST...

One path a line, relative to the build directory, for ninja. A test that is a script needs the targets that it names.
"""
import json
import os
import subprocess
import sys


def introspect(build, what):
    return json.loads(subprocess.run(["meson", "introspect", what, build], check=True, stdout=subprocess.PIPE).stdout)


def main(build, *names):
    tests = [test for test in introspect(build, "--tests") if test["name"] in names]
    unknown = set(names) - {test["name"] for test in tests}
    if unknown:
        sys.exit(f"there is no test {', '.join(sorted(unknown))}")
    needed = {target for test in tests for target in test["depends"]}
    files = [name for target in introspect(build, "--targets") if target["id"] in needed for name in target["filename"]]
    print("\n".join(sorted(os.path.relpath(name, build) for name in files)))


main(*sys.argv[1:])
