/* Checkpoints: the persistent state of the simulation and the memory of its integrator in one flat block.
 *
 * Layout, each part at a multiple of 8 bytes: head, persistent state (kt_simulation_block), kt_integrator_memory, y,
 * the y at the beginning of the last step, the history of the method.
 *
 * The run after a checkpoint also depends on the model, the method and its settings. The head identifies model, method
 * and settings, and a block is accepted only if all agree. The values of a model's parameters are not compared: a copy
 * of a model may continue with other values.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "simulation/checkpoint.h"
#include "base/copy.h"
#include "base/sum.h"
#include "contact/contact.h"
#include "expression/expression.h"
#include "integrator/integrator.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

#define KT_CHECKPOINT_EVENTS(X)                                                                                        \
    X(event_evaluations, "the option 'event_evaluations' at", simulation->events.evaluations)                          \
    X(contact, "the option 'contact' at", simulation->options.contact)                                                 \
    X(step_evaluations, "the option 'step_evaluations' at", (double)simulation->options.step_evaluations)              \
    X(stall_evaluations, "the option 'stall_evaluations' at", (double)simulation->options.stall_evaluations)

/* The settings on which steps and records after a checkpoint depend: name, words, value. One list writes, compares and
 * reports all settings. */
#define KT_CHECKPOINT_SETTINGS(X)                                                                                      \
    X(step, "a step of", simulation->step)                                                                             \
    X(relative, "a relative tolerance of", adaptive ? options->relative_tolerance : 0.0)                               \
    X(absolute, "an absolute tolerance of", adaptive ? options->absolute_tolerance : 0.0)                              \
    X(max_step, "a longest step of", adaptive ? options->max_step : 0.0)                                               \
    X(max_steps, "a largest number of steps of", adaptive ? (double)options->max_steps : 0.0)                          \
    X(duration, "a duration of", simulation->duration)                                                                 \
    X(interval, "an interval between records of", simulation->records.interval)                                        \
    X(unprojected, "the option 'unprojected' at", simulation->options.unprojected)                                     \
    X(smooth_inputs, "the option 'smooth_inputs' at", simulation->options.smooth_inputs)                               \
    X(accelerates, "accelerations of the caller's at", simulation->options.acceleration != NULL)                       \
    X(projects, "a projection of the caller's at", simulation->options.projection != NULL)                             \
    KT_CHECKPOINT_EVENTS(X)

typedef struct kt_checkpoint_settings {
#define KT_CHECKPOINT_SETTING(name, words, value) double name;
    KT_CHECKPOINT_SETTINGS(KT_CHECKPOINT_SETTING)
#undef KT_CHECKPOINT_SETTING
} kt_checkpoint_settings;

/* The parts: name, bytes. One list measures, writes and reads. */
#define KT_CHECKPOINT_PARTS(X)                                                                                         \
    X(head, sizeof(kt_checkpoint_head))                                                                                \
    X(state, kt_simulation_block_size(size))                                                                           \
    X(integrator, sizeof(kt_integrator_memory))                                                                        \
    X(y, size->n * sizeof(double))                                                                                     \
    X(previous_y, size->n * sizeof(double))                                                                            \
    X(history, size->history * sizeof(double))

enum {
#define KT_CHECKPOINT_NUMBER(part, bytes) KT_CHECKPOINT_AT_##part,
    KT_CHECKPOINT_PARTS(KT_CHECKPOINT_NUMBER)
#undef KT_CHECKPOINT_NUMBER
        KT_CHECKPOINT_PART_COUNT
};

typedef struct kt_checkpoint_head {
    char kind[16];   /* "kinetree state" */
    char method[32]; /* its name, cut to fit */
    uint64_t size, nq, nv, body;
    uint64_t model;  /* checksum: see sum_of_model */
    uint64_t events; /* checksum of the events (kt_event.sum) */
    kt_checkpoint_settings settings;
    uint64_t sum[KT_CHECKPOINT_PART_COUNT]; /* of all bytes of a part; that of the head is made as if it were 0 */
} kt_checkpoint_head;

static const char checkpoint_kind[16] = "kinetree stat 3";

/* Adds the operators and the operands of an effect's formulas, or of an auxiliary state's rate. The numbers of formulas
 * are values of parameters and are left out. */
