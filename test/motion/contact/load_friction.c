/* Friction of joints that is proportional to a reaction, against closed forms: a crane's drum, Atwood's machine with a
 * rubbing axle, a block on an incline, a screw jack, a planetary train with losses in its meshes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/dynamics.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "check.h"
#include "evaluate/load_friction.h"
#include "model/model.h"
#include "motion/simulation/parsed.h"
#include "random.h"

static const double g = 9.81;

static kt_simulation *start_scene(kt_parsed *m, const char *text, const char *method, double step) {
    kt_simulation_options options = kt_simulation_options_default();
    kt_run run = kt_run_fixed(method, step, 100.0);
    run.relative = run.absolute = 1e-11;
    options.record = KT_RECORD_BALANCE;
    kt_parsed_make(m, text);
    return kt_test_simulation(m->model, &run, &options);
}

static void accelerate(const char *text, double *a) {
    kt_parsed m;
    kt_error error = {0};
    kt_simulation *simulation = start_scene(&m, text, "dopri5", 0.0);
    kt_need_fine("acceleration", kt_simulation_acceleration(simulation, a, &error), &error);
}

/* ---- a drum ------------------------------------------------------------------------------------------------------ */

/* A drum of M = 20 kg, R = 0.2 m, on a journal of r = 0.04 m with mu = 0.3, lifts m = 50 kg on a rope. */
static const double drum_mass = 20.0, drum_radius = 0.2, journal = 0.04, mu = 0.3, load_mass = 50.0, inertia = 0.5;

static void print_drum(char *text, size_t size, const char *torque, double speed, const char *more) {
    (void)snprintf(
        text, size,
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
        "  - {name: drum, joint: {type: revolute, axis: y, velocity: %.17g}, mass: 20, inertia: [1, 0.5, 1]}\n"
        "  - {name: load, joint: {type: prismatic, axis: z, at: [0.2, 0, -3]}, mass: 50}\n"
        "loops:\n"
        "  - {name: rope, type: span, between: [drum, load], axis: y, radius: -0.2}\n"
        "effects:\n"
        "  - {name: motor, type: motor, joint: drum, torque: %s}\n"
        "  - {name: journal, type: joint_friction, joint: drum, coefficient: 0.3, radius: 0.04%s}\n"
        "initial: {hold: [drum]}\n",
        speed, torque, more);
}

/* With the acceleration a upwards, the rope has m (g + a), and the journal carries M g + m (g + a):
 *     J a / R = T - m (g + a) R -+ mu r (M g + m (g + a)),   - while the load rises */
static double acceleration_of_drum(double torque, double sign) {
    const double arm = drum_radius + sign * mu * journal;
    return (torque - load_mass * g * arm - sign * mu * journal * drum_mass * g) /
           (inertia / drum_radius + load_mass * arm);
}

KT_TEST(journal_of_a_drum_rubs_under_drum_and_rope) {
    static const double torques[] = {0.0, 60.0, 120.0, 200.0};
    KT_WORST error = kt_worst_make("acceleration of the load, over g");
    for (int k = 0; k < 8; k++) {
        const double rises = k % 2 ? 1.0 : -1.0, torque = torques[k / 2];
        char text[1024];
        double a[2];
        /* the drum turns about y: a positive angle lets the load at x = R sink */
        char number[32];
        (void)snprintf(number, sizeof number, "%.17g", -torque);
        print_drum(text, sizeof text, number, -rises * 2.0, ", smoothing: 1e-6");
        accelerate(text, a);
        kt_worst_near(&error, a[1] / g, acceleration_of_drum(torque, rises) / g, 1e-13, "torque %g, side %g", torque,
                      rises);
        kt_worst_near(&error, -drum_radius * a[0] / g, a[1] / g, 1e-13, "drum, torque %g, side %g", torque, rises);
    }
}

