/* Bars, 1 kg a metre, most of them on revolute joints about z, in gravity along -y. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "bars.h"

#include "bench.h"
#include "kinetree/dynamics.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const kt_bars_shape_name[KT_BARS_SHAPES] = {
    "separate", "chained", "row",      "rope", "rope in space", "rope of balls", "scissors", "ladder",
    "net",      "grid",    "branches", "fork", "freer",         "spherical",     "bennett"};

enum { NAME_SIZE = 24 };

typedef struct drawing {
    kt_body *bodies;
    kt_loop *loops;
    char (*names)[NAME_SIZE]; /* of the bodies, then of the loops */
    int body_count, loop_count;
} drawing;

static const char *add_bar(drawing *d, const char *kind, int n, const char *parent, kt_vec3 at, kt_vec3 to,
                           double angle, double rate) {
    char *name = d->names[d->body_count];
    kt_body *body = &d->bodies[d->body_count++];
    (void)snprintf(name, NAME_SIZE, "%s%d", kind, n);
    *body = kt_body_default();
    body->name = name;
    body->parent = parent;
    body->joint.type = KT_JOINT_REVOLUTE;
    body->joint.at = at;
    body->joint.position[0] = angle;
    body->joint.velocity[0] = rate;
    body->mass = kt_vec3_norm(to);
    body->shape.type = KT_SHAPE_ROD;
    body->shape.to = to;
    body->com_of_shape = body->inertia_of_shape = true;
    return name;
}

static void add_loop(drawing *d, const char *first, kt_vec3 at, const char *second, kt_vec3 there) {
    const int n = d->loop_count++;
    kt_loop *loop = &d->loops[n];
    char *name = d->names[d->body_count + n]; /* all bodies are there */
    (void)snprintf(name, NAME_SIZE, "loop%d", n);
    *loop = kt_loop_default();
    loop->name = name;
    loop->type = KT_LOOP_REVOLUTE;
    loop->between[0].body = first;
    loop->between[0].at = at;
    loop->between[1].body = second;
    loop->between[1].at = there;
}

static kt_vec3 along(double x, double y) { return kt_vec3_make(x, y, 0.0); }

/* A link of the chain carries a four-bar. Its ground and crank have 2.2 and 1 m, its coupler and rocker 2 and 1.8 m. */
static void draw_separate(drawing *d, int loops, bool open) {
    const char *link = NULL;
    for (int i = 0; i < loops; i++) {
        link = add_bar(d, "link", i, link, along(i ? 0.3 : 0.0, 0.0), along(0.3, 0.0), 0.1, 0.2);
        (void)add_bar(d, "crank", i, link, along(0.0, 0.0), along(1.0, 0.0), 1.0, 1.0);
        (void)add_bar(d, "coupler", i, d->names[4 * i + 1], along(1.0, 0.0), along(2.0, 0.0), -0.6, 0.0);
        (void)add_bar(d, "rocker", i, link, along(2.2, 0.0), along(1.8, 0.0), 1.6, 0.0);
    }
    for (int i = 0; i < loops && !open; i++)
        add_loop(d, d->names[4 * i + 2], along(2.0, 0.0), d->names[4 * i + 3], along(1.8, 0.0));
}

/* The N-four-bar of 1 m rods (IFToMM A02), leaning by half a radian. */
static void draw_chained(drawing *d, int loops, bool open) {
    const double lean = -0.5, rate = -1.0;
    const char *crank = add_bar(d, "crank", 0, NULL, along(0.0, 0.0), along(0.0, 1.0), lean, rate);
    for (int i = 1; i <= loops; i++) {
        (void)add_bar(d, "coupler", i, crank, along(0.0, 1.0), along(1.0, 0.0), -lean, -rate);
        crank = add_bar(d, "crank", i, NULL, along(i, 0.0), along(0.0, 1.0), lean, rate);
    }
    for (int i = 1; i <= loops && !open; i++)
        add_loop(d, d->names[2 * i - 1], along(1.0, 0.0), d->names[2 * i], along(0.0, 1.0));
}

static void draw_row(drawing *d, int rods) {
    const char *rod = NULL;
    for (int i = 0; i < rods; i++)
        rod = add_bar(d, "rod", i, rod, along(i ? 1.0 : 0.0, 0.0), along(1.0, 0.0), 0.5 + 0.3 * (i % 5), 0.2 * (i % 7));
}

