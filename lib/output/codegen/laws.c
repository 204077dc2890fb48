/* The laws of effects, as nodes. Each has the formula of its file in lib/model/effect; a condition becomes a choice,
 * both sides of which are computed. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"
#include "effect/rim.h"

#include "codegen/node_effect.h"

#include <float.h>
#include <stdio.h>

static kt_graph *graph_of(const code_effect *e) { return e->tree->graph; }

static kt_op constant(const code_effect *e, double x) { return kt_op_number(graph_of(e), x); }

static kt_op law_number_of(const code_effect *e, const char *key, const char *meaning, double value) {
    return kt_code_number(e->tree, e->name, key, meaning, value);
}

static kt_op3 choose_vector(kt_graph *g, kt_op condition, kt_op3 chosen, kt_op3 other) {
    kt_op3 out;
    for (int k = 0; k < 3; k++)
        out.x[k] = kt_op_choose(g, condition, chosen.x[k], other.x[k]);
    return out;
}

static kt_op3 negative_of(kt_graph *g, kt_op3 a) { return kt_op3_scale(g, kt_op_number(g, -1.0), a); }

/* ---- joints ------------------------------------------------------------------------------------------------------ */

static const char torque_unit[] = "N m or N", stiffness_unit[] = "N m/rad or N/m",
                  damping_unit[] = "N m s/rad or N s/m", position_unit[] = "rad or m", speed_unit[] = "rad/s or m/s";

static kt_op spring_in_joint(const code_effect *e, kt_op q, kt_op v) {
    kt_graph *g = graph_of(e);
    const kt_op c = law_number_of(e, "damping", damping_unit, e->record->damping);
    const kt_op k = law_number_of(e, "stiffness", stiffness_unit, e->record->stiffness);
    const kt_op r = kt_code_curve(e->tree, &e->record->curve[0], e->name, "rest", position_unit);
    return kt_op_negate(g, kt_op_add_products(g, k, kt_op_subtract(g, q, r), c, v));
}

/* -(F tanh(v / smoothing) + viscous v), F = coulomb + max(static - coulomb, 0) exp(-(v / stribeck)^2). */
static kt_op friction_in_joint(const code_effect *e, kt_op v) {
    kt_graph *g = graph_of(e);
    const kt_effect_record *r = e->record;
    const kt_op zero = constant(e, 0.0), viscous = law_number_of(e, "viscous", damping_unit, r->viscous);
    const kt_op sharp = law_number_of(e, "smoothing", speed_unit, r->smoothing);
    kt_op dry = law_number_of(e, "coulomb", torque_unit, r->coulomb);
    if (r->breakaway > 0.0 && r->stribeck > 0.0) {
        const kt_op more = kt_op_subtract(g, law_number_of(e, "static", torque_unit, r->breakaway), dry);
        const kt_op ratio = kt_op_divide(g, v, law_number_of(e, "stribeck", speed_unit, r->stribeck));
        const kt_op fall = kt_op_call(g, KT_OP_EXP, kt_op_negate(g, kt_op_multiply(g, ratio, ratio)), -1);
        dry = kt_op_add(g, dry, kt_op_multiply(g, kt_op_choose(g, more, more, zero), fall));
    }
    const kt_op sign = kt_op_call(g, KT_OP_TANH, kt_op_divide(g, v, sharp), -1);
    return kt_op_negate(g, kt_op_add_products(g, dry, sign, viscous, v));
}

/* The force beyond one stop, by x, and with the sign of its motion. */
static kt_op stop_in_joint(const code_effect *e, kt_op q, kt_op v) {
    kt_graph *g = graph_of(e);
    const kt_effect_record *r = e->record;
    const kt_op zero = constant(e, 0.0), one = constant(e, 1.0), none = constant(e, -1.0);
    const kt_op k = law_number_of(e, "stiffness", stiffness_unit, r->stiffness);
    const kt_op c = law_number_of(e, "damping", damping_unit, r->damping);
    const kt_op above =
        isinf(r->upper) ? none : kt_op_subtract(g, q, law_number_of(e, "upper", position_unit, r->upper));
    const kt_op below =
        isinf(r->lower) ? none : kt_op_subtract(g, law_number_of(e, "lower", position_unit, r->lower), q);
    const kt_op is_lower = kt_op_subtract(g, below, above);
    const kt_op x = isinf(r->upper) ? below : isinf(r->lower) ? above : kt_op_choose(g, is_lower, below, above);
    const kt_op side = isinf(r->upper) ? none : isinf(r->lower) ? one : kt_op_choose(g, is_lower, none, one);
    const kt_op elastic = kt_op_multiply(g, k, x), viscous = kt_op_multiply(g, c, kt_op_multiply(g, side, v));
    const kt_op sum = kt_op_add(g, elastic, kt_op_call(g, KT_OP_ABS, viscous, -1));
    const kt_op damped = kt_op_multiply(g, viscous, kt_op_divide(g, elastic, sum));
    return kt_op_choose(g, x, kt_op_negate(g, kt_op_multiply(g, side, kt_op_add(g, elastic, damped))), zero);
}

