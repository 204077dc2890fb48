/* Modes: the solutions x exp(lambda t) of x' = A x.
 *
 * Eigenvalues and eigenvectors of A are computed by LAPACK's dgeevx (balancing, Hessenberg form, QR). To first order
 * the error of lambda is at most
 *
 *     4 (|w|' D |x| + |w_v' R| F |x|) / |w' x| + eps |A| / s,   A x = lambda x, w' A = lambda w'
 *
 * with the estimated error E = D + |R| F of each entry of A. Here |A| and s = |w' x| belong to the balanced matrix
 * (LAPACK Users' Guide, 3rd ed., section 4.8.1). F are the errors of the forces from which a column of accelerations is
 * solved. R are the accelerations by forces, M^-1 in a tree. The bound abs(w)' E abs(x) would contain the product of
 * the conditions of M and A. For a cantilever of N segments w_v is M y with a smooth y, and w_v' R = y' is less than
 * |w_v|' |R| by about N^4.
 *
 * If eigenvalues with the same shape coincide, w' x vanishes. Then a bound of L. Elsner applies:
 *
 *     (2 |A|)^(1 - 1/n) |E|^(1/n)         (Linear Algebra and its Applications 47, 1982, 127-138).
 *
 * Rounding would give a cyclic coordinate, on which nothing depends, the square root of its size as an eigenvalue.
 * Therefore a column of A that does not exceed its errors anywhere is set to zero; so is a row. The state of such a
 * column then has the eigenvalue zero. The others are the eigenvalues of the matrix without this state, in which more
 * such columns and rows may appear. A single entry is set to zero only if the entry is also below eps times the largest
 * of its row and of its column. QR rounds such an entry anyway. Many small entries may add up to the lowest
 * eigenvalues.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "analysis/modes.h"
#include "base/require.h"
#include "kinetree/algebra.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define ROUNDED 1e-6 /* of the largest entry, in units: larger errors are not those of rounding */
#define TIMES 4.0    /* true errors are within so many estimated ones (test/study/analysis/honest.c) */

/* ---- eigenvalues ------------------------------------------------------------------------------------------------- */

/* Writes rounding errors into m->rounding. An error above ROUNDED is not rounding: the system has a kink there, such as
 * a stop that just touches. It counts as zero, because entries below m->rounding are removed, and this entry is no
 * rounding of zero. */
static void write_rounding(kt_modes *m, const kt_linear_system *system, size_t n) {
    double whole = 0.0;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            whole = fmax(whole, fabs(system->state[j * n + i]) * kt_modes_unit(system, j) / kt_modes_unit(system, i));
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            const double error = system->state_error[j * n + i];
            const bool is_small = error * kt_modes_unit(system, j) / kt_modes_unit(system, i) <= ROUNDED * whole;
            m->rounding[j * n + i] = is_small ? error : 0.0;
        }
}

/* Sets entries to zero that neither their errors nor the rounding of their row and column exceed. */
static void clear_matrix_rounding(kt_modes *m, size_t n) {
    double *row = m->largest, *column = m->largest + n;
    memset(m->largest, 0, 2 * n * sizeof *m->largest);
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            row[i] = fmax(row[i], fabs(m->matrix[j * n + i]));
            column[j] = fmax(column[j], fabs(m->matrix[j * n + i]));
        }
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            const double most = fmin(m->rounding[j * n + i], DBL_EPSILON * fmin(row[i], column[j]));
            if (fabs(m->matrix[j * n + i]) <= most)
                m->matrix[j * n + i] = 0.0;
        }
}

/* Computes the eigenpairs of the state matrix without its rounding. Returns false if the matrix is not finite or QR
 * fails. */
static bool solve_modes(kt_modes *m, const kt_linear_system *system, double *norm) {
    const size_t n = (size_t)system->states;
    for (size_t i = 0; i < n * n; i++) {
        m->matrix[i] = system->state[i];
        if (!isfinite(system->state[i]))
            return false;
    }
    write_rounding(m, system, n);
    kt_modes_remove_rounding(m, n);
    clear_matrix_rounding(m, n);
    return KT_EIGEN_SOLVE(m, n, m->matrix, norm);
}

/* ---- errors ------------------------------------------------------------------------------------------------------ */

