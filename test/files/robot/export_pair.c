/* Let y be our velocities, except those of lengths that an export drops. With v = A y for ours and w = B y for theirs,
 * mass matrices and bias forces satisfy
 *
 *     A' M A = B' N B,    A' f = B' g.
 *
 * A free joint counts from the world in theirs: P is our joint frame, turned as URDF turns a mechanism whose gravity is
 * not along -z. Then p = P q for positions, and B has the rotation of P. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "export_pair.h"

#include "check.h"
#include "numbers.h"

#include "model/joint_name.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- our model --------------------------------------------------------------------------------------------------- */

bool is_turned_upright(const exported *e) {
    const kt_vec3 g = e->scene.description.gravity;
    return e->format == KT_ROBOT_URDF && (g.x != 0.0 || g.y != 0.0 || g.z > 0.0);
}

/* Compiles the tree. Parts that only loops move need the loops. URDF has no
 * armature, and one size of gravity. */
static kt_status compile_exported(export_pair *p, kt_error *error) {
    kt_description d = p->file->scene.description;
    kt_body *bodies = calloc((size_t)d.body_count + 1, sizeof *bodies);
    if (bodies == NULL)
        return KT_ERROR_MEMORY;
    for (int i = 0; i < d.body_count; i++) {
        bodies[i] = d.bodies[i];
        bodies[i].variable_mass = NULL; /* exports have the masses of the start */
        if (p->file->format == KT_ROBOT_URDF)
            memset(bodies[i].joint.armature, 0, sizeof bodies[i].joint.armature);
    }
    d.bodies = bodies;
    if (p->file->format == KT_ROBOT_URDF)
        d.gravity = is_turned_upright(p->file) ? kt_vec3_scale(9.81, kt_vec3_normalize(d.gravity))
                                               : kt_vec3_make(0.0, 0.0, -9.81);
    d.effect_count = d.hold_count = 0;
    const int loops = d.loop_count;
    d.loop_count = 0;
    kt_status status = kt_model_compile(&d, NULL, &p->model, error);
    d.loop_count = loops;
    if (status != KT_OK && status != KT_ERROR_MEMORY)
        status = kt_model_compile(&d, NULL, &p->model, error);
    free(bodies);
    return status;
}

bool load_export_pair(export_pair *p) {
    kt_error error = {0};
    if (compile_exported(p, &error) != KT_OK || kt_data_create(p->model, &p->data, &error) != KT_OK) {
        kt_note("%s: %s", error.where, error.message);
        return false;
    }
    const size_t nq = (size_t)kt_model_nq(p->model), nv = (size_t)kt_model_nv(p->model), nw = (size_t)p->theirs.nv;
    const size_t square = nv * nv;
    return TAKE_NUMBERS({&p->q, nq}, {&p->v, nv}, {&p->zero, nv}, {&p->tau, nv}, {&p->matrix, square}, {&p->a, square},
                        {&p->b, nw * nv}, {&p->left, square}, {&p->right, square}, {&p->forces, 2 * nv});
}

void release_export_pair(export_pair *p) {
    kt_data_free(p->data);
    kt_model_free(p->model);
    free(p->q);
    release_answer(&p->theirs);
}

/* ---- coordinates ------------------------------------------------------------------------------------------------- */

/* Their joint NAME, or NAME with an ending; NULL: there is none. */
static const answer_joint *find_joint(const export_pair *p, const char *name, const char *ending) {
    char whole[2 * NAME];
    (void)snprintf(whole, sizeof whole, "%s%s", name, ending);
    for (int i = 0; i < p->theirs.joint_count; i++)
        if (strcmp(p->theirs.joints[i].name, whole) == 0)
            return &p->theirs.joints[i];
    return NULL;
}

/* Part k of a joint of several coordinates. */
static const answer_joint *find_part(const export_pair *p, const char *name, int k) {
    char ending[16];
    static const char *const of_urdf[] = {"_TX", "_TY", "_RZ"};
    (void)snprintf(ending, sizeof ending, "__%d", k);
    const answer_joint *found = find_joint(p, name, k > 0 ? ending : "");
    return found == NULL && k < 3 ? find_joint(p, name, of_urdf[k]) : found;
}

/* Our coordinates c + first + k are theirs along the columns of a rotation,
 * from a point: v = R' w. */
