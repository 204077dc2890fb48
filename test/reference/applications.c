/* Scenes of applications against theory: the flap frequency of a rotor, the libration of a tether, and a ball that
 * comes to roll. Further scenes are the straight-line rod of a pump and the moment of a wheel whose axle is turned.
 *
 * Each bound is three times the error measured when the test was written, unless a comment derives it.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene.h"

#include <math.h>
#include <string.h>

#define COUNT_OF(array) ((int)(sizeof(array) / sizeof(array)[0]))

static double position_of(const kt_case *c, const kt_record *record, const char *joint) {
    return record->q[kt_case_q(c, joint)];
}

static kt_vec3 point_of(const kt_case *c, const kt_record *record, const char *name, const char *marker) {
    const int body = kt_body_find(c->model, name);
    return kt_point_position(c->model, record->data, body,
                             kt_marker_at(c->model, body, kt_marker_find(c->model, body, marker)));
}

/* ---- the rotor --------------------------------------------------------------------------------------------------- */

/* A blade of uniform mass m and length L is hinged at the distance e from the shaft. Its inertia and its first moment
 * about the hinge are
 *     I = m L^2 / 3,   S = m L / 2.
 * At a flap angle b, the element at x is pulled outwards by the force
 *     Omega^2 (e + x cos b) dm.
 * Its arm about the hinge is x sin b, so the equation of motion is
 *     I b'' = -Omega^2 (I cos b sin b + e S sin b),   for small b:  b'' = -Omega^2 (1 + e S / I) b,
 * and e S / I = 3/2 e / L. With the radius R = e + L, this gives (Johnson, Helicopter Theory, 1980, 5-3)
 *     nu^2 = 1 + 3/2 (e/R) / (1 - e/R).
 * The lag hinge lacks the first part, because the radius turns with the blade there:
 *     nu^2 = 3/2 e / L.
 */
typedef struct blades {
    double flap, lag, omega, size;
    kt_worst error[2];
} blades;

static int follow_blades(const kt_record *record, void *user) {
    blades *b = user;
    /* coordinates: hub, flap and lag of each blade; the first one flaps, the second one lags */
    const double flap = record->q[1], lag = record->q[4], t = record->t;
    kt_worst_near(&b->error[0], flap / b->size, cos(b->flap * b->omega * t), 4e-8, "t = %g", t);
    kt_worst_near(&b->error[1], lag / b->size, cos(b->lag * b->omega * t), 4e-7, "t = %g", t);
    return 0;
}

/* The scene has no gravity and no effects. One blade flaps, one lags, and the others are at rest. The angle is so small
 * that its square, which the theory neglects, is next to nothing. A tolerance of 1e-13 is 1e-8 of the angle. */
KT_TEST(rotor_blades_flap_and_lag_at_their_frequencies) {
    static const kt_setting setting = {"dop853", 0.0, 1e-13, 0.0};
    const double e = 0.35, length = 6.65, ratio = e / (e + length);
    blades b = {.flap = sqrt(1.0 + 1.5 * ratio / (1.0 - ratio)), .lag = sqrt(1.5 * e / length), .omega = 27.0};
    b.size = 1e-5;
    b.error[0] = kt_worst_make("flap angle, relative");
    b.error[1] = kt_worst_make("lag angle, relative");
    kt_case c = kt_case_open("articulated-rotor");
    static kt_body bodies[16];
    kt_description d = c.scene.description;
    memcpy(bodies, d.bodies, sizeof *bodies * (size_t)d.body_count);
    for (int i = 1; i < d.body_count; i++)
        bodies[i].joint.position[0] = i == 1 || i == 4 ? b.size : 0.0;
    d.bodies = bodies;
    d.gravity = kt_vec3_make(0.0, 0.0, 0.0);
    d.effect_count = 0;
    c.model = kt_test_model(&d, NULL);
    (void)kt_case_run(&c, &setting, 0.01, follow_blades, &b);
    kt_check_near("flap frequency of the rotor's", b.flap, 1.0387, 1e-4);
    kt_check_worst(&b.error[0]);
    kt_check_worst(&b.error[1]);
}

/* ---- the tether -------------------------------------------------------------------------------------------------- */

/* The angle of the tether against the local vertical, and its zero crossings. */
typedef struct libration {
    const kt_case *c;
    double before, last, crossing[8], shortest;
    int count;
} libration;

