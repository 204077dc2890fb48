"""Draws the pictures of joints, loops and effects that types.md shows, and those of other pages: one SVG each, from the table at the end.
Effects are in draw_effects.py.

draw.py FOLDER [NAME...]      writes FOLDER/NOUN-TYPE.svg (all, or those named)

The first body (a parent, the first end) is grey, the second blue, motions are orange, forces green, axes dashed and
dotted, and hatching stands for the world. Lengths in scenes are in units of 60 pixels.
"""
# SPDX-License-Identifier: Apache-2.0
import math
import pathlib
import sys

sys.dont_write_bytecode = True  # nothing is left among the pages
from draw_effects import EFFECTS
from picture import ELEVATION, X, Y, Z, Picture, about, add, cross, flat_box, flat_turn, names, scale, unit


# ---- pairs: what a joint leaves free between a body and its parent, and a loop between two ends ----------------------

def base(p, loop):
    """A plate under the first body."""
    p.box((0, 0, -0.75), (1.5, 1.9, 0.14), "p")


def fixed(p, loop):
    p.box((0, -0.55, 0), (0.7, 1.1, 0.7), "p")
    p.box((0, 0.62, 0), (0.5, 1.24, 0.5), "b")
    for k in range(8):
        s = 0.25 - 0.5 * k / 7
        p.path([(s, 0.0, 0.32), (s, 0.1, 0.25)], "thin")
        p.path([(0.32, 0.0, s), (0.25, 0.1, s)], "thin")
    names(p, loop, (64, 92), (248, 86))


def revolute(p, loop):
    base(p, loop)
    p.cylinder((0, 0, -0.68), Z, 0.42, 0.55, "p")
    p.cylinder((0, 0, -0.13), Z, 0.42, 0.38, "b")
    p.bar((0.0, 0.34, 0.06), (0.0, 1.7, 0.06), 0.34, "b", 0.2)
    p.axis((0, 0, 0.25), (0, 0, 1.15), "axis", shift=(18, 4))
    p.turn((0, 0, 0.62), Z, 0.42, -150, 95, start=X)
    p.coordinate((0, 0.42, 0.62), "q", loop, shift=(12, 0))
    names(p, loop, (72, 168), (252, 90))


def prismatic(p, loop):
    p.box((0, 0, -0.12), (0.44, 3.1, 0.2), "p")
    for y in (-1.55, 1.55):
        p.box((0, y, -0.3), (0.6, 0.16, 0.6), "p")
    p.axis((0, 1.63, -0.12), (0, 2.25, -0.12), "axis", shift=(4, -8))
    p.box((0, -0.1, 0.0), (0.72, 0.9, 0.56), "b")
    p.arrow((0, -0.85, 0.62), (0, 0.7, 0.62))
    p.coordinate((0, 0.0, 0.62), "q", loop, shift=(0, -7))
    names(p, loop, (60, 140), (234, 92))


def screw(p, loop):
    p.axis((0, 0, 1.2), (0, 0, 1.5), "axis", shift=(20, 4))
    base(p, loop)
    p.cylinder((0, 0, -0.68), Z, 0.22, 1.88, "p")
    p.helix((0, 0, -0.66), Z, 0.225, 1.8, 15, "thin")
    p.cylinder((0, 0, -0.1), Z, 0.5, 0.42, "b")
    p.path(p.circle_points((0, 0, 0.32), Z, 0.22, count=20), "p1", True)
    p.cylinder((0, 0, 0.32), Z, 0.22, 0.88, "p")
    p.helix((0, 0, 0.36), Z, 0.225, 0.8, 6.7, "thin")
    p.turn((0, 0, 0.55), Z, 0.6, -120, 85, start=X)
    p.coordinate((0, 0.6, 0.55), "q", loop, shift=(14, 0))
    p.arrow((0, 0.95, -0.1), (0, 0.95, 0.5))
    p.coordinate((0, 0.95, 0.15), "pitch · q", loop, "start", shift=(8, 6))
    names(p, loop, (58, 166), (96, 96))


