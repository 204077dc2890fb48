/* Nodes and their simplification. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/graph.h"

#include "base/grow.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KT_GRAPH_TABLE = 1 << 14, KT_SECTION_LENGTH = 400 };

void kt_graph_init(kt_graph *g) {
    *g = (kt_graph){.table_size = KT_GRAPH_TABLE, .step = -1};
    g->table = malloc(KT_GRAPH_TABLE * sizeof *g->table);
    g->failed = g->table == NULL;
    for (int32_t i = 0; i < KT_GRAPH_TABLE && !g->failed; i++)
        g->table[i] = -1;
}

void kt_graph_free(kt_graph *g) {
    kt_pool_free(g->pool.chunks);
    free(g->section);
    free(g->table);
    free(g->node);
    *g = (kt_graph){.failed = true};
}

void *kt_graph_take(kt_graph *g, size_t count, size_t size) {
    void *piece = g->failed ? NULL : kt_pool_take(&g->pool, count, size);
    g->failed |= piece == NULL;
    return piece;
}

void kt_graph_section(kt_graph *g, const char *format, ...) {
    char text[KT_SECTION_LENGTH];
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    kt_op_section *larger =
        g->failed ? NULL : kt_heap_grow(g->section, (size_t)g->section_count, 1, &g->section_room, sizeof *g->section);
    char *copy = length >= 0 ? kt_pool_text(&g->pool, text, strlen(text)) : NULL;
    if (larger != NULL)
        g->section = larger;
    if (larger == NULL || copy == NULL) {
        g->failed = true;
        return;
    }
    g->section[g->section_count++] = (kt_op_section){copy, g->pass, g->step};
}

void kt_graph_pass(kt_graph *g) {
    g->pass++;
    g->step = -1;
}

void kt_graph_step(kt_graph *g) { g->step = g->step_count++; }

/* ---- the table --------------------------------------------------------------------------------------------------- */

static uint64_t bits_of_value(const kt_op_node *n) {
    uint64_t bits;
    memcpy(&bits, &n->value, sizeof bits);
    return bits;
}

static uint32_t hash_node(const kt_op_node *n) {
    uint64_t h = bits_of_value(n) * 0x9e3779b97f4a7c15u;
    h ^= ((uint64_t)(uint32_t)n->a << 32 | (uint32_t)n->b) * 0xc2b2ae3d27d4eb4fu;
    h ^= ((uint64_t)(uint32_t)n->c << 32 | (uint64_t)n->kind << 16 | (uint16_t)n->scope) * 0x165667b19e3779f9u;
    h ^= h >> 29;
    h *= 0xbf58476d1ce4e5b9u;
    return (uint32_t)(h >> 32);
}

static void enlarge_table(kt_graph *g) {
    const int32_t size = 4 * g->table_size;
    int32_t *table = malloc((size_t)size * sizeof *table);
    if (table == NULL) {
        g->failed = true;
        return;
    }
    for (int32_t i = 0; i < size; i++)
        table[i] = -1;
    for (int32_t i = 0; i < g->count; i++) {
        const uint32_t at = hash_node(&g->node[i]) & (uint32_t)(size - 1);
        g->node[i].next = table[at];
        table[at] = i;
    }
    free(g->table);
    g->table = table;
    g->table_size = size;
}

/* Returns the node that equals n, and adds n if no such node exists. */
static kt_op find_node(kt_graph *g, kt_op_node n) {
    if (g->failed)
        return 0;
    n.scope = n.origin == KT_OP_OF_STATE ? g->scope : 0;
    n.section = g->section_count - 1;
    const uint32_t hash = hash_node(&n);
    for (int32_t i = g->table[hash & (uint32_t)(g->table_size - 1)]; i >= 0; i = g->node[i].next) {
        const kt_op_node *o = &g->node[i];
        if (o->kind == n.kind && o->a == n.a && o->b == n.b && o->c == n.c && o->scope == n.scope &&
            bits_of_value(o) == bits_of_value(&n))
            return i;
    }
    kt_op_node *larger = kt_heap_grow(g->node, (size_t)g->count, 1, &g->room, sizeof *g->node);
    if (larger == NULL) {
        g->failed = true;
        return 0;
    }
    g->node = larger;
    int32_t *first = &g->table[hash & (uint32_t)(g->table_size - 1)];
    n.next = *first;
    *first = g->count;
    g->node[g->count++] = n;
    if (g->count > g->table_size)
        enlarge_table(g);
    return g->count - 1;
}

