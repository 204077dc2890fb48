/* Hard contacts with Coulomb's friction against closed forms: rolling, resting, sliding, impacts, undecided motions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "interpose.h"
#include "motion/simulation/stepper.h"
#include "touch.h"

/* ---- rolling ----------------------------------------------------------------------------------------------------- */

/* A ball that slides at v0 rolls at 5/7 v0 from t = 2 v0 / (7 mu g) on. It loses the energy m v0^2 / 7. */
KT_TEST(sliding_ball_rolls_at_five_sevenths) {
    static const char *const methods[] = {"dopri5", "dop853", "rk4", "radau5", "bdf2", "rkc2", NULL};
    const double mu = 0.3, v0 = 1.5, time = 2.0 * v0 / (7.0 * mu * g);
    touch_scene s;
    touch_scene_ball(&s, mu, 0.0);
    s.body[0].joint.velocity[0] = 0.8 * v0;
    s.body[0].joint.velocity[1] = 0.6 * v0;
    kt_model *model = kt_scene_compile(&s.description);
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        const bool fixed = methods[m] != NULL && (strcmp(methods[m], "rk4") == 0 || strcmp(methods[m], "bdf2") == 0);
        kt_simulation *simulation = touch_start(model, methods[m], fixed ? 0.01 : 0.0);
        kt_error error = {0};
        const double energy = kt_scene_balance(simulation);
        kt_need_fine(methods[m] ? methods[m] : "default", touch_until_stuck(simulation, 1, 1.0, &error), &error);
        const double *v = kt_simulation_velocities(simulation), *q = kt_simulation_positions(simulation);
        kt_check_near("rolls from, s", kt_simulation_time(simulation), time, 1e-12);
        kt_check_near("at, m", hypot(q[0], q[1]), 6.0 / 7.0 * v0 * time, 1e-12);
        kt_test_advance(simulation, 2.0);
        kt_check_near("speed", hypot(v[0], v[1]), 5.0 / 7.0 * v0, 2e-14);
        kt_check_near("spin", hypot(v[3], v[4]), 5.0 / 7.0 * v0 / 0.1, 2e-13);
        kt_check_near("height", q[2], 0.1, 1e-16);
        kt_check_near("balance, J", kt_scene_balance(simulation), energy, 2e-13);
        kt_check_equal_int("sticks", (long long)kt_simulation_contacts(simulation).sticks, 1);
    }
}

/* A disc inclined by alpha slides across its slope. All follows by hand from N (1 / m + r^2 cos^2(alpha) / A) = g. */
KT_TEST(inclined_disc_slides_with_its_force_at_the_rim) {
    const double alpha = 0.7, r = 0.1, m = 2.0, mu = 0.2, A = 0.25 * m * r * r, c = cos(alpha);
    const double N = m * g / (1.0 + 4.0 * c * c);
    const double expected[] = {-mu * N / m, 0.0, N / m - g, -c * r * N / A, 0.0, -0.5 * mu * r * N / A};
    kt_record record = {0};
    kt_error error = {0};
    touch_scene s;
    touch_scene_make(&s, KT_JOINT_FREE);
    s.body[0].joint.position[2] = r * sin(alpha);
    s.body[0].joint.position[3] = cos(0.5 * alpha);
    s.body[0].joint.position[4] = sin(0.5 * alpha);
    s.body[0].joint.velocity[0] = 1.5;
    s.body[0].inertia.xx = s.body[0].inertia.yy = A;
    s.body[0].inertia.zz = 2.0 * A;
    touch_scene_add(&s, kt_vec3_make(0.0, 0.0, 0.0), r, mu, 0.0)->axle = kt_vec3_make(0.0, 0.0, 1.0);
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
    kt_need_fine("sense", kt_simulation_sense(simulation, &record, &error), &error);
    for (int k = 0; k < 6; k++)
        kt_check_near("acceleration", record.a[k], expected[k], 2e-14 * g / r);
}