def cylindrical(p, loop):
    p.cylinder((0, -1.5, 0), Y, 0.2, 3.2, "p")
    p.box((0, -1.5, -0.2), (0.5, 0.22, 0.9), "p")
    p.axis((0, 1.7, 0), (0, 2.25, 0), "axis", shift=(0, -8))
    p.cylinder((0, -0.45, 0), Y, 0.42, 0.9, "b")
    p.path(p.circle_points((0, 0.45, 0), Y, 0.2, count=20), "p1", True)
    p.cylinder((0, 0.45, 0), Y, 0.2, 1.25, "p")
    p.turn((0, 0.85, 0), Y, 0.5, 20, 235, start=X)
    p.coordinate((0, 0.85, 0.5), "q_1", loop, shift=(14, -6))
    p.arrow((0, -0.5, 0.75), (0, 0.5, 0.75))
    p.coordinate((0, -0.1, 0.75), "q_2", loop, shift=(-6, -7))
    names(p, loop, (66, 156), (146, 172))


def planar(p, loop):
    p.box((0, 0, -0.3), (2.4, 3.0, 0.12), "p")
    p.box((-0.1, 0.1, -0.03), (0.8, 0.9, 0.42), "b")
    p.axis((-0.1, 0.1, 0.18), (-0.1, 0.1, 1.15), "axis", shift=(18, 4))
    p.turn((-0.1, 0.1, 0.62), Z, 0.36, -150, 90, start=X)
    p.coordinate((-0.1, 0.5, 0.62), "q_3", loop, shift=(12, 2))
    p.arrow((0.3, 0.0, -0.24), (0.9, 0.0, -0.24))
    p.coordinate((0.9, 0.0, -0.24), "q_1", loop, shift=(13, 10))
    p.arrow((0.1, 0.55, -0.24), (0.1, 1.2, -0.24))
    p.coordinate((0.1, 1.2, -0.24), "q_2", loop, shift=(6, -9))
    names(p, loop, (262, 174), (74, 80))


def universal(p, loop):
    # the first yoke, below, holds the arm of the cross along x; the second, above, that along y
    p.axis((-1.35, 0, 0), (-0.6, 0, 0))
    p.box((-0.5, 0, -0.28), (0.14, 0.34, 0.85), "p")
    p.box((0, 0, -0.72), (1.14, 0.34, 0.14), "p")
    p.cylinder((0, 0, -1.25), Z, 0.17, 0.5, "p")
    p.cylinder((-0.43, 0, 0), X, 0.1, 0.86, "p")
    p.box((0, -0.5, 0.28), (0.34, 0.14, 0.85), "b")
    p.cylinder((0, -0.43, 0), Y, 0.1, 0.86, "p")
    p.box((0.5, 0, -0.28), (0.14, 0.34, 0.85), "p")
    p.box((0, 0.5, 0.28), (0.34, 0.14, 0.85), "b")
    p.box((0, 0, 0.72), (0.34, 1.14, 0.14), "b")
    p.cylinder((0, 0, 0.79), Z, 0.17, 0.5, "b")
    p.axis((0.58, 0, 0), (1.6, 0, 0), "axis", shift=(-8, 14))
    p.axis((0, 0.58, 0), (0, 1.75, 0), "axis2", shift=(12, 14))
    p.axis((0, -0.58, 0), (0, -1.3, 0))
    p.turn((1.05, 0, 0), X, 0.3, -60, 150, start=Y)
    p.coordinate((1.05, 0, 0.34), "q_1", loop, shift=(-28, -4))
    p.turn((0, 1.05, 0), Y, 0.3, -60, 150, start=Z)
    p.coordinate((0, 1.05, 0.34), "q_2", loop, shift=(10, -6))
    names(p, loop, (112, 178), (222, 38))


