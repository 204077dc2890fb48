/* Simulation: the settings of a run, steps, records and checkpoints.
 *
 *     static int print_record(const kt_record *record, void *user) {
 *         return fprintf((FILE *)user, "%g s: %g\n", record->time, record->q[0]) < 0;
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
 * Control code calls kt_simulation_init in its own memory, and then kt_simulation_set_torque, kt_simulation_advance and
 * kt_simulation_sense in turn, which allocate nothing.
 *
 * A simulation belongs to one thread at a time; any number of them may share a model.
 */
#ifndef KINETREE_SIMULATION_H
#define KINETREE_SIMULATION_H

#include "kinetree/dynamics.h"
#include "kinetree/integrator.h"
#include "kinetree/mechanism.h"
#include "kinetree/model.h"

#include <stdint.h>

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- the settings of a run --------------------------------------------------------------------------------------- */

/* The names of kt_metric. X(id, name in scene files) */
#define KT_METRIC_LIST(X)                                                                                              \
    X(KT_METRIC_IDENTITY, identity)                                                                                    \
    X(KT_METRIC_MASS, mass)

/* The quantities that are recorded, as bits, in the order in which records are written. X(id, bit, name in scene files)
 *
 * KT_RECORD_BALANCE requests the energies, and the works of effects, of torques and wrenches that are set, and of
 * driven loops. The works are integrated with the motion, by the same method, as two additional equations. These two do
 * not affect the step size: the motion has the same bits with and without a balance, and a drift of the balance shows
 * how accurately the steps, chosen for the motion, integrate the powers. A run without a balance has no additional
 * cost. */
#define KT_RECORD_LIST(X)                                                                                              \
    X(KT_RECORD_POSITION, 1, position)         /* q */                                                                 \
    X(KT_RECORD_VELOCITY, 2, velocity)         /* v */                                                                 \
    X(KT_RECORD_ACCELERATION, 4, acceleration) /* a */                                                                 \
    X(KT_RECORD_ENERGY, 8, energy)             /* kinetic and potential */                                             \
    X(KT_RECORD_BALANCE, 64, balance)          /* energies and works */                                                \
    X(KT_RECORD_CONSTRAINT, 16, constraint)    /* residuals of loops */                                                \
    X(KT_RECORD_REACTION, 32, reaction)        /* in joints and loops */                                               \
    X(KT_RECORD_BEARING, 262144, bearing)      /* in joints, without effects and drives */                             \
    X(KT_RECORD_MULTIPLIER, 128, multiplier)   /* of the loops' equations */                                           \
    X(KT_RECORD_MOMENTUM, 256, momentum)       /* linear, and angular about the world's origin */                      \
    X(KT_RECORD_ORIENTATION, 512, orientation) /* of bodies */                                                         \
    X(KT_RECORD_MARKER_VELOCITY, 1024, marker velocity)                                                                \
    X(KT_RECORD_MARKER_ACCELERATION, 2048, marker acceleration)                                                        \
    X(KT_RECORD_EFFECT, 4096, effect)   /* what effects exert, and how they move (kt_effect_quantity_at) */            \
    X(KT_RECORD_CLOSURE, 8192, closure) /* relative coordinates of loops (kt_loop_motion_evaluate) */                  \
    X(KT_RECORD_STATE, 16384, state)    /* own states (kt_state) */                                                    \
    X(KT_RECORD_ANGULAR_VELOCITY, 32768, angular velocity)         /* of bodies */                                     \
    X(KT_RECORD_ANGULAR_ACCELERATION, 65536, angular acceleration) /* of bodies */                                     \
    X(KT_RECORD_SINGULAR_VALUE, 131072, singular value)            /* the least one of the loops' Jacobian */

/* The bits of the quantities that are recorded. */
enum {
    KT_RECORD_DEFAULT = 0, /* position, velocity, energy; constraint where there are loops; own states */
#define KT_RECORD_ENUM(id, bit, name) id = bit,
    KT_RECORD_LIST(KT_RECORD_ENUM)
#undef KT_RECORD_ENUM
};

/* A marker of a body, by names. */
typedef struct kt_marker_pair {
    const char *body, *marker; /* names of the body and of the marker */
} kt_marker_pair;

/* The `simulate` and `output` parts of a scene. */
typedef struct kt_run {
    double duration;               /* s */
    const char *integrator;        /* a name that kt_method_find knows; NULL: chosen for the model (kt_run_method) */
    double step;                   /* s; > 0: fixed step, and the tolerances are not read */
    double relative, absolute;     /* tolerances of an adaptive method, of the numbers of q and v */
    double max_step;               /* s; the longest step of an adaptive method; 0: no limit but those of features */
    double rho;                    /* two-step: the spectral radius at infinity, 0 to 1; others do not read it */
    kt_metric metric;              /* this and plan are for kt_model_options: a simulation uses those that its model was
                                   compiled with */
    kt_plan plan;                  /* as metric */
    double interval;               /* s between records; 0: about 1000 records */
    unsigned record;               /* KT_RECORD_ bits */
    const kt_marker_pair *markers; /* whose positions are recorded */
    int marker_count;              /* length of markers */
} kt_run;

/* Returns the defaults: 10 s; dopri5, whose simulations take little memory, at tolerance 1e-9; rho 0.6; metric
 * identity; plan auto; default records. A scene whose file names no method has none in its run (kt_run_method). */
KT_API kt_run kt_run_default(void);

/* The shortest duration above 0, s: floating-point numbers could not divide a shorter one into steps and records. */
#define KT_DURATION_LEAST 1e-280

