/* Shapes of modes next to neutral modes: a second solution, if residuals show that the first solution failed.
 *
 * The balancing of dgeevx scales each state until its row and its column of A have equal norms. Next to a neutral mode
 * (a drifting body, a free rotor) a column holds nothing but rounding, for example 1e-28. Balancing then multiplies
 * this state by 2^60, and the rounding of the QR iteration, scaled back, exceeds the components of all other shapes.
 * The eigenvalues do not suffer, since the scaled noise does not act back.
 *
 * The residual |A x - lambda x| / (|A| |x| + |lambda| |x|), in units of the states, shows this. For pairs that fail,
 * the matrix is solved once more:
 *
 * 1. Scale the states by their units u, and velocities by u w, so that w^2 is the largest stiffness per mass. An entry
 *    below a few eps of the largest scaled entry is set to zero if its whole column or row is that small. Such states
 *    have the eigenvalue zero. LAPACK isolates them by a permutation, and balances only the others.
 * 2. A pair with the residual r is corrected in the basis of the eigenvectors x_j, with left vectors w_j:
 *
 *        x <- x - sum_j x_j (w_j' r) / ((lambda_j - lambda) w_j' x_j),      lambda_j apart from lambda,
 *        lambda <- lambda + w' r / w' x.
 *
 * 3. The components of the states of step 1 follow from their own rows of A, in the reverse order of their removal:
 *    x_i = (sum_{j /= i} a_ij x_j) / (lambda - a_ii).
 *
 * If step 1 confuses a slow mode with a neutral mode, the first pair remains, whose residual is small. A corrected
 * eigenvalue lies within the error bound of the first eigenvalue.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "analysis/modes.h"

#include "kinetree/algebra.h"

#include <complex.h>
#include <float.h>
#include <math.h>
#include <string.h>

/* A larger residual is not rounding of one product A x. */
#define MOST_ROUNDED (4.0 * DBL_EPSILON)

/* An entry that is smaller, relative to the largest, changes no eigenvalue beyond the rounding of the QR iteration. */
#define NEGLIGIBLE (4.0 * DBL_EPSILON)

/* Eigenvalues with a smaller relative distance belong to one invariant subspace. A correction between such eigenvalues
 * would divide by rounding, and changes no residual. */
#define TOGETHER 1e-4

/* ---- residuals --------------------------------------------------------------------------------------------------- */

static bool is_velocity(const kt_linear_system *system, size_t state) {
    const size_t first = (size_t)system->positions;
    return state >= first && state < first + (size_t)system->velocities;
}

/* The unit of a state of motions with the rate w. */
static double unit_at_rate(const kt_linear_system *system, size_t state, double w) {
    return kt_modes_unit(system, state) * (is_velocity(system, state) && w > 0.0 ? w : 1.0);
}

/* CMPLX of C11, which clang does not define with glibc. */
static double _Complex complex_of(double real, double imaginary) {
    const double parts[2] = {real, imaginary};
    double _Complex z;
    memcpy(&z, parts, sizeof z);
    return z;
}

static double size_of_complex(double _Complex x) { return kt_hypot(creal(x), cimag(x)); }

static double _Complex component(kt_packed_vector x, size_t i) { return complex_of(x.re[i], x.im ? x.im[i] : 0.0); }

double kt_modes_residual(const kt_modes *m, const kt_linear_system *system, size_t k, double real, double imaginary) {
    const size_t n = (size_t)system->states;
    const kt_packed_vector x = kt_eigenvector_at(m, m->right, n, k);
    const double _Complex lambda = complex_of(real, imaginary);
    const double w = size_of_complex(lambda);
    double worst = 0.0, whole = 0.0;
    for (size_t i = 0; i < n; i++) {
        double _Complex sum = -lambda * component(x, i);
        double terms = size_of_complex(sum);
        for (size_t j = 0; j < n; j++) {
            const double a = system->state[j * n + i];
            sum += a * component(x, j);
            terms += fabs(a) * size_of_complex(component(x, j));
        }
        const double unit = unit_at_rate(system, i, w);
        worst = fmax(worst, size_of_complex(sum) / unit);
        whole = fmax(whole, terms / unit);
    }
    return whole > 0.0 ? worst / whole : 0.0;
}

