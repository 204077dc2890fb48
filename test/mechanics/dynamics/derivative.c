/* Derivatives of inverse and forward dynamics: against differences of the slow equations in long double, against each
 * other, and against a closed form. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/dynamics.h"
#include "oracle.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EPS DBL_EPSILON
#define STEP 0.003 /* of differences: their error is some h^8 */
enum { TREES = 40, DIFFERENCED = 16, MOST = KT_TREE_NV * KT_TREE_NV };

typedef struct derivatives {
    double tau_q[MOST], tau_v[MOST], a_q[MOST], a_v[MOST], a_tau[MOST];
} derivatives;

static void derive(const kt_tree *t, const kt_tree_state *s, const kt_wrench *external, derivatives *d) {
    const size_t size = kt_dynamics_work_size(t->model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    kt_error e = {0};
    kt_need_fine("inverse derivatives",
                 kt_dynamics_inverse_derivatives(t->model, t->data, work, size, s->q, s->v, s->a, external, d->tau_q,
                                                 d->tau_v, &e),
                 &e);
    kt_need_fine("forward derivatives",
                 kt_dynamics_forward_derivatives(t->model, t->data, work, size, s->q, s->v, s->tau, external, d->a_q,
                                                 d->a_v, d->a_tau, &e),
                 &e);
    free(work);
}

/* Spatial trees of all types, and every fourth moves in planes. */
static kt_tree_plan draw_plan(int n, kt_random *random) {
    kt_tree_plan plan = n % 4 == 3 ? kt_tree_plan_planar() : kt_tree_plan_default();
    plan.bodies = kt_random_int(random, 1, 10);
    plan.floats = n % 8 == 0;
    return plan;
}

/* ---- differences ------------------------------------------------------------------------------------------------- */

/* f at q (+) h e_j, or v + h e_j: inverse or forward dynamics by the slow equations. */
typedef struct slope {
    const kt_tree *tree;
    const kt_tree_state *state;
    bool forward, rate;
    int j;
} slope;

static bool sample(const slope *p, double h, long double *f) {
    static long double unused[KT_TREE_NV];
    static double sensitivity[KT_TREE_NV];
    kt_tree_state s = *p->state;
    double step[KT_TREE_NV] = {0};
    step[p->j] = h;
    if (p->rate)
        s.v[p->j] += h;
    else
        kt_position_add(p->tree->model, s.q, step, s.q);
    if (p->forward)
        return kt_oracle_forward(p->tree, &s, f, sensitivity);
    kt_oracle_inverse(p->tree, &s, s.a, f, unused);
    return true;
}

/* Central differences of order eight. */
static bool difference(const slope *p, double *out) {
    static const long double weight[] = {4.0L / 5.0L, -1.0L / 5.0L, 4.0L / 105.0L, -1.0L / 280.0L};
    long double up[KT_TREE_NV], down[KT_TREE_NV], sum[KT_TREE_NV] = {0};
    for (int k = 0; k < 4; k++) {
        if (!sample(p, (k + 1) * STEP, up) || !sample(p, -(k + 1) * STEP, down))
            return false;
        for (int i = 0; i < p->tree->nv; i++)
            sum[i] += weight[k] / (long double)STEP * (up[i] - down[i]);
    }
    for (int i = 0; i < p->tree->nv; i++)
        out[i] = (double)sum[i];
    return true;
}

/* Compares with the largest in the column. The bound is 1e-8 for large accelerations next to a singular position, as
 * differences are less exact there. It is 1e-12 for forces. If a column vanishes, rounding errors remain: those of the
 * moved positions (matrix) and those of the sums of forces (f). */
static void compare(const slope *shape, const double *matrix, const double *f, kt_worst *worst, int n) {
    const int nv = shape->tree->nv;
    const double relative = shape->forward ? 1e-8 : 1e-12;
    const double rounding = EPS / STEP * kt_tree_largest(matrix, nv * nv) + EPS * kt_tree_largest(f, nv);
    for (int j = 0; j < nv; j++) {
        double expected[KT_TREE_NV];
        slope p = *shape;
        p.j = j;
        if (!difference(&p, expected))
            return;
        const double bound = relative * kt_tree_largest(expected, nv) + rounding;
        for (int i = 0; i < nv; i++)
            kt_worst_near(worst, matrix[j * nv + i], expected[i], bound, "tree %d row %d column %d", n, i, j);
    }
}

KT_TEST(derivatives_are_those_of_differences_on_random_trees) {
    kt_random random = kt_random_of_test();
    static derivatives d;
    kt_worst error[4] = {kt_worst_make("dtau/dq"), kt_worst_make("dtau/dv"), kt_worst_make("da/dq"),
                         kt_worst_make("da/dv")};
    for (int n = 0; n < DIFFERENCED; n++) {
        kt_tree tree;
        kt_tree_state s;
        const kt_tree_plan plan = draw_plan(n, &random);
        kt_tree_sample(&tree, &plan, &random, &s);
        double f[2][KT_TREE_NV];
        kt_tree_inverse(&tree, &s, f[0]);
        kt_tree_forward(&tree, &s, f[1]);
        derive(&tree, &s, s.external, &d);
        for (int k = 0; k < 4; k++) {
            const double *const matrix[] = {d.tau_q, d.tau_v, d.a_q, d.a_v};
            compare(&(slope){.tree = &tree, .state = &s, .forward = k >= 2, .rate = k % 2}, matrix[k], f[k / 2],
                    &error[k], n);
        }
    }
    for (int k = 0; k < 4; k++)
        kt_check_worst(&error[k]);
}

/* ---- identities -------------------------------------------------------------------------------------------------- */

/* sum_k A_ik B_kj, and the size of its terms */
static double product(const double *a, const double *b, int nv, int i, int j, double *size) {
    double sum = 0.0;
    *size = 0.0;
    for (int k = 0; k < nv; k++) {
        sum += a[k * nv + i] * b[j * nv + k];
        *size += fabs(a[k * nv + i] * b[j * nv + k]);
    }
    return sum;
}

#define C 60.0 /* measured: 15 at most over 8 seeds */

/* M da/dx = -dtau/dx at the accelerations of the motion, M da/dtau = 1. */
KT_TEST(forward_derivatives_solve_inverse_derivatives) {
    kt_random random = kt_random_of_test();
    static derivatives d;
    static double mass[MOST];
    kt_worst error[3] = {kt_worst_make("M da/dq + dtau/dq"), kt_worst_make("M da/dv + dtau/dv"),
                         kt_worst_make("M da/dtau - 1")};
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = draw_plan(n, &random);
        plan.bodies = kt_random_int(&random, 1, KT_TREE_BODIES);
        plan.with_armature = n % 3 == 1 ? 0.5 : 0.0;
        kt_tree_sample(&tree, &plan, &random, &s);
        for (int b = 0; b < tree.count && n % 2 == 0; b++)
            s.external[b] = (kt_wrench){0};
        kt_tree_forward(&tree, &s, s.a);
        derive(&tree, &s, n % 2 ? s.external : NULL, &d);
        kt_tree_mass(&tree, &s, mass);
        const double largest = kt_tree_largest(d.tau_q, tree.nv * tree.nv);
        for (int i = 0; i < tree.nv; i++)
            for (int j = 0; j < tree.nv; j++) {
                double size[3];
                const double q = product(mass, d.a_q, tree.nv, i, j, &size[0]);
                const double v = product(mass, d.a_v, tree.nv, i, j, &size[1]);
                const double one = product(mass, d.a_tau, tree.nv, i, j, &size[2]);
                const int at = j * tree.nv + i;
                const double tau = 1.0 + largest; /* external wrenches are of the order of one */
                kt_worst_near(&error[0], q, -d.tau_q[at], C * EPS * (size[0] + tau), "tree %d %d %d", n, i, j);
                kt_worst_near(&error[1], v, -d.tau_v[at], C * EPS * (size[1] + tau), "tree %d %d %d", n, i, j);
                kt_worst_near(&error[2], one, i == j, C * EPS * (size[2] + 1.0), "tree %d %d %d", n, i, j);
            }
    }
    for (int k = 0; k < 3; k++)
        kt_check_worst(&error[k]);
}

