/* Joints, loops, relations and effects of a picture, with their frames, in the order of the description. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"
#include "evaluate/path_force.h"
#include "kinetree/descriptor.h"
#include "loop/loop.h"
#include "picture/maker.h"
#include "picture/solid.h"

#include <string.h>

/* The frame with z along an axis; the frame itself where the axis is zero. */
static kt_mat3 frame_along(kt_mat3 frame, kt_vec3 axis) {
    return kt_vec3_dot(axis, axis) > 0.0 ? kt_mat3_multiply(frame, kt_triad_from_axis(kt_vec3_normalize(axis), 2))
                                         : frame;
}

/* The frame of an end in its body, with z along the loop's axis. A marker of the end replaces the body's frame. */
static kt_body_frame picture_frame_of(const kt_picture_maker *m, const kt_end *end, kt_vec3 axis) {
    kt_body_frame frame = {.body = end->body != NULL ? kt_body_find(m->model, end->body) : 0};
    frame.body = frame.body > 0 ? frame.body : 0;
    const int marker = end->marker != NULL ? kt_marker_find(m->model, frame.body, end->marker) : -1;
    frame.pose.position = marker >= 0 ? kt_marker_at(m->model, frame.body, marker) : end->at;
    kt_mat3 turned = kt_solid_rotation(&end->rotation);
    if (marker >= 0)
        turned = kt_mat3_multiply(kt_marker_rotation(m->model, frame.body, marker), turned);
    frame.pose.rotation = frame_along(turned, axis);
    return frame;
}

/* Whether a coupling contains the joint of a body. */
static bool is_coupled(const kt_picture_maker *m, int body) {
    const char *name = kt_joint_name(m->model, body);
    for (int i = 0; i < m->description->loop_count; i++) {
        const kt_loop *loop = &m->description->loops[i];
        for (int k = 0; k < loop->term_count && loop->type == KT_LOOP_COUPLING; k++)
            if (strcmp(loop->terms[k].joint, name) == 0)
                return true;
    }
    return false;
}

/* Whether a slider of the world represents only a number, such as the length of a tendon. A coupling moves such a
 * slider; it has neither mass nor shape and carries nothing. */
bool kt_picture_is_number(const kt_picture_maker *m, int body) {
    const kt_body *source = kt_picture_source(m, body);
    bool carries = false;
    for (int i = body + 1; i < m->picture->body_count; i++)
        carries = carries || kt_body_parent(m->model, i) == body;
    return source->joint.type == KT_JOINT_PRISMATIC && kt_body_parent(m->model, body) == 0 && !(source->mass > 0.0) &&
           source->shape.type == KT_SHAPE_NONE && source->shape_count == 0 && !carries && is_coupled(m, body);
}

void kt_picture_list_joints(kt_picture_maker *m) {
    kt_picture *p = m->picture;
    for (int body = 1; body < p->body_count; body++) {
        const kt_joint *joint = &kt_picture_source(m, body)->joint;
        const int parent = kt_body_parent(m->model, body);
        p->part[body] = joint->type == KT_JOINT_FIXED ? p->part[parent] : body;
        if (joint->type == KT_JOINT_FIXED || kt_picture_is_number(m, body))
            continue;
        const bool has_axis = joint->type != KT_JOINT_SPHERICAL && joint->type != KT_JOINT_FREE;
        const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0);
        const kt_mat3 triad = kt_triad_from_axis(kt_vec3_normalize(joint->axis), 2);
        const bool has_axis2 = kt_vec3_dot(joint->axis2, joint->axis2) > 0.0;
        p->joints[p->joint_count++] = (kt_picture_joint){
            .type = joint->type,
            .body = body,
            .frame = {.body = parent,
                      .pose = {.rotation =
                                   frame_along(kt_solid_rotation(&joint->rotation), has_axis ? joint->axis : none),
                               .position = joint->at}},
            .child = kt_mat3_transpose(frame_along(kt_mat3_identity(), has_axis ? joint->axis : none)),
            .axis2 = has_axis2 ? kt_vec3_normalize(joint->axis2) : triad.x,
            .name = kt_joint_name(m->model, body)};
    }
}

