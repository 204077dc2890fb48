/* SPDX-License-Identifier: Apache-2.0 */
#include "reference.h"

#include <math.h>

typedef kt_reference_number number;
typedef kt_reference_matrix matrix;

static matrix identity(void) {
    matrix a = {{{1.0L, 0.0L, 0.0L}, {0.0L, 1.0L, 0.0L}, {0.0L, 0.0L, 1.0L}}};
    return a;
}

static matrix skew(const number *u, number factor) {
    const number x = factor * u[0], y = factor * u[1], z = factor * u[2];
    matrix a = {{{0.0L, -z, y}, {z, 0.0L, -x}, {-y, x, 0.0L}}};
    return a;
}

static matrix add(matrix a, number factor, matrix b) {
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            a.m[i][j] += factor * b.m[i][j];
    return a;
}

static matrix transpose(matrix a) {
    matrix t;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            t.m[i][j] = a.m[j][i];
    return t;
}

matrix kt_reference_multiply(matrix a, matrix b) {
    matrix c;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            c.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j];
    return c;
}

/* ---- the rotations ----------------------------------------------------------------------------------------------- */

static matrix elementary(int axis, number angle) {
    const int next = (axis + 1) % 3, last = (axis + 2) % 3;
    matrix a = identity();
    a.m[next][next] = a.m[last][last] = ccosl(angle);
    a.m[last][next] = csinl(angle);
    a.m[next][last] = -csinl(angle);
    return a;
}

matrix kt_reference_euler(int sequence, const number *p) {
    const matrix first = elementary(sequence / 100 - 1, p[0]);
    const matrix second = elementary(sequence / 10 % 10 - 1, p[1]);
    return kt_reference_multiply(kt_reference_multiply(first, second), elementary(sequence % 10 - 1, p[2]));
}

/* sum A^n / n! for A = theta x / 2^k with |A| < 1/2, squared k times. Twenty terms leave 1e-25. */
matrix kt_reference_exponential(int sequence, const number *p) {
    (void)sequence;
    long double factor = 1.0L;
    int squarings = 0;
    while (factor * (fabsl(creall(p[0])) + fabsl(creall(p[1])) + fabsl(creall(p[2]))) > 0.5L) {
        factor *= 0.5L;
        squarings++;
    }
    const matrix a = skew(p, factor);
    matrix term = identity(), sum = identity();
    for (int n = 1; n <= 20; n++) {
        term = add((matrix){{{0}}}, 1.0L / n, kt_reference_multiply(term, a));
        sum = add(sum, 1.0L, term);
    }
    while (squarings-- > 0)
        sum = kt_reference_multiply(sum, sum);
    return sum;
}

/* (I - S)^-1 by its adjugate, whose rows are the cross products of columns. */
static matrix cayley(const number *p) {
    const matrix s = skew(p, 0.5L), a = add(identity(), -1.0L, s);
    matrix inverse;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int r1 = (j + 1) % 3, r2 = (j + 2) % 3, c1 = (i + 1) % 3, c2 = (i + 2) % 3;
            inverse.m[i][j] = a.m[r1][c1] * a.m[r2][c2] - a.m[r1][c2] * a.m[r2][c1];
        }
    const number determinant = a.m[0][0] * inverse.m[0][0] + a.m[0][1] * inverse.m[1][0] + a.m[0][2] * inverse.m[2][0];
    const matrix product = kt_reference_multiply(inverse, add(identity(), 1.0L, s));
    return add((matrix){{{0}}}, 1.0L / determinant, product);
}

/* The Cayley transform loses |g|^2 LDBL_EPSILON. */
matrix kt_reference_cgr(int sequence, const number *p) {
    const number size = csqrtl(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    if (creall(size) < 10.0L)
        return cayley(p);
    const number factor = 2.0L * catanl(0.5L * size) / size, theta[3] = {factor * p[0], factor * p[1], factor * p[2]};
    return kt_reference_exponential(sequence, theta);
}

/* From the table of i, j, k: i j = k and so on. */
static void hamilton(const number *a, const number *b, number *c) {
    static const int unit[4][4] = {{0, 1, 2, 3}, {1, 0, 3, 2}, {2, 3, 0, 1}, {3, 2, 1, 0}};
    static const int sign[4][4] = {{1, 1, 1, 1}, {1, -1, 1, -1}, {1, -1, -1, 1}, {1, 1, -1, -1}};
    for (int i = 0; i < 4; i++)
        c[i] = 0.0L;
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            c[unit[i][j]] += (long double)sign[i][j] * a[i] * b[j];
}

matrix kt_reference_sandwich(int sequence, const number *p) {
    (void)sequence;
    const number n2 = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3];
    const number inverse[4] = {p[0] / n2, -p[1] / n2, -p[2] / n2, -p[3] / n2};
    matrix r;
    for (int j = 0; j < 3; j++) {
        number e[4] = {0.0L}, half[4], turned[4];
        e[j + 1] = 1.0L;
        hamilton(p, e, half);
        hamilton(half, inverse, turned);
        for (int i = 0; i < 3; i++)
            r.m[i][j] = turned[i + 1];
    }
    return r;
}

