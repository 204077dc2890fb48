/* Identification: masses, inertias and friction of a seven-axis arm from a record of joint torques with noise. It also
 * finds the parameters that the record does not determine.
 *
 * Torques are linear in the parameters, tau = Y(q, v, a) pi (kt_regressor_evaluate). Most parameters have an effect in
 * sums alone, and kt_base_parameters_find finds these sums from the model.
 *
 * Each joint's rows are divided by the deviation of its torque sensor. They are rotated into the triangle of a QR
 * factorisation, so that a record of any length takes the same memory. The solution has the least error, with the
 * covariance (R'R)^-1.
 *
 *     identify_arm [--seconds S] [--csv FILE]
 *
 * The record is that of a simulated arm (arm.h), moved along sums of sines. Its masses differ by some percent from
 * those of its drawing, its joints have friction, and its torques have noise. The result is compared with the arm's
 * true sums, and predicts the torques of another path.
 *
 * Reference: Swevers, Verdonck, De Schutter, Dynamic model identification for industrial robots, IEEE Control Systems
 * Magazine 27(5), 2007. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "arm.h"
#include "kinetree/identification.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { JOINTS = ARM_JOINTS, RATE = 100, COLUMNS = 10 * ARM_BODIES + 3 * JOINTS };

static const double noise[JOINTS] = {0.6, 0.6, 0.3, 0.3, 0.1, 0.1, 0.05};  /* N m, deviation of the torque sensors */
static const double viscous[JOINTS] = {4.0, 4.0, 2.0, 2.0, 0.8, 0.6, 0.3}; /* N m s */
static const double coulomb[JOINTS] = {3.0, 3.0, 1.5, 1.5, 0.6, 0.4, 0.2}; /* N m */

/* A model of the arm, and memory for its computations. */
typedef struct arm {
    kt_model *model;
    kt_data *data;
    double pi[COLUMNS], y[JOINTS * COLUMNS];
} arm;

static kt_status make_scaled_arm(const double *scale, arm *x, kt_error *error) {
    const kt_status status = arm_compile(scale, NULL, 0, &x->model, error);
    return status == KT_OK ? kt_data_create(x->model, &x->data, error) : status;
}

/* ---- the record -------------------------------------------------------------------------------------------------- */

/* Three sines a joint; `path` chooses their phases. */
static void move_on_path(double t, int path, double *q, double *v, double *a) {
    static const double middle[JOINTS] = {0.0, 0.5, 0.0, 1.2, 0.0, 0.6, 0.0};
    for (int i = 0; i < JOINTS; i++) {
        q[i] = middle[i];
        v[i] = a[i] = 0.0;
        for (int k = 1; k <= 3; k++) {
            const double w = 0.9 * k + 0.17 * i, size = 0.5 / k, phase = w * t + 1.7 * k * i + 0.9 * path;
            q[i] += size * sin(phase);
            v[i] += size * w * cos(phase);
            a[i] -= size * w * w * sin(phase);
        }
    }
}

/* Draws a number of mean 0 and deviation 1: the sum of twelve uniform numbers. */
static double draw_normal(void) {
    static uint64_t state = 1;
    double sum = -6.0;
    for (int k = 0; k < 12; k++) {
        state = state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        sum += (double)(state >> 11) * 0x1p-53;
    }
    return sum;
}

/* Torques of parameters at a state; fills x->y. */
static kt_status torques(arm *x, const double *pi, const double *q, const double *v, const double *a, double *tau,
                         kt_error *error) {
    const kt_status status = kt_regressor_evaluate(x->model, x->data, q, v, a, x->y, error);
    for (int i = 0; i < JOINTS && status == KT_OK; i++) {
        tau[i] = 0.0;
        for (int c = 0; c < COLUMNS; c++)
            tau[i] += x->y[c * JOINTS + i] * pi[c];
    }
    return status;
}

/* ---- least squares ----------------------------------------------------------------------------------------------- */

typedef struct fit {
    int rank, column[COLUMNS];
    double relation[COLUMNS * COLUMNS];
    double triangle[COLUMNS][COLUMNS + 1]; /* R, and Q' tau */
    double value[COLUMNS], deviation[COLUMNS];
    double rest; /* sum of squares that no parameters explain */
    long rows;
} fit;

