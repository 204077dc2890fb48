/* Checks of a checkpoint's memory and history. The contents come from outside and may have any bits. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/block_words.h"
#include "integrator/newton.h"

#include <float.h>

/* All words of kt_integrator_memory. */
#define WORD(member, ...) KT_BLOCK_WORD(kt_integrator_memory, member, __VA_ARGS__)
static const kt_block_word memory_words[] = {
    WORD(t, KT_BLOCK_FINITE),
    WORD(previous_t, KT_BLOCK_FINITE),
    WORD(origin, KT_BLOCK_FINITE),
    WORD(grid, -0x1p53, 0x1p53),
    WORD(last_step, KT_BLOCK_FINITE),
    WORD(next_step, 0.0, DBL_MAX),
    WORD(last_error, KT_BLOCK_ANY),
    WORD(control_error, DBL_TRUE_MIN, DBL_MAX),
    WORD(advanced, 0.0, DBL_MAX),
    WORD(window, KT_BLOCK_COUNT),
    WORD(slow, KT_BLOCK_COUNT),
    WORD(on_grid, KT_BLOCK_YES_NO),
    WORD(has_previous, KT_BLOCK_YES_NO),
    WORD(counts.steps, KT_BLOCK_COUNT),
    WORD(counts.rejected, KT_BLOCK_COUNT),
    WORD(counts.evaluations, KT_BLOCK_COUNT),
    WORD(counts.capped, KT_BLOCK_COUNT),
    WORD(counts.jacobians, KT_BLOCK_COUNT),
    WORD(counts.factorizations, KT_BLOCK_COUNT),
    WORD(counts.switches, KT_BLOCK_COUNT),
};
#undef WORD

/* If a member lacks a word in the list, this assertion fails. */
_Static_assert(sizeof(kt_integrator_memory) == 18 * sizeof(double) + 2 * sizeof(int32_t),
               "each member of kt_integrator_memory needs a word in memory_words");

static kt_status reject_word(const char *name, double value, kt_error *error) {
    return kt_error_set(error, KT_ERROR_ARGUMENT, "checkpoint",
                        "it is damaged: '%s' of the integrator is %.9g, which is out of range", name, value);
}

static const double *word_in_history(const kt_integrator *it, const double *history, const kt_history_word *word) {
    switch (word->part) {
    case KT_HISTORY_START:
        return history + word->at;
    case KT_HISTORY_METHOD:
        return history + (kt_newton_history(it) - it->history) + word->at;
    default:
        return history + it->sizes.history - word->at;
    }
}

static kt_status check_history(const kt_integrator *it, const double *history, kt_error *error) {
    const size_t wrong = kt_first_not_finite(history, it->sizes.history);
    if (wrong < it->sizes.history)
        return reject_word("history", history[wrong], error);
    for (const kt_history_word *word = it->family->words; word != NULL && word->name != NULL; word++) {
        const double value = *word_in_history(it, history, word);
        if (!(word->first <= value && value <= word->last))
            return reject_word(word->name, value, error);
    }
    return KT_OK;
}

kt_status kt_integrator_check_memory(const kt_integrator *it, const kt_integrator_memory *memory, const double *history,
                                     kt_error *error) {
    double value = 0.0;
    const kt_block_word *wrong =
        kt_block_find_wrong(memory, memory_words, sizeof memory_words / sizeof *memory_words, &value);
    if (wrong != NULL)
        return reject_word(wrong->name, value, error);
    if (memory->window > memory->counts.steps + memory->counts.rejected)
        return reject_word("window", (double)memory->window, error);
    if (memory->has_previous && memory->last_step == 0.0) /* dense output divides by the step */
        return reject_word("last_step", memory->last_step, error);
    return check_history(it, history, error);
}
