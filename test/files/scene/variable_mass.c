/* Masses that are functions of time: closed forms, and mechanisms of every kind against the same ones of constant
 * masses. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "collect.h"

#include "kinetree/analysis.h"
#include "kinetree/batch.h"
#include "kinetree/dynamics.h"
#include "kinetree/mechanism.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The first and the last record of a run. */
typedef struct ending {
    double q[16], v[16], energy[2];
    kt_work work;
    int nq, nv;
} ending;

static int keep_ends(const kt_record *record, void *user) {
    ending *last = user;
    memcpy(last->q, record->q, (size_t)last->nq * sizeof *last->q);
    memcpy(last->v, record->v, (size_t)last->nv * sizeof *last->v);
    last->energy[record->index > 0] = record->kinetic + record->potential;
    last->work = record->work;
    return 0;
}

/* Runs a scene to its end, with a balance of energies. */
static ending run_text(const char *text, const char *method, double step, double tolerance) {
    ending last = {.nq = 0};
    kt_error error = {0};
    kt_simulation_options options = kt_simulation_options_default();
    kt_scene *scene = kt_test_scene(text);
    scene->run.integrator = method;
    scene->run.step = step;
    scene->run.relative = scene->run.absolute = tolerance;
    scene->run.interval = scene->run.duration;
    options.record = KT_RECORD_ENERGY | KT_RECORD_BALANCE;
    const kt_model *model = kt_test_model(&scene->description, NULL);
    last.nq = kt_model_nq(model);
    last.nv = kt_model_nv(model);
    kt_simulation *simulation = kt_test_simulation(model, &scene->run, &options);
    kt_need_fine("run", kt_simulation_run(simulation, keep_ends, &last, &error), &error);
    return last;
}

static void check_balance(const ending *last, double bound) {
    const double supplied = last->work.supplied - last->work.dissipated, size = fabs(last->work.supplied);
    kt_check_near("energy gained over what was supplied", (last->energy[1] - last->energy[0]) / size, supplied / size,
                  bound);
}

/* ---- closed forms ------------------------------------------------------------------------------------------------ */

/* The rocket goes straight up, from 10 kg to 2 kg in 3 s, with
 *     v = u ln(m0 / m) - g t.
 * The mass falls evenly and along a sine. Explicit and implicit methods are tested. Rosenbrock's method has the
 * derivative by time among its terms. */
KT_TEST(rocket_keeps_tsiolkovskys_equation) {
    static const struct {
        const char *mass, *method;
        double end, step, bound, balance;
    } runs[] = {
        {"{polynomial: [10, -2.5]}", "dopri5", 2.0, 0.0, 1e-10, 1e-10},
        {"{ramp: {from: 10, to: 2, start: 0, end: 2}}", "dop853", 2.0, 0.0, 1e-10, 1e-10},
        {"10/(1 + t)^2", "radau5", 10.0 / 9.0, 0.05, 1e-8, 1e-7},
        {"10/(1 + t)^2", "rodas5p", 10.0 / 9.0, 0.02, 1e-9, 1e-7},
        {"10/(1 + t)^2", "rk4", 10.0 / 9.0, 1e-2, 1e-8, 1e-8},
    };
    for (size_t i = 0; i < sizeof runs / sizeof *runs; i++) {
        char text[512];
        snprintf(
            text, sizeof text,
            "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
            "  - {name: rocket, joint: {type: prismatic, axis: z}, mass: %s, com: [0, 0, 1], exhaust: [0, 0, -900]}\n"
            "simulate: {duration: 2}\n",
            runs[i].mass);
        const ending last = run_text(text, runs[i].method, runs[i].step, 1e-10);
        const double v = 900.0 * log(10.0 / (i == 0 ? 5.0 : runs[i].end)) - 2.0 * 9.81;
        kt_check_near(runs[i].method, last.v[0] / v, 1.0, runs[i].bound);
        check_balance(&last, runs[i].balance);
    }
}

