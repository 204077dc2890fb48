/* Linear stability: the polynomial R(z), y1 = R(h lambda) y0 for y' = lambda y, and how long a step it allows.
 *
 * The stages of a tableau are Y = y0 1 + z A Y, so that with A strictly lower triangular
 *
 *     R(z) = 1 + z b' (I - z A)^-1 1 = 1 + sum_k z^k b' A^(k-1) 1,
 *
 * whose coefficients up to the order p are 1/k!, and are set to that. Sources: E. Hairer, G. Wanner, Solving Ordinary
 * Differential Equations II, 1996, section IV.2; for the stabilised family chebyshev.c.
 *
 * Where |R| = 1 to rounding over a whole interval, as on the imaginary axis near 0, comparing |R| with 1 tells
 * nothing. So the limits come from what is left when the part that is 1 identically is taken out:
 *
 *     real axis:       (1 - R(-x)) / x, which must lie in [0, 2 / x]
 *     imaginary axis:  |R(iy)|^2 - 1 = sum_k e_k y^(2k); the first e_k that is not zero decides near 0, and the limit
 * is the first sign change of the sum over y^(2k) of that k
 *
 * and a general eigenvalue is asked how much it grows in a run, which rounding in one step cannot spoil.
 */
#include "integrator/chebyshev.h"
#include "integrator/integrator.h"

#include <float.h>
#include <math.h>

static kt_complex times(kt_complex a, kt_complex b) {
    const kt_complex product = {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
    return product;
}

/* ---- the polynomial ---------------------------------------------------------------------------------------------- */

static void make_tableau(const kt_method *m, kt_stability *out) {
    const int s = m->stages;
    long double power[KT_METHOD_STAGES_MAX], factorial = 1.0L; /* A^(k-1) 1 */
    for (int i = 0; i < s; i++)
        power[i] = 1.0L;
    out->coefficient[0] = 1.0;
    for (int k = 1; k <= s; k++) {
        long double sum = 0.0L;
        for (int i = 0; i < s; i++)
            sum += (long double)m->b[i] * power[i];
        factorial *= (long double)k;
        out->coefficient[k] = (double)(k <= m->order ? 1.0L / factorial : sum);
        for (int i = s - 1; i >= 0; i--) { /* row i reads those before it alone */
            long double next = 0.0L;
            for (int j = 0; j < i; j++)
                next += (long double)m->a[i * (i - 1) / 2 + j] * power[j];
            power[i] = next;
        }
    }
    for (out->degree = s; out->degree > 0 && out->coefficient[out->degree] == 0.0;)
        out->degree--;
}

kt_status kt_stability_make(const kt_method *method, int stages, kt_stability *stability, kt_error *error) {
    kt_status status = kt_method_check_sizes(method, error);
    if (status != KT_OK)
        return status;
    kt_stability out = {0};
    if (method->stabilised) {
        if (stages < 2 || stages > KT_STABILISED_STAGES_MAX)
            return kt_error_set(error, KT_ERROR_ARGUMENT, method->name, "it has 2 to %d stages, not %d",
                                KT_STABILISED_STAGES_MAX, stages);
        const kt_chebyshev family = kt_chebyshev_make(stages, kt_chebyshev_damping(method));
        out.degree = stages;
        out.stabilised = true;
        out.w0 = family.w0;
        out.w1 = family.w1;
        out.a = family.a;
        out.b = family.b;
        out.copies = kt_chebyshev_copies(method);
    } else {
        make_tableau(method, &out);
    }
    *stability = out;
    return KT_OK;
}

int kt_stability_stages(const kt_method *method, double z) {
    return method->stabilised ? kt_chebyshev_stages(KT_RADIUS_MARGIN * z, kt_chebyshev_damping(method))
                              : method->stages;
}

static kt_complex chebyshev_value(const kt_stability *s, kt_complex z) {
    const kt_complex x = {s->w0 + s->w1 * z.re, s->w1 * z.im};
    kt_complex t1 = {1.0, 0.0}, t = x;
    for (int j = 1; j < s->degree; j++) {
        const kt_complex xt = times(x, t), next = {2.0 * xt.re - t1.re, 2.0 * xt.im - t1.im};
        t1 = t;
        t = next;
    }
    const kt_complex value = {s->a + s->b * t.re, s->b * t.im};
    return value;
}

/* P(z) / 12 - 4 P(z/2)^2 / 3 + 9 P(z/3)^3 / 4 */
static kt_complex extrapolated_value(const kt_stability *s, kt_complex z) {
    const kt_complex half = {z.re / 2.0, z.im / 2.0}, third = {z.re / 3.0, z.im / 3.0};
    const kt_complex p1 = chebyshev_value(s, z), p2 = chebyshev_value(s, half), p3 = chebyshev_value(s, third);
    const kt_complex two = times(p2, p2), three = times(p3, times(p3, p3));
    const kt_complex value = {p1.re / 12.0 - 4.0 / 3.0 * two.re + 2.25 * three.re,
                              p1.im / 12.0 - 4.0 / 3.0 * two.im + 2.25 * three.im};
    return value;
}

kt_complex kt_stability_value(const kt_stability *s, kt_complex z) {
    if (s->stabilised)
        return s->copies > 1 ? extrapolated_value(s, z) : chebyshev_value(s, z);
    kt_complex value = {s->coefficient[s->degree], 0.0};
    for (int k = s->degree - 1; k >= 0; k--) {
        value = times(value, z);
        value.re += s->coefficient[k];
    }
    return value;
}

double kt_stability_gain(const kt_stability *s, kt_complex z) {
    const kt_complex value = kt_stability_value(s, z);
    return hypot(value.re, value.im);
}

void kt_stability_grid(const kt_stability *s, kt_complex low, kt_complex high, int columns, int rows, double *gain) {
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < columns; j++) {
            const kt_complex z = {low.re + (high.re - low.re) * (double)j / (double)(columns - 1),
                                  low.im + (high.im - low.im) * (double)i / (double)(rows - 1)};
            gain[(size_t)i * (size_t)columns + (size_t)j] = kt_stability_gain(s, z);
        }
}

