/* Generated C of random trees against equations in long double that share nothing with the library (oracle.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "generated.h"

#include "mechanics/dynamics/oracle.h"

#include "kinetree/joint.h"
#include "kinetree/mechanism.h"
#include "kinetree/sensitivity.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EPS DBL_EPSILON

/* Rounding errors of the mass matrix and of the derivatives of inverse dynamics, in eps of the largest entry. */
#define MASS_ROUNDING 20.0
#define LOAD_ROUNDING 100.0

/* How many mechanisms a test draws: KT_MECHANISMS, or this number. */
static int count_mechanisms(int usual) {
    const char *text = getenv("KT_MECHANISMS");
    return text != NULL ? (int)strtol(text, NULL, 10) : usual;
}

/* The worst errors, each relative to the rounding errors of its terms. */
typedef struct comparison {
    kt_worst inverse, bias, forward, mass, effects, kinetic, potential, markers, steps, jacobians, loaded,
        derivatives[5];
} comparison;

static comparison comparison_make(void) {
    return (comparison){kt_worst_make("inverse dynamics"),
                        kt_worst_make("bias"),
                        kt_worst_make("forward dynamics"),
                        kt_worst_make("mass matrix"),
                        kt_worst_make("effects"),
                        kt_worst_make("kinetic energy"),
                        kt_worst_make("potential energy"),
                        kt_worst_make("markers"),
                        kt_worst_make("steps"),
                        kt_worst_make("Jacobians"),
                        kt_worst_make("accelerations with effects"),
                        {kt_worst_make("dtau/dq"), kt_worst_make("dtau/dv"), kt_worst_make("da/dq"),
                         kt_worst_make("da/dv"), kt_worst_make("da/dtau")}};
}

static void comparison_check(const comparison *c) {
    kt_check_worst(&c->inverse);
    kt_check_worst(&c->bias);
    kt_check_worst(&c->forward);
    kt_check_worst(&c->mass);
    kt_check_worst(&c->effects);
    kt_check_worst(&c->kinetic);
    kt_check_worst(&c->potential);
    kt_check_worst(&c->markers);
    kt_check_worst(&c->steps);
    kt_check_worst(&c->jacobians);
    kt_check_worst(&c->loaded);
    for (int k = 0; k < 5; k++)
        kt_check_worst(&c->derivatives[k]);
}

static void compare_forces(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, comparison *c, int n) {
    static double tau[KT_TREE_NV], a[KT_TREE_NV];
    static long double slow[KT_TREE_NV], size[KT_TREE_NV];
    double sensitivity[KT_TREE_NV];
    const double zero[KT_TREE_NV] = {0.0};
    kt_check_equal_int("inverse", g->inverse(g->model, s->q, s->v, s->a, tau), 0);
    kt_oracle_inverse(tree, s, s->a, slow, size);
    for (int i = 0; i < tree->nv; i++)
        kt_worst_near(&c->inverse, tau[i], (double)slow[i], 40.0 * EPS * (double)size[i], "tree %d coordinate %d", n,
                      i);
    kt_check_equal_int("bias", g->bias(g->model, s->q, s->v, tau), 0);
    kt_oracle_inverse(tree, s, zero, slow, size);
    for (int i = 0; i < tree->nv; i++)
        kt_worst_near(&c->bias, tau[i], (double)slow[i], 40.0 * EPS * (double)size[i], "tree %d coordinate %d", n, i);
    kt_need(kt_check_true("regular", kt_oracle_forward(tree, s, slow, sensitivity)));
    kt_check_equal_int("forward", g->forward(g->model, s->q, s->v, s->tau, a), 0);
    for (int i = 0; i < tree->nv; i++)
        kt_worst_near(&c->forward, a[i], (double)slow[i], 20.0 * EPS * sensitivity[i], "tree %d coordinate %d", n, i);
}

static void compare_mass(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, comparison *c, int n) {
    static double mass[KT_TREE_NV * KT_TREE_NV];
    static long double slow[KT_TREE_NV * KT_TREE_NV];
    const int nv = tree->nv;
    double most = 0.0;
    kt_check_equal_int("mass", g->mass(g->model, s->q, mass), 0);
    kt_oracle_mass(tree, s->q, slow);
    for (int i = 0; i < nv; i++)
        most = fmax(most, (double)slow[i * nv + i]);
    for (int i = 0; i < nv; i++)
        for (int j = 0; j < nv; j++)
            kt_worst_near(&c->mass, mass[i * nv + j], (double)slow[i * nv + j], MASS_ROUNDING * EPS * most,
                          "tree %d entry %d, %d", n, i, j);
}