int kt_op_operands(const kt_op_node *n, kt_op operand[3]) {
    const kt_op all[3] = {n->a, n->b, n->c};
    const int count = n->kind < KT_OP_ADD ? 0 : n->kind == KT_OP_CHOOSE ? 3 : n->b >= 0 ? 2 : 1;
    memcpy(operand, all, sizeof all);
    return count;
}

/* An operation that is not simplified. The origin of the operation is the highest of its operands'. */
static kt_op find_general(kt_graph *g, kt_op_node n) {
    kt_op operand[3];
    if (g->failed)
        return 0;
    for (int k = kt_op_operands(&n, operand) - 1; k >= 0; k--)
        if (g->node[operand[k]].origin > n.origin)
            n.origin = g->node[operand[k]].origin;
    return find_node(g, n);
}

/* An operation on one node (b < 0) or two, not simplified. */
static kt_op find_operation(kt_graph *g, kt_op_kind kind, kt_op a, kt_op b) {
    return find_general(g, (kt_op_node){.kind = (uint8_t)kind, .a = a, .b = b});
}

/* ---- leaves and operations --------------------------------------------------------------------------------------- */

kt_op kt_op_number(kt_graph *g, double value) {
    return find_node(g, (kt_op_node){.kind = KT_OP_CONSTANT, .a = -1, .b = -1, .value = value == 0.0 ? 0.0 : value});
}

kt_op kt_op_parameter(kt_graph *g, int index) {
    return find_node(g, (kt_op_node){.kind = KT_OP_PARAMETER, .origin = KT_OP_OF_PARAMETERS, .a = index, .b = -1});
}

kt_op kt_op_input(kt_graph *g, kt_op_array array, int index) {
    return find_node(g, (kt_op_node){.kind = KT_OP_INPUT, .origin = KT_OP_OF_STATE, .a = (int32_t)array, .b = index});
}

static int32_t step_of_section(const kt_graph *g, int32_t section) {
    return section >= 0 ? g->section[section].step : -1;
}

/* Whether a node is a negation that may be moved outwards. If the code of all steps is to be alike (keeps_signs),
 * the negation of an earlier step stays where it is. */
static bool is_free_sign(const kt_graph *g, kt_op a) {
    const kt_op_node *n = &g->node[a];
    if (n->kind != KT_OP_NEGATE)
        return false;
    return !g->keeps_signs || n->origin != KT_OP_OF_STATE || g->node[n->a].kind == KT_OP_INPUT ||
           step_of_section(g, n->section) == step_of_section(g, g->section_count - 1);
}

kt_op kt_op_negate(kt_graph *g, kt_op a) {
    if (g->failed)
        return 0;
    if (kt_op_is_constant(g, a))
        return kt_op_number(g, -g->node[a].value);
    return is_free_sign(g, a) ? g->node[a].a : find_operation(g, KT_OP_NEGATE, a, -1);
}

kt_op kt_op_opaque(kt_graph *g, kt_op a) {
    return kt_op_is_constant(g, a) ? a : find_operation(g, KT_OP_ADD, a, kt_op_number(g, 0.0));
}

/* Replaces a node by its absolute part, and returns whether it had a negative sign. */
static bool take_sign(kt_graph *g, kt_op *a) {
    const kt_op_node *n = &g->node[*a];
    const bool minus = is_free_sign(g, *a) || (n->kind == KT_OP_CONSTANT && n->value < 0.0);
    if (minus)
        *a = kt_op_negate(g, *a);
    return minus;
}

/* a + b, or a - b if `minus`. */
static kt_op add_signed(kt_graph *g, kt_op a, kt_op b, bool minus) {
    if (g->failed)
        return 0;
    if (kt_op_is_constant(g, a) && kt_op_is_constant(g, b))
        return kt_op_number(g, g->node[a].value + (minus ? -1.0 : 1.0) * g->node[b].value);
    if (kt_op_is(g, a, 0.0))
        return minus ? kt_op_negate(g, b) : b;
    if (kt_op_is(g, b, 0.0))
        return a;
    const bool first = take_sign(g, &a), second = take_sign(g, &b) != minus;
    if (a == b)
        return first != second ? kt_op_number(g, 0.0) : kt_op_scale(g, first ? -2.0 : 2.0, a);
    if (first == second) {
        const kt_op sum = find_operation(g, KT_OP_ADD, a < b ? a : b, a < b ? b : a);
        return first ? kt_op_negate(g, sum) : sum;
    }
    const kt_op plus = first ? b : a, less = first ? a : b;
    return plus < less ? find_operation(g, KT_OP_SUBTRACT, plus, less)
                       : kt_op_negate(g, find_operation(g, KT_OP_SUBTRACT, less, plus));
}

