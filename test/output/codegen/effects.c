/* Generated forces of effects against those of the library, which have tests of their own. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "effect_set.h"

#include "mechanics/dynamics/oracle.h"

#include "kinetree/descriptor.h"
#include "kinetree/joint.h"
#include "kinetree/mechanism.h"
#include "kinetree/sensitivity.h"

#include <dlfcn.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EPS DBL_EPSILON

enum { FILES_OF_STEPS = KT_CODEGEN_ACCELERATION | KT_CODEGEN_EFFECTS | KT_CODEGEN_STEPS };

/* ---- comparisons ------------------------------------------------------------------------------------------------- */

typedef struct comparison {
    kt_worst force, step, acceleration;
    double largest; /* force in joints but that of the last effect */
} comparison;

static void library_forces(const kt_tree *tree, double t, const kt_tree_state *s, double *tau) {
    kt_error error = {0};
    kt_need_fine("effects", kt_effect_forces(tree->model, tree->data, t, s->q, s->v, tau, &error), &error);
}

/* How far the forces change if each number of the state changes by a part of 2^-30, per such a part. */
static double find_sensitivity(const kt_tree *tree, double t, const kt_tree_state *s, const double *tau,
                               kt_random *random) {
    const double part = ldexp(1.0, -30);
    double most = 1.0, moved[KT_TREE_NV];
    for (int n = 0; n < 4; n++) {
        kt_tree_state near = *s;
        for (int i = 0; i < tree->nq; i++)
            near.q[i] += part * kt_random_uniform(random, -1.0, 1.0);
        for (int i = 0; i < tree->nv; i++)
            near.v[i] += part * kt_random_uniform(random, -1.0, 1.0);
        library_forces(tree, t * (1.0 + part), &near, moved);
        for (int i = 0; i < tree->nv; i++)
            most = fmax(most, fmax(fabs(tau[i]), fabs(moved[i] - tau[i]) / part));
    }
    return most;
}

/* The length of all joint offsets and translations: poses in the world have rounding errors of this size. */
static double find_length(const kt_tree *tree, const kt_tree_state *s) {
    double sum = 0.0;
    for (int b = 0; b < tree->description.body_count; b++)
        sum += kt_vec3_norm(tree->description.bodies[b].joint.at);
    for (int b = 1; b < tree->count; b++) {
        const kt_coordinates c = kt_body_coordinates(tree->model, b);
        sum += c.type == KT_JOINT_REVOLUTE ? 0.0 : kt_tree_largest(s->q + c.q, c.nq);
    }
    return sum;
}

/* The coordinate of the last effect, a motor. */
static int last_coordinate(const kt_tree *tree) {
    const kt_effect *e = &tree->description.effects[tree->description.effect_count - 1];
    return e->joint != NULL ? kt_body_coordinates(tree->model, kt_body_find(tree->model, e->joint)).v : -1;
}

/* Against inverse dynamics in more digits, with the library's forces, which have errors below a bound. */
static void compare_accelerations(kt_generated *g, const kt_tree *tree, double t, const kt_tree_state *s,
                                  const double *force, double bound, comparison *c, int n) {
    static long double slow[KT_TREE_NV], moved[KT_TREE_NV];
    double own[KT_TREE_NV], sensitivity[KT_TREE_NV], other[KT_TREE_NV], most[KT_TREE_NV] = {0.0};
    kt_tree_state loaded = *s;
    memset(loaded.external, 0, sizeof loaded.external);
    for (int i = 0; i < tree->nv; i++)
        loaded.tau[i] += force[i];
    kt_need(kt_check_true("regular", kt_oracle_forward(tree, &loaded, slow, sensitivity)));
    for (int i = 0; i < tree->nv; i++) { /* |M^-1|, column by column */
        loaded.tau[i] += 1.0;
        (void)kt_oracle_forward(tree, &loaded, moved, other);
        loaded.tau[i] -= 1.0;
        for (int k = 0; k < tree->nv; k++)
            most[k] += fabs((double)(moved[k] - slow[k]));
    }
    kt_check_equal_int("acceleration", g->acceleration(g->model, t, s->q, s->v, NULL, s->tau, own), 0);
    for (int i = 0; i < tree->nv; i++)
        kt_worst_near(&c->acceleration, own[i], (double)slow[i], 20.0 * EPS * sensitivity[i] + bound * most[i],
                      "file %d coordinate %d", n, i);
}

