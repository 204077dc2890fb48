/* Effects as a scene has them: a caller's own, in batches, far from the world's origin, and those that go wrong. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "fixture.h"

#include "kinetree/effect.h"
#include "kinetree/simulation.h"
#include "model/model.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { BODIES = 6, EFFECTS = 8, NUMBERS = 16 };

/* A chain of turning arms, one tree, and a ball that is free. */
typedef struct stage {
    kt_body bodies[BODIES];
    kt_effect effects[EFFECTS];
    kt_description description;
    kt_model *model;
    kt_data *data;
    double q[NUMBERS], v[NUMBERS], a[NUMBERS];
} stage;

static const char *const names[BODIES] = {"a", "b", "c", "d", "e", "ball"};

static void stage_describe(stage *s) {
    memset(s, 0, sizeof *s);
    for (int i = 0; i < BODIES; i++) {
        kt_body *b = &s->bodies[i];
        *b = kt_body_of(names[i], i > 0 && i < BODIES - 1 ? names[i - 1] : NULL,
                        i < BODIES - 1 ? KT_JOINT_REVOLUTE : KT_JOINT_FREE, 1.0 + i);
        b->joint.axis = i % 2 ? kt_vec3_make(0.0, 1.0, 0.0) : kt_vec3_make(0.0, 0.0, 1.0);
        b->joint.at = kt_vec3_make(i > 0 ? 0.5 : 0.0, 0.0, 0.0);
        b->joint.position[0] = 0.3 * (i + 1);
        b->joint.velocity[0] = 0.7 - 0.2 * i;
        b->com = kt_vec3_make(0.25, 0.05, -0.02);
        b->inertia = kt_sym3_make(0.1, 0.2, 0.25, 0.0, 0.0, 0.0);
    }
    s->description = kt_description_default();
    s->description.bodies = s->bodies;
    s->description.body_count = BODIES;
    s->description.effects = s->effects;
}

static kt_effect *add(stage *s, kt_effect_type type) {
    kt_effect *effect = &s->effects[s->description.effect_count++];
    *effect = kt_effect_of(type, NULL);
    return effect;
}

static void stage_build(stage *s) {
    s->model = kt_test_model(&s->description, NULL);
    s->data = kt_test_data(s->model);
    kt_model_initial(s->model, s->q, s->v);
}

static void stage_evaluate(stage *s, double t) {
    kt_error error;
    kt_need_fine("acceleration", kt_acceleration_evaluate(s->model, s->data, t, s->q, s->v, NULL, NULL, s->a, &error),
                 &error);
}

/* ---- a caller's own ---------------------------------------------------------------------------------------------- */

typedef struct own {
    double stiffness, damping;
    int calls, code, at; /* returns `code` from the call of this number on */
    double spoil;        /* added to the force */
} own;

/* The library's spring of no length, with a damper of the whole velocity. */
static int pull(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches, kt_effect_balance *balance) {
    own *o = user;
    (void)t;
    const kt_vec3 d = kt_vec3_sub(ends[1].point, ends[0].point);
    const kt_vec3 moving = kt_vec3_sub(ends[1].velocity, ends[0].velocity);
    const double length = kt_vec3_norm(d), rate = kt_vec3_dot(d, moving) / length;
    const kt_vec3 force = kt_vec3_scale((o->stiffness * length + o->damping * rate) / length, d);
    wrenches[0].force = force;
    wrenches[1].force = kt_vec3_scale(-1.0, force);
    if (balance) {
        balance->energy = 0.5 * o->stiffness * length * length;
        balance->dissipated = o->damping * rate * rate;
    }
    return 0;
}

/* A force at one end, world axes, and a moment. */
static int blow(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches, kt_effect_balance *balance) {
    (void)user;
    wrenches[0].force = kt_vec3_make(1.0 + t, -2.0, 0.5);
    wrenches[0].moment = kt_vec3_make(0.1, 0.2, -0.3);
    if (balance)
        balance->supplied =
            kt_vec3_dot(wrenches[0].force, ends[0].velocity) + kt_vec3_dot(wrenches[0].moment, ends[0].omega);
    return 0;
}

/* Draws one end to the world's origin. */
static int well(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches, kt_effect_balance *balance) {
    const double k = ((const own *)user)->stiffness;
    (void)t;
    wrenches[0].force = kt_vec3_scale(-k, ends[0].point);
    if (balance)
        balance->energy = 0.5 * k * kt_vec3_dot(ends[0].point, ends[0].point);
    return 0;
}

