/* Small motions about a state: state, input and output matrices, modes, static equilibrium.
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
 * The states of a mechanism with loops, phi(q, t) = 0 and A(q, t) v = b', are a manifold of (nv - rank of the equations
 * with a residual) + (nv - rank of all) dimensions; rolling makes the two numbers differ. Its coordinates here, the
 * *states*, are the differences of some of the joints' own coordinates from those of the given state: first
 * `positions` of q (+) dq, then `velocities` of v + dv. Which ones is chosen by elimination with full pivoting, so that
 * all others follow from them with small factors. A position coordinate is counted as velocities are: along the joint's
 * exponential map (kt_position_add), which for quaternions is a small rotation in body axes.
 *
 * A difference from a state that moves is one from the whole motion through that state: the rotation of a ball or free
 * body is counted in the axes of the body as it moves along, d/dt dq = dv - omega x dq. So steady motions (a sleeping
 * top, a bicycle that rolls straight on) have constant matrices; about any other motion they hold for an instant.
 *
 * Matrices are column-major. Calls allocate nothing but where they say so.
 */
#ifndef KINETREE_ANALYSIS_H
#define KINETREE_ANALYSIS_H

#include "kinetree/reduction.h"
#include "kinetree/simulation.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- linearisation ----------------------------------------------------------------------------------------------- */

/* A marker of a body, by index. */
typedef struct kt_marker_index {
    int body, marker; /* of the model; of the body */
} kt_marker_index;

/* What the matrices are about. Lists stay the caller's and are read by _size, _place and _create only. */
typedef struct kt_linearization_options {
    const int *inputs; /* velocity coordinates whose joint forces are inputs; NULL: those of all motors, in the order of
                          the description (kt_motor_coordinates) */
    int input_count;   /* length of inputs */
    const kt_marker_index *outputs; /* markers whose positions and velocities are outputs; NULL: all, body by body */
    int output_count;               /* length of outputs */
    bool differences; /* take differences also where exact derivatives are known, to hold one against the other */
} kt_linearization_options;

/* All motors and all markers; exact derivatives where there are any. */
KT_API kt_linearization_options kt_linearization_options_default(void);

/* Velocity coordinates that the motors of the description drive, in its order; returns their number. coordinates (as
 * many as that) may be NULL. */
KT_API int kt_motor_coordinates(const kt_model *model, int *coordinates);

/* x' = state x + input u and y = output x about a state. All arrays live in the linearisation and are valid until its
 * next evaluation. A coordinate is an index into v; units are its own (rad or m, and per second). */
typedef struct kt_linear_system {
    int states;                     /* positions + velocities */
    int positions, velocities;      /* dimensions of the position manifold, and of the velocities at one position */
    int coordinates;                /* nv */
    int inputs, outputs;            /* outputs: six a marker, x, y, z and x', y', z' in the world */
    const int *position_coordinate; /* positions: the coordinate that a state is; ascending */
    const int *velocity_coordinate; /* velocities: the same */
    const double *state;            /* states x states */
    const double *input;            /* states x inputs: by unit forces in the coordinates asked for */
    const double *output;           /* outputs x states */
    const double *positions_of;     /* coordinates x states: dq of all joints, from the states */
    const double *velocities_of;    /* coordinates x states: dv of all joints */
    const double *rate;             /* states: x' of the state itself, zero at an equilibrium */
    const double *state_error;      /* states x states: estimated error of each number of `state` */
    const double *input_error;      /* states x inputs */
    const double *output_error;     /* outputs x states */
    const double *unit;  /* coordinates: what counts as a large change: 1 rad, or a length of the mechanism */
    double error;        /* largest of state_error against the largest of `state`, both by units */
    double speed;        /* largest |v| against its unit, 1/s: zero at rest */
    double acceleration; /* largest |a| against its unit, 1/s^2: zero in equilibrium and in steady motion */
    bool near_singular;  /* loops are near a singular position: expect large errors */
    bool exact;          /* derivatives are exact but for rounding; false: differences were taken */
} kt_linear_system;

/* A linearisation: a linear system, and all that finding it takes. */
typedef struct kt_linearization kt_linearization;

/* Bytes that a linearisation takes; 0 where options are wrong, which _place then says in words. options may be NULL. */
KT_API size_t kt_linearization_size(const kt_model *model, const kt_linearization_options *options);

