/* Lookup tables of one input or two.
 *
 * One input. Between two rows, with h_k = x_{k+1} - x_k and s = x - x_k,
 *     y = y_k + s (b_k + s (c_k + s d_k))
 *
 * linear: b_k = (y_{k+1} - y_k) / h_k, c_k = d_k = 0.
 *
 * cubic: the natural spline (de Boor, A Practical Guide to Splines (1978), chapter IV), which is twice continuously
 * differentiable and has no curvature at its ends. With m_k = y''(x_k), m_0 = m_{n-1} = 0 and for 0 < k < n - 1
 *   h_{k-1} m_{k-1} + 2 (h_{k-1} + h_k) m_k + h_k m_{k+1} = 6 ((y_{k+1} - y_k) / h_k - (y_k - y_{k-1}) / h_{k-1})
 * (diagonally dominant: elimination needs no pivots), and from these
 *   b_k = (y_{k+1} - y_k) / h_k - h_k (2 m_k + m_{k+1}) / 6,  c_k = m_k / 2,  d_k = (m_{k+1} - m_k) / (6 h_k).
 * A table that repeats itself has the slope p at both ends for which m_0 = m_{n-1}. Both curvatures are linear in p.
 *
 * monotone: Hermite's cubic whose slopes p_k keep each piece within the range of its two rows. With the secants
 *   e_k = (y_{k+1} - y_k) / h_k,
 * p_k is 0 if e_{k-1} e_k <= 0. Otherwise p_k is the weighted harmonic mean (Brodlie 1980; Fritsch & Butland, SIAM
 * J. Sci. Stat. Comput. 5, 1984)
 *   p_k = (w1 + w2) / (w1 / e_{k-1} + w2 / e_k),  w1 = 2 h_k + h_{k-1},  w2 = h_k + 2 h_{k-1}.
 * At the first row (likewise at the last), p_0 is the slope of the parabola through three rows,
 *   p_0 = ((2 h_0 + h_1) e_0 - h_0 e_1) / (h_0 + h_1),
 * but 0 if its sign is not that of e_0, and 3 e_0 if e_1 has the other sign and |p_0| is larger. In a table that
 * repeats itself, the mean joins the last interval and the first one. Then
 *   b_k = p_k,  c_k = (3 e_k - 2 p_k - p_{k+1}) / h_k,  d_k = (p_k + p_{k+1} - 2 e_k) / h_k^2:
 * y' is continuous, and y'' jumps at rows.
 *
 * Two inputs, linear. In a cell of the grid, with s = x - x_i, r = y - y_j and the corners z_ij,
 *   z = z_ij + s (z_{i+1,j} - z_ij) / h + r (z_{i,j+1} - z_ij) / k
 *       + s r (z_ij - z_{i+1,j} - z_{i,j+1} + z_{i+1,j+1}) / (h k).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "expression/lookup.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- rows -------------------------------------------------------------------------------------------------------- */

/* (y_{k+1} - y_k) / h_k */
static double secant(const double *row) {
    return (row[KT_PIECE_SIZE + KT_PIECE_Y] - row[KT_PIECE_Y]) / (row[KT_PIECE_SIZE + KT_PIECE_X] - row[KT_PIECE_X]);
}

/* Stores m_k in each row's C, by elimination of the tridiagonal equations:
 *   forward   D = 2 (h_{k-1} + h_k) - h_{k-1} p_{k-1},  p_k = h_k / D,  g_k = (right-hand side - h_{k-1} g_{k-1}) / D
 *   backward  m_k = g_k - p_k m_{k+1}
 * The rows' B and C hold p and g. If slopes s and s' are given at the ends, their equations are
 *   2 h_0 m_0 + h_0 m_1 = 6 (e_0 - s),  h_{n-2} m_{n-2} + 2 h_{n-2} m_{n-1} = 6 (s' - e_{n-2}). */
