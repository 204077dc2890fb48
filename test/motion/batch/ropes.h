/* Random mechanisms of long chains that few equations hold, in a plane and in space. Their groups are in the form of
 * Delassus (reduction/delassus.h). They have relations between joints, branches, and loads on these. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_BATCH_ROPES_H
#define KT_TEST_BATCH_ROPES_H

#include "closures.h"

#include "kinetree/model.h"
#include "random.h"

enum { KT_ROPES_MOST = 2, KT_ROPE_LINKS = 14, KT_ROPE_BODIES = KT_ROPE_LINKS + 4, KT_ROPE_LOOPS = 4 };

typedef struct kt_ropes {
    kt_body body[KT_ROPES_MOST * KT_ROPE_BODIES];
    kt_loop loop[KT_ROPES_MOST * KT_ROPE_LOOPS];
    kt_effect effect[KT_ROPES_MOST];
    kt_term term[KT_ROPES_MOST][2];
    char name[KT_ROPES_MOST * KT_ROPE_BODIES][8];
    char loop_name[KT_ROPES_MOST * KT_ROPE_LOOPS][KT_CLOSURE_NAME];
    kt_vec3 at[KT_ROPES_MOST * KT_ROPE_BODIES]; /* where the origins are at q = 0 */
    bool planar, folded;
    kt_description description;
} kt_ropes;

/* Describes such a mechanism, whose loops are closed at q = 0. If `folded` is set, the links of its first rope, in a
 * plane, lie nearly along one line at q = 0, next to a singular position. */
void kt_ropes_describe(kt_ropes *x, bool planar, bool folded, kt_random *random);

#endif
