/* kinetree equilibrium: finds an equilibrium of a scene and judges its stability. */
#include "command.h"
#include "records/output.h"
#include "scene/linear.h"
#include "text/arguments.h"

#include "kinetree/descriptor.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct kt_equilibrium_arguments {
    kt_settings settings;
    bool nearest, json;
    const char *scene;
} kt_equilibrium_arguments;

static const kt_option options[] = {
    KT_SET_OPTION(offsetof(kt_equilibrium_arguments, settings)),
    {"nearest", KT_OPTION_FLAG, offsetof(kt_equilibrium_arguments, nearest), NULL,
     "the one nearest to the initial position, stable or not", NULL},
    {"scene", KT_OPTION_TEXT, offsetof(kt_equilibrium_arguments, scene), "FILE",
     "write the scene with the equilibrium as its initial state", NULL},
    {"json", KT_OPTION_FLAG, offsetof(kt_equilibrium_arguments, json), NULL, "as JSON", NULL},
};

const kt_usage kt_usage_equilibrium = {
    .command = "equilibrium",
    .examples = "  kinetree equilibrium four-bar.yaml\n"
                "  kinetree equilibrium four-bar.yaml --scene resting.yaml && kinetree run resting.yaml\n"
                "  kinetree equilibrium cart-pole.yaml --nearest\n",
    .operands = "SCENE",
    .least = 1,
    .most = 1,
    .about = "Finds where the scene comes to rest from its initial position in overdamped motion, under its effects\n"
             "as they are at the start, and prints the joints' positions as a scene file has them. A start\n"
             "that is an equilibrium is kept. What follows from the modes there is said: stable, unstable, neutral.\n"
             "Where the search ends with an acceleration that is not that of rest, it ends with exit status 4.\n",
    .options = options,
    .option_count = sizeof options / sizeof options[0],
};

/* ---- stability --------------------------------------------------------------------------------------------------- */

/* Returns the index of the mode that grows fastest, or -1. *neutral: number of zero eigenvalues; *damped: whether all
 * other modes decay. */
static int judge(const kt_small_motion *motion, int *neutral, bool *damped) {
    int worst = -1;
    *neutral = 0;
    *damped = true;
    for (int i = 0; i < kt_modes_count(motion->modes); i++) {
        const kt_mode mode = kt_modes_at(motion->modes, i);
        if (kt_mode_is_neutral(&mode))
            *neutral += mode.count;
        else if (kt_mode_grows(&mode))
            worst = worst < 0 || mode.real > kt_modes_at(motion->modes, worst).real ? i : worst;
        else if (!(mode.real < -mode.error && mode.real < -1e-9 * mode.imaginary))
            *damped = false;
    }
    return worst;
}

static const char *word(int worst, int neutral, bool damped) {
    return worst >= 0 ? "unstable" : neutral > 0 ? "neutral" : damped ? "stable" : "stable, undamped";
}

/* ---- output ------------------------------------------------------------------------------------------------------ */

static void print_numbers(const double *x, int count) {
    for (int i = 0; i < count; i++)
        printf("%s%.17g", i ? ", " : "[", x[i]);
    putchar(']');
}

/* Prints the value of a joint's `position` key in a scene. */
static void print_position(kt_coordinates at, const double *q) {
    if (at.nq == 7) { /* x, y, z and a quaternion */
        fputs("{position: ", stdout);
        print_numbers(q + at.q, 3);
        fputs(", orientation: {quaternion: ", stdout);
        print_numbers(q + at.q + 3, 4);
        fputs("}}", stdout);
    } else if (at.nq == 1) {
        printf("%.17g", q[at.q]);
    } else {
        print_numbers(q + at.q, at.nq);
    }
}

/* Describes those zero eigenvalues whose error exceeds their magnitude. */
static const char *uncertain_words(const kt_small_motion *motion, char *words, size_t size) {
    double error = 0.0;
    int count = 0;
    for (int i = 0; i < kt_modes_count(motion->modes); i++) {
        const kt_mode mode = kt_modes_at(motion->modes, i);
        if (!kt_mode_is_uncertain(motion, &mode))
            continue;
        count += mode.count;
        error = fmax(error, mode.error);
    }
    words[0] = '\0';
    if (count > 0)
        (void)snprintf(words, size,
                       " (%d of them cannot be distinguished from zero: they are uncertain by up to %.1e 1/s)", count,
                       error);
    return words;
}

