/* Contacts and frictions that share a load in several ways, against closed forms. Frictions of one joint also against
 * one friction with the sums of their limits. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "check.h"
#include "motion/simulation/parsed.h"

enum { FRICTIONS = 3 };
static const double amplitude = 4.0, rate = 0.4;

typedef struct dry {
    double coulomb, limit;
} dry;

/* Makes a block of 1 kg under the force A sin(w t), with frictions of its joint. */
static void make_block(const dry *friction, int count, double stribeck, kt_parsed *m) {
    char text[2048];
    size_t used =
        (size_t)snprintf(text, sizeof text,
                         "kinetree: 1\nbodies: [{name: cart, joint: {type: prismatic, axis: x}, mass: 1}]\n"
                         "effects:\n"
                         "  - {type: motor, joint: cart, force: {sine: {amplitude: %.17g, frequency: %.17g}}}\n",
                         amplitude, rate / (2.0 * acos(-1.0)));
    for (int i = 0; i < count; i++)
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 "  - {name: f%d, type: joint_friction, joint: cart, coulomb: %.17g, static: %.17g, "
                                 "stribeck: %.17g, stick: true}\n",
                                 i, friction[i].coulomb, friction[i].limit, stribeck);
    kt_parsed_make(m, text);
}

static kt_simulation *start_block(const kt_parsed *m, const char *method) {
    kt_simulation_options options = kt_simulation_options_default();
    kt_run run = kt_run_fixed(method, strcmp(method, "rk4") == 0 ? 1e-3 : 0.0, 100.0);
    run.relative = run.absolute = 1e-11;
    options.record = KT_RECORD_MULTIPLIER | KT_RECORD_REACTION;
    return kt_test_simulation(m->model, &run, &options);
}

/* The velocity after slip begins at t1, until it ends: A / w (cos w t1 - cos w t) - C (t - t1). */
static double slip_velocity_of(double coulomb, double t1, double t) {
    return amplitude / rate * (cos(rate * t1) - cos(rate * t)) - coulomb * (t - t1);
}

static const dry cases[][FRICTIONS] = {{{1.0, 1.0}, {2.0, 2.0}},
                                       {{1.0, 1.2}, {2.0, 2.4}},
                                       {{1.0, 1.8}, {2.0, 2.0}},
                                       {{0.5, 0.6}, {2.0, 2.3}, {0.25, 0.7}}};
static const int counts[] = {2, 2, 2, 3};
enum { CASES = sizeof cases / sizeof *cases };

static dry sum_of(int k) {
    dry sum = {0.0, 0.0};
    for (int i = 0; i < counts[k]; i++) {
        sum.coulomb += cases[k][i].coulomb;
        sum.limit += cases[k][i].limit;
    }
    return sum;
}

/* The block sticks until the force reaches the sum of the limits. It then slips against the sum of Coulomb's forces. */
KT_TEST(frictions_of_a_joint_slip_at_the_sum_of_their_limits) {
    for (int k = 0; k < CASES; k++) {
        kt_parsed m;
        const dry sum = sum_of(k);
        const double t1 = asin(sum.limit / amplitude) / rate;
        make_block(cases[k], counts[k], 0.0, &m);
        kt_simulation *simulation = start_block(&m, "dopri5");
        kt_test_advance(simulation, t1 - 1e-9);
        kt_check_near("at rest", kt_simulation_velocities(simulation)[0], 0.0, 0.0);
        kt_check_equal_int("slips", (int)kt_simulation_contacts(simulation).slips, 0);
        kt_test_advance(simulation, t1 + 0.5);
        kt_check_near("velocity", kt_simulation_velocities(simulation)[0], slip_velocity_of(sum.coulomb, t1, t1 + 0.5),
                      1e-10);
        kt_check_equal_int("slips", (int)kt_simulation_contacts(simulation).slips, counts[k]);
    }
}

/* Over many periods the motion is that of one friction with the sums, and each stick and slip happens once for each.
 * Measured: 3e-13. */
