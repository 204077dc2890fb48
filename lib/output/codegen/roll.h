/* Loops in place of repeated operations of a function (roll.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CODEGEN_ROLL_H
#define KT_CODEGEN_ROLL_H

#include "codegen/recursion.h"

enum { KT_ROLL_WIDE = 8 /* iterations: fewer ones do not fill a vector */ };

/* An operand of a loop that is not computed in the same iteration. */
typedef enum kt_code_slot_kind {
    KT_SLOT_SAME,     /* one node in all iterations */
    KT_SLOT_INPUT,    /* number `base` + `step` i of an array */
    KT_SLOT_PREPARED, /* number `base` of those that are prepared for the iteration */
    KT_SLOT_CARRIED,  /* node `base` of the iteration before; at first cell[0] */
    KT_SLOT_COLUMN    /* column `base` of the loop `loop`, in its row `step` i + `row` */
} kt_code_slot_kind;

typedef struct kt_code_slot {
    kt_code_slot_kind kind;
    int32_t base, step, loop, row;
    kt_op *cell; /* the node in each iteration */
} kt_code_slot;

/* Iterations are equal sequences of nodes. The second iteration is the pattern whose text is printed, because operands
 * of the first iteration may be equal by chance. A node that is read outside the loop has a column, with a row for each
 * iteration. Rows before the first and after the last iteration are copies of other nodes that the loop reads in the
 * same way. */
typedef struct kt_code_loop_plan {
    int32_t start, size, count; /* place of the first node in `order`; nodes of an iteration; iterations */
    kt_pool pool;               /* memory of the arrays below */
    kt_code_slot *slot;
    int32_t slot_count;
    size_t slot_room;
    int32_t *column;  /* column of each node of an iteration; -1: none */
    bool *is_written; /* whether it is written to the outputs at once */
    int32_t column_count, first_row, last_row;
    bool recurs;                   /* iterations wait for those before */
    bool is_wide;                  /* columns are contiguous, for vectors: of this loop, or of those that read them */
    int32_t place;                 /* place of the first row, in the array of places */
    int32_t first_part, last_part; /* parts that write or read rows: beyond them, the places are free */
    int32_t prepared;              /* the first prepared number */
    int32_t prepared_count;
} kt_code_loop_plan;

/* A copy of a node to a row of a column, before the loop `reader` begins. */
typedef struct kt_code_copy {
    int32_t loop, column, row, reader;
    kt_op node;
} kt_code_copy;

typedef struct kt_code_roll {
    kt_pool pool;
    kt_op *order; /* the nodes that the function computes */
    int32_t order_count;
    int32_t *at;   /* for each node: its place in `order`; -1: it is not computed */
    int32_t *loop; /* for each node: its loop; -1: none */
    kt_code_loop_plan *plan;
    int32_t plan_count;
    size_t plan_room;
    kt_code_copy *copy;
    int32_t copy_count;
    size_t copy_room;
    bool failed; /* memory was insufficient */
} kt_code_roll;

/* Finds the loops of a function; no loops if the function may not have any. Returns false, without memory to release,
 * if memory is insufficient. kt_code_roll_free may follow in any case. */
bool kt_code_roll_find(kt_code_roll *r, const kt_graph *g, const int32_t *uses, const kt_code_guard *guard,
                       int guard_count, bool may_roll);
void kt_code_roll_free(kt_code_roll *r);

/* Node `local` of an iteration. */
static inline kt_op kt_code_roll_node(const kt_code_roll *r, const kt_code_loop_plan *l, int iteration, int local) {
    return r->order[l->start + iteration * l->size + local];
}

/* The iteration to which a node of a loop belongs, and the number of the node within the iteration. */
static inline int kt_code_roll_iteration(const kt_code_roll *r, kt_op i) {
    const kt_code_loop_plan *l = &r->plan[r->loop[i]];
    return (r->at[i] - l->start) / l->size;
}
static inline int kt_code_roll_local(const kt_code_roll *r, kt_op i) {
    const kt_code_loop_plan *l = &r->plan[r->loop[i]];
    return (r->at[i] - l->start) % l->size;
}

/* Whether a node has no column, and stays in the variable that the last iteration of its loop carries. Then other nodes
 * read this variable only after the loop. */
bool kt_code_roll_is_left(const kt_code_roll *r, kt_op i);

/* Returns the column of a node of a loop, and makes this column if necessary. */
int kt_code_roll_column(kt_code_roll *r, kt_op i);

/* The place of a row of a column, once all columns are known. */
static inline int kt_code_roll_place(const kt_code_loop_plan *l, int column, int row) {
    const int at = row - l->first_row, rows = l->last_row - l->first_row + 1;
    return l->place + (l->is_wide ? column * rows + at : at * l->column_count + column);
}

/* The distance of rows in a column. */
static inline int kt_code_roll_stride(const kt_code_loop_plan *l) { return l->is_wide ? 1 : l->column_count; }

/* The index of a prepared number, and the distance to the next prepared number. */
static inline int kt_code_roll_prepared(const kt_code_loop_plan *l, int number, int iteration) {
    const bool is_wide = l->count >= KT_ROLL_WIDE;
    return l->prepared + (is_wide ? number * l->count + iteration : iteration * l->prepared_count + number);
}
static inline int kt_code_roll_prepared_stride(const kt_code_loop_plan *l) {
    return l->count >= KT_ROLL_WIDE ? 1 : l->prepared_count;
}

#endif
