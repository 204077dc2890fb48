/* Whole mechanisms, with loops and effects: the functions that a simulation calls at every stage and after every step.
 *
 * A model without loops and effects costs no more than a tree: its accelerations are those of kt_dynamics_forward, and
 * its projection only renormalises quaternions. No call allocates memory, with one exception: if OpenBLAS may use more
 * than one thread, it allocates memory when it divides the work on a group of some 90 coordinates or more among them
 * (the caller can prevent this by OPENBLAS_NUM_THREADS=1 or openblas_set_num_threads(1)). t is in s.
 *
 * Method: phi(u, t) = 0, A v = b', A a = b'' [MSD 7.4, 7.28]; A' P = [Q1 Q2][R1; 0], a = Q1 R1^-T b'' + Q2 z with
 * (Q2' M Q2) z = Q2' (tau - h - M a0) [MSD 7.33, 7.34], for each group of loops that share links, inside the
 * articulated-body recursion (constraint embedding: Jain 2009, Multibody System Dynamics 22). A group of many loops is
 * eliminated link by link, where that takes fewer operations than one dense matrix for all of it (kt_structure): its
 * cost then grows with its number of links if loops are chained, as in rows of windows, ropes and ladders.
 */
#ifndef KINETREE_MECHANISM_H
#define KINETREE_MECHANISM_H

#include "kinetree/closure.h"
#include "kinetree/dynamics.h"
#include "kinetree/loop.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Numbers of degrees of freedom and equations of a model. */
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
    kt_group_form form; /* how it is eliminated, chosen when the model was compiled */
    const char *reason; /* why, in words; static */
} kt_loop_group;

/* Return the number of groups, and the group of index `group`, counted from 0. O(1). */
KT_API int kt_loop_group_count(const kt_model *model);
KT_API kt_loop_group kt_loop_group_at(const kt_model *model, int group);

/* Computes the accelerations a (nv) at (t, q, v) by forward dynamics of the whole mechanism, with its loops and
 * effects, joint forces tau (nv, may be NULL) and external wrenches (as kt_dynamics_forward, may be NULL). Near a
 * singular position of the loops, where equations become dependent for an instant, the acceleration may be interpolated
 * from six neighbouring states, three on each side along the motion, so that the motion passes through smoothly, if
 * that is more accurate than to compute it directly, and the path does not bend between them (kt_data_crossings tells);
 * this takes up to 8 x 6 + 2 further evaluations and projections. Errors: KT_ERROR_SINGULAR, KT_ERROR_NOT_FINITE; of a
 * caller's own effects KT_ERROR_EFFECT, KT_ERROR_CALLBACK; a is then untouched. Cost: O(bodies) + O(coordinates^3) of
 * each group that is reduced by one dense matrix. */
KT_API KT_CHECKED kt_status kt_acceleration_evaluate(const kt_model *model, kt_data *data, double t, const double *q,
                                                     const double *v, const double *tau, const kt_wrench *external,
                                                     double *a, kt_error *error);

/* Whether derivatives of a model are taken by differences in part: an effect of the caller's own gives none. O(effects).
 * false without a model. */
KT_API bool kt_model_is_differenced(const kt_model *model);

