/* The picture of a run: the recorded quantities, with one panel for each unit, and the drift of the energy. */
#include "plot/run.h"

#include "kinetree/descriptor.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* X(id, title, unit): the panels, in their order */
#define QUANTITY_LIST(X)                                                                                               \
    X(ANGLE, "Angles", "rad")                                                                                          \
    X(LENGTH, "Lengths", "m")                                                                                          \
    X(QUATERNION, "Quaternions", NULL)                                                                                 \
    X(ANGULAR_VELOCITY, "Angular velocities", "rad/s")                                                                 \
    X(SPEED, "Velocities", "m/s")                                                                                      \
    X(ANGULAR_ACCELERATION, "Angular accelerations", "rad/s\u00b2")                                                    \
    X(ACCELERATION, "Accelerations", "m/s\u00b2")                                                                      \
    X(MARKER, "Markers", "m")                                                                                          \
    X(FORCE, "Reactions: forces", "N")                                                                                 \
    X(MOMENT, "Reactions: moments", "N m")                                                                             \
    X(OPEN, "Loops open by", "m or rad, and per second")

typedef enum quantity {
#define QUANTITY_ENUM(id, title, unit) QUANTITY_##id,
    QUANTITY_LIST(QUANTITY_ENUM)
#undef QUANTITY_ENUM
        QUANTITY_COUNT
} quantity;

/* Source of a curve in a record. */
typedef enum source {
    SOURCE_POSITION,     /* q[index] */
    SOURCE_VELOCITY,     /* v[index] */
    SOURCE_ACCELERATION, /* a[index] */
    SOURCE_MARKER,       /* coordinate `component` of marker `index` of the run */
    SOURCE_JOINT,        /* component of reactions[index] */
    SOURCE_LOOP,         /* component of loop_reactions[index] */
    SOURCE_OPEN,         /* residuals of positions (0) or velocities (1) */
} source;

typedef struct curve {
    source from;
    int index, component;
    char label[96];
} curve;

typedef struct curves {
    curve curve[KT_PLOT_SERIES_MAX];
    int count, left_out;
} curves;

struct kt_plot_run {
    const kt_model *model;
    const kt_run *run;
    bool has_energy; /* there is a panel for the energy */
    curves curves[QUANTITY_COUNT];
    int width;    /* numbers per record: time, energy, curves in order */
    double *rows; /* row-major: rows can be appended without moving the others */
    size_t count, room;
    double energy_start; /* J, total energy, or the balance if the works are recorded */
};

/* ---- selection of curves ----------------------------------------------------------------------------------------- */

static void add_curve(kt_plot_run *plot, quantity panel, source from, int index, int component, const char *format, ...)
    KT_PRINTF(6, 7);

static void add_curve(kt_plot_run *plot, quantity panel, source from, int index, int component, const char *format,
                      ...) {
    curves *all = &plot->curves[panel];
    va_list arguments;
    if (all->count == KT_PLOT_SERIES_MAX) {
        all->left_out++;
        return;
    }
    curve *one = &all->curve[all->count++];
    one->from = from;
    one->index = index;
    one->component = component;
    va_start(arguments, format);
    vsnprintf(one->label, sizeof one->label, format, arguments);
    va_end(arguments);
}

/* Returns the panel for component k of a joint's positions (or velocities), as if they were positions. */
static quantity find_quantity(kt_joint_type type, int k, bool of_velocity) {
    switch (kt_joint_coordinate_kind(type, k)) {
    case KT_COORDINATE_LENGTH:
    case KT_COORDINATE_TRANSLATION:
        return QUANTITY_LENGTH;
    case KT_COORDINATE_ROTATION:
        return of_velocity ? QUANTITY_ANGLE : QUANTITY_QUATERNION;
    case KT_COORDINATE_ANGLE:
    case KT_COORDINATE_TURNS:
    case KT_COORDINATE_NONE:
        break;
    }
    return QUANTITY_ANGLE;
}

