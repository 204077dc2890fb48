/* A Furuta pendulum that is swung up and balanced; the controller gets all its parameters from the library's model.
 *
 *     embed-furuta [--csv FILE]
 *
 * The plant is a kt_simulation. The controller could run on the real device. Every 2 ms it reads two encoders
 * (quantised), estimates speeds from their filtered differences, and commands a torque. The torque is limited and
 * reaches the motor one sample later. After 8 s a force acts briefly on the pendulum's tip.
 *
 * Swing-up controls the energy. An acceleration s of the arm supplies the power -M12 theta' s to the pendulum. The
 * controller therefore chooses s = -k E M12 / M22 theta', with E the missing energy and M the mass matrix. A spring and
 * a damper term are subtracted, which keep the arm near its centre. The torque for s is
 *
 *     s M11 + theta'' M12 + h1,   theta'' M22 = -h2 - M12 s,
 *
 * with the bias force h. The library computes M and h at every sample. Reference: Astrom and Furuta 2000, Automatica
 * 36, 287-295.
 *
 * A linear quadratic regulator (lqr.h) balances the pendulum. Its model is linearised at the upright position, x' = A x
 * + B u. To compensate for the delay, the regulator predicts the state for the time when the torque reaches the motor.
 * The prediction is x + T (A x + B w), where w is the previous torque. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "lqr.h"

#include <kinetree/experimental.h>
#include <kinetree/kinetree.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { N = LQR_STATES }; /* angles of arm and pendulum, and their speeds */

static const double pi = 3.14159265358979323846;
static const double sample = 2e-3, duration = 12.0;                /* s */
static const double limit = 0.08;                                  /* N m, of the motor */
static const double count = 2.0 * 3.14159265358979323846 / 8192.0; /* rad, of the encoders */
static const double near = 0.4, lost = 0.7;                        /* rad from upright: balancing begins, ends */
static const double smoothing = 0.6;                               /* of the speeds: weight of the previous value */
static const double knock_time = 8.0, knock_length = 0.02, knock_force = 0.2; /* of the force on the tip: s, s, N */
static const double pump = 3000.0, fastest = 50.0; /* of the arm's acceleration in swing-up: 1/(J s), 1/s^2 */
static const double surplus = 0.2;                 /* of the energy, over m g l, for the loss to the arm's spring */
static const double centre[2] = {10.0, 2.0};       /* spring in s^-2 and damper in s^-1 of the arm */
static const double arm_length = 0.2, pendulum_length = 0.25; /* m */

/* All memory that the library uses after the compilation of the model; nothing else is allocated. */
static _Alignas(KT_ALIGNMENT) unsigned char plant_memory[32 * 1024], design_memory[32 * 1024], data_memory[8 * 1024];

static kt_status describe(kt_model **model, kt_error *error) {
    kt_body bodies[2] = {kt_body_default(), kt_body_default()};
    kt_body *arm = &bodies[0], *pendulum = &bodies[1];
    arm->name = "arm";
    arm->joint.type = KT_JOINT_REVOLUTE; /* about z, the default */
    arm->mass = 0.1;
    arm->shape.type = KT_SHAPE_ROD;
    arm->shape.to = kt_vec3_make(arm_length, 0.0, 0.0);
    arm->shape.radius = 0.005;
    arm->com_of_shape = arm->inertia_of_shape = true;

    pendulum->name = "pendulum"; /* upright at zero, hanging at the start */
    pendulum->parent = "arm";
    pendulum->joint.type = KT_JOINT_REVOLUTE;
    pendulum->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    pendulum->joint.at = kt_vec3_make(arm_length, 0.0, 0.0);
    pendulum->joint.position[0] = pi;
    pendulum->mass = 0.03;
    pendulum->shape = arm->shape;
    pendulum->shape.to = kt_vec3_make(0.0, 0.0, pendulum_length);
    pendulum->com_of_shape = pendulum->inertia_of_shape = true;

    kt_description furuta = kt_description_default();
    furuta.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    furuta.bodies = bodies;
    furuta.body_count = 2;
    return kt_model_compile(&furuta, NULL, model, error); /* the model keeps its own copy of the description */
}

/* ---- design: everything that the controller knows about the plant, computed from the model at start -------------- */

typedef struct controller {
    const kt_model *model;
    kt_data *data;
    lqr regulator;
    double inertia; /* of the pendulum about its joint, kg m^2 */
    double weight;  /* m g l of the pendulum, N m */
    double x[N];    /* angles, the pendulum's from upright (rad); filtered speeds (rad/s) */
    double waiting; /* N m, the last torque, which acts in the next sample */
    int is_balancing;
} controller;

