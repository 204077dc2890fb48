/* Closing loops from far off: Levenberg-Marquardt (Marquardt 1963), group by group in one sweep,
 *   (A'A + mu 1) du = -A' phi,
 * mu lowered after a step that makes |phi| less and raised after one that does not. Unlike a step by QR it needs no
 * rank: off the manifold redundant equations look independent, and contradictory ones have no solution. Steps are held
 * to half a radian or half the mechanism's length.
 */
#include "reduction/far.h"

#include "reduction/group.h"

#include <float.h>
#include <string.h>

enum { FAR_MOST = 400 };

static double squares(const kt_model *model, const kt_data *data) {
    double sum = 0.0;
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group_work w = kt_group_place(model, data, g);
        sum += kt_dense_dot(w.residual, w.residual, w.k);
    }
    return sum;
}

/* du of one group into step; false where the damped matrix is not positive definite. */
static bool damped_step(const kt_model *model, const kt_data *data, size_t g, double mu, double *step) {
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_place(model, data, g);
    const size_t m = (size_t)w.m;
    double trace = 0.0;
    memset(w.reduced, 0, m * m * sizeof(double));
    memset(w.base, 0, m * sizeof(double));
    for (int r = 0; r < w.k; r++) {
        const double *row = w.a + (size_t)r * m;
        for (size_t c = 0; c < m; c++) {
            w.base[c] -= row[c] * w.residual[r];
            for (size_t i = c; i < m; i++)
                w.reduced[c * m + i] += row[c] * row[i];
        }
    }
    for (size_t i = 0; i < m; i++)
        trace += w.reduced[i * (m + 1)];
    for (size_t i = 0; i < m; i++)
        w.reduced[i * (m + 1)] += mu * trace + DBL_MIN;
    if (!kt_dense_cholesky(w.reduced, w.m))
        return false;
    kt_dense_solve(w.reduced, w.m, w.base);
    for (size_t i = 0; i < m; i++)
        step[model->group_v[group->v + (int)i]] = w.base[i];
    return true;
}

static void shorten(const kt_model *model, double *step) {
    const double most = 0.5 * fmax(1.0, model->length);
    double largest = 0.0;
    for (size_t i = 0; i < model->n.v; i++)
        largest = fmax(largest, fabs(step[i]));
    for (size_t i = 0; i < model->n.v && largest > most; i++)
        step[i] *= most / largest;
}

double kt_close_from_far(const kt_model *model, kt_data *data, double t, const bool *held, double *q) {
    const kt_reduction_kernels *kernels = kt_reduction_kernels_of(model);
    const double small = model->length * KT_CLOSED_TOLERANCE;
    kt_violation here, there;
    if (!kernels->factor(model, data, t, q, NULL, held, &here))
        return (double)INFINITY;
    double mu = 1e-3, sum = squares(model, data);
    for (int i = 0; i < FAR_MOST && here.position > small && mu < 1e12; i++) {
        memset(data->delta, 0, model->n.v * sizeof(double));
        bool solved = true;
        for (size_t g = 0; g < model->n.group; g++)
            solved &= damped_step(model, data, g, mu, data->delta);
        shorten(model, data->delta);
        kt_position_add(model, q, data->delta, data->moved_q);
        double beside = (double)INFINITY;
        if (solved && kernels->factor(model, data, t, data->moved_q, NULL, held, &there))
            beside = squares(model, data);
        if (beside < sum) {
            memcpy(q, data->moved_q, model->n.q * sizeof *q);
            here = there;
            mu = fmax(mu * 0.1, 1e-13);
            if (beside > 0.99999 * sum && mu <= 1e-12)
                break;
            sum = beside;
        } else {
            mu *= 10.0;
            if (!kernels->factor(model, data, t, q, NULL, held, &here)) /* the equations here again */
                return (double)INFINITY;
        }
    }
    return here.position;
}
