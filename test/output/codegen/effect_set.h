/* Random effects on a random tree. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_CODEGEN_EFFECT_SET_H
#define KT_TEST_CODEGEN_EFFECT_SET_H

#include "generated.h"

enum { KT_EFFECT_SET = 6, KT_EFFECT_FORMULA = 400, KT_EFFECT_STATES = 2 };

/* Effects with all that they point to; not to be copied. */
typedef struct kt_effect_set {
    kt_effect effect[KT_EFFECT_SET];
    char name[KT_EFFECT_SET][16], formula[KT_EFFECT_SET][6][KT_EFFECT_FORMULA];
    kt_function part[KT_EFFECT_SET][3][3];
    int count;
} kt_effect_set;

/* The name of a joint of one coordinate; NULL: the tree has none. */
const char *kt_effect_set_joint(const kt_tree *tree, kt_random *random);

/* Draws some effects of one type, and a motor whose torque depends on time. Compiles the tree again. */
void kt_effect_set_draw(kt_effect_set *set, kt_effect_type type, kt_tree *tree, kt_random *random);

/* Draws two auxiliary states whose rates read the time, each other, a joint and a marker; and a motor that reads both.
 * Compiles the tree again. */
void kt_effect_set_draw_states(kt_effect_set *set, kt_tree *tree, kt_auxiliary_state state[KT_EFFECT_STATES],
                               kt_random *random);

#endif
