/* Suggests changes that close the loops of a scene. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_ADVICE_ADVICE_H
#define KT_COMMAND_ADVICE_ADVICE_H

#include "command.h"

enum { KT_ADVICE_COORDINATES_MAX = 60 }; /* larger mechanisms are not tried: a failing assembly takes long */

/* Returns the index of a body; -1: the world, or a body that does not exist. */
int kt_advised_body(const kt_description *d, const char *name);

/* Whether only fixed joints are between a body and the world. */
bool kt_body_stands_still(const kt_description *d, const char *name);

/* Assemblies of a scene with one change each. All of a search share one limit of work, which depends on sizes and on no
 * clock: a failing assembly takes a thousand times as long as a successful one. */
typedef struct kt_trials {
    const kt_scene *scene;
    double usual; /* the work of a trial of the scene itself: of one that does not compile */
    double work;  /* the work of the trials so far */
    int count;    /* how many were tried */
    bool ended;   /* a change was not tried, because the limit was reached */
    int dof;      /* degrees of freedom of the scene */
    int left;     /* those of the last change */
} kt_trials;

/* Returns the work of a trial of a model, by its sizes. */
double kt_trial_work(const kt_model *model);

/* Prints that the search ended at its limit, if it did. */
void kt_say_trials_ended(const kt_trials *trials);

/* Returns whether the scene's loops close with another list of held joints. Joint number `out` of `initial: hold` is
 * released (-1: none is). The joint with the name `in` is held in addition (NULL: none is). */
bool kt_closes_holding(kt_trials *trials, int out, const char *in);

/* Returns whether the scene's loops close without one of them. */
bool kt_closes_without(kt_trials *trials, int loop);

/* Return whether a description closes, compiled with the options of the scene's run; false at the limit. The
 * description is given, or the scene's with one change: of a loop (NULL: without it), or of the joint of a body. */
bool kt_closes_described(kt_trials *trials, const kt_description *description);
bool kt_closes_with_loop(kt_trials *trials, int loop, const kt_loop *changed);
bool kt_closes_with_joint(kt_trials *trials, int body, const kt_joint *changed);

/* As kt_closes_described. If it closes, *left becomes the degrees of freedom, and *disagrees whether equations of loops
 * disagree. */
bool kt_closes_to(kt_trials *trials, const kt_description *description, int *left, bool *disagrees);

/* Prints the pairs of loops that prescribe the motion of one joint, each line after `before`. Returns the number of
 * pairs. */
int kt_say_double_motions(const char *before, const kt_scene *scene);

/* Called if the positions close and the velocities contradict each other: prints the loops without which the others
 * agree. */
void kt_say_contradicting_velocities(kt_trials *trials);
/* Prints the pairs of drives of different joints that determine one degree of freedom: without either of them, the
 * loops close with as many degrees of freedom. Returns their number. */
int kt_say_doubly_driven(kt_trials *trials);

/* Called after a failed assembly: prints the residual of each equation and changes that would close the loops. */
void kt_say_open_loops(const kt_scene *scene, const kt_model *model);

/* Reports the loops of a compiled model that disagree because their data are rounded, with the amounts. Suggests loop
 * types without such equations. Returns the number of these loops. */
int kt_say_disagreement(const kt_scene *scene, const kt_model *model);

#endif
