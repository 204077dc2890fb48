/* Generated C of mechanisms with loops against the library, which eliminates the loops in other ways. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "closed_tree.h"
#include "files/scene/collect.h"
#include "generated.h"

#include "kinetree/control.h"
#include "kinetree/joint.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/scene.h"
#include "kinetree/sensitivity.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EPS DBL_EPSILON

static const double length_of_step = 1e-4;

enum { EQUATIONS = 5 * 40, NQ = KT_TREE_NQ, NV = KT_TREE_NV };

/* Derivatives of a mechanism with more coordinates are files of many MB. Each third smaller one has them. */
enum { DIFFERENTIATED_MOST = 7, EACH = 3 };
static const unsigned plain_functions = KT_GENERATED_WITH_LOOPS & ~(unsigned)KT_CODEGEN_FORWARD_DERIVATIVES;

static int count_mechanisms(int usual) {
    const char *text = getenv("KT_MECHANISMS");
    return text != NULL ? (int)strtol(text, NULL, 10) : usual;
}

/* ---- comparisons ------------------------------------------------------------------------------------------------- */

typedef struct loop_comparison {
    kt_worst closed, open, equations, step, projected, derivatives, differences;
} loop_comparison;

static loop_comparison loop_comparison_make(void) {
    return (loop_comparison){kt_worst_make("accelerations of closed states"),
                             kt_worst_make("accelerations of open states"),
                             kt_worst_make("A a = right"),
                             kt_worst_make("steps"),
                             kt_worst_make("projection"),
                             kt_worst_make("derivatives"),
                             kt_worst_make("derivatives and differences")};
}

static void loop_comparison_check(const loop_comparison *c) {
    kt_check_worst(&c->closed);
    kt_check_worst(&c->open);
    kt_check_worst(&c->equations);
    kt_check_worst(&c->step);
    kt_check_worst(&c->projected);
    kt_check_worst(&c->derivatives);
    kt_check_worst(&c->differences);
}

/* The largest sum of the sizes of the terms of M a + h - tau - A' lambda. */
static double size_of_forces(const kt_tree *tree, const kt_tree_state *s, const double *a) {
    static double mass[NV * NV], matrix[EQUATIONS * NV];
    double h[NV], lambda[EQUATIONS], size = 1.0;
    const double zero[NV] = {0.0};
    const int rows = kt_model_mobility(tree->model).equations;
    kt_error error = {0};
    if (kt_dynamics_mass(tree->model, tree->data, s->q, mass, &error) != KT_OK ||
        kt_dynamics_inverse(tree->model, tree->data, s->q, s->v, zero, NULL, h, &error) != KT_OK ||
        kt_loop_equations(tree->model, tree->data, KT_CLOSED_NOW, s->q, s->v, matrix, NULL, NULL, NULL, &error) !=
            KT_OK ||
        kt_multiplier_evaluate(tree->model, tree->data, KT_CLOSED_NOW, s->q, s->v, s->tau, NULL, lambda, &error) !=
            KT_OK)
        return (double)INFINITY;
    for (int i = 0; i < tree->nv; i++) {
        double sum = fabs(h[i]) + fabs(s->tau[i]);
        for (int k = 0; k < tree->nv; k++)
            sum += fabs(mass[i + tree->nv * k] * a[k]);
        for (int r = 0; r < rows; r++)
            sum += fabs(matrix[r + rows * i] * lambda[r]);
        size = fmax(size, sum);
    }
    return size;
}

/* A bound of the change of accelerations by rounding, relative to the rounding. Each number of the state and of the
 * joint forces is changed by 1e-7. The sizes of the changes of accelerations are added, and divided by 1e-7. Forces are
 * relative to the sizes of their terms. */
