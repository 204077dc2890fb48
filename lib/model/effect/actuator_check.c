/* Checks of the numbers of actuators, polynomial springs and activations. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/actuator.h"

#include <math.h>
#include <string.h>

/* Checks bounds, which may be infinite. `name` is the key of the lower one. */
static void check_range(kt_checker *checker, int sub, const char *name, double lower, double upper) {
    const bool is_fine = (kt_number_is_fine(lower) || lower == -(double)INFINITY) &&
                         (kt_number_is_fine(upper) || upper == (double)INFINITY);
    if (!is_fine || lower > upper)
        kt_checker_fault(checker, "actuators", sub, "%s is %g, and the upper bound %g; give two numbers that rise",
                         name, lower, upper);
}

static void check_muscle(kt_checker *checker, int sub, const char *name, const kt_muscle *m) {
    const double numbers[] = {m->range[0], m->range[1], m->lengths[0], m->lengths[1], m->force,
                              m->shortest, m->longest,  m->speed,      m->passive,    m->stretched};
    if (!kt_checker_values(checker, name, sub, "", numbers, (int)(sizeof numbers / sizeof *numbers)))
        return;
    if (!(m->lengths[0] < m->lengths[1]))
        kt_checker_fault(checker, name, sub, "%s: lengths are %g and %g; give two numbers that rise", name,
                         m->lengths[0], m->lengths[1]);
}

/* Terms of an actuator are joints whose positions add up to its length. One of them must be the effect's own joint. */
static void check_terms(kt_checker *checker, const kt_effect *effect, int i) {
    const kt_actuator *a = &effect->actuators[i];
    bool is_own = false;
    if (a->term_count < 0 || (a->term_count > 0 && (a->terms == NULL || effect->end_count != 0))) {
        kt_checker_fault(checker, "actuators", i, "term_count numbers of joints are `terms`, of an effect in a joint");
        return;
    }
    for (int k = 0; k < a->term_count; k++) {
        (void)kt_checker_scalar_joint(checker, "actuators", i, a->terms[k].joint);
        (void)kt_checker_value(checker, "actuators", i, ".terms", k, a->terms[k].coefficient);
        is_own = is_own ||
                 (a->terms[k].joint != NULL && effect->joint != NULL && strcmp(a->terms[k].joint, effect->joint) == 0);
    }
    if (a->term_count > 0 && !is_own)
        kt_checker_fault(checker, "actuators", i,
                         "its terms do not name the joint of the effect, in which it has no force; leave it out");
}

static void check_actuator(kt_checker *checker, const kt_effect *effect, int i) {
    const kt_actuator *a = &effect->actuators[i];
    const double numbers[] = {a->gear,    a->gain[0], a->gain[1], a->gain[2], a->bias[0],
                              a->bias[1], a->bias[2], a->control, a->delay};
    if (!kt_checker_values(checker, "actuators", i, "", numbers, (int)(sizeof numbers / sizeof *numbers)) ||
        !kt_checker_values(checker, "actuators", i, ".wrench", a->wrench, 6))
        return;
    if (a->delay < 0.0)
        kt_checker_fault(checker, "actuators", i, "delay is %g; it must be 0 or more", a->delay);
    check_range(checker, i, "control_lower", a->control_lower, a->control_upper);
    check_range(checker, i, "activation_lower", a->activation_lower, a->activation_upper);
    check_range(checker, i, "lower", a->lower, a->upper);
    check_range(checker, i, "sum_lower", a->sum_lower, a->sum_upper);
    if (a->activation != NULL && kt_names_find(&checker->names, KT_SCOPE_STATE, a->activation) < 0)
        kt_checker_fault(checker, "actuators", i, "state %s does not exist; add it to `states`",
                         kt_name_quote(a->activation).text);
    if (a->active != NULL)
        check_muscle(checker, i, "active", a->active);
    if (a->passive != NULL)
        check_muscle(checker, i, "passive", a->passive);
    check_terms(checker, effect, i);
    if (!kt_actuator_sum_is_possible(effect, i))
        kt_checker_fault(
            checker, "actuators", i,
            "sum_lower and sum_upper must have zero between them, or all actuators of the tendon have one gear "
            "and no bounds of their own; none of them has an activation, a delay or a muscle");
}

