/* Kinematic and dynamic quantities for control laws. The quantities are Jacobians and their bias accelerations in three
 * frames, totals about the centre of mass, the Coriolis matrix, M^-1 x and the operational-space inertia. For
 * mechanisms with loops, the header adds independent coordinates and actuator forces. The page "Control cookbook" has a
 * program for each.
 *
 * Matrices are column-major. Twists have the angular part first, wrenches the moment. Calls that take `data` alone use
 * the state of the last kt_kinematics_update (dynamics.h). No call allocates memory, except the _create functions.
 *
 * Sources:
 *   Featherstone, Rigid Body Dynamics Algorithms (2008).
 *   Khatib, A unified approach for motion and force control of robot manipulators, IEEE J. Robotics and Automation
 *     3(1), 1987.
 *   Orin, Goswami, Lee, Centroidal dynamics of a humanoid robot, Autonomous Robots 35, 2013.
 *   Moreover, [MSD 7.33, 7.34]. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_CONTROL_H
#define KINETREE_CONTROL_H

#include "kinetree/mechanism.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- frames ------------------------------------------------------------------------------------------------------ */

/* The frame in which the twist of a point of a body is expressed. In the formulas, omega is the angular velocity of the
 * body and R its axes. The point has the velocity u and the world position p. */
typedef enum kt_twist_frame {
    KT_TWIST_ALIGNED = 0, /* world axes, at the point: (omega, u) */
    KT_TWIST_BODY,        /* the body's axes, at the point: (R' omega, R' u) */
    KT_TWIST_WORLD,       /* world axes, at the world's origin (spatial): (omega, u + p x omega) */
} kt_twist_frame;

/* The calls below return NaN, and leave matrices unchanged, if the body, marker or frame does not exist.
 *
 * Computes the Jacobian J of a point given in the body frame: the twist is J v. jacobian: 6 x nv. With KT_TWIST_ALIGNED
 * the result equals kt_point_jacobian. Needs kt_kinematics_update at q. O(nv + depth). */
KT_API void kt_frame_jacobian(const kt_model *model, const kt_data *data, int body, kt_vec3 at, kt_twist_frame frame,
                              double *jacobian);

/* Returns the bias acceleration (dJ/dt) v of this twist: d/dt (J v) = J a + (dJ/dt) v. Needs kt_kinematics_update at q
 * and v. The accelerations given to that call have no influence. O(depth). */
KT_API kt_twist kt_frame_bias(const kt_model *model, const kt_data *data, int body, kt_vec3 at, kt_twist_frame frame);

/* The first function computes the time derivative dJ/dt of kt_frame_jacobian, 6 x nv. The second computes the
 * derivative d(J v)/dq of the twist with respect to positions (along q (+) e_j), 6 x nv. The product of either matrix
 * with v is kt_frame_bias. With KT_TWIST_ALIGNED, the linear parts of both matrices are equal; the angular parts are
 * not. Need kt_kinematics_update at q and v. O(nv + depth). */
KT_API void kt_frame_jacobian_derivative(const kt_model *model, const kt_data *data, int body, kt_vec3 at,
                                         kt_twist_frame frame, double *derivative);
KT_API void kt_frame_twist_derivative(const kt_model *model, const kt_data *data, int body, kt_vec3 at,
                                      kt_twist_frame frame, double *derivative);

/* The pose of a marker in the world, and the quantities above for the origin of the marker. The marker is given by its
 * index on its body (kt_marker_find). KT_TWIST_BODY then refers to the axes of the marker. Needs and cost as above. */
KT_API kt_pose kt_marker_pose(const kt_model *model, const kt_data *data, int body, int marker);
KT_API void kt_marker_jacobian(const kt_model *model, const kt_data *data, int body, int marker, kt_twist_frame frame,
                               double *jacobian);
KT_API kt_twist kt_marker_bias(const kt_model *model, const kt_data *data, int body, int marker, kt_twist_frame frame);
KT_API void kt_marker_jacobian_derivative(const kt_model *model, const kt_data *data, int body, int marker,
                                          kt_twist_frame frame, double *derivative);
KT_API void kt_marker_twist_derivative(const kt_model *model, const kt_data *data, int body, int marker,
                                       kt_twist_frame frame, double *derivative);

