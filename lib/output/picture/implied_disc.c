/* Bodies without a shape whose masses are at one point of one axis: shafts and wheels of a drive of which only inertias
 * are known. Balls at that point would be one ball. They are discs side by side along the axis instead, as on a shaft:
 * the body of the largest inertia has the largest disc, and the smallest disc is nearest to the viewer of the plane.
 *
 * In a plane the viewer looks along the axis, so that balls at several points of the axis hide one another, too.
 *
 * The blocks of bodies that slide along one line from one point would be one block. They are nested instead, as the
 * tubes of a telescope: each next one is longer and thinner. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/maker.h"

#include <math.h>
#include <stdlib.h>

enum { COAXIAL_MOST = 200 /* balls: more are too small to be told apart */ };

/* A ball on the axis of its body. */
typedef struct coaxial_sphere {
    int solid;
    kt_vec3 centre, axis; /* in the world, towards the viewer of the plane */
    double place;         /* of the centre along the axis; a multiple of half a ball, so that rounding does not count */
    double moment;        /* of inertia about the axis, kg m^2 */
    bool is_grouped;
} coaxial_sphere;

/* Returns whether a solid is the ball of a body that turns about an axis through the ball. */
static bool sphere_of_axis(const kt_picture_maker *m, int i, coaxial_sphere *sphere) {
    const kt_solid *solid = &m->picture->solids[i];
    const kt_body *source = kt_picture_source(m, solid->body);
    const kt_joint_type type = source->joint.type;
    kt_vec3 com;
    kt_sym3 inertia;
    if (solid->type != KT_SOLID_SPHERE || solid->source != KT_SOURCE_IMPLIED ||
        (type != KT_JOINT_REVOLUTE && type != KT_JOINT_CYLINDRICAL && type != KT_JOINT_SCREW) ||
        kt_body_inertia(source, &com, &inertia, NULL) != KT_OK)
        return false;
    const kt_vec3 axis = kt_vec3_normalize(source->joint.axis);
    if (!(kt_vec3_norm(kt_vec3_cross(axis, solid->pose.position)) < 0.5 * solid->half.x))
        return false;
    const kt_pose pose = m->poses[solid->body];
    const kt_vec3 along = kt_mat3_apply(pose.rotation, axis), centre = kt_pose_apply(pose, solid->pose.position);
    const double sign = kt_vec3_dot(along, m->picture->normal) < 0.0 ? -1.0 : 1.0, step = 0.5 * solid->half.x;
    *sphere = (coaxial_sphere){.solid = i,
                               .centre = centre,
                               .axis = kt_vec3_scale(sign, along),
                               .place = step * rint(sign * kt_vec3_dot(along, centre) / step),
                               .moment = kt_vec3_dot(axis, kt_sym3_apply(inertia, axis))};
    return true;
}

/* Towards the viewer, then by falling moment, and then in the order of the bodies. */
static int compare_spheres(const void *a, const void *b) {
    const coaxial_sphere *one = *(coaxial_sphere *const *)a, *other = *(coaxial_sphere *const *)b;
    if (one->place != other->place)
        return one->place < other->place ? -1 : 1;
    return one->moment != other->moment ? (one->moment < other->moment ? 1 : -1) : one->solid - other->solid;
}

/* Makes the k-th of n balls a disc, with its centre at a place along the axis. */
static void make_disc(kt_picture_maker *m, const coaxial_sphere *sphere, double place, int k, int n) {
    kt_solid *solid = &m->picture->solids[sphere->solid];
    const double radius = solid->half.x, along = kt_vec3_dot(sphere->centre, sphere->axis);
    const kt_pose to_body = kt_pose_invert(m->poses[solid->body]);
    solid->type = KT_SOLID_CYLINDER;
    solid->half.x = solid->half.y = radius * (1.0 + fmin(0.6, 4.0 / n) * (n - 1 - k));
    solid->half.z = 0.25 * radius;
    solid->pose.position =
        kt_pose_apply(to_body, kt_vec3_add(sphere->centre, kt_vec3_scale(place - along, sphere->axis)));
    solid->pose.rotation = kt_triad_from_axis(kt_mat3_apply(to_body.rotation, sphere->axis), 2);
}

