/* Masses, inertias and pictures of links in SDF.
 *
 * A link without <inertial> has the format's mass of 1 kg and unit moments of inertia in kg m^2. Values that are
 * missing in <mass> and <inertia> have the same defaults. With auto="true", mass and inertia are those of the solids of
 * its collisions, with their densities. A <mass> next to auto="true" scales both, as in libsdformat since 15.2.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/sdf.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- solids ------------------------------------------------------------------------------------------------------ */

typedef struct solid {
    kt_solid type;
    double size[3]; /* half sizes; radius, half length */
} solid;

/* The solid of a <geometry>. Missing numbers have the format's defaults. */
static solid read_solid(kt_sdf *m, const kt_element *geometry) {
    static const char *const names[] = {[KT_SOLID_NONE] = "",
                                        [KT_SOLID_SPHERE] = "sphere",
                                        [KT_SOLID_CAPSULE] = "capsule",
                                        [KT_SOLID_ELLIPSOID] = "ellipsoid",
                                        [KT_SOLID_CYLINDER] = "cylinder",
                                        [KT_SOLID_CONE] = "cone",
                                        [KT_SOLID_BOX] = "box"};
    solid s = {.type = KT_SOLID_NONE};
    for (int i = 1; i < (int)(sizeof names / sizeof *names); i++) {
        const kt_element *e = kt_xml_child(geometry, names[i]);
        if (e == NULL)
            continue;
        const kt_vec3 one = kt_vec3_make(1.0, 1.0, 1.0);
        s.type = (kt_solid)i;
        if (s.type == KT_SOLID_BOX || s.type == KT_SOLID_ELLIPSOID) {
            const bool is_box = s.type == KT_SOLID_BOX;
            const kt_vec3 v = kt_sdf_vector(m, e, is_box ? "size" : "radii", one);
            const double half = is_box ? 0.5 : 1.0;
            s.size[0] = half * v.x;
            s.size[1] = half * v.y;
            s.size[2] = half * v.z;
        } else {
            s.size[0] = kt_sdf_number(m, e, "radius", s.type == KT_SOLID_CAPSULE ? 0.5 : 1.0);
            s.size[1] = 0.5 * kt_sdf_number(m, e, "length", 1.0);
        }
    }
    return s;
}

static bool solid_has_size(const solid *s) {
    const bool is_long = s->type != KT_SOLID_SPHERE, is_wide = s->type == KT_SOLID_BOX || s->type == KT_SOLID_ELLIPSOID;
    return s->size[0] > 0.0 && (!is_long || s->size[1] > 0.0) && (!is_wide || s->size[2] > 0.0);
}

/* ---- masses ------------------------------------------------------------------------------------------------------ */

/* The mesh of an included model is next to the model's file. */
static const char *sdf_mesh_uri(kt_sdf *m, const kt_element *e, const kt_element *mesh) {
    const char *uri = kt_sdf_text(mesh, "uri");
    if (uri == NULL || m->source->folder == NULL || uri[0] == '/' || strstr(uri, "://") != NULL)
        return uri;
    const char *near = kt_include_relative(m->r, m->source, e, uri);
    return near != NULL && kt_include_is_there(m->r, m->source, near) ? near : uri;
}

/* Adds a collision to mass, com and inertia. A mesh that cannot be read, or is not closed, adds nothing. */
static void add_sdf_collision(kt_sdf *m, const kt_sdf_link *link, const kt_element *e, double standard, kt_body *body,
                              bool *has_mesh) {
    const kt_element *geometry = kt_xml_child(e, "geometry");
    const kt_element *mesh = geometry != NULL ? kt_xml_child(geometry, "mesh") : NULL;
    const solid s = geometry != NULL ? read_solid(m, geometry) : (solid){.type = KT_SOLID_NONE};
    const kt_pose pose = kt_sdf_pose_within(m, e, link->frame);
    const double density = kt_sdf_number(m, e, "density", standard);
    if (s.type != KT_SOLID_NONE && solid_has_size(&s))
        (void)kt_mass_add_solid(body, s.type, s.size, pose, density);
    else if (mesh != NULL && !(density > 0.0 &&
                               kt_mass_add_mesh(m->r, m->source, body, sdf_mesh_uri(m, geometry, mesh), pose,
                                                kt_sdf_vector(m, mesh, "scale", kt_vec3_make(1.0, 1.0, 1.0)), density)))
        *has_mesh = true;
}

