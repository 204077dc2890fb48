/* The limits of model exchange. The command and the binary of an FMU both use this function. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_FMU_EXCHANGE_H
#define KT_FMU_EXCHANGE_H

#include "kinetree/mechanism.h"
#include "kinetree/scene.h"

/* Returns why a scene is not offered for model exchange; NULL if it is. */
static inline const char *kt_fmu_reason_against_exchange(const kt_scene *scene, const kt_model *model) {
    (void)scene;
    if (kt_switch_count(model) > 0)
        return "the scene has hard contacts, stops, friction that sticks, or parts that events release";
    return kt_massless_count(model) > 0 ? "a joint moves no mass" : NULL;
}

#endif
