/* Newton's equations of an implicit method, (sigma - J) x = r, in second-order form.
 *
 * The state is y = (q, v), with q' = E(q) v and v' = a(t, q, v). For corrections (x_q, x_v) and residuals (r_q, r_v),
 *
 *     (sigma - H) x_q - E x_v = r_q                               H = d(E v)/dq: 0 except for quaternions
 *     (sigma M + C) x_v + K P x_q = M r_v                         K = -M da/dq, C = -M da/dv (kt_stiffness_evaluate)
 *
 * where P takes x_q to tangent coordinates. With x_q = S (r_q + E x_v), S = (sigma - H)^-1, the matrix is nv x nv:
 *
 *     (sigma M + C + K P S E) x_v = M r_v - K P S r_q
 *
 * For coordinates that are not quaternions E = P = 1 and S = 1 / sigma. A quaternion p has the rate p' = p o (0, w) / 2
 * and H d = d o (0, w) / 2. The square of H is -|w|^2 / 4, and P d = 2 vec(p* o d), so that
 *
 *     S d = (sigma d + d o (0, w) / 2) / (sigma^2 + |w|^2 / 4)
 *     P S E z = (sigma z + z x w / 2) / (sigma^2 + |w|^2 / 4)
 *
 * Loops. Accelerations respond stiffly only along the velocities Z that the loops leave, but along these to all
 * displacements. Then M is Z'MZ, C is -M Z'da/dv and K is -M Z'da/dq, free x nv. With x_v = Z x + x_0, and across the
 * loops x_0 = (1 - Z Z') r_v / sigma, as if J were 0:
 *
 *     (sigma M + C Z + K P S E Z) x = M Z'r_v - C x_0 - K (P S r_q + P S E x_0)
 *
 * If drives leave no velocity free, Z and these matrices are empty: x_v = r_v / sigma, as if J were 0. Accelerations
 * are then functions of time and of a state that the projection returns to the loops.
 *
 * Auxiliary states, y = (q, v, x) with x' = f(t, q, v, x). Let X = -M da/dx, with loops -Z'M da/dx. Let F_q, F_v and
 * F_x be the derivatives of -f. Then x_x is found together with x_v:
 *
 *     (sigma M + C + K P S E) x_v + X x_x = M r_v - K P S r_q
 *     (F_v + F_q P S E) x_v + (sigma + F_x) x_x = r_x - F_q P S r_q
 *
 * With loops, F_v and P S E act on Z x + x_0.
 *
 * The order of a Rosenbrock method depends on an exact J. The matrices of this method are not reduced: M = 1, K =
 * -da/dq, C = -da/dv and X = -da/dx. These matrices hold in all directions, including those that violate the loops
 * (kt_acceleration_derivatives).
 *
 * Matrices are real except for sigma, vectors are complex. If sigma is real, `im` is NULL throughout.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/lu.h"
#include "base/copy.h"
#include "constraint/rejecting_loop.h"
#include "derivative/loop_response.h"
#include "derivative/stiffness.h"
#include "evaluate/evaluate.h"
#include "evaluate/slip.h"
#include "integrator/complex.h"
#include "integrator/integrator.h"
#include "step/newton_matrices.h"

#include <math.h>
#include <string.h>

KT_ARENA_LAYOUT(lay_out_newton, kt_newton_matrices, KT_NEWTON_ARRAYS, const kt_simulation_sizes *size)

static size_t measure_newton(const kt_simulation_sizes *size) {
    return size->vectors > 0 ? lay_out_newton(NULL, size) : 0;
}

static void init_newton(kt_simulation *simulation, void *memory) {
    (void)lay_out_newton(memory, &simulation->size);
    simulation->newton = memory;
}

const kt_part kt_newton_part = {.measure = measure_newton, .init = init_newton};

void kt_simulation_newton_measure(const kt_model *model, bool exact, kt_simulation_sizes *size) {
    const bool loops = kt_loop_group_count(model) > 0;
    size->all_directions = loops && exact;
    size->exact = exact;
    size->reduced = loops && !exact;
    size->free = size->reduced ? (size_t)kt_model_mobility(model).minimal : size->nv;
    size->basis = size->reduced ? size->nv * size->free : 0;
    size->along = size->reduced ? size->free * size->free : 0;
    size->turning = size->quaternion;
    size->states = size->x;
    size->vectors = 4 * 2 * (size->nq + size->states);
    size->stiffness_work = size->all_directions ? kt_acceleration_work_size(model) : kt_stiffness_work_size(model);
}

/* ---- complex vectors --------------------------------------------------------------------------------------------- */

