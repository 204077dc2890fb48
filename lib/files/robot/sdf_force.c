/* Forces in the joints of SDF as effects, gearboxes and mimics as couplings.
 *
 * A gearbox relates two angles as seen from its reference body: t1 of its parent about `axis`, and t2 of its child
 * about `axis2`.
 *     t2 = -ratio t1
 * Such an angle is the sum of the positions of the rotary joints on the path between the two bodies, each counted along
 * the axis. All of these joints must turn about parallels of the axis.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/sdf.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

/* ---- forces in joints -------------------------------------------------------------------------------------------- */

/* A limit; infinite if it is missing, or is the format's value for no limit. */
static double read_limit(kt_sdf *m, const kt_element *limit, const char *which, double standard) {
    const char *text = kt_sdf_text(limit, which);
    if (text == NULL || strcasecmp(text, "inf") == 0 || strcasecmp(text, "-inf") == 0)
        return standard;
    const double value = kt_sdf_number(m, limit, which, standard);
    return fabs(value) >= 1e16 ? standard : value;
}

/* A limit of effort or speed; below zero there is none. */
static double read_rate(kt_sdf *m, const kt_element *limit, const char *which) {
    const double value = read_limit(m, limit, which, (double)INFINITY);
    return value >= 0.0 ? value : (double)INFINITY;
}

static const kt_element *limit_of(const kt_sdf_joint *j) {
    return j->axis != NULL ? kt_xml_child(j->axis, "limit") : NULL;
}

/* Limits of position; false if there are none. */
static bool read_position_limits(kt_sdf *m, const kt_sdf_joint *j, double *lower, double *upper) {
    *lower = read_limit(m, limit_of(j), "lower", -(double)INFINITY);
    *upper = read_limit(m, limit_of(j), "upper", (double)INFINITY);
    return !(isinf(*lower) && isinf(*upper)) && strcmp(kt_xml_attribute(j->element, "type"), "continuous") != 0;
}

/* The limits of a joint in the tree, which are data. */
static void set_limits(kt_sdf *m, const kt_sdf_joint *j) {
    kt_joint *joint = &kt_draft_body_at(&m->draft, j->body)->joint;
    double lower, upper;
    joint->limits.effort = read_rate(m, limit_of(j), "effort");
    joint->limits.velocity = read_rate(m, limit_of(j), "velocity");
    if (!read_position_limits(m, j, &lower, &upper) || lower > upper)
        return;
    joint->limits.lower = lower;
    joint->limits.upper = upper;
    if (lower > joint->position[0] || upper < joint->position[0])
        kt_left_count(&m->outside, limit_of(j));
}

/* A joint starts at its initial_position, else at zero. */
static void start_joint(kt_sdf *m, const kt_sdf_joint *j) {
    kt_joint *joint = &kt_draft_body_at(&m->draft, j->body)->joint;
    if (j->axis != NULL && kt_sdf_is_scalar(j))
        joint->position[0] = kt_sdf_number(m, j->axis, "initial_position", joint->position[0]);
}

bool kt_sdf_resist(kt_sdf *m, const kt_sdf_joint *j, const char *name) {
    const kt_robot_options *options = m->source->options;
    const kt_element *dynamics = j->axis != NULL ? kt_xml_child(j->axis, "dynamics") : NULL;
    const double damping = kt_sdf_number(m, dynamics, "damping", 0.0);
    const double friction = kt_sdf_number(m, dynamics, "friction", 0.0);
    const double stiffness = kt_sdf_number(m, dynamics, "spring_stiffness", 0.0);
    double lower, upper;
    const bool has_limits = read_position_limits(m, j, &lower, &upper);
    if (has_limits && lower > upper)
        kt_left_count(&m->disordered, limit_of(j));
    const bool has_order = has_limits && lower <= upper;
    if (name == NULL)
        return damping != 0.0 || friction != 0.0 || stiffness != 0.0 || has_order;
    if (has_order && !kt_robot_has_stops(options))
        kt_left_count(&m->limits, limit_of(j));
    if (stiffness != 0.0)
        kt_draft_spring(&m->draft, j->element, name, stiffness, kt_sdf_number(m, dynamics, "spring_reference", 0.0));
    kt_draft_resistance(&m->draft, j->element, name, damping, friction);
    if (friction != 0.0)
        kt_left_count(&m->friction, j->element);
    if (has_order)
        kt_draft_stop(&m->draft, j->element, options, name, lower, upper);
    if (has_order && j->name == NULL && (lower > 0.0 || upper < 0.0)) /* in a loop, which starts at zero */
        kt_left_count(&m->outside, limit_of(j));
    return false;
}

