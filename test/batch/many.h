/* States of one model computed one by one and as a batch: the same bits, and the same failures. */
#ifndef KT_TEST_BATCH_MANY_H
#define KT_TEST_BATCH_MANY_H

#include "kinetree/batch.h"

enum { KT_MANY_STATES = 13 }; /* whole groups and a part of one, whatever the width */

typedef struct kt_many {
    const kt_model *model;
    kt_batch *batch;
    size_t nq, nv;
    double *t, *q, *v, *tau, *a; /* state after state */
    void *work;                  /* of kt_step_evaluate */
    size_t work_size;
    const kt_method *method;
} kt_many;

/* With all states at the model's initial one, at t = 0.25 s times their number; false: it failed, and the test does. */
bool kt_many_make(kt_many *many, const kt_model *model, const kt_method *method);
void kt_many_free(kt_many *many);

/* How many states differ: in a bit of their results, in their status, or in what a failed state leaves. `steps`: as many
 * of h; 0: forward dynamics; inverse dynamics in addition, from the accelerations in many->a. */
int kt_many_compare_forward(kt_many *many, kt_data *data);
int kt_many_compare_inverse(kt_many *many, kt_data *data);
int kt_many_compare_steps(kt_many *many, kt_data *data, double h, int steps);

#endif
