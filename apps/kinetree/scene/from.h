/* The initial state of a scene from the result of a run. */
#ifndef KT_COMMAND_SCENE_FROM_H
#define KT_COMMAND_SCENE_FROM_H

#include "command.h"

/* Makes the state of a result the initial state of the scene, matching the names of joints. Prints the mismatches:
 * joints of the scene that the result lacks, and the reverse. The result is a summary (JSON) with the last state, or
 * records (CSV). ":TIME" after the name selects the record nearest to that time; the default is the last record. The
 * name is relative to `folder`, the folder of the scene; NULL: the current folder. Returns KT_EXIT_DONE, or an exit
 * code after printing the error. The scene is then unchanged. */
int kt_start_from(kt_scene *scene, const char *result, const char *folder);

#endif
