/* Constraint groups: loops whose paths share a link form a group. Sets of links are joined by union-find.
 *
 * The paths of a group are connected. If two paths share a link, their ancestors lie on one support (path to the
 * ground). The lower ancestor then lies on the other loop's path. Therefore a group has one parent link, which carries
 * the whole group, and different groups have no coordinate in common.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/attach.h"
#include "compile/compile.h"
#include "constraint/formula_row.h"
#include "constraint/group.h"
#include "evaluate/evaluate.h"

#include <string.h>

/* The root of a set. Each step halves the path to the root, so that later calls are shorter. */
static int32_t set_of(kt_attach *a, int32_t i) {
    while (a->above[i] != i) {
        a->above[i] = a->above[a->above[i]];
        i = a->above[i];
    }
    return i;
}

void kt_attach_join(kt_attach *a, int32_t i, int32_t j) { a->above[set_of(a, i)] = set_of(a, j); }

/* Groups of fewer coordinates in all are never reduced by fronts of their own accord. */
enum { KT_FRONT_LEAST = 10 };

void kt_attach_number_groups(kt_attach *a, kt_counts *n) {
    for (size_t i = 0; i < n->link; i++)
        a->number[i] = -1;
    for (size_t i = 0; i < n->loop; i++) {
        kt_loop_record *r = &a->loop[i];
        if (kt_loop_is_off(r))
            continue;
        const int32_t some = kt_attach_is_relation(r->type) ? r->link[0] : r->link[r->length[0] ? 0 : 1];
        int32_t *number = &a->number[set_of(a, some)];
        if (*number < 0)
            *number = (int32_t)n->group++;
        r->group = *number;
    }
    for (size_t i = 1; i < n->link; i++)
        if (a->number[set_of(a, (int32_t)i)] >= 0) {
            n->group_link++;
            n->group_v += (size_t)kt_link_dofs(&a->tree->link[i]);
        }
    const bool large = n->group_v >= KT_FRONT_LEAST || a->tree->structure == KT_STRUCTURE_FRONTS;
    const bool allowed = a->tree->reduction->fronts && a->tree->structure != KT_STRUCTURE_DENSE;
    n->front = large && allowed ? n->group_link : 0;
}

/* Determines the sizes of the groups, and the position of each loop and link in its group. */
static void measure_groups(kt_attach *a, kt_model *m) {
    for (size_t g = 0; g < m->n.group; g++)
        m->group[g] = (kt_group){.parent = -1};
    for (size_t i = 0; i < m->n.loop; i++) {
        if (kt_loop_is_off(&m->loop[i]))
            continue;
        kt_group *group = &m->group[m->loop[i].group];
        m->loop[i].row = group->row_count;
        group->row_count += m->loop[i].row_count;
        group->loop_count++;
    }
    for (size_t i = 1; i < m->n.link; i++) {
        kt_link *link = &m->link[i];
        link->group = a->number[set_of(a, (int32_t)i)];
        if (link->group < 0)
            continue;
        kt_group *group = &m->group[link->group];
        if (group->parent < 0)
            group->parent = link->parent; /* the first link is the highest */
        group->planar = kt_link_is_planar(m, i);
        link->local = group->v_count;
        group->v_count += kt_link_dofs(link);
        group->link_count++;
    }
}

/* Lays out the groups one after the other in the lists of loops, links, coordinates, equations and matrices. */
static void number_groups(kt_model *m) {
    int32_t loop = 0, link = 0, v = 0, row = 0;
    m->n.entry = 0;
    for (size_t g = 0; g < m->n.group; g++) {
        kt_group *group = &m->group[g];
        group->loop = loop;
        group->link = link;
        group->v = v;
        group->row = row;
        loop += group->loop_count;
        link += group->link_count;
        v += group->v_count;
        group->entry = m->n.entry;
        m->n.entry += (size_t)group->row_count * (size_t)group->v_count;
        for (int32_t k = 0; k < group->row_count; k++)
            m->slot[row++] = k;
        for (int k = 0; k < KT_ROWS_COUNT; k++) { /* upper bounds, until ranks are determined */
            group->count[k] = group->row_count;
            group->rank[k] = group->row_count < group->v_count ? group->row_count : group->v_count;
        }
        m->link[group->parent].branches = true;
        if (kt_link_is_planar(m, (size_t)group->parent))
            m->planar[group->parent + m->to_planar].branches = true;
        group->loop_count = group->link_count = 0; /* counted again while the lists are filled */
    }
    for (size_t i = 0; i < m->n.loop; i++)
        if (!kt_loop_is_off(&m->loop[i]))
            m->loop[i].slot = m->group[m->loop[i].group].row + m->loop[i].row;
}

