/* Cables of MJCF: <composite type="cable"> becomes a chain of bodies, before default classes are found.
 *
 * The vertices p_0 ... p_n are given, or lie on a curve. Edge i from p_i to p_(i+1) has the length l_i, the direction
 * t_i and a body. The body has its origin in p_i and its x axis along t_i. It turns about p_i by a ball joint. Its
 * other axes follow the curve without twist:
 *
 *     n_0 = (t_0 x t_1) x t_0,   n_i = n_(i-1) rotated about t_(i-1) x t_i by the angle between both edges
 *
 * The frame has the columns t_i, n_i and t_i x n_i. Straight cables have n = 0, so that the columns are no rotation.
 * The quaternion is then that of MuJoCo's formula for such columns, which keeps a cable along x straight.
 *
 * As in MuJoCo, vertices are single-precision numbers, and default classes do not apply. Source: user_composite.cc. */
#include "robot/mjcf_make.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { VERTICES_MOST = 1000 /* of a cable, since its bodies are within one another */ };

typedef struct cable {
    const kt_element *element, *geom, *joint, *site, *elasticity; /* elasticity: NULL if there is none */
    const char *prefix, *initial;
    int count; /* of vertices */
    float *vertices;
    kt_vec3 offset, normal;
    kt_quat before; /* orientation of the body before */
} cable;

/* ---- elasticity -------------------------------------------------------------------------------------------------- */

/* The instance of a plugin in <extension> that has a name; NULL: there is none. */
static const kt_element *find_instance(const kt_mjcf *m, const kt_element *plugin, const char *name) {
    const kt_element *root = kt_mjcf_document_at(m, plugin->document)->root;
    for (const kt_element *s = kt_xml_child(root, "extension"); s != NULL; s = kt_xml_next(s, "extension"))
        for (const kt_element *p = kt_xml_child(s, "plugin"); p != NULL; p = kt_xml_next(p, "plugin"))
            for (const kt_element *i = kt_xml_child(p, "instance"); i != NULL; i = kt_xml_next(i, "instance"))
                if (kt_text_is(kt_xml_attribute(p, "plugin"), KT_MJCF_ELASTICITY) &&
                    kt_text_is(kt_xml_attribute(i, "name"), name))
                    return i;
    return NULL;
}

static const char *configured(const kt_element *of, const char *key) {
    for (const kt_element *c = kt_xml_child(of, "config"); c != NULL; c = kt_xml_next(c, "config"))
        if (kt_text_is(kt_xml_attribute(c, "key"), key))
            return kt_xml_attribute(c, "value");
    return NULL;
}

/* Turns a <plugin> of cables into an element with its numbers. False if it is another one. Neighbours of a cable have
 * one instance. */
static bool read_cable_plugin(kt_mjcf *m, kt_element *plugin, const char *standard_instance) {
    static const char *const keys[] = {"twist", "bend", "flat"};
    const char *instance = kt_xml_attribute(plugin, "instance");
    const kt_element *from = instance != NULL ? find_instance(m, plugin, instance) : plugin;
    const bool is_instance = instance != NULL && kt_xml_attribute(plugin, "plugin") == NULL;
    if (from == NULL || !(is_instance || kt_text_is(kt_xml_attribute(plugin, "plugin"), KT_MJCF_ELASTICITY)))
        return false;
    const char *attributes[9] = {NULL};
    size_t count = 0;
    instance = instance != NULL ? instance : standard_instance;
    if (instance != NULL) {
        attributes[count++] = "instance";
        attributes[count++] = instance;
    }
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
        const char *value = configured(from, keys[i]);
        if (value == NULL)
            continue;
        attributes[count++] = keys[i];
        attributes[count++] = value;
    }
    plugin->name = KT_MJCF_ELASTICITY;
    plugin->attributes = attributes;
    plugin->first = plugin->last = NULL;
    return kt_element_own(m->r, plugin) != NULL;
}

/* ---- vertices ---------------------------------------------------------------------------------------------------- */

