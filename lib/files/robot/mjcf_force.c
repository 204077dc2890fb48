/* Passive forces and fixed tendons of MJCF as effects.
 *
 * A fixed tendon has the length L = sum c_i q_i. With a single joint, the tendon acts in that joint, with the factor c.
 * With several joints, L becomes the position of a body without mass, on its own prismatic joint. A coupling holds this
 * position to the sum, so that a force along L acts in joint i with the factor c_i.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"

#include <math.h>
#include <string.h>

/* ---- a scalar joint, or a tendon --------------------------------------------------------------------------------- */

/* Reads k0, k1, k2; false if all are zero, or the forces are turned off.
 *     spring: p = k0 x + k1 x^2 + k2 x^3,   damper: p = k0 v + k1 |v| v + k2 v^3 */
static bool read_polynomial(kt_mjcf *m, const kt_element *e, const char *tag, const char *name, double k[3]) {
    const bool is_off = strcmp(name, "stiffness") == 0 ? m->off.springs : m->off.dampers;
    k[0] = k[1] = k[2] = 0.0;
    (void)kt_mjcf_numbers(m, e, tag, name, 1, 3, k);
    return !is_off && kt_mjcf_is_any(k);
}

static bool is_plain(const double k[3]) { return k[0] >= 0.0 && k[1] == 0.0 && k[2] == 0.0; }

/* A force along a line by polynomials. */
static void add_polynomial(kt_mjcf *m, const kt_mjcf_line *l, const kt_polynomial_spring *numbers) {
    kt_polynomial_spring *spring = kt_reader_take(m->r, &m->r->keep, 1, sizeof *spring);
    kt_effect *effect = spring != NULL ? kt_draft_effect(&m->draft, l->element, KT_EFFECT_EXPRESSION) : NULL;
    if (effect == NULL)
        return;
    *spring = *numbers;
    spring->factor = l->factor;
    effect->spring = spring;
    effect->joint = l->joint;
}

/* A spring without force from the first to the second length. */
static void add_spring(kt_mjcf *m, const kt_mjcf_line *l, const double k[3], const double rest[2]) {
    kt_polynomial_spring spring = kt_polynomial_spring_default();
    if (is_plain(k) && rest[0] == rest[1]) {
        kt_draft_spring(&m->draft, l->element, l->joint, k[0] * l->factor * l->factor, rest[0] / l->factor);
        return;
    }
    memcpy(spring.stiffness, k, sizeof spring.stiffness);
    memcpy(spring.rest, rest, sizeof spring.rest);
    add_polynomial(m, l, &spring);
}

static void add_damping(kt_mjcf *m, const kt_mjcf_line *l, const double k[3]) {
    kt_polynomial_spring damper = kt_polynomial_spring_default();
    if (is_plain(k)) {
        kt_draft_resistance(&m->draft, l->element, l->joint, k[0] * l->factor * l->factor, 0.0);
        return;
    }
    memcpy(damper.damping, k, sizeof damper.damping);
    add_polynomial(m, l, &damper);
}

static double line_friction_of(kt_mjcf *m, const kt_element *e, const char *tag) {
    return m->off.friction ? 0.0 : kt_mjcf_number(m, e, tag, "frictionloss", 0.0);
}

static void add_line_friction(kt_mjcf *m, const kt_mjcf_line *l) {
    const double friction = line_friction_of(m, l->element, l->tag);
    kt_draft_resistance(&m->draft, l->element, l->joint, 0.0, friction * fabs(l->factor));
    if (friction != 0.0)
        kt_left_count(&m->notes.friction, l->element);
}

/* Whether limits of tendons become stops. The default softness is for joints: a length has no inertia of its own. */
static bool tendons_have_stops(const kt_mjcf *m) { return m->source->options->stop_stiffness != 0.0 && !m->off.limits; }

static void add_line_stop(kt_mjcf *m, const kt_mjcf_line *l, double lower, double upper) {
    const double a = lower / l->factor, b = upper / l->factor;
    if (!m->off.limits)
        kt_draft_stop(&m->draft, l->element, m->source->options, l->joint, fmin(a, b), fmax(a, b));
}

/* ---- joints ------------------------------------------------------------------------------------------------------ */

