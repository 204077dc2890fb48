/* Experimental. Small motions about a state: linearisation (state, input and output matrices), modes, static
 * equilibrium. The header also covers periodic motions, stability along a motion, and the energy of a run.
 *
 *     kt_linearization *linearization = NULL;
 *     status = kt_linearization_create(model, NULL, &linearization, &error);
 *     if (status == KT_OK)
 *         status = kt_linearization_evaluate(linearization, 0.0, q, v, NULL, &error);
 *     if (status == KT_OK) {
 *         const kt_linear_system *s = kt_linearization_system(linearization);
 *         for (int i = 0; i < s->states; i++)
 *             printf("%g\n", s->state[i * s->states + i]);
 *     }
 *     kt_linearization_free(linearization);
 *
 * The states of a mechanism with loops, phi(q, t) = 0 and A(q, t) v = b', form a manifold. Its dimension is (nv - rank
 * of the equations that have a residual) + (nv - rank of all equations). With rolling the two terms differ.
 *
 * The coordinates of this manifold, called the *states* in this header, are differences of some joint coordinates from
 * their values at the given state. First come `positions` of q (+) dq, then `velocities` of v + dv. These independent
 * coordinates are chosen by elimination with full pivoting. Therefore all other coordinates follow from the independent
 * coordinates with small factors.
 *
 * Position differences have one component per velocity coordinate. These differences are measured along the joint's
 * exponential map (kt_position_add), which for quaternions is a small rotation in body axes. Last come the model's
 * auxiliary states (kt_auxiliary_state), which count in their own units.
 *
 * A difference is taken from the whole motion through the given state. The rotation of a spherical or free joint is
 * expressed in the axes of the body as it moves, d/dt dq = dv - omega x dq. Some steady motions (a sleeping top, a
 * bicycle that rolls straight ahead) therefore have constant matrices. About any other motion the matrices hold for an
 * instant, and their eigenvalues do not decide the stability. A wheel with a free joint is an example. The axes of the
 * body turn about a horizontal axis, so that the matrix is periodic even if the wheel rolls straight ahead. Functions
 * of the time can change a matrix, too. kt_floquet_evaluate is for such motions. Matrices are column-major. Calls do
 * not allocate unless their docstring states this.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_ANALYSIS_H
#define KINETREE_ANALYSIS_H

#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- linearisation ----------------------------------------------------------------------------------------------- */

/* A marker of a body, by index. */
typedef struct kt_marker_index {
    int body, marker; /* of the model; of the body */
} kt_marker_index;

/* Inputs and outputs of a linearisation. Lists belong to the caller. Only the functions _size, _init and _create read
 * them. */
typedef struct kt_linearization_options {
    size_t size;       /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    const int *inputs; /* velocity coordinates whose joint forces are inputs. NULL: those of all motors, in the order
                          of the description (kt_motor_coordinates) */
    int input_count;   /* length of inputs */
    const kt_marker_index *outputs; /* markers whose positions and velocities are outputs; NULL: all, body by body */
    int output_count;               /* length of outputs */
    bool differences;               /* use finite differences even if exact derivatives are available, for comparison */
} kt_linearization_options;

/* All motors and all markers; exact derivatives where they are available. */
static inline kt_linearization_options kt_linearization_options_default(void) {
    kt_linearization_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    return options;
}

/* Writes the velocity coordinates that the model's motors drive, in the order of the description. Returns their number.
 * coordinates (an array of this length) may be NULL. */
KT_API int kt_motor_coordinates(const kt_model *model, int *coordinates);

/* x' = state x + input u and y = output x about a state. All arrays belong to the linearisation and are valid until its
 * next evaluation. A coordinate is an index into v; its unit is rad or m for positions, rad/s or m/s for velocities. */
