/* Twins of random scenes on hard contacts: the same scene in other units, with all masses times a factor, turned, at a
 * late time, on a floor that moves, or with its bodies and contacts in another order. Scenes have up to five bodies and
 * eight contacts. There are boxes on a floor and on each other, arms, and balls in wedges, with bounces, dry joints and
 * stops.
 *
 * All factors are powers of two, whose products have no rounding. With all masses times such a factor, a twin has the
 * same bits, unless a threshold has an absolute scale. So has a twin in another unit of time, with fixed steps. Numbers
 * that underflow are the only exception. Other twins differ by rounding, which impacts, and feet that share a load, may
 * magnify without bound. So the bound of each scene is measured: its motion is repeated from starts that differ by some
 * roundings, of velocities or of the late time. A twin may differ by LIKELY times as much. If such starts move apart by
 * more than `decided`, rounding decides the motion, and the scene proves nothing.
 *
 * One tolerance for lengths and angles has no unit, so that twins in other units would have other steps. Here each
 * coordinate has its own tolerance, in the units of the twin. Projections use the metric of the masses, because the
 * identity would add metres to radians. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"
#include "simulation/simulation.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fixture.h"
#include "motion/simulation/scenes.h"
#include "random.h"

enum {
    DRAWN = 5,
    BODIES = DRAWN + 1,
    EFFECTS = 24,
    NAMES = BODIES + EFFECTS,
    SAMPLES = 4,
    NQ = 7 * BODIES,
    NV = 6 * BODIES
};
static const double g = 9.81, step = 1e-3, length_of_run = 0.2;

/* The factor by which twins may exceed the effect of roundings, how many some tests have, the largest such effect. */
enum { LIKELY = 100, PAIR = 2 };
static const double decided = 1e-4, tolerance = 1e-10;

typedef struct scene {
    kt_body body[BODIES];
    kt_effect effect[EFFECTS];
    char name[NAMES][8];
    kt_loop drive; /* of the floor, the last body, if `driven` */
    bool driven;
    double course[2]; /* of the drive */
    int bodies, effects;
    kt_vec3 gravity;
} scene;

/* The changes of a twin. */
typedef struct twin {
    const char *name;
    double mass, length, time; /* factors of the units */
    double start;              /* s, of the original */
    bool turned, reordered;
    double shift; /* of the velocities, as a part of these */
    double boost; /* m/s, the velocity of the frame along x, */
    double place; /* m, and its place at the start */
} twin;

static const twin original = {"original", 1.0, 1.0, 1.0, 0.0, false, false, 0.0, 0.0, 0.0};

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

static kt_body *add_body(scene *s, kt_joint_type type, const char *parent, kt_random *random) {
    kt_body *body = &s->body[s->bodies];
    char *name = s->name[s->bodies];
    (void)snprintf(name, sizeof s->name[0], "b%d", s->bodies++);
    *body = kt_body_of(name, parent, type, kt_random_uniform(random, 0.3, 3.0));
    const double size = body->mass * kt_random_uniform(random, 0.01, 0.03);
    body->inertia = (kt_sym3){.xx = size, .yy = 1.2 * size, .zz = 1.5 * size};
    body->joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
    return body;
}

static kt_effect *add_effect(scene *s, kt_effect_type type) {
    kt_effect *effect = &s->effect[s->effects];
    char *name = s->name[BODIES + s->effects];
    (void)snprintf(name, sizeof s->name[0], "e%d", s->effects++);
    *effect = kt_effect_of(type, NULL);
    effect->name = name;
    effect->restitution = 0.0;
    return effect;
}

static kt_effect *add_contact(scene *s, const kt_body *body, kt_vec3 at, double friction) {
    kt_effect *contact = add_effect(s, KT_EFFECT_CONTACT);
    contact->between[0].body = body->name;
    contact->between[0].at = at;
    contact->friction = friction;
    return contact;
}

static void add_dry(scene *s, const kt_body *body, kt_random *random) {
    kt_effect *dry = add_effect(s, KT_EFFECT_JOINT_FRICTION);
    dry->restitution = HUGE_VAL;
    dry->joint = body->name;
    dry->coulomb = kt_random_uniform(random, 0.05, 1.0);
    dry->breakaway = dry->coulomb * kt_random_uniform(random, 1.0, 1.3);
    dry->stick = true;
}