/* T = sum a v^2 / 2 */
static double rotor_energy(const kt_tree *tree, const double *v) {
    double sum = 0.0;
    for (int b = 1; b < tree->count; b++) {
        const kt_coordinates c = kt_body_coordinates(tree->model, b);
        const kt_joint *joint = &tree->description.bodies[kt_body_source(tree->model, b)].joint;
        for (int k = 0; k < c.nv; k++)
            sum += 0.5 * joint->armature[k] * v[c.v + k] * v[c.v + k];
    }
    return sum;
}

static void compare_motion(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, comparison *c, int n) {
    static kt_oracle_body body[KT_TREE_SLOTS];
    static double at[3 * KT_TREE_SLOTS], rate[3 * KT_TREE_SLOTS];
    double energy[2];
    kt_check_equal_int("energy", g->energy(g->model, s->q, s->v, energy), 0);
    kt_check_equal_int("markers", g->markers(g->model, s->q, s->v, at, rate), 0);
    kt_oracle_motion(tree, s->q, s->v, NULL, body);
    const double rotors = rotor_energy(tree, s->v);
    const double kinetic = (double)kt_oracle_kinetic(tree, body) + rotors,
                 potential = (double)kt_oracle_potential(tree, body);
    double size = 1.0;
    for (int b = 1, k = 0; b < tree->count; b++) {
        const kt_vec3 p = kt_marker_at(tree->model, b, 0);
        const double own[3] = {p.x, p.y, p.z};
        const long double *w = body[b].w;
        long double arm[3];
        for (int i = 0; i < 3; i++) {
            arm[i] = body[b].r[i][0] * (long double)own[0] + body[b].r[i][1] * (long double)own[1] +
                     body[b].r[i][2] * (long double)own[2];
            size = fmax(size, (double)(fabsl(body[b].p[i]) + fabsl(body[b].u[i])));
        }
        for (int i = 0; i < 3; i++) {
            const int j = (i + 1) % 3, l = (i + 2) % 3;
            const double place = (double)(body[b].p[i] + arm[i]);
            const double speed = (double)(body[b].u[i] + w[j] * arm[l] - w[l] * arm[j]);
            kt_worst_near(&c->markers, at[3 * k + i], place, 40.0 * EPS * size, "tree %d body %d", n, b);
            kt_worst_near(&c->markers, rate[3 * k + i], speed, 40.0 * EPS * size * size, "tree %d body %d", n, b);
        }
        k++;
    }
    double mass = 0.0;
    for (int b = 1; b < tree->count; b++)
        mass += kt_body_mass(tree->model, b);
    /* twice the kinetic energy is a sum of terms m u.u with mixed signs once base parameters are moved */
    kt_worst_near(&c->kinetic, energy[0], kinetic, 40.0 * EPS * (kinetic + mass * size * size), "tree %d", n);
    kt_worst_near(&c->potential, energy[1], potential, 40.0 * EPS * 10.0 * mass * size, "tree %d", n);
}

/* J v is the motion of the body in long double: its angular velocity, and the velocity of its marker. */
static void compare_jacobians(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, comparison *c, int n) {
    static kt_oracle_body body[KT_TREE_SLOTS];
    static double jacobian[6 * KT_TREE_NV * KT_TREE_SLOTS], at[3 * KT_TREE_SLOTS], rate[3 * KT_TREE_SLOTS];
    kt_check_equal_int("jacobians", g->jacobians(g->model, s->q, jacobian), 0);
    kt_check_equal_int("markers", g->markers(g->model, s->q, s->v, at, rate), 0);
    kt_oracle_motion(tree, s->q, s->v, NULL, body);
    for (int b = 1, k = 0; b < tree->count; b++, k++) {
        const kt_vec3 p = kt_marker_at(tree->model, b, 0);
        const double own[3] = {p.x, p.y, p.z};
        long double arm[3];
        for (int i = 0; i < 3; i++)
            arm[i] = body[b].r[i][0] * (long double)own[0] + body[b].r[i][1] * (long double)own[1] +
                     body[b].r[i][2] * (long double)own[2];
        for (int i = 0; i < 6; i++) {
            double sum = 0.0, size = 1.0;
            for (int v = 0; v < tree->nv; v++) {
                const double term = jacobian[(size_t)6 * (size_t)(k * tree->nv + v) + (size_t)i] * s->v[v];
                sum += term;
                size += fabs(term);
            }
            for (int x = 0; x < 3; x++)
                size += (double)(fabsl(body[b].p[x]) + fabsl(body[b].u[x]));
            const int x = i % 3, y = (i + 1) % 3, z = (i + 2) % 3;
            const long double *w = body[b].w;
            const long double right = i < 3 ? w[i] : body[b].u[x] + w[y] * arm[z] - w[z] * arm[y];
            kt_worst_near(&c->jacobians, sum, (double)right, 4.0 * EPS * size * size, "tree %d body %d row %d", n, b,
                          i);
        }
    }
}

