/* The loops that a message names as open, the worst first, and their gaps. If equations contradict each other, the
 * message names the gaps of the least-squares solution, which distributes the contradiction over all equations. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/open_loops.h"
#include "assembly/levenberg_marquardt.h"
#include "assembly/rounding.h"
#include "base/where.h"

#include <stdio.h>
#include <string.h>

/* The gap of one loop as last filled: its largest residual, or for velocities its largest `right`; relative to its
 * scale in *relative. */
static double loop_gap_of(const kt_model *model, const kt_data *data, const kt_loop_record *loop,
                          kt_open_equations violated, double *relative) {
    const kt_group_work w = kt_group_matrices(model, data, (size_t)loop->group, KT_ROWS_ALL);
    double largest = 0.0;
    *relative = 0.0;
    for (int r = 0; r < loop->row_count; r++) {
        const int32_t k = model->slot[loop->slot + r];
        const double x = k < 0 ? 0.0 : fabs(violated == KT_OPEN_VELOCITIES ? w.right[k] : w.residual[k]);
        if (k < 0 || !(x / w.scale[k] > *relative))
            continue;
        *relative = x / w.scale[k];
        largest = x;
    }
    return largest;
}

/* The text of a loop's gap, with the largest length and the largest angle, as "0.12 m and 34 deg". A part below 1e-3 of
 * the other part is left out. */
typedef struct gap_text {
    char text[64];
} gap_text;

/* The gaps of a loop's positions, in its units. A residual of rotation is 4 tan(theta / 4) for the angle theta, but
 * that of a relation is the angle itself. Sums of angles and lengths (couplings) have no unit. */
static gap_text describe_gap(const kt_model *model, const kt_data *data, int index) {
    const kt_loop_record *loop = &model->loop[index];
    const kt_group_work w = kt_group_matrices(model, data, (size_t)loop->group, KT_ROWS_ALL);
    double most[KT_MEASURE_NONE + 1] = {0.0};
    for (int r = 0; r < loop->row_count; r++) {
        const int32_t k = model->slot[loop->slot + r];
        double *of = &most[kt_loop_measure_of(model, index, r)];
        *of = k < 0 ? *of : fmax(*of, fabs(w.residual[k]));
    }
    gap_text gap = {""};
    const double turn = most[KT_MEASURE_ANGLE], tiny = 1e-3 * most[KT_MEASURE_LENGTH] / model->length;
    const double degrees = 180.0 / 3.14159265358979323846 * (loop->term_count ? turn : 4.0 * atan(turn / 4.0));
    size_t used = 0;
    if (most[KT_MEASURE_SUM] > 0.0)
        used += (size_t)snprintf(gap.text, sizeof gap.text, "%.3g (rad or m)", most[KT_MEASURE_SUM]);
    if (most[KT_MEASURE_LENGTH] > 1e-3 * turn * model->length)
        used += (size_t)snprintf(gap.text, sizeof gap.text, "%.3g m", most[KT_MEASURE_LENGTH]);
    if (turn > tiny)
        used += (size_t)snprintf(gap.text + used, sizeof gap.text - used, "%s%.3g deg", used ? " and " : "", degrees);
    if (used == 0) /* the loop is closed to the last bit */
        (void)snprintf(gap.text, sizeof gap.text, "0 (m or rad)");
    return gap;
}

/* The loop with the largest gap below `below`, or with an equal gap and a larger index than `after`. Loops that are
 * closed to the last bit are included, so that a first loop always exists. */
static int next_worst(const kt_model *model, const kt_data *data, kt_open_equations violated, double below, int after) {
    int worst = -1;
    double most = -1.0, relative;
    for (int i = 0; i < (int)model->n.loop; i++) {
        if (kt_loop_is_off(&model->loop[i]))
            continue;
        (void)loop_gap_of(model, data, &model->loop[i], violated, &relative);
        if ((relative < below || (relative == below && i > after)) && relative > most) {
            most = relative;
            worst = i;
        }
    }
    return worst;
}

void kt_velocity_gaps_least_squares(const kt_model *model, kt_data *data) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        if (!kt_damped_step(model, data, g, KT_ROWS_ALL, w.right, 1e-13))
            continue;
        if (group->has_fronts) {
            for (int i = 0; i < w.m; i++)
                data->scratch[model->group_v[group->v + i]] = model->unit[group->v + i] * w.free[i];
            model->group_kernels->apply(model, data, g, KT_ROWS_ALL, data->scratch, kt_group_products(&w), NULL);
            for (int r = 0; r < w.k; r++)
                w.right[r] += kt_group_products(&w)[r];
            continue;
        }
        for (int r = 0; r < w.k; r++)
            for (int i = 0; i < w.m; i++)
                w.right[r] += w.a[r * w.m + i] * model->unit[group->v + i] * w.free[i];
    }
}

kt_status kt_open_loops_error(const kt_model *model, kt_data *data, double t, const char *what,
                              kt_open_equations violated, kt_error *error) {
    enum { NAMED = 4, NAME_MOST = 40 };
    char text[NAMED * (NAME_MOST + 80)] = "";
    size_t used = 0;
    double relative = (double)INFINITY, most = 0.0;
    int worst = -1;
    bool others = false;
    for (int n = 0; n <= NAMED; n++) { /* in order, the worst first */
        worst = next_worst(model, data, violated, relative, worst);
        if (worst < 0)
            break;
        const double gap = loop_gap_of(model, data, &model->loop[worst], violated, &relative);
        if (n > 0 && relative <= 1e-3 * most) /* closed except for the effect of the open ones */
            break;
        if (n == NAMED) {
            others = true;
            break;
        }
        most = fmax(most, relative);
        int length = snprintf(text + used, sizeof text - used, "%s'%.*s' by ", n ? ", " : "", NAME_MOST,
                              model->text + model->loop[worst].name);
        used += length > 0 ? (size_t)length : 0;
        length = violated == KT_OPEN_VELOCITIES
                     ? snprintf(text + used, sizeof text - used, "%.3g", gap)
                     : snprintf(text + used, sizeof text - used, "%s", describe_gap(model, data, worst).text);
        used += length > 0 ? (size_t)length : 0;
    }
    return kt_error_set(error, KT_ERROR_CONSTRAINT, kt_where_format("t = %.9g s", t).text, "%s: %s%s%s", what, text,
                        violated == KT_OPEN_VELOCITIES ? " (m/s or rad/s)" : "", others ? " and others" : "");
}

kt_status kt_loops_reach(const kt_model *model, kt_data *data, double t, const double *q, double tolerance,
                         const char *what, kt_error *error) {
    memcpy(data->assembled_q, q, model->n.q * sizeof *q);
    const double gap = kt_assemble_levenberg_marquardt(model, data, t, NULL, KT_SEARCH_GIVEN, data->assembled_q);
    if (kt_loops_are_closed(model, data->assembled_q, gap, tolerance))
        return KT_OK;
    return kt_open_loops_error(model, data, t, what, KT_OPEN_POSITIONS, error);
}
