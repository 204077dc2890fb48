/* Code shared by the tests of the coordinate sets: sets that must be there, and runs with them on their own. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ANALYSIS_CLOSURE_H
#define KT_TEST_ANALYSIS_CLOSURE_H

#include "check.h"
#include "mechanics/constraint/linkage.h"

#include "kinetree/study.h"

/* Owned by the test, which a failure ends. */
kt_constraint_formulation *closure_set(const kt_model *model, const kt_constraint_formulation_options *options);

/* phi (k), A v - b' (k) at a state of the linkage; k = l->rows. */
void closure_at(const linkage *l, double t, const double *q, const double *v, double *phi, double *slip);

/* The linkage's motion by a set, without any projection. */
typedef struct closure_run {
    linkage_run run;
    kt_constraint_formulation *set;
} closure_run;

/* As linkage_run_start at t = 0. l->q and l->v need not be closed. */
void closure_start(closure_run *r, linkage *l, kt_constraint_formulation *set, const char *method, double step,
                   double tolerance);

#endif
