/* Declarations that motion.c and simulate.c share. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_FUZZ_MOTION_H
#define KT_TEST_FUZZ_MOTION_H

#include "fuzz.h"
#include "kinetree/simulation.h"

/* A few steps and records of a run from bytes. The run uses the absolute formulation if it exists and the bytes select
 * it. */
void kt_fuzz_simulate(kt_bytes *bytes, const kt_model *model, const kt_absolute *absolute);

bool kt_fuzz_all_finite(const double *x, int count);

/* Aligned memory, filled with numbers of no use. */
void *kt_fuzz_take(size_t size);

#endif
