/* Motion that satisfies the equations of loops, as nodes.
 *
 * Each function has the same form. Among all x with A x = b, the function selects the x for which W x - y is a sum A'
 * lambda of forces of the loops:
 *
 *   forward dynamics   x = a,  W = M,       y = tau - h,  b = right
 *   velocities         x = dv, W = M,       y = 0,        b = rate - A v
 *   positions          x = dq, W = 1 or M,  y = 0,        b = - phi
 *
 * W = L'D L is factored by kt_code_factor_mass. With Y = L'^-1 A', z = L'^-1 y and S = Y' D^-1 Y = A W^-1 A',
 *
 *   S lambda = b - Y' D^-1 z,    D L x = z + Y lambda
 *
 * S = L_s D_s L_s' is of the size of the equations. A pivot of S is the square of the part of row r that is normal to
 * all rows before it, in this metric. The pivot is compared with the square of the size that the row can have: the sum
 * of the S_kk of all rows of a point, or of u . u for all columns u of a distance. A pivot that is not above SINGULAR
 * times that size means that the equations are dependent or void in this position: the function returns the loop.
 *
 * Derivatives of accelerations have the same form. With held a and lambda, the chain rule gives the changes of the
 * forces M a + h - A' lambda and of the equations A a - right; then y and b are their negatives. For da/dtau, y is a
 * unit. Changes of the projections follow likewise, from M x - A' lambda or x - A' lambda, and from A x - b.
 *
 * Source: Featherstone, Rigid Body Dynamics Algorithms (2008), 8.3 and 8.5.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/loops.h"
#include "kinetree/loop.h"

#include <string.h>

/* The unknown x of a function. */
typedef enum code_unknown { OF_ACCELERATIONS, OF_VELOCITIES, OF_POSITIONS } code_unknown;

/* The equations of a function, and their solution. */
typedef struct code_closed {
    kt_code_tree *tree;
    code_unknown unknown;
    kt_code_loop_rows rows;
    const kt_op *m, *inverse; /* L and 1 / D of W; NULL: W = 1 */
    kt_op *y, *scaled, *s;    /* Y and Y' D^-1, row by row; S and then L_s below its diagonal */
    kt_op *value;             /* x, and lambda behind it */
    int guard_count;
} code_closed;

static kt_op dot_rows(kt_graph *g, const kt_op *x, const kt_op *y, size_t count) {
    kt_op sum = kt_op_number(g, 0.0);
    for (size_t i = 0; i < count; i++)
        sum = kt_op_add(g, sum, kt_op_multiply(g, x[i], y[i]));
    return sum;
}

/* Y, Y' D^-1 and S */
static void make_loop_matrix(code_closed *c) {
    kt_graph *g = c->tree->graph;
    const size_t nv = c->tree->model->n.v, count = (size_t)c->rows.count;
    memcpy(c->y, c->rows.a, count * nv * sizeof *c->y);
    for (size_t r = 0; r < count; r++) {
        kt_op *y = c->y + r * nv;
        kt_graph_section(g, "equation %d: %s", (int)r, c->m != NULL ? "Y = L'^-1 A',  S = Y' D^-1 Y" : "S = A A'");
        if (c->m != NULL)
            kt_code_solve_transposed(c->tree, c->m, y);
        for (size_t i = 0; i < nv; i++)
            c->scaled[r * nv + i] = c->m != NULL ? kt_op_multiply(g, y[i], c->inverse[i]) : y[i];
        for (size_t k = 0; k <= r; k++)
            c->s[r * count + k] = dot_rows(g, c->scaled + r * nv, c->y + k * nv, nv);
    }
}

/* The square of the size that row r can have. S must not be factored yet. */
static kt_op size_of_row(const code_closed *c, size_t r) {
    kt_graph *g = c->tree->graph;
    const size_t nv = c->tree->model->n.v, count = (size_t)c->rows.count, first = (size_t)c->rows.block[r];
    size_t last = first;
    kt_op sum = kt_op_number(g, 0.0);
    for (; last < count && (size_t)c->rows.block[last] == first; last++)
        sum = kt_op_add(g, sum, c->s[last * (count + 1)]);
    if (last - first > 1)
        return sum;
    kt_op size = kt_op_number(g, 0.0);
    for (size_t v = 0; v < nv; v++) {
        const kt_op square = c->rows.size[r * nv + v];
        size = kt_op_add(g, size, c->m != NULL ? kt_op_multiply(g, square, c->inverse[v]) : square);
    }
    return kt_op_is(g, size, 0.0) ? sum : size;
}

