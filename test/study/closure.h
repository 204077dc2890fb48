/* Code shared by the tests of the coordinate sets: sets that must be there, and runs with them on their own. */
#ifndef KT_TEST_ANALYSIS_CLOSURE_H
#define KT_TEST_ANALYSIS_CLOSURE_H

#include "../constraint/linkage.h"
#include "check.h"

#include "kinetree/study.h"

/* NULL after a failed check. */
kt_constraint_formulation *closure_set(const kt_model *model, const kt_constraint_formulation_options *options);

/* phi (k), A v - b' (k) and which equations have positions (k) at a state of the linkage; k = l->rows. */
bool closure_at(const linkage *l, double t, const double *q, const double *v, double *phi, double *slip);

/* The linkage's motion by a set, without any projection. */
typedef struct closure_run {
    linkage *l;
    kt_constraint_formulation *set;
    void *memory;
    kt_integrator *integrator;
} closure_run;

/* step > 0: fixed; else `tolerance`. Begins at l->q, l->v, which need not be closed. */
bool closure_start(closure_run *r, linkage *l, kt_constraint_formulation *set, const char *method, double step,
                   double tolerance);
/* On to this time; the state is then l's. */
bool closure_to(closure_run *r, double t);
void closure_stop(closure_run *r);

#endif
