/* Many states in lanes against the same states one by one: the ratio of states per second on one core. Both sides
 * compute the same states in turns in one run. Their results are compared first, bit by bit. A rollout of many states
 * on one thread is also compared with two threads, in wall-clock time. This comparison requires an otherwise idle
 * machine. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "../bench.h"
#include "../chain.h"
#include "../report.h"

#include "kinetree/batch.h"
#include "kinetree/loop.h"
#include "kinetree/sensitivity.h"
#include "kinetree/study.h"
#ifdef KT_SCENES
#include "kinetree/scene.h"
#endif
#ifdef KT_WITH_MUJOCO
#include "peer.h"
#endif

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { STATES = 64, GRADIENT_STEPS = 10 };

/* States of one model, state after state, and as a batch. */
typedef struct kt_states {
    kt_chain *chain;
    const kt_method *method;
    kt_batch *batch;
    double *q, *v, *tau, *a;
    double *next_q, *next_v;
    void *work;
    size_t work_size;
    kt_rollout_task *motions; /* from these states, without inputs; work memory of their gradients, and results */
    void *motion_work;
    size_t motion_work_size;
    double *gradients;
    bool failed;
} kt_states;

static double random_number(uint64_t *seed) {
    *seed = *seed * 6364136223846793005U + 1442695040888963407U;
    return (double)(*seed >> 11) / 4503599627370496.0 - 1.0;
}