/* Computes the derivatives of these accelerations with respect to positions (along q (+) e_j), velocities and joint
 * forces: nv x nv, column-major; da_dtau may be NULL. External wrenches are constant in the world frame, and t is
 * constant. work: memory of the caller of work_size >= kt_acceleration_work_size bytes, aligned to KT_ALIGNMENT, used
 * only during the call.
 *
 * The reduced equations are differentiated at the accelerations and multipliers of the motion. The tree's part is
 * analytic (kt_dynamics_inverse_derivatives), the library's effects are differentiated in closed form, and the loops'
 * equations exactly, by dual numbers (at a kink of an effect the derivatives are one-sided). Only a caller's own
 * effects that give no derivatives (effect.h) are differentiated numerically, by central differences of order eight with
 * steps of 0.002, up to 0.008, rad or m and of their rates, and shorter ones where two orders disagree by more than 1e-6:
 * their part is accurate to some 1e-9 if they are smooth on that scale, but not if they jump or have a kink within it;
 * kt_data_difference_error tells how coarse it was. A single column is the derivative along a direction that may violate the loops. If some of
 * their equations depend on others, only sums of columns along motions that the loops allow are meaningful: in other
 * directions dependent equations contradict each other, and the result depends on the choice of the independent ones.
 *
 * Errors: as kt_acceleration_evaluate; KT_ERROR_MEMORY if work is too small or not aligned; KT_ERROR_SINGULAR also at
 * singular positions of the loops, and next to them where accelerations are interpolated, or where rounding leaves the
 * derivatives uncertain by more than 1e-3 of the largest. The outputs are then untouched. Near them the error is
 * estimated by one more evaluation of the acceleration. Cost: kt_stiffness_evaluate, one
 * factorisation, two solutions a column and another for da_dtau: O(nv^2 depth); two evaluations of a loop's equations
 * for each coordinate that moves it, and the square of their number; and 16 nv evaluations of a caller's effects
 * without derivatives, at most 64 nv. With
 * loops solutions take O(bodies) each where groups are small or follow each other (rows of windows, ropes), otherwise
 * O(nv^2). For models without loops and effects, kt_dynamics_forward_derivatives is faster. */
KT_API size_t kt_acceleration_work_size(const kt_model *model);
KT_API KT_CHECKED kt_status kt_acceleration_derivatives(const kt_model *model, kt_data *data, void *work,
                                                        size_t work_size, double t, const double *q, const double *v,
                                                        const double *tau, const kt_wrench *external, double *da_dq,
                                                        double *da_dv, double *da_dtau, kt_error *error);

/* Computes the matrices of the linearised equations of motion at a state: mass matrix, stiffness matrix and damping
 * matrix, which the Newton iteration of an implicit method needs. Positions are in tangent coordinates (along
 * q (+) e_j), so with f degrees of freedom all are f x f, with quaternions too; column-major.
 *
 * Without loops f = nv, and with the accelerations a(t, q, v, tau, external)
 *     mass = M,   stiffness = -M da/dq,   damping = -M da/dv,
 * which need no solve: they are the derivatives of inverse dynamics at the known a, less those of the effects' forces.
 *
 * With loops f = kt_mobility.minimal, and the columns of the basis Z (nv x f) are orthonormal and span the null space
 * of the loops' Jacobian, A Z = 0:
 *     mass = Z' M Z (f x f),   stiffness = -mass (Z' da/dq),   damping = -mass (Z' da/dv)   (f x nv)
 * with the exact derivatives of the accelerations that the loops constrain, for displacements that the loops allow and
 * others. A Newton iteration on v' = a with the residual r (nv) and g = gamma h is then, with y = r - Z Z' r,
 *     (mass + g damping Z + g^2 stiffness Z) x = mass Z' r - g (damping + g stiffness) y,   dv = Z x + y,
 * exact along the loops; across them, where nothing is stiff, it is a fixed-point iteration. The basis may jump from
 * one call to the next: it belongs to the matrices of its own call.
 *
 * a: the accelerations of the motion there (kt_acceleration_evaluate), or NULL: they are evaluated. basis may be NULL
 * without loops, and otherwise receives the identity there. work: memory of the caller of work_size >=
 * kt_stiffness_work_size bytes, aligned to KT_ALIGNMENT, used only during the call. External wrenches are constant in
 * the world frame, and t is constant. What kt_acceleration_derivatives says of effects and of dependent equations holds
 * here, too. Errors: as kt_acceleration_derivatives; the outputs are then untouched. Cost: without loops O(nv depth)
 * besides clearing and copying the matrices, and O(L^2) for each effect with L coordinates between its ends: 2.4
 * evaluations of the accelerations for the bundled governor, 8 for a chain of 20 links, 12 for one of 40
 * (meson test plan/plan). With loops O(nv^2 depth) where solutions take O(bodies) (kt_acceleration_derivatives),
 * otherwise O(nv^3). */
KT_API size_t kt_stiffness_work_size(const kt_model *model);
KT_API KT_CHECKED kt_status kt_stiffness_evaluate(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                  double t, const double *q, const double *v, const double *tau,
                                                  const kt_wrench *external, const double *a, double *basis,
                                                  double *mass, double *stiffness, double *damping, kt_error *error);

