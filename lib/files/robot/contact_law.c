/* The law of a contact, from the numbers that MuJoCo has for it.
 *
 * MuJoCo's contact is an acceleration -b v - d k x of the surfaces. Its impedance d(x) acts against the mobility A of
 * the touching body. At rest under a force N, the depth x follows from
 *     A N (1 - d) / d = k d x.
 * Under a friction force T the contact creeps, with the `impratio` r, at the speed
 *     v = A T (1 - d) / (d b r).
 * For a pyramidal cone, the first factor applies to v, and the second factor applies to A N:
 *     f1 = 1 + mu^2,   f2 = (1 + mu^2) mu^2 / ((condim - 1) r),
 * since 2 (condim - 1) edges carry N, each with the compliance 2 (1 + mu^2) mu^2 / r of a contact without friction, and
 * two of them carry T. Torsional and rolling friction (condim 4 and 6) are moments of an arm times N, which build up
 * over the angular velocity at which the surface of the shape moves at v.
 *
 * A contact of the library has the force
 *     N = K x^m (1 + 3/2 c x').
 * It has MuJoCo's depth x1 under an eighth of the robot's weight, and MuJoCo's depth x2 under half of it. Damping and
 * creep equal MuJoCo's at x1. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/robot_contact.h"

#include <math.h>
#include <string.h>

/* The least mobility, relative to that of the whole robot. A body that turns about its centre of mass has zero
 * mobility. */
static const double mobility_least = 0.01;

kt_contact_law kt_contact_law_standard(void) {
    return (kt_contact_law){.friction = 1.0,
                            .torsion = 0.005,
                            .rolling = 0.0001,
                            .condim = 3.0,
                            .mix = 1.0,
                            .reference = {0.02, 1.0},
                            .impedance = {0.9, 0.95, 0.001, 0.5, 2.0}};
}

/* A time constant and a damping ratio are above zero, a stiffness and a damping are not. */
bool kt_contact_law_settle(kt_contact_law *law) {
    const bool is_mixed = (law->reference[0] > 0.0) != (law->reference[1] > 0.0);
    if (is_mixed)
        memcpy(law->reference, kt_contact_law_standard().reference, sizeof law->reference);
    return !is_mixed;
}

/* d(x), which rises from the first to the second number within the third. */
static double impedance_at(const kt_contact_law *l, double x) {
    const double *p = l->impedance, middle = fmin(fmax(p[3], 1e-4), 0.9999), power = fmax(p[4], 1.0);
    const double low = fmin(fmax(p[0], 1e-4), 0.9999), high = fmin(fmax(p[1], 1e-4), 0.9999);
    const double part = p[2] > 0.0 ? fmin(x / p[2], 1.0) : 1.0;
    const double share = part <= middle ? pow(part, power) / pow(middle, power - 1.0)
                                        : 1.0 - pow(1.0 - part, power) / pow(1.0 - middle, power - 1.0);
    return low + share * (high - low);
}

/* k and b, by a time constant and a damping ratio, or by their own numbers below zero. */
static void spring_of(const kt_contact_law *l, double shortest, double *k, double *b) {
    const double most = fmin(fmax(l->impedance[1], 1e-4), 0.9999), time = fmax(l->reference[0], shortest);
    const bool is_direct = l->reference[0] <= 0.0;
    *k = is_direct ? -l->reference[0] / (most * most)
                   : 1.0 / (most * most * time * time * l->reference[1] * l->reference[1]);
    *b = is_direct ? -l->reference[1] / most : 2.0 / (most * time);
}

/* The depth under a force, by halving: k d^2 x / (1 - d) rises with x. */
static double depth_under(const kt_contact_law *l, double k, double mobility, double force) {
    double low = 0.0, high = 1e3;
    for (int i = 0; i < 100; i++) {
        const double x = 0.5 * (low + high), d = impedance_at(l, x);
        if (k * d * d * x < (1.0 - d) * mobility * force)
            low = x;
        else
            high = x;
    }
    return high;
}

double kt_contact_law_yield(const kt_contact_law *law, double shortest, double mobility, double force,
                            double *stiffness, double *damping) {
    double k, b;
    spring_of(law, shortest, &k, &b);
    const double x = depth_under(law, k, mobility, force), d = impedance_at(law, x);
    *stiffness = k * d * d / ((1.0 - d) * mobility);
    *damping = b * d / ((1.0 - d) * mobility);
    return d;
}

/* A distance of the surface of a shape from its centre. */
static double extent_of(const kt_contact_shape *shape) {
    double most = shape->solid == KT_SOLID_BOX || shape->solid == KT_SOLID_ELLIPSOID
                      ? fmax(shape->size[0], fmax(shape->size[1], shape->size[2]))
                      : shape->size[0];
    for (int i = 0; shape->solid == KT_SOLID_NONE && i < shape->point_count; i++)
        most = fmax(most, kt_vec3_norm(shape->points[i]));
    return most > 0.0 ? most : 1.0;
}

/* K, m, c, mu and v0, and the moments. */
void kt_contact_law_apply(const kt_contact_law *law, const kt_contact_cone *cone, double gravity,
                          kt_contact_shape *shape) {
    const double mass = shape->mass, weight = mass * (gravity > 0.0 ? gravity : 9.81);
    const double a = fmax(shape->mobility, mobility_least / mass);
    const double mu = law->condim > 1.0 ? law->friction : 0.0,
                 edges = cone->is_pyramid && mu > 0.0 ? 1.0 + mu * mu : 1.0;
    const double across = edges > 1.0 ? edges * mu * mu / ((law->condim - 1.0) * cone->ratio) : 1.0;
    double k, b;
    spring_of(law, cone->shortest, &k, &b);
    const double x1 = depth_under(law, k, across * a, weight / 8.0), d = impedance_at(law, x1);
    const double x2 = depth_under(law, k, across * a, weight / 2.0);
    shape->exponent = fmax(1.0, log(4.0) / log(x2 / x1));
    shape->stiffness = weight / 8.0 / pow(x1, shape->exponent);
    shape->dissipation = fabs(2.0 * b / (3.0 * k * d * x1));
    shape->friction = mu;
    shape->torsion = law->condim >= 4.0 ? law->torsion : 0.0;
    shape->rolling = law->condim >= 6.0 ? law->rolling : 0.0;
    shape->slip = fmax(1e-6, mu * weight / 8.0 * edges * a * (1.0 - d) / (d * b * cone->ratio));
    shape->turn = shape->slip / extent_of(shape);
}
