/* Loops that repeat each other, with rounded data. They close and move like loops with exact data. Contradictions
 * beyond rounding are rejected. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "describe.h"
#include "interpose.h"
#include "random.h"

#include "kinetree/kinetree.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"

#include <math.h>
#include <string.h>

enum { BODIES = 6, LOOPS = 3 };

typedef struct machine {
    kt_body body[BODIES];
    kt_loop loop[LOOPS];
    const char *hold[2];
    kt_description description;
    kt_model *model;
    kt_simulation *simulation;
} machine;

static void begin(machine *m, int bodies, int loops) {
    static const char *const names[] = {"a", "b", "c", "d", "e", "f"}, *const closures[] = {"p", "q", "r"};
    memset(m, 0, sizeof *m);
    for (int i = 0; i < bodies; i++) {
        m->body[i] = kt_body_of(names[i], NULL, KT_JOINT_REVOLUTE, 1.0 + 0.3 * i);
        m->body[i].inertia = kt_sym3_make(0.1, 0.12, 0.15, 0.0, 0.0, 0.0);
        m->body[i].com = kt_vec3_make(0.4, 0.03, 0.0);
    }
    for (int i = 0; i < loops; i++) {
        m->loop[i] = kt_loop_of(closures[i], KT_LOOP_REVOLUTE);
    }
    m->description = kt_description_default();
    m->description.gravity = kt_vec3_make(0.5, -9.81, 0.3);
    kt_describe(&m->description, m->body, bodies, m->loop, loops, NULL, 0);
    m->hold[0] = "a";
    m->description.hold = m->hold;
    m->description.hold_count = 1;
}

static void finish(machine *m) {
    kt_simulation_free(m->simulation);
    kt_model_free(m->model);
    m->simulation = NULL;
    m->model = NULL;
}

static kt_status start(machine *m, kt_error *error) {
    kt_run run = kt_run_default();
    run.relative = run.absolute = 1e-10;
    kt_status status = kt_model_compile(&m->description, NULL, &m->model, error);
    if (status == KT_OK)
        status = kt_simulation_create(m->model, &run, NULL, &m->simulation, error);
    return status;
}

/* To a multiple of `unit`; 0: as it is. */
static double rounded(double x, double unit) { return unit > 0.0 ? unit * nearbyint(x / unit) : x; }

/* ---- the machines ------------------------------------------------------------------------------------------------ */

/* Bars on a row of pins, all parallel, on one coupler; of lengths that are rounded to `unit`. */
static void make_parallelogram(machine *m, kt_random *random, double unit) {
    const double length = kt_random_uniform(random, 0.5, 2.0), angle = kt_random_uniform(random, 0.6, 1.2);
    const double at[] = {kt_random_uniform(random, 0.7, 1.0), kt_random_uniform(random, 1.5, 2.5)};
    begin(m, 4, 2);
    for (int i = 0; i < 3; i++)
        m->body[i].joint.position[0] = angle;
    m->body[1].joint.at.x = rounded(at[0], unit);
    m->body[2].joint.at.x = rounded(at[1], unit);
    m->body[3].parent = "a";
    m->body[3].joint.at.x = rounded(length, unit);
    m->body[3].joint.position[0] = -angle;
    for (int i = 0; i < 2; i++) {
        m->loop[i].between[0].body = "d";
        m->loop[i].between[0].at.x = at[i];
        m->loop[i].between[1].body = m->body[i + 1].name;
        m->loop[i].between[1].at.x = length;
    }
    m->description.gravity.z = 0.0;
}

/* A four-bar whose closing pin is turned out of its plane by `unit`. */
static void make_tilted(machine *m, kt_random *random, double unit) {
    begin(m, 3, 1);
    m->body[0].joint.position[0] = kt_random_uniform(random, 0.8, 1.2);
    m->body[1].parent = "a";
    m->body[1].joint.at.x = 1.0;
    m->body[2].joint.at.x = kt_random_uniform(random, 1.8, 2.1);
    m->loop[0].between[0].body = "b";
    m->loop[0].between[0].at.x = 2.5;
    m->loop[0].between[1].body = "c";
    m->loop[0].between[1].at.x = 2.0;
    if (unit > 0.0)
        m->loop[0].between[1].rotation = kt_rotation_axis_angle(kt_vec3_make(0.6, 0.8, 0.0), unit);
}

/* A door on two or three hinges of an oblique axis. */
static void make_door(machine *m, kt_random *random, double unit) {
    const kt_vec3 axis = kt_vec3_make(kt_random_uniform(random, -0.5, 0.5), kt_random_uniform(random, -0.5, 0.5), 1.0);
    begin(m, 1, kt_random_int(random, 1, 2));
    m->body[0].joint.axis = axis;
    m->body[0].joint.position[0] = kt_random_uniform(random, -1.0, 1.0);
    for (int i = 0; i < m->description.loop_count; i++) {
        const double s = kt_random_uniform(random, 0.5, 2.0);
        m->loop[i].axis = axis;
        m->loop[i].between[1].body = "a";
        m->loop[i].between[1].at = kt_vec3_scale(s, axis);
        m->loop[i].between[0].at = kt_vec3_make(rounded(s * axis.x, unit), rounded(s * axis.y, unit), s);
    }
}