/* ---- own states --------------------------------------------------------------------------------------------------
 *
 * States x of a mechanism besides positions and velocities (kt_state), in the order of the description: x' = f(t, q, v,
 * x). In evaluations x is an input that data hold, kt_own_states, as initial at first; what depends on x reads it there.
 * A simulation sets those of its own data in every evaluation. */

/* How many there are, 0 in most models; the name of one, the model's, NULL where there is none; the index of a name, -1
 * where there is none. O(1); of a name O(states). */
KT_API int kt_own_state_count(const kt_model *model);
KT_API const char *kt_own_state_name(const kt_model *model, int state);
KT_API int kt_own_state_find(const kt_model *model, const char *name);

/* Writes the initial own states to x (kt_own_state_count). O(states). */
KT_API void kt_own_states_initial(const kt_model *model, double *x);

/* The own states that evaluations with these data read, for the caller to set; NULL if the data are another model's.
 * They stay as they are until they are set again. O(1). */
KT_API double *kt_own_states(const kt_model *model, kt_data *data);

/* Computes x' (kt_own_state_count) at t, q, v (NULL: zeros) and the own states in the data. Errors: KT_ERROR_NOT_FINITE,
 * naming the state; rates are then untouched. O(states), and the motion of the links whose markers their formulas
 * read. */
KT_API KT_CHECKED kt_status kt_own_state_rates(const kt_model *model, kt_data *data, double t, const double *q,
                                               const double *v, double *rates, kt_error *error);

/* ---- quasi-statics -----------------------------------------------------------------------------------------------
 *
 * A joint that moves no mass, but on which springs or dampers act, has no equation of motion: the forces on it are
 * balanced at all times, r(q, v, t) = 0 [MSD 8.1]. Its velocity follows from that where a damper resists it (its position
 * is a state of first order), its position where springs alone hold it. A simulation does this in every evaluation. In a
 * state that is not balanced kt_acceleration_evaluate gives the force that is left in place of the acceleration of such a
 * joint; in one that is, that is zero, and the acceleration of the joint is not computed. */

/* How many velocity coordinates move no mass, 0 in most models; the k-th of them, -1 where there is none. O(1). */
KT_API int kt_massless_count(const kt_model *model);
KT_API int kt_massless_coordinate(const kt_model *model, int k);

/* Whether velocity coordinate v takes part in the motions that move no mass: that of such a joint does, and that of a
 * joint on it which keeps its mass where it is. Their accelerations are not computed. O(kt_massless_count). */
KT_API bool kt_massless_moves(const kt_model *model, int v);

/* Changes q and v, which are right for what has mass, along the motions that move none until the forces there are
 * balanced, under tau (nv, or NULL) and external (as kt_acceleration_evaluate). Of a model without such coordinates they
 * stay. Errors: KT_ERROR_SINGULAR where forces do not determine the coordinates; as kt_acceleration_evaluate; q and v are
 * then untouched. Cost: some ten evaluations of accelerations for one coordinate, two more for each other one. */
KT_API KT_CHECKED kt_status kt_massless_balance(const kt_model *model, kt_data *data, double t, double *q, double *v,
                                                const double *tau, const kt_wrench *external, kt_error *error);

/* ---- powers ------------------------------------------------------------------------------------------------------ */

/* Powers in a motion, W: the power that effects dissipate (>= 0), and the power that is supplied by driving effects, by
 * joint forces and external wrenches that a caller gives, and by loops that change with time. With T the kinetic and V
 * the potential energy (kt_kinetic_energy; kt_potential_energy + kt_effect_energy)
 *     d(T + V)/dt = supplied - dissipated. */
typedef struct kt_power {
    double dissipated, supplied; /* W */
} kt_power;

/* Computes the accelerations with the same bits as kt_acceleration_evaluate, and the corresponding powers. Driven loops
 * supply the power v . (M a + h - tau) of the constraint forces. Cost, in addition to that of the accelerations: the
 * powers of the effects, kinematics if there are external wrenches, and inverse dynamics if a loop changes with time.
 * Errors: as kt_acceleration_evaluate; a and *power are then untouched. */