def spherical(p, loop):
    base(p, loop)
    p.cylinder((0, 0, -0.68), Z, 0.2, 0.3, "p")
    r, x, y = 0.47 * p.size, *p.at((0, 0, 0))
    bowl = [(x + r * math.cos(math.radians(t)), y + r * math.sin(math.radians(t))) for t in range(0, 181, 12)]
    flat = math.sin(ELEVATION)
    p.path([*bowl, *[(x - r * math.cos(math.radians(t)), y - flat * r * math.sin(math.radians(t))) for t in range(0, 181, 12)]],
           "p3", True)
    p.ball((0, 0, 0.05), 0.37, "b")
    p.path([*bowl, *[(x - r * math.cos(math.radians(t)), y + flat * r * math.sin(math.radians(t))) for t in range(0, 181, 12)]],
           "p2", True)
    tip = scale(1.65, unit((0, 0.75, 0.8)))
    p.cylinder(add((0, 0, 0.05), scale(0.35, unit((0, 0.75, 0.8)))), (0, 0.75, 0.8), 0.13, 1.3, "b")
    p.turn((0, 0, 0.05), Z, 0.95, 150, 235, start=X, both=True)
    p.turn((0, 0, 0.05), X, 1.0, 100, 160, start=Y, both=True)
    p.turn(scale(0.82, tip), tip, 0.32, -60, 160, start=X)
    p.coordinate((96, 50), "q", loop)
    names(p, loop, (78, 170), (264, 50))


def free(p, loop):
    p.frame((0, -1.75, -0.75), 0.5)
    p.box((0, 0.5, 0), (0.62, 0.8, 0.5), "b")
    for axis, begin, angle in ((X, 0.31, Y), (Y, 0.4, Z), (Z, 0.25, X)):
        p.arrow(add((0, 0.5, 0), scale(begin, axis)), add((0, 0.5, 0), scale(1.15, axis)))
        p.turn(add((0, 0.5, 0), scale(0.78, axis)), axis, 0.22, -60, 190, start=angle)
    p.text((0, -1.75, -0.75), "parent", "a", shift=(4, 34))
    p.text((150, 78), "body", "a")


# ---- other loops ------------------------------------------------------------------------------------------------------

def two_blocks(p, first, second, turn=lambda u: u, size=(0.5, 0.6, 0.5)):
    p.box(first, size, "p")
    p.box(second, size, "b", turn)


def parallel(p, loop):
    two_blocks(p, (0, -0.95, -0.3), (0, 0.95, 0.35))
    p.frame((0, -0.95, -0.05), 0.72)
    p.frame((0, 0.95, 0.6), 0.72)
    names(p, loop, (104, 178), (226, 152))


def orthogonal(p, loop):
    two_blocks(p, (0, -0.95, -0.35), (0, 0.95, 0.1))
    p.axis((0, -0.95, -0.1), (0, -0.95, 1.05), "axis", shift=(-20, 8))
    p.axis((0, 0.65, 0.1), (0, -0.95, 0.1))
    p.axis((0, 1.25, 0.1), (0, 1.95, 0.1), "axis2", shift=(2, -8))
    p.path([(0, -0.75, 0.1), (0, -0.75, 0.3), (0, -0.95, 0.3)], "m")
    names(p, loop, (104, 180), (226, 158))


def coaxial(p, loop):
    def tilt(u):
        return about(Z, math.radians(35), u)
    two_blocks(p, (0, -0.95, -0.35), (0, 0.95, 0.1), tilt)
    p.axis((0, -0.95, -0.1), (0, -0.95, 1.1), "axis", shift=(-20, 8))
    p.axis((0, 0.95, 0.35), (0, 0.95, 1.45), "axis", shift=(22, 8))
    p.turn((0, 0.95, 0.85), Z, 0.3, -150, 100, start=X)
    p.text((164, 30), "parallel", "a")
    names(p, loop, (104, 180), (230, 156))


def inline(p, loop):
    p.axis((0, -2.2, 0), (0, 2.3, 0), "axis", shift=(-6, -8))
    p.box((0, 0, -0.2), (0.5, 3.0, 0.14), "p")
    p.path([(0.1, -1.3, -0.13), (0.1, 1.3, -0.13), (-0.1, 1.3, -0.13), (-0.1, -1.3, -0.13)], "p3", True)
    p.bar((0, 0.2, 0.0), (-0.4, 0.9, 1.1), 0.2, "b")
    p.ball((0, 0.2, 0), 0.13, "b")
    p.arrow((0, -0.85, 0.22), (0, 0.85, 0.22), both=True)
    names(p, loop, (84, 160), (262, 44))


