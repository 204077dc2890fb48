"""Solids, arrows and words of the pictures that draw.py makes, as SVG.

Solids are seen from one direction, without perspective: x to the front left, y to the right, z up. What is drawn later
covers what was drawn before.
"""
# SPDX-License-Identifier: Apache-2.0
import math

AZIMUTH, ELEVATION, SCALE = math.radians(35), math.radians(24), 60.0
SIZE = (320, 190)

STYLE = """
text{font:13px "Helvetica Neue",Arial,"Liberation Sans",sans-serif;fill:#24292f}text.i{font-style:italic}
path,circle{stroke-linejoin:round;stroke-linecap:round;stroke-width:1.3;stroke:#24292f;fill:none}
.card{fill:#fff;stroke:none}
.p1{fill:#f1f3f5}.p2{fill:#d3d8dd}.p3{fill:#b7bec6}.b1{fill:#d6e7fb}.b2{fill:#a3c9f3}.b3{fill:#79aee8}
.plane{fill:#9aa4af;fill-opacity:.22;stroke:#7d8792}.rubber{fill:#8f979f}
.axis{stroke:#6b7580;stroke-dasharray:9 3 2 3;stroke-width:1.1}.thin{stroke-width:1}.hatch{stroke:#57606a;stroke-width:1}
.m{stroke:#cf4a0c;stroke-width:1.8}.mf{fill:#cf4a0c;stroke:#cf4a0c}text.m{fill:#cf4a0c;stroke:none}
.f{stroke:#1a7f37;stroke-width:1.8}.ff{fill:#1a7f37;stroke:#1a7f37}text.f{fill:#1a7f37;stroke:none}
text.a{fill:#57606a}.dot{fill:#24292f}
@media (prefers-color-scheme:dark){
text{fill:#e3e8ee}path,circle{stroke:#d5dbe2}.card{fill:#12161c}
.p1{fill:#5b646e}.p2{fill:#48505a}.p3{fill:#383f48}.b1{fill:#3a74b3}.b2{fill:#2c5b90}.b3{fill:#21466f}
.plane{fill:#8b96a3;stroke:#8b96a3}.rubber{fill:#6b737c}.axis{stroke:#9aa5b1}.hatch{stroke:#9aa5b1}
.m{stroke:#ff9c5a}.mf{fill:#ff9c5a;stroke:#ff9c5a}text.m{fill:#ff9c5a}
.f{stroke:#56d07c}.ff{fill:#56d07c;stroke:#56d07c}text.f{fill:#56d07c}text.a{fill:#a9b3be}.dot{fill:#e3e8ee}}
"""

X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)


def add(*vectors):
    return tuple(map(sum, zip(*vectors)))


def scale(factor, u):
    return tuple(factor * c for c in u)


def minus(u, v):
    return add(u, scale(-1, v))


def dot(u, v):
    return sum(a * b for a, b in zip(u, v))


def cross(u, v):
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


def unit(u):
    return scale(1 / math.sqrt(dot(u, u)), u)


def across(u):
    """Two unit vectors that make a right-handed triad with the unit vector u."""
    a = unit(cross(u, X if abs(u[0]) < 0.9 else Y))
    return a, cross(u, a)


def about(axis, angle, u):
    """Rodrigues' formula."""
    axis = unit(axis)
    return add(scale(math.cos(angle), u), scale(math.sin(angle), cross(axis, u)),
               scale((1 - math.cos(angle)) * dot(axis, u), axis))


RIGHT = (-math.sin(AZIMUTH), math.cos(AZIMUTH), 0)
VIEWER = (math.cos(ELEVATION) * math.cos(AZIMUTH), math.cos(ELEVATION) * math.sin(AZIMUTH), math.sin(ELEVATION))
UP = cross(VIEWER, RIGHT)


