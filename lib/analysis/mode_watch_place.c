/* Laying a watch on the fastest mode out in memory. */
#include "analysis/mode_watch.h"

#include "analysis/analysis.h"
#include "base/aligned.h"
#include "base/arena.h"

#include <string.h>

static size_t lay_out(const kt_model *model, void *memory) {
    kt_mode_watch scratch;
    const size_t nq = (size_t)kt_model_nq(model), nv = (size_t)kt_model_nv(model);
    size_t used = 0;
    kt_mode_watch *w = kt_arena_take(memory, &used, sizeof *w);
    if (w == NULL)
        w = &scratch;
#define KT_MODE_WATCH_PLACE(type, name, count, meaning) w->name = kt_arena_take(memory, &used, (count) * sizeof(type));
    KT_MODE_WATCH_FIELDS(KT_MODE_WATCH_PLACE)
#undef KT_MODE_WATCH_PLACE
    return used;
}

size_t kt_mode_watch_size(const kt_model *model) { return lay_out(model, NULL); }

kt_status kt_mode_watch_place(const kt_model *model, void *memory, size_t size, kt_mode_watch **watch,
                              kt_error *error) {
    const size_t needed = lay_out(model, NULL);
    if (!kt_arena_fits(memory, size, needed))
        return kt_arena_refuse("kt_mode_watch_place", "kt_mode_watch_size", memory, size, needed, error);
    memset(memory, 0, needed);
    (void)lay_out(model, memory);
    kt_mode_watch *w = memory;
    w->model = model;
    w->nq = (size_t)kt_model_nq(model);
    w->nv = (size_t)kt_model_nv(model);
    w->scale = 1.0;
    kt_independent_coordinates_units(model, w->unit);
    const kt_status status = kt_data_init(model, w->data_memory, kt_data_size(model), &w->data, error);
    if (status == KT_OK) /* GCOVR_EXCL_BR_LINE: its memory is laid out as it asks for */
        *watch = w;
    return status;
}

kt_status kt_mode_watch_create(const kt_model *model, kt_mode_watch **watch, kt_error *error) {
    const size_t needed = kt_mode_watch_size(model);
    void *memory = kt_aligned_allocate(needed);
    kt_mode_watch *placed = NULL;
    if (memory == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, NULL, "%zu bytes for a watch on modes cannot be allocated", needed);
    const kt_status status = kt_mode_watch_place(model, memory, needed, &placed, error);
    if (placed == NULL) {           /* GCOVR_EXCL_BR_LINE: its memory is as it asks for */
        kt_aligned_release(memory); /* GCOVR_EXCL_LINE */
        return status;              /* GCOVR_EXCL_LINE */
    }
    placed->owned = memory;
    *watch = placed;
    return KT_OK;
}

void kt_mode_watch_free(kt_mode_watch *watch) {
    if (watch != NULL)
        kt_aligned_release(watch->owned);
}
