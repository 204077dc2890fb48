/* One try with a stabilised method.
 *
 * With R_j(z) = a_j + b_j T_j(w0 + w1 z) for stage j (chebyshev.c), the three-term recurrence of T_j gives one for the
 * stages. In d_j = Y_j - y0, which cancels less than Y_j:
 *
 *     d_0 = 0,  d_1 = b_1 w1 h f0
 *     d_j = mu_j d_{j-1} + nu_j d_{j-2} + h (mut_j f(t0 + c_{j-1} h, Y_{j-1}) + gat_j f0),   j = 2 .. s
 *     mu_j = 2 b_j w0 / b_{j-1},  nu_j = -b_j / b_{j-2},  mut_j = 2 b_j w1 / b_{j-1},  gat_j = -a_{j-1} mut_j
 *     b_j = T_j''(w0) / T_j'(w0)^2,  b_0 = b_1 = b_2,  a_j = 1 - b_j T_j(w0)
 *
 * and c_j, d_j of y' = 1 over h, follows from the same recurrence. y1 = y0 + d_s. Each stage has order 2.
 *
 * Source: B. P. Sommeijer, L. F. Shampine, J. G. Verwer, J. Comput. Appl. Math. 88 (1998) 315, (2.3) to (2.6).
 */
#include "integrator/chebyshev.h"
#include "integrator/integrator.h"

#include <float.h>
#include <math.h>

/* ---- the stages -------------------------------------------------------------------------------------------------- */

/* Where the recurrence stands. */
typedef struct recurrence {
    kt_chebyshev_values values; /* at w0, of stage j */
    double b, b1, b2;           /* b_j, b_{j-1}, b_{j-2} */
    double a1;                  /* a_{j-1} */
    double c, c1;               /* c_j, c_{j-1} */
    double mu, nu, mut, gat;
} recurrence;

static recurrence begin(const kt_chebyshev *family) {
    recurrence r = {.values = kt_chebyshev_first(family->w0)};
    r.b = r.b1 = r.b2 = 1.0 / (4.0 * family->w0 * family->w0); /* T_2 = 2 x^2 - 1 */
    r.mut = r.b * family->w1;
    r.c = r.mut;
    return r;
}

static void advance(recurrence *r, const kt_chebyshev *family) {
    r->a1 = 1.0 - r->b * r->values.t;
    r->b2 = r->b1;
    r->b1 = r->b;
    kt_chebyshev_next(&r->values, family->w0);
    r->b = r->values.ddt / (r->values.dt * r->values.dt);
    r->mu = 2.0 * r->b * family->w0 / r->b1;
    r->nu = -r->b / r->b2;
    r->mut = 2.0 * r->b * family->w1 / r->b1;
    r->gat = -r->a1 * r->mut;
    const double c = r->mu * r->c + r->nu * r->c1 + r->mut + r->gat;
    r->c1 = r->c;
    r->c = c;
}

/* d2 (which was d_{j-2}) becomes d_j, and trial y0 + d_j. */
static void form_stage(kt_integrator *it, const recurrence *r, double h, const double *y0, const double *f0,
                       const double *d1, double *d2) {
    const double *f = it->k[1];
    double *stage = it->trial;
    for (size_t i = 0; i < it->sizes.n; i++) {
        d2[i] = r->mu * d1[i] + r->nu * d2[i] + h * (r->mut * f[i] + r->gat * f0[i]);
        stage[i] = y0[i] + d2[i];
    }
}

/* One step of a member from z with the slope f there; z + d_s into trial. */
static kt_try_result member_step(kt_integrator *it, const kt_chebyshev *family, double t, double h, const double *z,
                                 const double *f, double **d_s, kt_try *result) {
    const size_t n = it->sizes.n;
    recurrence r = begin(family);
    double *d1 = it->moved, *d2 = it->moved + n;
    for (size_t i = 0; i < n; i++) {
        d2[i] = 0.0;
        d1[i] = h * r.mut * f[i];
        it->trial[i] = z[i] + d1[i];
    }
    for (int j = 2; j <= family->stages; j++) {
        if (kt_evaluate(it, t + r.c * h, it->trial, 1, result) != KT_TRY_PASSED)
            return result->result;
        advance(&r, family);
        form_stage(it, &r, h, z, f, d1, d2);
        double *d = d1;
        d1 = d2;
        d2 = d;
    }
    *d_s = d1;
    return KT_TRY_PASSED;
}

