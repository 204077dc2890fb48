/* Alart and Curnier's function of the cone solver, its residual, and semismooth Newton steps for its zero (cone.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/cone_parts.h"

#include "kinetree/algebra.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static const double exact = 1e-14;
enum { HALVINGS = 5, WORSE_MOST = 5 };

/* The damping is this part of the residual, within bounds. The least one is small against pivots that are not lost. */
static const double damping = 0.3, damping_least = 1e-8, damping_most = 1e-2;

/* ---- the function ------------------------------------------------------------------------------------------------ */

/* The mode of an item decides which of its rows are unknown: given normal impulse, closed without friction, sticking or
 * slipping. The last two modes have the least normal impulse. */
typedef enum cone_mode { HELD, SMOOTH, STICKS, SLIPS, LEAST_STICKS, LEAST_SLIPS } cone_mode;

static bool is_known(cone_mode mode, int row) {
    return mode == HELD || (mode == SMOOTH && row > 0) || (mode >= LEAST_STICKS && row == 0);
}

/* u = W x + b. Only the blocks of W that are not zero take part. */
static void find_rates(const kt_cone *cone, const kt_cone_linear *of, const double *x, double *u) {
    const int m = 3 * cone->n;
    for (int r = 0; r < m; r++) {
        double sum = of->b[r];
        for (int k = cone->first[r / 3]; k < cone->first[r / 3 + 1]; k++) {
            const double *W = of->W + r * m + 3 * cone->block[k], *y = x + 3 * cone->block[k];
            sum += W[0] * y[0] + W[1] * y[1] + W[2] * y[2];
        }
        u[r] = sum;
    }
}

/* Computes f and the mode of an item without a cone: dry friction, or a contact without friction. */
static void find_plain(kt_cone *cone, int i, const double *x, const double *u, double *f) {
    const double z = x[3 * i] - u[3 * i], limit = cone->limit[i], least = cone->least[i];
    const double low = limit >= 0.0 ? -limit : least, high = limit >= 0.0 ? limit : (double)INFINITY;
    cone->mode[i] = z > low && z < high ? SMOOTH : HELD;
    cone->target[i] = z > low ? high : low;
    f[3 * i] = cone->mode[i] == SMOOTH ? u[3 * i] : x[3 * i] - cone->target[i];
    f[3 * i + 1] = x[3 * i + 1];
    f[3 * i + 2] = x[3 * i + 2];
}

/* Computes f, the rates and the modes at x; returns the square of f. */
static double find_function(kt_cone *cone, const double *x, const double *u, double *f) {
    double sum = 0.0;
    for (int i = 0; i < cone->n; i++) {
        const double *xi = x + 3 * i, *ui = u + 3 * i, l = cone->least[i];
        if (cone->limit[i] >= 0.0 || !(cone->mu[i] > 0.0)) {
            find_plain(cone, i, x, u, f);
        } else {
            const double w = xi[0] - l - ui[0], R = cone->mu[i] * (l + fmax(0.0, w));
            const double z1 = xi[1] - ui[1], z2 = xi[2] - ui[2], z = kt_hypot(z1, z2), part = z > R ? R / z : 1.0;
            const bool slips = z > R;
            cone->mode[i] = w > 0.0 ? (slips ? SLIPS : STICKS) : R > 0.0 ? (slips ? LEAST_SLIPS : LEAST_STICKS) : HELD;
            cone->target[i] = l;
            f[3 * i] = xi[0] - l - fmax(0.0, w);
            f[3 * i + 1] = xi[1] - part * z1;
            f[3 * i + 2] = xi[2] - part * z2;
        }
        for (int k = 0; k < 3; k++)
            sum += f[3 * i + k] * f[3 * i + k];
    }
    return sum;
}

