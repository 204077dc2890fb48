/* What control laws ask of a mechanism: Jacobians and their bias accelerations in three frames, totals about the centre
 * of mass, the Coriolis matrix, M^-1 x, operational-space inertia, and, with loops, independent coordinates and the
 * forces of the actuators. The page "Control cookbook" has a program for each.
 *
 * Matrices are column-major. Twists have the angular part first, wrenches the moment. Calls that take `data` alone
 * answer for the state of the last kt_kinematics_update (dynamics.h). No call allocates memory, but for the _create
 * ones.
 *
 * Sources: Featherstone, Rigid Body Dynamics Algorithms (2008); Khatib, A unified approach for motion and force control
 * of robot manipulators, IEEE J. Robotics and Automation 3(1), 1987; Orin, Goswami, Lee, Centroidal dynamics of a
 * humanoid robot, Autonomous Robots 35, 2013; [MSD 7.33, 7.34].
 */
#ifndef KINETREE_CONTROL_H
#define KINETREE_CONTROL_H

#include "kinetree/mechanism.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- frames ------------------------------------------------------------------------------------------------------ */

/* In which frame the twist of a point of a body is expressed. omega is the angular velocity of the body, u the velocity
 * of the point, p its position in the world, and R the axes of the body. */
typedef enum kt_twist_frame {
    KT_TWIST_ALIGNED = 0, /* world axes, at the point: (omega, u) */
    KT_TWIST_BODY,        /* the body's axes, at the point: (R' omega, R' u) */
    KT_TWIST_WORLD,       /* world axes, at the world's origin (spatial): (omega, u + p x omega) */
} kt_twist_frame;

/* The calls below return NaN, and leave matrices as they are, if there is no such body, marker or frame.
 *
 * The Jacobian J of a point given in the body frame: the twist is J v. jacobian: 6 x nv. With KT_TWIST_ALIGNED it is
 * kt_point_jacobian. Needs kt_kinematics_update at q. O(nv + depth). */
KT_API void kt_frame_jacobian(const kt_model *model, const kt_data *data, int body, kt_vec3 at, kt_twist_frame frame,
                              double *jacobian);

/* The bias acceleration (dJ/dt) v of the same twist: d/dt (J v) = J a + (dJ/dt) v. Needs kt_kinematics_update at q and
 * v; the accelerations that it was given do not enter. O(depth). */
KT_API kt_twist kt_frame_bias(const kt_model *model, const kt_data *data, int body, kt_vec3 at, kt_twist_frame frame);

/* The same as matrices, 6 x nv each: the time derivative dJ/dt of kt_frame_jacobian, and the derivative d(J v)/dq of the
 * twist with respect to positions (along q (+) e_j), whose product with v is kt_frame_bias, too. (The linear parts of
 * both are equal with KT_TWIST_ALIGNED; the angular ones are not.) Need kt_kinematics_update at q and v.
 * O(nv + depth). */
KT_API void kt_frame_jacobian_derivative(const kt_model *model, const kt_data *data, int body, kt_vec3 at,
                                         kt_twist_frame frame, double *derivative);
KT_API void kt_frame_twist_derivative(const kt_model *model, const kt_data *data, int body, kt_vec3 at,
                                      kt_twist_frame frame, double *derivative);

/* Of a marker, by its index on its body (kt_marker_find): its pose in the world, and the same quantities of its origin;
 * KT_TWIST_BODY is then along the axes of the marker. Needs and cost as above. */
KT_API kt_pose kt_marker_pose(const kt_model *model, const kt_data *data, int body, int marker);
KT_API void kt_marker_jacobian(const kt_model *model, const kt_data *data, int body, int marker, kt_twist_frame frame,
                               double *jacobian);
KT_API kt_twist kt_marker_bias(const kt_model *model, const kt_data *data, int body, int marker, kt_twist_frame frame);
KT_API void kt_marker_jacobian_derivative(const kt_model *model, const kt_data *data, int body, int marker,
                                          kt_twist_frame frame, double *derivative);
