/* Many states of one model at once, a state a lane of the processor's vectors: for sampling control, learning, tolerance
 * studies. One core computes several times as many states in a second as one by one, and each with the same bits.
 *
 *     kt_batch_options options = kt_batch_options_default();
 *     kt_batch *batch = NULL;
 *     options.states = 1000;
 *     options.method = kt_method_find("rk4");
 *     status = kt_batch_create(model, &options, &batch, &error);
 *     for (size_t i = 0; i < options.states && status == KT_OK; i++)
 *         status = kt_batch_set_state(batch, i, 0.0, q + i * n, v + i * n, &error);
 *     if (status == KT_OK)
 *         status = kt_batch_step(batch, 0.01, 100, &error);
 *     if (status == KT_OK)
 *         status = kt_batch_get_state(batch, 0, NULL, q, v, &error);
 *     kt_batch_free(batch);
 *
 * Every state has its own time, positions, velocities and joint forces. Groups of `width` states (kt_batch_report) lie
 * coordinate by coordinate in memory, so that one vector instruction computes a number of all of them.
 *
 * Equal bits. What is computed of a state are the bits of the call for one state that is named at each function, on
 * every instruction set, whatever the other states are. A state whose computation fails fails alone: the others' are
 * computed, and kt_batch_status tells which have failed. The one exception is a library whose lanes are fused
 * (kt_batch_is_fused), which no build is unless it is asked for.
 *
 * What is computed in lanes: the recursions over trees, in space and in the plane, with every joint and with armature;
 * effects, of which bushings, thrusts and a caller's own are evaluated lane by lane within a group (those by formulas make
 * all effects be evaluated state by state, as are the rates of own states, and their forces enter the lanes); the stages of
 * explicit methods, the rates of quaternions and their norms; motion and Jacobians of frames. Of mechanisms with loops, in
 * planes and in space, driven ones too, all groups of which are pins or have dense matrices of fewer than 40 coordinates,
 * accelerations and the closing of loops after steps: in closed form or by QR with pivots of each state's
 * own. A state next to a singular position, or whose loops need more than the usual iterations, is computed by itself,
 * as are other models with loops (lanes.md names them) and the states that a lane cannot compute; kt_batch_report
 * counts both.
 *
 * One thread may use a batch at a time, but for kt_batch_compute_block, by which several share the work. Only
 * kt_batch_create allocates.
 */
#ifndef KINETREE_BATCH_H
#define KINETREE_BATCH_H

#include "kinetree/integrator.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Returns whether this library was built with -Dfused=enabled, for those who want speed before bits: in lanes a product and
 * a sum have one rounding where the processor has such operations. Then states and simulations in lanes have the results of
 * single ones to rounding, not to the bit, and depend on the instruction set; what is computed state by state is the same
 * in every build. */
KT_API bool kt_batch_is_fused(void);

/* Many states of one model, and what computing them takes. */
typedef struct kt_batch kt_batch;

/* How many states, and what is done with them. */
typedef struct kt_batch_options {
    size_t size;             /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    size_t states;           /* > 0 */
    size_t threads;          /* that compute blocks at the same time, each of which takes a workspace; 0: one */
    const kt_method *method; /* of kt_batch_step: an explicit Runge-Kutta method; NULL: no such steps are taken */
} kt_batch_options;

/* Returns one state, one thread, and no method. */
static inline kt_batch_options kt_batch_options_default(void) {
    kt_batch_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    options.states = 1;
    options.threads = 1;
    return options;
}

/* Returns the bytes of a batch; 0 if model or options are NULL, there are no states, the method is not explicit,
 * or states or threads are more than memory can hold. */
KT_API size_t kt_batch_size(const kt_model *model, const kt_batch_options *options);

/* Initialises a batch in the caller's memory, at KT_ALIGNMENT, with all states at t = 0 and the model's initial positions
 * and velocities, and no joint forces. The model must outlive it. Errors: KT_ERROR_MEMORY if the memory is too small or
 * misaligned; KT_ERROR_ARGUMENT if there are no states, if states or threads are more than memory can hold, or the
 * method is not explicit. */
KT_API KT_CHECKED kt_status kt_batch_init(const kt_model *model, const kt_batch_options *options, void *memory,
                                          size_t size, kt_batch **batch, kt_error *error);

/* The same in memory of its own, released with kt_batch_free. */
KT_API KT_CHECKED kt_status kt_batch_create(const kt_model *model, const kt_batch_options *options, kt_batch **batch,
                                            kt_error *error);
