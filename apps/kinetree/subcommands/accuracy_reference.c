/* The records of a run, read as the reference of an accuracy study. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/keep.h"
#include "subcommands/accuracy.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Counts the records at t = k * interval. The last record may come earlier and is then left out. Returns 0 if the
 * records are not equally spaced. */
static size_t count_even(const double *time, size_t rows, double duration) {
    const double interval = rows > 1 ? time[1] : 0.0;
    size_t count = 0;
    while (count < rows && fabs(time[count] - (double)count * interval) <= 1e-12 * fabs(time[count]) &&
           !(time[count] > duration * (1.0 + 1e-12)))
        count++;
    return count + 1 >= rows || time[count] > duration ? count : 0;
}

/* Copies a column into every row of `states`. */
static int take_reference_column(const char *path, const kt_table *table, size_t count, const char *name,
                                 double *states, size_t width) {
    const double *column = kt_table_column(table, name);
    if (column == NULL)
        return kt_reject(KT_EXIT_SCENE, "%s has no column '%s': is it of this scene, written by 'kinetree run'?", path,
                         name);
    for (size_t row = 0; row < count; row++) {
        if (!isfinite(column[row]))
            return kt_reject(KT_EXIT_SCENE, "%s:%zu: '%s' is no number", path, row + 2, name);
        states[row * width] = column[row];
    }
    return -1;
}

/* Copies the columns of a joint: `count` coordinates from `to` on. */
static int take_joint_columns(const char *path, const kt_table *table, size_t rows, const char *kind, const char *joint,
                              int count, double *to, size_t width) {
    int code = -1;
    for (int k = 0; k < count && code < 0; k++) {
        char column[256];
        (void)snprintf(column, sizeof column, count == 1 ? "%s.%s" : "%s.%s[%d]", kind, joint, k);
        code = take_reference_column(path, table, rows, column, to + k, width);
    }
    return code;
}

static int fill_reference(const char *path, const kt_table *table, size_t count, const kt_model *model, double *q,
                          double *v) {
    const size_t nq = (size_t)kt_model_nq(model), nv = (size_t)kt_model_nv(model);
    int code = -1;
    for (int body = 1; body < kt_model_body_count(model) && code < 0; body++) {
        const kt_coordinates at = kt_body_coordinates(model, body);
        const char *name = kt_joint_name(model, body);
        code = take_joint_columns(path, table, count, "position", name, at.nq, q + at.q, nq);
        code = code < 0 ? take_joint_columns(path, table, count, "velocity", name, at.nv, v + at.v, nv) : code;
    }
    return code;
}

int kt_reference_read(const char *path, const kt_model *model, double duration, kt_reference_file *file) {
    const size_t nq = (size_t)kt_model_nq(model), nv = (size_t)kt_model_nv(model);
    kt_table table;
    char *const paths[] = {(char *)path};
    int code = kt_table_read_files(paths, 1, &table);
    if (code >= 0)
        return code;
    const double *time = kt_table_column(&table, "time");
    const size_t count = time != NULL ? count_even(time, table.rows, isnan(duration) ? HUGE_VAL : duration) : 0;
    if (count < 2 || count > 10000000) {
        kt_say("%s is no reference: its 'time' must go from 0 in even intervals, as 'kinetree run' writes it", path);
        kt_table_free(&table);
        return KT_EXIT_SCENE;
    }
    file->states = malloc(count * (nq + nv + 1) * sizeof *file->states);
    if (file->states == NULL) {
        code = kt_reject(KT_EXIT_INTEGRATION, "there is not enough memory for %s", path);
    } else {
        code = fill_reference(path, &table, count, model, file->states, file->states + count * nq);
        file->reference = (kt_reference){time[1], (int)count, file->states, file->states + count * nq};
    }
    kt_table_free(&table);
    return code;
}
