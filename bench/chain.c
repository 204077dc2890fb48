/* The chain of the benchmarks: described, compiled, evaluated. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "chain.h"

#include "bench.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const kt_vec3 kt_chain_gravity = {0.0, 0.0, -9.81};
const kt_body kt_chain_link = {
    .joint = {.type = KT_JOINT_REVOLUTE, .at = {0.1, 0.2, -0.3}},
    .mass = 1.0,
    .com = {0.02, -0.05, -0.15},
    .inertia = {.xx = 0.020, .yy = 0.030, .zz = 0.025, .xy = 0.001, .xz = -0.002, .yz = 0.0015},
};

kt_vec3 kt_chain_axis(int i) { return kt_vec3_make(i % 3 == 0, i % 3 == 1, i % 3 == 2); }

/* The parents of a tree of `count` links, depth first, whose first is `first`: it carries trees of equal sizes. */
static void branch(int first, int count, int arity, kt_chain_description *d) {
    int child = first + 1, left = count - 1;
    for (int k = arity; k > 0 && left > 0; k--) {
        const int size = (left + k - 1) / k;
        d->bodies[child].parent = d->names[first];
        branch(child, size, arity, d);
        child += size;
        left -= size;
    }
}

kt_status kt_chain_describe(int n, int arity, kt_chain_description *out, kt_error *error) {
    *out = (kt_chain_description){.bodies = calloc((size_t)n, sizeof *out->bodies),
                                  .names = calloc((size_t)n, sizeof *out->names)};
    if (!out->bodies || !out->names) {
        kt_chain_describe_free(out);
        return kt_error_set(error, KT_ERROR_MEMORY, "", "no memory for a chain of %d links", n);
    }
    for (int i = 0; i < n; i++) {
        kt_body *body = &out->bodies[i];
        (void)snprintf(out->names[i], sizeof out->names[i], "b%d", i);
        *body = kt_body_default();
        body->name = out->names[i];
        body->parent = i > 0 ? out->names[i - 1] : NULL;
        body->joint.type = kt_chain_link.joint.type;
        body->joint.at = kt_chain_link.joint.at;
        body->joint.axis = kt_chain_axis(i);
        body->mass = kt_chain_link.mass;
        body->com = kt_chain_link.com;
        body->inertia = kt_chain_link.inertia;
    }
    if (arity > 1)
        branch(0, n, arity, out);
    out->description = kt_description_default();
    out->description.gravity = kt_chain_gravity;
    out->description.bodies = out->bodies;
    out->description.body_count = n;
    return KT_OK;
}

void kt_chain_describe_free(kt_chain_description *d) {
    free(d->bodies);
    free(d->names);
    *d = (kt_chain_description){.bodies = NULL};
}

static kt_status compile(const kt_description *description, kt_isa isa, kt_chain *chain, kt_error *error) {
    kt_description tree = *description;
    kt_model_options options = kt_model_options_default();
    tree.loop_count = tree.effect_count = 0;
    options.isa = isa;
    const kt_status status = kt_model_compile(&tree, &options, &chain->model, error);
    return status == KT_OK ? kt_data_create(chain->model, &chain->data, error) : status;
}

static void set_state(kt_chain *chain) {
    kt_model_initial(chain->model, chain->q, chain->v);
    for (int i = 0; i < chain->n; i++) {
        if (chain->n == chain->nq)
            chain->q[i] = sin(i + 1.0);
        chain->v[i] = cos(2.0 * i + 1.0);
        chain->tau[i] = cos(3.0 * i);
    }
}

kt_status kt_chain_of(const kt_description *description, kt_isa isa, bool with_mass, kt_chain *chain, kt_error *error) {
    *chain = (kt_chain){.n = 0};
    const double start = kt_bench_clock();
    kt_status status = compile(description, isa, chain, error);
    if (status != KT_OK) {
        kt_chain_free(chain);
        return status;
    }
    chain->set_up = kt_bench_clock() - start;
    chain->n = kt_model_nv(chain->model);
    chain->nq = kt_model_nq(chain->model);
    double **const arrays[] = {&chain->q, &chain->v, &chain->tau, &chain->a, &chain->torque, &chain->x};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays && status == KT_OK; k++)
        if (!(*arrays[k] = calloc((size_t)chain->nq, sizeof **arrays[k])))
            status = KT_ERROR_MEMORY;
    if (status == KT_OK && with_mass &&
        !(chain->mass = calloc((size_t)chain->n * (size_t)chain->n, sizeof *chain->mass)))
        status = KT_ERROR_MEMORY;
    if (status == KT_OK && with_mass)
        status = kt_mass_factor_create(chain->model, &chain->factor, error);
    if (status == KT_OK) {
        set_state(chain);
        return KT_OK;
    }
    (void)kt_error_set(error, status, "", "no memory for the states of a tree of %d coordinates", chain->n);
    kt_chain_free(chain);
    return status;
}

kt_status kt_chain_branch(int n, int arity, kt_isa isa, bool with_mass, kt_chain *chain, kt_error *error) {
    kt_chain_description d;
    *chain = (kt_chain){.n = 0};
    const double start = kt_bench_clock();
    kt_status status = kt_chain_describe(n, arity, &d, error);
    if (status != KT_OK)
        return status;
    const double described = kt_bench_clock() - start;
    status = kt_chain_of(&d.description, isa, with_mass, chain, error);
    chain->set_up += described;
    kt_chain_describe_free(&d);
    return status;
}

kt_status kt_chain_make(int n, kt_isa isa, bool with_mass, kt_chain *chain, kt_error *error) {
    return kt_chain_branch(n, 1, isa, with_mass, chain, error);
}

void kt_chain_free(kt_chain *chain) {
    free(chain->q);
    free(chain->v);
    free(chain->tau);
    free(chain->a);
    free(chain->torque);
    free(chain->mass);
    free(chain->x);
    kt_mass_factor_free(chain->factor);
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

void kt_chain_factor(void *chain, long repetitions) {
    kt_chain *c = chain;
    for (long k = 0; k < repetitions && c->error.code == KT_OK; k++)
        if (kt_mass_factor_compute(c->factor, c->mass, &c->error) != KT_OK)
            return;
}

void kt_chain_solve(void *chain, long repetitions) {
    kt_chain *c = chain;
    for (long k = 0; k < repetitions && c->error.code == KT_OK; k++) {
        memcpy(c->x, c->tau, (size_t)c->n * sizeof *c->x);
        if (kt_mass_factor_solve(c->factor, 1, c->x, &c->error) != KT_OK)
            return;
    }
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
    c->work_size = kt_dynamics_work_size(c->model);
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
