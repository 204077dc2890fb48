/* Every member of every options struct with every wrong value (options.py writes the table from the headers). The call
 * that reads the struct rejects it, with a message that names the member, and leaves its outputs. With right options it
 * succeeds. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "kinetree/experimental.h"
#include "kinetree/kinetree.h"

#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "options.h"

enum { NUMBERS = 64 };

/* The objects that the options apply to. */
static struct fixture {
    kt_model *model;
    kt_data *data;
    kt_description description;
    kt_batch *batch;
    double q[NUMBERS], v[NUMBERS], next_q[NUMBERS], next_v[NUMBERS], inputs[NUMBERS];
    void *work;
    size_t work_size;
    kt_batch_frame frame;
    kt_frame_motion motion[8];
} f;

static double constant(void *user) {
    (void)user;
    return 0.0;
}

static int no_cost(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user) {
    (void)at, (void)value, (void)by_state, (void)by_tau, (void)user;
    return 0;
}

static int no_event(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)at, (void)error, (void)user;
    *value = 1.0;
    return 0;
}

static int no_action(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    (void)simulation, (void)what, (void)error, (void)user;
    return 0;
}

static int decay(double t, const double *y, double *dydt, void *user) {
    (void)t, (void)user;
    dydt[0] = -y[0];
    dydt[1] = y[0] - y[1];
    return 0;
}

/* ---- right options, and the call that reads them ----------------------------------------------------------------- */

static kt_run right_kt_run(void) {
    kt_run run = kt_run_default();
    run.duration = 0.1;
    return run;
}

static kt_status try_kt_run(const kt_run *run, kt_error *error) {
    kt_simulation *made = NULL;
    const kt_status status = kt_simulation_create(f.model, run, NULL, &made, error);
    kt_simulation_free(made);
    return status;
}

static kt_simulation_options right_kt_simulation_options(void) { return kt_simulation_options_default(); }

static kt_status try_kt_simulation_options(const kt_simulation_options *options, kt_error *error) {
    kt_simulation *made = NULL;
    const kt_status status = kt_simulation_create(f.model, NULL, options, &made, error);
    kt_simulation_free(made);
    return status;
}

static kt_model_options right_kt_model_options(void) { return kt_model_options_default(); }

static kt_status try_kt_model_options(const kt_model_options *options, kt_error *error) {
    kt_model *made = NULL;
    const kt_status status = kt_model_compile(&f.description, options, &made, error);
    kt_model_free(made);
    return status;
}

static kt_linearization_options right_kt_linearization_options(void) { return kt_linearization_options_default(); }

static kt_status try_kt_linearization_options(const kt_linearization_options *options, kt_error *error) {
    kt_linearization *made = NULL;
    const kt_status status = kt_linearization_create(f.model, options, &made, error);
    kt_linearization_free(made);
    return status;
}

static kt_equilibrium_options right_kt_equilibrium_options(void) { return kt_equilibrium_options_default(); }

static kt_status try_kt_equilibrium_options(const kt_equilibrium_options *options, kt_error *error) {
    kt_linearization *made = NULL;
    kt_equilibrium found;
    double q[NUMBERS];
    kt_status status = kt_linearization_create(f.model, NULL, &made, error);
    memcpy(q, f.q, sizeof q);
    if (status == KT_OK)
        status = kt_equilibrium_find(made, options, 0.0, q, NULL, &found, error);
    kt_linearization_free(made);
    return status;
}

static kt_floquet_options right_kt_floquet_options(void) { return kt_floquet_options_default(1.0); }

static kt_status try_kt_floquet_options(const kt_floquet_options *options, kt_error *error) {
    kt_floquet *made = NULL;
    const kt_status status = kt_floquet_create(f.model, options, &made, error);
    kt_floquet_free(made);
    return status;
}

static kt_integrator_options right_kt_integrator_options(void) { return kt_integrator_options_default(); }