KT_TEST(frictions_of_a_joint_move_it_as_their_sum_does) {
    static const char *const methods[] = {"dopri5", "rk4", "radau5"};
    for (int k = 0; k < CASES * 6; k++) {
        const int i = k % CASES;
        const dry sum = sum_of(i);
        const double stribeck = k / CASES < 3 ? 0.0 : 0.01;
        const char *method = methods[k / CASES % 3];
        kt_parsed m[2];
        kt_simulation *simulation[2] = {NULL};
        double off = 0.0;
        kt_note("case %d, %s, stribeck %g", i, method, stribeck);
        make_block(cases[i], counts[i], stribeck, &m[0]);
        simulation[0] = start_block(&m[0], method);
        make_block(&sum, 1, stribeck, &m[1]);
        simulation[1] = start_block(&m[1], method);
        for (int n = 1; n <= 40; n++) {
            for (int j = 0; j < 2; j++)
                kt_test_advance(simulation[j], 1.0 * n);
            off =
                fmax(off, fabs(kt_simulation_positions(simulation[0])[0] - kt_simulation_positions(simulation[1])[0]));
        }
        const kt_contact_counts several = kt_simulation_contacts(simulation[0]),
                                one = kt_simulation_contacts(simulation[1]);
        kt_check_below("difference, m", off, 1e-11);
        kt_check_equal_int("sticks", (int)several.sticks, counts[i] * (int)one.sticks);
        kt_check_equal_int("slips", (int)several.slips, counts[i] * (int)one.slips);
    }
}

static int check_shares(const kt_record *record, void *user) {
    const dry *friction = user;
    const double limit = friction[0].limit + friction[1].limit;
    for (int i = 0; i < 2; i++)
        kt_check_near("share of the load, N", record->multipliers[i],
                      -amplitude * sin(rate * record->t) * friction[i].limit / limit, 1e-12);
    return 0;
}

/* Each friction carries its share of the load in proportion to its limit. */
KT_TEST(frictions_of_a_joint_share_the_load_by_their_limits) {
    kt_parsed m;
    dry friction[] = {{1.0, 1.2}, {2.0, 2.4}};
    make_block(friction, 2, 0.0, &m);
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    run.duration = 1.5;
    run.interval = 0.5;
    options.record = KT_RECORD_MULTIPLIER | KT_RECORD_REACTION;
    kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
    kt_test_run(simulation, check_shares, friction);
}

/* ---- wheels ------------------------------------------------------------------------------------------------------ */

/* A car of 3 kg on four discs of 0.5 kg and 0.2 m, each with a motor. Three of the wheels can carry the car, but the
 * torque of the fourth drives it, too. */
typedef struct car {
    double torque[4], com[2], bearing[4]; /* bearing: friction of the wheels' joints */
    bool late;                            /* the torques rise from 0.2 s to 0.7 s */
    double length, mass;                  /* by which the car is another size; 0: 1 */
} car;

static kt_simulation *start_car(const car *c) {
    char text[4096];
    kt_parsed m;
    const double l = c->length > 0.0 ? c->length : 1.0, mass = c->mass > 0.0 ? c->mass : 1.0, ml2 = mass * l * l;
    size_t used =
        (size_t)snprintf(text, sizeof text,
                         "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                         "  - {name: car, joint: {type: free, position: {position: [0, 0, %.17g]}}, mass: %g, "
                         "com: [%g, %g, 0], inertia: [%g, %g, %g]}\n",
                         0.2 * l, 3.0 * mass, c->com[0] * l, c->com[1] * l, 0.1 * ml2, 0.1 * ml2, 0.15 * ml2);
    for (int i = 0; i < 4; i++)
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 "  - {name: w%d, parent: car, joint: {type: revolute, axis: y, at: [%g, %g, 0]}, "
                                 "mass: %g, shape: {type: cylinder, radius: %.17g, length: %g, axis: y}}\n",
                                 i, (i < 2 ? 0.3 : -0.3) * l, (i % 2 ? 0.2 : -0.2) * l, 0.5 * mass, 0.2 * l, 0.02 * l);
    used += (size_t)snprintf(text + used, sizeof text - used, "effects:\n");
    for (int i = 0; i < 4; i++)
        if (c->bearing[i] > 0.0)
            used += (size_t)snprintf(text + used, sizeof text - used,
                                     "  - {type: joint_friction, joint: w%d, coulomb: %.17g, stick: true}\n", i,
                                     c->bearing[i] * mass * l);
    for (int i = 0; i < 4; i++)
        used += (size_t)snprintf(
            text + used, sizeof text - used,
            "  - {name: tyre%d, type: contact, point: w%d, axle: y, radius: %.17g, plane: world, restitution: 0, "
            "friction: 1}\n  - {type: motor, joint: w%d, torque: {ramp: {from: %.17g, to: %.17g, start: 0.2, end: "
            "0.7}}}\n",
            i, i, 0.2 * l, i, c->late ? 0.0 : c->torque[i] * mass * l, c->torque[i] * mass * l);
    kt_parsed_make(&m, text);
    return start_block(&m, "dopri5");
}

