/* Sobol's sequence (1967), by Gray code (Antonov, Saleev 1979), with the direction numbers of Joe and Kuo (2008,
 * SIAM Journal on Scientific Computing 30, 2635-2654; their table new-joe-kuo-6), which also stratify pairs of
 * coordinates well.
 *
 * Coordinate j belongs to a primitive polynomial x^s + a_1 x^(s-1) + ... + 1 over the field of two elements and
 * odd numbers m_1, ..., m_s, which go on by
 *
 *     m_k = 2 a_1 m_(k-1) ^ 4 a_2 m_(k-2) ^ ... ^ 2^(s-1) a_(s-1) m_(k-s+1) ^ 2^s m_(k-s) ^ m_(k-s)
 *
 * and x_n = sum of m_k / 2^k over the bits of the Gray code of n. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sweep/sweep.h"

enum { BITS = 52, DEGREE_MAX = 6 };

/* Degree s, the bits a_1 ... a_(s-1), and m_1 ... m_s. The first coordinate is van der Corput's. */
static const struct {
    int degree;
    unsigned a;
    uint64_t m[DEGREE_MAX];
} directions[KT_SOBOL_AXES] = {
    {0, 0, {0}},
    {1, 0, {1}},
    {2, 1, {1, 3}},
    {3, 1, {1, 3, 1}},
    {3, 2, {1, 1, 1}},
    {4, 1, {1, 1, 3, 3}},
    {4, 4, {1, 3, 5, 13}},
    {5, 2, {1, 1, 5, 5, 17}},
    {5, 4, {1, 1, 5, 5, 5}},
    {5, 7, {1, 1, 7, 11, 19}},
    {5, 11, {1, 1, 5, 1, 1}},
    {5, 13, {1, 1, 1, 3, 11}},
    {5, 14, {1, 3, 5, 5, 31}},
    {6, 1, {1, 3, 3, 9, 7, 49}},
    {6, 13, {1, 1, 1, 15, 21, 21}},
    {6, 16, {1, 3, 1, 13, 27, 49}},
};

/* m_1 ... m_BITS of a coordinate. */
static void list_numbers(int axis, uint64_t m[BITS]) {
    const int s = directions[axis].degree;
    for (int k = 0; k < BITS; k++) {
        if (s == 0 || k < s) {
            m[k] = s == 0 ? 1 : directions[axis].m[k];
            continue;
        }
        m[k] = m[k - s] ^ (m[k - s] << s);
        for (int i = 1; i < s; i++)
            if ((directions[axis].a >> (s - 1 - i) & 1U) != 0)
                m[k] ^= m[k - i] << i;
    }
}

double kt_sobol(int axis, uint64_t index) {
    uint64_t m[BITS] = {0}, gray = index ^ (index >> 1), x = 0;
    list_numbers(axis, m);
    for (int k = 0; k < BITS; k++)
        if ((gray >> k & 1U) != 0)
            x ^= m[k] << (BITS - 1 - k);
    return (double)x / (double)(UINT64_C(1) << BITS);
}
