"""What a program executes inside a function, counted by callgrind."""
# SPDX-License-Identifier: Apache-2.0
import collections
import os
import pathlib
import subprocess
import sys
import tempfile

class Count:
    """Instructions: in all, by function, and by source file; and the functions that run, by the file that they are in."""

    def __init__(self):
        self.instructions = 0
        self.instructions_of, self.instructions_in = collections.Counter(), collections.Counter()
        self.functions_in = collections.defaultdict(set)


def count(valgrind, function, *command):
    """Of all calls of a function and what it calls."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "callgrind"
        run = subprocess.run([valgrind, "--tool=callgrind", "--dump-instr=yes", "--compress-pos=no", "--compress-strings=no",
                              f"--callgrind-out-file={out}", f"--toggle-collect={function}", *map(str, command)],
                             capture_output=True, text=True, check=False,
                             # No looking up of functions at their first call; and memory is cleared and copied without
                             # rep stosb and movsb, of which valgrind counts every byte.
                             env={**os.environ, "LD_BIND_NOW": "1",
                                  "GLIBC_TUNABLES": "glibc.cpu.x86_rep_stosb_threshold=1000000000:"
                                                    "glibc.cpu.x86_rep_movsb_threshold=1000000000"})
        if run.returncode != 0 or not out.exists():
            sys.exit(f"{' '.join(map(str, command))}: status {run.returncode}\n{run.stdout}{run.stderr}")
        return read(out)


def read(path):
    total = Count()
    name = source = place = ""
    skip = False
    for line in path.read_text().splitlines():
        if line.startswith(("fl=", "fi=", "fe=")):
            source = line[3:]
        elif line.startswith("fn="):
            name, place = line[3:], source
        elif line.startswith("calls="):
            skip = True  # the line after it sums up what was called, which is there by itself
        elif line.startswith("0x"):
            if not skip:
                times = int(line.split()[-1])
                total.instructions += times
                total.instructions_in[source] += times
                total.instructions_of[name] += times
                total.functions_in[place].add(name)
            skip = False
    return total
