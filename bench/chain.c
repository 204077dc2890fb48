/* The chain of the benchmarks: described, compiled, evaluated. */
#include "chain.h"

#include "bench.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NAME_SIZE = 16 };

const kt_vec3 kt_chain_gravity = {0.0, 0.0, -9.81};
const kt_body kt_chain_link = {
    .joint = {.type = KT_JOINT_REVOLUTE, .at = {0.1, 0.2, -0.3}},
    .mass = 1.0,
    .com = {0.02, -0.05, -0.15},
    .inertia = {.xx = 0.020, .yy = 0.030, .zz = 0.025, .xy = 0.001, .xz = -0.002, .yz = 0.0015},
};

kt_vec3 kt_chain_axis(int i) { return kt_vec3_make(i % 3 == 0, i % 3 == 1, i % 3 == 2); }

static void describe(int n, kt_body *bodies, char (*names)[NAME_SIZE]) {
    for (int i = 0; i < n; i++) {
        (void)snprintf(names[i], NAME_SIZE, "b%d", i);
        bodies[i] = kt_body_default();
        bodies[i].name = names[i];
        bodies[i].parent = i > 0 ? names[i - 1] : NULL;
        bodies[i].joint.type = kt_chain_link.joint.type;
        bodies[i].joint.at = kt_chain_link.joint.at;
        bodies[i].joint.axis = kt_chain_axis(i);
        bodies[i].mass = kt_chain_link.mass;
        bodies[i].com = kt_chain_link.com;
        bodies[i].inertia = kt_chain_link.inertia;
    }
}

static kt_status compile(int n, kt_isa level, kt_chain *chain, kt_error *error) {
    kt_body *bodies = calloc((size_t)n, sizeof *bodies);
    char(*names)[NAME_SIZE] = calloc((size_t)n, sizeof *names);
    kt_status status = KT_ERROR_MEMORY;
    if (bodies && names) {
        const double start = kt_bench_clock();
        describe(n, bodies, names);
        kt_description description = kt_description_default();
        description.gravity = kt_chain_gravity;
        description.bodies = bodies;
        description.body_count = n;
        kt_model_options options = kt_model_options_default();
        options.level = level;
        status = kt_model_compile(&description, &options, &chain->model, error);
        if (status == KT_OK)
            status = kt_data_create(chain->model, &chain->data, error);
        chain->set_up = kt_bench_clock() - start;
    } else {
        (void)kt_error_set(error, status, "", "no memory for a chain of %d links", n);
    }
    free(bodies);
    free(names);
    return status;
}

kt_status kt_chain_make(int n, kt_isa level, bool with_mass, kt_chain *chain, kt_error *error) {
    *chain = (kt_chain){.n = n};
    kt_status status = compile(n, level, chain, error);
    double **const arrays[] = {&chain->q, &chain->v, &chain->tau, &chain->a, &chain->torque};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays && status == KT_OK; k++)
        if (!(*arrays[k] = calloc((size_t)n, sizeof **arrays[k])))
            status = KT_ERROR_MEMORY;
    if (status == KT_OK && with_mass && !(chain->mass = calloc((size_t)n * (size_t)n, sizeof *chain->mass)))
        status = KT_ERROR_MEMORY;
    if (status != KT_OK) {
        if (chain->data)
            (void)kt_error_set(error, status, "", "no memory for the states of a chain of %d links", n);
        kt_chain_free(chain);
        return status;
    }
    for (int i = 0; i < n; i++) {
        chain->q[i] = sin(i + 1.0);
        chain->v[i] = cos(2.0 * i + 1.0);
        chain->tau[i] = cos(3.0 * i);
    }
    return KT_OK;
}

void kt_chain_free(kt_chain *chain) {
    free(chain->q);
    free(chain->v);
    free(chain->tau);
    free(chain->a);
    free(chain->torque);
    free(chain->mass);
    free(chain->work);
    free(chain->da_dq);
    free(chain->da_dv);
    kt_data_free(chain->data);
    kt_model_free(chain->model);
    *chain = (kt_chain){.n = 0};
}

void kt_chain_forward(void *chain, long repetitions) {
    kt_chain *c = chain;
    for (long k = 0; k < repetitions && c->error.code == KT_OK; k++)
        if (kt_dynamics_forward(c->model, c->data, c->q, c->v, c->tau, NULL, c->a, &c->error) != KT_OK)
            return;
}

void kt_chain_inverse(void *chain, long repetitions) {
    kt_chain *c = chain;
    for (long k = 0; k < repetitions && c->error.code == KT_OK; k++)
        if (kt_dynamics_inverse(c->model, c->data, c->q, c->v, c->a, NULL, c->torque, &c->error) != KT_OK)
            return;
}

void kt_chain_mass(void *chain, long repetitions) {
    kt_chain *c = chain;
    for (long k = 0; k < repetitions && c->error.code == KT_OK; k++)
        if (kt_dynamics_mass(c->model, c->data, c->q, c->mass, &c->error) != KT_OK)
            return;
}

double kt_chain_difference(const double *x, const double *y, const double *scale, int n) {
    double difference = 0.0, most = 0.0;
    for (int i = 0; i < n; i++) {
        if (!isfinite(x[i]) || !isfinite(y[i]) || !isfinite(scale[i]))
            return (double)NAN; /* fmax would pass it over */
        difference = fmax(difference, fabs(x[i] - y[i]));
        most = fmax(most, fabs(scale[i]));
    }
    return difference / most;
}

kt_status kt_chain_make_derivatives(kt_chain *c, kt_error *error) {
    const size_t numbers = (size_t)c->n * (size_t)c->n;
    c->work_size = kt_derivative_work_size(c->model);
    c->work = aligned_alloc(KT_ALIGNMENT, c->work_size);
    c->da_dq = malloc(numbers * sizeof *c->da_dq);
    c->da_dv = malloc(numbers * sizeof *c->da_dv);
    if (!c->work || !c->da_dq || !c->da_dv)
        return kt_error_set(error, KT_ERROR_MEMORY, "", "no memory for the derivatives of %d links", c->n);
    return KT_OK;
}

void kt_chain_derivatives(void *chain, long repetitions) {
    kt_chain *c = chain;
    for (long i = 0; i < repetitions; i++)
        if (kt_dynamics_forward_derivatives(c->model, c->data, c->work, c->work_size, c->q, c->v, c->tau, NULL,
                                            c->da_dq, c->da_dv, NULL, &c->error) != KT_OK)
            return;
}