typedef struct vector {
    double *re, *im; /* im NULL: real */
} vector;

static vector vector_from(vector x, size_t i) {
    const vector part = {x.re + i, x.im != NULL ? x.im + i : NULL};
    return part;
}

static kt_complex get_entry(vector x, size_t i) {
    const kt_complex value = {x.re[i], x.im != NULL ? x.im[i] : 0.0};
    return value;
}

static void set_entry(vector x, size_t i, kt_complex value) {
    x.re[i] = value.re;
    if (x.im != NULL)
        x.im[i] = value.im;
}

/* y += factor A x, with A of `rows` x `columns`. */
static void add_real_product(const double *a, size_t rows, size_t columns, double factor, vector x, vector y) {
    for (size_t j = 0; j < columns; j++) {
        const double *column = a + j * rows, re = factor * x.re[j];
        for (size_t i = 0; i < rows; i++)
            y.re[i] += column[i] * re;
        const double im = x.im != NULL ? factor * x.im[j] : 0.0;
        for (size_t i = 0; i < rows && x.im != NULL; i++)
            y.im[i] += column[i] * im;
    }
}

/* y = A' x */
static void transposed_product(const double *a, size_t rows, size_t columns, vector x, vector y) {
    for (size_t j = 0; j < columns; j++) {
        const double *column = a + j * rows;
        kt_complex sum = {0.0, 0.0};
        for (size_t i = 0; i < rows; i++) {
            sum.re += column[i] * x.re[i];
            sum.im += x.im != NULL ? column[i] * x.im[i] : 0.0;
        }
        set_entry(y, j, sum);
    }
}

static void copy(vector to, vector from, size_t n) {
    kt_copy(to.re, from.re, n * sizeof *to.re);
    if (to.im != NULL)
        kt_copy(to.im, from.im, n * sizeof *to.im);
}

static void clear_vector(vector x, size_t n) {
    memset(x.re, 0, n * sizeof *x.re);
    if (x.im != NULL)
        memset(x.im, 0, n * sizeof *x.im);
}

/* ---- positions and their rates ----------------------------------------------------------------------------------- */

/* 1 / (sigma^2 + |w|^2 / 4) */
static kt_complex turning_factor(kt_complex sigma, const double *w) {
    kt_complex square = kt_complex_multiply(sigma, sigma);
    square.re += 0.25 * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    return kt_complex_invert(square);
}

/* out = d o (0, w) / 2 */
static void half_turn(const double *d, const double *w, double *out) {
    out[0] = -0.5 * (d[1] * w[0] + d[2] * w[1] + d[3] * w[2]);
    out[1] = 0.5 * (d[0] * w[0] + d[2] * w[2] - d[3] * w[1]);
    out[2] = 0.5 * (d[0] * w[1] + d[3] * w[0] - d[1] * w[2]);
    out[3] = 0.5 * (d[0] * w[2] + d[1] * w[1] - d[2] * w[0]);
}

/* out = 2 vec(p* o d) */
static void to_tangent(const double *p, const double *d, double *out) {
    out[0] = 2.0 * (p[0] * d[1] - d[0] * p[1] - (p[2] * d[3] - p[3] * d[2]));
    out[1] = 2.0 * (p[0] * d[2] - d[0] * p[2] - (p[3] * d[1] - p[1] * d[3]));
    out[2] = 2.0 * (p[0] * d[3] - d[0] * p[3] - (p[1] * d[2] - p[2] * d[1]));
}

