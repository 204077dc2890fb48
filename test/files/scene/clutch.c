/* Clutches that events of a scene open and close. One grips at once, and one has dry friction that sticks. They are
 * compared with closed forms, with a time stepping of the test, and with differences. Further tests cover the friction
 * of joints that something else moves. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/dynamics.h"
#include "kinetree/loop.h"

#include <float.h>

#include "watched.h"

/* ---- a clutch grips ---------------------------------------------------------------------------------------------- */

static const char clutch[] =
    "kinetree: 1\n"
    "bodies:\n"
    "  - {name: engine, joint: {type: revolute, velocity: 10}, mass: 1, inertia: [0.3, 0.3, 0.3]}\n"
    "  - {name: load, joint: {type: revolute, velocity: -2}, mass: 1, inertia: [0.5, 0.5, 0.5]}\n"
    "loops:\n"
    "  - {name: clutch, type: rates, coefficients: {engine: 1, load: -1}, switched: off}\n"
    "effects:\n"
    "  - {name: drive, type: motor, joint: engine, torque: 6}\n"
    "events:\n"
    "  - {name: grip, when: t - 0.5, direction: rising, then: [{engage: clutch}, {release: drive}]}\n"
    "simulate: {duration: 2, until: t - 1, tolerance: 1e-12}\n";

/* At 0.5 s, the engine turns at 20 rad/s. The common speed and the loss are
 *     (0.3 20 - 0.5 2) / 0.8,   0.3 0.5 / 0.8 22^2 / 2.
 * Constant accelerations are integrated exactly, so the differences are rounding. */
KT_TEST(a_clutch_that_grips_loses_what_two_discs_do) {
    rows r;
    run_scene(clutch, "dopri5", &r);
    kt_need(kt_check_equal_int("rows", r.count, 3));
    const double lost = 0.5 * 0.3 * 0.5 / 0.8 * 22.0 * 22.0, rounding = 64.0 * DBL_EPSILON;
    kt_check_near("engine before", r.v[0][0], 20.0, 20.0 * rounding);
    kt_check_near("engine behind", r.v[1][0], 6.25, 6.25 * rounding);
    kt_check_near("load behind", r.v[1][1], 6.25, 6.25 * rounding);
    kt_check_near("lost, J", r.dissipated[1] - r.dissipated[0], lost, lost * rounding);
    kt_check_near("nothing drives it any more", r.v[2][0], 6.25, 6.25 * rounding);
    kt_check_near("energy", r.total[2], r.total[0], r.total[0] * rounding);
}

/* Two discs on one axis, with dry friction between them that is released at first. */
static const char plates[] =
    "kinetree: 1\n"
    "gravity: [0, 0, 0]\n"
    "bodies:\n"
    "  - {name: engine, joint: {type: revolute, velocity: 10}, mass: 1, inertia: [0.3, 0.3, 0.3]}\n"
    "  - {name: load, parent: engine, joint: {type: revolute, velocity: -10}, mass: 1, inertia: [0.5, 0.5, 0.5]}\n"
    "effects:\n"
    "  - {name: plates, type: joint_friction, joint: load, coulomb: 2, static: 3, stribeck: 0, stick: true, switched: "
    "off}\n"
    "  - {name: drive, type: motor, joint: engine, torque: 1}\n"
    "events:\n"
    "  - {name: close, when: t - 0.5, then: {engage: plates}}\n"
    "  - {name: open, when: t - 3, then: {release: plates}}\n"
    "  - {name: again, when: t - 3.5, then: {engage: plates}}\n"
    "  - {name: idle, when: t - 4, then: {release: drive}}\n"
    "  - {name: part, when: t - 4.5, then: {release: plates}}\n"
    "  - {name: hold, when: t - 5, then: {engage: plates}}\n"
    "  - {name: pull, when: t - 5.5, then: {engage: drive}}\n"
    "simulate: {duration: 7, until: t - 6, tolerance: 1e-12}\n";

/* Released, the drive has the engine alone. Engaged, the plates slip with C until both turn alike, after
 *     r / ((C - P) / I1 + C / I2),
 * and then have one acceleration. Discs that turn alike when they are engaged stick at once. */