/* A chain of 1 m and 2 kg slides over the edge of a table without friction. At first, 0.1 m of it hangs. Its motion is
 *     l x'' = g x,   x = x0 cosh(sqrt(g / l) t).
 * Its two parts are bodies whose masses change hands at the edge at the velocity that both have. */
KT_TEST(chain_slides_off_its_table) {
    static const char text[] = "kinetree: 1\nparameters: {k: =sqrt(9.81)}\ngravity: [0, 0, -9.81]\nbodies:\n"
                               "  - {name: lying, joint: {type: prismatic, axis: x}, mass: \"2*(1 - 0.1*cosh(k*t))\"}\n"
                               "  - {name: hanging, joint: {type: prismatic, axis: -z}, mass: \"2*0.1*cosh(k*t)\"}\n"
                               "loops:\n  - {name: edge, type: coupling, coefficients: {lying: 1, hanging: -1}}\n"
                               "simulate: {duration: 0.8}\n";
    const ending last = run_text(text, "dopri5", 0.0, 1e-12);
    const double k = sqrt(9.81);
    kt_check_near("x, m", last.q[1], 0.1 * (cosh(0.8 * k) - 1.0), 1e-11);
    kt_check_near("v, m/s", last.v[0], 0.1 * k * sinh(0.8 * k), 1e-11);
}

/* ---- the same equations, integrated by a file of their own ------------------------------------------------------- */

/* Classical Runge-Kutta steps of y' = f(t, y). */
static void integrate(void (*f)(double t, const double *y, double *rate), int n, double *y, double end, int steps) {
    const double h = end / steps;
    for (int i = 0; i < steps; i++) {
        double k[4][6], z[6];
        const double c[] = {0.0, 0.5, 0.5, 1.0};
        for (int s = 0; s < 4; s++) {
            for (int j = 0; j < n; j++)
                z[j] = y[j] + (s > 0 ? c[s] * h * k[s - 1][j] : 0.0);
            f((i + c[s]) * h, z, k[s]);
        }
        for (int j = 0; j < n; j++)
            y[j] += h / 6.0 * (k[0][j] + 2.0 * k[1][j] + 2.0 * k[2][j] + k[3][j]);
    }
}

/* A rod of 1 kg and 1 m has a vessel at its end. The vessel leaks from 3 kg to 1 kg. Water that drips leaves at the
 * velocity of the vessel, and takes no force. */
static void leaking(double t, const double *y, double *rate) {
    const double m = 3.0 - 0.5 * t;
    rate[0] = y[1];
    rate[1] = -9.81 * (0.5 + m) * sin(y[0]) / (1.0 / 3.0 + m);
}

KT_TEST(leaking_pendulum_swings_as_its_equation_says) {
    static const char text[] =
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
        "  - {name: rod, joint: {type: revolute, axis: y, position: 1.2}, mass: 1, shape: {type: rod, to: [0, 0, "
        "-1]}}\n"
        "  - {name: vessel, parent: rod, joint: {type: fixed, at: [0, 0, -1]}, mass: {polynomial: [3, -0.5]}}\n"
        "simulate: {duration: 4}\n";
    double y[2] = {1.2, 0.0};
    integrate(leaking, 2, y, 4.0, 40000);
    const ending last = run_text(text, "dop853", 0.0, 1e-13);
    kt_check_near("angle", last.q[0], y[0], 1e-11);
    kt_check_near("rate", last.v[0], y[1], 1e-11);
    check_balance(&last, 1e-12);
    /* by a method that needs the derivative by time */
    kt_check_near("angle by rodas5p", run_text(text, "rodas5p", 0.02, 1e-13).q[0], y[0], 1e-9);
}

/* A vessel of 3 kg falls on a floor from 0.2 m. It leaks, and its mass falls evenly (Hunt and Crossley):
 *     N = k x^(3/2) max(0, 1 + 3/2 c x'). */
