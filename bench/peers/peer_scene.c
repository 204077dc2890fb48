/* SPDX-License-Identifier: Apache-2.0 */
#include "peer_scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool fail(peer_request *request, const char *why) {
    (void)snprintf(request->reason, PEER_REASON, "%.299s", why);
    return false;
}

static bool find_start(peer_request *request, peer_scene *scene) {
    equations *e = &scene->e;
    if (kt_kinematics_update(e->model, e->data, e->start, e->start + e->nq, NULL, &e->error) != KT_OK)
        return fail(request, e->error.message);
    for (int b = 1; b < kt_model_body_count(e->model); b++) {
        const int i = kt_body_source(e->model, b), up = kt_body_parent(e->model, b);
        scene->parent[i] = up > 0 ? kt_body_source(e->model, up) : -1;
    }
    const kt_twin twin = peer_scene_twin(scene);
    kt_twin_read(e->model, e->data, &twin);
    return true;
}

bool peer_scene_open(peer_request *request, peer_scene *scene) {
    kt_scene_options options = kt_scene_options_default();
    options.settings = request->settings;
    options.setting_count = request->setting_count;
    memset(scene, 0, sizeof *scene);
    scene->is_open = true;
    if (!equations_open(&scene->e, request->scene, &options, KT_ISA_AUTO))
        return fail(request, "the scene cannot be read");
    if (!kt_twin_known(&scene->e.scene.description))
        return fail(request, "an effect, a joint or a loop of the scene is not built in this engine");
    scene->count = scene->e.scene.description.body_count;
    const size_t room = (size_t)scene->count + 1;
    scene->parent = calloc(room, sizeof *scene->parent);
    scene->pose = calloc(room, sizeof *scene->pose);
    scene->twist = calloc(room, sizeof *scene->twist);
    if (!(scene->parent && scene->pose && scene->twist))
        return fail(request, "there is not enough memory");
    return find_start(request, scene);
}

void peer_scene_close(peer_scene *scene) {
    if (scene->is_open)
        equations_close(&scene->e);
    free(scene->parent);
    free(scene->pose);
    free(scene->twist);
}

kt_twin peer_scene_twin(const peer_scene *scene) {
    return (kt_twin){&scene->e.scene.description, scene->parent, scene->pose, scene->twist, NULL};
}

void peer_pose_write(kt_pose pose, double *numbers) {
    const kt_quat r = kt_quat_from_mat3(pose.rotation);
    const double all[PEER_POSE] = {pose.position.x, pose.position.y, pose.position.z, r.w, r.x, r.y, r.z};
    memcpy(numbers, all, sizeof all);
}
