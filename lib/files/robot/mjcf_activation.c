/* Activations of actuators in MJCF as auxiliary states.
 *
 * The activation w of an actuator replaces its control u in the force. The activation has one of these rates:
 *     integrator: w' = u,   filter and filterexact: w' = (u - w) / T,   muscle: effect/muscle.c.
 * `actrange` bounds it. For a constant control w has no turning point. Therefore w itself, which MuJoCo bounds, and the
 * value that the force uses, which the library bounds, give the same force. With a delay, the control is zero
 * before. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"

/* Time constants below this are none, s: the activation is the control. */
static const double time_least = 1e-6;

kt_mjcf_dynamics kt_mjcf_dynamics_of(kt_mjcf *m, const kt_element *e, kt_mjcf_dynamics inherited) {
    static const char *const words[] = {"none", "integrator", "filter", "filterexact", "muscle", "user", NULL};
    static const kt_mjcf_dynamics_type types[] = {KT_MJCF_STATIC, KT_MJCF_INTEGRATOR, KT_MJCF_FILTER,
                                                  KT_MJCF_FILTER, KT_MJCF_MUSCLE,     KT_MJCF_LOST};
    kt_mjcf_dynamics d = inherited;
    double read[10];
    d.type = types[kt_mjcf_choice(m, e, NULL, "dyntype", words, (int)d.type)];
    const char *text = kt_xml_attribute(e, "dynprm");
    const int count = text != NULL ? kt_parse_numbers(text, 10, read) : 0;
    for (int i = 0; i < count && i < 3; i++)
        d.numbers[i] = read[i];
    (void)kt_mjcf_numbers(m, e, NULL, "actdim", 1, 1, &d.count);
    return d;
}

bool kt_mjcf_is_dynamic(const kt_mjcf_dynamics *d) {
    return d->type == KT_MJCF_INTEGRATOR || d->type == KT_MJCF_MUSCLE ||
           (d->type == KT_MJCF_FILTER && d->numbers[0] > time_least);
}

int kt_mjcf_activations_of(const kt_mjcf_dynamics *d) {
    return d->type == KT_MJCF_STATIC ? 0 : d->count >= 1.0 && d->count < 1e6 ? (int)d->count : 1;
}

/* "activation_NAME", with letters, digits and '_' alone. */
static const char *make_activation_name(kt_mjcf *m, const kt_element *e) {
    kt_phrase wanted = {.length = 0};
    kt_phrase_add(&wanted, "activation_%.100s", kt_element_name(e, "of_actuator"));
    for (char *c = wanted.text; *c != '\0'; c++)
        *c = *c == '-' || *c == '.' ? '_' : *c;
    return kt_namer_make(&m->states_named, wanted.text);
}

const char *kt_mjcf_add_activation(kt_mjcf *m, const kt_element *e, const kt_mjcf_dynamics *d,
                                   const kt_actuator *control, double initial) {
    kt_auxiliary_state *state = kt_list_add(m->r, &m->r->keep, &m->draft.states, sizeof *state);
    kt_activation *made = kt_reader_take(m->r, &m->r->keep, 1, sizeof *made);
    const char *name = make_activation_name(m, e);
    if (state == NULL || made == NULL || *name == '\0')
        return NULL;
    *made = (kt_activation){.type = d->type == KT_MJCF_FILTER   ? KT_ACTIVATION_FILTER
                                    : d->type == KT_MJCF_MUSCLE ? KT_ACTIVATION_MUSCLE
                                                                : KT_ACTIVATION_INTEGRATOR,
                            .control = control->control,
                            .control_lower = control->control_lower,
                            .control_upper = control->control_upper,
                            .delay = d->delay};
    const int count = d->type == KT_MJCF_FILTER ? 1 : d->type == KT_MJCF_MUSCLE ? 3 : 0;
    for (int k = 0; k < count; k++)
        made->times[k] = d->numbers[k];
    *state = (kt_auxiliary_state){.name = name, .initial = initial, .activation = made};
    kt_left_count(&m->notes.activations, e);
    return name;
}