/* A box on feet, on the floor or on an earlier box (`below`), with which it moves at first. */
static void add_box(scene *s, kt_body *below, double drop, int feet, kt_random *random) {
    kt_body *box = add_body(s, KT_JOINT_FREE, NULL, random);
    const double x = 3.0 * s->bodies;
    box->joint.position[0] = below != NULL ? below->joint.position[0] : x;
    box->joint.position[2] = drop + 0.1 + (below != NULL ? below->joint.position[2] + 0.1 : 0.0);
    box->joint.position[3] = 1.0;
    for (int k = 0; k < 3; k++)
        box->joint.velocity[k] = k == 2 ? 0.0 : kt_random_uniform(random, -0.6, 0.6);
    box->joint.velocity[5] = kt_random_uniform(random, -1.0, 1.0);
    if (below != NULL)
        memcpy(box->joint.velocity, below->joint.velocity, sizeof box->joint.velocity);
    const bool same = kt_random_int(random, 0, 1) == 0;
    const double mu = kt_random_uniform(random, 0.0, 0.8);
    for (int k = 0; k < feet; k++) {
        const double angle = 6.28 * k / feet + kt_random_uniform(random, 0.0, 0.5);
        kt_effect *foot = add_contact(s, box, kt_vec3_make(0.2 * cos(angle), 0.25 * sin(angle), -0.1),
                                      same ? mu : kt_random_uniform(random, 0.0, 0.8));
        foot->restitution = same && kt_random_int(random, 0, 2) == 0 ? 0.3 : 0.0;
        if (below != NULL) {
            foot->between[1].body = below->name;
            foot->between[1].at = kt_vec3_make(0.0, 0.0, 0.1);
        }
    }
}

/* An arm of links, each with dry friction or a stop in its joint, whose last link leans on the floor. */
static void add_arm(scene *s, kt_random *random) {
    const int room = DRAWN - s->bodies, links = kt_random_int(random, 1, room < 3 ? room : 3);
    const char *parent = NULL;
    double angle = 0.0, height = kt_random_uniform(random, 0.0, 0.05);
    for (int i = 0; i < links; i++) {
        kt_body *link = add_body(s, KT_JOINT_REVOLUTE, parent, random);
        link->com = kt_vec3_make(0.15, 0.0, 0.0);
        link->joint.at = kt_vec3_make(parent == NULL ? 3.0 * s->bodies : 0.3, 0.0, 0.0);
        link->joint.position[0] = kt_random_uniform(random, 0.0, 0.3);
        link->joint.velocity[0] = kt_random_uniform(random, -1.0, 1.0);
        if (kt_random_int(random, 0, 1) == 0)
            add_dry(s, link, random);
        if (kt_random_int(random, 0, 1) == 0) {
            kt_effect *stop = add_effect(s, KT_EFFECT_JOINT_LIMIT);
            stop->joint = link->name;
            stop->lower = -0.3;
            stop->upper = kt_random_uniform(random, 0.4, 0.8);
            stop->restitution = kt_random_int(random, 0, 1) == 0 ? 0.0 : 0.4;
        }
        parent = link->name;
        angle += link->joint.position[0];
        height += 0.3 * sin(angle);
    }
    s->body[s->bodies - links].joint.at.z = height;
    (void)add_contact(s, &s->body[s->bodies - 1], kt_vec3_make(0.3, 0.0, 0.0), kt_random_uniform(random, 0.0, 0.7));
}

/* A ball in a wedge of two planes. */
static void add_wedge(scene *s, kt_random *random) {
    kt_body *ball = add_body(s, KT_JOINT_FREE, NULL, random);
    const double x = 3.0 * s->bodies;
    ball->joint.position[0] = x + kt_random_uniform(random, -0.02, 0.02);
    ball->joint.position[2] = 0.2;
    ball->joint.position[3] = 1.0;
    ball->joint.velocity[4] = kt_random_uniform(random, -5.0, 5.0);
    for (int k = 0; k < 2; k++) {
        kt_effect *plane = add_contact(s, ball, kt_vec3_make(0.0, 0.0, 0.0), kt_random_uniform(random, 0.0, 0.8));
        plane->between[1].at = kt_vec3_make(x, 0.0, 0.0);
        plane->radius = 0.1;
        plane->axis = kt_vec3_make(k == 0 ? 0.6 : -0.5, 0.0, 0.8);
        plane->restitution = kt_random_int(random, 0, 1) == 0 ? 0.0 : 0.3;
    }
}

