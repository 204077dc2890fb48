/* Chains of one length: made, run there and back, timed. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "interpose.h"
#include "kinetree/control.h"
#include "kinetree/identification.h"
#include "scaling.h"
#include "stepper.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *const kt_scaling_call[KT_SCALING_CALLS] = {
    "RNEA", "ABA",    "RK4",      "CRBA",      "dABA",         "bias",      "terms",         "column",         "dABA3",
    "AB",   "motion", "gradient", "regressor", "closed dABA3", "closed AB", "closed motion", "closed gradient"};

static kt_status first_failure(const kt_chain *chain, kt_error *error) {
    if (chain->error.code != KT_OK && error)
        *error = chain->error;
    return chain->error.code;
}

/* max |tau' - tau| / max |h|, tau' by RNEA from the accelerations that ABA gave for tau; NaN where a call fails. */
static double round_trip_error(kt_chain *c) {
    double *bias = malloc((size_t)c->n * sizeof *bias);
    double error = (double)NAN;
    kt_chain_forward(c, 1);
    kt_chain_inverse(c, 1);
    if (bias && c->error.code == KT_OK &&
        kt_dynamics_inverse(c->model, c->data, c->q, c->v, NULL, NULL, bias, &c->error) == KT_OK)
        error = kt_chain_difference(c->torque, c->tau, bias, c->n);
    free(bias);
    return error;
}

static long count_allocations(const kt_bench_task *tasks, int count) {
    kt_interpose_start();
    for (int i = 0; i < count; i++)
        tasks[i].run(tasks[i].user, 2);
    return kt_interpose_stop();
}

static void describe(const kt_chain *chain, kt_scaling_line *line) {
    line->n = chain->n;
    line->isa = kt_model_isa(chain->model);
    line->set_up = chain->set_up;
    line->model = kt_model_size(chain->model);
    line->data = kt_data_size(chain->model);
}

kt_status kt_scaling_measure(int n, const kt_bench_options *options, kt_scaling_line *line, kt_error *error) {
    const bool with_mass = n <= KT_SCALING_MASS_MAX;
    kt_chain chain;
    kt_stepper stepper;
    kt_status status = kt_chain_make(n, options->isa, with_mass, &chain, error);
    if (status != KT_OK)
        return status;
    status = kt_stepper_make(&chain, &stepper, error);
    if (status == KT_OK) {
        const kt_bench_task tasks[KT_SCALING_CALLS] = {[KT_SCALING_RNEA] = {kt_chain_inverse, &chain},
                                                       [KT_SCALING_ABA] = {kt_chain_forward, &chain},
                                                       [KT_SCALING_RK4] = {kt_stepper_run, &stepper},
                                                       [KT_SCALING_CRBA] = {kt_chain_mass, &chain}};
        const int count = with_mass ? KT_SCALING_CRBA + 1 : KT_SCALING_CRBA;
        *line = (kt_scaling_line){.integrator = stepper.size};
        describe(&chain, line);
        for (int i = 0; i < count; i++)
            line->measured[i] = true;
        line->allocations = count_allocations(tasks, count);
        line->error = round_trip_error(&chain);
        kt_bench_measure(tasks, count, options->seconds, line->times);
        status = first_failure(&chain, error);
        kt_stepper_free(&stepper);
    }
    kt_chain_free(&chain);
    return status;
}

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

/* max |M da/dv + dtau/dv| over the largest sum of the terms of one of these numbers; NaN where a call fails. */
static double derivative_error(kt_chain *c) {
    const size_t n = (size_t)c->n;
    double *dq = malloc(2 * n * n * sizeof *dq), *dv = dq ? dq + n * n : NULL;
    double worst = (double)NAN;
    kt_chain_forward(c, 1);
    kt_chain_mass(c, 1);
    kt_chain_derivatives(c, 1);
    if (dq && c->error.code == KT_OK &&
        kt_dynamics_inverse_derivatives(c->model, c->data, c->work, c->work_size, c->q, c->v, c->a, NULL, dq, dv,
                                        &c->error) == KT_OK) {
        double most = 0.0;
        worst = 0.0;
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++) {
                double sum = dv[j * n + i], size = fabs(sum);
                for (size_t k = 0; k < n; k++) {
                    sum += c->mass[k * n + i] * c->da_dv[j * n + k];
                    size += fabs(c->mass[k * n + i] * c->da_dv[j * n + k]);
                }
                worst = isfinite(sum) ? fmax(worst, fabs(sum)) : (double)INFINITY;
                most = fmax(most, size);
            }
        worst /= most;
    }
    free(dq);
    return worst;
}