/* S = L_s D_s L_s' in place, with 1 / D_s on the diagonal. */
static void factor_loop_matrix(code_closed *c, kt_code_guard *guard) {
    kt_graph *g = c->tree->graph;
    const size_t count = (size_t)c->rows.count;
    kt_op *s = c->s;
    for (size_t r = 0; r < count; r++)
        guard[r] = (kt_code_guard){.limit = size_of_row(c, r), .loop = c->rows.loop[r] + 1};
    for (size_t r = 0; r < count; r++) {
        kt_op *pivot = &s[r * count + r];
        kt_graph_section(g, "equation %d: S = L D L',  pivot of %s", (int)r,
                         kt_loop_name(c->tree->model, c->rows.loop[r]));
        for (size_t k = 0; k < r; k++) { /* row r: first D L, then L */
            for (size_t j = 0; j < k; j++)
                s[r * count + k] =
                    kt_op_subtract(g, s[r * count + k], kt_op_multiply(g, s[r * count + j], s[k * count + j]));
        }
        for (size_t k = 0; k < r; k++) {
            const kt_op ratio = kt_op_multiply(g, s[r * count + k], s[k * count + k]);
            *pivot = kt_op_subtract(g, *pivot, kt_op_multiply(g, ratio, s[r * count + k]));
            s[r * count + k] = ratio;
        }
        guard[r].pivot = *pivot;
        kt_op_name(g, *pivot, "P%d", (int)r);
        *pivot = kt_op_divide(g, kt_op_number(g, 1.0), *pivot);
    }
}

/* On entry, b is the right-hand side and x holds y. On return, b holds lambda, and x the solution. */
static void solve_loop_matrix(const code_closed *c, kt_op *b, kt_op *x) {
    kt_graph *g = c->tree->graph;
    const size_t nv = c->tree->model->n.v, count = (size_t)c->rows.count;
    const kt_op *s = c->s;
    if (c->m != NULL)
        kt_code_solve_transposed(c->tree, c->m, x);
    for (size_t r = 0; r < count; r++) {
        b[r] = kt_op_subtract(g, b[r], dot_rows(g, c->scaled + r * nv, x, nv));
        for (size_t k = 0; k < r; k++)
            b[r] = kt_op_subtract(g, b[r], kt_op_multiply(g, s[r * count + k], b[k]));
    }
    for (size_t r = count; r-- > 0;) {
        b[r] = kt_op_multiply(g, b[r], s[r * count + r]);
        for (size_t k = r + 1; k < count; k++)
            b[r] = kt_op_subtract(g, b[r], kt_op_multiply(g, s[k * count + r], b[k]));
        kt_op_name(g, b[r], "lambda%d", (int)r);
    }
    for (size_t i = 0; i < nv; i++)
        for (size_t r = 0; r < count; r++)
            x[i] = kt_op_add(g, x[i], kt_op_multiply(g, c->y[r * nv + i], b[r]));
    if (c->m != NULL)
        kt_code_solve_lower(c->tree, c->m, c->inverse, x);
}

/* Factors all matrices. Returns false if memory is insufficient. */
static bool factor_loop_equations(code_closed *c, kt_code_guard *guard) {
    const size_t nv = c->tree->model->n.v, count = (size_t)c->rows.count;
    c->y = kt_graph_take(c->tree->graph, 2 * count * nv + count * count + 1, sizeof *c->y);
    if (c->y == NULL)
        return false;
    c->scaled = c->y + count * nv;
    c->s = c->y + 2 * count * nv;
    make_loop_matrix(c);
    factor_loop_matrix(c, guard);
    return true;
}

/* The acceleration of a driven joint does not depend on its own inertia, which may be zero, as for a road. The driven
 * joint receives the carried inertia as an armature, or 1 without carried inertia. */
static void load_driven_joints(kt_code_tree *tree, kt_op *mass) {
    const kt_model *model = tree->model;
    for (size_t i = 0; i < model->n.loop; i++) {
        const kt_loop_record *r = &model->loop[i];
        if (r->type != KT_LOOP_MOTION || kt_code_rows_of_loop(model, (int)i) == 0)
            continue;
        const kt_code_link *l = &tree->link[model->term[r->term].link];
        kt_op *diagonal = &mass[(size_t)l->link->v * (model->n.v + 1)];
        const kt_op armature = kt_link_lengths(l->link) > 0 ? l->carried : l->size;
        *diagonal = kt_op_is(tree->graph, armature, 0.0) ? kt_op_number(tree->graph, 1.0)
                                                         : kt_op_add(tree->graph, *diagonal, armature);
    }
}

