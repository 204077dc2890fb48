/* A and B of a simulation's motion through events: against a closed form, and central differences of the simulation. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/joint.h"
#include "kinetree/sensitivity.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "mechanics/dynamics/tree.h"

static const double g = 9.81;

/* A mechanism of at most so many coordinates, in the state in which its differences begin. */
enum { MOST = 8, CHANGES = 2 * MOST };
typedef struct motion {
    kt_model *model;
    kt_simulation *simulation;
    size_t nq, nv;
    uint64_t set;
    double q[MOST + 1], v[MOST], A[CHANGES * CHANGES], B[CHANGES * MOST];
} motion;

static void motion_make(motion *m, const kt_description *d, const char *method, double step) {
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    *m = (motion){.model = NULL};
    run.integrator = method;
    run.step = step;
    run.duration = 100.0;
    run.relative = run.absolute = 1e-13;
    options.events = 1;
    m->model = kt_test_model(d, NULL);
    m->simulation = kt_test_simulation(m->model, &run, &options);
    m->nq = (size_t)kt_model_nq(m->model);
    m->nv = (size_t)kt_model_nv(m->model);
    m->set = kt_switch_set(m->model);
    memcpy(m->q, kt_simulation_positions(m->simulation), m->nq * sizeof *m->q);
    memcpy(m->v, kt_simulation_velocities(m->simulation), m->nv * sizeof *m->v);
}

static kt_status derive(motion *m, double t_end, kt_error *error) {
    const size_t size = kt_motion_work_size(m->simulation);
    void *work = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    const kt_status status = kt_motion_derivatives(m->simulation, work, size, t_end, m->A, m->B, error);
    free(work);
    return status;
}

/* The state at t_end of a motion that begins off by s in coordinate j of (xi, dv, tau). */
static void run_beside(motion *m, double t_end, size_t j, double s, double *q, double *v) {
    double xi[CHANGES + MOST] = {0.0}, start_v[MOST];
    const double *tau = xi + 2 * m->nv;
    kt_error error = {0};
    xi[j] = s;
    kt_position_add(m->model, m->q, xi, q);
    for (size_t i = 0; i < m->nv; i++)
        start_v[i] = m->v[i] + xi[m->nv + i];
    kt_status status = kt_simulation_set_torque(m->simulation, tau, &error);
    if (status == KT_OK)
        status = kt_simulation_set_switches(m->simulation, m->set, NULL, &error);
    if (status == KT_OK)
        status = kt_simulation_set_state(m->simulation, 0.0, q, start_v, &error);
    if (status == KT_OK)
        status = kt_simulation_advance(m->simulation, t_end, &error);
    (void)kt_fine("neighbour", status, &error);
    memcpy(q, kt_simulation_positions(m->simulation), m->nq * sizeof *q);
    memcpy(v, kt_simulation_velocities(m->simulation), m->nv * sizeof *v);
}

/* Columns against differences of order four, to `bound` of the largest number of A. Positions that are quaternions are
 * compared through A. */
static void compare_columns(motion *m, const char *name, double t_end, double reach, double bound, unsigned columns) {
    static const double at[4] = {-2.0, -1.0, 1.0, 2.0}, weight[4] = {1.0 / 12, -8.0 / 12, 8.0 / 12, -1.0 / 12};
    kt_error error = {0};
    double largest = 1.0, worst = 0.0, end[MOST + 1];
    kt_need_fine(name, derive(m, t_end, &error), &error);
    memcpy(end, kt_simulation_positions(m->simulation), m->nq * sizeof *end);
    for (size_t i = 0; i < 4 * m->nv * m->nv; i++)
        largest = fmax(largest, fabs(m->A[i]));
    for (size_t j = 0; j < 3 * m->nv; j++) {
        if ((columns >> j & 1U) == 0)
            continue;
        const double *column = j < 2 * m->nv ? m->A + 2 * m->nv * j : m->B + 2 * m->nv * (j - 2 * m->nv);
        double dq[MOST + 1] = {0.0}, dv[MOST] = {0.0}, rate[MOST + 1];
        for (int k = 0; k < 4; k++) {
            double q[MOST + 1], v[MOST];
            run_beside(m, t_end, j, at[k] * reach, q, v);
            for (size_t i = 0; i < m->nq; i++)
                dq[i] += weight[k] / reach * (q[i] - end[i]);
            for (size_t i = 0; i < m->nv; i++)
                dv[i] += weight[k] / reach * v[i];
        }
        kt_position_rate(m->model, end, column, rate);
        for (size_t i = 0; i < m->nq; i++)
            worst = fmax(worst, fabs(dq[i] - rate[i]));
        for (size_t i = 0; i < m->nv; i++)
            worst = fmax(worst, fabs(dv[i] - column[m->nv + i]));
    }
    kt_note("%s: largest %.3g", name, largest);
    kt_check_below(name, worst / largest, bound);
}

