/* Kinds `11, 12 and 15`: impossible states and impossible continuations are reported, with the loop, its gap and the
 * time. No records are lost.
 *
 * Out of reach: a distance loop holds the ends of two bars of 1 m at a distance of `1.4 m + 0.2 m/s t`. The bars are
 * straight at t = 3 s. Close to this time the rates grow as `(3 s - t)^-1/2`. A step of 1e-3 s fails only if the
 * stretch is a few steps ahead at most.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "../describe.h"
#include "hard.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The gap in the message of an error, "... 'LOOP' by X ..."; NaN if there is none. */
static double told_gap(const kt_error *error) {
    const char *at = strstr(error->message, "' by ");
    char *end = NULL;
    const double gap = at ? strtod(at + strlen("' by "), &end) : 0.0;
    return at && end != at + strlen("' by ") ? gap : (double)NAN;
}

/* ---- 11: assembly ------------------------------------------------------------------------------------------------ */

static const kt_hard_motion four_bar = {.scene = "four-bar", .integrator = "rk4", .duration = 1.0, .step = 1e-3};

/* The crank points away from the rocker's pivot, which is then 1.3 m from its tip. The coupler lies 30.8 degrees to one
 * side or to the other of the line between them. This follows from the cosine theorem with `0.9, 0.7 and 1.3 m`.
 * Coupler and rocker start off by up to 30 degrees, almost halfway to the other branch. Either branch is valid. A
 * rejection must report the gap. */
static void assemble_from(kt_hard *h, kt_data *data, double coupler, double rocker, int *branch) {
    const double pi = acos(-1.0), off = pi / 6.0;
    double q[3], v[3], held[2];
    kt_residual residual;
    kt_error error = {KT_OK, "", ""};
    kt_model_initial(h->model, q, v);
    q[0] = held[0] = pi;
    held[1] = v[0];
    q[1] = acos((0.81 + 1.69 - 0.49) / 2.34) - pi + coupler * off;
    q[2] = pi - acos((0.49 + 1.69 - 0.81) / 1.82) + rocker * off;
    if (kt_state_assemble(h->model, data, 0.0, q, v, &error) != KT_OK) {
        kt_hard_claim(h, 1, strstr(error.message, "'close'") && told_gap(&error) > 0.0,
                      "the open loop and its gap are told");
        kt_hard_say(h, "%s", error.message);
        return;
    }
    if (!kt_hard_fine(h, kt_loop_residual(h->model, data, 0.0, q, v, &residual, &error), &error))
        return;
    h->observed[0] = fmax(h->observed[0], fmax(residual.position, residual.velocity));
    kt_hard_claim(h, 1, q[0] == held[0] && v[0] == held[1], "the held crank stays");
    branch[sin(q[0] + q[1]) > 0.0]++;
}

static void run_assembly(kt_hard *h) {
    kt_data *data = NULL;
    kt_error error;
    int branch[2] = {0, 0};
    if (!kt_hard_open(h, &four_bar) || !kt_hard_compile(h, &four_bar) ||
        !kt_hard_fine(h, kt_data_create(h->model, &data, &error), &error))
        return;
    h->observed[0] = h->observed[1] = 0.0;
    for (int i = -2; i <= 2; i++)
        for (int j = -2; j <= 2; j++)
            assemble_from(h, data, 0.5 * i, 0.5 * j, branch);
    kt_hard_say(h, "of 25 starts %d close on the one branch, %d on the other", branch[1], branch[0]);
    kt_data_free(data);
}

/* Pivots 3 m apart, with bars of `0.3, 0.9 and 0.7 m`: the least gap is 1.1 m. */
static void run_far_pivots(kt_hard *h) {
    kt_data *data = NULL;
    kt_error error = {KT_OK, "", ""};
    double q[3], v[3], before[6];
    h->observed[1] = 0.0;
    if (!kt_hard_open(h, &four_bar))
        return;
    h->bodies[2].joint.at.x = 3.0;
    h->description.hold_count = 0;
    if (!kt_hard_compile(h, &four_bar) || !kt_hard_fine(h, kt_data_create(h->model, &data, &error), &error))
        return;
    kt_model_initial(h->model, q, v);
    memcpy(before, q, sizeof q);
    memcpy(before + 3, v, sizeof v);
    const kt_status status = kt_state_assemble(h->model, data, 0.0, q, v, &error);
    kt_hard_claim(h, 1, status == KT_ERROR_CONSTRAINT, "it is rejected");
    kt_hard_claim(h, 1, strstr(error.message, "'close'") != NULL || strstr(error.where, "'close'") != NULL,
                  "the loop is named");
    kt_hard_claim(h, 1, memcmp(q, before, sizeof q) == 0 && memcmp(v, before + 3, sizeof v) == 0, "the state stays");
    h->observed[0] = fabs(told_gap(&error) - 1.1);
    kt_hard_say(h, "%s", error.message);
    kt_data_free(data);
}

