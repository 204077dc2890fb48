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
 * Sources: J. G. Verwer, W. H. Hundsdorfer, B. P. Sommeijer, Numer. Math. 57 (1990) 157; B. P. Sommeijer, L. F.
 * Shampine, J. G. Verwer, J. Comput. Appl. Math. 88 (1998) 315.
 */
#include "integrator/chebyshev.h"

#include <math.h>

kt_chebyshev kt_chebyshev_make(int stages) {
    const double epsilon = 2.0 / 13.0, s = (double)stages;
    kt_chebyshev family = {.stages = stages, .w0 = 1.0 + epsilon / (s * s)};
    kt_chebyshev_values v = kt_chebyshev_first(family.w0);
    for (int j = 1; j < stages; j++)
        kt_chebyshev_next(&v, family.w0);
    family.w1 = v.dt / v.ddt;
    family.b = v.ddt / (v.dt * v.dt);
    family.a = 1.0 - family.b * v.t;
    return family;
}

double kt_chebyshev_reach(const kt_chebyshev *family) { return (family->w0 + 1.0) / family->w1; }

/* 0.667 (s^2 - 1) is a little more than the reach: the search begins at or below the answer. */
int kt_chebyshev_stages(double z) {
    const double most = (double)KT_STABILISED_STAGES_MAX;
    if (!(z < most * most))
        return KT_STABILISED_STAGES_MAX + 1;
    int stages = (int)sqrt(z / 0.667 + 1.0);
    for (stages = stages > 2 ? stages : 2; stages <= KT_STABILISED_STAGES_MAX; stages++) {
        const kt_chebyshev family = kt_chebyshev_make(stages);
        if (kt_chebyshev_reach(&family) >= z)
            break;
    }
    return stages;
}
