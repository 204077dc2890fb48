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
 * in several joints, an effect of each joint lists all actuators of its sum.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"

#include <math.h>
#include <string.h>

/* ---- actions ----------------------------------------------------------------------------------------------------- */

/* An actuator along the length L of a joint or a tendon. Without its bounds and an activation, its force is gear times
 * c0 + c1 gear L + c2 gear L'. */
typedef struct action {
    const kt_element *element;
    int tendon; /* -1: none */
    kt_mjcf_term own;
    double c[3];
    bool is_listed;      /* no servo or motor has this force: an effect lists the actuator */
    bool is_shared;      /* the sum of the forces along the tendon has bounds */
    kt_actuator numbers; /* as effects list them */
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

/* Applies further bounds to a bounded sum: a clamp of a clamp. */
static void clamp_bounds(double bounds[2], const double by[2]) {
    for (int i = 0; i < 2; i++)
        bounds[i] = kt_clamp(bounds[i], by[0], by[1]);
}

/* Whether `option actuatorgroupdisable` has the group of an actuator. */
static bool is_disabled(kt_mjcf *m, const kt_element *e) {
    const double group = kt_mjcf_number(m, e, KT_MJCF_ACTUATORS, "group", 0.0);
    return group >= 0.0 && group < 31.0 && (m->off.actuator_groups >> (int)group & 1) != 0;
}

/* The name of an element as the scene keeps it; NULL: it has none. */
static const char *keep_name(kt_mjcf *m, const kt_element *e) {
    const char *name = kt_xml_attribute(e, "name");
    return name != NULL && *name != '\0' ? kt_reader_text(m->r, &m->r->keep, name, strlen(name)) : NULL;
}

/* Sets the numbers of an actuator with a control: all but those of its length, its bounds and its activation. */
static void set_numbers(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, double control, action *d) {
    double range[2];
    d->numbers.name = keep_name(m, e);
    d->numbers.control = kt_mjcf_control_of(m, e, a, control);
    if (kt_mjcf_control_range(m, e, a, range) && range[0] <= range[1]) {
        d->numbers.control_lower = range[0];
        d->numbers.control_upper = range[1];
    }
    kt_mjcf_gains_of(a, d->numbers.gain, d->numbers.bias);
}

/* Makes the activation of an action, if it has one, or the delay of its control. */
static void activate(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, double initial, action *d) {
    const bool is_dynamic = kt_mjcf_is_dynamic(&a->dynamics);
    double range[2] = {d->numbers.activation_lower, d->numbers.activation_upper};
    if (!is_dynamic && !(a->dynamics.delay > 0.0))
        return;
    if (is_dynamic && kt_mjcf_flag(m, e, KT_MJCF_ACTUATORS, "actearly", false))
        kt_unknown_count(&m->changes, "actearly of an actuator, whose activation acts without MuJoCo's step ahead", e);
    kt_mjcf_force_of(a, 0.0, d->c);
    if (!is_dynamic) {
        d->numbers.delay = a->dynamics.delay;
        return;
    }
    d->numbers.activation = kt_mjcf_add_activation(m, e, &a->dynamics, &d->numbers, initial);
    if (a->dynamics.type != KT_MJCF_INTEGRATOR || !kt_mjcf_inherited_range(m, e, a, range))
        (void)kt_mjcf_actuator_range(m, e, "actlimited", "actrange", range);
    d->numbers.activation_lower = range[0];
    d->numbers.activation_upper = range[1];
}

/* Sets the forces of a muscle, or returns false if it is left out. */
static bool flex_muscle(kt_mjcf *m, const kt_element *e, const kt_mjcf_actuator *a, action *d) {
    const kt_mjcf_reach *reach = kt_mjcf_reach_of(m, e);
    if (!a->has_active && !a->has_passive)
        return true;
    if (reach == NULL || !reach->is_found) {
        kt_unknown_count(&m->forces, "muscle without a lengthrange; mj_saveLastXML of MuJoCo writes the ranges", e);
        return false;
    }
    if (a->has_active)
        d->numbers.active = kt_mjcf_muscle_of(m, a->gain, reach);
    if (a->has_passive)
        d->numbers.passive = kt_mjcf_muscle_of(m, a->bias, reach);
    return true;
}

/* Gives an actuator the name of its tendon and, if it is fixed to joints, the terms. */
static void add_terms_of_tendon(kt_mjcf *m, action *d) {
    int count;
    const kt_mjcf_term *terms = kt_mjcf_terms_of(m, d->tendon, &d->own, &count);
    kt_term *made = count > 0 ? kt_reader_take(m->r, &m->r->keep, (size_t)count, sizeof *made) : NULL;
    d->numbers.tendon = keep_name(m, kt_mjcf_tendon_at(m, d->tendon)->element);
    for (int i = 0; i < count && made != NULL; i++)
        made[i] = (kt_term){kt_mjcf_joint_at(m, terms[i].joint)->name, terms[i].coefficient};
    d->numbers.terms = made;
    d->numbers.term_count = made != NULL ? count : 0;
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
    action d = {.element = e, .tendon = -1, .numbers = kt_actuator_default()};
    kt_mjcf_actuator a = kt_mjcf_actuator_of(m, e);
    double force[2];
    const double initial = next_activation(&a.dynamics, numbers, used);
    if (a.is_strange || a.is_of_user) {
        kt_unknown_count(&m->forces, a.is_strange ? e->name : "actuator of a user's kind", e);
        return;
    }
    set_numbers(m, e, &a, control, &d);
    const bool is_limited = kt_mjcf_actuator_range(m, e, "forcelimited", "forcerange", force);
    if (is_limited) {
        d.numbers.lower = force[0];
        d.numbers.upper = force[1];
    }
    if (kt_xml_attribute(e, "site") != NULL && kt_mjcf_text(m, e, KT_MJCF_ACTUATORS, "refsite") == NULL &&
        !a.has_active && !a.has_passive) {
        activate(m, e, &a, initial, &d);
        kt_mjcf_act_at_site(m, e, &a, control, kt_actuator_is_driven(&d.numbers) ? &d.numbers : NULL);
        return;
    }
    if (kt_mjcf_act_in_free(m, e, &a, control) || !find_length_of(m, e, &d))
        return;
    d.numbers.gear = kt_mjcf_gear_of(m, e);
    if (!flex_muscle(m, e, &a, &d))
        return;
    kt_mjcf_resolve_damping(m, e, &a, d.numbers.gear, d.tendon, &d.own);
    kt_mjcf_gains_of(&a, d.numbers.gain, d.numbers.bias);
    kt_mjcf_force_of(&a, d.numbers.control, d.c);
    activate(m, e, &a, initial, &d);
    if (d.tendon >= 0)
        add_terms_of_tendon(m, &d);
    action *to = d.numbers.gear != 0.0 ? kt_list_add(m->r, &m->r->scratch, actions, sizeof *to) : NULL;
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
        is_one = is_one && d->numbers.gear == first->numbers.gear && isinf(d->numbers.lower) && isinf(d->numbers.upper);
    return is_one;
}

static bool action_is_muscle(const action *d) { return d->numbers.active != NULL || d->numbers.passive != NULL; }

static bool has_activation(const kt_list *actions, const action *first) {
    bool found = false;
    for (const action *d = first; d != NULL; d = next_sharer(actions, d))
        found = found || kt_actuator_is_driven(&d->numbers) || action_is_muscle(d);
    return found;
}

/* `actuatorfrcrange` of a tendon bounds the sum of the forces along it, without their gears. If zero is outside of the
 * range, a scaling factor has a pole. */
static void limit_tendon(kt_mjcf *m, const kt_list *actions, action *d) {
    double range[2];
    const kt_element *t = d->tendon >= 0 ? kt_mjcf_tendon_at(m, d->tendon)->element : NULL;
    if (t == NULL || d->is_shared || !kt_mjcf_is_limited(m, t, "tendon", "actuatorfrclimited", "actuatorfrcrange") ||
        kt_mjcf_numbers(m, t, "tendon", "actuatorfrcrange", 2, 2, range) != 2)
        return;
    if (next_sharer(actions, d) == NULL) {
        clamp_bounds(range, (const double[]){d->numbers.lower, d->numbers.upper});
        d->numbers.lower = range[0];
        d->numbers.upper = range[1];
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
        each->numbers.sum_lower = range[0];
        each->numbers.sum_upper = range[1];
    }
}

/* Whether an effect lists the actuator: if a sum that contains it is bounded, or if the force grows with the length or
 * its rate, since no servo has such a force. */
static bool needs_list(const kt_mjcf *m, const kt_list *actions, const action *d) {
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
    return d->c[1] > 0.0 || d->c[2] > 0.0 || kt_actuator_is_driven(&d->numbers) || action_is_muscle(d);
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
    l.factor = d->numbers.gear * (t != NULL ? t->coefficient : 1.0);
    const double c[3] = {l.factor * d->c[0], l.factor * l.factor * d->c[1], l.factor * l.factor * d->c[2]};
    const double ends[2] = {l.factor * d->numbers.lower, l.factor * d->numbers.upper};
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
        motor->torque = kt_function_constant(kt_clamp(c[0], bounds[0], bounds[1]));
        kt_left_count(&m->notes.motors, d->element);
    }
    kt_mjcf_name_effect(m, kt_xml_attribute(d->element, "name"));
}

