/* A motion that has been recorded. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/recorded.h"

#include "command.h"
#include "kinetree/joint.h"
#include "records/keep.h"
#include "text/input.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- the file ---------------------------------------------------------------------------------------------------- */

/* Returns the column of a coordinate, as records name it: "position.arm", or "position.ball[2]" of several. */
static const double *column_of(const kt_table *table, const char *part, const char *joint, int count, int k) {
    char name[512];
    if (count == 1)
        (void)snprintf(name, sizeof name, "%s.%.480s", part, joint);
    else
        (void)snprintf(name, sizeof name, "%s.%.480s[%d]", part, joint, k);
    return kt_table_column(table, name);
}

/* Finds the columns of all coordinates. Returns false after reporting a position that the table lacks. */
static bool find_columns(const kt_table *table, const char *path, const kt_model *model, const double **q,
                         const double **v) {
    for (int body = 1; body < kt_model_body_count(model); body++) {
        const kt_coordinates at = kt_body_coordinates(model, body);
        const char *joint = kt_joint_name(model, body);
        for (int k = 0; k < at.nv; k++)
            v[at.v + k] = column_of(table, "velocity", joint, at.nv, k);
        for (int k = 0; k < at.nq; k++) {
            q[at.q + k] = column_of(table, "position", joint, at.nq, k);
            if (q[at.q + k] == NULL) {
                kt_say("%s has no position of joint '%s'; --records takes records of this scene, with positions", path,
                       kt_show(joint).text);
                return false;
            }
        }
    }
    return true;
}

/* Copies the rows whose times rise. Returns false after reporting a number that is not finite. */
static bool copy_rows(kt_recorded *to, const kt_table *table, const char *path, size_t nq, size_t nv,
                      const double *time, const double *const *q, const double *const *v) {
    for (size_t row = 0; row < table->rows; row++) {
        if (to->count > 0 && !(time[row] > to->time[to->count - 1]))
            continue;
        bool is_finite = isfinite(time[row]);
        for (size_t i = 0; i < nq; i++) {
            to->q[to->count * nq + i] = q[i][row];
            is_finite = is_finite && isfinite(q[i][row]);
        }
        for (size_t i = 0; i < nv; i++)
            to->v[to->count * nv + i] = v[i] != NULL && isfinite(v[i][row]) ? v[i][row] : 0.0;
        to->time[to->count] = time[row];
        if (!is_finite) {
            kt_say("%s: record %zu has a position or a time that is no finite number", path, row + 1);
            return false;
        }
        to->count++;
    }
    return true;
}

static int take_table(kt_recorded *to, const kt_table *table, const char *path, const kt_model *model) {
    const size_t nq = (size_t)kt_model_nq(model), nv = (size_t)kt_model_nv(model), rows = table->rows;
    const double *time = kt_table_column(table, "time"), **columns = calloc(nq + nv + 1, sizeof *columns);
    int code = KT_EXIT_SCENE;
    to->time = malloc((rows + 1) * sizeof *to->time);
    to->q = malloc((rows * nq + 1) * sizeof *to->q);
    to->v = malloc((rows * nv + 1) * sizeof *to->v);
    to->scratch = malloc((nv + 1) * sizeof *to->scratch);
    if (columns == NULL || to->time == NULL || to->q == NULL || to->v == NULL || to->scratch == NULL)
        code = kt_say_no_memory("the records");
    else if (table->part_count > 1 || time == NULL || rows == 0)
        kt_say("%s %s; --records takes those of one run", path,
               time == NULL ? "has no column 'time'"
               : rows == 0  ? "has no records"
                            : "has the records of several runs");
    else if (find_columns(table, path, model, columns, columns + nq) &&
             copy_rows(to, table, path, nq, nv, time, columns, columns + nq))
        code = KT_EXIT_DONE;
    free(columns);
    return code;
}

int kt_recorded_open(kt_recorded *recorded, const char *path, const kt_model *model) {
    kt_table table = {.rows = 0};
    char *file = strdup(path);
    *recorded = (kt_recorded){.count = 0};
    int code = kt_check_input("the records", path);
    if (file == NULL)
        code = kt_say_no_memory("the records");
    if (code < 0)
        code = kt_table_read_files(&file, 1, &table);
    if (code < 0)
        code = take_table(recorded, &table, path, model);
    kt_table_free(&table);
    free(file);
    return code;
}

void kt_recorded_close(kt_recorded *recorded) {
    free(recorded->time);
    free(recorded->q);
    free(recorded->v);
    free(recorded->scratch);
    *recorded = (kt_recorded){.count = 0};
}

/* ---- states ------------------------------------------------------------------------------------------------------ */

/* Returns the number of records up to a time. */
static size_t count_until(const kt_recorded *recorded, double time) {
    size_t low = 0, high = recorded->count;
    while (low < high) {
        const size_t middle = (low + high) / 2;
        if (recorded->time[middle] <= time)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* With s in [0, 1] and the change d = q1 (-) q0 over h: d (3 - 2 s) s^2 + h s (1 - s) ((1 - s) v0 - s v1). */
void kt_recorded_positions(kt_recorded *recorded, const kt_model *model, double time, double *q) {
    const size_t nq = (size_t)kt_model_nq(model), nv = (size_t)kt_model_nv(model), last = recorded->count - 1;
    const size_t next = count_until(recorded, time), before = next > 0 ? next - 1 : 0;
    double *moved = recorded->scratch;
    if (next == 0 || before == last) {
        memcpy(q, recorded->q + before * nq, nq * sizeof *q);
        return;
    }
    const double h = recorded->time[next] - recorded->time[before], s = (time - recorded->time[before]) / h;
    const double *v0 = recorded->v + before * nv, *v1 = recorded->v + next * nv;
    kt_position_subtract(model, recorded->q + next * nq, recorded->q + before * nq, moved);
    for (size_t i = 0; i < nv; i++)
        moved[i] = moved[i] * (3.0 - 2.0 * s) * s * s + h * s * (1.0 - s) * ((1.0 - s) * v0[i] - s * v1[i]);
    kt_position_add(model, recorded->q + before * nq, moved, q);
}