/* Draws a scene of up to five bodies and eight contacts. */
static void draw_scene(scene *s, kt_random *random) {
    int contacts = 0;
    memset(s, 0, sizeof *s);
    s->gravity = kt_vec3_make(kt_random_uniform(random, -3.0, 3.0), kt_random_uniform(random, -3.0, 3.0), -g);
    do {
        const double drop = kt_random_int(random, 0, 1) == 0 ? 0.0 : kt_random_uniform(random, 0.0, 0.02);
        kt_body *last = s->bodies > 0 ? &s->body[s->bodies - 1] : NULL;
        const int kind = kt_random_int(random, 0, 3), room = 8 - contacts;
        if (kind == 2)
            add_arm(s, random);
        else if (kind == 3 && room > 1)
            add_wedge(s, random);
        else
            add_box(s, last != NULL && last->joint.type == KT_JOINT_FREE && kind == 1 ? last : NULL,
                    kind == 1 ? 0.0 : drop, kt_random_int(random, 1, room < 4 ? room : 4), random);
        contacts = 0;
        for (int i = 0; i < s->effects; i++)
            contacts += s->effect[i].type == KT_EFFECT_CONTACT;
    } while (s->bodies < DRAWN && contacts < 8 && kt_random_int(random, 0, 2) > 0);
}

/* Makes the ground of a scene a driven body, which is at rest and carries all that stands on it. */
static void put_on_floor(scene *s) {
    const char *name = s->name[s->bodies];
    for (int i = 0; i < s->bodies; i++)
        if (s->body[i].joint.type != KT_JOINT_FREE && s->body[i].parent == NULL)
            s->body[i].parent = name;
    for (int i = 0; i < s->effects; i++)
        if (s->effect[i].type == KT_EFFECT_CONTACT && s->effect[i].between[1].body == NULL)
            s->effect[i].between[1].body = name;
    (void)snprintf(s->name[s->bodies], sizeof s->name[0], "b%d", s->bodies);
    s->body[s->bodies] = kt_body_of(name, NULL, KT_JOINT_PRISMATIC, 1.0);
    s->body[s->bodies++].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    s->drive = kt_loop_of("drive", KT_LOOP_MOTION);
    s->drive.joint = name;
    s->drive.function = kt_function_polynomial(s->course, 2);
    s->driven = true;
}

static kt_vec3 times(double factor, kt_vec3 x) { return kt_vec3_scale(factor, x); }

static void scale_body(kt_body *b, const twin *t) {
    const double M = t->mass, L = t->length, T = t->time;
    const bool is_free = b->joint.type == KT_JOINT_FREE;
    b->mass *= M;
    b->com = times(L, b->com);
    b->inertia =
        (kt_sym3){.xx = b->inertia.xx * M * L * L, .yy = b->inertia.yy * M * L * L, .zz = b->inertia.zz * M * L * L};
    b->joint.at = times(L, b->joint.at);
    for (int k = 0; k < 3 && is_free; k++)
        b->joint.position[k] *= L;
    for (int k = 0; k < KT_JOINT_NV_MAX; k++)
        b->joint.velocity[k] *= (is_free && k < 3 ? L : 1.0) / T;
}

static void scale_effect(kt_effect *e, const twin *t) {
    const double M = t->mass, L = t->length, T = t->time;
    const bool is_contact = e->type == KT_EFFECT_CONTACT;
    for (int k = 0; k < 2; k++)
        e->between[k].at = times(L, e->between[k].at);
    e->radius *= L;
    e->rest_velocity *= (is_contact ? L : 1.0) / T;
    e->stribeck /= T;
    e->coulomb *= M * L * L / (T * T);
    e->breakaway *= M * L * L / (T * T);
}