static void bouncing(double t, const double *y, double *rate) {
    const double depth = -y[0], pressed = 4e3 * depth * sqrt(fmax(depth, 0.0)) * fmax(0.0, 1.0 - 1.5 * 0.3 * y[1]);
    rate[0] = y[1];
    rate[1] = (depth > 0.0 ? pressed : 0.0) / (3.0 - 0.8 * t) - 9.81;
}

/* Soft: the result is compared with these equations. With another mass, the third bounce would be off by centimetres.
 * Hard: masses of any kind bounce alike, at e times the speed after 2 e v / g. The balance accounts for the energy that
 * the floor and the leak take. */
KT_TEST(leaking_vessel_bounces) {
#define VESSEL                                                                                                         \
    "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"                                                                   \
    "  - {name: vessel, joint: {type: prismatic, axis: z, position: 0.2}, mass: {polynomial: [3, -0.8]}, markers: "    \
    "{foot: "                                                                                                          \
    "[0, 0, 0]}}\neffects:\n  - {type: contact, point: vessel.foot, radius: 0, plane: world, axis: z, "
    double y[2] = {0.2, 0.0};
    integrate(bouncing, 2, y, 1.5, 300000);
    ending last = run_text(VESSEL "stiffness: 4e3, exponent: 1.5, dissipation: 0.3}\nsimulate: {duration: 1.5}\n",
                           "dop853", 0.0, 1e-12);
    kt_check_near("place, m", last.q[0], y[0], 1e-12);
    kt_check_near("speed, m/s", last.v[0], y[1], 3e-11);
    kt_check_near("energy gained", last.energy[1] - last.energy[0], last.work.supplied - last.work.dissipated, 1e-9);
    const double g = 9.81, down = sqrt(2.0 * 0.2 / g), up = 0.6 * sqrt(2.0 * 0.2 * g), second = down + 2.0 * up / g;
    const double since = 0.55 - second, v = 0.6 * up;
    last = run_text(VESSEL "restitution: 0.6}\nsimulate: {duration: 0.55}\n", "dopri5", 0.0, 1e-11);
    kt_check_near("after two bounces, m", last.q[0], v * since - 0.5 * g * since * since, 2e-14);
    kt_check_near("its speed, m/s", last.v[0], v - g * since, 2e-13);
    kt_check_near("energy gained", last.energy[1] - last.energy[0], last.work.supplied - last.work.dissipated, 3e-13);
#undef VESSEL
}

/* The body is free and has given moments of inertia. With (J w)' less the momentum that leaves, J w' + w x J w = 0. */
static void tumbling(double t, const double *w, double *rate) {
    const double j[] = {2.0 - 0.3 * t, 3.0 - 0.2 * t, 4.0 - 0.4 * t};
    for (int k = 0; k < 3; k++) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        rate[k] = (j[a] - j[b]) * w[a] * w[b] / j[k];
    }
}

KT_TEST(given_moments_turn_by_eulers_equations) {
    static const char text[] =
        "kinetree: 1\nbodies:\n  - {name: body, joint: {type: free, velocity: {angular: [1, 2, 0.5]}}, mass: 5 - t,\n"
        "     inertia: [{polynomial: [2, -0.3]}, {polynomial: [3, -0.2]}, 4 - 0.4*t]}\n"
        "simulate: {duration: 3}\n";
    double w[3] = {1.0, 2.0, 0.5};
    integrate(tumbling, 3, w, 3.0, 30000);
    const ending last = run_text(text, "dop853", 0.0, 1e-13);
    for (int k = 0; k < 3; k++)
        kt_check_near("angular velocity", last.v[3 + k], w[k], 1e-11);
    check_balance(&last, 1e-12);
}

/* ---- mechanisms of an instant ------------------------------------------------------------------------------------ */