typedef struct kt_linear_system {
    int states;                     /* positions + velocities + auxiliary_states */
    int positions, velocities;      /* dimensions of the position manifold, and of the velocities at one position */
    int auxiliary_states;           /* of the model (kt_auxiliary_state_count): the last states, in their own order */
    int coordinates;                /* nv */
    int inputs, outputs;            /* outputs: six per marker, x, y, z and x', y', z' in the world frame */
    const int *position_coordinate; /* positions: the coordinate of each position state, ascending */
    const int *velocity_coordinate; /* velocities: the coordinate of each velocity state, ascending */
    const double *state;            /* states x states */
    const double *input;            /* states x inputs: response to unit forces in the input coordinates */
    const double *output;           /* outputs x states */
    const double *positions_of;     /* coordinates x states: dq of all joints, from the states */
    const double *velocities_of;    /* coordinates x states: dv of all joints */
    const double *rate;             /* states: x' of the state itself, zero at an equilibrium */
    const double *state_error;      /* states x states: estimated error of each number of `state` */
    const double *input_error;      /* states x inputs */
    const double *output_error;     /* outputs x states */
    const double *unit;             /* coordinates: size of a large change: 1 rad, or a length of the mechanism, m */
    const double *response;         /* velocities x coordinates: accelerations of the states by joint forces */
    const double *force_error;      /* coordinates x states: the part of state_error that are errors of forces, as
                                       forces; zero if derivatives are finite differences (NULL: none) */
    double error;                   /* largest of state_error over the largest of `state`, both scaled by units */
    double speed;                   /* largest |v| over its unit, 1/s: zero at rest */
    double acceleration;            /* largest |a| over its unit, 1/s^2: zero in equilibrium and in steady motion */
    bool near_singular;             /* loops are near a singular position: errors may be large */
    bool exact;                     /* derivatives are exact except for rounding; false: finite differences */
} kt_linear_system;

/* A linearisation: a linear system and the workspace that computes it. */
typedef struct kt_linearization kt_linearization;

/* Returns the bytes that a linearisation needs; 0 if options are invalid (kt_linearization_init then reports the
 * reason). options may be NULL. */
KT_API size_t kt_linearization_size(const kt_model *model, const kt_linearization_options *options);

/* Initialises a linearisation in the caller's memory (aligned to KT_ALIGNMENT). The model must outlive the
 * linearisation.
 * Errors: KT_ERROR_ARGUMENT (an index out of range), KT_ERROR_MEMORY. */
KT_API KT_CHECKED kt_status kt_linearization_init(const kt_model *model, const kt_linearization_options *options,
                                                  void *memory, size_t size, kt_linearization **linearization,
                                                  kt_error *error);

/* Creates a linearisation in allocated memory, which kt_linearization_free releases. */
KT_API KT_CHECKED kt_status kt_linearization_create(const kt_model *model, const kt_linearization_options *options,
                                                    kt_linearization **linearization, kt_error *error);
/* Releases memory that _create allocated. Does nothing for an object initialised with _init, nor for NULL. */
KT_API void kt_linearization_free(kt_linearization *linearization);

/* Linearises about (t, q, v) under joint forces tau (nv, may be NULL) and the effects at time t. A state that violates
 * the loop equations is projected first (kt_state_project); q and v themselves are not changed.
 *
 * Derivatives are exact except for rounding (kt_acceleration_derivatives). Therefore derivatives depend on the given
 * state alone. For example, a contact or a stop nearby has no influence. Derivatives are evaluated at two states, a few
 * rounding errors to either side of the given state. The estimated error is the difference of the two results, plus a
 * bound of the rounding errors. A model with a kink at the state itself (a stop that just touches, a spring of zero
 * length) has no derivative at this state. Then the estimated error is large.
 *
 * Central differences along the manifold replace exact derivatives if the options request them, and in two further
 * cases. The system's `exact` is then false.
 *   A caller's own effects give no derivatives.
 *   Near a singular position of loops, if the estimated error of differences is smaller and the path of the motion does
 *     not bend within their steps.
 *
 * Differences are extrapolated from a sequence of halved steps (Ridders 1982, Advances in Engineering Software 4,
 * 75-76). For each number, the steps with the least estimated error are used. Its estimated error is the disagreement
 * of the last extrapolation steps plus rounding. The first step moves angles by 0.1 rad and lengths by 0.1 of the
 * mechanism's length. Anything within that distance may affect the result.
 *
 * On random mechanisms, true errors were within 3 estimated ones.
 *
 * Errors: the previous system is unchanged after an error.
 *   KT_ERROR_SINGULAR at a singular position of the loops, because the states do not form a manifold, and near a
 * singular position if the path bends within rounding.
 *   KT_ERROR_CONSTRAINT, KT_ERROR_NOT_FINITE, and those of kt_acceleration_evaluate.
 *
 * Cost: two calls of kt_acceleration_derivatives and O(nv^3). With differences, about 12 states evaluations of the
 * acceleration. */
