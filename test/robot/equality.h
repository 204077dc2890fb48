/* Residuals of MuJoCo's equalities between two bodies, and those of the loops that are made of them. */
#ifndef KT_TEST_IMPORT_EQUALITY_H
#define KT_TEST_IMPORT_EQUALITY_H

#include "check.h"

#include "kinetree/kinetree.h"

#include <math.h>

/* The pose of an end whose body has this one. */
static inline kt_pose pose_of_end(kt_pose body, const kt_end *end) {
    kt_pose own = kt_pose_identity();
    own.position = end->at;
    if (end->rotation.type != KT_ROTATION_NONE)
        (void)!kt_rotation_evaluate(&end->rotation, &own.rotation, NULL);
    return kt_pose_compose(body, own);
}

/* The distance of both points along the world's axes. For a weld, also MuJoCo's vector part of the quaternion between
 * both orientations. Its norm is the sine of half the angle. */
static inline void compare_ends(const kt_loop *loop, kt_pose a, kt_pose b, const double *theirs, kt_worst *worst) {
    const kt_vec3 d = kt_vec3_sub(a.position, b.position);
    const double apart[3] = {d.x, d.y, d.z}, scale = fmax(1.0, kt_vec3_norm(d));
    for (int k = 0; k < 3; k++)
        kt_worst_near(worst, apart[k], theirs[k], 1e-14 * scale, "%s, %d", loop->name, k);
    if (loop->type != KT_LOOP_WELD)
        return;
    const kt_mat3 between = kt_mat3_multiply(kt_mat3_transpose(a.rotation), b.rotation);
    const double angle = kt_vec3_norm(kt_euler_vector_from_matrix(between));
    kt_worst_near(worst, sin(0.5 * angle), kt_vec3_norm(kt_vec3_make(theirs[3], theirs[4], theirs[5])), 1e-14,
                  "%s, sine of half the angle", loop->name);
}

#endif