static uint64_t sum_of_formulas(uint64_t sum, const kt_model *model, const kt_effect_record *effect) {
    for (int k = 0; k < 6; k++) {
        const kt_expression *formula =
            effect->formula[k] > 0 ? (const void *)(model->number + effect->formula[k] - 1) : NULL;
        for (size_t i = 0; formula != NULL && i < formula->count; i++) {
            const kt_expression_term *term = &formula->term[i];
            const bool is_number = term->code == KT_OPERATOR_NUMBER; /* else a variable, or a table */
            const int32_t numbers[] = {k, term->code, is_number ? 0 : term->symbol};
            sum = kt_sum_add(sum, numbers, sizeof numbers);
        }
    }
    for (int32_t i = 0; i < effect->variable_count; i++) {
        const kt_variable_record *variable = &model->variable[effect->variable + i];
        const int32_t numbers[] = {variable->type, variable->v, variable->x, variable->link, variable->component};
        sum = kt_sum_add(sum, numbers, sizeof numbers);
    }
    return sum;
}

/* Adds the points of an effect's path. */
static uint64_t sum_of_path(uint64_t sum, const kt_model *model, const kt_effect_record *effect) {
    const kt_path_point_record *points = model->path_point + effect->path_point;
    for (const kt_path_point_record *point = points; point < points + effect->path_count; point++) {
        const int32_t kinds[] = {point->type, model->path_link[effect->path_link + point->link].link, point->inside};
        const double numbers[] = {point->radius, point->divisor, point->at.x,   point->at.y,
                                  point->at.z,   point->axis.x,  point->axis.y, point->axis.z,
                                  point->side.x, point->side.y,  point->side.z};
        sum = kt_sum_add(kt_sum_add(sum, kinds, sizeof kinds), numbers, sizeof numbers);
    }
    return sum;
}

/* Adds names, order and types of bodies, loops and effects, the formulas and paths, and the library's version, on which
 * the layout depends. With variants, the first model counts, since effects that are off are missing in the others. */
static uint64_t sum_of_model(const kt_model *model) {
    model = kt_model_switched(model, 0);
    uint64_t sum = kt_sum_add_text(KT_SUM_START, kt_version());
    for (int body = 1; body < kt_model_body_count(model); body++) {
        const kt_coordinates at = kt_body_coordinates(model, body);
        const int numbers[] = {kt_body_parent(model, body), at.q, at.nq, at.v, at.nv};
        sum = kt_sum_add(kt_sum_add_text(sum, kt_body_name(model, body)), numbers, sizeof numbers);
    }
    for (int loop = 0; loop < kt_loop_count(model); loop++) {
        const int type = (int)kt_loop_type_of(model, loop);
        sum = kt_sum_add(kt_sum_add_text(sum, kt_loop_name(model, loop)), &type, sizeof type);
    }
    for (size_t i = 0; i < model->n.effect; i++)
        sum = kt_sum_add(sum, &model->effect[i].type, sizeof model->effect[i].type);
    for (size_t i = 0; i < model->n.effect; i++)
        sum = sum_of_path(sum_of_formulas(sum, model, &model->effect[i]), model, &model->effect[i]);
    for (size_t i = 0; i < model->n.x; i++)
        sum = sum_of_formulas(kt_sum_add_text(sum, kt_auxiliary_state_name(model, (int)i)), model, &model->state[i]);
    return sum;
}

static uint64_t sum_of_events(const kt_simulation *simulation) {
    uint64_t sum = KT_SUM_START;
    for (size_t k = 0; k < simulation->events.count; k++)
        sum = kt_sum_add(sum, &simulation->events.list[k].sum, sizeof simulation->events.list[k].sum);
    return sum;
}

static size_t eight(size_t bytes) { return (bytes + 7) / 8 * 8; }

typedef struct kt_checkpoint_offsets {
#define KT_CHECKPOINT_DECLARE(part, bytes) size_t part;
    KT_CHECKPOINT_PARTS(KT_CHECKPOINT_DECLARE)
#undef KT_CHECKPOINT_DECLARE
    size_t total, begin[KT_CHECKPOINT_PART_COUNT + 1]; /* of all parts in their order, and the end */
} kt_checkpoint_offsets;

