/* The picture of a run. Angles, lengths and quaternions have a panel each, where there are any: they share no unit. */
#include "plot_run.h"

#include "kinetree/descriptor.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef enum kt_quantity {
    KT_QUANTITY_ANGLE,
    KT_QUANTITY_LENGTH,
    KT_QUANTITY_QUATERNION,
    KT_QUANTITY_COUNT
} kt_quantity;

/* A coordinate that is drawn. */
typedef struct kt_curve {
    int q; /* its place among the positions */
    char label[96];
} kt_curve;

typedef struct kt_curves {
    kt_curve curve[KT_PLOT_SERIES_MAX];
    int count, left_out;
} kt_curves;

struct kt_plot_run {
    kt_curves curves[KT_QUANTITY_COUNT];
    int width;    /* numbers a record: time, energy, curves in order */
    double *rows; /* column-major would move at each growth; rows only append */
    size_t count, room;
    double energy_start; /* total; or where works are recorded, the balance */
};

/* What position k of a joint measures. */
static kt_quantity find_quantity(kt_joint_type type, int k) {
    switch (kt_joint_coordinate_kind(type, k)) {
    case KT_COORDINATE_LENGTH:
    case KT_COORDINATE_PLACE:
        return KT_QUANTITY_LENGTH;
    case KT_COORDINATE_ROTATION:
        return KT_QUANTITY_QUATERNION;
    case KT_COORDINATE_ANGLE:
    case KT_COORDINATE_TURNS:
    case KT_COORDINATE_NONE:
        break;
    }
    return KT_QUANTITY_ANGLE;
}

static void add_curve(kt_curves *curves, const char *name, const kt_coordinates *at, int k) {
    if (curves->count == KT_PLOT_SERIES_MAX) {
        curves->left_out++;
        return;
    }
    kt_curve *curve = &curves->curve[curves->count++];
    curve->q = at->q + k;
    if (at->nq == 1)
        snprintf(curve->label, sizeof curve->label, "%s", name);
    else
        snprintf(curve->label, sizeof curve->label, "%.80s[%d]", name, k);
}

kt_plot_run *kt_plot_run_start(const kt_model *model) {
    kt_plot_run *plot = calloc(1, sizeof *plot);
    if (plot == NULL)
        return NULL;
    for (int body = 1; body < kt_model_body_count(model); body++) {
        kt_coordinates at = kt_body_coordinates(model, body);
        for (int k = 0; k < at.nq; k++)
            add_curve(&plot->curves[find_quantity(at.type, k)], kt_body_name(model, body), &at, k);
    }
    plot->width = 2;
    for (int i = 0; i < KT_QUANTITY_COUNT; i++)
        plot->width += plot->curves[i].count;
    return plot;
}

int kt_plot_run_take(kt_plot_run *plot, const kt_record *record) {
    if (plot->count == plot->room) {
        size_t room = plot->room == 0 ? 1024 : 2 * plot->room;
        double *rows = realloc(plot->rows, room * (size_t)plot->width * sizeof *rows);
        if (rows == NULL) {
            kt_say("there is not enough memory for the picture");
            return -1;
        }
        plot->rows = rows;
        plot->room = room;
    }
    double balance = kt_balance_of(record), total = record->kinetic + record->potential;
    if (!isnan(balance))
        total = balance;
    if (plot->count == 0)
        plot->energy_start = total;
    double *row = plot->rows + plot->count++ * (size_t)plot->width;
    *row++ = record->time;
    *row++ = total - plot->energy_start;
    for (int i = 0; i < KT_QUANTITY_COUNT; i++)
        for (int k = 0; k < plot->curves[i].count; k++)
            *row++ = record->q[plot->curves[i].curve[k].q];
    return 0;
}

static void describe(const kt_outcome *outcome, char *text, size_t size) {
    const kt_run *run = outcome->run;
    if (run->step > 0.0)
        snprintf(text, size, "%s, step %g s", run->integrator, run->step);
    else if (run->relative == run->absolute)
        snprintf(text, size, "%s, tolerance %g", run->integrator, run->relative);
    else
        snprintf(text, size, "%s, tolerances %g relative, %g absolute", run->integrator, run->relative, run->absolute);
}

/* columns: width columns of count numbers each. */
static int draw(const kt_plot_run *plot, const double *columns, const kt_outcome *outcome, const char *path,
                bool is_dark) {
    static const char *const titles[] = {"Angles", "Lengths", "Quaternions"};
    static const char *const units[] = {"rad", "m", NULL};
    const bool is_error = outcome->energy.has_balance || outcome->energy.energetics == KT_ENERGY_CONSERVED;
    kt_plot_series series[KT_QUANTITY_COUNT + 1][KT_PLOT_SERIES_MAX];
    kt_plot_panel panels[KT_QUANTITY_COUNT + 1];
    int panel_count = 0, column = 2;
    for (int i = 0; i < KT_QUANTITY_COUNT; i++) {
        const kt_curves *curves = &plot->curves[i];
        for (int k = 0; k < curves->count; k++, column++)
            series[i][k] = (kt_plot_series){.label = curves->curve[k].label,
                                            .x = columns,
                                            .y = columns + (size_t)column * plot->count,
                                            .count = plot->count,
                                            .is_dense = true};
        if (curves->count > 0)
            panels[panel_count++] = (kt_plot_panel){.title = titles[i],
                                                    .unit = units[i],
                                                    .series = series[i],
                                                    .series_count = curves->count,
                                                    .left_out = curves->left_out,
                                                    .has_legend = true};
    }
    series[KT_QUANTITY_COUNT][0] = (kt_plot_series){.label = is_error ? "drift" : "change",
                                                    .x = columns,
                                                    .y = columns + plot->count,
                                                    .count = plot->count,
                                                    .is_dense = true};
    panels[panel_count++] = (kt_plot_panel){.title = outcome->energy.has_balance ? "Drift of the energy balance"
                                                     : is_error                  ? "Drift of the total energy"
                                                                                 : "Change of the total energy",
                                            .unit = "J",
                                            .series = series[KT_QUANTITY_COUNT],
                                            .series_count = 1};
    char subtitle[96];
    describe(outcome, subtitle, sizeof subtitle);
    kt_plot picture = {.title = outcome->name,
                       .subtitle = subtitle,
                       .x_title = "time",
                       .x_unit = "s",
                       .panels = panels,
                       .panel_count = panel_count,
                       .is_dark = is_dark};
    return kt_plot_draw(&picture, path);
}

int kt_plot_run_write(const kt_plot_run *plot, const kt_outcome *outcome, const char *path, bool is_dark) {
    size_t width = (size_t)plot->width;
    double *columns = malloc((plot->count * width + 1) * sizeof *columns);
    if (columns == NULL) {
        kt_say("there is not enough memory for the picture");
        return KT_EXIT_INTEGRATION;
    }
    for (size_t i = 0; i < plot->count; i++)
        for (size_t k = 0; k < width; k++)
            columns[k * plot->count + i] = plot->rows[i * width + k];
    int code = draw(plot, columns, outcome, path, is_dark);
    free(columns);
    return code;
}

void kt_plot_run_free(kt_plot_run *plot) {
    if (plot != NULL)
        free(plot->rows);
    free(plot);
}
