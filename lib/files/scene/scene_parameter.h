/* Parameters of a scene, and values from outside of its file. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_SCENE_PARAMETER_H
#define KT_SCENE_SCENE_PARAMETER_H

#include "scene/value.h"

/* Reads `parameters` of the root, if it has them, and evaluates them all: before anything else is read. */
void kt_parameters_read(kt_reader *r);

/* Once everything has been read: parameters and settings into the scene, and a note of each parameter that nothing has
 * used. */
void kt_parameters_finish(kt_reader *r, const char *path, const kt_scene_options *options, kt_scene *scene);

/* Replaces values of the file's nodes by those of settings, "PATH=VALUE"; `top` has the keys of a scene. */
void kt_settings_apply(kt_reader *r, const kt_scene_options *options, const kt_table *top);

/* Nodes that come from the k-th setting have this line, and their column is that in its text. */
#define KT_SETTING_LINE 0xF0000000U
static inline uint32_t kt_setting_line(int k) { return KT_SETTING_LINE + (uint32_t)k; }

/* Writes a place: in the file of this path, or in a setting, which is given with its text. */
void kt_reader_where(const kt_reader *r, const char *path, uint32_t line, uint32_t column, char where[KT_WHERE_SIZE]);

#endif
