/* Generated C of mechanisms with loops against the library, which eliminates the loops in other ways. */
#define _XOPEN_SOURCE 700
#include "../scene_files.h"
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

static const double now = 0.3; /* the time of all states */
static const double length_of_step = 1e-4;

enum { LOOPS = 2, EQUATIONS = 5 * 40, NQ = KT_TREE_NQ, NV = KT_TREE_NV };

/* Derivatives of a mechanism with more coordinates are files of many MB. Each third smaller one has them. */
enum { DIFFERENTIATED_MOST = 7, EACH = 3 };
static const unsigned plain_functions = KT_GENERATED_WITH_LOOPS & ~(unsigned)KT_CODEGEN_FORWARD_DERIVATIVES;

static int count_mechanisms(int usual) {
    const char *text = getenv("KT_MECHANISMS");
    return text != NULL ? (int)strtol(text, NULL, 10) : usual;
}

/* ---- random mechanisms ------------------------------------------------------------------------------------------- */

/* A tree with loops that close in one state. */
typedef struct closed_tree {
    kt_tree tree;
    kt_loop loop[LOOPS];
    kt_term term[LOOPS][2];
    char formula[LOOPS][160];
    kt_tree_state state;
} closed_tree;

/* The types of the first loop, in turn. */
static const kt_loop_type loop_types[] = {KT_LOOP_SPHERICAL, KT_LOOP_REVOLUTE,   KT_LOOP_DISTANCE,    KT_LOOP_COUPLING,
                                          KT_LOOP_INLINE,    KT_LOOP_INPLANE,    KT_LOOP_PARALLEL,    KT_LOOP_COAXIAL,
                                          KT_LOOP_WELD,      KT_LOOP_ORTHOGONAL, KT_LOOP_CYLINDRICAL, KT_LOOP_PLANAR,
                                          KT_LOOP_PRISMATIC, KT_LOOP_UNIVERSAL,  KT_LOOP_MOTION};

enum { TYPES = sizeof loop_types / sizeof *loop_types };

static const char *const loop_names[LOOPS] = {"lock", "ring-2"};

/* A function with this value now; in half of the cases it depends on time. */
static kt_function draw_function(kt_random *random, double value) {
    const double size = kt_random_uniform(random, 0.1, 0.3), speed = kt_random_uniform(random, 0.5, 2.0);
    const double phase = kt_random_uniform(random, -3.0, 3.0);
    if (kt_random_int(random, 0, 1) == 0)
        return kt_function_constant(value);
    return kt_function_sine(size, speed, phase, value - size * sin(6.283185307179586 * speed * now + phase));
}

/* A joint of one coordinate has a given motion. */
static bool draw_motion(closed_tree *c, kt_random *random, int k) {
    kt_loop *loop = &c->loop[k];
    loop->type = KT_LOOP_MOTION;
    for (int tries = 0; tries < 50; tries++) {
        const int b = kt_random_int(random, 1, c->tree.count - 1);
        const kt_coordinates at = kt_body_coordinates(c->tree.model, b);
        loop->joint = c->tree.description.bodies[kt_body_source(c->tree.model, b)].name;
        loop->function = draw_function(random, c->state.q[at.q]);
        if (at.nv == 1)
            return true;
    }
    return false;
}

/* Two joints of one coordinate follow each other. In a plane, the first coupling also has a formula
 * of both positions, and every second one of the others has. */
static bool draw_coupling(closed_tree *c, kt_random *random, int k) {
    kt_loop *loop = &c->loop[k];
    int count = 0;
    double position[2];
    loop->type = KT_LOOP_COUPLING;
    loop->terms = c->term[k];
    for (int tries = 0; tries < 50 && count < 2; tries++) {
        const int b = kt_random_int(random, 1, c->tree.count - 1);
        const kt_coordinates at = kt_body_coordinates(c->tree.model, b);
        const char *joint = c->tree.description.bodies[kt_body_source(c->tree.model, b)].name;
        if (at.nv != 1 || (count == 1 && joint == c->term[k][0].joint))
            continue;
        c->term[k][count] = (kt_term){joint, kt_random_uniform(random, 0.5, 2.0)};
        position[count] = c->state.q[at.q];
        loop->offset += c->term[k][count].coefficient * position[count];
        count++;
    }
    loop->term_count = count;
    const bool is_planar = kt_vec3_norm(c->tree.normal) > 0.0;
    if (count == 2 && (k == 0 ? is_planar : kt_random_int(random, 0, 1) == 0)) {
        const double size = kt_random_uniform(random, 0.05, 0.2);
        const char *const joint[2] = {c->term[k][0].joint, c->term[k][1].joint};
        snprintf(c->formula[k], sizeof c->formula[k], "%.17g*sin(position.%s)*position.%s^2 + exp(0.1*position.%s)",
                 size, joint[0], joint[1], joint[1]);
        loop->formula = c->formula[k];
        loop->offset += size * sin(position[0]) * position[1] * position[1] + exp(0.1 * position[1]);
    }
    return count == 2;
}

