/* Interval arithmetic with Taylor coefficients (Moore, Kearfott and Cloud 2009, Introduction to Interval Analysis,
 * chapter 9). With x_k the k-th derivative of x over k!,
 *
 *     z = x y      z_k = sum_i x_i y_(k-i)
 *     z = x / y    z_k = (x_k - sum_(i<k) z_i y_(k-i)) / y_0
 *     z = sqrt x   z_k = (x_k - sum_(0<i<k) z_i z_(k-i)) / (2 z_0)
 *     z = exp x    k z_k = sum_(i>0) i x_i z_(k-i)
 *     z = log x    z_k = (x_k - (1/k) sum_(0<i<k) i z_i x_(k-i)) / x_0
 *     s = sin x, c = cos x    k s_k = sum_(i>0) i x_i c_(k-i),  k c_k = -sum_(i>0) i x_i s_(k-i)
 *
 * Integrals of these functions (atan, asin, ...) have z_k = (z')_(k-1) / k.
 *
 * Ratios. A value may exceed the largest number, as exp(800) in 1 / (1 + exp(100 (8 - t))). These sums then have no
 * bounds, but the ratios z_k / z_0 have. The ratios follow from the same sums over x_0, y_0 and z_0. For x + y with two
 * numbers of one sign, they are means of the ratios of both. If the signs differ, the same means have bounds as long as
 * |x| > 2 |y|. Their weights are then 1 / (1 + y / x) and 1 less that.
 *
 * Rounding. An interval is widened by two roundings in each operation, so that it contains the result of exact
 * arithmetic. The jet also records whether a value may be NaN. The bounds are those of the numbers alone, since a
 * comparison with NaN yields a number again.
 */
#include "expression/jet.h"

#include <float.h>
#include <math.h>

enum { ORDER = KT_JET_ORDER };

static const kt_between everything = {-HUGE_VAL, HUGE_VAL};
static const kt_between zero = {0.0, 0.0};

/* ---- intervals --------------------------------------------------------------------------------------------------- */

/* Widens an interval by rounding. A value that is too large for a number may be a number in exact arithmetic. Therefore
 * no interval lies at infinity alone. */
static kt_between widened(double lo, double hi) {
    if (isnan(lo) || isnan(hi))
        return everything;
    if (lo == 0.0 && hi == 0.0)
        return zero;
    const double least = smaller(lo, DBL_MAX), most = larger(hi, -DBL_MAX);
    const kt_between wide = {least - 2.0 * DBL_EPSILON * fabs(least) - DBL_TRUE_MIN,
                             most + 2.0 * DBL_EPSILON * fabs(most) + DBL_TRUE_MIN};
    return wide;
}

static bool is_point(kt_between x, double value) { return x.lo == value && x.hi == value; }
static bool holds(kt_between x, double value) { return x.lo <= value && value <= x.hi; }
static bool holds_infinity(kt_between x) { return holds(x, HUGE_VAL) || holds(x, -HUGE_VAL); }

static double most(kt_between x) { return larger(fabs(x.lo), fabs(x.hi)); }
static double least(kt_between x) { return holds(x, 0.0) ? 0.0 : smaller(fabs(x.lo), fabs(x.hi)); }

static kt_between add(kt_between x, kt_between y) { return widened(x.lo + y.lo, x.hi + y.hi); }
static kt_between negate(kt_between x) { return (kt_between){-x.hi, -x.lo}; }
static kt_between subtract(kt_between x, kt_between y) { return add(x, negate(y)); }
static kt_between hull(kt_between x, kt_between y) { return (kt_between){smaller(x.lo, y.lo), larger(x.hi, y.hi)}; }

static double bound_product(double x, double y) { return x == 0.0 || y == 0.0 ? 0.0 : x * y; }

static kt_between multiply(kt_between x, kt_between y) {
    const double a = bound_product(x.lo, y.lo), b = bound_product(x.lo, y.hi), c = bound_product(x.hi, y.lo),
                 d = bound_product(x.hi, y.hi);
    return widened(smaller(smaller(a, b), smaller(c, d)), larger(larger(a, b), larger(c, d)));
}

static kt_between scale(double factor, kt_between x) { return multiply((kt_between){factor, factor}, x); }