static void add_fit_row(fit *f, double *row) {
    for (int i = 0; i < f->rank; i++) {
        const double length = hypot(f->triangle[i][i], row[i]);
        if (row[i] == 0.0)
            continue;
        const double c = f->triangle[i][i] / length, s = row[i] / length;
        for (int k = i; k <= f->rank; k++) {
            const double x = f->triangle[i][k], y = row[k];
            f->triangle[i][k] = c * x + s * y;
            row[k] = c * y - s * x;
        }
    }
    f->rest += row[f->rank] * row[f->rank];
    f->rows++;
}

/* Values by back substitution; deviations from the rows of R^-1. */
static void solve_fit(fit *f) {
    for (int i = f->rank - 1; i >= 0; i--) {
        f->value[i] = f->triangle[i][f->rank];
        for (int k = i + 1; k < f->rank; k++)
            f->value[i] -= f->triangle[i][k] * f->value[k];
        f->value[i] /= f->triangle[i][i];
    }
    for (int j = 0; j < f->rank; j++) { /* column j of R^-1 */
        double x[COLUMNS] = {0.0};
        for (int i = j; i >= 0; i--) {
            x[i] = i == j ? 1.0 : 0.0;
            for (int k = i + 1; k <= j; k++)
                x[i] -= f->triangle[i][k] * x[k];
            x[i] /= f->triangle[i][i];
            f->deviation[i] += x[i] * x[i];
        }
    }
    for (int i = 0; i < f->rank; i++)
        f->deviation[i] = sqrt(f->deviation[i]);
}

static double base_value(const fit *f, const double *pi, int i) {
    double value = pi[f->column[i]];
    for (int k = 0; k < COLUMNS - f->rank; k++)
        value += f->relation[i + k * f->rank] * pi[f->column[f->rank + k]];
    return value;
}

/* ---- the identification ------------------------------------------------------------------------------------------ */

