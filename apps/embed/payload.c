/* payload ROBOT BODY.mass KG: computed torque at 1 kHz. After 2 s the body has this mass, also in the controller. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <kinetree/experimental.h>
#include <kinetree/kinetree.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { MOST = 32, TICKS = 4000 };

int main(int argc, char **argv) {
    kt_mechanism robot = {.model = NULL};
    kt_parameter mass;
    kt_error error = {.where = "payload", .message = "give ROBOT BODY.mass KG, and at most 32 joints"};
    double start[MOST], a[MOST], tau[MOST], worst[2] = {0.0}, kg = argc == 4 ? strtod(argv[3], NULL) : 0.0;
    int failed = argc != 4 || kt_mechanism_load(argv[1], NULL, NULL, &robot, &error) ||
                 kt_model_nv(robot.model) > MOST || kt_parameter_find(robot.model, argv[2], &mass, &error);
    const double *q = kt_simulation_positions(robot.simulation), *v = kt_simulation_velocities(robot.simulation);
    for (int k = 0; k < TICKS && !failed; k++) {
        for (int i = 0; i < kt_model_nv(robot.model); i++) {
            const double w = 1.0 + 0.5 * i, s = sin(1e-3 * k * w), c = cos(1e-3 * k * w);
            start[i] = k ? start[i] : q[i];
            const double off = start[i] + 0.3 * (1.0 - c) - q[i];
            a[i] = 0.3 * w * w * c + 60.0 * (0.3 * w * s - v[i]) + 900.0 * off;
            worst[2 * k / TICKS] = fmax(worst[2 * k / TICKS], fabs(off));
        }
        failed = (2 * k == TICKS && kt_simulation_set_parameter(robot.simulation, robot.model, &mass, &kg, &error)) ||
                 kt_dynamics_inverse(robot.model, robot.data, q, v, a, NULL, tau, &error) ||
                 kt_simulation_set_torque(robot.simulation, tau, &error) ||
                 kt_simulation_tick(robot.simulation, 1e-3, &error);
    }
    failed ? fprintf(stderr, "%s: %s\n", error.where, error.message)
           : printf("largest error %.3g rad before, %.3g rad with the payload\n", worst[0], worst[1]);
    kt_mechanism_free(&robot);
    return failed;
}
