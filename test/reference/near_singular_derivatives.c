/* Derivatives next to singular positions, of accelerations, steps, linearisations and stiffness, against differences of
 * an oracle in quadruple precision (near_singular.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "near_mechanisms.h"

#include "kinetree/analysis.h"
#include "kinetree/mechanism.h"
#include "kinetree/sensitivity.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* The change of the acceleration along a change of the state that the loops allow. It is a central difference of the
 * oracle. */
static bool oracle_change(const quad_mechanism *m, const near_state *n, const quad *along, quad *dv, quad *da) {
    const quad e = 1e-9Q * (quad)n->least;
    quad v[2][QUAD_NV], a[2][QUAD_NV];
    for (int i = 0; i < 2; i++) {
        quad step[QUAD_NV], q[QUAD_NQ];
        for (int j = 0; j < m->nv; j++)
            step[j] = (i ? e : -e) * along[j], v[i][j] = n->v[j];
        quad_add(m, n->q, step, q);
        if (!quad_close(m, q) || !quad_close_velocity(m, q, v[i]) || !quad_accelerate(m, q, v[i], a[i]))
            return false;
    }
    for (int j = 0; j < m->nv; j++)
        dv[j] = (v[1][j] - v[0][j]) / (2 * e), da[j] = (a[1][j] - a[0][j]) / (2 * e);
    return true;
}

/* Derivatives are those of the motion, or rejected. If the error of an acceleration is c eps v^2 / s^3, its derivatives
 * have an error of that over s. If the path bends, the derivatives themselves are d v^2 / s^4. The results then have
 * the same relative error, about eps / d. All but 2 % of the states are computed. */
KT_TEST(derivatives_next_to_singular_positions_are_right_or_rejected) {
    static const double distances[] = {1e-10, 1e-7, 1e-4};
    static unsigned char work[1 << 20] __attribute__((aligned(64)));
    KT_WORST worst = kt_worst_make("change of the acceleration"), known = kt_worst_make("the same, over d");
    singular s = {.seed = 0};
    int rejected = 0, told = 0, all = 0;
    for (int i = 0; i < near_mechanisms(); i++) {
        near_next(&s);
        kt_random r = kt_random_named("along");
        for (size_t id = 0; id < sizeof distances / sizeof *distances; id++) {
            const quad_mechanism m = near_off_by(&s, distances[id]);
            library l;
            near_state n;
            kt_need(kt_check_true("compiles", near_compile(&l, &m)));
            for (int k = 1; k <= 10; k++) {
                double dq[QUAD_NV * QUAD_NV], dv[QUAD_NV * QUAD_NV], worst_error = 0.0, size = 1.0;
                quad along[QUAD_NV], change_v[QUAD_NV], change_a[QUAD_NV];
                kt_error e = {0};
                if (!near_state_at(&s, &m, pow(10.0, -k), &n))
                    continue;
                for (int j = 0; j < m.nv; j++)
                    along[j] = kt_random_normal(&r);
                if (!quad_close_velocity(&m, n.q, along) || !oracle_change(&m, &n, along, change_v, change_a))
                    continue;
                const kt_status status = kt_acceleration_derivatives(l.model, l.data, work, sizeof work, 0.0, n.q_of,
                                                                     n.v_of, m.tau, NULL, dq, dv, NULL, &e);
                all++;
                if (status == KT_ERROR_SINGULAR) {
                    rejected++;
                    continue;
                }
                for (int row = 0; row < m.nv; row++) {
                    quad sum = 0;
                    for (int j = 0; j < m.nv; j++)
                        sum += dq[j * m.nv + row] * along[j] + dv[j * m.nv + row] * change_v[j];
                    worst_error = fmax(worst_error, fabs((double)(sum - change_a[row])));
                    size = fmax(size, fabs((double)change_a[row]));
                }
                if (status != KT_OK)
                    worst_error = HUGE_VAL;
                const double s2 = n.least * n.least,
                             bound = 1e-9 * size + 30.0 * DBL_EPSILON * n.speed * n.speed / (s2 * s2);
                if (!(worst_error <= bound) && told++ < 40)
                    kt_note("seed %d, d = %g, h = 1e-%d, s = %.1e: |da| = %.1e, error %.1e of %.1e %s", s.seed,
                            distances[id], k, n.least, size, worst_error, bound, e.message);
                kt_worst_below(&worst, worst_error, bound, "seed %d, d = %g, h = 1e-%d", s.seed, distances[id], k);
                kt_worst_below(&known, worst_error, (1e-11 + 20.0 * DBL_EPSILON / distances[id]) * size,
                               "seed %d, d = %g, h = 1e-%d", s.seed, distances[id], k);
            }
            near_discard(&l);
        }
    }
    kt_note("%d rejected of %d", rejected, all);
    kt_check_below("rejected, of all", (double)rejected / all, 0.02);
}

