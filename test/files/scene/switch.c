/* Events of scenes that release and engage. Against closed forms: a string that is let go, and a rimless wheel that
 * rolls down a slope. A trebuchet is compared with GSL, and a woodpecker toy, whose hard contacts jam and peck, with
 * its published orbit. Also a spinning coin, to its end; prescribed motions into boundaries; and rejected scenes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/dynamics.h"
#include "kinetree/loop.h"

#include <float.h>
#include <stdio.h>

#ifdef HAS_GSL
#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>
#endif

#include "coin.h"
#include "difference.h"
#include "trebuchet.h"
#include "watched.h"
#include "woodpecker.h"

/* ---- a string is let go ------------------------------------------------------------------------------------------ */

#define PENDULUM(rope)                                                                                                 \
    "kinetree: 1\n"                                                                                                    \
    "gravity: [0, -9.81, 0]\n"                                                                                         \
    "bodies:\n"                                                                                                        \
    "  - {name: stone, joint: {type: planar, position: [1, 0, 0]}, mass: 1, inertia: [0.1, 0.1, 0.1],\n"               \
    "     markers: {centre: [0, 0, 0]}}\n"                                                                             \
    "loops:\n"                                                                                                         \
    "  - {name: string, type: distance, between: [world, stone.centre], length: 1" rope "}\n"                          \
    "events:\n"                                                                                                        \
    "  - {name: let go, when: \"marker.stone.centre.x + sqrt(0.5)\", direction: falling, then: {release: string}}\n"   \
    "simulate: {duration: 10, until: \"marker.stone.centre.y < -5\", tolerance: 1e-12}\n"

/* The pendulum starts from rest at the height of the pivot and is released 45 degrees behind the lowest point. There,
 * v^2 = 2 g sqrt(1/2), and a parabola follows. The energy is that of rest at the pivot's height, 0. Bounds: a hundred
 * times the tolerance, 1e-12. */
static void check_parabola(const char *text) {
    static const char *const methods[] = {"dopri5", "dop853", "radau5", "rodas5p"};
    const double s = sqrt(0.5), g = 9.81, v = sqrt(2.0 * g * s);
    const double flight = (v * s + sqrt(v * v * s * s + 2.0 * g * (5.0 - s))) / g;
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        rows r;
        kt_note("%s", methods[m]);
        run_scene(text, methods[m], &r);
        kt_need(kt_check_equal_int("rows", r.count, 3));
        kt_check_equal_int("before, it holds", (long long)r.set[0], 1);
        kt_check_equal_int("behind, it does not", (long long)r.set[1], 0);
        kt_check_near("x speed", r.v[0][0], -v * s, 1e-10);
        kt_check_near("y speed", r.v[0][1], v * s, 1e-10);
        kt_check_equal_bits("nothing jumps", r.v[1], r.v[0], 3);
        kt_check_near("flight, s", r.time[2] - r.time[1], flight, 1e-11);
        kt_check_near("range, m", r.q[2][0], -s - v * s * flight, 1e-10);
        kt_check_near("energy", r.total[2], 0.0, 1e-10);
        kt_check_near("dissipated", r.dissipated[2], 0.0, 1e-12);
    }
}

KT_TEST(derivatives_pass_a_release_of_a_scene) { check_derivatives(PENDULUM(""), 1.0, 0.0); }

KT_TEST(a_string_that_is_let_go_leaves_a_parabola) { check_parabola(PENDULUM("")); }

KT_TEST(a_slack_rope_that_is_let_go_leaves_a_parabola) { check_parabola(PENDULUM(", slack: true")); }

/* Velocities are set in the models of other sets, too: behind a release, and with a marker in the value. */
KT_TEST(velocities_are_set_behind_a_release) {
    rows r;
    run_scene("kinetree: 1\n"
              "bodies:\n"
              "  - {name: stone, joint: {type: planar, position: [1, 0, 0]}, mass: 1, inertia: [0.1, 0.1, 0.1],\n"
              "     markers: {centre: [0, 0, 0]}}\n"
              "loops:\n"
              "  - {name: pin, type: weld, between: [{body: world, at: [1, 0, 0]}, stone.centre]}\n"
              "events:\n"
              "  - {name: let go, when: t - 0.5, then: {release: pin}}\n"
              "  - {name: push, when: t - 1, then: {set: {\"velocity.stone[1]\": 2 + marker.stone.centre.x}}}\n"
              "simulate: {duration: 2, until: t - 1.5, tolerance: 1e-12}\n",
              "dopri5", &r);
    kt_need(kt_check_equal_int("rows", r.count, 5));
    kt_check_near("before, m/s", r.v[2][1], 0.0, 0.0);
    kt_check_near("behind, m/s", r.v[3][1], 3.0, 1e-14);
}

