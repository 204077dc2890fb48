/* Computed torque control: a seven-axis arm follows a path by the library's inverse dynamics.
 *
 * Two controllers with the same gains, sensors and torque limits are compared at 1 kHz:
 *
 *     computed torque   tau = M(q) (a_d + Kp e + Kd de) + h(q, v)      one call of kt_dynamics_inverse
 *     PD                tau = D (Kp e + Kd de) + g(q)                  D: the diagonal of M in the middle of the path
 *
 * with e = q_d - q. If the model is exact, computed torque leaves e'' + Kd e' + Kp e = 0, seven decoupled joints. The
 * PD controller has the usual means of an industrial controller: gravity compensation and joint inertias. On a fast
 * path the coupling forces between the joints and the inertial forces of a_d disturb it.
 *
 * No model is exact. In the simulated arm the masses and inertias differ by some percent from those in the controllers'
 * model, upwards or downwards from body to body. The tool is heavier, and the joints have friction.
 *
 *     computed_torque [--error PERCENT] [--csv FILE]
 *
 * With --error 0 the arm equals the model. The remaining error comes from the zero-order hold of the torque, 1 ms.
 *
 * The arm is in arm.h. Reference: Siciliano, Sciavicco, Villani, Oriolo, Robotics (2009), 8.5.2, inverse dynamics
 * control. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "arm.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { JOINTS = ARM_JOINTS, TICKS = 6000, START = 1000 }; /* errors are evaluated from START on */

static const double tick = 1e-3, frequency = 25.0;                    /* s; rad/s, of the decoupled errors, damping 1 */
static const double limit[JOINTS] = {300, 300, 150, 150, 60, 40, 20}; /* N m */

/* Compiles the arm with masses and inertias changed by the factors 1 +- error, with joint friction if `friction`. */
static kt_status make_inexact_arm(double error, bool friction, kt_model **model, kt_error *fault) {
    static const double sign[ARM_BODIES] = {1, -1, 1, 1, -1, 1, -1, 1};
    double scale[ARM_BODIES];
    kt_effect effects[JOINTS];
    for (int i = 0; i < ARM_BODIES; i++)
        scale[i] = 1.0 + sign[i] * error;
    for (int i = 0; i < JOINTS; i++) {
        effects[i] = kt_effect_default();
        effects[i].type = KT_EFFECT_JOINT_FRICTION;
        effects[i].joint = arm_parts[i].name;
        effects[i].coulomb = 0.0005 * limit[i];
        effects[i].viscous = 0.0002 * limit[i];
        effects[i].smoothing = 0.01;
    }
    return arm_compile(scale, effects, friction ? JOINTS : 0, model, fault);
}

/* The path at t with its derivatives: each joint oscillates about its middle. The time of the oscillation starts with
 * rate zero, so that the arm starts at rest. */
static void oscillating_path(double t, double *q, double *v, double *a) {
    static const double middle[JOINTS] = {0.3, 0.6, -0.5, 1.4, 0.3, 0.9, 0.0};
    static const double width[JOINTS] = {0.6, 0.4, 0.5, 0.5, 0.8, 0.6, 1.0}, pace[JOINTS] = {2, 3, 2.5, 3.5, 3, 4, 5};
    const double slow = exp(-t / 0.3), clock = t - 0.3 * (1.0 - slow); /* s; its rate is 1 - slow */
    const double rate = 1.0 - slow, rise = slow / 0.3;
    for (int i = 0; i < JOINTS; i++) {
        const double s = sin(pace[i] * clock), c = cos(pace[i] * clock), w = width[i] * pace[i];
        q[i] = middle[i] + width[i] * s;
        v[i] = w * c * rate;
        a[i] = w * (c * rise - pace[i] * s * rate * rate);
    }
}

typedef struct controller {
    const kt_model *model; /* the controller's model of the arm */
    kt_data *data;
    double inertia[JOINTS]; /* the diagonal of M, kg m^2 */
    bool computed;          /* true: computed torque; false: PD */
} controller;

static kt_status start_controller(controller *c, kt_error *error) {
    double q[JOINTS], v[JOINTS], a[JOINTS], mass[JOINTS * JOINTS];
    oscillating_path(0.0, q, v, a);
    const kt_status status = kt_dynamics_mass(c->model, c->data, q, mass, error);
    for (int i = 0; i < JOINTS && status == KT_OK; i++)
        c->inertia[i] = mass[i * JOINTS + i];
    return status;
}

