/* The response of a linear system to a harmonic force.
 *
 * The force u = exp(i omega t) acts in the coordinate c, whose column of accelerations is b. All states then oscillate
 * with amplitudes x,
 *
 *     (i omega 1 - A) x = (0, b, 0)
 *
 * for positions, velocities and auxiliary states. The complex matrix is factored for each frequency: unlike a sum over
 * modes, this is also right where eigenvectors coincide, as with critical damping.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/lu.h"
#include "base/require.h"
#include "kinetree/analysis.h"

#include <math.h>
#include <string.h>

size_t kt_frequency_response_size(const kt_linear_system *system) {
    const size_t n = system != NULL ? (size_t)system->states : 0;
    return (2 * n * n + 2 * n) * sizeof(double) + n * sizeof(int);
}

/* i omega - A, whose inverse gives the response. */
static void fill_resolvent(const kt_linear_system *system, double omega, double *re, double *im) {
    const size_t n = (size_t)system->states;
    for (size_t i = 0; i < n * n; i++) {
        re[i] = -system->state[i];
        im[i] = i % (n + 1) == 0 ? omega : 0.0;
    }
}

kt_status kt_frequency_response(const kt_linear_system *system, int coordinate, double omega, void *memory,
                                double *states, kt_error *error) {
    if (KT_IS_MISSING(error, system, memory, states))
        return KT_ERROR_ARGUMENT;
    if (!KT_IS_INDEX(coordinate, system->coordinates) || !isfinite(omega))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "",
                            "coordinate %d of %d, %g rad/s; give a velocity coordinate, and a finite frequency",
                            coordinate, system->coordinates, omega);
    const size_t n = (size_t)system->states, velocities = (size_t)system->velocities;
    double *re = memory, *im = re + n * n, *x = im + n * n, *y = x + n;
    int *pivot = (int *)(void *)(y + n);
    fill_resolvent(system, omega, re, im);
    memset(x, 0, 2 * n * sizeof *x);
    memcpy(x + system->positions, system->response + (size_t)coordinate * velocities, velocities * sizeof *x);
    if (!kt_lu_factor_complex(re, im, n, pivot))
        return kt_error_set(error, KT_ERROR_SINGULAR, "",
                            "the response is infinite: %g rad/s is the frequency of an undamped mode", omega);
    kt_lu_solve_complex(re, im, n, pivot, x, y);
    for (size_t i = 0; i < n; i++) {
        states[2 * i] = x[i];
        states[2 * i + 1] = y[i];
    }
    return KT_OK;
}
