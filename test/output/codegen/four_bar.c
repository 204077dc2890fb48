/* Generated C of a four-bar: many steps, singular positions, and rejections of loops. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "generated.h"
#include "text.h"

#include "kinetree/mechanism.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON

/* ---- a four-bar -------------------------------------------------------------------------------------------------- */

/* Crank, coupler and rocker in the plane of x and y; the coupler's end is pinned to the rocker's. Not to be copied. */
typedef struct four_bar {
    kt_description description;
    kt_body body[3];
    kt_marker marker[3];
    kt_loop loop;
    kt_model *model;
    kt_data *data;
} four_bar;

static void four_bar_compile(four_bar *f) {
    f->model = kt_test_model(&f->description, NULL);
    f->data = kt_test_data(f->model);
}

/* base: distance and direction of the rocker's joint. */
static void four_bar_describe(four_bar *f, const double length[3], double base, double direction) {
    static const char *const name[3] = {"crank", "coupler", "rocker"};
    memset(f, 0, sizeof *f);
    f->description = kt_description_default();
    f->description.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    kt_describe(&f->description, f->body, 3, NULL, 0, NULL, 0);
    for (int i = 0; i < 3; i++) {
        kt_body *b = &f->body[i];
        *b = kt_body_of(name[i], NULL, KT_JOINT_REVOLUTE, length[i]);
        b->com = kt_vec3_make(0.5 * length[i], 0.0, 0.0);
        b->inertia = kt_sym3_make(0.0, length[i] * length[i] * length[i] / 12.0,
                                  length[i] * length[i] * length[i] / 12.0, 0.0, 0.0, 0.0);
        f->marker[i] = (kt_marker){.name = "tip", .at = {length[i], 0.0, 0.0}};
        b->markers = &f->marker[i];
        b->marker_count = 1;
    }
    f->body[1].parent = name[0];
    f->body[1].joint.at = kt_vec3_make(length[0], 0.0, 0.0);
    f->body[2].joint.at = kt_vec3_make(base * cos(direction), base * sin(direction), 0.0);
    f->loop = kt_loop_of("pin", KT_LOOP_REVOLUTE);
    f->loop.between[0] = (kt_end){.body = name[1], .at = {length[1], 0.0, 0.0}};
    f->loop.between[1] = (kt_end){.body = name[2], .at = {length[2], 0.0, 0.0}};
    f->description.loops = &f->loop;
    f->description.loop_count = 1;
}

static double four_bar_energy(const four_bar *f, const double *q, const double *v) {
    kt_error error = {0};
    kt_need_fine("kinematics", kt_kinematics_update(f->model, f->data, q, v, NULL, &error), &error);
    return kt_kinetic_energy(f->model, f->data) + kt_potential_energy(f->model, f->data);
}

/* 20,000 steps; the crank turns all the way round. rk4 without a projection would open the loop by 1e-8. */
KT_TEST(a_loop_stays_closed_over_many_steps) {
    static kt_generated g;
    four_bar f;
    double q[3] = {1.0, -0.5, 1.7}, v[3] = {8.0, 0.0, 0.0}, phi[2], a[6], right[2], most = 0.0, slip = 0.0;
    const double none[3] = {0.0};
    kt_error error = {0};
    kt_generated_need_compiler();
    four_bar_describe(&f, (const double[]){0.3, 0.9, 0.7}, 1.0, 0.0);
    four_bar_compile(&f);
    kt_generated_make_some(&g, f.model, KT_GENERATED_WITH_LOOPS, "cc -O2", false);
    kt_need_fine("assembles", kt_state_assemble(f.model, f.data, 0.0, q, v, &error), &error);
    const double before = four_bar_energy(&f, q, v), start = q[0];
    for (int i = 0; i < 20000; i++) {
        int code = g.rk4(g.model, q, v, none, 1e-3, q, v);
        if (code == 0)
            code = g.loops(g.model, q, v, phi, a, right);
        for (int r = 0; r < 2; r++) {
            most = fmax(most, fabs(phi[r]));
            slip = fmax(slip, fabs(a[r] * v[0] + a[2 + r] * v[1] + a[4 + r] * v[2]));
        }
        kt_need(code == 0 || kt_check_equal_int("a step", code, 0));
    }
    kt_check_near("gap, m", most, 0.0, 2.0 * EPS * fabs(q[0])); /* the rounding of angles */
    kt_check_near("A v, m/s", slip, 0.0, 1e-13);
    kt_check_above("turns of the crank", (q[0] - start) / 6.283185307179586, 10.0);
    kt_check_near("energy, J", four_bar_energy(&f, q, v), before, 1e-6 * fabs(before));
}