/* Stiffness and damping, those of a spring-damper with a time constant included; false if there are none. */
static bool read_springs(kt_mjcf *m, const kt_mjcf_joint *j, double stiffness[3], double damping[3]) {
    double v[2] = {0.0, 0.0};
    bool any = read_polynomial(m, j->element, j->tag, "stiffness", stiffness);
    any = read_polynomial(m, j->element, j->tag, "damping", damping) || any;
    if (!(j->inertia > 0.0) || kt_mjcf_numbers(m, j->element, j->tag, "springdamper", 2, 2, v) != 2)
        return any;
    stiffness[0] = j->inertia / (v[0] * v[0] * v[1] * v[1]);
    damping[0] = 2.0 * j->inertia / v[0];
    return true;
}

/* A ball or free joint: springs and dampers between the joint frame and the body, about (and along) all axes. A spring
 * turns by -stiffness times the Euler vector. */
static void spring_ball(kt_mjcf *m, const kt_mjcf_joint *j) {
    double stiffness[3], damping[3];
    if (line_friction_of(m, j->element, j->tag) != 0.0)
        kt_unknown_count(&m->forces, "frictionloss of a ball or free joint", j->element);
    if (!read_springs(m, j, stiffness, damping))
        return;
    if (!is_plain(stiffness) || !is_plain(damping))
        kt_unknown_count(&m->changes,
                         "stiffness or damping by a polynomial in a ball or free joint, whose first term alone acts",
                         j->element);
    kt_effect *effect = kt_draft_effect(&m->draft, j->element, KT_EFFECT_BUSHING);
    if (effect == NULL)
        return;
    const kt_joint *joint = &((const kt_body *)m->draft.bodies.items)[j->carrier_index].joint;
    effect->between[0].body = ((const kt_body *)m->draft.bodies.items)[j->carrier_index].parent;
    effect->between[0].at = joint->at;
    effect->between[0].rotation = joint->rotation;
    effect->between[1].body = j->carrier;
    if (j->type == KT_MJCF_FREE) /* from the pose of the body */
        effect->between[0] = kt_end_at(effect->between[0].body, kt_mjcf_place_of(m, j->body));
    for (int i = j->type == KT_MJCF_FREE ? 0 : 3; i < 6; i++) {
        effect->stiffnesses[i] = m->off.springs ? 0.0 : stiffness[0];
        effect->dampings[i] = m->off.dampers ? 0.0 : damping[0];
    }
}

static void act_in_joint(kt_mjcf *m, const kt_mjcf_joint *j) {
    if (!kt_mjcf_is_scalar(j)) {
        spring_ball(m, j);
        return;
    }
    const kt_mjcf_line l = {j->element, j->tag, j->name, 1.0};
    const double rest[2] = {j->spring, j->spring};
    double stiffness[3], damping[3];
    if (read_springs(m, j, stiffness, damping)) {
        if (!m->off.springs && kt_mjcf_is_any(stiffness))
            add_spring(m, &l, stiffness, rest);
        if (!m->off.dampers && kt_mjcf_is_any(damping))
            add_damping(m, &l, damping);
    }
    add_line_friction(m, &l);
    if (j->is_limited)
        add_line_stop(m, &l, j->lower, j->upper);
}

/* MuJoCo adds the compensation in such a joint to the forces of actuators, which MuJoCo computes only if actuators
 * exist. */
static void report_lost_compensation(kt_mjcf *m) {
    if (!m->off.actuation && kt_mjcf_section(m, "actuator", NULL) != NULL)
        return;
    for (int i = 0; i < m->joints.count; i++) {
        const kt_mjcf_joint *j = kt_mjcf_joint_at(m, i);
        if (kt_mjcf_flag(m, j->element, j->tag, "actuatorgravcomp", false))
            kt_unknown_count(&m->changes,
                             "actuatorgravcomp of a joint in a model without actuators, or whose actuators are turned "
                             "off, which MuJoCo does not compensate",
                             j->element);
    }
}

