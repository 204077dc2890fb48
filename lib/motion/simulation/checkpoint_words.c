/* The words of a checkpoint, with their ranges (base/block_words.h).
 *
 * A checkpoint comes from outside: its sums detect accidents, but anybody can compute valid sums. Therefore each word
 * that the program uses as an index, a count, a flag or a sign has a range in this file. Other numbers may have any
 * value, because a step that computes with them ends with an error at worst. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/block_words.h"
#include "simulation/checkpoint.h"

/* Member, and its range. `of` is the simulation. */
#define KT_MEMORY_WORDS(X)                                                                                             \
    X(next_record, KT_BLOCK_COUNT)                                                                                     \
    X(recorded, KT_BLOCK_COUNT)                                                                                        \
    X(now.torque, KT_BLOCK_YES_NO)                                                                                     \
    X(now.wrenches, KT_BLOCK_YES_NO)                                                                                   \
    X(next.torque, KT_BLOCK_YES_NO)                                                                                    \
    X(next.wrenches, KT_BLOCK_YES_NO)                                                                                  \
    X(pending, KT_BLOCK_YES_NO)                                                                                        \
    X(changed, KT_BLOCK_YES_NO)                                                                                        \
    X(refined, KT_BLOCK_YES_NO)                                                                                        \
    X(balance_evaluations, KT_BLOCK_COUNT)                                                                             \
    X(joined, KT_BLOCK_COUNT)                                                                                          \
    X(cut, KT_BLOCK_COUNT)                                                                                             \
    X(piece, KT_BLOCK_ANY)                                                                                             \
    X(sought, KT_BLOCK_COUNT)                                                                                          \
    X(before, KT_BLOCK_COUNT)                                                                                          \
    X(factorizations, KT_BLOCK_COUNT)                                                                                  \
    X(iterations.position, KT_BLOCK_COUNT)                                                                             \
    X(iterations.velocity, KT_BLOCK_COUNT)                                                                             \
    X(iterations.assembly, KT_BLOCK_COUNT)                                                                             \
    X(iterations.capped, KT_BLOCK_COUNT)                                                                               \
    X(crossings.near, KT_BLOCK_COUNT)                                                                                  \
    X(crossings.interpolated, KT_BLOCK_COUNT)                                                                          \
    X(crossings.error, KT_BLOCK_ANY)                                                                                   \
    X(crossings.smallest, KT_BLOCK_ANY)                                                                                \
    X(crossings.bend, KT_BLOCK_ANY)                                                                                    \
    X(crossings.since, KT_BLOCK_ANY)                                                                                   \
    X(corrections.most, KT_BLOCK_ANY)                                                                                  \
    X(corrections.time, KT_BLOCK_ANY)                                                                                  \
    X(corrections.fastest, KT_BLOCK_ANY)                                                                               \
    X(corrections.v, 0.0, of->size.nv > 0 ? (double)of->size.nv - 1.0 : 0.0)                                           \
    X(powers.count, 0.0, KT_POWER_POINTS)                                                                              \
    X(powers.t, KT_BLOCK_ANY)                                                                                          \
    X(powers.d, KT_BLOCK_ANY)                                                                                          \
    X(powers.before, KT_BLOCK_ANY)                                                                                     \
    X(powers.size, KT_BLOCK_ANY)                                                                                       \
    X(powers.sum[0].net, KT_BLOCK_ANY)                                                                                 \
    X(powers.sum[0].error, KT_BLOCK_ANY)                                                                               \
    X(powers.sum[0].turned, KT_BLOCK_ANY)                                                                              \
    X(powers.sum[1].net, KT_BLOCK_ANY)                                                                                 \
    X(powers.sum[1].error, KT_BLOCK_ANY)                                                                               \
    X(powers.sum[1].turned, KT_BLOCK_ANY)                                                                              \
    X(event_last, KT_BLOCK_ANY)                                                                                        \
    X(event_interval, KT_BLOCK_ANY)                                                                                    \
    X(event_chain, KT_BLOCK_ANY)                                                                                       \
    X(event_instants, KT_BLOCK_COUNT)                                                                                  \
    X(event_shrinking, KT_BLOCK_COUNT)                                                                                 \
    X(event_ratio, KT_BLOCK_ANY)                                                                                       \
    X(event_row, KT_BLOCK_COUNT)                                                                                       \
    X(stopped, 0.0, (double)of->events.count)                                                                          \
    X(set, KT_BLOCK_ANY)                                                                                               \
    KT_MEMORY_EVENT_WORDS(X)                                                                                           \
    X(leaps, 0.0, kt_bounds_steps(&of->options) ? 2.0 : 0.0)                                                           \
    X(beyond, 0.0, kt_simulation_contact_events(of) > 0)                                                               \
    X(fires, 0.0, of->events.count > 0)