/* A crank whose angle is a function of time. */
KT_TEST(a_driven_crank_follows_its_function) {
    static kt_generated g;
    four_bar f;
    const double speed = 6.283185307179586, h = 1e-3, none[3] = {0.0};
    double q[3] = {1.0, -0.5, 1.7}, v[3] = {0.0}, a[3], phi[3], matrix[9], right[3], worst[4] = {0.0};
    kt_generated_need_compiler();
    four_bar_describe(&f, (const double[]){0.3, 0.9, 0.7}, 1.0, 0.0);
    kt_loop both[2] = {f.loop, kt_loop_default()};
    both[1].name = "drive";
    both[1].type = KT_LOOP_MOTION;
    both[1].joint = "crank";
    both[1].function = kt_function_sine(0.3, 1.0, 0.0, 1.0);
    f.description.loops = both;
    f.description.loop_count = 2;
    four_bar_compile(&f);
    kt_generated_make_some(&g, f.model, KT_GENERATED_WITH_LOOPS, "cc -O2", false);
    kt_need(kt_check_true("loops depend on time", g.loops_have_time));
    kt_need(kt_check_equal_int("project", g.project_at(g.model, 0.0, q, v, q, v), 0));
    for (int i = 1; i <= 2000; i++) {
        const double t = h * i, size = 0.3 * sin(speed * t);
        kt_need(kt_check_equal_int("a step", g.rk4_at(g.model, h * (i - 1), q, v, none, h, q, v), 0));
        kt_need(kt_check_equal_int("forward", g.forward_at(g.model, t, q, v, none, a), 0));
        kt_need(kt_check_equal_int("loops", g.loops_at(g.model, t, q, v, phi, matrix, right), 0));
        worst[0] = fmax(worst[0], fabs(q[0] - 1.0 - size));
        worst[1] = fmax(worst[1], fabs(v[0] - 0.3 * speed * cos(speed * t)));
        worst[2] = fmax(worst[2], fabs(a[0] + speed * speed * size));
        for (int r = 0; r < 3; r++)
            worst[3] = fmax(worst[3], fabs(phi[r]));
    }
    /* A projection ends at 2e-15 of the scales, a radian and 2.9 m of bars. The time has rounding errors. */
    kt_check_near("angle, rad", worst[0], 0.0, 2e-15 + 0.3 * speed * 2.0 * 2.0 * EPS);
    kt_check_near("speed, rad/s", worst[1], 0.0, 1e-14);
    kt_check_near("acceleration, rad/s^2", worst[2], 0.0, 1e-12);
    kt_check_near("gap, m", worst[3], 0.0, 2e-15 * 2.9);
}

/* A parallelogram whose bars lie on one line has two ways to go on. Along x and along y, one row of A is zero there.
 * Along other lines both rows are parallel. */
KT_TEST(a_singular_position_returns_the_loop) {
    static const double direction[3] = {0.0, 0.7, 1.5707963267948966};
    static kt_generated g;
    kt_generated_need_compiler();
    for (int k = 0; k < 3; k++) {
        four_bar f;
        const double zero[3] = {0.0}, r = direction[k];
        four_bar_describe(&f, (const double[]){0.4, 1.0, 0.4}, 1.0, r);
        four_bar_compile(&f);
        kt_generated_make_some(&g, f.model, KT_GENERATED_WITH_LOOPS, "cc -O1", false);
        double q[3] = {r + 0.5, -0.5, r + 0.5}, v[3] = {1.0, -1.0, 1.0}, a[3] = {7.0}, u[3] = {7.0};
        kt_check_equal_int("regular", g.forward(g.model, q, v, zero, a), 0);
        for (int side = 0; side < 2; side++) {
            q[0] = q[2] = r + 3.141592653589793 * side;
            q[1] = -3.141592653589793 * side;
            a[0] = u[0] = 7.0;
            kt_check_equal_int("flat", g.forward(g.model, q, v, zero, a), -1);
            kt_check_equal_int("a step", g.rk4(g.model, q, v, zero, 1e-3, a, u), -1);
            kt_check_equal_int("semi-implicit", g.semi_implicit(g.model, q, v, zero, 1e-3, a, u), -1);
            kt_check_equal_int("a projection", g.project(g.model, q, v, a, u), -1);
            kt_check_near("nothing is written", a[0] + u[0], 14.0, 0.0);
        }
        double parameter[KT_GENERATED_PARAMETERS];
        memcpy(parameter, g.standard, (size_t)g.count * sizeof *parameter);
        for (int i = 0; i < g.count; i++)
            parameter[i] *= strcmp(g.name[i], "rocker_marker_tip_x") == 0 ? 9.0 : 1.0;
        q[0] = q[2] = r + 0.5;
        q[1] = -0.5;
        g.prepare(parameter, g.model);
        kt_check_equal_int("a loop that cannot close", g.project(g.model, q, v, a, u), -1);
        g.prepare(g.standard, g.model);
        kt_check_equal_int("it closes", g.project(g.model, q, v, q, v), 0);
        q[0] = (double)NAN;
        kt_check_true("not finite", g.forward(g.model, q, v, zero, a) != 0);
        kt_check_true("not finite", g.project(g.model, q, v, a, u) != 0);
        kt_check_near("nothing is written", a[0] + u[0], 14.0, 0.0);
    }
}

