/* The functions of a simulation, for the files of this folder and of those above it. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SIMULATION_SIMULATION_H
#define KT_SIMULATION_SIMULATION_H

#include "kinetree/expression.h"
#include "kinetree/integrator.h"
#include "step/simulation_struct.h"

/* Adds an event whose name is known to be free, and for which there is room. */
void kt_event_append(kt_simulation *simulation, const kt_event *event);

/* Bytes of the parts' own memory, and its initialisation (part_list.c). */
size_t kt_simulation_measure_parts(const kt_simulation_sizes *size);
void kt_simulation_place_parts(kt_simulation *simulation);
/* The parts, in the files of their features. */
extern const kt_part kt_input_part, kt_jump_part, kt_retry_part, kt_breakpoint_part, kt_missed_end_part,
    kt_missed_piece_part, kt_gap_part, kt_leap_part, kt_slip_part, kt_event_part, kt_contact_part, kt_moreau_part,
    kt_count_part, kt_balance_part, kt_power_part, kt_newton_part, kt_state_part, kt_failure_part;

/* The sizes that differ between the variants of a model (model/switching.h). X(member) */
#define KT_SIMULATION_OF_MODEL(X) X(gap) X(multiplier) X(free) X(basis) X(along) X(stiffness_work)

/* Sets the values that follow from the integrated model, except its sizes: at the start, and after a change to another
 * variant. */
void kt_simulation_follow_model(kt_simulation *simulation);

/* Changes to another variant of the model. After this call, the state, the data and the integrator's history still
 * belong to the earlier variant. */
void kt_simulation_take_model(kt_simulation *simulation, const kt_model *model);

/* Lists the hard contacts and adds their events before all others (contacts.c). `simulation` has its model, data and
 * memory. */
KT_CHECKED kt_status kt_contacts_init(kt_simulation *simulation, kt_error *error);

/* The model of small motions about the present state, in which all contacts that rest are closed. */
const kt_model *kt_simulation_resting_model(kt_simulation *simulation);

/* A change of the state that may fail although hard contacts have been opened or committed (jump.c). The first function
 * returns the bytes of simulation->undo. kt_simulation_begin_change stores the persistent state and the integrator.
 * kt_simulation_end_change restores them if the change failed, and returns its status. Both do nothing without hard
 * contacts. Parameters of the model are not restored. Changes do not nest. Cost: O(the memory of the integrator). */
size_t kt_simulation_undo_size(const kt_simulation_sizes *size);
void kt_simulation_begin_change(kt_simulation *simulation);
kt_status kt_simulation_end_change(kt_simulation *simulation, kt_status status);

/* Frees a contact that friction wedges, from the attempt *attempt on. Returns whether a step may be tried. */
bool kt_contacts_free_wedged(kt_simulation *simulation, int *attempt);

/* Kinetic energy, and potential energy including the energy that effects store, in the state y. */
typedef struct kt_simulation_energy {
    double kinetic, potential;
} kt_simulation_energy;
KT_CHECKED kt_status kt_simulation_find_energy(kt_simulation *simulation, const double *y, kt_simulation_energy *energy,
                                               kt_error *error);
/* Computes the kinetic energy d'M d / 2 which a projection of v onto the loops dissipates; d is the change from v to
 * the velocities in y (switch.c). Overwrites simulation->a. */
KT_CHECKED kt_status kt_simulation_find_loss(kt_simulation *simulation, const double *v, const double *y, double *loss,
                                             kt_error *error);
/* A jump of the state at the present time: a change, a switch, or an impact. A jump has three parts (jump.c).
 *
 * kt_simulation_begin_jump computes the energy before the jump, if a balance or `needed` requires it.
 *
 * kt_simulation_add_jump adds the jump to the work done in y, if the work is computed. The energy grows by `gain`. If
 * `driven`, `lost` is dissipated, and moving constraints supply the rest. Otherwise a gain counts as supplied, and a
 * loss as dissipated.
 *
 * kt_simulation_land makes y the state, and forgets the results of the motion before the jump. The user model's state
 * becomes `to`. */
KT_CHECKED kt_status kt_simulation_begin_jump(kt_simulation *simulation, bool needed, kt_simulation_energy *before,
                                              kt_error *error);
void kt_simulation_add_jump(kt_simulation *simulation, double gain, double lost, bool driven);
KT_CHECKED kt_status kt_simulation_land(kt_simulation *simulation, const double *to, const kt_simulation_energy *before,
                                        const kt_simulation_energy *after, kt_error *error);
