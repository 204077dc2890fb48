/* Motion: a joint's position follows a function of time; phi = q - f(t), phi_t = -f', and -f'' in phi''. */
#include "loop/loop.h"

static kt_relation_row relate(const kt_loop_record *loop, const double *numbers, double sum, double t) {
    double f[3];
    kt_curve_evaluate(&loop->curve, numbers, t, f);
    return (kt_relation_row){.residual = sum - f[0], .rate = -f[1], .drift = -f[2]};
}

const kt_loop_kind KT_KERNEL(kt_loop_motion) = {.relate = relate};