/* q v q*, as MuJoCo has it for a quaternion of any norm. */
static kt_vec3 turn_vertex(kt_quat q, kt_vec3 v) {
    const kt_vec3 axis = kt_vec3_make(q.x, q.y, q.z);
    const kt_vec3 once = kt_vec3_add(kt_vec3_scale(q.w, v), kt_vec3_cross(axis, v));
    return kt_vec3_add(v, kt_vec3_scale(2.0, kt_vec3_cross(axis, once)));
}

/* Makes room for the vertices that are counted. */
static bool take_vertices(kt_mjcf *m, cable *c) {
    if (c->count > VERTICES_MOST)
        return kt_mjcf_fault(m, c->element, "a cable has at most %d vertices here", (int)VERTICES_MOST);
    c->vertices = kt_reader_take(m->r, &m->r->scratch, 3 * (size_t)c->count, sizeof *c->vertices);
    return c->vertices != NULL;
}

static bool read_cable_vertices(kt_mjcf *m, cable *c, const char *text) {
    const size_t most = 3 * (VERTICES_MOST + 1), room = strlen(text) / 2 + 1 < most ? strlen(text) / 2 + 1 : most;
    double *numbers = kt_reader_take(m->r, &m->r->scratch, room, sizeof *numbers);
    if (numbers == NULL)
        return false;
    const int count = kt_parse_numbers(text, (int)room, numbers);
    if (count < 6 || count % 3 != 0)
        return kt_mjcf_fault(m, c->element, "vertex: expected three numbers for each of two vertices or more");
    c->count = count / 3;
    if (!take_vertices(m, c))
        return false;
    for (int i = 0; i < count; i++)
        c->vertices[i] = (float)numbers[i];
    return true;
}

typedef enum curve_type { CURVE_ZERO, CURVE_LINE, CURVE_COSINE, CURVE_SINE } curve_type;

static bool read_cable_curve(kt_mjcf *m, const kt_element *e, curve_type curve[3]) {
    static const char *const words[] = {"0", "s", "cos(s)", "sin(s)"};
    const char *text = kt_xml_attribute(e, "curve");
    int count = 0;
    for (const char *at = text != NULL ? text + strspn(text, " \t\n\r") : ""; *at != '\0'; count++) {
        const size_t length = strcspn(at, " \t\n\r");
        int type = 0;
        while (type < 4 && (strlen(words[type]) != length || strncmp(at, words[type], length) != 0))
            type++;
        if (type == 4 || count == 3)
            return kt_mjcf_fault(m, e, "curve: expected up to three of 0, s, cos(s), sin(s), found '%.60s'", text);
        curve[count] = (curve_type)type;
        at += length;
        at += strspn(at, " \t\n\r");
    }
    return true;
}

static bool make_cable_curve(kt_mjcf *m, cable *c) {
    const kt_element *e = c->element;
    curve_type curve[3] = {CURVE_ZERO, CURVE_ZERO, CURVE_ZERO};
    double size[3] = {1.0, 0.0, 0.0}, count[3] = {1.0, 1.0, 1.0}, q[4] = {1.0, 0.0, 0.0, 0.0};
    (void)kt_mjcf_numbers(m, e, NULL, "count", 1, 3, count);
    (void)kt_mjcf_numbers(m, e, NULL, "size", 1, 3, size);
    (void)kt_mjcf_numbers(m, e, NULL, "quat", 4, 4, q);
    if (!read_cable_curve(m, e, curve))
        return false;
    if (!(count[0] >= 2.0) || count[0] != floor(count[0]) || count[1] != 1.0 || count[2] != 1.0)
        return kt_mjcf_fault(m, e, "count: a cable needs a whole number of two vertices or more, and then 1 1");
    c->count = (int)fmin(count[0], VERTICES_MOST + 1.0);
    if (!take_vertices(m, c))
        return false;
    for (int i = 0; i < c->count; i++) {
        double v[3];
        for (int k = 0; k < 3; k++) {
            const double s = 3.14159265358979323846 * i * size[2] / (c->count - 1);
            v[k] = curve[k] == CURVE_LINE     ? i * size[0] / (c->count - 1)
                   : curve[k] == CURVE_COSINE ? size[1] * cos(s)
                   : curve[k] == CURVE_SINE   ? size[1] * sin(s)
                                              : 0.0;
        }
        const kt_vec3 p = turn_vertex(kt_quat_make(q[0], q[1], q[2], q[3]), kt_vec3_make(v[0], v[1], v[2]));
        c->vertices[3 * i] = (float)p.x;
        c->vertices[3 * i + 1] = (float)p.y;
        c->vertices[3 * i + 2] = (float)p.z;
    }
    return true;
}

