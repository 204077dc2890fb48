/* The switched loops and effects that are off or released at the end of a run. A scene that continues the run begins
 * with them in this state. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SCENE_RELEASED_H
#define KT_COMMAND_SCENE_RELEASED_H

#include "kinetree/scene.h"
#include "kinetree/simulation.h"

struct json_t; /* from jansson */

/* Returns the loops and effects that do not act in the present state. Each switched loop or effect has a bit: loops
 * first, in the order of the scene. The function kt_released_holds returns whether a set has the loop or effect of this
 * name (NULL: no). */
uint64_t kt_released_set(const kt_scene *scene, const kt_simulation *simulation);
bool kt_released_holds(const kt_scene *scene, uint64_t set, const char *name);

/* Returns the name of the k-th loop or effect, loops first; NULL: it has none, or is not switched. */
const char *kt_switched_name(const kt_description *d, int k);
/* Returns whether the loop or effect of this name is off or released at present. */
bool kt_is_released(const kt_simulation *simulation, const char *name);

/* Returns the names of these loops and effects, as a new list. */
struct json_t *kt_released_list(const kt_scene *scene, const kt_simulation *simulation);

/* Lets the listed loops and effects begin released, and the others engaged. The scene must own its loops and effects
 * (kt_scene_start_from). */
void kt_released_apply(kt_scene *scene, const struct json_t *list);

/* Writes the names of all that are switched, "string, floor", as snprintf does. */
void kt_released_names(const kt_scene *scene, char *text, size_t size);

#endif
