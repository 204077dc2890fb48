/* The Runge-Kutta-Chebyshev family of order 2: what depends on the number of stages alone (chebyshev.c). */
#ifndef KT_INTEGRATOR_CHEBYSHEV_H
#define KT_INTEGRATOR_CHEBYSHEV_H

#include "kinetree/integrator.h"

/* R(z) = a + b T_s(w0 + w1 z) */
typedef struct kt_chebyshev {
    int stages;
    double w0, w1, a, b;
} kt_chebyshev;

/* epsilon of a stabilised method's family, and how many times one step of it is repeated: rkc2 once; rkc4 extrapolates
 * from one, two and three of them. */
double kt_chebyshev_damping(const kt_method *method);
int kt_chebyshev_copies(const kt_method *method);

/* The member of s >= 2 stages. O(s). */
kt_chebyshev kt_chebyshev_make(int stages, double damping);

/* R decays on -reach <= z < 0. */
double kt_chebyshev_reach(const kt_chebyshev *family);

/* The fewest stages, 2 or more, whose reach is z >= 0; KT_STABILISED_STAGES_MAX + 1 where there are too few. */
int kt_chebyshev_stages(double z, double damping);

/* T_j, T_j', T_j'' at a point, of j and j - 1, and the step from j to j + 1. */
typedef struct kt_chebyshev_values {
    double t, dt, ddt;
    double t1, dt1, ddt1;
} kt_chebyshev_values;

static inline kt_chebyshev_values kt_chebyshev_first(double x) {
    kt_chebyshev_values values = {x, 1.0, 0.0, 1.0, 0.0, 0.0}; /* j = 1 */
    return values;
}

/* T_{j+1} = 2 x T_j - T_{j-1} and its derivatives. */
static inline void kt_chebyshev_next(kt_chebyshev_values *v, double x) {
    const double t = 2.0 * x * v->t - v->t1, dt = 2.0 * (v->t + x * v->dt) - v->dt1,
                 ddt = 2.0 * (2.0 * v->dt + x * v->ddt) - v->ddt1;
    v->t1 = v->t;
    v->dt1 = v->dt;
    v->ddt1 = v->ddt;
    v->t = t;
    v->dt = dt;
    v->ddt = ddt;
}

#endif
