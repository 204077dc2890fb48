/* Hard contacts with Coulomb's friction against closed forms: rolling, resting, sliding, impacts, undecided motions. */
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "interpose.h"
#include "scenes.h"
#include "stepper.h"

enum { POINTS = 5 };
static const double g = 9.81;

/* A body with points that touch planes of the world or of a second body. */
typedef struct scene {
    kt_body body[4];
    kt_marker marker[POINTS];
    kt_effect effect[POINTS + 2];
    char name[POINTS][8];
    kt_description description;
} scene;

static void scene_make(scene *s, kt_joint_type joint) {
    *s = (scene){.description = kt_description_default()};
    for (int i = 0; i < 4; i++)
        s->body[i] = kt_body_default();
    for (int i = 0; i < POINTS + 2; i++)
        s->effect[i] = kt_effect_default();
    s->body[0].name = "body";
    s->body[0].joint.type = joint;
    s->body[0].mass = 2.0;
    s->body[0].markers = s->marker;
    s->description.bodies = s->body;
    s->description.body_count = 1;
    s->description.effects = s->effect;
    s->description.gravity = kt_vec3_make(0.0, 0.0, -g);
}

/* A sphere about a point of the body on the plane through `end` normal to z. */
static kt_effect *scene_touch(scene *s, kt_vec3 at, double radius, double friction, double restitution) {
    const int i = s->body[0].marker_count++;
    kt_effect *effect = &s->effect[s->description.effect_count++];
    (void)snprintf(s->name[i], sizeof s->name[i], "p%d", i);
    s->marker[i] = (kt_marker){.name = s->name[i], .at = at};
    effect->name = s->name[i];
    effect->type = KT_EFFECT_CONTACT;
    effect->between[0].body = "body";
    effect->between[0].marker = s->name[i];
    effect->radius = radius;
    effect->friction = friction;
    effect->restitution = restitution;
    return effect;
}

static void scene_ball(scene *s, double friction, double restitution) {
    scene_make(s, KT_JOINT_FREE);
    s->body[0].joint.position[2] = 0.1;
    s->body[0].inertia.xx = s->body[0].inertia.yy = s->body[0].inertia.zz = 0.4 * 2.0 * 0.1 * 0.1;
    (void)scene_touch(s, kt_vec3_make(0.0, 0.0, 0.0), 0.1, friction, restitution);
}

/* A box on three or four feet, with sides of 0.6 m, 0.4 m and 0.2 m. Gravity is tilted by `angle` towards x. */
static void scene_box(scene *s, int feet, double friction, double angle) {
    const double x = 0.3, y = 0.2, z = -0.1, m = 2.0;
    scene_make(s, KT_JOINT_FREE);
    s->body[0].joint.position[2] = 0.1;
    s->body[0].inertia.xx = m / 12.0 * (0.16 + 0.04);
    s->body[0].inertia.yy = m / 12.0 * (0.36 + 0.04);
    s->body[0].inertia.zz = m / 12.0 * (0.36 + 0.16);
    (void)scene_touch(s, kt_vec3_make(x, y, z), 0.0, friction, 0.0);
    (void)scene_touch(s, kt_vec3_make(x, -y, z), 0.0, friction, 0.0);
    (void)scene_touch(s, kt_vec3_make(-x, feet == 3 ? 0.0 : y, z), 0.0, friction, 0.0);
    if (feet == 4)
        (void)scene_touch(s, kt_vec3_make(-x, -y, z), 0.0, friction, 0.0);
    s->description.gravity = kt_vec3_make(g * sin(angle), 0.0, -g * cos(angle));
}

static kt_simulation *start(const kt_model *model, const char *method, double step) {
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    run.integrator = method;
    run.step = step;
    run.duration = 100.0;
    run.relative = run.absolute = 1e-11;
    options.record = KT_RECORD_BALANCE | KT_RECORD_ENERGY | KT_RECORD_ACCELERATION;
    return model != NULL ? kt_scene_simulate(model, &run, &options) : NULL;
}

/* The first time at which the contacts have stuck so often. */
static kt_status until_stuck(kt_simulation *simulation, uint64_t count, double most, kt_error *error) {
    kt_status status = simulation != NULL ? KT_OK : KT_ERROR_ARGUMENT;
    while (status == KT_OK && kt_simulation_contacts(simulation).sticks < count &&
           kt_simulation_time(simulation) < most)
        status = kt_simulation_step(simulation, most, error);
    return status;
}

/* ---- rolling ----------------------------------------------------------------------------------------------------- */