static kt_checkpoint_offsets measure_checkpoint(const kt_simulation_sizes *size) {
    kt_checkpoint_offsets at;
    size_t offset = 0;
#define KT_CHECKPOINT_MEASURE(part, bytes)                                                                             \
    at.begin[KT_CHECKPOINT_AT_##part] = at.part = offset;                                                              \
    offset += eight(bytes);
    KT_CHECKPOINT_PARTS(KT_CHECKPOINT_MEASURE)
#undef KT_CHECKPOINT_MEASURE
    at.begin[KT_CHECKPOINT_PART_COUNT] = at.total = offset;
    return at;
}

static kt_checkpoint_settings settings_of(const kt_simulation *simulation) {
    const kt_integrator_options *options = &simulation->integrator->options;
    const bool adaptive = !(simulation->step > 0.0);
#define KT_CHECKPOINT_SETTING(name, words, value) .name = value,
    return (kt_checkpoint_settings){KT_CHECKPOINT_SETTINGS(KT_CHECKPOINT_SETTING)};
#undef KT_CHECKPOINT_SETTING
}

static kt_checkpoint_head make_head(const kt_simulation *simulation) {
    kt_checkpoint_head head;
    memset(&head, 0, sizeof head);
    memcpy(head.kind, checkpoint_kind, sizeof head.kind);
    const kt_method *method = kt_integrator_method(simulation->integrator);
    if (method->name != NULL && method->rho > 0.0)
        snprintf(head.method, sizeof head.method, "%.8s %.14g", method->name, method->rho);
    else if (method->name != NULL)
        snprintf(head.method, sizeof head.method, "%s", method->name);
    head.size = measure_checkpoint(&simulation->size).total;
    head.nq = simulation->size.nq;
    head.nv = simulation->size.nv;
    head.body = simulation->size.body;
    head.model = sum_of_model(simulation->model);
    head.events = sum_of_events(simulation);
    head.settings = settings_of(simulation);
    return head;
}

/* The sum of a part in a block, the bytes up to the next part included. */
static uint64_t sum_of_part(const char *block, const kt_checkpoint_offsets *at, int part) {
    const size_t begin = at->begin[part];
    return kt_sum_add_words(KT_SUM_START + (uint64_t)part, block + begin, (at->begin[part + 1] - begin) / 8);
}

static uint64_t sum_of_head(kt_checkpoint_head head) {
    head.sum[KT_CHECKPOINT_AT_head] = 0;
    return kt_sum_add_words(KT_SUM_START, &head, sizeof head / 8);
}

void kt_checkpoint_seal(const kt_simulation *simulation, void *block) {
    const kt_checkpoint_offsets at = measure_checkpoint(&simulation->size);
    kt_checkpoint_head head;
    memcpy(&head, block, sizeof head);
    for (int part = 1; part < KT_CHECKPOINT_PART_COUNT; part++)
        head.sum[part] = sum_of_part(block, &at, part);
    head.sum[KT_CHECKPOINT_AT_head] = sum_of_head(head);
    memcpy(block, &head, sizeof head);
}

/* Compares the sums of all parts but the head, which was checked before, with the sums in the head. */
static kt_status check_sums(const char *block, const kt_checkpoint_head *head, const kt_checkpoint_offsets *at,
                            kt_error *error) {
#define KT_CHECKPOINT_NAME(part, bytes) #part,
    static const char *const names[] = {KT_CHECKPOINT_PARTS(KT_CHECKPOINT_NAME)};
#undef KT_CHECKPOINT_NAME
    for (int part = 1; part < KT_CHECKPOINT_PART_COUNT; part++)
        if (sum_of_part(block, at, part) != head->sum[part])
            return kt_error_set(error, KT_ERROR_ARGUMENT, "checkpoint",
                                "it is damaged: the sum of its part '%s', bytes %.0f to %.0f, is wrong", names[part],
                                (double)at->begin[part], (double)at->begin[part + 1] - 1.0);
    return KT_OK;
}

size_t kt_checkpoint_memory_at(const kt_simulation *simulation) { return measure_checkpoint(&simulation->size).state; }

/* Where an array of the persistent state lies in a copy of its block. */
static const void *array_in(const kt_simulation *simulation, const char *block, const void *array) {
    return block + ((const char *)array - kt_simulation_block(simulation));
}

size_t kt_simulation_state_size(const kt_simulation *simulation) {
    return simulation ? measure_checkpoint(&simulation->size).total : 0;
}

void kt_simulation_save(const kt_simulation *simulation, void *block) {
    if (!simulation || !block)
        return;
    const kt_simulation_sizes *size = &simulation->size;
    kt_checkpoint_offsets at = measure_checkpoint(size);
    kt_checkpoint_head head = make_head(simulation);
    kt_integrator_memory memory;
    char *to = block;
    memset(block, 0, at.total); /* equal states give equal bytes, padding included */
    memset(&memory, 0, sizeof memory);
    memcpy(to + at.head, &head, sizeof head);
    memcpy(to + at.state, kt_simulation_block(simulation), kt_simulation_block_size(size));
    kt_integrator_save(simulation->integrator, &memory, (double *)(void *)(to + at.y),
                       (double *)(void *)(to + at.previous_y), (double *)(void *)(to + at.history));
    memcpy(to + at.integrator, &memory, sizeof memory);
    kt_checkpoint_seal(simulation, block);
}

/* `recorded`: records were passed on before the checkpoint. Without earlier records, duration and interval concern only
 * later steps and records, and may differ. */
static kt_status check_settings(const kt_checkpoint_settings *its, const kt_checkpoint_settings *own, bool recorded,
                                kt_error *error) {
#define KT_CHECKPOINT_SETTING(name, words, value) {words, offsetof(kt_checkpoint_settings, name)},
    static const struct {
        const char *words;
        size_t at;
    } settings[] = {KT_CHECKPOINT_SETTINGS(KT_CHECKPOINT_SETTING)};
#undef KT_CHECKPOINT_SETTING
    for (size_t i = 0; i < sizeof settings / sizeof *settings; i++) {
        uint64_t bits[2];
        double there, here;
        if (!recorded && (settings[i].at == offsetof(kt_checkpoint_settings, duration) ||
                          settings[i].at == offsetof(kt_checkpoint_settings, interval)))
            continue;
        memcpy(&bits[0], (const char *)its + settings[i].at, sizeof there);
        memcpy(&bits[1], (const char *)own + settings[i].at, sizeof here);
        memcpy(&there, &bits[0], sizeof there);
        memcpy(&here, &bits[1], sizeof here);
        if (bits[0] != bits[1])
            return kt_error_set(error, KT_ERROR_ARGUMENT, "checkpoint",
                                "it was made with %s %.9g, and this simulation has %.9g; kt_simulation_set_state takes "
                                "over the time and the state alone, and begins new steps and records there",
                                settings[i].words, there, here);
    }
    return KT_OK;
}

/* Rejects a block of another kind, model, method or version. recorded: as in check_settings. */
static kt_status check_checkpoint_head(const kt_simulation *simulation, const kt_checkpoint_head *head, bool recorded,
                                       kt_error *error) {
    kt_checkpoint_head own = make_head(simulation);
    if (memcmp(head->kind, own.kind, sizeof own.kind) != 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "checkpoint",
                            "these bytes are not a checkpoint of a simulation by this version of the library, %s",
                            kt_version());
    if (head->sum[KT_CHECKPOINT_AT_head] != sum_of_head(*head))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "checkpoint",
                            "it is damaged: the sum of its head, bytes 0 to %.0f, is wrong",
                            (double)sizeof *head - 1.0);
    if (head->nq != own.nq || head->nv != own.nv || head->body != own.body)
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "checkpoint",
            "it is of another model: %.0f bodies, %.0f positions, %.0f velocities; here: %.0f, %.0f, %.0f",
            (double)head->body, (double)head->nq, (double)head->nv, (double)own.body, (double)own.nq, (double)own.nv);
    if (memcmp(head->method, own.method, sizeof own.method) != 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "checkpoint",
                            "it was made with another integrator: %.31s, and this is %.31s", head->method, own.method);
    if (head->size != own.size)
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "checkpoint",
            "it is of another model or version of the library, or only one of the two keeps an energy balance: "
            "%.0f bytes; here: %.0f",
            (double)head->size, (double)own.size);
    if (head->model != own.model)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "checkpoint",
                            "it belongs to another model (with the same number of coordinates, but other names, types "
                            "or formulas), or to another version of the library; this version is %s",
                            kt_version());
    if (head->events != own.events)
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "checkpoint",
            "it was made with events that watch or do something else, or from which other numbers of the model "
            "follow; add the events of that simulation before this call, or let kt_simulation_set_state take "
            "over a time and a state alone");
    return check_settings(&head->settings, &own.settings, recorded, error);
}

