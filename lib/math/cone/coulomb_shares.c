/* The least solution of the impulses of one combination of modes (coulomb.h), if these are not unique.
 *
 * The least normal forces may pull, as those of a car whose load is near a corner, or may be too small for the friction
 * that holds. If they are to be raised, x is the least solution with N_i >= l_i instead. The change is P lambda. P is
 * the projector onto the null vectors, and lambda solves
 *
 *     0 <= lambda  complementary to  N + P_NN lambda - l >= 0
 *
 * with the rows and columns N of normal forces. The tangential forces in l are those of the pass before. */
#include "cone/coulomb.h"

#include "cone/lemke.h"
#include "kinetree/algebra.h"

#include <math.h>
#include <string.h>

/* The units of x_k. Tangential forces that stick have the root of their normal force as unit. With it, the least sum of
 * squares T_i^2 / N_i has T_i in proportion to N_i. */
static void set_units_of_system(kt_coulomb_system *s) {
    double normal = 0.0;
    for (int k = 0; k < s->n; k++) {
        normal = s->is_normal[k] ? s->least[k] + s->x[k] : k > 0 && s->item[k - 1] == s->item[k] ? normal : s->least[k];
        s->unit[k] = s->is_tangential[k] && normal > 0.0 ? sqrt(normal) : 1.0;
    }
}

/* The k-th null vector of A, in these units. */
static void find_null_vector(const kt_coulomb_system *s, int rank, int k, double *z) {
    memset(z, 0, (size_t)s->most * sizeof *z);
    z[s->order[k]] = 1.0;
    for (int i = 0; i < rank; i++)
        z[s->order[i]] = -kt_coulomb_matrix_row(s->A, i, s->width)[k];
    for (int i = 0; i < s->n; i++)
        z[i] /= s->unit[i];
}

/* Takes the part along the null vectors in rows of A from `rank` on from the one in row k; its length becomes 1. */
static void make_orthonormal(kt_coulomb_system *s, int rank, int k) {
    double *z = kt_coulomb_matrix_row(s->A, k, s->width), norm = 0.0;
    for (int pass = 0; pass < 2; pass++)
        for (int j = rank; j < k; j++) {
            const double *other = kt_coulomb_matrix_row(s->A, j, s->width);
            double dot = 0.0;
            for (int i = 0; i < s->n; i++)
                dot += z[i] * other[i];
            for (int i = 0; i < s->n; i++)
                z[i] -= dot * other[i];
        }
    for (int i = 0; i < s->n; i++)
        norm += z[i] * z[i];
    for (int i = 0; i < s->n; i++)
        z[i] /= sqrt(norm);
}

/* Removes the part of all columns of x along a null vector. */
static void remove_along(kt_coulomb_system *s, const double *z) {
    for (int m = 0; m < s->columns; m++) {
        double *x = kt_coulomb_matrix_row(s->x, m, s->most), dot = 0.0;
        for (int i = 0; i < s->n; i++)
            dot += z[i] * x[i] / s->unit[i];
        for (int i = 0; i < s->n; i++)
            x[i] -= dot * z[i] * s->unit[i];
    }
}

/* Whether dry friction sticks. */
static bool any_dry_sticks(const kt_coulomb *c, const kt_coulomb_system *s) {
    bool any = false;
    for (int k = 0; k < s->n; k++)
        any = any || c->item[s->item[k]].type == KT_COULOMB_DRY;
    return any;
}

/* Changes the units of friction that sticks to those of other shares (coulomb.h). first: dry friction begins with the
 * unit of its limit. If it has only one share, which exceeds the limit, its unit would shrink without end: units stay
 * within a range. Returns false if no friction exceeds its limit. */
static bool change_shares(const kt_coulomb *c, kt_coulomb_system *s, bool first) {
    static const double rounding = 1e-12; /* relative to the limit of dry friction */
    const double range = any_dry_sticks(c, s) ? KT_COULOMB_RANGE_OF_DRY : HUGE_VAL;
    bool exceeds = false;
    double normal = 0.0;
    for (int k = 0; k < s->n; k++) {
        const kt_coulomb_item *item = &c->item[s->item[k]];
        const bool is_dry = item->type == KT_COULOMB_DRY;
        normal = s->is_normal[k] ? s->least[k] + s->x[k] : k > 0 && s->item[k - 1] == s->item[k] ? normal : s->least[k];
        const double most = is_dry ? item->friction : item->friction * normal;
        if (!(is_dry || s->is_tangential[k]) || !(most > 0.0))
            continue;
        const double part = (is_dry ? fabs(s->x[k]) : kt_hypot(s->x[k], s->x[k + 1])) / most;
        const double unit = first && is_dry ? sqrt(most) : s->unit[k];
        s->unit[k] = kt_coulomb_unit_within(unit * kt_coulomb_unit_factor(part), is_dry ? most : normal, range);
        exceeds = exceeds || part > (is_dry ? 1.0 + rounding : 1.0);
        if (!is_dry) {
            s->unit[k + 1] = s->unit[k];
            k++;
        }
    }
    return exceeds;
}

