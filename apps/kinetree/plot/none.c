/* Replaces plot.c in builds without cairo. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "draw/draw.h"
#include "plot/plot.h"

bool kt_plot_is_possible(void) { return false; }

int kt_plot_check(const char *path) {
    return kt_misuse("%s cannot be drawn: this kinetree was built without cairo", path);
}

int kt_plot_draw(const kt_plot *plot, const char *path) {
    (void)plot;
    (void)kt_plot_check(path);
    return KT_EXIT_USAGE;
}

int kt_plot_shapes(const kt_shape_plot *plot, const char *path) {
    (void)plot;
    (void)kt_plot_check(path);
    return KT_EXIT_USAGE;
}

int kt_drawing_write(const kt_drawing *drawing, const char *path) {
    (void)drawing;
    (void)kt_plot_check(path);
    return KT_EXIT_USAGE;
}

double kt_drawing_grain(const kt_drawing *drawing) {
    (void)drawing;
    return 0.0;
}

int kt_animation_write(const kt_drawing *drawing, double seconds, const char *path, int *frames, size_t *bytes) {
    (void)drawing;
    (void)seconds;
    *frames = 0;
    *bytes = 0;
    (void)kt_plot_check(path);
    return KT_EXIT_USAGE;
}