/* `length`: the panel of lengths; the panel of angles is the one before it. */
static void add_coordinates(kt_plot_run *plot, source from, quantity length) {
    const bool of_velocity = from != SOURCE_POSITION;
    for (int body = 1; body < kt_model_body_count(plot->model); body++) {
        const kt_coordinates at = kt_body_coordinates(plot->model, body);
        const int first = of_velocity ? at.v : at.q, count = of_velocity ? at.nv : at.nq;
        for (int k = 0; k < count; k++) {
            const quantity of = find_quantity(at.type, k, of_velocity);
            const quantity panel = of == QUANTITY_LENGTH ? length : of == QUANTITY_ANGLE ? length - 1 : of;
            if (count == 1)
                add_curve(plot, panel, from, first, 0, "%s", kt_body_name(plot->model, body));
            else
                add_curve(plot, panel, from, first + k, 0, "%.80s[%d]", kt_body_name(plot->model, body), k);
        }
    }
}

static void add_markers(kt_plot_run *plot) {
    for (int i = 0; i < plot->run->marker_count; i++)
        for (int k = 0; k < 3; k++)
            add_curve(plot, QUANTITY_MARKER, SOURCE_MARKER, i, k, "%.40s.%.40s.%c",
                      plot->run->markers[i].body != NULL ? plot->run->markers[i].body : "world",
                      plot->run->markers[i].marker, "xyz"[k]);
}

static void add_reaction(kt_plot_run *plot, source from, int index, const char *name) {
    for (int k = 0; k < 6; k++)
        add_curve(plot, k < 3 ? QUANTITY_FORCE : QUANTITY_MOMENT, from, index, k, "%.80s.%c%c", name, k < 3 ? 'f' : 'm',
                  "xyz"[k % 3]);
}

static void add_reactions(kt_plot_run *plot) {
    for (int body = 1; body < kt_model_body_count(plot->model); body++)
        add_reaction(plot, SOURCE_JOINT, body, kt_body_name(plot->model, body));
    for (int loop = 0; loop < kt_loop_count(plot->model); loop++)
        if (!kt_descriptor_kind(kt_loop_descriptor(kt_loop_type_of(plot->model, loop)), KT_KEY_TERMS))
            add_reaction(plot, SOURCE_LOOP, loop, kt_loop_name(plot->model, loop));
}

/* Draws everything that --record selects; without a selection the positions and the energy. Markers are always
 * drawn. */
static void choose_curves(kt_plot_run *plot) {
    const unsigned record = plot->run->record != KT_RECORD_DEFAULT ? plot->run->record : KT_RECORD_POSITION;
    plot->has_energy = plot->run->record == KT_RECORD_DEFAULT || (record & (KT_RECORD_ENERGY | KT_RECORD_BALANCE)) != 0;
    if ((record & KT_RECORD_POSITION) != 0)
        add_coordinates(plot, SOURCE_POSITION, QUANTITY_LENGTH);
    if ((record & KT_RECORD_VELOCITY) != 0)
        add_coordinates(plot, SOURCE_VELOCITY, QUANTITY_SPEED);
    if ((record & KT_RECORD_ACCELERATION) != 0)
        add_coordinates(plot, SOURCE_ACCELERATION, QUANTITY_ACCELERATION);
    add_markers(plot);
    if ((record & KT_RECORD_REACTION) != 0)
        add_reactions(plot);
    if ((record & KT_RECORD_CONSTRAINT) != 0 && kt_loop_count(plot->model) > 0) {
        add_curve(plot, QUANTITY_OPEN, SOURCE_OPEN, 0, 0, "positions");
        add_curve(plot, QUANTITY_OPEN, SOURCE_OPEN, 0, 1, "velocities");
    }
}

kt_plot_run *kt_plot_run_start(const kt_model *model, const kt_run *run) {
    kt_plot_run *plot = calloc(1, sizeof *plot);
    if (plot == NULL)
        return NULL;
    plot->model = model;
    plot->run = run;
    choose_curves(plot);
    plot->width = 2;
    for (int i = 0; i < QUANTITY_COUNT; i++)
        plot->width += plot->curves[i].count;
    return plot;
}

/* ---- records ----------------------------------------------------------------------------------------------------- */