class Picture:
    def __init__(self, title, centre=(160, 105), size=SCALE):
        self.title, self.centre, self.size, self.parts = title, centre, size, []

    # -- the plane of the picture --

    def at(self, p):
        """A point of the scene; a pair is a point of the picture already."""
        if len(p) == 2:
            return p
        return self.centre[0] + self.size * dot(p, RIGHT), self.centre[1] - self.size * dot(p, UP)

    def path(self, points, style, closed=False):
        flat = [self.at(p) for p in points]
        text = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in flat) + ("z" if closed else "")
        self.parts.append(f'<path class="{style}" d="{text}"/>')

    def text(self, p, words, style="", anchor="middle", shift=(0, 0)):
        """A letter after `_` is set lower."""
        x, y = self.at(p)
        head, *rest = words.split("_")
        marked = head + "".join(
            f'<tspan dy="3" font-size="9">{part[0]}</tspan><tspan dx="{4 if part[1:2] == " " else 0}" dy="-3">{part[1:].lstrip()}</tspan>'
            for part in rest)
        self.parts.append(f'<text class="{style}" x="{x + shift[0]:.1f}" y="{y + shift[1]:.1f}" '
                          f'text-anchor="{anchor}">{marked}</text>')

    def coordinate(self, p, words, loop, *rest, **named):
        """The name of a coordinate, which a joint has and a loop has not."""
        if not loop:
            self.text(p, words, "i m", *rest, **named)

    def head(self, tip, direction, style):
        """The head of an arrow, in the plane of the picture."""
        (x, y), length = tip, math.hypot(*direction)
        dx, dy = direction[0] / length, direction[1] / length
        back = (x - 9 * dx, y - 9 * dy)
        self.path([tip, (back[0] - 3.4 * dy, back[1] + 3.4 * dx), (back[0] + 3.4 * dy, back[1] - 3.4 * dx)],
                  style + "f", True)

    def arrow(self, start, end, style="m", both=False):
        a, b = self.at(start), self.at(end)
        d = (b[0] - a[0], b[1] - a[1])
        n = math.hypot(*d)
        cut = (6 * d[0] / n, 6 * d[1] / n)
        self.path([(a[0] + cut[0], a[1] + cut[1]) if both else a, (b[0] - cut[0], b[1] - cut[1])], style)
        self.head(b, d, style)
        if both:
            self.head(a, (-d[0], -d[1]), style)

    def dot(self, p, radius=2.6, style="dot"):
        x, y = self.at(p)
        self.parts.append(f'<circle class="{style}" cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}"/>')

    # -- curves in space --

    def circle_points(self, centre, axis, radius, begin=0.0, end=360.0, count=None, start=None):
        a, b = across(unit(axis))
        if start is not None:
            a = unit(start)
            b = cross(unit(axis), a)
        count = count or max(8, int(abs(end - begin) / 12))
        return [add(centre, scale(radius * math.cos(t), a), scale(radius * math.sin(t), b))
                for t in (math.radians(begin + (end - begin) * k / count) for k in range(count + 1))]

    def turn(self, centre, axis, radius, begin, end, style="m", start=None, both=False):
        """An arrow that turns about an axis."""
        points = self.circle_points(centre, axis, radius, begin, end, start=start)
        flat = [self.at(p) for p in points]
        self.path(points, style)
        self.head(flat[-1], (flat[-1][0] - flat[-2][0], flat[-1][1] - flat[-2][1]), style)
        if both:
            self.head(flat[0], (flat[0][0] - flat[1][0], flat[0][1] - flat[1][1]), style)

    def axis(self, start, end, words=None, shift=(0, -4), anchor="middle"):
        self.path([start, end], "axis")
        if words:
            self.text(end, words, "a", anchor, shift)

    def helix(self, begin, axis, radius, length, turns, style):
        """The visible half of each turn of a thread."""
        axis = unit(axis)
        a, b = across(axis)
        run = []
        for k in range(int(turns * 24) + 1):
            t = 2 * math.pi * k / 24
            out = add(scale(math.cos(t), a), scale(math.sin(t), b))
            if dot(out, VIEWER) > -0.12:
                run.append(add(begin, scale(length * k / (turns * 24), axis), scale(radius, out)))
            elif run:
                self.path(run, style)
                run = []
        if run:
            self.path(run, style)

    # -- solids --

    def box(self, centre, size, kind, turn=lambda u: u):
        """Edges along x, y, z, turned."""
        axes = [turn(u) for u in (X, Y, Z)]
        faces = []
        for k in range(3):
            for sign in (-1, 1):
                n = scale(sign, axes[k])
                if dot(n, VIEWER) > 1e-9:
                    i, j = (k + 1) % 3, (k + 2) % 3
                    corners = [add(centre, scale(sign * size[k] / 2, axes[k]), scale(u * size[i] / 2, axes[i]),
                                   scale(v * size[j] / 2, axes[j])) for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
                    shade = 1 if n[2] > 0.6 else 2 if dot(n, RIGHT) > 0 else 3
                    faces.append((shade, corners))
        for shade, corners in faces:
            self.path(corners, f"{kind}{shade}", True)

    def cylinder(self, begin, axis, radius, length, kind, hole=0.0):
        axis = unit(axis)
        end = add(begin, scale(length, axis))
        near, far = (end, begin) if dot(axis, VIEWER) > 0 else (begin, end)
        a, b = across(axis)
        side = math.atan2(dot(b, cross(axis, VIEWER)), dot(a, cross(axis, VIEWER)))
        half = [math.pi * k / 14 for k in range(15)]

        def rim(centre, t):
            return add(centre, scale(radius * math.cos(t), a), scale(radius * math.sin(t), b))

        away = 1 if dot(rim((0, 0, 0), side + math.pi / 2), VIEWER) > 0 else -1  # the half that is seen
        self.path([rim(far, side + away * t) for t in half] + [rim(near, side + away * (math.pi - t)) for t in half],
                  f"{kind}2", True)
        self.path(self.circle_points(near, axis, radius, count=28), f"{kind}1", True)
        if hole:
            self.path(self.circle_points(near, axis, hole, count=20), f"{kind}3", True)

    def ball(self, centre, radius, kind):
        self.dot(centre, radius * self.size, f"{kind}2")
        x, y = self.at(centre)
        r = 0.62 * radius * self.size
        self.path([(x + r * math.cos(math.radians(t)), y - r * math.sin(math.radians(t))) for t in range(100, 171, 10)],
                  "thin")

    def bar(self, begin, end, width, kind, height=None):
        """A beam between two points."""
        along = unit(minus(end, begin))
        side = unit(cross(Z if abs(along[2]) < 0.9 else X, along))
        up = cross(along, side)
        size = (math.dist(begin, end), width, height or width)

        def turn(u):
            return add(scale(u[0], along), scale(u[1], side), scale(u[2], up))

        self.box(scale(0.5, add(begin, end)), size, kind, turn)

    def frame(self, p, length=0.45, turn=lambda u: u, names="xyz"):
        for name, u in zip(names, (X, Y, Z)):
            tip = add(p, scale(length, turn(u)))
            self.arrow(p, tip, "n")
            if name != " ":
                self.text(add(p, scale(length + 0.14, turn(u))), name, "i", shift=(0, 4))

    def ground(self, begin, end, side=1):
        """A hatched edge of the world, in the plane of the picture; side: where the hatching is."""
        (x0, y0), (x1, y1) = self.at(begin), self.at(end)
        n = math.hypot(x1 - x0, y1 - y0)
        ux, uy = (x1 - x0) / n, (y1 - y0) / n
        vx, vy = -side * uy, side * ux
        strokes = "".join(f"M{x0 + s * ux:.1f} {y0 + s * uy:.1f}l{7 * (vx - ux):.1f} {7 * (vy - uy):.1f}"
                          for s in range(8, int(n) + 1, 8))
        self.parts.append(f'<path class="hatch" d="{strokes}"/>')
        self.path([begin, end], "")

    def coil(self, begin, end, turns=7, width=9, lead=0.16):
        """A spring."""
        (x0, y0), (x1, y1) = self.at(begin), self.at(end)
        dx, dy = x1 - x0, y1 - y0
        n = math.hypot(dx, dy)
        px, py = -dy / n * width, dx / n * width
        points = [(x0, y0), (x0 + lead * dx, y0 + lead * dy)]
        for k in range(2 * turns):
            s, side = lead + (1 - 2 * lead) * (k + 0.5) / (2 * turns), 1 if k % 2 else -1
            points.append((x0 + s * dx + side * px, y0 + s * dy + side * py))
        self.path([*points, (x1 - lead * dx, y1 - lead * dy), (x1, y1)], "")

    def dashpot(self, begin, end, width=8):
        """A damper."""
        (x0, y0), (x1, y1) = self.at(begin), self.at(end)
        n = math.hypot(x1 - x0, y1 - y0)
        u, v = ((x1 - x0) / n, (y1 - y0) / n), (-(y1 - y0) / n * width, (x1 - x0) / n * width)

        def point(s, side=0.0):
            return x0 + s * n * u[0] + side * v[0], y0 + s * n * u[1] + side * v[1]

        self.path([point(0), point(0.4)], "")
        self.path([point(0.66, 1), point(0.4, 1), point(0.4, -1), point(0.66, -1)], "")
        self.path([point(0.54, 0.8), point(0.54, -0.8)], "")
        self.path([point(0.54), point(1)], "")

    def dimension(self, begin, end, words, shift=(0, -5)):
        a, b = self.at(begin), self.at(end)
        self.arrow(a, b, "n", both=True)
        self.text(((a[0] + b[0]) / 2, (a[1] + b[1]) / 2), words, "i", shift=shift)

    def svg(self):
        width, height = SIZE
        return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
                f'role="img"><title>{self.title}</title><style>{STYLE}.n{{stroke-width:1.2}}.nf{{fill:#24292f}}'
                f'@media (prefers-color-scheme:dark){{.nf{{fill:#d5dbe2}}}}</style>\n'
                f'<path class="card" d="M0 0H{width}V{height}H0z"/>\n' + "\n".join(self.parts) + "\n</svg>\n")


def names(p, loop, first, second):
    """The names of both bodies of a joint or a loop."""
    p.text(first, "first" if loop else "parent", "a")
    p.text(second, "second" if loop else "body", "a")


def flat_turn(p, centre, radius, begin, end, style="m"):
    """An arc with a head, in the plane of the picture."""
    points = [(centre[0] + radius * math.cos(math.radians(t)), centre[1] - radius * math.sin(math.radians(t)))
              for t in (begin + (end - begin) * k / 16 for k in range(17))]
    p.path(points, style)
    p.head(points[-1], (points[-1][0] - points[-2][0], points[-1][1] - points[-2][1]), style)


def flat_box(p, x, y, width, height, kind):
    p.path([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], f"{kind}2", True)
