/* Random trees with loops that close in one state. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_CODEGEN_CLOSED_TREE_H
#define KT_TEST_CODEGEN_CLOSED_TREE_H

#include "mechanics/dynamics/tree.h"

enum { KT_CLOSED_LOOPS = 2, KT_CLOSED_TYPES = 22 };

/* The time of all states. */
#define KT_CLOSED_NOW 0.3

/* The types of the first loop, in turn. */
extern const kt_loop_type kt_closed_types[KT_CLOSED_TYPES];

typedef struct kt_closed_tree {
    kt_tree tree;
    kt_loop loop[KT_CLOSED_LOOPS];
    kt_term term[KT_CLOSED_LOOPS][2];
    char formula[KT_CLOSED_LOOPS][160];
    kt_tree_state state;
    int form; /* of surfaces, curves and wheels, from 0; -1: drawn */
} kt_closed_tree;

/* Draws a tree whose first loop has the type kt_closed_types[n % KT_CLOSED_TYPES]. The first KT_CLOSED_TYPES of them
 * move in planes, the next ones in space, and so on. Returns false if no loop fits. */
bool kt_closed_grow(kt_closed_tree *c, kt_random *random, int n);

/* The same of a tree in space with one loop of a type that has forms. */
bool kt_closed_grow_form(kt_closed_tree *c, kt_random *random, kt_loop_type type, int form);

/* How many forms a type has: surfaces of four types; a line and a circle, whose arc length is free or given; wheels
 * that may leave their plane, and others. 0: the type has none. */
int kt_closed_count_forms(kt_loop_type type);

/* Whether a mechanism can move, is not rejected for redundant equations, and has a source of usual size. */
bool kt_closed_is_generated(const kt_model *model);

/* The smallest direction of m equations A a = b (column-major), in the metric M^-1. Each row has a part that is normal
 * to the rows before it. The direction is the least square of such a part over the square of its row. It is 1 if the
 * mass matrix is not definite, so that there is no metric. */
double kt_closed_least_direction(const kt_tree *tree, const kt_tree_state *s, const double *matrix, int m);

/* The largest of the accelerations a0 = M^-1 (tau - h) with the loops cut, and of a - a0 = M^-1 A' lambda. Both may be
 * larger than a. It is that of a if the mass matrix is not definite. */
double kt_closed_largest_part(const kt_tree *tree, const kt_tree_state *s, const double *a);

#endif
