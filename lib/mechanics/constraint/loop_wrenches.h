/* The wrenches of the loops (loop_wrenches.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONSTRAINT_LOOP_WRENCHES_H
#define KT_CONSTRAINT_LOOP_WRENCHES_H

#include "constraint/group.h"

/* Computes the wrenches of loops from the multipliers and the links' poses. Adds to bodies (one wrench for each body,
 * about its origin), and to idle, if not NULL, the parts that do no work (kt_loop_kind.load). Writes loops (one wrench
 * for each loop, on the second end about the first end's point). */
#define KT_REACT_DECLARE(isa)                                                                                          \
    void kt_react_##isa(const kt_model *model, const kt_data *data, double t, kt_wrench *bodies, kt_wrench *idle,      \
                        kt_wrench *loops);
KT_EACH_ISA(KT_REACT_DECLARE)
#undef KT_REACT_DECLARE

#endif
