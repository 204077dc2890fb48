/* Volumes and moments of inertia of uniform solids.
 *
 * The half sizes are a, b, c, the radius is r, and the half length is h. Moments are about the centre of mass:
 *   sphere     V = 4/3 pi r^3           I/m = 2/5 r^2
 *   box        V = 8 a b c              Ix/m = (b^2 + c^2) / 3
 *   ellipsoid  V = 4/3 pi a b c         Ix/m = (b^2 + c^2) / 5
 *   cylinder   V = 2 pi r^2 h           Ix/m = (3 r^2 + 4 h^2) / 12, Iz/m = r^2 / 2
 *   cone       V = 2/3 pi r^2 h         Ix/m = 3/20 (r^2 + h^2), Iz/m = 3/10 r^2
 * The centre of mass of a cone is h/2 below its middle. A capsule is a cylinder and two half spheres whose centroids
 * lie 3/8 r beyond its ends.
 *
 * For shells of uniform thickness, the area A replaces the volume:
 *   sphere     A = 4 pi r^2             I/m = 2/3 r^2
 *   plate      A = 4 b c                Ix/m = (b^2 + c^2) / 3, Iy/m = a^2 + c^2 / 3
 *   barrel     A = 4 pi r h             Ix/m = r^2 / 2 + h^2 / 3, Iz/m = r^2
 *   disc       A = pi r^2               Ix/m = r^2 / 4 + h^2
 * A box is three pairs of plates; the row is for the pair at the distance a. A cylinder is a barrel and two discs at
 * its ends. A capsule is a barrel and two half spheres whose centroids lie r / 2 beyond its ends.
 *
 * The shell of an ellipsoid is that of MuJoCo. It lies between the ellipsoid and one whose half axes are longer by e:
 *     Ix/m = (B^2 + C^2 + a b c (B^2 - b^2 + C^2 - c^2) / (A B C - a b c)) / 5,  A = a + e, B = b + e, C = c + e.
 * Its area is Thomsen's approximation, A = 4 pi mean((a b)^p, (b c)^p, (c a)^p)^(1/p), p = 1.6075, within 1.1 %.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/robot.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

double kt_solid_volume(kt_solid solid, const double size[3]) {
    const double a = size[0], b = size[1], c = size[2];
    switch (solid) {
    case KT_SOLID_SPHERE:
        return 4.0 / 3.0 * pi * a * a * a;
    case KT_SOLID_CAPSULE:
        return 2.0 * pi * a * a * b + 4.0 / 3.0 * pi * a * a * a;
    case KT_SOLID_ELLIPSOID:
        return 4.0 / 3.0 * pi * a * b * c;
    case KT_SOLID_CYLINDER:
        return 2.0 * pi * a * a * b;
    case KT_SOLID_CONE:
        return 2.0 / 3.0 * pi * a * a * b;
    case KT_SOLID_BOX:
        return 8.0 * a * b * c;
    default:
        return 0.0;
    }
}

/* The moments of a capsule of mass 1. Its two half spheres have the mass m and the centroids h + 3/8 r from the middle:
 *     axial = 2/5 m r^2,
 *     across = 83/320 m r^2 + m (h + 3/8 r)^2 = m (2/5 r^2 + h^2 + 3/4 h r). */
static kt_vec3 capsule_moments(double r, double h) {
    const double ends = 2.0 * r / (2.0 * r + 3.0 * h), barrel = 1.0 - ends;
    const double across = barrel * (3.0 * r * r + 4.0 * h * h) / 12.0 + ends * (0.4 * r * r + h * h + 0.75 * h * r);
    return kt_vec3_make(across, across, barrel * r * r / 2.0 + ends * 0.4 * r * r);
}

kt_vec3 kt_solid_moments(kt_solid solid, const double size[3]) {
    const double a = size[0], b = size[1], c = size[2];
    const double across = (3.0 * a * a + 4.0 * b * b) / 12.0, slant = 0.15 * (a * a + b * b);
    switch (solid) {
    case KT_SOLID_SPHERE:
        return kt_vec3_make(0.4 * a * a, 0.4 * a * a, 0.4 * a * a);
    case KT_SOLID_CAPSULE:
        return capsule_moments(a, b);
    case KT_SOLID_ELLIPSOID:
        return kt_vec3_make((b * b + c * c) / 5.0, (a * a + c * c) / 5.0, (a * a + b * b) / 5.0);
    case KT_SOLID_CYLINDER:
        return kt_vec3_make(across, across, 0.5 * a * a);
    case KT_SOLID_CONE:
        return kt_vec3_make(slant, slant, 0.3 * a * a);
    case KT_SOLID_BOX:
        return kt_vec3_make((b * b + c * c) / 3.0, (a * a + c * c) / 3.0, (a * a + b * b) / 3.0);
    default:
        return kt_vec3_make(0.0, 0.0, 0.0);
    }
}