/* A ball that slides at v0 rolls at 5/7 v0 from t = 2 v0 / (7 mu g) on. It loses the energy m v0^2 / 7. */
KT_TEST(sliding_ball_rolls_at_five_sevenths) {
    static const char *const methods[] = {"dopri5", "dop853", "rk4", "radau5", "bdf2", "rkc2", NULL};
    const double mu = 0.3, v0 = 1.5, time = 2.0 * v0 / (7.0 * mu * g);
    scene s;
    scene_ball(&s, mu, 0.0);
    s.body[0].joint.velocity[0] = 0.8 * v0;
    s.body[0].joint.velocity[1] = 0.6 * v0;
    kt_model *model = kt_scene_compile(&s.description);
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        const bool fixed = methods[m] != NULL && (strcmp(methods[m], "rk4") == 0 || strcmp(methods[m], "bdf2") == 0);
        kt_simulation *simulation = start(model, methods[m], fixed ? 0.01 : 0.0);
        kt_error error = {0};
        const double energy = simulation != NULL ? kt_scene_balance(simulation) : 0.0;
        if (kt_fine(methods[m] ? methods[m] : "default", until_stuck(simulation, 1, 1.0, &error), &error)) {
            const double *v = kt_simulation_velocities(simulation), *q = kt_simulation_positions(simulation);
            kt_check_near("rolls from, s", kt_simulation_time(simulation), time, 1e-12);
            kt_check_near("at, m", hypot(q[0], q[1]), 6.0 / 7.0 * v0 * time, 1e-12);
            (void)kt_fine("rolls", kt_simulation_advance(simulation, 2.0, &error), &error);
            kt_check_near("speed", hypot(v[0], v[1]), 5.0 / 7.0 * v0, 2e-14);
            kt_check_near("spin", hypot(v[3], v[4]), 5.0 / 7.0 * v0 / 0.1, 2e-13);
            kt_check_near("height", q[2], 0.1, 1e-16);
            kt_check_near("balance, J", kt_scene_balance(simulation), energy, 2e-13);
            kt_check_equal_int("sticks", (long long)kt_simulation_contacts(simulation).sticks, 1);
        }
        kt_simulation_free(simulation);
    }
    kt_model_free(model);
}

/* A disc inclined by alpha slides across its slope. All follows by hand from N (1 / m + r^2 cos^2(alpha) / A) = g. */
KT_TEST(inclined_disc_slides_with_its_force_at_the_rim) {
    const double alpha = 0.7, r = 0.1, m = 2.0, mu = 0.2, A = 0.25 * m * r * r, c = cos(alpha);
    const double N = m * g / (1.0 + 4.0 * c * c);
    const double expected[] = {-mu * N / m, 0.0, N / m - g, -c * r * N / A, 0.0, -0.5 * mu * r * N / A};
    kt_record record = {0};
    kt_error error = {0};
    scene s;
    scene_make(&s, KT_JOINT_FREE);
    s.body[0].joint.position[2] = r * sin(alpha);
    s.body[0].joint.position[3] = cos(0.5 * alpha);
    s.body[0].joint.position[4] = sin(0.5 * alpha);
    s.body[0].joint.velocity[0] = 1.5;
    s.body[0].inertia.xx = s.body[0].inertia.yy = A;
    s.body[0].inertia.zz = 2.0 * A;
    scene_touch(&s, kt_vec3_make(0.0, 0.0, 0.0), r, mu, 0.0)->axle = kt_vec3_make(0.0, 0.0, 1.0);
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = start(model, "dopri5", 0.0);
    if (simulation != NULL && kt_fine("sense", kt_simulation_sense(simulation, &record, &error), &error))
        for (int k = 0; k < 6; k++)
            kt_check_near("acceleration", record.a[k], expected[k], 2e-14 * g / r);
    kt_simulation_free(simulation);
    kt_model_free(model);
}

/* A ball that is released on an incline rolls at 5/7 g sin(a) if tan(a) < 7/2 mu. On a steeper incline it slides. */
KT_TEST(ball_on_an_incline_rolls_or_slides) {
    for (int i = 0; i < 2; i++) {
        const double mu = 0.2, angle = atan(3.5 * mu * (i == 0 ? 0.99 : 1.01));
        const double a = i == 0 ? 5.0 / 7.0 * g * sin(angle) : g * (sin(angle) - mu * cos(angle));
        scene s;
        scene_ball(&s, mu, 0.0);
        s.description.gravity = kt_vec3_make(g * sin(angle), 0.0, -g * cos(angle));
        kt_model *model = kt_scene_compile(&s.description);
        kt_simulation *simulation = start(model, "dopri5", 0.0);
        kt_error error = {0};
        if (simulation != NULL && kt_fine("runs", kt_simulation_advance(simulation, 1.0, &error), &error)) {
            kt_check_near("position", kt_simulation_positions(simulation)[0], 0.5 * a, 2e-14);
            kt_check_equal_int("sticks", (long long)kt_simulation_contacts(simulation).sticks, i == 0);
        }
        kt_simulation_free(simulation);
        kt_model_free(model);
    }
}

/* ---- resting ----------------------------------------------------------------------------------------------------- */

/* A block on three or four feet lies to the bit for 100 s at 0.9995 of the slope at which it slides. Above that, it
 * slides at g (sin a - mu cos a). The feet have different normal forces and reach their limits together. */
KT_TEST(block_on_an_incline_lies_or_slides) {
    for (int feet = 3; feet <= 4; feet++)
        for (int i = 0; i < 2; i++) {
            const double mu = 0.3, angle = atan(mu * (i == 0 ? 0.9995 : 1.0005));
            const double a = g * (sin(angle) - mu * cos(angle)), end = i == 0 ? 100.0 : 1.0;
            const double given[7] = {0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0};
            scene s;
            scene_box(&s, feet, mu, angle);
            kt_model *model = kt_scene_compile(&s.description);
            kt_simulation *simulation = start(model, "dopri5", 0.0);
            kt_error error = {0};
            if (simulation != NULL && kt_fine("runs", kt_simulation_advance(simulation, end, &error), &error)) {
                const double *q = kt_simulation_positions(simulation);
                if (i == 0)
                    kt_check_equal_bits("creep", q, given, 7);
                else
                    kt_check_near("slides", q[0], 0.5 * a, 1e-15);
                kt_check_equal_int("closings", (long long)kt_simulation_contacts(simulation).closings, 3);
                kt_check_equal_int("undecided", (long long)kt_simulation_contacts(simulation).undecided, 0);
            }
            kt_simulation_free(simulation);
            kt_model_free(model);
        }
}