/* Whether a muscle, in a joint without bounds, is a separate effect. */
static bool is_apart(const kt_mjcf_joint *j, const action *d) {
    return action_is_muscle(d) && isinf(j->force[0]) && isinf(j->force[1]);
}

/* Gives an effect the numbers of actuators, or takes the effect back and counts it if these are too many. */
static void list_actuators(kt_mjcf *m, kt_effect *effect, const kt_list *actuators, const kt_element *e) {
    kt_actuator *kept = kt_reader_take(m->r, &m->r->keep, (size_t)actuators->count, sizeof *kept);
    if (kept == NULL)
        return;
    memcpy(kept, actuators->items, (size_t)actuators->count * sizeof *kept);
    effect->actuators = kept;
    effect->actuator_count = actuators->count;
    if (kt_effect_numbers_fit(effect))
        return;
    m->draft.effects.count--;
    kt_unknown_count(&m->forces, "actuators of a limited sum that are too many for an effect", e);
}

static void add_to_list(kt_mjcf *m, const action *d, kt_list *to) {
    kt_actuator *actuator = kt_list_add(m->r, &m->r->scratch, to, sizeof *actuator);
    if (actuator != NULL)
        *actuator = d->numbers;
}

/* The sum of all listed actuators that act in a joint, or `only` one of them. */
static void add_sum(kt_mjcf *m, const kt_list *actions, int joint, const action *only) {
    const kt_mjcf_joint *j = kt_mjcf_joint_at(m, joint);
    kt_list sharers = {.count = 0};
    const action *last = NULL;
    for (int i = 0; i < actions->count; i++) {
        const action *d = action_at(actions, i);
        if (!d->is_listed || lever_of(m, d, joint) == 0.0 || (only != NULL ? d != only : is_apart(j, d)))
            continue;
        add_to_list(m, d, &sharers);
        last = d;
    }
    kt_effect *effect = last != NULL ? kt_draft_effect(&m->draft, last->element, KT_EFFECT_EXPRESSION) : NULL;
    if (effect == NULL)
        return;
    effect->joint = j->name;
    effect->lower = j->force[0];
    effect->upper = j->force[1];
    kt_phrase name = {.length = 0};
    kt_phrase_add(&name, "%.240s_actuators", j->name);
    kt_mjcf_name_effect(m, only != NULL || (sharers.count == 1 && last->tendon < 0)
                               ? kt_xml_attribute(last->element, "name")
                               : name.text);
    kt_left_count(&m->notes.sums, last->element);
    list_actuators(m, effect, &sharers, last->element);
}