KT_API KT_CHECKED kt_status kt_power_evaluate(const kt_model *model, kt_data *data, double t, const double *q,
                                              const double *v, const double *tau, const kt_wrench *external, double *a,
                                              kt_power *power, kt_error *error);

/* The violation of the loops by a state. */
typedef struct kt_residual {
    double position; /* the largest residual of positions, m or rad */
    double velocity; /* of velocities, m/s or rad/s */
} kt_residual;

/* Computes the residuals at (t, q, v), which are zero without loops. Errors: KT_ERROR_NOT_FINITE. O(bodies +
 * equations). */
KT_API KT_CHECKED kt_status kt_loop_residual(const kt_model *model, kt_data *data, double t, const double *q,
                                             const double *v, kt_residual *residual, kt_error *error);

/* What an impact does to the kinetic energy, J: it changes by supplied - dissipated. */
typedef struct kt_impact {
    double dissipated; /* d'M d / 2 of the change d of the velocities: 0 or more */
    double supplied;   /* by loops that move: those that are driven */
} kt_impact;

/* A plastic impact: v (nv) becomes the velocity onto which the impulses of the loops bring it, the one that fits them and is
 * nearest in the mass metric. q stays, and the loops should be closed there. Serves after loops have been switched on
 * (kt_loop_enable). *impact may be NULL. Errors: KT_ERROR_CONSTRAINT (the loops contradict each other),
 * KT_ERROR_SINGULAR (no inertia along what the loops leave), KT_ERROR_NOT_FINITE; v is then untouched. Cost: of a
 * projection. Not in a small library (-Dsmall=enabled). */
KT_API KT_CHECKED kt_status kt_velocity_impact(const kt_model *model, kt_data *data, double t, const double *q,
                                               double *v, kt_impact *impact, kt_error *error);

/* Moves q by the least step, and then v, until all loops are closed to rounding, and renormalises quaternions [MSD 7.55
 * to 7.58]. *changed (may be NULL) tells whether any number changed. q and v are untouched on failure. At most
 * KT_POSITION_STEPS_MAX and KT_VELOCITY_STEPS_MAX steps are taken; if loops are still open, the call fails, and at most
 * 400 further steps find the gaps that the message reports. Errors: KT_ERROR_CONSTRAINT if loops do not close, naming
 * them and the remaining gaps; KT_ERROR_NOT_FINITE. */
KT_API KT_CHECKED kt_status kt_state_project(const kt_model *model, kt_data *data, double t, double *q, double *v,
                                             bool *changed, kt_error *error);

/* Closes the loops of a state that may be far from closed [MSD 8.5]: first the positions and then the velocities are
 * changed by the least amount. Given coordinates of held joints (the description's `hold`) do not change; if a held
 * joint has no given position, none of its positions changes. If the description gives no velocity, those of held
 * joints are taken as given, though kt_initial_changes does not report them. In each group of loops the coordinates
 * that the description does not give (kt_joint_given) move first: given ones move only if their group cannot be closed
 * otherwise, and then all coordinates of the group move except the held ones. kt_initial_changes reports which given
 * initial values have changed. q and v are untouched on failure. The call is meant for set-up: it may take 400 steps
 * from each of 5 starts to close the loops, twice if some values are given and others are not, and as many at each of
 * up to 12 trials of each of at most KT_ASSEMBLY_STEPS_MAX steps to the nearest state. If these steps do not reach it,
 * the state is closed, but another one may be nearer, and kt_data_iterations reports this (capped). Errors:
 * KT_ERROR_CONSTRAINT names the loops that stay open and by how much, or the equations that contradict each other. */
KT_API KT_CHECKED kt_status kt_state_assemble(const kt_model *model, kt_data *data, double t, double *q, double *v,
                                              kt_error *error);

/* Writes the positions (nq) at which the last kt_state_assemble with these data ended with KT_ERROR_CONSTRAINT;
 * kt_loop_equations gives the residual of each equation there. O(nq). */
