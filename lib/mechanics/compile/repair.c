/* Redundant equations are a property of lengths and directions: a parallelogram with a second coupler moves because
 * three pairs of lengths are equal. If the data are rounded, the lengths differ and the loops close nowhere. Without a
 * correction of the data, some equations would have to be dropped. This fails when the bars lie in line and another
 * motion branches off, because the remaining equations lead into this motion, which the dropped equations forbid.
 *
 * So the data are corrected instead, below the tolerance: the ends x of the loops are moved by p so that
 *     W_s' phi(q_s, x + p) = 0     at many positions q_s
 * where W spans the directions that no motion closes: W' A = 0, A = phi_q. With B = phi_x, p is found from
 *     W_s' (phi_s + B_s p) = 0,
 * in the sense of least squares and damped, so that p is the least such correction. Then the q_s are closed again as
 * far as possible, and the two steps are repeated. The equations outnumber the corrections. If a solution exists
 * nevertheless, the mechanism is redundant except for its data.
 *
 * Generic positions do not suffice. Let a, b be the angles of the cranks, u = a - b, s = a + b. A parallelogram whose
 * lengths are off by d requires u (s - k u) = d. Two such equations agree to first order in d if d is equal in both: u
 * = d / s closes both except for d^2. Only a position with the bars in line, s = 0, shows the difference. Such a
 * position is an additional q_s. A search along the motion finds this position, at which the smallest direction of A
 * and its rows vanish. W has one direction more at this position.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/rank_samples.h"

#include "assembly/levenberg_marquardt.h"
#include "assembly/rounding.h"
#include "base/aligned.h"
#include "base/arena.h"
#include "base/generic.h"
#include "compile/find_planar.h"
#include "kinetree/loop.h"
#include "linear/cholesky.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum {
    GENERIC = 16,
    CANDIDATES = 15,
    FLAT = 2, /* positions in which a direction is lost, one in each sense of the motion */
    ROUNDS = 30,
    STEPS = 300,            /* along the motion */
    CORRECTIONS = 6,        /* of an end: its point, its directions */
    LOOPS_MAX = 40,         /* of a group: larger ones are left as they are */
    SIZE_MAX_OF_GROUP = 64, /* equations and coordinates */
};

#define NO_DIRECTION 1e-4 /* of the largest singular value: no motion closes smaller directions */
#define DAMPING 1e-9
#define EXACT                                                                                                          \
    1e-13 /* the gap, relative to the scales, at which corrections are found; they go on as long as it shrinks */
#define DIFFERENCE 1e-5

/* Arrays for n corrections, k equations, m coordinates and nq positions: type, name, count, meaning. */
#define REPAIR_FIELDS(X)                                                                                               \
    X(double, p, n, "corrections, in radians and lengths of the longest loop")                                         \
    X(double, step, n, "right-hand side of the normal equations of the corrections, and the step")                     \
    X(double, row, n + k + m, "a row of W' B, and scratch")                                                            \
    X(double, h, n *n, "matrix of the normal equations")                                                               \
    X(double, b, n *k, "B")                                                                                            \
    X(double, a, k *m, "A in units of its scales, by rows")                                                            \
    X(double, phi, k, "in units of its scales")                                                                        \
    X(double, left, k *k, "singular vectors, those of the largest values first")                                       \
    X(double, right, m *m, "likewise")                                                                                 \
    X(double, size, k + m, "singular values")                                                                          \
    X(double, work, k *m, "scratch")                                                                                   \
    X(double, before, m, "the motion at the position before")                                                          \
    X(double, newton, 5 * (k + m) * (k + m) + (m + 1) * (k + 1) * (m + 2) + 4 * (k + m) + nq,                          \
      "of positions in which a direction is lost")                                                                     \
    X(double, q, (GENERIC + FLAT + 2) * nq, "the positions")

typedef struct repair {
    kt_model *model;
    kt_data *data;
    size_t g;
    int k, m, rank, count; /* equations, coordinates; corrections */
    const kt_pose *given;  /* two a loop */
    int generic, flat;     /* positions */
    KT_ARENA_DECLARE(REPAIR_FIELDS)
} repair;

KT_ARENA_ARRAYS(lay_out_repair, repair, REPAIR_FIELDS, size_t n, size_t k, size_t m, size_t nq)

