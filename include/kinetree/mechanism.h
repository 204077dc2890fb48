/* Whole mechanisms, with loops and effects: the functions that a simulation calls at every stage and after every step.
 *
 * A model without loops and effects costs no more than a tree: its accelerations are those of kt_dynamics_forward, and
 * its projection only renormalises quaternions. No call allocates memory, with one exception. OpenBLAS with several
 * threads allocates memory when it divides the work on a group of about 90 or more coordinates. The caller can prevent
 * this with OPENBLAS_NUM_THREADS=1 or openblas_set_num_threads(1).
 *
 * Units: the time t is in s.
 *
 * Method. The loops are phi(u, t) = 0. Velocities and accelerations satisfy A v = b' and A a = b'' [MSD 7.4, 7.28].
 * Each group of loops that share links is reduced with a QR decomposition [MSD 7.33, 7.34]:
 *
 *     A' P = [Q1 Q2][R1; 0],   a = Q1 R1^-T b'' + Q2 z
 *     (Q2' M Q2) z = Q2' (tau - h - M a0),   a0 = Q1 R1^-T b''
 *
 * The reduction takes place inside the articulated-body recursion (constraint embedding: Jain 2009, Multibody System
 * Dynamics 22). A group of many loops is eliminated link by link if this takes less time than one dense matrix
 * (kt_structure). If loops are chained, as in rows of windows, ropes and ladders, the cost then grows with the number
 * of links.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_MECHANISM_H
#define KINETREE_MECHANISM_H

#include "kinetree/closure.h"
#include "kinetree/dynamics.h"
#include "kinetree/loop.h"
#include "kinetree/quantity.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The numbers of degrees of freedom and of equations of a model. */
typedef struct kt_mobility {
    int tree;      /* of the tree: nv */
    int equations; /* of all loops */
    int rank;      /* independent ones among them, at generic positions */
    int minimal;   /* degrees of freedom that remain: tree - rank */
} kt_mobility;

/* Returns the mobility of a model, which was determined when it was compiled. O(1) for each group of loops. */
KT_API kt_mobility kt_model_mobility(const kt_model *model);

/* A group of loops that share moving links; each group is reduced separately. */
typedef struct kt_loop_group {
    int loop_count;     /* number of its loops */
    const int *loops;   /* their indices, in the model's memory */
    int coordinates;    /* number of tree coordinates that its loops constrain */
    int equations;      /* number of equations of its loops */
    int rank;           /* independent ones among them, at generic positions */
    kt_group_form form; /* form of elimination, chosen when the model was compiled */
    const char *reason; /* reason of the choice, as text; static */
} kt_loop_group;

/* Return the number of groups, and the group of index `group`, counted from 0. O(1). */
KT_API int kt_loop_group_count(const kt_model *model);
KT_API kt_loop_group kt_loop_group_at(const kt_model *model, int group);

/* Computes the accelerations a (nv) at (t, q, v) by forward dynamics of the whole mechanism, with its loops and
 * effects. Joint forces tau (nv) and external wrenches (as for kt_dynamics_forward) may be NULL.
 *
 * Near a singular position of the loops, equations become dependent for an instant. The acceleration at such a state
 * may be interpolated from six neighbouring states, three on each side along the motion. The motion then passes
 * smoothly through the position. The interpolation is used if it is more accurate than direct computation, and if the
 * path does not bend between the states. The function kt_data_crossings reports these cases. An interpolation takes up
 * to 50 further evaluations and projections.
 *
 * The model's set decides which contacts are closed (kt_switch_set). If an open hard contact, stop or slack rope
 * touches and does not part, the result would leave its reaction out. The call rejects such a state. The call also
 * rejects friction that sticks if the model contains the friction as slipping in the other direction, and a contact
 * that begins to slip. Only the simulation has the direction of its friction (kt_simulation_acceleration).
 * kt_simulation_model has the set of a simulation. Data that a simulation passes to callbacks are exempt, as a
 * simulation follows its contacts. The same holds for all calls that evaluate accelerations, reactions, powers,
 * actuation and derivatives, in all headers.
 * Errors: KT_ERROR_SINGULAR, KT_ERROR_NOT_FINITE; for effects of the caller KT_ERROR_EFFECT, KT_ERROR_CALLBACK.
 * KT_ERROR_UNSUPPORTED for such a contact. The output a is untouched on failure.
 * Cost: O(bodies) + O(coordinates^3) of each group that is reduced by one dense matrix. */
