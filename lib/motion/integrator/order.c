/* Order conditions, HNW II.2.
 *
 * A rooted tree t of rho(t) nodes has the density gamma(t) = product over its nodes of the size of the subtree there,
 * and for stage i the elementary weight
 *
 *     Phi_i(t) = product over the children u of the root of sum_j a_ij Phi_j(u),    Phi_i(.) = 1.
 *
 * For a Rosenbrock method, a node with one child has a_ij + gamma_ij in place of a_ij (Hairer and Wanner, Solving ODE
 * II, IV.7, theorem 7.5).
 *
 * Weights w have order p if sum_i w_i Phi_i(t) = 1 / gamma(t) for all trees of up to p nodes (theorem 2.13). For a
 * difference of two such weights the sum is 0. For weights that depend on theta the sum is theta^rho(t) / gamma(t), for
 * every theta (HNW II.6). The last condition is an identity between polynomials of degree 3 + dense_terms that both
 * vanish at 0. The identity is checked at as many further points.
 *
 * Trees are level sequences (the depth of each node in preorder). Each tree is generated from the previous one with the
 * algorithm of T. Beyer and S. M. Hedetniemi, SIAM J. Comput. 9 (1980) 706. The numbers of trees are
 *
 *     nodes  1  2  3  4  5   6   7    8
 *     trees  1  1  2  4  9  20  48  115
 *
 * Rounding: a coefficient rounded to double has a relative error of eps/2. A term of a tree of rho nodes is a product
 * of rho coefficients. So a residual of rho eps sum |terms| passes, which includes a factor of 2. Sums are formed in
 * long double.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { SLOTS = KT_METHOD_STAGES_MAX, NODES = KT_METHOD_ORDER_MAX, THETAS = 3 + KT_METHOD_DENSE_TERMS_MAX };

/* Weights over all slots, and the sums of the absolute values of their terms. */
typedef struct weights {
    long double value[SLOTS], size[SLOTS];
} weights;

/* The method extended to all slots: f(t1, y1) is a stage with the row b. */
typedef struct extended {
    const kt_method *method;
    bool implicit; /* a is a whole matrix */
    int slots, thetas;
    long double a[SLOTS][SLOTS];
    long double beta[SLOTS]
                    [SLOTS]; /* the factor of a node with one child: a itself, or a + gamma for a Rosenbrock method */
    weights b, e, e_low, dense[THETAS];
} extended;

typedef struct tree {
    int nodes;
    int level[NODES];                    /* depth of each node, in preorder */
    long double gamma;                   /* density */
    long double phi[SLOTS], size[SLOTS]; /* Phi_i, and Phi_i of the absolute values */
} tree;

static bool all_finite(const double *values, int count) {
    for (int i = 0; values != NULL && i < count; i++)
        if (!isfinite(values[i]))
            return false;
    return true;
}

static bool is_implicit(const kt_method *m) { return kt_method_family_of(m)->implicit; }

/* The index of a_ij in the method's array. */
static int entry_index_of(const kt_method *m, int i, int j) {
    return is_implicit(m) ? i * m->stages + j : i * (i - 1) / 2 + j;
}

/* Checks that all coefficients are finite and that an error estimate is not zero. With fsal, the last stage must be y1
 * at t1: its row of a is b, and c = 1. The row of an explicit method has no entry for b_s, so that b_s is 0. */
