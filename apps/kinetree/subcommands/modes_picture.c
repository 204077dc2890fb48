/* Pictures of modes: the mechanism deflected in each of the slowest, or bars by joints. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/modes.h"

#include "command.h"
#include "draw/draw.h"
#include "open/deflection.h"
#include "plot/plot.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { DEFLECTED_MOST = 6, PANELS_MOST = 8, NAMES_MOST = 500 };

kt_mode_title kt_modes_title(int number, const kt_mode *mode, bool moves) {
    const char *still = moves ? "" : " (no body moves)";
    kt_mode_title title;
    if (mode->imaginary > 0.0)
        snprintf(title.text, sizeof title.text, "%d: %.4g Hz, damping ratio %.3f%s", number, mode->frequency,
                 fabs(mode->real) > mode->error ? mode->damping : 0.0, still);
    else
        snprintf(title.text, sizeof title.text, "%d: %s, time constant %.3g s%s", number,
                 mode->real > 0.0 ? "growth" : "decay", 1.0 / fabs(mode->real), still);
    return title;
}

int kt_modes_slowest(const kt_small_motion *motion, int most, int *list, int *listed) {
    int number = 0;
    *listed = 0;
    for (int i = 0; i < kt_modes_count(motion->modes); i++) {
        const kt_mode mode = kt_modes_at(motion->modes, i);
        if (kt_mode_is_neutral(&mode))
            continue;
        number++;
        if (*listed < most)
            list[(*listed)++] = i;
    }
    return number;
}

static int at_most(long count, int most) { return count < most ? (int)count : most; }

/* Names the slowest `shown` of all modes. */
static void name_modes(int number, int shown, char *text, size_t size) {
    if (number == shown)
        snprintf(text, size, number == 1 ? "The mode" : "%d modes", number);
    else
        snprintf(text, size, shown == 1 ? "Mode %d of %d" : "Modes 1 to %d of %d", shown, number);
}

/* ---- deflected shapes -------------------------------------------------------------------------------------------- */

typedef struct deflected {
    kt_picture *picture;
    kt_pose *poses; /* at rest, and then in each mode */
    int modes[DEFLECTED_MOST], count;
    kt_mode_title titles[DEFLECTED_MOST];
    const char *captions[DEFLECTED_MOST];
    double moved; /* m; the largest of all deflections */
} deflected;

static kt_status deflect(const kt_small_motion *motion, deflected *d, kt_error *error) {
    const size_t bodies = (size_t)kt_model_body_count(motion->model);
    kt_status status = kt_deflection_poses(motion, 0, NULL, d->poses, error);
    if (status == KT_OK)
        status = kt_picture_create(&motion->scene, motion->model, d->poses, NULL, &d->picture, error);
    for (int i = 0; i < d->count && status == KT_OK; i++) {
        const kt_mode mode = kt_modes_at(motion->modes, d->modes[i]);
        kt_deflection deflection;
        status = kt_deflection_choose(motion, d->modes[i], d->picture, &deflection, error);
        if (status != KT_OK)
            break;
        status = kt_deflection_poses(motion, d->modes[i], &deflection, d->poses + (size_t)(i + 1) * bodies, error);
        d->titles[i] = kt_modes_title(i + 1, &mode, deflection.moved > 0.0);
        d->captions[i] = d->titles[i].text;
        d->moved = fmax(d->moved, deflection.moved);
    }
    return status;
}

static void describe_panels(const deflected *d, int number, const char *state, char *text, size_t size) {
    char which[48];
    name_modes(number, d->count, which, sizeof which);
    snprintf(text, size, "%s about its %s, deflected by at most %.2g m, %.2g %% of its size; grey: undeflected", which,
             state, d->moved, 100.0 * d->moved / d->picture->size);
}

