/* Timing that tolerates noise. Several tasks are timed in turns, in many short rounds, and compared round by round.
 *
 * A sample is the processor time of the calling thread for enough repetitions to last a slice, divided by their number.
 * Rounds visit the tasks forwards and backwards by turns, so that a slow drift strikes all alike.
 *
 * The figure to quote is the lower quartile, not the least. Other programs, interrupts and changes of the processor's
 * pace make samples longer. A virtual machine's accounting also makes some samples too short. In one measurement the
 * quartiles were 35 and 37 ns. One of its 370 samples was 27 ns. Two tasks are compared by the median of their ratios
 * round by round.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_H
#define KT_BENCH_H

#include <stdbool.h>

/* Something to time: does its work `repetitions` times. */
typedef struct kt_bench_task {
    void (*run)(void *user, long repetitions);
    void *user;
} kt_bench_task;

enum { KT_BENCH_ROUNDS_LEAST = 5, KT_BENCH_ROUNDS_MOST = 400 };

/* Seconds a call, one sample a round; then sorted figures of them. */
typedef struct kt_bench_times {
    double sample[KT_BENCH_ROUNDS_MOST];
    int rounds;
    long repetitions;                /* a sample's */
    double least, low, median, high; /* the least, and the quartiles */
} kt_bench_times;

/* Cost of one task as a part of another's: quartiles of the ratios round by round. */
typedef struct kt_bench_ratio {
    double low, median, high;
} kt_bench_ratio;

/* Seconds of processor time that this thread has used. */
double kt_bench_clock(void);

/* Times the tasks in turns for about `seconds` of processor time in all, at least KT_BENCH_ROUNDS_LEAST rounds. */
void kt_bench_measure(const kt_bench_task *tasks, int count, double seconds, kt_bench_times *times);

/* Fills the sorted figures from the samples. */
void kt_bench_sort(kt_bench_times *times);

/* Compares two tasks that were timed in the same call of kt_bench_measure. */
kt_bench_ratio kt_bench_compare(const kt_bench_times *part, const kt_bench_times *whole);

/* The exponent p of y ~ x^p by least squares in the logarithms, over `count` positive pairs; NaN for less than two. */
double kt_bench_exponent(const double *x, const double *y, int count);

#endif
