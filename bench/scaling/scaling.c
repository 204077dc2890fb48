/* The cost of a chain as it grows. Dynamics: inverse dynamics (RNEA), mass matrix (CRBA), forward dynamics (ABA) and a
 * step of RK4. Also the derivatives of forward dynamics with respect to positions and velocities (dABA). Operational
 * space: J' v of a point (bias), the terms of M^-1, and M^-1 x (column). Also the regressor for identification, the
 * derivatives of a step (A and B), and those of many steps (gradient).
 *
 * A line counts if nothing was allocated after set-up, and if inverse dynamics returns the torques of forward dynamics:
 * error = max |tau' - tau| / max |h|. The bias force h cancels in tau' = M a + h, so the error is at most (4 + n) eps.
 * Rounding errors of n links add up along the chain. The measured error is 3e-16 for ten links. For 1000 links it is
 * 5e-15.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scaling.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

enum {
    LINES_MAX = 40,     /* of the table: 1, 2, 5 in each decade, and the last */
    EXPONENT_FROM = 10, /* below, the cost of the call itself shows */
};

/* Bound of p in the time's growth n^p. If a chain exceeds the processor's cache, each link costs more, so p is a little
 * above 1. */
static const double exponent_most = 1.1;

/* Time of both derivatives over that of forward dynamics, 32 links. */
static const double derivatives_most = 5.0;

/* Time of J' v after kinematics, and of M^-1 x, over that of forward dynamics, at every length. */
static const double bias_most = 0.4, column_most = 0.8;

/* Time of the regressor over that of RNEA, for 7 links. For n links the regressor has 10 n^2 numbers and more. */
static const double regressor_most = 4.0;

/* A and B of a step over the derivatives of forward dynamics with respect to q, v and tau, for 7 links. For a chain of
 * n links, the products of matrices take 15 n^3. They prevail from some 12 links on. The gradient over many steps by
 * all inputs, over the run. */
static const double matrices_most = 6.0, gradient_most = 5.0;

/* Bound of the error of A'y in rows of windows. The measured error is 2e-15 with twelve windows. */
static const double closed_error_most = 1e-13;

static const char about[] =
    "Times RNEA, CRBA, ABA and a step of RK4 for chains of 1 to --max links, the derivatives of ABA, and what"
    " operational space, identification and derivatives of steps take.\n";

static const char columns[] =
    "n,call," KT_CSV_TIMES ",model_bytes,data_bytes,integrator_bytes,set_up_s,allocations,error," KT_CSV_ORIGIN;

static bool is_trusted(const kt_scaling_line *l) {
    return l->allocations == 0 && l->error <= (4.0 + l->n) * DBL_EPSILON;
}

/* ---- the table --------------------------------------------------------------------------------------------------- */

static void print_heading(void) {
    printf("Time a call in us and a body in ns (lower quartile of the rounds); bytes of model and data a body; set-up "
           "in us;\n"
           "allocations after set-up; error of tau -> ABA -> RNEA.\n\n"
           "%7s |%10s%7s |%10s%7s |%10s%8s |%10s |%7s%10s%7s%9s\n",
           "n", "RNEA us", "ns", "ABA us", "ns", "RK4 us", "ns", "CRBA us", "bytes", "set-up", "alloc.", "error");
}

static void print_line(const kt_scaling_line *l) {
    static const int width[] = {[KT_SCALING_RNEA] = 7, [KT_SCALING_ABA] = 7, [KT_SCALING_RK4] = 8};
    printf("%7d |", l->n);
    for (int i = 0; i < KT_SCALING_CRBA; i++)
        printf("%10.4g%*.1f |", 1e6 * l->times[i].low, width[i], 1e9 * l->times[i].low / l->n);
    if (l->measured[KT_SCALING_CRBA])
        printf("%10.4g |", 1e6 * l->times[KT_SCALING_CRBA].low);
    else
        printf("%10s |", "-");
    printf("%7.0f%10.3g%7ld%9.1e%s\n", (double)(l->model + l->data) / l->n, 1e6 * l->set_up, l->allocations, l->error,
           is_trusted(l) ? "" : "  NOT TO BE TRUSTED");
    (void)fflush(stdout);
}

static void write_line(kt_csv *csv, const kt_scaling_line *l) {
    for (int i = 0; i < KT_SCALING_CALLS; i++) {
        if (!l->measured[i])
            continue;
        kt_csv_number(csv, l->n);
        kt_csv_text(csv, kt_scaling_call[i]);
        kt_csv_times(csv, &l->times[i]);
        kt_csv_number(csv, (double)l->model);
        kt_csv_number(csv, (double)l->data);
        kt_csv_number(csv, l->integrator > 0 ? (double)l->integrator : (double)NAN);
        kt_csv_number(csv, l->set_up);
        kt_csv_number(csv, (double)l->allocations);
        kt_csv_number(csv, l->error);
        kt_csv_origin(csv, l->isa);
        kt_csv_line(csv);
    }
}

