/* The state about which modes are. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/modes.h"

#include "command.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A motion of constant velocities whose state matrix is not constant. */
static const char periodic_motion[] = "motion";

static int choose_state(kt_small_motion *motion, int at, bool nearest) {
    kt_error error = {0};
    if (motion->rotating != NULL)
        return kt_small_motion_rotate(motion, motion->rotating, nearest);
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
    for (int i = system->states - system->auxiliary_states; i < system->states; i++)
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

/* ---- constant matrices along a steady motion --------------------------------------------------------------------- */

/* The acceleration of a steady motion is zero, and its coordinates move along q (+) v t. The state matrix is not always
 * constant there. The coordinates of a wheel with a free joint turn with the wheel, so its matrix is periodic. Modes
 * decide the stability of a constant matrix only. The matrix is therefore compared with those of two later moments. */

/* Returns the size of a large change of a state: that of its coordinate, or 1 for an auxiliary state. */
static double size_of_state(const kt_linear_system *system, int i) {
    if (i >= system->positions + system->velocities)
        return 1.0;
    return system->unit[i < system->positions ? system->position_coordinate[i]
                                              : system->velocity_coordinate[i - system->positions]];
}

/* Returns whether two linear systems have the same states. The choice among equivalent coordinates may be left to
 * rounding. */
static bool states_agree(const kt_linear_system *a, const kt_linear_system *b) {
    return a->positions == b->positions && a->velocities == b->velocities &&
           a->auxiliary_states == b->auxiliary_states &&
           memcmp(a->position_coordinate, b->position_coordinate, (size_t)a->positions * sizeof(int)) == 0 &&
           memcmp(a->velocity_coordinate, b->velocity_coordinate, (size_t)a->velocities * sizeof(int)) == 0;
}

/* Returns whether two state matrices agree. Row by row, they may differ by 10 estimated errors, and by 1e-8 of the
 * largest number of the row, over the sizes of the states. */
static bool matrices_agree(const kt_linear_system *a, const kt_linear_system *b) {
    const size_t n = (size_t)a->states;
    if (!states_agree(a, b))
        return false;
    for (int i = 0; i < a->states; i++) {
        double largest = 0.0;
        for (int j = 0; j < a->states; j++)
            largest = fmax(largest, fabs(a->state[(size_t)j * n + (size_t)i]) * size_of_state(a, j));
        for (int j = 0; j < a->states; j++) {
            const size_t at = (size_t)j * n + (size_t)i;
            const double error = 10.0 * (a->state_error[at] + b->state_error[at]);
            if (!(fabs(a->state[at] - b->state[at]) <= error + 1e-8 * largest / size_of_state(a, j)))
                return false;
        }
    }
    return true;
}

/* Returns whether the state matrix is the same at a later moment of a steady motion. later: a linearisation. moved: nq
 * + nv numbers. A state that cannot be linearised has another matrix. */
static bool matrix_is_same_at(const kt_small_motion *motion, double time, kt_linearization *later, double *moved) {
    double *q = moved, *change = moved + kt_model_nq(motion->model);
    const int nv = kt_model_nv(motion->model), own = kt_auxiliary_state_count(motion->model);
    for (int i = 0; i < nv; i++)
        change[i] = time * motion->v[i];
    kt_position_add(motion->model, motion->q, change, q);
    if (own > 0)
        memcpy(kt_linearization_auxiliary_states(later), kt_linearization_auxiliary_states(motion->linearization),
               (size_t)own * sizeof(double));
    return kt_linearization_evaluate(later, time, q, motion->v, NULL, NULL) == KT_OK &&
           matrices_agree(kt_linearization_system(motion->linearization), kt_linearization_system(later));
}

/* Returns whether the state matrix is constant along a steady motion. The two moments are the times of unequal angles
 * of the fastest coordinate, within the duration of the scene. */
static bool matrix_is_constant(const kt_small_motion *motion, const kt_linear_system *system) {
    const double duration = motion->scene.run.duration, turn = 1.0 / system->speed;
    const double unit = duration > 0.0 ? fmin(turn, duration) : turn;
    const size_t numbers = (size_t)kt_model_nq(motion->model) + (size_t)kt_model_nv(motion->model);
    double *moved = calloc(numbers + 1, sizeof *moved);
    kt_linearization *later = NULL;
    const bool constant = moved != NULL && kt_linearization_create(motion->model, NULL, &later, NULL) == KT_OK &&
                          matrix_is_same_at(motion, 0.37 * unit, later, moved) &&
                          matrix_is_same_at(motion, unit, later, moved);
    kt_linearization_free(later);
    free(moved);
    return constant;
}

/* ---- the name of the state --------------------------------------------------------------------------------------- */

static const char *name_linear_state(const kt_small_motion *motion, const kt_linear_system *system) {
    if (motion->settled)
        return motion->rotating != NULL ? "equilibrium in the rotating frame" : "equilibrium";
    if (system->speed > 1e-12) {
        const bool steady = motion_is_steady(system);
        return !steady ? "motion" : matrix_is_constant(motion, system) ? "steady motion" : periodic_motion;
    }
    return system->acceleration > 1e-9 || (system->auxiliary_states > 0 && !motion_is_steady(system))
               ? "initial position"
               : "equilibrium";
}

static void warn_of_state(const kt_linear_system *system, const char *state) {
    if (state == periodic_motion)
        kt_say("the velocities of this motion are constant, but its state matrix changes along it, as if coordinates "
               "turn with a body. These modes describe an instant only, and do not decide the stability; --period S "
               "does, for a motion that repeats itself after S seconds");
    else if (state[0] == 'm')
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

/* A shape with a larger residual is drawn wrongly by more than the width of a line. */
#define RELIABLE 1e-3

static void warn_of_shapes(const kt_small_motion *motion) {
    int count = 0;
    kt_mode worst = {.residual = 0.0};
    for (int i = 0; i < kt_modes_count(motion->modes); i++) {
        const kt_mode mode = kt_modes_at(motion->modes, i);
        if (kt_mode_is_neutral(&mode) || mode.residual <= RELIABLE)
            continue;
        count++;
        worst = mode.residual > worst.residual ? mode : worst;
    }
    if (count > 0)
        kt_say(
            "%d mode%s unreliable: the shape with |lambda| = %.4g 1/s leaves %.1g of the terms of A x - lambda x; the "
            "eigenvalues are right to their errors, and --json lists each residual",
            count, count == 1 ? " has a shape that is" : "s have shapes that are", kt_mode_modulus(&worst),
            worst.residual);
}

int kt_modes_prepare(kt_small_motion *motion, int at, bool nearest, const char **state) {
    int code = choose_state(motion, at, nearest);
    if (code == KT_EXIT_DONE)
        code = kt_small_motion_linearize(motion);
    if (code != KT_EXIT_DONE)
        return code;
    const kt_linear_system *system = kt_linearization_system(motion->linearization);
    *state = name_linear_state(motion, system);
    if (motion->is_repeated)
        return KT_EXIT_DONE;
    if (system->states > 0)
        warn_of_state(system, *state);
    warn_of_shapes(motion);
    return KT_EXIT_DONE;
}
