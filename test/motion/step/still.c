/* After set-up, no system call is made and nothing is allocated. The test takes a thousand steps with torques, sensors
 * and checkpoints of the four mechanisms of bench/realtime. Every tenth step calls the functions for control laws
 * (control.h) and the regressor (identification.h). Every hundredth step calls derivatives of steps and gradients
 * (sensitivity.h), and sets new numbers of a parameter. Linux' strict seccomp ends the process at any system call but
 * read, write, exit and sigreturn.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "files/scene/collect.h"
#include "motion/simulation/scenes.h"

#include "interpose.h"
#include "kinetree/control.h"
#include "kinetree/identification.h"
#include "kinetree/scene.h"
#include "kinetree/sensitivity.h"
#include "leg.h"

#include <errno.h>
#include <linux/seccomp.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

enum { STEPS = 1000, JOINTS = 64 };

/* The report of the stepping process, written in one piece, which a pipe keeps whole. */
typedef struct report {
    int status, steps;
    long allocations;
    double furthest; /* how far a coordinate came from its start */
    bool confined;
    char words[160];
} report;

static kt_status make_model(const char *name, kt_model **model, kt_error *error) {
    kt_scene scene;
    kt_status status = name != NULL ? kt_scene_read(kt_bundled_path(name), &scene, NULL, NULL, error)
                                    : kt_scene_parse("leg", kt_leg, strlen(kt_leg), &scene, NULL, NULL, error);
    if (status != KT_OK)
        return status;
    status = kt_model_compile(&scene.description, NULL, model, error);
    kt_scene_free(&scene);
    return status;
}

/* ---- control.h --------------------------------------------------------------------------------------------------- */

/* Objects and memory for its calls. */
typedef struct controls {
    const kt_model *model;
    kt_data *data;
    kt_mass_inverse *inverse;
    void *work, *derivative_work, *step_work, *parameter_work, *base_work;
    size_t size, derivative_size, step_size, parameter_size, base_size;
    kt_parameter parameter;          /* mass of the last body */
    kt_model *copy;                  /* on which the simulation runs */
    double *matrix, *other, *vector; /* 6 nv and nv^2; nv^2; 4 nv */
    double *tangents;                /* A, B, a state after a step, gradients, C: 6 nv^2 + (9 + AHEAD) nv + nq */
    double *regressor, *relation;    /* nv columns and, of small models, columns^2 */
    int *order;                      /* columns */
    int index[JOINTS];
} controls;

enum { SMALL = 10 /* no base parameters of larger models: columns^3 takes seconds */ };

static void *memory_of(size_t size) {
    return aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
}

enum { AHEAD = 5 /* steps of a gradient */ };

static kt_rollout ahead_of(double t) {
    return (kt_rollout){.method = kt_method_find("rk4"), .t = t, .h = 1e-3, .steps = AHEAD, .checkpoints = 2};
}

static kt_status make_controls(const kt_model *model, controls *c, kt_error *error) {
    const size_t nv = (size_t)kt_model_nv(model), square = (nv + 6) * (nv + 6) * sizeof(double);
    *c = (controls){
        .model = model, .size = kt_actuation_work_size(model), .derivative_size = kt_dynamics_work_size(model)};
    c->work = memory_of(c->size);
    c->derivative_work = memory_of(c->derivative_size);
    c->matrix = memory_of(square);
    c->other = memory_of(square);
    c->vector = memory_of(4 * nv * sizeof(double));
    for (int i = 0; i < JOINTS; i++)
        c->index[i] = i;
    const kt_rollout rollout = ahead_of(0.0);
    c->step_size = kt_rollout_work_size(model, &rollout);
    c->step_work = memory_of(c->step_size);
    c->tangents = memory_of((6 * nv * nv + (9 + AHEAD) * nv + (size_t)kt_model_nq(model)) * sizeof(double));
    c->parameter_size = kt_step_parameter_work_size(model, rollout.method);
    c->parameter_work = memory_of(c->parameter_size);
    const size_t columns = (size_t)kt_regressor_columns(model), pairs = nv <= SMALL ? columns * columns : 1;
    c->base_size = nv <= SMALL ? kt_base_parameters_work_size(model) : 1;
    c->base_work = memory_of(c->base_size);
    c->regressor = memory_of(nv * columns * sizeof(double));
    c->relation = memory_of(pairs * sizeof(double));
    c->order = memory_of(columns * sizeof(int));
    char name[128];
    (void)snprintf(name, sizeof name, "%s.mass", kt_body_name(model, kt_model_body_count(model) - 1));
    kt_status status = kt_parameter_find(model, name, &c->parameter, error);
    if (status == KT_OK)
        status = kt_data_create(model, &c->data, error);
    return status == KT_OK ? kt_mass_inverse_create(model, 1, &c->inverse, error) : status;
}

