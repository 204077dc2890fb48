/* Links and joints of SDF as bodies and loops of a description.
 *
 * A link is a body, and the joint that carries it is its joint. X is the pose of the link in its carrier while the
 * joint is at zero. The joint's axis then has a direction a and a point p in the link. If the axis meets the link's
 * origin, or if the point does not matter, the joint has the pose X. Else a body without mass, with the joint's name,
 * turns in X shift(p), and the link is fixed to it at -p.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/joint_name.h"
#include "robot/sdf.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* Adds "A::B::name" below the root's scope. make_sdf_name counts a changed name at e (NULL: not). */
static void add_path(const kt_sdf *m, kt_phrase *phrase, int frame) {
    const kt_sdf_frame *f = kt_sdf_frame_at(m, frame);
    if (f->scope != m->root_scope && f->scope > 0) {
        add_path(m, phrase, f->scope);
        kt_phrase_add(phrase, "::");
    }
    kt_phrase_add(phrase, "%s", f->name != NULL ? f->name : "");
}

/* The whole path, and an ending. */
static const char *keep_path(kt_sdf *m, int frame, const char *ending) {
    kt_phrase path = {.length = 0};
    add_path(m, &path, frame);
    kt_phrase_add(&path, "%s", ending);
    return kt_reader_text(m->r, &m->r->scratch, path.text, strlen(path.text));
}

static const char *make_sdf_name(kt_sdf *m, int frame, const kt_element *e) {
    kt_phrase path = {.length = 0};
    add_path(m, &path, frame);
    const char *name = kt_namer_make(&m->bodies_named, path.text);
    if (e != NULL && strcmp(name, path.text) != 0)
        kt_left_count(&m->renamed, e);
    return name;
}

/* Names the links of the file first, so that their names stay unchanged. The links between the halves of a joint, which
 * the reader has added, then take names that are left. */