/* ---- a closed form ----------------------------------------------------------------------------------------------- */

/* Two point masses 1 and m on rods of length 1 and l, angles x and x + y from the vertical, gravity g:
 *   tau_y = m l^2 (a + b) + m l cos y a + m l sin y v^2 + m g l sin (x + y)
 *   tau_x = tau_y + (1 + m) a + m l cos y (a + b) - m l sin y (v + w)^2 + (1 + m) g sin x
 * with v, w and a, b the rates of x, y. */
KT_TEST(derivatives_of_a_double_pendulum_are_those_on_paper) {
    const double m = 0.7, l = 1.3, g = 9.81, x = 0.4, y = -1.1, v = 0.6, w = -1.7, a = 2.1, b = -0.8;
    kt_body bodies[2] = {kt_body_default(), kt_body_default()};
    for (int i = 0; i < 2; i++) {
        bodies[i].name = i ? "lower" : "upper";
        bodies[i].parent = i ? "upper" : NULL;
        bodies[i].joint.type = KT_JOINT_REVOLUTE;
        bodies[i].joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
        bodies[i].mass = i ? m : 1.0;
        bodies[i].com = kt_vec3_make(0.0, 0.0, i ? -l : -1.0);
    }
    bodies[1].joint.at = kt_vec3_make(0.0, 0.0, -1.0);
    kt_tree tree = {.description = kt_description_default()};
    tree.description.bodies = bodies;
    tree.description.body_count = 2;
    tree.description.gravity = kt_vec3_make(0.0, 0.0, -g);
    static derivatives d;
    static kt_tree_state s;
    kt_tree_compile(&tree, NULL);
    memcpy(s.q, (double[]){x, y}, 2 * sizeof(double));
    memcpy(s.v, (double[]){v, w}, 2 * sizeof(double));
    memcpy(s.a, (double[]){a, b}, 2 * sizeof(double));
    derive(&tree, &s, NULL, &d);
    const double low = m * g * l * cos(x + y), high = (1.0 + m) * g * cos(x), c = m * l * cos(y), e = m * l * sin(y);
    const double yy = -e * a + c * v * v + low, xy = yy - e * (a + b) - c * (v + w) * (v + w);
    const double q[] = {low + high, low, xy, yy};
    const double rate[] = {2.0 * e * v - 2.0 * e * (v + w), 2.0 * e * v, -2.0 * e * (v + w), 0.0};
    KT_WORST error = kt_worst_make("column by column");
    for (int i = 0; i < 4; i++) {
        kt_worst_near(&error, d.tau_q[i], q[i], 10.0 * EPS * 20.0, "dtau/dq %d", i);
        kt_worst_near(&error, d.tau_v[i], rate[i], 10.0 * EPS * 2.0, "dtau/dv %d", i);
    }
}

