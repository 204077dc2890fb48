/* The core of a simulation: the equations that its integrator solves, jumps of the state, variants of the model, and
 * breakpoints. Hard contacts and the calls of a simulation (contact/, simulation/) use these functions. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_STEP_SIMULATION_CORE_H
#define KT_STEP_SIMULATION_CORE_H

#include "kinetree/expression.h"
#include "kinetree/integrator.h"
#include "step/simulation_struct.h"

/* The parts of this room. */
extern const kt_part kt_jump_part, kt_breakpoint_part, kt_missed_end_part, kt_missed_piece_part, kt_newton_part,
    kt_state_part;

/* The sizes that differ between the variants of a model (model/switching.h). X(member) */
#define KT_SIMULATION_OF_MODEL(X) X(gap) X(multiplier) X(free) X(basis) X(along) X(stiffness_work)

/* Sets the values that follow from the integrated model, except its sizes: at the start, and after a change to another
 * variant. */
void kt_simulation_follow_model(kt_simulation *simulation);

/* Changes to another variant of the model. After this call, the state, the data and the integrator's history still
 * belong to the earlier variant. */
void kt_simulation_take_model(kt_simulation *simulation, const kt_model *model);

/* Copies parameters that kt_parameter_set has set to the model that the simulation runs on, since the model of a set of
 * masked contacts has copies of some numbers (contact/mask.h). Steps, runs, records and accelerations make this call
 * themselves. A caller that evaluates the model in between must call this function first.
 * Cost: a comparison of two revisions if nothing has been set. */
KT_INNER void kt_simulation_renew_model(const kt_simulation *simulation);

/* Returns the callbacks for the integrator. */
kt_integrator_callbacks kt_simulation_callbacks(kt_simulation *simulation);

/* The noise that rounding causes in accelerations next to singular positions. */
extern const struct kt_noise kt_simulation_noise;

/* Computes the accelerations a (nv) at (t, y) with the engine's equations or the caller's. */
KT_CHECKED kt_status kt_simulation_accelerate(kt_simulation *simulation, double t, const double *y, const double *tau,
                                              const kt_wrench *external, double *a, kt_error *error);

/* The powers in a state y, under the inputs of the last step. */
KT_CHECKED kt_status kt_simulation_power(kt_simulation *simulation, double t, const double *y, kt_power *power,
                                         kt_error *error);

/* Scales quaternions in y = (q, v) to unit norm and closes the loops. *changed: whether a bit of y was. */
KT_CHECKED kt_status kt_simulation_project(kt_simulation *simulation, double t, double *y, bool *changed,
                                           kt_error *error);

/* The time at which the loops of a state at t are closed. If a prescribed position or velocity jumps within rounding of
 * t, this time is on the side of the step. */
double kt_simulation_closing_time(const kt_simulation *simulation, double t);

/* Whether a smaller step may avoid an error. */
bool kt_simulation_is_recoverable(kt_status status);

/* Points tau and external at the inputs of the last step. */
void kt_simulation_inputs_use(kt_simulation *simulation);

/* Updates masses that vary to the time t, for queries of the simulation's data. */
static inline kt_status kt_simulation_date_masses(const kt_simulation *simulation, double t, kt_error *error) {
    if (simulation->model->n.varying > 0)
        return kt_masses_update(simulation->model, simulation->data, t, error);
    (void)simulation, (void)t, (void)error;
    return KT_OK;
}

/* Newton's equations of an implicit method, in second-order form (second_order_newton.c), and the sizes of their
 * arrays. */
extern const kt_newton kt_simulation_newton;
void kt_simulation_newton_measure(const kt_model *model, bool exact, kt_simulation_sizes *size);

/* Kinetic energy, and potential energy including the energy that effects store, in the state y. */
typedef struct kt_simulation_energy {
    double kinetic, potential;
} kt_simulation_energy;
KT_CHECKED kt_status kt_simulation_find_energy(kt_simulation *simulation, const double *y, kt_simulation_energy *energy,
                                               kt_error *error);