/* Each wheel presses, and all of them carry the weight. */
static void check_loads(kt_simulation *simulation) {
    const kt_model *model = kt_simulation_model(simulation);
    kt_record record;
    kt_error error = {0};
    double least = HUGE_VAL, sum = 0.0;
    kt_need_fine("senses", kt_simulation_sense(simulation, &record, &error), &error);
    for (int i = 0; i < 4; i++) {
        const char name[] = {'t', 'y', 'r', 'e', (char)('0' + i), '\0'};
        const double load = -record.loop_reactions[kt_loop_find(model, name)].force.z;
        least = fmin(least, load);
        sum += load;
    }
    kt_check_above("least load, N", least, 0.0);
    kt_check_near("weight, N", sum, 5.0 * 9.81, 1e-9);
}

/* The car moves as its closed form, and all of its wheels roll. */
static void check_drive(const car *c) {
    static const double radius = 0.2;
    double sum = 0.0;
    kt_error error = {0};
    for (int i = 0; i < 4; i++)
        sum += c->torque[i];
    /* the inertia of a wheel is half of that of its mass at the rim */
    const double a = sum / radius / (3.0 + 4.0 * 1.5 * 0.5), v = c->late ? 0.55 * a : a;
    kt_simulation *simulation = start_car(c);
    kt_need_fine("drives", kt_simulation_advance(simulation, 1.0, &error), &error);
    if (!c->late)
        kt_check_near("place, m", kt_simulation_positions(simulation)[0], 0.5 * a, 1e-10);
    for (int i = 6; i < 10; i++)
        kt_check_near("wheel, rad/s", kt_simulation_velocities(simulation)[i], v / radius, 1e-9);
    kt_check_equal_int("contacts", (long long)kt_simulation_contacts(simulation).closings, 4);
    kt_check_equal_int("openings", (long long)kt_simulation_contacts(simulation).openings, 0);
    kt_check_equal_int("undecided", (long long)kt_simulation_contacts(simulation).undecided, 0);
    check_loads(simulation);
}

KT_TEST(all_wheels_of_a_car_drive_it) {
    static const car cars[] = {{.torque = {0.5, 0.5, 0.5, 0.5}},
                               {.torque = {0.5, 0.0, 0.0, 0.0}},
                               {.torque = {0.0, 0.0, 0.3, 0.4}, .com = {0.19, 0.03}},
                               {.torque = {0.1, 0.1, 0.1, 0.1}, .late = true}};
    for (int k = 0; k < 4; k++) {
        kt_note("case %d", k);
        check_drive(&cars[k]);
    }
}

/* The least loads of four wheels would have one that pulls, or one that is too small for its torque. */
KT_TEST(all_wheels_of_a_car_with_its_load_near_a_corner_drive_it) {
    static const car cars[] = {{.torque = {0.1, 0.1, 0.1, 0.1}, .com = {0.28, 0.15}},
                               {.torque = {0.0, 0.0, 0.1, 0.1}, .com = {-0.28, 0.15}},
                               {.torque = {0.1, 0.1, 0.1, 0.1}, .com = {0.28, -0.15}, .late = true},
                               {.torque = {0.4, 0.4, 0.4, 0.4}, .com = {0.28, 0.15}, .late = true},
                               {.torque = {0.0, 0.0, 0.0, 0.0}, .com = {0.28, 0.15}},
                               {.torque = {0.5, 0.5, 0.5, 0.5}, .com = {0.27, 0.14}}};
    for (int k = 0; k < 6; k++) {
        kt_note("case %d", k);
        check_drive(&cars[k]);
    }
}