KT_API KT_CHECKED kt_status kt_linearization_evaluate(kt_linearization *linearization, double t, const double *q,
                                                      const double *v, const double *tau, kt_error *error);

/* Returns the auxiliary states about which the model is linearised: kt_auxiliary_state_count numbers, which may be
 * written. Their first values are the initial ones of the model. kt_equilibrium_find replaces these values by the
 * values at the equilibrium.
 * Ownership: the array belongs to the linearisation. NULL if there are no auxiliary states. */
KT_API double *kt_linearization_auxiliary_states(kt_linearization *linearization);

/* Returns the system of the last successful evaluation. Before any evaluation all counts are zero. */
KT_API const kt_linear_system *kt_linearization_system(const kt_linearization *linearization);

/* ---- static equilibrium ------------------------------------------------------------------------------------------ */

/* The kind of equilibrium to find, and the effort. */
typedef struct kt_equilibrium_options {
    size_t size;  /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    bool nearest; /* false: the rest position of an overdamped motion, a minimum of the potential energy. true: an
                     equilibrium near the start, found with Newton's method, stable or not */
    int most;     /* the largest number of steps; 0: 300 */
} kt_equilibrium_options;

/* A stable equilibrium, in at most 300 steps. */
static inline kt_equilibrium_options kt_equilibrium_options_default(void) {
    kt_equilibrium_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    return options;
}

/* How an equilibrium was reached. */
typedef struct kt_equilibrium {
    int steps;           /* steps taken, from all starts */
    int starts;          /* 1; with `nearest` more if the search from the given positions has failed */
    bool followed;       /* with auxiliary states: Newton's method has failed, and the result is the end of the
                            motion from rest */
    double distance;     /* length of the last step, over the units of the coordinates */
    double acceleration; /* largest remaining acceleration over its unit, 1/s^2 */
} kt_equilibrium;

/* Moves q (nq) to a position in which the mechanism stays at rest. Forces are those of the effects at time t and joint
 * forces tau (nv, may be NULL). A start at an equilibrium is returned unchanged, even if the equilibrium is unstable;
 * the modes show its stability. Only steps that the loop equations allow are taken, so that a wheel rolls to its final
 * position. Degrees of freedom in which no force acts keep their positions. q is unchanged on failure. found may be
 * NULL.
 *
 * A step d solves (H + mu D) d = g with the force g = M a in the independent degrees of freedom. H is the stiffness
 * matrix and D the diagonal of M. mu is the least value for which H + mu D is positive definite. Near a stable
 * equilibrium mu is 0, which is Newton's method. A step is shortened until the force at the end of the step still does
 * positive work along the step.
 *
 * With `nearest`, mu = 0, and a step is shortened until |g| falls. If the search stalls, starts around the given one
 * are tried, farther and farther away (up to 3 rad or lengths of the mechanism). The last attempt goes downhill. A
 * search that stalls has found an equilibrium only if the remaining force is as small as rounding: 1e-11 of the forces
 * that cancel. The linearisation serves as workspace; its system is unchanged.
 *
 * In a model with auxiliary states, the auxiliary states are in equilibrium, too: x' = 0. Newton's method finds the
 * equilibrium from q and kt_linearization_auxiliary_states, which then contains the states found. The equilibrium may
 * be unstable, for either value of `nearest`. If the rates of all auxiliary states are the number 0, as for footholds,
 * the states are held, and only positions are searched.
 *
 * Errors:
 *   KT_ERROR_STEP: no equilibrium is found. The message names the joint with the largest remaining acceleration or the
 *     joint that runs away.
 *   KT_ERROR_CONSTRAINT: a loop drives the mechanism at t.
 *   Those of kt_linearization_evaluate.
 *
 * Cost per step: two calls of kt_acceleration_derivatives. With differences, about 12 (nv - rank) evaluations of the
 * acceleration. */