static const double cost[N] = {1.0, 5.0, 0.02, 0.02}, price = 500.0; /* Q, diagonal, and r */

static kt_status find_design(controller *c, kt_error *error) {
    const kt_model *model = c->model;
    const int motor = kt_body_coordinates(model, kt_body_find(model, "arm")).v;
    const double upright[2] = {0.0, 0.0}, rest[2] = {0.0, 0.0};
    const kt_linearization_options options = {.inputs = &motor, .input_count = 1};
    kt_linearization *linearization = NULL;
    double mass[4];
    kt_status status =
        kt_linearization_init(model, &options, design_memory, sizeof design_memory, &linearization, error);
    if (status == KT_OK)
        status = kt_linearization_evaluate(linearization, 0.0, upright, rest, NULL, error);
    if (status == KT_OK)
        status = kt_dynamics_mass(model, c->data, upright, mass, error);
    if (status == KT_OK)
        status = kt_kinematics_update(model, c->data, upright, NULL, NULL, error);
    if (status != KT_OK)
        return status;
    const kt_linear_system *s = kt_linearization_system(linearization);
    c->inertia = mass[3];
    c->weight = kt_potential_energy(model, c->data); /* the arm's potential energy is zero */
    if (!lqr_find(&c->regulator, s->state, s->input, cost, price))
        return kt_error_set(error, KT_ERROR_SINGULAR, "design", "the Riccati equation has no solution");
    return KT_OK;
}

/* ---- controller: called once per sample, uses encoder counts only ------------------------------------------------ */

static double from_upright(double angle) { return remainder(angle, 2.0 * pi); }

static void read_sensors(controller *c, const double counts[2]) {
    for (int i = 0; i < 2; i++) {
        const double angle = i == 0 ? counts[0] * count : from_upright(counts[1] * count);
        const double speed = from_upright(angle - c->x[i]) / sample;
        c->x[2 + i] = smoothing * c->x[2 + i] + (1.0 - smoothing) * speed;
        c->x[i] = angle;
    }
}

static kt_status swing_up(const controller *c, double *u, kt_error *error) {
    double mass[4], bias[2];
    kt_status status = kt_dynamics_mass(c->model, c->data, c->x, mass, error);
    if (status == KT_OK)
        status = kt_dynamics_inverse(c->model, c->data, c->x, c->x + 2, NULL, NULL, bias, error);
    if (status != KT_OK)
        return status;
    const double lack = c->weight * (surplus + 1.0 - cos(c->x[1])) - 0.5 * c->inertia * c->x[3] * c->x[3];
    const double speed = c->x[3] + 1e-2; /* the offset starts the motion from rest */
    const double feed = fmax(-fastest, fmin(fastest, -pump * lack * speed * mass[1] / mass[3]));
    const double s = feed - centre[0] * c->x[0] - centre[1] * c->x[2];
    *u = mass[0] * s - mass[1] * (bias[1] + mass[1] * s) / mass[3] + bias[0];
    return KT_OK;
}

static double regulate(const controller *c) {
    const lqr *d = &c->regulator;
    double u = 0.0;
    for (int i = 0; i < N; i++) {
        double ahead = c->x[i] + sample * d->b[i] * c->waiting; /* c->waiting acts until the next sample */
        for (int j = 0; j < N; j++)
            ahead += sample * d->a[j * N + i] * c->x[j];
        u -= d->gain[i] * ahead;
    }
    return u;
}

/* Switches to balancing near the upright position, if the regulator's torque is within the limit, and back to swing-up
 * when the pendulum has fallen. */
static kt_status control(controller *c, const double counts[2], kt_error *error) {
    kt_status status = KT_OK;
    read_sensors(c, counts);
    double u = regulate(c);
    if (fabs(c->x[1]) > (c->is_balancing ? lost : near) || (!c->is_balancing && fabs(u) > limit)) {
        c->is_balancing = 0;
        status = swing_up(c, &u, error);
    } else {
        c->is_balancing = 1;
    }
    if (status == KT_OK)
        c->waiting = fmax(-limit, fmin(limit, u));
    return status;
}

/* ---- the experiment ---------------------------------------------------------------------------------------------- */

