/* A hard case in MuJoCo (peers/mujoco_twin.h), with the case's step. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mujoco.h"

#include "peers.h"

#include <stdio.h>
#include <string.h>

const char *kt_hard_mujoco_version(void) {
    static char text[40];
    (void)snprintf(text, sizeof text, "MuJoCo %s", mj_versionString());
    return text;
}

enum { DEEP_MOST = 90 };

static mjModel *load(kt_hard *h, double step, char *words) {
    char reason[KT_MUJOCO_REASON];
    size_t size = 0;
    const kt_twin own = kt_hard_twin(h);
    char *text = kt_mujoco_twin_write(&own, step, &size);
    mjModel *model = kt_mujoco_read(text, size, reason);
    if (!model)
        (void)snprintf(words, KT_HARD_WORDS, "%s",
                       strstr(reason, "mass and inertia")      ? "rejected: needs mass"
                       : h->description.body_count > DEEP_MOST ? "rejected: too deep" /* for its parser */
                                                               : "rejected");
    return model;
}

/* ---- the same motion --------------------------------------------------------------------------------------------- */

/* It resets itself to the start where numbers grow too large, with a warning: that is the end here. */
static bool went_wrong(const mjData *d) {
    return d->warning[mjWARN_BADQPOS].number + d->warning[mjWARN_BADQVEL].number + d->warning[mjWARN_BADQACC].number >
           0;
}

static void say_nothing(const char *words) { (void)words; }

bool kt_hard_mujoco(kt_hard *h, const kt_hard_motion *motion, kt_hard_watch *watch, char *words) {
    mju_user_warning = say_nothing;
    if (!kt_hard_peer_begin(h, words))
        return false;
    mjModel *m = load(h, motion->step, words);
    if (!m)
        return false;
    mjData *d = mj_makeData(m);
    kt_mujoco_twin_rates(h->model, kt_simulation_velocities(h->simulation), m, d);
    const kt_twin own = kt_hard_twin(h);
    kt_mujoco_twin_read(m, d, &own);
    bool good = kt_hard_peer_view(h, motion, watch, 0.0, words);
    long step = 0;
    for (long view = 0, n; good && (n = kt_hard_peer_steps(h, motion, view)) > 0; view++) {
        for (long k = 0; k < n; k++, step++)
            mj_step(m, d);
        kt_mujoco_twin_read(m, d, &own);
        good = !went_wrong(d);
        if (!good)
            (void)snprintf(words, KT_HARD_WORDS, "unstable at %.2g s", (double)step * motion->step);
        good = good && kt_hard_peer_view(h, motion, watch, (double)step * motion->step, words);
    }
    mj_deleteData(d);
    mj_deleteModel(m);
    return good;
}
