/* Elasticity of surfaces and solids of MJCF (<flexcomp> with <elasticity>), whose points are bodies.
 *
 * Stretching. With the lengths L_e of the edges of an element and the rest lengths l_e, MuJoCo's energy is
 *     E = 1/4 sum_ef k_ef (L_e^2 - l_e^2) (L_f^2 - l_f^2),   k_ef = mu tr(B_e B_f) + la tr B_e tr B_f,
 * with Lame's constants times the volume, and symmetric matrices B_e of the normals of the faces opposite to an edge.
 * It is that of Saint Venant and Kirchhoff. The force in edge e is a sum over all edges of the element,
 *     f_e = -L_e sum_f k_ef (L_f^2 - l_f^2 + 2 c L_f L_f'),
 * with the damping c. MuJoCo damps by the change of L_f^2 in the step before. This is its limit for small steps.
 * Here the ends of edge e have an `expression` for each element. The other lengths follow from the slides:
 *     L_f^2 + 2 c L_f L_f' = sum over x, y, z of dx (dx + 2 c dx').
 *
 * Source: user_mesh.cc, engine_passive.c. */
#include "algebra/parts.h"
#include "robot/mjcf_copies.h"
#include "robot/mjcf_elastic.h"

#include <math.h>

enum { ELEMENTS_MOST = 2000, EDGES = 6, FORMULA_MOST = 3000 /* so that it has room with longer numbers */ };

/* The corners of the edges of a triangle and a tetrahedron. */
static const int elastic_edges[2][EDGES][2] = {{{1, 2}, {2, 0}, {0, 1}},
                                               {{0, 1}, {1, 2}, {2, 0}, {2, 3}, {0, 3}, {1, 3}}};

static kt_elasticity read_elasticity(kt_mjcf *m, const kt_flex *f) {
    static const char *const words[] = {"none", "bend", "stretch", "both", NULL};
    const kt_element *e = kt_xml_child(f->element, "elasticity");
    kt_elasticity l = {.young = 0.0};
    if (e == NULL)
        return l;
    l.young = kt_mjcf_number(m, e, NULL, "young", 0.0);
    l.poisson = kt_mjcf_number(m, e, NULL, "poisson", 0.0);
    l.thickness = kt_mjcf_number(m, e, NULL, "thickness", -1.0);
    l.damping = kt_mjcf_number(m, e, NULL, "damping", 0.0);
    l.shell = kt_mjcf_choice(m, e, NULL, "elastic2d", words, 0);
    if (l.young > 0.0 && !(l.poisson >= 0.0 && l.poisson < 0.5))
        (void)kt_mjcf_fault(m, e, "poisson: expected a number from 0 on, below 0.5");
    if (l.young > 0.0 && f->dim == 2 && l.shell > 0 && !(l.thickness > 0.0))
        (void)kt_mjcf_fault(m, e, "thickness: elastic2d=\"%s\" needs a number above 0", words[l.shell]);
    return l;
}

static bool stretches(const kt_flex *f, const kt_elasticity *l) {
    return l->young > 0.0 && (f->dim == 3 || (f->dim == 2 && l->shell >= 2));
}

static bool bends(const kt_flex *f, const kt_elasticity *l) {
    return l->young > 0.0 && f->dim == 2 && (l->shell == 1 || l->shell == 3);
}

void kt_flex_keep_elastic(kt_mjcf *m, const kt_flex *f) {
    const kt_elasticity l = read_elasticity(m, f);
    const bool is_cells = f->motion >= KT_FLEX_TRILINEAR;
    if (is_cells && l.young > 0.0)
        kt_unknown_count(&m->changes,
                         "elasticity of cells of a flexcomp, left out, so that nothing holds their nodes together; "
                         "rigid=\"true\" fixes them",
                         f->element);
    if (is_cells || !(stretches(f, &l) || bends(f, &l)))
        return;
    if (f->element_count > ELEMENTS_MOST) {
        kt_unknown_count(&m->changes,
                         "elasticity of a flexcomp with more than 2000 elements, left out, so that nothing but edges "
                         "holds its points together; rigid=\"true\" fixes them",
                         f->element);
        return;
    }
    if (bends(f, &l) && f->motion != KT_FLEX_FULL) {
        kt_unknown_count(&m->changes,
                         "bending of a flexcomp whose points have one or two slides, left out with its stretching",
                         f->element);
        return;
    }
    kt_flex *kept = kt_list_add(m->r, &m->r->scratch, &m->elastic_flexes, sizeof *kept);
    if (kept != NULL)
        *kept = *f;
}