/* ---- links without weight ---------------------------------------------------------------------------------------- */

static void float_link(kt_sdf *m, const kt_sdf_link *link) {
    const kt_body *body = (const kt_body *)m->draft.bodies.items + link->index;
    if (kt_sdf_flag(m, link->element, "kinematic", false))
        kt_left_count(&m->kinematic, link->element);
    if (!link->is_static && !kt_sdf_flag(m, link->element, "gravity", true) &&
        kt_draft_lift(&m->draft, link->element, body, m->gravity, 1.0))
        kt_left_count(&m->no_gravity, link->element);
}

void kt_sdf_make_effects(kt_sdf *m) {
    for (int i = 0; i < m->joints.count && !m->r->out_of_memory; i++) {
        const kt_sdf_joint *j = kt_sdf_joint_at(m, i);
        if (j->name == NULL || !kt_sdf_is_scalar(j))
            continue;
        (void)kt_sdf_resist(m, j, j->name);
        start_joint(m, j);
        set_limits(m, j);
    }
    for (int i = 1; i < m->links.count && !m->r->out_of_memory; i++)
        if (!kt_sdf_link_at(m, i)->is_between)
            float_link(m, kt_sdf_link_at(m, i));
}

/* ---- couplings --------------------------------------------------------------------------------------------------- */

static void couple_sdf_joints(kt_sdf *m, const kt_element *e, const char *name, const kt_term *terms, int count,
                              double offset) {
    kt_term *kept;
    kt_loop *loop = kt_draft_coupling(&m->draft, e, name, count, &kept);
    if (loop == NULL)
        return;
    memcpy(kept, terms, (size_t)count * sizeof *kept);
    loop->offset = offset;
}

/* The joint of a named axis, if it has a coordinate in the tree. */
static const kt_sdf_joint *find_axis(const kt_sdf *m, int frame, const char *axis) {
    const int first = kt_sdf_frame_at(m, frame)->kind == KT_SDF_JOINT ? kt_sdf_frame_at(m, frame)->link : -1;
    const int index = first >= 0 && kt_text_is(axis, "axis2") ? first + 1 : first;
    const kt_sdf_joint *found = index >= 0 && index < m->joints.count ? kt_sdf_joint_at(m, index) : NULL;
    return found != NULL && found->frame == frame && found->name != NULL && kt_sdf_is_scalar(found) ? found : NULL;
}

/* q = multiplier (q' - reference) + offset. */
static void mimic(kt_sdf *m, const kt_sdf_joint *j, const kt_element *e) {
    const char *leader = kt_xml_attribute(e, "joint"), *axis = kt_xml_attribute(e, "axis");
    const double multiplier = kt_sdf_number(m, e, "multiplier", 1.0), offset = kt_sdf_number(m, e, "offset", 0.0);
    const double reference = kt_sdf_number(m, e, "reference", 0.0);
    if (leader == NULL) {
        (void)kt_robot_fault(m->r, e, "the attribute 'joint' is missing");
        return;
    }
    const int frame = kt_sdf_find(m, e, j->frame, leader);
    const kt_sdf_joint *other = frame >= 0 ? find_axis(m, frame, axis) : NULL;
    if (frame < 0)
        return;
    if (other == NULL || j->name == NULL || other == j) {
        kt_left_count(&m->lost_mimics, e);
        return;
    }
    const kt_term terms[] = {{j->name, 1.0}, {other->name, -multiplier}};
    char name[160];
    (void)snprintf(name, sizeof name, "mimic_%.120s", j->name);
    couple_sdf_joints(m, e, name, terms, 2, offset - multiplier * reference);
    kt_left_count(&m->mimics, e);
}

/* ---- gearboxes --------------------------------------------------------------------------------------------------- */

