/* Every public function with hostile arguments, one wrong at a time (hostile.py writes the calls). The function does
 * not crash. No call succeeds with a number that is not finite, and a call that fails leaves its outputs as they were.
 * Each function runs in a process of its own, on a tree, on a driven four-bar, and on a model without a joint. The
 * sanitizers find the faults that do not crash. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "sanitized.h"

#include "kinetree/experimental.h"
#include "kinetree/kinetree.h"

#include <limits.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { NUMBERS = 4096, OUTPUTS = 6, MOST = 32, LATER = 256 };
#define MEMORY ((size_t)1 << 20)

typedef struct fixture {
    const char *function, *what;
    int failed;
    kt_model *model, *copy, *other_model;
    const kt_model *switched;
    kt_impact impact;
    kt_data *data, *other_data;
    int bodies, dofs;
    double any[NUMBERS], q[NUMBERS], v[NUMBERS], y[NUMBERS], history[NUMBERS], identity[NUMBERS], bad[NUMBERS];
    double q_out[NUMBERS], v_out[NUMBERS], values[8];
    double out[OUTPUTS][NUMBERS], before[OUTPUTS][NUMBERS], q_before[NUMBERS], v_before[NUMBERS];
    int index[MOST], bad_index[MOST], ints[NUMBERS], column[NUMBERS];
    char text[64];
    void *memory, *block, *object;
    bool flag;
    kt_error error;
    kt_wrench wrench[64];
    kt_reaction_share share[64];
    kt_vec3 vector;
    kt_mat3 matrix, no_matrix;
    kt_sym3 inertia, no_inertia;
    kt_complex complex;
    kt_rotation rotation;
    const kt_method *method;
    kt_method table;
    kt_stability stability, stability_out;
    kt_run run;
    kt_simulation_options simulation_options;
    kt_simulation *simulation;
    kt_integrator *integrator;
    kt_integrator_options integrator_options;
    kt_integrator_callbacks callbacks;
    kt_integrator_memory integrator_memory;
    kt_mass_factor *factor;
    kt_mass_inverse *inverse;
    kt_linearization *linearization;
    const kt_linear_system *system;
    kt_modes *modes;
    kt_spectrum *spectrum;
    kt_mode_watch *watch;
    kt_energy_watch energy;
    kt_record record;
    kt_parameter parameter, other_parameter, no_parameter, parameter_out;
    kt_residual residual;
    kt_power power;
    kt_effect_load load;
    kt_contact_load touch;
    kt_initial_change changes[64];
    kt_equilibrium equilibrium;
    kt_step step;
    kt_rollout rollout;
    kt_description description;
    kt_body body;
    kt_graph_joint graph_joint;
    kt_graph_choice choice;
    kt_loop loop;
    kt_effect effect;
    kt_beam beam;
    kt_link_tree tree;
    kt_builder *builder;
    kt_scene scene;
    kt_mechanism mechanism;
    FILE *stream;
    kt_absolute *absolute;
    kt_absolute_motion *absolute_motion;
    kt_constraint_formulation *formulation;
    kt_constraint_formulation_options formulation_options;
    kt_dae *dae;
    kt_dae_options dae_options;
    kt_floquet *floquet;
    kt_floquet_options floquet_options;
    kt_batch *batch;
    kt_ensemble *ensemble;
    kt_data *data_list[2], *other_list[2];
    void *memory_list[2], *no_list[2];
    kt_rollout_task task, bad_task;
    kt_step_task step_task, bad_step_task;
    kt_batch_job job, bad_job;
    kt_batch_inputs bad_inputs; /* no samples */
    kt_function of_time, bad_of_time;
    kt_symbols symbols, bad_symbols;
    kt_loop_motion loop_motion;
    kt_scene_options scene_options, bad_scene_options;
    kt_scene_call scene_call;
    kt_native native;
    kt_simulation_options native_options;
    kt_scene_watch *scene_watch;
    kt_parameter_change parameter_changes[2];
    kt_event event, bad_event;
    kt_accuracy_baseline baseline;
    size_t used;
    double no_numbers[NUMBERS];
    kt_batch_options batch_options;
    kt_batch_frame frame;
    kt_frame_motion frame_motion[3];
    kt_batch_sensors sensors;
    ptrdiff_t place;
    kt_plan_step steps[256];
    const double *slope;
    kt_variant variant;
    kt_accuracy_point point;
    kt_variable variable, variable_out;
    double formula_memory[64];
    const kt_expression *formula, *formula_out;
    void *later_block;
    double later_before[LATER], later_after[LATER];
} fixture;

