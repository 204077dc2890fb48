/* Random trees for the functions of control.h, and the derivative in time of functions of positions. It is computed by
 * differences of order eight along q (+) t v, whose joint rates are v throughout. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_CONTROL_ALONG_H
#define KT_TEST_CONTROL_ALONG_H

#include "mechanics/dynamics/oracle.h"
#include "mechanics/dynamics/tree.h"

#include "kinetree/control.h"

/* A tree of every joint type; every third one planar, in part or as a whole. */
void along_grow(kt_tree *tree, int n, kt_random *random, kt_tree_state *state);

/* Some numbers (count) at positions q; false fails the test. */
typedef bool along_function(const kt_tree *tree, const double *q, const double *v, double *out);

enum { ALONG_MOST = KT_TREE_NV * KT_TREE_NV };

/* Their derivatives. The error is some 1e-13 to 1e-11 of the largest. Its source is a rounding of 1e-14 over the step.
 */
bool along_differentiate(const kt_tree *tree, const kt_tree_state *s, along_function *f, int count, double *rate);

#endif
