/* Swing-ups by optimal control: iLQR with the exact derivatives of steps, of a cart-pole and of a leg with a closed
 * loop. The inputs u_k, held during the steps k = 0 .. N - 1 of the motion x_{k+1} = f(x_k, u_k), are to minimise
 *     sum_k effort / 2 |u_k|^2 + 1/2 sum_i (w_i e_i^2 + s_i v_i^2),   e = q_N - goal
 * 1. A_k and B_k of all steps by kt_step_derivatives; those of the leg go through its loop and the projection onto it.
 * 2. Backward pass, with the gradient p and the second derivatives P of the cost to go, D = [A B], H = D'PD, g = D'p,
 *        Qu = effort u + g_u,  Quu = effort + mu + H_uu,  Qux = H_ux,  k = -Quu^-1 Qu,  K = -Quu^-1 Qux
 *        p <- g_x + Qux'k,  P <- H_xx + Qux'K
 * 3. The motion again under u_k + s k_k + K_k dx_k, the step length s halved until the cost falls; and so on from 1.
 * (Li, Todorov, Iterative linear quadratic regulator design for nonlinear biological movement systems, ICINCO 2004.)
 * Two checks follow. The gradient with respect to all inputs by kt_rollout_gradient must vanish; it shares nothing with
 * the backward pass. A simulation by another method, with an adaptive step, must reach the goal under the same
 * inputs. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <kinetree/kinetree.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { N_MAX = 4, M_MAX = 2, X_MAX = 2 * N_MAX, STEPS = 100, ITERATIONS_MAX = 400 };

typedef struct task {
    const char *name;
    const kt_model *model;
    kt_data *data;
    int n, m, input[M_MAX]; /* coordinates; which of them are driven */
    double h, goal[N_MAX], w[N_MAX], s[N_MAX], effort;
    double q[STEPS + 1][N_MAX], v[STEPS + 1][N_MAX], tau[STEPS * N_MAX], cost;
} task;

static double A[STEPS][X_MAX * X_MAX], B[STEPS][X_MAX * N_MAX];
static double feed[STEPS][M_MAX], gain[STEPS][M_MAX][X_MAX];
static _Alignas(KT_ALIGNMENT) char work[1 << 18]; /* of steps and gradients; the library rejects too small a buffer */
static kt_error error;

static void must(kt_status status) {
    if (status != KT_OK)
        exit((fprintf(stderr, "%s: %s\n", error.where, error.message), 1));
}

static kt_body rod(const char *name, const char *parent, kt_vec3 at, kt_vec3 to, double mass, double angle) {
    kt_body body = kt_body_default();
    body.name = name, body.parent = parent;
    body.joint.type = KT_JOINT_REVOLUTE; /* about z; y is up */
    body.joint.at = at;
    body.joint.position[0] = angle;
    body.mass = mass;
    body.shape.type = KT_SHAPE_ROD, body.shape.to = to;
    body.com_of_shape = body.inertia_of_shape = true;
    return body;
}

static kt_model *compile_bodies(const kt_body *bodies, int count, const kt_loop *loop) {
    static const char *const held[] = {"thigh", "crank"}; /* the loop is closed by the other joints */
    kt_model *model = NULL;
    kt_description d = kt_description_default();
    d.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    d.bodies = bodies, d.body_count = count;
    d.loops = loop, d.loop_count = loop ? 1 : 0;
    d.hold = held, d.hold_count = loop ? 2 : 0;
    must(kt_model_compile(&d, NULL, &model, &error));
    return model;
}

static kt_model *make_cart_pole(void) {
    const kt_vec3 pin = {0.0, 0.0, 0.0}, down = {0.0, -1.0, 0.0}, along = {1.0, 0.0, 0.0};
    kt_body bodies[2] = {rod("cart", NULL, pin, along, 1.0, 0.0), rod("pole", "cart", pin, down, 0.5, 0.0)};
    bodies[0].joint.type = KT_JOINT_PRISMATIC;
    bodies[0].joint.axis = along;
    return compile_bodies(bodies, 2, NULL);
}

/* Thigh and crank are driven at the hip; the crank bends the knee through a rod that is pinned to the shank. */
static kt_model *make_leg(void) {
    const kt_vec3 hip = {0.0, 0.0, 0.0}, down = {0.0, -0.4, 0.0}, end = {-0.07, 0.0, 0.0};
    const kt_body bodies[4] = {rod("thigh", NULL, hip, down, 3.0, 0.0), rod("crank", "thigh", hip, end, 0.3, 0.0),
                               rod("rod", "crank", end, down, 0.3, 0.05), rod("shank", "thigh", down, down, 1.5, -0.9)};
    kt_loop pin = kt_loop_default();
    pin.name = "pin", pin.type = KT_LOOP_REVOLUTE;
    pin.between[0].body = "rod", pin.between[0].at = down;
    pin.between[1].body = "shank", pin.between[1].at = kt_vec3_make(-0.031, -0.039, 0.0);
    return compile_bodies(bodies, 4, &pin);
}

