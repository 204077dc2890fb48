/* The recursions over the tree: kinematics, inverse and forward dynamics, mass matrix, energy, momentum, reactions.
 *
 * q has kt_model_nq numbers, v, a and tau have kt_model_nv. External wrenches are an array over all bodies, world
 * included (kt_model_body_count entries; entry 0 is ignored), or NULL: moment about the body frame's origin and force,
 * both in world axes. Matrices are column-major. Every call is O(number of bodies) unless it says otherwise, allocates
 * nothing, and leaves its outputs unchanged when it fails. Quaternions may have any norm but zero.
 *
 * Errors of every call that returns a status: KT_ERROR_NOT_FINITE naming the joint or body whose input is not finite,
 * or if all are finite, the first joint whose result overflows; KT_ERROR_ARGUMENT naming a joint whose quaternion is
 * zero.
 *
 * Sources: Featherstone, Rigid Body Dynamics Algorithms (2008), chapters 5 to 7, for the recursions; [MSD 7.11].
 */
#ifndef KINETREE_DYNAMICS_H
#define KINETREE_DYNAMICS_H

#include "kinetree/joint.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Forward dynamics by the articulated-body algorithm: a = M^-1 (tau + J' external - h). v and tau may be NULL (zero).
 * Gravity is included. a may be tau. KT_ERROR_SINGULAR names the joint along which there is no inertia at this
 * position. */
KT_API KT_CHECKED kt_status kt_dynamics_forward(const kt_model *model, kt_data *data, const double *q, const double *v,
                                                const double *tau, const kt_wrench *external, double *a,
                                                kt_error *error);

/* Inverse dynamics by the recursive Newton-Euler algorithm: tau = M a + h - J' external. a may be NULL (zero), which
 * gives the bias force h; v may be NULL (zero), which with a = NULL gives the gravity force. tau may be a. */
KT_API KT_CHECKED kt_status kt_dynamics_inverse(const kt_model *model, kt_data *data, const double *q, const double *v,
                                                const double *a, const kt_wrench *external, double *tau,
                                                kt_error *error);

/* Mass matrix by the composite-rigid-body algorithm: mass is nv x nv, column-major, both triangles.
 * O(nv depth) operations besides clearing the matrix. */
KT_API KT_CHECKED kt_status kt_dynamics_mass(const kt_model *model, kt_data *data, const double *q, double *mass,
                                             kt_error *error);

/* Its lower triangle alone: the rest of `mass` holds no results. Some eighth less time. */
KT_API KT_CHECKED kt_status kt_dynamics_mass_lower(const kt_model *model, kt_data *data, const double *q, double *mass,
                                                   kt_error *error);

/* Where masses are functions of time (kt_variable_mass), calls that have a time, such as kt_acceleration_evaluate, take
 * those of that time. Calls that have none, all of this header, take those of the last such call with the same data, or
 * of this one; at first those at t = 0. Errors: KT_ERROR_MODEL, naming the body whose mass is not above 0 at t; the time is
 * then as before. Does nothing where masses are constant. O(bodies of variable mass). */
KT_API KT_CHECKED kt_status kt_masses_update(const kt_model *model, kt_data *data, double t, kt_error *error);

/* ---- factors of the mass matrix ---------------------------------------------------------------------------------- */

/* M = L'DL: D diagonal, L unit lower triangular when coordinates have the order of the tree, parents first. Where M is
 * zero because neither of two joints carries the other, L is zero, so the factors take less room than M, and less time
 * than a Cholesky factorisation where the tree branches: with d the mean number of coordinates between one and the
 * root, O(nv d^2) operations for the factors, O(nv d) for all else, and 8 nv d bytes.
 * Source: Featherstone, Rigid Body Dynamics Algorithms (2008), 6.5.
 *
 * kt_dynamics_forward solves M a = f in O(nv), without M: these calls serve where M is there anyway, or a product, a
 * half of the factors, or many right-hand sides are asked for. One thread may use a kt_mass_factor at a time. */
typedef struct kt_mass_factor kt_mass_factor;

