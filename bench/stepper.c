/* (q, v)' = (v, forward dynamics), four evaluations a step. A slice starts anew and its steps are tiny, so the measured
 * cost does not depend on the length of the measurement. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "stepper.h"

#include <stdlib.h>
#include <string.h>

static const double step = 1e-9;

static int right_hand_side(double t, const double *y, double *dydt, void *user) {
    (void)t;
    kt_chain *c = user;
    const size_t n = (size_t)c->n;
    memcpy(dydt, y + n, n * sizeof *dydt);
    return kt_dynamics_forward(c->model, c->data, y, y + n, c->tau, NULL, dydt + n, &c->error) == KT_OK ? 0 : -1;
}

kt_status kt_stepper_make(kt_chain *chain, kt_stepper *stepper, kt_error *error) {
    const kt_method *method = kt_method_find("rk4");
    const size_t n = (size_t)chain->n;
    kt_integrator_options options = kt_integrator_options_default();
    options.step = step;
    *stepper = (kt_stepper){.chain = chain, .callbacks = {.rhs = right_hand_side, .user = chain}};
    stepper->size = kt_integrator_size(method, 2 * n);
    stepper->memory = malloc(stepper->size);
    stepper->start = malloc(2 * n * sizeof *stepper->start);
    kt_status status = KT_ERROR_MEMORY;
    if (stepper->memory && stepper->start) {
        memcpy(stepper->start, chain->q, n * sizeof *stepper->start);
        memcpy(stepper->start + n, chain->v, n * sizeof *stepper->start);
        status =
            kt_integrator_init(stepper->memory, stepper->size, method, 2 * n, &options, &stepper->integrator, error);
    } else {
        (void)kt_error_set(error, status, "", "no memory to integrate a chain of %d links", chain->n);
    }
    if (status != KT_OK)
        kt_stepper_free(stepper);
    return status;
}

void kt_stepper_free(kt_stepper *stepper) {
    free(stepper->memory);
    free(stepper->start);
    *stepper = (kt_stepper){.size = 0};
}

void kt_stepper_run(void *stepper, long repetitions) {
    kt_stepper *s = stepper;
    kt_error *error = &s->chain->error;
    if (error->code != KT_OK || kt_integrator_start(s->integrator, 0.0, s->start, &s->callbacks, error) != KT_OK)
        return;
    for (long k = 0; k < repetitions; k++)
        if (kt_integrator_step(s->integrator, (double)INFINITY, error) != KT_OK)
            return;
}
