/* Mechanisms that rest until something begins late, is short, or happens again and again. Examples are ramps, tables,
 * pulses, and contacts and stops that are reached after a rest. Adaptive steps grow while nothing moves, and must not
 * step over any of these.
 *
 * Each scene has one degree of freedom. This file writes down its equation of motion, x'' = a(t, x, x'), with its own
 * functions of time. The oracle is Kutta's method with small fixed steps that end at the corners.
 *
 * The tests run some of the scenes. KT_SAMPLE=300 runs 300 scenes.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "describe.h"

#include "kinetree/kinetree.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- functions of time ------------------------------------------------------------------------------------------- */

enum { ROWS = 20, PARTS = 3 };

typedef enum shape { RAMP, LINES, SPLINE } shape;

/* A ramp from `y[0]` to `y[1]` between `t[0]` and `t[1]`, or a table. */
typedef struct course {
    shape shape;
    int count;
    double t[ROWS], y[ROWS], m[ROWS]; /* m: second derivatives of the natural spline */
    double rows[2 * ROWS];            /* for the library, */
    char text[ROWS * 96];             /* as a table or as a formula */
} course;

/* Natural spline, by Gauss-Seidel iteration of its diagonally dominant equations. */
static void bend(course *c) {
    memset(c->m, 0, sizeof c->m);
    for (int sweep = 0; sweep < 200; sweep++)
        for (int k = 1; k + 1 < c->count; k++) {
            const double h = c->t[k] - c->t[k - 1], g = c->t[k + 1] - c->t[k];
            const double side = 6.0 * ((c->y[k + 1] - c->y[k]) / g - (c->y[k] - c->y[k - 1]) / h);
            c->m[k] = (side - h * c->m[k - 1] - g * c->m[k + 1]) / (2.0 * (h + g));
        }
}

/* Value and two derivatives at t, of the piece that `inside` lies in. */
static void course_at(const course *c, double t, double inside, double out[3]) {
    out[1] = out[2] = 0.0;
    if (inside < c->t[0] || inside > c->t[c->count - 1]) {
        out[0] = c->y[inside < c->t[0] ? 0 : c->count - 1];
        return;
    }
    int k = 0;
    while (inside > c->t[k + 1])
        k++;
    const double h = c->t[k + 1] - c->t[k], s = (t - c->t[k]) / h, rise = c->y[k + 1] - c->y[k];
    if (c->shape == RAMP) {
        out[0] = c->y[0] + rise * s * s * (3.0 - 2.0 * s);
        out[1] = 6.0 * rise * s * (1.0 - s) / h;
        out[2] = 6.0 * rise * (1.0 - 2.0 * s) / (h * h);
        return;
    }
    const double p = 1.0 - s, m0 = c->m[k], m1 = c->m[k + 1];
    out[0] = p * c->y[k] + s * c->y[k + 1] + h * h / 6.0 * ((p * p * p - p) * m0 + (s * s * s - s) * m1);
    out[1] = rise / h + h / 6.0 * ((3.0 * s * s - 1.0) * m1 - (3.0 * p * p - 1.0) * m0);
    out[2] = p * m0 + s * m1;
}

/* The same as a formula, whose corners are found: a clamped cubic, or straight lines by their changes of slope. */
static kt_function formula_of(course *c) {
    double slope = 0.0;
    int used = snprintf(c->text, sizeof c->text, "%.17g", c->y[0]);
    for (int k = 0; c->shape == LINES && k < c->count; k++) {
        const double next = k + 1 < c->count ? (c->y[k + 1] - c->y[k]) / (c->t[k + 1] - c->t[k]) : 0.0;
        used += snprintf(c->text + used, sizeof c->text - (size_t)used, " + (%.17g)*max(0, t - %.17g)", next - slope,
                         c->t[k]);
        slope = next;
    }
    if (c->shape == RAMP)
        snprintf(c->text + used, sizeof c->text - (size_t)used,
                 " + (%.17g)*clamp((t - %.17g)/%.17g, 0, 1)^2*(3 - 2*clamp((t - %.17g)/%.17g, 0, 1))",
                 c->y[1] - c->y[0], c->t[0], c->t[1] - c->t[0], c->t[0], c->t[1] - c->t[0]);
    return kt_function_expression(c->text);
}

