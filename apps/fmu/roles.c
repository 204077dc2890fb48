/* Roles of parameters (roles.h): the scene is read with each parameter as its only variable. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "roles.h"

#include "reference.h"

/* Reads the scene with one variable, its k-th parameter. */
static bool read_with_variable(const char *text, size_t size, const kt_scene *scene, int k, kt_scene *other) {
    kt_error error;
    kt_scene_options options = kt_scene_options_default();
    options.variables = &scene->parameters[k].name;
    options.values = &scene->parameters[k].value;
    options.variable_count = 1;
    return kt_scene_parse_with(KT_FMU_SCENE, text, size, &options, other, NULL, NULL, &error) == KT_OK;
}

void kt_fmu_find_roles(const char *text, size_t size, const kt_scene *scene, kt_fmu_role *roles) {
    kt_scene other;
    for (int k = 0; k < scene->parameter_count; k++)
        roles[k] = KT_FMU_FIXED;
    for (int k = 0; k < scene->parameter_count; k++) {
        if (!read_with_variable(text, size, scene, k, &other))
            continue;
        if (kt_scene_is_tunable(&other) && roles[k] == KT_FMU_FIXED)
            roles[k] = KT_FMU_TUNABLE;
        for (int i = 0; i < scene->parameter_count; i++)
            if (kt_scene_parameter_follows(&other, i))
                roles[i] = KT_FMU_FOLLOWS_FIXED;
        kt_scene_free(&other);
    }
    for (int k = 0; k < scene->parameter_count; k++) {
        if (roles[k] != KT_FMU_TUNABLE || !read_with_variable(text, size, scene, k, &other))
            continue;
        for (int i = 0; i < scene->parameter_count; i++)
            if (kt_scene_parameter_follows(&other, i))
                roles[i] = KT_FMU_FOLLOWS_TUNABLE;
        kt_scene_free(&other);
    }
}
