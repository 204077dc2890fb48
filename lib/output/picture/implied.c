/* The solids that a scene leaves out: thin rods between the joints of a body without a shape, and a ball at its centre
 * of mass. The rods and balls come after the solids of the scene, and only where these leave a gap. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/maker.h"
#include "picture/solid.h"

#include <float.h>

static kt_solid thin_rod(const kt_picture_maker *m, int body, kt_vec3 from, kt_vec3 to) {
    kt_solid rod = kt_solid_rod(from, to, 0.7 * m->picture->radius);
    rod.body = body;
    rod.source = KT_SOURCE_IMPLIED;
    return rod;
}

/* Whether a rigid part has a mesh. Frames of joints need not be on the mesh, and a body without a visible shape may be
 * inside the mesh (a sensor, a screw). */
static bool has_mesh_near(const kt_picture_maker *m, int body) {
    const kt_picture *p = m->picture;
    int i = m->first[p->part[body]];
    while (i >= 0 && p->solids[i].mesh == NULL)
        i = m->next[i];
    return i >= 0;
}

/* The mass of a body without shape: a ball; the body of a slider: a block along its guide. */
static void imply_mass(kt_picture_maker *m, int body) {
    const kt_body *source = kt_picture_source(m, body);
    const double r = m->picture->radius;
    const bool slides = source->joint.type == KT_JOINT_PRISMATIC;
    kt_solid solid = {.type = slides ? KT_SOLID_BOX : KT_SOLID_SPHERE,
                      .source = KT_SOURCE_IMPLIED,
                      .body = body,
                      .half =
                          slides ? kt_vec3_make(2.0 * r, 2.0 * r, 3.5 * r) : kt_vec3_make(2.4 * r, 2.4 * r, 2.4 * r)};
    solid.pose.rotation = slides ? kt_triad_from_axis(kt_vec3_normalize(source->joint.axis), 2) : kt_mat3_identity();
    solid.pose.position = slides ? kt_vec3_make(0.0, 0.0, 0.0) : source->com;
    if (!kt_picture_has_own(m, body) && !has_mesh_near(m, body) &&
        (source->mass > 0.0 || (slides && !kt_picture_is_number(m, body))))
        kt_picture_add_solid(m, solid);
}

static bool is_implied_rod(const kt_solid *solid) {
    return solid->source == KT_SOURCE_IMPLIED && solid->type == KT_SOLID_ROD;
}

/* The distance of a place in the world to the nearest solid of the rigid part of a body, and the nearest point. If
 * `only` is not -1, only solids of that body count. Implied rods count if has_rods. DBL_MAX: the part has no solid. */
static double distance_to_part(const kt_picture_maker *m, int body, kt_vec3 at, int only, bool has_rods,
                               kt_vec3 *nearest) {
    const kt_picture *p = m->picture;
    double least = DBL_MAX;
    for (int i = m->first[p->part[body]]; i >= 0; i = m->next[i]) {
        if ((only >= 0 && p->solids[i].body != only) || (!has_rods && is_implied_rod(&p->solids[i])))
            continue;
        const kt_pose pose = kt_pose_compose(m->poses[p->solids[i].body], p->solids[i].pose);
        const kt_vec3 local = kt_pose_apply(kt_pose_invert(pose), at);
        const kt_vec3 found = kt_pose_apply(pose, kt_solid_nearest(&p->solids[i], local));
        const double distance = kt_vec3_norm(kt_vec3_sub(found, at));
        if (distance < least) {
            least = distance;
            *nearest = found;
        }
    }
    return least;
}

/* Connects a point of a body with the nearest solid of its rigid part, if the point is not at a solid already. Rods
 * that are implied for other points count only if the part has nothing else: rods to several points are spokes. If
 * `only` is not -1, only solids of that body count. */
static void attach_to(kt_picture_maker *m, int body, kt_vec3 point, int only) {
    const double close = 1.5 * m->picture->radius;
    const kt_vec3 at = kt_pose_apply(m->poses[body], point);
    kt_vec3 nearest = at;
    if (has_mesh_near(m, body) || distance_to_part(m, body, at, only, true, &nearest) <= close)
        return;
    double least = distance_to_part(m, body, at, only, false, &nearest);
    if (least == DBL_MAX)
        least = distance_to_part(m, body, at, only, true, &nearest);
    if (least < DBL_MAX)
        kt_picture_add_solid(m, thin_rod(m, body, point, kt_pose_apply(kt_pose_invert(m->poses[body]), nearest)));
}

/* Among bodies that are fixed to the world, only the solids of the body itself count. */
static void attach_point(kt_picture_maker *m, int body, kt_vec3 point) {
    attach_to(m, body, point, m->picture->part[body] == 0 ? body : -1);
}

/* Whether a body has a solid yet. Any solid of its rigid part counts; for a part that is fixed to the world, only the
 * body's solids. */
