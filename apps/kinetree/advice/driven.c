/* The watch of a simulation that a program drives.
 *
 * `kinetree run` receives all records, and ends once. A program may stop at any time, set torques, jump, and begin
 * again. Therefore the watch samples the state itself, once in KT_DRIVEN_STEPS steps, and applies the rules of
 * `kinetree run` to these samples, as if the run ended at the present time. The first samples are closer together, so
 * that the energy of the motion is known before a fault. Two things differ from a run.
 *
 *   Energy. Torques of a program supply energy. To integrate their work would cost one more evaluation for each change
 *     of a torque. The energy is therefore watched without torques only. After a jump or a new parameter the watch
 *     begins anew.
 *   Time of the verdict. At rest the scale of the energy is zero, and the first states of a sound motion may seem
 *     wrong. The energy is judged after FIRST, 2 FIRST, 4 FIRST, ... steps. All rules judge at the duration, and if the
 *     caller requests the warnings.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/driven.h"

#include "open/play.h"
#include "subcommands/run.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    KT_DRIVEN_STEPS = 32, /* between two states */
    CLOSER = 8,           /* a state follows after 1 / CLOSER of the steps so far, if these are fewer */
    FIRST = 1024          /* steps before the first verdict on the energy */
};

struct kt_driven {
    kt_outcome outcome;
    kt_run run;            /* with the name of the method; its duration is that of the verdict */
    double duration;       /* s, of the run */
    kt_method storage;     /* of the method's name */
    kt_mode_watch *modes;  /* NULL: none */
    bool calls;            /* the program computes forces */
    bool has_started;      /* the start has been examined */
    bool has_begun;        /* likewise, the state before the first step after a restart */
    bool has_news;         /* kt_driven_warnings has something to report */
    bool is_over;          /* likewise, the state at the duration */
    uint64_t begun;        /* steps at the latest start */
    uint64_t due, verdict; /* steps at the next state and at the next verdict */
    double judged_rate;    /* 1/s, of the fastest mode at the last verdict on the step */
};

kt_driven *kt_driven_create(const kt_scene *scene, const kt_model *model, const kt_run *run, kt_simulation *simulation,
                            kt_scene_watch *events, bool calls) {
    kt_driven *driven = calloc(1, sizeof *driven);
    if (driven == NULL)
        return NULL;
    driven->run = *run;
    driven->duration = run->duration;
    driven->calls = calls;
    driven->run.integrator =
        run->integrator != NULL ? run->integrator : kt_scene_method_name(scene, model, &driven->storage);
    driven->outcome = (kt_outcome){.scene = scene,
                                   .model = model,
                                   .run = &driven->run,
                                   .simulation = simulation,
                                   .events = events,
                                   .so_far.corrected_since = (double)NAN,
                                   .warnings.quiet = true};
    driven->modes = calls ? NULL : kt_watch_steps(&driven->outcome);
    kt_driven_restart(driven);
    return driven;
}

void kt_driven_free(kt_driven *driven) {
    if (driven == NULL)
        return;
    kt_mode_watch_free(driven->modes);
    kt_warnings_free(&driven->outcome.warnings);
    json_decref(driven->outcome.moved);
    free(driven);
}

void kt_driven_restart(kt_driven *driven) {
    if (driven == NULL)
        return;
    kt_so_far *so_far = &driven->outcome.so_far;
    so_far->energy = kt_energy_watch_of(driven->outcome.scene, driven->outcome.model);
    so_far->growth = (kt_growth){0};
    so_far->stability = (kt_stability_watch){0};
    so_far->corrected_since = (double)NAN;
    driven->has_begun = driven->is_over = false;
}

void kt_driven_supply(kt_driven *driven) {
    if (driven != NULL)
        driven->outcome.so_far.energy.energetics = KT_ENERGY_SUPPLIED;
}

/* ---- states ------------------------------------------------------------------------------------------------------ */

void kt_driven_record(kt_driven *driven, const kt_record *record) {
    if (driven->calls || record->index == KT_INDEX_CONTACT)
        return;
    driven->run.duration = driven->duration;
    kt_watch_motion(&driven->outcome, driven->modes, record);
}

