/* Simulation: steps, inputs, events, records and checkpoints. Its settings are a run (run.h).
 *
 *     static int print_record(const kt_record *record, void *user) {
 *         return fprintf((FILE *)user, "%g s: %g\n", record->t, record->q[0]) < 0;
 *     }
 *
 * and with a model
 *
 *     kt_simulation *simulation = NULL;
 *     kt_run run = kt_run_default();
 *     run.duration = 10.0;
 *     status = kt_simulation_create(model, &run, NULL, &simulation, &error);
 *     if (status == KT_OK)
 *         status = kt_simulation_run(simulation, print_record, stdout, &error);
 *     kt_simulation_free(simulation);
 *
 * Control code calls kt_simulation_init with its own memory. In every period, control code calls
 * kt_simulation_set_torque, kt_simulation_advance and kt_simulation_sense, which allocate nothing.
 *
 * A simulation belongs to one thread at a time; any number of simulations may share a model.
 * Units: SI and radians. Unless a comment differs, the arrays q and v have the lengths nq and nv of the caller's model.
 * The auxiliary states x (kt_auxiliary_state) have the length kt_auxiliary_state_count.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_SIMULATION_H
#define KINETREE_SIMULATION_H

#include "kinetree/dynamics.h"
#include "kinetree/instant.h"
#include "kinetree/mechanism.h"
#include "kinetree/method.h"
#include "kinetree/model.h"
#include "kinetree/record.h"
#include "kinetree/run.h"

#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- the simulation ---------------------------------------------------------------------------------------------- */

/* A mechanism in motion: its state, its time, and all memory that a step writes. */
typedef struct kt_simulation kt_simulation;

/* Reports how far a run has come. The callback must not change the simulation. The callback returns 0 to continue;
 * another value ends the run with KT_ERROR_CALLBACK. */
typedef int kt_progress_callback(const struct kt_simulation *simulation, void *user);

/* Options of a simulation that a scene file does not contain. */
typedef struct kt_simulation_options {
    size_t size;             /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    const kt_method *method; /* the caller's method instead of run->integrator; NULL: none */
    double initial_step;     /* s, adaptive; 0: estimated */
    double max_step;         /* s, adaptive; 0: only the run limits the step */
    uint64_t max_steps;      /* accepted and rejected together; 0: no limit */
    unsigned record;         /* KT_RECORD_ bits to compute at each record in addition to run->record */
    bool unprojected;        /* no projection, so that loops drift open: to measure the cost and the benefit of
                                projection */
    bool smooth_inputs;      /* torques and wrenches are samples of smooth signals at every tick, as in a controller.
                                The methods ab2, ab4 and two-step (rho from 0.42) then keep their past steps when inputs
                                change. In any case an input that is constant for a tick lags behind its signal by half
                                a tick. The method bdf2 starts anew, since it would lag by a tick. Leave the option off
                                if inputs jump */
    bool watch_works;        /* estimates works from the powers at the ends of steps, to detect wrong energies; the
                                motion keeps its bits. Not available with the caller's equations, nor with time
                                stepping */
    bool kinematics;         /* the data of a record hold the kinematics for queries, as they do if run has markers */

    kt_right_hand_side *acceleration;   /* the caller's equations of motion; NULL: the engine's. Reactions and powers
                                         still follow from the engine's equations, and the engine assembles the initial
                                         state */
    kt_projection *projection;          /* the caller's projection onto the loops; NULL: the engine's. Not called if
                                         unprojected */
    kt_breakpoint_callback *breakpoint; /* breakpoints of the caller's equations, or of its forces, at which adaptive
                                         steps end; NULL: none */
    void *user;                         /* the argument `user` of these three functions */
    bool record_contacts;               /* kt_simulation_run hands over records before and after an impact, and when a
                                         contact closes, opens, sticks or slips (kt_simulation_contacts):
                                         KT_INDEX_CONTACT */
    int events;                         /* the number of events that kt_simulation_event_add can add; 0: none */
    kt_progress_callback *progress; /* called by kt_simulation_run after every `progress_steps` steps; NULL: never */
    uint64_t progress_steps;        /* 1 or more if `progress` is given */
    void *progress_user;            /* the second argument of `progress` */

    int event_evaluations; /* the number of values of an event's function that one step may take to find the time of the
                              event: KT_EVENT_EVALUATIONS_LEAST or more; 0: KT_EVENT_EVALUATIONS. If an adaptive step
                              needs more values, a shorter step replaces it. A fixed step is searched more coarsely and
                              counted (kt_simulation_event_cuts) */
    double switch_gap; /* the largest gap of loops that kt_simulation_set_switches closes, m or rad; 0: 1e-6 times the
                              unit of the equation, which is 1 rad or the mechanism's length */
    kt_contact_scheme contact; /* KT_CONTACT_STEPS: with run->step, and without run->integrator; default: events */
    bool equals_model; /* `acceleration` has the model's results, with unchanged rates (kt_native_use). The default
                          method, derivatives and watch_works are then those of a simulation without it */
    uint64_t
        steps_per_call; /* the number of steps, accepted and rejected together, that one call of kt_simulation_step,
                                kt_simulation_advance or kt_simulation_tick may take; 0: no limit. A call with more
                                fails with KT_ERROR_STEP and names the event or contact. The next call goes on */
    uint64_t step_evaluations; /* the number of evaluations of the accelerations that a fixed step (kt_run.step) on hard
                                  contacts may take, all its parts together; 0: no limit. If a step would take more,
                                  one time step of contact: steps completes it, with an error of the first order, and
                                  kt_contact_counts.completed counts it. So does a step that fails. With contact:
                                  events. At least 5 more than the stages of the method; 69 for an implicit method */
    uint64_t stall_evaluations; /* likewise for each thousandth of a fixed step: steps that advance have no limit */
} kt_simulation_options;

