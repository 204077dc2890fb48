/* The right-hand side's one hook: the acceleration of a state, whatever pushes and whatever is closed. */
#ifndef KT_SIMULATION_ACCELERATION_H
#define KT_SIMULATION_ACCELERATION_H

#include "kinetree/dynamics.h"

#include <stdint.h>

typedef struct kt_acceleration {
    const kt_model *model;
    kt_data *data;             /* scratch */
    const double *torque;      /* nv, or NULL */
    const kt_wrench *wrenches; /* one a body, or NULL */
    uint64_t factorizations;   /* of loop matrices, so far */
} kt_acceleration;

/* a (nv) at time t. On failure a is untouched. */
KT_CHECKED kt_status kt_simulation_accelerate(kt_acceleration *acceleration, double t, const double *q, const double *v,
                                              double *a, kt_error *error);

#endif
