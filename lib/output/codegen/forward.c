/* Forward dynamics through the mass matrix, as nodes.
 *
 * M = L'DL in the order of the coordinates, parents first: L and M have zeros for coordinates on different branches,
 * and there is no fill-in. A pivot D_kk that is not above rounding errors of M means that the joint has no inertia.
 *
 * Source: Featherstone, Rigid Body Dynamics Algorithms (2008), 6.5.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/recursion.h"

/* ---- forward dynamics -------------------------------------------------------------------------------------------- */

void kt_code_factor_mass(kt_code_tree *tree, kt_op *m, kt_op *inverse, kt_code_guard *guard) {
    kt_graph *g = tree->graph;
    const size_t nv = tree->model->n.v;
    const kt_op one = kt_op_number(g, 1.0);
    for (int c = tree->link_count - 1; c > 0; c--) {
        const kt_code_link *l = &tree->link[c];
        for (int d = kt_link_dofs(l->link) - 1; d >= 0; d--) {
            const int k = l->link->v + d;
            kt_op *row = m + (size_t)k * nv;
            kt_graph_section(g, "%s: D_kk = M_kk,  L_ki = M_ki / D_kk,  M_ij -= L_ki M_kj  (k = %d)", l->name, k);
            guard[k].pivot = row[k];
            guard[k].body = l->link->body;
            guard[k].limit = kt_op_add(g, guard[k].limit, d < kt_link_lengths(l->link) ? l->carried : l->size);
            inverse[k] = kt_op_divide(g, one, row[k]);
            kt_op_name(g, row[k], "D%d", k);
            kt_op_name(g, inverse[k], "E%d", k);
            for (int i = tree->before[k]; i >= 0; i = tree->before[i]) {
                const kt_op ratio = kt_op_multiply(g, row[i], inverse[k]);
                for (int j = i; j >= 0; j = tree->before[j])
                    m[(size_t)i * nv + (size_t)j] =
                        kt_op_subtract(g, m[(size_t)i * nv + (size_t)j], kt_op_multiply(g, ratio, row[j]));
                row[i] = ratio;
                kt_op_name(g, ratio, "L%d_%d", k, i);
            }
        }
    }
}

void kt_code_solve_transposed(kt_code_tree *tree, const kt_op *m, kt_op *x) {
    kt_graph *g = tree->graph;
    const int nv = (int)tree->model->n.v;
    for (int k = nv - 1; k >= 0; k--)
        for (int i = tree->before[k]; i >= 0; i = tree->before[i])
            x[i] = kt_op_subtract(g, x[i], kt_op_multiply(g, m[(size_t)k * (size_t)nv + (size_t)i], x[k]));
}

void kt_code_solve_lower(kt_code_tree *tree, const kt_op *m, const kt_op *inverse, kt_op *x) {
    kt_graph *g = tree->graph;
    const int nv = (int)tree->model->n.v;
    for (int k = 0; k < nv; k++) {
        x[k] = kt_op_multiply(g, x[k], inverse[k]);
        for (int i = tree->before[k]; i >= 0; i = tree->before[i])
            x[k] = kt_op_subtract(g, x[k], kt_op_multiply(g, m[(size_t)k * (size_t)nv + (size_t)i], x[i]));
    }
}

/* x := M^-1 x, for a column of which entries may be zero. */
static void solve_mass(kt_code_tree *tree, const kt_op *m, const kt_op *inverse, kt_op *x) {
    kt_code_solve_transposed(tree, m, x);
    kt_code_solve_lower(tree, m, inverse, x);
}

void kt_code_forward_mass(kt_code_tree *tree, kt_op *work, kt_op *a, kt_op *inverse, kt_op *mass_inverse,
                          kt_code_guard *guard) {
    kt_graph *g = tree->graph;
    const int nv = (int)tree->model->n.v;
    kt_code_inverse(tree, false, a);
    kt_code_mass(tree, work);
    for (int k = 0; k < nv; k++)
        guard[k].limit = work[(size_t)k * (size_t)(nv + 1)];
    kt_code_factor_mass(tree, work, inverse, guard);
    kt_graph_section(g, "accelerations: L'D L a = tau - h");
    for (int k = 0; k < nv; k++)
        a[k] = kt_op_subtract(g, kt_code_given_force(tree, k), a[k]);
    solve_mass(tree, work, inverse, a);
    for (int k = 0; k < nv && mass_inverse != NULL; k++) {
        kt_op *column = mass_inverse + (size_t)k * (size_t)nv;
        kt_graph_section(g, "column %d of da/dtau = M^-1: L'D L x = e_%d", k, k);
        for (int i = 0; i < nv; i++)
            column[i] = kt_op_number(g, i == k ? 1.0 : 0.0);
        solve_mass(tree, work, inverse, column);
    }
    for (int k = 0; k < nv && mass_inverse != NULL; k++) /* it is symmetric: half of the entries need no operations */
        for (int i = k + 1; i < nv; i++)
            mass_inverse[(size_t)k * (size_t)nv + (size_t)i] = mass_inverse[(size_t)i * (size_t)nv + (size_t)k];
}
