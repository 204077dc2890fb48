/* A study of one small scene, to be changed before it is made. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ANALYSIS_BENCH_H
#define KT_TEST_ANALYSIS_BENCH_H

#include "check.h"
#include "describe.h"

#include "kinetree/study.h"

#include <string.h>

typedef struct bench {
    kt_body body;
    kt_marker marker;
    kt_loop loop;
    kt_description description;
    kt_run run;
    kt_accuracy_options options;
    const kt_method *methods[2];
    double step, tolerance;
    kt_error error;
    kt_accuracy *study;
} bench;

/* A pendulum let go at 1 rad for 1 s; rk4 at one step. */
static inline void make(bench *b) {
    memset(b, 0, sizeof *b);
    b->body = kt_body_of("bob", NULL, KT_JOINT_REVOLUTE, 1.0);
    b->body.joint.position[0] = 1.0;
    b->body.com = kt_vec3_make(0.0, -1.0, 0.0);
    b->description = kt_description_default();
    b->description.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    kt_describe(&b->description, &b->body, 1, NULL, 0, NULL, 0);
    b->run = kt_run_default();
    b->run.duration = 1.0;
    b->options = kt_accuracy_options_default();
    b->options.records = 20;
    b->methods[0] = kt_method_find("rk4");
    b->methods[1] = kt_method_find("dopri5");
    b->options.methods = b->methods;
    b->options.method_count = 1;
    b->step = 0.01;
    b->tolerance = 1e-6;
    b->options.steps = &b->step;
    b->options.step_count = 1;
    b->options.tolerances = &b->tolerance;
    b->options.tolerance_count = 1;
}

static inline void release_study(void *study) { kt_accuracy_free(study); }

/* The running test owns the study. */
static inline kt_status create(bench *b) {
    b->study = NULL;
    b->error = (kt_error){KT_OK, "", ""};
    const kt_status status = kt_accuracy_create(&b->description, &b->run, &b->options, &b->study, &b->error);
    kt_test_own(b->study, release_study);
    return status;
}

static inline void must_create(bench *b) { kt_need(kt_check_equal_int("study", create(b), KT_OK)); }

#endif
