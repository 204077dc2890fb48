/* A and B of a step against central differences of order eight of the step itself. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SENSITIVITY_DIFFERENCES_H
#define KT_TEST_SENSITIVITY_DIFFERENCES_H

#include "check.h"
#include "mechanics/constraint/tangle.h"

#include "kinetree/sensitivity.h"

/* The explicit methods among the built-in ones: the n-th, or NULL. */
const kt_method *explicit_method(int n);

/* The implicit ones, whose steps have derivatives, in turn. */
enum { IMPLICIT_METHODS = 6 };
const kt_method *implicit_method(int n);

/* A mechanism at a state, and the step from there. */
typedef struct step_case {
    const kt_model *model;
    kt_data *data;
    const double *q, *v;
    kt_step step;
    double reach; /* of a difference: rad or m, and of their rates */
} step_case;

/* Compares all columns of A and B. The bound is 1e-9 of a column's largest number. This number is taken as at least 1
 * for A and 0.01 for B. The disagreement of differences over one reach and over half of it is added. Together they are
 * 1e-8 at most. Returns false if the step cannot be taken or has no derivatives there (a singular position). */
bool compare_step(const step_case *c, kt_worst *worst, const char *name);

/* Compares coarse steps of linkages by method(0), method(1), ... up to NULL: a four-bar, three windows, a row of
 * `windows` by fronts, and Bricard's mechanism, in both metrics of the projection. */
void compare_linkages(const kt_method *(*method)(int n), int windows);

/* The n-th random closed mechanism of a test. It has seven bodies, one or two loops, and either metric of the
 * projection. The last one of each `period` is planar. */
tangle_plan closed_plan(int n, int period);

/* Compares steps of 24 such mechanisms, half of them by fronts; at least `least` must have derivatives. */
void compare_closed(const kt_method *(*method)(int n), int period, double least);

#endif
