/* Each allocation of a builder fails once. The call says so and adds nothing. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "interpose.h"

#include "kinetree/build.h"

/* Builds everything with the n-th allocation failing. Returns the number of calls that failed. */
static int build_all(long n, int *wrong) {
    kt_builder *builder = NULL;
    kt_error e = {0};
    kt_beam beam = kt_beam_default();
    kt_link_tree tree = kt_link_tree_default();
    const kt_body body = kt_body_default();
    const kt_loop loop = kt_loop_default();
    const kt_effect effect = kt_effect_default();
    beam.name = "a-beam-with-a-long-name-that-takes-more-than-one-piece-of-memory-for-all-of-its-segments-and-joints";
    beam.segments = 40;
    beam.length = beam.mass.value = beam.EI[1].value = 1.0;
    beam.ends[1] = KT_BEAM_HINGED;
    beam.to.at.x = 0.9;
    tree.name = beam.name;
    tree.count = 60;
    kt_interpose_start_failing(n);
    kt_status status[6] = {kt_builder_create(&builder, &e)};
    int bodies = 0, failures = status[0] != KT_OK;
    if (status[0] == KT_OK) {
        status[1] = kt_builder_add_body(builder, &body, &e);
        status[2] = kt_builder_add_loop(builder, &loop, &e);
        status[3] = kt_builder_add_effect(builder, &effect, &e);
        status[4] = kt_builder_add_beam(builder, &beam, &e);
        status[5] = kt_builder_add_tree(builder, &tree, &e);
        const int added[6] = {0, 1, 0, 0, 40, 60};
        for (int i = 1; i < 6; i++) {
            failures += status[i] != KT_OK;
            bodies += status[i] == KT_OK ? added[i] : 0;
            *wrong += status[i] != KT_OK && status[i] != KT_ERROR_MEMORY;
        }
        *wrong += kt_builder_describe(builder).body_count != bodies;
    } else {
        *wrong += status[0] != KT_ERROR_MEMORY;
    }
    kt_builder_free(builder);
    (void)kt_interpose_stop();
    return failures;
}

KT_TEST(each_failing_allocation_is_an_error_that_adds_nothing) {
    int wrong = 0, unreported = 0;
    long n = 1;
    for (bool failed = true; failed && n < 1000; n++) {
        const int failures = build_all(n, &wrong);
        failed = kt_interpose_has_failed();
        unreported += failed != (failures == 1);
    }
    kt_check_above("allocations that were made to fail", (double)(n - 2), 8.0);
    kt_check_equal_int("failures that did not end one call", unreported, 0);
    kt_check_equal_int("wrong statuses, or bodies of a call that failed", wrong, 0);
}
