/* The error of a failure whose cause is a caller's own loop. The equations of such a loop are then NaN, and the failing
 * function does not have the callback's code. Since a callback is a function of its arguments alone, it is called again
 * to obtain the code. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/rejected_loops.h"

#include "base/where.h"
#include "constraint/rejecting_loop.h"
#include "dynamics/dynamics.h"
#include "loop/loop.h"
#include "model/check.h"

#include <math.h>

static bool has_custom_loops(const kt_model *model) {
    bool any = false;
    for (size_t i = 0; i < model->n.loop; i++)
        any |= model->loop[i].kind == KT_LOOP_KIND_CUSTOM && !kt_loop_is_off(&model->loop[i]);
    return any;
}

/* Whether numbers are of a size that a description may have; NULL: there are none. */
static bool is_moderate(const double *x, size_t n) {
    bool moderate = true;
    for (size_t i = 0; i < n && x != NULL; i++)
        moderate = moderate && fabs(x[i]) <= KT_NUMBER_MOST;
    return moderate;
}

/* Explains a failure whose state no loop rejects. If equations were not finite although the state is moderate, a
 * callback has rejected a state on the way to closed loops. */
static kt_status explain_nearby(const kt_model *model, double t, const double *q, const double *v, kt_status status,
                                kt_error *error) {
    if (status != KT_ERROR_NOT_FINITE || !is_moderate(q, model->n.q) || !is_moderate(v, model->n.v))
        return status;
    return kt_error_set(error, KT_ERROR_CONSTRAINT, kt_where_format("t = %.9g s", t).text,
                        "the callback of a loop has rejected a state near this one, in which the loops were being "
                        "closed, but not this state. Let the callback compute its equations in all states nearby");
}

kt_status kt_loops_explain(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                           kt_status status, kt_error *error) {
    int code = 0, loop = -1;
    if (status == KT_OK || !has_custom_loops(model))
        return status;
    if (kt_stop_report(model, data, t, KT_OK, error) != KT_OK)
        return KT_ERROR_CALLBACK;
    for (int at_rest = v == NULL; at_rest < 2 && loop < 0; at_rest++) { /* positions are closed at rest */
        const double *rates = at_rest ? model->zero : v;
        kt_error ignored;
        if (kt_motion_update(model, data, q, rates, NULL, &ignored) != KT_OK)
            return status;
        KT_BY_ISA(model->isa, loop =, kt_loop_rejecting, (model, data, t, rates, &code));
    }
    if (loop < 0)
        return explain_nearby(model, t, q, v, status, error);
    const kt_where_text where = kt_where_format("loop '%.100s', t = %.9g s", model->text + model->loop[loop].name, t);
    if (code == 0)
        return kt_error_set(error, KT_ERROR_NOT_FINITE, where.text, "its callback gave equations that are not finite");
    if (code < 0)
        return kt_error_set(error, KT_ERROR_CALLBACK, where.text, "its callback stopped (code %d)", code);
    return kt_error_set(error, KT_ERROR_CONSTRAINT, where.text,
                        "its callback cannot compute its equations here (code %d)", code);
}
