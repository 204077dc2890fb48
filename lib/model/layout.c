/* Memory of models and data: each list of fields in model.h is walked once, to measure or to place. */
#include "base/aligned.h"
#include "base/arena.h"
#include "model/absolute.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

size_t kt_model_layout(const kt_counts *n, char *base, kt_model *model) {
    size_t used = kt_arena_round(sizeof(kt_model));
    kt_model scrap;
    /* cppcheck-suppress uninitvar ; its address is taken, no value */
    kt_model *m = model ? model : &scrap;
#define KT_PLACE(type, name, count, meaning) m->name = (type *)kt_arena_take(base, &used, (count) * sizeof(type));
    KT_MODEL_FIELDS(KT_PLACE)
#undef KT_PLACE
    m->bytes = used;
    return used;
}

void kt_model_name_all(kt_model *m) {
    kt_names_init(&m->names, m->n.body + m->n.marker, m->index);
    for (size_t i = 0; i < m->n.body; i++) {
        const kt_body_record *b = &m->body[i];
        (void)kt_names_add(&m->names, 0, m->text + b->name, (int)i);
        for (int k = 0; k < b->marker_count; k++)
            (void)kt_names_add(&m->names, 1 + (int)i, m->text + m->marker[b->marker + k].name, k);
    }
}

void kt_model_free(kt_model *model) {
    if (!model || model->placed)
        return;
    if (model->absolute)
        kt_model_free(model->absolute->model);
    free(model->absolute);
    kt_aligned_release(model);
}

static size_t data_layout(const kt_counts *n, char *base, kt_data *data) {
    size_t used = kt_arena_round(sizeof(kt_data));
    kt_data scrap;
    /* cppcheck-suppress uninitvar ; its address is taken, no value */
    kt_data *d = data ? data : &scrap;
#define KT_PLACE(type, name, count, meaning) d->name = (type *)kt_arena_take(base, &used, (count) * sizeof(type));
    KT_DATA_FIELDS(KT_PLACE)
#undef KT_PLACE
    d->bytes = used;
    return used;
}

size_t kt_data_size(const kt_model *model) { return data_layout(&model->n, NULL, NULL); }

kt_status kt_data_init(const kt_model *model, void *memory, size_t size, kt_data **data, kt_error *error) {
    const size_t needed = kt_data_size(model);
    if (!kt_arena_fits(memory, size, needed))
        return kt_arena_refuse("kt_data_init", "kt_data_size", memory, size, needed, error);
    kt_data *d = (kt_data *)memory;
    memset(memory, 0, needed);
    data_layout(&model->n, (char *)memory, d);
    d->model = model;
    *data = d;
    return KT_OK;
}

kt_status kt_data_create(const kt_model *model, kt_data **data, kt_error *error) {
    const size_t size = kt_data_size(model);
    void *memory = kt_aligned_allocate(size);
    if (!memory)
        return kt_error_set(error, KT_ERROR_MEMORY, "", "%zu bytes for the data cannot be had", size);
    const kt_status status = kt_data_init(model, memory, size, data, error);
    if (status == KT_OK)
        (*data)->owned = memory;
    else
        kt_aligned_release(memory);
    return status;
}

void kt_data_free(kt_data *data) {
    if (data)
        kt_aligned_release(data->owned);
}

kt_iterations kt_data_iterations(kt_data *data) {
    const kt_iterations none = {0, 0, 0, 0}, seen = data->iterations;
    data->iterations = none;
    return seen;
}
