/* The recursions over trees, compiled for several states at once (algebra/real3.h), and their workspace.
 *
 * Numbers of a group of `width` states lie coordinate by coordinate: x[coordinate * width + lane]. What is computed for a
 * lane has the bits of the same state computed alone, whatever the other lanes hold.
 */
#ifndef KT_BATCH_LANES_H
#define KT_BATCH_LANES_H

#include "base/isa.h"
#include "kinetree/model.h"

#include <stddef.h>
#include <stdint.h>

/* Lanes are bits of masks. */
typedef uint32_t kt_lane_mask;

typedef struct kt_lane_kernels {
    size_t width;
    /* Bytes of the workspace; if memory is not NULL, it is initialised there, at a multiple of KT_ARENA_ALIGNMENT. */
    size_t (*layout)(const kt_model *model, void *memory);
    /* Forward dynamics of the tree: a. external (6 numbers a body, moment and force, or NULL) lies as the others do.
     * Returns the lanes whose accelerations are finite and no joint of which is without inertia; the others' mean
     * nothing. */
    kt_lane_mask (*forward)(const kt_model *model, void *work, const double *q, const double *v, const double *tau,
                            const double *external, double *a);
    /* Inverse dynamics of the tree: tau. Returns the lanes whose forces are finite. */
    kt_lane_mask (*inverse)(const kt_model *model, void *work, const double *q, const double *v, const double *a,
                            const double *external, double *tau);
} kt_lane_kernels;

extern const kt_lane_kernels kt_lane_kernels_baseline, kt_lane_kernels_v3, kt_lane_kernels_v4;

#endif
