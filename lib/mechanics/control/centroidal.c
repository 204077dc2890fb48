/* Momentum of the whole as a function of the joint rates, about the centre of mass, from composite inertias (Orin,
 * Goswami, Lee 2013). A degree of freedom (w, u) carries a composite with m, h = m c and J about its link's origin o:
 *     p = m u + w x h,   l = J w + h x u + (o - g) x p
 * The rates at rest of all joint accelerations are sums over links of
 *     F = m a + alpha x h + w x (w x h),   N = h x a + J alpha + w x J w + (o - g) x F
 * with the accelerations due to the velocities alone (frame.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "control/control.h"
#include "dynamics/joint_motion.h"

#include <string.h>

/* A composite or a rigid inertia about a link's origin, world axes. */
typedef struct composite {
    double mass;
    kt_vec3 moment;  /* h */
    kt_sym3 inertia; /* J */
} composite;

_Static_assert(sizeof(composite) <= sizeof(kt_link_kinematics), "composites fit into kt_links_scratch");

static composite composite_of(const kt_link *link, const kt_link_kinematics *m) {
    return (composite){.mass = link->mass,
                       .moment = kt_mat3_apply(m->axes, link->moment),
                       .inertia = kt_sym3_rotate(m->axes, link->inertia)};
}

/* Adds x, whose reference point is at r from the reference point of `to`: J + 2 (h.r) 1 - r h' - h r' + m (r.r 1 - r
 * r'). */
static void add_shifted_composite(composite *to, const composite *x, kt_vec3 r) {
    const kt_vec3 h = x->moment;
    kt_sym3 j = kt_sym3_shift(x->inertia, x->mass, r);
    const double all = 2.0 * kt_vec3_dot(h, r);
    j = kt_sym3_add(j, kt_sym3_make(all - 2.0 * h.x * r.x, all - 2.0 * h.y * r.y, all - 2.0 * h.z * r.z,
                                    -(h.x * r.y + h.y * r.x), -(h.x * r.z + h.z * r.x), -(h.y * r.z + h.z * r.y)));
    to->inertia = kt_sym3_add(to->inertia, j);
    to->moment = kt_vec3_add(to->moment, kt_vec3_add(h, kt_vec3_scale(x->mass, r)));
    to->mass += x->mass;
}

/* Composites of all links into scratch memory. */
static composite *compose_bodies(const kt_model *model, kt_data *data) {
    composite *c = (composite *)kt_links_scratch(data);
    for (size_t i = 1; i < model->n.link; i++)
        c[i] = composite_of(&model->link[i], &data->kinematics[i]);
    for (size_t i = model->n.link - 1; i > 0; i--)
        if (model->link[i].parent)
            add_shifted_composite(&c[model->link[i].parent], &c[i], data->kinematics[i].offset);
    return c;
}

/* The destination of the columns of a link. */
typedef struct columns {
    const composite *c;
    kt_vec3 arm;   /* o - g */
    double *first; /* of the link's degrees of freedom */
} columns;

/* The column (l, p) of one degree of freedom (w, u), by the formulas above. */
static void write_momentum_column(const kt_dof *dof, void *context) {
    const columns *to = context;
    const kt_vec3 w = kt_v4_vec3(kt_dof_angular(dof)), u = kt_v4_vec3(kt_dof_linear(dof)), h = to->c->moment;
    const kt_vec3 p = kt_vec3_add(kt_vec3_scale(to->c->mass, u), kt_vec3_cross(w, h));
    const kt_vec3 own = kt_vec3_add(kt_sym3_apply(to->c->inertia, w), kt_vec3_cross(h, u));
    const kt_vec3 l = kt_vec3_add(own, kt_vec3_cross(to->arm, p));
    double *column = to->first + 6 * dof->index;
    column[0] = l.x, column[1] = l.y, column[2] = l.z;
    column[3] = p.x, column[4] = p.y, column[5] = p.z;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): it is written by way of the columns */
