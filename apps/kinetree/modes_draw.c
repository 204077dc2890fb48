/* kinetree modes --plot: the shapes of the slowest modes as bars. */
#include "command.h"
#include "linear.h"
#include "plot_shapes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { PANELS_MOST = 8, NAMES_MOST = 500 };

typedef struct kt_shapes {
    kt_shape_panel panel[PANELS_MOST];
    kt_coordinate_name name[NAMES_MOST];
    const char *text[NAMES_MOST];
    double bars[PANELS_MOST][2 * NAMES_MOST];
} kt_shapes;

/* Each coordinate against its unit; the largest is 1 and real. */
static void fill_bars(const kt_small_motion *motion, int mode, double *bars) {
    const kt_linear_system *system = kt_linearization_system(motion->linearization);
    const double *shape = kt_modes_positions(motion->modes, mode);
    for (int i = 0; i < 2 * system->coordinates; i++)
        bars[i] = shape[i] / system->unit[i / 2];
}

static void name_panel(kt_shape_panel *panel, int number, const kt_mode *mode) {
    if (mode->imaginary > 0.0)
        snprintf(panel->title, sizeof panel->title, "%d: %.4g Hz, damping ratio %.3f", number, mode->frequency,
                 fabs(mode->real) > mode->error ? mode->damping : 0.0);
    else
        snprintf(panel->title, sizeof panel->title, "%d: %s, time constant %.3g s", number,
                 mode->real > 0.0 ? "growth" : "decay", 1.0 / fabs(mode->real));
}

int kt_modes_draw(const kt_small_motion *motion, const char *state, const char *path, bool is_dark) {
    const kt_linear_system *system = kt_linearization_system(motion->linearization);
    kt_shapes *shapes = calloc(1, sizeof *shapes);
    char subtitle[160];
    if (shapes == NULL) {
        kt_say("there is not enough memory for the picture");
        return KT_EXIT_INTEGRATION;
    }
    kt_shape_plot plot = {.title = motion->name,
                          .subtitle = subtitle,
                          .names = shapes->text,
                          .count = system->coordinates < NAMES_MOST ? system->coordinates : NAMES_MOST,
                          .panels = shapes->panel,
                          .is_dark = is_dark};
    for (int i = 0; i < plot.count; i++) {
        shapes->name[i] = kt_name_coordinate(motion->model, i);
        shapes->text[i] = shapes->name[i].text;
    }
    int number = 0;
    for (int i = 0; i < kt_modes_count(motion->modes); i++) {
        const kt_mode mode = kt_modes_at(motion->modes, i);
        if (kt_mode_is_neutral(&mode))
            continue;
        number++;
        if (plot.panel_count == PANELS_MOST)
            continue;
        kt_shape_panel *panel = &shapes->panel[plot.panel_count];
        panel->bars = shapes->bars[plot.panel_count++];
        fill_bars(motion, i, shapes->bars[plot.panel_count - 1]);
        name_panel(panel, number, &mode);
    }
    snprintf(subtitle, sizeof subtitle, "Shapes of %s%d modes about its %s, by joints",
             number > PANELS_MOST ? "the slowest of " : "", number, state);
    const int code = kt_plot_shapes(&plot, path);
    free(shapes);
    return code;
}
