/* An observer: a Kalman filter that uses the simulation for its prediction.
 *
 * A double pendulum is driven by unknown torques, white noise of given strength. It is observed only by two encoders of
 * 1024 counts per revolution, with electrical noise added, every 2 ms. Their differences are too coarse for velocities:
 * one count between two samples is 3 rad/s. The filter uses the equations of motion in addition.
 *
 * Between two samples the library itself propagates the estimate x = (q, v) with covariance P. The unknown torques w
 * have the standard deviation s. The points of the third-degree spherical-radial rule carry the mean and the covariance
 * of x and w to the next sample,
 *
 *     P = L L',  x_i = x +- sqrt(n) L e_i with w = 0, and x with w = +- sqrt(n) s e_j,   n = 4 + 2
 *     x <- mean of f(x_i, w_i),  P <- mean of (f - x)(f - x)'
 *
 * where f is one step of a kt_simulation. No derivatives are needed, and each sample takes the same work: 12 steps. The
 * measurement y = q + noise then updates one encoder after the other, K = P h / (h'P h + r). Reference: I. Arasaratnam,
 * S. Haykin, Cubature Kalman Filters, IEEE Trans. Automatic Control 54 (2009) 1254-1269.
 *
 *     observer [--seed N] [--csv FILE] */
/* SPDX-License-Identifier: Apache-2.0 */
#include <kinetree/kinetree.h>

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { J = 2, N = 2 * J, A = N + J, TICKS = 5000, SETTLED = 250, WINDOW = 10 };

static const double tick = 2e-3, quantum = 6.283185307179586 / 1024, noise = 2e-3, knock = 0.5; /* s, rad, rad, N m */

/* ---- random numbers: splitmix64 (Steele, Lea, Flood 2014); normal ones by Box and Muller ------------------------- */

static double uniform(uint64_t *seed) {
    uint64_t z = *seed += UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return ((double)((z ^ (z >> 31)) >> 11) + 0.5) * 0x1p-53;
}

static double normal(uint64_t *seed) {
    const double radius = sqrt(-2.0 * log(uniform(seed)));
    return radius * cos(6.283185307179586 * uniform(seed));
}

/* ---- the pendulum ------------------------------------------------------------------------------------------------ */

static kt_status make_pendulum(kt_model **model, kt_error *error) {
    kt_body arms[J];
    kt_description pendulum = kt_description_default();
    for (int i = 0; i < J; i++) {
        arms[i] = kt_body_default();
        arms[i].name = i ? "lower" : "upper";
        arms[i].parent = i ? "upper" : NULL;
        arms[i].joint.type = KT_JOINT_REVOLUTE;
        arms[i].joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
        arms[i].joint.at = kt_vec3_make(0.0, i ? -0.4 : 0.0, 0.0);
        arms[i].joint.position[0] = i ? 0.5 : 2.0; /* rad, from hanging */
        arms[i].mass = 0.5;
        arms[i].com = kt_vec3_make(0.0, -0.2, 0.0);
        arms[i].inertia = kt_sym3_make(0.0067, 1e-4, 0.0067, 0.0, 0.0, 0.0);
    }
    pendulum.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    pendulum.bodies = arms;
    pendulum.body_count = J;
    return kt_model_compile(&pendulum, NULL, model, error);
}

static kt_status make_clock(const kt_model *model, double step, kt_simulation **simulation, kt_error *error) {
    kt_run run = kt_run_default();
    run.integrator = "rk4";
    run.step = step;
    return kt_simulation_create(model, &run, NULL, simulation, error);
}

/* Propagates x by one sample under torques w. */
static kt_status predict_state(kt_simulation *engine, double *x, const double *w, kt_error *error) {
    kt_status status = kt_simulation_set_state(engine, 0.0, x, x + J, error);
    if (status == KT_OK)
        status = kt_simulation_set_torque(engine, w, error);
    if (status == KT_OK)
        status = kt_simulation_advance(engine, tick, error);
    if (status == KT_OK) {
        memcpy(x, kt_simulation_positions(engine), J * sizeof *x);
        memcpy(x + J, kt_simulation_velocities(engine), J * sizeof *x);
    }
    return status;
}

