/* Simulations that run at once have the bits of those that run alone: all records, counts, final states, and the errors
 * of those that fail. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "load.h"
#include "many.h"
#include "mechanics/dynamics/tree.h"

#include "dynamics/dynamics.h"
#include "kinetree/batch.h"
#include "kinetree/ensemble.h"
#include "kinetree/study.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TREES = 24, MEMBERS = 11, TEXT = 256 };

/* The results of a simulation. */
typedef struct outcome {
    uint64_t hash; /* of the bits of all records, and of the last state */
    uint64_t records, events;
    kt_simulation_counts counts;
    kt_status status;
    char text[TEXT];
} outcome;

/* Auxiliary states, of which the second follows from the motion. */
enum { OWN = 2 };
static const kt_auxiliary_state auxiliary_state[OWN] = {
    {.name = "lag", .initial = 0.5, .rate = "sin(t) - lag^2"},
    {.name = "seen", .initial = -0.2, .rate = "lag*seen - t + marker.b0.tip.vx"}};

typedef struct member {
    kt_model *model; /* of its own, or NULL */
    kt_simulation *simulation;
    outcome outcome;
    uint64_t stop; /* its recorder stops at this record; 0: never */
    bool pushes;   /* its recorder sets a torque in between */
    bool sets;     /* its recorder sets the gravity of its own model in between */
    int number;
} member;

static void add_bytes(uint64_t *hash, const void *bytes, size_t count) {
    const unsigned char *at = bytes;
    for (size_t i = 0; i < count; i++)
        *hash = (*hash ^ at[i]) * 1099511628211u;
}

static void add_numbers(uint64_t *hash, const double *x, size_t count) { add_bytes(hash, x, count * sizeof *x); }

static kt_status set_gravity(member *m) {
    static const double gravity[] = {1.0, -2.0, 3.0};
    kt_parameter parameter;
    const kt_status status = kt_parameter_find(m->model, "gravity", &parameter, NULL);
    return status == KT_OK ? kt_simulation_set_parameter(m->simulation, m->model, &parameter, gravity, NULL) : status;
}

static int take(const kt_record *record, void *user) {
    member *m = user;
    const double numbers[] = {record->t, record->kinetic, record->potential};
    static const double push[KT_TREE_NV] = {0.5, -0.5, 0.25};
    add_numbers(&m->outcome.hash, numbers, 3);
    add_numbers(&m->outcome.hash, record->q, (size_t)kt_model_nq(record->model));
    add_numbers(&m->outcome.hash, record->v, (size_t)kt_model_nv(record->model));
    add_numbers(&m->outcome.hash, record->x, (size_t)kt_auxiliary_state_count(record->model));
    m->outcome.records++;
    if (m->pushes && m->outcome.records == 5 && kt_simulation_set_torque(m->simulation, push, NULL) != KT_OK)
        return -1;
    if (m->sets && m->outcome.records == 5 && set_gravity(m) != KT_OK)
        return -1;
    return m->stop > 0 && m->outcome.records == m->stop ? -1 : 0;
}

static void end(member *m, const kt_model *model, kt_status status, const kt_error *error) {
    const uint64_t events[] = {kt_simulation_event_count(m->simulation, "swing"),
                               kt_simulation_event_count(m->simulation, "turn")};
    m->outcome.events = events[0] + events[1];
    add_bytes(&m->outcome.hash, events, sizeof events);
    add_numbers(&m->outcome.hash, kt_simulation_auxiliary_states(m->simulation),
                (size_t)kt_auxiliary_state_count(model));
    m->outcome.status = status;
    m->outcome.counts = kt_simulation_counts_of(m->simulation);
    if (status != KT_OK)
        (void)snprintf(m->outcome.text, TEXT, "%.100s: %.150s", error->where, error->message);
    add_numbers(&m->outcome.hash, kt_simulation_positions(m->simulation), (size_t)kt_model_nq(model));
    add_numbers(&m->outcome.hash, kt_simulation_velocities(m->simulation), (size_t)kt_model_nv(model));
    kt_simulation_free(m->simulation);
    m->simulation = NULL;
}

