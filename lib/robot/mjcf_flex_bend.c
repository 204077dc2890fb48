/* Bending of surfaces of MJCF (<flexcomp> with elastic2d="bend" or "both").
 *
 * Two triangles with a common edge x_01 and the other corners x_2, x_3 have the energy 1/2 sum_ij b_ij x_i . x_j,
 *     b = 3 mu t^3 cos(theta) / (24 A) c c'
 * The vector c has the sums of cotangents of the angles at the edge. The thickness is t. At rest, both triangles have
 * the area A, and theta is the angle between them (Wardetzky et al., "Discrete quadratic curvature energies", 2007). A
 * surface that is curved at rest also has the energy b_4 x_01 . (x_02 x x_03) (Garg et al., "Cubic shells", 2007).
 * Damping is c sum_j b_ij x_j'.
 *
 * MuJoCo 3.14 computes b for the ends of the edge in the order of the first triangle, and uses it for the ends in the
 * order of their numbers. If the order differs and the ends are not alike, forces act at rest there. Here they do
 * not, and a warning counts such surfaces.
 *
 * The sums over all edges are one sparse matrix for each axis. A row of it is the force in a slide, an `expression`.
 * Source: user_mesh.cc, engine_passive.c. */
#include "robot/mjcf_elastic.h"

#include <math.h>
#include <stdlib.h>

enum { BENT_TERMS = 30 }; /* variables of a formula, fewer than KT_FORMULA_VARIABLE_MAX */

/* An edge of a triangle, from its lower to its higher corner, and the corner across. */
typedef struct bent_side {
    int low, high, order, first, second, across;
} bent_side;

/* A common edge of two triangles (0, 1), and the corners across. */
typedef struct bent_pair {
    int v[4];
    double b[4][4], curved;
    bool is_exchanged; /* MuJoCo exchanges 0 and 1 in `b`, and they are not alike */
} bent_pair;

/* An entry of the matrix of all edges. */
typedef struct bent_entry {
    int row, column;
    double value;
} bent_entry;

static int order_bent_sides(const void *a, const void *b) {
    const bent_side *x = a, *y = b;
    return x->low != y->low     ? (x->low > y->low) - (x->low < y->low)
           : x->high != y->high ? (x->high > y->high) - (x->high < y->high)
                                : (x->order > y->order) - (x->order < y->order);
}

static int order_bent_entries(const void *a, const void *b) {
    const bent_entry *x = a, *y = b;
    return x->row != y->row ? (x->row > y->row) - (x->row < y->row) : (x->column > y->column) - (x->column < y->column);
}

/* The cotangent of the angle at a corner of a triangle. */
static double cotangent_at(const kt_flex *f, int at, int one, int other) {
    const kt_vec3 a = kt_elastic_span(f, at, one), b = kt_elastic_span(f, at, other);
    return kt_vec3_dot(a, b) / kt_vec3_norm(kt_vec3_cross(a, b));
}

static double area_of_corners(const kt_flex *f, int a, int b, int c) {
    return 0.5 * kt_vec3_norm(kt_vec3_cross(kt_elastic_span(f, a, b), kt_elastic_span(f, a, c)));
}