/* Checks the times and tolerances of a run: they are finite and not negative, the duration is 0 or not below
 * KT_DURATION_LEAST, a step (or max_step) is not lost in the rounding of the times that it leads to, there are no more
 * records than can be counted (2^53), and with an adaptive step the relative tolerance is 0 or not below the rounding
 * level of numbers (KT_TOLERANCE_LEAST), and rho is 0 to 1. kt_simulation_init makes this check as well. Errors:
 * KT_ERROR_ARGUMENT, with error->where "duration", "step", "max_step", "interval", "tolerance" or "rho". Cost: a few
 * comparisons. */
KT_API KT_CHECKED kt_status kt_run_check(const kt_run *run, kt_error *error);

/* The most velocity coordinates nv of a model for which auto is the default. Its simulation takes about 14 nv^2 numbers
 * more than that of dopri5. */
enum { KT_RUN_IMPLICIT_MOST = 100 /* then 1.1 MB more */ };

/* The method of a run: the built-in one of its name; of two-step, which has a parameter, a copy with the run's rho,
 * written to *storage, which must outlive its use; NULL if there is none of that name. Where the run names none it is
 * the default for the model that is integrated: auto; but dopri5
 *   - with a fixed step,
 *   - for a model of more than KT_RUN_IMPLICIT_MOST velocity coordinates,
 *   - where the equations of motion are the caller's (kt_simulation_options.acceleration), and model is NULL here,
 *   - in a library without implicit methods.
 * auto has the bits of dopri5 until the motion is stiff. Where its memory counts (kt_simulation_size tells it), name
 * dopri5. */
KT_API const kt_method *kt_run_method(const kt_run *run, const kt_model *model, kt_method *storage);

/* Which of these applies, in words ("the default with a fixed step"), and what to do if another is wanted; NULL where
 * the run names its method. Static storage. */
KT_API const char *kt_run_method_reason(const kt_run *run, const kt_model *model);

/* Returns the bits of what a run records of this model: run->record, or those that KT_RECORD_DEFAULT stands for. */
KT_API unsigned kt_run_record(const kt_run *run, const kt_model *model);

/* Returns the name of a choice in scene files ("identity", "auto"; "energy" for one bit); NULL for any other value. */
KT_API const char *kt_metric_name(kt_metric metric);
KT_API const char *kt_plan_name(kt_plan plan);
KT_API const char *kt_record_name(unsigned bit);

/* ---- the plan ---------------------------------------------------------------------------------------------------- */

/* When a step of the plan is executed. */
typedef enum kt_phase {
    KT_PHASE_EVALUATION = 0, /* at every evaluation of accelerations */
    KT_PHASE_STEP,           /* after every step */
    KT_PHASE_RECORD,         /* at every record */
    KT_PHASE_COUNT           /* the number of phases */
} kt_phase;

/* One step of the plan: a kernel and the number of items that it works on; or a kernel that this scene leaves out, and
 * why. Texts are static. */
typedef struct kt_plan_step {
    kt_phase phase;      /* when the kernel runs */
    const char *name;    /* the kernel's name: "effect spring" */
    int64_t count;       /* the number of items: 12; 0 if it is left out */
    const char *unit;    /* what is counted: "links" */
    const char *dropped; /* why the kernel is left out; NULL if it runs */
} kt_plan_step;

/* The most steps that a plan has. */
enum { KT_PLAN_STEPS_MAX = 48 /* the length of an array for kt_plan_steps */ };

/* Lists what a run of this model computes, in the order of execution; steps has room for KT_PLAN_STEPS_MAX entries.
 * Returns their number. If run is NULL, the defaults apply. O(bodies + loops depth + effects). */
KT_API int kt_plan_steps(const kt_model *model, const kt_run *run, kt_plan_step *steps);

/* ---- the simulation ---------------------------------------------------------------------------------------------- */

/* A mechanism in motion: its state, its time, and all memory that a step writes. */
typedef struct kt_simulation kt_simulation;

/* An instant at which the caller's right-hand side is evaluated. Everything in it belongs to the simulation. */
typedef struct kt_instant {
    const kt_model *model;     /* the model that is integrated: the caller's, or that of the transformation */
    kt_data *data;             /* scratch, of that model */
    double t;                  /* s */
    const double *q, *v;       /* nq positions, nv velocities, of that model */
    const double *tau;         /* nv: torques that are set, without the effects'; NULL: none */
    const kt_wrench *external; /* one for each body: wrenches that are set; NULL: none */
    const double *x;           /* own states, kt_own_state_count */
} kt_instant;

/* Computes v' = a (nv) in place of kt_acceleration_evaluate at any stage of a step, as a function of its arguments
 * alone. `rate` (nv) contains v on entry and may be changed: q' = kt_position_rate(q, rate), and v' = a. Returns 0; > 0
 * if a cannot be computed here but a smaller step may help; < 0 to stop. If it writes a message to *error, that message
 * is reported. */
typedef int kt_right_hand_side(const kt_instant *at, double *rate, double *a, kt_error *error, void *user);

/* Projects the state q (nq), v (nv), which are at->q and at->v, in place of kt_state_project; it is called after each
 * accepted step, and for records between steps. *changed is false on entry. Returns the same values as a right-hand
 * side. */
typedef int kt_projection(const kt_instant *at, double *q, double *v, bool *changed, kt_error *error, void *user);

/* Another model of the same mechanism, which is integrated in place of the simulation's own, and functions that convert
 * between the two: the first argument of each is the transformation itself. Free states, forces and reactions are those
 * of `model`, all others those of the simulation's own model. study.h has one, the absolute formulation. */