static double largest_of(const double *x, int count) {
    double most = 0.0;
    for (int i = 0; i < count; i++)
        most = fmax(most, fabs(x[i]));
    return most;
}

enum { SQUARE = KT_TREE_NV * KT_TREE_NV };

static void compare_matrices(const double *own, const double *right, int nv, double bound, kt_worst *worst, int n) {
    for (int i = 0; i < nv * nv; i++)
        kt_worst_near(worst, own[i], right[i], bound, "tree %d entry %d", n, i);
}

/* Those of inverse dynamics. Returns the size of the largest, at least 1. */
static double compare_load_derivatives(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, const double *a,
                                       void *work, comparison *c, int n) {
    static double own[2][SQUARE], right[2][SQUARE];
    const int nv = tree->nv;
    kt_error error = {0};
    const kt_status status =
        kt_dynamics_inverse_derivatives(tree->model, tree->data, work, kt_dynamics_work_size(tree->model), s->q, s->v,
                                        a, NULL, right[0], right[1], &error);
    kt_check_equal_int("inverse_derivatives", g->inverse_derivatives(g->model, s->q, s->v, a, own[0], own[1]), 0);
    kt_need_fine("derivatives of inverse dynamics", status, &error);
    const double most = fmax(1.0, fmax(largest_of(right[0], nv * nv), largest_of(right[1], nv * nv)));
    compare_matrices(own[0], right[0], nv, LOAD_ROUNDING * EPS * most, &c->derivatives[0], n);
    compare_matrices(own[1], right[1], nv, LOAD_ROUNDING * EPS * most, &c->derivatives[1], n);
    return most;
}

/* Those of forward dynamics. X = -M^-1 D, where D is dtau/dq or dtau/dv at the acceleration a, or -1. Hence
 *
 *   dX = -M^-1 (dD + dM X) + what the solution rounds,
 *
 * with |dD| <= 100 eps max(1, |D|) and |dM| <= 20 eps |M|, which are the bounds of these functions in this file. The
 * solution rounds by 4 eps |X| |M| |M^-1|. D = -1 has no error. A row of dM X has n terms, whose signs differ. One of
 * them is counted. */
static void compare_forward_derivatives(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, double load,
                                        void *work, comparison *c, int n) {
    static double own[3][SQUARE], right[3][SQUARE], mass[SQUARE];
    const int nv = tree->nv;
    kt_error error = {0};
    const kt_status status =
        kt_dynamics_forward_derivatives(tree->model, tree->data, work, kt_dynamics_work_size(tree->model), s->q, s->v,
                                        s->tau, NULL, right[0], right[1], right[2], &error);
    kt_check_equal_int("forward_derivatives",
                       g->forward_derivatives(g->model, s->q, s->v, s->tau, own[0], own[1], own[2]), 0);
    kt_check_equal_int("mass", g->mass(g->model, s->q, mass), 0);
    kt_need_fine("derivatives of forward dynamics", status, &error);
    const double inverse = nv * largest_of(right[2], nv * nv), condition = inverse * largest_of(mass, nv * nv);
    for (int k = 0; k < 3; k++)
        compare_matrices(own[k], right[k], nv,
                         EPS * ((4.0 + MASS_ROUNDING) * condition * largest_of(right[k], nv * nv) +
                                (k < 2 ? LOAD_ROUNDING * inverse * load : 0.0)),
                         &c->derivatives[2 + k], n);
}

/* Against the library, whose derivatives follow from other equations: recursions for derivatives, which have tests with
 * differences. */