/* ---- rejections -------------------------------------------------------------------------------------------------- */

static kt_status call(const kt_tree *t, const kt_tree_state *s, bool forward, void *work, size_t size, double *out,
                      kt_error *e) {
    return forward ? kt_dynamics_forward_derivatives(t->model, t->data, work, size, s->q, s->v, s->tau, s->external,
                                                     out, out + MOST, out + 2 * MOST, e)
                   : kt_dynamics_inverse_derivatives(t->model, t->data, work, size, s->q, s->v, s->a, s->external, out,
                                                     out + MOST, e);
}

KT_TEST(what_is_not_finite_or_too_small_is_rejected_and_nothing_is_written) {
    kt_random random = kt_random_of_test();
    static double out[3 * MOST], before[3 * MOST];
    kt_tree tree;
    kt_tree_state s;
    const kt_tree_plan plan = kt_tree_plan_default();
    kt_error e = {0};
    kt_tree_grow(&tree, &plan, &random);
    const size_t size = kt_dynamics_work_size(tree.model);
    char *work = aligned_alloc(KT_ALIGNMENT, size + KT_ALIGNMENT);
    for (int i = 0; i < 3 * MOST; i++)
        out[i] = before[i] = i;
    for (int forward = 0; forward < 2; forward++) {
        for (int k = 0; k < 5; k++) {
            kt_tree_state_draw(&tree, &random, &s);
            double *const spoilt[] = {&s.q[3], &s.v[2], forward ? &s.tau[1] : &s.a[1], &s.external[2].force.y};
            if (k < 4)
                *spoilt[k] = (double)NAN;
            for (int i = 0; i < tree.nv && k == 4; i++) /* of all joints: a slide's alone need not overflow */
                s.v[i] = 1e200;
            kt_check_equal_int("not finite", call(&tree, &s, forward, work, size, out, &e), KT_ERROR_NOT_FINITE);
        }
        kt_tree_state_draw(&tree, &random, &s);
        kt_check_equal_int("short", call(&tree, &s, forward, work, size - 1, out, &e), KT_ERROR_MEMORY);
        kt_check_equal_int("askew", call(&tree, &s, forward, work + 8, size, out, &e), KT_ERROR_MEMORY);
        kt_check_equal_int("none", call(&tree, &s, forward, NULL, size, out, &e), KT_ERROR_MEMORY);
        kt_check_equal_bits("outputs", out, before, 3 * MOST);
        kt_check_equal_int("well", call(&tree, &s, forward, work, size, out, &e), KT_OK);
        memcpy(out, before, sizeof out);
    }
    free(work);
}

