/* SPDX-License-Identifier: Apache-2.0 */
#include "effect_set.h"

#include "kinetree/joint.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- functions of time ------------------------------------------------------------------------------------------- */

static kt_function draw_simple(kt_random *random, int type) {
    static const double rows[10] = {-0.3, 0.2, 0.1, 0.9, 0.4, -0.5, 0.9, 0.3, 1.6, 0.7},
                        polynomial[3] = {0.3, -0.4, 0.2};
    switch (type) {
    case 0:
        return kt_function_constant(kt_random_uniform(random, 0.2, 1.0));
    case 1:
        return kt_function_sine(0.7, kt_random_uniform(random, 0.2, 1.0), 0.3, 0.2);
    case 2:
        return kt_function_ramp(0.1, 0.9, kt_random_uniform(random, 0.0, 0.3), kt_random_uniform(random, 0.5, 1.0));
    case 3:
        return kt_function_polynomial(polynomial, 3);
    case 4:
        return kt_function_table(rows, 10, (kt_interpolation)kt_random_int(random, 0, 2));
    case 5:
        return kt_function_bump(0.8, kt_random_uniform(random, -0.2, 0.1), kt_random_uniform(random, 0.6, 1.2));
    default:
        return kt_function_expression("0.3 + sin(3*t)*exp(-t)/(1 + t^2) + tanh(2*t - 1) + 0.2*sqrt(1 + t)");
    }
}

static kt_function draw_function(kt_effect_set *set, int i, int k, kt_random *random) {
    const int type = kt_random_int(random, 0, 8);
    kt_function *part = set->part[i][k];
    for (int j = 0; j < 3 && type > 6; j++)
        part[j] = draw_simple(random, kt_random_int(random, 0, 6));
    return type == 7 ? kt_function_sum(part, 3) : type == 8 ? kt_function_product(part, 3) : draw_simple(random, type);
}

/* ---- effects ----------------------------------------------------------------------------------------------------- */

const char *kt_effect_set_joint(const kt_tree *tree, kt_random *random) {
    for (int k = 0; k < 200; k++) {
        const int b = kt_random_int(random, 1, tree->count - 1);
        if (kt_body_coordinates(tree->model, b).nv == 1)
            return tree->description.bodies[kt_body_source(tree->model, b)].name;
    }
    return NULL;
}

static kt_end draw_end(const kt_tree *tree, kt_random *random, bool is_ground) {
    const int b = is_ground ? 0 : kt_random_int(random, 1, tree->count - 1);
    kt_end end = {.body = b > 0 ? tree->description.bodies[kt_body_source(tree->model, b)].name : NULL,
                  .rotation = kt_tree_rotation(random)};
    if (b > 0 && kt_random_int(random, 0, 2) == 0)
        end.marker = "tip";
    else
        end.at = kt_tree_vector(random, -0.5, 0.5);
    return end;
}

static void fill_six(kt_random *random, double six[6]) {
    for (int k = 0; k < 6; k++)
        six[k] = kt_random_uniform(random, 0.1, 1.0);
}

/* Writes a variable in place of each @. */
static void write_formula(char out[KT_EFFECT_FORMULA], const char *pattern, const char *variable) {
    size_t length = 0;
    for (const char *at = pattern; *at != '\0'; at++)
        length += (size_t)snprintf(out + length, KT_EFFECT_FORMULA - length, "%.*s", *at == '@' ? KT_EFFECT_FORMULA : 1,
                                   *at == '@' ? variable : at);
}