/* ---- a floor and a net ------------------------------------------------------------------------------------------- */

/* Two bodies fall 1 m and lie. The first lies on a stop, and the second lies with friction on a plane. At 1 s, these
 * are taken away, and a net is spread for the first. */
#define FLOORS(more)                                                                                                   \
    "kinetree: 1\n"                                                                                                    \
    "gravity: [0, 0, -9.81]\n"                                                                                         \
    "bodies:\n"                                                                                                        \
    "  - {name: a, joint: {type: prismatic, axis: z, position: 1}, mass: 1}\n"                                         \
    "  - {name: b, joint: {type: free, position: {position: [0, 0, 1]}}, mass: 1, inertia: [1, 1, 1], markers: {p: "   \
    "[0, 0, 0]}}\n"                                                                                                    \
    "effects:\n"                                                                                                       \
    "  - {name: floor, type: joint_limit, joint: a, lower: 0, upper: 5, restitution: 0}\n"                             \
    "  - {name: table, type: contact, point: b.p, plane: world, restitution: 0, friction: 0.5}\n"                      \
    "  - {name: net, type: joint_limit, joint: a, lower: -1, restitution: 0, switched: off}\n"                         \
    "events:\n"                                                                                                        \
    "  - {name: open, when: t - 1, then: [{release: floor}, {release: table}]}\n"                                      \
    "  - {name: spread, when: position.a + 0.5, direction: falling, then: {engage: net}}\n" more                       \
    "simulate: {duration: 3, until: t - 2, tolerance: 1e-12}\n"

KT_TEST(stops_and_contacts_are_released_and_engaged) {
    const double g = 9.81;
    rows r;
    run_scene(FLOORS(""), "dopri5", &r);
    kt_need(kt_check_equal_int("rows", r.count, 5));
    kt_check_near("lies", r.q[0][0], 0.0, 1e-15);
    kt_check_true("closed before, not behind", r.set[0] != 0 && r.set[1] == 0);
    kt_check_near("spread, s", r.time[2], 1.0 + sqrt(1.0 / g), 16.0 * DBL_EPSILON);
    kt_check_near("speed there, m/s", r.v[3][0], -sqrt(g), 1e-11);
    kt_check_near("the net holds it", r.q[4][0], -1.0, 1e-15);
    kt_check_near("at rest", r.v[4][0], 0.0, 1e-15);
    kt_check_near("no table holds the other one", r.q[4][3], -0.5 * g, 1e-12);
    kt_check_near("dissipated: both falls, and into the net", r.dissipated[4], 3.0 * g, 1e-12);
}

/* If a stop is engaged while it is beyond its boundary, the run ends with a message. A stop that is closed while others
 * are engaged is counted once. */
KT_TEST(a_floor_above_what_has_fallen_is_rejected) {
    kt_error error = {0};
    const running w = begin_with(FLOORS("  - {name: early, when: t - 0.8, then: {engage: net}}\n"
                                        "  - {name: back, when: t - 1.2, then: {engage: floor}}\n"),
                                 NULL, 0);
    const uint64_t all = (uint64_t)1 << kt_loop_switch(w.model, kt_loop_find(w.model, "net.lower"));
    kt_check_equal_int("the net is released", (long long)kt_simulation_released(w.simulation), (long long)all);
    kt_check_true("fails", kt_simulation_advance(w.simulation, 3.0, &error) != KT_OK);
    kt_check_near("when, s", kt_simulation_time(w.simulation), 1.2, 16.0 * DBL_EPSILON);
    kt_check_contains("words", error.message, "'floor.lower' is");
    kt_check_contains("words", error.message, "beyond its boundary");
    const kt_contact_counts counts =
        kt_simulation_contacts(w.simulation); /* the contact that lay on has not closed again at 0.8 s */
    kt_check_equal_int("impacts", (long long)counts.impacts, 2);
    kt_check_equal_int("closings", (long long)counts.closings, 2);
    kt_check_equal_int("openings", (long long)counts.openings, 2);
    kt_check_equal_int("sticks", (long long)counts.sticks, 1);
    kt_check_equal_int("slips", (long long)counts.slips, 0);
    kt_check_true("no contact", kt_simulation_set_released(w.simulation, ~(uint64_t)0, &error) == KT_ERROR_ARGUMENT);
    kt_check_contains("words", error.message, "are hard stops, contacts, slack ropes, or joint friction");
}