/* A ball that is released on an incline rolls at 5/7 g sin(a) if tan(a) < 7/2 mu. On a steeper incline it slides. */
KT_TEST(ball_on_an_incline_rolls_or_slides) {
    for (int i = 0; i < 2; i++) {
        const double mu = 0.2, angle = atan(3.5 * mu * (i == 0 ? 0.99 : 1.01));
        const double a = i == 0 ? 5.0 / 7.0 * g * sin(angle) : g * (sin(angle) - mu * cos(angle));
        touch_scene s;
        touch_scene_ball(&s, mu, 0.0);
        s.description.gravity = kt_vec3_make(g * sin(angle), 0.0, -g * cos(angle));
        kt_model *model = kt_scene_compile(&s.description);
        kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
        kt_test_advance(simulation, 1.0);
        kt_check_near("position", kt_simulation_positions(simulation)[0], 0.5 * a, 2e-14);
        kt_check_equal_int("sticks", (long long)kt_simulation_contacts(simulation).sticks, i == 0);
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
            touch_scene s;
            touch_scene_box(&s, feet, mu, angle);
            kt_model *model = kt_scene_compile(&s.description);
            kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
            kt_test_advance(simulation, end);
            const double *q = kt_simulation_positions(simulation);
            if (i == 0)
                kt_check_equal_bits("creep", q, given, 7);
            else
                kt_check_near("slides", q[0], 0.5 * a, 1e-15);
            /* At rest all feet share the load. Feet that slip have independent normal forces. */
            kt_check_equal_int("closings", (long long)kt_simulation_contacts(simulation).closings, i == 0 ? feet : 3);
            kt_check_equal_int("undecided", (long long)kt_simulation_contacts(simulation).undecided, 0);
        }
}

/* A block between a wall and a jaw with force F. If 2 mu F is 95 times its weight, it does not creep in 100 s. At 0.99
 * of the weight, it slides down at g - 2 mu F / m. */
KT_TEST(pinched_block_does_not_creep) {
    for (int i = 0; i < 2; i++) {
        const double mu = 0.5, m = 2.0, margin = i == 0 ? 95.0 : 0.99, F = margin * m * g / (2.0 * mu);
        touch_scene s;
        touch_scene_make(&s, KT_JOINT_FREE);
        s.body[0].inertia.xx = s.body[0].inertia.yy = s.body[0].inertia.zz = 0.01;
        s.body[1].name = "jaw";
        s.body[1].mass = 1.0;
        s.body[1].joint.type = KT_JOINT_PRISMATIC;
        s.body[1].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
        s.description.body_count = 2;
        kt_effect *wall = touch_scene_add(&s, kt_vec3_make(-0.1, 0.1, 0.0), 0.0, mu, 0.0);
        kt_effect *other = touch_scene_add(&s, kt_vec3_make(-0.1, -0.1, 0.0), 0.0, mu, 0.0);
        kt_effect *jaw = touch_scene_add(&s, kt_vec3_make(0.1, 0.0, 0.0), 0.0, mu, 0.0);
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
        kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
        const double given[8] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0};
        kt_test_advance(simulation, i == 0 ? 100.0 : 1.0);
        if (i == 0)
            kt_check_equal_bits("creep", kt_simulation_positions(simulation), given, 8);
        else
            kt_check_near("slides", kt_simulation_positions(simulation)[2], -0.5 * (g - 2.0 * mu * F / m), 1e-14);
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
    touch_scene r;
    touch_scene_make(&r, KT_JOINT_PRISMATIC);
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
    kt_simulation *simulation = touch_start(model, "dop853", 0.0);
    kt_error error = {0};
    kt_status status = KT_OK;
    while (status == KT_OK && kt_simulation_contacts(simulation).sticks == 0 && kt_simulation_time(simulation) < 5.0)
        status = kt_simulation_step(simulation, 5.0, &error);
    kt_need_fine("grips", status, &error);
    kt_check_near("grips from, s", kt_simulation_time(simulation), time, 2e-11); /* the tolerance is 1e-11 */
    kt_test_advance(simulation, 5.0);
    kt_check_near("speed", kt_simulation_velocities(simulation)[0], 2.0, 1e-12);
    kt_check_near("slip", kt_simulation_velocities(simulation)[1], 0.0, 0.0);
    kt_check_near("balance, J", kt_scene_balance(simulation), 5.0, 1e-11);
}

