/* Declarations that the files of `kinetree modes` share. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SUBCOMMANDS_MODES_H
#define KT_COMMAND_SUBCOMMANDS_MODES_H

#include "open/linear.h"

#include "kinetree/study.h"

/* Prints the Floquet multipliers of the motion from the initial state. Returns an exit code. */
int kt_modes_print_period(const kt_small_motion *motion, double period, long steps, bool json);

/* Prints the eigenvalues that a constraint formulation adds to the modes of the motion, which have been computed about
 * its state. Returns an exit code. */
int kt_modes_print_formulation(const kt_small_motion *motion, kt_constraint_formulation_type type, double alpha,
                               double beta, bool json);

enum { KT_MODES_AT_INITIAL = 0, KT_MODES_AT_EQUILIBRIUM }; /* -1: the initial state if it moves, else the equilibrium */

/* Chooses the state of an open motion, linearises about it, and reports the limits of the result. *state: its name.
 * Returns an exit code. */
int kt_modes_prepare(kt_small_motion *motion, int at, bool nearest, const char **state);

/* The results that `modes` computes for each value of a sweep, and shows. */
typedef struct kt_modes_request {
    int at;
    bool nearest, json, dark;
    long count;           /* modes of each value */
    long orders;          /* lines k PARAMETER / (2 pi) of the picture, k from 1 on */
    const char *plot;     /* NULL: no picture */
    const char *rotating; /* as in kt_small_motion */
} kt_modes_request;

/* Computes the modes over a parameter, "PARAMETER=FROM:TO:COUNT". Returns an exit code. */
int kt_modes_sweep_print(const char *range, const char *path, const kt_settings *settings,
                         const kt_modes_request *request);

/* Title of a mode: "2: 13.1 Hz, damping ratio 0.010". A mode that does not oscillate has its time constant instead.
 * moves: whether any body moves in the mode. */
typedef struct kt_mode_title {
    char text[96];
} kt_mode_title;
kt_mode_title kt_modes_title(int number, const kt_mode *mode, bool moves);

/* Lists up to `most` of the slowest modes that are not neutral, *listed of them; returns how many there are of all
 * speeds. */
int kt_modes_slowest(const kt_small_motion *motion, int most, int *list, int *listed);

/* Writes a page that animates the slowest modes. Returns an exit code. The function kt_view_modes opens the scene
 * first. */
int kt_modes_view(const kt_small_motion *motion, const char *state, const char *path, long count, bool boxes);
int kt_view_modes(const char *scene, const char *path, const kt_settings *settings, bool boxes);

/* Draw up to `count` of the slowest modes about the state with the name `state`: the mechanism deflected in each mode,
 * or bars by joints. Return an exit code. */
int kt_modes_draw(const kt_small_motion *motion, const char *state, const char *path, long count, bool is_dark);
int kt_modes_draw_bars(const kt_small_motion *motion, const char *state, const char *path, long count, bool is_dark);

#endif