static int cost_at(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user) {
    const task *t = user;
    for (int i = 0; i < t->n; i++) {
        const double u = at->tau ? at->tau[i] : 0.0, e = at->q[i] - t->goal[i];
        *value += 0.5 * (at->tau ? t->effort * u * u : t->w[i] * e * e + t->s[i] * at->v[i] * at->v[i]);
        if (by_tau)
            by_tau[i] = t->effort * u;
        if (by_state && !at->tau) { /* the last state */
            by_state[i] = t->w[i] * e;
            by_state[t->n + i] = t->s[i] * at->v[i];
        }
    }
    return 0;
}

static kt_step task_step_at(const task *t, int k) {
    return (kt_step){.method = kt_method_find("rk4"), .t = k * t->h, .h = t->h, .tau = t->tau + k * t->n};
}

/* Runs the motion under the inputs of `from`, changed by length * feed + gain dx (a negative length: not changed).
 * Returns false where it fails, as it may if the inputs are huge. */
static bool move_under_inputs(task *t, const task *from, double length) {
    t->cost = 0.0;
    for (int k = 0; k <= STEPS; k++) {
        double *tau = k < STEPS ? t->tau + k * t->n : NULL;
        const kt_cost_point at = {.step = k, .t = k * t->h, .q = t->q[k], .v = t->v[k], .tau = tau};
        for (int a = 0; a < t->m && tau && length >= 0.0; a++) {
            double *u = &tau[t->input[a]];
            *u = from->tau[k * t->n + t->input[a]] + length * feed[k][a];
            for (int i = 0; i < t->n; i++)
                *u +=
                    gain[k][a][i] * (t->q[k][i] - from->q[k][i]) + gain[k][a][t->n + i] * (t->v[k][i] - from->v[k][i]);
        }
        (void)cost_at(&at, &t->cost, NULL, NULL, t);
        const kt_step step = task_step_at(t, k);
        if (tau && kt_step_evaluate(t->model, t->data, work, sizeof work, &step, t->q[k], t->v[k], t->q[k + 1],
                                    t->v[k + 1], &error) != KT_OK)
            return false;
    }
    return true;
}