/* x becomes factor (sigma x + half_x), component by component. */
static void finish_vector(kt_complex sigma, kt_complex factor, size_t n, vector half_x, vector x) {
    for (size_t i = 0; i < n; i++)
        set_entry(x, i,
                  kt_complex_multiply(
                      factor, kt_complex_add(kt_complex_multiply(sigma, get_entry(x, i)), get_entry(half_x, i))));
}

static void half_cross_product(const double *z, const double *w, double *out) {
    out[0] = 0.5 * (z[1] * w[2] - z[2] * w[1]);
    out[1] = 0.5 * (z[2] * w[0] - z[0] * w[2]);
    out[2] = 0.5 * (z[0] * w[1] - z[1] * w[0]);
}

/* Half a product of x, of n components, with an angular velocity. */
typedef void half_product(const double *x, const double *w, double *out);

/* x becomes S x, for a quaternion, or P S E x, for three components. */
static void divide_turning(kt_complex sigma, const double *w, half_product *half, size_t n, vector x) {
    double re[4], im[4];
    half(x.re, w, re);
    if (x.im != NULL)
        half(x.im, w, im);
    finish_vector(sigma, turning_factor(sigma, w), n, (vector){re, x.im != NULL ? im : NULL}, x);
}

static const double *quaternion_at(const kt_simulation *s, size_t k) { return s->newton->turning + 7 * k; }
static const double *spin_of(const kt_simulation *s, size_t k) { return s->newton->turning + 7 * k + 4; }

/* The index in v at which the angular velocity of quaternion k begins: each earlier quaternion has one position
 * more. */
static size_t spin_at(const kt_simulation *s, size_t k) { return (size_t)s->quaternion[k] - k; }

/* x_i becomes x_i / sigma, first .. last - 1. */
static void divide_plain(kt_complex sigma, vector x, size_t first, size_t last) {
    const kt_complex factor = kt_complex_invert(sigma);
    for (size_t i = first; i < last; i++)
        set_entry(x, i, kt_complex_multiply(factor, get_entry(x, i)));
}

/* x (nq) becomes S x. of_tangents: x (nv) becomes P S E x. */
static void divide_all(const kt_simulation *s, kt_complex sigma, bool of_tangents, vector x) {
    size_t from = 0;
    for (size_t k = 0; k < s->size.turning; k++) {
        const size_t at = of_tangents ? spin_at(s, k) : (size_t)s->quaternion[k], n = of_tangents ? 3 : 4;
        divide_plain(sigma, x, from, at);
        divide_turning(sigma, spin_of(s, k), of_tangents ? half_cross_product : half_turn, n, vector_from(x, at));
        from = at + n;
    }
    divide_plain(sigma, x, from, of_tangents ? s->size.nv : s->size.nq);
}

/* out (nv) = P x, x (nq). */
static void tangents_of(const kt_simulation *s, const double *x, double *out) {
    size_t q = 0, v = 0;
    for (size_t k = 0; k < s->size.turning; k++) {
        for (; q < (size_t)s->quaternion[k]; q++)
            out[v++] = x[q];
        to_tangent(quaternion_at(s, k), x + q, out + v);
        q += 4;
        v += 3;
    }
    for (; q < s->size.nq; q++)
        out[v++] = x[q];
}

/* x (nq) += E z, z (nv). */
static void add_position_rates(const kt_simulation *s, const double *z, double *x) {
    size_t q = 0, v = 0;
    for (size_t k = 0; k < s->size.turning; k++) {
        double rate[4];
        for (; q < (size_t)s->quaternion[k]; q++)
            x[q] += z[v++];
        half_turn(quaternion_at(s, k), z + v, rate);
        for (size_t i = 0; i < 4; i++)
            x[q + i] += rate[i];
        q += 4;
        v += 3;
    }
    for (; q < s->size.nq; q++)
        x[q] += z[v++];
}

/* ---- the Jacobian ------------------------------------------------------------------------------------------------ */

/* Stores the unit quaternion and the angular velocity of each joint with a quaternion, about which the Jacobian of the
 * present step is taken. */
static void store_turning(kt_simulation *s, const double *y) {
    for (size_t k = 0; k < s->size.turning; k++) {
        const double *p = y + s->quaternion[k], *w = y + s->size.nq + spin_at(s, k);
        const double norm = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
        double *to = s->newton->turning + 7 * k;
        for (int i = 0; i < 4; i++)
            to[i] = p[i] / norm;
        memcpy(to + 4, w, 3 * sizeof *w);
    }
}