/* Every other one is a formula. */
static kt_function function_of(course *c) {
    if (c->shape != SPLINE && (long)(1e6 * c->t[1]) % 2 == 0)
        return formula_of(c);
    if (c->shape == RAMP)
        return kt_function_ramp(c->y[0], c->y[1], c->t[0], c->t[1]);
    for (int k = 0; k < c->count; k++) {
        c->rows[2 * k] = c->t[k];
        c->rows[2 * k + 1] = c->y[k];
    }
    return kt_function_table(c->rows, 2 * c->count,
                             c->shape == LINES ? KT_INTERPOLATION_LINEAR : KT_INTERPOLATION_CUBIC);
}

static course make_ramp(double from, double to, double start, double end) {
    return (course){.shape = RAMP, .count = 2, .t = {start, end}, .y = {from, to}};
}

static void add_row(course *c, double t, double y) {
    c->t[c->count] = t;
    c->y[c->count++] = y;
}

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

typedef enum scene_kind { PUSHED, CRANE, SERVO, WALL, STOP, KICKED, KINDS } scene_kind;
static const char *const kind_names[] = {"pushed", "crane", "servo", "wall", "stop", "kicked"};

typedef struct scene {
    scene_kind kind;
    double mass, stiffness, damping, duration;
    double wall, hardness, loss; /* a wall or a stop: where, its stiffness and dissipation or damping */
    double turn;                 /* of the crank that kicks, rad/s */
    int parts;
    course part[PARTS];
    /* For the library. */
    kt_body bodies[2];
    kt_marker markers[2];
    kt_loop loop;
    kt_effect effects[PARTS + 3];
    double polynomial[2];
    kt_description description;
} scene;

static double log_uniform(kt_random *r, double low, double high) {
    return exp(kt_random_uniform(r, log(low), log(high)));
}

/* Up to three pulses of a force, each a triangle, a bell or a trapezoid with ramps, from 3 ms to 10 s long. */
static void add_pulses(scene *s, kt_random *r, double size) {
    const double start = log_uniform(r, 0.3, 60.0), length = log_uniform(r, 3e-3, 10.0);
    const double force = (kt_random_int(r, 0, 1) ? size : -size) * fmin(100.0, fmax(1.0, 1.0 / length));
    const int choice = kt_random_int(r, 0, 2);
    if (choice == 0) {
        s->part[0] = make_ramp(0.0, force, start, start + 0.3 * length);
        s->part[1] = make_ramp(0.0, -force, start + 0.6 * length, start + length);
        s->parts = 2;
    } else {
        course *c = &s->part[0];
        *c = (course){.shape = choice == 1 ? LINES : SPLINE};
        double t = start;
        const int pulses = kt_random_int(r, 1, 3);
        for (int k = 0; k < pulses; k++) {
            add_row(c, t, 0.0);
            add_row(c, t + 0.5 * length, force);
            add_row(c, t + length, 0.0);
            t += length + log_uniform(r, 0.5, 5.0) * fmax(1.0, length);
        }
        if (c->shape == SPLINE) /* which would wave over the rests between pulses */
            c->count = 3;
        bend(c);
        if (c->shape == LINES)
            memset(c->m, 0, sizeof c->m);
        s->parts = 1;
    }
    s->duration = start + length + kt_random_uniform(r, 1.0, 20.0);
}

/* A motion from 0 that rests before and after. */
static void add_motion(scene *s, kt_random *r, double size) {
    const double start = log_uniform(r, 0.3, 60.0), length = log_uniform(r, 0.1, 10.0);
    s->part[0] = make_ramp(0.0, size * fmin(1.0, length), start, start + length);
    s->parts = 1;
    s->duration = start + length + kt_random_uniform(r, 1.0, 20.0);
}