KT_API KT_CHECKED kt_status kt_acceleration_evaluate(const kt_model *model, kt_data *data, double t, const double *q,
                                                     const double *v, const double *tau, const kt_wrench *external,
                                                     double *a, kt_error *error);

/* Returns whether derivatives of a model are partly differences: of a caller's effects, and of loads of friction.
 * Returns false without a model.
 * Cost: O(effects). */
KT_API bool kt_model_is_differenced(const kt_model *model);

/* Computes the derivatives of these accelerations with respect to positions (along q (+) e_j), velocities and joint
 * forces. External wrenches are constant in the world frame, and t is constant.
 * Shape: nv x nv, column-major; da_dtau may be NULL.
 * Ownership: work is memory of the caller with work_size >= kt_acceleration_work_size bytes, aligned to KT_ALIGNMENT.
 * This memory is used only during the call.
 *
 * The reduced equations are differentiated at the accelerations and multipliers of the motion. The part of the tree is
 * analytic (kt_dynamics_inverse_derivatives). The library's effects are differentiated in closed form; at a kink of an
 * effect the derivatives are one-sided. The equations of loops are differentiated exactly with dual numbers.
 *
 * Only effects of the caller that give no derivatives (effect.h) are differentiated numerically, by central differences
 * of order eight. The steps are 0.002, and at most 0.008, in rad or m and in the units of their rates. The steps are
 * shorter if two orders disagree by more than 1e-6. This part is accurate to about 1e-9 if the effects are smooth over
 * a step, and inaccurate if effects jump or have a kink within a step. The function kt_data_difference_error reports
 * the error.
 *
 * A single column is the derivative along a direction that may violate the loops. If some of their equations depend on
 * others, only sums of columns along admissible motions are meaningful. In other directions dependent equations
 * contradict each other, and the result depends on the choice of the independent equations.
 * Errors: as kt_acceleration_evaluate. KT_ERROR_MEMORY if work is too small or not aligned. KT_ERROR_SINGULAR also at
 * singular positions of the loops, and near such positions if accelerations are interpolated. The same error occurs if
 * rounding leaves the derivatives uncertain by more than 1e-3 of the largest. One more evaluation of the acceleration
 * near such positions estimates this error. The outputs are untouched on failure.
 * Cost: kt_stiffness_evaluate, one factorisation, two solutions per column and another one for da_dtau: O(nv^2 depth).
 * A loop needs two evaluations of its equations for each coordinate that moves it, and the square of their number.
 * Effects of the caller without derivatives need 16 nv evaluations, at most 64 nv. With loops each solution takes
 * O(bodies) if groups are small or chained (rows of windows, ropes), otherwise O(nv^2). For models without loops and
 * effects, kt_dynamics_forward_derivatives is faster. */
KT_API size_t kt_acceleration_work_size(const kt_model *model);
KT_API KT_CHECKED kt_status kt_acceleration_derivatives(const kt_model *model, kt_data *data, void *work,
                                                        size_t work_size, double t, const double *q, const double *v,
                                                        const double *tau, const kt_wrench *external, double *da_dq,
                                                        double *da_dv, double *da_dtau, kt_error *error);

