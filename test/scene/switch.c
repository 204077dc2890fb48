/* Events of scenes that release and engage: a string that is let go, a clutch that grips, a rimless wheel that rolls down a
 * slope, against closed forms; a trebuchet, against GSL; and what is refused. */
#include "kinetree/dynamics.h"
#include "kinetree/loop.h"
#include "kinetree/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef HAS_GSL
#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>
#endif

#include "check.h"
#include "collect.h"
#include "difference.h"

static kt_collected faults;

static bool parse(const char *text, kt_scene *scene) {
    kt_error error = {0};
    memset(&faults, 0, sizeof faults);
    return kt_scene_parse("x", text, strlen(text), scene, kt_collect, &faults, &error) == KT_OK;
}

/* ---- runs -------------------------------------------------------------------------------------------------------- */

enum { ROWS = 32, NUMBERS = 8 };

/* The records of events, and the end. */
typedef struct rows {
    int count, nq, nv;
    const char *name[ROWS];
    double time[ROWS], q[ROWS][NUMBERS], v[ROWS][NUMBERS], dissipated[ROWS], total[ROWS];
    uint64_t set[ROWS];
} rows;

static int keep(const kt_record *record, void *user) {
    rows *r = user;
    if (record->event == NULL || r->count == ROWS)
        return 0;
    r->name[r->count] = record->event->name;
    r->time[r->count] = record->time;
    r->set[r->count] = kt_switch_set(record->model);
    memcpy(r->q[r->count], record->q, (size_t)r->nq * sizeof(double));
    memcpy(r->v[r->count], record->v, (size_t)r->nv * sizeof(double));
    r->dissipated[r->count] = record->work.dissipated;
    r->total[r->count++] = record->kinetic + record->potential + record->work.dissipated - record->work.supplied;
    return 0;
}

/* Reads and runs a scene; false after a failed check. */
static bool run_scene(const char *text, const char *integrator, rows *r) {
    kt_scene scene = {.events = NULL};
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    kt_scene_watch *watch = NULL;
    kt_error error = {0};
    memset(r, 0, sizeof *r);
    if (!kt_check_true("it is read", parse(text, &scene))) {
        kt_note("%s", faults.text);
        return false;
    }
    scene.run.integrator = integrator;
    kt_simulation_options options = kt_simulation_options_default();
    options.events = kt_scene_event_room(&scene);
    options.record = KT_RECORD_BALANCE | KT_RECORD_ENERGY;
    kt_status status = kt_model_compile(&scene.description, NULL, &model, &error);
    if (status == KT_OK)
        status = kt_simulation_create(model, &scene.run, &options, &simulation, &error);
    if (status == KT_OK)
        status = kt_scene_watch_create(&scene, model, simulation, NULL, 0, &watch, &error);
    if (status == KT_OK) {
        r->nq = kt_model_nq(model);
        r->nv = kt_model_nv(model);
        status = kt_simulation_run(simulation, keep, r, &error);
    }
    kt_simulation_free(simulation);
    kt_scene_watch_free(watch);
    kt_model_free(model);
    kt_scene_free(&scene);
    if (!kt_check_true("it runs", status == KT_OK))
        kt_note("%s: %s", error.where, error.message);
    return status == KT_OK;
}

/* ---- a string is let go ------------------------------------------------------------------------------------------ */

static const char pendulum[] =
    "kinetree: 1\n"
    "gravity: [0, -9.81, 0]\n"
    "bodies:\n"
    "  - {name: stone, joint: {type: planar, position: [1, 0, 0]}, mass: 1, inertia: [0.1, 0.1, 0.1],\n"
    "     markers: {centre: [0, 0, 0]}}\n"
    "loops:\n"
    "  - {name: string, type: distance, between: [world, stone.centre], length: 1}\n"
    "events:\n"
    "  - {name: let go, when: \"marker.stone.centre.x + sqrt(0.5)\", direction: falling, then: {release: string}}\n"
    "simulate: {duration: 10, until: \"marker.stone.centre.y < -5\", tolerance: 1e-12}\n";

/* From rest at the height of the pivot, released 45 degrees behind the lowest point: v^2 = 2 g sqrt(1/2), and from there a
 * parabola. */