/* A block between a wall and a jaw with force F. If 2 mu F is 95 times its weight, it does not creep in 100 s. At 0.99
 * of the weight, it slides down at g - 2 mu F / m. */
KT_TEST(pinched_block_does_not_creep) {
    for (int i = 0; i < 2; i++) {
        const double mu = 0.5, m = 2.0, margin = i == 0 ? 95.0 : 0.99, F = margin * m * g / (2.0 * mu);
        scene s;
        scene_make(&s, KT_JOINT_FREE);
        s.body[0].inertia.xx = s.body[0].inertia.yy = s.body[0].inertia.zz = 0.01;
        s.body[1].name = "jaw";
        s.body[1].mass = 1.0;
        s.body[1].joint.type = KT_JOINT_PRISMATIC;
        s.body[1].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
        s.description.body_count = 2;
        kt_effect *wall = scene_touch(&s, kt_vec3_make(-0.1, 0.1, 0.0), 0.0, mu, 0.0);
        kt_effect *other = scene_touch(&s, kt_vec3_make(-0.1, -0.1, 0.0), 0.0, mu, 0.0);
        kt_effect *jaw = scene_touch(&s, kt_vec3_make(0.1, 0.0, 0.0), 0.0, mu, 0.0);
        wall->axis = other->axis = kt_vec3_make(1.0, 0.0, 0.0);
        wall->between[1].at = other->between[1].at = kt_vec3_make(-0.1, 0.0, 0.0);
        jaw->axis = kt_vec3_make(-1.0, 0.0, 0.0);
        jaw->between[1] =
            (kt_end){.body = "jaw", .at = kt_vec3_make(0.1, 0.0, 0.0), .rotation = jaw->between[1].rotation};
        kt_effect *motor = &s.effect[s.description.effect_count++];
        motor->type = KT_EFFECT_MOTOR;
        motor->joint = "jaw";
        motor->torque = kt_function_constant(-F);
        kt_model *model = kt_scene_compile(&s.description);
        kt_simulation *simulation = start(model, "dopri5", 0.0);
        kt_error error = {0};
        const double given[8] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0};
        if (simulation != NULL &&
            kt_fine("runs", kt_simulation_advance(simulation, i == 0 ? 100.0 : 1.0, &error), &error)) {
            if (i == 0)
                kt_check_equal_bits("creep", kt_simulation_positions(simulation), given, 8);
            else
                kt_check_near("slides", kt_simulation_positions(simulation)[2], -0.5 * (g - 2.0 * mu * F / m), 1e-14);
        }
        kt_simulation_free(simulation);
        kt_model_free(model);
    }
}

/* A clutch with Stribeck's curve F(r) = C + (S - C) exp(-(r / s)^2) between two masses of 1 kg at 3 and 1 m/s. With the
 * reduced mass m = 1/2, it grips after the integral of m dr / F(r) from 0 to 2 m/s (Simpson's rule). */
KT_TEST(clutch_with_stribeck_friction_grips_in_time) {
    enum { PANELS = 20000 };
    const double C = 0.5, S = 1.2, s = 0.3, relative = 2.0, h = relative / PANELS;
    double time = 0.0;
    for (int i = 0; i <= PANELS; i++) {
        const double v = i * h, weight = i == 0 || i == PANELS ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
        time += weight * h / 3.0 * 0.5 / (C + (S - C) * exp(-v * v / (s * s)));
    }
    scene r;
    scene_make(&r, KT_JOINT_PRISMATIC);
    r.body[0].mass = r.body[1].mass = 1.0;
    r.body[0].joint.axis = r.body[1].joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
    r.body[1].name = "b";
    r.body[1].parent = "body";
    r.body[1].joint.type = KT_JOINT_PRISMATIC;
    r.body[0].joint.velocity[0] = 3.0;
    r.body[1].joint.velocity[0] = -relative;
    r.description.body_count = 2;
    r.effect[0].type = KT_EFFECT_JOINT_FRICTION;
    r.effect[0].joint = "b";
    r.effect[0].coulomb = C;
    r.effect[0].breakaway = S;
    r.effect[0].stribeck = s;
    r.effect[0].stick = true;
    r.description.effect_count = 1;
    kt_model *model = kt_scene_compile(&r.description);
    kt_simulation *simulation = start(model, "dop853", 0.0);
    kt_error error = {0};
    kt_status status = simulation != NULL ? KT_OK : KT_ERROR_ARGUMENT;
    while (status == KT_OK && kt_simulation_contacts(simulation).sticks == 0 && kt_simulation_time(simulation) < 5.0)
        status = kt_simulation_step(simulation, 5.0, &error);
    if (kt_fine("grips", status, &error)) {
        kt_check_near("grips from, s", kt_simulation_time(simulation), time, 2e-11); /* the tolerance is 1e-11 */
        (void)kt_fine("holds", kt_simulation_advance(simulation, 5.0, &error), &error);
        kt_check_near("speed", kt_simulation_velocities(simulation)[0], 2.0, 1e-12);
        kt_check_near("slip", kt_simulation_velocities(simulation)[1], 0.0, 0.0);
        kt_check_near("balance, J", kt_scene_balance(simulation), 5.0, 1e-11);
    }
    kt_simulation_free(simulation);
    kt_model_free(model);
}