/* u up to 0.9 L, L from 1.1 L on, and L - (1.1 L - u)^2 / (0.4 L) between */
static kt_op limit_smoothly(const code_effect *e, kt_op u) {
    kt_graph *g = graph_of(e);
    if (isinf(e->record->limit))
        return u;
    const kt_op limit = law_number_of(e, "limit", torque_unit, e->record->limit);
    const kt_op size = kt_op_call(g, KT_OP_ABS, u, -1);
    const kt_op missing = kt_op_subtract(g, kt_op_scale(g, 1.1, limit), size), range = kt_op_scale(g, 4.0 * 0.1, limit);
    const kt_op part = kt_op_divide(g, kt_op_multiply(g, missing, missing), range);
    const kt_op force = kt_op_choose(g, missing, kt_op_subtract(g, limit, part), limit);
    const kt_op minus = kt_op_negate(g, force), signed_force = kt_op_choose(g, kt_op_negate(g, u), minus, force);
    return kt_op_choose_above(g, size, kt_op_scale(g, 0.9, limit), signed_force, u);
}

/* k (target - q) + c (target' - v) between the bounds, then limited smoothly. */
static kt_op servo_in_joint(const code_effect *e, kt_op q, kt_op v) {
    kt_graph *g = graph_of(e);
    const kt_effect_record *r = e->record;
    const kt_op k = law_number_of(e, "stiffness", stiffness_unit, r->stiffness);
    const kt_op c = law_number_of(e, "damping", damping_unit, r->damping);
    const kt_op target = kt_code_curve(e->tree, &r->curve[0], e->name, "target", position_unit);
    const kt_op error_rate = kt_op_subtract(g, kt_code_rate_of_time(g, target), v);
    kt_op u = kt_op_add_products(g, k, kt_op_subtract(g, target, q), c, error_rate);
    if (!isinf(r->lower)) {
        const kt_op lower = law_number_of(e, "lower", torque_unit, r->lower);
        u = kt_op_choose_above(g, lower, u, lower, u);
    }
    if (!isinf(r->upper)) {
        const kt_op upper = law_number_of(e, "upper", torque_unit, r->upper);
        u = kt_op_choose_above(g, u, upper, upper, u);
    }
    return limit_smoothly(e, u);
}

kt_op kt_code_formula_value(const code_effect *e, int k) {
    const kt_model *model = e->tree->model;
    kt_op value[KT_FORMULA_VARIABLE_MAX] = {0};
    for (int i = 0; i < e->record->variable_count; i++)
        value[i] = kt_code_variable(e, &model->variable[e->record->variable + i]);
    return e->record->formula[k] > 0 ? kt_code_formula(graph_of(e), kt_code_formula_of(model, e->record, k), value)
                                     : constant(e, 0.0);
}

kt_op kt_code_joint_force(const code_effect *e, kt_op q, kt_op v) {
    switch (e->record->type) {
    case KT_EFFECT_JOINT_SPRING:
        return spring_in_joint(e, q, v);
    case KT_EFFECT_JOINT_DAMPER:
        return kt_op_negate(
            graph_of(e), kt_op_multiply(graph_of(e), law_number_of(e, "damping", damping_unit, e->record->damping), v));
    case KT_EFFECT_JOINT_FRICTION:
        return friction_in_joint(e, v);
    case KT_EFFECT_JOINT_LIMIT:
        return stop_in_joint(e, q, v);
    case KT_EFFECT_MOTOR:
        return kt_code_curve(e->tree, &e->record->curve[0], e->name, "torque", torque_unit);
    case KT_EFFECT_SERVO:
        return servo_in_joint(e, q, v);
    default: /* KT_EFFECT_EXPRESSION */
        return kt_code_formula_value(e, 0);
    }
}