/* With two masses left open. */
static const char *const mechanisms[] = {
    /* a tree in space, a body fixed on another one, a rotor */
    "gravity: [1, 2, -9.81]\nbodies:\n"
    "  - {name: a, joint: {type: spherical}, mass: @, com: [0.1, 0.2, -0.3], inertia: [2, 3, 4, 0.1, 0.2, -0.1]}\n"
    "  - {name: b, parent: a, joint: {type: fixed, at: [0.3, 0, 0.1]}, mass: 0.7, com: [0, 0.1, 0], "
    "inertia: [1, 1, 1]}\n"
    "  - {name: c, parent: b, joint: {type: universal, at: [0.5, 0.1, 0], armature: 0.3}, mass: @, com: [0.4, 0, 0.1], "
    "inertia: [1, 1.2, 1.4]}\n",
    /* a tree in a plane */
    "gravity: [0, -9.81, 0]\nbodies:\n"
    "  - {name: a, joint: {type: revolute}, mass: @, shape: {type: rod, to: [1, 0, 0], radius: 0.1}}\n"
    "  - {name: b, parent: a, joint: {type: prismatic, axis: x, at: [1, 0, 0]}, mass: @, com: [0.1, 0.1, 0], "
    "inertia: [1, 1, 1]}\n",
    /* a four-bar */
    "gravity: [0, -9.81, 0]\nbodies:\n"
    "  - {name: a, joint: {type: revolute, position: 1.2, velocity: 2}, mass: @, shape: {type: rod, to: [1, 0, 0]}}\n"
    "  - {name: b, parent: a, joint: {type: revolute, at: [1, 0, 0], position: -0.9}, mass: @, "
    "shape: {type: rod, to: [2, 0, 0]}, markers: {tip: [2, 0, 0]}}\n"
    "  - {name: c, joint: {type: revolute, at: [2.5, 0, 0], position: 1.6}, mass: 1, shape: {type: rod, to: [1.5, 0, "
    "0]}, "
    "markers: {tip: [1.5, 0, 0]}}\n"
    "loops:\n  - {name: pin, type: revolute, between: [b.tip, c.tip]}\n",
    /* a loop in space */
    "gravity: [1, 2, -9.81]\nbodies:\n"
    "  - {name: a, joint: {type: spherical, velocity: [1, 2, 3]}, mass: @, com: [0.5, 0, 0], inertia: [1, 2, 2], "
    "markers: {tip: [1, 0, 0]}}\n"
    "  - {name: b, joint: {type: free, position: {position: [1, 0.2, 0]}}, mass: @, com: [0, 0.1, 0.2], "
    "inertia: [1, 1.1, 1.2]}\n"
    "loops:\n  - {name: hold, type: universal, between: [a.tip, b]}\n"};
enum { MECHANISMS = sizeof mechanisms / sizeof *mechanisms };

static kt_opened open_instance(int mechanism, const char *first, const char *second) {
    char text[2048] = "kinetree: 1\n";
    const char *from = mechanisms[mechanism];
    for (int k = 0; k < 2; k++) {
        const int before = (int)strcspn(from, "@");
        snprintf(text + strlen(text), sizeof text - strlen(text), "%.*s%s", before, from, k ? second : first);
        from += before + 1;
    }
    snprintf(text + strlen(text), sizeof text - strlen(text), "%s", from);
    return kt_test_open(kt_test_scene(text), NULL);
}

static double mass_a(double t) { return 2.0 + sin(3.0 * t); }
static double mass_b(double t) { return 4.0 - t; }

/* The variable one, and the one whose masses are constant. */
static void open_pair(kt_opened *varies, kt_opened *rests, int mechanism, double t) {
    char first[40], second[40];
    snprintf(first, sizeof first, "%.17g", mass_a(t));
    snprintf(second, sizeof second, "%.17g", mass_b(t));
    *varies = open_instance(mechanism, "2 + sin(3*t)", "4 - t");
    *rests = open_instance(mechanism, first, second);
}

enum { MOST = 12 };

/* A state near the start that closes the loops. */
static void draw_state(kt_random *random, const kt_opened *i, double t, double *q, double *v) {
    double turn[MOST];
    kt_error e = {0};
    kt_model_initial(i->model, q, v);
    for (int k = 0; k < kt_model_nv(i->model); k++) {
        turn[k] = 0.2 * kt_random_normal(random);
        v[k] += kt_random_normal(random);
    }
    kt_position_add(i->model, q, turn, q);
    kt_need_fine("assembled", kt_state_assemble(i->model, i->data, t, q, v, &e), &e);
}