void kt_flex_rename_elastic(kt_mjcf *m, int first, const char *prefix) {
    for (int i = first; i < m->elastic_flexes.count; i++) {
        kt_flex *f = (kt_flex *)m->elastic_flexes.items + i;
        const char *name = kt_mjcf_join(m, f->element, prefix, f->name);
        for (int k = 0; k < f->count && name != NULL; k++)
            name = f->points[k].name = kt_mjcf_join(m, f->element, prefix, f->points[k].name);
        if (name == NULL)
            return;
        f->name = kt_mjcf_join(m, f->element, prefix, f->name);
    }
}

/* ---- constants --------------------------------------------------------------------------------------------------- */

/* u v' + v u' */
static kt_sym3 symmetric_product(kt_vec3 u, kt_vec3 v) {
    return kt_sym3_make(2.0 * u.x * v.x, 2.0 * u.y * v.y, 2.0 * u.z * v.z, u.x * v.y + u.y * v.x, u.x * v.z + u.z * v.x,
                        u.y * v.z + u.z * v.y);
}

/* Returns the area of a triangle, and the matrices of its edges. */
static double triangle_bases(const kt_flex *f, const int *v, kt_sym3 bases[EDGES]) {
    static const int faces[3][2] = {{1, 2}, {2, 0}, {0, 1}};
    const double area =
        0.5 * kt_vec3_norm(kt_vec3_cross(kt_elastic_span(f, v[0], v[1]), kt_elastic_span(f, v[0], v[2])));
    for (int e = 0; e < 3; e++) {
        const int *left = faces[faces[e][0]], *right = faces[faces[e][1]];
        const kt_vec3 l = kt_elastic_span(f, v[left[1]], v[left[0]]), r = kt_elastic_span(f, v[right[0]], v[right[1]]);
        const kt_vec3 normal = kt_vec3_normalize(kt_vec3_cross(r, l));
        bases[e] = kt_sym3_scaled(1.0 / (8.0 * area * area),
                                  symmetric_product(kt_vec3_cross(normal, l), kt_vec3_cross(r, normal)));
    }
    return area;
}

