/* Frontal elimination of a constraint group (Irons 1970), for groups of many loops. The cost grows with the number of
 * loops, not with its cube.
 *
 * The front is the part of the group that the links taken so far form, with the group's parent at rest. Links are taken
 * parents first (compile/front_order.c). The motions of the front are x = x0 + X p with parameters p. The later links
 * bound the number of parameters, because only parameters that later links can distinguish remain. A link i is active
 * as long as one of these links or an incomplete loop depends on it. Then a slot holds its acceleration (alpha, a)_i =
 * T_i p + t_i. A step has three parts:
 *
 *   takes a link        T_i = [shift(T_parent) S_i], its coordinates x_i being new parameters. The energy
 *                       V(p) = p'H p / 2 - g'p of the front (Gauss' principle) receives T_i' IA_i T_i and the forces.
 *
 *   completes loops     D p = e, where D = W (T_b - T_a): with D' Pi = Q [R1; 0], as for dense matrices,
 *                       p = Q (y, p2), R1' y = e: the parameters are p2 from here on.
 *
 *   keeps coupled ones with T' = Q [R; 0] of all active links, the last parameters of Q'p are free: no later link or
 * loop depends on them. The values of free parameters minimise the energy, p_u = H_uu^-1 (g_u - H_ut p_t).
 *                       If they are few, Q is replaced by as few reflectors that separate the same spaces.
 *
 * After the last link nothing is kept, and a backward pass through the steps yields x. If the parent accelerates, the
 * components A of its acceleration are parameters that are always kept, and V(A) contains the parent's inertia and bias
 * wrench.
 *
 * An equation can be small at a step although its usual size is not small. If a later step completes redundant
 * equations, such an equation becomes a delayed row. The row's slot holds D and the constant part like T and t. The
 * later step may determine the same motion far better. An example are three wheels joined by three rods, with one wheel
 * at its dead centre.
 *
 * All changes of parameters are orthogonal, so the equations of the loops are those of the dense reduction times
 * orthogonal factors. The rank of a loop's equations refers to the motions that close all earlier loops. Only the
 * energy, T and t pass from step to step. Therefore the factors that depend on the equations alone serve for several
 * right-hand sides and metrics.
 *
 * Dynamics, planar or in space: the components of accelerations are (alpha, a), three or six.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_FRONT_H
#define KT_REDUCTION_FRONT_H

#include "constraint/group.h"

/* kt_front_fill calls kt_rows_fill, or if `planar` kt_planar_rows_fill.
 *
 * kt_front_apply writes A x for x (nv) into out (k), and if size is not NULL, the largest term of each sum.
 *
 * In lanes (algebra/real3.h), groups are in the form of Delassus, and no coordinate counts as a constant. */
#define KT_FRONT_EQUATIONS_DECLARE(isa)                                                                                \
    void kt_front_fill_##isa(const kt_model *model, kt_data *data, size_t g, bool planar, bool moving,                 \
                             const kt_real1 *q, const kt_real1 *v, kt_real1 t);                                        \
    void kt_front_apply_##isa(const kt_model *model, kt_data *data, size_t g, kt_rows rows, const kt_real1 *x,         \
                              kt_real1 *out, kt_real1 *size);
KT_EACH_KERNEL(KT_FRONT_EQUATIONS_DECLARE)

#ifndef KT_LANES

#include "reduction/front_lanes.h"

/* The function that is minimised. KT_FRONT_DYNAMICS: the energy of the accelerations, with joint forces tau.
 * KT_FRONT_COORDINATES: the sum of the squares of the coordinates. KT_FRONT_DAMPED: the sum of the squares of the
 * equations' violations, plus a damping times the sum of the squares of the coordinates in their units. */
typedef struct kt_front_aim {
    enum { KT_FRONT_DYNAMICS, KT_FRONT_COORDINATES, KT_FRONT_DAMPED } kind;
    const double *tau; /* dynamics: joint forces (nv) */
    const double *gap; /* damped: violations of the equations (k) */
    double damping;    /* damped */
    bool base;         /* dynamics: the parent accelerates */
    double **kept;     /* dynamics: where kkt.h keeps factors of the energy, moved on past them; or NULL */
} kt_front_aim;

/* The wrench that the parent has to exert for its acceleration (alpha, a): inertia (alpha, a) + bias, column-major. */
typedef struct kt_front_total {
    double inertia[KT_FRONT_SPACE * KT_FRONT_SPACE], bias[KT_FRONT_SPACE];
} kt_front_total;

