/* The state of an instance as one flat block without pointers, and the functions of FMI 3.0 that hand it over. Another
 * process may continue from it.
 *
 *     header, numbers: time, time of the start, given parameters, their flags, tunable parameters of the compilation
 *     and of the present, torques, y, events, signals. The checkpoint of the simulation follows.
 *
 * The sum detects accidents, and anybody can compute it. Therefore each word has a range, which is checked before the
 * instance changes. kt_simulation_restore checks the words of the checkpoint.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "instance.h"

#include "base/sum.h"
#include "simulation/simulation.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

typedef struct kt_fmu_header {
    char mark[8];
    char token[24]; /* of the resources */
    uint64_t size, phase, is_over, kind;
    uint64_t sum; /* of all other bytes: a damaged block is rejected */
} kt_fmu_header;

static const char mark[8] = "ktFMU05";

static size_t block_number_count(const kt_fmu *fmu) {
    return 2 + 2 * ((size_t)fmu->parameter_count + (size_t)fmu->tunables.count) + (size_t)fmu->nv +
           (size_t)kt_fmu_size(fmu) + 3 * (size_t)fmu->event_count + kt_fmu_signal_numbers(fmu);
}

static size_t block_size(const kt_fmu *fmu) {
    return sizeof(kt_fmu_header) + block_number_count(fmu) * sizeof(double) + kt_simulation_state_size(fmu->simulation);
}

static void make_header(const kt_fmu *fmu, kt_fmu_header *header) {
    memset(header, 0, sizeof *header);
    memcpy(header->mark, mark, sizeof mark);
    memcpy(header->token, fmu->token.text, sizeof header->token);
    header->size = block_size(fmu);
    header->phase = (uint64_t)fmu->phase;
    header->is_over = fmu->is_over;
    header->kind = fmu->is_exchange + 2 * (uint64_t)fmu->has_event_mode;
}

static uint64_t sum_of_block(const void *block, size_t size) {
    const unsigned char *bytes = block;
    const uint64_t sum = kt_sum_add(KT_SUM_START, bytes, offsetof(kt_fmu_header, sum));
    return kt_sum_add(sum, bytes + sizeof(kt_fmu_header), size - sizeof(kt_fmu_header));
}

void kt_fmu_seal(void *block, size_t size) { ((kt_fmu_header *)block)->sum = sum_of_block(block, size); }

static void save_block(const kt_fmu *fmu, void *block) {
    kt_fmu_header *header = block;
    make_header(fmu, header);
    double *to = (double *)(header + 1);
    *to++ = fmu->time;
    *to++ = fmu->start;
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
    for (int k = 0; k < fmu->event_count; k++) {
        *to++ = fmu->events[k].side;
        *to++ = fmu->events[k].value;
        *to++ = fmu->events[k].count;
    }
    kt_simulation_save(fmu->simulation, kt_fmu_save_signals(fmu, to));
    kt_fmu_seal(block, header->size);
}

/* Returns whether a block is a state of this FMU and kind of instance. */
static bool block_fits(const kt_fmu *fmu, const kt_fmu_header *header, size_t size) {
    kt_fmu_header own;
    make_header(fmu, &own);
    return size == own.size && memcmp(header->mark, own.mark, sizeof own.mark) == 0 &&
           memcmp(header->token, own.token, sizeof own.token) == 0 && header->size == own.size &&
           header->kind == own.kind && header->sum == sum_of_block(header, size);
}

/* Returns whether the importer can be in this phase with an instance of this kind. */
static bool phase_fits(const kt_fmu *fmu, uint64_t phase) {
    const bool has_events = fmu->is_exchange || fmu->has_event_mode;
    return phase != (uint64_t)(fmu->is_exchange ? KT_FMU_STEP : KT_FMU_CONTINUOUS) &&
           (phase != (uint64_t)KT_FMU_EVENT || has_events) && phase <= (uint64_t)KT_FMU_TERMINATED;
}

static bool numbers_are_flags(const double *from, int count) {
    for (int i = 0; i < count; i++)
        if (from[i] != 0.0 && from[i] != 1.0)
            return false;
    return true;
}

/* Returns whether the side is a sign and the count a whole number; both become integers. The value may be any. */
static bool event_fits(const double *event) {
    static const double most = 9007199254740992.0; /* 2^53 */
    return (event[0] == 0.0 || fabs(event[0]) == 1.0) && event[2] >= 0.0 && event[2] <= most &&
           event[2] == floor(event[2]);
}