static void make_scene(scene *s, kt_random *r, scene_kind kind) {
    *s = (scene){.kind = kind};
    s->mass = log_uniform(r, 0.3, 30.0);
    s->stiffness = kt_random_int(r, 0, 1) ? s->mass * log_uniform(r, 0.1, 20.0) : 0.0;
    s->damping = s->mass * log_uniform(r, 0.01, 1.0);
    s->wall = kt_random_uniform(r, 1e-3, 0.02);
    s->hardness = s->mass * log_uniform(r, 1e3, 1e5);
    s->loss = kt_random_uniform(r, 0.0, 0.5);
    switch (kind) {
    case PUSHED:
    case WALL:
    case STOP:
        add_pulses(s, r, s->mass);
        if (kind != PUSHED)
            s->stiffness = s->mass * log_uniform(r, 0.1, 20.0);
        break;
    case CRANE:
        s->stiffness = kt_random_uniform(r, 1.0, 10.0); /* the rope's length */
        add_motion(s, r, 4.0);
        break;
    case SERVO:
        s->stiffness = s->mass * log_uniform(r, 1.0, 400.0);
        s->damping = s->mass * log_uniform(r, 0.1, 10.0);
        add_motion(s, r, 1.0);
        break;
    default:
        s->stiffness = s->mass * log_uniform(r, 0.1, 2.0);
        s->turn = log_uniform(r, 0.1, 2.0);
        s->duration = kt_random_uniform(r, 20.0, 60.0);
        s->parts = 0;
        break;
    }
}

/* ---- the oracle -------------------------------------------------------------------------------------------------- */

static double side_force(const scene *s, double depth, double rate) {
    if (depth <= 0.0)
        return 0.0;
    if (s->kind == STOP) { /* k x + c w k x / (k x + c |w|) */
        const double e = s->hardness * depth, d = s->loss * s->mass * rate;
        return e + d * e / (e + fabs(d));
    }
    return s->hardness * pow(depth, 1.5) * fmax(0.0, 1.0 + 1.5 * s->loss * rate);
}

static double acceleration(const scene *s, double t, double inside, double x, double v) {
    double f[3] = {0.0, 0.0, 0.0};
    for (int k = 0; k < s->parts; k++) {
        double one[3];
        course_at(&s->part[k], t, inside, one);
        for (int i = 0; i < 3; i++)
            f[i] += one[i];
    }
    switch (s->kind) {
    case CRANE: /* the load hangs on a rope of length L from a trolley that moves along f */
        return (f[2] * cos(x) - 9.81 * sin(x)) / s->stiffness;
    case SERVO:
        return (s->stiffness * (f[0] - x) + s->damping * (f[1] - v)) / s->mass;
    case KICKED: { /* the tip of the crank against the slider's face, from inside */
        const double angle = 1.5707963267948966 + s->turn * t, rest = 1.0 - s->wall;
        const double push = side_force(s, cos(angle) - x, -sin(angle) * s->turn - v);
        return (push - s->stiffness * (x - rest) - s->damping * v) / s->mass;
    }
    default:
        return (f[0] - s->stiffness * x - s->damping * v - (s->kind == PUSHED ? 0.0 : side_force(s, x - s->wall, v))) /
               s->mass;
    }
}

/* Whether the box, or the crank's tip, is nearer to the other than it may move in the time h, or in contact. */
static bool is_in_reach(const scene *s, double t, double x, double v, double h) {
    if (s->kind == KICKED)
        return cos(1.5707963267948966 + s->turn * t) - x > -h * (s->turn + fabs(v));
    return x - s->wall > -2.0 * h * fabs(v);
}

static void advance(const scene *s, double a, double b, double most, double *x, double *v, double size[2]) {
    const double steps = ceil((b - a) / fmin(most, (b - a) / 40.0)), h = (b - a) / steps, inside = 0.5 * (a + b);
    for (double k = 0.0; k < steps; k += 1.0) {
        const double t = a + k * h;
        const double a1 = acceleration(s, t, inside, *x, *v), v2 = *v + 0.5 * h * a1;
        const double a2 = acceleration(s, t + 0.5 * h, inside, *x + 0.5 * h * *v, v2), v3 = *v + 0.5 * h * a2;
        const double a3 = acceleration(s, t + 0.5 * h, inside, *x + 0.5 * h * v2, v3), v4 = *v + h * a3;
        const double a4 = acceleration(s, t + h, inside, *x + h * v3, v4);
        *x += h / 6.0 * (*v + 2.0 * v2 + 2.0 * v3 + v4);
        *v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        size[0] = fmax(size[0], fabs(*x));
        size[1] = fmax(size[1], fabs(*v));
    }
}