static kt_status find_base(arm *x, fit *f, kt_error *error) {
    const size_t size = kt_base_parameters_work_size(x->model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    if (work == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, "base parameters", "there is not enough memory");
    const kt_status status =
        kt_base_parameters_find(x->model, x->data, work, size, &f->rank, f->column, f->relation, error);
    free(work);
    return status;
}

static kt_status identify_torques(arm *drawn, arm *real, double seconds, fit *f, kt_error *error) {
    double q[JOINTS], v[JOINTS], a[JOINTS], tau[JOINTS];
    kt_status status = find_base(drawn, f, error);
    for (int n = 0; n < (int)(seconds * RATE) && status == KT_OK; n++) {
        move_on_path((double)n / RATE, 0, q, v, a);
        status = torques(real, real->pi, q, v, a, tau, error);
        for (int i = 0; i < JOINTS && status == KT_OK; i++) {
            double row[COLUMNS + 1];
            for (int k = 0; k < f->rank; k++)
                row[k] = real->y[f->column[k] * JOINTS + i] / noise[i]; /* Y depends on the motion alone */
            row[f->rank] = tau[i] / noise[i] + draw_normal();
            add_fit_row(f, row);
        }
    }
    if (status == KT_OK)
        solve_fit(f);
    return status;
}

/* Root mean square of the torques that are predicted on another path minus the true ones, over the sensors'
 * deviation. */
static kt_status predict_torques(arm *drawn, arm *real, const fit *f, double *by_drawing, double *by_fit,
                                 kt_error *error) {
    double q[JOINTS], v[JOINTS], a[JOINTS], tau[JOINTS], guess[JOINTS];
    kt_status status = KT_OK;
    for (int n = 0; n < 10 * RATE && status == KT_OK; n++) {
        move_on_path((double)n / RATE, 1, q, v, a);
        status = torques(real, real->pi, q, v, a, tau, error);
        if (status == KT_OK)
            status = torques(drawn, drawn->pi, q, v, a, guess, error);
        for (int i = 0; i < JOINTS && status == KT_OK; i++) {
            double fitted = 0.0;
            for (int k = 0; k < f->rank; k++)
                fitted += drawn->y[f->column[k] * JOINTS + i] * f->value[k];
            *by_drawing += pow((guess[i] - tau[i]) / noise[i], 2.0) / (10 * RATE * JOINTS);
            *by_fit += pow((fitted - tau[i]) / noise[i], 2.0) / (10 * RATE * JOINTS);
        }
    }
    *by_drawing = sqrt(*by_drawing);
    *by_fit = sqrt(*by_fit);
    return status;
}

/* Whether the record determines a sum: its deviation is below a third of its value. */
static bool is_told(const fit *f, int i) { return f->deviation[i] < fabs(f->value[i]) / 3.0; }

static void report_fit(const arm *drawn, const arm *real, const fit *f, FILE *csv) {
    int told = 0, silent = 0;
    char name[1024];
    for (int i = 0; i < f->rank; i++) {
        (void)kt_base_parameter_name(drawn->model, f->rank, f->column, f->relation, i, name, sizeof name);
        const double wanted = base_value(f, real->pi, i);
        told += is_told(f, i);
        if (!is_told(f, i))
            printf("not identified: %.4f +- %.4f (drawn %.4f)  %s\n", f->value[i], f->deviation[i],
                   base_value(f, drawn->pi, i), name);
        if (csv != NULL)
            fprintf(csv, "\"%s\",%.9g,%.9g,%.9g,%.9g\n", name, base_value(f, drawn->pi, i), f->value[i],
                    f->deviation[i], wanted);
    }
    for (int k = f->rank; k < COLUMNS; k++) {
        double most = 0.0;
        for (int i = 0; i < f->rank; i++)
            most = fmax(most, fabs(f->relation[i + (k - f->rank) * f->rank]));
        silent += most == 0.0;
    }
    printf("parameters: %d, of which %d have no effect on any torque\n", COLUMNS, silent);
    printf("identifiable sums: %d; identified by this record to a third: %d\n", f->rank, told);
    printf("rms of what is left of the record: %.3f of the sensors' deviation\n",
           sqrt(f->rest / (double)(f->rows - f->rank)));
}

static int run_identification(double seconds, FILE *csv, arm *drawn, arm *real, fit *f, kt_error *error) {
    static const double sign[ARM_BODIES] = {1, -1, 1, 1, -1, 1, -1, 1};
    double scale[ARM_BODIES], one[ARM_BODIES], by_drawing = 0.0, by_fit = 0.0;
    for (int i = 0; i < ARM_BODIES; i++) {
        one[i] = 1.0;
        scale[i] = 1.0 + 0.08 * sign[i];
    }
    if (make_scaled_arm(one, drawn, error) != KT_OK || make_scaled_arm(scale, real, error) != KT_OK)
        return -1;
    kt_regressor_parameters(drawn->model, drawn->pi);
    kt_regressor_parameters(real->model, real->pi);
    for (int i = 0; i < JOINTS; i++) {
        real->pi[10 * ARM_BODIES + JOINTS + i] = viscous[i];
        real->pi[10 * ARM_BODIES + 2 * JOINTS + i] = coulomb[i];
    }
    if (identify_torques(drawn, real, seconds, f, error) != KT_OK ||
        predict_torques(drawn, real, f, &by_drawing, &by_fit, error) != KT_OK)
        return -1;
    report_fit(drawn, real, f, csv);
    printf("torques of another path, rms error over the sensors' deviation: drawing %.2f, identified %.3f\n",
           by_drawing, by_fit);
    return 0;
}

int main(int argc, char **argv) {
    static arm drawn, real;
    static fit f;
    kt_error error = {0};
    double seconds = 20.0;
    FILE *csv = NULL;
    for (int i = 1; i + 1 < argc; i += 2) {
        if (strcmp(argv[i], "--seconds") == 0)
            seconds = strtod(argv[i + 1], NULL);
        else if (strcmp(argv[i], "--csv") == 0)
            csv = fopen(argv[i + 1], "w");
    }
    if (!(seconds * RATE * JOINTS > COLUMNS)) {
        fprintf(stderr, "identify_arm: --seconds is too short for %d unknowns\n", COLUMNS);
        return 1;
    }
    if (csv != NULL)
        fprintf(csv, "sum,drawing,identified,deviation,true\n");
    const int failed = run_identification(seconds, csv, &drawn, &real, &f, &error);
    if (failed != 0)
        fprintf(stderr, "identify_arm: %s: %s\n", error.where, error.message);
    if (csv != NULL)
        (void)fclose(csv);
    kt_data_free(drawn.data);
    kt_data_free(real.data);
    kt_model_free(drawn.model);
    kt_model_free(real.model);
    return failed != 0;
}
