/* Derivatives of the forces of a caller's own effects that have none, by central differences (difference.h). At a jump
 * or a kink no step is accurate enough. The remaining error is kept in the data (kt_data_difference_error). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/difference.h"
#include "derivative/stiffness.h"

#include "dynamics/dynamics.h"
#include "kinetree/joint.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define COARSE 1e-6 /* relative to the largest of the differences: errors above it ask for a shorter step */

/* Whether forces are differenced in the coordinates; laws are in their variables (law_differences.c). */
static bool has_differenced_forces(const kt_model *model) {
    for (size_t i = 0; i < model->n.effect; i++)
        if (kt_effect_is_differenced(&model->effect[i]))
            return true;
    return false;
}

bool kt_model_is_differenced(const kt_model *model) {
    for (size_t i = 0; model && i < model->n.effect; i++)
        if (kt_law_is_differenced(&model->effect[i]))
            return true;
    for (size_t i = 0; model && i < model->n.x; i++)
        if (kt_law_is_differenced(&model->state[i]))
            return true;
    return model && (model->n.loaded > 0 || has_differenced_forces(model));
}

kt_status kt_linearized_sum_effects(kt_linearized *w, const double *q, const double *v, bool differenced, double *f,
                                    kt_error *error) {
    kt_dynamic_state at = {.t = w->t, .q = q, .v = v};
    memset(f, 0, w->n * sizeof *f);
    if (!w->model->n.effect)
        return KT_OK;
    kt_status status = differenced ? kt_effects_apply_differenced(w->model, w->data, &at, error)
                                   : kt_effects_apply(w->model, w->data, &at, error);
    for (size_t i = 0; i < w->n && at.tau; i++)
        f[i] += at.tau[i];
    for (int with = 1; with >= 0 && at.external && status == KT_OK; with--) { /* J' w = g - (g - J' w) */
        status = kt_dynamics_inverse(w->model, w->data, q, NULL, NULL, with ? at.external : NULL, w->weight, error);
        for (size_t i = 0; i < w->n && status == KT_OK; i++)
            f[i] -= with ? w->weight[i] : -w->weight[i];
    }
    return status;
}

/* ---- differences of one function --------------------------------------------------------------------------------- */

/* The differences with the step h; *bound: of the error of order eight. */
static int find_differences(const kt_differenced *of, double h, double *bound) {
    double largest = 0.0, most = 0.0, apart = 0.0;
    memset(of->eight, 0, of->n * sizeof *of->eight);
    memset(of->six, 0, of->n * sizeof *of->six);
    for (int k = -4; k <= 4; k += k == -1 ? 2 : 1) {
        double to_eight, to_six;
        const int code = of->sample(of->user, k * h, of->values, &largest);
        if (code != 0)
            return code;
        kt_difference_weights(k, h, &to_eight, &to_six);
        for (size_t i = 0; i < of->n; i++) {
            of->eight[i] += to_eight * of->values[i];
            of->six[i] += to_six * of->values[i];
        }
    }
    for (size_t i = 0; i < of->n; i++) {
        most = fmax(most, fabs(of->eight[i]));
        apart = fmax(apart, fabs(of->eight[i] - of->six[i]));
    }
    *bound = apart > KT_DIFFERENCE_ROUNDING * DBL_EPSILON * largest / h ? apart / most : 0.0;
    return 0;
}

int kt_difference_find(const kt_differenced *of, double step, double *best, double *error) {
    double least = HUGE_VAL, bound = 0.0;
    for (int k = 0; k < KT_DIFFERENCE_STEPS && least > COARSE; k++) {
        const int code = find_differences(of, ldexp(step, -3 * k), &bound);
        if (code != 0)
            return code;
        if (!(bound < least))
            continue;
        least = bound;
        memcpy(best, of->eight, of->n * sizeof *best);
    }
    *error = fmax(*error, least);
    return 0;
}

/* ---- of forces --------------------------------------------------------------------------------------------------- */

/* A column: by q_j, or if `rate` by v_j. */
typedef struct column {
    kt_linearized *w;
    const double *q, *v;
    size_t j;
    bool rate;
    kt_error *error;
} column;

/* The forces, and the largest number that their rounding is relative to. */
static int sample_forces(void *user, double moved, double *force, double *largest) {
    const column *c = user;
    kt_linearized *w = c->w;
    const size_t n = w->n;
    memset(w->v, 0, n * sizeof *w->v);
    w->v[c->j] = c->rate ? 0.0 : moved;
    kt_position_add(w->model, c->q, w->v, w->q);
    memcpy(w->v, c->v, n * sizeof *w->v);
    w->v[c->j] += c->rate ? moved : 0.0;
    const kt_status status = kt_linearized_sum_effects(w, w->q, w->v, true, force, c->error);
    for (size_t i = 0; i < n && status == KT_OK; i++)
        *largest = fmax(*largest, fmax(fabs(force[i]), w->model->n.force_link ? fabs(w->weight[i]) : 0.0));
    return (int)status;
}

/* Subtracts the best differences from column j of D. */
static kt_status subtract_differences(column c, double *d) {
    kt_linearized *w = c.w;
    const kt_differenced forces = {sample_forces, &c, w->n, w->force, w->change, w->coarse};
    const int status = kt_difference_find(&forces, KT_DIFFERENCE_STEP, w->best, &w->data->difference_error);
    for (size_t i = 0; i < w->n && status == KT_OK; i++)
        d[c.j * w->n + i] -= w->best[i];
    return (kt_status)status;
}

kt_status kt_linearized_difference_effects(kt_linearized *w, const double *q, const double *v, kt_error *error) {
    kt_status status = KT_OK;
    if (!has_differenced_forces(w->model))
        return KT_OK;
    for (size_t j = 0; j < w->n && status == KT_OK; j++) {
        status = subtract_differences((column){w, q, v, j, false, error}, w->d_q);
        if (status == KT_OK)
            status = subtract_differences((column){w, q, v, j, true, error}, w->d_v);
    }
    return status;
}