/* ---- steps, linearisations, stiffness ---------------------------------------------------------------------------- */

/* The velocities onto the loops with the least change of kinetic energy: M dv = A' lambda, A (v + dv) = 0. Column j of
 * the inverse of M is the acceleration of the tree under a unit force j. */
static bool oracle_impulse(const quad_mechanism *m, const quad *q, quad *v) {
    quad_mechanism tree = *m;
    quad A[QUAD_ROWS][QUAD_NV], inverse[QUAD_NV][QUAD_NV], S[QUAD_ROWS][QUAD_NV], right[QUAD_ROWS], lambda[QUAD_NV];
    quad rest[QUAD_NV], none[QUAD_NV];
    tree.loops = 0;
    quad_count(&tree);
    memset(none, 0, sizeof none);
    memset(S, 0, sizeof S);
    if (!quad_accelerate(&tree, q, none, rest))
        return false;
    for (int j = 0; j < m->nv; j++) {
        tree.tau[j] += 1.0;
        if (!quad_accelerate(&tree, q, none, inverse[j]))
            return false;
        tree.tau[j] = m->tau[j];
        for (int i = 0; i < m->nv; i++) /* divides by the step after the rounding of tau[j] + 1 */
            inverse[j][i] = (inverse[j][i] - rest[i]) / ((quad)(m->tau[j] + 1.0) - m->tau[j]);
    }
    quad_jacobian(m, q, A);
    for (int r = 0; r < m->rows; r++) {
        right[r] = 0;
        for (int j = 0; j < m->nv; j++)
            right[r] += A[r][j] * v[j];
        for (int c = 0; c < m->rows; c++)
            for (int i = 0; i < m->nv; i++)
                for (int j = 0; j < m->nv; j++)
                    S[r][c] += A[r][i] * inverse[j][i] * A[c][j];
    }
    if (!quad_least(m->rows, m->rows, &S[0][0], QUAD_NV, right, lambda))
        return false;
    for (int r = 0; r < m->rows; r++)
        for (int i = 0; i < m->nv; i++)
            for (int j = 0; j < m->nv; j++)
                v[i] -= inverse[j][i] * A[r][j] * lambda[r];
    return true;
}

/* One of Euler's steps and the projection, of a mechanism without quaternions. */
static bool oracle_step(const quad_mechanism *m, quad h, quad *q, quad *v) {
    quad a[QUAD_NV];
    if (!quad_accelerate(m, q, v, a))
        return false;
    for (int j = 0; j < m->nv; j++) {
        q[j] += h * v[j];
        v[j] += h * a[j];
    }
    return quad_close(m, q) && oracle_impulse(m, q, v);
}

/* The changes after a step along (along, dv). */
static bool oracle_step_change(const quad_mechanism *m, const near_state *n, double h, const quad *along,
                               const quad *dv, quad *change) {
    const quad e = 1e-9Q * (quad)n->least;
    quad q[2][QUAD_NQ], v[2][QUAD_NV];
    for (int i = 0; i < 2; i++) {
        for (int j = 0; j < m->nv; j++) {
            q[i][j] = n->q[j] + (i ? e : -e) * along[j];
            v[i][j] = n->v[j] + (i ? e : -e) * dv[j];
        }
        if (!quad_close(m, q[i]) || !quad_close_velocity(m, q[i], v[i]) || !oracle_step(m, h, q[i], v[i]))
            return false;
    }
    for (int j = 0; j < m->nv; j++) {
        change[j] = (q[1][j] - q[0][j]) / (2 * e);
        change[m->nv + j] = (v[1][j] - v[0][j]) / (2 * e);
    }
    return true;
}

/* The changes after a step due to the inputs along `push`, of mechanisms whose inputs are apart by 2e-9 of it. Inputs
 * are doubles, so their difference is exact. The function sets `push` to this difference. */