static kt_between divide(kt_between x, kt_between y) {
    if (is_point(x, 0.0) && !is_point(y, 0.0))
        return zero;
    if (holds(y, 0.0))
        return everything;
    return multiply(x, widened(1.0 / y.hi, 1.0 / y.lo));
}

/* Bounds of a function that rises everywhere. */
static kt_between raise(double (*f)(double), kt_between x) {
    const kt_between y = widened(f(x.lo), f(x.hi));
    return widened(y.lo, y.hi);
}

/* Bounds of sin over [lo, hi]. Its crests are at (4 n + 1) pi / 2. */
static kt_between bound_sin(kt_between x) {
    static const double pi = 3.14159265358979323846;
    const double slop = 4.0 * DBL_EPSILON * (1.0 + larger(fabs(x.lo), fabs(x.hi)));
    if (!(x.hi - x.lo < 2.0 * pi) || !(slop < 1.0))
        return (kt_between){-1.0, 1.0};
    const double a = sin(x.lo), b = sin(x.hi);
    const double crest = ceil((x.lo - slop - 0.5 * pi) / (2.0 * pi)) * 2.0 * pi + 0.5 * pi;
    const double trough = ceil((x.lo - slop + 0.5 * pi) / (2.0 * pi)) * 2.0 * pi - 0.5 * pi;
    const kt_between ends = widened(smaller(a, b), larger(a, b));
    return (kt_between){trough <= x.hi + slop ? -1.0 : larger(-1.0, ends.lo - slop),
                        crest <= x.hi + slop ? 1.0 : smaller(1.0, ends.hi + slop)};
}

static kt_between bound_cos(kt_between x) {
    static const double half_pi = 1.57079632679489661923;
    return bound_sin(add(x, (kt_between){half_pi, half_pi}));
}

/* Restricts x to the domain [lo, hi] of a function. Returns `everything` if x lies outside it. */
static kt_between within(kt_between x, double lo, double hi) {
    const kt_between cut = {larger(x.lo, lo), smaller(x.hi, hi)};
    return cut.lo <= cut.hi ? cut : everything;
}

static kt_between bound_log(kt_between x) { return x.hi > 0.0 ? raise(log, within(x, 0.0, HUGE_VAL)) : everything; }
static kt_between bound_sqrt(kt_between x) { return x.hi >= 0.0 ? raise(sqrt, within(x, 0.0, HUGE_VAL)) : everything; }

/* Restricts x to the domain of a function. Returns `everything` if x is outside the domain. */

static kt_jet constant(kt_between value) { return (kt_jet){.c = {value, zero, zero, zero, zero}}; }
static kt_jet number(double value) { return constant((kt_between){value, value}); }

static bool is_constant(const kt_jet *x) {
    for (int k = 1; k <= ORDER; k++)
        if (!is_point(x->c[k], 0.0))
            return false;
    return true;
}

static kt_between ratio_of(const kt_jet *x, int k) {
    static const kt_between one = {1.0, 1.0};
    return k == 0 ? one : x->has_ratio ? x->ratio[k] : divide(x->c[k], x->c[0]);
}

/* The intersection of two intervals that contain the same number. */
static kt_between common(kt_between x, kt_between y) {
    const kt_between both = {larger(x.lo, y.lo), smaller(x.hi, y.hi)};
    return both.lo <= both.hi ? both : x;
}

/* Stores the ratios, and uses them to bound coefficients without bounds, or with wide ones. Infinity times 0 bounds
 * nothing. */
static void settle(kt_jet *z, const kt_between ratio[ORDER + 1]) {
    for (int k = 0; k <= ORDER; k++) {
        z->ratio[k] = ratio[k];
        const bool bounds = k > 0 && !(is_point(z->c[0], 0.0) && holds_infinity(ratio[k]));
        z->c[k] = !bounds ? z->c[k] : common(z->c[k], multiply(z->c[0], ratio[k]));
    }
    z->has_ratio = true;
}

static bool have_one_sign(kt_between x, kt_between y) {
    return (x.lo >= 0.0 && y.lo >= 0.0) || (x.hi <= 0.0 && y.hi <= 0.0);
}

