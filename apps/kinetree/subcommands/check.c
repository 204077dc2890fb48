/* kinetree check: reports every error in scene files, and warns of doubtful values. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/advice.h"
#include "advice/angles.h"
#include "advice/penetration.h"
#include "open/load.h"
#include "open/start.h"
#include "records/output.h"
#include "text/arguments.h"
#include "view/view.h"

#include "picture/load.h"
#include "picture/picture.h"
#include "picture/picture_mesh.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct kt_check_arguments {
    kt_settings settings;
    const char *view;
} kt_check_arguments;

#define KT_AT(member) offsetof(kt_check_arguments, member)

static const kt_option options[] = {
    KT_SET_OPTION,
    KT_OPTION(TEXT, "view", view, "FILE.html",
              "write a page that shows the given positions, and over them the assembled ones (one scene)"),
    KT_READER_OPTIONS,
};

const kt_usage kt_usage_check = {
    .command = "check",
    .examples = "  kinetree check pendulum.yaml\n"
                "  kinetree check scenes/*.yaml\n"
                "  kinetree check four-bar.yaml --view start.html\n"
                "  kinetree make tree --links 50 | kinetree check -\n",
    .operands = "SCENE...",
    .about = "Reads and compiles each scene, closes its loops and computes its first accelerations.\n"
             "Prints 'FILE: ok' for each scene that runs.\n"
             "Every fault is printed on standard error as FILE:LINE:COLUMN: message, and every doubt as FILE: warning: "
             "message.\n"
             "The exit status is 2 if any scene is wrong, and 3 if loops cannot be closed. It is 0 if there are only "
             "warnings.\n",
    KT_OPTIONS_OF(options),
};

/* A scene in its assembled initial state. */
typedef struct check {
    const char *path;
    const kt_scene *scene;
    const kt_model *model;
    kt_data *data;
    double *q, *v, *a;
    int warnings;
} check;

static void warn_check(check *c, const char *format, ...) KT_PRINTF(2, 3);

static void warn_check(check *c, const char *format, ...) {
    va_list arguments;
    kt_print("%s: warning: ", c->path);
    va_start(arguments, format);
    kt_print_all(format, arguments);
    va_end(arguments);
    kt_print("\n");
    c->warnings++;
}

/* ---- degrees of freedom ------------------------------------------------------------------------------------------ */

/* Meshes that pictures and views leave out. The reading of a robot reports its own. */
static void check_meshes(check *c) {
    enum { FEW = 12 }; /* triangles: the reader reads the whole file in any case */
    for (int i = 0; i < c->scene->mesh_count && !kt_is_robot_name(c->path); i++) {
        kt_error reason = {0};
        kt_mesh mesh = {0};
        kt_solid solid = {0};
        if (kt_mesh_load(&c->scene->meshes[i], FEW, &mesh, &solid, &reason) != KT_OK)
            warn_check(c, "meshes[%d]: %s: %s; mend the file, or take the item out of `meshes`", i, reason.where,
                       reason.message);
        kt_mesh_free(&mesh);
    }
}

static void check_mobility(check *c) {
    const kt_mobility f = kt_model_mobility(c->model);
    if (f.minimal > 0 || kt_is_driven(&c->scene->description))
        return;
    if (c->scene->description.body_count == 0)
        warn_check(c, "nothing can move: there are no bodies; add some under 'bodies'");
    else if (f.tree == 0)
        warn_check(c, "nothing can move: all joints are fixed; give a body a joint that moves");
    else
        warn_check(
            c,
            "nothing can move: the joints have %d degree%s of freedom, and the loops take all of them (%d independent "
            "equation%s); leave a loop out, or choose types with fewer equations",
            f.tree, f.tree == 1 ? "" : "s", f.rank, f.rank == 1 ? "" : "s");
}

/* ---- gravity ----------------------------------------------------------------------------------------------------- */

/* Returns whether the assembled state is at rest, without effects, drives and accelerations. */
static bool stays_at_rest(const check *c) {
    const kt_description *d = &c->scene->description;
    bool rests = d->effect_count == 0 && !kt_is_driven(d);
    for (int i = 0; i < kt_model_nv(c->model); i++)
        rests = rests && c->v[i] == 0.0 && c->a[i] == 0.0;
    return rests;
}

static void check_gravity(check *c) {
    const kt_vec3 g = c->scene->description.gravity;
    const double size = kt_vec3_norm(g);
    if (size == 0.0 && kt_model_mobility(c->model).minimal > 0 && stays_at_rest(c))
        warn_check(
            c, "nothing sets it in motion: it is at rest, there are no effects, and no gravity; was 'gravity: [0, 0, "
               "-9.81]' forgotten?");
    else if (kt_model_mobility(c->model).minimal > 0 && stays_at_rest(c))
        warn_check(
            c,
            "nothing sets it in motion: it is at rest, there are no effects, and gravity [%.6g, %.6g, %.6g] does "
            "not accelerate it; compare gravity with the axes of the joints, or give it another start",
            g.x, g.y, g.z);
    else if (size > 9000.0 && size < 11000.0)
        warn_check(c, "gravity is %.6g m/s^2, a thousand times that of the earth; lengths are in metres here: 9.81",
                   size);
    else if (size > 100.0)
        warn_check(c, "gravity is %.6g m/s^2, %.3g times that of the earth, 9.81", size, size / 9.81);
}

