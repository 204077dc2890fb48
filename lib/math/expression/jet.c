/* Bounds of a formula over an interval of time: each operation combines the Taylor coefficients of its arguments
 * (taylor.h) and decides where its value is defined, which branches are possible, and how large rounding errors are.
 *
 * The jet records whether a value may be NaN. NaN does not affect the bounds, since a comparison with NaN yields a
 * number again.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "expression/jet.h"

#include "expression/lookup.h"
#include "expression/taylor.h"

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
        return defined_by_values(KT_OPERATOR_ADD, x, interval_negate(y));
    case KT_OPERATOR_MULTIPLY:
        return unless((interval_holds(x, 0.0) && interval_holds_infinity(y)) ||
                      (interval_holds_infinity(x) && interval_holds(y, 0.0)));
    case KT_OPERATOR_DIVIDE:
        return unless((interval_holds(x, 0.0) && interval_holds(y, 0.0)) ||
                      (interval_holds_infinity(x) && interval_holds_infinity(y)));
    case KT_OPERATOR_SIN:
    case KT_OPERATOR_COS:
    case KT_OPERATOR_TAN:
        return unless(interval_holds_infinity(x));
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
        if (jet_is_whole(y))
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

/* The smallest jet that contains both jets. Coefficients are intervals. */
static kt_jet jet_hull(const kt_jet *x, const kt_jet *y) {
    kt_jet z = {.size = 0.0};
    for (int k = 0; k <= KT_JET_ORDER; k++)
        z.c[k] = interval_hull(x->c[k], y->c[k]);
    z.has_ratio = x->has_ratio && y->has_ratio;
    for (int k = 0; k <= KT_JET_ORDER; k++)
        z.ratio[k] = interval_hull(x->ratio[k], y->ratio[k]);
    return z;
}

/* Returns x if the decision is above 0, y if the decision is below 0, and the hull of both otherwise. */
static kt_jet chosen(const kt_jet *decision, const kt_jet *x, const kt_jet *y) {
    return decision->c[0].lo > 0.0 ? *x : decision->c[0].hi < 0.0 ? *y : jet_hull(x, y);
}

/* The value of step and of comparisons (0 or 1), or of sign. The value is defined even if the decision is not: all
 * comparisons are false then. */
static kt_jet jet_jump(kt_operator code, const kt_jet *decision) {
    const kt_jet below = jet_number(code == KT_OPERATOR_SIGN ? -1.0 : 0.0), above = jet_number(1.0);
    const bool unequal = code == KT_OPERATOR_NOT_EQUAL;
    if (decision->defined == KT_DEFINED_NOWHERE)
        return jet_number(unequal ? 1.0 : 0.0);
    if (decision->defined == KT_DEFINED_IN_PART || unequal || code == KT_OPERATOR_EQUAL)
        return jet_hull(&below, &above);
    if (code == KT_OPERATOR_LESS || code == KT_OPERATOR_LESS_EQUAL)
        return chosen(decision, &below, &above);
    return chosen(decision, &above, &below);
}

/* abs, min, max and functions that jump. The sign of `decision` selects a branch. If the interval of `decision`
 * contains 0, the result contains both branches. `meet` receives each decision. */
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
        const kt_jet right = jet_number(y->c[0].lo > 0.0 ? 1.57079632679489661923 : -1.57079632679489661923);
        return jet_sum(&right, &angle);
    }
    if (x->c[0].hi < 0.0) { /* the slopes are those of atan(y / x); the value jumps where y changes its sign */
        const kt_jet ratio = jet_quotient(y, x);
        kt_jet angle = jet_atan(&ratio);
        angle.c[0] = turn;
        return angle;
    }
    return (kt_jet){.c = {turn, interval_unbounded, interval_unbounded, interval_unbounded, interval_unbounded}};
}

/* sqrt(x^2 + y^2). The product of an interval with itself may reach below 0, but a square does not. */
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
    const double n = fabs(y->c[0].lo), far = interval_most(x->c[0]);
    if (!jet_is_whole(y))
        return interval_least(z->c[0]) *
               (1.0 + interval_most(interval_log(x->c[0])) * y->size + interval_most(y->c[0]) * x->size / far);
    return y->c[0].lo > 0.0 ? n * pow(interval_least(x->c[0]), n - 1.0) * x->size : n * pow(far, -n - 1.0) * x->size;
}