/* Limits of kt_simulation_options.event_evaluations and stall_evaluations. */
enum {
    KT_EVENT_EVALUATIONS = 4096,       /* the default */
    KT_EVENT_EVALUATIONS_LEAST = 1200, /* the least: nine repetitions of a step, each with 128 values for a root */
    KT_STALL_EVALUATIONS = 2000 /* in runs by the command: more than the longest whole step of tests without a limit */
};

/* Returns options that are zero except for their size: the engine's own equations and projection, no limits. */
static inline kt_simulation_options kt_simulation_options_default(void) {
    kt_simulation_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    return options;
}

/* Returns the number of bytes of a simulation: its data, its integrator and its state. Returns 0 if run or options are
 * wrong; kt_simulation_init then reports the fault. If `run` or `options` are NULL, the defaults apply. */
KT_API size_t kt_simulation_size(const kt_model *model, const kt_run *run, const kt_simulation_options *options);

/* Initialises a simulation in the caller's memory, at time 0, in the assembled initial state of the model.
 * Ownership: the memory is the caller's, aligned to KT_ALIGNMENT; nothing needs to be released. The model and a method
 * of the caller's must outlive the simulation. All else in run and options is read during this call only.
 * Errors: KT_ERROR_ARGUMENT (an unknown integrator, a missing step, times that are not finite, markers that the model
 * does not have), KT_ERROR_MEMORY (too small or misaligned), KT_ERROR_CONSTRAINT (loops that do not close; contacts are
 * checked later). */
KT_API KT_CHECKED kt_status kt_simulation_init(const kt_model *model, const kt_run *run,
                                               const kt_simulation_options *options, void *memory, size_t size,
                                               kt_simulation **simulation, kt_error *error);

/* Allocates memory, and initialises a simulation in this memory like kt_simulation_init.
 * Ownership: kt_simulation_free releases the simulation. */
KT_API KT_CHECKED kt_status kt_simulation_create(const kt_model *model, const kt_run *run,
                                                 const kt_simulation_options *options, kt_simulation **simulation,
                                                 kt_error *error);
/* Releases a simulation of kt_simulation_create. Does nothing for a simulation in the caller's memory, nor for NULL. */
KT_API void kt_simulation_free(kt_simulation *simulation);

/* Returns the present time, s, and the positions (nq) and velocities (nv) at that time. The two pointers are valid and
 * unchanged for the life of the simulation. Both always point to the state after the last call, so that a controller
 * needs to request the pointers only once. */
KT_API double kt_simulation_time(const kt_simulation *simulation);
KT_API const double *kt_simulation_positions(const kt_simulation *simulation);
KT_API const double *kt_simulation_velocities(const kt_simulation *simulation);
/* Returns the auxiliary states (kt_auxiliary_state_count) at that time, likewise. In memory, the velocities follow the
 * positions, and the auxiliary states follow the velocities. */
KT_API const double *kt_simulation_auxiliary_states(const kt_simulation *simulation);

/* Restarts at time t from q (nq) and v (nv; NULL: at rest). The state is projected: quaternions get unit norm, and
 * loops are closed. Auxiliary states begin with their initial values. Counts return to zero; torques and wrenches
 * remain. The set of kt_simulation_released returns to that of the description.
 * Errors: KT_ERROR_NOT_FINITE, or KT_ERROR_ARGUMENT for a quaternion of zeros or an angle that has no digits within
 * a turn (above 2.8e16 rad), each with the name of the joint. KT_ERROR_CONSTRAINT if loops do not close. On failure the
 * simulation is unchanged. */
KT_API KT_CHECKED kt_status kt_simulation_set_state(kt_simulation *simulation, double t, const double *q,
                                                    const double *v, kt_error *error);

