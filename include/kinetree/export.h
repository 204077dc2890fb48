/* Experimental. Export of mechanisms in the formats of other programs. Part of libkinetree-scene.
 *
 *     status = kt_robot_write(&description, KT_ROBOT_MJCF, stdout, NULL, NULL, &error);
 *
 * The function kt_robot_read (import.h) reads the exported file back. The mass matrix is then the same except for
 * rounding.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_EXPORT_H
#define KINETREE_EXPORT_H

#include "kinetree/scene.h"

#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Robot formats that can be written. */
typedef enum kt_robot_format {
    KT_ROBOT_URDF = 0, /* Unified Robot Description Format, of ROS */
    KT_ROBOT_MJCF,     /* the XML of MuJoCo */
} kt_robot_format;

/* Called once for each kind of element that the format does not have, with the number of such elements. */
typedef void kt_robot_lost(void *user, const char *what, int count);

/* Writes a mechanism to a stream, which stays open. Numbers have as many digits as their bits need.
 *   - A body becomes a link or body with the same name and frame. Its joint keeps its name. A joint of two or three
 *     coordinates (universal, cylindrical; in MJCF planar, too) becomes as many joints. In MJCF these joints are on the
 *     same body. In URDF, massless links connect these joints.
 *   - Both formats contain mass, com and inertia, rods, boxes, spheres and cylinders, armature, limits, joint_damper
 *     and joint_friction. MJCF also contains gravity, markers, joint_spring, motors and servos. In MJCF the keyframe
 *     `start` is the initial state with closed loops. Springs with a length, and expressions that are a spring and a
 *     damper between two ends or along a path, become spatial tendons.
 *   - A coupling of two joints becomes a mimic, or an equality. In MJCF a coupling of several joints becomes a tendon
 *     with an equality. Spherical, revolute and weld loops become equalities of sites.
 *   - Massless bodies have special forms in MJCF. A massless body that carries one other body passes its joints to that
 *     body. A massless slider that a coupling moves becomes a fixed tendon. A screw becomes a hinge and a slide. A free
 *     joint on another body becomes three slides and a ball.
 *   - If MuJoCo rejects moments of inertia, a fixed body gives its mass to the body that carries it. Moments of other
 *     bodies are raised by the smallest sufficient amount. Masses below 1e-15 kg
 *     are raised likewise. In URDF, masses of fixed bodies with moments of inertia are raised, too, because MuJoCo
 * would omit such bodies. The callback `lost` (may be NULL) is called for all omissions and changes. If the description
 * cannot be written, nothing is written.
 * Errors: KT_ERROR_MODEL if the description is wrong; in URDF also for a screw or a spherical joint. KT_ERROR_FILE,
 * KT_ERROR_MEMORY.
 * Cost: O(size), and an assembly if there are loops. */
KT_API KT_CHECKED kt_status kt_robot_write(const kt_description *description, kt_robot_format format, FILE *stream,
                                           kt_robot_lost *lost, void *user, kt_error *error);

/* Writes a scene with its meshes, like kt_robot_write. The robot refers to the files of the meshes. `folder` is the
 * future folder of the robot's file; paths are relative to it. If `folder` is NULL, paths are absolute. Missing files,
 * and files that MuJoCo cannot read, count as lost. */
KT_API KT_CHECKED kt_status kt_robot_write_scene(const kt_scene *scene, kt_robot_format format, const char *folder,
                                                 FILE *stream, kt_robot_lost *lost, void *user, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
