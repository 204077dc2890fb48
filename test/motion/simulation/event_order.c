/* Methods keep their order across events. The oracle is the same motion without events, computed to rounding. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scenes.h"

#include <math.h>

static int angle(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error;
    (void)user;
    *value = at->q[0];
    return 0;
}

static int throw_back(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    const double v = -kt_simulation_velocities(simulation)[0];
    (void)what;
    ++*(int *)user;
    return kt_simulation_jump(simulation, NULL, &v, error) == KT_OK ? 0 : -1;
}

/* A pendulum that is thrown back by a wall below its joint moves as |theta| of one without a wall. Returns the largest
 * error of angle and speed after 20 s, some 19 walls. */
static double error_behind_walls(const kt_model *model, const char *method, double step, const double *expected,
                                 int *walls) {
    kt_error error = {0};
    const kt_run run = kt_run_fixed(method, step, 20.0);
    kt_simulation_options options = kt_simulation_options_default();
    options.events = 1;
    kt_simulation *simulation = kt_test_simulation(model, &run, &options);
    *walls = 0;
    const kt_event wall = {
        .name = "wall", .function = angle, .action = throw_back, .user = walls, .direction = KT_DIRECTION_FALLING};
    (void)kt_fine("adds an event", kt_simulation_event_add(simulation, &wall, &error), &error);
    (void)kt_fine(method, kt_simulation_advance(simulation, 20.0, &error), &error);
    const double turn = fabs(kt_simulation_positions(simulation)[0] - fabs(expected[0]));
    const double speed = fabs(fabs(kt_simulation_velocities(simulation)[0]) - fabs(expected[1]));
    return fmax(turn, speed);
}

static double time_of_wall(const kt_model *model, double *state) {
    kt_run run = kt_run_default();
    run.integrator = "dop853";
    run.relative = run.absolute = 1e-14;
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_test_advance(simulation, 20.0);
    state[0] = kt_simulation_positions(simulation)[0];
    state[1] = kt_simulation_velocities(simulation)[0];
    const double t = kt_simulation_time(simulation);
    return t;
}

KT_TEST(methods_keep_their_order_across_events) {
    static const struct {
        const char *name;
        double order, step;
    } methods[] = {{"heun", 2, 0.02}, {"kutta3", 3, 0.02}, {"rk4", 4, 0.01},  {"dopri5", 5, 0.08}, {"dop853", 8, 0.3},
                   {"ab4", 4, 0.01},  {"bdf2", 2, 0.01},   {"rkc2", 2, 0.02}, {"radau5", 5, 0.1}};
    kt_lone lone;
    double expected[2];
    kt_pendulum_make(&lone, 1.0, 0.3);
    kt_model *model = kt_scene_compile(&lone.description);
    if (isfinite(time_of_wall(model, expected)))
        for (size_t m = 0; m < sizeof methods / sizeof methods[0]; m++) {
            int walls = 0;
            if (kt_method_find(methods[m].name) == NULL)
                continue;
            const double coarse = error_behind_walls(model, methods[m].name, methods[m].step, expected, &walls);
            const double fine = error_behind_walls(model, methods[m].name, 0.5 * methods[m].step, expected, &walls);
            kt_note("%s: %.3g, %.3g, %d walls", methods[m].name, coarse, fine, walls);
            kt_check_above("walls", walls, 15);
            kt_check_above("order", log2(coarse / fine), methods[m].order - 0.35);
        }
}
