/* `cost_count TASK N [spatial]` runs one task once, on a mechanism of N parts. cost.py counts its instructions. TASK is
 * a name in the table `scenes`. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "describe.h"

#include "kinetree/analysis.h"
#include "kinetree/control.h"
#include "kinetree/sensitivity.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 400 };

static kt_body bodies[4 * MOST];
static kt_loop loops[MOST];
static int loop_count;
static char names[4 * MOST][16], loop_names[MOST][16];

static const char *add(int i, const char *kind, int n, const char *parent, double x, double length, double angle) {
    snprintf(names[i], sizeof names[i], "%s%d", kind, n);
    bodies[i] = kt_body_of(names[i], parent, KT_JOINT_REVOLUTE, 1.0);
    bodies[i].joint.at = kt_vec3_make(x, 0.0, 0.0);
    bodies[i].joint.position[0] = angle;
    bodies[i].com = kt_vec3_make(0.5 * length, 0.0, 0.0);
    bodies[i].inertia = kt_sym3_make(0.01, 0.1, 0.1, 0.0, 0.0, 0.0);
    return names[i];
}

static kt_end end_at(const char *body, double x) {
    kt_end end = kt_end_default();
    end.body = body;
    end.at = kt_vec3_make(x, 0.0, 0.0);
    return end;
}

static void close_loop(const char *first, double x, const char *second, double y) {
    const int i = loop_count++;
    snprintf(loop_names[i], sizeof loop_names[i], "loop%d", i);
    loops[i] = kt_loop_of(loop_names[i], KT_LOOP_REVOLUTE);
    loops[i].between[0] = end_at(first, x);
    loops[i].between[1] = end_at(second, y);
}

/* ---- mechanisms: each writes n of its parts and returns the number of bodies ------------------------------------- */

/* N four-bars that hang on a chain of N bodies. */
static int build_tree(int n) {
    const char *link = NULL;
    for (int i = 0; i < n; i++) {
        link = add(4 * i, "link", i, link, i ? 0.3 : 0.0, 0.3, 0.1);
        const char *crank = add(4 * i + 1, "crank", i, link, 0.0, 1.0, 1.0);
        (void)add(4 * i + 2, "coupler", i, crank, 1.0, 2.0, -0.6);
        (void)add(4 * i + 3, "rocker", i, link, 2.2, 1.8, 1.6);
    }
    return 4 * n;
}

static int build_four_bars(int n) {
    const int bodies_built = build_tree(n);
    for (int i = 0; i < n; i++)
        close_loop(names[4 * i + 2], 2.0, names[4 * i + 3], 1.8);
    return bodies_built;
}

/* Bodies alone, from nearly horizontal. */
static int build_chain(int n) {
    const char *link = NULL;
    for (int i = 0; i < n; i++)
        link = add(i, "link", i, link, i ? 1.0 : 0.0, 1.0, i ? 0.0 : 0.35);
    return n;
}

/* Two chains, with rungs and loops between them. */
static int build_ladder(int n) {
    const char *left = NULL, *right = NULL;
    for (int i = 0; i < n; i++) {
        left = add(3 * i, "left", i, left, i ? 0.3 : 0.0, 0.3, i ? 0.0 : 0.1);
        right = add(3 * i + 1, "right", i, right, i ? 0.3 : 0.0, 0.3, i ? 0.0 : 0.1);
        bodies[3 * i + 1].joint.at.y = i ? 0.0 : 1.0;
        close_loop(add(3 * i + 2, "rung", i, left, 0.3, 1.0, 1.5707963267948966 - 0.1), 1.0, right, 0.3);
    }
    return 3 * n;
}

/* Windows that share their cranks. */
static int build_row(int n) {
    for (int i = 0; i < n; i++) {
        const char *crank = add(2 * i, "crank", i, NULL, i, 1.0, 1.0);
        if (i > 0)
            close_loop(names[2 * i - 1], 1.0, crank, 1.0);
        if (i + 1 < n)
            (void)add(2 * i + 1, "coupler", i, crank, 1.0, 1.0, -1.0);
    }
    return 2 * n - 1;
}

/* A rope; with its last body tied up; and with its first joint moved, too. */
static int build_open(int n) {
    const char *link = NULL;
    for (int i = 0; i < n; i++)
        link = add(i, "link", i, link, i ? 1.0 : 0.0, 1.0, i ? -2.0 / n : 1.0);
    return n;
}

static int build_held(int n) {
    (void)build_open(n);
    close_loop(names[n - 1], 1.0, NULL, 0.8 * n);
    return n;
}

static int build_driven(int n) {
    static const double turns[] = {1.0, 0.5, 2.0};
    (void)build_held(n);
    kt_loop *motion = &loops[loop_count++];
    *motion = kt_loop_of("motion", KT_LOOP_MOTION);
    motion->joint = names[0];
    motion->function = kt_function_polynomial(turns, 3);
    return n;
}

/* ---- what is called ---------------------------------------------------------------------------------------------- */

/* Linearisation at the start, and the equilibrium from there. */
static bool come_to_rest(const kt_model *model, double *q, const double *v) {
    kt_linearization *l = NULL;
    kt_error error;
    const bool done = kt_linearization_create(model, NULL, &l, &error) == KT_OK &&
                      kt_linearization_evaluate(l, 0.0, q, v, NULL, &error) == KT_OK &&
                      kt_equilibrium_find(l, NULL, 0.0, q, NULL, NULL, &error) == KT_OK;
    kt_linearization_free(l);
    return done;
}