def inplane(p, loop):
    p.box((0, -0.2, -0.35), (0.5, 0.6, 0.5), "p")
    p.path([(1.25, -1.6, 0), (1.25, 1.6, 0), (-1.25, 1.6, 0), (-1.25, -1.6, 0)], "plane", True)
    p.axis((0, -0.2, 0), (0, -0.2, 1.1), "axis", shift=(-20, 8))
    p.arrow((0.1, 0.95, 0), (0.85, 0.95, 0))
    p.arrow((0.1, 0.95, 0), (0.1, 1.75, 0))
    p.bar((0, 0.85, 0.1), (-0.3, 1.3, 1.1), 0.2, "b")
    p.ball((0, 0.85, 0.08), 0.11, "b")
    names(p, loop, (66, 160), (280, 48))


def distance(p, loop):
    two_blocks(p, (0, -1.2, -0.35), (0, 1.15, 0.3), size=(0.55, 0.75, 0.55))
    a, b = p.at((0.27, -1.0, -0.2)), p.at((0.27, 1.0, 0.35))
    p.path([a, b], "m")
    p.dot(a)
    p.dot(b)
    p.dimension((a[0] - 6, a[1] - 22), (b[0] - 6, b[1] - 22), "length", shift=(-4, -7))
    names(p, loop, (90, 178), (244, 158))


def gear(p, centre, radius, teeth, kind, phase):
    points = []
    for k in range(teeth):
        for out, part in ((-3.5, -0.30), (3.5, -0.16), (3.5, 0.16), (-3.5, 0.30)):
            t = 2 * math.pi * (k + part + phase) / teeth
            points.append((centre[0] + (radius + out) * math.cos(t), centre[1] - (radius + out) * math.sin(t)))
    p.path(points, f"{kind}2", True)
    p.dot(centre, 0.28 * radius, f"{kind}1")
    p.dot(centre, 2.6)


def coupling(p, loop):
    gear(p, (196, 88), 60, 24, "b", 0.5)
    gear(p, (106, 88), 30, 12, "p", 0.0)
    flat_turn(p, (106, 88), 43, 100, 200)
    flat_turn(p, (196, 88), 74, 65, 15)
    p.text((60, 54), "q_1", "i m")
    p.text((276, 54), "q_2", "i m")
    p.text((160, 183), "c_1 q_1 + c_2 q_2 = offset", "i")


def motion(p, loop):
    p.path([(64, 92), (52, 122), (76, 122)], "p2", True)
    p.ground((40, 122), (90, 122))
    p.parts.append('<path class="b2" d="M59 86L115 46a8 8 0 0 1 10 13L70 98a9 9 0 0 1-11-12z"/>')
    p.dot((64, 92), 4.5, "p1")
    p.axis((70, 92), (146, 92))
    flat_turn(p, (64, 92), 62, 0, 31)
    p.text((138, 76), "q", "i m")
    for tip in ((292, 140), (176, 32)):
        p.arrow((176, 140), tip, "n")
    p.text((292, 156), "t", "i")
    p.text((186, 40), "q = f(t)", "i", "start")
    p.path([(176, 128), (200, 128), *[(200 + 52 * s, 128 - 62 * (3 * s * s - 2 * s ** 3)) for s in (k / 14 for k in range(15))],
            (282, 66)], "m")


def rolling(p, loop):
    p.centre = (150, 88)
    p.path([(1.1, -1.8, -0.72), (1.1, 1.9, -0.72), (-1.1, 1.9, -0.72), (-1.1, -1.8, -0.72)], "plane", True)
    p.path([(0.09, -1.7, -0.72), (0.09, 0.1, -0.72)], "axis")
    p.axis((0, 0.1, 0), (-0.95, 0.1, 0))
    p.cylinder((-0.09, 0.1, 0), X, 0.72, 0.18, "b", hole=0.1)
    p.axis((0.09, 0.1, 0), (1.15, 0.1, 0), "axis", shift=(-16, 4))
    p.turn((0.12, 0.1, 0), X, 0.92, 150, 65, start=Y)
    p.arrow((0, 0.95, 0), (0, 1.7, 0))
    p.dot((0.09, 0.1, -0.72))
    p.arrow(p.at((0.09, 0.1, 0)), p.at((0.09, 0.1, -0.7)), "n", both=True)
    p.path([add((0.09, 0.1, -0.3), (0, 0.0, 0)), (0.09, 1.0, -0.42)], "thin")
    p.text((0.09, 1.0, -0.42), "radius", "i", "start", shift=(4, 6))
    p.text((60, 176), "plane (first)", "a")
    p.text((228, 28), "wheel (second)", "a")


