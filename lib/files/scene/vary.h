/* Numbers of a scene that follow from variables (kt_scene_options.variables) and can be changed after it has been read.
 *
 * Every number that is read passes kt_read_number, which notes whether it depends on a variable. A reader calls
 * kt_number_follows if it has put the number in its final place, and draws no other conclusion from it. A number
 * without this call cannot be changed without reading the scene again.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_VARY_H
#define KT_SCENE_VARY_H

#include "kinetree/expression.h"
#include "scene/scene_reader.h"

/* Begins and ends the reading of a scene with variables; options without any: nothing is done. */
void kt_varying_start(kt_reader *r, const kt_scene_options *options);
void kt_varying_finish(kt_reader *r, const char *path, kt_scene *scene);

/* Notes that a number of this node is that of a variable, or of an expression that depends on one. */
void kt_varying_note(kt_reader *r, kt_node *node, const kt_expression *expression);

/* Whether a node is the value of a variable itself. */
bool kt_is_varied(const kt_reader *r, const kt_node *node);

/* Records that this node of the scene has used a parameter for something that later values cannot change, such as a
 * type or a size. is_assigned: an event sets the parameter. */
void kt_varying_note_fixed(kt_reader *r, kt_node *node, bool is_assigned);

/* Records that the number of a node is in *at and nowhere else; with `positive` it is to be above 0. Returns whether it
 * depends on a variable. */
bool kt_number_follows(kt_reader *r, kt_node *node, bool positive, double *at);

/* After such a call: the number is in *at, too. */
void kt_number_follows_too(kt_reader *r, double *at);

/* Does for each item of a list what kt_number_follows does for a number: the items are in at[0], at[1], ... */
void kt_numbers_follow(kt_reader *r, const kt_node *list, double *at);

/* While a scene is read: the numbers in `size` bytes have moved to another place. */
void kt_varying_move(kt_reader *r, const void *from, size_t size, void *to);

/* While a scene is read: other items have copies of the numbers in `size` bytes, so that these cannot be changed
 * without reading the scene again. */
void kt_varying_copied(kt_reader *r, const void *from, size_t size);

/* After an array of a scene has been copied to another place: moves the numbers that follow to the copy. */
void kt_numbers_move(const kt_scene *scene, const void *from, size_t size, void *to);

#endif