/* A point of m = 2 kg slides at v0 on a plank of M = 3 kg: both reach m v0 / (m + M) at v0 / (mu g (1 + m / M)). */
KT_TEST(plank_is_dragged_along) {
    const double mu = 0.2, m = 2.0, M = 3.0, v0 = 1.0, time = v0 / (mu * g * (1.0 + m / M));
    touch_scene s;
    touch_scene_make(&s, KT_JOINT_FREE);
    s.body[0].inertia.xx = s.body[0].inertia.yy = s.body[0].inertia.zz = 0.1;
    s.body[0].joint.velocity[0] = v0;
    s.body[1].name = "plank";
    s.body[1].mass = M;
    s.body[1].joint.type = KT_JOINT_PRISMATIC;
    s.body[1].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    s.description.body_count = 2;
    touch_scene_add(&s, kt_vec3_make(0.0, 0.0, 0.0), 0.0, mu, 0.0)->between[1].body = "plank";
    kt_model *model = kt_scene_compile(&s.description);
    kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
    kt_error error = {0};
    kt_need_fine("slides", touch_until_stuck(simulation, 1, 2.0, &error), &error);
    const double *v = kt_simulation_velocities(simulation);
    const int plank = kt_body_coordinates(model, kt_body_find(model, "plank")).v;
    const int body = kt_body_coordinates(model, kt_body_find(model, "body")).v;
    kt_check_near("time, s", kt_simulation_time(simulation), time, 1e-12);
    kt_check_near("plank", v[plank], m * v0 / (m + M), 1e-14);
    kt_check_near("body", v[body], m * v0 / (m + M), 1e-14);
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
        touch_scene s;
        stepper o = {.m = 2.0,
                     .g = g,
                     .I = 0.03,
                     .count = 3,
                     .R = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                     .friction = kt_random_uniform(&random, 0.1, 0.5)};
        touch_scene_make(&s, KT_JOINT_FREE);
        s.body[0].inertia.xx = s.body[0].inertia.yy = s.body[0].inertia.zz = o.I;
        for (int k = 0; k < 3; k++) {
            const double angle = 2.0944 * k + kt_random_uniform(&random, -0.3, 0.3);
            o.at[k][0] = 0.25 * cos(angle);
            o.at[k][1] = 0.25 * sin(angle);
            o.at[k][2] = -0.1;
            (void)touch_scene_add(&s, kt_vec3_make(o.at[k][0], o.at[k][1], o.at[k][2]), 0.0, o.friction, 0.0);
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
        kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
        for (int i = 0; i < (int)lround(T / h); i++)
            stepper_step(&o, h);
        kt_test_advance(simulation, T);
        const double *q = kt_simulation_positions(simulation);
        double gap = 0.0;
        for (int i = 0; i < 3; i++)
            gap = fmax(gap, fabs(q[i] - o.x[i]));
        kt_note("%d: %.3g m apart, %llu impacts", n, gap,
                (unsigned long long)kt_simulation_contacts(simulation).impacts);
        sum += gap;
        thrown++;
    }
    kt_check_below("mean distance, over the step of the oracle, m/s", sum / thrown / h, 2.0);
}

/* Painleve's rod, of length 2 a, slides on its end at the angle theta. A unit of normal force with friction accelerates
 * the end by c = (1 + 3 cos(theta) (cos(theta) - mu sin(theta))) / m. For mu = 3, theta = 1, c is negative. No force
 * then holds an end that accelerates into the plane. If it accelerates away, contact and release are both possible. */
static void scene_rod(touch_scene *s, double rate) {
    const double a = 0.5, m = 2.0, theta = 1.0;
    touch_scene_make(s, KT_JOINT_PLANAR);
    s->body[0].joint.axis = kt_vec3_make(0.0, 1.0, 0.0); /* z, x, angle about y */
    s->body[0].inertia.yy = m / 3.0 * a * a;
    s->body[0].inertia.xx = s->body[0].inertia.zz = m;
    (void)touch_scene_add(s, kt_vec3_make(a, 0.0, 0.0), 0.0, 3.0, 0.0);
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
    touch_scene s;
    for (int k = 0; k < 2; k++) {
        scene_rod(&s, 6.0 * k);
        kt_model *model = kt_scene_compile(&s.description);
        kt_simulation *simulation = touch_start(model, "dopri5", 0.0);
        const kt_contact_counts counts = kt_simulation_contacts(simulation);
        kt_check_true("one impulse, or two motions", counts.jammed == (k == 0) && counts.undecided == (k == 1));
        kt_check_equal_int("one contact shares no load", (long long)counts.redundant, 0);
        if (k == 1) {
            kt_check_near("first, s", counts.undecided_time, 0.0, 0.0);
            kt_check_text("at", kt_loop_name(kt_simulation_model(simulation), counts.undecided_loop), "p0");
        }
        if (k == 0) {
            const double *v = kt_simulation_velocities(simulation), w = v[2];
            kt_check_near("its end, m/s", hypot(v[1] - w * a * sin(theta), v[0] - w * a * cos(theta)), 0.0, 1e-14);
            kt_check_near("rate, rad/s", fabs(w), 5.0 * m * a * sin(theta) / inertia, 1e-13);
            kt_check_near("lost, J", counts.dissipated, 0.5 * (m * 25.0 - inertia * w * w), 1e-12);
        }
    }
}

