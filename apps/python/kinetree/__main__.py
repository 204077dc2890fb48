"""``python -m kinetree`` is the command."""
import os
import sys

from . import command

program = command.path()
os.execv(program, [program, *sys.argv[1:]])
