/* Callers' own loops whose callbacks reject a state. */
#ifndef KT_CONSTRAINT_REFUSAL_H
#define KT_CONSTRAINT_REFUSAL_H

#include "model/model.h"

/* The first loop whose callback returns another number than 0, and that number; -1: none. Needs the links' poses and
 * velocities in space. */
#define KT_REFUSING_DECLARE(isa)                                                                                       \
    int kt_loop_refusing_##isa(const kt_model *model, const kt_data *data, double t, const double *v, int *code);
KT_REFUSING_DECLARE(baseline)
KT_REFUSING_DECLARE(v3)
KT_REFUSING_DECLARE(v4)
#undef KT_REFUSING_DECLARE

#endif
