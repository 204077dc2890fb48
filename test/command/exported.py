"""Calls of `kinetree export`, whose COMMAND is the first argument, in folders of their own."""
import pathlib
import subprocess
import sys
import tempfile

from claims import claim

COMMAND = pathlib.Path(sys.argv[1]).resolve()


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
