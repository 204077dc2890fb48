/* The state of an instance as one flat block without pointers. Another process may continue from it.
 *
 *     header, numbers: time, given parameters, their flags, tunable parameters of the compilation and of the present,
 *     torques, y; then the checkpoint of the simulation
 */
#include "instance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct kt_fmu_header {
    char mark[8];
    char token[24]; /* of the resources */
    uint64_t size, phase, is_over, is_exchange;
} kt_fmu_header;

static const char mark[8] = "ktFMU02";

static size_t number_count(const kt_fmu *fmu) {
    return 1 + 2 * ((size_t)fmu->parameter_count + (size_t)fmu->tunables.count) + (size_t)fmu->nv +
           (size_t)kt_fmu_size(fmu);
}

size_t kt_fmu_block_size(const kt_fmu *fmu) {
    return sizeof(kt_fmu_header) + number_count(fmu) * sizeof(double) + kt_simulation_state_size(fmu->simulation);
}

static void make_header(const kt_fmu *fmu, kt_fmu_header *header) {
    memset(header, 0, sizeof *header);
    memcpy(header->mark, mark, sizeof mark);
    memcpy(header->token, fmu->token.text, sizeof header->token);
    header->size = kt_fmu_block_size(fmu);
    header->phase = (uint64_t)fmu->phase;
    header->is_over = fmu->is_over;
    header->is_exchange = fmu->is_exchange;
}

void kt_fmu_save(const kt_fmu *fmu, void *block) {
    kt_fmu_header *header = block;
    make_header(fmu, header);
    double *to = (double *)(header + 1);
    *to++ = fmu->time;
    for (int i = 0; i < fmu->parameter_count; i++)
        *to++ = fmu->given[i];
    for (int i = 0; i < fmu->parameter_count; i++)
        *to++ = fmu->is_given[i];
    kt_fmu_copy_tunables(fmu, fmu->tunables.compiled, to);
    kt_fmu_copy_tunables(fmu, fmu->tunables.values, to + fmu->tunables.count);
    to += 2 * fmu->tunables.count;
    for (int i = 0; i < fmu->nv; i++)
        *to++ = fmu->torque[i];
    for (int i = 0; i < kt_fmu_size(fmu); i++)
        *to++ = fmu->y[i];
    kt_simulation_save(fmu->simulation, to);
}

/* Returns whether a block is a state of this FMU and kind of instance. */
static bool fits(const kt_fmu *fmu, const kt_fmu_header *header, size_t size) {
    kt_fmu_header own;
    make_header(fmu, &own);
    return size == own.size && memcmp(header->mark, own.mark, sizeof own.mark) == 0 &&
           memcmp(header->token, own.token, sizeof own.token) == 0 && header->size == own.size &&
           header->is_exchange == own.is_exchange && header->phase <= (uint64_t)KT_FMU_TERMINATED;
}

/* Takes over the parameters of a compilation. Returns whether any of them changed. */
static bool take_parameters(kt_fmu *fmu, const double *given) {
    const double *is_given = given + fmu->parameter_count, *compiled = is_given + fmu->parameter_count;
    bool differs = false;
    for (int k = 0; k < fmu->tunables.count; k++)
        differs |= fmu->tunables.compiled[k] != compiled[k];
    for (int i = 0; i < fmu->parameter_count; i++) {
        differs |= fmu->is_given[i] != (is_given[i] != 0.0) || (fmu->is_given[i] && fmu->given[i] != given[i]);
        fmu->given[i] = given[i];
        fmu->is_given[i] = is_given[i] != 0.0;
    }
    return differs;
}

kt_status kt_fmu_restore(kt_fmu *fmu, const void *block, size_t size, kt_error *error) {
    const kt_fmu_header *header = block;
    if (size < sizeof *header || !fits(fmu, header, size))
        return kt_error_set(error, KT_ERROR_ARGUMENT, NULL, "the state is not one of this FMU");
    const double *from = (const double *)(header + 1), *compiled = from + 1 + 2 * fmu->parameter_count;
    const double *tuned = compiled + fmu->tunables.count, *torque = tuned + fmu->tunables.count;
    kt_status status = KT_OK;
    if (take_parameters(fmu, from + 1) || fmu->is_stale) {
        kt_fmu_copy_tunables(fmu, compiled, fmu->tunables.wanted);
        status = kt_fmu_compile(fmu, error);
    }
    kt_fmu_copy_tunables(fmu, tuned, fmu->tunables.wanted);
    if (status == KT_OK)
        status = kt_fmu_tune(fmu, false, error);
    if (status == KT_OK)
        status = kt_simulation_restore(fmu->simulation, torque + fmu->nv + kt_fmu_size(fmu), error);
    if (status == KT_OK && fmu->watch != NULL)
        status = kt_scene_watch_sync(fmu->watch, fmu->simulation, error);
    if (status != KT_OK)
        return status;
    memcpy(fmu->torque, torque, (size_t)fmu->nv * sizeof *torque);
    memcpy(fmu->y, torque + fmu->nv, (size_t)kt_fmu_size(fmu) * sizeof *torque);
    fmu->time = from[0];
    fmu->phase = (kt_fmu_phase)header->phase;
    fmu->is_over = header->is_over != 0;
    fmu->is_moved = false;
    kt_fmu_change(fmu);
    return kt_simulation_set_torque(fmu->simulation, fmu->torque, error);
}