enum { TERMS_MOST = 256 };

typedef struct angle {
    kt_term terms[TERMS_MOST];
    int count;
    bool is_none; /* it is no sum of joints' positions */
} angle;

/* Adds the joint that carries a link, seen along an axis of the world. Returns the link at its other end. */
static int climb(const kt_sdf *m, int link, kt_vec3 axis, double factor, angle *a) {
    const kt_sdf_link *l = kt_sdf_link_at(m, link);
    if (l->carrier < 0) {
        a->is_none = true;
        return link;
    }
    const kt_sdf_joint *j = kt_sdf_joint_at(m, l->carrier);
    const kt_vec3 direction = kt_vec3_normalize(kt_sdf_axis_in(m, j, 0));
    const double along = kt_vec3_dot(direction, axis);
    const bool turns = j->type == KT_JOINT_REVOLUTE || j->type == KT_JOINT_SCREW;
    if ((turns && fabs(along) < 1.0 - 1e-9) || j->type == KT_JOINT_SPHERICAL || (turns && a->count == TERMS_MOST))
        a->is_none = true;
    else if (turns)
        a->terms[a->count++] = (kt_term){j->name, (j->is_reversed ? -factor : factor) * (along > 0.0 ? 1.0 : -1.0)};
    return j->is_reversed ? j->child : j->parent;
}

/* Adds factor times the angle of a link as seen from another. */
static void add_angle(const kt_sdf *m, int of, int from, kt_vec3 axis, double factor, angle *a) {
    enum { STEPS_MOST = 1000 };
    for (int steps = 0; of != from && !a->is_none; steps++) {
        const bool is_upper = kt_sdf_link_at(m, of)->depth >= kt_sdf_link_at(m, from)->depth;
        a->is_none = steps == STEPS_MOST;
        if (is_upper)
            of = climb(m, of, axis, factor, a);
        else
            from = climb(m, from, axis, -factor, a);
    }
}

/* t2 + ratio t1 = 0. */
static void gear(kt_sdf *m, int frame) {
    const kt_element *e = kt_sdf_frame_at(m, frame)->element;
    const int parent = kt_sdf_link_named(m, frame, "parent"), child = kt_sdf_link_named(m, frame, "child");
    const bool has_reference = kt_sdf_text(e, "gearbox_reference_body") != NULL;
    const int reference = has_reference ? kt_sdf_link_named(m, frame, "gearbox_reference_body") : -1;
    const double ratio = kt_sdf_number(m, e, "gearbox_ratio", 1.0);
    angle a = {.count = 0};
    kt_vec3 axes[2];
    for (int i = 0; i < 2; i++) {
        kt_sdf_joint j = {.element = e, .frame = frame, .type = KT_JOINT_REVOLUTE};
        kt_sdf_read_axis(m, &j, i == 0 ? "axis" : "axis2");
        axes[i] = kt_vec3_normalize(kt_sdf_axis_in(m, &j, 0));
    }
    if (reference < 0 || parent < 0 || child < 0) {
        kt_left_count(&m->lost_gears, e);
        return;
    }
    add_angle(m, child, reference, axes[1], 1.0, &a);
    add_angle(m, parent, reference, axes[0], ratio, &a);
    const int count = kt_terms_merge(a.terms, a.count);
    if (a.is_none || count == 0) {
        kt_left_count(&m->lost_gears, e);
        return;
    }
    couple_sdf_joints(m, e, kt_sdf_frame_at(m, frame)->name != NULL ? kt_sdf_frame_at(m, frame)->name : "gearbox",
                      a.terms, count, 0.0);
    kt_left_count(&m->gearboxes, e);
}

void kt_sdf_couple(kt_sdf *m) {
    for (int i = 0; i < m->gears.count && !m->r->out_of_memory; i++)
        gear(m, ((const int *)m->gears.items)[i]);
    for (int i = 0; i < m->joints.count && !m->r->out_of_memory; i++) {
        const kt_sdf_joint *j = kt_sdf_joint_at(m, i);
        const kt_element *e = j->axis != NULL ? kt_xml_child(j->axis, "mimic") : NULL;
        if (e != NULL)
            mimic(m, j, e);
    }
}
