/* A sampled control law in a program, for comparison with the same law in an FMU:
 *
 *     sampled SCENE PERIOD STIFFNESS DAMPING COUNT
 *
 * The scene has one joint and one auxiliary state, the torque in it. Prints time, position and velocity at the end of
 * each period.
 */
#include "kinetree/kinetree.h"
#include "kinetree/scene.h"

#include <stdio.h>
#include <stdlib.h>

static int report(const kt_error *error) {
    fprintf(stderr, "%s: %s\n", error->where, error->message);
    return 1;
}

static kt_status follow(kt_simulation *simulation, char **argv, kt_error *error) {
    const double *q = kt_simulation_positions(simulation), *v = kt_simulation_velocities(simulation);
    const double period = strtod(argv[2], NULL), stiffness = strtod(argv[3], NULL), damping = strtod(argv[4], NULL);
    kt_status status = KT_OK;
    for (long k = strtol(argv[5], NULL, 10); status == KT_OK && k > 0; k--) {
        const double torque = -stiffness * q[0] - damping * v[0];
        status = kt_simulation_set_own_states(simulation, &torque, error);
        if (status == KT_OK)
            status = kt_simulation_tick(simulation, period, error);
        printf("%.17g,%.17g,%.17g\n", kt_simulation_time(simulation), q[0], v[0]);
    }
    return status;
}

int main(int argc, char **argv) {
    kt_error error = {0};
    kt_scene scene = kt_scene_default();
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    if (argc != 6)
        return 1;
    kt_status status = kt_scene_read(argv[1], &scene, NULL, NULL, &error);
    if (status == KT_OK)
        status = kt_model_compile(&scene.description, NULL, &model, &error);
    if (status == KT_OK)
        status = kt_simulation_create(model, &scene.run, NULL, &simulation, &error);
    if (status == KT_OK)
        status = follow(simulation, argv, &error);
    kt_simulation_free(simulation);
    kt_model_free(model);
    kt_scene_free(&scene);
    return status == KT_OK ? 0 : report(&error);
}
