/* The rim of a disc on a plane: coins that bounce, roll and slide, against closed forms. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <string.h>

#include "check.h"
#include "motion/simulation/scenes.h"

static const double g = 9.81, pi = 3.14159265358979323846;

enum { FLOOR = 0, COIN = 1 };

/* A coin on a floor that moves on a joint of its own, and the possible drive of that joint. */
typedef struct coin {
    kt_body body[2];
    kt_loop loop[1];
    kt_effect rim;
    kt_description description;
} coin;
static const double coin_radius = 0.0375, coin_mass = 0.44;

/* Its rim touches the floor, inclined by alpha about x. Its axle is the body's z axis, and y points up along the
 * disc. */
static void coin_make(coin *c, double alpha, double friction, double restitution) {
    const double A = 0.25 * coin_mass * coin_radius * coin_radius;
    *c = (coin){.description = kt_description_default(), .rim = kt_effect_default()};
    c->body[FLOOR] = c->body[COIN] = kt_body_default();
    c->body[FLOOR].name = "floor";
    kt_body *body = &c->body[COIN];
    body->name = "coin";
    body->joint.type = KT_JOINT_FREE;
    body->joint.position[2] = coin_radius * sin(alpha);
    body->joint.position[3] = cos(0.5 * alpha);
    body->joint.position[4] = sin(0.5 * alpha);
    body->mass = coin_mass;
    body->inertia.xx = body->inertia.yy = A;
    body->inertia.zz = 2.0 * A;
    c->loop[0] = kt_loop_default();
    c->rim.name = c->loop[0].name = "rim";
    c->rim.type = KT_EFFECT_CONTACT;
    c->rim.between[0].body = "coin";
    c->rim.between[1].body = "floor";
    c->rim.radius = coin_radius;
    c->rim.axle = kt_vec3_make(0.0, 0.0, 2.0);
    c->rim.friction = friction;
    c->rim.restitution = restitution;
    c->description.gravity = kt_vec3_make(0.0, 0.0, -g);
    c->description.bodies = c->body;
    c->description.body_count = 2;
    c->description.effects = &c->rim;
    c->description.effect_count = 1;
    c->description.loops = c->loop;
}

/* It rolls at the rates w of its axes: its lowest point, -r y, has no velocity. */
static void coin_roll(coin *c, double alpha, const double w[3]) {
    double *v = c->body[COIN].joint.velocity;
    v[0] = -coin_radius * w[2];
    v[1] = -coin_radius * sin(alpha) * w[0];
    v[2] = coin_radius * cos(alpha) * w[0];
    memcpy(v + 3, w, 3 * sizeof *w);
}

/* A run of it, and its energy at the start. */
typedef struct coin_run {
    kt_model *model;
    kt_simulation *simulation;
    kt_status status;
    kt_error error;
    double before;
} coin_run;