/* ---- what the table says ----------------------------------------------------------------------------------------- */

/* Prints the exponent of a call's time; whether it is small enough. */
static bool is_linear(const kt_scaling_line *lines, int count, int call) {
    double n[LINES_MAX], t[LINES_MAX];
    int points = 0;
    for (int i = 0; i < count; i++)
        if (lines[i].n >= EXPONENT_FROM) {
            n[points] = lines[i].n;
            t[points++] = lines[i].times[call].low;
        }
    if (points < 3) {
        printf("%s: too few lengths from n = %d on to tell how its time grows\n", kt_scaling_call[call], EXPONENT_FROM);
        return false;
    }
    const double p = kt_bench_exponent(n, t, points);
    printf("%s: time grows with n^%.3f from n = %.0f to %.0f: %s\n", kt_scaling_call[call], p, n[0], n[points - 1],
           p <= exponent_most ? "linear" : "NOT LINEAR");
    return p <= exponent_most;
}

static bool conclude(const kt_scaling_line *lines, int count) {
    if (count > 1) {
        const kt_scaling_line *a = &lines[count - 2], *b = &lines[count - 1];
        const double more = b->n - a->n;
        printf("\nMemory: %.0f bytes for each body more from n = %d to %d, and %.0f to integrate it\n",
               (double)(b->model + b->data - a->model - a->data) / more, a->n, b->n,
               (double)(b->integrator - a->integrator) / more);
    }
    const bool inverse = is_linear(lines, count, KT_SCALING_RNEA), forward = is_linear(lines, count, KT_SCALING_ABA);
    return inverse && forward;
}

/* ---- the run ----------------------------------------------------------------------------------------------------- */

/* The lengths are the numbers 1, 2 and 5 times the powers of ten below max, and max. */
static int chain_lengths(int max, int *lengths) {
    static const int steps[] = {1, 2, 5};
    int count = 0;
    for (long decade = 1; decade < max; decade *= 10)
        for (int k = 0; k < 3; k++)
            if (steps[k] * decade < max)
                lengths[count++] = (int)(steps[k] * decade);
    lengths[count++] = max;
    return count;
}

static int run_isas(const int *lengths, int count, const kt_bench_options *options, kt_csv *csv) {
    printf("\nInstruction sets in turns, ns a body:\n\n");
    for (int i = 0; i < count; i++) {
        kt_scaling_line lines[KT_SCALING_ISAS];
        int isas = 0;
        kt_error error;
        if (kt_scaling_compare_isas(lengths[i], options, lines, &isas, &error) != KT_OK)
            return kt_bench_tell(&error);
        printf("%7d", lengths[i]);
        for (int call = 0; call < KT_SCALING_RK4; call++) {
            printf(" | %s", kt_scaling_call[call]);
            for (int k = 0; k < isas; k++)
                printf("  %s %6.1f", kt_bench_isa_name(lines[k].isa), 1e9 * lines[k].times[call].low / lengths[i]);
        }
        printf("\n");
        (void)fflush(stdout);
        for (int k = 0; k < isas; k++)
            write_line(csv, &lines[k]);
    }
    return KT_BENCH_DONE;
}

/* Measures the cost of derivatives against that of the functions themselves. *cheap: whether the cost is within its
 * bound for 32 links. */
static int run_derivatives(const kt_bench_options *options, kt_csv *csv, bool *trusted, bool *cheap) {
    static const int lengths[] = {8, 16, 32, 64};
    printf("\nDerivatives da/dq and da/dv together, the accelerations among them (error: M da/dv + dtau/dv):\n\n"
           "%7s |%10s |%10s |%8s%7s%9s\n",
           "n", "ABA us", "dABA us", "ratio", "alloc.", "error");
    for (int i = 0; i < 4; i++) {
        kt_scaling_line line;
        kt_error error;
        if (kt_scaling_derive(lengths[i], options, &line, &error) != KT_OK)
            return kt_bench_tell(&error);
        const double aba = line.times[KT_SCALING_ABA].low, derived = line.times[KT_SCALING_DERIVATIVES].low;
        printf("%7d |%10.4g |%10.4g |%8.2f%7ld%9.1e%s\n", line.n, 1e6 * aba, 1e6 * derived, derived / aba,
               line.allocations, line.error, is_trusted(&line) ? "" : "  NOT TO BE TRUSTED");
        write_line(csv, &line);
        *trusted &= is_trusted(&line);
        if (line.n == 32)
            *cheap = derived <= derivatives_most * aba;
    }
    printf("\n%s %g times forward dynamics at n = 32\n", *cheap ? "at most" : "MORE THAN", derivatives_most);
    return KT_BENCH_DONE;
}

