/* Motions with impacts, stick and slip, compared with closed forms.
 *
 * Creep: a block on a slope of tan(a) = 0.95 mu stays at its place.
 *
 * Bounce: a ball falls from 1 m and bounces ever lower, with restitution e = 0.5. It rests from 3 sqrt(2 / g) on.
 *
 * Belt: a belt at w0 carries along a block on a spring until k x = mu m g. From then on the block swings about that
 * place, at w^2 = k / m, by w0 / w. The reason is that friction of a belt that is always faster is constant.
 *
 * Roll: a ball slides at v = v0 - mu g t until its spin 5 mu g t / (2 r) is v / r, at
 *     t = 2 v0 / (7 mu g)
 * From then on it rolls at 5/7 v0.
 *
 * Pinch: a jaw presses a block against a wall with the force F,
 *     2 mu F = 95 m g
 * The block stays at its place.
 *
 * Cradle: equal balls are in a row, a little apart. Each hands its speed on to the next one and rests. The last one
 * leaves.
 *
 * Heap: balls above each other fall freely. Each falls until it lies on the one below, which is at rest by then.
 *
 * Rope: a stone hangs on a rope of length L and is struck at v0,
 *     2 g L < v0^2 < 5 g L
 * It swings up until the rope is slack, above the horizontal by an angle a,
 *     3 g L sin(a) = v0^2 - 2 g L
 * It flies with v^2 = g L sin(a) for 4 v cos(a) / g, until the rope takes its velocity along itself. Then it swings on
 * with the rest.
 *
 * Rock: a block of half diagonal R leans on an edge, falls back and rocks from edge to edge (G. W. Housner, Bull.
 * Seism. Soc. Am. 53, 1963). The angle of that diagonal from the vertical is f, and f = a if the block is upright. The
 * motion obeys
 *     f'' = p^2 sin(f),  p^2 = 3 g / (4 R)
 * Each impact multiplies its rate by the following factor, until it rests:
 *     1 - 3/2 sin(a)^2
 *
 * This engine takes the contacts as they are (restitution, friction), with steps of its own to 1e-10.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "events.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

/* ---- closed forms ------------------------------------------------------------------------------------------------ */

static double resting(const kt_events_problem *p, int body, double t) {
    (void)t;
    return p->body[body].at[p->axis];
}

/* Bounce k is at the time T(k), with e^k of the first speed:
 *     T(k) = t1 (1 + 2 e + ... + 2 e^k) */
static double bouncing(const kt_events_problem *p, int body, double t) {
    const kt_events_body *ball = &p->body[body];
    const double g = p->gravity, low = ball->half[KT_EVENTS_Z], drop = ball->at[KT_EVENTS_Z] - low;
    const double first = sqrt(2.0 * drop / g);
    double begin = first, speed = p->restitution * g * first;
    if (t < first)
        return low + drop - 0.5 * g * t * t;
    while (speed > 1e-9 && t > begin + 2.0 * speed / g) {
        begin += 2.0 * speed / g;
        speed *= p->restitution;
    }
    return low + (speed > 1e-9 ? (t - begin) * (speed - 0.5 * g * (t - begin)) : 0.0);
}

/* Seen from the belt. */
static double carried(const kt_events_problem *p, int body, double t) {
    const double m = p->body[body].mass, reach = p->friction * m * p->gravity / p->stiffness;
    const double w = sqrt(p->stiffness / m), slip = t - reach / p->belt;
    return slip < 0.0 ? 0.0 : reach + p->belt / w * sin(w * slip) - p->belt * t;
}

static double rolling(const kt_events_problem *p, int body, double t) {
    const double v0 = p->body[body].speed, a = p->friction * p->gravity, slides = fmin(t, 2.0 * v0 / (7.0 * a));
    return v0 * slides - 0.5 * a * slides * slides + 5.0 / 7.0 * v0 * (t - slides);
}

