/* kinetree evaluate: prints the matrices and vectors of a scene's initial state as JSON. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/advice.h"
#include "open/linear.h"
#include "open/start.h"
#include "records/output.h"
#include "text/arguments.h"
#include "text/json.h"
#include "text/list.h"

#include "base/pool.h"
#include "kinetree/simulation.h"

#include <stdio.h>
#include <string.h>

typedef struct kt_evaluate_arguments {
    kt_settings settings;
    const char *acceleration, *out;
} kt_evaluate_arguments;

#define KT_AT(member) offsetof(kt_evaluate_arguments, member)

static const kt_option options[] = {
    KT_SET_OPTION,
    KT_OPTION(TEXT, "acceleration", acceleration, "A1,A2,...", "compute the inverse dynamics for these accelerations"),
    KT_OPTION(TEXT, "out", out, "FILE", "write to a file instead of standard output"),
    KT_READER_OPTIONS,
};

const kt_usage kt_usage_evaluate = {
    .command = "evaluate",
    .examples = "  kinetree evaluate pendulum.yaml\n"
                "  kinetree evaluate arm.yaml --acceleration=0,0.5,-1\n"
                "  kinetree evaluate arm.yaml | jq .mass_matrix\n",
    .operands = "SCENE",
    .about =
        "Prints the terms of the equations of motion in the initial state, assembled:\n"
        "\n"
        "    M a + h = Q + A' lambda,    A v = rate,    A a = drift,    A N = 0\n"
        "\n"
        "    coordinates     the velocities, in order\n"
        "    mass_matrix     M of the tree, as rows\n"
        "    bias            h of the tree\n"
        "    applied_force   Q of all effects, with the friction of hard contacts that slip\n"
        "    acceleration    a of the whole\n"
        "    energy, mass    and its center\n"
        "    momentum        linear; angular about the world's origin and about the center of mass\n"
        "    pose            of each body in the world\n"
        "    constraint      of loops: jacobian A, rate, drift, multiplier lambda, null_space N (rows)\n"
        "\n"
        "Hard contacts, stops, slack ropes and friction that sticks start as in `run`: after the impacts at the\n"
        "start, the closed ones are loops. With --acceleration it also prints inverse_dynamics, the forces M a + h.\n",
    KT_OPTIONS_OF(options),
};

/* Above this number of coordinates the mass matrix is left out: its text would exceed 100 MB. */
enum { MASS_COORDINATES_MAX = 2000 };

/* All results. mass is NULL if it is left out. */
typedef struct kt_evaluation {
    const kt_scene *scene;
    kt_simulation *start;  /* at the start of a run; NULL: its contacts can only be resolved in time stepping */
    const kt_model *model; /* with the contacts that are closed there */
    kt_data *data;
    int nq, nv, rows; /* rows: equations of loops */
    double *q, *v, *a, *given, *bias, *inverse, *mass;
    double *applied;                            /* Q */
    double *jacobian, *residual, *rate, *drift; /* of the loops: A column-major, phi, b', b'' */
    double *multiplier, *basis;                 /* lambda; N column-major, NULL if it is left out */
    int columns;                                /* of N */
    kt_residual violation;
    kt_pool memory;                       /* of these arrays */
    bool is_short;                        /* memory was insufficient */
    bool accelerated;                     /* a and multiplier are those of the run */
    bool may_lack_inertia, lacks_inertia; /* by `inertia_check: accept`; then there are no accelerations */
} kt_evaluation;

/* Returns zeros, which release_evaluation frees; NULL, which is_short notes: memory is insufficient. */
static double *take_numbers(kt_evaluation *e, int rows, int columns) {
    double *numbers = kt_pool_take(&e->memory, (size_t)rows * (size_t)columns + 1, sizeof *numbers);
    e->is_short = e->is_short || numbers == NULL;
    return numbers;
}