double kt_cone_residual(kt_cone *cone, const kt_cone_linear *of, const double *x) {
    assert(cone->n == 0 || (x != cone->u && x != cone->f)); /* arrays without numbers may coincide */
    double most = 0.0, impulse = 0.0, rate = 0.0;
    find_rates(cone, of, x, cone->u);
    (void)find_function(cone, x, cone->u, cone->f);
    for (int r = 0; r < 3 * cone->n; r++) {
        if (!isfinite(x[r]) || !isfinite(cone->u[r]) || !isfinite(cone->f[r])) /* fmax leaves NaN out */
            return (double)INFINITY;
        most = fmax(most, fabs(cone->f[r]));
        impulse = fmax(impulse, fabs(x[r]));
        rate = fmax(rate, fabs(of->b[r]));
    }
    const bool is_bounded = cone->gain > 0.0 && rate > 0.0;
    const double size = fmax(rate, is_bounded ? fmin(impulse, cone->gain * rate) : impulse);
    return most > 0.0 ? most / size : 0.0;
}

/* ---- linear equations -------------------------------------------------------------------------------------------- */

/* Exchanges the rows a and b of A (n x n), from column `from` on, and the entries a and b of x. */
static void swap_rows(int n, double *A, double *x, int a, int b, int from) {
    for (int j = from; j < n && a != b; j++) {
        const double t = A[a * n + j];
        A[a * n + j] = A[b * n + j];
        A[b * n + j] = t;
    }
    const double t = x[a];
    x[a] = x[b];
    x[b] = t;
}

/* Contacts share bodies with a few others, most of them nearby: row k is zero behind `end`. */
static int end_of_row(int n, const double *A, int k) {
    int end = n;
    while (end > k + 1 && A[k * n + end - 1] == 0.0)
        end--;
    return end;
}

/* Subtracts a multiple of a row from another row. Compilers make vectors of this loop, since the rows differ. */
static void subtract_row(int n, double factor, const double *restrict from, double *restrict to) {
    for (int j = 0; j < n; j++)
        to[j] -= factor * from[j];
}

/* Returns the row below with the largest entry in the next column. */
static int eliminate_below(int n, double *A, double *x, int k) {
    const int next = k + 1, end = end_of_row(n, A, k);
    const double over = 1.0 / A[k * n + k];
    double most = -1.0;
    int largest = next;
    for (int i = next; i < n; i++) {
        const double factor = A[i * n + k] * over;
        if (factor != 0.0)
            subtract_row(end - next, factor, A + k * n + next, A + i * n + next);
        x[i] -= factor * x[k];
        if (next < n && fabs(A[i * n + next]) > most) {
            most = fabs(A[i * n + next]);
            largest = i;
        }
    }
    return largest;
}

/* The largest magnitude of n numbers, in four independent maxima, which a processor computes at the same time. */
static double largest_entry(int n, const double *x) {
    double a = 0.0, b = 0.0, c = 0.0, d = 0.0;
    int i = 0;
    for (; i + 4 <= n; i += 4) {
        a = fabs(x[i]) > a ? fabs(x[i]) : a;
        b = fabs(x[i + 1]) > b ? fabs(x[i + 1]) : b;
        c = fabs(x[i + 2]) > c ? fabs(x[i + 2]) : c;
        d = fabs(x[i + 3]) > d ? fabs(x[i + 3]) : d;
    }
    for (; i < n; i++)
        a = fabs(x[i]) > a ? fabs(x[i]) : a;
    return fmax(fmax(a, b), fmax(c, d));
}

/* x_i of R x = y, row i. */
static double substitute_row(int n, const double *A, const double *x, int i) {
    const int end = end_of_row(n, A, i);
    double sum[2] = {0.0, 0.0};
    int j = i + 1;
    for (; j + 1 < end; j += 2) {
        sum[0] += A[i * n + j] * x[j];
        sum[1] += A[i * n + j + 1] * x[j + 1];
    }
    if (j < end)
        sum[0] += A[i * n + j] * x[j];
    return (x[i] - (sum[0] + sum[1])) / A[i * n + i];
}

