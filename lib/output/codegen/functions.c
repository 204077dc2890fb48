/* The graphs of the functions of a file: the recursions that each function uses. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/functions.h"

#include "codegen/loops.h"

#include <limits.h>
#include <string.h>

enum {
    KEEPS_SIGNS_FROM = 2000, /* sums and products of a function that may have loops */
    DENSE_MOST = 1000        /* squares of depths for each coordinate; chains of 54 coordinates have as many */
};

/* Factors products, with the guards behind the outputs. */
static void factor_function(kt_graph *g, kt_code_function *f) {
    kt_op *all = f->out;
    const int n = f->guard_count;
    for (int k = 0; k < n; k++) {
        all[f->out_count + 2 * k] = f->guard[k].pivot;
        all[f->out_count + 2 * k + 1] = f->guard[k].limit;
    }
    for (int pass = 0; pass < 3; pass++)
        kt_graph_factor(g, all, f->out_count + 2 * n);
    for (int k = 0; k < n; k++) {
        f->guard[k].pivot = all[f->out_count + 2 * k];
        f->guard[k].limit = all[f->out_count + 2 * k + 1];
    }
}

/* Replaces f by a graph that needs less time. */
static void take_faster(const kt_graph *g, size_t nv, const kt_code_function *other, int *least, kt_code_function *f) {
    const int time = kt_graph_time(g, other->out, other->out_count);
    if (g->failed || time >= *least)
        return;
    *least = time;
    memcpy(f->out, other->out, nv * sizeof *f->out);
    memcpy(f->guard, other->guard, nv * sizeof *f->guard);
}

/* Whether the mass matrix can be fastest. A coordinate that d - 1 others carry adds d^2 / 2 products to the factors.
 * Articulated bodies need less than DENSE_MOST / 2 operations for each coordinate. depth: nv. */
static bool may_be_dense(const kt_code_tree *tree, kt_op *depth) {
    const size_t nv = tree->model->n.v;
    size_t squares = 0;
    for (size_t i = 0; i < nv; i++) {
        depth[i] = 1 + (tree->before[i] >= 0 ? depth[tree->before[i]] : 0);
        squares += (size_t)depth[i] * (size_t)depth[i];
    }
    return squares <= DENSE_MOST * nv;
}

/* Makes forward dynamics with all methods, and selects the fastest. work: nv x nv. */
static void make_forward(kt_code_tree *tree, kt_op *work, kt_code_function *f) {
    kt_graph *g = tree->graph;
    const size_t nv = tree->model->n.v;
    f->out_count = (int)nv;
    kt_code_function other = *f;
    int least = INT_MAX;
    other.out = kt_graph_take(g, 3 * nv, sizeof *other.out);
    other.guard = kt_graph_take(g, nv, sizeof *other.guard);
    f->guard_count = other.guard_count = (int)nv;
    if (!g->failed && may_be_dense(tree, work)) {
        kt_code_forward_mass(tree, work, f->out, other.out, NULL, f->guard);
        factor_function(g, f);
        least = kt_graph_time(g, f->out, f->out_count);
    }
    for (int k = 0; k < (kt_code_is_planar(tree->model) ? 2 : 1) && !g->failed; k++) {
        g->scope++;
        (k == 0 ? kt_code_forward_articulated : kt_code_forward_planar)(tree, other.out, other.guard);
        factor_function(g, &other);
        take_faster(g, nv, &other, &least, f);
    }
}

/* Makes the nodes of a function that a model with loops has. Returns false if the function does not depend on loops. */
static bool fill_with_loops(kt_code_tree *tree, int k, kt_op *work, kt_code_function *f) {
    const size_t nv = tree->model->n.v, rows = (size_t)kt_code_count_loop_rows(tree->model);
    if (rows == 0)
        return false;
    f->output[0] = (int)nv;
    f->guard_count = (int)(nv + rows);
    switch (k) {
    case KT_CODEGEN_FORWARD_INDEX:
        kt_code_forward_loops(tree, work, f->out, f->guard);
        return true;
    case KT_CODEGEN_FORWARD_DERIVATIVES_INDEX:
        kt_code_forward_loop_derivatives(tree, work, f->out, f->guard);
        f->output[0] = f->output[1] = f->output[2] = (int)(nv * nv);
        return true;
    case KT_CODE_CLOSE:
    case KT_CODE_SETTLE:
        f->output[1] = kt_code_count_closed_rows(tree->model);
        if (k == KT_CODE_CLOSE)
            f->guard_count = kt_code_close_positions(tree, work, f->out, f->guard);
        else
            kt_code_settle_velocities(tree, work, f->out, f->guard);
        return true;
    case KT_CODE_CLOSE_CHANGES:
        f->output[0] = (int)(nv * nv);
        f->guard_count = kt_code_close_changes(tree, work, f->out, f->guard);
        return true;
    case KT_CODE_SETTLE_CHANGES:
        f->output[0] = (int)(2 * nv * nv);
        kt_code_settle_changes(tree, work, f->out, f->guard);
        return true;
    case KT_CODEGEN_LOOPS_INDEX:
        kt_code_loop_equations(tree, f->out);
        f->output[0] = f->output[2] = (int)rows;
        f->output[1] = (int)(rows * nv);
        f->guard_count = 0;
        return true;
    default:
        f->guard_count = 0;
        return false;
    }
}

