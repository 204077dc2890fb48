/* Positions of several states at once: their rates (joint/position.c), units, and gradients by them (joint/turn.h). */
#include "batch/lanes.h"

#include "joint/turn.h"

void KT_KERNEL(kt_rates)(const kt_model *model, const double *q, const double *v, double *out) {
    const kt_real1 *qs = (const void *)q, *vs = (const void *)v;
    kt_real1 *rates = (void *)out;
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        for (int k = 0; k < motion.plain; k++)
            rates[link->q + k] = vs[link->v + k];
        if (!motion.quaternions)
            continue;
        const int at = link->q + motion.plain;
        const kt_turn p = kt_turn_times(kt_turn_load(qs + at), kt_real1_splat(0.5), vs + link->v + motion.plain);
        rates[at] = p.w;
        rates[at + 1] = p.x;
        rates[at + 2] = p.y;
        rates[at + 3] = p.z;
    }
}

kt_lane_mask KT_KERNEL(kt_units)(const kt_model *model, double *q) {
    return kt_mask_of(kt_turns_make_units(model, (void *)q, false));
}

void KT_KERNEL(kt_drop_transposed)(const kt_model *model, const double *q, const double *by_xi, double *by_q) {
    kt_turns_drop_transposed(model, (const void *)q, (const void *)by_xi, (void *)by_q);
}

void KT_KERNEL(kt_rate_transposed)(const kt_model *model, const double *q, const double *v, const double *by_rate,
                                   double *by_q, double *by_v) {
    kt_turns_rate_transposed(model, (const void *)q, (const void *)v, (const void *)by_rate, (void *)by_q,
                             (void *)by_v);
}

void KT_KERNEL(kt_lift_transposed)(const kt_model *model, const double *q, const double *by_q, double *by_xi) {
    kt_turns_lift_transposed(model, (const void *)q, (const void *)by_q, (void *)by_xi);
}