/* Whether the energies at a jump are needed: for a balance, or for an estimate of the work done. */
static inline bool kt_simulation_accounts(const kt_simulation *simulation) {
    return simulation->size.integrates_works || simulation->works.watches;
}

/* Writes the state at a time within the last step, with closed loops, to `y`. */
KT_CHECKED kt_status kt_simulation_between(kt_simulation *simulation, double t, kt_error *error);

/* The work done at a time within a refined step, or at its end. Returns false if the work cannot be computed. */
bool kt_simulation_works_at(kt_simulation *simulation, double t, kt_work *work);
/* The powers in a state y, under the inputs of the last step. Returns the values of a callback. */
KT_CHECKED int kt_simulation_power(kt_simulation *simulation, double t, const double *y, kt_power *power,
                                   kt_error *error);

/* Updates masses that vary to the time t, for queries of the simulation's data. */
static inline kt_status kt_simulation_date_masses(const kt_simulation *simulation, double t, kt_error *error) {
    if (simulation->model->n.varying > 0)
        return kt_masses_update(simulation->model, simulation->data, t, error);
    (void)simulation, (void)t, (void)error;
    return KT_OK;
}

/* The estimate of the work done from powers at the ends of steps (work_watch.c), if the options request it.
 *
 * Receives the power that an evaluation of the state y has computed along with its slope dydt. */
void kt_simulation_take_power(kt_simulation *simulation, const double *y, const double *dydt, kt_power power);
/* Notes a power at the present time, once (power_points.c). */
void kt_simulation_note_power(kt_simulation *simulation, kt_power power);
kt_work_estimate kt_simulation_work_estimate(const kt_simulation *simulation, double t);

/* Returns the callbacks for the integrator. */
kt_integrator_callbacks kt_simulation_callbacks(kt_simulation *simulation);

/* The noise that rounding causes in accelerations next to singular positions. */
extern const struct kt_noise kt_simulation_noise;

/* Newton's equations of an implicit method, in second-order form (second_order_newton.c), and the sizes of their
 * arrays.
 * */
extern const kt_newton kt_simulation_newton;
void kt_simulation_newton_measure(const kt_model *model, bool exact, kt_simulation_sizes *size);

/* Computes the accelerations a (nv) at (t, y) with the engine's equations or the caller's. Returns the values of a
 * callback. */
KT_CHECKED int kt_simulation_accelerate(kt_simulation *simulation, double t, const double *y, const double *tau,
                                        const kt_wrench *external, double *a, kt_error *error);

/* Points tau and external at the inputs of the last step. */
void kt_simulation_inputs_use(kt_simulation *simulation);

/* Scales quaternions in y = (q, v) to unit norm and closes the loops. *changed: whether a bit of y was. */
KT_CHECKED kt_status kt_simulation_project(kt_simulation *simulation, double t, double *y, bool *changed,
                                           kt_error *error);

/* The time at which the loops of a state at t are closed. If a prescribed position or velocity jumps within rounding of
 * t, this time is on the side of the step. */
double kt_simulation_closing_time(const kt_simulation *simulation, double t);

/* The next three functions serve simulations with a transformation (user_model.c). Only the second one may be called
 * without a transformation.
 *
 * Converts forces on the user model, which has some, to wrenches on the bodies of the model at its positions q. */
void kt_simulation_inputs(kt_simulation *simulation, const double *q, const double **tau, const kt_wrench **external);
/* Converts a state near the current time, and accelerations (or NULL), to the user model's coordinates. */
void kt_simulation_export(kt_simulation *simulation, double t, const double *y, const double *a, const double **q,
                          const double **v, const double **exported_a);
/* Computes the state y of the model from a closed state of the user model. */
KT_CHECKED kt_status kt_simulation_import_state(kt_simulation *simulation, double t, const double *q, const double *v,
                                                double *y, kt_error *error);

/* The bits that request reactions at each record. */
enum {
    KT_RECORD_REACTIONS = KT_RECORD_REACTION | KT_RECORD_MULTIPLIER | KT_RECORD_BEARING,
    KT_RECORD_ACCELERATIONS = KT_RECORD_ACCELERATION | KT_RECORD_MARKER_ACCELERATION | KT_RECORD_ANGULAR_ACCELERATION,
    /* evaluated from the kinematics by the receiver of the record */
    KT_RECORD_KINEMATICS = KT_RECORD_MOMENTUM | KT_RECORD_ORIENTATION | KT_RECORD_MARKER_VELOCITY |
                           KT_RECORD_MARKER_ACCELERATION | KT_RECORD_EFFECT | KT_RECORD_CLOSURE |
                           KT_RECORD_ANGULAR_VELOCITY | KT_RECORD_ANGULAR_ACCELERATION
};

