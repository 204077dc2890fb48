/* Linear algebra of quadruple.h: elimination, least norms by reflections, singular values by Jacobi's method. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "quadruple.h"

#include <quadmath.h>
#include <string.h>

quad quad_sqrt(quad x) { return sqrtq(x); }
quad quad_abs(quad x) { return fabsq(x); }

quad quad_norm(int n, const quad *x) {
    quad s = 0;
    for (int i = 0; i < n; i++)
        s += x[i] * x[i];
    return sqrtq(s);
}

bool quad_eliminate(int n, quad *K, int stride, quad *x) {
    for (int k = 0; k < n; k++) {
        int best = k;
        for (int i = k + 1; i < n; i++)
            if (fabsq(K[i * stride + k]) > fabsq(K[best * stride + k]))
                best = i;
        if (!(fabsq(K[best * stride + k]) > 1e-29Q))
            return false;
        if (best != k) {
            for (int j = k; j < n; j++) {
                const quad t = K[k * stride + j];
                K[k * stride + j] = K[best * stride + j];
                K[best * stride + j] = t;
            }
            const quad t = x[k];
            x[k] = x[best];
            x[best] = t;
        }
        for (int i = k + 1; i < n; i++) {
            if (K[i * stride + k] == 0)
                continue;
            const quad f = K[i * stride + k] / K[k * stride + k];
            for (int j = k + 1; j < n; j++)
                K[i * stride + j] -= f * K[k * stride + j];
            x[i] -= f * x[k];
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        for (int j = k + 1; j < n; j++)
            x[k] -= K[k * stride + j] * x[j];
        x[k] /= K[k * stride + k];
    }
    return true;
}

/* Householder reflections of A' give x = Q R^-T b. */
bool quad_least(int rows, int columns, const quad *A, int stride, const quad *b, quad *x) {
    quad B[40][40], beta[40], y[40];
    if (rows > 40 || columns > 40 || rows > columns)
        return false;
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < columns; j++)
            B[i][j] = A[i * stride + j]; /* row i is column i of A' */
    for (int k = 0; k < rows; k++) {
        quad s = quad_norm(columns - k, &B[k][k]);
        if (!(s > 1e-28Q))
            return false;
        if (B[k][k] > 0)
            s = -s;
        quad v[40], vv = 0;
        for (int j = k; j < columns; j++)
            v[j] = B[k][j];
        v[k] -= s;
        for (int j = k; j < columns; j++)
            vv += v[j] * v[j];
        beta[k] = 2 / vv;
        for (int i = k + 1; i < rows; i++) {
            quad d = 0;
            for (int j = k; j < columns; j++)
                d += v[j] * B[i][j];
            for (int j = k; j < columns; j++)
                B[i][j] -= beta[k] * d * v[j];
        }
        B[k][k] = s; /* R's diagonal; the reflector is rebuilt from v below */
        for (int j = k + 1; j < columns; j++)
            B[k][j] = v[j];
        y[k] = v[k];
    }
    quad z[40] = {0};
    for (int i = 0; i < rows; i++) { /* R' z = b */
        quad t = b[i];
        for (int k = 0; k < i; k++)
            t -= B[i][k] * z[k];
        z[i] = t / B[i][i];
    }
    memset(x, 0, (size_t)columns * sizeof *x);
    memcpy(x, z, (size_t)rows * sizeof *x);
    for (int k = rows - 1; k >= 0; k--) {
        quad d = y[k] * x[k];
        for (int j = k + 1; j < columns; j++)
            d += B[k][j] * x[j];
        x[k] -= beta[k] * d * y[k];
        for (int j = k + 1; j < columns; j++)
            x[j] -= beta[k] * d * B[k][j];
    }
    return true;
}

/* One-sided Jacobi on the rows of A: rows become orthogonal, their norms are the singular values. */
void quad_singular(int rows, int columns, const quad *A, int stride, quad *least, quad *most, quad *left) {
    quad B[QUAD_ROWS][QUAD_NV], V[QUAD_ROWS][QUAD_ROWS];
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j < columns; j++)
            B[i][j] = A[i * stride + j];
        for (int j = 0; j < rows; j++)
            V[i][j] = i == j;
    }
    for (int sweep = 0; sweep < 12; sweep++)
        for (int p = 0; p < rows; p++)
            for (int o = p + 1; o < rows; o++) {
                quad a = 0, b = 0, c = 0;
                for (int j = 0; j < columns; j++)
                    a += B[p][j] * B[p][j], b += B[o][j] * B[o][j], c += B[p][j] * B[o][j];
                if (fabsq(c) <= 1e-36Q * sqrtq(a * b) || c == 0)
                    continue;
                const quad z = (b - a) / (2 * c), t = (z > 0 ? 1 : -1) / (fabsq(z) + sqrtq(1 + z * z));
                const quad cs = 1 / sqrtq(1 + t * t), sn = cs * t;
                for (int j = 0; j < columns; j++) {
                    const quad x = B[p][j], y = B[o][j];
                    B[p][j] = cs * x - sn * y, B[o][j] = sn * x + cs * y;
                }
                for (int j = 0; j < rows; j++) {
                    const quad x = V[p][j], y = V[o][j];
                    V[p][j] = cs * x - sn * y, V[o][j] = sn * x + cs * y;
                }
            }
    *least = *most = quad_norm(columns, B[0]);
    memcpy(left, V[0], (size_t)rows * sizeof *left);
    for (int i = 1; i < rows; i++) {
        const quad s = quad_norm(columns, B[i]);
        if (s < *least) {
            *least = s;
            memcpy(left, V[i], (size_t)rows * sizeof *left);
        }
        *most = s > *most ? s : *most;
    }
}
