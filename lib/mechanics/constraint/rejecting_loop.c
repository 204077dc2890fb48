/* Finds the caller's own loop that rejects a state. The loop's equations are computed once more in this state, with a
 * callback that records the first number that the loop's own callback returns, and whether its equations are finite.
 * Differences call the loop's callback in neighbouring states, too. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "constraint/rejecting_loop.h"

#include "constraint/loop_jacobian.h"
#include "kinetree/loop.h"
#include "loop/loop.h"

#include <assert.h>
#include <math.h>

/* The callback of a loop, the first number other than 0 that the callback has returned, and whether all equations are
 * finite. */
typedef struct rejection {
    const kt_loop_record *loop;
    int code;
    bool finite;
} rejection;

/* Whether the numbers are finite that a callback has to write. */
static bool gives_finite_numbers(const kt_loop_record *loop, const kt_loop_equation *equation) {
    const bool row = kt_vec3_is_finite(equation->moment) && kt_vec3_is_finite(equation->force);
    return isfinite(equation->residual) &&
           (loop->given == KT_LOOP_GIVES_RESIDUAL || (row && isfinite(equation->rate))) &&
           (loop->given != KT_LOOP_GIVES_ALL || isfinite(equation->drift));
}

static int record_rejection(void *user, double t, const kt_loop_motion *motion, kt_loop_equation *equations) {
    rejection *recorded = user;
    const int code = recorded->loop->equations(recorded->loop->user, t, motion, equations);
    recorded->code = recorded->code != 0 ? recorded->code : code;
    for (int r = 0; r < recorded->loop->row_count; r++)
        recorded->finite = recorded->finite && gives_finite_numbers(recorded->loop, &equations[r]);
    return code;
}

int KT_KERNEL(kt_loop_rejecting)(const kt_model *model, const kt_data *data, double t, const double *v, int *code) {
    assert(kt_data_serve(model, data));
    for (size_t i = 0; i < model->n.loop; i++) {
        rejection recorded = {.loop = &model->loop[i], .finite = true};
        kt_loop_record loop = model->loop[i];
        kt_loop_row rows[KT_LOOP_ROW_MAX];
        kt_loop_end end[2];
        if (loop.kind != KT_LOOP_KIND_CUSTOM || kt_loop_is_off(&loop))
            continue;
        loop.equations = record_rejection;
        loop.user = &recorded;
        for (int k = 0; k < 2; k++)
            kt_end_follow(model, data, &model->loop[i], k, true, v, &end[k]);
        (void)KT_KERNEL(kt_loop_kinds)[loop.kind]->evaluate(&loop, model->number, end, t, rows);
        *code = recorded.code;
        if (*code != 0 || !recorded.finite)
            return (int)i;
    }
    return -1;
}