def knife_edge(p, loop):
    p.path([(1.25, -1.7, -0.45), (1.25, 1.7, -0.45), (-1.25, 1.7, -0.45), (-1.25, -1.7, -0.45)], "plane", True)
    p.path([(0, -0.75, -0.45), (0, 0.75, -0.45), (0, 0.95, -0.25), (0, 0.75, -0.1), (0, -0.75, -0.1)], "b1", True)
    p.box((0, 0, 0.05), (0.34, 1.3, 0.3), "b")
    p.arrow((0, 1.0, -0.45), (0, 1.85, -0.45))
    p.axis((0, 0, -0.28), (1.35, 0, -0.28), "axis", shift=(-10, 14))
    p.path([(0.62, -0.14, -0.28), (0.9, 0.14, -0.28)], "m")
    p.path([(0.62, 0.14, -0.28), (0.9, -0.14, -0.28)], "m")
    names(p, loop, (286, 176), (120, 60))


def rates(p, loop):
    gear(p, (196, 88), 60, 24, "b", 0.5)
    gear(p, (106, 88), 30, 12, "p", 0.0)
    flat_turn(p, (106, 88), 43, 100, 200)
    flat_turn(p, (196, 88), 74, 65, 15)
    p.text((60, 54), "v_1", "i m")
    p.text((276, 54), "v_2", "i m")
    p.text((160, 183), "c_1 v_1 + c_2 v_2 = f(t)", "i")


def homokinetic(p, loop):
    def shaft(u):
        return about(X, math.radians(38), u)
    p.axis((0, -2.2, 0), (0, -1.7, 0))
    p.cylinder((0, -1.7, 0), Y, 0.17, 1.5, "p")
    p.cylinder((0, -0.35, 0), Y, 0.46, 0.5, "p", hole=0.36)
    p.ball((0, 0.12, 0.04), 0.3, "b")
    p.cylinder(shaft((0, 0.3, 0)), shaft(Y), 0.15, 1.45, "b")
    p.axis(shaft((0, 1.78, 0)), shaft((0, 2.25, 0)), "axis", shift=(16, 6))
    p.turn((0, -1.1, 0), Y, 0.42, 30, 230, start=X)
    p.turn(shaft((0, 1.1, 0)), shaft(Y), 0.42, 30, 230, start=X)
    p.text((0, -1.1, 0.42), "q", "i m", shift=(-4, -8))
    p.text(shaft((0, 1.1, 0.42)), "q", "i m", shift=(-8, -8))
    names(p, loop, (60, 172), (270, 110))


def surface(p, loop):
    R, tube = 1.25, 0.42
    for radius, height in ((R + tube, 0.0), (R, tube), (R - tube, 0.0)):
        p.path(p.circle_points((0, 0, height), Z, radius, count=48), "thin", True)
    for k in range(12):
        out = about(Z, math.radians(30 * k), X)
        p.path(p.circle_points(scale(R, out), cross(Z, out), tube, count=20), "thin", True)
    p.axis((0, 0, -0.2), (0, 0, 1.25), "axis", shift=(18, 4))
    at = add(scale(R, about(Z, math.radians(55), X)), (0, 0, tube))
    p.arrow(at, add(at, scale(0.75, about(Z, math.radians(145), X))))
    p.arrow(at, add(at, scale(0.6, about(Z, math.radians(55), X)), (0, 0, -0.25)))
    p.ball(add(at, (0, 0, 0.08)), 0.12, "b")
    names(p, loop, (48, 176), (256, 62))