/* K Z and C Z: stiffness and damping along the free directions Z that loops leave (newton->along). */
static void reduce_along(kt_simulation *s) {
    const size_t nv = s->size.nv, free = s->size.free;
    memset(s->newton->along, 0, 2 * s->size.along * sizeof *s->newton->along);
    for (size_t j = 0; j < free && s->size.reduced; j++) {
        const vector z = {s->newton->basis + j * nv, NULL}, k = {s->newton->along + j * free, NULL},
                     c = {s->newton->along + s->size.along + j * free, NULL};
        add_real_product(s->newton->stiffness, free, nv, 1.0, z, k);
        add_real_product(s->newton->damping, free, nv, 1.0, z, c);
    }
}

static kt_state_derivatives state_derivatives_of(const kt_simulation *s) {
    return (kt_state_derivatives){s->newton->state_force, s->newton->rate_q, s->newton->rate_v, s->newton->rate_x};
}

/* M = 1, K = -da/dq, C = -da/dv and X = -da/dx in all directions. Methods that only solve linear systems use these
 * matrices even near a singular position, however uncertain they are, because matrices of earlier steps belong to the
 * path before its bend, and are wrong. */
static kt_status differentiate_all_directions(kt_simulation *s, const kt_dynamic_state *at, kt_error *error) {
    const size_t nv = s->size.nv;
    const kt_state_derivatives states = state_derivatives_of(s);
    const kt_acceleration_matrices to = {
        .by = {s->newton->stiffness, s->newton->damping, NULL}, .states = &states, .uncertain = true};
    const kt_status status = kt_acceleration_derivatives_at(s->model, s->data, s->newton->stiffness_work,
                                                            s->size.stiffness_work, at, NULL, &to, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < nv * s->size.states; i++)
        s->newton->state_force[i] = -s->newton->state_force[i];
    for (size_t i = 0; i < nv * nv; i++) {
        s->newton->stiffness[i] = -s->newton->stiffness[i];
        s->newton->damping[i] = -s->newton->damping[i];
        s->newton->mass[i] = i % (nv + 1) == 0 ? 1.0 : 0.0;
    }
    return KT_OK;
}

/* Rejects matrices next to a singular position, where the path bends within a step. Newton's iterations stall with
 * matrices of the bend, however exact they are. With earlier matrices and a shorter step, the iterations converge. */
static kt_status reject_near(kt_simulation *s, double t, const double *q, const double *v, kt_error *error) {
    kt_violation violation;
    if (s->groups == 0)
        return KT_OK;
    const kt_reduction_kernels *kernels = s->model->group_kernels;
    (void)(kernels->residuals(s->model, s->data, t, q, v, NULL, &violation) &&
           kernels->factor(s->model, s->data, KT_ROWS_ALL, false));
    return kt_loops_reject_near(s->model, s->data, error);
}

/* Computes M, C, K and the matrices of auxiliary states, if any velocity is free, or if the model has auxiliary
 * states. */
static kt_status differentiate_motion(kt_simulation *s, double t, const double *y, const double *a, kt_error *error) {
    const kt_dynamic_state at = {t, y, y + s->size.nq, s->tau, s->external};
    kt_status status = KT_OK;
    if (s->size.free + s->size.states == 0)
        return KT_OK;
    kt_simulation_use_states(s, y);
    s->cached = KT_CACHED_NOTHING;
    s->memory.factorizations += (uint64_t)s->groups;
    if (s->size.all_directions)
        return differentiate_all_directions(s, &at, error);
    status = reject_near(s, t, at.q, at.v, error);
    if (status != KT_OK)
        return status;
    const kt_state_derivatives states = state_derivatives_of(s);
    const kt_stiffness_matrices to = {.basis = s->size.reduced ? s->newton->basis : NULL,
                                      .mass = s->newton->mass,
                                      .stiffness = s->newton->stiffness,
                                      .damping = s->newton->damping,
                                      .states = &states,
                                      .exact = s->size.exact};
    status = kt_stiffness_evaluate_at(s->model, s->data, s->newton->stiffness_work, s->size.stiffness_work, &at, a, &to,
                                      error);
    return status == KT_OK && s->model->n.slip > 0 ? kt_slip_add_damping(s->model, s->data, &at, to.basis, s->size.free,
                                                                         s->newton->vectors, s->newton->damping, error)
                                                   : status;
}

