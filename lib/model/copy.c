/* Copies of a compiled model in the caller's memory.
 *
 * A model is one block: the struct, then the arrays of KT_MODEL_FIELDS, each at an offset that follows from the counts
 * alone. A copy therefore has the block's bytes, and the function that laid out the original sets the pointers of the
 * copy to its own arrays. Arrays contain indices and offsets but no pointers, with two exceptions: the table of names,
 * which is made again, and the user pointers of custom effects, which are kept. If there is an absolute formulation,
 * its joints and its own model follow.
 */
#include "base/arena.h"
#include "model/absolute.h"

#include <stdint.h>
#include <string.h>

static size_t joints_size(const kt_model *model) {
    return kt_arena_round(sizeof(struct kt_absolute) + model->n.body * sizeof(kt_absolute_joint));
}

size_t kt_model_size(const kt_model *model) {
    return model->absolute ? model->bytes + joints_size(model) + kt_model_size(model->absolute->model) : model->bytes;
}

static kt_model *copy_at(const kt_model *model, char *memory) {
    kt_model *m = (kt_model *)memory;
    memcpy(memory, model, model->bytes);
    (void)kt_model_layout(memory, &model->n);
    kt_model_name_all(m);
    m->placed = true;
    if (model->absolute) {
        char *joints = memory + model->bytes;
        memcpy(joints, model->absolute, sizeof(struct kt_absolute) + model->n.body * sizeof(kt_absolute_joint));
        m->absolute = (struct kt_absolute *)joints;
        m->absolute->model = copy_at(model->absolute->model, joints + joints_size(model));
    }
    return m;
}

kt_status kt_model_copy(const kt_model *model, void *memory, size_t size, kt_model **copy, kt_error *error) {
    const size_t needed = kt_model_size(model);
    const kt_status status = kt_arena_check("kt_model_copy", "kt_model_size", memory, size, needed, error);
    if (status == KT_OK)
        *copy = copy_at(model, (char *)memory);
    return status;
}