/* Releases what _create made; does nothing with a batch in the caller's memory, nor with NULL. */
KT_API void kt_batch_free(kt_batch *batch);

/* Returns the number of states; 0 of NULL. */
KT_API size_t kt_batch_count(const kt_batch *batch);

/* ---- one state --------------------------------------------------------------------------------------------------- */

/* Sets the time, positions (nq) and velocities (nv; NULL: zero) of a state; q and v are not checked until something is
 * computed. KT_ERROR_ARGUMENT if there is no such state, or the time is not finite. O(nq). */
KT_API KT_CHECKED kt_status kt_batch_set_state(kt_batch *batch, size_t state, double t, const double *q,
                                               const double *v, kt_error *error);

/* Sets, and copies, the own states of a state (kt_own_state_count numbers, kt_state of description.h), which are the
 * model's initial ones at first; kt_batch_set_state leaves them. Errors as above. */
KT_API KT_CHECKED kt_status kt_batch_set_own_states(kt_batch *batch, size_t state, const double *x, kt_error *error);
KT_API KT_CHECKED kt_status kt_batch_get_own_states(const kt_batch *batch, size_t state, double *x, kt_error *error);

/* Gives a state parameters of its own: those of `model`, a copy of the batch's model in which some have been set
 * (kt_parameter_set of model.h: masses, inertias, gravity, springs, dampers ...), or the batch's model again. The copy
 * must outlive the batch, and is read whenever the state is computed; one that is made anew in the same memory has to be
 * given again. States in a block (kt_batch_report.width
 * neighbours, from 0 on) are computed in lanes if their models are one, or differ in no more than gravity and the numbers
 * of bodies and links (masses, centres of mass, inertias, lengths); others, whose effects or armatures differ, one by one.
 * KT_ERROR_ARGUMENT if there is no such state, or model is another mechanism's. O(1). */
KT_API KT_CHECKED kt_status kt_batch_set_model(kt_batch *batch, size_t state, const kt_model *model, kt_error *error);

/* Sets its joint forces (nv; NULL: zero), which stay until they are set again; or its accelerations, from which
 * kt_batch_inverse computes forces. Errors as above. */
KT_API KT_CHECKED kt_status kt_batch_set_torque(kt_batch *batch, size_t state, const double *tau, kt_error *error);
KT_API KT_CHECKED kt_status kt_batch_set_acceleration(kt_batch *batch, size_t state, const double *a, kt_error *error);

/* Copies the time, positions (nq) and velocities (nv) of a state, each of which may be NULL; its joint forces (nv); its
 * accelerations (nv) as last computed or set. Errors as above. */
KT_API KT_CHECKED kt_status kt_batch_get_state(const kt_batch *batch, size_t state, double *t, double *q, double *v,
                                               kt_error *error);
KT_API KT_CHECKED kt_status kt_batch_get_torque(const kt_batch *batch, size_t state, double *tau, kt_error *error);
KT_API KT_CHECKED kt_status kt_batch_get_acceleration(const kt_batch *batch, size_t state, double *a, kt_error *error);

/* Returns what the last computation came to in this state: KT_OK, or why it failed; KT_ERROR_ARGUMENT if there is no
 * such state. */
KT_API kt_status kt_batch_status(const kt_batch *batch, size_t state);

/* ---- all states -------------------------------------------------------------------------------------------------- */

/* Computes the accelerations of every state by forward dynamics of the whole mechanism, with effects and loops: the bits
 * of kt_acceleration_evaluate. Returns KT_OK, or the error of the first state that failed, whose number it names; the
 * accelerations of states that failed are unchanged. */
KT_API KT_CHECKED kt_status kt_batch_forward(kt_batch *batch, kt_error *error);

/* Computes the joint forces of every state from its accelerations by inverse dynamics of the tree: the bits of
 * kt_dynamics_inverse. Effects and loops are not considered. Errors as above; the joint forces of states that failed are
 * unchanged. */
KT_API KT_CHECKED kt_status kt_batch_inverse(kt_batch *batch, kt_error *error);

/* Takes `steps` steps of h seconds by the method of the options, with constant joint forces: the bits of as many
 * kt_step_evaluate. A state that fails keeps what it had before the failing step, its time included, and takes no
 * further step in this call. Errors as above; KT_ERROR_ARGUMENT if there is no method, h is not finite, or
 * steps < 0; KT_ERROR_UNSUPPORTED if the model has hard contacts, stops or slack ropes, or friction that sticks, whose events
 * kt_ensemble_run follows. */
KT_API KT_CHECKED kt_status kt_batch_step(kt_batch *batch, double h, int steps, kt_error *error);