/* ---- ends -------------------------------------------------------------------------------------------------------- */

/* The rotation turned by a rotation vector in its own axes. */
static kt_mat3 turned_by(kt_mat3 rotation, const double *by) {
    const kt_vec3 turn = kt_vec3_make(by[0], by[1], by[2]);
    kt_mat3 change = kt_mat3_identity();
    if (kt_vec3_norm(turn) > 0.0 && kt_mat3_from_axis_angle(turn, kt_vec3_norm(turn), &change, NULL) != KT_OK)
        return rotation;
    return kt_mat3_multiply(rotation, change);
}

/* Computes the numbers of a loop that depend on its ends. */
static void update_loop_ends(kt_model *model, kt_loop_record *loop) {
    if (model->n.planar_loop > 0 && model->group[loop->group].planar)
        kt_planar_ends(model, loop, &model->planar_loop[loop - model->loop]);
}

void kt_loops_place_ends(kt_model *model, const kt_pose *ends) {
    for (size_t i = 0; i < model->n.loop; i++) {
        kt_loop_record *loop = &model->loop[i];
        if (loop->group < 0 || loop->term_count != 0)
            continue;
        loop->frame[0] = ends[2 * i];
        loop->frame[1] = ends[2 * i + 1];
        update_loop_ends(model, loop);
    }
}

/* Places the ends of a group's loop according to its corrections. */
static void place_ends(const repair *u, int l) {
    const int32_t i = u->model->group_loop[u->model->group[u->g].loop + l];
    kt_loop_record *loop = &u->model->loop[i];
    const double *p = u->p + (size_t)l * 2 * CORRECTIONS;
    for (int k = 0; k < 2 && loop->term_count == 0; k++, p += CORRECTIONS) {
        const kt_pose *given = &u->given[2 * i + k];
        loop->frame[k].position =
            kt_vec3_add(given->position, kt_vec3_scale(u->model->length, kt_vec3_make(p[0], p[1], p[2])));
        loop->frame[k].rotation = turned_by(given->rotation, p + 3);
    }
    if (loop->term_count == 0)
        update_loop_ends(u->model, loop);
}

double kt_group_store_disagreement(kt_model *model, const kt_data *data, size_t g) {
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    double most = 0.0;
    for (int i = 0; i < group->loop_count; i++) {
        kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        for (int r = 0; r < loop->row_count; r++) {
            const int32_t k = model->slot[loop->slot + r];
            if (k < 0 || w.closes[k] == 0.0)
                continue;
            const bool is_length = kt_loop_measure_of(model, (int)(loop - model->loop), r) == KT_MEASURE_LENGTH;
            most = fmax(most, fabs(w.residual[k]) / w.scale[k]);
            loop->disagreement[is_length ? 0 : 1] = fmax(loop->disagreement[is_length ? 0 : 1], fabs(w.residual[k]));
        }
    }
    return most;
}

/* ---- equations at a position ------------------------------------------------------------------------------------- */

/* Fills phi, and A unless it is NULL. */
static bool fill_residuals(const repair *u, const double *q, double *a, double *phi) {
    kt_violation violation;
    if (!u->model->group_kernels->residuals(u->model, u->data, 0.0, q, NULL, NULL, &violation))
        return false;
    const kt_group_work w = kt_group_matrices(u->model, u->data, u->g, KT_ROWS_CLOSED);
    const double *unit = u->model->unit + u->model->group[u->g].v;
    for (int r = 0; r < u->k; r++) {
        phi[r] = w.residual[r] / w.scale[r];
        for (int i = 0; i < u->m && a; i++)
            a[r * u->m + i] = w.a[(size_t)r * (size_t)w.m + (size_t)i] * unit[i] / w.scale[r];
    }
    return true;
}

/* Turns the n columns of x (each of m numbers) until they are orthogonal: x <- x V. The columns are then in order of
 * their lengths, which are stored in size. A column that has become rounding counts as zero: further turns would only
 * shrink it, down to denormal numbers, without an end. Source: one-sided Jacobi iteration [Hestenes 1958]. */
