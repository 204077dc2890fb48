/* masks.h */
/* SPDX-License-Identifier: Apache-2.0 */
#include "masks.h"

#include <stdio.h>
#include <string.h>

#include "motion/simulation/scenes.h"

void masks_make(masks_scene *s) {
    *s = (masks_scene){.description = kt_description_default()};
    s->description.bodies = s->body;
    s->description.effects = s->effect;
    s->description.gravity = kt_vec3_make(0.0, 0.0, -MASKS_GRAVITY);
}

kt_body *masks_add_body(masks_scene *s, kt_joint_type type, kt_vec3 axis) {
    const int i = s->description.body_count++;
    (void)snprintf(s->name[i], sizeof s->name[i], "b%d", i);
    s->body[i] = kt_body_of(s->name[i], NULL, type, 1.0);
    s->body[i].joint.axis = axis;
    return &s->body[i];
}

kt_effect *masks_add_effect(masks_scene *s, kt_effect_type type) {
    kt_effect *effect = &s->effect[s->description.effect_count++];
    *effect = kt_effect_of(type, NULL);
    effect->restitution = 0.0;
    return effect;
}

kt_simulation *masks_start(const kt_model *model, const char *method, double step) {
    kt_simulation_options options = kt_simulation_options_default();
    kt_run run = kt_run_fixed(method, step, 100.0);
    run.relative = run.absolute = 1e-11;
    if (method != NULL && strcmp(method, "steps") == 0) { /* time stepping */
        options.contact = KT_CONTACT_STEPS;
        options.events = 1;
        run.integrator = NULL;
        run.step = 1e-3;
    }
    options.record = KT_RECORD_BALANCE | KT_RECORD_ENERGY | KT_RECORD_REACTION;
    return kt_test_simulation(model, &run, &options);
}
