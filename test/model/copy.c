/* Copies of models in the caller's memory: as good as the original, complete, and within their bytes. */
#include "check.h"

#include "kinetree/reduction.h"
#include "kinetree/scene.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { GUARD = 4 * KT_ALIGNMENT, MOST = 512 };

static bool fine(const char *what, kt_status status, const kt_error *error) {
    if (status != KT_OK)
        kt_note("%s: %s", error->where, error->message);
    return kt_check_equal_int(what, status, KT_OK);
}

static int is_scene(const struct dirent *entry) {
    const size_t length = strlen(entry->d_name);
    return length > 5 && strcmp(entry->d_name + length - 5, ".yaml") == 0;
}

/* The original's memory is not the test's; so a copy of a copy, with the first one overwritten. */
typedef struct copies {
    size_t size;
    unsigned char *first, *second;
    kt_model *model;
} copies;

static bool copy_twice(const kt_model *model, copies *c) {
    kt_error e;
    kt_model *first = NULL;
    c->size = kt_model_size(model);
    c->first = aligned_alloc(KT_ALIGNMENT, c->size);
    c->second = aligned_alloc(KT_ALIGNMENT, c->size + 2 * GUARD);
    c->model = NULL;
    if (!kt_check_true("memory", c->first && c->second))
        return false;
    memset(c->second, 0xAB, c->size + 2 * GUARD);
    if (!fine("copy", kt_model_copy(model, c->first, c->size, &first, &e), &e) ||
        !fine("copy of a copy", kt_model_copy(first, c->second + GUARD, c->size, &c->model, &e), &e))
        return false;
    memset(c->first, 0xAB, c->size);
    return true;
}

static void release(copies *c) {
    kt_model_free(c->model); /* nothing */
    free(c->first);
    free(c->second);
}

/* Where a model has fewer bodies or coordinates than MOST. */
static bool motion(const kt_model *model, double *a, kt_wrench *joints) {
    double q[MOST], v[MOST];
    kt_data *data = NULL;
    kt_error e;
    if (kt_model_nq(model) > MOST || kt_model_body_count(model) > MOST)
        return false;
    kt_model_initial(model, q, v);
    if (!fine("data", kt_data_create(model, &data, &e), &e))
        return false;
    kt_status status = kt_state_assemble(model, data, 0.0, q, v, &e);
    if (status == KT_OK)
        status = kt_acceleration_evaluate(model, data, 0.0, q, v, NULL, NULL, a, &e);
    if (status == KT_OK)
        status = kt_reaction_evaluate(model, data, 0.0, q, v, NULL, NULL, joints, NULL, &e);
    kt_data_free(data);
    return fine("motion", status, &e);
}

static int misnamed(const kt_model *model, const kt_model *copy) {
    int wrong = strcmp(kt_model_name(model), kt_model_name(copy)) != 0;
    for (int b = 0; b < kt_model_body_count(model); b++) {
        wrong += strcmp(kt_body_name(model, b), kt_body_name(copy, b)) != 0;
        wrong += kt_body_find(copy, kt_body_name(model, b)) != b;
        for (int k = 0; k < kt_marker_count(model, b); k++)
            wrong += kt_marker_find(copy, b, kt_marker_name(model, b, k)) != k;
    }
    return wrong;
}

static bool same(const char *what, const kt_model *model, const kt_model *copy) {
    static double a[MOST], b[MOST];
    static kt_wrench f[MOST], g[MOST];
    kt_check_equal_int(what, misnamed(model, copy), 0);
    if (!motion(model, a, f) || !motion(copy, b, g))
        return false;
    kt_check_equal_bits("accelerations", b, a, (size_t)kt_model_nv(model));
    return kt_check_equal_bits("reactions", &g[0].moment.x, &f[0].moment.x, 6 * (size_t)kt_model_body_count(model));
}

KT_TEST(copies_of_all_scenes_move_as_their_originals_do) {
    struct dirent **entries = NULL;
    const int count = scandir(KT_SCENES, &entries, is_scene, alphasort);
    int compared = 0;
    for (int i = 0; i < count; i++) {
        char path[1024];
        kt_scene scene;
        kt_error e;
        kt_model *model = NULL;
        kt_model_options options = kt_model_options_default();
        copies c;
        options.formulation = KT_FORMULATION_ABSOLUTE;
        snprintf(path, sizeof path, "%s/%s", KT_SCENES, entries[i]->d_name);
        if (fine(entries[i]->d_name, kt_scene_read(path, &scene, NULL, NULL, &e), &e)) {
            if (scene.description.body_count < MOST / 8 &&
                fine("compiles", kt_model_compile(&scene.description, &options, &model, &e), &e)) {
                int touched = 0;
                if (copy_twice(model, &c)) {
                    compared += same(entries[i]->d_name, model, c.model);
                    same("absolute", kt_model_absolute(model), kt_model_absolute(c.model));
                    for (size_t k = 0; k < GUARD; k++)
                        touched += (c.second[k] != 0xAB) + (c.second[GUARD + c.size + k] != 0xAB);
                    kt_check_equal_int("bytes touched beside it", touched, 0);
                    kt_check_equal_int("bytes", (long long)kt_model_size(c.model), (long long)c.size);
                }
                release(&c);
                kt_model_free(model);
            }
            kt_scene_free(&scene);
        }
        free(entries[i]);
    }
    free(entries);
    kt_check_above("scenes compared", compared, 40);
}

KT_TEST(memory_that_is_too_small_or_misaligned_is_refused) {
    kt_body body = kt_body_default();
    kt_description description = kt_description_default();
    kt_model *model = NULL, *copy = NULL;
    kt_error e;
    body.name = "rod";
    body.mass = 1.0;
    body.inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    body.joint.type = KT_JOINT_REVOLUTE;
    description.bodies = &body;
    description.body_count = 1;
    if (!fine("compiles", kt_model_compile(&description, NULL, &model, &e), &e))
        return;
    const size_t size = kt_model_size(model);
    unsigned char *memory = aligned_alloc(KT_ALIGNMENT, size + KT_ALIGNMENT);
    memset(memory, 0xAB, size + KT_ALIGNMENT);
    kt_check_equal_int("a byte short", kt_model_copy(model, memory, size - 1, &copy, &e), KT_ERROR_MEMORY);
    kt_check_text("where", e.where, "kt_model_copy");
    kt_check_contains("message", e.message, "are needed (kt_model_size)");
    for (int shift = 1; shift < KT_ALIGNMENT; shift *= 2)
        kt_check_equal_int("misaligned", kt_model_copy(model, memory + shift, size, &copy, &e), KT_ERROR_MEMORY);
    kt_check_contains("message", e.message, "aligned to 64 bytes");
    kt_check_equal_int("no memory", kt_model_copy(model, NULL, size, &copy, &e), KT_ERROR_MEMORY);
    int touched = 0;
    for (size_t i = 0; i < size + KT_ALIGNMENT; i++)
        touched += memory[i] != 0xAB;
    kt_check_equal_int("bytes touched", touched, 0);
    kt_check_true("no copy", copy == NULL);
    kt_check_equal_int("as much as it takes", kt_model_copy(model, memory, size, &copy, &e), KT_OK);
    kt_model_free(copy); /* the memory is not its own */
    free(memory);
    kt_model_free(model);
}