/* ---- shells ------------------------------------------------------------------------------------------------------ */

static const double thomsen = 1.6075, skin = 1e-6; /* the exponent; the thickness of an ellipsoid's shell, m */

double kt_shell_area(kt_solid solid, const double size[3]) {
    const double a = size[0], b = size[1], c = size[2];
    switch (solid) {
    case KT_SOLID_SPHERE:
        return 4.0 * pi * a * a;
    case KT_SOLID_CAPSULE:
        return 4.0 * pi * a * (a + b);
    case KT_SOLID_ELLIPSOID:
        return 4.0 * pi * pow((pow(a * b, thomsen) + pow(b * c, thomsen) + pow(c * a, thomsen)) / 3.0, 1.0 / thomsen);
    case KT_SOLID_CYLINDER:
        return 2.0 * pi * a * (a + 2.0 * b);
    case KT_SOLID_BOX:
        return 8.0 * (a * b + b * c + c * a);
    default:
        return 0.0;
    }
}

/* The moments of a capsule shell of mass 1. Its two half spheres have the mass m and the centroids h + r/2 from the
 * middle:
 *     axial = 2/3 m r^2,
 *     across = 5/12 m r^2 + m (h + r/2)^2 = m (2/3 r^2 + h^2 + h r). */
static kt_vec3 capsule_shell(double r, double h) {
    const double ends = r / (r + h), barrel = 1.0 - ends;
    const double across = barrel * (0.5 * r * r + h * h / 3.0) + ends * (2.0 / 3.0 * r * r + h * h + h * r);
    return kt_vec3_make(across, across, barrel * r * r + ends * 2.0 / 3.0 * r * r);
}

static kt_vec3 cylinder_shell(double r, double h) {
    const double discs = r / (r + 2.0 * h), barrel = 1.0 - discs;
    const double across = barrel * (0.5 * r * r + h * h / 3.0) + discs * (0.25 * r * r + h * h);
    return kt_vec3_make(across, across, barrel * r * r + discs * 0.5 * r * r);
}

/* The mean of the squares of x, y, z over the plates gives the moments. */
static kt_vec3 box_shell(const double size[3]) {
    const double a = size[0], b = size[1], c = size[2], plates[3] = {b * c, c * a, a * b};
    const double whole = plates[0] + plates[1] + plates[2];
    double square[3];
    for (int i = 0; i < 3; i++) /* at +-size in a third of the plates, over all its length in the others */
        square[i] = size[i] * size[i] * (plates[i] + (whole - plates[i]) / 3.0) / whole;
    return kt_vec3_make(square[1] + square[2], square[0] + square[2], square[0] + square[1]);
}

/* Differences of products are written without the terms that cancel: (A B C - a b c) / e, (B^2 - b^2) / e. */
static kt_vec3 ellipsoid_shell(const double size[3]) {
    const double a = size[0], b = size[1], c = size[2], e = skin;
    const double layer = a * b + b * c + c * a + e * (a + b + c) + e * e;
    double square[3];
    for (int i = 0; i < 3; i++)
        square[i] = ((size[i] + e) * (size[i] + e) + a * b * c * (2.0 * size[i] + e) / layer) / 5.0;
    return kt_vec3_make(square[1] + square[2], square[0] + square[2], square[0] + square[1]);
}

kt_vec3 kt_shell_moments(kt_solid solid, const double size[3]) {
    const double a = size[0];
    switch (solid) {
    case KT_SOLID_SPHERE:
        return kt_vec3_make(2.0 / 3.0 * a * a, 2.0 / 3.0 * a * a, 2.0 / 3.0 * a * a);
    case KT_SOLID_CAPSULE:
        return capsule_shell(a, size[1]);
    case KT_SOLID_ELLIPSOID:
        return ellipsoid_shell(size);
    case KT_SOLID_CYLINDER:
        return cylinder_shell(a, size[1]);
    case KT_SOLID_BOX:
        return box_shell(size);
    default:
        return kt_vec3_make(0.0, 0.0, 0.0);
    }
}