static void orthogonalise(double *x, int m, int n, double *v, double *size) {
    enum { SWEEPS = 40 };
    memset(v, 0, (size_t)n * (size_t)n * sizeof *v);
    for (int i = 0; i < n; i++)
        v[i * (n + 1)] = 1.0;
    const double zero = DBL_EPSILON * DBL_EPSILON * kt_dense_dot(x, x, m * n);
    bool turned_any = true;
    for (int sweep = 0; sweep < SWEEPS && turned_any; sweep++) {
        turned_any = false;
        for (int i = 0; i < n; i++)
            for (int j = i + 1; j < n; j++) {
                double *a = x + i * m, *b = x + j * m, *va = v + i * n, *vb = v + j * n;
                const double aa = kt_dense_dot(a, a, m), bb = kt_dense_dot(b, b, m), ab = kt_dense_dot(a, b, m);
                if (bb <= zero || (fabs(ab) <= 1e-15 * sqrt(aa * bb) && aa >= bb))
                    continue;
                turned_any = true;
                const double angle = 0.5 * atan2(2.0 * ab, aa - bb), c = cos(angle), s = sin(angle);
                for (int e = 0; e < m + n; e++) {
                    double *first = e < m ? &a[e] : &va[e - m], *second = e < m ? &b[e] : &vb[e - m];
                    const double one = *first, two = *second;
                    *first = c * one + s * two;
                    *second = c * two - s * one;
                }
            }
    }
    for (int i = 0; i < n; i++)
        size[i] = sqrt(kt_dense_dot(x + i * m, x + i * m, m));
}

/* Fills A and phi at q, and the singular vectors of A; size holds the singular values on the left. */
static bool decompose(const repair *u, const double *q) {
    const size_t all = (size_t)u->k * (size_t)u->m;
    if (!fill_residuals(u, q, u->a, u->phi))
        return false;
    for (int r = 0; r < u->k; r++)
        for (int i = 0; i < u->m; i++)
            u->work[i * u->k + r] = u->a[r * u->m + i];
    orthogonalise(u->work, u->k, u->m, u->right, u->size);
    memcpy(u->work, u->a, all * sizeof *u->work);
    orthogonalise(u->work, u->m, u->k, u->left, u->size);
    return isfinite(u->size[0]) && u->size[0] > 0.0;
}

/* q <- q (+) x, in units of the coordinates. */
static void move_by_units(const repair *u, double *q, const double *x) {
    const kt_group *group = &u->model->group[u->g];
    double *step = u->data->scratch_v, *to = u->data->moved_q;
    memset(step, 0, u->model->n.v * sizeof *step);
    for (int i = 0; i < u->m; i++)
        step[u->model->group_v[group->v + i]] = x[i] * u->model->unit[group->v + i];
    kt_position_add(u->model, q, step, to);
    memcpy(q, to, u->model->n.q * sizeof *q);
}

/* ---- corrections ------------------------------------------------------------------------------------------------- */

/* B at q: the change of phi with each correction. */
static bool differentiate_corrections(const repair *u, const double *q) {
    bool finite = true;
    for (int j = 0; j < u->count && finite; j++) {
        const double here = u->p[j];
        double *column = u->b + j * u->k;
        u->p[j] = here + DIFFERENCE;
        place_ends(u, j / (2 * CORRECTIONS));
        finite = fill_residuals(u, q, NULL, column);
        u->p[j] = here - DIFFERENCE;
        place_ends(u, j / (2 * CORRECTIONS));
        finite = finite && fill_residuals(u, q, NULL, u->row);
        for (int r = 0; r < u->k; r++)
            column[r] = (column[r] - u->row[r]) / (2.0 * DIFFERENCE);
        u->p[j] = here;
        place_ends(u, j / (2 * CORRECTIONS));
    }
    return finite;
}

/* Adds W' phi = -W' B p at a position that is decomposed, where `lost` directions of A are lost. Returns the largest
 * of W' phi; NaN if a number is not finite. */
static double add_equations(const repair *u, const double *q, int lost) {
    double most = 0.0;
    if (!differentiate_corrections(u, q))
        return (double)NAN;
    for (int i = u->rank - lost; i < u->k; i++) {
        const double *w = u->left + i * u->k, phi = kt_dense_dot(w, u->phi, u->k);
        most = fmax(most, fabs(phi));
        for (int j = 0; j < u->count; j++)
            u->row[j] = kt_dense_dot(w, u->b + j * u->k, u->k);
        for (int j = 0; j < u->count; j++) {
            u->step[j] -= u->row[j] * phi;
            for (int c = j; c < u->count; c++)
                u->h[(size_t)j * (size_t)u->count + (size_t)c] += u->row[j] * u->row[c];
        }
    }
    return most;
}