static int follow_tether(const kt_record *record, void *user) {
    libration *l = user;
    const kt_vec3 a = point_of(l->c, record, "mother", "hook"), b = point_of(l->c, record, "daughter", "hook");
    const kt_vec3 along = kt_vec3_sub(b, a), middle = kt_vec3_add(kt_vec3_scale(500.0, a), kt_vec3_scale(50.0, b));
    const double angle = atan2(kt_vec3_cross(middle, along).z, kt_vec3_dot(middle, along));
    if (record->index > 0 && l->last < 0.0 && angle >= 0.0 && l->count < COUNT_OF(l->crossing))
        l->crossing[l->count++] = record->t - (record->t - l->before) * angle / (angle - l->last);
    l->shortest = record->index == 0 ? 1e9 : fmin(l->shortest, kt_vec3_norm(along) - 2e4);
    l->before = record->t;
    l->last = angle;
    return 0;
}

/* A dumbbell is on a circular orbit of rate n and radius R. Its masses m are at l along the tether, outwards. The first
 * terms of GM m / |R + l| give the restoring moment. At a small angle t, it is
 *     3 n^2 (sum m l^2 - 2 / R sum m l^3) t.
 * The period is therefore 1 / sqrt(3) of the orbit's, longer by (sum m l^3) / (R sum m l^2), relatively. For m1 = 500
 * kg and m2 = 50 kg, this is (m1 - m2) / (m1 + m2) L / R. For an amplitude A, the period is also longer by
 *     A^2 / 4,
 * like that of a pendulum of angle 2 t. The terms that follow are of the order of 1e-5. */
KT_TEST(tether_librates_at_root_three_of_its_orbit) {
    static const kt_setting own = {NULL, 0.0, 0.0, 0.0};
    const double radius = 6.771e6, amplitude = kt_degrees(5.0);
    const double n = sqrt(3.986004418e14 / pow(radius, 3.0)), period = 2.0 * 3.14159265358979 / (sqrt(3.0) * n);
    const double longer = 450.0 / 550.0 * 2e4 / radius + 0.25 * amplitude * amplitude;
    kt_case c;
    libration l = {.c = &c};
    c = kt_case_open("tethered-satellites");
    if (kt_case_run(&c, &own, 0.0, follow_tether, &l) && kt_check_equal_int("crossings", l.count, 3)) {
        const double measured = 0.5 * (l.crossing[2] - l.crossing[0]);
        kt_check_near("period of small swings of a short tether", measured / period, 1.0 + longer, 2e-5);
        kt_check_above("stretch, m: never slack", l.shortest, 0.2);
    }
}

/* ---- the ball ---------------------------------------------------------------------------------------------------- */

/* Contact acts on the lowest point alone, so that the angular momentum about a line on the ground is kept,
 *     m r v_x + I w_y,   I = 2/5 m r^2,
 * in flight, through impacts and sliding, until the ball rolls, v_x = r w_y. From the start v, -w, the ball then has
 *     v_x = (5 v - 2 r w) / 7,
 * and 5/7 v without spin. */
typedef struct ball {
    const kt_case *c;
    double start, slip, speed;
    kt_worst momentum;
} ball;

static int follow_ball(const kt_record *record, void *user) {
    ball *b = user;
    const double *v = record->v, r = 0.03;
    const double momentum = r * v[0] + 0.4 * r * r * v[4]; /* about y, which the body turns about from first to last */
    if (record->index == 0)
        b->start = momentum;
    kt_worst_near(&b->momentum, momentum, b->start, 2e-16, "t = %g", record->t);
    b->slip = v[0] - r * v[4];
    b->speed = v[0];
    return 0;
}

static void roll(double spin) {
    static const kt_setting own = {NULL, 0.0, 0.0, 0.0};
    kt_case c;
    ball b = {.c = &c, .momentum = kt_worst_make("angular momentum about the ground / m")};
    c = kt_case_open("rolling-ball");
    kt_description d = c.scene.description;
    kt_body body = d.bodies[0];
    body.joint.velocity[4] = spin;
    d.bodies = &body;
    c.model = kt_test_model(&d, NULL);
    kt_need(kt_case_run(&c, &own, 0.0, follow_ball, &b));
    kt_check_worst(&b.momentum);
    kt_check_near("slip at the end", b.slip, 0.0, 1e-15);
    kt_check_near("speed at the end", b.speed, (5.0 * 1.5 + 2.0 * 0.03 * spin) / 7.0, 5e-15);
}

