/* Derivatives by the chain rule on nodes, and the derivatives of inverse and forward dynamics.
 *
 * A direction changes one coordinate: q (+) h e_k or v + h e_k. Each node has a slope, its derivative by h:
 *
 *   (a + b)' = a' + b'    (a b)' = a' b + a b'    (a / b)' = (a' - (a / b) b') / b
 *   (sin q)' = cos q      (cos q)' = -sin q       p' = p (0, e_k) / 2 for the quaternion p of a joint
 *
 * The rate of a function of time follows likewise, with t' = 1.
 *
 * A slope that is zero makes no node, so that only links beyond a joint, and those that carry it, have operations.
 * With tau(q, v, a) = M a + h,
 *
 *   da/dtau = M^-1    da/dq = -M^-1 dtau/dq    da/dv = -M^-1 dtau/dv,
 *
 * where the accelerations are held: they are inputs KT_OP_HELD, which have no slope. Afterwards the accelerations of
 * forward dynamics replace these inputs.
 *
 * The derivatives of inverse dynamics also follow from composite bodies (composite.c), which need half of the
 * operations for an arm. In the plane, the chain rule often needs fewer.
 *
 * Source: Griewank & Walther, Evaluating Derivatives (2008), 3.1.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/recursion.h"

#include <string.h>

/* A direction: one position or velocity of a link, or the time. */
typedef struct code_direction {
    const kt_link *link; /* NULL: the time */
    kt_op_array array;   /* KT_OP_POSITION or KT_OP_RATE */
    int index;           /* of the coordinate in the joint */
} code_direction;

/* Component `row` of p (0, e_axis) / 2, where p begins at the position `first`. */
static kt_op turn_quaternion(kt_graph *g, int first, int row, int axis) {
    const kt_op half = kt_op_number(g, 0.5);
    if (row == 0)
        return kt_op_negate(g, kt_op_multiply(g, half, kt_op_input(g, KT_OP_POSITION, first + 1 + axis)));
    if (row == 1 + axis)
        return kt_op_multiply(g, half, kt_op_input(g, KT_OP_POSITION, first));
    const int other = 3 - axis - (row - 1); /* p x e_axis has the sign of the permutation (row, other, axis) */
    const kt_op product = kt_op_multiply(g, half, kt_op_input(g, KT_OP_POSITION, first + 1 + other));
    return row % 3 == other ? product : kt_op_negate(g, product);
}

/* The slope of an input. */
static kt_op input_slope(kt_graph *g, const kt_op_node *n, const code_direction *d) {
    const kt_link *l = d->link;
    if (l == NULL)
        return kt_op_number(g, n->a == KT_OP_TIME ? 1.0 : 0.0);
    const int lengths = kt_link_lengths(l), turns = d->index - lengths;
    const bool has_quaternion = kt_motion_facts_of((kt_motion)l->motion).quaternions > 0;
    const kt_op zero = kt_op_number(g, 0.0), one = kt_op_number(g, 1.0);
    switch ((kt_op_array)n->a) {
    case KT_OP_RATE:
        return d->array == KT_OP_RATE && n->b == l->v + d->index ? one : zero;
    case KT_OP_POSITION:
        if (d->array != KT_OP_POSITION)
            return zero;
        if (!has_quaternion || turns < 0)
            return n->b == l->q + d->index ? one : zero;
        return n->b >= l->q + lengths && n->b < l->q + lengths + 4
                   ? turn_quaternion(g, l->q + lengths, n->b - l->q - lengths, turns)
                   : zero;
    case KT_OP_SINE:
    case KT_OP_COSINE:
        if (d->array != KT_OP_POSITION || has_quaternion || n->b != l->angle ||
            kt_motion_facts_of((kt_motion)l->motion).angles == 0)
            return zero;
        return n->a == KT_OP_SINE ? kt_op_input(g, KT_OP_COSINE, n->b)
                                  : kt_op_negate(g, kt_op_input(g, KT_OP_SINE, n->b));
    case KT_OP_OWN_STATE:
    case KT_OP_TIME:
    case KT_OP_GIVEN:
    case KT_OP_HELD:
        break;
    }
    return zero;
}