/* Bytes that the factors of a model's mass matrix take. */
KT_API size_t kt_mass_factor_size(const kt_model *model);

/* Initialises factors in the caller's memory, which must stay there while they are used. Refuses memory that is too
 * small or misaligned (KT_ALIGNMENT) with KT_ERROR_MEMORY. O(nv). */
KT_API KT_CHECKED kt_status kt_mass_factor_init(const kt_model *model, void *memory, size_t size,
                                                kt_mass_factor **factor, kt_error *error);

/* The same in memory of its own, released with kt_mass_factor_free. */
KT_API KT_CHECKED kt_status kt_mass_factor_create(const kt_model *model, kt_mass_factor **factor, kt_error *error);
/* Releases what _create made; does nothing with factors in the caller's memory, nor with NULL. */
KT_API void kt_mass_factor_free(kt_mass_factor *factor);

/* Computes the factors of a mass matrix, of which the lower triangle is read (kt_dynamics_mass or
 * kt_dynamics_mass_lower). KT_ERROR_SINGULAR names the joint at which M is not positive definite; there are no factors
 * then. */
KT_API KT_CHECKED kt_status kt_mass_factor_compute(kt_mass_factor *factor, const double *mass, kt_error *error);

/* x becomes M^-1 x, or M x: nv x columns, column-major. KT_ERROR_ARGUMENT if there are no factors, or fewer columns than
 * 0; KT_ERROR_NOT_FINITE if a number is not finite or exceeds 1e150; x is then unchanged. */
KT_API KT_CHECKED kt_status kt_mass_factor_solve(kt_mass_factor *factor, int columns, double *x, kt_error *error);
KT_API KT_CHECKED kt_status kt_mass_factor_multiply(kt_mass_factor *factor, int columns, double *x, kt_error *error);

/* x becomes L^-1 x, or L'^-1 x, with the same shapes and error. With U = L'^-1 X, X' M^-1 X = U' D^-1 U. */
KT_API KT_CHECKED kt_status kt_mass_factor_solve_lower(kt_mass_factor *factor, int columns, double *x, kt_error *error);
KT_API KT_CHECKED kt_status kt_mass_factor_solve_upper(kt_mass_factor *factor, int columns, double *x, kt_error *error);

/* D: nv numbers, in the order of the velocities. */
KT_API void kt_mass_factor_diagonal(const kt_mass_factor *factor, double *d);

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

/* How inverse and forward dynamics change with positions, velocities and forces: nv x nv matrices, column-major. Column
 * j of d/dq is the change along q (+) e_j, the joints' exponential map (kt_position_add), with velocities,
 * accelerations or forces constant. External wrenches are constant in world axes, about the moving origin of the body
 * frame. Analytic, by recursion, exact to rounding errors; no differences are taken.
 *
 * work: memory of work_size >= kt_derivative_work_size bytes at KT_ALIGNMENT, the caller's, needed for the call alone:
 * some 24 nv^2 + 3000 nv bytes. KT_ERROR_MEMORY if it is too small or not aligned; the other errors are those of the
 * functions whose derivatives are taken. On failure outputs are unchanged.
 *
 * Sources: Carpentier, Mansard, Analytical derivatives of rigid body dynamics algorithms (RSS 2018); Singh, Russell,
 * Wensing, IEEE Robotics and Automation Letters 7(2), 2022. */
KT_API size_t kt_derivative_work_size(const kt_model *model);

/* Of tau (q, v, a): dtau_dq, dtau_dv; dtau/da is kt_dynamics_mass. v, a and external may be NULL, as for
 * kt_dynamics_inverse. O(nv depth) operations besides clearing and copying the matrices. */
KT_API KT_CHECKED kt_status kt_dynamics_inverse_derivatives(const kt_model *model, kt_data *data, void *work,
                                                            size_t work_size, const double *q, const double *v,
                                                            const double *a, const kt_wrench *external, double *dtau_dq,
                                                            double *dtau_dv, kt_error *error);