static bool sum_collisions(kt_sdf *m, const kt_sdf_link *link, double density, kt_body *body) {
    bool has_mesh = false;
    body->inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (const kt_element *e = kt_xml_child(link->element, "collision"); e != NULL; e = kt_xml_next(e, "collision"))
        add_sdf_collision(m, link, e, density, body, &has_mesh);
    if (has_mesh)
        kt_note_massless(&m->massless_names, &m->lost_masses, link->body, link->element);
    return body->mass > 0.0;
}

void kt_sdf_masses(kt_sdf *m, const kt_sdf_link *link, kt_body *body) {
    const kt_element *inertial = kt_xml_child(link->element, "inertial");
    const kt_element *inertia = inertial != NULL ? kt_xml_child(inertial, "inertia") : NULL;
    const char *automatic = inertial != NULL ? kt_xml_attribute(inertial, "auto") : NULL;
    if (automatic != NULL && kt_sdf_is_true(m, inertial, automatic)) {
        const double standard = m->source->options->density > 0.0 ? m->source->options->density : 1000.0;
        const bool has_mass = sum_collisions(m, link, kt_sdf_number(m, inertial, "density", standard), body);
        const double mass = kt_sdf_number(m, inertial, "mass", body->mass);
        body->inertia = kt_sym3_scaled(has_mass ? mass / body->mass : 1.0, body->inertia);
        body->mass = mass;
        kt_left_count(&m->by_geometry, link->element);
        return;
    }
    if (inertial == NULL && m->source->options->density > 0.0 && !link->is_static &&
        sum_collisions(m, link, m->source->options->density, body)) {
        kt_left_count(&m->by_density, link->element);
        return;
    }
    const kt_pose pose = kt_sdf_read_pose(m, inertial != NULL ? kt_xml_child(inertial, "pose") : NULL);
    const kt_sym3 own = kt_sym3_make(kt_sdf_number(m, inertia, "ixx", 1.0), kt_sdf_number(m, inertia, "iyy", 1.0),
                                     kt_sdf_number(m, inertia, "izz", 1.0), kt_sdf_number(m, inertia, "ixy", 0.0),
                                     kt_sdf_number(m, inertia, "ixz", 0.0), kt_sdf_number(m, inertia, "iyz", 0.0));
    const kt_vec3 turn = pose.rotation.x;
    body->mass = kt_sdf_number(m, inertial, "mass", 1.0);
    body->com = pose.position;
    body->inertia = turn.x == 1.0 && pose.rotation.y.y == 1.0 ? own : kt_sym3_rotate(pose.rotation, own);
    if ((inertia == NULL || kt_sdf_text(inertial, "mass") == NULL) && !link->is_static)
        kt_left_count(&m->standard_masses, link->element);
}

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

/* Adds a visual or collision to the link's picture. Returns whether it has a solid or mesh that pictures support. */
static bool add_sdf_visual(kt_sdf *m, const kt_sdf_link *link, const kt_element *e) {
    const kt_element *geometry = kt_xml_child(e, "geometry");
    const kt_element *mesh = geometry != NULL ? kt_xml_child(geometry, "mesh") : NULL;
    const solid s = geometry != NULL ? read_solid(m, geometry) : (solid){.type = KT_SOLID_NONE};
    if (mesh != NULL) {
        const kt_vec3 scale = kt_sdf_vector(m, mesh, "scale", kt_vec3_make(1.0, 1.0, 1.0));
        (void)kt_appearance_add_mesh(&m->appearance, e, sdf_mesh_uri(m, e, mesh), kt_sdf_pose_within(m, e, link->frame),
                                     scale);
        return true;
    }
    if (s.type == KT_SOLID_NONE)
        return false;
    (void)kt_appearance_add_solid(&m->appearance, e, s.type, s.size, kt_sdf_pose_within(m, e, link->frame), NULL);
    return true;
}

/* ---- collisions -------------------------------------------------------------------------------------------------- */

/* The bits with which a collision touches others; 0: it touches nothing. */
static unsigned collision_mask_of(kt_sdf *m, const kt_element *contact) {
    const char *text = contact != NULL ? kt_sdf_text(contact, "collide_bitmask") : NULL;
    if (contact != NULL && kt_sdf_flag(m, contact, "collide_without_contact", false))
        return 0;
    return text != NULL ? (unsigned)strtoul(text, NULL, 0) : 0xFFFFU;
}

