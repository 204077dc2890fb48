/* Columns of kkt.h in progress, a column8 of them at a time, and the operations that both kernels for columns share. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DERIVATIVE_KKT_COLUMNS_H
#define KT_DERIVATIVE_KKT_COLUMNS_H

#include "derivative/kkt_link.h"

/* One number of each right-hand side. */
typedef double column8 __attribute__((vector_size(8 * KT_KKT_LANES)));

/* A strip in progress: the arrays of kt_kkt by the same names, and their owners. */
typedef struct columns {
    const kt_kkt *w;
    const kt_model *model;
    kt_data *data;
    column8 *motion, *x, *b, *constant, *pull, *z, *found, *force, *response;
} columns;

/* The arrays of w as columns of eight right-hand sides. */
static inline columns columns_of(const kt_kkt *w) {
    return (columns){.w = w,
                     .model = w->model,
                     .data = w->data,
                     .motion = (column8 *)(void *)w->motion,
                     .x = (column8 *)(void *)w->x,
                     .b = (column8 *)(void *)w->b,
                     .constant = (column8 *)(void *)w->constant,
                     .pull = (column8 *)(void *)w->pull,
                     .z = (column8 *)(void *)w->z,
                     .found = (column8 *)(void *)w->found,
                     .force = (column8 *)(void *)w->force,
                     .response = (column8 *)(void *)w->response};
}

KT_INLINE column8 splat(double x) { return (column8){x, x, x, x, x, x, x, x}; }

KT_INLINE column8 *motion_of(const columns *k, size_t i) { return k->motion + KT_FRONT_SPACE * i; }

KT_INLINE void clear(column8 *x, int n) {
    for (int i = 0; i < n; i++)
        x[i] = splat(0.0);
}

KT_INLINE column8 dot(const double *a, const column8 *x, int n) {
    column8 sum = splat(0.0);
    for (int i = 0; i < n; i++)
        sum += splat(a[i]) * x[i];
    return sum;
}

/* y += a x */
KT_INLINE void add(const double *a, column8 x, int n, column8 *y) {
    for (int i = 0; i < n; i++)
        y[i] += splat(a[i]) * x;
}

KT_SHIFTS(column8, _of8)

/* The acceleration A of the link's parent at the link's origin, with which the recursion of the link begins. */
KT_INLINE column8 *carried_motion(const columns *k, size_t i, int c) {
    column8 *a = motion_of(k, i);
    memcpy(a, motion_of(k, (size_t)k->model->link[i].parent), (size_t)c * sizeof *a);
    kt_motion_shift_of8(c, kt_kkt_offset(k->w, i, c), a);
    return a;
}

/* Adds the wrench on a link to the wrench on its parent, unless the parent is the ground. */
KT_INLINE void pass_wrench(const columns *k, size_t i, int c) {
    const size_t parent = (size_t)k->model->link[i].parent;
    column8 *p = motion_of(k, i), *up = motion_of(k, parent);
    if (!parent)
        return;
    kt_wrench_shift_of8(c, kt_kkt_offset(k->w, i, c), p);
    for (int j = 0; j < c; j++)
        up[j] += p[j];
}

/* Columns of n numbers into k->x, and back from lanes. */
static inline void gather_columns_by_lane(const columns *k, size_t n, int lanes, const double *x) {
    clear(k->x, (int)n);
    for (int lane = 0; lane < lanes; lane++)
        for (size_t i = 0; i < n; i++)
            k->x[i][lane] = x[(size_t)lane * n + i];
}

static inline void scatter_columns_by_lane(const column8 *from, size_t n, int lanes, double *x) {
    for (int lane = 0; lane < lanes; lane++)
        for (size_t i = 0; i < n; i++)
            x[(size_t)lane * n + i] = from[i][lane];
}

/* Calls a function for a link, with the number of components as a constant. */
typedef void link_pass(const columns *k, size_t i, int c);
KT_INLINE void pass_link(const columns *k, size_t i, link_pass *pass) {
    if (kt_kkt_components(k->model, i) == KT_FRONT_SPACE)
        pass(k, i, KT_FRONT_SPACE);
    else
        pass(k, i, KT_FRONT_SPACE / 2);
}

/* A group by fronts at one of its steps. */
typedef struct front {
    kt_front f;
    kt_kkt_map map; /* map of the step s */
    const kt_front_step *step;
    const kt_front_count *count;
    column8 *found; /* results of the step s */
    int s, base, components;
} front;

/* Components of the parent's acceleration that a group responds to. */
KT_INLINE int base_of(const columns *k, size_t g, int c) {
    return k->model->group[g].parent && k->w->metric == KT_METRIC_MASS ? c : 0;
}

KT_INLINE void begin_front(const columns *k, size_t g, int c, front *o) {
    kt_front_find(k->model, k->data, g, k->w->rows, &o->f);
    o->components = c;
    o->base = base_of(k, g, c);
}

KT_INLINE void begin_step(const columns *k, front *o, int s) {
    o->s = s;
    o->step = &o->f.step[s];
    o->count = &o->f.count[s];
    o->found = k->found + (size_t)(o->f.plan->step + s) * k->w->size.width;
    (void)kt_kkt_map_find(o->count, o->base, k->w->map + k->w->at[o->f.plan->step + s], &o->map);
}

#endif
