/* The form in which each body is written in MJCF.
 *
 * MuJoCo rejects bodies that move and have no mass, but gives a body several joints. So a body without mass whose only
 * use is to carry one other gives its joints to that one. It keeps its joints if two slides would be on one body that
 * are not normal to each other, or if that body would have more than six coordinates. A slider on the world without
 * mass that a coupling moves is a fixed tendon of the other joints. An import makes such a slider of a tendon:
 *     c_n n + sum c_i q_i = offset,    n = offset / c_n + L,    L = sum (-c_i / c_n) q_i.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/joint_name.h"
#include "robot/write.h"

#include <math.h>
#include <string.h>

/* Counts of references to a body: by ends of loops and effects, by couplings, and by all else to its joint. */
typedef struct uses {
    int ends, sums, joints;
} uses;

static void count_end(const kt_export *x, uses *all, const char *name) {
    const int body = kt_export_find(x, name);
    if (body >= 0)
        all[body].ends++;
}

static void count_all_uses(const kt_export *x, uses *all) {
    for (int i = 0; i < x->d->loop_count; i++) {
        const kt_loop *loop = &x->d->loops[i];
        const int driven = loop->joint != NULL ? kt_names_find(&x->names, 1, loop->joint) : -1;
        for (int k = 0; k < 2; k++)
            count_end(x, all, loop->between[k].body);
        for (int k = 0; k < loop->term_count; k++) {
            const int body = kt_names_find(&x->names, 1, loop->terms[k].joint);
            if (body >= 0)
                *(loop->type == KT_LOOP_COUPLING ? &all[body].sums : &all[body].joints) += 1;
        }
        if (driven >= 0)
            all[driven].joints++;
    }
    for (int i = 0; i < x->d->effect_count; i++)
        for (int k = 0; k < 2; k++)
            count_end(x, all, x->d->effects[i].between[k].body);
    for (int i = 0; i < x->mesh_count; i++)
        count_end(x, all, x->meshes[i].body);
}

/* Whether only the joint of a body is of use. */
static bool is_bare(const kt_body *body, const uses *use) {
    kt_vec3 com;
    kt_sym3 s;
    kt_properties_of(body, &com, &s);
    return body->mass == 0.0 && s.xx == 0.0 && s.yy == 0.0 && s.zz == 0.0 && s.xy == 0.0 && s.xz == 0.0 &&
           s.yz == 0.0 && body->variable_mass == NULL && body->shape.type == KT_SHAPE_NONE && body->shape_count == 0 &&
           body->marker_count == 0 && use->ends == 0;
}

int kt_export_scalar(const kt_export *x, const char *joint) {
    const int body = joint != NULL ? kt_names_find(&x->names, 1, joint) : -1;
    const kt_joint_type type = body >= 0 ? kt_export_body(x, body)->joint.type : KT_JOINT_FIXED;
    return type == KT_JOINT_REVOLUTE || type == KT_JOINT_PRISMATIC || type == KT_JOINT_SCREW ? body : -1;
}

/* Whether a coupling makes its slider `body` a sum of other joints that are no such sums. */
static bool slider_is_sum(const kt_export *x, const kt_loop *loop, int body) {
    double own = 0.0;
    for (int k = 0; k < loop->term_count; k++) {
        const int other = kt_export_scalar(x, loop->terms[k].joint);
        if (other < 0 || (other != body && x->role[other] == KT_EXPORT_SUM))
            return false;
        own = other == body ? loop->terms[k].coefficient : own;
    }
    return loop->type == KT_LOOP_COUPLING && loop->formula == NULL && loop->term_count > 1 && own != 0.0;
}

/* A slider of the world that one coupling alone uses, and that carries nothing, is the sum of the other joints. */
static void find_numbers(kt_export *x, const uses *all) {
    for (int i = 0; i < x->d->loop_count; i++) {
        const kt_loop *loop = &x->d->loops[i];
        for (int k = 0; k < loop->term_count && loop->type == KT_LOOP_COUPLING; k++) {
            const int body = kt_names_find(&x->names, 1, loop->terms[k].joint);
            if (body < 0 || kt_export_body(x, body)->joint.type != KT_JOINT_PRISMATIC || x->parent[body] >= 0 ||
                x->first_child[body] >= 0 || all[body].sums != 1 || all[body].joints != 0 ||
                !is_bare(kt_export_body(x, body), &all[body]) || !slider_is_sum(x, loop, body))
                continue;
            x->role[body] = KT_EXPORT_SUM;
            x->sum[body] = loop;
            break;
        }
    }
}