/* kt_newton.jacobian: stores K, C, M and the derivatives of auxiliary states at (t, y), reduced to the velocities that
 * the loops leave, and E of quaternions. Returns 1 if a shorter step may help (the position is singular). */
static int newton_jacobian(double t, const double *y, const double *dydt, void *user) {
    kt_simulation *s = user;
    kt_error error = {0};
    kt_status status = differentiate_motion(s, t, y, dydt + s->size.nq, &error);
    status = kt_stop_report(s->model, s->data, t, status, &error);
    if (status != KT_OK && !kt_simulation_is_recoverable(status))
        s->cause = error;
    if (status != KT_OK)
        return kt_simulation_is_recoverable(status) ? 1 : -1;
    reduce_along(s);
    store_turning(s, y);
    return 0;
}

/* ---- factors ----------------------------------------------------------------------------------------------------- */

/* One of four work vectors, of nq (at least nv) components and of the auxiliary states. complex: with imaginary
 * parts. */
static vector work_of(const kt_simulation *s, size_t which, bool complex) {
    const size_t n = s->size.nq + s->size.states;
    double *re = s->newton->vectors + 2 * which * n;
    const vector work = {re, complex ? re + n : NULL};
    return work;
}

/* Column j of P S E Z. */
static vector unit_response(const kt_simulation *s, kt_complex sigma, size_t j, bool complex) {
    const vector z = work_of(s, 0, complex);
    clear_vector(z, s->size.nv);
    if (s->size.reduced)
        memcpy(z.re, s->newton->basis + j * s->size.nv, s->size.nv * sizeof *z.re);
    else
        z.re[j] = 1.0;
    divide_all(s, sigma, true, z);
    return z;
}

/* to += factor x, with a complex factor and a real column. */
static void add_real_column(vector to, kt_complex factor, const double *x, size_t n) {
    for (size_t i = 0; i < n; i++)
        to.re[i] += factor.re * x[i];
    for (size_t i = 0; i < n && to.im != NULL; i++)
        to.im[i] += factor.im * x[i];
}

/* Column j of sigma M + C Z + K P S E Z. */
static void form_newton_column(const kt_simulation *s, kt_complex sigma, size_t j, vector to) {
    const size_t n = s->size.free;
    const kt_complex one = {1.0, 0.0};
    const double *stiffness = s->size.reduced ? s->newton->along : s->newton->stiffness;
    const double *damping = s->size.reduced ? s->newton->along + s->size.along : s->newton->damping;
    clear_vector(to, n);
    add_real_column(to, sigma, s->newton->mass + j * n, n);
    add_real_column(to, one, damping + j * n, n);
    if (s->size.turning == 0) {
        add_real_column(to, kt_complex_invert(sigma), stiffness + j * n, n);
        return;
    }
    const vector x = unit_response(s, sigma, j, to.im != NULL);
    for (size_t i = 0; i < s->size.nv; i++)
        if (x.re[i] != 0.0 || (x.im != NULL && x.im[i] != 0.0))
            add_real_column(to, get_entry(x, i), s->newton->stiffness + i * n, n);
}

/* The part of column j in the rows of auxiliary states, for free velocities: F_v Z + F_q P S E Z. */
static void form_rates(const kt_simulation *s, kt_complex sigma, size_t j, vector to) {
    const size_t nv = s->size.nv, states = s->size.states;
    clear_vector(to, states);
    if (s->size.reduced)
        add_real_product(s->newton->rate_v, states, nv, 1.0, (vector){s->newton->basis + j * nv, NULL}, to);
    else
        add_real_column(to, (kt_complex){1.0, 0.0}, s->newton->rate_v + j * states, states);
    add_real_product(s->newton->rate_q, states, nv, 1.0, unit_response(s, sigma, j, to.im != NULL), to);
}