/* Lays a linearisation out in the caller's memory (KT_ALIGNMENT). The model must outlive it. Errors: KT_ERROR_ARGUMENT
 * (an index that is none), KT_ERROR_MEMORY. */
KT_API KT_CHECKED kt_status kt_linearization_init(const kt_model *model, const kt_linearization_options *options,
                                                  void *memory, size_t size, kt_linearization **linearization,
                                                  kt_error *error);

/* The same in memory of its own, released with kt_linearization_free. */
KT_API KT_CHECKED kt_status kt_linearization_create(const kt_model *model, const kt_linearization_options *options,
                                                    kt_linearization **linearization, kt_error *error);
/* Releases what _create made; does nothing with what was placed, nor with NULL. */
KT_API void kt_linearization_free(kt_linearization *linearization);

/* Linearises about (t, q, v) under joint forces tau (nv, may be NULL) and the effects as they are at t. A state that is
 * not closed is projected first (kt_state_project); q and v themselves are not touched.
 *
 * Derivatives are exact but for rounding (kt_acceleration_derivatives), so that nothing beside the state enters, such
 * as a contact or a stop that is near. They are taken at two states a few rounding errors to either side of the given
 * one: what these differ by, and a bound of what rounding leaves, is the estimated error. A scene with a kink at the
 * state itself (a stop that just touches, a spring of no length) has no derivative: its estimate says so.
 *
 * With a caller's own effects, and next to singular positions of loops, they are central differences along the manifold
 * (the system's `exact` is false then), extrapolated from a sequence of halved steps (Ridders 1982, Advances in
 * Engineering Software 4, 75-76), each number from the steps that suit it best; what the last steps of the extrapolation
 * and rounding leave is the estimated error. Angles are first moved by 0.1 rad, lengths by 0.1 of the mechanism's: what
 * lies so near may enter.
 *
 * On random mechanisms true errors were within 3 estimated ones.
 * Errors: KT_ERROR_SINGULAR at a singular position of the loops, where the states are no manifold, and as
 * kt_acceleration_evaluate; KT_ERROR_CONSTRAINT; KT_ERROR_NOT_FINITE; the system is then as before. Twice
 * kt_acceleration_derivatives and O(nv^3); with differences about 12 states evaluations of the acceleration. */
KT_API KT_CHECKED kt_status kt_linearization_evaluate(kt_linearization *linearization, double t, const double *q,
                                                      const double *v, const double *tau, kt_error *error);

/* What the last evaluation found; without one all counts are zero. */
KT_API const kt_linear_system *kt_linearization_system(const kt_linearization *linearization);

/* ---- static equilibrium ------------------------------------------------------------------------------------------ */

/* Which equilibrium, and how hard to look. */
typedef struct kt_equilibrium_options {
    bool nearest; /* false: where the mechanism would come to rest in overdamped motion, a minimum of its potential
                     energy; true: Newton's way to an equilibrium near the start, stable or not */
    int most;     /* steps; 0: 300 */
} kt_equilibrium_options;

/* A stable one, in at most 300 steps. */
KT_API kt_equilibrium_options kt_equilibrium_options_default(void);

/* An equilibrium that was found. */
typedef struct kt_equilibrium {
    int steps;           /* that it took */
    double distance;     /* length of the last step, against the units of the coordinates */
    double acceleration; /* largest that is left, against the units, 1/s^2 */
} kt_equilibrium;

/* Moves q (nq) to a position in which the mechanism stays at rest under its effects as they are at t and joint forces
 * tau (nv, may be NULL). A start that is an equilibrium is kept, even an unstable one: modes tell which it is. Only
 * steps that the loops allow are taken, so that a wheel rolls to its place; freedoms that no force acts in keep their
 * positions. q is untouched on failure. found may be NULL.
 *
 * Steps d solve (H + mu D) d = g with the force g = M a in the freedoms that are left, H the stiffness and D the
 * diagonal of M there; mu is the least for which H + mu D is positive definite (0 near a stable equilibrium: Newton),
 * and a step is
 * shortened until the force still does work along it. Nearest: mu = 0, shortened until |a| falls. The linearisation
 * serves as workspace; its system stays what it was.
 * Errors: KT_ERROR_STEP where none is found, which names the joint that is still pushed most, or that runs away;
 * KT_ERROR_CONSTRAINT where a loop drives the mechanism at t; as kt_linearization_evaluate. About 12 (nv - rank)
 * evaluations of the acceleration a step. */
