/* The simulation of a scene with its events, advanced to times of the caller's choice. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/play.h"

#include "records/gravity.h"
#include "subcommands/run.h"

#include "kinetree/dynamics.h"
#include "kinetree/mechanism.h"

#include <math.h>
#include <stdlib.h>

kt_status kt_simulate_scene(const kt_scene *scene, const kt_model *model, const kt_run *run,
                            const kt_absolute *absolute, kt_simulation_options *options, kt_simulated *made,
                            kt_scene_watch **events, kt_error *error) {
    if (((kt_run_record(run, model) | options->record) & KT_RECORD_EFFECT) != 0 &&
        kt_quantities_need_reactions(&scene->description))
        options->record |= KT_RECORD_REACTION;
    options->contact = scene->contact;
    options->events = kt_scene_event_room(scene);
    kt_status status = kt_simulated_create(model, absolute, run, options, made, error);
    if (status == KT_OK && options->events > 0)
        status = kt_scene_watch_create(scene, model, made->simulation, NULL, -1, events, error);
    return status;
}

kt_status kt_play_start(kt_play *play, const kt_scene *scene, const kt_model *model, const kt_absolute *absolute,
                        kt_error *error) {
    kt_simulation_options options = kt_simulation_options_default();
    *play = (kt_play){.scene = scene, .model = model, .ended = (double)NAN};
    for (int i = 0; i < kt_scene_event_room(scene) && i < KT_EVENTS_NOTED; i++)
        play->angles |= (uint64_t)kt_event_reads_angle(scene, i) << i;
    kt_simulated made;
    const kt_status status =
        kt_simulate_scene(scene, model, &scene->run, absolute, &options, &made, &play->events, error);
    play->simulation = made.simulation;
    play->motion = made.motion;
    return status;
}

kt_status kt_play_start_recorded(kt_play *play, const kt_scene *scene, const kt_model *model, kt_recorded *recorded,
                                 kt_error *error) {
    *play = (kt_play){.scene = scene, .model = model, .recorded = recorded, .ended = (double)NAN};
    play->q = calloc((size_t)kt_model_nq(model) + 1, sizeof *play->q);
    play->time = recorded->time[0];
    return play->q != NULL ? KT_OK : kt_reject_memory(error);
}

void kt_play_end(kt_play *play) {
    free(play->q);
    kt_data_free(play->data);
    kt_simulated made = {play->simulation, play->motion};
    kt_simulated_free(&made);
    kt_scene_watch_free(play->events);
    *play = (kt_play){.ended = (double)NAN};
}

/* Returns how often an event of the scene has happened; `until` is the last one. */
static uint64_t count_event(const kt_play *play, int i) {
    const kt_scene *scene = play->scene;
    return kt_simulation_event_count(play->simulation,
                                     i < scene->event_count ? scene->events[i].name : scene->until.name);
}

/* Takes one step, and warns of events at a jump of atan2: steps end at events. */
static kt_status step_to(kt_play *play, double time, kt_error *error) {
    uint64_t counts[KT_EVENTS_NOTED];
    kt_warnings warnings = {.quiet = false};
    for (int i = 0; i < KT_EVENTS_NOTED; i++)
        counts[i] = play->angles >> i & 1U ? count_event(play, i) : 0;
    const kt_status status = kt_simulation_step(play->simulation, time, error);
    for (int i = 0; i < KT_EVENTS_NOTED && status == KT_OK; i++)
        if ((play->angles >> i & 1U) != 0 && count_event(play, i) > counts[i] &&
            kt_warn_of_event_jump(&warnings, play->scene, play->events, play->simulation, i))
            play->angles &= ~(UINT64_C(1) << i);
    kt_warnings_free(&warnings);
    return status;
}