/* Bounds of x / (x + y) for numbers of one sign. */
static kt_between share(kt_between x, kt_between y) {
    static const kt_between whole = {0.0, 1.0};
    const double lo = least(x) / (least(x) + most(y)), hi = most(x) / (most(x) + least(y));
    return isnan(lo) || isnan(hi) ? whole : common(whole, widened(lo, hi));
}

/* The weights of x and y in the ratios of x + y, if |x| > 2 |y| and the signs differ. */
static void dominate(kt_between x, kt_between y, kt_between weight[2]) {
    const double m = most(y) / least(x);
    weight[0] = widened(1.0, 1.0 / (1.0 - m));
    weight[1] = widened(-m / (1.0 - m), 0.0);
}

static bool overflows(const kt_jet *x) {
    for (int k = 0; k <= ORDER; k++)
        if (holds_infinity(x->c[k]))
            return true;
    return false;
}

/* The weights of x and y in the ratios of x + y. Returns whether they have bounds. */
static bool weights_of_sum(const kt_jet *of_x, const kt_jet *of_y, kt_between weight[2]) {
    const kt_between x = of_x->c[0], y = of_y->c[0];
    kt_between swapped[2];
    if (have_one_sign(x, y)) {
        weight[0] = share(x, y);
        weight[1] = share(y, x);
        return true;
    }
    if (overflows(of_x) && least(x) > 2.0 * most(y)) {
        dominate(x, y, weight);
        return true;
    }
    if (overflows(of_y) && least(y) > 2.0 * most(x)) {
        dominate(y, x, swapped);
        weight[0] = swapped[1];
        weight[1] = swapped[0];
        return true;
    }
    return false;
}

static kt_jet jet_sum(const kt_jet *x, const kt_jet *y) {
    kt_jet z = {.size = 0.0};
    kt_between weight[2], ratio[ORDER + 1];
    for (int k = 0; k <= ORDER; k++)
        z.c[k] = add(x->c[k], y->c[k]);
    if (weights_of_sum(x, y, weight)) {
        for (int k = 0; k <= ORDER; k++)
            ratio[k] = add(multiply(weight[0], ratio_of(x, k)), multiply(weight[1], ratio_of(y, k)));
        settle(&z, ratio);
    }
    return z;
}

static kt_jet jet_scale(double factor, const kt_jet *x) {
    kt_jet z = *x;
    for (int k = 0; k <= ORDER; k++)
        z.c[k] = scale(factor, x->c[k]);
    return z;
}

/* Negates exactly, so that -2 remains a whole number. */
static kt_jet jet_minus(const kt_jet *x) {
    kt_jet z = *x;
    for (int k = 0; k <= ORDER; k++)
        z.c[k] = negate(x->c[k]);
    return z;
}

static kt_jet jet_difference(const kt_jet *x, const kt_jet *y) {
    const kt_jet minus = jet_minus(y);
    return jet_sum(x, &minus);
}

static kt_jet jet_product(const kt_jet *x, const kt_jet *y) {
    kt_jet z = {.size = 0.0};
    for (int k = 0; k <= ORDER; k++) {
        z.c[k] = zero;
        for (int i = 0; i <= k; i++)
            z.c[k] = add(z.c[k], multiply(x->c[i], y->c[k - i]));
    }
    kt_between ratio[ORDER + 1];
    for (int k = 0; k <= ORDER; k++) {
        ratio[k] = zero;
        for (int i = 0; i <= k; i++)
            ratio[k] = add(ratio[k], multiply(ratio_of(x, i), ratio_of(y, k - i)));
    }
    settle(&z, ratio);
    return z;
}

static kt_jet jet_quotient(const kt_jet *x, const kt_jet *y) {
    kt_jet z = {.size = 0.0};
    for (int k = 0; k <= ORDER; k++) {
        kt_between sum = x->c[k];
        for (int i = 0; i < k; i++)
            sum = subtract(sum, multiply(z.c[i], y->c[k - i]));
        z.c[k] = divide(sum, y->c[0]);
    }
    kt_between ratio[ORDER + 1];
    for (int k = 0; k <= ORDER; k++) {
        ratio[k] = ratio_of(x, k);
        for (int i = 0; i < k; i++)
            ratio[k] = subtract(ratio[k], multiply(ratio[i], ratio_of(y, k - i)));
    }
    settle(&z, ratio);
    return z;
}

