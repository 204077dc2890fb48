/* Actuators of MJCF as effects.
 *
 * An actuator with the gear g acts along the length g L. For the control u it has the force f, clamped to `forcerange`:
 *     f = gain u + b0 + b1 g L + b2 g L',   gain = g0 + g1 g L + g2 g L'.
 * Only an affine gain has g1 and g2. An activation takes the place of u (mjcf_activation.c). For a constant u, f is the
 * clamp of c0 + c1 g L + c2 g L', and g f acts on L. The actuator is a motor if c1 = c2 = 0. Else it is a
 * servo of stiffness -g^2 c1 and damping -g^2 c2.
 *
 * `actuatorfrcrange` of a joint bounds the sum of the actuator forces in this joint. For a single actuator, its own
 * bounds and these are one pair, since a clamp of a clamp is a clamp. For several actuators, or for a tendon that acts
 * in several joints, the sum becomes a formula in each joint.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"

#include <math.h>
#include <string.h>

/* ---- actions ----------------------------------------------------------------------------------------------------- */

/* An actuator along the length L of a joint or a tendon, with the force gear times the clamp of c0 + c1 gear L + c2
 * gear L'. If several act along one tendon and their sum is bounded, one factor scales the forces before that clamp. */
typedef struct action {
    const kt_element *element;
    int tendon; /* -1: none */
    kt_mjcf_term own;
    double gear, c[3], bounds[2];
    bool is_formula;
    bool is_shared; /* the sum of the forces along the tendon has the bounds `shared` */
    double shared[2];
    const char
        *activation; /* a state w, whose force w (gain[0] + gain[1] gear L + gain[2] gear L') is added; or NULL */
    double gain[3], range[2];
    bool has_active, has_passive; /* forces of a muscle */
    double control;               /* without activation, that of the active force */
    kt_mjcf_muscle active, passive;
} action;

static action *action_at(const kt_list *actions, int i) { return (action *)actions->items + i; }

/* Whether an action acts along a spatial tendon. */
static bool is_along_path(const kt_mjcf *m, const action *d) {
    return d->tendon >= 0 && kt_mjcf_tendon_at(m, d->tendon)->path_count > 0;
}

/* dL/dq of a joint. */
static double lever_of(const kt_mjcf *m, const action *d, int joint) {
    int count;
    double sum = 0.0;
    const kt_mjcf_term *terms = kt_mjcf_terms_of(m, d->tendon, &d->own, &count);
    for (int i = 0; i < count; i++)
        sum += terms[i].joint == joint ? terms[i].coefficient : 0.0;
    return sum;
}

/* Finds the joint or tendon of an actuator. If this joint or tendon is left out, counts the actuator and returns
 * false. */
static bool find_length_of(kt_mjcf *m, const kt_element *e, action *d) {
    const char *attribute = kt_xml_attribute(e, "joint") != NULL           ? "joint"
                            : kt_xml_attribute(e, "jointinparent") != NULL ? "jointinparent"
                                                                           : "tendon";
    if (kt_xml_attribute(e, attribute) == NULL) {
        kt_unknown_count(&m->forces, "actuator of two sites, a body or a crank", e);
        return false;
    }
    if (strcmp(attribute, "tendon") == 0) {
        d->tendon = kt_names_find(&m->names, KT_MJCF_TENDONS, kt_xml_attribute(e, "tendon"));
        const kt_mjcf_tendon *t = d->tendon >= 0 ? kt_mjcf_tendon_at(m, d->tendon) : NULL;
        const bool is_there = t != NULL && (t->count > 0 || t->path_count > 0);
        if (!is_there)
            kt_unknown_count(&m->forces, "actuator of a tendon that is left out", e);
        return is_there;
    }
    const int joint = kt_mjcf_find(m, e, attribute, KT_MJCF_JOINTS);
    d->own = (kt_mjcf_term){joint, 1.0};
    if (joint >= 0 && !kt_mjcf_is_scalar(kt_mjcf_joint_at(m, joint)))
        kt_unknown_count(&m->forces, "actuator of a ball joint, or servo of a free joint", e);
    return joint >= 0 && kt_mjcf_is_scalar(kt_mjcf_joint_at(m, joint));
}

