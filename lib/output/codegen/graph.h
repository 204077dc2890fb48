/* The graph of a generated file: one node for each operation.
 *
 * A node is a constant, a parameter, an input of a function, or an operation on one to three earlier nodes. Equal nodes
 * exist once. Operations on constants are evaluated at once, and x + 0, 1 x, 0 x and -(-x) are simplified. A negative
 * sign moves outwards: a - b and b - a are one node and its negation. Unused nodes are never printed.
 *
 * The order in which nodes are made decides the generated text. C leaves open in which order a call evaluates its
 * arguments. So at most one argument of a call makes nodes (test/house/sequence.py).
 *
 * Nodes whose origin is KT_OP_OF_PARAMETERS depend on parameters alone. All functions share these nodes, which
 * NAME_prepare computes once. Nodes of KT_OP_OF_STATE belong to one function (`scope`).
 *
 * If memory is insufficient, `failed` is set, and all results are without meaning. All arrays of nodes that a function
 * is made of are in the graph's pool, and live as long as the graph.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CODEGEN_GRAPH_H
#define KT_CODEGEN_GRAPH_H

#include "base/pool.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The index of a node. */
typedef int32_t kt_op;

typedef enum kt_op_kind {
    KT_OP_CONSTANT, /* value */
    KT_OP_PARAMETER,
    KT_OP_INPUT, /* a: which array; b: which number of it */
    KT_OP_ADD,
    KT_OP_SUBTRACT,
    KT_OP_MULTIPLY,
    KT_OP_DIVIDE,
    KT_OP_NEGATE,
    KT_OP_CALL,  /* c: a function of KT_OP_FUNCTION_LIST; b: -1 if it has one argument */
    KT_OP_CHOOSE /* a > 0 ? b : c */
} kt_op_kind;

/* Functions of the C library: X(id, name) */
#define KT_OP_FUNCTION_LIST(X)                                                                                         \
    X(SIN, sin)                                                                                                        \
    X(COS, cos)                                                                                                        \
    X(TAN, tan)                                                                                                        \
    X(ASIN, asin)                                                                                                      \
    X(ACOS, acos)                                                                                                      \
    X(ATAN, atan)                                                                                                      \
    X(SINH, sinh)                                                                                                      \
    X(COSH, cosh)                                                                                                      \
    X(TANH, tanh)                                                                                                      \
    X(EXP, exp)                                                                                                        \
    X(LOG, log)                                                                                                        \
    X(SQRT, sqrt)                                                                                                      \
    X(ABS, fabs)                                                                                                       \
    X(FLOOR, floor)                                                                                                    \
    X(ATAN2, atan2)                                                                                                    \
    X(HYPOT, hypot)                                                                                                    \
    X(POWER, pow)

typedef enum kt_op_function {
#define KT_OP_FUNCTION_ID(id, name) KT_OP_##id,
    KT_OP_FUNCTION_LIST(KT_OP_FUNCTION_ID)
#undef KT_OP_FUNCTION_ID
} kt_op_function;

enum { KT_OP_OF_NUMBERS = 0, KT_OP_OF_PARAMETERS = 1, KT_OP_OF_STATE = 2 }; /* levels */

/* The arrays that a function reads, and the time. KT_OP_HELD is replaced by other nodes (kt_graph_replace). */
typedef enum kt_op_array {
    KT_OP_POSITION,
    KT_OP_RATE,
    KT_OP_GIVEN,
    KT_OP_SINE,
    KT_OP_COSINE,
    KT_OP_OWN_STATE,
    KT_OP_TIME,
    KT_OP_HELD
} kt_op_array;

enum { KT_OP_NAME = 16 };

typedef struct kt_op_node {
    uint8_t kind, origin;
    int16_t scope;
    int32_t a, b, c;
    int32_t section; /* the block in which it was made first */
    int32_t next;    /* in its chain of the table */
    double value;
    char name[KT_OP_NAME]; /* empty: it has none */
} kt_op_node;

/* A block of nodes. */
typedef struct kt_op_section {
    char *text;         /* comment at the section's head */
    int32_t pass, step; /* kt_graph_pass; step: -1: none */
} kt_op_section;

typedef struct kt_graph {
    kt_pool pool;
    kt_op_node *node;
    int32_t count;
    size_t room;
    int32_t *table; /* first nodes of chains; a power of two */
    int32_t table_size;
    kt_op_section *section;
    int32_t section_count, pass, step, step_count;
    size_t section_room;
    int16_t scope;
    bool keeps_signs; /* at the ends of steps, so that steps are alike; elsewhere, signs move outwards */
    bool is_nameless; /* new nodes have no names, because the function has others of these names */
    bool failed;
} kt_graph;