static void check_spring(kt_checker *checker, const kt_effect *effect) {
    const kt_polynomial_spring *s = effect->spring;
    const double numbers[] = {s->factor,     s->stiffness[0], s->stiffness[1], s->stiffness[2], s->damping[0],
                              s->damping[1], s->damping[2],   s->rest[0],      s->rest[1],      s->friction};
    if (!kt_checker_values(checker, "spring", -1, "", numbers, (int)(sizeof numbers / sizeof *numbers)))
        return;
    if (s->rest[0] > s->rest[1])
        kt_checker_fault(checker, "spring", -1, "rest is %g and %g; give two numbers that rise", s->rest[0],
                         s->rest[1]);
    if (!(s->smoothing > 0.0 && isfinite(s->smoothing)))
        kt_checker_fault(checker, "spring", -1, "smoothing is %g; it must be above 0", s->smoothing);
    if (effect->end_count == 1)
        kt_checker_fault(checker, "spring", -1, "a spring acts in a joint, between two ends, or along a path");
    else if (effect->end_count == 0 && (s->friction != 0.0 || s->beyond))
        kt_checker_fault(checker, "spring", -1,
                         "in a joint a spring has neither friction nor `beyond`; take joint_friction, or joint_limit");
    else if (effect->end_count == 2 && s->factor != 1.0)
        kt_checker_fault(checker, "spring", -1, "the factor is of a spring in a joint; leave it out");
}

void kt_checker_numbers(kt_checker *checker, const kt_effect *effect) {
    for (int k = 0; k < 6; k++)
        if (effect->formula[k] != NULL || effect->law != NULL ||
            (effect->actuators != NULL && effect->spring != NULL)) {
            kt_checker_fault(checker, "actuators", -1,
                             "formulas, a law, actuators and a spring exclude one another; give one of them");
            return;
        }
    if (effect->actuators != NULL && effect->actuator_count < 1) {
        kt_checker_fault(checker, "actuators", -1, "actuator_count is %d; it must be 1 or more",
                         effect->actuator_count);
        return;
    }
    check_range(checker, -1, "lower", effect->lower, effect->upper);
    for (int i = 0; i < effect->actuator_count && effect->actuators != NULL && !kt_checker_is_done(checker); i++)
        check_actuator(checker, effect, i);
    if (effect->spring != NULL)
        check_spring(checker, effect);
    if (checker->first.code != KT_OK)
        return;
    kt_formula_names names = kt_effect_names_of(checker->description, effect);
    if (!kt_effect_numbers_fit(effect)) {
        kt_checker_fault(checker, "actuators", -1, "its actuators are too many for one effect; make two effects of it");
        return;
    }
    for (int k = 0; k < 6; k++) {
        kt_formula_text text;
        const char *formula = kt_effect_formula(effect, k, &text);
        if (formula != NULL && !kt_checker_formula(checker, "actuators", formula, &names))
            return;
    }
}

void kt_checker_activation(kt_checker *checker, const kt_auxiliary_state *state) {
    const kt_activation *a = state->activation;
    const double numbers[] = {a->control, a->delay, a->times[0], a->times[1], a->times[2]};
    if (state->rate != NULL)
        kt_checker_fault(checker, "activation", -1, "a formula for the rate is given, too; leave one of the two out");
    if ((unsigned)a->type >= KT_ACTIVATION_TYPE_COUNT) {
        kt_checker_fault(checker, "activation", -1, "type is %d; take one of kt_activation_type", (int)a->type);
        return;
    }
    if (!kt_checker_values(checker, "activation", -1, "", numbers, (int)(sizeof numbers / sizeof *numbers)))
        return;
    for (int k = 0; k < 3; k++)
        if (a->times[k] < 0.0)
            kt_checker_fault(checker, "activation", k, "a time is %g; it must be 0 or more", a->times[k]);
    if (a->type == KT_ACTIVATION_FILTER && a->times[0] == 0.0)
        kt_checker_fault(checker, "activation", -1, "the time of a filter is missing; give `times: [T]`, in seconds");
    if (a->delay < 0.0)
        kt_checker_fault(checker, "activation", -1, "delay is %g; it must be 0 or more", a->delay);
    check_range(checker, -1, "control_lower", a->control_lower, a->control_upper);
}
