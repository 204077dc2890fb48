"""Pictures of effects, for draw.py: most of them are flat, with a bar on a bearing or a block."""
# SPDX-License-Identifier: Apache-2.0
import math

from picture import X, Y, Z, add, flat_box, flat_turn, names


def spring(p, loop):
    flat_box(p, 22, 60, 54, 72, "p")
    flat_box(p, 244, 60, 54, 72, "b")
    for x in (76, 244):
        p.path([(x, 96), (x + (22 if x < 160 else -22), 96)], "")
    for x in (98, 222):
        p.path([(x, 76), (x, 116)], "")
    p.coil((98, 76), (222, 76))
    p.dashpot((98, 116), (222, 116))
    p.dot((76, 96))
    p.dot((244, 96))
    p.text((160, 60), "k", "i")
    p.text((160, 144), "c", "i")
    p.dimension((76, 168), (244, 168), "d")


def bushing(p, loop):
    p.cylinder((0, -0.5, 0), Y, 0.72, 1.0, "p")
    near = (0, 0.5, 0)
    p.path(p.circle_points(near, Y, 0.56, count=28), "rubber", True)
    p.path(p.circle_points(near, Y, 0.27, count=20), "b1", True)
    p.cylinder((0, 0.5, 0), Y, 0.27, 0.8, "b")
    p.axis((0, 1.3, 0), (0, 2.1, 0))
    p.axis((0, -1.0, 0), (0, -2.0, 0))
    p.arrow((0, 1.3, 0), (0, 1.9, 0))
    p.arrow((0, 1.45, 0.3), (0, 1.45, 0.95))
    p.arrow((0.3, 1.3, 0), (1.1, 1.3, 0))
    p.turn((0, 1.62, 0), Y, 0.24, -30, 220, start=X)
    p.path([(126, 62), (112, 30)], "thin")
    p.text((108, 24), "six stiffnesses and dampings", "a", shift=(24, 0))
    names(p, True, (72, 152), (286, 122))


def hinge(p, x, y, angle=28, length=120):
    """A bar on a bearing, in the plane."""
    p.path([(x, y), (x - 17, y + 34), (x + 17, y + 34)], "p2", True)
    p.ground((x - 32, y + 34), (x + 32, y + 34))
    c, s = math.cos(math.radians(angle)), -math.sin(math.radians(angle))
    p.path([(x - 9 * s, y + 9 * c), (x + length * c - 9 * s, y + length * s + 9 * c),
            (x + length * c + 9 * s, y + length * s - 9 * c), (x + 9 * s, y - 9 * c)], "b2", True)
    p.dot((x, y), 11, "b1")
    p.dot((x, y), 3)


def joint_spring(p, loop):
    hinge(p, 116, 112)
    p.path([(116 + (12 + 2.1 * t / 60) * math.cos(math.radians(t)), 112 - (12 + 2.1 * t / 60) * math.sin(math.radians(t)))
            for t in range(-90, 749, 15)], "")
    p.axis((152, 112), (262, 112), "rest", shift=(8, 14))
    flat_turn(p, (116, 112), 96, 2, 26)
    p.text((220, 92), "q − r", "i m", "start", shift=(2, 4))


def arc(p, centre, radius, begin, end, style=""):
    p.path([(centre[0] + radius * math.cos(math.radians(begin + (end - begin) * k / 16)),
             centre[1] - radius * math.sin(math.radians(begin + (end - begin) * k / 16))) for k in range(17)], style)


def joint_damper(p, loop):
    c = (130, 120)
    hinge(p, *c)
    arc(p, c, 36, 34, 146)
    for radius in (28, 44):
        arc(p, c, radius, 122, 196)
    for t, low, high in ((146, 30, 42), (196, 28, 44)):
        u = (math.cos(math.radians(t)), -math.sin(math.radians(t)))
        p.path([(c[0] + low * u[0], c[1] + low * u[1]), (c[0] + high * u[0], c[1] + high * u[1])], "")
    arc(p, c, 36, 196, 250)
    flat_turn(p, c, 100, 34, 56)
    p.text((202, 36), "v", "i m", shift=(-6, -2))
    flat_turn(p, c, 76, 62, 36, "f")
    p.text((160, 50), "c v", "i f", "end", shift=(0, 4))


def axes_of_graph(p, origin, right, top, x, y, left=None, bottom=None):
    p.arrow((left if left is not None else origin[0], origin[1]), (right, origin[1]), "n")
    p.arrow((origin[0], bottom if bottom is not None else origin[1]), (origin[0], top), "n")
    p.text((right, origin[1] + 15), x, "i", "end")
    p.text((origin[0] + 8, top + 10), y, "i", "start")


def joint_friction(p, loop):
    axes_of_graph(p, (150, 98), 296, 14, "v", "−force", 18, 182)

    def law(v):
        return 30 * math.tanh(v / 4) * (1 + 0.9 * math.exp(-abs(v) / 22)) + 0.14 * v
    p.path([(150 + v, 98 - law(v)) for v in range(-126, 127, 3)], "m")
    p.path([(150, 98 - 30), (280, 98 - 30 - 0.14 * 130)], "axis")
    p.path([(143, 98 - law(9)), (164, 98 - law(9))], "thin")
    p.text((138, 98 - law(9) + 5), "S", "i", "end")
    p.text((138, 98 - 30 + 7), "C", "i", "end")
    p.text((240, 40), "C + c v", "i")