static kt_status try_kt_integrator_options(const kt_integrator_options *options, kt_error *error) {
    static const double y[2] = {1.0, 2.0};
    const kt_method *method = kt_method_find("dopri5");
    const size_t size = kt_integrator_size(method, 2);
    void *memory = malloc(size);
    kt_integrator *made = NULL;
    kt_status status = kt_integrator_init(memory, size, method, 2, options, &made, error);
    if (status == KT_OK)
        status = kt_integrator_start(made, 0.0, y, &(kt_integrator_callbacks){.rhs = decay}, error);
    free(memory);
    return status;
}

static kt_batch_options right_kt_batch_options(void) {
    kt_batch_options options = kt_batch_options_default();
    options.method = kt_method_find("rk4");
    return options;
}

static kt_status try_kt_batch_options(const kt_batch_options *options, kt_error *error) {
    kt_batch *made = NULL;
    const kt_status status = kt_batch_create(f.model, options, &made, error);
    if (status != KT_OK && kt_batch_size(f.model, options) != 0)
        return KT_OK; /* an impossible object has size 0 */
    kt_batch_free(made);
    return status;
}

static kt_batch_frame right_kt_batch_frame(void) { return (kt_batch_frame){.body = 1, .marker = -1}; }

static kt_status try_kt_batch_frame(const kt_batch_frame *frame, kt_error *error) {
    return kt_batch_sense(f.batch, &(kt_batch_sensors){.frames = frame, .count = 1, .motion = f.motion}, error);
}

static kt_batch_sensors right_kt_batch_sensors(void) { return (kt_batch_sensors){.motion = f.motion}; }

static kt_status try_kt_batch_sensors(const kt_batch_sensors *sensors, kt_error *error) {
    return kt_batch_sense(f.batch, sensors, error);
}

static kt_batch_inputs right_kt_batch_inputs(void) {
    return (kt_batch_inputs){.samples = 1, .hold = 1, .torque = f.inputs};
}

static kt_status try_kt_batch_inputs(const kt_batch_inputs *inputs, kt_error *error) {
    const kt_batch_job job = {.task = KT_BATCH_STEP, .h = 0.01, .steps = 1, .inputs = inputs};
    return kt_batch_compute(f.batch, &job, error);
}

static kt_batch_job right_kt_batch_job(void) { return (kt_batch_job){.task = KT_BATCH_STEP, .h = 0.01, .steps = 1}; }

static kt_status try_kt_batch_job(const kt_batch_job *job, kt_error *error) {
    return kt_batch_compute(f.batch, job, error);
}

static kt_step right_kt_step(void) { return (kt_step){.method = kt_method_find("rk4"), .h = 0.01}; }

static kt_status try_kt_step(const kt_step *step, kt_error *error) {
    return kt_step_evaluate(f.model, f.data, f.work, f.work_size, step, f.q, f.v, f.next_q, f.next_v, error);
}

static kt_rollout right_kt_rollout(void) {
    return (kt_rollout){.method = kt_method_find("rk4"), .h = 0.01, .steps = 3, .inputs = f.inputs};
}

static kt_status try_kt_rollout(const kt_rollout *rollout, kt_error *error) {
    double value = 0.0;
    return kt_rollout_gradient(f.model, f.data, f.work, f.work_size, rollout, f.q, f.v, &value, f.next_q, NULL, no_cost,
                               NULL, error);
}

static kt_event right_kt_event(void) { return (kt_event){.name = "a", .function = no_event, .action = no_action}; }

static kt_status try_kt_event(const kt_event *event, kt_error *error) {
    kt_simulation *made = NULL;
    const kt_simulation_options one = {.events = 1};
    kt_status status = kt_simulation_create(f.model, NULL, &one, &made, error);
    if (status == KT_OK)
        status = kt_simulation_event_add(made, event, error);
    kt_simulation_free(made);
    return status;
}

static const char robot[] =
    "<robot name='r'><link name='a'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' "
    "ixy='0' ixz='0' iyz='0'/></inertial></link></robot>";

static kt_robot_options right_kt_robot_options(void) { return (kt_robot_options){.floating = true}; }

static kt_status try_kt_robot_options(const kt_robot_options *options, kt_error *error) {
    kt_scene scene = kt_scene_default();
    const kt_status status = kt_robot_parse("r", robot, sizeof robot - 1, options, &scene, NULL, NULL, error);
    if (status == KT_OK)
        kt_scene_free(&scene);
    return status;
}