static void compare(motion *m, const char *name, double t_end, double reach, double bound) {
    compare_columns(m, name, t_end, reach, bound, ~0U);
}

/* ---- closed form ------------------------------------------------------------------------------------------------- */

static void stop_make(kt_effect *stop, const char *joint, double lower, double restitution) {
    *stop = kt_effect_of(KT_EFFECT_JOINT_LIMIT, joint);
    stop->lower = lower;
    stop->restitution = restitution;
}

static void ball_make(kt_body *ball, kt_effect *floor, kt_description *d) {
    *ball = kt_body_default();
    *d = kt_description_default();
    ball->name = "ball";
    ball->joint.type = KT_JOINT_PRISMATIC;
    ball->joint.position[0] = 1.0;
    ball->joint.velocity[0] = 0.3;
    ball->mass = 2.0;
    stop_make(floor, "ball", 0.0, 0.6);
    d->gravity = kt_vec3_make(0.0, 0.0, -g);
    d->bodies = ball, d->body_count = 1;
    d->effects = floor, d->effect_count = 1;
}

/* The speed at the first impact is w = sqrt(v^2 + 2 g q). Bounce k is at
 *     t_k = (v + w (1 + 2 (e + ... + e^(k-1)))) / g
 * After it, with s = t - t_k,
 *     q = e^k w s - g s^2 / 2,  v = e^k w - g s
 * Differences of the effect of a bounce, over 1e-4, are good to some 1e-11. */
KT_TEST(derivatives_of_a_bouncing_ball_are_those_of_its_closed_form) {
    static const char *const methods[] = {"rk4", "dopri5", "radau5", "ab4", "auto"};
    double worst = 0.0;
    const double e = 0.6, v = 0.3, w = sqrt(v * v + 2.0 * g), by[2] = {g / w, v / w};
    for (int i = 0; i < 5; i++)
        for (int k = 0; k < 4; k++) {
            kt_body ball;
            kt_effect floor;
            kt_description d;
            kt_error error = {0};
            motion m;
            double sum = k > 0 ? 1.0 : 0.0;
            for (int j = 1; j < k; j++)
                sum += 2.0 * pow(e, j);
            const double at = k > 0 ? (v + w * sum) / g : 0.0, up = pow(e, k), s = k > 0 ? 0.7 * 2.0 * up * w / g : 0.2;
            ball_make(&ball, &floor, &d);
            motion_make(&m, &d, methods[i], i % 3 == 0 ? 0.01 : 0.0);
            kt_need_fine(methods[i], derive(&m, at + s, &error), &error);
            for (int j = 0; j < 2; j++) {
                const double later = k > 0 ? (j + sum * by[j]) / g : 0.0, rise = by[j] * up;
                const double q = k > 0 ? rise * s - (up * w - g * s) * later : j == 0 ? 1.0 : s;
                const double rate = k > 0 ? rise + g * later : j;
                kt_check_equal_int("bounces", (long long)kt_simulation_contacts(m.simulation).impacts, k);
                worst = fmax(worst, fabs(m.A[2 * j] - q));
                worst = fmax(worst, fabs(m.A[2 * j + 1] - rate));
            }
        }
    kt_check_below("A of up to three bounces", worst, 1e-9);
}

/* An auxiliary state is the integral of the height. Behind bounce 1 it is the sum of two parts, x = q s + ... The first
 * part goes up to the bounce, whose time has its own derivative. The second part goes on from there. */
