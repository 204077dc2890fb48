/* Cables of MJCF as point masses: <flexcomp dim="1">.
 *
 * Each point that is not pinned is a body with its part of the mass and three sliders along the axes of the parent. The
 * sliders have the default class of the parent. Edges join points: neighbours of a line (`grid`) or of a circle, or
 * those that the file gives (`direct`). An edge has a spring and a damper, as a tendon between two sites, or a constant
 * length. Surfaces and solids have triangles and tetrahedra, whose elasticity is no force between two points. Source:
 * user_flexcomp.cc. */
#include "robot/mjcf_make.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { POINTS_MOST = 1000 };

typedef struct flex {
    const kt_element *element;
    const char *name;
    int count, edge_count;
    double *points; /* in the parent */
    int *edges;     /* pairs of points */
    bool *pinned;
    double mass, inertia, radius; /* of a point */
} flex;

static const char *const no_attributes[] = {NULL};

/* ---- reading ----------------------------------------------------------------------------------------------------- */

/* The numbers of an attribute of any length; -1 after reporting. */
static int read_all_numbers(kt_mjcf *m, const kt_element *e, const char *name, double **values) {
    const char *text = kt_xml_attribute(e, name);
    const size_t room = text != NULL ? strlen(text) / 2 + 1 : 0;
    *values = kt_pool_take(&m->r->scratch, room + 1, sizeof **values);
    if (*values == NULL)
        return kt_reader_out_of_memory(m->r) ? 0 : -1;
    const int count = text != NULL ? kt_parse_numbers(text, (int)room, *values) : 0;
    if (count < 0)
        (void)kt_mjcf_fault(m, e, "%s: expected numbers", name);
    return count;
}

static bool take_flex(kt_mjcf *m, flex *f) {
    const size_t points = (size_t)f->count + 1, edges = (size_t)f->edge_count + 1;
    f->points = kt_pool_take(&m->r->scratch, 3 * points, sizeof *f->points);
    f->edges = kt_pool_take(&m->r->scratch, 2 * edges, sizeof *f->edges);
    f->pinned = kt_pool_take(&m->r->scratch, points, sizeof *f->pinned);
    return (f->points != NULL && f->edges != NULL && f->pinned != NULL) || kt_reader_out_of_memory(m->r);
}

static bool make_line(kt_mjcf *m, flex *f, bool is_circle) {
    double count[3] = {10.0, 10.0, 10.0}, spacing[3] = {0.02, 0.02, 0.02};
    (void)kt_mjcf_numbers(m, f->element, NULL, "count", 3, 3, count);
    (void)kt_mjcf_numbers(m, f->element, NULL, "spacing", 3, 3, spacing);
    if (!(count[0] >= (is_circle ? 3.0 : 2.0)) || count[0] > POINTS_MOST)
        return kt_mjcf_fault(m, f->element, "count: expected %d to %d points", is_circle ? 3 : 2, (int)POINTS_MOST);
    f->count = (int)count[0] - is_circle;
    f->edge_count = (int)count[0] - 1;
    if (!take_flex(m, f))
        return false;
    const double angle = 2.0 * 3.14159265358979323846 / f->edge_count, r = 0.5 * spacing[0] / sin(0.5 * angle);
    for (int i = 0; i < f->count; i++) {
        f->points[3 * i] = is_circle ? r * cos(angle * i) : spacing[0] * (i - 0.5 * (f->count - 1));
        f->points[3 * i + 1] = is_circle ? r * sin(angle * i) : 0.0;
    }
    for (int i = 0; i < f->edge_count; i++) {
        f->edges[2 * i] = i;
        f->edges[2 * i + 1] = i + 1 < f->count ? i + 1 : 0;
    }
    return true;
}