/* D = E - |R| F. */
static void write_direct_errors(kt_modes *m, const kt_linear_system *system) {
    const size_t n = (size_t)system->states, rows = (size_t)system->velocities, nv = (size_t)system->coordinates;
    for (size_t j = 0; j < n; j++) {
        double *direct = m->direct_error + j * n, *velocity = direct + system->positions;
        memcpy(direct, system->state_error + j * n, n * sizeof *direct);
        for (size_t k = 0; k < nv && system->force_error; k++)
            for (size_t i = 0; i < rows; i++)
                velocity[i] -= fabs(system->response[k * rows + i]) * system->force_error[j * nv + k];
        for (size_t i = 0; i < rows; i++)
            velocity[i] = fmax(velocity[i], 0.0);
    }
}

static double size_at(kt_packed_vector x, size_t i) { return x.im ? kt_hypot(x.re[i], x.im[i]) : fabs(x.re[i]); }

/* |w_v' R|, into m->by_force. */
static void write_force_weights(kt_modes *m, const kt_linear_system *system, kt_packed_vector w) {
    const size_t rows = (size_t)system->velocities, first = (size_t)system->positions;
    for (size_t k = 0; k < (size_t)system->coordinates; k++) {
        const double *column = system->response + k * rows;
        double re = 0.0, im = 0.0;
        for (size_t i = 0; i < rows; i++) {
            re += w.re[first + i] * column[i];
            im += w.im ? w.im[first + i] * column[i] : 0.0;
        }
        m->by_force[k] = kt_hypot(re, im);
    }
}

/* The error bound of eigenvalue k, with its eigenvectors x (right) and w (left), and |A| in `norm`:
 *
 *     4 (|w|' D |x| + |w_v' R| F |x|) / |w' x| + eps |A| / s,   at most Elsner's bound (2 |A|)^(1 - 1/n) |E|^(1/n)
 *
 * The sum runs over columns j: (|w|' D + |w_v' R| F)_j |x_j|. F may be absent (force_error). */
static double mode_error_of(kt_modes *m, const kt_linear_system *system, size_t k, double norm) {
    const size_t n = (size_t)system->states, nv = (size_t)system->coordinates;
    const kt_packed_vector w = kt_eigenvector_at(m, m->left, n, k), x = kt_eigenvector_at(m, m->right, n, k);
    double sum = 0.0;
    if (system->force_error)
        write_force_weights(m, system, w);
    for (size_t j = 0; j < n; j++) {
        double column = 0.0;
        for (size_t i = 0; i < n; i++)
            column += size_at(w, i) * m->direct_error[j * n + i];
        for (size_t i = 0; i < nv && system->force_error; i++)
            column += m->by_force[i] * system->force_error[j * nv + i];
        sum += column * size_at(x, j);
    }
    const double whole = kt_modes_product(m, n, k), part = fmax(system->error, DBL_EPSILON); /* |w' x|, |E| / |A| */
    const double most = 2.0 * norm * pow(0.5 * part, 1.0 / (double)n);
    return fmin((sum > 0.0 ? TIMES * sum / whole : 0.0) + DBL_EPSILON * norm / m->condition[k], most);
}

/* ---- modes ------------------------------------------------------------------------------------------------------- */

/* Writes the eigenvalues, one of each conjugate pair, by increasing |lambda| into order; returns their number. */
static int sort_eigenvalues(const kt_modes *m, size_t n, int *order) {
    int count = 0;
    for (size_t k = 0; k < n; k++) {
        if (m->imaginary[k] < 0.0)
            continue;
        const double size = kt_hypot(m->real[k], m->imaginary[k]);
        int at = count++;
        for (; at > 0; at--) {
            const int before = order[at - 1];
            const double other = kt_hypot(m->real[before], m->imaginary[before]);
            if (other < size || (other == size && m->real[before] <= m->real[k]))
                break;
            order[at] = before;
        }
        order[at] = (int)k;
    }
    return count;
}

