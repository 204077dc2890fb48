/* Masses and inertias that do not suit the shapes of their bodies.
 *
 *     density     rho = m / V, with V the volume of all shapes. The lightest solids are aerogels, the heaviest is
 *                 osmium. A length in millimetres makes a density wrong by nine powers of ten.
 *     gyration    If all mass is within R of the centre of mass, then the integral of r^2 dm, half the trace of the
 *                 inertia I, is at most m R^2, and so is each moment on its diagonal. R is the distance of the
 *                 farthest point of the shapes.
 *
 * A body with a mesh, or with a mass that is a function of time, is not judged, nor is a volume of zero. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/angles.h"

#include "kinetree/body.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define LEAST_DENSITY 1e-1 /* kg/m^3 */
#define MOST_DENSITY 3e4

/* The first body that is doubtful, its number, and the count of such bodies. */
typedef struct doubt {
    const kt_body *body;
    double value, bound;
    int count;
} doubt;

static void add_doubt(doubt *d, const kt_body *body, double value, double bound) {
    if (d->count++ > 0)
        return;
    d->body = body;
    d->value = value;
    d->bound = bound;
}

static const kt_shape *shape_at(const kt_body *body, int k) { return k == 0 ? &body->shape : &body->shapes[k - 1]; }

/* Returns the largest distance of a point of the shape from a point, m. Those of a polygon's corners are bounds. */
static double reach_of(const kt_shape *shape, kt_vec3 from) {
    const double to_centre = kt_vec3_norm(kt_vec3_sub(shape->at, from)), half = 0.5 * shape->length;
    double corner = 0.0;
    switch (shape->type) {
    case KT_SHAPE_ROD:
        return fmax(kt_vec3_norm(kt_vec3_sub(shape->from, from)), kt_vec3_norm(kt_vec3_sub(shape->to, from))) +
               shape->radius;
    case KT_SHAPE_BOX:
        return to_centre + 0.5 * kt_vec3_norm(shape->size);
    case KT_SHAPE_SPHERE:
        return to_centre + shape->radius;
    case KT_SHAPE_CYLINDER:
        return to_centre + hypot(shape->radius, half);
    case KT_SHAPE_POLYGON:
        for (int i = 0; i < shape->point_count; i++)
            corner = fmax(corner, hypot(shape->points[2 * i], shape->points[2 * i + 1]));
        return to_centre + hypot(corner, half);
    default:
        return 0.0;
    }
}

static bool has_mesh(const kt_scene *scene, const kt_body *body) {
    for (int i = 0; i < scene->mesh_count; i++)
        if (strcmp(scene->meshes[i].body, body->name) == 0)
            return true;
    return false;
}

static void judge_body(const kt_body *body, double margin, doubt *density, doubt *gyration) {
    double volume = 0.0, reach = 0.0;
    kt_vec3 com;
    kt_sym3 inertia;
    if (kt_body_inertia(body, &com, &inertia, NULL) != KT_OK)
        return;
    for (int k = 0; k <= body->shape_count; k++) {
        volume += kt_shape_volume(shape_at(body, k));
        reach = fmax(reach, reach_of(shape_at(body, k), com));
    }
    const double rho = body->mass / volume;
    if (volume > 0.0 && (rho * margin < LEAST_DENSITY || rho > margin * MOST_DENSITY))
        add_doubt(density, body, rho, volume);
    const double moment = fmax(fmax(inertia.xx, inertia.yy), inertia.zz);
    const double square = fmax(moment, 0.5 * (inertia.xx + inertia.yy + inertia.zz)) / body->mass;
    if (reach > 0.0 && square > (1.0 + 1e-6) * margin * margin * reach * reach)
        add_doubt(gyration, body, sqrt(square), reach);
}

int kt_plausible_warn(kt_warnings *warnings, const kt_scene *scene, double margin) {
    const kt_description *d = &scene->description;
    doubt density = {.count = 0}, gyration = {.count = 0};
    char more[40] = "";
    for (int i = 0; i < d->body_count; i++)
        if (d->bodies[i].mass > 0.0 && d->bodies[i].shape.type != KT_SHAPE_NONE && d->bodies[i].variable_mass == NULL &&
            !has_mesh(scene, &d->bodies[i]))
            judge_body(&d->bodies[i], margin, &density, &gyration);
    const kt_warning dense = kt_warning_of("density", density.value, "kg/m^3",
                                           "Compare the mass with the sizes of the shape, which are in metres");
    if (density.count > 1)
        (void)snprintf(more, sizeof more, ", and likewise %d more", density.count - 1);
    if (density.count > 0)
        kt_warn(warnings, &dense,
                "body '%s' has a mass of %.3g kg in %.3g m^3: %.3g kg/m^3, beyond 0.1 to 3e4 kg/m^3%s",
                density.body->name, density.body->mass, density.bound, density.value, more);
    const kt_warning wide =
        kt_warning_of("gyration", gyration.value, "m", "Compare the inertia with the mass and the sizes of the shape");
    more[0] = '\0';
    if (gyration.count > 1)
        (void)snprintf(more, sizeof more, ", and likewise %d more", gyration.count - 1);
    if (gyration.count > 0)
        kt_warn(
            warnings, &wide,
            "the inertia of body '%s' has a radius of gyration of %.3g m, and its shape ends %.3g m from the centre "
            "of mass%s",
            gyration.body->name, gyration.value, gyration.bound, more);
    return (density.count > 0) + (gyration.count > 0);
}