/* Makes the nodes of another function. */
static void fill_function(kt_code_tree *tree, int k, kt_op *work, kt_code_function *f) {
    const size_t nv = tree->model->n.v, markers = tree->model->n.marker;
    f->output[0] = (int)nv;
    switch (k) {
    case KT_CODEGEN_FORWARD_INDEX:
        make_forward(tree, work, f);
        break;
    case KT_CODEGEN_INVERSE_INDEX:
    case KT_CODEGEN_BIAS_INDEX:
        kt_code_inverse(tree, k == KT_CODEGEN_INVERSE_INDEX, f->out);
        break;
    case KT_CODEGEN_MASS_INDEX:
        kt_code_mass(tree, f->out);
        f->output[0] = (int)(nv * nv);
        break;
    case KT_CODEGEN_EFFECTS_INDEX:
        kt_code_effects(tree, f->out);
        break;
    case KT_CODEGEN_STATES_INDEX:
        kt_code_states(tree, f->out);
        f->output[0] = (int)tree->model->n.x;
        break;
    case KT_CODEGEN_ENERGY_INDEX:
        kt_code_energy(tree, f->out);
        f->output[0] = 2;
        break;
    case KT_CODEGEN_JACOBIANS_INDEX:
        kt_code_jacobians(tree, f->out);
        f->output[0] = (int)(6 * nv * markers);
        break;
    case KT_CODEGEN_INVERSE_DERIVATIVES_INDEX:
        kt_code_inverse_derivatives(tree, 0, f->out);
        f->output[0] = f->output[1] = (int)(nv * nv);
        break;
    case KT_CODEGEN_EFFECT_DERIVATIVES_INDEX:
        kt_code_effect_derivatives(tree, f->out);
        f->output[0] = f->output[1] = (int)(nv * nv);
        break;
    case KT_CODEGEN_FORWARD_DERIVATIVES_INDEX:
        kt_code_forward_derivatives(tree, work, f->out, f->guard);
        f->guard_count = (int)nv;
        f->output[0] = f->output[1] = f->output[2] = (int)(nv * nv);
        break;
    default:
        kt_code_markers(tree, f->out);
        f->output[0] = f->output[1] = (int)(3 * markers);
        break;
    }
}

/* Makes the nodes of any function. The function of all accelerations is forward dynamics with the forces of effects. */
static void fill_any(kt_code_tree *tree, int k, kt_op *work, kt_code_function *f) {
    const bool is_loaded = k == KT_CODEGEN_ACCELERATION_INDEX && tree->model->n.effect > 0;
    const int like = k == KT_CODEGEN_ACCELERATION_INDEX ? (int)KT_CODEGEN_FORWARD_INDEX : k;
    if (is_loaded) {
        kt_code_effects(tree, f->out);
        tree->load = tree->force;
    }
    if (!fill_with_loops(tree, like, work, f))
        fill_function(tree, like, work, f);
    tree->load = NULL;
    f->out_count = f->output[0] + f->output[1] + f->output[2];
    for (int i = 0; i < f->guard_count; i++)
        f->guard[i].is_near = k == KT_CODEGEN_ACCELERATION_INDEX;
}

/* Whether a function is long, and its steps may become loops. Forces of effects have the motion of links, too, in other
 * expressions than the recursion with steps: both would give their variables the same names. */
static bool may_have_loops(const kt_code_tree *tree, int k, const kt_code_function *f) {
    const kt_op_counts n = kt_graph_count(tree->graph, f->out, f->out_count);
    const bool is_recursion = k == KT_CODEGEN_FORWARD_INDEX || k == KT_CODEGEN_INVERSE_INDEX ||
                              k == KT_CODEGEN_BIAS_INDEX || k == KT_CODEGEN_MASS_INDEX ||
                              (k == KT_CODEGEN_ACCELERATION_INDEX && tree->model->n.effect == 0);
    return is_recursion && n.multiply + n.add > KEEPS_SIGNS_FROM;
}

/* Makes the nodes of a function again, such that equal links have equal operations. */
static void fill_for_loops(kt_code_tree *tree, int k, kt_op *work, kt_code_function *f) {
    kt_code_tree turned;
    kt_graph *g = tree->graph;
    kt_code_tree_turn(&turned, tree);
    if (g->failed)
        return;
    g->keeps_signs = true;
    g->scope++;
    fill_any(turned.is_uniform ? &turned : tree, k, work, f);
    factor_function(g, f);
    g->keeps_signs = false;
}

void kt_code_make_function(kt_code_tree *tree, int k, bool is_apart, kt_code_function *f) {
    kt_graph *g = tree->graph;
    const size_t nv = tree->model->n.v;
    const size_t rows = (size_t)kt_code_count_loop_rows(tree->model);
    const size_t count = 3 * nv * nv + 6 * (nv + 1) * tree->model->n.marker + tree->model->n.x + rows * (nv + 2) + 2;
    f->out = kt_graph_take(g, count + 2 * (nv + rows), sizeof *f->out);
    f->guard = kt_graph_take(g, nv + rows, sizeof *f->guard);
    f->writes_at_once = is_apart && k != KT_CODEGEN_FORWARD_DERIVATIVES_INDEX; /* which has guards */
    kt_op *work = kt_graph_take(g, count, sizeof *work);
    if (g->failed)
        return;
    g->scope++;
    fill_any(tree, k, work, f);
    factor_function(g, f);
    f->may_roll = !g->failed && rows == 0 && may_have_loops(tree, k, f);
    if (f->may_roll)
        fill_for_loops(tree, k, work, f);
}
