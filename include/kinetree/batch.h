/* Batches: many states of one model at once, with one state in each lane of the processor's vectors. Applications are
 * sampling control, learning and tolerance studies. One core computes several times as many states per second as with
 * separate calls, and each state has the same bits.
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
 * Every state has its own time, positions, velocities and joint forces. The memory of a group of `width` states
 * (kt_batch_report) is ordered coordinate by coordinate. One vector instruction therefore computes one number of all
 * states of the group.
 *
 * Equal bits. Each docstring names a call for one state. The results of a state have the same bits as this call, on
 * every instruction set and for all values of the other states. If the computation of one state fails, the other states
 * are still computed; kt_batch_status reports the failed states.
 *
 * Lanes compute the following quantities:
 *   - The recursions over trees, in space and in the plane, with every joint and with armature.
 *   - Effects. Bushings, thrusts and effects of the caller are evaluated lane by lane within a group. An effect with a
 *     formula causes all effects to be evaluated state by state. The rates of auxiliary states are also evaluated state
 *     by state. Then the forces are copied into the lanes.
 *   - The stages of explicit methods, the rates of quaternions and their norms.
 *   - The motion and Jacobians of frames.
 *   - Accelerations and the closing of loops after steps, for mechanisms with loops in planes and in space, also driven
 *     ones. All groups of loops must be pins or have dense matrices of fewer than 40 coordinates. The solution is in
 *     closed form, or uses QR with the pivots of each state.
 *
 * Other states are computed separately. Examples are states next to a singular position, and states whose loops need
 * more than the usual iterations. All states of other models with loops are computed separately (lanes.md names these
 * models). The report kt_batch_report counts evaluations in lanes and separate evaluations.
 *
 * Only one thread at a time may use a batch. With kt_batch_compute_block several threads share the work. Only
 * kt_batch_create allocates.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_BATCH_H
#define KINETREE_BATCH_H

#include "kinetree/mechanism.h"
#include "kinetree/method.h"
#include "kinetree/simulation.h"

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Many states of one model, and the memory for their computation. */
typedef struct kt_batch kt_batch;