static kt_status check_entries(const kt_method *m, kt_error *error) {
    const int s = m->stages, w = kt_method_fresh(m) + 1, d = m->dense_stages;
    const bool finite = all_finite(m->a, is_implicit(m) ? s * s : s * (s - 1) / 2) && all_finite(m->b, s) &&
                        all_finite(m->c, s) && all_finite(m->e, s) && all_finite(m->e_low, s) &&
                        all_finite(m->gamma, s * s) &&
                        (d == 0 || (all_finite(m->dense_a, d * w + d * (d - 1) / 2) && all_finite(m->dense_c, d))) &&
                        (m->dense_terms == 0 || all_finite(m->dense_d, m->dense_terms * (w + d)));
    if (!finite)
        return kt_table_reject(m, error, "a coefficient is not finite");
    bool estimates = m->e == NULL;
    for (int i = 0; !estimates && i < s; i++)
        estimates = m->e[i] != 0.0;
    if (!estimates)
        return kt_table_reject(
            m, error, "all error weights are 0; leave out e and embedded_order, or give b minus the embedded weights");
    if (!m->fsal)
        return KT_OK;
    bool same = m->c[s - 1] == 1.0 && (is_implicit(m) || m->b[s - 1] == 0.0);
    for (int j = 0; j < (is_implicit(m) ? s : s - 1); j++)
        same = same && m->a[entry_index_of(m, s - 1, j)] == m->b[j];
    return same ? KT_OK : kt_table_reject(m, error, "fsal is set, but the last row of a is not b, or the last c not 1");
}

/* Weights with the rounding of `values`, and of `sizes` if they are differences that include these (NULL: none). */
static void set_weights(weights *w, const double *values, int count, const double *sizes) {
    for (int i = 0; i < SLOTS; i++) {
        w->value[i] = i < count && values != NULL ? (long double)values[i] : 0.0L;
        w->size[i] = fabsl(w->value[i]) + (i < count && sizes != NULL ? fabsl((long double)sizes[i]) : 0.0L);
    }
}

/* w += factor * (row over `count` slots) */
static void add_weights(weights *w, long double factor, const weights *row, int count) {
    for (int i = 0; i < count; i++) {
        w->value[i] += factor * row->value[i];
        w->size[i] += fabsl(factor) * row->size[i];
    }
}

/* (y(theta) - y0) / h as weights of the slopes: the form in the public header, expanded. */
static void set_dense_weights(extended *x, long double theta, weights *w) {
    const long double rest = 1.0L - theta;
    const int fresh = kt_method_fresh(x->method);
    set_weights(w, NULL, 0, NULL);
    add_weights(w, theta * theta * (3.0L - 2.0L * theta), &x->b, x->slots);
    w->value[0] += theta * rest * rest;
    w->size[0] += theta * rest * rest;
    w->value[fresh] -= theta * theta * rest;
    w->size[fresh] += theta * theta * rest;
    long double factor = theta * theta * rest * rest;
    for (int term = 0; term < x->method->dense_terms; term++) {
        weights d;
        set_weights(&d, x->method->dense_d + term * x->slots, x->slots, NULL);
        add_weights(w, factor, &d, x->slots);
        factor *= term % 2 == 0 ? theta : rest;
    }
}

/* Writes the method as one table of `slots` rows in long double: stages, the slope at the end of the step, and the
 * additional stages of the dense output. beta is a + gamma for Rosenbrock methods. */
static void extend_table(const kt_method *m, extended *x) {
    const int s = m->stages, fresh = kt_method_fresh(m);
    x->method = m;
    x->implicit = is_implicit(m);
    x->slots = kt_method_slots(m);
    for (int i = 0; i < SLOTS; i++)
        for (int j = 0; j < SLOTS; j++)
            x->a[i][j] = 0.0L;
    for (int i = 0; i < s; i++)
        for (int j = 0; j < (x->implicit ? s : i); j++)
            x->a[i][j] = (long double)m->a[entry_index_of(m, i, j)];
    for (int j = 0; j < fresh; j++)
        x->a[fresh][j] = (long double)m->b[j];
    const double *row = m->dense_a;
    for (int i = fresh + 1; i < x->slots; row += i, i++)
        for (int j = 0; j < i; j++)
            x->a[i][j] = (long double)row[j];
    memcpy(x->beta, x->a, sizeof x->beta);
    for (int i = 0; m->gamma != NULL && i < s * s; i++)
        x->beta[i / s][i % s] += (long double)m->gamma[i];
    set_weights(&x->b, m->b, s, NULL);
    set_weights(&x->e, m->e, s, m->b); /* e = b minus the embedded weights has the rounding of b */
    set_weights(&x->e_low, m->e_low, s, m->b);
    x->thetas = 3 + m->dense_terms;
    for (int i = 0; i < x->thetas; i++)
        set_dense_weights(x, (long double)(i + 1) / (long double)x->thetas, &x->dense[i]);
}