KT_TEST(derivatives_of_an_auxiliary_state_pass_through_a_bounce) {
    const double e = 0.6, v = 0.3, w = sqrt(v * v + 2.0 * g), at = (v + w) / g, s = 0.5;
    const double by[2] = {g / w, v / w};
    kt_body ball;
    kt_effect floor;
    kt_description d;
    kt_auxiliary_state sum = kt_auxiliary_state_default();
    kt_error error = {0};
    motion m;
    ball_make(&ball, &floor, &d);
    sum.name = "sum";
    sum.rate = "position.ball";
    d.states = &sum;
    d.state_count = 1;
    motion_make(&m, &d, "dop853", 0.0);
    kt_need_fine("derives", derive(&m, at + s, &error), &error);
    for (int j = 0; j < 2; j++) {
        const double later = (j + by[j]) / g, rise = e * by[j];
        /* int_0^at q dt changes by the change of q alone, as q = 0 at its end. */
        const double before = j == 0 ? at : 0.5 * at * at;
        const double behind = 0.5 * rise * s * s - (e * w * s - 0.5 * g * s * s) * later;
        kt_check_near("d q", m.A[3 * j], rise * s - (e * w - g * s) * later, 2e-10);
        kt_check_near("d v", m.A[3 * j + 1], rise + g * later, 2e-10);
        kt_check_near("d x", m.A[3 * j + 2], before + behind, 1e-10);
        kt_check_near("d x by itself", m.A[8], 1.0, 5e-12);
    }
}

/* ---- differences ------------------------------------------------------------------------------------------------- */

/* A leg of two links that swings, and whose knee has a stop at which it bounces, or stays until its reaction ends. With
 * two more stops, which are never met, no set has a compiled model but none and all. */
KT_TEST(derivatives_of_a_leg_with_a_stop_agree_with_differences) {
    for (int way = 0; way < 4; way++) {
        const bool rests = way % 2 == 1;
        kt_body link[2];
        kt_effect stop[2];
        kt_description d = kt_description_default();
        motion m;
        for (int i = 0; i < 2; i++) {
            link[i] =
                kt_body_of(i == 0 ? "thigh" : "shank", i == 0 ? NULL : "thigh", KT_JOINT_REVOLUTE, i == 0 ? 3.0 : 2.0);
            link[i].joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
            link[i].joint.at = kt_vec3_make(0.0, 0.0, i == 0 ? 0.0 : -0.4);
            link[i].com = kt_vec3_make(0.0, 0.0, -0.2);
            link[i].inertia.xx = link[i].inertia.yy = 0.04;
        }
        link[0].joint.position[0] = -1.2;
        link[1].joint.position[0] = 0.9;
        stop_make(&stop[0], "shank", 0.0, rests ? 0.0 : 0.5);
        stop_make(&stop[1], "thigh", -100.0, 0.0);
        stop[1].upper = 100.0;
        d.gravity = kt_vec3_make(0.0, 0.0, -g);
        d.bodies = link, d.body_count = 2;
        d.effects = stop, d.effect_count = way < 2 ? 1 : 2;
        motion_make(&m, &d, "dop853", 0.0);
        compare(&m, rests ? "leg, whose knee rests and leaves" : "leg, whose knee bounces", 1.0, 1e-3, 1e-9);
        const kt_contact_counts counts = kt_simulation_contacts(m.simulation);
        kt_check_above("impacts", (double)counts.impacts, 0.5);
        kt_note("%d impacts, %d closings, %d openings", (int)counts.impacts, (int)counts.closings,
                (int)counts.openings);
        if (rests)
            kt_check_equal_int("openings", (long long)counts.openings, 1);
    }
}