static void spline_curvatures(const double *slopes, double *rows, int count) {
    rows[KT_PIECE_B] = rows[KT_PIECE_C] = 0.0;
    double *last = rows + (size_t)(count - 1) * KT_PIECE_SIZE;
    last[KT_PIECE_B] = last[KT_PIECE_C] = 0.0;
    if (slopes) {
        rows[KT_PIECE_B] = 0.5;
        rows[KT_PIECE_C] = 3.0 * (secant(rows) - slopes[0]) / (rows[KT_PIECE_SIZE + KT_PIECE_X] - rows[KT_PIECE_X]);
    }
    for (double *row = rows + KT_PIECE_SIZE; row < last; row += KT_PIECE_SIZE) {
        const double *before = row - KT_PIECE_SIZE, *next = row + KT_PIECE_SIZE;
        const double h0 = row[KT_PIECE_X] - before[KT_PIECE_X], h1 = next[KT_PIECE_X] - row[KT_PIECE_X];
        const double side =
            6.0 * ((next[KT_PIECE_Y] - row[KT_PIECE_Y]) / h1 - (row[KT_PIECE_Y] - before[KT_PIECE_Y]) / h0);
        const double pivot = 2.0 * (h0 + h1) - h0 * before[KT_PIECE_B];
        row[KT_PIECE_B] = h1 / pivot;
        row[KT_PIECE_C] = (side - h0 * before[KT_PIECE_C]) / pivot;
    }
    if (slopes) {
        const double *before = last - KT_PIECE_SIZE;
        const double h = last[KT_PIECE_X] - before[KT_PIECE_X], side = 6.0 * (slopes[1] - secant(before));
        last[KT_PIECE_C] = (side - h * before[KT_PIECE_C]) / (h * (2.0 - before[KT_PIECE_B]));
    }
    for (double *row = last - KT_PIECE_SIZE; row > rows; row -= KT_PIECE_SIZE)
        row[KT_PIECE_C] -= row[KT_PIECE_B] * row[KT_PIECE_SIZE + KT_PIECE_C];
    if (slopes)
        rows[KT_PIECE_C] -= 0.5 * rows[KT_PIECE_SIZE + KT_PIECE_C];
}

/* The slope p of a spline that repeats itself: m_0 - m_{n-1} is linear in p. Two trials of the size of the secants
 * yield p. */
static double joined_slope(double *rows, int count) {
    const double *last = rows + (size_t)(count - 1) * KT_PIECE_SIZE;
    double size = 0.0, jump[2];
    for (const double *row = rows; row < last; row += KT_PIECE_SIZE)
        size = fmax(size, fabs(secant(row)));
    if (size == 0.0)
        return 0.0;
    for (int i = 0; i < 2; i++) {
        const double p = i == 0 ? -size : size;
        spline_curvatures((const double[2]){p, p}, rows, count);
        jump[i] = rows[KT_PIECE_C] - last[KT_PIECE_C];
    }
    return -size * (jump[1] + jump[0]) / (jump[1] - jump[0]);
}

/* Finds the cubic spline through the rows. At the ends, the slopes are equal (joined), given, or left to
 * spline_curvatures. */
static void compile_spline(double *rows, int count, kt_row_ends ends, const double *slopes) {
    if (ends == KT_ROW_ENDS_JOINED) {
        const double p = joined_slope(rows, count);
        spline_curvatures((const double[2]){p, p}, rows, count);
    } else {
        spline_curvatures(ends == KT_ROW_ENDS_GIVEN ? slopes : NULL, rows, count);
    }
}

/* The slope p at an end, from the interval h0 at this end and its neighbour h1, with the secants e0 and e1. */
static double end_derivative(double h0, double h1, double e0, double e1) {
    const double p = ((2.0 * h0 + h1) * e0 - h0 * e1) / (h0 + h1);
    if (!((p > 0.0 && e0 > 0.0) || (p < 0.0 && e0 < 0.0)))
        return 0.0;
    const bool turns = (e0 > 0.0) != (e1 > 0.0);
    return turns && fabs(p) > 3.0 * fabs(e0) ? 3.0 * e0 : p;
}

