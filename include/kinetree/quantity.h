/* The quantities of effects: numbers that a record has of each effect, with names and units. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_QUANTITY_H
#define KINETREE_QUANTITY_H

#include "kinetree/status.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The quantities of an effect that can be recorded, a number each. X(id, name, name in a sliding joint, unit, unit in a
 * sliding joint, meaning). For effects with two ends, the wrench acts on the second end; for a contact, on the sphere.
 * Axes and points are the world's. */
#define KT_QUANTITY_LIST(X)                                                                                            \
    X(KT_QUANTITY_JOINT_FORCE, "torque", "force", "N m", "N", "in the joint, on its child")                            \
    X(KT_QUANTITY_TENSION, "force", "force", "N", "N", "along the line of the ends; positive: it pulls them together") \
    X(KT_QUANTITY_NORMAL, "normal", "normal", "N", "N", "normal force")                                                \
    X(KT_QUANTITY_FRICTION, "friction", "friction", "N", "N", "friction force, its magnitude")                         \
    X(KT_QUANTITY_FORCE_X, "fx", "fx", "N", "N", "force along x")                                                      \
    X(KT_QUANTITY_FORCE_Y, "fy", "fy", "N", "N", "force along y")                                                      \
    X(KT_QUANTITY_FORCE_Z, "fz", "fz", "N", "N", "force along z")                                                      \
    X(KT_QUANTITY_MOMENT_X, "mx", "mx", "N m", "N m", "moment about x, about the end's point")                         \
    X(KT_QUANTITY_MOMENT_Y, "my", "my", "N m", "N m", "moment about y, likewise")                                      \
    X(KT_QUANTITY_MOMENT_Z, "mz", "mz", "N m", "N m", "moment about z, likewise")                                      \
    X(KT_QUANTITY_POWER, "power", "power", "W", "W", "delivered to the mechanism; negative: taken from it")            \
    X(KT_QUANTITY_COORDINATE, "position", "position", "rad", "m", "of the joint")                                      \
    X(KT_QUANTITY_COORDINATE_RATE, "rate", "rate", "rad/s", "m/s", "of the joint")                                     \
    X(KT_QUANTITY_LENGTH, "length", "length", "m", "m", "distance of the ends")                                        \
    X(KT_QUANTITY_LENGTH_RATE, "rate", "rate", "m/s", "m/s", "at which that distance grows")                           \
    X(KT_QUANTITY_EXCESS, "depth", "depth", "rad", "m", "beyond the stop or below the plane; 0: no contact")           \
    X(KT_QUANTITY_SLIP, "slip", "slip", "m/s", "m/s", "speed at which the surfaces slide")                             \
    X(KT_QUANTITY_POINT_X, "x", "x", "m", "m", "of the sphere's lowest point")                                         \
    X(KT_QUANTITY_POINT_Y, "y", "y", "m", "m", "likewise")                                                             \
    X(KT_QUANTITY_POINT_Z, "z", "z", "m", "m", "likewise")

/* The quantities. */
typedef enum kt_effect_quantity {
#define KT_QUANTITY_ENUM(id, name, sliding_name, unit, sliding_unit, help) id,
    KT_QUANTITY_LIST(KT_QUANTITY_ENUM)
#undef KT_QUANTITY_ENUM
        KT_QUANTITY_COUNT /* how many */
} kt_effect_quantity;

/* Returns the texts of KT_QUANTITY_LIST: the name and the unit of a quantity, and its meaning. The argument `sliding`
 * selects the texts for an effect in a sliding joint. Static storage; "" for an invalid value. */
KT_API const char *kt_quantity_name(kt_effect_quantity quantity, bool sliding);
KT_API const char *kt_quantity_unit(kt_effect_quantity quantity, bool sliding);
KT_API const char *kt_quantity_help(kt_effect_quantity quantity);

#ifdef __cplusplus
}
#endif
#endif