/* State at the end, and the largest position and velocity on the way. */
static void solve(const scene *s, double state[2], double size[2]) {
    const bool hits = s->kind == WALL || s->kind == STOP || s->kind == KICKED;
    double t = 0.0;
    state[0] = s->kind == KICKED ? 1.0 - s->wall : 0.0;
    state[1] = size[0] = size[1] = 0.0;
    while (t < s->duration) {
        double next = s->duration;
        for (int k = 0; k < s->parts; k++)
            for (int row = 0; row < s->part[k].count; row++)
                if (s->part[k].t[row] > t && s->part[k].t[row] < next)
                    next = s->part[k].t[row];
        for (double from = t; t < next; from = t) { /* forces of contacts change within short depths */
            t = hits ? fmin(from + 2e-3, next) : next;
            const bool near = hits && is_in_reach(s, from, state[0], state[1], 4e-3);
            advance(s, from, t, near ? 1e-5 : hits ? 2e-4 : 1e-3, &state[0], &state[1], size);
        }
    }
}

/* ---- the library ------------------------------------------------------------------------------------------------- */

static kt_effect *add_effect(scene *s, kt_effect_type type, const char *joint) {
    kt_effect *effect = &s->effects[s->description.effect_count++];
    *effect = kt_effect_of(type, joint);
    return effect;
}

static void add_spring(scene *s, double rest) {
    kt_effect *spring = add_effect(s, KT_EFFECT_JOINT_SPRING, "box");
    spring->stiffness = s->stiffness;
    spring->damping = s->damping;
    spring->rest = kt_function_constant(rest);
}

static void add_contact(scene *s, const char *point, const char *plane, double at) {
    kt_effect *contact = add_effect(s, KT_EFFECT_CONTACT, NULL);
    contact->between[0].body = point;
    contact->between[1].body = plane;
    contact->between[0].at = kt_vec3_make(strcmp(point, "crank") == 0 ? 1.0 : 0.0, 0.0, 0.0);
    contact->between[1].at = kt_vec3_make(at, 0.0, 0.0);
    contact->axis = kt_vec3_make(-1.0, 0.0, 0.0);
    contact->stiffness = s->hardness;
    contact->dissipation = s->loss;
}

static kt_body *add_body(scene *s, const char *name, kt_joint_type type, kt_vec3 axis) {
    kt_body *body = &s->bodies[s->description.body_count++];
    *body = kt_body_of(name, NULL, type, s->mass);
    body->joint.axis = axis;
    return body;
}

static void add_drive(scene *s, const char *joint, kt_function function) {
    s->loop = kt_loop_of("drive", KT_LOOP_MOTION);
    s->loop.joint = joint;
    s->loop.function = function;
    s->description.loops = &s->loop;
    s->description.loop_count = 1;
}

static void describe(scene *s) {
    const kt_vec3 x = {1.0, 0.0, 0.0}, y = {0.0, 1.0, 0.0}, z = {0.0, 0.0, 1.0};
    s->description = kt_description_default();
    s->description.bodies = s->bodies;
    s->description.effects = s->effects;
    if (s->kind == CRANE) {
        (void)add_body(s, "trolley", KT_JOINT_PRISMATIC, x);
        kt_body *load = add_body(s, "load", KT_JOINT_REVOLUTE, y);
        load->parent = "trolley";
        load->com = kt_vec3_make(0.0, 0.0, -s->stiffness);
        s->description.gravity = kt_vec3_make(0.0, 0.0, -9.81);
        add_drive(s, "trolley", function_of(&s->part[0]));
        return;
    }
    if (s->kind == KICKED) {
        kt_body *crank = add_body(s, "crank", KT_JOINT_REVOLUTE, z);
        crank->joint.position[0] = 1.5707963267948966;
        crank->joint.velocity[0] = s->turn;
        crank->inertia = (kt_sym3){.xx = 1.0, .yy = 1.0, .zz = 1.0};
        kt_body *box = add_body(s, "box", KT_JOINT_PRISMATIC, x);
        box->joint.position[0] = 1.0 - s->wall;
        s->polynomial[0] = 1.5707963267948966;
        s->polynomial[1] = s->turn;
        add_drive(s, "crank", kt_function_polynomial(s->polynomial, 2));
        add_spring(s, 1.0 - s->wall);
        add_contact(s, "crank", "box", 0.0);
        return;
    }
    (void)add_body(s, "box", KT_JOINT_PRISMATIC, x);
    if (s->kind == SERVO) {
        kt_effect *servo = add_effect(s, KT_EFFECT_SERVO, "box");
        servo->target = function_of(&s->part[0]);
        servo->stiffness = s->stiffness;
        servo->damping = s->damping;
        return;
    }
    add_spring(s, 0.0);
    for (int k = 0; k < s->parts; k++)
        add_effect(s, KT_EFFECT_MOTOR, "box")->torque = function_of(&s->part[k]);
    if (s->kind == WALL)
        add_contact(s, "box", NULL, s->wall);
    if (s->kind == STOP) {
        kt_effect *stop = add_effect(s, KT_EFFECT_JOINT_LIMIT, "box");
        stop->upper = s->wall;
        stop->stiffness = s->hardness;
        stop->damping = s->loss * s->mass;
    }
}