/* The axes of both ends in the world. In a planar tree one axis is its normal: that of the type for pins and the like,
 * and another one for slides and directions in the plane. */
static kt_mat3 draw_axes(const closed_tree *c, kt_random *random, kt_loop_type type) {
    const bool planar = kt_vec3_norm(c->tree.normal) > 0.0;
    const kt_vec3 n =
        planar ? kt_vec3_scale(1.0 / kt_vec3_norm(c->tree.normal), c->tree.normal) : kt_tree_direction(random);
    const kt_vec3 across = kt_vec3_cross(n, kt_tree_direction(random));
    const kt_vec3 a = kt_vec3_scale(1.0 / kt_vec3_norm(across), across), b = kt_vec3_cross(n, a);
    const bool lies =
        type == KT_LOOP_INLINE || type == KT_LOOP_INPLANE || type == KT_LOOP_PRISMATIC || type == KT_LOOP_COAXIAL;
    return lies ? (kt_mat3){.x = b, .y = n, .z = a} : (kt_mat3){.x = a, .y = b, .z = n};
}

/* The marker of one body, and the point and axes of another that are there; or a point at some distance. */
static bool draw_ends(closed_tree *c, kt_random *random, int k, kt_loop_type type) {
    const kt_model *model = c->tree.model;
    kt_loop *loop = &c->loop[k];
    const int a = kt_random_int(random, 1, c->tree.count - 1), b = kt_random_int(random, 0, c->tree.count - 1);
    const kt_body *first = &c->tree.description.bodies[kt_body_source(model, a)];
    if (a == b)
        return false;
    const kt_pose pose[2] = {kt_body_pose(model, c->tree.data, a), kt_body_pose(model, c->tree.data, b)};
    const kt_vec3 here = kt_pose_apply(pose[0], first->markers[0].at);
    const kt_vec3 away = kt_vec3_add(here, kt_tree_vector(random, 0.5, 1.0));
    const kt_mat3 axes = draw_axes(c, random, type);
    loop->type = type;
    loop->axis = kt_vec3_make(0.0, 0.0, 1.0);
    loop->axis2 = kt_vec3_make(1.0, 0.0, 0.0);
    loop->between[0] = (kt_end){.body = first->name, .at = first->markers[0].at};
    loop->between[1] = (kt_end){.at = kt_pose_apply(kt_pose_invert(pose[1]), type == KT_LOOP_DISTANCE ? away : here)};
    if (b > 0)
        loop->between[1].body = c->tree.description.bodies[kt_body_source(model, b)].name;
    for (int i = 0; i < 2; i++)
        loop->between[i].rotation = kt_rotation_matrix(kt_mat3_multiply(kt_mat3_transpose(pose[i].rotation), axes));
    if (type == KT_LOOP_DISTANCE)
        loop->function = draw_function(random, kt_vec3_norm(kt_vec3_sub(away, here)));
    return true;
}

/* Whether a mechanism can move, and is not rejected for redundant equations. */
static bool is_generated(const kt_model *model) {
    char *text[2] = {NULL, NULL};
    size_t length[2];
    kt_error error = {0};
    FILE *source = open_memstream(&text[0], &length[0]), *header = open_memstream(&text[1], &length[1]);
    bool fine = source != NULL && header != NULL && kt_model_mobility(model).minimal > 0;
    fine = fine && kt_codegen_write(model, "mech", KT_CODEGEN_LOOPS, false, source, header, &error) == KT_OK;
    if (source != NULL)
        fclose(source);
    if (header != NULL)
        fclose(header);
    free(text[0]);
    free(text[1]);
    return fine;
}