/* ---- events ------------------------------------------------------------------------------------------------------ */

static int swing(const kt_instant *at, double *value, kt_error *error, void *user) {
    const member *m = user;
    (void)error;
    *value = sin(80.0 * at->t + m->number) + 0.1 * at->v[0];
    return 0;
}

/* Half of the velocities are left, and of the auxiliary states; or another gravity; or the run ends, or fails. */
static int act(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    member *m = user;
    double v[KT_TREE_NV], x[2];
    const kt_model *model = kt_simulation_model(simulation);
    for (int i = 0; i < kt_model_nv(model); i++)
        v[i] = 0.5 * kt_simulation_velocities(simulation)[i];
    for (int i = 0; i < kt_auxiliary_state_count(model); i++)
        x[i] = 0.5 * kt_simulation_auxiliary_states(simulation)[i];
    if (m->number % 5 == 1)
        return kt_simulation_jump(simulation, NULL, v, error) != KT_OK;
    if (m->number % 5 == 2 && m->model)
        return set_gravity(m) == KT_OK ? 0 : -1;
    if (m->number % 5 == 3 && kt_auxiliary_state_count(model) > 0)
        return kt_simulation_set_auxiliary_states(simulation, x, error) != KT_OK;
    return m->number % 5 == 4 && what->count == 3 ? -1 : 0;
}

static int turn(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error, (void)user;
    *value = at->v[kt_model_nv(at->model) - 1] + (kt_auxiliary_state_count(at->model) > 0 ? at->x[0] : 0.0);
    return 0;
}

static bool add_events(member *m) {
    const kt_event events[] = {{.name = "swing", .function = swing, .action = act, .user = m, .record = true},
                               {.name = "turn", .function = turn, .user = m, .stop = m->number % 5 == 0}};
    kt_error error;
    return kt_simulation_event_add(m->simulation, &events[0], &error) == KT_OK &&
           kt_simulation_event_add(m->simulation, &events[1], &error) == KT_OK;
}

/* ---- one case ---------------------------------------------------------------------------------------------------- */

typedef struct group {
    kt_tree tree;
    kt_run run;
    kt_tree_state state[MEMBERS];
    member alone[MEMBERS], together[MEMBERS];
    int next, asked;
    kt_isa isa;
    bool own_models;  /* each simulation has a model of its own, compiled of the same description */
    bool varies;      /* but for masses, lengths and gravity */
    bool varies_more; /* and armature */
    bool has_events;
} group;

/* Changes the data in which member i differs. */
static void vary(group *g, int i) {
    kt_body *body = g->tree.body;
    const double scale = 1.0 + 0.1 * (double)i;
    body->mass *= scale;
    body->com = kt_vec3_scale(scale, body->com);
    g->tree.description.gravity = kt_vec3_scale(scale, g->tree.description.gravity);
    for (int k = 0; k < g->tree.description.body_count; k++) {
        body[k].joint.at = kt_vec3_scale(scale, body[k].joint.at);
        for (int dof = 0; g->varies_more && dof < KT_JOINT_NV_MAX; dof++)
            body[k].joint.armature[dof] = 1.0 + scale;
    }
}

/* A model of member i. */
static const kt_model *compile(group *g, int i, member *m) {
    static kt_body kept[KT_TREE_BODIES];
    const kt_vec3 gravity = g->tree.description.gravity;
    kt_error error;
    if (!g->own_models)
        return g->tree.model;
    memcpy(kept, g->tree.body, sizeof kept);
    if (g->varies)
        vary(g, i);
    const kt_status status =
        kt_model_compile(&g->tree.description, &(kt_model_options){.isa = g->isa, .settable = true}, &m->model, &error);
    memcpy(g->tree.body, kept, sizeof kept);
    g->tree.description.gravity = gravity;
    return status == KT_OK ? m->model : NULL;
}

