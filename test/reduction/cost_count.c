/* cost_count WHAT N [spatial]: calls one thing once, on N four-bars that hang on a chain of N bodies, for cost.py to
 * count its instructions. WHAT: four-bars, derivatives (of the same), tree (the same without loops), or chain (N bodies alone, from nearly
 * horizontal, linearised and then brought to rest), or ladder (two chains of N bodies, rungs and loops between them), or row (N windows that share their cranks),
 * or open (N bodies alone), held (the same with the last tied up) or driven (and with the first moved). */
#include "kinetree/analysis.h"
#include "kinetree/reduction.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 400 };

static kt_body bodies[4 * MOST];
static kt_loop loops[MOST];
static char names[4 * MOST][16], loop_names[MOST][16];

static const char *add(int i, const char *kind, int n, const char *parent, double x, double length, double angle) {
    snprintf(names[i], sizeof names[i], "%s%d", kind, n);
    bodies[i] = kt_body_default();
    bodies[i].name = names[i];
    bodies[i].parent = parent;
    bodies[i].joint.type = KT_JOINT_REVOLUTE;
    bodies[i].joint.at = kt_vec3_make(x, 0.0, 0.0);
    bodies[i].joint.position[0] = angle;
    bodies[i].mass = 1.0;
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

static void close_loop(int i, const char *first, double x, const char *second, double y) {
    snprintf(loop_names[i], sizeof loop_names[i], "loop%d", i);
    loops[i] = kt_loop_default();
    loops[i].name = loop_names[i];
    loops[i].type = KT_LOOP_REVOLUTE;
    loops[i].between[0] = end_at(first, x);
    loops[i].between[1] = end_at(second, y);
}

/* A rope of n bodies: its loops, none of them, the tie, or the tie and the motion of its first joint. */
static int hang_rope(const char *kind, int n) {
    static const double turns[] = {1.0, 0.5, 2.0};
    const char *link = NULL;
    for (int i = 0; i < n; i++)
        link = add(i, "link", i, link, i ? 1.0 : 0.0, 1.0, i ? -2.0 / n : 1.0);
    if (strcmp(kind, "open") == 0)
        return 0;
    close_loop(0, link, 1.0, NULL, 0.8 * n);
    if (strcmp(kind, "driven") != 0)
        return 1;
    loops[1] = kt_loop_default();
    loops[1].name = "motion";
    loops[1].type = KT_LOOP_MOTION;
    loops[1].joint = names[0];
    loops[1].function = kt_function_polynomial(turns, 3);
    return 2;
}

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

int main(int argc, char **argv) {
    const int n = argc > 2 ? (int)strtol(argv[2], NULL, 10) : 0;
    if (n < 1 || n > MOST)
        return 1;
    kt_description d = kt_description_default();
    kt_model_options options = kt_model_options_default();
    const char *link = NULL;
    const bool chain = strcmp(argv[1], "chain") == 0, ladder = strcmp(argv[1], "ladder") == 0;
    const bool row = strcmp(argv[1], "row") == 0;
    const bool rope = strcmp(argv[1], "open") == 0 || strcmp(argv[1], "held") == 0 || strcmp(argv[1], "driven") == 0;
    const char *other = NULL;
    for (int i = 0; i < n && ladder; i++) {
        link = add(3 * i, "left", i, link, i ? 0.3 : 0.0, 0.3, i ? 0.0 : 0.1);
        other = add(3 * i + 1, "right", i, other, i ? 0.3 : 0.0, 0.3, i ? 0.0 : 0.1);
        bodies[3 * i + 1].joint.at.y = i ? 0.0 : 1.0;
        const char *rung = add(3 * i + 2, "rung", i, link, 0.3, 1.0, 1.5707963267948966 - 0.1);
        close_loop(i, rung, 1.0, other, 0.3);
    }
    for (int i = 0; i < n && chain; i++)
        link = add(i, "link", i, link, i ? 1.0 : 0.0, 1.0, i ? 0.0 : 0.35);
    for (int i = 0; i < n && row; i++) {
        link = add(2 * i, "crank", i, NULL, i, 1.0, 1.0);
        const char *coupler = i + 1 < n ? add(2 * i + 1, "coupler", i, link, 1.0, 1.0, -1.0) : NULL;
        if (coupler)
            close_loop(i, coupler, 1.0, names[2 * i + 2], 1.0);
    }
    const int tied = rope ? hang_rope(argv[1], n) : 0;
    for (int i = 0; i < n && !chain && !ladder && !row && !rope; i++) {
        link = add(4 * i, "link", i, link, i ? 0.3 : 0.0, 0.3, 0.1);
        const char *crank = add(4 * i + 1, "crank", i, link, 0.0, 1.0, 1.0);
        const char *coupler = add(4 * i + 2, "coupler", i, crank, 1.0, 2.0, -0.6);
        const char *rocker = add(4 * i + 3, "rocker", i, link, 2.2, 1.8, 1.6);
        close_loop(i, coupler, 2.0, rocker, 1.8);
    }
    d.bodies = bodies;
    d.body_count = chain || rope ? n : ladder ? 3 * n : row ? 2 * n - 1 : 4 * n;
    d.loops = loops;
    d.loop_count = rope ? tied : chain || strcmp(argv[1], "tree") == 0 ? 0 : row ? n - 1 : n;
    d.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    options.plan = argc > 3 ? KT_PLAN_SPATIAL : KT_PLAN_AUTO;
    options.level = KT_ISA_BASE; /* valgrind knows no AVX-512 */
    kt_model *model = NULL;
    kt_data *data = NULL;
    kt_error error;
    static double q[4 * MOST], v[4 * MOST], a[4 * MOST];
    static kt_wrench joint[4 * MOST + 1], reaction[MOST];
    if (kt_model_compile(&d, &options, &model, &error) != KT_OK || kt_data_create(model, &data, &error) != KT_OK)
        return 1;
    kt_model_initial(model, q, v);
    if (chain && !come_to_rest(model, q, v))
        return 1;
    const int failed =
        kt_state_assemble(model, data, 0.0, q, v, &error) != KT_OK ||
        kt_acceleration_evaluate(model, data, 0.0, q, v, NULL, NULL, a, &error) != KT_OK ||
        (ladder && kt_reaction_evaluate(model, data, 0.0, q, v, NULL, NULL, joint, reaction, &error) != KT_OK);
    for (int i = 0; i < 4 * n; i++)
        q[i] += 1e-6;
    const int open = kt_state_project(model, data, 0.0, q, v, NULL, &error) != KT_OK;
    const bool derived = strcmp(argv[1], "derivatives") != 0 || differentiate(model, data, q, v);
    kt_data_free(data);
    kt_model_free(model);
    return failed || open || !derived;
}
