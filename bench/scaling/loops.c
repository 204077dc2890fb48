/* The cost of closed loops: one evaluation of the accelerations. There are two kinds of mechanisms. The first are
 * four-bars hung on a chain (separate: each is a group reduced by itself). The second are windows in a row that share
 * their cranks (chained: one group, one dense reduction). For comparison, the same bodies run without loops, and all of
 * it in the absolute formulation (every body free, every joint a loop).
 *
 * A line is trusted if nothing was allocated after set-up, and if the forces of joints and loops do no work. With tau =
 * RNEA(a) and the bias force h, the relative power |v . tau| / sum |v_i h_i| must be at most 1e-10. The measured values
 * are 1e-13 and less.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "bars.h"
#include "chains.h"
#include "interpose.h"
#include "report.h"

#include "kinetree/dynamics.h"

#include <math.h>
#include <stdlib.h>

enum { COUNTS_MAX = 40, ABSOLUTE_MOST = 10, TEN = 10 };

/* Ten separate loops may cost so much more than ten times one: the chain that they hang on has grown as well. */
static const double ten_most = 10.0 * 1.15;
static const double error_most = 1e-10;

enum { TREE, CLOSED, ABSOLUTE, WAYS };
static const char *const way_name[WAYS] = {"no loops", "tree", "absolute"};

typedef struct line {
    int loops;
    kt_isa isa;
    bool measured[WAYS];
    kt_bench_times times[WAYS];
    double set_up[WAYS], error[WAYS];
    long allocations;
} line;

static const char about[] =
    "Times the accelerations of mechanisms with 1 to --max loops, separate and chained, and how what costs most grows\n"
    "with rows of windows, scissors, ladders and nets of up to 10 times --max loops, ropes of 100 times --max rods.\n";

static const char columns[] = "n,shape,call," KT_CSV_TIMES ",set_up_s,allocations,error," KT_CSV_ORIGIN;

/* ---- measuring --------------------------------------------------------------------------------------------------- */

static kt_status time_all(kt_bars bars[WAYS], int ways, double seconds, line *out, kt_error *error) {
    kt_bench_task tasks[WAYS];
    out->allocations = 0;
    for (int k = 0; k < ways; k++) {
        tasks[k] = (kt_bench_task){kt_bars_accelerate, &bars[k]};
        out->measured[k] = true;
        out->set_up[k] = bars[k].set_up;
        out->error[k] = kt_bars_idle_work(&bars[k]);
        kt_interpose_start();
        kt_bars_accelerate(&bars[k], 2);
        out->allocations += kt_interpose_stop();
    }
    out->isa = kt_model_isa(bars[CLOSED].stepped);
    kt_bench_measure(tasks, ways, seconds, out->times);
    for (int k = 0; k < ways; k++)
        if (bars[k].error.code != KT_OK) {
            *error = bars[k].error;
            return error->code;
        }
    return KT_OK;
}

static kt_status measure(kt_bars_shape shape, int loops, const kt_bench_options *options, line *out, kt_error *error) {
    kt_bars bars[WAYS];
    const int ways = loops <= ABSOLUTE_MOST ? WAYS : ABSOLUTE;
    kt_status status = KT_OK;
    int made = 0;
    *out = (line){.loops = loops};
    while (made < ways && status == KT_OK) {
        kt_model_options settings = kt_model_options_default();
        settings.isa = options->isa;
        const kt_formulation formulation = made == ABSOLUTE ? KT_FORMULATION_ABSOLUTE : KT_FORMULATION_TREE;
        status = kt_bars_make(shape, loops, made == TREE, formulation, &settings, &bars[made], error);
        made += status == KT_OK;
    }
    if (status == KT_OK)
        status = time_all(bars, ways, options->seconds, out, error);
    for (int k = 0; k < made; k++)
        kt_bars_free(&bars[k]);
    return status;
}

/* ---- the table --------------------------------------------------------------------------------------------------- */

static bool is_trusted(const line *l) {
    bool fine = l->allocations == 0;
    for (int k = 0; k < WAYS; k++)
        fine &= !l->measured[k] || l->error[k] <= error_most;
    return fine;
}

static void print_line(const line *l) {
    const double closed = l->times[CLOSED].low;
    printf("%7d |%10.3g |%10.4g%9.3g |", l->loops, 1e6 * l->times[TREE].low, 1e6 * closed, 1e6 * closed / l->loops);
    if (l->measured[ABSOLUTE])
        printf("%10.4g%8.1f |", 1e6 * l->times[ABSOLUTE].low,
               kt_bench_compare(&l->times[ABSOLUTE], &l->times[CLOSED]).median);
    else
        printf("%10s%8s |", "-", "-");
    printf("%9.3g%7ld%9.1e%s\n", 1e3 * l->set_up[CLOSED], l->allocations,
           fmax(l->error[CLOSED], l->measured[ABSOLUTE] ? l->error[ABSOLUTE] : 0.0),
           is_trusted(l) ? "" : "  NOT TO BE TRUSTED");
    (void)fflush(stdout);
}

