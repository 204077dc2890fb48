/* Pairs of eigenvalues and vectors: states that have no part in a pair, their sizes, and the shapes of joints. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "analysis/modes.h"

#include "kinetree/algebra.h"

#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

double kt_modes_unit(const kt_linear_system *system, size_t state) {
    const size_t positions = (size_t)system->positions, moving = positions + (size_t)system->velocities;
    if (state >= moving)
        return 1.0;
    return system
        ->unit[state < positions ? system->position_coordinate[state] : system->velocity_coordinate[state - positions]];
}

/* Returns whether the remaining entries of a column or row, from `first` on in steps of `stride`, do not exceed their
 * errors. */
static bool is_line_zero(const kt_modes *m, size_t n, size_t first, size_t stride) {
    for (size_t i = 0; i < n; i++)
        if (!m->removed[i] && fabs(m->matrix[first + i * stride]) > m->rounding[first + i * stride])
            return false;
    return true;
}

void kt_modes_remove_rounding(kt_modes *m, size_t n) {
    memset(m->removed, 0, n * sizeof *m->removed);
    m->removals = 0;
    for (bool again = true; again;) {
        again = false;
        for (size_t k = 0; k < n; k++) {
            if (m->removed[k])
                continue;
            const bool column = is_line_zero(m, n, k * n, 1), row = !column && is_line_zero(m, n, k, n);
            for (size_t i = 0; i < n && (column || row); i++)
                if (!m->removed[i])
                    m->matrix[column ? k * n + i : i * n + k] = 0.0;
            if (!column && !row)
                continue;
            m->removed[k] = true;
            m->removal[m->removals++] = (int)k;
            again = true;
        }
    }
}

double kt_modes_product(const kt_modes *m, size_t n, size_t k) {
    const kt_packed_vector w = kt_eigenvector_at(m, m->left, n, k), x = kt_eigenvector_at(m, m->right, n, k);
    const bool paired = w.im && x.im;
    double re = 0.0, im = 0.0;
    for (size_t j = 0; j < n; j++) {
        re += w.re[j] * x.re[j] + (paired ? w.im[j] * x.im[j] : 0.0);
        im += paired ? w.re[j] * x.im[j] - w.im[j] * x.re[j] : 0.0;
    }
    return kt_hypot(re, im);
}

void kt_modes_set_eigenvalue(kt_mode *mode, double real, double imaginary) {
    const double size = kt_hypot(real, imaginary);
    mode->real = real;
    mode->imaginary = imaginary;
    mode->frequency = imaginary / (2.0 * pi);
    mode->damping = size > 0.0 ? -real / size : 0.0;
}

/* out = basis x (nv complex numbers). */
static void apply_basis(const kt_linear_system *system, const double *basis, kt_packed_vector x, double *out) {
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
        const double a = shape[2 * i] / system->unit[i], b = shape[2 * i + 1] / system->unit[i], size = kt_hypot(a, b);
        if (!(size > most * (1.0 + 1e-6))) /* the first one of equal numbers, independently of rounding */
            continue;
        most = size;
        *re = a / size / size;
        *im = -b / size / size;
    }
    return most > 0.0;
}

/* shape *= re + i im. */
static void turn_shape(int count, double re, double im, double *shape) {
    for (int i = 0; i < count; i++) {
        const double a = shape[2 * i], b = shape[2 * i + 1];
        shape[2 * i] = a * re - b * im;
        shape[2 * i + 1] = a * im + b * re;
    }
}

/* The amplitude alpha = w' x' / (w' x) of a mode in the state's own motion, x' = sum over modes of alpha x. */
static double amplitude_of(const kt_modes *m, const kt_linear_system *system, size_t k) {
    const size_t n = (size_t)system->states;
    const kt_packed_vector w = kt_eigenvector_at(m, m->left, n, k);
    double re = 0.0, im = 0.0;
    for (size_t i = 0; i < n; i++) {
        re += w.re[i] * system->rate[i];
        im += w.im ? w.im[i] * system->rate[i] : 0.0;
    }
    return (w.im ? 2.0 : 1.0) * kt_hypot(re, im) / kt_modes_product(m, n, k);
}

void kt_modes_write_shape(kt_modes *m, const kt_linear_system *system, size_t k, int index) {
    const size_t length = m->n - m->x, first = (size_t)(system->states - system->auxiliary_states), at = (size_t)index;
    const kt_packed_vector x = kt_eigenvector_at(m, m->right, (size_t)system->states, k);
    double *dq = m->positions + at * length, *dv = m->velocities + at * length;
    double *dx = m->auxiliary_states + at * 2 * m->x;
    double re = 1.0, im = 0.0;
    apply_basis(system, system->positions_of, x, dq);
    apply_basis(system, system->velocities_of, x, dv);
    for (size_t i = 0; i < (size_t)system->auxiliary_states; i++) {
        dx[2 * i] = x.re[first + i];
        dx[2 * i + 1] = x.im ? x.im[first + i] : 0.0;
    }
    m->mode[index].excitation = 0.0;
    const bool moves = find_largest(system, dq, &re, &im);
    if (!moves && !find_largest(system, dv, &re, &im))
        return;
    turn_shape(system->coordinates, re, im, dq);
    turn_shape(system->coordinates, re, im, dv);
    turn_shape(system->auxiliary_states, re, im, dx);
    m->mode[index].excitation = moves ? amplitude_of(m, system, k) / kt_hypot(re, im) : 0.0;
}
