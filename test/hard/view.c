/* Energies, momenta and gaps from the poses and twists of bodies alone, so that every engine is held to the same.
 *
 * Of a body: c = p + R com, v_c = v + w x (R com), J = R I R':
 *   T = m v_c'v_c / 2 + w'J w / 2,   V = -m g'c,   momentum m v_c, angular momentum J w + c x m v_c.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "hard.h"

#include <math.h>
#include <string.h>

/* Mass properties, a shape's put in. */
static void mass_of(const kt_body *body, kt_vec3 *com, kt_sym3 *inertia) {
    *com = body->com;
    *inertia = body->inertia;
    if (body->com_of_shape || body->inertia_of_shape)
        (void)!kt_body_inertia(body, com, inertia, NULL);
}

static kt_vec3 center(const kt_hard_view *view, int i, kt_vec3 *velocity, kt_sym3 *inertia) {
    kt_vec3 com;
    kt_sym3 own;
    mass_of(&view->description->bodies[i], &com, &own);
    const kt_vec3 arm = kt_mat3_apply(view->pose[i].rotation, com);
    *velocity = kt_vec3_add(view->twist[i].linear, kt_vec3_cross(view->twist[i].angular, arm));
    *inertia = kt_sym3_rotate(view->pose[i].rotation, own);
    return kt_vec3_add(view->pose[i].position, arm);
}

double kt_hard_kinetic(const kt_hard_view *view) {
    double twice = 0.0;
    for (int i = 0; i < view->description->body_count; i++) {
        kt_vec3 v;
        kt_sym3 inertia;
        (void)center(view, i, &v, &inertia);
        const kt_vec3 w = view->twist[i].angular;
        twice += view->description->bodies[i].mass * kt_vec3_dot(v, v) + kt_vec3_dot(w, kt_sym3_apply(inertia, w));
    }
    return 0.5 * twice;
}

kt_wrench kt_hard_momentum(const kt_hard_view *view) {
    kt_wrench sum = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    for (int i = 0; i < view->description->body_count; i++) {
        kt_vec3 v;
        kt_sym3 inertia;
        const kt_vec3 c = center(view, i, &v, &inertia);
        const kt_vec3 p = kt_vec3_scale(view->description->bodies[i].mass, v);
        sum.force = kt_vec3_add(sum.force, p);
        sum.moment =
            kt_vec3_add(sum.moment, kt_vec3_add(kt_sym3_apply(inertia, view->twist[i].angular), kt_vec3_cross(c, p)));
    }
    return sum;
}

int kt_hard_body(const kt_hard_view *view, const char *name) {
    for (int i = 0; i < view->description->body_count; i++)
        if (name && strcmp(view->description->bodies[i].name, name) == 0)
            return i;
    return -1;
}

/* The frame of an end. */
static kt_pose end_frame(const kt_hard_view *view, const kt_end *end) {
    const int i = kt_hard_body(view, end->body);
    kt_pose frame = kt_pose_identity();
    frame.position = end->at;
    (void)!kt_rotation_evaluate(&end->rotation, &frame.rotation, NULL);
    if (i < 0)
        return frame;
    const kt_body *body = &view->description->bodies[i];
    for (int m = 0; end->marker && m < body->marker_count; m++)
        if (strcmp(body->markers[m].name, end->marker) == 0)
            frame.position = body->markers[m].at;
    return kt_pose_compose(view->pose[i], frame);
}

double kt_hard_potential(const kt_hard_view *view) {
    double sum = 0.0;
    for (int i = 0; i < view->description->body_count; i++) {
        kt_vec3 v;
        kt_sym3 inertia;
        const kt_vec3 c = center(view, i, &v, &inertia);
        sum -= view->description->bodies[i].mass * kt_vec3_dot(view->description->gravity, c);
    }
    for (int i = 0; i < view->description->effect_count; i++) {
        const kt_effect *e = &view->description->effects[i];
        if (e->type != KT_EFFECT_SPRING)
            continue;
        const kt_vec3 a = end_frame(view, &e->between[0]).position, b = end_frame(view, &e->between[1]).position;
        const double more = kt_vec3_norm(kt_vec3_sub(b, a)) - e->length;
        sum += 0.5 * e->stiffness * more * more;
    }
    return sum;
}

static double distance(kt_vec3 a, kt_vec3 b) { return kt_vec3_norm(kt_vec3_sub(a, b)); }

/* The gap of the joint that carries body i: origins coincide, and so do the axes of a hinge. */
static double joint_gap(const kt_hard_view *view, int i) {
    const kt_joint *joint = &view->description->bodies[i].joint;
    const bool slides = joint->type == KT_JOINT_PRISMATIC || joint->type == KT_JOINT_CYLINDRICAL ||
                        joint->type == KT_JOINT_SCREW || joint->type == KT_JOINT_PLANAR || joint->type == KT_JOINT_FREE;
    kt_pose frame = kt_pose_identity();
    frame.position = joint->at;
    (void)!kt_rotation_evaluate(&joint->rotation, &frame.rotation, NULL);
    if (view->parent[i] >= 0)
        frame = kt_pose_compose(view->pose[view->parent[i]], frame);
    double gap = slides ? 0.0 : distance(frame.position, view->pose[i].position);
    if (joint->type == KT_JOINT_REVOLUTE) {
        const kt_vec3 axis = kt_vec3_normalize(joint->axis);
        gap = fmax(gap, kt_vec3_norm(kt_vec3_cross(kt_mat3_apply(frame.rotation, axis),
                                                   kt_mat3_apply(view->pose[i].rotation, axis))));
    }
    return gap;
}

double kt_hard_gap(const kt_hard_view *view) {
    double worst = 0.0;
    for (int i = 0; i < view->description->body_count; i++)
        worst = fmax(worst, joint_gap(view, i));
    for (int i = 0; i < view->description->loop_count; i++) {
        const kt_loop *loop = &view->description->loops[i];
        const kt_pose a = end_frame(view, &loop->between[0]), b = end_frame(view, &loop->between[1]);
        if (loop->type == KT_LOOP_SPHERICAL || loop->type == KT_LOOP_REVOLUTE)
            worst = fmax(worst, distance(a.position, b.position));
        if (loop->type == KT_LOOP_REVOLUTE) {
            const kt_vec3 axis = kt_vec3_normalize(loop->axis);
            worst = fmax(worst,
                         kt_vec3_norm(kt_vec3_cross(kt_mat3_apply(a.rotation, axis), kt_mat3_apply(b.rotation, axis))));
        }
        if (loop->type == KT_LOOP_DISTANCE)
            worst = fmax(worst, fabs(distance(a.position, b.position) - loop->function.value));
    }
    return worst;
}

/* ---- watches ----------------------------------------------------------------------------------------------------- */

void kt_hard_raise(kt_hard_watch *w, int measure, double value) {
    if (!(value <= w->observed[measure])) /* NaN, too, and it stays */
        w->observed[measure] = value;
}

void kt_hard_watch_gap(kt_hard_watch *w, const kt_hard_view *view, int measure) {
    kt_hard_raise(w, measure, kt_hard_gap(view));
}

void kt_hard_watch_energy(kt_hard_watch *w, const kt_hard_view *view, int measure) {
    const double kinetic = kt_hard_kinetic(view), energy = kinetic + kt_hard_potential(view);
    if (w->count == 0)
        w->energy = energy;
    w->kinetic_most = fmax(w->kinetic_most, kinetic);
    if (w->count > 0)
        kt_hard_raise(w, measure, fabs(energy - w->energy) / w->kinetic_most);
}
