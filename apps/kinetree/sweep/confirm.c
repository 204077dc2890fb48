/* Confirmation of large sweeps. The expected time is measured on blocks of runs, evenly spaced over the sweep. The
 * first runs of a grid may cost less or more than others. Blocks grow until they take long enough for a clock. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sweep/sweep.h"

#include "subcommands/run.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { MANY = 100000, BLOCKS = 8, ROUNDS = 3, LARGEST_BLOCK = 8192 };
static const double timed = 0.25, patience = 1.0; /* s, of all blocks: enough after ROUNDS; after which none begins */

static int drop(void *user, int64_t run, const kt_sweep_result *result) {
    (void)user;
    (void)run;
    (void)result;
    return 0;
}

/* Returns the expected time of the runs first to end - 1, s; -1: memory is insufficient. Blocks of runs begin at BLOCKS
 * places of the sweep, and each round has larger ones. The quickest block of a place counts: others waited for a
 * processor, or for files that were read for the first time. */
static double expect_time(const kt_sweep *sweep, int64_t first, int64_t end, int threads) {
    double quickest[BLOCKS], all = 0.0; /* s for each run */
    const double begin = kt_clock();
    int64_t places = 0;
    for (int i = 0; i < BLOCKS; i++)
        quickest[i] = INFINITY;
    for (int64_t size = threads, round = 1;; size *= 2, round++) {
        for (int64_t i = 0; i < BLOCKS && (i + places == 0 || kt_clock() - begin < patience); i++) {
            kt_sweep_worker worker = {.has_scene = false};
            const int64_t from = first + (end - first) / BLOCKS * i;
            const double start = kt_clock();
            if (kt_sweep_run_all(sweep, from, from + size, threads, drop, NULL, &worker) != 0)
                return -1.0;
            const double each = (kt_clock() - start) / (double)size;
            quickest[i] = fmin(quickest[i], each);
            places = i < places ? places : i + 1;
        }
        const double spent = kt_clock() - begin;
        if ((spent > timed && round >= ROUNDS) || spent > patience || 2 * size > LARGEST_BLOCK)
            break;
    }
    for (int64_t i = 0; i < places; i++)
        all += quickest[i];
    return all / (double)places * (double)(end - first);
}

static void describe_time(double seconds, char *text, size_t size) {
    static const struct {
        double unit;
        const char *name;
    } units[] = {{86400.0, "days"}, {3600.0, "h"}, {60.0, "min"}, {1.0, "s"}};
    size_t i = 0;
    while (i < 3 && seconds < 1.5 * units[i].unit)
        i++;
    (void)snprintf(text, size, seconds < 9.5 * units[i].unit ? "%.1f %s" : "%.0f %s", seconds / units[i].unit,
                   units[i].name);
}

/* Reads a line from standard input. Returns whether it is y or yes. */
static bool is_confirmed(void) {
    char answer[16];
    if (fgets(answer, sizeof answer, stdin) == NULL)
        return false;
    answer[strcspn(answer, "\r\n")] = '\0';
    return strcmp(answer, "y") == 0 || strcmp(answer, "Y") == 0 || strcmp(answer, "yes") == 0;
}

int kt_sweep_confirm(const kt_sweep *sweep, int64_t first, int64_t end, int threads) {
    const long long runs = end - first;
    char words[48];
    if (runs <= MANY || sweep->arguments->quiet)
        return -1;
    const bool is_scene = strcmp(sweep->path, "-") == 0; /* standard input has the scene, and no answer */
    if (threads == 0 || is_scene || !isatty(STDIN_FILENO) || !isatty(STDERR_FILENO)) {
        kt_say("sweep: %lld runs", runs);
        return -1;
    }
    fprintf(stderr, "%lld runs; timing some of them ...", runs);
    const double seconds = expect_time(sweep, first, end, threads);
    if (seconds < 0.0)
        return KT_EXIT_INTEGRATION;
    describe_time(seconds, words, sizeof words);
    fprintf(stderr, "\r\033[K%lld runs take about %s. Start? [y/N] ", runs, words);
    if (is_confirmed())
        return -1;
    return kt_misuse(
        "sweep: not started; answer y to start, or give fewer values; --quiet starts without the question");
}
