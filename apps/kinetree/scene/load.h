/* The first part of loading a scene. */
#ifndef KT_COMMAND_SCENE_LOAD_H
#define KT_COMMAND_SCENE_LOAD_H

#include "command.h"

/* Reads a scene as kt_read_scene does, without the result that it may start from. */
int kt_read_scene_as_written(const char *path, const kt_settings *settings, kt_scene *scene);

/* Prints an error if a result of the command would overwrite a file that the scene reads. Returns -1, or an exit
 * code. */
int kt_check_scene_files(const kt_scene *scene);

/* Whether a scene was read from the file of a robot, also from standard input. */
bool kt_is_robot_scene(const kt_scene *scene);

#endif
