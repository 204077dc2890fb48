/* The picture of each state of a run, without the loops and effects that are released there. */
#ifndef KT_COMMAND_DRAW_SHOWN_H
#define KT_COMMAND_DRAW_SHOWN_H

#include "kinetree/scene.h"
#include "picture/picture.h"

#include <stdint.h>

/* Creates the picture at each of `count` states. released: for each state, the set of released elements
 * (kt_released_set).
 *
 * Ownership: each picture shares everything with `whole`, which must outlive it, except its lists of loops, relations
 * and effects. The caller releases the pictures with kt_shown_free.
 *
 * Errors: NULL if memory is insufficient. */
kt_picture *kt_shown_create(const kt_scene *scene, const kt_picture *whole, const uint64_t *released, int count);
void kt_shown_free(kt_picture *shown, int count);

#endif