/* Whether a mode failed. A mode whose eigenvalue does not exceed its error has no definite shape, and does not
 * count. */
static bool has_failed(const kt_mode *mode) {
    return mode->residual > MOST_ROUNDED && kt_hypot(mode->real, mode->imaginary) > mode->error;
}

static bool has_any_failed(const kt_modes *m) {
    for (int i = 0; i < m->count; i++)
        if (has_failed(&m->mode[i]))
            return true;
    return false;
}

/* ---- the second solution ----------------------------------------------------------------------------------------- */

/* The square root of the largest stiffness per mass, or the largest damping per mass if that is larger. */
static double fastest_rate(const kt_linear_system *system) {
    const size_t n = (size_t)system->states;
    double stiffness = 0.0, damping = 0.0;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            const double a = fabs(system->state[j * n + i]) * kt_modes_unit(system, j) / kt_modes_unit(system, i);
            if (is_velocity(system, i) && !is_velocity(system, j))
                stiffness = fmax(stiffness, a);
            else if (is_velocity(system, i) || !is_velocity(system, j))
                damping = fmax(damping, a);
        }
    return fmax(sqrt(stiffness), damping);
}

/* Writes the largest negligible size of each entry of the matrix into m->rounding. */
static void write_negligible(kt_modes *m, const kt_linear_system *system, double w) {
    const size_t n = (size_t)system->states;
    double largest = 0.0;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            const double ratio = unit_at_rate(system, i, w) / unit_at_rate(system, j, w);
            largest = fmax(largest, fabs(m->matrix[j * n + i]) / ratio);
            m->rounding[j * n + i] = ratio;
        }
    for (size_t i = 0; i < n * n; i++)
        m->rounding[i] *= NEGLIGIBLE * largest;
}

/* Solves the matrix without states that are negligible. Returns false if the iteration does not converge. */
static bool solve_second(kt_modes *m, const kt_linear_system *system) {
    const size_t n = (size_t)system->states;
    double norm = 0.0;
    memcpy(m->matrix, system->state, n * n * sizeof *m->matrix);
    write_negligible(m, system, fastest_rate(system));
    kt_modes_remove_rounding(m, n);
    memset(m->replaced, 0, n * sizeof *m->replaced);
    return KT_EIGEN_SOLVE(m, n, m->matrix, &norm);
}

/* Returns the pair of the second solution whose eigenvalue is nearest to lambda and that no mode has yet, or n. */
static size_t nearest_pair(const kt_modes *m, size_t n, double real, double imaginary) {
    size_t best = n;
    double least = (double)INFINITY;
    for (size_t k = 0; k < n; k++) {
        const double distance = kt_hypot(m->real[k] - real, m->imaginary[k] - imaginary);
        if (!m->replaced[k] && m->imaginary[k] >= 0.0 && distance < least) {
            least = distance;
            best = k;
        }
    }
    return best;
}

/* ---- one step of refinement -------------------------------------------------------------------------------------- */

/* Returns w' y of a left vector w, or conj(w)' y of its conjugate. */
static double _Complex left_product(kt_packed_vector w, const double _Complex *y, size_t n, bool conjugate) {
    double _Complex sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += (conjugate ? component(w, i) : conj(component(w, i))) * y[i];
    return sum;
}

/* x -= x_j (w_j' r) / ((lambda_j - lambda) w_j' x_j), for the eigenvector j or its conjugate. */
static void correct_along(const kt_modes *m, size_t n, size_t j, bool conjugate, double _Complex lambda,
                          const double _Complex *r, double _Complex *x) {
    const kt_packed_vector left = kt_eigenvector_at(m, m->left, n, j), right = kt_eigenvector_at(m, m->right, n, j);
    const double _Complex other = complex_of(m->real[j], conjugate ? -m->imaginary[j] : m->imaginary[j]);
    const double _Complex distance = other - lambda;
    double _Complex product = 0.0;
    for (size_t i = 0; i < n; i++)
        product += conj(component(left, i)) * component(right, i);
    if (size_of_complex(distance) <= TOGETHER * size_of_complex(lambda) ||
        size_of_complex(product) <= sqrt(DBL_EPSILON))
        return;
    const double _Complex part =
        left_product(left, r, n, conjugate) / (distance * (conjugate ? conj(product) : product));
    for (size_t i = 0; i < n; i++)
        x[i] -= part * (conjugate ? conj(component(right, i)) : component(right, i));
}