KT_API void kt_assembly_reached(const kt_model *model, const kt_data *data, double *q);

/* Computes the equations at (t, q, v) as matrices: jacobian is equations x nv, column-major; rate = b' and drift = b'',
 * one for each equation, in the order of the loops. Any output may be NULL. Velocities are needed for drift. Errors:
 * KT_ERROR_NOT_FINITE, also if an equation overflows: outputs are then untouched. O(bodies + equations nv). */
KT_API KT_CHECKED kt_status kt_loop_equations(const kt_model *model, kt_data *data, double t, const double *q,
                                              const double *v, double *jacobian, double *residual, double *rate,
                                              double *drift, kt_error *error);

/* Computes the reactions at (t, q, v) under tau and external: in joints (one wrench for each body, as
 * kt_joint_reactions) and in loops (one for each loop: on the second end, about the first end's point, world axes; for
 * a prescribed motion the torque or force along the joint's axis that drives its joint; for a coupling zeros, since it
 * acts along its joints: kt_multiplier_evaluate gives its joint forces). Either may be NULL. Redundant loops can share
 * a reaction in many ways; kt_multiplier_evaluate says which one is computed. Errors: as kt_acceleration_evaluate.
 * Cost: an evaluation of accelerations, and kinematics. */
KT_API KT_CHECKED kt_status kt_reaction_evaluate(const kt_model *model, kt_data *data, double t, const double *q,
                                                 const double *v, const double *tau, const kt_wrench *external,
                                                 kt_wrench *joints, kt_wrench *loops, kt_error *error);

/* Computes the multipliers lambda of the loops' equations at (t, q, v) under tau and external: one for each equation,
 * in the order of kt_loop_equations (kt_loop_rows_of), so that with its jacobian A and the generalised forces Q of
 * kt_effect_forces
 *     M a + h = tau + J' external + Q + A' lambda,          a = kt_acceleration_evaluate.
 * Units: N where the equation's residual is in m (or m/s), N m where it is in rad. Of a coupling, coefficient times
 * lambda is the generalised force on each of its joints; of a motion, lambda drives its joint.
 *
 * If equations depend on others, only the sum A' lambda is determined, and the reduction decides how the loops
 * concerned share it: with `qr` and `partition` dependent equations carry nothing (of two equal stops one bears the
 * whole load), with `svd` lambda is the least solution (each bears half). Near a singular position a multiplier may
 * grow like the reciprocal of the size of the direction that is lost. Errors: as kt_acceleration_evaluate;
 * KT_ERROR_NOT_FINITE names the loop whose multiplier overflows. Cost: an evaluation of accelerations, and with planar
 * loops another one by the spatial recursion. */
KT_API KT_CHECKED kt_status kt_multiplier_evaluate(const kt_model *model, kt_data *data, double t, const double *q,
                                                   const double *v, const double *tau, const kt_wrench *external,
                                                   double *multipliers, kt_error *error);

/* Computes a basis N of the velocities that the loops leave free at (t, q), A N = 0: nv x columns, column-major.
 * columns is nv less the rank at this position: kt_mobility.minimal, and more at a singular one. basis has room for
 * nv x nv. Coordinates in no loop have columns of their own, the last ones; the columns of a group are orthonormal
 * (`qr`, `svd`), or unit vectors in the independent coordinates (`partition`). Errors: KT_ERROR_NOT_FINITE. Cost:
 * O(nv^2) + O(coordinates^3) of each group that is reduced by one dense matrix, O(links) a column of the others. */
KT_API KT_CHECKED kt_status kt_loop_nullspace(const kt_model *model, kt_data *data, double t, const double *q,
                                              double *basis, int *columns, kt_error *error);

/* Computes the generalised forces Q (nv) of all effects at (t, q, v): their joint forces, and J' times their wrenches
 * on bodies. Errors: KT_ERROR_NOT_FINITE, KT_ERROR_EFFECT, KT_ERROR_CALLBACK. O(bodies + effects). */
KT_API KT_CHECKED kt_status kt_effect_forces(const kt_model *model, kt_data *data, double t, const double *q,
                                             const double *v, double *forces, kt_error *error);