/* Inertias in proportion: those of the constant one are made so by a parameter, where they are given by numbers. */
static void proportion(kt_opened *rests, const kt_opened *varies, double t) {
    static const char *const names[] = {"a", "b", "c"};
    kt_error e = {0};
    for (int b = 0; b < rests->scene->description.body_count; b++) {
        const kt_body *from = &varies->scene->description.bodies[b];
        if (!from->variable_mass)
            continue;
        double mass[3];
        kt_vec3 com;
        kt_sym3 j;
        kt_need_fine("function", kt_function_evaluate(&from->variable_mass->mass, t, mass, &e), &e);
        kt_need_fine("inertia", kt_body_inertia(from, &com, &j, &e), &e);
        const double s = mass[0] / from->mass, x[6] = {s * j.xx, s * j.yy, s * j.zz, s * j.xy, s * j.xz, s * j.yz};
        char name[40];
        kt_parameter parameter;
        snprintf(name, sizeof name, "%s.inertia", names[b]);
        kt_need_fine("found", kt_parameter_find(rests->model, name, &parameter, &e), &e);
        kt_need_fine("set", kt_parameter_set(rests->model, &parameter, x, &e), &e);
    }
}

KT_TEST(evaluations_are_those_of_the_masses_of_the_instant) {
    kt_random random = kt_random_of_test();
    static unsigned char memory[1 << 20];
    for (int m = 0; m < MECHANISMS; m++) {
        KT_WORST worst = kt_worst_make("mechanism");
        for (int n = 0; n < 20; n++) {
            const double t = kt_random_uniform(&random, 0.0, 2.0);
            kt_opened varies, rests;
            double q[16], v[MOST], a[2][MOST], tau[2][MOST], mass[2][MOST * MOST], energy[2][2];
            kt_wrench joint[2][4], loop[2][1];
            kt_error e = {0};
            kt_model *copy = NULL;
            open_pair(&varies, &rests, m, t);
            draw_state(&random, &varies, t, q, v);
            void *at = memory + (64 - (size_t)memory % 64) % 64;
            kt_need_fine("copy", kt_model_copy(rests.model, at, sizeof memory - 64, &copy, &e), &e);
            rests.model = copy;
            proportion(&rests, &varies, t);
            const int nv = kt_model_nv(copy);
            const kt_opened *both[] = {&varies, &rests};
            for (int i = 0; i < 2; i++) { /* at first without a call that has a time but the one that sets it */
                const kt_opened *x = both[i];
                kt_need_fine("date", kt_masses_update(x->model, x->data, t, &e), &e);
                kt_need_fine("mass", kt_dynamics_mass(x->model, x->data, q, mass[i], &e), &e);
                kt_need_fine("a", kt_acceleration_evaluate(x->model, x->data, t, q, v, NULL, NULL, a[i], &e), &e);
                kt_need_fine("reactions",
                             kt_reaction_evaluate(x->model, x->data, t, q, v, NULL, NULL, joint[i], loop[i], &e), &e);
                kt_need_fine("inverse", kt_dynamics_inverse(x->model, x->data, q, v, a[0], NULL, tau[i], &e), &e);
                kt_need_fine("kinematics", kt_kinematics_update(x->model, x->data, q, v, NULL, &e), &e);
                energy[i][0] = kt_kinetic_energy(x->model, x->data);
                energy[i][1] = kt_potential_energy(x->model, x->data);
            }
            for (int k = 0; k < nv; k++) {
                kt_worst_near(&worst, a[0][k], a[1][k], 1e-12 * (1.0 + fabs(a[1][k])), "acceleration %d", k);
                kt_worst_near(&worst, tau[0][k], tau[1][k], 1e-11, "joint force %d", k);
            }
            for (int k = 0; k < nv * nv; k++)
                kt_worst_near(&worst, mass[0][k], mass[1][k], 1e-12, "mass %d", k);
            for (int k = 0; k < 2; k++)
                kt_worst_near(&worst, energy[0][k], energy[1][k], 1e-11, "energy %d", k);
            for (int b = 1; b < kt_model_body_count(copy); b++)
                kt_worst_near(&worst, kt_vec3_norm(kt_vec3_sub(joint[0][b].force, joint[1][b].force)), 0.0, 1e-10,
                              "reaction %d", b);
        }
    }
}