/* Factors the mass matrix. Returns 1 / D; NULL if memory is insufficient. */
static kt_op *factor_loop_mass(kt_code_tree *tree, kt_op *work, kt_code_guard *guard) {
    const size_t nv = tree->model->n.v;
    kt_op *inverse = kt_graph_take(tree->graph, nv + 1, sizeof *inverse);
    if (inverse == NULL)
        return NULL;
    kt_code_mass(tree, work);
    load_driven_joints(tree, work);
    for (size_t k = 0; k < nv; k++)
        guard[k] = (kt_code_guard){.limit = work[k * (nv + 1)]};
    kt_code_factor_mass(tree, work, inverse, guard);
    return inverse;
}

/* ---- solutions --------------------------------------------------------------------------------------------------- */

/* Leaves out the equations without a residual. All equations of one block are of one kind. */
static void keep_closed_rows(kt_code_loop_rows *rows, size_t nv) {
    int at = 0;
    for (int r = 0; r < rows->count; r++) {
        if (!rows->is_closed[r])
            continue;
        const int back = r - rows->block[r];
        rows->loop[at] = rows->loop[r];
        rows->block[at] = at - back;
        rows->phi[at] = rows->phi[r];
        rows->scaled[at] = rows->scaled[r];
        rows->is_closed[at] = true;
        memmove(rows->a + (size_t)at * nv, rows->a + (size_t)r * nv, nv * sizeof *rows->a);
        memmove(rows->size + (size_t)at * nv, rows->size + (size_t)r * nv, nv * sizeof *rows->size);
        at++;
    }
    rows->count = at;
}

/* Row r of A x - b. x: NULL: 0. */
static kt_op residual_of_closed_row(const code_closed *c, size_t r, const kt_op *x) {
    kt_graph *g = c->tree->graph;
    const size_t nv = c->tree->model->n.v;
    kt_op sum = c->unknown == OF_POSITIONS ? c->rows.phi[r] : kt_op_number(g, 0.0);
    for (size_t k = 0; k < nv; k++) {
        kt_op moved = x != NULL ? x[k] : kt_op_number(g, 0.0);
        if (c->unknown == OF_VELOCITIES)
            moved = kt_op_add(g, moved, kt_op_input(g, KT_OP_RATE, (int)k));
        sum = kt_op_add(g, sum, kt_op_multiply(g, c->rows.a[r * nv + k], moved));
    }
    if (c->unknown == OF_POSITIONS)
        return sum;
    return kt_op_subtract(g, sum, c->unknown == OF_ACCELERATIONS ? c->rows.right[r] : c->rows.rate[r]);
}

/* y and b, and then x and lambda. The value of accelerations is h before. */
static void solve_closed_rows(code_closed *c) {
    kt_graph *g = c->tree->graph;
    const size_t nv = c->tree->model->n.v;
    const bool accelerates = c->unknown == OF_ACCELERATIONS;
    kt_graph_section(g, "%s what the forces of the loops add",
                     accelerates ? "tau - h, then lambda and" : "lambda, and");
    for (size_t k = 0; k < nv; k++)
        c->value[k] =
            accelerates ? kt_op_subtract(g, kt_code_given_force(c->tree, (int)k), c->value[k]) : kt_op_number(g, 0.0);
    for (size_t r = 0; r < (size_t)c->rows.count; r++)
        c->value[nv + r] = kt_op_negate(g, residual_of_closed_row(c, r, NULL));
    solve_loop_matrix(c, c->value + nv, c->value);
}

/* Makes the equations, and solves them. Returns false if memory is insufficient. */
static bool solve_closed_tree(kt_code_tree *tree, code_unknown unknown, kt_op *work, kt_code_guard *guard,
                              code_closed *c) {
    kt_graph *g = tree->graph;
    const size_t nv = tree->model->n.v, most = nv + (size_t)kt_code_count_loop_rows(tree->model);
    const bool has_mass = unknown != OF_POSITIONS || tree->model->metric == KT_METRIC_MASS;
    *c = (code_closed){.tree = tree, .unknown = unknown, .value = kt_graph_take(g, most + 1, sizeof *c->value)};
    if (unknown == OF_ACCELERATIONS && !g->failed)
        kt_code_inverse(tree, false, c->value);
    if (has_mass) {
        c->m = work;
        c->inverse = factor_loop_mass(tree, work, guard);
    }
    kt_code_make_loop_rows(tree, unknown == OF_ACCELERATIONS, &c->rows);
    if (unknown == OF_POSITIONS && !g->failed)
        keep_closed_rows(&c->rows, nv);
    c->guard_count = c->rows.count + (has_mass ? (int)nv : 0);
    if (!g->failed && factor_loop_equations(c, guard + (has_mass ? nv : 0)))
        solve_closed_rows(c);
    return !g->failed;
}