/* Returns the potential energy of the effects at (t, q, v), J; NaN if a caller's own effect does not report its energy.
 * The potential energy of gravity is kt_potential_energy. O(bodies + effects). */
KT_API double kt_effect_energy(const kt_model *model, kt_data *data, double t, const double *q, const double *v);

/* What one effect exerts. Ends are those of its description: of a contact the sphere, then the plane. */
typedef struct kt_effect_load {
    int end_count;       /* 0: it acts in a joint */
    kt_vec3 point[2];    /* of its ends, or of its loop's, world, m */
    kt_wrench wrench[2]; /* on the bodies of its ends, about these points, world axes */
    double joint_force; /* in its joint or along its loop's coordinate, N m, or N of a length; 0 of another with ends */
} kt_effect_load;

/* Computes what an effect exerts at (t, q, v), of which data hold the kinematics (kt_kinematics_update, a record, a
 * sensor reading): the force of a contact or a spring, the torque of a motor. effect is its index in the description. A
 * contact's force acts at the sphere's lowest point, so its wrench about the centre has a moment, too. Positions are
 * those in the world: far from its origin a wrench loses digits that kt_acceleration_evaluate keeps. Allocates nothing.
 * Errors: KT_ERROR_NOT_FINITE, KT_ERROR_EFFECT, KT_ERROR_CALLBACK, which name the effect; KT_ERROR_ARGUMENT for an
 * effect that there is not, and for one with ends if the data hold the kinematics of another q or v; *load is then
 * untouched. O(nq + log effects). */
KT_API KT_CHECKED kt_status kt_effect_evaluate(const kt_model *model, const kt_data *data, double t, const double *q,
                                               const double *v, int effect, kt_effect_load *load, kt_error *error);

/* The effects of a model, in the description's order: their number; the index of the one with this name, -1 if there is
 * none; of one its name ("" if it has none), its type (KT_EFFECT_TYPE_COUNT if there is no such effect), the body whose
 * joint it acts in, or on which its end k is (-1: none). O(log effects), finding by name O(effects). */
KT_API int kt_effect_count(const kt_model *model);
KT_API int kt_effect_find(const kt_model *model, const char *name);
KT_API const char *kt_effect_name(const kt_model *model, int effect);
KT_API kt_effect_type kt_effect_type_of(const kt_model *model, int effect);
KT_API int kt_effect_body(const kt_model *model, int effect, int end);

/* Of an effect in a coordinate: the loop in whose relative coordinate it acts, its index in the description (-1: in a
 * joint, or it has ends), and in *component, which may be NULL, which of the loop's coordinates; and the value of the
 * coordinate at q, of which data hold the kinematics, rad or m (NaN: it has ends, or there is no such effect). O(log
 * effects + depth). */
KT_API int kt_effect_loop(const kt_model *model, int effect, int *component);
KT_API double kt_effect_coordinate(const kt_model *model, const kt_data *data, const double *q, int effect);

/* What can be recorded of an effect: the number of its quantities, and one of them (KT_QUANTITY_COUNT: there is none).
 * These are those of its type (kt_descriptor.quantities); of a caller's own effect those of its joint, its wrench, or
 * its line. Whether what it measures is a length, as of effects with ends and in sliding joints, not an angle: that
 * decides names and units (kt_quantity_name). O(log effects). */
KT_API int kt_effect_quantity_count(const kt_model *model, int effect);
KT_API kt_effect_quantity kt_effect_quantity_at(const kt_model *model, int effect, int k);
KT_API bool kt_effect_is_sliding(const kt_model *model, int effect);

/* Computes all quantities of all effects at (t, q, v), effect by effect in the description's order: as many numbers as
 * kt_effect_quantity_count sums up to. NaN where a callback cannot compute its force. Arguments and precision are those
 * of kt_effect_evaluate. Errors: KT_ERROR_ARGUMENT, KT_ERROR_NOT_FINITE for q or v; values are then untouched.
 * O(nq + effects log effects). */
KT_API KT_CHECKED kt_status kt_effect_quantities_evaluate(const kt_model *model, const kt_data *data, double t,
                                                          const double *q, const double *v, double *values,
                                                          kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