/* Member i: the same motion every time. Some fail, stop or last longer than others. */
static bool start(group *g, int i, member *m) {
    kt_error error;
    kt_run run = g->run;
    kt_simulation_options options = kt_simulation_options_default();
    *m = (member){.stop = i % 7 == 6 ? 4 : 0, .pushes = i % 7 == 5, .number = i};
    run.duration *= 1.0 + 0.1 * (double)(i % 4);
    options.max_steps = i % 7 == 4 ? 20 : 0;
    options.record = i % 2 ? KT_RECORD_ENERGY : 0;
    options.events = g->has_events ? 2 : 0;
    const kt_model *model = compile(g, i, m);
    m->sets = m->model && i % 7 == 3;
    return model && kt_simulation_create(model, &run, &options, &m->simulation, &error) == KT_OK &&
           (!g->has_events || add_events(m)) &&
           kt_simulation_set_state(m->simulation, 0.0, g->state[i].q, g->state[i].v, &error) == KT_OK;
}

static bool next(void *user, bool may_block, kt_ensemble_member *to) {
    group *g = user;
    if (g->next == MEMBERS || (!may_block && g->asked++ % 4 == 3)) /* sometimes there is none yet */
        return false;
    member *m = &g->together[g->next];
    if (!start(g, g->next++, m))
        return false;
    *to = (kt_ensemble_member){.simulation = m->simulation, .record = take, .user = m};
    return true;
}

static void done(void *user, const kt_ensemble_member *of, kt_status status, const kt_error *error) {
    const group *g = user;
    end(of->user, g->tree.model, status, error);
}

static bool run_alone(group *g) {
    for (int i = 0; i < MEMBERS; i++) {
        member *m = &g->alone[i];
        kt_error error = {0};
        if (!start(g, i, m))
            return false;
        const kt_status status = kt_simulation_run(m->simulation, take, m, &error);
        end(m, g->tree.model, status, &error);
        kt_model_free(m->model);
    }
    return true;
}

/* *share: of the tries of steps of simulations in lanes, the part that was in lanes. */
static bool run_together(group *g, kt_ensemble_report *sum, double *share) {
    kt_error error;
    kt_ensemble *ensemble = NULL;
    g->next = 0;
    bool fine = kt_ensemble_create(g->tree.model, &ensemble, &error) == KT_OK;
    for (int i = 0; i < 2 * MEMBERS && fine && g->next < MEMBERS; i++)
        fine = kt_ensemble_run(ensemble, next, done, g, &error) == KT_OK;
    const kt_ensemble_report report = kt_ensemble_report_of(ensemble);
    sum->together += report.together;
    sum->alone += report.alone;
    *share += (double)report.in_lanes / (double)(report.in_lanes + report.left + 1);
    kt_ensemble_free(ensemble);
    for (int i = 0; i < MEMBERS; i++)
        kt_model_free(g->together[i].model);
    return fine;
}

static int count_different(const group *g) {
    int different = 0;
    for (int i = 0; i < MEMBERS; i++) {
        const outcome *a = &g->alone[i].outcome, *b = &g->together[i].outcome;
        const bool same = a->hash == b->hash && a->records == b->records && a->status == b->status &&
                          strcmp(a->text, b->text) == 0 && a->counts.steps == b->counts.steps &&
                          a->counts.rejected == b->counts.rejected && a->counts.evaluations == b->counts.evaluations;
        different += !same;
        if (!same)
            kt_note("member %d: %llu and %llu records, %s and %s", i, (unsigned long long)a->records,
                    (unsigned long long)b->records, a->text, b->text);
    }
    return different;
}

/* ---- trees ------------------------------------------------------------------------------------------------------- */

static void draw(group *g, int n, kt_random *random) {
    static const char *const methods[] = {"dopri5", "auto", "tsit5", "rk4", "dop853", "bs32"};
    kt_tree_plan plan = n % 2 ? kt_tree_plan_default() : kt_tree_plan_planar();
    static kt_load_list loads;
    plan.bodies = kt_random_int(random, 1, 5);
    plan.with_armature = n % 3 == 2 ? 0.5 : 0.0;
    kt_tree_describe(&g->tree, &plan, random);
    if (n % 6 < 2) {
        g->tree.description.states = auxiliary_state;
        g->tree.description.state_count = OWN;
    }
    if (n % 4 == 3)
        kt_load_add(&loads, &g->tree, n % 8 == 7, random);
    else if (n % 4 == 1)
        kt_load_add_formulas(&loads, &g->tree, random);
    g->run = kt_run_default();
    g->run.integrator = methods[n % 6];
    g->run.step = n % 6 == 3 ? 0.01 : 0.0;
    g->run.duration = 0.12;
    g->run.interval = 0.007;
    g->run.relative = g->run.absolute = n % 5 ? 1e-7 : 1e-3;
    g->own_models = n % 3 == 0 || n % 4 == 1;
    g->varies = n % 4 < 2;
    g->has_events = n % 5 < 3;
}

