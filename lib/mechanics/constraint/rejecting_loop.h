/* Callers' own loops whose callbacks reject a state. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONSTRAINT_REJECTING_LOOP_H
#define KT_CONSTRAINT_REJECTING_LOOP_H

#include "base/isa.h"
#include "kinetree/loop.h"
#include "model/model.h"

/* The first loop whose callback returns another number than 0, and that number, or whose equations are not finite, and
 * 0; -1: none. Needs the links' poses and velocities in space. */
#define KT_REJECTING_DECLARE(isa)                                                                                      \
    int kt_loop_rejecting_##isa(const kt_model *model, const kt_data *data, double t, const double *v, int *code);
KT_EACH_ISA(KT_REJECTING_DECLARE)
#undef KT_REJECTING_DECLARE

#ifndef KT_LANES
/* A callback that stops (a negative number) ends the call, even if a second call of the callback would succeed. The
 * rates of the loop's equations carry the number (loop/loop_custom.h), and functions that evaluate loops store the
 * number in the data. Calls that may fail end with kt_stop_report, which erases the number. Without own loops of the
 * caller (kt_model.custom), nothing is stored, and the report returns `status`. */
void kt_stop_store_code(const kt_model *model, const kt_data *data, const kt_loop_record *loop, double rate);
kt_status kt_stop_report(const kt_model *model, const kt_data *data, double t, kt_status status, kt_error *error);

#endif

#endif
