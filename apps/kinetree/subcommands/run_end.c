/* run --scene: the scene with the end of the run as its initial state. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/load.h"
#include "open/released.h"
#include "subcommands/run.h"
#include "text/json.h"

#include <stdio.h>

/* Prints the parts of the scene that the written scene begins anew. */
static void say_end_scene_anew(const kt_outcome *outcome, const char *path) {
    char start[1100];
    (void)snprintf(start, sizeof start, "the motion of %s starts at t = 0 from the end of this run",
                   kt_show(path).text);
    if (kt_simulation_time(outcome->simulation) > 0.0)
        kt_say_anew(outcome->scene, start, kt_show(path).text);
}

int kt_run_write_end(const kt_outcome *outcome, const char *path, bool quiet) {
    kt_scene end = *outcome->scene; /* it shares the contents with the scene, and owns its later allocations */
    kt_error error = {0};
    end.memory = NULL;
    kt_status status = kt_scene_start_from(&end, outcome->model, kt_outcome_positions(outcome),
                                           kt_outcome_velocities(outcome), &error);
    if (status == KT_OK)
        status = kt_scene_start_states(&end, kt_simulation_auxiliary_states(outcome->simulation), &error);
    json_t *released = kt_released_list(outcome->scene, outcome->simulation);
    if (status == KT_OK && kt_json_is_short())
        status = KT_ERROR_MEMORY; /* the list would lack released loops and effects */
    if (status == KT_OK)
        kt_released_apply(&end, released);
    json_decref(released);
    const int code = kt_write_scene(&end, path, status, &error);
    kt_scene_free(&end);
    if (code == KT_EXIT_DONE && !quiet) {
        kt_print("  scene: %s\n", kt_show_result(path).text);
        say_end_scene_anew(outcome, path);
    }
    return code;
}
