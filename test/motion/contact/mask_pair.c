/* mask_pair.h */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mask_pair.h"

#include <math.h>
#include <string.h>

#include "motion/simulation/scenes.h"

bool mask_pair_make(mask_pair *pair, const char *text, bool steps) {
    kt_error error = {0};
    *pair = (mask_pair){.options = kt_simulation_options_default()};
    pair->options.contact = steps ? KT_CONTACT_STEPS : KT_CONTACT_EVENTS;
    kt_status status = kt_scene_parse("x", text, strlen(text), &pair->scene, NULL, NULL, &error);
    if (status == KT_OK && steps)
        pair->scene.run.integrator = NULL;
    for (int k = 0; status == KT_OK && k < MASK_PAIR; k++) {
        kt_model_options options = kt_model_options_default();
        options.settable = true;
        options.contact_switches = k == 0 ? KT_SWITCH_MAX : 0;
        status = kt_model_compile(&pair->scene.description, &options, &pair->model[k], &error);
        if (status == KT_OK)
            status = mask_pair_renew(pair, k, &error);
    }
    return kt_fine("starts", status, &error);
}

void mask_pair_free(mask_pair *pair) {
    for (int k = 0; k < MASK_PAIR; k++) {
        kt_simulation_free(pair->simulation[k]);
        kt_model_free(pair->model[k]);
    }
    kt_scene_free(&pair->scene);
}

kt_status mask_pair_renew(mask_pair *pair, int k, kt_error *error) {
    kt_simulation_free(pair->simulation[k]);
    pair->simulation[k] = NULL;
    return kt_simulation_create(pair->model[k], &pair->scene.run, &pair->options, &pair->simulation[k], error);
}

bool mask_pair_advance(const mask_pair *pair, double t) {
    kt_error error = {0};
    kt_status status = KT_OK;
    for (int k = 0; status == KT_OK && k < MASK_PAIR; k++)
        status = kt_simulation_advance(pair->simulation[k], t, &error);
    return kt_fine("advances", status, &error);
}

static double largest_difference(const double *x, const double *y, int n) {
    double most = 0.0;
    for (int i = 0; i < n; i++) {
        const double difference = fabs(x[i] - y[i]);
        most = difference <= most ? most : difference; /* a NaN stays */
    }
    return most;
}

double mask_difference(const kt_model *model, const kt_simulation *one, const kt_simulation *other, double weight) {
    const double *q = kt_simulation_positions(one), *v = kt_simulation_velocities(one);
    const double of_q = largest_difference(q, kt_simulation_positions(other), kt_model_nq(model));
    const double of_v = weight * largest_difference(v, kt_simulation_velocities(other), kt_model_nv(model));
    return of_v <= of_q ? of_q : of_v;
}

double mask_pair_difference(const mask_pair *pair, double weight) {
    return mask_difference(pair->model[0], pair->simulation[0], pair->simulation[1], weight);
}