/* Coordinates that are independent: of a tree all, of the leg those of its motors, which come first. */
static kt_coordinate_list independent_of(controls *c) {
    return (kt_coordinate_list){c->index, kt_model_mobility(c->model).minimal};
}

/* Every call of the header. */
static kt_status ask(controls *c, double t, const double *q, const double *v, kt_error *error) {
    const kt_model *model = c->model;
    const int nv = kt_model_nv(model), body = kt_model_body_count(model) - 1;
    const kt_vec3 at = {0.1, 0.0, 0.2};
    double *rates = c->vector, *a = rates + nv, *forces = a + nv, *row = forces + nv, inertia;
    const kt_coordinate_list list = independent_of(c), all = {c->index, nv};
    kt_status status = kt_kinematics_update(model, c->data, q, v, NULL, error);
    if (status != KT_OK)
        return status;
    for (int frame = KT_TWIST_ALIGNED; frame <= KT_TWIST_WORLD; frame++) {
        kt_frame_jacobian(model, c->data, body, at, (kt_twist_frame)frame, c->matrix);
        a[0] = kt_frame_bias(model, c->data, body, at, (kt_twist_frame)frame).linear.x;
    }
    for (int i = 0; i < nv; i++)
        row[i] = c->matrix[6 * i + 3] + c->matrix[6 * i];
    kt_mass_center_jacobian(model, c->data, c->other);
    kt_centroidal_matrix(model, c->data, c->other);
    a[0] += kt_mass_center_bias(model, c->data).x + kt_centroidal_bias(model, c->data).force.x;
    status = kt_coriolis_evaluate(model, c->data, c->derivative_work, c->derivative_size, q, v, c->other, error);
    if (status == KT_OK)
        status = kt_mass_inverse_compute(c->inverse, c->data, t, q, error);
    memcpy(rates, v, (size_t)nv * sizeof *rates);
    if (status == KT_OK)
        status = kt_mass_inverse_apply(c->inverse, 1, rates, error);
    if (status == KT_OK)
        status = kt_operational_inertia(c->inverse, 1, row, &inertia, a, NULL, error);
    if (status == KT_OK)
        status = kt_independent_basis(model, c->data, c->work, c->size, t, q, list, c->matrix, NULL, error);
    kt_loop_jacobian(model, 1, row, list.count, c->matrix, forces);
    memcpy(rates, v, (size_t)nv * sizeof *rates);
    if (status == KT_OK)
        status = kt_velocity_complete(model, c->data, c->work, c->size, t, q, list, rates, error);
    if (status == KT_OK)
        status = kt_acceleration_complete(model, c->data, c->work, c->size, t, q, v, list, a, error);
    if (status == KT_OK)
        status =
            kt_actuation_evaluate(model, c->data, c->work, c->size, t, q, v, a, NULL, all, NULL, forces, NULL, error);
    return status;
}

/* Every call of identification.h. */
static kt_status identify(controls *c, bool first, const double *q, const double *v, kt_error *error) {
    char words[200];
    int rank = 0;
    kt_status status = kt_regressor_evaluate(c->model, c->data, q, v, v, c->regressor, error);
    if (status != KT_OK || !first || kt_model_nv(c->model) > SMALL)
        return status;
    kt_regressor_parameters(c->model, c->regressor);
    status =
        kt_base_parameters_find(c->model, c->data, c->base_work, c->base_size, &rank, c->order, c->relation, error);
    for (int i = 0; i < rank; i++)
        (void)kt_base_parameter_name(c->model, rank, c->order, c->relation, i, words, sizeof words);
    return status;
}

