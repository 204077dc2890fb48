/* Effects on one body or joint against closed forms: drag, torques, forces; stops that never pull; friction that
 * creeps.
 *
 * Bounds are three times the errors measured when the test was written.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "motion/simulation/scenes.h"

#include "effect/effect.h"

#include <float.h>
#include <math.h>

/* One effect on a body with a free joint. The inertia is diag(1, 2, 3), and m = 2. The result is its state at t. */
static void run_free(kt_effect *effect, kt_lone *lone, double t, double *q, double *v) {
    kt_run run = kt_run_default();
    kt_error error;
    run.integrator = "dop853";
    run.relative = run.absolute = 1e-13;
    effect->between[0].body = lone->body.name;
    lone->description.bodies = &lone->body;
    lone->description.effects = effect;
    lone->description.effect_count = 1;
    kt_model *model = kt_scene_compile(&lone->description);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_need_fine("advance", kt_simulation_advance(simulation, t, &error), &error);
    for (int i = 0; i < kt_model_nq(model); i++)
        q[i] = kt_simulation_positions(simulation)[i];
    for (int i = 0; i < kt_model_nv(model); i++)
        v[i] = kt_simulation_velocities(simulation)[i];
}

/* m v' = m g - c v: v = g T (1 - exp(-t / T)), T = m / c;  m v' = m g - c v^2: v = u tanh(g t / u), u^2 = m g / c. */
KT_TEST(falling_bodies_approach_their_terminal_speed) {
    const double g = 9.81, t = 1.3, m = 2.0;
    for (int quadratic = 0; quadratic < 2; quadratic++) {
        kt_lone lone;
        kt_effect drag = kt_effect_default();
        double q[7], v[6];
        kt_lone_make(&lone, KT_JOINT_FREE, m);
        lone.description.gravity = kt_vec3_make(0.0, 0.0, -g);
        drag.type = KT_EFFECT_DRAG;
        drag.linear = quadratic ? 0.0 : 1.5;
        drag.quadratic = quadratic ? 1.5 : 0.0;
        run_free(&drag, &lone, t, q, v);
        const double u = sqrt(m * g / 1.5), rate = 1.5 / m;
        kt_check_near("speed", -v[2], quadratic ? u * tanh(g * t / u) : g / rate * (1.0 - exp(-rate * t)), 4e-14);
        kt_check_near("way", -q[2],
                      quadratic ? u * u / g * log(cosh(g * t / u)) : g / rate * (t - (1.0 - exp(-rate * t)) / rate),
                      4e-14);
    }
}

/* Flat throw against quadratic drag alone: v = v0 / (1 + c v0 t / m) in any direction. */
KT_TEST(quadratic_drag_is_against_the_velocity) {
    kt_lone lone;
    kt_effect drag = kt_effect_default();
    double q[7], v[6];
    kt_lone_make(&lone, KT_JOINT_FREE, 2.0);
    lone.body.joint.velocity[0] = 3.0;
    lone.body.joint.velocity[1] = -4.0;
    drag.type = KT_EFFECT_DRAG;
    drag.quadratic = 0.7;
    run_free(&drag, &lone, 2.0, q, v);
    kt_check_near("x", v[0], 3.0 / (1.0 + 0.7 * 5.0 * 2.0 / 2.0), 1.2e-14);
    kt_check_near("y", v[1], -4.0 / (1.0 + 0.7 * 5.0 * 2.0 / 2.0), 1.2e-14);
}

/* Along and about an axis of the body, h(s) = (b + q |s|) s and an inertia m give s(t) = b s0 e / (b + q s0 (1 - e)),
 * with e = exp(-b t / m). The body is turned by a right angle about x, so that its y is the world's z. It moves along y
 * and spins about y, which no other axis resists. */
KT_TEST(drag_along_axes_is_that_of_each_direction) {
    const double half = sqrt(0.5), t = 0.9, inertia = 2.0, b[2] = {1.9, 0.7}, q[2] = {0.4, 1.6}, start[2] = {-3.0, 5.0};
    const int place[2] = {2, 4}; /* of the velocity along y, and about y */
    kt_lone lone;
    kt_effect drag = kt_effect_default();
    double at[7], v[6];
    kt_lone_make(&lone, KT_JOINT_FREE, 2.0);
    lone.body.joint.position[3] = lone.body.joint.position[4] = half;
    drag.type = KT_EFFECT_DRAG;
    for (int k = 0; k < 6; k++)
        drag.dampings[k] = drag.quadratics[k] = 7.0;
    for (int i = 0; i < 2; i++) {
        lone.body.joint.velocity[place[i]] = start[i];
        drag.dampings[1 + 3 * i] = b[i];
        drag.quadratics[1 + 3 * i] = q[i];
    }
    run_free(&drag, &lone, t, at, v);
    for (int i = 0; i < 2; i++) {
        const double e = exp(-b[i] * t / inertia), speed = fabs(start[i]);
        const double after = b[i] * speed * e / (b[i] + q[i] * speed * (1.0 - e));
        kt_check_near("speed", v[place[i]], copysign(after, start[i]), 4e-14);
    }
    kt_check_below("along x and z", fabs(v[0]) + fabs(v[1]), 1e-14);
    kt_check_below("about x and z", fabs(v[3]) + fabs(v[5]), 1e-14);
}