/* ---- limits on the axes ------------------------------------------------------------------------------------------ */

/* Whether x lies inside; a region is searched outwards from 0 and ends where this first fails. */
typedef bool is_inside(const void *problem, double x);

/* Points x_k = (k / GRAIN)^2: R turns over lengths of order 1, the stabilised one over lengths that grow as sqrt(x).
 * The boundary between the last that is inside and the first that is not is halved down to rounding. HUGE_VAL beyond
 * `most`. */
enum { GRAIN = 64, HALVINGS = 60 };

static double first_exit(is_inside *inside, const void *problem, double most) {
    double low = 0.0, high = 0.0;
    for (int k = 1;; k++) {
        high = (double)k * (double)k / (double)(GRAIN * GRAIN);
        high = high < most ? high : most;
        if (!inside(problem, high))
            break;
        if (high >= most)
            return HUGE_VAL;
        low = high;
    }
    for (int i = 0; i < HALVINGS && low < high; i++) {
        const double middle = 0.5 * (low + high);
        if (middle <= low || middle >= high)
            break;
        if (inside(problem, middle))
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* No consistent polynomial of degree s keeps |R| <= 1 further than 2 s^2. */
static double farthest(const kt_stability *s) { return 2.0 * (double)s->degree * (double)s->degree + 1.0; }

/* (1 - R(-x)) / x = c_1 - c_2 x + c_3 x^2 - ... */
static bool inside_real(const void *problem, double x) {
    const kt_stability *s = problem;
    const kt_complex z = {-x, 0.0};
    if (s->stabilised)
        return kt_stability_gain(s, z) <= 1.0;
    double quotient = 0.0;
    for (int k = s->degree; k >= 1; k--)
        quotient = s->coefficient[k] - x * quotient;
    return quotient >= 0.0 && x * quotient <= 2.0;
}

double kt_stability_real_limit(const kt_stability *s) { return first_exit(inside_real, s, farthest(s)); }

/* sum_k e_k x^k, x = y^2, over its first term that is not zero. */
typedef struct excess {
    double e[KT_METHOD_STAGES_MAX + 1];
    int first, degree;
} excess;

static bool inside_imaginary(const void *problem, double y) {
    const excess *p = problem;
    double sum = 0.0;
    for (int k = p->degree; k >= p->first; k--)
        sum = p->e[k] + y * y * sum;
    return sum <= 0.0;
}

/* |R(iy)|^2 - 1 begins with y^4 here, so where it grows, that shows above rounding from some 1e-3 on. */
static bool stabilised_inside_imaginary(const void *problem, double y) {
    const kt_complex z = {0.0, y};
    return kt_stability_gain(problem, z) <= 1.0 + 64.0 * DBL_EPSILON;
}

/* e_k = sum_{i + j = 2k} (-1)^((i - j)/2) c_i c_j; what is below rounding of its terms is 0. */
static excess make_excess(const kt_stability *s) {
    excess p = {.degree = s->degree, .first = -1};
    for (int k = 1; k <= s->degree; k++) {
        long double sum = 0.0L, size = 0.0L;
        for (int i = 0; i <= s->degree; i++) {
            const int j = 2 * k - i;
            if (j < 0 || j > s->degree)
                continue;
            const long double term = (long double)s->coefficient[i] * (long double)s->coefficient[j];
            sum += (i - k) % 2 == 0 ? term : -term;
            size += fabsl(term);
        }
        p.e[k] = fabsl(sum) <= 16.0L * (long double)DBL_EPSILON * size ? 0.0 : (double)sum;
        if (p.first < 0 && p.e[k] != 0.0)
            p.first = k;
    }
    return p;
}

double kt_stability_imaginary_limit(const kt_stability *s) {
    if (s->stabilised) {
        const double y = first_exit(stabilised_inside_imaginary, s, farthest(s));
        return y > 2e-3 ? y : 0.0;
    }
    const excess p = make_excess(s);
    if (p.first < 0 || p.e[p.first] > 0.0)
        return 0.0;
    return first_exit(inside_imaginary, &p, farthest(s));
}

/* ---- steps ------------------------------------------------------------------------------------------------------- */

double kt_stability_growth(const kt_stability *s, kt_complex lambda, double step, double duration) {
    const kt_complex z = {step * lambda.re, step * lambda.im};
    const kt_complex value = kt_stability_value(s, z);
    const double square = value.re * value.re + value.im * value.im;
    const double truth = z.re > 0.0 ? z.re : 0.0; /* ln of what the mode does itself */
    const double horizon = lambda.re > 0.0 ? fmin(duration, 1.0 / lambda.re) : duration;
    const double steps = fmax(horizon / step, 1.0);
    const double growth = exp(steps * (0.5 * log(square) - truth));
    return isnan(growth) ? HUGE_VAL : growth;
}

double kt_stability_period_error(const kt_stability *s, kt_complex lambda, double step) {
    const kt_complex z = {step * lambda.re, step * fabs(lambda.im)}, value = kt_stability_value(s, z);
    const double steps = 2.0 * acos(-1.0) / z.im, turn = steps * atan2(value.im, value.re);
    const double gain = exp(steps * log(hypot(value.re, value.im))), truth = exp(steps * z.re);
    const double error = hypot(gain * cos(turn) - truth, gain * sin(turn));
    return steps >= 2.0 && !isnan(error) ? error : fmax(1.0, error);
}

/* One mode of a tableau, in steps x = h |lambda|. */
typedef struct mode {
    const kt_stability *stability;
    kt_complex lambda;
    double size, duration, growth;
} mode;

static bool mode_is_stable(const void *problem, double x) {
    const mode *m = problem;
    return kt_stability_growth(m->stability, m->lambda, x / m->size, m->duration) <= m->growth;
}

/* The fastest first would be best; whatever the order, each is searched only as far as the step that the others
 * leave. */
static double tableau_step(const kt_stability *s, const kt_complex *lambda, size_t count, double duration,
                           double growth, ptrdiff_t *index) {
    double step = HUGE_VAL;
    for (size_t i = 0; i < count; i++) {
        const mode m = {s, lambda[i], hypot(lambda[i].re, lambda[i].im), duration, growth};
        if (!(m.size > 0.0))
            continue;
        const double most = fmin(step * m.size, farthest(s)), x = first_exit(mode_is_stable, &m, most);
        if (x / m.size < step) {
            step = x / m.size;
            *index = (ptrdiff_t)i;
        }
    }
    return step;
}

/* All modes of a stabilised method together, in steps x = h radius: the stages change with the step. */
typedef struct spectrum {
    const kt_method *method;
    const kt_complex *lambda;
    size_t count;
    double radius, duration, growth;
} spectrum;

static double largest_size(const kt_complex *lambda, size_t count, ptrdiff_t *index) {
    double radius = 0.0;
    for (size_t i = 0; i < count; i++) {
        const double size = hypot(lambda[i].re, lambda[i].im);
        if (size > radius) {
            radius = size;
            *index = (ptrdiff_t)i;
        }
    }
    return radius;
}

/* The mode that grows most, if any does; of a stabilised method with the stages that it takes for this step. */
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

static double stabilised_step(const spectrum *p, ptrdiff_t *index) {
    const kt_chebyshev family = kt_chebyshev_make(KT_STABILISED_STAGES_MAX, kt_chebyshev_damping(p->method));
    const double most = kt_chebyshev_reach(&family) / KT_RADIUS_MARGIN;
    const double x = fmin(first_exit(spectrum_is_stable, p, most), most);
    (void)worst_growth(p->method, p->radius, p->lambda, p->count, (1.0 + 1e-9) * x / p->radius, p->duration, index);
    return x / p->radius;
}

double kt_stability_step(const kt_method *method, const kt_complex *eigenvalues, size_t count, double duration,
                         double growth, ptrdiff_t *index) {
    ptrdiff_t unused = -1;
    ptrdiff_t *const to = index != NULL ? index : &unused;
    kt_stability stability;
    *to = -1;
    if (kt_stability_make(method, 2, &stability, NULL) != KT_OK)
        return 0.0;
    if (!method->stabilised)
        return tableau_step(&stability, eigenvalues, count, duration, growth, to);
    const spectrum p = {method, eigenvalues, count, largest_size(eigenvalues, count, &unused), duration, growth};
    return p.radius > 0.0 ? stabilised_step(&p, to) : HUGE_VAL;
}

double kt_stability_worst(const kt_method *method, const kt_complex *eigenvalues, size_t count, double step,
                          double duration, ptrdiff_t *index) {
    ptrdiff_t unused = -1;
    ptrdiff_t *const to = index != NULL ? index : &unused;
    *to = -1;
    const double radius = largest_size(eigenvalues, count, &unused);
    return worst_growth(method, radius, eigenvalues, count, step, duration, to);
}
