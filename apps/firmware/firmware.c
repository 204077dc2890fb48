/* Computed torque control as firmware: runs without an operating system, and gives the same bits on every processor.
 *
 * The model of a seven-axis arm (embed/arm.h; embed/computed_torque.c explains the control law) is compiled on the
 * device at start-up. Then, every millisecond,
 *
 *     tau = M(q) (a_d + Kp (q_d - q) + Kd (v_d - v)) + h(q, v)      one call of kt_dynamics_inverse
 *
 * The plant, an arm that is 10 % heavier, is simulated in the same program (classical Runge-Kutta steps of 1 ms). After
 * STEPS ticks the program prints the positions as the bits of their doubles, and a hash of the torques and states of
 * all ticks. The output is the same on x86-64 and on a Cortex-M7. The library computes trigonometric and all other
 * functions itself, in a fixed order of operations. For the same reason the path is a polynomial: sin and exp of two C
 * libraries may differ in the last bits.
 *
 * Then a mass swings on a spring and touches a stop for some milliseconds, computed with adaptive steps. The integrator
 * follows distances from stops between stages; otherwise no stage would meet the stop. The velocity after one period,
 * which is zero, is printed. */
#include "../embed/arm.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { JOINTS = ARM_JOINTS, STEPS = 500 };

static const double tick = 1e-3, frequency = 25.0; /* s; rad/s, of the decoupled errors, damping 1 */

/* The path at t, in half a second from rest to rest:
 *
 *     q = from + s (to - from),  s = 10 x^3 - 15 x^4 + 6 x^5,  x = t / 0.5 s */
static void path_at_rest(double t, double *q, double *v, double *a) {
    static const double from[JOINTS] = {0.3, 0.6, -0.5, 1.4, 0.3, 0.9, 0.0};
    static const double to[JOINTS] = {0.9, 0.2, 0.1, 0.9, -0.5, 1.5, 1.0};
    const double time = STEPS * tick, x = t / time;
    const double s = x * x * x * (10.0 + x * (-15.0 + 6.0 * x)), rate = 30.0 * x * x * (1.0 + x * (x - 2.0)) / time;
    const double second = 60.0 * x * (1.0 + x * (2.0 * x - 3.0)) / (time * time);
    for (int i = 0; i < JOINTS; i++) {
        q[i] = from[i] + s * (to[i] - from[i]);
        v[i] = rate * (to[i] - from[i]);
        a[i] = second * (to[i] - from[i]);
    }
}

/* One control step: computes torques from joint positions and velocities. */
static kt_status control(const kt_model *model, kt_data *data, double t, const double *q, const double *v, double *tau,
                         kt_error *error) {
    double q_d[JOINTS], v_d[JOINTS], u[JOINTS];
    path_at_rest(t, q_d, v_d, u);
    for (int i = 0; i < JOINTS; i++)
        u[i] += frequency * frequency * (q_d[i] - q[i]) + 2.0 * frequency * (v_d[i] - v[i]);
    return kt_dynamics_inverse(model, data, q, v, u, NULL, tau, error); /* M u + h */
}

