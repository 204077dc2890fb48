/* kinetree equilibrium: where a scene comes to rest, and whether it stays there. */
#include "arguments.h"
#include "command.h"
#include "linear.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct kt_equilibrium_arguments {
    bool nearest, json;
    const char *scene;
} kt_equilibrium_arguments;

static const kt_option options[] = {
    {"nearest", KT_OPTION_FLAG, offsetof(kt_equilibrium_arguments, nearest), NULL,
     "the one nearest to the initial position, stable or not", NULL},
    {"scene", KT_OPTION_TEXT, offsetof(kt_equilibrium_arguments, scene), "FILE",
     "write the scene with the equilibrium as its initial state", NULL},
    {"json", KT_OPTION_FLAG, offsetof(kt_equilibrium_arguments, json), NULL, "as JSON", NULL},
};

static const kt_usage usage = {
    .command = "equilibrium",
    .examples = "  kinetree equilibrium four-bar.yaml\n"
                "  kinetree equilibrium four-bar.yaml --scene resting.yaml && kinetree run resting.yaml\n"
                "  kinetree equilibrium cart-pole.yaml --nearest\n",
    .operands = "SCENE",
    .least = 1,
    .most = 1,
    .about = "Finds where the scene comes to rest from its initial position if it moves as through honey, under its\n"
             "effects as they are at the start, and prints the joints' positions as a scene file has them. A start\n"
             "that is an equilibrium is kept. What follows from the modes there is said: stable, unstable, neutral.\n",
    .options = options,
    .option_count = sizeof options / sizeof options[0],
};

/* ---- stability --------------------------------------------------------------------------------------------------- */

/* The mode that grows fastest, or -1; *neutral: eigenvalues that are zero; *damped: whether all others die out. */
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

/* As a joint's `position` in a scene. */
static void print_position(kt_coordinates at, const double *q) {
    if (at.type == KT_JOINT_FREE) {
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

static int print_text(const kt_small_motion *motion) {
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
        kt_say("a neutral equilibrium: %d eigenvalue%s zero, the others do not grow", neutral,
               neutral == 1 ? " is" : "s are");
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
    json_object_set_new(root, "scene", json_string(motion->name));
    json_object_set_new(root, "position", kt_json_by_joint(motion->model, motion->q, false));
    json_object_set_new(root, "stability", json_string(word(worst, neutral, damped)));
    json_object_set_new(root, "growth", json_real(worst < 0 ? 0.0 : kt_modes_at(motion->modes, worst).real));
    json_object_set_new(root, "neutral", json_integer(neutral));
    json_object_set_new(root, "steps", json_integer(motion->equilibrium.steps));
    json_object_set_new(root, "acceleration", kt_json_number(motion->equilibrium.acceleration));
    return root;
}

/* The scene with other initial positions and no velocities. */
static int write_scene(const kt_small_motion *motion, const char *path) {
    kt_scene scene = motion->scene;
    kt_error error = {0};
    kt_body *bodies = calloc((size_t)scene.description.body_count + 1, sizeof *bodies);
    if (bodies == NULL) {
        kt_say("there is not enough memory");
        return KT_EXIT_INTEGRATION;
    }
    memcpy(bodies, scene.description.bodies, (size_t)scene.description.body_count * sizeof *bodies);
    for (int body = 1; body < kt_model_body_count(motion->model); body++) {
        const kt_coordinates at = kt_body_coordinates(motion->model, body);
        kt_joint *joint = &bodies[kt_body_source(motion->model, body)].joint;
        memcpy(joint->position, motion->q + at.q, (size_t)at.nq * sizeof(double));
        memset(joint->velocity, 0, sizeof joint->velocity);
    }
    scene.description.bodies = bodies;
    errno = 0;
    const bool to_stdout = strcmp(path, "-") == 0;
    FILE *file = to_stdout ? stdout : fopen(path, "w");
    kt_status status = file != NULL ? kt_scene_write(&scene, file, &error) : KT_ERROR_FILE;
    if (file != NULL && (to_stdout ? fflush(file) : fclose(file)) != 0 && status == KT_OK)
        status = kt_error_set(&error, KT_ERROR_FILE, NULL, "%s", strerror(errno));
    free(bodies);
    if (status == KT_OK)
        return KT_EXIT_DONE;
    kt_say("%s cannot be written: %s", path, error.message[0] != '\0' ? error.message : strerror(errno));
    return KT_EXIT_INTEGRATION;
}

int kt_command_equilibrium(int argc, char **argv) {
    kt_equilibrium_arguments arguments = {false, false, NULL};
    kt_small_motion motion;
    kt_error error = {0};
    int operands;
    int code = kt_arguments_read(&usage, argc, argv, &arguments, &operands);
    if (code >= 0)
        return code;
    code = kt_small_motion_open(&motion, argv[1]);
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