/* A stone that flies, is caught by a rope, swings in it, and leaves it. */
KT_TEST(derivatives_of_a_slack_rope_agree_with_differences) {
    kt_description d = kt_description_default();
    motion m;
    kt_body stone = kt_body_of("stone", NULL, KT_JOINT_PLANAR, 1.5);
    stone.joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
    stone.inertia.xx = stone.inertia.yy = stone.inertia.zz = 0.1;
    stone.joint.position[0] = 0.5;
    stone.joint.position[1] = 0.2;
    stone.joint.velocity[0] = 6.0;
    stone.joint.velocity[2] = 3.0;
    kt_loop rope = kt_loop_of("rope", KT_LOOP_DISTANCE);
    rope.between[1] = (kt_end){.body = "stone", .at = kt_vec3_make(0.1, 0.05, 0.0)};
    rope.function = kt_function_constant(1.0);
    rope.slack = true;
    d.gravity = kt_vec3_make(0.0, -g, 0.0);
    d.bodies = &stone, d.body_count = 1;
    d.loops = &rope, d.loop_count = 1;
    motion_make(&m, &d, "dop853", 0.0);
    compare(&m, "caught", 0.5, 1e-4, 1e-9);
    kt_check_equal_int("closings", (long long)kt_simulation_contacts(m.simulation).closings, 1);
    (void)!kt_simulation_set_torque(m.simulation, NULL, NULL);
    (void)!kt_simulation_set_state(m.simulation, 0.0, m.q, m.v, NULL);
    compare(&m, "and left", 1.6, 1e-4, 1e-9);
    kt_check_equal_int("openings", (long long)kt_simulation_contacts(m.simulation).openings, 1);
}

/* A block in space whose corner strikes a floor: quaternions. */
KT_TEST(derivatives_of_a_corner_that_strikes_agree_with_differences) {
    kt_description d = kt_description_default();
    motion m;
    kt_body block = kt_body_of("block", NULL, KT_JOINT_FREE, 2.0);
    block.inertia.xx = 0.3;
    block.inertia.yy = 0.4;
    block.inertia.zz = 0.5;
    block.joint.position[2] = 0.8;
    block.joint.velocity[0] = 1.0;
    block.joint.velocity[1] = -2.0;
    kt_effect corner = kt_effect_of(KT_EFFECT_CONTACT, NULL);
    corner.name = "corner";
    corner.between[0] = (kt_end){.body = "block", .at = kt_vec3_make(0.2, 0.1, -0.3)};
    corner.axis = kt_vec3_make(0.0, 0.0, 1.0);
    corner.restitution = 0.7;
    d.gravity = kt_vec3_make(0.0, 0.0, -g);
    d.bodies = &block, d.body_count = 1;
    d.effects = &corner, d.effect_count = 1;
    motion_make(&m, &d, "dop853", 0.0);
    compare(&m, "corner", 0.5, 1e-3, 1e-9);
    kt_check_equal_int("impacts", (long long)kt_simulation_contacts(m.simulation).impacts, 1);
}

/* A block between a spring and dry friction: it slides, rests, slips again as the other end of the spring swings on,
 * and turns back. */
KT_TEST(derivatives_of_stick_and_slip_agree_with_differences) {
    kt_body body[2];
    kt_effect effect[3];
    kt_description d = kt_description_default();
    motion m;
    for (int i = 0; i < 2; i++) {
        body[i] = kt_body_of(i == 0 ? "block" : "mass", NULL, KT_JOINT_PRISMATIC, 1.0 + i);
        body[i].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
        effect[i] = kt_effect_of(KT_EFFECT_SPRING, NULL);
        effect[i].between[0].body = i == 0 ? "block" : NULL;
        effect[i].between[1].body = "mass";
        effect[i].stiffness = 40.0 - 10.0 * i;
        effect[i].between[0].at = effect[i].between[1].at = kt_vec3_make(0.0, 0.0, 0.0);
        effect[i].between[1].at.x = 2.0;
        effect[i].length = 1.9;
    }
    body[0].joint.velocity[0] = 1.0;
    body[1].joint.position[0] = 0.5;
    effect[2] = kt_effect_of(KT_EFFECT_JOINT_FRICTION, "block");
    effect[2].coulomb = 6.0;
    effect[2].breakaway = 7.0;
    effect[2].stribeck = 0.0;
    effect[2].stick = true;
    d.bodies = body, d.body_count = 2;
    d.effects = effect, d.effect_count = 3;
    motion_make(&m, &d, "dop853", 0.0);
    compare(&m, "stick and slip", 2.0, 1e-4, 1e-9);
    const kt_contact_counts counts = kt_simulation_contacts(m.simulation);
    kt_note("%d sticks, %d slips", (int)counts.sticks, (int)counts.slips);
    kt_check_above("sticks", (double)counts.sticks, 1.5);
    kt_check_above("slips", (double)counts.slips, 0.5);
}