/* ---- inertia ----------------------------------------------------------------------------------------------------- */

static bool body_carries(const check *c, int body, int other) {
    while (other > body)
        other = kt_body_parent(c->model, other);
    return other == body;
}

/* Returns the sum of m d^2 of the bodies that a joint carries, kg m^2. Here d is the distance of a body's centre of
 * mass from the origin of the joint's body. */
static double largest_inertia(const check *c, int body) {
    const kt_vec3 origin = kt_body_pose(c->model, c->data, body).position;
    double sum = 0.0;
    for (int other = body; other < kt_model_body_count(c->model); other++) {
        kt_vec3 com;
        kt_sym3 inertia;
        kt_error error;
        if (!body_carries(c, body, other) ||
            kt_body_inertia(&c->scene->description.bodies[kt_body_source(c->model, other)], &com, &inertia, &error) !=
                KT_OK)
            continue;
        const double d = kt_vec3_norm(kt_vec3_sub(kt_point_position(c->model, c->data, other, com), origin));
        sum += kt_body_mass(c->model, other) * d * d;
    }
    return sum;
}

/* Returns the inertia that coordinate i moves: the increase of its generalised force for a unit acceleration. All other
 * accelerations and all velocities are zero. NaN if inverse dynamics fail. */
static double moved_inertia(const check *c, int i, double *work) {
    const size_t nv = (size_t)kt_model_nv(c->model);
    double *a = work, *tau = work + nv, rest;
    kt_error error;
    memset(work, 0, 2 * nv * sizeof *work);
    kt_status status = kt_dynamics_inverse(c->model, c->data, c->q, NULL, a, NULL, tau, &error);
    rest = tau[i];
    a[i] = 1.0;
    if (status == KT_OK)
        status = kt_dynamics_inverse(c->model, c->data, c->q, NULL, a, NULL, tau, &error);
    return status == KT_OK ? tau[i] - rest : (double)NAN;
}

/* Warns of revolute joints whose axis nearly passes through the mass that the joint turns. Robots whose links are
 * points have such joints. These joints begin with an acceleration that steps can hardly follow. */
static void check_axis_inertia(check *c) {
    enum { FAST = 100000 /* rad/s^2 */ };
    kt_error error;
    double *work = calloc(2 * (size_t)kt_model_nv(c->model) + 1, sizeof *work);
    bool known = work != NULL && kt_kinematics_update(c->model, c->data, c->q, c->v, NULL, &error) == KT_OK;
    for (int body = 1; known && body < kt_model_body_count(c->model); body++) {
        const kt_coordinates at = kt_body_coordinates(c->model, body);
        if (at.type != KT_JOINT_REVOLUTE || !(fabs(c->a[at.v]) > FAST))
            continue;
        const double inertia = moved_inertia(c, at.v, work), share = inertia / largest_inertia(c, body);
        if (share < 1e-8)
            warn_check(
                c,
                "joint '%s' turns an inertia of %.3g kg m^2, %.1g of a usual one for its bodies, and begins with %.3g "
                "rad/s^2. This needs very short steps; give the joint an 'armature', or the body an 'inertia'",
                kt_joint_name(c->model, body), inertia, share, c->a[at.v]);
    }
    free(work);
}

/* ---- a scene ----------------------------------------------------------------------------------------------------- */

/* Prints an error of the scene, and returns its exit code. */
static int reject_scene(const check *c, kt_status status, const kt_error *error) {
    kt_print("%s: %s\n", c->path, kt_words_of(error).text);
    return kt_exit_code(status);
}

/* Evaluates the accelerations of the initial state; a failure is reported as an error of the scene. Accelerations that
 * cannot be computed are NaN. */
static int check_accelerations(check *c) {
    kt_error error = {0};
    for (int i = 0; i < kt_model_nv(c->model); i++)
        c->a[i] = (double)NAN;
    const kt_status status = kt_acceleration_evaluate(c->model, c->data, 0.0, c->q, c->v, NULL, NULL, c->a, &error);
    if (status == KT_OK || status == KT_ERROR_UNSUPPORTED) /* a contact touches: check_simulation closes it */
        return KT_EXIT_DONE;
    if (status == KT_ERROR_SINGULAR && c->scene->description.inertia_check == KT_INERTIA_ACCEPT) {
        warn_check(c, "accelerations cannot be computed: %s: %s", error.where, error.message);
        return KT_EXIT_DONE;
    }
    const int code = reject_scene(c, status, &error);
    return status == KT_ERROR_SINGULAR ? KT_EXIT_SCENE : code;
}

/* Begins the simulation that `run` begins. Constraints that bound one side (hard stops and contacts) must begin on
 * their free side. */
