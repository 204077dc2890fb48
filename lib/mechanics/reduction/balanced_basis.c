/* The null space of a balanced group (compile/group_units.c).
 *
 * A method finds orthonormal vectors b of the scaled coordinates y. In the coordinates x_i = unit_i y_i, these vectors
 * may be nearly parallel: if units differ by 1e6, a differential has two vectors whose angle is 1e-6, and N' M N loses
 * twelve digits. Column operations assign a coordinate to each vector, in which this vector is 1 and all other vectors
 * are 0. Among the coordinates in which the remaining vectors are not small, the coordinate with the largest unit is
 * assigned. These coordinates move fastest, so all entries are of moderate size.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/method.h"

/* The part of the largest entry above which an entry may be a vector's own. */
#define SHARE 0.1

/* Assigns the coordinate *row to the vector *column, one of the vectors from `first` on. Among the coordinates in which
 * these vectors are not small, *row has the largest unit. Returns false if all entries are zero. */
static bool find_own(const kt_group_work *w, int first, int dofs, int *row, int *column) {
    double most = 0.0, unit = 0.0, best = 0.0;
    for (int c = first; c < dofs; c++)
        for (int i = 0; i < w->m; i++)
            most = fmax(most, fabs(w->basis[(size_t)c * (size_t)w->m + (size_t)i]));
    for (int c = first; c < dofs; c++)
        for (int i = 0; i < w->m; i++) {
            const double entry = fabs(w->basis[(size_t)c * (size_t)w->m + (size_t)i]);
            if (entry < SHARE * most || w->unit[i] < unit || (w->unit[i] == unit && !(entry > best)))
                continue;
            unit = w->unit[i];
            best = entry;
            *row = i;
            *column = c;
        }
    return most > 0.0;
}

/* Makes `row` the own coordinate of vector c: subtracts c from all other vectors, and divides by its entry. */
static void own_row(const kt_group_work *w, int c, int dofs, int row) {
    const size_t m = (size_t)w->m, at = (size_t)row;
    double *own = w->basis + (size_t)c * m;
    const double pivot = own[at];
    for (size_t i = 0; i < m; i++)
        own[i] /= pivot;
    for (int d = 0; d < dofs; d++) {
        double *other = w->basis + (size_t)d * m;
        const double part = d == c ? 0.0 : other[at];
        for (size_t i = 0; i < m && part != 0.0; i++)
            other[i] -= part * own[i];
    }
    for (int d = 0; d < dofs; d++)
        w->basis[(size_t)d * m + at] = d == c ? 1.0 : 0.0;
}

void kt_group_scale_basis(const kt_group_work *w, int rank) {
    const size_t m = (size_t)w->m;
    const int dofs = w->m - rank;
    for (int c = 0; c < dofs; c++) {
        int row = 0, column = c;
        if (!find_own(w, c, dofs, &row, &column))
            return;
        double *to = w->basis + (size_t)c * m, *from = w->basis + (size_t)column * m;
        for (size_t i = 0; i < m && column != c; i++) {
            const double x = to[i];
            to[i] = from[i];
            from[i] = x;
        }
        own_row(w, c, dofs, row);
        w->work[c] = w->unit[row];
    }
    for (int c = 0; c < dofs; c++)
        for (size_t i = 0; i < m; i++)
            w->basis[(size_t)c * m + i] *= w->unit[i] / w->work[c];
}