kt_op kt_op_add(kt_graph *g, kt_op a, kt_op b) { return add_signed(g, a, b, false); }
kt_op kt_op_subtract(kt_graph *g, kt_op a, kt_op b) { return add_signed(g, a, b, true); }

/* Folds numbers, and moves signs to the product. Otherwise the smaller index is the first factor, so that a b and b a
 * are one node. */
kt_op kt_op_multiply(kt_graph *g, kt_op a, kt_op b) {
    if (g->failed)
        return 0;
    if (kt_op_is_constant(g, b)) {
        const kt_op swap = a;
        a = b;
        b = swap;
    }
    if (kt_op_is_constant(g, a)) {
        const double value = g->node[a].value;
        const kt_op_node n = g->node[b];
        if (kt_op_is_constant(g, b))
            return kt_op_number(g, value * n.value);
        if (value == 0.0)
            return a;
        if (value == 1.0 || value == -1.0)
            return value == 1.0 ? b : kt_op_negate(g, b);
        if (n.kind == KT_OP_MULTIPLY && kt_op_is_constant(g, n.a))
            return kt_op_scale(g, value * g->node[n.a].value, n.b);
    }
    const bool first = take_sign(g, &a), minus = take_sign(g, &b) != first;
    const bool keep = kt_op_is_constant(g, a) || a < b;
    const kt_op product = find_operation(g, KT_OP_MULTIPLY, keep ? a : b, keep ? b : a);
    return minus ? kt_op_negate(g, product) : product;
}

kt_op kt_op_scale(kt_graph *g, double s, kt_op a) { return kt_op_multiply(g, kt_op_number(g, s), a); }

kt_op kt_op_add_products(kt_graph *g, kt_op a, kt_op b, kt_op c, kt_op d) {
    const kt_op second = kt_op_multiply(g, c, d);
    return kt_op_add(g, kt_op_multiply(g, a, b), second);
}

kt_op kt_op_subtract_products(kt_graph *g, kt_op a, kt_op b, kt_op c, kt_op d) {
    const kt_op second = kt_op_multiply(g, c, d);
    return kt_op_subtract(g, kt_op_multiply(g, a, b), second);
}

kt_op kt_op_divide(kt_graph *g, kt_op a, kt_op b) {
    if (g->failed || kt_op_is(g, a, 0.0))
        return a;
    if (kt_op_is_constant(g, a) && kt_op_is_constant(g, b))
        return kt_op_number(g, g->node[a].value / g->node[b].value);
    const bool first = take_sign(g, &a), minus = take_sign(g, &b) != first;
    const kt_op quotient = find_operation(g, KT_OP_DIVIDE, a, b);
    return minus ? kt_op_negate(g, quotient) : quotient;
}

static double call_function(kt_op_function function, double a, double b) {
    switch (function) {
    case KT_OP_ATAN2:
        return atan2(a, b);
    case KT_OP_HYPOT:
        return hypot(a, b);
    case KT_OP_POWER:
        return pow(a, b);
    default: {
        static double (*const call[])(double) = {sin,  cos,  tan, asin, acos, atan, sinh,
                                                 cosh, tanh, exp, log,  sqrt, fabs, floor};
        return call[function](a);
    }
    }
}

const char *kt_op_function_name(kt_op_function function) {
    static const char *const name[] = {
#define KT_OP_FUNCTION_NAME(id, name) #name,
        KT_OP_FUNCTION_LIST(KT_OP_FUNCTION_NAME)
#undef KT_OP_FUNCTION_NAME
    };
    return name[function];
}

kt_op kt_op_call(kt_graph *g, kt_op_function function, kt_op a, kt_op b) {
    if (g->failed)
        return 0;
    if (kt_op_is_constant(g, a) && (b < 0 || kt_op_is_constant(g, b)))
        return kt_op_number(g, call_function(function, g->node[a].value, b < 0 ? 0.0 : g->node[b].value));
    if (function == KT_OP_ABS || function == KT_OP_COS || function == KT_OP_COSH)
        (void)take_sign(g, &a);
    return find_general(g, (kt_op_node){.kind = KT_OP_CALL, .a = a, .b = b, .c = (int32_t)function});
}

kt_op kt_op_choose(kt_graph *g, kt_op condition, kt_op chosen, kt_op other) {
    if (g->failed || chosen == other)
        return chosen;
    if (kt_op_is_constant(g, condition))
        return g->node[condition].value > 0.0 ? chosen : other;
    return find_general(g, (kt_op_node){.kind = KT_OP_CHOOSE, .a = condition, .b = chosen, .c = other});
}

