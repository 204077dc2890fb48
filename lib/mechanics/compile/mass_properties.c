/* Mass properties of a body: the rules for mass, centre of mass, inertia and shape, and the mass properties of shapes.
 * The solids are uniform; their inertias are about their own centre.
 *
 *   point      I = 0
 *   sphere     I = 2/5 m r^2 1
 *   box        I = R diag(m/12 (b^2 + c^2), m/12 (c^2 + a^2), m/12 (a^2 + b^2)) R'
 *   cylinder   I = T 1 + (J - T) u u',  J = m r^2 / 2,  T = m (3 r^2 + l^2) / 12,  u the unit axis
 *   rod        the cylinder from one end to the other; slender: r = 0
 *   polygon    I = R m [[yy + e, -xy, 0], [-xy, xx + e, 0], [0, 0, xx + yy]] R'
 *              e = d^2 / 12, d the thickness, and the means of polygon.c
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/require.h"
#include "compile/compile.h"
#include "model/describe.h"

#include <math.h>
#include <stddef.h>

/* ---- descriptors ------------------------------------------------------------------------------------------------- */

/* A sphere has a rotation, although the rotation has no effect. An invalid rotation is still a fault, since a scene
 * file could not contain it. */
#define PLACE_KEY(help)                                                                                                \
    { "shape.at", KT_KEY_VECTOR, offsetof(kt_shape, at), "m", help, .needed = false }
#define LENGTH_KEY(name, member, help)                                                                                 \
    { name, KT_KEY_NUMBER, offsetof(kt_shape, member), "m", help, .range = KT_RANGE_POSITIVE, .needed = true }
#define ROTATION_KEY                                                                                                   \
    {                                                                                                                  \
        "shape.rotation", KT_KEY_ROTATION, offsetof(kt_shape, rotation), "",                                           \
            "of the axes of the solid against those of the body", .needed = false                                      \
    }
static const kt_key point_keys[] = {
    PLACE_KEY("where it is, body frame"),
};
static const kt_key rod_keys[] = {
    {"shape.from", KT_KEY_VECTOR, offsetof(kt_shape, from), "m", "one end, body frame", .needed = false},
    {"shape.to", KT_KEY_VECTOR, offsetof(kt_shape, to), "m", "the other end", .needed = true},
    {"shape.radius", KT_KEY_NUMBER, offsetof(kt_shape, radius), "m", "r; 0: slender", .range = KT_RANGE_NOT_NEGATIVE},
};
static const kt_key box_keys[] = {
    {"shape.size", KT_KEY_VECTOR, offsetof(kt_shape, size), "m", "a, b, c, the lengths of its edges along x, y, z",
     .range = KT_RANGE_POSITIVE, .needed = true},
    PLACE_KEY("the centre, body frame"),
    ROTATION_KEY,
};
static const kt_key sphere_keys[] = {
    LENGTH_KEY("shape.radius", radius, "r"),
    PLACE_KEY("the centre, body frame"),
    ROTATION_KEY,
};
static const kt_key cylinder_keys[] = {
    LENGTH_KEY("shape.radius", radius, "r"),
    LENGTH_KEY("shape.length", length, "l"),
    {"shape.axis", KT_KEY_AXIS, offsetof(kt_shape, axis), "", "in the axes of the solid", .needed = false},
    PLACE_KEY("the centre, body frame"),
    ROTATION_KEY,
};

static const kt_key polygon_keys[] = {
    {"shape.points", KT_KEY_CORNERS, offsetof(kt_shape, points), "m",
     "[[x, y], [x, y], ...], its corners in order, three or more", .needed = true},
    LENGTH_KEY("shape.thickness", length, "d, along z, half on either side of the corners' plane"),
    PLACE_KEY("the origin of the corners, body frame"),
    ROTATION_KEY,
};

/* A scene with a body of the given shape, and joints for the examples. */
#define EXAMPLE_BODY(name, joint, shape)                                                                               \
    "bodies:\n  - name: " name "\n    joint: " joint "\n    mass: 2\n    shape: " shape "\n"
#define SWINGS "{type: revolute, axis: y, position: 30 deg}"
#define TUMBLES "{type: free, velocity: {angular: [1, 2, 3]}}"

#define KEYS(list) .keys = list, .key_count = (int)(sizeof list / sizeof *list)

