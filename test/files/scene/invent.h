/* Random scenes that are right: every joint, shape, loop, effect, function and rotation, with numbers of every size. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SCENE_INVENT_H
#define KT_TEST_SCENE_INVENT_H

#include "kinetree/scene.h"
#include "random.h"

#include <stdbool.h>

enum { INVENT_BODIES = 12, INVENT_LOOPS = 12, INVENT_EFFECTS = 6, INVENT_MARKERS = 3, INVENT_NUMBERS = 8 };

typedef struct kt_invented {
    kt_scene scene;
    kt_body bodies[INVENT_BODIES];
    kt_marker markers[INVENT_BODIES][INVENT_MARKERS];
    kt_loop loops[INVENT_LOOPS];
    kt_effect effects[INVENT_EFFECTS];
    kt_term terms[INVENT_LOOPS][2];
    char formulas[INVENT_LOOPS][120];
    double numbers[INVENT_LOOPS + INVENT_EFFECTS][INVENT_NUMBERS];
    const char *hold[2];
    kt_marker_pair pairs[INVENT_BODIES];
    char text[64];
} kt_invented;

/* Fills *out, which must stay where it is. `everything`: with loops, effects and settings of the run.
 */
void kt_invent(kt_invented *out, kt_random *random, bool everything);

#endif