void kt_centroidal_matrix(const kt_model *model, kt_data *data, double *matrix) {
    if (!kt_data_serve(model, data) || !matrix)
        return;
    model = kt_model_now(model, data);
    const composite *c = compose_bodies(model, data);
    kt_vec3 center;
    (void)kt_mass_center(model, data, &center);
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_link_kinematics *m = &data->kinematics[i];
        const columns to = {.c = &c[i], .arm = kt_vec3_sub(m->position, center), .first = matrix + 6 * (size_t)link->v};
        kt_link_dofs_visit(model, data->kinematics, i, write_momentum_column, (void *)&to);
    }
}

/* Sums the inertial wrenches of all links while joint accelerations are zero. With alpha and a of a link's origin from
 * the velocities alone, h = m c and J about the origin, and r from the centre of mass to the origin:
 *     f = m a + alpha x h + w x (w x h),   n = J alpha + w x J w + h x a,   sum (n + r x f, f) */
kt_wrench kt_centroidal_bias(const kt_model *model, kt_data *data) {
    if (!kt_data_serve(model, data))
        return (kt_wrench){{(double)NAN, (double)NAN, (double)NAN}, {(double)NAN, (double)NAN, (double)NAN}};
    model = kt_model_now(model, data);
    kt_twist *bias = (kt_twist *)kt_links_scratch(data);
    kt_wrench sum = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    kt_vec3 center;
    (void)kt_mass_center(model, data, &center);
    memset(&bias[0], 0, sizeof bias[0]);
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_link_kinematics *m = &data->kinematics[i];
        const kt_twist *parent = &bias[link->parent], own = kt_link_bias(model, data->kinematics, i);
        const composite c = composite_of(link, m);
        const kt_vec3 w = m->omega, h = c.moment, alpha = kt_vec3_add(parent->angular, own.angular);
        const kt_vec3 a =
            kt_vec3_add(kt_vec3_add(parent->linear, kt_vec3_cross(parent->angular, m->offset)), own.linear);
        const kt_vec3 around = kt_vec3_add(kt_vec3_cross(alpha, h), kt_vec3_cross(w, kt_vec3_cross(w, h)));
        const kt_vec3 force = kt_vec3_add(kt_vec3_scale(c.mass, a), around);
        const kt_vec3 spin = kt_vec3_cross(w, kt_sym3_apply(c.inertia, w));
        const kt_vec3 turn = kt_vec3_add(kt_sym3_apply(c.inertia, alpha), spin);
        const kt_vec3 arm = kt_vec3_cross(kt_vec3_sub(m->position, center), force);
        bias[i] = (kt_twist){.angular = alpha, .linear = a};
        sum.force = kt_vec3_add(sum.force, force);
        sum.moment = kt_vec3_add(sum.moment, kt_vec3_add(kt_vec3_add(kt_vec3_cross(h, a), turn), arm));
    }
    return sum;
}

/* The linear momentum over the mass. */
void kt_mass_center_jacobian(const kt_model *model, kt_data *data, double *jacobian) {
    if (!kt_data_serve(model, data) || !jacobian)
        return;
    model = kt_model_now(model, data);
    const composite *c = compose_bodies(model, data);
    kt_vec3 center;
    const double mass = kt_mass_center(model, data, &center), fraction = mass > 0.0 ? 1.0 / mass : 0.0;
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        double all[6 * KT_DOF_MAX] = {0.0};
        const columns to = {.c = &c[i], .arm = {0.0, 0.0, 0.0}, .first = all};
        kt_link_dofs_visit(model, data->kinematics, i, write_momentum_column, (void *)&to);
        for (int k = 0; k < 3 * kt_link_dofs(link); k++)
            jacobian[3 * (size_t)link->v + (size_t)k] = fraction * all[6 * (k / 3) + 3 + k % 3];
    }
}

kt_vec3 kt_mass_center_bias(const kt_model *model, kt_data *data) {
    if (!kt_data_serve(model, data))
        return kt_vec3_make((double)NAN, (double)NAN, (double)NAN);
    kt_vec3 center;
    const double mass = kt_mass_center(model, data, &center);
    return kt_vec3_scale(mass > 0.0 ? 1.0 / mass : 0.0, kt_centroidal_bias(model, data).force);
}
