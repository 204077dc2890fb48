/* Checkpoints: the memory of the simulation and of its integrator in one flat block.
 *
 * Layout, each part at a multiple of 8: head, kt_simulation_memory, kt_integrator_memory, y, the y where the last step
 * began, the history of the method, torques and wrenches of the last and of the next step, and with a
 * transformation the user model's state.
 */
#include "simulation/simulation.h"

#include <stdio.h>
#include <string.h>

typedef struct kt_checkpoint_head {
    char kind[16];   /* "kinetree state" */
    char method[32]; /* its name, cut to fit */
    uint64_t size, nq, nv, body;
} kt_checkpoint_head;

static const char checkpoint_kind[16] = "kinetree state";

static size_t eight(size_t bytes) { return (bytes + 7) / 8 * 8; }

/* The parts: name, bytes. One list measures, writes and reads. */
#define KT_CHECKPOINT_PARTS(X)                                                                                         \
    X(head, sizeof(kt_checkpoint_head))                                                                                \
    X(memory, sizeof(kt_simulation_memory))                                                                            \
    X(integrator, sizeof(kt_integrator_memory))                                                                        \
    X(y, size->n * sizeof(double))                                                                                     \
    X(previous_y, size->n * sizeof(double))                                                                            \
    X(history, size->history * sizeof(double))                                                                         \
    X(torque, size->user_nv * sizeof(double))                                                                          \
    X(torque_next, size->user_nv * sizeof(double))                                                                     \
    X(wrench, size->body * sizeof(kt_wrench))                                                                          \
    X(wrench_next, size->body * sizeof(kt_wrench))                                                                     \
    X(kept, size->kept * sizeof(double))

typedef struct kt_checkpoint_offsets {
#define KT_CHECKPOINT_DECLARE(part, bytes) size_t part;
    KT_CHECKPOINT_PARTS(KT_CHECKPOINT_DECLARE)
#undef KT_CHECKPOINT_DECLARE
    size_t total;
} kt_checkpoint_offsets;

static kt_checkpoint_offsets measure(const kt_simulation_sizes *size) {
    kt_checkpoint_offsets at;
    size_t offset = 0;
#define KT_CHECKPOINT_MEASURE(part, bytes)                                                                             \
    at.part = offset;                                                                                                  \
    offset += eight(bytes);
    KT_CHECKPOINT_PARTS(KT_CHECKPOINT_MEASURE)
#undef KT_CHECKPOINT_MEASURE
    at.total = offset;
    return at;
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
    head.size = measure(&simulation->size).total;
    head.nq = simulation->size.nq;
    head.nv = simulation->size.nv;
    head.body = simulation->size.body;
    return head;
}

size_t kt_simulation_state_size(const kt_simulation *simulation) { return measure(&simulation->size).total; }

void kt_simulation_save(const kt_simulation *simulation, void *block) {
    const kt_simulation_sizes *size = &simulation->size;
    kt_checkpoint_offsets at = measure(size);
    kt_checkpoint_head head = make_head(simulation);
    kt_integrator_memory memory;
    char *to = block;
    memset(block, 0, at.total); /* equal states give equal bytes, padding included */
    memset(&memory, 0, sizeof memory);
    memcpy(to + at.head, &head, sizeof head);
    memcpy(to + at.memory, &simulation->memory, sizeof simulation->memory);
    memcpy(to + at.torque, simulation->torque, size->user_nv * sizeof(double));
    memcpy(to + at.torque_next, simulation->torque_next, size->user_nv * sizeof(double));
    memcpy(to + at.wrench, simulation->wrench, size->body * sizeof(kt_wrench));
    memcpy(to + at.wrench_next, simulation->wrench_next, size->body * sizeof(kt_wrench));
    memcpy(to + at.kept, simulation->state, size->kept * sizeof(double));
    kt_integrator_save(simulation->integrator, &memory, (double *)(void *)(to + at.y),
                       (double *)(void *)(to + at.previous_y), (double *)(void *)(to + at.history));
    memcpy(to + at.integrator, &memory, sizeof memory);
}

/* Whether the block is of this kind of simulation. */
static kt_status check_head(const kt_simulation *simulation, const kt_checkpoint_head *head, kt_error *error) {
    kt_checkpoint_head own = make_head(simulation);
    if (memcmp(head->kind, own.kind, sizeof own.kind) != 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "checkpoint", "these bytes are not a checkpoint of a simulation");
    if (head->nq != own.nq || head->nv != own.nv || head->body != own.body)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "checkpoint",
                            "it is of another model: %llu bodies, %llu positions, %llu velocities; here: %zu, %zu, %zu",
                            (unsigned long long)head->body, (unsigned long long)head->nq, (unsigned long long)head->nv,
                            simulation->size.body, simulation->size.nq, simulation->size.nv);
    if (memcmp(head->method, own.method, sizeof own.method) != 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "checkpoint",
                            "it was made with another integrator: %.31s, and this is %.31s", head->method, own.method);
    if (head->size != own.size)
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "checkpoint",
            "it is of another model, or only one of the two keeps an energy balance: %llu bytes; here: %llu",
            (unsigned long long)head->size, (unsigned long long)own.size);
    return KT_OK;
}

kt_status kt_simulation_restore(kt_simulation *simulation, const void *block, kt_error *error) {
    const kt_simulation_sizes *size = &simulation->size;
    kt_checkpoint_offsets at = measure(size);
    const char *from = block;
    kt_checkpoint_head head;
    kt_simulation_memory memory;
    kt_integrator_memory integrator;
    memcpy(&head, from + at.head, sizeof head);
    kt_status status = check_head(simulation, &head, error);
    if (status != KT_OK)
        return status;
    memcpy(&memory, from + at.memory, sizeof memory);
    memcpy(&integrator, from + at.integrator, sizeof integrator);
    kt_integrator_callbacks callbacks = kt_simulation_callbacks(simulation);
    const double *y = (const double *)(const void *)(from + at.y);
    const double *previous_y = (const double *)(const void *)(from + at.previous_y);
    const double *history = (const double *)(const void *)(from + at.history);
    status = kt_integrator_restore(simulation->integrator, &integrator, y, integrator.has_previous ? previous_y : NULL,
                                   history, &callbacks, error);
    if (status != KT_OK)
        return status;
    simulation->memory = memory;
    simulation->gap_time = (double)NAN;
    kt_simulation_forget_corners(simulation);
    memcpy(simulation->torque, from + at.torque, size->user_nv * sizeof(double));
    memcpy(simulation->torque_next, from + at.torque_next, size->user_nv * sizeof(double));
    memcpy(simulation->wrench, from + at.wrench, size->body * sizeof(kt_wrench));
    memcpy(simulation->wrench_next, from + at.wrench_next, size->body * sizeof(kt_wrench));
    memcpy(simulation->state, from + (size->kept > 0 ? at.kept : at.y), size->state * sizeof(double));
    kt_simulation_inputs_use(simulation);
    simulation->cached = KT_CACHED_NOTHING;
    return KT_OK;
}
