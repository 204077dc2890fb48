/* Masses, inertias and pictures of bodies in MJCF, by <inertial> or from geoms. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf_axes.h"
#include "robot/mjcf_mesh.h"

#include <math.h>
#include <string.h>

typedef enum geom_type { PLANE, HFIELD, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX, MESH, SDF } geom_type;
static const char *const geom_words[] = {"plane",    "hfield", "sphere", "capsule", "ellipsoid",
                                         "cylinder", "box",    "mesh",   "sdf",     NULL};
static const kt_solid solids[] = {
    [PLANE] = KT_SOLID_NONE,      [HFIELD] = KT_SOLID_NONE,         [SPHERE] = KT_SOLID_SPHERE,
    [CAPSULE] = KT_SOLID_CAPSULE, [ELLIPSOID] = KT_SOLID_ELLIPSOID, [CYLINDER] = KT_SOLID_CYLINDER,
    [BOX] = KT_SOLID_BOX,         [MESH] = KT_SOLID_NONE,           [SDF] = KT_SOLID_NONE};

/* A geom: its solid, its pose in the body, and its mass and inertia. */
typedef struct geom {
    geom_type type;
    double size[3]; /* half sizes; radius, half length */
    kt_pose pose;
    double mass;
    kt_vec3 com;     /* body frame */
    kt_sym3 inertia; /* about com, body axes */
    bool is_lost;    /* a mesh of unknown mass */
    bool is_shell;   /* the mass is that of the surface; never of a mesh */
    bool is_fitted;  /* to a mesh */
    const kt_mjcf_mesh *mesh;
} geom;

/* ---- solids ------------------------------------------------------------------------------------------------------ */

/* How many numbers of `size` a type has, without and with `fromto`. */
static int geom_sizes_of(geom_type type, bool has_ends) {
    const bool is_round = type == SPHERE || ((type == CAPSULE || type == CYLINDER) && has_ends);
    const bool is_long = type == CAPSULE || type == CYLINDER;
    if (is_round || ((type == BOX || type == ELLIPSOID) && has_ends))
        return 1;
    return is_long ? 2 : type == BOX || type == ELLIPSOID ? 3 : 0;
}

static void read_size(kt_mjcf *m, const kt_element *e, geom *g) {
    double ends[6];
    const bool has_ends = kt_mjcf_text(m, e, "geom", "fromto") != NULL;
    const int need = geom_sizes_of(g->type, has_ends);
    (void)kt_mjcf_numbers(m, e, "geom", "size", 1, 3, g->size);
    for (int i = 0; i < need; i++)
        if (!(g->size[i] > 0.0)) {
            (void)kt_mjcf_fault(m, e, "size: a %s needs %d number%s above zero", geom_words[g->type], need,
                                need > 1 ? "s" : "");
            g->size[0] = g->size[1] = g->size[2] = 1.0;
            return;
        }
    if (!has_ends || need != 1 || kt_mjcf_numbers(m, e, "geom", "fromto", 6, 6, ends) != 6)
        return;
    const double half = 0.5 * kt_vec3_norm(kt_vec3_make(ends[3] - ends[0], ends[4] - ends[1], ends[5] - ends[2]));
    g->size[1] = g->size[2] = half;
    if (g->type == BOX || g->type == ELLIPSOID)
        g->size[1] = g->size[0];
}

/* MuJoCo weighs a field of heights as a box of the quarter of its heights and half of its base. */
static void read_field_size(kt_mjcf *m, const kt_element *field_geom, double size[3]) {
    const char *name = kt_mjcf_text(m, field_geom, "geom", "hfield");
    double field[4];
    for (const kt_element *e = kt_mjcf_section(m, "asset", NULL); e != NULL; e = kt_mjcf_section(m, "asset", e)) {
        const char *own = strcmp(e->name, "hfield") == 0 ? kt_mjcf_asset_name(m, e) : NULL;
        if (!kt_text_is(name, own) || kt_mjcf_numbers(m, e, NULL, "size", 4, 4, field) != 4)
            continue;
        size[0] = field[0];
        size[1] = field[1];
        size[2] = 0.25 * field[2] + 0.5 * field[3];
    }
}

/* The solid whose mass a geom has. */
static kt_solid weighed_solid_of(const geom *g) { return g->type == HFIELD ? KT_SOLID_BOX : solids[g->type]; }

/* The mass of a geom divided by its density: the volume, or the area of a shell. */
static double geom_measure_of(const geom *g) {
    if (g->type == MESH)
        return g->mesh != NULL ? g->mesh->enclosed.volume : 0.0;
    return g->is_shell ? kt_shell_area(weighed_solid_of(g), g->size) : kt_solid_volume(weighed_solid_of(g), g->size);
}