static double clamp(double x, double lower, double upper) { return fmin(fmax(x, lower), upper); }

/* Applies further bounds to a bounded sum: a clamp of a clamp. */
static void clamp_bounds(double bounds[2], const double by[2]) {
    for (int i = 0; i < 2; i++)
        bounds[i] = clamp(bounds[i], by[0], by[1]);
}

/* Whether `option actuatorgroupdisable` has the group of an actuator. */
static bool is_disabled(kt_mjcf *m, const kt_element *e) {
    const double group = kt_mjcf_number(m, e, KT_MJCF_ACTUATORS, "group", 0.0);
    return group >= 0.0 && group < 31.0 && (m->off.actuator_groups >> (int)group & 1) != 0;
}

/* The control of an actuator with a delay, as a formula. */
static const char *delayed_control(kt_mjcf *m, const kt_mjcf_actuator *a, double control) {
    kt_mjcf_formula text = {.whole = true};
    kt_mjcf_put_delayed(&text, control, a->dynamics.delay);
    return kt_mjcf_keep_formula(m, &text);
}

/* Makes the activation of an action, if it has one, or its delayed control. */
static void activate(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, double control, double initial,
                     action *d) {
    const bool is_dynamic = kt_mjcf_is_dynamic(&a->dynamics);
    const double held = kt_mjcf_control_of(m, e, a, control);
    if (!is_dynamic && !(a->dynamics.delay > 0.0))
        return;
    if (is_dynamic && kt_mjcf_flag(m, e, KT_MJCF_ACTUATORS, "actearly", false))
        kt_unknown_count(&m->changes, "actearly of an actuator, whose activation acts without MuJoCo's step ahead", e);
    d->activation =
        is_dynamic ? kt_mjcf_add_activation(m, e, &a->dynamics, held, initial) : delayed_control(m, a, held);
    kt_mjcf_force_of(a, 0.0, d->c);
    for (int i = 0; i < 3; i++)
        d->gain[i] = (i == 0 && !a->has_active) || a->has_affine_gain ? a->gain[i] : 0.0;
    d->range[0] = (double)-INFINITY;
    d->range[1] = (double)INFINITY;
    if (!is_dynamic || (a->dynamics.type == KT_MJCF_INTEGRATOR && kt_mjcf_inherited_range(m, e, a, d->range)))
        return;
    (void)kt_mjcf_actuator_range(m, e, "actlimited", "actrange", d->range);
}

/* Sets the forces of a muscle, or returns false if it is left out. */
static bool flex_muscle(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, double control, action *d) {
    const kt_mjcf_reach *reach = kt_mjcf_reach_of(m, e);
    if (!a->has_active && !a->has_passive)
        return true;
    if (reach == NULL || !reach->is_found) {
        kt_unknown_count(&m->forces, "muscle without a lengthrange; mj_saveLastXML of MuJoCo writes the ranges", e);
        return false;
    }
    d->has_active = a->has_active;
    d->has_passive = a->has_passive;
    d->control = kt_mjcf_control_of(m, e, a, control);
    d->active = kt_mjcf_muscle_of(a->gain, reach->range, reach->acceleration);
    d->passive = kt_mjcf_muscle_of(a->bias, reach->range, reach->acceleration);
    return true;
}

static void put_bounded(kt_mjcf_formula *to, const double bounds[2], bool begins);
static void put_force(const kt_mjcf *m, const action *d, kt_mjcf_formula *to);

/* The force of an actuator of a site, whose length is zero, by its activation. */
static const char *force_at_site(kt_mjcf *m, const kt_element *e, action d) {
    kt_mjcf_formula to = {.whole = true};
    d.c[1] = d.c[2] = d.gain[1] = d.gain[2] = 0.0;
    (void)kt_mjcf_actuator_range(m, e, "forcelimited", "forcerange", d.bounds);
    put_bounded(&to, d.bounds, true);
    put_force(m, &d, &to);
    put_bounded(&to, d.bounds, false);
    return kt_mjcf_keep_formula(m, &to);
}