/* c_i = sum_j a_ij for all slots, within the rounding of the coefficients to double. */
static kt_status check_row_sums(const extended *x, kt_error *error) {
    const kt_method *m = x->method;
    const int fresh = kt_method_fresh(m);
    for (int i = 0; i < x->slots; i++) {
        const double c = i < m->stages ? m->c[i] : i == fresh ? 1.0 : m->dense_c[i - fresh - 1];
        long double sum = 0.0L, size = fabsl((long double)c);
        for (int j = 0; j < (x->implicit ? x->slots : i); j++) {
            sum += x->a[i][j];
            size += fabsl(x->a[i][j]);
        }
        if (!(fabsl(sum - (long double)c) <= (long double)DBL_EPSILON * size)) {
            char message[160];
            snprintf(message, sizeof message,
                     "stage %d: the row of a sums to %.17g, but c is %.17g; they must be equal", i + 1, (double)sum, c);
            return kt_table_reject(m, error, message);
        }
    }
    return KT_OK;
}

/* Generates the next tree with the same number of nodes. p is the last node of level above 1, and q its parent. The
 * levels of the nodes q .. p - 1 are repeated from p on. Returns false after the last tree. */
static bool next_tree(tree *t) {
    int p = t->nodes - 1;
    while (p > 0 && t->level[p] <= 1)
        p--;
    if (p <= 0)
        return false;
    int q = p - 1;
    while (t->level[q] != t->level[p] - 1)
        q--;
    for (int i = p; i < t->nodes; i++)
        t->level[i] = t->level[i - (p - q)];
    return true;
}

static int tree_parent_of(const tree *t, int v) {
    int parent = v - 1;
    while (t->level[parent] != t->level[v] - 1)
        parent--;
    return parent;
}

/* Computes Phi, its absolute values and gamma, from the leaves to the root: each node multiplies A Phi(node) into its
 * parent. */
static void find_tree_weight(const extended *x, tree *t) {
    long double phi[NODES][SLOTS], size[NODES][SLOTS];
    int count[NODES], children[NODES] = {0};
    for (int v = 1; v < t->nodes; v++)
        children[tree_parent_of(t, v)]++;
    for (int v = 0; v < t->nodes; v++) {
        count[v] = 1;
        for (int i = 0; i < x->slots; i++)
            phi[v][i] = size[v][i] = 1.0L;
    }
    t->gamma = 1.0L;
    for (int v = t->nodes - 1; v > 0; v--) {
        const int parent = tree_parent_of(t, v);
        for (int i = 0; i < x->slots; i++) {
            const long double *weight = children[parent] == 1 ? x->beta[i] : x->a[i];
            long double value = 0.0L, absolute = 0.0L;
            for (int j = 0; j < (x->implicit ? x->slots : i); j++) {
                value += weight[j] * phi[v][j];
                absolute += fabsl(weight[j]) * size[v][j];
            }
            phi[parent][i] *= value;
            size[parent][i] *= absolute;
        }
        t->gamma *= (long double)count[v];
        count[parent] += count[v];
    }
    t->gamma *= (long double)t->nodes;
    for (int i = 0; i < x->slots; i++) {
        t->phi[i] = phi[0][i];
        t->size[i] = size[0][i];
    }
}

/* Writes a tree as text: a leaf is ".", any other node is its children in brackets. */
static void write_rooted_tree(const tree *t, char *text) {
    for (int v = 0; v < t->nodes; v++) {
        const int next = v + 1 < t->nodes ? t->level[v + 1] : 0;
        *text++ = next > t->level[v] ? '[' : '.';
        for (int l = t->level[v]; l > next; l--)
            *text++ = ']';
    }
    *text = '\0';
}

