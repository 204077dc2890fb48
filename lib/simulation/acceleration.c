/* Acceleration of a tree: the articulated-body recursion with what the embedding program applies.
 *
 * Effects add to torque and wrenches here, and loops replace the recursion by the reduced equations.
 */
#include "simulation/acceleration.h"

kt_status kt_simulation_accelerate(kt_acceleration *acceleration, double t, const double *q, const double *v, double *a,
                                   kt_error *error) {
    (void)t; /* nothing on a tree asks for the time */
    return kt_dynamics_forward(acceleration->model, acceleration->data, q, v, acceleration->torque,
                               acceleration->wrenches, a, error);
}