/* Computes the matrices of the linearised equations of motion at a state: mass matrix, stiffness matrix and damping
 * matrix. The Newton iteration of an implicit method needs these matrices. Positions are in tangent coordinates (along
 * q (+) e_j).
 * Shape: f x f for f degrees of freedom, also with quaternions; column-major.
 *
 * Without loops f = nv, and with the accelerations a(t, q, v, tau, external)
 *     mass = M,   stiffness = -M da/dq,   damping = -M da/dv
 * These matrices need no solve. The matrices are derivatives of inverse dynamics at the given a, minus the derivatives
 * of the effects' forces.
 *
 * With loops f = kt_mobility.minimal, and the columns of the basis Z (nv x f) are orthonormal and span the null space
 * of the loops' Jacobian, A Z = 0:
 *     mass = Z' M Z (f x f),   stiffness = -mass (Z' da/dq),   damping = -mass (Z' da/dv)   (f x nv)
 * with the exact derivatives of the accelerations that the loops constrain. The matrices hold for displacements that
 * the loops allow and for other displacements. A Newton iteration on v' = a with the residual r (nv) and g = gamma h is
 * then, with y = r - Z Z' r,
 *     (mass + g damping Z + g^2 stiffness Z) x = mass Z' r - g (damping + g stiffness) y,   dv = Z x + y
 * This iteration is exact along the loops. Across the loops, without stiffness, it is a fixed-point iteration. The
 * basis may jump from one call to the next; it belongs to the matrices of its own call.
 *
 * The input a holds the accelerations of the motion at this state (kt_acceleration_evaluate); if NULL, the call
 * evaluates these accelerations. Without loops basis may be NULL, or receives the identity. External wrenches are
 * constant in the world frame, and t is constant. The remarks of kt_acceleration_derivatives about effects and
 * dependent equations apply.
 * Ownership: work is memory of the caller with work_size >= kt_stiffness_work_size bytes, aligned to KT_ALIGNMENT. This
 * memory is used only during the call.
 * Errors: as kt_acceleration_derivatives; the outputs are untouched on failure.
 * Cost: without loops O(nv depth), besides clearing and copying the matrices, and O(L^2) for each effect with L
 * coordinates between its ends. Examples in evaluations of the accelerations (meson test plan/plan): 2.4 for the
 * bundled governor. A chain of 20 links takes 8. A chain of 40 links takes 12. With loops O(nv^2 depth) where solutions
 * take O(bodies) (kt_acceleration_derivatives), otherwise O(nv^3). */
KT_API size_t kt_stiffness_work_size(const kt_model *model);
KT_API KT_CHECKED kt_status kt_stiffness_evaluate(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                  double t, const double *q, const double *v, const double *tau,
                                                  const kt_wrench *external, const double *a, double *basis,
                                                  double *mass, double *stiffness, double *damping, kt_error *error);

/* ---- auxiliary states
 * --------------------------------------------------------------------------------------------------
 *
 * Auxiliary states x of a mechanism are states besides positions and velocities (kt_auxiliary_state), in the order of
 * the
 * description: x' = f(t, q, v, x). An evaluation reads x as an input from the data (kt_auxiliary_states). Initially the
 * data hold the initial values of the model. A simulation sets the states in its own data in every evaluation. */

/* Return the number of auxiliary states (0 in most models), the name of a state, and the index of a name. The model
 * owns the name, which is NULL if there is no such state. The index is -1 if there is no such name.
 * Cost: O(1); O(states) for the search by name. */
KT_API int kt_auxiliary_state_count(const kt_model *model);
KT_API const char *kt_auxiliary_state_name(const kt_model *model, int state);
KT_API int kt_auxiliary_state_find(const kt_model *model, const char *name);

/* Writes the initial auxiliary states to x (kt_auxiliary_state_count numbers).
 * Cost: O(states). */
KT_API void kt_auxiliary_states_initial(const kt_model *model, double *x);

/* Returns the auxiliary states that evaluations with these data read, for the caller to set; NULL if the data belong to
 * another model. The values do not change until the caller sets them again.
 * Cost: O(1). */
KT_API double *kt_auxiliary_states(const kt_model *model, kt_data *data);

/* Computes x' (kt_auxiliary_state_count numbers) at t, q, v (NULL: zeros) and the auxiliary states in the data.
 * Errors: KT_ERROR_NOT_FINITE, naming the state. The output rates is untouched on failure.
 * Cost: O(states), and the motion of the links with markers in the formulas. */
KT_API KT_CHECKED kt_status kt_auxiliary_state_rates(const kt_model *model, kt_data *data, double t, const double *q,
                                                     const double *v, double *rates, kt_error *error);

/* ---- quasi-statics -----------------------------------------------------------------------------------------------
 *
 * A joint that moves no mass, but on which springs or dampers act, has no equation of motion. The forces on such a
 * joint are balanced at all times, r(q, v, t) = 0 [MSD 8.1]. If a damper acts on the joint, this balance determines the
 * velocity, and the position is a state of first order. If only springs act on the joint, the balance determines the
 * position. A simulation solves the balance in every evaluation. In an unbalanced state kt_acceleration_evaluate
 * returns the residual force in place of the acceleration of such a joint. In a balanced state this residual is zero,
 * and the acceleration of the joint is not computed. */

/* Return the number of velocity coordinates that move no mass (0 in most models), and the k-th of these coordinates (-1
 * if there is none).
 * Cost: O(1). */
KT_API int kt_massless_count(const kt_model *model);
KT_API int kt_massless_coordinate(const kt_model *model, int k);

