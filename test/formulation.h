/* Models in one formulation or the other, for tests that run both. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_FORMULATION_H
#define KT_TEST_FORMULATION_H

#include "check.h"
#include "fixture.h"

#include "kinetree/study.h"

static inline void kt_release_absolute(void *absolute) { kt_absolute_free(absolute); }

/* The absolute formulation of a model of this description, which the running test owns. NULL if the formulation is
 * another one, or after a failed check. */
static inline kt_absolute *kt_formulate(const kt_description *description, const kt_model_options *options,
                                        const kt_model *model, kt_formulation formulation) {
    kt_absolute *absolute = NULL;
    kt_error error = {KT_OK, "", ""};
    if (model == NULL || formulation != KT_FORMULATION_ABSOLUTE)
        return NULL;
    if (!kt_check_equal_int("absolute formulation", kt_absolute_create(description, options, model, &absolute, &error),
                            KT_OK))
        kt_note("%s: %s", error.where, error.message);
    kt_test_own(absolute, kt_release_absolute);
    return absolute;
}

static inline void kt_release_absolute_motion(void *motion) { kt_absolute_motion_free(motion); }

/* A simulation in one formulation or the other, which the running test owns; its state in the coordinates of the tree.
 */
typedef struct kt_either {
    kt_simulation *simulation;
    kt_absolute_motion *motion; /* NULL: the tree's coordinates are integrated */
} kt_either;

/* The test fails and ends if there is no such simulation. absolute, options: may be NULL. */
static inline kt_either kt_either_begin(const kt_model *model, const kt_absolute *absolute, const kt_run *run,
                                        const kt_simulation_options *options) {
    kt_either e = {NULL, NULL};
    kt_error error = {KT_OK, "", ""};
    if (absolute == NULL) {
        e.simulation = kt_test_simulation(model, run, options);
        return e;
    }
    kt_need_fine("motion", kt_absolute_motion_create(absolute, run, options, &e.motion, &error), &error);
    kt_test_own(e.motion, kt_release_absolute_motion);
    e.simulation = kt_absolute_motion_simulation(e.motion);
    return e;
}

static inline kt_status kt_either_run(kt_either e, kt_recorder *record, void *user, kt_error *error) {
    return e.motion != NULL ? kt_absolute_motion_run(e.motion, record, user, error)
                            : kt_simulation_run(e.simulation, record, user, error);
}

static inline void kt_either_test_run(kt_either e, kt_recorder *record, void *user) {
    kt_error error = {KT_OK, "", ""};
    kt_need_fine("run", kt_either_run(e, record, user, &error), &error);
}

static inline kt_status kt_either_set_state(kt_either e, double t, const double *q, const double *v, kt_error *error) {
    return e.motion != NULL ? kt_absolute_motion_set_state(e.motion, t, q, v, error)
                            : kt_simulation_set_state(e.simulation, t, q, v, error);
}

/* Goes on to a time, step by step, so that whole turns count. */
static inline void kt_either_advance(kt_either e, double time) {
    kt_error error = {KT_OK, "", ""};
    while (kt_simulation_time(e.simulation) < time) {
        kt_need_fine("step", kt_simulation_step(e.simulation, time, &error), &error);
        (void)kt_absolute_motion_positions(e.motion);
    }
}

static inline kt_status kt_either_acceleration(kt_either e, double *a, kt_error *error) {
    return e.motion != NULL ? kt_absolute_motion_acceleration(e.motion, a, error)
                            : kt_simulation_acceleration(e.simulation, a, error);
}

static inline const double *kt_either_positions(kt_either e) {
    return e.motion != NULL ? kt_absolute_motion_positions(e.motion) : kt_simulation_positions(e.simulation);
}

static inline const double *kt_either_velocities(kt_either e) {
    return e.motion != NULL ? kt_absolute_motion_velocities(e.motion) : kt_simulation_velocities(e.simulation);
}

#endif