bool kt_cone_eliminate(int n, double *A, double *x) {
    assert(n >= 0 && (A != x || n == 0));
    const double least = 1e-11 * largest_entry(n * n, A);
    int r = 0;
    for (int i = 1; i < n; i++)
        r = fabs(A[i * n]) > fabs(A[r * n]) ? i : r;
    for (int k = 0; k < n; k++) {
        if (!(fabs(A[r * n + k]) > least))
            return false;
        swap_rows(n, A, x, k, r, k);
        r = eliminate_below(n, A, x, k);
    }
    for (int i = n - 1; i >= 0; i--)
        x[i] = substitute_row(n, A, x, i);
    return true;
}

void kt_cone_eliminate_completely(kt_cone *cone, int n, double *x) {
    assert(n >= 0 && n <= 3 * cone->most);
    double *A = cone->A, *z = cone->part;
    int rank = 0, *order = cone->order;
    double first = 0.0;
    for (int i = 0; i < n; i++)
        order[i] = i;
    for (; rank < n; rank++) {
        int r = rank, c = rank;
        double pivot = 0.0;
        for (int i = rank; i < n; i++) {
            const double own = largest_entry(n - rank, A + i * n + rank);
            r = own > pivot ? i : r;
            pivot = own > pivot ? own : pivot;
        }
        while (c < n - 1 && fabs(A[r * n + c]) < pivot)
            c++;
        first = rank == 0 ? pivot : first;
        if (!(pivot > 1e-11 * first))
            break;
        swap_rows(n, A, x, rank, r, rank);
        for (int i = 0; i < n && c != rank; i++) {
            const double t = A[i * n + rank];
            A[i * n + rank] = A[i * n + c];
            A[i * n + c] = t;
        }
        const int t = order[rank];
        order[rank] = order[c];
        order[c] = t;
        (void)eliminate_below(n, A, x, rank);
    }
    for (int i = rank - 1; i >= 0; i--) {
        double sum = x[i];
        for (int j = i + 1; j < rank; j++)
            sum -= A[i * n + j] * z[j];
        z[i] = sum / A[i * n + i];
    }
    memset(x, 0, (size_t)n * sizeof *x);
    for (int i = 0; i < rank; i++)
        x[order[i]] = z[i];
}

/* ---- Newton ------------------------------------------------------------------------------------------------------ */

/* Row (i, c) of the derivative: coefficients of this contact's du and dx; returns the right-hand side. */
static double linearise(const kt_cone *cone, int i, int c, const double *x, double du[3], double dx[3]) {
    const double *ui = cone->u + 3 * i, *xi = x + 3 * i, l = cone->least[i], mu = cone->mu[i];
    memset(du, 0, 3 * sizeof *du);
    memset(dx, 0, 3 * sizeof *dx);
    if (c == 0 || cone->mode[i] == STICKS || cone->mode[i] == LEAST_STICKS) {
        du[c] = 1.0;
        return -ui[c];
    }
    /* f_t = x_t - R e;  dR = mu (dx_n - du_n),  de = (1 - e e') (dx_t - du_t) / z */
    const double R = mu * (l + fmax(0.0, xi[0] - l - ui[0])), z1 = xi[1] - ui[1], z2 = xi[2] - ui[2];
    const double z = kt_hypot(z1, z2), e[2] = {z1 / z, z2 / z};
    if (cone->mode[i] == SLIPS) {
        dx[0] = -mu * e[c - 1];
        du[0] = mu * e[c - 1];
    }
    dx[c] = 1.0;
    for (int d = 0; d < 2; d++) {
        const double g = R / z * ((d == c - 1 ? 1.0 : 0.0) - e[c - 1] * e[d]);
        dx[1 + d] -= g;
        du[1 + d] += g;
    }
    return -cone->f[3 * i + c];
}

/* Adds the terms of W in one row of the linear system: the terms of unknowns to A, all others to *right. */
static void add_rates(const kt_cone *cone, const kt_cone_linear *of, int row, double by, const double *dx, double *A,
                      double *right) {
    const double *W = of->W + row * 3 * cone->n;
    for (int k = cone->first[row / 3]; k < cone->first[row / 3 + 1]; k++)
        for (int c = 3 * cone->block[k]; c < 3 * cone->block[k] + 3; c++) {
            if (cone->slot[c] >= 0)
                A[cone->slot[c]] += by * W[c];
            else
                *right -= by * W[c] * dx[c];
        }
}