/* Takes `steps` semi-implicit (symplectic) Euler steps of h seconds, for long rollouts at the price of one evaluation a
 * step: v += h a(t, q, v), then q = kt_position_add(q, h v), with quaternions made units and loops closed as in the other
 * steps; of first order (Hairer, Lubich and Wanner, Geometric Numerical Integration, I.1). The bits of
 * kt_acceleration_evaluate, these sums and kt_position_add of each state. Own states take an explicit Euler step, x += h f(t, q, v,
 * x). Errors as above. */
KT_API KT_CHECKED kt_status kt_batch_step_semi_implicit(kt_batch *batch, double h, int steps, kt_error *error);

/* A frame on a body: that of a marker, by its index on the body (kt_marker_find), or with marker -1 the body's own. */
typedef struct kt_batch_frame {
    int body;   /* by index */
    int marker; /* of this body; -1: none */
} kt_batch_frame;

/* The motion of such a frame, world axes. */
typedef struct kt_frame_motion {
    kt_pose pose;          /* in the world */
    kt_twist velocity;     /* angular, rad/s, and of its origin, m/s */
    kt_twist acceleration; /* angular, rad/s^2, and the classical one of its origin, m/s^2 */
} kt_frame_motion;

/* What is asked of each state. All arrays are the caller's; the results of a state lie one after the other, frame by frame,
 * those of state i from i * count on. */
typedef struct kt_batch_sensors {
    const kt_batch_frame *frames; /* which frames */
    size_t count;                 /* how many */
    kt_frame_motion *motion;      /* states * count of these; NULL: not asked for */
    double *jacobian;             /* states * count Jacobians, 6 x nv each, column-major; NULL: not asked for */
} kt_batch_sensors;

/* Sensor values: the motion of frames at the positions and velocities of every state, and its accelerations as last computed
 * or set (kt_batch_forward); and their Jacobians, with KT_TWIST_ALIGNED. The bits of kt_body_pose or kt_marker_pose, of
 * kt_body_twist and kt_point_velocity, kt_body_acceleration and kt_point_acceleration, and kt_point_jacobian or
 * kt_marker_jacobian, after kt_kinematics_update. Accelerations are those of the motion, zero at rest: a gyroscope measures
 * velocity.angular, and an accelerometer acceleration.linear minus kt_model_gravity, both in the frame's axes, by
 * kt_mat3_apply_transposed(pose.rotation, ...). Errors as above, and KT_ERROR_ARGUMENT if there is no such body or marker;
 * the results of states that failed are unchanged. O(bodies + frames * (nv + depth)) a state. */
KT_API KT_CHECKED kt_status kt_batch_sense(kt_batch *batch, const kt_batch_sensors *sensors, kt_error *error);

/* ---- all states, by several threads ------------------------------------------------------------------------------- */

/* What is done with the states. */
typedef enum kt_batch_task {
    KT_BATCH_FORWARD,            /* kt_batch_forward */
    KT_BATCH_INVERSE,            /* kt_batch_inverse */
    KT_BATCH_STEP,               /* kt_batch_step */
    KT_BATCH_SEMI_IMPLICIT_STEP, /* kt_batch_step_semi_implicit */
    KT_BATCH_SENSE               /* kt_batch_sense */
} kt_batch_task;

/* One of the above. */
typedef struct kt_batch_job {
    kt_batch_task task;              /* what is done */
    double h;                        /* of steps, s */
    int steps;                       /* how many */
    const kt_batch_sensors *sensors; /* of KT_BATCH_SENSE */
} kt_batch_job;

/* Does a job for all states: one of the calls above. Errors as there; KT_ERROR_ARGUMENT if there is no such task. */
KT_API KT_CHECKED kt_status kt_batch_compute(kt_batch *batch, const kt_batch_job *job, kt_error *error);

/* Returns how many threads may share the work of the batch, as it was made; 0 of NULL. */
KT_API size_t kt_batch_thread_count(const kt_batch *batch);

/* Returns the number of blocks, into which the states are parted for threads; 0 of NULL. */
KT_API size_t kt_batch_block_count(const kt_batch *batch);

/* Does a job for the states of one block: kt_batch_compute is this for all of them. Several threads may call it for one
 * batch at once, each with its own number `thread`, below options.threads, and with a block that no other one computes.
 * Whichever thread computes a block, the results have the same bits. The library starts no threads: kt_batch_run of
 * study.h does. Errors as above, of the states of the block; KT_ERROR_ARGUMENT if there is no such thread or block. */