/* ---- frames ------------------------------------------------------------------------------------------------------ */

/* Normalizes a vector that is not tiny; returns its norm, or 0. */
static double normalize_edge(kt_vec3 *v) {
    const double squared = kt_vec3_dot(*v, *v), norm = sqrt(squared);
    if (squared < 1e-14)
        return 0.0;
    if (fabs(norm - 1.0) > 1e-14)
        *v = kt_vec3_make(v->x / norm, v->y / norm, v->z / norm);
    return norm;
}

static kt_vec3 edge_of(const cable *c, int i) {
    const float *a = c->vertices + 3 * (size_t)i, *b = a + 3;
    const float x = b[0] - a[0], y = b[1] - a[1], z = b[2] - a[2];
    return kt_vec3_make((double)x, (double)y, (double)z);
}

/* The quaternion of three columns, which need not be a rotation. */
static kt_quat quat_of_columns(kt_vec3 x, kt_vec3 y, kt_vec3 z) {
    kt_quat q;
    if (x.x + y.y + z.z > 0.0) {
        const double w = 0.5 * sqrt(1.0 + x.x + y.y + z.z), f = 0.25 / w;
        q = kt_quat_make(w, f * (y.z - z.y), f * (z.x - x.z), f * (x.y - y.x));
    } else if (x.x > y.y && x.x > z.z) {
        const double w = 0.5 * sqrt(1.0 + x.x - y.y - z.z), f = 0.25 / w;
        q = kt_quat_make(f * (y.z - z.y), w, f * (y.x + x.y), f * (z.x + x.z));
    } else if (y.y > z.z) {
        const double w = 0.5 * sqrt(1.0 - x.x + y.y - z.z), f = 0.25 / w;
        q = kt_quat_make(f * (z.x - x.z), f * (y.x + x.y), w, f * (z.y + y.z));
    } else {
        const double w = 0.5 * sqrt(1.0 - x.x - y.y + z.z), f = 0.25 / w;
        q = kt_quat_make(f * (x.y - y.x), f * (z.x + x.z), f * (z.y + y.z), w);
    }
    return kt_quat_normalize(q);
}

