/* Random mechanisms in a plane, in which each loop is one pin that closes three coordinates. They are four-bars, cranks
 * with sliders and inverted ones, one upon the other. Their base is the ground or a body that moves. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_BATCH_LINKAGES_H
#define KT_TEST_BATCH_LINKAGES_H

#include "kinetree/model.h"
#include "random.h"

enum { KT_LINKAGES_MOST = 4, KT_LINKAGE_BODIES = 4 };

typedef struct kt_linkages {
    kt_body body[1 + KT_LINKAGES_MOST * KT_LINKAGE_BODIES];
    kt_loop loop[KT_LINKAGES_MOST];
    kt_effect effect[2 * KT_LINKAGES_MOST];
    char name[1 + KT_LINKAGES_MOST * KT_LINKAGE_BODIES][8];
    kt_vec3 at[1 + KT_LINKAGES_MOST * KT_LINKAGE_BODIES]; /* where the origins are at q = 0 */
    kt_description description;
} kt_linkages;

/* Describes such a mechanism, whose loops are closed at q = 0. If `flat` is set, its links lie along one line at q = 0,
 * so that loops are at a singular position. */
void kt_linkages_describe(kt_linkages *x, bool flat, kt_random *random);

#endif