/* Derivatives of a model in which a contact slips would leave its friction out: they are rejected. */
KT_TEST(derivatives_of_slip_are_rejected) {
    touch_scene s;
    touch_scene_ball(&s, 0.3, 0.0);
    s.body[0].joint.velocity[0] = 1.0;
    kt_model *compiled = kt_scene_compile(&s.description);
    kt_simulation *simulation = touch_start(compiled, "dopri5", 0.0);
    kt_error error = {0};
    double a[36], v[36];
    const kt_model *model = kt_simulation_model(simulation);
    kt_data *data = kt_test_data(model);
    const size_t size = kt_acceleration_work_size(model);
    void *work = aligned_alloc(64, (size + 63) / 64 * 64);
    kt_check_equal_int("rejected",
                       kt_acceleration_derivatives(model, data, work, size, 0.0, kt_simulation_positions(simulation),
                                                   kt_simulation_velocities(simulation), NULL, NULL, a, v, NULL,
                                                   &error),
                       KT_ERROR_UNSUPPORTED);
    kt_check_contains("words", error.message, "'p0' is a hard contact that slips");
    free(work);
    kt_run run = kt_run_default();
    run.integrator = "rodas5p";
    kt_simulation *exact = NULL;
    kt_check_true("methods", kt_simulation_create(compiled, &run, NULL, &exact, &error) != KT_OK);
    kt_check_contains("words", error.message, "the order of rodas5p depends on exact derivatives");
}

/* Where slip begins, only the simulation has the direction of friction: other data would leave it out. */
KT_TEST(slip_that_begins_has_its_direction_in_a_simulation_only) {
    touch_scene s;
    const double angle = 0.5, friction = 0.1;
    touch_scene_ball(&s, friction, 0.0);
    s.description.gravity = kt_vec3_make(g * sin(angle), 0.0, -g * cos(angle));
    kt_model *compiled = kt_scene_compile(&s.description);
    kt_simulation *simulation = touch_start(compiled, "dopri5", 0.0);
    kt_error error = {0};
    double a[6] = {7.0}, v[6];
    const kt_model *model = kt_simulation_model(simulation);
    kt_data *data = kt_test_data(model);
    const double *q = kt_simulation_positions(simulation);
    memcpy(v, kt_simulation_velocities(simulation), sizeof v);
    kt_check_true("rejected",
                  kt_acceleration_evaluate(model, data, 0.0, q, v, NULL, NULL, a, &error) == KT_ERROR_UNSUPPORTED);
    kt_check_contains("words", error.message, "it begins to slip");
    kt_check_near("untouched", a[0], 7.0, 0.0);
    kt_fine("simulation", kt_simulation_acceleration(simulation, a, &error), &error);
    kt_check_near("closed form, m/s^2", a[0], g * (sin(angle) - friction * cos(angle)), 1e-14);
    v[0] = 1e-8;
    kt_fine("it slips", kt_acceleration_evaluate(model, data, 0.0, q, v, NULL, NULL, a, &error), &error);
    kt_check_near("closed form, m/s^2", a[0], g * (sin(angle) - friction * cos(angle)), 1e-14);
}

/* ---- the run as a whole ------------------------------------------------------------------------------------------ */

KT_TEST(checkpoint_of_slip_goes_on_with_the_same_bits) {
    static const char *const methods[] = {"dopri5", "radau5"};
    touch_scene s;
    touch_scene_box(&s, 3, 0.3, 0.1);
    s.body[0].joint.velocity[0] = 1.0;
    s.body[0].joint.velocity[1] = 0.5;
    s.body[0].joint.velocity[5] = 3.0;
    kt_model *model = kt_scene_compile(&s.description);
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        kt_simulation *one = touch_start(model, methods[m], 0.0), *two = touch_start(model, methods[m], 0.0);
        kt_error error = {0};
        const double energy = kt_scene_balance(one);
        kt_test_advance(one, 0.2);
        kt_need(kt_scene_hand_over(one, two));
        kt_interpose_start();
        const kt_status status = kt_simulation_advance(one, 2.0, &error);
        kt_check_equal_int("allocations", kt_interpose_stop(), 0);
        (void)kt_fine("second half", status, &error);
        kt_test_advance(two, 2.0);
        kt_scene_check_equal("state", two, one);
        kt_check_near("balance, J", kt_scene_balance(one), energy, 1e-10);
        kt_check_equal_int("sticks: all feet at once", (long long)kt_simulation_contacts(one).sticks, 3);
        kt_check_equal_int("and rests", (long long)kt_simulation_contacts(one).slips, 0);
    }
}
