/* Whole runs against closed forms and constants of the motion. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scenes.h"

#include <float.h>
#include <math.h>

/* ---- a body that tumbles ----------------------------------------------------------------------------------------- */

/* The angular momentum in the world, L = R I w, and the norm of the quaternion. */
typedef struct kt_tumble {
    kt_vec3 momentum;
    kt_worst unit, direction;
    double bound;
} kt_tumble;

static kt_vec3 momentum_of(const double *q, const double *v) {
    kt_mat3 rotation = kt_mat3_from_quat(kt_quat_make(q[3], q[4], q[5], q[6]));
    return kt_mat3_apply(rotation, kt_vec3_make(v[3], 2.0 * v[4], 3.0 * v[5]));
}

static int check_tumble(const kt_record *record, void *user) {
    kt_tumble *t = user;
    const double *p = record->q + 3;
    double defect = fabs(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3] - 1.0);
    kt_vec3 change = kt_vec3_sub(momentum_of(record->q, record->v), t->momentum);
    kt_worst_below(&t->unit, defect, 6.0 * DBL_EPSILON, "t = %g", record->t);
    kt_worst_below(&t->direction, kt_vec3_norm(change), t->bound, "t = %g", record->t);
    return 0;
}

/* Spun about its middle axis with a little across it, it turns over and over. The quaternion keeps its norm in every
 * record to rounding, although the tolerance is coarse. The scaling of the quaternion does no harm. The angular
 * momentum in the world, which depends on the orientation, is constant to the tolerance (five times the measured
 * error). */
static void tumble(const char *integrator, double tolerance, double bound) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_FREE, 1.0);
    lone.body.joint.velocity[3] = 0.01;
    lone.body.joint.velocity[4] = 3.0;
    lone.body.joint.velocity[5] = 0.02;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_within(integrator, tolerance, 20.0);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_tumble t = {{0.01, 6.0, 0.06}, kt_worst_make("norm of the quaternion"), kt_worst_make(integrator), bound};
    kt_test_run(simulation, check_tumble, &t);
    kt_check_worst(&t.unit);
    kt_check_worst(&t.direction);
}

KT_TEST(tumbling_body_keeps_unit_quaternion_and_angular_momentum) {
    tumble("dopri5", 1e-5, 2.4e-3);
    tumble("dopri5", 1e-10, 1.1e-8);
    tumble("dop853", 1e-10, 5e-8);
}

/* Scaling the quaternion after each step must not cost the method its order: halving the step divides the error by 2^p.
 */
KT_TEST(scaling_quaternions_keeps_the_order) {
    kt_lone lone;
    double error_of[4];
    kt_lone_make(&lone, KT_JOINT_FREE, 1.0);
    lone.body.joint.velocity[3] = 1.0;
    lone.body.joint.velocity[4] = 2.0;
    lone.body.joint.velocity[5] = 0.5;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_vec3 start = kt_vec3_make(1.0, 4.0, 1.5);
    for (int i = 0; i < 4; i++) {
        kt_run run = kt_run_fixed("rk4", 0.05 / (1 << i), 2.0);
        kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
        kt_test_advance(simulation, 2.0);
        kt_vec3 end = momentum_of(kt_simulation_positions(simulation), kt_simulation_velocities(simulation));
        error_of[i] = kt_vec3_norm(kt_vec3_sub(end, start));
    }
    for (int i = 1; i < 4; i++)
        kt_check_near("order", log2(error_of[i - 1] / error_of[i]), 4.0, 0.15);
}

/* ---- nothing ----------------------------------------------------------------------------------------------------- */

KT_TEST(scene_in_which_nothing_moves_runs) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_FIXED, 1.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_default();
    run.interval = 1.0;
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_kept *kept = kt_kept_empty(model);
    kt_test_run(simulation, kt_keep, kept);
    kt_check_equal_int("records", kept->count, 11);
}
