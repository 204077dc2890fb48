/* Several frictions of one joint that stick, against closed forms and against one friction with the sums of their
 * limits. */
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "check.h"
#include "parsed.h"

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
    options.record = KT_RECORD_MULTIPLIER;
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
                      -amplitude * sin(rate * record->time) * friction[i].limit / limit, 1e-12);
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
    options.record = KT_RECORD_MULTIPLIER;
    kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
    kt_test_run(simulation, check_shares, friction);
}