static void turn_scene(scene *s) {
    kt_mat3 R;
    kt_error error = {0};
    const kt_rotation by = kt_rotation_axis_angle(kt_vec3_make(-0.3, 0.7, 0.4), 2.1);
    kt_need_fine("rotation", kt_rotation_evaluate(&by, &R, &error), &error);
    s->gravity = kt_mat3_apply(R, s->gravity);
    for (int i = 0; i < s->bodies; i++)
        if (s->body[i].parent == NULL) {
            s->body[i].joint.rotation = by;
            s->body[i].joint.at = kt_mat3_apply(R, s->body[i].joint.at);
        }
    for (int i = 0; i < s->effects; i++)
        if (s->effect[i].type == KT_EFFECT_CONTACT && s->effect[i].between[1].body == NULL) {
            s->effect[i].between[1].rotation = by;
            s->effect[i].between[1].at = kt_mat3_apply(R, s->effect[i].between[1].at);
        }
}

static void reverse(void *list, int count, size_t size) {
    char *first = list, kept[4096];
    for (int i = 0, j = count - 1; i < j; i++, j--) {
        memcpy(kept, first + (size_t)i * size, size);
        memcpy(first + (size_t)i * size, first + (size_t)j * size, size);
        memcpy(first + (size_t)j * size, kept, size);
    }
}

/* Whether the first coordinate of a body is a place along x, relative to the world. */
static bool moves_with_frame(const scene *s, const kt_body *body) {
    return body->joint.type == KT_JOINT_FREE || (s->driven && body->joint.type == KT_JOINT_PRISMATIC);
}

static void move_frame(scene *s, double place, double speed) {
    s->course[0] = place;
    s->course[1] = speed;
    for (int i = 0; i < s->bodies; i++) {
        s->body[i].joint.position[0] += moves_with_frame(s, &s->body[i]) ? place : 0.0;
        s->body[i].joint.velocity[0] += moves_with_frame(s, &s->body[i]) ? speed : 0.0;
    }
    s->drive.function = kt_function_polynomial(s->course, 2);
}

static void make_twin(const scene *from, const twin *t, scene *to) {
    _Static_assert(sizeof(kt_body) <= 4096 && sizeof(kt_effect) <= 4096, "of reverse");
    *to = *from;
    for (int i = 0; i < to->bodies; i++) {
        scale_body(&to->body[i], t);
        to->body[i].name = to->name[i];
    }
    for (int i = 0; i < to->effects; i++)
        scale_effect(&to->effect[i], t);
    to->gravity = times(t->length / (t->time * t->time), to->gravity);
    for (int i = 0; i < to->bodies; i++)
        for (int k = 0; k < KT_JOINT_NV_MAX; k++)
            to->body[i].joint.velocity[k] *= 1.0 + t->shift;
    if (to->driven)
        move_frame(to, t->place, t->boost);
    if (t->turned)
        turn_scene(to);
    if (t->reordered) {
        reverse(to->effect, to->effects, sizeof *to->effect);
        reverse(to->body, to->bodies, sizeof *to->body);
    }
}

typedef struct motion {
    kt_status status;
    kt_error error;
    double q[SAMPLES][NQ], v[SAMPLES][NV]; /* in the order and in the units of the original */
    int nq, nv, samples;
    kt_contact_counts counts;
} motion;

/* Gives each coordinate the tolerance of the original, in the units of the twin. */
static void set_tolerances(const scene *s, const twin *t, const kt_model *model, kt_simulation *simulation) {
    static double each[NQ + NV];
    const int nq = kt_model_nq(model);
    for (int i = 0; i < s->bodies; i++) {
        const kt_coordinates at = kt_body_coordinates(model, kt_body_find(model, s->body[i].name));
        for (int k = 0; k < at.nq; k++)
            each[at.q + k] = tolerance * (at.nq == 7 && k < 3 ? t->length : 1.0);
        for (int k = 0; k < at.nv; k++)
            each[nq + at.v + k] = tolerance * (at.nq == 7 && k < 3 ? t->length : 1.0) / t->time;
    }
    simulation->integrator->options.absolute_tolerances = each;
}

