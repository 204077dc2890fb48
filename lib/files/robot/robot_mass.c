/* Masses that a robot's file does not give: from the options, and from shapes.
 *
 * Solids of one density have the volumes V_i, the centres c_i and, about these centres, the inertias J_i:
 *     m = density sum V_i,   m c = sum m_i c_i,   J = sum J_i + m_i (|d_i|^2 1 - d_i d_i'),   d_i = c_i - c
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/robot.h"
#include "scene/shapes.h"

#include <math.h>
#include <string.h>

static const kt_shape *shape_at(const kt_body *body, int i) {
    return body->shape_count > 0 ? &body->shapes[i] : &body->shape;
}

static int shape_count(const kt_body *body) {
    return body->shape_count > 0 ? body->shape_count : body->shape.type != KT_SHAPE_NONE;
}

/* Mass, centre and inertia of one shape; false if it has none. */
static bool find_solid(const kt_shape *shape, double density, kt_body *part, kt_vec3 *com, kt_sym3 *inertia) {
    *part = kt_body_default();
    part->shape = *shape;
    part->mass = density * kt_shape_volume(shape);
    part->com_of_shape = part->inertia_of_shape = true;
    return part->mass > 0.0 && kt_body_inertia(part, com, inertia, NULL) == KT_OK;
}

static double body_volume_of(const kt_body *body) {
    double volume = 0.0;
    for (int i = 0; i < shape_count(body); i++)
        volume += kt_shape_volume(shape_at(body, i));
    return volume;
}

bool kt_mass_by_shapes(kt_body *body, double density) {
    kt_body part;
    kt_vec3 com = kt_vec3_make(0.0, 0.0, 0.0), c;
    kt_sym3 inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), own;
    double mass = 0.0;
    for (int i = 0; i < shape_count(body); i++)
        if (find_solid(shape_at(body, i), density, &part, &c, &own)) {
            mass += part.mass;
            com = kt_vec3_add(com, kt_vec3_scale(part.mass, c));
        }
    if (!(mass > 0.0))
        return false;
    com = kt_vec3_scale(1.0 / mass, com);
    for (int i = 0; i < shape_count(body); i++)
        if (find_solid(shape_at(body, i), density, &part, &c, &own))
            inertia = kt_sym3_add(inertia, kt_sym3_shift(own, part.mass, kt_vec3_sub(c, com)));
    body->mass = mass;
    body->com = com;
    body->inertia = inertia;
    return true;
}

bool kt_mass_add_solid(kt_body *body, kt_solid solid, const double size[3], kt_pose pose, double density) {
    const kt_vec3 middle = kt_vec3_make(0.0, 0.0, solid == KT_SOLID_CONE ? -0.5 * size[1] : 0.0);
    const double volume = kt_solid_volume(solid, size);
    const kt_vec3 moments = kt_vec3_scale(volume, kt_solid_moments(solid, size));
    const kt_sym3 own = kt_sym3_make(moments.x, moments.y, moments.z, 0.0, 0.0, 0.0);
    const kt_enclosed part = {
        .volume = volume, .com = kt_pose_apply(pose, middle), .inertia = kt_sym3_rotate(pose.rotation, own)};
    if (volume > 0.0)
        kt_body_add_enclosed(body, density, &part);
    return volume > 0.0;
}

bool kt_mass_add_mesh(kt_reader *r, const kt_robot_source *source, kt_body *body, const char *name, kt_pose pose,
                      kt_vec3 scale, double density) {
    const char *path = name != NULL ? kt_mesh_path(r, source, name) : NULL;
    const kt_scene_mesh mesh = {
        .file = path, .scale = scale, .at = pose.position, .rotation = kt_rotation_of_matrix(pose.rotation)};
    kt_enclosed part = {.volume = 0.0};
    kt_error error = {0};
    const kt_status status = path != NULL ? kt_scene_mesh_enclosed(&mesh, &part, &error) : KT_ERROR_FILE;
    if (status == KT_ERROR_MEMORY)
        (void)kt_reader_out_of_memory(r);
    if (status == KT_OK)
        kt_body_add_enclosed(body, density, &part);
    return status == KT_OK;
}

bool kt_inertia_balance(kt_sym3 *inertia) {
    const double mean = (inertia->xx + inertia->yy + inertia->zz) / 3.0;
    if (kt_inertia_check(*inertia, NULL) != KT_INERTIA_TRIANGLE)
        return false;
    *inertia = kt_sym3_make(mean, mean, mean, 0.0, 0.0, 0.0);
    return true;
}

bool kt_inertia_raise(kt_sym3 *inertia, kt_mat3 axes, double least) {
    const kt_sym3 d = kt_sym3_rotate(kt_mat3_transpose(axes), *inertia);
    if (d.xx >= least && d.yy >= least && d.zz >= least)
        return false;
    *inertia = kt_sym3_rotate(axes, kt_sym3_make(fmax(d.xx, least), fmax(d.yy, least), fmax(d.zz, least), 0, 0, 0));
    return true;
}

/* Replaces the mass of a body. The inertia grows with the mass; a body without mass takes the inertia of its shapes. */
static void give_mass(kt_body *body, double mass) {
    const double volume = body_volume_of(body);
    if (body->mass > 0.0)
        body->inertia = kt_sym3_scaled(mass / body->mass, body->inertia);
    else if (volume > 0.0)
        (void)kt_mass_by_shapes(body, mass / volume);
    body->mass = mass;
}

/* The body of a link by its name in the file, else by that in the scene; NULL: there is none. */
static kt_body *find_link(const kt_draft *d, const char *name) {
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < d->bodies.count; i++)
            if (*kt_draft_link_name(d, i) != NULL &&
                kt_text_is(pass == 0 ? *kt_draft_link_name(d, i) : kt_draft_body_at(d, i)->name, name))
                return kt_draft_body_at(d, i);
    return NULL;
}

static void give(kt_draft *d, const char *text) {
    const char *sign = strrchr(text, '=');
    double mass = 0.0;
    const char *link = kt_reader_text(d->r, &d->r->scratch, text, sign != NULL ? (size_t)(sign - text) : 0);
    if (link == NULL)
        return;
    if (sign == NULL || kt_parse_numbers(sign + 1, 1, &mass) != 1 || !(mass > 0.0)) {
        (void)kt_robot_fault(d->r, d->root, "mass '%.60s': expected LINK=MASS, with a mass above zero", text);
        return;
    }
    kt_body *body = find_link(d, link);
    if (body != NULL)
        give_mass(body, mass);
    else
        (void)kt_robot_fault(d->r, d->root, "mass '%.60s': there is no link of this name", text);
}

void kt_masses_give(kt_draft *d, const kt_robot_options *options) {
    for (int i = 0; i < options->mass_count && !d->r->out_of_memory; i++)
        give(d, options->masses[i]);
}