static void name_links(kt_sdf *m) {
    for (int pass = 0; pass < 2; pass++)
        for (int i = 1; i < m->links.count; i++) {
            kt_sdf_link *link = kt_sdf_link_at(m, i);
            if (link->is_between == (pass == 1))
                link->body = make_sdf_name(m, link->frame, link->element);
        }
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

static kt_body *add_sdf_body(kt_sdf *m, const kt_element *e, const kt_element *link, const char *name, int parent) {
    kt_body *body = kt_draft_body(&m->draft, e, link);
    if (body == NULL)
        return NULL;
    body->name = name;
    body->parent = parent >= 0 ? ((const kt_body *)m->draft.bodies.items)[parent].name : NULL;
    return body;
}

static void stand(kt_joint *joint, kt_pose pose) {
    joint->at = pose.position;
    joint->rotation = kt_rotation_of_matrix(pose.rotation);
}

/* A link that no joint carries is fixed or free; its coordinates are those in the world. */
static void root_joint(kt_sdf *m, const kt_sdf_link *link, kt_joint *joint) {
    const kt_pose pose = kt_sdf_pose(m, link->frame, 0);
    if (link->is_static) {
        stand(joint, pose);
        kt_left_count(&m->at_rest, link->element);
        return;
    }
    kt_joint_set_free(joint, pose);
    kt_left_count(&m->floating, link->element);
}

/* The part of the joint's point that matters; zero if it is rounding. */
static kt_vec3 offset_of(const kt_sdf_joint *j, kt_vec3 point, kt_vec3 axis) {
    const kt_vec3 zero = kt_vec3_make(0.0, 0.0, 0.0);
    kt_vec3 across = point;
    if (j->type == KT_JOINT_FIXED || j->type == KT_JOINT_PRISMATIC)
        return zero;
    if (j->type != KT_JOINT_SPHERICAL)
        across = kt_vec3_sub(point, kt_vec3_scale(kt_vec3_dot(point, axis), axis));
    return kt_vec3_norm(across) > 16.0 * DBL_EPSILON * kt_vec3_norm(point) ? point : zero;
}

/* Sets the type, the axis and the pose of a joint. */
static void set_joint(kt_sdf *m, const kt_sdf_joint *j, kt_pose pose, kt_vec3 axis, kt_joint *joint) {
    stand(joint, pose);
    joint->type = j->type;
    if (kt_sdf_is_scalar(j))
        joint->axis = axis;
    joint->pitch = j->pitch;
    if (m->source->options->floating && j->type == KT_JOINT_FIXED && j->parent == 0) {
        *joint = kt_joint_default();
        kt_joint_set_free(joint, pose);
        kt_left_count(&m->freed, j->element);
    }
}

/* A link between two axes, one of which closes a loop: both axes form one loop. */
static bool ends_a_loop(const kt_sdf *m, const kt_sdf_link *link) {
    return link->is_between && !kt_sdf_other_half(m, link, kt_sdf_joint_at(m, link->carrier))->is_used;
}

/* The last body has the joint, and its name. The second of two axes has the suffix "_2". */
static void want_name(kt_sdf *m, kt_sdf_joint *j) {
    const bool is_second = kt_sdf_joint_at(m, kt_sdf_frame_at(m, j->frame)->link) != j;
    j->body = m->draft.bodies.count - 1;
    *kt_draft_joint_name(&m->draft, j->body) = keep_path(m, j->frame, is_second ? "_2" : "");
}

static void make_sdf_body(kt_sdf *m, int index) {
    kt_sdf_link *link = kt_sdf_link_at(m, index);
    if (ends_a_loop(m, link))
        return;
    kt_sdf_joint *j = link->carrier >= 0 ? kt_sdf_joint_at(m, link->carrier) : NULL;
    const kt_sdf_link *on = j != NULL ? kt_sdf_link_at(m, j->is_reversed ? j->child : j->parent) : NULL;
    const kt_element *e = j != NULL ? j->element : link->element;
    kt_body *body;
    link->rigid = j != NULL && j->type == KT_JOINT_FIXED ? on->rigid : link->is_static ? 0 : index;
    if (j == NULL) {
        body = add_sdf_body(m, e, link->element, link->body, -1);
        if (body != NULL)
            root_joint(m, link, &body->joint);
    } else {
        const kt_pose pose = kt_sdf_pose(m, link->frame, on->frame);
        kt_vec3 axis = kt_vec3_normalize(kt_sdf_axis_in(m, j, link->frame));
        const kt_vec3 point = offset_of(j, kt_sdf_pose(m, j->frame, link->frame).position, axis);
        const bool is_off = point.x != 0.0 || point.y != 0.0 || point.z != 0.0;
        if (j->is_reversed)
            axis = kt_vec3_scale(-1.0, axis);
        body = add_sdf_body(m, e, link->element, is_off ? make_sdf_name(m, j->frame, NULL) : link->body, on->index);
        if (body == NULL)
            return;
        want_name(m, j);
        set_joint(m, j, (kt_pose){pose.rotation, kt_pose_apply(pose, point)}, axis, &body->joint);
        if (is_off) {
            kt_left_count(&m->offsets, e);
            body = add_sdf_body(m, e, link->element, link->body, m->draft.bodies.count - 1);
            if (body != NULL)
                body->joint.at = kt_vec3_scale(-1.0, point);
        }
    }
    link->index = m->draft.bodies.count - 1;
    if (body == NULL || link->is_between)
        return;
    *kt_draft_link_name(&m->draft, link->index) = keep_path(m, link->frame, "");
    kt_sdf_masses(m, link, body);
    kt_sdf_picture(m, link, body);
}

/* Effects and loops call joints by their names. */
static void name_sdf_joints(kt_sdf *m) {
    kt_draft_name_joints(&m->draft, &m->joints_named);
    for (int i = 0; i < m->joints.count; i++) {
        kt_sdf_joint *j = kt_sdf_joint_at(m, i);
        if (j->body >= 0 && j->type != KT_JOINT_FIXED)
            j->name = kt_joint_name_of((const kt_body *)m->draft.bodies.items + j->body);
    }
}

void kt_sdf_make_bodies(kt_sdf *m) {
    const int most = m->links.count + m->joints.count + 1;
    if (!kt_namer_init(&m->bodies_named, m->r, most) || !kt_namer_init(&m->joints_named, m->r, 2 * most))
        return;
    name_links(m);
    for (int i = 1; i < m->order_count && !m->r->out_of_memory; i++)
        make_sdf_body(m, m->order[i]);
    if (kt_draft_is_wrong(&m->draft))
        return;
    name_sdf_joints(m);
    kt_inertias_check(&m->inertias, &m->draft, m->source->options);
    kt_masses_give(&m->draft, m->source->options);
}

/* ---- loops ------------------------------------------------------------------------------------------------------- */

/* The joint's frame, with the direction of its axis, in a link. */
static kt_end sdf_end_of(const kt_sdf *m, const kt_sdf_joint *j, int link) {
    const kt_sdf_link *on = kt_sdf_link_at(m, link);
    return kt_end_at(on->body, kt_sdf_pose(m, j->frame, on->frame));
}

/* Whether effects that name a loop act in it: a joint of its name comes first. */
static bool is_joint_name(const kt_sdf *m, const char *name) {
    for (int i = 0; i < m->joints.count; i++)
        if (kt_sdf_joint_at(m, i)->name != NULL && strcmp(kt_sdf_joint_at(m, i)->name, name) == 0)
            return true;
    return false;
}

/* The loop of a joint between two links: its type, axes and ends. */
static void fill_loop(kt_sdf *m, const kt_sdf_joint *first, const kt_sdf_joint *last, kt_loop *loop) {
    loop->between[0] = sdf_end_of(m, first, first->parent);
    loop->between[1] = sdf_end_of(m, first, last->child);
    if (kt_sdf_is_scalar(first))
        loop->axis = kt_sdf_axis_in(m, first, first->frame);
    if (loop->type == KT_LOOP_UNIVERSAL)
        loop->axis2 = kt_sdf_axis_in(m, last, first->frame);
    loop->pitch = first->pitch;
    kt_left_count(&m->loops, first->element);
    const bool has_name = first == last && kt_sdf_is_scalar(first) && !is_joint_name(m, loop->name);
    const bool first_is_lost = kt_sdf_resist(m, first, has_name ? loop->name : NULL);
    if ((first != last && kt_sdf_resist(m, last, NULL)) || first_is_lost)
        kt_left_count(&m->loop_forces, first->element);
}

/* A piston is a cylindrical loop. A joint that turns about two axes is a universal loop if the axes are normal. */
static kt_loop_type pair_type(kt_sdf *m, const kt_sdf_joint *first, const kt_sdf_joint *last) {
    const kt_vec3 a = kt_vec3_normalize(kt_sdf_axis_in(m, first, first->frame));
    const kt_vec3 b = kt_vec3_normalize(kt_sdf_axis_in(m, last, first->frame));
    if (last->type == KT_JOINT_PRISMATIC)
        return KT_LOOP_CYLINDRICAL;
    if (fabs(kt_vec3_dot(a, b)) > 1e-9)
        (void)kt_robot_fault(m->r, first->element,
                             "the joint closes a loop, and its axes are not normal to each other: the cosine is %g; a "
                             "scene has no such loop",
                             kt_vec3_dot(a, b));
    return KT_LOOP_UNIVERSAL;
}

/* Both halves of a joint of two axes form one loop, between the parent of the first and the child of the last half. */
static void close_loop(kt_sdf *m, kt_sdf_joint *j) {
    static const kt_loop_type types[KT_JOINT_TYPE_COUNT] = {
        [KT_JOINT_FIXED] = KT_LOOP_WELD,          [KT_JOINT_REVOLUTE] = KT_LOOP_REVOLUTE,
        [KT_JOINT_PRISMATIC] = KT_LOOP_PRISMATIC, [KT_JOINT_SCREW] = KT_LOOP_SCREW,
        [KT_JOINT_SPHERICAL] = KT_LOOP_SPHERICAL,
    };
    const kt_sdf_link *parent = kt_sdf_link_at(m, j->parent), *child = kt_sdf_link_at(m, j->child);
    const kt_sdf_joint *first = parent->is_between ? kt_sdf_other_half(m, parent, j) : j;
    const kt_sdf_joint *last = child->is_between ? kt_sdf_other_half(m, child, j) : j;
    if (kt_sdf_link_at(m, first->parent)->rigid == kt_sdf_link_at(m, last->child)->rigid) {
        kt_left_count(&m->still_joints, j->element);
        return;
    }
    const char *name = kt_xml_attribute(j->element, "name");
    const kt_loop_type type = first != last ? pair_type(m, first, last) : types[j->type];
    kt_loop *loop = kt_draft_loop(&m->draft, j->element, type, name != NULL ? name : "loop");
    if (loop != NULL)
        fill_loop(m, first, last, loop);
}

void kt_sdf_make_loops(kt_sdf *m) {
    for (int i = 0; i < m->joints.count && !m->r->out_of_memory; i++)
        if (!kt_sdf_joint_at(m, i)->is_used)
            close_loop(m, kt_sdf_joint_at(m, i));
}
