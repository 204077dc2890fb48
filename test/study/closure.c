#include "closure.h"

#include <stdlib.h>
#include <string.h>

kt_constraint_formulation *closure_set(const kt_model *model, const kt_constraint_formulation_options *options) {
    kt_error error = {0};
    kt_constraint_formulation *set = NULL;
    (void)kt_fine(kt_constraint_formulation_name(options->type),
                  kt_constraint_formulation_create(model, options, &set, &error), &error);
    return set;
}

bool closure_at(const linkage *l, double t, const double *q, const double *v, double *phi, double *slip) {
    static double jacobian[6 * LINKAGE_LOOPS * LINKAGE_NQ], rate[6 * LINKAGE_LOOPS];
    kt_error error = {0};
    kt_need_fine("equations", kt_loop_equations(l->model, l->data, t, q, v, jacobian, phi, rate, NULL, &error), &error);
    for (int r = 0; r < l->rows; r++) {
        slip[r] = -rate[r];
        for (int i = 0; i < l->nv; i++)
            slip[r] += jacobian[i * l->rows + r] * v[i];
    }
    return true;
}

static int slope(double t, const double *y, double *dydt, void *user) {
    const closure_run *r = user;
    double rate[LINKAGE_NQ];
    if (kt_constraint_formulation_evaluate(r->set, r->l->data, t, y, y + r->l->nq, NULL, NULL, rate, dydt + r->l->nq,
                                           NULL) != KT_OK)
        return 1;
    kt_position_rate(r->l->model, y, rate, dydt);
    return 0;
}

bool closure_start(closure_run *r, linkage *l, kt_constraint_formulation *set, const char *method, double step,
                   double tolerance) {
    const size_t n = (size_t)l->nq + (size_t)l->nv;
    const kt_method *m = kt_method_find(method);
    const size_t size = kt_integrator_size(m, n);
    kt_integrator_options options = kt_integrator_options_default();
    const kt_integrator_callbacks callbacks = {slope, NULL, r};
    double y[2 * LINKAGE_NQ];
    kt_error error = {0};
    options.step = step;
    options.relative_tolerance = options.absolute_tolerance = tolerance;
    r->l = l;
    r->set = set;
    r->memory = malloc(size);
    memcpy(y, l->q, (size_t)l->nq * sizeof *y);
    memcpy(y + l->nq, l->v, (size_t)l->nv * sizeof *y);
    return set != NULL &&
           kt_fine("integrator", kt_integrator_init(r->memory, size, m, n, &options, &r->integrator, &error), &error) &&
           kt_fine("start", kt_integrator_start(r->integrator, 0.0, y, &callbacks, &error), &error);
}

bool closure_to(closure_run *r, double t) {
    kt_error error = {0};
    while (kt_integrator_time(r->integrator) < t)
        kt_need_fine("step", kt_integrator_step(r->integrator, t, &error), &error);
    memcpy(r->l->q, kt_integrator_state(r->integrator), (size_t)r->l->nq * sizeof(double));
    memcpy(r->l->v, kt_integrator_state(r->integrator) + r->l->nq, (size_t)r->l->nv * sizeof(double));
    return true;
}

void closure_stop(closure_run *r) { free(r->memory); }
