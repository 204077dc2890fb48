/* Hard cases: mechanisms on which engines break, each with its measures and their bounds.
 *
 * A case is a row of a table (kt_hard_at). The tests run it and check its bounds. The program bench/hard prints it in
 * its full length, with the results of other engines for the same mechanism. Nothing here depends on the tests.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_HARD_H
#define KT_TEST_HARD_H

#include "../reference/upright.h"

#include "kinetree/scene.h"

enum { KT_HARD_MEASURES = 3, KT_HARD_KINDS = 15, KT_HARD_WORDS = 400 };

/* A quantity that must stay small. A bound of 0 counts claims that do not hold. `what` is NULL behind the last one. */
typedef struct kt_hard_measure {
    const char *what, *unit;
    double bound;
} kt_hard_measure;

/* The quantities of a mechanism at a time that any engine has. For each body of the description: the pose of its frame,
 * and its twist (velocity of the frame's origin), in world axes. */
typedef struct kt_hard_view {
    const kt_description *description;
    const int *parent; /* of each body, in the description; -1: the world */
    const kt_pose *pose;
    const kt_twist *twist;
    double t;
} kt_hard_view;

/* The observations of a motion: the worst of each measure, and the reference values. Starts as zeros. */
typedef struct kt_hard_watch {
    double observed[KT_HARD_MEASURES];
    int count; /* views before this one */
    double energy, kinetic_most, at_tenth;
    kt_wrench momentum;
    double momentum_most; /* angular */
    kt_upright exact;
    double number[4]; /* a case's own */
} kt_hard_watch;

typedef struct kt_hard kt_hard;

/* A motion that any engine can compute. */
typedef struct kt_hard_motion {
    const char *scene; /* hard/scenes/NAME.yaml or apps/scenes/NAME.yaml; NULL: `change` makes it */
    double duration;   /* s */
    double shorter;    /* s, in the tests; 0: the whole */
    const char *integrator;
    double step;      /* s, fixed; peers run with it in any case */
    double tolerance; /* > 0: adaptive, and `step` is only the peers' */
    double interval;  /* s between views */
    kt_reduction reduction;
    kt_plan plan;
    int rank;                                                  /* of the loops, to be checked; 0: no check */
    bool (*change)(kt_hard *h);                                /* of the description; NULL: none */
    void (*watch)(kt_hard_watch *w, const kt_hard_view *view); /* raises w->observed */
    bool alone;                                                /* peers have nothing like it */
} kt_hard_motion;

typedef struct kt_hard_case {
    int number; /* of its kind, 1 to KT_HARD_KINDS */
    const char *name, *why;
    kt_hard_measure measures[KT_HARD_MEASURES];
    const kt_hard_motion *motion;
    void (*run)(kt_hard *h); /* a run for this engine only; NULL: the motion */
} kt_hard_case;

/* One run of a case. */
struct kt_hard {
    const kt_hard_case *c;
    bool full; /* whole length */
    kt_scene scene;
    kt_description description; /* with bodies, loops and effects of its own, which may be changed: */
    kt_body *bodies;
    kt_loop *loops;
    kt_effect *effects;
    char *names; /* for bodies that are made; NULL */
    int *parent;
    kt_pose *pose;
    kt_twist *twist;
    kt_model *model;
    kt_simulation *simulation;
    double observed[KT_HARD_MEASURES]; /* NaN: it did not get so far */
    char words[KT_HARD_WORDS];         /* remarks; may be empty */
};

int kt_hard_count(void);
const kt_hard_case *kt_hard_at(int index);

/* Runs a case and stores the outcome in h->observed and h->words. */
void kt_hard_run(kt_hard *h, const kt_hard_case *c, bool full);

/* ---- for the cases ----------------------------------------------------------------------------------------------- */

/* printf into h->words, after their present text. */
void kt_hard_say(kt_hard *h, const char *format, ...) KT_PRINTF(2, 3);
/* Whether the status is KT_OK; otherwise its message is appended to the words. */
bool kt_hard_fine(kt_hard *h, kt_status status, const kt_error *error);
/* For runs that count: if a claim does not hold, reports it and adds one to observed[measure]. */
void kt_hard_claim(kt_hard *h, int measure, bool holds, const char *what);

/* The description of a motion; to be closed in any case. Without memory, false. */
bool kt_hard_open(kt_hard *h, const kt_hard_motion *motion);
bool kt_hard_make(kt_hard *h, int bodies, int loops, int effects); /* an empty one of this size */
void kt_hard_close(kt_hard *h);
bool kt_hard_compile(kt_hard *h, const kt_hard_motion *motion);
kt_run kt_hard_settings(const kt_hard *h, const kt_hard_motion *motion);
double kt_hard_duration(const kt_hard *h, const kt_hard_motion *motion);
/* compiles and places a simulation at its start */
bool kt_hard_start(kt_hard *h, const kt_hard_motion *motion);
/* Views of the present state of h->model in data whose kinematics are up to date. */
kt_hard_view kt_hard_look(const kt_hard *h, const kt_data *data, double t);
/* The whole motion in this engine, watched. */
bool kt_hard_follow(kt_hard *h, const kt_hard_motion *motion, kt_hard_watch *watch);

/* ---- measures of views ------------------------------------------------------------------------------------------- */

double kt_hard_kinetic(const kt_hard_view *view);
/* of gravity and of springs between points */
double kt_hard_potential(const kt_hard_view *view);
kt_wrench kt_hard_momentum(const kt_hard_view *view); /* about the world's origin */
/* The largest distance between points that a joint or a loop holds together, and angle between axes of hinges. */
double kt_hard_gap(const kt_hard_view *view);
int kt_hard_body(const kt_hard_view *view, const char *name);

/* Raise one measure by |change of energy| / greatest kinetic energy so far; by the gap; to be called at every view. */
void kt_hard_watch_energy(kt_hard_watch *w, const kt_hard_view *view, int measure);
void kt_hard_watch_gap(kt_hard_watch *w, const kt_hard_view *view, int measure);
void kt_hard_raise(kt_hard_watch *w, int measure, double value);

/* ---- the lists that kt_hard_at shows, file by file, each ended by a case without a name -------------------------- */

extern const kt_hard_case kt_hard_windows[], kt_hard_loops[], kt_hard_masses[], kt_hard_turning[], kt_hard_stiff[],
    kt_hard_trouble[], kt_hard_extremes[];

#endif
