/* Tunable parameters of an instance. They are variables of the scene, so that all that follows from them can be set in
 * a model that is compiled (scene/tune.h).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "instance.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool take_tunables(kt_fmu_tunables *t, size_t room) {
    double **const arrays[] = {&t->standard, &t->compiled, &t->values, &t->wanted};
    bool fine = true;
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; i++) {
        *arrays[i] = calloc(room, sizeof **arrays[i]);
        fine = fine && *arrays[i] != NULL;
    }
    t->parameter = calloc(room, sizeof *t->parameter);
    t->name = calloc(room, sizeof *t->name);
    t->names = calloc(room, sizeof *t->names);
    return fine && t->parameter != NULL && t->name != NULL && t->names != NULL;
}

kt_status kt_fmu_find_tunables(kt_fmu *fmu, kt_error *error) {
    kt_fmu_tunables *t = &fmu->tunables;
    kt_fmu_find_roles(fmu->scene_text, fmu->scene_size, &fmu->scene, fmu->roles);
    if (!take_tunables(t, (size_t)fmu->parameter_count + 1))
        return kt_error_set(error, KT_ERROR_MEMORY, NULL, "there is not enough memory");
    for (int i = 0; i < fmu->parameter_count; i++) {
        if (fmu->roles[i] != KT_FMU_TUNABLE)
            continue;
        (void)snprintf(t->name[t->count], sizeof t->name[0], "%s", fmu->scene.parameters[i].name);
        t->names[t->count] = t->name[t->count];
        t->standard[t->count] = t->wanted[t->count] = fmu->scene.parameters[i].value;
        t->parameter[t->count++] = i;
    }
    return KT_OK;
}

int kt_fmu_tunable_at(const kt_fmu *fmu, int i) {
    for (int k = 0; k < fmu->tunables.count; k++)
        if (fmu->tunables.parameter[k] == i)
            return k;
    return -1;
}

void kt_fmu_copy_tunables(const kt_fmu *fmu, const double *from, double *to) {
    if (fmu->tunables.count > 0)
        memmove(to, from, (size_t)fmu->tunables.count * sizeof *to);
}

kt_status kt_fmu_tune(kt_fmu *fmu, bool jumps, kt_error *error) {
    kt_fmu_tunables *t = &fmu->tunables;
    bool differs = false;
    for (int k = 0; k < t->count; k++)
        differs |= t->values[k] != t->wanted[k];
    if (!differs)
        return KT_OK;
    kt_status status = jumps && !fmu->is_exchange ? kt_fmu_fire(fmu, error) : KT_OK;
    if (status == KT_OK)
        status = kt_tuning_set(fmu->tuning, t->wanted, fmu->simulation, jumps && !fmu->is_exchange, error);
    if (status != KT_OK) {
        kt_fmu_copy_tunables(fmu, t->values, t->wanted);
        return status;
    }
    kt_fmu_copy_tunables(fmu, t->wanted, t->values);
    kt_fmu_change(fmu);
    return KT_OK;
}

void kt_fmu_free_tunables(kt_fmu *fmu) {
    kt_fmu_tunables *t = &fmu->tunables;
    free(t->standard);
    free(t->compiled);
    free(t->values);
    free(t->wanted);
    free(t->parameter);
    free(t->name);
    free(t->names);
}