/* ---- ends -------------------------------------------------------------------------------------------------------- */

/* The ends pull each other with a force along d. */
static void pull_ends(code_effect *e, kt_op3 force) {
    e->force[0] = force;
    e->force[1] = negative_of(graph_of(e), force);
}

/* (k (l - rest) + c l') d / l. Ends at one point have no direction d / l; then the force is c d'. */
static void spring_between(code_effect *e) {
    kt_graph *g = graph_of(e);
    const kt_effect_record *r = e->record;
    const kt_op k = law_number_of(e, "stiffness", "N/m", r->stiffness),
                c = law_number_of(e, "damping", "N s/m", r->damping);
    const kt_op rest = law_number_of(e, "length", "m", r->length), least = constant(e, DBL_MIN);
    const code_line line = kt_code_line_of(e);
    const kt_op apart = kt_op_subtract(g, kt_op3_dot(g, line.d, line.d), least);
    const kt_op tension = kt_op_add_products(g, k, kt_op_subtract(g, line.length, rest), c, line.rate);
    const kt_op3 elastic = kt_op3_scale(g, kt_op_divide(g, tension, line.length), line.d);
    pull_ends(e, choose_vector(g, apart, elastic, kt_op3_scale(g, c, line.moving)));
}

static void attraction_between(code_effect *e) {
    kt_graph *g = graph_of(e);
    const kt_op s = law_number_of(e, "strength", "N m^2", e->record->strength);
    const kt_op3 d = kt_op3_subtract(g, e->end[1].point, e->end[0].point);
    const kt_op distance = kt_op3_length(g, d), least = constant(e, 1e-50);
    const kt_op r = kt_op_choose_above(g, distance, least, distance, least);
    const kt_op force = kt_op_divide(g, kt_op_divide(g, s, r), r);
    pull_ends(e, kt_op3_scale(g, force, kt_op3_scale(g, kt_op_divide(g, constant(e, 1.0), r), d)));
}

/* Subtracts sum_i h_i(e_i . v) e_i with h(s) = (b + q |s|) s; part: 0 for the force, 3 for the moment. */
static void resist_along(const code_effect *e, int part, kt_op3 v, kt_op3 *sum) {
    kt_graph *g = graph_of(e);
    for (int i = 0; i < 3; i++) {
        char linear[] = "axes_linear_1", quadratic[] = "axes_quadratic_1";
        linear[sizeof linear - 2] = quadratic[sizeof quadratic - 2] = (char)('1' + part + i);
        const kt_op b = law_number_of(e, linear, "N s/m or N m s/rad", e->record->dampings[part + i]);
        const kt_op q = law_number_of(e, quadratic, "N s^2/m^2 or N m s^2/rad^2", e->record->quadratics[part + i]);
        const kt_op33 *axes = &e->end[0].axes;
        const kt_op3 along = {{axes->row[0].x[i], axes->row[1].x[i], axes->row[2].x[i]}};
        const kt_op s = kt_op3_dot(g, along, v);
        const kt_op h = kt_op_add(g, b, kt_op_multiply(g, q, kt_op_call(g, KT_OP_ABS, s, -1)));
        *sum = kt_op3_subtract(g, *sum, kt_op3_scale(g, kt_op_multiply(g, h, s), along));
    }
}

/* -(linear + quadratic |v|) v, and the resistance along each axis of the end to its velocity and its rotation. */
static void drag_at_end(code_effect *e) {
    kt_graph *g = graph_of(e);
    const kt_op3 v = e->end[0].velocity;
    const kt_op linear = law_number_of(e, "linear", "N s/m", e->record->linear);
    const kt_op quadratic = law_number_of(e, "quadratic", "N s^2/m^2", e->record->quadratic);
    const kt_op c = kt_op_add(g, linear, kt_op_multiply(g, quadratic, kt_op3_length(g, v)));
    e->force[0] = kt_op3_scale(g, kt_op_negate(g, c), v);
    resist_along(e, 0, v, &e->force[0]);
    resist_along(e, 3, e->end[0].omega, &e->moment[0]);
}

static kt_op3 velocity_at(kt_graph *g, const code_end *end, kt_op3 arm) {
    return kt_op3_add(g, end->velocity, kt_op3_cross(g, end->omega, arm));
}