void kt_mjcf_passive(kt_mjcf *m) {
    bool lifts = false;
    for (int i = 0; i < m->joints.count && !m->r->out_of_memory; i++)
        act_in_joint(m, kt_mjcf_joint_at(m, i));
    if (m->off.springs && m->off.dampers) /* then MuJoCo has no passive force at all */
        return;
    for (int i = 1; i < m->bodies.count; i++) /* as in MuJoCo, numbers below zero act only next to one above zero */
        lifts = lifts || kt_mjcf_body_at(m, i)->gravcomp > 0.0;
    for (int i = 1; i < m->bodies.count && lifts && !m->r->out_of_memory; i++) {
        const kt_mjcf_body *b = kt_mjcf_body_at(m, i);
        const kt_body body = {.name = b->name, .mass = b->mass, .com = b->com};
        (void)kt_draft_lift(&m->draft, b->element, &body, m->gravity, b->gravcomp);
    }
    if (lifts)
        report_lost_compensation(m);
    for (int i = 1; i < m->bodies.count && !m->r->out_of_memory; i++)
        kt_mjcf_resist(m, kt_mjcf_body_at(m, i));
}

/* ---- fixed tendons ----------------------------------------------------------------------------------------------- */

/* Adds c q of a joint to a fixed tendon L = sum of c q, and to L at the reference, at rest and at the start. */
static void add_term(kt_mjcf *m, const kt_element *e, kt_mjcf_tendon *t) {
    const int joint = kt_mjcf_find(m, e, "joint", KT_MJCF_JOINTS);
    const double coefficient = kt_mjcf_number(m, e, NULL, "coef", 0.0);
    if (joint < 0)
        return;
    const kt_mjcf_joint *j = kt_mjcf_joint_at(m, joint);
    if (!kt_mjcf_is_scalar(j)) {
        kt_unknown_count(&m->forces, "part of a fixed tendon by a ball or free joint", e);
        return;
    }
    if (coefficient == 0.0)
        return;
    kt_mjcf_term *term = NULL;
    for (int i = 0; i < t->count; i++) /* a joint that occurs twice acts with the sum */
        term = kt_mjcf_term_at(m, t->first + i)->joint == joint ? kt_mjcf_term_at(m, t->first + i) : term;
    if (term == NULL) {
        term = kt_list_add(m->r, &m->r->scratch, &m->terms, sizeof *term);
        if (term == NULL)
            return;
        *term = (kt_mjcf_term){joint, 0.0};
        t->count++;
    }
    term->coefficient += coefficient;
    t->length += coefficient * j->ref;
    t->rest += coefficient * j->spring;
    t->start += coefficient * j->start;
}

/* A body whose position is the tendon's length. */
static void make_length(kt_mjcf *m, kt_mjcf_tendon *t) {
    const char *name = kt_element_name(t->element, "tendon");
    kt_body *body = kt_draft_body(&m->draft, t->element, t->element);
    kt_term *terms;
    if (body == NULL || kt_draft_coupling(&m->draft, t->element, name, t->count + 1, &terms) == NULL)
        return;
    body->name = kt_namer_make(&m->bodies_named, name);
    body->joint.type = KT_JOINT_PRISMATIC;
    body->joint.position[0] = t->start;
    body->joint.armature[0] = kt_mjcf_number(m, t->element, "tendon", "armature", 0.0);
    const char *joint = kt_namer_make(&m->joints_named, body->name);
    body->joint.name = strcmp(joint, body->name) != 0 ? joint : NULL;
    terms[0] = (kt_term){joint, 1.0};
    for (int i = 0; i < t->count; i++) {
        const kt_mjcf_term *term = kt_mjcf_term_at(m, t->first + i);
        terms[i + 1] = (kt_term){kt_mjcf_joint_at(m, term->joint)->name, -term->coefficient};
    }
    t->joint = joint;
    t->coefficient = 1.0;
    kt_left_count(&m->notes.tied, t->element);
    kt_mjcf_keep_start(m);
}

bool kt_mjcf_find_length(kt_mjcf *m, kt_mjcf_tendon *t) {
    if (t->joint == NULL && t->count == 1) {
        const kt_mjcf_term *term = kt_mjcf_term_at(m, t->first);
        t->joint = kt_mjcf_joint_at(m, term->joint)->name;
        t->coefficient = term->coefficient;
    } else if (t->joint == NULL && t->count > 1) {
        make_length(m, t);
    }
    return t->joint != NULL;
}

/* The armature of a tendon of one joint is part of that joint's. */
static void add_armature(kt_mjcf *m, const kt_mjcf_tendon *t, double armature) {
    const kt_mjcf_term *term = kt_mjcf_term_at(m, t->first);
    kt_body *bodies = m->draft.bodies.items;
    bodies[kt_mjcf_joint_at(m, term->joint)->carrier_index].joint.armature[0] +=
        armature * term->coefficient * term->coefficient;
}

