/* How a function becomes text: statements, parts and loops (text_parts.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CODEGEN_TEXT_PARTS_H
#define KT_CODEGEN_TEXT_PARTS_H

#include "codegen/print_function.h"

/* Arguments of a part, behind the arrays of kt_op_array. */
enum {
    CODE_PREPARED = KT_OP_TIME + 1,
    CODE_OUTPUT, /* the first of three */
    CODE_PLACES = CODE_OUTPUT + 3,
    CODE_ARGUMENTS,
    CODE_GUARDS = CODE_ARGUMENTS
};

/* Whether a node is not computed by the function that is printed: a number, an input, a prepared number. */
static inline bool kt_code_is_leaf(const kt_code_printer *p, kt_op i) {
    const kt_op_node *n = &p->graph->node[i];
    return n->kind < KT_OP_ADD || n->origin < p->origin;
}

/* Whether a function is divided. A loop is always a part, even if the whole function is this loop. */
static inline bool kt_code_has_parts(const kt_code_printer *p) { return p->part_count > 1 || p->roll.plan_count > 0; }

/* The node behind which a guard is printed; -1: before all. */
kt_op kt_code_guard_node(const kt_code_printer *p, const kt_code_guard *guard);

/* Counts the uses of nodes in a function. Returns false if memory is insufficient. */
bool kt_code_count_uses(kt_code_printer *p, const kt_code_function *f);

/* Finds the statements, loops and parts of a function whose uses are counted. Returns false if memory is
 * insufficient. */
bool kt_code_plan_parts(kt_code_printer *p, const kt_code_function *f);

/* Whether a part is so small that the call costs a noticeable share of its time. A compiler may inline such a part. */
bool kt_code_part_is_small(const kt_code_printer *p, int part);

/* The loop that computes a node; -1: none. */
static inline int kt_code_loop_of(const kt_code_printer *p, kt_op i) {
    return i >= 0 && p->roll.loop != NULL ? p->roll.loop[i] : -1;
}

/* Whether a loop writes a node to the outputs, and the next output of a node; -1: there is none. */
bool kt_code_is_written(const kt_code_printer *p, kt_op i);
int kt_code_next_output(const kt_code_function *f, kt_op i, int from);

/* The part that begins with a copy. Usually this part is the loop that reads the copy. If compilers turn the loop into
 * vectors, the copy goes to an earlier part in which its node is known. Columns of the reader itself hold copies alone.
 * Such copies stay with the loop, since their columns would otherwise occupy memory longer. */
int kt_code_part_of_copy(const kt_code_printer *p, const kt_code_copy *copy);

/* The place of a node in `w`. */
int kt_code_place(const kt_code_printer *p, kt_op i);

#endif