/* ---- geoms ------------------------------------------------------------------------------------------------------- */

/* Whether a geom has mass. */
static bool counts(kt_mjcf *m, const kt_element *e) {
    const double group = kt_mjcf_number(m, e, "geom", "group", 0.0);
    return m->geoms_have_mass && group >= m->body_settings->group_first && group <= m->body_settings->group_last;
}

/* volume: that of a mesh, whose own moments are those of density 1. */
static void set_moments(geom *g, double volume) {
    const kt_solid solid = weighed_solid_of(g);
    const kt_vec3 moments =
        kt_vec3_scale(g->mass, g->is_shell ? kt_shell_moments(solid, g->size) : kt_solid_moments(solid, g->size));
    g->inertia = kt_sym3_rotate(g->pose.rotation, kt_sym3_make(moments.x, moments.y, moments.z, 0.0, 0.0, 0.0));
    if (g->mesh == NULL)
        return;
    g->com = kt_pose_apply(g->pose, g->mesh->enclosed.com);
    g->inertia = kt_sym3_scaled(g->mass / volume, kt_sym3_rotate(g->pose.rotation, g->mesh->enclosed.inertia));
}

/* The mass that a geom gives to its body. A mesh is read only if its mass is needed. */
static void set_mass(kt_mjcf *m, const kt_element *e, geom *g) {
    const bool by_options = m->source->options->density > 0.0 && kt_mjcf_text(m, e, "geom", "density") == NULL;
    const double standard = by_options ? m->source->options->density : 1000.0;
    double mass = 0.0, density = kt_mjcf_number(m, e, "geom", "density", standard);
    const bool has_mass = kt_mjcf_numbers(m, e, "geom", "mass", 1, 1, &mass) == 1;
    if (mass < 0.0 || density < 0.0)
        (void)kt_mjcf_fault(m, e, "mass and density cannot be below zero");
    if (!counts(m, e) || !((has_mass ? mass : density) > 0.0))
        return;
    if (g->type == MESH)
        g->mesh = kt_mjcf_find_mesh(m, e);
    g->is_shell = g->type != MESH && kt_mjcf_flag(m, e, "geom", "shellinertia", false);
    const double volume = geom_measure_of(g);
    g->is_lost = (g->type == MESH || g->type == HFIELD) && !(volume > 0.0);
    if (!(volume > 0.0))
        return;
    g->mass = has_mass ? mass : density * volume;
    if (by_options && !has_mass)
        kt_left_count(&m->notes.by_density, e);
    set_moments(g, volume);
}

/* Fits a solid to the mesh of a geom. If the mesh cannot be read, the geom remains a mesh. */
static void fit_geom(kt_mjcf *m, const kt_element *e, geom *g) {
    kt_pose within = kt_pose_identity();
    g->is_fitted = g->type != SDF && kt_mjcf_fit(m, e, solids[g->type], g->size, &within);
    g->pose = kt_pose_compose(g->pose, within);
    if (!g->is_fitted)
        g->type = MESH;
}

static geom read_geom(kt_mjcf *m, const kt_element *e, kt_pose frame) {
    geom g = {.type = (geom_type)kt_mjcf_choice(m, e, "geom", "type", geom_words, SPHERE)};
    g.pose = kt_pose_compose(frame, kt_mjcf_pose(m, e, "geom"));
    if (g.type != MESH && kt_mjcf_text(m, e, "geom", "mesh") != NULL)
        fit_geom(m, e, &g);
    else if (geom_sizes_of(g.type, false) > 0)
        read_size(m, e, &g);
    g.com = g.pose.position;
    if (g.type == HFIELD)
        read_field_size(m, e, g.size);
    set_mass(m, e, &g);
    return g;
}

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

/* MuJoCo shows groups 0 to 2; the others are collisions of bodies that have visuals, too. */
static bool is_visual(kt_mjcf *m, const kt_element *e) { return kt_mjcf_number(m, e, "geom", "group", 0.0) <= 2.0; }

static void find_visual(kt_mjcf *m, const kt_element *e, int body, kt_pose frame) {
    (void)body, (void)frame;
    m->has_visuals = m->has_visuals || is_visual(m, e);
}

