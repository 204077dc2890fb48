/* A page that shows a motion: one HTML file that needs nothing else, neither a network nor other files. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_VIEW_VIEW_H
#define KT_COMMAND_VIEW_VIEW_H

#include "open/recorded.h"
#include "records/marks.h"
#include "text/json_writer.h"
#include "view/live.h"
#include "view/motion.h"

/* A mode, which a page animates. */
typedef struct kt_view_mode {
    const char *title;       /* "1: 2.09 Hz, damping ratio 0.010" */
    double frequency, rate;  /* Hz, 0: it does not oscillate; 1/s */
    double damping;          /* ratio */
    double amplitude, phase; /* the shape at the start: amplitude exp(i phase) */
    const double *screws;    /* [body][12], the world first: how it moves relative to its parent (view/modes.js) */
} kt_view_mode;

/* The content of a page besides the motion. */
typedef struct kt_view {
    const char *name;          /* name of the scene */
    const char *method;        /* "dopri5, tolerance 1e-9" */
    const kt_run *run;         /* the run whose markers leave traces; NULL: none do */
    const kt_marks *marks;     /* marks of events, in the curves; NULL: none */
    const char *notes;         /* JSON of kt_warnings_describe; NULL: none */
    const kt_error *failed;    /* the reason of an early end; NULL: the run is complete */
    const kt_view_mode *modes; /* instead of a motion: the one frame is the state of linearisation; NULL: none */
    int mode_count;
    const kt_live *live; /* the page runs the scene itself; NULL: it does not */
    bool is_overlay;     /* two frames, to be seen over each other */
} kt_view;

/* Adds the content of a page besides its frames, as JSON. */
void kt_view_describe(kt_json_writer *out, const kt_motion *motion, const kt_view *view);

/* Writes the page. Returns KT_EXIT_DONE, or an exit code after printing the error. */
int kt_view_write(const kt_motion *motion, const kt_view *view, const char *path);

/* Writes a page of the initial state. The positions that the scene gives are pale. Over them are the assembled
 * positions, or those that assembly reached before it failed. name: of the scene. Returns an exit code as above. The
 * reason of a failed assembly is only on the page. */
int kt_view_write_start(const kt_scene *scene, const kt_model *model, const char *name, const char *path);

/* Writes a page of a motion that has been recorded: positions and velocities, without forces and energies. Returns an
 * exit code as above. */
int kt_view_write_recorded(const kt_scene *scene, const kt_model *model, const kt_recorded *recorded, bool boxes,
                           const kt_view *view, const char *path);

/* Writes a motion as glTF 2.0 in one binary file (GLB), which other viewers and modellers read: a node for each body,
 * animated, with meshes of its solids. name: of the scene. Returns an exit code as above. */
int kt_glb_write(const kt_motion *motion, const char *name, const char *path);

#endif