static bool differentiate(const kt_model *model, kt_data *data, const double *q, const double *v) {
    const size_t nv = (size_t)kt_model_nv(model), size = kt_acceleration_work_size(model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    double *out = calloc(3 * nv * nv, sizeof *out);
    kt_error error;
    const bool done = work && out &&
                      kt_acceleration_derivatives(model, data, work, size, 0.0, q, v, NULL, NULL, out, out + nv * nv,
                                                  out + 2 * nv * nv, &error) == KT_OK;
    free(work);
    free(out);
    return done;
}

/* Matrices of f x nv and of f x f, f <= nv. */
static bool stiffen(const kt_model *model, kt_data *data, const double *q, const double *v) {
    const size_t nv = (size_t)kt_model_nv(model), size = kt_stiffness_work_size(model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    double *out = calloc(4 * nv * nv, sizeof *out);
    kt_error error;
    const bool done = work && out &&
                      kt_stiffness_evaluate(model, data, work, size, 0.0, q, v, NULL, NULL, NULL, out, out + nv * nv,
                                            out + 2 * nv * nv, out + 3 * nv * nv, &error) == KT_OK;
    free(work);
    free(out);
    return done;
}

/* The terms, and eight columns. */
static bool invert(const kt_model *model, kt_data *data, const double *q, const double *v) {
    double *x = calloc(8 * (size_t)kt_model_nv(model), sizeof *x);
    kt_mass_inverse *inverse = NULL;
    kt_error error;
    (void)v;
    const bool done = x && kt_mass_inverse_create(model, 0, &inverse, &error) == KT_OK &&
                      kt_mass_inverse_compute(inverse, data, 0.0, q, &error) == KT_OK &&
                      kt_mass_inverse_apply(inverse, 8, x, &error) == KT_OK;
    kt_mass_inverse_free(inverse);
    free(x);
    return done;
}

/* A and B of a step. */
static bool step(const kt_model *model, kt_data *data, const double *q, const double *v) {
    const kt_step one = {.method = kt_method_find("rk4"), .h = 1e-4};
    const size_t nv = (size_t)kt_model_nv(model), size = kt_step_work_size(model, one.method);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    double *out = calloc(6 * nv * nv, sizeof *out);
    kt_error error;
    const bool done =
        work && out &&
        kt_step_derivatives(model, data, work, size, &one, q, v, NULL, NULL, out, out + 4 * nv * nv, &error) == KT_OK;
    free(work);
    free(out);
    return done;
}

static bool react(const kt_model *model, kt_data *data, const double *q, const double *v) {
    static kt_wrench joint[4 * MOST + 1], reaction[MOST];
    kt_error error;
    return kt_reaction_evaluate(model, data, 0.0, q, v, NULL, NULL, joint, reaction, &error) == KT_OK;
}

typedef struct scene {
    const char *name;
    int (*build)(int n);
    bool comes_to_rest; /* it is linearised and brought to rest first */
    bool (*then)(const kt_model *model, kt_data *data, const double *q, const double *v); /* NULL: no more */
} scene;

static const scene scenes[] = {
    {"four-bars", build_four_bars, false, NULL},
    {"derivatives", build_four_bars, false, differentiate},
    {"stiffness", build_four_bars, false, stiffen},
    {"inverse", build_four_bars, false, invert},
    {"step", build_four_bars, false, step},
    {"tree", build_tree, false, NULL},
    {"chain", build_chain, true, NULL},
    {"ladder", build_ladder, false, react},
    {"row", build_row, false, NULL},
    {"open", build_open, false, NULL},
    {"held", build_held, false, NULL},
    {"driven", build_driven, false, NULL},
};

/* Assembles, evaluates and projects once. */
static bool call(const scene *s, const kt_model *model, kt_data *data) {
    static double q[4 * MOST], v[4 * MOST], a[4 * MOST];
    kt_error error;
    kt_model_initial(model, q, v);
    if ((s->comes_to_rest && !come_to_rest(model, q, v)) ||
        kt_state_assemble(model, data, 0.0, q, v, &error) != KT_OK ||
        kt_acceleration_evaluate(model, data, 0.0, q, v, NULL, NULL, a, &error) != KT_OK)
        return false;
    if (s->then && !s->then(model, data, q, v))
        return false;
    for (int i = 0; i < kt_model_nq(model); i++)
        q[i] += 1e-6;
    return kt_state_project(model, data, 0.0, q, v, NULL, &error) == KT_OK;
}

int main(int argc, char **argv) {
    const int n = argc > 2 ? (int)strtol(argv[2], NULL, 10) : 0;
    const scene *s = scenes, *const end = scenes + sizeof scenes / sizeof scenes[0];
    while (s < end && argc > 1 && strcmp(argv[1], s->name) != 0)
        s++;
    if (s == end || n < 1 || n > MOST)
        return 1;
    kt_model_options options = kt_model_options_default();
    kt_model *model = NULL;
    kt_data *data = NULL;
    kt_error error;
    const int count = s->build(n); /* counts loops, too */
    kt_description d = kt_description_of(bodies, count, loops, loop_count, NULL, 0);
    d.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    options.plan = argc > 3 ? KT_PLAN_SPATIAL : KT_PLAN_AUTO;
    options.isa = KT_ISA_BASE; /* valgrind lacks AVX-512 */
    const bool done = kt_model_compile(&d, &options, &model, &error) == KT_OK &&
                      kt_data_create(model, &data, &error) == KT_OK && call(s, model, data);
    kt_data_free(data);
    kt_model_free(model);
    return !done;
}
