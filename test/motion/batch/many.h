/* States of one model computed one by one and as a batch: the same bits, and the same failures. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_BATCH_MANY_H
#define KT_TEST_BATCH_MANY_H

#include "kinetree/batch.h"
#include "random.h"

enum { KT_MANY_STATES = 13 }; /* whole groups and a part of one, for any width */
enum { KT_MANY_THREADS = 3 };

typedef struct kt_many {
    const kt_model *model;
    kt_batch *batch;
    size_t nq, nv, nx;           /* nx auxiliary states, of all states the initial ones */
    double *t, *q, *v, *tau, *a; /* state after state */
    void *work;                  /* of kt_step_evaluate */
    size_t work_size;
    const kt_method *method;
    const kt_model *own[KT_MANY_STATES]; /* the model, or copies of it with other parameters */
    void *copies[KT_MANY_STATES];
    size_t threads; /* by which steps are taken; 1 at first, up to KT_MANY_THREADS */
} kt_many;

/* With all states at the model's initial one, at t = 0.25 s times their number; false: it failed, and the test does. */
bool kt_many_make(kt_many *many, const kt_model *model, const kt_method *method);
void kt_many_free(kt_many *many);

/* Gives all states but some gravity and masses of their own. The states of the first group share a copy of the model,
 * and all others have a copy each. False: it failed, and the test does. */
bool kt_many_vary(kt_many *many, kt_random *random);

/* The number of states that differ, in one of three ways: in their results, in their status, or in the data after a
 * failed state. Results must agree to the bit. Inverse dynamics are those of the
 * accelerations in many->a; steps are so many of h, by the method or semi-implicit ones. */
int kt_many_compare_forward(kt_many *many, kt_data *data);
int kt_many_compare_inverse(kt_many *many, kt_data *data);
int kt_many_compare_sensors(kt_many *many, kt_data *data); /* of all bodies and markers */
int kt_many_compare_steps(kt_many *many, kt_data *data, double h, int steps);
int kt_many_compare_semi_implicit(kt_many *many, kt_data *data, double h, int steps);
int kt_many_compare_inputs(kt_many *many, kt_data *data, double h, int steps); /* of both, with a sequence of forces */

#endif