/* The slope of node i, a function of an operand with the slope s:  f'(a) s. z is the node itself. */
static kt_op call_slope(kt_graph *g, kt_op i, kt_op s) {
    const kt_op_node n = g->node[i];
    const kt_op zero = kt_op_number(g, 0.0), one = kt_op_number(g, 1.0);
    const kt_op square = kt_op_multiply(g, n.a, n.a), z2 = kt_op_multiply(g, i, i);
    switch ((kt_op_function)n.c) {
    case KT_OP_SIN:
        return kt_op_multiply(g, kt_op_call(g, KT_OP_COS, n.a, -1), s);
    case KT_OP_COS:
        return kt_op_negate(g, kt_op_multiply(g, kt_op_call(g, KT_OP_SIN, n.a, -1), s));
    case KT_OP_TAN:
        return kt_op_multiply(g, kt_op_add(g, one, z2), s);
    case KT_OP_ASIN:
        return kt_op_divide(g, s, kt_op_call(g, KT_OP_SQRT, kt_op_subtract(g, one, square), -1));
    case KT_OP_ACOS:
        return kt_op_negate(g, kt_op_divide(g, s, kt_op_call(g, KT_OP_SQRT, kt_op_subtract(g, one, square), -1)));
    case KT_OP_ATAN:
        return kt_op_divide(g, s, kt_op_add(g, one, square));
    case KT_OP_SINH:
        return kt_op_multiply(g, kt_op_call(g, KT_OP_COSH, n.a, -1), s);
    case KT_OP_COSH:
        return kt_op_multiply(g, kt_op_call(g, KT_OP_SINH, n.a, -1), s);
    case KT_OP_TANH:
        return kt_op_multiply(g, kt_op_subtract(g, one, z2), s);
    case KT_OP_EXP:
        return kt_op_multiply(g, i, s);
    case KT_OP_LOG:
        return kt_op_divide(g, s, n.a);
    case KT_OP_SQRT: /* the length of a vector that is zero has no direction */
        return kt_op_choose(g, i, kt_op_divide(g, kt_op_scale(g, 0.5, s), i), zero);
    case KT_OP_ABS: {
        const kt_op minus = kt_op_negate(g, s);
        return kt_op_choose(g, n.a, s, kt_op_choose(g, kt_op_negate(g, n.a), minus, zero));
    }
    case KT_OP_FLOOR:
    case KT_OP_ATAN2:
    case KT_OP_HYPOT:
    case KT_OP_POWER:
        break;
    }
    return kt_op_number(g, 0.0);
}

/* The slope of node i, a function of two operands with the slopes s and t. */
static kt_op call_slope_of_two(kt_graph *g, kt_op i, kt_op s, kt_op t) {
    const kt_op_node n = g->node[i];
    const kt_op zero = kt_op_number(g, 0.0), one = kt_op_number(g, 1.0);
    kt_op sum;
    switch ((kt_op_function)n.c) {
    case KT_OP_ATAN2: /* (b s - a t) / (a^2 + b^2) */
        sum = kt_op_subtract_products(g, n.b, s, n.a, t);
        return kt_op_divide(g, sum, kt_op_add_products(g, n.a, n.a, n.b, n.b));
    case KT_OP_HYPOT: /* (a s + b t) / z */
        sum = kt_op_add_products(g, n.a, s, n.b, t);
        return kt_op_choose(g, i, kt_op_divide(g, sum, i), zero);
    case KT_OP_POWER: /* b a^(b - 1) s + z log(a) t */
        sum = kt_op_multiply(g, n.b, kt_op_call(g, KT_OP_POWER, n.a, kt_op_subtract(g, n.b, one)));
        sum = kt_op_multiply(g, sum, s);
        return kt_op_is(g, t, 0.0)
                   ? sum
                   : kt_op_add(g, sum, kt_op_multiply(g, kt_op_multiply(g, i, kt_op_call(g, KT_OP_LOG, n.a, -1)), t));
    default:
        return zero;
    }
}

