/* JSON of the library's values. Each call returns a new object, or NULL where there is no memory. */
#ifndef KT_COMMAND_JSON_H
#define KT_COMMAND_JSON_H

#include "kinetree/model.h"

#include <jansson.h>

/* To be called before all others: from here on no JSON is written of which a part found no memory. */
void kt_json_watch_memory(void);

/* A text; one that is no UTF-8 as it is shown. */
json_t *kt_json_text(const char *text);

/* null where x is not finite, for which JSON has no number. */
json_t *kt_json_number(double x);
json_t *kt_json_numbers(const double *x, int count);
json_t *kt_json_vector(kt_vec3 u);
/* Body name -> number for a joint of one coordinate, list for more; joints of none are left out. Velocities where
 * `of_velocity`, else positions. x may be NULL: null for each. */
json_t *kt_json_by_joint(const kt_model *model, const double *x, bool of_velocity);

/* Writes an object ("-": to standard output), 17 digits a number, and releases it. NULL is no memory, and said as such.
 * Returns KT_EXIT_DONE or an exit code after saying why. */
int kt_json_write(json_t *object, const char *path);

#endif