/* The slope at the row between the pieces that begin at the rows `before` and `row`. */
static double mean_derivative(const double *before, const double *row) {
    const double h0 = before[KT_PIECE_SIZE + KT_PIECE_X] - before[KT_PIECE_X],
                 h1 = row[KT_PIECE_SIZE + KT_PIECE_X] - row[KT_PIECE_X];
    const double e0 = secant(before), e1 = secant(row), w1 = 2.0 * h1 + h0, w2 = h1 + 2.0 * h0;
    const bool turns = !((e0 > 0.0 && e1 > 0.0) || (e0 < 0.0 && e1 < 0.0));
    return turns ? 0.0 : (w1 + w2) / (w1 / e0 + w2 / e1);
}

/* Stores the slope p_k at each row in the row's B. */
static void monotone_derivatives(double *rows, int count, kt_row_ends ends) {
    double *last = rows + (size_t)(count - 1) * KT_PIECE_SIZE;
    for (double *row = rows + KT_PIECE_SIZE; row < last; row += KT_PIECE_SIZE)
        row[KT_PIECE_B] = mean_derivative(row - KT_PIECE_SIZE, row);
    const double *second = rows + KT_PIECE_SIZE, *before = last - KT_PIECE_SIZE;
    if (ends == KT_ROW_ENDS_JOINED) {
        rows[KT_PIECE_B] = last[KT_PIECE_B] = mean_derivative(before, rows);
    } else if (count == 2) {
        rows[KT_PIECE_B] = last[KT_PIECE_B] = secant(rows);
    } else {
        rows[KT_PIECE_B] =
            end_derivative(second[KT_PIECE_X] - rows[KT_PIECE_X],
                           second[KT_PIECE_SIZE + KT_PIECE_X] - second[KT_PIECE_X], secant(rows), secant(second));
        last[KT_PIECE_B] = end_derivative(last[KT_PIECE_X] - before[KT_PIECE_X],
                                          before[KT_PIECE_X] - (before - KT_PIECE_SIZE)[KT_PIECE_X], secant(before),
                                          secant(before - KT_PIECE_SIZE));
    }
}

/* Finds the cubic pieces y + b s + c s^2 + d s^3 with s = x - x_k, from the slopes b of monotone_derivatives at both
 * ends. h is the length of a piece, e its secant. */
static void compile_monotone(double *rows, int count, kt_row_ends ends) {
    monotone_derivatives(rows, count, ends);
    for (int k = 0; k + 1 < count; k++) {
        double *row = rows + (size_t)k * KT_PIECE_SIZE;
        const double h = row[KT_PIECE_SIZE + KT_PIECE_X] - row[KT_PIECE_X], e = secant(row);
        const double p0 = row[KT_PIECE_B], p1 = row[KT_PIECE_SIZE + KT_PIECE_B];
        row[KT_PIECE_C] = (3.0 * e - 2.0 * p0 - p1) / h;
        row[KT_PIECE_D] = (p0 + p1 - 2.0 * e) / (h * h);
    }
}

void kt_rows_compile(const double *points, int count, kt_interpolation interpolation, kt_row_ends ends,
                     const double *slopes, double *rows) {
    for (int k = 0; k < count; k++) {
        double *row = rows + (size_t)k * KT_PIECE_SIZE;
        row[KT_PIECE_X] = points[2 * k];
        row[KT_PIECE_Y] = points[2 * k + 1];
        row[KT_PIECE_B] = row[KT_PIECE_C] = row[KT_PIECE_D] = 0.0;
    }
    if (interpolation == KT_INTERPOLATION_MONOTONE) {
        compile_monotone(rows, count, ends);
        return;
    }
    if (interpolation == KT_INTERPOLATION_CUBIC)
        compile_spline(rows, count, ends, slopes);
    for (int k = 0; k + 1 < count; k++) {
        double *row = rows + (size_t)k * KT_PIECE_SIZE;
        const double *next = row + KT_PIECE_SIZE;
        const double h = next[KT_PIECE_X] - row[KT_PIECE_X];
        const double m0 = row[KT_PIECE_C], m1 = next[KT_PIECE_C]; /* curvatures; 0 if linear */
        row[KT_PIECE_B] = (next[KT_PIECE_Y] - row[KT_PIECE_Y]) / h - h * (2.0 * m0 + m1) / 6.0;
        row[KT_PIECE_C] = 0.5 * m0;
        row[KT_PIECE_D] = (m1 - m0) / (6.0 * h);
    }
}

