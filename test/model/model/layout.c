/* Memory of models and workspaces: its size, its alignment, its ends. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/dynamics/tree.h"

#include "model/model.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { GUARD = 256 };

static void make(kt_tree *tree) {
    kt_random random = kt_random_of_test();
    const kt_tree_plan plan = kt_tree_plan_default();
    kt_tree_grow(tree, &plan, &random);
}

static unsigned char *take(size_t size) {
    unsigned char *memory = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    if (!memory)
        abort();
    return memory;
}

KT_TEST(memory_that_is_too_small_or_misaligned_is_rejected) {
    kt_tree tree;
    make(&tree);
    const size_t size = kt_data_size(tree.model);
    unsigned char *memory = take(size + KT_ALIGNMENT);
    kt_data *data = NULL;
    kt_error e;
    memset(memory, 0xAB, size + KT_ALIGNMENT);
    kt_check_equal_int("a byte short", kt_data_init(tree.model, memory, size - 1, &data, &e), KT_ERROR_MEMORY);
    kt_check_text("where", e.where, "kt_data_init");
    kt_check_contains("message", e.message, "are needed (kt_data_size)");
    kt_check_equal_int("nothing", kt_data_init(tree.model, memory, 0, &data, &e), KT_ERROR_MEMORY);
    for (int shift = 1; shift < KT_ALIGNMENT; shift *= 2) {
        kt_check_equal_int("misaligned", kt_data_init(tree.model, memory + shift, size, &data, &e), KT_ERROR_MEMORY);
        kt_check_contains("message", e.message, "bytes, misaligned");
    }
    kt_check_equal_int("no memory", kt_data_init(tree.model, NULL, size, &data, &e), KT_ERROR_MEMORY);
    kt_check_true("no data", data == NULL);
    int touched = 0;
    for (size_t i = 0; i < size + KT_ALIGNMENT; i++)
        touched += memory[i] != 0xAB;
    kt_check_equal_int("bytes touched", touched, 0);
    kt_check_equal_int("as much as it takes", kt_data_init(tree.model, memory, size, &data, &e), KT_OK);
    kt_data_free(data); /* the memory is not its own */
    free(memory);
}

KT_TEST(data_in_memory_of_the_caller_are_as_good_and_stay_within_it) {
    kt_tree tree;
    kt_random random = kt_random_of_test();
    kt_tree_state s;
    double a[KT_TREE_NV], b[KT_TREE_NV];
    kt_error e;
    make(&tree);
    kt_tree_state_draw(&tree, &random, &s);
    kt_tree_forward(&tree, &s, a);
    kt_test_release(tree.data);
    const size_t size = kt_data_size(tree.model);
    unsigned char *memory = take(size + 2 * GUARD);
    memset(memory, 0xAB, size + 2 * GUARD);
    kt_need(kt_check_equal_int("placed", kt_data_init(tree.model, memory + GUARD, size, &tree.data, &e), KT_OK));
    kt_check_true("it begins there", (unsigned char *)tree.data == memory + GUARD);
    kt_tree_forward(&tree, &s, b);
    kt_tree_inverse(&tree, &s, s.tau);
    kt_tree_kinematics(&tree, &s);
    kt_check_equal_bits("accelerations", b, a, (size_t)tree.nv);
    int touched = 0;
    for (int i = 0; i < GUARD; i++)
        touched += (memory[i] != 0xAB) + (memory[GUARD + size + (size_t)i] != 0xAB);
    kt_check_equal_int("bytes touched next to it", touched, 0);
    kt_data_free(tree.data); /* leaves the caller's memory alone */
    tree.data = NULL;
    free(memory);
}

/* Each array begins on a cache line, after the end of the one before. */
/* NOLINTNEXTLINE(readability-function-size): one list, unrolled by the macro */
KT_TEST(arrays_of_model_and_data_are_aligned_and_apart) {
    kt_tree tree;
    make(&tree);
    const kt_model *m = tree.model;
    const kt_data *d = tree.data;
    const kt_counts *n = &m->n;
    int misaligned = 0, overlapping = 0;
    uintptr_t end = (uintptr_t)m + sizeof *m;
#define LOOK(type, name, count, meaning)                                                                               \
    misaligned += (uintptr_t)m->name % KT_ALIGNMENT != 0;                                                              \
    overlapping += (uintptr_t)m->name < end;                                                                           \
    end = (uintptr_t)m->name + (count) * sizeof(type);
    KT_MODEL_FIELDS(LOOK)
#undef LOOK
    kt_check_true("the model ends within its size", end <= (uintptr_t)m + kt_model_size(m));
    end = (uintptr_t)d + sizeof *d;
#define LOOK(type, name, count, meaning)                                                                               \
    misaligned += (uintptr_t)d->name % KT_ALIGNMENT != 0;                                                              \
    overlapping += (uintptr_t)d->name < end;                                                                           \
    end = (uintptr_t)d->name + (count) * sizeof(type);
    KT_DATA_FIELDS(LOOK)
#undef LOOK
    kt_check_true("the data end within their size", end <= (uintptr_t)d + kt_data_size(m));
    kt_check_equal_int("misaligned arrays", misaligned, 0);
    kt_check_equal_int("overlapping arrays", overlapping, 0);
    kt_check_equal_int("size of data, in cache lines", (long long)(kt_data_size(m) % KT_ALIGNMENT), 0);
}

KT_TEST(releasing_nothing_is_fine) {
    kt_data_free(NULL);
    kt_model_free(NULL);
    kt_check_true("still here", true);
}

/* ---- bytes a body ------------------------------------------------------------------------------------------------ */

/* Bytes a link of a chain of n revolute joints, in space or in a plane. */
typedef struct bytes {
    double model, data;
} bytes;

static bytes bytes_a_link(int n, bool planar) {
    kt_body *bodies = calloc((size_t)n, sizeof *bodies);
    char(*names)[16] = calloc((size_t)n, sizeof *names);
    kt_description d = kt_description_default();
    bytes link = {(double)NAN, (double)NAN};
    if (!bodies || !names)
        abort();
    for (int i = 0; i < n; i++) {
        snprintf(names[i], sizeof names[i], "b%d", i);
        bodies[i] = kt_body_of(names[i], i ? names[i - 1] : NULL, KT_JOINT_REVOLUTE, 1.0);
        bodies[i].joint.axis = planar ? kt_vec3_make(0.0, 0.0, 1.0) : kt_vec3_make(i % 3 == 0, i % 3 == 1, i % 3 == 2);
        bodies[i].com = kt_vec3_make(0.1, 0.2, 0.3);
        bodies[i].inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    }
    kt_describe(&d, bodies, n, NULL, 0, NULL, 0);
    kt_model *model = kt_test_model(&d, NULL);
    link = (bytes){(double)kt_model_size(model) / n, (double)kt_data_size(model) / n};
    free(bodies);
    free(names);
    return link;
}

/* In the model, a body takes 312 bytes and a link 232 bytes. A planar link takes 184 more. Memory for links with
 * several children, joints of several degrees of freedom, or loops is not there: it was 500 more. Neither is memory for
 * kinematics of a reaction or a power: 216 more. */
KT_TEST(data_of_a_link_of_a_chain_take_no_more_than_1100_bytes) {
    for (int i = 0; i < 4; i++) {
        const bool planar = i % 2;
        const bytes link = bytes_a_link(i / 2 ? 20000 : 100, planar);
        kt_check_below(planar ? "data in a plane" : "data in space", link.data, planar ? 1030.0 : 800.0);
        kt_check_below(planar ? "model in a plane" : "model in space", link.model, planar ? 960.0 : 700.0);
    }
}
