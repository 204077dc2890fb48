/* Motions under effects against closed forms: oscillators, impacts, a braked wheel, two bodies that attract each other.
 *
 * All run with dop853 at tight tolerances. Bounds are three times the errors measured when the test was written, unless
 * a comment derives them.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "motion/simulation/scenes.h"

#include <float.h>
#include <math.h>

#define COUNT_OF(array) ((int)(sizeof(array) / sizeof(array)[0]))
static const double pi = 3.14159265358979323846;

/* ---- running ----------------------------------------------------------------------------------------------------- */

/* A body on a joint, with effects. */
typedef struct rig {
    kt_lone lone;
    kt_effect effects[2];
    kt_model *model;
    kt_simulation *simulation;
} rig;

static void rig_make(rig *r, kt_joint_type type, double mass) {
    kt_lone_make(&r->lone, type, mass);
    r->effects[0] = r->effects[1] = kt_effect_default();
    r->lone.description.effects = r->effects;
    r->lone.description.effect_count = 1;
    r->effects[0].joint = r->effects[1].joint = r->lone.body.name;
}

static void rig_start(rig *r, double tolerance) {
    kt_run run = kt_run_default();
    run.integrator = "dop853";
    run.relative = tolerance;
    run.absolute = 1e-3 * tolerance;
    r->lone.description.bodies = &r->lone.body;
    r->model = kt_scene_compile(&r->lone.description);
    r->simulation = kt_test_simulation(r->model, &run, NULL);
}

static double rig_at(rig *r, double t, double *velocity) {
    if (t > kt_simulation_time(r->simulation))
        kt_test_advance(r->simulation, t);
    if (velocity)
        *velocity = kt_simulation_velocities(r->simulation)[0];
    return kt_simulation_positions(r->simulation)[0];
}

/* ---- oscillators ------------------------------------------------------------------------------------------------- */

/* x(t) of m x'' + c x' + k x = 0, x(0) = x0, x'(0) = 0, weakly damped. */
static double oscillator(double m, double c, double k, double x0, double t) {
    const double decay = 0.5 * c / m, rate = sqrt(k / m - decay * decay);
    return x0 * exp(-decay * t) * (cos(rate * t) + decay / rate * sin(rate * t));
}

static void follow_oscillator(const char *what, rig *r, double middle, double m, double c, double k, double bound) {
    const double x0 = r->lone.body.joint.position[0] - middle;
    KT_WORST worst = kt_worst_make(what);
    rig_start(r, 1e-12);
    for (int i = 1; i <= 40; i++)
        kt_worst_near(&worst, rig_at(r, 0.25 * i, NULL) - middle, oscillator(m, c, k, x0, 0.25 * i), bound, "t = %g",
                      0.25 * i);
}

/* The spring of a mass on a slide is between the mass and the world, or in the joint. A wheel has a torsion spring. The
 * damping is the spring's damper, or the joint's friction. */
KT_TEST(damped_oscillators_follow_their_closed_form) {
    rig r;
    rig_make(&r, KT_JOINT_PRISMATIC, 2.0);
    r.lone.body.joint.position[0] = 1.5;
    r.effects[0].type = KT_EFFECT_SPRING;
    r.effects[0].between[0] = r.effects[0].between[1] = kt_end_default();
    r.effects[0].between[0].at = kt_vec3_make(-3.0, 0.0, 0.0);
    r.effects[0].between[1].body = r.lone.body.name;
    r.effects[0].length = 4.0;
    r.effects[0].stiffness = 50.0;
    r.effects[0].damping = 0.8;
    follow_oscillator("spring and damper", &r, 1.0, 2.0, 0.8, 50.0, 6e-13);
    rig_make(&r, KT_JOINT_PRISMATIC, 2.0);
    r.lone.body.joint.position[0] = 1.5;
    r.effects[0].type = KT_EFFECT_JOINT_SPRING;
    r.effects[0].stiffness = 50.0;
    r.effects[0].rest = kt_function_constant(1.0);
    r.effects[0].damping = 0.8;
    follow_oscillator("spring in the joint", &r, 1.0, 2.0, 0.8, 50.0, 6e-13);
    rig_make(&r, KT_JOINT_REVOLUTE, 2.0); /* inertia 3 about z */
    r.lone.body.joint.position[0] = 2.5;
    r.lone.description.effect_count = 2;
    r.effects[0].type = KT_EFFECT_JOINT_SPRING;
    r.effects[0].stiffness = 50.0;
    r.effects[1].type = KT_EFFECT_JOINT_FRICTION;
    r.effects[1].viscous = 0.8;
    follow_oscillator("torsion, viscous friction", &r, 0.0, 3.0, 0.8, 50.0, 2e-12);
}