KT_API void kt_marker_twist_derivative(const kt_model *model, const kt_data *data, int body, int marker,
                                       kt_twist_frame frame, double *derivative);

/* ---- about the centre of mass ------------------------------------------------------------------------------------ */

/* The Jacobian of the centre of mass of kt_mass_center: 3 x nv, world axes; zeros if there is no mass. Needs
 * kt_kinematics_update at q. O(nv). */
KT_API void kt_mass_center_jacobian(const kt_model *model, kt_data *data, double *jacobian);

/* (dJ/dt) v of the centre of mass, m/s^2, world axes. Needs kt_kinematics_update at q and v. O(number of bodies). */
KT_API kt_vec3 kt_mass_center_bias(const kt_model *model, kt_data *data);

/* The centroidal momentum matrix A: A v is the angular momentum about the centre of mass (rows 0 to 2), and the linear
 * momentum (rows 3 to 5), world axes. matrix: 6 x nv. Needs kt_kinematics_update at q. O(nv). */
KT_API void kt_centroidal_matrix(const kt_model *model, kt_data *data, double *matrix);

/* (dA/dt) v of this matrix: d/dt (A v) = A a + (dA/dt) v, moment about the centre of mass and force. Needs
 * kt_kinematics_update at q and v. O(number of bodies). */
KT_API kt_wrench kt_centroidal_bias(const kt_model *model, kt_data *data);

/* ---- the Coriolis matrix ----------------------------------------------------------------------------------------- */

/* The Coriolis matrix C at (q, v): nv x nv, with M a + C v + g = tau (g: kt_dynamics_inverse without v and a) and
 * dM/dt - 2 C skew-symmetric, for quaternion joints too. For joints with coordinates of their own it is that of
 * Christoffel's symbols. work as for kt_dynamics_inverse_derivatives, with its errors and cost.
 *
 * Source: Echeandia, Wensing, Numerical methods to compute the Coriolis matrix and Christoffel symbols for rigid-body
 * systems, J. Computational and Nonlinear Dynamics 16(9), 2021. */
KT_API KT_CHECKED kt_status kt_coriolis_evaluate(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                 const double *q, const double *v, double *coriolis, kt_error *error);

/* ---- the inverse of the mass matrix, and operational space ------------------------------------------------------- */

/* What joint forces do to accelerations at a position: without loops M^-1, by the terms that the articulated-body
 * recursion leaves, O(n) for them and O(n) a column, without a dense M. With loops Z (Z' M Z)^-1 Z', where the columns
 * of Z span the velocities that the loops leave (kt_loop_nullspace): where solutions take O(bodies)
 * (kt_acceleration_derivatives), as of rows of windows and ropes, O(n), too, for the terms, a column and the memory;
 * otherwise O(nv^2 f) for the terms and O(nv f) a column with f degrees of freedom. One thread may use an object at a
 * time. */
typedef struct kt_mass_inverse kt_mass_inverse;

/* Bytes for a model; `rows`: the most rows of a Jacobian that kt_operational_inertia will be given, or 0; 0 bytes if it
 * is negative, which kt_mass_inverse_init reports. */
KT_API size_t kt_mass_inverse_size(const kt_model *model, int rows);

/* Initialises the object in the caller's memory, which must stay there while it is used. Refuses memory that is too
 * small or misaligned (KT_ALIGNMENT) with KT_ERROR_MEMORY, and negative rows with KT_ERROR_ARGUMENT. */
KT_API KT_CHECKED kt_status kt_mass_inverse_init(const kt_model *model, int rows, void *memory, size_t size,
                                                 kt_mass_inverse **inverse, kt_error *error);

/* The same in memory of its own, released with kt_mass_inverse_free. */
KT_API KT_CHECKED kt_status kt_mass_inverse_create(const kt_model *model, int rows, kt_mass_inverse **inverse,
                                                   kt_error *error);