KT_API KT_CHECKED kt_status kt_equilibrium_find(kt_linearization *linearization, const kt_equilibrium_options *options,
                                                double t, double *q, const double *tau, kt_equilibrium *found,
                                                kt_error *error);

/* ---- modes ------------------------------------------------------------------------------------------------------- */

/* A solution x exp(lambda t) of x' = state x. A conjugate pair is represented by the mode with imaginary > 0. */
typedef struct kt_mode {
    double real, imaginary; /* lambda, 1/s and rad/s */
    double frequency;       /* imaginary / (2 pi), Hz */
    double damping;         /* damping ratio -real / |lambda|: 1 decays without oscillation, 0 is undamped, below 0
                               is unstable; 0 if lambda is 0 */
    double error;           /* estimated error of lambda, 1/s */
    int count;              /* eigenvalues represented: 2 for a conjugate pair, else 1 */
    double excitation;      /* excitation by the state's own motion, 1/s. It is the largest velocity amplitude of the
                               mode over the unit of its coordinate. Unreliable if two modes have the same shape. */
    double residual;        /* |state x - lambda x| over the sum of the sizes of its terms. The shape is reliable if the
                               residual is that of rounding, and meaningless if it is near 1. */
} kt_mode;

/* All modes of a linear system, and the workspace that computes them. */
typedef struct kt_modes kt_modes;

/* Bytes for the modes of any state of a model. Initialising and releasing are as for a linearisation. */
KT_API size_t kt_modes_size(const kt_model *model);
KT_API KT_CHECKED kt_status kt_modes_init(const kt_model *model, void *memory, size_t size, kt_modes **modes,
                                          kt_error *error);
KT_API KT_CHECKED kt_status kt_modes_create(const kt_model *model, kt_modes **modes, kt_error *error);
/* Releases memory that _create allocated. Does nothing for an object initialised with _init, nor for NULL. */
KT_API void kt_modes_free(kt_modes *modes);

/* Computes all modes of a linear system of the same model, by increasing |lambda|. A state on which nothing depends
 * beyond the estimated errors has an eigenvalue of zero. So has a state whose rate depends on nothing.
 *
 * Eigenvalues come from LAPACK's dgeevx. Their error is, to first order, |w| (state_error + rounding) |x| / |w' x| with
 * the left and right eigenvectors w and x. Errors of forces count as |w' response| force_error |x|. The error is large
 * if eigenvalues with the same shape coincide, as for a drifting body or critical damping.
 *
 * Errors: KT_ERROR_NOT_FINITE if the eigenvalues do not converge; KT_ERROR_ARGUMENT if the system has another size.
 * Cost: O(states^3). */
KT_API KT_CHECKED kt_status kt_modes_evaluate(kt_modes *modes, const kt_linear_system *system, kt_error *error);

/* In turn: the number of modes of the last evaluation; one of these modes. */
KT_API int kt_modes_count(const kt_modes *modes);
KT_API kt_mode kt_modes_at(const kt_modes *modes, int mode);

/* Returns the shape of a mode: dq (nv complex numbers: re, im, re, im, ...) of all joints, or dv. The shape is scaled
 * so that the largest |dq| over its unit is 1 and that component is real. If no position moves, dv is scaled likewise.
 * Valid until the next evaluation. */
KT_API const double *kt_modes_positions(const kt_modes *modes, int mode);
KT_API const double *kt_modes_velocities(const kt_modes *modes, int mode);
/* Returns the mode's part in auxiliary states (kt_auxiliary_state_count complex numbers), with the same scale. If
 * nothing moves, the part is not scaled. Returns NULL if there are no auxiliary states. */
KT_API const double *kt_modes_auxiliary_states(const kt_modes *modes, int mode);

/* ---- frequency response ------------------------------------------------------------------------------------------ */

/* The bytes of memory for kt_frequency_response. */
KT_API size_t kt_frequency_response_size(const kt_linear_system *system);

