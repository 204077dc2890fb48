/* Random mechanisms closed by loops of every type, in space and in a plane, with some driven loops. They contain chains
 * of any joints on the ground and on a body that moves. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_BATCH_CLOSURES_H
#define KT_TEST_BATCH_CLOSURES_H

#include "kinetree/model.h"
#include "random.h"

enum {
    KT_CLOSURES_MOST = 2,
    KT_CLOSURE_BODIES = 8,
    KT_CLOSURES_BODIES = 2 + KT_CLOSURES_MOST * KT_CLOSURE_BODIES,
    KT_CLOSURE_NAME = 8
};

typedef struct kt_closures {
    kt_body body[KT_CLOSURES_BODIES];
    kt_loop loop[3 * KT_CLOSURES_MOST];
    kt_term term[KT_CLOSURES_MOST][2];
    char name[KT_CLOSURES_BODIES][8], loop_name[3 * KT_CLOSURES_MOST][KT_CLOSURE_NAME];
    kt_vec3 at[KT_CLOSURES_BODIES]; /* where the origins are at q = 0 */
    int dofs;                       /* of the chain that is being made */
    bool planar;
    kt_description description;
} kt_closures;

/* Describes such a mechanism, whose loops are closed at q = 0, but for those that are driven. */
void kt_closures_describe(kt_closures *x, bool planar, bool driven, kt_random *random);

/* Appends a loop to those of a description, named by its number. */
kt_loop *kt_closures_add(kt_description *description, kt_loop *loops, char (*names)[KT_CLOSURE_NAME],
                         kt_loop_type type);

#endif