/* Changes the auxiliary states at the present time to x (kt_auxiliary_state_count). kt_simulation_jump does the same
 * for positions and velocities. A restart by kt_simulation_set_state begins with the initial values.
 * Errors: KT_ERROR_NOT_FINITE with the name of the state. On failure the simulation is unchanged. */
KT_API KT_CHECKED kt_status kt_simulation_set_auxiliary_states(kt_simulation *simulation, const double *x,
                                                               kt_error *error);

/* Sets the torques and forces of the joints, which are constant from the next step until the next call. A recorder may
 * set torques and forces, too. Multistep methods start anew unless kt_simulation_options.smooth_inputs is set.
 * Shape: nv, in the order of velocities; NULL: none.
 * Errors: KT_ERROR_NOT_FINITE with the name of the joint; the previous torques then remain in force.
 * Cost: O(nv). */
KT_API KT_CHECKED kt_status kt_simulation_set_torque(kt_simulation *simulation, const double *torque, kt_error *error);

/* Sets a parameter of the model from the next step on, as kt_parameter_set does. The model is the copy with which this
 * simulation was created (kt_model_copy). The integrator discards stored derivatives. If a loop's target jumps, the
 * projection at the end of that step closes the loop. An energy balance counts the change of a payload's energy as
 * drift. Nothing is allocated.
 * Errors: those of kt_parameter_set. KT_ERROR_ARGUMENT (another model). */
KT_API KT_CHECKED kt_status kt_simulation_set_parameter(kt_simulation *simulation, kt_model *copy,
                                                        const kt_parameter *parameter, const double *values,
                                                        kt_error *error);

/* A parameter and its new numbers. */
typedef struct kt_parameter_change {
    kt_parameter parameter;          /* as kt_parameter_find returns it */
    double values[KT_PARAMETER_MAX]; /* parameter.count numbers */
} kt_parameter_change;

/* Sets parameters of the model and auxiliary states x (kt_auxiliary_state_count; NULL: no change) at the present time,
 * all together. The call closes the loops, projects the velocities and updates the hard contacts; the integrator
 * discards stored derivatives. With a balance, lost energy counts as dissipated, and gained energy counts as supplied.
 * On success changes[i].values are the previous numbers. The call is meant for the actions of events, and for use
 * between calls. Checkpoints do not contain parameters. Nothing is allocated.
 * Errors: those of kt_simulation_set_parameter, kt_simulation_set_auxiliary_states and kt_simulation_jump.
 * On failure the simulation, the model and the changes are unchanged (a place of a loop: up to rounding).
 * Cost: that of a projection. */
KT_API KT_CHECKED kt_status kt_simulation_change(kt_simulation *simulation, kt_model *model,
                                                 kt_parameter_change *changes, int count, const double *x,
                                                 kt_error *error);

/* Sets the wrenches on the bodies, which are constant as torques are (kt_simulation_set_torque).
 * Shape: kt_model_body_count entries, entry 0 is ignored; NULL: none.
 * Frame: world axes; the moment is about the origin of the body frame.
 * Errors: KT_ERROR_NOT_FINITE with the name of the body. */
KT_API KT_CHECKED kt_status kt_simulation_set_wrenches(kt_simulation *simulation, const kt_wrench *wrenches,
                                                       kt_error *error);

/* Takes one accepted step towards t_limit and not beyond it; t_limit = HUGE_VAL sets no limit. With a fixed step h,
 * steps end at multiples of h. Between two multiples, steps also end at t_limit, at events, and where the speed of a
 * drive jumps. On failure the state keeps its bits. If the search for an event fails, the integrator discards stored
 * derivatives and step lengths, and later steps of an adaptive or multistep method may have other bits.
 * Errors: each has the time, and the name of the body if one is at fault.
 *   KT_ERROR_NOT_FINITE, KT_ERROR_SINGULAR, KT_ERROR_EFFECT, KT_ERROR_CALLBACK.
 *   KT_ERROR_STEP: the step is too small, the run makes no progress, or max_steps or steps_per_call is used up.
 *   KT_ERROR_ARGUMENT: t_limit is not after the current time.
 *   KT_ERROR_CONSTRAINT, with the names of the loops that do not close. The code also covers loops that change with
 *     time and cannot be closed from now on: such loops are out of reach or contradict each other. Then the message has
 * the remaining gaps one step later or, with an adaptive step, one interval between records later. The
 *     search for these gaps takes at most 800 additional closing steps, once, after the step has failed. */
KT_API KT_CHECKED kt_status kt_simulation_step(kt_simulation *simulation, double t_limit, kt_error *error);

/* Steps until t_end exactly. On failure the state is that of the last successful step. Errors: as for a step. */
KT_API KT_CHECKED kt_status kt_simulation_advance(kt_simulation *simulation, double t_end, kt_error *error);