/* Releases what _create made; does nothing with an object in the caller's memory, nor with NULL. */
KT_API void kt_mass_inverse_free(kt_mass_inverse *inverse);

/* Computes the terms at (t, q); without loops t does not matter. Errors: those of kt_dynamics_mass and, with loops, of
 * kt_loop_nullspace; KT_ERROR_SINGULAR names the joint along which there is no inertia, or says that the loops leave a
 * degree of freedom without. There are no terms then. */
KT_API KT_CHECKED kt_status kt_mass_inverse_compute(kt_mass_inverse *inverse, kt_data *data, double t, const double *q,
                                                    kt_error *error);

/* x (nv x columns) becomes M^-1 x: the accelerations that joint forces x cause beyond those without. KT_ERROR_ARGUMENT
 * if there are no terms, or fewer columns than 0; KT_ERROR_NOT_FINITE if a number is not finite or exceeds 1e150; x is
 * then unchanged. */
KT_API KT_CHECKED kt_status kt_mass_inverse_apply(kt_mass_inverse *inverse, int columns, double *x, kt_error *error);

/* The operational-space inertia (J M^-1 J')^-1 of a task with the Jacobian J (rows x nv), rows x rows, and, unless
 * NULL, the dynamically consistent inverse M^-1 J' (J M^-1 J')^-1 of J, nv x rows. Both respect the loops.
 *
 * *rcond, unless NULL, receives a reciprocal condition number, 0 < rcond <= 1: of the row that has least, the part that
 * is left of what a row could be, a radian or a length of the mechanism for a coordinate's large change, by the row
 * itself, by the loops, and by the rows before it. Where it is small a singular position is near, and the inertia grows
 * like 1 / rcond^2.
 *
 * Errors: KT_ERROR_SINGULAR names the first row of J along which no motion is left besides those before it (a singular
 * position, or more rows than degrees of freedom): less than 1e-7 of it, less than 1e-10 of what it could be without
 * the loops (1e-7 where they are many), or the rounding of a radian or a length of the mechanism; KT_ERROR_ARGUMENT if
 * there are no terms, or more rows than at set-up; KT_ERROR_NOT_FINITE. Outputs are then unchanged. Cost: `rows`
 * columns of kt_mass_inverse_apply, twice as many where loops are many, and O(rows^2 nv + rows nv f). */
KT_API KT_CHECKED kt_status kt_operational_inertia(kt_mass_inverse *inverse, int rows, const double *jacobian,
                                                   double *inertia, double *consistent, double *rcond, kt_error *error);

/* ---- loops: independent coordinates ------------------------------------------------------------------------------ */

/* Bytes of the work memory of the calls from here on, at KT_ALIGNMENT, which they use only during the call:
 * some 8 nv (2 nv + equations). KT_ERROR_MEMORY if it is too small or not aligned. */
KT_API size_t kt_actuation_work_size(const kt_model *model);

/* Velocity coordinates, by index, without repetition. */
typedef struct kt_coordinate_list {
    const int *index; /* of v */
    int count;        /* how many: at most nv */
} kt_coordinate_list;

/* The basis B of the velocities that the loops leave free at (t, q) in terms of chosen coordinates: column j holds the
 * rates of all coordinates while the j-th chosen one moves at 1 and the other chosen ones rest, A B = 0. nv x count,
 * count being the number of degrees of freedom there. Loops that change with time add velocities of their own:
 * v = B z + x0, where x0 is what kt_velocity_complete makes of zeros. A task's Jacobian with respect to the chosen
 * coordinates is J B (kt_loop_jacobian).
 *
 * *rcond, unless NULL, receives a reciprocal condition number, 0 < rcond <= 1: 1 over the largest entry of B, rotations
 * in radians and translations in lengths of the mechanism. Where it is small a dead point of the chosen coordinates is
 * near: another one moves 1 / rcond times as far.
 *
 * Errors: KT_ERROR_ARGUMENT (another number of coordinates, an index that is none or stands twice);
 * KT_ERROR_SINGULAR, below some 1e-10 of such a number, names the joint that moves most in a motion in which all chosen
 * coordinates rest; those of kt_loop_nullspace. Cost: kt_loop_nullspace, and O(nv count^2). */