/* Whether each point is in an edge. MuJoCo removes others, which changes the numbers of the rest. */
static bool check_edges(kt_mjcf *m, const flex *f) {
    for (int p = 0; p < f->count; p++) {
        bool is_used = false;
        for (int i = 0; i < 2 * f->edge_count && !is_used; i++)
            is_used = f->edges[i] == p;
        if (!is_used)
            return kt_mjcf_fault(m, f->element, "element: the point %d is in no edge; remove it", p);
    }
    return true;
}

/* The points and edges of the file. */
static bool read_direct(kt_mjcf *m, flex *f) {
    double *points, *ends, scale[3] = {1.0, 1.0, 1.0};
    const int numbers = read_all_numbers(m, f->element, "point", &points),
              count = read_all_numbers(m, f->element, "element", &ends);
    (void)kt_mjcf_numbers(m, f->element, NULL, "scale", 3, 3, scale);
    f->count = numbers / 3;
    f->edge_count = count / 2;
    if (f->count > POINTS_MOST)
        return kt_mjcf_fault(m, f->element, "point: expected up to %d points", (int)POINTS_MOST);
    if (numbers < 6 || numbers % 3 != 0 || count < 2 || count % 2 != 0)
        return kt_mjcf_fault(m, f->element, "expected `point` with three numbers each, `element` with two points each");
    if (!take_flex(m, f))
        return false;
    for (int i = 0; i < numbers; i++)
        f->points[i] = scale[i % 3] * points[i];
    for (int i = 0; i < count; i++) {
        if (!(ends[i] >= 0.0 && ends[i] < f->count))
            return kt_mjcf_fault(m, f->element, "element: there is no point %g", ends[i]);
        f->edges[i] = (int)ends[i];
    }
    return check_edges(m, f);
}

static bool read_pins(kt_mjcf *m, flex *f) {
    for (const kt_element *pin = kt_xml_child(f->element, "pin"); pin != NULL; pin = kt_xml_next(pin, "pin"))
        for (int is_range = 0; is_range < 2; is_range++) {
            double *ids;
            const int count = read_all_numbers(m, pin, is_range ? "range" : "id", &ids);
            for (int i = 0; i + is_range < count; i += 1 + is_range) {
                if (!(ids[i] >= 0.0 && ids[i] < f->count && ids[i + is_range] >= 0.0 && ids[i + is_range] < f->count))
                    return kt_mjcf_fault(m, pin, "there is no such point");
                for (int k = (int)ids[i]; k <= (int)ids[i + is_range]; k++)
                    f->pinned[k] = true;
            }
        }
    return true;
}

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

/* Returns whether a flexcomp is a cable. Others are counted. */
static bool is_flex_cable(kt_mjcf *m, const kt_element *e, const char *type) {
    const char *dof = kt_xml_attribute(e, "dof");
    const bool is_known = type == NULL || kt_mjcf_is_equal(type, "grid") || kt_mjcf_is_equal(type, "circle") ||
                          kt_mjcf_is_equal(type, "direct");
    if (kt_mjcf_number(m, e, NULL, "dim", 2.0) != 1.0 || !is_known)
        kt_unknown_count(&m->changes,
                         "flexcomps that are surfaces or solids, whose elasticity is no force between two points, left "
                         "out; those with dim 1 and the type grid, circle or direct are read",
                         e);
    else if (dof != NULL && !kt_mjcf_is_equal(dof, "full"))
        kt_unknown_count(&m->changes, "flexcomps of points without three slides, left out", e);
    else
        return true;
    lose_flex(m, e);
    return false;
}