/* ---- rejections -------------------------------------------------------------------------------------------------- */

static void check_loop_rejected(four_bar *f, unsigned functions, const char *where, const char *message) {
    kt_generated_text text;
    kt_error error = {0};
    four_bar_compile(f);
    kt_check_true("it has a structure", kt_codegen_structure(f->model) != 0);
    kt_check_equal_int(message, kt_generate_text(f->model, "bar", functions, false, &text, &error), KT_ERROR_MODEL);
    kt_check_text("where", error.where, where);
    kt_check_contains("why", error.message, message);
    kt_check_text("nothing is written", text.source, "");
    kt_check_text("nothing is written", text.header, "");
}

KT_TEST(loops_that_cannot_be_generated_are_named_with_a_reason) {
    const double length[3] = {0.3, 0.9, 0.7};
    four_bar f;
    four_bar_describe(&f, length, 1.0, 0.0);
    f.loop.switching = KT_SWITCHED_OFF;
    check_loop_rejected(&f, KT_CODEGEN_FORWARD, "pin", "switched on and off");

    four_bar_describe(&f, length, 1.0, 0.0);
    f.loop.type = KT_LOOP_CURVE;
    f.loop.curve = (kt_track){.type = KT_TRACK_HELIX, .radius = 0.5, .pitch = 0.1};
    check_loop_rejected(&f, KT_CODEGEN_FORWARD, "pin", "nearest point of a helix or a spline");

    four_bar_describe(&f, length, 1.0, 0.0);
    f.loop.type = KT_LOOP_DISTANCE;
    f.loop.slack = true;
    f.loop.function = kt_function_constant(5.0);
    check_loop_rejected(&f, KT_CODEGEN_FORWARD, "pin", "on one side only");

    four_bar_describe(&f, length, 1.0, 0.0);
    f.loop.type = KT_LOOP_DISTANCE;
    double rows[2 * 101];
    for (int i = 0; i < 101; i++) {
        rows[2 * i] = 0.01 * i;
        rows[2 * i + 1] = 0.5 + 0.001 * i;
    }
    f.loop.function = kt_function_table(rows, 2 * 101, KT_INTERPOLATION_LINEAR);
    check_loop_rejected(&f, KT_CODEGEN_FORWARD, "pin", "has more than 100 rows");

    four_bar_describe(&f, length, 1.0, 0.0);
    f.description.loop_count = 0;
    check_loop_rejected(&f, KT_CODEGEN_PROJECT, "loops", "no loop has an equation");
}

/* Of two equal pins one is left out, as in the library. */
KT_TEST(equations_that_repeat_others_are_left_out) {
    static kt_generated g;
    four_bar f;
    double q[3] = {1.0, -0.5, 1.7}, v[3] = {8.0, 0.0, 0.0}, a[3], own[3];
    const double tau[3] = {1.0, 2.0, 3.0};
    kt_error error = {0};
    kt_generated_need_compiler();
    four_bar_describe(&f, (const double[]){0.3, 0.9, 0.7}, 1.0, 0.0);
    kt_loop twice[2] = {f.loop, f.loop};
    twice[1].name = "again";
    f.description.loops = twice;
    f.description.loop_count = 2;
    four_bar_compile(&f);
    kt_generated_make_some(&g, f.model, KT_GENERATED_WITH_LOOPS, "cc -O1", false);
    kt_need_fine("assembles", kt_state_assemble(f.model, f.data, 0.0, q, v, &error), &error);
    kt_need_fine("library", kt_acceleration_evaluate(f.model, f.data, 0.0, q, v, tau, NULL, a, &error), &error);
    kt_check_equal_int("forward", g.forward(g.model, q, v, tau, own), 0);
    for (int i = 0; i < 3; i++)
        kt_check_near("acceleration", own[i], a[i], 1e-12 * (1.0 + fabs(a[i])));
}
