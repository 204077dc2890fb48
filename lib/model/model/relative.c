/* The relative coordinates that each type of loop leaves free, and names of coordinates. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/relative.h"

enum { MOST = 3 };

static const uint8_t coordinates[KT_LOOP_TYPE_COUNT][MOST] = {
    [KT_LOOP_REVOLUTE] = {KT_RELATIVE_ANGLE},
    [KT_LOOP_PRISMATIC] = {KT_RELATIVE_Z},
    [KT_LOOP_SCREW] = {KT_RELATIVE_ANGLE},
    [KT_LOOP_CYLINDRICAL] = {KT_RELATIVE_ANGLE, KT_RELATIVE_Z},
    [KT_LOOP_PLANAR] = {KT_RELATIVE_X, KT_RELATIVE_Y, KT_RELATIVE_ANGLE},
    [KT_LOOP_UNIVERSAL] = {KT_RELATIVE_FIRST, KT_RELATIVE_SECOND},
    [KT_LOOP_COAXIAL] = {KT_RELATIVE_ANGLE},
    [KT_LOOP_INLINE] = {KT_RELATIVE_Z},
    [KT_LOOP_INPLANE] = {KT_RELATIVE_X, KT_RELATIVE_Y},
    [KT_LOOP_SPAN] = {KT_RELATIVE_STRETCH},
};

kt_relative kt_relative_at(kt_loop_type type, int k) {
    return (unsigned)type < KT_LOOP_TYPE_COUNT && k >= 0 && k < MOST ? (kt_relative)coordinates[type][k]
                                                                     : KT_RELATIVE_NONE;
}

int kt_relative_count(kt_loop_type type) {
    int count = 0;
    while (kt_relative_at(type, count) != KT_RELATIVE_NONE)
        count++;
    return count;
}

kt_coordinate_name kt_coordinate_name_of(const char *text) {
    const char *const open = strchr(text, '[');
    kt_coordinate_name name = {.length = open ? (size_t)(open - text) : strlen(text), .has_index = open != NULL};
    if (open)
        name.k = open[1] >= '0' && open[1] <= '9' && open[2] == ']' && open[3] == '\0' ? open[1] - '0' : -1;
    return name;
}

int kt_coordinate_loop(const kt_description *description, const char *text, int first) {
    const kt_coordinate_name name = kt_coordinate_name_of(text);
    for (int i = 0; i < description->loop_count; i++) {
        const int loop = (first + i) % description->loop_count;
        if (kt_coordinate_is_of(text, name, description->loops[loop].name))
            return loop;
    }
    return -1;
}