/* Whether a key of the type refers to the member at this offset. */
static bool has_member_key(const kt_descriptor *type, size_t offset) {
    for (int i = 0; i < type->key_count; i++)
        if (type->keys[i].offset == offset)
            return true;
    return false;
}

/* The axis of a loop in the frame of its second end. */
static kt_vec3 second_axis_of(const kt_loop *loop, const kt_descriptor *type) {
    const kt_vec3 own = loop->second_axis;
    const bool has_own = has_member_key(type, offsetof(kt_loop, second_axis)) && kt_vec3_dot(own, own) > 0.0;
    return has_member_key(type, offsetof(kt_loop, axis2)) ? loop->axis2 : has_own ? own : loop->axis;
}

/* The radius of a wheel or a pulley, 0 for other loops. */
static double radius_of_wheel(const kt_picture_maker *m, int loop, int k) {
    const kt_loop_record *r = &m->model->loop[loop];
    if (r->type < KT_LOOP_GEAR || r->type > KT_LOOP_BELT || (r->type == KT_LOOP_RACK && k == 1))
        return 0.0;
    if (r->type == KT_LOOP_WORM && k == 0)
        return r->radius;
    return r->type >= KT_LOOP_SPAN ? r->gain[k] : fabs(r->gain[k]);
}

void kt_picture_list_loops(kt_picture_maker *m) {
    kt_picture *p = m->picture;
    for (int i = 0; i < m->description->loop_count; i++) {
        const kt_loop *loop = &m->description->loops[i];
        const kt_descriptor *type = kt_loop_descriptor(loop->type);
        const bool is_rope = loop->type == KT_LOOP_DISTANCE && loop->slack;
        if (!has_member_key(type, offsetof(kt_loop, between)))
            continue;
        p->loops[p->loop_count++] =
            (kt_picture_loop){.type = loop->type,
                              .loop = i,
                              .ends = {picture_frame_of(m, &loop->between[0], loop->axis),
                                       picture_frame_of(m, &loop->between[1], second_axis_of(loop, type))},
                              .radius = loop->radius,
                              .radii = {radius_of_wheel(m, i, 0), radius_of_wheel(m, i, 1)},
                              .rope = is_rope ? &loop->function : NULL,
                              .name = loop->name};
    }
}

int kt_body_of_joint(const kt_model *model, const char *name) {
    kt_error ignored;
    int body;
    return kt_joint_find(model, name, &body, &ignored) == KT_OK ? body : -1;
}

static int picture_joint_of(const kt_picture_maker *m, const char *name) {
    const int body = name != NULL ? kt_body_of_joint(m->model, name) : -1;
    for (int i = 0; i < m->picture->joint_count && body > 0; i++)
        if (m->picture->joints[i].body == body)
            return i;
    return -1;
}

static void add_picture_relation(kt_picture_maker *m, int loop, int joint, int other) {
    kt_picture *p = m->picture;
    const kt_loop *source = &m->description->loops[loop];
    p->relations[p->relation_count++] = (kt_picture_relation){source->type, loop, joint, other, source->name};
}

void kt_picture_list_relations(kt_picture_maker *m) {
    for (int i = 0; i < m->description->loop_count; i++) {
        const kt_loop *loop = &m->description->loops[i];
        const kt_descriptor *type = kt_loop_descriptor(loop->type);
        if (has_member_key(type, offsetof(kt_loop, joint)) && picture_joint_of(m, loop->joint) >= 0)
            add_picture_relation(m, i, picture_joint_of(m, loop->joint), -1);
        for (int k = 1; k < loop->term_count && has_member_key(type, offsetof(kt_loop, terms)); k++) {
            const int joint = picture_joint_of(m, loop->terms[k - 1].joint),
                      other = picture_joint_of(m, loop->terms[k].joint);
            if (joint >= 0 && other >= 0)
                add_picture_relation(m, i, joint, other);
        }
    }
}

