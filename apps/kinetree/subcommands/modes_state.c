/* The state about which modes are. */
#include "subcommands/modes.h"

#include "command.h"

#include <math.h>

static int choose_state(kt_small_motion *motion, int at, bool nearest) {
    kt_error error = {0};
    const bool moves = kt_small_motion_moves(motion), asked = at == KT_MODES_AT_EQUILIBRIUM || nearest;
    if (at == KT_MODES_AT_INITIAL || (moves && !asked))
        return KT_EXIT_DONE;
    const kt_status status = kt_small_motion_settle(motion, nearest, &error);
    if (status == KT_OK)
        return KT_EXIT_DONE;
    kt_say_error(&error);
    if (asked)
        return kt_exit_code(status);
    kt_say("these are the modes about the initial state instead");
    return KT_EXIT_DONE;
}

/* Returns whether the motion is steady. The acceleration, its rate and the rates of the auxiliary states are then zero.
 * The rate of the acceleration is d/dt a = state x' (the lower rows). */
static bool motion_is_steady(const kt_linear_system *system) {
    const double scale = fmax(1.0, system->speed * system->speed);
    if (system->acceleration > 1e-9 * scale)
        return false;
    for (int i = system->states - system->own_states; i < system->states; i++)
        if (fabs(system->rate[i]) > 1e-9 * scale)
            return false;
    for (int i = system->positions; i < system->positions + system->velocities; i++) {
        double sum = 0.0;
        for (int j = 0; j < system->states; j++)
            sum += system->state[(size_t)j * (size_t)system->states + (size_t)i] * system->rate[j];
        const double unit = system->unit[system->velocity_coordinate[i - system->positions]];
        if (fabs(sum) / unit > 1e-8 * scale * fmax(1.0, system->speed))
            return false;
    }
    return true;
}

static const char *name_linear_state(const kt_small_motion *motion, const kt_linear_system *system) {
    if (motion->settled)
        return "equilibrium";
    if (system->speed > 1e-12)
        return motion_is_steady(system) ? "steady motion" : "motion";
    return system->acceleration > 1e-9 || (system->own_states > 0 && !motion_is_steady(system)) ? "initial position"
                                                                                                : "equilibrium";
}

static void warn_of_state(const kt_linear_system *system, const char *state) {
    if (state[0] == 'm')
        kt_say("the initial state is part of a motion that changes, so these modes describe an instant only; --at "
               "equilibrium linearises about the position of rest");
    if (state[0] == 'i')
        kt_say("the initial position is not an equilibrium, so these modes describe an instant only");
    if (system->near_singular)
        kt_say(
            "loops are near a singular position, where the number of degrees of freedom changes: expect large errors");
    if (system->error > 1e-6)
        kt_say("the linearisation is uncertain by %.1g of its largest number: a force has a kink or a jump %s",
               system->error, system->exact ? "at this very state, such as a stop that just touches" : "nearby");
}

int kt_modes_prepare(kt_small_motion *motion, int at, bool nearest, const char **state) {
    int code = choose_state(motion, at, nearest);
    if (code == KT_EXIT_DONE)
        code = kt_small_motion_linearize(motion);
    if (code != KT_EXIT_DONE)
        return code;
    const kt_linear_system *system = kt_linearization_system(motion->linearization);
    *state = name_linear_state(motion, system);
    if (system->states > 0)
        warn_of_state(system, *state);
    return KT_EXIT_DONE;
}