/* Options of a batch: the number of states, and the method of steps. */
typedef struct kt_batch_options {
    size_t size;             /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    size_t states;           /* number of states, > 0 */
    size_t threads;          /* number of threads that compute blocks at the same time, each with its own workspace;
                              * 0: one */
    const kt_method *method; /* method of kt_batch_step: an explicit Runge-Kutta method; NULL: no such steps */
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

/* Returns the number of bytes of a batch. Returns 0 if model or options are NULL, there are no states, the method is
 * not explicit, or states or threads exceed the memory. */
KT_API size_t kt_batch_size(const kt_model *model, const kt_batch_options *options);

/* Initialises a batch in the caller's memory. All states are at t = 0, with the model's initial positions and
 * velocities, and without joint forces.
 * Ownership: the memory belongs to the caller and is aligned to KT_ALIGNMENT. The model must outlive the batch.
 * Errors: KT_ERROR_MEMORY if the memory is too small or misaligned. KT_ERROR_ARGUMENT if there are no states, if states
 * or threads exceed the memory, or if the method is not explicit. */
KT_API KT_CHECKED kt_status kt_batch_init(const kt_model *model, const kt_batch_options *options, void *memory,
                                          size_t size, kt_batch **batch, kt_error *error);

/* Initialises a batch like kt_batch_init, in memory that the function allocates.
 * Ownership: the caller releases the batch with kt_batch_free. */
KT_API KT_CHECKED kt_status kt_batch_create(const kt_model *model, const kt_batch_options *options, kt_batch **batch,
                                            kt_error *error);
/* Releases a batch that kt_batch_create made; does nothing with a batch in the caller's memory, nor with NULL. */
KT_API void kt_batch_free(kt_batch *batch);

/* Returns the number of states; 0 for NULL. */
KT_API size_t kt_batch_count(const kt_batch *batch);

/* ---- one state --------------------------------------------------------------------------------------------------- */

/* Sets the time, positions (nq) and velocities (nv; NULL: zero) of a state. The next computation checks q and v.
 * Errors: KT_ERROR_ARGUMENT if there is no such state, or if the time is not finite.
 * Cost: O(nq). */
KT_API KT_CHECKED kt_status kt_batch_set_state(kt_batch *batch, size_t state, double t, const double *q,
                                               const double *v, kt_error *error);

/* Set and copy the auxiliary states of a state (kt_auxiliary_state_count numbers, kt_auxiliary_state of description.h).
 * Their first values are the model's initial values. The call kt_batch_set_state leaves them unchanged.
 * Errors: as kt_batch_set_state. */
KT_API KT_CHECKED kt_status kt_batch_set_auxiliary_states(kt_batch *batch, size_t state, const double *x,
                                                          kt_error *error);
KT_API KT_CHECKED kt_status kt_batch_get_auxiliary_states(const kt_batch *batch, size_t state, double *x,
                                                          kt_error *error);

/* Gives a state its own parameters. The argument `model` is a copy of the batch's model with changed parameters, or
 * the batch's model again. Parameters are masses, inertias, gravity, springs, dampers and others (kt_parameter_set of
 * model.h).
 *
 * States in a block (kt_batch_report.width neighbours, from 0 on) are computed in lanes if they have the same model.
 * Their models may also differ in gravity and in the numbers of bodies and links (masses, centres of mass, inertias,
 * lengths). Blocks whose effects or armatures differ are computed state by state.
 * Ownership: the copy must outlive the batch, and is read whenever the state is computed. If a new copy is made in the
 * same memory, call this function again.
 * Errors: KT_ERROR_ARGUMENT if there is no such state, or if the model belongs to another mechanism.
 * Cost: O(1). */
KT_API KT_CHECKED kt_status kt_batch_set_model(kt_batch *batch, size_t state, const kt_model *model, kt_error *error);

/* Set the joint forces of a state (nv; NULL: zero), or its accelerations. Joint forces keep their values until the next
 * call. kt_batch_inverse computes forces from the accelerations.
 * Errors: as kt_batch_set_state. */
KT_API KT_CHECKED kt_status kt_batch_set_torque(kt_batch *batch, size_t state, const double *tau, kt_error *error);
KT_API KT_CHECKED kt_status kt_batch_set_acceleration(kt_batch *batch, size_t state, const double *a, kt_error *error);

/* Copy values of a state: its time, positions (nq) and velocities (nv), each of which may be NULL; its joint forces
 * (nv); its accelerations (nv), as last computed or set.
 * Errors: as kt_batch_set_state. */
KT_API KT_CHECKED kt_status kt_batch_get_state(const kt_batch *batch, size_t state, double *t, double *q, double *v,
                                               kt_error *error);
KT_API KT_CHECKED kt_status kt_batch_get_torque(const kt_batch *batch, size_t state, double *tau, kt_error *error);
KT_API KT_CHECKED kt_status kt_batch_get_acceleration(const kt_batch *batch, size_t state, double *a, kt_error *error);

/* Returns the status of the last computation of this state: KT_OK, or the reason of the failure. Returns
 * KT_ERROR_ARGUMENT if there is no such state. */
KT_API kt_status kt_batch_status(const kt_batch *batch, size_t state);

/* The numbers of all states in the memory of a batch. With these arrays a caller reads and writes states without a
 * copy. States are in groups. Number i of a state is at
 *     q[state / width * state_stride + i * width + state % width]
 * and likewise in v and x, and with force_stride in tau and a. The last group may have unused lanes, which results
 * never depend on. */
typedef struct kt_batch_lanes {
    size_t width;        /* states in a group, as in kt_batch_report */
    size_t groups;       /* number of groups */
    size_t state_stride; /* numbers from one group to the next in q, v and x */
    size_t force_stride; /* numbers from one group to the next in tau and a */
    double *t;           /* time of each state, s; a caller writes finite times only */
    double *q, *v, *x;   /* positions, velocities and auxiliary states */
    double *tau, *a;     /* joint forces; accelerations, as last computed or set */
} kt_batch_lanes;

/* Returns the arrays of a batch; zeros for NULL. The next computation checks q and v, as after kt_batch_set_state.
 * Ownership: the arrays belong to the batch, and their addresses never change. */
KT_API kt_batch_lanes kt_batch_lanes_of(kt_batch *batch);

/* ---- all states -------------------------------------------------------------------------------------------------- */

/* Computes the accelerations of every state by forward dynamics of the whole mechanism, with effects and loops. The
 * results have the same bits as kt_acceleration_evaluate. Returns KT_OK, or the error of the first state that failed,
 * with its number. Accelerations of failed states are unchanged. */
KT_API KT_CHECKED kt_status kt_batch_forward(kt_batch *batch, kt_error *error);

/* Computes the joint forces of every state from its accelerations by inverse dynamics of the tree. The results have the
 * same bits as kt_dynamics_inverse. Effects and loops are not considered. Joint forces of failed states are unchanged.
 * Errors: as kt_batch_forward. */
KT_API KT_CHECKED kt_status kt_batch_inverse(kt_batch *batch, kt_error *error);

/* Takes `steps` steps of h seconds by the method of the options, with constant joint forces. The results have the same
 * bits as as many calls of kt_step_evaluate. A state that fails keeps its values and its time before the failing step,
 * and takes no further step in this call.
 * Errors: as kt_batch_forward. KT_ERROR_ARGUMENT if there is no method, h is not finite, or steps < 0.
 * KT_ERROR_UNSUPPORTED if the model has hard contacts, stops or slack ropes, or friction that sticks; kt_ensemble_run
 * handles their events. */
KT_API KT_CHECKED kt_status kt_batch_step(kt_batch *batch, double h, int steps, kt_error *error);

/* Takes `steps` semi-implicit (symplectic) Euler steps of h seconds, for long rollouts with one evaluation per step. A
 * step is v += h a(t, q, v), then q = kt_position_add(q, h v). Quaternions are normalised and loops are closed as in
 * the other steps. The method has first order. The results have the same bits as kt_acceleration_evaluate, these sums
 * and kt_position_add for each state. Auxiliary states take an explicit Euler step, x += h f(t, q, v, x).
 * Errors: as kt_batch_step.
 * Source: Hairer, Lubich and Wanner, Geometric Numerical Integration, I.1. */
KT_API KT_CHECKED kt_status kt_batch_step_semi_implicit(kt_batch *batch, double h, int steps, kt_error *error);

/* A frame on a body: the frame of a marker, by its index on the body (kt_marker_find), or with marker -1 the frame of
 * the body. */
typedef struct kt_batch_frame {
    int body;   /* index of the body */
    int marker; /* index of a marker of this body; -1: none */
} kt_batch_frame;

/* The motion of such a frame.
 * Frame: world axes. */
typedef struct kt_frame_motion {
    kt_pose pose;          /* pose in the world */
    kt_twist velocity;     /* angular velocity, rad/s, and velocity of the origin, m/s */
    kt_twist acceleration; /* angular acceleration, rad/s^2, and classical acceleration of the origin, m/s^2 */
} kt_frame_motion;

/* The requested results of each state. All arrays belong to the caller. The results of a state are contiguous, frame by
 * frame; the results of state i start at i * count. */
typedef struct kt_batch_sensors {
    const kt_batch_frame *frames; /* the frames */
    size_t count;                 /* how many */
    kt_frame_motion *motion;      /* states * count motions; NULL: not computed */
    double *jacobian;             /* states * count Jacobians, 6 x nv each, column-major; NULL: not computed */
} kt_batch_sensors;

/* Computes sensor values of every state: the motion of frames, and their Jacobians with KT_TWIST_ALIGNED. The motion
 * belongs to the positions and velocities of the state, and to its accelerations as last computed or set
 * (kt_batch_forward).
 *
 * The results have the same bits as these calls after kt_kinematics_update: kt_body_pose or kt_marker_pose,
 * kt_body_twist and kt_point_velocity, kt_body_acceleration and kt_point_acceleration, and kt_point_jacobian or
 * kt_marker_jacobian.
 *
 * Accelerations are those of the motion, zero at rest. A gyroscope measures velocity.angular. An accelerometer measures
 * acceleration.linear minus kt_model_gravity. For components in the frame's axes, apply
 * kt_mat3_apply_transposed(pose.rotation, ...) to both vectors.
 * Errors: as kt_batch_forward, and KT_ERROR_ARGUMENT if there is no such body or marker. Results of failed states are
 * unchanged.
 * Cost: O(bodies + frames * (nv + depth)) for each state. */
KT_API KT_CHECKED kt_status kt_batch_sense(kt_batch *batch, const kt_batch_sensors *sensors, kt_error *error);

/* ---- all states, by several threads ------------------------------------------------------------------------------ */

/* The computation for the states. */
typedef enum kt_batch_task {
    KT_BATCH_FORWARD,            /* kt_batch_forward */
    KT_BATCH_INVERSE,            /* kt_batch_inverse */
    KT_BATCH_STEP,               /* kt_batch_step */
    KT_BATCH_SEMI_IMPLICIT_STEP, /* kt_batch_step_semi_implicit */
    KT_BATCH_SENSE               /* kt_batch_sense */
} kt_batch_task;

/* Joint forces that change between the steps of a job, as a controller sets them. Sample k acts in the steps k * hold
 * to (k + 1) * hold - 1, and the last sample in all later steps. */
typedef struct kt_batch_inputs {
    int samples;          /* number of samples of each state, > 0 */
    int hold;             /* number of steps that a sample acts, > 0 */
    const double *torque; /* states * samples * nv joint forces, state by state and sample by sample */
} kt_batch_inputs;

/* One computation with its arguments. */
typedef struct kt_batch_job {
    kt_batch_task task;              /* the computation */
    double h;                        /* length of steps, s */
    int steps;                       /* how many */
    const kt_batch_sensors *sensors; /* requests of KT_BATCH_SENSE */
    const kt_batch_inputs *inputs;   /* joint forces of steps; NULL: constant ones, as last set. The results have the
                                        same bits as a job for each sample, after kt_batch_set_torque; afterwards each
                                        state has the sample of its last step */
} kt_batch_job;

/* Does a job for all states: one of the calls above.
 * Errors: as the call; KT_ERROR_ARGUMENT if there is no such task, or if inputs have no samples. */
KT_API KT_CHECKED kt_status kt_batch_compute(kt_batch *batch, const kt_batch_job *job, kt_error *error);

/* Returns the number of threads that may share the work of the batch (kt_batch_options.threads); 0 for NULL. */
KT_API size_t kt_batch_thread_count(const kt_batch *batch);

/* Returns the number of blocks into which the states are divided for threads; 0 for NULL. */
KT_API size_t kt_batch_block_count(const kt_batch *batch);

/* Does a job for the states of one block; kt_batch_compute does the job for all blocks. Several threads may call this
 * function for one batch at the same time. Each thread has its own number `thread`, below options.threads, and its own
 * block. The results have the same bits for every assignment of blocks to threads. The library starts no threads;
 * kt_batch_run of study.h does.
 * Errors: as kt_batch_compute, for the states of the block; KT_ERROR_ARGUMENT if there is no such thread or block. */
KT_API KT_CHECKED kt_status kt_batch_compute_block(kt_batch *batch, size_t thread, size_t block,
                                                   const kt_batch_job *job, kt_error *error);

/* Report of the computations of a batch. Counts are evaluations of one state, since kt_batch_init. */
typedef struct kt_batch_report {
    size_t width;      /* states in a group; 1: the model is computed state by state */
    const char *why;   /* reason of the width, or NULL; static storage */
    uint64_t in_lanes; /* evaluations in lanes */
    uint64_t alone;    /* evaluations state by state */
    uint64_t failed;   /* evaluations of both kinds that failed */
} kt_batch_report;

/* Returns the report of a batch; zeros for NULL. */
KT_API kt_batch_report kt_batch_report_of(const kt_batch *batch);

#ifdef __cplusplus
}
#endif

#endif