/* Its torque is beyond all friction of the wheel that carries least. */
KT_TEST(wheel_that_spins_though_it_could_hold_is_counted) {
    kt_error error = {0};
    kt_simulation *simulation = start_car(&(car){.torque = {0.0, 0.0, 4.0, 4.0}, .com = {0.28, 0.15}});
    kt_need_fine("drives", kt_simulation_advance(simulation, 0.5, &error), &error);
    kt_check_above("undecided", (double)kt_simulation_contacts(simulation).undecided, 0.5);
}

/* The friction of each bearing, in the records. */
static void check_frictions(kt_simulation *simulation, const car *c) {
    const double unit = c->length > 0.0 ? c->mass * c->length : 1.0;
    const kt_model *model = kt_simulation_model(simulation);
    kt_record record;
    kt_error error = {0};
    kt_need_fine("senses", kt_simulation_sense(simulation, &record, &error), &error);
    for (int loop = 0; loop < kt_loop_count(model); loop++) {
        const char *name = kt_loop_name(model, loop);
        if (kt_loop_is_stick(model, loop) && *name == 'w' && kt_loop_rows_of(model, loop).count > 0)
            kt_check_below(name, fabs(record.multipliers[kt_loop_rows_of(model, loop).first]),
                           c->bearing[name[1] - '0'] * unit * (1.0 + 1e-6));
    }
}

/* Frictions of several wheels hold a car, in shares that are not unique, until its torque is the sum S of their limits.
 * The torque T (3 s^2 - 2 s^3) of a ramp is S at s = 1/2 if T = 2 S. */
KT_TEST(car_starts_at_the_sum_of_the_frictions_of_its_wheels) {
    static const car cars[] = {{.bearing = {0.05, 0.15, 0.0, 0.0}},
                               {.bearing = {0.1, 0.1, 0.0, 0.0}},
                               {.bearing = {0.0, 0.05, 0.0, 0.1}},
                               {.bearing = {0.1, 0.02, 0.05, 0.0}},
                               {.bearing = {0.1, 0.1, 0.1, 0.1}, .com = {0.02, 0.01}},
                               {.bearing = {0.1, 0.2, 0.05, 0.15}, .com = {0.02, 0.01}},
                               {.bearing = {0.1, 0.2, 0.05, 0.15}, .com = {0.02, 0.01}, .length = 0.05, .mass = 0.02},
                               {.bearing = {0.1, 0.2, 0.05, 0.15}, .com = {0.02, 0.01}, .length = 100.0, .mass = 1e6},
                               {.bearing = {0.1, 0.0, 0.0, 0.0}, .length = 100.0, .mass = 1e6}};
    for (size_t k = 0; k < sizeof cars / sizeof *cars; k++) {
        car c = cars[k];
        double sum = 0.0;
        kt_error error = {0};
        kt_note("case %d", (int)k);
        for (int i = 0; i < 4; i++)
            sum += c.bearing[i];
        c.torque[0] = 2.0 * sum;
        c.late = true;
        /* the integral of T (3 s^2 - 2 s^3) - S from 1/2 to 1, then S */
        const double impulse = 0.5 * (2.0 * sum * (0.5 - 0.09375) - 0.5 * sum) + 0.3 * sum;
        kt_simulation *simulation = start_car(&c);
        kt_need_fine("rests", kt_simulation_advance(simulation, 0.45 - 1e-6, &error), &error);
        kt_check_near("at rest, m/s", kt_simulation_velocities(simulation)[0], 0.0, 1e-12);
        check_frictions(simulation, &c);
        kt_need_fine("drives", kt_simulation_advance(simulation, 1.0, &error), &error);
        kt_check_near("velocity, m/s", kt_simulation_velocities(simulation)[0], impulse / 0.2 / 6.0, 1e-9);
    }
}

static int count_record(const kt_record *record, void *user) {
    *(int *)user += record->t >= 0.0;
    return 0;
}