static kt_simulation *start(const scene *s, const twin *t, const char *method, bool fixed, kt_model **model) {
    kt_description d = kt_description_of(s->body, s->bodies, &s->drive, s->driven, s->effect, s->effects);
    kt_model_options metric = kt_model_options_default();
    metric.metric = KT_METRIC_MASS;
    d.gravity = s->gravity;
    *model = kt_test_model(&d, &metric);
    const bool steps = strcmp(method, "steps") == 0;
    kt_run run = kt_run_default();
    run.integrator = steps ? NULL : method;
    run.duration = 10.0 * t->time + t->start * t->time;
    run.step = fixed ? step * t->time : 0.0;
    run.relative = s->driven ? 0.0 : tolerance; /* of speeds, which a frame changes */
    run.absolute = tolerance;                   /* set_tolerances */
    kt_simulation_options options = kt_simulation_options_default();
    options.max_steps = 5000;
    options.contact = steps ? KT_CONTACT_STEPS : options.contact;
    kt_simulation *simulation = kt_test_simulation(*model, &run, &options);
    if (!fixed)
        set_tolerances(s, t, *model, simulation);
    return simulation;
}

static void sample_motion(const kt_model *model, const kt_simulation *simulation, const scene *s, const twin *t,
                          motion *m) {
    const double *q = kt_simulation_positions(simulation), *v = kt_simulation_velocities(simulation);
    double *to_q = m->q[m->samples], *to_v = m->v[m->samples];
    m->nq = m->nv = 0;
    for (int i = 0; i < s->bodies; i++) {
        char name[16];
        (void)snprintf(name, sizeof name, "b%d", i);
        const kt_coordinates at = kt_body_coordinates(model, kt_body_find(model, name));
        const bool is_free = at.nq == 7;
        const bool moves = moves_with_frame(s, &s->body[i]); /* not reordered */
        const double boost = moves ? t->boost : 0.0,
                     place = moves ? t->place + boost * kt_simulation_time(simulation) : 0.0;
        for (int k = 0; k < at.nq; k++)
            to_q[m->nq++] = q[at.q + k] / (is_free && k < 3 ? t->length : 1.0) - (k == 0 ? place : 0.0);
        for (int k = 0; k < at.nv; k++)
            to_v[m->nv++] = v[at.v + k] * t->time / (is_free && k < 3 ? t->length : 1.0) - (k == 0 ? boost : 0.0);
    }
    m->samples++;
}

static void move(const scene *from, const twin *t, const char *method, bool fixed, motion *m) {
    static scene s;
    kt_model *model;
    make_twin(from, t, &s);
    memset(m, 0, sizeof *m);
    kt_simulation *simulation = start(&s, t, method, fixed, &model);
    const double t0 = t->start * t->time;
    if (t0 > 0.0 || !fixed) { /* begins again, with the tolerances of each coordinate */
        double q[NQ], v[NV];
        memcpy(q, kt_simulation_positions(simulation), (size_t)kt_model_nq(model) * sizeof *q);
        memcpy(v, kt_simulation_velocities(simulation), (size_t)kt_model_nv(model) * sizeof *v);
        m->status = kt_simulation_set_state(simulation, t0, q, v, &m->error);
    }
    for (int k = 1; m->status == KT_OK && k <= SAMPLES; k++) {
        const double end = t0 + length_of_run * t->time * k / SAMPLES;
        m->status = kt_simulation_advance(simulation, end, &m->error);
        sample_motion(model, simulation, &s, t, m);
    }
    m->counts = kt_simulation_contacts(simulation);
}

/* Speeds below 1e-100 units are rest for projections, which leave them as they are (constraint/group.h). The unit of a
 * twin is up to 2^20 times as large. */
static double unless_at_rest(double v) { return fabs(v) < 1e-94 ? 0.0 : v; }

/* The largest difference of two motions, relative to 1 m, 1 rad, 1 m/s and 1 rad/s. */
static double distance(const motion *a, const motion *b) {
    double most = a->samples == b->samples ? 0.0 : HUGE_VAL;
    for (int k = 0; k < a->samples && k < b->samples; k++) {
        for (int i = 0; i < a->nq; i++)
            most = fmax(most, fabs(a->q[k][i] - b->q[k][i]));
        for (int i = 0; i < a->nv; i++)
            most = fmax(most, fabs(unless_at_rest(a->v[k][i]) - unless_at_rest(b->v[k][i])));
    }
    return most;
}