static kt_jet jet_sqrt(const kt_jet *x) {
    kt_jet z = {.size = 0.0};
    z.c[0] = bound_sqrt(x->c[0]);
    for (int k = 1; k <= ORDER; k++) {
        kt_between sum = x->c[k];
        for (int i = 1; i < k; i++)
            sum = subtract(sum, multiply(z.c[i], z.c[k - i]));
        z.c[k] = divide(sum, scale(2.0, z.c[0]));
    }
    if (!overflows(x))
        return z;
    kt_between ratio[ORDER + 1] = {{1.0, 1.0}};
    for (int k = 1; k <= ORDER; k++) {
        ratio[k] = ratio_of(x, k);
        for (int i = 1; i < k; i++)
            ratio[k] = subtract(ratio[k], multiply(ratio[i], ratio[k - i]));
        ratio[k] = scale(0.5, ratio[k]);
    }
    settle(&z, ratio);
    return z;
}

static kt_jet jet_exp(const kt_jet *x) {
    kt_jet z = {.size = 0.0};
    z.c[0] = raise(exp, x->c[0]);
    z.c[0].lo = larger(0.0, z.c[0].lo);
    z.c[0].hi = larger(DBL_TRUE_MIN, z.c[0].hi); /* above zero, for every factor */
    for (int k = 1; k <= ORDER; k++)
        z.c[k] = everything;
    kt_between ratio[ORDER + 1] = {{1.0, 1.0}};
    for (int k = 1; k <= ORDER; k++) {
        ratio[k] = zero;
        for (int i = 1; i <= k; i++)
            ratio[k] = add(ratio[k], scale((double)i / k, multiply(x->c[i], ratio[k - i])));
    }
    settle(&z, ratio);
    return z;
}

static kt_jet jet_log(const kt_jet *x) {
    kt_jet z = {.size = 0.0};
    z.c[0] = bound_log(x->c[0]);
    for (int k = 1; k <= ORDER; k++) {
        z.c[k] = ratio_of(x, k);
        for (int i = 1; i < k; i++)
            z.c[k] = subtract(z.c[k], scale((double)i / k, multiply(z.c[i], ratio_of(x, k - i))));
    }
    return z;
}

static void jet_sincos(const kt_jet *x, kt_jet *s, kt_jet *c) {
    *s = *c = (kt_jet){.size = 0.0};
    s->c[0] = bound_sin(x->c[0]);
    c->c[0] = bound_cos(x->c[0]);
    for (int k = 1; k <= ORDER; k++) {
        s->c[k] = c->c[k] = zero;
        for (int i = 1; i <= k; i++) {
            s->c[k] = add(s->c[k], scale((double)i / k, multiply(x->c[i], c->c[k - i])));
            c->c[k] = subtract(c->c[k], scale((double)i / k, multiply(x->c[i], s->c[k - i])));
        }
    }
}

/* The integral of z' = x' / y with the value z_0 at the expansion point. */
static kt_jet jet_integral(kt_between value, const kt_jet *x, const kt_jet *y) {
    kt_jet rate = number(0.0), z = {.c = {value}};
    for (int k = 0; k < ORDER; k++)
        rate.c[k] = scale(k + 1.0, x->c[k + 1]);
    rate = jet_quotient(&rate, y); /* its last coefficient is not used */
    for (int k = 1; k <= ORDER; k++)
        z.c[k] = scale(1.0 / k, rate.c[k - 1]);
    return z;
}

static kt_jet one_plus_square(const kt_jet *x, double sign) {
    kt_jet square = jet_product(x, x);
    const kt_jet one = number(1.0);
    square.c[0].lo = larger(0.0, square.c[0].lo);
    square = jet_scale(sign, &square);
    return jet_sum(&one, &square);
}

static kt_jet jet_atan(const kt_jet *x) {
    const kt_jet y = one_plus_square(x, 1.0);
    return jet_integral(raise(atan, x->c[0]), x, &y);
}

static kt_jet jet_asin(const kt_jet *x) {
    const kt_jet square = one_plus_square(x, -1.0), y = jet_sqrt(&square);
    return jet_integral(raise(asin, within(x->c[0], -1.0, 1.0)), x, &y);
}

static kt_jet jet_acos(const kt_jet *x) {
    static const double half_pi = 1.57079632679489661923;
    const kt_jet angle = jet_asin(x), right = number(half_pi);
    return jet_difference(&right, &angle);
}