/* Returns whether velocity coordinate v takes part in the motions that move no mass. The coordinate of a joint without
 * mass takes part, and so does a joint on it whose motion lets the mass stay at rest. The accelerations of these
 * coordinates are not computed.
 * Cost: O(kt_massless_count). */
KT_API bool kt_massless_moves(const kt_model *model, int v);

/* Changes q and v along the motions that move no mass, until the forces along these motions are balanced. The inputs q
 * and v must be correct for all bodies with mass. Joint forces are tau (nv, or NULL) and external (as for
 * kt_acceleration_evaluate). For a model without such coordinates q and v are unchanged.
 * Errors: KT_ERROR_SINGULAR if forces do not determine the coordinates; as kt_acceleration_evaluate. Then q and v are
 * untouched.
 * Cost: about ten evaluations of accelerations for one coordinate, and two for each further coordinate. */
KT_API KT_CHECKED kt_status kt_massless_balance(const kt_model *model, kt_data *data, double t, double *q, double *v,
                                                const double *tau, const kt_wrench *external, kt_error *error);

/* ---- powers ------------------------------------------------------------------------------------------------------ */

/* Powers in a motion. The dissipated power is >= 0 and comes from effects. The supplied power comes from driving
 * effects, from joint forces and external wrenches of the caller, and from loops that change with time. With T the
 * kinetic and V the potential energy (kt_kinetic_energy; kt_potential_energy + kt_effect_energy)
 *
 *     d(T + V)/dt = supplied - dissipated.
 */
typedef struct kt_power {
    double dissipated, supplied; /* W */
} kt_power;

/* Computes the accelerations with the same bits as kt_acceleration_evaluate, and the corresponding powers. Driven loops
 * supply the power v . (M a + h - tau) of the constraint forces.
 * Cost: that of the accelerations, and the powers of the effects. External wrenches also need kinematics, and loops
 * that change with time need inverse dynamics.
 * Errors: as kt_acceleration_evaluate; a and *power are then untouched. */
KT_API KT_CHECKED kt_status kt_power_evaluate(const kt_model *model, kt_data *data, double t, const double *q,
                                              const double *v, const double *tau, const kt_wrench *external, double *a,
                                              kt_power *power, kt_error *error);

/* The violation of the loops by a state. */
typedef struct kt_residual {
    double position; /* the largest residual of positions, m or rad */
    double velocity; /* the largest residual of velocities, m/s or rad/s */
} kt_residual;

/* Computes the residuals at (t, q, v), which are zero without loops.
 * Errors: KT_ERROR_NOT_FINITE.
 * Cost: O(bodies + equations). */
KT_API KT_CHECKED kt_status kt_loop_residual(const kt_model *model, kt_data *data, double t, const double *q,
                                             const double *v, kt_residual *residual, kt_error *error);

/* The effect of an impact on the kinetic energy, J. The kinetic energy changes by supplied - dissipated. */
typedef struct kt_impact {
    double dissipated; /* d'M d / 2 of the change d of the velocities: 0 or more */
    double supplied;   /* energy from driven loops, which move */
} kt_impact;

/* Applies a plastic impact: v (nv) becomes the velocity that satisfies the loops and is nearest to v in the mass
 * metric. The impulses of the loops cause this change. The positions q are unchanged, at which the loops should be
 * closed. The call is meant for states after loops have been switched on (kt_loop_set_on). The output *impact may be
 * NULL.
 * Errors: KT_ERROR_CONSTRAINT (the loops contradict each other), KT_ERROR_SINGULAR (no inertia along free directions of
 * the loops), KT_ERROR_NOT_FINITE. Then v is untouched.
 * Cost: that of a projection. */
KT_API KT_CHECKED kt_status kt_velocity_impact(const kt_model *model, kt_data *data, double t, const double *q,
                                               double *v, kt_impact *impact, kt_error *error);

/* Moves q by the smallest step, and then v, until all loops are closed to rounding, and normalises quaternions [MSD
 * 7.55 to 7.58]. The flag *changed (may be NULL) reports whether any number changed. At most KT_POSITION_STEPS_MAX and
 * KT_VELOCITY_STEPS_MAX steps are taken. If loops are still open, the call fails. At most 400 further steps then find
 * the gaps that the message reports.
 * Errors: KT_ERROR_CONSTRAINT if loops do not close; the message names the loops and the remaining gaps;
 * KT_ERROR_NOT_FINITE. Then q and v are untouched. */
