/* The recursions over a tree, as nodes (recursion.c). Outputs have kt_model_nv entries, unless stated otherwise. */
#ifndef KT_CODEGEN_RECURSION_H
#define KT_CODEGEN_RECURSION_H

#include "codegen/tree.h"

/* tau = M a + h for the accelerations KT_OP_GIVEN; or h alone. */
void kt_code_inverse(kt_code_tree *tree, bool has_acceleration, kt_op *tau);

/* The mass matrix, nv x nv, column by column, both triangles. */
void kt_code_mass(kt_code_tree *tree, kt_op *mass);

/* A condition without which a function returns the number of a body: pivot > limit. */
typedef struct kt_code_guard {
    kt_op pivot, limit;
    int body;
} kt_code_guard;

/* a = M^-1 (tau - h) for the forces KT_OP_GIVEN. work: nv x nv. One guard for each coordinate. */
void kt_code_forward(kt_code_tree *tree, kt_op *work, kt_op *a, kt_code_guard *guard);

/* Kinetic energy and potential energy of gravity. */
void kt_code_energy(kt_code_tree *tree, kt_op energy[2]);

/* Positions and velocities of all markers in world axes: first three numbers for each position,
 * then three for each velocity. */
void kt_code_markers(kt_code_tree *tree, kt_op *out);

#endif