/* The speed comes to a body when all gaps before it have been crossed, and stays until its own one has been. */
static double handed_on(const kt_events_problem *p, int body, double t) {
    const double v0 = p->body[0].speed;
    double begin = 0.0, end = 0.0;
    for (int i = 0; i <= body; i++) {
        const kt_events_body *one = &p->body[i], *next = one + 1;
        begin = end;
        end = i + 1 == p->body_count ? (double)INFINITY
                                     : begin + (next->at[KT_EVENTS_X] - one->at[KT_EVENTS_X] - one->half[KT_EVENTS_X] -
                                                next->half[KT_EVENTS_X]) /
                                                   v0;
    }
    return p->body[body].at[KT_EVENTS_X] + v0 * fmax(0.0, fmin(t, end) - begin);
}

static double heaped(const kt_events_problem *p, int body, double t) {
    double lies = p->body[body].half[KT_EVENTS_Z];
    for (int i = 0; i < body; i++)
        lies += 2.0 * p->body[i].half[KT_EVENTS_Z];
    return fmax(lies, p->body[body].at[KT_EVENTS_Z] - 0.5 * p->gravity * t * t);
}

/* Jacobi's sn(u, k) for |k| < 1, and F(phi, k) for |phi| < pi / 2, with sn(F, k) = sin(phi). Both use
 * arithmetic-geometric means (Abramowitz and Stegun, 16.4 and 17.6). */
enum { MEANS = 8 };

static double jacobi_sn(double u, double k) {
    double a[MEANS + 1] = {1.0}, c[MEANS + 1] = {k}, b = sqrt(1.0 - k * k);
    for (int n = 0; n < MEANS; n++) {
        a[n + 1] = 0.5 * (a[n] + b);
        c[n + 1] = 0.5 * (a[n] - b);
        b = sqrt(a[n] * b);
    }
    double phi = ldexp(a[MEANS] * u, MEANS);
    for (int n = MEANS; n > 0; n--)
        phi = 0.5 * (phi + asin(c[n] / a[n] * sin(phi)));
    return sin(phi);
}

static double elliptic_f(double phi, double k) {
    const double pi = 3.14159265358979323846;
    double a = 1.0, b = sqrt(1.0 - k * k);
    for (int n = 0; n < MEANS; n++) {
        const double mean = 0.5 * (a + b);
        phi += atan(b / a * tan(phi)) + pi * floor(phi / pi + 0.5);
        b = sqrt(a * b);
        a = mean;
    }
    return ldexp(phi / a, -MEANS);
}

/* The horizontal place after t of a pendulum that passes the angle at a rate: sin(angle / 2) = k sn(u), u' = sqrt(g /
 * L). */
static double swinging(double length, double frequency, double angle, double rate, double t) {
    const double k = hypot(0.5 * rate / frequency, sin(0.5 * angle)), u = elliptic_f(asin(sin(0.5 * angle) / k), k);
    const double half = k * jacobi_sn(u + copysign(frequency * t, rate), k);
    return 2.0 * length * half * sqrt(1.0 - half * half);
}

static double roped(const kt_events_problem *p, int body, double t) {
    const double g = p->gravity, L = p->rope, v0 = p->body[body].speed, w = sqrt(g / L), k = 0.5 * v0 / (w * L);
    const double s = (v0 * v0 / (g * L) - 2.0) / 3.0, c = sqrt(1.0 - s * s), v = sqrt(g * L * s);
    const double slack = elliptic_f(asin(sqrt(0.5 * (1.0 + s)) / k), k) / w, flight = 4.0 * v * c / g;
    if (t < slack)
        return swinging(L, w, 0.0, v0 / L, t);
    if (t < slack + flight)
        return L * c - v * s * (t - slack);
    const double x = L * c - v * s * flight, z = L * s - v * c * flight; /* of z, v c t - g t^2 / 2 */
    const double across = (v * s * z + (v * c - g * flight) * x) / L;    /* of (-v s, v c - g t) along (-z, x) */
    return swinging(L, w, atan2(x, -z), across / L, t - slack - flight);
}

