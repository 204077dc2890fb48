/* kinetree modes: computes frequencies, damping and shapes of a scene's small motions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/modes.h"
#include "command.h"
#include "plot/plot.h"
#include "records/output.h"
#include "text/arguments.h"
#include "text/json.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct kt_modes_arguments {
    kt_settings settings;
    int at; /* index of the choice; -1: not given */
    bool nearest, json, bars, dark;
    long count, steps;
    double period, alpha, beta;
    int formulation; /* index of the choice; -1: not given */
    const char *plot, *view, *sweep, *rotating;
    long orders;
} kt_modes_arguments;

#define KT_FORMULATION_CHOICE "gauss|baumgarte|augmented|projection"

#define KT_AT(member) offsetof(kt_modes_arguments, member)

static const kt_option options[] = {
    KT_SET_OPTION,
    KT_CHOICE("at", at, "STATE", "linearise about this state; default: rest, or the initial state if it moves",
              "initial|equilibrium"),
    KT_FLAG("nearest", nearest, "linearise about the equilibrium nearest to the initial position, stable or not"),
    KT_OPTION(TEXT, "rotating", rotating, "JOINT",
              "linearise about the equilibrium in the frame that turns with this joint at its velocity"),
    KT_OPTION(SEVERAL, "count", count, "N",
              "list and draw the N slowest modes that are not neutral; default: 40, and 6 drawn"),
    KT_OPTION(POSITIVE, "period", period, "S",
              "compute Floquet multipliers of the motion from the initial state over this period, s, instead"),
    KT_OPTION(SEVERAL, "steps", steps, "N", "take N steps of rk4 in --period, an even number; default: 400"),
    KT_CHOICE("formulation", formulation, "NAME",
              "compute the spectrum that another formulation of the loops adds, instead", KT_FORMULATION_CHOICE),
    KT_OPTION(POSITIVE, "alpha", alpha, "A",
              "set the first gain of --formulation baumgarte or augmented, 1/s; default: 10"),
    KT_OPTION(POSITIVE, "beta", beta, "B", "set the second gain of --formulation, 1/s; default: the first"),
    KT_OPTION(
        TEXT, "sweep", sweep, "PARAMETER=FROM:TO:COUNT",
        "compute the modes for COUNT values of a parameter, or of another number of the scene; default: 41 values"),
    KT_OPTION(SEVERAL, "orders", orders, "N",
              "draw lines of the frequencies k PARAMETER/(2 pi), k = 1 to N, at most 3, for a parameter in rad/s"),
    KT_FLAG("json", json, "print JSON: modes with their shapes, state, input and output matrices"),
    KT_OPTION(TEXT, "plot", plot, "FILE",
              "draw the mechanism deflected in each of the slowest modes, as SVG, PNG or PDF"),
    KT_OPTION(TEXT, "view", view, "FILE.html", "write a page that animates the modes, in one file for any browser"),
    KT_FLAG("bars", bars, "draw bars for the joints with their phases, instead of the mechanism (--plot)"),
    KT_FLAG("dark", dark, "draw the picture on a dark page"),
    KT_READER_OPTIONS,
};

static const char gains[] = "--alpha and --beta are gains of a formulation: --formulation baumgarte goes with them";

/* Each of --period and --formulation prints a table of its own. */
static const kt_option_rule rules[] = {
    {"period", false, "formulation,at,nearest,plot,view",
     "--period starts at the initial state and prints a table; leave --at, --nearest, --formulation, --plot and --view "
     "out"},
    {"formulation", false, "plot,view", "--formulation prints eigenvalues, which have no --plot and no --view"},
    {"alpha", true, "formulation", gains},
    {"beta", true, "formulation", gains},
    {"rotating", false, "period,at",
     "--rotating is about an equilibrium in a rotating frame; leave --period and --at out"},
    {"sweep", false, "period,formulation,view,bars",
     "--sweep prints a table of modes; leave --period, --formulation, --view and --bars out"},
    {"orders", true, "sweep", NULL},
    {"bars", true, "plot", NULL},
    {"dark", true, "plot", NULL},
    {"steps", true, "period", NULL},
};