/* Derivatives against differences of accelerations. */
KT_TEST(derivatives_are_those_of_accelerations) {
    kt_random random = kt_random_of_test();
    static double work[1 << 16];
    for (int m = 0; m < 2; m++) { /* trees: their coordinates are free */
        const kt_opened varies = open_instance(m, "2 + sin(3*t)", "4 - t");
        double q[16], v[MOST], dq[MOST * MOST], dv[MOST * MOST];
        const double t = 0.7, h = 1e-5;
        kt_error e = {0};
        KT_WORST worst = kt_worst_make("derivative");
        draw_state(&random, &varies, t, q, v);
        const int nv = kt_model_nv(varies.model);
        void *at = (char *)work + (64 - (size_t)work % 64) % 64;
        kt_need_fine("derivatives",
                     kt_acceleration_derivatives(varies.model, varies.data, at, sizeof work - 64, t, q, v, NULL, NULL,
                                                 dq, dv, NULL, &e),
                     &e);
        for (int j = 0; j < nv; j++) {
            double near[2][2][MOST];
            for (int side = 0; side < 2; side++) {
                double moved[16], w[MOST], step[MOST] = {0.0};
                step[j] = side ? -h : h;
                kt_position_add(varies.model, q, step, moved);
                memcpy(w, v, sizeof w);
                w[j] += step[j];
                kt_need_fine(
                    "by q",
                    kt_acceleration_evaluate(varies.model, varies.data, t, moved, v, NULL, NULL, near[0][side], &e),
                    &e);
                kt_need_fine(
                    "by v", kt_acceleration_evaluate(varies.model, varies.data, t, q, w, NULL, NULL, near[1][side], &e),
                    &e);
            }
            for (int i = 0; i < nv; i++) {
                kt_worst_near(&worst, dq[j * nv + i], (near[0][0][i] - near[0][1][i]) / (2.0 * h), 1e-7, "q %d %d", i,
                              j);
                kt_worst_near(&worst, dv[j * nv + i], (near[1][0][i] - near[1][1][i]) / (2.0 * h), 1e-7, "v %d %d", i,
                              j);
            }
        }
    }
}

/* ---- what is rejected -------------------------------------------------------------------------------------------- */

#define ONE "kinetree: 1\nbodies:\n  - {name: body, joint: {type: prismatic}, "

/* The mass is 0 at t = 1. Returns the time at which the run ends. */
static double check_end_of_mass(const char *method, double step) {
    kt_error e = {0};
    kt_scene *scene = kt_test_scene(ONE "mass: {polynomial: [1, -1]}}\nsimulate: {duration: 2}\n");
    scene->run.integrator = method;
    scene->run.step = step;
    kt_simulation *simulation = kt_test_simulation(kt_test_model(&scene->description, NULL), &scene->run, NULL);
    kt_check_equal_int("status", kt_simulation_advance(simulation, 2.0, &e), KT_ERROR_SINGULAR);
    kt_check_contains("where", e.where, "body 'body', t = 1");
    kt_check_contains("mend", e.message, "must stay above 0");
    return kt_simulation_time(simulation);
}

KT_TEST(masses_that_end_are_told_with_body_and_time) { (void)check_end_of_mass("rk4", 0.01); }

/* A step that tries a later time is repeated with a shorter one. */
KT_TEST(adaptive_steps_approach_the_time_at_which_a_mass_ends) {
    kt_check_near("time", check_end_of_mass(NULL, 0.0), 1.0, 1e-9);
}