/* Steps over one period of a controller, s, above zero. The k-th period since the start, or since the last
 * kt_simulation_set_state, ends at start + k period. Therefore rounding errors do not add up; with t += 1e-3, many
 * periods would end with an extra step of about 1e-14 s. A period that is a multiple of a fixed step takes whole steps.
 * A period may begin elsewhere, after kt_simulation_advance or after another period. Such a period ends at its own
 * start plus the period. On failure the state is that of the last successful step, and the next call begins there.
 * Errors: as for a step. KT_ERROR_ARGUMENT if the period is not finite, not above 0, or too short to change time. */
KT_API KT_CHECKED kt_status kt_simulation_tick(kt_simulation *simulation, double period, kt_error *error);

/* Returns the time at which kt_simulation_tick with this period would end, s. A program may go to this time with
 * kt_simulation_step, and see each step of the period. NaN for NULL, and if the period is not finite or not above 0. */
KT_API double kt_simulation_period_end(const kt_simulation *simulation, double period);

/* Changes the state at the present time: positions q (nq) and velocities v (nv). Either may be NULL for no change. The
 * new state is projected: quaternions get unit norm, and loops are closed. Time, counts, records and the work done
 * continue; the integrator discards stored derivatives. With a balance, lost energy counts as dissipated, and gained
 * energy counts as supplied. The call is meant for the actions of events, and for use between calls. Nothing is
 * allocated.
 * Errors: KT_ERROR_NOT_FINITE and KT_ERROR_ARGUMENT, each with the name of the joint. KT_ERROR_CONSTRAINT. On failure
 * the simulation is unchanged.
 * Cost: that of a projection. */
KT_API KT_CHECKED kt_status kt_simulation_jump(kt_simulation *simulation, const double *q, const double *v,
                                               kt_error *error);

/* Switches loops and effects at the present time (model.h). From now on, loops and effects whose bits are in the set
 * act, and all others do not. Hard contacts ignore the set, since the library closes and opens them. A loop that is
 * switched on exerts an impulse, which projects the velocities onto the closed loop. This is a plastic impact: the
 * change of velocities has the least kinetic energy. The call writes the loss of kinetic energy, J, to *loss (may be
 * NULL); negative if moving loops supply energy. Loops with a gap of at most kt_simulation_options.switch_gap are
 * closed with the least change of positions, as kt_state_project closes them. With a balance, two losses count as
 * dissipated: the loss of the impulse, and the energy of springs that are switched off. The energy of springs that are
 * switched on counts as supplied. The integrator discards stored derivatives. Checkpoints contain the set. The call is
 * meant for the actions of events, and for use between calls. Nothing is allocated.
 * Errors: KT_ERROR_ARGUMENT (the set has other bits; another formulation is integrated). KT_ERROR_CONSTRAINT (a larger
 * gap of a loop in the set; contradictory velocities). On failure the simulation is unchanged, with one exception: if
 * the hard contacts cannot be resolved after the switch, the simulation cannot continue.
 * Cost: that of a projection; the data are cleared. */
KT_API KT_CHECKED kt_status kt_simulation_set_switches(kt_simulation *simulation, uint64_t set, double *loss,
                                                       kt_error *error);
/* Releases hard stops, contacts and slack ropes (kt_loop_side), and friction of joints that sticks
 * (kt_effect_stick_loop), at the present time. Items whose switches (kt_loop_switch) are in the set do not act from now
 * on, for all gaps and rates. All others act, beginning at their present gaps and rates. Friction that begins to act
 * sticks if its joint is at rest, and slips otherwise. The description selects the initial set (KT_SWITCHED_OFF).
 * Checkpoints contain the set. The call is meant for the actions of events, and for use between calls. Nothing is
 * allocated.
 * Errors: KT_ERROR_ARGUMENT (the set has other bits). KT_ERROR_CONSTRAINT (a constraint that is to act is beyond its
 * boundary); the simulation cannot continue after this error.
 * Cost: that of kt_simulation_set_switches. */
KT_API KT_CHECKED kt_status kt_simulation_set_released(kt_simulation *simulation, uint64_t set, kt_error *error);
/* Returns the loop of an effect's friction that sticks. Returns -1 if the effect has no such friction or does not
 * exist. Friction of a joint has two switches, for the loop and for the effect (kt_effect_switch), and therefore four
 * models.
 *   None is on: the joint slips forwards.
 *   The effect's alone is on: the joint slips backwards.
 *   The loop's alone is on: the joint sticks.
 *   Both are on: the friction is released.
 * Cost: O(loops). */
KT_API int kt_effect_stick_loop(const kt_model *model, int effect);
/* Returns the set of released contacts (kt_simulation_set_released). */
KT_API uint64_t kt_simulation_released(const kt_simulation *simulation);
/* Returns the present model of the simulation: its first model, or the model of another set of switches. */
KT_API const kt_model *kt_simulation_model(const kt_simulation *simulation);

