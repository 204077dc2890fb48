/* Copies of models in the caller's memory: as good as the original, complete, and within their bytes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "files/scene/collect.h"

#include "kinetree/mechanism.h"
#include "kinetree/scene.h"
#include "kinetree/simulation.h"
#include "model/model.h"

#include <stdlib.h>
#include <string.h>

enum { GUARD = 4 * KT_ALIGNMENT, MOST = 512 };

typedef struct motion {
    double a[MOST];
    kt_wrench joints[MOST];
} motion;

/* The accelerations of the start with the contacts that a simulation finds there. */
static kt_status simulate_start(const kt_model *model, double *a, kt_error *error) {
    const kt_run run = kt_run_default();
    kt_simulation *simulation = NULL;
    kt_status status = kt_simulation_create(model, &run, NULL, &simulation, error);
    if (status == KT_OK)
        status = kt_simulation_acceleration(simulation, a, error);
    kt_simulation_free(simulation);
    return status;
}

static void move(const kt_model *model, motion *m) {
    double q[MOST], v[MOST];
    kt_data *data = NULL;
    kt_error e;
    kt_need(kt_check_true("small enough", kt_model_nq(model) <= MOST && kt_model_body_count(model) <= MOST));
    memset(m, 0, sizeof *m);
    kt_model_initial(model, q, v);
    kt_status status = kt_data_create(model, &data, &e);
    if (status == KT_OK)
        status = kt_state_assemble(model, data, 0.0, q, v, &e);
    if (status == KT_OK)
        status = kt_acceleration_evaluate(model, data, 0.0, q, v, NULL, NULL, m->a, &e);
    if (status == KT_ERROR_UNSUPPORTED) /* an open contact touches */
        status = simulate_start(model, m->a, &e);
    else if (status == KT_OK)
        status = kt_reaction_evaluate(model, data, 0.0, q, v, NULL, NULL, m->joints, NULL, &e);
    kt_data_free(data);
    (void)kt_fine("motion", status, &e);
}

static int misnamed(const kt_model *model, const kt_description *description) {
    int wrong = 0;
    for (int b = 1; b < kt_model_body_count(model); b++) {
        const kt_body *body = &description->bodies[kt_body_source(model, b)];
        wrong += strcmp(kt_body_name(model, b), body->name) != 0 || kt_body_find(model, body->name) != b;
        for (int k = 0; k < body->marker_count; k++)
            wrong += kt_marker_find(model, b, body->markers[k].name) != k;
    }
    return wrong;
}

/* A copy and a copy of the copy, where the original and then the first copy are no more. */
static bool stands_alone(kt_model *model, const kt_description *description) {
    static motion tree, moved;
    const size_t size = kt_model_size(model);
    unsigned char *first = aligned_alloc(KT_ALIGNMENT, size), *second = aligned_alloc(KT_ALIGNMENT, size + 2 * GUARD);
    kt_model *copy = NULL, *again = NULL;
    kt_error e;
    int touched = 0;
    move(model, &tree);
    memset(second, 0xAB, size + 2 * GUARD);
    kt_need_fine("copy", kt_model_copy(model, first, size, &copy, &e), &e);
    /* A model with switches is one of several in a block, of which it is not the first. */
    const size_t own = kt_switch_count(model) == 0 ? size : 0;
    void *kept = malloc(size);
    memcpy(kept, model, own);
    memset(model, 0xAB, own);
    kt_need_fine("copy of a copy", kt_model_copy(copy, second + GUARD, size, &again, &e), &e);
    memset(first, 0xAB, size);
    kt_check_equal_int("misnamed", misnamed(again, description), 0);
    move(again, &moved);
    kt_check_equal_bits("motion", moved.a, tree.a, sizeof tree / sizeof(double));
    kt_check_true("the model of its set", kt_model_switched(again, kt_switch_set(again)) == again);
    kt_check_equal_int("bytes", (long long)kt_model_size(again), (long long)size);
    for (size_t k = 0; k < GUARD; k++)
        touched += (second[k] != 0xAB) + (second[GUARD + size + k] != 0xAB);
    kt_check_equal_int("bytes touched next to it", touched, 0);
    memcpy(model, kept, own);
    free(kept);
    kt_model_free(again); /* nothing */
    free(first);
    free(second);
    return again != NULL;
}

KT_TEST(copies_of_all_scenes_move_as_their_originals_do) {
    int compared = 0;
    for (int i = 0; kt_bundled(i) != NULL; i++) {
        const kt_description *description = &kt_test_bundled(kt_bundled(i))->description;
        if (description->body_count < MOST / 8)
            compared += stands_alone(kt_test_model(description, NULL), description);
    }
    kt_check_above("scenes compared", compared, 40);
}

KT_TEST(memory_that_is_too_small_or_misaligned_is_rejected) {
    kt_model *model = NULL, *copy = NULL;
    kt_error e;
    kt_body body = kt_body_of("rod", NULL, KT_JOINT_REVOLUTE, 1.0);
    body.inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    kt_description description = kt_description_of(&body, 1, NULL, 0, NULL, 0);
    model = kt_test_model(&description, NULL);
    const size_t size = kt_model_size(model);
    unsigned char *memory = aligned_alloc(KT_ALIGNMENT, size + KT_ALIGNMENT);
    memset(memory, 0xAB, size + KT_ALIGNMENT);
    kt_check_equal_int("a byte short", kt_model_copy(model, memory, size - 1, &copy, &e), KT_ERROR_MEMORY);
    kt_check_text("where", e.where, "kt_model_copy");
    kt_check_contains("message", e.message, "are needed (kt_model_size)");
    for (int shift = 1; shift < KT_ALIGNMENT; shift *= 2)
        kt_check_equal_int("misaligned", kt_model_copy(model, memory + shift, size, &copy, &e), KT_ERROR_MEMORY);
    kt_check_contains("message", e.message, "bytes, misaligned");
    kt_check_equal_int("no memory", kt_model_copy(model, NULL, size, &copy, &e), KT_ERROR_MEMORY);
    int touched = 0;
    for (size_t i = 0; i < size + KT_ALIGNMENT; i++)
        touched += memory[i] != 0xAB;
    kt_check_equal_int("bytes touched", touched, 0);
    kt_check_true("no copy", copy == NULL);
    kt_check_equal_int("as much as it takes", kt_model_copy(model, memory, size, &copy, &e), KT_OK);
    kt_model_free(copy); /* the memory is not its own */
    free(memory);
}
