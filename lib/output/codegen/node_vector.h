/* Vectors, rotations and symmetric matrices of nodes (graph.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CODEGEN_NODE_VECTOR_H
#define KT_CODEGEN_NODE_VECTOR_H

#include "codegen/graph.h"

typedef struct kt_op3 {
    kt_op x[3];
} kt_op3;

/* A matrix, row by row. */
typedef struct kt_op33 {
    kt_op3 row[3];
} kt_op33;

/* A symmetric matrix: xx, yy, zz, xy, xz, yz. */
typedef struct kt_op6 {
    kt_op x[6];
} kt_op6;

kt_op3 kt_op3_zero(kt_graph *g);
kt_op3 kt_op3_of(kt_graph *g, const double v[3]);
kt_op3 kt_op3_add(kt_graph *g, kt_op3 a, kt_op3 b);
kt_op3 kt_op3_subtract(kt_graph *g, kt_op3 a, kt_op3 b);
kt_op3 kt_op3_scale(kt_graph *g, kt_op s, kt_op3 a);
/* s a + t b */
kt_op3 kt_op3_combine(kt_graph *g, kt_op s, kt_op3 a, kt_op t, kt_op3 b);
kt_op3 kt_op3_cross(kt_graph *g, kt_op3 a, kt_op3 b);
kt_op kt_op3_dot(kt_graph *g, kt_op3 a, kt_op3 b);
/* a . b + c . d */
kt_op kt_op3_add_dots(kt_graph *g, kt_op3 a, kt_op3 b, kt_op3 c, kt_op3 d);
kt_op kt_op3_length(kt_graph *g, kt_op3 a);
/* Names the variables of a vector: `name`, the number, and x, y or z. */
void kt_op3_name(kt_graph *g, kt_op3 a, const char *name, int number);

kt_op33 kt_op33_of(kt_graph *g, const double m[3][3]);
kt_op33 kt_op33_multiply(kt_graph *g, const kt_op33 *a, const kt_op33 *b);
kt_op3 kt_op33_apply(kt_graph *g, const kt_op33 *m, kt_op3 a);
kt_op33 kt_op33_transpose(const kt_op33 *m);
kt_op3 kt_op33_apply_transposed(kt_graph *g, const kt_op33 *m, kt_op3 a);
/* R H R' */
kt_op33 kt_op33_rotate(kt_graph *g, const kt_op33 *r, const kt_op33 *h);
/* The rotation of a quaternion of any norm but zero. */
kt_op33 kt_op33_of_quaternion(kt_graph *g, const kt_op q[4]);

kt_op6 kt_op6_zero(kt_graph *g);
kt_op6 kt_op6_add(kt_graph *g, const kt_op6 *a, const kt_op6 *b);
kt_op3 kt_op6_apply(kt_graph *g, const kt_op6 *j, kt_op3 a);
/* The entry of a row and a column. */
kt_op kt_op6_at(const kt_op6 *j, int row, int column);
int kt_op6_index(int row, int column);
/* R J R' */
kt_op6 kt_op6_rotate(kt_graph *g, const kt_op33 *r, const kt_op6 *j);
/* 2 (a . b) 1 - a b' - b a' */
kt_op6 kt_op6_inertia_of(kt_graph *g, kt_op3 a, kt_op3 b);

#endif
