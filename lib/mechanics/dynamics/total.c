/* Energies, momenta, centre of mass, and the wrenches across joints. Bodies are summed in their order. Bodies that are
 * fixed to the world are left out: their potential energy would be a constant, which costs digits if they are far away.
 *
 *   T = sum m v_c^2 / 2 + w . I_c w / 2, and the energy of rotors (armature.c), which have no momentum
 *   V = -sum m g . c
 *   p = sum m v_c
 *   L = sum c x m v_c + I_c w
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/dynamics.h"
#include "dynamics/point.h"
#include "kinetree/dynamics.h"

#include <string.h>

/* I_c u for world vectors: R I (R' u). */
KT_INLINE kt_vec3 apply_body_inertia(const kt_body_record *b, kt_mat3 r, kt_vec3 u) {
    return kt_mat3_apply(r, kt_sym3_apply(b->inertia, kt_mat3_apply_transposed(r, u)));
}

double kt_kinetic_energy(const kt_model *model, const kt_data *data) {
    if (!kt_data_serve(model, data))
        return (double)NAN;
    model = kt_model_now(model, data);
    double twice = 0.0;
    for (int i = 1; i < (int)model->n.body; i++) {
        const kt_body_record *b = &model->body[i];
        const kt_vec3 v = kt_point_velocity(model, data, i, b->com);
        const kt_mat3 r = kt_mat3_multiply(data->kinematics[b->link].axes, b->in_link.rotation);
        const kt_vec3 w = kt_mat3_apply_transposed(r, data->kinematics[b->link].omega);
        twice += b->mass * kt_vec3_dot(v, v) + kt_vec3_dot(w, kt_sym3_apply(b->inertia, w));
    }
    return 0.5 * twice + kt_armature_energy(model, data);
}

double kt_potential_energy(const kt_model *model, const kt_data *data) {
    if (!kt_data_serve(model, data))
        return (double)NAN;
    model = kt_model_now(model, data);
    const kt_vec3 g = kt_v4_vec3(model->gravity);
    double energy = 0.0;
    for (int i = 1; i < (int)model->n.body; i++) {
        const kt_body_record *b = &model->body[i];
        if (b->fixed)
            continue;
        energy -= b->mass * kt_vec3_dot(g, kt_point_position(model, data, i, b->com));
    }
    return energy;
}

kt_wrench kt_momentum(const kt_model *model, const kt_data *data) {
    if (!kt_data_serve(model, data))
        return (kt_wrench){{(double)NAN, (double)NAN, (double)NAN}, {(double)NAN, (double)NAN, (double)NAN}};
    model = kt_model_now(model, data);
    kt_wrench total = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    for (int i = 1; i < (int)model->n.body; i++) {
        const kt_body_record *b = &model->body[i];
        const kt_vec3 p = kt_vec3_scale(b->mass, kt_point_velocity(model, data, i, b->com));
        const kt_mat3 r = kt_mat3_multiply(data->kinematics[b->link].axes, b->in_link.rotation);
        const kt_vec3 spin = apply_body_inertia(b, r, data->kinematics[b->link].omega);
        const kt_vec3 orbit = kt_vec3_cross(kt_point_position(model, data, i, b->com), p);
        total.force = kt_vec3_add(total.force, p);
        total.moment = kt_vec3_add(total.moment, kt_vec3_add(orbit, spin));
    }
    return total;
}

double kt_mass_center(const kt_model *model, const kt_data *data, kt_vec3 *center) {
    if (!kt_data_serve(model, data) || !center)
        return (double)NAN;
    model = kt_model_now(model, data);
    kt_vec3 moment = {0.0, 0.0, 0.0};
    double mass = 0.0;
    for (int i = 1; i < (int)model->n.body; i++) {
        const kt_body_record *b = &model->body[i];
        if (b->fixed)
            continue;
        mass += b->mass;
        moment = kt_vec3_add(moment, kt_vec3_scale(b->mass, kt_point_position(model, data, i, b->com)));
    }
    *center = mass > 0.0 ? kt_vec3_scale(1.0 / mass, moment) : kt_vec3_make(0.0, 0.0, 0.0);
    return mass;
}

