/* A woodpecker toy that jams, slides and pecks its way down a pole: its period, held to a time stepping of its own
 * equations. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "../../test/files/scene/woodpecker.h"

#include "events.h"

/* The period for all engines, by steps of 1e-5 s. */
static double stepped(const kt_events_problem *p, int body, double t) {
    static double period = 0.0;
    (void)p;
    (void)body;
    (void)t;
    if (period == 0.0)
        period = kt_woodpecker_period(1e-5);
    return period;
}

/* Once a period the bird passes the angle of the start ("section") while the sleeve slides. */
static int see(const kt_record *record, void *user) {
    if (record->index == KT_INDEX_EVENT && record->v[0] < -0.3)
        kt_pecks_see(user, record->t);
    return 0;
}

static bool run(kt_events_watch *watch) {
    kt_pecks pecks = {.count = 0};
    if (!kt_events_run_text(watch, kt_woodpecker_scene, see, &pecks))
        return false;
    kt_events_see(watch, 0, watch->problem->duration, kt_pecks_period(&pecks));
    return true;
}

const kt_events_problem kt_events_woodpecker = {
    .name = "woodpecker toy on its pole",
    .measured = "period, s",
    .bound = 6e-5, /* the time stepping has an error of 2.7e-5 s */
    .duration = 3.0,
    .step = 1e-4,
    .engine = {run, kt_events_woodpecker_mujoco, kt_events_woodpecker_ode},
    .exact = stepped,
};