/* A leg of a table carries nothing: its contact is closed without a reaction. Rounding of this reaction is no error. */
KT_TEST(contact_that_grazes_may_pull_by_rounding) {
    kt_parsed m;
    kt_error error = {0};
    int records = 0;
    char text[4096];
    size_t used = (size_t)snprintf(text, sizeof text,
                                   "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                                   "  - {name: top, joint: {type: free, position: {position: [1.5, 0, 0.3]}, velocity: "
                                   "{linear: [0.43007, -0.68441, -0.67249]}}, mass: 2, inertia: [0.05, 0.05, 0.08]}\n");
    for (int i = 0; i < 4; i++)
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 "  - {name: l%d, parent: top, joint: {type: revolute, axis: y, at: [%g, %g, 0]}, "
                                 "mass: 0.2, com: [0, 0, -0.15], inertia: [0.002, 0.002, 0.0002], markers: {m: [0, 0, "
                                 "-0.3]}}\n",
                                 i, i < 2 ? -0.2 : 0.2, i % 2 ? 0.15 : -0.15);
    used += (size_t)snprintf(text + used, sizeof text - used,
                             "effects:\n"
                             "  - {type: joint_limit, joint: l0, lower: -0.08586, upper: 0.17433, restitution: 0.3}\n"
                             "  - {type: joint_friction, joint: l1, coulomb: 2.50596, stick: true}\n"
                             "  - {type: joint_spring, joint: l2, stiffness: 50, damping: 0.5}\n"
                             "  - {type: joint_limit, joint: l3, lower: -0.08364, upper: 0.15821, restitution: 0}\n");
    for (int i = 0; i < 4; i++)
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 "  - {name: c%d, type: contact, point: l%d.m, radius: 0, plane: world, restitution: "
                                 "0, rest_velocity: 1e-4}\n",
                                 i, i);
    kt_parsed_make(&m, text);
    kt_run run = kt_run_fixed("rk4", 1e-3, 1.5);
    kt_simulation_options options = kt_simulation_options_default();
    run.interval = 0.01;
    options.record = KT_RECORD_MULTIPLIER | KT_RECORD_REACTION;
    kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
    kt_need_fine("runs", kt_simulation_run(simulation, count_record, &records, &error), &error);
    kt_check_equal_int("records", records, 151);
}

/* J0, J1 and L1 are a rigid triangle. The other loops repeat four of its equations, and two freedoms are left. */
static kt_simulation *start_rigid_triangle(const char *friction) {
    char text[2048];
    kt_parsed m;
    (void)snprintf(text, sizeof text,
                   "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
                   "  - {name: B1, joint: {type: revolute, name: J0, at: [0.8488, -0.5983, 0], axis: z}, "
                   "mass: 0.8174, com: [-1.131, -0.3047, 0], inertia: [0.2538, 0.3405, 0.3195, -0.09111, 0, 0]}\n"
                   "  - {name: B0, parent: B1, joint: {type: revolute, name: J1, at: [0.06543, 1.367, 0], axis: z}, "
                   "mass: 1.751, com: [-0.22, 0.04781, 0], inertia: [0.2604, 0.3512, 0.4034, 0.04416, 0, 0]}\n"
                   "  - {name: B2, parent: B0, joint: {type: planar, name: J2, at: [-0.5358, -1.068, 0], axis: z}, "
                   "mass: 2.423, com: [-0.1743, 1.134, 0], inertia: [0.4469, 0.1455, 0.4742, 0.1094, 0, 0]}\n"
                   "  - {name: B3, parent: B0, joint: {type: revolute, name: J3, at: [-1.354, -1.461, 0], axis: z}, "
                   "mass: 0.9448, com: [1.006, 0.35, 0], inertia: [0.3178, 0.5503, 0.5647, 0.07558, 0, 0]}\n"
                   "  - {name: B4, parent: B3, joint: {type: revolute, name: J4, at: [-0.07154, 0.2531, 0], axis: z}, "
                   "mass: 2.436, com: [0.02179, -0.2391, 0], inertia: [0.3948, 0.3407, 0.4342, -0.01496, 0, 0]}\n"
                   "loops:\n"
                   "  - {name: J5, type: revolute, axis: z, "
                   "between: [{body: B1, at: [0.02513, 0.1746, 0]}, {body: B4, at: [1.385, 0.01511, 0]}]}\n"
                   "  - {name: L0, type: distance, "
                   "between: [{body: B2, at: [-0.06653, -0.6118, 0]}, {body: B3, at: [1.021, 0.6344, 0]}]}\n"
                   "  - {name: L1, type: spherical, "
                   "between: [{body: world, at: [-0.8674, -0.7037, 0]}, {body: B0, at: [-1.782, -1.473, 0]}]}\n"
                   "%s",
                   friction);
    kt_parsed_make(&m, text);
    return start_block(&m, "dopri5");
}

