/* SPDX-License-Identifier: Apache-2.0 */
#include "train.h"

#include <math.h>
#include <stdio.h>

static const double pi = 3.14159265358979324;

void train_open(train *t, int count, double mass, double stiffness, double damping) {
    static char name[TRAIN_MAX][8];
    kt_body body[TRAIN_MAX];
    kt_effect effect[TRAIN_MAX];
    *t = (train){count, mass, stiffness, damping, NULL};
    kt_description description = kt_description_of(body, count, NULL, 0, effect, count);
    for (int i = 0; i < count; i++) {
        snprintf(name[i], sizeof name[i], "w%d", i + 1);
        body[i] = kt_body_of(name[i], i > 0 ? name[i - 1] : NULL, KT_JOINT_PRISMATIC, mass);
        body[i].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
        effect[i] = kt_effect_of(KT_EFFECT_JOINT_SPRING, name[i]);
        effect[i].stiffness = stiffness;
        effect[i].damping = damping;
    }
    t->model = kt_test_model(&description, NULL);
}

static double angle(const train *t, int j) { return (2.0 * j - 1.0) * pi / (2.0 * t->count + 1.0); }

kt_complex train_eigenvalue(const train *t, int j) {
    const double s = 4.0 * pow(sin(0.5 * angle(t, j)), 2) / t->mass;
    const double half = 0.5 * s * t->damping, square = half * half - s * t->stiffness;
    const kt_complex swing = {-half, sqrt(fmax(-square, 0.0))}, creep = {-half - sqrt(fmax(square, 0.0)), 0.0};
    return square < 0.0 ? swing : creep;
}

void train_shape(const train *t, int j, double *q) {
    for (int i = 1; i <= t->count; i++)
        q[i - 1] = sin(i * angle(t, j)) - sin((i - 1) * angle(t, j));
}

static double energy(const train *t, const double *q, const double *v) {
    double sum = 0.0, speed = 0.0;
    for (int i = 0; i < t->count; i++) {
        speed += v[i];
        sum += 0.5 * t->mass * speed * speed + 0.5 * t->stiffness * q[i] * q[i];
    }
    return sum;
}

double train_growth(const train *t, const kt_method *method, double step, double duration, int j) {
    kt_run run = kt_run_default();
    kt_error error = {0};
    kt_simulation *simulation = NULL;
    double q[TRAIN_MAX] = {0.0}, v[TRAIN_MAX], other[TRAIN_MAX], most = 0.0;
    run.integrator = method->name;
    run.step = step;
    run.duration = duration;
    if (kt_simulation_create(t->model, &run, NULL, &simulation, &error) != KT_OK) {
        kt_check_text("made", error.message, "");
        return (double)NAN;
    }
    train_shape(t, j, v);
    for (int k = 1; k <= t->count; k++) {
        train_shape(t, k, other);
        for (int i = 0; i < t->count && k != j; i++)
            v[i] += 0.1 * other[i];
    }
    const double start = energy(t, q, v);
    kt_status status = kt_simulation_set_state(simulation, 0.0, q, v, &error);
    while (status == KT_OK && kt_simulation_time(simulation) < duration && most < 1e6 * start) {
        status = kt_simulation_step(simulation, HUGE_VAL, &error);
        most = fmax(most, energy(t, kt_simulation_positions(simulation), kt_simulation_velocities(simulation)));
    }
    kt_simulation_free(simulation);
    return status == KT_OK ? sqrt(most / start) : HUGE_VAL;
}