/* Returns whether all words before the checkpoint are in their ranges. */
static bool words_fit(const kt_fmu *fmu, const kt_fmu_header *header) {
    const double *numbers = (const double *)(header + 1);
    const size_t signals = kt_fmu_signal_numbers(fmu), events = 3 * (size_t)fmu->event_count,
                 count = block_number_count(fmu), first_event = count - signals - events;
    bool fits = phase_fits(fmu, header->phase) && header->is_over <= 1;
    for (size_t i = 0; i < count; i++)
        fits = fits && (isfinite(numbers[i]) || (i >= first_event && i < first_event + events));
    for (int k = 0; k < fmu->event_count; k++)
        fits = fits && event_fits(numbers + first_event + 3 * (size_t)k);
    return fits && numbers_are_flags(numbers + 2 + fmu->parameter_count, fmu->parameter_count) &&
           numbers_are_flags(numbers + count - 1, 1);
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

static kt_status restore_block(kt_fmu *fmu, const void *block, size_t size, kt_error *error) {
    const kt_fmu_header *header = block;
    if (size < sizeof *header || !block_fits(fmu, header, size))
        return kt_error_set(error, KT_ERROR_ARGUMENT, NULL, "the state is not one of this FMU, or it is damaged");
    if (!words_fit(fmu, header))
        return kt_error_set(error, KT_ERROR_ARGUMENT, NULL, "the state has a number that is out of its range");
    const double *from = (const double *)(header + 1), *compiled = from + 2 + 2 * fmu->parameter_count;
    const double *tuned = compiled + fmu->tunables.count, *torque = tuned + fmu->tunables.count;
    kt_status status = KT_OK;
    fmu->start = from[1]; /* a parameter that is set before the run compiles the scene anew at this time */
    if (take_parameters(fmu, from + 2) || fmu->is_stale) {
        kt_fmu_copy_tunables(fmu, compiled, fmu->tunables.wanted);
        kt_fmu_reset_signals(fmu); /* the scene may not start with present values */
        status = kt_fmu_compile(fmu, error);
    }
    kt_fmu_copy_tunables(fmu, tuned, fmu->tunables.wanted);
    if (status == KT_OK)
        status = kt_fmu_tune(fmu, false, error);
    const double *events = torque + fmu->nv + kt_fmu_size(fmu), *signals = events + 3 * fmu->event_count;
    if (status == KT_OK)
        status = kt_fmu_restore_signals(fmu, signals, error);
    if (status == KT_OK)
        status = kt_simulation_restore(fmu->simulation, signals + kt_fmu_signal_numbers(fmu), error);
    if (status == KT_OK && !fmu->is_exchange && kt_simulation_time(fmu->simulation) != from[0])
        status = kt_error_set(error, KT_ERROR_ARGUMENT, NULL, "the state has another time than its simulation");
    if (status != KT_OK)
        return status;
    memcpy(fmu->torque, torque, (size_t)fmu->nv * sizeof *torque);
    memcpy(fmu->y, torque + fmu->nv, (size_t)kt_fmu_size(fmu) * sizeof *torque);
    for (int k = 0; k < fmu->event_count; k++, events += 3)
        fmu->events[k] = (kt_fmu_event){events[0], events[1], events[2], false};
    fmu->time = from[0];
    /* Parameters that events set follow from the auxiliary states of the importer. Its state may be off the loops, and
     * that of the simulation an old one: no loop is closed. */
    if (fmu->is_exchange && fmu->nx > 0)
        memcpy(fmu->simulation->state + fmu->nq + fmu->nv, fmu->y + fmu->nq + fmu->nv,
               (size_t)fmu->nx * sizeof *torque);
    if (fmu->watch != NULL)
        status = kt_scene_watch_sync(fmu->watch, fmu->simulation, error);
    if (status != KT_OK)
        return status;
    fmu->phase = (kt_fmu_phase)header->phase;
    fmu->is_over = header->is_over != 0;
    kt_fmu_change(fmu);
    return kt_simulation_set_torque(fmu->simulation, fmu->torque, error);
}

/* ---- functions of FMI -------------------------------------------------------------------------------------------- */

/* A state in the memory of the importer: its size and the block. */
typedef struct kt_fmu_kept {
    size_t size;
    double block[];
} kt_fmu_kept;

static kt_fmu_kept *take_kept(kt_fmu_kept **kept, size_t size) {
    if (*kept != NULL && (*kept)->size == size)
        return *kept;
    kt_fmu_kept *other = realloc(*kept, sizeof *other + size);
    if (other != NULL) {
        other->size = size;
        *kept = other;
    }
    return other;
}

KT_FMI(kt_fmi_status fmi3GetFMUState(void *instance, void **state)) {
    KT_FMU_TAKE(instance);
    KT_FMU_REQUIRE_NO_UPDATE;
    const kt_fmi_status status = kt_fmu_settle(fmu);
    if (status != KT_FMI_OK)
        return status;
    kt_fmu_kept *kept = take_kept((kt_fmu_kept **)state, block_size(fmu));
    KT_FMU_REQUIRE(kept != NULL, "there is not enough memory for a state");
    save_block(fmu, kept->block);
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi3SetFMUState(void *instance, void *state)) {
    KT_FMU_TAKE(instance);
    kt_error error = {0};
    const kt_fmu_kept *kept = state;
    KT_FMU_REQUIRE(kept != NULL, "the state is NULL");
    KT_FMU_REQUIRE_NO_UPDATE;
    return kt_fmu_report_status(fmu, restore_block(fmu, kept->block, kept->size, &error), &error);
}

KT_FMI(kt_fmi_status fmi3FreeFMUState(void *instance, void **state)) {
    (void)instance;
    if (state == NULL)
        return KT_FMI_OK;
    free(*state);
    *state = NULL;
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi3SerializedFMUStateSize(void *instance, void *state, size_t *size)) {
    if (state == NULL)
        return kt_fmu_report(instance, "the state is NULL");
    *size = ((const kt_fmu_kept *)state)->size;
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi3SerializeFMUState(void *instance, void *state, unsigned char *bytes, size_t size)) {
    const kt_fmu_kept *kept = state;
    if (kept == NULL || size != kept->size)
        return kt_fmu_report(instance, "a serialized state has another size");
    memcpy(bytes, kept->block, size);
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi3DeserializeFMUState(void *instance, const unsigned char *bytes, size_t size, void **state)) {
    KT_FMU_TAKE(instance);
    KT_FMU_REQUIRE(bytes != NULL && state != NULL && size <= SIZE_MAX - sizeof(kt_fmu_kept),
                   "a serialized state and a place for the state are required");
    kt_fmu_kept *kept = take_kept((kt_fmu_kept **)state, size);
    KT_FMU_REQUIRE(kept != NULL, "there is not enough memory for a state");
    memcpy(kept->block, bytes, size);
    return KT_FMI_OK;
}
