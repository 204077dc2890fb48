/* Chapters 7 to 9: the point mass pendulum by every set of coordinates; index and stability of DAEs. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/analysis.h"
#include "notes.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* 2 kg on two sliders, 1 m from the origin, at x = sin(angle), z = -cos(angle). */
static bool pendulum(mechanism *m, double angle, double rate) {
    char text[512];
    snprintf(text, sizeof text,
             "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
             "  - {name: x, joint: {type: prismatic, axis: x, position: %.17g, velocity: %.17g}}\n"
             "  - {name: z, parent: x, joint: {type: prismatic, axis: z, position: %.17g, velocity: %.17g}, mass: 2}\n"
             "loops:\n  - {name: rod, type: distance, between: [world, z], length: 1}\n",
             sin(angle), rate * cos(angle), -cos(angle), rate * sin(angle));
    return open_mechanism(m, text);
}

static bool accelerate_pendulum(const kt_reduction_method *method, double angle, double rate, double *a) {
    mechanism m;
    kt_error e = {0};
    kt_model *model = NULL;
    kt_data *data = NULL;
    kt_model_options options = kt_model_options_default();
    options.reduction = method;
    const bool done = pendulum(&m, angle, rate) &&
                      works(kt_model_compile(&m.scene.description, &options, &model, &e), &e) &&
                      works(kt_data_create(model, &data, &e), &e) &&
                      works(kt_acceleration_evaluate(model, data, 0.0, m.q, m.v, NULL, NULL, a, &e), &e);
    kt_data_free(data);
    kt_model_free(model);
    close_mechanism(&m);
    return done;
}

/* The error of accelerations, compared with the pendulum's equation theta'' = -g sin theta. */
static double acceleration_error_of(const double *a, double angle, double rate) {
    const double turn = -9.81 * sin(angle);
    const double x = turn * cos(angle) - rate * rate * sin(angle), z = turn * sin(angle) + rate * rate * cos(angle);
    return hypot(a[0] - x, a[1] - z);
}

static bool minimal(void) {
    double a[2];
    /* Exercise 7.1E at an angle of 1 rad, and at the level position. A fixed choice of x as the independent coordinate
     * cannot pass the latter, since z vanishes there. */
    if (!accelerate_pendulum(kt_reduction_method_of(KT_REDUCTION_PARTITION), 1.0, 0.5, a))
        return false;
    tell("7.1E", acceleration_error_of(a, 1.0, 0.5));
    const double horizontal = 1.57079632679489662;
    if (!accelerate_pendulum(kt_reduction_method_of(KT_REDUCTION_PARTITION), horizontal, 0.5, a))
        return false;
    tell("7.1E.level", acceleration_error_of(a, horizontal, 0.5));
    /* [MSD 7.15] with x independent: z' = -(x / z) q', whose factor is the condition */
    tell("7.1E.fixed", fabs(sin(horizontal - 1e-6) / cos(horizontal - 1e-6)));
    if (!accelerate_pendulum(NULL, horizontal, 0.5, a))
        return false;
    tell("7.2E", acceleration_error_of(a, horizontal, 0.5));
    return true;
}

/* [MSD 7.19] with x as the permanent independent coordinate:
 *
 *     (1 + x^2 / z^2) q'' = g x / z - x / z^2 (1 + x^2 / z^2) q'^2,  z' = -(x / z) q' */
static void fixed_rate(const double *y, double *rate) {
    const double x = y[0], z = y[1], v = y[2], s = 1.0 + x * x / (z * z);
    rate[0] = v;
    rate[1] = -x / z * v;
    rate[2] = (9.81 * x / z - x / (z * z) * s * v * v) / s;
}

/* Half a second of the pendulum through the level position, by rk4 with steps of 1 ms. It starts at 1 rad with 4 rad/s.
 * The pendulum's angle is the reference. With the fixed choice, the figures are the final distance from the reference
 * and the largest |x / z| on the way. With pivots that are chosen anew, and with QR, the figure is the distance from
 * the reference. */
