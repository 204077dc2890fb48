/* The equations of loops as nodes (loops.c), and the multipliers that follow from these equations (multiplier.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CODEGEN_LOOPS_H
#define KT_CODEGEN_LOOPS_H

#include "codegen/recursion.h"

/* The independent equations of all loops at a state. */
typedef struct kt_code_loop_rows {
    int count;
    int *loop;       /* loop of each equation */
    kt_op *a;        /* A, row by row, with nv entries each */
    kt_op *phi;      /* residuals */
    kt_op *scaled;   /* residuals over their scales, a radian or the mechanism's length */
    kt_op *rate;     /* A v = rate: those of functions of time */
    kt_op *right;    /* A a = right */
    bool *is_closed; /* the equation has a residual; without, phi is 0 */
    int *block;      /* for each equation: the first one with which it is compared (multiplier.c) */
    kt_op *size;     /* count x nv: squares of the entries that A would have if they lay along its direction; or 0 */
} kt_code_loop_rows;

/* Why the effect whose constraint a loop is cannot be generated: friction that sticks, a hard stop or a hard contact.
 * NULL: no effect owns the loop. Such an effect changes the equations of all loops, so that the message names the
 * effect as the cause of their faults. */
const char *kt_code_switched_fault(const kt_model *model, int loop);

/* Why the equations of a loop cannot be generated; NULL: these can be generated. */
const char *kt_code_loop_fault(const kt_model *model, int loop);

/* Why a projection of positions of a loop cannot be generated; NULL: it can be. */
const char *kt_code_projection_fault(const kt_model *model, int loop);

/* Whether the type of a loop can be generated, with its functions. */
bool kt_code_has_loop_type(const kt_model *model, int loop);

/* How many equations a loop has in a generated file. Equations that repeat others are left out, as in the compiled
 * model. */
int kt_code_rows_of_loop(const kt_model *model, int loop);

/* The number of equations of a loop that have a residual, and therefore belong to the projection of positions. */
int kt_code_closed_rows_of_loop(const kt_model *model, int loop);

/* Whether the equations of loops depend on time. */
bool kt_code_loops_have_time(const kt_model *model);

/* How many equations the loops of a model have in a generated file, and how many of these equations have a residual. */
int kt_code_count_loop_rows(const kt_model *model);
int kt_code_count_closed_rows(const kt_model *model);

/* Reads the numbers of all loops once, since their parameters exist once. Returns false if memory is insufficient. */
bool kt_code_read_loops(kt_code_tree *tree);

/* Makes all equations. `moves`: the right-hand sides, too. */
void kt_code_make_loop_rows(kt_code_tree *tree, bool moves, kt_code_loop_rows *rows);

/* Adds all that the equations of loops fold to a hash. */
void kt_code_hash_loops(const kt_model *model, kt_code_hash *hash, uint64_t *h);

/* phi, then A (column by column), then the right-hand side. out: count (nv + 2). */
void kt_code_loop_equations(kt_code_tree *tree, kt_op *out);

/* The accelerations of a closed state for the forces KT_OP_GIVEN. work: nv x nv. Guards: one for each coordinate, and
 * one for each equation. */
void kt_code_forward_loops(kt_code_tree *tree, kt_op *work, kt_op *a, kt_code_guard *guard);

/* The derivatives of forward dynamics with loops by q, v and tau: out has 3 nv nv entries. The guards equal those of
 * the function. */
void kt_code_forward_loop_derivatives(kt_code_tree *tree, kt_op *work, kt_op *out, kt_code_guard *guard);

/* The least change of q that closes the linear equations, followed by the scaled residuals. Equations without a
 * residual are left out. Each equation has a guard; in the metric of the mass matrix, guards of the coordinates come
 * first. Returns the number of guards. */
int kt_code_close_positions(kt_code_tree *tree, kt_op *work, kt_op *out, kt_code_guard *guard);

/* The derivatives of q + step by q, for the step of kt_code_close_positions: out has nv nv entries. The guards are
 * those of kt_code_close_positions. */
int kt_code_close_changes(kt_code_tree *tree, kt_op *work, kt_op *out, kt_code_guard *guard);

/* The derivatives of the velocities of kt_code_settle_velocities by q and v: out has 2 nv nv entries. The guards are
 * those of kt_code_settle_velocities.
 */
void kt_code_settle_changes(kt_code_tree *tree, kt_op *work, kt_op *out, kt_code_guard *guard);

/* v without the part that the loops forbid, followed by the scaled residuals. The guards are those of forward
 * dynamics. */
void kt_code_settle_velocities(kt_code_tree *tree, kt_op *work, kt_op *out, kt_code_guard *guard);

#endif
