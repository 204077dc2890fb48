/* Mechanisms as a whole: loops reduced, effects acting. What a simulation calls at every stage and after every step.
 *
 * A model without loops and effects pays for neither: its accelerations are those of kt_dynamics_forward, its
 * projection renormalises quaternions where there are some. No call allocates, but for OpenBLAS where it may use more
 * than one thread: sharing a group of some 90 coordinates or more among them it allocates what that takes
 * (OPENBLAS_NUM_THREADS=1 or openblas_set_num_threads(1), which are the caller's to set, prevent it). t is in s.
 *
 * Method: phi(u, t) = 0, A v = b', A a = b'' [MSD 7.4, 7.28]; A' P = [Q1 Q2][R1; 0], a = Q1 R1^-T b'' + Q2 z with
 * (Q2' M Q2) z = Q2' (tau - h - M a0) [MSD 7.33, 7.34], for each group of loops that share links, inside the
 * articulated-body recursion (constraint embedding: Jain 2009, Multibody System Dynamics 22).
 */
#ifndef KINETREE_REDUCTION_H
#define KINETREE_REDUCTION_H

#include "kinetree/dynamics.h"
#include "kinetree/loop.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Freedoms of a model. */
typedef struct kt_mobility {
    int tree;      /* of the tree: nv */
    int equations; /* of all loops */
    int rank;      /* independent ones among them, at generic positions */
    int minimal;   /* what is left: tree - rank */
} kt_mobility;

/* Freedoms of a model, found when it was compiled. O(1). */
KT_API kt_mobility kt_model_mobility(const kt_model *model);

/* A group of loops that share moving links; each is reduced by itself. */
typedef struct kt_loop_group {
    int loop_count;   /* of its loops */
    const int *loops; /* their indices, in the model's memory */
    int coordinates;  /* of the tree, that it ties */
    int equations;    /* of its loops */
    int rank;         /* independent ones among them, at generic positions */
} kt_loop_group;

/* How many groups there are; one of them. */
KT_API int kt_loop_group_count(const kt_model *model);
KT_API kt_loop_group kt_loop_group_at(const kt_model *model, int group);

/* Accelerations a (nv) at (t, q, v): forward dynamics of the whole mechanism, with its loops and effects, joint forces
 * tau (nv, may be NULL) and external wrenches (as kt_dynamics_forward, may be NULL). Near a singular position of the
 * loops, where equations depend on each other for an instant, the acceleration is interpolated from six neighbouring
 * states, three on each side along the motion, so that the motion goes on smoothly; this takes up to 5 x 6 further
 * evaluations and projections. Errors: KT_ERROR_SINGULAR, KT_ERROR_NOT_FINITE; of a caller's own effects
 * KT_ERROR_EFFECT, KT_ERROR_CALLBACK. Cost: O(bodies) + O(coordinates^3) of each group. */
KT_API KT_CHECKED kt_status kt_acceleration_evaluate(const kt_model *model, kt_data *data, double t, const double *q,
                                                     const double *v, const double *tau, const kt_wrench *external,
                                                     double *a, kt_error *error);

/* Derivatives of these accelerations with respect to positions (along q (+) e_j), velocities and joint forces: nv x nv,
 * column-major; da_dtau may be NULL. External wrenches stay as they are in the world, t stays. work: memory of the
 * caller's, work_size >= kt_acceleration_work_size bytes at KT_ALIGNMENT, for the call alone.
 *
 * Of the reduced equations, at the accelerations and multipliers of the motion. The tree's part is analytic
 * (kt_dynamics_inverse_derivatives); loops' equations and the library's effects are differentiated as they are
 * evaluated, exactly, whatever their type (the slopes are those of this side where an effect has a kink). A caller's
 * own effects, and these alone, are differenced (central, order eight, steps of 0.002 rad or m and of their rates up to
 * 0.008): to some 1e-9 of their part where they are smooth on that scale, not where they jump or have a kink within it.
 * A single column leads off the loops; where some of their equations depend on others, only sums of columns along
 * motions that the loops allow have a meaning, since off them dependent equations contradict each other, and
 * independent ones are chosen.
 *
 * Errors: as kt_acceleration_evaluate; KT_ERROR_MEMORY where work is too small or not aligned; KT_ERROR_SINGULAR at and
 * next to singular positions of the loops, too. Outputs are untouched then. O(nv^3), a loop's equations
 * and an effect's force twice for each coordinate that moves them, and 16 nv evaluations of a caller's effects. Where
 * there are neither loops nor effects, kt_dynamics_forward_derivatives is faster. */
KT_API size_t kt_acceleration_work_size(const kt_model *model);
KT_API KT_CHECKED kt_status kt_acceleration_derivatives(const kt_model *model, kt_data *data, void *work,
                                                        size_t work_size, double t, const double *q, const double *v,
                                                        const double *tau, const kt_wrench *external, double *da_dq,
                                                        double *da_dv, double *da_dtau, kt_error *error);

