/* Linear stability: R(z), y1 = R(h lambda) y0 for y' = lambda y, and the longest step that stability allows.
 *
 * The family defines R and the points at which |R| exceeds 1 on the axes. If |R| = 1 to rounding, as for an undamped
 * mode near 0, |R| cannot be compared with 1. For a general eigenvalue the criterion is the growth over a whole run,
 * because the rounding of one step does not affect this growth.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

#include "kinetree/algebra.h"

#include <float.h>
#include <math.h>

kt_status kt_stability_make(const kt_method *method, int stages, kt_stability *stability, kt_error *error) {
    if (KT_IS_MISSING(error, method, stability))
        return KT_ERROR_ARGUMENT;
    kt_status status = kt_method_check_sizes(method, error);
    if (status != KT_OK)
        return status;
    kt_stability out = {.family = kt_method_family_of(method)};
    status = out.family->stability(method, stages, &out, error);
    if (status == KT_OK)
        *stability = out;
    return status;
}

int kt_stability_stages(const kt_method *method, double z) {
    if (!method)
        return 0;
    const kt_method_family *family = kt_method_family_of(method);
    return family->stages != NULL ? family->stages(method, z) : method->stages;
}

double kt_stability_real_limit(const kt_stability *s) { return s ? s->family->real_limit(s) : (double)NAN; }
double kt_stability_imaginary_limit(const kt_stability *s) { return s ? s->family->imaginary_limit(s) : (double)NAN; }

void kt_stability_grid(const kt_stability *s, kt_complex low, kt_complex high, int columns, int rows, double *gain) {
    if (!s || !gain || columns < 2 || rows < 2)
        return;
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < columns; j++) {
            const kt_complex z = {low.re + (high.re - low.re) * (double)j / (double)(columns - 1),
                                  low.im + (high.im - low.im) * (double)i / (double)(rows - 1)};
            gain[(size_t)i * (size_t)columns + (size_t)j] = kt_stability_gain(s, z);
        }
}

/* ---- steps ------------------------------------------------------------------------------------------------------- */

double kt_stability_growth(const kt_stability *s, kt_complex lambda, double step, double duration) {
    if (!s)
        return (double)NAN;
    const bool by_frequency = s->poles > 0 && lambda.re > 0.0;
    const kt_complex z = {by_frequency ? 0.0 : step * lambda.re, step * lambda.im};
    const double truth = z.re > 0.0 ? z.re : 0.0; /* ln of the true growth of the mode in one step */
    const double horizon = lambda.re > 0.0 ? fmin(duration, 1.0 / lambda.re) : duration;
    const double steps = fmax(horizon / step, 1.0);
    const double growth = exp(steps * (log(kt_stability_gain(s, z)) - truth));
    return isnan(growth) ? HUGE_VAL : growth;
}

/* The error of a period is 2 pi |z|^p times a constant near 1. If |z| is below sqrt(eps), the roundings of R(z) over
 * 2 pi / |z| steps are larger, and the error counts as zero. */
double kt_stability_period_error(const kt_stability *s, kt_complex lambda, double step) {
    if (!s)
        return (double)NAN;
    const kt_complex z = {step * lambda.re, step * fabs(lambda.im)}, value = kt_stability_value(s, z);
    if (kt_hypot(z.re, z.im) < sqrt(DBL_EPSILON))
        return 0.0;
    const double steps = 2.0 * acos(-1.0) / z.im, turn = steps * atan2(value.im, value.re);
    const double gain = exp(steps * log(kt_hypot(value.re, value.im))), truth = exp(steps * z.re);
    const double error = kt_hypot(gain * cos(turn) - truth, gain * sin(turn));
    return steps >= 2.0 && !isnan(error) ? error : fmax(1.0, error);
}

/* One mode of a method with a fixed number of stages, as a function of x = h |lambda|. */
typedef struct mode {
    const kt_stability *stability;
    kt_complex lambda;
    double size, duration, growth;
} mode;

static bool mode_is_stable(const void *problem, double x) {
    const mode *m = problem;
    return kt_stability_growth(m->stability, m->lambda, x / m->size, m->duration) <= m->growth;
}

/* Each mode is searched only up to the step that previous modes allow, so that the order affects the time but not
 * the result. */
