/* Mechanisms written in the formats of other programs. Part of libkinetree-scene.
 *
 *     status = kt_robot_write(&description, KT_ROBOT_MJCF, stdout, NULL, NULL, &error);
 *
 * kt_robot_read (import.h) reads what is written: the mass matrix is then the same but for rounding.
 */
#ifndef KINETREE_EXPORT_H
#define KINETREE_EXPORT_H

#include "kinetree/scene.h"

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
 *     URDF with links between them.
 *   - Mass, com and inertia, rods, boxes, spheres and cylinders, armature, limits, joint_damper and joint_friction; in
 *     MJCF gravity, markers, joint_spring, motors, servos, and the initial state as keyframe `start`: that at which
 *     loops are closed.
 *   - coupling of two joints: a mimic, or an equality. In MJCF couplings of several joints are tendons that an equality
 *     holds; spherical, revolute and weld loops are equalities of sites.
 *   - In MJCF a body without mass that carries one other gives its joints to that, a slider without mass that a coupling
 *     moves becomes a fixed tendon, a screw a hinge and a slide, a free joint on another body three slides and a ball.
 *   - Moments of inertia that MuJoCo rejects are raised by the smallest amount, and so are masses below 1e-15 kg.
 * `lost` (may be NULL) is called for all that is left out or changed. Errors: KT_ERROR_MODEL where the description is
 * wrong; in URDF also for a screw or a spherical joint. KT_ERROR_FILE, KT_ERROR_MEMORY. Nothing is written if the
 * description cannot be. Cost: O(size), and where there are loops that of an assembly. */
KT_API KT_CHECKED kt_status kt_robot_write(const kt_description *description, kt_robot_format format, FILE *stream,
                                           kt_robot_lost *lost, void *user, kt_error *error);

/* The same for a scene, with its meshes: the robot refers to their files. folder: where the robot's file will be, from
 * which paths start; NULL: they are absolute. Files that are missing, or that MuJoCo does not read, count as lost. */
KT_API KT_CHECKED kt_status kt_robot_write_scene(const kt_scene *scene, kt_robot_format format, const char *folder,
                                                 FILE *stream, kt_robot_lost *lost, void *user, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