static kt_jet jet_tan(const kt_jet *x) {
    kt_jet s, c;
    jet_sincos(x, &s, &c);
    return jet_quotient(&s, &c);
}

/* (e^x + sign e^-x) / 2 */
static kt_jet jet_hyperbolic(const kt_jet *x, double sign) {
    const kt_jet minus = jet_minus(x), e = jet_exp(x);
    kt_jet other = jet_exp(&minus);
    other = jet_scale(sign, &other);
    other = jet_sum(&e, &other);
    other = jet_scale(0.5, &other);
    if (sign > 0.0)
        other.c[0] = common(widened(cosh(least(x->c[0])), cosh(most(x->c[0]))), other.c[0]);
    return other;
}

/* 1 - 2 / (e^2x + 1) */
static kt_jet jet_tanh(const kt_jet *x) {
    const kt_jet twice = jet_scale(2.0, x), one = number(1.0), two = number(2.0);
    kt_jet z = jet_exp(&twice);
    z = jet_sum(&z, &one);
    z = jet_quotient(&two, &z);
    z = jet_difference(&one, &z);
    z.c[0] = within(z.c[0], -1.0, 1.0);
    return z;
}

/* x^n, by squares. */
static kt_jet jet_whole_power(const kt_jet *x, int n) {
    kt_jet z = number(1.0), square = *x;
    for (int rest = n, bits = 0; rest > 0; rest /= 2) {
        if (rest % 2 != 0)
            z = bits++ > 0 ? jet_product(&z, &square) : square;
        square = rest > 1 ? jet_product(&square, &square) : square;
    }
    if (n > 0 && n % 2 == 0)
        z.c[0].lo = larger(0.0, z.c[0].lo);
    return z;
}

static bool is_whole(const kt_jet *y) {
    static const double most = 1048576.0;
    const double n = y->c[0].lo;
    return is_constant(y) && is_point(y->c[0], n) && n == rint(n) && fabs(n) <= most && y->defined == KT_DEFINED;
}

/* e^(y log x), which is defined for x > 0 alone; whole exponents have their own way. */
static kt_jet jet_power(const kt_jet *x, const kt_jet *y) {
    const double n = y->c[0].lo;
    const kt_jet one = number(1.0);
    if (is_whole(y)) {
        const kt_jet z = jet_whole_power(x, (int)fabs(n));
        return n < 0.0 ? jet_quotient(&one, &z) : z;
    }
    if (!(x->c[0].lo > 0.0)) {
        const bool root = is_constant(y) && is_point(y->c[0], n) && n > 0.0 && x->c[0].lo == 0.0;
        return (kt_jet){.c = {root ? widened(0.0, pow(x->c[0].hi, n)) : everything, everything, everything, everything,
                              everything}};
    }
    kt_jet z = jet_log(x);
    z = jet_product(&z, y);
    return jet_exp(&z);
}

/* ---- where there is a value -------------------------------------------------------------------------------------- */

static kt_definedness worse(kt_definedness a, kt_definedness b) { return a > b ? a : b; }

/* The domain of f from lo to hi. */
static kt_definedness defined_between(kt_between x, double lo, double hi) {
    return x.hi < lo || x.lo > hi ? KT_DEFINED_NOWHERE : x.lo < lo || x.hi > hi ? KT_DEFINED_IN_PART : KT_DEFINED;
}

static kt_definedness unless(bool fails) { return fails ? KT_DEFINED_IN_PART : KT_DEFINED; }

/* Whether z = f(x, y) is defined if x and y are. */
static kt_definedness defined_by_values(kt_operator code, kt_between x, kt_between y) {
    switch (code) {
    case KT_OPERATOR_ADD:
        return unless((x.hi == HUGE_VAL && y.lo == -HUGE_VAL) || (x.lo == -HUGE_VAL && y.hi == HUGE_VAL));
    case KT_OPERATOR_SUBTRACT:
        return defined_by_values(KT_OPERATOR_ADD, x, negate(y));
    case KT_OPERATOR_MULTIPLY:
        return unless((holds(x, 0.0) && holds_infinity(y)) || (holds_infinity(x) && holds(y, 0.0)));
    case KT_OPERATOR_DIVIDE:
        return unless((holds(x, 0.0) && holds(y, 0.0)) || (holds_infinity(x) && holds_infinity(y)));
    case KT_OPERATOR_SIN:
    case KT_OPERATOR_COS:
    case KT_OPERATOR_TAN:
        return unless(holds_infinity(x));
    case KT_OPERATOR_ASIN:
    case KT_OPERATOR_ACOS:
        return defined_between(x, -1.0, 1.0);
    case KT_OPERATOR_LOG:
    case KT_OPERATOR_SQRT:
        return defined_between(x, 0.0, HUGE_VAL);
    default:
        return KT_DEFINED;
    }
}