/* The rounding errors of z = f(x, y) that follow from the rounding errors of x and y, to first order and up to a small
 * factor. A large number within a formula does not hide the remaining digits: all digits of 1 / (1 + exp(500)) are
 * valid. For an interval these are the least errors. Nothing therefore counts as rounding before the interval is
 * short. */
static double rounding_size_of(const kt_jet *z, kt_operator code, const kt_jet *x, const kt_jet *y) {
    const double value = interval_most(z->c[0]);
    switch (code) {
    case KT_OPERATOR_NEGATE:
    case KT_OPERATOR_ABS:
        return x->size;
    case KT_OPERATOR_MULTIPLY:
        return interval_least(x->c[0]) * y->size + interval_least(y->c[0]) * x->size;
    case KT_OPERATOR_DIVIDE:
        return (x->size + interval_least(z->c[0]) * y->size) / interval_most(y->c[0]);
    case KT_OPERATOR_POWER:
        return size_of_power(z, x, y);
    case KT_OPERATOR_EXP:
    case KT_OPERATOR_COSH:
        return interval_least(z->c[0]) * (1.0 + x->size);
    case KT_OPERATOR_SQRT:
        return x->size / value;
    case KT_OPERATOR_LOG:
        return larger(interval_least(z->c[0]), x->size / interval_most(x->c[0]));
    default:
        return larger(larger(x->size, y->size), isfinite(value) ? value : 0.0);
    }
}

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

/* Whether a function is constant, to rounding, over all arguments. *value receives the constant. The argument may
 * overflow, as in tanh(exp(1000 t)). */
static bool is_saturated(kt_operator code, kt_between x, double *value) {
    static const double tanh_is_one = 20.0, exp_is_zero = -746.0, atan_is_right = 1e17;
    const double least = x.lo > 0.0 ? x.lo : x.hi < 0.0 ? -x.hi : 0.0;
    *value = code == KT_OPERATOR_TANH ? tanh(x.lo) : code == KT_OPERATOR_ATAN ? atan(x.lo) : 0.0;
    return (code == KT_OPERATOR_TANH && least > tanh_is_one) || (code == KT_OPERATOR_ATAN && least > atan_is_right) ||
           (code == KT_OPERATOR_EXP && x.hi < exp_is_zero);
}

/* Bounds of an operator's result. `meet` receives the decisions of operators that are not smooth (jet_switch). */
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

/* ---- tables ------------------------------------------------------------------------------------------------------ */

/* The polynomial of a piece, for inputs within its bounds. */
static kt_jet jet_of_piece(const kt_lookup_piece *p, const kt_jet *x, const kt_jet *y) {
    kt_jet c[4], s = *x, r = *y;
    for (int k = 0; k < 4; k++)
        c[k] = jet_number(p->c[k]);
    s.c[0] = interval_add(interval_within(x->c[0], p->low[0], p->high[0]), (kt_between){-p->at[0], -p->at[0]});
    r.c[0] = interval_add(interval_within(y->c[0], p->low[1], p->high[1]), (kt_between){-p->at[1], -p->at[1]});
    s.has_ratio = r.has_ratio = false;
    kt_jet z = jet_product(&c[3], &s);
    z = jet_sum(&c[2], &z);
    z = jet_product(&z, p->inputs == 2 ? &r : &s);
    if (p->inputs == 2) {
        const kt_jet first = jet_product(&c[1], &s), sum = jet_sum(&c[0], &first);
        return jet_sum(&sum, &z);
    }
    z = jet_sum(&c[1], &z);
    z = jet_product(&z, &s);
    return jet_sum(&c[0], &z);
}

/* An interval that many pieces cover is halved, since the decision on the piece has no bounds. */
static kt_jet jet_of_many_pieces(kt_jet_meet *meet, void *user) {
    kt_jet any = jet_constant(interval_unbounded);
    for (int k = 1; k <= KT_JET_ORDER; k++)
        any.c[k] = interval_unbounded;
    if (meet != NULL)
        meet(user, &any);
    any.defined = KT_DEFINED_IN_PART;
    return any;
}

/* A table has a polynomial for each piece between two rows (and columns). The inputs are intervals, which may cover
 * several pieces. */
enum { MET_PIECES = 16 }; /* the most pieces that are followed one by one */
typedef struct met_pieces {
    kt_jet z;             /* the hull of the values of the pieces so far */
    int count, undefined; /* pieces; pieces outside of the table, where it has no value */
    kt_jet_meet *meet;    /* receives decisions: differences that change their sign between two pieces */
    void *user;
} met_pieces;