/* Removes the part of x along the null vectors of A, which are behind the first `rank` pivots. */
static void remove_null_vectors(kt_coulomb_system *s, int rank) {
    for (int k = rank; k < s->n; k++) {
        double *z = kt_coulomb_matrix_row(s->A, k, s->width);
        find_null_vector(s, rank, k, z);
        make_orthonormal(s, rank, k);
        for (int i = 0; i < s->n; i++)
            s->shares = s->shares || (s->is_normal[i] && fabs(z[i]) > 1e-8);
        remove_along(s, z);
    }
}

/* Lists the normal forces (loads->row), and how far each exceeds its bound (loads->q). Returns whether one is below. */
static bool list_loads(const kt_coulomb *c, kt_coulomb_system *s, kt_coulomb_loads *loads) {
    double sum = 0.0;
    bool any = false;
    loads->n = 0;
    for (int k = 0; k < s->n; k++)
        if (s->is_normal[k]) {
            loads->row[loads->n++] = k;
            sum += s->x[k];
        }
    for (int i = 0; i < loads->n; i++) {
        const int k = loads->row[i];
        const bool sticks = k + 2 < s->n && s->is_tangential[k + 1] && s->item[k + 1] == s->item[k];
        const double force = sticks ? kt_hypot(s->x[k + 1], s->x[k + 2]) : 0.0;
        const double mean = sum / loads->n, holds = kt_coulomb_least_load(force, c->item[s->item[k]].friction, mean);
        loads->q[i] = s->x[k] - fmax(holds - s->least[k], kt_coulomb_least_load(0.0, 1.0, mean));
        any = any || loads->q[i] < 0.0;
    }
    return any;
}

/* Raises normal forces to their bounds, by the least change of x along the null vectors. */
static void raise_loads(const kt_coulomb *c, kt_coulomb_system *s, int rank) {
    kt_coulomb_loads *loads = &s->loads;
    uint64_t pivots = 0;
    if (!list_loads(c, s, loads))
        return;
    for (int i = 0; i < loads->n; i++)
        for (int j = 0; j < loads->n; j++) {
            double sum = 0.0;
            for (int k = rank; k < s->n; k++) {
                const double *z = kt_coulomb_matrix_row(s->A, k, s->width);
                sum += z[loads->row[i]] * z[loads->row[j]];
            }
            loads->M[i * loads->n + j] = sum;
        }
    if (!kt_lemke_solve(loads->n, loads->M, loads->q, loads->lemke, loads->raise, &pivots))
        return;
    for (int k = rank; k < s->n; k++) {
        const double *z = kt_coulomb_matrix_row(s->A, k, s->width);
        double along = 0.0;
        for (int i = 0; i < loads->n; i++)
            along += z[loads->row[i]] * loads->raise[i];
        for (int i = 0; i < s->n; i++)
            s->x[i] += along * z[i] * s->unit[i];
    }
}

static void take_least_forces(const kt_coulomb *c, kt_coulomb_system *s, int rank) {
    remove_null_vectors(s, rank);
    if (s->raises)
        raise_loads(c, s, rank);
}

/* Reduces x to the least solution. In the first pass all entries have the same unit; it finds normal forces that are
 * not unique. The second pass uses the units of set_units_of_system, and further ones those of other shares. */
void kt_coulomb_reduce_to_least(const kt_coulomb *c, kt_coulomb_system *s, int rank) {
    for (int i = 0; i < s->n; i++)
        s->unit[i] = 1.0;
    take_least_forces(c, s, rank);
    set_units_of_system(s);
    take_least_forces(c, s, rank);
    for (int k = 0; k < KT_COULOMB_SHARINGS && change_shares(c, s, k == 0); k++)
        take_least_forces(c, s, rank);
}
