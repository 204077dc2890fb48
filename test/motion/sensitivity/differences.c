/* SPDX-License-Identifier: Apache-2.0 */
#include "differences.h"

#include "mechanics/constraint/linkage.h"

#include "kinetree/joint.h"
#include "kinetree/model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const kt_method *explicit_method(int n) {
    for (int i = 0; i < kt_method_count(); i++)
        if (strcmp(kt_method_family_name(kt_method_at(i)), "explicit") == 0 && n-- == 0)
            return kt_method_at(i);
    return NULL;
}

const kt_method *implicit_method(int n) {
    static const char *const names[IMPLICIT_METHODS] = {"implicit-euler", "crank-nicolson", "radau5",
                                                        "rodas5p",        "bdf2",           "two-step"};
    return kt_method_find(names[n % IMPLICIT_METHODS]);
}

/* The differences of tau, N m or N: as many times farther, since B is as much smaller. */
#define INPUT_REACH 100.0

typedef struct work {
    const step_case *c;
    void *memory;
    size_t size;
    double *q, *v, *tau, *next_q, *next_v, *from_q, *from_v;
} work;

/* The change of the state after the step, where the start is changed by s along component j of (xi, dv, dtau). */
static bool step_from(work *w, int j, double s, double *change) {
    const step_case *c = w->c;
    const int nq = kt_model_nq(c->model), n = kt_model_nv(c->model);
    kt_step step = c->step;
    kt_error error;
    step.tau = w->tau;
    memset(w->v, 0, (size_t)n * sizeof *w->v);
    if (j < n)
        w->v[j] = s;
    kt_position_add(c->model, c->q, w->v, w->q);
    memcpy(w->v, c->v, (size_t)n * sizeof *w->v);
    if (j >= n && j < 2 * n)
        w->v[j - n] += s;
    for (int i = 0; i < n; i++)
        w->tau[i] = (c->step.tau ? c->step.tau[i] : 0.0) + (j == 2 * n + i ? s : 0.0);
    if (kt_step_evaluate(c->model, c->data, w->memory, w->size, &step, w->q, w->v, w->next_q, w->next_v, &error) !=
        KT_OK)
        return false;
    kt_position_subtract(c->model, w->next_q, w->from_q, change);
    for (int i = 0; i < n; i++)
        change[n + i] = w->next_v[i] - w->from_v[i];
    (void)nq;
    return true;
}

