#include "running.h"

#include <string.h>

#include "check.h"

kt_collected running_faults;

bool running_parse(const char *text, const kt_scene_options *options, kt_scene *scene) {
    kt_error error = {0};
    memset(&running_faults, 0, sizeof running_faults);
    return kt_scene_parse_with("x", text, strlen(text), options, scene, kt_collect, &running_faults, &error) == KT_OK;
}

bool running_start_read(running *to) {
    kt_error error = {0};
    kt_model_options compiled = kt_model_options_default();
    kt_simulation_options made = kt_simulation_options_default();
    compiled.settable = kt_scene_sets(&to->scene);
    made.events = kt_scene_event_room(&to->scene);
    made.contact = to->scene.contact;
    kt_status status = kt_model_compile(&to->scene.description, &compiled, &to->model, &error);
    if (status == KT_OK)
        status = kt_simulation_create(to->model, &to->scene.run, &made, &to->simulation, &error);
    if (status == KT_OK)
        status = kt_scene_watch_create(&to->scene, to->model, to->simulation, NULL, 0, &to->watch, &error);
    return kt_check_text("begins", status == KT_OK ? "" : error.message, "");
}

bool running_start(const char *text, const kt_scene_options *options, running *to) {
    *to = (running){.model = NULL};
    if (!kt_check_true("the scene is read", running_parse(text, options, &to->scene))) {
        kt_note("%s: %s", running_faults.first.where, running_faults.first.message);
        return false;
    }
    return running_start_read(to);
}

void running_stop(running *of) {
    kt_scene_watch_free(of->watch);
    kt_simulation_free(of->simulation);
    kt_model_free(of->model);
    kt_scene_free(&of->scene);
}