static double sensitivity_of(const kt_tree *tree, const kt_tree_state *s, const double *a) {
    double most = 1.0, sum[NV] = {0.0};
    kt_error error = {0};
    const double size = size_of_forces(tree, s, a);
    for (int k = 0; k < 3 * tree->nv; k++) {
        kt_tree_state other = *s;
        double b[NV] = {0.0};
        const int i = k / 3;
        b[i] = k % 3 == 0 ? 1e-7 : 0.0;
        other.v[i] += k % 3 == 1 ? 1e-7 : 0.0;
        other.tau[i] += k % 3 == 2 ? 1e-7 * size : 0.0;
        kt_position_add(tree->model, s->q, b, other.q);
        if (kt_acceleration_evaluate(tree->model, tree->data, KT_CLOSED_NOW, other.q, other.v, other.tau, NULL, b,
                                     &error) != KT_OK)
            return (double)INFINITY;
        for (int n = 0; n < tree->nv; n++)
            sum[n] += fabs(b[n] - a[n]) / 1e-7;
    }
    for (int i = 0; i < tree->nv; i++)
        most = fmax(most, fmax(sum[i], fabs(a[i])));
    return most;
}

/* ---- functions of the file, now ---- */

static int forward_now(const kt_generated *g, const kt_tree_state *s, double *a) {
    return g->loops_have_time ? g->forward_at(g->model, KT_CLOSED_NOW, s->q, s->v, s->tau, a)
                              : g->forward(g->model, s->q, s->v, s->tau, a);
}

static int loops_now(const kt_generated *g, const kt_tree_state *s, double *phi, double *matrix, double *right) {
    return g->loops_have_time ? g->loops_at(g->model, KT_CLOSED_NOW, s->q, s->v, phi, matrix, right)
                              : g->loops(g->model, s->q, s->v, phi, matrix, right);
}

static int project_now(const kt_generated *g, double *q, double *v) {
    return g->loops_have_time ? g->project_at(g->model, KT_CLOSED_NOW, q, v, q, v) : g->project(g->model, q, v, q, v);
}

static int step_now(const kt_generated *g, int k, double *q, double *v, const double *tau) {
    kt_generated_step *const take[3] = {g->heun, g->rk4, g->semi_implicit};
    kt_generated_timed_step *const take_at[3] = {g->heun_at, g->rk4_at, g->semi_implicit_at};
    return g->loops_have_time ? take_at[k](g->model, KT_CLOSED_NOW, q, v, tau, length_of_step, q, v)
                              : take[k](g->model, q, v, tau, length_of_step, q, v);
}

/* ---- comparisons of functions ---- */

/* The file solves (A M^-1 A') lambda = b for m equations with Cholesky's factors, whose backward error is (m + 1) EPS
 * (Higham, Accuracy and Stability, 10.1). The condition is the inverse of the smallest direction. Errors of lambda are
 * relative to lambda, and to the terms of b: these make the parts of accelerations. Next to a singular position, the
 * library interpolates accelerations of open states. Returns false if the state is so near to a singular one that a
 * comparison has no meaning. */
static bool compare_accelerations(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, kt_worst *worst,
                                  loop_comparison *c, int n) {
    double a[NV], own[NV], phi[EQUATIONS], matrix[EQUATIONS * NV], right[EQUATIONS];
    kt_error error = {0};
    const kt_status status =
        kt_acceleration_evaluate(tree->model, tree->data, KT_CLOSED_NOW, s->q, s->v, s->tau, NULL, a, &error);
    kt_need_fine("accelerations", status, &error);
    const double most = sensitivity_of(tree, s, a);
    if (!(most < 5e7))
        return false;
    if (!kt_check_equal_int("forward", forward_now(g, s, own), 0) ||
        !kt_check_equal_int("loops", loops_now(g, s, phi, matrix, right), 0))
        return false;
    const int rows = kt_model_mobility(tree->model).rank;
    const double least = kt_closed_least_direction(tree, s, matrix, rows);
    if (worst == &c->open && least < 1e-3)
        return false;
    const double bound = 40.0 * EPS * most + (rows + 1) * EPS * kt_closed_largest_part(tree, s, a) / least;
    for (int i = 0; i < tree->nv; i++)
        kt_worst_near(worst, own[i], a[i], bound, "mechanism %d coordinate %d", n, i);
    if (g->acceleration(g->model, KT_CLOSED_NOW, s->q, s->v, NULL, s->tau, own) == 0)
        for (int i = 0; i < tree->nv; i++)
            kt_worst_near(worst, own[i], a[i], bound, "mechanism %d, with effects, coordinate %d", n, i);
    for (int r = 0; r < rows; r++) {
        double sum = 0.0, size = fabs(right[r]);
        for (int i = 0; i < tree->nv; i++) {
            sum += matrix[r + rows * i] * a[i];
            size += fabs(matrix[r + rows * i] * a[i]);
        }
        kt_worst_near(&c->equations, sum, right[r], 40.0 * EPS * (size + most), "mechanism %d equation %d", n, r);
    }
    return true;
}