/* p <- p + (H + damping)^-1 step */
static bool correct_parameters(const repair *u) {
    const size_t n = (size_t)u->count;
    double most = 0.0;
    for (size_t i = 0; i < n; i++)
        most = fmax(most, u->h[i * (n + 1)]);
    for (size_t i = 0; i < n; i++)
        u->h[i * (n + 1)] += DAMPING * most;
    if (!(most > 0.0) || !isfinite(most) || !kt_dense_cholesky(u->h, n, u->count, NULL))
        return false;
    kt_dense_solve(u->h, u->count, u->step);
    bool small = true;
    for (size_t i = 0; i < n; i++) {
        u->p[i] += u->step[i];
        small = small && fabs(u->p[i]) <= u->model->tolerance;
    }
    for (int l = 0; l < u->model->group[u->g].loop_count; l++)
        place_ends(u, l);
    return small;
}

/* ---- positions --------------------------------------------------------------------------------------------------- */

/* x <- the least step that closes the directions that are not lost. */
static void least_step(const repair *u, int count, double *x) {
    memset(x, 0, (size_t)u->m * sizeof *x);
    for (int i = 0; i < count; i++) {
        const double *w = u->left + i * u->k, f = kt_dense_dot(w, u->phi, u->k) / (u->size[i] * u->size[i]);
        for (int r = 0; r < u->k; r++)
            for (int c = 0; c < u->m; c++)
                x[c] -= f * w[r] * u->a[r * u->m + c];
    }
}

/* Closes the directions that motions close, as far as rounding permits, and decomposes A at this position. A search
 * would follow the motion to the position at which the loops disagree least. */
static bool close_at(const repair *u, double *q) {
    enum { STEPS_OF_CLOSING = 12 };
    double before = (double)INFINITY, *x = u->row;
    for (int step = 0; step < STEPS_OF_CLOSING; step++) {
        double size = 0.0;
        if (!decompose(u, q) || !(u->size[u->rank - 1] > NO_DIRECTION * u->size[0]))
            return false;
        least_step(u, u->rank, x);
        for (int c = 0; c < u->m; c++)
            size = fmax(size, fabs(x[c]));
        if (!(size < 0.5))
            return false;
        if (size < 1e-12 && size > 0.5 * before)
            return true;
        before = size;
        move_by_units(u, q, x);
    }
    return before < 1e-10 && decompose(u, q);
}

/* G = W' A Z of given directions W and Z, by rows of W. */
static void restrict_rows(const repair *u, const double *a, const double *left, const double *right, double *out) {
    const int first = u->rank - 1, free = u->m - first;
    for (int i = first; i < u->k; i++)
        for (int j = 0; j < free; j++) {
            double sum = 0.0;
            for (int r = 0; r < u->k; r++)
                sum += left[i * u->k + r] * kt_dense_dot(a + r * u->m, right + (first + j) * u->m, u->m);
            out[(i - first) * free + j] = sum;
        }
}

/* Finds the position near q at which a direction is lost, with Newton's method. The rows of W' A vanish along the Z
 * that the other directions leave, G(z) = 0, and the other directions are closed. Returns false if no such position is
 * found. */