/* Turns a bar's joint about a, or makes it spherical, turned by `angle` about z; gives the bar some thickness. */
static void turn_last(drawing *d, kt_joint_type type, kt_vec3 axis, double angle) {
    kt_body *body = &d->bodies[d->body_count - 1];
    body->joint.type = type;
    body->joint.axis = axis;
    body->shape.radius = 0.1;
    if (type != KT_JOINT_SPHERICAL)
        return;
    const double half[4] = {cos(0.5 * angle), 0.0, 0.0, sin(0.5 * angle)};
    memcpy(body->joint.position, half, sizeof half);
    body->joint.velocity[2] = body->joint.velocity[0];
    body->joint.velocity[0] = 0.0;
}

/* An arch over 0.84 of its length. */
static void draw_rope(drawing *d, kt_bars_shape shape, int rods, bool open) {
    const char *rod = NULL;
    const kt_vec3 y = kt_vec3_make(0.0, 1.0, 0.0), z = kt_vec3_make(0.0, 0.0, 1.0);
    for (int i = 0; i < rods; i++) {
        const bool bends = shape != KT_BARS_ROPE_IN_SPACE || i % 2 == 0;
        const double turn = shape == KT_BARS_ROPE_IN_SPACE ? -4.0 : -2.0;
        const double angle = i == 0 ? 1.0 : bends ? turn / rods : 0.3 / rods;
        rod = add_bar(d, "rod", i, rod, along(i ? 1.0 : 0.0, 0.0), along(1.0, 0.0), angle, 0.1 * (i % 7));
        if (shape == KT_BARS_ROPE_IN_SPACE)
            turn_last(d, KT_JOINT_REVOLUTE, bends ? z : y, angle);
        else if (shape == KT_BARS_ROPE_OF_BALLS)
            turn_last(d, KT_JOINT_SPHERICAL, z, angle);
    }
    if (open)
        return;
    add_loop(d, rod, along(1.0, 0.0), NULL, along(0.84 * rods, 0.0));
    d->loops[0].type = shape == KT_BARS_ROPE ? KT_LOOP_REVOLUTE : KT_LOOP_SPHERICAL;
}

/* Two bars of 2 m a stage, crossed at their middles: the second hangs on the first, the next stage's first on its
 * end. */
static void draw_scissors(drawing *d, int stages, bool open) {
    const double lean = 0.5, rate = 0.3, right = 2.0 * acos(0.0);
    const char *second = NULL;
    for (int i = 0; i < stages; i++) {
        const char *first = add_bar(d, "first", i, second, along(i ? 1.0 : 0.0, 0.0), along(2.0, 0.0),
                                    i ? 2.0 * lean - right : lean, i ? 2.0 * rate : rate);
        second = add_bar(d, "second", i, first, along(1.0, 0.0), along(1.0, 0.0), right - 2.0 * lean, -2.0 * rate);
        kt_body *body = &d->bodies[d->body_count - 1];
        body->mass = 2.0;
        body->shape.from = along(-1.0, 0.0);
    }
    for (int i = 0; i < stages && !open; i++) {
        add_loop(d, i ? d->names[2 * i - 2] : NULL, along(i ? 2.0 : 0.0, 0.0), d->names[2 * i + 1], along(-1.0, 0.0));
        if (i)
            continue;
        d->loops[0].type = KT_LOOP_INPLANE;
        d->loops[0].axis = kt_vec3_make(0.0, 1.0, 0.0);
    }
}

/* An angle up to 0.2, which goes to and fro along a chain. */
static double bend(int i, int c) { return 0.1 * ((7 * i + 3 * c) % 5 - 2); }

