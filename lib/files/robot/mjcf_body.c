/* Bodies, joints and sites of MJCF as bodies of a description.
 *
 * A body of MJCF has any number of joints, which act one after the other: T = T0 J1 J2 ..., with the pose T0 of the
 * body in its parent. J_k moves about axis_k through the point p_k, both in the body's frame after the joints before
 * have moved it:
 *     J_k = shift(p_k) R(axis_k, q_k - ref_k) shift(-p_k)
 * Each joint becomes a body of the scene whose frame is at p_k. The last of these is the body itself if its frame is at
 * the body's origin. Otherwise the body is fixed to the last one. The joint frame is turned back by ref, so that
 * coordinates equal MuJoCo's.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf_axes.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- joints ------------------------------------------------------------------------------------------------------ */

/* The unit of the coordinates of a joint in the file, rad or m. */
static double angle_of(const kt_mjcf *m, const kt_mjcf_joint *j) {
    return j->type == KT_MJCF_HINGE ? kt_mjcf_settings_of(m, j->element)->angle : 1.0;
}

static void read_range(kt_mjcf *m, kt_mjcf_joint *j) {
    double range[2] = {0.0, 0.0};
    if (!kt_mjcf_is_limited(m, j->element, j->tag, "limited", "range") || j->type == KT_MJCF_FREE)
        return;
    (void)kt_mjcf_numbers(m, j->element, j->tag, "range", 2, 2, range);
    if (j->type == KT_MJCF_BALL) {
        kt_left_count(&m->notes.lost_limits, j->element);
        return;
    }
    j->is_limited = true;
    j->lower = angle_of(m, j) * range[0];
    j->upper = angle_of(m, j) * range[1];
    if (j->lower > j->upper)
        (void)kt_mjcf_fault(m, j->element, "range: the lower limit, %g, is above the upper one, %g", range[0],
                            range[1]);
    if (!kt_robot_has_stops(m->source->options))
        kt_left_count(&m->notes.limits, j->element);
}

/* The bounds of the actuator forces in a joint; infinite if there are none. */
static void read_force(kt_mjcf *m, kt_mjcf_joint *j) {
    const kt_element *e = j->element;
    double range[2] = {0.0, 0.0};
    j->force[1] = j->effort = (double)INFINITY;
    j->force[0] = -j->force[1];
    if (!kt_mjcf_is_scalar(j) || !kt_mjcf_is_limited(m, e, j->tag, "actuatorfrclimited", "actuatorfrcrange"))
        return;
    (void)kt_mjcf_numbers(m, e, j->tag, "actuatorfrcrange", 2, 2, range);
    if (range[0] > range[1])
        (void)kt_mjcf_fault(m, e, "actuatorfrcrange: the lower limit, %g, is above the upper one, %g", range[0],
                            range[1]);
    memcpy(j->force, range, sizeof range);
    j->effort = fmax(fabs(range[0]), fabs(range[1]));
    if (kt_mjcf_flag(m, e, j->tag, "actuatorgravcomp", false))
        kt_unknown_count(&m->changes, "actuatorgravcomp of a joint whose actuators are limited", e);
}