/* Measures the time of operational space, as ratios to forward dynamics. */
static int run_control(const kt_bench_options *options, kt_csv *csv, bool *trusted, bool *cheap) {
    static const int lengths[] = {7, 32, 100, 1000};
    printf("\nOperational space: J' v, the terms of M^-1 and M^-1 x a column, over ABA (error: M x, and J' v):\n\n"
           "%7s |%10s |%8s%8s%8s%7s%9s\n",
           "n", "ABA us", "J' v", "terms", "column", "alloc.", "error");
    *cheap = true;
    for (int i = 0; i < 4 && (lengths[i] <= options->max || i == 0); i++) {
        kt_scaling_line line;
        kt_error error;
        if (kt_scaling_control(lengths[i], options, &line, &error) != KT_OK)
            return kt_bench_tell(&error);
        const double aba = line.times[KT_SCALING_ABA].low, bias = line.times[KT_SCALING_BIAS].low / aba;
        const double terms = line.times[KT_SCALING_TERMS].low / aba, column = line.times[KT_SCALING_COLUMN].low / aba;
        printf("%7d |%10.4g |%8.3f%8.3f%8.3f%7ld%9.1e%s\n", line.n, 1e6 * aba, bias, terms, column, line.allocations,
               line.error, is_trusted(&line) ? "" : "  NOT TO BE TRUSTED");
        write_line(csv, &line);
        *trusted &= is_trusted(&line);
        *cheap &= bias <= bias_most && column <= column_most;
    }
    printf("\n%s %g and %g times forward dynamics\n", *cheap ? "at most" : "MORE THAN", bias_most, column_most);
    return KT_BENCH_DONE;
}

/* The regressor for identification, over inverse dynamics. */
static int run_regressor(const kt_bench_options *options, kt_csv *csv, bool *trusted, bool *cheap) {
    static const int lengths[] = {7, 32};
    printf("\nRegressor of inverse dynamics over RNEA (error: Y pi):\n\n%7s |%10s |%10s%8s |%7s%9s\n", "n", "RNEA us",
           "Y us", "times", "alloc.", "error");
    *cheap = true;
    for (int i = 0; i < 2 && (lengths[i] <= options->max || i == 0); i++) {
        kt_scaling_line line;
        kt_error error;
        if (kt_scaling_regressor(lengths[i], options, &line, &error) != KT_OK)
            return kt_bench_tell(&error);
        const double rnea = line.times[KT_SCALING_RNEA].low, times = line.times[KT_SCALING_REGRESSOR].low / rnea;
        printf("%7d |%10.4g |%10.4g%8.2f |%7ld%9.1e%s\n", line.n, 1e6 * rnea,
               1e6 * line.times[KT_SCALING_REGRESSOR].low, times, line.allocations, line.error,
               is_trusted(&line) ? "" : "  NOT TO BE TRUSTED");
        write_line(csv, &line);
        *trusted &= is_trusted(&line);
        *cheap &= i > 0 || times <= regressor_most;
    }
    printf("\n%s %g times inverse dynamics at n = 7\n", *cheap ? "at most" : "MORE THAN", regressor_most);
    return KT_BENCH_DONE;
}

/* Derivatives of steps, over those of forward dynamics; gradients over many steps, over the run. */
static int run_steps(const kt_bench_options *options, kt_csv *csv, bool *trusted, bool *cheap) {
    static const int lengths[] = {7, 16, 32};
    printf("\nA step of rk4: A and B over dABA with da/dtau; 50 steps: gradient by all inputs over the run (error: "
           "A'y, twice):\n\n"
           "%7s |%10s |%8s |%10s |%8s%7s%9s\n",
           "n", "dABA us", "A, B", "run us", "gradient", "alloc.", "error");
    *cheap = true;
    for (int i = 0; i < 3 && (lengths[i] <= options->max || i == 0); i++) {
        kt_scaling_line line;
        kt_error error;
        if (kt_scaling_steps(lengths[i], options, &line, &error) != KT_OK)
            return kt_bench_tell(&error);
        const double derived = line.times[KT_SCALING_FORWARD].low, motion = line.times[KT_SCALING_MOTION].low;
        const double matrices = line.times[KT_SCALING_MATRICES].low / derived;
        const double gradient = line.times[KT_SCALING_GRADIENT].low / motion;
        printf("%7d |%10.4g |%8.2f |%10.4g |%8.2f%7ld%9.1e%s\n", line.n, 1e6 * derived, matrices, 1e6 * motion,
               gradient, line.allocations, line.error, is_trusted(&line) ? "" : "  NOT TO BE TRUSTED");
        write_line(csv, &line);
        *trusted &= is_trusted(&line);
        *cheap &= (i > 0 || matrices <= matrices_most) && gradient <= gradient_most;
    }
    printf("\n%s %g times the derivatives of forward dynamics at n = 7, and %g times the run\n",
           *cheap ? "at most" : "MORE THAN", matrices_most, gradient_most);
    return KT_BENCH_DONE;
}