/* The last of `count` numbers, `stride` apart, that is at most x, but no later than the last but one; a NaN ends
 * anywhere. */
static int find_interval(const double *numbers, int stride, int count, double x) {
    int low = 0, high = count - 1;
    while (high - low > 1) {
        const int middle = low + (high - low) / 2;
        if (x < numbers[(size_t)middle * (size_t)stride])
            high = middle;
        else
            low = middle;
    }
    return low;
}

int kt_rows_find(const double *rows, int count, double x) {
    return find_interval(rows + KT_PIECE_X, KT_PIECE_SIZE, count, x);
}

/* ---- compilation ------------------------------------------------------------------------------------------------- */

/* The number of different values of y: rows with the first x. */
static int count_y(const kt_lookup *lookup) {
    int count = 1;
    while (lookup->inputs == 2 && count < lookup->row_count && lookup->rows[3 * (size_t)count] == lookup->rows[0])
        count++;
    return count;
}

static size_t numbers_of(int inputs, int nx, int ny) {
    return KT_LOOKUP_HEAD +
           (inputs == 1 ? (size_t)nx * KT_PIECE_SIZE : (size_t)nx + (size_t)ny + (size_t)nx * (size_t)ny);
}

size_t kt_lookup_size(const double *table) {
    return numbers_of((int)table[KT_LOOKUP_INPUTS], (int)table[KT_LOOKUP_NX], (int)table[KT_LOOKUP_NY]);
}

size_t kt_lookup_numbers(const kt_lookup *lookup) {
    const int ny = count_y(lookup);
    return numbers_of(lookup->inputs, lookup->row_count / ny, ny);
}

/* Copies rows (x, y, z), which are sorted by x and then by y, to the axes x and y and to the grid z of nx times ny
 * numbers. */
static void compile_grid(const kt_lookup *lookup, int nx, int ny, double *x) {
    double *y = x + nx, *z = y + ny;
    for (int i = 0; i < nx; i++)
        x[i] = lookup->rows[3 * (size_t)i * (size_t)ny];
    for (int j = 0; j < ny; j++)
        y[j] = lookup->rows[3 * (size_t)j + 1];
    for (size_t k = 0; k < (size_t)nx * (size_t)ny; k++)
        z[k] = lookup->rows[3 * k + 2];
}

void kt_lookup_compile(const kt_lookup *lookup, double *numbers) {
    const int ny = count_y(lookup), nx = lookup->row_count / ny;
    numbers[KT_LOOKUP_INPUTS] = lookup->inputs;
    numbers[KT_LOOKUP_INTERPOLATION] = lookup->interpolation;
    numbers[KT_LOOKUP_OUTSIDE] = lookup->outside;
    numbers[KT_LOOKUP_NX] = nx;
    numbers[KT_LOOKUP_NY] = ny;
    if (lookup->inputs == 2)
        compile_grid(lookup, nx, ny, numbers + KT_LOOKUP_HEAD);
    else
        kt_rows_compile(lookup->rows, nx, lookup->interpolation,
                        lookup->outside == KT_OUTSIDE_REPEAT ? KT_ROW_ENDS_JOINED : KT_ROW_ENDS_FREE, NULL,
                        numbers + KT_LOOKUP_HEAD);
}

