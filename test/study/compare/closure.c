/* SPDX-License-Identifier: Apache-2.0 */
#include "closure.h"

static void release_set(void *set) { kt_constraint_formulation_free(set); }

kt_constraint_formulation *closure_set(const kt_model *model, const kt_constraint_formulation_options *options) {
    kt_error error = {0};
    kt_constraint_formulation *set = NULL;
    kt_need_fine(kt_constraint_formulation_name(options->type),
                 kt_constraint_formulation_create(model, options, &set, &error), &error);
    kt_test_own(set, release_set);
    return set;
}

void closure_at(const linkage *l, double t, const double *q, const double *v, double *phi, double *slip) {
    static double jacobian[6 * LINKAGE_LOOPS * LINKAGE_NQ], rate[6 * LINKAGE_LOOPS];
    kt_error error = {0};
    kt_need_fine("equations", kt_loop_equations(l->model, l->data, t, q, v, jacobian, phi, rate, NULL, &error), &error);
    for (int r = 0; r < l->rows; r++) {
        slip[r] = -rate[r];
        for (int i = 0; i < l->nv; i++)
            slip[r] += jacobian[i * l->rows + r] * v[i];
    }
}

static int slope(double t, const double *y, double *dydt, void *user) {
    const closure_run *r = user;
    const linkage *l = r->run.l;
    double rate[LINKAGE_NQ];
    if (kt_constraint_formulation_evaluate(r->set, l->data, t, y, y + l->nq, NULL, NULL, rate, dydt + l->nq, NULL) !=
        KT_OK)
        return 1;
    kt_position_rate(l->model, y, rate, dydt);
    return 0;
}

void closure_start(closure_run *r, linkage *l, kt_constraint_formulation *set, const char *method, double step,
                   double tolerance) {
    const kt_integrator_callbacks callbacks = {slope, NULL, r};
    *r = (closure_run){.run.l = l, .set = set};
    linkage_run_begin(&r->run, method, step, tolerance, 0.0, &callbacks);
}