static bool oracle_input_change(const quad_mechanism *m, const near_state *n, double h, double *push, quad *change) {
    const double e = 0x1p-30;
    quad q[2][QUAD_NQ], v[2][QUAD_NV];
    quad_mechanism pushed[2] = {*m, *m};
    for (int j = 0; j < m->nv; j++) {
        pushed[0].tau[j] -= e * push[j];
        pushed[1].tau[j] += e * push[j];
        push[j] = (pushed[1].tau[j] - pushed[0].tau[j]) / (2.0 * e);
    }
    for (int i = 0; i < 2; i++) {
        memcpy(q[i], n->q, sizeof q[i]);
        memcpy(v[i], n->v, sizeof v[i]);
        if (!oracle_step(&pushed[i], h, q[i], v[i]))
            return false;
    }
    for (int j = 0; j < m->nv; j++) {
        change[j] = (q[1][j] - q[0][j]) / (2 * (quad)e);
        change[m->nv + j] = (v[1][j] - v[0][j]) / (2 * (quad)e);
    }
    return true;
}

/* The counts and the worst error of derivatives of one kind. */
typedef struct tally {
    kt_worst worst;
    int all, rejected, told;
} tally;

static tally tally_of(const char *name) { return (tally){.worst = kt_worst_make(name)}; }

static void count_derivative(tally *t, kt_status status, double error, double size, double bound, const singular *s,
                             double d, int k) {
    t->all++;
    if (status == KT_ERROR_SINGULAR) {
        t->rejected++;
        return;
    }
    error = status == KT_OK ? error : HUGE_VAL;
    if (!(error <= bound) && t->told++ < 20)
        kt_note("seed %d, d = %g, h = 1e-%d: of %.1e, error %.1e of %.1e", s->seed, d, k, size, error, bound);
    kt_worst_below(&t->worst, error, bound, "seed %d, d = %g, h = 1e-%d", s->seed, d, k);
}

/* The library and the oracle reach a state by two sequences of least steps. If nothing is singular, their positions are
 * apart by about h^4. Next to a position, they are apart by h^2, because the library closes the nearly lost direction
 * after the others. The derivatives then differ by
 *     s = 0.93, v = 1.8     1.0e-5 at h = 0.093     6.5e-7 at h / 2     4.1e-8 at h / 4
 *     s = 0.25, v = 1.5     7.0e-6 at h = 0.02      4.2e-7 at h / 2     2.5e-8 at h / 4
 *     s = 7.1e-7            15 at h = s / 10        3.8 at h / 2        0.97 at h / 4
 * In the last row, the derivatives are 8.9e3. Steps are no longer. */
#define STEP_MOST 0.005
#define STEP_NEAR 0.05

/* The relative error of derivatives of accelerations is c / d. */
static double acceleration_bound(double size, double d) { return (1e-9 + DBL_EPSILON / d) * size; }

/* The bound for the derivatives of a step. A residual turns the tangent by c / s^2. It changes the projection of
 * velocities by c v / s^3. `rejected` limits this error: it is a part of the largest derivative, of a change.
 *
 * A projection ends when the loops, of up to 3 m, are closed to eps. The iteration that is left out would move
 * positions by x^2 H / (2 s). Here x is the last step and H the second derivatives, of six coordinates and levers of up
 * to 4 m. The derivative of that is left out: twice the root of 36 eps / s. */
static double step_bound(const near_state *n, double size, double rejected) {
    const double c = 20.0 * DBL_EPSILON, s = n->least;
    return (1e-9 + 2.0 * sqrt(36.0 * DBL_EPSILON / s)) * size + fmin(c / (s * s) * (1.0 + n->speed / s), rejected);
}

/* The largest error of A x that is not rejected: a thousandth of the largest derivative with respect to positions. It
 * applies to all positions that change. */
static double rejected_of(int nv, const double *A, const quad *along) {
    double largest = 0.0, change = 0.0;
    for (int j = 0; j < nv; j++) {
        change += (double)(along[j] * along[j]);
        for (int i = 0; i < 2 * nv; i++)
            largest = fmax(largest, fabs(A[2 * nv * j + i]));
    }
    return 1e-3 * largest * sqrt(change);
}

/* Inputs change accelerations alone, and with these the projected velocities. A residual c turns the tangent by
 *     c H / s^2.
 * The residual of the rounded state is 20 eps, and a projection leaves 36 eps as above.
 *
 * The projected positions do not change. Two sequences of least steps still reach positions that are apart by about
 * h^4. At s = 0.24, this is 3.6e-9 of B for h = 0.03. It is 3.6e-13 for h = 0.003. Therefore, steps are short:
 *     h = INPUT_STEP s. */
#define INPUT_STEP 1e-3
static double input_bound(const near_state *n, double size) {
    return (1e-11 + fmin(56.0 * DBL_EPSILON / (n->least * n->least), 1e-3)) * size;
}