/* Whether an actuator is listed together with an earlier one of the same tendon. */
static bool is_listed_with_another(const kt_list *actions, int index) {
    const action *d = action_at(actions, index);
    for (int i = 0; i < index && d->is_shared; i++)
        if (action_at(actions, i)->tendon == d->tendon)
            return true;
    return false;
}

/* Adds the actions along spatial tendons. */
static void pull_tendons(kt_mjcf *m, const kt_list *actions) {
    for (int i = 0; i < actions->count && !m->r->out_of_memory; i++) {
        const action *d = action_at(actions, i);
        kt_list sharers = {.count = 0};
        if (!is_along_path(m, d) || is_listed_with_another(actions, i))
            continue;
        if (kt_mjcf_tendon_at(m, d->tendon)->is_bounded)
            kt_unknown_count(&m->changes, "actuatorfrcrange of joints that an actuator of a spatial tendon moves, too",
                             d->element);
        for (const action *each = d; each != NULL; each = d->is_shared ? next_sharer(actions, each) : NULL)
            add_to_list(m, each, &sharers);
        kt_effect *effect = kt_mjcf_add_along_path(m, kt_mjcf_tendon_at(m, d->tendon), d->element);
        if (effect != NULL)
            list_actuators(m, effect, &sharers, d->element);
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
        action_at(&actions, i)->is_listed = needs_list(m, &actions, action_at(&actions, i));
    for (int i = 0; i < actions.count && !m->r->out_of_memory; i++)
        if (!action_at(&actions, i)->is_listed && !is_along_path(m, action_at(&actions, i)))
            add_alone(m, action_at(&actions, i));
    pull_tendons(m, &actions);
    for (int i = 0; i < m->joints.count && !m->r->out_of_memory; i++) {
        add_sum(m, &actions, i, NULL);
        for (int k = 0; k < actions.count && !m->r->out_of_memory; k++)
            if (is_apart(kt_mjcf_joint_at(m, i), action_at(&actions, k)))
                add_sum(m, &actions, i, action_at(&actions, k));
    }
}