/* Makes the balls of a group discs, at least `apart` from one another. Discs of one point have it in their middle. */
static void lay_group(kt_picture_maker *m, coaxial_sphere **group, int n, double apart) {
    qsort(group, (size_t)n, sizeof *group, compare_spheres);
    double place = group[0]->place - (group[0]->place == group[n - 1]->place ? 0.5 * apart * (n - 1) : 0.0);
    for (int k = 0; k < n; k++) {
        place = k > 0 ? fmax(place + apart, group[k]->place) : place;
        make_disc(m, group[k], place, k, n);
    }
}

/* Returns whether two balls are at one point of one axis; in a plane, at two points of one axis. */
static bool is_coaxial(const kt_picture *p, const coaxial_sphere *a, const coaxial_sphere *b, double radius) {
    kt_vec3 apart = kt_vec3_sub(b->centre, a->centre);
    if (p->is_planar && kt_vec3_norm(kt_vec3_cross(a->axis, p->normal)) < 1e-6)
        apart = kt_vec3_cross(apart, a->axis);
    return kt_vec3_norm(apart) < 0.5 * radius && kt_vec3_norm(kt_vec3_cross(a->axis, b->axis)) < 1e-6;
}

/* Returns whether two solids are blocks of sliding bodies at one point of one line. */
static bool are_nested(const kt_picture_maker *m, const kt_solid *a, const kt_solid *b) {
    if (a->source != KT_SOURCE_IMPLIED || b->source != KT_SOURCE_IMPLIED || a->type != KT_SOLID_BOX ||
        b->type != KT_SOLID_BOX)
        return false;
    const kt_pose one = kt_pose_compose(m->poses[a->body], a->pose),
                  other = kt_pose_compose(m->poses[b->body], b->pose);
    const kt_vec3 z = kt_vec3_make(0.0, 0.0, 1.0);
    const kt_vec3 across = kt_vec3_cross(kt_mat3_apply(one.rotation, z), kt_mat3_apply(other.rotation, z));
    return kt_vec3_norm(kt_vec3_sub(one.position, other.position)) < 0.5 * a->half.x && kt_vec3_norm(across) < 1e-6;
}

/* Makes the k-th of n blocks longer and thinner than those before it. */
static void nest_block(kt_solid *block, int k, int n) {
    const double thin = 1.0 - 0.7 * k / n, along = 1.0 + fmin(0.35, 4.0 / n) * k;
    block->half = kt_vec3_make(thin * block->half.x, thin * block->half.y, along * block->half.z);
}

/* Each group of nested blocks is treated once, with its first block. */
static void nest_blocks(kt_picture_maker *m) {
    kt_solid *all = m->picture->solids, *group[COAXIAL_MOST];
    const int count = m->picture->solid_count;
    for (int i = 0; i < count; i++) {
        bool is_first = true;
        int n = 0;
        for (int k = 0; k < i && is_first; k++)
            is_first = !are_nested(m, &all[k], &all[i]);
        for (int k = i; k < count && is_first && n < COAXIAL_MOST; k++)
            if (are_nested(m, &all[i], &all[k]))
                group[n++] = &all[k];
        for (int k = 1; k < n; k++)
            nest_block(group[k], k, n);
    }
}

void kt_picture_part_masses(kt_picture_maker *m) {
    nest_blocks(m);
    coaxial_sphere spheres[COAXIAL_MOST + 1], *group[COAXIAL_MOST];
    int count = 0;
    for (int i = 0; i < m->picture->solid_count && count <= COAXIAL_MOST; i++)
        count += sphere_of_axis(m, i, &spheres[count]);
    for (int i = 0; i < count && count <= COAXIAL_MOST; i++) {
        const coaxial_sphere *first = &spheres[i];
        if (first->is_grouped)
            continue;
        const double radius = m->picture->solids[first->solid].half.x;
        int n = 0;
        for (int k = i; k < count; k++)
            if (!spheres[k].is_grouped && is_coaxial(m->picture, first, &spheres[k], radius)) {
                group[n++] = &spheres[k];
                spheres[k].is_grouped = true;
            }
        if (n > 1)
            lay_group(m, group, n, 0.7 * radius);
    }
}