const kt_usage kt_usage_modes = {
    .command = "modes",
    .examples = "  kinetree modes double-pendulum.yaml\n"
                "  kinetree modes bicycle.yaml --at initial\n"
                "  kinetree modes chain.yaml --plot shapes.svg\n"
                "  kinetree modes hingeless-rotor.yaml --sweep speed=1:40 --orders 2 --plot campbell.svg\n"
                "  kinetree modes cart-pole.yaml --at initial --json | jq .state_matrix\n"
                "  kinetree modes ground-resonance.yaml --period 0.36959913571644626\n"
                "  kinetree modes point-pendulum.yaml --formulation baumgarte --alpha 7 --beta 9\n",
    .operands = "SCENE",
    .about = "Linearises a scene and prints its modes, slowest first.\n"
             "Each has a frequency in Hz, a damping ratio and a rate in 1/s: the real part of the eigenvalue. A "
             "negative rate decays.\n"
             "Each mode also lists the joints that move most, with amplitudes relative to the first, and phases in "
             "degrees.\n"
             "\n"
             "--sweep computes the modes over a parameter. Curves connect modes of similar shape, and --plot draws a "
             "Campbell diagram.\n"
             "\n"
             "--period is for a motion that repeats itself, such as that of a rotor.\n"
             "The multipliers of a period decide whether small differences grow. A linearisation at an instant does "
             "not show this.\n"
             "\n"
             "--formulation prints the eigenvalues in all tree coordinates.\n"
             "Eigenvalues that the mechanism does not have come from the formulation.\n",
    KT_OPTIONS_OF(options),
    KT_RULES_OF(rules),
};

/* ---- table ------------------------------------------------------------------------------------------------------- */

enum { NAMED = 3, NEUTRAL_NAMED = 6 };

/* Returns zero if x does not exceed its error. */
static double beyond_error(double x, double error) { return fabs(x) > error ? x : 0.0; }

static void print_movers(const kt_small_motion *motion, int mode) {
    kt_mover movers[NAMED];
    const int count = kt_find_movers(motion, mode, movers, NAMED, 0.01);
    for (int i = 0; i < count; i++) {
        const kt_coordinate_name name = kt_name_coordinate(motion, movers[i].coordinate);
        double phase = movers[i].phase * 180.0 / 3.14159265358979323846;
        phase = phase < -179.5 ? 180.0 : phase;
        printf("%s%s", i ? ", " : "", name.text);
        if (i > 0 && fabs(phase) >= 0.5)
            printf(" %.2f at %.0f deg", movers[i].share, phase);
        else if (i > 0)
            printf(" %.2f", movers[i].share);
    }
    putchar('\n');
}

/* Prints the row of a mode; number 0: one that cannot be distinguished from zero. */
static void print_mode_row(const kt_small_motion *motion, int index, int number) {
    const kt_mode mode = kt_modes_at(motion->modes, index);
    if (number > 0)
        printf("%4d  ", number);
    else
        printf("   ?  ");
    if (mode.imaginary > 0.0)
        printf("%12.6g  ", mode.frequency);
    else
        printf("%12s  ", "-");
    printf("%12.6g  ", beyond_error(mode.real, mode.error));
    if (mode.imaginary > 0.0)
        printf("%9.4f  ", beyond_error(mode.damping, mode.error / hypot(mode.real, mode.imaginary)));
    else
        printf("%9s  ", "-");
    print_movers(motion, index);
}

/* Returns whether a mode is neutral and of one kind. The eigenvalue is zero, since no force acts on the mode, or
 * (uncertain) it does not exceed its error. */
static bool is_of_kind(const kt_small_motion *motion, const kt_mode *mode, bool uncertain) {
    return kt_mode_is_neutral(mode) && kt_mode_is_uncertain(motion, mode) == uncertain;
}

/* Prints the coordinates that move most in the neutral modes of one kind, without repetition: a drift has two
 * eigenvalues with one shape. */
