/* The picture of a state: loops and effects that are released do not act, and are not drawn. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/draw.h"

#include "open/released.h"

#include <stdlib.h>

/* Copies the items that are not released to `list`, which has room for all; returns their number. */
#define KT_KEEP(items, count, list, kept)                                                                              \
    do {                                                                                                               \
        for (int item = 0; item < (count); item++)                                                                     \
            if (!kt_released_holds(scene, released, (items)[item].name))                                               \
                (list)[(kept)++] = (items)[item];                                                                      \
    } while (false)

static bool leave_out(const kt_scene *scene, const kt_picture *whole, uint64_t released, kt_picture *shown) {
    *shown = *whole;
    shown->loop_count = shown->relation_count = shown->effect_count = 0;
    shown->loops = malloc(((size_t)whole->loop_count + 1) * sizeof *shown->loops);
    shown->relations = malloc(((size_t)whole->relation_count + 1) * sizeof *shown->relations);
    shown->effects = malloc(((size_t)whole->effect_count + 1) * sizeof *shown->effects);
    if (shown->loops == NULL || shown->relations == NULL || shown->effects == NULL)
        return false;
    KT_KEEP(whole->loops, whole->loop_count, shown->loops, shown->loop_count);
    KT_KEEP(whole->relations, whole->relation_count, shown->relations, shown->relation_count);
    KT_KEEP(whole->effects, whole->effect_count, shown->effects, shown->effect_count);
    return true;
}

kt_picture *kt_shown_create(const kt_scene *scene, const kt_picture *whole, const uint64_t *released, int count) {
    kt_picture *shown = calloc((size_t)count, sizeof *shown);
    for (int i = 0; i < count && shown != NULL; i++)
        if (!leave_out(scene, whole, released[i], &shown[i])) {
            kt_shown_free(shown, i + 1);
            return NULL;
        }
    return shown;
}

void kt_shown_free(kt_picture *shown, int count) {
    for (int i = 0; i < count && shown != NULL; i++) {
        free(shown[i].loops);
        free(shown[i].relations);
        free(shown[i].effects);
    }
    free(shown);
}
