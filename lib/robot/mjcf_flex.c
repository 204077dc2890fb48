/* Flexible bodies of MJCF: <flexcomp>, as point masses.
 *
 * Each point that is not pinned is a body with its part of the mass and slides. The slides are along the axes of the
 * parent (dof="full"), along x and y ("2d"), or along the position of the point ("radial"). They have the default class
 * of the parent. With "trilinear" and "quadratic" the bodies are nodes (mjcf_flex_node.c). Source: user_flexcomp.cc.
 *
 * Edges join the points of an element: a line, a triangle or a tetrahedron. A line has a spring and a damper, as a
 * tendon between two sites, or a constant length. In surfaces and solids MuJoCo holds the lengths by soft equalities.
 * They are too many to be exact. MuJoCo's force in an edge that is longer by r, with the mobility A of its ends along
 * it (half of it for some points), is
 *     f = -(k d r + b r' + r'') d / ((1 - d) A)
 * Here it is a spring and a damper, without r''. Steady loads have the same effect, and without loads a single edge
 * oscillates faster by 1/sqrt(1 - d). d is that under an eighth of the weight of all points. For elasticity (`young`)
 * see mjcf_flex_elastic.c. */
#include "robot/mjcf_flex.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- reading ----------------------------------------------------------------------------------------------------- */

/* Keeps the name of a flexcomp that is left out. */
static void lose_flex(kt_mjcf *m, const kt_element *e) {
    const char *name = kt_xml_attribute(e, "name");
    const char **kept = name != NULL ? kt_list_add(m->r, &m->r->scratch, &m->lost_flexes, sizeof *kept) : NULL;
    if (kept != NULL)
        *kept = name;
}

bool kt_mjcf_is_lost_point(const kt_mjcf *m, const char *body) {
    for (int i = 0; i < m->lost_flexes.count; i++) {
        const char *name = ((const char *const *)m->lost_flexes.items)[i];
        const size_t length = strlen(name);
        if (strncmp(body, name, length) == 0 && body[length] == '_')
            return true;
    }
    return false;
}

/* Makes the points and elements. False after reporting, or if it is left out. */
static bool make_flex_shape(kt_mjcf *m, kt_flex *f) {
    static const char *const words[] = {"grid",      "circle", "square", "disc", "box", "cylinder",
                                        "ellipsoid", "direct", "mesh",   "gmsh", NULL};
    enum { BOX = 4, DIRECT = 7, MESH, GMSH };
    const int type = kt_mjcf_choice(m, f->element, NULL, "type", words, 0);
    f->type = words[type];
    f->is_given = type >= DIRECT;
    if (!(type < BOX       ? kt_flex_grid(m, f)
          : type < DIRECT  ? kt_flex_box(m, f)
          : type == DIRECT ? kt_flex_direct(m, f)
          : type == MESH   ? kt_flex_mesh(m, f)
                           : kt_flex_gmsh(m, f))) {
        lose_flex(m, f->element);
        return false;
    }
    return true;
}

/* Moves the points to their place in the parent. */
static void place_flex(kt_mjcf *m, kt_flex *f) {
    const kt_pose pose = kt_mjcf_pose(m, f->element, NULL);
    double scale[3] = {1.0, 1.0, 1.0};
    if (f->is_given)
        (void)kt_mjcf_numbers(m, f->element, NULL, "scale", 3, 3, scale);
    for (int i = 0; i < f->count; i++) {
        double *p = f->points[i].at;
        const kt_vec3 at = kt_pose_apply(pose, kt_vec3_make(scale[0] * p[0], scale[1] * p[1], scale[2] * p[2]));
        p[0] = at.x;
        p[1] = at.y;
        p[2] = at.z;
        for (int k = 0; k < 3; k++) {
            f->low[k] = i == 0 ? p[k] : fmin(f->low[k], p[k]);
            f->high[k] = i == 0 ? p[k] : fmax(f->high[k], p[k]);
        }
    }
}

