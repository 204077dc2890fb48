/* Prints the bits of states of all bundled scenes after some steps, to compare two builds of the engine.
 *
 *     bits FOLDER STEPS
 *
 * A scene that an engine rejects prints the status. Evaluations before the steps use accelerations, forces and energy.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/dynamics.h"
#include "kinetree/scene.h"

#include <dirent.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void print_bits(const char *what, const double *values, int count) {
    printf(" %s", what);
    for (int i = 0; i < count; i++) {
        uint64_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        printf(" %016" PRIx64, bits);
    }
}

static void print_record(const kt_model *model, const kt_record *record) {
    const double energies[] = {record->t, record->kinetic, record->potential};
    print_bits("time, energies", energies, 3);
    print_bits("q", record->q, kt_model_nq(model));
    print_bits("v", record->v, kt_model_nv(model));
    print_bits("x", record->x, kt_auxiliary_state_count(model));
    print_bits("a", record->a, kt_model_nv(model));
}

static kt_status print_states(kt_scene *scene, int steps, kt_error *error) {
    scene->run.record |= KT_RECORD_ENERGY | KT_RECORD_ACCELERATION;
    kt_model_options options = kt_model_options_default();
    options.metric = scene->run.metric;
    options.plan = scene->run.plan;
    options.settable = kt_scene_needs_settable(scene);
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    kt_status status = kt_model_compile(&scene->description, &options, &model, error);
    if (status == KT_OK)
        status = kt_simulation_create(model, &scene->run, NULL, &simulation, error);
    for (int k = 0; k < steps && status == KT_OK; k++)
        status = kt_simulation_step(simulation, HUGE_VAL, error);
    if (simulation != NULL) {
        kt_record record;
        if (kt_simulation_sense(simulation, &record, error) == KT_OK)
            print_record(model, &record);
    }
    kt_simulation_free(simulation);
    kt_model_free(model);
    return status;
}

static int is_scene(const struct dirent *entry) {
    const char *end = strrchr(entry->d_name, '.');
    return end != NULL && strcmp(end, ".yaml") == 0;
}

int main(int argc, char **argv) {
    struct dirent **entries;
    const int count = argc == 3 ? scandir(argv[1], &entries, is_scene, alphasort) : 0;
    for (int i = 0; i < count; i++) {
        char path[4096];
        kt_error error = {0};
        kt_scene scene;
        (void)snprintf(path, sizeof path, "%s/%s", argv[1], entries[i]->d_name);
        printf("%s", entries[i]->d_name);
        kt_status status = kt_scene_read(path, &scene, NULL, NULL, &error);
        if (status == KT_OK) {
            status = print_states(&scene, atoi(argv[2]), &error);
            kt_scene_free(&scene);
        }
        printf(" status %d %s\n", (int)status, error.message);
        free(entries[i]);
    }
    if (count > 0)
        free(entries);
    return count > 0 ? 0 : 2;
}
