/* Derivatives of the forces of a caller's own effects that give none, by central differences.
 *
 * With f_k = f(x + k h) the differences of order eight and six of the same samples are
 *     d8 = sum_k w_k (f_k - f_-k) / h,   w = 4/5, -1/5, 4/105, -1/280
 *     d6 = sum_k w_k (f_k - f_-k) / h,   w = 3/4, -3/20, 1/60, 0
 * The error of d8 is h^8 / 630 times the ninth derivative, and |d8 - d6|, the error of d6, is a bound of it wherever the
 * differences converge at all. Rounding adds some eps / h of the forces. Steps begin with h = STEP and become shorter as
 * long as the bound exceeds COARSE of the column: friction that changes its sign over 1e-3 rad/s needs h = 3e-5. What is
 * left of it where no step is good enough, as at a jump or a kink, is kept in the data (kt_data_difference_error).
 */
#include "derivative/stiffness.h"

#include "dynamics/dynamics.h"
#include "kinetree/joint.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define STEP 0.002    /* rad or m, and of their rates */
#define COARSE 1e-6   /* relative to the largest number of a column */
#define ROUNDING 64.0 /* eps of the largest force over h: what differences of constants may be */

enum { STEPS = 4 }; /* each an eighth of the one before */

bool kt_model_is_differenced(const kt_model *model) {
    for (size_t i = 0; model && i < model->n.effect; i++)
        if (kt_effect_is_differenced(&model->effect[i]))
            return true;
    return false;
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
static kt_status sample(kt_linearized *w, const column *c, double moved, double *largest, kt_error *error) {
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

/* w->change = d8 with the step h, and *bound = its error relative to the largest of it; 0 where this is rounding. */
static kt_status difference(kt_linearized *w, const column *c, double h, double *bound, kt_error *error) {
    static const double eight[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    static const double six[] = {3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0, 0.0};
    const size_t n = w->n;
    double largest = 0.0, most = 0.0, apart = 0.0;
    memset(w->change, 0, n * sizeof *w->change);
    memset(w->coarse, 0, n * sizeof *w->coarse);
    for (int k = -4; k <= 4; k++) {
        if (k == 0)
            continue;
        const kt_status status = sample(w, c, k * h, &largest, error);
        if (status != KT_OK)
            return status;
        const double to_eight = (k < 0 ? -eight[-k - 1] : eight[k - 1]) / h;
        const double to_six = (k < 0 ? -six[-k - 1] : six[k - 1]) / h;
        for (size_t i = 0; i < n; i++) {
            w->change[i] += to_eight * w->force[i];
            w->coarse[i] += to_six * w->force[i];
        }
    }
    for (size_t i = 0; i < n; i++) {
        most = fmax(most, fabs(w->change[i]));
        apart = fmax(apart, fabs(w->change[i] - w->coarse[i]));
    }
    *bound = apart > ROUNDING * DBL_EPSILON * largest / h ? apart / most : 0.0;
    return KT_OK;
}

/* Subtracts the best differences from column j of D. */
static kt_status subtract_differences(kt_linearized *w, const column *c, double *d, kt_error *error) {
    double least = HUGE_VAL, bound = 0.0;
    for (int k = 0; k < STEPS && least > COARSE; k++) {
        const kt_status status = difference(w, c, ldexp(STEP, -3 * k), &bound, error);
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
    if (!kt_model_is_differenced(w->model))
        return KT_OK;
    for (size_t j = 0; j < w->n && status == KT_OK; j++) {
        status = subtract_differences(w, &(column){q, v, j, false}, w->d_q, error);
        if (status == KT_OK)
            status = subtract_differences(w, &(column){q, v, j, true}, w->d_v, error);
    }
    return status;
}
