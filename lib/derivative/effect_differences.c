/* Derivatives of the forces of a caller's own effects that have none, by central differences (difference.h). At a jump
 * or a kink no step is accurate enough. The remaining error is kept in the data (kt_data_difference_error). */
#include "derivative/difference.h"
#include "derivative/stiffness.h"

#include "dynamics/dynamics.h"
#include "kinetree/joint.h"

#include <float.h>
#include <math.h>
#include <string.h>

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
    for (size_t i = 0; KT_HAS_FORMULAS && model && i < model->n.x; i++)
        if (kt_law_is_differenced(&model->state[i]))
            return true;
    return model && has_differenced_forces(model);
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

/* A column: by q_j, or if `rate` by v_j. */
typedef struct column {
    const double *q, *v;
    size_t j;
    bool rate;
} column;

/* The forces k steps away, and the largest number that their rounding is relative to. */
static kt_status sample_forces(kt_linearized *w, const column *c, double moved, double *largest, kt_error *error) {
    const size_t n = w->n;
    memset(w->v, 0, n * sizeof *w->v);
    w->v[c->j] = c->rate ? 0.0 : moved;
    kt_position_add(w->model, c->q, w->v, w->q);
    memcpy(w->v, c->v, n * sizeof *w->v);
    w->v[c->j] += c->rate ? moved : 0.0;
    const kt_status status = kt_linearized_sum_effects(w, w->q, w->v, true, w->force, error);
    for (size_t i = 0; i < n && status == KT_OK; i++)
        *largest = fmax(*largest, fmax(fabs(w->force[i]), w->model->n.force_link ? fabs(w->weight[i]) : 0.0));
    return status;
}

/* Sets w->change = d8 with the step h, and *bound to its error relative to the largest of it; 0 if this is rounding. */
static kt_status difference_forces(kt_linearized *w, const column *c, double h, double *bound, kt_error *error) {
    const size_t n = w->n;
    double largest = 0.0, most = 0.0, apart = 0.0;
    memset(w->change, 0, n * sizeof *w->change);
    memset(w->coarse, 0, n * sizeof *w->coarse);
    for (int k = -4; k <= 4; k++) {
        if (k == 0)
            continue;
        const kt_status status = sample_forces(w, c, k * h, &largest, error);
        if (status != KT_OK)
            return status;
        double to_eight, to_six;
        kt_difference_weights(k, h, &to_eight, &to_six);
        for (size_t i = 0; i < n; i++) {
            w->change[i] += to_eight * w->force[i];
            w->coarse[i] += to_six * w->force[i];
        }
    }
    for (size_t i = 0; i < n; i++) {
        most = fmax(most, fabs(w->change[i]));
        apart = fmax(apart, fabs(w->change[i] - w->coarse[i]));
    }
    *bound = apart > KT_DIFFERENCE_ROUNDING * DBL_EPSILON * largest / h ? apart / most : 0.0;
    return KT_OK;
}

/* Subtracts the best differences from column j of D. */
static kt_status subtract_differences(kt_linearized *w, const column *c, double *d, kt_error *error) {
    double least = HUGE_VAL, bound = 0.0;
    for (int k = 0; k < KT_DIFFERENCE_STEPS && least > KT_DIFFERENCE_COARSE; k++) {
        const kt_status status = difference_forces(w, c, ldexp(KT_DIFFERENCE_STEP, -3 * k), &bound, error);
        if (status != KT_OK)
            return status;
        if (!(bound < least))
            continue;
        least = bound;
        memcpy(w->best, w->change, w->n * sizeof *w->best);
    }
    for (size_t i = 0; i < w->n; i++)
        d[c->j * w->n + i] -= w->best[i];
    w->data->difference_error = fmax(w->data->difference_error, least);
    return KT_OK;
}

kt_status kt_linearized_difference_effects(kt_linearized *w, const double *q, const double *v, kt_error *error) {
    kt_status status = KT_OK;
    if (!has_differenced_forces(w->model))
        return KT_OK;
    for (size_t j = 0; j < w->n && status == KT_OK; j++) {
        status = subtract_differences(w, &(column){q, v, j, false}, w->d_q, error);
        if (status == KT_OK)
            status = subtract_differences(w, &(column){q, v, j, true}, w->d_v, error);
    }
    return status;
}