/* Takes the activation of an actuator at the start from the numbers of a keyframe. */
static double next_activation(const kt_mjcf_dynamics *dynamics, const double *numbers, int *used) {
    const int count = kt_mjcf_activations_of(dynamics), first = *used;
    *used += count;
    return numbers != NULL && count > 0 ? numbers[first + count - 1] : 0.0;
}

/* Adds what an actuator does to `actions`. `numbers` are the activations of the keyframe (NULL: zeros), of which `used`
 * belong to earlier actuators. */
static void add_action(kt_mjcf *m, const kt_element *e, double control, const double *numbers, int *used,
                       kt_list *actions) {
    const double infinite = (double)INFINITY;
    action d = {.element = e, .tendon = -1, .gear = 1.0, .bounds = {-infinite, infinite}};
    kt_mjcf_actuator a = kt_mjcf_actuator_of(m, e);
    double force[2];
    const double initial = next_activation(&a.dynamics, numbers, used);
    if (a.is_strange || a.is_of_user) {
        kt_unknown_count(&m->forces, a.is_strange ? e->name : "actuator of a user's kind", e);
        return;
    }
    if (kt_xml_attribute(e, "site") != NULL && kt_mjcf_text(m, e, KT_MJCF_ACTUATORS, "refsite") == NULL &&
        !a.has_active && !a.has_passive) {
        activate(m, e, &a, control, initial, &d);
        kt_mjcf_act_at_site(m, e, &a, control, d.activation != NULL ? force_at_site(m, e, d) : NULL);
        return;
    }
    if (kt_mjcf_act_in_free(m, e, &a, control) || !find_length_of(m, e, &d))
        return;
    d.gear = kt_mjcf_gear_of(m, e);
    if (!flex_muscle(m, e, &a, control, &d))
        return;
    if (kt_mjcf_actuator_range(m, e, "forcelimited", "forcerange", force))
        memcpy(d.bounds, force, sizeof force);
    kt_mjcf_resolve_damping(m, e, &a, d.gear, d.tendon, &d.own);
    kt_mjcf_force_of(&a, kt_mjcf_control_of(m, e, &a, control), d.c);
    activate(m, e, &a, control, initial, &d);
    action *to = d.gear != 0.0 ? kt_list_add(m->r, &m->r->scratch, actions, sizeof *to) : NULL;
    if (to != NULL)
        *to = d;
}

/* ---- bounds of sums ---------------------------------------------------------------------------------------------- */

/* The next action along the same tendon; NULL: there is none. */
static action *next_sharer(const kt_list *actions, const action *d) {
    for (action *next = (action *)d + 1; next < action_at(actions, actions->count); next++)
        if (next->tendon == d->tendon)
            return next;
    return NULL;
}

/* Whether all actions along a tendon have one gear, and no bounds of their own: then the sum is clamped as a whole. */
static bool is_one_sum(const kt_list *actions, const action *first) {
    bool is_one = true;
    for (const action *d = first; d != NULL; d = next_sharer(actions, d))
        is_one = is_one && d->gear == first->gear && isinf(d->bounds[0]) && isinf(d->bounds[1]);
    return is_one;
}

static bool action_is_muscle(const action *d) { return d->has_active || d->has_passive; }

static bool has_activation(const kt_list *actions, const action *first) {
    bool found = false;
    for (const action *d = first; d != NULL; d = next_sharer(actions, d))
        found = found || d->activation != NULL || action_is_muscle(d);
    return found;
}

/* `actuatorfrcrange` of a tendon bounds the sum of the forces along it, without their gears. If zero is outside of the
 * range, a scaling factor has a pole. */