/* The model of the set of a checkpoint, whose persistent state is at `from`; NULL: there is none. */
static const kt_model *checkpoint_model_of(kt_simulation *simulation, uint64_t set, const char *from) {
    if (simulation->size.ranks > 0)
        return kt_contacts_restored_model(simulation, set, array_in(simulation, from, simulation->ranks),
                                          array_in(simulation, from, simulation->contact_state));
    return kt_model_switched(simulation->model, set);
}

/* The arrays whose numbers must be finite: name, count. */
#define KT_CHECKPOINT_FINITE(X)                                                                                        \
    X(torque, size->nv)                                                                                                \
    X(torque_next, size->nv)                                                                                           \
    X(wrench, size->body *(sizeof(kt_wrench) / sizeof(double)))                                                        \
    X(wrench_next, size->body *(sizeof(kt_wrench) / sizeof(double)))                                                   \
    X(state, size->state)

/* Checks the words of a persistent state at `from`. */
static kt_status check_state(const kt_simulation *simulation, const char *from, kt_error *error) {
    const kt_simulation_sizes *size = &simulation->size;
    const kt_checkpoint_structs structs = {
        .memory = from,
        .contact_state = array_in(simulation, from, simulation->contact_state),
        .event_memory = array_in(simulation, from, simulation->event_memory),
        .event_root = array_in(simulation, from, simulation->event_root),
    };
    const kt_status status = kt_checkpoint_check_words(simulation, &structs, error);
    if (status != KT_OK)
        return status;
#define KT_CHECKPOINT_CHECK(array, count)                                                                              \
    if (kt_first_not_finite(array_in(simulation, from, simulation->array), count) < (count))                           \
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "checkpoint", "a number of its array '%s' is not finite",      \
                            #array);
    KT_CHECKPOINT_FINITE(KT_CHECKPOINT_CHECK)
#undef KT_CHECKPOINT_CHECK
    return KT_OK;
}

