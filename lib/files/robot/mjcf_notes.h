/* The notes of a model in MJCF: one list of the counters, and of the texts that report them (robot.h, kt_note). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ROBOT_MJCF_NOTES_H
#define KT_ROBOT_MJCF_NOTES_H

#include "robot/robot.h"

/* X(name, rank, text): kt_mjcf.notes.NAME counts what the text reports. In the order of the report. */
/* clang-format off */
#define KT_MJCF_BODY_NOTES(X)                                                                                          \
    X(renamed, DETAIL, "names of bodies that a scene cannot have, with '_' or a number:")                              \
    X(fixed_bodies, START, "bodies that are fixed to the world (--floating lets them move):")                          \
    X(freed, START, "bodies that the file fixes to the world, and that --floating lets move freely:")                  \
    X(several, DETAIL,                                                                                                 \
        "joints after the first of a body, each on a body of its own without mass, which has the joint's "             \
        "name:")                                                                                                       \
    X(offsets, DETAIL,                                                                                                 \
        "joints that are not at the origin of their body, on a body of their own, named after the joint:")             \
    X(attached, MOTION, "bodies of this model that it attaches again (attach without a model), left out:")             \
    X(incomplete, MOTION,                                                                                              \
        "tendons, equalities and actuators that are left out, since they refer to parts that are not "                 \
        "attached:")                                                                                                   \
    X(lost_settings, MOTION,                                                                                           \
        "attached models with settings for a whole model (option, settotalmass); the settings of this "                \
        "model apply instead:")                                                                                        \
    X(mocap, START, "bodies that a program moves (mocap), fixed to the world:")                                        \
    X(keys, START, "keyframes, none of which is used as the start (import --keyframe NAME uses one):")                 \
    X(by_density, DETAIL, "geoms without a mass and a density, which take the density of --density:")                  \
    X(by_geoms, DETAIL, "bodies whose mass and inertia are those of their geoms:")

#define KT_MJCF_FORCE_NOTES(X)                                                                                         \
    X(mesh_files, DETAIL, "meshes that cannot be read, or enclose nothing:")                                           \
    X(builtins, MOTION, "surfaces that MuJoCo has built in, left out; its mj_saveLastXML writes their vertices:")      \
    X(bounded, DETAIL, "masses and inertias raised to the least of 'boundmass' and 'boundinertia':")                   \
    X(balanced, DETAIL, "impossible inertias, which 'balanceinertia' makes those of spheres:")                         \
    X(soft, MOTION, "soft equalities, which are exact loops in the scene:")                                            \
    X(armatures, MOTION,                                                                                               \
        "armatures of spatial tendons that are left out: MuJoCo rejects paths around geoms, and the others "           \
        "have too many parts or a part without a length:")                                                             \
    X(tied_paths, DETAIL, "spatial tendons with an armature, each a body without mass that a coupling moves:")         \
    X(branches, MOTION,                                                                                                \
        "tendons whose armature couples branches of the tree, a part of the inertia that MuJoCo leaves out:")          \
    X(scaled, MOTION,                                                                                                  \
        "welds with a torquescale other than 0 and 1, whose weak or strong torques are exact in the scene:")           \
    X(disabled, DETAIL,                                                                                                \
        "what flags of <option> turn off is left out (springs, dampers, dry friction, limits, equalities, "            \
        "actuators, limits of controls)")                                                                              \
    X(idle, DETAIL, "actuators that flags or 'actuatorgroupdisable' turn off, left out:")                              \
    X(idle_ties, DETAIL, "equalities that flags turn off, left out:")                                                  \
    X(inactive, DETAIL, "equalities that are not active, left out:")                                                   \
    X(tied, DETAIL, "fixed tendons of several joints, each a body without mass that a coupling moves:")                \
    X(friction, MOTION, KT_NOTE_SMOOTH_FRICTION)                                                                       \
    X(motors, START, "motors, whose torque is that of the control at the start (0 without --keyframe):")               \
    X(servos, START, "servos, whose target is that of the control at the start (0 without --keyframe):")               \
    X(activations, START, "activations of actuators, which are auxiliary states and follow the control at the start:") \
    X(sums, START,                                                                                                     \
        "joints whose actuators an effect lists, with the control at the start, since the sum of their "               \
        "forces is bounded, their stiffness or damping is below zero, or they are muscles:")                           \
    X(limits, MOTION, "limits of position, which do not act without --stops:")                                         \
    X(soft_stops, START, KT_NOTE_SOFT_STOPS)                                                                           \
    X(lost_limits, MOTION, "limits of ball joints that are left out:")                                                 \
    X(fluid, MOTION, "bodies with geoms of fluidshape=\"ellipsoid\", on which no medium acts:")

#define KT_MJCF_GEOM_NOTES(X)                                                                                          \
    X(pictures, DETAIL,                                                                                                \
        "geoms that are left out of pictures, since they are the world's, or planes, or meshes that a "                \
        "scene cannot place:")

/* clang-format on */

/* The counters. Those of the last line are not in the lists, because mjcf.c writes other numbers or names into their
 * texts. They count geoms that could touch others, contacts that a flag turns off, bodies whose mass is not known, and
 * sites that are no markers. */
#define KT_MJCF_COUNTER(name, rank, text) kt_left name;
typedef struct kt_mjcf_notes {
    KT_MJCF_BODY_NOTES(KT_MJCF_COUNTER)
    KT_MJCF_FORCE_NOTES(KT_MJCF_COUNTER)
    KT_MJCF_GEOM_NOTES(KT_MJCF_COUNTER)
    kt_left contacts, contacts_off, contacts_between, mesh_masses, unnamed_sites;
} kt_mjcf_notes;
#undef KT_MJCF_COUNTER

#endif