static bool cross_horizontal(void) {
    const double h = 1e-3;
    double y[3] = {sin(1.0), -cos(1.0), 4.0 * cos(1.0)}, worst = 0.0, angle = 1.0, turn = 4.0;
    for (int i = 0; i < 500; i++) {
        double k[4][3], at[3];
        fixed_rate(y, k[0]);
        for (int s = 1; s < 4; s++) {
            for (int j = 0; j < 3; j++)
                at[j] = y[j] + (s == 3 ? h : 0.5 * h) * k[s - 1][j];
            fixed_rate(at, k[s]);
        }
        for (int j = 0; j < 3; j++)
            y[j] += h / 6.0 * (k[0][j] + 2.0 * k[1][j] + 2.0 * k[2][j] + k[3][j]);
        worst = fmax(worst, fabs(y[0] / y[1]));
        for (int n = 0; n < 10; n++) { /* the angle, by the method of Stoermer and Verlet, with finer steps */
            const double fine = h / 10.0;
            turn -= 0.5 * fine * 9.81 * sin(angle);
            angle += fine * turn;
            turn -= 0.5 * fine * 9.81 * sin(angle);
        }
    }
    tell("7.1E.lost", isfinite(y[0]) ? hypot(y[0] - sin(angle), y[1] + cos(angle)) : 1e9);
    tell("7.1E.condition", worst);
    for (int i = 0; i < 2; i++) {
        mechanism m;
        kt_error e = {0};
        kt_model *model = NULL;
        kt_simulation *simulation = NULL;
        kt_model_options options = kt_model_options_default();
        kt_run run = kt_run_default();
        options.reduction = kt_reduction_method_of(i ? KT_REDUCTION_QR : KT_REDUCTION_PARTITION);
        run.integrator = "rk4";
        run.step = h;
        if (!pendulum(&m, 1.0, 4.0) || !works(kt_model_compile(&m.scene.description, &options, &model, &e), &e) ||
            !works(kt_simulation_create(model, &run, NULL, &simulation, &e), &e) ||
            !works(kt_simulation_advance(simulation, 0.5, &e), &e))
            return false;
        const double *q = kt_simulation_positions(simulation);
        tell(i ? "7.2E.passed" : "7.1E.passed", hypot(q[0] - sin(angle), q[1] + cos(angle)));
        kt_simulation_free(simulation);
        kt_model_free(model);
        close_mechanism(&m);
    }
    return true;
}

/* A T = 0 and T' A' = 0 for T of [MSD 7.7]; Q1 R1^-T is the pseudo-inverse A' (A A')^-1: of one equation A' / |A|^2. */
static bool projections(void) {
    mechanism m;
    kt_error e = {0};
    double A[2], x[2], v[2];
    if (!pendulum(&m, 1.0, 0.5) ||
        !works(kt_loop_equations(m.model, m.data, 0.0, m.q, m.v, A, NULL, NULL, NULL, &e), &e))
        return false;
    const double T[2] = {1.0, -A[0] / A[1]};
    tell("7.1", fabs(A[0] * T[0] + A[1] * T[1]));
    tell("7.2", fabs(T[0] * A[0] + T[1] * A[1]));
    /* the projection removes A^+ A v from a velocity off the loop */
    memcpy(x, m.q, sizeof x);
    v[0] = m.v[0] + 0.3;
    v[1] = m.v[1] - 0.1;
    const double off = A[0] * v[0] + A[1] * v[1], norm = A[0] * A[0] + A[1] * A[1];
    const double by_hand[2] = {v[0] - A[0] * off / norm, v[1] - A[1] * off / norm};
    bool changed = false;
    if (!works(kt_state_project(m.model, m.data, 0.0, x, v, &changed, &e), &e))
        return false;
    tell("7.3", hypot(v[0] - by_hand[0], v[1] - by_hand[1]));
    close_mechanism(&m);
    return true;
}

/* The power of 1 / h in the condition of Newton's matrix, which is the index [Petzold, Loetstedt 1986]. */
static bool dae_index_of(const char *exercise, kt_dae_type type) {
    mechanism m;
    kt_error e = {0};
    double condition[2];
    kt_dae_options options = kt_dae_options_default(type);
    options.method = kt_method_find("implicit-euler");
    if (!pendulum(&m, 1.0, 0.5))
        return false;
    for (int i = 0; i < 2; i++) {
        kt_dae *dae = NULL;
        if (!works(kt_dae_create(m.model, &options, &dae, &e), &e) ||
            !works(kt_dae_start(dae, 0.0, m.q, m.v, &e), &e) || !works(kt_dae_step(dae, i ? 0.5e-3 : 1e-3, &e), &e))
            return false;
        condition[i] = kt_dae_condition(dae);
        kt_dae_free(dae);
    }
    tell(exercise, log2(condition[1] / condition[0]));
    close_mechanism(&m);
    return true;
}

/* Prints the first frequency of example 8.1 in two limits. In one, k1 = 100 N/m and m1 vanishes. In the other,
 * m1 = 1 kg and k1 goes to infinity. The second mass and spring have m2 = 8 kg and k2 = 300 N/m. */
static bool masses(const char *exercise, double m1, double k1) {
    char text[512];
    mechanism m;
    kt_error e = {0};
    kt_linearization *linearization = NULL;
    kt_modes *modes = NULL;
    snprintf(text, sizeof text,
             "kinetree: 1\nbodies:\n  - {name: one, joint: {type: prismatic, axis: x}, mass: %g}\n"
             "  - {name: two, parent: one, joint: {type: prismatic, axis: x}, mass: 8}\neffects:\n"
             "  - {type: joint_spring, joint: one, stiffness: %g, rest: 0}\n"
             "  - {type: joint_spring, joint: two, stiffness: 300, rest: 0}\n",
             m1, k1);
    if (!open_mechanism(&m, text) || !works(kt_linearization_create(m.model, NULL, &linearization, &e), &e) ||
        !works(kt_linearization_evaluate(linearization, 0.0, m.q, m.v, NULL, &e), &e) ||
        !works(kt_modes_create(m.model, &modes, &e), &e) ||
        !works(kt_modes_evaluate(modes, kt_linearization_system(linearization), &e), &e))
        return false;
    tell(exercise, kt_modes_at(modes, 0).imaginary);
    kt_modes_free(modes);
    kt_linearization_free(linearization);
    close_mechanism(&m);
    return true;
}

