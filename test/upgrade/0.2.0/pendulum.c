/* SPDX-License-Identifier: Apache-2.0 */
#include <kinetree/kinetree.h>
#include <stdio.h>

int main(void) {
    kt_body rod = kt_body_default();
    rod.name = "rod";
    rod.joint.type = KT_JOINT_REVOLUTE; /* about z */
    rod.joint.position[0] = 1.0;
    rod.mass = 2.0;
    rod.com = kt_vec3_make(0.0, -0.5, 0.0);
    kt_description pendulum = kt_description_default();
    pendulum.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    pendulum.bodies = &rod;
    pendulum.body_count = 1;

    kt_error error;
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    if (kt_model_compile(&pendulum, NULL, &model, &error) ||
        kt_simulation_create(model, NULL, NULL, &simulation, &error) || kt_simulation_advance(simulation, 1.0, &error))
        return fprintf(stderr, "%s: %s\n", error.where, error.message), 1;
    printf("after 1 s the angle is %.9f rad\n", kt_simulation_positions(simulation)[0]);
    kt_simulation_free(simulation);
    kt_model_free(model);
    return 0;
}