static void compare(kt_isa isa, const char *name) {
    kt_random random = kt_random_of_test();
    kt_ensemble_report sum = {.width = 0};
    static group g;
    int different = 0, failed = 0;
    uint64_t events = 0;
    double share = 0.0;
    bool fine = true;
    for (int n = 0; n < TREES && fine; n++) {
        memset(&g, 0, sizeof g);
        draw(&g, n, &random);
        g.isa = isa;
        kt_tree_compile(&g.tree, &(kt_model_options){.isa = isa});
        for (int i = 0; i < MEMBERS; i++)
            kt_tree_state_draw(&g.tree, &random, &g.state[i]);
        fine = fine && run_alone(&g) && run_together(&g, &sum, &share);
        for (int i = 0; i < MEMBERS; i++) {
            failed += g.alone[i].outcome.status != KT_OK;
            events += g.alone[i].outcome.events;
        }
        different += count_different(&g);
    }
    kt_note("%s: %llu simulations in lanes, %llu alone, %d of them failed", name, (unsigned long long)sum.together,
            (unsigned long long)sum.alone, failed);
    kt_check_true("simulations run", fine);
    kt_check_equal_int("simulations", (long long)sum.together + (long long)sum.alone, TREES * MEMBERS);
    kt_check_above("simulations in lanes", (double)sum.together, 0.85 * TREES * MEMBERS);
    kt_check_above("part of the tries of steps in lanes, on the average", share / TREES, 0.6);
    kt_check_above("events", (double)events, 1.5 * TREES * MEMBERS);
    kt_check_above("simulations that fail", failed, 0.05 * TREES * MEMBERS);
    kt_check_equal_int("simulations that differ", different, 0);
}

static void compare_isa(kt_isa isa, const char *name) {
    if (kt_isa_resolve(isa) != isa)
        kt_skip(name, KT_NO_ISA);
    else
        compare(isa, name);
}

KT_TEST(simulations_at_once_have_the_bits_of_single_ones) { compare(KT_ISA_AUTO, "auto"); }
KT_TEST(simulations_at_once_have_the_bits_of_single_ones_on_v3) { compare_isa(KT_ISA_V3, "v3"); }
KT_TEST(simulations_at_once_have_the_bits_of_single_ones_on_the_baseline) { compare_isa(KT_ISA_BASE, "baseline"); }

KT_TEST(simulations_of_other_armature_run_alone) {
    kt_random random = kt_random_of_test();
    kt_ensemble_report sum = {.width = 0};
    double share = 0.0;
    static group g;
    memset(&g, 0, sizeof g);
    draw(&g, 0, &random);
    g.own_models = g.varies_more = g.varies = true;
    kt_tree_compile(&g.tree, NULL);
    for (int i = 0; i < MEMBERS; i++)
        kt_tree_state_draw(&g.tree, &random, &g.state[i]);
    kt_check_true("simulations run", run_alone(&g) && run_together(&g, &sum, &share));
    kt_check_above("simulations alone", (double)sum.alone, 0.5);
    kt_check_equal_int("simulations that differ", count_different(&g), 0);
}