/* ---- about the centre of mass ------------------------------------------------------------------------------------ */

/* Computes the Jacobian of the centre of mass of kt_mass_center: 3 x nv, world axes; zeros if there is no mass. Needs
 * kt_kinematics_update at q. O(nv). */
KT_API void kt_mass_center_jacobian(const kt_model *model, kt_data *data, double *jacobian);

/* Returns (dJ/dt) v of the centre of mass, m/s^2, world axes. Needs kt_kinematics_update at q and v. O(number of
 * bodies). */
KT_API kt_vec3 kt_mass_center_bias(const kt_model *model, kt_data *data);

/* Computes the centroidal momentum matrix A, 6 x nv, world axes. Rows 0 to 2 of A v are the angular momentum about the
 * centre of mass. Rows 3 to 5 are the linear momentum. Needs kt_kinematics_update at q. O(nv). */
KT_API void kt_centroidal_matrix(const kt_model *model, kt_data *data, double *matrix);

/* Returns (dA/dt) v of this matrix: d/dt (A v) = A a + (dA/dt) v. The result is a moment about the centre of mass and a
 * force. Needs kt_kinematics_update at q and v. O(number of bodies). */
KT_API kt_wrench kt_centroidal_bias(const kt_model *model, kt_data *data);

/* ---- the Coriolis matrix ----------------------------------------------------------------------------------------- */

/* Computes the Coriolis matrix C at (q, v), nv x nv, with M a + C v + g = tau (g: kt_dynamics_inverse without v and a).
 * The matrix dM/dt - 2 C is skew-symmetric, for quaternion joints too. For joints with coordinates of their own, C is
 * the matrix of Christoffel's symbols. work, errors and cost are as for kt_dynamics_inverse_derivatives.
 *
 * Source: Echeandia, Wensing, Numerical methods to compute the Coriolis matrix and Christoffel symbols for rigid-body
 * systems, J. Computational and Nonlinear Dynamics 16(9), 2021. */
KT_API KT_CHECKED kt_status kt_coriolis_evaluate(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                 const double *q, const double *v, double *coriolis, kt_error *error);

/* ---- the inverse of the mass matrix, and operational space ------------------------------------------------------- */

/* The map from joint forces to accelerations at a position. One thread may use an object at a time.
 *
 * Without loops the map is M^-1. Its terms come from the articulated-body recursion, without a dense M. The terms take
 * O(n), and each column takes O(n).
 *
 * With loops the map is Z (Z' M Z)^-1 Z'. The columns of Z span the velocities that the loops leave
 * (kt_loop_nullspace). The terms take O(nv^2 f) and a column takes O(nv f), with f degrees of freedom. If solutions
 * along the tree take O(bodies) (kt_acceleration_derivatives), as for rows of windows and ropes, the terms, a column
 * and the memory take O(n). */
typedef struct kt_mass_inverse kt_mass_inverse;

/* Bytes for a model. `rows`: the largest number of rows of a Jacobian that kt_operational_inertia will receive, or 0.
 * Returns 0 if `rows` is negative or so large that the size overflows; kt_mass_inverse_init then reports an error. */
KT_API size_t kt_mass_inverse_size(const kt_model *model, int rows);

/* Initialises the object in the caller's memory, which must stay valid while the object is used.
 *
 * Errors: KT_ERROR_MEMORY if memory is too small or misaligned (KT_ALIGNMENT); KT_ERROR_ARGUMENT for the `rows` that
 * kt_mass_inverse_size rejects; KT_ERROR_UNSUPPORTED, naming the joint, if a joint moves no mass. */
KT_API KT_CHECKED kt_status kt_mass_inverse_init(const kt_model *model, int rows, void *memory, size_t size,
                                                 kt_mass_inverse **inverse, kt_error *error);

/* Creates the object in allocated memory, which kt_mass_inverse_free releases. */
KT_API KT_CHECKED kt_status kt_mass_inverse_create(const kt_model *model, int rows, kt_mass_inverse **inverse,
                                                   kt_error *error);
/* Releases an object of kt_mass_inverse_create. Does nothing with an object in the caller's memory, nor with NULL. */
KT_API void kt_mass_inverse_free(kt_mass_inverse *inverse);