/* Formulas of a joint, between two ends, or on a body. */
static void draw_formulas(kt_effect_set *set, int i, const kt_tree *tree, kt_random *random) {
    static const char *const wild[] = {
        "t*hypot(@, 0.3) + min(@, 0.2, t) - max(@, -0.1) + clamp(@, -0.2, 0.3)",
        "atan2(@, 0.7) + asin(0.9*sin(@)) - acos(0.8*cos(@)) + atan(@)",
        "sinh(sin(@)) - cosh(sin(@))/3 + exp(-@^2) + log(2 + sin(@)) + tan(0.3*tanh(@))",
        "abs(@) + 0.3*sign(@) + step(@ - 0.1) + (@ > 0.2) - (@ <= t) + (@ < 0) + (@ >= -0.4)",
        "sqrt(1 + @^2) + sin(@)^3 - (2 + cos(@))^1.7 + (@ == @) - (@ != 0.5)"};
    kt_effect *e = &set->effect[i];
    e->end_count = kt_random_int(random, 0, 2);
    e->joint = e->end_count == 0 ? kt_effect_set_joint(tree, random) : NULL;
    e->end_count = e->end_count == 0 && e->joint == NULL ? 1 : e->end_count;
    e->frame = kt_random_int(random, 0, 1) != 0 ? KT_FRAME_BODY : KT_FRAME_WORLD;
    const char *hinge = kt_effect_set_joint(tree, random);
    for (int k = 0; k < (e->end_count == 1 ? 6 : 1); k++) {
        char variable[120];
        const char *body = tree->description.bodies[kt_random_int(random, 0, tree->description.body_count - 1)].name;
        const int kind = kt_random_int(random, 0, 4);
        if (e->end_count == 2 && kind < 2)
            snprintf(variable, sizeof variable, "%s", kind == 0 ? "length" : "speed");
        else if (hinge != NULL && kind < 3)
            snprintf(variable, sizeof variable, "%s.%s",
                     kind == 0   ? "position"
                     : kind == 1 ? "velocity"
                                 : "gravity",
                     hinge);
        else
            snprintf(variable, sizeof variable, "marker.%s.tip.%s%c", body, kind == 4 ? "v" : "",
                     "xyz"[kt_random_int(random, 0, 2)]);
        write_formula(set->formula[i][k], wild[kt_random_int(random, 0, 4)], variable);
        e->formula[k] = set->formula[i][k];
    }
}

static const double burnt[3] = {3.0, -0.4, 0.1};

static bool draw_effect(kt_effect_set *set, int i, kt_effect_type type, const kt_tree *tree, kt_random *random) {
    kt_effect *e = &set->effect[i];
    *e = kt_effect_default();
    snprintf(set->name[i], sizeof set->name[i], "e%d", i);
    e->name = set->name[i];
    e->type = type;
    e->stiffness = kt_random_uniform(random, 1.0, 4.0);
    e->damping = kt_random_uniform(random, 0.1, 1.0);
    e->between[0] = draw_end(tree, random, false);
    do
        e->between[1] = draw_end(tree, random, i % 3 == 0);
    while (e->between[1].body == e->between[0].body);
    switch (type) {
    case KT_EFFECT_SPRING:
        e->length = i % 2 ? 0.0 : kt_random_uniform(random, 0.1, 1.0);
        break;
    case KT_EFFECT_JOINT_FRICTION:
        e->coulomb = 0.5;
        e->viscous = i % 2 ? 0.0 : 0.1;
        e->breakaway = i % 3 ? 0.9 : 0.0;
        e->stribeck = 0.3;
        e->smoothing = kt_random_uniform(random, 0.1, 0.5);
        break;
    case KT_EFFECT_JOINT_LIMIT:
        e->lower = i % 3 != 1 ? -kt_random_uniform(random, 0.1, 0.4) : -(double)INFINITY;
        e->upper = i % 3 != 2 ? kt_random_uniform(random, 0.1, 0.4) : (double)INFINITY;
        break;
    case KT_EFFECT_BUSHING:
        fill_six(random, e->stiffnesses);
        fill_six(random, e->dampings);
        break;
    case KT_EFFECT_MOTOR:
        e->torque = draw_function(set, i, 0, random);
        break;
    case KT_EFFECT_SERVO:
        e->target = draw_function(set, i, 0, random);
        e->limit = i % 2 ? kt_random_uniform(random, 0.5, 3.0) : (double)INFINITY;
        e->lower = i % 3 ? -(double)INFINITY : -1.0;
        e->upper = i % 3 ? (double)INFINITY : 1.5;
        break;
    case KT_EFFECT_FORCE:
    case KT_EFFECT_TORQUE:
        for (int k = 0; k < 3; k++)
            e->value[k] = draw_function(set, i, k, random);
        e->frame = i % 2 ? KT_FRAME_BODY : KT_FRAME_WORLD;
        break;
    case KT_EFFECT_DRAG:
        e->linear = 0.3;
        e->quadratic = i % 2 ? 0.2 : 0.0;
        fill_six(random, e->dampings);
        if (i % 3)
            fill_six(random, e->quadratics);
        break;
    case KT_EFFECT_ATTRACTION:
        e->strength = kt_random_uniform(random, -1.0, 1.0);
        break;
    case KT_EFFECT_CONTACT:
        e->radius = kt_random_uniform(random, 0.5, 2.0);
        e->exponent = i % 2 ? 1.5 : 1.2;
        e->dissipation = 0.2;
        e->friction = i % 3 ? 0.6 : 0.0;
        e->slip = 0.3;
        e->rolling = i % 2 ? 0.0 : 0.2;
        e->torsion = 0.1;
        e->turn = 0.5;
        if (i % 2)
            e->axle = kt_tree_direction(random);
        break;
    case KT_EFFECT_THRUST:
        e->mass = kt_function_polynomial(burnt, 3);
        e->exhaust = kt_tree_vector(random, -3.0, 3.0);
        break;
    case KT_EFFECT_EXPRESSION:
        draw_formulas(set, i, tree, random);
        break;
    default:
        break;
    }
    if (type == KT_EFFECT_JOINT_SPRING)
        e->rest = draw_function(set, i, 0, random);
    const bool is_in_joint = type == KT_EFFECT_JOINT_SPRING || type == KT_EFFECT_JOINT_DAMPER ||
                             type == KT_EFFECT_JOINT_FRICTION || type == KT_EFFECT_JOINT_LIMIT ||
                             type == KT_EFFECT_MOTOR || type == KT_EFFECT_SERVO;
    if (is_in_joint)
        e->joint = kt_effect_set_joint(tree, random);
    return !is_in_joint || e->joint != NULL;
}