/* frame: the pose in the body of the <frame> around the joint. Coordinates are numbered in MuJoCo's order. */
static void add_mjcf_joint(kt_mjcf *m, const kt_element *e, int body, kt_pose frame) {
    const bool is_freejoint = strcmp(e->name, "freejoint") == 0;
    const int index = m->joints.count;
    kt_mjcf_joint *j = kt_list_add(m->r, &m->r->scratch, &m->joints, sizeof *j);
    if (j == NULL)
        return;
    *j = (kt_mjcf_joint){.element = e, .tag = is_freejoint ? NULL : "joint", .body = body, .carrier_index = -1};
    j->type = kt_mjcf_motion_of(m, e);
    const kt_vec3 zero = kt_vec3_make(0.0, 0.0, 0.0), z = kt_vec3_make(0.0, 0.0, 1.0);
    j->at = j->type != KT_MJCF_FREE ? kt_pose_apply(frame, kt_mjcf_vector(m, e, j->tag, "pos", zero)) : zero;
    j->axis = kt_mat3_apply(frame.rotation, kt_mjcf_vector(m, e, j->tag, "axis", z));
    if (!(kt_vec3_norm_wide(j->axis) > 0.0) && kt_mjcf_is_scalar(j)) {
        (void)kt_mjcf_fault(m, e, "axis: the axis is zero");
        j->axis = z;
    }
    if (kt_mjcf_is_scalar(j)) {
        j->ref = j->start = angle_of(m, j) * kt_mjcf_number(m, e, j->tag, "ref", 0.0);
        j->spring = angle_of(m, j) * kt_mjcf_number(m, e, j->tag, "springref", 0.0);
    }
    read_force(m, j);
    read_range(m, j);
    j->position = m->nq;
    j->velocity = m->nv;
    m->nq += kt_mjcf_nq(j->type);
    m->nv += kt_mjcf_nv(j->type);
    kt_mjcf_body_at(m, body)->joint_count++;
    kt_mjcf_add_name(m, KT_MJCF_JOINTS, e, index);
}

/* A free joint is the only joint of its body, and the body is on the world. */
static void check_joints(kt_mjcf *m, int body) {
    const kt_mjcf_body *b = kt_mjcf_body_at(m, body);
    for (int i = 0; i < b->joint_count; i++) {
        const kt_mjcf_joint *j = kt_mjcf_joint_at(m, b->first_joint + i);
        if (body == 0)
            (void)kt_mjcf_fault(m, j->element, "the world has no joints; put it into a <body>");
        else if (j->type == KT_MJCF_FREE && (b->joint_count > 1 || b->parent != 0))
            (void)kt_mjcf_fault(m, j->element, "a free joint is the only joint of a body of the world");
    }
}

/* ---- collecting -------------------------------------------------------------------------------------------------- */

static void add_site(kt_mjcf *m, const kt_element *e, int body, kt_pose frame) {
    kt_mjcf_add_name(m, KT_MJCF_SITES, e, m->sites.count);
    kt_mjcf_site *site = kt_list_add(m->r, &m->r->scratch, &m->sites, sizeof *site);
    if (site != NULL)
        *site = (kt_mjcf_site){.element = e, .body = body, .pose = kt_pose_compose(frame, kt_mjcf_pose(m, e, "site"))};
}

static void add_mjcf_body(kt_mjcf *m, const kt_element *e, int parent, kt_pose frame);

/* Collects the joints and sites directly in a body, then the bodies in it. MuJoCo numbers joints in this order. */
static void collect_body(kt_mjcf *m, int body) {
    const kt_element *e = kt_mjcf_body_at(m, body)->element;
    kt_mjcf_body_at(m, body)->first_joint = m->joints.count;
    kt_mjcf_for_each(m, e, "joint", body, add_mjcf_joint);
    kt_mjcf_for_each(m, e, "freejoint", body, add_mjcf_joint);
    check_joints(m, body);
    kt_mjcf_for_each(m, e, "site", body, add_site);
    kt_mjcf_for_each(m, e, "geom", body, kt_mjcf_add_wrap);
    kt_mjcf_for_each(m, e, "body", body, add_mjcf_body);
}