/* Whether one of any two joints of a tendon carries the other. */
static bool is_chain(const kt_mjcf *m, const kt_mjcf_tendon *t) {
    const kt_mjcf_term *terms = kt_mjcf_term_at(m, t->first);
    for (int i = 0; i < t->count; i++)
        for (int k = 0; k < i; k++)
            if (!kt_mjcf_is_chain(m, terms[i].joint, terms[k].joint))
                return false;
    return true;
}

/* Without a springlength, a spring rests where all joints' springs rest. Only a tendon that acts gets a coordinate
 * (kt_mjcf_find_length). */
static void act_in_tendon(kt_mjcf *m, kt_mjcf_tendon *t) {
    double rest[2] = {-1.0, -1.0}, range[2] = {0.0, 0.0}, stiffness[3], damping[3];
    const kt_element *e = t->element;
    const bool springs = read_polynomial(m, e, "tendon", "stiffness", stiffness),
               damps = read_polynomial(m, e, "tendon", "damping", damping);
    const double armature = kt_mjcf_number(m, e, "tendon", "armature", 0.0);
    const bool is_limited = kt_mjcf_is_limited(m, e, "tendon", "limited", "range") &&
                            kt_mjcf_numbers(m, e, "tendon", "range", 2, 2, range) == 2;
    if (is_limited && m->source->options->stop_stiffness == 0.0)
        kt_left_count(&m->notes.limits, e);
    if (armature != 0.0 && t->count == 1)
        add_armature(m, t, armature);
    if (armature != 0.0 && !is_chain(m, t))
        kt_left_count(&m->notes.branches, e);
    if (!springs && !damps && line_friction_of(m, e, "tendon") == 0.0 && !(armature != 0.0 && t->count > 1) &&
        !(is_limited && tendons_have_stops(m)))
        return;
    if (!kt_mjcf_find_length(m, t))
        return;
    const kt_mjcf_line l = {e, "tendon", t->joint, t->coefficient};
    if (kt_mjcf_numbers(m, e, "tendon", "springlength", 1, 2, rest) == 1)
        rest[1] = rest[0];
    if (rest[0] == -1.0 && rest[1] == -1.0)
        rest[0] = rest[1] = t->rest;
    if (springs)
        add_spring(m, &l, stiffness, rest);
    if (damps)
        add_damping(m, &l, damping);
    add_line_friction(m, &l);
    if (is_limited && tendons_have_stops(m))
        add_line_stop(m, &l, range[0], range[1]);
}

/* A spatial tendon that is left out has no path. */
static void read_spatial(kt_mjcf *m, kt_mjcf_tendon *t) {
    if (kt_mjcf_read_path(m, t))
        return;
    t->path_count = 0;
    kt_unknown_count(&m->forces,
                     "spatial tendon around a geom that is no sphere or cylinder, or without two sites in a branch",
                     t->element);
}

void kt_mjcf_read_tendons(kt_mjcf *m) {
    for (const kt_element *e = kt_mjcf_section(m, "tendon", NULL); e != NULL && !m->r->out_of_memory;
         e = kt_mjcf_section(m, "tendon", e)) {
        const int index = m->tendons.count;
        kt_mjcf_tendon *t = kt_list_add(m->r, &m->r->scratch, &m->tendons, sizeof *t);
        if (t == NULL)
            return;
        *t = (kt_mjcf_tendon){.element = e, .first = m->terms.count};
        kt_mjcf_add_name(m, KT_MJCF_TENDONS, e, index);
        if (strcmp(e->name, "fixed") != 0) {
            read_spatial(m, t);
            continue;
        }
        for (const kt_element *c = kt_xml_child(e, "joint"); c != NULL; c = kt_xml_next(c, "joint"))
            add_term(m, c, t);
    }
}

void kt_mjcf_make_tendons(kt_mjcf *m) {
    for (int i = 0; i < m->tendons.count && !m->r->out_of_memory; i++) {
        kt_mjcf_tendon *t = kt_mjcf_tendon_at(m, i);
        if (kt_mjcf_path_armature(m, t) != 0.0)
            kt_mjcf_add_armature(m, t);
        if (t->path_count > 0)
            kt_mjcf_act_in_path(m, t);
        else if (strcmp(t->element->name, "fixed") == 0)
            act_in_tendon(m, t);
    }
}
