/* A cart-pole swung up by sampling: the controller needs no derivatives and no linear model, only many simulations of
 * possible force sequences.
 *
 *     embed-sampling_mpc [--csv FILE]
 *
 * Model predictive path integral control (Williams, Aldrich, Theodorou 2017, Journal of Guidance, Control, and Dynamics
 * 40, 344-357): every 20 ms, the planned forces u[0..H-1] for the next 0.8 s are perturbed K times by noise e_k, each
 * perturbed plan is simulated from the present state and gives a cost S_k, and
 *     u <- u + sum_k w_k e_k,   w_k ~ exp(-(S_k - min S) / lambda),   sum_k w_k = 1.
 * The first force is applied, and the plan is shifted by one sample.
 *
 * One model serves the plant, a simulation with steps of 1 ms, and the planner, a batch of K states with steps of 20 ms:
 * all rollouts go forward together, several at once in the lanes of the processor's vectors. Once per sample every state
 * of the batch is set to the plant's. Nothing is allocated during the run, and the noise comes from a short generator
 * with a fixed seed, so that every run gives the same bits, independently of the computing time of the rollouts.
 */
#include <kinetree/kinetree.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

enum { HORIZON = 40, ROLLOUTS = 384, CART = 0, POLE = 1 };

static const double pi = 3.14159265358979323846;
static const double sample = 0.02, duration = 6.0; /* s */
static const double limit = 8.0;                   /* N, on the cart; the total weight is 9.8 N */
static const double rail = 1.0;                    /* m, to each side */
static const double spread = 1.5, smooth = 0.9;    /* of the noise: N; correlation from step to step */
static const double temperature = 0.02;            /* lambda */

/* Memory of the simulation and of the batch. */
static _Alignas(KT_ALIGNMENT) unsigned char plant_memory[16 * 1024], planner_memory[128 * 1024];
static _Alignas(KT_ALIGNMENT) unsigned char data_memory[16 * 1024], step_memory[32 * 1024]; /* for single rollouts */

static kt_status describe(kt_model **model, kt_error *error) {
    kt_body bodies[2] = {kt_body_default(), kt_body_default()};
    bodies[CART].name = "cart";
    bodies[CART].joint.type = KT_JOINT_PRISMATIC;
    bodies[CART].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    bodies[CART].mass = 0.8;

    bodies[POLE].name = "pole"; /* upright at zero, hanging at the start */
    bodies[POLE].parent = "cart";
    bodies[POLE].joint.type = KT_JOINT_REVOLUTE; /* about z; y is up */
    bodies[POLE].joint.position[0] = pi;
    bodies[POLE].mass = 0.2;
    bodies[POLE].shape.type = KT_SHAPE_ROD;
    bodies[POLE].shape.to = kt_vec3_make(0.0, 0.6, 0.0);
    bodies[POLE].com_of_shape = bodies[POLE].inertia_of_shape = true;

    kt_description cart_pole = kt_description_default();
    cart_pole.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    cart_pole.bodies = bodies;
    cart_pole.body_count = 2;
    return kt_model_compile(&cart_pole, NULL, model, error);
}

/* ---- noise ------------------------------------------------------------------------------------------------------- */

/* Uniform random number in (0, 1): xorshift64* (Vigna 2016, ACM Trans. Math. Software 42, 30). */
static double uniform(uint64_t *seed) {
    *seed ^= *seed >> 12;
    *seed ^= *seed << 25;
    *seed ^= *seed >> 27;
    return ((double)((*seed * UINT64_C(2685821657736338717)) >> 11) + 0.5) / 9007199254740992.0;
}

/* Standard normal random number (Box and Muller). */
static double normal(uint64_t *seed) {
    const double radius = sqrt(-2.0 * log(uniform(seed)));
    return radius * cos(2.0 * pi * uniform(seed));
}

static double limited(double force) { return fmax(-limit, fmin(limit, force)); }

/* ---- the controller ---------------------------------------------------------------------------------------------- */

typedef struct controller {
    kt_batch *planner;
    double plan[HORIZON];
    double noise[ROLLOUTS][HORIZON];
    double cost[ROLLOUTS];
    uint64_t seed;
    double seconds; /* CPU time of the rollouts, s */
    long rollouts;
} controller;

static double cost_of(const double *q, const double *v, double force) {
    const double beyond = fmax(0.0, fabs(q[CART]) - 0.8 * rail);
    return 6.0 * (1.0 - cos(q[POLE])) + 0.06 * v[POLE] * v[POLE] + 1.0 * q[CART] * q[CART] + 0.1 * v[CART] * v[CART] +
           400.0 * beyond * beyond + 1e-3 * force * force;
}

