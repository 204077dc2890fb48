/* Tables of published or independently computed results, as the files of data/ have them. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jansson.h>

static bool has_columns(const json_t *columns, const char *expected) {
    char all[1024] = "";
    size_t i;
    json_t *name;
    json_array_foreach(columns, i, name) {
        size_t length = strlen(all);
        snprintf(all + length, sizeof all - length, "%s%s", i > 0 ? " " : "", json_string_value(name));
    }
    return kt_check_text("columns", all, expected);
}

static bool take_numbers(const json_t *list, size_t count, double *out) {
    if (json_array_size(list) != count)
        return false;
    for (size_t i = 0; i < count; i++) {
        const json_t *number = json_array_get(list, i);
        if (!json_is_number(number))
            return false;
        out[i] = json_number_value(number);
    }
    return true;
}

static bool take_rows(kt_table *table, const json_t *reference) {
    const json_t *t = json_object_get(reference, "t"), *value = json_object_get(reference, "value");
    table->rows = json_array_size(t);
    table->columns = json_array_size(json_object_get(reference, "columns"));
    if (table->rows == 0 || table->columns == 0 || json_array_size(value) != table->rows)
        return false;
    table->t = calloc(table->rows, sizeof *table->t);
    table->value = calloc(table->rows * table->columns, sizeof *table->value);
    bool fine = table->t != NULL && table->value != NULL && take_numbers(t, table->rows, table->t);
    for (size_t i = 0; fine && i < table->rows; i++)
        fine = take_numbers(json_array_get(value, i), table->columns, table->value + i * table->columns);
    return fine;
}

kt_table kt_table_open(const char *name, const char *columns) {
    char path[1024];
    json_error_t error;
    kt_table table = {0, 0, NULL, NULL};
    snprintf(path, sizeof path, "%s/%s.json", KT_REFERENCE, name);
    json_t *root = json_load_file(path, 0, &error);
    if (root == NULL) {
        kt_note("%s:%d: %s", path, error.line, error.text);
        kt_need(kt_check_true("reference", false));
    }
    const json_t *reference = json_object_get(root, "reference");
    kt_need(has_columns(json_object_get(reference, "columns"), columns) &&
            kt_check_true("every row is complete", take_rows(&table, reference)));
    json_decref(root);
    kt_test_own(table.t, free);
    kt_test_own(table.value, free);
    return table;
}

/* ---- a run against a table --------------------------------------------------------------------------------------- */

typedef struct comparison {
    const kt_case *c;
    const kt_table *table;
    kt_error_of *error_of;
    size_t row;
    double bound;
    kt_worst error;
} comparison;

/* Records lie at multiples of an interval that divides the table's. Records between the rows of the table are
 * ignored. */
static int compare(const kt_record *record, void *user) {
    comparison *k = user;
    if (k->row >= k->table->rows || fabs(record->t - k->table->t[k->row]) > 1e-12 * (1.0 + record->t))
        return 0;
    kt_worst_below(&k->error, k->error_of(k->c, record, k->table->value + k->row * k->table->columns), k->bound,
                   "t = %g", record->t);
    k->row++;
    return 0;
}

void kt_case_compare(const kt_case *c, const kt_table *table, const kt_setting *settings, size_t count,
                     kt_error_of *error_of) {
    for (size_t i = 0; i < count; i++) {
        comparison k = {c, table, error_of, 0, settings[i].bound, kt_worst_make(kt_setting_text(c, &settings[i]))};
        (void)kt_case_run(c, &settings[i], settings[i].integrator == NULL ? 0.0 : table->t[1], compare, &k);
        kt_check_worst(&k.error);
        if (k.row != table->rows)
            kt_check_equal_int("rows compared", (long long)k.row, (long long)table->rows);
    }
}
