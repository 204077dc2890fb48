/* With a, s, k the series of theta, sin, cos: n s_n = sum j a_j k_n-j, n k_n = -sum j a_j s_n-j,
 * (n + 1) (n + 2) a_n+2 = c s_n. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "upright.h"

#include <math.h>

enum { ORDER = 30 };

static void series_step(kt_upright *m, long double h) {
    long double a[ORDER + 1] = {m->theta, m->rate}, s[ORDER] = {sinl(m->theta)}, k[ORDER] = {cosl(m->theta)};
    for (int n = 0; n + 2 <= ORDER; n++) {
        for (int j = 1; j <= n; j++) {
            s[n] += (long double)j * a[j] * k[n - j] / (long double)n;
            k[n] -= (long double)j * a[j] * s[n - j] / (long double)n;
        }
        a[n + 2] = m->c * s[n] / (long double)((n + 1) * (n + 2));
    }
    m->theta = m->rate = 0.0L;
    for (int n = ORDER; n >= 0; n--) {
        m->theta = m->theta * h + a[n];
        if (n > 0)
            m->rate = m->rate * h + (long double)n * a[n];
    }
    m->t += h;
}

void kt_upright_move(kt_upright *m, long double t) {
    while (fabsl(t - m->t) > 0.0L)
        series_step(m, fmaxl(fminl(t - m->t, 0.02L), -0.02L));
}

double kt_upright_windows(int windows) { return 1.5 * 9.81 * (3.0 * windows + 1.0) / (4.0 * windows + 1.0); }