/* Computes the amplitudes of all states (states complex numbers: re, im, re, im, ...) under a force exp(i omega t) in a
 * velocity coordinate. The force is real, so that the argument of an amplitude is its phase relative to the force. The
 * amplitude of a coordinate or of an output follows from positions_of, velocities_of and output of the system. memory:
 * kt_frequency_response_size bytes, aligned for numbers.
 * Units: omega in rad/s; amplitudes for each N m or N of the force.
 * Errors: KT_ERROR_SINGULAR if omega is the frequency of an undamped mode, KT_ERROR_ARGUMENT. *states is then
 * unchanged.
 * Cost: O(states^3). */
KT_API KT_CHECKED kt_status kt_frequency_response(const kt_linear_system *system, int coordinate, double omega,
                                                  void *memory, double *states, kt_error *error);

/* ---- periodic motion --------------------------------------------------------------------------------------------- */

/* A Floquet multiplier mu, an eigenvalue of the monodromy matrix. The multiplier is the factor by which a small
 * difference from a periodic motion changes in one period. A conjugate pair is represented by the multiplier with
 * imaginary > 0. */
typedef struct kt_multiplier {
    double real, imaginary; /* mu */
    double modulus;         /* |mu|: above 1 the difference grows */
    double growth;          /* log |mu| / period, 1/s */
    double frequency;       /* |arg mu| / (2 pi period), Hz, up to multiples of 1 / period and its sign */
    double error;           /* estimated error of mu: of steps, and of rounding */
    int count;              /* eigenvalues represented: 2 for a conjugate pair, else 1 */
} kt_multiplier;

/* The period, and the steps that cover the period. */
typedef struct kt_floquet_options {
    size_t size;             /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    double period;           /* s, > 0 */
    const kt_method *method; /* an explicit Runge-Kutta method */
    int steps;               /* of the period; even */
} kt_floquet_options;

/* 400 steps of rk4. */
static inline kt_floquet_options kt_floquet_options_default(double period) {
    kt_floquet_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    options.period = period;
    options.method = kt_method_find("rk4");
    options.steps = 400;
    return options;
}

/* The Floquet multipliers of a periodic motion, and the workspace that computes them. */
typedef struct kt_floquet kt_floquet;

/* Allocates a computation of multipliers; kt_floquet_free releases the computation. The model must outlive the
 * computation.
 * Errors: KT_ERROR_ARGUMENT (period, steps, method), KT_ERROR_MEMORY, KT_ERROR_UNSUPPORTED without LAPACK. */
KT_API KT_CHECKED kt_status kt_floquet_create(const kt_model *model, const kt_floquet_options *options,
                                              kt_floquet **floquet, kt_error *error);
/* Releases a computation of multipliers; does nothing with NULL. */
KT_API void kt_floquet_free(kt_floquet *floquet);

/* Computes the multipliers of the motion that is at (q, v) at time t. The multipliers follow from the exact derivatives
 * of the steps (kt_step_derivatives) over one period. A second computation with half as many steps gives the error.
 * Directions that the loops forbid are left out. The function does not check that the motion is periodic; use
 * kt_floquet_gap.
 *
 * Errors: as kt_step_derivatives; KT_ERROR_NOT_FINITE.
 * Cost: 1.5 times `steps` derivatives of a step and products of matrices, O(steps nv^3). Allocates nothing. */
KT_API KT_CHECKED kt_status kt_floquet_evaluate(kt_floquet *floquet, double t, const double *q, const double *v,
                                                kt_error *error);

/* In turn: the number of multipliers of the last evaluation; a multiplier by its index, in the order of falling
 * modulus. */
KT_API int kt_floquet_count(const kt_floquet *floquet);
KT_API kt_multiplier kt_floquet_at(const kt_floquet *floquet, int multiplier);

/* Returns the monodromy matrix, 2 nv x 2 nv, column-major, in tangent coordinates (xi, dv) as of kt_step_derivatives.
 * With auxiliary states the coordinates are (xi, dv, dx). */
KT_API const double *kt_floquet_monodromy(const kt_floquet *floquet);