/* `chains` chains side by side, 1 m apart, each of so many rods that hang. */
static void draw_net(drawing *d, int chains, int rods, bool space, bool open) {
    const kt_vec3 x = kt_vec3_make(1.0, 0.0, 0.0), z = kt_vec3_make(0.0, 0.0, 1.0);
    for (int c = 0; c < chains; c++) {
        const char *rod = NULL;
        for (int i = 0; i < rods; i++) {
            const kt_vec3 at = i ? along(0.0, -1.0) : along(c, 0.0);
            rod = add_bar(d,
                          c == 0   ? "left"
                          : c == 1 ? "middle"
                                   : "right",
                          i, rod, at, along(0.0, -1.0), bend(i, c), i ? 0.0 : 0.1);
            if (space)
                turn_last(d, KT_JOINT_REVOLUTE, i % 2 ? x : z, 0.0);
        }
    }
    for (int i = 0; i < rods && !open; i++)
        for (int c = 0; c + 1 < chains; c++) {
            add_loop(d, d->names[c * rods + i], along(0.0, -1.0), d->names[(c + 1) * rods + i], along(0.0, -1.0));
            d->loops[d->loop_count - 1].type = KT_LOOP_DISTANCE;
        }
}

/* ---- rows that branch, and rows whose loops are freer or redundant ----------------------------------------------- */

/* The end of a coupler, at `to` in its frame, is the tip of a crank. */
static void close_window(drawing *d, const char *coupler, kt_vec3 to, const char *crank, double length) {
    add_loop(d, coupler, to, crank, along(0.0, length));
}

/* `rows` rows of n windows above each other: columns of cranks, and couplers between them at each height. */
static void draw_grid(drawing *d, int rows, int n, bool open) {
    const int row = 2 * n + 1;
    for (int j = 0; j < rows; j++) {
        const double lean = j % 2 ? 0.4 : -0.5, below = j == 0 ? 0.0 : j % 2 ? -0.5 : 0.4, rate = j ? 0.0 : 0.5;
        for (int i = 0; i <= n; i++)
            (void)add_bar(d, "crank", j * row + i, j ? d->names[(j - 1) * row + i] : NULL,
                          j ? along(0.0, 1.0) : along(i, 0.0), along(0.0, 1.0), lean - below, rate);
        for (int i = 0; i < n; i++)
            (void)add_bar(d, "coupler", j * row + i, d->names[j * row + i], along(0.0, 1.0), along(1.0, 0.0), -lean,
                          -rate);
    }
    for (int i = 0; i < rows * n && !open; i++) {
        const int crank = i / n * row + i % n;
        close_window(d, d->names[crank + n + 1], along(1.0, 0.0), d->names[crank + 1], 1.0);
    }
}

/* A binary tree of links of 1 m, each of which carries a row of three windows of 0.3 m. */
static void draw_branches(drawing *d, int links, bool open) {
    enum { WINDOWS = 3, BARS = 2 * WINDOWS + 2 };
    const double lean = -0.5, size = 0.3;
    for (int l = 0; l < links; l++) {
        const char *parent = l ? d->names[(l - 1) / 2 * BARS] : NULL;
        const double angle = l % 2 ? 0.5 : -0.5;
        const char *link = add_bar(d, "link", l, parent, along(l ? 1.0 : 0.0, 0.0), along(1.0, 0.0), angle, 0.1);
        const char *crank = add_bar(d, "crank", l, link, along(0.0, 0.0), along(0.0, size), lean, 0.3);
        for (int i = 1; i <= WINDOWS; i++) {
            (void)add_bar(d, "coupler", WINDOWS * l + i, crank, along(0.0, size), along(size, 0.0), -lean, -0.3);
            crank = add_bar(d, "next", WINDOWS * l + i, link, along(i * size, 0.0), along(0.0, size), lean, 0.3);
        }
    }
    for (int i = 0; i < WINDOWS * links && !open; i++) {
        const int coupler = i / WINDOWS * BARS + 2 * (i % WINDOWS + 1);
        close_window(d, d->names[coupler], along(size, 0.0), d->names[coupler + 1], size);
    }
}

/* The pivot of a crank: a metre further at every fork. */
static kt_vec3 fork_pivot(int crank) {
    int level = 1;
    while (2 * level <= crank + 1)
        level *= 2;
    return along(log2(level), 5.0 * (crank + 1 - level) / level);
}

