/* Loads scenes for the subcommands, with the state that they start from. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/load.h"

#include "records/output.h"

#include <math.h>
#include <stdlib.h>

int kt_check_scene_files(const kt_scene *scene) {
    const char *path;
    int code = -1;
    for (size_t k = 0; code < 0 && (path = kt_scene_file(scene, k)) != NULL; k++)
        code = kt_check_input("a file that the scene reads", path);
    for (int i = 0; code < 0 && i < scene->mesh_count; i++) /* also those of robots */
        code = kt_check_input("a file that the scene reads", scene->meshes[i].file);
    return code;
}

int kt_read_scene_from(const char *path, const kt_settings *settings, const char *from, kt_scene *scene) {
    int code = kt_read_scene_as_written(path, settings, scene);
    if (code != KT_EXIT_DONE)
        return code;
    if (kt_check_scene_files(scene) >= 0) {
        code = KT_EXIT_USAGE;
    } else if (from != NULL || scene->from != NULL) {
        char *folder = from == NULL ? kt_folder_of(path) : NULL;
        code = kt_start_from(scene, from != NULL ? from : scene->from, folder);
        free(folder);
    }
    if (code != KT_EXIT_DONE)
        kt_scene_free(scene);
    return code;
}

int kt_read_scene(const char *path, const kt_settings *settings, kt_scene *scene) {
    return kt_read_scene_from(path, settings, NULL, scene);
}

/* Counts as kt_contact_count. *first: the first of these loops, unset if there is none. */
static int count_contacts(const kt_model *model, int *first) {
    int count = 0;
    for (int i = kt_loop_count(model) - 1; i >= 0; i--)
        if (kt_loop_side(model, i) != KT_SIDE_NONE || kt_loop_is_stick(model, i)) {
            count++;
            *first = i;
        }
    return count;
}

int kt_contact_count(const kt_model *model) {
    int first = 0;
    return count_contacts(model, &first);
}

int kt_reject_contacts(const char *command, const kt_model *model) {
    int first = 0;
    const int count = count_contacts(model, &first);
    if (count == 0)
        return -1;
    return kt_reject(KT_EXIT_SCENE,
                     "%s: '%s'%s: other formulations and engines have no hard stops, contacts, slack ropes or friction "
                     "that sticks; make them elastic (stiffness)",
                     command, kt_show(kt_loop_name(model, first)).text, count > 1 ? " and others" : "");
}

/* Releases the hard parts of copies of a scene's loops and effects, with the same indices. Friction that sticks keeps
 * its viscous part. Returns the number of hard parts, and in *first the first one. */
static int release_hard_parts(const kt_description *d, kt_loop *loops, kt_effect *effects, const char **first) {
    int count = 0;
    for (int i = 0; i < d->loop_count; i++) {
        loops[i] = d->loops[i];
        if (loops[i].side == KT_SIDE_NONE && !loops[i].slack)
            continue;
        loops[i].switching = KT_SWITCHED_OFF;
        *first = count++ == 0 ? loops[i].name : *first;
    }
    for (int i = 0; i < d->effect_count; i++) {
        kt_effect *effect = &effects[i];
        *effect = d->effects[i];
        const bool is_hard =
            (effect->type == KT_EFFECT_JOINT_LIMIT || effect->type == KT_EFFECT_CONTACT) && !isinf(effect->restitution);
        const bool sticks = effect->type == KT_EFFECT_JOINT_FRICTION && effect->stick;
        if (!is_hard && !sticks)
            continue;
        const char *of = effect->joint != NULL ? effect->joint : effect->between[0].body;
        *first = count++ == 0 ? effect->name != NULL ? effect->name : of : *first;
        if (is_hard)
            effect->switching = KT_SWITCHED_OFF;
        const kt_effect standard = kt_effect_default();
        effect->stick = is_hard ? effect->stick : standard.stick;
        effect->coulomb = is_hard ? effect->coulomb : 0.0;
        effect->breakaway = is_hard ? effect->breakaway : 0.0;
        effect->stribeck = is_hard ? effect->stribeck : standard.stribeck;
    }
    return count;
}

int kt_compile_without_contacts(const kt_scene *scene, kt_model **model, bool *lacks) {
    const kt_description *d = &scene->description;
    kt_loop *loops = calloc((size_t)d->loop_count + 1, sizeof *loops);
    kt_effect *effects = calloc((size_t)d->effect_count + 1, sizeof *effects);
    const char *first = NULL;
    int code = KT_EXIT_INTEGRATION;
    if (loops == NULL || effects == NULL) {
        kt_say("there is not enough memory");
    } else {
        const int count = release_hard_parts(d, loops, effects, &first);
        kt_scene released = *scene;
        *lacks = count > 0;
        released.description.loops = loops;
        released.description.effects = effects;
        if (count > 0)
            kt_say("left out: '%s'%s (hard stops, contacts, slack ropes, friction that sticks); `run` has them",
                   kt_show(first).text, count > 1 ? " and others" : "");
        code = kt_compile_scene(count > 0 ? &released : scene, model);
    }
    free(loops);
    free(effects);
    return code;
}

void kt_say_left_out(const char *command, const kt_scene *scene) {
    const int count = kt_scene_event_room(scene);
    if (count > 0)
        kt_say("%s: event '%s'%s left out, so the results are those of the motion without events; 'kinetree run' "
               "watches events",
               command, kt_show(scene->event_count > 0 ? scene->events[0].name : scene->until.name).text,
               count > 1 ? " and others are" : " is");
}

int kt_reject_method(const char *where, const char *name) {
    kt_nearest nearest = kt_nearest_make(name, NULL);
    for (int i = 0; i < kt_method_count(); i++)
        (void)kt_nearest_try(&nearest, kt_method_at(i)->name);
    return kt_misuse("%s: there is no method '%s'%s", where, name,
                     kt_ask(&nearest, "", "; 'kinetree integrators' lists them").text);
}

int kt_load_model(const char *path, const kt_settings *settings, kt_scene *scene, kt_model **model) {
    int code = kt_read_scene(path, settings, scene);
    if (code != KT_EXIT_DONE)
        return code;
    code = kt_compile_scene(scene, model);
    if (code != KT_EXIT_DONE)
        kt_scene_free(scene);
    return code;
}

int kt_use_model(const char *path, const kt_settings *settings, kt_model_use *use, const void *user) {
    kt_scene scene;
    kt_model *model = NULL;
    int code = kt_load_model(path, settings, &scene, &model);
    if (code != KT_EXIT_DONE)
        return code;
    code = use(&scene, model, user);
    kt_model_free(model);
    kt_scene_free(&scene);
    return code;
}
