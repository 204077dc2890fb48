/* Coupling: sum of coefficient * position = offset; gears, pulleys, mimic joints. */
#include "loop/loop.h"

static kt_relation_row relate(const kt_loop_record *loop, const double *numbers, double sum, double t) {
    double offset[3];
    kt_curve_evaluate(&loop->curve, numbers, t, offset);
    return (kt_relation_row){.residual = sum - offset[0]};
}

const kt_loop_kind KT_KERNEL(kt_loop_coupling) = {.relate = relate};
