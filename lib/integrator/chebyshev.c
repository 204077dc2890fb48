/* The Runge-Kutta-Chebyshev family of order 2, damped.
 *
 * Of all polynomials of degree s that agree with e^z to order 2, those built from T_s stay below 1 on nearly the
 * longest piece of the negative real axis, which grows as s^2:
 *
 *     R(z) = a_s + b_s T_s(w0 + w1 z),  w0 = 1 + epsilon / s^2,  w1 = T_s'(w0) / T_s''(w0),
 *     b_s = T_s''(w0) / T_s'(w0)^2,     a_s = 1 - b_s T_s(w0)
 *
 * R(0) = R'(0) = R''(0) = 1 follow at once. While -1 <= w0 + w1 z <= 1, that is, for z >= -(w0 + 1) / w1, R lies within
 * a_s +- b_s, and damping, epsilon = 2/13, keeps that below 1 - epsilon/3: about 0.95. The length is close to
 * 2/3 (s^2 - 1) (1 - 2/15 epsilon) = 0.653 (s^2 - 1).
 *
 * Order 4 by extrapolation: a step of the same member over h, two over h/2, three over h/3. Its local errors of order 2
 * and 3 cancel in T_1 / 12 - 4 T_2 / 3 + 9 T_3 / 4, as long as all have the same number of stages, for these errors
 * depend on it; and the terms stay bounded together if each is damped more: with epsilon = 6/5 the sum stays below 0.74
 * (computed for all numbers of stages), for a length of 0.58 s^2.
 *
 * Sources: J. G. Verwer, W. H. Hundsdorfer, B. P. Sommeijer, Numer. Math. 57 (1990) 157; B. P. Sommeijer, L. F.
 * Shampine, J. G. Verwer, J. Comput. Appl. Math. 88 (1998) 315. Extrapolation: HNW II.9.
 */
#include "integrator/chebyshev.h"

#include <math.h>

double kt_chebyshev_damping(const kt_method *method) { return method->order == 2 ? 2.0 / 13.0 : 6.0 / 5.0; }
int kt_chebyshev_copies(const kt_method *method) { return method->order == 2 ? 1 : 3; }

kt_chebyshev kt_chebyshev_make(int stages, double damping) {
    const double s = (double)stages;
    kt_chebyshev family = {.stages = stages, .w0 = 1.0 + damping / (s * s)};
    kt_chebyshev_values v = kt_chebyshev_first(family.w0);
    for (int j = 1; j < stages; j++)
        kt_chebyshev_next(&v, family.w0);
    family.w1 = v.dt / v.ddt;
    family.b = v.ddt / (v.dt * v.dt);
    family.a = 1.0 - family.b * v.t;
    return family;
}

double kt_chebyshev_reach(const kt_chebyshev *family) { return (family->w0 + 1.0) / family->w1; }

/* 0.667 (s^2 - 1) is more than the reach of any: the search begins at or below the answer. */
int kt_chebyshev_stages(double z, double damping) {
    const double most = (double)KT_STABILISED_STAGES_MAX;
    if (!(z < most * most))
        return KT_STABILISED_STAGES_MAX + 1;
    int stages = (int)sqrt(z / 0.667 + 1.0);
    for (stages = stages > 2 ? stages : 2; stages <= KT_STABILISED_STAGES_MAX; stages++) {
        const kt_chebyshev family = kt_chebyshev_make(stages, damping);
        if (kt_chebyshev_reach(&family) >= z)
            break;
    }
    return stages;
}
