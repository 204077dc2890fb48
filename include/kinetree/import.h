/* Experimental. Import of mechanisms that other programs describe, into a scene. Part of libkinetree-scene.
 *
 *     kt_scene scene;
 *     status = kt_robot_read("arm.urdf", NULL, &scene, NULL, NULL, &error);
 *     for (int i = 0; status == KT_OK && i < scene.note_count; i++)
 *         printf("%s: %s\n", scene.notes[i].where, scene.notes[i].what);
 *
 * The scene can be compiled directly, or written as a scene file (kt_scene_write). The user can then add loops, effects
 * and a `simulate` section to the file.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_IMPORT_H
#define KINETREE_IMPORT_H

#include "kinetree/scene.h"

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The link inertias that are accepted although no body can have them. Such an inertia has a negative principal moment,
 * or breaks the triangle inequality of the principal moments. Links that fixed joints connect count as one rigid part,
 * whose total inertia is tested. */
typedef enum kt_robot_inertia {
    KT_ROBOT_INERTIA_WARN = 0, /* rigid parts that break the inequality by up to 10 %, with a note */
    KT_ROBOT_INERTIA_STRICT,   /* none: every rigid part must have the inertia of a body */
    KT_ROBOT_INERTIA_ACCEPT,   /* all, with a note. If such a part moves, accelerations may be wrong or not exist */
} kt_robot_inertia;

/* Options of the import of a robot. A struct of zeros and NULL both select the defaults. */
typedef struct kt_robot_options {
    size_t size;              /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    bool floating;            /* the root link moves freely; default: it is fixed to the world */
    double stop_stiffness;    /* N m/rad, or N/m: limits of position become elastic stops; 0: no stops */
    double stop_damping;      /* N m s/rad, or N s/m: damping of these stops, >= 0 */
    kt_robot_inertia inertia; /* the inertias that are accepted */
    double density; /* kg/m^3, of links that have shapes but no <inertial>, and in MJCF of geoms without mass and
                     * density. 0: such links have no mass. In MJCF the density is then 1000 kg/m^3. In SDF the mass
                     * is then 1 kg */
    const char *const *masses; /* masses of links, kg, each "LINK=MASS" */
    int mass_count;            /* length of masses */
    const char *keyframe;      /* MJCF: name of the keyframe of the initial state; NULL: the reference positions */
    const char *search;        /* folders, separated by ':'. Meshes of package:// and model:// are searched first
                                * there, then in the folder of `path` and its parents. Models that SDF includes are
                                * searched first in the folder of `path`. NULL: none */
    const char *allow;         /* folders, separated by ':', from which files may be included, besides the folder of
                                * `path` and the folders of `search`; NULL: none */
    bool contacts;   /* contacts of fixed planes with spheres, ends of capsules, corners of boxes, rims of cylinders,
                      * ellipsoids and meshes */
    bool has_ground; /* adds a floor at the height `ground`; needs `contacts` */
    double ground;   /* m, along z */
} kt_robot_options;

/* Returns the default options: fixed to the world, no stops, inertias as KT_ROBOT_INERTIA_WARN, no names. */
static inline kt_robot_options kt_robot_options_default(void) {
    kt_robot_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    return options;
}