KT_TEST(ball_ends_up_rolling_with_five_sevenths_of_its_speed) { roll(0.0); }
KT_TEST(ball_with_backspin_ends_up_rolling_slower) { roll(-30.0); }

/* ---- the pump ---------------------------------------------------------------------------------------------------- */

/* The pitman's foot is where the crank's pin is, and the rod rises by 3 m times the beam's angle. */
static double pump_error(const kt_case *c, const kt_record *record, const void *about) {
    const double rise = position_of(c, record, "rod") - 3.0 * position_of(c, record, "beam");
    const kt_vec3 gap = kt_vec3_sub(point_of(c, record, "crank", "pin"), point_of(c, record, "pitman", "foot"));
    (void)about;
    return fmax(fabs(rise), kt_vec3_norm(gap));
}

KT_TEST(pump_rod_follows_the_beam) {
    static const kt_setting settings[] = {{NULL, 0.0, 0.0, 1e-14}, {"rk4", 0.01, 0.0, 1e-14}};
    kt_scene_follow("walking-beam-pump", settings, COUNT_OF(settings), pump_error, NULL);
}

/* ---- the landing gear -------------------------------------------------------------------------------------------- */

/* The leg turns about x with the axle y' of the wheel, whose spin momentum is J w_w y'. Turning it takes the moment J
 * w_w p x' x y' = J w_w p z', with p the leg's rate. This adds to the moments that turn about x and brake about y'. The
 * reaction at the leg's hinge is about the hinge's point. The masses lie in the plane of y and z there, so the moment
 * along z' has no other part. */
typedef struct gear {
    const kt_case *c;
    kt_worst moment;
    double most;
} gear;

static int follow_gear(const kt_record *record, void *user) {
    gear *g = user;
    const double spin = 0.5 * 60.0 * 0.16; /* of a cylinder of 60 kg and 0.4 m */
    const int leg = kt_body_find(g->c->model, "leg");
    const double p = record->v[kt_case_v(g->c, "leg")], w = record->v[kt_case_v(g->c, "wheel")];
    const kt_mat3 axes = kt_body_pose(g->c->model, record->data, leg).rotation;
    const double expected = spin * w * p;
    g->most = fmax(g->most, fabs(expected));
    kt_worst_near(&g->moment, kt_vec3_dot(record->reactions[leg].moment, axes.z), expected, 2e-12, "t = %g", record->t);
    return 0;
}

KT_TEST(axle_of_a_spinning_wheel_resists_being_turned) {
    static const kt_setting own = {NULL, 0.0, 0.0, 0.0};
    kt_case c;
    gear g = {.c = &c, .moment = kt_worst_make("gyroscopic moment, N m")};
    c = kt_case_open("landing-gear");
    if (kt_case_run(&c, &own, 0.0, follow_gear, &g)) {
        kt_check_worst(&g.moment);
        kt_check_above("the largest, N m", g.most, 180.0);
    }
}

/* ---- the arm with servos ----------------------------------------------------------------------------------------- */

typedef struct circle {
    const kt_case *c;
    kt_worst off;
} circle;

static int follow_circle(const kt_record *record, void *user) {
    circle *s = user;
    const kt_vec3 tip = point_of(s->c, record, "tool", "tip");
    const double radial = hypot(tip.x - 0.42, tip.y) - 0.12, high = tip.z - 0.12;
    kt_worst_below(&s->off, hypot(radial, high), 1.5e-3, "t = %g", record->t);
    return 0;
}

/* The tables of targets are the inverse kinematics of a circle of 0.12 m. The sag of the arm follows from its weight.
 * At the shoulder, about 55 N m act on 20 kN m/rad. The tip is 0.46 m away and sags by 1.3 mm. */
KT_TEST(servos_guide_the_tool_along_its_circle) {
    static const kt_setting own = {NULL, 0.0, 0.0, 0.0};
    kt_case c;
    circle s = {.c = &c, .off = kt_worst_make("off the circle, m")};
    c = kt_case_open("servo-arm");
    if (kt_case_run(&c, &own, 0.0, follow_circle, &s))
        kt_check_worst(&s.off);
}