static double dot_of(const double *a, const double *b, int n) {
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* Fills feed and gain; false where the regularisation mu is too small. Column X of P is p, column X of K is k. */
static bool backward(const task *t, double mu) {
    const int X = 2 * t->n, m = t->m;
    double P[X_MAX + 1][X_MAX] = {{0.0}}, PD[X_MAX], H[X_MAX + M_MAX][X_MAX + M_MAX + 1], value = 0.0;
    const kt_cost_point end = {.step = STEPS, .q = t->q[STEPS], .v = t->v[STEPS]};
    (void)cost_at(&end, &value, P[X], NULL, (void *)t);
    for (int i = 0; i < X; i++)
        P[i][i] = i < t->n ? t->w[i] : t->s[i - t->n];
    for (int k = STEPS - 1; k >= 0; k--) {
        double Quu[M_MAX][M_MAX] = {{1.0, 0.0}, {0.0, 1.0}}, K[X_MAX + 1][M_MAX] = {{0.0}};
        const double *D[X_MAX + M_MAX];
        for (int j = 0; j < X + m; j++)
            D[j] = j < X ? A[k] + X * j : B[k] + X * t->input[j - X];
        for (int j = 0; j < X + m; j++) {
            for (int i = 0; i < X; i++)
                PD[i] = dot_of(P[i], D[j], X);
            for (int i = 0; i < X + m; i++)
                H[i][j < X ? j : j + 1] = dot_of(D[i], PD, X);
            H[j][X] = dot_of(D[j], P[X], X) + (j < X ? 0.0 : t->effort * t->tau[k * t->n + t->input[j - X]]);
        }
        for (int a = 0; a < m * m; a++)
            Quu[a / m][a % m] = H[X + a / m][X + 1 + a % m] + (a / m == a % m ? t->effort + mu : 0.0);
        const double determinant = Quu[0][0] * Quu[1][1] - Quu[0][1] * Quu[1][0];
        if (!(Quu[0][0] > 0.0 && determinant > 0.0))
            return false;
        for (int j = 0; j <= X; j++) { /* K = -Quu^-1 H, m is 1 or 2 */
            const double h0 = H[X][j], h1 = m == 2 ? H[X + 1][j] : 0.0;
            K[j][0] = (Quu[0][1] * h1 - Quu[1][1] * h0) / determinant;
            K[j][1] = (Quu[1][0] * h0 - Quu[0][0] * h1) / determinant;
            for (int a = 0; a < m; a++)
                *(j < X ? &gain[k][a][j] : &feed[k][a]) = K[j][a];
        }
        for (int j = 0; j <= X; j++)
            for (int i = 0; i < X; i++)
                P[j][i] = H[i][j] + H[X][i] * K[j][0] + (m == 2 ? H[X + 1][i] * K[j][1] : 0.0);
    }
    return true;
}

/* Iterates until the cost does not fall any more. Returns the number of iterations. */
static int optimize(task *t) {
    static task next;
    double mu = 1e-6, fallen = 1.0;
    int iterations = 0;
    for (; iterations < ITERATIONS_MAX && mu < 1e6 && fallen > 1e-13; iterations++) {
        bool better = false;
        for (int k = 0; k < STEPS; k++) {
            const kt_step step = task_step_at(t, k);
            must(kt_step_derivatives(t->model, t->data, work, sizeof work, &step, t->q[k], t->v[k], NULL, NULL, A[k],
                                     B[k], &error));
        }
        while (!backward(t, mu))
            mu *= 10.0;
        for (int halved = 0; !better && halved < 20; halved++) {
            next = *t;
            better = move_under_inputs(&next, t, ldexp(1.0, -halved)) && next.cost < t->cost;
        }
        mu = better ? fmax(1e-9, 0.3 * mu) : 10.0 * mu;
        fallen = better ? 1.0 - next.cost / t->cost : 1.0;
        *t = better ? next : *t;
    }
    return iterations;
}

/* The largest derivative of the cost by an input, over that of the largest input's effort alone. */
static double gradient_of(task *t) {
    const kt_rollout rollout = {.method = kt_method_find("rk4"), .h = t->h, .steps = STEPS, .inputs = t->tau};
    double by_inputs[STEPS * N_MAX], value, most = 0.0, input = 0.0;
    must(kt_rollout_gradient(t->model, t->data, work, sizeof work, &rollout, t->q[0], t->v[0], &value, NULL, by_inputs,
                             cost_at, t, &error));
    for (int i = 0; i < STEPS * t->n; i++) {
        input = fmax(input, fabs(t->tau[i]));
        most = fmax(most, t->tau[i] == 0.0 ? 0.0 : fabs(by_inputs[i])); /* only of driven inputs */
    }
    return most / (t->effort * input);
}

/* The distance from the goal that dop853 reaches at a tolerance of 1e-10: rad or m, and their rates. */
static double simulate_exactly(const task *t) {
    kt_run run = kt_run_default();
    kt_simulation *simulation = NULL;
    double distance = 0.0;
    run.integrator = "dop853", run.relative = run.absolute = 1e-10;
    must(kt_simulation_create(t->model, &run, NULL, &simulation, &error));
    for (int k = 0; k < STEPS; k++) {
        must(kt_simulation_set_torque(simulation, t->tau + k * t->n, &error));
        must(kt_simulation_advance(simulation, (k + 1) * t->h, &error));
    }
    for (int i = 0; i < t->n; i++)
        if (t->w[i] > 0.0)
            distance = fmax(distance, fmax(fabs(kt_simulation_positions(simulation)[i] - t->goal[i]),
                                           fabs(kt_simulation_velocities(simulation)[i])));
    kt_simulation_free(simulation);
    return distance;
}

static void run_task(task *t, kt_model *model) {
    t->model = model;
    t->n = kt_model_nv(model);
    must(kt_data_create(t->model, &t->data, &error));
    kt_model_initial(t->model, t->q[0], t->v[0]);
    must(kt_state_assemble(t->model, t->data, 0.0, t->q[0], t->v[0], &error));
    must(move_under_inputs(t, t, -1.0) ? KT_OK : error.code);
    const double before = t->cost;
    const int iterations = optimize(t);
    printf("%s: cost %.6g -> %.6g in %d iterations, gradient %.1e, distance from the goal %.1e\n", t->name, before,
           t->cost, iterations, gradient_of(t), simulate_exactly(t));
    kt_data_free(t->data);
    kt_model_free(model);
}

int main(void) {
    static task cart = {.name = "cart-pole", .h = 0.02, .m = 1, .w = {1e3, 1e3}, .s = {1e2, 1e2}, .effort = 1e-3};
    static task leg = {.name = "leg", .h = 0.01, .m = 2, .w = {1e4, 1e4}, .s = {1e3, 1e3}, .effort = 1e-3};
    cart.goal[1] = leg.goal[0] = 3.14159265358979323846; /* pole and leg hang at first */
    leg.goal[1] = 0.2, leg.input[1] = 1;
    run_task(&cart, make_cart_pole());
    run_task(&leg, make_leg());
    return 0;
}
