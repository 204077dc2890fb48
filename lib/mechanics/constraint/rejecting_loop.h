/* Callers' own loops whose callbacks reject a state. */
#ifndef KT_CONSTRAINT_REJECTING_LOOP_H
#define KT_CONSTRAINT_REJECTING_LOOP_H

#include "base/isa.h"
#include "model/model.h"

/* The first loop whose callback returns another number than 0, and that number, or whose equations are not finite, and
 * 0; -1: none. Needs the links' poses and velocities in space. */
#define KT_REJECTING_DECLARE(isa)                                                                                      \
    int kt_loop_rejecting_##isa(const kt_model *model, const kt_data *data, double t, const double *v, int *code);
KT_EACH_ISA(KT_REJECTING_DECLARE)
#undef KT_REJECTING_DECLARE

#endif