typedef struct kt_transformation {
    const kt_model *model; /* the model that is integrated */
    /* Computes the free state of a state whose kinematics kt_kinematics_update has left in the data. */
    void (*to_free)(const struct kt_transformation *self, const kt_data *data, const double *q, const double *v,
                    double *free_q, double *free_v);
    /* Computes the state (and accelerations: free_a and a may both be NULL) from a free state whose loops are closed.
     * On entry q and v hold the state `ago` seconds earlier (negative: later), which decides which of the numbers that
     * represent the same rotation is meant. */
    void (*from_free)(const struct kt_transformation *self, const double *free_q, const double *free_v,
                      const double *free_a, double ago, double *q, double *v, double *a);
    /* Computes the wrenches on all bodies of `model`: those on the own bodies (NULL: none) and those that tau (NULL:
     * zero) exerts in the own joints. */
    void (*wrenches)(const struct kt_transformation *self, const double *free_q, const double *tau,
                     const kt_wrench *external, kt_wrench *wrenches);
    /* Computes the reactions in joints (as kt_joint_reactions; one for each body) and in loops from those in all loops
     * of `model`, under tau (NULL: zero). */
    void (*reactions)(const struct kt_transformation *self, const double *free_q, const double *tau,
                      const kt_wrench *free_reactions, kt_wrench *joints, kt_wrench *loops);
} kt_transformation;

/* Shows how far a run has come; it must not change the simulation. */
typedef void kt_progress_callback(const struct kt_simulation *simulation, void *user);

/* Options of a simulation that a scene file does not contain. */
typedef struct kt_simulation_options {
    size_t size;             /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    const kt_method *method; /* the caller's method instead of run->integrator; NULL: none */
    double initial_step;     /* s, adaptive; 0: estimated */
    double max_step;         /* s, adaptive; 0: no limit but that of the run */
    uint64_t max_steps;      /* accepted and rejected together; 0: no limit */
    unsigned record;         /* KT_RECORD_ bits to compute at each record besides run->record */
    bool unprojected;   /* no projection, so that loops drift open: to measure the cost and the benefit of projection */
    bool smooth_inputs; /* torques and wrenches are samples of smooth signals at every tick, as a controller's are: ab2,
                           ab4 and two-step (rho from 0.42) keep their past steps across them, instead of starting anew;
                           what is constant for a tick lags behind the signal by half a tick either way. bdf2 starts
                           anew: it would lag by a tick. Where inputs jump, leave it off */
    bool watch_works;   /* works are estimated from the powers at the ends of steps, to tell wrong energies: the
                         motion keeps its bits. Not with equations of the caller's, nor in a small library */
    bool kinematics;    /* a record's data hold the kinematics for queries, as they do if run has markers */
    kt_right_hand_side *acceleration; /* the caller's equations of motion; NULL: the engine's. Reactions and powers are
                                         still those of the engine's equations, and the engine assembles the initial
                                         state */
    kt_projection
        *projection; /* the caller's projection onto the loops; NULL: the engine's. Not called if unprojected */
    kt_corner_callback *corner; /* when the caller's equations, or forces that it sets, have corners, at which adaptive
                                   steps end; NULL: never */
    void *user;                 /* for these three */
    bool record_contacts;       /* kt_simulation_run hands over records of impacts, and of what closes, opens, sticks or
                                   slips (kt_simulation_contacts), before and behind: KT_INDEX_CONTACT */
    int events;                 /* the most events that kt_simulation_event_add adds; 0: none */
    const kt_transformation *transformation; /* to the model that is integrated, and must outlive the simulation as that
                                                model must; NULL: the simulation's own model is integrated */
    kt_progress_callback *progress; /* called by kt_simulation_run after every `progress_steps` steps; NULL: never */
    uint64_t progress_steps;        /* 1 or more if `progress` is given */
    void *progress_user;            /* the second argument of `progress` */
    int event_evaluations; /* the most values of an event's function that one step takes to find when the event happens:
                              KT_EVENT_EVALUATIONS_LEAST or more; 0: KT_EVENT_EVALUATIONS. An adaptive step that needs more
                              is repeated shorter. A fixed one is searched more coarsely, and counted
                              (kt_simulation_event_cuts) */
    double switch_gap; /* the most by which loops may be open that kt_simulation_switch closes, m or rad; 0: 1e-6 of the
                          mechanism's length, or of 1 */
} kt_simulation_options;

/* Limits of kt_simulation_options.event_evaluations. */
enum {
    KT_EVENT_EVALUATIONS = 4096,      /* the default */
    KT_EVENT_EVALUATIONS_LEAST = 1200 /* the smallest one: nine repetitions of a step and 128 values for each root */
};

/* Returns options that are all zero: the engine's own equations and projection, no limits. */
static inline kt_simulation_options kt_simulation_options_default(void) {
    kt_simulation_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    return options;
}

/* Returns the number of bytes that a simulation takes: its data, its integrator, its state; 0 if run or options are
 * wrong, which kt_simulation_init then reports. If `run` or `options` are NULL, the defaults apply. */
KT_API size_t kt_simulation_size(const kt_model *model, const kt_run *run, const kt_simulation_options *options);

/* Initialises a simulation in the caller's memory (KT_ALIGNMENT), at time 0 in the model's initial state, assembled.
 * The model and a method of the caller's must outlive it; everything else in run and options is read only here. Nothing
 * needs to be released. Errors: KT_ERROR_ARGUMENT (an unknown integrator, a missing step, times that are not finite),
 * KT_ERROR_MEMORY (too small or misaligned), KT_ERROR_CONSTRAINT (loops that do not close).
 *
 * With a transformation, too, all inputs and outputs are in the model's own coordinates: states, torques, records,
 * reactions. Only energies, constraint residuals and multipliers are those of the model that is integrated. */
