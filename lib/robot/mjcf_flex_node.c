/* Nodes of a <flexcomp> whose points follow a polynomial: dof="trilinear" or "quadratic".
 *
 * The box around all points has cells, by `cellcount`. A cell has two or three nodes along each axis. Neighbours share
 * them. Each node has three slides, and the points follow. A node of a trilinear cell has an equal part of the mass. A
 * node of a quadratic cell has the weights of Simpson's rule along each axis, for each of its cells. Two kinds of nodes
 * do not move: those in empty cells alone, and those within the box of a shell. A cell is empty if the boxes around all
 * elements miss it. For a surface it must also be reached from outside through empty cells. Source: user_flexcomp.cc,
 * user_mesh.cc. */
#include "robot/mjcf_flex.h"

#include <math.h>
#include <stdio.h>

typedef struct flex_cells {
    int n[3], order, nodes[3]; /* cells and nodes along each axis */
    const double *low, *high;  /* of the box */
    bool is_shell, *filled;
} flex_cells;

static void read_flex_cells(kt_mjcf *m, const kt_flex *f, flex_cells *c) {
    static const char *const words[] = {"none", "bend", "stretch", "both", NULL};
    const kt_element *elasticity = kt_xml_child(f->element, "elasticity");
    double count[3] = {1.0, 1.0, 1.0};
    (void)kt_mjcf_numbers(m, f->element, NULL, "cellcount", 3, 3, count);
    *c = (flex_cells){.order = f->motion == KT_FLEX_QUADRATIC ? 2 : 1, .low = f->low, .high = f->high};
    c->is_shell = elasticity != NULL && kt_mjcf_choice(m, elasticity, NULL, "elastic2d", words, 0) > 0;
    for (int k = 0; k < 3; k++) {
        c->n[k] = (int)fmin(fmax(count[k], 1.0), KT_FLEX_POINTS_MOST);
        c->nodes[k] = c->n[k] * c->order + 1;
    }
}

int kt_flex_node_count(kt_mjcf *m, const kt_flex *f) {
    flex_cells c;
    if (f->motion != KT_FLEX_TRILINEAR && f->motion != KT_FLEX_QUADRATIC)
        return 0;
    read_flex_cells(m, f, &c);
    return (int)fmin((double)c.nodes[0] * c.nodes[1] * c.nodes[2], KT_FLEX_POINTS_MOST + 1);
}

/* ---- cells ------------------------------------------------------------------------------------------------------- */

static int cell_at(const flex_cells *c, int i, int j, int k) { return (i * c->n[1] + j) * c->n[2] + k; }

static int cell_along(const flex_cells *c, int axis, double x) {
    const double size = c->high[axis] - c->low[axis];
    return size > 0.0 ? (int)fmax(0.0, fmin(c->n[axis] - 1.0, (x - c->low[axis]) / size * c->n[axis])) : 0;
}

/* Marks the cells that the box around an element overlaps. */
static void fill_flex_cells(const kt_flex *f, int element, const flex_cells *c) {
    int first[3] = {c->n[0], c->n[1], c->n[2]}, last[3] = {0, 0, 0};
    for (int v = 0; v <= f->dim; v++)
        for (int k = 0; k < 3; k++) {
            const int at = cell_along(c, k, f->points[f->elements[element * (f->dim + 1) + v]].at[k]);
            first[k] = at < first[k] ? at : first[k];
            last[k] = at > last[k] ? at : last[k];
        }
    for (int i = first[0]; i <= last[0]; i++)
        for (int j = first[1]; j <= last[1]; j++)
            for (int k = first[2]; k <= last[2]; k++)
                c->filled[cell_at(c, i, j, k)] = true;
}

/* Whether a cell without elements is outside: at the border, or next to one that is. */
static bool is_next_to_outside(const flex_cells *c, const bool *outside, const int at[3]) {
    for (int axis = 0; axis < 3; axis++)
        for (int step = -1; step <= 1; step += 2) {
            int next[3] = {at[0], at[1], at[2]};
            next[axis] += step;
            if (next[axis] < 0 || next[axis] >= c->n[axis] || outside[cell_at(c, next[0], next[1], next[2])])
                return true;
        }
    return false;
}

