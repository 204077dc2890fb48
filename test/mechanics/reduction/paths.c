/* The paths of links from a loop's ends to their common ancestor, as a compiled model stores them. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"
#include "mechanics/constraint/tangle.h"

#include "model/model.h"

#include <stdio.h>

static int32_t depth_of(const kt_model *m, int32_t link) {
    int32_t depth = 0;
    for (; link; link = m->link[link].parent)
        depth++;
    return depth;
}

static int32_t ancestor_of(const kt_model *m, int32_t i, int32_t j) {
    while (i != j)
        *(depth_of(m, i) > depth_of(m, j) ? &i : &j) = m->link[depth_of(m, i) > depth_of(m, j) ? i : j].parent;
    return i;
}

/* The number of links on paths of loops, each counted once for each path. *wrong: paths and ancestors that contradict
 * the links' parents. */
static int check_paths(const kt_model *m, int *wrong) {
    int sum = 0;
    for (size_t i = 0; i < m->n.loop; i++) {
        const kt_loop_record *r = &m->loop[i];
        if (r->term_count)
            continue;
        *wrong += r->ancestor != ancestor_of(m, r->link[0], r->link[1]);
        for (int k = 0; k < 2; k++) {
            int32_t j = r->link[k], at = r->length[k];
            for (; at > 0 && m->path[r->path[k] + at - 1] == j; j = m->link[j].parent)
                at--;
            *wrong += at > 0 || j != r->ancestor;
            sum += r->length[k];
        }
    }
    return sum;
}

/* Two chains that hang side by side; rods of given length between them, the first ones first or last. */
static void build_ladder(linkage *l, int rungs, bool upwards) {
    const kt_vec3 down = kt_vec3_make(0.0, -1.0, 0.0);
    char name[16];
    linkage_begin(l);
    for (int i = 0; i < 2 * rungs; i++) {
        (void)snprintf(name, sizeof name, "rod%d", i);
        linkage_bar(l, name, i < 2 ? NULL : l->body[i - 2].name, i < 2 ? kt_vec3_make(i, 0.0, 0.0) : down, down, 0.0,
                    0.0);
    }
    for (int n = 0; n < rungs; n++) {
        const int i = upwards ? rungs - 1 - n : n;
        (void)snprintf(name, sizeof name, "rung%d", i);
        linkage_close(l, name, KT_LOOP_DISTANCE, l->body[2 * i].name, down, l->body[2 * i + 1].name, down);
    }
    linkage_compile(l);
}

KT_TEST(paths_that_begin_alike_are_stored_once) {
    enum { RUNGS = 20 };
    static linkage l;
    for (int upwards = 0; upwards < 2; upwards++) {
        int wrong = 0;
        build_ladder(&l, RUNGS, upwards);
        kt_check_equal_int("links on all paths", check_paths(l.model, &wrong), RUNGS * (RUNGS + 1));
        kt_check_equal_int("wrong", wrong, 0);
        kt_check_equal_int("stored", (int)l.model->n.path, 2 * RUNGS);
    }
}

KT_TEST(paths_lead_from_below_the_common_ancestor_to_each_end) {
    kt_random random = kt_random_of_test();
    const tangle_plan plan = tangle_plan_default();
    static tangle g;
    int wrong = 0, links = 0;
    for (int i = 0; i < 100; i++) {
        tangle_grow(&g, &plan, &random);
        links += check_paths(g.tree.model, &wrong);
    }
    kt_check_equal_int("wrong", wrong, 0);
    kt_check_above("links on paths", links, 1000);
}