/* From edge to edge, f is least, at rest, at the time `top`; f = a at `reach` before and after that. */
typedef struct arc {
    double cosine, top, reach; /* cos(f) at the top; s */
} arc;

/* The arcs of a block, until they are too small to be seen. Between impacts,
 *     p^2 cos(f) + f'^2 / 2 = constant
 * An impact leaves `keep` of f' at f = a, and therefore keep^2 of d = cos(f) - cos(a) at the top. From the top on, with
 * k = cos(f_top / 2),
 *     sin(f / 2) = sin(f_top / 2) / dn(p t, k)
 * The angle f is a when
 *     sn(p t) = sqrt(d / 2) / (k sin(a / 2)) */
enum { ARCS = 64 };

static void find_arcs(double alpha, double top, double p, arc arcs[ARCS]) {
    const double keep = 1.0 - 1.5 * sin(alpha) * sin(alpha);
    double above = cos(top) - cos(alpha), begin = 0.0;
    for (int n = 0; n < ARCS; n++) {
        const double cosine = cos(alpha) + above, k = sqrt(0.5 * (1.0 + cosine));
        const double reach = elliptic_f(asin(sqrt(0.5 * above) / (k * sin(0.5 * alpha))), k) / p;
        begin += n == 0 ? 0.0 : reach;
        arcs[n] = (arc){cosine, begin, reach};
        begin += reach;
        above *= keep * keep;
    }
}

/* It remembers the arcs: there is one block that rocks. */
static double rocked(const kt_events_problem *p, int body, double t) {
    static arc arcs[ARCS];
    const kt_events_body *block = &p->body[body];
    const double b = block->half[KT_EVENTS_X], h = block->half[KT_EVENTS_Z], R = hypot(b, h), alpha = atan2(b, h);
    const double frequency = sqrt(0.75 * p->gravity / R);
    int n = 0;
    if (arcs[0].reach == 0.0)
        find_arcs(alpha, alpha - block->lean, frequency, arcs);
    while (n < ARCS && t > arcs[n].top + arcs[n].reach)
        n++;
    if (n == ARCS)
        return 0.0;
    const double k = sqrt(0.5 * (1.0 + arcs[n].cosine)), sn = jacobi_sn(frequency * (t - arcs[n].top), k);
    const double half = sqrt(0.5 * (1.0 - arcs[n].cosine) / (1.0 - k * k * sn * sn)); /* sin(f / 2) */
    return (n % 2 == 0 ? 1.0 : -1.0) * (b - 2.0 * R * half * sqrt(1.0 - half * half));
}

/* ---- the problems ------------------------------------------------------------------------------------------------ */

#define G 9.81
#define FLOOR                                                                                                          \
    { -1, 0, KT_EVENTS_Z }
#define LYING_BLOCK                                                                                                    \
    { .shape = KT_EVENTS_BLOCK, .half = {0.1, 0.05}, .at = {0.0, 0.05}, .is_free = {true, true}, .mass = 2.0 }
#define CRADLE_BALL(x, v)                                                                                              \
    {                                                                                                                  \
        .shape = KT_EVENTS_BALL, .half = {0.0625, 0.0625}, .at = {x, 0.0}, .is_free = {true, false}, .mass = 1.0,      \
        .speed = v                                                                                                     \
    }
#define FALLING_BALL(z)                                                                                                \
    { .shape = KT_EVENTS_BALL, .half = {0.0625, 0.0625}, .at = {0.0, z}, .is_free = {false, true}, .mass = 1.0 }

