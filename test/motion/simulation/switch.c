/* Loops and effects that are switched while a simulation runs, against closed forms. A clutch grips and releases
 * between two discs with springs. Invalid switches are rejected.
 *
 * The discs have moments of inertia A and B, springs a and b to the ground, and angles x and y. Apart, each is an
 * oscillator. While the clutch holds, x' = y', so that with d = y - x, which stays, and s = (a + b) / (A + B),
 *     x'' = -s (x - c),   c = -b d / (a + b)
 * When it grips both turn at (A x' + B y') / (A + B), and A B / (A + B) (x' - y')^2 / 2 is lost. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/integrator.h"
#include "kinetree/loop.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <string.h>

#include "check.h"
#include "interpose.h"
#include "scenes.h"

static const double A = 0.4, B = 1.1, a = 7.0, b = 3.0, period = 0.3, end = 3.2;

typedef struct discs {
    kt_body body[2];
    kt_loop clutch;
    kt_term term[2];
    kt_effect spring[2];
    kt_description description;
} discs;

static void discs_make(discs *d) {
    static const char *const names[2] = {"x", "y"};
    *d = (discs){.clutch = kt_loop_default(), .description = kt_description_default()};
    for (int i = 0; i < 2; i++) {
        d->body[i] = kt_body_of(names[i], NULL, KT_JOINT_REVOLUTE, 1.0);
        d->body[i].inertia.xx = d->body[i].inertia.yy = d->body[i].inertia.zz = i ? B : A;
        d->body[i].joint.position[0] = i ? -0.5 : 1.0;
        d->body[i].joint.velocity[0] = i ? 2.0 : -0.3;
        d->term[i] = (kt_term){.joint = names[i], .coefficient = i ? -1.0 : 1.0};
        d->spring[i] = kt_effect_of(KT_EFFECT_JOINT_SPRING, names[i]);
        d->spring[i].stiffness = i ? b : a;
    }
    d->clutch.name = "clutch";
    d->clutch.type = KT_LOOP_RATES;
    d->clutch.terms = d->term;
    d->clutch.term_count = 2;
    d->clutch.switching = KT_SWITCHED_OFF;
    kt_describe(&d->description, d->body, 2, &d->clutch, 1, d->spring, 2);
}

/* x(t + h) of an oscillator of frequency w about c. */
static void turn(double w, double c, double h, double *x, double *v) {
    const double x0 = *x - c, v0 = *v;
    *x = c + x0 * cos(w * h) + v0 / w * sin(w * h);
    *v = v0 * cos(w * h) - w * x0 * sin(w * h);
}

/* The state at the end, and the lost energy. */
static double closed_form(double q[2], double v[2]) {
    double lost = 0.0;
    q[0] = 1.0;
    q[1] = -0.5;
    v[0] = -0.3;
    v[1] = 2.0;
    for (int n = 0; n * period < end; n++) {
        const double h = fmin(period, end - n * period), c = -b * (q[1] - q[0]) / (a + b);
        if (n % 2 == 0) {
            turn(sqrt(a / A), 0.0, h, &q[0], &v[0]);
            turn(sqrt(b / B), 0.0, h, &q[1], &v[1]);
            continue;
        }
        const double d = q[1] - q[0];
        lost += 0.5 * A * B / (A + B) * (v[0] - v[1]) * (v[0] - v[1]);
        v[0] = (A * v[0] + B * v[1]) / (A + B);
        turn(sqrt((a + b) / (A + B)), c, h, &q[0], &v[0]);
        q[1] = q[0] + d;
        v[1] = v[0];
    }
    return lost;
}

typedef struct switcher {
    int count;
    double lost;
} switcher;

/* Changes its sign every period. */
static int clock_of(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error, (void)user;
    *value = sin(3.14159265358979323846 * at->t / period);
    return 0;
}

static int toggle(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    switcher *s = user;
    double loss = 0.0;
    (void)what;
    const uint64_t set = kt_switch_set(kt_simulation_model(simulation));
    if (kt_simulation_set_switches(simulation, set ^ 1, &loss, error) != KT_OK)
        return -1;
    s->count++;
    s->lost += loss;
    return 0;
}