/* Column j of the auxiliary states: X, and sigma + F_x. */
static void form_state(const kt_simulation *s, kt_complex sigma, size_t j, vector to) {
    const size_t n = s->size.free, states = s->size.states;
    const kt_complex one = {1.0, 0.0};
    clear_vector(to, n + states);
    add_real_column(to, one, s->newton->state_force + j * n, n);
    add_real_column(vector_from(to, n), one, s->newton->rate_x + j * states, states);
    set_entry(to, n + j, kt_complex_add(get_entry(to, n + j), sigma));
}

/* Forms and factors Newton's matrix at the shift sigma, column by column: velocities first, then auxiliary states. */
static int factor_newton(kt_complex sigma, void *user) {
    kt_simulation *s = user;
    const bool complex = sigma.im != 0.0;
    const size_t free = s->size.free, n = free + s->size.states;
    const vector matrix = {complex ? s->newton->re : s->newton->real, complex ? s->newton->im : NULL};
    s->newton->sigma[complex] = sigma;
    for (size_t j = 0; j < free; j++)
        form_newton_column(s, sigma, j, vector_from(matrix, j * n));
    for (size_t j = 0; j < free && n > free; j++)
        form_rates(s, sigma, j, vector_from(matrix, j * n + free));
    for (size_t j = free; j < n; j++)
        form_state(s, sigma, j - free, vector_from(matrix, j * n));
    const bool regular = complex ? kt_lu_factor_complex(s->newton->re, s->newton->im, n, s->newton->pivot + n)
                                 : kt_lu_factor(s->newton->real, n, s->newton->pivot);
    return regular ? 0 : 1;
}

/* ---- solutions --------------------------------------------------------------------------------------------------- */

/* x (free, then auxiliary states) becomes the solution for the right-hand side in it. */
static void solve_free(const kt_simulation *s, vector x) {
    const size_t n = s->size.free + s->size.states;
    if (x.im != NULL)
        kt_lu_solve_complex(s->newton->re, s->newton->im, n, s->newton->pivot + n, x.re, x.im);
    else
        kt_lu_solve(s->newton->real, n, s->newton->pivot, x.re);
}

/* Solves for x_v and x_x of a mechanism without loops, with the right-hand sides M r_v - K u and r_x - F_q u, where
 * u = P S r_q (`velocity`, which becomes scratch). On entry r_x lies behind r_v; x_v and x_x replace them. */
static void solve_tree(const kt_simulation *s, vector velocity, vector r_v) {
    const size_t nv = s->size.nv, states = s->size.states;
    const vector x = work_of(s, 1, r_v.im != NULL);
    clear_vector(x, nv);
    add_real_product(s->newton->mass, nv, nv, 1.0, r_v, x);
    add_real_product(s->newton->stiffness, nv, nv, -1.0, velocity, x);
    copy(vector_from(x, nv), vector_from(r_v, nv), states);
    add_real_product(s->newton->rate_q, states, nv, -1.0, velocity, vector_from(x, nv));
    solve_free(s, x);
    copy(r_v, x, nv + states);
}

/* solve_tree with loops. */
static void solve_loop_system(const kt_simulation *s, kt_complex sigma, vector velocity, vector r_v) {
    const size_t nv = s->size.nv, free = s->size.free, states = s->size.states;
    const vector b = work_of(s, 1, r_v.im != NULL), c = work_of(s, 2, r_v.im != NULL), r_x = vector_from(r_v, nv);
    transposed_product(s->newton->basis, nv, free, r_v, b); /* Z'r_v */
    add_real_product(s->newton->basis, nv, free, -1.0, b, r_v);
    divide_plain(sigma, r_v, 0, nv); /* x_0 */
    copy(c, r_v, nv);
    divide_all(s, sigma, true, c);
    for (size_t i = 0; i < nv; i++)
        set_entry(velocity, i, kt_complex_add(get_entry(velocity, i), get_entry(c, i)));
    clear_vector(c, free);
    add_real_product(s->newton->mass, free, free, 1.0, b, c);
    add_real_product(s->newton->stiffness, free, nv, -1.0, velocity, c);
    add_real_product(s->newton->damping, free, nv, -1.0, r_v, c);
    add_real_product(s->newton->rate_q, states, nv, -1.0, velocity, r_x);
    add_real_product(s->newton->rate_v, states, nv, -1.0, r_v, r_x);
    copy(vector_from(c, free), r_x, states);
    solve_free(s, c);
    add_real_product(s->newton->basis, nv, free, 1.0, c, r_v);
    copy(r_x, vector_from(c, free), states);
}

