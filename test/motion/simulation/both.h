/* One description under the clock in both formulations, record for record. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SIMULATION_BOTH_H
#define KT_TEST_SIMULATION_BOTH_H

#include "formulation.h"
#include "scenes.h"

enum { KT_BOTH_RECORDS = 101, KT_BOTH_BODIES = 12, KT_BOTH_COORDINATES = 60 };

/* All contents of a record. */
typedef struct kt_both_trace {
    const kt_model *model;
    int count, nq, nv, bodies, loops;
    double q[KT_BOTH_RECORDS][KT_BOTH_COORDINATES], v[KT_BOTH_RECORDS][KT_BOTH_COORDINATES];
    double a[KT_BOTH_RECORDS][KT_BOTH_COORDINATES], energy[KT_BOTH_RECORDS][2];
    kt_wrench joint[KT_BOTH_RECORDS][KT_BOTH_BODIES], loop[KT_BOTH_RECORDS][KT_BOTH_BODIES];
    kt_vec3 point[KT_BOTH_RECORDS][KT_BOTH_BODIES]; /* of each body, as the record's data have it */
    kt_residual constraint;                         /* largest */
} kt_both_trace;

/* A kt_recorder into a trace whose model is set. */
int kt_both_keep(const kt_record *record, void *trace);

/* The model, and its absolute formulation. */
kt_model *kt_both_compile(const kt_description *description, const kt_model_options *options, kt_absolute **absolute);

/* Runs a simulation of a model with all records into t, in the absolute formulation unless that is NULL. False after a
 * failed check. */
bool kt_both_run(const kt_model *model, const kt_absolute *absolute, kt_run run, kt_both_trace *t);

/* Bounds of the differences between two traces, over all records. Each is relative to the largest number of its kind,
 * or to 1 if that is larger. With reaction = 0, reactions are not unique and not compared. */
typedef struct kt_both_bounds {
    double position, velocity, acceleration, energy, reaction;
} kt_both_bounds;

/* The worst of any number of pairs s and t; s gives the scale. */
typedef struct kt_both_worst {
    kt_worst position, velocity, acceleration, energy, reaction;
} kt_both_worst;

kt_both_worst kt_both_worst_make(void);
void kt_both_compare(kt_both_worst *worst, const char *name, const kt_both_trace *s, const kt_both_trace *t,
                     const kt_both_bounds *bounds);
void kt_both_check(const kt_both_worst *worst);

#endif
