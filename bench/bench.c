/* Timing in turns, with quartiles, ratios and exponents of the times. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "bench.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Long against the cost of reading the clock (a system call, some 0.3 us), short against the scheduler's turns. */
static const double slice_least = 5e-4;

double kt_bench_clock(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double seconds_of(const kt_bench_task *task, long repetitions) {
    const double start = kt_bench_clock();
    task->run(task->user, repetitions);
    return kt_bench_clock() - start;
}

/* Repetitions that last a slice, and how long they really take. */
static long calibrate(const kt_bench_task *task, double slice, double *lasts) {
    long repetitions = 1;
    task->run(task->user, 1); /* touches its memory for the first time */
    for (;;) {
        *lasts = seconds_of(task, repetitions);
        if (*lasts >= slice)
            return repetitions;
        const double growth = *lasts > 0.1 * slice ? 1.05 * slice / *lasts : 10.0;
        repetitions = (long)ceil((double)repetitions * growth);
    }
}

static double sample(const kt_bench_task *task, long repetitions) {
    if (repetitions > 1)
        task->run(task->user, 1); /* brings back the data that other tasks drove from the cache */
    return seconds_of(task, repetitions) / (double)repetitions;
}

void kt_bench_measure(const kt_bench_task *tasks, int count, double seconds, kt_bench_times *times) {
    const double slice = fmax(slice_least, seconds / (count * (double)KT_BENCH_ROUNDS_MOST));
    double lasts = 0.0;
    for (int i = 0; i < count; i++) {
        double once;
        times[i].repetitions = calibrate(&tasks[i], slice, &once);
        lasts += once;
    }
    const int rounds = (int)fmin(KT_BENCH_ROUNDS_MOST, fmax(KT_BENCH_ROUNDS_LEAST, seconds / lasts));
    for (int round = 0; round < rounds; round++)
        for (int turn = 0; turn < count; turn++) {
            const int i = round % 2 ? count - 1 - turn : turn;
            times[i].sample[round] = sample(&tasks[i], times[i].repetitions);
        }
    for (int i = 0; i < count; i++) {
        times[i].rounds = rounds;
        kt_bench_sort(&times[i]);
    }
}

static int ascending(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Between the two neighbours of the place part * (count - 1), in proportion. */
static double quantile(const double *sorted, int count, double part) {
    const double place = part * (count - 1);
    const int below = (int)place;
    const int above = below + 1 < count ? below + 1 : below;
    return sorted[below] + (place - below) * (sorted[above] - sorted[below]);
}

void kt_bench_sort(kt_bench_times *times) {
    double sorted[KT_BENCH_ROUNDS_MOST];
    memcpy(sorted, times->sample, (size_t)times->rounds * sizeof *sorted);
    qsort(sorted, (size_t)times->rounds, sizeof *sorted, ascending);
    times->least = sorted[0];
    times->low = quantile(sorted, times->rounds, 0.25);
    times->median = quantile(sorted, times->rounds, 0.5);
    times->high = quantile(sorted, times->rounds, 0.75);
}

kt_bench_ratio kt_bench_compare(const kt_bench_times *part, const kt_bench_times *whole) {
    kt_bench_times ratios = {.rounds = part->rounds};
    for (int i = 0; i < ratios.rounds; i++)
        ratios.sample[i] = part->sample[i] / whole->sample[i];
    kt_bench_sort(&ratios);
    return (kt_bench_ratio){.low = ratios.low, .median = ratios.median, .high = ratios.high};
}

double kt_bench_exponent(const double *x, const double *y, int count) {
    double mean_x = 0.0, mean_y = 0.0, xx = 0.0, xy = 0.0;
    for (int i = 0; i < count; i++) {
        mean_x += log(x[i]) / count;
        mean_y += log(y[i]) / count;
    }
    for (int i = 0; i < count; i++) {
        const double dx = log(x[i]) - mean_x;
        xx += dx * dx;
        xy += dx * (log(y[i]) - mean_y);
    }
    return xy / xx; /* 0 / 0 for a single point */
}