/* Gives the points their names, masses and pins. */
static bool name_flex_points(kt_mjcf *m, kt_flex *f, const bool *pinned) {
    const double mass = kt_mjcf_number(m, f->element, NULL, "mass", 1.0) / f->count;
    for (int i = 0; i < f->count; i++) {
        kt_flex_point *p = &f->points[i];
        p->mass = mass;
        p->is_pinned = pinned[i];
        p->name = kt_flex_name_point(m, f, i, "");
        if (p->name == NULL)
            return false;
    }
    return true;
}

/* Counts what is left out. */
static void note_flex(kt_mjcf *m, const kt_flex *f) {
    const kt_element *edge = kt_xml_child(f->element, "edge");
    if (kt_xml_child(f->element, "plugin") != NULL)
        kt_unknown_count(&m->changes,
                         "plugins of a flexcomp, left out, so that nothing but edges and <elasticity> holds its points "
                         "together",
                         f->element);
    if (edge != NULL && f->motion >= KT_FLEX_TRILINEAR && kt_xml_attribute(edge, "equality") != NULL &&
        !kt_text_is(kt_xml_attribute(edge, "equality"), "false"))
        kt_unknown_count(&m->changes,
                         "equalities of cells of a flexcomp, left out, so that nothing holds their nodes together; "
                         "rigid=\"true\" fixes them",
                         f->element);
}

/* False if it is left out or has no point that moves, or after reporting. */
static bool read_flex(kt_mjcf *m, const kt_element *e, kt_flex *f) {
    static const char *const motions[] = {"full", "radial", "2d", "trilinear", "quadratic", NULL};
    const double dim = kt_mjcf_number(m, e, NULL, "dim", 2.0);
    *f = (kt_flex){.element = e,
                   .name = kt_xml_attribute(e, "name"),
                   .motion = (kt_flex_motion)kt_mjcf_choice(m, e, NULL, "dof", motions, 0),
                   .dim = (int)fmin(fmax(dim, 0.0), 4.0),
                   .radius = kt_mjcf_number(m, e, NULL, "radius", 0.005)};
    if (f->name == NULL)
        return kt_mjcf_fault(m, e, "the attribute 'name' is missing");
    if (f->dim < 1 || f->dim > 3)
        return kt_mjcf_fault(m, e, "dim: expected 1, 2 or 3");
    if (!make_flex_shape(m, f))
        return false;
    if (f->element_count == 0)
        return kt_mjcf_fault(m, e, "it has no elements");
    place_flex(m, f);
    const int nodes = kt_flex_node_count(m, f), room = f->count > nodes ? f->count : nodes;
    bool *pinned = kt_reader_take(m->r, &m->r->scratch, (size_t)room, sizeof *pinned);
    if (pinned == NULL)
        return false;
    if (!kt_flex_pin(m, f, pinned, room))
        return false;
    int moving = 0;
    for (int i = 0; i < (nodes > 0 ? nodes : f->count); i++)
        moving += !pinned[i];
    if (moving > KT_FLEX_POINTS_MOST || nodes > KT_FLEX_POINTS_MOST)
        return kt_mjcf_fault(m, e, "expected up to %d points that move", (int)KT_FLEX_POINTS_MOST);
    if (moving > 0)
        note_flex(m, f);
    return moving > 0 && (nodes > 0 ? kt_flex_nodes(m, f, pinned) : name_flex_points(m, f, pinned));
}

/* ---- elements ---------------------------------------------------------------------------------------------------- */

/* An element to which default classes do not apply. */
static kt_element *add_bare(kt_mjcf *m, const kt_flex *f, kt_element *parent, const char *name,
                            const char *const *attributes) {
    kt_element *e = kt_mjcf_add_element(m, parent, f->element, name, attributes, NULL);
    if (e != NULL)
        e->number = KT_MJCF_BARE;
    return e;
}

static bool add_site_of_point(kt_mjcf *m, const kt_flex *f, int i, kt_element *parent, const double at[3]) {
    const char *name = kt_flex_name_point(m, f, i, "__site"), *place = kt_mjcf_write_numbers(m, 3, at);
    const char *const attributes[] = {"name", name, "pos", place, NULL};
    return add_bare(m, f, parent, "site", attributes) != NULL;
}

