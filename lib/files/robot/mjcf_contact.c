/* Contacts of MJCF between planes that do not move and geoms that do (robot_contact.c).
 *
 * Two geoms touch if a <pair> names them. They also touch if no <exclude> has their bodies and their masks allow it:
 *     (contype1 & conaffinity2) | (contype2 & conaffinity1) != 0.
 * The contact has the numbers of the geom with the higher priority. At equal priority, frictions and condim are the
 * larger values, and solimp and solref are means with the weights solmix. If a solref is not positive, the smaller
 * values apply.
 *
 * The law of a contact follows from these numbers (contact_law.c). The contact begins at the distance margin - gap, as
 * in MuJoCo. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf_mesh.h"

#include <math.h>
#include <string.h>

typedef struct surface {
    const kt_element *element;
    int body;
    bool is_plane, is_mesh;
    kt_solid solid;
    double size[3];
    kt_pose pose; /* in its body */
    unsigned type, affinity;
    kt_contact_law law;
} surface;

static surface *surface_at(const kt_mjcf *m, int i) { return (surface *)m->surfaces.items + i; }

/* Numbers that an element lacks stay as they are. A geom has frictions of sliding, torsion and rolling; a pair has two
 * of sliding, one of torsion, and two of rolling. */
static void read_law(kt_mjcf *m, const kt_element *e, const char *tag, kt_contact_law *l) {
    const bool is_pair = strcmp(tag, "pair") == 0; /* two numbers of sliding and two of rolling friction */
    double friction[5] = {l->friction, is_pair ? l->friction : l->torsion, is_pair ? l->torsion : l->rolling,
                          l->rolling, l->rolling};
    const bool has_margin = kt_mjcf_text(m, e, tag, "margin") != NULL || kt_mjcf_text(m, e, tag, "gap") != NULL;
    (void)kt_mjcf_numbers(m, e, tag, "friction", 1, 5, friction);
    (void)kt_mjcf_numbers(m, e, tag, "solref", 1, 2, l->reference);
    (void)kt_mjcf_numbers(m, e, tag, "solimp", 1, 5, l->impedance);
    l->friction = friction[0];
    l->torsion = friction[is_pair ? 2 : 1];
    l->rolling = friction[is_pair ? 3 : 2];
    if (is_pair && (friction[0] != friction[1] || friction[3] != friction[4]))
        kt_unknown_count(
            &m->changes,
            "pairs whose friction differs by direction, of which the first number applies to all directions", e);
    l->condim = kt_mjcf_number(m, e, tag, "condim", l->condim);
    l->priority = kt_mjcf_number(m, e, tag, "priority", l->priority);
    l->mix = kt_mjcf_number(m, e, tag, "solmix", l->mix);
    if (has_margin)
        l->distance = kt_mjcf_number(m, e, tag, "margin", 0.0) - kt_mjcf_number(m, e, tag, "gap", 0.0);
}

void kt_mjcf_add_surface(kt_mjcf *m, const kt_element *e, int body, kt_solid solid, const double size[3],
                         kt_pose pose) {
    surface *s = kt_list_add(m->r, &m->r->scratch, &m->surfaces, sizeof *s);
    const char *type = kt_mjcf_text(m, e, "geom", "type");
    if (s == NULL)
        return;
    *s = (surface){.element = e, .body = body, .solid = solid, .pose = pose, .law = kt_contact_law_standard()};
    s->is_plane = kt_text_is(type, "plane");
    s->is_mesh = kt_text_is(type, "mesh");
    memcpy(s->size, size, sizeof s->size);
    s->type = (unsigned)kt_mjcf_number(m, e, "geom", "contype", 1.0);
    s->affinity = (unsigned)kt_mjcf_number(m, e, "geom", "conaffinity", 1.0);
    read_law(m, e, "geom", &s->law);
}

/* The law of two geoms by the rules at the top. A <pair> overrides its numbers. */
static kt_contact_law mix_laws(const kt_contact_law *a, const kt_contact_law *b) {
    const double sum = a->mix + b->mix, part = sum > 0.0 ? a->mix / sum : 0.5;
    const bool is_direct = a->reference[0] <= 0.0 || b->reference[0] <= 0.0;
    kt_contact_law l = a->priority > b->priority ? *a : *b;
    l.distance = a->distance + b->distance;
    if (a->priority != b->priority)
        return l;
    l.friction = fmax(a->friction, b->friction);
    l.torsion = fmax(a->torsion, b->torsion);
    l.rolling = fmax(a->rolling, b->rolling);
    l.condim = fmax(a->condim, b->condim);
    for (int i = 0; i < 2; i++)
        l.reference[i] = is_direct ? fmin(a->reference[i], b->reference[i])
                                   : part * a->reference[i] + (1.0 - part) * b->reference[i];
    for (int i = 0; i < 5; i++)
        l.impedance[i] = part * a->impedance[i] + (1.0 - part) * b->impedance[i];
    return l;
}