/* Computes the terms at (t, q). Without loops, t matters only for masses that are functions of time.
 *
 * Errors: those of kt_dynamics_mass and, with loops, of kt_loop_nullspace. KT_ERROR_SINGULAR names the joint along
 * which the mechanism has no inertia, or reports that a degree of freedom of the closed loops has no inertia. After an
 * error the object has no terms. */
KT_API KT_CHECKED kt_status kt_mass_inverse_compute(kt_mass_inverse *inverse, kt_data *data, double t, const double *q,
                                                    kt_error *error);

/* Replaces x (nv x columns) by M^-1 x: the change of the accelerations due to joint forces x.
 *
 * Errors: KT_ERROR_ARGUMENT if the terms are not computed, or if `columns` is negative; KT_ERROR_NOT_FINITE if a number
 * is not finite or exceeds 1e150. x is then unchanged. */
KT_API KT_CHECKED kt_status kt_mass_inverse_apply(kt_mass_inverse *inverse, int columns, double *x, kt_error *error);

/* Computes the operational-space inertia (J M^-1 J')^-1 of a task with the Jacobian J (rows x nv). The array `inertia`
 * is rows x rows. The array `consistent` (nv x rows, may be NULL) receives the dynamically consistent inverse
 * M^-1 J' (J M^-1 J')^-1 of J. Both respect the loops.
 *
 * *rcond, unless NULL, receives a reciprocal condition number, 0 < rcond <= 1: the least value over all rows of the
 * product of three fractions.
 *   The first is the size of the row: the largest motion of the task during a large change of one coordinate. This
 * motion is relative to a radian or to a length of the mechanism, whichever is less.
 *   The second is the part of the row that the loops leave.
 *   The third is the part of the row that the preceding rows leave.
 *
 * If rcond is small, a singular position is near, and the inertia grows like 1 / rcond^2.
 *
 * Errors: outputs are unchanged after an error.
 *   KT_ERROR_SINGULAR names the first row of J along which the preceding rows leave no motion. The position is
 *     singular, or there are more rows than degrees of freedom. The limit of the first fraction is rounding. The limit
 * of the second fraction is 1e-10, or 1e-7 with many loops. The limit of the third fraction is 1e-7. KT_ERROR_ARGUMENT:
 * the terms are not computed, or J has more rows than at set-up.
 *   KT_ERROR_NOT_FINITE: an input is not finite, or the result overflows.
 *
 * Cost: `rows` columns of kt_mass_inverse_apply, twice as many if loops are many, and O(rows^2 nv + rows nv f). */
KT_API KT_CHECKED kt_status kt_operational_inertia(kt_mass_inverse *inverse, int rows, const double *jacobian,
                                                   double *inertia, double *consistent, double *rcond, kt_error *error);

/* ---- loops: independent coordinates ------------------------------------------------------------------------------ */

/* Bytes of the work memory of the calls below, at KT_ALIGNMENT: some 8 nv (2 nv + equations). A call uses this memory
 * only until it returns, and returns KT_ERROR_MEMORY if the memory is too small or not aligned. */
KT_API size_t kt_actuation_work_size(const kt_model *model);

/* Velocity coordinates, by index, without repetition. */
typedef struct kt_coordinate_list {
    const int *index; /* of v */
    int count;        /* how many: at most nv */
} kt_coordinate_list;

/* Computes the basis B of the velocities that the loops permit at (t, q), in terms of chosen coordinates. Column j
 * holds the rates of all coordinates while the j-th chosen coordinate has the rate 1 and the other chosen coordinates
 * the rate 0: A B = 0. The shape is nv x count, and count is the number of degrees of freedom at (t, q). Loops that
 * change with time add
 * velocities: v = B z + x0, where x0 is the result of kt_velocity_complete for zeros. A task's Jacobian with respect to
 * the chosen coordinates is J B (kt_loop_jacobian).
 *
 * *rcond, unless NULL, receives a reciprocal condition number, 0 < rcond <= 1. The number is 1 over the largest entry
 * of B, with rotations in radians and translations in lengths of the mechanism. If rcond is small, a dead point of the
 * chosen coordinates is near: another coordinate moves 1 / rcond times as far.
 *
 * Errors: those of kt_loop_nullspace; KT_ERROR_ARGUMENT (another number of coordinates, an index out of range or given
 * twice). KT_ERROR_SINGULAR if the condition number is below some 1e-10. The message names the joint that moves most in
 * a motion in which all chosen coordinates are at rest.
 *
 * Cost: kt_loop_nullspace, and O(nv count^2). */