static bool difference(work *w, int j, double reach, double *column) {
    static const double weight[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    const int n = 2 * kt_model_nv(w->c->model);
    double *change = malloc((size_t)n * sizeof *change);
    bool fine = true;
    memset(column, 0, (size_t)n * sizeof *column);
    for (int k = -4; k <= 4 && fine; k++) {
        if (k == 0)
            continue;
        fine = step_from(w, j, k * reach, change);
        for (int i = 0; i < n && fine; i++)
            column[i] += (k < 0 ? -weight[-k - 1] : weight[k - 1]) / reach * change[i];
    }
    free(change);
    return fine;
}

static bool compare_columns(work *w, const double *A, const double *B, kt_worst *worst, const char *name) {
    const int n = kt_model_nv(w->c->model);
    double *coarse = malloc(4 * (size_t)n * sizeof *coarse), *fine = coarse + 2 * n;
    bool taken = true;
    for (int j = 0; j < 3 * n && taken; j++) {
        const double *column = j < 2 * n ? A + 2 * n * j : B + 2 * n * (j - 2 * n);
        const double reach = w->c->reach * (j < 2 * n ? 1.0 : INPUT_REACH), floor = j < 2 * n ? 1.0 : 1.0 / INPUT_REACH;
        const double size = fmax(floor, kt_tree_largest(column, 2 * n));
        taken = difference(w, j, reach, coarse) && difference(w, j, 0.5 * reach, fine);
        for (int i = 0; i < 2 * n && taken; i++) {
            const double doubt = fmin(fabs(coarse[i] - fine[i]) / 32.0, 9e-9 * size);
            kt_worst_near(worst, column[i], fine[i], doubt + 1e-9 * size, "%s row %d column %d of %d", name, i, j,
                          3 * n);
        }
    }
    free(coarse);
    return taken;
}

bool compare_step(const step_case *c, kt_worst *worst, const char *name) {
    const size_t nq = (size_t)kt_model_nq(c->model), n = (size_t)kt_model_nv(c->model);
    const size_t size = kt_step_work_size(c->model, c->step.method), aligned = (size + 63) / 64 * 64;
    double *numbers = calloc(3 * nq + 4 * n + 6 * n * n + 1, sizeof *numbers), *A = numbers + 3 * nq + 4 * n;
    work w = {.c = c, .memory = aligned_alloc(64, aligned), .size = size, .q = numbers};
    w.next_q = w.q + nq, w.from_q = w.next_q + nq, w.v = w.from_q + nq;
    w.next_v = w.v + n, w.from_v = w.next_v + n, w.tau = w.from_v + n;
    kt_error error = {0};
    bool taken = kt_step_derivatives(c->model, c->data, w.memory, size, &c->step, c->q, c->v, w.from_q, w.from_v, A,
                                     A + 4 * n * n, &error) == KT_OK;
    if (!taken)
        kt_note("%s: %s", name, error.message);
    taken = taken && compare_columns(&w, A, A + 4 * n * n, worst, name);
    free(w.memory);
    free(numbers);
    return taken;
}

/* ---- loops ------------------------------------------------------------------------------------------------------- */

typedef struct linkage_steps {
    const kt_method *(*method)(int n);
    kt_worst worst;
    int taken;
} linkage_steps;

static void compare_linkage(linkage *l, const char *name, double h, kt_structure structure, linkage_steps *all) {
    for (int metric = 0; metric < 2; metric++) {
        l->options = kt_model_options_default();
        l->options.structure = structure;
        l->options.metric = metric ? KT_METRIC_MASS : KT_METRIC_IDENTITY;
        linkage_build(l, 0.0);
        for (int m = 0; all->method(m) != NULL; m++) {
            const step_case c = {l->model, l->data, l->q, l->v, {.method = all->method(m), .h = h}, 0.004};
            all->taken += compare_step(&c, &all->worst, name);
        }
    }
}

void compare_linkages(const kt_method *(*method)(int n), int windows) {
    static linkage l;
    linkage_steps all = {method, kt_worst_make("A and B"), 0};
    four_bar f = four_bar_default();
    f.rate = 3.0;
    linkage_four_bar(&l, &f);
    compare_linkage(&l, "four-bar", 0.05, KT_STRUCTURE_AUTO, &all);
    linkage_windows(&l, 3, 0.4, 2.0, KT_LOOP_REVOLUTE);
    compare_linkage(&l, "windows", 0.05, KT_STRUCTURE_AUTO, &all);
    linkage_windows(&l, windows, 0.4, 2.0,
                    KT_LOOP_REVOLUTE); /* by fronts, and the projection's changes along the tree */
    compare_linkage(&l, "many windows", 0.02, KT_STRUCTURE_FRONTS, &all);
    linkage_bricard(&l);
    compare_linkage(&l, "Bricard", 0.02, KT_STRUCTURE_AUTO, &all);
    kt_check_worst(&all.worst);
    kt_check_above("steps", all.taken, 36.0);
}

tangle_plan closed_plan(int n, int period) {
    tangle_plan plan = n % period == period - 1 ? tangle_plan_planar() : tangle_plan_default();
    plan.tree.bodies = 7;
    plan.tree.massless = false;
    plan.loops = 1 + n % 2;
    plan.options.metric = n % 2 ? KT_METRIC_MASS : KT_METRIC_IDENTITY;
    return plan;
}

void compare_closed(const kt_method *(*method)(int n), int period, double least) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("A and B");
    int taken = 0;
    for (int n = 0; n < 24; n++) {
        static tangle g;
        tangle_plan plan = closed_plan(n, period);
        plan.options.structure = n % 4 < 2 ? KT_STRUCTURE_AUTO : KT_STRUCTURE_FRONTS;
        tangle_grow(&g, &plan, &random);
        const kt_step step = {.method = method(n), .t = g.t, .h = 1e-3, .tau = g.tau, .external = g.external};
        const step_case c = {g.tree.model, g.tree.data, g.q, g.v, step, 1e-3};
        taken += compare_step(&c, &worst, step.method->name);
    }
    kt_check_above("mechanisms", taken, least);
}