/* Each contact without a name has the friction of its own name. */
KT_TEST(friction_bears_the_name_of_its_contact) {
    static const char text[] = "kinetree: 1\n"
                               "bodies:\n"
                               "  - {name: b, joint: {type: free}, mass: 1, inertia: [1, 1, 1]}\n"
                               "effects:\n"
                               "  - {type: contact, point: b, plane: world, restitution: 0}\n"
                               "  - {type: contact, point: b, plane: world, axis: x, restitution: 0, friction: 0.5}\n"
                               "  - {type: contact, point: b, plane: world, axis: y, restitution: 0, friction: 0.5}\n";
    static const char *const names[] = {"b", "b_2", "b_2.stick", "b_3", "b_3.stick"};
    const kt_model *model = kt_test_model(&kt_test_scene(text)->description, NULL);
    for (int i = 0; i < 5; i++)
        kt_check_text("name", kt_loop_name(model, i), names[i]);
}

/* Counts and marks refer to events by their names. */
KT_TEST(an_event_of_a_name_that_another_one_has_is_rejected) {
    static const char *const names[] = {"floor.lower", "table.stick", "until", "low"};
    for (int i = 0; i < 4; i++) {
        running w;
        kt_error error = {0};
        const kt_simulation_options options = kt_simulation_options_default();
        kt_scene *scene = kt_test_scene_of(FLOORS("  - {name: %s, when: t - 0.8, then: record}\n"), names[i]);
        const kt_status status = running_open(&w, scene, &options, &error);
        kt_check_equal_int(names[i], (long long)status, i < 3 ? (long long)KT_ERROR_SCENE : (long long)KT_OK);
        if (i < 3) {
            kt_check_contains("where", error.where, names[i]);
            kt_check_contains("words", error.message, "an event of this name already");
        }
    }
}

/* ---- a rimless wheel --------------------------------------------------------------------------------------------- */

/* Six spokes of 1 m are on a hub of mass 1 and inertia 0.1. The slope is 0.35 rad, along which gravity is inclined. The
 * feet land 1 m apart. Each impact leaves this fraction of the speed:
 *     (I + m l^2 cos 60) / (I + m l^2).
 * Each step adds m g sin(slope) 1 m. */