static kt_scene_options right_kt_scene_options(void) { return (kt_scene_options){.setting_count = 0}; }

static kt_status try_kt_scene_options(const kt_scene_options *options, kt_error *error) {
    static const char text[] = "kinetree: 1\nbodies: [{name: a, mass: 1, joint: {type: prismatic, axis: [1, 0, 0]}}]\n";
    kt_scene scene = kt_scene_default();
    const kt_status status = kt_scene_parse_with("s", text, sizeof text - 1, options, &scene, NULL, NULL, error);
    if (status == KT_OK)
        kt_scene_free(&scene);
    return status;
}

static kt_constraint_formulation_options right_kt_constraint_formulation_options(void) {
    return kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_AUGMENTED, 0.01);
}

static kt_status try_kt_constraint_formulation_options(const kt_constraint_formulation_options *options,
                                                       kt_error *error) {
    kt_constraint_formulation *made = NULL;
    const kt_status status = kt_constraint_formulation_create(f.model, options, &made, error);
    kt_constraint_formulation_free(made);
    return status;
}

static kt_dae_options right_kt_dae_options(void) { return kt_dae_options_default(KT_DAE_STABILISED); }

static kt_status try_kt_dae_options(const kt_dae_options *options, kt_error *error) {
    kt_dae *made = NULL;
    const kt_status status = kt_dae_create(f.model, options, &made, error);
    kt_dae_free(made);
    return status;
}

static kt_accuracy_options right_kt_accuracy_options(void) {
    static const kt_method *method[1];
    static const double step[] = {1e-3};
    kt_accuracy_options options = kt_accuracy_options_default();
    method[0] = kt_method_find("rk4");
    options.duration = 0.005;
    options.records = 1;
    options.methods = method;
    options.method_count = 1;
    options.steps = step;
    options.step_count = 1;
    options.clock = constant;
    return options;
}

static kt_status try_kt_accuracy_options(const kt_accuracy_options *options, kt_error *error) {
    const kt_run run = right_kt_run();
    kt_accuracy *made = NULL;
    const kt_status status = kt_accuracy_create(&f.description, &run, options, &made, error);
    kt_accuracy_free(made);
    return status;
}

static kt_variant right_kt_variant(void) {
    static kt_run run;
    run = right_kt_run();
    return kt_variant_default(&run);
}

static kt_status try_kt_variant(const kt_variant *variant, kt_error *error) {
    kt_accuracy_options options = right_kt_accuracy_options();
    options.variants = variant;
    options.variant_count = 1;
    return try_kt_accuracy_options(&options, error);
}

/* ---- the table --------------------------------------------------------------------------------------------------- */

/* Two links that swing. */
static bool make(void) {
    static kt_body body[2];
    static const char *const names[] = {"a", "b"};
    static kt_marker marker = {.name = "tip", .at = {0.5, 0.0, 0.0}};
    kt_error error;
    f.description = kt_description_default();
    f.description.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    f.description.bodies = body;
    f.description.body_count = 2;
    for (int i = 0; i < 2; i++) {
        body[i] = kt_body_default();
        body[i].name = names[i];
        body[i].parent = i ? "a" : NULL;
        body[i].mass = 1.0;
        body[i].com = kt_vec3_make(0.5, 0.0, 0.0);
        body[i].inertia = kt_sym3_make(0.1, 0.2, 0.2, 0.0, 0.0, 0.0);
        body[i].joint.type = KT_JOINT_REVOLUTE;
        body[i].joint.at = kt_vec3_make(i, 0.0, 0.0);
        body[i].markers = &marker;
        body[i].marker_count = 1;
    }
    f.work_size = (size_t)1 << 20;
    f.work = aligned_alloc(KT_ALIGNMENT, f.work_size);
    const kt_batch_options batch = right_kt_batch_options();
    const bool made = kt_model_compile(&f.description, NULL, &f.model, &error) == KT_OK &&
                      kt_data_create(f.model, &f.data, &error) == KT_OK &&
                      kt_batch_create(f.model, &batch, &f.batch, &error) == KT_OK;
    kt_model_initial(f.model, f.q, f.v);
    return kt_check_true("made", made && f.work);
}

