/* Modes: the solutions x exp(lambda t) of x' = A x.
 *
 * Eigenvalues and eigenvectors of A are computed by LAPACK's dgeevx (balancing, Hessenberg form, QR). To first order
 * the error of lambda is at most
 *
 *     4 |w|' E |x| / |w' x| + eps |A| / s,   A x = lambda x, w' A = lambda w'
 *
 * with E the estimated error of each entry of A; |A| and s = |w' x| are those of the balanced matrix (LAPACK Users'
 * Guide, 3rd ed., section 4.8.1). Where eigenvalues with the same shape coincide, w' x vanishes; then L. Elsner's bound
 * (2 |A|)^(1 - 1/n) |E|^(1/n) applies (Linear Algebra and its Applications 47, 1982, 127-138). Entries of A that are
 * smaller than their estimated error are set to zero, so that a cyclic coordinate, on which nothing depends, has an
 * eigenvalue of zero and not the square root of rounding.
 */
#include "base/arena.h"
#include "base/require.h"
#include "kinetree/analysis.h"
#include "linear/eigen.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define TIMES 4.0 /* true errors are within so many estimated ones (test/analysis/honest.c) */

/* Every array: type, name, count, meaning. n: largest number of states, twice the coordinates and own ones, x. */
#define KT_MODES_FIELDS(X)                                                                                             \
    KT_EIGEN_FIELDS(X)                                                                                                 \
    X(double, matrix, n *n, "state matrix, overwritten")                                                               \
    X(int, order, n, "eigenvalues as they are handed out")                                                             \
    X(kt_mode, mode, n, "handed out")                                                                                  \
    X(double, positions, n *(n - x), "shapes: a complex number for each coordinate")                                   \
    X(double, velocities, n *(n - x), "shapes: likewise")                                                              \
    X(double, own_states, 2 * n * x, "shapes: a complex number for each own state")

struct kt_modes {
    void *owned; /* memory of kt_modes_create, or NULL */
    size_t n, x;
    int count;
    KT_ARENA_DECLARE(KT_MODES_FIELDS)
};

static const double pi = 3.14159265358979323846;

/* ---- eigenvalues ------------------------------------------------------------------------------------------------- */

static bool solve(kt_modes *m, const kt_linear_system *system, double *norm) {
    const size_t n = (size_t)system->states;
    for (size_t i = 0; i < n * n; i++) {
        m->matrix[i] = fabs(system->state[i]) > system->state_error[i] ? system->state[i] : 0.0;
        if (!isfinite(system->state[i]))
            return false;
    }
    return KT_EIGEN_SOLVE(m, n, m->matrix, norm);
}

/* An eigenvector as LAPACK packs it: a real one is one column, of a conjugate pair re and im are two columns. */
typedef struct packed {
    const double *re, *im; /* im: NULL if real */
} packed;

static packed vector_at(const kt_modes *m, const double *all, size_t n, size_t k) {
    packed x = {all + k * n, m->imaginary[k] > 0.0 ? all + (k + 1) * n : NULL};
    return x;
}

static double size_at(packed x, size_t i) { return x.im ? hypot(x.re[i], x.im[i]) : fabs(x.re[i]); }

/* |w' x| */
static double product_of(const kt_modes *m, size_t n, size_t k) {
    const packed w = vector_at(m, m->left, n, k), x = vector_at(m, m->right, n, k);
    const bool paired = w.im && x.im;
    double re = 0.0, im = 0.0;
    for (size_t j = 0; j < n; j++) {
        re += w.re[j] * x.re[j] + (paired ? w.im[j] * x.im[j] : 0.0);
        im += paired ? w.re[j] * x.im[j] - w.im[j] * x.re[j] : 0.0;
    }
    return hypot(re, im);
}

/* The error bound of lambda (see above). */
static double error_of(const kt_modes *m, const kt_linear_system *system, size_t k, double norm) {
    const size_t n = (size_t)system->states;
    const packed w = vector_at(m, m->left, n, k), x = vector_at(m, m->right, n, k);
    double sum = 0.0;
    for (size_t j = 0; j < n; j++) {
        double column = 0.0;
        for (size_t i = 0; i < n; i++)
            column += size_at(w, i) * system->state_error[j * n + i];
        sum += column * size_at(x, j);
    }
    const double whole = product_of(m, n, k), part = fmax(system->error, DBL_EPSILON);
    const double most = 2.0 * norm * pow(0.5 * part, 1.0 / (double)n);
    return fmin((sum > 0.0 ? TIMES * sum / whole : 0.0) + DBL_EPSILON * norm / m->condition[k], most);
}

/* ---- modes ------------------------------------------------------------------------------------------------------- */

/* Writes the eigenvalues, one of each conjugate pair, by increasing |lambda| into order; returns their number. */
static int sort(const kt_modes *m, size_t n, int *order) {
    int count = 0;
    for (size_t k = 0; k < n; k++) {
        if (m->imaginary[k] < 0.0)
            continue;
        const double size = hypot(m->real[k], m->imaginary[k]);
        int at = count++;
        for (; at > 0; at--) {
            const int before = order[at - 1];
            const double other = hypot(m->real[before], m->imaginary[before]);
            if (other < size || (other == size && m->real[before] <= m->real[k]))
                break;
            order[at] = before;
        }
        order[at] = (int)k;
    }
    return count;
}

static kt_mode describe(const kt_modes *m, const kt_linear_system *system, size_t k, double norm) {
    const double size = hypot(m->real[k], m->imaginary[k]);
    return (kt_mode){.real = m->real[k],
                     .imaginary = m->imaginary[k],
                     .frequency = m->imaginary[k] / (2.0 * pi),
                     .damping = size > 0.0 ? -m->real[k] / size : 0.0,
                     .error = error_of(m, system, k, norm),
                     .count = m->imaginary[k] > 0.0 ? 2 : 1};
}