/* Draws loops until they are independent. */
static bool draw_loops(closed_tree *c, kt_random *random, kt_loop_type type, int count) {
    kt_error error = {0};
    kt_tree_state_draw(&c->tree, random, &c->state);
    memset(c->state.external, 0, sizeof c->state.external);
    for (int tries = 0; tries < 100; tries++) {
        bool fine = kt_tree_kinematics(&c->tree, &c->state);
        for (int k = 0; k < count && fine; k++) {
            const kt_loop_type own = k == 0 ? type : loop_types[kt_random_int(random, 0, TYPES - 1)];
            c->loop[k] = kt_loop_default();
            c->loop[k].name = loop_names[k];
            fine = own == KT_LOOP_COUPLING ? draw_coupling(c, random, k)
                   : own == KT_LOOP_MOTION ? draw_motion(c, random, k)
                                           : draw_ends(c, random, k, own);
        }
        if (!fine)
            continue;
        c->tree.description.loops = c->loop;
        c->tree.description.loop_count = count;
        kt_model *closed = NULL;
        if (kt_model_compile(&c->tree.description, NULL, &closed, &error) != KT_OK)
            continue;
        kt_data_free(c->tree.data);
        kt_model_free(c->tree.model);
        c->tree.data = NULL;
        c->tree.model = closed;
        if (!kt_tree_fine("data", kt_data_create(closed, &c->tree.data, &error), &error))
            return false;
        if (is_generated(closed))
            return true;
    }
    return false;
}

static bool grow_closed(closed_tree *c, kt_random *random, int n) {
    const bool planar = n / TYPES % 2 == 0;
    kt_tree_plan plan = planar ? kt_tree_plan_planar() : kt_tree_plan_default();
    plan.bodies = kt_random_int(random, 4, planar ? 8 : 7);
    plan.massless = false;
    plan.one_plane = planar;
    plan.floats = !planar && n % 3 == 0;
    plan.with_armature = n % 4 < 2 ? 0.5 : 0.0;
    memset(c, 0, sizeof *c);
    return kt_tree_grow(&c->tree, &plan, random) && draw_loops(c, random, loop_types[n % TYPES], 1 + n % LOOPS);
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
        kt_loop_equations(tree->model, tree->data, now, s->q, s->v, matrix, NULL, NULL, NULL, &error) != KT_OK ||
        kt_multiplier_evaluate(tree->model, tree->data, now, s->q, s->v, s->tau, NULL, lambda, &error) != KT_OK)
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

/* A bound of the change of accelerations for relative changes of rounding: the largest change that changes of 1e-7 of
 * the state and of all joint forces make, over 1e-7. Forces are relative to the sizes of their terms. */
static double sensitivity_of(const kt_tree *tree, const kt_tree_state *s, const double *a, kt_random *random) {
    double most = 1.0;
    kt_error error = {0};
    for (int i = 0; i < tree->nv; i++)
        most = fmax(most, fabs(a[i]));
    const double size = size_of_forces(tree, s, a);
    for (int k = 0; k < 12; k++) {
        kt_tree_state other = *s;
        double b[NV];
        for (int i = 0; i < tree->nv; i++) {
            other.v[i] += 1e-7 * kt_random_uniform(random, -1.0, 1.0);
            other.tau[i] += 1e-7 * size * kt_random_uniform(random, -1.0, 1.0);
            b[i] = 1e-7 * kt_random_uniform(random, -1.0, 1.0);
        }
        kt_position_add(tree->model, s->q, b, other.q);
        if (kt_acceleration_evaluate(tree->model, tree->data, now, other.q, other.v, other.tau, NULL, b, &error) !=
            KT_OK)
            return (double)INFINITY;
        for (int i = 0; i < tree->nv; i++)
            most = fmax(most, fabs(b[i] - a[i]) / 1e-7);
    }
    return most;
}

/* ---- functions of the file, now ---- */

static int forward_now(const kt_generated *g, const kt_tree_state *s, double *a) {
    return g->loops_have_time ? g->forward_at(g->model, now, s->q, s->v, s->tau, a)
                              : g->forward(g->model, s->q, s->v, s->tau, a);
}

static int loops_now(const kt_generated *g, const kt_tree_state *s, double *phi, double *matrix, double *right) {
    return g->loops_have_time ? g->loops_at(g->model, now, s->q, s->v, phi, matrix, right)
                              : g->loops(g->model, s->q, s->v, phi, matrix, right);
}

static int project_now(const kt_generated *g, double *q, double *v) {
    return g->loops_have_time ? g->project_at(g->model, now, q, v, q, v) : g->project(g->model, q, v, q, v);
}

