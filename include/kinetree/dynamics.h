/* The recursions over the tree: kinematics, inverse and forward dynamics, mass matrix, energy, momentum, reactions.
 *
 * Sizes: q has kt_model_nq numbers; v, a and tau have kt_model_nv. Matrices are column-major. Quaternions may have any
 * norm but zero.
 *
 * External wrenches are an array over all bodies, world included, or NULL. The array has kt_model_body_count entries,
 * and entry 0 is ignored. A wrench is a moment about the body frame's origin and a force, both in world axes.
 *
 * Every call allocates nothing and leaves its outputs unchanged when it fails. Unless its docstring gives another cost,
 * a call takes O(number of bodies).
 *
 * Errors of every call that returns a status: KT_ERROR_NOT_FINITE names the joint or body whose input is not finite. If
 * all inputs are finite, the message names the first joint whose result overflows. KT_ERROR_ARGUMENT names a joint
 * whose quaternion is zero.
 *
 * Sources: Featherstone, Rigid Body Dynamics Algorithms (2008), chapters 5 to 7, for the recursions.
 * See also [MSD 7.11].
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_DYNAMICS_H
#define KINETREE_DYNAMICS_H

#include "kinetree/joint.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Computes forward dynamics with the articulated-body algorithm: a = M^-1 (tau + J' external - h). v and tau may be
 * NULL (zero). Gravity is included. a may be tau.
 * Errors: KT_ERROR_SINGULAR names the joint along which there is no inertia at this position. */
KT_API KT_CHECKED kt_status kt_dynamics_forward(const kt_model *model, kt_data *data, const double *q, const double *v,
                                                const double *tau, const kt_wrench *external, double *a,
                                                kt_error *error);

/* Computes inverse dynamics with the recursive Newton-Euler algorithm: tau = M a + h - J' external. If a is NULL
 * (zero), the result is the bias force h. If v is NULL (zero) as well, the result is the gravity force. tau may be a.
 */
KT_API KT_CHECKED kt_status kt_dynamics_inverse(const kt_model *model, kt_data *data, const double *q, const double *v,
                                                const double *a, const kt_wrench *external, double *tau,
                                                kt_error *error);

/* Computes the mass matrix with the composite-rigid-body algorithm: mass is nv x nv, column-major, both triangles. O(nv
 * depth) operations besides clearing the matrix. */
KT_API KT_CHECKED kt_status kt_dynamics_mass(const kt_model *model, kt_data *data, const double *q, double *mass,
                                             kt_error *error);

/* Computes the lower triangle of the mass matrix alone: the rest of `mass` holds no results. Takes some eighth less
 * time. */
KT_API KT_CHECKED kt_status kt_dynamics_mass_lower(const kt_model *model, kt_data *data, const double *q, double *mass,
                                                   kt_error *error);

/* Sets the time of masses that are functions of time (kt_variable_mass). Calls with a time argument, such as
 * kt_acceleration_evaluate, use the masses of that time. Calls without a time argument, all of this header, use the
 * time of the last such call with these data, or of this call. At first that time is t = 0. Does nothing if masses are
 * constant.
 *
 * Errors: KT_ERROR_SINGULAR, naming the body whose mass is not above 0 at t; the time is then unchanged.
 * Cost: O(bodies of variable mass). */
KT_API KT_CHECKED kt_status kt_masses_update(const kt_model *model, kt_data *data, double t, kt_error *error);

/* ---- factors of the mass matrix ---------------------------------------------------------------------------------- */

/* Factors of the mass matrix, M = L'DL. D is diagonal, and L is unit lower triangular in the coordinates' order of the
 * tree, parents first. If neither of two joints carries the other, their entries in M and in L are zero. If the tree
 * branches, the factors therefore need less memory than M, and less time than a Cholesky factorisation. With d the mean
 * number of coordinates between one and the root, the factors take O(nv d^2) operations, all else O(nv d). The memory
 * is 8 nv d bytes.
 * Source: Featherstone, Rigid Body Dynamics Algorithms (2008), 6.5.
 *
 * kt_dynamics_forward solves M a = f in O(nv), without M. Use these factors if M is available anyway, for products, for
 * one half of the factors, or for many right-hand sides. One thread may use a kt_mass_factor at a time. */