/* The numbers of a contact, and its normal. */
typedef struct code_contact {
    kt_op radius, stiffness, exponent, loss, friction, slip, rolling, torsion, turn;
    kt_op3 n, apart; /* apart: from the plane's point to the centre */
} code_contact;

/* The numbers of a contact as operations: a number of the model, or a parameter of the code. */
static code_contact numbers_of_contact(const code_effect *e) {
    kt_graph *g = graph_of(e);
    const kt_effect_record *r = e->record;
    const kt_op33 *axes = &e->end[1].axes;
    code_contact c = {.n = {{axes->row[0].x[2], axes->row[1].x[2], axes->row[2].x[2]}}};
    c.radius = law_number_of(e, "radius", "m", r->radius);
    c.stiffness = law_number_of(e, "stiffness", "N/m^exponent", r->stiffness);
    c.exponent = law_number_of(e, "exponent", "of the depth", r->exponent);
    c.loss = law_number_of(e, "dissipation", "s/m", r->dissipation);
    c.friction = law_number_of(e, "friction", "coefficient", r->friction);
    c.slip = law_number_of(e, "slip", "m/s", r->slip);
    c.apart = kt_op3_subtract(g, e->end[0].point, e->end[1].point);
    if (r->rolling > 0.0 || r->torsion > 0.0) {
        c.rolling = law_number_of(e, "rolling", "m", r->rolling);
        c.torsion = law_number_of(e, "torsion", "m", r->torsion);
        c.turn = law_number_of(e, "turn", "rad/s", r->turn);
    }
    return c;
}

/* The resisting force per unit of speed: most tanh(|s| / s0) / |s| */
static kt_op rub_of_contact(const code_effect *e, kt_op most, kt_op scale, kt_op speed) {
    kt_graph *g = graph_of(e);
    const kt_op ratio = kt_op_divide(g, speed, scale);
    kt_op share = kt_op_divide(g, kt_op_call(g, KT_OP_TANH, ratio, -1), ratio);
    share = kt_op_choose(g, ratio, share, constant(e, 1.0));
    return kt_op_multiply(g, kt_op_divide(g, most, scale), share);
}

/* Rolling and torsional friction of a normal force, as a moment on the first end. */
static kt_op3 turning_of_contact(const code_effect *e, const code_contact *c, kt_op normal) {
    kt_graph *g = graph_of(e);
    const kt_op3 w = kt_op3_subtract(g, e->end[0].omega, e->end[1].omega);
    const kt_op spin = kt_op3_dot(g, c->n, w), speed = kt_op_call(g, KT_OP_ABS, spin, -1);
    const kt_op3 about = kt_op3_scale(g, spin, c->n), roll = kt_op3_subtract(g, w, about);
    const kt_op rolls = kt_op_multiply(g, c->rolling, normal), turns = kt_op_multiply(g, c->torsion, normal);
    const kt_op rolling = rub_of_contact(e, rolls, c->turn, kt_op3_length(g, roll));
    const kt_op turning = rub_of_contact(e, turns, c->turn, speed);
    return negative_of(g, kt_op3_combine(g, rolling, roll, turning, about));
}

/* Adds the contact in a point at `down` from the first end, x deep if x is positive. */
static void contact_in_point(code_effect *e, const code_contact *c, kt_op3 down, kt_op x) {
    kt_graph *g = graph_of(e);
    const kt_effect_record *r = e->record;
    const kt_op zero = constant(e, 0.0), depth = kt_op_choose(g, x, x, zero);
    const kt_op3 arm = kt_op3_add(g, c->apart, down);
    const kt_op3 plane = velocity_at(g, &e->end[1], arm);
    const kt_op3 s = kt_op3_subtract(g, velocity_at(g, &e->end[0], down), plane);
    const kt_op deeper = kt_op_negate(g, kt_op3_dot(g, c->n, s));
    const kt_op elastic = kt_op_multiply(g, c->stiffness, kt_op_call(g, KT_OP_POWER, depth, c->exponent));
    const kt_op more = kt_op_multiply(g, kt_op_scale(g, 1.5, c->loss), deeper);
    const kt_op gain = kt_op_add(g, constant(e, 1.0), more);
    const kt_op normal = kt_op_multiply(g, elastic, kt_op_choose(g, gain, gain, zero));
    const kt_op3 across = kt_op3_add(g, s, kt_op3_scale(g, deeper, c->n));
    const kt_op speed = kt_op3_length(g, across), most = kt_op_multiply(g, c->friction, normal);
    const kt_op3 friction = kt_op3_scale(g, rub_of_contact(e, most, c->slip, speed), across);
    const kt_op3 force = kt_op3_subtract(g, kt_op3_scale(g, normal, c->n), friction);
    const kt_op3 back = negative_of(g, force);
    e->force[0] = kt_op3_add(g, e->force[0], force);
    e->force[1] = kt_op3_add(g, e->force[1], back);
    e->moment[0] = kt_op3_add(g, e->moment[0], kt_op3_cross(g, down, force));
    e->moment[1] = kt_op3_add(g, e->moment[1], kt_op3_cross(g, arm, back));
    if (r->rolling > 0.0 || r->torsion > 0.0) {
        const kt_op3 moment = turning_of_contact(e, c, normal);
        e->moment[0] = kt_op3_add(g, e->moment[0], moment);
        e->moment[1] = kt_op3_subtract(g, e->moment[1], moment);
    }
}