KT_API KT_CHECKED kt_status kt_simulation_init(const kt_model *model, const kt_run *run,
                                               const kt_simulation_options *options, void *memory, size_t size,
                                               kt_simulation **simulation, kt_error *error);

/* Does the same in memory that it allocates, which kt_simulation_free releases. */
KT_API KT_CHECKED kt_status kt_simulation_create(const kt_model *model, const kt_run *run,
                                                 const kt_simulation_options *options, kt_simulation **simulation,
                                                 kt_error *error);
/* Releases a simulation of kt_simulation_create. Does nothing for one in the caller's memory, nor for NULL. */
KT_API void kt_simulation_free(kt_simulation *simulation);

/* Time, s; positions (nq) and velocities (nv) at that time. The two pointers stay the same as long as the simulation
 * lives, and what they point to is always the state after the last call: ask once, read in every tick. */
KT_API double kt_simulation_time(const kt_simulation *simulation);
KT_API const double *kt_simulation_positions(const kt_simulation *simulation);
KT_API const double *kt_simulation_velocities(const kt_simulation *simulation);
/* Own states (kt_own_state_count) at that time, likewise. */
KT_API const double *kt_simulation_own_states(const kt_simulation *simulation);

/* Restarts at time t from q (nq) and v (nv; NULL: at rest), which are projected: quaternions to unit norm, loops
 * closed. Counts return to zero; torques and wrenches remain. Errors: KT_ERROR_NOT_FINITE, or KT_ERROR_ARGUMENT for a
 * quaternion of zeros, naming the joint; KT_ERROR_CONSTRAINT; the simulation is then as before. */
KT_API KT_CHECKED kt_status kt_simulation_set_state(kt_simulation *simulation, double t, const double *q,
                                                    const double *v, kt_error *error);

/* Changes the own states at the present time to x (kt_own_state_count), as kt_simulation_jump changes positions and
 * velocities; a restart by kt_simulation_set_state begins with the initial ones. Errors: KT_ERROR_NOT_FINITE, naming the
 * state; the simulation is then as before. */
KT_API KT_CHECKED kt_status kt_simulation_set_own_states(kt_simulation *simulation, const double *x, kt_error *error);

/* Sets the torques and forces of the joints (nv, in the order of velocities; NULL: none), which are constant from the
 * next step on until they are set again. A recorder may set them, too. Multistep methods start anew,
 * unless kt_simulation_options.smooth_inputs is set. Errors: KT_ERROR_NOT_FINITE naming the joint;
 * those set before then remain in force. O(nv). */
KT_API KT_CHECKED kt_status kt_simulation_set_torque(kt_simulation *simulation, const double *torque, kt_error *error);

/* Sets a parameter of the model, a copy on which this simulation was created (kt_model_copy), from the next step on: as
 * kt_parameter_set, and slopes from before are forgotten. If a loop's target jumps, the projection at the end of that
 * step closes the loop. An energy balance counts the change of a payload's energy as drift. Errors: those of
 * kt_parameter_set; KT_ERROR_ARGUMENT (another model), KT_ERROR_UNSUPPORTED (another formulation is integrated).
 * Nothing is allocated. */
KT_API KT_CHECKED kt_status kt_simulation_set_parameter(kt_simulation *simulation, kt_model *copy,
                                                        const kt_parameter *parameter, const double *values,
                                                        kt_error *error);

/* A parameter, and the numbers that it is to have. */
typedef struct kt_parameter_change {
    kt_parameter parameter;          /* as kt_parameter_find returns it */
    double values[KT_PARAMETER_MAX]; /* parameter.count numbers */
} kt_parameter_change;

/* Sets parameters of the model and own states x (kt_own_state_count; NULL: they stay) at the present time, all at once:
 * loops are closed, velocities projected, hard contacts looked at, and slopes from before forgotten. With a balance,
 * energy that is lost counts as dissipated, energy that is gained as supplied. On success changes[i].values are the
 * numbers from before. For the actions of events, and between calls; checkpoints do not hold parameters. Errors: those of
 * kt_simulation_set_parameter, kt_simulation_set_own_states and kt_simulation_jump; the simulation, the model and the
 * changes are then as before; KT_ERROR_UNSUPPORTED (a small library). Nothing is allocated. Cost: of a
 * projection. */
KT_API KT_CHECKED kt_status kt_simulation_change(kt_simulation *simulation, kt_model *model,
                                                 kt_parameter_change *changes, int count, const double *x,
                                                 kt_error *error);

/* Sets the wrenches on the bodies (kt_model_body_count entries, entry 0 ignored; NULL: none): moment about the body
 * frame's origin and force, world axes; they are constant as the torques are. Errors: KT_ERROR_NOT_FINITE naming the
 * body. */
KT_API KT_CHECKED kt_status kt_simulation_set_wrenches(kt_simulation *simulation, const kt_wrench *wrenches,
                                                       kt_error *error);

/* Takes one accepted step towards t_limit and not beyond it; t_limit = HUGE_VAL sets no limit. With a fixed step, steps
 * end at multiples of it, and additionally at a t_limit between two multiples. On failure the state keeps its bits.
 * Errors, each naming the time and, if one is at fault, the body: KT_ERROR_NOT_FINITE, KT_ERROR_SINGULAR, KT_ERROR_STEP
 * (too small, no progress, or max_steps used up), KT_ERROR_ARGUMENT (t_limit is not after the current time),
 * KT_ERROR_EFFECT, KT_ERROR_CALLBACK, and KT_ERROR_CONSTRAINT, naming the loops that do not close. If loops change with
 * time and cannot be closed from now on (out of reach, or contradicting each other), the error is this one, with the
 * gaps that remain one step later, or with an adaptive step one interval between records later; finding them takes at
 * most 800 additional closing steps, once, when the step fails. */
