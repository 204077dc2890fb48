/* Columns of the mass matrix, several at a time: the parts that crba.c and crba_planar.c share.
 *
 * This file numbers degrees of freedom in the order of the links, which is depth first. The degrees of freedom that a
 * link carries, including those of its joint, are [its first, link->end), and model->link_v has their velocity
 * coordinates. A *block* consists of as many consecutive degrees of freedom as a vector has lanes. The wrenches of
 * their unit accelerations are carried towards the ground together. The wrenches first pass through the links of the
 * block, of which each moves the lanes that it carries. Then the wrenches pass along the support of the block's first
 * degree of freedom. All other links that carry any of the lanes belong to this support.
 *
 * The lanes of a column of M lie side by side if velocity coordinates have the order of the links (model->ordered).
 * Otherwise, and in a block that is not full, the lanes are written one by one. Each lane is the same sum for any
 * width.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_CRBA_H
#define KT_DYNAMICS_CRBA_H

#include "dynamics/dynamics.h"

#include <string.h>

#if defined(__AVX512F__)
enum { KT_MASS_LANES = 8 };
#elif defined(__AVX__)
enum { KT_MASS_LANES = 4 };
#else
enum { KT_MASS_LANES = 2 };
#endif

typedef double kt_lanes __attribute__((vector_size(KT_MASS_LANES * sizeof(double))));
typedef int64_t kt_lane_mask __attribute__((vector_size(KT_MASS_LANES * sizeof(int64_t))));

KT_INLINE kt_lanes kt_lanes_load(const double *x) {
    kt_lanes v;
    memcpy(&v, x, sizeof v);
    return v;
}
KT_INLINE void kt_lanes_store(double *x, kt_lanes v) { memcpy(x, &v, sizeof v); }

/* The components of a vector in memory, to be multiplied by lanes: each number is loaded into all lanes at once. */
KT_INLINE const double *kt_v4_components(const kt_v4 *a) { return (const double *)(const void *)a; }

typedef struct kt_mass_block {
    double *mass;
    size_t nv;
    const int32_t *v;  /* velocity coordinates of the degrees of freedom */
    size_t first, end; /* the degrees of freedom of the block */
    bool ordered;      /* model->ordered */
    bool together;     /* the lanes lie side by side in M, and there are KT_MASS_LANES of them */
    double *rows;      /* then those of column 0 */
} kt_mass_block;

/* Returns the block that ends before degree of freedom `end`. v: the velocity coordinate of the first of all. */
KT_INLINE kt_mass_block kt_mass_block_before(const kt_model *model, const int32_t *v, size_t end, double *mass) {
    const size_t first = end > KT_MASS_LANES ? end - KT_MASS_LANES : 0;
    return (kt_mass_block){.mass = mass,
                           .nv = model->n.v,
                           .v = v,
                           .first = first,
                           .end = end,
                           .ordered = model->ordered,
                           .together = model->ordered && end - first == KT_MASS_LANES,
                           .rows = mass + v[first]};
}

/* Zeros in the columns of a link below the degrees of freedom that it carries: rows from `end` on. */
KT_INLINE void kt_mass_block_clear(const kt_mass_block *b, size_t v, size_t dofs, size_t end) {
    const size_t row = (size_t)b->v[0] + end;
    for (size_t k = v; b->ordered && row < b->nv && k < v + dofs; k++)
        memset(b->mass + k * b->nv + row, 0, (b->nv - row) * sizeof *b->mass);
}

/* The part of a link in a block: the link carries the degrees of freedom [own, end) of the block. */
typedef struct kt_mass_part {
    const kt_mass_block *block;
    bool together, whole; /* block->together, as a constant; the link carries all of them */
    size_t own, end;
    kt_lane_mask on; /* the lanes of these */
} kt_mass_part;

/* All lanes of a block. */
KT_INLINE kt_mass_part kt_mass_part_whole(const kt_mass_block *b, bool together) {
    return (kt_mass_part){.block = b, .together = together, .whole = true, .own = b->first, .end = b->end};
}

/* The part of a link that carries the degrees of freedom [own, end) of the tree, which may begin before the block and
 * end behind it. The table has the lane masks of all begins: zeros, then ones. */
KT_INLINE kt_mass_part kt_mass_part_make(const kt_mass_block *b, bool together, size_t own, size_t end) {
    static const int64_t on[2 * 8] = {[8] = -1, -1, -1, -1, -1, -1, -1, -1};
    kt_mass_part p = {.block = b, .together = together, .own = own > b->first ? own : b->first, .end = end};
    memcpy(&p.on, on + 8 - (p.own - b->first), sizeof p.on);
    if (end < b->first + KT_MASS_LANES) {
        kt_lane_mask after;
        memcpy(&after, on + 8 - (end - b->first), sizeof after);
        p.on &= ~after;
    }
    return p;
}

/* x in the lanes that the link carries, zero in the others. */
KT_INLINE kt_lanes kt_mass_part_of(const kt_mass_part *p, kt_lanes x) {
    return p->whole ? x : (kt_lanes)((kt_lane_mask)x & p->on);
}

/* Writes the lanes into column v; the lanes of degrees of freedom that the link does not carry become zero, or stay
 * unchanged. */
KT_INLINE void kt_mass_part_put(const kt_mass_part *p, size_t v, kt_lanes x) {
    const kt_mass_block *b = p->block;
    if (p->together) {
        kt_lanes_store(b->rows + v * b->nv, kt_mass_part_of(p, x));
        return;
    }
    double *column = b->mass + v * b->nv;
    double lane[KT_MASS_LANES];
    memcpy(lane, &x, sizeof lane);
    for (size_t k = p->own; k < p->end && k < b->end; k++)
        column[b->v[k]] = lane[k - b->first];
}

#endif