static bool allocate_evaluation(kt_evaluation *e) {
    kt_error error;
    e->nq = kt_model_nq(e->model);
    e->nv = kt_model_nv(e->model);
    e->rows = kt_model_mobility(e->model).equations;
    const bool is_small = e->nv <= MASS_COORDINATES_MAX;
    e->q = take_numbers(e, e->nq, 1);
    e->v = take_numbers(e, e->nv, 1);
    e->a = take_numbers(e, e->nv, 1);
    e->given = take_numbers(e, e->nv, 1);
    e->bias = take_numbers(e, e->nv, 1);
    e->inverse = take_numbers(e, e->nv, 1);
    e->mass = is_small ? take_numbers(e, e->nv, e->nv) : NULL;
    e->applied = take_numbers(e, e->nv, 1);
    e->jacobian = take_numbers(e, e->rows, e->nv);
    e->residual = take_numbers(e, e->rows, 1);
    e->rate = take_numbers(e, e->rows, 1);
    e->drift = take_numbers(e, e->rows, 1);
    e->multiplier = take_numbers(e, e->rows, 1);
    e->basis = is_small && e->rows > 0 ? take_numbers(e, e->nv, e->nv) : NULL;
    return !e->is_short && kt_data_create(e->model, &e->data, &error) == KT_OK;
}

static void release_evaluation(kt_evaluation *e) {
    kt_simulation_free(e->start);
    kt_data_free(e->data);
    kt_pool_free(e->memory.chunks);
}

/* Parses "1,2.5,-3": one number per coordinate. */
static int read_accelerations(const char *list, kt_evaluation *e) {
    const int count = kt_numbers_read(list, e->given, e->nv);
    if (count < 0)
        return kt_misuse("evaluate: --acceleration takes numbers with commas between, not '%s'", list);
    if (count == e->nv)
        return -1;
    return kt_misuse("evaluate: --acceleration has %d number%s, and the scene has %d velocity coordinate%s", count,
                     count == 1 ? "" : "s", e->nv, e->nv == 1 ? "" : "s");
}

/* ---- the start of a run ------------------------------------------------------------------------------------------ */

/* Creates a simulation, which decides which contacts are closed. The decision does not depend on the integrator. With
 * `contact: steps`, too, contacts are resolved as events, because the first step of time stepping begins without
 * forces. Events cannot resolve friction between spheres. Then all contacts are open, and states in which one touches
 * are rejected. */
static kt_status begin_as_run(kt_evaluation *e, const kt_model *model, kt_error *error) {
    const kt_scene *scene = e->scene;
    kt_simulation_options requested = kt_simulation_options_default();
    kt_run run = kt_run_default();
    run.integrator = "dop853"; /* without matrices */
    run.metric = scene->run.metric;
    run.plan = scene->run.plan;
    requested.record = KT_RECORD_ACCELERATION | KT_RECORD_MULTIPLIER;
    kt_status status = kt_simulation_create(model, &run, &requested, &e->start, error);
    if (status == KT_ERROR_UNSUPPORTED && scene->contact == KT_CONTACT_STEPS)
        status = KT_OK;
    e->model = e->start != NULL ? kt_simulation_model(e->start) : model;
    return status;
}

/* Takes the state of the start. Returns -1 or an exit code. */
static int take_start(kt_evaluation *e) {
    if (e->start == NULL) {
        const int code = kt_start_assemble(e->scene, e->model, e->data, e->q, e->v);
        return code == KT_EXIT_DONE ? -1 : code;
    }
    memcpy(e->q, kt_simulation_positions(e->start), (size_t)e->nq * sizeof *e->q);
    memcpy(e->v, kt_simulation_velocities(e->start), (size_t)e->nv * sizeof *e->v);
    (void)kt_say_disagreement(e->scene, e->model);
    (void)kt_start_say_moved(NULL, e->scene, e->model, e->q, e->v, kt_simulation_contacts(e->start).impacts > 0);
    return -1;
}

/* Takes the first record of a run, and ends the run. */
static int take_first_record(const kt_record *record, void *user) {
    kt_evaluation *e = user;
    memcpy(e->a, record->a, (size_t)e->nv * sizeof *e->a);
    memcpy(e->multiplier, record->multipliers, (size_t)e->rows * sizeof *e->multiplier);
    e->accelerated = true;
    return 1;
}