static void print_twin(int n, const scene *s, const twin *t, double apart, double bound, const motion *a,
                       const motion *b) {
    kt_note("scene %d (%d bodies, %d effects), %s: %.3g, bound %.3g; impacts %d %d, sticks %d %d, rested %d %d, jammed "
            "%d %d %s%s",
            n, s->bodies, s->effects, t->name, apart, bound, (int)a->counts.impacts, (int)b->counts.impacts,
            (int)a->counts.sticks, (int)b->counts.sticks, (int)a->counts.rested, (int)b->counts.rested,
            (int)a->counts.jammed, (int)b->counts.jammed, a->status ? a->error.where : "",
            b->status ? b->error.message : "");
}

/* How far motions go apart whose starts differ by some roundings: of velocities, of the time of the twin, and of the
 * places that the frame of the twin reaches. */
static double rounding_of(const scene *s, const twin *of, const char *method, bool fixed, const motion *a) {
    static const double parts[] = {1.0, -1.0, 3.0, -7.0};
    static motion b;
    const double size = fmax(1e-13, 64.0 * DBL_EPSILON * of->start / length_of_run);
    double most = 0.0;
    for (int k = 0; k < 4; k++) {
        twin t = original;
        t.shift = parts[k] * size;
        t.place = k % 2 * of->boost * length_of_run;
        move(s, &t, method, fixed, &b);
        most = fmax(most, a->status == b.status ? distance(a, &b) : HUGE_VAL);
    }
    return most;
}

typedef struct tally {
    int compared, undecided, failed, wrong, several;
} tally;

static void compare_scene(const scene *s, int n, const char *method, bool fixed, bool bits, const twin *twins,
                          int count, tally *to) {
    static motion a, b;
    move(s, &original, method, fixed, &a);
    to->failed += a.status != KT_OK;
    if (a.status != KT_OK)
        kt_note("scene %d: %s: %s", n, a.error.where, a.error.message);
    const double rounding = bits ? 0.0 : rounding_of(s, twins, method, fixed, &a);
    to->undecided += !(rounding <= decided);
    for (int k = 0; rounding <= decided && k < count; k++) {
        const double bound = bits ? DBL_MIN : LIKELY * fmax(rounding, tolerance);
        move(s, &twins[k], method, fixed, &b);
        to->compared++;
        if (a.status == b.status && distance(&a, &b) <= bound)
            continue;
        if (!bits && !twins[k].reordered && a.counts.undecided + b.counts.undecided > 0) { /* several motions exist */
            to->several++;
            continue;
        }
        to->wrong++;
        print_twin(n, s, &twins[k], distance(&a, &b), bound, &a, &b);
    }
}

static void compare(const char *method, bool fixed, bool bits, const twin *twins, int count, int scenes) {
    const char *only = getenv("KT_SCENE"), *from = getenv("KT_FROM");
    kt_random random = kt_random_of_test();
    tally sum = {0};
    for (int n = 0; n < scenes; n++) {
        static scene s;
        draw_scene(&s, &random);
        if (twins->boost != 0.0)
            put_on_floor(&s);
        if ((only == NULL || n == atoi(only)) && (from == NULL || n >= atoi(from)))
            compare_scene(&s, n, method, fixed, bits, twins, count, &sum);
    }
    kt_check_above("twins", sum.compared, 0.0);
    kt_check_below("runs that fail, or take too many steps", sum.failed, fmax(1.0, 0.05 * scenes));
    kt_check_equal_int("twins that move otherwise", sum.wrong, 0);
    kt_check_below("scenes that rounding decides", sum.undecided, 0.25 * scenes);
    kt_note("%d twins move otherwise where the law allows several motions", sum.several);
}
static const twin masses[] = {{"masses times 2^20", 0x1p20, 1.0, 1.0, 0.0, false, false, 0.0, 0.0, 0.0},
                              {"masses times 2^-20", 0x1p-20, 1.0, 1.0, 0.0, false, false, 0.0, 0.0, 0.0}};