kt_status kt_scaling_derive(int n, const kt_bench_options *options, kt_scaling_line *line, kt_error *error) {
    kt_chain chain;
    kt_status status = kt_chain_make(n, options->isa, true, &chain, error);
    if (status != KT_OK)
        return status;
    status = kt_chain_make_derivatives(&chain, error);
    if (status == KT_OK) {
        const kt_bench_task tasks[] = {{kt_chain_forward, &chain}, {kt_chain_derivatives, &chain}};
        kt_bench_times times[2];
        *line = (kt_scaling_line){.integrator = 0};
        describe(&chain, line);
        line->allocations = count_allocations(tasks, 2);
        line->error = derivative_error(&chain);
        kt_bench_measure(tasks, 2, options->seconds, times);
        line->measured[KT_SCALING_ABA] = line->measured[KT_SCALING_DERIVATIVES] = true;
        line->times[KT_SCALING_ABA] = times[0];
        line->times[KT_SCALING_DERIVATIVES] = times[1];
        status = first_failure(&chain, error);
    }
    kt_chain_free(&chain);
    return status;
}

/* ---- operational space ------------------------------------------------------------------------------------------- */

typedef struct control {
    kt_chain chain;
    kt_mass_inverse *inverse;
    kt_twist bias;
} control;

static const kt_vec3 end_of_link = {0.1, 0.2, -0.3};

static void run_bias(void *user, long repetitions) {
    control *c = user;
    for (long k = 0; k < repetitions; k++)
        c->bias = kt_frame_bias(c->chain.model, c->chain.data, c->chain.n, end_of_link, KT_TWIST_ALIGNED);
}

static void run_terms(void *user, long repetitions) {
    control *c = user;
    for (long k = 0; k < repetitions && c->chain.error.code == KT_OK; k++)
        if (kt_mass_inverse_compute(c->inverse, c->chain.data, 0.0, c->chain.q, &c->chain.error) != KT_OK)
            return;
}

static void run_column(void *user, long repetitions) {
    control *c = user;
    for (long k = 0; k < repetitions && c->chain.error.code == KT_OK; k++) {
        memcpy(c->chain.x, c->chain.tau, (size_t)c->chain.n * sizeof *c->chain.x);
        if (kt_mass_inverse_apply(c->inverse, 1, c->chain.x, &c->chain.error) != KT_OK)
            return;
    }
}

/* The larger of two errors. One is max |M x - tau| over the largest sum of its terms. The other is the difference of J'
 * v from the acceleration at rest of all joint rates. Leaves kinematics and terms. */
static double control_error(control *c) {
    kt_chain *chain = &c->chain;
    const int n = chain->n;
    double worst = 0.0, most = 0.0;
    kt_chain_mass(chain, 1);
    run_terms(c, 1);
    run_column(c, 1);
    if (chain->error.code != KT_OK ||
        kt_kinematics_update(chain->model, chain->data, chain->q, chain->v, NULL, &chain->error) != KT_OK)
        return (double)NAN;
    run_bias(c, 1);
    for (int i = 0; i < n; i++) {
        double sum = -chain->tau[i], size = fabs(sum);
        for (int k = 0; k < n; k++) {
            sum += chain->mass[k * n + i] * chain->x[k];
            size += fabs(chain->mass[k * n + i] * chain->x[k]);
        }
        worst = isfinite(sum) ? fmax(worst, fabs(sum)) : (double)INFINITY;
        most = fmax(most, size);
    }
    const kt_vec3 a = kt_point_acceleration(chain->model, chain->data, n, end_of_link);
    return fmax(worst / most, kt_chain_difference(&c->bias.linear.x, &a.x, &a.x, 3));
}

static kt_status measure_control(control *c, const kt_bench_options *options, kt_scaling_line *line, kt_error *error) {
    static const int calls[] = {KT_SCALING_ABA, KT_SCALING_BIAS, KT_SCALING_TERMS, KT_SCALING_COLUMN};
    const kt_bench_task tasks[] = {{kt_chain_forward, &c->chain}, {run_bias, c}, {run_terms, c}, {run_column, c}};
    kt_bench_times times[4];
    *line = (kt_scaling_line){.integrator = 0};
    describe(&c->chain, line);
    line->error = control_error(c);
    line->allocations = count_allocations(tasks, 4);
    kt_bench_measure(tasks, 4, options->seconds, times);
    for (int i = 0; i < 4; i++) {
        line->measured[calls[i]] = true;
        line->times[calls[i]] = times[i];
    }
    return first_failure(&c->chain, error);
}

kt_status kt_scaling_control(int n, const kt_bench_options *options, kt_scaling_line *line, kt_error *error) {
    control c = {.inverse = NULL};
    kt_status status = kt_chain_make(n, options->isa, true, &c.chain, error);
    if (status == KT_OK)
        status = kt_mass_inverse_create(c.chain.model, 0, &c.inverse, error);
    if (status == KT_OK)
        status = measure_control(&c, options, line, error);
    kt_mass_inverse_free(c.inverse);
    kt_chain_free(&c.chain);
    return status;
}

/* ---- identification ---------------------------------------------------------------------------------------------- */

typedef struct regression {
    kt_chain chain;
    double *matrix, *parameters, *forces;
} regression;

static void run_regressor(void *user, long repetitions) {
    regression *r = user;
    kt_chain *c = &r->chain;
    for (long k = 0; k < repetitions && c->error.code == KT_OK; k++)
        if (kt_regressor_evaluate(c->model, c->data, c->q, c->v, c->a, r->matrix, &c->error) != KT_OK)
            return;
}