/* KT_SHAPE_NONE has no name in scene files, and no descriptor. */
static const kt_descriptor descriptors[KT_SHAPE_TYPE_COUNT] = {
    [KT_SHAPE_POINT] = {.name = "point",
                        .help = "a point mass",
                        .formula = "I = 0",
                        .example = EXAMPLE_BODY("bob", SWINGS, "{type: point, at: [0, 0, -1]}"),
                        KEYS(point_keys)},
    [KT_SHAPE_ROD] = {.name = "rod",
                      .help = "a rod between two points",
                      .formula = "I as for the cylinder, with l from one end to the other",
                      .example = EXAMPLE_BODY("rod", SWINGS, "{type: rod, to: [0, 0, -1]}"),
                      KEYS(rod_keys)},
    [KT_SHAPE_BOX] = {.name = "box",
                      .help = "a box with edges along its axes",
                      .formula = "I = m/12 diag(b^2 + c^2, c^2 + a^2, a^2 + b^2)",
                      .example = EXAMPLE_BODY("solid", TUMBLES, "{type: box, size: [0.1, 0.2, 0.3]}"),
                      KEYS(box_keys)},
    [KT_SHAPE_SPHERE] = {.name = "sphere",
                         .help = "a ball",
                         .formula = "I = 2/5 m r^2",
                         .example = EXAMPLE_BODY("solid", TUMBLES, "{type: sphere, radius: 0.2}"),
                         KEYS(sphere_keys)},
    [KT_SHAPE_CYLINDER] = {.name = "cylinder",
                           .help = "a cylinder about its axis",
                           .formula = "I = m r^2 / 2 about the axis,  m (3 r^2 + l^2) / 12 across it",
                           .example =
                               EXAMPLE_BODY("solid", TUMBLES, "{type: cylinder, radius: 0.1, length: 0.5, axis: x}"),
                           KEYS(cylinder_keys)},
    [KT_SHAPE_POLYGON] = {.name = "polygon",
                          .help = "a plate of any outline",
                          .formula = "I = m [[<y^2> + d^2/12, -<x y>, 0], [-<x y>, <x^2> + d^2/12, 0], [0, 0, <x^2> + "
                                     "<y^2>]]\n<> are means over the area, from its centroid, which is the com",
                          .example = EXAMPLE_BODY(
                              "bracket", SWINGS,
                              "{type: polygon, points: [[0, 0], [1, 0], [1, 0.2], [0.2, 0.2], [0.2, 0.8], [0, "
                              "0.8]], thickness: 0.05}"),
                          KEYS(polygon_keys)},
};

const kt_descriptor *kt_shape_descriptor(kt_shape_type type) {
    return type > KT_SHAPE_NONE && type < KT_SHAPE_TYPE_COUNT ? &descriptors[type] : NULL;
}

/* ---- rules ------------------------------------------------------------------------------------------------------- */

static void check_polygon(kt_checker *checker, const kt_shape *shape) {
    int first, second;
    if (shape->points == NULL || shape->point_count < 3) {
        kt_checker_fault(checker, "shape.points", -1, "a polygon has three corners or more");
        return;
    }
    for (int i = 0; i < shape->point_count; i++)
        if (!kt_checker_values(checker, "shape.points", i, "", shape->points + 2 * (size_t)i, 2))
            return;
    if (kt_polygon_crosses(shape->points, shape->point_count, &first, &second))
        kt_checker_fault(checker, "shape.points", second,
                         "the edges that begin at corners %d and %d of the polygon meet; give its corners in the order "
                         "in which they follow each other around it",
                         first, second);
}

static void check_shape(kt_checker *checker, const kt_shape *shape) {
    const kt_descriptor *descriptor = kt_shape_descriptor(shape->type);
    const kt_shape standard = kt_shape_default();
    if (shape->type == KT_SHAPE_NONE)
        return;
    if (descriptor == NULL) {
        kt_checker_fault(checker, "shape.type", -1,
                         "shape.type is %d, and there is no shape of that number; take one of kt_shape_type",
                         (int)shape->type);
        return;
    }
    kt_checker_keys(checker, descriptor, shape, &standard);
    const double length = kt_vec3_norm_wide(kt_vec3_sub(shape->to, shape->from)); /* NaN if an end has a fault */
    if (shape->type == KT_SHAPE_ROD && length == 0.0)
        kt_checker_fault(checker, "shape.to", -1, "shape.to is where shape.from is; a rod needs a length");
    if (shape->type == KT_SHAPE_POLYGON)
        check_polygon(checker, shape);
}