KT_API KT_CHECKED kt_status kt_simulation_step(kt_simulation *simulation, double t_limit, kt_error *error);

/* Steps until t_end exactly. On failure the state is that of the last step that succeeded. Errors: as for a step. */
KT_API KT_CHECKED kt_status kt_simulation_advance(kt_simulation *simulation, double t_end, kt_error *error);

/* Steps over one period of a controller, s, above zero. The k-th period since the start, or since the last
 * kt_simulation_set_state, ends at start + k period, so that no rounding is added up (that of t += 1e-3 would add a
 * step of some 1e-14 s to many a period); with a fixed step of which the period is a multiple, it is that many whole
 * steps. A period that begins elsewhere, after kt_simulation_advance or with another period, ends at its own time plus
 * period. On failure the state is that of the last step that succeeded, and the next call begins there. Errors: as for
 * a step; KT_ERROR_ARGUMENT if the period is not finite, not above zero, or so short that it does not change the
 * time. */
KT_API KT_CHECKED kt_status kt_simulation_tick(kt_simulation *simulation, double period, kt_error *error);

/* Changes the state at the present time: positions q (nq) and velocities v (nv), either NULL for no change, which are
 * projected: quaternions to unit norm, loops closed. Time, counts, records and works go on; slopes from before are
 * forgotten. With a balance, energy that is lost counts as dissipated, energy that is gained as supplied. For the
 * actions of events, and between calls. Errors: KT_ERROR_NOT_FINITE, KT_ERROR_ARGUMENT, naming the joint;
 * KT_ERROR_CONSTRAINT; the simulation is then as before. Nothing is allocated. Cost: of a projection. */
KT_API KT_CHECKED kt_status kt_simulation_jump(kt_simulation *simulation, const double *q, const double *v,
                                               kt_error *error);

/* Switches loops and effects on and off at the present time (model.h): those whose bits are in the set are on from now on.
 * Loops that are switched on exert an impulse, which brings the velocities onto them: a plastic impact, least in kinetic
 * energy. *loss (may be NULL) is the kinetic energy that is lost by it, J; negative where moving loops supply some. With a
 * balance, what the impulse and springs that are switched off lose counts as dissipated, what springs bring that are
 * switched on as supplied. Loops that are open by no more than kt_simulation_options.switch_gap are closed by the least
 * change of positions, as kt_state_project closes them. Slopes from before are forgotten; checkpoints hold the set. For the
 * actions of events, and between calls. Errors: KT_ERROR_ARGUMENT (a set of others; another formulation is integrated);
 * KT_ERROR_CONSTRAINT (loops of the set are open by more than that; contradictory velocities); the
 * simulation is then as before (but where hard contacts cannot be settled behind it: it cannot go on then). Nothing is
 * allocated. Cost: of a projection, and the data are cleared. Not in a small library (-Dsmall=enabled). */
KT_API KT_CHECKED kt_status kt_simulation_switch(kt_simulation *simulation, uint64_t set, double *loss,
                                                 kt_error *error);
/* Releases hard stops, contacts and slack ropes (kt_loop_side), and friction of joints that sticks (kt_effect_stick), whose switches
 * (kt_loop_switch) are in the set, at the present time: from now on they do not act, whatever their gaps and rates; all others do, from
 * where they are. Friction that begins to act sticks where its joint rests, and slips otherwise. What is released at first says its
 * description (KT_SWITCHED_OFF). For the actions of events, and between calls; checkpoints hold the set. Errors: KT_ERROR_ARGUMENT
 * (a set of others); KT_ERROR_CONSTRAINT (one that is to act is beyond its boundary), behind which the simulation cannot go on.
 * Nothing is allocated. Cost: as of kt_simulation_switch. */
KT_API KT_CHECKED kt_status kt_simulation_release(kt_simulation *simulation, uint64_t set, kt_error *error);
/* The loop of an effect's friction that sticks; -1 of an effect that has none, or is none. Of friction of a joint its switch and that of
 * the effect (kt_effect_switch) together are four models: none is on, and it slips forwards; the effect's alone, it slips backwards; the
 * loop's alone, it sticks; both, it is released. O(loops). */
KT_API int kt_effect_stick(const kt_model *model, int effect);
/* What is released. */
KT_API uint64_t kt_simulation_released(const kt_simulation *simulation);
/* The model that the simulation has now: that which it was made with, or another of its sets. */
KT_API const kt_model *kt_simulation_model(const kt_simulation *simulation);

/* Computes the accelerations a (nv) in the present state, with the torques and wrenches that the next step will have.
 * NaN of coordinates that move without mass (kt_massless_moves), which are not computed. Errors: as for a step; a is then
 * untouched. Cost: that of kt_acceleration_evaluate; the
 * next step does not use the result, unlike that of kt_simulation_sense. */
KT_API KT_CHECKED kt_status kt_simulation_acceleration(kt_simulation *simulation, double *a, kt_error *error);

/* Works since the start or the last kt_simulation_set_state, J: the work that effects have dissipated, and the work
 * that driving effects, torques, wrenches and driven loops have supplied. They are integrated with the motion, which
 * they do not change; where an adaptive step is too long for them (a drive that turns evenly, a contact that a drive
 * closes), the powers are integrated once more along that step, to the tolerances of the motion. With fixed steps they
 * have the order of the method. */