/* The bound follows from the accelerations: velocities differ by h times their error. A projection divides the rounding
 * of phi by the size of a direction, which accelerations contain twice. */
static void compare_loop_steps(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, double most,
                               loop_comparison *c, int n) {
    const kt_method *const method[3] = {kt_method_find("heun"), kt_method_find("rk4"), NULL};
    const int nq = kt_model_nq(tree->model), count = nq + tree->nv;
    for (int k = 0; k < 3; k++) {
        double next[NQ + NV], own[NQ + NV];
        memcpy(own, s->q, (size_t)nq * sizeof *own);
        memcpy(own + nq, s->v, (size_t)tree->nv * sizeof *own);
        kt_generated_library_step(tree, method[k], KT_CLOSED_NOW, length_of_step, s, next);
        kt_need(kt_check_equal_int("step", step_now(g, k, own, own + nq, s->tau), 0));
        for (int i = 0; i < count; i++)
            kt_worst_near(&c->step, own[i], next[i], 8.0 * EPS * most, "mechanism %d method %d number %d", n, k, i);
    }
}

/* The length that residuals are relative to, in the file. */
static double length_of_loops(const kt_generated *g) {
    for (int i = 0; i < g->count; i++)
        if (strcmp(g->name[i], "loop_length") == 0)
            return g->standard[i];
    return (double)NAN;
}

/* A gap of 9 EPS of that length counts as closed. */
static void compare_projection(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, double most,
                               loop_comparison *c, int n) {
    const int nq = kt_model_nq(tree->model), count = nq + tree->nv;
    double next[NQ + NV], own[NQ + NV];
    kt_error error = {0};
    memcpy(next, s->q, (size_t)nq * sizeof *own);
    memcpy(next + nq, s->v, (size_t)tree->nv * sizeof *own);
    memcpy(own, next, (size_t)count * sizeof *own);
    if (kt_state_project(tree->model, tree->data, KT_CLOSED_NOW, next, next + nq, NULL, &error) != KT_OK ||
        !kt_check_equal_int("project", project_now(g, own, own + nq), 0))
        return;
    for (int i = 0; i < count; i++)
        kt_worst_near(&c->projected, own[i], next[i], 8.0 * EPS * most * (1.0 + length_of_loops(g)),
                      "mechanism %d number %d", n, i);
}

/* A central difference of the file's accelerations along a random direction, with the step h. */
static bool difference_now(const kt_generated *g, const kt_tree *tree, const kt_tree_state *s, const double *by,
                           double h, double *change) {
    double a[2][NV], dq[NV];
    for (int k = 0; k < 2; k++) {
        const double step = k == 0 ? -h : h;
        kt_tree_state other = *s;
        for (int i = 0; i < tree->nv; i++) {
            dq[i] = step * by[i];
            other.v[i] += step * by[tree->nv + i];
            other.tau[i] += step * by[2 * tree->nv + i];
        }
        kt_position_add(tree->model, s->q, dq, other.q);
        if (forward_now(g, &other, a[k]) != 0)
            return false;
    }
    for (int i = 0; i < tree->nv; i++)
        change[i] = (a[1][i] - a[0][i]) / (2.0 * h);
    return true;
}

/* Against the library, which differentiates other equations with dual numbers; and against differences of order four,
 * whose error two steps estimate. */
