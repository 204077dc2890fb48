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

static int note_rejection(void *user, double t, const kt_loop_motion *motion, kt_loop_equation *equations) {
    rejection *noted = user;
    const int code = noted->loop->equations(noted->loop->user, t, motion, equations);
    noted->code = noted->code != 0 ? noted->code : code;
    for (int r = 0; r < noted->loop->row_count; r++)
        noted->finite = noted->finite && gives_finite_numbers(noted->loop, &equations[r]);
    return code;
}

int KT_KERNEL(kt_loop_rejecting)(const kt_model *model, const kt_data *data, double t, const double *v, int *code) {
    assert(kt_data_serve(model, data));
    for (size_t i = 0; i < model->n.loop; i++) {
        rejection noted = {.loop = &model->loop[i], .finite = true};
        kt_loop_record loop = model->loop[i];
        kt_loop_row rows[KT_LOOP_ROW_MAX];
        kt_loop_end end[2];
        if (loop.kind != KT_LOOP_KIND_CUSTOM || kt_loop_is_off(&loop))
            continue;
        loop.equations = note_rejection;
        loop.user = &noted;
        for (int k = 0; k < 2; k++)
            kt_end_follow(model, data, &model->loop[i], k, true, v, &end[k]);
        (void)KT_KERNEL(kt_loop_kinds)[loop.kind]->evaluate(&loop, model->number, end, t, rows);
        *code = noted.code;
        if (*code != 0 || !noted.finite)
            return (int)i;
    }
    return -1;
}
