/* Two simulations of one scene: every set of contacts has its model in the first one, and is a mask in the second one
 * (lib/motion/contact/mask.h). Their motions are equal up to rounding. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_MASK_PAIR_H
#define KT_TEST_MASK_PAIR_H

#include "kinetree/scene.h"
#include "kinetree/simulation.h"

enum { MASK_PAIR = 2 };

typedef struct mask_pair {
    kt_scene scene;
    kt_simulation_options options;
    kt_model *model[MASK_PAIR]; /* whose parameters may be set */
    kt_simulation *simulation[MASK_PAIR];
} mask_pair;

/* Reads, compiles and starts. steps: by time stepping. Returns false after a failed check. */
bool mask_pair_make(mask_pair *pair, const char *text, bool steps);
void mask_pair_free(mask_pair *pair);

/* Replaces simulation k by a new one. */
kt_status mask_pair_renew(mask_pair *pair, int k, kt_error *error);

/* Lets both advance to a time. Returns false after a failed check. */
bool mask_pair_advance(const mask_pair *pair, double t);

/* The largest difference of positions, and `weight` times that of velocities, of two simulations of a model. */
double mask_difference(const kt_model *model, const kt_simulation *one, const kt_simulation *other, double weight);
double mask_pair_difference(const mask_pair *pair, double weight);

#endif