/* An end of an effect; of a path its first or last point. */
static const kt_end *picture_end_of(const kt_effect *effect, int k) {
    if (effect->path_count == 0)
        return &effect->between[k];
    return &effect->path[k == 0 ? 0 : effect->path_count - 1].end;
}

/* The coordinate of a loop in which an effect acts, as a joint: between the loop's ends, z along the motion. */
static int coordinate_of(kt_picture_maker *m, int effect) {
    kt_picture *p = m->picture;
    int k = 0;
    const int index = kt_effect_loop(m->model, effect, &k), body = kt_effect_body(m->model, effect, 0);
    for (int i = 0; i < p->joint_count && index < 0; i++)
        if (p->joints[i].body == body)
            return i;
    if (index < 0)
        return -1;
    const kt_loop *loop = &m->description->loops[index];
    const bool slides = kt_effect_is_sliding(m->model, effect);
    const bool in_plane = loop->type == KT_LOOP_PLANAR || loop->type == KT_LOOP_INPLANE;
    const bool second = loop->type == KT_LOOP_UNIVERSAL && k == 1;
    const kt_mat3 triad = kt_triad_from_axis(kt_vec3_normalize(second ? loop->axis2 : loop->axis), 2);
    p->joints[p->joint_count + p->coordinate_count] =
        (kt_picture_joint){.type = slides ? KT_JOINT_PRISMATIC : KT_JOINT_REVOLUTE,
                           .body = kt_effect_body(m->model, effect, 1),
                           .frame = picture_frame_of(m, &loop->between[second],
                                                     !slides || !in_plane ? triad.z
                                                     : k == 0             ? triad.x
                                                                          : triad.y),
                           .child = kt_mat3_identity(),
                           .axis2 = triad.x,
                           .name = loop->name};
    return p->joint_count + p->coordinate_count++;
}

void kt_picture_list_effects(kt_picture_maker *m) {
    kt_picture *p = m->picture;
    for (int i = 0; i < m->description->effect_count; i++) {
        const kt_effect *effect = &m->description->effects[i];
        const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0);
        const bool is_contact = effect->type == KT_EFFECT_CONTACT;
        const bool is_sphere = is_contact && kt_vec3_norm_wide(effect->axle) == 0.0;
        kt_picture_effect *shown = &p->effects[p->effect_count++];
        *shown = (kt_picture_effect){.type = effect->type,
                                     .effect = i,
                                     .joint = -1,
                                     .end_count = kt_effect_end_count(effect),
                                     .radius = is_sphere ? effect->radius : 0.0,
                                     .has_plane = is_contact && effect->radius2 == 0.0,
                                     .lower = effect->lower,
                                     .upper = effect->upper,
                                     .has_stiffness = effect->stiffness > 0.0,
                                     .has_damping = effect->damping > 0.0,
                                     .direction = kt_load_direction(effect),
                                     .is_carried = effect->frame == KT_FRAME_BODY || effect->type == KT_EFFECT_THRUST,
                                     .line_count = kt_path_lines(m->model, i, NULL, NULL, NULL),
                                     .name = effect->name};
        for (int k = 0; k < shown->end_count; k++)
            shown->ends[k] = picture_frame_of(m, picture_end_of(effect, k), is_contact && k == 1 ? effect->axis : none);
        if (shown->end_count == 0)
            shown->joint = coordinate_of(m, i);
    }
}

void kt_picture_path(const kt_picture *p, const kt_picture_effect *effect, const kt_pose *poses, kt_picture_line *each,
                     void *user) {
    if (effect->line_count > 0)
        (void)kt_path_lines(p->model, effect->effect, poses, each, user);
}