/* A mass m that a spring k and a damper c pull to a target A sin(w t). In complex numbers the forced motion is A H
 * e^(iwt), with H = (k + i w c') / (k - m w^2 + i w c). For a servo, whose damper moves with the target, c' = c. For a
 * spring with a moving rest position, c' = 0. Started on it, the mass stays on it. */
static void follow_target(const char *what, bool servo) {
    const double m = 2.0, k = 50.0, c = 0.8, w = 3.0, amplitude = 0.4;
    const double free = k - m * w * w, lag = w * c, lead = servo ? lag : 0.0, size = free * free + lag * lag;
    const double re = (k * free + lead * lag) / size, im = (lead * free - k * lag) / size; /* of H */
    const kt_function target = kt_function_sine(amplitude, w / (2.0 * pi), 0.0, 0.0);
    KT_WORST worst = kt_worst_make(what);
    rig r;
    rig_make(&r, KT_JOINT_PRISMATIC, m);
    r.lone.body.joint.position[0] = amplitude * im;
    r.lone.body.joint.velocity[0] = amplitude * w * re;
    r.effects[0].type = servo ? KT_EFFECT_SERVO : KT_EFFECT_JOINT_SPRING;
    r.effects[0].rest = r.effects[0].target = target;
    r.effects[0].stiffness = k;
    r.effects[0].damping = c;
    rig_start(&r, 1e-12);
    for (int i = 1; i <= 40; i++)
        kt_worst_near(&worst, rig_at(&r, 0.25 * i, NULL), amplitude * (re * sin(w * 0.25 * i) + im * cos(w * 0.25 * i)),
                      3e-13, "t = %g", 0.25 * i);
}

KT_TEST(moving_targets_force_the_motion_of_their_transfer_function) {
    follow_target("servo", true);
    follow_target("rest position", false);
}

/* Far from its target a servo pulls with its limit, at a distance as with none. */
KT_TEST(servo_pulls_with_its_limit_from_afar) {
    rig r;
    rig_make(&r, KT_JOINT_PRISMATIC, 2.0);
    r.effects[0].type = KT_EFFECT_SERVO;
    r.effects[0].target = kt_function_constant(-100.0);
    r.effects[0].stiffness = 50.0;
    r.effects[0].limit = 6.0;
    rig_start(&r, 1e-12);
    kt_check_near("L t^2 / 2 m", rig_at(&r, 2.0, NULL), -6.0, 1e-13);
}

/* The same along and about each axis of a bushing, one at a time, between the world and a free body. */
KT_TEST(bushings_are_six_oscillators) {
    static const double inertia[6] = {2.0, 2.0, 2.0, 1.0, 2.0, 3.0};
    for (int axis = 0; axis < 6; axis++) {
        rig r;
        KT_WORST worst = kt_worst_make("axis");
        rig_make(&r, KT_JOINT_FREE, 2.0);
        r.effects[0].type = KT_EFFECT_BUSHING;
        r.effects[0].between[0] = r.effects[0].between[1] = kt_end_default();
        r.effects[0].between[1].body = r.lone.body.name;
        for (int i = 0; i < 6; i++) {
            r.effects[0].stiffnesses[i] = 20.0 + 10.0 * i;
            r.effects[0].dampings[i] = 0.1 + 0.2 * i;
        }
        r.lone.body.joint.position[3] = 1.0;
        if (axis < 3) {
            r.lone.body.joint.position[axis] = 0.7;
        } else {
            r.lone.body.joint.position[3] = cos(0.35);
            r.lone.body.joint.position[1 + axis] = sin(0.35);
        }
        rig_start(&r, 1e-12);
        for (int i = 1; i <= 20; i++) {
            (void)rig_at(&r, 0.25 * i, NULL);
            const double *q = kt_simulation_positions(r.simulation);
            const double x = axis < 3 ? q[axis] : 2.0 * atan2(q[1 + axis], q[3]);
            kt_worst_near(&worst, x, oscillator(inertia[axis], 0.1 + 0.2 * axis, 20.0 + 10.0 * axis, 0.7, 0.25 * i),
                          3e-11, "axis %d, t = %g", axis, 0.25 * i);
        }
    }
}