/* Bennett's linkage: lengths a, b, a, b and twists with sin(alpha) / a = sin(beta) / b (Bennett 1903), closed by
 * tan(theta / 2) tan(phi / 2) = sin((beta + alpha) / 2) / sin((beta - alpha) / 2). */
static void make_bennett(machine *m, kt_random *random, double unit) {
    const double a = 1.0, b = kt_random_uniform(random, 1.3, 1.7), alpha = kt_random_uniform(random, 0.3, 0.55);
    const double beta = asin(b * sin(alpha) / a), theta = kt_random_uniform(random, 0.9, 1.4);
    const double phi = 2.0 * atan(sin(0.5 * (beta + alpha)) / sin(0.5 * (beta - alpha)) / tan(0.5 * theta));
    const kt_vec3 x = kt_vec3_make(1.0, 0.0, 0.0);
    begin(m, 3, 1);
    m->body[0].joint.position[0] = theta;
    m->body[1].parent = "a";
    m->body[1].joint.at.x = rounded(a, unit);
    m->body[1].joint.rotation = kt_rotation_axis_angle(x, rounded(alpha, unit));
    m->body[1].joint.position[0] = phi;
    m->body[2].parent = "b";
    m->body[2].joint.at.x = rounded(b, unit);
    m->body[2].joint.rotation = kt_rotation_axis_angle(x, rounded(beta, unit));
    m->body[2].joint.position[0] = -theta;
    m->loop[0].between[0].body = "c";
    m->loop[0].between[0].at.x = rounded(a, unit);
    m->loop[0].between[0].rotation = kt_rotation_axis_angle(x, rounded(alpha, unit));
    m->loop[0].between[1].at.x = rounded(-b, unit);
    m->loop[0].between[1].rotation = kt_rotation_axis_angle(x, rounded(-beta, unit));
}

typedef void maker(machine *m, kt_random *random, double unit);
static const struct {
    const char *name;
    maker *make;
    double units, least; /* by how much rounding to a unit may move a position: so many units, and that much more */
} makers[] = {{"parallelogram", make_parallelogram, 2.0, 0.0},
              {"tilted", make_tilted, 0.01, 1e-11},
              {"door", make_door, 0.0, 1e-14},
              {"Bennett", make_bennett, 20.0, 0.0}};
enum { MAKERS = sizeof makers / sizeof *makers, EACH = 12 };

static double largest(const machine *m) {
    double most = 0.0;
    for (int i = 0; i < kt_loop_count(m->model); i++) {
        const kt_loop_disagreement d = kt_loop_disagreement_of(m->model, i);
        most = fmax(most, fmax(d.length, d.angle));
    }
    return most;
}

/* ---- claims ------------------------------------------------------------------------------------------------------ */

/* The effect of rounding grows along the motion. Measured over a fifth of a second, the worst effect is a unit
 * (Bennett's linkage). A tilted pin acts in second order, and a door turns about its axis for any hinges. */
KT_TEST(rounded_machines_close_and_move_as_exact_ones) {
    for (int k = 0; k < MAKERS; k++) {
        KT_WORST apart = kt_worst_make(makers[k].name);
        int told = 0, run = 0;
        for (int seed = 0; seed < EACH; seed++) {
            const double unit = seed % 3 == 0 ? 1e-9 : seed % 3 == 1 ? 1e-8 : 3e-7;
            machine exact, rough;
            kt_error error = {0};
            kt_random random = kt_random_of_test(), again;
            for (int skip = 0; skip < seed; skip++)
                (void)kt_random_bits(&random);
            again = random;
            makers[k].make(&exact, &random, 0.0);
            makers[k].make(&rough, &again, unit);
            kt_status status = start(&exact, &error);
            status = status == KT_OK ? start(&rough, &error) : status;
            status = status == KT_OK ? kt_simulation_advance(exact.simulation, 0.2, &error) : status;
            status = status == KT_OK ? kt_simulation_advance(rough.simulation, 0.2, &error) : status;
            if (status != KT_OK)
                kt_check_text(makers[k].name, error.message, "");
            for (int i = 0; status == KT_OK && i < kt_model_nq(exact.model); i++)
                kt_worst_near(&apart, kt_simulation_positions(rough.simulation)[i],
                              kt_simulation_positions(exact.simulation)[i], makers[k].units * unit + makers[k].least,
                              "seed %d", seed);
            if (status == KT_OK) {
                told += largest(&rough) > 0.01 * unit && largest(&rough) < 30.0 * unit;
                run += largest(&exact) == 0.0;
            }
            finish(&exact);
            finish(&rough);
        }
        kt_check_equal_int("run, and exact ones agree", run, EACH);
        kt_check_above("told; rounding leaves some exact", told, 0.7 * EACH);
    }
}

/* The bars fall through the line of their pins, where a motion as an antiparallelogram branches off. Lengths that
 * repeat each other except for rounding are corrected, so that the bars stay parallel. */