/* Computes the accelerations a (nv) in the present state, with the torques and wrenches of the next step. Coordinates
 * that move without mass (kt_massless_moves) get NaN, since their accelerations are not computed.
 * Errors: as for a step; a is then unchanged.
 * Cost: that of kt_acceleration_evaluate. The next step reuses the result of kt_simulation_sense alone. */
KT_API KT_CHECKED kt_status kt_simulation_acceleration(kt_simulation *simulation, double *a, kt_error *error);

/* Returns the work done up to the present time; NaN unless KT_RECORD_BALANCE is requested. */
KT_API kt_work kt_simulation_work(const kt_simulation *simulation);

/* ---- events ------------------------------------------------------------------------------------------------------ */

/* The changes of sign that count as an event. */
typedef enum kt_direction {
    KT_DIRECTION_EITHER = 0, /* both */
    KT_DIRECTION_RISING,     /* from below zero to above */
    KT_DIRECTION_FALLING     /* from above zero to below */
} kt_direction;

/* Computes the value of an event; a change of its sign is the event. The value depends on the arguments alone. The
 * instant belongs to the simulation's own model. The data of the instant are scratch, for kt_kinematics_update and
 * subsequent queries. Returns 0 on success. Any other number, or a value of NaN, ends the stepping call with an error.
 * The function may write the message. */
typedef int kt_event_function(const kt_instant *at, double *value, kt_error *error, void *user);

/* An occurrence of an event, for its action. */
typedef struct kt_occurrence {
    const struct kt_event *event; /* the simulation's copy */
    double time;                  /* s; the present time of the simulation */
    int side;                     /* the sign of the value from now on: 1 or -1 */
    uint64_t count;               /* the number of occurrences, including this one */
} kt_occurrence;

/* The action of an event. The action may read the state, and may call these functions:
 *   kt_simulation_jump, kt_simulation_set_switches, kt_simulation_set_released;
 *   kt_simulation_set_torque, kt_simulation_set_wrenches;
 *   kt_simulation_set_parameter, kt_simulation_change;
 *   kt_simulation_sense, except while kt_simulation_run passes records. The action cannot move the simulation in time:
 * calls that step, kt_simulation_set_state and kt_simulation_restore return KT_ERROR_ARGUMENT. The same holds for a
 * recorder. Returns 0 to continue. Returns a positive number to end the stepping call (kt_simulation_stopped). Returns
 * a negative number for an error, with an optional message in *error. */
typedef int kt_event_action(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user);

/* An event: a function of the motion and an action. */
typedef struct kt_event {
    const char *name;            /* must outlive the simulation */
    kt_event_function *function; /* the value */
    kt_event_action *action;     /* NULL: none */
    kt_breakpoint_callback
        *breakpoint;        /* times at which the value, as a function of time, has breakpoints or turns; NULL:
                                    none */
    void *user;             /* the argument `user` of these three functions */
    kt_direction direction; /* the changes of sign that count */
    bool record;            /* kt_simulation_run hands over a record of the state before the action */
    bool stop;              /* the event ends the run, after such a record */
    bool repeatable;        /* the action jumps and switches as a function of the state, and does nothing else. It
                                    may then be called at neighbouring states, and its effects are undone
                                    (kt_motion_derivatives) */
    uint64_t limit;         /* the largest number of occurrences; 0: no limit */
    uint64_t sum;           /* a checksum of the function and the action, if the program has one
                                    (kt_scene_event_sum); 0: none. kt_simulation_restore rejects a checkpoint of events
                                    with other sums */
} kt_event;

/* Adds an event to a simulation whose options have room for it (kt_simulation_options.events). Steps end at events.
 * Their times are accurate to the order of the method, and resolved to four units of rounding. Events within 3e-12 of
 * the time in which the mechanism moves by its size, or eight units of rounding, act together, in the order of adding.
 *
 * A value that is zero at the start, or that an action has set to zero, is on neither side of zero. Reaching the first
 * side is no event.
 *
 * Each step is searched in parts. A part ends at the next breakpoint of the event's value (kt_event.breakpoint). Within
 * a part no joint turns by more than half a turn, according to its rates at both ends of the step. Each part has five
 * values. Two changes of sign within a part are found if these values, or parabolas through three of the values, show
 * both changes. The option max_step bounds the changes that remain undetected.
 *
 * The stepping call fails with KT_ERROR_STEP if events accumulate, as for a ball that bounces ever lower. The criterion
 * is that all further events lie within 1e-9 of the time since their intervals began to shrink, or that 64 in a row are
 * hardly apart. The call also fails after 10000 instants of events within one fixed step or a thousandth of the run.
 * Each call of kt_simulation_advance or kt_simulation_tick begins a new count.
 *
 * Errors: KT_ERROR_ARGUMENT (no name, the name of another event, no function), KT_ERROR_MEMORY (no room).
 * Cost: four values of the function for each part of a step, about ten for each event, and one to three repeated steps.
 * The callback `breakpoint` is called once for each breakpoint that the motion passes. Nothing is allocated. */