/* A body without mass may have an inertia: a rotor whose mass is counted elsewhere. */
static void check_mass(kt_checker *checker, double mass) {
    if (kt_checker_not_negative(checker, "mass", "", mass) && mass != 0.0 && mass < KT_MASS_LEAST)
        kt_checker_fault(checker, "mass", -1, "mass is %g, too small to compute with; give 0, or %g or more", mass,
                         KT_MASS_LEAST);
}

/* Reports that the principal moments violate the triangle inequality. */
static void check_triangle(kt_checker *checker, kt_vec3 m, double excess) {
    const bool little = excess <= KT_INERTIA_EXCESS_MAX;
    if (little && checker->description->inertia_check == KT_INERTIA_WARN)
        return;
    kt_checker_fault(checker, "inertia", -1,
                     "inertia has the principal moments %g, %g, %g; no body has one above the sum of the two "
                     "others: check units and order (Ixx, Iyy, Izz, Ixy, Ixz, Iyz), and that it is about the com%s",
                     m.x, m.y, m.z,
                     little ? "; rounded data that breaks this by up to 1 % is accepted with 'inertia_check: warn'"
                            : "");
}

static void check_inertia_matrix(kt_checker *checker, kt_sym3 inertia) {
    const double entries[6] = {inertia.xx, inertia.yy, inertia.zz, inertia.xy, inertia.xz, inertia.yz};
    double most = 0.0;
    for (int i = 0; i < 6; i++) {
        most = fmax(most, fabs(entries[i]));
        if (!isfinite(entries[i])) {
            kt_checker_value(checker, "inertia", -1, "", i, entries[i]);
            return;
        }
    }
    kt_vec3 m;
    const kt_inertia_fault fault = kt_inertia_check(inertia, &m);
    if (most > KT_INERTIA_MOST)
        kt_checker_fault(checker, "inertia", -1,
                         "inertia has the entry %g, and the equations would overflow; magnitudes end at %g", most,
                         KT_INERTIA_MOST);
    else if (most != 0.0 && most < KT_INERTIA_LEAST)
        kt_checker_fault(checker, "inertia", -1,
                         "inertia is %g at most, too small to compute with; give 0, or %g or more", most,
                         KT_INERTIA_LEAST);
    else if (checker->description->inertia_check == KT_INERTIA_ACCEPT)
        return;
    else if (fault == KT_INERTIA_NEGATIVE)
        kt_checker_fault(checker, "inertia", -1,
                         "inertia has the principal moments %g, %g, %g; none can be negative: check signs and order "
                         "(Ixx, Iyy, Izz, Ixy, Ixz, Iyz)",
                         m.x, m.y, m.z);
    else if (fault == KT_INERTIA_TRIANGLE)
        check_triangle(checker, m, kt_inertia_excess(inertia));
}

void kt_checker_mass(kt_checker *checker, const kt_body *body) {
    check_mass(checker, body->mass);
    if (!body->com_of_shape)
        kt_checker_vector(checker, "com", -1, "", body->com);
    if (!body->inertia_of_shape)
        check_inertia_matrix(checker, body->inertia);
    check_shape(checker, &body->shape);
    if (body->shape.type == KT_SHAPE_NONE && (body->com_of_shape || body->inertia_of_shape))
        kt_checker_fault(checker, "shape", -1,
                         "the %s is to follow from the shape, and the body has no shape; give a shape or the %s",
                         body->com_of_shape ? "com" : "inertia", body->com_of_shape ? "com" : "inertia");
}

/* ---- mass properties --------------------------------------------------------------------------------------------- */

/* The inertia of a solid of revolution: `axial` about the unit vector u, `transverse` about every axis normal to u. */
static kt_sym3 about_axis(kt_vec3 u, double axial, double transverse) {
    const double d = axial - transverse;
    return kt_sym3_make(transverse + d * u.x * u.x, transverse + d * u.y * u.y, transverse + d * u.z * u.z,
                        d * u.x * u.y, d * u.x * u.z, d * u.y * u.z);
}

static kt_sym3 cylinder_inertia(double mass, kt_vec3 u, double radius, double length) {
    const double axial = 0.5 * mass * radius * radius;
    return about_axis(u, axial, 0.5 * axial + mass * length * length / 12.0);
}

static kt_sym3 box_inertia(double mass, kt_vec3 size, kt_mat3 r) {
    const double k = mass / 12.0;
    const double aa = size.x * size.x, bb = size.y * size.y, cc = size.z * size.z;
    return kt_sym3_rotate(r, kt_sym3_make(k * (bb + cc), k * (cc + aa), k * (aa + bb), 0.0, 0.0, 0.0));
}

