/* The gain of planar kernels: one evaluation of the accelerations with planar kernels and with spatial ones (plan:
 * spatial), in turns. The mechanisms are a row of 128 rods, a four-bar, twenty four-bars on a chain, and two and ten
 * windows. The closures alone are measured as the difference to the mechanism without its loops.
 *
 * A line is trusted if nothing was allocated after set-up and both find the same accelerations, to 1e-9 of the largest
 * (measured: 1e-12 and less).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "bars.h"
#include "interpose.h"
#include "report.h"

#include <math.h>

/* Bounds of the cost of a planar evaluation, as a part of a spatial one. */
static const struct subject {
    const char *name;
    kt_bars_shape shape;
    int count;
    bool closed;
    double most; /* 0: no bound */
} subjects[] = {
    {"row of 128 rods", KT_BARS_ROW, 128, false, 0.45},
    {"four-bar", KT_BARS_CHAINED, 1, true, 1.0 / 3.0},
    {"twenty four-bars", KT_BARS_SEPARATE, 20, true, 1.0 / 3.0},
    {"two windows", KT_BARS_CHAINED, 2, true, 0.0},
    {"ten windows", KT_BARS_CHAINED, 10, true, 0.0},
};

enum { PLANAR, SPATIAL, PLANAR_OPEN, SPATIAL_OPEN, WAYS };

static const double difference_most = 1e-9;

static const char about[] = "Times planar and spatial kernels on plane mechanisms, in turns.\n";
static const char columns[] = "subject,way," KT_CSV_TIMES ",allocations,difference," KT_CSV_ORIGIN;
static const char *const way_name[WAYS] = {"planar", "spatial", "planar without loops", "spatial without loops"};

static double difference(const kt_bars *a, const kt_bars *b) {
    double most = 0.0, size = 0.0;
    for (int i = 0; i < kt_model_nv(a->model); i++) {
        most = fmax(most, fabs(a->a[i] - b->a[i]));
        size = fmax(size, fabs(a->a[i]));
        if (isnan(a->a[i] + b->a[i]))
            return (double)NAN;
    }
    return most / size;
}

static kt_status make_all(const struct subject *s, kt_isa isa, kt_bars bars[WAYS], int *made, kt_error *error) {
    kt_status status = KT_OK;
    for (*made = 0; *made < (s->closed ? WAYS : PLANAR_OPEN) && status == KT_OK;) {
        kt_model_options options = kt_model_options_default();
        options.isa = isa;
        options.plan = *made % 2 ? KT_PLAN_SPATIAL : KT_PLAN_AUTO;
        status =
            kt_bars_make(s->shape, s->count, *made >= PLANAR_OPEN, KT_FORMULATION_TREE, &options, &bars[*made], error);
        *made += status == KT_OK;
    }
    return status;
}

static int report(const struct subject *s, const kt_bench_times *times, int ways, long allocations, double apart,
                  kt_isa isa, kt_csv *csv) {
    const kt_bench_ratio ratio = kt_bench_compare(&times[PLANAR], &times[SPATIAL]);
    const bool trusted = allocations == 0 && apart <= difference_most,
               fits = !(s->most > 0.0) || ratio.median <= s->most;
    printf("%18s |%9.3f%9.3f%8.3f", s->name, 1e6 * times[PLANAR].low, 1e6 * times[SPATIAL].low, ratio.median);
    if (s->closed) {
        const double planar = times[PLANAR].low - times[PLANAR_OPEN].low;
        const double spatial = times[SPATIAL].low - times[SPATIAL_OPEN].low;
        printf(" |%9.3f%9.3f%8.3f", 1e6 * planar, 1e6 * spatial, planar / spatial);
    } else {
        printf(" |%9s%9s%8s", "-", "-", "-");
    }
    printf(" |%7ld%9.1e%s%s\n", allocations, apart, fits ? "" : "  MORE THAN PROMISED",
           trusted ? "" : "  NOT TO BE TRUSTED");
    (void)fflush(stdout);
    for (int k = 0; k < ways; k++) {
        kt_csv_text(csv, s->name);
        kt_csv_text(csv, way_name[k]);
        kt_csv_times(csv, &times[k]);
        kt_csv_number(csv, (double)allocations);
        kt_csv_number(csv, apart);
        kt_csv_origin(csv, isa);
        kt_csv_line(csv);
    }
    return !trusted ? KT_BENCH_FAILED : fits ? KT_BENCH_DONE : KT_BENCH_MISSED;
}

static int measure(size_t index, const kt_bench_options *options, kt_csv *csv) {
    const struct subject *s = &subjects[index];
    kt_bars bars[WAYS];
    kt_bench_task tasks[WAYS];
    static kt_bench_times times[WAYS];
    kt_error error;
    int made, result = KT_BENCH_FAILED;
    if (make_all(s, options->isa, bars, &made, &error) == KT_OK) {
        for (int k = 0; k < made; k++)
            tasks[k] = (kt_bench_task){kt_bars_accelerate, &bars[k]};
        for (int k = 0; k < made; k++)
            kt_bars_accelerate(&bars[k], 1);
        kt_interpose_start();
        for (int k = 0; k < made; k++)
            kt_bars_accelerate(&bars[k], 2);
        const long allocations = kt_interpose_stop();
        kt_bench_measure(tasks, made, options->seconds, times);
        result = report(s, times, made, allocations, difference(&bars[PLANAR], &bars[SPATIAL]),
                        kt_model_isa(bars[PLANAR].model), csv);
    } else {
        (void)kt_bench_tell(&error);
    }
    for (int k = 0; k < made; k++)
        kt_bars_free(&bars[k]);
    return result;
}

static void print_head(void) {
    printf("Accelerations, us a call (lower quartile), and what the loops alone take.\n\n%18s |%9s%9s%8s |%9s%9s%8s "
           "|%7s%9s\n",
           "", "planar", "spatial", "ratio", "planar", "spatial", "ratio", "alloc.", "apart");
}

int main(int argc, char **argv) {
    static const kt_bench_table table = {
        about,  columns, "Plane mechanisms in the plane and in space", print_head, sizeof subjects / sizeof *subjects,
        measure};
    return kt_bench_run(&table, argc, argv);
}