/* False if it is left out, or after reporting. */
static bool read_flex(kt_mjcf *m, const kt_element *e, flex *f) {
    const char *type = kt_xml_attribute(e, "type");
    if (!is_flex_cable(m, e, type))
        return false;
    *f = (flex){.element = e,
                .name = kt_xml_attribute(e, "name"),
                .mass = kt_mjcf_number(m, e, NULL, "mass", 1.0),
                .radius = kt_mjcf_number(m, e, NULL, "radius", 0.005)};
    if (f->name == NULL)
        return kt_mjcf_fault(m, e, "the attribute 'name' is missing");
    if (!(kt_mjcf_is_equal(type, "direct") ? read_direct(m, f) : make_line(m, f, kt_mjcf_is_equal(type, "circle"))) ||
        !read_pins(m, f))
        return false;
    const double size = kt_mjcf_number(m, e, NULL, "inertiabox", 0.005);
    const kt_pose pose = kt_mjcf_pose(m, e, NULL);
    f->mass /= f->count;
    f->inertia = f->mass * 2.0 * size * size / 3.0;
    for (int i = 0; i < f->count; i++) {
        double *p = f->points + 3 * (size_t)i;
        const kt_vec3 at = kt_pose_apply(pose, kt_vec3_make(p[0], p[1], p[2]));
        p[0] = at.x;
        p[1] = at.y;
        p[2] = at.z;
        f->pinned[i] = f->pinned[i] || kt_mjcf_flag(m, e, NULL, "rigid", false);
    }
    return true;
}

/* ---- elements ---------------------------------------------------------------------------------------------------- */

/* "NAME_3", and "NAME_3__site" of its site. */
static const char *name_flex_point(kt_mjcf *m, const flex *f, int i, const char *suffix) {
    char text[48];
    (void)snprintf(text, sizeof text, "_%d%s", i, suffix);
    return kt_mjcf_join(m, f->element, f->name, text);
}

/* An element to which default classes do not apply. */
static kt_element *add_bare(kt_mjcf *m, const flex *f, kt_element *parent, const char *name,
                            const char *const *attributes) {
    kt_element *e = kt_mjcf_add_element(m, parent, f->element, name, attributes, NULL);
    if (e != NULL)
        e->number = KT_MJCF_BARE;
    return e;
}

static bool add_site_of_point(kt_mjcf *m, const flex *f, int i, kt_element *parent, const double at[3]) {
    const char *name = name_flex_point(m, f, i, "__site"), *place = kt_mjcf_write_numbers(m, 3, at);
    if (name == NULL || place == NULL)
        return false;
    const char *const attributes[] = {"name", name, "pos", place, NULL};
    return add_bare(m, f, parent, "site", attributes) != NULL;
}

/* A sphere without mass, for contacts and pictures. */
static bool add_geom_of_point(kt_mjcf *m, const flex *f, kt_element *body) {
    static const char *const taken[] = {"contype", "conaffinity", "condim", "priority", "friction",
                                        "solmix",  "solref",      "solimp", "margin",   "gap"};
    const char *attributes[2 * (sizeof taken / sizeof *taken) + 9] = {"type", "sphere", "mass", "0", "size"};
    const kt_element *contact = kt_xml_child(f->element, "contact");
    int count = 6;
    attributes[5] = kt_mjcf_write_numbers(m, 1, &f->radius);
    for (size_t i = 0; i < sizeof taken / sizeof *taken && contact != NULL; i++)
        if (kt_xml_attribute(contact, taken[i]) != NULL) {
            attributes[count++] = taken[i];
            attributes[count++] = kt_xml_attribute(contact, taken[i]);
        }
    attributes[count] = NULL;
    return attributes[5] != NULL && add_bare(m, f, body, "geom", attributes) != NULL;
}