/* The torque grows by 40 N m / s. The drum holds until T = (m R + mu r (M + m)) g, and then lifts. */
KT_TEST(drum_holds_until_the_torque_overcomes_its_journal) {
    const double begins = (load_mass * drum_radius + mu * journal * (drum_mass + load_mass)) * g / 40.0;
    static const char *const methods[] = {"dopri5", "radau5"};
    for (int k = 0; k < 2; k++) {
        char text[1400];
        kt_parsed m;
        print_drum(text, sizeof text, "{polynomial: [-92, -40]}", 0.0, ", stick: true");
        kt_note("%s", methods[k]);
        kt_simulation *simulation = start_scene(&m, text, methods[k], 0.0);
        kt_test_advance(simulation, begins - 2.3 - 1e-7);
        kt_check_near("speed before", kt_simulation_velocities(simulation)[1], 0.0, 0.0);
        kt_test_advance(simulation, begins - 2.3 + 0.5);
        /* a = 40 (t - t0) / (J / R + m (R + mu r)) */
        const double a = 40.0 / (inertia / drum_radius + load_mass * (drum_radius + mu * journal));
        kt_check_near("speed half a second later, m/s", kt_simulation_velocities(simulation)[1], 0.5 * a * 0.25, 1e-13);
        kt_check_equal_int("slips", (int)kt_simulation_contacts(simulation).slips, 1);
    }
}

/* A rope from a drum over a pulley, both on rubbing journals. The drum holds until both journals are at their limits:
 *     (S1 - S2) R = mu r |S1 u + (0, -S2 - m g)|,   T = S1 R + mu r |S1 u + (0, -M g)|,   S2 = 50 g
 * with u = (2, 3) / sqrt(13) from the drum to the pulley. */
static double force_of_bearing(double first, double down) {
    return hypot(first * 2.0 / sqrt(13.0), first * 3.0 / sqrt(13.0) - down);
}

static double torque_of_two_journals(void) {
    const double R = 0.1, arm = 0.3 * 0.02, second = 50.0 * g;
    double first = second;
    for (int i = 0; i < 200; i++) /* a contraction */
        first = second + arm / R * force_of_bearing(-first, second + 2.0 * g);
    return first * R + arm * force_of_bearing(first, 20.0 * g);
}

KT_TEST(two_journals_hold_one_rope_together) {
    const double begins = (torque_of_two_journals() - 49.05) / 4.0;
    static const char text[] =
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
        "  - {name: drum, joint: {type: revolute, axis: y}, mass: 20, inertia: [1, 0.5, 1]}\n"
        "  - {name: pulley, joint: {type: revolute, axis: y, at: [2, 0, 3]}, mass: 2, inertia: [1, 0.01, 1]}\n"
        "  - {name: load, joint: {type: prismatic, axis: z, at: [2.1, 0, 0]}, mass: 50}\n"
        "loops:\n"
        "  - {name: up, type: span, between: [drum, pulley], axis: y, radius: -0.1, radius2: -0.1}\n"
        "  - {name: down, type: span, between: [pulley, load], axis: y, radius: -0.1}\n"
        "effects:\n"
        "  - {type: motor, joint: drum, torque: {polynomial: [-49.05, -4]}}\n"
        "  - {name: first, type: joint_friction, joint: drum, coefficient: 0.3, radius: 0.02, stick: true}\n"
        "  - {name: second, type: joint_friction, joint: pulley, coefficient: 0.3, radius: 0.02, stick: true}\n";
    kt_parsed m;
    kt_simulation *simulation = start_scene(&m, text, "dopri5", 0.0);
    kt_test_advance(simulation, begins - 1e-6);
    kt_check_near("speed before, m/s", kt_simulation_velocities(simulation)[2], 0.0, 1e-12);
    kt_test_advance(simulation, begins + 0.1);
    kt_check_above("speed after, m/s", kt_simulation_velocities(simulation)[2], 1e-3);
}

/* ---- Atwood ------------------------------------------------------------------------------------------------------ */