/* Two links of 0.1 m: the lower has one unit of mass at its end, and the upper nearly no mass. If they are almost
 * stretched, a small turn of the lower changes the accelerations by several times their size. */
static void grow_whip(kt_tree *tree, kt_isa isa, double unit) {
    const double mass[2] = {1e-3 * unit, unit};
    memset(tree, 0, sizeof *tree);
    for (int i = 0; i < 2; i++) {
        tree->body[i] = kt_body_of(i ? "lower" : "upper", i ? "upper" : NULL, KT_JOINT_REVOLUTE, mass[i]);
        tree->body[i].com = kt_vec3_make(0.0, 0.1, 0.0);
        tree->body[i].joint.at = kt_vec3_make(0.0, 0.1 * i, 0.0);
    }
    tree->description = kt_description_of(tree->body, 2, NULL, 0, NULL, 0);
    kt_model_options options = kt_model_options_default();
    options.isa = isa;
    kt_tree_compile(tree, &options);
}

/* The motions and forces are still finite, but their derivatives overflow. */
KT_TEST(derivatives_that_overflow_alone_are_rejected_and_nothing_is_written) {
    double out[3 * 4], before[3 * 4], tau[2], a[2];
    const double q[2] = {0.3, 0.1}, rest[2] = {2e307, 5e307}, fast[2] = {1e153, 1e153};
    for (int i = 0; i < 3 * 4; i++)
        out[i] = before[i] = i;
    for (kt_isa isa = KT_ISA_BASE; isa <= KT_ISA_V4; isa++) {
        kt_tree tree;
        kt_error e = {0};
        if (kt_isa_resolve(isa) == KT_ISA_AUTO)
            continue;
        grow_whip(&tree, isa, 1.0);
        const kt_model *m = tree.model;
        const size_t size = kt_dynamics_work_size(m);
        char *work = aligned_alloc(KT_ALIGNMENT, size);
        kt_check_equal_int("forces", kt_dynamics_inverse(m, tree.data, q, NULL, rest, NULL, tau, &e), KT_OK);
        kt_check_equal_int("motion", kt_dynamics_forward(m, tree.data, q, NULL, tau, NULL, a, &e), KT_OK);
        kt_check_near("acceleration", a[1], rest[1], 1e-12 * rest[1]);
        for (int unit = 0; unit <= 1; unit++) {
            kt_check_equal_int("its derivatives",
                               kt_dynamics_forward_derivatives(m, tree.data, work, size, q, NULL, tau, NULL, out,
                                                               out + 4, unit ? out + 8 : NULL, &e),
                               KT_ERROR_NOT_FINITE);
            kt_check_contains("words", e.message, "they overflow: look for");
        }
        grow_whip(&tree, isa, 1e6);
        kt_check_equal_int("fast", kt_kinematics_update(tree.model, tree.data, q, fast, NULL, &e), KT_OK);
        kt_check_equal_int(
            "derivatives of its force",
            kt_dynamics_inverse_derivatives(tree.model, tree.data, work, size, q, fast, NULL, NULL, out, out + 4, &e),
            KT_ERROR_NOT_FINITE);
        kt_check_contains("words", e.message, "they overflow: look for");
        free(work);
    }
    kt_check_equal_bits("outputs", out, before, 3 * 4);
}