/* A point of m = 2 kg slides at v0 on a plank of M = 3 kg: both reach m v0 / (m + M) at v0 / (mu g (1 + m / M)). */
KT_TEST(plank_is_dragged_along) {
    const double mu = 0.2, m = 2.0, M = 3.0, v0 = 1.0, time = v0 / (mu * g * (1.0 + m / M));
    scene s;
    scene_make(&s, KT_JOINT_FREE);
    s.body[0].inertia.xx = s.body[0].inertia.yy = s.body[0].inertia.zz = 0.1;
    s.body[0].joint.velocity[0] = v0;
    s.body[1].name = "plank";
    s.body[1].mass = M;
    s.body[1].joint.type = KT_JOINT_PRISMATIC;
    s.body[1].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    s.description.body_count = 2;
    scene_touch(&s, kt_vec3_make(0.0, 0.0, 0.0), 0.0, mu, 0.0)->between[1].body = "plank";
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = start(model, "dopri5", 0.0);
    kt_error error = {0};
    if (kt_fine("slides", until_stuck(simulation, 1, 2.0, &error), &error)) {
        const double *v = kt_simulation_velocities(simulation);
        const int plank = kt_body_coordinates(model, kt_body_find(model, "plank")).v;
        const int body = kt_body_coordinates(model, kt_body_find(model, "body")).v;
        kt_check_near("time, s", kt_simulation_time(simulation), time, 1e-12);
        kt_check_near("plank", v[plank], m * v0 / (m + M), 1e-14);
        kt_check_near("body", v[body], m * v0 / (m + M), 1e-14);
    }
    kt_simulation_free(simulation);
    kt_model_free(model);
}

/* ---- slip in a plane --------------------------------------------------------------------------------------------- */

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

/* A point on a plane, held by springs: its slip turns, and it rests where |k x| < mu g. */
KT_TEST(slip_that_turns_agrees_with_an_integration_of_its_own) {
    static const char *const joints[3] = {"a", "b", "body"};
    const double k[2] = {3.0, 7.0}, mu = 0.05, T = 0.7, h = 1e-4;
    double y[4] = {0.5, 0.3, 0.4, -0.9};
    scene s;
    scene_make(&s, KT_JOINT_PRISMATIC);
    for (int i = 0; i < 3; i++) {
        kt_body *body = &s.body[i < 2 ? i + 1 : 0];
        body->name = joints[i];
        body->parent = i > 0 ? joints[i - 1] : NULL;
        body->joint.type = KT_JOINT_PRISMATIC;
        body->joint.axis = kt_vec3_make(i == 0, i == 1, i == 2);
        body->joint.position[0] = i < 2 ? y[i] : 0.0;
        body->joint.velocity[0] = i < 2 ? y[2 + i] : 0.0;
    }
    s.description.body_count = 3;
    (void)scene_touch(&s, kt_vec3_make(0.0, 0.0, 0.0), 0.0, mu, 0.0);
    for (int i = 0; i < 2; i++) {
        kt_effect *spring = &s.effect[s.description.effect_count++];
        spring->type = KT_EFFECT_JOINT_SPRING;
        spring->joint = joints[i];
        spring->stiffness = 2.0 * k[i];
    }
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = start(model, "dop853", 0.0);
    kt_error error = {0};
    for (int n = 0; n < (int)lround(T / h); n++)
        rk4(k, mu, h, y);
    if (simulation != NULL && kt_fine("slides", kt_simulation_advance(simulation, T, &error), &error)) {
        const int at[2] = {kt_body_coordinates(model, kt_body_find(model, "a")).v,
                           kt_body_coordinates(model, kt_body_find(model, "b")).v};
        const double energy = kt_scene_balance(simulation);
        for (int i = 0; i < 2; i++) {
            kt_check_near("position", kt_simulation_positions(simulation)[at[i]], y[i], 1e-11);
            kt_check_near("velocity", kt_simulation_velocities(simulation)[at[i]], y[2 + i], 1e-10);
        }
        if (kt_fine("rests", kt_simulation_advance(simulation, 20.0, &error), &error)) {
            const double *q = kt_simulation_positions(simulation), x = q[at[0]], z = q[at[1]];
            kt_check_equal_int("stuck", (long long)kt_switch_set(kt_simulation_model(simulation)), 3);
            kt_check_below("force of the springs over its limit", hypot(k[0] * x, k[1] * z) / (mu * g), 1.0);
            kt_check_near("balance, J", kt_scene_balance(simulation), energy, 1e-10);
        }
    }
    kt_simulation_free(simulation);
    kt_model_free(model);
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
    static const char *const joints[3] = {"a", "b", "body"}, *const methods[] = {"dopri5", "radau5"};
    const double mu = 0.1, T = 1.6, I = 1e6;
    double coarse[4], y[4];
    scene s;
    scene_make(&s, KT_JOINT_PRISMATIC);
    for (int i = 0; i < 3; i++) {
        kt_body *body = &s.body[i < 2 ? i + 1 : 0];
        body->name = joints[i];
        body->parent = i > 0 ? joints[i - 1] : NULL;
        body->joint.type = KT_JOINT_PRISMATIC;
        body->joint.axis = kt_vec3_make(i == 0, i == 1, i == 2);
        body->joint.position[0] = i == 0 ? 0.5 : 0.0;
    }
    s.body[3].name = "table";
    s.body[3].joint.type = KT_JOINT_REVOLUTE;
    s.body[3].joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
    s.body[3].inertia.xx = s.body[3].inertia.yy = s.body[3].inertia.zz = I;
    s.description.body_count = 4;
    scene_touch(&s, kt_vec3_make(0.0, 0.0, 0.0), 0.0, mu, 0.0)->between[1].body = "table";
    kt_model *model = kt_scene_compile(&s.description);
    ride(mu, 2.0, I, I, T, STEPS, coarse);
    ride(mu, 2.0, I, I, T, 2 * STEPS, y);
    for (int i = 0; i < 4; i++)
        y[i] += y[i] - coarse[i]; /* extrapolated */
    for (size_t m = 0; model != NULL && m < sizeof methods / sizeof *methods; m++) {
        kt_simulation *simulation = start(model, methods[m], 0.0);
        kt_error error = {0};
        double tau[4] = {0.0};
        tau[kt_body_coordinates(model, kt_body_find(model, "table")).v] = I;
        kt_status status = simulation != NULL ? kt_simulation_set_torque(simulation, tau, &error) : KT_ERROR_ARGUMENT;
        if (status == KT_OK)
            status = kt_simulation_advance(simulation, T, &error);
        if (kt_fine(methods[m], status, &error)) {
            for (int i = 0; i < 2; i++) {
                const int at = kt_body_coordinates(model, kt_body_find(model, joints[i])).v;
                kt_check_near("position", kt_simulation_positions(simulation)[at], y[i], 1e-9);
                kt_check_near("velocity", kt_simulation_velocities(simulation)[at], y[2 + i], 1e-9);
            }
            kt_check_equal_int("slips", (long long)kt_simulation_contacts(simulation).slips, 1);
        }
        kt_simulation_free(simulation);
    }
    kt_model_free(model);
}