static void limit_tendon(kt_mjcf *m, const kt_list *actions, action *d) {
    double range[2], own[2] = {d->bounds[0], d->bounds[1]};
    const kt_element *t = d->tendon >= 0 ? kt_mjcf_tendon_at(m, d->tendon)->element : NULL;
    if (t == NULL || d->is_shared || !kt_mjcf_is_limited(m, t, "tendon", "actuatorfrclimited", "actuatorfrcrange") ||
        kt_mjcf_numbers(m, t, "tendon", "actuatorfrcrange", 2, 2, range) != 2)
        return;
    if (next_sharer(actions, d) == NULL) {
        memcpy(d->bounds, range, sizeof range);
        clamp_bounds(d->bounds, own);
        return;
    }
    if (!(range[0] < 0.0 && range[1] > 0.0) && !is_one_sum(actions, d)) {
        kt_unknown_count(&m->changes,
                         "actuatorfrcrange without zero of a tendon that several actuators pull, which is left out", t);
        return;
    }
    if (has_activation(actions, d)) {
        kt_unknown_count(&m->changes,
                         "actuatorfrcrange of a tendon that several actuators with activations, or muscles, pull, "
                         "which is left out",
                         t);
        return;
    }
    for (action *each = d; each != NULL; each = next_sharer(actions, each)) {
        each->is_shared = true;
        memcpy(each->shared, range, sizeof range);
    }
}

/* Whether a formula is needed. A formula is needed if a sum that contains the actuator is bounded, or if the force
 * grows with the length or its rate, since no servo has such a force. */
static bool needs_formula(const kt_mjcf *m, const kt_list *actions, const action *d) {
    int count;
    const kt_mjcf_term *terms = kt_mjcf_terms_of(m, d->tendon, &d->own, &count);
    if (d->is_shared)
        return true;
    for (int i = 0; i < count; i++) {
        int sharers = 0;
        if (isinf(kt_mjcf_joint_at(m, terms[i].joint)->effort))
            continue;
        for (int k = 0; k < actions->count; k++)
            sharers += lever_of(m, action_at(actions, k), terms[i].joint) != 0.0;
        if (sharers > 1 || count > 1)
            return true;
    }
    return d->c[1] > 0.0 || d->c[2] > 0.0 || d->activation != NULL || action_is_muscle(d);
}

/* ---- effects ----------------------------------------------------------------------------------------------------- */

/* c: the coefficients of the force in the joint for the constant, the position and the velocity. */
static void add_servo(kt_mjcf *m, const kt_mjcf_line *l, const double c[3], const double bounds[2]) {
    kt_effect *servo = kt_draft_joint_effect(&m->draft, l->element, KT_EFFECT_SERVO, l->joint);
    double *line_of_time = kt_reader_take(m->r, &m->r->keep, 2, sizeof *line_of_time);
    if (servo == NULL || line_of_time == NULL)
        return;
    servo->stiffness = 0.0 - c[1]; /* no negative zero */
    servo->damping = 0.0 - c[2];
    /* without stiffness the target's rate is that of the control */
    line_of_time[1] = servo->stiffness > 0.0 ? 0.0 : c[0] / servo->damping;
    servo->target = servo->stiffness > 0.0 ? kt_function_constant(c[0] / servo->stiffness)
                    : c[0] == 0.0          ? kt_function_constant(0.0)
                                           : kt_function_polynomial(line_of_time, 2);
    servo->lower = bounds[0];
    servo->upper = bounds[1];
    kt_left_count(&m->notes.servos, l->element);
}

/* Adds an actuator as a separate effect. No other actuator shares its bounds. */
static void add_alone(kt_mjcf *m, const action *d) {
    kt_mjcf_line l = {.element = d->element, .factor = 1.0};
    kt_mjcf_tendon *t = d->tendon >= 0 ? kt_mjcf_tendon_at(m, d->tendon) : NULL;
    if (t != NULL && !kt_mjcf_find_length(m, t))
        return;
    l.joint = t != NULL ? t->joint : kt_mjcf_joint_at(m, d->own.joint)->name;
    l.factor = d->gear * (t != NULL ? t->coefficient : 1.0);
    const double c[3] = {l.factor * d->c[0], l.factor * l.factor * d->c[1], l.factor * l.factor * d->c[2]};
    const double ends[2] = {l.factor * d->bounds[0], l.factor * d->bounds[1]};
    double bounds[2] = {fmin(ends[0], ends[1]), fmax(ends[0], ends[1])};
    int count;
    const kt_mjcf_term *terms = kt_mjcf_terms_of(m, d->tendon, &d->own, &count);
    if (count == 1)
        clamp_bounds(bounds, kt_mjcf_joint_at(m, terms[0].joint)->force);
    if ((c[1] != 0.0 || c[2] != 0.0) && bounds[0] < bounds[1]) {
        add_servo(m, &l, c, bounds);
    } else {
        kt_effect *motor = kt_draft_joint_effect(&m->draft, l.element, KT_EFFECT_MOTOR, l.joint);
        if (motor == NULL)
            return;
        motor->torque = kt_function_constant(clamp(c[0], bounds[0], bounds[1]));
        kt_left_count(&m->notes.motors, d->element);
    }
    kt_mjcf_name_effect(m, kt_xml_attribute(d->element, "name"));
}

