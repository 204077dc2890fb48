/* Assemblies of changed scenes, which show what closes their loops. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/advice.h"

#include <stdlib.h>
#include <string.h>

/* The work of one search. A failing trial takes thousands of damped steps, and a step of a group with m coordinates and
 * k equations takes m k (m + k) operations, about. The limit is four trials of a mechanism of 20 coordinates with 36
 * equations, two seconds. A linkage of five coordinates with four equations may have 500 trials. */
static const double WORK_MAX = 150000.0;

double kt_trial_work(const kt_model *model) {
    const double m = kt_model_nv(model), k = kt_model_mobility(model).equations;
    return 100.0 + m * k * (m + k);
}

bool kt_closes_to(kt_trials *trials, const kt_description *description, int *left, bool *disagrees) {
    const kt_model_options options = kt_compile_options(trials->scene);
    kt_model *model = NULL;
    kt_data *data = NULL;
    trials->ended |= trials->work >= WORK_MAX;
    if (trials->ended)
        return false;
    trials->count++;
    if (kt_model_compile(description, &options, &model, NULL) != KT_OK) {
        trials->work += trials->usual;
        return false;
    }
    double *state = kt_given_state(model);
    const bool closed = state != NULL && kt_data_create(model, &data, NULL) == KT_OK &&
                        kt_state_assemble(model, data, 0.0, state, state + kt_model_nq(model), NULL) == KT_OK;
    trials->work += kt_trial_work(model);
    *left = kt_model_mobility(model).minimal;
    *disagrees = false;
    for (int i = 0; i < kt_loop_count(model); i++) {
        const kt_loop_disagreement d = kt_loop_disagreement_of(model, i);
        *disagrees |= d.length > 0.0 || d.angle > 0.0;
    }
    kt_data_free(data);
    free(state);
    kt_model_free(model);
    return closed;
}

bool kt_closes_described(kt_trials *trials, const kt_description *description) {
    bool disagrees;
    return kt_closes_to(trials, description, &trials->left, &disagrees);
}

void kt_say_trials_ended(const kt_trials *trials) {
    if (trials->ended)
        kt_print("  the search for changes ended at its limit of work, after %d changes: others may close the loops; "
                 "check the scene with fewer loops to search further\n",
                 trials->count);
}

bool kt_closes_holding(kt_trials *trials, int out, const char *in) {
    kt_description d = trials->scene->description;
    const char **hold = malloc(((size_t)d.hold_count + 1) * sizeof *hold);
    int count = 0;
    if (hold == NULL)
        return false;
    for (int i = 0; i < d.hold_count; i++)
        if (i != out)
            hold[count++] = d.hold[i];
    if (in != NULL)
        hold[count++] = in;
    d.hold = hold;
    d.hold_count = count;
    const bool closed = kt_closes_described(trials, &d);
    free(hold);
    return closed;
}

bool kt_closes_with_loop(kt_trials *trials, int loop, const kt_loop *changed) {
    kt_description d = trials->scene->description;
    kt_loop *loops = malloc((size_t)d.loop_count * sizeof *loops);
    if (loops == NULL)
        return false;
    memcpy(loops, d.loops, (size_t)d.loop_count * sizeof *loops);
    if (changed != NULL)
        loops[loop] = *changed;
    else
        memmove(loops + loop, loops + loop + 1, (size_t)(d.loop_count - loop - 1) * sizeof *loops);
    d.loops = loops;
    d.loop_count -= changed == NULL;
    const bool closed = kt_closes_described(trials, &d);
    free(loops);
    return closed;
}

bool kt_closes_without(kt_trials *trials, int loop) { return kt_closes_with_loop(trials, loop, NULL); }

bool kt_closes_with_joint(kt_trials *trials, int body, const kt_joint *changed) {
    kt_description d = trials->scene->description;
    kt_body *bodies = malloc((size_t)d.body_count * sizeof *bodies);
    if (bodies == NULL)
        return false;
    memcpy(bodies, d.bodies, (size_t)d.body_count * sizeof *bodies);
    bodies[body].joint = *changed;
    d.bodies = bodies;
    const bool closed = kt_closes_described(trials, &d);
    free(bodies);
    return closed;
}