/* ---- impacts ----------------------------------------------------------------------------------------------------- */

/* A ball with an oblique speed and no spin: the tangential impulse is the lesser of 2/7 m v and mu times the normal
 * one. */
KT_TEST(impact_with_friction_sticks_or_slips) {
    for (int i = 0; i < 2; i++) {
        const double e = 0.6, mu = i == 0 ? 0.5 : 0.1, v = 1.3, w = 2.0, m = 2.0, r = 0.1;
        const double normal = m * (1.0 + e) * w, tangent = fmin(mu * normal, 2.0 / 7.0 * m * v);
        const double after = v - tangent / m, spin = tangent * r / (0.4 * m * r * r);
        const double lost = 0.5 * m * (v * v + w * w * (1.0 - e * e) - after * after) - 0.2 * m * r * r * spin * spin;
        scene s;
        scene_ball(&s, mu, e);
        s.body[0].joint.velocity[0] = v;
        s.body[0].joint.velocity[2] = -w;
        kt_model *model = kt_scene_compile(&s.description);
        kt_simulation *simulation = start(model, "dopri5", 0.0);
        if (simulation != NULL) {
            const double *u = kt_simulation_velocities(simulation);
            kt_check_near("along", u[0], after, 1e-15);
            kt_check_near("up", u[2], e * w, 1e-15);
            kt_check_near("spin", u[4], spin, 1e-14);
            kt_check_near("lost, J", kt_simulation_contacts(simulation).dissipated, lost, 1e-14);
            kt_check_equal_int("impacts", (long long)kt_simulation_contacts(simulation).impacts, 1);
        }
        kt_simulation_free(simulation);
        kt_model_free(model);
    }
}

/* One phase at a contact in a plane, by hand. W = nn, nt, tt; u = n, t becomes u + W p, with p >= `least` along n. */
static void phase_by_hand(const double *W, double mu, double least, double *u, double *p) {
    for (int part = 0; part < 2; part++) { /* pressing, and then with the least impulse */
        const double n = part ? least : -(W[2] * u[0] - W[1] * u[1]) / (W[0] * W[2] - W[1] * W[1]);
        double q[2] = {n, -(u[1] + W[1] * n) / W[2]};
        if (fabs(q[1]) > mu * n) {
            const double slip = copysign(mu, q[1]);
            q[0] = part ? least : -u[0] / (W[0] + W[1] * slip);
            q[1] = slip * q[0];
        }
        const double after = u[0] + W[0] * q[0] + W[1] * q[1];
        if (part ? after < -1e-12 : q[0] < least)
            continue;
        u[0] = after;
        u[1] += W[1] * q[0] + W[2] * q[1];
        p[0] += q[0];
        p[1] += q[1];
        return;
    }
}

/* Two rods of 1 kg and 1 m hang on a pin, and the lower end strikes the floor. The source is Kane (1984), and Kane and
 * Levinson, Dynamics: Theory and Applications (1985). At one contact with friction, Newton's rule returns more than the
 * compression has taken, and the energy would grow. Poisson's does not. after: rates of both rods. */