#define KT_MEMORY_EVENT_WORDS(X)                                                                                       \
    X(event_since, KT_BLOCK_ANY)                                                                                       \
    X(event_many, KT_BLOCK_COUNT)                                                                                      \
    X(event_missed, KT_BLOCK_COUNT)                                                                                    \
    X(breakpoints, KT_BLOCK_COUNT)                                                                                     \
    X(event_cuts, 0.0, of->events.count > 0 ? 0x1p53 : 0.0)                                                            \
    X(event_cut_time, KT_BLOCK_ANY)                                                                                    \
    X(event_cut_of, 0.0, of->events.count > 0 ? (double)of->events.count - 1.0 : 0.0)                                  \
    X(contacts.count, KT_BLOCK_COUNT)                                                                                  \
    X(contacts.impacts, KT_BLOCK_COUNT)                                                                                \
    X(contacts.closings, KT_BLOCK_COUNT)                                                                               \
    X(contacts.openings, KT_BLOCK_COUNT)                                                                               \
    X(contacts.sticks, KT_BLOCK_COUNT)                                                                                 \
    X(contacts.slips, KT_BLOCK_COUNT)                                                                                  \
    X(contacts.rested, KT_BLOCK_COUNT)                                                                                 \
    X(contacts.reduced, KT_BLOCK_COUNT)                                                                                \
    X(contacts.undecided, KT_BLOCK_COUNT)                                                                              \
    X(contacts.shared, KT_BLOCK_COUNT)                                                                                 \
    X(contacts.unconverged, KT_BLOCK_COUNT)                                                                            \
    X(contacts.pivots, KT_BLOCK_COUNT)                                                                                 \
    X(contacts.jammed, KT_BLOCK_COUNT)                                                                                 \
    X(contacts.dissipated, KT_BLOCK_ANY)                                                                               \
    X(contacts.dropped, KT_BLOCK_ANY)                                                                                  \
    X(contacts.closed, KT_BLOCK_COUNT)                                                                                 \
    X(contacts.failures, KT_BLOCK_COUNT)                                                                               \
    X(contacts.supplied, KT_BLOCK_ANY)                                                                                 \
    X(contacts.penetration, KT_BLOCK_ANY)                                                                              \
    X(contacts.redundant, KT_BLOCK_COUNT)                                                                              \
    X(contacts.undecided_loop, 0.0, kt_loop_count(of->model) > 0 ? kt_loop_count(of->model) - 1.0 : 0.0)               \
    X(contacts.undecided_time, KT_BLOCK_ANY)                                                                           \
    X(excess.steps, KT_BLOCK_COUNT)                                                                                    \
    X(excess.most, KT_BLOCK_ANY)                                                                                       \
    X(excess.time, KT_BLOCK_ANY)                                                                                       \
    X(excess.loop, 0.0, kt_loop_count(of->model) > 0 ? kt_loop_count(of->model) - 1.0 : 0.0)                           \
    X(released, KT_BLOCK_ANY)                                                                                          \
    X(held, KT_BLOCK_ANY)                                                                                              \
    X(jumped, 0.0, kt_simulation_contact_events(of) > 0)                                                               \
    X(retried_since, KT_BLOCK_ANY)                                                                                     \
    X(step_grid, KT_BLOCK_ANY)                                                                                         \
    X(step_begun, KT_BLOCK_COUNT)                                                                                      \
    X(part_since, KT_BLOCK_ANY)                                                                                        \
    X(part_begun, KT_BLOCK_COUNT)                                                                                      \
    X(contacts.completed, KT_BLOCK_COUNT)                                                                              \
    X(completed.time, KT_BLOCK_ANY)                                                                                    \
    X(completed.records, KT_BLOCK_COUNT)                                                                               \
    X(retries, KT_BLOCK_COUNT)                                                                                         \
    X(own_time, KT_BLOCK_ANY)                                                                                          \
    X(slip_noise, KT_BLOCK_ANY)                                                                                        \
    X(shortened, KT_BLOCK_ANY)

