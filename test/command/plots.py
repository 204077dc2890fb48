"""plots KINETREE SUPPRESSIONS: plots show every value that there is, and report what they leave out.

Random own columns leave the domain of their formula; the records of the position say where, in Python.
"""
import csv
import json
import math
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE = sys.argv[1]
os.environ["LSAN_OPTIONS"] = f"print_suppressions=0:suppressions={sys.argv[2]}"
ARM = """kinetree: 1
name: swinging arm
gravity: [0, -9.81, 0]
bodies: [{{name: arm, joint: {{type: revolute, position: 0.5}}, mass: 1, shape: {{type: rod, to: [0, -1, 0]}}}}]
simulate: {{duration: 4, tolerance: 1e-8}}
output: {{columns: {columns}}}
"""


def run(path, *words):
    return subprocess.run([KINETREE, *words], cwd=path, capture_output=True, text=True)


def strokes(svg):
    """Lines of curves: their colour, and the pieces of each."""
    found = []
    for element in re.findall(r"<path [^>]*>", svg):
        width = re.search(r'stroke-width[:=]"?1\.6', element)
        colour, shape = re.search(r'stroke[:=]"?(#[0-9a-f]{6})', element), re.search(r' d="([^"]*)"', element)
        if width and colour and shape:
            found.append((colour.group(1), shape.group(1).count("M")))
    return found


def pieces(values):
    """How many stretches of finite values there are."""
    return sum(math.isfinite(b) and not math.isfinite(a) for a, b in zip([math.nan, *values], values))


with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder)
    wrong, total = [], 0
    for seed in range(10):
        r = random.Random(seed)
        c = r.uniform(-0.6, 0.6)
        formula, domain = r.choice([(f"sqrt(position.arm - {c:.4f})", lambda x: x >= round(c, 4)), (f"log({c:.4f} - position.arm)", lambda x: x < round(c, 4)),
                                    (f"acos(2*position.arm/{abs(c):.4f})", lambda x: abs(2 * x / round(abs(c), 4)) <= 1)])
        (path / "arm.yaml").write_text(ARM.format(columns=f'{{own: "{formula}", fine: "2*position.arm"}}'))
        ran = run(path, "run", "arm.yaml", "--out", "arm.csv", "--summary", "arm.json", "--plot", "arm.svg")
        text = (path / "arm.csv").read_text()
        rows = list(csv.DictReader(text.splitlines()))
        gaps = [float(row["time"]) for row in rows if not domain(float(row["position.arm"]))]
        total += len(gaps)
        summary = json.loads((path / "arm.json").read_text())
        told = [w for w in summary["warnings"] if w["code"] == "not_finite"]
        stated = summary["columns"]["own"].get("gaps", {"count": 0, "time": None})
        if "-nan" in text or stated["count"] != len(gaps) or stated["time"] != (gaps[0] if gaps else None) or len(told) != (len(gaps) > 0) \
                or (told and (told[0]["value"] != len(gaps) or told[0]["time"] != gaps[0] or "max(x, 0)" not in told[0]["remedy"])) \
                or ran.stderr.count("not finite") != len(told) or "rounding noise" in ran.stderr:
            wrong.append(f"seed {seed}, {formula}: {len(gaps)} gaps, {stated}, {told}, {ran.stderr}")
        drawn = run(path, "plot", "arm.csv", "--columns", "own", "--out", "own.svg")
        expected = pieces([float(row["own"]) for row in rows])
        lines = strokes((path / "own.svg").read_text()) if drawn.returncode == 0 and expected else []
        if expected and [m for _, m in lines] != [expected]:
            wrong.append(f"seed {seed}, {formula}: {expected} stretches, drawn {lines}")
    note(f"10 scenes with {total} gaps")
    claim("gaps_of_own_columns_are_counted_reported_and_drawn", wrong if total > 100 else [f"{total} gaps"])
    (path / "arm.yaml").write_text(ARM.format(columns='{never: "log(-1 - position.arm^2)", fine: "2*position.arm"}'))
    ran = run(path, "run", "arm.yaml", "--out", "arm.csv", "--plot", "arm.svg")
    claim("columns_without_a_finite_value_are_no_noise", [] if "since no value is finite: never" in ran.stderr and "rounding noise" not in ran.stderr
          and "1 without a finite value" in (path / "arm.svg").read_text() else [ran.stderr])
finish()
