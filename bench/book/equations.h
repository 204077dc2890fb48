/* The equations of a scene as a right-hand side that any solver may call: y = (q, v), y' = (q'(q, v), a(t, q, v)). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_BOOK_EQUATIONS_H
#define KT_BENCH_BOOK_EQUATIONS_H

#include "kinetree/kinetree.h"
#include "kinetree/scene.h"

#include <stdbool.h>

typedef struct equations {
    kt_scene scene;
    kt_model *model;
    kt_data *data;
    int nq, nv;
    size_t n;
    double *start;    /* y at t = 0, loops closed */
    long evaluations; /* of the right-hand side, since the caller cleared it; differences for Jacobians included */
    long limit;       /* after as many evaluations the right-hand side fails: the solver is too slow */
    kt_error error;
} equations;

/* options may be NULL. */
bool equations_open(equations *e, const char *path, const kt_scene_options *options, kt_isa isa);
void equations_close(equations *e);

/* dydt = f(t, y). Returns 0, or -1 if the mechanism has no acceleration there or the limit is reached. */
int equations_rate(equations *e, double t, const double *y, double *dydt);

/* Moves y back to the loops and normalises quaternions; 0 or -1. */
int equations_project(equations *e, double t, double *y, bool *changed);

/* A solver's run from the start to the end, which it writes to y. The text is NULL, or why it failed. */
typedef const char *solver_run(equations *e, const char *method, double tolerance, double end, double *y);

/* Receives the state at the end of an interval; false stops the run. */
typedef bool solver_output(void *user, int record, const double *y);

/* A run of SUNDIALS with `records` equal intervals, whose ends it interpolates. */
const char *sundials_records(equations *e, const char *method, double tolerance, double end, int records,
                             solver_output *output, void *user);

solver_run sundials_run;
extern const char *const sundials_methods[]; /* ends with NULL */
const char *sundials_version(void);

#endif