/* Some effects of one type, and a motor whose torque depends on time. Compiles the tree again. */
void kt_effect_set_draw(kt_effect_set *set, kt_effect_type type, kt_tree *tree, kt_random *random) {
    memset(set, 0, sizeof *set);
    for (int i = 0; i < KT_EFFECT_SET - 1; i++)
        set->count += draw_effect(set, set->count, type, tree, random);
    if (draw_effect(set, set->count, KT_EFFECT_MOTOR, tree, random))
        set->effect[set->count++].torque = kt_function_sine(0.4, 0.8, 0.2, 0.1);
    else if (draw_effect(set, set->count, KT_EFFECT_THRUST, tree, random))
        set->count++;
    kt_effect *const motor = &set->effect[set->count - 1];
    for (int k = 0; k < 50 && motor->joint != NULL && motor->joint == set->effect[0].joint; k++)
        motor->joint = kt_effect_set_joint(tree, random); /* it would hide the force of the type */
    tree->description.effects = set->effect;
    tree->description.effect_count = set->count;
    kt_tree_compile(tree, NULL);
}

void kt_effect_set_draw_states(kt_effect_set *set, kt_tree *tree, kt_auxiliary_state state[KT_EFFECT_STATES],
                               kt_random *random) {
    const char *const hinge = kt_effect_set_joint(tree, random);
    memset(set, 0, sizeof *set);
    kt_need(kt_check_true("a hinge", hinge != NULL));
    for (int i = 0; i < KT_EFFECT_STATES; i++)
        state[i] = (kt_auxiliary_state){.name = i == 0 ? "first" : "second", .rate = set->formula[i][1]};
    snprintf(set->formula[0][1], KT_EFFECT_FORMULA, "0.4 - first*second + sin(3*t)");
    snprintf(set->formula[1][1], KT_EFFECT_FORMULA,
             "first - 0.5*second + velocity.%s + marker.%s.tip.x + marker.%s.tip.vy", hinge, hinge, hinge);
    snprintf(set->formula[0][0], KT_EFFECT_FORMULA, "2*first - second*tanh(velocity.%s)", hinge);
    set->effect[0] = kt_effect_of(KT_EFFECT_EXPRESSION, hinge);
    set->effect[0].formula[0] = set->formula[0][0];
    tree->description.effects = set->effect;
    tree->description.effect_count = 1;
    tree->description.states = state;
    tree->description.state_count = KT_EFFECT_STATES;
    kt_tree_compile(tree, NULL);
}
