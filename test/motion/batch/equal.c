/* A batch of random trees has the bits of its states computed one by one. The trees have every joint, in space and in
 * the plane, with armature and without, with effects of every type and without. This is tested on every instruction
 * set, with any contents of the other lanes. Nothing is allocated on the way. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "interpose.h"
#include "load.h"
#include "many.h"
#include "mechanics/dynamics/tree.h"

#include "batch/batch.h"
#include "dynamics/dynamics.h"
#include "kinetree/run.h"
#include "kinetree/simulation.h"
#include "kinetree/study.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TREES = 300 };

static kt_tree_plan draw_plan(int n, kt_random *random) {
    kt_tree_plan plan = n % 4 < 2 ? kt_tree_plan_default() : kt_tree_plan_planar();
    if (n % 4 == 3) {
        plan.planar = 2;
        plan.from_world = 0.4;
    }
    plan.is_shuffled = n % 4 == 1;
    plan.with_armature = n % 3 == 2 ? 0.5 : 0.0;
    plan.bodies = kt_random_int(random, 1, KT_TREE_BODIES);
    return plan;
}

static void draw_states(const kt_tree *tree, kt_many *many, kt_random *random) {
    kt_tree_state s;
    for (size_t i = 0; i < KT_MANY_STATES; i++) {
        kt_tree_state_draw(tree, random, &s);
        memcpy(many->q + i * many->nq, s.q, many->nq * sizeof(double));
        memcpy(many->v + i * many->nv, s.v, many->nv * sizeof(double));
        memcpy(many->tau + i * many->nv, s.tau, many->nv * sizeof(double));
        memcpy(many->a + i * many->nv, s.a, many->nv * sizeof(double));
    }
}

/* Some states that cannot be computed, or almost: not finite, huge, quaternions of no norm and of tiny one. */
static void spoil_states(kt_many *many, kt_random *random) {
    static const double bad[] = {(double)NAN, (double)INFINITY, 1e300, -1e160, 0.0, 1e-170, 3e6};
    for (size_t i = 1; i < KT_MANY_STATES; i += 3) {
        double *x = i % 2 ? many->q + i * many->nq : many->v + i * many->nv;
        const size_t n = i % 2 ? many->nq : many->nv;
        const double value = bad[kt_random_int(random, 0, 6)];
        for (size_t k = (size_t)kt_random_int(random, 0, 3); k < n; k += 2)
            x[k] = value;
    }
}

/* Gives some states models whose joints and markers are further apart. */
static void vary_lengths(kt_tree *tree, kt_many *many, kt_isa isa, kt_model *longer[2]) {
    for (int k = 0; k < 2; k++) {
        for (int body = 0; body < tree->description.body_count; body++) {
            tree->body[body].joint.at = kt_vec3_scale(1.1, tree->body[body].joint.at);
            tree->marker[body].at = kt_vec3_scale(1.1, tree->marker[body].at);
        }
        longer[k] = kt_test_model(&tree->description, &(kt_model_options){.isa = isa});
    }
    for (size_t i = 1; i < KT_MANY_STATES; i += 3)
        many->own[i] = longer[i % 2];
}

