/* Code shared by the twins of a hard case in other engines: the start and the views. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "peers.h"

#include <math.h>

kt_twin kt_hard_twin(kt_hard *h) { return (kt_twin){&h->description, h->parent, h->pose, h->twist, NULL}; }

bool kt_hard_peer_begin(kt_hard *h, char *words) {
    kt_data *data = NULL;
    kt_error error;
    (void)snprintf(words, KT_HARD_WORDS, "-");
    if (!kt_twin_known(&h->description))
        return false;
    const bool done = kt_data_create(h->model, &data, &error) == KT_OK &&
                      kt_kinematics_update(h->model, data, kt_simulation_positions(h->simulation),
                                           kt_simulation_velocities(h->simulation), NULL, &error) == KT_OK;
    if (done)
        (void)kt_hard_look(h, data, 0.0);
    kt_data_free(data);
    return done;
}

long kt_hard_peer_steps(const kt_hard *h, const kt_hard_motion *motion, long view) {
    const double interval = fmax(motion->interval, motion->step);
    if ((double)(view + 1) * interval > kt_hard_duration(h, motion) * (1.0 + 1e-9))
        return 0;
    return lround(interval / motion->step);
}

bool kt_hard_peer_view(kt_hard *h, const kt_hard_motion *motion, kt_hard_watch *watch, double t, char *words) {
    const kt_hard_view view = {&h->description, h->parent, h->pose, h->twist, t};
    for (int i = 0; i < h->description.body_count; i++)
        if (!kt_vec3_is_finite(h->pose[i].position) || !kt_vec3_is_finite(h->twist[i].linear) ||
            kt_vec3_norm(h->twist[i].linear) > 1e12) {
            (void)snprintf(words, KT_HARD_WORDS, "nan at %.2g s", t);
            return false;
        }
    motion->watch(watch, &view);
    watch->count++;
    return true;
}