static bool add_body_of_point(kt_mjcf *m, const flex *f, int i, kt_element *chain) {
    static const double origin[3] = {0.0, 0.0, 0.0};
    static const char *const axes[] = {"1 0 0", "0 1 0", "0 0 1"};
    const char *name = name_flex_point(m, f, i, ""), *place = kt_mjcf_write_numbers(m, 3, f->points + 3 * (size_t)i);
    const char *mass = kt_mjcf_write_numbers(m, 1, &f->mass);
    const char *moments = kt_mjcf_write_numbers(m, 3, (const double[]){f->inertia, f->inertia, f->inertia});
    if (name == NULL || place == NULL || mass == NULL || moments == NULL)
        return false;
    const char *const own[] = {"name", name, "pos", place, NULL};
    const char *const inertial[] = {"pos", "0 0 0", "mass", mass, "diaginertia", moments, NULL};
    kt_element *body = kt_mjcf_add_element(m, chain, f->element, "body", own, NULL);
    if (body == NULL || kt_mjcf_add_element(m, body, f->element, "inertial", inertial, NULL) == NULL)
        return false;
    for (int k = 0; k < 3; k++) {
        const char *const sliding[] = {"type", "slide", "axis", axes[k], NULL};
        if (kt_mjcf_add_element(m, body, f->element, "joint", sliding, NULL) == NULL)
            return false;
    }
    return add_geom_of_point(m, f, body) && add_site_of_point(m, f, i, body, origin);
}

/* The length of an edge does not change. */
static void add_rigid_edge(kt_mjcf *m, const flex *f, const char *const sites[2], double length, kt_element *section) {
    const char *text = kt_mjcf_write_numbers(m, 1, &length);
    if (text == NULL)
        return;
    const char *const attributes[] = {"name", f->name, "site1", sites[0], "site2", sites[1], "length", text, NULL};
    (void)add_bare(m, f, section, KT_MJCF_EDGE, attributes);
}

static void add_elastic_edge(kt_mjcf *m, const flex *f, const kt_element *edge, const char *const sites[2],
                             kt_element *section) {
    const char *stiffness = kt_xml_attribute(edge, "stiffness"), *damping = kt_xml_attribute(edge, "damping");
    const char *const attributes[] = {"stiffness", stiffness != NULL ? stiffness : "0", "damping",
                                      damping != NULL ? damping : "0", NULL};
    kt_element *tendon = add_bare(m, f, section, "spatial", attributes);
    for (int k = 0; k < 2 && tendon != NULL; k++) {
        const char *const site[] = {"site", sites[k], NULL};
        (void)kt_mjcf_add_element(m, tendon, f->element, "site", site, NULL);
    }
}

static void add_flex_edges(kt_mjcf *m, const flex *f) {
    kt_element *root = kt_mjcf_document_at(m, f->element->document)->root;
    const kt_element *edge = kt_xml_child(f->element, "edge");
    const bool is_rigid = edge != NULL && kt_mjcf_is_equal(kt_xml_attribute(edge, "equality"), "true");
    if (edge == NULL)
        return;
    kt_element *section =
        kt_mjcf_add_element(m, root, f->element, is_rigid ? "equality" : "tendon", no_attributes, NULL);
    for (int i = 0; i < f->edge_count && section != NULL && !kt_draft_is_wrong(&m->draft); i++) {
        const int *ends = f->edges + 2 * (size_t)i;
        const double *a = f->points + 3 * (size_t)ends[0], *b = f->points + 3 * (size_t)ends[1];
        const char *sites[2] = {name_flex_point(m, f, ends[0], "__site"), name_flex_point(m, f, ends[1], "__site")};
        if (sites[0] == NULL || sites[1] == NULL || (f->pinned[ends[0]] && f->pinned[ends[1]]))
            continue;
        if (is_rigid)
            add_rigid_edge(m, f, sites, kt_vec3_norm(kt_vec3_make(b[0] - a[0], b[1] - a[1], b[2] - a[2])), section);
        else
            add_elastic_edge(m, f, edge, sites, section);
    }
}

void kt_mjcf_make_flex(kt_mjcf *m, const kt_element *e, kt_element *chain) {
    flex f;
    bool is_whole = read_flex(m, e, &f);
    if (!is_whole)
        return;
    for (int i = 0; i < f.count && is_whole; i++)
        is_whole = f.pinned[i] ? add_site_of_point(m, &f, i, chain, f.points + 3 * (size_t)i)
                               : add_body_of_point(m, &f, i, chain);
    if (is_whole)
        add_flex_edges(m, &f);
}