KT_API KT_CHECKED kt_status kt_simulation_event_add(kt_simulation *simulation, const kt_event *event, kt_error *error);

/* Returns the event that ended the last stepping call before its time, or NULL if no event ended the call. Stepping
 * calls are kt_simulation_run, _step, _advance, _tick, and kt_motion_derivatives. The next call continues there. */
KT_API const kt_event *kt_simulation_stopped(const kt_simulation *simulation);

/* Returns the number of occurrences of the event with this name, since the start or the last kt_simulation_set_state.
 * Returns 0 if there is no such event. */
KT_API uint64_t kt_simulation_event_count(const kt_simulation *simulation, const char *name);

/* Returns the name of the k-th event: events of hard contacts come first. Returns NULL if k is too large. */
KT_API const char *kt_simulation_event_name(const kt_simulation *simulation, size_t k);

/* Searches for events that reached the limit kt_simulation_options.event_evaluations. Events may have been missed. */
typedef struct kt_event_cuts {
    uint64_t count;        /* such steps since the start, or the last kt_simulation_set_state */
    double time;           /* s, the beginning of the first one; NaN: none */
    const kt_event *event; /* an event that needed the values there; NULL: none */
} kt_event_cuts;

/* Returns the searches that reached the limit. A fixed step is searched coarsely if joints turn often within the step,
 * or if the event's function has many breakpoints. Remedy: a smaller step, or a larger limit. */
KT_API kt_event_cuts kt_simulation_event_cuts(const kt_simulation *simulation);

/* Sets the event with this name off or on. An event that is off is not evaluated and does not happen; its count
 * remains. When the event is on again, the sign of its present value decides its side. Events are on when they
 * are added. Checkpoints contain the events that are on, and kt_simulation_set_state does not change them. The call is
 * meant for the actions of events, and for use between calls.
 * Errors: KT_ERROR_ARGUMENT if no event has this name, or if the event belongs to a hard contact;
 * for contacts there is kt_simulation_set_released.
 * Cost: O(events). */
KT_API KT_CHECKED kt_status kt_simulation_event_set_on(kt_simulation *simulation, const char *name, bool on,
                                                       kt_error *error);

/* ---- hard contacts ----------------------------------------------------------------------------------------------- */

/* Counts of hard contacts since the start. Hard contacts are hard stops, contacts and slack ropes (kt_loop.side, a
 * restitution of kt_effect), and friction that sticks. Each has an event with the name of its loop
 * (kt_simulation_event_count), before the events that are added. The event is that the contact closes, or that its
 * reaction ends. Between these two the contact is a loop that is switched on (kt_simulation_model, kt_switch_set). */
typedef struct kt_contact_counts {
    uint64_t count;       /* the number of contacts; the friction of a contact is no contact of its own */
    uint64_t impacts;     /* faster than rest_velocity */
    uint64_t closings;    /* a contact became a constraint */
    uint64_t openings;    /* a contact ceased to be a constraint */
    uint64_t sticks;      /* friction that sticks came to rest */
    uint64_t slips;       /* friction that sticks began to slip */
    uint64_t rested;      /* a rule let contacts rest: impacts or ends of slip accumulated, or slow slip turned or
                             was wedged. Also holds (kt_contact_excess) */
    uint64_t reduced;     /* impacts with reduced restitutions: the given ones have no impulses, or raise the energy */
    uint64_t undecided;   /* friction allowed several motions. If all contacts can stick, they do; otherwise the motion
                             next to sticking was taken */
    uint64_t shared;      /* contacts wedged a body: normal forces were not unique, and the least ones were taken */
    uint64_t unconverged; /* evaluations in which the direction of slow slip was not found, including those for records
                             and error estimates. Friction acted against the present slip */
    uint64_t pivots;      /* steps of Newton's method in complementarity problems */
    uint64_t jammed;      /* no acceleration obeys Coulomb's law here or near: an impulse stops the slip */
    double dissipated;    /* by impacts, J, with the kinetic energy of bounces and slip that a contact holds at rest; in
                             time stepping by all impulses */
    uint64_t closed, failures;    /* time stepping: closed contacts of all steps; impulses not found to 1e-7 */
    double supplied, penetration; /* time stepping: J, by impulses; the largest depth within a step, m or rad */
    uint64_t redundant;           /* of `undecided`: contacts share a load in several ways, and friction depends on the
                                     shares; as on the corners of a face that slide in different directions */
    double undecided_time;        /* s, of the first instant that `undecided` counts; 0: none */
    double dropped;     /* m/s: 100,000 impacts at one instant did not lose this speed, which contacts then removed; a
                           stop turns a body at the mechanism's length; 0: none */
    uint64_t completed; /* fixed steps that a time step completed (kt_simulation_options.step_evaluations) */
    int undecided_loop; /* one of its contacts: its loop in the simulation's model (kt_loop_name) */
} kt_contact_counts;