KT_API KT_CHECKED kt_status kt_independent_basis(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                 double t, const double *q, kt_coordinate_list independent,
                                                 double *basis, double *rcond, kt_error *error);

/* J B, rows x columns: of a Jacobian (rows x nv) and a basis of velocities (nv x columns; kt_loop_nullspace or
 * kt_independent_basis), the Jacobian with respect to the basis. It maps z to the part J B z of the task's velocity; with
 * loops that change with time, v = B z + x0, the part J x0 comes to it. The three arrays are distinct.
 * O(rows nv columns). */
KT_API void kt_loop_jacobian(const kt_model *model, int rows, const double *jacobian, int columns, const double *basis,
                             double *reduced);

/* Completes velocities v (nv), of which the independent coordinates are given: the others become those that the loops
 * demand at (t, q), A v = b'. Errors and cost as kt_independent_basis. v is unchanged on failure. */
KT_API KT_CHECKED kt_status kt_velocity_complete(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                 double t, const double *q, kt_coordinate_list independent, double *v,
                                                 kt_error *error);

/* Completes accelerations a (nv) likewise at (t, q, v): A a = b''. */
KT_API KT_CHECKED kt_status kt_acceleration_complete(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                     double t, const double *q, const double *v,
                                                     kt_coordinate_list independent, double *a, kt_error *error);

/* ---- inverse dynamics with loops and effects --------------------------------------------------------------------- */

/* How closely given accelerations must satisfy the equations of the loops: the fraction of the largest term that
 * they could have. */
#define KT_ACTUATION_TOLERANCE 1e-9

/* Computes the forces of actuators that cause accelerations a (nv) at (t, q, v), with loops, effects and external
 * wrenches (as kt_acceleration_evaluate, may be NULL); v and a may be NULL (zero). With these forces as joint forces
 * tau, zero elsewhere, kt_acceleration_evaluate gives a, to rounding over rcond, where it computes accelerations at the
 * state itself: next to a singular position of the loops it interpolates them. Effects act as they do there, motors and
 * servos among them.
 *
 * actuated: the coordinates on which actuators act; forces has one number each, N m or N. As many as degrees of
 * freedom: the forces are unique. More: those with the least sum of weight[i] force[i]^2; weights (count numbers > 0)
 * may be NULL, all 1.
 *
 * *rcond, unless NULL, receives a reciprocal condition number, 0 < rcond <= 1, as that of kt_independent_basis: a
 * generalised force that the motion needs may take forces 1 / rcond times as large. Near a dead point of the actuators
 * it is small, and the forces, as their relative error, grow like its reciprocal.
 *
 * Errors: KT_ERROR_SINGULAR if there is a motion on which no actuator works, because there are too
 * few, or at a singular position of the actuators: it names the joint that moves most in it; KT_ERROR_CONSTRAINT if a
 * violates the equations of a loop (KT_ACTUATION_TOLERANCE; kt_acceleration_complete makes them fit), naming the worst;
 * KT_ERROR_ARGUMENT (list, weights); those of kt_effect_forces, kt_dynamics_inverse and kt_loop_nullspace. forces is
 * unchanged on failure.
 *
 * Method: Z' S' forces = Z' (M a + h - J' external - Q), Z a basis of the null space of the loops' equations, S the
 * rows of the actuated coordinates; least forces by QR decomposition with column pivoting [MSD 7.34]. Cost: inverse
 * dynamics, the effects, kt_loop_equations, kt_loop_nullspace and O(count f^2) for f degrees of freedom. */
KT_API KT_CHECKED kt_status kt_actuation_evaluate(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                  double t, const double *q, const double *v, const double *a,
                                                  const kt_wrench *external, kt_coordinate_list actuated,
                                                  const double *weights, double *forces, double *rcond,
                                                  kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
