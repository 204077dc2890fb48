/* Sums of the slopes of stages, component by component, in the order of the terms. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_INTEGRATOR_STAGE_SUMS_H
#define KT_INTEGRATOR_STAGE_SUMS_H

#include "integrator/integrator.h"

/* Components per tile: a loop that compilers unroll into vector instructions. */
enum { TILE = 8 };

/* sum_j weight_j k_j for one tile. */
static inline void sum_tile(double sum[TILE], const kt_stage_term *terms, size_t count, double *const *k, size_t at) {
    for (int l = 0; l < TILE; l++)
        sum[l] = 0.0;
    for (size_t j = 0; j < count; j++) {
        const double weight = terms[j].weight;
        const double *kj = k[terms[j].slot] + at;
        for (int l = 0; l < TILE; l++)
            sum[l] += weight * kj[l];
    }
}

static inline double sum_one(const kt_stage_term *terms, size_t count, double *const *k, size_t at) {
    double sum = 0.0;
    for (size_t j = 0; j < count; j++)
        sum += terms[j].weight * k[terms[j].slot][at];
    return sum;
}

#endif
