/* A hard case in ODE (peers/ode_twin.h), with the case's step. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "../peers/ode_twin.h"
#include "peers.h"

const char *kt_hard_ode_version(void) { return "ODE " KT_ODE_VERSION; }

static bool run(kt_hard *h, const kt_hard_motion *motion, kt_ode_twin *t, kt_hard_watch *watch, char *words) {
    const kt_twin own = kt_hard_twin(h);
    bool good = kt_hard_peer_view(h, motion, watch, 0.0, words);
    long step = 0;
    for (long view = 0, n; good && (n = kt_hard_peer_steps(h, motion, view)) > 0; view++) {
        kt_ode_twin_step(t, motion->step, n);
        step += n;
        kt_ode_twin_read(t, &own);
        good = kt_hard_peer_view(h, motion, watch, (double)step * motion->step, words);
    }
    return good;
}

bool kt_hard_ode(kt_hard *h, const kt_hard_motion *motion, kt_hard_watch *watch, char *words) {
    if (!kt_hard_peer_begin(h, words))
        return false;
    const kt_twin own = kt_hard_twin(h);
    kt_ode_twin *t = kt_ode_twin_create(&own);
    if (t == NULL) {
        (void)snprintf(words, KT_HARD_WORDS, "rejected: needs mass");
        return false;
    }
    const bool good = run(h, motion, t, watch, words);
    kt_ode_twin_free(t);
    return good;
}