/* ---- 12: contradictions ------------------------------------------------------------------------------------------ */

static int count_record(const kt_record *record, void *user) {
    int *count = user;
    for (int i = 0; record->q && i < 2; i++)
        if (!isfinite(record->q[i]))
            return -1;
    ++*count;
    return 0;
}

/* One joint, two motions. */
static void run_contradiction(kt_hard *h) {
    kt_error error = {KT_OK, "", ""};
    static const kt_hard_motion motion = {.scene = "pendulum", .integrator = "rk4", .duration = 1.0, .step = 1e-3};
    h->observed[0] = 0.0;
    if (!kt_hard_open(h, &motion))
        return;
    kt_loop loops[2];
    for (int i = 0; i < 2; i++) {
        loops[i] = kt_loop_of(i ? "other" : "one", KT_LOOP_MOTION);
        loops[i].joint = h->bodies[0].name;
        loops[i].function = kt_function_constant(i);
    }
    h->description.loops = loops;
    h->description.loop_count = 2;
    if (kt_hard_compile(h, &motion)) {
        const kt_run run = kt_hard_settings(h, &motion);
        const kt_status status = kt_simulation_create(h->model, &run, NULL, &h->simulation, &error);
        kt_hard_claim(h, 0, status == KT_ERROR_CONSTRAINT, "it is rejected");
        kt_hard_claim(h, 0, strstr(error.message, "'one'") && strstr(error.message, "'other'"), "both loops are named");
        kt_hard_say(h, "%s", error.message);
    }
}

/* See the top. */
static void run_out_of_reach(kt_hard *h) {
    static const kt_hard_motion motion = {
        .scene = "double-pendulum", .integrator = "rk4", .duration = 10.0, .step = 1e-3, .interval = 0.01};
    static const double length[2] = {1.4, 0.2};
    kt_error error = {KT_OK, "", ""};
    int records = 0;
    h->observed[1] = 0.0;
    if (!kt_hard_open(h, &motion))
        return;
    for (int i = 0; i < 2; i++) { /* bars of 1 m, folded so that the ends are 1.4 m apart */
        h->bodies[i].joint.at = kt_vec3_make(0.0, i ? -1.0 : 0.0, 0.0);
        h->bodies[i].joint.position[0] = i ? 2.0 * acos(0.7) : 0.0;
        h->bodies[i].joint.velocity[0] = 0.0;
    }
    kt_loop loop = kt_loop_of("pull", KT_LOOP_DISTANCE);
    loop.between[1].body = h->bodies[1].name;
    loop.between[1].at = kt_vec3_make(0.0, -1.0, 0.0);
    loop.function = kt_function_polynomial(length, 2);
    h->description.loops = &loop;
    h->description.loop_count = 1;
    h->description.hold_count = 0;
    if (!kt_hard_start(h, &motion))
        return;
    const kt_status status = kt_simulation_run(h->simulation, count_record, &records, &error);
    const double t = kt_simulation_time(h->simulation);
    h->observed[0] = fabs(t - 3.0);
    kt_hard_claim(h, 1, status == KT_ERROR_CONSTRAINT, "the constraint is the error");
    kt_hard_claim(h, 1,
                  strstr(error.where, "t = ") && (strstr(error.message, "'pull'") || strstr(error.where, "'pull'")),
                  "time and loop are told");
    kt_hard_claim(h, 1, fabs(told_gap(&error) - length[1] * (t + motion.step - 3.0)) <= 1e-6,
                  "the gap is that of the next step, not of where a wild one has led");
    kt_hard_claim(h, 1, records == (int)floor(t / motion.interval + 1e-9) + 1, "all records until then are there");
    kt_hard_say(h, "%s: %s", error.where, error.message);
}

