/* The parts of a simulation, and the phases in which they act.
 *
 * A simulation is a model, data, an integrator, a state, and a list of parts. A part is one feature of simulations:
 * inputs, breakpoints, gaps, events, contacts, work done, counts. Most simulations need few of them. Therefore the core
 * (take_step.c) calls no feature by its name. A part is a table of hooks, which are functions for the phases in which
 * the part acts. Each phase has a list of the hooks of all active parts, so that an inactive part costs nothing.
 *
 * A step has these phases, in this order: start, enter, limit, begin, prepare, check, accept, retry, count, explain or
 * finish (take_step.c). The other phases belong to changes from outside and to records.
 *
 * A new part is one file with one table, and one line in the list of all parts (simulation/part_list.c). The order of
 * this list is the order of the hooks in each phase.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_STEP_PHASES_H
#define KT_STEP_PHASES_H

#include "base/arena.h"
#include "kinetree/record.h"
#include "kinetree/simulation.h"

typedef struct kt_simulation_sizes kt_simulation_sizes;

/* The tries of a step. */
typedef struct kt_step_progress {
    double t_limit; /* s, the time that the next try must not pass */
    int undone;     /* the number of tries that parts have undone */
} kt_step_progress;

/* The verdict of a part on a try that the integrator has accepted. */
typedef enum kt_verdict {
    KT_VERDICT_ACCEPT = 0,
    KT_VERDICT_REPEAT, /* the part has undone the try; t_limit is the end of the next one */
    KT_VERDICT_STAY    /* the part has undone the try, and the step ends at its beginning */
} kt_verdict;

/* All phases: result, name, parameters, meaning. One list declares the types of hooks, the members of a part, and the
 * lists of a simulation. */
#define KT_PHASES_OF_STEP(X)                                                                                           \
    X(kt_status, start, (kt_simulation *, kt_error *), "a step, a run or an evaluation begins")                        \
    X(kt_status, enter, (kt_simulation *, const kt_step_progress *, kt_error *),                                       \
      "forces of the step are put in force")                                                                           \
    X(void, limit, (kt_simulation *, kt_step_progress *), "the step is shortened")                                     \
    X(kt_status, begin, (kt_simulation *, kt_error *), "values at the beginning are computed")                         \
    X(void, prepare, (kt_simulation *, kt_step_progress *), "the integrator is about to try a step")                   \
    X(kt_status, check, (kt_simulation *, kt_step_progress *, kt_verdict *, kt_error *), "a try is judged")            \
    X(kt_status, accept, (kt_simulation *, kt_error *), "all parts accept the try; an error undoes it")                \
    X(bool, retry, (kt_simulation *, kt_step_progress *, kt_status), "the tries failed; true: begin once more")        \
    X(void, count, (kt_simulation *), "the step has ended, with or without success")                                   \
    X(kt_status, explain, (kt_simulation *, const kt_error *, kt_error *), "the step failed: reports the cause")       \
    X(void, finish, (kt_simulation *), "the step succeeded")                                                           \
    X(kt_status, arrive, (kt_simulation *, kt_error *), "records of the step are complete")                            \
    X(kt_status, fire, (kt_simulation *, kt_recorder *, void *, kt_error *), "events of the step take effect")

#define KT_PHASES_OF_CHANGES(X)                                                                                        \
    X(void, rebind, (kt_simulation *), "data belong to another variant of the model")                                  \
    X(void, renew, (const kt_simulation *), "parameters of the model may have been set")                               \
    X(const kt_model *, variant, (kt_simulation *, uint64_t), "chooses the model of a set of switches")                \
    X(void, complete, (kt_simulation *), "forces or the state are about to jump")                                      \
    X(void, interrupt, (kt_simulation *), "forces have jumped at the present time")                                    \
    X(void, forget, (kt_simulation *), "the state jumps: values from before are not valid any more")                   \
    X(void, reset, (kt_simulation *), "a state is about to be set that may lie anywhere")                              \
    X(kt_status, settle, (kt_simulation *, kt_error *), "the state was set, or has jumped")                            \
    X(kt_status, strike, (kt_simulation *, kt_error *), "velocities of drives jump at the present time")               \
    X(void, resume, (kt_simulation *), "the persistent state was copied back")

#define KT_PHASES_OF_RECORDS(X)                                                                                        \
    X(kt_status, admit, (kt_simulation *, double, kt_error *), "the last step is judged at the time of a record")      \
    X(kt_status, begin_record, (kt_simulation *, double, kt_error *), "forces of a record are put in force")           \
    X(kt_status, end_record, (kt_simulation *, kt_record *, kt_error *), "a record is complete")                       \
    X(kt_status, check_record, (const kt_simulation *, double, kt_error *), "multipliers of a record are judged")

