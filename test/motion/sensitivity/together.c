/* Gradients of many motions at once have the same bits as the same motions computed alone. The test has random trees in
 * space and in planes, with armature and effects in joints, on every instruction set, with any other motions. Motions
 * that lanes do not compute are reported and computed alone. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "interpose.h"
#include "mechanics/dynamics/tree.h"

#include "dynamics/dynamics.h"
#include "kinetree/batch.h"
#include "kinetree/sensitivity.h"
#include "kinetree/study.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOTIONS = 11, STEPS = 7, BODIES = 8, NV = 6 * BODIES, THREADS = 3 };

typedef struct motion {
    kt_tree_state state;
    double inputs[STEPS * NV], weight;
    int nq, nv, stops; /* the cost stops at this step; -1: not */
    double value, by_start[2 * NV], by_inputs[STEPS * NV];
} motion;

static motion motions[MOTIONS];

/* Weighted squares of velocities and inputs, and at the end of positions that are plain numbers. */
static int cost(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user) {
    const motion *m = user;
    for (int i = 0; i < m->nv; i++) {
        const double tau = at->tau ? at->tau[i] : 0.0, weight = m->weight + 0.1 * i;
        *value += 0.5 * weight * (at->v[i] * at->v[i] + 0.01 * tau * tau);
        if (at->step == STEPS && m->nq == m->nv)
            *value += 0.5 * at->q[i] * at->q[i];
        if (by_state)
            by_state[m->nv + i] = weight * at->v[i];
        if (by_state && at->step == STEPS && m->nq == m->nv)
            by_state[i] = at->q[i];
        if (by_tau)
            by_tau[i] = 0.01 * weight * tau;
    }
    return at->step == m->stops ? 3 : 0;
}

/* Springs, dampers, friction and stops in joints. */
static void add_effects(kt_tree *tree, kt_effect *effect) {
    static const kt_effect_type types[] = {KT_EFFECT_JOINT_SPRING, KT_EFFECT_JOINT_FRICTION, KT_EFFECT_JOINT_LIMIT};
    kt_description *d = &tree->description;
    for (int i = 0; i < (int)d->body_count && d->effect_count < 6; i++) {
        const kt_joint_type joint = d->bodies[i].joint.type;
        if (joint != KT_JOINT_REVOLUTE && joint != KT_JOINT_PRISMATIC)
            continue;
        kt_effect *e = &effect[d->effect_count];
        *e = kt_effect_of(types[d->effect_count++ % 3], d->bodies[i].name);
        e->stiffness = 1.5;
        e->damping = 0.3;
        e->rest = kt_function_sine(0.2, 0.3, 1.1, 0.4);
        e->coulomb = 0.4;
        e->viscous = 0.1;
        e->smoothing = 0.2;
        e->lower = -0.3;
        e->upper = 0.2;
    }
    d->effects = effect;
}

static kt_tree_plan draw_plan(int n, kt_random *random) {
    kt_tree_plan plan = n % 3 == 0 ? kt_tree_plan_default() : kt_tree_plan_planar();
    plan.bodies = kt_random_int(random, 1, BODIES);
    plan.massless = false;
    if (n % 3 == 2) /* some trees in planes, some in space */
        plan.planar = 2;
    if (n % 3 == 2)
        plan.from_world = 0.4;
    plan.floats = n % 6 == 3;
    plan.with_armature = n % 2 ? 0.5 : 0.0;
    return plan;
}

static void set_tasks(const kt_tree *tree, const kt_rollout *like, kt_rollout_task *tasks, kt_random *random) {
    for (int i = 0; i < MOTIONS; i++) {
        motion *m = &motions[i];
        kt_tree_state_draw(tree, random, &m->state);
        for (int k = 0; k < STEPS * tree->nv; k++)
            m->inputs[k] = kt_random_normal(random);
        m->weight = 1.0 + i;
        m->nq = tree->nq;
        m->nv = tree->nv;
        m->stops = -1;
        tasks[i] = (kt_rollout_task){.rollout = *like,
                                     .q = m->state.q,
                                     .v = i == 4 ? NULL : m->state.v,
                                     .by_start = m->by_start,
                                     .by_inputs = i == 5 ? NULL : m->by_inputs,
                                     .user = m};
        tasks[i].rollout.inputs = i == 6 ? NULL : m->inputs;
        tasks[i].rollout.t = 0.1 * i;
        tasks[i].rollout.h = 0.004 + 0.001 * (i % 3);
    }
}

static bool differ(const double *a, const double *b, size_t n) { return memcmp(a, b, n * sizeof *a) != 0; }

/* Counts the motions that differ from a run on their own, in a bit, in their status, or in the results of a failed run.
 */