/* ---- the filter -------------------------------------------------------------------------------------------------- */

typedef struct filter {
    kt_simulation *engine;
    double x[N], p[N][N];
} filter;

/* Cholesky factorisation L L' = P. Returns false if P is not positive definite. */
static bool root(const double p[N][N], double l[N][N]) {
    memset(l, 0, N * sizeof l[0]);
    for (int j = 0; j < N; j++)
        for (int i = j; i < N; i++) {
            double sum = p[i][j];
            for (int k = 0; k < j; k++)
                sum -= l[i][k] * l[j][k];
            if (i == j && !(sum > 0.0))
                return false;
            l[i][j] = i == j ? sqrt(sum) : sum / l[j][j];
        }
    return true;
}

static kt_status pass_sample(filter *f, kt_error *error) {
    double l[N][N], x[2 * A][N];
    const double reach = sqrt((double)A);
    if (!root((const double(*)[N])f->p, l))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "observer", "the covariance is not positive definite");
    for (int i = 0; i < 2 * A; i++) {
        const int column = i / 2;
        const double sign = i % 2 ? -reach : reach;
        double w[J] = {0.0, 0.0};
        for (int k = 0; k < N; k++)
            x[i][k] = f->x[k] + (column < N ? sign * l[k][column] : 0.0);
        if (column >= N)
            w[column - N] = sign * knock;
        const kt_status status = predict_state(f->engine, x[i], w, error);
        if (status != KT_OK)
            return status;
    }
    memset(f->x, 0, sizeof f->x);
    memset(f->p, 0, sizeof f->p);
    for (int i = 0; i < 2 * A; i++)
        for (int k = 0; k < N; k++)
            f->x[k] += x[i][k] / (2 * A);
    for (int i = 0; i < 2 * A; i++)
        for (int k = 0; k < N; k++)
            for (int m = 0; m < N; m++)
                f->p[k][m] += (x[i][k] - f->x[k]) * (x[i][m] - f->x[m]) / (2 * A);
    return KT_OK;
}

/* Updates the estimate with the measurement y of encoder j. The variance of a quantised measurement is that of its
 * noise plus quantum^2 / 12. */
static void update(filter *f, int j, double y) {
    const double r = noise * noise + quantum * quantum / 12.0;
    double k[N], row[N];
    for (int i = 0; i < N; i++) {
        k[i] = f->p[i][j] / (f->p[j][j] + r);
        row[i] = f->p[j][i];
    }
    const double innovation = y - f->x[j];
    for (int i = 0; i < N; i++) {
        f->x[i] += k[i] * innovation;
        for (int m = 0; m < N; m++)
            f->p[i][m] -= k[i] * row[m];
    }
    for (int i = 0; i < N; i++) /* restores the symmetry, which rounding destroys */
        for (int m = 0; m < i; m++)
            f->p[i][m] = f->p[m][i] = 0.5 * (f->p[i][m] + f->p[m][i]);
}

/* ---- the experiment ---------------------------------------------------------------------------------------------- */

typedef struct tally {
    double filter[N], encoder[J], difference[J], window[J]; /* sums of squared errors */
    int samples, inside[N];                                 /* estimates within three standard deviations */
} tally;

static void count_errors(tally *s, const filter *f, const double *truth, const double y[][J], int n) {
    for (int i = 0; i < N; i++) {
        const double error = f->x[i] - truth[i];
        s->filter[i] += error * error;
        s->inside[i] += fabs(error) < 3.0 * sqrt(f->p[i][i]);
    }
    for (int j = 0; j < J; j++) {
        s->encoder[j] += pow(y[n][j] - truth[j], 2.0);
        s->difference[j] += pow((y[n][j] - y[n - 1][j]) / tick - truth[J + j], 2.0);
        s->window[j] += pow((y[n][j] - y[n - WINDOW][j]) / (WINDOW * tick) - truth[J + j], 2.0);
    }
    s->samples++;
}