KT_API KT_CHECKED kt_status kt_state_project(const kt_model *model, kt_data *data, double t, double *q, double *v,
                                             bool *changed, kt_error *error);

/* Closes the loops of a state that may be far from closed [MSD 8.5]: first the positions and then the velocities change
 * by the smallest amount. The call is meant for set-up.
 *
 * Given coordinates of held joints (the description's `hold`) do not change. If a held joint has no given position,
 * none of its positions changes. If the description gives no velocity, the velocities of held joints count as given,
 * but kt_initial_changes does not report them. In each group of loops the coordinates that the description does not
 * give (kt_joint_given) move first. Given coordinates move only if their group cannot be closed otherwise. Given
 * values of the group then change by the smallest amount, since coordinates that are not given move 30 times as easily.
 * All move alike if a group has fronts, or if the smallest amount leads to a singular position, such as a stretched
 * chain. The function kt_initial_changes reports which given initial values have changed, and kt_initial_choices which
 * velocities are neither given nor determined.
 *
 * If the steps do not reach the nearest state, the state is closed, but another closed state may be nearer. The counter
 * kt_data_iterations reports this (capped).
 * Errors: KT_ERROR_CONSTRAINT names the loops that remain open with their gaps, or the equations that contradict each
 * other. Then q and v are untouched.
 * Cost: up to 400 steps from each of 5 starts to close the loops, and twice as many if only some values are given. The
 * search for the nearest state takes at most KT_ASSEMBLY_STEPS_MAX steps with up to 12 trials each. Each trial may take
 * the same number of closing steps again. */
KT_API KT_CHECKED kt_status kt_state_assemble(const kt_model *model, kt_data *data, double t, double *q, double *v,
                                              kt_error *error);

/* Writes the positions (nq) at which the last kt_state_assemble with these data ended with KT_ERROR_CONSTRAINT.
 * kt_loop_equations at these positions returns the residual of each equation.
 * Cost: O(nq). */
KT_API void kt_assembly_reached(const kt_model *model, const kt_data *data, double *q);

/* Computes the equations of the loops at (t, q, v) as matrices. The entries rate = b' and drift = b'' follow the order
 * of the loops, one for each equation. Any output may be NULL.
 * Shape: jacobian is equations x nv, column-major. Velocities are needed for drift.
 * Errors: KT_ERROR_NOT_FINITE, also if an equation overflows. Outputs are untouched on failure.
 * Cost: O(bodies + equations nv). */
KT_API KT_CHECKED kt_status kt_loop_equations(const kt_model *model, kt_data *data, double t, const double *q,
                                              const double *v, double *jacobian, double *residual, double *rate,
                                              double *drift, kt_error *error);

/* Computes the reactions at (t, q, v) under tau and external, in joints and in loops. The output `joints` receives one
 * wrench for each body, as kt_joint_reactions. The output `loops` receives one wrench for each loop. The wrench acts on
 * the second end (in rolling: on the surface), about the first end's point. For a prescribed motion, the wrench is the
 * torque or force along the joint's axis that drives the joint. For a coupling the wrench is zero, since a coupling
 * acts along its joints and loads no bearing; kt_multiplier_evaluate gives its joint forces. Either output may be NULL.
 *
 * Redundant loops can share a reaction in many ways. Then the sum of |F|^2 + |M|^2 / L^2 is least, over the loops and
 * the joints on their paths, in each group (kt_loop_group_at). L is the length of the longest loop of the group, once
 * around. The call kt_reaction_shares names the components that are not unique. Contacts, stops, friction that sticks,
 * and wheels in gears and belts do not take part in the sum.
 * Frame: world axes.
 * Errors: as kt_acceleration_evaluate.
 * Cost: an evaluation of accelerations, and kinematics. */
KT_API KT_CHECKED kt_status kt_reaction_evaluate(const kt_model *model, kt_data *data, double t, const double *q,
                                                 const double *v, const double *tau, const kt_wrench *external,
                                                 kt_wrench *joints, kt_wrench *loops, kt_error *error);

/* How a reaction is shared among redundant loops. */
typedef struct kt_reaction_share {
    unsigned open;     /* bits of the components that the balance of forces does not determine: 1 fx, 2 fy, 4 fz, 8 mx,
                          16 my, 32 mz, 64 the multiplier of a coupling or motion */
    double length;     /* L in kt_reaction_evaluate, m; 0: all is determined */
    bool is_too_large; /* of a loop: its group has too many redundant equations for the least sum to be found */
} kt_reaction_share;