/* The orientation of edge i; `normal` follows it. */
static kt_quat follow_edge(cable *c, int i) {
    kt_vec3 along = edge_of(c, i), binormal;
    (void)normalize_edge(&along);
    if (i == 0) {
        kt_vec3 next = c->count > 2 ? edge_of(c, 1) : along;
        (void)normalize_edge(&next);
        binormal = kt_vec3_cross(along, next);
        (void)normalize_edge(&binormal);
        c->normal = kt_vec3_cross(binormal, along);
        (void)normalize_edge(&c->normal);
        return quat_of_columns(along, c->normal, binormal);
    }
    kt_vec3 previous = edge_of(c, i - 1);
    (void)normalize_edge(&previous);
    binormal = kt_vec3_cross(previous, along);
    const double sine = normalize_edge(&binormal), half = 0.5 * atan2(sine, kt_vec3_dot(previous, along));
    const double s = half != 0.0 ? sin(half) : 0.0;
    c->normal = turn_vertex(kt_quat_make(cos(half), s * binormal.x, s * binormal.y, s * binormal.z), c->normal);
    (void)normalize_edge(&c->normal);
    binormal = kt_vec3_cross(along, c->normal);
    (void)normalize_edge(&binormal);
    return quat_of_columns(along, c->normal, binormal);
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

/* "LETTER_3" with the prefix; NULL: no memory. */
static const char *name_cable_part(kt_mjcf *m, const cable *c, const char *letter, int i) {
    char name[32];
    if (i == 0 || i == c->count - 2)
        (void)snprintf(name, sizeof name, "%s_%s", letter, i == 0 ? "first" : "last");
    else
        (void)snprintf(name, sizeof name, "%s_%d", letter, i);
    return kt_mjcf_join(m, c->element, c->prefix, name);
}

static void add_cable_geom(kt_mjcf *m, const cable *c, kt_element *body, int i, double length) {
    const bool is_box = kt_text_is(kt_xml_attribute(c->geom, "type"), "box");
    double size[3] = {0.0, 0.0, 0.0};
    char name[32];
    (void)snprintf(name, sizeof name, "G%d", i);
    (void)kt_mjcf_numbers(m, c->geom, NULL, "size", 1, 3, size);
    size[0] = 0.5 * length;
    const char *place = is_box ? kt_mjcf_write_numbers(m, 3, (const double[]){0.5 * length, 0.0, 0.0})
                               : kt_mjcf_write_numbers(m, 6, (const double[]){0.0, 0.0, 0.0, length, 0.0, 0.0});
    const char *const attributes[] = {"name",
                                      kt_mjcf_join(m, c->element, c->prefix, name),
                                      is_box ? "pos" : "fromto",
                                      place,
                                      is_box ? "size" : NULL,
                                      kt_mjcf_write_numbers(m, 3, size),
                                      NULL};
    (void)kt_mjcf_add_element(m, body, c->element, "geom", attributes, c->geom);
}

static void add_cable_joint(kt_mjcf *m, const cable *c, kt_element *body, int i) {
    const bool is_free = i == 0 && strcmp(c->initial, "free") == 0;
    const char *name = name_cable_part(m, c, "J", i);
    if (i == 0 && strcmp(c->initial, "none") == 0)
        return;
    const char *const attributes[] = {
        "name",         name, "type", is_free ? "free" : "ball", is_free ? "damping" : NULL, "0", "armature", "0",
        "frictionloss", "0",  NULL};
    (void)kt_mjcf_add_element(m, body, c->element, "joint", attributes, c->joint);
}

static void add_cable_site(kt_mjcf *m, const cable *c, kt_element *body, int i, double length) {
    const double place[3] = {i == c->count - 2 ? length : 0.0, 0.0, 0.0};
    const char *name = name_cable_part(m, c, "S", i), *text = kt_mjcf_write_numbers(m, 3, place);
    const char *const attributes[] = {"name", name, "pos", text, NULL};
    if (i > 0 && i < c->count - 2)
        return;
    (void)kt_mjcf_add_element(m, body, c->element, "site", attributes, c->site);
}

/* Adds the body of edge i below the one before it. */
static kt_element *add_cable_edge(kt_mjcf *m, cable *c, kt_element *parent, int i) {
    kt_vec3 edge = edge_of(c, i), before = i > 0 ? edge_of(c, i - 1) : edge;
    const float *p = c->vertices;
    const double first[3] = {c->offset.x + (double)p[0], c->offset.y + (double)p[1], c->offset.z + (double)p[2]};
    const double others[3] = {normalize_edge(&before), 0.0, 0.0};
    const kt_quat whole = follow_edge(c, i), q = i > 0 ? kt_quat_multiply(kt_quat_conjugate(c->before), whole) : whole;
    const char *name = name_cable_part(m, c, "B", i), *place = kt_mjcf_write_numbers(m, 3, i > 0 ? others : first);
    const char *turned = kt_mjcf_write_numbers(m, 4, (const double[]){q.w, q.x, q.y, q.z});
    const char *const attributes[] = {"name", name, "pos", place, "quat", turned, NULL};
    kt_element *body = kt_mjcf_add_element(m, parent, c->element, "body", attributes, NULL);
    if (body == NULL)
        return NULL;
    body->number = i == 0 ? KT_MJCF_BARE : body->number;
    c->before = whole;
    const double length = kt_vec3_norm(edge);
    add_cable_geom(m, c, body, i, length);
    add_cable_joint(m, c, body, i);
    add_cable_site(m, c, body, i, length);
    if (c->elasticity != NULL)
        (void)kt_mjcf_add_element(m, body, c->element, c->elasticity->name, kt_no_attributes, c->elasticity);
    return m->r->out_of_memory ? NULL : body;
}

static void make_cable_chain(kt_mjcf *m, cable *c, kt_element *chain) {
    kt_element *parent = chain;
    for (int i = 0; i < c->count - 1 && parent != NULL; i++)
        parent = add_cable_edge(m, c, parent, i);
}

static bool read_cable(kt_mjcf *m, const kt_element *e, cable *c) {
    const char *text = kt_xml_attribute(e, "vertex"), *prefix = kt_xml_attribute(e, "prefix");
    const char *initial = kt_xml_attribute(e, "initial");
    kt_element *plugin = kt_xml_child(e, "plugin");
    *c = (cable){.element = e,
                 .geom = kt_xml_child(e, "geom"),
                 .joint = kt_xml_child(e, "joint"),
                 .site = kt_xml_child(e, "site"),
                 .prefix = prefix != NULL ? prefix : "",
                 .initial = initial != NULL ? initial : "ball",
                 .offset = kt_mjcf_vector(m, e, NULL, "offset", kt_vec3_make(0.0, 0.0, 0.0))};
    const char *type = c->geom != NULL ? kt_xml_attribute(c->geom, "type") : NULL;
    if (!kt_text_is(type, "capsule") && !kt_text_is(type, "cylinder") && !kt_text_is(type, "box"))
        return kt_mjcf_fault(m, e, "a cable needs a <geom> whose type is capsule, cylinder or box");
    if (!(text != NULL ? read_cable_vertices(m, c, text) : make_cable_curve(m, c)))
        return false;
    const char *instance = plugin != NULL ? kt_mjcf_join(m, e, "composite", c->prefix) : NULL;
    if (plugin != NULL && instance != NULL && read_cable_plugin(m, plugin, instance))
        c->elasticity = plugin;
    else if (plugin != NULL && instance != NULL)
        kt_unknown_count(&m->changes, "plugin of a cable that is none of its elasticity", plugin);
    return instance != NULL || plugin == NULL;
}

/* Composites of other types, which MuJoCo has no more. */
static void count_removed(kt_mjcf *m, const kt_element *e) {
    const char *type = kt_xml_attribute(e, "type");
    if (kt_text_is(type, "rope") || kt_text_is(type, "loop"))
        kt_unknown_count(&m->changes,
                         "composites of the types rope and loop, which MuJoCo removed, left out; give the type cable, "
                         "or a flexcomp with dim 1",
                         e);
    else
        kt_unknown_count(
            &m->changes,
            "composites of points, cloths and solids, which MuJoCo removed, left out; give a replicate for "
            "points",
            e);
}

static void expand_cables(kt_mjcf *m, kt_element *parent) {
    kt_element *before = NULL;
    for (kt_element *e = parent->first, *next; e != NULL && !kt_draft_is_wrong(&m->draft); e = next) {
        next = e->next;
        const bool is_composite = strcmp(e->name, "composite") == 0;
        if (is_composite || strcmp(e->name, "flexcomp") == 0) {
            kt_element chain = {.name = "frame", .attributes = kt_no_attributes, .document = e->document};
            cable c;
            if (!is_composite)
                kt_mjcf_make_flex(m, e, &chain);
            else if (!kt_text_is(kt_xml_attribute(e, "type"), "cable"))
                count_removed(m, e);
            else if (read_cable(m, e, &c))
                make_cable_chain(m, &c, &chain);
            (void)kt_mjcf_splice(parent, before, e, &chain);
            before = chain.last != NULL ? chain.last : before;
            continue;
        }
        if (strcmp(e->name, "plugin") == 0 && strcmp(parent->name, "body") == 0)
            (void)read_cable_plugin(m, e, NULL);
        else
            expand_cables(m, e);
        before = e;
    }
}

void kt_mjcf_make_cables(kt_mjcf *m, int document) {
    kt_element *root = kt_mjcf_document_at(m, document)->root;
    for (kt_element *w = kt_xml_child(root, "worldbody"); w != NULL; w = kt_xml_next(w, "worldbody"))
        expand_cables(m, w);
}