def curve(p, loop):
    points = [(0.3, -2.2 + 4.2 * s, -0.5 + 1.1 * math.sin(3.6 * s) + 0.5 * s) for s in (k / 40 for k in range(41))]
    p.ground((20, 150), (60, 150))
    p.path([(40, 150), p.at(points[0])], "thin")
    p.path(points, "")
    at = points[17]
    p.bar(at, add(at, (-0.2, 0.35, 0.9)), 0.16, "b")
    p.ball(at, 0.13, "b")
    p.path([add(q, (0, 0, -0.2)) for q in points[1:16]], "m")
    p.head(p.at(add(points[16], (0, 0, -0.2))), (9, -3), "m")
    p.text(add(points[8], (0, 0, -0.45)), "sigma", "i m", shift=(14, 8))
    names(p, loop, (74, 172), (222, 34))


# ---- other pages -----------------------------------------------------------------------------------------------------

def reactions(p, _):
    """What acts on a body in its joint: three parts of the wrench."""
    pivot = (92, 112)

    p.path([(88, 101), (296, 60), (300, 76), (96, 123)], "b2", True)
    p.dot(pivot, 15, "b3")
    p.dot(pivot, 7, "card")
    p.text((284, 96), "arm", "a")
    p.arrow(pivot, (48, 58), "f")
    p.text((12, 34), "bearing.arm", "f", "start")
    p.text((12, 50), "fx fy fz mx my", "i f", "start")
    flat_turn(p, pivot, 30, 60, 320)
    p.text((136, 146), "effect.spring.torque", "m", "start")
    flat_turn(p, pivot, 46, 75, 295)
    p.text((126, 42), "reaction.drive.multiplier", "m", "start")
    p.path([(124, 46), (106, 66)], "thin")
    p.path([(134, 142), (117, 134)], "thin")
    p.text((160, 178), "reaction.arm: all of these together", "")


def crane(p, _):
    """A crane as an FMU: what goes into the archive, and what comes out."""
    left, right, top, bottom, trolley, hook = 92, 216, 14, 164, (140, 52), (174, 118)
    p.path([(left, top), (right, top), (right, bottom), (left, bottom)], "axis", True)
    p.text((0.5 * (left + right), bottom + 18), "crane.fmu", "")
    p.path([(left + 8, 60), (right - 8, 60)], "")
    for x in (left + 8, right - 8):
        p.path([(x, 55), (x, 65)], "")
    p.ground((left + 8, 60), (right - 8, 60))
    p.path([trolley, hook], "")
    flat_box(p, trolley[0] - 16, 44, 32, 16, "p")
    p.dot(trolley)
    p.dot(hook, 15, "b2")
    p.text((hook[0], hook[1] + 32), "load", "i")
    p.path([trolley, (trolley[0], 128)], "axis")
    flat_turn(p, trolley, 46, 270, 296)
    p.arrow((12, 52), (trolley[0] - 18, 52), "f")
    p.text((8, 44), "input.trolley", "f", "start")
    for y, words in ((52, "position.trolley"), (92, "position.rope"), (132, "velocity.rope")):
        p.arrow((right, y), (312, y))
        p.text((right + 5, y - 8), words, "m", "start")


def gear_loop(p, loop):
    gear(p, (106, 88), 30, 12, "p", 0.0)
    gear(p, (196, 88), 60, 24, "b", 0.5)
    p.axis((60, 88), (276, 88))
    p.dot((136, 88), 3)
    p.arrow((136, 88), (154, 38), "f")
    p.text((142, 36), "F", "i f")
    flat_turn(p, (106, 88), 43, 190, 250)
    p.text((106, 138), "r_1", "i")
    p.text((222, 104), "r_2", "i")
    p.text((160, 183), "r_1 β_1 + r_2 β_2 = constant", "i")


def rack(p, loop):
    gear(p, (160, 76), 48, 20, "p", 0.0)
    teeth = []
    for k in range(17):
        x = 32 + 16 * k
        teeth += [(x, 130), (x + 3, 120), (x + 8, 120), (x + 11, 130)]
    p.path([(32, 146), *teeth, (300, 130), (300, 146)], "b2", True)
    p.axis((24, 125), (306, 125))
    p.dot((160, 125), 3)
    flat_turn(p, (160, 76), 62, 150, 30)
    p.arrow((160, 125), (214, 143), "f")
    p.text((226, 158), "F", "i f")
    p.text((160, 183), "t · d ∓ r γ = constant", "i")