/* Writes which components of the reactions are not unique at (t, q), because loops repeat each other. Stops, contacts
 * and friction that sticks are left out, since they have laws of their own.
 * Shape: joints has one entry for each body, loops one for each loop.
 * Errors: KT_ERROR_ARGUMENT, KT_ERROR_NOT_FINITE (q).
 * Cost: kinematics; for each redundant group O(equations coordinates^2 + joints redundant^2). */
KT_API KT_CHECKED kt_status kt_reaction_shares(const kt_model *model, kt_data *data, double t, const double *q,
                                               kt_reaction_share *joints, kt_reaction_share *loops, kt_error *error);

/* Computes the multipliers lambda of the loops' equations at (t, q, v) under tau and external. There is one multiplier
 * for each equation, in the order of kt_loop_equations (kt_loop_rows_of). With its jacobian A and the generalised
 * forces Q of kt_effect_forces
 *     M a + h = tau + J' external + Q + A' lambda,          a = kt_acceleration_evaluate.
 * Units: N for an equation with a residual in m (or m/s), N m for a residual in rad. For a coupling, coefficient times
 * lambda is the generalised force on each of its joints. For a motion, lambda drives the joint.
 *
 * If equations depend on others, only the sum A' lambda is determined. The multipliers are then those of the reactions
 * of kt_reaction_evaluate, whose sum of squares is least: each of two equal motors carries half of the load. Stops,
 * contacts and friction that sticks do not take part: among them the reduction decides. With `qr` and `partition`,
 * dependent equations carry nothing; with `svd`, multipliers are least. Near a singular position a
 * multiplier may grow like the reciprocal of the size of the direction that is lost.
 * Errors: as kt_acceleration_evaluate. KT_ERROR_NOT_FINITE names the loop whose multiplier overflows.
 * Cost: an evaluation of accelerations, and with planar loops a second evaluation by the spatial recursion. */
KT_API KT_CHECKED kt_status kt_multiplier_evaluate(const kt_model *model, kt_data *data, double t, const double *q,
                                                   const double *v, const double *tau, const kt_wrench *external,
                                                   double *multipliers, kt_error *error);

/* Computes a basis N of the velocities that the loops leave free at (t, q), A N = 0. The number *columns is nv minus
 * the rank at this position: kt_mobility.minimal, and more at a singular position. Each coordinate that belongs to no
 * loop has its own column, among the last columns. The columns of a group are orthonormal (`qr`, `svd`), or unit
 * vectors in the independent coordinates (`partition`).
 * Shape: nv x columns, column-major; basis has room for nv x nv.
 * Errors: KT_ERROR_NOT_FINITE.
 * Cost: O(nv^2), O(coordinates^3) for each group that is reduced by one dense matrix, and O(links) per column of the
 * other groups. */
KT_API KT_CHECKED kt_status kt_loop_nullspace(const kt_model *model, kt_data *data, double t, const double *q,
                                              double *basis, int *columns, kt_error *error);

/* Computes the generalised forces Q (nv) of all effects at (t, q, v): their joint forces, and J' times their wrenches
 * on bodies. Friction that is proportional to reactions is that of the last accelerations, of this q and v.
 * Errors: KT_ERROR_ARGUMENT if the data do not hold these; KT_ERROR_NOT_FINITE, KT_ERROR_EFFECT, KT_ERROR_CALLBACK.
 * Cost: O(bodies + effects). */
KT_API KT_CHECKED kt_status kt_effect_forces(const kt_model *model, kt_data *data, double t, const double *q,
                                             const double *v, double *forces, kt_error *error);

/* Returns the potential energy of the effects at (t, q, v), J; NaN if a caller's own effect does not report its energy.
 * The potential energy of gravity is kt_potential_energy.
 * Cost: O(bodies + effects). */
KT_API double kt_effect_energy(const kt_model *model, kt_data *data, double t, const double *q, const double *v);

/* The load that one effect exerts. The ends have the order of the description. For a contact, the first end is the
 * sphere, the second the plane. */
typedef struct kt_effect_load {
    int end_count;       /* 0: it acts in a joint */
    kt_vec3 point[2];    /* points of its ends, or of the ends of its loop, world, m */
    kt_wrench wrench[2]; /* wrenches on the bodies of its ends, about these points, world axes */
    double joint_force;  /* force in its joint or along its loop's coordinate: N m, or N for a length; 0 for other
                         * effects with ends */
} kt_effect_load;