KT_TEST(an_ensemble_works_in_the_memory_of_the_caller) {
    static _Alignas(KT_ALIGNMENT) char memory[1 << 20];
    kt_random random = kt_random_of_test();
    kt_tree tree;
    kt_error error;
    kt_ensemble *ensemble = NULL;
    kt_tree_plan plan = kt_tree_plan_default();
    kt_tree_grow(&tree, &plan, &random);
    const size_t size = kt_ensemble_size(tree.model);
    memset(memory, 0xFF, sizeof memory);
    kt_need(kt_check_below("bytes of an ensemble", (double)size, (double)sizeof memory));
    kt_check_equal_int("status", kt_ensemble_init(tree.model, memory, size, &ensemble, &error), KT_OK);
    kt_ensemble_free(ensemble); /* does nothing */
    kt_check_equal_int("one byte less", kt_ensemble_init(tree.model, memory, size - 1, &ensemble, &error),
                       KT_ERROR_MEMORY);
}

/* ---- gradients --------------------------------------------------------------------------------------------------- */

enum { MOTIONS = 9, STEPS = 6, THREADS = 3 };
enum { SIDE_MOST = 2 * KT_TREE_NV + OWN, NUMBERS_MOST = SIDE_MOST * (SIDE_MOST + KT_TREE_NV) + OWN };

typedef struct gradient {
    double weight;
    int nv;
    double inputs[STEPS * KT_TREE_NV], by_start[SIDE_MOST], by_inputs[STEPS * KT_TREE_NV];
} gradient;

/* The sum of squares of velocities, times the weight of the motion. */
/* NOLINTNEXTLINE(readability-non-const-parameter): as the callback has it */
static int cost(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user) {
    const gradient *g = user;
    (void)by_tau;
    for (int i = 0; i < g->nv; i++) {
        *value += g->weight * at->v[i] * at->v[i];
        if (by_state)
            by_state[g->nv + i] += 2.0 * g->weight * at->v[i];
    }
    return 0;
}

static kt_tree_state motion_state[MOTIONS];
static gradient motion[MOTIONS];

/* All motions, the third of which begins nowhere. */
static void set_tasks(const kt_tree *tree, kt_rollout_task *tasks) {
    for (int i = 0; i < MOTIONS; i++) {
        gradient *g = &motion[i];
        *g = (gradient){.weight = 1.0 + i, .nv = tree->nv};
        for (int k = 0; k < STEPS * tree->nv; k++)
            g->inputs[k] = 0.1 * (k % 7) - 0.05 * i;
        tasks[i] = (kt_rollout_task){
            .rollout = {.method = kt_method_find("rk4"), .h = 0.01, .steps = STEPS, .inputs = g->inputs},
            .q = motion_state[i].q,
            .v = motion_state[i].v,
            .by_start = g->by_start,
            .by_inputs = g->by_inputs,
            .user = g};
    }
}

static uint64_t hash_of(const kt_tree *tree, const kt_rollout_task *tasks) {
    uint64_t hash = 0;
    for (int i = 0; i < MOTIONS; i++) {
        add_numbers(&hash, &tasks[i].value, 1);
        add_numbers(&hash, motion[i].by_start, 2 * (size_t)tree->nv + OWN);
        add_numbers(&hash, motion[i].by_inputs, STEPS * (size_t)tree->nv);
        hash += (uint64_t)tasks[i].status;
    }
    return hash;
}

/* The first step of motion i, every other of which begins at auxiliary states that are not the initial ones. Results:
 * A, B and the auxiliary states. */
static kt_step_task step_task(const kt_tree *tree, int i, double *results) {
    static const double x[OWN] = {0.75, 0.25};
    const size_t side = 2 * (size_t)tree->nv + OWN;
    return (kt_step_task){
        .step = {.method = kt_method_find("rk4"), .h = 0.01, .tau = motion[i].inputs},
        .q = motion_state[i].q,
        .v = motion_state[i].v,
        .x = i % 2 ? x : NULL,
        .A = results,
        .B = results + side * side,
        .next_x = results + side * (side + (size_t)tree->nv),
    };
}

static kt_status step_alone(const kt_tree *tree, kt_data *data, void *work, size_t size, const kt_step_task *task) {
    double *x = kt_auxiliary_states(tree->model, data);
    if (task->x)
        memcpy(x, task->x, OWN * sizeof *x);
    else
        kt_auxiliary_states_initial(tree->model, x);
    const kt_status status = kt_step_derivatives(tree->model, data, work, size, &task->step, task->q, task->v, NULL,
                                                 NULL, task->A, task->B, NULL);
    if (status == KT_OK)
        memcpy(task->next_x, x, OWN * sizeof *x);
    return status;
}

