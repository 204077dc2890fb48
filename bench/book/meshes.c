/* Ladders, nets and rows of loops of one size, as a line of numbers for bench/book/meshes.py.
 *
 *     bench-book-meshes SHAPE CELLS SECONDS
 *
 * SHAPE is a name of kt_bars_shape_name. Printed are the coordinates, the equations of the loops, the independent ones
 * among them, and the largest closure error relative to the mechanism's length. It is measured after a projection of a
 * state that is slightly open, and after STEPS steps of rk4 with projections. The last number is the time of an
 * evaluation, measured for SECONDS. If SECONDS is zero, a counting tool watches a single evaluation in
 * kt_bars_accelerate. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scaling/bars.h"

#include "bench.h"

#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS = 10 };
static const double step = 1e-3;

static int meshes_tell(const kt_error *error) {
    (void)fprintf(stderr, "%s\n", error->message);
    return 2;
}

/* The largest gap of a loop at (q, v); NaN if it is not known. */
static double gap_at(const kt_bars *bars, const double *q, const double *v, kt_error *error) {
    kt_residual residual;
    if (kt_loop_residual(bars->stepped, bars->data, 0.0, q, v, &residual, error) != KT_OK)
        return (double)NAN;
    return residual.position;
}

static double gap_after_projection(kt_bars *bars) {
    kt_bars_project(bars, 1);
    return bars->error.code == KT_OK ? gap_at(bars, bars->moved, bars->moved + kt_model_nq(bars->stepped), &bars->error)
                                     : (double)NAN;
}

static double gap_after_steps(kt_bars *bars) {
    kt_simulation *simulation = NULL;
    kt_run run = kt_run_default();
    run.duration = STEPS * step;
    run.integrator = "rk4";
    run.step = step;
    double gap = (double)NAN;
    if (kt_simulation_create(bars->stepped, &run, NULL, &simulation, &bars->error) == KT_OK &&
        kt_simulation_advance(simulation, run.duration, &bars->error) == KT_OK)
        gap = gap_at(bars, kt_simulation_positions(simulation), kt_simulation_velocities(simulation), &bars->error);
    kt_simulation_free(simulation);
    return gap;
}

static int print_measured(kt_bars *bars, double length, double seconds) {
    kt_bench_times times;
    const kt_bench_task task = {kt_bars_accelerate, bars};
    const double projected = gap_after_projection(bars), stepped = gap_after_steps(bars);
    int equations = 0, rank = 0;
    for (int g = 0; g < kt_loop_group_count(bars->stepped); g++) {
        const kt_loop_group group = kt_loop_group_at(bars->stepped, g);
        equations += group.equations;
        rank += group.rank;
    }
    kt_bench_measure(&task, 1, seconds, &times);
    if (bars->error.code != KT_OK)
        return meshes_tell(&bars->error);
    printf("%d,%d,%d,%.3g,%.3g,%.6g\n", kt_model_nv(bars->stepped), equations, rank, projected / length,
           stepped / length, times.low);
    return 0;
}

int main(int argc, char **argv) {
    int shape = 0;
    if (argc != 4)
        return 2;
    while (shape < KT_BARS_SHAPES && strcmp(argv[1], kt_bars_shape_name[shape]) != 0)
        shape++;
    const int cells = (int)strtol(argv[2], NULL, 10);
    const double seconds = strtod(argv[3], NULL);
    kt_model_options options = kt_model_options_default();
    kt_bars bars;
    kt_error error;
    if (shape == KT_BARS_SHAPES || cells < 1)
        return 2;
    if (!(seconds > 0.0)) /* valgrind does not know all instructions of the other levels */
        options.isa = KT_ISA_BASE;
    (void)setenv("OPENBLAS_NUM_THREADS", "1", 1);
    if (kt_bars_make((kt_bars_shape)shape, cells, false, KT_FORMULATION_TREE, &options, &bars, &error) != KT_OK)
        return meshes_tell(&error);
    int status = 0;
    if (seconds > 0.0)
        status = print_measured(&bars, cells, seconds);
    else {
        kt_bars_accelerate(&bars, 1);
        status = bars.error.code == KT_OK ? 0 : meshes_tell(&bars.error);
    }
    kt_bars_free(&bars);
    return status;
}
