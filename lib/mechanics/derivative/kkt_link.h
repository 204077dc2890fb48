/* The operations of a link that both kernels of kkt.h share. Accelerations (alpha, a) have three components if the
 * planar kernels treat the link, otherwise six. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DERIVATIVE_KKT_LINK_H
#define KT_DERIVATIVE_KKT_LINK_H

#include "derivative/kkt.h"
#include "reduction/front_link.h"

KT_INLINE int kt_kkt_components(const kt_model *model, size_t i) {
    return model->sweep != KT_SWEEP_SPATIAL && i >= model->n.spatial ? KT_FRONT_SPACE / 2 : KT_FRONT_SPACE;
}

/* From the parent's origin to the link's. */
KT_INLINE kt_v4 kt_kkt_offset(const kt_kkt *w, size_t i, int components) {
    if (components == KT_FRONT_SPACE)
        return w->data->motion[i].offset;
    const double *r = w->data->planar[(int32_t)i + w->model->to_planar].offset;
    return (kt_v4){r[0], r[1], 0.0, 0.0};
}

KT_INLINE const double *kt_kkt_axis(const kt_kkt *w, size_t i) {
    return w->axis + KT_FRONT_SPACE * (size_t)w->model->link[i].v;
}

/* The map of a step, whose numbers follow each other. */
typedef struct kt_kkt_map {
    double *back, *free, *close, *pull, *reach; /* (-G_A, G); N; W; H W; T W */
} kt_kkt_map;

/* Returns the end of the map of a step, which begins at `at`. */
KT_INLINE double *kt_kkt_map_find(const kt_front_count *c, int base, double *at, kt_kkt_map *map) {
    const size_t n = (size_t)c->params, rank = (size_t)c->rank;
    map->back = at, at += n * (size_t)(base + c->kept);
    map->free = at, at += n * (size_t)(c->left - c->kept);
    map->close = at, at += n * rank;
    map->pull = at, at += ((size_t)base + n) * rank;
    map->reach = at, at += (size_t)c->vectors * rank;
    return at;
}

/* Returns the end of the map of a group by dense matrices: `free`, `least_step` and `pull`. */
KT_INLINE double *kt_kkt_group_map_find(const kt_group_work *w, int rank, double *at, kt_kkt_map *map) {
    const size_t m = (size_t)w->m;
    map->free = at, at += m * (m - (size_t)rank);
    map->close = at, at += m * (size_t)w->k;
    map->pull = at;
    return at + m * (size_t)w->k;
}

#endif
