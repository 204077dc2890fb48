/* The lists of hooks of a simulation, and the phases outside of steps. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "step/simulation_struct.h"

size_t kt_parts_measure(const kt_simulation_sizes *size, const kt_part *const *parts, size_t count) {
    size_t bytes = 0;
    for (size_t i = 0; i < count; i++)
        bytes += parts[i]->measure != NULL ? kt_arena_round(parts[i]->measure(size)) : 0;
    return bytes;
}

void kt_parts_init(kt_simulation *simulation, void *memory) {
    char *at = memory;
    for (size_t i = 0; i < simulation->part_count; i++) {
        const kt_part *const *parts = simulation->parts;
        const size_t bytes = parts[i]->measure != NULL ? parts[i]->measure(&simulation->size) : 0;
        if (bytes > 0)
            parts[i]->init(simulation, at);
        at += kt_arena_round(bytes);
    }
}

/* The active parts, a bit for each. */
static uint32_t active_parts_of(const kt_simulation *simulation) {
    const kt_part *const *parts = simulation->parts;
    uint32_t active = 0;
    for (size_t i = 0; i < simulation->part_count; i++)
        if (parts[i]->is_active == NULL || parts[i]->is_active(simulation))
            active |= (uint32_t)1 << i;
    return active;
}

/* Adds the hook of a part to the list of a phase, whose remaining places are NULL. */
#define KT_PHASE_ADD(result, phase, parameters, meaning)                                                               \
    if (part->phase != NULL)                                                                                           \
        phases->phase[counts.phase++] = part->phase;
#define KT_PHASE_COUNT(result, phase, parameters, meaning) size_t phase;

void kt_parts_list(kt_simulation *simulation) {
    const uint32_t active = active_parts_of(simulation);
    kt_phases *phases = &simulation->phases;
    struct {
        KT_PHASES(KT_PHASE_COUNT)
    } counts = {0};
    if (active == phases->active)
        return;
    *phases = (kt_phases){.active = active};
    for (size_t i = 0; i < simulation->part_count; i++) {
        const kt_part *part = simulation->parts[i];
        if ((active >> i & 1) == 0)
            continue;
        /* cppcheck-suppress AssignmentAddressToInteger ; both sides are pointers to the hook of a phase */
        KT_PHASES(KT_PHASE_ADD)
    }
    phases->may_repeat = counts.begin + counts.prepare + counts.check + counts.accept + counts.retry > 0;
}
#undef KT_PHASE_COUNT
#undef KT_PHASE_ADD

void kt_phase_rebind(kt_simulation *simulation) {
    for (kt_hook_of_rebind *const *hook = simulation->phases.rebind; *hook != NULL; hook++)
        (*hook)(simulation);
}

void kt_phase_renew(const kt_simulation *simulation) {
    for (kt_hook_of_renew *const *hook = simulation->phases.renew; *hook != NULL; hook++)
        (*hook)(simulation);
}

void kt_phase_complete(kt_simulation *simulation) {
    for (kt_hook_of_complete *const *hook = simulation->phases.complete; *hook != NULL; hook++)
        (*hook)(simulation);
}

void kt_phase_interrupt(kt_simulation *simulation) {
    for (kt_hook_of_interrupt *const *hook = simulation->phases.interrupt; *hook != NULL; hook++)
        (*hook)(simulation);
}

void kt_phase_forget(kt_simulation *simulation) {
    for (kt_hook_of_forget *const *hook = simulation->phases.forget; *hook != NULL; hook++)
        (*hook)(simulation);
}

void kt_phase_resume(kt_simulation *simulation) {
    for (kt_hook_of_resume *const *hook = simulation->phases.resume; *hook != NULL; hook++)
        (*hook)(simulation);
}

void kt_phase_reset(kt_simulation *simulation) {
    for (kt_hook_of_reset *const *hook = simulation->phases.reset; *hook != NULL; hook++)
        (*hook)(simulation);
}

kt_status kt_phase_settle(kt_simulation *simulation, kt_error *error) {
    kt_status status = KT_OK;
    for (kt_hook_of_settle *const *hook = simulation->phases.settle; status == KT_OK && *hook != NULL; hook++)
        status = (*hook)(simulation, error);
    return status;
}

kt_status kt_phase_arrive(kt_simulation *simulation, kt_error *error) {
    kt_status status = KT_OK;
    for (kt_hook_of_arrive *const *hook = simulation->phases.arrive; status == KT_OK && *hook != NULL; hook++)
        status = (*hook)(simulation, error);
    return status;
}

kt_status kt_simulation_fire(kt_simulation *simulation, kt_recorder *recorder, void *user, kt_error *error) {
    kt_status status = KT_OK;
    kt_hook_of_fire *const *hook = simulation->phases.fire;
    for (; status == KT_OK && simulation->memory.fires && *hook != NULL; hook++)
        status = (*hook)(simulation, recorder, user, error);
    return status;
}
