"""Runs pytest and mypy on the package of a build directory: run.py PACKAGE-FOLDER COMMAND TESTS."""
# SPDX-License-Identifier: Apache-2.0
import importlib.util
import os
import subprocess
import sys

sys.dont_write_bytecode = True
folder, command, tests = sys.argv[1:]
environment = {**os.environ, "PYTHONPATH": folder, "KINETREE_COMMAND": command, "PYTHONDONTWRITEBYTECODE": "1", "MALLOC_PERTURB_": ""}
ended = subprocess.run([sys.executable, "-m", "pytest", "-q", "-s", "-p", "no:cacheprovider", tests], env=environment)
status = ended.returncode
if importlib.util.find_spec("mypy"):
    said = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports", "--cache-dir", os.devnull, f"{folder}/kinetree"],
                          env=environment, capture_output=True, text=True)
    print(said.stdout + said.stderr)
    print(f"[{'  FAILED  ' if said.returncode else '       OK '}] types_are_consistent_for_mypy", flush=True)
    status = status or said.returncode
else:
    print("[  SKIPPED ] types_are_consistent_for_mypy: mypy is not on this machine")
sys.exit(status)