/* The points of a disc's rim (effect/effect_contact.c). */
static void contact_on_rim(code_effect *e, const code_contact *c) {
    kt_graph *g = graph_of(e);
    const kt_op33 *disc = &e->end[0].axes;
    const kt_op3 axle = {{disc->row[0].x[2], disc->row[1].x[2], disc->row[2].x[2]}},
                 fixed = {{disc->row[0].x[1], disc->row[1].x[1], disc->row[2].x[1]}};
    const kt_op3 tilt = kt_op3_cross(g, c->n, axle);
    const kt_op s = kt_op3_length(g, tilt), leans = kt_op_subtract(g, s, constant(e, KT_RIM_FLAT));
    const kt_op one = constant(e, 1.0), per_s = kt_op_divide(g, one, kt_op_choose(g, leans, s, one));
    const kt_op3 across = choose_vector(g, leans, kt_op3_scale(g, per_s, tilt), fixed);
    const kt_op3 lowest = kt_op3_cross(g, across, axle);
    for (int i = 0; i < KT_RIM_POINTS; i++) {
        const kt_op a = kt_op_scale(g, kt_rim_cosine(i), c->radius), b = kt_op_scale(g, kt_rim_sine(i), c->radius);
        const kt_op3 down = kt_op3_combine(g, a, lowest, b, across);
        contact_in_point(e, c, down, kt_op_negate(g, kt_op3_dot(g, c->n, kt_op3_add(g, c->apart, down))));
    }
}

/* With the height h = n . (c - p) of a sphere over a plane, x = r - h is its depth. */
static void contact_between(code_effect *e) {
    kt_graph *g = graph_of(e);
    const code_contact c = numbers_of_contact(e);
    e->force[0] = e->force[1] = e->moment[0] = e->moment[1] = kt_op3_zero(g);
    if (e->record->disc) {
        contact_on_rim(e, &c);
        return;
    }
    const kt_op x = kt_op_subtract(g, c.radius, kt_op3_dot(g, c.n, c.apart));
    contact_in_point(e, &c, kt_op3_scale(g, kt_op_negate(g, c.radius), c.n), x);
}

/* Three numbers KEY_1 and so on, which multiply a vector. */
static kt_op3 scale_each(const code_effect *e, const char *key, int first, const double *value, kt_op3 of) {
    kt_graph *g = graph_of(e);
    kt_op3 out;
    for (int i = 0; i < 3; i++) {
        char name[16];
        (void)snprintf(name, sizeof name, "%s_%d", key, first + i + 1);
        out.x[i] = kt_op_multiply(
            g, law_number_of(e, name, "along or about an axis of the first end", value[first + i]), of.x[i]);
    }
    return out;
}

/* A multiple of the quaternion (w, v) of a rotation with w >= 0: among four candidates, the quaternion with the largest
 * component (Shepperd 1978). */