static void map_vector(export_pair *p, kt_coordinates c, int first, const answer_joint *const theirs[3], int count,
                       kt_mat3 rotation, kt_vec3 from) {
    const kt_vec3 columns[3] = {rotation.x, rotation.y, rotation.z};
    const double origin[3] = {from.x, from.y, from.z};
    for (int k = 0; k < count; k++) {
        const double column[3] = {columns[k].x, columns[k].y, columns[k].z};
        p->q[c.q + first + k] = 0.0;
        p->v[c.v + first + k] = 0.0;
        for (int l = 0; l < count; l++) {
            const int at = theirs[0] == theirs[count - 1] ? l : 0; /* a free joint has all three */
            p->b[(c.v + first + k) * p->theirs.nv + theirs[l]->v + at] = column[l];
            p->q[c.q + first + k] += column[l] * (p->theirs.qpos[theirs[l]->q + at] - origin[l]);
            p->v[c.v + first + k] += column[l] * p->theirs.qvel[theirs[l]->v + at];
        }
    }
}

static void map_ball(export_pair *p, kt_coordinates c, int first_q, int first_v, const double *quat, int v,
                     kt_quat before) {
    const kt_quat q = kt_quat_multiply(before, kt_quat_make(quat[0], quat[1], quat[2], quat[3]));
    const double values[4] = {q.w, q.x, q.y, q.z};
    memcpy(p->q + c.q + first_q, values, sizeof values);
    for (int k = 0; k < 3; k++) {
        p->v[c.v + first_v + k] = p->theirs.qvel[v + k];
        p->b[(c.v + first_v + k) * p->theirs.nv + v + k] = 1.0;
    }
}

/* The frame that a free joint of ours counts from, in the world of theirs. */
static kt_pose frame_in_theirs(const export_pair *p, const kt_body *body) {
    kt_pose own = {.position = body->joint.at, .rotation = kt_mat3_identity()}, turn = kt_pose_identity();
    if (body->joint.rotation.type != KT_ROTATION_NONE)
        (void)!kt_rotation_evaluate(&body->joint.rotation, &own.rotation, NULL);
    if (is_turned_upright(p->file)) /* about the vertical nothing depends on the angle */
        turn.rotation = kt_mat3_transpose(
            kt_triad_from_axis(kt_vec3_scale(-1.0, kt_vec3_normalize(p->file->scene.description.gravity)), 2));
    return kt_pose_compose(turn, own);
}

/* MuJoCo's frame of a planar joint: the shortest turn from z to the axis, by
 * which it takes x and y. */
static kt_mat3 planar_frame(kt_vec3 axis) {
    const kt_vec3 u = kt_vec3_normalize(axis), z = kt_vec3_make(0.0, 0.0, 1.0), w = kt_vec3_cross(z, u);
    const double sine = kt_vec3_norm(w), angle = atan2(sine, u.z);
    if (sine < 1e-10)
        return u.z > 0.0 ? kt_mat3_identity() : kt_mat3_about(0, 3.14159265358979323846);
    return kt_mat3_from_euler_vector(kt_vec3_scale(angle / sine, w));
}

static bool map_free(export_pair *p, const kt_body *body, kt_coordinates c, const answer_joint *first) {
    const answer_joint *const all[3] = {first, find_part(p, kt_joint_name_of(body), 1),
                                        find_part(p, kt_joint_name_of(body), 2)};
    const answer_joint *ball = find_part(p, kt_joint_name_of(body), 3);
    if (first->type == 0) {
        const kt_pose frame = frame_in_theirs(p, body);
        const answer_joint *const one[3] = {first, first, first};
        const kt_vec3 x = frame.rotation.x, y = frame.rotation.y, z = frame.rotation.z;
        map_vector(p, c, 0, one, 3, (kt_mat3){.x = x, .y = y, .z = z}, frame.position);
        map_ball(p, c, 3, 3, p->theirs.qpos + first->q + 3, first->v + 3,
                 kt_quat_conjugate(kt_quat_from_mat3(frame.rotation)));
        return true;
    }
    if (all[1] == NULL || all[2] == NULL || ball == NULL || ball->type != 1)
        return false;
    map_vector(p, c, 0, all, 3, kt_mat3_identity(), kt_vec3_make(0.0, 0.0, 0.0));
    map_ball(p, c, 3, 3, p->theirs.qpos + ball->q, ball->v, kt_quat_make(1.0, 0.0, 0.0, 0.0));
    return true;
}

