/* Times at which formulas of time have breakpoints or features. Steps end at these times, so that no step misses a
 * feature.
 *
 * A breakpoint is a time at which an operation that is not smooth changes its branch. The sign of the decision changes
 * at this time: x of abs(x), x - y of min(x, y) and of comparisons. Between two breakpoints a step may still leap over
 * a feature, as a pulse exp(-((t - 5) / 0.01)^2) between two of its stages. Steps therefore also end if f', f'' or f'''
 * changes its sign. Between two such times f, f' and f'' are monotone. Every method samples their values at the ends of
 * a step, which then show whether anything happens between.
 *
 * Breakpoints and features are zeros of a function g along time. The zeros are found with exclusion and bisection
 * (Moore, Kearfott and Cloud 2009, chapter 8). In an interval, g has no zero if 0 is outside its bounds (jet.h), and at
 * most one if 0 is outside the bounds of g'. Other intervals are halved, the earlier half first. Intervals in a part of
 * which g is not defined are halved, too. In such intervals the branch may change without a zero, as in sqrt(t - 1) < 3
 * at t = 1. A very short interval that remains holds a zero without a change of sign, as of (t - 1)^2, or two that
 * cancel.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "expression/formula_breakpoint.h"
#include "expression/lookup.h"

#include <float.h>
#include <math.h>
#include <stdint.h>

/* A search for breakpoints, or else for changes of derivatives. */
typedef struct search {
    const kt_expression *expression;
    bool breakpoints;
    double after;  /* the time after which changes are sought; a change at that time is excluded */
    double length; /* of the interval that is halved */
    int effort;    /* intervals that this search may still evaluate */
    int64_t *left; /* operations that all searches may still take */
} search;

/* The bounds of the formula from `from` to `to`. */
static kt_jet bound(search *s, double from, double to, kt_jet_meet *meet, void *user) {
    *s->left -= (int64_t)s->expression->count;
    return kt_expression_bound(s->expression, from, to, meet, user);
}

static bool search_is_cut(const search *s) { return s->effort <= 0; }

/* ---- one interval ------------------------------------------------------------------------------------------------ */

/* The number of zeros of a function: none; at most one, with signs that rounding hides; at most one; any number. */
typedef enum finding { NOTHING, HIDDEN, ONCE, UNKNOWN } finding;

static bool holds_zero(kt_between x) { return !(x.lo > 0.0 || x.hi < 0.0); }

static bool is_within_bound(kt_between x, double bound) { return x.lo >= -bound && x.hi <= bound; }

/* The finding for g with the derivative `slope`. A function that is 0 to within `nothing` throughout has no change of
 * sign. */
static finding classify_change(kt_between g, kt_between slope, double nothing) {
    if (!holds_zero(g) || is_within_bound(g, nothing))
        return NOTHING;
    return holds_zero(slope) ? UNKNOWN : ONCE;
}

/* kt_jet_meet: raises *worst to the finding for a decision. A decision that is defined nowhere is NaN throughout, and
 * has one branch. */
static void meet_decision(void *user, const kt_jet *decision) {
    finding *worst = user;
    const finding here = decision->defined == KT_DEFINED ? classify_change(decision->c[0], decision->c[1], 0.0)
                         : decision->defined == KT_DEFINED_NOWHERE ? NOTHING
                                                                   : UNKNOWN;
    if (here > *worst)
        *worst = here;
}

/* Classifies the zeros in an interval. A derivative counts as zero if it changes the value over the whole halved
 * interval by no more than rounding errors. In a short enough part every derivative is that small. */
static finding bound_on(search *s, double from, double to) {
    static const double rounding = 1e-13, nothing_at_all = 1e-60; /* in any unit of a machine */
    finding worst = NOTHING;
    s->effort--;
    const kt_jet jet = bound(s, from, to, s->breakpoints ? meet_decision : NULL, &worst);
    double nothing = rounding * jet.size + nothing_at_all, whole = nothing;
    if (s->breakpoints || jet.defined == KT_DEFINED_NOWHERE)
        return worst;
    for (int k = 1; k < KT_JET_ORDER; k++) {
        nothing /= to - from;
        whole /= s->length;
        finding here = classify_change(jet.c[k], jet.c[k + 1], nothing);
        if (here == NOTHING && holds_zero(jet.c[k]) && !is_within_bound(jet.c[k], whole))
            here = HIDDEN;
        worst = here > worst ? here : worst;
    }
    return worst;
}

