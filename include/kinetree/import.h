/* Mechanisms that other programs have described, read into a scene. Part of libkinetree-scene.
 *
 *     kt_scene scene;
 *     status = kt_robot_read("arm.urdf", NULL, &scene, NULL, NULL, &error);
 *     for (int i = 0; status == KT_OK && i < scene.note_count; i++)
 *         printf("%s: %s\n", scene.notes[i].where, scene.notes[i].what);
 *
 * The scene can be compiled as it is, or written as a scene file (kt_scene_write), to which loops, effects and a
 * `simulate` section are then added.
 */
#ifndef KINETREE_IMPORT_H
#define KINETREE_IMPORT_H

#include "kinetree/scene.h"

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Which inertias of links are taken over that break the triangle inequality of principal moments, or have a negative
 * one. Links that fixed joints connect are judged together: their inertia as one rigid part. */
typedef enum kt_robot_inertia {
    KT_ROBOT_INERTIA_WARN = 0, /* those of rigid parts that break it by up to 10 %: they are told */
    KT_ROBOT_INERTIA_STRICT,   /* none: rigid parts have inertias of bodies */
    KT_ROBOT_INERTIA_ACCEPT, /* all: they are told. Where such a part moves, accelerations may be wrong or not exist */
} kt_robot_inertia;

/* How a robot is taken over. A struct of zeros, as NULL, stands for the defaults. */
typedef struct kt_robot_options {
    size_t size;              /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    bool floating;            /* the root link moves freely; default: it is fixed to the world */
    double stop_stiffness;    /* N m/rad, or N/m: limits of position become elastic stops; 0: they are left out */
    double stop_damping;      /* N m s/rad, or N s/m: damping of these stops, >= 0 */
    kt_robot_inertia inertia; /* which inertias are accepted */
    double
        density; /* kg/m^3 of links without <inertial> that have shapes, and in MJCF of geoms that say neither mass nor
                       density; 0: they have no mass, in MJCF 1000 kg/m^3, in SDF 1 kg */
    const char *const *masses; /* masses of links, kg, each "LINK=MASS" */
    int mass_count;            /* length of masses */
    const char *keyframe;      /* MJCF: the name of the keyframe that is the start; NULL: the reference positions */
    const char *search;        /* folders apart by ':', in which meshes of package:// and model:// are looked for before
                                  the folder of `path` and those around it, and models that SDF includes after that
                                  folder; NULL: none */
    const char *allow;         /* folders apart by ':', from which files may be included, as from the folder of `path`
                                  and from those of `search`; NULL: none */
    bool contacts;   /* MJCF: geoms touch planes: spheres, ends of capsules, corners of boxes, rims of cylinders */
    bool has_ground; /* there is a floor at the height `ground`, which needs `contacts` */
    double ground;   /* m, along z */
} kt_robot_options;

/* Fixed to the world, no stops, inertias as KT_ROBOT_INERTIA_WARN has them, no names. */
static inline kt_robot_options kt_robot_options_default(void) {
    kt_robot_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    return options;
}