/* The row of A of a length that an export drops: c_n n = offset - sum c_i q_i.
 */
static bool map_length(export_pair *p, const kt_body *body, kt_coordinates c) {
    const kt_description *d = &p->file->scene.description;
    const int nv = kt_model_nv(p->model);
    for (int i = 0; i < d->loop_count; i++) {
        const kt_loop *loop = &d->loops[i];
        double own = 0.0;
        for (int k = 0; k < loop->term_count && loop->type == KT_LOOP_COUPLING && loop->formula == NULL; k++)
            if (strcmp(loop->terms[k].joint, kt_joint_name_of(body)) == 0)
                own = loop->terms[k].coefficient;
        for (int k = 0; k < loop->term_count && own != 0.0; k++)
            for (int b = 1; b < kt_model_body_count(p->model); b++)
                if (strcmp(kt_joint_name(p->model, b), loop->terms[k].joint) == 0 &&
                    find_joint(p, loop->terms[k].joint, "") != NULL) {
                    const int other = kt_body_coordinates(p->model, b).v;
                    p->a[other * nv + c.v] = -loop->terms[k].coefficient / own;
                    p->v[c.v] += p->a[other * nv + c.v] * p->v[other];
                }
        if (own != 0.0)
            return true;
    }
    return false;
}

static bool map_body(export_pair *p, int b) {
    const kt_coordinates c = kt_body_coordinates(p->model, b);
    const kt_body *body = &p->file->scene.description.bodies[kt_body_source(p->model, b)];
    const char *name = kt_joint_name_of(body);
    const answer_joint *all[3] = {find_part(p, name, 0), find_part(p, name, 1), find_part(p, name, 2)};
    const int nv = kt_model_nv(p->model);
    for (int k = 0; k < c.nv; k++)
        p->a[(c.v + k) * nv + c.v + k] = 1.0;
    if (c.nv == 0)
        return true;
    if (all[0] == NULL)
        return false;
    if (body->joint.type == KT_JOINT_FREE)
        return map_free(p, body, c, all[0]);
    if (body->joint.type == KT_JOINT_SPHERICAL) {
        map_ball(p, c, 0, 0, p->theirs.qpos + all[0]->q, all[0]->v, kt_quat_make(1.0, 0.0, 0.0, 0.0));
        return all[0]->type == 1;
    }
    kt_mat3 between = kt_mat3_identity();
    for (int k = 1; k < c.nv; k++)
        if (all[k] == NULL)
            return false;
    if (body->joint.type == KT_JOINT_PLANAR && p->file->format == KT_ROBOT_URDF)
        between = kt_mat3_multiply(kt_mat3_transpose(planar_frame(body->joint.axis)),
                                   kt_triad_from_axis(kt_vec3_normalize(body->joint.axis), 2));
    if (c.nv == 1)
        all[1] = all[2] = all[0];
    for (int k = 0; k < c.nv && c.nv == 1; k++) {
        p->q[c.q] = p->theirs.qpos[all[0]->q];
        p->v[c.v] = p->theirs.qvel[all[0]->v];
        p->b[c.v * p->theirs.nv + all[0]->v] = 1.0;
    }
    if (c.nv > 1)
        map_vector(p, c, 0, all, c.nv, between, kt_vec3_make(0.0, 0.0, 0.0));
    return true;
}

bool map_export_pair(export_pair *p) {
    const int nv = kt_model_nv(p->model);
    memset(p->a, 0, (size_t)nv * (size_t)nv * sizeof *p->a);
    memset(p->b, 0, (size_t)nv * (size_t)p->theirs.nv * sizeof *p->b);
    for (int b = 1; b < kt_model_body_count(p->model); b++)
        if (!map_body(p, b)) {
            const kt_coordinates c = kt_body_coordinates(p->model, b);
            const kt_body *body = &p->file->scene.description.bodies[kt_body_source(p->model, b)];
            p->v[c.v] = 0.0;
            p->a[c.v * nv + c.v] = 0.0;
            if (c.nv != 1 || p->file->format == KT_ROBOT_URDF || !map_length(p, body, c)) {
                kt_note("%s: joint %s is not in the export", p->file->path, kt_joint_name(p->model, b));
                return false;
            }
        }
    return true;
}