/* Fills the cells that a surface encloses. */
static bool fill_inside(kt_mjcf *m, const flex_cells *c) {
    const int count = c->n[0] * c->n[1] * c->n[2];
    bool *outside = kt_reader_take(m->r, &m->r->scratch, (size_t)count, sizeof *outside), changes = true;
    if (outside == NULL)
        return false;
    while (changes) {
        changes = false;
        for (int i = 0; i < count; i++) {
            const int at[3] = {i / (c->n[1] * c->n[2]), i / c->n[2] % c->n[1], i % c->n[2]};
            if (c->filled[i] || outside[i] || !is_next_to_outside(c, outside, at))
                continue;
            outside[i] = changes = true;
        }
    }
    for (int i = 0; i < count; i++)
        c->filled[i] = !outside[i];
    return true;
}

/* ---- nodes ------------------------------------------------------------------------------------------------------- */

/* Whether a node is in no cell that is filled, or within the box of a shell. */
static bool is_idle_node(const flex_cells *c, const int at[3]) {
    int low[3], high[3];
    bool is_within = true;
    for (int k = 0; k < 3; k++) {
        low[k] = at[k] == 0 ? 0 : (at[k] - 1) / c->order;
        high[k] = at[k] / c->order < c->n[k] - 1 ? at[k] / c->order : c->n[k] - 1;
        is_within = is_within && at[k] > 0 && at[k] < c->nodes[k] - 1;
    }
    if (c->is_shell)
        return is_within;
    for (int i = low[0]; i <= high[0]; i++)
        for (int j = low[1]; j <= high[1]; j++)
            for (int k = low[2]; k <= high[2]; k++)
                if (c->filled[cell_at(c, i, j, k)])
                    return false;
    return true;
}

static double weight_of_node(const flex_cells *c, const int at[3]) {
    double weight = 1.0;
    for (int k = 0; k < 3 && c->order == 2; k++) {
        const bool is_shared = at[k] > 0 && at[k] < c->nodes[k] - 1 && at[k] % 2 == 0;
        weight *= (at[k] % 2 == 0 ? 1.0 / 6.0 : 2.0 / 3.0) * (is_shared ? 2.0 : 1.0);
    }
    return weight;
}

static const char *name_flex_node(kt_mjcf *m, const kt_flex *f, const int at[3]) {
    char text[48];
    (void)snprintf(text, sizeof text, "_%d_%d_%d", at[0], at[1], at[2]);
    return kt_mjcf_join(m, f->element, f->name, text);
}

static bool find_filled(kt_mjcf *m, const kt_flex *f, flex_cells *c) {
    c->filled =
        kt_reader_take(m->r, &m->r->scratch, (size_t)c->n[0] * (size_t)c->n[1] * (size_t)c->n[2], sizeof *c->filled);
    if (c->filled == NULL)
        return false;
    for (int i = 0; i < f->element_count; i++)
        fill_flex_cells(f, i, c);
    return f->dim != 2 || fill_inside(m, c);
}

bool kt_flex_nodes(kt_mjcf *m, kt_flex *f, const bool *pinned) {
    flex_cells c;
    read_flex_cells(m, f, &c);
    const int count = c.nodes[0] * c.nodes[1] * c.nodes[2];
    kt_flex_point *nodes = kt_reader_take(m->r, &m->r->scratch, (size_t)count, sizeof *nodes);
    double mass = 0.0;
    if (nodes == NULL || !find_filled(m, f, &c))
        return false;
    for (int i = 0; i < count; i++) {
        const int at[3] = {i / (c.nodes[1] * c.nodes[2]), i / c.nodes[2] % c.nodes[1], i % c.nodes[2]};
        nodes[i].is_pinned = pinned[i] || is_idle_node(&c, at);
        nodes[i].mass = nodes[i].is_pinned ? 0.0 : weight_of_node(&c, at);
        nodes[i].name = name_flex_node(m, f, at);
        if (nodes[i].name == NULL)
            return false;
        for (int k = 0; k < 3; k++)
            nodes[i].at[k] = c.low[k] + at[k] * (c.high[k] - c.low[k]) / (c.nodes[k] - 1);
        mass += nodes[i].mass;
    }
    for (int i = 0; i < count; i++)
        nodes[i].mass *= kt_mjcf_number(m, f->element, NULL, "mass", 1.0) / (mass > 0.0 ? mass : 1.0);
    f->points = nodes;
    f->count = count;
    f->element_count = 0;
    return true;
}
