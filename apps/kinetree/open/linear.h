/* Functions for the subcommands that analyse small motions: a scene, linearised about its initial state or an
 * equilibrium. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SCENE_LINEAR_H
#define KT_COMMAND_SCENE_LINEAR_H

#include "text/arguments.h"

#include "kinetree/analysis.h"
#include "kinetree/scene.h"

typedef struct kt_small_motion {
    kt_scene scene;
    kt_model *model;
    char *name; /* the scene's name, or the file's if it has none */
    kt_linearization *linearization;
    kt_modes *modes;
    kt_data *data;
    double *q, *v; /* the state of the linearisation, at t = 0 */
    kt_equilibrium equilibrium;
    bool lacks_contacts;  /* the scene has hard parts, which the model lacks */
    bool settled;         /* q is an equilibrium found by kt_small_motion_settle or _rotate */
    const char *rotating; /* the joint of the frame in which equilibria are; NULL: the world's */
    bool is_repeated;     /* another value of a sweep: warnings about its state have been printed */
} kt_small_motion;

/* Rejects a model whose matrices would take many minutes, and prints the reason. Announces the time if it is above a
 * second. Returns an exit code, or -1 if the model is small enough. */
int kt_reject_dense_size(const kt_model *model);

/* Reads, compiles and assembles a scene. Returns KT_EXIT_DONE, or an exit code after printing the error;
 * kt_small_motion_close must be called in both cases. */
int kt_small_motion_open(kt_small_motion *motion, const char *path, const kt_settings *settings);
void kt_small_motion_close(kt_small_motion *motion);

/* Returns whether a velocity of the initial state is not zero. */
bool kt_small_motion_moves(const kt_small_motion *motion);

/* Replaces the state by an equilibrium at rest; on failure the state is unchanged. */
kt_status kt_small_motion_settle(kt_small_motion *motion, bool nearest, kt_error *error);

/* Replaces the state by a steady rotation about the axis of a joint, with the velocity of the joint in the state
 * before. All other joints rest relative to the rotating frame. Returns an exit code. */
int kt_small_motion_rotate(kt_small_motion *motion, const char *joint, bool nearest);

/* Linearises about the state and computes the modes. Returns an exit code. */
int kt_small_motion_linearize(kt_small_motion *motion);

/* Name of a velocity coordinate: "crank", "ball about z" or "slider length". Names for planar joints have the
 * directions in the joint's frame: "puck z", "puck [0.6, 0, -0.8]". */
typedef struct kt_coordinate_name {
    char text[600];
} kt_coordinate_name;

kt_coordinate_name kt_name_coordinate(const kt_small_motion *motion, int coordinate);

/* Returns the name of a velocity coordinate as in the columns of results: "crank", "ball[2]". */
kt_coordinate_name kt_name_column(const kt_model *model, int coordinate);

/* Returns the number of zero eigenvalues of the places of footholds, which say nothing about the motion. */
int kt_small_motion_places(const kt_small_motion *motion);

/* Returns the magnitude of a mode's eigenvalue, 1/s. */
double kt_mode_modulus(const kt_mode *mode);
/* Returns whether a mode's eigenvalue cannot be distinguished from zero. */
bool kt_mode_is_neutral(const kt_mode *mode);
/* Returns whether a mode is neutral only because the error of its eigenvalue exceeds its magnitude. A double eigenvalue
 * zero, as for a body that drifts, has an error of the order of the square root of the rounding errors. Such a double
 * eigenvalue counts as zero and not as uncertain. */
bool kt_mode_is_uncertain(const kt_small_motion *motion, const kt_mode *mode);

/* Returns whether a mode grows at a rate that exceeds its error. */
bool kt_mode_grows(const kt_mode *mode);

/* Finds the coordinates with the largest amplitudes in a mode, in descending order. Each amplitude is divided by its
 * unit, and its share of the largest one is given. Amplitudes are those of the positions, or of the velocities if no
 * position moves. If nothing moves, they are those of auxiliary states: auxiliary state k is coordinate nv + k. Returns
 * the number of coordinates found, at most `most`, whose share exceeds `least`. */
typedef struct kt_mover {
    int coordinate;
    double share, phase; /* phase relative to the first, rad */
} kt_mover;

int kt_find_movers(const kt_small_motion *motion, int mode, kt_mover *movers, int most, double least);

#endif
