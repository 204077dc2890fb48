/* Contacts of robots with planes, as effects.
 *
 * A solid touches a plane in its lowest points. A sphere has one such point, and a capsule has one at each end. A box
 * has its corners, and a cylinder has the lowest point of each rim. The points of a mesh are those of contact_points.c.
 * Each point becomes a `contact` effect of a sphere, whose radius is zero at a corner. A rim becomes that of a disc.
 *
 * An ellipsoid with the half axes A = diag(a, b, c) has the farthest point A^2 n / |A n| in the direction n. Its
 * smallest radius of curvature is r = min^2 / max. A sphere of this radius that touches the ellipsoid from inside has
 * its centre at A^2 n / |A n| - r n. These spheres in KT_CONTACT_EXTREMES directions represent the ellipsoid. In these
 * directions, a plane touches the ellipsoid at the right height. Between these directions, the ellipsoid sinks by up to
 * 8 % of its longest half axis.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/robot_contact.h"

#include <math.h>

/* A contact of a sphere about the point `at` of the shape with the plane of the ground. */
static kt_effect *add_shape_contact(kt_draft *d, const kt_contact_shape *shape, const kt_ground *ground, kt_vec3 at,
                                    double radius) {
    kt_effect *effect = kt_draft_effect(d, shape->element, KT_EFFECT_CONTACT);
    if (effect == NULL)
        return NULL;
    const char *name = kt_namer_make(shape->names, shape->name);
    effect->name = *name != '\0' ? name : NULL;
    effect->between[0].body = shape->body;
    effect->between[0].at = kt_pose_apply(shape->pose, at);
    effect->between[1] = kt_end_at(ground->body, ground->pose);
    effect->radius = radius;
    effect->friction = shape->friction;
    effect->slip = shape->slip;
    effect->stiffness = shape->stiffness;
    effect->exponent = shape->exponent;
    effect->dissipation = shape->dissipation;
    effect->rolling = shape->rolling;
    effect->torsion = shape->torsion;
    if (shape->rolling > 0.0 || shape->torsion > 0.0)
        effect->turn = shape->turn;
    return effect;
}

static bool is_spherical(const double a[3]) {
    const double least = fmin(a[0], fmin(a[1], a[2])), most = fmax(a[0], fmax(a[1], a[2]));
    return most - least < 1e-9 * most;
}

static void add_ellipsoid(kt_draft *d, const kt_contact_shape *shape, const kt_ground *ground) {
    const double *a = shape->size, least = fmin(a[0], fmin(a[1], a[2])), most = fmax(a[0], fmax(a[1], a[2]));
    const double r = least * least / most;
    if (is_spherical(a)) {
        (void)add_shape_contact(d, shape, ground, kt_vec3_make(0.0, 0.0, 0.0), most);
        return;
    }
    for (int i = 0; i < KT_CONTACT_EXTREMES; i++) {
        const kt_vec3 n = kt_vec3_normalize(kt_contact_direction(i, kt_vec3_make(a[0], a[1], a[2])));
        const kt_vec3 stretched = kt_vec3_make(a[0] * n.x, a[1] * n.y, a[2] * n.z);
        const double length = kt_vec3_norm(stretched);
        const kt_vec3 far =
            kt_vec3_make(a[0] * stretched.x / length, a[1] * stretched.y / length, a[2] * stretched.z / length);
        (void)add_shape_contact(d, shape, ground, kt_vec3_sub(far, kt_vec3_scale(r, n)), r);
    }
}

static void add_rim(kt_draft *d, const kt_contact_shape *shape, const kt_ground *ground, double height) {
    kt_effect *effect = add_shape_contact(d, shape, ground, kt_vec3_make(0.0, 0.0, height), shape->size[0]);
    if (effect != NULL)
        effect->axle = shape->pose.rotation.z;
}

/* Adds the contacts of a solid with a plane; false if no contact can represent the solid. */
static bool add_contact_solid(kt_draft *d, const kt_contact_shape *shape, const kt_ground *ground) {
    const double *size = shape->size;
    switch (shape->solid) {
    case KT_SOLID_SPHERE:
        (void)add_shape_contact(d, shape, ground, kt_vec3_make(0.0, 0.0, 0.0), size[0]);
        return true;
    case KT_SOLID_CAPSULE:
        for (int i = -1; i < 2; i += 2)
            (void)add_shape_contact(d, shape, ground, kt_vec3_make(0.0, 0.0, i * size[1]), size[0]);
        return true;
    case KT_SOLID_CYLINDER:
        add_rim(d, shape, ground, -size[1]);
        add_rim(d, shape, ground, size[1]);
        return true;
    case KT_SOLID_BOX:
        for (int i = 0; i < 8; i++) {
            const kt_vec3 corner = kt_vec3_make((i & 1) != 0 ? size[0] : -size[0], (i & 2) != 0 ? size[1] : -size[1],
                                                (i & 4) != 0 ? size[2] : -size[2]);
            (void)add_shape_contact(d, shape, ground, corner, 0.0);
        }
        return true;
    case KT_SOLID_ELLIPSOID:
        add_ellipsoid(d, shape, ground);
        return true;
    case KT_SOLID_NONE:
        for (int i = 0; i < shape->point_count; i++)
            (void)add_shape_contact(d, shape, ground, shape->points[i], 0.0);
        return shape->point_count > 0;
    default:
        return false;
    }
}

void kt_contact_make(kt_draft *d, kt_contact_shape *shape, const kt_ground *ground, const kt_contact_law *law,
                     const kt_contact_cone *cone, double gravity, kt_contact_tally *touched) {
    if (shape->mass > 0.0)
        kt_contact_law_apply(law, cone, gravity, shape);
    if (shape->solid == KT_SOLID_ELLIPSOID && !is_spherical(shape->size))
        kt_left_count(&touched->rounded, shape->element);
    if (shape->turns_freely && shape->solid == KT_SOLID_NONE && kt_contact_is_round(shape->points, shape->point_count))
        kt_left_count(&touched->rough, shape->element);
    const bool is_made = shape->stiffness > 0.0 && add_contact_solid(d, shape, ground);
    kt_left_count(is_made ? &touched->made : &touched->lost, shape->element);
}
