"""Fuzzes the files that subcommands read: changes them, and runs the command.

    files.py COMMAND TARGET SECONDS FOLDER_OF_SEEDS FOLDER_OF_FINDINGS

TARGET is a key of TARGETS. SECONDS may be the word suite: KT_FUZZ_SECONDS, or 15. Seeds are files of the repository, and
results that the command makes of them at first. Each command line must be right with one of these. Each changed input must
end the command with one of its exit statuses, within PATIENCE s, and without a report of a sanitizer. Exit status 0:
nothing was found. Inputs that are found, with their command lines, are in the folder of findings.
"""
# SPDX-License-Identifier: Apache-2.0
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

# fontconfig keeps what it reads until the process ends.
os.environ.setdefault("LSAN_OPTIONS", f"print_suppressions=0:suppressions={Path(__file__).resolve().parents[1] / 'command/suppressions.txt'}")

PATIENCE = 20 * float(os.environ.get("KT_FUZZ_SLOWNESS", "1"))  # s
SIZE = 16384  # bytes of an input
SCENE = "double-pendulum.yaml"
NUMBERS = [b"0", b"-1", b"1e308", b"1e999", b"nan", b"9223372036854775807", b"-9223372036854775808", b"4294967301", b"18446744073709551616"]
BYTES = [b"\0", b"\r", b"\n", b"\r\n", b",", b'"', b";", b"\xff", b"\x1b[2J", b"%s%n", b"\xef\xbb\xbf", b" ", b"\t"]

# For each target: the name of the changed file, and the command lines. {} is that file, {scene} a right scene.
EACH = ["check {}", "info {}", "evaluate {}", "run {} --duration 0.01", "draw {} --out o.svg", "view {} --duration 0.01 --out o.html",
        "modes {}", "equilibrium {}", "stability {} --duration 0.01", "export {} --mjcf --out o.xml", "export {} --urdf --out o.urdf",
        "accuracy {} --budget 0.1"]
SCENE_ALONE = ["sweep {} --vary gravity[2]=-9:-10:2 --set simulate.duration=0.01 --out o.csv"]
ROBOT_ALONE = ["import {} --out o.yaml"]
TARGETS = {
    "csv": ("t.csv", ["plot {} --out o.svg", "run {scene} --from {} --duration 0.01", "accuracy {scene} --reference {} --budget 0.1",
                      "sweep {scene} --from {} --set simulate.duration=0.01 --out o.csv"]),
    "hdf5": ("t.h5", ["plot {} --out o.svg", "run {scene} --from {} --duration 0.01"]),
    "merge": ("t.csv", ["sweep --merge {} s2.csv --out o.csv", "sweep --merge s1.csv {} --out o.csv"]),
    "resume": ("t.ck", ["run {scene} --duration 3 --step 0.001 --integrator rk4 --out r.csv --resume {}"]),
    "command": ("t.yaml", EACH + SCENE_ALONE),
    "command-mjcf": ("t.xml", EACH + ROBOT_ALONE),
    "command-urdf": ("t.urdf", EACH + ROBOT_ALONE),
}


def run(line, folder, seconds=PATIENCE):
    return subprocess.run(line, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, timeout=seconds)


def summed(data):
    """A checkpoint's last eight bytes made right: FNV-1a of all others."""
    total = 0xcbf29ce484222325
    for byte in data[:-8]:
        total = (total ^ byte) * 0x100000001b3 & 0xffffffffffffffff
    return data[:-8] + total.to_bytes(8, "little")


def results(command, target, work):
    """Files that the command makes from the right scene."""
    shutil.copy(work / SCENE, work / "seed.yaml")
    lines = {"csv": "run seed.yaml --duration 0.1 --out a.csv", "hdf5": "run seed.yaml --duration 0.1 --out a.h5",
             "resume": "run seed.yaml --duration 3 --step 0.001 --integrator rk4 --out r.csv --checkpoint a.ck --checkpoint-interval 1e-4"}
    if target in lines:
        run([command, *lines[target].split()], work, 60)
    for k in (1, 2) if target == "merge" else ():
        run([command, *f"sweep seed.yaml --vary gravity[2]=-9:-10:4 --set simulate.duration=0.01 --shard {k}/2 --out s{k}.csv".split()], work, 60)
    (work / "values.csv").write_text("gravity[2]\n-9\n-10\n")
    names = {"csv": ["a.csv", "values.csv"], "hdf5": ["a.h5"], "resume": ["a.ck"], "merge": ["s1.csv", "s2.csv"]}.get(target, [])
    return [(work / name).read_bytes()[:SIZE if target != "hdf5" else None] for name in names if (work / name).exists()]