/* max |Y pi - tau| / max |h|, tau by RNEA from the accelerations that ABA gave. */
static double regressor_error(regression *r) {
    kt_chain *c = &r->chain;
    double *bias = r->forces + c->n;
    kt_chain_forward(c, 1);
    kt_chain_inverse(c, 1);
    run_regressor(r, 1);
    if (c->error.code != KT_OK ||
        kt_dynamics_inverse(c->model, c->data, c->q, c->v, NULL, NULL, bias, &c->error) != KT_OK)
        return (double)NAN;
    kt_regressor_parameters(c->model, r->parameters);
    memset(r->forces, 0, (size_t)c->n * sizeof *r->forces);
    for (int k = 0; k < kt_regressor_columns(c->model); k++)
        for (int i = 0; i < c->n; i++)
            r->forces[i] += r->matrix[(size_t)k * (size_t)c->n + (size_t)i] * r->parameters[k];
    return kt_chain_difference(r->forces, c->torque, bias, c->n);
}

kt_status kt_scaling_regressor(int n, const kt_bench_options *options, kt_scaling_line *line, kt_error *error) {
    regression r = {.matrix = NULL};
    kt_status status = kt_chain_make(n, options->isa, false, &r.chain, error);
    if (status != KT_OK)
        return status;
    const size_t columns = (size_t)kt_regressor_columns(r.chain.model), nv = (size_t)n;
    r.matrix = malloc((columns * nv + columns + 2 * nv) * sizeof *r.matrix);
    if (r.matrix) {
        const kt_bench_task tasks[] = {{kt_chain_inverse, &r.chain}, {run_regressor, &r}};
        kt_bench_times times[2];
        r.parameters = r.matrix + columns * nv;
        r.forces = r.parameters + columns;
        *line = (kt_scaling_line){.integrator = 0};
        describe(&r.chain, line);
        line->error = regressor_error(&r);
        line->allocations = count_allocations(tasks, 2);
        kt_bench_measure(tasks, 2, options->seconds, times);
        line->measured[KT_SCALING_RNEA] = line->measured[KT_SCALING_REGRESSOR] = true;
        line->times[KT_SCALING_RNEA] = times[0];
        line->times[KT_SCALING_REGRESSOR] = times[1];
        status = first_failure(&r.chain, error);
    } else {
        status = kt_error_set(error, KT_ERROR_MEMORY, "", "no memory for the regressor");
    }
    free(r.matrix);
    kt_chain_free(&r.chain);
    return status;
}

/* ---- instruction sets -------------------------------------------------------------------------------------------- */

/* One chain for each level that this processor and this build have. */
static kt_status make_chains(int n, kt_chain chains[KT_SCALING_ISAS], int *count, kt_error *error) {
    static const kt_isa levels[KT_SCALING_ISAS] = {KT_ISA_BASE, KT_ISA_V3, KT_ISA_V4};
    *count = 0;
    for (int i = 0; i < KT_SCALING_ISAS; i++) {
        const kt_status status = kt_chain_make(n, levels[i], false, &chains[*count], error);
        if (status == KT_OK)
            ++*count;
        else if (status != KT_ERROR_UNSUPPORTED)
            return status;
    }
    return KT_OK;
}

static kt_status time_chains(kt_chain *chains, int count, double seconds, kt_scaling_line *lines, kt_error *error) {
    enum { MOST = 2 * KT_SCALING_ISAS };
    kt_bench_task tasks[MOST];
    kt_bench_times *times = malloc(MOST * sizeof *times);
    if (!times)
        return kt_error_set(error, KT_ERROR_MEMORY, "", "no memory for the figures");
    for (int i = 0; i < count; i++) {
        tasks[2 * i] = (kt_bench_task){kt_chain_forward, &chains[i]};
        tasks[2 * i + 1] = (kt_bench_task){kt_chain_inverse, &chains[i]};
    }
    kt_bench_measure(tasks, 2 * count, seconds, times);
    kt_status status = KT_OK;
    for (int i = 0; i < count && status == KT_OK; i++) {
        lines[i] = (kt_scaling_line){.allocations = count_allocations(&tasks[2 * i], 2)};
        describe(&chains[i], &lines[i]);
        lines[i].measured[KT_SCALING_ABA] = lines[i].measured[KT_SCALING_RNEA] = true;
        lines[i].times[KT_SCALING_ABA] = times[2 * i];
        lines[i].times[KT_SCALING_RNEA] = times[2 * i + 1];
        lines[i].error = round_trip_error(&chains[i]);
        status = first_failure(&chains[i], error);
    }
    free(times);
    return status;
}

kt_status kt_scaling_compare_isas(int n, const kt_bench_options *options, kt_scaling_line lines[KT_SCALING_ISAS],
                                  int *count, kt_error *error) {
    kt_chain chains[KT_SCALING_ISAS];
    kt_status status = make_chains(n, chains, count, error);
    if (status == KT_OK)
        status = time_chains(chains, *count, options->seconds, lines, error);
    for (int i = 0; i < *count; i++)
        kt_chain_free(&chains[i]);
    return status;
}