/* Returns the auxiliary states at the start of the motion (kt_auxiliary_state_count). Their first values are the
 * model's initial ones. The caller may write other values before an evaluation. */
KT_API double *kt_floquet_auxiliary_states(kt_floquet *floquet);

/* Returns the distance of the motion from its start after the period, the largest of three kinds of changes. NaN before
 * an evaluation.
 *   The change of a position, rad or m. Whole turns of angles do not count.
 *   The change of a velocity times the period.
 *   The change of an auxiliary state, relative to the state if that is above 1. */
KT_API double kt_floquet_gap(const kt_floquet *floquet);

/* ---- stability along a motion ------------------------------------------------------------------------------------ */

/* The modes of a mechanism at some states of a motion. These modes bound the step size of an explicit method. */
typedef struct kt_spectrum kt_spectrum;

/* Sizes of a spectrum. */
enum {
    KT_SPECTRUM_SHAPES = 8,  /* the number of fastest modes of a state whose shapes are stored */
    KT_SPECTRUM_SAMPLES = 9, /* default number of states */
};

/* One mode at one of the states. */
typedef struct kt_spectrum_mode {
    double t;            /* time of the state, s */
    kt_mode mode;        /* the mode at that state */
    const double *moves; /* amplitude of each velocity coordinate of the model in the mode, over its unit
                            (kt_linear_system), the largest 1. The array has nv numbers and is valid as long as the
                            spectrum. NULL for all but the fastest modes. */
} kt_spectrum_mode;

/* Bytes for the modes at `samples` >= 1 states. Initialising and releasing are as for a linearisation. */
KT_API size_t kt_spectrum_size(const kt_model *model, int samples);
KT_API KT_CHECKED kt_status kt_spectrum_init(const kt_model *model, int samples, void *memory, size_t size,
                                             kt_spectrum **spectrum, kt_error *error);
KT_API KT_CHECKED kt_status kt_spectrum_create(const kt_model *model, int samples, kt_spectrum **spectrum,
                                               kt_error *error);
/* Releases memory that _create allocated. Does nothing for an object initialised with _init, nor for NULL. */
KT_API void kt_spectrum_free(kt_spectrum *spectrum);

/* Adds the modes at a state. The spectrum is unchanged after an error. Allocates nothing.
 * Errors: as kt_linearization_evaluate and kt_modes_evaluate, KT_ERROR_ARGUMENT if there is no room for another state.
 * Cost: that of these two functions. */
KT_API KT_CHECKED kt_status kt_spectrum_add(kt_spectrum *spectrum, double t, const double *q, const double *v,
                                            const double *tau, kt_error *error);

/* Clears the spectrum and adds the modes at states spaced evenly over a run from its start to its end. There are as
 * many states as there is room for. With room for a single state, this state is the start. Hard contacts that are
 * closed or rest in a state, and friction that sticks, are constraints of its modes. States at singular positions of
 * loops are left out, and so are states in which slip of a hard contact begins. Allocates a simulation and
 * linearisations, and releases them.
 *
 * The motion is computed with adaptive steps, for any step of the run. The method is that of the run if the run is
 * adaptive, otherwise the default method at tolerance 1e-6.
 *
 * Errors: if the motion cannot be computed to its end, those of kt_simulation_advance. The modes up to this time remain
 * in the spectrum.
 */
KT_API KT_CHECKED kt_status kt_spectrum_along(kt_spectrum *spectrum, const kt_run *run, kt_error *error);

/* In turn: the number of states added; the number of modes at all states together; one of these modes. Modes are
 * ordered by time, and at the same time by decreasing |lambda|. */
KT_API int kt_spectrum_samples(const kt_spectrum *spectrum);
KT_API int kt_spectrum_count(const kt_spectrum *spectrum);
KT_API kt_spectrum_mode kt_spectrum_at(const kt_spectrum *spectrum, int mode);

/* Returns the positions (nq) of the state `sample`, 0 <= sample < kt_spectrum_samples. The array belongs to the
 * spectrum. */
KT_API const double *kt_spectrum_positions(const kt_spectrum *spectrum, int sample);

