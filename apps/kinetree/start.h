/* The state that a scene starts from: assembled, with words about what that has moved, or why it cannot be. */
#ifndef KT_COMMAND_START_H
#define KT_COMMAND_START_H

#include "command.h"
#include "json.h"

/* Assembles the initial state into q, v, and says what of the given values moved, or what stays open and what would
 * help. Returns KT_EXIT_DONE or an exit code. */
int kt_start_assemble(const kt_scene *scene, const kt_model *model, kt_data *data, double *q, double *v);

/* The same in memory of its own, for those who do not need the state. */
int kt_start_tell(const kt_scene *scene, const kt_model *model);

/* Says what of the values that the scene gives is not so in the assembled state: as a warning of the file at `path`
 * (NULL: in the name of the command). Returns how many are not. */
int kt_start_say_moved(const char *path, const kt_scene *scene, const kt_model *model, const double *q,
                       const double *v);

/* The same as a list of {joint, part, from, to}. */
json_t *kt_start_moved(const kt_model *model, const double *q, const double *v);

/* The first motion loop that follows a table of straight lines, so that its joint's speed jumps at rows; NULL: none. */
const char *kt_start_jumping(const kt_scene *scene);

/* Says which inertias break the triangle inequality, as `inertia_check: warn` lets them. Returns how many. */
int kt_start_say_inertias(const kt_scene *scene);

/* Body -> the part by which its inertia breaks the triangle inequality; of those that do. */
json_t *kt_start_inertias(const kt_scene *scene);

#endif