/* y0 + D_1 / 12 - 4 D_2 / 3 + 9 D_3 / 4 into trial, with D_m what m steps over h / m add; that less 9 D_3 / 5 - 4 D_2 /
 * 5 is the error estimate, kept in `krylov` until kt_stabilised_error. */
static kt_try_result extrapolate(kt_integrator *it, const kt_chebyshev *family, const kt_interval *in, kt_try *result) {
    static const double weight[] = {1.0 / 12.0, -4.0 / 3.0, 9.0 / 4.0}, e[] = {1.0 / 12.0, -8.0 / 15.0, 9.0 / 20.0};
    const size_t n = it->sizes.n;
    double *error = it->krylov, *sum = error + n, *moved = sum + n, *z = moved + n, *slope = z + n, *d = NULL;
    for (size_t i = 0; i < n; i++)
        error[i] = sum[i] = 0.0;
    for (int m = 1; m <= 3; m++) {
        const double h = in->h / (double)m;
        for (size_t i = 0; i < n; i++) {
            moved[i] = 0.0;
            slope[i] = it->k[0][i];
        }
        for (int j = 0; j < m; j++) {
            const double t = in->t + (double)j * h;
            for (size_t i = 0; i < n; i++)
                z[i] = in->y[i] + moved[i];
            if (j > 0) {
                if (kt_evaluate(it, t, z, 1, result) != KT_TRY_PASSED)
                    return result->result;
                for (size_t i = 0; i < n; i++)
                    slope[i] = it->k[1][i];
            }
            if (member_step(it, family, t, h, z, slope, &d, result) != KT_TRY_PASSED)
                return result->result;
            for (size_t i = 0; i < n; i++)
                moved[i] += d[i];
        }
        for (size_t i = 0; i < n; i++) {
            sum[i] += weight[m - 1] * moved[i];
            error[i] += e[m - 1] * moved[i];
        }
    }
    for (size_t i = 0; i < n; i++)
        it->trial[i] = in->y[i] + sum[i];
    return KT_TRY_PASSED;
}

kt_try_result kt_stabilised_stages(kt_integrator *it, const kt_interval *in, kt_try *result) {
    const double damping = kt_chebyshev_damping(it->method);
    const int stages = kt_chebyshev_stages(fabs(in->h) * it->radius, damping);
    if (stages > KT_STABILISED_STAGES_MAX) {
        result->t = in->t;
        result->radius = it->radius;
        result->reach = kt_stabilised_reach(it);
        return result->result = KT_TRY_UNSTABLE;
    }
    const kt_chebyshev family = kt_chebyshev_make(stages, damping);
    if (kt_chebyshev_copies(it->method) > 1)
        return extrapolate(it, &family, in, result);
    double *unused;
    if (member_step(it, &family, in->t, in->h, in->y, it->k[0], &unused, result) != KT_TRY_PASSED)
        return result->result;
    if (it->gives_end_derivative && kt_first_not_finite(it->trial, it->sizes.n) == it->sizes.n)
        return kt_evaluate(it, in->end, it->trial, it->fresh, result);
    return KT_TRY_PASSED;
}

/* rkc2: 4/5 (y0 - y1) + 2/5 h (f0 + f1) = h^3/15 y3 + O(h^4), y3 the third derivative */
double kt_stabilised_error(const kt_integrator *it, double h) {
    const bool extrapolated = kt_chebyshev_copies(it->method) > 1;
    const double *y0 = it->y, *y1 = it->trial, *f0 = it->k[0], *f1 = it->k[it->fresh];
    double sum = 0.0;
    for (size_t i = 0; i < it->counted; i++) {
        const double error = extrapolated ? it->krylov[i] : 0.8 * (y0[i] - y1[i]) + 0.4 * h * (f0[i] + f1[i]);
        const double u = error / kt_error_scale(it, i, y0[i], y1[i]);
        sum += u * u;
    }
    return sqrt(sum / (double)it->counted);
}

double kt_stabilised_reach(const kt_integrator *it) {
    if (!it->method->stabilised || !(it->radius > 0.0))
        return HUGE_VAL;
    const kt_chebyshev most = kt_chebyshev_make(KT_STABILISED_STAGES_MAX, kt_chebyshev_damping(it->method));
    return (1.0 - 1e-12) * kt_chebyshev_reach(&most) / it->radius; /* and not a rounding beyond */
}
