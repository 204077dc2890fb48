/* The surfaces on which a loop can keep a point (loop/point_on_surface.c), as data. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/describe.h"

#define BEAD(surface, at)                                                                                              \
    "bodies:\n"                                                                                                        \
    "  - {name: bead, joint: {type: free, position: {position: " at                                                    \
    "}}, mass: 1, shape: {type: sphere, radius: 0.03}}\n"                                                              \
    "loops:\n"                                                                                                         \
    "  - {name: on, type: surface, between: [world, bead], surface: " surface "}\n"

static const kt_key radius_keys[] = {
    {"surface.radius", KT_KEY_NUMBER, offsetof(kt_surface, radius), "m", "R", .range = KT_RANGE_POSITIVE,
     .needed = true},
    {"surface.tube", KT_KEY_NUMBER, offsetof(kt_surface, tube), "m", "r, the radius of the tube",
     .range = KT_RANGE_POSITIVE, .needed = true},
};
static const kt_descriptor surfaces[KT_SURFACE_TYPE_COUNT] = {
    [KT_SURFACE_NONE] = {.name = NULL},
    [KT_SURFACE_PLANE] = {.name = "plane",
                          .help = "normal to the axis",
                          .formula = "z = 0",
                          .example = BEAD("{plane: {}}, axis: x", "[0, 0.3, 0]")},
    [KT_SURFACE_CYLINDER] = {.name = "cylinder",
                             .help = "about the axis, without ends",
                             .formula = "sqrt(x^2 + y^2) = R",
                             .example = BEAD("{cylinder: {radius: 0.5}}", "[0.3, 0.4, 0]"),
                             .keys = radius_keys,
                             .key_count = 1},
    [KT_SURFACE_SPHERE] = {.name = "sphere",
                           .help = "about the point of the first end",
                           .formula = "sqrt(x^2 + y^2 + z^2) = R",
                           .example = BEAD("{sphere: {radius: 0.5}}", "[0.3, 0, 0.4]"),
                           .keys = radius_keys,
                           .key_count = 1},
    [KT_SURFACE_TORUS] = {.name = "torus",
                          .help = "a tube along a circle about the axis",
                          .formula = "sqrt((sqrt(x^2 + y^2) - R)^2 + z^2) = r",
                          .example = BEAD("{torus: {radius: 0.5, tube: 0.1}}", "[0.6, 0, 0]"),
                          .keys = radius_keys,
                          .key_count = 2},
};

const kt_descriptor *kt_surface_descriptor(kt_surface_type type) {
    return type > KT_SURFACE_NONE && type < KT_SURFACE_TYPE_COUNT ? &surfaces[type] : NULL;
}
