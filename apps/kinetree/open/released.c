/* Lists the released loops and effects. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/released.h"

#include <stdio.h>
#include <string.h>

/* Returns a loop that bounds one side (of a hard stop, a contact or a slack rope); -1: there is none of this name. */
static int find_side(const kt_model *model, const char *name) {
    static const char *const suffixes[] = {"", ".lower", ".upper"};
    char text[512];
    for (size_t i = 0; i < sizeof suffixes / sizeof *suffixes; i++) {
        (void)snprintf(text, sizeof text, "%s%s", name, suffixes[i]);
        const int loop = kt_loop_find(model, text);
        if (loop >= 0 && kt_loop_side(model, loop) != KT_SIDE_NONE)
            return loop;
    }
    return -1;
}

bool kt_is_released(const kt_simulation *simulation, const char *name) {
    const kt_model *model = kt_simulation_model(simulation);
    const int side = find_side(model, name), effect = kt_effect_find(model, name);
    const int hard = kt_loop_switch(model, side >= 0 ? side : kt_effect_stick_loop(model, effect));
    if (hard >= 0)
        return (kt_simulation_released(simulation) & kt_switch_bits(model, hard)) != 0;
    const int loop = kt_loop_switch(model, kt_loop_find(model, name));
    const int at = loop >= 0 ? loop : kt_effect_switch(model, effect);
    return at >= 0 && (kt_switch_set(model) & kt_switch_bits(model, at)) == 0;
}

const char *kt_switched_name(const kt_description *d, int k) {
    const kt_switching switching = k < d->loop_count ? d->loops[k].switching : d->effects[k - d->loop_count].switching;
    const char *name = k < d->loop_count ? d->loops[k].name : d->effects[k - d->loop_count].name;
    return switching != KT_ALWAYS_ON && switching != KT_NEVER_ON ? name : NULL;
}

uint64_t kt_released_set(const kt_scene *scene, const kt_simulation *simulation) {
    const kt_description *d = &scene->description;
    uint64_t set = 0;
    int bit = 0;
    for (int k = 0; k < d->loop_count + d->effect_count && bit < 64; k++) {
        const char *name = kt_switched_name(d, k);
        if (name != NULL)
            set |= (uint64_t)kt_is_released(simulation, name) << bit++;
    }
    return set;
}

bool kt_released_holds(const kt_scene *scene, uint64_t set, const char *name) {
    const kt_description *d = &scene->description;
    int bit = 0;
    for (int k = 0; k < d->loop_count + d->effect_count && bit < 64 && name != NULL; k++) {
        const char *other = kt_switched_name(d, k);
        if (other != NULL && (set >> bit++ & 1) != 0 && strcmp(other, name) == 0)
            return true;
    }
    return false;
}

void kt_released_names(const kt_scene *scene, char *text, size_t size) {
    const kt_description *d = &scene->description;
    size_t used = 0;
    text[0] = '\0';
    for (int k = 0; k < d->loop_count + d->effect_count; k++) {
        const char *name = kt_switched_name(d, k);
        if (name != NULL && used < size)
            used += (size_t)snprintf(text + used, size - used, "%s%s", used > 0 ? ", " : "", name);
    }
}
