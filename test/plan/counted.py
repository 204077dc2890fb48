"""What a program executes inside a function, counted by callgrind instruction by instruction and told apart by objdump:
all instructions, and the floating-point operations among them (additions, subtractions, multiplications, divisions and
square roots of doubles, each lane of a vector one; a fused multiplication and addition two)."""
import collections
import functools
import os
import pathlib
import re
import subprocess
import sys
import tempfile

OPERATION = re.compile(r"v?(add|sub|mul|div|sqrt)(sd|pd)")
FUSED = re.compile(r"vfn?m(add|sub)(132|213|231)(sd|pd)")


def lanes(kind, operands):
    return 1 if kind == "sd" else 8 if "%zmm" in operands else 4 if "%ymm" in operands else 2


@functools.lru_cache(maxsize=None)
def operations_of(binary):
    """Floating-point operations of each instruction of a binary, by address; others are left out."""
    text = subprocess.run(["objdump", "-d", "--no-show-raw-insn", binary], capture_output=True, text=True, check=True).stdout
    found = {}
    for line in text.splitlines():
        parts = line.split("\t")
        if len(parts) < 2 or not parts[0].endswith(":"):
            continue
        name, _, operands = parts[-1].partition(" ")
        plain, fused = OPERATION.fullmatch(name), FUSED.fullmatch(name)
        if plain:
            found[int(parts[0].strip(" :"), 16)] = lanes(plain[2], operands)
        elif fused:
            found[int(parts[0].strip(" :"), 16)] = 2 * lanes(fused[3], operands)
    return found


class Count:
    """instructions and flops, in all, and by function; instructions by source file; flops of the program's own code, that
    is without those of shared libraries."""

    def __init__(self):
        self.instructions = self.flops = self.own_flops = 0
        self.instructions_of, self.flops_of = collections.Counter(), collections.Counter()
        self.instructions_in = collections.Counter()


def count(valgrind, function, *command):
    """Of all calls of a function and what it calls."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "callgrind"
        run = subprocess.run([valgrind, "--tool=callgrind", "--dump-instr=yes", "--compress-pos=no", "--compress-strings=no",
                              f"--callgrind-out-file={out}", f"--toggle-collect={function}", *map(str, command)],
                             capture_output=True, text=True, check=False,
                             env={**os.environ, "LD_BIND_NOW": "1"})  # no looking up of functions at their first call
        if run.returncode != 0 or not out.exists():
            sys.exit(f"{' '.join(map(str, command))}: status {run.returncode}\n{run.stdout}{run.stderr}")
        return read(out, command[0])


def read(path, program):
    total = Count()
    binary = name = source = ""
    own = str(pathlib.Path(program).resolve())
    skip = False
    for line in path.read_text().splitlines():
        if line.startswith("ob="):
            binary = line[3:]
        elif line.startswith(("fl=", "fi=", "fe=")):
            source = line[3:]
        elif line.startswith("fn="):
            name = line[3:]
        elif line.startswith("calls="):
            skip = True  # the line after it sums up what was called, which is there by itself
        elif line.startswith("0x"):
            if not skip:
                address, _, times = line.split()
                times = int(times)
                flops = times * operations_of(binary).get(int(address, 16), 0) if binary.startswith("/") else 0
                total.instructions += times
                total.flops += flops
                total.own_flops += flops if binary == own else 0
                total.instructions_in[source] += times
                total.instructions_of[name] += times
                total.flops_of[name] += flops
            skip = False
    return total
