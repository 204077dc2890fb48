/* Mechanisms written in the formats of other programs. Part of libkinetree-scene.
 *
 *     status = kt_robot_write(&description, KT_ROBOT_MJCF, stdout, NULL, NULL, &error);
 *
 * kt_robot_read (import.h) reads what is written: the mass matrix is then the same but for rounding.
 */
#ifndef KINETREE_EXPORT_H
#define KINETREE_EXPORT_H

#include "kinetree/description.h"

#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Formats of robots that can be written. */
typedef enum kt_robot_format {
    KT_ROBOT_URDF = 0, /* Unified Robot Description Format, of ROS */
    KT_ROBOT_MJCF,     /* the XML of MuJoCo */
} kt_robot_format;

/* Called once for each kind of thing that a format does not have, with the number of them. */
typedef void kt_robot_lost(void *user, const char *what, int count);

/* Writes a mechanism to a stream, which stays open; numbers have as many digits as their bits need.
 *   - A body becomes a link or body of its name, with the same frame; its joint keeps its name. A joint of two or three
 *     coordinates (universal, cylindrical; in MJCF planar, too) becomes as many joints: in MJCF on the same body, in
 *     URDF with links without mass between them.
 *   - Mass, com and inertia, rods, boxes, spheres and cylinders, armature, limits, joint_damper and joint_friction; in
 *     MJCF gravity, markers, joint_spring, and the initial state as keyframe `start`.
 *   - coupling of two joints: a mimic, or an equality; in MJCF spherical and weld between bodies, too.
 * `lost` (may be NULL) is called for all else. Errors: KT_ERROR_MODEL where the description is wrong, or has a joint
 * that the format has not and others cannot stand for: screw; in URDF spherical; in MJCF free on a body other than the
 * world. KT_ERROR_FILE, KT_ERROR_MEMORY. Nothing is written if the description cannot be. O(size). */
KT_API KT_CHECKED kt_status kt_robot_write(const kt_description *description, kt_robot_format format, FILE *stream,
                                           kt_robot_lost *lost, void *user, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