static bool has_solid(const kt_picture_maker *m, int body) {
    const kt_picture *p = m->picture;
    int i = m->first[p->part[body]];
    while (i >= 0 && p->part[body] == 0 && p->solids[i].body != body)
        i = m->next[i];
    return i >= 0;
}

/* A body without any solid is a star of rods from its own joint, or, if it is fixed to the world, from its origin.
 * A point on a rod needs no further rod. */
static void begin_star(kt_picture_maker *m, int body, kt_vec3 point) {
    const kt_joint_type type = kt_picture_source(m, body)->joint.type;
    const bool is_base = m->picture->part[body] == 0;
    const bool has_place = is_base || (type != KT_JOINT_FREE && type != KT_JOINT_FIXED);
    const kt_vec3 at = kt_pose_apply(m->poses[body], point);
    const int only = is_base ? body : -1;
    kt_vec3 nearest = at;
    const double close = 1.5 * m->picture->radius;
    const bool is_star = distance_to_part(m, body, at, only, false, &nearest) == DBL_MAX;
    if (has_place && is_star && kt_vec3_norm(point) > close && !has_mesh_near(m, body) &&
        distance_to_part(m, body, at, only, true, &nearest) > close)
        kt_picture_add_solid(m, thin_rod(m, body, kt_vec3_make(0.0, 0.0, 0.0), point));
    else
        attach_point(m, body, point);
}

/* A body that is fixed to a body without any solid gets a rod, like a joint at its position. */
static void attach_fixed(kt_picture_maker *m, int body) {
    const kt_body *source = kt_picture_source(m, body);
    const int parent = source->parent != NULL ? kt_body_find(m->picture->model, source->parent) : 0;
    if (parent > 0 && m->picture->part[body] > 0 && source->joint.type == KT_JOINT_FIXED && !has_solid(m, body))
        begin_star(m, parent, source->joint.at);
}

/* Whether the body has solids, all of them implied. */
static bool is_implied(const kt_picture_maker *m, int body) {
    const kt_picture *p = m->picture;
    bool has_implied = false;
    for (int i = m->first[p->part[body]]; i >= 0; i = m->next[i])
        if (p->solids[i].body == body && p->solids[i].source != KT_SOURCE_IMPLIED)
            return false;
        else
            has_implied = has_implied || p->solids[i].body == body;
    return has_implied;
}

/* Joins a body with the body to which it is fixed, across bodies without solids. Rods lead from the body's solids to
 * the solids of the next such body. Two bodies with shapes from the scene are not joined. */
static void bridge_fixed(kt_picture_maker *m, int body) {
    int on = body;
    do
        on = kt_picture_source(m, on)->joint.type == KT_JOINT_FIXED ? kt_body_parent(m->model, on) : 0;
    while (on > 0 && !kt_picture_has_own(m, on));
    if (on <= 0 || !kt_picture_has_own(m, body) || !(is_implied(m, body) || is_implied(m, on)))
        return;
    const kt_vec3 origin = m->poses[body].position;
    attach_to(m, body, kt_vec3_make(0.0, 0.0, 0.0), body);
    attach_to(m, on, kt_pose_apply(kt_pose_invert(m->poses[on]), origin), on);
}

static void attach_frame(kt_picture_maker *m, const kt_body_frame *frame) {
    if (frame->body > 0)
        begin_star(m, frame->body, frame->pose.position);
}

/* Whether the position of a joint is fixed in the body that it carries. */
static bool is_pivot(kt_joint_type type) {
    return type == KT_JOINT_REVOLUTE || type == KT_JOINT_UNIVERSAL || type == KT_JOINT_SPHERICAL ||
           type == KT_JOINT_FIXED;
}

void kt_picture_imply_solids(kt_picture_maker *m) {
    const kt_picture *p = m->picture;
    for (int body = 1; body < p->body_count; body++)
        imply_mass(m, body);
    kt_picture_part_masses(m);
    for (int body = 1; body < p->body_count; body++) {
        if (is_pivot(kt_picture_source(m, body)->joint.type))
            attach_point(m, body, kt_vec3_make(0.0, 0.0, 0.0));
    }
    for (int i = 0; i < p->joint_count + p->coordinate_count; i++)
        if (p->joints[i].type != KT_JOINT_FREE && p->joints[i].type != KT_JOINT_PLANAR)
            attach_frame(m, &p->joints[i].frame);
    for (int body = 1; body < p->body_count; body++) {
        attach_fixed(m, body);
        bridge_fixed(m, body);
    }
    for (int i = 0; i < p->loop_count; i++)
        for (int k = 0; k < (p->loops[i].type == KT_LOOP_ROLLING ? 1 : 2); k++)
            attach_frame(m, &p->loops[i].ends[k]);
    for (int i = 0; i < p->effect_count; i++)
        for (int k = 0; k < p->effects[i].end_count; k++)
            if (kt_picture_shows_end(&p->effects[i], k))
                attach_frame(m, &p->effects[i].ends[k]);
}