/* Finds the force of a contact in the present state (kt_record_contact), after kt_simulation_sense.
 * Errors: those of both. *load is then unchanged. */
KT_API KT_CHECKED kt_status kt_contact_force(kt_simulation *simulation, int effect, kt_contact_load *load,
                                             kt_error *error);

/* Returns the counts since the start or the last kt_simulation_set_state; zeros without hard contacts, and for NULL. */
KT_API kt_contact_counts kt_simulation_contacts(const kt_simulation *simulation);

/* Forces beyond the law. If no motion obeys the law, or steps do not resolve it, a contact is held at rest for a short
 * time (kt_contact_counts.rested). Its friction may then exceed its cone, or its normal force may pull. */
typedef struct kt_contact_excess {
    uint64_t steps;    /* that began with such a force */
    double most, time; /* the largest excess, as a part of the cone of the island's largest force (for a pull: of that
                          force itself), and its time, s; 0: none */
    int loop;          /* its contact: the loop in the simulation's model (kt_loop_name) */
} kt_contact_excess;

/* Returns the forces beyond the law since the start or the last kt_simulation_set_state; zeros for NULL. */
KT_API kt_contact_excess kt_simulation_contact_excess(const kt_simulation *simulation);

/* Time steps that completed fixed steps (kt_contact_counts.completed). */
typedef struct kt_completed_steps {
    uint64_t records; /* of kt_simulation_run within such a time step, or at its end: forces are means over it */
    double time;      /* s, at which the first of these time steps began; 0: none */
} kt_completed_steps;

/* Returns these since the start or the last kt_simulation_set_state; zeros for NULL. */
KT_API kt_completed_steps kt_simulation_completed_steps(const kt_simulation *simulation);

/* ---- records ----------------------------------------------------------------------------------------------------- */

/* Returns the number of records of a whole run: a record at each time k * interval, k = 0, 1, ..., before the duration,
 * and a record at the duration. An interval that divides the duration up to rounding counts as a divisor. */
KT_API int64_t kt_simulation_record_count(const kt_simulation *simulation);

/* Runs from the current time to the duration and passes a record to `record` at each record time from then on. Records
 * do not shorten steps, because the dense output of the method supplies the records. After an error, or after a
 * recorder has stopped the run, another call continues with the next record. On failure all records up to the last time
 * have been handed over, with one exception. Dense output needs the acceleration at the end of a step. If the
 * acceleration cannot be computed at the end of the last step, the records within that step are missing. The
 * acceleration at a dead point of drives is of no use. Records within such a step are interpolated between the ends of
 * the step, and counted (`joined`).
 * Errors: as for a step. KT_ERROR_CALLBACK if the recorder stopped the run. A simulation at or past the duration has no
 * records left, and the call does nothing. */
KT_API KT_CHECKED kt_status kt_simulation_run(kt_simulation *simulation, kt_recorder *record, void *user,
                                              kt_error *error);

/* Writes a record of the current time, for sensor values, with the torques and wrenches of the next step. Its index is
 * KT_INDEX_EVENT. The record has the quantities that run and options request.
 *   KT_RECORD_ACCELERATION or KT_RECORD_MARKER_ACCELERATION requests accelerations.
 *   KT_RECORD_REACTION requests wrenches in joints and loops, and multipliers.
 *   KT_RECORD_MULTIPLIER requests multipliers alone.
 *   The option `kinematics` requests positions and velocities of points. Together with one of the first two bits,
 * `kinematics` also requests their accelerations. Queries such as kt_point_position read these quantities from
 * record->data. If the speed of a drive jumps, accelerations and all quantities that depend on them have their values
 * after the jump. Ownership: the simulation owns all data to which the record points. The data are valid until the next
 * call with a simulation that is not const.
 * Errors: as for a step; *record is then unchanged.
 *
 * The sequence
 *
 *     kt_simulation_set_torque, kt_simulation_sense, kt_simulation_advance    in turn
 *
 * needs no more evaluations than without sensors. The accelerations come from the end of the last step (fsal), or from
 * the beginning of the next step, which does not repeat this evaluation. All other quantities follow from data of that
 * evaluation or of the projection.
 *
 * Three cases need one evaluation more for each step.
 *   Torques are set after sensing. No evaluation is added if the method ends its steps with one (fsal) and the
 *     projection did not change the state.
 *   The record has reactions in planar loops.
 *   The record has reactions, and either a balance or KT_RECORD_CONSTRAINT is recorded, or the right-hand side is the
 *     caller's.
 * Sensing does not change any bit of the motion. There is one exception: if torques change, an adaptive method
 * discards its last error estimate. Sensing with other torques does so, too, even if these torques are never applied.
 *
 * Accelerations are those of the motion, zero at rest. An accelerometer measures kt_point_acceleration minus
 * kt_model_gravity, in its body's axes. A recorder must not call this function, which would overwrite its record. */