/* A sphere without mass, for contacts and pictures; none without a radius. */
static bool add_geom_of_point(kt_mjcf *m, const kt_flex *f, kt_element *body) {
    static const char *const taken[] = {"contype", "conaffinity", "condim", "priority", "friction",
                                        "solmix",  "solref",      "solimp", "margin",   "gap"};
    const char *attributes[2 * (sizeof taken / sizeof *taken) + 9] = {"type", "sphere", "mass", "0", "size"};
    const kt_element *contact = kt_xml_child(f->element, "contact");
    int count = 6;
    if (!(f->radius > 0.0))
        return true;
    attributes[5] = kt_mjcf_write_numbers(m, 1, &f->radius);
    for (size_t i = 0; i < sizeof taken / sizeof *taken && contact != NULL; i++)
        if (kt_xml_attribute(contact, taken[i]) != NULL) {
            attributes[count++] = taken[i];
            attributes[count++] = kt_xml_attribute(contact, taken[i]);
        }
    attributes[count] = NULL;
    return add_bare(m, f, body, "geom", attributes) != NULL;
}

/* The axes of the slides of a point; returns how many. */
static int slides_of(const kt_flex *f, const kt_flex_point *p, kt_vec3 axes[3]) {
    const kt_vec3 at = kt_vec3_make(p->at[0], p->at[1], p->at[2]);
    const double norm = kt_vec3_norm(at);
    axes[0] = kt_vec3_make(1.0, 0.0, 0.0);
    axes[1] = kt_vec3_make(0.0, 1.0, 0.0);
    axes[2] = kt_vec3_make(0.0, 0.0, 1.0);
    if (p->is_pinned)
        return 0;
    if (f->motion == KT_FLEX_RADIAL && norm > 0.0)
        axes[0] = kt_vec3_scale(1.0 / norm, at);
    return f->motion == KT_FLEX_RADIAL ? 1 : f->motion == KT_FLEX_PLANE ? 2 : 3;
}

static bool add_body_of_point(kt_mjcf *m, const kt_flex *f, int i, kt_element *chain) {
    static const double origin[3] = {0.0, 0.0, 0.0};
    const kt_flex_point *p = &f->points[i];
    const double size = kt_mjcf_number(m, f->element, NULL, "inertiabox", 0.005),
                 inertia = p->mass * 2.0 * size * size / 3.0;
    const char *place = kt_mjcf_write_numbers(m, 3, p->at), *mass = kt_mjcf_write_numbers(m, 1, &p->mass);
    const char *moments = kt_mjcf_write_numbers(m, 3, (const double[]){inertia, inertia, inertia});
    const char *const own[] = {"name", p->name, "pos", place, NULL};
    const char *const inertial[] = {"pos", "0 0 0", "mass", mass, "diaginertia", moments, NULL};
    kt_vec3 axes[3];
    kt_element *body = kt_mjcf_add_element(m, chain, f->element, "body", own, NULL);
    if (body == NULL || kt_mjcf_add_element(m, body, f->element, "inertial", inertial, NULL) == NULL)
        return false;
    for (int k = 0, count = slides_of(f, p, axes); k < count; k++) {
        const char *axis = kt_mjcf_write_numbers(m, 3, (const double[]){axes[k].x, axes[k].y, axes[k].z});
        const char *const sliding[] = {"type", "slide", "axis", axis, NULL};
        if (kt_mjcf_add_element(m, body, f->element, "joint", sliding, NULL) == NULL)
            return false;
    }
    return f->motion >= KT_FLEX_TRILINEAR ||
           (add_geom_of_point(m, f, body) && add_site_of_point(m, f, i, body, origin));
}

/* ---- edges ------------------------------------------------------------------------------------------------------- */

/* The forces in the edges of a flexcomp. */
typedef struct flex_law {
    bool is_soft, is_rigid; /* equalities: springs and dampers, or constant lengths */
    bool is_halved;         /* MuJoCo has half the mobility of edges between points that are bodies */
    double stiffness, damping;
    kt_contact_law law;
    double shortest, force;
} flex_law;

/* Whether MuJoCo calls the points simple bodies: their slides are along its axes, and the parent is the world or fixed
 * to it. */
