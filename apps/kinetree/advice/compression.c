/* Distances that push. The equation of a distance is its length, |p2 - p1| = L, so that a multiplier above 0 pushes the
 * ends apart, in N. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/growth.h"

#include "kinetree/loop.h"
#include "text/json.h"

#include <math.h>
#include <stdio.h>

/* Share of the largest force in a distance. Smaller forces are rounding. */
#define ROUNDING 1e-9

void kt_compressions_begin(kt_compressions *c, const kt_scene *scene, const kt_model *model) {
    *c = (kt_compressions){.count = 0};
    for (int i = 0; i < scene->description.loop_count; i++) {
        const kt_loop *loop = &scene->description.loops[i];
        if (loop->type != KT_LOOP_DISTANCE)
            continue;
        if (c->count == KT_COMPRESSIONS_MOST) {
            c->left++;
            continue;
        }
        c->since[c->count] = (double)NAN;
        c->of_model[c->count] = kt_loop_find(model, loop->name);
        c->loop[c->count++] = i;
    }
}

void kt_compressions_add(kt_compressions *compressions, const kt_model *model, double time, const double *multipliers) {
    for (int k = 0; k < compressions->count; k++) {
        const kt_loop_rows rows = kt_loop_rows_of(model, compressions->of_model[k]);
        if (rows.count == 0) /* switched off */
            continue;
        const double force = multipliers[rows.first];
        compressions->tension[k] = fmax(compressions->tension[k], -force);
        compressions->compression[k] = fmax(compressions->compression[k], force);
        if (isnan(compressions->since[k]) &&
            force > ROUNDING * fmax(compressions->tension[k], compressions->compression[k]))
            compressions->since[k] = time;
    }
}

static bool is_compressed(const kt_compressions *compressions, int k) {
    return compressions->compression[k] > ROUNDING * compressions->tension[k] && compressions->compression[k] > 0.0;
}

void kt_compressions_say(const kt_compressions *compressions, const kt_scene *scene) {
    for (int k = 0; k < compressions->count; k++)
        if (is_compressed(compressions, k))
            kt_print("  distance '%s' pushes with up to %.3g N, from t = %.9g s on, and pulls with up to %.3g N: a rod "
                     "does, a rope goes slack\n",
                     scene->description.loops[compressions->loop[k]].name, compressions->compression[k],
                     compressions->since[k], compressions->tension[k]);
    if (compressions->left > 0)
        kt_print("  whether distances push was watched in the first %d; the forces of the other %d are in --record "
                 "multiplier\n",
                 compressions->count, compressions->left);
}

json_t *kt_compressions_describe(const kt_compressions *compressions, const kt_scene *scene) {
    json_t *object = json_object();
    for (int k = 0; k < compressions->count; k++)
        if (is_compressed(compressions, k))
            json_object_set_new(object, scene->description.loops[compressions->loop[k]].name,
                                json_pack("{s:f, s:f, s:f}", "force", compressions->compression[k], "since",
                                          compressions->since[k], "tension", compressions->tension[k]));
    return object;
}