/* Checks the condition of one tree, sum_i w_i Phi_i(t) = target, within rho eps sum |terms| (see above). */
static kt_status check_condition(const extended *x, const tree *t, const weights *w, long double target,
                                 const char *what, kt_error *error) {
    long double sum = 0.0L, size = 0.0L;
    for (int i = 0; i < x->slots; i++) {
        sum += w->value[i] * t->phi[i];
        size += w->size[i] * t->size[i];
    }
    const long double sums = LDBL_EPSILON * (long double)x->slots; /* rounding of the sums; it matters if long double
                                                                      is double */
    if (fabsl(sum - target) <= (long double)t->nodes * ((long double)DBL_EPSILON + sums) * size)
        return KT_OK;
    char shape[2 * NODES + 1], message[320];
    write_rooted_tree(t, shape);
    snprintf(
        message, sizeof message,
        "%s: the condition of order %d of the tree %s fails: the sum is %.17g, not %.17g (off by %.3g). Correct the "
        "coefficients, give them to 17 digits, or claim a lower order",
        what, t->nodes, shape, (double)sum, (double)target, (double)(sum - target));
    return kt_table_reject(x->method, error, message);
}

/* Checks all conditions of one tree. */
static kt_status check_tree(const extended *x, const tree *t, kt_error *error) {
    const kt_method *m = x->method;
    const int n = t->nodes;
    kt_status status = KT_OK;
    if (n <= m->order)
        status = check_condition(x, t, &x->b, 1.0L / t->gamma, "b", error);
    if (status == KT_OK && n <= m->embedded_order)
        status = check_condition(x, t, &x->e, 0.0L, "error weights e", error);
    if (status == KT_OK && n <= m->embedded_order_low)
        status = check_condition(x, t, &x->e_low, 0.0L, "error weights e_low", error);
    const int dense_order = m->gamma == NULL ? kt_method_dense_order(m) : 0; /* a Rosenbrock method has its own */
    for (int i = 0; status == KT_OK && n <= dense_order && i < x->thetas; i++) {
        const long double theta = (long double)(i + 1) / (long double)x->thetas;
        status = check_condition(x, t, &x->dense[i], powl(theta, (long double)n) / t->gamma, "dense output", error);
    }
    return status;
}

/* The first tree: a path, in which each node has one child. */
static tree first_tree(int nodes) {
    tree t = {.nodes = nodes};
    for (int v = 0; v < nodes; v++)
        t.level[v] = v;
    return t;
}

int kt_tree_count(int nodes) {
    tree t = first_tree(nodes);
    int count = 1;
    while (next_tree(&t))
        count++;
    return count;
}

static int larger_index(int a, int b) { return a > b ? a : b; }

kt_status kt_method_check(const kt_method *method, kt_error *error) {
    if (KT_IS_MISSING(error, method))
        return KT_ERROR_ARGUMENT;
    kt_status status = kt_method_check_sizes(method, error);
    if (status == KT_OK)
        status = check_entries(method, error);
    if (status != KT_OK)
        return status;

    extended x;
    extend_table(method, &x);
    status = check_row_sums(&x, error);
    const kt_method_family *family = kt_method_family_of(method);
    if (status == KT_OK && family->check_order != NULL)
        status = family->check_order(method, error);

    const int last = larger_index(larger_index(method->order, kt_method_dense_order(method)),
                                  larger_index(method->embedded_order, method->embedded_order_low));
    for (int nodes = 1; status == KT_OK && nodes <= last; nodes++) {
        tree t = first_tree(nodes);
        do {
            find_tree_weight(&x, &t);
            status = check_tree(&x, &t, error);
        } while (status == KT_OK && next_tree(&t));
    }
    return status;
}