/* Computes the kinetic energy d'M d / 2 which a projection of v onto the loops dissipates; d is the change from v to
 * the velocities in y. Overwrites simulation->a. */
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
 * kt_simulation_land makes y the state, and forgets the results of the motion before the jump. */
KT_CHECKED kt_status kt_simulation_begin_jump(kt_simulation *simulation, bool needed, kt_simulation_energy *before,
                                              kt_error *error);
void kt_simulation_add_jump(kt_simulation *simulation, double gain, double lost, bool driven);
KT_CHECKED kt_status kt_simulation_land(kt_simulation *simulation, const kt_simulation_energy *before,
                                        const kt_simulation_energy *after, kt_error *error);
/* Whether the energies at a jump are needed: for a balance, or for an estimate of the work done. */
static inline bool kt_simulation_accounts(const kt_simulation *simulation) {
    return simulation->size.integrates_works || simulation->works.watches;
}

/* A change of the state that may fail although hard contacts have been opened or committed (jump.c). The first function
 * returns the bytes of simulation->undo. kt_simulation_begin_change stores the persistent state and the integrator.
 * kt_simulation_end_change restores them if the change failed, and returns its status. Both do nothing without hard
 * contacts. Parameters of the model are not restored. Changes do not nest. Cost: O(the memory of the integrator). */
size_t kt_simulation_undo_size(const kt_simulation_sizes *size);
void kt_simulation_begin_change(kt_simulation *simulation);
kt_status kt_simulation_end_change(kt_simulation *simulation, kt_status status);

/* The first function returns whether functions of time or a caller's effects have breakpoints. The second function
 * returns whether functions of loops have breakpoints. The third function returns the longest step that samples
 * functions between their breakpoints, HUGE_VAL for polynomials. Cost: O(loops + effects). */
bool kt_simulation_has_breakpoints(const kt_model *model);
bool kt_simulation_has_motion_breakpoints(const kt_model *model);
double kt_simulation_longest_step(const kt_model *model);

/* The shortest piece of a function of time between two breakpoints, or a quarter of a sine's period. Pieces count if
 * they begin and end within the duration. HUGE_VAL if no piece counts. Cost: O(breakpoints). */
KT_INNER double kt_simulation_shortest_feature(const kt_model *model, double duration);

/* Returns the first breakpoint after t of formulas of time alone, for kt_event.breakpoint; HUGE_VAL: no such
 * breakpoint. The search shares its operations with all other searches of the run (breakpoint.c). A search that runs
 * out of operations is counted with its step. */
KT_INNER double kt_simulation_next_feature(kt_simulation *simulation, const kt_expression *const *parts, int count,
                                           double t);

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

/* For the estimate of the work done (simulation/work_watch.c): receives the power that an evaluation of the state y has
 * computed along with its slope dydt. */
void kt_simulation_take_power(kt_simulation *simulation, const double *y, const double *dydt, kt_power power);
/* Notes a power at the present time, once (power_points.c). */
void kt_simulation_add_power_point(kt_simulation *simulation, kt_power power);

/* Adds an event whose name is known to be free, and for which there is room. */
void kt_event_append(kt_simulation *simulation, const kt_event *event);

/* The bits that request reactions at each record. */
enum {
    KT_RECORD_REACTIONS = KT_RECORD_REACTION | KT_RECORD_MULTIPLIER | KT_RECORD_BEARING,
    KT_RECORD_ACCELERATIONS = KT_RECORD_ACCELERATION | KT_RECORD_MARKER_ACCELERATION | KT_RECORD_ANGULAR_ACCELERATION,
    /* evaluated from the kinematics by the receiver of the record */
    KT_RECORD_KINEMATICS = KT_RECORD_MOMENTUM | KT_RECORD_ORIENTATION | KT_RECORD_MARKER_VELOCITY |
                           KT_RECORD_MARKER_ACCELERATION | KT_RECORD_EFFECT | KT_RECORD_CLOSURE |
                           KT_RECORD_ANGULAR_VELOCITY | KT_RECORD_ANGULAR_ACCELERATION
};

#endif
