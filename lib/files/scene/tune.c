/* Parameters that change while a simulation runs (tune.h): new values go into the scene (vary.c), and from there into
 * the model and the simulation (assignment.c).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/tune.h"

#include "base/pool.h"
#include "scene/assignment.h"

#include <stdlib.h>
#include <string.h>

struct kt_tuning {
    kt_pool pool;
    kt_scene *scene;
    kt_assignments *assignments;
    double *values; /* of the variables, now */
    size_t count;
};

kt_status kt_tuning_create(kt_scene *scene, const kt_model *model, kt_tuning **tuning, kt_error *error) {
    size_t count = 0;
    const double *values = kt_varied_values(scene, &count);
    kt_tuning *to = *tuning = calloc(1, sizeof *to);
    if (to != NULL)
        to->values = kt_pool_take(&to->pool, count + 1, sizeof *to->values);
    if (to == NULL || to->values == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, "kt_tuning_create", "there is not enough memory");
    to->scene = scene;
    to->count = count;
    if (count > 0)
        memcpy(to->values, values, count * sizeof *values);
    return kt_assignments_create_varied(&to->pool, scene, model, &to->assignments, error);
}

void kt_tuning_free(kt_tuning *tuning) {
    if (tuning != NULL)
        kt_pool_free(tuning->pool.chunks);
    free(tuning);
}

kt_status kt_tuning_set(kt_tuning *tuning, const double *values, kt_simulation *simulation, bool jumps,
                        kt_error *error) {
    kt_status status = kt_scene_vary(tuning->scene, values, error);
    if (status != KT_OK)
        return status;
    status = jumps ? kt_assignments_apply(tuning->assignments, simulation, error)
                   : kt_assignments_sync(tuning->assignments, simulation, error);
    if (status == KT_OK) {
        memcpy(tuning->values, values, tuning->count * sizeof *values);
        return KT_OK;
    }
    kt_error again; /* the former values are valid */
    if (kt_scene_vary(tuning->scene, tuning->values, &again) == KT_OK && !jumps)
        (void)(kt_assignments_sync(tuning->assignments, simulation, &again) == KT_OK);
    return status;
}
