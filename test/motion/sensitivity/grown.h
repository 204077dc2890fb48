/* Random trees with effects, at a random state. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SENSITIVITY_GROWN_H
#define KT_TEST_SENSITIVITY_GROWN_H

#include "mechanics/dynamics/tree.h"

/* Points into itself: not to be copied. */
typedef struct grown {
    kt_tree tree;
    kt_tree_state state;
    kt_effect effect[4];
} grown;

/* The n-th: every second one has effects between bodies, every third floats, every fourth moves in a plane. A failure
 * ends the test. */
void grown_make(grown *g, int n, kt_random *random);

#endif