KT_API KT_CHECKED kt_status kt_batch_compute_block(kt_batch *batch, size_t thread, size_t block,
                                                   const kt_batch_job *job, kt_error *error);

/* How a batch is computed. Counts are of evaluations of one state, since kt_batch_init. */
typedef struct kt_batch_report {
    size_t width;      /* states in a group; 1: the model is computed state by state */
    const char *why;   /* why it is so, or NULL; static storage */
    uint64_t in_lanes; /* evaluations in lanes */
    uint64_t alone;    /* evaluations state by state */
    uint64_t failed;   /* of these, that failed */
} kt_batch_report;

/* Returns the report of a batch; zeros of NULL. */
KT_API kt_batch_report kt_batch_report_of(const kt_batch *batch);

/* ---- many simulations --------------------------------------------------------------------------------------------- */

/* Several simulations that run at once, each with steps, error control, events and records of its own, the stages of their
 * steps in lanes. What each gives are the bits of kt_simulation_run, whatever the others are. In lanes: trees, and
 * mechanisms whose loops a batch has in lanes (their loops are closed after steps state by state), with effects
 * and own states, by explicit methods (auto while the motion is not stiff), without works, and such that their models
 * differ in nothing but the initial state, gravity, masses, centres of mass, inertias and lengths. All else is run one
 * after the other, counted and said why. Events are sought after each step of a lane, on its dense output; a step in which
 * one happens is repeated in lanes up to it. A lane under inputs, or whose model has come to differ from the others',
 * takes its steps by itself as long as that lasts. Simulations end at different times: as soon as one has, its lane takes
 * the next. In records of which nothing but positions, velocities and energies is asked for, `data` may be NULL. One thread
 * may use an ensemble at a time. */
typedef struct kt_ensemble kt_ensemble;

/* A simulation, and who takes its records. */
typedef struct kt_ensemble_member {
    kt_simulation *simulation; /* which nobody else uses until it has ended */
    kt_recorder *record;       /* its records */
    void *user;                /* passed to `record` */
} kt_ensemble_member;

/* Writes the next simulation to *member and returns true; false: there is none, or, unless `may_block`, none at present: some
 * are still running, and it will be called again when they have come further. */
typedef bool kt_ensemble_next(void *user, bool may_block, kt_ensemble_member *member);

/* A simulation has ended as kt_simulation_run would, with its status, and its error or NULL. It is not used any more. */
typedef void kt_ensemble_done(void *user, const kt_ensemble_member *member, kt_status status, const kt_error *error);

/* Returns the bytes of an ensemble for simulations of models like this one; 0 of NULL. */
KT_API size_t kt_ensemble_size(const kt_model *model);

/* Initialises an ensemble in the caller's memory, at KT_ALIGNMENT. The model need not outlive it. Errors: KT_ERROR_MEMORY
 * if the memory is too small or misaligned. */
KT_API KT_CHECKED kt_status kt_ensemble_init(const kt_model *model, void *memory, size_t size, kt_ensemble **ensemble,
                                             kt_error *error);

/* The same in memory of its own, released with kt_ensemble_free. */
KT_API KT_CHECKED kt_status kt_ensemble_create(const kt_model *model, kt_ensemble **ensemble, kt_error *error);
/* Releases what _create made; does nothing with an ensemble in the caller's memory, nor with NULL. */
KT_API void kt_ensemble_free(kt_ensemble *ensemble);

/* Runs all simulations that `next` gives, each as kt_simulation_run from its present time to its duration, and hands each
 * back to `done` when it has ended. Errors of simulations are those of `done`; KT_ERROR_ARGUMENT if a pointer is NULL. */
KT_API KT_CHECKED kt_status kt_ensemble_run(kt_ensemble *ensemble, kt_ensemble_next *next, kt_ensemble_done *done,
                                            void *user, kt_error *error);

/* How the simulations of an ensemble were run since it was initialised. */
typedef struct kt_ensemble_report {
    size_t width;      /* lanes; 1: the models are computed one by one */
    uint64_t together; /* simulations in lanes */
    uint64_t alone;    /* simulations one after the other */
    const char *why;   /* the last of these was, or NULL; static storage */
    uint64_t in_lanes; /* of those in lanes, tries of steps that were computed with those of others */
    uint64_t
        left; /* tries that were not: of implicit methods, under inputs, that fail, or with no other lane to share */
} kt_ensemble_report;

/* Returns the report of an ensemble; zeros of NULL. */
KT_API kt_ensemble_report kt_ensemble_report_of(const kt_ensemble *ensemble);

#ifdef __cplusplus
}
#endif

#endif