/* Sets the solid, the plane or the mesh of a collision. */
static void set_geometry(kt_sdf *m, const kt_element *geometry, kt_collision *item) {
    const kt_element *plane = kt_xml_child(geometry, "plane"), *mesh = kt_xml_child(geometry, "mesh");
    const solid s = read_solid(m, geometry);
    item->solid = s.type;
    memcpy(item->size, s.size, sizeof item->size);
    item->is_plane = plane != NULL;
    item->mesh = mesh != NULL ? sdf_mesh_uri(m, geometry, mesh) : NULL;
    item->scale = kt_sdf_vector(m, mesh, "scale", kt_vec3_make(1.0, 1.0, 1.0));
    if (plane == NULL)
        return;
    const kt_vec3 z = kt_vec3_make(0.0, 0.0, 1.0), normal = kt_sdf_vector(m, plane, "normal", z);
    item->pose.rotation = kt_mat3_multiply(item->pose.rotation, kt_triad_from_axis(normal, 2));
}

/* The arm of torsional friction, m. The pressure of Hertz on a patch of radius a has the moment 3 pi / 16 a mu N. A
 * surface_radius R in place of a patch_radius is left out: a = sqrt(R x) grows with the depth x then. */
static double torsion_of(kt_sdf *m, const kt_element *collision, const kt_element *friction) {
    const kt_element *e = friction != NULL ? kt_xml_child(friction, "torsional") : NULL;
    const double mu = kt_sdf_number(m, e, "coefficient", 1.0), patch = kt_sdf_number(m, e, "patch_radius", 0.0);
    if (e == NULL || kt_sdf_flag(m, e, "use_patch_radius", true))
        return fmax(3.0 / 16.0 * 3.14159265358979323846 * patch * mu, 0.0);
    if (kt_sdf_number(m, e, "surface_radius", 0.0) > 0.0 && mu > 0.0)
        kt_left_count(&m->collisions.deepening, collision);
    return 0.0;
}

/* The friction of the first and of the second direction: of `ode`, or else of `bullet`. */
static void read_friction(kt_sdf *m, const kt_element *friction, double mu[2]) {
    const kt_element *ode = friction != NULL ? kt_xml_child(friction, "ode") : NULL;
    const kt_element *bullet = friction != NULL ? kt_xml_child(friction, "bullet") : NULL;
    const bool is_ode = bullet == NULL || (ode != NULL && kt_xml_child(ode, "mu") != NULL);
    mu[0] = kt_sdf_number(m, is_ode ? ode : bullet, is_ode ? "mu" : "friction", KT_FRICTION_STANDARD);
    mu[1] = kt_sdf_number(m, is_ode ? ode : bullet, is_ode ? "mu2" : "friction2", mu[0]);
}

static void add_sdf_contact(kt_sdf *m, const kt_sdf_link *link, const kt_element *e) {
    const kt_element *geometry = kt_xml_child(e, "geometry"), *surface = kt_xml_child(e, "surface");
    const kt_element *friction = surface != NULL ? kt_xml_child(surface, "friction") : NULL;
    kt_collision item = {.element = e, .body = link->index, .friction = KT_FRICTION_STANDARD};
    if (m->source->options->contacts && geometry != NULL) {
        item.mask = collision_mask_of(m, surface != NULL ? kt_xml_child(surface, "contact") : NULL);
        item.pose = kt_sdf_pose_within(m, e, link->frame);
        double mu[2];
        read_friction(m, friction, mu);
        const double drake = kt_friction_of_drake(&m->collisions, e);
        item.friction = drake >= 0.0 ? drake : mu[0];
        item.torsion = torsion_of(m, e, friction);
        if (drake < 0.0 && mu[1] != mu[0])
            kt_left_count(&m->collisions.directional, e);
        set_geometry(m, geometry, &item);
    }
    kt_collisions_add(&m->collisions, m->r, m->source->options, &item);
}

/* ---- the picture of a link --------------------------------------------------------------------------------------- */

/* The picture: all visuals, or all collisions where no visual can be seen. */
void kt_sdf_picture(kt_sdf *m, const kt_sdf_link *link, kt_body *body) {
    kt_appearance_begin(&m->appearance, body->name);
    for (const kt_element *e = kt_xml_child(link->element, "visual"); e != NULL; e = kt_xml_next(e, "visual"))
        if (!add_sdf_visual(m, link, e))
            kt_left_count(&m->pictures, e);
    const bool is_seen = m->appearance.is_seen;
    for (const kt_element *e = kt_xml_child(link->element, "collision"); e != NULL; e = kt_xml_next(e, "collision")) {
        add_sdf_contact(m, link, e);
        if (!is_seen)
            (void)add_sdf_visual(m, link, e);
    }
    kt_appearance_end(&m->appearance, !is_seen, link->element, body);
}