/* Returns the index of the mode with the largest |lambda|; -1 if there is none. */
KT_API int kt_spectrum_fastest(const kt_spectrum *spectrum);

/* The largest fixed step. */
typedef struct kt_step_limit {
    double step;   /* s; HUGE_VAL if no mode bounds it */
    double growth; /* largest growth of a mode over the duration at the given step; 1 without a step */
    int mode;      /* the mode that bounds the step, or grows most at a given longer step; -1: none */
} kt_step_limit;

/* Returns the largest step with which no mode grows too much over a run of `duration` > 0 seconds. The bound is
 * KT_STABILITY_GROWTH times the true growth of a mode (kt_stability_step). If `step` > 0 is given, `growth` is the
 * largest growth of a mode at that step (kt_stability_growth).
 *
 * The limit is valid for small motions about the states of the spectrum. For a nonlinear motion its error is about the
 * change of the modes between these states. */
KT_API kt_step_limit kt_spectrum_limit(const kt_spectrum *spectrum, const kt_method *method, double duration,
                                       double step);

/* The largest error of an oscillation over one period, relative to its amplitude, that counts as accurate. */
#define KT_SAMPLING_ERROR 1e-2

/* An oscillation that a fixed step resolves too coarsely. */
typedef struct kt_sampling {
    int mode;       /* the fastest such oscillation; -1: none */
    double samples; /* steps per period */
    double error;   /* kt_stability_period_error */
    double step;    /* the step at which this error is KT_SAMPLING_ERROR, s */
} kt_sampling;

/* Returns the fastest excited oscillation whose error over a period is more than KT_SAMPLING_ERROR at this step of the
 * method. The error combines amplitude and phase. An oscillation counts as excited if its velocities are at least 3 %
 * of the velocities of the most excited oscillation in the same state (a thousandth of its energy). A steady spin is
 * not an oscillation. step > 0. */
KT_API kt_sampling kt_spectrum_sampling(const kt_spectrum *spectrum, const kt_method *method, double step);

/* ---- the fastest mode along a run -------------------------------------------------------------------------------- */

/* A monitor of the rate of the fastest mode at the states of a run, at the cost of a few evaluations per state. The
 * monitor shows at which state, if any, computing a spectrum is worthwhile. */
typedef struct kt_mode_watch kt_mode_watch;

/* Bytes that a watch needs. Initialising and releasing are as for a linearisation. */
KT_API size_t kt_mode_watch_size(const kt_model *model);
KT_API KT_CHECKED kt_status kt_mode_watch_init(const kt_model *model, void *memory, size_t size, kt_mode_watch **watch,
                                               kt_error *error);
KT_API KT_CHECKED kt_status kt_mode_watch_create(const kt_model *model, kt_mode_watch **watch, kt_error *error);
/* Releases memory that _create allocated. Does nothing for an object initialised with _init, nor for NULL. */
KT_API void kt_mode_watch_free(kt_mode_watch *watch);

/* Estimates |lambda| of the fastest mode at a state, with the power method and finite differences. The estimate is
 * usually too low, mostly by less than a tenth and seldom by more than a half. States at which the acceleration cannot
 * be computed are skipped. Allocates nothing.
 * Cost: 3 evaluations of the acceleration, up to 17 if the rate is new or has grown. */
KT_API void kt_mode_watch_add(kt_mode_watch *watch, double t, const double *q, const double *v);

/* A state, and the estimated rate of its fastest mode. */
typedef struct kt_fast_state {
    double t, rate;      /* s; |lambda|, 1/s, 0 if no rate has been found */
    const double *q, *v; /* nq; nv; they belong to the watch */
} kt_fast_state;

/* Returns the state with the largest estimate so far. Before any estimate, rate is 0 and q and v are undefined. q and v
 * point into the watch. Both are valid until the next kt_mode_watch_add or until the watch is released. Cannot fail;
 * evaluates nothing. */
KT_API kt_fast_state kt_mode_watch_fastest(const kt_mode_watch *watch);

/* Returns the number of evaluations of the acceleration that the watch has made. */
KT_API uint64_t kt_mode_watch_evaluations(const kt_mode_watch *watch);

