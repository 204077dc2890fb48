/* SPDX-License-Identifier: Apache-2.0 */
#include "load.h"

#include "effect/effect.h"

#include <math.h>
#include <stdio.h>

static kt_end end_at(const kt_tree *tree, kt_random *random, int body) {
    return (kt_end){.body = body < 0 ? NULL : tree->body[body].name, .at = kt_tree_vector(random, -0.5, 0.5)};
}

/* A function of time that changes, or does not. */
static kt_function function(kt_random *random) {
    return kt_random_int(random, 0, 1) ? kt_function_sine(0.7, 0.2, 0.1, 0.2)
                                       : kt_function_constant(kt_random_normal(random));
}

/* A caller's own: a force that is no one's else, and none where the point is high. */
static int pull(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches, kt_effect_balance *balance) {
    (void)user, (void)balance;
    if (ends[0].point.z > 40.0)
        return 1;
    wrenches[0].force = kt_vec3_scale(0.1 + t, ends[0].velocity);
    wrenches[0].moment = kt_vec3_cross(ends[0].axes.x, ends[0].omega);
    return 0;
}

static int turn(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    (void)user, (void)balance;
    *force = sin(q) * v + t;
    return fabs(q) > 1e5;
}

static void draw_numbers(kt_effect *e, kt_random *random) {
    e->stiffness = kt_random_uniform(random, 0.5, 20.0);
    e->damping = kt_random_uniform(random, 0.0, 2.0);
    e->coulomb = 0.7;
    e->breakaway = 1.1;
    e->stribeck = 0.9;
    e->smoothing = 0.6;
    e->viscous = 0.3;
    e->upper = kt_random_uniform(random, 0.0, 1.0);
    e->lower = -0.2;
    e->limit = kt_random_uniform(random, 0.5, 10.0);
    e->length = kt_random_uniform(random, 0.0, 1.0);
    e->strength = 0.8;
    e->radius = kt_random_int(random, 0, 1) ? kt_random_uniform(random, 0.0, 2.0) : 0.0;
    e->exponent = kt_random_int(random, 0, 1) ? 1.5 : 1.0;
    e->dissipation = 0.3;
    e->friction = kt_random_int(random, 0, 1) && e->type == KT_EFFECT_CONTACT ? 0.4 : 0.0;
    e->slip = 0.1;
    e->linear = 0.6;
    e->quadratic = 0.3;
    e->axis = kt_tree_direction(random);
    e->frame = kt_random_int(random, 0, 1) ? KT_FRAME_BODY : KT_FRAME_WORLD;
    e->torque = function(random);
    e->target = function(random);
    e->rest = function(random);
    e->mass = kt_function_sine(1.0, 0.3, 0.2, 3.0);
    e->exhaust = kt_tree_direction(random);
    for (int k = 0; k < 3; k++)
        e->value[k] = function(random);
    for (int k = 0; k < 6; k++) {
        e->stiffnesses[k] = kt_random_uniform(random, 0.5, 2.0);
        e->dampings[k] = kt_random_uniform(random, 0.5, 2.0);
        e->quadratics[k] = 0.1 * (k + 1.0);
    }
}

/* A joint with one coordinate; NULL: there is none. */
static const char *draw_joint(const kt_tree *tree, kt_random *random) {
    const int bodies = (int)tree->description.body_count, start = kt_random_int(random, 0, bodies - 1);
    for (int i = 0; i < bodies; i++) {
        const int k = (start + i) % bodies;
        const kt_joint_type type = tree->body[k].joint.type;
        if (type == KT_JOINT_REVOLUTE || type == KT_JOINT_PRISMATIC || type == KT_JOINT_SCREW)
            return tree->body[k].name;
    }
    return NULL;
}

static void add(kt_load_list *list, kt_tree *tree, int type, kt_random *random) {
    kt_effect *e = &list->effect[tree->description.effect_count];
    const int bodies = (int)tree->description.body_count, body = kt_random_int(random, 0, bodies - 1);
    *e = kt_effect_of((kt_effect_type)type, NULL);
    draw_numbers(e, random);
    const bool own = type == KT_EFFECT_CUSTOM,
               in_joint = own ? kt_random_int(random, 0, 1) : kt_effect_end_count(e) == 0;
    if (in_joint) {
        e->joint = draw_joint(tree, random);
        e->joint_force = own ? turn : NULL;
        if (e->joint == NULL)
            return;
    } else {
        e->between[0] = end_at(tree, random, body);
        e->end_count = 1;
        e->wrench = own ? pull : NULL;
        if (!own && kt_effect_end_count(e) == 2)
            e->between[1] = end_at(tree, random, body > 0 ? kt_random_int(random, -1, body - 1) : -1);
    }
    tree->description.effect_count++;
}

static kt_effect *add_formula(kt_load_list *list, kt_tree *tree) {
    kt_effect *e = &list->effect[tree->description.effect_count++];
    *e = kt_effect_of(KT_EFFECT_EXPRESSION, NULL);
    return e;
}

/* Forces by formulas: in a joint, with corners of time; between two ends; on a body, of all that markers do. */
void kt_load_add_formulas(kt_load_list *list, kt_tree *tree, kt_random *random) {
    tree->description.effects = list->effect;
    const int bodies = (int)tree->description.body_count, body = kt_random_int(random, 0, bodies - 1);
    const char *joint = draw_joint(tree, random), *name = tree->body[body].name;
    if (joint) {
        kt_effect *e = add_formula(list, tree);
        (void)snprintf(list->formula[0], sizeof list->formula[0],
                       "max(cos(40*t), 0.3)*(sin(90*t) > 0) - 0.2*velocity.%s*abs(position.%s) + 0.3*gravity.%s", joint,
                       joint, joint);
        e->joint = joint;
        e->formula[0] = list->formula[0];
    }
    kt_effect *pair = add_formula(list, tree), *load = add_formula(list, tree);
    pair->end_count = 2;
    pair->between[0] = end_at(tree, random, body);
    pair->between[1] = end_at(tree, random, body > 0 ? kt_random_int(random, -1, body - 1) : -1);
    pair->formula[0] = "1 - 0.5*length - 0.1*speed*length";
    load->end_count = 1;
    load->between[0] = end_at(tree, random, body);
    load->frame = kt_random_int(random, 0, 1) ? KT_FRAME_BODY : KT_FRAME_WORLD;
    for (int k = 0; k < 6; k++) {
        (void)snprintf(list->formula[k + 1], sizeof list->formula[0], "0.1*marker.%s.tip.%s - %d*marker.%s.tip.v%c",
                       name,
                       k < 3 ? (k == 0   ? "x"
                                : k == 1 ? "y"
                                         : "z")
                             : "vx",
                       k, name, "xyz"[k % 3]);
        load->formula[k] = list->formula[k + 1];
    }
}

void kt_load_add(kt_load_list *list, kt_tree *tree, bool formulas, kt_random *random) {
    tree->description.effects = list->effect;
    tree->description.effect_count = 0;
    for (int round = 0; round < 2; round++) {
        for (int type = 0; type < KT_EFFECT_TYPE_COUNT; type++)
            if (type != KT_EFFECT_EXPRESSION && kt_random_int(random, 0, 2) > 0)
                add(list, tree, type, random);
        add(list, tree, KT_EFFECT_CUSTOM, random);
    }
    if (formulas)
        kt_load_add_formulas(list, tree, random);
}