static int turn(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    own *o = user;
    (void)t, (void)q;
    *force = -o->damping * v + o->spoil;
    if (balance)
        balance->dissipated = o->damping * v * v;
    return o->calls++ >= o->at ? o->code : 0;
}

static kt_effect *add_pull(stage *s, own *o) {
    kt_effect *effect = add(s, KT_EFFECT_CUSTOM);
    effect->wrench = pull;
    effect->user = o;
    effect->end_count = 2;
    effect->between[0].body = "c";
    effect->between[0].at = kt_vec3_make(0.1, 0.2, 0.3);
    effect->between[1].body = "ball";
    effect->between[1].at = kt_vec3_make(-0.3, 0.2, 0.0);
    return effect;
}

static kt_effect *add_turn(stage *s, const char *joint, own *o) {
    kt_effect *effect = add(s, KT_EFFECT_CUSTOM);
    effect->name = "mine";
    effect->joint = joint;
    effect->joint_force = turn;
    effect->user = o;
    return effect;
}

KT_TEST(custom_effects_push_as_the_library_s_own_do) {
    static stage mine, theirs;
    own spring = {.stiffness = 30.0, .damping = 2.0, .at = 1}, damper = {.damping = 0.7, .at = 1 << 30};
    stage_describe(&mine);
    stage_describe(&theirs);
    (void)add_pull(&mine, &spring);
    (void)add_turn(&mine, "b", &damper);
    kt_effect *wind = add(&mine, KT_EFFECT_CUSTOM);
    wind->wrench = blow;
    wind->end_count = 1;
    wind->between[0].body = "e";
    wind->between[0].at = kt_vec3_make(0.2, 0.1, 0.0);

    kt_effect *e = add(&theirs, KT_EFFECT_SPRING);
    e->between[0] = mine.effects[0].between[0];
    e->between[1] = mine.effects[0].between[1];
    e->stiffness = 30.0;
    e->damping = 2.0;
    e = add(&theirs, KT_EFFECT_JOINT_DAMPER);
    e->joint = "b";
    e->damping = 0.7;
    const double force[3] = {1.4, -2.0, 0.5}, moment[3] = {0.1, 0.2, -0.3};
    kt_effect *f = add(&theirs, KT_EFFECT_FORCE), *m = add(&theirs, KT_EFFECT_TORQUE);
    f->between[0] = wind->between[0];
    m->between[0].body = "e";
    for (int k = 0; k < 3; k++) {
        f->value[k] = kt_function_constant(force[k]);
        m->value[k] = kt_function_constant(moment[k]);
    }
    stage_build(&mine);
    stage_build(&theirs);
    stage_evaluate(&mine, 0.4);
    stage_evaluate(&theirs, 0.4);
    kt_error error;
    kt_power here = {0.0, 0.0}, there = {0.0, 0.0};
    KT_WORST worst = kt_worst_make("acceleration");
    for (int i = 0; i < kt_model_nv(mine.model); i++)
        kt_worst_near(&worst, mine.a[i], theirs.a[i], 256.0 * DBL_EPSILON * (1.0 + fabs(theirs.a[i])), "%d", i);
    (void)kt_fine("power",
                  kt_power_evaluate(mine.model, mine.data, 0.4, mine.q, mine.v, NULL, NULL, mine.a, &here, &error),
                  &error);
    (void)kt_fine(
        "power",
        kt_power_evaluate(theirs.model, theirs.data, 0.4, theirs.q, theirs.v, NULL, NULL, theirs.a, &there, &error),
        &error);
    kt_check_near("dissipated", here.dissipated, there.dissipated, 64.0 * DBL_EPSILON * there.dissipated);
    kt_check_near("supplied", here.supplied, there.supplied, 64.0 * DBL_EPSILON * fabs(there.supplied));
    const double v = kt_effect_energy(mine.model, mine.data, 0.4, mine.q, mine.v);
    kt_check_near("energy", v, kt_effect_energy(theirs.model, theirs.data, 0.4, theirs.q, theirs.v),
                  16.0 * DBL_EPSILON * v);
}