typedef struct call {
    const char *name;
    void (*run)(fixture *f);
} call;

/* ---- judging ----------------------------------------------------------------------------------------------------- */

static void begin(fixture *f, const char *what) {
    f->what = what;
    for (int i = 0; i < OUTPUTS; i++)
        for (int k = 0; k < NUMBERS; k++)
            f->out[i][k] = f->before[i][k] = 7.0 + i;
    for (int k = 0; k < NUMBERS; k++) {
        f->q_out[k] = f->q[k];
        f->v_out[k] = f->v[k];
    }
    memset(&f->error, 0, sizeof f->error);
    memset(&f->residual, 0, sizeof f->residual);
    memset(&f->power, 0, sizeof f->power);
    memset(f->wrench, 0, sizeof f->wrench);
    f->object = NULL;
    f->switched = f->model;
}

static void spoil(fixture *f, const double *from, int place, double x) {
    memcpy(f->bad, from, sizeof f->bad);
    f->bad[place] = x;
}

static void complain(fixture *f, const char *problem) {
    (void)printf("  %s: %s: %s\n", f->function, f->what, problem);
    (void)fflush(stdout);
    f->failed++;
}

static bool all_finite(const double *x, size_t n) {
    for (size_t i = 0; i < n; i++)
        if (!isfinite(x[i]))
            return false;
    return true;
}

/* Later results of the same objects: a short run of the simulation, which is undone, and the accelerations. The states
 * of the batch and of the integrator are results, too. A rejected call changes none of these. */
static void find_later(fixture *f, double *out) {
    const size_t nq = (size_t)kt_model_nq(f->model), nv = (size_t)kt_model_nv(f->model);
    double *at = out;
    for (int i = 0; i < LATER; i++)
        out[i] = 0.0;
    if (f->later_block == NULL || strstr(f->function, "_free") != NULL)
        return;
    kt_simulation_save(f->simulation, f->later_block);
    at[0] = (double)kt_simulation_advance(f->simulation, kt_simulation_time(f->simulation) + 0.03, NULL);
    at[1] = kt_simulation_time(f->simulation);
    memcpy(at + 2, kt_simulation_positions(f->simulation), nq * sizeof *at);
    memcpy(at + 2 + nq, kt_simulation_velocities(f->simulation), nv * sizeof *at);
    at += 2 + nq + nv;
    at[0] = (double)kt_simulation_restore(f->simulation, f->later_block, NULL);
    at[1] = (double)kt_acceleration_evaluate(f->model, f->data, 0.1, f->q, f->v, NULL, NULL, at + 2, NULL);
    at += 2 + nv;
    for (size_t i = 0; f->batch != NULL && i < kt_batch_count(f->batch); i++, at += 2 + nq + nv)
        at[0] = (double)kt_batch_get_state(f->batch, i, at + 1, at + 2, at + 2 + nq, NULL);
    memcpy(at, kt_integrator_state(f->integrator), 2 * sizeof *at);
}

/* Arrays that a call changes in place are its inputs, too: those that were spoilt are compared up to their bits. */
static void keep(fixture *f) {
    find_later(f, f->later_before);
    memcpy(f->q_before, f->q_out, sizeof f->q_out);
    memcpy(f->v_before, f->v_out, sizeof f->v_out);
}

/* Whether all numbers that have changed are finite. */
static bool made_finite(const double *x, const double *before, size_t n) {
    for (size_t i = 0; i < n; i++)
        if (!isfinite(x[i]) && memcmp(&x[i], &before[i], sizeof *x) != 0)
            return false;
    return true;
}