KT_API KT_CHECKED kt_status kt_simulation_sense(kt_simulation *simulation, kt_record *record, kt_error *error);

/* The largest change of a velocity in the loops by a projection since the start. Projections follow a step. Jumps
 * of the speed of a drive do not count. Fixed steps that resolve the motion keep this change far below the velocities
 * themselves. A change of a tenth of the velocities or more has one of two causes.
 *   The steps are much too long.
 *   A step has jumped over a dead point of the drives, at which no velocities satisfy the equations. */
typedef struct kt_velocity_correction {
    double share; /* the change, divided by the largest velocity in the loops since the start; 0: there was no change.
                     Both are in radians or lengths of the mechanism per second */
    double time;  /* s, the end of that step; NaN: there was none */
    int body;     /* the joint of this body moves at that velocity; 0: none */
} kt_velocity_correction;

/* Returns the largest correction since the start, or the last kt_simulation_set_state. With a projection of the
 * caller's, and if unprojected, the share is 0 and the time is NaN.
 * Cost: O(bodies). */
KT_API kt_velocity_correction kt_simulation_velocity_correction(const kt_simulation *simulation);

/* Counts of the computations since the start. */
typedef struct kt_simulation_counts {
    uint64_t steps;           /* accepted */
    uint64_t rejected;        /* attempted steps that failed */
    uint64_t evaluations;     /* of the right-hand side, without those for accelerations in records */
    uint64_t factorizations;  /* of loop matrices: one for each group at each evaluation and each projection */
    uint64_t jacobians;       /* of the right-hand side, by an implicit method */
    uint64_t switches;        /* of auto, to the implicit method and back */
    uint64_t capped;          /* iterations of the method that ended at their limit, with the last iterate accepted
                                 (kt_integrator_counts) */
    uint64_t balance;         /* evaluations for the work done (kt_work), in addition to those of steps */
    uint64_t joined;          /* states within steps, for records and work, that are interpolated between the ends of
                                 the step. At a dead point of drives the acceleration is of no use */
    kt_iterations iterations; /* of projections, and of the assembly at the start; iterations.capped counts those that
                                 ended at their limit, including those of the method (`capped` above) */
    kt_crossings crossings;   /* of all accelerations, including those for records */
    uint64_t cut;             /* searches for the next feature of a formula of time, also of an event, that reached
                                 their limit: a pulse may be missed */
    uint64_t breakpoints;     /* breakpoints of functions of time at which adaptive steps ended; 0 in a library without
                                 Jacobians */
} kt_simulation_counts;

/* Returns the counts since the start, or the last kt_simulation_set_state. */
KT_API kt_simulation_counts kt_simulation_counts_of(const kt_simulation *simulation);

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

/* Returns the number of bytes of a checkpoint. A checkpoint is one flat block without pointers: memcpy may copy it, and
 * a file may store it. A checkpoint is valid for the same model, run and options, on the same version and machine. */
KT_API size_t kt_simulation_state_size(const kt_simulation *simulation);

/* Writes a checkpoint into `block`, which has the alignment of a double. Equal runs give equal bytes. */
KT_API void kt_simulation_save(const kt_simulation *simulation, void *block);

/* Restores a checkpoint. All subsequent results have the same bits as without the interruption. The call therefore
 * compares everything that the results depend on.
 *   The structure of the model: names, order and types of bodies, loops and effects, operators and variables of
 *     formulas. The values of parameters are not compared.
 *   The sums of events (kt_event.sum), and the limit event_evaluations.
 *   The method, its step or its tolerances, and the limits on steps.
 *   The duration, and the interval between records, if kt_simulation_run has handed over a record
 *     before.
 *   The options `unprojected`, `smooth_inputs`, and whether the caller provides the acceleration or the projection.
 *   The library's version.
 * The block may come from anywhere. A sum for each part detects any accidental change; the error names the part and its
 * bytes. Sums do not authenticate, because anybody can compute a valid sum. Therefore each index, count and flag is
 * also compared with its range, and no block makes a later call access memory that is not the simulation's. A block
 * that was made on purpose may still hold any state.
 * Errors: KT_ERROR_ARGUMENT with the name of the difference, or for a block that is no checkpoint. KT_ERROR_NOT_FINITE.
 * On failure the simulation is unchanged.
 *
 * A simulation with another step, tolerance or method can take over the state alone. Pass the time, the positions and
 * the velocities of the first simulation to kt_simulation_set_state. The steps and records then begin anew at that
 * time. A controller can predict with coarser steps in this way. */
KT_API KT_CHECKED kt_status kt_simulation_restore(kt_simulation *simulation, const void *block, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