/* Writes "clamp(", "min(", "max(" or "(", according to the finite bounds; at the end, the bounds and ")". */
static void put_bounded(kt_mjcf_formula *to, const double bounds[2], bool begins) {
    const bool is_below = !isinf(bounds[1]), is_above = !isinf(bounds[0]);
    if (begins) {
        kt_mjcf_put(to, is_below && is_above ? "clamp(" : is_below ? "min(" : is_above ? "max(" : "(");
        return;
    }
    for (int i = 0; i < 2; i++)
        if (!isinf(bounds[i]))
            kt_mjcf_print(to, ", %g", bounds[i]);
    kt_mjcf_put(to, ")");
}

/* "2 + -5*position.a + -1*velocity.a" of c0 + c1 L + c2 L'. */
static void put_affine(const kt_mjcf *m, const action *d, const double c[3], kt_mjcf_formula *to) {
    static const char *const quantities[] = {"position", "velocity"};
    int count;
    const kt_mjcf_term *terms = kt_mjcf_terms_of(m, d->tendon, &d->own, &count);
    const bool is_constant = c[0] != 0.0 || (c[1] == 0.0 && c[2] == 0.0);
    const size_t first = to->length;
    if (is_constant)
        kt_mjcf_print(to, "%g", c[0]);
    for (int k = 0; k < 2 && is_along_path(m, d); k++) {
        if (c[k + 1] == 0.0)
            continue;
        kt_mjcf_put(to, to->length > first ? " + " : "");
        kt_mjcf_put_path(c[k + 1], k == 1, to);
    }
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < count && c[k + 1] != 0.0; i++) {
            kt_mjcf_put(to, to->length > first ? " + " : "");
            kt_mjcf_put_coordinate(to, c[k + 1] * terms[i].coefficient, quantities[k],
                                   kt_mjcf_joint_at(m, terms[i].joint)->name);
        }
}

/* Writes the force of a muscle, by its activation or its stretch. */
static void put_muscle(const kt_mjcf *m, const action *d, bool is_active, kt_mjcf_formula *to) {
    const kt_mjcf_muscle *muscle = is_active ? &d->active : &d->passive;
    kt_mjcf_formula length = {.whole = true}, rate = {.whole = true};
    put_affine(m, d, (const double[]){muscle->offset, muscle->slope * d->gear, 0.0}, &length);
    put_affine(m, d, (const double[]){0.0, 0.0, muscle->rate * d->gear}, &rate);
    to->whole = to->whole && length.whole && rate.whole;
    if (is_active)
        kt_mjcf_put_active(muscle, length.text, rate.text, to);
    else
        kt_mjcf_put_passive(muscle, length.text, to);
}