/* Computes the load of an effect at (t, q, v): the force of a contact or a spring, the torque of a motor. The data must
 * hold the kinematics of this state (kt_kinematics_update, a record, a sensor reading). The argument effect is the
 * index in the description. The force of a contact acts at the sphere's lowest point, so that its wrench about the
 * centre also has a moment. Positions are relative to the world's origin. Therefore, far from this origin, a wrench
 * loses digits that kt_acceleration_evaluate does not lose. The call allocates nothing.
 * Errors: KT_ERROR_NOT_FINITE, KT_ERROR_EFFECT, KT_ERROR_CALLBACK, which name the effect. KT_ERROR_UNSUPPORTED if a
 * loop carries the force of the effect, since the effect is hard and closed, or sticks (kt_reaction_evaluate).
 * KT_ERROR_ARGUMENT if there is no such effect, or if it has ends and the data hold the kinematics of another q or v.
 * The output *load is untouched on failure.
 * Cost: O(nq + log effects). */
KT_API KT_CHECKED kt_status kt_effect_evaluate(const kt_model *model, const kt_data *data, double t, const double *q,
                                               const double *v, int effect, kt_effect_load *load, kt_error *error);

/* Return properties of the effects of a model, in the description's order:
 *   - their number;
 *   - the index of the effect with this name, -1 if there is none;
 *   - the name of an effect, "" if it has none;
 *   - its type, KT_EFFECT_TYPE_COUNT if there is no such effect;
 *   - the body in whose joint the effect acts, or the body that carries end k; -1: none.
 * Cost: O(log effects); the search by name is O(effects). */
KT_API int kt_effect_count(const kt_model *model);
KT_API int kt_effect_find(const kt_model *model, const char *name);
KT_API const char *kt_effect_name(const kt_model *model, int effect);
KT_API kt_effect_type kt_effect_type_of(const kt_model *model, int effect);
KT_API int kt_effect_body(const kt_model *model, int effect, int end);

/* Return the relative coordinate of an effect. The function kt_effect_loop returns the loop in whose relative
 * coordinate the effect acts, as an index in the description. kt_effect_loop returns -1 if the effect acts in a joint
 * or has ends. The output *component, which may be NULL, receives the coordinate of the loop. The function
 * kt_effect_coordinate returns the value of the coordinate at q, of which the data hold the kinematics. It returns NaN
 * if the effect has ends, or if there is no such effect.
 * Units: rad or m.
 * Cost: O(log effects + depth). */
KT_API int kt_effect_loop(const kt_model *model, int effect, int *component);
KT_API double kt_effect_coordinate(const kt_model *model, const kt_data *data, const double *q, int effect);

/* Return the quantities of an effect that can be recorded: their number, and the k-th quantity (KT_QUANTITY_COUNT if k
 * is out of range). These are the quantities of the effect's type (kt_descriptor.quantities). An effect of the caller
 * has the quantities of its joint, its wrench, or its line. The function kt_effect_is_sliding returns true if the
 * effect measures a length, as in sliding joints and between two ends. For an angle, the function returns false. This
 * decides names and units (kt_quantity_name).
 * Cost: O(log effects). */
KT_API int kt_effect_quantity_count(const kt_model *model, int effect);
KT_API kt_effect_quantity kt_effect_quantity_at(const kt_model *model, int effect, int k);
KT_API bool kt_effect_is_sliding(const kt_model *model, int effect);

/* Computes all quantities of all effects at (t, q, v), effect by effect in the description's order. The number of
 * values is the sum of kt_effect_quantity_count over all effects. A value is NaN if a callback cannot compute its
 * force. While a loop carries the force, as in a closed hard contact or stop and in sticking friction, force and power
 * are NaN, because the force is a reaction (kt_reaction_evaluate, kt_multiplier_evaluate). Arguments and precision are
 * those of kt_effect_evaluate.
 * Errors: KT_ERROR_ARGUMENT, KT_ERROR_NOT_FINITE for q or v. The output values is untouched on failure.
 * Cost: O(nq + effects log effects). */
KT_API KT_CHECKED kt_status kt_effect_quantities_evaluate(const kt_model *model, const kt_data *data, double t,
                                                          const double *q, const double *v, double *values,
                                                          kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
