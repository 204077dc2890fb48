/* Angles of loops that jump. If no joints count an angle, its value is the one nearest to its start
 * (kt_effect_coordinate). When the mechanism takes it through half a turn from there, it jumps by a whole turn. The
 * forces of springs, stops and servos in the angle jump with it. Between two records, such a jump is a change by more
 * than half a turn. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/growth.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

void kt_half_turns_begin(kt_half_turns *turns, const kt_model *model) {
    *turns = (kt_half_turns){.count = 0};
    for (int i = 0; i < kt_effect_count(model) && turns->count < KT_HALF_TURNS_MOST; i++)
        if (kt_effect_loop(model, i, NULL) >= 0 && !kt_effect_is_sliding(model, i)) {
            turns->angle[turns->count] = (double)NAN;
            turns->effect[turns->count++] = i;
        }
}

void kt_half_turns_add(kt_half_turns *turns, kt_warnings *warnings, const kt_scene *scene, const kt_record *record) {
    for (int k = 0; k < turns->count; k++) {
        const int effect = turns->effect[k], loop = kt_effect_loop(record->model, effect, NULL);
        const double angle = kt_effect_coordinate(record->model, record->data, record->q, effect);
        const bool jumps = fabs(angle - turns->angle[k]) > pi;
        const kt_warning warning =
            kt_warning_at("half_turn", record->t, angle, "rad",
                          "Cut the loop at another joint, so that this one is a joint of the tree, which counts turns");
        turns->angle[k] = angle;
        if (!jumps || turns->reported[k] || loop < 0)
            continue;
        turns->reported[k] = true;
        kt_warn(warnings, &warning,
                "the angle of loop '%s', in which a %s acts, has passed half a turn from its start by t = %.9g s and "
                "jumped by a whole one, and the force with it",
                scene->description.loops[loop].name, kt_effect_type_name(kt_effect_type_of(record->model, effect)),
                record->t);
    }
}