static int count_different(const kt_model *model, kt_data *data, void *work, size_t size,
                           const kt_rollout_task *tasks) {
    static motion before;
    int different = 0;
    for (int i = 0; i < MOTIONS; i++) {
        kt_rollout_task alone = tasks[i];
        motion *m = &motions[i];
        before = *m;
        for (int k = 0; k < 2 * m->nv; k++)
            m->by_start[k] = 7.0;
        for (int k = 0; k < STEPS * m->nv; k++)
            m->by_inputs[k] = 7.0;
        const kt_status status =
            kt_rollout_gradient(alone.model ? alone.model : model, data, work, size, &alone.rollout, alone.q, alone.v,
                                &alone.value, alone.by_start, alone.by_inputs, cost, alone.user, NULL);
        different += status != tasks[i].status || (status == KT_OK && differ(&alone.value, &tasks[i].value, 1)) ||
                     differ(before.by_start, m->by_start, 2 * (size_t)m->nv) ||
                     differ(before.by_inputs, m->by_inputs, (size_t)STEPS * (size_t)m->nv);
    }
    return different;
}

/* Sets all results to 7, as before every call of count_different. Results that are not written stay 7. */
static void clear_results(void) {
    for (int i = 0; i < MOTIONS; i++) {
        for (int k = 0; k < 2 * NV; k++)
            motions[i].by_start[k] = 7.0;
        for (int k = 0; k < STEPS * NV; k++)
            motions[i].by_inputs[k] = 7.0;
    }
}

static void *take(size_t size) {
    return aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
}

static kt_status set_parameter(kt_model *copy, const char *name, const double *numbers) {
    kt_parameter parameter;
    const kt_status status = kt_parameter_find(copy, name, &parameter, NULL);
    return status == KT_OK ? kt_parameter_set(copy, &parameter, numbers, NULL) : status;
}

/* Copies of the model with other masses and gravity, for every second motion. */
static bool vary(const kt_tree *tree, kt_rollout_task *tasks, void **copies, kt_random *random) {
    for (int i = 0; i < MOTIONS; i += 2) {
        kt_model *copy = NULL;
        const double gravity[3] = {kt_random_normal(random), 1.0, -9.0 - i}, mass = kt_random_uniform(random, 0.9, 1.1);
        char name[64];
        copies[i] = take(kt_model_size(tree->model));
        if (kt_model_copy(tree->model, copies[i], kt_model_size(tree->model), &copy, NULL) != KT_OK ||
            set_parameter(copy, "gravity", gravity) != KT_OK)
            return kt_check_true("a copy with other parameters is made", false);
        (void)snprintf(name, sizeof name, "%s.mass", kt_body_name(copy, 1));
        if (set_parameter(copy, name, &mass) != KT_OK)
            return kt_check_true("a mass is set", false);
        tasks[i].model = copy;
    }
    return true;
}

/* A motion that begins nowhere, one whose cost stops, and one that overflows. */
static void spoil(kt_rollout_task *tasks) {
    motions[1].state.v[0] = (double)NAN;
    motions[2].stops = 3;
    motions[7].state.v[motions[7].nv - 1] = 1e200;
    tasks[9].rollout.h = (double)INFINITY;
}

static void compare(kt_isa isa, int trees) {
    kt_random random = kt_random_of_test();
    int different = 0, failed = 0, together = 0, motion_count = 0;
    static kt_tree tree;
    static kt_effect effect[6];
    for (int n = 0; n < trees; n++) {
        kt_rollout_task tasks[MOTIONS];
        void *copies[MOTIONS] = {NULL};
        const kt_tree_plan plan = draw_plan(n, &random);
        const kt_rollout like = {.method = kt_method_find(n % 2 ? "dopri5" : "rk4"),
                                 .steps = STEPS,
                                 .checkpoints = (int[]){0, 2, 1, 4}[n % 4]};
        kt_tree_describe(&tree, &plan, &random);
        if (n % 5 > 1)
            add_effects(&tree, effect);
        kt_tree_compile(&tree, &(kt_model_options){.isa = isa});
        set_tasks(&tree, &like, tasks, &random);
        if (n % 4 == 3 && !vary(&tree, tasks, copies, &random))
            return;
        if (n % 7 == 6 && tree.nv > 0)
            spoil(tasks);
        const size_t size = kt_rollout_gradients_work_size(tree.model, &like);
        void *work = take(size);
        clear_results();
        failed += kt_rollout_gradients(tree.model, tree.data, work, size, tasks, MOTIONS, cost, NULL) != KT_OK;
        different += count_different(tree.model, tree.data, work, size, tasks);
        for (int i = 0; i < MOTIONS; i++, motion_count++)
            together += tasks[i].in_lanes;
        for (int i = 0; i < MOTIONS; i++)
            free(copies[i]);
        free(work);
    }
    kt_note("%d of %d motions in lanes", together, motion_count);
    kt_check_equal_int("motions that differ", different, 0);
    kt_check_equal_int("calls that fail", failed, trees / 7);
    kt_check_above("motions in lanes", together,
                   0.8 * motion_count); /* but spoilt ones, and the last one of two lanes */
}

KT_TEST(gradients_of_many_motions_have_the_bits_of_each) { compare(KT_ISA_AUTO, 56); }
KT_TEST(baseline_instruction_set) { compare(KT_ISA_BASE, 21); }
KT_TEST(v3_instruction_set) {
    if (kt_isa_resolve(KT_ISA_V3) == KT_ISA_V3)
        compare(KT_ISA_V3, 21);
    else
        kt_skip("v3", KT_NO_ISA);
}

