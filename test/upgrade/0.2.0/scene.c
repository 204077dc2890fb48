/* Reads a scene and runs it by ticks of 1 ms. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <kinetree/kinetree.h>
#include <kinetree/scene.h>
#include <stdio.h>

int main(void) {
    kt_error error = {0};
    kt_scene scene;
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    if (kt_scene_read("four-bar.yaml", &scene, NULL, NULL, &error) != KT_OK ||
        kt_model_compile(&scene.description, NULL, &model, &error) != KT_OK ||
        kt_simulation_create(model, NULL, NULL, &simulation, &error) != KT_OK) {
        fprintf(stderr, "%s: %s\n", error.where, error.message);
        return 1;
    }
    printf("%d coordinates, %d of them independent\n", kt_model_nv(model), kt_model_mobility(model).minimal);
    for (int k = 1; k <= 1000; k++)
        if (kt_simulation_advance(simulation, 1e-3 * k, &error) != KT_OK) {
            fprintf(stderr, "%s: %s\n", error.where, error.message);
            return 1;
        }
    for (int i = 0; i < kt_model_nq(model); i++)
        printf("%.7f rad, %.7f rad/s\n", kt_simulation_positions(simulation)[i],
               kt_simulation_velocities(simulation)[i]);
    kt_simulation_free(simulation);
    kt_model_free(model);
    kt_scene_free(&scene);
    return 0;
}