/* Derivatives of the first steps of all motions, of which the third fails, by several threads against one by one. */
static void compare_steps(const kt_tree *tree, kt_data *const *data, void *const *work, size_t size) {
    static double alone[MOTIONS][NUMBERS_MOST], seen[MOTIONS][NUMBERS_MOST];
    const size_t side = 2 * (size_t)tree->nv + OWN, count = side * (side + (size_t)tree->nv) + OWN;
    kt_step_task tasks[MOTIONS];
    kt_error error;
    kt_status first = KT_OK;
    for (int i = 0; i < MOTIONS; i++) {
        const kt_step_task task = step_task(tree, i, alone[i]);
        const kt_status status = step_alone(tree, data[0], work[0], size, &task);
        first = first == KT_OK ? status : first;
        tasks[i] = step_task(tree, i, seen[i]);
    }
    for (size_t threads = 1; threads <= THREADS; threads++) {
        int different = 0;
        memset(seen, 0, sizeof seen);
        kt_check_equal_int("the third step fails",
                           kt_step_run(tree->model, data, work, size, threads, tasks, MOTIONS, NULL, &error), first);
        for (int i = 0; i < MOTIONS; i++)
            different +=
                memcmp(seen[i], alone[i], count * sizeof(double)) != 0 || (tasks[i].status != KT_OK) != (i == 2);
        kt_check_equal_int("derivatives or auxiliary states that differ", different, 0);
    }
    kt_check_equal_int("no thread of steps",
                       kt_step_run(tree->model, data, work, size, 0, tasks, MOTIONS, NULL, &error), KT_ERROR_ARGUMENT);
}

KT_TEST(gradients_and_derivatives_by_several_threads_have_the_bits_of_single_ones) {
    kt_random random = kt_random_of_test();
    static kt_tree tree;
    static kt_rollout_task tasks[MOTIONS];
    kt_data *data[THREADS] = {NULL};
    void *work[THREADS] = {NULL};
    kt_error error;
    const kt_tree_plan plan = kt_tree_plan_default();
    kt_tree_describe(&tree, &plan, &random);
    tree.description.states = auxiliary_state;
    tree.description.state_count = OWN;
    kt_tree_compile(&tree, NULL);
    for (int i = 0; i < MOTIONS; i++)
        kt_tree_state_draw(&tree, &random, &motion_state[i]);
    motion_state[2].v[0] = (double)NAN;
    set_tasks(&tree, tasks);
    const size_t size = kt_rollout_work_size(tree.model, &tasks[0].rollout);
    for (int i = 0; i < THREADS; i++) {
        work[i] = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
        data[i] = kt_test_data(tree.model);
    }
    for (int i = 0; i < MOTIONS; i++)
        tasks[i].status =
            kt_rollout_gradient(tree.model, data[0], work[0], size, &tasks[i].rollout, tasks[i].q, tasks[i].v,
                                &tasks[i].value, tasks[i].by_start, tasks[i].by_inputs, cost, tasks[i].user, NULL);
    const uint64_t alone = hash_of(&tree, tasks);
    for (size_t threads = 1; threads <= THREADS; threads++) {
        size_t used = 0;
        set_tasks(&tree, tasks);
        const kt_status status =
            kt_rollout_run(tree.model, data, work, size, threads, tasks, MOTIONS, cost, &used, &error);
        kt_check_equal_int("the third fails", status, tasks[2].status);
        kt_check_true("alone", status != KT_OK && tasks[1].status == KT_OK && tasks[3].status == KT_OK);
        kt_check_equal_int("bits differ", hash_of(&tree, tasks) != alone, 0);
    }
    kt_check_equal_int("no thread", kt_rollout_run(tree.model, data, work, size, 0, tasks, MOTIONS, cost, NULL, &error),
                       KT_ERROR_ARGUMENT);
    compare_steps(&tree, data, work, size);
    for (int i = 0; i < THREADS; i++) {
        free(work[i]);
    }
}