static kt_contact_counts strike_floor(double mu, double e, bool poisson, const double *angle, const double *rate,
                                      double *after) {
    scene s;
    kt_contact_counts counts = {.count = 0};
    scene_make(&s, KT_JOINT_REVOLUTE);
    s.body[1].name = "upper";
    s.body[0].parent = "upper";
    s.body[1].joint.type = KT_JOINT_REVOLUTE;
    s.body[0].joint.at = kt_vec3_make(0.0, 0.0, -1.0);
    for (int i = 0; i < 2; i++) {
        s.body[i].joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
        s.body[i].mass = 1.0;
        s.body[i].com = kt_vec3_make(0.0, 0.0, -0.5);
        s.body[i].inertia.xx = s.body[i].inertia.yy = s.body[i].inertia.zz = 1.0 / 12.0;
        s.body[i].joint.position[0] = angle[1 - i] - (i == 0 ? angle[0] : 0.0);
        s.body[i].joint.velocity[0] = rate[1 - i] - (i == 0 ? rate[0] : 0.0);
    }
    kt_effect *effect = scene_touch(&s, kt_vec3_make(0.0, 0.0, -1.0), 0.0, mu, e);
    effect->between[1].at = kt_vec3_make(0.0, 0.0, -cos(angle[0]) - cos(angle[1]));
    effect->poisson = poisson;
    s.description.body_count = 2;
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = start(model, "dopri5", 0.0);
    if (simulation != NULL) {
        const double *v = kt_simulation_velocities(simulation);
        after[0] = v[0]; /* the upper one is listed first, as is its joint */
        after[1] = v[0] + v[1];
        counts = kt_simulation_contacts(simulation);
    }
    kt_simulation_free(simulation);
    kt_model_free(model);
    return counts;
}

/* Velocities of the end, and the rates that impulses p (normal, along) at it give the rods. */
static void end_velocity(const double *angle, const double *rate, double *u) {
    u[0] = sin(angle[0]) * rate[0] + sin(angle[1]) * rate[1];
    u[1] = -cos(angle[0]) * rate[0] - cos(angle[1]) * rate[1];
}

static void rates_of(const double *angle, const double *p, double *rate) {
    const double c = 0.5 * cos(angle[1] - angle[0]), det = 4.0 / 9.0 - c * c;
    const double f0 = sin(angle[0]) * p[0] - cos(angle[0]) * p[1], f1 = sin(angle[1]) * p[0] - cos(angle[1]) * p[1];
    rate[0] = (f0 / 3.0 - c * f1) / det;
    rate[1] = (4.0 / 3.0 * f1 - c * f0) / det;
}

static double rods_energy(const double *angle, const double *rate) {
    return 2.0 / 3.0 * rate[0] * rate[0] + rate[1] * rate[1] / 6.0 + 0.5 * cos(angle[1] - angle[0]) * rate[0] * rate[1];
}

KT_TEST(poissons_rule_does_not_let_the_energy_of_kanes_pendulum_grow) {
    const double angle[2] = {0.349, 0.524}, rate[2] = {-0.1, -0.2}, mus[3] = {0.1, 0.5, 5.0}, e = 0.7;
    uint64_t told = 0;
    for (int k = 0; k < 3; k++) {
        double unit[2][2], W[3], u[2], p[2] = {0.0, 0.0}, by[2], after[2], newton[2];
        for (int j = 0; j < 2; j++) { /* W by the rates that unit impulses give */
            rates_of(angle, (double[]){j == 0, j == 1}, by);
            end_velocity(angle, by, unit[j]);
        }
        W[0] = unit[0][0];
        W[1] = unit[0][1];
        W[2] = unit[1][1];
        end_velocity(angle, rate, u);
        phase_by_hand(W, mus[k], 0.0, u, p);
        phase_by_hand(W, mus[k], e * p[0], u, p);
        rates_of(angle, p, by);
        const kt_contact_counts poisson = strike_floor(mus[k], e, true, angle, rate, after);
        kt_check_equal_int("reduced", (long long)poisson.reduced, 0);
        kt_check_near("upper", after[0], rate[0] + by[0], 1e-14);
        kt_check_near("lower", after[1], rate[1] + by[1], 1e-14);
        const double before = rods_energy(angle, rate), lost = before - rods_energy(angle, after);
        kt_check_above("lost, J", lost, 1e-3);
        kt_check_near("told", poisson.dissipated, lost, 1e-15);
        told += strike_floor(mus[k], e, false, angle, rate, newton).reduced;
        kt_check_above("never grows", before - rods_energy(angle, newton), -1e-16);
    }
    kt_check_above("told of Newton's rule", (double)told, 0.5);
}

/* Housner (1963): a block of half-diagonal R at the angle alpha rocks from one corner to the other. If friction holds,
 * the block keeps 1 - 3/2 sin^2(alpha) of its rate. It keeps its energy between impacts. */