/* ---- a program's own events -------------------------------------------------------------------------------------- */

static int height(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error, (void)user;
    *value = at->q[0] - 0.5 * at->t;
    return 0;
}

static int bounce(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    const double v = 0.5 - 0.8 * (kt_simulation_velocities(simulation)[0] - 0.5) + sin(what->time);
    (void)user;
    return kt_simulation_jump(simulation, NULL, &v, error) == KT_OK ? 0 : -1;
}

/* A table that moves at 0.5, and throws at a speed that depends on the time. An action that is not declared repeatable
 * is rejected with a message. */
KT_TEST(derivatives_through_a_programs_own_event_agree_with_differences) {
    for (int repeatable = 0; repeatable < 2; repeatable++) {
        const kt_event table = {.name = "table",
                                .function = height,
                                .action = bounce,
                                .direction = KT_DIRECTION_FALLING,
                                .repeatable = repeatable};
        kt_body ball;
        kt_effect floor;
        kt_description d;
        kt_error error = {0};
        motion m;
        ball_make(&ball, &floor, &d);
        d.effect_count = 0;
        motion_make(&m, &d, "dop853", 0.0);
        kt_need_fine("added", kt_simulation_event_add(m.simulation, &table, &error), &error);
        if (repeatable) {
            compare(&m, "table", 1.9, 1e-4, 1e-9);
            kt_check_equal_int("events", (long long)kt_simulation_event_count(m.simulation, "table"), 2);
        } else {
            m.A[0] = 7.0;
            kt_check_equal_int("rejected", derive(&m, 1.2, &error), KT_ERROR_UNSUPPORTED);
            kt_check_contains("where", error.where, "event 'table' at t = 0.4");
            kt_check_contains("words", error.message, "repeatable");
            kt_check_near("A is untouched", m.A[0], 7.0, 0.0);
        }
    }
}

/* Derivatives at an event are rejected. The event then takes effect once the simulation goes on. The bits are those of
 * a simulation without a request for derivatives. */
KT_TEST(an_event_without_derivatives_takes_effect_when_the_simulation_goes_on) {
    static const char *const names[] = {"advance", "step"};
    const kt_event table = {
        .name = "table", .function = height, .action = bounce, .direction = KT_DIRECTION_FALLING, .limit = 1};
    const double t_end = 0.75;
    for (int k = 0; k < 2; k++) {
        kt_body ball;
        kt_effect floor;
        kt_description d;
        kt_error error = {0};
        motion asked, other;
        ball_make(&ball, &floor, &d);
        d.effect_count = 0;
        motion_make(&asked, &d, "rk4", 0.25);
        motion_make(&other, &d, "rk4", 0.25);
        kt_need_fine("added", kt_simulation_event_add(asked.simulation, &table, &error), &error);
        kt_need_fine("added", kt_simulation_event_add(other.simulation, &table, &error), &error);
        for (int again = 0; again < 2; again++)
            kt_check_equal_int("rejected", derive(&asked, t_end, &error), KT_ERROR_UNSUPPORTED);
        kt_check_equal_int("has not happened", (long long)kt_simulation_event_count(asked.simulation, "table"), 0);
        kt_status status = KT_OK;
        while (status == KT_OK && kt_simulation_time(asked.simulation) < t_end)
            status = (k == 0 ? kt_simulation_advance : kt_simulation_step)(asked.simulation, t_end, &error);
        (void)kt_fine(names[k], status, &error);
        kt_test_advance(other.simulation, t_end);
        kt_check_equal_int("happened", (long long)kt_simulation_event_count(asked.simulation, "table"), 1);
        kt_check_near("q", kt_simulation_positions(asked.simulation)[0], kt_simulation_positions(other.simulation)[0],
                      0.0);
        kt_check_near("v", kt_simulation_velocities(asked.simulation)[0], kt_simulation_velocities(other.simulation)[0],
                      0.0);
    }
}