/* Marks planar links whose accelerations other links need; a group computes the accelerations of its links all at
 * once. */
static void mark_passing(kt_model *m) {
    for (size_t i = m->n.planar; i-- > 1;) {
        const kt_planar_link *link = &m->planar[i];
        kt_planar_link *up = &m->planar[link->parent];
        up->carries_others |= link->carries_others || link->group < 0 || link->group != up->group;
    }
}

void kt_articulated_number(kt_model *m) {
    int32_t count = 1;
    for (size_t i = 1; i < m->n.link; i++) {
        kt_link *link = &m->link[i];
        const bool used = m->n.group > 0 || link->branches || kt_link_dofs(link) > 1;
        link->articulated = used ? count++ : 0;
    }
    m->n.articulated = (size_t)count;
}

/* ---- islands ----------------------------------------------------------------------------------------------------- */

/* The groups have been filled, so that the sets of links are no longer needed. Here a->above joins groups, and
 * a->number is scratch: first a group on each base (island_of), then a sum for each island. */

enum island_sum { ISLAND_COORDINATES, ISLAND_EQUATIONS };

/* The largest number in `number`, which has one for each island. */
static size_t largest_of_islands(const kt_attach *a, const kt_model *m) {
    int32_t most = 0;
    for (size_t g = 0; g < m->n.group; g++)
        most = a->number[g] > most ? a->number[g] : most;
    return (size_t)most;
}

/* The largest number of coordinates, or of equations, of an island. */
static size_t most_of_islands(kt_attach *a, const kt_model *m, enum island_sum what) {
    memset(a->number, 0, m->n.group * sizeof *a->number);
    for (size_t g = 0; g < m->n.group; g++)
        a->number[m->group[g].island] += what == ISLAND_COORDINATES ? m->group[g].v_count : m->group[g].row_count;
    return largest_of_islands(a, m);
}

/* The largest number of loops of an island that bound a side. */
static size_t most_sides_of_islands(kt_attach *a, const kt_model *m) {
    memset(a->number, 0, m->n.group * sizeof *a->number);
    for (size_t i = 0; i < m->n.loop; i++)
        if (m->loop[i].group >= 0)
            a->number[m->group[m->loop[i].group].island] += m->loop[i].side != KT_SIDE_NONE;
    return largest_of_islands(a, m);
}

/* Finds the islands: joins groups with links on the same base. Numbers them, in the order of their first groups.
 * For each base, a->number becomes a group on this base, or -1. Overwrites the sets of links. */
static void number_islands(kt_attach *a, kt_model *m) {
    for (size_t g = 0; g < m->n.group; g++)
        a->above[g] = (int32_t)g;
    for (size_t i = 0; i < m->n.link; i++)
        a->number[i] = -1;
    for (int32_t g = 0; g < (int32_t)m->n.group; g++)
        for (int32_t l = 0; l < m->group[g].link_count; l++) {
            int32_t *first = &a->number[a->base[m->group_link[m->group[g].link + l]]];
            if (*first < 0)
                *first = g;
            else
                a->above[set_of(a, g)] = set_of(a, *first);
        }
    for (int32_t g = 0; g < (int32_t)m->n.group; g++)
        m->group[g].island = set_of(a, g);
    for (size_t g = 0; g < m->n.group; g++)
        a->above[g] = -1;
    for (size_t g = 0; g < m->n.group; g++) {
        int32_t *number = &a->above[m->group[g].island];
        if (*number < 0)
            *number = (int32_t)m->n.island++;
        m->group[g].island = *number;
    }
}

/* The island of a link; -1: none is on its base. */
static int32_t island_of(const kt_attach *a, const kt_model *m, size_t link) {
    const int32_t group = link > 0 ? a->number[a->base[link]] : -1;
    return group >= 0 ? m->group[group].island : -1;
}

