/* Mechanisms of many loops that share bodies: the growth of evaluation, projection after a step, assembly and set-up
 * with the size. An evaluation is also compared with that of the same bodies without loops.
 *
 * A line is trusted if nothing was allocated after set-up, and if the forces of joints and loops do no work. The work
 * is measured as in loops.c. The bound is 1e-8 here, because the accelerations of a chain grow with the cube of its
 * length.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "chains.h"

#include "bars.h"
#include "interpose.h"

#include "kinetree/dynamics.h"

#include <stdlib.h>

enum { SIZES_MAX = 5, TREE = 0, LOOPS, PROJECTION, ASSEMBLY, TASKS };
static const char *const task_name[TASKS] = {"no loops", "tree", "projection", "assembly"};
static const double error_most = 1e-8;

/* most: the largest size, times options->max. */
typedef struct chain {
    kt_bars_shape shape;
    const char *name, *title;
    int most;
    kt_plan plan;
} chain;

static const chain chains[] = {
    {KT_BARS_CHAINED, "row", "A row of n windows", 10, KT_PLAN_AUTO},
    {KT_BARS_CHAINED, "row by spatial kernels", "A row of n windows by spatial kernels", 1, KT_PLAN_SPATIAL},
    {KT_BARS_ROPE, "rope", "A rope of n rods, held at both ends, in a plane", 100, KT_PLAN_AUTO},
    {KT_BARS_ROPE_IN_SPACE, "rope in space", "A rope of n rods in space, revolute joints", 100, KT_PLAN_AUTO},
    {KT_BARS_ROPE_OF_BALLS, "rope of balls", "A rope of n rods in space, spherical joints", 100, KT_PLAN_AUTO},
    {KT_BARS_SCISSORS, "scissors", "A scissor lift of n stages", 10, KT_PLAN_AUTO},
    {KT_BARS_LADDER, "ladder", "A ladder of n rungs in space", 10, KT_PLAN_AUTO},
    {KT_BARS_NET, "net", "A net of 3 x n rods in a plane", 10, KT_PLAN_AUTO},
    {KT_BARS_GRID, "grid", "A grid of 3 x n windows", 10, KT_PLAN_AUTO},
    {KT_BARS_BRANCHES, "branches", "A binary tree of n links, each with a row of three windows", 10, KT_PLAN_AUTO},
    {KT_BARS_FORK, "fork", "A row of n windows that forks", 10, KT_PLAN_AUTO},
    {KT_BARS_FREER, "freer row", "A row of n windows of five bars, which have n + 1 degrees of freedom", 10,
     KT_PLAN_AUTO},
    {KT_BARS_SPHERICAL, "spherical row", "A row of n windows whose axes meet in a point", 10, KT_PLAN_AUTO},
    {KT_BARS_BENNETT, "row of Bennett's", "A row of n of Bennett's linkages", 10, KT_PLAN_AUTO},
};

typedef struct line {
    int n;
    kt_isa isa;
    kt_bench_times times[TASKS];
    double set_up, error;
    long allocations;
} line;

static kt_status measure(const chain *c, int n, const kt_bench_options *options, line *out, kt_error *error) {
    kt_bars bars[2];
    kt_status status = KT_OK;
    int made = 0;
    *out = (line){.n = n};
    for (; made < 2 && status == KT_OK; made += status == KT_OK) {
        kt_model_options settings = kt_model_options_default();
        settings.isa = options->isa;
        settings.plan = c->plan;
        status = kt_bars_make(c->shape, n, made == TREE, KT_FORMULATION_TREE, &settings, &bars[made], error);
    }
    if (status == KT_OK) {
        const kt_bench_task tasks[TASKS] = {{kt_bars_accelerate, &bars[TREE]},
                                            {kt_bars_accelerate, &bars[LOOPS]},
                                            {kt_bars_project, &bars[LOOPS]},
                                            {kt_bars_assemble, &bars[LOOPS]}};
        out->isa = kt_model_isa(bars[LOOPS].stepped);
        out->set_up = bars[LOOPS].set_up;
        out->error = kt_bars_idle_work(&bars[LOOPS]);
        kt_interpose_start();
        kt_bars_accelerate(&bars[LOOPS], 2);
        kt_bars_project(&bars[LOOPS], 2);
        out->allocations = kt_interpose_stop();
        kt_bench_measure(tasks, TASKS, options->seconds, out->times);
        for (int k = 0; k < 2 && status == KT_OK; k++)
            if (bars[k].error.code != KT_OK) {
                *error = bars[k].error;
                status = error->code;
            }
    }
    for (int k = 0; k < made; k++)
        kt_bars_free(&bars[k]);
    return status;
}