/* ---- one time ---------------------------------------------------------------------------------------------------- */

/* All branches at a time, or the signs of the derivatives, as a number that changes with each branch or sign. */
static uint64_t signature_of(search *s, double t) {
    if (s->breakpoints)
        return kt_expression_branches(s->expression, &t);
    const kt_jet jet = bound(s, t, t, NULL, NULL);
    uint64_t signs = 0;
    for (int k = 1; k < KT_JET_ORDER; k++)
        signs = signs << 1U | (uint64_t)(jet.c[k].lo + jet.c[k].hi > 0.0);
    return signs;
}

/* Whether a derivative has another sign at `to`, in spite of rounding. */
static bool changes_sign(search *s, double from, double to) {
    const kt_jet a = bound(s, from, from, NULL, NULL), b = bound(s, to, to, NULL, NULL);
    for (int k = 1; k < KT_JET_ORDER; k++)
        if ((a.c[k].lo > 0.0 && b.c[k].hi < 0.0) || (a.c[k].hi < 0.0 && b.c[k].lo > 0.0))
            return true;
    return false;
}

/* The first time at which the signature differs from the signature at `from`. At `to` the signature differs.
 * Breakpoints are found to the last bit: the branch follows from the rounded values of the formula. */
static double change_between(search *s, double from, double to) {
    const uint64_t before = signature_of(s, from);
    const double enough = s->breakpoints ? 0.0 : 1e-9 * (to - from);
    while (to - from > enough) {
        const double middle = from + 0.5 * (to - from);
        if (!(middle > from) || !(middle < to))
            break;
        if (signature_of(s, middle) != before)
            to = middle;
        else
            from = middle;
    }
    return to;
}

/* ---- many intervals ---------------------------------------------------------------------------------------------- */

/* A search is cut after EFFORT intervals, or after a share 1 / SEARCHES of the operations that remain for all searches.
 * Therefore operations remain for other searches. After a cut, the search continues at a time t + t / CUTS_PER_TIME. If
 * every search of a run is cut, CUTS_PER_TIME cuts occur for each factor e of the duration. */
enum { DEPTH = 30, EFFORT = 4000, SEARCHES = 32, CUTS_PER_TIME = 16 };

static int effort_of(const search *s) {
    const int64_t most = *s->left / ((int64_t)s->expression->count * SEARCHES);
    return most < EFFORT ? (int)most : EFFORT;
}

/* The first change in (from, to]; HUGE_VAL: none. *clear is the time up to which no change is possible. */
static double first_change(search *s, double from, double to, double *clear) {
    double end[DEPTH + 1] = {to}, begin = from;
    int depth = 0;
    *clear = from;
    s->length = to - from;
    while (depth >= 0) {
        const double last = end[depth], middle = begin + 0.5 * (last - begin);
        const finding found = bound_on(s, begin, last);
        const bool divisible = depth < DEPTH && middle > begin && middle < last;
        if (found == UNKNOWN && divisible && !search_is_cut(s)) {
            end[++depth] = middle;
            continue;
        }
        if (found == UNKNOWN && search_is_cut(s))
            return HUGE_VAL;
        const double first = begin > s->after ? begin : fmin(nextafter(begin, HUGE_VAL), last);
        const bool sought = found == HIDDEN ? changes_sign(s, first, last) : found != NOTHING;
        if (sought && signature_of(s, first) != signature_of(s, last))
            return change_between(s, first, last);
        *clear = begin = last;
        depth--;
    }
    return HUGE_VAL;
}

/* The first change after t and up to `limit`, in intervals that grow while there is none. If the effort does not
 * suffice, *known is false, and the search is cut at the time returned. */