/* Reads a robot from a file (`path`), or from `size` bytes of text (`path` is then only its name in messages; NULL:
 * "scene"; it cannot include other files): in the Unified Robot Description Format (the XML of ROS' package `urdf`,
 * <robot>), in MJCF (that of MuJoCo, <mujoco>), or in SDF 1.0 to 1.12 (that of Gazebo, <sdf>).
 * URDF:
 *   - A link becomes a body of its name, on the joint that has it as child; characters that names of scenes cannot have
 *     become '_'. A root link named `world` without inertia, declared or not, is the world; any other root is fixed to
 *     it, or `floating`. On a root `world`, `floating` frees the links that are fixed to it.
 *   - revolute, continuous, prismatic, fixed, floating and planar joints are taken with origin and axis. A joint starts
 *     at zero, or at the limit nearest to zero where zero is outside its limits; a mimic joint where the joint that it
 *     follows puts it.
 *   - damping and friction become the effects joint_damper and joint_friction, a mimic joint a loop of type coupling.
 *   - Boxes, cylinders and spheres of visuals, else of collisions, are the link's shapes, for pictures; meshes are
 *     scene->meshes if their files are there. Collisions far larger than the robot are left out.
 *   - The rotor inertia of a transmission, times the square of its reduction, becomes the joint's armature.
 *   - Gravity is 9.81 m/s^2 along -z. inertia_check is `warn`, since inertias of robots are often rounded; `accept`
 *     where a link has an inertia that no body has, but options->inertia accepts it, or where nothing has a mass.
 *   - Limits of position, speed and effort are kt_joint_limits, data that change no motion.
 *   - Left out: contacts, extensions of simulators.
 * MJCF:
 *   - A body becomes a body of its name, its only joint at its origin that body's joint. Of several joints, or one
 *     elsewhere, each is that of a body without mass, which has the joint's name, and the body follows on them.
 *     Positions are MuJoCo's. A body without joints is fixed, or `floating` if it is the world's.
 *   - Masses and inertias are those of <inertial>, else of the geoms, files of meshes among them; then come the
 *     settings of <compiler>.
 *   - stiffness, damping, frictionloss, gravcomp, fixed tendons and actuators become effects, equalities loops (which
 *     are exact, not soft), named sites markers.
 *   - Left out: contacts, spatial tendons, muscles and other actuators with activations, plugins, flexible bodies,
 *     sensors, cameras, polynomials of equalities beyond the linear term.
 *   - <include> reads files within the folders of `path`, `search` and `allow`; meshes may lie elsewhere.
 * SDF:
 *   - The first <world> is read, with all its models, or else the first <model>. A link becomes a body of its name, with
 *     the same frame; that of a model within another, or in a world, is MODEL__LINK.
 *   - Joints carry their children as far as that gives a tree, else their parents; the others close loops. What no joint
 *     connects with the world moves freely; links of static models do not move. All joints start at zero.
 *   - Joints of two axes (universal, revolute2, piston) are two joints with a body without mass between them, which has
 *     the joint's name; so has one that carries a joint which is not at its link's origin.
 *   - damping, friction and spring_stiffness become effects, gearboxes and mimics couplings.
 *   - Mass and inertia are those of <inertial>, where they are not said 1 kg and 1 kg m^2, or, with auto, those of the
 *     collisions. Inertias that no body has are judged as those of URDF.
 *   - Gravity is the world's; without one 9.8 m/s^2 along -z.
 *   - <include> reads files within the folders of `path`, `search` and `allow`; what is not there is left out. If
 *     nothing is left then, the world is rejected.
 *   - Left out: contacts, sensors, plugins, states of worlds.
 * scene->notes tells what was left out or changed, each kind once, with the number and the place of the first. Faults
 * are reported as kt_scene_read does, all in one call. report may be NULL. On success *scene is filled, to be released
 * with kt_scene_free; on failure it is untouched. Errors: those of kt_scene_read. Time and memory grow in proportion to
 * the size of the files, and of what replicates make of them. */
KT_API KT_CHECKED kt_status kt_robot_read(const char *path, const kt_robot_options *options, kt_scene *scene,
                                          kt_scene_report *report, void *user, kt_error *error);
KT_API KT_CHECKED kt_status kt_robot_parse(const char *path, const char *text, size_t size,
                                           const kt_robot_options *options, kt_scene *scene, kt_scene_report *report,
                                           void *user, kt_error *error);

/* ---- a file, ready to run ---------------------------------------------------------------------------------------- */

/* A mechanism from a file. Calls return KT_OK, which is 0, or what went wrong, which *error then tells: several in a row
 * are checked by one `if`.
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
    kt_scene scene;            /* what was read, with its notes */
    kt_model *model;           /* a copy of `compiled`: its parameters may be set */
    kt_data *data;             /* for calls of the caller's */
    kt_simulation *simulation; /* of the model, at the start; with the scene's events, without their calls */
    kt_scene_watch *watch;     /* of these events; the rest is memory, for kt_mechanism_free */
    kt_model *compiled;        /* the model as compiled */
    void *memory;              /* of the copy */
} kt_mechanism;

/* Reads a scene (*.yaml, *.yml) or a robot (all other files: kt_robot_read, with its options, which may be NULL),
 * compiles it, and makes data and a simulation. run: NULL: the scene's own; of a robot the default. On failure
 * *mechanism is untouched. Errors, with the place in the file where there is one: those of kt_scene_read or
 * kt_robot_read, kt_model_compile, kt_simulation_create and kt_scene_watch_create. */
KT_API KT_CHECKED kt_status kt_mechanism_load(const char *path, const kt_robot_options *options, const kt_run *run,
                                              kt_mechanism *mechanism, kt_error *error);

/* Releases all of it, and clears the struct; NULL, and what was cleared, is allowed. */
KT_API void kt_mechanism_free(kt_mechanism *mechanism);

#ifdef __cplusplus
}
#endif
#endif
