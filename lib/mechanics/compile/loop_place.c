/* The place of a loop's end, which a program may move: "loop NAME.place". The end is on the world or, if both ends are
 * on moving bodies, it is the second one.
 *
 * The numbers are the end's point and the rotation vector of its frame, whose z axis is along the loop's `axis`. They
 * are in world axes, or in the frame of the body. The recursions read the frame from the loop's record, where it is in
 * the frame of the link that has the body.
 *
 * In a plane, the equations were laid out at compile time. A frame that turns by delta about the normal n turns the
 * directions of end 1, and changes the angle between the ends' directions at q = 0:
 *
 *     theta' = theta - delta   if end 1 is on the world,   theta + delta   if end 2 is
 *
 * Motions out of the plane would change other equations, and are rejected. If a type has no equations of orientation,
 * tilts of the frame do not matter.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/attach.h"
#include "compile/compile.h"
#include "compile/find_planar.h"
#include "dynamics/dynamics.h"
#include "kinetree/dynamics.h"
#include "loop/loop.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Rotations and shifts out of a plane that count as rounding, rad, and relative to the mechanism's length. */
static const double flat_enough = 1e-9;

int kt_loop_movable_end(const kt_loop_record *r) {
    if (r->side != KT_SIDE_NONE)
        return -1;
    const kt_loop_kind *kind = kt_loop_kinds_baseline[r->kind];
    if (kt_attach_is_relation(r->type) || kind->initial_angle || kind->start)
        return -1;
    return r->link[0] == 0 ? 0 : 1;
}

/* The pose of the body that has the place, in its link; the identity for the world. */
static kt_pose holder_in_link(const kt_model *m, const kt_loop_record *r) {
    const int end = kt_loop_movable_end(r);
    return r->link[end] == 0 ? kt_pose_identity() : m->body[r->body[end]].in_link;
}

/* Whether a plane computes the loop in this model. */
static bool is_flat(const kt_model *m, const kt_loop_record *r) {
    return m->n.planar && !kt_loop_is_off(r) && (size_t)(r->link[0] ? r->link[0] : r->link[1]) >= m->n.spatial;
}

static const kt_plane *plane_of(const kt_model *m, const kt_loop_record *r) {
    const size_t link = (size_t)(r->link[0] ? r->link[0] : r->link[1]);
    return &m->plane[m->planar_rest[(int32_t)link + m->to_planar].plane];
}

/* The normal of the loop's plane, in the axes of the link that has the place. */
static kt_vec3 normal_at_place(const kt_model *m, const kt_loop_record *r) {
    const int32_t link = r->link[kt_loop_movable_end(r)];
    if (link == 0)
        return plane_of(m, r)->basis.z;
    const kt_planar_rest *rest = &m->planar_rest[link + m->to_planar];
    return kt_vec3_make(rest->axes[0][2], rest->axes[1][2], rest->axes[2][2]);
}

static kt_pose place_pose_of(const double *x) {
    return (kt_pose){.rotation = kt_mat3_from_euler_vector(kt_vec3_make(x[3], x[4], x[5])),
                     .position = kt_vec3_make(x[0], x[1], x[2])};
}

void kt_loop_end_pose_write(kt_pose pose, double *x) {
    const kt_vec3 turn = kt_euler_vector_from_mat3(pose.rotation);
    const double numbers[] = {pose.position.x, pose.position.y, pose.position.z, turn.x, turn.y, turn.z};
    for (int i = 0; i < 6; i++)
        x[i] = numbers[i];
}

void kt_loop_end_pose_get(const kt_model *m, int loop, double *x) {
    const kt_loop_record *r = &m->loop[loop];
    const kt_pose holder = holder_in_link(m, r);
    kt_loop_end_pose_write(kt_pose_compose(kt_pose_invert(holder), r->frame[kt_loop_movable_end(r)]), x);
}

/* The rotation vector from the present frame to the new frame, in world axes. */
static kt_vec3 turn_to(const kt_pose *from, const kt_pose *to) {
    return kt_euler_vector_from_mat3(kt_mat3_multiply(to->rotation, kt_mat3_transpose(from->rotation)));
}

/* Whether the rotation of the place does not matter: d = 0, or a distance. */
static bool is_of_points(const kt_loop_record *r) {
    const kt_loop_kind *kind = kt_loop_kinds_baseline[r->kind];
    bool turns = false;
    int along = 0;
    for (int k = 0; k < kind->rows; k++) {
        turns = turns || (kind->part[k] > KT_PART_Z && kind->part[k] != KT_PART_DISTANCE);
        along += kind->part[k] >= KT_PART_X && kind->part[k] <= KT_PART_Z;
    }
    return !turns && along % 3 == 0;
}