/* A pulley of M = 3 kg, J = 0.02 kg m^2, R = 0.1 m, on an axle of r = 0.02 m with mu = 0.4. */
static void print_atwood(char *text, size_t size, double heavy, double light) {
    (void)snprintf(
        text, size,
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
        "  - {name: pulley, joint: {type: revolute, axis: y}, mass: 3, inertia: [0.02, 0.02, 0.02]}\n"
        "  - {name: heavy, joint: {type: prismatic, axis: z, at: [0.1, 0, -2]}, mass: %.17g}\n"
        "  - {name: light, joint: {type: prismatic, axis: z, at: [-0.1, 0, -2]}, mass: %.17g}\n"
        "loops:\n"
        "  - {name: right, type: span, between: [pulley, heavy], axis: y, radius: -0.1}\n"
        "  - {name: left, type: span, between: [pulley, light], axis: y, radius: 0.1}\n"
        "effects:\n"
        "  - {name: axle, type: joint_friction, joint: pulley, coefficient: 0.4, radius: 0.02, stick: true}\n",
        heavy, light);
}

/* With the ropes m1 (g - a) and m2 (g + a) and the axle's force M g + both,
 *     J a / R = (m1 - m2) g R - (m1 + m2) a R - mu r ((M + m1 + m2) g - (m1 - m2) a) */
static double acceleration_of_atwood(double heavy, double light) {
    const double R = 0.1, arm = 0.4 * 0.02, J = 0.02, all = heavy + light, apart = heavy - light;
    const double moves = apart * g * R - arm * (3.0 + all) * g;
    return moves > 0.0 ? moves / (J / R + all * R - arm * apart) : 0.0;
}

KT_TEST(atwood_sticks_or_falls_on_a_rubbing_axle) {
    KT_WORST error = kt_worst_make("speed after 0.5 s");
    /* sticks while (m1 - m2) R <= mu r (M + m1 + m2): here up to m1 = 5.782608... */
    static const double heavy[] = {5.0, 5.5, 5.7826, 5.7827, 6.0, 8.0, 20.0};
    for (size_t k = 0; k < sizeof heavy / sizeof *heavy; k++) {
        char text[1200];
        kt_parsed m;
        print_atwood(text, sizeof text, heavy[k], 4.6478260869565217);
        const double a = acceleration_of_atwood(heavy[k], 4.6478260869565217);
        kt_simulation *simulation = start_scene(&m, text, "dopri5", 0.0);
        kt_test_advance(simulation, 0.5);
        kt_worst_near(&error, kt_simulation_velocities(simulation)[1], -0.5 * a, 1e-13, "%g kg", heavy[k]);
        kt_check_equal_int("sticks", (int)kt_simulation_contacts(simulation).sticks, a == 0.0);
    }
}

/* ---- an incline -------------------------------------------------------------------------------------------------- */

/* A block slides up an incline, stops after v / (sin + mu cos) g, and stays or slides back. */
KT_TEST(block_on_an_incline_stays_below_the_angle_of_friction) {
    static const double slopes[] = {0.1, 0.29, 0.31, 1.0};
    for (int k = 0; k < 4; k++) {
        char text[600];
        kt_parsed m;
        const double c = 1.0 / sqrt(1.0 + slopes[k] * slopes[k]), s = slopes[k] * c, v = 2.0;
        (void)snprintf(text, sizeof text,
                       "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                       "  - {name: block, joint: {type: prismatic, axis: [1, 0, %.17g], velocity: %.17g}, mass: 7}\n"
                       "effects:\n"
                       "  - {type: joint_friction, joint: block, coefficient: 0.3, stick: true}\n",
                       slopes[k], v);
        const double up = g * (s + 0.3 * c), down = slopes[k] > 0.3 ? g * (s - 0.3 * c) : 0.0, stop = v / up;
        kt_note("slope %g", slopes[k]);
        kt_simulation *simulation = start_scene(&m, text, "dopri5", 0.0);
        kt_test_advance(simulation, 0.5 * stop);
        kt_check_near("speed half way, m/s", kt_simulation_velocities(simulation)[0], 0.5 * v, 1e-14);
        kt_test_advance(simulation, stop + 0.5);
        kt_check_near("speed later, m/s", kt_simulation_velocities(simulation)[0], -0.5 * down, 1e-13);
        kt_check_near("place, m", kt_simulation_positions(simulation)[0], 0.5 * v * stop - 0.125 * down, 1e-13);
    }
}

/* ---- a screw jack ------------------------------------------------------------------------------------------------ */