static void end(fixture *f, kt_status status) {
    if (status == KT_OK) {
        if (!made_finite(&f->out[0][0], &f->before[0][0], (size_t)OUTPUTS * NUMBERS) ||
            !made_finite(f->q_out, f->q_before, NUMBERS) || !made_finite(f->v_out, f->v_before, NUMBERS))
            complain(f, "KT_OK with a number that is not finite");
        if (!isfinite(f->residual.position + f->residual.velocity + f->power.dissipated + f->power.supplied) ||
            !all_finite(&f->wrench[0].moment.x, 6 * sizeof f->wrench / sizeof *f->wrench))
            complain(f, "KT_OK with a residual, power or wrench that is not finite");
        return;
    }
    if (memcmp(f->out, f->before, sizeof f->out) != 0)
        complain(f, "failed, and outputs have changed");
    if (memcmp(f->q_out, f->q_before, sizeof f->q_out) != 0 || memcmp(f->v_out, f->v_before, sizeof f->v_out) != 0)
        complain(f, "failed, and what it changes in place has changed");
    if (f->object != NULL)
        complain(f, "failed, and made an object");
    if (status == KT_ERROR_CALLBACK) /* it went on until a recorder or an action ended it */
        return;
    find_later(f, f->later_after);
    if (memcmp(f->later_after, f->later_before, sizeof f->later_after) != 0)
        complain(f, "failed, and later motion has changed");
    if (f->error.code != KT_OK && (f->error.code != status || f->error.message[0] == '\0'))
        complain(f, "failed without the words of its status");
}

/* ---- callbacks --------------------------------------------------------------------------------------------------- */

static int cost(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user) {
    (void)at, (void)by_state, (void)by_tau, (void)user;
    *value = 1.0;
    return 0;
}
static void report(void *user, const kt_place *place, const kt_error *error) { (void)user, (void)place, (void)error; }
static void report_scene(void *user, const kt_error *fault) { (void)user, (void)fault; }
static bool next_none(void *user, bool may_block, kt_ensemble_member *member) {
    (void)user, (void)may_block, (void)member;
    return false;
}

static void done(void *user, const kt_ensemble_member *member, kt_status status, const kt_error *error) {
    (void)user, (void)member, (void)status, (void)error;
}

static bool find_symbol(void *user, const char *name, kt_symbol *symbol) {
    (void)user;
    *symbol = (kt_symbol){.index = 0};
    return strcmp(name, "x") == 0;
}

static const char *list_symbol(void *user, int k) {
    (void)user;
    return k == 0 ? "x" : NULL;
}

static int event_value(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)at, (void)error, (void)user;
    *value = 1.0;
    return 0;
}

static int event_action(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    (void)simulation, (void)what, (void)error, (void)user;
    return 0;
}

static int native_acceleration(const void *generic, double t, const double *q, const double *v, const double *x,
                               const double *tau, double *a) {
    (void)generic, (void)t, (void)q, (void)v, (void)x, (void)tau, (void)a;
    return 1;
}

static int recorder(const kt_record *record, void *user) {
    (void)user;
    return record->index > 3;
}
static int decay(double t, const double *y, double *dydt, void *user) {
    (void)t, (void)user;
    dydt[0] = -y[0];
    dydt[1] = y[0] - y[1];
    return 0;
}

#include "calls.h"

/* ---- what is right ----------------------------------------------------------------------------------------------- */