static void check_tally(const tally *t, double most) {
    kt_note("%d rejected of %d", t->rejected, t->all);
    kt_check_below("rejected, of all", (double)t->rejected / t->all, most);
    kt_check_worst(&t->worst);
}

static double largest_of(int n, const quad *x, double least) {
    for (int i = 0; i < n; i++)
        least = fmax(least, fabs((double)x[i]));
    return least;
}

/* A x for one of Euler's steps, with a change x that the loops allow. A' y comes from the adjoint, and its product with
 * that change is y . A x. */
static void compare_step(const library *l, const quad_mechanism *m, const near_state *n, const quad *along,
                         const quad *dv, const quad *expected, double h, const singular *s, double d, int k,
                         tally *tangent, tally *adjoint) {
    static unsigned char work[1 << 22] __attribute__((aligned(64)));
    const int nv = m->nv;
    kt_error e = {0};
    double A[4 * QUAD_NV * QUAD_NV], y[2 * QUAD_NV], g[2 * QUAD_NV], error = 0.0, product = 0.0;
    quad given = 0;
    const kt_step step = {.method = kt_method_find("euler"), .h = h, .tau = m->tau};
    kt_status status =
        kt_step_derivatives(l->model, l->data, work, sizeof work, &step, n->q_of, n->v_of, NULL, NULL, A, NULL, &e);
    const double size = largest_of(2 * nv, expected, 1.0);
    for (int i = 0; i < 2 * nv && status == KT_OK; i++) {
        quad sum = 0;
        for (int j = 0; j < nv; j++)
            sum += A[2 * nv * j + i] * along[j] + A[2 * nv * (nv + j) + i] * dv[j];
        error = fmax(error, fabs((double)(sum - expected[i])));
    }
    const double rejected = status == KT_OK ? rejected_of(nv, A, along) : 0.0;
    count_derivative(tangent, status, error, size, step_bound(n, size, rejected), s, d, k);
    for (int i = 0; i < 2 * nv; i++) {
        y[i] = 1.0 / (1.0 + i);
        product += y[i] * (double)expected[i];
    }
    status = kt_step_adjoint(l->model, l->data, work, sizeof work, &step, n->q_of, n->v_of, y, g, NULL, &e);
    for (int j = 0; j < nv && status == KT_OK; j++)
        given += g[j] * along[j] + g[nv + j] * dv[j];
    count_derivative(adjoint, status, fabs((double)given - product), size, step_bound(n, size, 1e-3 * size), s, d, k);
}

/* B of one of Euler's steps along a change of the inputs. */
static void compare_input(const library *l, const quad_mechanism *m, const near_state *n, const double *push,
                          const quad *expected, double h, const singular *s, double d, int k, tally *t) {
    static unsigned char work[1 << 22] __attribute__((aligned(64)));
    const int nv = m->nv;
    kt_error e = {0};
    double B[2 * QUAD_NV * QUAD_NV], error = 0.0;
    const kt_step step = {.method = kt_method_find("euler"), .h = h, .tau = m->tau};
    const kt_status status =
        kt_step_derivatives(l->model, l->data, work, sizeof work, &step, n->q_of, n->v_of, NULL, NULL, NULL, B, &e);
    for (int i = 0; i < 2 * nv && status == KT_OK; i++) {
        quad sum = 0;
        for (int j = 0; j < nv; j++)
            sum += B[2 * nv * j + i] * (quad)push[j];
        error = fmax(error, fabs((double)(sum - expected[i])));
    }
    const double size = largest_of(2 * nv, expected, h);
    count_derivative(t, status, error, size, input_bound(n, size), s, d, k);
}

/* The matrix of a linearisation, by the states of the same change. */
static void compare_linearization(const library *l, const quad_mechanism *m, const near_state *n, const quad *along,
                                  const quad *dv, const quad *da, const singular *at, double d, int k, tally *t) {
    kt_linearization *linearization = NULL;
    kt_error e = {0};
    const double size = largest_of(m->nv, da, 1.0);
    double error = 0.0;
    kt_status status = kt_linearization_create(l->model, NULL, &linearization, &e);
    if (status == KT_OK)
        status = kt_linearization_evaluate(linearization, 0.0, n->q_of, n->v_of, m->tau, &e);
    const kt_linear_system *s = kt_linearization_system(linearization);
    for (int i = 0; status == KT_OK && i < s->velocities; i++) {
        quad sum = 0;
        for (int j = 0; j < s->states; j++)
            sum += s->state[j * s->states + s->positions + i] *
                   (j < s->positions ? along[s->position_coordinate[j]] : dv[s->velocity_coordinate[j - s->positions]]);
        error = fmax(error, fabs((double)(sum - da[s->velocity_coordinate[i]])));
    }
    count_derivative(t, status, error, size, acceleration_bound(size, d), at, d, k);
    kt_linearization_free(linearization);
}