/* The motion is that without friction. */
KT_TEST(friction_of_a_joint_that_loops_hold_rests) {
    kt_simulation *rubs = start_rigid_triangle("effects: [{type: joint_friction, joint: J0, coulomb: 7.373, "
                                               "static: 9.585, viscous: 0.1, stick: true}]\n"),
                  *free = start_rigid_triangle("");
    kt_error error = {0};
    double off = 0.0, fastest = 0.0;
    for (int n = 1; n <= 20; n++) {
        kt_need_fine("moves", kt_simulation_advance(rubs, 0.03 * n, &error), &error);
        kt_test_advance(free, 0.03 * n);
        for (int i = 0; i < 7; i++)
            off = fmax(off, fabs(kt_simulation_positions(rubs)[i] - kt_simulation_positions(free)[i]));
        fastest = fmax(fastest, fabs(kt_simulation_velocities(rubs)[0]));
    }
    kt_check_below("difference, m or rad", off, 1e-8);
    kt_check_below("rate of the joint, rad/s", fastest, 1e-12);
    kt_check_below("steps", (double)kt_simulation_counts_of(rubs).steps,
                   1.5 * (double)kt_simulation_counts_of(free).steps + 10.0);
}

/* The torque that starts a slider-crank from rest with this half of the acceleration of its crank, rad/s^2. */
static double starting_torque(double half, const char *friction) {
    char text[2048];
    kt_parsed m;
    kt_record record;
    kt_error error = {0};
    (void)snprintf(
        text, sizeof text,
        "kinetree: 1\nbodies:\n"
        "  - {name: crank, joint: {type: revolute, axis: z, position: 0.8}, mass: 1.2, "
        "inertia: [0.004, 0.004, 0.008]}\n"
        "  - {name: rod, parent: crank, joint: {type: revolute, axis: z, at: [0.08, 0, 0], position: -1}, "
        "mass: 0.3, inertia: [0.001, 0.002, 0.002]}\n"
        "  - {name: piston, joint: {type: prismatic, axis: x, position: 0.3}, mass: 0.4}\n"
        "loops:\n  - {name: pin, type: revolute, axis: z, between: [{body: rod, at: [0.25, 0, 0]}, piston]}\n"
        "  - {name: drive, type: motion, joint: crank, position: {polynomial: [0.8, 0, %.17g]}}\n%s",
        half, friction);
    kt_parsed_make(&m, text);
    kt_simulation *simulation = start_block(&m, "dopri5");
    kt_need_fine("senses", kt_simulation_sense(simulation, &record, &error), &error);
    return record.loop_reactions[kt_loop_find(kt_simulation_model(simulation), "drive")].moment.z;
}

/* The drive holds the joint. Friction is against the direction in which it begins to move, by the principle of virtual
 * power with the derivative of the place of the piston, r cos a + (l^2 - r^2 sin^2 a)^(1/2). */
KT_TEST(friction_of_a_driven_joint_is_against_the_motion_that_begins) {
    static const double halves[] = {0.4, -0.4, 1e-9, -1e-9};
    const double r = 0.08, l = 0.25, s = sin(0.8), c = cos(0.8);
    const double slope = r * s + r * r * s * c / sqrt(l * l - r * r * s * s);
    KT_WORST worst = kt_worst_make("torque, N m");
    for (size_t i = 0; i < sizeof halves / sizeof *halves; i++) {
        const double torque = starting_torque(halves[i], "effects: [{type: joint_friction, joint: piston, coulomb: 5, "
                                                         "static: 6, stick: true}]\n") -
                              starting_torque(halves[i], "");
        kt_worst_near(&worst, torque, copysign(6.0 * slope, halves[i]), 1e-9, "acceleration %g", 2.0 * halves[i]);
    }
}

/* A sled slides on three feet and decelerates at mu g, as one body with its load. Feet with the coefficient 0.1 do
 * not hold the load by its weight. But a bar joins both centres, and may pull the load down with any force. If the load
 * slid, the bar would become longer. mu: the coefficient of the sled. v: its speed, while the load has 1 m/s. `factor`
 * multiplies all masses. fourth: a further foot, so that the feet share the load in several ways. */