KT_TEST(what_makes_no_sense_is_a_fault_of_the_file) {
    static const char *const wrong[][2] = {
        {ONE "mass: 2, exhaust: [0, 0, 1]}\n", "the mass is constant"},
        {ONE "mass: {polynomial: [0, 1]}}\n", "the mass is 0 at t = 0"},
        {ONE "mass: {ramp: {from: 1, to: -1, start: 0, end: 1}}}\n", "it must stay greater than 0"},
        {ONE "mass: 2 - t, inertia: [1, 2]}\n", "expected [Ixx"},
        {ONE "mass: {polynomial: [1, 1]}, exhaust: 3}\n", "expected"}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        static kt_collected faults;
        kt_scene scene;
        if (kt_check_true("rejected", kt_collect_parse(&faults, wrong[i][0], &scene) != KT_OK))
            kt_check_contains("words", faults.text, wrong[i][1]);
    }
}

KT_TEST(what_does_not_know_them_rejects_them) {
    kt_batch *batch = NULL;
    kt_error e = {0};
    static double memory[1 << 14];
    kt_batch_options options = kt_batch_options_default();
    const kt_model *model = kt_test_model(&kt_test_scene(ONE "mass: 2 - t}\n")->description, NULL);
    options.states = 2;
    kt_check_equal_int("a batch", kt_batch_init(model, &options, memory, sizeof memory, &batch, &e),
                       KT_ERROR_UNSUPPORTED);
    kt_check_contains("words", e.message, "the mass of body 'body' is a function of time");
}

KT_TEST(scenes_with_them_are_written_and_read_again) {
    kt_scene *scene = kt_test_scene(
        ONE "mass: {ramp: {from: 3, to: 1, start: 0, end: 2}}, inertia: [1, 2 - t, 2], exhaust: [0, 0, -7]}\n");
    const kt_scene *again = kt_test_scene(kt_test_written(scene));
    const kt_body *body = &again->description.bodies[0];
    kt_check_true("its mass is variable", body->variable_mass != NULL && body->variable_mass->mass.to == 1.0);
    kt_check_text("its inertia", body->variable_mass ? body->variable_mass->inertia[1].text : "", "2 - t");
    kt_check_equal_int("thrust", again->description.effects[0].type, KT_EFFECT_THRUST);
    kt_check_text("name", again->description.effects[0].name, "body-exhaust");
    kt_check_near("exhaust", again->description.effects[0].exhaust.z, -7.0, 0.0);
}

/* ---- functions without a model ----------------------------------------------------------------------------------- */

KT_TEST(functions_are_evaluated_before_a_model_has_them) {
    static const double numbers[] = {1.0, 2.0, 3.0}, backwards[] = {1.0, 0.0, 0.0, 1.0};
    const kt_function polynomial = kt_function_polynomial(numbers, 3), formula = kt_function_expression("exp(2*t)");
    const kt_function parts[] = {polynomial, formula}, sum = kt_function_sum(parts, 2);
    const kt_function wrong = kt_function_table(backwards, 4, KT_INTERPOLATION_LINEAR);
    double x[3] = {7.0, 7.0, 7.0};
    kt_error e = {0};
    const double y = exp(3.0);
    kt_need_fine("evaluated", kt_function_evaluate(&sum, 1.5, x, &e), &e);
    kt_check_near("value", x[0], 10.75 + y, 1e-14 * y);
    kt_check_near("first derivative", x[1], 11.0 + 2.0 * y, 1e-14 * y);
    kt_check_near("second derivative", x[2], 6.0 + 4.0 * y, 2e-14 * y);
    x[0] = 7.0;
    kt_check_equal_int("a table that goes back", kt_function_evaluate(&wrong, 1.5, x, &e), KT_ERROR_MODEL);
    kt_check_contains("words", e.message, "times must increase");
    kt_check_near("what it leaves", x[0], 7.0, 0.0);
}