/* frame: the pose in the parent of the <frame> around the body. */
static void add_mjcf_body(kt_mjcf *m, const kt_element *e, int parent, kt_pose frame) {
    const int index = m->bodies.count;
    kt_mjcf_body *b = kt_list_add(m->r, &m->r->scratch, &m->bodies, sizeof *b);
    if (b == NULL)
        return;
    *b = (kt_mjcf_body){.element = e, .parent = parent, .frame = kt_pose_identity()};
    kt_mjcf_body_at(m, parent)->child_count++;
    b->pose = kt_pose_compose(frame, kt_mjcf_pose(m, e, NULL));
    b->world = kt_pose_compose(kt_mjcf_body_at(m, parent)->world, b->pose);
    b->gravcomp = kt_mjcf_number(m, e, NULL, "gravcomp", 0.0);
    kt_mjcf_add_name(m, KT_MJCF_BODIES, e, index);
    if (kt_mjcf_flag(m, e, NULL, "mocap", false))
        kt_left_count(&m->notes.mocap, e);
    collect_body(m, index);
    b = kt_mjcf_body_at(m, index); /* the list may have moved */
    b->is_freed = m->source->options->floating && b->joint_count == 0 && parent == 0;
}

/* Names in the order of the file. Bodies with a given name come first, so that they keep it. */
static void name_mjcf_bodies(kt_mjcf *m) {
    for (int pass = 0; pass < 2; pass++)
        for (int i = 1; i < m->bodies.count; i++) {
            kt_mjcf_body *b = kt_mjcf_body_at(m, i);
            const char *name = kt_element_name(b->element, NULL);
            if ((name != NULL) != (pass == 0))
                continue;
            b->name = kt_namer_make(&m->bodies_named, name != NULL ? name : "body");
            if (name != NULL && strcmp(name, b->name) != 0)
                kt_left_count(&m->notes.renamed, b->element);
        }
}

/* `align`: a free body that carries nothing has the frame of its inertia. */
static void align_free(kt_mjcf *m, kt_mjcf_body *b) {
    static const char *const words[] = {"false", "true", "auto", NULL};
    const kt_mjcf_joint *j = b->joint_count == 1 ? kt_mjcf_joint_at(m, b->first_joint) : NULL;
    if (j == NULL || j->type != KT_MJCF_FREE || b->child_count > 0 || !(b->mass > 0.0))
        return;
    const int align = kt_mjcf_choice(m, j->element, NULL, "align", words, j->tag == NULL ? 2 : 0);
    if (align == 0 || (align == 2 && !kt_mjcf_settings_of(m, b->element)->align_free))
        return;
    b->frame = b->inertial;
    if (!b->has_axes)
        b->frame.position = b->com;
    b->frame.rotation = kt_mjcf_axes_of_body(b);
    if (kt_mjcf_has_doubtful_axes(b))
        kt_unknown_count(
            &m->changes,
            "a free body whose frame is that of a mesh with equal moments of inertia (align): positions of a keyframe "
            "may be about other axes",
            j->element);
}

void kt_mjcf_collect(kt_mjcf *m) {
    kt_mjcf_body *world = kt_list_add(m->r, &m->r->scratch, &m->bodies, sizeof *world);
    if (world == NULL)
        return;
    *world = (kt_mjcf_body){.element = m->root,
                            .parent = -1,
                            .pose = kt_pose_identity(),
                            .world = kt_pose_identity(),
                            .frame = kt_pose_identity()};
    (void)kt_names_add(&m->names, KT_MJCF_BODIES, "world", 0);
    collect_body(m, 0);
    if (m->r->out_of_memory)
        return;
    name_mjcf_bodies(m);
    kt_mjcf_read_meshes(m);
    for (int i = 0; i < m->bodies.count; i++)
        kt_mjcf_masses(m, i);
    kt_mjcf_settle_masses(m);
    for (int i = 1; i < m->bodies.count; i++)
        align_free(m, kt_mjcf_body_at(m, i));
}

/* ---- bodies of the scene ----------------------------------------------------------------------------------------- */

/* A free joint counts from the world, not from the pose of the body, at which it starts. */
static void fill_free(const kt_mjcf *m, const kt_mjcf_joint *j, kt_joint *joint) {
    kt_joint_set_free(joint, kt_mjcf_place_of(m, j->body));
    if (m->qpos != NULL)
        memcpy(joint->position, m->qpos + j->position, 7 * sizeof(double));
    if (m->qvel != NULL)
        memcpy(joint->velocity, m->qvel + j->velocity, 6 * sizeof(double));
}