#define KT_CONTACT_WORDS(X)                                                                                            \
    X(slip, KT_BLOCK_ANY)                                                                                              \
    X(speed, KT_BLOCK_ANY)                                                                                             \
    X(left_at, KT_BLOCK_ANY)                                                                                           \
    X(closes_at, KT_BLOCK_ANY)                                                                                         \
    X(parts_at, KT_BLOCK_ANY)                                                                                          \
    X(opens_at, KT_BLOCK_ANY)                                                                                          \
    X(since, KT_BLOCK_ANY)                                                                                             \
    X(fastest, KT_BLOCK_ANY)                                                                                           \
    X(stops_below, KT_BLOCK_ANY)                                                                                       \
    X(load, KT_BLOCK_ANY)                                                                                              \
    X(response, KT_BLOCK_ANY)                                                                                          \
    X(block, KT_BLOCK_COUNT)                                                                                           \
    X(held, KT_BLOCK_ANY)                                                                                              \
    X(reversals, KT_BLOCK_COUNT)                                                                                       \
    X(turns, KT_BLOCK_COUNT)                                                                                           \
    X(left, KT_BLOCK_COUNT)                                                                                            \
    X(force, KT_BLOCK_ANY)                                                                                             \
    X(closed, KT_BLOCK_YES_NO)                                                                                         \
    X(counted, KT_BLOCK_YES_NO)                                                                                        \
    X(shared, KT_BLOCK_YES_NO)                                                                                         \
    X(metric, KT_BLOCK_ANY)

#define KT_EVENT_WORDS(X)                                                                                              \
    X(side, -1.0, 1.0)                                                                                                 \
    X(count, KT_BLOCK_COUNT)                                                                                           \
    X(size, KT_BLOCK_ANY)                                                                                              \
    X(breakpoint, KT_BLOCK_ANY)                                                                                        \
    X(off, KT_BLOCK_YES_NO)

#define KT_ROOT_WORDS(X)                                                                                               \
    X(due, KT_BLOCK_YES_NO)                                                                                            \
    X(recorded, KT_BLOCK_YES_NO)                                                                                       \
    X(side, -1.0, 1.0)                                                                                                 \
    X(time, KT_BLOCK_ANY)

/* The parts that are structs: name, type, number, bytes that no member takes, words. One list checks all. */
#define KT_CHECKPOINT_STRUCTS(X)                                                                                       \
    X(memory, kt_simulation_memory, 1, 13, KT_MEMORY_WORDS)                                                            \
    KT_CHECKPOINT_EVENT_STRUCTS(X)
#define KT_CHECKPOINT_EVENT_STRUCTS(X)                                                                                 \
    X(contact_state, kt_contact_memory, of->size.contacts, 0, KT_CONTACT_WORDS)                                        \
    X(event_memory, kt_event_memory, of->size.event, 0, KT_EVENT_WORDS)                                                \
    X(event_root, kt_event_root, of->size.event, 0, KT_ROOT_WORDS)

/* Structs of one type, and their words. */
typedef struct kt_struct_words {
    const char *part;
    size_t count, size; /* structs, and bytes of each */
    const kt_block_word *words;
    size_t word_count;
} kt_struct_words;

static kt_status check_structs(const void *from, const kt_struct_words *of, kt_error *error) {
    double value = 0.0;
    for (size_t i = 0; i < of->count; i++) {
        const char *at = (const char *)from + i * of->size;
        const kt_block_word *wrong = kt_block_find_wrong(at, of->words, of->word_count, &value);
        if (wrong != NULL)
            return kt_error_set(error, KT_ERROR_ARGUMENT, "checkpoint",
                                "it is damaged: '%s' of its part '%s' is %.9g, which is out of range", wrong->name,
                                of->part, value);
    }
    return KT_OK;
}

kt_status kt_checkpoint_check_words(const kt_simulation *of, const kt_checkpoint_structs *from, kt_error *error) {
    kt_status status = KT_OK;
#define KT_WORD_SIZE(member, ...) +sizeof(((kt_part_struct *)0)->member)
#define KT_WORD_ENTRY(member, ...) KT_BLOCK_WORD(kt_part_struct, member, __VA_ARGS__),
#define KT_CHECK_STRUCTS(part, type, number, gaps, list)                                                               \
    if (status == KT_OK) {                                                                                             \
        typedef type kt_part_struct;                                                                                   \
        _Static_assert(0 list(KT_WORD_SIZE) + (gaps) >= sizeof(type), "each member of " #type " needs a word here");   \
        const kt_block_word words[] = {list(KT_WORD_ENTRY)};                                                           \
        const kt_struct_words of_part = {#part, (number), sizeof(type), words, sizeof words / sizeof *words};          \
        status = check_structs(from->part, &of_part, error);                                                           \
    }
    /* cppcheck-suppress nullPointer ; operands of sizeof are not evaluated */
    KT_CHECKPOINT_STRUCTS(KT_CHECK_STRUCTS)
#undef KT_CHECK_STRUCTS
    return status;
}
