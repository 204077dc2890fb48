/* The matrices of a constraint group, and the violations of its equations.
 *
 * A group has k equations A x = b in the m coordinates x of its links. All matrices are column-major.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONSTRAINT_GROUP_H
#define KT_CONSTRAINT_GROUP_H

#include "algebra/real.h"
#include "base/arena.h"
#include "base/isa.h"
#include "linear/qr.h"
#include "model/model.h"

#include <assert.h>
#include <math.h>

/* Every matrix of a group: name, count, meaning. A group has m coordinates and k equations. If dense matrices reduce
 * the group, n is m; if fronts do, n is 0. The lesser of n and k is s. */
#define KT_GROUP_FIELDS(X)                                                                                             \
    X(a, n *k, "A', m x k")                                                                                            \
    X(factor, n *k, "A' factored")                                                                                     \
    X(reflector_scale, s, "t of the reflectors 1 - t u u' (qr.h)")                                                     \
    X(square, n *n, "orthogonal factor (SVD)")                                                                         \
    X(right, k, "b'' or what is to be closed")                                                                         \
    X(residual, k, "phi")                                                                                              \
    X(scale, k, "what residuals are held against: a radian, or the mechanism's length")                                \
    X(closes, k, "1 where an equation has a residual to be closed, else 0")                                            \
    X(rate, k, "phi_t = -b'")                                                                                          \
    X(multiplier, k, "lambda")                                                                                         \
    X(mass, n *n, "M of the group, its parent held")                                                                   \
    X(coupling, 6 * n, "F, parent coupling: wrench on the parent for unit accelerations; moment, force")               \
    X(bias, m, "tau - h")                                                                                              \
    X(free, m, "y, free acceleration: accelerations while the parent's is zero")                                       \
    X(gain, 6 * n, "K, parent gain, m x 6: accelerations are y - K (alpha, a of the parent)")                          \
    X(basis, n *n, "N: null space of A, m x (m - rank)")                                                               \
    X(reduced, n *n, "N' M N, then its Cholesky factor")                                                               \
    X(half, n *n, "M N, and other products")                                                                           \
    X(work, n ? kt_group_work_count(m, k) : m + k, "of LAPACK")                                                        \
    X(wrench, n ? 0 : 2 * KT_FRONT_SPACE * k, "of a unit multiplier on both ends' links, about their origins")         \
    X(front, group->front.count, "of the elimination by fronts (front.h)")                                             \
    X(half_columns, group->ranges &&n ? kt_half_count(m, s) : 0, "of range space (half_columns.h)")

typedef struct kt_group_work {
    int m, k;
    kt_index1 *pivot;
    /* Among redundant equations those with the larger weights are chosen (k; NULL if there are none), so that the
     * choice is the same at all stages of a step. Off the manifold, as at stages, each choice gives another
     * acceleration; a method of any order would fall to the second. The weights are powers of two, so that nothing is
     * rounded. */
    const double *weight;
    /* NULL, or the units of the coordinates (m). The group is then `balanced`: its equations are factored as
     * (A_ij unit_j / scale_i), and solved for x_j / unit_j (compile/group_units.c). */
    const double *unit;
    double least;     /* lower bound of the size that the largest direction counts as */
    double tolerance; /* the size, relative to the largest, below which a direction counts as lost (linear/qr.h) */
#define KT_GROUP_DECLARE(name, count, meaning) kt_real1 *name;
    KT_GROUP_FIELDS(KT_GROUP_DECLARE)
#undef KT_GROUP_DECLARE
} kt_group_work;

/* From this number of coordinates on LAPACK factors faster than a plain loop (bench/scaling). */
enum { KT_LARGE = 40 };

/* Returns the number of doubles that LAPACK needs as workspace for an m x k matrix. The workspace suffices for dgeqp3,
 * dgesvd and dormqr in blocks of 32. (In blocks, dormqr needs 65 x 64 more.) */
static inline size_t kt_group_work_count(size_t m, size_t k) {
    return 34 * (m + k) + 5 * (m < k ? m : k) + (m < KT_LARGE ? 64 : 65 * 64 + 64);
}

