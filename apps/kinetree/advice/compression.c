/* Distances that push. The equation of a distance is its length, |p2 - p1| = L, so that a multiplier above 0 pushes the
 * ends apart, in N. */
#include "advice/compression.h"

#include "kinetree/loop.h"
#include "text/json.h"

#include <math.h>
#include <stdio.h>

/* Of the largest force that a distance has borne: what is below is rounding. */
#define ROUNDING 1e-9

void kt_compressions_begin(kt_compressions *compressions, const kt_scene *scene) {
    *compressions = (kt_compressions){.count = 0};
    for (int i = 0; i < scene->description.loop_count && compressions->count < KT_COMPRESSIONS_MOST; i++)
        if (scene->description.loops[i].type == KT_LOOP_DISTANCE) {
            compressions->since[compressions->count] = (double)NAN;
            compressions->loop[compressions->count++] = i;
        }
}

void kt_compressions_add(kt_compressions *compressions, const kt_model *model, double time, const double *multipliers) {
    for (int k = 0; k < compressions->count; k++) {
        const kt_loop_rows rows = kt_loop_rows_of(model, compressions->loop[k]);
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
            fprintf(stderr,
                    "  distance '%s' pushes with up to %.3g N, from t = %.9g s on, and pulls with up to %.3g N: a rod "
                    "does, a rope goes slack\n",
                    scene->description.loops[compressions->loop[k]].name, compressions->compression[k],
                    compressions->since[k], compressions->tension[k]);
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