void kt_op_name(kt_graph *g, kt_op a, const char *format, ...) {
    if (g->failed || g->is_nameless)
        return;
    kt_op_node *n = &g->node[g->node[a].kind == KT_OP_NEGATE ? g->node[a].a : a];
    if (n->origin != KT_OP_OF_STATE || n->kind == KT_OP_INPUT || n->name[0] != '\0' || n->scope != g->scope)
        return;
    va_list arguments;
    va_start(arguments, format);
    if (vsnprintf(n->name, sizeof n->name, format, arguments) >= (int)sizeof n->name)
        n->name[0] = '\0';
    va_end(arguments);
}

/* ---- passes ------------------------------------------------------------------------------------------------------ */

void kt_graph_uses(const kt_graph *g, const kt_op *out, int count, int32_t *uses) {
    memset(uses, 0, (size_t)g->count * sizeof *uses);
    for (int i = 0; i < count; i++)
        uses[out[i]]++;
    for (int32_t i = g->count - 1; i >= 0; i--) {
        kt_op operand[3];
        for (int k = uses[i] > 0 ? kt_op_operands(&g->node[i], operand) - 1 : -1; k >= 0; k--)
            uses[operand[k]]++;
    }
}

/* Returns the replacement of a node, given the replacements of its operands. */
static kt_op copy_node(kt_graph *g, kt_op i, const kt_op *moved) {
    const kt_op_node n = g->node[i];
    switch ((kt_op_kind)n.kind) {
    case KT_OP_ADD:
        return kt_op_add(g, moved[n.a], moved[n.b]);
    case KT_OP_SUBTRACT:
        return kt_op_subtract(g, moved[n.a], moved[n.b]);
    case KT_OP_MULTIPLY:
        return kt_op_multiply(g, moved[n.a], moved[n.b]);
    case KT_OP_DIVIDE:
        return kt_op_divide(g, moved[n.a], moved[n.b]);
    case KT_OP_NEGATE:
        return kt_op_negate(g, moved[n.a]);
    case KT_OP_CALL:
        return kt_op_call(g, (kt_op_function)n.c, moved[n.a], n.b >= 0 ? moved[n.b] : -1);
    case KT_OP_CHOOSE:
        return kt_op_choose(g, moved[n.a], moved[n.b], moved[n.c]);
    case KT_OP_INPUT:
        return kt_op_input(g, (kt_op_array)n.a, n.b);
    case KT_OP_CONSTANT:
    case KT_OP_PARAMETER:
        break;
    }
    return i;
}

/* The input of a pass over the nodes: the number of uses of each node, the node that has replaced it, and the caller's
 * nodes. */
typedef struct graph_pass {
    const int32_t *uses;
    const kt_op *moved, *value;
} graph_pass;

/* Returns the replacement of node i. */
typedef kt_op graph_rewrite(kt_graph *g, kt_op i, const graph_pass *pass);

/* Rewrites all nodes of a function that the outputs need, operands first. Blocks and names stay. */
static void rewrite_nodes(kt_graph *g, kt_op *out, int count, graph_rewrite *rewrite, const kt_op *value) {
    const int32_t before = g->count, section_count = g->section_count;
    kt_pool room = {.chunks = NULL};
    int32_t *uses = kt_pool_take(&room, (size_t)before + 1, sizeof *uses);
    kt_op *moved = kt_pool_take(&room, (size_t)before + 1, sizeof *moved);
    const graph_pass pass = {.uses = uses, .moved = moved, .value = value};
    g->failed |= uses == NULL || moved == NULL;
    if (!g->failed)
        kt_graph_uses(g, out, count, uses);
    for (int32_t i = 0; i < before && !g->failed; i++) {
        moved[i] = i;
        if (uses[i] == 0 || g->node[i].origin != KT_OP_OF_STATE)
            continue;
        const kt_op_node old = g->node[i];
        g->section_count = old.section + 1; /* new nodes are of the old one's block */
        moved[i] = rewrite(g, i, &pass);
        if (old.name[0] != '\0')
            kt_op_name(g, moved[i], "%s", old.name);
    }
    g->section_count = section_count;
    for (int i = 0; i < count && !g->failed; i++)
        out[i] = moved[out[i]];
    kt_pool_free(room.chunks);
}

