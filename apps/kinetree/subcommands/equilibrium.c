/* kinetree equilibrium: finds an equilibrium of a scene and judges its stability. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "open/linear.h"
#include "records/output.h"
#include "text/arguments.h"
#include "text/json.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

typedef struct kt_equilibrium_arguments {
    kt_settings settings;
    bool nearest, json;
    const char *scene, *rotating;
} kt_equilibrium_arguments;

#define KT_AT(member) offsetof(kt_equilibrium_arguments, member)

static const kt_option options[] = {
    KT_SET_OPTION,
    KT_FLAG("nearest", nearest, "find the equilibrium nearest to the initial position, stable or not"),
    KT_OPTION(TEXT, "rotating", rotating, "JOINT",
              "find the equilibrium in the frame that turns with this joint at its velocity"),
    KT_OPTION(TEXT, "scene", scene, "FILE", "write the scene with the equilibrium as its initial state"),
    KT_FLAG("json", json, "print JSON"),
    KT_READER_OPTIONS,
};

const kt_usage kt_usage_equilibrium = {
    .command = "equilibrium",
    .examples = "  kinetree equilibrium four-bar.yaml\n"
                "  kinetree equilibrium four-bar.yaml --scene resting.yaml && kinetree run resting.yaml\n"
                "  kinetree equilibrium cart-pole.yaml --nearest\n"
                "  kinetree equilibrium flyball-governor.yaml --rotating shaft\n",
    .operands = "SCENE",
    .about = "Follows an overdamped motion from the initial position until the scene rests, with its effects as they "
             "are at the start.\n"
             "Prints the positions of the joints as a scene file has them. A start that is an equilibrium is kept.\n"
             "The verdict follows from the modes at the equilibrium: stable, unstable or neutral.\n"
             "If the search ends in a state that is not at rest, the exit status is 4.\n",
    KT_OPTIONS_OF(options),
};

/* ---- stability --------------------------------------------------------------------------------------------------- */

/* Returns the index of the mode that grows fastest, or -1. *neutral: number of zero eigenvalues, other than those of
 * places; *damped: whether all other modes decay. */
static int judge_modes(const kt_small_motion *motion, int *neutral, bool *damped) {
    int worst = -1;
    *neutral = -kt_small_motion_places(motion);
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
    const int worst = judge_modes(motion, &neutral, &damped);
    for (int body = 1; body < kt_model_body_count(motion->model); body++) {
        const kt_coordinates at = kt_body_coordinates(motion->model, body);
        if (at.nq == 0)
            continue;
        printf("%s: {position: ", kt_joint_name(motion->model, body));
        print_position(at, motion->q);
        puts("}");
    }
    for (int k = 0; k < kt_auxiliary_state_count(motion->model); k++)
        if (!kt_scene_is_place_state(&motion->scene, kt_auxiliary_state_name(motion->model, k)))
            printf("%s: {initial: %.17g}\n", kt_auxiliary_state_name(motion->model, k),
                   kt_linearization_auxiliary_states(motion->linearization)[k]);
    if (worst >= 0) {
        kt_mover mover;
        const double rate = kt_modes_at(motion->modes, worst).real;
        const int named = kt_find_movers(motion, worst, &mover, 1, 0.0);
        kt_say("an unstable equilibrium: departures grow by e in %.3g s, most in %s", 1.0 / rate,
               named ? kt_name_coordinate(motion, mover.coordinate).text : "?");
    } else if (neutral > 0) {
        kt_say("a neutral equilibrium: %d eigenvalue%s zero%s, the others do not grow", neutral,
               neutral == 1 ? " is" : "s are", uncertain_words(motion, words, sizeof words));
    } else {
        kt_say(damped ? "a stable equilibrium" : "a stable equilibrium, with modes that nothing damps");
    }
    return kt_finish_output(KT_EXIT_DONE);
}

static json_t *describe_equilibrium(const kt_small_motion *motion) {
    int neutral;
    bool damped;
    const int worst = judge_modes(motion, &neutral, &damped);
    json_t *root = json_object();
    json_object_set_new(root, "scene", kt_json_text(motion->name));
    json_object_set_new(root, "position", kt_json_by_joint(motion->model, motion->q, false));
    if (kt_auxiliary_state_count(motion->model) > 0)
        json_object_set_new(
            root, "state",
            kt_json_auxiliary_states(motion->model, kt_linearization_auxiliary_states(motion->linearization)));
    json_object_set_new(root, "stability", json_string(word(worst, neutral, damped)));
    json_object_set_new(root, "growth", json_real(worst < 0 ? 0.0 : kt_modes_at(motion->modes, worst).real));
    json_object_set_new(root, "neutral", json_integer(neutral));
    json_object_set_new(root, "steps", json_integer(motion->equilibrium.steps));
    json_object_set_new(root, "starts", json_integer(motion->equilibrium.starts));
    if (kt_auxiliary_state_count(motion->model) > 0)
        json_object_set_new(root, "followed", json_boolean(motion->equilibrium.followed));
    json_object_set_new(root, "acceleration", kt_json_number(motion->equilibrium.acceleration));
    return root;
}

/* ---- the scene at rest ------------------------------------------------------------------------------------------- */

/* Writes the scene with the equilibrium as initial positions, zero velocities, and otherwise the same forces. */
static int write_equilibrium_scene(kt_small_motion *motion, const char *path) {
    kt_error error = {0};
    const double *v = motion->rotating != NULL ? motion->v : NULL;
    kt_status status = kt_scene_start_from(&motion->scene, motion->model, motion->q, v, &error);
    if (status == KT_OK && kt_auxiliary_state_count(motion->model) > 0)
        status =
            kt_scene_start_states(&motion->scene, kt_linearization_auxiliary_states(motion->linearization), &error);
    return kt_write_scene(&motion->scene, path, status, &error);
}

int kt_command_equilibrium(int argc, char **argv) {
    kt_equilibrium_arguments arguments = {.nearest = false};
    kt_small_motion motion;
    kt_error error = {0};
    int code = kt_arguments_read(&kt_usage_equilibrium, argc, argv, &arguments, NULL);
    code = code < 0 ? kt_check_result("equilibrium", "the scene", argv[1], "--scene", arguments.scene) : code;
    if (code >= 0)
        return code;
    code = kt_small_motion_open(&motion, argv[1], &arguments.settings);
    motion.rotating = arguments.rotating;
    if (code == KT_EXIT_DONE && arguments.rotating != NULL) {
        kt_say_left_out("equilibrium", &motion.scene);
        code = kt_small_motion_rotate(&motion, arguments.rotating, arguments.nearest);
    } else if (code == KT_EXIT_DONE) {
        kt_say_left_out("equilibrium", &motion.scene);
        const kt_status status = kt_small_motion_settle(&motion, arguments.nearest, &error);
        code = kt_say_status(status, &error);
    }
    if (code == KT_EXIT_DONE)
        code = kt_small_motion_linearize(&motion);
    if (code == KT_EXIT_DONE && arguments.scene != NULL)
        code = write_equilibrium_scene(&motion, arguments.scene);
    if (code == KT_EXIT_DONE && !(arguments.scene != NULL && strcmp(arguments.scene, "-") == 0))
        code = arguments.json ? kt_json_write(describe_equilibrium(&motion), "-") : print_text(&motion);
    kt_small_motion_close(&motion);
    return code;
}