/* Computes accelerations and multipliers. */
static kt_status find_start_acceleration(kt_evaluation *e, kt_error *error) {
    if (e->start != NULL) {
        const kt_status status = kt_simulation_run(e->start, take_first_record, e, error);
        return e->accelerated ? KT_OK : status;
    }
    kt_status status = kt_acceleration_evaluate(e->model, e->data, 0.0, e->q, e->v, NULL, NULL, e->a, error);
    if (status == KT_OK)
        status = kt_multiplier_evaluate(e->model, e->data, 0.0, e->q, e->v, NULL, NULL, e->multiplier, error);
    return status;
}

/* Whether a closed contact slips: its own loop has equations, and the loop of its friction has none. */
static bool contact_slips(const kt_model *model) {
    for (int i = 0; i < kt_loop_count(model); i++) {
        char stick[512];
        (void)snprintf(stick, sizeof stick, "%s.stick", kt_loop_name(model, i));
        const int friction = kt_loop_find(model, stick);
        if (kt_loop_side(model, i) != KT_SIDE_NONE && kt_loop_rows_of(model, i).count > 0 && friction >= 0 &&
            kt_loop_rows_of(model, friction).count == 0)
            return true;
    }
    return false;
}

/* Adds the friction of contacts that slip to Q. It depends on the multipliers: the friction is what the equations of
 * motion lack, M a + h - A' lambda - Q. Differences that are rounding of the largest term add nothing. */
static kt_status add_slip_friction(kt_evaluation *e, kt_error *error) {
    double *lacks = take_numbers(e, e->nv, 1), most = 0.0;
    if (lacks == NULL)
        return kt_reject_memory(error);
    const kt_status status = kt_dynamics_inverse(e->model, e->data, e->q, e->v, e->a, NULL, lacks, error);
    for (int i = 0; status == KT_OK && i < e->nv; i++) {
        most = fmax(most, fmax(fabs(lacks[i]), fabs(e->bias[i])));
        lacks[i] -= e->applied[i];
        for (int r = 0; r < e->rows; r++) {
            const double share = e->jacobian[i * e->rows + r] * e->multiplier[r];
            most = fmax(most, fabs(share));
            lacks[i] -= share;
        }
    }
    for (int i = 0; status == KT_OK && i < e->nv; i++)
        if (fabs(lacks[i]) > 1e-14 * most)
            e->applied[i] += lacks[i];
    return status;
}

/* Whether friction of a joint is proportional to a reaction. */
static bool rubs_under_load(const kt_description *d) {
    for (int i = 0; i < d->effect_count; i++)
        if (d->effects[i].type == KT_EFFECT_JOINT_FRICTION &&
            (d->effects[i].friction > 0.0 || d->effects[i].efficiency != 1.0))
            return true;
    return false;
}

/* Q. Friction from a load follows from accelerations, which the data hold then. */
static kt_status find_applied_forces(kt_evaluation *e, kt_error *error) {
    kt_status status = KT_OK;
    if (rubs_under_load(&e->scene->description) && !e->lacks_inertia)
        status = kt_acceleration_evaluate(e->model, e->data, 0.0, e->q, e->v, NULL, NULL, e->applied, error);
    return status == KT_OK ? kt_effect_forces(e->model, e->data, 0.0, e->q, e->v, e->applied, error) : status;
}

