/* The released loops and effects as JSON, and a scene that begins with them released. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/released.h"

#include "text/json.h"

#include <string.h>

json_t *kt_released_list(const kt_scene *scene, const kt_simulation *simulation) {
    const kt_description *d = &scene->description;
    json_t *list = json_array();
    for (int k = 0; k < d->loop_count + d->effect_count; k++) {
        const char *name = kt_switched_name(d, k);
        if (name != NULL && kt_is_released(simulation, name))
            json_array_append_new(list, kt_json_text(name));
    }
    return list;
}

static bool list_has_name(const json_t *list, const char *name) {
    for (size_t i = 0; i < json_array_size(list); i++) {
        const char *one = json_string_value(json_array_get(list, i));
        if (one != NULL && strcmp(one, name) == 0)
            return true;
    }
    return false;
}

void kt_released_apply(kt_scene *scene, const json_t *list) {
    const kt_description *d = &scene->description;
    for (int k = 0; k < d->loop_count + d->effect_count; k++) {
        const char *name = kt_switched_name(d, k);
        kt_switching *to = k < d->loop_count ? &((kt_loop *)(uintptr_t)d->loops)[k].switching
                                             : &((kt_effect *)(uintptr_t)d->effects)[k - d->loop_count].switching;
        if (name != NULL)
            *to = list_has_name(list, name) ? KT_SWITCHED_OFF : KT_SWITCHED_ON;
    }
}