typedef struct kt_mass_factor kt_mass_factor;

/* Returns the bytes that the factors of a model's mass matrix take. */
KT_API size_t kt_mass_factor_size(const kt_model *model);

/* Initialises factors in the caller's memory, which must stay valid while they are used.
 * Errors: KT_ERROR_MEMORY if the memory is too small or misaligned (KT_ALIGNMENT).
 * Cost: O(nv). */
KT_API KT_CHECKED kt_status kt_mass_factor_init(const kt_model *model, void *memory, size_t size,
                                                kt_mass_factor **factor, kt_error *error);

/* Creates factors in memory of their own, released with kt_mass_factor_free. */
KT_API KT_CHECKED kt_status kt_mass_factor_create(const kt_model *model, kt_mass_factor **factor, kt_error *error);
/* Releases factors of kt_mass_factor_create. Does nothing with factors in the caller's memory, nor with NULL. */
KT_API void kt_mass_factor_free(kt_mass_factor *factor);

/* Computes the factors of a mass matrix (kt_dynamics_mass or kt_dynamics_mass_lower). Reads its lower triangle only.
 * Errors: KT_ERROR_SINGULAR names the joint at which M is not positive definite; there are no factors then. */
KT_API KT_CHECKED kt_status kt_mass_factor_compute(kt_mass_factor *factor, const double *mass, kt_error *error);

/* Replaces x by M^-1 x, or by M x: nv x columns, column-major.
 * Errors: KT_ERROR_ARGUMENT if there are no factors, or fewer columns than 0; KT_ERROR_NOT_FINITE if a number is not
 * finite or exceeds 1e150. x is then unchanged. */
KT_API KT_CHECKED kt_status kt_mass_factor_solve(kt_mass_factor *factor, int columns, double *x, kt_error *error);
KT_API KT_CHECKED kt_status kt_mass_factor_multiply(kt_mass_factor *factor, int columns, double *x, kt_error *error);

/* Replaces x by L^-1 x, or by L'^-1 x, with the same shapes and errors. With U = L'^-1 X,
 *
 *     X' M^-1 X = U' D^-1 U. */
KT_API KT_CHECKED kt_status kt_mass_factor_solve_lower(kt_mass_factor *factor, int columns, double *x, kt_error *error);
KT_API KT_CHECKED kt_status kt_mass_factor_solve_upper(kt_mass_factor *factor, int columns, double *x, kt_error *error);

/* Writes D: nv numbers, in the order of the velocities. */
KT_API void kt_mass_factor_diagonal(const kt_mass_factor *factor, double *d);

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

/* Derivatives of inverse and forward dynamics with respect to positions, velocities and forces. The matrices are nv x
 * nv, column-major. Column j of d/dq is the derivative along q (+) e_j, the joints' exponential map (kt_position_add).
 * Velocities, accelerations or forces are constant. External wrenches are constant in world axes, about the moving
 * origin of the body frame. The derivatives are analytic, by recursion, exact to rounding errors, without finite
 * differences.
 *
 * work: the caller's memory of work_size >= kt_dynamics_work_size bytes at KT_ALIGNMENT, used during the call only.
 * The size is some 24 nv (nv + 125) bytes.
 *
 * Errors: KT_ERROR_MEMORY if work is too small or not aligned. Other errors are those of kt_dynamics_inverse and
 * kt_dynamics_forward. On failure outputs are unchanged.
 *
 * Sources:
 *   Carpentier, Mansard, Analytical derivatives of rigid body dynamics algorithms (RSS 2018).
 *   Singh, Russell, Wensing, IEEE Robotics and Automation Letters 7(2), 2022. */
KT_API size_t kt_dynamics_work_size(const kt_model *model);

/* Computes the derivatives of tau (q, v, a): dtau_dq and dtau_dv. The derivative dtau/da is kt_dynamics_mass. v, a and
 * external may be NULL, as for kt_dynamics_inverse. O(nv depth) operations besides clearing and copying the matrices.
 */
KT_API KT_CHECKED kt_status kt_dynamics_inverse_derivatives(const kt_model *model, kt_data *data, void *work,
                                                            size_t work_size, const double *q, const double *v,
                                                            const double *a, const kt_wrench *external, double *dtau_dq,
                                                            double *dtau_dv, kt_error *error);

