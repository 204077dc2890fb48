/* A description with every kind of item and no fault, for tests that spoil it in one place. The header also declares
 * the list of faults that kt_description_check finds in it. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_MODEL_MECHANISM_H
#define KT_TEST_MODEL_MECHANISM_H

#include "kinetree/model.h"

/* Indices in the description. */
enum { CRANK, COUPLER, ROCKER, SLIDER, BALL, BIRD, GIMBAL, SCREW, BASE, BODIES };
enum { CLOSE, ROD, GEAR, DRIVE, WHEEL, CARDAN, LOOPS };
enum { COIL, OIL, ENGINE, EFFECTS };

typedef struct mechanism {
    kt_body bodies[BODIES];
    kt_marker tips[2]; /* of crank: tip, heel */
    kt_marker end[1];  /* of rocker: end */
    kt_loop loops[LOOPS];
    kt_term terms[2]; /* of gear: crank, rocker */
    kt_effect effects[EFFECTS];
    const char *hold[2]; /* crank, slider */
    kt_description description;
} mechanism;

void mechanism_fill(mechanism *m);

/* The check finds nothing. */
void mechanism_passes(const char *what, const mechanism *m);

/* The check finds this one fault, with the same words in its report and in its error. */
void mechanism_fails(const mechanism *m, kt_item item, int index, int sub, const char *field, const char *where,
                     const char *message);

/* All faults of a description, as lines "ITEM index sub FIELD | WHERE | MESSAGE"; returns their number. */
typedef struct fault_list {
    int count;
    char text[4096];
} fault_list;

fault_list mechanism_faults(const kt_description *description);

/* A change of a sound mechanism `m`, and the fault that it makes, or none. `item` declares a pointer to the changed
 * item: kt_body *b = &m.bodies[2]. */
#define MECHANISM_CHANGED(item, change, check)                                                                         \
    do {                                                                                                               \
        mechanism m;                                                                                                   \
        mechanism_fill(&m);                                                                                            \
        item;                                                                                                          \
        change;                                                                                                        \
        check;                                                                                                         \
    } while (0)
#define MECHANISM_REJECTS(item, change, kind, index, sub, field, where, message)                                       \
    MECHANISM_CHANGED(item, change, mechanism_fails(&m, kind, index, sub, field, where, message))
#define MECHANISM_PASSES(item, change, what) MECHANISM_CHANGED(item, change, mechanism_passes(what, &m))

#endif
