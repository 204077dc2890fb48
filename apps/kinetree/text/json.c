/* Converts values of the library to JSON, using jansson. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "text/json.h"

#include "command.h"
#include "records/output.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Whether an allocation has failed: jansson then omits the value without reporting an error. */
static bool is_short;

static void *allocate_json(size_t size) {
    void *memory = malloc(size);
    is_short = is_short || memory == NULL;
    return memory;
}

void kt_json_watch_memory(void) { json_set_alloc_funcs(allocate_json, free); }

bool kt_json_is_short(void) { return is_short; }

json_t *kt_json_text(const char *text) {
    json_t *exact = json_string(text);
    return exact != NULL ? exact : json_string(kt_show(text).text);
}

json_t *kt_json_number(double x) { return isfinite(x) ? json_real(x) : json_null(); }

json_t *kt_json_numbers(const double *x, int count) {
    json_t *list = json_array();
    for (int i = 0; i < count; i++)
        json_array_append_new(list, kt_json_number(x[i]));
    return list;
}

json_t *kt_json_vector(kt_vec3 u) {
    double x[3] = {u.x, u.y, u.z};
    return kt_json_numbers(x, 3);
}

json_t *kt_json_rows(const double *matrix, int rows, int columns) {
    json_t *list = json_array();
    for (int i = 0; i < rows; i++) {
        json_t *row = json_array();
        for (int j = 0; j < columns; j++)
            json_array_append_new(row, kt_json_number(matrix[(size_t)j * (size_t)rows + (size_t)i]));
        json_array_append_new(list, row);
    }
    return list;
}

json_t *kt_json_by_joint(const kt_model *model, const double *x, bool of_velocity) {
    json_t *object = json_object();
    for (int body = 1; body < kt_model_body_count(model); body++) {
        kt_coordinates at = kt_body_coordinates(model, body);
        int first = of_velocity ? at.v : at.q, count = of_velocity ? at.nv : at.nq;
        if (count == 0)
            continue;
        json_t *value = x == NULL    ? json_null()
                        : count == 1 ? kt_json_number(x[first])
                                     : kt_json_numbers(x + first, count);
        json_object_set_new(object, kt_joint_name(model, body), value);
    }
    return object;
}

static void write_json_text(FILE *file, const void *text) {
    (void)fputs(text, file);
    (void)fputc('\n', file);
}

char *kt_json_print(json_t *object, size_t flags) {
    char *text = object != NULL ? json_dumps(object, flags) : NULL;
    json_decref(object);
    if (text != NULL && !is_short)
        return text;
    free(text);
    kt_say("there is not enough memory for the JSON text");
    return NULL;
}

int kt_json_write(json_t *object, const char *path) {
    char *text = kt_json_print(object, JSON_INDENT(2) | JSON_REAL_PRECISION(17));
    const int code = text != NULL ? kt_output_write(path, write_json_text, text) : KT_EXIT_INTEGRATION;
    free(text);
    return code;
}

json_t *kt_json_auxiliary_states(const kt_model *model, const double *x) {
    json_t *states = json_object();
    for (int i = 0; i < kt_auxiliary_state_count(model); i++)
        json_object_set_new(states, kt_auxiliary_state_name(model, i), kt_json_number(x[i]));
    return states;
}