/* The swing of 1e-5 rad is small. The sine's curvature, a relative 1e-11 w t / 16, is below the bound. */
KT_TEST(viscous_pendulum_dies_away_as_it_should) {
    rig r;
    KT_WORST worst = kt_worst_make("angle / 1e-5 rad");
    rig_make(&r, KT_JOINT_REVOLUTE, 1.0);
    kt_pendulum_make(&r.lone, 1e-5, 0.0);
    r.lone.description.effects = r.effects;
    r.lone.description.effect_count = 1;
    r.effects[0].type = KT_EFFECT_JOINT_DAMPER;
    r.effects[0].joint = r.lone.body.name;
    r.effects[0].damping = 0.5;
    rig_start(&r, 1e-13);
    for (int i = 1; i <= 40; i++)
        kt_worst_near(&worst, rig_at(&r, 0.25 * i, NULL) / 1e-5, oscillator(1.0, 0.5, 9.81, 1.0, 0.25 * i), 5e-11,
                      "t = %g", 0.25 * i);
}

/* ---- impacts ----------------------------------------------------------------------------------------------------- */

/* A ball of 0.1 m and 2 kg is on a vertical slide. Its height is 0.2 m above a plane through the origin. */
static void ball_make(rig *r, double stiffness, double exponent, double dissipation) {
    rig_make(r, KT_JOINT_PRISMATIC, 2.0);
    r->lone.body.joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
    r->lone.body.joint.position[0] = 0.3;
    r->effects[0].type = KT_EFFECT_CONTACT;
    r->effects[0].between[0] = r->effects[0].between[1] = kt_end_default();
    r->effects[0].between[0].body = r->lone.body.name;
    r->effects[0].radius = 0.1;
    r->effects[0].stiffness = stiffness;
    r->effects[0].exponent = exponent;
    r->effects[0].dissipation = dissipation;
}

/* The motion is without gravity: m x'' = -k x^p, with x' = v at x = 0, and s = p + 1. The ball goes
 * d = (s m v^2 / (2 k))^(1/s) deep. Its contact lasts 2 int_0^d dx / (v sqrt(1 - (x / d)^s)) = 2 d / v B(1 / s, 1 / 2)
 * / s. For p = 3/2, this is 2.943 d / v (Hertz 1882). */
KT_TEST(hertz_contact_lasts_as_long_as_it_should) {
    static const double exponents[] = {1.0, 1.5, 2.0, 3.0};
    const double m = 2.0, v = 2.0, k = 1e5;
    for (int i = 0; i < COUNT_OF(exponents); i++) {
        const double s = exponents[i] + 1.0, d = pow(s * m * v * v / (2.0 * k), 1.0 / s);
        const double beta = tgamma(1.0 / s) * sqrt(pi) / tgamma(1.0 / s + 0.5);
        rig r;
        double speed = 0.0;
        ball_make(&r, k, exponents[i], 0.0);
        r.lone.body.joint.velocity[0] = -v;
        rig_start(&r, 1e-12);
        const double z = rig_at(&r, 0.5, &speed);
        const double lasted = 0.5 - 0.2 / v - (z - 0.1) / v;
        kt_note("exponent %g: %g m deep", exponents[i], d);
        kt_check_near("duration / (2 d / v)", lasted / (2.0 * d / v), beta / s, 1.3e-9);
        kt_check_near("speed afterwards", speed, v, 2e-10);
    }
    kt_check_near("of Hertz", 2.0 * tgamma(0.4) * sqrt(pi) / tgamma(0.9) / 2.5, 2.9432, 1e-4);
}

/* For any exponent, with a = 3/2 c: v dv / (1 + a v) = -(k / m) x^p dx. Therefore v / a - log(1 + a v) / a^2 is the
 * same at impact (v) and afterwards (-u). */
static double rebound(double a, double v) {
    const double before = v / a - log1p(a * v) / (a * a);
    double u = v / (1.0 + a * v);
    for (int i = 0; i < 50; i++) {
        const double gap = -u / a - log1p(-a * u) / (a * a) - before;
        u -= gap * (1.0 - a * u) / u;
    }
    return u;
}

KT_TEST(dissipating_impacts_come_back_as_slow_as_they_should) {
    static const double speeds[] = {0.1, 1.0, 4.0}, exponents[] = {1.0, 1.5, 3.0};
    const double c = 0.15;
    for (int i = 0; i < COUNT_OF(speeds); i++)
        for (int j = 0; j < COUNT_OF(exponents); j++) {
            rig r;
            double speed = 0.0;
            ball_make(&r, 1e5, exponents[j], c);
            r.lone.body.joint.velocity[0] = -speeds[i];
            rig_start(&r, 1e-12);
            (void)rig_at(&r, 0.4 / speeds[i] + 0.5, &speed);
            kt_check_near("speed afterwards / before", speed / speeds[i], rebound(1.5 * c, speeds[i]) / speeds[i],
                          2e-9);
        }
    kt_check_near("slow impacts: 1 - c v", rebound(1.5 * c, 1e-3) / 1e-3, 1.0 - c * 1e-3, c * c * 1e-6);
}