KT_TEST(a_rimless_wheel_keeps_what_each_impact_leaves) {
    static char text[6000];
    const double g = 9.81, slope = 0.35, inertia = 0.1, first = 3.0, pi = 3.14159265358979323846;
    size_t n = (size_t)snprintf(
        text, sizeof text,
        "kinetree: 1\ngravity: [%.17g, %.17g, 0]\nbodies:\n  - name: hub\n    joint: {type: planar, position: [-0.5, "
        "%.17g, %.17g], velocity: [%.17g, %.17g, %.17g]}\n    mass: 1\n    inertia: [0.1, 0.1, 0.1]\n    markers:\n",
        g * sin(slope), -g * cos(slope), cos(pi / 6.0), pi / 6.0, first * cos(pi / 6.0), 0.5 * first, -first);
    for (int k = 0; k < 6; k++)
        n += (size_t)snprintf(text + n, sizeof text - n, "      f%d: [%.17g, %.17g, 0]\n", k,
                              cos(-pi / 2.0 + k * pi / 3.0), sin(-pi / 2.0 + k * pi / 3.0));
    n += (size_t)snprintf(text + n, sizeof text - n, "loops:\n");
    for (int k = 0; k < 6; k++)
        n += (size_t)snprintf(text + n, sizeof text - n,
                              "  - {name: pin%d, type: spherical, between: [{body: world, at: [%d, 0, 0]}, hub.f%d], "
                              "switched: %s}\n",
                              k, k, k, k ? "off" : "on");
    n += (size_t)snprintf(text + n, sizeof text - n, "events:\n");
    for (int k = 1; k < 6; k++)
        n += (size_t)snprintf(
            text + n, sizeof text - n,
            "  - {name: step%d, when: marker.hub.f%d.y, direction: falling, limit: 1, then: [{release: "
            "pin%d}, {engage: pin%d}]}\n",
            k, k, k - 1, k);
    (void)snprintf(text + n, sizeof text - n, "simulate: {duration: 4, tolerance: 1e-12}\n");
    rows r;
    run_scene(text, "dop853", &r);
    kt_need(kt_check_equal_int("rows", r.count, 10));
    /* Errors at a tolerance of 1e-12 add up over five steps of the wheel. */
    KT_WORST speeds = kt_worst_make("speeds, rad/s"), energies = kt_worst_make("lost so far, and energy, J"),
             hub = kt_worst_make("hub, m");
    double speed = first, lost = 0.0;
    for (int k = 0; k < 5; k++) {
        const double before = sqrt(speed * speed + 2.0 * g * sin(slope) / (1.0 + inertia));
        speed = before * (inertia + 0.5) / (1.0 + inertia);
        lost += 0.5 * (1.0 + inertia) * (before * before - speed * speed);
        kt_worst_near(&speeds, r.v[2 * k][2], -before, 1e-11, "before impact %d", k);
        kt_worst_near(&speeds, r.v[2 * k + 1][2], -speed, 1e-11, "behind impact %d", k);
        kt_worst_near(&energies, r.dissipated[2 * k + 1], lost, 1e-10, "lost, impact %d", k);
        kt_worst_near(&energies, r.total[2 * k + 1], r.total[0], 1e-10, "impact %d", k);
        kt_worst_near(&hub, r.q[2 * k][0], 0.5 + k, 1e-11, "impact %d", k);
    }
}

/* ---- a trebuchet ------------------------------------------------------------------------------------------------- */

#ifdef HAS_GSL
static int trebuchet_rate(double t, const double y[], double rate[], void *user) {
    (void)t, (void)user;
    kt_trebuchet_rate(y, rate);
    return GSL_SUCCESS;
}

static bool trebuchet_at(double t, double ball[4]) {
    double y[KT_TREBUCHET_STATES], now = 0.0;
    gsl_odeiv2_system system = {trebuchet_rate, NULL, KT_TREBUCHET_STATES, NULL};
    gsl_odeiv2_driver *driver = gsl_odeiv2_driver_alloc_y_new(&system, gsl_odeiv2_step_rk8pd, 1e-4, 1e-14, 1e-14);
    kt_trebuchet_start(y);
    const bool fine = driver != NULL && gsl_odeiv2_driver_apply(driver, &now, t, y) == GSL_SUCCESS;
    gsl_odeiv2_driver_free(driver);
    kt_trebuchet_ball(y, ball);
    return fine;
}

/* The height of the release is reached once between these times; from there a parabola. */
KT_TEST(a_trebuchet_throws_as_far_as_another_integrator_says) {
    double early = 0.6, late = 0.7, ball[4] = {0.0};
    rows r;
    bool fine = true;
    for (int i = 0; i < 60 && fine; i++) {
        const double middle = 0.5 * (early + late);
        fine = trebuchet_at(middle, ball);
        *(ball[1] < kt_trebuchet_data.release ? &early : &late) = middle;
    }
    kt_need(kt_check_true("GSL integrates", fine));
    run_scene(kt_trebuchet_scene, "dop853", &r);
    kt_need(kt_check_equal_int("rows", r.count, 3));
    kt_check_near("time of the release, s", r.time[0], late, 1e-13);
    kt_check_near("range, m", r.q[2][2], kt_trebuchet_range(ball), 1e-9);
    kt_check_near("energy, J", r.total[2], r.total[0], 1e-8);
}
#else
KT_TEST(a_trebuchet_throws_as_far_as_another_integrator_says) {
    kt_note("GSL is not on this machine");
    kt_check_true("left out", true);
}
#endif

/* ---- a woodpecker toy -------------------------------------------------------------------------------------------- */