static coin_run coin_start(const coin *c) {
    coin_run run = {.model = kt_scene_compile(&c->description)};
    run.simulation = kt_scene_start(run.model, "dop853", 0.0, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    run.status = KT_OK;
    run.before = kt_scene_balance(run.simulation);
    return run;
}

/* To where `count` is not 0, or 1 s. */
static bool coin_until(coin_run *run, size_t count) {
    kt_contact_counts counts = {.impacts = 0};
    while (run->status == KT_OK && *(const uint64_t *)(const void *)((const char *)&counts + count) == 0 &&
           kt_simulation_time(run->simulation) < 1.0) {
        run->status = kt_simulation_step(run->simulation, 1.0, &run->error);
        counts = kt_simulation_contacts(run->simulation);
    }
    return kt_fine("steps", run->status, &run->error);
}

static void coin_end(coin_run *run, double bound) {
    if (run->status == KT_OK)
        kt_check_near("balance, J", kt_scene_balance(run->simulation), run->before, bound);
}

/* Dropped with a spin w about its axle. At the impact, the rim has the mass M = 1 / (1 / m + r^2 cos^2(alpha) / A).
 * This is m / (1 + 4 cos^2(alpha)). The impulse p = (1 + e) M w acts r cos(alpha) off the centre. */
KT_TEST(coin_bounces_as_its_impulse_says) {
    for (int i = 0; i < 3; i++) {
        const double alpha = 0.3 + 0.5 * i, e = 0.6, h = 0.1, w = sqrt(2.0 * g * h);
        const double M = coin_mass / (1.0 + 4.0 * cos(alpha) * cos(alpha)), p = (1.0 + e) * M * w,
                     rate = 4.0 * p * cos(alpha) / (coin_mass * coin_radius);
        coin c;
        coin_make(&c, alpha, 0.0, e);
        c.body[COIN].joint.position[2] += h;
        c.body[COIN].joint.velocity[5] = 20.0;
        coin_run run = coin_start(&c);
        if (coin_until(&run, offsetof(kt_contact_counts, impacts))) {
            const double *v = kt_simulation_velocities(run.simulation), turned = 20.0 * sqrt(2.0 * h / g);
            kt_check_near("when, s", kt_simulation_time(run.simulation), sqrt(2.0 * h / g), 4e-15);
            kt_check_near("speed", v[2], p / coin_mass - w, 1e-13);
            kt_check_near("rate", v[3], -rate * cos(turned), 1e-11);
            kt_check_near("rate across", v[4], rate * sin(turned), 1e-11);
            kt_check_near("spin", v[5], 20.0, 1e-12);
            kt_check_near("lost, J", kt_simulation_contacts(run.simulation).dissipated, 0.5 * p * w * (1.0 - e), 1e-14);
        }
        coin_end(&run, 1e-13);
    }
}

/* While it rolls it is the loop `rolling`, whose three equations are then two loops'. */
KT_TEST(coin_rolls_on_its_contact_as_on_the_loop) {
    const double alpha = 0.9, w[3] = {0.7, -6.0, 9.0};
    double state[2][13] = {{0.0}}, off = 0.0;
    for (int i = 0; i < 2; i++) {
        coin c;
        coin_make(&c, alpha, 0.9, 0.3);
        coin_roll(&c, alpha, w);
        c.loop[0].type = KT_LOOP_ROLLING;
        c.loop[0].between[0] = c.rim.between[0];
        c.loop[0].radius = coin_radius;
        c.description.loop_count = i;
        c.description.effect_count = 1 - i;
        coin_run run = coin_start(&c);
        kt_test_advance(run.simulation, 1.0);
        const kt_contact_counts counts = kt_simulation_contacts(run.simulation);
        memcpy(state[i], kt_simulation_positions(run.simulation), 7 * sizeof(double));
        memcpy(state[i] + 7, kt_simulation_velocities(run.simulation), 6 * sizeof(double));
        kt_check_equal_int("sticks once", (long long)counts.sticks, 1 - i);
        kt_check_equal_int("neither slips nor leaves", (long long)counts.slips + (long long)counts.openings, 0);
        coin_end(&run, 1e-12);
    }
    for (int k = 0; k < 13; k++)
        off = fmax(off, fabs(state[0][k] - state[1][k]));
    kt_check_above("it has moved, m", hypot(state[0][0], state[0][1]), 0.01);
    kt_check_below("states after 1 s", off, 1e-9);
}

/* Upright it slides at v0. From the time v0 / (3 mu g) on, it rolls at 2/3 v0. */
KT_TEST(sliding_disc_rolls_at_two_thirds) {
    const double mu = 0.25, v0 = 0.9, time = v0 / (3.0 * mu * g);
    coin c;
    coin_make(&c, 0.5 * pi, mu, 0.0);
    c.body[COIN].joint.velocity[0] = v0;
    coin_run run = coin_start(&c);
    if (coin_until(&run, offsetof(kt_contact_counts, sticks))) {
        kt_check_near("rolls from, s", kt_simulation_time(run.simulation), time, 1e-12);
        kt_check_near("at, m", kt_simulation_positions(run.simulation)[0], 5.0 / 6.0 * v0 * time, 1e-12);
        kt_test_advance(run.simulation, 0.3);
        kt_check_near("speed", kt_simulation_velocities(run.simulation)[0], 2.0 / 3.0 * v0, 2e-14);
        kt_check_near("spin", kt_simulation_velocities(run.simulation)[5], -2.0 / 3.0 * v0 / coin_radius, 5e-13);
    }
    coin_end(&run, 1e-12);
}

/* It rolls upright on a floor at a sin(k t), and leaves the floor when a k^2 sin(k t) = g. */
KT_TEST(coin_leaves_a_floor_that_falls_faster) {
    const double a = 0.02, k = 10.0 * pi, t1 = asin(g / (a * k * k)) / k, v1 = a * k * cos(k * t1), v0 = 0.5;
    const double w[3] = {0.0, 0.0, -v0 / coin_radius}, flight = 0.03;
    coin c;
    coin_make(&c, 0.5 * pi, 0.5, 0.0);
    coin_roll(&c, 0.5 * pi, w);
    c.body[COIN].joint.velocity[2] = a * k;
    c.body[FLOOR].joint.type = KT_JOINT_PRISMATIC;
    c.body[FLOOR].mass = 1.0;
    c.loop[0].name = "shaker";
    c.loop[0].type = KT_LOOP_MOTION;
    c.loop[0].joint = "floor";
    c.loop[0].function = kt_function_sine(a, 0.5 * k / pi, 0.0, 0.0);
    c.description.loop_count = 1;
    coin_run run = coin_start(&c);
    if (coin_until(&run, offsetof(kt_contact_counts, openings))) {
        kt_check_near("leaves, s", kt_simulation_time(run.simulation), t1, 1e-12);
        kt_test_advance(run.simulation, t1 + flight);
        const double *q = kt_simulation_positions(run.simulation),
                     z = a * sin(k * t1) + (v1 - 0.5 * g * flight) * flight;
        kt_check_near("height, m", q[3], coin_radius + z, 5e-15);
        kt_check_near("along, m", q[1], v0 * (t1 + flight), 5e-15);
        kt_check_near("spin", kt_simulation_velocities(run.simulation)[6], w[2], 1e-11);
    }
    coin_end(&run, 1e-10);
}

/* Dropped with friction, it bounces, slips and sticks. Its energies add up, and its rim stays above the floor. */
KT_TEST(coin_that_bounces_with_friction_keeps_its_account) {
    coin c;
    double deepest = 0.0;
    coin_make(&c, 1.0, 0.3, 0.5);
    c.body[COIN].joint.position[2] += 0.05;
    c.body[COIN].joint.velocity[4] = 40.0;
    coin_run run = coin_start(&c);
    while (run.status == KT_OK && kt_simulation_time(run.simulation) < 0.6) {
        run.status = kt_simulation_step(run.simulation, 0.6, &run.error);
        const double *q = kt_simulation_positions(run.simulation);
        const double x = q[4] * q[6] + q[3] * q[5], y = q[5] * q[6] - q[3] * q[4];
        deepest = fmax(deepest, 2.0 * coin_radius * hypot(x, y) - q[2]);
    }
    kt_need_fine("bounces", run.status, &run.error);
    kt_check_below("deepest, m", deepest, 5e-15);
    kt_check_above("bounces", (double)kt_simulation_contacts(run.simulation).impacts, 3.0);
    kt_check_above("sticks", (double)kt_simulation_contacts(run.simulation).sticks, 1.0);
    coin_end(&run, 2e-13);
}

KT_TEST(discs_without_a_radius_are_told) {
    coin c;
    coin_make(&c, 1.0, 0.0, 0.5);
    c.rim.radius = 0.0;
    kt_scene_check_rejected("a point", &c.description, "radius is 0; that of a disc must be above 0");
    c.rim.restitution = (double)INFINITY;
    c.rim.stiffness = 1e4;
    kt_scene_check_rejected("elastic", &c.description, "radius is 0; that of a disc must be above 0");
}