/* One step of all rollouts, under plan + noise; adds the costs of the states after it. */
static kt_status step_all(controller *c, int i, kt_error *error) {
    kt_status status = KT_OK;
    double torque[ROLLOUTS][2];
    for (size_t k = 0; k < ROLLOUTS && status == KT_OK; k++) {
        torque[k][CART] = limited(c->plan[i] + c->noise[k][i]);
        torque[k][POLE] = 0.0;
        status = kt_batch_set_torque(c->planner, k, torque[k], error);
    }
    if (status == KT_OK)
        status = kt_batch_step(c->planner, sample, 1, error);
    for (size_t k = 0; k < ROLLOUTS && status == KT_OK; k++) {
        double q[2], v[2];
        status = kt_batch_get_state(c->planner, k, NULL, q, v, error);
        c->cost[k] += (i == HORIZON - 1 ? 10.0 : 1.0) * cost_of(q, v, torque[k][CART]) / HORIZON;
    }
    return status;
}

/* Simulates all rollouts from the state q, v. The cost of one is the mean of those of its steps, in which the last step
 * counts ten times. */
static kt_status roll_out(controller *c, const double *q, const double *v, kt_error *error) {
    kt_status status = KT_OK;
    for (size_t k = 0; k < ROLLOUTS && status == KT_OK; k++) {
        c->cost[k] = 0.0;
        status = kt_batch_set_state(c->planner, k, 0.0, q, v, error);
    }
    for (int i = 0; i < HORIZON && status == KT_OK; i++)
        status = step_all(c, i, error);
    return status;
}