/* Torques act about a principal axis of a body. The body is turned by a right angle about x, so that its y is the
 * world's z. The same torque, in the world's axes and in the body's, gives the rate sin(w t) and the angle (1 - cos(w
 * t)) / w. */
KT_TEST(torques_act_in_the_axes_they_are_given_in) {
    const double half = sqrt(0.5), w = 3.0, t = 0.8, inertia = 2.0;
    for (int in_body = 0; in_body < 2; in_body++) {
        kt_lone lone;
        kt_effect torque = kt_effect_default();
        double q[7], v[6];
        kt_lone_make(&lone, KT_JOINT_FREE, 2.0);
        lone.body.joint.position[3] = lone.body.joint.position[4] = half;
        torque.type = KT_EFFECT_TORQUE;
        torque.frame = in_body ? KT_FRAME_BODY : KT_FRAME_WORLD;
        for (int i = 0; i < 3; i++)
            torque.value[i] = kt_function_constant(0.0);
        torque.value[in_body ? 1 : 2] = kt_function_sine(inertia * w, w / 6.283185307179586, 1.5707963267948966, 0.0);
        run_free(&torque, &lone, t, q, v);
        kt_check_near("rate about the body's y", v[4], sin(w * t), 4e-15);
        kt_check_below("other rates", fabs(v[3]) + fabs(v[5]), 2e-15);
        const kt_mat3 turned = kt_mat3_from_quat(kt_quat_make(q[3], q[4], q[5], q[6]));
        kt_check_near("angle about the world's z", atan2(turned.x.y, turned.x.x), (1.0 - cos(w * t)) / w, 1.5e-13);
        kt_check_below("centre", fabs(v[0]) + fabs(v[1]) + fabs(v[2]), 0.0);
    }
}

/* For all speeds and depths, the force is never towards the stop and at most twice the spring's force. It is almost
 * zero at the stop, and equals the plain damper's force far inside. */
KT_TEST(stops_push_back_continuously) {
    const kt_effect_record r = {
        .type = KT_EFFECT_JOINT_LIMIT, .stiffness = 1e3, .damping = 20.0, .lower = -1.0, .upper = 0.5};
    const kt_effect_kind *kind = kt_effect_kinds[KT_EFFECT_JOINT_LIMIT];
    kt_random random = kt_random_of_test();
    int wrong = 0;
    for (int n = 0; n < 10000; n++) {
        const double depth = pow(10.0, kt_random_uniform(&random, -20.0, 2.0)), v = 10.0 * kt_random_normal(&random);
        const double above = kind->joint_force(&r, NULL, 0.5 + depth, v, 0.0, NULL);
        const double below = kind->joint_force(&r, NULL, -1.0 - depth, v, 0.0, NULL);
        const double x = (0.5 + depth) - 0.5, y = -1.0 - (-1.0 - depth);
        wrong += above > 0.0 || below < 0.0 || -above > 2e3 * x || below > 2e3 * y;
    }
    kt_check_equal_int("forces that pull, or are too large", wrong, 0);
    kt_check_near("between the stops", kind->joint_force(&r, NULL, 0.4, 5.0, 0.0, NULL), 0.0, 0.0);
    kt_check_near("far inside", kind->joint_force(&r, NULL, 100.5, 0.3, 0.0, NULL), -1e5 - 6.0, 6.0 * 6.0 / 1e5);
    kt_check_near("and in return", kind->joint_force(&r, NULL, 100.5, -0.3, 0.0, NULL), -1e5 + 6.0, 6.0 * 6.0 / 1e5);
}

/* The force is linear up to nine tenths of the limit L, and equals L from eleven tenths on. At L, where the two lines
 * would meet, the force is 0.975 L. The slope is continuous at both ends, and a difference of width e is off by e /
 * (0.4 L). */