static bool find_flat(const repair *u, double *q) {
    enum { NEWTON_STEPS = 25 };
    const int first = u->rank - 1, free = u->m - first, rows = u->k - first, n = rows * free;
    double *g = u->newton, *slope = g + n, *gram = slope + n * free, *z = gram + free * free, *x = z + free,
           *left = x + u->m, *right = left + u->k * u->k, *there = right + u->m * u->m;
    for (int iteration = 0; iteration < NEWTON_STEPS; iteration++) {
        if (!decompose(u, q))
            return false;
        least_step(u, first, x);
        memcpy(left, u->left, (size_t)(u->k * u->k) * sizeof *left);
        memcpy(right, u->right, (size_t)(u->m * u->m) * sizeof *right);
        restrict_rows(u, u->a, left, right, g);
        for (int j = 0; j < free; j++) {
            memcpy(there, q, u->model->n.q * sizeof *q);
            for (int c = 0; c < u->m; c++)
                u->row[c] = DIFFERENCE * right[(first + j) * u->m + c];
            move_by_units(u, there, u->row);
            if (!fill_residuals(u, there, u->a, u->phi))
                return false;
            restrict_rows(u, u->a, left, right, slope + j * n);
            for (int e = 0; e < n; e++)
                slope[j * n + e] = (slope[j * n + e] - g[e]) / DIFFERENCE;
        }
        double most = 0.0, size = 0.0;
        for (int j = 0; j < free; j++) {
            z[j] = -kt_dense_dot(slope + j * n, g, n);
            for (int i = 0; i <= j; i++)
                gram[i * free + j] = kt_dense_dot(slope + j * n, slope + i * n, n);
            most = fmax(most, gram[j * (free + 1)]);
        }
        for (int j = 0; j < free; j++)
            gram[j * (free + 1)] += 1e-10 * most;
        if (!(most > 0.0) || !kt_dense_cholesky(gram, (size_t)free, free, NULL))
            return false;
        kt_dense_solve(gram, free, z);
        for (int j = 0; j < free; j++)
            for (int c = 0; c < u->m; c++)
                x[c] += z[j] * right[(first + j) * u->m + c];
        for (int c = 0; c < u->m; c++)
            size = fmax(size, fabs(x[c]));
        if (!(size < 0.5))
            return false;
        move_by_units(u, q, x);
        if (size < 1e-9)
            return true;
    }
    return false;
}

/* Whether the loops close up to the tolerance, and the directions that motions do not close are nearly singular. */
static bool is_redundant(const repair *u) {
    bool closed = u->k <= u->rank || u->size[u->rank] <= NO_DIRECTION * u->size[0];
    for (int r = 0; r < u->k; r++)
        closed = closed && fabs(u->phi[r]) <= u->model->tolerance;
    return closed;
}

/* Finds a position at which the loops close except for their disagreement, and no direction is small. Of several
 * positions around the base, from which a search leads to such a position, the best is used. Returns false if none is
 * found, or if the group does not have one degree of freedom. */
static bool find_start(const repair *u, const double *base, double *q) {
    static const double size[] = {0.0, 0.15, 0.3, 0.6, 1.2};
    double best = 10.0 * NO_DIRECTION;
    double *from = u->newton;
    for (int c = 0; c < CANDIDATES; c++) {
        for (int i = 0; i < u->m; i++)
            u->row[i] = size[c % 5] * kt_generic((size_t)i + 173 * ((size_t)c + 1));
        memcpy(from, base, u->model->n.q * sizeof *from);
        move_by_units(u, from, u->row);
        if (c % 2)
            (void)kt_assemble_levenberg_marquardt(u->model, u->data, 0.0, NULL, KT_SEARCH_SAMPLE, from);
        if (!close_at(u, from) || !is_redundant(u) || !(u->size[u->rank - 1] > best * u->size[0]))
            continue;
        best = u->size[u->rank - 1] / u->size[0];
        memcpy(q, from, u->model->n.q * sizeof *q);
    }
    return best > 10.0 * NO_DIRECTION;
}

/* Follows the motion from q, in one sense. Collects generic positions until there are `most`. With most = 0, continues
 * until a direction vanishes, and leaves this position in q. Returns whether a direction is lost. */
static bool follow_repaired_motion(repair *u, double sense, int most, double *q) {
    double usual = 0.0, *before = u->before;
    for (int step = 0; step < STEPS; step++) {
        if (!decompose(u, q))
            return false;
        const double *motion = u->right + (u->m - 1) * u->m, here = u->size[u->rank - 1];
        usual = fmax(usual, here);
        if (here < 0.1 * usual)
            return find_flat(u, q);
        if (u->generic < most && here > 0.3 * usual)
            memcpy(u->q + (size_t)u->generic++ * u->model->n.q, q, u->model->n.q * sizeof *q);
        if (most > 0 && u->generic == most)
            return false;
        const double sign = step == 0 ? sense : kt_dense_dot(before, motion, u->m) > 0.0 ? 1.0 : -1.0;
        for (int c = 0; c < u->m; c++) {
            before[c] = sign * motion[c];
            u->row[c] = 0.1 * fmin(1.0, 3.0 * here / u->size[0]) * before[c];
        }
        move_by_units(u, q, u->row);
        if (!close_at(u, q) || !is_redundant(u))
            return false;
    }
    return false;
}