static kt_mode describe_one_mode(kt_modes *m, const kt_linear_system *system, size_t k, double norm) {
    kt_mode mode = {.error = mode_error_of(m, system, k, norm),
                    .residual = kt_modes_residual(m, system, k, m->real[k], m->imaginary[k]),
                    .count = m->imaginary[k] > 0.0 ? 2 : 1};
    kt_modes_set_eigenvalue(&mode, m->real[k], m->imaginary[k]);
    return mode;
}

kt_status kt_modes_evaluate(kt_modes *m, const kt_linear_system *system, kt_error *error) {
    if (KT_IS_MISSING(error, m, system))
        return KT_ERROR_ARGUMENT;
    const size_t n = (size_t)system->states, nv = (m->n - m->x) / 2;
    double norm = 0.0;
    if ((size_t)system->coordinates != nv || (size_t)system->auxiliary_states != m->x || n > m->n)
        return kt_error_set(error, KT_ERROR_ARGUMENT, NULL,
                            "the modes are for a model of %lu coordinates, the linear system is one of %d",
                            (unsigned long)nv, system->coordinates);
    const kt_status status = kt_lapack_open(error);
    if (status != KT_OK)
        return status;
    if (!solve_modes(m, system, &norm))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the eigenvalues of the state matrix cannot be found: %s",
                            "its numbers are too large, or the iteration did not converge");
    write_direct_errors(m, system);
    m->count = sort_eigenvalues(m, n, m->order);
    for (int i = 0; i < m->count; i++) {
        const size_t k = (size_t)m->order[i];
        m->mode[i] = describe_one_mode(m, system, k, norm);
        kt_modes_write_shape(m, system, k, i);
    }
    kt_modes_mend_shapes(m, system);
    return KT_OK;
}

int kt_modes_count(const kt_modes *m) { return m ? m->count : 0; }
kt_mode kt_modes_at(const kt_modes *m, int mode) {
    if (!m || !KT_IS_INDEX(mode, m->count))
        return (kt_mode){.real = (double)NAN, .imaginary = (double)NAN};
    return m->mode[mode];
}
const double *kt_modes_positions(const kt_modes *m, int mode) {
    return m && KT_IS_INDEX(mode, m->count) ? m->positions + (size_t)mode * (m->n - m->x) : NULL;
}
const double *kt_modes_velocities(const kt_modes *m, int mode) {
    return m && KT_IS_INDEX(mode, m->count) ? m->velocities + (size_t)mode * (m->n - m->x) : NULL;
}
const double *kt_modes_auxiliary_states(const kt_modes *m, int mode) {
    return m && m->x > 0 && KT_IS_INDEX(mode, m->count) ? m->auxiliary_states + (size_t)mode * 2 * m->x : NULL;
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

KT_ARENA_LAYOUT(lay_out, kt_modes, KT_MODES_FIELDS, size_t n, size_t x)

static size_t auxiliary_states_of(const kt_model *model) {
    return 2 * (size_t)kt_model_nv(model) + (size_t)kt_auxiliary_state_count(model);
}

size_t kt_modes_size(const kt_model *model) {
    return model ? lay_out(NULL, auxiliary_states_of(model), (size_t)kt_auxiliary_state_count(model)) : 0;
}

kt_status kt_modes_init(const kt_model *model, void *memory, size_t size, kt_modes **modes, kt_error *error) {
    if (KT_IS_MISSING(error, model, modes))
        return KT_ERROR_ARGUMENT;
    const kt_status status =
        kt_arena_begin("kt_modes_init", "kt_modes_size", memory, size, kt_modes_size(model), error);
    if (status != KT_OK)
        return status;
    *modes = memory;
    (*modes)->n = auxiliary_states_of(model);
    (*modes)->x = (size_t)kt_auxiliary_state_count(model);
    (void)lay_out(memory, (*modes)->n, (*modes)->x);
    return KT_OK;
}

kt_status kt_modes_create(const kt_model *model, kt_modes **modes, kt_error *error) {
    if (KT_IS_MISSING(error, model, modes))
        return KT_ERROR_ARGUMENT;
    const size_t size = kt_modes_size(model);
    void *memory = kt_arena_allocate(size, "modes", error);
    return memory == NULL ? KT_ERROR_MEMORY : kt_arena_own(memory, kt_modes_init(model, memory, size, modes, error));
}

void kt_modes_free(kt_modes *modes) { kt_arena_free(modes); }