/* The linear system of a step with n unknowns. */
static void fill_step(kt_cone *cone, const kt_cone_linear *of, const double *x, double damp, const double *dx, int n) {
    memset(cone->A, 0, (size_t)(n * n) * sizeof *cone->A);
    for (int r = 0; r < n; r++) {
        const int row = cone->index[r], i = row / 3;
        double du[3], own[3], *A = cone->A + r * n;
        cone->right[r] = linearise(cone, i, row % 3, x, du, own);
        for (int d = 0; d < 3; d++) {
            const int slot = cone->slot[3 * i + d];
            if (du[d] != 0.0)
                add_rates(cone, of, 3 * i + d, du[d], dx, A, &cone->right[r]);
            if (slot >= 0)
                A[slot] += own[d] + damp * du[d];
            else
                cone->right[r] -= own[d] * dx[3 * i + d];
        }
    }
}

/* The step dx from x: given rows take their values at once. Requires rates, function and modes at x. */
static void find_step(kt_cone *cone, const kt_cone_linear *of, const double *x, double damp, double *dx) {
    int n = 0;
    for (int r = 0; r < 3 * cone->n; r++) {
        const bool known = is_known((cone_mode)cone->mode[r / 3], r % 3);
        dx[r] = !known ? 0.0 : r % 3 == 0 ? cone->target[r / 3] - x[r] : -x[r];
        cone->slot[r] = known ? -1 : n;
        if (!known)
            cone->index[n++] = r;
    }
    fill_step(cone, of, x, damp, dx, n);
    if (!kt_cone_eliminate(n, cone->A, cone->right)) {
        fill_step(cone, of, x, damp, dx, n);
        kt_cone_eliminate_completely(cone, n, cone->right);
    }
    for (int r = 0; r < n; r++)
        dx[cone->index[r]] = cone->right[r];
}

bool kt_cone_newton(kt_cone *cone, const kt_cone_linear *of, double *x, int most) {
    assert(cone->n <= cone->most && most >= 0);
    assert(cone->n == 0 ||
           (x != cone->best && x != cone->trial && x != cone->u && x != cone->f && x != cone->other && x != cone->dx));
    const int m = 3 * cone->n;
    double last = kt_cone_residual(cone, of, x), left = last;
    bool done = last <= exact;
    memcpy(cone->best, x, (size_t)m * sizeof *x);
    for (int k = 0, worse = 0; k < most && !done; k++) {
        double part = 1.0, now = 0.0;
        find_rates(cone, of, x, cone->u);
        const double merit = find_function(cone, x, cone->u, cone->f);
        find_step(cone, of, x, fmax(damping_least, fmin(damping * left, damping_most)), cone->dx);
        cone->newton++;
        for (int h = 0; h < HALVINGS; h++) {
            for (int i = 0; i < m; i++)
                cone->trial[i] = x[i] + part * cone->dx[i];
            find_rates(cone, of, cone->trial, cone->u);
            now = find_function(cone, cone->trial, cone->u, cone->other);
            if (now < (1.0 - 1e-4 * part) * merit)
                break;
            part *= 0.5;
        }
        worse += !(now < merit);
        if (worse > WORSE_MOST || !(now < 1e300))
            break;
        memcpy(x, cone->trial, (size_t)m * sizeof *x);
        left = kt_cone_residual(cone, of, x);
        if (left < last)
            memcpy(cone->best, x, (size_t)m * sizeof *x);
        last = fmin(last, left);
        done = left <= exact || (left <= cone->fine && k > 0 && !(now < 0.5 * merit));
    }
    memcpy(x, cone->best, (size_t)m * sizeof *x);
    return last <= cone->enough;
}