/* The slope of node i from the slopes of its operands. */
static kt_op node_slope(kt_graph *g, kt_op i, const kt_op *slope, const code_direction *d) {
    const kt_op_node n = g->node[i];
    switch ((kt_op_kind)n.kind) {
    case KT_OP_ADD:
        return kt_op_add(g, slope[n.a], slope[n.b]);
    case KT_OP_SUBTRACT:
        return kt_op_subtract(g, slope[n.a], slope[n.b]);
    case KT_OP_MULTIPLY:
        return kt_op_add_products(g, slope[n.a], n.b, n.a, slope[n.b]);
    case KT_OP_DIVIDE:
        return kt_op_divide(g, kt_op_subtract(g, slope[n.a], kt_op_multiply(g, i, slope[n.b])), n.b);
    case KT_OP_NEGATE:
        return kt_op_negate(g, slope[n.a]);
    case KT_OP_CALL:
        if (kt_op_is(g, slope[n.a], 0.0) && (n.b < 0 || kt_op_is(g, slope[n.b], 0.0)))
            break;
        return n.b < 0 ? call_slope(g, i, slope[n.a]) : call_slope_of_two(g, i, slope[n.a], slope[n.b]);
    case KT_OP_CHOOSE:
        return kt_op_choose(g, n.a, slope[n.b], slope[n.c]);
    case KT_OP_INPUT:
        return input_slope(g, &n, d);
    case KT_OP_CONSTANT:
    case KT_OP_PARAMETER:
        break;
    }
    return kt_op_number(g, 0.0);
}

/* Room of the chain rule: each has an entry for every node. */
typedef struct code_chain {
    kt_pool pool;
    int32_t count; /* of nodes before their derivatives */
    int32_t *uses;
    kt_op *slope;
} code_chain;

/* Begins with the nodes that exist now; derivatives are later nodes. */
static code_chain chain_make(kt_graph *g, const kt_op *out, int count) {
    const size_t room = (size_t)g->count + 1;
    code_chain chain = {.count = g->count};
    chain.uses = kt_pool_take(&chain.pool, room, sizeof *chain.uses);
    chain.slope = kt_pool_take(&chain.pool, room, sizeof *chain.slope);
    g->failed |= chain.uses == NULL || chain.slope == NULL;
    if (!g->failed)
        kt_graph_uses(g, out, count, chain.uses);
    return chain;
}

/* Makes the derivatives of some nodes along one direction. */
static void apply_chain_rule(kt_graph *g, const code_chain *chain, const code_direction *d, const kt_op *f, int count,
                             kt_op *column) {
    const kt_op zero = kt_op_number(g, 0.0);
    for (kt_op i = 0; i < chain->count && !g->failed; i++) {
        const bool moves = chain->uses[i] > 0 && g->node[i].origin == KT_OP_OF_STATE;
        chain->slope[i] = moves ? node_slope(g, i, chain->slope, d) : zero;
    }
    for (int i = 0; i < count && !g->failed; i++)
        column[i] = chain->slope[f[i]];
}

void kt_code_differentiate(kt_code_tree *tree, const kt_op *f, int count, kt_op *out) {
    kt_graph *g = tree->graph;
    const int nv = (int)tree->model->n.v;
    const code_chain chain = chain_make(g, f, count);
    for (int k = 0; k < 2; k++)
        for (int c = 1; c < tree->link_count && !g->failed; c++) {
            const kt_link *link = tree->link[c].link;
            for (int i = 0; i < kt_link_dofs(link); i++) {
                const code_direction d = {link, k == 0 ? KT_OP_POSITION : KT_OP_RATE, i};
                kt_graph_section(g, "%s: derivatives by %c_%d, by the chain rule", tree->link[c].name,
                                 k == 0 ? 'q' : 'v', link->v + i);
                apply_chain_rule(g, &chain, &d, f, count, out + (size_t)count * (size_t)(k * nv + link->v + i));
            }
        }
    kt_pool_free(chain.pool.chunks);
}

/* The derivative of one node. */
static kt_op differentiate_node(kt_graph *g, kt_op value, const code_direction *d) {
    const code_chain chain = chain_make(g, &value, 1);
    kt_op rate = kt_op_number(g, 0.0);
    apply_chain_rule(g, &chain, d, &value, 1, &rate);
    kt_pool_free(chain.pool.chunks);
    return rate;
}

kt_op kt_code_rate_of_time(kt_graph *g, kt_op value) {
    return differentiate_node(g, value, &(code_direction){.link = NULL});
}

kt_op kt_code_rate_of_position(kt_graph *g, kt_op value, const kt_link *link) {
    return differentiate_node(g, value, &(code_direction){link, KT_OP_POSITION, 0});
}

