/* Inertias that MuJoCo accepts.
 *
 * MuJoCo rejects a body that moves if its mass or a principal moment is below 1e-15. It also rejects moments a <= b <=
 * c with a + b < c. It computes the moments of a full matrix itself, and requires 1e-14 of these. Slender rods, points,
 * and bodies in a plane with one moment alone violate these conditions.
 *
 * Here a moment below the least becomes the least, and a and b grow by (c - a - b) / 2 each. This is the smallest
 * change that is shared equally. It concerns axes that a mechanism in a plane does not turn about. Such moments are
 * written about principal axes, since a matrix would round them.
 *
 * MuJoCo turns the moments of URDF into the frame of the body and finds the principal ones again. Their errors are some
 * eps c. If the axes are not those of the body, a + b becomes (1 + spare) c, with a spare of 32 eps.
 *
 * MuJoCo merges the links of URDF that are fixed to each other, and leaves out those without mass, even if they have
 * moments. These get the least mass.
 *
 * A body that is fixed to another may have any moments, as long as those of the rigid part are right: sensors in URDF
 * often have wrong ones. If it would be raised, its mass and moments are written with those of the body that carries
 * it. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/principal.h"
#include "robot/write.h"

#include <math.h>

static bool is_diagonal(kt_sym3 s) { return s.xy == 0.0 && s.xz == 0.0 && s.yz == 0.0; }

/* Moves the pointer to the largest of three to the last position. */
static void sort_last(double *m[3]) {
    for (int i = 0; i < 2; i++)
        if (*m[i] > *m[2]) {
            double *swap = m[i];
            m[i] = m[2];
            m[2] = swap;
        }
}

/* Raises moments, and returns the largest change. */
static double raise_moments(double moment[3], double least, double spare) {
    double *m[3] = {&moment[0], &moment[1], &moment[2]};
    const double before[3] = {moment[0], moment[1], moment[2]};
    double most = 0.0;
    for (int i = 0; i < 3; i++)
        moment[i] = fmax(moment[i], least);
    sort_last(m);
    const double missing = (1.0 + spare) * *m[2] - (*m[0] + *m[1]);
    if (missing > 0.0) {
        *m[0] += 0.5 * missing;
        *m[1] += 0.5 * missing;
    }
    while (*m[0] + *m[1] < *m[2]) /* rounded down */
        *m[0] = nextafter(*m[0], INFINITY);
    for (int i = 0; i < 3; i++)
        most = fmax(most, moment[i] - before[i]);
    return most;
}

/* Whether readers that compute principal moments of a matrix accept it for certain. */
static bool is_safe(const double moment[3], double least) {
    const double sum = moment[0] + moment[1] + moment[2], most = fmax(fmax(moment[0], moment[1]), moment[2]);
    const double smallest = fmin(fmin(moment[0], moment[1]), moment[2]);
    return smallest > 20.0 * least && smallest > 1e-10 * most && sum - 2.0 * most > 1e-10 * most;
}

static kt_export_moments find_moments(const kt_export *x, int i, bool moves) {
    kt_export_moments m = {.axes = kt_mat3_identity()};
    if (i >= 0) {
        m.mass = x->inertials[i].mass;
        m.com = x->inertials[i].com;
        m.full = x->inertials[i].inertia;
    }
    const kt_sym3 s = m.full;
    m.is_plain = is_diagonal(s);
    m.is_nothing = m.mass == 0.0 && m.is_plain && s.xx == 0.0 && s.yy == 0.0 && s.zz == 0.0;
    if (m.is_nothing && !moves)
        return m;
    if (!m.is_plain)
        m.axes = kt_principal_axes(s);
    kt_moments_about(s, m.axes, m.moment);
    m.is_plain = m.is_plain || is_safe(m.moment, x->least);
    const double size = fmax(fmax(m.moment[0], m.moment[1]), m.moment[2]);
    const double spare = m.is_plain ? 0.0 : x->spare;
    m.raised = raise_moments(m.moment, moves ? x->least : 0.0, spare);
    if (m.is_plain && is_diagonal(s))
        m.full = kt_sym3_make(m.moment[0], m.moment[1], m.moment[2], 0.0, 0.0, 0.0);
    m.is_raised = m.raised > (1e-15 + spare) * size;
    m.is_nothing = false;
    return m;
}

kt_export_moments kt_export_take_moments(kt_export *x, int i, bool moves) {
    kt_export_moments m = find_moments(x, i, moves);
    if (m.is_nothing)
        return m;
    if (moves && m.mass < x->least) {
        m.mass = x->least;
        x->lightened++;
    } else if (m.mass < x->least_fixed) {
        m.mass = x->least_fixed;
        x->weighted++;
    } else if (m.is_raised) {
        x->raised++;
        if (m.raised >= x->most_raised)
            x->most_raised_body = kt_export_body(x, i)->name;
        x->most_raised = fmax(x->most_raised, m.raised);
    }
    return m;
}

/* ---- rigid parts ------------------------------------------------------------------------------------------------- */

/* Adds mass and moments of a fixed body to those of the body that carries it. */
static void give_inertial(kt_export *x, int i, int to) {
    const kt_pose pose = kt_frame_of_joint(&kt_export_body(x, i)->joint);
    kt_export_inertial *a = &x->inertials[to], *b = &x->inertials[i];
    const double mass = a->mass + b->mass;
    const kt_vec3 com = kt_pose_apply(pose, b->com);
    const kt_vec3 both =
        mass > 0.0 ? kt_vec3_scale(1.0 / mass, kt_vec3_add(kt_vec3_scale(a->mass, a->com), kt_vec3_scale(b->mass, com)))
                   : a->com;
    const kt_sym3 inertia = kt_sym3_rotate(pose.rotation, b->inertia);
    a->inertia = kt_sym3_add(kt_sym3_shift(a->inertia, a->mass, kt_vec3_sub(a->com, both)),
                             kt_sym3_shift(inertia, b->mass, kt_vec3_sub(com, both)));
    a->com = both;
    a->mass = mass;
    *b = (kt_export_inertial){.mass = 0.0};
}

/* Gives a fixed body to the one that carries it, if it would be raised. */
static bool give_wrong_inertial(kt_export *x, int i) {
    const kt_export_moments m = find_moments(x, i, false);
    if (kt_export_body(x, i)->joint.type != KT_JOINT_FIXED || x->parent[i] < 0 || m.is_nothing || !m.is_raised)
        return false;
    give_inertial(x, i, x->parent[i]);
    kt_export_lose(x,
                   "fixed bodies whose mass is that of the body that carries them, since MuJoCo rejects their moments "
                   "of inertia");
    return true;
}

bool kt_export_find_inertials(kt_export *x) {
    x->inertials = kt_pool_take(&x->pool, (size_t)x->d->body_count + 1, sizeof *x->inertials);
    if (x->inertials == NULL)
        return false;
    for (int i = 0; i < x->d->body_count; i++) {
        kt_export_inertial *to = &x->inertials[i];
        to->mass = kt_export_body(x, i)->mass;
        kt_properties_of(kt_export_body(x, i), &to->com, &to->inertia);
    }
    for (bool again = true; again;) { /* each body gives once, so that this ends */
        again = false;
        for (int i = 0; i < x->d->body_count; i++)
            again = give_wrong_inertial(x, i) || again;
    }
    return true;
}