def joint_limit(p, loop):
    axes_of_graph(p, (160, 112), 304, 14, "q", "force", 16, 186)
    p.path([(30, 40), (82, 112), (238, 112), (290, 184)], "m")
    for x, name in ((82, "lower"), (238, "upper")):
        p.path([(x, 106), (x, 118)], "")
        p.text((x, 134 if x < 160 else 102), name, "i")
    p.text((66, 60), "k", "i", "start")


def motor(p, loop):
    hinge(p, 112, 116, 30, 126)
    p.dot((112, 116), 24, "p1")
    p.text((112, 121), "M", "")
    flat_turn(p, (112, 116), 44, -20, 120, "f")
    p.text((168, 122), "f(t)", "i f", "start", shift=(-2, 4))


def servo(p, loop):
    x, y = 116, 132
    hinge(p, x, y, 22, 126)
    p.dot((x, y), 24, "p1")
    p.text((x, y + 5), "M", "")
    target = (x + 150 * math.cos(math.radians(52)), y - 150 * math.sin(math.radians(52)))
    p.axis((x + 20, y - 26), target, "r(t)", shift=(16, 8))
    flat_turn(p, (x, y), 100, 26, 50)
    p.text((212, 70), "r − q", "i m", "start")
    flat_turn(p, (x, y), 44, 70, 165, "f")
    p.text((74, 92), "force", "i f", "end")


def force(p, loop):
    p.box((0, -0.2, -0.25), (0.9, 1.3, 0.8), "b")
    corner = (0.45, 0.45, 0.15)
    p.arrow(corner, add(corner, (0, 1.15, 0.75)), "f")
    p.dot(corner)
    p.text(add(corner, (0, 1.15, 0.75)), "f(t)", "i f", shift=(4, -8))
    p.text(corner, "at", "i", shift=(-10, -6))


def torque(p, loop):
    p.box((0, 0, -0.3), (0.9, 1.5, 0.7), "b")
    p.axis((0, 0, 0.05), (0, 0, 1.35))
    p.arrow((0, 0, 0.05), (0, 0, 1.2), "f")
    p.arrow((0, 0, 0.05), (0, 0, 1.05), "f")
    p.turn((0, 0, 0.6), Z, 0.42, -150, 110, "f", start=X)
    p.text((0, 0, 1.2), "m(t)", "i f", shift=(22, 4))


def drag(p, loop):
    for k, y in enumerate((40, 62, 130, 152)):
        bend = (-9, -17, 17, 9)[k]
        p.path([(20 + x, y + bend * math.exp(-((x - 132) / 44) ** 2)) for x in range(0, 277, 8)], "hatch")
    p.dot((152, 96), 32, "b2")
    p.arrow((184, 96), (270, 96))
    p.text((272, 88), "v", "i m", shift=(-8, -2))
    p.arrow((120, 96), (46, 96), "f")
    p.text((60, 88), "drag", "i f", shift=(0, -2))
    p.dot((152, 96))


def attraction(p, loop):
    p.dot((82, 112), 34, "p2")
    p.dot((242, 76), 22, "b2")
    p.path([(82, 112), (242, 76)], "axis")
    p.arrow((82, 112), (138, 99.4), "f")
    p.arrow((242, 76), (190, 87.7), "f")
    p.dot((82, 112))
    p.dot((242, 76))
    p.dimension((90, 152), (250, 116), "d", shift=(6, 16))


def contact(p, loop):
    p.path([(18, 122), (302, 122), (302, 172), (18, 172)], "plane", True)
    p.ground((18, 122), (302, 122))
    p.dot((150, 82), 54, "b2")
    p.path([(18, 122), (302, 122)], "axis")
    p.path([(150, 136), (222, 136)], "thin")
    p.arrow((214, 164), (214, 137), "n")
    p.arrow((214, 96), (214, 121), "n")
    p.text((224, 133), "x", "i", "start")
    p.arrow((150, 122), (150, 30), "f")
    p.text((142, 24), "normal force", "i f", "end")
    p.arrow((150, 122), (92, 122), "f")
    p.text((88, 114), "friction", "i f", "end")
    p.arrow((262, 122), (262, 66), "n")
    p.text((262, 58), "n", "i")
    p.dimension((150, 82), (188, 44), "")
    p.text((194, 40), "r", "i", "start")
    p.dot((150, 82))


def expression(p, loop):
    axes_of_graph(p, (160, 98), 304, 14, "u", "force", 16, 186)
    p.path([(160 + x, 98 - 34 * math.sin(x / 24) - 0.000012 * x ** 3) for x in range(-130, 131, 3)], "m")
    p.text((226, 34), "f(t, u, ...)", "i", "start")


def thrust(p, loop):
    p.path([(150, 40), (250, 40), (284, 72), (250, 104), (150, 104)], "b2", True)
    p.path([(150, 52), (132, 40), (132, 104), (150, 92)], "b2", True)
    for y in (54, 72, 90):
        p.arrow((126, y), (44, y), "n")
    p.text((60, 38), "u, − m'(t)", "i", "start")
    p.dot((200, 72))
    p.arrow((200, 72), (300, 72), "f")
    p.text((272, 128), "m'(t) u", "i f")


EFFECTS = [spring, bushing, joint_spring, joint_damper, joint_friction, joint_limit, motor, servo, force, torque, drag,
           attraction, contact, expression, thrust]