/* Free, spherical and revolute joints with effects; a four-bar, driven; or bodies that do not move. */
static void describe(kt_description *d, int which) {
    static kt_body body[4];
    static kt_loop loop[2];
    static kt_effect effect[3];
    static kt_marker marker = {.name = "tip", .at = {0.1, 0.2, 0.3}};
    static const char *const names[] = {"a", "b", "c", "d"};
    *d = kt_description_default();
    d->gravity = kt_vec3_make(0.0, -9.81, 0.0);
    for (int i = 0; i < 4; i++) {
        body[i] = kt_body_default();
        body[i].name = names[i];
        body[i].mass = 1.0 + i;
        body[i].com = kt_vec3_make(0.5, 0.0, 0.0);
        body[i].inertia = kt_sym3_make(0.1, 0.2, 0.2, 0.0, 0.0, 0.0);
        body[i].markers = &marker;
        body[i].marker_count = 1;
    }
    for (int i = 0; i < 3; i++) {
        effect[i] = kt_effect_default();
        effect[i].name = names[i];
    }
    d->bodies = body;
    d->body_count = 3;
    if (which == 2)
        return;
    for (int i = 0; i < 3; i++) {
        body[i].joint.type = KT_JOINT_REVOLUTE;
        body[i].joint.at = kt_vec3_make(i == 2 ? 2.2 : i, 0.0, 0.0);
        body[i].parent = i == 1 ? "a" : NULL;
    }
    effect[0].type = KT_EFFECT_JOINT_SPRING;
    effect[0].joint = "a";
    effect[0].stiffness = 3.0;
    effect[0].rest = kt_function_constant(0.1);
    effect[1].type = KT_EFFECT_SPRING;
    effect[1].between[0].body = "a";
    effect[1].between[1].body = "c";
    effect[1].stiffness = 2.0;
    effect[2].type = KT_EFFECT_MOTOR;
    effect[2].joint = "c";
    effect[2].torque = kt_function_constant(0.5);
    d->effects = effect;
    d->effect_count = 3;
    if (which == 0) {
        body[0].joint.type = KT_JOINT_FREE;
        effect[0].joint = effect[2].joint = "b";
        body[2].joint.type = KT_JOINT_SPHERICAL;
        body[2].parent = "b";
        return;
    }
    body[0].joint.position[0] = 1.2; /* crank, coupler, rocker, ground: `1, 2, 1.8, 2.2` */
    body[1].joint.position[0] = -0.7;
    body[2].joint.position[0] = 1.6;
    for (int i = 0; i < 2; i++) {
        loop[i] = kt_loop_default();
        loop[i].name = names[i];
    }
    loop[0].type = KT_LOOP_REVOLUTE;
    loop[0].between[0].body = "b";
    loop[0].between[0].at = kt_vec3_make(2.0, 0.0, 0.0);
    loop[0].between[1].body = "c";
    loop[0].between[1].at = kt_vec3_make(1.8, 0.0, 0.0);
    d->loops = loop;
    d->loop_count = 1;
}

static bool make_models(fixture *f, int which) {
    kt_description other;
    static const kt_auxiliary_state lag = {.name = "lag", .rate = "1 - lag"};
    describe(&other, which == 1 ? 0 : 1);
    other.states = &lag;
    other.state_count = 1;
    if (kt_model_compile(&other, NULL, &f->other_model, &f->error) != KT_OK ||
        kt_data_create(f->other_model, &f->other_data, &f->error) != KT_OK ||
        kt_parameter_find(f->other_model, which == 1 ? "c.armature" : "effect c.torque", &f->other_parameter,
                          &f->error) != KT_OK)
        return false;
    f->other_parameter.item = 40; /* as of a larger model */
    f->no_parameter = (kt_parameter){.kind = KT_PARAMETER_EFFECT, .item = -3, .count = 6};
    describe(&f->description, which);
    if (kt_model_compile(&f->description, NULL, &f->model, &f->error) != KT_OK ||
        kt_data_create(f->model, &f->data, &f->error) != KT_OK ||
        kt_parameter_find(f->model, "gravity", &f->parameter, &f->error) != KT_OK)
        return false;
    void *memory = aligned_alloc(KT_ALIGNMENT, (kt_model_size(f->model) + 63) / 64 * 64);
    if (kt_model_copy(f->model, memory, kt_model_size(f->model), &f->copy, &f->error) != KT_OK)
        return false;
    f->bodies = kt_model_body_count(f->model);
    f->dofs = kt_model_mobility(f->model).minimal;
    kt_model_initial(f->model, f->q, f->v);
    return kt_state_assemble(f->model, f->data, 0.0, f->q, f->v, &f->error) == KT_OK;
}