KT_TEST(custom_effects_see_the_world_s_coordinates) {
    static stage s;
    stage_describe(&s);
    static own spring = {.stiffness = 1.0};
    kt_effect *effect = add(&s, KT_EFFECT_CUSTOM);
    effect->wrench = well;
    effect->user = &spring;
    effect->end_count = 1;
    effect->between[0].body = "ball";
    effect->between[0].at = kt_vec3_make(-0.3, 0.2, 0.0);
    stage_build(&s);
    kt_error error;
    (void)kt_fine("kinematics", kt_kinematics_update(s.model, s.data, s.q, s.v, NULL, &error), &error);
    const kt_vec3 p = kt_point_position(s.model, s.data, kt_body_find(s.model, "ball"), effect->between[0].at);
    const double energy = kt_effect_energy(s.model, s.data, 0.0, s.q, s.v);
    kt_check_near("energy", energy, 0.5 * kt_vec3_dot(p, p), 32.0 * DBL_EPSILON * energy);
}

KT_TEST(wrong_custom_effects_are_told) {
    static const char *const messages[] = {"neither wrench nor joint_force", "both wrench and joint_force",
                                           "end_count is 3", "both ends are on"};
    for (int i = 0; i < 4; i++) {
        static stage s;
        kt_error error = {0};
        stage_describe(&s);
        kt_effect *effect = add(&s, KT_EFFECT_CUSTOM);
        effect->wrench = i > 0 ? pull : NULL;
        effect->joint_force = i == 1 ? turn : NULL;
        effect->end_count = i == 2 ? 3 : 2;
        kt_check_equal_int("status", kt_model_compile(&s.description, NULL, &s.model, &error), KT_ERROR_MODEL);
        kt_check_contains("message", error.message, messages[i]);
    }
}

/* ---- what goes wrong --------------------------------------------------------------------------------------------- */

/* A run that fails at some stage: its status and words, and the state left alone. */
static void run_into(stage *s, const char *integrator, double step, kt_status expected, const char *where,
                     const char *message) {
    kt_error error = {0};
    kt_run run = kt_run_default();
    double state[2 * NUMBERS];
    run.integrator = integrator;
    run.step = step;
    run.relative = run.absolute = 1e-6;
    stage_build(s);
    kt_simulation *simulation = kt_test_simulation(s->model, &run, NULL);
    kt_status status = KT_OK;
    const size_t nq = (size_t)kt_model_nq(s->model), nv = (size_t)kt_model_nv(s->model);
    for (int i = 0; i < 1000 && status == KT_OK; i++) {
        memcpy(state, kt_simulation_positions(simulation), (nq + nv) * sizeof *state);
        status = kt_simulation_step(simulation, 10.0, &error);
    }
    kt_check_equal_int(integrator, status, expected);
    kt_check_contains("where", error.where, where);
    kt_check_contains("where", error.where, "t = ");
    kt_check_contains("message", error.message, message);
    kt_check_equal_bits("state", kt_simulation_positions(simulation), state, nq + nv);
}

KT_TEST(callback_that_stops_ends_the_step) {
    static stage s;
    own o = {.damping = 0.1, .code = -7, .at = 40};
    stage_describe(&s);
    (void)add_turn(&s, "b", &o);
    run_into(&s, "rk4", 0.01, KT_ERROR_CALLBACK, "effect 'mine' (custom) on joint 'b'", "code -7");
    o.calls = 0;
    run_into(&s, "dopri5", 0.0, KT_ERROR_CALLBACK, "effect 'mine' (custom) on joint 'b'", "code -7");
}

KT_TEST(callback_that_cannot_tell_is_retried_with_smaller_steps) {
    static stage s;
    own o = {.damping = 0.1, .code = 3, .at = 40};
    stage_describe(&s);
    (void)add_turn(&s, "b", &o);
    run_into(&s, "rk4", 0.01, KT_ERROR_EFFECT, "effect 'mine' (custom) on joint 'b'", "code 3");
    o.calls = 0;
    run_into(&s, "dopri5", 0.0, KT_ERROR_EFFECT, "effect 'mine' (custom) on joint 'b'", "smaller steps did not help");
}

/* Rejects every other call that is far from the last one. */
static int reject_jumps(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    own *o = user;
    (void)q, (void)balance;
    *force = -0.1 * v;
    const bool far = t - o->spoil > 0.02;
    o->spoil = t;
    o->calls += far;
    return far ? 1 : 0;
}

