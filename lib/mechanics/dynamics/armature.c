/* Armature, the rotor inertia reflected to a degree of freedom: its flags in a model, and its energy
 *   T = sum a v^2 / 2
 * aba.h describes its part in the recursions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/dynamics.h"
#include "dynamics/joint_motion.h"

/* Whether a link has armature. */
static bool link_has_armature(const kt_model *model, const kt_link *link) {
    bool has = false;
    for (int k = 0; k < kt_link_dofs(link); k++)
        has |= model->armature[link->v + k] > 0.0;
    return has;
}

void kt_armature_update_flags(kt_model *model) {
    model->has_armature = false;
    for (size_t g = 0; g < model->n.group; g++)
        model->group[g].has_armature = false;
    for (size_t i = 1; i < model->n.link; i++) {
        kt_link *link = &model->link[i];
        const bool has_armature = link_has_armature(model, link);
        model->has_armature |= has_armature;
        link->has_armature = has_armature;
        if (has_armature && link->group >= 0)
            model->group[link->group].has_armature = true;
        if (kt_link_is_planar(model, i)) {
            kt_planar_link *planar = &model->planar[(int32_t)i + model->to_planar];
            planar->armature = model->armature[link->v];
        }
    }
    model->kernels = kt_kernels_of(model->isa, model->sweep, model->has_armature);
}

/* The rate of a degree of freedom, from the motion of its link and of the parent. */
typedef struct rates {
    kt_v4 angular, linear; /* of the link relative to the parent, at the link's origin */
    const double *armature;
    double twice; /* the energy */
} rates;

static void add_armature_energy(const kt_dof *dof, void *context) {
    rates *r = context;
    const double v = kt_v4_dot(dof->u, dof->kind == KT_DOF_TRANSLATION ? r->linear : r->angular);
    r->twice += r->armature[dof->index] * v * v;
}

double kt_armature_energy(const kt_model *model, const kt_data *data) {
    rates r = {.twice = 0.0};
    for (size_t i = 1; i < model->n.link && model->has_armature; i++) {
        const kt_link *link = &model->link[i];
        if (kt_is_massless(model, (size_t)link->v))
            continue;
        const kt_link_kinematics *m = &data->kinematics[i], *up = &data->kinematics[link->parent];
        const kt_vec3 carried = kt_vec3_add(up->velocity, kt_vec3_cross(up->omega, m->offset));
        r.angular = kt_v4_from(kt_vec3_sub(m->omega, up->omega));
        r.linear = kt_v4_from(kt_vec3_sub(m->velocity, carried));
        r.armature = model->armature + link->v;
        kt_link_dofs_visit(model, data->kinematics, i, add_armature_energy, &r);
    }
    return 0.5 * r.twice;
}