/* Computes the reactions and multipliers of a record; leaves the kinematics of its motion in data. */
KT_CHECKED kt_status kt_simulation_react(kt_simulation *simulation, double t, const double *y, kt_error *error);

/* Puts inputs that were set since the last step into force for the next step. */
KT_CHECKED kt_status kt_simulation_inputs_commit(kt_simulation *simulation, kt_error *error);

/* Returns KT_OK, or KT_ERROR_ARGUMENT at "record" if one of the bits is not in KT_RECORD_LIST. */
KT_CHECKED kt_status kt_record_check(unsigned record, kt_error *error);

/* The first function returns whether functions of time or a caller's effects have breakpoints. The second function
 * returns whether functions of loops have breakpoints. The third function returns the longest step that samples
 * functions between their breakpoints, HUGE_VAL for polynomials. Cost: O(loops + effects). */
bool kt_simulation_has_breakpoints(const kt_model *model);
bool kt_simulation_has_motion_breakpoints(const kt_model *model);
double kt_simulation_longest_step(const kt_model *model);

/* The shortest piece of a function of time between two breakpoints, or a quarter of a sine's period. Pieces count if
 * they begin and end within the duration. HUGE_VAL if no piece counts. Cost: O(breakpoints). */
KT_INNER double kt_simulation_shortest_feature(const kt_model *model, double duration);

/* Ends steps at breakpoints. The first function comes before a step, or before the slope at the present time is
 * requested. At a breakpoint with a jump of the accelerations, the function discards the slopes of earlier steps and
 * the last step's interpolant. If the speed of a drive jumps, velocities jump with it (jump.c). The second function, a
 * part of the first one, finds the next breakpoint if the present time is beyond the last breakpoint. Returns whether
 * the accelerations jump at the present time, and in *strikes whether the speed of a drive jumps. */
KT_CHECKED kt_status kt_simulation_pass_breakpoint(kt_simulation *simulation, kt_error *error);
/* Must precede another jump of the state: if the speed of a drive jumps at the present time, applies this jump first.
 * The jump remains applied if the other jump fails. */
KT_CHECKED kt_status kt_simulation_strike_due(kt_simulation *simulation, kt_error *error);
bool kt_simulation_pass_piece(kt_simulation *simulation, bool *strikes);

/* Whether the method has a stage between the ends of its steps. */
bool kt_simulation_has_inner_stage(const kt_method *method);

/* After a checkpoint: restores the breakpoints at both ends of the step that ended at the present time. */
void kt_simulation_recall_breakpoints(kt_simulation *simulation);

/* Lets breakpoints be searched anew, since functions of time, or the time itself, have changed. */
void kt_simulation_forget_breakpoints(kt_simulation *simulation);
/* Renews the breakpoints after a change of the state at a jump. Forces at this time remain the forces after the
 * jump. */
void kt_simulation_renew_breakpoints(kt_simulation *simulation);

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
void kt_simulation_note_cause(kt_simulation *simulation, const kt_error *error);
bool kt_simulation_skips_contact(const kt_simulation *simulation);
/* Whether slip of contact k rests at the end of the last step, up to its rest velocity. */
bool kt_simulation_ends_slip(const kt_simulation *simulation, size_t k);
/* Whether rounding of the state may hide that contact k closes: the contact touches, and the last step has not changed
 * the gap. Unless the step is brief, no sample of the step shows another gap. */
bool kt_simulation_hides_contact(const kt_simulation *simulation, size_t k, bool is_brief);

/* Whether a smaller step may avoid an error. */
bool kt_simulation_is_recoverable(kt_status status);

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

/* Returns the first breakpoint after t of formulas of time alone, for kt_event.breakpoint; HUGE_VAL: no such
 * breakpoint. The search shares its operations with all other searches of the run (breakpoint.c). A search that runs
 * out of operations is counted with its step. */
KT_INNER double kt_simulation_next_feature(kt_simulation *simulation, const kt_expression *const *parts, int count,
                                           double t);

/* Copies parameters that kt_parameter_set has set to the model that the simulation runs on, since the model of a set of
 * masked contacts has copies of some numbers (contact/mask.h). Steps, runs, records and accelerations make this call
 * themselves. A caller that evaluates the model in between must call this function first.
 * Cost: a comparison of two revisions if nothing has been set. */
KT_INNER void kt_simulation_renew_model(const kt_simulation *simulation);

#endif
