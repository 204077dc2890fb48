"""Calls of `kinetree export`, whose COMMAND is the first argument, in folders of their own."""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import subprocess
import sys
import tempfile

from claims import claim

COMMAND = pathlib.Path(sys.argv[1]).resolve()
# An event sets the parameter k, which the file does not list as a state.
BOUNCE = """kinetree: 1
gravity: [0, 0, -9.81]
parameters: {k: 5}
states: {heat: {rate: "k*velocity.ball^2"}}
bodies: [{name: ball, joint: {type: prismatic, axis: z, position: 1}, mass: 0.1, shape: {type: sphere, radius: 0.02}}]
effects: [{name: push, type: expression, joint: ball, force: 0.01*k^2}]
events: [{name: hit, when: position.ball, direction: falling, then: {set: {velocity.ball: -0.8*velocity.ball, k: 0.5*k}}}]
simulate: {duration: 3}
"""


def export(folder, *words):
    return subprocess.run([COMMAND, "export", *map(str, words)], capture_output=True, text=True, cwd=folder)


def rejected(name, status, message, *words):
    """A wrong call ends with a status and a message, and writes no file."""
    with tempfile.TemporaryDirectory() as folder:
        made = export(folder, *words)
        left = [path.name for path in pathlib.Path(folder).iterdir()]
        problems = [] if made.returncode == status else [f"status {made.returncode} instead of {status}"]
        problems += [] if message in made.stderr else [f"'{message}' is not in: {made.stderr}"]
        claim(name, problems + [f"{path} was written" for path in left])