static bool print_line(const line *l) {
    const bool fine = l->allocations == 0 && l->error <= error_most;
    printf("%7d |%10.3g |%10.4g%8.2f |%11.4g%11.4g%10.3g |%7ld%9.1e%s\n", l->n, 1e6 * l->times[TREE].low,
           1e6 * l->times[LOOPS].low, kt_bench_compare(&l->times[LOOPS], &l->times[TREE]).median,
           1e6 * l->times[PROJECTION].low, 1e3 * l->times[ASSEMBLY].low, 1e3 * l->set_up, l->allocations, l->error,
           fine ? "" : "  NOT TO BE TRUSTED");
    (void)fflush(stdout);
    return fine;
}

static void write_line(kt_csv *csv, const char *name, const line *l) {
    for (int k = 0; k < TASKS; k++) {
        kt_csv_number(csv, l->n);
        kt_csv_text(csv, name);
        kt_csv_text(csv, task_name[k]);
        kt_csv_times(csv, &l->times[k]);
        kt_csv_number(csv, l->set_up);
        kt_csv_number(csv, (double)l->allocations);
        kt_csv_number(csv, l->error);
        kt_csv_origin(csv, l->isa);
        kt_csv_line(csv);
    }
}

static void conclude(const line *lines, int count) {
    double n[SIZES_MAX], y[TASKS + 1][SIZES_MAX];
    for (int i = 0; i < count; i++) {
        n[i] = lines[i].n;
        for (int k = 0; k < TASKS; k++)
            y[k][i] = lines[i].times[k].low;
        y[TASKS][i] = lines[i].set_up;
    }
    printf("exponents from %.0f to %.0f: evaluation %.2f (%.2f without loops), projection %.2f, assembly %.2f, set-up "
           "%.2f\n\n",
           n[0], n[count - 1], kt_bench_exponent(n, y[LOOPS], count), kt_bench_exponent(n, y[TREE], count),
           kt_bench_exponent(n, y[PROJECTION], count), kt_bench_exponent(n, y[ASSEMBLY], count),
           kt_bench_exponent(n, y[TASKS], count));
}

int kt_chains_run(const kt_bench_options *options, kt_csv *csv, bool *trusted) {
    printf(
        "Loops that share bodies. An evaluation without loops and with them in us, and their ratio; a projection from "
        "1e-6 away\nin us; assembly from 1e-3 away and set-up in ms; allocations; work of forces that do none.\n\n");
    for (size_t i = 0; i < sizeof chains / sizeof *chains; i++) {
        const chain *c = &chains[i];
        line *lines = calloc(SIZES_MAX, sizeof *lines);
        int count = 0;
        printf("%s\n%7s |%10s |%10s%8s |%11s%11s%10s |%7s%9s\n", c->title, "n", "no loops", "loops", "times",
               "projection", "assembly", "set-up", "alloc.", "error");
        for (long n = 10; lines && n <= (long)c->most * options->max && count < SIZES_MAX; n *= 10) {
            kt_error error;
            if (measure(c, (int)n, options, &lines[count], &error) != KT_OK) {
                free(lines);
                return kt_bench_tell(&error);
            }
            *trusted &= print_line(&lines[count]);
            write_line(csv, c->name, &lines[count++]);
        }
        if (count > 1)
            conclude(lines, count);
        free(lines);
    }
    return KT_BENCH_DONE;
}