/* Lists the coordinates of all islands. */
static void list_island_coordinates(const kt_attach *a, kt_model *m) {
    int32_t v = 0;
    for (size_t i = 0; i < m->n.island; i++)
        m->island[i] = (kt_island){.v = 0};
    for (size_t i = 1; i < m->n.link; i++)
        if (island_of(a, m, i) >= 0)
            m->island[island_of(a, m, i)].v_count += kt_link_dofs(&m->link[i]);
    for (size_t i = 0; i < m->n.island; i++) {
        m->island[i].v = v;
        v += m->island[i].v_count;
        m->island[i].v_count = 0;
    }
    for (size_t i = 1; i < m->n.link; i++) {
        kt_island *island = island_of(a, m, i) >= 0 ? &m->island[island_of(a, m, i)] : NULL;
        for (int k = 0; island != NULL && k < kt_link_dofs(&m->link[i]); k++)
            m->island_coordinate[island->v + island->v_count++] = m->link[i].v + k;
    }
}

/* Numbers the islands, which are sets of groups and links that move together, and finds the largest sizes among
 * them. */
static void set_islands(kt_attach *a, kt_model *m) {
    m->n.island = 0;
    number_islands(a, m);
    list_island_coordinates(a, m);
    m->n.island_v = most_of_islands(a, m, ISLAND_COORDINATES);
    m->n.island_row = most_of_islands(a, m, ISLAND_EQUATIONS);
    m->n.island_side = most_sides_of_islands(a, m);
}

static void mark_link_nonlinear(kt_model *m, int32_t l) {
    const kt_link *link = &m->link[l];
    for (int k = 0; link->group >= 0 && k < kt_link_dofs(link); k++)
        m->is_linear[m->group[link->group].v + link->local + k] = false;
}

/* Marks the coordinates that the formula of a coupling reads. The others of its terms, such as the follower of a cam,
 * have constant coefficients. */
static void mark_formula_nonlinear(kt_model *m, const kt_loop_record *loop) {
    int used[KT_EXPRESSION_LENGTH_MAX];
    const size_t count = kt_expression_symbols(kt_loop_formula(m, loop), KT_EXPRESSION_LENGTH_MAX, used);
    for (size_t i = 0; i < count; i++)
        mark_link_nonlinear(m, m->term[loop->term + used[i]].link);
}

/* Marks the coordinates that only relations with constant coefficients have: motions, couplings, gears. The equations
 * of such coordinates are linear, so that steps of any length are exact. */
static void mark_linear_coordinates(kt_model *m) {
    for (size_t i = 0; i < m->n.group_v; i++)
        m->is_linear[i] = true;
    for (size_t i = 0; i < m->n.loop; i++) {
        const kt_loop_record *loop = &m->loop[i];
        if (kt_has_formula_row(loop))
            mark_formula_nonlinear(m, loop);
        for (int end = 0; end < 2 && loop->term_count == 0 && !kt_loop_is_off(loop); end++)
            for (int32_t k = 0; k < loop->length[end]; k++)
                mark_link_nonlinear(m, m->path[loop->path[end] + k]);
    }
}

void kt_attach_fill_groups(kt_attach *a, kt_model *m) {
    measure_groups(a, m);
    number_groups(m);
    kt_articulated_number(m);
    if (m->n.group)
        m->forward = kt_closed_forward;
    for (size_t i = 0; i < m->n.loop; i++) {
        if (kt_loop_is_off(&m->loop[i]))
            continue;
        kt_group *group = &m->group[m->loop[i].group];
        m->group_loop[group->loop + group->loop_count++] = (int32_t)i;
    }
    for (size_t i = 1; i < m->n.link; i++) {
        const kt_link *link = &m->link[i];
        if (link->group < 0)
            continue;
        kt_group *group = &m->group[link->group];
        if (kt_link_is_planar(m, i)) {
            kt_planar_link *planar = &m->planar[(int32_t)i + m->to_planar];
            planar->group = link->group;
            planar->local = link->local;
            planar->first_of_group = group->link_count == 0;
        }
        m->group_link[group->link + group->link_count++] = (int32_t)i;
        for (int k = 0; k < kt_link_dofs(link); k++) {
            m->group_v[group->v + link->local + k] = link->v + k;
            m->unit[group->v + link->local + k] = k < kt_link_lengths(link) ? m->length : 1.0;
        }
    }
    mark_linear_coordinates(m);
    kt_attach_balance(a, m);
    mark_passing(m);
    for (size_t g = 0; g < m->n.group; g++)
        kt_form_begin(m, &m->group[g]);
    if (m->n.front)
        kt_attach_plan_fronts(a, m);
    kt_attach_balance_lengths(m);
    if (m->n.group > 0)
        set_islands(a, m);
    kt_groups_place_matrices(m);
}