/* Half |v|^2 at all points. */
static int kinetic(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user) {
    const int nv = *(const int *)user;
    (void)by_tau;
    for (int i = 0; i < nv; i++) {
        *value += 0.5 * at->v[i] * at->v[i];
        if (by_state != NULL)
            by_state[nv + i] = at->v[i];
    }
    return 0;
}

/* Every call of sensitivity.h. */
static kt_status differentiate(controls *c, double t, const double *q, const double *v, kt_error *error) {
    const kt_model *model = c->model;
    const kt_rollout rollout = ahead_of(t);
    const kt_step step = {.method = rollout.method, .t = t, .h = rollout.h};
    int nv = kt_model_nv(model);
    double *A = c->tangents, *B = A + 4 * nv * nv, *by_state = B + 2 * nv * nv, *by_tau = by_state + 2 * nv;
    double *by_inputs = by_tau + nv, *C = by_inputs + AHEAD * nv, *next_v = C + 2 * nv, *next_q = next_v + nv, value;
    kt_status status = kt_step_evaluate(model, c->data, c->step_work, c->step_size, &step, q, v, next_q, next_v, error);
    if (status == KT_OK)
        status =
            kt_step_derivatives(model, c->data, c->step_work, c->step_size, &step, q, v, next_q, next_v, A, B, error);
    if (status == KT_OK)
        status = kt_step_adjoint(model, c->data, c->step_work, c->step_size, &step, q, v, A, by_state, by_tau, error);
    if (status == KT_OK)
        status = kt_rollout_gradient(model, c->data, c->step_work, c->step_size, &rollout, q, v, &value, by_state,
                                     by_inputs, kinetic, &nv, error);
    if (status == KT_OK)
        status = kt_step_parameter_derivatives(model, c->data, c->parameter_work, c->parameter_size, &step,
                                               &c->parameter, q, v, C, error);
    return status;
}

/* A mass that grows by a thousandth. */
static kt_status set_parameter(kt_simulation *simulation, controls *c, kt_error *error) {
    double mass;
    char name[128];
    (void)snprintf(name, sizeof name, "%s.mass", kt_body_name(c->model, kt_model_body_count(c->model) - 1));
    kt_status status = kt_parameter_find(c->model, name, &c->parameter, error);
    if (status == KT_OK)
        status = kt_parameter_get(c->copy, &c->parameter, &mass, error);
    if (status != KT_OK)
        return status;
    mass *= 1.001;
    return kt_simulation_set_parameter(simulation, c->copy, &c->parameter, &mass, error);
}

/* A step of a control loop: torques from measurements, the step, sensors, a checkpoint. */
static kt_status take_step(kt_simulation *simulation, controls *asked, int nv, int k, void *block, kt_error *error) {
    double torque[JOINTS];
    kt_record record;
    const double *v = kt_simulation_velocities(simulation);
    for (int i = 0; i < nv; i++)
        torque[i] = 1e-2 * sin(0.1 * k + i) - 1e-3 * v[i];
    kt_status status = kt_simulation_set_torque(simulation, torque, error);
    if (status == KT_OK && k % 10 == 0)
        status = ask(asked, kt_simulation_time(simulation), kt_simulation_positions(simulation), v, error);
    if (status == KT_OK && k % 10 == 0)
        status = identify(asked, k == 0, kt_simulation_positions(simulation), v, error);
    if (status == KT_OK && k % 100 == 0)
        status = differentiate(asked, kt_simulation_time(simulation), kt_simulation_positions(simulation), v, error);
    if (status == KT_OK && k % 100 == 50)
        status = set_parameter(simulation, asked, error);
    if (status == KT_OK)
        status = kt_simulation_advance(simulation, 1e-3 * (k + 1), error);
    if (status == KT_OK)
        status = kt_simulation_sense(simulation, &record, error);
    if (status == KT_OK)
        kt_simulation_save(simulation, block);
    return status;
}