static void find_bending(const kt_flex *f, const kt_elasticity *l, bent_pair *p) {
    const int *v = p->v;
    const double a01 = cotangent_at(f, v[0], v[1], v[2]), a02 = cotangent_at(f, v[0], v[3], v[1]);
    const double a03 = cotangent_at(f, v[1], v[2], v[0]), a04 = cotangent_at(f, v[1], v[0], v[3]);
    const double c[4] = {a03 + a04, a01 + a02, -(a01 + a03), -(a02 + a04)};
    const double area = area_of_corners(f, v[0], v[1], v[2]) + area_of_corners(f, v[0], v[1], v[3]);
    const double mu = l->young / (2.0 * (1.0 + l->poisson));
    const double stiffness = 3.0 * mu * pow(l->thickness, 3.0) / (24.0 * area);
    const kt_vec3 e0 = kt_elastic_span(f, v[0], v[1]), e1 = kt_elastic_span(f, v[0], v[2]),
                  e2 = kt_elastic_span(f, v[0], v[3]), e3 = kt_elastic_span(f, v[1], v[2]),
                  e4 = kt_elastic_span(f, v[1], v[3]);
    const kt_vec3 t0 = kt_vec3_add(kt_vec3_scale(-a03, e1), kt_vec3_scale(-a01, e3));
    const kt_vec3 t1 = kt_vec3_add(kt_vec3_scale(-a04, e2), kt_vec3_scale(-a02, e4));
    const double square = kt_vec3_dot(e0, e0), cosine = -kt_vec3_dot(t0, t1) / square;
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 4; k++)
            p->b[i][k] = c[i] * c[k] * cosine * stiffness;
    const kt_vec3 normal = kt_vec3_cross(e0, e1);
    const double height = kt_vec3_dot(normal, e2);
    const bool is_flat = fabs(height) <= 1e-12 * kt_vec3_norm(normal) * kt_vec3_norm(e2);
    p->curved = is_flat ? 0.0 : height * (a01 - a03) * (a04 - a02) * stiffness / (square * sqrt(square));
    p->is_exchanged = v[0] > v[1] && (fabs(c[0] - c[1]) > 1e-9 * (fabs(c[0]) + fabs(c[1])) || p->curved != 0.0);
}

/* All sides of triangles that two of them share, in *count; NULL: no memory. The first triangle gives the direction. */
static bent_pair *list_pairs(kt_mjcf *m, const kt_flex *f, int *count) {
    const size_t all = 3 * (size_t)f->element_count;
    bent_side *sides = kt_reader_take(m->r, &m->r->scratch, all + 1, sizeof *sides);
    bent_pair *pairs = kt_reader_take(m->r, &m->r->scratch, all + 1, sizeof *pairs);
    *count = 0;
    if (sides == NULL || pairs == NULL)
        return NULL;
    for (size_t i = 0; i < all; i++) {
        const int *v = f->elements + 3 * (i / 3);
        const int one = v[(i + 1) % 3], two = v[(i + 2) % 3];
        sides[i] = (bent_side){one < two ? one : two, one < two ? two : one, (int)i, one, two, v[i % 3]};
    }
    qsort(sides, all, sizeof *sides, order_bent_sides);
    for (size_t i = 0, n; i < all; i = n) {
        for (n = i + 1; n < all && sides[n].low == sides[i].low && sides[n].high == sides[i].high; n++)
            continue;
        if (n > i + 1)
            pairs[(*count)++] =
                (bent_pair){.v = {sides[i].first, sides[i].second, sides[i].across, sides[n - 1].across}};
    }
    return pairs;
}

/* ---- forces ------------------------------------------------------------------------------------------------------ */

static void act_on_coordinate(kt_mjcf *m, const kt_elastic *p, int point, int axis, const kt_mjcf_formula *formula) {
    const kt_mjcf_body *b = kt_mjcf_body_at(m, p->body[point]);
    kt_effect *effect = kt_elastic_add(m, p->f, formula);
    if (effect != NULL)
        effect->joint = kt_mjcf_joint_at(m, b->first_joint + axis)->name;
}

/* The force in a slide by a part of a row, or the damping. */
static void act_by_row(kt_mjcf *m, const kt_elastic *p, const bent_entry *row, int count, int axis, double damping) {
    for (int first = 0; first < count; first += BENT_TERMS) {
        const int last = first + BENT_TERMS < count ? first + BENT_TERMS : count;
        kt_mjcf_formula to = {.whole = true};
        double constant = 0.0;
        int variables = 0;
        kt_mjcf_put(&to, "0");
        for (int i = first; i < last; i++)
            variables += kt_elastic_put_point(m, p, row[i].column, axis, damping != 0.0,
                                              -row[i].value * (damping != 0.0 ? damping : 1.0), &constant, &to);
        if (damping == 0.0 && constant != 0.0)
            kt_mjcf_print(&to, " + %g", constant);
        if (variables > 0)
            act_on_coordinate(m, p, row->row, axis, &to);
    }
}