/* One control step: computes torques from joint positions and velocities. */
static kt_status control(controller *c, double t, const double *q, const double *v, double *tau, kt_error *error) {
    double q_d[JOINTS], v_d[JOINTS], a_d[JOINTS], u[JOINTS];
    oscillating_path(t, q_d, v_d, a_d);
    for (int i = 0; i < JOINTS; i++)
        u[i] = frequency * frequency * (q_d[i] - q[i]) + 2.0 * frequency * (v_d[i] - v[i]);
    kt_status status;
    if (c->computed) {
        for (int i = 0; i < JOINTS; i++)
            u[i] += a_d[i];
        status = kt_dynamics_inverse(c->model, c->data, q, v, u, NULL, tau, error); /* M u + h */
    } else {
        status = kt_dynamics_inverse(c->model, c->data, q, NULL, NULL, NULL, tau, error); /* g */
        for (int i = 0; i < JOINTS; i++)
            tau[i] += c->inertia[i] * u[i];
    }
    for (int i = 0; i < JOINTS; i++)
        tau[i] = fmin(fmax(tau[i], -limit[i]), limit[i]);
    return status;
}

typedef struct result {
    double rms, most, torque; /* root mean square and largest error, rad; largest torque over its limit */
    double error[TICKS / 10]; /* rad, norm over the joints, every 10 ms */
} result;

static kt_status follow_path_by_torque(controller *c, const kt_model *arm, result *r, kt_error *error) {
    kt_simulation *simulation = NULL;
    kt_run run = kt_run_default();
    double q[JOINTS], v[JOINTS], a[JOINTS], tau[JOINTS], sum = 0.0;
    run.integrator = "rk4";
    run.step = tick;
    run.duration = TICKS * tick;
    kt_status status = kt_simulation_create(arm, &run, NULL, &simulation, error);
    oscillating_path(0.0, q, v, a);
    if (status == KT_OK)
        status = kt_simulation_set_state(simulation, 0.0, q, v, error);
    *r = (result){0};
    for (int n = 0; n < TICKS && status == KT_OK; n++) {
        const double *at = kt_simulation_positions(simulation);
        double square = 0.0;
        oscillating_path(n * tick, q, v, a);
        for (int i = 0; i < JOINTS; i++)
            square += (q[i] - at[i]) * (q[i] - at[i]);
        if (n % 10 == 0)
            r->error[n / 10] = sqrt(square);
        if (n >= START) {
            sum += square;
            r->most = fmax(r->most, sqrt(square));
        }
        status = control(c, n * tick, at, kt_simulation_velocities(simulation), tau, error);
        for (int i = 0; i < JOINTS; i++)
            r->torque = fmax(r->torque, fabs(tau[i]) / limit[i]);
        if (status == KT_OK)
            status = kt_simulation_set_torque(simulation, tau, error);
        if (status == KT_OK)
            status = kt_simulation_tick(simulation, tick, error);
    }
    r->rms = sqrt(sum / (TICKS - START));
    kt_simulation_free(simulation);
    return status;
}

static kt_status compare_models(double percent, result results[2], kt_error *error) {
    kt_model *known = NULL, *arm = NULL;
    controller c = {.data = NULL};
    kt_status status = make_inexact_arm(0.0, false, &known, error);
    if (status == KT_OK)
        status = make_inexact_arm(0.01 * percent, percent > 0.0, &arm, error);
    if (status == KT_OK)
        status = kt_data_create(known, &c.data, error);
    c.model = known;
    if (status == KT_OK)
        status = start_controller(&c, error);
    for (int k = 0; k < 2 && status == KT_OK; k++) {
        c.computed = k == 1;
        status = follow_path_by_torque(&c, arm, &results[k], error);
    }
    kt_data_free(c.data);
    kt_model_free(arm);
    kt_model_free(known);
    return status;
}

int main(int argc, char **argv) {
    static result results[2];
    double percent = 8.0;
    FILE *csv = NULL;
    kt_error error = {0};
    for (int i = 1; i + 1 < argc; i += 2) {
        if (strcmp(argv[i], "--error") == 0)
            percent = strtod(argv[i + 1], NULL);
        else if (strcmp(argv[i], "--csv") == 0)
            csv = fopen(argv[i + 1], "w");
    }
    if (argc % 2 == 0 || !(percent >= 0.0 && percent < 50.0))
        return fprintf(stderr, "usage: computed_torque [--error PERCENT] [--csv FILE]\n"), 1;
    if (compare_models(percent, results, &error) != KT_OK)
        return fprintf(stderr, "computed_torque: %s: %s\n", error.where, error.message), 1;
    printf("seven-axis arm, 1 kHz, %g s, masses off by %g %%%s\n", TICKS * tick, percent,
           percent > 0.0 ? ", friction in the joints" : "");
    printf("PD:              rms %.3e rad, most %.3e rad, torques up to %.0f %% of their limits\n", results[0].rms,
           results[0].most, 100.0 * results[0].torque);
    printf("computed torque: rms %.3e rad, most %.3e rad, torques up to %.0f %% of their limits\n", results[1].rms,
           results[1].most, 100.0 * results[1].torque);
    printf("ratio of rms errors: %.1f\n", results[0].rms / results[1].rms);
    if (csv) {
        fprintf(csv, "time,error.PD,error.computed\n");
        for (int n = 0; n < TICKS / 10; n++)
            fprintf(csv, "%.2f,%.9g,%.9g\n", 0.01 * n, results[0].error[n], results[1].error[n]);
        fclose(csv);
    }
    return 0;
}