static void compare_loop_derivatives(const kt_generated *g, const kt_tree *tree, const kt_tree_state *s, double most,
                                     loop_comparison *c, kt_random *random, int n) {
    static double own[3 * NV * NV], right[3 * NV * NV];
    const int nv = tree->nv, square = nv * nv;
    double by[3 * NV], near[NV], far[NV], size = 1.0;
    kt_error error = {0};
    const int code = g->loops_have_time
                         ? g->forward_derivatives_at(g->model, KT_CLOSED_NOW, s->q, s->v, s->tau, own, own + square,
                                                     own + 2 * square)
                         : g->forward_derivatives(g->model, s->q, s->v, s->tau, own, own + square, own + 2 * square);
    const size_t bytes = kt_acceleration_work_size(tree->model);
    void *work = aligned_alloc(KT_ALIGNMENT, (bytes + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    const kt_status status =
        kt_acceleration_derivatives(tree->model, tree->data, work, bytes, KT_CLOSED_NOW, s->q, s->v, s->tau, NULL,
                                    right, right + square, right + 2 * square, &error);
    free(work);
    if (!kt_check_equal_int("forward_derivatives", code, 0) || status != KT_OK)
        return;
    for (int i = 0; i < 3 * square; i++)
        size = fmax(size, fabs(right[i]));
    for (int i = 0; i < 3 * square; i++)
        kt_worst_near(&c->derivatives, own[i], right[i], 200.0 * EPS * most * size, "mechanism %d entry %d", n, i);
    for (int i = 0; i < 3 * nv; i++)
        by[i] = kt_random_uniform(random, -1.0, 1.0);
    if (!difference_now(g, tree, s, by, 1e-4, near) || !difference_now(g, tree, s, by, 2e-4, far))
        return;
    for (int i = 0; i < nv; i++) {
        const double better = (4.0 * near[i] - far[i]) / 3.0, apart = fabs(near[i] - far[i]);
        double sum = 0.0;
        for (int k = 0; k < 3 * nv; k++)
            sum += own[(size_t)nv * (size_t)k + (size_t)i] * by[k];
        kt_worst_near(&c->differences, sum, better, 0.01 * apart + 1e4 * 40.0 * EPS * most, "mechanism %d entry %d", n,
                      i);
    }
}

/* A closed state some way from the first one, and the same state opened. Returns 1 if it was compared. */
static int compare_state(kt_generated *g, const kt_closed_tree *m, kt_random *random, loop_comparison *c, int n) {
    const kt_tree *tree = &m->tree;
    kt_tree_state s = m->state;
    double by[NV];
    kt_error error = {0};
    for (int i = 0; i < tree->nv; i++)
        by[i] = kt_random_uniform(random, -0.15, 0.15);
    kt_position_add(tree->model, m->state.q, by, s.q);
    if (kt_state_project(tree->model, tree->data, KT_CLOSED_NOW, s.q, s.v, NULL, &error) != KT_OK)
        return 0;
    if (!compare_accelerations(g, tree, &s, &c->closed, c, n))
        return 0;
    double a[NV];
    if (kt_acceleration_evaluate(tree->model, tree->data, KT_CLOSED_NOW, s.q, s.v, s.tau, NULL, a, &error) != KT_OK)
        return 0;
    const double most = sensitivity_of(tree, &s, a);
    compare_loop_steps(g, tree, &s, most, c, n);
    if (g->forward_derivatives != NULL || g->forward_derivatives_at != NULL)
        compare_loop_derivatives(g, tree, &s, most, c, random, n);
    for (int i = 0; i < tree->nv; i++) {
        by[i] = kt_random_uniform(random, -1e-3, 1e-3);
        s.v[i] += kt_random_uniform(random, -0.1, 0.1);
    }
    double q[NQ];
    memcpy(q, s.q, sizeof q);
    kt_position_add(tree->model, q, by, s.q);
    (void)compare_accelerations(g, tree, &s, &c->open, c, n);
    compare_projection(g, tree, &s, most, c, n);
    return 1;
}

/* Each type in a plane and in space, on trees with every type of joint, every second time with another loop. States
 * that are open show that the equations are those of the library, and not only their solutions. */
KT_TEST(generated_loops_agree_with_the_library) {
    kt_random random = kt_random_of_test();
    loop_comparison c = loop_comparison_make();
    static kt_generated g;
    static kt_closed_tree m;
    int compared = 0, formulas = 0, differentiated = 0, seen[KT_CLOSED_TYPES] = {0};
    kt_generated_need_compiler();
    for (int n = 0; n < count_mechanisms(KT_SHORT(1, 2) * KT_CLOSED_TYPES); n++) {
        if (!kt_closed_grow(&m, &random, n))
            continue;
        const bool differs = m.tree.nv <= DIFFERENTIATED_MOST && n % EACH == 0;
        kt_generated_make_some(&g, m.tree.model, differs ? KT_GENERATED_WITH_LOOPS : plain_functions, "cc -O0", false);
        differentiated += differs;
        for (int k = 0; k < 4; k++)
            seen[n % KT_CLOSED_TYPES] += compare_state(&g, &m, &random, &c, n);
        for (int k = 0; k < KT_CLOSED_LOOPS; k++)
            formulas += m.loop[k].formula != NULL;
    }
    loop_comparison_check(&c);
    kt_check_above("couplings with a formula", formulas, 1);
    kt_check_above("mechanisms with derivatives", differentiated, 1);
    for (int k = 0; k < KT_CLOSED_TYPES; k++) {
        char name[64];
        snprintf(name, sizeof name, "states with a loop of type %d", (int)kt_closed_types[k]);
        kt_check_above(name, seen[k], 1);
        compared += seen[k];
    }
    kt_check_above("states that were compared", compared, 2 * count_mechanisms(KT_SHORT(1, 2) * KT_CLOSED_TYPES));
}

/* Draws a mechanism whose loop has a form, and compares some states. Returns how many. */
static int compare_form(kt_loop_type type, int form, kt_random *random, loop_comparison *c) {
    static kt_generated g;
    static kt_closed_tree m;
    int compared = 0;
    if (!kt_closed_grow_form(&m, random, type, form))
        return 0;
    kt_generated_make_some(&g, m.tree.model, plain_functions, "cc -O0", false);
    for (int k = 0; k < 4; k++)
        compared += compare_state(&g, &m, random, c, 10 * (int)type + form);
    return compared;
}

/* Each form of the types that have forms, in space. Some draws have no state that can be compared. */
KT_TEST(generated_surfaces_curves_and_wheels_agree_with_the_library) {
    enum { DRAWS = 6 };
    kt_random random = kt_random_of_test();
    loop_comparison c = loop_comparison_make();
    kt_generated_need_compiler();
    for (int type = 0; type < KT_LOOP_TYPE_COUNT; type++)
        for (int form = 0; form < kt_closed_count_forms((kt_loop_type)type); form++) {
            int compared = 0;
            char name[64];
            for (int k = 0; k < DRAWS && compared == 0; k++)
                compared = compare_form((kt_loop_type)type, form, &random, &c);
            (void)snprintf(name, sizeof name, "states of form %d of type %d", form, type);
            kt_check_above(name, compared, 1);
        }
    kt_check_worst(&c.closed);
    kt_check_worst(&c.open);
    kt_check_worst(&c.equations);
    kt_check_worst(&c.step);
    kt_check_worst(&c.projected);
}

/* ---- parameters -------------------------------------------------------------------------------------------------- */

/* The number of a loop that a parameter represents; NULL: it is another parameter. */
static double *number_of_loop(kt_closed_tree *m, const char *name) {
    static const char *const prefix[KT_CLOSED_LOOPS] = {"lock_", "ring_2_"};
    for (int k = 0; k < m->tree.description.loop_count; k++) {
        kt_loop *loop = &m->loop[k];
        const size_t length = strlen(prefix[k]);
        if (strncmp(name, prefix[k], length) != 0)
            continue;
        const char *const what = name + length;
        double *const at[3] = {&loop->between[1].at.x, &loop->between[1].at.y, &loop->between[1].at.z};
        if (strncmp(what, "at2_", 4) == 0)
            return at[what[4] - 'x'];
        if (strcmp(what, "length") == 0 || strcmp(what, "position") == 0)
            return &loop->function.value;
        if (strcmp(what, "offset") == 0)
            return &loop->offset;
        if (strcmp(what, "rate") == 0 || strcmp(what, "distance") == 0)
            return &loop->function.value;
        if (strcmp(what, "pitch") == 0)
            return &loop->pitch;
        if (strcmp(what, "tube") == 0)
            return &loop->surface.tube;
        if (strcmp(what, "radius") == 0)
            return loop->type == KT_LOOP_ROLLING   ? &loop->radius
                   : loop->type == KT_LOOP_SURFACE ? &loop->surface.radius
                                                   : &loop->curve.radius;
        for (int i = 0; i < loop->term_count; i++)
            if (strcmp(what, m->term[k][i].joint) == 0)
                return &m->term[k][i].coefficient;
    }
    return NULL;
}

/* Moves the first ends of loops to the markers where they were. */
static void follow_markers(kt_closed_tree *m) {
    for (int k = 0; k < m->tree.description.loop_count; k++)
        for (int b = 0; b < m->tree.description.body_count && m->loop[k].between[0].body != NULL; b++)
            if (strcmp(m->tree.body[b].name, m->loop[k].between[0].body) == 0)
                m->loop[k].between[0].at = m->tree.body[b].markers[0].at;
}

/* Whether no pin of a planar tree leaves its plane, in which no motion can close it. */
static bool stays_in_plane(const kt_closed_tree *m) {
    for (int k = 0; k < m->tree.description.loop_count; k++) {
        kt_loop_motion motion;
        if (m->loop[k].terms != NULL || m->loop[k].joint != NULL || kt_vec3_norm(m->tree.normal) == 0.0)
            continue;
        kt_tree_kinematics(&m->tree, &m->state);
        if (!kt_loop_motion_evaluate(m->tree.model, m->tree.data, k, &motion))
            return false;
        const int body = kt_body_find(m->tree.model, m->loop[k].between[0].body);
        const kt_vec3 d = kt_mat3_apply(kt_body_pose(m->tree.model, m->tree.data, body).rotation, motion.position);
        if (fabs(kt_vec3_dot(d, m->tree.normal)) > 1e-12)
            return false;
    }
    return true;
}

/* Whether equations repeat others. If a parameter changes, they contradict each other, and any choice has another
 * result. */
static bool has_redundant_equations(const kt_closed_tree *m) {
    static double matrix[EQUATIONS * NV];
    const kt_mobility mobility = kt_model_mobility(m->tree.model);
    int count = 0;
    kt_error error = {0};
    kt_need_fine("equations",
                 kt_loop_equations(m->tree.model, m->tree.data, KT_CLOSED_NOW, m->state.q, m->state.v, matrix, NULL,
                                   NULL, NULL, &error),
                 &error);
    for (int r = 0; r < mobility.equations; r++) {
        double most = 0.0; /* 0: void */
        for (int i = 0; i < m->tree.nv; i++)
            most = fmax(most, fabs(matrix[r + mobility.equations * i]));
        count += most > 1e-9;
    }
    return count > mobility.rank;
}

/* Each parameter is changed alone, in the file and in the description. The loops are then open, by some per cent. */
KT_TEST(each_parameter_changes_the_loops_as_it_changes_the_mechanism) {
    kt_random random = kt_random_of_test();
    loop_comparison c = loop_comparison_make();
    static kt_generated g;
    static kt_closed_tree m;
    int changed = 0, of_loops = 0;
    kt_generated_need_compiler();
    for (int n = 0; n < count_mechanisms(KT_SHORT(3, KT_CLOSED_TYPES)); n++) {
        if (!kt_closed_grow(&m, &random, n + n % 2 * KT_CLOSED_TYPES)) /* in turns in a plane and in space */
            continue;
        kt_generated_make_some(&g, m.tree.model, plain_functions, "cc -O0", false);
        const uint64_t structure = kt_codegen_structure(m.tree.model);
        const bool decided = !has_redundant_equations(&m);
        for (int k = 0; k < g.count && decided; k++) {
            double parameter[KT_GENERATED_PARAMETERS];
            if (strcmp(g.name[k], "lock_angle") == 0 || strcmp(g.name[k], "ring_2_angle") == 0)
                continue; /* it follows from the given positions */
            if (strcmp(g.name[k], "loop_length") == 0)
                continue; /* it decides what counts as closed, and follows from all others in the library */
            double *of_loop = number_of_loop(&m, g.name[k]);
            double *number = of_loop != NULL ? of_loop : kt_generated_number(&m.tree, g.name[k]);
            if (number == NULL)
                break;
            const double before = *number;
            memcpy(parameter, g.standard, (size_t)g.count * sizeof *parameter);
            kt_check_near(g.name[k], parameter[k], before, 8.0 * EPS * (1.0 + fabs(before)));
            parameter[k] = *number = before * kt_random_uniform(&random, 1.01, 1.03);
            m.tree.description.inertia_check = KT_INERTIA_ACCEPT;
            follow_markers(&m);
            kt_tree_compile(&m.tree, NULL);
            if (kt_closed_is_generated(m.tree.model) && stays_in_plane(&m)) {
                kt_check_true("the structure is the same", kt_codegen_structure(m.tree.model) == structure);
                g.prepare(parameter, g.model);
                changed += compare_accelerations(&g, &m.tree, &m.state, &c.open, &c, n);
                of_loops += of_loop != NULL;
            }
            *number = before;
        }
    }
    kt_check_worst(&c.open);
    kt_check_worst(&c.equations);
    kt_check_above("parameters that were changed", changed, KT_SHORT(20, 100));
    kt_check_above("parameters of loops", of_loops, KT_SHORT(1, 10));
}

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

/* Compares scene n without its effects. Returns how many states were compared; -1: it is rejected. */
static int compare_scene(const char *name, int n, kt_random *random, loop_comparison *c) {
    static kt_generated g;
    static kt_closed_tree m;
    kt_error error = {0};
    int compared = -1;
    memset(&m, 0, sizeof m);
    kt_scene *scene = kt_test_bundled(name);
    scene->description.effect_count = 0;
    scene->description.state_count = 0;
    if (scene->description.loop_count > 0 &&
        kt_model_compile(&scene->description, NULL, &m.tree.model, &error) == KT_OK &&
        kt_data_create(m.tree.model, &m.tree.data, &error) == KT_OK && kt_closed_is_generated(m.tree.model)) {
        m.tree.nv = kt_model_nv(m.tree.model);
        kt_model_initial(m.tree.model, m.state.q, m.state.v);
        for (int i = 0; i < m.tree.nv; i++)
            m.state.tau[i] = kt_random_uniform(random, -1.0, 1.0);
        kt_need_fine(name,
                     kt_state_project(m.tree.model, m.tree.data, KT_CLOSED_NOW, m.state.q, m.state.v, NULL, &error),
                     &error);
        kt_generated_make_some(&g, m.tree.model,
                               m.tree.nv <= DIFFERENTIATED_MOST ? KT_GENERATED_WITH_LOOPS : plain_functions, "cc -O0",
                               false);
        compared = 0;
        for (int k = 0; k < 4; k++)
            compared += compare_state(&g, &m, random, c, n);
    }
    kt_data_free(m.tree.data);
    kt_model_free(m.tree.model);
    return compared;
}

/* Linkages whose equations repeat each other are among them: six bars in space (Bricard), and a Hooke's joint. */
KT_TEST(generated_scenes_with_loops_agree_with_the_library) {
    kt_random random = kt_random_of_test();
    loop_comparison c = loop_comparison_make();
    int generated = 0, lost = 0; /* lost: that of a rotor whose blades are light */
    kt_generated_need_compiler();
    for (int i = 0; kt_bundled(i) != NULL; i += KT_SHORT(8, 1)) {
        const int compared = compare_scene(kt_bundled(i), i, &random, &c);
        if (compared >= 0) {
            if (compared == 0)
                kt_note("%s: its states are too sensitive for a comparison", kt_bundled(i));
            lost += compared == 0;
            generated++;
        }
    }
    kt_check_above("scenes", generated, KT_SHORT(1, 15));
    kt_check_below("scenes without a comparison", lost, 1);
    loop_comparison_check(&c);
}
