/* `sense-count TASK METHOD SCENE` takes twenty fixed steps (take_steps), for callgrind to count their instructions. The
 * task follows each step but the last. It is nothing, or `points`: sensors with accelerations. `wrenches` adds
 * reactions. The task `anew` does the same as `wrenches` with kt_reaction_evaluate, with data of its own. The kernels
 * are those of the baseline. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subject.h"

#include <stdlib.h>
#include <string.h>

typedef struct sensing {
    subject of;
    kt_wrench *wrenches;
} sensing;

static kt_status begin(sensing *s, const char *method, const char *path, kt_error *error) {
    kt_simulation_options extra = kt_simulation_options_default();
    const kt_status status = open_subject(&s->of, method, path, error);
    if (status != KT_OK)
        return status;
    s->of.run.record =
        KT_RECORD_ACCELERATION | (strcmp(s->of.what, "wrenches") == 0 ? (unsigned)KT_RECORD_REACTION : 0U);
    extra.kinematics = true;
    s->wrenches = calloc((size_t)(kt_model_body_count(s->of.model) + kt_loop_count(s->of.model)), sizeof *s->wrenches);
    return s->wrenches != NULL ? kt_simulation_create(s->of.model, &s->of.run, &extra, &s->of.simulation, error)
                               : KT_ERROR_MEMORY;
}

static kt_status sense(const sensing *all, kt_error *error) {
    const subject *s = &all->of;
    kt_record record;
    if (strcmp(s->what, "nothing") == 0)
        return KT_OK;
    if (strcmp(s->what, "anew") != 0)
        return kt_simulation_sense(s->simulation, &record, error);
    return kt_reaction_evaluate(s->model, s->data, kt_simulation_time(s->simulation),
                                kt_simulation_positions(s->simulation), kt_simulation_velocities(s->simulation), NULL,
                                NULL, all->wrenches, all->wrenches + kt_model_body_count(s->model), error);
}

kt_status take_steps(const sensing *s, kt_error *error);

__attribute__((noinline)) kt_status take_steps(const sensing *s, kt_error *error) {
    kt_status status = KT_OK;
    for (int k = 0; k < STEPS && status == KT_OK; k++) {
        status = kt_simulation_step(s->of.simulation, HUGE_VAL, error);
        if (status == KT_OK && k < STEPS - 1)
            status = sense(s, error);
    }
    return status;
}

int main(int argc, char **argv) {
    sensing s = {.of.what = argc == 4 ? argv[1] : ""};
    kt_error error = {0};
    kt_status status = argc == 4 ? begin(&s, argv[2], argv[3], &error) : KT_ERROR_ARGUMENT;
    if (status == KT_OK)
        status = take_steps(&s, &error);
    free(s.wrenches);
    return close_subject(&s.of, status, &error);
}