/* kt_front_factor factors the equations. Returns the rank, or -1 if a number is not finite. Sets data->last and near.
 *
 * kt_front_measure computes the factors of a damped problem, without eliminating any equation. Returns the sum of the
 * squares of the equations' entries D over their scales.
 *
 * kt_front_reduce eliminates. Returns false if a degree of freedom has no inertia.
 *
 * kt_front_respond writes the solution for an acceleration of the parent (NULL: none) into step (nv), only of the
 * group's coordinates.
 *
 * kt_front_multipliers finds lambda (k), in space, after a reduction with dynamics. This lambda belongs to the
 * accelerations a (nv) of coordinates and to the accelerations of links in data->motion.
 *
 * kt_front_multipliers_of finds lambda (k) with A' lambda = the joint forces in the group's `free`, for the equations
 * as last factored.
 *
 * kt_front_nullspace writes the column-th vector of a basis of the null space into x (nv), only of the group's
 * coordinates.
 */
#define KT_FRONT_DECLARE(isa)                                                                                          \
    int kt_front_factor_##isa(const kt_model *model, kt_data *data, size_t g, kt_rows rows, bool regular);             \
    double kt_front_measure_##isa(const kt_model *model, kt_data *data, size_t g, kt_rows rows);                       \
    bool kt_front_reduce_##isa(const kt_model *model, kt_data *data, size_t g, const kt_front_aim *aim,                \
                               kt_front_total *total);                                                                 \
    void kt_front_respond_##isa(const kt_model *model, kt_data *data, size_t g, const double *base, double *step);     \
    void kt_front_multipliers_##isa(const kt_model *model, kt_data *data, size_t g, const double *a, double *lambda);  \
    void kt_front_multipliers_of_##isa(const kt_model *model, kt_data *data, size_t g, double *lambda);                \
    void kt_front_nullspace_##isa(const kt_model *model, kt_data *data, size_t g, int column, double *x);
KT_EACH_ISA(KT_FRONT_DECLARE)

#endif

/* ---- a group's arrays -------------------------------------------------------------------------------------------- */

/* The active front of a group. The results of a step for the substitution back stay with the step (kt_front_factor).
 * All steps share the arrays below. The energy is a function of the acceleration A of the parent, whose components come
 * first, and of the parameters p: (A, p)' H (A, p) / 2 - g' (A, p). Lanes have only the members that the equations
 * need. */
typedef struct kt_front {
    const kt_model *model;
    kt_data *data;
    const kt_group *group;
    const kt_front_plan *plan;
    const kt_front_step *step; /* the links and loops that each step takes and completes, one step a link */
#ifndef KT_LANES
    kt_front_count *count;          /* how many parameters and equations each step turned out to have */
    const kt_front_count *delaying; /* the step whose delayed equations are in slots, or NULL */
    const bool *fixed;              /* coordinates that count as constants; NULL: none */
    int32_t *active, active_count;  /* holders of slots in use: links', then relations', then delayed equations' */
#endif
    kt_group_work w;             /* right-hand sides, scales, wrenches and multipliers of the group's equations */
    int components;              /* components of an acceleration: 3 or 6 */
    int width, stride;           /* from one vector to the next: in slots, in H */
    kt_real1 *link_acceleration; /* T': the acceleration in a slot for each parameter, a vector a component */
    kt_real1 *constant;          /* t: its constant part, a number a component; in multipliers, the wrench on the
                                  * link */
    kt_real1 *copy;              /* the vectors of T' that are not zero, while coupled parameters are found */
    kt_real1 *speed;             /* the largest angular and linear speed of a slot's link, for sizes of terms */
    kt_real1 *energy, *pull;     /* H by columns, and g */
    kt_real1 *size;              /* size of the terms of H's diagonal: a pivot not above their rounding is no inertia */
    kt_real1 *z;                 /* (A, p) while substituting back; scales of reflectors; in multipliers c */
    kt_real1 *spare;             /* a reflector in full, or the right-hand sides of the equations of a step */
    kt_real1 *product;           /* H times a reflector; the links' T with A in front */
    double **kept;               /* the pointer `kept` of kt_front_aim */
} kt_front;

/* Whether a coordinate of the group counts as a constant. */
KT_INLINE bool kt_front_is_fixed(const kt_front *f, int32_t local) {
#ifndef KT_LANES
    return f->fixed && f->fixed[local];
#else
    (void)f, (void)local;
    return false;
#endif
}

/* Finds the arrays of a group for the equations `rows`. compile/front_order.c counts their numbers (shared_count). */
static inline void kt_front_find(const kt_model *model, kt_data *data, size_t g, kt_rows rows, kt_front *f) {
    const kt_group *group = &model->group[g];
    const kt_front_plan *plan = &group->front;
#ifndef KT_LANES
    const bool planar = data->front_planar[g]; /* the planar kernels have filled the group's equations */
#else
    const bool planar = model->sweep != KT_SWEEP_SPATIAL && group->planar;
#endif
    *f = (kt_front){.model = model,
                    .data = data,
                    .group = group,
                    .plan = plan,
                    .step = model->front + plan->step,
#ifndef KT_LANES
                    .count = data->front + plan->step,
                    .fixed = data->front_fixed + group->v,
                    .active = data->front_active,
#endif
                    .components = planar ? KT_FRONT_SPACE / 2 : KT_FRONT_SPACE,
                    .width = plan->width,
                    .stride = plan->stride};
    f->w = kt_group_matrices(model, data, g, rows);
    const size_t stride = (size_t)plan->stride;
    kt_real1 *at = f->w.front + plan->shared;
    f->link_acceleration = at, at += plan->vectors * (size_t)plan->width;
    f->constant = at, at += plan->vectors;
    f->copy = at, at += (size_t)plan->width * (size_t)plan->width;
    f->speed = at, at += 2 * (size_t)plan->slots;
    f->energy = at, at += stride * stride;
    f->pull = at, at += stride;
    f->size = at, at += stride;
    f->z = at, at += stride;
    f->spare = at, at += stride;
    f->product = at;
}