static const twin lengths[] = {{"lengths times 2^20", 1.0, 0x1p20, 1.0, 0.0, false, false, 0.0, 0.0, 0.0},
                               {"lengths times 2^-20", 1.0, 0x1p-20, 1.0, 0.0, false, false, 0.0, 0.0, 0.0}};
static const twin clocks[] = {{"times times 2^20", 1.0, 1.0, 0x1p20, 0.0, false, false, 0.0, 0.0, 0.0},
                              {"times times 2^-20", 1.0, 1.0, 0x1p-20, 0.0, false, false, 0.0, 0.0, 0.0}};
static const twin turned[] = {{"turned", 1.0, 1.0, 1.0, 0.0, true, false, 0.0, 0.0, 0.0}};
static const twin reordered[] = {{"in another order", 1.0, 1.0, 1.0, 0.0, false, true, 0.0, 0.0, 0.0}};
static const twin late[] = {{"at 1e4 s", 1.0, 1.0, 1.0, 1e4, false, false, 0.0, 0.0, 0.0}};
static const twin latest[] = {{"at 1e7 s", 1.0, 1.0, 1.0, 1e7, false, false, 0.0, 0.0, 0.0}};
static const twin boosted[] = {{"in a frame that moves at 2 m/s", 1.0, 1.0, 1.0, 0.0, false, false, 0.0, 2.0, 0.0},
                               {"in a frame that moves at -16 m/s", 1.0, 1.0, 1.0, 0.0, false, false, 0.0, -16.0, 0.0}};
static const twin fast[] = {{"in a frame that moves at 1000 m/s", 1.0, 1.0, 1.0, 0.0, false, false, 0.0, 1000.0, 0.0}};

KT_TEST(masses_times_a_factor_leave_all_bits) {
    compare("rk4", true, true, masses, PAIR, kt_sample(KT_SHORT(5, 200)));
    compare("steps", true, true, masses, PAIR, kt_sample(KT_SHORT(20, 200)));
    compare("dopri5", false, true, masses, PAIR, kt_sample(KT_SHORT(5, 200)));
}
KT_TEST(scenes_move_alike_in_all_units) {
    compare("rk4", true, true, clocks, PAIR, kt_sample(KT_SHORT(3, 300)));
    compare("steps", true, true, clocks, PAIR, kt_sample(KT_SHORT(20, 300)));
    compare("dopri5", false, false, clocks, PAIR, kt_sample(KT_SHORT(3, 300)));
    compare("rk4", true, false, lengths, PAIR, kt_sample(KT_SHORT(3, 300)));
    compare("dopri5", false, false, lengths, PAIR, kt_sample(KT_SHORT(3, 300)));
}
/* Draws scene n of a test with a seed. */
static void draw_scene_of(uint64_t seed, const char *test, int n, scene *s) {
    kt_random random = kt_random_seeded(seed, test);
    for (int k = 0; k <= n; k++)
        draw_scene(s, &random);
}