/* Under gravity an elastic ball rises to where it was let go, again and again: z + v^2 / (2 g) in flight. With
 * dissipation, each apex h is lower by e^2, the square of the ratio of speeds. Gravity's work during contact is at most
 * d / h of the kinetic energy for a ball that goes d deep. It makes the ball faster and its way longer by less than
 * that. The loss (1 - e^2) h is therefore uncertain by 2 (1 - e^2) d. */
static void bounce(rig *r, double stiffness, double dissipation, double bound, int least) {
    const double g = 9.81, a = 1.5 * dissipation;
    int bounces = 0;
    double expected = 0.2, before = 0.0, speed = 0.0, uncertain = bound;
    KT_WORST apex = kt_worst_make(dissipation > 0.0 ? "apex, with dissipation" : "apex");
    ball_make(r, stiffness, 1.5, dissipation);
    r->lone.description.gravity = kt_vec3_make(0.0, 0.0, -g);
    rig_start(r, 1e-12);
    for (int i = 1; i <= 400; i++) {
        const double z = rig_at(r, 0.005 * i, &speed) - 0.1;
        if (z > 0.0 && speed > 0.0 && before <= 0.0) {
            const double fast = sqrt(2.0 * g * expected), ratio = a > 0.0 ? rebound(a, fast) / fast : 1.0;
            uncertain += 2.0 * (1.0 - ratio * ratio) * pow(2.5 * fast * fast / stiffness, 0.4);
            expected *= ratio * ratio;
            kt_worst_near(&apex, z + 0.5 * speed * speed / g, expected, uncertain, "bounce %d", ++bounces);
        }
        if (z > 0.0)
            before = speed;
    }
    kt_check_above("bounces", bounces, least);
}

KT_TEST(bouncing_ball_rises_to_its_apexes) {
    rig r;
    bounce(&r, 1e5, 0.0, 3e-10, 4);
    bounce(&r, 1e8, 0.1, 0.0, 5);
}

/* ---- friction ---------------------------------------------------------------------------------------------------- */

/* J w' = -C tanh(w / v0):  sinh(w / v0) = sinh(w0 / v0) exp(-C t / (J v0)). */
static double braked(double w0, double v0, double rate, double t) {
    const double log_sinh = w0 / v0 + log1p(-exp(-2.0 * w0 / v0)) - log(2.0) - rate * t / v0;
    return log_sinh > 30.0 ? v0 * (log_sinh + log(2.0)) : v0 * asinh(exp(log_sinh));
}

/* Dry friction stops the wheel with J = 3, C = 6, w0 = 5. It stops after J w0 / C = 2.5 s. Its angle is then J w0^2 /
 * (2 C) = 6.25 rad. Smoothed, it still turns at v0 asinh(1 / 2) then, and comes to rest further by
 *     (J / C) int w (coth(w / v0) - 1) dw = pi^2 / 12 J v0^2 / C:
 * the errors are proportional to v0, and to its square. */
KT_TEST(braked_wheel_stops_where_dry_friction_stops_it) {
    static const double smoothings[] = {0.1, 0.01, 0.001};
    for (int i = 0; i < COUNT_OF(smoothings); i++) {
        const double v0 = smoothings[i];
        rig r;
        double speed = 0.0;
        KT_WORST rate = kt_worst_make("rate");
        rig_make(&r, KT_JOINT_REVOLUTE, 1.0);
        r.lone.body.joint.velocity[0] = 5.0;
        r.effects[0].type = KT_EFFECT_JOINT_FRICTION;
        r.effects[0].coulomb = 6.0;
        r.effects[0].smoothing = v0;
        rig_start(&r, 1e-12);
        for (int k = 1; k <= 25; k++) {
            (void)rig_at(&r, 0.1 * k, &speed);
            kt_worst_near(&rate, speed, braked(5.0, v0, 2.0, 0.1 * k), 1e-13, "t = %g", 0.1 * k);
        }
        kt_check_near("rate when it should stop / smoothing", speed / v0, asinh(0.5), 6e-13);
        const double angle = rig_at(&r, 2.5 + 20.0 * v0, &speed);
        kt_check_near("angle beyond dry friction's / smoothing^2", (angle - 6.25) / (v0 * v0), pi * pi / 24.0,
                      2e-12 + 40.0 * DBL_EPSILON / (v0 * v0));
    }
}