static void quaternion_of(kt_graph *g, const kt_op33 *r, kt_op p[4]) {
    static const int sign[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    kt_op largest = 0, size[4], sum[3], difference[3];
    for (int i = 0; i < 3; i++) {
        const kt_op up = r->row[(i + 2) % 3].x[(i + 1) % 3], down = r->row[(i + 1) % 3].x[(i + 2) % 3];
        sum[i] = kt_op_add(g, up, down);
        difference[i] = kt_op_subtract(g, up, down);
    }
    for (int k = 0; k < 4; k++) {
        size[k] = kt_op_number(g, 1.0);
        for (int i = 0; i < 3; i++)
            size[k] =
                sign[k][i] > 0 ? kt_op_add(g, size[k], r->row[i].x[i]) : kt_op_subtract(g, size[k], r->row[i].x[i]);
    }
    const kt_op own[4][4] = {{size[0], difference[0], difference[1], difference[2]},
                             {difference[0], size[1], sum[2], sum[1]},
                             {difference[1], sum[2], size[2], sum[0]},
                             {difference[2], sum[1], sum[0], size[3]}};
    for (int k = 0; k < 4; k++) {
        const kt_op above = k == 0 ? kt_op_number(g, 1.0) : kt_op_subtract(g, size[k], largest);
        for (int i = 0; i < 4; i++)
            p[i] = k == 0 ? own[k][i] : kt_op_choose(g, above, own[k][i], p[i]);
        largest = k == 0 ? size[0] : kt_op_choose(g, above, size[k], largest);
    }
    const kt_op is_negative = kt_op_negate(g, p[0]);
    for (int i = 3; i >= 0; i--)
        p[i] = kt_op_choose(g, is_negative, kt_op_negate(g, p[i]), p[i]);
}

/* The Euler vector of a rotation: theta = 2 atan2(|v|, w) v / |v| */
static kt_op3 euler_vector_of(kt_graph *g, const kt_op33 *r) {
    kt_op p[4];
    quaternion_of(g, r, p);
    const kt_op3 v = {{p[1], p[2], p[3]}};
    const kt_op sine = kt_op3_length(g, v), two = kt_op_number(g, 2.0);
    const kt_op half = kt_op_divide(g, kt_op_call(g, KT_OP_ATAN2, sine, p[0]), sine);
    const kt_op limit = kt_op_divide(g, two, p[0]); /* of theta / |v| */
    return kt_op3_scale(g, kt_op_choose(g, sine, kt_op_multiply(g, two, half), limit), v);
}

/* G^-T u = u + theta x u / 2 + c theta x (theta x u), with c of x = |theta|^2 (effect/triple.h) */
static kt_op3 map_moment(const code_effect *e, kt_op3 theta, kt_op3 u) {
    static const double series[] = {1.0 / 12.0,         1.0 / 720.0,      1.0 / 30240.0,
                                    1.0 / 1209600.0,    1.0 / 47900160.0, 691.0 / 1307674368000.0,
                                    1.0 / 74724249600.0};
    kt_graph *g = graph_of(e);
    const kt_op x = kt_op3_dot(g, theta, theta), one = constant(e, 1.0);
    const kt_op y = kt_op_scale(g, 0.5, kt_op_call(g, KT_OP_SQRT, x, -1));
    const kt_op far = kt_op_subtract(g, one, kt_op_divide(g, y, kt_op_call(g, KT_OP_TAN, y, -1)));
    kt_op near = constant(e, 0.0);
    for (int k = 6; k >= 0; k--) {
        near = kt_op_multiply(g, x, near);
        near = kt_op_add(g, constant(e, series[k]), near);
    }
    const kt_op ratio = kt_op_divide(g, far, x), c = kt_op_choose_above(g, constant(e, 0.25), x, near, ratio);
    const kt_op3 across = kt_op3_cross(g, theta, u);
    const kt_op3 half = kt_op3_scale(g, constant(e, 0.5), across);
    const kt_op3 second = kt_op3_scale(g, c, kt_op3_cross(g, theta, across));
    return kt_op3_add(g, kt_op3_add(g, u, half), second);
}

/* A bushing in the axes of the first end: springs act on the distance d and on the Euler vector theta, dampers on
 * their rates. The moment on the first end includes that of the force at the second end. */
static void bushing_between(code_effect *e) {
    kt_graph *g = graph_of(e);
    const kt_effect_record *r = e->record;
    const code_end *first = &e->end[0], *second = &e->end[1];
    const kt_op33 *axes = &first->axes, back = kt_op33_transpose(axes),
                  turned = kt_op33_multiply(g, &back, &second->axes);
    const kt_op3 apart = kt_op3_subtract(g, second->point, first->point);
    const kt_op3 moving = kt_op3_subtract(g, second->velocity, velocity_at(g, first, apart));
    const kt_op3 d = kt_op33_apply(g, &back, apart), u = kt_op33_apply(g, &back, moving);
    const kt_op3 w = kt_op33_apply(g, &back, kt_op3_subtract(g, second->omega, first->omega));
    const kt_op3 theta = euler_vector_of(g, &turned);
    const kt_op3 spring = scale_each(e, "stiffness", 0, r->stiffnesses, d);
    const kt_op3 twist = map_moment(e, theta, scale_each(e, "stiffness", 3, r->stiffnesses, theta));
    const kt_op3 damper = scale_each(e, "damping", 0, r->dampings, u);
    const kt_op3 brake = scale_each(e, "damping", 3, r->dampings, w);
    e->force[0] = kt_op33_apply(g, axes, kt_op3_add(g, spring, damper));
    e->force[1] = negative_of(g, e->force[0]);
    const kt_op3 moment = kt_op33_apply(g, axes, kt_op3_add(g, twist, brake));
    e->moment[1] = negative_of(g, moment);
    e->moment[0] = kt_op3_add(g, moment, kt_op3_cross(g, apart, e->force[0]));
}

/* A vector in world axes, or in the axes of the end. */
static kt_op3 vector_at_end(const code_effect *e, kt_op3 value) {
    return e->record->in_body ? kt_op33_apply(graph_of(e), &e->end[0].axes, value) : value;
}

static kt_op3 curves_at_end(const code_effect *e, const char *unit) {
    static const char *const key[] = {"value_x", "value_y", "value_z"};
    kt_op3 value;
    for (int k = 0; k < 3; k++)
        value.x[k] = kt_code_curve(e->tree, &e->record->curve[k], e->name, key[k], unit);
    return vector_at_end(e, value);
}

/* m' u, with the exhaust's velocity u relative to the body and the mass m as a function of time. */
static void thrust_at_end(code_effect *e) {
    kt_graph *g = graph_of(e);
    const double u[3] = {e->record->exhaust.x, e->record->exhaust.y, e->record->exhaust.z};
    const kt_op3 exhaust = kt_code_numbers(e->tree, e->name, "exhaust", "end's axes, m/s", u);
    const kt_op mass = kt_curve_rests(&e->record->curve[0])
                           ? constant(e, 0.0)
                           : kt_code_curve(e->tree, &e->record->curve[0], NULL, NULL, NULL);
    e->force[0] = kt_op33_apply(g, &e->end[0].axes, kt_op3_scale(g, kt_code_rate_of_time(g, mass), exhaust));
}

/* At one end, three formulas are the force and three the moment. Between two ends, the formula is the force that pushes
 * the ends apart. */
static void formulas_at_ends(code_effect *e) {
    kt_graph *g = graph_of(e);
    if (e->record->ends == 1) {
        kt_op3 force, moment;
        for (int k = 0; k < 3; k++) {
            force.x[k] = kt_code_formula_value(e, k);
            moment.x[k] = kt_code_formula_value(e, 3 + k);
        }
        e->force[0] = vector_at_end(e, force);
        e->moment[0] = vector_at_end(e, moment);
        return;
    }
    const code_line line = kt_code_line_of(e);
    const kt_op zero = constant(e, 0.0), pull = kt_code_formula_value(e, 0);
    const kt_op ratio = kt_op_choose(g, line.length, kt_op_divide(g, pull, line.length), zero);
    pull_ends(e, kt_op3_scale(g, kt_op_negate(g, ratio), line.d));
}

void kt_code_wrench(code_effect *e) {
    switch (e->record->type) {
    case KT_EFFECT_SPRING:
        spring_between(e);
        break;
    case KT_EFFECT_ATTRACTION:
        attraction_between(e);
        break;
    case KT_EFFECT_DRAG:
        drag_at_end(e);
        break;
    case KT_EFFECT_CONTACT:
        contact_between(e);
        break;
    case KT_EFFECT_BUSHING:
        bushing_between(e);
        break;
    case KT_EFFECT_FORCE:
        e->force[0] = curves_at_end(e, "N");
        break;
    case KT_EFFECT_TORQUE:
        e->moment[0] = curves_at_end(e, "N m");
        break;
    case KT_EFFECT_THRUST:
        thrust_at_end(e);
        break;
    default: /* KT_EFFECT_EXPRESSION */
        formulas_at_ends(e);
        break;
    }
}
