/* Muscles as formulas.
 *
 * A muscle has the operating range [r0, r1] of its scaled length l, which belongs to the range [a, b] of the length L
 * of its actuator. With L0 = (b - a) / (r1 - r0)
 *     l = r0 + (L - a) / L0,   v = L' / (L0 vmax).
 * The force along L is -F (w A(l) V(v) + P(l)). Here w is the activation, and F (`force`) is the largest force at rest.
 * The names lmin, lmax, vmax, fpmax and fvmax stand for `shortest`, `longest`, `speed`, `passive` and `stretched`. With
 *     h(s) = s^2 / 2 - max(s - 1, 0)^2,   0 <= s <= 2,   which rises from 0 to 1:
 *     A = h((l - lmin) / ((1 - lmin) / 2)) h((lmax - l) / ((lmax - 1) / 2)), the arguments clamped to [0, 2]
 *     P = fpmax (s^2 - max(s - 1, 0)^2) / 2 with s = max(0, (l - 1) / ((lmax - 1) / 2)), a line beyond s = 1
 *     V = (1 + v)^2 for v in [-1, 0],   1 + 2 v - v^2 / c for v in [0, c] with c = fvmax - 1, constant beyond.
 * The activation follows the control u, both within [0, 1]:
 *     w' = (u - w) / T,   T = T1 e if u > w, else T2 / e,   e = 1/2 + 3/2 w
 * With a width d > 0, T is T2 / e + (T1 e - T2 / e) S((u - w) / d + 1/2), S(x) = x^3 (10 - 15 x + 6 x^2) in [0, 1].
 *
 * Source: the documentation of MuJoCo, modeling, section Muscles, after Millard et al., J. Biomech. Eng. 135 (2013). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/actuator.h"

#include <math.h>

static const double least = 1e-15; /* of divisors */

kt_muscle_scale kt_muscle_scale_of(const kt_muscle *m) {
    const double unit = fmax(least, (m->lengths[1] - m->lengths[0]) / fmax(least, m->range[1] - m->range[0]));
    return (kt_muscle_scale){
        .offset = m->range[0] - m->lengths[0] / unit, .slope = 1.0 / unit, .rate = 1.0 / fmax(least, unit * m->speed)};
}

void kt_formula_put_delayed(kt_formula_text *to, double value, double delay) {
    kt_formula_print(to, "%g", value);
    if (delay > 0.0)
        kt_formula_print(to, "*step(t - %g)", delay);
}

/* "clamp((x - from)*factor, 0, most)", or "max((x - from)*factor, 0)" if most is infinite. */
static void put_ramp(const char *x, double from, double factor, double most, kt_formula_text *to) {
    kt_formula_print(to, "%s((%s + %g)*%g, 0", isinf(most) ? "max" : "clamp", x, 0.0 - from, factor);
    if (!isinf(most))
        kt_formula_print(to, ", %g", most);
    kt_formula_put(to, ")");
}

/* "(s^2/2 - max(s - 1, 0)^2)" of a ramp s; with half the second term if the ramp has no end. */
static void put_curve(const char *x, double from, double factor, double most, kt_formula_text *to) {
    kt_formula_put(to, "(");
    put_ramp(x, from, factor, most, to);
    kt_formula_put(to, "^2/2 - ");
    put_ramp(x, from + 1.0 / factor, factor, isinf(most) ? most : most - 1.0, to);
    kt_formula_put(to, isinf(most) ? "^2/2)" : "^2)");
}

/* The reciprocal of half the distance from the length 1 to another one. */
static double half_of(double length) { return 2.0 / copysign(fmax(least, fabs(length - 1.0)), length - 1.0); }

void kt_formula_put_active(const kt_muscle *muscle, const char *length, const char *rate, kt_formula_text *to) {
    const double c = muscle->stretched - 1.0;
    kt_formula_print(to, "%g*", -muscle->force);
    put_curve(length, muscle->shortest, -half_of(muscle->shortest), 2.0, to);
    kt_formula_put(to, "*");
    put_curve(length, muscle->longest, -half_of(muscle->longest), 2.0, to);
    kt_formula_print(to, "*(clamp(%s + 1, 0, 1)^2", rate);
    if (c > 0.0) {
        kt_formula_put(to, " + ");
        put_ramp(rate, 0.0, 1.0, c, to);
        kt_formula_put(to, "*(2 - ");
        put_ramp(rate, 0.0, 1.0 / c, 1.0, to);
        kt_formula_put(to, ")");
    }
    kt_formula_put(to, ")");
}

void kt_formula_put_passive(const kt_muscle *muscle, const char *length, kt_formula_text *to) {
    kt_formula_print(to, "%g*", -muscle->force * muscle->passive);
    put_curve(length, 1.0, half_of(muscle->longest), (double)INFINITY, to);
}

/* "T1*e" or "T2/e". */
static void put_time(double time, const char *sign, const char *w, kt_formula_text *to) {
    kt_formula_print(to, "%g%s(0.5 + 1.5*clamp(%s, 0, 1))", fmax(least, time), sign, w);
}

/* w' = (u - w) / (T2 / e + (T1 e - T2 / e) S). S is the step "u > w", or a polynomial of the width d. */
void kt_formula_put_muscle_rate(const kt_activation *activation, double control, const char *w, kt_formula_text *to) {
    const double width = activation->times[2];
    kt_formula_text difference = {.whole = true}, share = {.whole = true};
    kt_formula_put_delayed(&difference, fmin(fmax(control, 0.0), 1.0), activation->delay);
    kt_formula_print(&difference, " - %s", w);
    if (width > least)
        put_ramp(difference.text, -0.5 * width, 1.0 / width, 1.0, &share);
    else
        kt_formula_print(&share, "(%s > 0)", difference.text);
    kt_formula_print(to, "(%s)/(", difference.text);
    put_time(activation->times[1], "/", w, to);
    kt_formula_put(to, " + (");
    put_time(activation->times[0], "*", w, to);
    kt_formula_put(to, " - ");
    put_time(activation->times[1], "/", w, to);
    kt_formula_print(to, ")*%s", share.text);
    if (width > least)
        kt_formula_print(to, "^3*(10 + %s*(6*%s - 15))", share.text, share.text);
    kt_formula_put(to, ")");
    to->whole = to->whole && difference.whole && share.whole;
}