static kt_simulation *simulate(const kt_model *model, const kt_run *run, unsigned record, switcher *s) {
    kt_simulation_options options = kt_simulation_options_default();
    kt_error error = {0};
    options.events = 1;
    options.record = record;
    kt_simulation *simulation = kt_test_simulation(model, run, &options);
    const kt_event event = {.name = "clutch", .function = clock_of, .action = toggle, .user = s};
    (void)kt_fine("event", kt_simulation_event_add(simulation, &event, &error), &error);
    return simulation;
}

static double error_of(const kt_simulation *simulation) {
    double q[2], v[2], most = 0.0;
    (void)closed_form(q, v);
    for (int i = 0; i < 2; i++)
        most = fmax(most, fmax(fabs(kt_simulation_positions(simulation)[i] - q[i]),
                               fabs(kt_simulation_velocities(simulation)[i] - v[i])));
    return most;
}

static double error_with(const kt_model *model, const char *method, double step) {
    const kt_run run = kt_run_fixed(method, step, end);
    kt_error error = {0};
    switcher s = {0};
    kt_simulation *simulation = simulate(model, &run, 0, &s);
    (void)kt_fine(method, kt_simulation_advance(simulation, end, &error), &error);
    kt_check_equal_int("events", s.count, 10);
    const double most = error_of(simulation);
    return most;
}

KT_TEST(methods_keep_their_order_across_ten_switches) {
    static const struct {
        const char *name;
        double order, step;
    } methods[] = {{"heun", 2, 0.01},   {"kutta3", 3, 0.01},  {"rk4", 4, 0.02},   {"dopri5", 5, 0.04},
                   {"tsit5", 5, 0.04},  {"dop853", 8, 0.1},   {"bdf2", 2, 0.002}, {"rkc2", 2, 0.01},
                   {"radau5", 5, 0.05}, {"rodas5p", 5, 0.04}, {"ab4", 4, 0.005}};
    discs d;
    discs_make(&d);
    kt_model *model = kt_scene_compile(&d.description);
    for (size_t m = 0; m < sizeof methods / sizeof methods[0]; m++) {
        if (kt_method_find(methods[m].name) == NULL) {
            kt_note("there is no %s", methods[m].name);
            continue;
        }
        const double coarse = error_with(model, methods[m].name, methods[m].step);
        const double fine = error_with(model, methods[m].name, 0.5 * methods[m].step);
        kt_note("%s: %.3g, %.3g", methods[m].name, coarse, fine);
        kt_check_above("order", log2(coarse / fine), methods[m].order - 0.35);
    }
}

/* All of the energy that the clutch takes, in the balance; and the balance itself. */
KT_TEST(what_a_clutch_loses_is_dissipated) {
    discs d;
    double q[2], v[2];
    discs_make(&d);
    kt_model *model = kt_scene_compile(&d.description);
    kt_run run = kt_run_default();
    kt_error error = {0};
    switcher s = {0};
    run.relative = run.absolute = 1e-12;
    run.integrator = "dop853";
    kt_simulation *simulation = simulate(model, &run, KT_RECORD_BALANCE | KT_RECORD_ENERGY, &s);
    kt_record first = {0}, last = {0};
    kt_need_fine("sense", kt_simulation_sense(simulation, &first, &error), &error);
    kt_test_advance(simulation, end);
    kt_need_fine("sense", kt_simulation_sense(simulation, &last, &error), &error);
    const double lost = closed_form(q, v);
    kt_check_near("state", error_of(simulation), 0.0, 1e-10);
    kt_check_near("lost, J", s.lost, lost, 1e-10);
    kt_check_near("dissipated, J", last.work.dissipated, lost, 1e-10);
    kt_check_near("supplied, J", last.work.supplied, 0.0, 1e-10);
    kt_check_near("balance, J", last.kinetic + last.potential + last.work.dissipated - last.work.supplied,
                  first.kinetic + first.potential, 4e-12);
}

/* A checkpoint holds the set of switches: the second half has the bits of a run that never stopped. The methods are an
 * explicit, an implicit and a multistep one, and nothing is allocated. */
