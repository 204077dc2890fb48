/* Footholds and grips: loops that events close where bodies are at that instant, {engage_here: LOOP}.
 *
 * The event moves the loop's end on the world or, between two bodies, the second end (loop NAME.place), and switches
 * the loop on. The place is held by six
 * auxiliary states of the rate 0: NAME_x, _y, _z (m), and the rotation vector NAME_rx, _ry, _rz (rad). These states
 * begin with the place that the scene gives. Records show them, checkpoints contain them, and --from takes them over. A
 * simulation whose state has been replaced gets its places from them (kt_scene_watch_sync). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_FOOTHOLD_H
#define KT_SCENE_FOOTHOLD_H

#include "scene/value.h"

/* ---- while a scene is read --------------------------------------------------------------------------------------- */

/* Adds the states to the section `states`, before it is read. */
void kt_footholds_expand(kt_reader *r);

/* Checks the loop of an action. */
bool kt_foothold_check(kt_reader *r, const kt_scope *scope, kt_node *node, const char *name);

/* The loop whose action makes the state of this name; NULL: there is none. */
const char *kt_foothold_named(const kt_reader *r, const char *state);

/* ---- of a scene -------------------------------------------------------------------------------------------------- */

/* The number of such actions. */
int kt_footholds_count(const kt_scene *scene);

/* Sets the initial values of the states by the places of the loops, or the places by the values. */
void kt_footholds_measure(kt_scene *scene);
void kt_footholds_follow(kt_scene *scene);

/* ---- in a simulation --------------------------------------------------------------------------------------------- */

typedef struct kt_footholds kt_footholds;

/* Finds the loops in a model; *footholds is NULL if there are none. */
KT_CHECKED kt_status kt_footholds_create(kt_pool *pool, const kt_scene *scene, const kt_model *model,
                                         kt_footholds **footholds, kt_error *error);

/* Moves those of these switches whose loops do not act to the present position. data: scratch. */
KT_CHECKED kt_status kt_footholds_set(kt_footholds *footholds, kt_simulation *simulation, kt_data *data, uint64_t bits,
                                      kt_error *error);

/* Sets the places of the model by the states that the simulation has. */
KT_CHECKED kt_status kt_footholds_sync(kt_footholds *footholds, const kt_simulation *simulation, kt_error *error);

#endif