KT_TEST(recoverable_callback_makes_the_step_smaller_and_goes_on) {
    static stage s;
    kt_error error;
    static own o = {.stiffness = 0.0};
    kt_run run = kt_run_default();
    run.relative = run.absolute = 1e-3;
    stage_describe(&s);
    add_turn(&s, "b", &o)->joint_force = reject_jumps;
    stage_build(&s);
    kt_simulation *simulation = kt_test_simulation(s.model, &run, NULL);
    kt_need_fine("advance", kt_simulation_advance(simulation, 1.0, &error), &error);
    kt_check_above("rejected", o.calls, 1);
    kt_check_above("rejected", (double)kt_simulation_counts_of(simulation).rejected, 1);
}

KT_TEST(force_that_is_not_finite_is_named_with_its_time) {
    static const double spoils[] = {(double)NAN, (double)INFINITY};
    for (int i = 0; i < 2; i++) {
        static stage s;
        own o = {.damping = 0.1, .spoil = spoils[i], .at = 1 << 30};
        stage_describe(&s);
        (void)add_turn(&s, "d", &o);
        run_into(&s, "rk4", 0.01, KT_ERROR_NOT_FINITE, "effect 'mine' (custom) on joint 'd', t = 0", "not finite");
    }
    /* and where it moves nothing: the joint's motion is prescribed */
    static stage s;
    kt_error error = {0};
    kt_loop drive = kt_loop_default();
    own o = {.damping = 0.1, .spoil = (double)NAN, .at = 1 << 30};
    stage_describe(&s);
    (void)add_turn(&s, "a", &o);
    drive.name = "drive";
    drive.type = KT_LOOP_MOTION;
    drive.joint = "a";
    drive.function = kt_function_constant(0.3);
    s.description.loops = &drive;
    s.description.loop_count = 1;
    stage_build(&s);
    kt_check_equal_int("status", kt_acceleration_evaluate(s.model, s.data, 0.5, s.q, s.v, NULL, NULL, s.a, &error),
                       KT_ERROR_NOT_FINITE);
    kt_check_text("where", error.where, "effect 'mine' (custom) on joint 'a', t = 0.5 s");
}

KT_TEST(wrench_that_is_not_finite_is_named) {
    static stage s;
    kt_error error = {0};
    stage_describe(&s);
    own o = {.stiffness = (double)NAN};
    add_pull(&s, &o)->name = "tether";
    s.effects[0].between[0].body = NULL;
    stage_build(&s);
    double a[NUMBERS] = {7.0, 7.0, 7.0};
    kt_check_equal_int("status", kt_acceleration_evaluate(s.model, s.data, 0.25, s.q, s.v, NULL, NULL, a, &error),
                       KT_ERROR_NOT_FINITE);
    kt_check_text("where", error.where, "effect 'tether' (custom) between 'world' and 'ball', t = 0.25 s");
    kt_check_near("untouched", a[0], 7.0, 0.0);
    kt_effect_load load = {.joint_force = 7.0};
    (void)kt_fine("kinematics", kt_kinematics_update(s.model, s.data, s.q, s.v, NULL, &error), &error);
    kt_check_equal_int("load", kt_effect_evaluate(s.model, s.data, 0.5, s.q, s.v, 0, &load, &error),
                       KT_ERROR_NOT_FINITE);
    kt_check_text("where", error.where, "effect 'tether' (custom) between 'world' and 'ball', t = 0.5 s");
    kt_check_near("untouched", load.joint_force, 7.0, 0.0);
}