static double seek_change(search *s, double t, double limit, bool *known) {
    static const double first_length = 1.0 / 1024.0;
    double from = t, length = fmax(first_length, 1e-9 * fabs(t)), clear = t;
    s->after = t;
    s->effort = effort_of(s);
    *known = true;
    while (from < limit) {
        const double to = fmin(from + length, limit);
        const double change = search_is_cut(s) ? HUGE_VAL : first_change(s, from, to, &clear);
        if (change < HUGE_VAL)
            return change;
        if (search_is_cut(s)) {
            *known = false;
            return fmax(clear, t + fmax(length, fabs(t) / CUTS_PER_TIME));
        }
        from = to;
        length *= 2.0;
    }
    return HUGE_VAL;
}

static const double horizon = 1e12; /* s: no run is as long */

/* The lowest derivative that may jump at a row of a table: the slope of lines, or the second derivative. */
static int jump_of_table(const double *table) {
    const bool is_smooth = table != NULL && table[KT_LOOKUP_INTERPOLATION] != KT_INTERPOLATION_LINEAR &&
                           table[KT_LOOKUP_OUTSIDE] != KT_OUTSIDE_HOLD;
    return is_smooth ? 2 : 1;
}

/* The lowest derivative that may jump at a change of branch; 3: there are no branches. */
static int jump_of(const kt_expression *expression) {
    int order = 3;
    for (size_t i = 0; i < expression->count; i++) {
        const kt_operator code = (kt_operator)expression->term[i].code;
        if (code == KT_OPERATOR_ABS || code == KT_OPERATOR_MIN || code == KT_OPERATOR_MAX)
            order = order > 1 ? 1 : order;
        else if (code == KT_OPERATOR_SIGN || code == KT_OPERATOR_STEP ||
                 (code >= KT_OPERATOR_LESS && code <= KT_OPERATOR_NOT_EQUAL))
            order = 0;
        else if (kt_operator_is_lookup(code) && jump_of_table(kt_lookup_of(&expression->term[i])) < order)
            order = jump_of_table(kt_lookup_of(&expression->term[i]));
    }
    return order;
}

/* The first breakpoint after t. Times next to 0 are not distinguished from 0. Changes within rounding of each
 * other are one breakpoint. The slope of abs(t - 1/2) + t/4 changes its sign at 1/2, and abs takes its other branch one
 * unit of rounding later. */
static double first_breakpoint_after(const kt_expression *expression, double t, double until, int64_t *left,
                                     int *order) {
    static const double same = 64.0 * DBL_EPSILON;
    search s = {.expression = expression, .breakpoints = true};
    bool known;
    s.left = left;
    const int jump = jump_of(expression);
    double next = jump < 3 ? seek_change(&s, t, until, &known) : HUGE_VAL;
    if (next < HUGE_VAL)
        *order = known ? jump : KT_BREAKPOINT_CUT;
    s.breakpoints = false;
    const double feature = seek_change(&s, t, fmin(next, until), &known);
    if (feature < next && next - feature > same * fabs(feature))
        *order = known ? 4 : KT_BREAKPOINT_CUT;
    return fmin(feature, next);
}

double kt_expression_next_breakpoint(const kt_expression *expression, double t, double until, int64_t *left,
                                     int *order) {
    static const double nearest = 1e-30; /* s: from 0 */
    *order = 4;
    if (!(fabs(t) < horizon) || kt_expression_symbols(expression, 0, NULL) == 0)
        return HUGE_VAL;
    const double next =
        first_breakpoint_after(expression, t >= 0.0 ? fmax(t, nearest) : t, fmin(until, horizon), left, order);
    return fabs(next) <= nearest ? 0.0 : next;
}

double kt_expression_speed(const kt_expression *expression, double t) {
    const kt_between slope = kt_expression_bound(expression, t, t, NULL, NULL).c[1];
    const double size = fmax(fabs(slope.lo), fabs(slope.hi)), rounding = (slope.hi - slope.lo) / (4.0 * DBL_EPSILON);
    return isfinite(rounding) ? fmax(size, rounding) : size;
}