/* The passages of the bird through phi_S = -0.2788 while the sleeve slides: times and rates. Also its least angle, the
 * balance, and the letters of the transitions, once in a row: beak, lower and upper edge, and sticking. */
typedef struct pecking {
    int passes;
    double time[ROWS], fall, turn, least, balance[2];
    char order[2000];
    size_t length;
} pecking;

static int watch_pecking(const kt_record *record, void *user) {
    pecking *p = user;
    if (record->index == KT_INDEX_CONTACT) {
        const char letter = strstr(record->event->name, "stick") ? 's' : record->event->name[0];
        if (p->length + 1 < sizeof p->order && (p->length == 0 || p->order[p->length - 1] != letter))
            p->order[p->length++] = letter;
        return 0;
    }
    const double total = record->kinetic + record->potential + record->work.dissipated - record->work.supplied;
    p->balance[0] = record->index == 0 ? total : p->balance[0];
    p->balance[1] = fmax(p->balance[1], fabs(total - p->balance[0]));
    if (record->t > 1.0)
        p->least = fmin(p->least, record->q[3] / 0.015);
    if (record->index == KT_INDEX_EVENT && record->v[0] < -0.3 && p->passes < ROWS) {
        p->time[p->passes++] = record->t;
        p->fall = record->v[0];
        p->turn = record->v[3] / 0.015;
    }
    return 0;
}

KT_TEST(a_woodpecker_pecks_on_its_published_orbit) {
    running r;
    kt_error error = {0};
    pecking p = {.passes = 0};
    kt_simulation_options options = kt_simulation_options_default();
    options.record = KT_RECORD_BALANCE | KT_RECORD_ENERGY;
    options.record_contacts = true;
    kt_need_fine("events", running_open(&r, kt_test_scene(kt_woodpecker_scene), &options, &error), &error);
    kt_need_fine("run", kt_simulation_run(r.simulation, watch_pecking, &p, &error), &error);
    kt_need(kt_check_above("passes", p.passes, 16.0));
    const double period = (p.time[p.passes - 1] - p.time[p.passes - 9]) / 8.0;
    kt_note("period %.6f s; published 0.1452", period);
    kt_check_near("period by time stepping, s", period, kt_woodpecker_period(1e-5), 6e-5);
    kt_check_near("published period, s", period, 0.1452, 1e-3);
    kt_check_near("least angle of the bird", p.least, -0.53, 0.005);
    kt_check_near("published speed at its angle, m/s", p.fall, -0.3411, 0.005 * 0.3411);
    kt_check_near("published rate at its angle, rad/s", p.turn, -7.4583, 0.005 * 7.4583);
    kt_note("order %s", p.order);
    kt_check_contains("frames 1 to 8 of the paper, and again", p.order + p.length / 2, "slupulslupuls");
    kt_check_below("balance, J", p.balance[1], 1e-9);
}

/* ---- a spinning coin --------------------------------------------------------------------------------------------- */

static void run_coin(double alpha, double damping, const char *until, rows *r) {
    char text[2000];
    (void)snprintf(text, sizeof text, KT_COIN(KT_COIN_ROLLS), alpha, damping, 1e-10, until);
    run_scene(text, "dop853", r);
}

KT_TEST(a_coin_rolls_steadily_and_sinks_by_its_law) {
    const double s0 = sin(0.2), Omega = sqrt(4.0 * 9.81 / (KT_COIN_RADIUS * s0));
    double off[2] = {0.0, 0.0};
    rows r;
    run_coin(0.2, 0.0, "t - 1", &r);
    kt_check_near("inclination: the tolerance", r.q[r.count - 1][KT_COIN_TILT], 0.2, 1e-10);
    kt_check_near("rate, times Omega over two alpha, rad/s", r.v[r.count - 1][KT_COIN_TURN], Omega, 2e-8);
    kt_check_near("energy, J", r.total[r.count - 1], 1.5 * KT_COIN_MASS * 9.81 * KT_COIN_RADIUS * s0, 1e-12);
    for (int k = 0; k < 2; k++) {
        const double alpha = k == 0 ? 0.2 : 0.1, c = k == 0 ? 8e-6 : 2e-6;
        const double fall =
            0.75 * sin(alpha) * sin(alpha) * 3.0 * KT_COIN_MASS * KT_COIN_RADIUS * KT_COIN_RADIUS / (16.0 * c);
        run_coin(alpha, c, "\"sin(position.tilt) < 0.5*sin(alpha)\"", &r);
        off[k] = fabs(r.time[r.count - 1] / fall - 1.0);
    }
    kt_check_below("time to half the height, relative", off[1], 0.2 * 0.1);
    kt_check_below("goes with the inclination", off[1], 0.6 * off[0]);
}