/* A mechanism of a wheel, a plane and a driven length. At 0.0160174 s it loses the direction along which it would have
 * to follow the length. Positions that close it still exist. Velocities grow like 1 / sqrt(t* - t). The report may be
 * later by the length of a step near that position. */
static void run_dead_point(kt_hard *h) {
    static const char *const names[] = {"qr", "partition", "svd"};
    h->observed[0] = h->observed[1] = 0.0;
    for (int r = KT_REDUCTION_QR; r <= KT_REDUCTION_SVD; r++) {
        const kt_hard_motion motion = {.scene = "dead-point",
                                       .integrator = "dop853",
                                       .duration = 0.02,
                                       .tolerance = 1e-12,
                                       .interval = 0.01,
                                       .reduction = (kt_reduction)r};
        kt_error error = {KT_OK, "", ""};
        int records = 0;
        if (!kt_hard_open(h, &motion) || !kt_hard_start(h, &motion))
            return;
        const kt_status status = kt_simulation_run(h->simulation, count_record, &records, &error);
        h->observed[0] = fmax(h->observed[0], fabs(kt_simulation_time(h->simulation) - 0.0160174061));
        kt_hard_claim(h, 1, status == KT_ERROR_CONSTRAINT, "the constraint is the error");
        kt_hard_claim(h, 1,
                      strstr(error.where, "t = ") && strstr(error.message, "dead point") && strstr(error.message, "'l"),
                      "time, dead point and loops are told");
        kt_hard_say(h, "%s: %s: %s", names[r], error.where, error.message);
        kt_hard_close(h);
    }
}

/* Fixed steps may end on both sides of that point: then the velocities after a step do not fit the loops at all. */
static void run_leap(kt_hard *h) {
    h->observed[0] = 0.0;
    for (int r = KT_REDUCTION_QR; r <= KT_REDUCTION_SVD; r++) {
        const kt_hard_motion motion = {.scene = "dead-point",
                                       .integrator = "rk4",
                                       .duration = 0.02,
                                       .step = 1e-4,
                                       .interval = 0.01,
                                       .reduction = (kt_reduction)r};
        kt_error error = {KT_OK, "", ""};
        if (!kt_hard_open(h, &motion) || !kt_hard_start(h, &motion))
            return;
        const kt_status before = kt_simulation_advance(h->simulation, 0.015, &error);
        const kt_velocity_correction small = kt_simulation_velocity_correction(h->simulation);
        const kt_status after = kt_simulation_advance(h->simulation, 0.02, &error); /* may meet it all the same */
        const kt_velocity_correction found = kt_simulation_velocity_correction(h->simulation);
        kt_hard_claim(h, 0, before == KT_OK && small.share < 0.01, "before the point the steps fit");
        kt_hard_claim(h, 0,
                      (after == KT_OK || after == KT_ERROR_CONSTRAINT) && found.share > 0.5 && found.time > 0.016 &&
                          found.body > 0,
                      "beyond it they do not");
        kt_hard_say(h, "%.2g, %.2g at %.4g s; ", small.share, found.share, found.time);
        kt_hard_close(h);
    }
}

/* ---- 15: torques that are no numbers ----------------------------------------------------------------------------- */

/* The value that the callback exerts from t = 0.5 s on for one instant. */
typedef struct burst {
    double value;
    bool off;
} burst;

static int drive(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    const burst *b = user;
    (void)q;
    (void)v;
    (void)balance;
    *force = t == 0.5 && !b->off ? b->value : 0.1;
    return 0;
}

static void keep_state(const kt_simulation *s, double *out) {
    out[0] = kt_simulation_time(s);
    memcpy(out + 1, kt_simulation_positions(s), 2 * sizeof *out);
    memcpy(out + 3, kt_simulation_velocities(s), 2 * sizeof *out);
}

/* To just before 0.5 s; the step over it must fail and leave everything; without the burst it goes on as if nothing had
 * been. */