static void compare_derivatives(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, comparison *c, int n) {
    double a[KT_TREE_NV] = {0.0};
    const size_t size = kt_dynamics_work_size(tree->model);
    void *work = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    compare_load_derivatives(g, tree, s, s->a, work, c, n);
    kt_check_equal_int("forward", g->forward(g->model, s->q, s->v, s->tau, a), 0);
    const double load = compare_load_derivatives(g, tree, s, a, work, c, n);
    compare_forward_derivatives(g, tree, s, load, work, c, n);
    free(work);
}

/* Against the library: its effects have tests of their own. */
static void compare_effects(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, comparison *c, int n) {
    double tau[KT_TREE_NV], slow[KT_TREE_NV];
    kt_error error = {0};
    kt_check_equal_int("effects", g->effects(g->model, s->q, s->v, tau), 0);
    kt_need_fine("effects", kt_effect_forces(tree->model, tree->data, 0.0, s->q, s->v, slow, &error), &error);
    for (int i = 0; i < tree->nv; i++)
        kt_worst_near(&c->effects, tau[i], slow[i], 4.0 * EPS * (1.0 + fabs(slow[i])), "tree %d coordinate %d", n, i);
}

/* Against inverse dynamics in more digits, with the library's forces of effects. */
static void compare_loaded(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, comparison *c, int n) {
    static long double slow[KT_TREE_NV];
    double a[KT_TREE_NV], effect[KT_TREE_NV], sensitivity[KT_TREE_NV];
    kt_tree_state loaded = *s;
    kt_error error = {0};
    kt_need_fine("effects", kt_effect_forces(tree->model, tree->data, 0.0, s->q, s->v, effect, &error), &error);
    for (int i = 0; i < tree->nv; i++)
        loaded.tau[i] += effect[i];
    kt_need(kt_check_true("regular", kt_oracle_forward(tree, &loaded, slow, sensitivity)));
    kt_check_equal_int("acceleration", g->acceleration(g->model, 0.0, s->q, s->v, NULL, s->tau, a), 0);
    for (int i = 0; i < tree->nv; i++)
        kt_worst_near(&c->loaded, a[i], (double)slow[i], 20.0 * EPS * sensitivity[i], "tree %d coordinate %d", n, i);
}

/* Both take the same stages. Positions and velocities differ by the rounding errors of the accelerations, h times
 * `sensitivity`, which the other coordinates share in later stages. The outputs are the inputs. */
static void compare_steps(kt_generated *g, const kt_tree *tree, const kt_tree_state *s, comparison *c, int n) {
    const kt_method *const method[3] = {kt_method_find("heun"), kt_method_find("rk4"), NULL};
    kt_generated_step *const take[3] = {g->heun, g->rk4, g->semi_implicit};
    const int nq = kt_model_nq(tree->model), count = nq + tree->nv;
    const double h = 1e-3;
    double sensitivity[KT_TREE_NV], most = 1.0;
    static long double slow[KT_TREE_NV];
    kt_need(kt_check_true("regular", kt_oracle_forward(tree, s, slow, sensitivity)));
    for (int i = 0; i < tree->nv; i++)
        most = fmax(most, fabs(s->v[i]) + h * sensitivity[i]);
    for (int k = 0; k < 3; k++) {
        double next[KT_TREE_NQ + KT_TREE_NV], own[KT_TREE_NQ + KT_TREE_NV];
        memcpy(own, s->q, (size_t)nq * sizeof *own);
        memcpy(own + nq, s->v, (size_t)tree->nv * sizeof *own);
        kt_generated_library_step(tree, method[k], 0.0, h, s, next);
        kt_check_equal_int("step", take[k](g->model, own, own + nq, s->tau, h, own, own + nq), 0);
        for (int i = 0; i < count; i++)
            kt_worst_near(&c->steps, own[i], next[i], 40.0 * EPS * (most + fabs(next[i])),
                          "tree %d method %d number %d", n, k, i);
    }
}

static void compare_all(kt_generated *g, const kt_tree *tree, kt_random *random, comparison *c, int n) {
    kt_tree_state s;
    kt_tree_state_draw(tree, random, &s);
    memset(s.external, 0, sizeof s.external);
    compare_forces(g, tree, &s, c, n);
    compare_mass(g, tree, &s, c, n);
    compare_effects(g, tree, &s, c, n);
    compare_loaded(g, tree, &s, c, n);
    compare_motion(g, tree, &s, c, n);
    compare_steps(g, tree, &s, c, n);
    compare_jacobians(g, tree, &s, c, n);
    compare_derivatives(g, tree, &s, c, n);
}

