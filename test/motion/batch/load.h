/* Effects of every type on a random tree. Contacts, stops and limits of servos act in some states and not in others. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_BATCH_LOAD_H
#define KT_TEST_BATCH_LOAD_H

#include "mechanics/dynamics/tree.h"

enum { KT_LOADS = 40 };

typedef struct kt_load_list {
    kt_effect effect[KT_LOADS];
    char formula[7][96];
} kt_load_list;

/* Adds them to a described tree that has not been compiled. `formulas`: those by formulas, too, which are evaluated
 * lane by lane. */
void kt_load_add(kt_load_list *list, kt_tree *tree, bool formulas, kt_random *random);

/* Adds those by formulas alone, which store no energy. */
void kt_load_add_formulas(kt_load_list *list, kt_tree *tree, kt_random *random);

#endif