/* Powers in a motion, W: what effects turn into heat (>= 0), and what comes from outside: of effects that drive, of
 * joint forces and external wrenches that a caller gives, and of loops that change with time. With T the kinetic and V
 * the potential energy (kt_kinetic_energy; kt_potential_energy + kt_effect_energy)
 *     d(T + V)/dt = supplied - dissipated. */
typedef struct kt_power {
    double dissipated, supplied; /* W */
} kt_power;

/* kt_acceleration_evaluate, with the same bits in a, and the powers that go with it. What a driven loop supplies is the
 * power v . (M a + h - tau) of all that holds the loops closed. Costs besides what the effects' powers cost: kinematics
 * where there are external wrenches, inverse dynamics where a loop changes with time. Errors: as there; a and *power
 * are then untouched. */
KT_API KT_CHECKED kt_status kt_power_evaluate(const kt_model *model, kt_data *data, double t, const double *q,
                                              const double *v, const double *tau, const kt_wrench *external, double *a,
                                              kt_power *power, kt_error *error);

/* How much a state violates the loops. */
typedef struct kt_residual {
    double position; /* the largest residual of positions, m or rad */
    double velocity; /* of velocities, m/s or rad/s */
} kt_residual;

/* The residuals at (t, q, v); zero without loops. Errors: KT_ERROR_NOT_FINITE. O(bodies + equations). */
KT_API KT_CHECKED kt_status kt_loop_residual(const kt_model *model, kt_data *data, double t, const double *q,
                                             const double *v, kt_residual *residual, kt_error *error);

/* The caps of iterations; kt_data_iterations tells how near to them it has come, and whether one was hit. An evaluation
 * of accelerations iterates nowhere but near a singular position: there it takes at most 5 times 6 states beside, each
 * closed in at most 6 steps. (Reductions by SVD iterate within LAPACK, which has caps of its own.) */
enum {
    KT_POSITION_STEPS_MAX = 30, /* of a projection; one or two do after a usual step */
    KT_VELOCITY_STEPS_MAX = 6,  /* of a projection, in two goes; one does */
    KT_ASSEMBLY_STEPS_MAX = 200 /* of an assembly, along the manifold to the nearest state */
};

/* Moves q by the least step, and then v, until all loops are closed to rounding, and renormalises quaternions [MSD 7.55
 * to 7.58]. *changed (may be NULL) tells whether any number changed. q and v are untouched on failure. At most
 * KT_POSITION_STEPS_MAX and KT_VELOCITY_STEPS_MAX steps; what they leave open is an error, for whose words (which
 * loops, and by how much) at most 400 steps more are taken. Errors: KT_ERROR_CONSTRAINT where loops do not close, which
 * names them and the gap left; KT_ERROR_NOT_FINITE. */
KT_API KT_CHECKED kt_status kt_state_project(const kt_model *model, kt_data *data, double t, double *q, double *v,
                                             bool *changed, kt_error *error);

/* Closes the loops of a state that may be far from closed [MSD 8.5]: positions, then velocities, move least, those of
 * held joints (the description's `hold`) not at all, as far as they are given (of a joint without any given position all
 * of its positions; where the description gives no velocity, all velocities of held joints). In each group of loops those that the description does not give
 * (kt_joint_given) move first: what is given moves only where its group cannot be closed without, and then all of the
 * group moves, but for what is held. kt_initial_changes tells what of the initial state has moved. q and v are
 * untouched on failure. For set-up: it may take 400 steps from each of 5 starts to close the loops, twice where some
 * values are given and others not, and as many at each of up to 12 tries of each of at most
 * KT_ASSEMBLY_STEPS_MAX steps to the nearest state. Where these do not get there, the state is closed, but another may
 * be nearer, and kt_data_iterations says so (capped). Errors: KT_ERROR_CONSTRAINT names the loops that stay open and by
 * how much, or the equations that contradict each other. */
KT_API KT_CHECKED kt_status kt_state_assemble(const kt_model *model, kt_data *data, double t, double *q, double *v,
                                              kt_error *error);

/* The positions (nq) at which the last kt_state_assemble with these data, whose error was KT_ERROR_CONSTRAINT, gave up:
 * where kt_loop_equations tells how far each equation is open. O(nq). */
KT_API void kt_assembly_reached(const kt_model *model, const kt_data *data, double *q);

/* A given initial value that an assembly has moved. */
typedef struct kt_initial_change {
    int body;        /* whose joint it is */
    unsigned part;   /* of its state: one of the KT_GIVEN_ bits */
    double change;   /* of the coordinate of that part that moved most: rad, m, rad/s or m/s; of a quaternion the angle,
                        rad */
    double relative; /* to a radian, or the way around the longest loop; of velocities to the mechanism's fastest */
} kt_initial_change;

