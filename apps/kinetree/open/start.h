/* The assembled initial state of a scene, with a report of the changes or of the reason for a failure. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SCENE_START_H
#define KT_COMMAND_SCENE_START_H

#include "command.h"
#include "text/json.h"

/* Assembles the initial state into q, v, and reports which of the given values changed. After a failure, reports the
 * remaining residuals and changes that would close the loops. Returns KT_EXIT_DONE or an exit code. */
int kt_start_assemble(const kt_scene *scene, const kt_model *model, kt_data *data, double *q, double *v);

/* Assembles the initial state in temporary memory, for callers that need only the report. */
int kt_start_report(const kt_scene *scene, const kt_model *model);

/* Returns the cause of changes to values that the scene gives, as the subject of "moved values". is_struck: hard
 * contacts, stops or ropes that touch at the start had impacts. */
const char *kt_start_cause(const kt_model *model, bool is_struck);

/* Reports the given values that differ in the assembled state, and returns their number. The report is a warning about
 * the file at `path` (NULL: a message of the command). If `is_struck`, hard contacts, stops or ropes that touch at the
 * start had impacts. */
int kt_start_say_moved(const char *path, const kt_scene *scene, const kt_model *model, const double *q, const double *v,
                       bool is_struck);

/* Returns the same changes as a list of {joint, part, from, to}. */
json_t *kt_start_moved(const kt_model *model, const double *q, const double *v);

/* Returns the name of the first loop that makes a velocity jump; NULL: none. Velocities jump at rows of linear
 * tables, at sign, step and comparisons, and at kinks of abs, min, max and clamp. Only rows and kinks within the
 * duration count. If a loop prescribes rates, only jumps of their values count. */
const char *kt_start_jumping(const kt_scene *scene, double duration);

/* Prints the number of inertias that violate the triangle inequality, and the worst inertia. `inertia_check: warn`
 * permits such inertias. Returns their number. */
int kt_start_say_inertias(const kt_scene *scene);

/* Report the joints that move no mass (kt_massless_count): on standard error, and as a list of names. */
void kt_start_say_massless(const kt_model *model);
json_t *kt_start_massless(const kt_model *model);

/* Returns an object that maps each body whose inertia violates the triangle inequality to the relative excess. */
json_t *kt_start_inertias(const kt_scene *scene);

/* Returns an object that maps each loop that disagrees to its disagreement, [m, rad] (kt_loop_disagreement_of). */
json_t *kt_start_disagreement(const kt_model *model);

/* Returns whether a loop that changes with time drives the mechanism. */
bool kt_is_driven(const kt_description *description);

#endif
