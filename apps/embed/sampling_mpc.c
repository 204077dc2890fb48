/* Control by sampling: a cart-pole is swung up, a quadruped trots on the spot (sampling_robots.h). The controller needs
 * no derivatives and no linear model, only many simulations of possible sequences of inputs.
 *
 *     embed-sampling_mpc [--quadruped] [--seconds S] [--csv FILE]
 *
 * The method is model predictive path integral control. Every 20 ms, the planned inputs u[0..H-1] of the next samples
 * are perturbed K times by noise e_k. Each perturbed plan is simulated from the present state and gives a cost S_k. The
 * plan becomes
 *
 *     u <- u + sum_k w_k e_k,   w_k ~ exp(-(S_k - min S) / lambda),   sum_k w_k = 1.
 *
 * The first input is applied, and the plan is shifted by one sample. Reference: Williams, Aldrich, Theodorou 2017,
 * Journal of Guidance, Control, and Dynamics 40, 344-357.
 *
 * One model serves the plant and the planner. The plant is a simulation with steps of 1 ms. The planner is a batch of K
 * states with longer steps. All rollouts go forward together, several at once in the lanes of the processor's vectors.
 * Once per sample every state of the batch is set to the plant's.
 *
 * Nothing is allocated during the run. The noise comes from a short generator with a fixed seed. Every run therefore
 * gives the same bits, independently of the computing time of the rollouts. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sampling_robots.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Memory of the simulation and of the batch. */
static _Alignas(KT_ALIGNMENT) unsigned char plant_memory[64 * 1024], planner_memory[256 * 1024];
static _Alignas(KT_ALIGNMENT) unsigned char data_memory[64 * 1024], step_memory[128 * 1024]; /* for single rollouts */

/* ---- noise ------------------------------------------------------------------------------------------------------- */

/* Returns a uniform random number between 0 and 1, both excluded. Source: xorshift64* (Vigna 2016, ACM Trans. Math.
 * Software 42, 30). */
static double uniform(uint64_t *seed) {
    *seed ^= *seed >> 12;
    *seed ^= *seed << 25;
    *seed ^= *seed >> 27;
    return ((double)((*seed * UINT64_C(2685821657736338717)) >> 11) + 0.5) / 9007199254740992.0;
}

/* Standard normal random number (Box and Muller). */
static double normal(uint64_t *seed) {
    const double radius = sqrt(-2.0 * log(uniform(seed)));
    return radius * cos(2.0 * half_turn * uniform(seed));
}

/* ---- the controller ---------------------------------------------------------------------------------------------- */

typedef struct controller {
    const robot *robot;
    kt_batch *planner;
    double plan[HORIZON_MOST][INPUTS_MOST];
    double noise[ROLLOUTS_MOST][HORIZON_MOST][INPUTS_MOST];
    double cost[ROLLOUTS_MOST];
    uint64_t seed;
    double seconds; /* CPU time of the rollouts, s */
    long rollouts;
} controller;

static double limited_input(const robot *r, double input) { return fmax(-r->limit, fmin(r->limit, input)); }

/* The input u of rollout k in sample i, and the joint forces that it makes. */
static void force(const controller *c, int k, int i, double *u, double *torque) {
    const robot *r = c->robot;
    memset(torque, 0, COORDINATES_MOST * sizeof *torque);
    for (int j = 0; j < r->inputs; j++) {
        u[j] = limited_input(r, c->plan[i][j] + c->noise[k][i][j]);
        torque[r->first_driven + j] = r->gain * u[j];
    }
}

/* The share of one sample in the cost of a rollout. The cost is the mean over the samples, and the last sample has a
 * weight of its own. */
static double part_of_cost(const robot *r, int i, double t, const double *q, const double *v, const double *u) {
    return (i == r->horizon - 1 ? r->last : 1.0) * r->cost(t + (i + 1) * r->sample, q, v, u) / r->horizon;
}

/* One sample of all rollouts, which begin at t, under plan + noise; adds the costs of the states after it. */
static kt_status sample_all(controller *c, double t, int i, kt_error *error) {
    const robot *r = c->robot;
    kt_status status = KT_OK;
    double u[INPUTS_MOST], torque[COORDINATES_MOST], q[COORDINATES_MOST], v[COORDINATES_MOST];
    for (int k = 0; k < r->rollouts && status == KT_OK; k++) {
        force(c, k, i, u, torque);
        status = kt_batch_set_torque(c->planner, (size_t)k, torque, error);
    }
    if (status == KT_OK)
        status = kt_batch_compute(c->planner, &r->job, error);
    for (int k = 0; k < r->rollouts && status == KT_OK; k++) {
        force(c, k, i, u, torque);
        status = kt_batch_get_state(c->planner, (size_t)k, NULL, q, v, error);
        c->cost[k] += part_of_cost(r, i, t, q, v, u);
    }
    return status;
}