/* Of a (q, v, tau): da_dq, da_dv; and da_dtau = M^-1, which may be NULL. v, tau and external may be
 * NULL, as for kt_dynamics_forward. O(nv^2), by articulated bodies, without the mass matrix. */
KT_API KT_CHECKED kt_status kt_dynamics_forward_derivatives(const kt_model *model, kt_data *data, void *work,
                                                            size_t work_size, const double *q, const double *v,
                                                            const double *tau, const kt_wrench *external, double *da_dq,
                                                            double *da_dv, double *da_dtau, kt_error *error);

/* ---- kinematics -------------------------------------------------------------------------------------------------- */

/* Poses, twists and accelerations of all bodies at (q, v, a), stored in data for the queries and totals below. Only the
 * next successful kt_kinematics_update with this data changes them: whatever is computed in between, at whatever state,
 * queries answer for the state given here. (In a simulation's own data its records and sensors
 * update them.) v may be NULL (zero), a may be NULL (zero). Accelerations are those of the motion: gravity is not in
 * them. All queries and totals are NaN until the first update, and after kt_loop_enable or kt_effect_enable. */
KT_API KT_CHECKED kt_status kt_kinematics_update(const kt_model *model, kt_data *data, const double *q, const double *v,
                                                 const double *a, kt_error *error);

/* The body frame in the world. O(1), as are all queries here but the Jacobian. */
KT_API kt_pose kt_body_pose(const kt_model *model, const kt_data *data, int body);
/* Angular velocity and velocity of the body frame's origin, world axes. */
KT_API kt_twist kt_body_twist(const kt_model *model, const kt_data *data, int body);
/* Angular acceleration and (classical) acceleration of the body frame's origin, world axes. */
KT_API kt_twist kt_body_acceleration(const kt_model *model, const kt_data *data, int body);

/* A point given in the body frame: its position, velocity and acceleration in the world. */
KT_API kt_vec3 kt_point_position(const kt_model *model, const kt_data *data, int body, kt_vec3 at);
KT_API kt_vec3 kt_point_velocity(const kt_model *model, const kt_data *data, int body, kt_vec3 at);
KT_API kt_vec3 kt_point_acceleration(const kt_model *model, const kt_data *data, int body, kt_vec3 at);

/* The Jacobian of a frame at a point given in the body frame: 6 x nv, column-major; rows 0 to 2 the angular velocity,
 * rows 3 to 5 the point's velocity, world axes. Needs kt_kinematics_update at q. O(nv + depth). */
KT_API void kt_point_jacobian(const kt_model *model, const kt_data *data, int body, kt_vec3 at, double *jacobian);

/* ---- totals (all need kt_kinematics_update with q and v) --------------------------------------------------------- */

/* Of all bodies, and of the rotors of joints with armature, J. */
KT_API double kt_kinetic_energy(const kt_model *model, const kt_data *data);
/* Of gravity, J: -M g . c with M and c of kt_mass_center: zero with the centre of mass at the world's origin. Bodies
 * that are fixed to the world do not count, in either of these, nor in the absolute formulation. */
KT_API double kt_potential_energy(const kt_model *model, const kt_data *data);
/* Linear momentum (force) and angular momentum about the world's origin (moment), world axes;
 * rotors have none. */
KT_API kt_wrench kt_momentum(const kt_model *model, const kt_data *data);
/* Total mass of the moving bodies and their centre of mass, world frame; the centre is zero if there is no mass. */
KT_API double kt_mass_center(const kt_model *model, const kt_data *data, kt_vec3 *center);

/* Reactions in all tree joints: wrenches has one entry a body (entry 0 is set to zero), what the parent exerts on the
 * body across its joint: moment about the origin of the joint frame (the one on the parent) and force, world axes,
 * applied and constraint parts together. Needs kt_kinematics_update with the accelerations of the motion; external as
 * for forward dynamics. */
KT_API void kt_joint_reactions(const kt_model *model, kt_data *data, const kt_wrench *external, kt_wrench *wrenches);

#ifdef __cplusplus
}
#endif
#endif