KT_TEST(checkpoint_between_switches_goes_on_with_the_same_bits) {
    static const struct {
        const char *name;
        double step;
    } methods[] = {{"dopri5", 0.0}, {"radau5", 0.0}, {"rkc2", 0.0}, {"bdf2", 0.004}, {"ab4", 0.007}};
    discs d;
    discs_make(&d);
    kt_model *model = kt_scene_compile(&d.description);
    for (size_t m = 0; m < sizeof methods / sizeof methods[0]; m++) {
        kt_run run = methods[m].step > 0.0 ? kt_run_fixed(methods[m].name, methods[m].step, end) : kt_run_default();
        kt_error error = {0};
        switcher s = {0}, again = {0};
        run.integrator = methods[m].name;
        run.relative = run.absolute = 1e-7;
        kt_simulation *one = simulate(model, &run, 0, &s), *two = simulate(model, &run, 0, &again);
        kt_test_advance(one, 1.0);
        kt_need(kt_scene_hand_over(one, two));
        kt_check_equal_int("the clutch holds", (long long)kt_switch_set(kt_simulation_model(one)), 1);
        kt_interpose_start();
        const kt_status status = kt_simulation_advance(one, end, &error);
        kt_check_equal_int("allocations", kt_interpose_stop(), 0);
        (void)kt_fine("second half", status, &error);
        kt_check_equal_int("it holds again", (long long)kt_switch_set(kt_simulation_model(two)), 1);
        kt_test_advance(two, end);
        kt_scene_check_equal("state", two, one);
    }
}

/* A coupling that is 1.5 rad from closed cannot be switched on, and neither can a switch that does not exist. The
 * simulation keeps its state and continues. */
KT_TEST(a_switch_that_is_rejected_leaves_the_simulation) {
    discs d;
    discs_make(&d);
    d.clutch.type = KT_LOOP_COUPLING;
    kt_model *model = kt_scene_compile(&d.description);
    const kt_run run = kt_run_default();
    kt_error error = {0};
    kt_simulation *one = kt_test_simulation(model, &run, NULL);
    kt_simulation *two = kt_test_simulation(model, &run, NULL);
    kt_check_true("open", kt_simulation_set_switches(one, 1, NULL, &error) == KT_ERROR_CONSTRAINT);
    kt_check_true("in words", strstr(error.message, "open by 1.5 (m or rad)") != NULL);
    kt_check_true("no such switch", kt_simulation_set_switches(one, 2, NULL, &error) == KT_ERROR_ARGUMENT);
    kt_check_true("still off", kt_simulation_model(one) == model);
    kt_test_advance(one, 0.2);
    kt_test_advance(two, 0.2);
    kt_check_equal_bits("positions", kt_simulation_positions(one), kt_simulation_positions(two), 2);
}

/* A coupling that is 1.5 rad from holding is closed if the options allow it: by the least change of both angles. */
KT_TEST(a_switch_closes_a_gap_that_the_options_allow) {
    static const double gaps[] = {1.4, 1.6};
    for (int i = 0; i < 2; i++) {
        discs d;
        discs_make(&d);
        d.clutch.type = KT_LOOP_COUPLING;
        kt_model *model = kt_scene_compile(&d.description);
        const kt_run run = kt_run_default();
        kt_simulation_options options = kt_simulation_options_default();
        kt_error error = {0};
        kt_residual residual = {0.0, 0.0};
        options.switch_gap = gaps[i];
        kt_simulation *one = kt_test_simulation(model, &run, &options);
        kt_check_equal_int("switch", kt_simulation_set_switches(one, 1, NULL, &error),
                           i == 0 ? KT_ERROR_CONSTRAINT : KT_OK);
        if (i == 0) {
            kt_check_contains("the remedy of a scene", error.message,
                              "more than 1.4; switch them on when they are closed: change the start or the event");
            kt_check_contains("the remedy of a program", error.message,
                              "in C may raise kt_simulation_options.switch_gap");
        }
        const kt_model *now = kt_simulation_model(one);
        kt_data *data = kt_test_data(now);
        (void)kt_fine("residual",
                      kt_loop_residual(now, data, 0.0, kt_simulation_positions(one), kt_simulation_velocities(one),
                                       &residual, &error),
                      &error);
        kt_check_near("closed", residual.position, 0.0, 1e-14);
        kt_test_advance(one, 0.2);
    }
}