/* A damaged block changes nothing: head, sums and words are checked before anything is written. The model is set next,
 * since the integrator calls it, and is set back if the integrator rejects its part. */
kt_status kt_simulation_restore(kt_simulation *simulation, const void *block, kt_error *error) {
    if (KT_IS_MISSING(error, simulation, block) ||
        kt_simulation_require_outermost(simulation, __func__, error) != KT_OK)
        return KT_ERROR_ARGUMENT;
    const kt_simulation_sizes *size = &simulation->size;
    kt_checkpoint_offsets at = measure_checkpoint(size);
    const char *from = block;
    kt_checkpoint_head head;
    kt_simulation_memory memory;
    kt_integrator_memory integrator;
    int64_t recorded;
    memcpy(&head, from + at.head, sizeof head);
    memcpy(&recorded, from + at.state + offsetof(kt_simulation_memory, recorded), sizeof recorded);
    kt_status status = check_checkpoint_head(simulation, &head, recorded > 0, error);
    if (status == KT_OK)
        status = check_sums(from, &head, &at, error);
    if (status == KT_OK)
        status = check_state(simulation, from + at.state, error);
    if (status != KT_OK)
        return status;
    memcpy(&memory, from + at.state, sizeof memory);
    memcpy(&integrator, from + at.integrator, sizeof integrator);
    const kt_model *before = simulation->model;
    if ((memory.set != before->set || kt_model_switched(before, memory.set) != before)) {
        const kt_model *model = checkpoint_model_of(simulation, memory.set, from + at.state);
        if (model == NULL)
            return kt_error_set(error, KT_ERROR_ARGUMENT, "checkpoint",
                                "its set of switched loops, effects and contacts, or a rank of their equations, is "
                                "none of this model");
        kt_simulation_take_model(simulation, model);
    }
    kt_integrator_callbacks callbacks = kt_simulation_callbacks(simulation);
    const double *y = (const double *)(const void *)(from + at.y);
    const double *previous_y = (const double *)(const void *)(from + at.previous_y);
    const double *history = (const double *)(const void *)(from + at.history);
    status = kt_integrator_restore(simulation->integrator, &integrator, y, integrator.has_previous ? previous_y : NULL,
                                   history, &callbacks, error);
    if (status != KT_OK && simulation->model != before)
        kt_simulation_take_model(simulation, before);
    if (status != KT_OK)
        return status;
    memcpy(kt_simulation_block(simulation), from + at.state, kt_simulation_block_size(size));
    if (simulation->memory.pending)
        kt_simulation_await_inputs(simulation);
    if (head.settings.duration != simulation->duration || head.settings.interval != simulation->records.interval) {
        simulation->memory.next_record = 0;
        kt_simulation_skip_records(simulation);
    }
    kt_phase_rebind(simulation);
    kt_simulation_forget_breakpoints(simulation);
    simulation->memory.piece = memory.piece;
    kt_phase_resume(simulation);
    kt_simulation_inputs_use(simulation);
    simulation->cached = KT_CACHED_NOTHING;
    return KT_OK;
}