/* Writes the scaled residuals of equations that have a residual. */
static void list_gaps(const kt_code_loop_rows *rows, kt_op *gap) {
    for (int r = 0, at = 0; r < rows->count; r++)
        if (rows->is_closed[r])
            gap[at++] = rows->scaled[r];
}

void kt_code_forward_loops(kt_code_tree *tree, kt_op *work, kt_op *a, kt_code_guard *guard) {
    code_closed c;
    if (solve_closed_tree(tree, OF_ACCELERATIONS, work, guard, &c))
        memcpy(a, c.value, tree->model->n.v * sizeof *a);
}

int kt_code_close_positions(kt_code_tree *tree, kt_op *work, kt_op *out, kt_code_guard *guard) {
    code_closed c;
    if (solve_closed_tree(tree, OF_POSITIONS, work, guard, &c)) {
        memcpy(out, c.value, tree->model->n.v * sizeof *out);
        list_gaps(&c.rows, out + tree->model->n.v);
    }
    return c.guard_count;
}

void kt_code_settle_velocities(kt_code_tree *tree, kt_op *work, kt_op *out, kt_code_guard *guard) {
    code_closed c;
    if (!solve_closed_tree(tree, OF_VELOCITIES, work, guard, &c))
        return;
    for (int k = 0; k < (int)tree->model->n.v; k++)
        out[k] = kt_op_add(tree->graph, kt_op_input(tree->graph, KT_OP_RATE, k), c.value[k]);
    list_gaps(&c.rows, out + tree->model->n.v);
}

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

/* M x with held x: the joint forces of these accelerations at rest, without gravity. */
static void make_held_momentum(kt_code_tree *tree, const kt_op *held, kt_op *f) {
    kt_graph *g = tree->graph;
    const size_t nv = tree->model->n.v;
    kt_op *weight = kt_graph_take(g, nv + 1, sizeof *weight);
    if (weight == NULL)
        return;
    tree->acceleration = held;
    tree->is_at_rest = g->is_nameless = true;
    kt_code_inverse(tree, true, f);
    tree->acceleration = NULL;
    kt_code_inverse(tree, false, weight);
    tree->is_at_rest = g->is_nameless = false;
    for (size_t k = 0; k < nv; k++)
        f[k] = kt_op_subtract(g, f[k], weight[k]);
}

/* f = (W x - A' lambda, A x - b) with held x and lambda. Accelerations leave out W x. */
static void make_held_residuals(const code_closed *c, const kt_op *held, kt_op *f) {
    kt_code_tree *tree = c->tree;
    kt_graph *g = tree->graph;
    const size_t nv = tree->model->n.v;
    if (c->unknown != OF_ACCELERATIONS && c->inverse != NULL)
        make_held_momentum(tree, held, f);
    else
        for (size_t k = 0; k < nv; k++)
            f[k] = c->unknown == OF_ACCELERATIONS ? kt_op_number(g, 0.0) : held[k];
    for (size_t r = 0; r < (size_t)c->rows.count && !g->failed; r++) {
        for (size_t k = 0; k < nv; k++)
            f[k] = kt_op_subtract(g, f[k], kt_op_multiply(g, c->rows.a[r * nv + k], held[nv + r]));
        f[nv + r] = residual_of_closed_row(c, r, held);
    }
}

/* The derivatives of M a + h by q and v, for held a. Returns NULL if memory is insufficient. */
static kt_op *derive_held_forces(kt_code_tree *tree, const kt_op *held) {
    kt_graph *g = tree->graph;
    const size_t nv = tree->model->n.v;
    kt_op *forces = kt_graph_take(g, 2 * nv * nv + 1, sizeof *forces);
    tree->acceleration = held;
    g->is_nameless = true;
    if (forces != NULL)
        kt_code_inverse_derivatives(tree, 0, forces);
    g->is_nameless = false;
    tree->acceleration = NULL;
    return forces;
}

