/* Paths of effects around surfaces. The length of a path jumps if a point enters a surface around which the path is
 * bent, and if the path changes its way around a surface. No rope moves like this. */
#ifndef KT_COMMAND_ADVICE_PATH_JUMP_H
#define KT_COMMAND_ADVICE_PATH_JUMP_H

#include "advice/warnings.h"

#include "kinetree/scene.h"

/* A path around surfaces. */
typedef struct kt_path_state {
    int effect;
    int quantity[2];     /* indices of its length and rate among the quantities of all effects */
    double radius;       /* of its smallest surface, m */
    double length, rate; /* in the last state, m and m/s */
    bool reported;
} kt_path_state;

/* A zero-initialised struct watches nothing. */
typedef struct kt_path_watch {
    const kt_scene *scene;
    const kt_model *model;
    kt_warnings *warnings;
    kt_data *data;
    double *numbers;     /* all arrays of numbers below */
    double *q, *v;       /* the last state */
    double time;         /* of the last state, s; NaN: none yet */
    double *forward;     /* nv: the change of positions over a step */
    double *q_at, *v_at; /* a state within the step */
    double *change;      /* nv: the change of positions up to this state */
    double *quantities;  /* of all effects, in this state */
    kt_path_state *paths;
    int count;
} kt_path_watch;

/* Prepares the watch of a scene whose effects have paths around surfaces. Without such paths, or without memory, the
 * watch is empty. kt_path_watch_free releases it. */
void kt_path_watch_begin(kt_path_watch *watch, const kt_scene *scene, const kt_model *model, kt_warnings *warnings);
void kt_path_watch_free(kt_path_watch *watch);

/* Takes the state at the start, or after a step. Warns, once for each effect, of a point that begins within a surface,
 * and if the length of its path has jumped since the last state. Returns whether there was a warning. */
bool kt_path_watch_add(kt_path_watch *watch, double time, const double *q, const double *v);

#endif