static bool make_objects(fixture *f) {
    kt_error *e = &f->error;
    f->run = kt_run_default();
    f->run.integrator = "rk4";
    f->run.step = 0.01;
    f->run.duration = 0.2;
    f->run.record = KT_RECORD_POSITION | KT_RECORD_VELOCITY | KT_RECORD_ACCELERATION;
    f->simulation_options = kt_simulation_options_default();
    f->method = kt_method_find("rk4");
    f->step = (kt_step){.method = f->method, .h = 0.01};
    f->rollout = (kt_rollout){.method = f->method, .h = 0.01, .steps = 3};
    f->data_list[0] = f->data_list[1] = f->data;
    f->memory_list[0] = f->memory_list[1] = f->memory;
    f->other_list[0] = f->other_list[1] = f->other_data;
    f->task =
        (kt_rollout_task){.rollout = f->rollout, .q = f->q, .v = f->v, .by_start = f->out[0], .by_inputs = f->out[1]};
    f->step_task = (kt_step_task){.step = f->step,
                                  .q = f->q,
                                  .v = f->v,
                                  .x = f->any,
                                  .next_q = f->out[0],
                                  .next_v = f->out[1],
                                  .next_x = f->out[2],
                                  .A = f->out[3],
                                  .B = f->out[4]};
    f->job = (kt_batch_job){.task = KT_BATCH_STEP, .h = 0.01, .steps = 1};
    f->of_time = kt_function_constant(0.5);
    f->symbols = (kt_symbols){.find = find_symbol, .list = list_symbol};
    f->native = (kt_native){.structure = kt_codegen_structure(f->model), .acceleration = native_acceleration};
    f->native_options = kt_simulation_options_default();
    f->scene_call = (kt_scene_call){.name = "a", .action = event_action};
    f->event = (kt_event){.name = "a", .function = event_value, .action = event_action};
    for (int i = 0; i < 2; i++)
        f->parameter_changes[i] = (kt_parameter_change){.parameter = f->parameter, .values = {0.1, 0.2, 0.3}};
    for (int i = 0; i < NUMBERS; i++)
        f->no_numbers[i] = (double)NAN;
    f->integrator_options = kt_integrator_options_default();
    f->integrator_options.step = 0.01;
    f->callbacks = (kt_integrator_callbacks){.rhs = decay};
    const size_t size = kt_integrator_size(f->method, 2);
    f->simulation_options.events = 1;
    if (kt_simulation_create(f->copy, &f->run, &f->simulation_options, &f->simulation, e) != KT_OK ||
        kt_scene_watch_create(&f->scene, f->copy, f->simulation, NULL, -1, &f->scene_watch, e) != KT_OK ||
        kt_mass_factor_create(f->model, &f->factor, e) != KT_OK ||
        kt_mass_inverse_create(f->model, 3, &f->inverse, e) != KT_OK ||
        kt_linearization_create(f->model, NULL, &f->linearization, e) != KT_OK ||
        kt_modes_create(f->model, &f->modes, e) != KT_OK || kt_spectrum_create(f->model, 2, &f->spectrum, e) != KT_OK ||
        kt_mode_watch_create(f->model, &f->watch, e) != KT_OK ||
        kt_integrator_init(malloc(size), size, f->method, 2, &f->integrator_options, &f->integrator, e) != KT_OK ||
        kt_integrator_start(f->integrator, 0.0, f->v, &f->callbacks, e) != KT_OK ||
        kt_integrator_step(f->integrator, 1.0, e) != KT_OK ||
        kt_stability_make(f->method, 4, &f->stability, e) != KT_OK ||
        kt_kinematics_update(f->model, f->data, f->q, f->v, NULL, e) != KT_OK ||
        kt_mass_inverse_compute(f->inverse, f->data, 0.0, f->q, e) != KT_OK)
        return false;
    f->integrator_memory = *kt_integrator_memory_of(f->integrator);
    if (kt_expression_parse("1 + 2 * 3", NULL, f->formula_memory, sizeof f->formula_memory, &f->formula, NULL, e) !=
        KT_OK)
        return false;
    f->system = kt_linearization_system(f->linearization);
    f->energy = kt_energy_watch_start(f->model);
    f->block = calloc(1, kt_simulation_state_size(f->simulation) + 64);
    kt_simulation_save(f->simulation, f->block);
    f->later_block = calloc(1, kt_simulation_state_size(f->simulation) + 64);
    f->formulation_options = kt_constraint_formulation_options_default((kt_constraint_formulation_type)0, 0.01);
    f->dae_options = kt_dae_options_default((kt_dae_type)0);
    f->floquet_options = kt_floquet_options_default(0.02);
    f->floquet_options.steps = 2;
    f->batch_options = (kt_batch_options){.states = 3, .method = kt_method_find("rk4")};
    f->frame = (kt_batch_frame){.body = 1, .marker = -1};
    f->sensors = (kt_batch_sensors){.frames = &f->frame, .count = 1, .motion = f->frame_motion};
    f->variant = kt_variant_default(&f->run);
    if (kt_model_nv(f->model) > 0 && kt_dynamics_mass(f->model, f->data, f->q, f->identity, e) == KT_OK)
        (void)!kt_mass_factor_compute(f->factor, f->identity, e);
    if (kt_absolute_create(&f->description, NULL, f->model, &f->absolute, e) != KT_OK)
        f->absolute = NULL;
    if (kt_absolute_motion_create(f->absolute, &f->run, NULL, &f->absolute_motion, e) != KT_OK)
        f->absolute_motion = NULL;
    if (kt_constraint_formulation_create(f->model, &f->formulation_options, &f->formulation, e) != KT_OK)
        f->formulation = NULL;
    if (kt_dae_create(f->model, &f->dae_options, &f->dae, e) != KT_OK)
        f->dae = NULL;
    if (kt_floquet_create(f->model, &f->floquet_options, &f->floquet, e) != KT_OK)
        f->floquet = NULL;
    if (kt_builder_create(&f->builder, e) != KT_OK)
        f->builder = NULL;
    if (kt_batch_create(f->model, &f->batch_options, &f->batch, e) != KT_OK)
        f->batch = NULL;
    if (kt_ensemble_create(f->model, &f->ensemble, e) != KT_OK)
        f->ensemble = NULL;
    return true;
}