static void put_force(const kt_mjcf *m, const action *d, kt_mjcf_formula *to) {
    const double c[3] = {d->c[0], d->c[1] * d->gear, d->c[2] * d->gear};
    const double gain[3] = {d->gain[0], d->gain[1] * d->gear, d->gain[2] * d->gear};
    const bool is_affine = c[0] != 0.0 || c[1] != 0.0 || c[2] != 0.0,
               is_driven = d->activation != NULL || d->has_active;
    if (is_affine || (!d->has_passive && !is_driven))
        put_affine(m, d, c, to);
    if (d->has_passive) {
        kt_mjcf_put(to, is_affine ? " + " : "");
        put_muscle(m, d, false, to);
    }
    if (!is_driven)
        return;
    kt_mjcf_put(to, is_affine || d->has_passive ? " + " : "");
    if (d->activation != NULL) {
        put_bounded(to, d->range, true);
        kt_mjcf_put(to, d->activation);
        put_bounded(to, d->range, false);
    } else {
        kt_mjcf_print(to, "%g", d->control);
    }
    kt_mjcf_put(to, "*(");
    if (d->has_active)
        put_muscle(m, d, true, to);
    else
        put_affine(m, d, gain, to);
    kt_mjcf_put(to, ")");
}

/* The sum of the forces of all actuators that share a tendon, before bounds. */
static void put_shared_sum(const kt_mjcf *m, const kt_list *actions, const action *first, kt_mjcf_formula *to) {
    double c[3] = {0.0, 0.0, 0.0};
    for (const action *d = first; d != NULL; d = next_sharer(actions, d)) {
        c[0] += d->c[0];
        c[1] += d->c[1] * d->gear;
        c[2] += d->c[2] * d->gear;
    }
    put_affine(m, first, c, to);
}

/* The factor that brings a sum S between bounds l < 0 < u: "*u/max(u, S)*l/min(l, S)". */
static void put_share(const kt_mjcf *m, const kt_list *actions, const action *first, kt_mjcf_formula *to) {
    static const char *const calls[] = {"/min(", "/max("};
    for (int i = 0; i < 2; i++) {
        kt_mjcf_print(to, "*%g%s%g, ", first->shared[i], calls[i], first->shared[i]);
        put_shared_sum(m, actions, first, to);
        kt_mjcf_put(to, ")");
    }
}

/* Writes a term such as `3*clamp(2 + -5*position.a + -1*velocity.a, -1, 1)`. For the first of several actuators that
 * share a tendon, writes the terms of all. */
static void put_action(const kt_mjcf *m, const kt_list *actions, const action *first, double lever,
                       kt_mjcf_formula *to) {
    const bool is_one = first->is_shared && is_one_sum(actions, first);
    for (const action *d = first; d != NULL; d = d->is_shared && !is_one ? next_sharer(actions, d) : NULL) {
        const double *bounds = is_one ? d->shared : d->bounds;
        kt_mjcf_print(to, "%s%g*", d != first ? " + " : "", d->gear * lever);
        put_bounded(to, bounds, true);
        kt_mjcf_put(to, d->is_shared && !is_one ? "(" : "");
        if (is_one)
            put_shared_sum(m, actions, d, to);
        else
            put_force(m, d, to);
        kt_mjcf_put(to, d->is_shared && !is_one ? ")" : "");
        if (d->is_shared && !is_one)
            put_share(m, actions, first, to);
        put_bounded(to, bounds, false);
    }
}

/* Whether an action is written together with another action along the same tendon. */
static bool is_written_with_another(const kt_list *actions, int index) {
    const action *d = action_at(actions, index);
    for (int i = 0; i < index && d->is_shared; i++)
        if (action_at(actions, i)->tendon == d->tendon)
            return true;
    return false;
}

/* Whether a muscle, in a joint without bounds, is a separate effect. */
static bool is_apart(const kt_mjcf_joint *j, const action *d) {
    return action_is_muscle(d) && isinf(j->force[0]) && isinf(j->force[1]);
}