/* Adds the picture of a geom. Its contacts are counted as omitted, because the scene has the picture alone. */
static void add_picture(kt_mjcf *m, const kt_element *e, int body, const geom *g) {
    const bool is_drawn = solids[g->type] != KT_SOLID_NONE;
    if (kt_mjcf_number(m, e, "geom", "contype", 1.0) != 0.0 || kt_mjcf_number(m, e, "geom", "conaffinity", 1.0) != 0.0)
        kt_left_count(&m->notes.contacts, e);
    if (m->has_visuals && !is_visual(m, e))
        return;
    if (body == 0 || (!is_drawn && g->type != MESH)) {
        kt_left_count(&m->notes.pictures, e);
    } else if (g->type == MESH) {
        kt_mjcf_draw_mesh(m, e, g->pose);
    } else {
        (void)kt_appearance_add_solid(&m->appearance, e, solids[g->type], g->size, g->pose, NULL);
    }
}

/* Keeps the picture of a body, after its geoms have been read. */
static void keep_picture(kt_mjcf *m, kt_mjcf_body *b) {
    kt_body body = kt_body_default();
    body.name = b->name;
    kt_appearance_end(&m->appearance, !m->has_visuals, b->element, &body);
    b->shape = body.shape;
    b->shapes = body.shapes;
    b->shape_count = body.shape_count;
}

/* ---- all geoms of a body ----------------------------------------------------------------------------------------- */

/* The axes of a mesh are those of its inertia. */
static kt_mat3 inertia_axes_of(const geom *g) {
    return g->mesh != NULL ? kt_mat3_multiply(g->pose.rotation, g->mesh->axes) : g->pose.rotation;
}

/* Adds a geom to the mass, first moment and inertia about the body's origin. */
static void add_geom(kt_mjcf *m, const kt_element *e, int body, kt_pose frame) {
    kt_mjcf_body *b = kt_mjcf_body_at(m, body);
    const geom g = read_geom(m, e, frame);
    b->heavy_geoms += g.mass > 0.0;
    b->has_mesh = b->has_mesh || g.mesh != NULL || g.is_fitted;
    if (g.mass > 0.0)
        b->inertial = (kt_pose){.rotation = inertia_axes_of(&g), .position = g.com};
    b->mass += g.mass;
    b->com = kt_vec3_add(b->com, kt_vec3_scale(g.mass, g.com));
    b->inertia = kt_sym3_add(b->inertia, kt_sym3_shift(g.inertia, g.mass, g.com));
    b->lost_meshes += g.is_lost;
    add_picture(m, e, body, &g);
    kt_mjcf_add_surface(m, e, body, solids[g.type], g.size, g.pose);
}

/* Until now, com is the sum of m c, and the inertia is about the body's origin: com becomes the centre, with the
 * inertia about it. */
static void centre_geoms(kt_mjcf *m, kt_mjcf_body *b) {
    if (b->lost_meshes > 0)
        kt_note_massless(&m->massless_names, &m->notes.mesh_masses, b->name, b->element);
    if (!(b->mass > 0.0))
        return;
    b->com = kt_vec3_scale(1.0 / b->mass, b->com);
    b->inertia = kt_sym3_shift(b->inertia, -b->mass, b->com);
    b->has_axes = b->heavy_geoms == 1;
    kt_left_count(&m->notes.by_geoms, b->element);
}

/* ---- <inertial> -------------------------------------------------------------------------------------------------- */

static void read_mjcf_inertial(kt_mjcf *m, const kt_element *e, kt_mjcf_body *b) {
    const kt_pose pose = kt_mjcf_pose(m, e, NULL);
    double full[6] = {0.0};
    b->com = pose.position;
    if (kt_xml_attribute(e, "mass") == NULL || kt_xml_attribute(e, "pos") == NULL)
        (void)kt_mjcf_fault(m, e, "the attribute '%s' is missing",
                            kt_xml_attribute(e, "mass") == NULL ? "mass" : "pos");
    b->mass = kt_mjcf_number(m, e, NULL, "mass", 0.0);
    if (kt_mjcf_numbers(m, e, NULL, "fullinertia", 6, 6, full) == 0)
        (void)kt_mjcf_numbers(m, e, NULL, "diaginertia", 3, 3, full);
    b->inertial = pose;
    b->has_axes = full[3] == 0.0 && full[4] == 0.0 && full[5] == 0.0;
    b->inertia = kt_sym3_rotate(pose.rotation, kt_sym3_make(full[0], full[1], full[2], full[3], full[4], full[5]));
}

void kt_mjcf_masses(kt_mjcf *m, int body) {
    kt_mjcf_body *b = kt_mjcf_body_at(m, body);
    const kt_element *inertial = body > 0 ? kt_xml_child(b->element, "inertial") : NULL;
    m->body_settings = kt_mjcf_settings_of(m, b->element);
    const kt_mjcf_from_geom how = m->body_settings->from_geom;
    m->geoms_have_mass = body > 0 && (how == KT_MJCF_ALWAYS || (how == KT_MJCF_AUTO && inertial == NULL));
    m->has_visuals = false;
    kt_mjcf_for_each(m, b->element, "geom", body, find_visual);
    kt_appearance_begin(&m->appearance, b->name);
    kt_mjcf_for_each(m, b->element, "geom", body, add_geom);
    keep_picture(m, b);
    if (m->geoms_have_mass)
        centre_geoms(m, b);
    if (inertial != NULL && b->heavy_geoms == 0 && b->lost_meshes == 0)
        read_mjcf_inertial(m, inertial, b);
}

