/* Units of coordinates whose couplings have large ratios.
 *
 * Which equations are independent is decided by comparing directions of A with each other. A gear of ratio R whose
 * second wheel is locked has the singular values R and 1 / R: beyond R = 1e5 the smaller one looks like rounding. In a
 * locked train of twelve stages of ratio 50, the least direction is 4e-21 of the largest. The equations are as regular
 * as the unit matrix if each wheel is measured by the angle that it turns while the others do. Such units e_i make the
 * terms of each coupling equal,
 *
 *     log |c_i e_i| = log |c_j e_j|   for all i, j of a row,
 *
 * as in the scaling of Curtis & Reid (1972). The logarithms differ by constants along each row. Therefore union-find
 * with offsets satisfies all rows of a tree of couplings. A row that closes a cycle depends on the others, or locks
 * them, and is left out. The fastest wheel of a set keeps its natural unit, and all other wheels have smaller units.
 *
 * Only groups whose units differ by more than RATIO are scaled (`balanced`). In all other sets, a direction of 1 /
 * RATIO^2 is far above KT_RANK_TOLERANCE. Units are powers of two times the natural ones.
 *
 * Lengths in metres have the same effect. The rows of a weld on a free joint are [1 L; 0 1] with the mechanism's length
 * L, and their singular values are L and 1 / L. In rows and coordinates relative to L, the singular values are of the
 * size 1. Dense groups are therefore scaled, too, if L is beyond RATIO metres, or below 1 / RATIO.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/attach.h"
#include "constraint/formula_row.h"
#include "constraint/group.h"

#include <math.h>

/* Binary logarithms: of the ratio from which on a group is scaled, and of the largest unit. */
#define RATIO 12.0
#define MOST 500.0

/* The root of a link's set; *exponent: the logarithm of the link's unit over the root's unit. */
static int32_t find_coupled(kt_attach *a, int32_t link, double *exponent) {
    double sum = 0.0;
    int32_t root = link;
    for (; a->coupled[root] != root; root = a->coupled[root])
        sum += a->exponent[root];
    *exponent = sum;
    while (link != root) { /* each link on the way becomes a neighbour of the root */
        const int32_t next = a->coupled[link];
        const double own = a->exponent[link];
        a->coupled[link] = root;
        a->exponent[link] = sum;
        sum -= own;
        link = next;
    }
    return root;
}

/* Unites the sets of two links, whose units differ by `more` (of the second over the first). The ground stays a
 * root. */
static void unite_with(kt_attach *a, int32_t first, int32_t second, double more) {
    double of_first, of_second;
    int32_t to = find_coupled(a, first, &of_first), from = find_coupled(a, second, &of_second);
    double exponent = of_first + more - of_second;
    if (to == from)
        return;
    if (from == 0) {
        from = to;
        to = 0;
        exponent = -exponent;
    }
    a->coupled[from] = to;
    a->exponent[from] = exponent;
}

static double natural_unit(const kt_model *m, int32_t l) {
    const kt_link *link = &m->link[l];
    return m->unit[m->group[link->group].v + link->local];
}

static bool is_constant_coupling(const kt_loop_record *loop) {
    return !kt_loop_is_off(loop) && loop->term_count > 1 && !kt_has_formula_row(loop);
}

/* The logarithm of a term of a coupling, for a natural unit; minus infinity if the term is zero. */
static double term_size(const kt_model *m, const kt_term_record *term) {
    return log2(fabs(term->coefficient) * natural_unit(m, term->link));
}

/* Unites the links of a coupling. Their units then differ by the ratio of the coupling's terms. */
static void unite_coupled(kt_attach *a, const kt_model *m, const kt_loop_record *loop) {
    int32_t first = -1;
    double size = 0.0;
    for (int k = 0; k < loop->term_count; k++) {
        const kt_term_record *term = &m->term[loop->term + k];
        if (term->coefficient == 0.0)
            continue;
        if (first < 0) {
            first = term->link;
            size = term_size(m, term);
        } else {
            unite_with(a, first, term->link, size - term_size(m, term));
        }
    }
}

/* The logarithm of a link's unit over its natural unit, a whole number. */
static double balanced_exponent(kt_attach *a, int32_t link) {
    double exponent;
    const int32_t root = find_coupled(a, link, &exponent);
    return fmax(-MOST, fmin(MOST, nearbyint(exponent - (root > 0 ? a->highest[root] : 0.0))));
}

/* The range of numbers. */
typedef struct span {
    double low, high;
} span;
static void span_add(span *s, double x) {
    s->low = fmin(s->low, x);
    s->high = fmax(s->high, x);
}

/* The range of the sizes of a group's couplings, in natural units. */
static span sizes_of_couplings(const kt_model *m, const kt_group *group) {
    span sizes = {(double)INFINITY, -(double)INFINITY};
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &m->loop[m->group_loop[group->loop + i]];
        double most = -(double)INFINITY;
        for (int k = 0; k < loop->term_count && is_constant_coupling(loop); k++)
            most = fmax(most, term_size(m, &m->term[loop->term + k]));
        if (isfinite(most))
            span_add(&sizes, most);
    }
    return sizes;
}

/* Balances the units of a group's coordinates if units or couplings differ by more than 2^RATIO. */
static void balance_group(kt_attach *a, kt_model *m, kt_group *group) {
    const span sizes = sizes_of_couplings(m, group);
    span units = {0.0, 0.0};
    for (int i = 0; i < group->link_count; i++)
        span_add(&units, balanced_exponent(a, m->group_link[group->link + i]));
    group->balanced = units.high - units.low > RATIO || sizes.high - sizes.low > RATIO;
    for (int i = 0; i < group->link_count && group->balanced; i++) {
        const int32_t l = m->group_link[group->link + i];
        for (int k = 0; k < kt_link_dofs(&m->link[l]); k++)
            m->unit[group->v + m->link[l].local + k] *= exp2(balanced_exponent(a, l));
    }
}

static bool has_geometry(const kt_model *m, const kt_group *group) {
    for (int i = 0; i < group->loop_count; i++)
        if (m->loop[m->group_loop[group->loop + i]].term_count == 0)
            return true;
    return false;
}

void kt_attach_balance_lengths(kt_model *m) {
    for (size_t g = 0; g < m->n.group && fabs(log2(m->length)) > RATIO; g++) {
        kt_group *group = &m->group[g];
        if (group->has_fronts || !has_geometry(m, group))
            continue;
        group->balanced = true;
        group->ranges = false;
    }
}

void kt_attach_balance(kt_attach *a, kt_model *m) {
    for (size_t l = 0; l < m->n.link; l++) {
        const kt_link *link = &m->link[l];
        const bool fixed =
            link->group < 0 || !kt_link_dofs(link) || !m->is_linear[m->group[link->group].v + link->local];
        a->coupled[l] = fixed ? 0 : (int32_t)l;
        a->exponent[l] = 0.0;
        a->highest[l] = -(double)INFINITY;
    }
    for (size_t i = 0; i < m->n.loop; i++)
        if (is_constant_coupling(&m->loop[i]))
            unite_coupled(a, m, &m->loop[i]);
    for (size_t l = 1; l < m->n.link; l++) {
        double exponent;
        double *highest = &a->highest[find_coupled(a, (int32_t)l, &exponent)];
        *highest = fmax(*highest, exponent);
    }
    for (size_t g = 0; g < m->n.group; g++)
        balance_group(a, m, &m->group[g]);
}
