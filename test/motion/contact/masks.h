/* Scenes with many contacts and frictions, for tests of models of their sets. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_MASKS_H
#define KT_TEST_MASKS_H

#include "kinetree/simulation.h"

enum { MASKS_CONTACTS = 400, MASKS_EFFECTS = 2 * MASKS_CONTACTS + 24, MASKS_BODIES = MASKS_CONTACTS + 24 };
#define MASKS_GRAVITY 9.81

typedef struct masks_scene {
    kt_body body[MASKS_BODIES];
    kt_marker marker[MASKS_CONTACTS];
    kt_effect effect[MASKS_EFFECTS];
    char name[MASKS_BODIES + MASKS_CONTACTS][8];
    kt_description description;
} masks_scene;

/* An empty scene with gravity along -z. */
void masks_make(masks_scene *s);
/* Adds a body of 1 kg on the world, and an effect with a restitution of 0. */
kt_body *masks_add_body(masks_scene *s, kt_joint_type type, kt_vec3 axis);
kt_effect *masks_add_effect(masks_scene *s, kt_effect_type type);
/* A simulation of 100 s; "steps": by time stepping. */
kt_simulation *masks_start(const kt_model *model, const char *method, double step);

#endif