/* In C's arithmetic NaN^0 and 1^NaN are 1, hypot(inf, NaN) is infinite, and comparisons with NaN are false. */
static kt_definedness definedness_of(kt_operator code, const kt_jet *x, const kt_jet *y) {
    const kt_definedness given = worse(x->defined, y->defined);
    switch (code) {
    case KT_OPERATOR_POWER:
        if (is_whole(y))
            return y->c[0].lo == 0.0 ? KT_DEFINED : x->defined;
        return unless(given != KT_DEFINED || x->c[0].lo < 0.0);
    case KT_OPERATOR_HYPOT:
        return unless(given != KT_DEFINED);
    case KT_OPERATOR_SIGN:
    case KT_OPERATOR_STEP:
    case KT_OPERATOR_LESS:
    case KT_OPERATOR_LESS_EQUAL:
    case KT_OPERATOR_GREATER:
    case KT_OPERATOR_GREATER_EQUAL:
    case KT_OPERATOR_EQUAL:
    case KT_OPERATOR_NOT_EQUAL:
        return KT_DEFINED;
    default:
        return worse(given, defined_by_values(code, x->c[0], y->c[0]));
    }
}

/* ---- branches ---------------------------------------------------------------------------------------------------- */

static kt_jet jet_hull(const kt_jet *x, const kt_jet *y) {
    kt_jet z = {.size = 0.0};
    for (int k = 0; k <= ORDER; k++)
        z.c[k] = hull(x->c[k], y->c[k]);
    z.has_ratio = x->has_ratio && y->has_ratio;
    for (int k = 0; k <= ORDER; k++)
        z.ratio[k] = hull(x->ratio[k], y->ratio[k]);
    return z;
}

/* Returns x if the decision is above 0, y if it is below, and the hull of both otherwise. */
static kt_jet chosen(const kt_jet *decision, const kt_jet *x, const kt_jet *y) {
    return decision->c[0].lo > 0.0 ? *x : decision->c[0].hi < 0.0 ? *y : jet_hull(x, y);
}

/* The value of step and of comparisons (0 or 1), or of sign. It is defined even if the decision is not: all comparisons
 * are false then. */
static kt_jet jet_jump(kt_operator code, const kt_jet *decision) {
    const kt_jet below = number(code == KT_OPERATOR_SIGN ? -1.0 : 0.0), above = number(1.0);
    const bool unequal = code == KT_OPERATOR_NOT_EQUAL;
    if (decision->defined == KT_DEFINED_NOWHERE)
        return number(unequal ? 1.0 : 0.0);
    if (decision->defined == KT_DEFINED_IN_PART || unequal || code == KT_OPERATOR_EQUAL)
        return jet_hull(&below, &above);
    if (code == KT_OPERATOR_LESS || code == KT_OPERATOR_LESS_EQUAL)
        return chosen(decision, &below, &above);
    return chosen(decision, &above, &below);
}

static kt_jet jet_switch(kt_operator code, const kt_jet *x, const kt_jet *y, kt_jet_meet *meet, void *user) {
    const bool one = !kt_operator_is_binary(code);
    const kt_jet minus = jet_minus(x);
    kt_jet decision = one ? *x : jet_difference(x, y);
    decision.defined = worse(x->defined, one ? KT_DEFINED : y->defined);
    if (meet != NULL)
        meet(user, &decision);
    switch (code) {
    case KT_OPERATOR_ABS: {
        kt_jet z = chosen(&decision, x, &minus);
        z.c[0].lo = larger(0.0, z.c[0].lo);
        return z;
    }
    case KT_OPERATOR_MIN: {
        kt_jet z = chosen(&decision, y, x);
        z.c[0].hi = smaller(z.c[0].hi, smaller(x->c[0].hi, y->c[0].hi));
        return z;
    }
    case KT_OPERATOR_MAX: {
        kt_jet z = chosen(&decision, x, y);
        z.c[0].lo = larger(z.c[0].lo, larger(x->c[0].lo, y->c[0].lo));
        return z;
    }
    default:
        return jet_jump(code, &decision);
    }
}