enum { FEW_COORDINATES = 24 }; /* of mechanisms whose derivatives are made in both ways */

static int count_operations(const kt_graph *g, const kt_op *out, size_t count) {
    const kt_op_counts n = kt_graph_count(g, out, (int)count);
    return n.multiply + n.add + n.divide + n.call + n.choose;
}

void kt_code_inverse_derivatives(kt_code_tree *tree, size_t also, kt_op *out) {
    kt_graph *g = tree->graph;
    const size_t nv = tree->model->n.v, count = 2 * nv * nv;
    const bool was_nameless = g->is_nameless;
    kt_op *tau = kt_graph_take(g, nv + 1, sizeof *tau), *other = kt_graph_take(g, count + also + 1, sizeof *other);
    if (!g->failed)
        kt_code_composite_derivatives(tree, tau, out, out + nv * nv);
    if (!g->failed && nv <= FEW_COORDINATES) {
        g->is_nameless = true;
        kt_code_differentiate(tree, tau, (int)nv, other);
        g->is_nameless = was_nameless;
        memcpy(other + count, out + count, also * sizeof *other);
        if (!g->failed && count_operations(g, other, count + also) < count_operations(g, out, count + also))
            memcpy(out, other, count * sizeof *out);
    }
}

/* out := -M^-1 out, for one column. */
static void multiply_column(kt_graph *g, int nv, const kt_op *inverse, kt_op *column, kt_op *room) {
    for (int i = 0; i < nv; i++) {
        room[i] = kt_op_number(g, 0.0);
        for (int j = 0; j < nv; j++)
            room[i] = kt_op_subtract(g, room[i], kt_op_multiply(g, inverse[j * nv + i], column[j]));
    }
    memcpy(column, room, (size_t)nv * sizeof *column);
}

/* Whether the factors of M have fewer products than M^-1: that has none of their zeros. */
static bool has_sparse_factors(const kt_code_tree *tree) {
    size_t entries = 0;
    const size_t nv = tree->model->n.v;
    for (size_t k = 0; k < nv; k++)
        for (int i = tree->before[k]; i >= 0; i = tree->before[i])
            entries++;
    return 2 * entries + nv < nv * nv;
}

/* da/dq and da/dv from dtau/dq and dtau/dv. m: the factors of M, and inverse 1 / D. room: nv. */
static void solve_columns(kt_code_tree *tree, const kt_op *m, const kt_op *pivot, kt_op *out, kt_op *room) {
    kt_graph *g = tree->graph;
    const int nv = (int)tree->model->n.v;
    const bool is_sparse = has_sparse_factors(tree);
    for (int k = 0; k < 2 * nv && !g->failed; k++) {
        const char by = k < nv ? 'q' : 'v';
        kt_op *column = out + (size_t)k * (size_t)nv;
        kt_graph_section(g, "column %d of da/d%c = -M^-1 dtau/d%c", k < nv ? k : k - nv, by, by);
        if (!is_sparse) {
            multiply_column(g, nv, out + 2 * (size_t)nv * (size_t)nv, column, room);
            continue;
        }
        for (int i = 0; i < nv; i++)
            column[i] = kt_op_negate(g, column[i]);
        kt_code_solve_transposed(tree, m, column);
        kt_code_solve_lower(tree, m, pivot, column);
    }
}

void kt_code_forward_derivatives(kt_code_tree *tree, kt_op *work, kt_op *out, kt_code_guard *guard) {
    kt_graph *g = tree->graph;
    const size_t nv = tree->model->n.v, square = nv * nv;
    kt_op *a = kt_graph_take(g, 4 * nv + 1, sizeof *a);
    if (g->failed)
        return;
    kt_op *const held = a + nv, *const room = a + 2 * nv, *const pivot = a + 3 * nv;
    kt_code_forward_mass(tree, work, a, pivot, out + 2 * square, guard);
    for (size_t k = 0; k < nv; k++)
        held[k] = kt_op_input(g, KT_OP_HELD, (int)k);
    tree->acceleration = held;
    g->is_nameless = true;
    kt_code_inverse_derivatives(tree, square, out);
    g->is_nameless = false;
    tree->acceleration = NULL;
    kt_graph_replace(g, out, (int)(2 * square), a);
    solve_columns(tree, work, pivot, out, room);
}