/* The arrays for range space (reduction/half_columns.h) of m coordinates and n vectors of four equations, in the order
 * of their alignment. Links have the places of their first coordinates. */
#define KT_HALF_FIELDS(X)                                                                                              \
    X(kt_v4, column, n *m, "half columns of each vector")                                                              \
    X(kt_v4, flow, 6 * m, "wrenches that children pass, of one vector")                                                \
    X(kt_v4, base, 2 * m, "A0, angular and linear")                                                                    \
    X(kt_v4, change, 4 * n, "of lambda, due to four forces")                                                           \
    X(double, square, 16 * n * n, "S, then its factor")                                                                \
    X(double, diagonal, 4 * n, "of S")                                                                                 \
    X(double, multiplier, 4 * n, "lambda")                                                                             \
    X(double, inverse, m, "d")                                                                                         \
    X(double, free_acceleration, m, "y - K A0")                                                                        \
    X(int32_t, slot, 4 * n, "of each equation; -1: none")                                                              \
    X(uint8_t, has_flow, m, "whether there is a flow")                                                                 \
    X(uint8_t, is_incomplete, 1, "whether the accelerations due to lambda are to be added")                            \
    X(uint8_t, is_nonzero, n *m, "whether half columns of this vector are not zero")

/* Doubles before these arrays: the struct that places them. */
enum { KT_HALF_HEAD = 16 };

/* Returns the number of doubles of struct and arrays for a group with s equations at most. */
static inline size_t kt_half_count(size_t m, size_t s) {
    const size_t n = (s + 3) / 4;
#define KT_HALF_BYTES(type, name, count, meaning) +(count) * sizeof(type)
    return KT_HALF_HEAD + (0 KT_HALF_FIELDS(KT_HALF_BYTES) + 7) / 8;
#undef KT_HALF_BYTES
}

/* Finds a group's matrices in the data. Inlined, since each caller uses few of the matrices. The first function avoids
 * a copy if the caller passes the address on. */
KT_INLINE void kt_group_find(const kt_model *model, const kt_data *data, size_t g, kt_rows rows, kt_group_work *w) {
    assert(g < model->n.group && (unsigned)rows < KT_ROWS_COUNT);
    const kt_group *group = &model->group[g];
    kt_real1 *base = data->dense + group->dense;
    const size_t *at = group->at;
    w->m = group->v_count;
    w->k = group->count[rows];
    w->pivot = data->pivot + group->row;
    w->weight =
        group->rank[rows] < group->count[rows] ? model->weight + (size_t)rows * model->n.row + group->row : NULL;
    w->unit = group->balanced ? model->unit + group->v : NULL;
    w->least = group->least[rows];
    w->tolerance = group->tolerance[rows];
#define KT_GROUP_FIND(name, count, meaning) w->name = base + *at++;
    KT_GROUP_FIELDS(KT_GROUP_FIND)
#undef KT_GROUP_FIND
}
KT_INLINE kt_group_work kt_group_matrices(const kt_model *model, const kt_data *data, size_t g, kt_rows rows) {
    kt_group_work w;
    kt_group_find(model, data, g, rows, &w);
    return w;
}

/* Second purposes of arrays whose first contents are no longer needed. After the elimination, the arrays contain the
 * accelerations (m), and the forces on the coordinates from which multipliers are computed (m). Without multipliers,
 * the arrays contain the sums A x (k). If the method has no reflectors (lib/study/compare), the arrays contain the
 * singular values (s). For a pin, the arrays contain p / D (3) and the null vector n (m). */
KT_INLINE kt_real1 *kt_group_accelerations(const kt_group_work *w) { return w->gain; }
KT_INLINE kt_real1 *kt_group_forces(const kt_group_work *w) { return w->half; }
KT_INLINE kt_real1 *kt_front_forces(const kt_group_work *w) { return w->free; }
KT_INLINE kt_real1 *kt_group_products(const kt_group_work *w) { return w->multiplier; }
KT_INLINE kt_real1 *kt_group_singular_values(const kt_group_work *w) { return w->reflector_scale; }
KT_INLINE kt_real1 *kt_pin_momentum(const kt_group_work *w) { return w->coupling; }
KT_INLINE kt_real1 *kt_pin_null_vector(const kt_group_work *w) { return w->basis; }