/* A joint frame in the parent, at the joint's point; `frame` becomes that of the body in it. */
static void fill_mjcf_joint(kt_mjcf *m, const kt_mjcf_body *b, const kt_mjcf_joint *j, kt_pose *frame,
                            kt_joint *joint) {
    static const kt_joint_type types[] = {KT_JOINT_FREE, KT_JOINT_SPHERICAL, KT_JOINT_PRISMATIC, KT_JOINT_REVOLUTE};
    const double armature = kt_mjcf_number(m, j->element, j->tag, "armature", 0.0);
    joint->type = types[j->type];
    for (int i = 0; i < kt_mjcf_nv(j->type); i++)
        joint->armature[i] = armature;
    if (j->type == KT_MJCF_FREE) {
        fill_free(m, j, joint);
        *frame = kt_pose_invert(b->frame);
        return;
    }
    const kt_vec3 axis = kt_vec3_normalize(j->axis);
    const kt_vec3 at = j->type == KT_MJCF_SLIDE ? kt_vec3_make(0.0, 0.0, 0.0) : j->at;
    kt_mat3 turn = frame->rotation;
    joint->axis = j->axis;
    joint->at = kt_pose_apply(*frame, j->type == KT_MJCF_SLIDE ? kt_vec3_scale(-j->ref, axis) : at);
    if (j->type == KT_MJCF_HINGE && j->ref != 0.0)
        turn = kt_mat3_multiply(turn, kt_mat3_from_euler_vector(kt_vec3_scale(-j->ref, axis)));
    joint->rotation = kt_rotation_of_matrix(turn);
    *frame = (kt_pose){.rotation = kt_mat3_identity(), .position = kt_vec3_scale(-1.0, at)};
    if (j->is_limited) {
        joint->limits.lower = j->lower;
        joint->limits.upper = j->upper;
    }
    joint->limits.effort = j->effort;
    if (j->type != KT_MJCF_BALL)
        joint->position[0] = j->start;
    else if (m->qpos != NULL)
        memcpy(joint->position, m->qpos + j->position, (size_t)kt_mjcf_nq(j->type) * sizeof(double));
    if (m->qvel != NULL)
        memcpy(joint->velocity, m->qvel + j->velocity, (size_t)kt_mjcf_nv(j->type) * sizeof(double));
}

static bool is_zero_vec3(kt_vec3 v) { return v.x == 0.0 && v.y == 0.0 && v.z == 0.0; }

/* The name of the body that carries a joint which is not the last, or whose point is not the body's origin. */
static const char *carrier_name(kt_mjcf *m, const kt_mjcf_joint *j, const char *body) {
    char made[300];
    (void)snprintf(made, sizeof made, "%.200s_joint", body);
    return kt_namer_make(&m->bodies_named, kt_element_name(j->element, made));
}

static void fill_body(const kt_mjcf_body *b, kt_body *body) {
    body->mass = b->mass;
    body->com = b->com;
    body->inertia = b->inertia;
    body->shape = b->shape;
    body->shapes = b->shapes;
    body->shape_count = b->shape_count;
    body->markers = b->markers.items;
    body->marker_count = b->markers.count;
}

/* Whether a free joint moves the body itself, not the frame of its inertia. */
static bool stands_free(const kt_mjcf_body *b, const kt_mjcf_joint *j) {
    const kt_pose identity = kt_pose_identity();
    return j->type == KT_MJCF_FREE && kt_same_bits(&b->frame, &identity, sizeof identity);
}

/* Makes one body of the scene for each joint (top of the file). The last one is the body itself if it `is_own`;
 * otherwise the body is fixed to it. */