static kt_status compute_evaluation(kt_evaluation *e, kt_error *error) {
    const kt_model *model = e->model;
    kt_status status = KT_OK;
    if (e->mass != NULL)
        status = kt_dynamics_mass(model, e->data, e->q, e->mass, error);
    if (status == KT_OK)
        status = kt_dynamics_inverse(model, e->data, e->q, e->v, NULL, NULL, e->bias, error);
    if (status == KT_OK)
        status = kt_dynamics_inverse(model, e->data, e->q, e->v, e->given, NULL, e->inverse, error);
    if (status == KT_OK)
        status = kt_loop_residual(model, e->data, 0.0, e->q, e->v, &e->violation, error);
    if (status == KT_OK)
        status = kt_loop_equations(model, e->data, 0.0, e->q, e->v, e->jacobian, e->residual, e->rate, e->drift, error);
    if (status == KT_OK)
        status = find_start_acceleration(e, error);
    if (status == KT_ERROR_SINGULAR && e->may_lack_inertia) {
        kt_say("acceleration is left out: %s: %s", error->where, error->message);
        e->lacks_inertia = true;
        status = KT_OK;
    }
    if (status == KT_OK)
        status = find_applied_forces(e, error);
    if (status == KT_OK && !e->lacks_inertia && contact_slips(model))
        status = add_slip_friction(e, error);
    if (status == KT_OK && e->basis != NULL)
        status = kt_loop_nullspace(model, e->data, 0.0, e->q, e->basis, &e->columns, error);
    if (status == KT_OK)
        status = kt_kinematics_update(model, e->data, e->q, e->v, e->lacks_inertia ? NULL : e->a, error);
    for (int k = 0; k < e->nv; k++)
        if (kt_massless_moves(model, k))
            e->a[k] = (double)NAN; /* null in JSON */
    return status;
}

/* ---- as JSON ----------------------------------------------------------------------------------------------------- */

static json_t *describe_coordinates(const kt_model *model) {
    json_t *list = json_array();
    for (int i = 0; i < kt_model_nv(model); i++)
        json_array_append_new(list, json_string(kt_name_column(model, i).text));
    return list;
}

static json_t *describe_constraint(const kt_evaluation *e) {
    json_t *constraint = json_object();
    json_object_set_new(constraint, "equations", json_integer(e->rows));
    json_object_set_new(constraint, "rank", json_integer(kt_model_mobility(e->model).rank));
    json_object_set_new(constraint, "position", kt_json_number(e->violation.position));
    json_object_set_new(constraint, "velocity", kt_json_number(e->violation.velocity));
    json_object_set_new(constraint, "jacobian", kt_json_rows(e->jacobian, e->rows, e->nv));
    json_object_set_new(constraint, "residual", kt_json_numbers(e->residual, e->rows));
    json_object_set_new(constraint, "rate", kt_json_numbers(e->rate, e->rows));
    json_object_set_new(constraint, "drift", kt_json_numbers(e->drift, e->rows));
    json_object_set_new(constraint, "multiplier",
                        e->lacks_inertia ? json_null() : kt_json_numbers(e->multiplier, e->rows));
    json_object_set_new(constraint, "null_space",
                        e->basis != NULL ? kt_json_rows(e->basis, e->nv, e->columns) : json_null());
    return constraint;
}

static json_t *describe_energy(const kt_evaluation *e) {
    double kinetic = kt_kinetic_energy(e->model, e->data);
    double potential = kt_potential_energy(e->model, e->data) + kt_effect_energy(e->model, e->data, 0.0, e->q, e->v);
    return json_pack("{s:f, s:f, s:f}", "kinetic", kinetic, "potential", potential, "total", kinetic + potential);
}

/* Describes the momentum, for the kinematics in data. */
static json_t *describe_momentum(const kt_evaluation *e) {
    kt_vec3 center;
    (void)kt_mass_center(e->model, e->data, &center);
    const kt_wrench momentum = kt_momentum(e->model, e->data);
    const kt_vec3 about_center = kt_vec3_sub(momentum.moment, kt_vec3_cross(center, momentum.force));
    return json_pack("{s:o, s:o, s:o}", "linear", kt_json_vector(momentum.force), "angular",
                     kt_json_vector(momentum.moment), "angular_about_center", kt_json_vector(about_center));
}

static json_t *describe_mass(const kt_evaluation *e) {
    kt_vec3 center;
    const double total = kt_mass_center(e->model, e->data, &center);
    return json_pack("{s:o, s:o}", "total", kt_json_number(total), "center", kt_json_vector(center));
}