/* Begins an empty graph; kt_graph_free releases its memory. */
void kt_graph_init(kt_graph *g);
void kt_graph_free(kt_graph *g);

/* Takes `count` pieces of `size` bytes, zeroed, which the graph releases. Returns NULL, and sets `failed`, if memory is
 * insufficient. After a failure, all calls return NULL. */
void *kt_graph_take(kt_graph *g, size_t count, size_t size);

/* Begins a block: its nodes are printed behind this comment. */
void kt_graph_section(kt_graph *g, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* The first call begins a pass, whose steps may repeat the same operations with other operands (roll.c). Each later
 * call begins a step of the pass, to which the next blocks belong. After the last step, kt_graph_pass ends the pass. */
void kt_graph_pass(kt_graph *g);
void kt_graph_step(kt_graph *g);

kt_op kt_op_number(kt_graph *g, double value);
kt_op kt_op_parameter(kt_graph *g, int index);
kt_op kt_op_input(kt_graph *g, kt_op_array array, int index);
kt_op kt_op_add(kt_graph *g, kt_op a, kt_op b);
kt_op kt_op_subtract(kt_graph *g, kt_op a, kt_op b);
kt_op kt_op_multiply(kt_graph *g, kt_op a, kt_op b);
kt_op kt_op_divide(kt_graph *g, kt_op a, kt_op b);
/* a + 0, which is not simplified: an opaque number. Numbers that are made opaque in equal order have equal order. */
kt_op kt_op_opaque(kt_graph *g, kt_op a);
kt_op kt_op_negate(kt_graph *g, kt_op a);
kt_op kt_op_scale(kt_graph *g, double s, kt_op a);
/* a b + c d, and a b - c d */
kt_op kt_op_add_products(kt_graph *g, kt_op a, kt_op b, kt_op c, kt_op d);
kt_op kt_op_subtract_products(kt_graph *g, kt_op a, kt_op b, kt_op c, kt_op d);
/* b: -1 for functions of one argument. */
kt_op kt_op_call(kt_graph *g, kt_op_function function, kt_op a, kt_op b);
/* condition > 0 ? chosen : other; both are computed. */
kt_op kt_op_choose(kt_graph *g, kt_op condition, kt_op chosen, kt_op other);
/* x > y ? chosen : other */
static inline kt_op kt_op_choose_above(kt_graph *g, kt_op x, kt_op y, kt_op chosen, kt_op other) {
    return kt_op_choose(g, kt_op_subtract(g, x, y), chosen, other);
}

/* Writes the nodes that a node is computed from, and returns how many. */
int kt_op_operands(const kt_op_node *n, kt_op operand[3]);

/* The name of a function in C. */
const char *kt_op_function_name(kt_op_function function);

/* Whether a node is this constant. */
static inline bool kt_op_is_constant(const kt_graph *g, kt_op a) { return g->node[a].kind == KT_OP_CONSTANT; }
static inline bool kt_op_is(const kt_graph *g, kt_op a, double value) {
    return g->node[a].kind == KT_OP_CONSTANT && g->node[a].value == value;
}

/* Names the variable of a node. The first name stays; leaves and signs have none. */
void kt_op_name(kt_graph *g, kt_op a, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* Replaces a b + a c by a (b + c) if both products have no other use. Writes the new outputs over the old ones. */
void kt_graph_factor(kt_graph *g, kt_op *out, int count);

/* Replaces the inputs KT_OP_HELD by nodes of the same function. Writes the new outputs over the old ones. */
void kt_graph_replace(kt_graph *g, kt_op *out, int count, const kt_op *value);

/* The numbers of operations of a function, without signs and without NAME_prepare. */
typedef struct kt_op_counts {
    int multiply, add, divide, call, choose;
} kt_op_counts;
kt_op_counts kt_graph_count(const kt_graph *g, const kt_op *out, int count);

/* The approximate time of a function, in units of an addition that waits for another addition. The time is the longest
 * dependent path through the function, or an eighth of all operations if that is more, because a processor executes
 * some operations at the same time. */
int kt_graph_time(const kt_graph *g, const kt_op *out, int count);

/* Marks all nodes that the outputs need: uses[i] is how often node i is used, 0 if not at all. */
void kt_graph_uses(const kt_graph *g, const kt_op *out, int count, int32_t *uses);

#endif
