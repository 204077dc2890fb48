/* Checks auxiliary states and adds them to a model. Each state adds a formula, like an effect in a joint, or the law of
 * an effect. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/attach.h"
#include "compile/compile.h"
#include "effect/actuator.h"
#include "model/check.h"

#include <string.h>

/* Names that formulas have already. */
static bool is_reserved(const char *name) {
#define OWN_STATE_NAME(id, name, least, most) #name,
    static const char *const names[] = {"t", "pi", "length", "speed", KT_EXPRESSION_FUNCTION_LIST(OWN_STATE_NAME)};
#undef OWN_STATE_NAME
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strcmp(name, names[i]) == 0)
            return true;
    return false;
}

/* One effect's law writes the rate. */
static void check_law(kt_checker *checker, const kt_auxiliary_state *state) {
    int rate;
    const int law = state->name ? kt_law_of_state(checker->description, state->name, -1, &rate) : -1;
    if (law < 0)
        kt_checker_fault(checker, "rate", -1, "rate is missing; give the formula of its derivative by time%s",
                         checker->description->effect_count > 0 ? ", or name it in an effect whose law writes it" : "");
    else if (kt_law_of_state(checker->description, state->name, law, &rate) >= 0)
        kt_checker_fault(checker, "rate", -1, "the laws of two effects write it; name it in one of them");
}

void kt_checker_state(kt_checker *checker, const kt_auxiliary_state *state) {
    kt_checker_name(checker, KT_SCOPE_STATE, "states", state->name, false);
    if (state->name != NULL && is_reserved(state->name))
        kt_checker_fault(checker, "name", -1, "name %s has a meaning in formulas already; choose another",
                         kt_name_quote(state->name).text);
    (void)kt_checker_number(checker, "initial", state->initial);
    kt_formula_names names = {.description = checker->description};
    if (state->activation != NULL)
        kt_checker_activation(checker, state);
    else if (state->rate == NULL)
        check_law(checker, state);
    else
        (void)kt_checker_formula(checker, "rate", state->rate, &names);
}

/* Returns the rate in the form of an effect in a joint, because such an effect has the same variables, and the same
 * code compiles both. If the rate belongs to a law, the result is the effect of this law. *law and *rate: the indices
 * of the law and of its rate; -1 without a law. `written` receives the rate of an activation. */
static kt_effect effect_of(const kt_description *d, const kt_auxiliary_state *state, kt_formula_text *written, int *law,
                           int *rate) {
    kt_effect effect = kt_effect_default();
    *rate = *law = -1;
    if (state->rate == NULL && state->activation == NULL) {
        *law = kt_law_of_state(d, state->name, -1, rate);
        return d->effects[*law];
    }
    effect.type = KT_EFFECT_EXPRESSION;
    effect.formula[0] = state->rate;
    if (state->activation != NULL) {
        kt_activation_rate(state->activation, state->name, written);
        effect.formula[0] = written->text;
    }
    return effect;
}

kt_status kt_attach_count_states(kt_attach *a, kt_counts *n, kt_error *error) {
    const kt_description *d = a->description;
    kt_status status = KT_OK;
    for (int i = 0; i < d->state_count && status == KT_OK; i++) {
        int law, of;
        kt_formula_text written;
        const kt_effect rate = effect_of(d, &d->states[i], &written, &law, &of);
        kt_formula_names names;
        status = kt_attach_count_formulas(d, &rate, &names, n, error);
        if (status == KT_OK)
            kt_attach_mark_variables(a, n, &names);
        n->text += strlen(d->states[i].name) + 1;
    }
    return status;
}

kt_status kt_attach_fill_states(const kt_attach *a, kt_model *m, size_t *number, size_t *variable, size_t *part,
                                size_t *text, kt_error *error) {
    const kt_description *d = a->description;
    kt_status status = KT_OK;
    for (int i = 0; i < d->state_count && status == KT_OK; i++) {
        const kt_auxiliary_state *state = &d->states[i];
        int law, of;
        kt_formula_text written;
        const kt_effect rate = effect_of(d, state, &written, &law, &of);
        kt_effect_record *r = &m->state[i];
        *r = (kt_effect_record){.type = (int32_t)rate.type,
                                .source = (int32_t)(law < 0 ? i : law),
                                .name = kt_model_store_text(m, text, state->name),
                                .law_rate = (int32_t)of + 1,
                                .breakpoint = rate.breakpoint,
                                .user = rate.user};
        m->v0[m->n.v + (size_t)i] = state->initial;
        status = kt_attach_fill_formulas(a, m, &rate, r, number, variable, part, error);
    }
    return status;
}
