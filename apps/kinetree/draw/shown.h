/* What a picture shows at each state of a run: without the loops and effects that are released there. */
#ifndef KT_COMMAND_DRAW_SHOWN_H
#define KT_COMMAND_DRAW_SHOWN_H

#include "kinetree/scene.h"
#include "picture/picture.h"

#include <stdint.h>

/* The picture at `count` states, of which `released` says what does not act (kt_released_set). Each shares everything with
 * `whole`, which must outlive it, but its lists of loops, relations and effects. NULL: memory is insufficient. The caller
 * releases them with kt_shown_free. */
kt_picture *kt_shown_create(const kt_scene *scene, const kt_picture *whole, const uint64_t *released, int count);
void kt_shown_free(kt_picture *shown, int count);

#endif