/* A ball would turn about axes that the frame of the next body turns, and a free joint is the only one of its body. */
static bool can_merge(const kt_export *x, int body) {
    const kt_joint_type type = kt_export_body(x, body)->joint.type;
    const int child = x->first_child[body];
    return child >= 0 && x->next_child[child] < 0 && type != KT_JOINT_SPHERICAL && type != KT_JOINT_FREE &&
           type != KT_JOINT_FIXED;
}

static bool slides(kt_joint_type type) {
    return type == KT_JOINT_PRISMATIC || type == KT_JOINT_CYLINDRICAL || type == KT_JOINT_PLANAR ||
           type == KT_JOINT_SCREW || type == KT_JOINT_FREE;
}

/* Whether a slide of a body is not normal to one that would be on the same body. MuJoCo takes the mass matrix of slides
 * alone to be diagonal. */
static bool is_skew(const kt_export *x, int body) {
    const kt_joint *own = &kt_export_body(x, body)->joint;
    kt_mat3 frame = kt_mat3_identity();
    for (int i = body; slides(own->type) && x->role[i] == KT_EXPORT_MERGED;) {
        i = x->first_child[i];
        const kt_joint *joint = &kt_export_body(x, i)->joint;
        frame = kt_mat3_multiply(frame, kt_mat3_of_rotation(&joint->rotation));
        const bool are_plain = own->type == KT_JOINT_PRISMATIC && joint->type == KT_JOINT_PRISMATIC;
        const kt_vec3 axis = kt_mat3_apply(frame, joint->axis);
        if (slides(joint->type) &&
            (!are_plain || fabs(kt_vec3_dot(own->axis, axis)) > 1e-14 * kt_vec3_norm(own->axis) * kt_vec3_norm(axis)))
            return true;
    }
    return false;
}

static int coordinates_of(const kt_joint *joint) {
    kt_export_step steps[KT_EXPORT_STEPS];
    const int count = kt_export_steps(joint, steps);
    return joint->type == KT_JOINT_SPHERICAL ? 3
           : joint->type == KT_JOINT_FREE    ? 6
                                             : count + (joint->type == KT_JOINT_SCREW);
}

/* MuJoCo rejects bodies with more coordinates. From the body that carries the joints outwards to the root, a body
 * without mass that has one too many begins anew. */
static void part_joints(kt_export *x, int carrier) {
    enum { COORDINATES_MOST = 6 };
    int count = coordinates_of(&kt_export_body(x, carrier)->joint);
    for (int i = x->parent[carrier]; i >= 0 && x->role[i] == KT_EXPORT_MERGED; i = x->parent[i]) {
        const int own = coordinates_of(&kt_export_body(x, i)->joint);
        if (count + own > COORDINATES_MOST)
            x->role[i] = KT_EXPORT_BODY;
        count = count + own > COORDINATES_MOST ? own : count + own;
    }
}

bool kt_export_find_roles(kt_export *x) {
    uses *all = kt_pool_take(&x->pool, (size_t)x->d->body_count + 1, sizeof *all);
    if (all == NULL)
        return false;
    count_all_uses(x, all);
    find_numbers(x, all);
    for (int i = 0; i < x->d->body_count; i++)
        if (x->role[i] == KT_EXPORT_BODY && can_merge(x, i) && is_bare(kt_export_body(x, i), &all[i]))
            x->role[i] = KT_EXPORT_MERGED;
    for (int i = 0; i < x->d->body_count; i++)
        if (x->role[i] == KT_EXPORT_MERGED && is_skew(x, i))
            x->role[i] = KT_EXPORT_BODY;
    for (int i = 0; i < x->d->body_count; i++)
        if (x->role[i] == KT_EXPORT_BODY)
            part_joints(x, i);
    return true;
}

double kt_export_number_offset(const kt_export *x, int body, double *own) {
    const kt_loop *loop = x->sum[body];
    *own = 1.0;
    for (int k = 0; k < loop->term_count; k++)
        if (strcmp(loop->terms[k].joint, kt_joint_name_of(kt_export_body(x, body))) == 0)
            *own = loop->terms[k].coefficient;
    return loop->offset / *own;
}