KT_TEST(a_string_that_is_let_go_leaves_a_parabola) {
    static const char *const methods[] = {"dopri5", "dop853", "radau5", "rodas5p"};
    const double s = sqrt(0.5), g = 9.81, v = sqrt(2.0 * g * s);
    const double flight = (v * s + sqrt(v * v * s * s + 2.0 * g * (5.0 - s))) / g;
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        rows r;
        kt_note("%s", methods[m]);
        if (!run_scene(pendulum, methods[m], &r) || !kt_check_equal_int("rows", r.count, 3))
            continue;
        kt_check_equal_int("before, it holds", (long long)r.set[0], 1);
        kt_check_equal_int("behind, it does not", (long long)r.set[1], 0);
        kt_check_near("x speed", r.v[0][0], -v * s, 1e-10);
        kt_check_near("y speed", r.v[0][1], v * s, 1e-10);
        kt_check_equal_bits("nothing jumps", r.v[1], r.v[0], 3);
        kt_check_near("flight, s", r.time[2] - r.time[1], flight, 1e-10);
        kt_check_near("range, m", r.q[2][0], -s - v * s * flight, 1e-9);
        kt_check_near("energy", r.total[2], r.total[0], 1e-9);
        kt_check_near("dissipated", r.dissipated[2], 0.0, 1e-12);
    }
}

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

/* At 0.5 s the engine turns at 20 rad/s: the common speed is (0.3 20 - 0.5 2) / 0.8, and the loss 0.3 0.5 / 0.8 22^2 / 2. */
KT_TEST(a_clutch_that_grips_loses_what_two_discs_do) {
    rows r;
    if (!run_scene(clutch, "dopri5", &r) || !kt_check_equal_int("rows", r.count, 3))
        return;
    kt_check_near("engine before", r.v[0][0], 20.0, 1e-10);
    kt_check_near("engine behind", r.v[1][0], 6.25, 1e-10);
    kt_check_near("load behind", r.v[1][1], 6.25, 1e-10);
    kt_check_near("lost, J", r.dissipated[1] - r.dissipated[0], 0.5 * 0.3 * 0.5 / 0.8 * 22.0 * 22.0, 1e-9);
    kt_check_near("nothing drives it any more", r.v[2][0], 6.25, 1e-10);
    kt_check_near("energy", r.total[2], r.total[0], 1e-9);
}

/* ---- a rimless wheel --------------------------------------------------------------------------------------------- */

/* Six spokes of 1 m about a hub of mass 1 and inertia 0.1, on a slope of 0.35 rad, along which gravity is inclined. The feet
 * land 1 m apart. Each impact leaves (I + m l^2 cos 60) / (I + m l^2) of the speed, and each step adds m g sin(slope) 1 m. */
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
    if (!run_scene(text, "dop853", &r) || !kt_check_equal_int("rows", r.count, 10))
        return;
    double speed = first, lost = 0.0;
    for (int k = 0; k < 5; k++) {
        const double before = sqrt(speed * speed + 2.0 * g * sin(slope) / (1.0 + inertia));
        speed = before * (inertia + 0.5) / (1.0 + inertia);
        lost += 0.5 * (1.0 + inertia) * (before * before - speed * speed);
        kt_check_near("speed before", r.v[2 * k][2], -before, 1e-10);
        kt_check_near("speed behind", r.v[2 * k + 1][2], -speed, 1e-10);
        kt_check_near("lost so far, J", r.dissipated[2 * k + 1], lost, 1e-9);
        kt_check_near("energy", r.total[2 * k + 1], r.total[0], 1e-9);
        kt_check_near("hub, m", r.q[2 * k][0], 0.5 + k, 1e-10);
    }
}

/* ---- a trebuchet ------------------------------------------------------------------------------------------------- */

#ifdef HAS_GSL
static const char trebuchet[] =
    "kinetree: 1\n"
    "gravity: [0, -9.81, 0]\n"
    "bodies:\n"
    "  - {name: beam, joint: {type: revolute, position: -135 deg}, mass: 20, inertia: [20, 20, 20], markers: {tip: [3, "
    "0, "
    "0]}}\n"
    "  - {name: box, parent: beam, joint: {type: revolute, at: [-1, 0, 0], position: 135 deg}, mass: 300, com: [0, "
    "-0.8, "
    "0], inertia: [5, 5, 5]}\n"
    "  - name: ball\n"
    "    joint: {type: planar, position: [-0.1213203435596424, -2.121320343559643, 0]}\n"
    "    mass: 2\n"
    "    inertia: [0.01, 0.01, 0.01]\n"
    "    markers: {centre: [0, 0, 0]}\n"
    "loops:\n"
    "  - {name: sling, type: distance, between: [beam.tip, ball.centre], length: 2}\n"
    "events:\n"
    "  - {name: let go, when: marker.ball.centre.y - 4.2, direction: rising, limit: 1, then: [{release: sling}]}\n"
    "simulate: {duration: 20, until: \"marker.ball.centre.y < -2\", tolerance: 1e-13}\n";

