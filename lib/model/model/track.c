/* The curves on which a loop can keep a point (loop/point_on_curve.c), as data. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/describe.h"

#define BEAD(curve, at)                                                                                                \
    "bodies:\n"                                                                                                        \
    "  - name: bead\n"                                                                                                 \
    "    joint: {type: free, position: {position: " at "}}\n"                                                          \
    "    mass: 1\n"                                                                                                    \
    "    shape: {type: sphere, radius: 0.03}\n"                                                                        \
    "loops:\n"                                                                                                         \
    "  - {name: wire, type: curve, between: [world, bead], curve: " curve "}\n"

static const kt_key round_keys[] = {
    {"curve.radius", KT_KEY_NUMBER, offsetof(kt_track, radius), "m", "R", .range = KT_RANGE_POSITIVE, .needed = true},
    {"curve.pitch", KT_KEY_NUMBER, offsetof(kt_track, pitch), "m/rad", "h, advance along the axis",
     .range = KT_RANGE_ANY, .needed = true},
};
static const kt_key spline_keys[] = {
    {"curve.spline", KT_KEY_POINTS, offsetof(kt_track, points), "m", "[[x, y, z], [x, y, z], ...]", .needed = true},
};
static const kt_descriptor tracks[KT_TRACK_TYPE_COUNT] = {
    [KT_TRACK_NONE] = {.name = NULL},
    [KT_TRACK_LINE] = {.name = "line",
                       .help = "along the axis",
                       .formula = "c = (0, 0, sigma)",
                       .example = BEAD("{line: {}}, axis: [1, 0, -1]", "[0.2, 0, -0.2]")},
    [KT_TRACK_CIRCLE] = {.name = "circle",
                         .help = "about the axis",
                         .formula = "c = (R cos(a), R sin(a), 0),  sigma = R a",
                         .example = BEAD("{circle: {radius: 0.5}}, axis: x", "[0, 0.3, 0.4]"),
                         .keys = round_keys,
                         .key_count = 1},
    [KT_TRACK_HELIX] = {.name = "helix",
                        .help = "about the axis",
                        .formula = "c = (R cos(a), R sin(a), h a),  sigma = sqrt(R^2 + h^2) a",
                        .example = BEAD("{helix: {radius: 0.5, pitch: 0.1}}", "[0.5, 0, 0]"),
                        .keys = round_keys,
                        .key_count = 2},
    [KT_TRACK_SPLINE] = {.name = "spline",
                         .help = "the natural cubic spline through points, straight beyond them",
                         .formula = "c(s) through the points, c and c' and c'' continuous;  sigma: from the "
                                    "first point",
                         .example =
                             BEAD("{spline: [[0, 0, 1], [0.5, 0, 0.4], [1, 0.2, 0.6], [1.5, 0, 0]]}", "[0, 0, 1]"),
                         .keys = spline_keys,
                         .key_count = 1},
};

const kt_descriptor *kt_track_descriptor(kt_track_type type) {
    return type > KT_TRACK_NONE && type < KT_TRACK_TYPE_COUNT ? &tracks[type] : NULL;
}