static bool has_simple_points(const kt_flex *f) {
    const kt_element *parent = kt_mjcf_body_around(f->element);
    return f->motion != KT_FLEX_RADIAL &&
           (parent == NULL || (kt_mjcf_body_around(parent) == NULL && kt_xml_child(parent, "joint") == NULL &&
                               kt_xml_child(parent, "freejoint") == NULL));
}

static flex_law read_flex_law(kt_mjcf *m, const kt_flex *f, const kt_element *edge) {
    static const char *const words[] = {"false", "true", "vert", "strain", NULL};
    const kt_element *root = kt_mjcf_document_at(m, 0)->root;
    const int equality = kt_mjcf_choice(m, edge, NULL, "equality", words, 0);
    double step = 0.002;
    flex_law l = {.law = kt_contact_law_standard(),
                  .is_rigid = equality > 0 && f->dim == 1,
                  .is_soft = equality > 0 && f->dim > 1,
                  .is_halved = has_simple_points(f),
                  .stiffness = kt_mjcf_number(m, edge, NULL, "stiffness", 0.0),
                  .damping = kt_mjcf_number(m, edge, NULL, "damping", 0.0),
                  .force = 9.81 / 8.0 * kt_mjcf_number(m, f->element, NULL, "mass", 1.0)};
    for (const kt_element *e = kt_xml_child(root, "option"); e != NULL; e = kt_xml_next(e, "option"))
        step = kt_mjcf_number(m, e, NULL, "timestep", step);
    (void)kt_mjcf_numbers(m, edge, NULL, "solref", 1, 2, l.law.reference);
    (void)kt_mjcf_numbers(m, edge, NULL, "solimp", 1, 5, l.law.impedance);
    l.shortest = 2.0 * step;
    if (l.is_soft && !kt_contact_law_settle(&l.law))
        kt_unknown_count(&m->changes, KT_NOTE_MIXED_REFERENCE, edge);
    return l;
}

/* The acceleration of a point along a direction by a unit force along it. */
static double mobility_of_point(const kt_flex *f, const kt_flex_point *p, kt_vec3 along) {
    double sum = 0.0;
    kt_vec3 axes[3];
    for (int k = 0, count = slides_of(f, p, axes); k < count; k++)
        sum += pow(kt_vec3_dot(axes[k], along), 2.0) / p->mass;
    return sum;
}

/* The length of an edge does not change. */
static void add_rigid_edge(kt_mjcf *m, const kt_flex *f, const char *const sites[2], double length,
                           kt_element *section) {
    const char *text = kt_mjcf_write_numbers(m, 1, &length);
    const char *const attributes[] = {"name", f->name, "site1", sites[0], "site2", sites[1], "length", text, NULL};
    (void)add_bare(m, f, section, KT_MJCF_EDGE, attributes);
}

static void add_elastic_edge(kt_mjcf *m, const kt_flex *f, double stiffness, double damping, const char *const sites[2],
                             kt_element *section) {
    const char *k = kt_mjcf_write_numbers(m, 1, &stiffness), *d = kt_mjcf_write_numbers(m, 1, &damping);
    const char *const attributes[] = {"stiffness", k, "damping", d, NULL};
    kt_element *tendon = add_bare(m, f, section, "spatial", attributes);
    for (int i = 0; i < 2 && tendon != NULL; i++) {
        const char *const site[] = {"site", sites[i], NULL};
        (void)kt_mjcf_add_element(m, tendon, f->element, "site", site, NULL);
    }
}