static kt_status observe(kt_simulation *plant, filter *f, uint64_t seed, FILE *csv, tally *s, kt_error *error) {
    static double y[TICKS][J];
    double truth[N], w[J];
    for (int n = 0; n < TICKS; n++) {
        for (int j = 0; j < J; j++)
            w[j] = knock * normal(&seed);
        kt_status status = kt_simulation_set_torque(plant, w, error);
        if (status == KT_OK)
            status = kt_simulation_advance(plant, (n + 1) * tick, error);
        if (status == KT_OK)
            status = pass_sample(f, error);
        if (status != KT_OK)
            return status;
        memcpy(truth, kt_simulation_positions(plant), J * sizeof *truth);
        memcpy(truth + J, kt_simulation_velocities(plant), J * sizeof *truth);
        for (int j = 0; j < J; j++) {
            y[n][j] = quantum * round((truth[j] + noise * normal(&seed)) / quantum);
            update(f, j, y[n][j]);
        }
        if (n >= SETTLED)
            count_errors(s, f, truth, (const double(*)[J])y, n);
        if (csv && n >= WINDOW && n % 5 == 0)
            fprintf(csv, "%.3f,%.9g,%.9g,%.9g,%.9g,%.9g\n", (n + 1) * tick, truth[3], f->x[3],
                    (y[n][1] - y[n - WINDOW][1]) / (WINDOW * tick) - truth[3], f->x[3] - truth[3],
                    3.0 * sqrt(f->p[3][3]));
    }
    return KT_OK;
}

static void print_line(const char *what, const double *sum, int n, const char *unit) {
    printf("%-26s %8.5f  %8.5f %s\n", what, sqrt(sum[0] / n), sqrt(sum[1] / n), unit);
}

static void print_tally(const tally *s) {
    const int n = s->samples;
    printf("%-26s %8s  %8s\n", "rms errors", "upper", "lower");
    print_line("angle, encoder", s->encoder, n, "rad");
    print_line("angle, filter", s->filter, n, "rad");
    print_line("velocity, one difference", s->difference, n, "rad/s");
    print_line("velocity, over ten", s->window, n, "rad/s");
    print_line("velocity, filter", s->filter + J, n, "rad/s");
    printf("within three sigma: %.2f %.2f %.2f %.2f %% of %d estimates\n", 100.0 * s->inside[0] / n,
           100.0 * s->inside[1] / n, 100.0 * s->inside[2] / n, 100.0 * s->inside[3] / n, n);
}

int main(int argc, char **argv) {
    uint64_t seed = 1;
    FILE *csv = NULL;
    kt_model *model = NULL;
    kt_simulation *plant = NULL;
    kt_error error = {0};
    tally s = {.samples = 0};
    /* The filter starts with errors of 0.2 rad and 1 rad/s. */
    filter f = {.x = {2.2, 0.3, 1.0, -1.0}, .p = {{0.04}, {0, 0.04}, {0, 0, 1.0}, {0, 0, 0, 1.0}}};
    for (int i = 1; i + 1 < argc; i += 2) {
        if (strcmp(argv[i], "--seed") == 0)
            seed = strtoull(argv[i + 1], NULL, 10);
        else if (strcmp(argv[i], "--csv") == 0)
            csv = fopen(argv[i + 1], "w");
    }
    if (argc % 2 == 0)
        return fprintf(stderr, "usage: observer [--seed N] [--csv FILE]\n"), 1;
    if (csv)
        fprintf(csv, "time,velocity.truth,velocity.filter,error.differences,error.filter,error.three_sigma\n");
    kt_status status = make_pendulum(&model, &error);
    if (status == KT_OK)
        status = make_clock(model, 0.25 * tick, &plant, &error); /* finer steps than the filter's */
    if (status == KT_OK)
        status = make_clock(model, tick, &f.engine, &error);
    if (status == KT_OK)
        status = observe(plant, &f, seed, csv, &s, &error);
    if (status == KT_OK)
        print_tally(&s);
    else
        fprintf(stderr, "observer: %s: %s\n", error.where, error.message);
    if (csv)
        fclose(csv);
    kt_simulation_free(f.engine);
    kt_simulation_free(plant);
    kt_model_free(model);
    return status == KT_OK ? 0 : 1;
}