KT_TEST(rocking_block_loses_what_housner_says) {
    const double b = 0.1, h = 0.4, m = 2.0, R = hypot(b, h), alpha = atan2(b, h), tilt = 0.5 * alpha;
    const double keep = 1.0 - 1.5 * sin(alpha) * sin(alpha);
    scene s;
    scene_make(&s, KT_JOINT_PLANAR);
    s.body[0].joint.axis = kt_vec3_make(0.0, 1.0, 0.0); /* z, x, angle */
    s.body[0].inertia.yy = m / 3.0 * R * R;
    s.body[0].inertia.xx = s.body[0].inertia.zz = m;
    (void)scene_touch(&s, kt_vec3_make(b, 0.0, -h), 0.0, 1.0, 0.0);
    (void)scene_touch(&s, kt_vec3_make(-b, 0.0, -h), 0.0, 1.0, 0.0);
    /* On the corner at +b, turned by `tilt` about y. */
    s.body[0].joint.position[0] = b * sin(tilt) + h * cos(tilt);
    s.body[0].joint.position[1] = b - b * cos(tilt) + h * sin(tilt);
    s.body[0].joint.position[2] = tilt;
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = start(model, "dop853", 0.0);
    kt_error error = {0};
    double energy = m * g * (R * cos(alpha - tilt) - h), worst = 0.0;
    kt_status status = simulation != NULL ? KT_OK : KT_ERROR_ARGUMENT;
    for (uint64_t n = 1; status == KT_OK && n <= 5; n++) {
        while (status == KT_OK && kt_simulation_contacts(simulation).impacts < n &&
               kt_simulation_time(simulation) < 20.0)
            status = kt_simulation_step(simulation, 20.0, &error);
        const double rate = kt_simulation_velocities(simulation)[2];
        energy *= keep * keep;
        worst = fmax(worst, fabs(0.5 * (4.0 / 3.0 * m * R * R) * rate * rate / energy - 1.0));
    }
    if (kt_fine("rocks", status, &error)) {
        kt_check_below("energy behind five impacts, relative", worst, 1e-9);
        kt_check_equal_int("impacts", (long long)kt_simulation_contacts(simulation).impacts, 5);
        kt_check_equal_int("slips", (long long)kt_simulation_contacts(simulation).slips, 0);
    }
    kt_simulation_free(simulation);
    kt_model_free(model);
}

/* ---- against time-stepping --------------------------------------------------------------------------------------- */

/* Bodies on three feet are thrown onto a plane. They slide, tilt, roll over and rest. The place after 0.6 s agrees with
 * time-stepping of first order. KT_THROWS bodies, in steps of KT_STEP; or 7. Two of these pivot on one foot that begins
 * to slip. In three, the slip turns before it ends. */
KT_TEST(thrown_bodies_agree_with_time_stepping) {
    kt_random random = kt_random_named("thrown");
    const char *asked = getenv("KT_THROWS"), *step = getenv("KT_STEP");
    const int count = asked != NULL ? (int)strtol(asked, NULL, 10) : 400;
    const double T = 0.6, h = step != NULL ? strtod(step, NULL) : 1e-4;
    double sum = 0.0;
    int thrown = 0;
    for (int n = 0; n < count; n++) {
        scene s;
        stepper o = {.m = 2.0,
                     .g = g,
                     .I = 0.03,
                     .count = 3,
                     .R = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                     .friction = kt_random_uniform(&random, 0.1, 0.5)};
        scene_make(&s, KT_JOINT_FREE);
        s.body[0].inertia.xx = s.body[0].inertia.yy = s.body[0].inertia.zz = o.I;
        for (int k = 0; k < 3; k++) {
            const double angle = 2.0944 * k + kt_random_uniform(&random, -0.3, 0.3);
            o.at[k][0] = 0.25 * cos(angle);
            o.at[k][1] = 0.25 * sin(angle);
            o.at[k][2] = -0.1;
            (void)scene_touch(&s, kt_vec3_make(o.at[k][0], o.at[k][1], o.at[k][2]), 0.0, o.friction, 0.0);
        }
        for (int i = 0; i < 2; i++) {
            o.v[i] = s.body[0].joint.velocity[i] = kt_random_uniform(&random, -1.0, 1.0);
            o.w[i] = s.body[0].joint.velocity[3 + i] = kt_random_uniform(&random, -1.0, 1.0);
        }
        o.w[2] = s.body[0].joint.velocity[5] = kt_random_uniform(&random, -3.0, 3.0);
        o.x[2] = s.body[0].joint.position[2] = 0.15;
        if (asked == NULL && n > 1 && n != 19 && n != 66 && n != 262 && n != 295 && n != 399)
            continue;
        kt_model *model = kt_scene_compile(&s.description);
        kt_simulation *simulation = start(model, "dopri5", 0.0);
        kt_error error = {0};
        for (int i = 0; i < (int)lround(T / h); i++)
            stepper_step(&o, h);
        if (simulation != NULL && kt_fine("runs", kt_simulation_advance(simulation, T, &error), &error)) {
            const double *q = kt_simulation_positions(simulation);
            double gap = 0.0;
            for (int i = 0; i < 3; i++)
                gap = fmax(gap, fabs(q[i] - o.x[i]));
            kt_note("%d: %.3g m apart, %llu impacts", n, gap,
                    (unsigned long long)kt_simulation_contacts(simulation).impacts);
            sum += gap;
            thrown++;
        }
        kt_simulation_free(simulation);
        kt_model_free(model);
    }
    kt_check_below("mean distance, over the step of the oracle, m/s", sum / thrown / h, 2.0);
}

/* Painleve's rod, of length 2 a, slides on its end at the angle theta. A unit of normal force with friction accelerates
 * the end by c = (1 + 3 cos(theta) (cos(theta) - mu sin(theta))) / m. For mu = 3, theta = 1, c is negative. No force
 * then holds an end that accelerates into the plane. If it accelerates away, contact and release are both possible. */
static void scene_rod(scene *s, double rate) {
    const double a = 0.5, m = 2.0, theta = 1.0;
    scene_make(s, KT_JOINT_PLANAR);
    s->body[0].joint.axis = kt_vec3_make(0.0, 1.0, 0.0); /* z, x, angle about y */
    s->body[0].inertia.yy = m / 3.0 * a * a;
    s->body[0].inertia.xx = s->body[0].inertia.zz = m;
    (void)scene_touch(s, kt_vec3_make(a, 0.0, 0.0), 0.0, 3.0, 0.0);
    s->body[0].joint.position[0] = a * sin(theta);
    s->body[0].joint.position[2] = theta;
    /* The end has x - a cos: it slides along +x, and has no speed along z. */
    s->body[0].joint.velocity[2] = rate;
    s->body[0].joint.velocity[0] = rate * a * cos(theta);
    s->body[0].joint.velocity[1] = 5.0 + rate * a * sin(theta);
}