/* Changes that are relatively smaller are not told. */
#define KT_INITIAL_CHANGE_LEAST 1e-6

/* What of the initial state that the description gives is not so in the state q (nq), v (nv) that was assembled of
 * kt_model_initial, by more than KT_INITIAL_CHANGE_LEAST: one entry a part of a joint, in the order of bodies,
 * positions before velocities. Returns how many there are and fills the first `most` of them (changes may be NULL where
 * most is 0). The positions and velocities of a simulation that has just been created are such a state. Allocates
 * nothing. O(bodies). */
KT_API int kt_initial_changes(const kt_model *model, const double *q, const double *v, kt_initial_change *changes,
                              int most);

/* The equations at (t, q, v) as matrices: jacobian is equations x nv, column-major; rate = b' and drift = b'', one for
 * each equation, in the order of the loops. Any output may be NULL. Velocities are needed for drift. Errors:
 * KT_ERROR_NOT_FINITE. O(bodies + equations nv). */
KT_API KT_CHECKED kt_status kt_loop_equations(const kt_model *model, kt_data *data, double t, const double *q,
                                              const double *v, double *jacobian, double *residual, double *rate,
                                              double *drift, kt_error *error);

/* Reactions at (t, q, v) under tau and external: in joints (one wrench a body, as kt_joint_reactions) and in loops (one
 * a loop: on the second end, at the first end's point, world axes; of a motion, what drives its joint: the torque, or
 * where it slides the force, along the joint's axis; of a coupling zeros: it acts along its joints, and
 * kt_multiplier_evaluate tells by how much).
 * Either may be NULL. Redundant loops could share a reaction in many ways, of which kt_multiplier_evaluate says which
 * it is. Errors: as kt_acceleration_evaluate. Cost: an evaluation of accelerations, and kinematics. */
KT_API KT_CHECKED kt_status kt_reaction_evaluate(const kt_model *model, kt_data *data, double t, const double *q,
                                                 const double *v, const double *tau, const kt_wrench *external,
                                                 kt_wrench *joints, kt_wrench *loops, kt_error *error);

/* Multipliers lambda of the loops' equations at (t, q, v) under tau and external: one for each equation, in the order
 * of kt_loop_equations (kt_loop_rows_of), so that with its jacobian A and the generalised forces Q of kt_effect_forces
 *     M a + h = tau + J' external + Q + A' lambda,          a = kt_acceleration_evaluate.
 * Units: N where the equation's residual is in m (or m/s), N m where it is in rad. Of a coupling, coefficient times
 * lambda is the generalised force on each of its joints; of a motion, lambda drives its joint.
 *
 * Where equations depend on others, only the sum A' lambda is determined, and reactions of the loops concerned are as
 * the reduction shares them out: by `qr` and `partition` the equations that repeat others carry none (of two equal
 * stops one bears all), by `svd` lambda is the least one (each bears half). Next to a singular position a multiplier
 * may be as large as the direction that is lost is short. Errors: as kt_acceleration_evaluate; KT_ERROR_NOT_FINITE
 * names the loop whose multiplier overflows. Cost: an evaluation of accelerations, and of planar loops one in space. */
KT_API KT_CHECKED kt_status kt_multiplier_evaluate(const kt_model *model, kt_data *data, double t, const double *q,
                                                   const double *v, const double *tau, const kt_wrench *external,
                                                   double *multipliers, kt_error *error);

/* A basis N of the velocities that the loops leave free at (t, q), A N = 0: nv x columns, column-major, with columns =
 * nv
 * - rank at this position: kt_mobility.minimal, and more at a singular one. basis has room for nv x nv. Coordinates in
 * no loop are columns of their own, the last ones; those of a group are orthonormal (`qr`, `svd`), or unit vectors in
 * the independent coordinates (`partition`). Errors: KT_ERROR_NOT_FINITE. O(nv^2) + O(coordinates^3) of each group. */
KT_API KT_CHECKED kt_status kt_loop_nullspace(const kt_model *model, kt_data *data, double t, const double *q,
                                              double *basis, int *columns, kt_error *error);

/* Generalised forces Q (nv) of all effects at (t, q, v): those of joints, and J' of the wrenches on bodies. Errors:
 * KT_ERROR_NOT_FINITE, KT_ERROR_EFFECT, KT_ERROR_CALLBACK. O(bodies + effects). */
KT_API KT_CHECKED kt_status kt_effect_forces(const kt_model *model, kt_data *data, double t, const double *q,
                                             const double *v, double *forces, kt_error *error);

/* Potential energy of the effects at (t, q, v), J; NaN where a caller's own cannot tell it. Gravity's is
 * kt_potential_energy. O(bodies + effects). */
KT_API double kt_effect_energy(const kt_model *model, kt_data *data, double t, const double *q, const double *v);

#ifdef __cplusplus
}
#endif
#endif
