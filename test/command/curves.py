"""curves KINETREE SUPPRESSIONS: a curve of many records is drawn with few points, and nothing that can be seen is lost.

The path of the only curve is read from the picture. Its ends and its extremes, whose values are known, say where records lie on the paper;
every record is then held against the path.
"""
# SPDX-License-Identifier: Apache-2.0
import bisect
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE = sys.argv[1]
# What libraries of fonts keep until the end is not the command's.
os.environ["LSAN_OPTIONS"] = f"print_suppressions=0:suppressions={sys.argv[2]}"
ROWS, SPIKE = 20000, 12345
# A tenth of a point is left out, and numbers have two decimals, cut off.
OFF = 0.1 + 0.02


def path_of(values, *words):
    """The points of the curve, and the size of the file."""
    with tempfile.TemporaryDirectory() as folder:
        table, picture = pathlib.Path(folder) / "table.csv", pathlib.Path(folder) / "table.svg"
        table.write_text("time,value\n" + "".join(f"{10 * i / (ROWS - 1):.9g},{y:.9g}\n" for i, y in enumerate(values)))
        subprocess.run([KINETREE, "plot", table, "--columns", "value", "--out", picture, *words], check=True, capture_output=True)
        text = picture.read_text()
    longest = max(re.findall(r' d="([^"]*)"', text), key=len)
    return [(float(x), float(y)) for x, y in re.findall(r"[ML] ([-0-9.]+) ([-0-9.]+)", longest)], len(text)


def distance(point, start, end):
    """Of a point from the line through two others."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    return abs((point[0] - start[0]) * dy - (point[1] - start[1]) * dx) / math.hypot(dx, dy)


def largest_distance(values, points):
    """Of the records from the path."""
    x0, x1 = points[0][0], points[-1][0]
    low, high = min(values), max(values)
    bottom, top = max(y for _, y in points), min(y for _, y in points)
    xs, worst = [x for x, _ in points], 0.0
    for i, value in enumerate(values):
        place = x0 + (x1 - x0) * i / (ROWS - 1), bottom + (top - bottom) * (value - low) / (high - low)
        k = min(max(bisect.bisect_right(xs, place[0]), 1), len(xs) - 1)
        worst = max(worst, distance(place, points[k - 1], points[k]))
    return worst


smooth = [math.sin(2 * math.pi * 3 * i / ROWS) for i in range(ROWS)]
points, _ = path_of(smooth)
off = largest_distance(smooth, points)
note(f"smooth: {len(points)} points of {ROWS} records, off by {off:.3f} of {OFF:.2f} pt")
claim("smooth_curve_has_few_points", [] if 20 < len(points) < 300 else [f"{len(points)}"])
claim("every_record_lies_on_its_curve", [] if off <= OFF else [f"{off} pt"])

# One record in 20,000 that stands out by half of the height, 330 pt wide and 200 pt high or more.
points, _ = path_of([0.1 * y + (1.0 if i == SPIKE else 0.0) for i, y in enumerate(smooth)])
height = max(y for _, y in points) - min(y for _, y in points)
claim("single_record_that_stands_out_is_seen", [] if height > 100 and len(points) < 400 else [f"{height} pt, {len(points)} points"])

state = 1
noise = []
for _ in range(ROWS):
    state = state * 6364136223846793005 + 1442695040888963407 & (1 << 64) - 1
    noise.append((state >> 40) / (1 << 24))
points, size = path_of(noise)
note(f"noise: {len(points)} points, {size} bytes")
claim("picture_of_noise_is_small", [] if size < 60_000 else [f"{size} bytes"])

# exp(-500 t / T) falls by 217 powers of ten: the axis ends after twenty of them, and so does the curve.
points, _ = path_of([math.exp(-500 * i / ROWS) for i in range(ROWS)], "--log")
lowest, width = max(y for _, y in points), points[-1][0] - points[0][0]
note(f"a decay of 217 powers of ten: drawn down to {lowest} pt, over {width} of 660 pt")
claim("curve_ends_with_its_axis", [] if lowest < 320 and 40 < width < 80 else [f"{lowest} pt, {width} pt wide"])
finish()