static kt_status advance_to(kt_play *play, double time, kt_error *error) {
    if (play->angles == 0)
        return kt_simulation_advance(play->simulation, time, error);
    kt_status status = KT_OK;
    do
        status = step_to(play, time, error);
    while (status == KT_OK && kt_simulation_stopped(play->simulation) == NULL &&
           kt_simulation_time(play->simulation) < time);
    return status;
}

kt_status kt_play_to(kt_play *play, double time, kt_error *error) {
    play->time = time;
    if (play->recorded != NULL)
        return KT_OK;
    if (play->is_over || !(time > kt_simulation_time(play->simulation)))
        return KT_OK;
    const kt_status status = advance_to(play, time, error);
    const kt_event *event = status == KT_OK ? kt_simulation_stopped(play->simulation) : NULL;
    if (event != NULL) {
        play->is_over = true;
        play->ended = kt_simulation_time(play->simulation);
        play->ended_by = event->name;
    }
    return status;
}

/* Returns the play to its start, which `block` holds. Also restores the parameters that events have set. */
static kt_status rewind_play(kt_play *play, const void *block, kt_error *error) {
    const kt_status status = kt_simulation_restore(play->simulation, block, error);
    play->is_over = false;
    return status == KT_OK ? kt_scene_watch_sync(play->events, play->simulation, error) : status;
}

kt_status kt_play_find_end(kt_play *play, double limit, double *time, kt_error *error) {
    *time = play->recorded != NULL ? fmin(limit, play->recorded->time[play->recorded->count - 1]) : limit;
    if (play->events == NULL)
        return KT_OK;
    void *block = malloc(kt_simulation_state_size(play->simulation));
    if (block == NULL)
        return kt_reject_memory(error);
    kt_simulation_save(play->simulation, block);
    kt_status status = kt_play_to(play, limit, error);
    if (status == KT_OK && play->is_over)
        *time = play->ended;
    if (status == KT_OK)
        status = rewind_play(play, block, error);
    free(block);
    return status;
}

/* Creates the data of the present model, if the model has changed: switches select another model, which needs its own
 * data. */
static kt_status use_data(kt_play *play, kt_error *error) {
    const bool is_tree = play->recorded != NULL || play->motion != NULL;
    const kt_model *model = is_tree ? play->model : kt_simulation_model(play->simulation);
    if (model == play->shown)
        return KT_OK;
    kt_data_free(play->data);
    play->data = NULL;
    play->shown = NULL;
    const kt_status status = kt_data_create(model, &play->data, error);
    if (status == KT_OK)
        play->shown = model;
    return status;
}

kt_status kt_poses_take(const kt_model *model, kt_data *data, const double *q, kt_pose *poses, kt_error *error) {
    const kt_status status = kt_kinematics_update(model, data, q, NULL, NULL, error);
    for (int i = 0; status == KT_OK && i < kt_model_body_count(model); i++)
        poses[i] = kt_body_pose(model, data, i);
    return status;
}

kt_status kt_play_poses(kt_play *play, kt_pose *poses, kt_error *error) {
    const kt_status status = use_data(play, error);
    const kt_simulated of = {play->simulation, play->motion};
    const double *q = play->recorded != NULL ? play->q : kt_simulated_positions(of);
    if (play->recorded != NULL)
        kt_recorded_positions(play->recorded, play->model, play->time, play->q);
    return status == KT_OK ? kt_poses_take(play->shown, play->data, q, poses, error) : status;
}

kt_vec3 kt_play_point(const kt_play *play, int body, int marker) {
    return kt_point_position(play->shown, play->data, body, kt_marker_at(play->shown, body, marker));
}

/* Creates the watch. An event that sets a parameter, a state or a velocity may supply energy. */
kt_energy_watch kt_energy_watch_of(const kt_scene *scene, const kt_model *model) {
    kt_energy_watch watch = kt_energy_watch_start(model);
    for (int i = 0; i < scene->event_count; i++)
        if (scene->events[i].set_count > 0)
            watch.energetics = KT_ENERGY_SUPPLIED;
    return watch;
}
