/* Vectors of four numbers, and square matrices by rows of four such vectors: a small system of equations. For one state
 * a vector is four lanes. For several states (real3.h) it is an array of numbers.
 *
 * The argument n is the number of components in use. For one state all four are computed. For several states the
 * functions compute the first n. Callers pass a constant n in loops that must be fast.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ALGEBRA_REAL4_H
#define KT_ALGEBRA_REAL4_H

#include "algebra/real.h"
#include "algebra/real3.h"

#include <assert.h>

#ifndef KT_LANES
typedef kt_v4 kt_real4;
#else
typedef struct kt_real4 {
    kt_real1 of[4];
} kt_real4;
#endif

/* ---- vectors ----------------------------------------------------------------------------------------------------- */

#ifndef KT_LANES

KT_OPERATOR kt_real4 kt_zero4(void) { return kt_v4_splat(0.0); }
KT_OPERATOR double kt_part4(kt_real4 a, int k) { return a[k]; }
KT_OPERATOR void kt_set_part4(kt_real4 *a, int k, double x) { (*a)[k] = x; }
KT_OPERATOR kt_real4 kt_add4(int n, kt_real4 a, kt_real4 b) { return (void)n, a + b; }
KT_OPERATOR kt_real4 kt_sub4(int n, kt_real4 a, kt_real4 b) { return (void)n, a - b; }
KT_OPERATOR kt_real4 kt_scale4(int n, double s, kt_real4 a) { return (void)n, kt_v4_splat(s) * a; }
KT_OPERATOR kt_real4 kt_add_scaled4(int n, kt_real4 a, double s, kt_real4 b) { return (void)n, a + kt_v4_splat(s) * b; }
KT_OPERATOR kt_real4 kt_sub_scaled4(int n, kt_real4 a, double s, kt_real4 b) { return (void)n, a - kt_v4_splat(s) * b; }
KT_OPERATOR kt_real4 kt_minus4(int n, kt_real4 a) { return (void)n, -a; }
KT_OPERATOR kt_real4 kt_over4(int n, kt_real4 a, double s) { return (void)n, a / kt_v4_splat(s); }
KT_OPERATOR kt_real4 kt_choose4(int n, bool c, kt_real4 a, kt_real4 b) { return (void)n, c ? a : b; }
KT_OPERATOR void kt_store4(int n, kt_real4 a, kt_real4 *to) { (void)n, *to = a; }
KT_OPERATOR int32_t kt_choose_index(bool condition, int32_t a, int32_t b) { return condition ? a : b; }

/* Returns a . b over all lanes. Lanes that are not in use are zeros of either sign. */
KT_INLINE double kt_dot4(int n, kt_real4 a, kt_real4 b) {
    const kt_v4 x = a * b;
    (void)n;
    return ((x[0] + x[1]) + (x[2] + x[3])) + 0.0;
}

#else

KT_OPERATOR kt_real4 kt_zero4(void) { return (kt_real4){.of = {{0.0}}}; }
KT_OPERATOR kt_real1 kt_part4(kt_real4 a, int k) { return a.of[k]; }
KT_OPERATOR void kt_set_part4(kt_real4 *a, int k, kt_real1 x) { a->of[k] = x; }
#define KT_EACH4(declaration, operation)                                                                               \
    KT_OPERATOR declaration {                                                                                          \
        for (int k = 0; k < n; k++)                                                                                    \
            operation;                                                                                                 \
        return a;                                                                                                      \
    }
KT_EACH4(kt_real4 kt_minus4(int n, kt_real4 a), a.of[k] = -a.of[k])
KT_EACH4(kt_real4 kt_add4(int n, kt_real4 a, kt_real4 b), a.of[k] += b.of[k])
KT_EACH4(kt_real4 kt_sub4(int n, kt_real4 a, kt_real4 b), a.of[k] -= b.of[k])
KT_EACH4(kt_real4 kt_scale4(int n, kt_real1 s, kt_real4 a), a.of[k] *= s)
KT_EACH4(kt_real4 kt_add_scaled4(int n, kt_real4 a, kt_real1 s, kt_real4 b), a.of[k] += s * b.of[k])
KT_EACH4(kt_real4 kt_sub_scaled4(int n, kt_real4 a, kt_real1 s, kt_real4 b), a.of[k] -= s * b.of[k])
KT_EACH4(kt_real4 kt_over4(int n, kt_real4 a, kt_real1 s), a.of[k] /= s)
KT_EACH4(kt_real4 kt_choose4(int n, kt_condition c, kt_real4 a, kt_real4 b), a.of[k] = kt_choose(c, a.of[k], b.of[k]))
#undef KT_EACH4
KT_OPERATOR void kt_store4(int n, kt_real4 a, kt_real4 *to) {
    for (int k = 0; k < n; k++)
        to->of[k] = a.of[k];
}
KT_OPERATOR kt_index1 kt_choose_index(kt_condition condition, int32_t a, kt_index1 b) {
    return (condition & a) | (~condition & b);
}

/* Sums in the order of one state, (x0 + x1) + (x2 + x3), so that each state has the same bits. The final + 0.0 makes a
 * zero of either sign positive. */