/* kt_newton.solve: the residuals (r_q, r_v, r_x) become the corrections. u = P S r_q gives x_v and x_x (solve_tree),
 * and then x_q = S (r_q + E x_v). */
/* NOLINTNEXTLINE(readability-non-const-parameter): it is the type of the callback, and both are written */
static int solve_newton(double *re, double *im, void *user) {
    const kt_simulation *s = user;
    const bool complex = im != NULL;
    const kt_complex sigma = s->newton->sigma[complex];
    const vector r_q = {re, im}, r_v = vector_from(r_q, s->size.nq), velocity = work_of(s, 0, complex);
    const vector moved = work_of(s, 3, complex);
    copy(moved, r_q, s->size.nq);
    divide_all(s, sigma, false, moved);
    tangents_of(s, moved.re, velocity.re);
    if (complex)
        tangents_of(s, moved.im, velocity.im);
    if (s->size.reduced)
        solve_loop_system(s, sigma, velocity, r_v);
    else
        solve_tree(s, velocity, r_v);
    add_position_rates(s, r_v.re, r_q.re);
    if (complex)
        add_position_rates(s, r_v.im, r_q.im);
    divide_all(s, sigma, false, r_q);
    return 0;
}

static bool formulas_read_time(const kt_model *model, const kt_effect_record *formulas) {
    for (int32_t k = 0; k < formulas->variable_count; k++)
        if (model->variable[formulas->variable + k].type == KT_VARIABLE_TIME)
            return true;
    return false;
}

/* Whether no loop, effect or rate of an auxiliary state depends on time. A caller's own effect counts as dependent. */
static bool autonomous(void *user) {
    const kt_simulation *s = user;
    const kt_model *model = s->model;
    for (size_t i = 0; i < model->n.effect; i++) {
        const kt_effect_record *effect = &model->effect[i];
        if (effect->type == KT_EFFECT_CUSTOM || formulas_read_time(model, effect))
            return false;
        for (int k = 0; k < 3; k++)
            if (!kt_curve_rests(&effect->curve[k]))
                return false;
    }
    for (size_t i = 0; i < model->n.x; i++)
        if (formulas_read_time(model, &model->state[i]))
            return false;
    for (size_t k = 0; k < kt_mass_curve_count(model); k++)
        if (!kt_curve_rests(kt_mass_curve(model, k)))
            return false;
    return !model->driven;
}

/* The derivative by time. The derivative is exact if only effects and masses depend on time. Targets of loops have no
 * such derivative, nor have a caller's own effects without derivatives. */
static int time_derivative(double t, const double *y, const double *dydt, double *slope, void *user) {
    kt_simulation *s = user;
    const kt_model *model = s->model;
    const kt_dynamic_state at = {t, y, y + s->size.nq, s->tau, s->external};
    kt_error error;
    if (model->driven)
        return 1;
    if (kt_model_is_differenced(model))
        return 1;
    s->cached = KT_CACHED_NOTHING;
    s->memory.factorizations += (uint64_t)s->groups;
    kt_simulation_use_states(s, y);
    if (s->size.x > 0 &&
        kt_auxiliary_state_time_derivatives(model, s->data, t, at.q, at.v, slope + s->size.nq + s->size.nv) != 0)
        return 1;
    const double *a = dydt + s->size.nq;
    return kt_acceleration_time_derivative(model, s->data, &at, a, slope + s->size.nq, &error) == KT_OK ? 0 : 1;
}

const kt_newton kt_simulation_newton = {newton_jacobian, factor_newton, solve_newton, autonomous, time_derivative};
