/* In place of an engine, or of cairo, that this system does not have. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw.h"
#include "events.h"
#include "peers.h"

#define NOT_HERE(engine)                                                                                               \
    bool engine(kt_events_watch *watch) {                                                                              \
        watch->words[0] = '-';                                                                                         \
        return false;                                                                                                  \
    }

#ifdef KT_WITHOUT_MUJOCO
bool kt_hard_mujoco(kt_hard *h, const kt_hard_motion *motion, kt_hard_watch *watch, char *words) {
    (void)h;
    (void)motion;
    (void)watch;
    (void)snprintf(words, KT_HARD_WORDS, "-");
    return false;
}
const char *kt_hard_mujoco_version(void) { return "MuJoCo (not here)"; }

NOT_HERE(kt_events_mujoco)
NOT_HERE(kt_events_clutch_mujoco)
NOT_HERE(kt_events_coin_mujoco)
NOT_HERE(kt_events_trebuchet_mujoco)
NOT_HERE(kt_events_whip_mujoco)
NOT_HERE(kt_events_woodpecker_mujoco)
#endif

#ifdef KT_WITHOUT_ODE
bool kt_hard_ode(kt_hard *h, const kt_hard_motion *motion, kt_hard_watch *watch, char *words) {
    (void)h;
    (void)motion;
    (void)watch;
    (void)snprintf(words, KT_HARD_WORDS, "-");
    return false;
}
const char *kt_hard_ode_version(void) { return "ODE (not here)"; }

NOT_HERE(kt_events_ode)
NOT_HERE(kt_events_clutch_ode)
NOT_HERE(kt_events_coin_ode)
NOT_HERE(kt_events_trebuchet_ode)
NOT_HERE(kt_events_whip_ode)
NOT_HERE(kt_events_woodpecker_ode)
#endif

#ifdef KT_WITHOUT_CAIRO
bool kt_hard_draw(const char *path, bool is_dark, const kt_hard_dots *dots, int count,
                  const char *const names[KT_HARD_ENGINES]) {
    (void)is_dark;
    (void)dots;
    (void)count;
    (void)names;
    (void)fprintf(stderr, "%s is not drawn: this build is without cairo\n", path);
    return false;
}
#endif
