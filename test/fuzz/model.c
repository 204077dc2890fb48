/* The check of descriptions and the compiler of models. The description is at least readable memory. Either both reject
 * it with the same message, or the model is whole. A right description can be written as a scene, and read again.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "fuzz.h"
#include "kinetree/mechanism.h"
#include "kinetree/scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct heard {
    const kt_description *description;
    int count;
    kt_error first;
} heard;

static void listen(void *user, const kt_place *place, const kt_error *fault) {
    heard *h = user;
    const kt_description *d = h->description;
    const int counts[] = {1, d->body_count, d->loop_count, d->effect_count, d->hold_count};
    if (h->count++ == 0)
        h->first = *fault;
    kt_fuzz_must(place->item <= KT_ITEM_HOLD && place->index >= 0 && place->field != NULL, "a fault has a place");
    kt_fuzz_must(place->item == KT_ITEM_SCENE || place->index < counts[place->item], "the place exists: %d of %d",
                 place->index, counts[place->item]);
    kt_fuzz_must(memchr(fault->where, '\0', KT_WHERE_SIZE) != NULL && fault->where[0] != '\0', "it has words");
    kt_fuzz_must(memchr(fault->message, '\0', KT_MESSAGE_SIZE) != NULL && fault->message[0] != '\0', "it has words");
}

static bool all_finite(const double *x, int count) {
    for (int i = 0; i < count; i++)
        if (!isfinite(x[i]))
            return false;
    return true;
}

/* Names, indices and sizes agree. */
static void check_model(const kt_description *d, const kt_model *model) {
    const int count = kt_model_body_count(model), nq = kt_model_nq(model), nv = kt_model_nv(model);
    double *q = malloc(sizeof *q * (size_t)(nq + 1)), *v = malloc(sizeof *v * (size_t)(nv + 1));
    kt_fuzz_must(count == d->body_count + 1, "every body is there");
    kt_fuzz_must(q != NULL && v != NULL, "there is memory");
    int positions = 0, velocities = 0;
    for (int b = 0; b < count; b++) {
        const kt_coordinates c = kt_body_coordinates(model, b);
        kt_fuzz_must(b == 0 || kt_body_parent(model, b) < b, "parents come first");
        kt_fuzz_must(kt_body_find(model, kt_body_name(model, b)) == b, "a body is found by its name");
        kt_fuzz_must(b == 0 || strcmp(kt_body_name(model, b), d->bodies[kt_body_source(model, b)].name) == 0,
                     "a body comes from where it says");
        positions += c.nq;
        velocities += c.nv;
    }
    kt_fuzz_must(positions == nq && velocities == nv, "coordinates add up");
    kt_model_initial(model, q, v);
    kt_fuzz_must(all_finite(q, nq) && all_finite(v, nv), "the initial state is finite");
    const kt_mobility f = kt_model_mobility(model);
    kt_fuzz_must(f.tree == nv && f.rank >= 0 && f.rank <= f.equations && f.rank <= nv && f.minimal == f.tree - f.rank,
                 "freedoms add up: %d tree, %d equations, %d rank", f.tree, f.equations, f.rank);
    kt_fuzz_must(kt_loop_count(model) == d->loop_count, "every loop is there");
    free(q);
    free(v);
}

/* Data of exactly the size that the model requires, and less. */
static void check_data(const kt_model *model) {
    kt_data *data = NULL;
    const size_t size = kt_data_size(model);
    void *memory = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    kt_fuzz_must(memory != NULL, "there is memory");
    kt_fuzz_must(kt_data_init(model, memory, size - 1, &data, NULL) == KT_ERROR_MEMORY && data == NULL,
                 "too little memory is rejected");
    kt_fuzz_must(kt_data_init(model, memory, size, &data, NULL) == KT_OK, "memory of the size told will do");
    free(memory);
}

static void write_and_read(const kt_description *d) {
    kt_scene scene = kt_scene_default(), again;
    char *text = NULL;
    size_t size = 0;
    kt_error error;
    scene.description = *d;
    FILE *stream = open_memstream(&text, &size);
    kt_fuzz_must(stream != NULL, "there is memory");
    kt_status status = kt_scene_write(&scene, stream, &error);
    (void)fclose(stream);
    kt_fuzz_must(status == KT_OK, "a right description is written: %s: %s", error.where, error.message);
    status = kt_scene_parse("again.yaml", text, size, &again, NULL, NULL, &error);
    kt_fuzz_must(status == KT_OK, "what was written is read: %s: %s\n%.4000s", error.where, error.message, text);
    free(text);
    kt_scene_free(&again);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static kt_fuzz_mechanism m;
    kt_bytes bytes = {data, data + size};
    kt_error error = {KT_OK, "", ""}, told = {KT_OK, "", ""};
    kt_model *model = NULL;
    kt_formulation formulation;
    const kt_model_options options = kt_fuzz_options(&bytes, &formulation);
    kt_fuzz_describe(&bytes, &m);
    heard faults = {.description = &m.description};
    const kt_status checked = kt_description_check(&m.description, listen, &faults, &told);
    kt_fuzz_must((checked == KT_OK) == (faults.count == 0), "faults are told where there are some");
    kt_fuzz_must(checked == KT_OK || strcmp(told.message, faults.first.message) == 0, "the first is the error");
    const kt_status compiled = kt_model_compile(&m.description, &options, &model, &error);
    /* Only the compiler detects whether a joint moves inertia, and the forces on a joint that moves none. It also
     * detects whether a loop's ends are on one rigid part. */
    kt_fuzz_must(compiled == checked || (checked == KT_OK && error.message[0] != '\0' &&
                                         (compiled == KT_ERROR_MODEL || compiled == KT_ERROR_NOT_FINITE || m.custom)),
                 "the compiler takes what the check takes (%d, %d): %s: %s", (int)checked, (int)compiled, error.where,
                 error.message);
    kt_fuzz_must((model != NULL) == (compiled == KT_OK), "there is a model where there is no error");
    kt_fuzz_must(checked == KT_OK || (strcmp(told.message, error.message) == 0 && strcmp(told.where, error.where) == 0),
                 "check and compiler have the same words: %s / %s", told.message, error.message);
    if (checked == KT_OK && !m.custom)
        write_and_read(&m.description);
    if (compiled != KT_OK)
        return 0;
    check_model(&m.description, model);
    check_data(model);
    kt_absolute *absolute = kt_fuzz_absolute(&m.description, &options, model, formulation);
    if (absolute != NULL)
        check_data(kt_absolute_model(absolute));
    kt_absolute_free(absolute);
    kt_model_free(model);
    return 0;
}