/* A row that forks: crank i ends a window that begins with crank (i - 1) / 2. */
static void draw_fork(drawing *d, int windows, bool open) {
    const double lean = -0.5, rate = -1.0;
    (void)add_bar(d, "crank", 0, NULL, along(0.0, 0.0), along(0.0, 1.0), lean, rate);
    for (int i = 1; i <= windows; i++) {
        const int from = (i - 1) / 2;
        const kt_vec3 to = kt_vec3_sub(fork_pivot(i), fork_pivot(from));
        (void)add_bar(d, "coupler", i, d->names[2 * from], along(0.0, 1.0), to, -lean, -rate);
        (void)add_bar(d, "crank", i, NULL, fork_pivot(i), along(0.0, 1.0), lean, rate);
    }
    for (int i = 1; i <= windows && !open; i++)
        close_window(d, d->names[2 * i - 1], kt_vec3_sub(fork_pivot(i), fork_pivot((i - 1) / 2)), d->names[2 * i], 1.0);
}

/* A row of windows of five bars, each of which adds a degree of freedom: the coupler is two bars of 0.6 m. */
static void draw_freer(drawing *d, int windows, bool open) {
    const double lean = -0.5, rate = -1.0, rise = acos(0.5 / 0.6);
    const char *crank = add_bar(d, "crank", 0, NULL, along(0.0, 0.0), along(0.0, 1.0), lean, rate);
    for (int i = 1; i <= windows; i++) {
        const char *half = add_bar(d, "half", i, crank, along(0.0, 1.0), along(0.6, 0.0), rise - lean, 0.1 * (i % 5));
        (void)add_bar(d, "other", i, half, along(0.6, 0.0), along(0.6, 0.0), -2.0 * rise, 0.0);
        crank = add_bar(d, "crank", i, NULL, along(i, 0.0), along(0.0, 1.0), lean, rate);
    }
    for (int i = 1; i <= windows && !open; i++)
        close_window(d, d->names[3 * i - 1], along(0.6, 0.0), d->names[3 * i], 1.0);
}

/* A crank of a row in space at its start: the axes of its pivot and tip, and the direction to the next pivot. */
typedef struct space_crank {
    kt_vec3 pivot, axis, tip, tip_axis, next;
} space_crank;

/* u turned about the unit vector e. */
static kt_vec3 turned(kt_vec3 u, kt_vec3 e, double angle) {
    const kt_vec3 out = kt_vec3_add(kt_vec3_scale(cos(angle), u), kt_vec3_scale(sin(angle), kt_vec3_cross(e, u)));
    return kt_vec3_add(out, kt_vec3_scale((1.0 - cos(angle)) * kt_vec3_dot(e, u), e));
}

/* All axes meet in the world's origin. */
static space_crank spherical_crank(int i) {
    const double longitude = 0.35 * i, south = i % 2 ? 0.1 : -0.1, north = 0.9 + 0.05 * (i % 3);
    const kt_vec3 p = {cos(south) * cos(longitude), cos(south) * sin(longitude), sin(south)};
    const kt_vec3 t = {cos(north) * cos(longitude + 0.2), cos(north) * sin(longitude + 0.2), sin(north)};
    return (space_crank){.pivot = p, .axis = p, .tip = t, .tip_axis = t};
}

/* The axes of a crank are a apart and turned by alpha. The axes of a coupler, and those of two pivots, are b apart and
 * turned by beta. They satisfy a / sin(alpha) = b / sin(beta). Let g be the angle of a crank against the direction to
 * its neighbour, and g' the angle of the neighbour:
 *     tan(g'/2) = -k tan(g/2),  k = sin((beta + alpha)/2) / sin((beta - alpha)/2)
 * At tan(g/2) = 1/sqrt(k) both are equally fast. */
static space_crank bennett_crank(int i, const space_crank *last) {
    const double alpha = 0.5, beta = 1.1, a = 1.0, b = a * sin(beta) / sin(alpha);
    const double k = sin(0.5 * (beta + alpha)) / sin(0.5 * (beta - alpha)), g = 2.0 * atan(1.0 / sqrt(k));
    const double here = i ? -2.0 * atan(sqrt(k)) : g;
    space_crank c = {.axis = {0.0, 0.0, 1.0}, .next = {1.0, 0.0, 0.0}};
    if (i) {
        c.pivot = kt_vec3_add(last->pivot, kt_vec3_scale(b, last->next));
        c.axis = turned(last->axis, last->next, beta);
        c.next = turned(last->next, c.axis, here - g);
    }
    const kt_vec3 u = turned(c.next, c.axis, g);
    c.tip = kt_vec3_add(c.pivot, kt_vec3_scale(a, u));
    c.tip_axis = turned(c.axis, u, alpha);
    return c;
}