#ifndef KT_LANES

/* The results that a step keeps for the backward pass, with lengths from its counts. The order of results is that in
 * which the counts are found. */
typedef struct kt_front_factor {
    double *motion;           /* T_i', a vector of `params` a component */
    double *rows, *scale, *y; /* D', rows of `params`, factored; reflectors; y */
    double *early;            /* the first `rank` entries of Q' T', a vector */
    double *force;            /* the forces of its equations on y (multipliers) */
    double *coupled,
        *coupled_scale; /* reflectors Q' that part p_t, which is kept, from p_u: vectors of `left`, padded */
    double *free;       /* p_u = free - gain (A, p_t): */
    double *gain;       /* rows of components + kept, padded */
} kt_front_factor;

/* Finds the results of step s, which lie behind each other in the order of kt_front_factor. */
static inline void kt_front_factor_find(const kt_front *f, int s, kt_front_factor *x) {
    const kt_front_count *c = &f->count[s];
    const size_t n = (size_t)c->params, k = (size_t)c->rows, v = (size_t)c->vectors, base = KT_FRONT_SPACE;
    const size_t reflectors = (size_t)c->reflectors, left = (size_t)kt_front_padded(c->left);
    double *at = f->w.front + f->step[s].at;
    x->motion = at, at += base * n;
    x->rows = at, at += k * n;
    x->scale = at, at += k;
    x->y = at, at += k;
    x->early = at, at += k * v;
    x->force = at, at += k;
    x->coupled = at, at += reflectors * left;
    x->coupled_scale = at, at += reflectors;
    x->free = at, at += c->left - c->kept;
    x->gain = at;
}

#endif

/* The index of a holder of a slot. For a link, the index is the link's step; for a relation, the number of links plus
 * the relation's index; for the d-th delayed equation, the number of links and relations plus d. */
static inline int32_t kt_front_delayed(const kt_front *f, int d) {
    return f->group->link_count + f->plan->relations + d;
}

/* The first vector in the slot of a holder. */
static inline size_t kt_front_place(const kt_front *f, int32_t holder) {
    const int32_t links = f->group->link_count;
    return holder < links ? KT_FRONT_SPACE * (size_t)f->step[holder].slot
                          : KT_FRONT_SPACE * (size_t)f->plan->slots + (size_t)(holder - links);
}
static inline kt_real1 *kt_front_vector(const kt_front *f, int32_t holder) {
    return f->link_acceleration + kt_front_place(f, holder) * (size_t)f->width;
}
static inline kt_real1 *kt_front_constant(const kt_front *f, int32_t holder) {
    return f->constant + kt_front_place(f, holder);
}
static inline int kt_front_vector_count(const kt_front *f, int32_t holder) {
    return holder < f->group->link_count ? f->components : 1;
}

#ifndef KT_LANES

/* The holders of slots in use, in ascending order. */
static inline void kt_front_enter(kt_front *f, int32_t holder) {
    int32_t i = f->active_count++;
    for (; i > 0 && f->active[i - 1] > holder; i--)
        f->active[i] = f->active[i - 1];
    f->active[i] = holder;
}
static inline void kt_front_release(kt_front *f, int32_t holder) {
    int32_t i = 0;
    while (i < f->active_count && f->active[i] != holder)
        i++;
    for (f->active_count--; i < f->active_count; i++)
        f->active[i] = f->active[i + 1];
}

#endif

/* Whether the equation of a slot is among the equations to be solved. */
static inline bool kt_front_counts(const kt_front *f, int32_t slot) { return slot >= 0 && slot < f->w.k; }

/* The wrench of a unit multiplier on the link of an end, about its origin. */
static inline kt_real1 *kt_front_wrench(const kt_front *f, int32_t slot, int end) {
    return f->w.wrench + (size_t)(2 * slot + end) * KT_FRONT_SPACE;
}

/* The step of a link, or -1 for the group's parent. */
static inline int32_t kt_front_step_of(const kt_front *f, int32_t link) {
    return link == f->group->parent ? -1 : f->model->front_step[f->group->v + f->model->link[link].local];
}

#endif
