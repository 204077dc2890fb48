/* The effects of several states at once, as evaluate/effects.c sums the effects of one state. Types that are not
 * compiled for lanes (KT_EFFECT_KIND_LIST of effect/effect.h) are evaluated lane by lane by the code for one state. The
 * variables of formulas are read in lanes (evaluate/variable.h). The formulas themselves are evaluated lane by lane. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "batch/lanes.h"

#include "base/copy.h"
#include "dynamics/dynamics.h"
#include "evaluate/effect_ends.h"
#include "evaluate/variable.h"

/* The state of a summation. */
typedef struct sum {
    const kt_model *model;
    kt_data *data;
    kt_real1 t;
    const kt_real1 *q, *v, *x;
    kt_real1 *tau;
    kt_external *applied;
    kt_lane_mask active;
    kt_real1 excess;    /* the sum of x - x over all forces: 0 if finite, otherwise NaN */
    kt_condition sound; /* lanes whose callbacks have returned 0 */
} sum;

/* NULL: lane by lane. */
static const kt_effect_kind *lane_kind_of(int type) {
    return type == KT_EFFECT_CUSTOM || type == KT_EFFECT_EXPRESSION ? NULL : KT_EFFECT(kt_effect_kinds)[type];
}

static bool is_active_lane(const sum *s, int lane) { return (s->active >> lane & 1U) != 0; }

static kt_vec3 lane_of(kt_triple a, int lane) { return kt_vec3_make(a.x[lane], a.y[lane], a.z[lane]); }

static kt_effect_end lane_end_of(const kt_effect_frame *end, int lane) {
    return (kt_effect_end){.axes = {lane_of(end->axes.x, lane), lane_of(end->axes.y, lane), lane_of(end->axes.z, lane)},
                           .point = lane_of(end->point, lane),
                           .omega = lane_of(end->omega, lane),
                           .velocity = lane_of(end->velocity, lane)};
}

static void set_lane(kt_triple *a, int lane, kt_vec3 from) {
    a->x[lane] = from.x;
    a->y[lane] = from.y;
    a->z[lane] = from.z;
}

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

/* The variables of an effect's formulas, grouped by lane. end: the ends of an effect between two ends. */
typedef struct variables {
    double of[KT_LANES][KT_FORMULA_VARIABLE_MAX];
} variables;

/* Returns whether the effect has formulas. */
static bool read_lane_variables(const sum *s, const kt_effect_record *effect, const kt_effect_frame *end,
                                variables *to) {
    if (effect->type != KT_EFFECT_EXPRESSION)
        return false;
    const kt_variable_source from = {.data = s->data, .q = s->q, .v = s->v, .x = s->x, .t = s->t};
    for (int32_t k = 0; k < effect->variable_count; k++) {
        const kt_real1 value = kt_variable_value(&from, &s->model->variable[effect->variable + k], end);
        for (int lane = 0; lane < KT_LANES; lane++)
            to->of[lane][k] = value[lane];
    }
    return true;
}

/* ---- one effect -------------------------------------------------------------------------------------------------- */

/* Evaluates an effect with the code for one state, for each active lane. A lane whose callback fails is not sound. */
static void wrench_lane_by_lane(sum *s, const kt_effect_record *effect, const kt_effect_frame *end,
                                kt_effect_wrench *wrench) {
    variables in;
    const bool formulas = read_lane_variables(s, effect, end, &in);
    memset(wrench, 0, 2 * sizeof *wrench);
    for (int lane = 0; lane < KT_LANES; lane++) {
        kt_effect_end one[2];
        kt_wrench found[2];
        if (!is_active_lane(s, lane))
            continue;
        for (int k = 0; k < effect->ends; k++)
            one[k] = lane_end_of(&end[k], lane);
        if (!kt_effect_alone_wrench(s->model, effect, formulas ? in.of[lane] : NULL, one, s->t[lane], found))
            s->sound[lane] = 0;
        for (int k = 0; k < effect->ends; k++) {
            set_lane(&wrench[k].moment, lane, found[k].moment);
            set_lane(&wrench[k].force, lane, found[k].force);
        }
    }
}