/* The sum or difference of two products with a common factor becomes one product. */
static kt_op factor_node(kt_graph *g, kt_op i, const graph_pass *pass) {
    const kt_op_node n = g->node[i];
    const kt_op *moved = pass->moved;
    if ((n.kind != KT_OP_ADD && n.kind != KT_OP_SUBTRACT) || pass->uses[n.a] != 1 || pass->uses[n.b] != 1)
        return copy_node(g, i, moved);
    const kt_op_node x = g->node[n.a], y = g->node[n.b];
    if (x.kind != KT_OP_MULTIPLY || y.kind != KT_OP_MULTIPLY)
        return copy_node(g, i, moved);
    const kt_op common = x.a == y.a || x.a == y.b ? x.a : x.b == y.a || x.b == y.b ? x.b : -1;
    if (common < 0)
        return copy_node(g, i, moved);
    const kt_op p = moved[x.a == common ? x.b : x.a], q = moved[y.a == common ? y.b : y.a];
    return kt_op_multiply(g, moved[common], n.kind == KT_OP_ADD ? kt_op_add(g, p, q) : kt_op_subtract(g, p, q));
}

void kt_graph_factor(kt_graph *g, kt_op *out, int count) {
    g->scope++;
    rewrite_nodes(g, out, count, factor_node, NULL);
}

static kt_op replace_node(kt_graph *g, kt_op i, const graph_pass *pass) {
    const kt_op_node *n = &g->node[i];
    return n->kind == KT_OP_INPUT && n->a == KT_OP_HELD ? pass->value[n->b] : copy_node(g, i, pass->moved);
}

void kt_graph_replace(kt_graph *g, kt_op *out, int count, const kt_op *value) {
    rewrite_nodes(g, out, count, replace_node, value);
}

kt_op_counts kt_graph_count(const kt_graph *g, const kt_op *out, int count) {
    kt_op_counts c = {0};
    int32_t *uses = g->failed ? NULL : malloc((size_t)(g->count + 1) * sizeof *uses);
    if (uses == NULL)
        return c;
    kt_graph_uses(g, out, count, uses);
    for (int32_t i = 0; i < g->count; i++) {
        const kt_op_node *n = &g->node[i];
        if (uses[i] == 0 || n->origin != KT_OP_OF_STATE || n->kind < KT_OP_ADD || n->kind == KT_OP_NEGATE)
            continue;
        int *const counter[] = {[KT_OP_ADD] = &c.add,       [KT_OP_SUBTRACT] = &c.add, [KT_OP_MULTIPLY] = &c.multiply,
                                [KT_OP_DIVIDE] = &c.divide, [KT_OP_CALL] = &c.call,    [KT_OP_CHOOSE] = &c.choose};
        *counter[n->kind] += 1;
    }
    free(uses);
    return c;
}

/* A sum takes about four cycles, in which a processor begins eight others. A division takes as long as four sums, and a
 * function of the C library as ten. */
enum { OPERATIONS_AT_A_TIME = 8, DIVISION_IN_SUMS = 4, CALL_IN_SUMS = 10 };

/* The longest way to each node. Returns the longest of all. */
static int find_depths(const kt_graph *g, const int32_t *uses, int32_t *depth) {
    int most = 0;
    for (int32_t i = 0; i < g->count; i++) {
        const kt_op_node *n = &g->node[i];
        kt_op operand[3];
        depth[i] = 0;
        if (uses[i] == 0 || n->origin != KT_OP_OF_STATE || n->kind < KT_OP_ADD)
            continue;
        for (int k = kt_op_operands(n, operand) - 1; k >= 0; k--)
            depth[i] = depth[operand[k]] > depth[i] ? depth[operand[k]] : depth[i];
        depth[i] += n->kind == KT_OP_NEGATE   ? 0
                    : n->kind == KT_OP_DIVIDE ? DIVISION_IN_SUMS
                    : n->kind == KT_OP_CALL   ? CALL_IN_SUMS
                                              : 1;
        most = depth[i] > most ? depth[i] : most;
    }
    return most;
}

int kt_graph_time(const kt_graph *g, const kt_op *out, int count) {
    int32_t *uses = g->failed ? NULL : malloc(2 * (size_t)(g->count + 1) * sizeof *uses);
    if (uses == NULL)
        return 0;
    kt_graph_uses(g, out, count, uses);
    const int depth = find_depths(g, uses, uses + g->count + 1);
    const kt_op_counts n = kt_graph_count(g, out, count);
    const int all = n.multiply + n.add + DIVISION_IN_SUMS * n.divide + CALL_IN_SUMS * n.call + n.choose;
    free(uses);
    return all / OPERATIONS_AT_A_TIME > depth ? all / OPERATIONS_AT_A_TIME : depth;
}