static json_t *list_poses(const kt_evaluation *e) {
    json_t *poses = json_object();
    for (int body = 1; body < kt_model_body_count(e->model); body++) {
        kt_pose pose = kt_body_pose(e->model, e->data, body);
        kt_quat p = kt_quat_from_mat3(pose.rotation);
        kt_mat3 rows = kt_mat3_transpose(pose.rotation);
        double quaternion[4] = {p.w, p.x, p.y, p.z};
        json_object_set_new(poses, kt_body_name(e->model, body),
                            json_pack("{s:o, s:o, s:[o, o, o]}", "position", kt_json_vector(pose.position),
                                      "quaternion", kt_json_numbers(quaternion, 4), "rotation", kt_json_vector(rows.x),
                                      kt_json_vector(rows.y), kt_json_vector(rows.z)));
    }
    return poses;
}

static json_t *describe_evaluation(const kt_evaluation *e, bool with_inverse) {
    json_t *root = json_object();
    json_object_set_new(root, "coordinates", describe_coordinates(e->model));
    json_object_set_new(root, "mass_matrix", e->mass != NULL ? kt_json_rows(e->mass, e->nv, e->nv) : json_null());
    json_object_set_new(root, "bias", kt_json_numbers(e->bias, e->nv));
    json_object_set_new(root, "applied_force", kt_json_numbers(e->applied, e->nv));
    json_object_set_new(root, "acceleration", e->lacks_inertia ? json_null() : kt_json_numbers(e->a, e->nv));
    if (with_inverse)
        json_object_set_new(root, "inverse_dynamics", kt_json_numbers(e->inverse, e->nv));
    json_object_set_new(root, "energy", describe_energy(e));
    json_object_set_new(root, "mass", describe_mass(e));
    json_object_set_new(root, "momentum", describe_momentum(e));
    json_object_set_new(root, "pose", list_poses(e));
    json_object_set_new(root, "constraint", describe_constraint(e));
    return root;
}

static int evaluate_instant(const kt_scene *scene, const kt_model *model, const void *user) {
    const kt_evaluate_arguments *arguments = user;
    kt_evaluation e = {.scene = scene, .may_lack_inertia = scene->description.inertia_check == KT_INERTIA_ACCEPT};
    kt_error error = {0};
    int code = -1;
    const kt_status begun = begin_as_run(&e, model, &error);
    if (begun != KT_OK)
        code = kt_say_status(begun, &error);
    if (begun == KT_ERROR_CONSTRAINT)
        kt_say_open_loops(scene, model);
    if (code < 0 && !allocate_evaluation(&e))
        code = kt_reject(KT_EXIT_INTEGRATION, "there is not enough memory for %d velocity coordinates",
                         kt_model_nv(model));
    if (code < 0 && arguments->acceleration != NULL)
        code = read_accelerations(arguments->acceleration, &e);
    if (code < 0)
        code = take_start(&e);
    if (code < 0) {
        kt_status status = compute_evaluation(&e, &error);
        if (status != KT_OK)
            code = kt_say_status(status, &error);
    }
    if (code < 0 && e.mass == NULL)
        kt_say("mass_matrix is left out%s: %d velocity coordinates are more than %d",
               e.rows > 0 ? ", and null_space" : "", e.nv, MASS_COORDINATES_MAX);
    if (code < 0)
        code = kt_json_write(describe_evaluation(&e, arguments->acceleration != NULL),
                             arguments->out != NULL ? arguments->out : "-");
    release_evaluation(&e);
    return code;
}

int kt_command_evaluate(int argc, char **argv) {
    kt_evaluate_arguments arguments = {.out = NULL};
    int code = kt_arguments_read(&kt_usage_evaluate, argc, argv, &arguments, NULL);
    code = code < 0 ? kt_check_result("evaluate", "the scene", argv[1], "--out", arguments.out) : code;
    return code < 0 ? kt_use_model(argv[1], &arguments.settings, evaluate_instant, &arguments) : code;
}