static void compare_forces(kt_generated *g, const kt_tree *tree, double t, const kt_tree_state *s, kt_random *random,
                           comparison *c, int n) {
    double tau[KT_TREE_NV], slow[KT_TREE_NV];
    kt_check_equal_int("effects", g->effects_at(g->model, t, s->q, s->v, tau), 0);
    library_forces(tree, t, s, slow);
    const double bound = 40.0 * EPS * (1.0 + find_length(tree, s)) * find_sensitivity(tree, t, s, slow, random);
    for (int i = 0; i < tree->nv; i++) {
        c->largest = i == last_coordinate(tree) ? c->largest : fmax(c->largest, fabs(slow[i]));
        kt_worst_near(&c->force, tau[i], slow[i], bound, "file %d coordinate %d", n, i);
    }
    compare_accelerations(g, tree, t, s, slow, bound, c, n);
}

/* From two states of the same step: the library's, and its step from a state that differs by 2^-30, for the bound. */
static void compare_step(kt_generated *g, const kt_tree *tree, double t, const kt_tree_state *s, kt_random *random,
                         comparison *c, int n, int k) {
    const kt_method *const method = kt_method_find(k == 0 ? "heun" : "rk4");
    const kt_step step = {.method = method, .t = t, .h = 1e-3, .tau = s->tau};
    const size_t size = kt_step_work_size(tree->model, method);
    const int nq = tree->nq, count = nq + tree->nv;
    double next[3][KT_TREE_NQ + KT_TREE_NV], most = 1.0, part = ldexp(1.0, -30);
    void *work = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    kt_error error = {0};
    for (int j = 0; j < 2; j++) {
        kt_tree_state near = *s;
        for (int i = 0; i < tree->nv && j > 0; i++)
            near.v[i] += part * kt_random_uniform(random, -1.0, 1.0);
        const kt_status status =
            kt_step_evaluate(tree->model, tree->data, work, size, &step, near.q, near.v, next[j], next[j] + nq, &error);
        kt_need_fine("step", status, &error);
    }
    free(work);
    kt_generated_timed_step *const take = k == 0 ? g->heun_at : g->rk4_at;
    kt_check_equal_int("step", take(g->model, t, s->q, s->v, s->tau, 1e-3, next[2], next[2] + nq), 0);
    for (int i = 0; i < count; i++)
        most = fmax(most, fmax(fabs(next[0][i]), fabs(next[1][i] - next[0][i]) / part));
    for (int i = 0; i < count; i++)
        kt_worst_near(&c->step, next[2][i], next[0][i], 100.0 * EPS * most, "file %d method %d number %d", n, k, i);
}

static void compare_file(kt_generated *g, const kt_tree *tree, kt_random *random, comparison *c, int n) {
    kt_tree_state s;
    kt_tree_state_draw(tree, random, &s);
    const double t = kt_random_uniform(random, -0.3, 1.8);
    compare_forces(g, tree, t, &s, random, c, n);
    for (int k = 0; k < 2; k++)
        compare_step(g, tree, t, &s, random, c, n, k);
}

static comparison comparison_make(void) {
    return (comparison){kt_worst_make("forces"), kt_worst_make("steps"), kt_worst_make("accelerations"), 0.0};
}

static int count_rounds(int usual) {
    const char *text = getenv("KT_MECHANISMS");
    return text != NULL ? (int)strtol(text, NULL, 10) : usual;
}

static void grow_tree(kt_tree *tree, kt_random *random, int n) {
    kt_tree_plan plan = n % 4 == 3 ? kt_tree_plan_planar() : kt_tree_plan_default();
    plan.bodies = 9;
    plan.massless = false;
    plan.floats = n % 3 == 0 && n % 4 != 3;
    kt_tree_grow(tree, &plan, random);
}

/* Whether the file compiles without a warning in single precision. */
static bool check_single_precision(const kt_generated *g) {
    char command[256];
    snprintf(command, sizeof command,
             "cc -std=c99 -Dmech_FLOAT -Wall -Wextra -Wconversion -Werror -pedantic -c %s/mech.c -o /dev/null",
             g->folder);
    const int code = system(command); /* NOLINT(cert-env33-c): a compiler of this machine */
    return kt_check_equal_int("the compiler's exit code", code, 0);
}

