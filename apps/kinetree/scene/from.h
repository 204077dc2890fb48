/* The initial state of a scene from the result of a run. */
#ifndef KT_COMMAND_SCENE_FROM_H
#define KT_COMMAND_SCENE_FROM_H

#include "command.h"

/* Makes the state of a result the scene's initial state, by the names of joints, and prints what does not fit: joints of the
 * scene that the result has not, and the reverse. result: a summary (JSON), whose state is the last one, or records
 * (CSV); ":TIME" after the name takes the record nearest to that time, default: the last. `folder`: of the scene, where
 * a result that is named in it is looked for; NULL: here. Returns KT_EXIT_DONE, or an exit code after printing the error,
 * and then the scene is unchanged. */
int kt_start_from(kt_scene *scene, const char *result, const char *folder);

#endif
