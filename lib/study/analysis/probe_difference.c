/* Derivatives of a probe along a direction: central differences, extrapolated to step size zero.
 *
 *     T[k][0] = (f(h_k) - f(-h_k)) / (2 h_k),  h_k = h_0 / 2^k
 *     T[k][j] = T[k][j-1] + (T[k][j-1] - T[k-1][j-1]) / (4^j - 1)
 *
 * The estimated error of T[k][j] is the rounding error of f, eps |f| / h_k, plus the larger of [Ridders]
 *
 *     |T[k][j] - T[k][j-1]|  and  |T[k][j] - T[k-1][j-1]|.
 *
 * For each number the T[k][j] with the least estimated error is taken. An acceleration that is stiff in one joint and
 * soft in another needs different steps. The least of many estimates may be small by chance, in two ways. First, three
 * numbers of the tableau may agree although all are wrong. Then the next rows differ from these numbers by more than
 * the errors of both, and the error is raised to this difference. Second, the actual rounding error of f dominates the
 * last and shortest step. The rounding error depends on the conditioning of the loop equations. Therefore the error is
 * at least the estimate at that step times h_last / h_taken. Steps from which the mechanism cannot be assembled are
 * left out. Halving continues until no number improves any more and all are accurate, or to 2^-30.
 *
 * Unlike finite differences with one step, this needs no estimate of the scale on which f changes. The first step must
 * only not be smaller than about 1e-3 times that scale: rounding dominates below.
 *
 * Source: C. J. F. Ridders, Advances in Engineering Software 4, 1982, 75-76.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "analysis/analysis.h"

#include <float.h>
#include <math.h>

enum { HALVINGS = 30, IDLE_MOST = 2 };
enum { COMPARED = 4 }; /* steps down to this part of the one that was taken can contradict it */

#define GOOD 1e-14   /* of its row's size: accurate enough */
#define PASSES 1e-5  /* of its row's size: halving continues while an error is larger */
#define NOTHING 1e-4 /* of the value: a smaller change over the first step counts as no change */

typedef struct extrapolation {
    kt_linearization *l;
    double *last, *now; /* KT_TABLEAU_DEPTH rows of f numbers each */
    double *derivative, *error;
    double first;
    int step_count; /* number of steps in the tableau */
} extrapolation;

/* Computes the next row of the tableau for one number. */
static void extrapolate_difference(const extrapolation *x, size_t i, double difference) {
    const size_t f = x->l->size.f;
    double power = 1.0;
    x->now[i] = difference;
    for (int j = 1; j <= x->step_count && j < KT_TABLEAU_DEPTH; j++) {
        power *= 4.0;
        const double finer = x->now[(size_t)(j - 1) * f + i], coarser = x->last[(size_t)(j - 1) * f + i];
        x->now[(size_t)j * f + i] = finer + (finer - coarser) / (power - 1.0);
    }
}

/* Replaces the present estimate by the best estimate of the new row if the error of the new estimate is smaller;
 * returns whether it was. An estimate that differs from the present one by more than both errors shows that the present
 * error was small by chance. Then the present error is raised to the difference, except if the new step is so much
 * shorter that rounding may explain the difference. */
static bool take_best(const extrapolation *x, size_t i, double h, double rounding) {
    const size_t f = x->l->size.f;
    bool better = false;
    for (int j = 1; j <= x->step_count && j < KT_TABLEAU_DEPTH; j++) {
        const double now = x->now[(size_t)j * f + i];
        const double error =
            fmax(fabs(now - x->now[(size_t)(j - 1) * f + i]), fabs(now - x->last[(size_t)(j - 1) * f + i])) + rounding;
        const double apart = fabs(now - x->derivative[i]) - error;
        if (apart > x->error[i] && h >= x->l->best_step[i] / COMPARED)
            x->error[i] = apart;
        if (!(error < x->error[i]))
            continue;
        better = true;
        x->error[i] = error;
        x->l->best_step[i] = h;
        x->derivative[i] = now;
    }
    return better;
}

