/* Declarations shared by the files of `kinetree stability`; `kinetree run` uses the descriptions of modes, too. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SUBCOMMANDS_STABILITY_H
#define KT_COMMAND_SUBCOMMANDS_STABILITY_H

#include "command.h"

#include "kinetree/analysis.h"

#include <stdio.h>

/* The subject of an analysis, for the functions that print and draw it. */
typedef struct kt_stability_subject {
    const char *name; /* the scene's name */
    const kt_model *model;
    const kt_scene *scene;
    const kt_spectrum *spectrum;
    double duration, step;   /* step: the one requested, s; 0: none */
    const kt_method *method; /* the method to draw */
    kt_method by_rho;        /* two-step with the scene's rho */
} kt_stability_subject;

/* Writes "slider, right, left": the joints with at least a tenth of the largest amplitude in a mode, in descending
 * order. At most four are named, followed by "and N more". The text is empty if the amplitudes are unknown (NULL). */
void kt_write_movers(const kt_model *model, const double *moves, char *text, size_t size);

/* Writes "decay of 8117 /s", "undamped oscillation of 3.2 Hz" ... */
void kt_write_mode(const kt_mode *mode, char *text, size_t size);

/* Writes "L-stable", "A-stable, 0.6 at infinity" or "not A-stable"; nothing for methods that are not implicit. */
void kt_write_verdict(const kt_method *method, char *text, size_t size);

/* Draws the eigenvalues times a step and the boundary of the method's region of stability. Returns KT_EXIT_DONE, or an
 * exit code after printing the error. */
int kt_stability_draw(const kt_stability_subject *subject, const char *path, bool is_dark);

/* Describes a mode with the joints that move: "decay of 40 /s (arm, wrist)". */
void kt_write_moving_mode(const kt_model *model, const kt_spectrum_mode *at, char *text, size_t size);

#endif