/* Computes the derivatives of a (q, v, tau): da_dq, da_dv; and da_dtau = M^-1, which may be NULL. v, tau and external
 * may be NULL, as for kt_dynamics_forward. O(nv^2), by articulated bodies, without the mass matrix. */
KT_API KT_CHECKED kt_status kt_dynamics_forward_derivatives(const kt_model *model, kt_data *data, void *work,
                                                            size_t work_size, const double *q, const double *v,
                                                            const double *tau, const kt_wrench *external, double *da_dq,
                                                            double *da_dv, double *da_dtau, kt_error *error);

/* ---- kinematics -------------------------------------------------------------------------------------------------- */

/* Computes poses, twists and accelerations of all bodies at (q, v, a), and stores them in data for the queries and
 * totals below. Only the next successful kt_kinematics_update with these data changes the stored values. Queries return
 * values at the state of this call, even if other calls evaluate other states in between. (In a simulation's own data,
 * records and sensors also update these values.) v may be NULL (zero), a may be NULL (zero). Accelerations describe the
 * motion, and do not contain gravity. All queries and totals are NaN until the first update, and after kt_loop_set_on
 * or kt_effect_set_on. */
KT_API KT_CHECKED kt_status kt_kinematics_update(const kt_model *model, kt_data *data, const double *q, const double *v,
                                                 const double *a, kt_error *error);

/* Returns the pose of the body frame in the world. O(1), like all queries of this header except the Jacobian. */
KT_API kt_pose kt_body_pose(const kt_model *model, const kt_data *data, int body);
/* Angular velocity and velocity of the body frame's origin, world axes. */
KT_API kt_twist kt_body_twist(const kt_model *model, const kt_data *data, int body);
/* Angular acceleration and (classical) acceleration of the body frame's origin, world axes. */
KT_API kt_twist kt_body_acceleration(const kt_model *model, const kt_data *data, int body);

/* A point given in the body frame: its position, velocity and acceleration in the world. */
KT_API kt_vec3 kt_point_position(const kt_model *model, const kt_data *data, int body, kt_vec3 at);
KT_API kt_vec3 kt_point_velocity(const kt_model *model, const kt_data *data, int body, kt_vec3 at);
KT_API kt_vec3 kt_point_acceleration(const kt_model *model, const kt_data *data, int body, kt_vec3 at);

/* Computes the Jacobian of a frame at a point given in the body frame: 6 x nv, column-major, world axes.
 * The first three rows are the angular velocity, the last three the point's velocity. Needs kt_kinematics_update at q.
 * O(nv + depth). */
KT_API void kt_point_jacobian(const kt_model *model, const kt_data *data, int body, kt_vec3 at, double *jacobian);

/* ---- totals (all need kt_kinematics_update with q and v) --------------------------------------------------------- */

/* Returns the kinetic energy of all bodies, and of the rotors of joints with armature, J. */
KT_API double kt_kinetic_energy(const kt_model *model, const kt_data *data);
/* Returns the potential energy of gravity, J: -M g . c with M and c of kt_mass_center. The energy is zero if the centre
 * of mass is at the world's origin. Bodies that are fixed to the world count neither in the potential nor in the
 * kinetic energy; nor do they in the absolute formulation. */
KT_API double kt_potential_energy(const kt_model *model, const kt_data *data);
/* Returns linear momentum (force) and angular momentum about the world's origin (moment), world axes. Rotors have no
 * momentum. */
KT_API kt_wrench kt_momentum(const kt_model *model, const kt_data *data);
/* Returns the total mass of the moving bodies, and their centre of mass in the world frame; zero if there is no mass.
 */
KT_API double kt_mass_center(const kt_model *model, const kt_data *data, kt_vec3 *center);

/* Computes the reactions in all tree joints, applied and constraint parts together. wrenches has one entry for each
 * body; entry 0 is set to zero. A wrench is the force and moment that the parent exerts on the body through its joint,
 * in world axes. The moment is about the origin of the joint frame on the parent. Needs kt_kinematics_update with the
 * accelerations of the motion. external is as for forward dynamics. */
KT_API void kt_joint_reactions(const kt_model *model, kt_data *data, const kt_wrench *external, kt_wrench *wrenches);

#ifdef __cplusplus
}
#endif
#endif