static space_crank next_crank(kt_bars_shape shape, int i, const space_crank *last) {
    return shape == KT_BARS_BENNETT ? bennett_crank(i, last) : spherical_crank(i);
}

/* The frames of all bars are the world's at first. */
static void draw_space_row(drawing *d, kt_bars_shape shape, int windows, bool open) {
    space_crank last = {.next = {0.0, 0.0, 0.0}}, now = last;
    for (int i = 0; i <= windows; i++, last = now) {
        now = next_crank(shape, i, &last);
        if (i) {
            (void)add_bar(d, "coupler", i, d->names[2 * i - 2], kt_vec3_sub(last.tip, last.pivot),
                          kt_vec3_sub(now.tip, last.tip), 0.0, 0.0);
            turn_last(d, KT_JOINT_REVOLUTE, last.tip_axis, 0.0);
        }
        (void)add_bar(d, "crank", i, NULL, now.pivot, kt_vec3_sub(now.tip, now.pivot), 0.0, i ? 0.0 : 1.0);
        turn_last(d, KT_JOINT_REVOLUTE, now.axis, 0.0);
    }
    for (int i = 0; i <= windows && !open; i++, last = now) {
        now = next_crank(shape, i, &last);
        if (!i)
            continue;
        add_loop(d, d->names[2 * i - 1], kt_vec3_sub(now.tip, last.tip), d->names[2 * i],
                 kt_vec3_sub(now.tip, now.pivot));
        d->loops[i - 1].axis = now.tip_axis;
    }
}

static void draw(kt_bars_shape shape, int n, bool open, drawing *d) {
    switch (shape) {
    case KT_BARS_SEPARATE:
        draw_separate(d, n, open);
        break;
    case KT_BARS_CHAINED:
        draw_chained(d, n, open);
        break;
    case KT_BARS_ROW:
        draw_row(d, n);
        break;
    case KT_BARS_SCISSORS:
        draw_scissors(d, n, open);
        break;
    case KT_BARS_LADDER:
        draw_net(d, 2, n, true, open);
        break;
    case KT_BARS_NET:
        draw_net(d, 3, n, false, open);
        break;
    case KT_BARS_GRID:
        draw_grid(d, 3, n, open);
        break;
    case KT_BARS_BRANCHES:
        draw_branches(d, n, open);
        break;
    case KT_BARS_FORK:
        draw_fork(d, n, open);
        break;
    case KT_BARS_FREER:
        draw_freer(d, n, open);
        break;
    case KT_BARS_SPHERICAL:
    case KT_BARS_BENNETT:
        draw_space_row(d, shape, n, open);
        break;
    default:
        draw_rope(d, shape, n, open);
        break;
    }
}

static kt_status compile(kt_bars_shape shape, bool open, kt_formulation formulation, const kt_model_options *options,
                         drawing *d, kt_bars *bars, kt_error *error) {
    const double start = kt_bench_clock();
    draw(shape, bars->loops, open, d);
    kt_description description = kt_description_default();
    description.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    description.bodies = d->bodies;
    description.body_count = d->body_count;
    description.loops = d->loops;
    description.loop_count = d->loop_count;
    kt_status status = kt_model_compile(&description, options, &bars->model, error);
    if (status == KT_OK && formulation == KT_FORMULATION_ABSOLUTE)
        status = kt_absolute_create(&description, options, bars->model, &bars->absolute, error);
    bars->set_up = kt_bench_clock() - start;
    return status;
}

static kt_status prepare(kt_bars *bars, kt_error *error) {
    bars->stepped = bars->absolute ? kt_absolute_model(bars->absolute) : bars->model;
    const size_t nq = (size_t)kt_model_nq(bars->stepped), nv = (size_t)kt_model_nv(bars->stepped);
    const kt_status status = kt_data_create(bars->stepped, &bars->data, error);
    if (status != KT_OK)
        return status;
    bars->q = calloc(nq, sizeof *bars->q);
    bars->v = calloc(nv, sizeof *bars->v);
    bars->a = calloc(nv, sizeof *bars->a);
    bars->moved = calloc(nq + 2 * nv, sizeof *bars->moved);
    if (!bars->q || !bars->v || !bars->a || !bars->moved)
        return kt_error_set(error, KT_ERROR_MEMORY, "", "no memory for the states");
    kt_model_initial(bars->stepped, bars->q, bars->v);
    return kt_state_assemble(bars->stepped, bars->data, 0.0, bars->q, bars->v, error);
}