enum { EFFECTS = 2 * KT_TREE_BODIES };

/* Springs and dampers in the joints of one coordinate, one or both. Compiles the tree again. */
static void add_effects(kt_tree *tree, kt_random *random, kt_effect effect[EFFECTS], char name[EFFECTS][16]) {
    int count = 0;
    for (int b = 1; b < tree->count; b++)
        for (int k = 0; k < 2 && kt_body_coordinates(tree->model, b).nv == 1; k++) {
            if (kt_random_int(random, 0, 1) != 0)
                continue;
            kt_effect *e = &effect[count];
            *e = kt_effect_default();
            snprintf(name[count], sizeof name[count], "e%d", count);
            e->name = name[count];
            e->type = k == 0 ? KT_EFFECT_JOINT_DAMPER : KT_EFFECT_JOINT_SPRING;
            e->joint = tree->description.bodies[kt_body_source(tree->model, b)].name;
            e->damping = kt_random_uniform(random, 0.1, 2.0);
            e->stiffness = k == 0 ? 0.0 : kt_random_uniform(random, 0.1, 2.0);
            if (k == 1)
                e->rest = kt_function_constant(kt_random_uniform(random, -1.0, 1.0));
            count++;
        }
    tree->description.effects = effect;
    tree->description.effect_count = count;
    kt_tree_compile(tree, NULL);
}

static kt_tree_plan draw_plan(kt_random *random, int n) {
    kt_tree_plan plan = n % 4 == 3 ? kt_tree_plan_planar() : kt_tree_plan_default();
    plan.bodies = kt_random_int(random, 1, n % 2 ? 16 : 5);
    plan.floats = n % 3 == 0 && n % 4 != 3;
    plan.is_shuffled = n % 2 == 1 && n % 4 != 3;
    plan.with_armature = n % 2 ? 0.5 : 0.0;
    return plan;
}

/* Every type of joint, massless bodies, armature, fixed bodies, several trees, planar trees. Numbers are fixed in each
 * fifth file. */
KT_TEST(generated_trees_agree_with_kane_in_long_double) {
    kt_random random = kt_random_of_test();
    comparison c = comparison_make();
    static kt_generated g;
    kt_generated_need_compiler();
    int articulated = 0, by_mass = 0, parts[2] = {0};
    for (int n = 0; n < count_mechanisms(KT_SHORT(6, 20)); n++) {
        kt_tree tree;
        const kt_tree_plan plan = draw_plan(&random, n);
        kt_effect effect[EFFECTS];
        char name[EFFECTS][16];
        kt_tree_grow(&tree, &plan, &random);
        add_effects(&tree, &random, effect, name);
        if (tree.nv == 0)
            continue;
        (n % 5 == 4 ? kt_generated_fold : kt_generated_make)(&g, tree.model, "cc -O0");
        *(g.is_articulated ? &articulated : &by_mass) += 1;
        for (int k = 0; k < 2; k++)
            parts[k] += g.has_parts[k];
        for (int k = 0; k < 4; k++)
            compare_all(&g, &tree, &random, &c, n);
    }
    comparison_check(&c);
    kt_check_above("trees by articulated bodies", articulated, KT_SHORT(1, 3));
    kt_check_above("trees by the mass matrix", by_mass, KT_SHORT(1, 3));
    kt_check_above("trees whose forward dynamics have parts", parts[0], KT_SHORT(1, 3));
    if (KT_SHORT(0, 1)) /* few have them */
        kt_check_above("trees whose mass matrix has parts", parts[1], 0);
}