static int check_simulation(const check *c) {
    kt_error error = {0};
    kt_simulation *simulation = NULL;
    kt_status status = kt_simulation_create(c->model, &c->scene->run, NULL, &simulation, &error);
    if (status == KT_OK && kt_switch_count(c->model) > 0)
        status = kt_simulation_acceleration(simulation, c->a, &error);
    kt_simulation_free(simulation);
    return status == KT_OK ? KT_EXIT_DONE : reject_scene(c, status, &error);
}

static int check_start(check *c) {
    kt_error error = {0};
    kt_warnings warnings = {.path = c->path};
    char before[512];
    kt_model_initial(c->model, c->q, c->v);
    kt_status status = kt_state_assemble(c->model, c->data, 0.0, c->q, c->v, &error);
    if (status == KT_OK)
        status = kt_massless_balance(c->model, c->data, 0.0, c->q, c->v, NULL, NULL, &error);
    if (status != KT_OK) {
        const int code = reject_scene(c, status, &error);
        if (status == KT_ERROR_CONSTRAINT)
            kt_say_open_loops(c->scene, c->model);
        return code;
    }
    int code = check_accelerations(c);
    if (code == KT_EXIT_DONE)
        code = check_simulation(c);
    if (code != KT_EXIT_DONE)
        return code;
    c->warnings += kt_say_disagreement(c->scene, c->model) > 0;
    c->warnings += kt_start_say_moved(c->path, c->scene, c->model, c->q, c->v, false) > 0;
    (void)snprintf(before, sizeof before, "%s: warning: ", c->path);
    c->warnings += kt_say_double_motions(before, c->scene);
    check_mobility(c);
    check_gravity(c);
    check_axis_inertia(c);
    c->warnings += kt_angles_warn(&warnings, c->scene, false, NULL);
    c->warnings += kt_plausible_warn(&warnings, c->scene, 1.0);
    check_meshes(c);
    c->warnings += kt_idle_warn(&warnings, c->scene);
    c->warnings += kt_slender_warn(&warnings, c->scene);
    c->warnings += kt_column_units_warn(&warnings, c->scene, c->model);
    c->warnings += kt_penetration_warn(&warnings, c->scene, c->model, c->q);
    kt_warnings_free(&warnings);
    const char *jumping = kt_start_jumping(c->scene, c->scene->run.duration);
    if (jumping != NULL)
        warn_check(
            c,
            "the speed of loop '%s' jumps at a row of its table, or at a branch of its formula; give the table "
            "'interpolation: cubic' or 'monotone', and avoid sign, step, comparisons, and kinks of abs, min, max and "
            "clamp in a formula",
            jumping);
    return KT_EXIT_DONE;
}

static int check_scene_model(const char *path, const kt_scene *scene, const kt_model *model) {
    const size_t nq = (size_t)kt_model_nq(model), nv = (size_t)kt_model_nv(model);
    check c = {.path = path, .scene = scene, .model = model};
    kt_error error = {0};
    double *state = calloc(nq + 2 * nv + 1, sizeof *state);
    int code = KT_EXIT_INTEGRATION;
    if (state == NULL || kt_data_create(model, &c.data, &error) != KT_OK) {
        kt_say("there is not enough memory to check %s", path);
    } else {
        c.q = state;
        c.v = state + nq;
        c.a = c.v + nv;
        code = check_start(&c);
    }
    if (code == KT_EXIT_DONE && c.warnings > 0)
        printf("%s: ok, %d warning%s\n", path, c.warnings, c.warnings == 1 ? "" : "s");
    else if (code == KT_EXIT_DONE)
        printf("%s: ok\n", path);
    kt_data_free(c.data);
    free(state);
    return code;
}

static int view_start(const char *path, const kt_scene *scene, const kt_model *model, const char *view) {
    const int code = kt_view_write_start(scene, model, kt_title_of(model, path), view);
    if (code == KT_EXIT_DONE)
        kt_print("%s: the given and the assembled positions: %s\n", path, kt_show(view).text);
    return code;
}

typedef struct checked_file {
    const char *path, *view;
} checked_file;

static int check_and_view(const kt_scene *scene, const kt_model *model, const void *user) {
    const checked_file *file = user;
    const int code = check_scene_model(file->path, scene, model);
    const int viewed = file->view != NULL ? view_start(file->path, scene, model, file->view) : KT_EXIT_DONE;
    return code == KT_EXIT_DONE ? viewed : code;
}

int kt_command_check(int argc, char **argv) {
    kt_check_arguments arguments = {.view = NULL};
    int operands, code = kt_arguments_read(&kt_usage_check, argc, argv, &arguments, &operands);
    if (code >= 0)
        return code;
    if (arguments.view != NULL && operands > 1)
        return kt_misuse("check: --view shows one scene; give one");
    code = arguments.view != NULL ? kt_check_result("check", "the scene", argv[1], "--view", arguments.view) : -1;
    code = code < 0 ? kt_check_ending("--view", arguments.view, ".html") : code;
    if (code >= 0)
        return code;
    code = KT_EXIT_DONE;
    for (int i = 1; i <= operands; i++) {
        const checked_file file = {argv[i], arguments.view};
        const int one = kt_use_model(argv[i], &arguments.settings, check_and_view, &file);
        code = code == KT_EXIT_DONE ? one : code;
    }
    return kt_finish_output(code);
}