/* The sum of all actuators that act in a joint with formulas, or `only` one of them. */
static void add_sum(kt_mjcf *m, const kt_list *actions, int joint, const action *only) {
    const kt_mjcf_joint *j = kt_mjcf_joint_at(m, joint);
    kt_mjcf_formula to = {.whole = true};
    const action *last = NULL;
    int sharers = 0, variables = 0, count;
    put_bounded(&to, j->force, true);
    for (int i = 0; i < actions->count; i++) {
        const action *d = action_at(actions, i);
        const double lever = d->is_formula && !is_written_with_another(actions, i) ? lever_of(m, d, joint) : 0.0;
        if (lever == 0.0 || (only != NULL ? d != only : is_apart(j, d)))
            continue;
        kt_mjcf_put(&to, sharers++ > 0 ? " + " : "");
        put_action(m, actions, d, lever, &to);
        (void)kt_mjcf_terms_of(m, d->tendon, &d->own, &count);
        variables += 2 * count + (d->activation != NULL);
        last = d;
    }
    put_bounded(&to, j->force, false);
    if (sharers == 0)
        return;
    to.whole = to.whole && variables <= KT_FORMULA_VARIABLE_MAX;
    kt_effect *effect =
        kt_mjcf_add_formula(m, last->element, &to, "actuators whose limited sum is too long for a formula");
    if (effect == NULL)
        return;
    effect->joint = j->name;
    kt_phrase name = {.length = 0};
    kt_phrase_add(&name, "%.150s_actuators", j->name);
    kt_mjcf_name_effect(m, only != NULL || (sharers == 1 && last->tendon < 0) ? kt_xml_attribute(last->element, "name")
                                                                              : name.text);
    kt_left_count(&m->notes.sums, last->element);
}

/* The actions on a spatial tendon: all actions, and the first one that acts on this tendon. */
typedef struct pull {
    const kt_list *actions;
    const action *first;
} pull;

static void put_pull(const kt_mjcf *m, const kt_mjcf_tendon *t, const void *user, kt_mjcf_formula *to) {
    const pull *p = user;
    (void)t;
    put_action(m, p->actions, p->first, 1.0, to);
}

/* Adds the actions along spatial tendons. */
static void pull_tendons(kt_mjcf *m, const kt_list *actions) {
    for (int i = 0; i < actions->count && !m->r->out_of_memory; i++) {
        const action *d = action_at(actions, i);
        const pull p = {actions, d};
        if (!is_along_path(m, d) || is_written_with_another(actions, i))
            continue;
        if (kt_mjcf_tendon_at(m, d->tendon)->is_bounded)
            kt_unknown_count(&m->changes, "actuatorfrcrange of joints that an actuator of a spatial tendon moves, too",
                             d->element);
        kt_mjcf_add_along_path(m, kt_mjcf_tendon_at(m, d->tendon), d->element, put_pull, &p);
        kt_left_count(&m->notes.sums, d->element);
    }
}

static void skip_actuator(kt_mjcf *m, const kt_element *e, int *used) {
    const kt_mjcf_dynamics d = kt_mjcf_actuator_of(m, e).dynamics;
    *used += kt_mjcf_activations_of(&d);
    kt_left_count(&m->notes.idle, e);
}

void kt_mjcf_actuators(kt_mjcf *m) {
    kt_list actions = {.count = 0};
    int index = 0, used = 0;
    for (const kt_element *e = kt_mjcf_section(m, "actuator", NULL); e != NULL && !m->r->out_of_memory;
         e = kt_mjcf_section(m, "actuator", e), index++)
        if (m->off.actuation || is_disabled(m, e))
            skip_actuator(m, e, &used);
        else
            add_action(m, e, m->ctrl != NULL ? m->ctrl[index] : 0.0, m->act, &used, &actions);
    for (int i = 0; i < actions.count; i++)
        limit_tendon(m, &actions, action_at(&actions, i));
    for (int i = 0; i < actions.count; i++)
        action_at(&actions, i)->is_formula = needs_formula(m, &actions, action_at(&actions, i));
    for (int i = 0; i < actions.count && !m->r->out_of_memory; i++)
        if (!action_at(&actions, i)->is_formula && !is_along_path(m, action_at(&actions, i)))
            add_alone(m, action_at(&actions, i));
    pull_tendons(m, &actions);
    for (int i = 0; i < m->joints.count && !m->r->out_of_memory; i++) {
        add_sum(m, &actions, i, NULL);
        for (int k = 0; k < actions.count && !m->r->out_of_memory; k++)
            if (is_apart(kt_mjcf_joint_at(m, i), action_at(&actions, k)))
                add_sum(m, &actions, i, action_at(&actions, k));
    }
}