def misused(command, lines, name, seeds, work):
    """The first command line that is wrong with every right file: it would end before it reads any file."""
    for line in lines:
        passes = False
        for data in seeds:
            (work / name).write_bytes(data)
            ended = run([command, *line.format(name, scene=SCENE).split()], work, 600)
            passes = passes or ended.returncode != 1 or b"--help" not in ended.stderr
        if not passes:
            return line
    return None


def mutate(draw, data, others):
    data = bytearray(data)
    for _ in range(draw.choice([1, 1, 2, 4, 8])):
        at, kind = draw.randrange(len(data) + 1), draw.randrange(7)
        if kind == 0 and at < len(data):
            data[at] ^= 1 << draw.randrange(8)
        elif kind == 1 and at < len(data):
            data[at] = draw.randrange(256)
        elif kind == 2:
            data[at:at + draw.randrange(12)] = draw.choice(NUMBERS)
        elif kind == 3:
            data[at:at] = draw.choice(BYTES)
        elif kind == 4:
            del data[at:at + draw.randrange(64)]
        elif kind == 5:
            data[at:at] = bytes(data[at:at + draw.randrange(64)]) * draw.choice([1, 2, 50])
        else:
            other = draw.choice(others)
            begin = draw.randrange(len(other) + 1)
            data[at:at + draw.randrange(2) * 32] = other[begin:begin + draw.randrange(128)]
    return bytes(data)


def fault_of(line, folder):
    """What is wrong with a run; empty if nothing is."""
    try:
        ended = run(line, folder)
    except subprocess.TimeoutExpired:
        return f"takes more than {PATIENCE:g} s"
    text = ended.stderr.decode(errors="replace")
    if "Sanitizer" in text or "runtime error" in text:
        return "a report of a sanitizer:\n" + text[-4000:]
    if ended.returncode not in (0, 1, 2, 3, 4):
        return f"exit status {ended.returncode}\n" + text[-1000:]
    return "a message of a terminal's control characters" if "\x1b" in text else ""


def main(command, target, seconds, seeds, findings):
    name, lines = TARGETS[target]
    command, findings = str(Path(command).resolve()), Path(findings)
    draw = random.Random(int(os.environ.get("KT_SEED", "20240229")))
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        scenes = Path(__file__).resolve().parents[2] / "apps/scenes"
        shutil.copy(scenes / SCENE, work)
        right = results(command, target, work)
        kept = [path.read_bytes() for path in sorted(Path(seeds).glob(f"{target}-*"))] + right
        if target == "command":
            kept += [path.read_bytes() for path in sorted(scenes.glob("*.yaml"), key=lambda path: path.stat().st_size)[:12]]
        if not kept:
            print(f"no seeds for '{target}': the command does not write such files here")
            return 0
        wrong = misused(command, lines, name, right or kept, work)
        if wrong:
            print(f"this is no command line: {wrong}")
            return 1
        end, count, first = time.monotonic() + seconds, 0, True
        while first or time.monotonic() < end:
            batch = kept if first else [mutate(draw, draw.choice(kept), kept)]
            first = False
            for data in batch:
                (work / name).write_bytes(summed(data) if target == "resume" and len(data) > 8 and draw.random() < 0.8 else data)
                line = [command, *draw.choice(lines).format(name, scene=SCENE).split()]
                fault, count = fault_of(line, work), count + 1
                if fault:
                    findings.mkdir(parents=True, exist_ok=True)
                    shutil.copy(work / name, findings / f"{target}-{count}")
                    (findings / f"{target}-{count}.txt").write_text(" ".join(line) + "\n" + fault + "\n")
                    print(f"found: {' '.join(line[1:])}: {fault}\nthe file is {findings / f'{target}-{count}'}")
                    return 1
        print(f"{target}: {count} runs, nothing found")
    return 0


if __name__ == "__main__":
    duration = os.environ.get("KT_FUZZ_SECONDS", "15") if sys.argv[3] == "suite" else sys.argv[3]
    sys.exit(main(sys.argv[1], sys.argv[2], float(duration), sys.argv[4], sys.argv[5]))