static int reach_of(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error, (void)user;
    *value = at->q[0] + 0.1 * at->v[0] - 0.2;
    return 0;
}

static int release(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    (void)what, (void)user;
    return kt_simulation_set_switches(simulation, 0, NULL, error) == KT_OK ? 0 : -1;
}

/* A spring that is let go of while it pulls, where the force jumps. */
KT_TEST(derivatives_through_a_release_agree_with_differences) {
    const kt_event let = {.name = "let", .function = reach_of, .action = release, .limit = 1, .repeatable = true};
    kt_body ball;
    kt_effect spring;
    kt_description d;
    kt_error error = {0};
    motion m;
    ball_make(&ball, &spring, &d);
    spring = kt_effect_of(KT_EFFECT_JOINT_SPRING, "ball");
    spring.name = "spring";
    spring.stiffness = 30.0;
    spring.switching = KT_SWITCHED_ON;
    motion_make(&m, &d, "dop853", 0.0);
    kt_need_fine("added", kt_simulation_event_add(m.simulation, &let, &error), &error);
    compare(&m, "release", 1.0, 1e-4, 1e-9);
    kt_check_equal_int("released", (long long)kt_switch_set(kt_simulation_model(m.simulation)), 0);
}

/* ---- where there is none ----------------------------------------------------------------------------------------- */

static int flat_height(const kt_instant *at, double *value, kt_error *error, void *user) {
    const int status = height(at, value, error, user);
    *value *= *value * *value;
    return status;
}

/* Two that strike at once, after which the simulation goes on; and a value that crosses zero at no rate. */
KT_TEST(events_without_derivatives_are_told) {
    kt_body ball[2];
    kt_effect floor[2];
    kt_description d;
    kt_error error = {0};
    motion m;
    ball_make(&ball[1], &floor[1], &d);
    ball_make(&ball[0], &floor[0], &d);
    ball[1].name = floor[1].joint = "other";
    d.bodies = ball, d.body_count = 2;
    d.effects = floor, d.effect_count = 2;
    motion_make(&m, &d, "rk4", 0.01);
    kt_check_equal_int("at once", derive(&m, 1.0, &error), KT_ERROR_SINGULAR);
    kt_check_contains("words", error.message, "at the same instant as another one");
    kt_test_advance(m.simulation, 1.0);
    kt_check_equal_int("impacts", (long long)kt_simulation_contacts(m.simulation).impacts, 2);
    ball[1].joint.position[0] =
        1.00003; /* neighbours of the first are off by 1e-4, where the other one is through its floor */
    motion_make(&m, &d, "rk4", 0.01);
    kt_check_equal_int("nearly at once", derive(&m, 1.0, &error), KT_ERROR_SINGULAR);
    kt_check_contains("words", error.message, "meet another contact that is nearly closed");
    d.body_count = d.effect_count = 1;
    const kt_event flat = {.name = "flat", .function = flat_height, .action = bounce, .repeatable = true};
    motion_make(&m, &d, "rk4", 0.01);
    kt_need_fine("added", kt_simulation_event_add(m.simulation, &flat, &error), &error);
    kt_check_equal_int("flat", derive(&m, 1.0, &error), KT_ERROR_SINGULAR);
    kt_check_contains("words", error.message, "touches zero without crossing it");
}

/* The columns of these coordinates and velocities, since a drive prescribes others. */
static void check_drive(const kt_description *d, unsigned columns) {
    static const char *const methods[] = {"dopri5", "dop853", "radau5"};
    for (size_t i = 0; i < sizeof methods / sizeof *methods; i++) {
        motion m;
        motion_make(&m, d, methods[i], 0.0);
        compare_columns(&m, methods[i], 1.0, 1e-3, 1e-10, columns);
    }
}

/* A pendulum on a trolley that moves at 1 m/s and halts. The derivatives pass through the impulse of the drive, which
 * depends on the pendulum's angle. The trolley's own columns are prescribed. */
