/* A page that animates the modes of a scene. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/modes.h"

#include "command.h"
#include "kinetree/dynamics.h"
#include "open/deflection.h"
#include "records/output.h"
#include "view/view.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* The modes that a page shows, with their titles and screws. */
typedef struct shown_modes {
    int *modes, count;
    kt_view_mode *list;
    kt_mode_title *titles;
    double *screws; /* [mode][body][12] */
    kt_twist *twists;
} shown_modes;

static void release_shown_modes(shown_modes *s) {
    free(s->modes);
    free(s->list);
    free(s->titles);
    free(s->screws);
    free(s->twists);
}

static bool allocate_shown_modes(shown_modes *s, const kt_small_motion *motion, long most) {
    const size_t all = (size_t)kt_modes_count(motion->modes), bodies = (size_t)kt_model_body_count(motion->model);
    const int shown = most < (long)all ? (int)most : (int)all;
    s->modes = calloc(all + 1, sizeof *s->modes);
    if (s->modes == NULL)
        return false;
    (void)kt_modes_slowest(motion, shown, s->modes, &s->count);
    s->list = calloc((size_t)s->count + 1, sizeof *s->list);
    s->titles = calloc((size_t)s->count + 1, sizeof *s->titles);
    s->screws = calloc((size_t)s->count * bodies * 12 + 1, sizeof *s->screws);
    s->twists = calloc(2 * bodies, sizeof *s->twists);
    return s->list != NULL && s->titles != NULL && s->screws != NULL && s->twists != NULL;
}

/* Writes the twist of a body relative to its parent as a screw, in the parent's axes. The screw is the rotation and the
 * velocity of the point at the parent's origin. */
static void put_screw(const kt_pose *poses, const kt_twist *twists, int body, int parent, double *screw) {
    const kt_twist *own = &twists[body], *below = &twists[parent];
    const kt_vec3 apart = kt_vec3_sub(poses[body].position, poses[parent].position);
    const kt_vec3 turn = kt_vec3_sub(own->angular, below->angular);
    const kt_vec3 at_parent = kt_vec3_sub(own->linear, kt_vec3_cross(own->angular, apart));
    const kt_vec3 w = kt_mat3_apply_transposed(poses[parent].rotation, turn);
    const kt_vec3 v = kt_mat3_apply_transposed(poses[parent].rotation, kt_vec3_sub(at_parent, below->linear));
    const double numbers[] = {w.x, w.y, w.z, v.x, v.y, v.z};
    for (int k = 0; k < 6; k++)
        screw[k] = numbers[k];
}

static kt_status fill_mode(shown_modes *s, const kt_small_motion *motion, int i, const kt_picture *picture,
                           const kt_pose *poses, kt_error *error) {
    const int bodies = kt_model_body_count(motion->model), index = s->modes[i];
    const kt_mode mode = kt_modes_at(motion->modes, index);
    double *screws = s->screws + (size_t)i * (size_t)bodies * 12;
    kt_deflection deflection;
    kt_status status = kt_deflection_choose(motion, index, picture, &deflection, error);
    if (status == KT_OK)
        status = kt_deflection_twists(motion, index, s->twists, s->twists + bodies, error);
    if (status != KT_OK)
        return status;
    for (int body = 1; body < bodies; body++)
        for (int part = 0; part < 2; part++)
            put_screw(poses, s->twists + (ptrdiff_t)part * bodies, body, kt_body_parent(motion->model, body),
                      screws + 12 * (ptrdiff_t)body + 6 * (ptrdiff_t)part);
    s->titles[i] = kt_modes_title(i + 1, &mode, deflection.moved > 0.0);
    s->list[i] = (kt_view_mode){.title = s->titles[i].text,
                                .frequency = mode.imaginary > 0.0 ? mode.frequency : 0.0,
                                .rate = mode.real,
                                .damping = fabs(mode.real) > mode.error ? mode.damping : 0.0,
                                .amplitude = deflection.amplitude,
                                .phase = deflection.phase,
                                .screws = screws};
    return KT_OK;
}

/* Takes the state of the linearisation as the one frame. */
static int take_rest(const kt_small_motion *motion, kt_motion *frames) {
    if (kt_motion_take_state(frames, 0.0, motion->q, motion->v) != 0)
        return -1;
    frames->force_count = 0; /* forces belong to that state, and the modes have others */
    return frames->count > 0 ? 0 : -1;
}

static int write_modes(const kt_small_motion *motion, shown_modes *s, const char *state, kt_motion *frames,
                       const char *path) {
    kt_error error = {0};
    kt_pose *poses = calloc((size_t)kt_model_body_count(motion->model), sizeof *poses);
    kt_status status = poses != NULL ? kt_deflection_poses(motion, 0, NULL, poses, &error) : KT_ERROR_MEMORY;
    for (int i = 0; i < s->count && status == KT_OK; i++)
        status = fill_mode(s, motion, i, frames->picture, poses, &error);
    free(poses);
    if (status != KT_OK)
        return kt_say_status(status, &error);
    char about[80];
    snprintf(about, sizeof about, "modes about its %s", state);
    const kt_view view = {.name = motion->name, .method = about, .modes = s->list, .mode_count = s->count};
    return kt_view_write(frames, &view, path);
}

int kt_modes_view(const kt_small_motion *motion, const char *state, const char *path, long count, bool boxes) {
    shown_modes shown = {.count = 0};
    kt_run run = motion->scene.run;
    run.record = KT_RECORD_POSITION;
    kt_columns columns = {.count = 0};
    int code = KT_EXIT_DONE;
    kt_motion *frames = kt_columns_list(&columns, &motion->scene, motion->model, &run, KT_RECORD_POSITION)
                            ? kt_motion_start(&motion->scene, &columns, 1, false)
                            : NULL;
    if (frames == NULL || !allocate_shown_modes(&shown, motion, count)) {
        code = kt_say_no_memory("the view");
    } else if (shown.count == 0) {
        code = kt_reject(KT_EXIT_INTEGRATION, "%s is not written: there is no mode to be shown", path);
    } else {
        frames->boxes = boxes;
        code = take_rest(motion, frames) == 0 ? write_modes(motion, &shown, state, frames, path) : KT_EXIT_INTEGRATION;
    }
    release_shown_modes(&shown);
    kt_motion_free(frames);
    kt_columns_free(&columns);
    return code;
}

int kt_view_modes(const char *scene, const char *path, const kt_settings *settings, bool boxes) {
    enum { SHOWN = 40 };
    kt_small_motion motion;
    const char *state = "";
    int code = kt_small_motion_open(&motion, scene, settings);
    if (code == KT_EXIT_DONE)
        code = kt_modes_prepare(&motion, -1, false, &state);
    if (code == KT_EXIT_DONE)
        code = kt_modes_view(&motion, state, path, SHOWN, boxes);
    kt_small_motion_close(&motion);
    return code;
}