/* ---- the compiler's settings ------------------------------------------------------------------------------------- */

/* The axes of an inertia that changes. The axes remain, as in MuJoCo, even if moments become equal, because a medium
 * and aligned frames use them. */
static void keep_axes(kt_mjcf_body *b) {
    b->inertial = (kt_pose){.rotation = kt_mjcf_axes_of_body(b), .position = b->com};
    b->has_axes = true;
}

/* Principal moments below the least become the least. */
static void bound_inertia(kt_mjcf *m, double least, kt_mjcf_body *b) {
    kt_sym3 raised = b->inertia;
    if (!kt_inertia_raise(&raised, kt_mjcf_axes_of_body(b), least))
        return;
    keep_axes(b);
    b->inertia = raised;
    kt_left_count(&m->notes.bounded, b->element);
}

/* An inertia that no body has becomes that of a sphere with the same trace. */
static void balance(kt_mjcf *m, kt_mjcf_body *b) {
    kt_sym3 balanced = b->inertia;
    if (!kt_inertia_balance(&balanced))
        return;
    keep_axes(b);
    b->inertia = balanced;
    kt_left_count(&m->notes.balanced, b->element);
}

/* Raises a mass to the least. The frame of the inertia of a body without geoms and <inertial> is the numbers of the
 * body's own, in the axes of the body: MuJoCo takes them there. */
static void bound_mass(kt_mjcf *m, double least, kt_mjcf_body *b) {
    if (b->heavy_geoms == 0 && kt_xml_child(b->element, "inertial") == NULL) {
        b->inertial = kt_mjcf_pose(m, b->element, NULL);
        b->com = b->inertial.position;
        b->has_axes = true;
    }
    b->mass = least;
    kt_left_count(&m->notes.bounded, b->element);
}

/* Whether the body, or a body that carries it, has a joint. */
static bool moves_in_world(const kt_mjcf *m, int body) {
    while (body > 0 && kt_mjcf_body_at(m, body)->joint_count == 0)
        body = kt_mjcf_body_at(m, body)->parent;
    return body > 0;
}

/* Counts bodies that MuJoCo makes parts of their parents, if this changes the motion. In a medium, drag acts on one box
 * around both. A part has the gravcomp of its parent. The total mass leaves out parts of the world. */
static void count_fused(kt_mjcf *m, const kt_mjcf_settings *s) {
    for (int i = 1; i < m->bodies.count && s->fuses_static; i++) {
        const kt_mjcf_body *b = kt_mjcf_body_at(m, i);
        const bool differs = moves_in_world(m, b->parent) ? m->density > 0.0 || m->viscosity > 0.0 ||
                                                                b->gravcomp != kt_mjcf_body_at(m, b->parent)->gravcomp
                                                          : s->total_mass > 0.0;
        if (differs && b->joint_count == 0 && b->mass > 0.0)
            kt_unknown_count(&m->changes,
                             "fusestatic, by which MuJoCo may fuse fixed bodies: in a medium, with another gravcomp, "
                             "or with settotalmass",
                             b->element);
    }
}

void kt_mjcf_settle_masses(kt_mjcf *m) {
    double total = 0.0;
    for (int i = 1; i < m->bodies.count; i++) {
        kt_mjcf_body *b = kt_mjcf_body_at(m, i);
        const kt_mjcf_settings *s = kt_mjcf_settings_of(m, b->element);
        if (b->mass < s->mass_least)
            bound_mass(m, s->mass_least, b);
        if (s->least > 0.0)
            bound_inertia(m, s->least, b);
        if (s->balance)
            balance(m, b);
        total += b->mass;
    }
    count_fused(m, kt_mjcf_settings_of(m, m->root));
    const double wanted = kt_mjcf_settings_of(m, m->root)->total_mass; /* of the whole: no attached model's */
    if (!(wanted > 0.0) || !(total > 0.0))
        return;
    const double scale = wanted / total;
    for (int i = 1; i < m->bodies.count; i++) {
        kt_mjcf_body *b = kt_mjcf_body_at(m, i);
        b->mass *= scale;
        b->inertia = kt_sym3_scaled(scale, b->inertia);
    }
}
