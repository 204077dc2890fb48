/* Memory of models and data, laid out by the lists of fields in model.h. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/aligned.h"
#include "base/arena.h"
#include "base/copy.h"
#include "model/follow.h"
#include "model/model.h"
#include "model/switching.h"

#include <string.h>

KT_ARENA_LAYOUT(lay_out_model, kt_model, KT_MODEL_FIELDS, const kt_counts *n)
/* NOLINTNEXTLINE(readability-function-size): it is one list of fields, of four statements each */
KT_ARENA_LAYOUT(lay_out_data, kt_data, KT_DATA_FIELDS, const kt_counts *n)

/* FNV-1a over the lengths of all arrays of the data: two models with equal lengths can use the same data. Arrays
 * within `slip_work` follow from the sizes of islands. */
static uint64_t shape_of(const kt_counts *n) {
    uint64_t hash = 14695981039346656037U;
#define KT_ARENA_HASH(type, name, count, meaning) hash = (hash ^ (uint64_t)(count)) * 1099511628211U;
    KT_DATA_FIELDS(KT_ARENA_HASH)
    KT_ARENA_HASH(size_t, island_v, n->island_v, "of an island, the most")
    KT_ARENA_HASH(size_t, island_row, n->island_row, "likewise")
#undef KT_ARENA_HASH
    return hash;
}

size_t kt_model_layout(void *memory, const kt_counts *n) {
    const size_t bytes = lay_out_model(memory, n);
    kt_model *model = memory;
    if (model) {
        model->bytes = bytes;
        model->to_planar = 1 - (int32_t)n->spatial;
    }
    return bytes;
}

/* FNV-1a over the inputs of the lists of contacts that slip (evaluate/slip_islands.c). */
static uint64_t hash_of_slips(const kt_model *model) {
    uint64_t hash = 14695981039346656037U;
    for (size_t i = 0; i < model->n.loop; i++) {
        const kt_loop_record *loop = &model->loop[i];
        const int32_t parts[] = {(int32_t)i, loop->slips, loop->group,
                                 loop->group < 0 ? -1 : model->group[loop->group].island};
        for (size_t k = 0; loop->slips > 0 && k < sizeof parts / sizeof *parts; k++)
            hash = (hash ^ (uint32_t)parts[k]) * 1099511628211U;
    }
    for (size_t k = 0; k < model->n.effect + model->n.effect_off; k++)
        hash = (hash ^ (uint32_t)model->effect[k].source) * 1099511628211U;
    return hash;
}

static uint64_t hash_word(uint64_t hash, uint64_t word) {
    hash = (hash ^ word) * 1099511628211U;
    return hash ^ hash >> 29; /* a product moves bits to higher places only */
}

static uint64_t hash_numbers(uint64_t hash, const void *x, size_t bytes) {
    for (size_t i = 0; i < bytes / sizeof(uint64_t); i++) {
        uint64_t bits;
        memcpy(&bits, (const char *)x + i * sizeof bits, sizeof bits);
        hash = hash_word(hash, bits);
    }
    return hash;
}

static uint64_t hash_curve(uint64_t hash, const kt_curve *curve) {
    const double numbers[] = {curve->a, curve->b, curve->c, curve->d};
    return hash_numbers(hash_word(hash, (uint64_t)curve->type), numbers, sizeof numbers);
}

/* The numbers of a link and a body precede all other members (record.h). */
static uint64_t hash_tree(uint64_t hash, const kt_model *model) {
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        hash = hash_numbers(hash, link, offsetof(kt_link, parent));
        hash = hash_word(hash, (uint64_t)link->parent << 16 | (uint64_t)link->motion << 8 | link->axis);
        if (link->rest != 0)
            hash = hash_numbers(hash, kt_link_rest_of(link), sizeof(kt_link_rest));
    }
    for (size_t i = 1; i < model->n.body; i++)
        hash = hash_numbers(hash, &model->body[i], offsetof(kt_body_record, link));
    for (size_t i = 0; i < model->n.marker; i++)
        hash = hash_numbers(hash, &model->marker[i].frame, sizeof(kt_pose));
    return hash_numbers(hash, model->armature, model->n.v * sizeof *model->armature);
}

/* Adds the numbers of all loops: frames, functions of time, geometry, coefficients of relations. */
static uint64_t hash_loops(uint64_t hash, const kt_model *model) {
    for (size_t i = 0; i < model->n.loop; i++) {
        const kt_loop_record *loop = &model->loop[i];
        const double numbers[] = {loop->pitch, loop->radius, loop->tube, loop->tension, loop->gain[0], loop->gain[1]};
        hash = hash_numbers(hash, loop->frame, sizeof loop->frame);
        hash = hash_numbers(hash_curve(hash, &loop->curve), numbers, sizeof numbers);
    }
    for (size_t i = 0; i < model->n.term; i++)
        hash = hash_numbers(hash, &model->term[i].coefficient, sizeof(double));
    return hash;
}

/* The order of effects depends on those that are on: each has a hash of its own. */
static uint64_t hash_effects(uint64_t hash, const kt_model *model) {
    for (size_t i = 0; i < model->n.effect + model->n.effect_off; i++) {
        const kt_effect_record *effect = &model->effect[i];
        uint64_t own = hash_numbers(hash_word(0, (uint64_t)effect->source), effect->frame, sizeof effect->frame);
#define KT_HASH_NUMBER(member) own = hash_numbers(own, &effect->member, sizeof effect->member);
        KT_EFFECT_NUMBERS(KT_HASH_NUMBER)
        KT_HASH_NUMBER(stiffnesses)
        KT_HASH_NUMBER(dampings)
        KT_HASH_NUMBER(quadratics)
#undef KT_HASH_NUMBER
        for (size_t k = 0; k < sizeof effect->curve / sizeof *effect->curve; k++)
            own = hash_curve(own, &effect->curve[k]);
        hash += own;
    }
    return hash_numbers(hash, model->number, model->n.number * sizeof *model->number);
}