/* Each type alone, on trees of all joints; numbers are fixed in each fifth file. */
KT_TEST(forces_and_steps_of_each_type_agree_with_the_library) {
    kt_random random = kt_random_of_test();
    comparison c = comparison_make();
    static kt_generated g;
    static kt_effect_set set;
    kt_generated_need_compiler();
    for (int n = 0; n < count_rounds(2) * KT_EFFECT_TYPE_COUNT; n++) {
        const kt_effect_type type = (kt_effect_type)(n % KT_EFFECT_TYPE_COUNT);
        kt_tree tree;
        grow_tree(&tree, &random, n);
        kt_effect_set_draw(&set, type, &tree, &random);
        kt_generated_make_some(&g, tree.model, FILES_OF_STEPS, "cc -O0", n % 5 == 4);
        kt_need(n % 5 == 4 || check_single_precision(&g));
        c.largest = 0.0;
        for (int k = 0; k < 6; k++)
            compare_file(&g, &tree, &random, &c, n);
        kt_check_above(kt_effect_descriptor(type)->name, c.largest, 1e-3);
    }
    kt_check_worst(&c.force);
    kt_check_worst(&c.step);
    kt_check_worst(&c.acceleration);
}

/* Each number of an effect is changed alone, in the file and in the description. */
KT_TEST(each_number_of_an_effect_changes_the_forces_as_in_the_library) {
    kt_random random = kt_random_of_test();
    comparison c = comparison_make();
    static kt_generated g;
    static kt_effect_set set;
    int changed = 0;
    kt_generated_need_compiler();
    for (int n = 0; n < count_rounds(1) * KT_EFFECT_TYPE_COUNT; n++) {
        kt_tree tree;
        grow_tree(&tree, &random, n);
        kt_effect_set_draw(&set, (kt_effect_type)(n % KT_EFFECT_TYPE_COUNT), &tree, &random);
        kt_generated_make_some(&g, tree.model, FILES_OF_STEPS, "cc -O0", false);
        const uint64_t structure = kt_codegen_structure(tree.model);
        for (int k = 0; k < g.count; k++) {
            double parameter[KT_GENERATED_PARAMETERS], tau[2][KT_TREE_NV] = {{0.0}};
            kt_tree_state s;
            if (g.name[k][0] != 'e')
                continue;
            double *number = kt_generated_number(&tree, g.name[k]);
            if (number == NULL)
                break;
            const double before = *number;
            memcpy(parameter, g.standard, (size_t)g.count * sizeof *parameter);
            kt_check_near(g.name[k], parameter[k], before, 4.0 * EPS * (1.0 + fabs(before)));
            parameter[k] = *number = before * kt_random_uniform(&random, 1.05, 1.3);
            kt_tree_compile(&tree, NULL);
            kt_check_true("the structure is the same", kt_codegen_structure(tree.model) == structure);
            g.prepare(parameter, g.model);
            for (int i = 0; i < 2; i++)
                compare_file(&g, &tree, &random, &c, n);
            kt_tree_state_draw(&tree, &random, &s);
            for (int i = 0; i < 2; i++) {
                g.prepare(i == 0 ? parameter : g.standard, g.model);
                (void)g.effects_at(g.model, 0.5, s.q, s.v, tau[i]);
            }
            changed += memcmp(tau[0], tau[1], sizeof tau[0]) != 0;
            *number = before;
        }
    }
    kt_check_above("parameters that changed a force", changed, 150);
    kt_check_worst(&c.force);
    kt_check_worst(&c.step);
    kt_check_worst(&c.acceleration);
}

/* ---- auxiliary states -------------------------------------------------------------------------------------------- */

enum { STATES = KT_EFFECT_STATES };

typedef int states_function(const void *model, double t, const double *q, const double *v, const double *x,
                            double *out);
typedef int states_step(const void *model, double t, const double *q, const double *v, const double *x,
                        const double *tau, double h, double *next_q, double *next_v, double *next_x);

/* The library's step to q, v and x in `next`; v += h a, x += h x' and q (+) h v for the method NULL. */
static void step_library(const kt_tree *tree, const kt_step *step, const kt_tree_state *s, double *next) {
    const size_t size = step->method != NULL ? kt_step_work_size(tree->model, step->method) : KT_ALIGNMENT;
    void *work = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    double *const v = next + tree->nq, *const x = v + tree->nv,
                  *const own = kt_auxiliary_states(tree->model, tree->data);
    double rate[KT_TREE_NV];
    kt_error error = {0};
    kt_status status;
    memcpy(own, step->x, STATES * sizeof *own);
    if (step->method != NULL) {
        status = kt_step_evaluate(tree->model, tree->data, work, size, step, s->q, s->v, next, v, &error);
        memcpy(x, own, STATES * sizeof *x);
    } else {
        status = kt_auxiliary_state_rates(tree->model, tree->data, step->t, s->q, s->v, rate, &error);
        for (int i = 0; i < STATES; i++)
            x[i] = step->x[i] + step->h * rate[i];
        if (status == KT_OK)
            status = kt_acceleration_evaluate(tree->model, tree->data, step->t, s->q, s->v, s->tau, NULL, rate, &error);
        for (int i = 0; i < tree->nv; i++) {
            v[i] = s->v[i] + step->h * rate[i];
            rate[i] = step->h * v[i];
        }
        kt_position_add(tree->model, s->q, rate, next);
    }
    free(work);
    kt_need_fine("step", status, &error);
}