/* An impulse without a collision stops the end and keeps the moment of momentum about it. At a rate of 6, two motions
 * exist. */
KT_TEST(painleves_rod_is_stopped_by_an_impulse) {
    const double a = 0.5, m = 2.0, theta = 1.0, inertia = m * a * a * 4.0 / 3.0;
    scene s;
    for (int k = 0; k < 2; k++) {
        scene_rod(&s, 6.0 * k);
        kt_model *model = kt_scene_compile(&s.description);
        kt_simulation *simulation = start(model, "dopri5", 0.0);
        const kt_contact_counts counts = kt_simulation_contacts(simulation);
        kt_check_true("one impulse, or two motions", counts.jammed == (k == 0) && counts.undecided == (k == 1));
        if (simulation != NULL && k == 0) {
            const double *v = kt_simulation_velocities(simulation), w = v[2];
            kt_check_near("its end, m/s", hypot(v[1] - w * a * sin(theta), v[0] - w * a * cos(theta)), 0.0, 1e-14);
            kt_check_near("rate, rad/s", fabs(w), 5.0 * m * a * sin(theta) / inertia, 1e-13);
            kt_check_near("lost, J", counts.dissipated, 0.5 * (m * 25.0 - inertia * w * w), 1e-12);
        }
        kt_simulation_free(simulation);
        kt_model_free(model);
    }
}

/* Derivatives of a model in which a contact slips would leave its friction out: they are rejected. */
KT_TEST(derivatives_of_slip_are_rejected) {
    scene s;
    scene_ball(&s, 0.3, 0.0);
    s.body[0].joint.velocity[0] = 1.0;
    kt_model *compiled = kt_scene_compile(&s.description);
    kt_simulation *simulation = start(compiled, "dopri5", 0.0);
    kt_error error = {0};
    kt_data *data = NULL;
    double a[36], v[36];
    if (simulation != NULL) {
        const kt_model *model = kt_simulation_model(simulation);
        const size_t size = kt_acceleration_work_size(model);
        void *work = aligned_alloc(64, (size + 63) / 64 * 64);
        if (work != NULL && kt_fine("data", kt_data_create(model, &data, &error), &error))
            kt_check_true("rejected",
                          kt_acceleration_derivatives(model, data, work, size, 0.0, kt_simulation_positions(simulation),
                                                      kt_simulation_velocities(simulation), NULL, NULL, a, v, NULL,
                                                      &error) == KT_ERROR_UNSUPPORTED);
        kt_check_contains("words", error.message, "'p0' is a hard contact that slips");
        free(work);
    }
    kt_run run = kt_run_default();
    run.integrator = "rodas5p";
    kt_simulation *exact = NULL;
    kt_check_true("methods", compiled == NULL || kt_simulation_create(compiled, &run, NULL, &exact, &error) != KT_OK);
    kt_check_contains("words", error.message, "the order of rodas5p depends on exact derivatives");
    kt_data_free(data);
    kt_simulation_free(simulation);
    kt_model_free(compiled);
}

/* ---- the run as a whole ------------------------------------------------------------------------------------------ */

KT_TEST(checkpoint_of_slip_goes_on_with_the_same_bits) {
    static const char *const methods[] = {"dopri5", "radau5"};
    scene s;
    scene_box(&s, 3, 0.3, 0.1);
    s.body[0].joint.velocity[0] = 1.0;
    s.body[0].joint.velocity[1] = 0.5;
    s.body[0].joint.velocity[5] = 3.0;
    kt_model *model = kt_scene_compile(&s.description);
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        kt_simulation *one = start(model, methods[m], 0.0), *two = start(model, methods[m], 0.0);
        void *block = one != NULL ? malloc(kt_simulation_state_size(one)) : NULL;
        kt_error error = {0};
        const double energy = one != NULL ? kt_scene_balance(one) : 0.0;
        if (two != NULL && block != NULL && kt_fine("half", kt_simulation_advance(one, 0.2, &error), &error)) {
            kt_simulation_save(one, block);
            kt_interpose_start();
            const kt_status status = kt_simulation_advance(one, 2.0, &error);
            kt_check_equal_int("allocations", kt_interpose_stop(), 0);
            (void)kt_fine("second half", status, &error);
            (void)kt_fine("restores", kt_simulation_restore(two, block, &error), &error);
            (void)kt_fine("second half again", kt_simulation_advance(two, 2.0, &error), &error);
            kt_check_equal_bits("positions", kt_simulation_positions(two), kt_simulation_positions(one), 7);
            kt_check_equal_bits("velocities", kt_simulation_velocities(two), kt_simulation_velocities(one), 6);
            kt_check_near("balance, J", kt_scene_balance(one), energy, 1e-10);
            kt_check_equal_int("sticks: all feet at once", (long long)kt_simulation_contacts(one).sticks, 3);
            kt_check_equal_int("and rests", (long long)kt_simulation_contacts(one).slips, 0);
        }
        free(block);
        kt_simulation_free(one);
        kt_simulation_free(two);
    }
    kt_model_free(model);
}
