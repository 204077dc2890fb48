/* Links and joints of URDF as bodies, effects and loops of a description. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/urdf.h"

#include <math.h>
#include <string.h>

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

static void read_urdf_inertial(kt_reader *r, const kt_element *link, kt_body *body) {
    const kt_element *e = kt_xml_child(link, "inertial");
    kt_sym3 s = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    kt_rotation rotation;
    if (e == NULL)
        return;
    const kt_pose pose = kt_urdf_origin(r, e, &rotation);
    body->com = pose.position;
    const kt_element *mass = kt_xml_child(e, "mass"), *inertia = kt_xml_child(e, "inertia");
    if (mass == NULL || inertia == NULL) {
        (void)kt_robot_fault(r, e, "<%s/> is missing", mass == NULL ? "mass" : "inertia");
        return;
    }
    kt_urdf_need_number(r, mass, "value", &body->mass);
    const struct {
        const char *name;
        double *value;
    } entries[] = {{"ixx", &s.xx}, {"iyy", &s.yy}, {"izz", &s.zz}, {"ixy", &s.xy}, {"ixz", &s.xz}, {"iyz", &s.yz}};
    for (size_t i = 0; i < sizeof entries / sizeof *entries; i++)
        kt_urdf_need_number(r, inertia, entries[i].name, entries[i].value);
    body->inertia = rotation.type != KT_ROTATION_NONE ? kt_sym3_rotate(pose.rotation, s) : s;
}

/* The solid of a geometry: half sizes, or radius and half length; NONE if it is none that a scene has. */
static kt_solid read_urdf_solid(kt_reader *r, const kt_element *geometry, double size[3]) {
    const kt_element *e = geometry != NULL ? geometry->first : NULL;
    double radius = 0.0, length = 0.0;
    if (e != NULL && strcmp(e->name, "box") == 0) {
        const kt_vec3 sides = kt_urdf_vector(r, e, "size", kt_vec3_make(0.0, 0.0, 0.0));
        memcpy(size, (const double[]){0.5 * sides.x, 0.5 * sides.y, 0.5 * sides.z}, 3 * sizeof *size);
        return KT_SOLID_BOX;
    }
    static const struct {
        const char *name;
        kt_solid solid;
    } round[] = {{"sphere", KT_SOLID_SPHERE}, {"cylinder", KT_SOLID_CYLINDER}, {"capsule", KT_SOLID_CAPSULE}};
    for (size_t i = 0; e != NULL && i < sizeof round / sizeof *round; i++) {
        if (strcmp(e->name, round[i].name) != 0)
            continue;
        if (round[i].solid != KT_SOLID_SPHERE)
            kt_urdf_need_number(r, e, "length", &length);
        kt_urdf_need_number(r, e, "radius", &radius);
        memcpy(size, (const double[]){radius, 0.5 * length, 0.0}, 3 * sizeof *size);
        return round[i].solid;
    }
    return KT_SOLID_NONE;
}

/* The scale of a picture is three numbers. A single number applies to all axes. Any other count is noted, and the scale
 * is 1. */
static kt_vec3 read_scale(kt_urdf *u, const kt_element *mesh) {
    double v[3] = {1.0, 1.0, 1.0};
    const char *text = kt_xml_attribute(mesh, "scale");
    const int count = text != NULL ? kt_parse_numbers(text, 3, v) : 3;
    if (count == 1)
        return kt_vec3_make(v[0], v[0], v[0]);
    if (count == 3)
        return kt_vec3_make(v[0], v[1], v[2]);
    kt_left_count(&u->scales, mesh);
    return kt_vec3_make(1.0, 1.0, 1.0);
}

/* Adds a visual or collision to the link's picture; returns whether it has a solid or a mesh at all. */
static bool add_urdf_visual(kt_urdf *u, const kt_element *e) {
    const kt_element *geometry = kt_xml_child(e, "geometry");
    const kt_element *mesh = geometry != NULL ? kt_xml_child(geometry, "mesh") : NULL;
    double size[3];
    kt_rotation rotation;
    const kt_solid solid = mesh == NULL ? read_urdf_solid(u->r, geometry, size) : KT_SOLID_NONE;
    if (mesh == NULL && solid == KT_SOLID_NONE)
        return false;
    const kt_pose pose = kt_urdf_origin(u->r, e, &rotation);
    if (mesh == NULL)
        (void)kt_appearance_add_solid(&u->appearance, e, solid, size, pose, &rotation);
    else
        (void)kt_appearance_add_mesh(&u->appearance, e, kt_xml_attribute(mesh, "filename"), pose, read_scale(u, mesh));
    return true;
}

/* ---- collisions -------------------------------------------------------------------------------------------------- */

