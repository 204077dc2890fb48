/* Projection of several states at once: the usual course of project.c, operation by operation. A state that has come to
 * its end stays as it is while others are moved on. One that needs more (next to a singular position, loops that rounding
 * keeps open, velocities that do not fit) is left to the projection of one state. */
#include "closure/lane_project.h"

#include "closure/project.h"

/* A position that does not move keeps its bits. */
static void move(const kt_model *model, kt_condition here, const kt_real1 *step, kt_real1 *q) {
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_real1 dq = step[model->link[i].v];
        kt_real1 *x = q + model->link[i].q;
        *x = kt_choose(here & (dq != 0.0), *x + dq, *x);
    }
}

/* Returns the states whose positions are closed. */
static kt_condition close_positions(const kt_model *model, kt_data *data, kt_condition live, kt_real1 *q,
                                    const kt_real1 *v, kt_violation *violation) {
    kt_condition sound = live, open = live;
    kt_real1 before = kt_real1_splat((double)INFINITY);
    for (int i = 0; i < KT_POSITION_STEPS_MAX; i++) {
        sound &= KT_KERNEL(kt_groups_residuals)(model, data, q, v, violation);
        open &= sound & ~(violation->gap <= KT_CLOSED);
        const kt_condition slow = violation->gap > 0.5 * before;
        const kt_condition rounding = kt_most1(before, violation->gap) <= 4e3 * KT_CLOSED;
        sound &= ~(open & slow & ~rounding);
        open &= ~slow;
        if (!kt_is_anywhere(open))
            return sound & (violation->gap <= KT_CLOSED_STEP);
        before = kt_choose(open, violation->gap, before);
        sound &= ~open | KT_KERNEL(kt_groups_prepare)(model, data, KT_ROWS_CLOSED);
        KT_KERNEL(kt_groups_aim)(model, data, KT_CLOSED);
        sound &= ~open | KT_KERNEL(kt_groups_step)(model, data, model->metric);
        move(model, open, data->delta, q);
    }
    return kt_condition_false();
}

/* Returns the states whose velocities fit. The violation of those that are not moved on is what it was. */
static kt_condition close_velocities(const kt_model *model, kt_data *data, kt_condition live, kt_real1 *v,
                                     kt_violation *violation) {
    const kt_condition open = live & ~(violation->slip <= KT_CLOSED * violation->speed);
    const kt_real1 given = violation->speed;
    kt_condition sound = live;
    kt_real1 before = kt_real1_splat((double)INFINITY);
    if (!kt_is_anywhere(open))
        return sound;
    sound &= ~open | KT_KERNEL(kt_groups_prepare)(model, data, KT_ROWS_ALL);
    for (int i = 0;; i++) {
        const kt_condition moves =
            open & sound & (violation->slip > 10.0 * KT_CLOSED * violation->speed) & (violation->slip < 0.5 * before);
        kt_violation now = *violation;
        if (!kt_is_anywhere(moves))
            return sound;
        if (i == KT_VELOCITY_STEPS)
            return sound & ~moves;
        before = kt_choose(moves, violation->slip, before);
        sound &= ~moves | KT_KERNEL(kt_groups_step)(model, data, KT_METRIC_MASS);
        for (size_t k = 0; k < model->n.v; k++)
            v[k] = kt_choose(moves, v[k] + data->delta[k], v[k]);
        KT_KERNEL(kt_groups_velocity_violation)(model, data, v, &now);
        violation->velocity = kt_choose(moves, now.velocity, violation->velocity);
        violation->slip = kt_choose(moves, now.slip, violation->slip);
        violation->speed = kt_choose(moves, kt_most1(now.speed, given), violation->speed);
    }
}

kt_condition KT_KERNEL(kt_project)(const kt_model *model, kt_data *data, kt_condition live, kt_real1 *q, kt_real1 *v) {
    kt_violation violation;
    kt_condition sound = close_positions(model, data, live, q, v, &violation);
    sound = close_velocities(model, data, sound, v, &violation);
    return sound & kt_is_finite1(violation.velocity) & (violation.slip <= KT_CLOSED_STEP * violation.speed);
}