kt_status kt_bars_make(kt_bars_shape shape, int loops, bool open, kt_formulation formulation,
                       const kt_model_options *options, kt_bars *bars, kt_error *error) {
    const size_t most = 8 * (size_t)loops + 3, closed = 3 * (size_t)loops;
    drawing d = {.bodies = calloc(most, sizeof *d.bodies),
                 .loops = calloc(closed, sizeof *d.loops),
                 .names = calloc(most + closed, sizeof *d.names)};
    *bars = (kt_bars){.loops = loops};
    kt_status status = kt_error_set(error, KT_ERROR_MEMORY, "", "no memory for %d loops", loops);
    if (d.bodies && d.loops && d.names)
        status = compile(shape, open, formulation, options, &d, bars, error);
    free(d.bodies);
    free(d.loops);
    free(d.names);
    if (status == KT_OK)
        status = prepare(bars, error);
    if (status != KT_OK)
        kt_bars_free(bars);
    return status;
}

void kt_bars_free(kt_bars *bars) {
    free(bars->q);
    free(bars->v);
    free(bars->a);
    free(bars->moved);
    kt_data_free(bars->data);
    kt_absolute_free(bars->absolute);
    kt_model_free(bars->model);
    *bars = (kt_bars){.loops = 0};
}

void kt_bars_accelerate(void *bars, long repetitions) {
    kt_bars *b = bars;
    for (long k = 0; k < repetitions && b->error.code == KT_OK; k++)
        if (kt_acceleration_evaluate(b->stepped, b->data, 0.0, b->q, b->v, NULL, NULL, b->a, &b->error) != KT_OK)
            return;
}

/* The state, `far` away, in `moved`. */
static double *move(kt_bars *b, double far) {
    const size_t nq = (size_t)kt_model_nq(b->stepped), nv = (size_t)kt_model_nv(b->stepped);
    double *q = b->moved, *v = q + nq, *by = v + nv;
    for (size_t i = 0; i < nv; i++)
        by[i] = far * (double)((int)(i * 7 % 5) - 2);
    kt_position_add(b->stepped, b->q, by, q);
    memcpy(v, b->v, nv * sizeof *v);
    return q;
}

void kt_bars_project(void *bars, long repetitions) {
    kt_bars *b = bars;
    for (long k = 0; k < repetitions && b->error.code == KT_OK; k++) {
        double *q = move(b, 1e-6);
        if (kt_state_project(b->stepped, b->data, 0.0, q, q + kt_model_nq(b->stepped), NULL, &b->error) != KT_OK)
            return;
    }
}

void kt_bars_assemble(void *bars, long repetitions) {
    kt_bars *b = bars;
    for (long k = 0; k < repetitions && b->error.code == KT_OK; k++) {
        double *q = move(b, 1e-3);
        if (kt_state_assemble(b->stepped, b->data, 0.0, q, q + kt_model_nq(b->stepped), &b->error) != KT_OK)
            return;
    }
}

double kt_bars_idle_work(kt_bars *b) {
    const size_t n = (size_t)kt_model_nv(b->stepped);
    double *tau = calloc(2 * n, sizeof *tau), *bias = tau + n, work = 0.0, size = 0.0;
    kt_bars_accelerate(b, 1);
    if (!tau || b->error.code != KT_OK ||
        kt_dynamics_inverse(b->stepped, b->data, b->q, b->v, b->a, NULL, tau, &b->error) != KT_OK ||
        kt_dynamics_inverse(b->stepped, b->data, b->q, b->v, NULL, NULL, bias, &b->error) != KT_OK)
        size = (double)NAN;
    for (size_t i = 0; i < n && !isnan(size); i++) {
        work += b->v[i] * tau[i];
        size += fabs(b->v[i] * bias[i]);
    }
    free(tau);
    return fabs(work) / size;
}