/* ---- checks ------------------------------------------------------------------------------------------------------ */

static const double least_step = 1e-50; /* with shorter steps, second derivatives would overflow */
static const double most = 1e100;       /* and with larger numbers */

/* Whether all numbers are finite and below `most`; otherwise writes the fault to `text`. */
static bool are_numbers_fine(const kt_lookup *lookup, char *text, size_t size) {
    const int width = lookup->inputs + 1;
    for (int k = 0; k < lookup->row_count * width; k++)
        if (!(fabs(lookup->rows[k]) <= most)) {
            (void)snprintf(text, size, "row %d has the number %g; numbers are finite, and 1e100 at most", k / width + 1,
                           lookup->rows[k]);
            return false;
        }
    return true;
}

/* Inputs increase; with two inputs, each x has the y of the first x. */
static bool are_inputs_ordered(const kt_lookup *lookup, char *text, size_t size) {
    const int width = lookup->inputs + 1, ny = count_y(lookup);
    for (int k = ny; k < lookup->row_count; k++) {
        const double *row = lookup->rows + (size_t)k * (size_t)width, *before = row - (size_t)ny * (size_t)width;
        if (k % ny == 0 ? row[0] - before[0] >= least_step : row[0] == row[-width])
            continue;
        (void)snprintf(text, size,
                       lookup->inputs == 1
                           ? "row %d has the input %.17g behind %.17g; inputs must increase"
                           : "row %d has x = %.17g behind %.17g; rows are in the order of x, and for each x in the "
                             "order of y",
                       k + 1, row[0], k % ny == 0 ? before[0] : row[-width]);
        return false;
    }
    for (int k = 0; k < lookup->row_count && lookup->inputs == 2; k++) {
        const double *row = lookup->rows + 3 * (size_t)k, first = lookup->rows[3 * (size_t)(k % ny) + 1];
        if (k < ny ? k == 0 || row[1] - row[-2] >= least_step : row[1] == first)
            continue;
        if (k < ny)
            (void)snprintf(text, size, "row %d has y = %.17g behind %.17g; y must increase", k + 1, row[1], row[-2]);
        else
            (void)snprintf(text, size, "row %d has y = %.17g, and the first x has %.17g there; each x needs the same y",
                           k + 1, row[1], first);
        return false;
    }
    return true;
}

bool kt_lookup_check(const kt_lookup *lookup, char *text, size_t size) {
    const char *fault = NULL;
    const int ny = lookup->inputs == 2 && lookup->rows && lookup->row_count > 0 ? count_y(lookup) : 1;
    if (lookup->inputs != 1 && lookup->inputs != 2)
        fault = "a table has one input or two";
    else if ((unsigned)lookup->interpolation > KT_INTERPOLATION_MONOTONE)
        fault = "interpolation is linear, cubic or monotone";
    else if ((unsigned)lookup->outside > KT_OUTSIDE_REPEAT)
        fault = "outside is reject, hold, extend or repeat";
    else if (lookup->inputs == 2 && lookup->interpolation != KT_INTERPOLATION_LINEAR)
        fault = "a table of two inputs is linear; leave out its interpolation";
    else if (lookup->inputs == 2 && lookup->outside == KT_OUTSIDE_REPEAT)
        fault = "a table of two inputs does not repeat itself; state another `outside`";
    else if (!lookup->rows || lookup->row_count < 2)
        fault = "a table has two rows or more";
    else if (lookup->row_count > KT_LOOKUP_ROWS_MAX)
        fault = "a table has at most 1,000,000 rows";
    else if (lookup->inputs == 2 && (ny < 2 || lookup->row_count < 2 * ny || lookup->row_count % ny != 0))
        fault = "the rows are no grid: each x needs the same y, two or more, and there must be two x or more";
    else if (lookup->outside == KT_OUTSIDE_REPEAT && lookup->rows[1] != lookup->rows[2 * lookup->row_count - 1])
        fault = "a table that repeats itself has the same value in its first and last row";
    if (fault)
        (void)snprintf(text, size, "%s", fault);
    return !fault && are_numbers_fine(lookup, text, size) && are_inputs_ordered(lookup, text, size);
}