/* `trees` random trees; spoilt: with states that cannot be computed; varied: with parameters of their own. */
static uint64_t compare(kt_isa isa, const char *what, int trees, bool spoilt, bool varied) {
    const double h = 0.01;
    kt_random random = kt_random_of_test();
    int different[6] = {0, 0, 0, 0, 0, 0};
    uint64_t in_lanes = 0;
    static kt_load_list loads;
    for (int n = 0; n < trees; n++) {
        kt_tree tree;
        kt_many many;
        kt_model *longer[2] = {NULL, NULL};
        const kt_tree_plan plan = draw_plan(n, &random);
        kt_tree_describe(&tree, &plan, &random);
        if (n % 5 > 1)
            kt_load_add(&loads, &tree, n % 5 == 4, &random);
        kt_tree_compile(&tree, &(kt_model_options){.isa = isa});
        kt_need(kt_many_make(&many, tree.model, kt_method_find(n % 2 ? "dopri5" : "rk4")));
        if (varied) {
            kt_many_vary(&many, &random);
            vary_lengths(&tree, &many, isa, longer);
        }
        draw_states(&tree, &many, &random);
        if (spoilt)
            spoil_states(&many, &random);
        different[0] += kt_many_compare_forward(&many, tree.data);
        different[1] += kt_many_compare_inverse(&many, tree.data);
        many.threads = 1 + (size_t)n % KT_MANY_THREADS;
        different[2] += kt_many_compare_steps(&many, tree.data, h, 3);
        different[3] += kt_many_compare_semi_implicit(&many, tree.data, h, 3);
        different[4] += kt_many_compare_sensors(&many, tree.data);
        different[5] += kt_many_compare_inputs(&many, tree.data, h, 3);
        in_lanes += kt_batch_report_of(many.batch).in_lanes;
        kt_many_free(&many);
    }
    kt_note("%s: %llu evaluations in lanes", what, (unsigned long long)in_lanes);
    kt_check_equal_int("states whose accelerations differ", different[0], 0);
    kt_check_equal_int("states whose forces differ", different[1], 0);
    kt_check_equal_int("states that differ after three steps", different[2], 0);
    kt_check_equal_int("states that differ after three semi-implicit steps", different[3], 0);
    kt_check_equal_int("states of which a frame's motion or Jacobian differs", different[4], 0);
    kt_check_equal_int("states that differ after three steps of each kind, with a sequence of forces", different[5], 0);
    return in_lanes;
}

static void compare_isa(kt_isa isa, const char *name) {
    if (kt_isa_resolve(isa) != isa) {
        kt_skip(name, KT_NO_ISA);
        return;
    }
    /* forward, inverse, sensors, at least 12 stages and 3 semi-implicit steps of each state */
    kt_check_equal_int("sound states are computed in lanes",
                       (long long)(compare(isa, name, TREES, false, false) >= 18ULL * TREES * KT_MANY_STATES), 1);
}

KT_TEST(lanes_have_the_bits_of_single_states_on_the_baseline) { compare_isa(KT_ISA_BASE, "baseline"); }
KT_TEST(lanes_have_the_bits_of_single_states_on_v3) { compare_isa(KT_ISA_V3, "v3"); }
KT_TEST(lanes_have_the_bits_of_single_states_on_v4) { compare_isa(KT_ISA_V4, "v4"); }

KT_TEST(states_that_fail_fail_alone_and_as_they_do_alone) {
    kt_check_above("evaluations in lanes", (double)compare(KT_ISA_AUTO, "spoilt", TREES, true, false),
                   10.0 * TREES * KT_MANY_STATES);
}

/* Wheels that turn freely: the accelerations do not depend on the velocities. The step makes a position of them. */
KT_TEST(steps_reject_numbers_that_no_acceleration_depends_on) {
    enum { STATES = 9, BAD = 4 };
    static const char *const names[] = {"one", "two"};
    kt_body wheels[2];
    for (int i = 0; i < 2; i++) {
        wheels[i] = kt_body_of(names[i], NULL, KT_JOINT_REVOLUTE, 0.0);
        wheels[i].inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    }
    kt_description d = kt_description_of(wheels, 2, NULL, 0, NULL, 0);
    kt_error error = {KT_OK, "", ""};
    kt_model *model = kt_test_model(&d, NULL);
    kt_data *data = kt_test_data(model);
    const kt_step step = {.method = kt_method_find("euler"), .h = 0.1};
    const double q[2] = {0.3, 0.4}, v[2] = {1.0, (double)NAN};
    double next_q[2] = {7.0, 7.0}, next_v[2] = {8.0, 8.0}, t;
    const size_t size = kt_step_work_size(model, step.method);
    void *work = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    kt_need(kt_check_true("memory", work != NULL));
    kt_check_equal_int("one state", kt_step_evaluate(model, data, work, size, &step, q, v, next_q, next_v, &error),
                       KT_ERROR_NOT_FINITE);
    kt_check_contains("named", error.where, "two");
    kt_check_true("untouched", next_q[0] == 7.0 && next_q[1] == 7.0 && next_v[0] == 8.0 && next_v[1] == 8.0);
    free(work);
    for (int lanes = 0; lanes < 2; lanes++) {
        kt_batch_options options = {.size = sizeof options, .states = lanes ? STATES : BAD + 1, .method = step.method};
        kt_batch *batch = NULL;
        kt_need_fine("batch", kt_batch_create(model, &options, &batch, &error), &error);
        kt_need_fine("state", kt_batch_set_state(batch, BAD, 0.0, q, v, &error), &error);
        kt_check_equal_int("batch", kt_batch_step(batch, 0.1, 1, &error), KT_ERROR_NOT_FINITE);
        kt_check_equal_int("status", kt_batch_status(batch, BAD), KT_ERROR_NOT_FINITE);
        (void)kt_fine("state", kt_batch_get_state(batch, BAD, &t, next_q, next_v, &error), &error);
        kt_check_equal_bits("kept", next_q, q, 2);
        kt_check_near("time", t, 0.0, 0.0);
        kt_check_equal_int("others", kt_batch_status(batch, BAD - 1), KT_OK);
        kt_batch_free(batch);
    }
}

