/* The direction in which `kinetree draw` looks, and the words for it. */
#ifndef KT_COMMAND_DRAW_DIRECTION_H
#define KT_COMMAND_DRAW_DIRECTION_H

#include "picture/camera.h"

typedef struct kt_view_words {
    char text[80];
} kt_view_words;

/* Takes the direction that --view names. view: NULL to take the plane of the mechanism, or one from above. Returns -1,
 * or an exit code after printing the error. */
int kt_draw_direction_choose(const char *view, const kt_picture *picture, const kt_pose *poses, kt_camera *camera,
                             kt_view_words *words);

#endif