typedef struct kt_work {
    double dissipated, supplied; /* J */
} kt_work;

/* Works estimated from powers at the ends of steps alone (kt_simulation_options.watch_works). All are numbers since the
 * start; NaN where they are not estimated. */
typedef struct kt_work_estimate {
    double net;   /* dissipated - supplied, J: kinetic + potential + net is constant, up to the error of the integration
                      and that of the estimate */
    double error; /* that of the estimate: sum of the differences of cubics and parabolas through powers, J */
    double turned; /* the integral of |dissipated| + |supplied| as powers, J: its size */
} kt_work_estimate;

/* Returns the works up to the present time; NaN unless KT_RECORD_BALANCE is requested. */
KT_API kt_work kt_simulation_work(const kt_simulation *simulation);

/* ---- events ------------------------------------------------------------------------------------------------------ */

/* Which changes of sign are an event. */
typedef enum kt_direction {
    KT_DIRECTION_EITHER = 0, /* both */
    KT_DIRECTION_RISING,     /* from below zero to above */
    KT_DIRECTION_FALLING     /* from above zero to below */
} kt_direction;

/* Computes the value whose change of sign is an event, as a function of its arguments alone. The instant is one of the
 * simulation's own model, and its data are scratch (kt_kinematics_update and the queries that follow it). Returns 0;
 * anything else, or NaN, ends the call that stepped with an error, whose message it may write. */
typedef int kt_event_function(const kt_instant *at, double *value, kt_error *error, void *user);

/* An event that happens, as its action is told. */
typedef struct kt_occurrence {
    const struct kt_event *event; /* the simulation's copy */
    double time;                  /* s; the present time of the simulation */
    int side;                     /* the sign that its value has from now on: 1 or -1 */
    uint64_t count;               /* how often it has happened, this time included */
} kt_occurrence;

/* What an event does. It may read the state, and call kt_simulation_jump, kt_simulation_set_torque,
 * kt_simulation_set_wrenches, kt_simulation_set_parameter, kt_simulation_change, kt_simulation_switch,
 * kt_simulation_release and kt_simulation_sense (not where records are handed over, in kt_simulation_run). Returns 0 to go on, > 0 to end the call that stepped (kt_simulation_stopped), < 0 for an
 * error, whose message it may write. */
typedef int kt_event_action(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user);

/* An event: what is watched, and what is done. */
typedef struct kt_event {
    const char *name;            /* must outlive the simulation */
    kt_event_function *function; /* the value */
    kt_event_action *action;     /* NULL: none */
    kt_corner_callback *corner;  /* when the value, as a function of time, has corners or turns; NULL: never */
    void *user;                  /* for all three */
    kt_direction direction;      /* which changes of sign count */
    bool record;                 /* kt_simulation_run hands over a record of the state before the action */
    bool stop;                   /* it ends the run, after such a record */
    bool repeatable; /* the action jumps and switches, as a function of the state, and does nothing else: it may be
                                    called at neighbouring states, which are taken back (kt_motion_derivatives) */
    uint64_t limit;  /* how often it happens at most; 0: any number */
    uint64_t sum; /* of what it watches and does, if the program has such a checksum (kt_scene_event_sum): a checkpoint
                                    of events with other sums is refused; 0: none */
} kt_event;

/* Adds an event to a simulation whose options have room for it (kt_simulation_options.events). Steps end at events: to
 * four units of rounding of the time, with the order of the method. Events within 1e-12 s (or eight units of rounding)
 * happen together, in the order in which they were added. A value that is zero at the start, or that an action has set
 * to zero, is on neither side: the first side that it comes to is no event. Of two changes of sign within one step, both
 * are found where five values along it, or parabolas through three of them, show the change: along each part of it in
 * which no joint turns by more than half a turn, by its rates at both ends of the step, and that ends at the next corner; max_step bounds
 * what they miss. Where events accumulate (a ball that bounces ever lower), so that all that remain lie within 1e-9 of the interval
 * between records, or 64 in a row follow each other so closely, the call fails with KT_ERROR_STEP. Nothing is allocated. Errors: KT_ERROR_ARGUMENT (no name, or that of another event, no function), KT_ERROR_MEMORY (no
 * room), KT_ERROR_UNSUPPORTED (a small library). Cost: four values of the function a step (a part of it, where joints turn by more than half a turn), some ten for each event, and one to
 * three steps repeated; `corner` is called once for each corner that is passed. */
KT_API KT_CHECKED kt_status kt_simulation_event_add(kt_simulation *simulation, const kt_event *event, kt_error *error);

/* The event that ended the last call of kt_simulation_run, _step, _advance or _tick, or of kt_motion_derivatives, before
 * its time; NULL: none did. The next call goes on from there. */
KT_API const kt_event *kt_simulation_stopped(const kt_simulation *simulation);

/* How often the event of this name has happened since the start or the last kt_simulation_set_state; 0 if there is none
 * of that name. */
KT_API uint64_t kt_simulation_event_count(const kt_simulation *simulation, const char *name);

/* Searches for the time of events that took kt_simulation_options.event_evaluations values, and were cut: an event may have
 * been missed in these steps. */
typedef struct kt_event_cuts {
    uint64_t count;        /* such steps since the start, or the last kt_simulation_set_state */
    double time;           /* s, the beginning of the first one; NaN: there is none */
    const kt_event *event; /* one that needed the values there; NULL: there is none */
} kt_event_cuts;

/* Returns these. A step of fixed length is searched coarsely if joints turn often within the step, or if the event's function
 * has many corners in time. Remedy: a smaller step, or more values. */
KT_API kt_event_cuts kt_simulation_event_cuts(const kt_simulation *simulation);