static int print_text(const kt_small_motion *motion) {
    char words[128];
    int neutral;
    bool damped;
    const int worst = judge(motion, &neutral, &damped);
    for (int body = 1; body < kt_model_body_count(motion->model); body++) {
        const kt_coordinates at = kt_body_coordinates(motion->model, body);
        if (at.nq == 0)
            continue;
        printf("%s: {position: ", kt_body_name(motion->model, body));
        print_position(at, motion->q);
        puts("}");
    }
    if (worst >= 0) {
        kt_mover mover;
        const double rate = kt_modes_at(motion->modes, worst).real;
        const int named = kt_find_movers(motion, worst, &mover, 1, 0.0);
        kt_say("an unstable equilibrium: departures grow by e in %.3g s, most in %s", 1.0 / rate,
               named ? kt_name_coordinate(motion->model, mover.coordinate).text : "?");
    } else if (neutral > 0) {
        kt_say("a neutral equilibrium: %d eigenvalue%s zero%s, the others do not grow", neutral,
               neutral == 1 ? " is" : "s are", uncertain_words(motion, words, sizeof words));
    } else {
        kt_say(damped ? "a stable equilibrium" : "a stable equilibrium, with modes that nothing damps");
    }
    return kt_finish_output(KT_EXIT_DONE);
}

static json_t *describe(const kt_small_motion *motion) {
    int neutral;
    bool damped;
    const int worst = judge(motion, &neutral, &damped);
    json_t *root = json_object();
    json_object_set_new(root, "scene", kt_json_text(motion->name));
    json_object_set_new(root, "position", kt_json_by_joint(motion->model, motion->q, false));
    json_object_set_new(root, "stability", json_string(word(worst, neutral, damped)));
    json_object_set_new(root, "growth", json_real(worst < 0 ? 0.0 : kt_modes_at(motion->modes, worst).real));
    json_object_set_new(root, "neutral", json_integer(neutral));
    json_object_set_new(root, "steps", json_integer(motion->equilibrium.steps));
    json_object_set_new(root, "starts", json_integer(motion->equilibrium.starts));
    json_object_set_new(root, "acceleration", kt_json_number(motion->equilibrium.acceleration));
    return root;
}

/* ---- the scene at rest ------------------------------------------------------------------------------------------- */

/* Position of an end in the world, for the positions of the last kt_kinematics_update. */
static kt_vec3 end_point(const kt_small_motion *motion, const kt_end *end) {
    const int body = end->body != NULL ? kt_body_find(motion->model, end->body) : 0;
    const int marker = end->marker != NULL ? kt_marker_find(motion->model, body, end->marker) : -1;
    return kt_point_position(motion->model, motion->data, body,
                             marker >= 0 ? kt_marker_at(motion->model, body, marker) : end->at);
}

/* Lengths of springs that are measured in the assembled initial state become explicit numbers, so that they do not
 * change with the new initial state. */
static kt_status keep_lengths(const kt_small_motion *motion, kt_effect *effects, int count, kt_error *error) {
    double *q = calloc((size_t)kt_model_nq(motion->model) + 1, sizeof *q);
    double *v = calloc((size_t)kt_model_nv(motion->model) + 1, sizeof *v);
    kt_status status = KT_OK;
    if (q == NULL || v == NULL) {
        status = kt_error_set(error, KT_ERROR_MEMORY, NULL, "there is not enough memory");
    } else {
        kt_model_initial(motion->model, q, v);
        status = kt_state_assemble(motion->model, motion->data, 0.0, q, v, error);
    }
    if (status == KT_OK)
        status = kt_kinematics_update(motion->model, motion->data, q, NULL, NULL, error);
    for (int i = 0; status == KT_OK && i < count; i++)
        if (kt_descriptor_kind(kt_effect_descriptor(effects[i].type), KT_KEY_DISTANCE) && effects[i].initial_length) {
            effects[i].initial_length = false;
            effects[i].length = kt_vec3_norm(
                kt_vec3_sub(end_point(motion, &effects[i].between[1]), end_point(motion, &effects[i].between[0])));
        }
    free(q);
    free(v);
    return status;
}

/* The angle of a screw loop is measured from the initial state. In the written scene this is the equilibrium, where its
 * ends are some distance apart along the axis; the first end is therefore moved by this distance. (The distances of
 * loops are the same at the equilibrium as at the start.) */