/* The decision at a row: x - x_k changes its sign there. Returns the first input behind the row. */
static double pass_row(const met_pieces *met, const kt_jet *input, double row) {
    const kt_jet at = jet_number(row), decision = jet_difference(input, &at);
    if (met->meet != NULL)
        met->meet(met->user, &decision);
    return nextafter(row, HUGE_VAL);
}

/* Adds the pieces at the value `at` of the first input x, for all values of the second input y. Returns the largest x
 * of these pieces, or infinity if there are too many pieces. */
static double add_pieces(met_pieces *met, const double *table, double at, const kt_jet *x, const kt_jet *y) {
    double on = y->c[0].lo;
    for (;;) {
        const kt_lookup_piece p = kt_lookup_piece_at(table, at, on);
        met->undefined += isnan(p.c[0]);
        if (++met->count > MET_PIECES)
            return HUGE_VAL;
        if (!isnan(p.c[0])) {
            const kt_jet here = jet_of_piece(&p, x, y);
            met->z = met->count - met->undefined == 1 ? here : jet_hull(&met->z, &here);
        }
        if (p.inputs == 1 || p.high[1] >= y->c[0].hi)
            return p.high[0];
        on = pass_row(met, y, p.high[1]);
    }
}

/* z = table(x) or table(x, y) on intervals: the hull of the values of all pieces that the intervals cover. */
static kt_jet jet_lookup(const kt_expression_term *term, const kt_jet *x, const kt_jet *y, kt_jet_meet *meet,
                         void *user) {
    const double *table = kt_lookup_of(term);
    met_pieces met = {.z = jet_number(0.0), .meet = meet, .user = user};
    if (table == NULL || !isfinite(x->c[0].lo + x->c[0].hi + y->c[0].lo + y->c[0].hi))
        return jet_of_many_pieces(meet, user);
    double high = add_pieces(&met, table, x->c[0].lo, x, y);
    while (high < x->c[0].hi)
        high = add_pieces(&met, table, pass_row(&met, x, high), x, y);
    if (met.count > MET_PIECES)
        return jet_of_many_pieces(meet, user);
    met.z.defined = met.undefined == 0           ? KT_DEFINED
                    : met.undefined == met.count ? KT_DEFINED_NOWHERE
                                                 : KT_DEFINED_IN_PART;
    return met.z;
}

/* z = f(x, y), with its definedness. */
static kt_jet jet_operate(const kt_expression_term *term, const kt_jet *x, const kt_jet *y, kt_jet_meet *meet,
                          void *user) {
    const kt_operator code = (kt_operator)term->code;
    const bool is_lookup = kt_operator_is_lookup(code);
    kt_jet z = is_lookup ? jet_lookup(term, x, y, meet, user) : jet_of(code, x, y, meet, user);
    const kt_definedness defined = worse(is_lookup ? z.defined : KT_DEFINED, definedness_of(code, x, y));
    double value;
    if (is_saturated(code, x->c[0], &value))
        z = code == KT_OPERATOR_EXP ? jet_constant((kt_between){0.0, DBL_TRUE_MIN}) : jet_number(value);
    else if (jet_is_constant(x) && jet_is_constant(y))
        z = jet_constant(z.c[0]); /* also where f' is infinite, as that of sqrt(0) */
    z.size = rounding_size_of(&z, code, x, y);
    z.size = isfinite(z.size) ? z.size : 0.0;
    z.defined = defined;
    return z;
}

kt_jet kt_expression_bound(const kt_expression *expression, double from, double to, kt_jet_meet *meet, void *user) {
    const kt_jet time = {.c = {{from, to}, {1.0, 1.0}}, .size = larger(fabs(from), fabs(to))};
    kt_jet stack[KT_EXPRESSION_DEPTH_MAX];
    stack[0] = jet_number(0.0);
    for (kt_postfix w = kt_postfix_begin(expression); kt_postfix_next(&w);)
        if (w.code == KT_OPERATOR_NUMBER) {
            stack[w.at] = jet_number(w.term->number);
            stack[w.at].size = fabs(w.term->number);
        } else if (w.is_leaf) {
            stack[w.at] = time;
        } else {
            stack[w.at] = jet_operate(w.term, &stack[w.at], &stack[w.other], meet, user);
        }
    return stack[0];
}
