/* SPDX-License-Identifier: Apache-2.0 */
#include "invent.h"
#include "describe.h"

#include "kinetree/descriptor.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Names that YAML takes for something else among them. */
static const char *const body_names[INVENT_BODIES] = {"crank", "no",    "null", "y",    "_",  "on",
                                                      "a-b",   "E1_e2", "TRUE", "none", "of", "world_"};
static const char *const marker_names[INVENT_MARKERS] = {"tip", "yes", "nan"};

typedef struct inventor {
    kt_invented *out;
    kt_random *random;
    bool everything;
} inventor;

static int pick(inventor *v, int count) { return kt_random_int(v->random, 0, count - 1); }
static bool chance(inventor *v) { return pick(v, 2) == 0; }

/* Any number that a description may have: zeros of both signs, whole, short, long, subnormal and large ones. */
static double any(inventor *v) {
    switch (pick(v, 8)) {
    case 0:
        return 0.0;
    case 1:
        return -0.0;
    case 2:
        return pick(v, 201) - 100;
    case 3:
        return (pick(v, 201) - 100) / 8.0;
    case 4:
        return ldexp(kt_random_uniform(v->random, -1.0, 1.0), -1040);
    case 5:
        return kt_random_normal(v->random) * pow(10.0, kt_random_uniform(v->random, -40.0, 40.0));
    default:
        return kt_random_normal(v->random);
    }
}

static double positive(inventor *v) { return ldexp(kt_random_uniform(v->random, 0.5, 1.0), pick(v, 40) - 20); }
static kt_vec3 vector(inventor *v) { return kt_vec3_make(any(v), any(v), any(v)); }

