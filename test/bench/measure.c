/* The clock and the statistics of the benchmarks. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "bench.h"
#include "check.h"

#include <float.h>
#include <math.h>

/* ---- statistics -------------------------------------------------------------------------------------------------- */

KT_TEST(quartiles_are_those_of_the_sorted_samples) {
    kt_bench_times t = {.sample = {7, 2, 9, 4, 5, 6, 1, 8, 3}, .rounds = 9};
    kt_bench_sort(&t);
    kt_check_near("least", t.least, 1.0, 0.0);
    kt_check_near("low", t.low, 3.0, 0.0);
    kt_check_near("median", t.median, 5.0, 0.0);
    kt_check_near("high", t.high, 7.0, 0.0);
    kt_check_near("samples keep their rounds", t.sample[2], 9.0, 0.0);
    t.rounds = 6; /* `2 4 5 6 7 9`: between two samples, in proportion */
    kt_bench_sort(&t);
    kt_check_near("low of six", t.low, 4.25, 0.0);
    kt_check_near("median of six", t.median, 5.5, 0.0);
    kt_check_near("high of six", t.high, 6.75, 0.0);
    t.rounds = 1;
    kt_bench_sort(&t);
    kt_check_near("high of one", t.high, 7.0, 0.0);
}

KT_TEST(ratio_compares_round_by_round) {
    /* A disturbance that strikes both in one round moves no quartile. */
    kt_bench_times part = {.sample = {1, 10, 1, 2, 1}, .rounds = 5}, whole = {.sample = {4, 40, 4, 8, 2}, .rounds = 5};
    const kt_bench_ratio r = kt_bench_compare(&part, &whole);
    kt_check_near("low", r.low, 0.25, 0.0);
    kt_check_near("median", r.median, 0.25, 0.0);
    kt_check_near("high", r.high, 0.25, 0.0);
}

KT_TEST(exponent_of_a_power_law_is_its_power) {
    enum { COUNT = 7 };
    double x[COUNT], y[COUNT];
    for (int i = 0; i < COUNT; i++) {
        x[i] = pow(10.0, i - 1);
        y[i] = 3.0 * pow(x[i], 1.7);
    }
    kt_check_near("exponent", kt_bench_exponent(x, y, COUNT), 1.7, 4.0 * DBL_EPSILON);
    kt_check_true("a single point has none", isnan(kt_bench_exponent(x, y, 1)));
}

/* ---- the clock --------------------------------------------------------------------------------------------------- */

enum { LOG_SIZE = 4096 };

typedef struct spinner {
    double seconds; /* of processor time, each repetition */
    int id;
    struct log {
        int count;
        int id[LOG_SIZE];
        long repetitions[LOG_SIZE];
    } * log;
} spinner;

static void spin(void *user, long repetitions) {
    const spinner *s = user;
    if (s->log->count < LOG_SIZE) {
        s->log->id[s->log->count] = s->id;
        s->log->repetitions[s->log->count++] = repetitions;
    }
    for (long k = 0; k < repetitions; k++)
        for (const double start = kt_bench_clock(); kt_bench_clock() - start < s->seconds;) {
        }
}

KT_TEST(samples_are_processor_time_a_call) {
    struct log log = {.count = 0};
    spinner spinners[] = {{2e-5, 0, &log}, {1e-3, 1, &log}};
    const kt_bench_task tasks[] = {{spin, &spinners[0]}, {spin, &spinners[1]}};
    kt_bench_times times[2];
    kt_bench_measure(tasks, 2, 0.05, times);
    for (int i = 0; i < 2; i++) {
        /* The time is at least that of spinning. The clock adds a small part. */
        kt_check_above("least", times[i].least, spinners[i].seconds);
        kt_check_below("least", times[i].least, 1.5 * spinners[i].seconds);
        kt_check_above("rounds", times[i].rounds, KT_BENCH_ROUNDS_LEAST);
    }
    kt_check_above("the short one is repeated", (double)times[0].repetitions, 10);
    kt_check_equal_int("the long one is not", times[1].repetitions, 1);
    kt_check_equal_int("rounds", times[0].rounds, times[1].rounds);
}

KT_TEST(rounds_go_forwards_and_backwards) {
    struct log log = {.count = 0};
    spinner spinners[] = {{1e-3, 0, &log}, {1e-3, 1, &log}, {1e-3, 2, &log}};
    const kt_bench_task tasks[] = {{spin, &spinners[0]}, {spin, &spinners[1]}, {spin, &spinners[2]}};
    kt_bench_times times[3];
    kt_bench_measure(tasks, 3, 0.03, times);
    const int samples = 3 * times[0].rounds; /* one repetition each: no run to warm up */
    static const int order[] = {0, 1, 2, 2, 1, 0};
    int wrong = 0;
    for (int i = 0; i < samples && samples <= log.count; i++)
        wrong += log.id[log.count - samples + i] != order[i % 6];
    kt_check_equal_int("out of turn", wrong, 0);
    kt_check_above("samples", samples, 3 * KT_BENCH_ROUNDS_LEAST);
    kt_check_equal_int("all were logged", log.count >= samples && log.count < LOG_SIZE, 1);
}