#define KT_GROUP_COUNT(name, count, meaning) +1
_Static_assert(0 KT_GROUP_FIELDS(KT_GROUP_COUNT) <= KT_GROUP_MATRICES,
               "a group has room for the places of its matrices");
#undef KT_GROUP_COUNT

/* Copies numbers of a group's first `count` slots to the order of all equations, which is the order of the loops; or
 * back. */
void kt_rows_scatter(const kt_model *model, const kt_group *group, int count, const double *slots, double *equations);
void kt_rows_gather(const kt_model *model, const kt_group *group, int count, const double *equations, double *slots);

#ifndef KT_LANES

/* Whether one equation locks the one joint of a group. */
static inline bool kt_group_is_locked(const kt_model *model, const kt_group *group) {
    return group->ranges && group->v_count == 1 && group->count[KT_ROWS_ALL] == 1 && group->rank[KT_ROWS_ALL] == 1 &&
           group->loop_count == 1 && model->loop[model->group_loop[group->loop]].term_count == 1;
}

/* Returns a bound of the entries of an equation, over its scale, for a group that is reduced by fronts: its wrenches'
 * components. The coordinates change by a radian or by the mechanism's length. */
static inline double kt_front_reach(const kt_model *model, bool planar, const kt_group_work *w, int r) {
    const int all = planar ? KT_FRONT_SPACE / 2 : KT_FRONT_SPACE, angular = planar ? 1 : 3;
    double most = 0.0;
    for (int end = 0; end < 2; end++) {
        const double *x = w->wrench + (size_t)(2 * r + end) * KT_FRONT_SPACE;
        for (int c = 0; c < all; c++)
            most = fmax(most, fabs(x[c]) * (c < angular ? 1.0 : model->length));
    }
    return most / w->scale[r];
}

#endif

/* The largest violations of the equations. */
typedef struct kt_violation {
    kt_real1 position; /* m or rad, over holonomic equations */
    kt_real1 gap;      /* the largest residual relative to its scale: decides about closure */
    kt_real1 velocity; /* m/s or rad/s */
    kt_real1 slip;     /* the largest residual relative to its scale */
    kt_real1 speed;    /* the largest term in it, or KT_SPEED_LEAST: `slip` is relative to this */
} kt_violation;

/* Speeds, relative to their units (a radian, the mechanism's length), that count as rest, because they move nothing
 * during any time that a simulation could span. Without this floor the remainder of a velocity that the loops forbid
 * falls by 1e-16 with each projection. The remainder would reach 5e-324 and be compared with a bound that underflows to
 * zero.
 */
#define KT_SPEED_LEAST 1e-100

#ifndef KT_LANES
static const kt_violation kt_violation_none = {.speed = KT_SPEED_LEAST};
#endif

/* Adds phi of a group to the violation. A NaN appears in `position` alone, which callers test for finite numbers. */
static inline void kt_group_position_residuals(const kt_group_work *w, kt_violation *violation) {
    for (int r = 0; r < w->k; r++) {
        const kt_real1 x = kt_abs1(w->residual[r]);
        violation->gap = kt_most1(violation->gap, x / w->scale[r]);
        violation->position = KT_CHOOSE((x > violation->position) | (x != x), x, violation->position);
    }
}

/* If a direction is smaller than this fraction of its usual size, the position is near a singular position:
 * accelerations are interpolated from neighbouring states (singular_crossing.c). */
#define KT_NEAR_SINGULAR 1e-2

/* The weight of an equation that was chosen at compilation: only an equation that is 16 times longer replaces the
 * chosen equation. */
#define KT_PREFERRED 16.0

/* Lays out the matrices of a group; returns their number of doubles. */
size_t kt_group_layout(kt_group *group);

#endif
