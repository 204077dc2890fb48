/* The regressor of inverse dynamics. A unit of one parameter of a body requires a wrench (n, f) about the body's
 * origin. Let a be the acceleration of that origin less gravity, w and alpha the body's angular velocity and
 * acceleration, and e its axes. The wrenches are
 *     m:       f = a,                                 n = 0
 *     m c_k:   f = alpha x e_k + w x (w x e_k),       n = e_k x a
 *     I_kl:    f = 0,                                 n = E alpha + w x E w
 * with E = e_k e_l' + e_l e_k', or for k = l  E = e_k e_k'. At unit rate, a degree of freedom turns the body by s and
 * moves its origin by u. The column of this degree of freedom has the entries s . n + u . f (Atkeson, An & Hollerbach
 * 1986, for one joint of many). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/regressor.h"

#include "base/copy.h"
#include "dynamics/joint_motion.h"

#include <assert.h>

/* The wrenches of the ten parameters of a body, world axes, component by component; forces of the first four alone. */
typedef struct unit_wrenches {
    double n[3][KT_BODY_PARAMETERS], f[3][4];
} unit_wrenches;

KT_INLINE void set(double to[3][KT_BODY_PARAMETERS], int k, kt_v4 x) {
    for (int i = 0; i < 3; i++)
        to[i][k] = x[i];
}

/* Returns the body's origin relative to the link's origin. */
KT_INLINE kt_v4 fill_wrenches(const kt_body_record *body, const kt_link_motion *m, kt_v4 gravity, unit_wrenches *x) {
    const kt_mat3 *r = &body->in_link.rotation;
    const kt_v4 e[3] = {kt_v4_apply_to(m->axes, r->x), kt_v4_apply_to(m->axes, r->y), kt_v4_apply_to(m->axes, r->z)};
    const kt_v4 arm = kt_v4_apply_to(m->axes, body->in_link.position), w = m->omega;
    const kt_v4 a = m->linear + kt_v4_cross(m->alpha, arm) + kt_v4_cross(w, kt_v4_cross(w, arm)) - gravity;
    kt_v4 turned[3], by_w[3], by_alpha[3]; /* w x e_k; w . e_k and alpha . e_k */
    for (int k = 0; k < 3; k++) {
        turned[k] = kt_v4_cross(w, e[k]);
        by_w[k] = kt_v4_splat(kt_v4_dot(w, e[k]));
        by_alpha[k] = kt_v4_splat(kt_v4_dot(m->alpha, e[k]));
        const kt_v4 force = kt_v4_cross(m->alpha, e[k]) + kt_v4_cross(w, turned[k]);
        for (int i = 0; i < 3; i++)
            x->f[i][1 + k] = force[i];
        set(x->n, 1 + k, kt_v4_cross(e[k], a));
        set(x->n, 4 + k, by_alpha[k] * e[k] + by_w[k] * turned[k]);
    }
    for (int k = 0; k < 3; k++) { /* xy, xz, yz */
        const int i = k == 2 ? 1 : 0, j = k == 0 ? 1 : 2;
        set(x->n, 7 + k, by_alpha[i] * e[j] + by_alpha[j] * e[i] + by_w[i] * turned[j] + by_w[j] * turned[i]);
    }
    for (int i = 0; i < 3; i++) {
        x->n[i][0] = 0.0;
        x->f[i][0] = a[i];
    }
    return arm;
}

/* The ten entries of a body in the row of a degree of freedom. */
typedef struct entry {
    const unit_wrenches *x;
    kt_v4 arm;     /* from the link's origin to the body's */
    double *first; /* of the link's rows, in the body's first column */
    size_t nv;
} entry;

/* The entries s . n + u . f of a degree of freedom. u is the velocity that it gives the body's origin. */
KT_INLINE void write_row(const kt_dof *dof, void *context) {
    const entry *e = context;
    const unit_wrenches *x = e->x;
    const kt_v4 s = kt_dof_angular(dof), u = kt_dof_linear(dof) + kt_v4_cross(s, e->arm);
    double y[KT_BODY_PARAMETERS];
    for (int k = 0; k < KT_BODY_PARAMETERS; k++)
        y[k] = s[0] * x->n[0][k] + s[1] * x->n[1][k] + s[2] * x->n[2][k];
    for (int k = 0; k < 4; k++)
        y[k] += u[0] * x->f[0][k] + u[1] * x->f[1][k] + u[2] * x->f[2][k];
    for (size_t k = 0; k < KT_BODY_PARAMETERS; k++)
        e->first[(size_t)dof->index + k * e->nv] = y[k];
}

/* The ten columns of body b: nonzero only in the rows of the degrees of freedom that carry the body. */
KT_INLINE void write_body(const kt_model *model, const kt_data *data, size_t b, double *y) {
    const kt_link_motion *motion = data->motion;
    unit_wrenches x;
    entry e = {.x = &x, .nv = model->n.v};
    kt_clear(y, KT_BODY_PARAMETERS * model->n.v * sizeof *y);
    e.arm = fill_wrenches(&model->body[b], &motion[model->body[b].link], model->gravity, &x);
    for (int32_t i = model->body[b].link; i > 0; i = model->link[i].parent) {
        const kt_link *link = &model->link[i];
        e.first = y + link->v;
        kt_dofs_visit(link, motion[link->parent].axes, motion[i].axes, write_row, &e);
        e.arm += motion[i].offset;
    }
}

void KT_KERNEL(kt_regressor_bodies)(const kt_model *model, const kt_data *data, double *y) {
    assert(kt_data_serve(model, data));
    for (size_t b = 1; b < model->n.body; b++)
        write_body(model, data, b, y + KT_BODY_PARAMETERS * (b - 1) * model->n.v);
}