/* Raises the errors to the rounding that the last step shows. The two rows of the tableau have been swapped since. */
static void expect_difference_rounding(const extrapolation *x, double h) {
    const size_t f = x->l->size.f;
    const int deepest = x->step_count - 1 < KT_TABLEAU_DEPTH - 1 ? x->step_count - 1 : KT_TABLEAU_DEPTH - 1;
    for (size_t i = 0; i < f && deepest > 1; i++) {
        const double last = x->last[(size_t)deepest * f + i];
        const double apart = fmax(fabs(last - x->last[(size_t)(deepest - 1) * f + i]),
                                  fabs(last - x->now[(size_t)(deepest - 1) * f + i]));
        x->error[i] = fmax(x->error[i], apart * h / x->l->best_step[i]);
    }
}

/* The parts of a probe are 0: dq, 1: dv, 2: a, 3: velocities of markers, 4: rates of auxiliary states. The first
 * function returns the part of number i, and the second the unit (1 rad or a length) that scales the number. */
static size_t probe_part_of(const kt_linearization *l, size_t i) {
    return i < 3 * l->size.v ? i / l->size.v : i < kt_probe_rates(l) ? 3 : 4;
}
static double probe_unit_of(const kt_linearization *l, size_t i) {
    if (i >= 3 * l->size.v)
        return 1.0;
    const double unit = l->unit[i % l->size.v];
    return l->of_force && probe_part_of(l, i) == 2 ? 1.0 / unit : unit; /* a force times a unit is an energy */
}

/* Adds one step size. Returns whether a number that was not yet accurate has improved, and the largest error over its
 * size. */
static bool add_difference_step(extrapolation *x, double h, double *worst) {
    kt_linearization *l = x->l;
    bool better = false;
    double size[5] = {0.0, 0.0, 0.0, 0.0, 0.0};
    *worst = 0.0;
    for (size_t i = 0; i < l->size.f; i++) {
        extrapolate_difference(x, i, (l->ahead[i] - l->behind[i]) / (2.0 * h));
        size[probe_part_of(l, i)] = fmax(size[probe_part_of(l, i)], fabs(x->now[i]) / probe_unit_of(l, i));
    }
    for (size_t i = 0; i < l->size.f && x->step_count; i++) {
        const double whole = fmax(size[probe_part_of(l, i)] * probe_unit_of(l, i), NOTHING * l->floor[i] / x->first);
        const bool was_good = x->error[i] <= GOOD * whole;
        better |= take_best(x, i, h, 2.0 * DBL_EPSILON * l->floor[i] / h) && !was_good;
        if (whole > 0.0)
            *worst = fmax(*worst, x->error[i] / whole);
    }
    double *last = x->last;
    x->last = x->now;
    x->now = last;
    x->step_count++;
    return better;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): written by way of the extrapolation */
kt_status kt_probe_difference(kt_linearization *l, double first, double *derivative, double *derivative_error,
                              kt_error *error) {
    extrapolation x = {.l = l,
                       .last = l->tableau,
                       .now = l->tableau + KT_TABLEAU_DEPTH * l->size.f,
                       .derivative = derivative,
                       .error = derivative_error,
                       .first = first};
    kt_error cause = {.code = KT_OK};
    bool known = false;
    int idle = 0;
    for (size_t i = 0; i < l->size.f; i++)
        derivative_error[i] = HUGE_VAL;
    double h = first;
    for (int k = 0; k < HALVINGS && idle < IDLE_MOST; k++) {
        double worst;
        h = ldexp(first, -k);
        if (kt_probe(l, h, l->ahead, &cause) != KT_OK || kt_probe(l, -h, l->behind, &cause) != KT_OK) {
            x.step_count = 0; /* cannot be assembled: the rows of longer steps are discarded */
            continue;
        }
        const bool better = add_difference_step(&x, h, &worst);
        known |= x.step_count > 1;
        if (x.step_count > 1 && worst <= GOOD)
            break;
        idle = x.step_count > 1 && !better && worst <= PASSES ? idle + 1 : 0;
    }
    if (known) {
        expect_difference_rounding(&x, h);
        return KT_OK;
    }
    if (error)
        *error = cause;
    return cause.code;
}
