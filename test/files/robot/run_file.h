/* Mechanisms of files, run for the running test (see fixture.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ROBOT_RUN_FILE_H
#define KT_TEST_ROBOT_RUN_FILE_H

#include "fixture.h"

#include "kinetree/import.h"

#include <stdlib.h>

static inline void release_mechanism(void *mechanism) {
    kt_mechanism_free(mechanism);
    free(mechanism);
}

/* Begins a mechanism, and advances it to a time. */
static inline const kt_mechanism *run_file(const char *path, const kt_robot_options *options, const kt_run *run,
                                           double time) {
    kt_mechanism *m = calloc(1, sizeof *m);
    kt_error error = {0};
    kt_need(m != NULL || kt_check_true("there is memory", false));
    kt_test_own(m, release_mechanism);
    kt_need_fine(path, kt_mechanism_load(path, options, run, m, &error), &error);
    kt_need_fine("run", kt_simulation_advance(m->simulation, time, &error), &error);
    return m;
}

/* The positions of a body's joint at the end of a run. */
static inline const double *positions_of(const kt_mechanism *m, const char *body) {
    return kt_simulation_positions(m->simulation) + kt_body_coordinates(m->model, kt_body_find(m->model, body)).q;
}

#endif