static uint64_t bits_of(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* FNV-1a hash, applied to whole doubles instead of bytes. */
static uint64_t hash_doubles(uint64_t so_far, const double *x, int count) {
    for (int i = 0; i < count; i++)
        so_far = (so_far ^ bits_of(x[i])) * UINT64_C(1099511628211);
    return so_far;
}

/* Writes a text without a stream: those of newlib take 5 kB. */
static void put_line_text(const char *text) {
    size_t left = strlen(text);
    for (ssize_t n = 1; left > 0 && n > 0; left -= n > 0 ? (size_t)n : 0, text += n > 0 ? n : 0)
        n = write(STDOUT_FILENO, text, left);
}

static void print_bits(const char *name, uint64_t bits) {
    char line[64];
    snprintf(line, sizeof line, "%.40s %08" PRIx32 "%08" PRIx32 "\n", name, (uint32_t)(bits >> 32), (uint32_t)bits);
    put_line_text(line);
}

static kt_status follow_plant(const kt_model *known, kt_data *data, kt_simulation *plant, kt_error *error) {
    double q[JOINTS], v[JOINTS], tau[JOINTS];
    uint64_t seen = UINT64_C(14695981039346656037);
    path_at_rest(0.0, q, v, tau);
    kt_status status = kt_simulation_set_state(plant, 0.0, q, v, error);
    for (int n = 0; n < STEPS && status == KT_OK; n++) {
        status =
            control(known, data, n * tick, kt_simulation_positions(plant), kt_simulation_velocities(plant), tau, error);
        if (status == KT_OK)
            status = kt_simulation_set_torque(plant, tau, error);
        if (status == KT_OK)
            status = kt_simulation_advance(plant, (n + 1) * tick, error);
        seen = hash_doubles(seen, tau, JOINTS);
        seen = hash_doubles(seen, kt_simulation_positions(plant), JOINTS);
        seen = hash_doubles(seen, kt_simulation_velocities(plant), JOINTS);
    }
    for (int i = 0; i < JOINTS && status == KT_OK; i++)
        print_bits(arm_parts[i].name, bits_of(kt_simulation_positions(plant)[i]));
    if (status == KT_OK)
        print_bits("all", seen);
    return status;
}

/* Compiles the arm with all masses and inertias times `scale`. */
static kt_status make_scaled_plant(double scale, kt_model **model, kt_error *error) {
    double scales[ARM_BODIES];
    for (int i = 0; i < ARM_BODIES; i++)
        scales[i] = scale;
    return arm_compile(scales, NULL, 0, model, error);
}

/* A mass of 1 kg on a spring of 1 N/m swings 0.1 mm further than to its stop. The stop has 1e5 N/m. The motion is
 * computed in space, as a small library computes all trees; on this machine it would be computed in a plane. */
static kt_status swing(kt_error *error) {
    static const double period = 6.2521314478124665; /* two harmonic motions in turn */
    kt_body body = kt_body_default();
    kt_effect effects[2] = {kt_effect_default(), kt_effect_default()};
    kt_description description = kt_description_default();
    kt_run run = kt_run_default();
    kt_model_options options = kt_model_options_default();
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    body.name = effects[0].joint = effects[1].joint = "mass";
    body.joint.type = KT_JOINT_PRISMATIC;
    body.joint.position[0] = 0.5001;
    body.mass = 1.0;
    effects[0].type = KT_EFFECT_JOINT_SPRING;
    effects[0].stiffness = 1.0;
    effects[1].type = KT_EFFECT_JOINT_LIMIT;
    effects[1].stiffness = 1e5;
    effects[1].lower = -0.5;
    description.bodies = &body;
    description.body_count = 1;
    description.effects = effects;
    description.effect_count = 2;
    run.relative = run.absolute = 1e-5;
    run.duration = period;
    options.plan = KT_PLAN_SPATIAL;
    kt_status status = kt_model_compile(&description, &options, &model, error);
    if (status == KT_OK)
        status = kt_simulation_create(model, &run, NULL, &simulation, error);
    if (status == KT_OK)
        status = kt_simulation_advance(simulation, period, error);
    if (status == KT_OK)
        print_bits("swing", bits_of(kt_simulation_velocities(simulation)[0]));
    kt_simulation_free(simulation);
    kt_model_free(model);
    return status;
}

int main(void) {
    kt_model *known = NULL, *arm = NULL;
    kt_data *data = NULL;
    kt_simulation *plant = NULL;
    kt_error error = {0};
    kt_run run = kt_run_default();
    run.integrator = "rk4";
    run.step = tick;
    run.duration = STEPS * tick;
    kt_status status = make_scaled_plant(1.0, &known, &error);
    if (status == KT_OK)
        status = make_scaled_plant(1.1, &arm, &error);
    if (status == KT_OK)
        status = kt_data_create(known, &data, &error);
    if (status == KT_OK)
        status = kt_simulation_create(arm, &run, NULL, &plant, &error);
    if (status == KT_OK)
        status = follow_plant(known, data, plant, &error);
    if (status == KT_OK)
        status = swing(&error);
    if (status != KT_OK) {
        put_line_text(error.where);
        put_line_text(": ");
        put_line_text(error.message);
        put_line_text("\n");
    }
    kt_simulation_free(plant);
    kt_data_free(data);
    kt_model_free(arm);
    kt_model_free(known);
    return status == KT_OK ? 0 : 1;
}