/* The last body of the draft has the link, unless the link is the world. */
static void add_urdf_collision(kt_urdf *u, const kt_urdf_link *link, const kt_element *e) {
    const kt_element *geometry = kt_xml_child(e, "geometry");
    const kt_element *mesh = geometry != NULL ? kt_xml_child(geometry, "mesh") : NULL;
    kt_rotation rotation;
    const int body = link->body != NULL ? u->draft.bodies.count - 1 : -1;
    kt_collision item = {.element = e, .body = body, .friction = KT_FRICTION_STANDARD, .mask = ~0U};
    if (u->source->options->contacts) {
        item.friction = kt_urdf_friction(u, link, e);
        item.rolling = kt_urdf_arm(u, link, "rolling_friction");
        item.torsion = kt_urdf_arm(u, link, "spinning_friction");
        item.pose = kt_urdf_origin(u->r, e, &rotation);
        item.scale = mesh != NULL ? read_scale(u, mesh) : kt_vec3_make(1.0, 1.0, 1.0);
        item.mesh = mesh != NULL ? kt_xml_attribute(mesh, "filename") : NULL;
        if (mesh == NULL)
            item.solid = read_urdf_solid(u->r, geometry, item.size);
    }
    kt_collisions_add(&u->collisions, u->r, u->source->options, &item);
}

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

/* The picture: all visuals, or all collisions where no visual can be seen. Returns whether a visual is. */
static bool read_picture(kt_urdf *u, const kt_urdf_link *of, kt_body *body) {
    const kt_element *link = of->element;
    kt_appearance_begin(&u->appearance, body->name);
    for (const kt_element *e = kt_xml_child(link, "visual"); e != NULL; e = kt_xml_next(e, "visual"))
        if (!add_urdf_visual(u, e))
            kt_left_count(&u->shapes, e);
    const bool is_seen = u->appearance.is_seen;
    for (const kt_element *e = kt_xml_child(link, "collision"); e != NULL; e = kt_xml_next(e, "collision")) {
        add_urdf_collision(u, of, e);
        if (!is_seen)
            (void)add_urdf_visual(u, e);
    }
    kt_appearance_end(&u->appearance, !is_seen, link, body);
    return is_seen;
}

/* Adds the solid of a visual or collision to the mass of a body. */
static void add_urdf_mass(kt_urdf *u, const kt_element *e, double density, kt_body *body) {
    const kt_element *geometry = kt_xml_child(e, "geometry");
    const kt_element *mesh = geometry != NULL ? kt_xml_child(geometry, "mesh") : NULL;
    double size[3];
    kt_rotation rotation;
    const kt_pose pose = kt_urdf_origin(u->r, e, &rotation);
    const kt_solid solid = mesh == NULL ? read_urdf_solid(u->r, geometry, size) : KT_SOLID_NONE;
    if (solid != KT_SOLID_NONE)
        (void)kt_mass_add_solid(body, solid, size, pose, density);
    else if (mesh != NULL && !kt_mass_add_mesh(u->r, u->source, body, kt_xml_attribute(mesh, "filename"), pose,
                                               read_scale(u, mesh), density))
        kt_left_count(&u->hollow, mesh);
}

/* Mass and inertia of the shapes of a link: of its visuals, or its collisions where no visual is seen; with
 * `inertiafromgeom` of its collisions, as MuJoCo discards visuals. */
static void set_mass_of_shape(kt_urdf *u, const kt_element *link, bool is_seen, kt_body *body) {
    static const double water = 1000.0;
    const double given = u->source->options->density;
    const bool from_geoms = u->compiler.from_geoms, has_inertial = kt_xml_child(link, "inertial") != NULL;
    const char *tag = from_geoms || !is_seen ? "collision" : "visual";
    kt_body part = kt_body_default();
    if (!from_geoms && (has_inertial || !(given > 0.0)))
        return;
    for (const kt_element *e = kt_xml_child(link, tag); e != NULL; e = kt_xml_next(e, tag))
        add_urdf_mass(u, e, given > 0.0 ? given : water, &part);
    if (!(part.mass > 0.0) && !from_geoms)
        return;
    body->mass = part.mass;
    body->com = part.com;
    body->inertia = part.inertia;
    kt_left_count(from_geoms ? &u->by_geoms : &u->by_density, link);
}