/* A force in a joint, or the rate of an auxiliary state, which is a formula. */
static kt_real1 force_lane_by_lane(sum *s, const kt_effect_record *effect, kt_real1 q, kt_real1 v) {
    kt_real1 force = kt_real1_splat(0.0);
    variables in;
    const bool formulas = read_lane_variables(s, effect, NULL, &in);
    for (int lane = 0; lane < KT_LANES; lane++) {
        double one = 0.0;
        if (is_active_lane(s, lane) &&
            !(formulas ? kt_effect_alone_force(s->model, effect, in.of[lane], 0.0, 0.0, 0.0, &one)
                       : kt_effect_alone_force(s->model, effect, NULL, q[lane], v[lane], s->t[lane], &one)))
            s->sound[lane] = 0;
        force[lane] = one;
    }
    return force;
}

/* Adds the forces of a batch of effects on joints to tau. `excess` becomes NaN in lanes whose force is not finite. */
static void apply_joint_forces(sum *s, const kt_effect_batch *batch) {
    const kt_effect_kind *kind = lane_kind_of(batch->type);
    for (int32_t i = batch->first; i < batch->first + batch->count; i++) {
        const kt_effect_record *effect = &s->model->effect[i];
        const kt_link *link = &s->model->link[effect->link[0]];
        const kt_real1 q = s->q[link->q], v = s->v[link->v];
        const kt_real1 force =
            kind ? kind->joint_force(effect, s->model->number, q, v, s->t, NULL) : force_lane_by_lane(s, effect, q, v);
        s->tau[link->v] += force;
        s->excess += force - force;
    }
}

/* Adds the wrenches of a batch of effects to the bodies at their ends. */
static void apply_wrenches(sum *s, const kt_effect_batch *batch) {
    const kt_effect_kind *kind = lane_kind_of(batch->type);
    for (int32_t i = batch->first; i < batch->first + batch->count; i++) {
        const kt_effect_record *effect = &s->model->effect[i];
        kt_effect_frame end[2];
        kt_effect_wrench wrench[2];
        kt_effect_ends_of(s->data, effect, end);
        if (kind)
            kind->wrench(effect, s->model->number, end, s->t, wrench, NULL);
        else
            wrench_lane_by_lane(s, effect, end, wrench);
        s->excess += kt_effect_wrenches_add(s->data, effect, wrench, s->applied);
    }
}

/* A summation without an error so far; the caller sets tau and applied if forces are written. */
static sum begin_sum(const kt_model *model, kt_data *data, const kt_lane_state *at) {
    return (sum){.model = model,
                 .data = data,
                 .t = *(const kt_real1 *)(const void *)at->t,
                 .q = (const void *)at->q,
                 .v = (const void *)at->v,
                 .x = (const void *)at->x,
                 .active = at->active,
                 .excess = kt_real1_splat(0.0),
                 .sound = kt_condition_true()};
}

kt_condition KT_KERNEL(kt_effects_sum)(const kt_model *model, kt_data *data, const kt_lane_state *at, kt_real1 *tau,
                                       kt_external *applied) {
    sum s = begin_sum(model, data, at);
    s.tau = tau;
    s.applied = applied;
    kt_copy(tau, at->tau, model->n.v * sizeof *tau);
    if (model->n.force_link > 0) {
        kt_clear(applied, model->n.body * sizeof *applied);
        KT_KERNEL(kt_force_links)(model, data, s.q, s.v);
    }
    for (size_t i = 0; i < model->n.batch; i++) {
        if (model->batch[i].ends > 0)
            apply_wrenches(&s, &model->batch[i]);
        else
            apply_joint_forces(&s, &model->batch[i]);
    }
    return s.sound & (s.excess == kt_real1_splat(0.0));
}

kt_condition KT_KERNEL(kt_own_rates)(const kt_model *model, kt_data *data, const kt_lane_state *at, kt_real1 *rates) {
    const kt_real1 zero = kt_real1_splat(0.0);
    sum s = begin_sum(model, data, at);
    for (size_t i = 0; i < model->n.x; i++) {
        rates[i] = force_lane_by_lane(&s, &model->state[i], zero, zero);
        s.excess += rates[i] - rates[i];
    }
    return s.sound & (s.excess == kt_real1_splat(0.0));
}
