/* The elementary motions, of which each link has one relative to its parent.
 *
 * A degree of freedom is a rotation about a unit vector, a translation along this vector, or both. Let s be the link's
 * axis and p its pitch. Let x, y, z be the axes of the link, and x0, y0, z0 these axes at rest (q = 0). The degrees of
 * freedom (angular, linear) are
 *
 *   revolute    (s, 0)
 *   prismatic   (0, s)
 *   screw       (s, p s)
 *   spherical   (x, 0)   (y, 0)   (z, 0)
 *   free        (0, x0)  (0, y0)  (0, z0)  (x, 0)  (y, 0)  (z, 0)
 *
 * Each motion is a row of KT_MOTION_LIST. The row has `velocities`, of which the first `lengths` are rates of lengths.
 * If it has an angle (`angles` is 1), its sine and cosine are computed. If `quaternions` is 1, the positions end with a
 * quaternion: four numbers for the last three velocities. A motion that is `planar` exists in a plane, about the normal
 * or along the plane. Lengths come first among the coordinates. All other properties of a motion are a function or a
 * case for each row (dynamics/joint_motion.h, dynamics/aba.h, dynamics/inertia_check.c). The compiler reports a missing
 * one.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_MOTION_H
#define KT_MODEL_MOTION_H

#include <stdbool.h>
#include <stdint.h>

/* clang-format off */
#define KT_MOTION_LIST(X)                                                                                              \
    /* id,       name,      velocities, lengths, angles, quaternions, planar */                                        \
    X(REVOLUTE,  revolute,  1,          0,       1,      0,           true)                                            \
    X(PRISMATIC, prismatic, 1,          1,       0,      0,           true)                                            \
    X(SCREW,     screw,     1,          0,       1,      0,           false)                                           \
    X(SPHERICAL, spherical, 3,          0,       0,      1,           false)                                           \
    X(FREE,      free,      6,          3,       0,      1,           false)
/* clang-format on */

typedef enum kt_motion {
    KT_MOTION_NONE = 0, /* ground only */
#define KT_MOTION_ENUM(id, name, velocities, lengths, angles, quaternions, planar) KT_MOTION_##id,
    KT_MOTION_LIST(KT_MOTION_ENUM)
#undef KT_MOTION_ENUM
} kt_motion;

typedef struct kt_motion_facts {
    int positions, velocities;
    int lengths, angles, quaternions; /* among the positions, in this order */
    int plain;                        /* lengths and angles, of which the first velocities are the rates */
    bool planar;
} kt_motion_facts;

static inline kt_motion_facts kt_motion_facts_of(kt_motion motion) {
#define KT_MOTION_ROW(id, name, v, l, a, q, p) [KT_MOTION_##id] = {(v) + (q), v, l, a, q, (l) + (a), p},
    static const kt_motion_facts facts[] = {[KT_MOTION_NONE] = {0}, KT_MOTION_LIST(KT_MOTION_ROW)};
#undef KT_MOTION_ROW
    return facts[motion];
}

enum { KT_DOF_MAX = 6 }; /* velocities of a motion */
#define KT_MOTION_FITS(id, name, v, ...) _Static_assert((v) <= KT_DOF_MAX, #name " has too many degrees of freedom");
KT_MOTION_LIST(KT_MOTION_FITS)
#undef KT_MOTION_FITS

/* kt_planar_link distinguishes two motions. */
#define KT_MOTION_FITS_PLANE(id, name, v, l, a, q, planar)                                                             \
    _Static_assert(!(planar) || ((v) == 1 && (l) + (a) == 1), #name " is neither a rotation nor a translation");
KT_MOTION_LIST(KT_MOTION_FITS_PLANE)
#undef KT_MOTION_FITS_PLANE

#endif