static kt_vec3 axis(inventor *v) {
    static const double letters[6][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
    double u[3];
    kt_random_direction(v->random, 3, u);
    if (chance(v))
        memcpy(u, letters[pick(v, 6)], sizeof u);
    return kt_vec3_make(u[0], u[1], u[2]);
}

static kt_quat unit(inventor *v) {
    double q[4];
    kt_random_direction(v->random, 4, q);
    return kt_quat_normalize(kt_quat_make(q[0], q[1], q[2], q[3]));
}

static kt_rotation rotation(inventor *v) {
    static const int sequences[] = {121, 123, 131, 132, 212, 213, 231, 232, 312, 313, 321, 323};
    kt_rotation none = {.type = KT_ROTATION_NONE};
    kt_quat q = unit(v);
    kt_vec3 u = axis(v);
    switch (pick(v, 8)) {
    case 0:
        return none;
    case 1:
        return kt_rotation_quaternion(q.w, q.x, q.y, q.z);
    case 2:
        return kt_rotation_rpy(any(v), any(v), any(v));
    case 3:
        return kt_rotation_euler(sequences[pick(v, 12)], any(v), any(v), any(v));
    case 4:
        return kt_rotation_vector(kt_vec3_make(kt_random_normal(v->random), -0.0, kt_random_normal(v->random)));
    case 5:
        return kt_rotation_cgr(kt_vec3_make(kt_random_normal(v->random), 0.5, -1e-9));
    case 6:
        return kt_rotation_axis_angle(u, any(v));
    default:
        return kt_rotation_matrix(kt_mat3_from_quat(q));
    }
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

static kt_joint joint(inventor *v) {
#define JOINT_NQ(id, name, nq, nv) nq,
#define JOINT_NV(id, name, nq, nv) nv,
    static const int positions[] = {KT_JOINT_LIST(JOINT_NQ)}, velocities[] = {KT_JOINT_LIST(JOINT_NV)};
    kt_joint made = kt_joint_default();
    made.type = (kt_joint_type)pick(v, KT_JOINT_TYPE_COUNT);
    bool has_axis = kt_descriptor_key(kt_joint_descriptor(made.type), "joint.axis") != NULL;
    if (has_axis && chance(v))
        made.axis = axis(v);
    if (made.type == KT_JOINT_UNIVERSAL && chance(v)) {
        made.axis = kt_vec3_make(0.0, 0.0, 1.0);
        made.axis2 = kt_vec3_make(1.0, any(v) > 0.0 ? 1.0 : -0.0, 0.5);
    }
    if (made.type == KT_JOINT_SCREW)
        made.pitch = any(v);
    if (chance(v))
        made.at = vector(v);
    made.rotation = rotation(v);
    const kt_quat q = unit(v);
    const double quaternion[4] = {q.w, q.x, q.y, q.z};
    int first = made.type == KT_JOINT_FREE ? 3 : made.type == KT_JOINT_SPHERICAL ? 0 : 7;
    if (chance(v))
        for (int i = 0; i < positions[made.type]; i++)
            made.position[i] = i >= first ? quaternion[i - first] : any(v);
    if (chance(v))
        for (int i = 0; i < velocities[made.type]; i++)
            made.velocity[i] = any(v);
    made.given = (unsigned)pick(v, 16);
    if (chance(v)) /* one for all, or one for each */
        for (int i = 0; i < velocities[made.type]; i++)
            made.armature[i] = i > 0 && made.given % 2 ? made.armature[0] : 0.3 * pick(v, 9);
    return made;
}

static kt_shape shape(inventor *v) {
    kt_shape made = kt_shape_default();
    made.type = (kt_shape_type)pick(v, KT_SHAPE_TYPE_COUNT);
    if (made.type == KT_SHAPE_NONE)
        return made;
    if (made.type == KT_SHAPE_ROD) {
        made.from = chance(v) ? kt_vec3_make(0.0, 0.0, 0.0) : kt_vec3_make(any(v), 1.0, 2.0);
        made.to = kt_vec3_make(3.0, kt_random_normal(v->random), 0.1);
        made.radius = chance(v) ? 0.0 : positive(v);
        return made;
    }
    if (chance(v))
        made.at = vector(v);
    if (made.type != KT_SHAPE_POINT)
        made.rotation = rotation(v);
    if (made.type == KT_SHAPE_BOX)
        made.size = kt_vec3_make(positive(v), positive(v), positive(v));
    if (made.type == KT_SHAPE_SPHERE || made.type == KT_SHAPE_CYLINDER)
        made.radius = positive(v);
    if (made.type == KT_SHAPE_POLYGON) {
        static const double corners[] = {0.0, 0.0, 1.0, -0.2, 1.3, 0.7, 0.4, 0.3, -0.1, 0.9};
        made.points = corners;
        made.point_count = 3 + pick(v, 3);
        made.length = positive(v);
    }
    if (made.type == KT_SHAPE_CYLINDER) {
        made.length = positive(v);
        made.axis = axis(v);
    }
    return made;
}

/* The inertia of two point masses or more. A body can have any such inertia. */
static kt_sym3 inertia(inventor *v) {
    kt_sym3 sum = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (int i = 0; i < 4; i++) {
        kt_vec3 r = kt_vec3_make(kt_random_normal(v->random), kt_random_normal(v->random), kt_random_normal(v->random));
        sum = kt_sym3_shift(sum, kt_random_uniform(v->random, 0.5, 1.0), r);
    }
    return chance(v) ? sum : kt_sym3_make(2.0, 3.0, 4.0, 0.0, 0.0, 0.0);
}

static void invent_body(inventor *v, int i) {
    kt_body *body = &v->out->bodies[i];
    *body = kt_body_default();
    body->name = body_names[i];
    int parent = pick(v, INVENT_BODIES + 1); /* of one that comes before it in a rotated order: never a cycle */
    if (parent < INVENT_BODIES && (parent + 5) % INVENT_BODIES < (i + 5) % INVENT_BODIES)
        body->parent = body_names[parent];
    body->joint = joint(v);
    body->shape = shape(v);
    body->mass = chance(v) ? positive(v) : 0.0;
    bool has_shape = body->shape.type != KT_SHAPE_NONE;
    body->com_of_shape = has_shape && chance(v);
    body->inertia_of_shape = has_shape && chance(v);
    if (!body->com_of_shape && chance(v))
        body->com = vector(v);
    if (!body->inertia_of_shape && chance(v))
        body->inertia = inertia(v);
    body->marker_count = pick(v, INVENT_MARKERS + 1);
    body->markers = body->marker_count > 0 ? v->out->markers[i] : NULL;
    for (int k = 0; k < body->marker_count; k++) {
        v->out->markers[i][k] = (kt_marker){.name = marker_names[k], .at = vector(v)};
        if (chance(v))
            v->out->markers[i][k].rotation = rotation(v);
    }
}

/* ---- loops and effects ------------------------------------------------------------------------------------------- */

/* `above_zero`: a length, which must stay so. */
static kt_function function(inventor *v, double *numbers, bool above_zero) {
    static const kt_function_type types[] = {KT_FUNCTION_CONSTANT,   KT_FUNCTION_SINE,  KT_FUNCTION_RAMP,
                                             KT_FUNCTION_POLYNOMIAL, KT_FUNCTION_TABLE, KT_FUNCTION_BUMP,
                                             KT_FUNCTION_EXPRESSION};
    kt_function made = {.type = types[pick(v, above_zero ? 5 : 7)]};
    double base = above_zero ? 1000.0 : any(v);
    switch (made.type) {
    case KT_FUNCTION_CONSTANT:
        made.value = base;
        break;
    case KT_FUNCTION_SINE:
        made.amplitude = kt_random_normal(v->random);
        made.frequency = positive(v);
        made.phase = chance(v) ? 0.0 : any(v);
        made.offset = base;
        break;
    case KT_FUNCTION_RAMP:
        made.from = base;
        made.to = above_zero ? 2.0 : any(v);
        made.start = chance(v) ? -0.0 : kt_random_uniform(v->random, -2.0, 0.0);
        made.end = positive(v);
        break;
    case KT_FUNCTION_POLYNOMIAL:
    case KT_FUNCTION_TABLE:
        made.numbers = numbers;
        made.number_count = made.type == KT_FUNCTION_TABLE ? 4 + 2 * pick(v, 3) : 1 + pick(v, INVENT_NUMBERS);
        for (int i = 0; i < made.number_count; i++)
            numbers[i] = i == 0 || above_zero ? base : any(v);
        for (int i = 0; made.type == KT_FUNCTION_TABLE && i < made.number_count; i += 2)
            numbers[i] = i + kt_random_uniform(v->random, 0.0, 1.0);
        if (made.type == KT_FUNCTION_TABLE && chance(v))
            made.interpolation = chance(v) ? KT_INTERPOLATION_CUBIC : KT_INTERPOLATION_MONOTONE;
        break;
    case KT_FUNCTION_BUMP:
        made.amplitude = base;
        made.end = positive(v);
        break;
    case KT_FUNCTION_EXPRESSION:
        made.text = chance(v) ? "1 - 2*exp(-t/3)" : "max(0, sin(2*pi*t))";
        break;
    case KT_FUNCTION_SUM:
    case KT_FUNCTION_PRODUCT:
    case KT_FUNCTION_NONE:
        break;
    }
    return made;
}

static kt_end end_on(inventor *v, const kt_body *body) {
    kt_end made = kt_end_default();
    if (body != NULL)
        made.body = body->name;
    if (body != NULL && body->marker_count > 0 && chance(v))
        made.marker = body->markers[pick(v, body->marker_count)].name;
    else if (chance(v))
        made.at = vector(v);
    if (chance(v))
        made.rotation = rotation(v);
    return made;
}

static void invent_ends(inventor *v, kt_end ends[2]) {
    int first = pick(v, INVENT_BODIES), step = 1 + pick(v, INVENT_BODIES - 1);
    ends[0] = end_on(v, &v->out->bodies[first]);
    ends[1] = end_on(v, chance(v) ? NULL : &v->out->bodies[(first + step) % INVENT_BODIES]);
}

/* A joint of one coordinate; body 0 is given one. */
static const char *scalar_joint(inventor *v) {
    const kt_body *body = &v->out->bodies[pick(v, INVENT_BODIES)];
    kt_joint_type type = body->joint.type;
    bool scalar = type == KT_JOINT_REVOLUTE || type == KT_JOINT_PRISMATIC || type == KT_JOINT_SCREW;
    return scalar ? body->name : v->out->bodies[0].name;
}

static bool is_among(kt_loop_type type, const kt_loop_type *types, int count) {
    for (int i = 0; i < count; i++)
        if (types[i] == type)
            return true;
    return false;
}

/* Only the members that the type has: the others are not written. */
static kt_surface invent_surface(inventor *v) {
    kt_surface s = {.type = (kt_surface_type)(KT_SURFACE_PLANE + pick(v, 4))};
    if (s.type != KT_SURFACE_PLANE)
        s.radius = positive(v);
    if (s.type == KT_SURFACE_TORUS)
        s.tube = positive(v);
    return s;
}

static kt_track invent_track(inventor *v) {
    static const kt_vec3 points[] = {{0.1, -2.0, 0.0}, {1.0 / 3.0, 0.0, 1e-3}, {7.0, 0.25, -0.0}};
    kt_track c = {.type = (kt_track_type)(KT_TRACK_LINE + pick(v, 4))};
    if (c.type == KT_TRACK_CIRCLE || c.type == KT_TRACK_HELIX)
        c.radius = positive(v);
    if (c.type == KT_TRACK_HELIX)
        c.pitch = positive(v);
    if (c.type == KT_TRACK_SPLINE) {
        c.points = points;
        c.point_count = chance(v) ? 2 : 3;
    }
    return c;
}

static void invent_loop(inventor *v, int i) {
    static const char *const names[INVENT_LOOPS] = {"l0", "off", "n", "l3", "l4", "l5",
                                                    "l6", "l7",  "~", "l9", "la", "lb"};
    static const kt_loop_type two_axes[] = {KT_LOOP_ORTHOGONAL, KT_LOOP_UNIVERSAL, KT_LOOP_ROLLING};
    static const kt_loop_type no_axis[] = {KT_LOOP_SPHERICAL, KT_LOOP_DISTANCE, KT_LOOP_PARALLEL, KT_LOOP_WELD,
                                           KT_LOOP_COUPLING,  KT_LOOP_MOTION,   KT_LOOP_RATES};
    kt_loop *loop = &v->out->loops[i];
    *loop = kt_loop_of(names[i][0] == '~' ? "l8" : names[i], (kt_loop_type)pick(v, KT_LOOP_TYPE_COUNT));
    if (loop->type != KT_LOOP_COUPLING && loop->type != KT_LOOP_MOTION && loop->type != KT_LOOP_RATES)
        invent_ends(v, loop->between);
    if (!is_among(loop->type, no_axis, 7) && chance(v))
        loop->axis = axis(v);
    if (is_among(loop->type, two_axes, 3) && chance(v))
        loop->axis2 = axis(v);
    if (loop->type == KT_LOOP_SURFACE)
        loop->surface = invent_surface(v);
    if (loop->type == KT_LOOP_CURVE) {
        loop->curve = invent_track(v);
        if (chance(v))
            loop->function = function(v, v->out->numbers[i], false);
    }
    if (loop->type == KT_LOOP_SCREW)
        loop->pitch = any(v);
    if (loop->type == KT_LOOP_ROLLING) {
        loop->radius = positive(v);
        loop->holonomic = chance(v);
    }
    if (loop->type >= KT_LOOP_GEAR) {
        loop->radius = loop->radius2 = positive(v);
        loop->second_axis = axis(v);
        loop->tension = loop->type >= KT_LOOP_SPAN ? positive(v) : 0.0;
        loop->crossed = loop->type == KT_LOOP_BELT && chance(v);
        if (loop->type == KT_LOOP_RACK || loop->type == KT_LOOP_WORM)
            loop->radius2 = 0.0;
        if (loop->type == KT_LOOP_WORM)
            loop->teeth = loop->teeth2 = 2.0;
        if (loop->type <= KT_LOOP_WORM)
            loop->pressure_angle = positive(v);
        if (loop->type == KT_LOOP_GEAR)
            loop->helix_angle = any(v);
    }
    if (loop->type == KT_LOOP_DISTANCE && chance(v))
        loop->function = function(v, v->out->numbers[i], true);
    if (loop->type == KT_LOOP_MOTION) {
        loop->joint = scalar_joint(v);
        loop->function = function(v, v->out->numbers[i], false);
    }
    if (loop->type == KT_LOOP_RATES && chance(v))
        loop->function = function(v, v->out->numbers[i], false);
    if (loop->type == KT_LOOP_COUPLING || loop->type == KT_LOOP_RATES) {
        loop->terms = v->out->terms[i];
        v->out->terms[i][0] = (kt_term){v->out->bodies[0].name, 1.0 / 3.0};
        v->out->terms[i][1] = (kt_term){scalar_joint(v), any(v)};
        loop->term_count = strcmp(v->out->terms[i][1].joint, v->out->bodies[0].name) == 0 ? 1 : 2;
        loop->offset = loop->type == KT_LOOP_RATES || chance(v) ? 0.0 : any(v);
        if (loop->type == KT_LOOP_COUPLING && loop->term_count == 2 && chance(v)) {
            (void)snprintf(v->out->formulas[i], sizeof v->out->formulas[i], "-3*position.%.80s^2",
                           v->out->terms[i][1].joint);
            loop->formula = v->out->formulas[i];
        }
    }
}

/* Some of the numbers that have a default of their own. */
static void maybe_positive(inventor *v, double *number) {
    if (chance(v))
        *number = positive(v);
}

static double not_negative(inventor *v) { return chance(v) ? 0.0 : positive(v); }

static void invent_in_joint(inventor *v, kt_effect *effect, int i) {
    effect->joint = scalar_joint(v);
    switch (effect->type) {
    case KT_EFFECT_JOINT_SPRING:
        effect->stiffness = not_negative(v);
        effect->rest = function(v, v->out->numbers[INVENT_LOOPS + i], false);
        break;
    case KT_EFFECT_JOINT_FRICTION:
        effect->coulomb = not_negative(v);
        effect->breakaway = chance(v) ? 0.0 : effect->coulomb * 1.5;
        effect->viscous = not_negative(v);
        maybe_positive(v, &effect->stribeck);
        maybe_positive(v, &effect->smoothing);
        return;
    case KT_EFFECT_JOINT_LIMIT:
        effect->stiffness = positive(v);
        effect->lower = any(v);
        if (chance(v))
            effect->upper = effect->lower + not_negative(v);
        if (!isinf(effect->upper) && chance(v))
            effect->lower = -(double)INFINITY;
        break;
    case KT_EFFECT_SERVO:
        effect->stiffness = positive(v);
        effect->target = function(v, v->out->numbers[INVENT_LOOPS + i], false);
        maybe_positive(v, &effect->limit);
        if (chance(v))
            effect->lower = any(v);
        if (!isinf(effect->lower) && chance(v))
            effect->upper = effect->lower + not_negative(v);
        break;
    case KT_EFFECT_MOTOR:
        effect->torque = function(v, v->out->numbers[INVENT_LOOPS + i], false);
        return;
    default:
        break;
    }
    effect->damping = not_negative(v);
}

static void invent_between(inventor *v, kt_effect *effect) {
    invent_ends(v, effect->between);
    switch (effect->type) {
    case KT_EFFECT_SPRING:
        effect->stiffness = not_negative(v);
        effect->initial_length = chance(v);
        if (!effect->initial_length && chance(v))
            effect->length = positive(v);
        effect->damping = not_negative(v);
        break;
    case KT_EFFECT_BUSHING:
        for (int k = 0; k < 6; k++) {
            effect->stiffnesses[k] = not_negative(v);
            effect->dampings[k] = not_negative(v);
        }
        break;
    case KT_EFFECT_CONTACT:
        effect->stiffness = positive(v);
        effect->radius = not_negative(v);
        effect->dissipation = not_negative(v);
        effect->friction = not_negative(v);
        maybe_positive(v, &effect->slip);
        if (chance(v))
            effect->exponent = 1.0 + not_negative(v);
        if (chance(v))
            effect->axis = axis(v);
        break;
    default:
        effect->strength = any(v);
    }
}

static void invent_on_one(inventor *v, kt_effect *effect, int i) {
    effect->between[0] = end_on(v, &v->out->bodies[pick(v, INVENT_BODIES)]);
    if (effect->type == KT_EFFECT_DRAG) {
        effect->linear = not_negative(v);
        effect->quadratic = not_negative(v);
        for (int k = 0; k < 6 && chance(v); k++) {
            effect->dampings[k] = not_negative(v);
            effect->quadratics[k] = not_negative(v);
        }
        return;
    }
    if (effect->type == KT_EFFECT_THRUST) {
        effect->mass = function(v, v->out->numbers[INVENT_LOOPS + i], false);
        effect->exhaust = kt_vec3_make(any(v), any(v), any(v));
        return;
    }
    for (int k = 0; k < 3; k++)
        effect->value[k] =
            k == 1 ? function(v, v->out->numbers[INVENT_LOOPS + i], false) : kt_function_constant(any(v));
    effect->frame = chance(v) ? KT_FRAME_BODY : KT_FRAME_WORLD;
}

/* An effect with a formula. It takes its ends, or its joint, from another random effect. */
static void invent_expression(inventor *v, kt_effect *effect, int i) {
    const bool between = chance(v);
    kt_effect drawn = kt_effect_of(between ? KT_EFFECT_SPRING : KT_EFFECT_JOINT_SPRING, NULL);
    if (between) {
        invent_between(v, &drawn);
        memcpy(effect->between, drawn.between, sizeof effect->between);
        effect->end_count = 2;
        effect->formula[0] = "-3*(length - 1)^3 - speed";
    } else {
        invent_in_joint(v, &drawn, i);
        effect->joint = drawn.joint;
        effect->formula[0] = chance(v) ? "1 - 2*sin(t)" : "max(0, t)";
    }
}

static void invent_effect(inventor *v, int i) {
    static const char *const names[INVENT_EFFECTS] = {NULL, "yes", NULL, "e3", NULL, "e5"};
    kt_effect *effect = &v->out->effects[i];
    *effect = kt_effect_of((kt_effect_type)pick(v, KT_EFFECT_TYPE_COUNT), NULL);
    effect->name = names[i];
    switch (effect->type) {
    case KT_EFFECT_SPRING:
    case KT_EFFECT_BUSHING:
    case KT_EFFECT_ATTRACTION:
    case KT_EFFECT_CONTACT:
        invent_between(v, effect);
        break;
    case KT_EFFECT_FORCE:
    case KT_EFFECT_TORQUE:
    case KT_EFFECT_DRAG:
    case KT_EFFECT_THRUST:
        invent_on_one(v, effect, i);
        break;
    case KT_EFFECT_EXPRESSION:
        invent_expression(v, effect, i);
        break;
    default:
        invent_in_joint(v, effect, i);
    }
}

/* ---- the run ----------------------------------------------------------------------------------------------------- */

static void invent_run(inventor *v) {
    kt_run *run = &v->out->scene.run;
    *run = kt_run_default();
    if (chance(v)) {
        run->integrator = kt_method_at(pick(v, kt_method_count()))->name;
        run->step = positive(v);
        if (strcmp(run->integrator, "two-step") == 0)
            run->rho = 0.125 * pick(v, 9);
    } else if (chance(v)) {
        run->relative = chance(v) ? 0.0 : positive(v);
        run->absolute = chance(v) ? run->relative + 1e-12 : positive(v);
    }
    if (chance(v))
        run->duration = positive(v);
    if (chance(v))
        run->interval = positive(v);
    run->record = (unsigned)pick(v, 128);
    if (v->everything) {
        v->out->scene.formulation = chance(v) ? KT_FORMULATION_TREE : KT_FORMULATION_ABSOLUTE;
        v->out->scene.reduction = (kt_reduction)pick(v, 3);
        run->metric = chance(v) ? KT_METRIC_IDENTITY : KT_METRIC_MASS;
        run->plan = chance(v) ? KT_PLAN_AUTO : KT_PLAN_SPATIAL;
    }
    for (int i = 0; i < INVENT_BODIES; i++)
        if (v->out->bodies[i].marker_count > 0 && chance(v))
            v->out->pairs[run->marker_count++] =
                (kt_marker_pair){v->out->bodies[i].name, v->out->bodies[i].markers[0].name};
    run->markers = run->marker_count > 0 ? v->out->pairs : NULL;
}

void kt_invent(kt_invented *out, kt_random *random, bool everything) {
    inventor v = {out, random, everything};
    out->scene = kt_scene_default();
    kt_description *d = &out->scene.description;
    if (chance(&v)) {
        snprintf(out->text, sizeof out->text, "scene #%d: \"one\" of 'many'\n\t\xC3\xA9 %g", pick(&v, 1000), any(&v));
        d->name = out->text;
    }
    if (chance(&v))
        d->gravity = vector(&v);
    d->inertia_check = (kt_inertia_limit)pick(&v, KT_INERTIA_LIMIT_COUNT);
    d->bodies = out->bodies;
    d->body_count = INVENT_BODIES;
    for (int i = 0; i < INVENT_BODIES; i++)
        invent_body(&v, i);
    out->bodies[0].joint = kt_joint_default();
    out->bodies[0].joint.type = KT_JOINT_REVOLUTE;
    if (everything) {
        d->loops = out->loops;
        d->effects = out->effects;
        d->hold = out->hold;
        d->loop_count = INVENT_LOOPS;
        d->effect_count = INVENT_EFFECTS;
        for (int i = 0; i < INVENT_LOOPS; i++)
            invent_loop(&v, i);
        for (int i = 0; i < INVENT_EFFECTS; i++)
            invent_effect(&v, i);
        d->hold_count = pick(&v, 3);
        out->hold[0] = body_names[0];
        out->hold[1] = body_names[1];
    }
    invent_run(&v);
}