KT_TEST(derivatives_through_a_halt_of_a_drive_agree_with_differences) {
    static const double rows[] = {0.0, 0.0, 0.5, 0.5};
    kt_body bodies[2] = {kt_body_default(), kt_body_default()};
    kt_loop drive = kt_loop_default();
    kt_description d = kt_description_default();
    bodies[0].name = "trolley", bodies[1].name = "load", bodies[1].parent = "trolley";
    bodies[0].joint.type = KT_JOINT_PRISMATIC, bodies[0].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    bodies[1].joint.type = KT_JOINT_REVOLUTE;
    bodies[0].mass = 2.0, bodies[1].mass = 1.0;
    bodies[1].com = kt_vec3_make(0.0, -1.0, 0.0);
    bodies[1].joint.position[0] = 0.4;
    drive.name = "drive", drive.type = KT_LOOP_MOTION, drive.joint = "trolley";
    drive.function = kt_function_table(rows, 4, KT_INTERPOLATION_LINEAR);
    d.gravity = kt_vec3_make(0.0, -g, 0.0);
    d.bodies = bodies, d.body_count = 2;
    d.loops = &drive, d.loop_count = 1;
    check_drive(&d, 1U << 1 | 1U << 3);
}

/* A block with a pendulum lies on a table that starts at 2 m/s, upwards and to the side. The contact's impulse and that
 * of its friction, which holds it, depend on the pendulum's angle. */
KT_TEST(derivatives_through_a_start_of_a_drive_below_a_block_agree_with_differences) {
    static const double rows[] = {0.0, 0.0, 0.5, 0.0, 2.0, 3.0};
    static const char *const names[] = {"table", "guide", "block", "load"};
    kt_body bodies[4];
    kt_marker foot = {.name = "foot"};
    kt_loop drive = kt_loop_default();
    kt_effect contact = kt_effect_default();
    kt_description d = kt_description_default();
    for (int i = 0; i < 4; i++) {
        bodies[i] = kt_body_of(names[i], i > 1 ? names[i - 1] : NULL, i < 3 ? KT_JOINT_PRISMATIC : KT_JOINT_REVOLUTE,
                               i == 1 ? 0.0 : 1.0 + i);
        bodies[i].joint.axis = kt_vec3_make(i == 0 ? 0.8 : i == 1, i == 0 ? 0.6 : i == 2, i == 3);
    }
    bodies[2].markers = &foot, bodies[2].marker_count = 1;
    bodies[3].com = kt_vec3_make(0.0, -1.0, 0.0);
    bodies[3].joint.position[0] = 0.4;
    drive.name = "drive", drive.type = KT_LOOP_MOTION, drive.joint = "table";
    drive.function = kt_function_table(rows, 6, KT_INTERPOLATION_LINEAR);
    contact.name = "contact", contact.type = KT_EFFECT_CONTACT;
    contact.between[0].body = "block", contact.between[0].marker = "foot", contact.between[1].body = "table";
    contact.axis = kt_vec3_make(0.0, 1.0, 0.0), contact.friction = 0.9, contact.restitution = 0.5;
    d.gravity = kt_vec3_make(0.0, -g, 0.0);
    d.bodies = bodies, d.body_count = 4;
    d.loops = &drive, d.loop_count = 1, d.effects = &contact, d.effect_count = 1;
    check_drive(&d, 1U << 3 | 1U << 7);
}

/* The motion keeps its bits, and so do A and B in garbage. */
KT_TEST(motion_with_derivatives_has_the_bits_of_one_without) {
    kt_body ball;
    kt_effect floor;
    kt_description d;
    kt_error error = {0};
    motion m, other;
    ball_make(&ball, &floor, &d);
    motion_make(&m, &d, "dopri5", 0.0);
    motion_make(&other, &d, "dopri5", 0.0);
    (void)kt_fine("with", derive(&m, 1.7, &error), &error);
    kt_test_advance(other.simulation, 1.7);
    kt_check_near("q", kt_simulation_positions(m.simulation)[0], kt_simulation_positions(other.simulation)[0], 0.0);
    kt_check_near("v", kt_simulation_velocities(m.simulation)[0], kt_simulation_velocities(other.simulation)[0], 0.0);
    kt_check_equal_int("steps", (long long)kt_simulation_counts_of(m.simulation).steps,
                       (long long)kt_simulation_counts_of(other.simulation).steps);
}