KT_TEST(a_clutch_of_friction_is_opened_and_closed) {
    static const char *const methods[] = {"dopri5", "dop853", "radau5", "rkc2", "auto"};
    const double I1 = 0.3, I2 = 0.5, P = 1.0, C = 2.0, closing = (C - P) / I1 + C / I2, both = P / (I1 + I2);
    const double r1 = 10.0 + 0.5 * P / I1, d1 = r1 / closing, w3 = C / I2 * d1 + both * (2.5 - d1);
    const double r2 = 0.5 * P / I1, d2 = r2 / closing, w4 = w3 + C / I2 * d2 + both * (0.5 - d2);
    const double lost = 0.5 * C * (r1 * d1 + r2 * d2), w6 = w4 + 0.5 * both;
    const double engine[15] = {r1, r1, w3, w3, w3 + r2, w3 + r2, w4, w4, w4, w4, w4, w4, w4, w4, w6};
    const double slip[15] = {-r1, -r1, 0.0, 0.0, -r2, -r2, 0.0};
    /* The first switch is that of the stick. The others are that of its effect, and that of the drive. */
    static const uint64_t sets[15] = {7, 6, 5, 7, 7, 6, 5, 1, 1, 3, 3, 1, 1, 5, 5};
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        rows r;
        double worst = 0.0;
        kt_note("%s", methods[m]);
        run_scene(plates, methods[m], &r);
        kt_need(kt_check_equal_int("rows", r.count, 15));
        for (int i = 0; i < 15; i++) {
            kt_check_equal_int("set", (long long)r.set[i], (long long)sets[i]);
            worst = fmax(worst, fmax(fabs(r.v[i][0] - engine[i]), fabs(r.v[i][1] - slip[i])));
            worst = fmax(worst, fabs(r.total[i] - r.total[0]));
        }
        kt_check_below("speeds, rad/s, and balance, J", worst, 1e-12);
        kt_check_near("dissipated, J", r.dissipated[14], lost, 1e-12);
        kt_check_near("sticks to the bit", r.q[14][1], r.q[6][1], 0.0);
        kt_check_equal_int("sticks", (long long)r.counts.sticks, 3);
        kt_check_equal_int("slips: what is released does not", (long long)r.counts.slips, 0);
    }
}

