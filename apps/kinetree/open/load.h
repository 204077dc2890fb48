/* The parts of loading a scene: reading it, its start from the result of a run, and names of files. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SCENE_LOAD_H
#define KT_COMMAND_SCENE_LOAD_H

#include "command.h"
#include "kinetree/scene.h"

#include <stdbool.h>

/* Reads a scene as kt_read_scene does, without the result that it may start from. */
int kt_read_scene_as_written(const char *path, const kt_settings *settings, kt_scene *scene);

/* Prints an error if a result of the command would overwrite a file that the scene reads. Returns -1, or an exit
 * code. */
int kt_check_scene_files(const kt_scene *scene);

/* Whether a scene was read from the file of a robot, also from standard input. */
bool kt_is_robot_scene(const kt_scene *scene);

/* Makes the state of a result the initial state of the scene, matching the names of joints. Prints the mismatches:
 * joints of the scene that the result lacks, and the reverse. The result is a summary (JSON) with the last state, or
 * records (CSV). ":TIME" after the name selects the record nearest to that time; the default is the last record. The
 * name is relative to `folder`, the folder of the scene; NULL: the current folder. Returns KT_EXIT_DONE, or an exit
 * code after printing the error. The scene is then unchanged. */
int kt_start_from(kt_scene *scene, const char *result, const char *folder);

/* Prints that functions of time, masses that are functions of time, times in events and limits of events begin anew.
 * Each line begins with `start`, such as "the motion starts at t = 0 from the state of run.json". `source` names what
 * has the state. Prints nothing if the scene has no such part. */
void kt_say_anew(const kt_scene *scene, const char *start, const char *source);

/* Returns whether a file is a robot, from the ending of its name. */
bool kt_is_robot_name(const char *path);
/* Does the same for a scene or a robot. */
bool kt_is_scene_name(const char *path);

/* Suggests a file for a path that does not exist. Tries the path with the ending .yaml, then a bundled scene of this
 * name. Then it takes the nearest name in the same folder, and at last that of a bundled scene. Prints nothing for a
 * path that exists, or without such a file. */
void kt_missing_suggest(const char *path);

#endif