static kt_status keep_threads(const kt_small_motion *motion, kt_loop *loops, int count, kt_error *error) {
    kt_status status = kt_kinematics_update(motion->model, motion->data, motion->q, NULL, NULL, error);
    for (int i = 0; status == KT_OK && i < count; i++) {
        kt_mat3 turn;
        kt_end *end = loops[i].between;
        if (kt_descriptor_key(kt_loop_descriptor(loops[i].type), "pitch") == NULL)
            continue;
        status = kt_rotation_evaluate(&end->rotation, &turn, error);
        if (status != KT_OK)
            return status;
        const int body = end->body != NULL ? kt_body_find(motion->model, end->body) : 0;
        const int marker = end->marker != NULL ? kt_marker_find(motion->model, body, end->marker) : -1;
        const kt_vec3 axis = kt_mat3_apply(turn, kt_vec3_normalize(loops[i].axis)); /* in the body's frame */
        const kt_vec3 apart = kt_mat3_apply_transposed(kt_body_pose(motion->model, motion->data, body).rotation,
                                                       kt_vec3_sub(end_point(motion, &end[1]), end_point(motion, end)));
        if (marker >= 0)
            end->at = kt_marker_at(motion->model, body, marker);
        end->marker = NULL;
        end->at = kt_vec3_add(end->at, kt_vec3_scale(kt_vec3_dot(axis, apart), axis));
    }
    return status;
}

/* Returns a copy of an array, which may be empty; NULL: not enough memory. */
static void *copy_of(const void *array, int count, size_t size) {
    void *copy = calloc((size_t)count + 1, size);
    if (copy == NULL)
        return NULL;
    if (count > 0)
        memcpy(copy, array, (size_t)count * size);
    return copy;
}

static void rest_bodies(const kt_small_motion *motion, kt_body *bodies) {
    for (int body = 1; body < kt_model_body_count(motion->model); body++) {
        const kt_coordinates at = kt_body_coordinates(motion->model, body);
        kt_joint *joint = &bodies[kt_body_source(motion->model, body)].joint;
        memcpy(joint->position, motion->q + at.q, (size_t)at.nq * sizeof(double));
        memset(joint->velocity, 0, sizeof joint->velocity);
        joint->given = KT_GIVEN_POSITION | KT_GIVEN_ORIENTATION; /* written as given, so that the assembly keeps it */
    }
}

/* Writes the scene with the equilibrium as initial positions, zero velocities, and otherwise the same forces. */
static int write_scene(const kt_small_motion *motion, const char *path) {
    kt_scene scene = motion->scene;
    kt_description *d = &scene.description;
    kt_error error = {0};
    kt_body *bodies = copy_of(d->bodies, d->body_count, sizeof *bodies);
    kt_loop *loops = copy_of(d->loops, d->loop_count, sizeof *loops);
    kt_effect *effects = copy_of(d->effects, d->effect_count, sizeof *effects);
    kt_status status = KT_ERROR_MEMORY;
    if (bodies != NULL && loops != NULL && effects != NULL) {
        rest_bodies(motion, bodies);
        status = keep_lengths(motion, effects, d->effect_count, &error);
        if (status == KT_OK)
            status = keep_threads(motion, loops, d->loop_count, &error);
        d->bodies = bodies;
        d->loops = loops;
        d->effects = effects;
        if (status == KT_OK)
            status = kt_write_scene(&scene, path, &error);
    }
    free(bodies);
    free(loops);
    free(effects);
    if (status == KT_OK)
        return KT_EXIT_DONE;
    kt_say("%s cannot be written: %s", path, error.message[0] != '\0' ? error.message : kt_status_text(status));
    return KT_EXIT_INTEGRATION;
}

int kt_command_equilibrium(int argc, char **argv) {
    kt_equilibrium_arguments arguments = {.nearest = false};
    kt_small_motion motion;
    kt_error error = {0};
    int operands;
    int code = kt_arguments_read(&kt_usage_equilibrium, argc, argv, &arguments, &operands);
    if (code >= 0)
        return code;
    const kt_file_use uses[] = {{"the scene", argv[1], false}, {"--scene", arguments.scene, true}};
    code = kt_check_files("equilibrium", uses, 2);
    if (code >= 0)
        return code;
    code = kt_small_motion_open(&motion, argv[1], &arguments.settings);
    if (code == KT_EXIT_DONE) {
        const kt_status status = kt_small_motion_settle(&motion, arguments.nearest, &error);
        if (status != KT_OK)
            kt_say_error(&error);
        code = kt_exit_code(status);
    }
    if (code == KT_EXIT_DONE)
        code = kt_small_motion_linearize(&motion);
    if (code == KT_EXIT_DONE && arguments.scene != NULL)
        code = write_scene(&motion, arguments.scene);
    if (code == KT_EXIT_DONE && !(arguments.scene != NULL && strcmp(arguments.scene, "-") == 0))
        code = arguments.json ? kt_json_write(describe(&motion), "-") : print_text(&motion);
    kt_small_motion_close(&motion);
    return code;
}