/* Returns the wrench that a body's motion and gravity require, minus the external wrench, about the body frame's
 * origin. */
static kt_wrench body_wrench(const kt_model *model, const kt_link_kinematics *links, int i, const kt_wrench *external) {
    const kt_body_record *b = &model->body[i];
    const kt_link_kinematics *link = &links[b->link];
    const kt_mat3 r = kt_mat3_multiply(link->axes, b->in_link.rotation);
    const kt_vec3 w = link->omega, alpha = link->alpha;
    kt_v4 axes[3];
    kt_v4_from_mat3(link->axes, axes);
    const kt_v4 arm = kt_point_arm(b, axes, kt_v4_from(b->com));
    const kt_v4 of_com = kt_point_accelerate(kt_v4_from(link->linear), kt_v4_from(alpha), kt_v4_from(w), arm);
    const kt_vec3 g = kt_v4_vec3(model->gravity), a = kt_v4_vec3(of_com);
    kt_wrench out;
    out.force = kt_vec3_scale(b->mass, kt_vec3_sub(a, g));
    const kt_vec3 spin = kt_vec3_cross(w, apply_body_inertia(b, r, w));
    const kt_vec3 about_com = kt_vec3_add(apply_body_inertia(b, r, alpha), spin);
    out.moment = kt_vec3_add(about_com, kt_vec3_cross(kt_mat3_apply(r, b->com), out.force));
    if (external) {
        out.force = kt_vec3_sub(out.force, external[i].force);
        out.moment = kt_vec3_sub(out.moment, external[i].moment);
    }
    return out;
}

/* Transforms a wrench from a reference point to the point that is `arm` before this point. */
static kt_wrench carry_back(kt_wrench w, kt_vec3 arm) {
    w.moment = kt_vec3_add(w.moment, kt_vec3_cross(arm, w.force));
    return w;
}

/* Returns the joint's displacement: from the origin of the joint frame to the origin of body i. The displacement is
 * computed only from offsets between links. The positions of links in the world, which may be far away, do not
 * enter. */
static kt_vec3 slid(const kt_model *model, const kt_link_kinematics *links, int i) {
    const int32_t end = model->body[model->body[i].parent].link;
    kt_v4 sum = kt_v4_splat(0.0);
    for (int32_t l = model->body[i].link; l != end; l = model->link[l].parent) {
        kt_v4 parent[3];
        kt_v4_from_mat3(links[model->link[l].parent].axes, parent);
        sum += kt_v4_from(links[l].offset) - kt_v4_apply_to(parent, model->link[l].at);
    }
    return kt_v4_vec3(sum);
}

/* Uses data->wrench as workspace. Once a body's sum contains the sums of all bodies that it carries, the reaction of
 * its joint replaces this sum. */
const kt_wrench *kt_joint_reactions_find(const kt_model *model, kt_data *data, const kt_link_kinematics *links,
                                         const kt_wrench *external) {
    model = kt_model_now(model, data);
    kt_wrench *sum = data->wrench;
    const int count = (int)model->n.body;
    memset(&sum[0], 0, sizeof sum[0]);
    for (int i = 1; i < count; i++)
        sum[i] = body_wrench(model, links, i, external);
    for (int i = count - 1; i > 0; i--) {
        const kt_body_record *b = &model->body[i], *parent = &model->body[b->parent];
        const kt_mat3 r = kt_mat3_multiply(links[parent->link].axes, parent->in_link.rotation);
        sum[i] = carry_back(sum[i], slid(model, links, i));
        const kt_wrench up = carry_back(sum[i], kt_mat3_apply(r, b->joint.position));
        sum[b->parent].force = kt_vec3_add(sum[b->parent].force, up.force);
        sum[b->parent].moment = kt_vec3_add(sum[b->parent].moment, up.moment);
    }
    memset(&sum[0], 0, sizeof sum[0]);
    return sum;
}

void kt_joint_reactions(const kt_model *model, kt_data *data, const kt_wrench *external, kt_wrench *wrenches) {
    if (!kt_data_serve(model, data) || !wrenches)
        return;
    memcpy(wrenches, kt_joint_reactions_find(model, data, data->kinematics, external),
           model->n.body * sizeof *wrenches);
}