/* atan2(y, x); its first argument is y. */
static kt_jet jet_atan2(const kt_jet *y, const kt_jet *x) {
    static const kt_between turn = {-3.2, 3.2};
    const kt_jet minus = jet_minus(x);
    if (x->c[0].lo > 0.0) {
        const kt_jet ratio = jet_quotient(y, x);
        return jet_atan(&ratio);
    }
    if (y->c[0].lo > 0.0 || y->c[0].hi < 0.0) { /* atan(-x / y) plus or minus a right angle */
        const kt_jet ratio = jet_quotient(&minus, y), angle = jet_atan(&ratio);
        const kt_jet right = number(y->c[0].lo > 0.0 ? 1.57079632679489661923 : -1.57079632679489661923);
        return jet_sum(&right, &angle);
    }
    if (x->c[0].hi < 0.0) { /* the slopes are those of atan(y / x); the value jumps where y changes its sign */
        const kt_jet ratio = jet_quotient(y, x);
        kt_jet angle = jet_atan(&ratio);
        angle.c[0] = turn;
        return angle;
    }
    return (kt_jet){.c = {turn, everything, everything, everything, everything}};
}

static kt_jet jet_hypot(const kt_jet *x, const kt_jet *y) {
    kt_jet a = jet_product(x, x), b = jet_product(y, y);
    a.c[0].lo = larger(0.0, a.c[0].lo);
    b.c[0].lo = larger(0.0, b.c[0].lo);
    a = jet_sum(&a, &b);
    return jet_sqrt(&a);
}

/* ---- rounding errors --------------------------------------------------------------------------------------------- */

/* The rounding errors of a power: |n x^(n-1)| dx, and |z| (|log x| dy + |y| dx / |x|). */
static double size_of_power(const kt_jet *z, const kt_jet *x, const kt_jet *y) {
    const double n = fabs(y->c[0].lo), far = most(x->c[0]);
    if (!is_whole(y))
        return least(z->c[0]) * (1.0 + most(bound_log(x->c[0])) * y->size + most(y->c[0]) * x->size / far);
    return y->c[0].lo > 0.0 ? n * pow(least(x->c[0]), n - 1.0) * x->size : n * pow(far, -n - 1.0) * x->size;
}

/* The rounding errors of z = f(x, y) that follow from those of x and y, to a small factor and first order. A large
 * number within a formula does not hide the remaining digits: all digits of 1 / (1 + exp(500)) are valid. For an
 * interval these are the least errors. Nothing therefore counts as rounding before the interval is short. */
static double size_of(const kt_jet *z, kt_operator code, const kt_jet *x, const kt_jet *y) {
    const double value = most(z->c[0]);
    switch (code) {
    case KT_OPERATOR_NEGATE:
    case KT_OPERATOR_ABS:
        return x->size;
    case KT_OPERATOR_MULTIPLY:
        return least(x->c[0]) * y->size + least(y->c[0]) * x->size;
    case KT_OPERATOR_DIVIDE:
        return (x->size + least(z->c[0]) * y->size) / most(y->c[0]);
    case KT_OPERATOR_POWER:
        return size_of_power(z, x, y);
    case KT_OPERATOR_EXP:
    case KT_OPERATOR_COSH:
        return least(z->c[0]) * (1.0 + x->size);
    case KT_OPERATOR_SQRT:
        return x->size / value;
    case KT_OPERATOR_LOG:
        return larger(least(z->c[0]), x->size / most(x->c[0]));
    default:
        return larger(larger(x->size, y->size), isfinite(value) ? value : 0.0);
    }
}

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

/* Whether a function is constant, to rounding, over all arguments. *value receives the constant. The arguments need not
 * be numbers, as those of tanh(exp(1000 t)). */