/* The same of rows of windows; the adjoint's error grows with their condition. */
static int run_closed(const kt_bench_options *options, kt_csv *csv, bool *trusted, bool *cheap) {
    static const int windows[] = {1, 2, 12};
    printf("\nThe same of rows of four-bar windows, by fronts from some five windows on:\n\n"
           "%7s%9s |%10s |%8s |%10s |%8s%7s%9s\n",
           "n", "windows", "dABA us", "A, B", "run us", "gradient", "alloc.", "error");
    *cheap = true;
    for (int i = 0; i < 3 && (windows[i] <= options->max || i == 0); i++) {
        kt_scaling_line line;
        kt_error error;
        const kt_status status = kt_scaling_closed_steps(windows[i], options, &line, &error);
        if (status == KT_ERROR_UNSUPPORTED) /* a library for trees */
            return KT_BENCH_DONE;
        if (status != KT_OK)
            return kt_bench_tell(&error);
        const double derived = line.times[KT_SCALING_CLOSED_FORWARD].low;
        const double motion = line.times[KT_SCALING_CLOSED_MOTION].low;
        const double matrices = line.times[KT_SCALING_CLOSED_MATRICES].low / derived;
        const double gradient = line.times[KT_SCALING_CLOSED_GRADIENT].low / motion;
        const bool fine = line.allocations == 0 && line.error <= closed_error_most;
        printf("%7d%9d |%10.4g |%8.2f |%10.4g |%8.2f%7ld%9.1e%s\n", line.n, windows[i], 1e6 * derived, matrices,
               1e6 * motion, gradient, line.allocations, line.error, fine ? "" : "  NOT TO BE TRUSTED");
        write_line(csv, &line);
        *trusted &= fine;
        *cheap &= i > 1 || gradient <= gradient_most;
    }
    printf("\n%s %g times the run with one window and two\n", *cheap ? "at most" : "MORE THAN", gradient_most);
    return KT_BENCH_DONE;
}

static int run(const kt_bench_options *options, kt_scaling_line *lines, kt_csv *csv) {
    int lengths[LINES_MAX];
    const int count = chain_lengths(options->max, lengths);
    bool trusted = true;
    for (int i = 0; i < count; i++) {
        kt_error error;
        if (kt_scaling_measure(lengths[i], options, &lines[i], &error) != KT_OK)
            return kt_bench_tell(&error);
        if (i == 0) {
            kt_bench_heading("Chains of n links on revolute joints", lines[i].isa, options->csv);
            print_heading();
        }
        print_line(&lines[i]);
        write_line(csv, &lines[i]);
        trusted &= is_trusted(&lines[i]);
    }
    const bool linear = conclude(lines, count);
    bool cheap = false, spare = false, brief = false, lean = false, closed = false;
    if (run_derivatives(options, csv, &trusted, &cheap) != KT_BENCH_DONE ||
        run_control(options, csv, &trusted, &spare) != KT_BENCH_DONE ||
        run_regressor(options, csv, &trusted, &lean) != KT_BENCH_DONE ||
        run_steps(options, csv, &trusted, &brief) != KT_BENCH_DONE ||
        run_closed(options, csv, &trusted, &closed) != KT_BENCH_DONE)
        return KT_BENCH_FAILED;
    if (options->isas && run_isas(lengths, count, options, csv) != KT_BENCH_DONE)
        return KT_BENCH_FAILED;
    return !trusted                                                                   ? KT_BENCH_FAILED
           : options->check && !(linear && cheap && spare && brief && lean && closed) ? KT_BENCH_MISSED
                                                                                      : KT_BENCH_DONE;
}

int main(int argc, char **argv) {
    kt_bench_options options = {.max = 100000, .seconds = 1.0};
    const int status = kt_bench_read(argc, argv, about, &options);
    if (status >= 0)
        return status;
    kt_csv csv;
    kt_scaling_line *lines = calloc(LINES_MAX, sizeof *lines);
    if (!lines || !kt_csv_open(&csv, options.csv, columns)) {
        free(lines);
        return KT_BENCH_FAILED;
    }
    const int result = run(&options, lines, &csv);
    free(lines);
    return kt_csv_close(&csv) ? result : KT_BENCH_FAILED;
}