/* Returns the volume of a tetrahedron, and the matrices of its edges. */
static double tetrahedron_bases(const kt_flex *f, const int *v, kt_sym3 bases[EDGES]) {
    static const int faces[4][3] = {{2, 1, 0}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    static const int opposite[EDGES][2] = {{2, 3}, {1, 3}, {2, 1}, {1, 0}, {0, 2}, {0, 3}};
    const double volume = kt_vec3_dot(kt_vec3_cross(kt_elastic_span(f, v[0], v[1]), kt_elastic_span(f, v[0], v[2])),
                                      kt_elastic_span(f, v[0], v[3])) /
                          6.0;
    for (int e = 0; e < EDGES; e++) {
        kt_vec3 normal[2];
        for (int k = 0; k < 2; k++) {
            const int *c = faces[opposite[e][k]];
            normal[k] = kt_vec3_cross(kt_elastic_span(f, v[c[0]], v[c[1]]), kt_elastic_span(f, v[c[0]], v[c[2]]));
        }
        bases[e] = kt_sym3_scaled(1.0 / (72.0 * volume * volume), symmetric_product(normal[0], normal[1]));
    }
    return fabs(volume);
}

static double trace_of_product(kt_sym3 a, kt_sym3 b) {
    return a.xx * b.xx + a.yy * b.yy + a.zz * b.zz + 2.0 * (a.xy * b.xy + a.xz * b.xz + a.yz * b.yz);
}

static void find_metric(const kt_flex *f, const kt_elasticity *l, const int *v, double k[EDGES][EDGES]) {
    kt_sym3 bases[EDGES];
    const int edges = f->dim == 2 ? 3 : EDGES;
    const double size =
        f->dim == 2 ? 0.25 * l->thickness * triangle_bases(f, v, bases) : tetrahedron_bases(f, v, bases);
    const double mu = size * l->young / (2.0 * (1.0 + l->poisson));
    const double la = size * l->young * l->poisson / ((1.0 + l->poisson) * (1.0 - 2.0 * l->poisson));
    for (int a = 0; a < edges; a++)
        for (int b = 0; b < edges; b++)
            k[a][b] = mu * trace_of_product(bases[a], bases[b]) +
                      la * (bases[a].xx + bases[a].yy + bases[a].zz) * (bases[b].xx + bases[b].yy + bases[b].zz);
}

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

/* A component of an edge, or its rate: `length` and `speed` of the edge in which the force acts. */
static void put_component(const kt_mjcf *m, const kt_elastic *p, const int ends[2], int axis, bool is_own, bool is_rate,
                          kt_mjcf_formula *to) {
    if (is_own)
        kt_mjcf_put(to, is_rate ? "speed" : "length");
    else
        kt_elastic_put_span(m, p, ends, axis, is_rate, to);
}

/* L^2 + 2 c L L' - l^2 */
static void put_strain(const kt_mjcf *m, const kt_elastic *p, const kt_elasticity *l, const int ends[2], bool is_own,
                       kt_mjcf_formula *to) {
    const kt_vec3 span = kt_elastic_span(p->f, ends[0], ends[1]);
    for (int axis = 0; axis < (is_own ? 1 : 3); axis++) {
        kt_mjcf_put(to, axis > 0 ? " + " : "");
        put_component(m, p, ends, axis, is_own, false, to);
        if (l->damping == 0.0) {
            kt_mjcf_put(to, "^2");
            continue;
        }
        kt_mjcf_put(to, "*(");
        put_component(m, p, ends, axis, is_own, false, to);
        kt_mjcf_print(to, " + %g*", 2.0 * l->damping);
        put_component(m, p, ends, axis, is_own, true, to);
        kt_mjcf_put(to, ")");
    }
    kt_mjcf_print(to, " - %g", kt_vec3_dot(span, span));
}

static kt_end end_at_point(kt_mjcf *m, const kt_elastic *p, int point) {
    kt_end end = kt_end_default();
    if (p->body[point] >= 0) {
        end.body = kt_mjcf_body_at(m, p->body[point])->name;
        return end;
    }
    const int site = kt_names_find(&m->names, KT_MJCF_SITES, kt_flex_name_point(m, p->f, point, "__site"));
    if (site >= 0) {
        const kt_mjcf_site *s = kt_mjcf_site_at(m, site);
        end.body = s->body > 0 ? kt_mjcf_body_at(m, s->body)->name : NULL;
        end.at = s->pose.position;
    }
    return end;
}

/* ---- stretching -------------------------------------------------------------------------------------------------- */

/* Adds the force in an edge, if its formula has a term, and empties the formula. */
static void end_stretch(kt_mjcf *m, const kt_elastic *p, const int ends[2], kt_mjcf_formula *to) {
    if (to->length > 0) {
        kt_mjcf_put(to, ")");
        kt_effect *effect = kt_elastic_add(m, p->f, to);
        if (effect == NULL)
            return;
        effect->end_count = 2;
        for (int i = 0; i < 2; i++)
            effect->between[i] = end_at_point(m, p, ends[i]);
    }
    to->length = 0;
}

/* The force in an edge of an element. It is several effects if the formula is too long for one. */
static void stretch_edge(kt_mjcf *m, const kt_elastic *p, const kt_elasticity *l, const int *v, int own,
                         const double k[EDGES]) {
    const int(*edges)[2] = elastic_edges[p->f->dim - 2];
    const int ends[2] = {v[edges[own][0]], v[edges[own][1]]};
    kt_mjcf_formula to = {.whole = true};
    if (p->body[ends[0]] < 0 && p->body[ends[1]] < 0)
        return;
    for (int e = 0; e < (p->f->dim == 2 ? 3 : EDGES); e++) {
        const int other[2] = {v[edges[e][0]], v[edges[e][1]]};
        kt_mjcf_formula term = {.whole = true};
        if (k[e] == 0.0 || (p->body[other[0]] < 0 && p->body[other[1]] < 0)) /* a constant length */
            continue;
        kt_mjcf_print(&term, "%g*(", k[e]);
        put_strain(m, p, l, other, e == own, &term);
        kt_mjcf_put(&term, ")");
        if (to.length + term.length > FORMULA_MOST)
            end_stretch(m, p, ends, &to);
        kt_mjcf_print(&to, "%s%s", to.length == 0 ? "-length*(" : " + ", term.text);
        to.whole = to.whole && term.whole;
    }
    end_stretch(m, p, ends, &to);
}

static void stretch_flex(kt_mjcf *m, const kt_elastic *p, const kt_elasticity *l) {
    const kt_flex *f = p->f;
    for (int i = 0; i < f->element_count && !m->r->out_of_memory; i++) {
        const int *v = f->elements + (size_t)i * (size_t)(f->dim + 1);
        double k[EDGES][EDGES];
        find_metric(f, l, v, k);
        if (!isfinite(k[0][0])) {
            (void)kt_mjcf_fault(m, f->element, KT_ELASTIC_FLAT);
            return;
        }
        for (int e = 0; e < (f->dim == 2 ? 3 : EDGES); e++)
            stretch_edge(m, p, l, v, e, k[e]);
    }
}

/* ---- all --------------------------------------------------------------------------------------------------------- */

/* The bodies of points. *lost: how many move, but have no body; *found: how many have one. */
static int *find_bodies_of_points(kt_mjcf *m, const kt_flex *f, int *lost, int *found) {
    int *body = kt_reader_take(m->r, &m->r->scratch, (size_t)f->count + 1, sizeof *body);
    *lost = *found = 0;
    for (int i = 0; i < f->count && body != NULL; i++) {
        body[i] = f->points[i].is_pinned ? -1 : kt_names_find(&m->names, KT_MJCF_BODIES, f->points[i].name);
        *found += body[i] >= 0;
        *lost += body[i] < 0 && !f->points[i].is_pinned;
    }
    return body;
}

/* Whether copies by <replicate> have the points under other names. */
static bool is_flex_copied(const kt_mjcf *m, const kt_flex *f) {
    for (int i = 0; i < f->count; i++)
        if (!f->points[i].is_pinned)
            return kt_mjcf_has_copies(m, f->points[i].name);
    return false;
}

/* A flexcomp of which no point is attached is not in the model. */
void kt_flex_add_elasticity(kt_mjcf *m) {
    for (int i = 0; i < m->elastic_flexes.count && !m->r->out_of_memory; i++) {
        const kt_flex *f = (const kt_flex *)m->elastic_flexes.items + i;
        int lost, found;
        const kt_elastic points = {f, find_bodies_of_points(m, f, &lost, &found)};
        const kt_elasticity l = read_elasticity(m, f);
        if (points.body == NULL)
            return;
        if (lost > 0) {
            if (found > 0 || is_flex_copied(m, f))
                kt_unknown_count(&m->changes,
                                 "elasticity of a flexcomp that <replicate> renames, left out, so that nothing but "
                                 "edges holds its points together; rigid=\"true\" fixes them",
                                 f->element);
            continue;
        }
        kt_flex_note_attached_pins(m, f);
        if (stretches(f, &l))
            stretch_flex(m, &points, &l);
        if (bends(f, &l))
            kt_elastic_resist_bending(m, &points, &l);
    }
}