KT_API KT_CHECKED kt_status kt_equilibrium_find(kt_linearization *linearization, const kt_equilibrium_options *options,
                                                double t, double *q, const double *tau, kt_equilibrium *found,
                                                kt_error *error);

/* ---- modes ------------------------------------------------------------------------------------------------------- */

/* A solution exp(lambda t) of x' = state x; of two conjugate ones the one with imaginary > 0 stands for both. */
typedef struct kt_mode {
    double real, imaginary; /* lambda, 1/s and rad/s */
    double frequency;       /* imaginary / (2 pi), Hz */
    double damping;         /* damping ratio -real / |lambda|: 1 decays without oscillation, 0 is undamped, below 0 is
                               unstable; 0 where lambda is 0 */
    double error;           /* estimated error of lambda, 1/s */
    int count;              /* eigenvalues that this stands for: 2 for a conjugate pair, else 1 */
    double excitation; /* how much the state itself moves in this mode: the amplitude of the velocities, the largest
                          against the unit of its coordinate, 1/s; of two modes with one shape it says little */
} kt_mode;

/* All modes of a linear system, and the workspace to find them. */
typedef struct kt_modes kt_modes;

/* Bytes for the modes of any state of a model; placing and releasing as above. */
KT_API size_t kt_modes_size(const kt_model *model);
KT_API KT_CHECKED kt_status kt_modes_init(const kt_model *model, void *memory, size_t size, kt_modes **modes,
                                          kt_error *error);
KT_API KT_CHECKED kt_status kt_modes_create(const kt_model *model, kt_modes **modes, kt_error *error);
/* Releases what _create made; does nothing with what was placed, nor with NULL. */
KT_API void kt_modes_free(kt_modes *modes);

/* All modes of a linear system of the same model, by rising |lambda|. Numbers of the state matrix that are below their
 * estimated error count as zero. Eigenvalues by LAPACK's dgeevx; their error is, to first order, |w| (state_error +
 * rounding) |x| / |w' x| with the left and right vectors: large where eigenvalues with one shape coincide, as those of
 * a body that drifts or of critical damping. Errors: KT_ERROR_NOT_FINITE where the eigenvalues do not converge;
 * KT_ERROR_ARGUMENT where the system is of another size. O(states^3). */
KT_API KT_CHECKED kt_status kt_modes_evaluate(kt_modes *modes, const kt_linear_system *system, kt_error *error);

/* Modes found by the last evaluation: how many; one of them. */
KT_API int kt_modes_count(const kt_modes *modes);
KT_API kt_mode kt_modes_at(const kt_modes *modes, int mode);

/* The shape of a mode: dq (nv complex numbers: re, im, re, im, ...) of all joints, or dv. Scaled so that the largest
 * |dq| against its unit is 1 and that number is real; where no position moves, the same of dv. Valid until the next
 * evaluation. */
KT_API const double *kt_modes_positions(const kt_modes *modes, int mode);
KT_API const double *kt_modes_velocities(const kt_modes *modes, int mode);

/* ---- stability along a motion ------------------------------------------------------------------------------------ */

/* The modes of a mechanism at some states of a motion, and how long a step they allow an explicit method. */
typedef struct kt_spectrum kt_spectrum;

/* How much of a spectrum is kept. */
enum {
    KT_SPECTRUM_SHAPES = 8,  /* the fastest modes of a state, whose shapes are kept */
    KT_SPECTRUM_SAMPLES = 9, /* states, where nothing else is asked for */
};

/* One mode at one of the states. */
typedef struct kt_spectrum_mode {
    double time;         /* of the state, s */
    kt_mode mode;        /* there */
    const double *moves; /* how much each velocity coordinate of the model moves in it, against its unit
                            (kt_linear_system), the largest 1: nv numbers, valid as long as the spectrum; NULL for all
                            but the fastest modes */
} kt_spectrum_mode;

/* Bytes for the modes at `samples` >= 1 states; placing and releasing as above. */
KT_API size_t kt_spectrum_size(const kt_model *model, int samples);
KT_API KT_CHECKED kt_status kt_spectrum_init(const kt_model *model, int samples, void *memory, size_t size,
                                             kt_spectrum **spectrum, kt_error *error);