/* If it lies flat, its rim has no lowest point, and the turning has no inertia, m r^2 sin(alpha)^2. The run ends there
 * with a message that names the coin. This holds if the coin is kept on the plane, and if it touches it. */
static void check_end(bool touches) {
    char text[2000];
    kt_error error = {0};
    const double alpha = 0.1, c = 2e-6, s0 = sin(alpha),
                 end = s0 * s0 * 3.0 * KT_COIN_MASS * KT_COIN_RADIUS * KT_COIN_RADIUS / (16.0 * c);
    if (touches)
        (void)snprintf(text, sizeof text, KT_COIN(KT_COIN_TOUCHES), alpha, c, 1e-7, "t - 2");
    else
        (void)snprintf(text, sizeof text, KT_COIN(KT_COIN_ROLLS), alpha, c, 1e-7, "t - 2");
    const running w = begin_with(text, NULL, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    const kt_status status = kt_simulation_advance(w.simulation, 2.0, &error);
    const double *q = kt_simulation_positions(w.simulation);
    kt_note("%s: %s", error.where, error.message);
    kt_check_true("ends", status != KT_OK);
    kt_check_contains("where", error.where, "t = ");
    kt_check_contains("what", error.message, "the disc 'coin' lies flat but for ");
    kt_check_contains("by which contact", error.message, "('rim')");
    kt_check_contains("the remedy", error.message, "three spheres on its rim");
    kt_check_near("when, over the law", kt_simulation_time(w.simulation) / end, 1.0, 0.05);
    kt_check_below("inclination", fabs(q[KT_COIN_TILT]), 1e-5); /* flat, as nearly as steps come to it */
}

KT_TEST(a_coin_spins_to_its_end) {
    check_end(false);
    check_end(true);
}

/* ---- a rope that is out of reach --------------------------------------------------------------------------------- */

/* A cart takes a pendulum away. The pendulum hangs straight below the fixed end of a rope that is longer. From there,
 * no position closes the rope, and its row is zero. Later, the rope holds the pendulum at the point that both lengths
 * define. */
KT_TEST(a_rope_out_of_reach_at_the_start_holds_what_a_drive_takes_away) {
    rows r;
    const double x = 0.6, length = 1.05, inclined = asin((1.0 + x * x - length * length) / (2.0 * x));
    run_scene(
        "kinetree: 1\n"
        "gravity: [0, -9.81, 0]\n"
        "bodies:\n"
        "  - {name: cart, joint: {type: prismatic, axis: x, position: 0}, mass: 1}\n"
        "  - {name: arm, parent: cart, joint: {type: revolute, axis: z, position: -90 deg}, mass: 1, com: [0.5, 0, "
        "0],\n"
        "     inertia: [0.08, 0.08, 0.08]}\n"
        "loops:\n"
        "  - {name: drive, type: motion, joint: cart, position: {ramp: {from: 0, to: 0.6, start: 0, end: 2}}}\n"
        "  - {name: rope, type: distance, between: [world, {body: arm, at: [1, 0, 0]}], length: 1.05, slack: "
        "true}\n"
        "simulate: {duration: 4, until: t - 3}\n",
        NULL, &r);
    kt_need(kt_check_above("records", r.count, 0.5));
    kt_check_near("arm, rad", r.q[r.count - 1][1], -1.57079632679489662 - inclined, 1e-14);
    kt_check_near("balance, J", r.total[r.count - 1], -9.81 * 0.5, 1e-8);
}

/* ---- what no impulse can turn ------------------------------------------------------------------------------------ */

/* A run that ends in words. It has moved up to 2e-11 m behind a boundary then, which a ramp does in 7.3e-7 s. */
static void check_rejection(const char *what, const char *text, double t, const char *const *words) {
    kt_error error = {0};
    kt_note("%s", what);
    running w;
    const kt_simulation_options options = kt_simulation_options_default();
    kt_status status = running_open(&w, kt_test_scene(text), &options, &error);
    if (status == KT_OK)
        status = kt_simulation_advance(w.simulation, 2.0, &error);
    kt_note("%s: %s", error.where, error.message);
    kt_check_true("is rejected", status != KT_OK);
    if (w.simulation != NULL)
        kt_check_near("when, s", kt_simulation_time(w.simulation), t, 1e-6);
    for (; *words != NULL; words++)
        kt_check_true(*words, strstr(error.where, *words) != NULL || strstr(error.message, *words) != NULL);
}

#define DRIVEN(position, more)                                                                                         \
    "kinetree: 1\n"                                                                                                    \
    "bodies:\n"                                                                                                        \
    "  - {name: jaw, joint: {type: prismatic, axis: x, position: 0}, mass: 1}\n" more                                  \
    "loops: [{name: drive, type: motion, joint: jaw, position: {" position "}}]\n"                                     \
    "simulate: {duration: 2}\n"
#define STOP(e) "effects: [{type: joint_limit, joint: jaw, upper: 0.5, restitution: " e "}]\n"
#define FACING(side) "rotation: {axis: y, angle: " side "90 deg}}, restitution: 0.5}\n"

/* A table that is lifted against a pendulum which hangs straight down, or nearly so. */
#define LIFTED(angle)                                                                                                  \
    "kinetree: 1\n"                                                                                                    \
    "gravity: [0, -9.81, 0]\n"                                                                                         \
    "bodies:\n"                                                                                                        \
    "  - {name: table, joint: {type: prismatic, axis: y, position: -1.55}, mass: 1}\n"                                 \
    "  - {name: arm, joint: {type: revolute, axis: z, position: " angle " deg}, mass: 1, com: [0.5, 0, 0]}\n"          \
    "loops: [{name: drive, type: motion, joint: table, position: {polynomial: [-1.55, 1]}}]\n"                         \
    "effects:\n"                                                                                                       \
    "  - {name: bump, type: contact, point: {body: arm, at: [1, 0, 0]}, radius: 0.05,\n"                               \
    "     plane: {body: table, rotation: {axis: x, angle: -90 deg}}, restitution: 0.5}\n"                              \
    "simulate: {duration: 2}\n"

/* A drive of 1 um/s reaches a stop at the instant at which a wheel of 1 rad/s does. The speeds have different units. */
static const char small_drive[] =
    "kinetree: 1\n"
    "bodies:\n"
    "  - {name: jaw, joint: {type: prismatic, axis: x, position: 0}, mass: 1, com: [1e-6, 0, 0]}\n"
    "  - {name: wheel, joint: {type: revolute, axis: z, position: 0, velocity: 1}, mass: 1, com: [1e-6, 0, 0]}\n"
    "loops: [{name: drive, type: motion, joint: jaw, position: {polynomial: [0, 1e-6]}}]\n"
    "effects:\n"
    "  - {type: joint_limit, joint: jaw, upper: 0.5e-6, restitution: 0}\n"
    "  - {type: joint_limit, joint: wheel, upper: 0.5, restitution: 0}\n"
    "simulate: {duration: 2}\n";

/* A drive of 0.1 mm/s next to bodies of 1 m. The wheel's group is another one than that of the drive, so that its speed
 * does not count. */
static const char slow_drive[] =
    "kinetree: 1\n"
    "bodies:\n"
    "  - {name: wheel, joint: {type: revolute, axis: z, position: 0, velocity: 1}, mass: 1, com: [1, 0, 0]}\n"
    "  - {name: jaw, joint: {type: prismatic, axis: x, position: 0}, mass: 1, com: [1, 0, 0]}\n"
    "loops: [{name: drive, type: motion, joint: jaw, position: {polynomial: [0, 1e-4]}}]\n"
    "effects:\n"
    "  - {type: joint_limit, joint: jaw, upper: 0.5e-4, restitution: 0}\n"
    "  - {type: joint_limit, joint: wheel, upper: 0.5, restitution: 0}\n"
    "simulate: {duration: 2}\n";

/* A drive goes on through a stop: with and without a restitution, from a distance and from rest at the stop. A vice
 * presses a block against a wall. A table is lifted against a pendulum that hangs straight down. With W = 0, no impulse
 * p changes u + W p, for any rounding of W. */
KT_TEST(a_prescribed_motion_into_a_boundary_is_told) {
    static const char *const stop[] = {"'jaw.upper'", "'drive'", "a prescribed motion drives it", "elastic stop", NULL};
    static const char *const straight[] = {"'bump'", "'drive'", "a prescribed motion drives it", NULL};
    static const char *const inclined[] = {"'bump'", "no joint has a lever against it", NULL};
    static const char *const vice[] = {"'wall'", "'face'", "'drive'", "a prescribed motion drives it", NULL};
    check_rejection("stop", DRIVEN("polynomial: [0, 1]", STOP("0.5")), 0.5, stop);
    check_rejection("stop, plastic", DRIVEN("polynomial: [0, 1]", STOP("0")), 0.5, stop);
    check_rejection("from the stop", DRIVEN("ramp: {from: 0.5, to: 1, start: 0.2, end: 0.4}", STOP("0.5")), 0.2, stop);
    check_rejection("stop, small", small_drive, 0.5, stop);
    check_rejection("stop, slow", slow_drive, 0.5, stop);
    check_rejection("without a lever but for rounding", LIFTED("-90"), 0.5, straight);
    check_rejection("nearly without", LIFTED("-90.00000001"), 0.5, inclined);
    check_rejection(
        "vice",
        DRIVEN(
            "polynomial: [0, 1]",
            "  - {name: block, joint: {type: prismatic, axis: x, position: 0.3}, mass: 1}\n"
            "effects:\n"
            "  - {name: wall, type: contact, point: block, radius: 0.1, plane: {body: world, at: [0.7, 0, 0], " FACING(
                "-") "  - {name: face, type: contact, point: block, radius: 0.1, plane: {body: jaw, " FACING("")),
        0.5, vice);
}

/* A joint that moves no mass has no impulses. */
KT_TEST(hard_contacts_with_a_joint_that_moves_no_mass_are_rejected_at_first) {
    static const char *const words[] = {"contact 'floor'", "joint 'probe' moves no mass", "stiffness", NULL};
    check_rejection("probe",
                    "kinetree: 1\n"
                    "gravity: [0, 0, -9.81]\n"
                    "bodies:\n"
                    "  - {name: cart, joint: {type: prismatic, axis: x}, mass: 1}\n"
                    "  - {name: probe, parent: cart, joint: {type: prismatic, axis: z, position: 1}}\n"
                    "effects:\n"
                    "  - {name: gear, type: joint_spring, joint: probe, stiffness: 400, damping: 12}\n"
                    "  - {name: floor, type: contact, point: probe, plane: world, restitution: 0.4}\n"
                    "simulate: {duration: 2}\n",
                    0.0, words);
}

/* ---- where a stop is --------------------------------------------------------------------------------------------- */

static const char bouncing[] =
    "kinetree: 1\n"
    "gravity: [0, 0, -9.81]\n"
    "bodies: [{name: ball, joint: {type: prismatic, axis: z, position: 1.1}, mass: 1}]\n"
    "effects: [{name: floor, type: joint_limit, joint: ball, lower: 0.3, restitution: 0.7}]\n"
    "events: [{name: there, when: position.ball - 0.3, then: record}]\n"
    "simulate: {duration: 1.5, tolerance: 1e-9}\n";

/* An event where the stop is happens once on the way down and once on the way up, at each impact: the times of these
 * are t, (1 + 2 e) t, (1 + 2 e + 2 e^2) t with t^2 = 2 h / g. */
KT_TEST(an_event_where_a_stop_is_happens_twice_at_each_impact) {
    static const char *const methods[] = {"dopri5", "dop853", "radau5", "rodas5p"};
    const double t = sqrt(2.0 * 0.8 / 9.81), expected[3] = {t, 2.4 * t, 3.38 * t};
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        rows r;
        run_scene(bouncing, methods[m], &r);
        kt_need(kt_check_equal_int(methods[m], r.count, 6));
        for (int i = 0; i < 6; i++)
            kt_check_near("time, s", r.time[i], expected[i / 2], 64.0 * DBL_EPSILON);
    }
}