/* Twins of other seeds that once moved otherwise. */
static const twin shorter = {"lengths times 2^-10", 1.0, 0x1p-10, 1.0, 0.0, false, false, 0.0, 0.0, 0.0};
static const twin faster = {"times times 2^-10", 1.0, 1.0, 0x1p-10, 0.0, false, false, 0.0, 0.0, 0.0};
static const char in_units[] = "scenes_move_alike_in_all_units";
static const char in_frames[] = "scenes_move_alike_in_a_frame_that_moves";
static const char in_time[] = "scenes_move_alike_at_late_times";
static const struct found {
    uint64_t seed;
    int scene;
    const char *why, *test, *method;
    bool fixed, bits;
    const twin *twin;
} found_twins[] = {
    {3, 2, "at an arm that points along its slip, rounding was the unit of forces", in_units, "rk4", true, true,
     &faster},
    {20, 2, "depths of gaps, in m, bounded slip, in m/s", in_units, "rk4", true, false, &shorter},
    {2, 3, "tolerances in rad/s were compared with speeds in m/s", in_units, "dopri5", false, false, &shorter},
    {2, 1, "rates of rest grew with the speed of the frame", in_frames, "dopri5", false, false, &boosted[1]},
    {3104, 6, "slip in a fast frame struck as no slip", in_frames, "rk4", true, false, fast},
    {4001, 6, "friction could hold slip whose steps were short", in_frames, "dopri5", false, false, boosted},
    {4002, 2, "the first loop set the length", "scenes_move_alike_in_another_order", "dopri5", false, false, reordered},
    {102, 2, "the error of an event's time decided whether a held stop touched", in_time, "dopri5", false, false, late},
    {20, 1, "slow slip kept a direction from which it had turned", in_time, "dopri5", false, false, latest},
    {3, 4, "no step resolved the end of slip, next to the rounding of time", in_time, "dopri5", false, false, latest},
    {15, 4, "turns of slip counted for later slip, behind a rest", in_time, "rk4", true, false, late},
    {45, 10, "slip began in a direction of rounding of the time", in_time, "rk4", true, false, late},
    {2003, 10, "a stage behind the end of slip had the opposite friction", in_time, "rk4", true, false, late},
    {2013, 1, "such a stage left slip that ended twice", in_time, "rk4", true, false, late},
    {2014, 5, "rounding of the time turned friction of fast slip", in_time, "rk4", true, false, late},
    {3022, 10, "it turned friction of slow slip by a tenth", in_time, "rk4", true, false, late},
    {20, 9, "errors of stages turned friction where slip ends", in_time, "rk4", true, false, late},
    {3029, 2, "likewise, in a scene with four bodies", in_time, "rk4", true, false, late},
};
KT_TEST(twins_that_were_mended_move_alike) {
    for (size_t k = 0; k < sizeof found_twins / sizeof *found_twins; k++) {
        const struct found *found = &found_twins[k];
        static scene s;
        tally sum = {0};
        kt_note("%s", found->why);
        draw_scene_of(found->seed, found->test, found->scene, &s);
        if (found->twin->boost != 0.0)
            put_on_floor(&s);
        compare_scene(&s, found->scene, found->method, found->fixed, found->bits, found->twin, 1, &sum);
        kt_check_equal_int("twins", sum.compared, 1);
        kt_check_equal_int("twins that move otherwise", sum.wrong, 0);
    }
}
/* A body on two feet whose friction ends at once, on a box that slips slowly. Forces at an instant and in the step
 * behind it must predict the same slip. Otherwise feet begin to slip and stick in turns, or corners of the box open and
 * close. They did so 2,225 times in a step, because the instant let no slip fade whose growth had no prediction. */
KT_TEST(slip_that_begins_and_ends_in_turns_ends_within_a_step) {
    static scene s;
    static motion m;
    draw_scene_of(3, "masses_times_a_factor_leave_all_bits", 9, &s);
    move(&s, &original, "rk4", true, &m);
    (void)kt_fine("motion", m.status, &m.error);
    kt_check_equal_int("samples", m.samples, SAMPLES);
    kt_check_below("slips", (double)m.counts.slips, 50.0);
    kt_check_below("openings", (double)m.counts.openings, 50.0);
}
KT_TEST(scenes_move_alike_turned) {
    compare("rk4", true, false, turned, 1, kt_sample(KT_SHORT(3, 300)));
    compare("dopri5", false, false, turned, 1, kt_sample(KT_SHORT(3, 300)));
}
KT_TEST(scenes_move_alike_in_a_frame_that_moves) {
    compare("rk4", true, false, boosted, PAIR, kt_sample(KT_SHORT(3, 300)));
    compare("dopri5", false, false, boosted, PAIR, kt_sample(KT_SHORT(3, 300)));
    compare("rk4", true, false, fast, 1, kt_sample(KT_SHORT(3, 300)));
    compare("dopri5", false, false, fast, 1, kt_sample(KT_SHORT(3, 300)));
}
KT_TEST(scenes_move_alike_in_another_order) {
    compare("dopri5", false, false, reordered, 1, kt_sample(KT_SHORT(8, 300)));
}
KT_TEST(scenes_move_alike_at_late_times) {
    compare("rk4", true, false, late, 1, kt_sample(KT_SHORT(3, 300)));
    compare("dopri5", false, false, late, 1, kt_sample(KT_SHORT(3, 300)));
    compare("dopri5", false, false, latest, 1, kt_sample(KT_SHORT(3, 300)));
}
