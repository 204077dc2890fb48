/* The maps of kkt.h of a group by fronts: the parts of an elimination that all right-hand sides share. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "derivative/kkt_link.h"
#include "linear/cholesky.h"
#include "linear/qr.h"

#include <string.h>

/* A step: its factors, its map, and its part of the numbers that kt_front_reduce has kept. */
typedef struct step {
    const kt_front_count *count;
    kt_front_factor x;
    kt_kkt_map map;
    const double *pulled, *lower; /* Q' H Q1 by columns of base + params; L; NULL with H = 1 */
    int base, params, rank, left, kept, free;
} step;

/* Finds the factors and the map of a step. `kept` and `map` move on to those of the next step. */
static void find_front_step(const kt_front *f, int s, int base, const double **kept, double **map, step *o) {
    const kt_front_count *c = &f->count[s];
    *o = (step){.count = c, .base = base, .params = c->params, .rank = c->rank, .left = c->left, .kept = c->kept};
    o->free = c->left - c->kept;
    kt_front_factor_find(f, s, &o->x);
    *map = kt_kkt_map_find(c, base, *map, &o->map);
    if (!*kept)
        return;
    o->pulled = *kept;
    *kept += (size_t)o->rank * (size_t)(base + o->params);
    o->lower = *kept;
    *kept += (size_t)o->free * (size_t)o->free;
}

/* Does the same as kt_front_reflect, for exactly n numbers. */
static void reflect(const double *u, double t, int n, double *x) {
    const double sum = t * kt_dense_dot(u, x, n);
    for (int i = 0; i < n; i++)
        x[i] -= sum * u[i];
}

/* The c-th column of C = Q2 Qs. */
static void set_front_column(const step *o, int c, double *column) {
    const int n = o->params;
    double *p = column + o->rank;
    memset(column, 0, (size_t)n * sizeof *column);
    p[c] = 1.0;
    for (int j = o->count->reflectors - 1; j >= 0; j--)
        reflect(o->x.coupled + j * kt_front_padded(o->left), o->x.coupled_scale[j], o->left, p);
    for (int j = o->rank - 1; j >= 0; j--)
        kt_reflect(o->x.rows + j * n, o->x.scale[j], j, n, column);
}

static void subtract_times(const double *from, double times, int n, double *to) {
    for (int i = 0; i < n; i++)
        to[i] -= times * from[i];
}

static void divide_vector(double *x, int n, double by) {
    for (int i = 0; i < n; i++)
        x[i] /= by;
}

/* G = C_t - C_u H_uu^-1 H_ut, -G_A = -C_u H_uu^-1 H_uA, and N: N L' = C_u. */
static void set_back(const step *o) {
    const int n = o->params, u = o->free;
    for (int c = 0; c < u; c++)
        set_front_column(o, o->kept + c, o->map.free + c * n);
    for (int c = 0; c < o->base + o->kept; c++) {
        double *to = o->map.back + c * n;
        if (c >= o->base)
            set_front_column(o, c - o->base, to);
        else
            memset(to, 0, (size_t)n * sizeof *to);
        for (int i = 0; i < u && o->lower; i++)
            subtract_times(o->map.free + i * n, o->x.gain[i * kt_front_padded(o->base + o->kept) + c], n, to);
    }
    for (int j = 0; j < u && o->lower; j++) {
        double *column = o->map.free + j * n;
        for (int i = 0; i < j; i++)
            subtract_times(o->map.free + i * n, o->lower[i * u + j], n, column);
        divide_vector(column, n, o->lower[j * (u + 1)]);
    }
}

/* Replaces X by X R1^-T; X has `rows` rows and is stored by columns. */
static void divide_columns(const step *o, int rows, double *x) {
    const int n = o->params;
    for (int i = o->rank - 1; i >= 0; i--) {
        for (int j = i + 1; j < o->rank; j++)
            subtract_times(x + j * rows, o->x.rows[j * n + i], rows, x + i * rows);
        divide_vector(x + i * rows, rows, o->x.rows[i * (n + 1)]);
    }
}

/* Sets W = Q1 R1^-T, H W and T W. With H = 1, G' W and N' W are zero, and H W counts as zero. */
static void set_close(const step *o) {
    const int n = o->params, all = o->base + n;
    memset(o->map.close, 0, (size_t)(n * o->rank) * sizeof(double));
    kt_copy_or_clear(o->map.pull, o->pulled, (size_t)(all * o->rank) * sizeof(double));
    for (int c = 0; c < o->rank; c++) {
        o->map.close[c * (n + 1)] = 1.0;
        for (int j = o->rank - 1; j >= 0; j--) {
            kt_reflect(o->x.rows + j * n, o->x.scale[j], j, n, o->map.close + c * n);
            kt_reflect(o->x.rows + j * n, o->x.scale[j], j, n, o->map.pull + c * all + o->base);
        }
    }
    divide_columns(o, n, o->map.close);
    divide_columns(o, all, o->map.pull);
    for (int v = 0; v < o->count->vectors; v++) {
        double *to = o->map.reach + v * o->rank;
        memcpy(to, o->x.early + v * o->rank, (size_t)o->rank * sizeof *to);
        divide_columns(o, 1, to);
    }
}

/* Sets the maps of all steps, from the numbers that kt_front_reduce has kept; NULL: with H = 1. */
static void set_maps(kt_kkt *w, const kt_front *f, int base, const double *kept) {
    double *map = w->map + w->mapped;
    for (int s = 0; s < f->group->link_count; s++) {
        step o;
        w->at[f->plan->step + s] = (size_t)(map - w->map);
        find_front_step(f, s, base, &kept, &map, &o);
        set_back(&o);
        set_close(&o);
    }
    w->mapped = (size_t)(map - w->map);
}

bool KT_KERNEL(kt_kkt_reduce_front)(kt_kkt *w, size_t g, double *parent) {
    double *past = w->kept;
    const kt_front_aim aim = {
        .kind = KT_FRONT_DYNAMICS, .tau = w->model->zero, .base = w->model->group[g].parent != 0, .kept = &past};
    kt_front_total total;
    kt_front f;
    const bool mass = w->metric == KT_METRIC_MASS;
    if (mass && !KT_KERNEL(kt_front_reduce)(w->model, w->data, g, &aim, &total))
        return false;
    kt_front_find(w->model, w->data, g, w->rows, &f);
    const int base = mass && aim.base ? f.components : 0;
    for (int c = 0; c < base * base; c++)
        parent[c] += total.inertia[c];
    set_maps(w, &f, base, mass ? w->kept : NULL);
    return true;
}