def worm(p, loop):
    gear(p, (160, 66), 48, 20, "b", 0.0)
    p.path([(60, 118), (260, 118), (260, 150), (60, 150)], "p2", True)
    for k in range(12):
        p.path([(70 + 16 * k, 150), (78 + 16 * k, 118)], "thin")
    p.axis((40, 134), (284, 134))
    p.dot((160, 116), 3)
    p.arrow((160, 116), (212, 100), "f")
    p.text((224, 98), "F", "i f")
    flat_turn(p, (160, 66), 62, 60, 120)
    p.text((160, 183), "z_1 / z_2 β_1 ± β_2 = constant", "i")


def pulley(p, at, radius, style):
    p.path([(at[0] + radius * math.cos(math.radians(10 * k)), at[1] + radius * math.sin(math.radians(10 * k))) for k in range(36)], style, True)
    p.dot(at, 3)


def rope(p, one, two, first, second, style="line"):
    """The line that leaves both circles on the left, if their radii are positive."""
    d = (two[0] - one[0], two[1] - one[1])
    a = math.hypot(*d)
    e, n, sine = (d[0] / a, d[1] / a), (d[1] / a, -d[0] / a), (first - second) / a
    along = [math.sqrt(1 - sine * sine) * e[k] - sine * n[k] for k in range(2)]
    m = (along[1], -along[0])
    p.path([(one[0] + first * m[0], one[1] + first * m[1]), (two[0] + second * m[0], two[1] + second * m[1])], style)


def span(p, loop):
    pulley(p, (80, 110), 36, "p2")
    pulley(p, (216, 58), 24, "b2")
    rope(p, (80, 110), (216, 58), 36, 24)
    p.path([(240, 58), (240, 128)], "line")
    p.path([(226, 128), (254, 128), (254, 156), (226, 156)], "b2", True)
    p.text((80, 132), "ρ_1", "i")
    p.text((216, 52), "ρ_2", "i")
    p.text((136, 50), "L", "i")
    p.text((160, 183), "L - ρ_1 χ_1 + ρ_2 χ_2 = constant", "i")


def belt(p, loop):
    pulley(p, (84, 96), 24, "p2")
    pulley(p, (220, 96), 52, "b2")
    rope(p, (84, 96), (220, 96), 24, 52)
    rope(p, (84, 96), (220, 96), -24, -52)
    flat_turn(p, (84, 96), 38, 150, 215)
    p.text((84, 90), "ρ_1", "i")
    p.text((220, 116), "ρ_2", "i")
    p.text((160, 183), "ρ_1 q_1 = ρ_2 q_2", "i")


PAIRS = [fixed, revolute, prismatic, screw, cylindrical, planar, universal, spherical, free]
LOOPS = [fixed, revolute, prismatic, screw, cylindrical, planar, universal, spherical, parallel, orthogonal, coaxial,
         inline, inplane, distance, coupling, motion, rolling, knife_edge, rates, homokinetic, surface, curve,
         gear_loop, rack, worm, span, belt]
FAMILIES = {"joint": PAIRS, "loop": LOOPS, "effect": EFFECTS, "page": [reactions, crane]}


def name_of(noun, draw):
    return "weld" if noun == "loop" and draw is fixed else draw.__name__.removesuffix("_loop")


def main():
    folder, wanted = pathlib.Path(sys.argv[1]), sys.argv[2:]
    folder.mkdir(exist_ok=True)
    for noun, draws in FAMILIES.items():
        for draw in draws:
            name = f"{noun}-{name_of(noun, draw)}"
            if wanted and name not in wanted:
                continue
            picture = Picture(name.replace("-", ": ").replace("_", " "))
            draw(picture, noun == "loop")
            (folder / f"{name}.svg").write_text(picture.svg())


if __name__ == "__main__":
    main()