KT_INLINE kt_real1 kt_dot4(int n, kt_real4 a, kt_real4 b) {
    kt_real1 sum = a.of[0] * b.of[0];
    if (n > 1)
        sum += a.of[1] * b.of[1];
    if (n == 3)
        sum += a.of[2] * b.of[2];
    if (n > 3)
        sum += a.of[2] * b.of[2] + a.of[3] * b.of[3];
    return sum + 0.0;
}

#endif

/* ---- square matrices --------------------------------------------------------------------------------------------- */

/* Adds weight u u' to square; for several states only the elements on and above the diagonal. */
KT_INLINE void kt_square4_add(int n, kt_real4 u, kt_real1 weight, kt_real4 *square) {
    for (int r = 0; r < n; r++) {
#ifndef KT_LANES
        square[r] += kt_v4_splat(u[r] * weight) * u;
#else
        for (int c = r; c < n; c++)
            square[r].of[c] += (u.of[r] * weight) * u.of[c];
#endif
    }
}

/* Sets the entries that kt_square4_add, with a weight of 1, leaves out. */
KT_INLINE void kt_square4_mirror(kt_real4 *square) {
#ifdef KT_LANES
    for (int r = 1; r < 4; r++)
        for (int c = 0; c < r; c++)
            square[r].of[c] = square[c].of[r];
#else
    (void)square;
#endif
}

/* x' G y */
static __attribute__((unused)) kt_real1 kt_square4_product(const kt_real4 *g, kt_real4 x, kt_real4 y) {
    kt_real4 sum = kt_zero4();
    for (int r = 0; r < 4; r++)
        sum = kt_add_scaled4(4, sum, kt_part4(x, r), g[r]);
    return kt_dot4(4, sum, y);
}

/* Solves A x = b of k equations by Cholesky's method; A is overwritten. Returns false if A is not positive definite. */
static __attribute__((unused)) kt_condition kt_square4_solve(kt_real4 *a, int k, kt_real4 *b) {
    assert(k >= 0 && k <= 4);
    kt_condition positive = kt_condition_true();
    for (int j = 0; j < k; j++) {
        for (int i = 0; i < j; i++)
            a[j] = kt_sub_scaled4(4, a[j], kt_part4(a[i], j), a[i]);
        const kt_real1 pivot = kt_part4(a[j], j);
        if (kt_fails(&positive, (pivot > 0.0) & kt_is_finite1(pivot)))
            return kt_condition_false();
        a[j] = kt_over4(4, a[j], kt_sqrt1(pivot)); /* row j of L' */
        kt_real1 sum = kt_part4(*b, j);
        for (int i = 0; i < j; i++)
            sum -= kt_part4(a[i], j) * kt_part4(*b, i);
        kt_set_part4(b, j, sum / kt_part4(a[j], j));
    }
    for (int j = k - 1; j >= 0; j--) {
        kt_real1 sum = kt_part4(*b, j);
        for (int i = j + 1; i < k; i++)
            sum -= kt_part4(a[j], i) * kt_part4(*b, i);
        kt_set_part4(b, j, sum / kt_part4(a[j], j));
    }
    return positive;
}

/* Computes vectors c with c_i' G c_j = (i == j) by the method of Gram and Schmidt, from the unit vectors `begin` to
 * `end`, after the vectors before them. The longest remainder comes first. A remainder counts as zero if it is shorter
 * than the share `small` of its unit vector, or than the share `tolerance` of the longest so far. *first is the squared
 * length of the longest remainder. Returns the length of the last remainder, or 0 if one is zero. */
static __attribute__((unused)) kt_real1 kt_square4_orthonormalise(const kt_real4 *g, int begin, int end, double small,
                                                                  double tolerance, kt_real4 *c, kt_real1 *first) {
    assert(begin >= 0 && begin < end && end <= 4);
    assert(small > 0.0 && small < 1.0 && tolerance >= 0.0);
    const kt_real1 zero = kt_real1_splat(0.0);
    kt_condition taken[4], clear = kt_condition_true();
    kt_real1 last = zero;
    for (int j = begin; j < end; j++)
        taken[j] = kt_condition_false();
    for (int n = begin; n < end; n++) {
        kt_real1 most = zero, own = zero;
        kt_index1 best = kt_index1_of(-1);
        kt_real4 column = kt_zero4();
        for (int j = begin; j < end; j++) {
            kt_real4 e = kt_zero4();
            if (!kt_is_anywhere(kt_not(taken[j])))
                continue;
            kt_set_part4(&e, j, kt_real1_splat(1.0));
            for (int i = 0; i < n; i++)
                e = kt_sub_scaled4(4, e, kt_square4_product(g, c[i], e), c[i]);
            const kt_real1 length = kt_square4_product(g, e, e);
            const kt_condition longer = (length > most) & kt_not(taken[j]);
            most = KT_CHOOSE(longer, length, most);
            own = KT_CHOOSE(longer, kt_part4(g[j], j), own);
            best = kt_choose_index(longer, j, best);
            column = kt_choose4(4, longer, e, column);
        }
        *first = kt_most1(*first, most);
        if (kt_fails(&clear, (most > small * small * own) & (most > tolerance * tolerance * *first)))
            return zero;
        last = kt_sqrt1(most);
        for (int j = begin; j < end; j++)
            taken[j] |= best == j;
        c[n] = kt_over4(4, column, last);
    }
    return KT_CHOOSE(clear, last, zero);
}

#endif