/* Reads a robot from a file (`path`), or from `size` bytes of text. For text, `path` is only its name in messages
 * (NULL: "scene"), and the text cannot include other files. The formats are the Unified Robot Description Format (the
 * XML of ROS' package `urdf`, <robot>), MJCF (of MuJoCo, <mujoco>), and SDF (of Gazebo, <sdf>). The versions of SDF are
 * 1.0 to 1.12.
 *
 * URDF:
 *   - A link becomes a body with the same name, on the joint whose child it is. Characters that are not allowed in
 *     names of scenes become '_'. A root link named `world` without inertia, declared or not, is the world. Any other
 *     root is fixed to the world, or free with `floating`. If the root is `world`, `floating` frees its fixed links.
 *   - Joints of the types revolute, continuous, prismatic, fixed, floating and planar keep origin and axis. A joint
 *     starts at zero, or at the limit nearest to zero if zero is outside its limits. A mimic joint starts at the
 *     position that follows from its leading joint.
 *   - The elements damping and friction become the effects joint_damper and joint_friction. A mimic joint becomes a
 *     loop of type coupling.
 *   - Boxes, cylinders and spheres of visuals, or else of collisions, become the link's shapes for pictures. Meshes
 *     become scene->meshes if their files exist. Collisions far larger than the robot are omitted.
 *   - The joint's armature is the rotor inertia of the transmission times the square of the reduction.
 *   - Gravity is 9.81 m/s^2 along -z. The scene's inertia_check is `warn`, since inertias of robots are often rounded.
 *     If options->inertia accepts an inertia that no body can have, inertia_check becomes `accept`. So do moving links
 * without any
 *     mass.
 *   - Limits (position, speed, effort) become kt_joint_limits. These data do not change the motion.
 *   - With options->contacts, collisions touch the ground of the options. Their friction is Gazebo's `mu1` if given,
 * else 1.
 *   - Omitted: contacts between links, extensions of simulators.
 * MJCF:
 *   - A body becomes a body with the same name. A single joint at the body's origin becomes that body's joint. If there
 *     are several joints, or one elsewhere, each joint carries a massless body with the joint's name. The body itself
 *     follows after these. Positions have MuJoCo's meaning. A body without joints is fixed. If its parent is the world,
 *     it is free with `floating`.
 *   - Masses and inertias come from <inertial>, or else from the geoms, including files of meshes. The settings of
 *     <compiler> are then applied.
 *   - The elements stiffness, damping, frictionloss, gravcomp, fixed tendons and actuators become effects. Equalities
 *     become loops, which are exact, not soft. Named sites become markers.
 *   - With options->contacts, moving geoms touch planes that do not move. Other contacts are omitted.
 *   - The activations of actuators (filters and integrators) become auxiliary states.
 *   - Spatial tendons become forces between two sites, or along paths around spheres and cylinders.
 *   - A medium (density, viscosity) becomes drag along the axes of the inertias.
 *   - Muscles become numbers of forces along joints and tendons. Polynomials of equalities become formulas. Elements
 *     that stand for many bodies (replicate, composite, flexcomp) are errors. mj_saveLastXML of MuJoCo writes expanded
 *     models.
 *   - Further omissions are actuators of a user's kind, plugins, flexible bodies, built-in meshes, sensors and cameras.
 *   - <include> reads files within the folders of `path`, `search` and `allow`. Meshes may be elsewhere.
 * SDF:
 *   - The first <world> is read with all its models; without a <world>, the first <model> is read. A link becomes a
 *     body with the same name and frame. A link of a model in another model or in a world is named MODEL__LINK.
 *   - A joint carries its child if this gives a tree, and otherwise its parent. The remaining joints close loops. Links
 *     without a chain of joints to the world move freely. Links of static models do not move. Joints start at their
 *     `initial_position`, else at zero.
 *   - A joint with two axes (universal, revolute2, piston) becomes two joints. The massless body between these has the
 *     joint's name. If the axis of a joint does not meet its link's origin, a massless body with the joint's name
 *     carries the link.
 *   - The elements damping, friction and spring_stiffness become effects. Gearboxes and mimics become couplings.
 *   - Mass and inertia come from <inertial>. The default mass is 1 kg. The default inertia is 1 kg m^2. With auto both
 *     come from the collisions. Inertias that no body can have are treated as for URDF.
 *   - Gravity is the gravity of the world. Without a world it is 9.8 m/s^2 along -z.
 *   - <include> reads files within the folders of `path`, `search` and `allow`. Missing files are omitted. If nothing
 *     is left then, the world is rejected.
 *   - With options->contacts, collisions touch planes that do not move. The smaller friction of both applies.
 *   - Omitted: contacts between links, sensors, plugins, states of worlds.
 * The notes scene->notes report all omissions and changes: each kind once, with the number and the position of the
 * first. All faults are reported in one call, as in kt_scene_read. The callback report may be NULL.
 * Ownership: on success *scene is filled, and the caller releases it with kt_scene_free. On failure *scene is
 * untouched.
 * Errors: those of kt_scene_read.
 * Cost: time and memory are proportional to the size of the files. */
KT_API KT_CHECKED kt_status kt_robot_read(const char *path, const kt_robot_options *options, kt_scene *scene,
                                          kt_scene_report *report, void *user, kt_error *error);
KT_API KT_CHECKED kt_status kt_robot_parse(const char *path, const char *text, size_t size,
                                           const kt_robot_options *options, kt_scene *scene, kt_scene_report *report,
                                           void *user, kt_error *error);

/* ---- a file, ready to run ---------------------------------------------------------------------------------------- */

/* A mechanism from a file. Calls return KT_OK, which is 0, or an error status with the details in *error. One `if` can
 * therefore check several calls.
 *
 *     kt_mechanism arm;
 *     kt_parameter payload;
 *     if (kt_mechanism_load("arm.urdf", NULL, NULL, &arm, &error) ||
 *         kt_parameter_find(arm.model, "hand.mass", &payload, &error) ||
 *         kt_simulation_set_parameter(arm.simulation, arm.model, &payload, (double[]){2.5}, &error) ||
 *         kt_simulation_advance(arm.simulation, 2.0, &error))
 *         fprintf(stderr, "%s: %s\n", error.where, error.message);
 */
typedef struct kt_mechanism {
    kt_scene scene;            /* the contents of the file, with notes */
    kt_model *model;           /* a copy of `compiled`: its parameters may be set */
    kt_data *data;             /* data for calls of the program */
    kt_simulation *simulation; /* simulation of the model at the start; includes the scene's events, but not their
                                * calls */
    kt_scene_watch *watch;     /* the events of the scene in the simulation */
    kt_model *compiled;        /* the model as compiled */
    void *memory;              /* memory of the copy, for kt_mechanism_free */
} kt_mechanism;

/* Reads a scene (*.yaml, *.yml) or a robot (all other files), compiles it, and makes data and a simulation. Robots are
 * read with kt_robot_read and its options, which may be NULL. If run is NULL, a scene uses its own run, and a robot
 * uses the default. With each run, contacts are resolved as the scene states (`contact: steps`). On failure *mechanism
 * is untouched.
 * Errors: those of kt_scene_read or kt_robot_read, kt_model_compile, kt_simulation_create and kt_scene_watch_create.
 * Messages include the position in the file if known. */
KT_API KT_CHECKED kt_status kt_mechanism_load(const char *path, const kt_robot_options *options, const kt_run *run,
                                              kt_mechanism *mechanism, kt_error *error);

/* Releases all memory of a mechanism, and clears the struct. NULL and a cleared struct are allowed. */
KT_API void kt_mechanism_free(kt_mechanism *mechanism);

#ifdef __cplusplus
}
#endif
#endif