/* Kinematics of one position and the velocities of another would make a force that no state has. */
KT_TEST(load_of_an_effect_is_rejected_from_kinematics_of_another_state) {
    static stage s;
    kt_error error = {0};
    kt_effect_load load = {.joint_force = 7.0}, expected = {.joint_force = 0.0};
    stage_describe(&s);
    own o = {.stiffness = 3.0};
    add_pull(&s, &o)->name = "tether";
    stage_build(&s);
    (void)kt_fine("kinematics", kt_kinematics_update(s.model, s.data, s.q, s.v, NULL, &error), &error);
    (void)kt_fine("load", kt_effect_evaluate(s.model, s.data, 0.0, s.q, s.v, 0, &expected, &error), &error);
    s.q[0] += 1e-9;
    kt_check_equal_int("another q", kt_effect_evaluate(s.model, s.data, 0.0, s.q, s.v, 0, &load, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_contains("what", error.message, "another state");
    s.q[0] -= 1e-9;
    s.v[0] += 1.0;
    kt_check_equal_int("another v", kt_effect_evaluate(s.model, s.data, 0.0, s.q, s.v, 0, &load, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_equal_int("no effect", kt_effect_evaluate(s.model, s.data, 0.0, s.q, s.v, 1, &load, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_near("untouched", load.joint_force, 7.0, 0.0);
    (void)kt_fine("kinematics", kt_kinematics_update(s.model, s.data, s.q, NULL, NULL, &error), &error);
    (void)kt_fine("at rest", kt_effect_evaluate(s.model, s.data, 0.0, s.q, NULL, 0, &load, &error), &error);
    kt_check_equal_bits("a pull does not depend on velocities", &load.wrench[0].force.x, &expected.wrench[0].force.x,
                        3);
}

/* ---- batches ----------------------------------------------------------------------------------------------------- */

KT_TEST(effects_lie_in_batches_of_one_type_and_only_what_bears_them_moves) {
    static stage s;
    static const kt_effect_type order[] = {KT_EFFECT_SPRING,       KT_EFFECT_MOTOR,  KT_EFFECT_SPRING, KT_EFFECT_FORCE,
                                           KT_EFFECT_JOINT_DAMPER, KT_EFFECT_SPRING, KT_EFFECT_MOTOR};
    stage_describe(&s);
    for (size_t i = 0; i < sizeof order / sizeof *order; i++) {
        kt_effect *e = add(&s, order[i]);
        e->joint = i % 2 ? "a" : "e";
        e->between[0].body = "b";
        e->between[1].body = i == 2 ? "ball" : NULL;
        e->torque = kt_function_constant(1.0);
        for (int k = 0; k < 3; k++)
            e->value[k] = kt_function_constant(1.0);
    }
    stage_build(&s);
    const kt_model *m = s.model;
    int wrong = 0, seen = 0;
    for (size_t b = 0; b < m->n.batch; b++)
        for (int i = 0; i < m->batch[b].count; i++, seen++) {
            const kt_effect_record *r = &m->effect[m->batch[b].first + i];
            wrong += r->type != m->batch[b].type || r->ends != m->batch[b].ends;
            wrong += i > 0 && r->source <= r[-1].source;
        }
    kt_check_equal_int("effects", seen, 7);
    kt_check_equal_int("out of order", wrong, 0);
    kt_check_equal_int("batches", (long long)m->n.batch, 4);
    kt_check_equal_int("those on joints first", m->batch[0].ends, 0);
    kt_check_equal_int("ground, a, b and the ball", (long long)m->n.force_link, 4);
    kt_check_equal_int("angles", (long long)m->n.force_link_angle, 2);
}

/* Two balls on a spring, near to each other and a million metres from the world's origin. They move as two balls at the
 * origin do, to rounding of the difference of their positions, which is exact. */
KT_TEST(spring_far_from_the_origin_loses_no_digits) {
    double a[2][NUMBERS] = {{0.0}};
    for (int k = 0; k < 2; k++) {
        static stage s;
        const double far = k ? 1048576.0 : 0.0; /* 2^20: the sums with numbers of few bits are exact */
        stage_describe(&s);
        s.description.body_count = 2; /* an arm far away, and another on it */
        s.bodies[0].joint.at = kt_vec3_make(far, -far, far);
        kt_effect *e = add(&s, KT_EFFECT_SPRING);
        e->between[0].body = "b";
        e->between[0].at = kt_vec3_make(0.3, 0.1, -0.2);
        e->between[1].at = kt_vec3_make(far + 0.5, 0.75 - far, far + 0.25);
        e->stiffness = 1e6;
        e->initial_length = false;
        e->length = 0.3;
        e = add(&s, KT_EFFECT_SPRING);
        e->between[0].body = "a";
        e->between[0].at = kt_vec3_make(0.0, 0.1, 0.0);
        e->between[1].body = "b";
        e->between[1].at = kt_vec3_make(0.4, 0.1, 0.0);
        e->stiffness = 1e6;
        e->initial_length = false;
        e->length = 0.3;
        stage_build(&s);
        stage_evaluate(&s, 0.0);
        memcpy(a[k], s.a, sizeof a[k]);
    }
    for (int i = 0; i < 2; i++)
        kt_check_near("acceleration", a[1][i], a[0][i], 64.0 * DBL_EPSILON * fabs(a[0][i]));
    kt_check_above("which is large", fabs(a[0][0]), 1e4);
}