/* A second of the stabilised pendulum: its distance from the rod's constraint, in position and in velocity. */
static bool stabilised(void) {
    mechanism m;
    kt_error e = {0};
    kt_dae *dae = NULL;
    kt_residual off = {0.0, 0.0};
    const kt_dae_options options = kt_dae_options_default(KT_DAE_GGL);
    if (!pendulum(&m, 1.0, 0.5) || !works(kt_dae_create(m.model, &options, &dae, &e), &e) ||
        !works(kt_dae_start(dae, 0.0, m.q, m.v, &e), &e))
        return false;
    for (int i = 0; i < 100; i++)
        if (!works(kt_dae_step(dae, 0.01, &e), &e))
            return false;
    if (!works(kt_dae_residual(dae, &off, &e), &e))
        return false;
    tell("8.6", off.position);
    tell("8.6.v", off.velocity);
    kt_dae_free(dae);
    close_mechanism(&m);
    return true;
}

/* Prints the error of a formulation's accelerations, compared with the pendulum's. */
static bool formulation(const char *exercise, kt_constraint_formulation_type type) {
    mechanism m;
    kt_error e = {0};
    double a[2];
    kt_constraint_formulation *f = NULL;
    const kt_constraint_formulation_options options = kt_constraint_formulation_options_default(type, 0.01);
    if (!pendulum(&m, 1.0, 0.5) || !works(kt_constraint_formulation_create(m.model, &options, &f, &e), &e) ||
        !works(kt_constraint_formulation_evaluate(f, m.data, 0.0, m.q, m.v, NULL, NULL, NULL, a, &e), &e))
        return false;
    tell(exercise, acceleration_error_of(a, 1.0, 0.5));
    kt_constraint_formulation_free(f);
    close_mechanism(&m);
    return true;
}

/* 8.38: eigenvalues that Baumgarte stabilisation adds to those of the hanging pendulum. The gains are 7 and 9. */
static bool spectrum(void) {
    mechanism m;
    kt_error e = {0};
    double re[4], im[4];
    kt_constraint_formulation *f = NULL;
    kt_constraint_formulation_options options =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_BAUMGARTE, 0.01);
    options.alpha = 7.0;
    options.beta = 9.0;
    if (!pendulum(&m, 0.0, 0.0) || !works(kt_constraint_formulation_create(m.model, &options, &f, &e), &e) ||
        !works(kt_constraint_formulation_spectrum(f, m.data, 0.0, m.q, m.v, re, im, &e), &e))
        return false;
    tell("8.38.own", fabs(im[0]));
    tell("8.38.real", re[3]);
    tell("8.38.imaginary", fabs(im[3]));
    kt_constraint_formulation_free(f);
    close_mechanism(&m);
    return true;
}

/* Example 8.1 with m1 = 0, whose position follows from the balance of the springs. The frequency w is found from the
 * motion of half a second, x2 = x2(0) cos(w t). */
static bool massless(void) {
    static const char text[] = "kinetree: 1\nbodies:\n  - {name: one, joint: {type: prismatic, axis: x}}\n"
                               "  - {name: two, joint: {type: prismatic, axis: x, position: 0.1}, mass: 8}\neffects:\n"
                               "  - {type: joint_spring, joint: one, stiffness: 100, rest: 0}\n"
                               "  - {type: bushing, between: [one, two], stiffness: [300, 0, 0, 0, 0, 0], "
                               "damping: [0, 0, 0, 0, 0, 0]}\n";
    mechanism m;
    kt_error e = {0};
    kt_simulation *simulation = NULL;
    kt_run run = kt_run_default();
    run.integrator = "dop853";
    run.relative = run.absolute = 1e-11;
    if (!open_mechanism(&m, text) || !works(kt_simulation_create(m.model, &run, NULL, &simulation, &e), &e) ||
        !works(kt_simulation_advance(simulation, 0.5, &e), &e))
        return false;
    tell("8.1X", acos(kt_simulation_positions(simulation)[1] / 0.1) / 0.5);
    kt_simulation_free(simulation);
    close_mechanism(&m);
    return true;
}

bool coordinates(void) {
    return minimal() && cross_horizontal() && projections() && masses("8.4", 1e-9, 100.0) && massless() &&
           masses("8.5", 1.0, 1e13) && dae_index_of("8.1", KT_DAE_INDEX1) && dae_index_of("8.2", KT_DAE_INDEX2) &&
           dae_index_of("8.3", KT_DAE_INDEX3) && stabilised() && spectrum() &&
           formulation("9.1", KT_CONSTRAINT_FORMULATION_AUGMENTED) &&
           formulation("9.2", KT_CONSTRAINT_FORMULATION_PROJECTION);
}