matrix kt_reference_axis_angle(int sequence, const number *p) {
    const number theta[3] = {p[3] * p[0], p[3] * p[1], p[3] * p[2]};
    return kt_reference_exponential(sequence, theta);
}

/* ---- values and derivatives -------------------------------------------------------------------------------------- */

matrix kt_reference_real(kt_reference_rotation *rotation, int sequence, const double *p, int count) {
    number z[4] = {0.0L};
    for (int k = 0; k < count; k++)
        z[k] = (long double)p[k];
    return rotation(sequence, z);
}

void kt_reference_map(kt_reference_rotation *rotation, int sequence, const double *p, int count, bool body,
                      long double map[3][4]) {
    const long double h = 1e-30L;
    const matrix r = kt_reference_real(rotation, sequence, p, count);
    for (int k = 0; k < count; k++) {
        number z[4] = {0.0L};
        for (int i = 0; i < count; i++)
            z[i] = (long double)p[i];
        z[k] += h * (number)I;
        const matrix turned = rotation(sequence, z);
        matrix rate;
        for (int i = 0; i < 9; i++)
            rate.m[i / 3][i % 3] = cimagl(turned.m[i / 3][i % 3]) / h;
        const matrix w = body ? kt_reference_multiply(transpose(r), rate) : kt_reference_multiply(rate, transpose(r));
        for (int i = 0; i < 3; i++)
            map[i][k] = 0.5L * creall(w.m[(i + 2) % 3][(i + 1) % 3] - w.m[(i + 1) % 3][(i + 2) % 3]);
    }
}

kt_mat3 kt_reference_rounded(matrix a) {
    kt_vec3 columns[3];
    for (int j = 0; j < 3; j++)
        columns[j] = kt_vec3_make((double)creall(a.m[0][j]), (double)creall(a.m[1][j]), (double)creall(a.m[2][j]));
    return (kt_mat3){columns[0], columns[1], columns[2]};
}

double kt_reference_difference(kt_mat3 a, matrix b) {
    long double worst = 0.0L;
    for (int i = 0; i < 9; i++) {
        const long double off = fabsl((long double)kt_reference_entry(a, i / 3, i % 3) - creall(b.m[i / 3][i % 3]));
        if (!(off <= worst) && !isnan(worst)) /* NaN is worst and stays */
            worst = off;
    }
    return (double)worst;
}

/* ---- helpers ----------------------------------------------------------------------------------------------------- */

kt_vec3 kt_reference_column(kt_mat3 a, int i) { return i == 0 ? a.x : i == 1 ? a.y : a.z; }

double kt_reference_component(kt_vec3 a, int i) { return i == 0 ? a.x : i == 1 ? a.y : a.z; }

double kt_reference_entry(kt_mat3 a, int row, int col) {
    return kt_reference_component(kt_reference_column(a, col), row);
}

double kt_reference_largest(kt_mat3 a) {
    double worst = 0.0;
    for (int i = 0; i < 9; i++) {
        const double entry = fabs(kt_reference_entry(a, i / 3, i % 3));
        if (!(entry <= worst) && !isnan(worst))
            worst = entry;
    }
    return worst;
}

double kt_reference_distance(kt_mat3 a, kt_mat3 b) {
    return kt_reference_largest(kt_mat3_add(a, kt_mat3_scale(-1.0, b)));
}

double kt_reference_skewness(kt_mat3 a) {
    return kt_reference_distance(kt_mat3_multiply(kt_mat3_transpose(a), a), kt_mat3_identity());
}

kt_vec3 kt_reference_direction(kt_random *random, double length) {
    double u[3];
    kt_random_direction(random, 3, u);
    return kt_vec3_make(length * u[0], length * u[1], length * u[2]);
}

kt_mat3 kt_reference_random(kt_random *random) {
    double q[4];
    kt_random_direction(random, 4, q);
    return kt_reference_rounded(kt_reference_real(kt_reference_sandwich, 0, q, 4));
}

double kt_reference_magnitude(kt_random *random, double lowest_power, double highest_power) {
    return pow(10.0, kt_random_uniform(random, lowest_power, highest_power));
}
