/* Slip in a plane whose direction turns, against integrations of its own. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <string.h>

#include "check.h"
#include "touch.h"

/* x'' = -k x - mu g v / |v| of a point on springs of different stiffness. */
static void pull(const double *k, double mu, const double *y, double *dy) {
    const double speed = hypot(y[2], y[3]);
    for (int i = 0; i < 2; i++) {
        dy[i] = y[2 + i];
        dy[2 + i] = -k[i] * y[i] - mu * g * y[2 + i] / speed;
    }
}

static void rk4(const double *k, double mu, double h, double *y) {
    double a[4][4], x[4];
    pull(k, mu, y, a[0]);
    for (int s = 1; s < 4; s++) {
        for (int i = 0; i < 4; i++)
            x[i] = y[i] + (s < 3 ? 0.5 : 1.0) * h * a[s - 1][i];
        pull(k, mu, x, a[s]);
    }
    for (int i = 0; i < 4; i++)
        y[i] += h / 6.0 * (a[0][i] + 2.0 * a[1][i] + 2.0 * a[2][i] + a[3][i]);
}

/* A point slides along x, y and z, at the place y[0], y[1] and the velocity y[2], y[3]. */
static const char *const joints[3] = {"a", "b", "body"};
static void place_point(touch_scene *s, const double y[4]) {
    touch_scene_make(s, KT_JOINT_PRISMATIC);
    for (int i = 0; i < 3; i++) {
        kt_body *body = &s->body[i < 2 ? i + 1 : 0];
        body->name = joints[i];
        body->parent = i > 0 ? joints[i - 1] : NULL;
        body->joint.type = KT_JOINT_PRISMATIC;
        body->joint.axis = kt_vec3_make(i == 0, i == 1, i == 2);
        body->joint.position[0] = i < 2 ? y[i] : 0.0;
        body->joint.velocity[0] = i < 2 ? y[2 + i] : 0.0;
    }
    s->description.body_count = 3;
}

/* A point on a plane, held by springs: its slip turns, and it rests where |k x| < mu g. */
KT_TEST(slip_that_turns_agrees_with_an_integration_of_its_own) {
    const double k[2] = {3.0, 7.0}, mu = 0.05, T = 0.7, h = 1e-4, rest[3] = {0.0};
    double y[4] = {0.5, 0.3, 0.4, -0.9};
    touch_scene s;
    place_point(&s, y);
    (void)touch_scene_add(&s, kt_vec3_make(0.0, 0.0, 0.0), 0.0, mu, 0.0);
    for (int i = 0; i < 2; i++) {
        kt_effect *spring = &s.effect[s.description.effect_count++];
        spring->type = KT_EFFECT_JOINT_SPRING;
        spring->joint = joints[i];
        spring->stiffness = 2.0 * k[i];
    }
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = touch_start(model, "dop853", 0.0);
    kt_error error = {0};
    for (int n = 0; n < (int)lround(T / h); n++)
        rk4(k, mu, h, y);
    kt_test_advance(simulation, T);
    const int at[2] = {kt_body_coordinates(model, kt_body_find(model, "a")).v,
                       kt_body_coordinates(model, kt_body_find(model, "b")).v};
    const double energy = kt_scene_balance(simulation);
    for (int i = 0; i < 2; i++) {
        kt_check_near("position", kt_simulation_positions(simulation)[at[i]], y[i], 1e-11);
        kt_check_near("velocity", kt_simulation_velocities(simulation)[at[i]], y[2 + i], 1e-10);
    }
    kt_test_advance(simulation, 20.0);
    const double *q = kt_simulation_positions(simulation), x = q[at[0]], z = q[at[1]];
    kt_check_equal_int("stuck", (long long)kt_switch_set(kt_simulation_model(simulation)), 3);
    kt_check_below("force of the springs over its limit", hypot(k[0] * x, k[1] * z) / (mu * g), 1.0);
    kt_check_near("balance, J", kt_scene_balance(simulation), energy, 1e-10);
    kt_check_equal_int("contacts", (long long)kt_simulation_contacts(simulation).count, 1);
    kt_need_fine("state", kt_simulation_set_state(simulation, 0.0, rest, NULL, &error), &error);
    kt_check_equal_int("contacts afterwards", (long long)kt_simulation_contacts(simulation).count, 1);
}

/* A point on a turntable of inertia I that starts from rest: implicit steps with the friction of their end. */
static void ride(double mu, double m, double torque, double I, double T, int steps, double *y) {
    const double h = T / steps;
    double x[2] = {0.5, 0.0}, v[2] = {0.0, 0.0}, rate = 0.0, moment = 0.0;
    for (int n = 0; n < steps; n++) {
        for (int i = 0; i < 2; i++)
            x[i] += 0.5 * h * v[i];
        rate += h * (torque + moment) / I;
        const double plate[2] = {-rate * x[1], rate * x[0]}, w[2] = {v[0] - plate[0], v[1] - plate[1]};
        const double size = hypot(w[0], w[1]), left = fmax(0.0, 1.0 - h * mu * g / size);
        double force[2];
        for (int i = 0; i < 2; i++) {
            const double next = plate[i] + left * w[i];
            force[i] = m * (next - v[i]) / h;
            v[i] = next;
            x[i] += 0.5 * h * v[i];
        }
        moment = -(x[0] * force[1] - x[1] * force[0]);
    }
    memcpy(y, x, sizeof x);
    memcpy(y + 2, v, sizeof v);
}

/* A point on a turntable sticks until r sqrt(w'^2 + w^4) = mu g. Slip begins with speed zero, and its direction then
 * turns, at first at an unbounded rate. */
KT_TEST(slip_begins_on_a_turntable_in_a_direction_that_turns) {
    enum { STEPS = 100000 };
    static const char *const methods[] = {"dopri5", "radau5"};
    const double mu = 0.1, T = 1.6, I = 1e6;
    double coarse[4], y[4];
    touch_scene s;
    place_point(&s, (const double[4]){0.5});
    s.body[3].name = "table";
    s.body[3].joint.type = KT_JOINT_REVOLUTE;
    s.body[3].joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
    s.body[3].inertia.xx = s.body[3].inertia.yy = s.body[3].inertia.zz = I;
    s.description.body_count = 4;
    touch_scene_add(&s, kt_vec3_make(0.0, 0.0, 0.0), 0.0, mu, 0.0)->between[1].body = "table";
    kt_model *model = kt_scene_compile(&s.description);
    ride(mu, 2.0, I, I, T, STEPS, coarse);
    ride(mu, 2.0, I, I, T, 2 * STEPS, y);
    for (int i = 0; i < 4; i++)
        y[i] += y[i] - coarse[i]; /* extrapolated */
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        kt_simulation *simulation = touch_start(model, methods[m], 0.0);
        kt_error error = {0};
        double tau[4] = {0.0};
        tau[kt_body_coordinates(model, kt_body_find(model, "table")).v] = I;
        kt_status status = kt_simulation_set_torque(simulation, tau, &error);
        if (status == KT_OK)
            status = kt_simulation_advance(simulation, T, &error);
        kt_need_fine(methods[m], status, &error);
        for (int i = 0; i < 2; i++) {
            const int at = kt_body_coordinates(model, kt_body_find(model, joints[i])).v;
            kt_check_near("position", kt_simulation_positions(simulation)[at], y[i], 1e-9);
            kt_check_near("velocity", kt_simulation_velocities(simulation)[at], y[2 + i], 1e-9);
        }
        kt_check_equal_int("slips", (long long)kt_simulation_contacts(simulation).slips, 1);
    }
}