static void print_neutral_coordinates(const kt_small_motion *motion, bool uncertain) {
    int named = 0;
    for (int i = 0; i < kt_modes_count(motion->modes); i++) {
        const kt_mode mode = kt_modes_at(motion->modes, i);
        kt_mover mover;
        bool again = false;
        if (!is_of_kind(motion, &mode, uncertain) || kt_find_movers(motion, i, &mover, 1, 0.0) == 0)
            continue;
        for (int j = 0; j < i && !again; j++) {
            const kt_mode other = kt_modes_at(motion->modes, j);
            kt_mover before;
            again = is_of_kind(motion, &other, uncertain) && kt_find_movers(motion, j, &before, 1, 0.0) > 0 &&
                    before.coordinate == mover.coordinate;
        }
        if (!again && named++ < NEUTRAL_NAMED)
            printf("%s%s", named > 1 ? ", " : "", kt_name_coordinate(motion, mover.coordinate).text);
    }
    if (named > NEUTRAL_NAMED)
        printf(" and %d more", named - NEUTRAL_NAMED);
    putchar('\n');
}

static void print_neutral(const kt_small_motion *motion) {
    int count[2] = {-kt_small_motion_places(motion), 0};
    double error = 0.0;
    for (int i = 0; i < kt_modes_count(motion->modes); i++) {
        const kt_mode mode = kt_modes_at(motion->modes, i);
        for (int uncertain = 0; uncertain < 2; uncertain++)
            count[uncertain] += is_of_kind(motion, &mode, uncertain) ? mode.count : 0;
        if (is_of_kind(motion, &mode, true))
            error = fmax(error, mode.error);
    }
    if (count[0] > 0) {
        printf("%d eigenvalue%s zero: neither stiffness nor damping acts on ", count[0],
               count[0] == 1 ? " is" : "s are");
        print_neutral_coordinates(motion, false);
    }
    if (count[1] > 0) {
        printf("%d eigenvalue%s (? in the table) cannot be distinguished from zero (uncertain by up to %.1e 1/s): ",
               count[1], count[1] == 1 ? "" : "s", error);
        print_neutral_coordinates(motion, true);
    }
}

static int print_mode_table(const kt_small_motion *motion, const char *state, long most) {
    const kt_linear_system *system = kt_linearization_system(motion->linearization);
    double length = 0.0;
    int shown = 0, left = 0;
    for (int i = 0; i < system->coordinates; i++)
        length = system->unit[i] != 1.0 ? system->unit[i] : length;
    printf("%s: linearised about its %s, %d state%s\n", kt_show(motion->name).text, state, system->states,
           system->states == 1 ? "" : "s");
    if (system->states == 0) {
        puts("There are no degrees of freedom, and so no modes.");
        return kt_finish_output(KT_EXIT_DONE);
    }
    printf("mode  %12s  %12s  %9s  %s\n", "frequency", "rate", "damping", "joints that move most");
    printf("      %12s  %12s  %9s\n", "Hz", "1/s", "ratio");
    for (int i = 0; i < kt_modes_count(motion->modes); i++) {
        const kt_mode mode = kt_modes_at(motion->modes, i);
        if (kt_mode_is_uncertain(motion, &mode))
            print_mode_row(motion, i, 0);
        if (kt_mode_is_neutral(&mode))
            continue;
        if (shown < most)
            print_mode_row(motion, i, ++shown);
        else
            left++;
    }
    if (left > 0)
        printf("%d more, faster\n", left);
    print_neutral(motion);
    if (length > 0.0)
        printf("Amplitudes: 1 rad turned counts as much as %.3g m slid.\n", length);
    return kt_finish_output(KT_EXIT_DONE);
}

/* ---- JSON -------------------------------------------------------------------------------------------------------- */

static json_t *describe_linear_states(const kt_small_motion *motion, const kt_linear_system *system) {
    json_t *list = json_array();
    const int moving = system->states - system->auxiliary_states;
    for (int i = 0; i < system->states; i++) {
        const bool velocity = i >= system->positions;
        if (i >= moving) {
            json_array_append_new(list, json_sprintf("state.%s", kt_auxiliary_state_name(motion->model, i - moving)));
            continue;
        }
        const int coordinate =
            velocity ? system->velocity_coordinate[i - system->positions] : system->position_coordinate[i];
        json_array_append_new(list, json_sprintf("%s.%s", velocity ? "velocity" : "position",
                                                 kt_name_column(motion->model, coordinate).text));
    }
    return list;
}