/* Long planar trees, whose forward dynamics take the axes of the plane: pins and slides, with and without armature. */
KT_TEST(generated_planar_trees_agree_with_kane_in_long_double) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("forward dynamics");
    static kt_generated g;
    int planar = 0;
    kt_generated_need_compiler();
    for (int n = 0; n < count_mechanisms(KT_SHORT(3, 12)); n++) {
        kt_tree tree;
        kt_tree_plan plan = kt_tree_plan_planar();
        plan.bodies = kt_random_int(&random, 8, 20);
        plan.with_armature = n % 2 ? 0.5 : 0.0;
        kt_tree_grow(&tree, &plan, &random);
        kt_need(kt_check_above("coordinates", tree.nv, 1));
        kt_generated_make_some(&g, tree.model, KT_CODEGEN_FORWARD, "cc -O0", false);
        planar += g.is_planar;
        for (int k = 0; k < 4; k++) {
            static long double slow[KT_TREE_NV];
            double a[KT_TREE_NV], sensitivity[KT_TREE_NV];
            kt_tree_state s;
            kt_tree_state_draw(&tree, &random, &s);
            memset(s.external, 0, sizeof s.external);
            kt_need(kt_check_true("regular", kt_oracle_forward(&tree, &s, slow, sensitivity)));
            kt_check_equal_int("forward", g.forward(g.model, s.q, s.v, s.tau, a), 0);
            for (int i = 0; i < tree.nv; i++)
                kt_worst_near(&worst, a[i], (double)slow[i], 20.0 * EPS * sensitivity[i], "tree %d coordinate %d", n,
                              i);
        }
    }
    kt_check_above("trees in the axes of the plane", planar, KT_SHORT(1, 5));
}

static int count_nonzero(const double *x, int count) {
    int found = 0;
    for (int i = 0; i < count; i++)
        found += x[i] != 0.0;
    return found;
}

/* The numbers of a description that are not zero and that a mechanism depends on. */
static int count_numbers(const kt_tree *tree) {
    int count = count_nonzero(&tree->description.gravity.x, 3);
    for (int b = 1; b < tree->count; b++) {
        const kt_body *body = &tree->description.bodies[kt_body_source(tree->model, b)];
        const kt_sym3 *j = &body->inertia;
        const double inertia[6] = {j->xx, j->yy, j->zz, j->xy, j->xz, j->yz};
        count += count_nonzero(&body->joint.at.x, 3) + count_nonzero(&body->markers[0].at.x, 3);
        count += count_nonzero(body->joint.armature, kt_body_coordinates(tree->model, b).nv);
        count += body->joint.type == KT_JOINT_SCREW && body->joint.pitch != 0.0;
        if (kt_oracle_moves(tree, b))
            count += count_nonzero(inertia, 6) + (body->mass != 0.0 ? 1 + count_nonzero(&body->com.x, 3) : 0);
    }
    for (int i = 0; i < tree->description.effect_count; i++)
        count += tree->description.effects[i].type == KT_EFFECT_JOINT_SPRING ? 3 : 1;
    return count;
}

/* Each parameter is changed alone, in the file and in the description. A constant that was folded by mistake, or a
 * parameter with another name, would differ by far more than rounding. */
KT_TEST(each_parameter_changes_the_functions_as_it_changes_the_mechanism) {
    kt_random random = kt_random_of_test();
    comparison c = comparison_make();
    static kt_generated g;
    int changed = 0;
    kt_generated_need_compiler();
    for (int n = 0; n < count_mechanisms(KT_SHORT(1, 4)); n++) {
        kt_tree tree;
        kt_tree_plan plan = draw_plan(&random, n);
        plan.bodies = 9; /* each type of joint once; a base that floats would take the place of another type */
        plan.floats = false;
        plan.with_armature = 1.0;
        kt_effect effect[EFFECTS];
        char name[EFFECTS][16];
        kt_tree_grow(&tree, &plan, &random);
        add_effects(&tree, &random, effect, name);
        kt_generated_make(&g, tree.model, "cc -O0");
        const uint64_t structure = kt_codegen_structure(tree.model);
        kt_check_equal_int("each number is a parameter", g.count, count_numbers(&tree));
        for (int k = 0; k < g.count; k++) {
            double parameter[KT_GENERATED_PARAMETERS];
            double *number = kt_generated_number(&tree, g.name[k]);
            if (number == NULL)
                break;
            const double before = *number;
            memcpy(parameter, g.standard, (size_t)g.count * sizeof *parameter);
            kt_check_equal_bits(g.name[k], &parameter[k], &before, 1);
            parameter[k] = *number = before * kt_random_uniform(&random, 1.05, 1.3);
            tree.description.inertia_check = KT_INERTIA_ACCEPT;
            kt_tree_compile(&tree, NULL);
            kt_check_true("the structure is the same", kt_codegen_structure(tree.model) == structure);
            g.prepare(parameter, g.model);
            compare_all(&g, &tree, &random, &c, n);
            changed++;
            *number = before;
        }
    }
    kt_check_above("parameters that were changed", changed, KT_SHORT(50, 200));
    comparison_check(&c);
}