const kt_events_problem kt_events_problems[KT_EVENTS_COUNT] = {
    {.name = "block on a slope, 95 % of its margin",
     .measured = "creep in 10 s, m",
     .duration = 10.0,
     .step = 1e-3,
     .gravity = G,
     .tilt = 0.4434483364197382,
     .friction = 0.5, /* tan(tilt) = 0.95 friction */
     .body_count = 1,
     .contact_count = 1,
     .body = {LYING_BLOCK},
     .contact = {FLOOR},
     .axis = KT_EVENTS_X,
     .exact = resting},
    {.name = "bouncing ball, to its rest",
     .measured = "height, m",
     .bound = 2e-14,
     .duration = 2.0,
     .step = 1e-4,
     .gravity = G,
     .restitution = 0.5,
     .body_count = 1,
     .contact_count = 1,
     .body = {{.shape = KT_EVENTS_BALL, .half = {0.1, 0.1}, .at = {0.0, 1.1}, .is_free = {false, true}, .mass = 1.0}},
     .contact = {FLOOR},
     .axis = KT_EVENTS_Z,
     .exact = bouncing},
    {.name = "block on a spring on a belt",
     .measured = "place, m",
     .bound = 2e-9,
     .duration = 10.0,
     .step = 1e-3,
     .gravity = G,
     .friction = 0.3,
     .stiffness = 50.0,
     .belt = 0.2,
     .body_count = 1,
     .contact_count = 1,
     .body = {LYING_BLOCK},
     .contact = {FLOOR},
     .axis = KT_EVENTS_X,
     .exact = carried},
    {.name = "ball that slides and comes to roll",
     .measured = "place, m",
     .bound = 5e-15,
     .duration = 2.0,
     .step = 1e-3,
     .gravity = G,
     .friction = 0.3,
     .body_count = 1,
     .contact_count = 1,
     .body = {{.shape = KT_EVENTS_BALL,
               .half = {0.1, 0.1},
               .at = {0.0, 0.1},
               .is_free = {true, true},
               .turns = true,
               .mass = 2.0,
               .speed = 1.5}},
     .contact = {FLOOR},
     .axis = KT_EVENTS_X,
     .exact = rolling},
    {.name = "pinched block, 95 times its margin",
     .measured = "creep in 10 s, m",
     .duration = 10.0,
     .step = 1e-3,
     .gravity = G,
     .friction = 0.5,
     .body_count = 2,
     .contact_count = 2,
     .body =
         {{.shape = KT_EVENTS_BLOCK, .half = {0.125, 0.125}, .at = {0.125, 0.0}, .is_free = {true, true}, .mass = 2.0},
          {.shape = KT_EVENTS_BLOCK,
           .half = {0.125, 0.125},
           .at = {0.375, 0.0},
           .is_free = {true, false},
           .mass = 1.0,
           .push = -95.0 * 2.0 * G / (2.0 * 0.5)}},
     .contact = {{-1, 0, KT_EVENTS_X}, {0, 1, KT_EVENTS_X}},
     .axis = KT_EVENTS_Z,
     .exact = resting},
    {.name = "cradle of five balls, 1 um apart",
     .measured = "place, m",
     .bound = 2e-14,
     .duration = 2.0,
     .step = 1e-4,
     .restitution = 1.0,
     .body_count = 5,
     .contact_count = 4,
     .body = {CRADLE_BALL(0.0, 1.0), CRADLE_BALL(0.625, 0.0), CRADLE_BALL(0.750001, 0.0), CRADLE_BALL(0.875002, 0.0),
              CRADLE_BALL(1.000003, 0.0)},
     .contact = {{0, 1, KT_EVENTS_X}, {1, 2, KT_EVENTS_X}, {2, 3, KT_EVENTS_X}, {3, 4, KT_EVENTS_X}},
     .axis = KT_EVENTS_X,
     .exact = handed_on},
    {.name = "balls that fall on each other",
     .measured = "heights, m",
     .bound = 5e-15,
     .duration = 2.0,
     .step = 1e-3,
     .gravity = G,
     .body_count = 3,
     .contact_count = 3,
     .body = {FALLING_BALL(0.3125), FALLING_BALL(0.6875), FALLING_BALL(1.0625)},
     .contact = {FLOOR, {0, 1, KT_EVENTS_Z}, {1, 2, KT_EVENTS_Z}},
     .axis = KT_EVENTS_Z,
     .exact = heaped},
    {.name = "stone on a rope that is slack",
     .measured = "place, m",
     .bound = 2e-9,
     .duration = 3.0,
     .step = 1e-3,
     .gravity = G,
     .rope = 1.0,
     .body_count = 1,
     .body = {{.shape = KT_EVENTS_BALL,
               .half = {0.05, 0.05},
               .at = {0.0, -1.0},
               .is_free = {true, true},
               .mass = 1.0,
               .speed = 5.69}}, /* 3.3 g L */
     .axis = KT_EVENTS_X,
     .exact = roped},
    {.name = "block that rocks until it rests",
     .measured = "place, m",
     .bound = 2e-10,
     .duration = 2.0,
     .step = 1e-4,
     .gravity = G,
     .friction = 1.0,
     .body_count = 1,
     .contact_count = 1,
     .body = {{.shape = KT_EVENTS_BLOCK,
               .half = {0.2, 0.4},
               .at = {0.10517909935968023, 0.43704576053516253},
               .is_free = {true, true},
               .turns = true,
               .lean = 0.25,
               .mass = 2.0}},
     .contact = {FLOOR},
     .axis = KT_EVENTS_X,
     .exact = rocked},
};