static void make_urdf_body(kt_urdf *u, kt_urdf_link *link) {
    const kt_urdf_joint *j = link->carrier >= 0 ? &u->joints[link->carrier] : NULL;
    kt_body *body = kt_draft_body(&u->draft, j != NULL ? j->element : link->element, link->element);
    if (body == NULL)
        return;
    link->index = u->draft.bodies.count - 1;
    body->name = link->body;
    *kt_draft_link_name(&u->draft, link->index) = kt_element_name(link->element, NULL);
    read_urdf_inertial(u->r, link->element, body);
    if (kt_xml_child(link->element, "inertial") != NULL &&
        kt_xml_next(kt_xml_child(link->element, "inertial"), "inertial") != NULL)
        kt_left_count(&u->doubled, kt_xml_next(kt_xml_child(link->element, "inertial"), "inertial"));
    const bool is_seen = read_picture(u, link, body);
    set_mass_of_shape(u, link->element, is_seen, body);
    if (j == NULL) {
        body->joint.type = u->source->options->floating ? KT_JOINT_FREE : KT_JOINT_FIXED;
        return;
    }
    *kt_draft_joint_name(&u->draft, link->index) = kt_element_name(j->element, NULL);
    body->parent = j->parent >= 0 ? u->links[j->parent].body : NULL;
    body->joint.at = kt_urdf_origin(u->r, j->element, &body->joint.rotation).position;
    if (j->kind == NULL)
        return;
    body->joint.type = j->kind->type;
    if (u->source->options->floating && j->kind->type == KT_JOINT_FIXED && body->parent == NULL) {
        body->joint.type = KT_JOINT_FREE;
        kt_left_count(&u->freed, link->element);
    }
    if (j->kind->type != KT_JOINT_FIXED && j->kind->type != KT_JOINT_FREE)
        body->joint.axis = kt_urdf_vector(u->r, kt_xml_child(j->element, "axis"), "xyz", kt_vec3_make(1.0, 0.0, 0.0));
    if (!j->kind->is_scalar)
        return;
    body->joint.position[0] = j->start;
    body->joint.armature[0] = j->armature;
    body->joint.limits = (kt_joint_limits){j->lower, j->upper, j->speed, j->effort};
}

/* ---- effects and couplings --------------------------------------------------------------------------------------- */

static void make_urdf_effects(kt_urdf *u, const kt_urdf_joint *j) {
    const kt_element *dynamics = kt_xml_child(j->element, "dynamics");
    double damping = 0.0, friction = 0.0;
    (void)kt_urdf_numbers(u->r, dynamics, "damping", 1, &damping);
    (void)kt_urdf_numbers(u->r, dynamics, "friction", 1, &friction);
    if (!j->kind->is_scalar) {
        if (damping != 0.0 || friction != 0.0)
            kt_unknown_count(&u->strange.moving, "dynamics", dynamics);
        return;
    }
    kt_draft_resistance(&u->draft, j->element, j->name, damping, friction);
    if (isfinite(j->lower) || isfinite(j->upper))
        kt_draft_stop(&u->draft, j->element, u->source->options, j->name, j->lower, j->upper);
}

/* q = multiplier q' + offset. */
static void make_coupling(kt_urdf *u, const kt_urdf_joint *j) {
    kt_term *terms;
    const char *name = j->master >= 0 ? kt_robot_print(u->r, &u->r->scratch, "mimic_%s", j->name) : NULL;
    kt_loop *loop =
        name != NULL ? kt_draft_coupling(&u->draft, kt_xml_child(j->element, "mimic"), name, 2, &terms) : NULL;
    if (loop == NULL)
        return;
    terms[0] = (kt_term){.joint = j->name, .coefficient = 1.0};
    terms[1] = (kt_term){.joint = u->joints[j->master].name, .coefficient = -j->multiplier};
    loop->offset = j->offset;
}

/* ---- names of joints --------------------------------------------------------------------------------------------- */

static void name_urdf_joints(kt_urdf *u) {
    const kt_body *bodies = u->draft.bodies.items;
    kt_namer joints;
    if (!kt_namer_init(&joints, u->r, 2 * u->draft.bodies.count))
        return;
    kt_draft_name_joints(&u->draft, &joints);
    for (int i = 0; i < u->link_count; i++)
        if (u->links[i].carrier >= 0 && u->links[i].index >= 0)
            u->joints[u->links[i].carrier].name = kt_joint_name_of(&bodies[u->links[i].index]);
}

/* ---- all of them ------------------------------------------------------------------------------------------------- */

/* The collisions of the link `world`, which is no body. */
static void add_world_collisions(kt_urdf *u, const kt_urdf_link *world) {
    for (const kt_element *e = kt_xml_child(world->element, "collision"); e != NULL; e = kt_xml_next(e, "collision"))
        add_urdf_collision(u, world, e);
}

void kt_urdf_bodies(kt_urdf *u) {
    for (int i = 0; i < u->link_count && !u->r->out_of_memory; i++)
        if (u->links[i].body != NULL)
            make_urdf_body(u, &u->links[i]);
        else
            add_world_collisions(u, &u->links[i]);
    if (u->r->out_of_memory || !kt_namer_init(&u->draft.loop_names, u->r, u->joint_count + 1))
        return;
    kt_urdf_settle_masses(u);
    name_urdf_joints(u);
    for (int i = 0; i < u->joint_count && !u->r->out_of_memory; i++)
        if (u->joints[i].kind != NULL && u->joints[i].name != NULL) {
            make_urdf_effects(u, &u->joints[i]);
            make_coupling(u, &u->joints[i]);
        }
}
