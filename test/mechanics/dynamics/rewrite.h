/* A second description of a random mechanism, made body by body from the first. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_DYNAMICS_REWRITE_H
#define KT_TEST_DYNAMICS_REWRITE_H

#include "oracle.h"

/* Starts an empty description with the first one's gravity. Names are those of `tree`, which must live longer. */
void kt_rewrite_begin(kt_tree *out, const kt_tree *tree);

/* Adds a massless body, named by its place, on `parent`. */
kt_body *kt_rewrite_helper(kt_tree *out, const char *parent, kt_joint_type type, kt_vec3 axis);

/* Adds a body as it is. */
kt_body *kt_rewrite_copy(kt_tree *out, const kt_body *body);

/* The same state: coordinates unchanged, external wrenches by name. */
void kt_rewrite_state(const kt_tree *tree, const kt_tree_state *s, const kt_tree *other, kt_tree_state *out);

#endif