/* The first function returns the bytes of the numbers on which later estimates depend. The second function writes these
 * numbers into a block, aligned as a double. The third function reads the numbers back into a watch of the same model,
 * whose further estimates then have the same bits as without the interruption. */
KT_API size_t kt_mode_watch_state_size(const kt_mode_watch *watch);
KT_API void kt_mode_watch_save(const kt_mode_watch *watch, void *block);
KT_API void kt_mode_watch_restore(kt_mode_watch *watch, const void *block);

/* ---- energy along a run ------------------------------------------------------------------------------------------ */

/* The energy error over the energy scale up to which a run counts as accurate; and the ratio above which a run counts
 * as blown up. */
#define KT_ENERGY_ERROR 1e-3
#define KT_ENERGY_BLOW_UP 1e3

/* The energy E = kinetic + potential over the records of a run. The struct holds plain numbers, which may be copied and
 * kept.
 *
 * The error is the change of E that the integration has caused.
 *   Mechanisms that conserve energy: |E - E(0)|.
 *   Mechanisms that can only dissipate energy: E minus its least value so far.
 *   Runs that record the work done, for any mechanism: the change of the balance E + dissipated - supplied.
 *   Runs that estimate the work done (watch_works): the part of that change beyond the uncertainty of the estimate.
 *   All others, in which energy can be supplied: the error is unknown.
 *
 * The error is divided by the energy scale of the motion. This scale is E(0) minus the least potential energy so far.
 * This scale is the largest kinetic energy that the visited positions allow, and does not depend on the zero of the
 * potential energies. If energy is supplied, the scale is the largest of the kinetic energy, the range of the potential
 * energy, and the work done. */
typedef struct kt_energy_watch {
    kt_energetics energetics; /* of the model */
    int32_t has_balance;      /* whether the records contain the work done */
    int32_t has_estimate;     /* whether the records contain an estimate of the work done */
    int64_t records;          /* the number of records with energies */
    double start;             /* E of the first record, J */
    double start_size;        /* the larger of |kinetic| and |potential| of the first record, J */
    double lowest;            /* least E, J */
    double change;            /* largest |E - start|, J */
    double kinetic;           /* largest, J */
    double potential[2];      /* least and largest, J */
    double work;              /* largest of |dissipated| and |supplied|, J */
    double uncertainty;       /* the largest uncertainty of estimated work so far, J */
    double balance_start;     /* of the first record, J */
    double balance_change;    /* largest |balance - balance_start|, J */
    double gain;              /* largest rise of E that the mechanism cannot have caused, J; 0 if energy can be
                                 supplied */
    double error;             /* largest error, J */
    double excess_time;       /* from this record on the error exceeds KT_ENERGY_ERROR, s; NaN: none */
} kt_energy_watch;

/* Returns the watch before the first record. */
KT_API kt_energy_watch kt_energy_watch_start(const kt_model *model);
/* Adds a record that has energies (KT_RECORD_ENERGY or KT_RECORD_BALANCE). Does nothing for other records. O(1). */
KT_API void kt_energy_watch_add(kt_energy_watch *watch, const kt_record *record);
/* Adds the energies at the end of a step, J. These energies widen only the energy scale, because all records may fall
 * on turning points, at which the kinetic energy is nearly zero. Does nothing before the first record. O(1). */
KT_API void kt_energy_watch_step(kt_energy_watch *watch, double kinetic, double potential);

/* Returns the energy scale, J. */
KT_API double kt_energy_watch_scale(const kt_energy_watch *watch);
/* Returns the largest error divided by the energy scale. The error is 0 if it is unknown, or if rounding explains it:
 * below 1e-12 of the largest energy, or below 1e-20 J. */
KT_API double kt_energy_watch_error(const kt_energy_watch *watch);
/* Returns whether a mechanism that cannot gain energy has gained KT_ENERGY_BLOW_UP times its scale, more than its
 * energy at the start, and more than 1e-20 J, which is rounding. In the first steps from rest, before the potential
 * energy has fallen, this may be temporary. */
KT_API bool kt_energy_watch_is_blown_up(const kt_energy_watch *watch);

#ifdef __cplusplus
}
#endif
#endif