#define KT_PHASES(X) KT_PHASES_OF_STEP(X) KT_PHASES_OF_CHANGES(X) KT_PHASES_OF_RECORDS(X)

#define KT_PHASE_TYPE(result, phase, parameters, meaning) typedef result kt_hook_of_##phase parameters;
KT_PHASES(KT_PHASE_TYPE)
#undef KT_PHASE_TYPE

#define KT_PHASE_MEMBER(result, phase, parameters, meaning) kt_hook_of_##phase *phase;
typedef struct kt_part {
    /* Whether the part is active, by the model and the options of the simulation. NULL: always. */
    bool (*is_active)(const kt_simulation *simulation);
    /* Set-up: returns the bytes of the part's own memory, and initialises the memory. NULL: the part has none. */
    size_t (*measure)(const kt_simulation_sizes *size);
    void (*init)(kt_simulation *simulation, void *memory);
    KT_PHASES(KT_PHASE_MEMBER) /* NULL: the part does not act in this phase */
} kt_part;
#undef KT_PHASE_MEMBER

/* The largest number of parts. */
enum { KT_PARTS_MOST = 24 };

/* The hooks of the active parts, a list for each phase, which NULL ends. */
#define KT_PHASE_LIST(result, phase, parameters, meaning) kt_hook_of_##phase *phase[KT_PARTS_MOST + 1];
typedef struct kt_phases {
    uint32_t active; /* a bit for each part of the list that was active */
    bool may_repeat; /* some part acts from `begin` to `retry`: a try that the integrator accepts may not be the step */
    KT_PHASES(KT_PHASE_LIST)
} kt_phases;
#undef KT_PHASE_LIST

/* Lists the hooks of the active parts among simulation->parts. Cost: O(parts), if the same are active as before. */
void kt_parts_list(kt_simulation *simulation);

/* Returns the bytes of the memory of all parts, and initialises the memory, which is clear. */
size_t kt_parts_measure(const kt_simulation_sizes *size, const kt_part *const *parts, size_t count);
void kt_parts_init(kt_simulation *simulation, void *memory);

/* Phases outside of steps. */
void kt_phase_rebind(kt_simulation *simulation);
void kt_phase_renew(const kt_simulation *simulation);
void kt_phase_complete(kt_simulation *simulation);
void kt_phase_interrupt(kt_simulation *simulation);
void kt_phase_forget(kt_simulation *simulation);
void kt_phase_reset(kt_simulation *simulation);
void kt_phase_resume(kt_simulation *simulation);
KT_CHECKED kt_status kt_phase_settle(kt_simulation *simulation, kt_error *error);

/* Phases of a step, for callers that try the steps of several simulations together (batch/ensemble.c). kt_phase_enter
 * sets the progress, and includes the phase `limit`. Each try takes three calls: kt_phase_prepare, an accepted step of
 * the integrator up to progress->t_limit, and kt_phase_check, which includes the phase `accept`. kt_phase_end includes
 * the phases `count` and, for an error `from` of the step, `explain`. */
KT_CHECKED kt_status kt_phase_start(kt_simulation *simulation, kt_error *error);
KT_CHECKED kt_status kt_phase_enter(kt_simulation *simulation, double t_limit, kt_step_progress *progress,
                                    kt_error *error);
KT_CHECKED kt_status kt_phase_begin(kt_simulation *simulation, kt_error *error);
void kt_phase_prepare(kt_simulation *simulation, kt_step_progress *progress);
KT_CHECKED kt_status kt_phase_check(kt_simulation *simulation, kt_step_progress *progress, bool *again,
                                    kt_error *error);
KT_CHECKED kt_status kt_phase_end(kt_simulation *simulation, kt_status status, const kt_error *from, kt_error *error);

/* Resolves what steps have left to their end, behind the records of the step (phase `arrive`). */
KT_CHECKED kt_status kt_phase_arrive(kt_simulation *simulation, kt_error *error);

/* Applies the events that happened at the present time and have not taken effect yet (phase `fire`): the events of the
 * last step, or the events that a previous call did not apply. Hands their records to the recorder, unless that is
 * NULL. */
KT_CHECKED kt_status kt_simulation_fire(kt_simulation *simulation, kt_recorder *recorder, void *user, kt_error *error);

/* Takes one step, of at most t_limit. Records are not handed over, and events at the end of the step have not taken
 * effect (memory.fires). */
KT_CHECKED kt_status kt_simulation_take_step(kt_simulation *simulation, double t_limit, kt_error *error);

#endif