/* Force across the pendulum at its tip, as a wrench about the origin of the body frame, in world axes. */
static kt_wrench knock_on(const kt_model *model, const kt_data *data, int body) {
    const kt_mat3 axes = kt_body_pose(model, data, body).rotation;
    const kt_vec3 force = kt_vec3_scale(knock_force, axes.y);
    return (kt_wrench){kt_vec3_cross(kt_vec3_scale(pendulum_length, axes.z), force), force};
}

/* Time when the balancing first begins (s); largest torque (N m); largest angle from upright in the last 2 s (rad). */
typedef struct findings {
    double caught, most, late;
} findings;

/* One sample: reads the sensors of the plant, runs the controller, and advances the plant. */
static kt_status take_sample(kt_simulation *plant, controller *c, long k, FILE *csv, findings *f, kt_error *error) {
    const double t = (double)k * sample, torque[2] = {c->waiting, 0.0};
    const int pendulum = kt_body_find(c->model, "pendulum");
    kt_wrench wrenches[3] = {0};
    kt_record seen;
    kt_status status = kt_simulation_sense(plant, &seen, error);
    if (status != KT_OK)
        return status;
    const double counts[2] = {round(seen.q[0] / count), round(seen.q[1] / count)};
    if (t >= knock_time && t < knock_time + knock_length)
        wrenches[pendulum] = knock_on(c->model, seen.data, pendulum);
    if (csv != NULL)
        fprintf(csv, "%.9g,%.17g,%.17g,%.9g,%.9g,%.9g\n", t, seen.q[0], seen.q[1], seen.v[0], seen.v[1], torque[0]);
    f->late = t >= duration - 2.0 ? fmax(f->late, fabs(from_upright(seen.q[1]))) : f->late;
    f->most = fmax(f->most, fabs(torque[0]));
    status = control(c, counts, error);
    f->caught = c->is_balancing && isnan(f->caught) ? t : f->caught;
    if (status == KT_OK)
        status = kt_simulation_set_wrenches(plant, wrenches, error);
    if (status == KT_OK)
        status = kt_simulation_set_torque(plant, torque, error);
    return status == KT_OK ? kt_simulation_tick(plant, sample, error) : status;
}

int main(int argc, char **argv) {
    FILE *csv = argc == 3 && strcmp(argv[1], "--csv") == 0 ? fopen(argv[2], "w") : NULL;
    if (argc != 1 && csv == NULL) {
        fprintf(stderr, "usage: %s [--csv FILE], a file that can be written\n", argv[0]);
        return 2;
    }
    kt_error error;
    kt_model *model = NULL;
    kt_simulation *plant = NULL;
    kt_run fixed = kt_run_default();
    fixed.integrator = "rk4";
    fixed.step = 1e-3;
    fixed.record = KT_RECORD_POSITION | KT_RECORD_VELOCITY;
    kt_simulation_options options = kt_simulation_options_default();
    options.kinematics = true; /* for the direction of the force on the tip */
    controller c = {.x = {0.0, pi, 0.0, 0.0}};
    findings f = {.caught = (double)NAN};
    if (csv != NULL)
        fprintf(csv, "time,position.arm,position.pendulum,velocity.arm,velocity.pendulum,torque.motor\n");
    kt_status status = describe(&model, &error);
    c.model = model;
    if (status == KT_OK)
        status = kt_data_init(model, data_memory, sizeof data_memory, &c.data, &error);
    if (status == KT_OK)
        status = kt_simulation_init(model, &fixed, &options, plant_memory, sizeof plant_memory, &plant, &error);
    if (status == KT_OK)
        status = find_design(&c, &error);
    for (long k = 0; status == KT_OK && (double)k * sample < duration; k++)
        status = take_sample(plant, &c, k, csv, &f, &error);
    if (csv != NULL && fclose(csv) != 0 && status == KT_OK)
        status = kt_error_set(&error, KT_ERROR_FILE, argv[2], "cannot be written");
    if (status == KT_OK) {
        const lqr *d = &c.regulator;
        printf("gain: arm %.4f, pendulum %.4f N m/rad, speeds %.4f, %.4f N m s/rad; Riccati residual %.1e\n",
               d->gain[0], d->gain[1], d->gain[2], d->gain[3], d->residual);
        printf("caught after %.3f s, knocked at %.0f s; in the last 2 s within %.4f rad of upright\n", f.caught,
               knock_time, f.late);
        printf("largest torque %.4f N m of %.4f N m allowed\n", f.most, limit);
    } else {
        fprintf(stderr, "%s: %s\n", error.where, error.message);
    }
    kt_model_free(model);
    return status == KT_OK ? 0 : 1;
}
