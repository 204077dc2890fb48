/* A mechanism that is built again in another engine. A twin has the bodies at the start. The functions find masses and
 * the ends of loops. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_PEERS_TWIN_H
#define KT_BENCH_PEERS_TWIN_H

#include "kinetree/kinetree.h"

#include <stdbool.h>

/* Hard spheres on bodies, which touch planes of the world, and each other if `touch` is set. Nothing bounces. */
typedef struct kt_twin_sphere {
    int body;
    kt_vec3 at;
    double radius;
} kt_twin_sphere;

typedef struct kt_twin_plane {
    kt_vec3 at, normal; /* a unit vector */
} kt_twin_plane;

typedef struct kt_twin_ground {
    const kt_twin_sphere *sphere;
    const kt_twin_plane *plane;
    int sphere_count, plane_count;
    bool touch;
    double friction;
} kt_twin_ground;

typedef struct kt_twin {
    const kt_description *description;
    const int *parent; /* of each body of the description; -1: the world */
    kt_pose *pose;     /* of the bodies */
    kt_twist *twist;
    const kt_twin_ground *ground; /* NULL: nothing touches */
} kt_twin;

/* Mass properties. Other engines reject a moment of inertia of zero, which slender bars have. If all motion is in the
 * plane of x and y, the moments about x and y have no effect on it. They are then raised to a hundredth of m (0.1 m)^2.
 */
void kt_twin_mass(const kt_twin *twin, int body, kt_vec3 *com, kt_sym3 *inertia);

/* Writes the poses and twists of the bodies after kt_kinematics_update. */
void kt_twin_read(const kt_model *model, const kt_data *data, const kt_twin *to);

/* Whether all motion is in the plane of x and y. */
bool kt_twin_flat(const kt_twin *twin);

/* Whether all joints and loops are of types that these engines have, and there are no effects. */
bool kt_twin_known(const kt_description *description);

/* The frame of an end at the start, in the world, and its body (-1: the world). */
kt_pose kt_twin_end(const kt_twin *twin, const kt_end *end, int *body);

#endif
