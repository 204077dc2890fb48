/* Kinds of scenes that tests leave out. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SCENE_FILES_H
#define KT_TEST_SCENE_FILES_H

#include "kinetree/description.h"

#include <math.h>

/* Whether some mass is a function of time. */
static inline bool kt_has_variable_mass(const kt_description *description) {
    for (int i = 0; i < description->body_count; i++)
        if (description->bodies[i].variable_mass != NULL)
            return true;
    return false;
}

/* Whether loops or effects come and go: switches, hard contacts, slack ropes, friction that sticks. */
static inline bool kt_is_switched(const kt_description *description) {
    for (int i = 0; i < description->loop_count; i++)
        if (description->loops[i].switching != KT_ALWAYS_ON || description->loops[i].side != KT_SIDE_NONE)
            return true;
    for (int i = 0; i < description->effect_count; i++)
        if (description->effects[i].switching != KT_ALWAYS_ON || description->effects[i].stick ||
            !isinf(description->effects[i].restitution))
            return true;
    return false;
}

/* Whether absolute coordinates and other formulations reject a scene: because of auxiliary states, variable masses or
 * switched parts. */
static inline bool kt_is_for_trees_alone(const kt_description *description) {
    return description->state_count > 0 || kt_has_variable_mass(description) || kt_is_switched(description);
}

#endif