static kt_sym3 polygon_inertia(const kt_shape *shape, double mass, kt_mat3 r) {
    const kt_polygon p = kt_polygon_measure(shape->points, shape->point_count);
    const double e = shape->length * shape->length / 12.0;
    return kt_sym3_rotate(
        r, kt_sym3_make(mass * (p.yy + e), mass * (p.xx + e), mass * (p.xx + p.yy), -mass * p.xy, 0.0, 0.0));
}

/* The inertia about the centre of a shape that has passed the rules. */
static kt_sym3 solid_inertia(const kt_shape *shape, double mass, kt_mat3 r) {
    const kt_vec3 along = kt_vec3_sub(shape->to, shape->from);
    switch (shape->type) {
    case KT_SHAPE_ROD:
        return cylinder_inertia(mass, kt_vec3_normalize(along), shape->radius, kt_vec3_norm_wide(along));
    case KT_SHAPE_BOX:
        return box_inertia(mass, shape->size, r);
    case KT_SHAPE_SPHERE: {
        const double i = 0.4 * mass * shape->radius * shape->radius;
        return kt_sym3_make(i, i, i, 0.0, 0.0, 0.0);
    }
    case KT_SHAPE_CYLINDER:
        return cylinder_inertia(mass, kt_mat3_apply(r, kt_vec3_normalize(shape->axis)), shape->radius, shape->length);
    case KT_SHAPE_POLYGON:
        return polygon_inertia(shape, mass, r);
        break;
    case KT_SHAPE_POINT:
    case KT_SHAPE_NONE:
    case KT_SHAPE_TYPE_COUNT:
        break;
    }
    return kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
}

static kt_vec3 solid_centre(const kt_shape *shape, kt_mat3 r) {
    if (shape->type == KT_SHAPE_POLYGON) {
        const kt_polygon p = kt_polygon_measure(shape->points, shape->point_count);
        return kt_vec3_add(shape->at, kt_mat3_apply(r, kt_vec3_make(p.x, p.y, 0.0)));
    }
    if (shape->type == KT_SHAPE_ROD)
        return kt_vec3_add(shape->from, kt_vec3_scale(0.5, kt_vec3_sub(shape->to, shape->from)));
    return shape->at;
}

double kt_shape_volume(const kt_shape *shape) {
    if (!shape)
        return (double)NAN;
    const double disc = 3.14159265358979323846 * shape->radius * shape->radius;
    switch (shape->type) {
    case KT_SHAPE_ROD:
        return disc * kt_vec3_norm_wide(kt_vec3_sub(shape->to, shape->from));
    case KT_SHAPE_BOX:
        return shape->size.x * shape->size.y * shape->size.z;
    case KT_SHAPE_SPHERE:
        return 4.0 / 3.0 * disc * shape->radius;
    case KT_SHAPE_CYLINDER:
        return disc * shape->length;
    case KT_SHAPE_POLYGON:
        return kt_polygon_measure(shape->points, shape->point_count).area * shape->length;
    case KT_SHAPE_POINT:
    case KT_SHAPE_NONE:
    case KT_SHAPE_TYPE_COUNT:
        break;
    }
    return 0.0;
}

kt_status kt_body_inertia(const kt_body *body, kt_vec3 *com, kt_sym3 *inertia, kt_error *error) {
    if (KT_IS_MISSING(error, body, com, inertia))
        return KT_ERROR_ARGUMENT;
    kt_vec3 centre = body->com;
    kt_sym3 about_centre = body->inertia;
    if (body->com_of_shape || body->inertia_of_shape) {
        kt_description around = kt_description_default();
        around.bodies = body;
        around.body_count = 1;
        kt_checker checker = kt_checker_make(&around, NULL, NULL);
        checker.item = KT_ITEM_BODY;
        kt_checker_mass(&checker, body);
        if (kt_checker_result(&checker, error) != KT_OK)
            return checker.first.code;
        kt_mat3 r = kt_mat3_identity();
        const bool is_turned = body->shape.type == KT_SHAPE_BOX || body->shape.type == KT_SHAPE_CYLINDER ||
                               (body->shape.type == KT_SHAPE_POLYGON);
        if (is_turned && kt_rotation_evaluate(&body->shape.rotation, &r, error) != KT_OK)
            return KT_ERROR_MODEL; /* not reached: the shape has passed the rules */
        if (body->com_of_shape)
            centre = solid_centre(&body->shape, r);
        if (body->inertia_of_shape)
            about_centre = solid_inertia(&body->shape, body->mass, r);
    }
    *com = centre;
    *inertia = about_centre;
    return KT_OK;
}