/* Disarms the event of this name, or arms it again. A disarmed event is not evaluated and does not happen; its count stays.
 * Armed again, it is on the side of its value at that time. Events are armed when they are added; checkpoints hold which ones
 * are, and kt_simulation_set_state leaves them. For the actions of events, and between calls. Errors: KT_ERROR_ARGUMENT (no
 * event of this name; it is that of a hard contact, which kt_simulation_release disarms); KT_ERROR_UNSUPPORTED (a small
 * library, which has this call all the same). O(events). */
KT_API KT_CHECKED kt_status kt_simulation_event_arm(kt_simulation *simulation, const char *name, bool armed,
                                                    kt_error *error);

/* ---- hard contacts ----------------------------------------------------------------------------------------------- */

/* What hard stops, contacts and slack ropes (kt_loop.side, a restitution of kt_effect), and friction that sticks, have done
 * since the start. Each is an
 * event of the name of its loop (kt_simulation_event_count), before those that are added: that it closes, and that its
 * reaction ends. In between it is a loop that is switched on (kt_simulation_model, kt_switch_set). */
typedef struct kt_contact_counts {
    uint64_t count;    /* how many contacts there are */
    uint64_t impacts;  /* faster than rest_velocity */
    uint64_t closings; /* it became a constraint */
    uint64_t openings; /* it ceased to be one */
    uint64_t sticks;   /* friction that sticks came to rest */
    uint64_t slips;    /* and began to slip */
    uint64_t
        rested; /* chains of bounces, or of ends of slip, that ended at once: all that were left lay within 1e-9 of an interval */
    uint64_t reduced; /* impacts at which the rule would have let the energy grow: restitutions were made less */
    uint64_t
        undecided; /* friction allowed several motions. If all contacts can stick they do; otherwise the one next to sticking was taken */
    uint64_t
        shared; /* contacts came to a state in which they wedge a body: their normal forces are not unique, the least
                          ones were taken */
    uint64_t
        unconverged; /* evaluations at which the direction of slow slip was not found, by records and estimates of steps,
                             too: friction acted against the slip that there was */
    uint64_t
        pivots; /* of complementarity problems: at most 50 for each contact that touches; with friction of contacts steps of Newton's
                          method */
    uint64_t
        jammed; /* instants at which no accelerations obeyed Coulomb's law: an impulse without a collision stopped the slip */
    double dissipated; /* by impacts, J */
} kt_contact_counts;

/* Returns the counts since the start or the last kt_simulation_set_state; all zero without hard contacts, and of NULL.
 * Not in a small library (-Dsmall=enabled). */
KT_API kt_contact_counts kt_simulation_contacts(const kt_simulation *simulation);

/* ---- records ----------------------------------------------------------------------------------------------------- */

struct kt_event;

/* What the index of a record is that is none of the k * interval. */
typedef enum kt_record_index {
    KT_INDEX_EVENT = -1,   /* of an event that records or stops; of kt_simulation_sense */
    KT_INDEX_CONTACT = -2, /* of a hard contact, or friction that sticks (record_contacts), by the name of its loop */
} kt_record_index;

/* The record that a recorder receives; valid during the call. Between the ends of steps q and v are interpolated and
 * projected. */
typedef struct kt_record {
    int64_t index;                /* k; below zero: of an event (kt_record_index) */
    double time;                  /* k * interval; the last one is the duration */
    const struct kt_event *event; /* the event whose record this is; NULL: it is one of the k * interval */
    const double *q;              /* nq */
    const double *v;              /* nv */
    const double *x;              /* own states, kt_own_state_count */

    /* Requested quantities; NULL or NaN if they are not requested. */
    const double *a;                 /* nv; acceleration */
    double kinetic, potential;       /* J; energy, balance */
    kt_work work;                    /* since the start; balance. kinetic + potential + work.dissipated - work.supplied
                                        is constant, up to the error of the integration */
    kt_work_estimate estimate;       /* watch_works */
    kt_residual constraint;          /* constraint */
    const kt_wrench *reactions;      /* one for each body, as in kt_joint_reactions; reaction */
    const kt_wrench *loop_reactions; /* one for each loop, as in kt_reaction_evaluate; reaction */
    const double *multipliers;       /* one for each equation, as in kt_multiplier_evaluate; reaction or multiplier */
    const kt_model *model;           /* the caller's; where loops or effects are switched, that of those that are on */
    const kt_data *data; /* kinematics of q and v (and a, where it is given) for kt_body_pose, kt_point_position and
                            similar queries; energy, reaction or kinematics */
} kt_record;

/* Returns 0 to continue, anything else to stop. */
typedef int kt_recorder(const kt_record *record, void *user);

/* Returns the number of records of a whole run: at k * interval, k = 0, 1, ..., while that is before the duration, and
 * one at the duration. An interval that divides the duration up to rounding is taken to divide it. */
KT_API int64_t kt_simulation_record_count(const kt_simulation *simulation);

/* Runs from the current time to the duration and passes a record to `record` at each record time from then on. Steps
 * are not shortened for records: these come from the method's dense output. May be called again after an error or a
 * recorder that stopped: it continues with the record after the last one handed over. On failure all records up to the
 * time reached have been handed over, except those within a last step at whose end the acceleration, which dense output
 * needs, cannot be computed. Where drives take the mechanism to a dead point, whose acceleration is of no use, records
 * within that step are interpolated between its ends alone, and counted (`joined`). Errors: as for a step;
 * KT_ERROR_CALLBACK if the recorder stopped. */
KT_API KT_CHECKED kt_status kt_simulation_run(kt_simulation *simulation, kt_recorder *record, void *user,
                                              kt_error *error);