static void burst_at_half(kt_hard *h, const kt_hard_motion *motion, double value, double *end) {
    burst b = {value, false};
    kt_error error = {KT_OK, "", ""};
    kt_effect effect = kt_effect_of(KT_EFFECT_CUSTOM, h->bodies[0].name);
    effect.name = "burst";
    effect.joint_force = drive;
    effect.user = &b;
    h->description.effects = &effect;
    h->description.effect_count = 1;
    b.off = value == 0.0;
    if (!kt_hard_start(h, motion))
        return;
    double before[5], after[5];
    kt_hard_claim(h, 0, kt_simulation_advance(h->simulation, 0.499, &error) == KT_OK, "it runs until then");
    keep_state(h->simulation, before);
    if (!b.off) {
        const kt_status status = kt_simulation_step(h->simulation, 0.5, &error);
        keep_state(h->simulation, after);
        kt_hard_claim(h, 0, status == KT_ERROR_NOT_FINITE, "it is caught at that step");
        kt_hard_claim(h, 0, strstr(error.where, "t = 0.5 s") && strstr(error.where, "burst"),
                      "time and effect are named");
        kt_hard_claim(h, 0, memcmp(before, after, sizeof before) == 0, "the state is intact, to the bit");
        if (!h->words[0])
            kt_hard_say(h, "%s: %s", error.where, error.message);
        b.off = true;
    }
    kt_hard_claim(h, 0, kt_simulation_advance(h->simulation, 1.0, &error) == KT_OK, "it goes on without");
    memcpy(end, kt_simulation_positions(h->simulation), 2 * sizeof *end);
    kt_simulation_free(h->simulation);
    kt_model_free(h->model);
    h->simulation = NULL;
    h->model = NULL;
}

static void run_burst(kt_hard *h) {
    static const kt_hard_motion motion = {
        .scene = "double-pendulum", .integrator = "rk4", .duration = 1.0, .step = 1e-3};
    const double values[] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
    double calm[2] = {0.0, 0.0}, end[2] = {0.0, 0.0};
    h->observed[0] = 0.0;
    if (!kt_hard_open(h, &motion))
        return;
    burst_at_half(h, &motion, 0.0, calm);
    for (int i = 0; i < 3; i++) {
        burst_at_half(h, &motion, values[i], end);
        kt_hard_claim(h, 0, memcmp(calm, end, sizeof end) == 0, "the end is that of a run without, to the bit");
    }
}

const kt_hard_case kt_hard_trouble[] = {{.number = 11,
                                         .name = "four-bar from 30 degrees off",
                                         .run = run_assembly,
                                         .why = "two branches close, and a start between them belongs to neither",
                                         .measures = {{"gap", "m, rad, per s", 3e-15}, {"claims", "", 0.0}}},
                                        {.number = 11,
                                         .name = "four-bar out of reach",
                                         .run = run_far_pivots,
                                         .why = "no branch closes: 1.1 m are missing",
                                         .measures = {{"gap told, off 1.1 m", "m", 5e-3}, {"claims", "", 0.0}}},
                                        {.number = 12,
                                         .name = "two motions of one joint",
                                         .run = run_contradiction,
                                         .why = "a redundant equation that disagrees is no redundancy",
                                         .measures = {{"claims", "", 0.0}}},
                                        {.number = 12,
                                         .name = "out of reach at 3 s",
                                         .run = run_out_of_reach,
                                         .why = "the rates go to infinity before the loop opens",
                                         .measures = {{"time of the error, off 3 s", "s", 5e-3}, {"claims", "", 0.0}}},
                                        {.number = 12,
                                         .name = "dead point of a driven length",
                                         .run = run_dead_point,
                                         .why = "positions close, but no velocity follows what drives them",
                                         .measures = {{"time of the error, off", "s", 1e-4}, {"claims", "", 0.0}}},
                                        {.number = 12,
                                         .name = "fixed steps over a dead point",
                                         .run = run_leap,
                                         .why = "a step can end beyond the point without having met it",
                                         .measures = {{"claims", "", 0.0}}},
                                        {.number = 15,
                                         .name = "NaN and infinite torque",
                                         .run = run_burst,
                                         .why = "one number that is none spreads through all of a state",
                                         .measures = {{"claims", "", 0.0}}},
                                        {.name = NULL}};