/* If all joints are fixed, there is nothing to return and nothing to write, neither numbers nor outside the memory. */
KT_TEST(derivatives_of_what_cannot_move_touch_nothing) {
    enum { AROUND = 8192 };
    kt_tree tree;
    kt_error e = {0};
    double out[2] = {7.0, 7.0};
    memset(&tree, 0, sizeof tree);
    tree.body[0] = kt_body_default();
    tree.body[0].name = "rock";
    tree.body[0].mass = 1.0;
    tree.description = kt_description_of(tree.body, 1, NULL, 0, NULL, 0);
    const kt_model_options options = kt_model_options_default();
    kt_tree_compile(&tree, &options);
    const size_t size = kt_dynamics_work_size(tree.model);
    unsigned char *memory =
        aligned_alloc(KT_ALIGNMENT, 2 * AROUND + (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    memset(memory, 0xA5, 2 * AROUND + size);
    kt_check_equal_int("forces",
                       kt_dynamics_inverse_derivatives(tree.model, tree.data, memory + AROUND, size, out, out, out,
                                                       NULL, out, out + 1, &e),
                       KT_OK);
    kt_check_equal_int("motion",
                       kt_dynamics_forward_derivatives(tree.model, tree.data, memory + AROUND, size, out, out, out,
                                                       NULL, out, out + 1, NULL, &e),
                       KT_OK);
    int touched = 0;
    for (size_t i = 0; i < AROUND; i++)
        touched += (memory[i] != 0xA5) + (memory[AROUND + size + i] != 0xA5);
    kt_check_equal_int("bytes touched around the memory", touched, 0);
    kt_check_true("nothing is written", out[0] == 7.0 && out[1] == 7.0);
    free(memory);
}

/* No velocity, acceleration, force: zeros. No place for da/dtau: the others are the same. */
KT_TEST(null_stands_for_zeros_and_for_what_is_not_asked) {
    kt_random random = kt_random_of_test();
    static const double zeros[KT_TREE_NV];
    static double with[3 * MOST], without[3 * MOST];
    for (int n = 0; n < 6; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_error e = {0};
        kt_tree_plan plan = draw_plan(n, &random);
        plan.bodies += 3;
        kt_tree_sample(&tree, &plan, &random, &s);
        const kt_model *m = tree.model;
        const size_t size = kt_dynamics_work_size(m), nn = (size_t)tree.nv * (size_t)tree.nv;
        void *work = aligned_alloc(KT_ALIGNMENT, size);
        double *b = with + MOST, *c = with + 2 * MOST, *y = without + MOST;
        kt_check_equal_int(
            "zeros",
            kt_dynamics_inverse_derivatives(m, tree.data, work, size, s.q, zeros, zeros, s.external, with, b, &e),
            KT_OK);
        kt_check_equal_int(
            "NULL",
            kt_dynamics_inverse_derivatives(m, tree.data, work, size, s.q, NULL, NULL, s.external, without, y, &e),
            KT_OK);
        kt_check_equal_bits("dtau/dq", without, with, nn);
        kt_check_equal_bits("dtau/dv", y, b, nn);
        kt_check_equal_int(
            "zeros",
            kt_dynamics_forward_derivatives(m, tree.data, work, size, s.q, zeros, zeros, s.external, with, b, c, &e),
            KT_OK);
        kt_check_equal_int("NULL",
                           kt_dynamics_forward_derivatives(m, tree.data, work, size, s.q, NULL, NULL, s.external,
                                                           without, y, NULL, &e),
                           KT_OK);
        kt_check_equal_bits("da/dq", without, with, nn);
        kt_check_equal_bits("da/dv", y, b, nn);
        free(work);
    }
}
