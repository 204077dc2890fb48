/* What uniform solids weigh.
 *
 * Of half sizes a, b, c, radius r and half length h, about the centre of mass:
 *   sphere     V = 4/3 pi r^3           I/m = 2/5 r^2
 *   box        V = 8 a b c              Ix/m = (b^2 + c^2) / 3
 *   ellipsoid  V = 4/3 pi a b c         Ix/m = (b^2 + c^2) / 5
 *   cylinder   V = 2 pi r^2 h           Ix/m = (3 r^2 + 4 h^2) / 12, Iz/m = r^2 / 2
 *   cone       V = 2/3 pi r^2 h         Ix/m = 3/20 (r^2 + h^2), Iz/m = 3/10 r^2, at h/2 below the middle
 *   capsule    a cylinder, and two half spheres whose centroids lie 3/8 r beyond its ends
 */
#include "import/robot.h"

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

/* The moments of a capsule of mass 1. Of its two half spheres: 2/5 m r^2 about the axis, and across it, with the
 * centroids at h + 3/8 r, 83/320 m r^2 + m (h + 3/8 r)^2 = m (2/5 r^2 + h^2 + 3/4 h r). */
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