KT_API KT_CHECKED kt_status kt_independent_basis(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                 double t, const double *q, kt_coordinate_list independent,
                                                 double *basis, double *rcond, kt_error *error);

/* Computes J B, rows x columns: the Jacobian of a task with respect to a basis of velocities. J has the shape rows x
 * nv. The basis B has the shape nv x columns (kt_loop_nullspace or kt_independent_basis). The product maps z to the
 * part J B z of the task's velocity. With loops that change with time, v = B z + x0, and J x0 must be added. The three
 * arrays are distinct. O(rows nv columns). */
KT_API void kt_loop_jacobian(const kt_model *model, int rows, const double *jacobian, int columns, const double *basis,
                             double *reduced);

/* Completes velocities v (nv) for which the independent coordinates are given. The others receive the values that the
 * loops demand at (t, q), A v = b'. Errors and cost as kt_independent_basis. v is unchanged on failure. */
KT_API KT_CHECKED kt_status kt_velocity_complete(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                 double t, const double *q, kt_coordinate_list independent, double *v,
                                                 kt_error *error);

/* Completes accelerations a (nv) likewise at (t, q, v): A a = b''. */
KT_API KT_CHECKED kt_status kt_acceleration_complete(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                     double t, const double *q, const double *v,
                                                     kt_coordinate_list independent, double *a, kt_error *error);

/* ---- inverse dynamics with loops and effects --------------------------------------------------------------------- */

/* The tolerance for given accelerations in the equations of the loops: a fraction of the largest term that the
 * equations could have. */
#define KT_ACTUATION_TOLERANCE 1e-9

/* Computes the forces of actuators that cause accelerations a (nv) at (t, q, v), with loops, effects and external
 * wrenches. The argument `external` is as for kt_acceleration_evaluate and may be NULL. Both v and a may be NULL
 * (zero). All effects act as in that call, including motors and servos.
 *
 * With these forces as joint forces tau, zero elsewhere, kt_acceleration_evaluate gives a, to rounding over rcond. This
 * holds if that call computes accelerations at the state itself: near a singular position of the loops, that call
 * interpolates accelerations from other states.
 *
 * actuated: the coordinates on which actuators act. forces has one number for each, N m or N. If as many actuators as
 * degrees of freedom exist, the forces are unique. With more actuators, the result has the least sum of weight[i]
 * force[i]^2. weights (count positive numbers) may be NULL: all 1.
 *
 * *rcond, unless NULL, receives a reciprocal condition number, 0 < rcond <= 1, as that of kt_independent_basis. A
 * generalised force that the motion needs may take forces 1 / rcond times as large. Near a dead point of the actuators
 * rcond is small. The forces and their relative error then grow like its reciprocal.
 *
 * Errors: forces is unchanged on failure.
 *   KT_ERROR_SINGULAR: no actuator can drive some motion. The actuators are too few, or at a singular position. The
 * error names the joint that moves most in this motion.
 *   KT_ERROR_CONSTRAINT: a violates the equations of a loop (KT_ACTUATION_TOLERANCE). The error names the worst loop.
 *     Use kt_acceleration_complete to obtain consistent accelerations.
 *   KT_ERROR_ARGUMENT: list or weights.
 *   Those of kt_effect_forces, kt_dynamics_inverse and kt_loop_nullspace.
 *
 * Method: Z' S' forces = Z' (M a + h - J' external - Q). Z is a basis of the null space of the loops' equations, and S
 * has the rows of the actuated coordinates. Least forces come from a QR decomposition with column pivoting [MSD 7.34].
 *
 * Cost: inverse dynamics, the effects, kt_loop_equations, kt_loop_nullspace and O(count f^2) for f degrees of freedom.
 */
KT_API KT_CHECKED kt_status kt_actuation_evaluate(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                  double t, const double *q, const double *v, const double *a,
                                                  const kt_wrench *external, kt_coordinate_list actuated,
                                                  const double *weights, double *forces, double *rcond,
                                                  kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
