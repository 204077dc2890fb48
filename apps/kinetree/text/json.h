/* Converts values of the library to JSON. Each function returns a new object, or NULL if memory is insufficient. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_TEXT_JSON_H
#define KT_COMMAND_TEXT_JSON_H

#include "kinetree/model.h"

#include <jansson.h>

/* Must be called before all other functions: it makes kt_json_print and kt_json_write fail if memory was insufficient
 * for any part. */
void kt_json_watch_memory(void);
/* Whether memory was insufficient for any part so far. */
bool kt_json_is_short(void);

/* A text; one that is not valid UTF-8 is escaped (kt_show). */
json_t *kt_json_text(const char *text);

/* null if x is not finite, because JSON has no such number. */
json_t *kt_json_number(double x);
json_t *kt_json_numbers(const double *x, int count);
json_t *kt_json_vector(kt_vec3 u);
/* A list of rows, of a matrix that is stored by columns. */
json_t *kt_json_rows(const double *matrix, int rows, int columns);
/* Object that maps each joint's name to a number (joint with one coordinate) or a list (more coordinates); joints
 * without coordinates are left out. Velocities if `of_velocity`, else positions. x may be NULL: all values are null. */
json_t *kt_json_by_joint(const kt_model *model, const double *x, bool of_velocity);
/* Object that maps each auxiliary state's name to its number. */
json_t *kt_json_auxiliary_states(const kt_model *model, const double *x);

/* Returns an object as text, which the caller frees, and releases the object; flags: those of jansson. NULL, after
 * printing the error: memory was insufficient. */
char *kt_json_print(json_t *object, size_t flags);

/* Writes an object with 17 digits per number ("-": to standard output), and releases it. NULL is reported as
 * insufficient memory. Returns KT_EXIT_DONE, or an exit code after printing the error. */
int kt_json_write(json_t *object, const char *path);

#endif