/* Solves for the corrections at all positions. */
static bool solve_corrections(const repair *u) {
    const size_t nq = u->model->n.q, n = (size_t)u->count;
    double before = (double)INFINITY;
    for (int round = 0; round < ROUNDS; round++) {
        double gap = 0.0;
        memset(u->h, 0, n * n * sizeof *u->h);
        memset(u->step, 0, n * sizeof *u->step);
        for (int s = 0; s < u->generic + u->flat; s++) {
            double *q = u->q + (size_t)s * nq;
            if (s < u->generic ? !close_at(u, q) : !find_flat(u, q) || !decompose(u, q))
                return false;
            const double here = add_equations(u, q, s >= u->generic);
            if (!(here <= u->model->tolerance))
                return false;
            gap = fmax(gap, here);
        }
        if (gap <= EXACT && gap > 0.5 * before)
            return true;
        before = gap;
        if (!correct_parameters(u))
            return false;
    }
    return before <= EXACT;
}

/* The largest of W' phi at a position in which a direction is lost. */
static double open_at(const repair *u) {
    double open = 0.0;
    for (int i = u->rank - 1; i < u->k; i++)
        open = fmax(open, fabs(kt_dense_dot(u->left + i * u->k, u->phi, u->k)));
    return open;
}

/* First uses generic positions alone. Then adds positions in which a direction vanishes, if corrections below the
 * tolerance can make a direction vanish. */
static bool repair_group_rows(repair *u, const double *base) {
    const size_t nq = u->model->n.q;
    double *start = u->q + (GENERIC + FLAT) * nq, *q = start + nq;
    if (!find_start(u, base, start))
        return false;
    for (int side = 0; side < FLAT; side++) {
        memcpy(q, start, nq * sizeof *q);
        (void)follow_repaired_motion(u, side ? 1.0 : -1.0, (side + 1) * GENERIC / 2, q);
    }
    if (u->generic < GENERIC / 2)
        return false;
    double most = 0.0;
    for (int s = 0; s < u->generic; s++)
        if (close_at(u, u->q + (size_t)s * nq))
            most = fmax(most, kt_group_store_disagreement(u->model, u->data, u->g));
    if (!(most > kt_group_rounding(u->model, u->g, base)) || !solve_corrections(u))
        return false;
    for (int side = 0; side < FLAT; side++) {
        memcpy(q, u->q, nq * sizeof *q);
        if (follow_repaired_motion(u, side ? 1.0 : -1.0, 0, q) && decompose(u, q) && open_at(u) <= u->model->tolerance)
            memcpy(u->q + (size_t)(u->generic + u->flat++) * nq, q, nq * sizeof *q);
    }
    return u->flat == 0 || solve_corrections(u);
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

kt_status kt_group_repair(kt_model *model, kt_data *data, size_t g, const double *q, const kt_pose *given,
                          bool *found) {
    const kt_group *group = &model->group[g];
    repair u = {.model = model,
                .data = data,
                .g = g,
                .k = group->count[KT_ROWS_CLOSED],
                .m = group->v_count,
                .given = given,
                .count = 2 * CORRECTIONS * group->loop_count};
    *found = false;
    u.rank = u.m - 1;
    if (u.rank < 1 || u.k < u.rank || group->has_fronts || group->loop_count > LOOPS_MAX ||
        u.k + u.m > SIZE_MAX_OF_GROUP)
        return KT_OK;
    const size_t n = (size_t)u.count, k = (size_t)u.k, m = (size_t)u.m, nq = model->n.q;
    const size_t bytes = lay_out_repair(NULL, NULL, n, k, m, nq);
    void *memory = kt_arena_allocate(bytes, "the repair of a group", NULL);
    if (memory == NULL)
        return KT_ERROR_MEMORY;
    memset(memory, 0, bytes);
    (void)lay_out_repair(&u, memory, n, k, m, nq);
    *found = repair_group_rows(&u, q);
    kt_aligned_release(memory);
    if (!*found)
        kt_loops_place_ends(model, given);
    return KT_OK;
}
