/* A mechanism from a file, ready to run. One call makes the calls that a program would make one by one, and one call
 * releases all results. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/require.h"
#include "kinetree/import.h"

#include <stdlib.h>
#include <string.h>

/* Files in YAML are scenes. All other files describe robots, and their first element determines the format. */
static bool is_scene(const char *path) {
    const char *dot = strrchr(path, '.');
    return dot != NULL && (strcmp(dot, ".yaml") == 0 || strcmp(dot, ".yml") == 0);
}

/* A copy of the model, whose parameters can be set. */
static kt_status copy_model(kt_mechanism *m, kt_error *error) {
    const size_t size = kt_model_size(m->compiled);
    m->memory = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    if (m->memory == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, "", "there is not enough memory for the model");
    return kt_model_copy(m->compiled, m->memory, size, &m->model, error);
}

static kt_status build(kt_mechanism *m, const kt_run *given, kt_error *error) {
    kt_simulation_options options = kt_simulation_options_default();
    options.events = kt_scene_event_room(&m->scene);
    options.contact = m->scene.contact;
    kt_status status = kt_model_compile(&m->scene.description, NULL, &m->compiled, error);
    if (status != KT_OK)
        (void)kt_scene_locate(&m->scene, error);
    if (status == KT_OK)
        status = copy_model(m, error);
    if (status == KT_OK)
        status = kt_data_create(m->model, &m->data, error);
    if (status == KT_OK)
        status = kt_simulation_create(m->model, given ? given : &m->scene.run, &options, &m->simulation, error);
    if (status == KT_OK)
        status = kt_scene_watch_create(&m->scene, m->model, m->simulation, NULL, -1, &m->watch, error);
    return status;
}

kt_status kt_mechanism_load(const char *path, const kt_robot_options *options, const kt_run *run,
                            kt_mechanism *mechanism, kt_error *error) {
    if (KT_IS_MISSING(error, path, mechanism))
        return KT_ERROR_ARGUMENT;
    kt_mechanism m = {.scene = kt_scene_default()};
    kt_status status = is_scene(path) ? kt_scene_read(path, &m.scene, NULL, NULL, error)
                                      : kt_robot_read(path, options, &m.scene, NULL, NULL, error);
    if (status == KT_OK)
        status = build(&m, run, error);
    if (status == KT_OK)
        *mechanism = m;
    else
        kt_mechanism_free(&m);
    return status;
}

void kt_mechanism_free(kt_mechanism *mechanism) {
    if (mechanism == NULL)
        return;
    kt_simulation_free(mechanism->simulation);
    kt_scene_watch_free(mechanism->watch);
    kt_data_free(mechanism->data);
    kt_model_free(mechanism->compiled);
    free(mechanism->memory);
    kt_scene_free(&mechanism->scene);
    *mechanism = (kt_mechanism){.scene = mechanism->scene};
}