/* r = A x - lambda x in the remaining states, 0 in the removed ones. */
static void write_residual(const kt_modes *m, const kt_linear_system *system, double _Complex lambda,
                           const double _Complex *x, double _Complex *r) {
    const size_t n = (size_t)system->states;
    for (size_t i = 0; i < n; i++)
        r[i] = m->removed[i] ? 0.0 : -lambda * x[i];
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n && !m->removed[j]; i++)
            r[i] += m->removed[i] ? 0.0 : system->state[j * n + i] * x[j];
}

/* The components of the removed states, from their own rows. */
static void solve_removed(const kt_modes *m, const kt_linear_system *system, double _Complex lambda,
                          double _Complex *x) {
    const size_t n = (size_t)system->states;
    for (size_t k = m->removals; k-- > 0;) {
        const size_t i = (size_t)m->removal[k];
        double _Complex sum = 0.0;
        for (size_t j = 0; j < n; j++)
            sum += j == i ? 0.0 : system->state[j * n + i] * x[j];
        x[i] = sum / (lambda - system->state[i * n + i]);
    }
}

/* Refines the vector of the pair k, in place. Returns its eigenvalue lambda + w' r / w' x. */
static double _Complex refine_pair(kt_modes *m, const kt_linear_system *system, size_t k) {
    const size_t n = (size_t)system->states;
    const kt_packed_vector left = kt_eigenvector_at(m, m->left, n, k);
    double _Complex lambda = complex_of(m->real[k], m->imaginary[k]), *x = m->refined, *r = m->refined + n;
    const kt_packed_vector packed = kt_eigenvector_at(m, m->right, n, k);
    for (size_t i = 0; i < n; i++)
        x[i] = component(packed, i);
    write_residual(m, system, lambda, x, r);
    for (size_t j = 0; j < n; j++) {
        if (m->imaginary[j] < 0.0)
            continue;
        correct_along(m, n, j, false, lambda, r, x);
        if (m->imaginary[j] > 0.0)
            correct_along(m, n, j, true, lambda, r, x);
    }
    write_residual(m, system, lambda, x, r);
    lambda += left_product(left, r, n, false) / left_product(left, x, n, false);
    solve_removed(m, system, lambda, x);
    for (size_t i = 0; i < n; i++) {
        m->right[k * n + i] = creal(x[i]);
        if (packed.im)
            m->right[(k + 1) * n + i] = cimag(x[i]);
    }
    return lambda;
}

void kt_modes_mend_shapes(kt_modes *m, const kt_linear_system *system) {
    const size_t n = (size_t)system->states;
    if (!has_any_failed(m) || !solve_second(m, system))
        return;
    for (int i = 0; i < m->count; i++) {
        if (!has_failed(&m->mode[i]))
            continue;
        const size_t k = nearest_pair(m, n, m->mode[i].real, m->mode[i].imaginary);
        if (k == n)
            continue;
        const double _Complex lambda = refine_pair(m, system, k),
                              before = complex_of(m->mode[i].real, m->mode[i].imaginary);
        const double residual = kt_modes_residual(m, system, k, creal(lambda), cimag(lambda));
        if (!(residual < m->mode[i].residual) || !(size_of_complex(lambda - before) <= m->mode[i].error))
            continue;
        kt_modes_set_eigenvalue(&m->mode[i], creal(lambda), cimag(lambda));
        m->mode[i].residual = residual;
        m->replaced[k] = true;
        kt_modes_write_shape(m, system, k, i);
    }
}