/* ---- pieces ------------------------------------------------------------------------------------------------------ */

/* Where an input lies: the interval that begins at `index`, or outside of all. */
typedef struct kt_lookup_place {
    int index;
    bool before, behind;
} kt_lookup_place;

/* Finds the interval of x among `count` ascending numbers, which are `stride` apart. */
static kt_lookup_place place_of(const double *numbers, int stride, int count, double x) {
    const double last = numbers[(size_t)(count - 1) * (size_t)stride];
    return (kt_lookup_place){find_interval(numbers, stride, count, x), x<numbers[0], x> last};
}

/* Sets the bounds of the input between which the piece at this place is valid. shift: of a table that repeats
 * itself. */
static void bound_piece(kt_lookup_piece *p, int axis, kt_lookup_place at, const double *numbers, int stride, int count,
                        double shift) {
    const double *own = numbers + (size_t)at.index * (size_t)stride;
    p->low[axis] = at.before ? -HUGE_VAL : at.behind ? numbers[(size_t)(count - 1) * (size_t)stride] : own[0] + shift;
    p->high[axis] = at.before ? numbers[0] : at.behind ? HUGE_VAL : own[stride] + shift;
}

/* Whether the table has no value at x, so that the result is NaN. */
static bool rejects(const double *table, double x, kt_lookup_place at) {
    return isnan(x) || ((at.before || at.behind) && table[KT_LOOKUP_OUTSIDE] == KT_OUTSIDE_REJECT);
}

/* The line of a table beyond its ends: through the first row, or the last one (behind), with the slope there
 * (has_slope) or constant. */
static void continue_rows(kt_lookup_piece *p, const double *row, bool behind, bool has_slope) {
    const double h = behind ? row[KT_PIECE_SIZE + KT_PIECE_X] - row[KT_PIECE_X] : 0.0;
    const double b = row[KT_PIECE_B], c = row[KT_PIECE_C], d = row[KT_PIECE_D];
    p->at[0] = behind ? row[KT_PIECE_SIZE + KT_PIECE_X] : row[KT_PIECE_X];
    p->c[0] = behind ? row[KT_PIECE_SIZE + KT_PIECE_Y] : row[KT_PIECE_Y];
    p->c[1] = has_slope ? b + h * (2.0 * c + 3.0 * h * d) : 0.0;
}

/* Finds the cubic piece of a table at x: its coefficients p->c about p->at[0], and the bounds within which the piece
 * is valid. A table that repeats is shifted by whole periods. */
static void find_row_piece(const double *table, double x, kt_lookup_piece *p) {
    const double *rows = table + KT_LOOKUP_HEAD;
    const int count = (int)table[KT_LOOKUP_NX], outside = (int)table[KT_LOOKUP_OUTSIDE];
    const double first = rows[KT_PIECE_X], last = rows[(size_t)(count - 1) * KT_PIECE_SIZE + KT_PIECE_X];
    const double period = last - first,
                 shift = outside == KT_OUTSIDE_REPEAT ? period * floor((x - first) / period) : 0.0;
    kt_lookup_place at = place_of(rows, KT_PIECE_SIZE, count, x - shift);
    if (outside == KT_OUTSIDE_REPEAT)
        at.before = at.behind = false; /* by rounding alone */
    const double *row = rows + (size_t)at.index * KT_PIECE_SIZE;
    bound_piece(p, 0, at, rows, KT_PIECE_SIZE, count, shift);
    if (rejects(table, x, at))
        return;
    memset(p->c, 0, sizeof p->c);
    if (at.before || at.behind) {
        continue_rows(p, row, at.behind, outside == KT_OUTSIDE_EXTEND);
        return;
    }
    p->at[0] = row[KT_PIECE_X] + shift;
    memcpy(p->c, row + KT_PIECE_Y, 4 * sizeof *row);
}

