/* Auxiliary states x of a model: x' = f(t, q, v, x) by formulas (kt_auxiliary_state) or laws of effects. The values of
 * these states are an input that data hold. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "base/where.h"
#include "dynamics/dynamics.h"
#include "effect/effect.h"
#include "evaluate/effect_formula.h"
#include "evaluate/evaluate.h"
#include "kinetree/mechanism.h"

#include <string.h>

int kt_auxiliary_state_count(const kt_model *model) { return model ? (int)model->n.x : 0; }

const char *kt_auxiliary_state_name(const kt_model *model, int state) {
    return model && KT_IS_INDEX(state, model->n.x) ? model->text + model->state[state].name : NULL;
}

int kt_auxiliary_state_find(const kt_model *model, const char *name) {
    for (size_t i = 0; model && name && i < model->n.x; i++)
        if (strcmp(model->text + model->state[i].name, name) == 0)
            return (int)i;
    return -1;
}

void kt_auxiliary_states_initial(const kt_model *model, double *x) {
    if (model && x)
        kt_copy(x, model->v0 + model->n.v, model->n.x * sizeof *x);
}

double *kt_auxiliary_states(const kt_model *model, kt_data *data) {
    return kt_data_serve(model, data) ? data->x : NULL;
}

static kt_status reject_rate(const kt_model *model, size_t i, double t, double rate, const double *values,
                             kt_error *error) {
    char fault[120];
    kt_formulas_explain(model, &model->state[i], values, fault, sizeof fault);
    return kt_error_set(error, KT_ERROR_NOT_FINITE,
                        kt_where_format("state '%.100s', t = %.9g s", kt_auxiliary_state_name(model, (int)i), t).text,
                        "its rate is %g%s; look for a division by zero, or for a function of a huge number", rate,
                        fault);
}

static kt_status reject_law(const kt_model *model, size_t i, double t, int code, kt_error *error) {
    const kt_where_text where =
        kt_where_format("state '%.100s', t = %.9g s", kt_auxiliary_state_name(model, (int)i), t);
    return code < 0 ? kt_error_set(error, KT_ERROR_CALLBACK, where.text, "the law of its rate stopped (code %d)", code)
                    : kt_error_set(error, KT_ERROR_EFFECT, where.text,
                                   "the law of its rate cannot compute it here (code %d)", code);
}

/* The rates of the states of a law, which one call of the law computes. */
typedef struct law {
    int32_t source; /* the effect whose rates these are; -1: none yet */
    int code;
    double rates[KT_LAW_STATE_MAX];
} law;

/* The rate of one state; returns the code of the law, otherwise 0. For successive states of one effect, the law is
 * evaluated once, and *last has its rates. */
static int evaluate_rate(const kt_model *model, const kt_effect_record *formula, const double *values, law *last,
                         double *rate) {
    double out[6];
    if (formula->law == NULL) {
        (void)kt_formulas_evaluate(model, formula, values, out);
        *rate = out[0];
        return 0;
    }
    if (formula->source != last->source) {
        *last = (law){.source = formula->source};
        last->code = formula->law(formula->user, values, NULL, last->rates);
    }
    *rate = last->rates[formula->law_rate - 1];
    return last->code;
}

kt_status kt_auxiliary_state_rates_trusted(const kt_model *model, kt_data *data, double t, const double *q,
                                           const double *v, double *rates, kt_error *error) {
    kt_status status = KT_OK;
    const kt_dynamic_state at = {.t = t, .q = q, .v = v};
    double values[KT_FORMULA_VARIABLE_MAX];
    law last = {.source = -1};
    if (model->n.force_link > 0)
        kt_force_frames_sweep(model, data, q, v);
    for (size_t i = 0; i < model->n.x; i++) {
        const kt_effect_record *formula = &model->state[i];
        kt_formula_variables_read(model, data, NULL, formula, &at, NULL, values);
        const int code = evaluate_rate(model, formula, values, &last, &rates[i]);
        if (code != 0 && status == KT_OK)
            status = reject_law(model, i, t, code, error);
        else if (!isfinite(rates[i]) && status == KT_OK)
            status = reject_rate(model, i, t, rates[i], values, error);
    }
    return status;
}

int kt_auxiliary_state_time_derivatives(const kt_model *model, kt_data *data, double t, const double *q,
                                        const double *v, double *derivatives) {
    const kt_dynamic_state at = {.t = t, .q = q, .v = v};
    double rates[6];
    int code = 0;
    if (model->n.force_link > 0)
        kt_force_frames_sweep(model, data, q, v);
    for (size_t i = 0; i < model->n.x && code == 0; i++) {
        code = kt_formula_time_derivatives(model, data, NULL, &model->state[i], &at, NULL, rates);
        derivatives[i] = rates[0];
    }
    return code;
}

kt_status kt_auxiliary_state_rates(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                                   double *rates, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, rates || !model->n.x))
        return KT_ERROR_ARGUMENT;
    const kt_input input = {.q = q, .v = v};
    double *made = data->x + model->n.x;
    kt_status status = kt_input_check(model, &input, error);
    if (status == KT_OK)
        status = kt_auxiliary_state_rates_trusted(model, data, t, q, v ? v : model->zero, made, error);
    if (status == KT_OK)
        kt_copy(rates, made, model->n.x * sizeof *rates);
    return status;
}

size_t kt_auxiliary_state_varying(const kt_model *model) {
    bool is_constant = true;
    size_t i = 0;
    for (; i < model->n.x && is_constant; i += is_constant) {
        const kt_effect_record *rate = &model->state[i];
        double out[6] = {0.0};
        is_constant = rate->law == NULL && rate->variable_count == 0 &&
                      kt_formulas_evaluate(model, rate, NULL, out) == 0 && out[0] == 0.0;
    }
    return i;
}

bool kt_auxiliary_states_are_idle(const kt_model *model) {
    bool idle = kt_auxiliary_state_varying(model) == model->n.x;
    for (size_t i = 0; i < model->n.variable && idle; i++)
        idle = model->variable[i].type != KT_VARIABLE_STATE;
    return idle;
}

kt_status kt_auxiliary_states_reject(const kt_model *model, const char *where, const char *what, kt_error *error) {
    return model->n.x == 0 ? KT_OK
                           : kt_error_set(error, KT_ERROR_UNSUPPORTED, where,
                                          "the model has auxiliary states ('%.60s' is one), and %s",
                                          kt_auxiliary_state_name(model, 0), what);
}