KT_TEST(rounded_parallelograms_stay_parallel_where_they_lie_flat) {
    enum { SEEDS = 4 };
    const double unit = 1e-7;
    KT_WORST apart = kt_worst_make("bars");
    int crossed = 0;
    for (int seed = 0; seed < SEEDS; seed++) {
        machine m;
        kt_error error = {0};
        kt_random random = kt_random_of_test();
        for (int skip = 0; skip < seed; skip++)
            (void)kt_random_bits(&random);
        make_parallelogram(&m, &random, unit);
        kt_status status = start(&m, &error);
        for (int step = 1; status == KT_OK && step <= 40 && kt_simulation_positions(m.simulation)[0] > -0.4; step++)
            status = kt_simulation_advance(m.simulation, 0.05 * step, &error);
        kt_check_text("fall", status == KT_OK ? "" : error.message, "");
        if (status == KT_OK) {
            const double *q = kt_simulation_positions(m.simulation);
            crossed += q[0] <= -0.4;
            for (int i = 1; i < 3; i++)
                kt_worst_near(&apart, q[i], q[0], 2.0 * unit, "seed %d, bar %d", seed, i);
        }
        finish(&m);
    }
    kt_check_equal_int("passed the line", crossed, SEEDS);
}

/* The same linkage beyond the tolerance, and below it with none. */
KT_TEST(what_is_more_than_rounding_is_rejected) {
    for (int k = 0; k < MAKERS; k++)
        for (int i = 0; i < 2; i++) {
            machine m;
            kt_error error = {0};
            kt_random random = kt_random_of_test();
            makers[k].make(&m, &random, i == 0 ? 3e-4 : 1e-6);
            m.description.tolerance = i == 0 ? 1e-6 : 0.0;
            kt_check_equal_int(makers[k].name, start(&m, &error), KT_ERROR_CONSTRAINT);
            finish(&m);
        }
}

/* Bars of 1, 1.5 and 1 m cannot reach over 3.5000001 m. The remaining gap is within the tolerance, but stretched bars
 * cannot move, so that no equation repeats another. */
KT_TEST(linkage_out_of_reach_by_little_is_rejected) {
    machine m;
    kt_error error = {0};
    begin(&m, 3, 1);
    m.body[0].joint.position[0] = 0.01;
    m.body[1].parent = "a";
    m.body[1].joint.at.x = 1.0;
    m.body[2].joint.at.x = 3.5000001;
    m.body[2].joint.position[0] = 3.13;
    m.loop[0].between[0].body = "b";
    m.loop[0].between[0].at.x = 1.5;
    m.loop[0].between[1].body = "c";
    m.loop[0].between[1].at.x = 1.0;
    m.description.hold_count = 0;
    kt_check_equal_int("rejected", start(&m, &error), KT_ERROR_CONSTRAINT);
    finish(&m);
}

/* Held angles with five decimals of a degree: the held joints move by no more than these. */
KT_TEST(held_joints_with_rounded_angles_close) {
    static const double degree = 3.14159265358979323846 / 180.0;
    machine m;
    kt_error error = {0};
    kt_random random = kt_random_of_test();
    make_tilted(&m, &random, 0.0);
    kt_need(kt_check_equal_int("exact", start(&m, &error), KT_OK));
    double q[3];
    memcpy(q, kt_simulation_positions(m.simulation), sizeof q);
    finish(&m);
    m.hold[1] = "c";
    m.description.hold_count = 2;
    for (int i = 0; i < 3; i++)
        m.body[i].joint.position[0] = rounded(q[i], 1e-5 * degree);
    kt_check_equal_int("rounded", start(&m, &error), KT_OK);
    for (int i = 0; i < 3; i++)
        kt_check_near("angle", kt_simulation_positions(m.simulation)[i], q[i], 4e-5 * degree);
    finish(&m);
    m.body[2].joint.position[0] += 1e-3 * degree;
    kt_check_equal_int("another angle", start(&m, &error), KT_ERROR_CONSTRAINT);
    finish(&m);
}

/* Corrections of the ends are not left out where there is no memory to look for them: that would be another model. */
KT_TEST(a_compilation_of_rounded_data_that_runs_out_of_memory_says_so) {
    kt_random random = kt_random_of_test();
    static machine m;
    int wrong = 0, leaks = 0, failed = 1;
    long n = 0;
    make_parallelogram(&m, &random, 1e-8);
    while (failed && n < 1000) {
        kt_error error = {0};
        kt_interpose_start_failing(++n);
        const kt_status status = kt_model_compile(&m.description, NULL, &m.model, &error);
        kt_model_free(m.model);
        const long allocations = kt_interpose_stop();
        m.model = NULL;
        failed = kt_interpose_has_failed();
        wrong += status != (failed ? KT_ERROR_MEMORY : KT_OK);
        leaks += kt_interpose_frees() != allocations - failed;
    }
    kt_check_above("allocations made to fail", (double)(n - 1), 10.0);
    kt_check_equal_int("calls that did not say so", wrong, 0);
    kt_check_equal_int("calls that leaked", leaks, 0);
}