static double component_of(const kt_wrench *w, int k) {
    const double x[6] = {w->force.x, w->force.y, w->force.z, w->moment.x, w->moment.y, w->moment.z};
    return x[k];
}

static double marker_of(const kt_plot_run *plot, const kt_record *record, const curve *one) {
    const kt_marker_pair *pair = &plot->run->markers[one->index];
    const int body = pair->body != NULL ? kt_body_find(plot->model, pair->body) : 0;
    const kt_vec3 at = kt_marker_at(plot->model, body, kt_marker_find(plot->model, body, pair->marker));
    const kt_vec3 x = kt_point_position(plot->model, record->data, body, at);
    return one->component == 0 ? x.x : one->component == 1 ? x.y : x.z;
}

/* Zero cannot be shown on the logarithmic axis of residuals. */
static double value_of(const kt_plot_run *plot, const kt_record *record, const curve *one) {
    switch (one->from) {
    case SOURCE_POSITION:
        return record->q[one->index];
    case SOURCE_VELOCITY:
        return record->v[one->index];
    case SOURCE_ACCELERATION:
        return record->a[one->index];
    case SOURCE_MARKER:
        return marker_of(plot, record, one);
    case SOURCE_JOINT:
        return component_of(&record->reactions[one->index], one->component);
    case SOURCE_LOOP:
        return component_of(&record->loop_reactions[one->index], one->component);
    default:
        return one->component == 0 ? record->constraint.position : record->constraint.velocity;
    }
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
    for (int i = 0; i < QUANTITY_COUNT; i++)
        for (int k = 0; k < plot->curves[i].count; k++)
            *row++ = value_of(plot, record, &plot->curves[i].curve[k]);
    return 0;
}

/* columns: width columns of count numbers each. */
static int draw(const kt_plot_run *plot, const double *columns, const kt_outcome *outcome, const char *path,
                bool is_dark) {
    static const char *const titles[] = {
#define QUANTITY_TITLE(id, title, unit) title,
        QUANTITY_LIST(QUANTITY_TITLE)
#undef QUANTITY_TITLE
    };
    static const char *const units[] = {
#define QUANTITY_UNIT(id, title, unit) unit,
        QUANTITY_LIST(QUANTITY_UNIT)
#undef QUANTITY_UNIT
    };
    const bool is_error = outcome->energy.has_balance || outcome->energy.energetics == KT_ENERGY_CONSERVED;
    kt_plot_series series[QUANTITY_COUNT + 1][KT_PLOT_SERIES_MAX];
    kt_plot_panel panels[QUANTITY_COUNT + 1];
    int panel_count = 0, column = 2;
    for (int i = 0; i < QUANTITY_COUNT; i++) {
        const curves *all = &plot->curves[i];
        for (int k = 0; k < all->count; k++, column++)
            series[i][k] = (kt_plot_series){.label = all->curve[k].label,
                                            .x = columns,
                                            .y = columns + (size_t)column * plot->count,
                                            .count = plot->count,
                                            .is_dense = true};
        if (all->count > 0)
            panels[panel_count++] = (kt_plot_panel){.title = titles[i],
                                                    .unit = units[i],
                                                    .series = series[i],
                                                    .series_count = all->count,
                                                    .left_out = all->left_out,
                                                    .has_legend = true,
                                                    .y_log = i == QUANTITY_OPEN};
    }
    series[QUANTITY_COUNT][0] = (kt_plot_series){.label = is_error ? "drift" : "change",
                                                 .x = columns,
                                                 .y = columns + plot->count,
                                                 .count = plot->count,
                                                 .is_dense = true};
    if (plot->has_energy || panel_count == 0)
        panels[panel_count++] = (kt_plot_panel){.title = outcome->energy.has_balance ? "Drift of the energy balance"
                                                         : is_error                  ? "Drift of the total energy"
                                                                                     : "Change of the total energy",
                                                .unit = "J",
                                                .series = series[QUANTITY_COUNT],
                                                .series_count = 1};
    const kt_method_words method = kt_describe_method(outcome->run);
    kt_plot picture = {.title = outcome->name,
                       .subtitle = method.text,
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
