/* SPDX-License-Identifier: Apache-2.0 */
#include "grown.h"

#include <string.h>

static void add_effects(grown *s, kt_random *random) {
    kt_description *d = &s->tree.description;
    const int last = (int)d->body_count - 1;
    for (int i = 0; i < 4; i++) {
        kt_effect *e = &s->effect[i];
        *e = kt_effect_of((kt_effect_type[]){KT_EFFECT_SPRING, KT_EFFECT_DRAG, KT_EFFECT_FORCE, KT_EFFECT_SPRING}[i],
                          NULL);
        e->between[0] =
            (kt_end){.body = s->tree.name[kt_random_int(random, 0, last)], .at = kt_tree_vector(random, -0.5, 0.5)};
        if (e->type == KT_EFFECT_SPRING)
            e->between[1] = (kt_end){.body = i ? s->tree.name[last] : NULL, .at = kt_tree_vector(random, -0.5, 0.5)};
        if (e->type == KT_EFFECT_SPRING && i && strcmp(e->between[0].body, e->between[1].body) == 0)
            e->between[1] = (kt_end){.body = NULL, .at = kt_tree_vector(random, 1.0, 2.0)};
        e->stiffness = 1.3;
        e->damping = 0.4;
        e->length = 0.5;
        e->linear = 0.6;
        for (int k = 0; k < 3; k++)
            e->value[k] = kt_function_sine(0.7, 0.2, 0.1, 0.2 * k);
    }
    d->effects = s->effect;
    d->effect_count = 4;
}

void grown_make(grown *s, int n, kt_random *random) {
    kt_tree_plan plan = n % 4 == 3 ? kt_tree_plan_planar() : kt_tree_plan_default();
    plan.bodies = 5 + n % 3;
    plan.massless = false;
    plan.floats = n % 3 == 0 && n % 4 != 3;
    kt_tree_describe(&s->tree, &plan, random);
    if (n % 2)
        add_effects(s, random);
    kt_tree_compile(&s->tree, NULL);
    kt_tree_state_draw(&s->tree, random, &s->state);
}