KT_API KT_CHECKED kt_status kt_spectrum_create(const kt_model *model, int samples, kt_spectrum **spectrum,
                                               kt_error *error);
/* Releases what _create made; does nothing with what was placed, nor with NULL. */
KT_API void kt_spectrum_free(kt_spectrum *spectrum);

/* Adds the modes at a state. Errors: as kt_linearization_evaluate and kt_modes_evaluate, KT_ERROR_ARGUMENT where there
 * is no room for another state; the spectrum is then as before. Cost: theirs. Allocates nothing. */
KT_API KT_CHECKED kt_status kt_spectrum_add(kt_spectrum *spectrum, double t, const double *q, const double *v,
                                            const double *tau, kt_error *error);

/* Starts again: adds the modes at states spread evenly over a run from its start to its end, as many as there is room
 * for, or at its start alone where that is one. The motion is computed adaptively, by the run's own method if that is
 * adaptive and else by dopri5 at tolerance 1e-6, whatever step the run has. States at singular positions of loops are
 * left out. Allocates a simulation and releases it.
 * Errors: where the motion cannot be computed to its end, those of kt_simulation_advance; the modes up to there are
 * kept. */
KT_API KT_CHECKED kt_status kt_spectrum_along(kt_spectrum *spectrum, const kt_run *run, kt_error *error);

/* How many states were added; how many modes they all have; one of them. Modes are numbered by time, and at one time by
 * falling |lambda|. */
KT_API int kt_spectrum_samples(const kt_spectrum *spectrum);
KT_API int kt_spectrum_count(const kt_spectrum *spectrum);
KT_API kt_spectrum_mode kt_spectrum_at(const kt_spectrum *spectrum, int mode);

/* The positions (nq) of the state `sample`, 0 <= sample < kt_spectrum_samples; the spectrum's. */
KT_API const double *kt_spectrum_positions(const kt_spectrum *spectrum, int sample);

/* The mode with the largest |lambda| of all; -1 where there is none. */
KT_API int kt_spectrum_fastest(const kt_spectrum *spectrum);

/* How long a fixed step may be. */
typedef struct kt_step_limit {
    double step;   /* s; HUGE_VAL where no mode bounds it */
    double growth; /* of the mode that bounds it, over the duration, at the step that was asked about */
    int mode;      /* that bounds it; -1: none */
} kt_step_limit;

/* The largest step with which a method keeps all modes from growing, over a run of `duration` > 0 seconds, by more than
 * they do in truth: kt_stability_step with KT_STABILITY_GROWTH. `step` (0: none) is a step that is asked about: then
 * `growth` is how much the mode that suffers most from it would grow (kt_stability_growth). What holds of motions near
 * the states; the limit of a motion that is not linear differs by what its modes change in between. */
KT_API kt_step_limit kt_spectrum_limit(const kt_spectrum *spectrum, const kt_method *method, double duration,
                                       double step);

/* The largest error of an oscillation over one period, of its amplitude, that counts as accurate. */
#define KT_SAMPLING_ERROR 1e-2

/* An oscillation that a fixed step samples too coarsely. */
typedef struct kt_sampling {
    int mode;       /* the fastest of them; -1: there is none */
    double samples; /* steps a period */
    double error;   /* kt_stability_period_error */
    double step;    /* s, with which this is KT_SAMPLING_ERROR */
} kt_sampling;

/* The fastest oscillation that is excited (with velocities of at least 3 % of the most excited oscillation of its
 * state, a thousandth of its energy; a steady spin is no oscillation) and whose amplitude and phase a step of this method gets wrong by more than
 * KT_SAMPLING_ERROR over a period. step > 0. */
KT_API kt_sampling kt_spectrum_sampling(const kt_spectrum *spectrum, const kt_method *method, double step);

/* ---- the fastest mode along a run -------------------------------------------------------------------------------- */

/* A watch on the rate of the fastest mode at the states of a run, for the price of some evaluations each: whether, and
 * where, a spectrum is worth its price. */
typedef struct kt_mode_watch kt_mode_watch;

/* Bytes that a watch takes; placing and releasing as above. */
KT_API size_t kt_mode_watch_size(const kt_model *model);
KT_API KT_CHECKED kt_status kt_mode_watch_place(const kt_model *model, void *memory, size_t size, kt_mode_watch **watch,
                                                kt_error *error);