static int draw_deflected(const kt_small_motion *motion, const deflected *d, int number, const char *state,
                          const char *path, bool is_dark) {
    char subtitle[200];
    describe_panels(d, number, state, subtitle, sizeof subtitle);
    const kt_chosen_view view = kt_camera_choose(d->picture, d->poses);
    const kt_drawing drawing = {.picture = d->picture,
                                .camera = view.camera,
                                .is_diagram = view.is_plane,
                                .state_count = d->count,
                                .poses = d->poses + kt_model_body_count(motion->model),
                                .captions = d->captions,
                                .rest = d->poses,
                                .is_dark = is_dark,
                                .title = motion->name,
                                .subtitle = subtitle};
    return kt_drawing_write(&drawing, path);
}

int kt_modes_draw(const kt_small_motion *motion, const char *state, const char *path, long count, bool is_dark) {
    kt_error error = {0};
    deflected d = {.count = 0};
    const int number = kt_modes_slowest(motion, at_most(count, DEFLECTED_MOST), d.modes, &d.count);
    if (number == 0)
        return kt_reject(KT_EXIT_INTEGRATION, "%s is not written: there is no mode to be drawn", path);
    d.poses = calloc((size_t)(d.count + 1) * (size_t)kt_model_body_count(motion->model), sizeof *d.poses);
    if (d.poses == NULL)
        return kt_say_no_memory("the picture");
    const kt_status status = deflect(motion, &d, &error);
    int code = kt_say_status(status, &error);
    if (status == KT_OK)
        code = draw_deflected(motion, &d, number, state, path, is_dark);
    kt_picture_free(d.picture);
    free(d.poses);
    return code;
}

/* ---- bars -------------------------------------------------------------------------------------------------------- */

typedef struct kt_shapes {
    kt_shape_panel panel[PANELS_MOST];
    kt_mode_title title[PANELS_MOST];
    kt_coordinate_name name[NAMES_MOST];
    const char *text[NAMES_MOST];
    double bars[PANELS_MOST][2 * NAMES_MOST];
} kt_shapes;

/* Fills in a mode shape, with each coordinate divided by its unit; the largest element is 1 and real. */
static void fill_bars(const kt_small_motion *motion, int mode, double *bars) {
    const kt_linear_system *system = kt_linearization_system(motion->linearization);
    const double *shape = kt_modes_positions(motion->modes, mode);
    for (int i = 0; i < 2 * system->coordinates; i++)
        bars[i] = shape[i] / system->unit[i / 2];
}

int kt_modes_draw_bars(const kt_small_motion *motion, const char *state, const char *path, long count, bool is_dark) {
    const kt_linear_system *system = kt_linearization_system(motion->linearization);
    kt_shapes *shapes = calloc(1, sizeof *shapes);
    char subtitle[160], which[48];
    int modes[PANELS_MOST];
    if (shapes == NULL)
        return kt_say_no_memory("the picture");
    kt_shape_plot plot = {.title = motion->name,
                          .subtitle = subtitle,
                          .names = shapes->text,
                          .count = system->coordinates < NAMES_MOST ? system->coordinates : NAMES_MOST,
                          .panels = shapes->panel,
                          .is_dark = is_dark};
    for (int i = 0; i < plot.count; i++) {
        shapes->name[i] = kt_name_coordinate(motion, i);
        shapes->text[i] = shapes->name[i].text;
    }
    const int number = kt_modes_slowest(motion, at_most(count, PANELS_MOST), modes, &plot.panel_count);
    for (int i = 0; i < plot.panel_count; i++) {
        const kt_mode mode = kt_modes_at(motion->modes, modes[i]);
        shapes->title[i] = kt_modes_title(i + 1, &mode, true);
        shapes->panel[i] = (kt_shape_panel){shapes->title[i].text, shapes->bars[i]};
        fill_bars(motion, modes[i], shapes->bars[i]);
    }
    name_modes(number, plot.panel_count, which, sizeof which);
    snprintf(subtitle, sizeof subtitle, "%s about its %s, by joints", which, state);
    const int code = kt_plot_shapes(&plot, path);
    free(shapes);
    return code;
}