/* Holds the value of a grid along an axis: moves the origin of the piece to the edge, and leaves out the slope. The
 * edge is the beginning of the first interval or, behind the grid, the end `to` of the last one. */
static void hold_edge(kt_lookup_piece *p, int axis, double to, bool behind) {
    const int slope = axis == 0 ? 1 : 2, other = axis == 0 ? 2 : 1;
    const double h = behind ? to - p->at[axis] : 0.0;
    p->c[0] += h * p->c[slope];
    p->c[other] += h * p->c[3];
    p->c[slope] = p->c[3] = 0.0;
    p->at[axis] += h;
}

/* Finds the bilinear piece of a grid at the point `input`: z = c_0 + c_1 dx + c_2 dy + c_3 dx dy about the corner
 * p->at. */
static void find_grid_piece(const double *table, const double input[2], kt_lookup_piece *p) {
    const int count[2] = {(int)table[KT_LOOKUP_NX], (int)table[KT_LOOKUP_NY]};
    const double *axis[2] = {table + KT_LOOKUP_HEAD, table + KT_LOOKUP_HEAD + count[0]}, *grid = axis[1] + count[1];
    kt_lookup_place at[2];
    bool is_rejected = false;
    for (int k = 0; k < 2; k++) {
        at[k] = place_of(axis[k], 1, count[k], input[k]);
        bound_piece(p, k, at[k], axis[k], 1, count[k], 0.0);
        is_rejected = is_rejected || rejects(table, input[k], at[k]);
    }
    if (is_rejected)
        return;
    const double *z = grid + (size_t)at[0].index * (size_t)count[1] + at[1].index, *next = z + count[1];
    double h[2];
    for (int k = 0; k < 2; k++) {
        p->at[k] = axis[k][at[k].index];
        h[k] = axis[k][at[k].index + 1] - p->at[k];
    }
    p->c[0] = z[0];
    p->c[1] = (next[0] - z[0]) / h[0];
    p->c[2] = (z[1] - z[0]) / h[1];
    p->c[3] = ((next[1] - next[0]) / h[1] - p->c[2]) / h[0];
    for (int k = 0; k < 2 && table[KT_LOOKUP_OUTSIDE] == KT_OUTSIDE_HOLD; k++)
        if (at[k].before || at[k].behind)
            hold_edge(p, k, axis[k][at[k].index + 1], at[k].behind);
}

kt_lookup_piece kt_lookup_piece_at(const double *table, double x, double y) {
    kt_lookup_piece p = {.inputs = table ? (int)table[KT_LOOKUP_INPUTS] : 1,
                         .c = {(double)NAN, (double)NAN, (double)NAN, (double)NAN},
                         .low = {-HUGE_VAL, -HUGE_VAL},
                         .high = {HUGE_VAL, HUGE_VAL}};
    if (table && p.inputs == 2)
        find_grid_piece(table, (const double[2]){x, y}, &p);
    else if (table)
        find_row_piece(table, x, &p);
    return p;
}

/* The bilinear z = c0 + c1 s + c2 r + c3 s r of two inputs, or the cubic of one, from the corner `at` of the piece. */
kt_lookup_value kt_lookup_evaluate(const kt_lookup_piece *p, double x, double y) {
    const double s = x - p->at[0], r = y - p->at[1], *c = p->c;
    if (p->inputs == 2)
        return (kt_lookup_value){
            .z = c[0] + c[1] * s + r * (c[2] + c[3] * s), .x = c[1] + c[3] * r, .y = c[2] + c[3] * s, .xy = c[3]};
    return (kt_lookup_value){.z = c[0] + s * (c[1] + s * (c[2] + s * c[3])),
                             .x = c[1] + s * (2.0 * c[2] + 3.0 * s * c[3]),
                             .xx = 2.0 * c[2] + 6.0 * s * c[3]};
}