/* A tree with other effects, other methods, or less memory: motions are computed one by one, and the reason is
 * reported. */
KT_TEST(what_lanes_do_not_compute_is_told) {
    kt_random random = kt_random_of_test();
    static kt_tree tree;
    kt_rollout_task tasks[MOTIONS];
    kt_effect spring = kt_effect_default();
    const char *why = "";
    kt_tree_plan plan = kt_tree_plan_default();
    plan.bodies = 4;
    plan.massless = false;
    kt_tree_describe(&tree, &plan, &random);
    spring.type = KT_EFFECT_SPRING;
    spring.between[0].body = tree.name[2];
    spring.stiffness = 1.0;
    tree.description.effects = &spring;
    tree.description.effect_count = 1;
    kt_tree_compile(&tree, NULL);
    const kt_rollout like = {.method = kt_method_find("rk4"), .steps = STEPS};
    set_tasks(&tree, &like, tasks, &random);
    kt_check_equal_int("width", (int)kt_rollout_width(tree.model, &like, &why), 1);
    kt_check_contains("why", why, "effects that act on bodies");
    const size_t size = kt_rollout_gradients_work_size(tree.model, &like);
    kt_check_equal_int("work", size == kt_rollout_work_size(tree.model, &like), 1);
    void *work = take(size);
    clear_results();
    kt_check_equal_int("status", kt_rollout_gradients(tree.model, tree.data, work, size, tasks, MOTIONS, cost, NULL),
                       KT_OK);
    kt_check_true("alone", !tasks[0].in_lanes);
    kt_check_equal_int("differ", count_different(tree.model, tree.data, work, size, tasks), 0);
    free(work);
}

/* Motions whose models have another shape than the one for which memory and data are: each is rejected. */
KT_TEST(models_of_another_shape_are_rejected) {
    kt_random random = kt_random_of_test();
    static kt_tree tree, larger;
    kt_rollout_task tasks[MOTIONS];
    kt_tree_plan plan = kt_tree_plan_default();
    plan.massless = false;
    plan.bodies = 3;
    kt_tree_grow(&tree, &plan, &random);
    plan.bodies = BODIES;
    kt_tree_grow(&larger, &plan, &random);
    const kt_rollout like = {.method = kt_method_find("rk4"), .steps = STEPS};
    const size_t sizes[] = {kt_rollout_gradients_work_size(tree.model, &like),
                            kt_rollout_gradients_work_size(larger.model, &like)};
    void *work = take(sizes[1]);
    set_tasks(&larger, &like, tasks, &random);
    for (int i = 0; i < MOTIONS; i++)
        tasks[i].model = larger.model;
    for (int k = 0; k < 2; k++) {
        clear_results();
        kt_check_equal_int("status",
                           kt_rollout_gradients(tree.model, tree.data, work, sizes[k], tasks, MOTIONS, cost, NULL),
                           KT_ERROR_ARGUMENT);
        kt_check_true("alone", !tasks[0].in_lanes);
        kt_check_equal_int("differ", count_different(tree.model, tree.data, work, sizes[k], tasks), 0);
    }
    free(work);
}

/* With several threads, each takes whole groups. The bytes are the same, and nothing is allocated. */
KT_TEST(threads_take_groups_of_motions) {
    kt_random random = kt_random_of_test();
    static kt_tree tree;
    kt_rollout_task tasks[MOTIONS];
    kt_data *data[THREADS] = {NULL};
    void *work[THREADS] = {NULL};
    kt_error error;
    kt_tree_plan plan = kt_tree_plan_default();
    plan.bodies = BODIES;
    plan.massless = false;
    kt_tree_grow(&tree, &plan, &random);
    const kt_rollout like = {.method = kt_method_find("rk4"), .steps = STEPS};
    const size_t size = kt_rollout_gradients_work_size(tree.model, &like);
    set_tasks(&tree, &like, tasks, &random);
    for (int i = 0; i < THREADS; i++) {
        work[i] = take(size);
        data[i] = kt_test_data(tree.model);
    }
    clear_results();
    kt_interpose_start();
    const kt_status status = kt_rollout_gradients(tree.model, data[0], work[0], size, tasks, MOTIONS, cost, &error);
    kt_check_equal_int("allocations", (int)kt_interpose_stop(), 0);
    kt_fine("one thread", status, &error);
    for (size_t threads = 1; threads <= THREADS; threads++) {
        clear_results();
        kt_fine("threads", kt_rollout_run(tree.model, data, work, size, threads, tasks, MOTIONS, cost, NULL, &error),
                &error);
        kt_check_true("in lanes", tasks[0].in_lanes);
        kt_check_equal_int("differ", count_different(tree.model, data[0], work[0], size, tasks), 0);
    }
    for (int i = 0; i < THREADS; i++) {
        free(work[i]);
    }
}