/* One column of da/dq, da/dv or da/dtau; k counts the columns of all three matrices. change: df/dq and df/dv. */
static void solve_loop_derivative(const code_closed *c, int k, const kt_op *change, kt_op *b, kt_op *column) {
    kt_graph *g = c->tree->graph;
    const int nv = (int)c->tree->model->n.v, count = c->rows.count;
    const kt_op *f = change + (size_t)k * (size_t)(nv + count);
    kt_graph_section(g, "column %d of da/d%s: M x - A' z = - change of the forces,  A x = - change of the equations",
                     k % nv,
                     k < nv       ? "q"
                     : k < 2 * nv ? "v"
                                  : "tau");
    for (int i = 0; i < nv; i++)
        column[i] = k < 2 * nv ? kt_op_negate(g, f[i]) : kt_op_number(g, i == k % nv ? 1.0 : 0.0);
    for (int r = 0; r < count; r++)
        b[r] = k < 2 * nv ? kt_op_negate(g, f[nv + r]) : kt_op_number(g, 0.0);
    g->is_nameless = true;
    solve_loop_matrix(c, b, column);
    g->is_nameless = false;
}

/* The derivatives of x by the first `columns` of q, v and tau. For a projected state, which x changes, the identity is
 * added. */
static void differentiate_closed(const code_closed *c, int columns, kt_op *out) {
    kt_graph *g = c->tree->graph;
    const int nv = (int)c->tree->model->n.v, all = nv + c->rows.count, first = c->unknown == OF_VELOCITIES ? nv : 0;
    kt_op *held = kt_graph_take(g, (size_t)(3 * all + 2 * nv * all) + 1, sizeof *held);
    if (held == NULL)
        return;
    kt_op *f = held + all, *b = held + 2 * all, *change = held + 3 * all;
    for (int k = 0; k < all; k++)
        held[k] = kt_op_input(g, KT_OP_HELD, k);
    make_held_residuals(c, held, f);
    const kt_op *forces = c->unknown == OF_ACCELERATIONS ? derive_held_forces(c->tree, held) : NULL;
    kt_code_differentiate(c->tree, f, all, change);
    for (int k = 0; k < 2 * nv * nv && forces != NULL && !g->failed; k++) {
        kt_op *entry = &change[k / nv * all + k % nv];
        *entry = kt_op_add(g, forces[k], *entry);
    }
    kt_graph_replace(g, change, 2 * nv * all, c->value);
    for (int k = 0; k < columns && !g->failed; k++) {
        kt_op *column = out + (size_t)k * (size_t)nv;
        solve_loop_derivative(c, k, change, b, column);
        if (k >= first && c->unknown != OF_ACCELERATIONS)
            column[k - first] = kt_op_add(g, column[k - first], kt_op_number(g, 1.0));
    }
}

void kt_code_forward_loop_derivatives(kt_code_tree *tree, kt_op *work, kt_op *out, kt_code_guard *guard) {
    code_closed c;
    if (solve_closed_tree(tree, OF_ACCELERATIONS, work, guard, &c))
        differentiate_closed(&c, 3 * (int)tree->model->n.v, out);
}

int kt_code_close_changes(kt_code_tree *tree, kt_op *work, kt_op *out, kt_code_guard *guard) {
    code_closed c;
    if (solve_closed_tree(tree, OF_POSITIONS, work, guard, &c))
        differentiate_closed(&c, (int)tree->model->n.v, out);
    return c.guard_count;
}

void kt_code_settle_changes(kt_code_tree *tree, kt_op *work, kt_op *out, kt_code_guard *guard) {
    code_closed c;
    if (solve_closed_tree(tree, OF_VELOCITIES, work, guard, &c))
        differentiate_closed(&c, 2 * (int)tree->model->n.v, out);
}

/* ---- equations alone --------------------------------------------------------------------------------------------- */

void kt_code_loop_equations(kt_code_tree *tree, kt_op *out) {
    const size_t nv = tree->model->n.v;
    kt_code_loop_rows rows;
    kt_code_make_loop_rows(tree, true, &rows);
    const size_t count = (size_t)rows.count;
    for (size_t r = 0; r < count && !tree->graph->failed; r++) {
        out[r] = rows.phi[r];
        out[count * (nv + 1) + r] = rows.right[r];
        for (size_t k = 0; k < nv; k++)
            out[count * (k + 1) + r] = rows.a[r * nv + k];
    }
}