KT_TEST(checkpoint_of_an_open_clutch_goes_on_with_the_same_bits) {
    const running one = begin_with(plates, NULL, KT_RECORD_BALANCE), two = begin_with(plates, NULL, KT_RECORD_BALANCE);
    kt_error error = {0};
    void *block = running_room(&one, 1);
    running_advance(&one, 3.2);
    kt_check_equal_int("released", (long long)kt_simulation_released(one.simulation), 1);
    kt_simulation_save(one.simulation, block);
    running_advance(&one, 6.0);
    kt_need_fine("restored", kt_simulation_restore(two.simulation, block, &error), &error);
    running_advance(&two, 6.0);
    const kt_work work[2] = {kt_simulation_work(one.simulation), kt_simulation_work(two.simulation)};
    kt_check_equal_bits("q", kt_simulation_positions(two.simulation), kt_simulation_positions(one.simulation), 2);
    kt_check_equal_bits("v", kt_simulation_velocities(two.simulation), kt_simulation_velocities(one.simulation), 2);
    kt_check_equal_bits("dissipated", &work[1].dissipated, &work[0].dissipated, 1);
    kt_check_equal_int("sticks", (long long)kt_simulation_contacts(two.simulation).sticks, 3);
    const uint64_t both = 3; /* the switch of its effect is none of those that are released */
    kt_check_equal_int("rejected", kt_simulation_set_released(one.simulation, both, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("begins anew",
                       kt_simulation_set_state(one.simulation, 0.0, (double[2]){0.0}, (double[2]){0.0}, &error), KT_OK);
    kt_check_equal_int("released as at first", (long long)kt_simulation_released(one.simulation), 1);
}

/* A load on a spring, on which an engine turns with friction; its clutch opens and closes by the load's speed. */
static const char jerks[] =
    "kinetree: 1\n"
    "gravity: [0, 0, 0]\n"
    "bodies:\n"
    "  - {name: load, joint: {type: revolute}, mass: 1, inertia: [0.5, 0.5, 0.5]}\n"
    "  - {name: engine, parent: load, joint: {type: revolute}, mass: 1, inertia: [0.3, 0.3, 0.3]}\n"
    "effects:\n"
    "  - {type: joint_spring, joint: load, stiffness: 6}\n"
    "  - {name: plates, type: joint_friction, joint: engine, coulomb: 0.8, stick: true}\n"
    "  - {type: expression, joint: engine, force: 1.5*cos(2*t)}\n"
    "events:\n"
    "  - {name: open, when: velocity.load > 0.2, then: {release: plates}}\n"
    "  - {name: close, when: velocity.load < 0.05, then: {engage: plates}}\n"
    "simulate: {duration: 10, until: t - 6, tolerance: 1e-12}\n";

/* The same motion with the time stepping of the test. Each step applies the impulse that would stop the slip at its
 * end, cut off at C h. *opened: how often the clutch opened. */
static void step_jerks(double h, double *q, double *v, int *opened) {
    const double I1 = 0.3, I2 = 0.5, C = 0.8, k = 6.0;
    double angle = 0.0, turned = 0.0, w1 = 0.0, w2 = 0.0, before = 0.0;
    bool acts = true;
    *opened = 0;
    for (int n = 0; n < (int)lround(6.0 / h); n++) {
        const double P = 1.5 * cos(2.0 * (n + 0.5) * h);
        w1 += h * P / I1;
        w2 += h * (-P - k * angle) / I2;
        const double stop = (w1 - w2) / (1.0 / I1 + 1.0 / I2), p = acts ? fmax(-C * h, fmin(C * h, stop)) : 0.0;
        w1 -= p / I1;
        w2 += p / I2;
        angle += h * w2;
        turned += h * (w1 - w2);
        *opened += before <= 0.2 && w2 > 0.2;
        acts = before <= 0.2 && w2 > 0.2 ? false : before >= 0.05 && w2 < 0.05 ? true : acts;
        before = w2;
    }
    q[0] = angle, q[1] = turned, v[0] = w2, v[1] = w1 - w2;
}

KT_TEST(a_clutch_agrees_with_a_time_stepping_of_its_own) {
    rows r;
    double q[2], v[2];
    int opened;
    run_scene(jerks, "dop853", &r);
    kt_need(kt_check_above("rows", (double)r.count, 8.5));
    const int last = r.count - 1;
    kt_check_above("sticks", (double)r.counts.sticks, 1.5);
    for (int power = 4; power <= 6; power++) {
        const double h = pow(10.0, -power);
        double worst = 0.0;
        step_jerks(h, q, v, &opened);
        for (int i = 0; i < 2; i++)
            worst = fmax(worst, fmax(fabs(q[i] - r.q[last][i]), fabs(v[i] - r.v[last][i])));
        kt_note("%d openings, %d rows, %llu sticks", opened, r.count, (unsigned long long)r.counts.sticks);
        kt_check_below("difference, in steps of time", worst / h, 10.0);
    }
}

/* The slip of the plates, and the time at which they stick, depend on the speed at which the load begins. The clutch of
 * the other two opens and closes at given times. */
KT_TEST(derivatives_pass_a_clutch_that_is_opened_and_closed) {
    check_derivatives(plates, 4.9, -10.0);
    check_derivatives(jerks, 6.0, 1.0);
}

/* Neighbours of discs that turn alike slip when the clutch is closed, and have other equations from there on. */
KT_TEST(derivatives_reject_a_clutch_that_is_closed_at_rest) {
    double A[16];
    const running w = begin_with(plates, NULL, 0);
    kt_error error = {0};
    size_t size;
    void *work = take_motion_work(&w, &size);
    kt_check_equal_int("rejected", kt_motion_derivatives(w.simulation, work, size, 6.0, A, NULL, &error),
                       KT_ERROR_SINGULAR);
    kt_check_contains("where", error.where, "event 'hold' at t = 5 s");
}

/* ---- friction of joints that others move ------------------------------------------------------------------------- */

/* A shaft that is driven by 1 rad, rests, and is driven back, twice; its brake is put on while it rests. */
static const char brake[] =
    "kinetree: 1\n"
    "gravity: [0, 0, 0]\n"
    "bodies: [{name: shaft, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}]\n"
    "loops:\n"
    "  - {name: drive, type: motion, joint: shaft,\n"
    "     position: {table: [[0, 0], [1, 1], [2, 1], [3, 0], [4, 0], [5, 1]], interpolation: monotone}}\n"
    "effects: [{name: brake, type: joint_friction, joint: shaft, coulomb: 0.7, stick: true, switched: off}]\n"
    "events: [{name: on, when: t - 1.5, then: {engage: brake}}]\n"
    "simulate: {duration: 6, until: t - 5, tolerance: 1e-10}\n";

/* A body in a guide with friction lies on a table that is driven down and up again. */
static const char guide[] =
    "kinetree: 1\n"
    "gravity: [0, 0, -9.81]\n"
    "bodies:\n"
    "  - {name: table, joint: {type: prismatic, axis: z}, mass: 1}\n"
    "  - {name: body, joint: {type: prismatic, axis: z}, mass: 1, markers: {foot: [0, 0, 0]}}\n"
    "loops:\n"
    "  - {name: drive, type: motion, joint: table,\n"
    "     position: {table: [[0, 0], [1, 0], [2, -0.2], [3, -0.2], [4, 0]], interpolation: monotone}}\n"
    "effects:\n"
    "  - {name: guide, type: joint_friction, joint: body, coulomb: 2, stick: true}\n"
    "  - {name: contact, type: contact, point: body.foot, plane: table, restitution: 0}\n"
    "simulate: {duration: 5, until: t - 4, tolerance: 1e-10}\n";

/* A drive holds the joint and moves it on, to either side. Friction opposes the motion there and back, and dissipates C
 * times the way. */
KT_TEST(friction_of_a_joint_that_is_moved_follows_where_it_has_rested) {
    static const char *const methods[] = {"dopri5", "dop853", "radau5"};
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        rows r;
        kt_note("%s", methods[m]);
        run_scene(brake, methods[m], &r);
        kt_check_near("braked, J", r.dissipated[r.count - 1], 0.7 * 2.0, 64.0 * DBL_EPSILON);
        run_scene(guide, methods[m], &r);
        kt_check_near("in the guide, J", r.dissipated[r.count - 1], 2.0 * 0.4, 64.0 * DBL_EPSILON);
    }
}

/* A block on a table, with dry friction along one coordinate of its joint alone. With mu = C / m, a thrown block comes
 * to rest along it after v / mu, at v^2 / (2 mu) from its start. It stays there along this coordinate and moves on
 * freely along the others. */
static const char block[] = "kinetree: 1\n"
                            "gravity: [0, 0, 0]\n"
                            "bodies:\n"
                            "  - name: b\n"
                            "    joint: {type: %s, velocity: [%s]}\n"
                            "    mass: 2\n"
                            "    inertia: [0.5, 0.5, 0.5]\n"
                            "effects: [{name: rub, type: joint_friction, joint: \"b[%d]\", coulomb: 3, stick: true}]\n"
                            "simulate: {duration: 5, until: t - 4, tolerance: 1e-10}\n";

KT_TEST(friction_sticks_in_one_coordinate_of_a_joint) {
    static const struct {
        const char *joint, *velocity;
        double v[3], inertia[3];
        int count;
    } cases[] = {
        {"planar", "1.5, -2, 0.7", {1.5, -2.0, 0.7}, {2.0, 2.0, 0.5}, 3},
        {"planar, axis: y", "1.5, -2, 0.7", {1.5, -2.0, 0.7}, {2.0, 2.0, 0.5}, 3},
        {"cylindrical", "-1.5, 0.7", {-1.5, 0.7}, {0.5, 2.0}, 2},
    };
    static const char *const methods[] = {"dopri5", "dop853", "radau5"};
    for (size_t i = 0; i < 3 * sizeof cases / sizeof *cases; i++)
        for (int k = 0; k < cases[i / 3].count; k++) {
            char text[800];
            rows r;
            (void)snprintf(text, sizeof text, block, cases[i / 3].joint, cases[i / 3].velocity, k);
            kt_note("%s, coordinate %d, %s", cases[i / 3].joint, k, methods[i % 3]);
            run_scene(text, methods[i % 3], &r);
            for (int j = 0; j < cases[i / 3].count; j++) {
                const double v = cases[i / 3].v[j], m = cases[i / 3].inertia[j];
                kt_check_near("place", r.q[r.count - 1][j], j == k ? v * fabs(v) * m / (2.0 * 3.0) : 4.0 * v, 1e-9);
                kt_check_near("speed", r.v[r.count - 1][j], j == k ? 0.0 : v, j == k ? 0.0 : 1e-9);
            }
            const double v = cases[i / 3].v[k];
            kt_check_near("dissipated, J", r.dissipated[r.count - 1], 0.5 * cases[i / 3].inertia[k] * v * v, 1e-9);
            kt_check_equal_int("sticks", (long long)r.counts.sticks, 1);
        }
}

/* Hard stops on both sides of one coordinate throw it back with half its speed. The stop at 0.5 m acts after 0.25 s.
 * The stop at -0.5 m acts after 1.25 s. */
KT_TEST(a_hard_stop_bounds_one_coordinate_of_a_joint) {
    static const char text[] =
        "kinetree: 1\n"
        "gravity: [0, 0, 0]\n"
        "bodies: [{name: b, joint: {type: planar, axis: y, velocity: [1.5, 2, 0.7]}, mass: 2, inertia: [0.5, 0.5, "
        "0.5]}]\n"
        "effects: [{name: stop, type: joint_limit, joint: \"b[1]\", lower: -0.5, upper: 0.5, restitution: 0.5}]\n"
        "simulate: {duration: 5, until: t - 2, tolerance: 1e-10}\n";
    rows r;
    run_scene(text, "dopri5", &r);
    const double *q = r.q[r.count - 1], *v = r.v[r.count - 1];
    kt_check_equal_int("impacts", (long long)r.counts.impacts, 2);
    kt_check_near("stopped, m", q[1], -0.5 + 0.5 * 0.75, 1e-12);
    kt_check_near("stopped, m/s", v[1], 0.5, 1e-12);
    kt_check_near("free, m", q[0], 3.0, 1e-12);
    kt_check_near("free, rad", q[2], 1.4, 1e-12);
}

/* Elastic stops and smoothed friction may act in coordinates of loops. */
KT_TEST(stops_and_friction_that_sticks_are_rejected_in_coordinates_of_loops) {
    static const char text[] = "kinetree: 1\n"
                               "bodies: [{name: b, joint: {type: free}, mass: 2, inertia: [0.5, 0.5, 0.5]}]\n"
                               "loops: [{name: hinge, type: revolute, between: [world, b], axis: z}]\n"
                               "effects:\n"
                               "  - {name: rub, type: joint_friction, joint: hinge, coulomb: 5, stick: true}\n"
                               "  - {name: stop, type: joint_limit, joint: \"hinge[0]\", upper: 1, restitution: 0.5}\n"
                               "simulate: {duration: 1}\n";
    kt_scene *scene = kt_test_scene_place();
    kt_check_true("rejected", !running_parse(text, NULL, scene));
    kt_check_contains(
        "friction", running_faults.text,
        "effect 'rub': 'hinge' is a coordinate of a loop; friction that sticks acts in one of a joint: leave "
        "`stick` out");
    kt_check_contains("stop", running_faults.text,
                      "effect 'stop': 'hinge[0]' is a coordinate of a loop; a hard stop (restitution) acts in one of a "
                      "joint: give a stiffness instead");
}
