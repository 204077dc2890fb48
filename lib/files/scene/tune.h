/* Parameters of a scene that a program changes while a simulation runs: the variables (kt_scene_options) of a scene
 * that is tunable (kt_scene_is_tunable).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_TUNE_H
#define KT_SCENE_TUNE_H

#include "kinetree/scene.h"

typedef struct kt_tuning kt_tuning;

/* Binds the variables of a scene to its model, which is settable (kt_model_options). The scene and the model must
 * outlive *tuning. Ownership: kt_tuning_free releases it, also after an error. */
KT_CHECKED kt_status kt_tuning_create(kt_scene *scene, const kt_model *model, kt_tuning **tuning, kt_error *error);
void kt_tuning_free(kt_tuning *tuning);

/* Gives the variables other values, in the scene and in its model. With `jumps` the simulation takes them over at its
 * present time, as kt_simulation_change does. Otherwise it is left as it is, for a caller that sets its state next.
 * Nothing is allocated. Errors: those of kt_scene_vary and kt_simulation_change; nothing is changed then. */
KT_CHECKED kt_status kt_tuning_set(kt_tuning *tuning, const double *values, kt_simulation *simulation, bool jumps,
                                   kt_error *error);

#endif