/* The product x_a x x_b of spans from corner 0, along an axis. */
static void put_cross(const kt_mjcf *m, const kt_elastic *p, const int *v, const int corners[2], int axis,
                      kt_mjcf_formula *to) {
    const int one = (axis + 1) % 3, two = (axis + 2) % 3;
    for (int term = 0; term < 2; term++) {
        kt_mjcf_put(to, term == 0 ? "(" : " - ");
        kt_elastic_put_span(m, p, (const int[]){v[0], v[corners[0]]}, term == 0 ? one : two, false, to);
        kt_mjcf_put(to, "*");
        kt_elastic_put_span(m, p, (const int[]){v[0], v[corners[1]]}, term == 0 ? two : one, false, to);
    }
    kt_mjcf_put(to, ")");
}

/* The forces of a pair that is curved at rest. */
static void act_by_curvature(kt_mjcf *m, const kt_elastic *p, const bent_pair *pair) {
    static const int others[3][2] = {{2, 3}, {3, 1}, {1, 2}};
    for (int i = 0; i < 4; i++)
        for (int axis = 0; axis < 3 && p->body[pair->v[i]] >= 0; axis++) {
            kt_mjcf_formula to = {.whole = true};
            kt_mjcf_print(&to, "%g*(", i == 0 ? pair->curved : -pair->curved);
            for (int k = 1; k < 4; k++) {
                if (i > 0 && k != i)
                    continue;
                kt_mjcf_put(&to, i == 0 && k > 1 ? " + " : "");
                put_cross(m, p, pair->v, others[k - 1], axis, &to);
            }
            kt_mjcf_put(&to, ")");
            act_on_coordinate(m, p, pair->v[i], axis, &to);
        }
}

/* Sums entries of one place; returns how many are left. */
static int join_entries(bent_entry *entries, int count) {
    int kept = 0;
    qsort(entries, (size_t)count, sizeof *entries, order_bent_entries);
    for (int i = 0; i < count; i++)
        if (kept > 0 && entries[kept - 1].row == entries[i].row && entries[kept - 1].column == entries[i].column)
            entries[kept - 1].value += entries[i].value;
        else
            entries[kept++] = entries[i];
    return kept;
}

void kt_elastic_resist_bending(kt_mjcf *m, const kt_elastic *p, const kt_elasticity *l) {
    int count, entry_count = 0;
    bool is_exchanged = false;
    bent_pair *pairs = list_pairs(m, p->f, &count);
    bent_entry *entries =
        kt_reader_take(m->r, &m->r->scratch, 16 * (size_t)(pairs != NULL ? count : 0) + 1, sizeof *entries);
    if (pairs == NULL || entries == NULL)
        return;
    for (int n = 0; n < count; n++) {
        find_bending(p->f, l, &pairs[n]);
        if (!isfinite(pairs[n].b[0][0])) {
            (void)kt_mjcf_fault(m, p->f->element, KT_ELASTIC_FLAT);
            return;
        }
        for (int i = 0; i < 4; i++)
            for (int k = 0; k < 4; k++)
                entries[entry_count++] = (bent_entry){pairs[n].v[i], pairs[n].v[k], pairs[n].b[i][k]};
        is_exchanged = is_exchanged || pairs[n].is_exchanged;
        if (pairs[n].curved != 0.0)
            act_by_curvature(m, p, &pairs[n]);
    }
    if (is_exchanged)
        kt_unknown_count(
            &m->changes,
            "bending of a flexcomp with unlike triangles: MuJoCo exchanges the ends of some edges, so that "
            "forces act on its surface at rest; none do here",
            p->f->element);
    entry_count = join_entries(entries, entry_count);
    for (int first = 0, end; first < entry_count && !m->r->out_of_memory; first = end) {
        for (end = first + 1; end < entry_count && entries[end].row == entries[first].row; end++)
            continue;
        for (int axis = 0; axis < 3 && p->body[entries[first].row] >= 0; axis++) {
            act_by_row(m, p, entries + first, end - first, axis, 0.0);
            if (l->damping != 0.0)
                act_by_row(m, p, entries + first, end - first, axis, l->damping);
        }
    }
}