/* A nut of 100 kg on a thread of r = 0.02 m with a lead angle of tan = 0.1, turned by a torque. */
static void print_jack(char *text, size_t size, double coefficient, double inertia_of_nut, double torque, double speed,
                       const char *sticks) {
    (void)snprintf(text, size,
                   "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                   "  - {name: nut, joint: {type: screw, axis: z, pitch: 0.002, velocity: %.17g}, mass: 100,\n"
                   "     inertia: [%.17g, %.17g, %.17g]}\n"
                   "effects:\n"
                   "  - {type: motor, joint: nut, torque: %.17g}\n"
                   "  - {type: joint_friction, joint: nut, coefficient: %.17g, radius: 0.02%s}\n",
                   speed, inertia_of_nut, inertia_of_nut, inertia_of_nut, torque, coefficient, sticks);
}

/* W r (mu +- tan) / (1 -+ mu tan), for a load that rises (upper signs) or sinks; negative: it must be held. */
static double torque_of_jack(double coefficient, double rises) {
    return 100.0 * g * 0.02 * (rises * coefficient + 0.1) / (1.0 - rises * 0.1 * coefficient);
}

KT_TEST(screw_jack_turns_by_the_torque_of_its_thread) {
    KT_WORST error = kt_worst_make("acceleration at the torque of the thread, over that without friction");
    for (int k = 0; k < 4; k++) {
        const double rises = k % 2 ? 1.0 : -1.0, coefficient = k < 2 ? 0.05 : 0.25;
        char text[800];
        double a[1];
        print_jack(text, sizeof text, coefficient, 0.5, torque_of_jack(coefficient, rises), rises * 3.0, "");
        accelerate(text, a);
        kt_worst_near(&error, a[0] / (100.0 * g * 0.002 / 0.5), 0.0, 1e-13, "mu %g, %g", coefficient, rises);
    }
}

KT_TEST(screw_jack_locks_itself_if_mu_exceeds_the_lead) {
    for (int k = 0; k < 2; k++) {
        char text[800];
        kt_parsed m;
        kt_note("mu %s tan", k ? "above" : "below");
        print_jack(text, sizeof text, k ? 0.1001 : 0.0999, 0.5, 0.0, 0.0, ", stick: true");
        kt_simulation *simulation = start_scene(&m, text, "dopri5", 0.0);
        kt_test_advance(simulation, 2.0);
        /* J a = -(m g p - k m (g + p a)), k = mu r / (c^2 (1 + mu tan)) */
        const double gain = 0.0999 * 0.02 * 1.01 / (1.0 + 0.00999);
        const double a = 100.0 * g * (gain - 0.002) / (0.5 + 100.0 * 0.002 * (0.002 - gain));
        kt_check_near("speed after 2 s, rad/s", kt_simulation_velocities(simulation)[0], k ? 0.0 : 2.0 * a,
                      k ? 0.0 : 1e-13);
    }
}

/* A nut without inertia that sinks has no acceleration with friction: its thread would have to stop it at once. */
KT_TEST(light_nut_jams) {
    char text[800];
    kt_parsed m;
    double a[1];
    kt_error error = {0};
    print_jack(text, sizeof text, 0.25, 1e-5, 0.0, -3.0, "");
    kt_parsed_make(&m, text);
    kt_run run = kt_run_fixed("dopri5", 0.0, 1.0);
    kt_simulation *simulation = kt_test_simulation(m.model, &run, NULL);
    kt_check_equal_int("status", kt_simulation_acceleration(simulation, a, &error), KT_ERROR_SINGULAR);
    kt_check_contains("error", error.message, "jams");
}

/* With a little more inertia, the nut decelerates: J a = -(m g p - k m (g + p a)), of which k m p is 0.92 J. */
KT_TEST(nut_that_almost_jams_decelerates) {
    char text[800];
    kt_parsed m;
    double a[1];
    kt_error error = {0};
    const double k = 0.25 * 0.02 * 1.01 / (1.0 + 0.025), J = 1.1 * 100.0 * 0.002 * (k - 0.002);
    print_jack(text, sizeof text, 0.25, J, 0.0, -3.0, "");
    kt_parsed_make(&m, text);
    const kt_run run = kt_run_fixed("dopri5", 0.0, 1.0);
    kt_simulation *simulation = kt_test_simulation(m.model, &run, NULL);
    kt_need_fine("acceleration", kt_simulation_acceleration(simulation, a, &error), &error);
    const double expected = 100.0 * g * (k - 0.002) / (J + 100.0 * 0.002 * (0.002 - k));
    kt_check_near("acceleration, rad/s^2", a[0], expected, 1e-12 * expected);
}

/* ---- a worm ------------------------------------------------------------------------------------------------------ */

/* A worm of r_1 = 0.02 m with tan(gamma) = 0.2 and alpha = 20 deg. The wheel of 0.08 m has a torque of 20 N m. */
static void print_worm(char *text, size_t size, double coefficient, double torque, double speed, const char *more) {
    (void)snprintf(
        text, size,
        "kinetree: 1\nbodies:\n"
        "  - {name: worm, joint: {type: revolute, axis: x, velocity: %.17g}, mass: 1, inertia: [0.01, 1, 1]}\n"
        "  - {name: wheel, joint: {type: revolute, axis: y, at: [0, 0, 0.1]}, mass: 3, inertia: [1, 0.1, 1]}\n"
        "loops:\n"
        "  - {name: mesh, type: worm, between: [worm, wheel], axis: x, axis2: y, radius: 0.02, teeth: 2, teeth2: 40}\n"
        "effects:\n"
        "  - {type: motor, joint: wheel, torque: 20}\n"
        "  - {type: motor, joint: worm, torque: %.17g}\n"
        "  - {type: joint_friction, joint: worm, coefficient: %.17g, load: mesh%s}\n"
        "initial: {hold: [worm]}\n",
        speed, torque, coefficient, more);
}

static double torque_of_worm(double coefficient, double drives) {
    const double normal = cos(acos(-1.0) / 9.0);
    return 20.0 / 0.08 * 0.02 * (normal * 0.2 + drives * coefficient) / (normal - drives * coefficient * 0.2);
}

KT_TEST(worm_turns_by_the_torque_of_its_threads) {
    KT_WORST error = kt_worst_make("acceleration at the torque of the threads, over that without a torque");
    char text[1400];
    double a[2];
    print_worm(text, sizeof text, 1e-300, torque_of_worm(0.0, 1.0), 50.0, "");
    accelerate(text, a);
    const double side = fabs(a[0]) < 1e-9 ? 1.0 : -1.0; /* of the torque that balances the wheel without friction */
    for (int k = 0; k < 4; k++) {
        const double speed = k % 2 ? 50.0 : -50.0, coefficient = k < 2 ? 0.05 : 0.25;
        const double drives = side * speed > 0.0 ? 1.0 : -1.0;
        print_worm(text, sizeof text, coefficient, side * torque_of_worm(coefficient, drives), speed, "");
        accelerate(text, a);
        kt_worst_near(&error, a[0] / (1.0 / 0.01), 0.0, 1e-13, "mu %g, %g", coefficient, drives);
    }
}

KT_TEST(worm_locks_itself_if_mu_exceeds_its_lead) {
    const double limit = 0.2 * cos(acos(-1.0) / 9.0);
    for (int k = 0; k < 2; k++) {
        char text[1400];
        kt_parsed m;
        print_worm(text, sizeof text, k ? 1.0001 * limit : 0.9999 * limit, 0.0, 0.0, ", stick: true");
        kt_simulation *simulation = start_scene(&m, text, "dopri5", 0.0);
        kt_test_advance(simulation, 1.0);
        if (k)
            kt_check_near("speed, rad/s", kt_simulation_velocities(simulation)[0], 0.0, 0.0);
        else
            kt_check_above("speed, rad/s", fabs(kt_simulation_velocities(simulation)[0]), 1e-4);
    }
}

/* ---- a planetary train ------------------------------------------------------------------------------------------- */

/* Sun 30, planet 20, ring 70 teeth, fixed. With eta for each mesh the carrier has T (1 + eta^2 70 / 30) of the sun's
 * torque T if the sun drives, and (1 + 70 / (30 eta^2)) if the carrier drives. */
KT_TEST(planetary_train_loses_three_percent_in_each_mesh) {
    KT_WORST error = kt_worst_make("acceleration of the sun, over T / J");
    for (int k = 0; k < 4; k++) {
        const double drives = k % 2 ? 1.0 : -1.0, loss = k < 2 ? 0.97 : 1.0;
        const double torque = drives * (1.0 + pow(loss, 2.0 * drives) * 70.0 / 30.0);
        char text[2000];
        double a[3];
        (void)snprintf(
            text, sizeof text,
            "kinetree: 1\nbodies:\n"
            "  - {name: sun, joint: {type: revolute, axis: z, velocity: 100}, mass: 1, inertia: [1, 1, 0.001]}\n"
            "  - {name: carrier, joint: {type: revolute, axis: z, velocity: 30}, mass: 1, inertia: [1, 1, "
            "0.01]}\n"
            "  - {name: planet, parent: carrier, joint: {type: revolute, axis: z, at: [0.05, 0, 0]}, mass: 0.2, "
            "inertia: [1, 1, 0.0001]}\n"
            "loops:\n"
            "  - {name: inner, type: gear, between: [sun, planet], teeth: 30, teeth2: 20}\n"
            "  - {name: outer, type: gear, between: [world, planet], teeth: -70, teeth2: 20}\n"
            "effects:\n"
            "  - {type: motor, joint: sun, torque: %.17g}\n"
            "  - {type: motor, joint: carrier, torque: %.17g}\n"
            "  - {type: joint_friction, joint: planet, efficiency: %.17g, load: inner, viscous: 0}\n"
            "  - {type: joint_friction, joint: planet, efficiency: %.17g, load: outer, viscous: 0}\n"
            "initial: {hold: [sun]}\n",
            drives, -torque, k < 2 ? 0.97 : 1.0 - 1e-16, k < 2 ? 0.97 : 1.0 - 1e-16);
        accelerate(text, a);
        kt_worst_near(&error, a[0] * 0.001, 0.0, 1e-14, "loss %g, %g", loss, drives);
    }
}

/* ---- the law ----------------------------------------------------------------------------------------------------- */

/* Loads from the reactions, and friction as what inverse dynamics lacks: both without the solver of the law. */
typedef struct law_check {
    kt_parsed m;
    double q[4], v[4], a[4], tau[4];
    kt_wrench joint[5], loop[1];
} law_check;

static const char spatial[] =
    "kinetree: 1\ngravity: [1, -2, -9.81]\nbodies:\n"
    "  - {name: base, joint: {type: revolute, axis: z, velocity: 1.5}, mass: 4, com: [0.1, 0, 0.2], inertia: [0.3, "
    "0.2, 0.1]}\n"
    "  - {name: arm, parent: base, joint: {type: revolute, axis: [1, 1, 0], at: [0.3, 0, 0.4], position: 0.4, "
    "velocity: -0.7}, "
    "mass: 2, com: [0.4, 0.1, 0], inertia: [0.05, 0.1, 0.1]}\n"
    "  - {name: slide, parent: arm, joint: {type: prismatic, axis: [1, 0, 0.3], at: [0.5, 0, 0], velocity: 0.4}, mass: "
    "1.5, "
    "com: [0, 0.1, 0.1], inertia: [0.02, 0.03, 0.02]}\n"
    "  - {name: nut, parent: slide, joint: {type: screw, axis: y, at: [0.1, 0.1, 0], pitch: -0.01, velocity: 9}, mass: "
    "1, "
    "com: [0.05, 0, 0], inertia: [0.004, 0.005, 0.006]}\n"
    "effects:\n"
    "  - {type: joint_friction, joint: base, coefficient: 0.2, radius: 0.05, smoothing: 0.5}\n"
    "  - {type: joint_friction, joint: arm, coefficient: 0.3, radius: 0.03, smoothing: 0.5}\n"
    "  - {type: joint_friction, joint: slide, coefficient: 0.25, smoothing: 0.5}\n"
    "  - {type: joint_friction, joint: nut, coefficient: 0.15, radius: 0.04, smoothing: 0.5}\n";

/* mu r |F|, mu |F across|, and the friction of a thread, from the reaction. */
static double friction_by_hand(const law_check *c, int k, kt_mat3 axes) {
    static const double coefficient[] = {0.2, 0.3, 0.25, 0.15}, radius[] = {0.05, 0.03, 1.0, 0.04};
    const kt_vec3 along[] = {
        {0.0, 0.0, 1.0}, {sqrt(0.5), sqrt(0.5), 0.0}, {1.0 / sqrt(1.09), 0.0, 0.3 / sqrt(1.09)}, {0.0, 1.0, 0.0}};
    const kt_vec3 f = c->joint[k + 1].force, axis = kt_mat3_apply(axes, along[k]);
    const double axial = kt_vec3_dot(f, axis), size = kt_vec3_norm(f);
    if (k == 2)
        return coefficient[k] * sqrt(size * size - axial * axial);
    if (k < 3)
        return coefficient[k] * radius[k] * size;
    const double lead = 0.01 / radius[k], cosine = 1.0 / sqrt(1.0 + lead * lead), sine = lead * cosine;
    const double rises = -axial * c->v[k] > 0.0 ? 1.0 : -1.0;
    return coefficient[k] * radius[k] / cosine * fabs(axial) / (cosine - rises * coefficient[k] * sine);
}

KT_TEST(friction_obeys_its_law_in_space) {
    static law_check c;
    kt_error error = {0};
    KT_WORST worst = kt_worst_make("friction, over the size of forces");
    kt_parsed_make(&c.m, spatial);
    kt_random random = kt_random_of_test();
    for (int i = 0; i < 200; i++) {
        for (int k = 0; k < 4; k++) {
            c.q[k] = kt_random_uniform(&random, -1.0, 1.0) * (k == 2 ? 0.2 : 3.0);
            c.v[k] = kt_random_normal(&random) * (k == 3 ? 10.0 : 1.0);
        }
        kt_need_fine("accelerations",
                     kt_acceleration_evaluate(c.m.model, c.m.data, 0.0, c.q, c.v, NULL, NULL, c.a, &error), &error);
        kt_need_fine("reactions",
                     kt_reaction_evaluate(c.m.model, c.m.data, 0.0, c.q, c.v, NULL, NULL, c.joint, NULL, &error),
                     &error);
        kt_need_fine("forces", kt_dynamics_inverse(c.m.model, c.m.data, c.q, c.v, c.a, NULL, c.tau, &error), &error);
        kt_need_fine("kinematics", kt_kinematics_update(c.m.model, c.m.data, c.q, c.v, NULL, &error), &error);
        for (int k = 0; k < 4; k++) {
            /* the joint's axis moves with its body */
            const double expected =
                -tanh(c.v[k] / 0.5) * friction_by_hand(&c, k, kt_body_pose(c.m.model, c.m.data, k + 1).rotation);
            kt_worst_near(&worst, c.tau[k], expected, 1e-13 * (1.0 + fabs(expected)), "draw %d, joint %d", i, k);
        }
    }
}

/* Forces of effects contain the friction of the last accelerations, and are an error for any other state. */
KT_TEST(forces_of_effects_contain_the_friction_of_this_state) {
    static law_check c;
    kt_error error = {0};
    KT_WORST worst = kt_worst_make("forces of effects against inverse dynamics");
    double forces[4], other[4] = {0.0, 0.0, 0.0, 1.0};
    kt_parsed_make(&c.m, spatial);
    kt_model_initial(c.m.model, c.q, c.v);
    kt_check_equal_int("before accelerations", kt_effect_forces(c.m.model, c.m.data, 0.0, c.q, c.v, forces, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_contains("remedy", error.message, "compute the accelerations of this q and v first");
    kt_need_fine("accelerations", kt_acceleration_evaluate(c.m.model, c.m.data, 0.0, c.q, c.v, NULL, NULL, c.a, &error),
                 &error);
    kt_need_fine("forces", kt_effect_forces(c.m.model, c.m.data, 0.0, c.q, c.v, forces, &error), &error);
    kt_need_fine("inverse", kt_dynamics_inverse(c.m.model, c.m.data, c.q, c.v, c.a, NULL, c.tau, &error), &error);
    for (int k = 0; k < 4; k++)
        kt_worst_near(&worst, forces[k], c.tau[k], 1e-13 * (1.0 + fabs(c.tau[k])), "joint %d", k);
    kt_check_equal_int("another state", kt_effect_forces(c.m.model, c.m.data, 0.0, c.q, other, forces, &error),
                       KT_ERROR_ARGUMENT);
    const double rest[4] = {0.0};
    kt_need_fine("accelerations at rest",
                 kt_acceleration_evaluate(c.m.model, c.m.data, 0.0, c.q, rest, NULL, NULL, c.a, &error), &error);
    kt_need_fine("forces at rest", kt_effect_forces(c.m.model, c.m.data, 0.0, c.q, rest, forces, &error), &error);
    for (int k = 0; k < 4; k++)
        kt_check_near("friction at rest", forces[k], 0.0, 0.0);
}

/* ---- energy ------------------------------------------------------------------------------------------------------ */

/* The energy that friction dissipates is that which the motion loses. */
static int keep_last(const kt_record *record, void *user) {
    memcpy(user, record, sizeof *record);
    return 0;
}

KT_TEST(friction_from_a_load_accounts_for_its_energy) {
    char text[1200];
    kt_parsed m;
    kt_record last = {.t = 0.0};
    kt_simulation_options options = kt_simulation_options_default();
    kt_run run = kt_run_fixed("dopri5", 0.0, 1.0);
    run.relative = run.absolute = 1e-11;
    options.record = KT_RECORD_ENERGY | KT_RECORD_BALANCE;
    print_atwood(text, sizeof text, 8.0, 4.0);
    kt_parsed_make(&m, text);
    kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
    kt_test_run(simulation, keep_last, &last);
    const double a = acceleration_of_atwood(8.0, 4.0), s = 0.5 * a;
    const double rubs = 0.4 * 0.02 * (15.0 * g - 4.0 * a) * s / 0.1;
    kt_check_near("dissipated, J", last.work.dissipated, rubs, 1e-12 * rubs);
}

/* ---- the elimination --------------------------------------------------------------------------------------------- */

/* Derivatives use its solutions, which no iteration corrects. */
KT_TEST(steps_of_loads_solve_equations_of_several_frictions) {
    enum { N = 4 };
    char text[2048] = "kinetree: 1\nbodies:\n";
    for (int pass = 0; pass < 2; pass++) {
        (void)strcat(text, pass ? "effects:\n" : "");
        for (int i = 0; i < N; i++) {
            const size_t used = strlen(text);
            (void)snprintf(text + used, sizeof text - used,
                           pass ? "  - {name: f%d, type: joint_friction, joint: b%d, coefficient: 0.1, radius: 0.1}\n"
                                : "  - {name: b%d, joint: {type: revolute}, mass: %d, inertia: [1, 1, 1]}\n",
                           i, pass ? i : 1);
        }
    }
    kt_parsed m;
    kt_parsed_make(&m, text);
    kt_data *data = kt_test_data(m.model);
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("solution");
    kt_need(kt_check_equal_int("frictions", (int)m.model->n.loaded, N));
    for (int k = 0; k < 100; k++) {
        double x[N];
        for (int i = 0; i < N; i++) {
            x[i] = kt_random_uniform(&random, -1.0, 1.0);
            data->load_residual[i] = 0.0;
        }
        for (int j = 0; j < N; j++)
            for (int i = 0; i < N; i++) {
                data->load_matrix[j * N + i] = (i == j ? 4.0 : 0.0) + kt_random_uniform(&random, -1.0, 1.0);
                data->load_residual[i] += data->load_matrix[j * N + i] * x[j];
            }
        kt_error made = {0};
        kt_need_fine("solves", kt_loads_solve(m.model, data, &(kt_dynamic_state){.t = 0.0}, &made), &made);
        for (int i = 0; i < N; i++)
            kt_worst_near(&error, data->load_residual[i], x[i], 1e-14, "equations %d", k);
    }
}
