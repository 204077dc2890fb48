/* What the subcommands about small motions share: a scene, linearised about its initial state or an equilibrium. */
#ifndef KT_COMMAND_LINEAR_H
#define KT_COMMAND_LINEAR_H

#include "json.h"

#include "kinetree/analysis.h"
#include "kinetree/scene.h"

typedef struct kt_small_motion {
    kt_scene scene;
    kt_model *model;
    char *name; /* the scene's, or the file's where it has none */
    kt_linearization *linearization;
    kt_modes *modes;
    kt_data *data;
    double *q, *v; /* the state that it is about, at t = 0 */
    kt_equilibrium equilibrium;
    bool settled; /* q is an equilibrium that was searched for */
} kt_small_motion;

/* Reads, compiles, assembles. Returns KT_EXIT_DONE, or an exit code after saying why; kt_small_motion_close follows
 * either way. */
int kt_small_motion_open(kt_small_motion *motion, const char *path);
void kt_small_motion_close(kt_small_motion *motion);

/* Whether the initial state moves. */
bool kt_small_motion_moves(const kt_small_motion *motion);

/* Puts the mechanism where it rests; on failure the state stays what it was. */
kt_status kt_small_motion_settle(kt_small_motion *motion, bool nearest, kt_error *error);

/* Linearises about the state, with modes. An exit code. */
int kt_small_motion_linearize(kt_small_motion *motion);

/* "crank", "ball about z" or "slider length": a velocity coordinate. */
typedef struct kt_coordinate_name {
    char text[96];
} kt_coordinate_name;

kt_coordinate_name kt_name_coordinate(const kt_model *model, int coordinate);

/* The same as the columns of results have it: "crank", "ball[2]". */
kt_coordinate_name kt_name_column(const kt_model *model, int coordinate);

/* Whether a mode's eigenvalue cannot be distinguished from zero. */
bool kt_mode_is_neutral(const kt_mode *mode);
/* Whether that is so only because its eigenvalue is uncertain by more than its size. A double eigenvalue of zero, as of a
 * body that drifts, comes out as large as the root of the rounding errors, and counts as zero. */
bool kt_mode_is_uncertain(const kt_small_motion *motion, const kt_mode *mode);

/* Whether it grows by more than its error. */
bool kt_mode_grows(const kt_mode *mode);

/* The velocity coordinates that move most in a mode, by their units, with their share of the largest; returns how many
 * of `most` move by more than `least` of it. Positions, or where none moves velocities. */
typedef struct kt_mover {
    int coordinate;
    double share, phase; /* phase against the first, rad */
} kt_mover;

int kt_find_movers(const kt_small_motion *motion, int mode, kt_mover *movers, int most, double least);

#endif