static json_t *list_inputs(const kt_small_motion *motion, const kt_linear_system *system) {
    json_t *list = json_array();
    int *coordinates = calloc((size_t)system->inputs + 1, sizeof(int));
    if (coordinates != NULL)
        (void)kt_motor_coordinates(motion->model, coordinates);
    for (int i = 0; i < system->inputs && coordinates != NULL; i++)
        json_array_append_new(list, json_sprintf("motor.%s", kt_name_column(motion->model, coordinates[i]).text));
    free(coordinates);
    return list;
}

/* Lists the outputs, named as the columns of records. */
static json_t *describe_outputs(const kt_model *model) {
    static const char *const parts[] = {"x", "y", "z", "vx", "vy", "vz"};
    json_t *list = json_array();
    for (int body = 0; body < kt_model_body_count(model); body++)
        for (int marker = 0; marker < kt_marker_count(model, body); marker++)
            for (size_t k = 0; k < 6; k++)
                json_array_append_new(list, json_sprintf("marker.%s.%s.%s", kt_body_name(model, body),
                                                         kt_marker_name(model, body, marker), parts[k]));
    return list;
}

/* Returns an object that maps each joint to a list of [re, im], one per coordinate. */
static json_t *describe_mode_shape(const kt_model *model, const double *shape) {
    json_t *object = json_object();
    for (int body = 1; body < kt_model_body_count(model); body++) {
        const kt_coordinates at = kt_body_coordinates(model, body);
        json_t *list = json_array();
        for (int k = at.v; k < at.v + at.nv; k++)
            json_array_append_new(list, kt_json_numbers(shape + 2 * k, 2));
        if (at.nv > 0)
            json_object_set_new(object, kt_joint_name(model, body), list);
        else
            json_decref(list);
    }
    return object;
}

/* Returns the same object for auxiliary states. */
static json_t *describe_auxiliary_states(const kt_model *model, const double *shape) {
    json_t *object = json_object();
    for (int k = 0; k < kt_auxiliary_state_count(model); k++)
        json_object_set_new(object, kt_auxiliary_state_name(model, k), kt_json_numbers(shape + 2 * k, 2));
    return object;
}

static json_t *list_modes(const kt_small_motion *motion) {
    json_t *list = json_array();
    for (int i = 0; i < kt_modes_count(motion->modes); i++) {
        const kt_mode mode = kt_modes_at(motion->modes, i);
        json_t *one =
            json_pack("{s:f, s:f, s:f, s:f, s:f, s:f, s:i, s:b}", "real", mode.real, "imaginary", mode.imaginary,
                      "frequency", mode.frequency, "damping", mode.damping, "error", mode.error, "residual",
                      mode.residual, "count", mode.count, "neutral", (int)kt_mode_is_neutral(&mode));
        json_object_set_new(one, "position", describe_mode_shape(motion->model, kt_modes_positions(motion->modes, i)));
        json_object_set_new(one, "velocity", describe_mode_shape(motion->model, kt_modes_velocities(motion->modes, i)));
        if (kt_auxiliary_state_count(motion->model) > 0)
            json_object_set_new(one, "state",
                                describe_auxiliary_states(motion->model, kt_modes_auxiliary_states(motion->modes, i)));
        json_array_append_new(list, one);
    }
    return list;
}