static void release(void) {
    kt_batch_free(f.batch);
    kt_data_free(f.data);
    kt_model_free(f.model);
    free(f.work);
}

/* Whether an error names the member: in its place or in its message. */
static bool names(const kt_error *error, const char *member) {
    return strstr(error->where, member) != NULL || strstr(error->message, member) != NULL;
}

#define TEST_OPTIONS(type)                                                                                             \
    KT_TEST(wrong_##type##_is_rejected_by_name) {                                                                      \
        int accepted = 0, unnamed = 0;                                                                                 \
        const int count = (int)(sizeof wrongs_##type / sizeof *wrongs_##type);                                         \
        if (!make())                                                                                                   \
            return;                                                                                                    \
        for (int i = 0; i < count; i++) {                                                                              \
            kt_error error = {.code = KT_OK};                                                                          \
            type options = right_##type();                                                                             \
            wrongs_##type[i].spoil(&options);                                                                          \
            const kt_status status = try_##type(&options, &error);                                                     \
            if (status == KT_OK) {                                                                                     \
                kt_note("accepted: " #type ".%s = %s", wrongs_##type[i].member, wrongs_##type[i].value);               \
                accepted++;                                                                                            \
            } else if (!names(&error, wrongs_##type[i].member)) {                                                      \
                kt_note("not named: " #type ".%s = %s: %s: %s", wrongs_##type[i].member, wrongs_##type[i].value,       \
                        error.where, error.message);                                                                   \
                unnamed++;                                                                                             \
            }                                                                                                          \
        }                                                                                                              \
        kt_error error = {.code = KT_OK};                                                                              \
        const type options = right_##type();                                                                           \
        if (!kt_check_equal_int("right options", try_##type(&options, &error), KT_OK))                                 \
            kt_note("%s: %s", error.where, error.message);                                                             \
        kt_note("%d wrong values", count);                                                                             \
        kt_check_equal_int("accepted", accepted, 0);                                                                   \
        kt_check_equal_int("rejected without the member's name", unnamed, 0);                                          \
        release();                                                                                                     \
    }

OPTIONS_LIST(TEST_OPTIONS)

/* The library reports the same sizes as the headers, and options begin with their own size. */
KT_TEST(sizes_of_structs_are_those_of_the_library) {
    int count = 0, wrong = 0;
#define CHECK_SIZE(type)                                                                                               \
    count++;                                                                                                           \
    if (kt_struct_size(#type) != sizeof(type)) {                                                                       \
        kt_note(#type ": %zu, sizeof is %zu", kt_struct_size(#type), sizeof(type));                                    \
        wrong++;                                                                                                       \
    }
    STRUCT_LIST(CHECK_SIZE)
    kt_note("%d structs", count);
    kt_check_equal_int("wrong", wrong, 0);
    kt_check_true("there are many", count > 100);
    kt_check_equal_int("no struct", (long long)kt_struct_size("kt_none"), 0);
    kt_check_equal_int("NULL", (long long)kt_struct_size(NULL), 0);
}

KT_TEST(options_begin_with_their_size) {
    int count = 0, wrong = 0;
#define CHECK_PLACE(type)                                                                                              \
    count++;                                                                                                           \
    wrong += offsetof(type, size) != 0 || sizeof(((type *)NULL)->size) != sizeof(size_t);
    SIZED_LIST(CHECK_PLACE)
    kt_note("%d structs", count);
    kt_check_true("all of them", count >= 12);
    kt_check_equal_int("wrong", wrong, 0);
    kt_check_equal_int("model", (long long)kt_model_options_default().size, (long long)sizeof(kt_model_options));
    kt_check_equal_int("simulation", (long long)kt_simulation_options_default().size,
                       (long long)sizeof(kt_simulation_options));
    kt_check_equal_int("robot", (long long)kt_robot_options_default().size, (long long)sizeof(kt_robot_options));
    kt_check_equal_int("scene", (long long)kt_scene_options_default().size, (long long)sizeof(kt_scene_options));
    kt_check_equal_int("dae", (long long)kt_dae_options_default(KT_DAE_STABILISED).size,
                       (long long)sizeof(kt_dae_options));
}
