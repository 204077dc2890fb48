"""A diagram with two logarithmic axes and a curve for each method, as SVG with the same bytes on every machine."""
# SPDX-License-Identifier: Apache-2.0
import math
from xml.sax.saxutils import escape

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 720, 440, 70, 130, 36, 46
COLOURS = ["#4e79a7", "#f28e2b", "#59a14f", "#e15759", "#76b7b2", "#b07aa1", "#9c755f", "#edc948", "#ff9da7", "#79706e"]


def axis(values, low, high):
    """The decades around values, and the map from a value to a place."""
    first, last = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
    last = max(last, first + 1)
    return range(first, last + 1), lambda v: low + (high - low) * (math.log10(v) - first) / (last - first)


def text(x, y, words, anchor="middle", more=""):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" {more}>{escape(words)}</text>'


def curve(name, points, index, x, y):
    """A line with dots, and its name in the margin; every second method has a dashed line."""
    colour, dashed = COLOURS[index % len(COLOURS)], ' stroke-dasharray="5 3"' if index % 2 else ""
    places = [f"{x(a):.1f},{y(b):.1f}" for a, b in points]
    lines = [f'<polyline points="{" ".join(places)}" fill="none" stroke="{colour}" stroke-width="1.5"{dashed}/>']
    lines += [f'<circle cx="{p.split(",")[0]}" cy="{p.split(",")[1]}" r="2" fill="{colour}"/>' for p in places]
    at = TOP + 14 * (index + 1)
    lines.append(f'<path d="M{WIDTH - RIGHT + 12} {at - 4}h18" stroke="{colour}" stroke-width="1.5"{dashed}/>')
    return lines + [text(WIDTH - RIGHT + 36, at, name, "start")]


def write(path, title, across, up, curves):
    """curves: {name: [(across, up)]}, all values above zero."""
    points = [p for curve_points in curves.values() for p in curve_points]
    if not points:
        return
    columns, x = axis([p[0] for p in points], LEFT, WIDTH - RIGHT)
    rows, y = axis([p[1] for p in points], HEIGHT - BOTTOM, TOP)
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="11">',
             f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>', text(LEFT, 20, title, "start", 'font-size="14"')]
    for k in columns:
        lines += [f'<path d="M{x(10.0**k):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="#ddd"/>', text(x(10.0**k), HEIGHT - BOTTOM + 16, f"1e{k}")]
    for k in rows:
        lines += [f'<path d="M{LEFT} {y(10.0**k):.1f}H{WIDTH - RIGHT}" stroke="#ddd"/>', text(LEFT - 6, y(10.0**k) + 4, f"1e{k}", "end")]
    for index, (name, curve_points) in enumerate(curves.items()):
        lines += curve(name, sorted(curve_points), index, x, y)
    lines += [text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 10, across),
              text(0, 0, up, "middle", f'transform="translate(16 {(TOP + HEIGHT - BOTTOM) / 2:.0f}) rotate(-90)"'), "</svg>"]
    with open(path, "w") as file:
        file.write("\n".join(lines) + "\n")
