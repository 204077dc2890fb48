/* Bodies and joints that form a graph, made into a tree with loops (joint_graph.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_PARTS_JOINT_GRAPH_H
#define KT_PARTS_JOINT_GRAPH_H

#include "base/inner.h"
#include "base/pool.h"
#include "kinetree/build.h"

/* A graph, and the bodies and loops that it becomes. */
typedef struct kt_graph {
    const kt_body *bodies;
    const bool *is_placed; /* for each body: the body keeps its parent and its joint */
    int body_count;
    const kt_graph_joint *joints;
    int joint_count;

    kt_body *tree; /* tree_count: the bodies, in the same order, then the massless bodies of joints */
    int tree_count;
    int *joint_body; /* for each joint: the index in `tree` of the body that has the joint; -1: a loop is closed */
    kt_loop *loops;  /* loop_count */
    int loop_count;
    int *loop_joint;          /* joint of each loop */
    kt_graph_choice *choices; /* choice for each joint */

    int joint_at_fault, body_at_fault; /* after KT_ERROR_MODEL; -1: another item is */
} kt_graph;

/* Makes the bodies and loops, in memory of the pool.
 * Errors: those of kt_builder_add_graph. */
KT_INNER KT_CHECKED kt_status kt_graph_make(kt_pool *pool, kt_graph *graph, kt_error *error);

#endif