void kt_events_see(kt_events_watch *watch, int body, double t, double at) {
    const kt_events_problem *p = watch->problem;
    const double error = fabs(at - p->exact(p, body, t));
    watch->is_seen = true;
    if (!isnan(watch->error) && !(error <= watch->error)) /* NaN stays */
        watch->error = error;
}

double kt_events_pull(const kt_events_problem *p, double x, double t) { return -p->stiffness * (x + p->belt * t); }

double kt_events_clock(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void kt_events_step(kt_events_rate *rate, int n, double y[], double h) {
    static const double at[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    double k[KT_EVENTS_STATES] = {0.0}, sum[KT_EVENTS_STATES] = {0.0}, here[KT_EVENTS_STATES];
    for (int stage = 0; stage < 4; stage++) {
        for (int i = 0; i < n; i++)
            here[i] = y[i] + at[stage] * h * k[i];
        rate(here, k);
        for (int i = 0; i < n; i++)
            sum[i] += weight[stage] * k[i];
    }
    for (int i = 0; i < n; i++)
        y[i] += h / 6.0 * sum[i];
}

/* ---- this engine ------------------------------------------------------------------------------------------------- */

enum { JOINTS = KT_EVENTS_AXES + 1, NAME = 8 }; /* of a body: along x, along z, about y */

/* Each body is a chain of the joints that it has; the last link carries its mass. */
typedef struct slides {
    kt_events_watch *watch;
    kt_body link[KT_EVENTS_BODIES * JOINTS];
    char name[KT_EVENTS_BODIES * JOINTS][NAME], spring[80];
    int count;                                   /* of links, each of one coordinate */
    int along[KT_EVENTS_BODIES][KT_EVENTS_AXES]; /* the link along an axis; -1: there is none */
    int carrier[KT_EVENTS_BODIES];               /* the last link */
    kt_effect effect[2 * KT_EVENTS_BODIES + 1];
    int effect_count;
    kt_loop rope;
} slides;

static kt_vec3 direction(kt_events_axis axis, double length) {
    return axis == KT_EVENTS_X ? kt_vec3_make(length, 0.0, 0.0) : kt_vec3_make(0.0, 0.0, length);
}

/* One more link of the chain that ends with `parent` (-1: the world). Returns its number. */
static int add_link(slides *s, int parent, kt_joint_type type, kt_vec3 axis) {
    const int i = s->count++;
    kt_body *link = &s->link[i];
    *link = kt_body_default();
    (void)snprintf(s->name[i], NAME, "l%d", i);
    link->name = s->name[i];
    link->parent = parent < 0 ? NULL : s->name[parent];
    link->joint.type = type;
    link->joint.axis = axis;
    return i;
}

static void add_body(slides *s, int which) {
    const kt_events_body *body = &s->watch->problem->body[which];
    const int first = s->count;
    int last = -1;
    kt_vec3 fixed = kt_vec3_make(0.0, 0.0, 0.0);
    for (int axis = 0; axis < KT_EVENTS_AXES; axis++) {
        s->along[which][axis] = -1;
        if (body->is_free[axis]) {
            last = s->along[which][axis] = add_link(s, last, KT_JOINT_PRISMATIC, direction((kt_events_axis)axis, 1.0));
            s->link[last].joint.position[0] = body->at[axis];
            s->link[last].joint.velocity[0] = axis == KT_EVENTS_X ? body->speed : 0.0;
        } else {
            fixed = kt_vec3_add(fixed, direction((kt_events_axis)axis, body->at[axis]));
        }
    }
    if (body->turns) { /* it is solid; other moments of inertia than that about y are not felt */
        const double x = body->half[KT_EVENTS_X], z = body->half[KT_EVENTS_Z];
        const double inertia = body->mass * (body->shape == KT_EVENTS_BALL ? 0.4 * x * x : (x * x + z * z) / 3.0);
        last = add_link(s, last, KT_JOINT_REVOLUTE, kt_vec3_make(0.0, 1.0, 0.0));
        s->link[last].joint.position[0] = body->lean;
        s->link[last].inertia = (kt_sym3){.xx = inertia, .yy = inertia, .zz = inertia};
    }
    s->link[first].joint.at = fixed;
    s->link[last].mass = body->mass;
    s->carrier[which] = last;
}

static kt_effect *add_effect(slides *s, kt_effect_type type) {
    kt_effect *effect = &s->effect[s->effect_count++];
    *effect = kt_effect_default();
    effect->type = type;
    return effect;
}

/* A sphere in the upper body on a plane of the lower one, normal to the axis. This serves for blocks that do not turn,
 * and for balls that move along the axis alone or on a floor. */
static kt_effect *add_contact(slides *s, const kt_events_contact *contact) {
    const kt_events_problem *p = s->watch->problem;
    kt_effect *effect = add_effect(s, KT_EFFECT_CONTACT);
    effect->between[0].body = s->name[s->carrier[contact->upper]];
    effect->radius = p->body[contact->upper].half[contact->axis];
    effect->axis = direction(contact->axis, 1.0);
    if (contact->lower >= 0) {
        effect->between[1].body = s->name[s->carrier[contact->lower]];
        effect->between[1].at = direction(contact->axis, p->body[contact->lower].half[contact->axis]);
    }
    effect->friction = p->friction;
    effect->restitution = p->restitution;
    return effect;
}

/* A block that turns touches the floor with one of its edges or with both. */
static void add_contacts(slides *s, const kt_events_contact *contact) {
    const kt_events_body *body = &s->watch->problem->body[contact->upper];
    const bool on_edges = body->turns && body->shape == KT_EVENTS_BLOCK;
    for (int side = on_edges ? -1 : 1; side <= 1; side += 2) {
        kt_effect *effect = add_contact(s, contact);
        if (on_edges) {
            effect->radius = 0.0;
            effect->between[0].at = kt_vec3_make(side * body->half[KT_EVENTS_X], 0.0, -body->half[KT_EVENTS_Z]);
        }
    }
}

static void add_forces(slides *s) {
    const kt_events_problem *p = s->watch->problem;
    for (int i = 0; i < p->body_count; i++)
        if (p->body[i].push != 0.0) {
            kt_effect *motor = add_effect(s, KT_EFFECT_MOTOR);
            motor->joint = s->name[s->along[i][KT_EVENTS_X]];
            motor->torque = kt_function_constant(p->body[i].push);
        }
    if (p->stiffness > 0.0) {
        kt_effect *spring = add_effect(s, KT_EFFECT_EXPRESSION);
        const char *joint = s->name[s->along[0][KT_EVENTS_X]];
        (void)snprintf(s->spring, sizeof s->spring, "-%.17g*(position.%s + %.17g*t)", p->stiffness, joint, p->belt);
        spring->joint = joint;
        spring->formula[0] = s->spring;
    }
}

static void add_rope(slides *s) {
    s->rope = kt_loop_default();
    s->rope.name = "rope";
    s->rope.type = KT_LOOP_DISTANCE;
    s->rope.between[1].body = s->name[s->carrier[0]];
    s->rope.function = kt_function_constant(s->watch->problem->rope);
    s->rope.slack = true;
}

static int see_record(const kt_record *record, void *user) {
    const slides *s = user;
    const kt_events_problem *p = s->watch->problem;
    for (int i = 0; i < p->body_count; i++) {
        const int link = s->along[i][p->axis];
        kt_events_see(s->watch, i, record->t, link >= 0 ? record->q[link] : p->body[i].at[p->axis]);
    }
    return 0;
}

static kt_status run(kt_events_watch *watch, const kt_scene *scene, const kt_model *model, kt_recorder *see, void *user,
                     kt_error *error) {
    kt_simulation *simulation = NULL;
    kt_scene_watch *events = NULL;
    kt_simulation_options options = kt_simulation_options_default();
    kt_run times = kt_run_default();
    options.events = kt_scene_event_room(scene);
    times.duration = watch->problem->duration;
    times.interval = 1e-3;
    times.relative = times.absolute = watch->problem->tolerance > 0.0 ? watch->problem->tolerance : 1e-10;
    kt_status status = kt_simulation_create(model, &times, &options, &simulation, error);
    if (status == KT_OK)
        status = kt_scene_watch_create(scene, model, simulation, NULL, 0, &events, error);
    const double begin = kt_events_clock();
    if (status == KT_OK)
        status = kt_simulation_run(simulation, see, user, error);
    watch->seconds = kt_events_clock() - begin;
    kt_simulation_free(simulation);
    kt_scene_watch_free(events);
    return status;
}

bool kt_events_run(kt_events_watch *watch, const kt_scene *scene, kt_recorder *see, void *user) {
    kt_error error = {0};
    kt_model *model = NULL;
    kt_model_options options = kt_model_options_default();
    options.settable = kt_scene_needs_settable(scene);
    kt_status status = kt_model_compile(&scene->description, &options, &model, &error);
    if (status == KT_OK)
        status = run(watch, scene, model, see, user, &error);
    if (status != KT_OK)
        (void)snprintf(watch->words, sizeof watch->words, "%.39s", error.message);
    kt_model_free(model);
    return status == KT_OK;
}

bool kt_events_run_text(kt_events_watch *watch, const char *text, kt_recorder *see, void *user) {
    kt_scene scene;
    kt_error error = {0};
    if (kt_scene_parse(watch->problem->name, text, strlen(text), &scene, NULL, NULL, &error) != KT_OK) {
        (void)snprintf(watch->words, sizeof watch->words, "%.39s", error.message);
        return false;
    }
    const bool good = kt_events_run(watch, &scene, see, user);
    kt_scene_free(&scene);
    return good;
}

bool kt_events_kinetree(kt_events_watch *watch) {
    const kt_events_problem *p = watch->problem;
    kt_scene scene = kt_scene_default();
    kt_description *d = &scene.description;
    slides s = {.watch = watch};
    for (int i = 0; i < p->body_count; i++)
        add_body(&s, i);
    for (int i = 0; i < p->contact_count; i++)
        add_contacts(&s, &p->contact[i]);
    add_forces(&s);
    d->gravity = kt_vec3_make(p->gravity * sin(p->tilt), 0.0, -p->gravity * cos(p->tilt));
    d->bodies = s.link;
    d->body_count = s.count;
    d->effects = s.effect;
    d->effect_count = s.effect_count;
    if (p->rope > 0.0) {
        add_rope(&s);
        d->loops = &s.rope;
        d->loop_count = 1;
    }
    return kt_events_run(watch, &scene, see_record, &s);
}