KT_API KT_CHECKED kt_status kt_mode_watch_create(const kt_model *model, kt_mode_watch **watch, kt_error *error);
/* Releases what _create made; does nothing with what was placed, nor with NULL. */
KT_API void kt_mode_watch_free(kt_mode_watch *watch);

/* Estimates |lambda| of the fastest mode at a state, by the power method with differences: 3 evaluations of the
 * acceleration, up to 17 where the rate is new or has grown. Estimates err downwards, mostly by less than a tenth, and
 * seldom by more than a half. States without an acceleration are passed over. Allocates nothing. */
KT_API void kt_mode_watch_add(kt_mode_watch *watch, double t, const double *q, const double *v);

/* A state, and the estimated rate of its fastest mode. */
typedef struct kt_fast_state {
    double time, rate;   /* s; |lambda|, 1/s, 0 where nothing has been found */
    const double *q, *v; /* nq; nv; the watch's */
} kt_fast_state;

/* The state with the largest estimate of those added so far; before any, rate is 0 and q and v are undefined. q and v
 * point into the watch: they hold until the next kt_mode_watch_add or the watch's end. Cannot fail; takes no
 * evaluation. */
KT_API kt_fast_state kt_mode_watch_fastest(const kt_mode_watch *watch);

/* Evaluations of the acceleration that the watch has taken. */
KT_API uint64_t kt_mode_watch_evaluations(const kt_mode_watch *watch);

/* ---- energy along a run ------------------------------------------------------------------------------------------ */

/* The largest error of the energy, over its scale, of a run that is accurate; and from which on it has blown up. */
#define KT_ENERGY_ERROR 1e-3
#define KT_ENERGY_BLOW_UP 1e3

/* What the records of a run say about its energy E = kinetic + potential. Plain numbers, which may be copied and kept.
 *
 * The error is what the integration has changed of E: |E - E(0)| where the mechanism conserves energy, E less its least
 * value so far where it can only dissipate it, and where works are recorded the change of the balance
 * E + dissipated - supplied, whatever the mechanism. Where it can be supplied with energy and no works are recorded
 * nothing is known of the error.
 *
 * It is held against the energy scale of the motion: E(0) less the least potential energy so far, which is the largest
 * kinetic energy that the positions visited allow, and does not depend on where potential energies are counted from;
 * where energy is supplied, the largest of kinetic energy, range of the potential energy, and works. */
typedef struct kt_energy_watch {
    kt_energetics energetics; /* of the model */
    int32_t has_balance;      /* whether records have works */
    int64_t records;          /* that had energies */
    double start;             /* E of the first record, J */
    double start_size;        /* the larger of its |kinetic| and |potential|, J */
    double lowest;            /* least E, J */
    double change;            /* largest |E - start|, J */
    double kinetic;           /* largest, J */
    double potential[2];      /* least and largest, J */
    double work;              /* largest of |dissipated| and |supplied|, J */
    double balance_start;     /* of the first record, J */
    double balance_change;    /* largest |balance - balance_start|, J */
    double gain;              /* largest rise of E that the mechanism cannot have made, J; 0 where it can be supplied */
    double error;             /* largest error, J */
    double excess_time;       /* s, of the record from which on it has exceeded KT_ENERGY_ERROR; NaN: none */
} kt_energy_watch;

/* Before the first record. */
KT_API kt_energy_watch kt_energy_watch_start(const kt_model *model);
/* Takes a record that has energies (KT_RECORD_ENERGY or KT_RECORD_BALANCE) into account; does nothing with one that has
 * none. O(1). */
KT_API void kt_energy_watch_add(kt_energy_watch *watch, const kt_record *record);

/* The energy scale, J; the largest error over it, 0 where nothing is known of the error. */
KT_API double kt_energy_watch_scale(const kt_energy_watch *watch);
KT_API double kt_energy_watch_error(const kt_energy_watch *watch);
/* Whether a mechanism that cannot gain energy has gained KT_ENERGY_BLOW_UP times its scale, and more than it had.
 * Within the first steps from rest, before potential energy has fallen, this may pass by itself. */
KT_API bool kt_energy_watch_is_blown_up(const kt_energy_watch *watch);

#ifdef __cplusplus
}
#endif
#endif