KT_TEST(servo_is_linear_up_to_its_limit_and_never_beyond) {
    kt_effect_record r = {
        .type = KT_EFFECT_SERVO, .stiffness = 1.0, .limit = 3.0, .lower = -INFINITY, .upper = INFINITY};
    const kt_effect_kind *kind = kt_effect_kinds[KT_EFFECT_SERVO];
    const double e = 1e-6;
    kt_random random = kt_random_of_test();
    int wrong = 0;
    for (int n = 0; n < 10000; n++) {
        const double u = kt_random_uniform(&random, -6.0, 6.0);
        const double force = kind->joint_force(&r, NULL, -u, 0.0, 0.0, NULL);
        wrong += fabs(u) <= 2.7 ? force != u : fabs(u) >= 3.3 ? force != copysign(3.0, u) : !(fabs(force) < 3.0);
    }
    kt_check_equal_int("not linear, or beyond the limit", wrong, 0);
    kt_check_near("at the limit", kind->joint_force(&r, NULL, -3.0, 0.0, 0.0, NULL), 3.0 * 0.975, 2.0 * DBL_EPSILON);
    for (int side = -1; side <= 1; side += 2)
        for (int k = 0; k < 2; k++) {
            const double u = side * (k ? 3.3 : 2.7);
            const double above = kind->joint_force(&r, NULL, -(u + e), 0.0, 0.0, NULL);
            const double below = kind->joint_force(&r, NULL, -(u - e), 0.0, 0.0, NULL);
            kt_check_near(k ? "flat at 1.1 L" : "slope 1 at 0.9 L", (above - below) / (2.0 * e), k ? 0.0 : 1.0,
                          e / (0.4 * 3.0));
        }
}

/* The clamp of u by bounds that differ, to the bit, and the derivative that follows: the gain between them or zero. */
KT_TEST(servo_with_hard_bounds_is_the_clamp_of_its_linear_force) {
    kt_effect_record r = {
        .type = KT_EFFECT_SERVO, .stiffness = 2.0, .damping = 0.5, .limit = INFINITY, .lower = -1.0, .upper = 2.5};
    const kt_effect_kind *kind = kt_effect_kinds[KT_EFFECT_SERVO];
    kt_random random = kt_random_of_test();
    int wrong = 0, clamped = 0;
    for (int n = 0; n < 10000; n++) {
        const double q = kt_random_uniform(&random, -3.0, 3.0), v = kt_random_uniform(&random, -3.0, 3.0);
        const double u = 2.0 * (0.0 - q) + 0.5 * (0.0 - v), bounded = fmin(fmax(u, r.lower), r.upper);
        double derivative[2];
        kind->joint_derivatives(&r, NULL, q, v, 0.0, derivative);
        wrong += !(kind->joint_force(&r, NULL, q, v, 0.0, NULL) == bounded);
        wrong += !(derivative[0] == (bounded == u ? -2.0 : 0.0) && derivative[1] == (bounded == u ? -0.5 : 0.0));
        clamped += bounded != u;
    }
    kt_check_equal_int("forces or derivatives that are not those of the clamp", wrong, 0);
    kt_check_above("at a bound", clamped, 3000.0);
    kt_check_true("what is not a number is not hidden",
                  !isfinite(kind->joint_force(&r, NULL, (double)NAN, 0.0, 0.0, NULL)));
}

/* The motor of a spring's rest position supplies force v + dissipated + dV/dt, for any motion. */
KT_TEST(moving_rest_position_supplies_its_share) {
    kt_effect_record r = {.type = KT_EFFECT_JOINT_SPRING, .stiffness = 1.3, .damping = 0.4};
    const kt_function rest = kt_function_sine(0.7, 0.5, 1.8, 0.1);
    const kt_effect_kind *kind = kt_effect_kinds[KT_EFFECT_JOINT_SPRING];
    const double q = 0.8, v = -0.6, t = 0.45, e = 1e-5;
    kt_effect_balance before, at, after;
    r.curve[0] = kt_curve_compile(&rest, NULL, 0);
    const double force = kind->joint_force(&r, NULL, q, v, t, &at);
    (void)kind->joint_force(&r, NULL, q - e * v, v, t - e, &before);
    (void)kind->joint_force(&r, NULL, q + e * v, v, t + e, &after);
    kt_check_above("supplied", fabs(at.supplied), 0.1);
    kt_check_near("power", at.supplied - at.dissipated - (after.energy - before.energy) / (2.0 * e), force * v, 1e-9);
}

/* Under a load of half the friction a joint creeps at v0 artanh(1 / 2), and not faster. */
KT_TEST(loads_below_friction_creep_as_slowly_as_smoothing_says) {
    kt_lone lone;
    kt_effect effects[2] = {kt_effect_default(), kt_effect_default()};
    kt_run run = kt_run_default();
    kt_error error;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 2.0);
    effects[0].type = KT_EFFECT_JOINT_FRICTION;
    effects[1].type = KT_EFFECT_MOTOR;
    effects[0].joint = effects[1].joint = lone.body.name;
    effects[0].coulomb = 4.0;
    effects[1].torque = kt_function_constant(2.0);
    lone.description.bodies = &lone.body;
    lone.description.effects = effects;
    lone.description.effect_count = 2;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_need_fine("advance", kt_simulation_advance(simulation, 1.0, &error), &error);
    kt_check_near("speed", kt_simulation_velocities(simulation)[0], 1e-3 * atanh(0.5), 1e-10);
}
