/* Names of the files of scenes, and suggestions for one that does not exist. */
#ifndef KT_COMMAND_SCENE_NAME_H
#define KT_COMMAND_SCENE_NAME_H

#include <stdbool.h>

/* Returns whether a file is a robot, from the ending of its name. */
bool kt_is_robot_name(const char *path);

/* Prints what a path that does not exist may mean: the path with the ending .yaml, a bundled scene, or the file in the
 * same folder whose name is nearest, or else the bundled scene whose name is nearest. Prints nothing for a path that
 * exists, or without such a file. */
void kt_missing_suggest(const char *path);

#endif