static bool is_saturated(kt_operator code, kt_between x, double *value) {
    static const double tanh_is_one = 20.0, exp_is_zero = -746.0, atan_is_right = 1e17;
    const double least = x.lo > 0.0 ? x.lo : x.hi < 0.0 ? -x.hi : 0.0;
    *value = code == KT_OPERATOR_TANH ? tanh(x.lo) : code == KT_OPERATOR_ATAN ? atan(x.lo) : 0.0;
    return (code == KT_OPERATOR_TANH && least > tanh_is_one) || (code == KT_OPERATOR_ATAN && least > atan_is_right) ||
           (code == KT_OPERATOR_EXP && x.hi < exp_is_zero);
}

static kt_jet jet_of(kt_operator code, const kt_jet *x, const kt_jet *y, kt_jet_meet *meet, void *user) {
    kt_jet s, c;
    switch (code) {
    case KT_OPERATOR_NEGATE:
        return jet_minus(x);
    case KT_OPERATOR_ADD:
        return jet_sum(x, y);
    case KT_OPERATOR_SUBTRACT:
        return jet_difference(x, y);
    case KT_OPERATOR_MULTIPLY:
        return jet_product(x, y);
    case KT_OPERATOR_DIVIDE:
        return jet_quotient(x, y);
    case KT_OPERATOR_POWER:
        return jet_power(x, y);
    case KT_OPERATOR_SIN:
    case KT_OPERATOR_COS:
        jet_sincos(x, &s, &c);
        return code == KT_OPERATOR_SIN ? s : c;
    case KT_OPERATOR_TAN:
        return jet_tan(x);
    case KT_OPERATOR_ASIN:
        return jet_asin(x);
    case KT_OPERATOR_ACOS:
        return jet_acos(x);
    case KT_OPERATOR_ATAN:
        return jet_atan(x);
    case KT_OPERATOR_ATAN2:
        return jet_atan2(x, y);
    case KT_OPERATOR_SINH:
        return jet_hyperbolic(x, -1.0);
    case KT_OPERATOR_COSH:
        return jet_hyperbolic(x, 1.0);
    case KT_OPERATOR_TANH:
        return jet_tanh(x);
    case KT_OPERATOR_EXP:
        return jet_exp(x);
    case KT_OPERATOR_LOG:
        return jet_log(x);
    case KT_OPERATOR_SQRT:
        return jet_sqrt(x);
    case KT_OPERATOR_HYPOT:
        return jet_hypot(x, y);
    default:
        return jet_switch(code, x, y, meet, user);
    }
}

/* z = f(x, y), with its definedness. */
static kt_jet jet_operate(kt_operator code, const kt_jet *x, const kt_jet *y, kt_jet_meet *meet, void *user) {
    const kt_definedness defined = definedness_of(code, x, y);
    kt_jet z = jet_of(code, x, y, meet, user);
    double value;
    if (is_saturated(code, x->c[0], &value))
        z = code == KT_OPERATOR_EXP ? constant((kt_between){0.0, DBL_TRUE_MIN}) : number(value);
    else if (is_constant(x) && is_constant(y))
        z = constant(z.c[0]); /* also where f' is infinite, as that of sqrt(0) */
    z.size = size_of(&z, code, x, y);
    z.size = isfinite(z.size) ? z.size : 0.0;
    z.defined = defined;
    return z;
}

kt_jet kt_expression_bound(const kt_expression *expression, double from, double to, kt_jet_meet *meet, void *user) {
    const kt_jet time = {.c = {{from, to}, {1.0, 1.0}}, .size = larger(fabs(from), fabs(to))};
    kt_jet stack[KT_EXPRESSION_DEPTH_MAX];
    int top = -1;
    stack[0] = number(0.0);
    for (size_t i = 0; i < expression->count; i++) {
        const kt_expression_term *term = &expression->term[i];
        const kt_operator code = (kt_operator)term->code;
        if (code == KT_OPERATOR_NUMBER) {
            stack[++top] = number(term->number);
            stack[top].size = fabs(term->number);
        } else if (code == KT_OPERATOR_SYMBOL) {
            stack[++top] = time;
        } else {
            const int two = kt_operator_is_binary(code);
            top -= two;
            stack[top] = jet_operate(code, &stack[top], &stack[top + two], meet, user);
        }
    }
    return stack[0];
}