static int step_now(const kt_generated *g, int k, double *q, double *v, const double *tau) {
    kt_generated_step *const take[3] = {g->heun, g->rk4, g->semi_implicit};
    kt_generated_timed_step *const take_at[3] = {g->heun_at, g->rk4_at, g->semi_implicit_at};
    return g->loops_have_time ? take_at[k](g->model, now, q, v, tau, length_of_step, q, v)
                              : take[k](g->model, q, v, tau, length_of_step, q, v);
}

/* ---- comparisons of functions ---- */

/* Returns false if the state is so near to a singular one that a comparison has no meaning. */
static bool compare_accelerations(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, kt_worst *worst,
                                  loop_comparison *c, kt_random *random, int n) {
    double a[NV], own[NV], phi[EQUATIONS], matrix[EQUATIONS * NV], right[EQUATIONS];
    kt_error error = {0};
    const kt_status status =
        kt_acceleration_evaluate(tree->model, tree->data, now, s->q, s->v, s->tau, NULL, a, &error);
    if (!kt_tree_fine("accelerations", status, &error))
        return false;
    const double most = sensitivity_of(tree, s, a, random);
    if (!(most < 1e7))
        return false;
    if (!kt_check_equal_int("forward", forward_now(g, s, own), 0))
        return false;
    for (int i = 0; i < tree->nv; i++)
        kt_worst_near(worst, own[i], a[i], 200.0 * EPS * most, "mechanism %d coordinate %d", n, i);
    if (g->acceleration(g->model, now, s->q, s->v, NULL, s->tau, own) == 0)
        for (int i = 0; i < tree->nv; i++)
            kt_worst_near(worst, own[i], a[i], 200.0 * EPS * most, "mechanism %d, with effects, coordinate %d", n, i);
    if (!kt_check_equal_int("loops", loops_now(g, s, phi, matrix, right), 0))
        return false;
    const int rows = kt_model_mobility(tree->model).rank;
    for (int r = 0; r < rows; r++) {
        double sum = 0.0, size = fabs(right[r]);
        for (int i = 0; i < tree->nv; i++) {
            sum += matrix[r + rows * i] * a[i];
            size += fabs(matrix[r + rows * i] * a[i]);
        }
        kt_worst_near(&c->equations, sum, right[r], 200.0 * EPS * (size + most), "mechanism %d equation %d", n, r);
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
        if (!kt_generated_library_step(tree, method[k], now, length_of_step, s, next) ||
            !kt_check_equal_int("step", step_now(g, k, own, own + nq, s->tau), 0))
            return;
        for (int i = 0; i < count; i++)
            kt_worst_near(&c->step, own[i], next[i], 40.0 * EPS * most, "mechanism %d method %d number %d", n, k, i);
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
    if (kt_state_project(tree->model, tree->data, now, next, next + nq, NULL, &error) != KT_OK ||
        !kt_check_equal_int("project", project_now(g, own, own + nq), 0))
        return;
    for (int i = 0; i < count; i++)
        kt_worst_near(&c->projected, own[i], next[i], 40.0 * EPS * most * (1.0 + length_of_loops(g)),
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
    const int code =
        g->loops_have_time
            ? g->forward_derivatives_at(g->model, now, s->q, s->v, s->tau, own, own + square, own + 2 * square)
            : g->forward_derivatives(g->model, s->q, s->v, s->tau, own, own + square, own + 2 * square);
    const size_t bytes = kt_acceleration_work_size(tree->model);
    void *work = aligned_alloc(KT_ALIGNMENT, (bytes + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    const kt_status status = kt_acceleration_derivatives(tree->model, tree->data, work, bytes, now, s->q, s->v, s->tau,
                                                         NULL, right, right + square, right + 2 * square, &error);
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
        kt_worst_near(&c->differences, sum, better, 0.01 * apart + 1e4 * 200.0 * EPS * most, "mechanism %d entry %d", n,
                      i);
    }
}

/* A closed state some way from the first one, and the same state opened. Returns 1 if it was compared. */
static int compare_state(kt_generated *g, const closed_tree *m, kt_random *random, loop_comparison *c, int n) {
    const kt_tree *tree = &m->tree;
    kt_tree_state s = m->state;
    double by[NV];
    kt_error error = {0};
    for (int i = 0; i < tree->nv; i++)
        by[i] = kt_random_uniform(random, -0.15, 0.15);
    kt_position_add(tree->model, m->state.q, by, s.q);
    if (kt_state_project(tree->model, tree->data, now, s.q, s.v, NULL, &error) != KT_OK)
        return 0;
    if (!compare_accelerations(g, tree, &s, &c->closed, c, random, n))
        return 0;
    double a[NV];
    if (kt_acceleration_evaluate(tree->model, tree->data, now, s.q, s.v, s.tau, NULL, a, &error) != KT_OK)
        return 0;
    const double most = sensitivity_of(tree, &s, a, random);
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
    (void)compare_accelerations(g, tree, &s, &c->open, c, random, n);
    compare_projection(g, tree, &s, most, c, n);
    return 1;
}

/* Each type in a plane and in space, on trees with every type of joint, every second time with another loop. States
 * that are open show that the equations are those of the library, and not only their solutions. */
KT_TEST(generated_loops_agree_with_the_library) {
    kt_random random = kt_random_of_test();
    loop_comparison c = loop_comparison_make();
    static kt_generated g;
    static closed_tree m;
    int compared = 0, formulas = 0, differentiated = 0, seen[TYPES] = {0};
    if (!kt_generated_has("cc")) {
        kt_skip("generated C", "there is no compiler of the name cc");
        return;
    }
    for (int n = 0; n < count_mechanisms(2 * TYPES); n++) {
        const bool grown = grow_closed(&m, &random, n);
        const bool differs = grown && m.tree.nv <= DIFFERENTIATED_MOST && n % EACH == 0;
        const unsigned functions = differs ? KT_GENERATED_WITH_LOOPS : plain_functions;
        const bool fine = grown && kt_generated_make_some(&g, m.tree.model, functions, "cc -O0", false);
        differentiated += differs;
        for (int k = 0; k < 4 && fine; k++)
            seen[n % TYPES] += compare_state(&g, &m, &random, &c, n);
        for (int k = 0; k < LOOPS && fine; k++)
            formulas += m.loop[k].formula != NULL;
        if (grown)
            kt_generated_free(&g);
        kt_tree_free(&m.tree);
        if (grown && !fine)
            return;
    }
    loop_comparison_check(&c);
    kt_check_above("couplings with a formula", formulas, 1);
    kt_check_above("mechanisms with derivatives", differentiated, 0);
    for (int k = 0; k < TYPES; k++) {
        char name[64];
        snprintf(name, sizeof name, "states with a loop of type %d", (int)loop_types[k]);
        kt_check_above(name, seen[k], 0);
        compared += seen[k];
    }
    kt_check_above("states that were compared", compared, 2 * count_mechanisms(2 * TYPES));
}

/* ---- parameters -------------------------------------------------------------------------------------------------- */

/* The number of a loop that a parameter represents; NULL: it is another parameter. */
static double *number_of_loop(closed_tree *m, const char *name) {
    static const char *const prefix[LOOPS] = {"lock_", "ring_2_"};
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
        for (int i = 0; i < loop->term_count; i++)
            if (strcmp(what, m->term[k][i].joint) == 0)
                return &m->term[k][i].coefficient;
    }
    return NULL;
}

/* Moves the first ends of loops to the markers where they were. */
static void follow_markers(closed_tree *m) {
    for (int k = 0; k < m->tree.description.loop_count; k++)
        for (int b = 0; b < m->tree.description.body_count && m->loop[k].between[0].body != NULL; b++)
            if (strcmp(m->tree.body[b].name, m->loop[k].between[0].body) == 0)
                m->loop[k].between[0].at = m->tree.body[b].markers[0].at;
}

/* Whether no pin of a planar tree leaves its plane, in which no motion can close it. */
static bool stays_in_plane(const closed_tree *m) {
    for (int k = 0; k < m->tree.description.loop_count; k++) {
        kt_loop_motion motion;
        if (m->loop[k].terms != NULL || m->loop[k].joint != NULL || kt_vec3_norm(m->tree.normal) == 0.0)
            continue;
        if (!kt_tree_kinematics(&m->tree, &m->state) ||
            !kt_loop_motion_evaluate(m->tree.model, m->tree.data, k, &motion))
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
static bool has_redundant_equations(const closed_tree *m) {
    static double matrix[EQUATIONS * NV];
    const kt_mobility mobility = kt_model_mobility(m->tree.model);
    int count = 0;
    kt_error error = {0};
    if (!kt_tree_fine("equations",
                      kt_loop_equations(m->tree.model, m->tree.data, now, m->state.q, m->state.v, matrix, NULL, NULL,
                                        NULL, &error),
                      &error))
        return true;
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
    static closed_tree m;
    int changed = 0, of_loops = 0;
    if (!kt_generated_has("cc")) {
        kt_skip("generated C", "there is no compiler of the name cc");
        return;
    }
    for (int n = 0; n < count_mechanisms(TYPES); n++) {
        const bool grown = grow_closed(&m, &random, n + n % 2 * TYPES); /* in turns in a plane and in space */
        bool fine = grown && kt_generated_make_some(&g, m.tree.model, plain_functions, "cc -O0", false);
        const uint64_t structure = kt_codegen_structure(m.tree.model);
        const bool decided = fine && !has_redundant_equations(&m);
        for (int k = 0; k < g.count && decided && fine; k++) {
            double parameter[KT_GENERATED_PARAMETERS];
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
            kt_data_free(m.tree.data);
            kt_model_free(m.tree.model);
            m.tree.data = NULL;
            m.tree.model = NULL;
            fine = kt_tree_compile(&m.tree, NULL);
            if (fine && is_generated(m.tree.model) && stays_in_plane(&m)) {
                kt_check_true("the structure is the same", kt_codegen_structure(m.tree.model) == structure);
                g.prepare(parameter, g.model);
                changed += compare_accelerations(&g, &m.tree, &m.state, &c.open, &c, &random, n);
                of_loops += of_loop != NULL;
            }
            *number = before;
        }
        if (grown)
            kt_generated_free(&g);
        kt_tree_free(&m.tree);
        if (grown && !fine)
            return;
    }
    kt_check_worst(&c.open);
    kt_check_worst(&c.equations);
    kt_check_above("parameters that were changed", changed, 100);
    kt_check_above("parameters of loops", of_loops, 10);
}

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

/* Compares a scene without its effects. Returns how many states were compared; -1: it is rejected. */
static int compare_scene(const char *name, kt_random *random, loop_comparison *c) {
    static kt_generated g;
    static closed_tree m;
    char path[512];
    kt_scene scene;
    kt_error error = {0};
    int compared = -1;
    snprintf(path, sizeof path, "%s/%s", KT_SCENES, name);
    memset(&m, 0, sizeof m);
    if (!kt_tree_fine(name, kt_scene_read(path, &scene, NULL, NULL, &error), &error))
        return -1;
    scene.description.effect_count = 0;
    scene.description.state_count = 0;
    if (scene.description.loop_count > 0 &&
        kt_model_compile(&scene.description, NULL, &m.tree.model, &error) == KT_OK &&
        kt_data_create(m.tree.model, &m.tree.data, &error) == KT_OK && is_generated(m.tree.model)) {
        m.tree.nv = kt_model_nv(m.tree.model);
        kt_model_initial(m.tree.model, m.state.q, m.state.v);
        for (int i = 0; i < m.tree.nv; i++)
            m.state.tau[i] = kt_random_uniform(random, -1.0, 1.0);
        const bool fine =
            kt_tree_fine(name, kt_state_project(m.tree.model, m.tree.data, now, m.state.q, m.state.v, NULL, &error),
                         &error) &&
            kt_generated_make_some(&g, m.tree.model,
                                   m.tree.nv <= DIFFERENTIATED_MOST ? KT_GENERATED_WITH_LOOPS : plain_functions,
                                   "cc -O0", false);
        compared = 0;
        for (int k = 0; k < 4 && fine; k++)
            compared += compare_state(&g, &m, random, c, -1);
        kt_generated_free(&g);
    }
    kt_data_free(m.tree.data);
    kt_model_free(m.tree.model);
    kt_scene_free(&scene);
    return compared;
}

/* Linkages whose equations repeat each other are among them: six bars in space (Bricard), and a Hooke's joint. */
KT_TEST(generated_scenes_with_loops_agree_with_the_library) {
    kt_random random = kt_random_of_test();
    loop_comparison c = loop_comparison_make();
    struct dirent **list = NULL;
    int generated = 0;
    if (!kt_generated_has("cc")) {
        kt_skip("generated C", "there is no compiler of the name cc");
        return;
    }
    const int count = scandir(KT_SCENES, &list, kt_is_scene_file, alphasort);
    for (int i = 0; i < count; i++) {
        const int compared = compare_scene(list[i]->d_name, &random, &c);
        if (compared >= 0) {
            kt_check_above(list[i]->d_name, compared, 0);
            generated++;
        }
        free(list[i]);
    }
    free(list);
    kt_check_above("scenes", generated, 15);
    loop_comparison_check(&c);
}