/* Angles of beam, box and sling against the horizontal: every mass is at a sum of r_i (cos q_i, sin q_i). With c_ij = sum
 * m r_i r_j and the moments of inertia on the diagonal, Lagrange's equations are
 *     sum_j c_ij (cos(q_i - q_j) q_j'' + sin(q_i - q_j) q_j'^2) = -g sum m r_i cos q_i */
static int trebuchet_rate(double t, const double y[], double rate[], void *user) {
    static const double mass[2] = {2.0, 300.0}, arm[2][3] = {{3.0, 0.0, 2.0}, {-1.0, 0.8, 0.0}};
    static const double inertia[3] = {20.0, 5.0, 0.0};
    double m[3][4];
    (void)t, (void)user;
    for (int i = 0; i < 3; i++) {
        m[i][3] = 0.0;
        for (int j = 0; j < 3; j++) {
            const double c = mass[0] * arm[0][i] * arm[0][j] + mass[1] * arm[1][i] * arm[1][j];
            m[i][j] = c * cos(y[i] - y[j]) + (i == j ? inertia[i] : 0.0);
            m[i][3] -= c * sin(y[i] - y[j]) * y[3 + j] * y[3 + j];
        }
        m[i][3] -= 9.81 * (mass[0] * arm[0][i] + mass[1] * arm[1][i]) * cos(y[i]);
    }
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            for (int j = 3; i != k && j >= k; j--)
                m[i][j] -= m[i][k] / m[k][k] * m[k][j];
    for (int i = 0; i < 3; i++) {
        rate[i] = y[3 + i];
        rate[3 + i] = m[i][3] / m[i][i];
    }
    return GSL_SUCCESS;
}

/* Where the ball is at t, and how fast: x, y, x', y'. */
static bool trebuchet_at(double t, double ball[4]) {
    const double pi = 3.14159265358979323846;
    double y[6] = {-0.75 * pi, -0.5 * pi, 0.0, 0.0, 0.0, 0.0}, now = 0.0;
    gsl_odeiv2_system system = {trebuchet_rate, NULL, 6, NULL};
    gsl_odeiv2_driver *driver = gsl_odeiv2_driver_alloc_y_new(&system, gsl_odeiv2_step_rk8pd, 1e-4, 1e-14, 1e-14);
    const bool fine = driver != NULL && gsl_odeiv2_driver_apply(driver, &now, t, y) == GSL_SUCCESS;
    gsl_odeiv2_driver_free(driver);
    ball[0] = 3.0 * cos(y[0]) + 2.0 * cos(y[2]);
    ball[1] = 3.0 * sin(y[0]) + 2.0 * sin(y[2]);
    ball[2] = -3.0 * sin(y[0]) * y[3] - 2.0 * sin(y[2]) * y[5];
    ball[3] = 3.0 * cos(y[0]) * y[3] + 2.0 * cos(y[2]) * y[5];
    return fine;
}

/* The height 4.2 m is reached once between these times; from there a parabola down to -2 m. */
KT_TEST(a_trebuchet_throws_as_far_as_another_integrator_says) {
    double early = 0.6, late = 0.7, ball[4] = {0.0};
    rows r;
    bool fine = true;
    for (int i = 0; i < 60 && fine; i++) {
        const double middle = 0.5 * (early + late);
        fine = trebuchet_at(middle, ball);
        *(ball[1] < 4.2 ? &early : &late) = middle;
    }
    if (!kt_check_true("GSL integrates", fine) || !run_scene(trebuchet, "dop853", &r) ||
        !kt_check_equal_int("rows", r.count, 3))
        return;
    const double flight = (ball[3] + sqrt(ball[3] * ball[3] + 2.0 * 9.81 * 6.2)) / 9.81;
    const double range = ball[0] + ball[2] * flight;
    kt_check_near("time of the release, s", r.time[0], late, 1e-13);
    kt_check_near("range, m", r.q[2][2], range, 1e-9);
    kt_check_near("energy, J", r.total[2], r.total[0], 1e-8);
}
#else
KT_TEST(a_trebuchet_throws_as_far_as_another_integrator_says) {
    kt_note("GSL is not on this machine");
    kt_check_true("left out", true);
}
#endif
