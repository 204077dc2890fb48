/* The functions of a simulation, for the files of this folder and of those above it. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SIMULATION_SIMULATION_H
#define KT_SIMULATION_SIMULATION_H

#include "kinetree/expression.h"
#include "kinetree/integrator.h"
#include "step/simulation_core.h"

/* Bytes of the parts' own memory, and its initialisation (part_list.c). */
size_t kt_simulation_measure_parts(const kt_simulation_sizes *size);
void kt_simulation_place_parts(kt_simulation *simulation);

/* The parts of this room. */
extern const kt_part kt_input_part, kt_gap_part, kt_leap_part, kt_event_part, kt_count_part, kt_balance_part,
    kt_power_part, kt_failure_part;

/* The model of small motions about the present state, in which all contacts that rest are closed. */
const kt_model *kt_simulation_resting_model(kt_simulation *simulation);

/* The estimate of the work done from powers at the ends of steps (work_watch.c), if the options request it. */
kt_work_estimate kt_simulation_work_estimate(const kt_simulation *simulation, double t);

/* Writes the state at a time within the last step, with closed loops, to `y`. */
KT_CHECKED kt_status kt_simulation_between(kt_simulation *simulation, double t, kt_error *error);

/* The work done at a time within a refined step, or at its end. Returns false if the work cannot be computed. */
bool kt_simulation_works_at(kt_simulation *simulation, double t, kt_work *work);

/* Computes the reactions and multipliers of a record; leaves the kinematics of its motion in data. Multipliers that are
 * not reported are only checked: contacts that share a load in several ways may have any multipliers within bounds. */
KT_CHECKED kt_status kt_simulation_react(kt_simulation *simulation, double t, const double *y, bool reported,
                                         kt_error *error);

/* Inputs or a parameter were set, which the next step will put into force. Makes their part active. */
void kt_simulation_await_inputs(kt_simulation *simulation);

/* Puts inputs that were set since the last step into force for the next step. */
KT_CHECKED kt_status kt_simulation_inputs_commit(kt_simulation *simulation, kt_error *error);

/* Returns KT_OK, or KT_ERROR_ARGUMENT at "record" if one of the bits is not in KT_RECORD_LIST. */
KT_CHECKED kt_status kt_record_check(unsigned record, kt_error *error);

/* Whether a method has a stage at the end of each step (gap.c). */
bool kt_simulation_has_end_stage(const kt_method *method);

/* Adds the iterations and crossings since the last call to the counts. */
void kt_simulation_count(kt_simulation *simulation);

/* Counts an instant of events, at which event k happens (event_chain.c). Returns an error if such instants have no
 * end. The second function counts a step that ended without an event; `missed`: the step should have ended at event k.
 * Returns an error if too many steps in turn miss their event. */
KT_CHECKED kt_status kt_simulation_count_instant(kt_simulation *simulation, size_t k, double t, kt_error *error);
KT_CHECKED kt_status kt_simulation_count_miss(kt_simulation *simulation, bool missed, size_t k, kt_error *error);

/* Hands over the record of an event at the present time. */
KT_CHECKED kt_status kt_simulation_record_event(kt_simulation *simulation, const kt_event *event, kt_recorder *recorder,
                                                void *user, kt_error *error);

/* Returns KT_OK, or KT_ERROR_ARGUMENT at `call` if the call comes from within a function of the caller that must not
 * make this call (kt_simulation.within). */
KT_CHECKED kt_status kt_simulation_require_outermost(const kt_simulation *simulation, const char *call,
                                                     kt_error *error);

/* The part of kt_simulation_run before its first record. */
KT_CHECKED kt_status kt_simulation_begin_run(kt_simulation *simulation, kt_error *error);

/* Whether kt_simulation_run has a record to hand over at the current time, or before. */
bool kt_simulation_owes_record(const kt_simulation *simulation);

/* The parts of a record, for callers that compute the records of several simulations together (batch/ensemble.c).
 *
 * Begins record k, without a state. */
void kt_simulation_begin_record(kt_simulation *simulation, int64_t k, kt_record *record);
/* Begins record k, with its state in y. */
KT_CHECKED kt_status kt_simulation_read_record(kt_simulation *simulation, int64_t k, kt_record *record, kt_error *from);
/* Computes the requested values of a record and passes the record on. status, from: the result of reading the state of
 * the record. */
KT_CHECKED kt_status kt_simulation_complete_record(kt_simulation *simulation, kt_status status, kt_record *record,
                                                   kt_error *from, kt_recorder *recorder, void *user, kt_error *error);
/* Hands over a record that is complete. */
KT_CHECKED kt_status kt_simulation_give_record(kt_simulation *simulation, const kt_record *record,
                                               kt_recorder *recorder, void *user, kt_error *error);

/* Hands over the records up to the current time. */
KT_CHECKED kt_status kt_simulation_hand_over(kt_simulation *simulation, kt_recorder *recorder, void *user,
                                             kt_error *error);

/* The body whose joint has the component `at` of the state y; 0: none. */
int kt_simulation_body_of(const kt_simulation *simulation, size_t at);

/* Parts of the search of events (event_chain.c). The first function stores the error of an event, unless the cause of a
 * failed evaluation is known. The second function returns whether a contact changes its side within the last step, but
 * not at the instant that is due. */
void kt_simulation_store_cause(kt_simulation *simulation, const kt_error *error);
bool kt_simulation_skips_contact(const kt_simulation *simulation);
/* Whether slip of contact k rests at the end of the last step, up to its rest velocity. */
bool kt_simulation_ends_slip(const kt_simulation *simulation, size_t k);
/* Whether rounding of the state may hide that contact k closes: the contact touches, and the last step has not changed
 * the gap. Unless the step is brief, no sample of the step shows another gap. */
bool kt_simulation_hides_contact(const kt_simulation *simulation, size_t k, bool is_brief);

/* Reports an error of the integrator or of a callback, preceded by the time. */
kt_status kt_simulation_fail(const kt_simulation *simulation, const kt_error *from, kt_error *error);
/* Adds the cause to an error that a flat disc produces. */
kt_status kt_simulation_explain_disc(kt_simulation *simulation, kt_status status, kt_error *error);

/* Skips the records before the current time, which kt_simulation_run has not handed over. */
void kt_simulation_skip_records(kt_simulation *simulation);

/* The time of record k (s). */
double kt_simulation_record_time(const kt_simulation *simulation, int64_t k);

/* The number of records: see kt_simulation_record_count. */
double kt_record_intervals(double duration, double interval);

#endif