/* The motions from all states by ten steps of 1 ms, and which numbers their gradients have. */
static bool prepare_motions(kt_states *s) {
    const size_t nq = (size_t)s->chain->nq, nv = (size_t)s->chain->n, numbers = (2 + GRADIENT_STEPS) * nv;
    const kt_rollout rollout = {.method = s->method, .h = 1e-3, .steps = GRADIENT_STEPS};
    s->motion_work_size = kt_rollout_gradients_work_size(s->chain->model, &rollout);
    s->motion_work =
        aligned_alloc(KT_ALIGNMENT, (s->motion_work_size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    s->motions = calloc(STATES, sizeof *s->motions);
    s->gradients = calloc(STATES * numbers, sizeof *s->gradients);
    for (size_t i = 0; i < STATES && s->motions && s->gradients; i++)
        s->motions[i] = (kt_rollout_task){.rollout = rollout,
                                          .q = s->q + i * nq,
                                          .v = s->v + i * nv,
                                          .by_start = s->gradients + i * numbers,
                                          .by_inputs = s->gradients + i * numbers + 2 * nv,
                                          .user = s->chain};
    return s->motion_work && s->motions && s->gradients;
}

/* States around the initial one, whose positions differ from it by up to `spread`. */
static bool prepare(kt_states *s, kt_chain *chain, double spread, kt_error *error) {
    const size_t nq = (size_t)chain->nq, nv = (size_t)chain->n;
    uint64_t seed = 1;
    *s = (kt_states){.chain = chain, .method = kt_method_find("rk4")};
    s->q = calloc(STATES * (nq + 3 * nv) + nq + nv, sizeof(double));
    s->v = s->q + STATES * nq;
    s->tau = s->v + STATES * nv;
    s->a = s->tau + STATES * nv;
    s->next_q = s->a + STATES * nv;
    s->next_v = s->next_q + nq;
    s->work_size = kt_step_work_size(chain->model, s->method);
    s->work = aligned_alloc(KT_ALIGNMENT, (s->work_size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    const kt_batch_options options = {.states = STATES, .method = s->method};
    kt_status status = kt_batch_create(chain->model, &options, &s->batch, error);
    for (size_t i = 0; i < STATES && status == KT_OK; i++) {
        double *step = s->next_v;
        for (size_t k = 0; k < nv; k++) {
            step[k] = spread * random_number(&seed);
            s->v[i * nv + k] = random_number(&seed);
            s->tau[i * nv + k] = random_number(&seed);
        }
        kt_position_add(chain->model, chain->q, step, s->q + i * nq);
        if (kt_loop_count(chain->model) > 0)
            status = kt_state_assemble(chain->model, chain->data, 0.0, s->q + i * nq, s->v + i * nv, error);
        if (status == KT_OK)
            status = kt_batch_set_state(s->batch, i, 0.0, s->q + i * nq, s->v + i * nv, error);
        if (status == KT_OK)
            status = kt_batch_set_torque(s->batch, i, s->tau + i * nv, error);
    }
    return status == KT_OK && prepare_motions(s);
}

static void release(kt_states *s) {
    kt_batch_free(s->batch);
    free(s->q);
    free(s->work);
    free(s->motions);
    free(s->motion_work);
    free(s->gradients);
}

/* ---- tasks: all states, once a repetition ------------------------------------------------------------------------ */

static void forward_alone(void *user, long repetitions) {
    kt_states *s = user;
    const size_t nq = (size_t)s->chain->nq, nv = (size_t)s->chain->n;
    for (; repetitions > 0; repetitions--)
        for (size_t i = 0; i < STATES; i++)
            s->failed |= kt_acceleration_evaluate(s->chain->model, s->chain->data, 0.0, s->q + i * nq, s->v + i * nv,
                                                  s->tau + i * nv, NULL, s->a + i * nv, NULL) != KT_OK;
}

static void forward_lanes(void *user, long repetitions) {
    kt_states *s = user;
    for (; repetitions > 0; repetitions--)
        s->failed |= kt_batch_forward(s->batch, NULL) != KT_OK;
}

static void inverse_alone(void *user, long repetitions) {
    kt_states *s = user;
    const size_t nq = (size_t)s->chain->nq, nv = (size_t)s->chain->n;
    for (; repetitions > 0; repetitions--)
        for (size_t i = 0; i < STATES; i++)
            s->failed |= kt_dynamics_inverse(s->chain->model, s->chain->data, s->q + i * nq, s->v + i * nv,
                                             s->a + i * nv, NULL, s->tau + i * nv, NULL) != KT_OK;
}

static void inverse_lanes(void *user, long repetitions) {
    kt_states *s = user;
    for (; repetitions > 0; repetitions--)
        s->failed |= kt_batch_inverse(s->batch, NULL) != KT_OK;
}

/* Steps of no length, so that the states stay. */
static void step_alone(void *user, long repetitions) {
    kt_states *s = user;
    const size_t nq = (size_t)s->chain->nq, nv = (size_t)s->chain->n;
    for (; repetitions > 0; repetitions--)
        for (size_t i = 0; i < STATES; i++) {
            const kt_step step = {.method = s->method, .h = 0.0, .tau = s->tau + i * nv};
            s->failed |= kt_step_evaluate(s->chain->model, s->chain->data, s->work, s->work_size, &step, s->q + i * nq,
                                          s->v + i * nv, s->next_q, s->next_v, NULL) != KT_OK;
        }
}

static void step_lanes(void *user, long repetitions) {
    kt_states *s = user;
    for (; repetitions > 0; repetitions--)
        s->failed |= kt_batch_step(s->batch, 0.0, 1, NULL) != KT_OK;
}

/* Half the squares of all velocities and inputs at every step. */
static int cost(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user) {
    const int n = ((const kt_chain *)user)->n;
    for (int i = 0; i < n; i++) {
        const double tau = at->tau ? at->tau[i] : 0.0;
        *value += 0.5 * (at->v[i] * at->v[i] + tau * tau);
        if (by_state)
            by_state[n + i] = at->v[i];
        if (by_tau)
            by_tau[i] = tau;
    }
    return 0;
}

static void gradient_alone(void *user, long repetitions) {
    kt_states *s = user;
    for (; repetitions > 0; repetitions--)
        for (size_t i = 0; i < STATES; i++) {
            kt_rollout_task *m = &s->motions[i];
            s->failed |=
                kt_rollout_gradient(s->chain->model, s->chain->data, s->motion_work, s->motion_work_size, &m->rollout,
                                    m->q, m->v, &m->value, m->by_start, m->by_inputs, cost, m->user, NULL) != KT_OK;
        }
}

static void gradient_lanes(void *user, long repetitions) {
    kt_states *s = user;
    for (; repetitions > 0; repetitions--)
        s->failed |= kt_rollout_gradients(s->chain->model, s->chain->data, s->motion_work, s->motion_work_size,
                                          s->motions, STATES, cost, NULL) != KT_OK;
}

typedef struct kt_pair {
    const char *name;
    void (*alone)(void *user, long repetitions);
    void (*lanes)(void *user, long repetitions);
    kt_status (*get)(const kt_batch *batch, size_t state, double *out, kt_error *error); /* NULL: no numbers of nv */
} kt_pair;

static const kt_pair pairs[] = {
    {"ABA", forward_alone, forward_lanes, kt_batch_get_acceleration},
    {"RNEA", inverse_alone, inverse_lanes, kt_batch_get_torque},
    {"rk4 step", step_alone, step_lanes, NULL},
    {"gradients", gradient_alone, gradient_lanes, NULL}, /* of motions of ten such steps */
};

/* To the bit. */
static bool agree(const double *a, const double *b, size_t n) { return memcmp(a, b, n * sizeof *a) == 0; }

static bool gradients_are_equal(kt_states *s) {
    const size_t numbers = STATES * (2 + GRADIENT_STEPS) * (size_t)s->chain->n;
    double *alone = malloc(numbers * sizeof *alone);
    if (!alone)
        return false;
    gradient_alone(s, 1);
    memcpy(alone, s->gradients, numbers * sizeof *alone);
    gradient_lanes(s, 1);
    const bool equal = agree(s->gradients, alone, numbers);
    free(alone);
    return equal && !s->failed;
}

static bool are_equal(kt_states *s, const kt_pair *pair, const double *alone) {
    const size_t nv = (size_t)s->chain->n;
    if (pair->alone == gradient_alone)
        return gradients_are_equal(s);
    pair->alone(s, 1);
    pair->lanes(s, 1);
    for (size_t i = 0; i < STATES && pair->get; i++)
        if (pair->get(s->batch, i, s->next_v, NULL) != KT_OK || !agree(s->next_v, alone + i * nv, nv))
            return false;
    return !s->failed;
}

/* ---- the table --------------------------------------------------------------------------------------------------- */

typedef struct kt_goal {
    double v4, v3; /* how many times as many states; 0: none */
} kt_goal;

/* Measures the pairs of one mechanism. Returns an exit status. */
static int measure(const char *name, kt_chain *chain, double spread, kt_goal goal, const kt_bench_options *options,
                   kt_csv *csv) {
    kt_states s;
    kt_error error;
    int status = KT_BENCH_DONE;
    if (!prepare(&s, chain, spread, &error))
        status = kt_bench_tell(&error);
    for (size_t p = 0; p < sizeof pairs / sizeof *pairs && status != KT_BENCH_FAILED; p++) {
        static kt_bench_times times[2];
        const char *why;
        if (pairs[p].alone == gradient_alone && kt_rollout_width(chain->model, &s.motions[0].rollout, &why) == 1) {
            printf("%-14s %-9s one by one: %s\n", name, pairs[p].name, why);
            continue;
        }
        const kt_bench_task tasks[2] = {{pairs[p].alone, &s}, {pairs[p].lanes, &s}};
        if (!are_equal(&s, &pairs[p], p == 1 ? s.tau : s.a)) {
            fprintf(stderr, "%s, %s: lanes and single states differ\n", name, pairs[p].name);
            status = KT_BENCH_FAILED;
            break;
        }
        kt_bench_measure(tasks, 2, options->seconds, times);
        const kt_bench_ratio ratio = kt_bench_compare(&times[0], &times[1]);
        const kt_isa isa = kt_model_isa(chain->model);
        const double least = isa == KT_ISA_V4 ? goal.v4 : isa == KT_ISA_V3 ? goal.v3 : 0.0;
        printf("%-14s %-9s %10.0f %10.0f %8.2f (%.2f to %.2f)%s\n", name, pairs[p].name, STATES / times[0].low,
               STATES / times[1].low, ratio.median, ratio.low, ratio.high,
               p < 2 && ratio.median < least ? "  missed" : "");
        if (options->check && p < 2 && ratio.median < least)
            status = KT_BENCH_MISSED;
        kt_csv_text(csv, name);
        kt_csv_text(csv, pairs[p].name);
        kt_csv_number(csv, STATES / times[0].low);
        kt_csv_number(csv, STATES / times[1].low);
        kt_csv_number(csv, ratio.median);
        kt_csv_origin(csv, isa);
        kt_csv_line(csv);
    }
    release(&s);
    return status;
}

/* A chain in a plane: the same links, all axes parallel. */
static kt_status make_planar(int n, kt_isa isa, kt_chain *chain, kt_error *error) {
    kt_chain_description d;
    kt_status status = kt_chain_describe(n, 1, &d, error);
    if (status != KT_OK)
        return status;
    for (int i = 0; i < n; i++)
        d.bodies[i].joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
    status = kt_chain_of(&d.description, isa, false, chain, error);
    kt_chain_describe_free(&d);
    return status;
}

/* A mechanism with its loops and effects, at its initial state. */
static kt_status compile_whole(const kt_description *description, kt_isa isa, kt_chain *chain, kt_error *error) {
    kt_model_options options = kt_model_options_default();
    options.isa = isa;
    *chain = (kt_chain){.n = 0};
    kt_status status = kt_model_compile(description, &options, &chain->model, error);
    if (status == KT_OK)
        status = kt_data_create(chain->model, &chain->data, error);
    if (status != KT_OK)
        return status;
    chain->n = kt_model_nv(chain->model);
    chain->nq = kt_model_nq(chain->model);
    chain->q = calloc((size_t)chain->nq, sizeof *chain->q);
    if (!chain->q)
        return KT_ERROR_MEMORY;
    kt_model_initial(chain->model, chain->q, NULL);
    return KT_OK;
}

#ifdef KT_SCENES
/* A bundled scene: of one without loops the tree alone. */
static kt_status make_scene(const char *name, kt_isa isa, kt_chain *chain, kt_error *error) {
    kt_scene scene;
    char path[1024];
    (void)snprintf(path, sizeof path, KT_SCENES "/%s.yaml", name);
    kt_status status = kt_scene_read(path, &scene, NULL, NULL, error);
    if (status != KT_OK)
        return status;
    status = scene.description.loop_count > 0 ? compile_whole(&scene.description, isa, chain, error)
                                              : kt_chain_of(&scene.description, isa, false, chain, error);
    kt_scene_free(&scene);
    return status;
}
#endif

/* ---- a quadruped ------------------------------------------------------------------------------------------------- */

enum { LEGS = 4, JOINTS = 3 * LEGS };

typedef struct kt_quadruped {
    kt_body body[1 + JOINTS];
    kt_effect effect[LEGS + 2 * JOINTS];
    char name[1 + JOINTS][16];
    kt_description description;
} kt_quadruped;

static kt_body *add_body(kt_quadruped *r, const char *parent, kt_joint_type type, kt_vec3 at) {
    kt_body *body = &r->body[r->description.body_count];
    *body = kt_body_default();
    (void)snprintf(r->name[r->description.body_count], sizeof *r->name, "b%d", (int)r->description.body_count);
    body->name = r->name[r->description.body_count++];
    body->parent = parent;
    body->joint.type = type;
    body->joint.at = at;
    return body;
}

static kt_effect *add_effect(kt_quadruped *r, kt_effect_type type) {
    kt_effect *effect = &r->effect[r->description.effect_count++];
    *effect = kt_effect_default();
    effect->type = type;
    return effect;
}

/* A hip that abducts, and a thigh and a shank that bend; the foot is a ball at the end of the shank. */
static void add_leg(kt_quadruped *r, double x, double y) {
    const kt_vec3 at[3] = {{x, y, 0.0}, {0.0, 0.0, -0.05}, {0.0, 0.0, -0.2}};
    static const double mass[] = {0.5, 0.8, 0.2}, rest[] = {0.0, 0.7, -1.4};
    const char *parent = r->name[0];
    for (int k = 0; k < 3; k++) {
        kt_body *body = add_body(r, parent, KT_JOINT_REVOLUTE, at[k]);
        body->joint.axis = k == 0 ? kt_vec3_make(1.0, 0.0, 0.0) : kt_vec3_make(0.0, 1.0, 0.0);
        body->joint.position[0] = rest[k];
        body->mass = mass[k];
        body->com = kt_vec3_make(0.0, 0.0, k == 0 ? 0.0 : -0.1);
        body->inertia = (kt_sym3){.xx = 2e-3, .yy = 2e-3, .zz = 1e-3};
        kt_effect *spring = add_effect(r, KT_EFFECT_JOINT_SPRING), *friction = add_effect(r, KT_EFFECT_JOINT_FRICTION);
        spring->joint = friction->joint = body->name;
        spring->stiffness = 40.0;
        spring->damping = 1.0;
        spring->rest = kt_function_constant(rest[k]);
        friction->coulomb = 0.1;
        friction->viscous = 0.02;
        friction->smoothing = 0.05;
        parent = body->name;
    }
    kt_effect *foot = add_effect(r, KT_EFFECT_CONTACT);
    foot->between[0] = (kt_end){.body = parent, .at = {0.0, 0.0, -0.2}};
    foot->radius = 0.02;
    foot->stiffness = 1e4;
    foot->exponent = 1.5;
    foot->dissipation = 0.3;
    foot->friction = 0.8;
    foot->slip = 0.01;
}

/* Compiles a description that a quadruped has been given. */
static kt_status compile(kt_quadruped *r, kt_isa isa, kt_chain *chain, kt_error *error) {
    r->description.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    r->description.bodies = r->body;
    r->description.effects = r->effect;
    return compile_whole(&r->description, isa, chain, error);
}

/* A leg in a plane: a thigh and a rod behind it, both on the trunk, move a shank. */
static void add_linkage(kt_quadruped *r, kt_loop *loop, double x) {
    static const double mass[] = {0.8, 0.3, 0.1}, length[] = {0.2, 0.25, 0.19};
    const kt_vec3 at[3] = {{x, 0.0, 0.0}, {0.0, 0.0, -length[0]}, {x - 0.05, 0.0, -0.03}};
    const char *parent = r->name[0];
    for (int k = 0; k < 3; k++) {
        kt_body *body = add_body(r, k == 1 ? parent : r->name[0], KT_JOINT_REVOLUTE, at[k]);
        body->joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
        body->mass = mass[k];
        body->com = kt_vec3_make(0.0, 0.0, -0.5 * length[k]);
        body->inertia = (kt_sym3){.xx = 2e-3, .yy = 2e-3, .zz = 1e-3};
        parent = body->name;
    }
    *loop = kt_loop_default();
    loop->name = parent;
    loop->type = KT_LOOP_REVOLUTE;
    loop->axis = kt_vec3_make(0.0, 1.0, 0.0);
    loop->between[0] = (kt_end){.body = r->body[r->description.body_count - 2].name, .at = {-0.06, 0.0, -0.02}};
    loop->between[1] = (kt_end){.body = parent, .at = {0.0, 0.0, -length[2]}};
}

/* A machine that walks in a plane on four-bars. */
static kt_status make_walker(kt_isa isa, kt_chain *chain, kt_error *error) {
    kt_quadruped r = {.description = kt_description_default()};
    kt_loop loop[LEGS];
    kt_body *trunk = add_body(&r, NULL, KT_JOINT_PLANAR, (kt_vec3){0.0, 0.0, 0.0});
    trunk->joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
    trunk->mass = 6.0;
    trunk->inertia = (kt_sym3){.xx = 0.02, .yy = 0.06, .zz = 0.07};
    for (int leg = 0; leg < LEGS; leg++)
        add_linkage(&r, &loop[leg], 0.2 * leg - 0.3);
    r.description.loops = loop;
    r.description.loop_count = LEGS;
    return compile(&r, isa, chain, error);
}

/* Effects of a quadruped at rest on its feet: contact and friction of the feet, springs and friction in the joints. */
static kt_status make_quadruped(kt_isa isa, kt_chain *chain, kt_error *error) {
    kt_quadruped r = {.description = kt_description_default()};
    kt_body *trunk = add_body(&r, NULL, KT_JOINT_FREE, (kt_vec3){0.0, 0.0, 0.0});
    trunk->joint.position[2] = 0.38;
    trunk->mass = 6.0;
    trunk->inertia = (kt_sym3){.xx = 0.02, .yy = 0.06, .zz = 0.07};
    for (int leg = 0; leg < LEGS; leg++)
        add_leg(&r, leg < 2 ? 0.2 : -0.2, leg % 2 ? 0.1 : -0.1);
    return compile(&r, isa, chain, error);
}

/* ---- threads ----------------------------------------------------------------------------------------------------- */

enum { CROWD = 1024 };
static const double threads_goal = 1.9; /* times as fast by two */

static double wall_clock(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Steps of no length, as many as last some 50 ms by one thread; in turns by one and two. */
static bool time_threads(kt_batch *batch, double seconds, kt_bench_times times[2]) {
    kt_batch_job job = {.task = KT_BATCH_STEP, .h = 0.0, .steps = 1};
    double lasts = 0.0;
    for (; lasts < 0.05 && lasts < seconds; job.steps *= 2) {
        const double start = wall_clock();
        if (kt_batch_run(batch, &job, 1, NULL, NULL) != KT_OK)
            return false;
        lasts = wall_clock() - start;
    }
    const double most = fmin(KT_BENCH_ROUNDS_MOST, seconds / (1.5 * lasts));
    const int rounds = (int)fmax(KT_BENCH_ROUNDS_LEAST, most);
    for (int i = 0; i < 2 * rounds; i++) {
        const int k = (i + i / 2) % 2;
        const double start = wall_clock();
        if (kt_batch_run(batch, &job, 1 + (size_t)k, NULL, NULL) != KT_OK)
            return false;
        times[k].sample[i / 2] = (wall_clock() - start) / job.steps;
    }
    for (int k = 0; k < 2; k++) {
        times[k].rounds = rounds;
        times[k].repetitions = job.steps;
        kt_bench_sort(&times[k]);
    }
    return true;
}

static int measure_threads(const kt_bench_options *options, kt_csv *csv) {
    static kt_bench_times times[2];
    kt_chain chain;
    kt_error error;
    kt_batch *batch = NULL;
    const kt_batch_options many = {.states = CROWD, .threads = 2, .method = kt_method_find("rk4")};
    int status = KT_BENCH_FAILED;
    if (make_quadruped(options->isa, &chain, &error) != KT_OK)
        return kt_bench_tell(&error);
    if (kt_batch_create(chain.model, &many, &batch, &error) != KT_OK)
        status = kt_bench_tell(&error);
    else if (time_threads(batch, options->seconds, times)) {
        const kt_bench_ratio ratio = kt_bench_compare(&times[0], &times[1]);
        const bool missed = ratio.median < threads_goal;
        printf("%-14s %-9s %10.0f %10.0f %8.2f (%.2f to %.2f)%s   1 and 2 threads, seconds of the wall\n", "quadruped",
               "rk4 step", CROWD / times[0].low, CROWD / times[1].low, ratio.median, ratio.low, ratio.high,
               missed ? "  missed" : "");
        status = options->check && missed ? KT_BENCH_MISSED : KT_BENCH_DONE;
        kt_csv_text(csv, "quadruped");
        kt_csv_text(csv, "rk4 step by two threads");
        kt_csv_number(csv, CROWD / times[0].low);
        kt_csv_number(csv, CROWD / times[1].low);
        kt_csv_number(csv, ratio.median);
        kt_csv_origin(csv, kt_model_isa(chain.model));
        kt_csv_line(csv);
    }
    kt_batch_free(batch);
    kt_chain_free(&chain);
    return status;
}

static int run(const kt_bench_options *options, kt_csv *csv) {
    static const struct {
        const char *name;
        kt_goal goal;
        const char *scene; /* NULL: made here */
    } cases[] = {{"chain of 32", {4.0, 2.2}, NULL},
                 {"planar of 128", {4.0, 2.0}, NULL},
                 {"quadruped", {3.0, 1.8}, NULL},
                 {"four-bar legs", {3.0, 0.0}, NULL},
                 {"humanoid", {3.5, 2.0}, "humanoid"},
                 {"arm of 7", {0.0, 0.0}, "arm7"},
                 {"stewart", {1.2, 0.0}, "stewart"},       /* in space, on the ground */
                 {"bricard", {1.2, 0.0}, "bricard"},       /* with redundant equations */
                 {"swashplate", {1.2, 0.0}, "swashplate"}, /* driven */
                 {"rope", {1.2, 1.2}, "rope"}};            /* in a plane, a hundred links and three equations */
    int worst = KT_BENCH_DONE;
    for (int i = 0; i < (int)(sizeof cases / sizeof *cases); i++) {
        kt_chain chain;
        kt_error error;
        kt_status made = KT_OK;
        double spread = 0.5;
        if (i == 0)
            made = kt_chain_make(32, options->isa, false, &chain, &error);
        else if (i == 1)
            made = make_planar(128, options->isa, &chain, &error);
        else if (i == 2)
            made = make_quadruped(options->isa, &chain, &error);
        else if (i == 3)
            made = make_walker(options->isa, &chain, &error);
        else {
#ifdef KT_SCENES
            made = make_scene(cases[i].scene, options->isa, &chain, &error);
            spread = made == KT_OK && kt_loop_count(chain.model) > 0 ? 0.02 : spread;
#else
            continue;
#endif
        }
        if (made != KT_OK)
            return kt_bench_tell(&error);
        const int status = measure(cases[i].name, &chain, spread, cases[i].goal, options, csv);
        worst = status > worst ? status : worst;
        kt_chain_free(&chain);
    }
#ifdef KT_WITH_MUJOCO
    const int peer = kt_measure_peer(STATES, options, csv);
    worst = peer > worst ? peer : worst;
#endif
    const int status = measure_threads(options, csv);
    return status > worst ? status : worst;
}

int main(int argc, char **argv) {
    kt_bench_options options = {.seconds = 2.0, .isa = KT_ISA_AUTO};
    kt_csv csv;
    const int status =
        kt_bench_read(argc, argv,
                      "States a second of one core: one by one, and as a batch in lanes; the ratio of the "
                      "two, with its quartiles. The last line: by one thread, and by two.\n--check compares them with "
                      "what is promised.",
                      &options);
    if (status >= 0)
        return status;
    kt_bench_heading("many states at once", options.isa, options.csv);
    if (!kt_csv_open(&csv, options.csv, "mechanism,task,alone_per_s,lanes_per_s,ratio," KT_CSV_ORIGIN))
        return KT_BENCH_FAILED;
    printf("%-14s %-9s %10s %10s %8s\n", "", "", "alone/s", "lanes/s", "ratio");
    const int worst = run(&options, &csv);
    return kt_csv_close(&csv) ? worst : KT_BENCH_FAILED;
}