static void make_mjcf_body(kt_mjcf *m, int index) {
    const kt_mjcf_body *b = kt_mjcf_body_at(m, index);
    const char *parent = kt_mjcf_body_at(m, b->parent)->name;
    kt_pose frame = kt_mjcf_mocap_pose(m, b);
    kt_body *body = NULL;
    for (int i = 0; i < b->joint_count; i++) {
        kt_mjcf_joint *j = kt_mjcf_joint_at(m, b->first_joint + i);
        const bool is_last = i == b->joint_count - 1;
        const bool is_own = is_last && (stands_free(b, j) || j->type == KT_MJCF_SLIDE ||
                                        (j->type != KT_MJCF_FREE && is_zero_vec3(j->at)));
        body = kt_draft_body(&m->draft, j->element, b->element);
        if (body == NULL)
            return;
        j->carrier_index = m->draft.bodies.count - 1;
        *kt_draft_joint_name(&m->draft, j->carrier_index) = kt_element_name(j->element, NULL);
        body->name = j->carrier = is_own ? b->name : carrier_name(m, j, b->name);
        body->parent = parent;
        fill_mjcf_joint(m, b, j, &frame, &body->joint);
        parent = body->name;
        if (!is_last)
            kt_left_count(&m->notes.several, j->element);
        else if (!is_own)
            kt_left_count(&m->notes.offsets, j->element);
    }
    if (body == NULL || body->name != b->name) {
        body = kt_draft_body(&m->draft, b->element, b->element);
        if (body == NULL)
            return;
        body->name = b->name;
        body->parent = parent;
        body->joint.at = frame.position;
        body->joint.rotation = kt_rotation_of_matrix(frame.rotation);
        if (b->is_freed) {
            body->joint.type = KT_JOINT_FREE;
            kt_left_count(&m->notes.freed, b->element);
        } else if (b->joint_count == 0 && b->parent == 0) {
            kt_left_count(&m->notes.fixed_bodies, b->element);
        }
    }
    *kt_draft_link_name(&m->draft, m->draft.bodies.count - 1) = kt_element_name(b->element, b->name);
    fill_body(b, body);
}

/* Sites with names are markers of their bodies; of the world's none is. */
static void make_markers(kt_mjcf *m) {
    for (int i = 0; i < m->sites.count; i++) {
        const kt_mjcf_site *site = kt_mjcf_site_at(m, i);
        const char *name = kt_xml_attribute(site->element, "name");
        kt_mjcf_body *b = kt_mjcf_body_at(m, site->body);
        if (name == NULL || site->body == 0 || !kt_name_is_valid(name)) {
            kt_left_count(&m->notes.unnamed_sites, site->element);
            continue;
        }
        kt_marker *marker = kt_list_add(m->r, &m->r->keep, &b->markers, sizeof *marker);
        char *copy = kt_reader_text(m->r, &m->r->keep, name, strlen(name));
        if (marker == NULL || copy == NULL)
            return;
        *marker = (kt_marker){
            .name = copy, .at = site->pose.position, .rotation = kt_rotation_of_matrix(site->pose.rotation)};
    }
}

static void name_mjcf_joints(kt_mjcf *m) {
    const kt_body *bodies = m->draft.bodies.items;
    kt_draft_name_joints(&m->draft, &m->joints_named);
    for (int i = 0; i < m->joints.count; i++) {
        kt_mjcf_joint *j = kt_mjcf_joint_at(m, i);
        j->name = kt_joint_name_of(&bodies[j->carrier_index]);
    }
}

void kt_mjcf_make_bodies(kt_mjcf *m) {
    make_markers(m);
    kt_mjcf_place_media(m);
    for (int i = 1; i < m->bodies.count && !m->r->out_of_memory; i++)
        make_mjcf_body(m, i);
    if (m->r->out_of_memory)
        return;
    name_mjcf_joints(m);
    kt_masses_give(&m->draft, m->source->options);
}