/* In a process of its own: never returns. */
static void step_confined(const char *file, bool disturbed, int out) {
    report r = {.status = KT_OK};
    kt_error error = {0};
    kt_model *model = NULL, *copy = NULL;
    kt_simulation *simulation = NULL;
    kt_run run = kt_run_fixed("rk4", 1e-3, 1.0);
    run.record = KT_RECORD_ACCELERATION | KT_RECORD_REACTION | KT_RECORD_CONSTRAINT;
    r.status = (int)make_model(file, &model, &error);
    if (r.status == KT_OK)
        r.status = (int)kt_model_copy(model, memory_of(kt_model_size(model)), kt_model_size(model), &copy, &error);
    if (r.status == KT_OK)
        r.status = (int)kt_simulation_create(copy, &run, NULL, &simulation, &error);
    controls asked = {.model = NULL};
    if (r.status == KT_OK)
        r.status = (int)make_controls(copy, &asked, &error);
    asked.copy = copy;
    void *block = r.status == KT_OK ? malloc(kt_simulation_state_size(simulation)) : NULL;
    const int nv = r.status == KT_OK ? kt_model_nv(model) : 0;
    if (block == NULL || nv > JOINTS)
        _exit(1);
    double start[2 * JOINTS];
    memcpy(start, kt_simulation_positions(simulation), (size_t)nv * sizeof *start);
    kt_interpose_start();
    r.confined = prctl(PR_SET_SECCOMP, SECCOMP_MODE_STRICT) == 0;
    for (; r.status == KT_OK && r.steps < STEPS; r.steps++) {
        r.status = (int)take_step(simulation, &asked, nv, r.steps, block, &error);
        if (disturbed && r.steps == STEPS / 2)
            (void)syscall(SYS_getppid);
    }
    r.allocations = kt_interpose_stop();
    for (int i = 0; i < nv; i++)
        r.furthest = fmax(r.furthest, fabs(kt_simulation_positions(simulation)[i] - start[i]));
    snprintf(r.words, sizeof r.words, "%.60s: %.90s", error.where, error.message);
    (void)!write(out, &r, sizeof r);
    (void)syscall(SYS_exit, 0); /* _exit would call exit_group */
}

/* Returns the status of the child, as from wait. */
static int run_confined(const char *file, bool disturbed, report *r) {
    int ends[2], status = -1;
    *r = (report){.status = -1};
    if (pipe(ends) != 0)
        return -1;
    const pid_t child = fork();
    if (child == 0)
        step_confined(file, disturbed, ends[1]);
    (void)close(ends[1]);
    if (child < 0 || read(ends[0], r, sizeof *r) != (ssize_t)sizeof *r)
        *r = (report){.status = -1};
    (void)close(ends[0]);
    while (child > 0 && waitpid(child, &status, 0) < 0 && errno == EINTR)
        ;
    return status;
}

KT_TEST(thousand_steps_ask_nothing_of_the_system) {
    static const char *const files[] = {"cart-pole", "arm7", "humanoid", NULL};
    for (int i = 0; i < 4; i++) {
        report r;
        const int ended = run_confined(files[i], false, &r);
        kt_note("%s: %s", files[i] != NULL ? files[i] : "leg", r.words);
        kt_check_true("ended by itself", WIFEXITED(ended) && WEXITSTATUS(ended) == 0);
        kt_check_true("confined", r.confined);
        kt_check_equal_int("status", r.status, KT_OK);
        kt_check_equal_int("steps", r.steps, STEPS);
        kt_check_equal_int("allocations", r.allocations, 0);
        kt_check_above("moved, rad or m", r.furthest, 0.5);
    }
}

/* That one call among the steps would have been seen. */
KT_TEST(one_system_call_among_the_steps_ends_them) {
    report r;
    const int ended = run_confined("cart-pole", true, &r);
    kt_check_true("killed", WIFSIGNALED(ended) && WTERMSIG(ended) == SIGKILL);
    kt_check_equal_int("no report", r.status, -1);
}