/* Sensor values: writes a record of the current time, under the torques and wrenches that the next step will have. It
 * holds what run and options request for records: accelerations with KT_RECORD_ACCELERATION or
 * KT_RECORD_MARKER_ACCELERATION, wrenches in joints and
 * loops with KT_RECORD_REACTION, multipliers with that or KT_RECORD_MULTIPLIER, and with `kinematics` the positions,
 * velocities and (with either) accelerations of points, which kt_point_position and its like read from record->data.
 * Its index is KT_INDEX_EVENT. All that it points to belongs to the simulation and is valid until the next call that takes a
 * simulation that is not const. Errors: as for a step; *record is then untouched.
 *
 *     kt_simulation_set_torque, kt_simulation_sense, kt_simulation_advance    in turn
 *
 * needs no more evaluations than without sensors: the accelerations are those that the step ended with (fsal), or else
 * those that the next step begins with and then does not compute again; the rest follows from what that evaluation or
 * the projection left in memory. Torques that are set only after sensing make the next step begin with an evaluation of
 * its own: one more a step, unless the method ends its steps with one (fsal) and the projection moved nothing. One more
 * is also made for reactions in planar loops, and for all reactions where a balance or KT_RECORD_CONSTRAINT is recorded
 * or the right-hand side is the caller's. No bit of the motion changes by sensing. (An adaptive method discards its
 * last error estimate when torques change; sensing under torques that never come into force has the same effect.)
 *
 * Accelerations are those of the motion, zero at rest. An accelerometer measures kt_point_acceleration minus
 * kt_model_gravity, in its body's axes. With a transformation the record describes the model's own bodies and
 * joints, whose kinematics are then computed additionally. A recorder must not call this function, which would
 * overwrite its record. */
KT_API KT_CHECKED kt_status kt_simulation_sense(kt_simulation *simulation, kt_record *record, kt_error *error);

/* The largest change of a velocity in the loops by the projection after a step, since the start. Fixed steps that
 * resolve the motion keep it far below the velocities themselves; a change of a tenth of them or more means that the
 * steps are much too long, that a step has jumped over a dead point of the drives, where no velocities satisfy the
 * equations, or that the speed of a drive jumps. */
typedef struct kt_velocity_correction {
    double share; /* that change, divided by the largest velocity in the loops since the start, both in radians or
                     lengths of the mechanism per second; 0: there was no change */
    double time;  /* s, of the end of that step; NaN: there was none */
    int body;     /* the joint of this body moves at that velocity; 0: none */
} kt_velocity_correction;

/* Returns the largest correction since the start, or the last kt_simulation_set_state; it is 0, at the time NaN, with a
 * projection of the caller's and if unprojected. O(bodies). */
KT_API kt_velocity_correction kt_simulation_velocity_correction(const kt_simulation *simulation);

/* Counts of the computations since the start. */
typedef struct kt_simulation_counts {
    uint64_t steps;           /* accepted */
    uint64_t rejected;        /* attempted steps that failed */
    uint64_t evaluations;     /* of the right-hand side; those for records' accelerations are not counted */
    uint64_t factorizations;  /* of loop matrices: one for each group at each evaluation and each projection */
    uint64_t jacobians;       /* of the right-hand side, by an implicit method */
    uint64_t switches;        /* of auto, to the implicit method and back */
    uint64_t capped;          /* by the method: what had not settled and was taken (kt_integrator_counts) */
    uint64_t balance;         /* evaluations besides those of the steps, for works (kt_work) */
    uint64_t joined;          /* states within steps, for records and works, that are interpolated between the states at
                                 the ends alone: the acceleration at a dead point of drives served no better */
    kt_iterations iterations; /* of projections, and of the assembly at the start; iterations.capped counts those that
                                 ended at their limit, and those of the method (`capped` above), too */
    kt_crossings crossings;   /* of all accelerations, those for records included */
    uint64_t cut;     /* searches for what a formula of time does next that were cut: a pulse of it may be missed */
    uint64_t corners; /* of functions of time, at which adaptive steps ended; 0 in a library without Jacobians */
} kt_simulation_counts;

/* Returns the counts since the start, or the last kt_simulation_set_state. */
KT_API kt_simulation_counts kt_simulation_counts_get(const kt_simulation *simulation);

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

/* Returns the number of bytes of a checkpoint: one flat block without pointers that memcpy may copy and a file may
 * keep, for the same model, run and options, the same version and machine. */
KT_API size_t kt_simulation_state_size(const kt_simulation *simulation);

/* Writes a checkpoint into `block`, which is aligned as a double is. Equal states give equal bytes. */
KT_API void kt_simulation_save(const kt_simulation *simulation, void *block);

/* Restores a checkpoint: all subsequent results have the same bits as without the interruption. What they depend on is
 * compared: the structure of the model (names, order and types of bodies, loops and effects, operators and variables
 * of formulas, but not the values of parameters), the sums of events (kt_event.sum), the method, its step or tolerances, duration, interval, the limits on steps, `unprojected`, `smooth_inputs`, and the
 * library's version. Errors: KT_ERROR_ARGUMENT naming what differs, or for a block that is no checkpoint,
 * KT_ERROR_NOT_FINITE; the simulation is then as before.
 *
 * A simulation with another step, tolerance or method takes over the state alone, by kt_simulation_set_state with the
 * time, the positions and the velocities of the first: its steps and records are laid anew from that time. That is how
 * a controller looks ahead with coarser steps. */
KT_API KT_CHECKED kt_status kt_simulation_restore(kt_simulation *simulation, const void *block, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