kt_status kt_loop_end_pose_check(const kt_model *m, int loop, const double *x, kt_error *error) {
    const kt_loop_record *r = &m->loop[loop];
    if (!is_flat(m, r))
        return KT_OK;
    const kt_pose to = kt_pose_compose(holder_in_link(m, r), place_pose_of(x)),
                  *from = &r->frame[kt_loop_movable_end(r)];
    const kt_vec3 normal = normal_at_place(m, r), turn = turn_to(from, &to);
    const double tilt = is_of_points(r) ? 0.0 : kt_vec3_norm(kt_vec3_cross(normal, turn));
    const double shift = fabs(kt_vec3_dot(normal, kt_vec3_sub(to.position, from->position)));
    if (tilt <= flat_enough && shift <= flat_enough * m->length)
        return KT_OK;
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "loop '%.100s'", m->text + r->name);
    return kt_error_set(error, KT_ERROR_MODEL, where,
                        "its place leaves the plane of the mechanism, by %.3g rad and %.3g m; compute the mechanism in "
                        "space (simulate: {plan: spatial}, or --plan spatial)",
                        tilt, shift);
}

static void turn_pair(double *x, double *y, double c, double s) {
    const double turned = c * *x - s * *y;
    *y = s * *x + c * *y;
    *x = turned;
}

/* Turns the equations of the compilation, not the present equations. Thus equal positions give equal bits, whatever the
 * earlier positions. */
static void place_in_plane(kt_model *m, kt_loop_record *r, int end, const kt_pose *from, const kt_pose *to) {
    kt_planar_loop *flat = &m->planar_loop[r - m->loop];
    if (!flat->placed) {
        flat->placed = 1;
        flat->axes0 = from->rotation;
        flat->c0 = flat->c;
        flat->s0 = flat->s;
        for (int i = 0; i < flat->count; i++)
            memcpy(flat->e0[i], flat->row[i].e, sizeof flat->e0[i]);
    }
    const kt_pose compiled = {.rotation = flat->axes0};
    const double delta = kt_vec3_dot(normal_at_place(m, r), turn_to(&compiled, to)), c = cos(delta), s = sin(delta);
    for (int i = 0; end == 0 && i < flat->count; i++) {
        memcpy(flat->row[i].e, flat->e0[i], sizeof flat->e0[i]);
        turn_pair(&flat->row[i].e[0], &flat->row[i].e[1], c, s);
    }
    flat->c = flat->c0;
    flat->s = flat->s0;
    turn_pair(&flat->c, &flat->s, c, end == 0 ? -s : s);
    kt_planar_ends(m, r, flat);
}

void kt_loop_end_pose_put(kt_model *m, int loop, const double *x) {
    kt_loop_record *r = &m->loop[loop];
    const int end = kt_loop_movable_end(r);
    const kt_pose from = r->frame[end], to = kt_pose_compose(holder_in_link(m, r), place_pose_of(x));
    r->frame[end] = to;
    if (is_flat(m, r))
        place_in_plane(m, r, end, &from, &to);
}

/* The pose of a link in the world, from the pose of one of its bodies. */
static kt_pose link_pose(const kt_model *m, const kt_data *data, const kt_loop_record *r, int end) {
    return kt_pose_compose(kt_body_pose(m, data, r->body[end]), kt_pose_invert(m->body[r->body[end]].in_link));
}

kt_status kt_loop_place_here(const kt_model *model, const kt_data *data, int loop, double *values, kt_error *error) {
    char where[KT_WHERE_SIZE];
    if (KT_IS_MISSING(error, model, values) || KT_IS_OTHER_DATA(error, model, data))
        return KT_ERROR_ARGUMENT;
    if (!KT_IS_INDEX(loop, model->n.loop))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "loop", "%d: there is no such loop", loop);
    const kt_loop_record *r = &model->loop[loop];
    const int end = kt_loop_movable_end(r);
    (void)snprintf(where, sizeof where, "loop '%.100s'", model->text + r->name);
    if (end < 0)
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, where,
            "it has no place: it bounds a side, relates coordinates, or counts an angle from the start");
    const kt_pose other = kt_pose_compose(link_pose(model, data, r, 1 - end), r->frame[1 - end]);
    const kt_pose here =
        r->link[end] == 0 ? other : kt_pose_compose(kt_pose_invert(kt_body_pose(model, data, r->body[end])), other);
    if (!isfinite(here.position.x) || !isfinite(here.rotation.x.x))
        return kt_error_set(error, KT_ERROR_ARGUMENT, where,
                            "the data have no kinematics; call kt_kinematics_update first");
    kt_loop_end_pose_write(here, values);
    return KT_OK;
}
