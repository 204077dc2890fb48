/* Every rule of a shape, each broken once. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdio.h>

#include "check.h"
#include "mechanism.h"

static const double nan_value = (double)NAN;

/* Shapes without a fault. */
static kt_shape shape_of(kt_shape_type type) {
    static const double corners[] = {0.0, 0.0, 1.0, 0.0, 0.3, 0.2, 0.0, 1.0};
    kt_shape shape = kt_shape_default();
    shape.type = type;
    shape.points = corners;
    shape.point_count = 4;
    shape.to = kt_vec3_make(1.0, 0.0, 0.0);
    shape.size = kt_vec3_make(1.0, 2.0, 3.0);
    shape.length = 2.0;
    shape.radius = 0.5;
    return shape;
}

#define REJECTS(of_type, change, field, message)                                                                       \
    MECHANISM_REJECTS(kt_shape *s = &m.bodies[BASE].shape;                                                             \
                      *s = shape_of(of_type), change, KT_ITEM_BODY, BASE, -1, field, "body 'base'", message)
#define PASSES(what, of_type, change)                                                                                  \
    MECHANISM_PASSES(kt_shape *s = &m.bodies[BASE].shape; *s = shape_of(of_type), change, what)

KT_TEST(sound_shapes_pass) {
    for (int type = 0; type < KT_SHAPE_TYPE_COUNT; type++)
        PASSES(kt_shape_type_name((kt_shape_type)type), (kt_shape_type)type, s->radius += 1.0);
    PASSES("slender rod", KT_SHAPE_ROD, s->radius = 0.0);
    PASSES("what a point does not read", KT_SHAPE_POINT,
           (s->radius = nan_value, s->size.x = -1.0, s->from.x = nan_value, s->axis.x = nan_value));
    PASSES("what a rod does not read", KT_SHAPE_ROD, (s->at.x = nan_value, s->length = 0.0));
    PASSES("what no shape does not read", KT_SHAPE_NONE, (s->at.x = nan_value, s->rotation.value[0] = nan_value));
}

KT_TEST(numbers_of_shapes_are_checked) {
    REJECTS(KT_SHAPE_TYPE_COUNT, s->radius = 1.0, "shape.type",
            "shape.type is 7, and there is no shape of that number; take one of kt_shape_type");
    REJECTS(KT_SHAPE_ROD, s->from.x = nan_value, "shape.from", "shape.from[0] is nan; give a finite number");
    REJECTS(KT_SHAPE_ROD, s->to.y = nan_value, "shape.to", "shape.to[1] is nan; give a finite number");
    REJECTS(KT_SHAPE_ROD, s->from = s->to, "shape.to", "shape.to is where shape.from is; a rod needs a length");
    REJECTS(KT_SHAPE_ROD, s->radius = -0.1, "shape.radius", "shape.radius is -0.1; it cannot be negative");
    static const kt_shape_type placed[] = {KT_SHAPE_POINT, KT_SHAPE_BOX, KT_SHAPE_SPHERE, KT_SHAPE_CYLINDER};
    for (size_t i = 0; i < sizeof placed / sizeof *placed; i++)
        REJECTS(placed[i], s->at.z = nan_value, "shape.at", "shape.at[2] is nan; give a finite number");
    REJECTS(KT_SHAPE_BOX, s->size.z = nan_value, "shape.size", "shape.size[2] is nan; give a finite number");
    REJECTS(KT_SHAPE_BOX, s->size.x = 0.0, "shape.size", "shape.size[0] is 0; it must be greater than 0");
    REJECTS(KT_SHAPE_BOX, s->size.y = -2.0, "shape.size", "shape.size[1] is -2; it must be greater than 0");
    REJECTS(KT_SHAPE_SPHERE, s->radius = 0.0, "shape.radius", "shape.radius is 0; it must be greater than 0");
    REJECTS(KT_SHAPE_CYLINDER, s->radius = 0.0, "shape.radius", "shape.radius is 0; it must be greater than 0");
    REJECTS(KT_SHAPE_CYLINDER, s->length = -1.0, "shape.length", "shape.length is -1; it must be greater than 0");
    REJECTS(KT_SHAPE_CYLINDER, s->length = 1e60, "shape.length",
            "shape.length is 1e+60, and the equations would overflow; magnitudes end at 1e+50");
    REJECTS(KT_SHAPE_CYLINDER, s->axis = kt_vec3_make(0.0, 0.0, 0.0), "shape.axis",
            "shape.axis is zero; give it a direction, such as [0, 0, 1]");
}

KT_TEST(corners_of_polygons_are_checked) {
    static const double bow[] = {0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0}, flat[] = {0.0, 0.0, 1.0, 0.0, 0.5, 0.0};
    static const double twice[] = {0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0};
    static const double infinite[] = {0.0, 0.0, 1.0, HUGE_VAL, 1.0, 1.0};
    REJECTS(KT_SHAPE_POLYGON, s->points = NULL, "shape.points", "a polygon has three corners or more");
    REJECTS(KT_SHAPE_POLYGON, s->point_count = 2, "shape.points", "a polygon has three corners or more");
    REJECTS(KT_SHAPE_POLYGON, s->length = 0.0, "shape.thickness", "shape.thickness is 0; it must be greater than 0");
#define ORDER " of the polygon meet; give its corners in the order in which they follow each other around it"
    static const struct {
        const double *points;
        int count;
        const char *message;
    } rows[] = {
        {bow, 4, "the edges that begin at corners 0 and 2" ORDER},
        {flat, 3, "the edges that begin at corners 0 and 1" ORDER},
        {twice, 5, "the edges that begin at corners 0 and 2" ORDER},
        {infinite, 3, "shape.points[1] is inf; give a finite number"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        kt_body body = kt_body_default();
        kt_error error;
        kt_vec3 com;
        kt_sym3 inertia;
        body.name = "plate";
        body.mass = 1.0;
        body.com_of_shape = true;
        body.shape = shape_of(KT_SHAPE_POLYGON);
        body.shape.points = rows[i].points;
        body.shape.point_count = rows[i].count;
        kt_check_equal_int("rejected", kt_body_inertia(&body, &com, &inertia, &error), KT_ERROR_MODEL);
        kt_check_text("message", error.message, rows[i].message);
    }
}

KT_TEST(rotations_of_shapes_are_checked) {
    const kt_rotation wrong = kt_rotation_quaternion(2.0, 0.0, 0.0, 0.0);
    kt_mat3 matrix;
    kt_error error;
    kt_check_true("no rotation", kt_rotation_evaluate(&wrong, &matrix, &error) != KT_OK);
    char message[KT_MESSAGE_SIZE + 20];
    snprintf(message, sizeof message, "shape.rotation: %s", error.message);
    REJECTS(KT_SHAPE_BOX, s->rotation = wrong, "shape.rotation", message);
    REJECTS(KT_SHAPE_CYLINDER, s->rotation = wrong, "shape.rotation", message);
    REJECTS(KT_SHAPE_SPHERE, s->rotation = wrong, "shape.rotation", message);
    PASSES("a point has no rotation", KT_SHAPE_POINT, s->rotation = wrong);
}

KT_TEST(mass_properties_of_no_shape_are_rejected) {
    REJECTS(KT_SHAPE_NONE, m.bodies[BASE].com_of_shape = true, "shape",
            "the com is to follow from the shape, and the body has no shape; give a shape or the com");
    REJECTS(KT_SHAPE_NONE, m.bodies[BASE].inertia_of_shape = true, "shape",
            "the inertia is to follow from the shape, and the body has no shape; give a shape or the inertia");
}