static void add_flex_edge(kt_mjcf *m, const kt_flex *f, const flex_law *l, const int ends[2], kt_element *section) {
    const kt_flex_point *a = &f->points[ends[0]], *b = &f->points[ends[1]];
    const kt_vec3 span = kt_vec3_make(b->at[0] - a->at[0], b->at[1] - a->at[1], b->at[2] - a->at[2]);
    const double length = kt_vec3_norm(span);
    const char *sites[2] = {kt_flex_name_point(m, f, ends[0], "__site"), kt_flex_name_point(m, f, ends[1], "__site")};
    double stiffness = l->stiffness, damping = l->damping, k, c;
    if (sites[0] == NULL || sites[1] == NULL || (a->is_pinned && b->is_pinned))
        return;
    if (l->is_rigid) {
        add_rigid_edge(m, f, sites, length, section);
        return;
    }
    const kt_vec3 along = kt_vec3_scale(length > 0.0 ? 1.0 / length : 0.0, span);
    const bool is_mean = l->is_halved && !a->is_pinned && !b->is_pinned;
    const double mobility = is_mean ? 1.0 / a->mass : mobility_of_point(f, a, along) + mobility_of_point(f, b, along);
    if (l->is_soft && mobility * a->mass > 1e-9) {
        const double d = kt_contact_law_yield(&l->law, l->shortest, mobility, l->force, &k, &c);
        stiffness += k;
        damping += c;
        m->flex_haste = fmax(m->flex_haste, 1.0 / sqrt(1.0 - d));
        kt_left_count(&m->flex_edges, f->element);
    }
    if (stiffness != 0.0 || damping != 0.0)
        add_elastic_edge(m, f, stiffness, damping, sites, section);
}

static int order_flex_ends(const void *a, const void *b) {
    const int *x = a, *y = b;
    return x[0] != y[0] ? (x[0] > y[0]) - (x[0] < y[0]) : (x[1] > y[1]) - (x[1] < y[1]);
}

/* All pairs of points of an element, each once; returns how many. NULL: no memory. */
static int *list_flex_edges(kt_mjcf *m, const kt_flex *f, int *count) {
    int *ends = kt_reader_take(m->r, &m->r->scratch, 12 * (size_t)f->element_count + 1, sizeof *ends), all = 0;
    *count = 0;
    if (ends == NULL)
        return NULL;
    for (int i = 0; i < f->element_count; i++)
        for (int a = 0; a <= f->dim; a++)
            for (int b = a + 1; b <= f->dim; b++) {
                const int x = f->elements[i * (f->dim + 1) + a], y = f->elements[i * (f->dim + 1) + b];
                ends[2 * all] = f->dim > 1 && x > y ? y : x;
                ends[2 * all++ + 1] = f->dim > 1 && x > y ? x : y;
            }
    if (f->dim > 1)
        qsort(ends, (size_t)all, 2 * sizeof *ends, order_flex_ends);
    for (int i = 0; i < all; i++)
        if (f->dim == 1 || i == 0 || order_flex_ends(ends + 2 * (size_t)i, ends + 2 * ((size_t)i - 1)) != 0)
            memmove(ends + 2 * (size_t)(*count)++, ends + 2 * (size_t)i, 2 * sizeof *ends);
    return ends;
}

static void add_flex_edges(kt_mjcf *m, const kt_flex *f) {
    kt_element *root = kt_mjcf_document_at(m, f->element->document)->root;
    const kt_element *edge = kt_xml_child(f->element, "edge");
    int count;
    if (edge == NULL || f->element_count == 0)
        return;
    const flex_law law = read_flex_law(m, f, edge);
    const char *name = law.is_rigid ? "equality" : "tendon";
    const int *ends = list_flex_edges(m, f, &count);
    kt_element *section = ends != NULL ? kt_mjcf_add_element(m, root, f->element, name, kt_no_attributes, NULL) : NULL;
    for (int i = 0; i < count && section != NULL && !kt_draft_is_wrong(&m->draft); i++)
        add_flex_edge(m, f, &law, ends + 2 * (size_t)i, section);
}

void kt_mjcf_make_flex(kt_mjcf *m, const kt_element *e, kt_element *chain) {
    kt_flex f;
    bool is_whole = read_flex(m, e, &f);
    if (!is_whole)
        return;
    for (int i = 0; i < f.count && is_whole; i++)
        if (!f.points[i].is_pinned)
            is_whole = add_body_of_point(m, &f, i, chain);
        else if (f.motion < KT_FLEX_TRILINEAR)
            is_whole = add_site_of_point(m, &f, i, chain, f.points[i].at);
    if (is_whole) {
        add_flex_edges(m, &f);
        kt_flex_keep_elastic(m, &f);
    }
}