static void make_sled(kt_parsed *m, double mu, double v, double factor, bool fourth) {
    char text[3072], foot[256] = "";
    if (fourth)
        (void)snprintf(foot, sizeof foot,
                       "  - {name: fd, type: contact, point: sled.d, radius: 0, plane: world, axis: z, restitution: 0,"
                       " friction: %.17g}\n",
                       mu);
    (void)snprintf(
        text, sizeof text,
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
        "  - name: sled\n    mass: %.17g\n    inertia: [%.17g, %.17g, %.17g]\n"
        "    joint: {type: free, position: {position: [0, 0, 0.1]}, velocity: {linear: [%.17g, 0, 0]}}\n"
        "    markers: {a: [0.3, 0, -0.1], b: [-0.2, 0.3, -0.1], c: [-0.2, -0.3, -0.1], d: [-0.35, 0, -0.1]}\n"
        "  - name: load\n    mass: %.17g\n    inertia: [%.17g, %.17g, %.17g]\n"
        "    joint: {type: free, position: {position: [0, 0, 0.3]}, velocity: {linear: [1, 0, 0]}}\n"
        "    markers: {a: [0.2, 0, -0.1], b: [-0.1, 0.2, -0.1], c: [-0.1, -0.2, -0.1]}\n"
        "effects:\n"
        "  - {name: fa, type: contact, point: sled.a, radius: 0, plane: world, axis: z, restitution: 0,"
        " friction: %.17g}\n"
        "  - {name: fb, type: contact, point: sled.b, radius: 0, plane: world, axis: z, restitution: 0,"
        " friction: %.17g}\n"
        "  - {name: fc, type: contact, point: sled.c, radius: 0, plane: world, axis: z, restitution: 0,"
        " friction: %.17g}\n"
        "  - {name: la, type: contact, point: load.a, radius: 0, plane: {body: sled, at: [0, 0, 0.1]}, restitution: 0,"
        " friction: 0.1}\n"
        "  - {name: lb, type: contact, point: load.b, radius: 0, plane: {body: sled, at: [0, 0, 0.1]}, restitution: 0,"
        " friction: 0.1}\n"
        "  - {name: lc, type: contact, point: load.c, radius: 0, plane: {body: sled, at: [0, 0, 0.1]}, restitution: 0,"
        " friction: 0.1}\n%s"
        "loops: [{name: bar, type: distance, between: [sled, load]}]\n",
        2.0 * factor, 0.02 * factor, 0.02 * factor, 0.03 * factor, v, factor, 0.01 * factor, 0.01 * factor,
        0.01 * factor, mu, mu, mu, foot);
    kt_parsed_make(m, text);
}

KT_TEST(load_that_a_bar_clamps_rests_on_a_sled_that_slides) {
    static const double factors[] = {1.0, 1e-6, 1e6}, g = 9.81, t = 0.3;
    const kt_simulation_options options = kt_simulation_options_default();
    const kt_run run = kt_run_within(NULL, 1e-9, 1.0);
    for (size_t i = 0; i < 2 * sizeof factors / sizeof *factors; i++) {
        kt_parsed m;
        kt_error error = {0};
        make_sled(&m, 0.3, 1.0, factors[i / 2], i % 2 > 0);
        kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
        kt_need_fine("slides", kt_simulation_advance(simulation, t, &error), &error);
        const double *q = kt_simulation_positions(simulation);
        kt_check_near("place of the sled, m", q[0], t - 0.15 * g * t * t, 1e-12);
        kt_check_near("place of the load, m", q[7], q[0], 1e-14);
        kt_check_near("height of the load, m", q[9], 0.3, 1e-14);
    }
}

/* The sled and its load have different speeds at the start. So the bar leaves no forces. An impulse stops the slip, and
 * preserves the momentum on a floor without friction. The sled tips, falls back, and moves at the common speed. */