static void write_line(kt_csv *csv, const char *shape, const line *l) {
    for (int k = 0; k < WAYS; k++) {
        if (!l->measured[k])
            continue;
        kt_csv_number(csv, l->loops);
        kt_csv_text(csv, shape);
        kt_csv_text(csv, way_name[k]);
        kt_csv_times(csv, &l->times[k]);
        kt_csv_number(csv, l->set_up[k]);
        kt_csv_number(csv, (double)l->allocations);
        kt_csv_number(csv, l->error[k]);
        kt_csv_origin(csv, l->isa);
        kt_csv_line(csv);
    }
}

/* Checks for SEPARATE whether ten loops cost about ten times one. For other shapes it reports how the time grows. */
static bool conclude(kt_bars_shape shape, const line *lines, int count) {
    double n[COUNTS_MAX], t[COUNTS_MAX], ten = (double)NAN;
    for (int i = 0; i < count; i++) {
        n[i] = lines[i].loops;
        t[i] = lines[i].times[CLOSED].low;
        if (lines[i].loops == TEN)
            ten = t[i] / t[0];
    }
    const int from = count > 3 ? count - 3 : 0;
    printf("\n%s: time grows with n^%.2f from n = %.0f to %.0f", kt_bars_shape_name[shape],
           kt_bench_exponent(n + from, t + from, count - from), n[from], n[count - 1]);
    if (shape != KT_BARS_SEPARATE || isnan(ten)) {
        printf("\n\n");
        return true;
    }
    printf("; ten cost %.2f times one: %s\n\n", ten, ten <= ten_most ? "separate" : "NOT SEPARATE");
    return ten <= ten_most;
}

/* ---- the run ----------------------------------------------------------------------------------------------------- */

/* The counts are the numbers 1, 2 and 5 times the powers of ten below max, and max. */
static int loop_counts(int max, int *counts) {
    static const int steps[] = {1, 2, 5};
    int count = 0;
    for (long decade = 1; decade < max; decade *= 10)
        for (int k = 0; k < 3; k++)
            if (steps[k] * decade < max)
                counts[count++] = (int)(steps[k] * decade);
    counts[count++] = max;
    return count;
}

static int run(const kt_bench_options *options, kt_csv *csv, line *lines) {
    int counts[COUNTS_MAX];
    const int count = loop_counts(options->max, counts);
    bool trusted = true, kept = true;
    for (int shape = 0; shape <= KT_BARS_CHAINED; shape++) {
        for (int i = 0; i < count; i++) {
            kt_error error;
            if (measure((kt_bars_shape)shape, counts[i], options, &lines[i], &error) != KT_OK)
                return kt_bench_tell(&error);
            if (i == 0) {
                if (shape == 0)
                    kt_bench_heading("Accelerations of mechanisms with n loops", lines[i].isa, options->csv);
                printf("%s. Time a call and a loop in us (lower quartile of the rounds); set-up in ms; allocations "
                       "after it;\nwork of forces that do none.\n\n%7s |%10s |%10s%9s |%10s%8s |%9s%7s%9s\n",
                       shape == KT_BARS_SEPARATE ? "Four-bars on a chain" : "A row of windows", "n", "no loops", "tree",
                       "a loop", "absolute", "times", "set-up", "alloc.", "error");
            }
            print_line(&lines[i]);
            write_line(csv, kt_bars_shape_name[shape], &lines[i]);
            trusted &= is_trusted(&lines[i]);
        }
        kept &= conclude((kt_bars_shape)shape, lines, count);
    }
    const int status = kt_chains_run(options, csv, &trusted);
    if (status != KT_BENCH_DONE)
        return status;
    return !trusted ? KT_BENCH_FAILED : options->check && !kept ? KT_BENCH_MISSED : KT_BENCH_DONE;
}

int main(int argc, char **argv) {
    kt_bench_options options = {.max = 100, .seconds = 1.0};
    const int status = kt_bench_read(argc, argv, about, &options);
    if (status >= 0)
        return status;
    /* Before the library loads OpenBLAS, which with more threads allocates (see reduction.h). */
    (void)setenv("OPENBLAS_NUM_THREADS", "1", 1);
    kt_csv csv;
    line *lines = calloc(COUNTS_MAX, sizeof *lines);
    if (!lines || !kt_csv_open(&csv, options.csv, columns)) {
        free(lines);
        return KT_BENCH_FAILED;
    }
    const int result = run(&options, &csv, lines);
    free(lines);
    return kt_csv_close(&csv) ? result : KT_BENCH_FAILED;
}
