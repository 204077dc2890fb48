/* Watches of runs, which warn at the end. One sees fixed steps diverge where nothing watches the energy. Others see
 * distances push, and paths and angles of effects jump. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_ADVICE_GROWTH_H
#define KT_COMMAND_ADVICE_GROWTH_H

#include "advice/warnings.h"
#include "kinetree/scene.h"
#include "kinetree/simulation.h"
#include "kinetree/study.h"
#include "open/simulated.h"

#include <jansson.h>

struct kt_outcome;

/* The largest |v| and the largest |x| (auxiliary states) of the records in the first half of a run. */
typedef struct kt_growth {
    double speed, state;
} kt_growth;

/* Takes a record. Cost: O(coordinates). */
void kt_growth_add(kt_growth *growth, const kt_record *record, double duration);

/* A run that has ended. */
typedef struct kt_grown_run {
    const kt_model *model;
    const kt_absolute *absolute; /* the model's absolute formulation, if that is integrated; else NULL */
    const kt_run *run;
    kt_simulated by; /* its simulation */
} kt_grown_run;

/* Returns the growth of a speed or a state if steps are fixed and only these steps let it grow on; 0: there is none.
 * The error receives the words. Cost: none, unless a value has grown by KT_GROWTH_LEAST. Then KT_GROWTH_STEPS steps,
 * and adaptive steps over the same time. */
double kt_growth_diverges(const kt_growth *growth, const kt_grown_run *grown, kt_error *error);

/* Warns of this at the end of a run, unless its step or its energy has been reported. */
void kt_warn_of_growth(struct kt_outcome *outcome);

/* Distances that push. A rod can push, and a rope cannot. */
enum { KT_COMPRESSIONS_MOST = 256 };

/* The first distances of a scene, with the largest forces that push the ends apart and pull them together. */
typedef struct kt_compressions {
    int count, left;                    /* left: distances beyond these, which are not watched */
    int loop[KT_COMPRESSIONS_MOST];     /* index in the description */
    int of_model[KT_COMPRESSIONS_MOST]; /* index in the model that is integrated */
    double compression[KT_COMPRESSIONS_MOST], tension[KT_COMPRESSIONS_MOST]; /* N, the largest */
    double since[KT_COMPRESSIONS_MOST];                                      /* s, when it first does */
} kt_compressions;

/* Lists the distances of a scene. model: the integrated model, in absolute or tree coordinates. */
void kt_compressions_begin(kt_compressions *compressions, const kt_scene *scene, const kt_model *model);
/* Takes the multipliers of a record. model: of the same shape, with the loops that are on. */
void kt_compressions_add(kt_compressions *compressions, const kt_model *model, double time, const double *multipliers);

/* Report the distances that push: on standard error, and as an object with their names. */
void kt_compressions_say(const kt_compressions *compressions, const kt_scene *scene);
json_t *kt_compressions_describe(const kt_compressions *compressions, const kt_scene *scene);

/* Paths of effects around surfaces. The length of a path jumps if a point enters a surface around which the path is
 * bent, and if the path changes its way around a surface. No rope moves like this. */

/* A path around surfaces. */
typedef struct kt_path_state {
    int effect;
    int quantity[2];     /* indices of its length and rate among the quantities of all effects */
    double radius;       /* radius of the path's smallest surface, m */
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
    double time;         /* time of the last state, s; NaN: none yet */
    double *forward;     /* nv: the change of positions over a step */
    double *q_at, *v_at; /* a state within the step */
    double *change;      /* nv: the change of positions up to this state */
    double *quantities;  /* quantities of all effects, in this state */
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

/* Effects in an angle of a loop that is not counted across turns. At half a turn from the start, the angle jumps by a
 * whole turn. */
enum { KT_HALF_TURNS_MOST = 16 };

/* The first effects in angles of loops, and their coordinates at the last record. */
typedef struct kt_half_turns {
    int count;
    int effect[KT_HALF_TURNS_MOST];
    bool reported[KT_HALF_TURNS_MOST];
    double angle[KT_HALF_TURNS_MOST]; /* rad; NaN: no record yet */
} kt_half_turns;

void kt_half_turns_begin(kt_half_turns *turns, const kt_model *model);

/* Takes a record, whose data must hold its kinematics. Warns, once for each effect, of an angle that has jumped since
 * the previous record. */
void kt_half_turns_add(kt_half_turns *turns, kt_warnings *warnings, const kt_scene *scene, const kt_record *record);

#endif
