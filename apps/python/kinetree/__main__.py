"""``python -m kinetree`` is the command."""
# SPDX-License-Identifier: Apache-2.0
import os
import sys

from . import command

program = command.path()
os.execv(program, [program, *sys.argv[1:]])
