/* A body with points that touch planes with friction, as a scene for tests. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SIMULATION_TOUCH_H
#define KT_TEST_SIMULATION_TOUCH_H

#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>

#include "motion/simulation/scenes.h"

enum { TOUCH_POINTS = 5 };
static const double g = 9.81;

/* A body with points that touch planes of the world or of a second body. */
typedef struct touch_scene {
    kt_body body[4];
    kt_marker marker[TOUCH_POINTS];
    kt_effect effect[TOUCH_POINTS + 2];
    char name[TOUCH_POINTS][8];
    kt_description description;
} touch_scene;

static inline void touch_scene_make(touch_scene *s, kt_joint_type joint) {
    *s = (touch_scene){.description = kt_description_default()};
    for (int i = 0; i < 4; i++)
        s->body[i] = kt_body_default();
    for (int i = 0; i < TOUCH_POINTS + 2; i++)
        s->effect[i] = kt_effect_default();
    s->body[0].name = "body";
    s->body[0].joint.type = joint;
    s->body[0].mass = 2.0;
    s->body[0].markers = s->marker;
    s->description.bodies = s->body;
    s->description.body_count = 1;
    s->description.effects = s->effect;
    s->description.gravity = kt_vec3_make(0.0, 0.0, -g);
}

/* A sphere about a point of the body on the plane through `end` normal to z. */
static inline kt_effect *touch_scene_add(touch_scene *s, kt_vec3 at, double radius, double friction,
                                         double restitution) {
    const int i = s->body[0].marker_count++;
    kt_effect *effect = &s->effect[s->description.effect_count++];
    (void)snprintf(s->name[i], sizeof s->name[i], "p%d", i);
    s->marker[i] = (kt_marker){.name = s->name[i], .at = at};
    effect->name = s->name[i];
    effect->type = KT_EFFECT_CONTACT;
    effect->between[0].body = "body";
    effect->between[0].marker = s->name[i];
    effect->radius = radius;
    effect->friction = friction;
    effect->restitution = restitution;
    return effect;
}

static inline void touch_scene_ball(touch_scene *s, double friction, double restitution) {
    touch_scene_make(s, KT_JOINT_FREE);
    s->body[0].joint.position[2] = 0.1;
    s->body[0].inertia.xx = s->body[0].inertia.yy = s->body[0].inertia.zz = 0.4 * 2.0 * 0.1 * 0.1;
    (void)touch_scene_add(s, kt_vec3_make(0.0, 0.0, 0.0), 0.1, friction, restitution);
}

/* A box on three or four feet, with sides of 0.6 m, 0.4 m and 0.2 m. Gravity is tilted by `angle` towards x. */
static inline void touch_scene_box(touch_scene *s, int feet, double friction, double angle) {
    const double x = 0.3, y = 0.2, z = -0.1, m = 2.0;
    touch_scene_make(s, KT_JOINT_FREE);
    s->body[0].joint.position[2] = 0.1;
    s->body[0].inertia.xx = m / 12.0 * (0.16 + 0.04);
    s->body[0].inertia.yy = m / 12.0 * (0.36 + 0.04);
    s->body[0].inertia.zz = m / 12.0 * (0.36 + 0.16);
    (void)touch_scene_add(s, kt_vec3_make(x, y, z), 0.0, friction, 0.0);
    (void)touch_scene_add(s, kt_vec3_make(x, -y, z), 0.0, friction, 0.0);
    (void)touch_scene_add(s, kt_vec3_make(-x, feet == 3 ? 0.0 : y, z), 0.0, friction, 0.0);
    if (feet == 4)
        (void)touch_scene_add(s, kt_vec3_make(-x, -y, z), 0.0, friction, 0.0);
    s->description.gravity = kt_vec3_make(g * sin(angle), 0.0, -g * cos(angle));
}

static inline kt_simulation *touch_start(const kt_model *model, const char *method, double step) {
    return kt_scene_start_within(model, method, step, 1e-11,
                                 KT_RECORD_BALANCE | KT_RECORD_ENERGY | KT_RECORD_ACCELERATION);
}

/* The first time at which the contacts have stuck so often. */
static inline kt_status touch_until_stuck(kt_simulation *simulation, uint64_t count, double most, kt_error *error) {
    kt_status status = KT_OK;
    while (status == KT_OK && kt_simulation_contacts(simulation).sticks < count &&
           kt_simulation_time(simulation) < most)
        status = kt_simulation_step(simulation, most, error);
    return status;
}

#endif