static double longest_of_each(const kt_stability *s, const kt_complex *lambda, size_t count, double duration,
                              double growth, ptrdiff_t *index) {
    double step = HUGE_VAL;
    for (size_t i = 0; i < count; i++) {
        const mode m = {s, lambda[i], kt_hypot(lambda[i].re, lambda[i].im), duration, growth};
        if (!(m.size > 0.0))
            continue;
        const double most = fmin(step * m.size, kt_farthest_stable(s)), x = kt_first_exit(mode_is_stable, &m, most);
        if (x / m.size < step) {
            step = x / m.size;
            *index = (ptrdiff_t)i;
        }
    }
    return step;
}

/* All modes together, as a function of x = h radius, for a number of stages that follows from the step. */
typedef struct spectrum {
    const kt_method *method;
    const kt_complex *lambda;
    size_t count;
    double radius, duration, growth;
} spectrum;

/* The largest |lambda|, and its index. */
static double largest_size(const kt_complex *lambda, size_t count, ptrdiff_t *index) {
    double radius = 0.0;
    for (size_t i = 0; i < count; i++) {
        const double size = kt_hypot(lambda[i].re, lambda[i].im);
        if (size > radius) {
            radius = size;
            *index = (ptrdiff_t)i;
        }
    }
    return radius;
}

/* The largest growth of a mode, at least 1, and the index of this mode if it grows, with the method's number of stages
 * for this step. */
static double worst_growth(const kt_method *method, double radius, const kt_complex *lambda, size_t count, double step,
                           double duration, ptrdiff_t *index) {
    kt_stability s;
    double worst = 1.0;
    const int stages = kt_stability_stages(method, step * radius);
    if (kt_stability_make(method, stages, &s, NULL) != KT_OK) {
        (void)largest_size(lambda, count, index);
        return HUGE_VAL;
    }
    for (size_t i = 0; i < count; i++) {
        const double growth = kt_stability_growth(&s, lambda[i], step, duration);
        if (growth > worst) {
            worst = growth;
            *index = (ptrdiff_t)i;
        }
    }
    return worst;
}

static bool spectrum_is_stable(const void *problem, double x) {
    const spectrum *p = problem;
    ptrdiff_t unused;
    return worst_growth(p->method, p->radius, p->lambda, p->count, x / p->radius, p->duration, &unused) <= p->growth;
}

/* The longest stable step of all modes. *index: the mode that grows just beyond it. */
static double longest_of_all(const spectrum *p, ptrdiff_t *index) {
    const double most = kt_method_family_of(p->method)->reach(p->method);
    const double x = fmin(kt_first_exit(spectrum_is_stable, p, most), most);
    (void)worst_growth(p->method, p->radius, p->lambda, p->count, (1.0 + 1e-9) * x / p->radius, p->duration, index);
    return x / p->radius;
}

double kt_stability_step(const kt_method *method, const kt_complex *eigenvalues, size_t count, double duration,
                         double growth, ptrdiff_t *index) {
    if (!method || (!eigenvalues && count > 0))
        return (double)NAN;
    ptrdiff_t unused = -1;
    ptrdiff_t *const to = index != NULL ? index : &unused;
    kt_stability stability;
    *to = -1;
    if (kt_stability_make(method, 2, &stability, NULL) != KT_OK)
        return 0.0;
    if (!kt_method_stages_vary(method))
        return longest_of_each(&stability, eigenvalues, count, duration, growth, to);
    const spectrum p = {method, eigenvalues, count, largest_size(eigenvalues, count, &unused), duration, growth};
    return p.radius > 0.0 ? longest_of_all(&p, to) : HUGE_VAL;
}

double kt_stability_worst(const kt_method *method, const kt_complex *eigenvalues, size_t count, double step,
                          double duration, ptrdiff_t *index) {
    if (!method || (!eigenvalues && count > 0))
        return (double)NAN;
    ptrdiff_t unused = -1;
    ptrdiff_t *const to = index != NULL ? index : &unused;
    *to = -1;
    const double radius = largest_size(eigenvalues, count, &unused);
    return worst_growth(method, radius, eigenvalues, count, step, duration, to);
}