/* The settings of <option>. */
static kt_contact_cone read_cone(kt_mjcf *m) {
    static const char *const words[] = {"pyramidal", "elliptic", NULL};
    kt_contact_cone c = {.ratio = 1.0};
    double step = 0.002;
    int type = 0;
    for (const kt_element *e = kt_xml_child(m->root, "option"); e != NULL; e = kt_xml_next(e, "option")) {
        step = kt_mjcf_number(m, e, NULL, "timestep", step);
        c.ratio = kt_mjcf_number(m, e, NULL, "impratio", c.ratio);
        type = kt_mjcf_choice(m, e, NULL, "cone", words, type);
    }
    c.is_pyramid = type == 0;
    c.shortest = 2.0 * step;
    return c;
}

/* Whether a body does not move. */
static bool is_still(const kt_mjcf *m, int body) {
    bool still = true;
    for (int i = body; i > 0; i = kt_mjcf_body_at(m, i)->parent)
        still = still && kt_mjcf_body_at(m, i)->joint_count == 0 && !kt_mjcf_body_at(m, i)->is_freed;
    return still;
}

/* The mass of all that the root of a body carries. */
static double contact_tree_mass(const kt_mjcf *m, int body) {
    int root = body;
    double mass = 0.0;
    while (kt_mjcf_body_at(m, root)->parent > 0)
        root = kt_mjcf_body_at(m, root)->parent;
    for (int i = root; i < m->bodies.count; i++)
        mass += kt_mjcf_is_carried(m, i, root) ? kt_mjcf_body_at(m, i)->mass : 0.0;
    return mass;
}

/* ---- which touch ------------------------------------------------------------------------------------------------- */

static bool has_name(const kt_element *e, const char *attribute, const kt_element *pair) {
    return kt_text_is(kt_xml_attribute(e, "name"), kt_xml_attribute(pair, attribute));
}

/* The <pair> of two geoms; NULL: there is none. */
static const kt_element *find_pair(const kt_mjcf *m, const kt_element *a, const kt_element *b) {
    for (const kt_element *e = kt_mjcf_section(m, "contact", NULL); e != NULL; e = kt_mjcf_section(m, "contact", e))
        if (strcmp(e->name, "pair") == 0 && ((has_name(a, "geom1", e) && has_name(b, "geom2", e)) ||
                                             (has_name(a, "geom2", e) && has_name(b, "geom1", e))))
            return e;
    return NULL;
}

/* Whether an <exclude> names both bodies, in any order. */
static bool is_excluded(const kt_mjcf *m, int a, int b) {
    const int bodies[2] = {a, b};
    for (const kt_element *e = kt_mjcf_section(m, "contact", NULL); e != NULL; e = kt_mjcf_section(m, "contact", e)) {
        int found[2];
        if (strcmp(e->name, "exclude") != 0)
            continue;
        for (int i = 0; i < 2; i++) {
            const char *name = kt_xml_attribute(e, i == 0 ? "body1" : "body2");
            found[i] = name != NULL ? kt_names_find(&m->names, KT_MJCF_BODIES, name) : -1;
        }
        if ((found[0] == bodies[0] && found[1] == bodies[1]) || (found[0] == bodies[1] && found[1] == bodies[0]))
            return true;
    }
    return false;
}

static bool masks_allow(const surface *a, const surface *b) {
    return (a->type & b->affinity) != 0 || (b->type & a->affinity) != 0;
}

/* Whether two geoms touch, and how. */
static bool find_law(kt_mjcf *m, const surface *plane, const surface *s, kt_contact_law *l) {
    const kt_element *pair = find_pair(m, plane->element, s->element);
    *l = mix_laws(&plane->law, &s->law);
    if (pair != NULL)
        read_law(m, pair, "pair", l);
    const bool can_close = pair != NULL || (masks_allow(plane, s) && !is_excluded(m, plane->body, s->body));
    if (can_close && !kt_contact_law_settle(l))
        kt_unknown_count(&m->changes, KT_NOTE_MIXED_REFERENCE, pair != NULL ? pair : s->element);
    return can_close;
}

/* Whether the last joint of a body, or of the one that it is fixed to, turns it without limits. */
static bool mjcf_turns_freely(const kt_mjcf *m, int body) {
    while (body > 0 && kt_mjcf_body_at(m, body)->joint_count == 0 && !kt_mjcf_body_at(m, body)->is_freed)
        body = kt_mjcf_body_at(m, body)->parent;
    const kt_mjcf_body *b = kt_mjcf_body_at(m, body);
    const kt_mjcf_joint *j = b->joint_count > 0 ? kt_mjcf_joint_at(m, b->first_joint + b->joint_count - 1) : NULL;
    return b->is_freed || (j != NULL && j->type != KT_MJCF_SLIDE && !j->is_limited);
}

