/* Projection of several states at once: the usual course of project.c, operation by operation. A finished state does
 * not change while others continue. States near a singular position, with loops that rounding leaves open, or with
 * velocities that do not fit, need more than the usual course. The projection of one state completes such states. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/lane_project.h"

#include "assembly/project.h"
#include "joint/turn.h"

/* p <- p (+) d of quaternions (joint/position.c), lane by lane. */
static void rotate_lane_quaternions(kt_condition here, const kt_real1 *d, kt_real1 *p) {
    for (int lane = 0; lane < KT_LANES; lane++) {
        const kt_quat old = kt_quat_make(p[0][lane], p[1][lane], p[2][lane], p[3][lane]);
        const kt_vec3 by = kt_vec3_make(d[0][lane], d[1][lane], d[2][lane]);
        if (!here[lane])
            continue;
        const kt_quat moved = kt_quat_normalize(kt_quat_multiply(old, kt_quat_from_euler_vector(by)));
        p[0][lane] = moved.w;
        p[1][lane] = moved.x;
        p[2][lane] = moved.y;
        p[3][lane] = moved.z;
    }
}

/* Like kt_position_move: a link that does not move keeps its bits. */
static void move_lane_positions(const kt_model *model, kt_condition here, const kt_real1 *step, kt_real1 *q) {
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        const kt_real1 *dq = step + link->v;
        kt_condition moves = kt_condition_false();
        for (int k = 0; k < motion.velocities; k++)
            moves |= here & (dq[k] != 0.0);
        kt_real1 *x = q + link->q;
        for (int k = 0; k < motion.plain; k++)
            x[k] = kt_choose(moves, x[k] + dq[k], x[k]);
        if (motion.quaternions && kt_is_anywhere(moves))
            rotate_lane_quaternions(moves, dq + motion.plain, x + motion.plain);
    }
}

/* Newton steps on the positions, until each state's gap is within KT_CLOSED, or stops halving among rounding errors.
 * Returns the states whose positions are closed. `right` is then -(A v + phi_t) of the final positions. */
static kt_condition close_lane_positions(const kt_model *model, kt_data *data, kt_condition states,
                                         const kt_lanes_at *at, kt_real1 *q, kt_violation *violation) {
    kt_condition sound = states, open = states;
    kt_real1 before = kt_real1_splat((double)INFINITY);
    for (int i = 0; i < KT_POSITION_STEPS_MAX; i++) {
        sound &= KT_KERNEL(kt_groups_residuals)(model, data, at, violation);
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
        move_lane_positions(model, open, data->delta, q);
    }
    return kt_condition_false();
}

/* Moves velocities onto A v + phi_t = 0 while each step halves the slip. Requires `right` of these v, as
 * kt_groups_residuals stores it. Returns the states in which no step failed; kt_project then tests whether they fit.
 * The violation of a state that is not moved on is unchanged. */
static kt_condition close_lane_velocities(const kt_model *model, kt_data *data, kt_condition states, kt_real1 *v,
                                          kt_violation *violation) {
    const kt_condition open = states & ~(violation->slip <= KT_CLOSED * violation->speed);
    const kt_real1 given = violation->speed;
    kt_condition sound = states;
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

kt_condition KT_KERNEL(kt_project)(const kt_model *model, kt_data *data, kt_condition states, kt_real1 t, kt_real1 *q,
                                   kt_real1 *v) {
    const kt_lanes_at at = {.t = t, .q = q, .v = v};
    kt_violation violation;
    const kt_condition usual = model->n.q > model->n.v ? kt_turns_make_units(model, q, true) : kt_condition_true();
    kt_condition sound = close_lane_positions(model, data, states & usual, &at, q, &violation);
    sound = close_lane_velocities(model, data, sound, v, &violation);
    return sound & kt_is_finite1(violation.velocity) & (violation.slip <= KT_CLOSED_STEP * violation.speed);
}
