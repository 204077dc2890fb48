"""Positions of runs, and their differences in the norm of `accuracy`, for the tests of its errors."""
# SPDX-License-Identifier: Apache-2.0
import csv
import io
import math
import pathlib
import re
import subprocess


def kinetree(command, *words):
    return subprocess.run([command, *map(str, words)], capture_output=True, text=True, timeout=600)


def kinds(path, columns):
    """The columns of each joint, and whether they are a length, an angle, a rotation or a free joint."""
    text = pathlib.Path(path).read_text()
    found = []
    for name in dict.fromkeys(re.match(r"position\.([^\[]+)", c)[1] for c in columns if c.startswith("position.")):
        own = [i for i, c in enumerate(columns) if c == f"position.{name}" or c.startswith(f"position.{name}[")]
        joint = re.search(rf"- \{{?name: {re.escape(name)}[,\n].*?type: (\w+)", text, re.S)
        kind = joint[1] if joint else "revolute"
        if len(own) == 1:
            found.append((own, "length" if kind == "prismatic" else "angle"))
        elif kind == "universal":
            found += [([i], "angle") for i in own]
        elif kind == "planar":
            found += [(own[:2], "length"), (own[2:], "angle")]
        elif len(own) == 4:
            found.append((own, "rotation"))
        elif len(own) == 7:
            found += [(own[:3], "length"), (own[3:], "rotation")]
        else:
            return None
    return found


def distance(kind, a, b, length):
    if kind == "angle":
        return abs(math.remainder(a[0] - b[0], 2.0 * math.pi))
    if kind == "length":
        return math.dist(a, b) / length
    dot = abs(sum(x * y for x, y in zip(a, b)))
    sine = math.sqrt(sum((x - y if sum(p * q for p, q in zip(a, b)) > 0 else x + y)**2 for x, y in zip(a, b)))
    return 4.0 * math.asin(min(1.0, 0.5 * sine)) if dot > 0.5 else 2.0 * math.acos(min(1.0, dot))


def run(command, path, duration, records, *words):
    """The columns and the records of positions; None, None: the run failed or ended early."""
    ended = kinetree(command, "run", path, "--duration", repr(duration), "--interval", repr(duration / records),
                     "--record", "position", "--out", "-", "--quiet", *words)
    if ended.returncode not in (0, 1) or not ended.stdout:
        return None, None
    rows = list(csv.reader(io.StringIO(ended.stdout)))
    times = [float(row[0]) for row in rows[1:]]
    if abs(times[-1] - duration) > 1e-9 * duration:
        return None, None
    return rows[0], [[float(x) if x else math.nan for x in row] for row in rows[1:]]


def error_between(parts, length, a, b):
    return max(distance(kind, [x[i] for i in own], [y[i] for i in own], length) for x, y in zip(a, b) for own, kind in parts)