static const char *body_name(const kt_mjcf *m, const surface *s) {
    return s->body > 0 ? kt_mjcf_body_at(m, s->body)->name : NULL;
}

/* ---- effects ----------------------------------------------------------------------------------------------------- */

/* The contact begins at the distance l.distance, by which the plane is moved along its normal. */
static void add_plane_contacts(kt_mjcf *m, const kt_contact_cone *of, const surface *plane, const surface *s) {
    const kt_mjcf_body *b = kt_mjcf_body_at(m, s->body);
    kt_contact_law l;
    if (!find_law(m, plane, s, &l))
        return;
    kt_contact_shape shape = {.element = s->element,
                              .name = kt_element_name(s->element, b->name),
                              .body = b->name,
                              .names = &m->effects_named,
                              .solid = s->solid,
                              .pose = s->pose,
                              .mobility = b->mobility,
                              .turns_freely = mjcf_turns_freely(m, s->body),
                              .mass = contact_tree_mass(m, s->body)};
    memcpy(shape.size, s->size, sizeof shape.size);
    if (s->is_mesh)
        shape.points = kt_mjcf_mesh_points(m, s->element, &shape.point_count);
    kt_ground ground = {.body = body_name(m, plane), .pose = plane->pose};
    ground.pose.position =
        kt_vec3_add(ground.pose.position, kt_vec3_scale(l.distance, ground.pose.rotation.z)); /* the normal */
    kt_contact_make(&m->draft, &shape, &ground, &l, of, kt_vec3_norm(m->gravity), &m->touched);
}

/* Geoms of moving bodies that could touch others: neighbours do not, unless one of both stands still. */
static void count_others(kt_mjcf *m) {
    for (int i = 0; i < m->surfaces.count; i++)
        for (int k = 0; k < i; k++) {
            const surface *a = surface_at(m, i), *b = surface_at(m, k);
            const bool rests = is_still(m, a->body), other_rests = is_still(m, b->body);
            const bool are_near =
                a->body == b->body ||
                (!rests && !other_rests &&
                 (kt_mjcf_body_at(m, a->body)->parent == b->body || kt_mjcf_body_at(m, b->body)->parent == a->body));
            if (!a->is_plane && !b->is_plane && !are_near && masks_allow(a, b) && !(rests && other_rests)) {
                kt_left_count(&m->notes.contacts_between, a->element);
                break;
            }
        }
}

/* Makes boxes that are ground planes. */
static void find_mjcf_floors(kt_mjcf *m) {
    kt_floors floors;
    kt_pose plane;
    if (!kt_floors_begin(&floors, &m->draft, m->gravity, m->surfaces.count))
        return;
    for (int i = 0; i < m->surfaces.count; i++)
        if (!surface_at(m, i)->is_plane && !is_still(m, surface_at(m, i)->body))
            kt_floors_add(&floors, body_name(m, surface_at(m, i)), surface_at(m, i)->pose);
    for (int i = 0; i < m->surfaces.count; i++) {
        surface *s = surface_at(m, i);
        if (s->solid != KT_SOLID_BOX || (s->type == 0 && s->affinity == 0) || !is_still(m, s->body) ||
            !kt_floors_find(&floors, body_name(m, s), s->pose, s->size, &plane))
            continue;
        s->is_plane = true;
        s->pose = plane;
        kt_left_count(&m->touched.floors, s->element);
    }
    kt_floors_end(&floors);
}

void kt_mjcf_contacts(kt_mjcf *m) {
    const kt_robot_options *o = m->source->options;
    const kt_contact_law standard = kt_contact_law_standard();
    surface floor = {.element = m->root, .is_plane = true, .type = ~0U, .affinity = ~0U, .law = standard};
    if (o->contacts && m->off.contacts)
        kt_left_count(&m->notes.contacts_off, m->root);
    if (!o->contacts || m->off.contacts)
        return;
    const kt_contact_cone of = read_cone(m);
    find_mjcf_floors(m);
    floor.pose = kt_pose_identity();
    floor.pose.position.z = o->ground;
    for (int p = o->has_ground ? -1 : 0; p < m->surfaces.count && !m->r->out_of_memory; p++) {
        const surface *plane = p < 0 ? &floor : surface_at(m, p);
        if (!plane->is_plane || !is_still(m, plane->body))
            continue;
        kt_left_count(&m->touched.planes, plane->element);
        for (int i = 0; i < m->surfaces.count && !m->r->out_of_memory; i++)
            if (!surface_at(m, i)->is_plane && !is_still(m, surface_at(m, i)->body))
                add_plane_contacts(m, &of, plane, surface_at(m, i));
    }
    count_others(m);
    m->touched.depth = kt_contact_settle(&m->draft);
    m->notes.soft_stops = (kt_left){.first = m->root, .count = m->draft.soft_stops.count};
}