void kt_model_identify(kt_model *model) {
    uint64_t hash = hash_numbers(14695981039346656037U, &model->gravity, sizeof model->gravity);
    hash = hash_loops(hash_tree(hash, model), model);
    model->constants = hash_effects(hash, model);
}

void kt_model_seal(kt_model *model) {
    model->custom = false;
    for (size_t i = 0; i < model->n.loop; i++)
        model->custom |= model->loop[i].equations != NULL;
    model->shape = shape_of(&model->n);
    model->identity = hash_word(model->shape, model->constants);
    model->slips = model->n.slip > 0 ? hash_of_slips(model) : 0;
}

void kt_other_data_report(kt_error *error, const char *call) {
    (void)kt_error_set(error, KT_ERROR_ARGUMENT, call,
                       "the data are another model's; take data that were made for this one (kt_data_create)");
}

void kt_model_name_all(kt_model *m) {
    kt_names_init(&m->names, m->n.body + m->n.named_joint + m->n.marker, m->index);
    for (size_t i = 0; i < m->n.body; i++) {
        const kt_body_record *b = &m->body[i];
        (void)kt_names_add(&m->names, 0, m->text + b->name, (int)i);
        if (b->joint_name != b->name)
            (void)kt_names_add(&m->names, KT_NAMES_OF_JOINTS, m->text + b->joint_name, (int)i);
        for (int k = 0; k < b->marker_count; k++)
            (void)kt_names_add(&m->names, 1 + (int)i, m->text + m->marker[b->marker + k].name, k);
    }
}

void kt_model_free(kt_model *model) {
    if (model && model->variants) {
        if (!model->variants->placed)
            kt_aligned_release(model->variants);
        return;
    }
    if (!model || model->placed)
        return;
    kt_aligned_release(model);
}

size_t kt_data_size(const kt_model *model) {
    if (model && model->variants && model->variants->data)
        return model->variants->data;
    return model ? lay_out_data(NULL, &model->n) : 0;
}

/* All bits set are a NaN, so that queries return NaN until kt_kinematics_update has computed the numbers. */
static void forget_kinematics(const kt_model *model, kt_data *data) {
    memset(data->kinematics, 0xff, model->n.link * sizeof *data->kinematics);
}

void kt_data_rebind(const kt_model *model, kt_data *data) {
    const kt_data before = *data;
    memset(data, 0, lay_out_data(NULL, &model->n));
    (void)lay_out_data(data, &model->n);
    data->owned = before.owned;
    data->bytes = before.bytes;
    data->followed = before.followed;
    data->identity = model->identity;
    kt_copy(data->x, model->v0 + model->n.v, model->n.x * sizeof *data->x);
    data->iterations = before.iterations;
    data->unconverged = before.unconverged;
    data->crossings = before.crossings;
    data->passage = before.passage;
    forget_kinematics(model, data);
    if (model->place_slip)
        model->place_slip(model, data);
}

void kt_data_follow(const kt_model *model, kt_data *data) {
    if (!kt_data_serve(model, data))
        kt_data_rebind(model, data);
}

kt_status kt_data_init(const kt_model *model, void *memory, size_t size, kt_data **data, kt_error *error) {
    if (KT_IS_MISSING(error, model, data))
        return KT_ERROR_ARGUMENT;
    const kt_status status = kt_arena_begin("kt_data_init", "kt_data_size", memory, size, kt_data_size(model), error);
    if (status != KT_OK)
        return status;
    (void)lay_out_data(memory, &model->n);
    *data = (kt_data *)memory;
    (*data)->identity = model->identity;
    forget_kinematics(model, *data);
    kt_copy((*data)->x, model->v0 + model->n.v, model->n.x * sizeof(double));
    (*data)->bytes = size;
    kt_clear((*data)->stopped, kt_where(model->n.loop, 2) * sizeof(int32_t));
    kt_clear((*data)->slip, 2 * model->n.slip * sizeof(double));
    kt_clear((*data)->load_rests, model->n.loaded * sizeof(bool));
    if (model->place_slip)
        model->place_slip(model, *data);
    return KT_OK;
}

kt_status kt_data_init_followed(const kt_model *model, void *memory, size_t size, kt_data **data, kt_error *error) {
    const kt_status status = kt_data_init(model, memory, size, data, error);
    if (status == KT_OK)
        (*data)->followed = true;
    return status;
}

kt_status kt_data_create(const kt_model *model, kt_data **data, kt_error *error) {
    if (KT_IS_MISSING(error, model, data))
        return KT_ERROR_ARGUMENT;
    const size_t size = kt_data_size(model);
    void *memory = kt_arena_allocate(size, "the data", error);
    return memory ? kt_arena_own(memory, kt_data_init(model, memory, size, data, error)) : KT_ERROR_MEMORY;
}

void kt_data_free(kt_data *data) { kt_arena_free(data); }

kt_iterations kt_data_iterations(kt_data *data) {
    if (!data)
        return (kt_iterations){0, 0, 0, 0};
    const kt_iterations none = {0, 0, 0, 0}, last = data->iterations;
    data->iterations = none;
    return last;
}

double kt_data_difference_error(kt_data *data) {
    if (!data)
        return (double)NAN;
    const double last = data->difference_error;
    data->difference_error = 0.0;
    return last;
}

kt_crossings kt_data_crossings(kt_data *data) {
    const kt_crossings none = {.near = 0};
    if (!data)
        return none;
    const kt_crossings last = data->crossings;
    data->crossings = none;
    data->passage = (kt_passage){.time = 0.0};
    return last;
}