static void compare_states(kt_generated *g, const kt_tree *tree, kt_random *random, comparison *c, int n) {
    static const char *const method[] = {"heun", "rk4", "semi_implicit"};
    const double x[STATES] = {kt_random_uniform(random, -1.0, 1.0), kt_random_uniform(random, -1.0, 1.0)};
    kt_tree_state s;
    kt_tree_state_draw(tree, random, &s);
    for (int k = 0; k < 3; k++) {
        double own[KT_TREE_NQ + KT_TREE_NV + STATES], next[KT_TREE_NQ + KT_TREE_NV + STATES];
        const kt_step step = {
            .method = k < 2 ? kt_method_find(method[k]) : NULL, .t = 0.3, .h = 1e-2, .tau = s.tau, .x = x};
        double *const v = own + tree->nq, *const next_x = v + tree->nv;
        char name[32];
        states_step *take;
        snprintf(name, sizeof name, "mech_%s", method[k]);
        void *const at = dlsym(g->library, name);
        memcpy(&take, &at, sizeof take);
        kt_need(kt_check_true(name, at != NULL));
        step_library(tree, &step, &s, next);
        memcpy(own, s.q, (size_t)tree->nq * sizeof *own);
        memcpy(v, s.v, (size_t)tree->nv * sizeof *v);
        memcpy(next_x, x, sizeof x);
        kt_check_equal_int("step", take(g->model, 0.3, own, v, next_x, s.tau, 1e-2, own, v, next_x), 0);
        for (int i = 0; i < tree->nq + tree->nv + STATES; i++)
            kt_worst_near(&c->step, own[i], next[i], 1e-13 * (1.0 + fabs(next[i])), "file %d method %d number %d", n, k,
                          i);
        c->largest = fmax(c->largest, fabs(next_x[0] - x[0]));
    }
}

/* The bound leaves two digits for badly conditioned mass matrices. */
KT_TEST(steps_advance_auxiliary_states_as_the_library) {
    kt_random random = kt_random_of_test();
    comparison c = comparison_make();
    static kt_generated g;
    static kt_effect_set set;
    kt_generated_need_compiler();
    for (int n = 0; n < count_rounds(4); n++) {
        kt_tree tree;
        kt_auxiliary_state state[STATES];
        grow_tree(&tree, &random, n);
        kt_effect_set_draw_states(&set, &tree, state, &random);
        kt_generated_make_some(&g, tree.model, FILES_OF_STEPS | KT_CODEGEN_STATES, "cc -O0", false);
        kt_need(check_single_precision(&g));
        for (int k = 0; k < 6; k++)
            compare_states(&g, &tree, &random, &c, n);
    }
    kt_check_above("change of a state", c.largest, 1e-3);
    kt_check_worst(&c.step);
}

/* A change of a number keeps the structure; one that is folded does not. */
KT_TEST(structure_changes_with_all_that_effects_fold) {
    kt_random random = kt_random_of_test();
    static kt_effect_set set;
    kt_tree tree;
    uint64_t seen[9];
    grow_tree(&tree, &random, 0);
    kt_effect_set_draw(&set, KT_EFFECT_SPRING, &tree, &random);
    kt_effect *const spring = &set.effect[0], *const motor = &set.effect[set.count - 1];
    const kt_effect before = *spring, other = *motor;
    for (int k = 0; k < 9; k++) {
        *spring = before;
        *motor = other;
        spring->stiffness = k == 1 ? 7.0 : 2.0;
        spring->damping = k == 2 ? 0.0 : 1.0;
        if (k == 3) {
            spring->between[0] = before.between[1];
            spring->between[1] = before.between[0];
        }
        if (k == 4)
            motor->torque = kt_function_sine(0.41, 0.8, 0.2, 0.1);
        if (k >= 5) {
            *motor = kt_effect_of(KT_EFFECT_EXPRESSION, other.joint);
            motor->formula[0] = k == 5 ? "t + 1" : k == 6 ? "t + 2" : k == 7 ? "t - 1" : "1 + t";
        }
        kt_tree_compile(&tree, NULL);
        seen[k] = kt_codegen_structure(tree.model);
    }
    kt_check_true("a number", seen[1] == seen[0]);
    for (int k = 2; k < 9; k++)
        for (int j = 0; j < k; j++)
            kt_check_true("another structure", j == 1 || seen[k] != seen[j]);
}
