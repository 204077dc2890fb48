/* Tendons of MJCF that are fixed to joints: their length is a sum of joint coordinates, c_1 q_1 + c_2 q_2 + ... */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/write.h"

#include <math.h>

/* The name of a tendon that other elements have already. */
static bool is_taken(const kt_export *x, const char *name) {
    for (int i = 0; i < x->d->body_count; i++)
        if (x->role[i] == KT_EXPORT_SUM && kt_text_is(kt_joint_name_of(kt_export_body(x, i)), name))
            return true;
    for (int i = 0; i < x->d->loop_count; i++)
        if (kt_text_is(x->d->loops[i].name, name))
            return true;
    for (int i = 0; i < x->d->effect_count; i++)
        if (x->d->effects[i].end_count == 2 && kt_text_is(x->d->effects[i].name, name))
            return true;
    return false;
}

int kt_export_add_line(kt_export *x, const char *name, const kt_term *terms, int count) {
    for (int i = 0; i < x->line_count; i++)
        if (kt_text_is(x->lines[i].name, name) && x->lines[i].spring == NULL)
            return i;
    x->lines[x->line_count] = (kt_export_line){.name = name, .terms = terms, .count = count};
    x->lines[x->line_count].is_renamed = name == NULL || is_taken(x, name);
    return x->line_count++;
}

void kt_export_line_name(kt_export *x, const char *attribute, int line) {
    const char *name = x->lines[line].name;
    if (x->lines[line].is_renamed)
        kt_export_print(x, " %s=\"%s__line%d\"", attribute, name != NULL ? name : "", line + 1);
    else
        kt_export_print(x, " %s=\"%s\"", attribute, name);
}

void kt_export_sum_range(kt_export *x, const kt_actuator *a) {
    if (a != NULL && (isfinite(a->sum_lower) || isfinite(a->sum_upper)))
        kt_export_print(x, " actuatorfrcrange=\"%g %g\"", kt_export_bound(a->sum_lower), kt_export_bound(a->sum_upper));
}