/* The curve of force against speed, at its marks: S at rest, C and the viscous part far above. */
KT_TEST(friction_has_its_stribeck_curve) {
    rig r;
    double a = 0.0;
    kt_error error;
    static const double speeds[] = {1e-4, 0.02, 0.05, 3.0};
    for (int i = 0; i < COUNT_OF(speeds); i++) {
        const double v = speeds[i];
        rig_make(&r, KT_JOINT_PRISMATIC, 2.0);
        r.lone.body.joint.velocity[0] = -v;
        r.effects[0].type = KT_EFFECT_JOINT_FRICTION;
        r.effects[0].coulomb = 3.0;
        r.effects[0].breakaway = 5.0;
        r.effects[0].viscous = 0.25;
        r.effects[0].stribeck = 0.05;
        rig_start(&r, 1e-9);
        (void)kt_fine("acceleration", kt_simulation_acceleration(r.simulation, &a, &error), &error);
        const double by_hand = v == 3.0    ? 3.75
                               : v == 0.05 ? 3.0 + 2.0 * 0.36787944117144233 + 0.0125
                               : v == 0.02 ? 3.0 + 2.0 * 0.85214378896621135 + 0.005
                                           : 4.999992000016 * 0.099667994624955819 + 2.5e-5;
        kt_check_near("force", 2.0 * a, by_hand, 8.0 * DBL_EPSILON * by_hand);
    }
}

/* ---- a stop ------------------------------------------------------------------------------------------------------ */

/* Without damping a slide bounces off its stop after half a period of mass and stiffness, as fast as it came. */
KT_TEST(stop_returns_a_slide_after_half_a_period) {
    for (int side = -1; side <= 1; side += 2) {
        rig r;
        double speed = 0.0;
        rig_make(&r, KT_JOINT_PRISMATIC, 2.0);
        r.lone.body.joint.velocity[0] = side * 3.0;
        r.effects[0].type = KT_EFFECT_JOINT_LIMIT;
        r.effects[0].lower = -0.6;
        r.effects[0].upper = 0.6;
        r.effects[0].stiffness = 5000.0;
        rig_start(&r, 1e-12);
        const double x = rig_at(&r, 0.3, &speed);
        kt_check_near("speed", speed, -side * 3.0, 1e-10);
        kt_check_near("position", side * x, 0.6 - 3.0 * (0.3 - 0.2 - pi * sqrt(2.0 / 5000.0)), 1e-10);
    }
}

/* ---- attraction -------------------------------------------------------------------------------------------------- */

/* Two bodies of 2 and 3 kg start at the pericentre of an ellipse. Its half axis is 1, and its eccentricity is 0.6, so
 * the pericentre is at 0.4. With the reduced mass mu they are back after T = 2 pi sqrt(mu a^3 / S). After ten turns, a
 * difference along the path is an error of time. */
KT_TEST(attracting_bodies_keep_kepler_s_period) {
    const double mu = 1.2, s = 7.0, period = 2.0 * pi * sqrt(mu / s);
    const double fast = sqrt(s / mu * 1.6 / 0.4); /* vis viva: v^2 = S / mu (2 / r - 1 / a) */
    kt_lone one, two;
    kt_lone_make(&one, KT_JOINT_FREE, 2.0);
    kt_lone_make(&two, KT_JOINT_FREE, 3.0);
    kt_body bodies[2] = {one.body, two.body};
    bodies[0].name = "one";
    bodies[1].name = "two";
    bodies[0].joint.position[0] = -0.24;
    bodies[1].joint.position[0] = 0.16;
    bodies[0].joint.velocity[1] = -0.6 * fast;
    bodies[1].joint.velocity[1] = 0.4 * fast;
    kt_effect pull = kt_effect_of(KT_EFFECT_ATTRACTION, NULL);
    pull.between[0].body = "one";
    pull.between[1].body = "two";
    pull.strength = s;
    one.description.bodies = bodies;
    one.description.body_count = 2;
    one.description.effects = &pull;
    one.description.effect_count = 1;
    kt_run run = kt_run_default();
    run.integrator = "dop853";
    run.relative = run.absolute = 1e-14;
    kt_error error;
    kt_model *model = kt_scene_compile(&one.description);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_need_fine("orbits", kt_simulation_advance(simulation, 10.0 * period, &error), &error);
    const double *q = kt_simulation_positions(simulation), *v = kt_simulation_velocities(simulation);
    const double x = q[7] - q[0], y = q[8] - q[1], late = -y / (v[7] - v[1]);
    kt_check_below("period's relative error", fabs(late) / (10.0 * period), 1e-12);
    kt_check_near("pericentre", x, 0.4, 3e-13);
}