/* -(Z' M Z) (Z' da) of stiffness and damping matrices. */
static void compare_stiffness(const library *l, const quad_mechanism *m, const near_state *n, const quad *along,
                              const quad *dv, const quad *da, const singular *at, double d, int k, tally *t) {
    static unsigned char work[1 << 20] __attribute__((aligned(64)));
    enum { SQUARE = QUAD_NV * QUAD_NV };
    double basis[SQUARE], mass[SQUARE], stiffness[SQUARE], damping[SQUARE], error = 0.0, size = 1.0;
    kt_error e = {0};
    const int nv = m->nv, f = kt_model_mobility(l->model).minimal;
    const kt_status status = kt_stiffness_evaluate(l->model, l->data, work, sizeof work, 0.0, n->q_of, n->v_of, m->tau,
                                                   NULL, NULL, basis, mass, stiffness, damping, &e);
    for (int i = 0; i < f && status == KT_OK; i++) {
        quad sum = 0;
        double whole = 0.0;
        for (int j = 0; j < nv; j++)
            sum += stiffness[j * f + i] * along[j] + damping[j * f + i] * dv[j];
        for (int c = 0; c < f; c++)
            for (int j = 0; j < nv; j++) {
                const quad term = mass[c * f + i] * basis[c * nv + j] * da[j];
                sum += term;
                whole += fabs((double)term);
            }
        size = fmax(size, whole);
        error = fmax(error, fabs((double)sum));
    }
    count_derivative(t, status, error, size, acceleration_bound(size, d), at, d, k);
}

/* All results that use the derivatives of accelerations: derivatives of steps and their adjoints, linearisations, and
 * the matrices of implicit methods. They are those of the motion, or rejected. Gradients do not form the derivatives,
 * so their error is compared with a smaller bound. */
KT_TEST(all_derivatives_next_to_singular_positions_are_right_or_rejected) {
    static const double distances[] = {1e-10, 1e-7, 1e-4};
    tally tangent = tally_of("A of a step"), adjoint = tally_of("A' of a step"), input = tally_of("B of a step"),
          linear = tally_of("linearisation"), reduced = tally_of("stiffness and damping");
    singular s = {.seed = 0};
    for (int i = 0; 2 * i < near_mechanisms(); i++) {
        near_next(&s);
        kt_random r = kt_random_named("along a step");
        for (size_t id = 0; id < sizeof distances / sizeof *distances && s.m.nq == s.m.nv; id++) {
            const double d = distances[id];
            const quad_mechanism m = near_off_by(&s, d);
            library l;
            near_state n;
            if (near_compile(&l, &m))
                for (int k = 1; k <= 8; k++) {
                    quad along[QUAD_NV], dv[QUAD_NV], da[QUAD_NV], expected[2 * QUAD_NV];
                    double push[QUAD_NV];
                    if (!near_state_at(&s, &m, pow(10.0, -k), &n))
                        continue;
                    const double h = fmin(STEP_NEAR * n.least, STEP_MOST);
                    for (int j = 0; j < m.nv; j++)
                        along[j] = kt_random_normal(&r);
                    if (!quad_close_velocity(&m, n.q, along) || !oracle_change(&m, &n, along, dv, da) ||
                        !oracle_step_change(&m, &n, h, along, dv, expected))
                        continue;
                    compare_step(&l, &m, &n, along, dv, expected, h, &s, d, k, &tangent, &adjoint);
                    for (int j = 0; j < m.nv; j++)
                        push[j] = (double)along[j];
                    const double short_step = INPUT_STEP * n.least;
                    if (oracle_input_change(&m, &n, short_step, push, expected))
                        compare_input(&l, &m, &n, push, expected, short_step, &s, d, k, &input);
                    compare_linearization(&l, &m, &n, along, dv, da, &s, d, k, &linear);
                    compare_stiffness(&l, &m, &n, along, dv, da, &s, d, k, &reduced);
                }
            near_discard(&l);
        }
    }
    check_tally(&tangent, 0.05);
    check_tally(&adjoint, 0.5);
    check_tally(&input, 0.05);
    check_tally(&linear, 0.05);
    check_tally(&reduced, 0.08); /* their size is a sum of terms */
}