/* A block of mass m on a slide, pushed by 6 N. Each copy of its model has the memory of the copy before, and another
 * mass. */
KT_TEST(model_in_the_place_of_another_one_is_noticed) {
    enum { STATES = 11 };
    kt_body block = kt_body_of("block", NULL, KT_JOINT_PRISMATIC, 1.0);
    const kt_description description = kt_description_of(&block, 1, NULL, 0, NULL, 0);
    const kt_batch_options options = {.states = STATES};
    const kt_model *model = kt_test_model(&description, NULL);
    const size_t size = (kt_model_size(model) + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT;
    const double force = 6.0;
    void *memory = aligned_alloc(KT_ALIGNMENT, size);
    kt_batch *batch = NULL;
    kt_parameter mass;
    kt_error error = {0};
    kt_test_own(memory, free);
    kt_need_fine("parameter", kt_parameter_find(model, "block.mass", &mass, &error), &error);
    kt_need_fine("batch", kt_batch_create(model, &options, &batch, &error), &error);
    for (double m = 2.0; m < 4.5; m += 1.0) {
        KT_WORST worst = kt_worst_make("acceleration, m/s^2");
        kt_model *copy = NULL;
        kt_status status = kt_model_copy(model, memory, size, &copy, &error);
        status = status == KT_OK ? kt_parameter_set(copy, &mass, &m, &error) : status;
        for (size_t i = 0; i < STATES && status == KT_OK; i++) {
            status = kt_batch_set_model(batch, i, copy, &error);
            status = status == KT_OK ? kt_batch_set_torque(batch, i, &force, &error) : status;
        }
        status = status == KT_OK ? kt_batch_forward(batch, &error) : status;
        kt_check_text("forward", status == KT_OK ? "" : error.message, "");
        for (size_t i = 0; i < STATES && status == KT_OK; i++) {
            double a = (double)NAN;
            status = kt_batch_get_acceleration(batch, i, &a, &error);
            kt_worst_near(&worst, a, force / m, 1e-15 * force / m, "state %d", (int)i);
        }
    }
    kt_batch_free(batch);
}

KT_TEST(states_with_parameters_of_their_own_have_the_bits_of_single_states) {
    kt_check_above("evaluations in lanes", (double)compare(KT_ISA_AUTO, "varied", TREES / 5, false, true),
                   10.0 * TREES);
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

KT_TEST(a_batch_works_in_the_memory_of_the_caller_and_allocates_nothing) {
    static _Alignas(KT_ALIGNMENT) char memory[1 << 22];
    kt_random random = kt_random_of_test();
    kt_tree tree;
    kt_tree_state s;
    kt_error error;
    kt_batch *batch = NULL;
    kt_tree_plan plan = kt_tree_plan_default();
    kt_frame_motion motion[21];
    const kt_batch_frame frame = {0, -1};
    const kt_batch_sensors sensors = {.frames = &frame, .count = 1, .motion = motion};
    const kt_batch_options options = {.states = 21, .method = kt_method_find("rk4")};
    static const double torque[21 * 2 * KT_TREE_NV];
    const kt_batch_inputs inputs = {.samples = 2, .hold = 1, .torque = torque};
    const kt_batch_job job = {.task = KT_BATCH_STEP, .h = 0.001, .steps = 3, .inputs = &inputs};
    kt_tree_grow(&tree, &plan, &random);
    const size_t size = kt_batch_size(tree.model, &options);
    memset(memory, 0xFF, sizeof memory);
    kt_need(kt_check_below("bytes of a batch", (double)size, (double)sizeof memory));
    kt_interpose_start();
    kt_status status = kt_batch_init(tree.model, &options, memory, size, &batch, &error);
    for (size_t i = 0; i < options.states && status == KT_OK; i++) {
        kt_tree_state_draw(&tree, &random, &s);
        status = kt_batch_set_state(batch, i, 0.0, s.q, s.v, &error);
    }
    if (status == KT_OK)
        status = kt_batch_forward(batch, &error);
    if (status == KT_OK)
        status = kt_batch_inverse(batch, &error);
    if (status == KT_OK)
        status = kt_batch_sense(batch, &sensors, &error);
    if (status == KT_OK)
        status = kt_batch_step(batch, 0.001, 10, &error);
    if (status == KT_OK)
        status = kt_batch_step_semi_implicit(batch, 0.001, 10, &error);
    if (status == KT_OK)
        status = kt_batch_compute(batch, &job, &error);
    const long allocations = kt_interpose_stop();
    kt_check_equal_int("status", status, KT_OK);
    kt_check_equal_int("allocations", allocations, 0);
    kt_batch_free(batch); /* does nothing */
    kt_check_equal_int("one byte less", kt_batch_init(tree.model, &options, memory, size - 1, &batch, &error),
                       KT_ERROR_MEMORY);
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

KT_TEST(lanes_are_the_memory_of_the_batch) {
    kt_random random = kt_random_of_test();
    kt_tree tree;
    kt_tree_state s;
    kt_batch *batch = NULL;
    kt_tree_plan plan = kt_tree_plan_default();
    double q[KT_TREE_NQ] = {0.0}, v[KT_TREE_NV] = {0.0}, tau[KT_TREE_NV] = {0.0}, t = 0.0;
    const kt_batch_options options = {.states = 11};
    int different = 0;
    kt_tree_grow(&tree, &plan, &random);
    kt_need(kt_check_equal_int("a batch", kt_batch_create(tree.model, &options, &batch, NULL), KT_OK));
    const kt_batch_lanes lanes = kt_batch_lanes_of(batch);
    for (size_t i = 0; i < options.states; i++) {
        const size_t group = i / lanes.width, lane = i % lanes.width;
        kt_tree_state_draw(&tree, &random, &s);
        different += kt_batch_set_state(batch, i, 0.5 * (double)i, s.q, s.v, NULL) != KT_OK;
        lanes.tau[group * lanes.force_stride + lane] = s.v[0];
        different +=
            kt_batch_get_state(batch, i, &t, q, v, NULL) != KT_OK || kt_batch_get_torque(batch, i, tau, NULL) != KT_OK;
        different += lanes.t[i] != 0.5 * (double)i || lanes.t[i] != t || tau[0] != s.v[0];
        for (size_t k = 0; k < (size_t)kt_model_nq(tree.model); k++)
            different += lanes.q[group * lanes.state_stride + k * lanes.width + lane] != s.q[k];
        for (size_t k = 0; k < (size_t)kt_model_nv(tree.model); k++)
            different += lanes.v[group * lanes.state_stride + k * lanes.width + lane] != s.v[k];
    }
    kt_check_equal_int("numbers that differ", different, 0);
    kt_check_equal_int("width", (long long)lanes.width, (long long)kt_batch_report_of(batch).width);
    kt_check_equal_int("groups", (long long)lanes.groups, (long long)((11 + lanes.width - 1) / lanes.width));
    kt_check_equal_int("no batch", (long long)kt_batch_lanes_of(NULL).groups, 0);
    kt_batch_free(batch);
}

/* ---- sequences of joint forces ----------------------------------------------------------------------------------- */

enum { ROLLOUTS = 11, SAMPLES = 5, HOLD = 4, ROLLOUT_STEPS = SAMPLES * HOLD + 3 };

/* Takes the steps of one state by a simulation, and sets the joint forces between them. */
static kt_status simulate_alone(const kt_tree *tree, double h, const double *torque, const kt_tree_state *s, double *q,
                                double *v) {
    const size_t nq = (size_t)kt_model_nq(tree->model), nv = (size_t)kt_model_nv(tree->model);
    kt_run run = kt_run_default();
    kt_simulation *simulation = NULL;
    kt_error error;
    run.integrator = "rk4";
    run.step = h;
    run.duration = 100.0;
    kt_status status = kt_simulation_create(tree->model, &run, NULL, &simulation, &error);
    if (status == KT_OK)
        status = kt_simulation_set_state(simulation, 0.0, s->q, s->v, &error);
    for (int k = 0; k < ROLLOUT_STEPS && status == KT_OK; k++) {
        if (k % HOLD == 0 && k / HOLD < SAMPLES)
            status = kt_simulation_set_torque(simulation, torque + (size_t)(k / HOLD) * nv, &error);
        if (status == KT_OK)
            status = kt_simulation_step(simulation, HUGE_VAL, &error);
    }
    if (status == KT_OK) {
        memcpy(q, kt_simulation_positions(simulation), nq * sizeof *q);
        memcpy(v, kt_simulation_velocities(simulation), nv * sizeof *v);
    }
    kt_simulation_free(simulation);
    return status;
}

/* Compares a job that has a sequence of joint forces with simulations. Returns the number of states that differ. */
static int compare_rollouts(const kt_tree *tree, kt_random *random, size_t threads) {
    const double h = 1.0 / 1024.0;
    const size_t nq = (size_t)kt_model_nq(tree->model), nv = (size_t)kt_model_nv(tree->model);
    const kt_batch_options options = {.states = ROLLOUTS, .threads = threads, .method = kt_method_find("rk4")};
    static double torque[ROLLOUTS * SAMPLES * KT_TREE_NV];
    static kt_tree_state start[ROLLOUTS];
    const kt_batch_inputs inputs = {.samples = SAMPLES, .hold = HOLD, .torque = torque};
    const kt_batch_job job = {.task = KT_BATCH_STEP, .h = h, .steps = ROLLOUT_STEPS, .inputs = &inputs};
    kt_batch *batch = NULL;
    kt_error error;
    int different = 0;
    kt_need_fine("batch", kt_batch_create(tree->model, &options, &batch, &error), &error);
    for (size_t i = 0; i < ROLLOUTS; i++) {
        kt_tree_state_draw(tree, random, &start[i]);
        different += kt_batch_set_state(batch, i, 0.0, start[i].q, start[i].v, NULL) != KT_OK;
    }
    for (size_t i = 0; i < ROLLOUTS * SAMPLES * nv; i++)
        torque[i] = kt_random_uniform(random, -1.0, 1.0);
    kt_need_fine("job", kt_batch_run(batch, &job, threads, NULL, &error), &error);
    for (size_t i = 0; i < ROLLOUTS; i++) {
        double q[KT_TREE_NQ], v[KT_TREE_NV], tau[KT_TREE_NV], found_q[KT_TREE_NQ], found_v[KT_TREE_NV];
        const double *own = torque + i * SAMPLES * nv;
        different += simulate_alone(tree, h, own, &start[i], q, v) != KT_OK ||
                     kt_batch_get_state(batch, i, NULL, found_q, found_v, NULL) != KT_OK ||
                     kt_batch_get_torque(batch, i, tau, NULL) != KT_OK || memcmp(q, found_q, nq * sizeof *q) != 0 ||
                     memcmp(v, found_v, nv * sizeof *v) != 0 ||
                     memcmp(tau, own + (SAMPLES - 1) * nv, nv * sizeof *tau) != 0;
    }
    kt_batch_free(batch);
    return different;
}

KT_TEST(rollout_with_a_sequence_has_the_bits_of_a_simulation_whose_inputs_are_set) {
    kt_random random = kt_random_of_test();
    int different = 0;
    for (int n = 0; n < 20; n++) {
        kt_tree tree;
        kt_tree_plan plan = n % 2 ? kt_tree_plan_default() : kt_tree_plan_planar();
        plan.bodies = kt_random_int(&random, 1, KT_TREE_BODIES);
        kt_tree_describe(&tree, &plan, &random);
        kt_tree_compile(&tree, &(kt_model_options){.isa = n % 4 < 2 ? KT_ISA_AUTO : KT_ISA_BASE});
        different += compare_rollouts(&tree, &random, 1 + (size_t)n % KT_MANY_THREADS);
    }
    kt_check_equal_int("states that differ", different, 0);
}

/* ---- arguments --------------------------------------------------------------------------------------------------- */

/* A batch that was made for one thread. */
static void reject_jobs(kt_batch *batch) {
    kt_error error;
    kt_batch_job job = {.task = KT_BATCH_FORWARD};
    size_t used = 0;
    kt_check_equal_int("one thread", kt_batch_run(batch, &job, 1, &used, &error), KT_OK);
    kt_check_equal_int("threads used", (long long)used, 1);
    kt_check_equal_int("two threads", kt_batch_run(batch, &job, 2, &used, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("what is wrong", error.message, "made for 1");
    kt_check_equal_int("no thread", kt_batch_run(batch, &job, 0, &used, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("another one's workspace", kt_batch_compute_block(batch, 1, 0, &job, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("a block that is not there",
                       kt_batch_compute_block(batch, 0, kt_batch_block_count(batch), &job, &error), KT_ERROR_ARGUMENT);
    job.task = (kt_batch_task)99;
    kt_check_equal_int("no such task", kt_batch_compute(batch, &job, &error), KT_ERROR_ARGUMENT);
    job = (kt_batch_job){.task = KT_BATCH_SENSE};
    kt_check_equal_int("no sensors", kt_batch_compute(batch, &job, &error), KT_ERROR_ARGUMENT);
    static const kt_batch_frame wrong[] = {{99, -1}, {-1, -1}, {1, 1}, {0, -2}};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        const kt_batch_frame frames[] = {{0, -1}, wrong[k]};
        job.sensors = &(kt_batch_sensors){.frames = frames, .count = 2};
        kt_check_equal_int("a frame", kt_batch_compute(batch, &job, &error), KT_ERROR_ARGUMENT);
        kt_check_contains("which is wrong", error.where, "sensors.frames[1]");
    }
    job = (kt_batch_job){.task = KT_BATCH_SEMI_IMPLICIT_STEP, .h = (double)NAN, .steps = 1};
    kt_check_equal_int("a step of NaN", kt_batch_compute(batch, &job, &error), KT_ERROR_ARGUMENT);
    static const double torque[3 * KT_TREE_NV];
    const kt_batch_inputs inputs[] = {{0, 1, torque}, {1, 0, torque}, {1, 1, NULL}};
    for (size_t k = 0; k < sizeof inputs / sizeof *inputs; k++) {
        job = (kt_batch_job){.task = KT_BATCH_SEMI_IMPLICIT_STEP, .h = 0.1, .steps = 1, .inputs = &inputs[k]};
        kt_check_equal_int("inputs", kt_batch_compute(batch, &job, &error), KT_ERROR_ARGUMENT);
        kt_check_contains("where", error.where, "inputs");
    }
}

KT_TEST(wrong_arguments_are_rejected) {
    kt_random random = kt_random_of_test();
    kt_tree tree;
    kt_error error;
    kt_batch *batch = NULL;
    double q[KT_TREE_NQ] = {0.0};
    const kt_tree_plan plan = kt_tree_plan_planar();
    kt_tree_grow(&tree, &plan, &random);
    kt_batch_options options = kt_batch_options_default();
    kt_check_equal_int("one state", (long long)options.states, 1);
    options.states = 0;
    kt_check_equal_int("no states", kt_batch_create(tree.model, &options, &batch, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("bytes of none", (long long)kt_batch_size(tree.model, &options), 0);
    options.states = 3;
    options.method = kt_method_find("radau5");
    kt_check_equal_int("an implicit method", kt_batch_create(tree.model, &options, &batch, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("it is named", error.message, "radau5");
    options.method = NULL;
    kt_need(kt_check_equal_int("a batch", kt_batch_create(tree.model, &options, &batch, &error), KT_OK));
    kt_check_equal_int("a state that is not there", kt_batch_set_state(batch, 3, 0.0, q, NULL, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_equal_int("its status", kt_batch_status(batch, 3), KT_ERROR_ARGUMENT);
    kt_check_equal_int("no method", kt_batch_step(batch, 0.1, 1, &error), KT_ERROR_ARGUMENT);
    kt_batch_free(batch);
    options.method = kt_method_find("euler");
    kt_need(kt_check_equal_int("a batch", kt_batch_create(tree.model, &options, &batch, &error), KT_OK));
    kt_check_equal_int("a step of infinity", kt_batch_step(batch, (double)INFINITY, 1, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("less than no steps", kt_batch_step(batch, 0.1, -1, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("no steps", kt_batch_step(batch, 0.1, 0, &error), KT_OK);
    reject_jobs(batch);
    kt_batch_free(batch);
}