static json_t *describe_modes(const kt_small_motion *motion, const char *state) {
    const kt_linear_system *system = kt_linearization_system(motion->linearization);
    json_t *root = json_object();
    json_object_set_new(root, "scene", kt_json_text(motion->name));
    json_object_set_new(root, "about", json_string(state));
    json_object_set_new(root, "position", kt_json_by_joint(motion->model, motion->q, false));
    json_object_set_new(root, "velocity", kt_json_by_joint(motion->model, motion->v, true));
    if (system->auxiliary_states > 0)
        json_object_set_new(
            root, "state",
            kt_json_auxiliary_states(motion->model, kt_linearization_auxiliary_states(motion->linearization)));
    json_object_set_new(root, "states", describe_linear_states(motion, system));
    json_object_set_new(root, "inputs", list_inputs(motion, system));
    json_object_set_new(root, "outputs", describe_outputs(motion->model));
    json_object_set_new(root, "state_matrix", kt_json_rows(system->state, system->states, system->states));
    json_object_set_new(root, "input_matrix", kt_json_rows(system->input, system->states, system->inputs));
    json_object_set_new(root, "output_matrix", kt_json_rows(system->output, system->outputs, system->states));
    json_object_set_new(root, "rate", kt_json_numbers(system->rate, system->states));
    json_object_set_new(root, "error", kt_json_number(system->error));
    json_object_set_new(root, "modes", list_modes(motion));
    return root;
}

/* ---- command ----------------------------------------------------------------------------------------------------- */

int kt_command_modes(int argc, char **argv) {
    kt_modes_arguments arguments = {
        .at = -1, .count = 40, .formulation = -1, .period = (double)NAN, .alpha = (double)NAN, .beta = (double)NAN};
    kt_small_motion motion;
    int code = kt_arguments_read(&kt_usage_modes, argc, argv, &arguments, NULL);
    if (code >= 0)
        return code;
    if (arguments.at == KT_MODES_AT_INITIAL && arguments.nearest)
        return kt_misuse("modes: --nearest linearises about an equilibrium, and --at initial about the initial state; "
                         "leave one of them out");
    const kt_file_use uses[] = {
        {"the scene", argv[1], false}, {"--plot", arguments.plot, true}, {"--view", arguments.view, true}};
    if ((code = kt_check_files("modes", uses, 3)) >= 0 ||
        (code = kt_check_ending("--view", arguments.view, ".html")) >= 0 ||
        (arguments.plot != NULL && (code = kt_plot_check(arguments.plot)) >= 0))
        return code;
    if (arguments.sweep != NULL) {
        const kt_modes_request request = {.at = arguments.at,
                                          .nearest = arguments.nearest,
                                          .json = arguments.json,
                                          .dark = arguments.dark,
                                          .rotating = arguments.rotating,
                                          .count = arguments.count,
                                          .orders = arguments.orders,
                                          .plot = arguments.plot};
        return kt_modes_sweep_print(arguments.sweep, argv[1], &arguments.settings, &request);
    }
    code = kt_small_motion_open(&motion, argv[1], &arguments.settings);
    if (!isnan(arguments.period)) {
        if (code == KT_EXIT_DONE) {
            kt_say_left_out("modes: --period", &motion.scene);
            code = kt_modes_print_period(&motion, arguments.period, arguments.steps, arguments.json);
        }
        kt_small_motion_close(&motion);
        return code;
    }
    const char *state = "";
    motion.rotating = arguments.rotating;
    if (code == KT_EXIT_DONE)
        code = kt_modes_prepare(&motion, arguments.at, arguments.nearest, &state);
    if (code == KT_EXIT_DONE) {
        if (arguments.formulation >= 0)
            code = kt_modes_print_formulation(&motion, (kt_constraint_formulation_type)arguments.formulation,
                                              arguments.alpha, arguments.beta, arguments.json);
        else
            code = arguments.json ? kt_json_write(describe_modes(&motion, state), "-")
                                  : print_mode_table(&motion, state, arguments.count);
        if (code == KT_EXIT_DONE && arguments.view != NULL)
            code = kt_modes_view(&motion, state, arguments.view, arguments.count, false);
        if (code == KT_EXIT_DONE && arguments.plot != NULL)
            code = arguments.bars ? kt_modes_draw_bars(&motion, state, arguments.plot, arguments.count, arguments.dark)
                                  : kt_modes_draw(&motion, state, arguments.plot, arguments.count, arguments.dark);
    }
    kt_small_motion_close(&motion);
    return code;
}
