/* Bars on revolute joints about z, 1 kg a metre, in gravity along -y. */
#include "bars.h"

#include "bench.h"
#include "kinetree/dynamics.h"
#include "kinetree/simulation.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const kt_bars_shape_name[KT_BARS_SHAPES] = {"separate", "chained", "row"};

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

/* A link of the chain carries a four-bar of 1, 2, 1.8 and 2.2 m. */
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

static kt_status compile(kt_bars_shape shape, bool open, kt_formulation formulation, const kt_model_options *options,
                         drawing *d, kt_bars *bars, kt_error *error) {
    const double start = kt_bench_clock();
    if (shape == KT_BARS_SEPARATE)
        draw_separate(d, bars->loops, open);
    else if (shape == KT_BARS_ROW)
        draw_row(d, bars->loops);
    else
        draw_chained(d, bars->loops, open);
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
    if (!bars->q || !bars->v || !bars->a)
        return kt_error_set(error, KT_ERROR_MEMORY, "", "no memory for the states");
    kt_model_initial(bars->stepped, bars->q, bars->v);
    return kt_state_assemble(bars->stepped, bars->data, 0.0, bars->q, bars->v, error);
}

kt_status kt_bars_make(kt_bars_shape shape, int loops, bool open, kt_formulation formulation,
                       const kt_model_options *options, kt_bars *bars, kt_error *error) {
    const size_t most = 4 * (size_t)loops + 1;
    drawing d = {.bodies = calloc(most, sizeof *d.bodies),
                 .loops = calloc((size_t)loops, sizeof *d.loops),
                 .names = calloc(most + (size_t)loops, sizeof *d.names)};
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