static fixture *make(int which) {
    fixture *f = calloc(1, sizeof *f);
    if (!f)
        return NULL;
    for (int i = 0; i < NUMBERS; i++)
        f->any[i] = 0.1 + 0.01 * (i % 7);
    for (int i = 0; i < MOST; i++) {
        f->index[i] = i;
        f->bad_index[i] = 999;
    }
    f->memory = aligned_alloc(64, MEMORY);
    f->stream = fopen("/dev/null", "w");
    f->body = kt_body_default();
    f->graph_joint = kt_graph_joint_default();
    f->loop = kt_loop_default();
    f->effect = kt_effect_default();
    f->beam = kt_beam_default();
    f->beam.name = "beam";
    f->beam.segments = 2;
    f->beam.length = f->beam.mass.value = f->beam.EI[1].value = 1.0;
    f->tree = kt_link_tree_default();
    f->tree.name = "link";
    f->tree.count = 2;
    f->rotation = kt_rotation_quaternion(1.0, 0.0, 0.0, 0.0);
    f->no_matrix.x.x = f->no_inertia.xx = (double)NAN;
    f->scene = kt_scene_default();
    f->mechanism = (kt_mechanism){.scene = f->scene};
    if (f->memory && f->stream && make_models(f, which) && make_objects(f))
        return f;
    kt_note("%s: %s", f->error.where, f->error.message);
    (void)kt_check_true("what is right", false);
    return NULL;
}

/* ---- tests ------------------------------------------------------------------------------------------------------- */

#if KT_ADDRESS_SANITIZER
/* Some calls request sizes beyond all memory. malloc returns NULL, as without the sanitizer. */
const char *__asan_default_options(void);
const char *__asan_default_options(void) { return "allocator_may_return_null=1"; }
#endif

/* OpenBLAS's threads do not survive fork: a child that called it would wait for them. */
extern void openblas_set_num_threads(int count) __attribute__((weak));

static void run_all(int which) {
    static fixture *kept[3]; /* for the life of the program: never released */
    if (openblas_set_num_threads != NULL)
        openblas_set_num_threads(1);
    fixture *f = kept[which] = make(which);
    const size_t count = sizeof calls / sizeof *calls;
    int crashed = 0, failed = 0;
    for (size_t i = 0; f && i < count; i++) {
        (void)fflush(stdout);
        const pid_t child = fork();
        if (child == 0) {
            (void)alarm(20);
            f->function = calls[i].name;
            calls[i].run(f);
            _exit(f->failed < 100 ? f->failed : 100);
        }
        int status = 0;
        if (child < 0 || waitpid(child, &status, 0) != child)
            status = -1;
        if (!WIFEXITED(status) || WEXITSTATUS(status) > 100) {
            kt_note("%s ended its process, status %d", calls[i].name, status);
            crashed++;
        } else {
            failed += WEXITSTATUS(status);
        }
    }
    kt_note("%zu functions", count);
    kt_check_equal_int("crashes", crashed, 0);
    kt_check_equal_int("calls that succeed with what is not finite, or fail halfway", failed, 0);
}

KT_TEST(no_argument_crashes_a_call_on_a_tree) { run_all(0); }
KT_TEST(no_argument_crashes_a_call_on_a_four_bar) { run_all(1); }
/* Arrays without numbers are NULL there. */
KT_TEST(no_argument_crashes_a_call_on_what_does_not_move) { run_all(2); }