/* Takes the present state. The verdict is due at the duration, or after FIRST steps and more if the energy is wrong. */
static void take_state(kt_driven *driven, uint64_t steps, bool is_over) {
    kt_record record;
    kt_error error;
    const uint64_t pause = (steps - driven->begun) / CLOSER;
    driven->due = steps + (pause < 1 ? 1 : pause < KT_DRIVEN_STEPS ? pause : KT_DRIVEN_STEPS);
    if (!driven->calls && kt_simulation_sense(driven->outcome.simulation, &record, &error) == KT_OK)
        kt_driven_record(driven, &record); /* else the next step reports the error */
    if (steps >= driven->verdict) {
        driven->verdict = 2 * steps;
        driven->has_news |= kt_energy_watch_error(&driven->outcome.so_far.energy) > KT_ENERGY_ERROR;
    }
    driven->has_news |= is_over;
    driven->is_over |= is_over;
}

void kt_driven_begin(kt_driven *driven) {
    if (driven == NULL || driven->has_begun)
        return;
    if (!driven->has_started) {
        kt_report_start(&driven->outcome, true);
        driven->has_news |= driven->outcome.warnings.list != NULL;
    }
    driven->has_started = driven->has_begun = true;
    const uint64_t steps = kt_simulation_counts_of(driven->outcome.simulation).steps;
    driven->verdict = steps + FIRST;
    driven->begun = steps;
    take_state(driven, steps, false);
}

bool kt_driven_take(kt_driven *driven) {
    if (driven == NULL)
        return false;
    const kt_simulation *simulation = driven->outcome.simulation;
    const uint64_t steps = kt_simulation_counts_of(simulation).steps;
    const bool is_over = !driven->is_over && kt_simulation_time(simulation) >= driven->duration;
    if (steps >= driven->due || is_over)
        take_state(driven, steps, is_over);
    return driven->has_news;
}

/* ---- verdicts ---------------------------------------------------------------------------------------------------- */

/* Removes warnings from index `from` on whose code an earlier one has. */
static void keep_first_of_codes(json_t *list, size_t from) {
    for (size_t i = json_array_size(list); i-- > from;) {
        const json_t *code = json_object_get(json_array_get(list, i), "code");
        size_t k = 0;
        while (k < i && !json_equal(json_object_get(json_array_get(list, k), "code"), code))
            k++;
        if (k < i)
            json_array_remove(list, i);
    }
}

/* Returns the watch of the step; NULL if modes of its rate have been examined: a program may examine the states often,
 * and modes cost as much as many steps. */
static const kt_mode_watch *unjudged_modes(kt_driven *driven) {
    const double rate = driven->modes != NULL ? kt_mode_watch_fastest(driven->modes).rate : 0.0;
    if (!(rate > 1.1 * driven->judged_rate))
        return NULL;
    driven->judged_rate = rate;
    return driven->modes;
}

/* Examines the states so far as those of a run that ends at the present time. */
static void judge_states(kt_driven *driven) {
    kt_outcome *outcome = &driven->outcome;
    const size_t before = json_array_size(outcome->warnings.list);
    driven->run.duration = kt_simulation_time(outcome->simulation);
    kt_warn_of_motion(outcome, unjudged_modes(driven)); /* of growth only if records were taken */
    driven->run.duration = driven->duration;
    keep_first_of_codes(outcome->warnings.list, before);
}

char *kt_driven_warnings(kt_driven *driven, size_t from) {
    kt_record record;
    kt_error error;
    const bool moves = driven->has_started && kt_simulation_time(driven->outcome.simulation) > 0.0;
    if (moves && !driven->calls && kt_simulation_sense(driven->outcome.simulation, &record, &error) == KT_OK)
        kt_driven_record(driven, &record);
    if (moves)
        judge_states(driven);
    driven->has_news = false;
    json_t *rest = json_array(), *all = kt_warnings_describe(&driven->outcome.warnings);
    for (size_t i = from; i < json_array_size(all); i++)
        json_array_append(rest, json_array_get(all, i));
    char *text = json_dumps(rest, 0);
    json_decref(rest);
    json_decref(all);
    return text;
}

void kt_driven_text_free(char *text) { free(text); }