/* out = basis x (nv complex numbers). */
static void apply(const kt_linear_system *system, const double *basis, packed x, double *out) {
    const size_t nv = (size_t)system->coordinates;
    memset(out, 0, 2 * nv * sizeof *out);
    for (size_t j = 0; j < (size_t)system->states; j++)
        for (size_t i = 0; i < nv; i++) {
            out[2 * i] += basis[j * nv + i] * x.re[j];
            out[2 * i + 1] += x.im ? basis[j * nv + i] * x.im[j] : 0.0;
        }
}

/* The complex factor that makes the largest component of a shape, in units, equal to 1; returns false if all are zero.
 */
static bool find_largest(const kt_linear_system *system, const double *shape, double *re, double *im) {
    double most = 0.0;
    for (int i = 0; i < system->coordinates; i++) {
        const double a = shape[2 * i] / system->unit[i], b = shape[2 * i + 1] / system->unit[i], size = hypot(a, b);
        if (!(size > most * (1.0 + 1e-6))) /* of equal ones the first, independently of rounding */
            continue;
        most = size;
        *re = a / size / size;
        *im = -b / size / size;
    }
    return most > 0.0;
}

static void turn(int count, double re, double im, double *shape) {
    for (int i = 0; i < count; i++) {
        const double a = shape[2 * i], b = shape[2 * i + 1];
        shape[2 * i] = a * re - b * im;
        shape[2 * i + 1] = a * im + b * re;
    }
}

/* The amplitude alpha = w' x' / (w' x) of a mode in the state's own motion, x' = sum over modes of alpha x. */
static double amplitude_of(const kt_modes *m, const kt_linear_system *system, size_t k) {
    const size_t n = (size_t)system->states;
    const packed w = vector_at(m, m->left, n, k);
    double re = 0.0, im = 0.0;
    for (size_t i = 0; i < n; i++) {
        re += w.re[i] * system->rate[i];
        im += w.im ? w.im[i] * system->rate[i] : 0.0;
    }
    return (w.im ? 2.0 : 1.0) * hypot(re, im) / product_of(m, n, k);
}

/* Writes the scaled shape of a mode; returns its excitation. */
static double write_shape(const kt_modes *m, const kt_linear_system *system, size_t k, double *dq, double *dv,
                          double *dx) {
    const packed x = vector_at(m, m->right, (size_t)system->states, k);
    const size_t first = (size_t)(system->states - system->own_states);
    double re = 1.0, im = 0.0;
    apply(system, system->positions_of, x, dq);
    apply(system, system->velocities_of, x, dv);
    for (size_t i = 0; i < (size_t)system->own_states; i++) {
        dx[2 * i] = x.re[first + i];
        dx[2 * i + 1] = x.im ? x.im[first + i] : 0.0;
    }
    const bool moves = find_largest(system, dq, &re, &im);
    if (!moves && !find_largest(system, dv, &re, &im))
        return 0.0;
    turn(system->coordinates, re, im, dq);
    turn(system->coordinates, re, im, dv);
    turn(system->own_states, re, im, dx);
    return moves ? amplitude_of(m, system, k) / hypot(re, im) : 0.0;
}

kt_status kt_modes_evaluate(kt_modes *m, const kt_linear_system *system, kt_error *error) {
    if (KT_IS_MISSING(error, m, system))
        return KT_ERROR_ARGUMENT;
    const size_t n = (size_t)system->states, nv = (m->n - m->x) / 2;
    double norm = 0.0;
    if ((size_t)system->coordinates != nv || (size_t)system->own_states != m->x || n > m->n)
        return kt_error_set(error, KT_ERROR_ARGUMENT, NULL,
                            "the modes are for a model of %zu coordinates, the linear system is one of %d", nv,
                            system->coordinates);
    const kt_status status = kt_lapack_open(error);
    if (status != KT_OK)
        return status;
    if (!solve(m, system, &norm))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the eigenvalues of the state matrix cannot be found: %s",
                            "its numbers are too large, or the iteration did not converge");
    m->count = sort(m, n, m->order);
    for (int i = 0; i < m->count; i++) {
        const size_t k = (size_t)m->order[i];
        m->mode[i] = describe(m, system, k, norm);
        m->mode[i].excitation = write_shape(m, system, k, m->positions + (size_t)i * 2 * nv,
                                            m->velocities + (size_t)i * 2 * nv, m->own_states + (size_t)i * 2 * m->x);
    }
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
const double *kt_modes_own_states(const kt_modes *m, int mode) {
    return m && m->x > 0 && KT_IS_INDEX(mode, m->count) ? m->own_states + (size_t)mode * 2 * m->x : NULL;
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

KT_ARENA_LAYOUT(lay_out, kt_modes, KT_MODES_FIELDS, size_t n, size_t x)

static size_t states_of(const kt_model *model) {
    return 2 * (size_t)kt_model_nv(model) + (size_t)kt_own_state_count(model);
}

size_t kt_modes_size(const kt_model *model) {
    return model ? lay_out(NULL, states_of(model), (size_t)kt_own_state_count(model)) : 0;
}

kt_status kt_modes_init(const kt_model *model, void *memory, size_t size, kt_modes **modes, kt_error *error) {
    if (KT_IS_MISSING(error, model, modes))
        return KT_ERROR_ARGUMENT;
    const kt_status status =
        kt_arena_begin("kt_modes_init", "kt_modes_size", memory, size, kt_modes_size(model), error);
    if (status != KT_OK)
        return status;
    *modes = memory;
    (*modes)->n = states_of(model);
    (*modes)->x = (size_t)kt_own_state_count(model);
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