/* Simulates all rollouts from the state q, v at t. */
static kt_status roll_out(controller *c, double t, const double *q, const double *v, kt_error *error) {
    kt_status status = KT_OK;
    for (int k = 0; k < c->robot->rollouts && status == KT_OK; k++) {
        c->cost[k] = 0.0;
        status = kt_batch_set_state(c->planner, (size_t)k, 0.0, q, v, error);
    }
    for (int i = 0; i < c->robot->horizon && status == KT_OK; i++)
        status = sample_all(c, t, i, error);
    return status;
}

static double processor_time(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* The first rollout is the plan itself. */
static void draw_noise(controller *c) {
    const robot *r = c->robot;
    const double fresh = sqrt(1.0 - r->smooth * r->smooth) * r->spread;
    for (int k = 0; k < r->rollouts; k++)
        for (int i = 0; i < r->horizon; i++)
            for (int j = 0; j < r->inputs; j++)
                c->noise[k][i][j] =
                    (k > 0 ? fresh * normal(&c->seed) : 0.0) + (i > 0 ? r->smooth * c->noise[k][i - 1][j] : 0.0);
}

/* Adds the mean of the noise to the plan, weighted by the costs of the rollouts. */
static void improve_plan(controller *c) {
    const robot *r = c->robot;
    double least = (double)INFINITY, weights = 0.0, change[HORIZON_MOST][INPUTS_MOST] = {{0.0}};
    for (int k = 0; k < r->rollouts; k++)
        least = fmin(least, c->cost[k]);
    for (int k = 0; k < r->rollouts; k++) {
        const double weight = exp(-(c->cost[k] - least) / r->temperature);
        weights += weight;
        for (int i = 0; i < r->horizon; i++)
            for (int j = 0; j < r->inputs; j++)
                change[i][j] += weight * c->noise[k][i][j];
    }
    for (int i = 0; i < r->horizon; i++)
        for (int j = 0; j < r->inputs; j++)
            c->plan[i][j] = limited_input(r, c->plan[i][j] + change[i][j] / weights);
}

/* Computes the joint forces of the next sample from the state q, v at t. */
static kt_status control(controller *c, double t, const double *q, const double *v, double *torque, kt_error *error) {
    const robot *r = c->robot;
    const double start = processor_time();
    draw_noise(c);
    const kt_status status = roll_out(c, t, q, v, error);
    if (status != KT_OK)
        return status;
    improve_plan(c);
    for (int j = 0; j < r->inputs; j++)
        torque[r->first_driven + j] = r->gain * c->plan[0][j];
    memmove(c->plan, c->plan + 1, (size_t)(r->horizon - 1) * sizeof c->plan[0]);
    c->seconds += processor_time() - start;
    c->rollouts += r->rollouts;
    return KT_OK;
}

/* ---- the experiment ---------------------------------------------------------------------------------------------- */

static kt_status experiment(kt_simulation *plant, controller *c, FILE *csv, double worst[2], kt_error *error) {
    const robot *r = c->robot;
    kt_status status = KT_OK;
    const long samples = lround(r->duration / r->sample);
    for (long k = 0; k < samples && status == KT_OK; k++) {
        const double *q = kt_simulation_positions(plant), *v = kt_simulation_velocities(plant);
        const double t = (double)k * r->sample;
        double torque[COORDINATES_MOST] = {0.0};
        r->judge(r->duration - t, q, worst);
        status = control(c, t, q, v, torque, error);
        if (csv != NULL)
            r->write(csv, t, q, v, torque);
        if (status == KT_OK)
            status = kt_simulation_set_torque(plant, torque, error);
        if (status == KT_OK)
            status = kt_simulation_advance(plant, (double)(k + 1) * r->sample, error);
    }
    return status;
}

/* ---- one by one -------------------------------------------------------------------------------------------------- */

/* A sample of one state, as the batch computes it. */
static kt_status sample_alone(const robot *r, const kt_model *model, kt_data *data, double t, double *q, double *v,
                              const double *torque, kt_error *error) {
    const double h = r->job.h;
    kt_status status = KT_OK;
    for (int i = 0; i < r->job.steps && status == KT_OK; i++) {
        double a[COORDINATES_MOST];
        const kt_step step = {.method = kt_method_find("rk4"), .t = t + i * h, .h = h, .tau = torque};
        if (r->job.task == KT_BATCH_STEP) {
            status = kt_step_evaluate(model, data, step_memory, sizeof step_memory, &step, q, v, q, v, error);
            continue;
        }
        status = kt_acceleration_evaluate(model, data, t + i * h, q, v, torque, NULL, a, error);
        for (int j = 0; j < r->coordinates && status == KT_OK; j++) {
            v[j] += h * a[j];
            q[j] += h * v[j];
        }
    }
    return status;
}

/* The cost of rollout k from the state q, v at t, as roll_out adds it up. */
static kt_status roll_out_alone(const controller *c, const kt_model *model, kt_data *data, int k, double t,
                                const double *q, const double *v, kt_error *error) {
    const robot *r = c->robot;
    double x[COORDINATES_MOST], y[COORDINATES_MOST], u[INPUTS_MOST], torque[COORDINATES_MOST], cost = 0.0;
    kt_status status = KT_OK;
    memcpy(x, q, (size_t)r->coordinates * sizeof *x);
    memcpy(y, v, (size_t)r->coordinates * sizeof *y);
    for (int i = 0; i < r->horizon && status == KT_OK; i++) {
        force(c, k, i, u, torque);
        status = sample_alone(r, model, data, i * r->sample, x, y, torque, error);
        cost += part_of_cost(r, i, t, x, y, u);
    }
    if (status == KT_OK && !(cost == c->cost[k]))
        status = kt_error_set(error, KT_ERROR_STEP, "rollout", "it costs %.17g in a batch and %.17g alone", c->cost[k],
                              cost);
    return status;
}

/* All rollouts from the plant's state once more, as a batch and one by one: they must cost the same. Prints rollouts a
 * second. */
static kt_status compare_rollouts(controller *c, const kt_model *model, const kt_simulation *plant, kt_error *error) {
    const robot *r = c->robot;
    const double *q = kt_simulation_positions(plant), *v = kt_simulation_velocities(plant);
    const double t = kt_simulation_time(plant);
    kt_data *data = NULL;
    kt_status status = kt_data_init(model, data_memory, sizeof data_memory, &data, error);
    const double start = processor_time();
    if (status == KT_OK)
        status = roll_out(c, t, q, v, error);
    const double middle = processor_time();
    for (int k = 0; k < r->rollouts && status == KT_OK; k++)
        status = roll_out_alone(c, model, data, k, t, q, v, error);
    const double end = processor_time();
    if (status == KT_OK)
        printf("the same, rolled out once more: %.0f a second as a batch, %.0f one by one, with the same costs\n",
               r->rollouts / (middle - start), r->rollouts / (end - middle));
    return status;
}

/* ---- the program ------------------------------------------------------------------------------------------------- */

static kt_status run_controller(controller *c, FILE *csv, kt_error *error) {
    const robot *r = c->robot;
    double worst[2] = {0.0, 0.0};
    kt_model *model = NULL;
    kt_simulation *plant = NULL;
    kt_run fine = kt_run_default();
    kt_batch_options coarse = kt_batch_options_default();
    fine.integrator = "rk4";
    fine.step = 1e-3;
    coarse.states = (size_t)r->rollouts;
    coarse.method = kt_method_find("rk4");
    if (csv != NULL)
        fprintf(csv, "%s\n", r->columns);
    kt_status status = r->describe(&model, error);
    if (status == KT_OK)
        status = kt_simulation_init(model, &fine, NULL, plant_memory, sizeof plant_memory, &plant, error);
    if (status == KT_OK)
        status = kt_batch_init(model, &coarse, planner_memory, sizeof planner_memory, &c->planner, error);
    if (status == KT_OK)
        status = experiment(plant, c, csv, worst, error);
    if (status == KT_OK) {
        r->report(worst);
        printf("%ld rollouts of %d samples, %.0f rollouts a second of processor time; %d fit into a sample\n",
               c->rollouts, r->horizon, (double)c->rollouts / c->seconds,
               (int)((double)c->rollouts / c->seconds * r->sample));
        status = compare_rollouts(c, model, plant, error);
    }
    if (status == KT_OK)
        printf("%d rollouts take %zu bytes, %zu at once\n", r->rollouts, kt_batch_size(model, &coarse),
               kt_batch_report_of(c->planner).width);
    kt_model_free(model);
    return status;
}

int main(int argc, char **argv) {
    static robot chosen;
    static controller c = {.robot = &chosen, .seed = 1};
    double seconds = 0.0;
    const char *name = NULL;
    FILE *csv = NULL;
    chosen = cart_pole;
    for (int i = 1; i < argc; i++) {
        const char *value = i + 1 < argc ? argv[i + 1] : "";
        bool is_known = strcmp(argv[i], "--quadruped") == 0;
        if (is_known) {
            chosen = quadruped;
        } else if (strcmp(argv[i], "--seconds") == 0) {
            seconds = strtod(value, NULL);
            is_known = seconds > 0.0 && seconds < 1e6;
            i++;
        } else if (csv == NULL && strcmp(argv[i], "--csv") == 0) {
            csv = fopen(name = value, "w");
            is_known = csv != NULL;
            i++;
        }
        if (!is_known) {
            fprintf(stderr, "usage: %s [--quadruped] [--seconds S] [--csv FILE], a file that can be written\n",
                    argv[0]);
            return 2;
        }
    }
    if (seconds > 0.0)
        chosen.duration = seconds;
    kt_error error;
    kt_status status = run_controller(&c, csv, &error);
    if (csv != NULL && fclose(csv) != 0 && status == KT_OK)
        status = kt_error_set(&error, KT_ERROR_FILE, name, "cannot be written");
    if (status != KT_OK)
        fprintf(stderr, "%s: %s\n", error.where, error.message);
    return status == KT_OK ? 0 : 1;
}