KT_TEST(slip_that_a_bar_contradicts_ends_with_an_impulse) {
    static const double factors[] = {1.0, 1e-6, 1e6}, v = 0.5, common = (2.0 * v + 1.0) / 3.0;
    const kt_simulation_options options = kt_simulation_options_default();
    const kt_run run = kt_run_within(NULL, 1e-9, 1.0);
    for (size_t i = 0; i < sizeof factors / sizeof *factors; i++) {
        kt_parsed m;
        kt_error error = {0};
        make_sled(&m, 0.0, v, factors[i], false);
        kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
        kt_need_fine("moves", kt_simulation_advance(simulation, 0.3, &error), &error);
        kt_check_near("speed of the sled, m/s", kt_simulation_velocities(simulation)[0], common, 1e-9);
        kt_check_near("speed of the load, m/s", kt_simulation_velocities(simulation)[6], common, 1e-9);
        kt_check_near("height of the load, m", kt_simulation_positions(simulation)[9], 0.3, 1e-9);
        kt_check_near("dissipated energy, relative", kt_simulation_contacts(simulation).dissipated / factors[i],
                      v * v + 0.5 - 1.5 * common * common, 1e-9);
        kt_check_above("impulses that stop slip", (double)kt_simulation_contacts(simulation).jammed, 0.5);
    }
}

/* An arm on a sled leans on the floor with its foot, which slides, and dry friction holds its hinge. */
static const double arm_mass = 0.5, arm_sled = 2.0, arm_com = 0.2, arm_length = 0.4, arm_depth = 0.1;

static void make_arm(kt_parsed *m, double S, double speed, double mu, double pull, bool is_driven) {
    char text[1024];
    (void)snprintf(text, sizeof text,
                   "kinetree: 1\ngravity: [%.17g, 0, -9.81]\nbodies:\n%s"
                   "  - {name: sled, %sjoint: {type: prismatic, axis: x, velocity: %g}, mass: %g}\n"
                   "  - {name: arm, parent: sled, joint: {type: revolute, axis: y, at: [0, 0, %g]}, mass: %g,\n"
                   "     com: [%g, 0, 0], inertia: [0.01, 0.01, 0.01], markers: {foot: [%g, 0, %g]}}\n"
                   "%seffects:\n"
                   "  - {type: contact, point: arm.foot, plane: {body: world}, restitution: 0, friction: %g}\n"
                   "  - {type: joint_friction, joint: arm, coulomb: %g, stick: true}\n",
                   -pull, is_driven ? "  - {name: lift, joint: {type: prismatic, axis: z}, mass: 1}\n" : "",
                   is_driven ? "parent: lift, " : "", speed, arm_sled, arm_depth, arm_mass, arm_com, arm_length,
                   -arm_depth, is_driven ? "loops: [{name: hold, type: motion, joint: lift, position: 0}]\n" : "", mu,
                   S);
    kt_parsed_make(m, text);
}

/* The law permits many normal forces N, each with another friction. At a vertex of these, friction in the hinge carries
 * the arm alone if it can, N = 0. Otherwise it is at its limit, N (l -+ mu d) = m g c - S with the foot at (l, -d). A
 * drive may hold the height. Before, the equations of the modes had no unique forces, and the run ended at its
 * start. */
KT_TEST(a_foot_that_slides_shares_no_load_with_dry_friction) {
    static const double mu = 0.2, pull = 1.3, end = 0.2;
    static const double limit[] = {0.5, 1.5}, speed[] = {0.0, 1.0, -1.0};
    for (int k = 0; k < 24; k++) {
        const int is_driven = k / 12, i = k / 6 % 2, is_fixed = k / 3 % 2;
        const double v = speed[k % 3], side = v > 0.0 ? 1.0 : -1.0;
        const double N = fmax(arm_mass * 9.81 * arm_com - limit[i], 0.0) / (arm_length - side * mu * arm_depth);
        kt_parsed m;
        kt_note("%s, S = %g, v = %g, %s", is_driven ? "driven" : "free", limit[i], v, is_fixed ? "rk4" : "dopri5");
        make_arm(&m, limit[i], v, mu, pull, is_driven);
        const kt_simulation_options options = kt_simulation_options_default();
        const kt_run run = kt_run_fixed(is_fixed ? "rk4" : "dopri5", is_fixed ? 1e-3 : 0.0, end);
        kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
        kt_test_advance(simulation, end);
        const double *at = kt_simulation_velocities(simulation) + is_driven;
        kt_check_near("speed of the sled, m/s", at[0], v - end * (pull + side * mu * N / (arm_mass + arm_sled)), 1e-12);
        kt_check_near("rate of the arm, rad/s", at[1], 0.0, 1e-12);
        const kt_contact_excess excess = kt_simulation_contact_excess(simulation);
        kt_check_equal_int("steps with forces beyond the law", (long long)excess.steps, 0);
    }
}