/* Runs a scene to its end; false after a failed check. */
static bool run(const kt_model *model, const char *method, double duration, const char *name, double state[2]) {
    kt_run wish = kt_run_default();
    kt_simulation *simulation = NULL;
    kt_error error = {0};
    wish.integrator = method;
    wish.duration = duration;
    kt_status status = kt_simulation_create(model, &wish, NULL, &simulation, &error);
    if (status == KT_OK)
        status = kt_simulation_advance(simulation, duration, &error);
    if (status == KT_OK) {
        const int last = kt_model_nv(model) - 1; /* the box, or the load, is the second body */
        state[0] = kt_simulation_positions(simulation)[last];
        state[1] = kt_simulation_velocities(simulation)[last];
    } else {
        kt_note("%s, %s: %s: %s", name, method, error.where, error.message);
        kt_check_true("runs to its end", false);
    }
    kt_simulation_free(simulation);
    return status == KT_OK;
}

/* A method's error bound, as a share of the largest position and velocity, at the tolerance 1e-9. Measured on all 300
 * scenes. Without impacts: 2e-6 at most, and 7e-5 by rkc2, of second order. After dozens of impacts: 1.7e-3. An event
 * that is stepped over leads to an error of the whole. */
static double bound_of(scene_kind kind, const kt_method *method) {
    const bool hits = kind == WALL || kind == STOP || kind == KICKED;
    return hits ? 2e-3 : method->order == 2 ? 1e-4 : 1e-5;
}

static void check_scene(int index, kt_random *random, kt_worst worst[KINDS]) {
    static scene s;
    char name[64];
    kt_model *model = NULL;
    kt_error error = {0};
    double right[2], size[2], state[2];
    const scene_kind kind = (scene_kind)(index % KINDS);
    make_scene(&s, random, kind);
    describe(&s);
    snprintf(name, sizeof name, "scene %d (%s)", index, kind_names[kind]);
    if (!kt_check_true("compiles", kt_model_compile(&s.description, NULL, &model, &error) == KT_OK)) {
        kt_note("%s: %s: %s", name, error.where, error.message);
        return;
    }
    solve(&s, right, size);
    for (int m = 0; m < kt_method_count(); m++) {
        const kt_method *method = kt_method_at(m);
        if (!kt_method_is_adaptive(method) || !run(model, method->name, s.duration, name, state))
            continue;
        for (int i = 0; i < 2; i++)
            kt_worst_near(&worst[kind], state[i], right[i], bound_of(kind, method) * size[i] + 1e-7, "%s, %s, %s", name,
                          method->name, i == 0 ? "position" : "velocity");
    }
    kt_model_free(model);
}

KT_TEST(nothing_that_begins_after_a_rest_is_stepped_over) {
    const int count = kt_sample(KT_SHORT(1, 3) * KINDS);
    kt_random random = kt_random_of_test();
    kt_worst worst[KINDS];
    for (int k = 0; k < KINDS; k++)
        worst[k] = kt_worst_make(kind_names[k]);
    for (int index = 0; index < count; index++)
        check_scene(index, &random, worst);
    for (int k = 0; k < KINDS; k++)
        kt_check_worst(&worst[k]);
}
