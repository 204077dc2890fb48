/* SPDX-License-Identifier: Apache-2.0 */
#include "running.h"

#include <stdlib.h>
#include <string.h>

#include "check.h"

kt_collected running_faults;

bool running_parse(const char *text, const kt_scene_options *options, kt_scene *scene) {
    kt_error error = {0};
    memset(&running_faults, 0, sizeof running_faults);
    return kt_scene_parse_with("x", text, strlen(text), options, scene, kt_collect, &running_faults, &error) == KT_OK;
}

kt_scene *running_read(const char *text, const kt_scene_options *options) {
    kt_scene *scene = kt_test_scene_place();
    if (!running_parse(text, options, scene)) {
        kt_note("%s: %s", running_faults.first.where, running_faults.first.message);
        kt_need(kt_check_true("the scene is read", false));
    }
    return scene;
}

static void release_simulation(void *simulation) { kt_simulation_free(simulation); }

static void release_watch(void *watch) { kt_scene_watch_free(watch); }

kt_status running_open(running *to, kt_scene *scene, const kt_simulation_options *options, kt_error *error) {
    kt_model_options compiled = kt_model_options_default();
    kt_simulation_options made = *options;
    compiled.settable = kt_scene_needs_settable(scene);
    made.events = kt_scene_event_room(scene);
    made.contact = scene->contact;
    *to = (running){.scene = scene, .model = kt_test_model(&scene->description, &compiled)};
    kt_status status = kt_simulation_create(to->model, &scene->run, &made, &to->simulation, error);
    kt_test_own(to->simulation, release_simulation);
    if (status == KT_OK)
        status = kt_scene_watch_create(scene, to->model, to->simulation, NULL, 0, &to->watch, error);
    kt_test_own(to->watch, release_watch);
    return status;
}

running running_begin(kt_scene *scene, unsigned record) {
    running r;
    kt_error error = {0};
    kt_simulation_options options = kt_simulation_options_default();
    options.record = record;
    kt_need_fine("events", running_open(&r, scene, &options, &error), &error);
    return r;
}

running running_start(const char *text, const kt_scene_options *options) {
    return running_begin(running_read(text, options), kt_simulation_options_default().record);
}

void running_check_fault(const char *what, const char *text, const char *place, const char *words) {
    kt_need(kt_check_true(what, !running_parse(text, NULL, kt_test_scene_place())));
    kt_check_equal_int("faults", (long long)running_faults.count, 1);
    if (place != NULL)
        kt_check_text("place", running_faults.first.where, place);
    kt_check_contains("words", running_faults.first.message, words);
}

void *running_room(const running *r, size_t count) {
    void *room = malloc(count * kt_simulation_state_size(r->simulation));
    kt_test_own(room, free);
    kt_need(room != NULL || kt_check_true("there is memory", false));
    return room;
}

void running_advance(const running *r, double time) {
    kt_error error = {0};
    kt_need_fine("advance", kt_simulation_advance(r->simulation, time, &error), &error);
}
