/* A hard case in MuJoCo (peers/mujoco_twin.h), with the case's step. */
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
                       strstr(reason, "mass and inertia")      ? "refused: needs mass"
                       : h->description.body_count > DEEP_MOST ? "refused: too deep" /* for its parser */
                                                               : "refused");
    return model;
}

/* ---- the same motion --------------------------------------------------------------------------------------------- */

static void read_bodies(kt_hard *h, const mjModel *m, mjData *d) {
    mj_kinematics(m, d);
    mj_comPos(m, d);
    mj_comVel(m, d);
    for (int i = 0; i < h->description.body_count; i++) {
        char name[24];
        mjtNum rate[6];
        (void)snprintf(name, sizeof name, "b%d", i);
        const int b = mj_name2id(m, mjOBJ_BODY, name);
        const mjtNum *p = d->xpos + 3 * b, *r = d->xquat + 4 * b;
        mj_objectVelocity(m, d, mjOBJ_XBODY, b, rate, 0);
        h->pose[i].position = kt_vec3_make(p[0], p[1], p[2]);
        h->pose[i].rotation = kt_matrix_from_quat(kt_quat_make(r[0], r[1], r[2], r[3]));
        h->twist[i] = (kt_twist){kt_vec3_make(rate[0], rate[1], rate[2]), kt_vec3_make(rate[3], rate[4], rate[5])};
    }
}

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
    read_bodies(h, m, d);
    bool good = kt_hard_peer_view(h, motion, watch, 0.0, words);
    long step = 0;
    for (long view = 0, n; good && (n = kt_hard_peer_steps(h, motion, view)) > 0; view++) {
        for (long k = 0; k < n; k++, step++)
            mj_step(m, d);
        read_bodies(h, m, d);
        good = !went_wrong(d);
        if (!good)
            (void)snprintf(words, KT_HARD_WORDS, "unstable at %.2g s", (double)step * motion->step);
        good = good && kt_hard_peer_view(h, motion, watch, (double)step * motion->step, words);
    }
    mj_deleteData(d);
    mj_deleteModel(m);
    return good;
}