static double processor_time(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Computes the force for the next sample from the state q, v. */
static kt_status control(controller *c, const double *q, const double *v, double *force, kt_error *error) {
    const double start = processor_time();
    double least = (double)INFINITY, weights = 0.0, change[HORIZON] = {0.0};
    for (int k = 0; k < ROLLOUTS; k++)
        for (int i = 0; i < HORIZON; i++) /* the first rollout is the plan itself */
            c->noise[k][i] = (k > 0 ? sqrt(1.0 - smooth * smooth) * spread * normal(&c->seed) : 0.0) +
                             (i > 0 ? smooth * c->noise[k][i - 1] : 0.0);
    const kt_status status = roll_out(c, q, v, error);
    if (status != KT_OK)
        return status;
    for (int k = 0; k < ROLLOUTS; k++)
        least = fmin(least, c->cost[k]);
    for (int k = 0; k < ROLLOUTS; k++) {
        const double weight = exp(-(c->cost[k] - least) / temperature);
        weights += weight;
        for (int i = 0; i < HORIZON; i++)
            change[i] += weight * c->noise[k][i];
    }
    for (int i = 0; i < HORIZON; i++)
        c->plan[i] = limited(c->plan[i] + change[i] / weights);
    *force = c->plan[0];
    memmove(c->plan, c->plan + 1, (HORIZON - 1) * sizeof c->plan[0]);
    c->seconds += processor_time() - start;
    c->rollouts += ROLLOUTS;
    return KT_OK;
}

/* ---- the experiment ---------------------------------------------------------------------------------------------- */

static kt_status experiment(kt_simulation *plant, controller *c, FILE *csv, double *late, double *far,
                            kt_error *error) {
    kt_status status = KT_OK;
    const long samples = lround(duration / sample);
    for (long k = 0; k < samples && status == KT_OK; k++) {
        const double *q = kt_simulation_positions(plant), *v = kt_simulation_velocities(plant);
        const double t = (double)k * sample;
        double torque[2] = {0.0, 0.0};
        *far = fmax(*far, fabs(q[CART]));
        if (t >= duration - 1.0)
            *late = fmax(*late, fabs(remainder(q[POLE], 2.0 * pi)));
        status = control(c, q, v, &torque[CART], error);
        if (csv != NULL)
            fprintf(csv, "%.9g,%.17g,%.17g,%.17g,%.17g,%.17g\n", t, q[CART], q[POLE], v[CART], v[POLE], torque[CART]);
        if (status == KT_OK)
            status = kt_simulation_set_torque(plant, torque, error);
        if (status == KT_OK)
            status = kt_simulation_advance(plant, (double)(k + 1) * sample, error);
    }
    return status;
}

/* ---- one by one -------------------------------------------------------------------------------------------------- */

/* The cost of one rollout from the state q, v, as step_all adds it up. */
static kt_status roll_out_alone(const controller *c, const kt_model *model, kt_data *data, int k, const double *q,
                                const double *v, double *cost, kt_error *error) {
    double x[2] = {q[CART], q[POLE]}, u[2] = {v[CART], v[POLE]};
    kt_status status = KT_OK;
    *cost = 0.0;
    for (int i = 0; i < HORIZON && status == KT_OK; i++) {
        const double torque[2] = {limited(c->plan[i] + c->noise[k][i]), 0.0};
        const kt_step step = {.method = kt_method_find("rk4"), .t = (double)i * sample, .h = sample, .tau = torque};
        status = kt_step_evaluate(model, data, step_memory, sizeof step_memory, &step, x, u, x, u, error);
        *cost += (i == HORIZON - 1 ? 10.0 : 1.0) * cost_of(x, u, torque[CART]) / HORIZON;
    }
    return status;
}

/* All rollouts from one state once more, as a batch and one by one: they must cost the same. Writes rollouts a second. */
static kt_status compare(controller *c, const kt_model *model, const double *q, const double *v, double *together,
                         double *alone, kt_error *error) {
    kt_data *data = NULL;
    kt_status status = kt_data_init(model, data_memory, sizeof data_memory, &data, error);
    double clock = processor_time();
    if (status == KT_OK)
        status = roll_out(c, q, v, error);
    *together = ROLLOUTS / (processor_time() - clock);
    clock = processor_time();
    for (int k = 0; k < ROLLOUTS && status == KT_OK; k++) {
        double cost;
        status = roll_out_alone(c, model, data, k, q, v, &cost, error);
        if (status == KT_OK && cost != c->cost[k])
            status = kt_error_set(error, KT_ERROR_STEP, "rollout", "it costs %.17g in a batch and %.17g alone",
                                  c->cost[k], cost);
    }
    *alone = ROLLOUTS / (processor_time() - clock);
    return status;
}

int main(int argc, char **argv) {
    FILE *csv = argc == 3 && strcmp(argv[1], "--csv") == 0 ? fopen(argv[2], "w") : NULL;
    if (argc != 1 && csv == NULL) {
        fprintf(stderr, "usage: %s [--csv FILE], a file that can be written\n", argv[0]);
        return 2;
    }
    static controller c = {.seed = 1};
    kt_error error;
    kt_model *model = NULL;
    kt_simulation *plant = NULL;
    kt_run fine = kt_run_default();
    kt_batch_options coarse = kt_batch_options_default();
    double late = 0.0, far = 0.0, together = 0.0, alone = 0.0;
    fine.integrator = "rk4";
    fine.step = 1e-3;
    coarse.states = ROLLOUTS;
    coarse.method = kt_method_find("rk4");
    if (csv != NULL)
        fprintf(csv, "time,position.cart,position.pole,velocity.cart,velocity.pole,torque.cart\n");
    kt_status status = describe(&model, &error);
    if (status == KT_OK)
        status = kt_simulation_init(model, &fine, NULL, plant_memory, sizeof plant_memory, &plant, &error);
    if (status == KT_OK)
        status = kt_batch_init(model, &coarse, planner_memory, sizeof planner_memory, &c.planner, &error);
    if (status == KT_OK)
        status = experiment(plant, &c, csv, &late, &far, &error);
    if (status == KT_OK)
        status = compare(&c, model, kt_simulation_positions(plant), kt_simulation_velocities(plant), &together, &alone,
                         &error);
    if (csv != NULL && fclose(csv) != 0 && status == KT_OK)
        status = kt_error_set(&error, KT_ERROR_FILE, argv[2], "cannot be written");
    if (status == KT_OK) {
        printf("in the last second within %.4f rad of upright; cart never further than %.3f m out\n", late, far);
        printf("%ld rollouts of %d steps, %.0f rollouts a second of processor time; %d fit into a sample\n", c.rollouts,
               HORIZON, (double)c.rollouts / c.seconds, (int)((double)c.rollouts / c.seconds * sample));
        printf("the same, rolled out once more: %.0f a second as a batch, %.0f one by one, with the same costs\n",
               together, alone);
        printf("%d rollouts take %zu bytes, %zu at once\n", ROLLOUTS, kt_batch_size(model, &coarse),
               kt_batch_report_of(c.planner).width);
    } else {
        fprintf(stderr, "%s: %s\n", error.where, error.message);
    }
    kt_model_free(model);
    return status == KT_OK ? 0 : 1;
}
