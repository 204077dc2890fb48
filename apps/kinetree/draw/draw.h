/* Drawings of mechanisms: their content, and the paper on which it is painted. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_DRAW_DRAW_H
#define KT_COMMAND_DRAW_DRAW_H

#include "kinetree/scene.h"
#include "picture/camera.h"
#include "picture/picture.h"

#include <stdbool.h>
#include <stdint.h>

/* The path of a point: its places in the world, one after the other. */
typedef struct kt_drawn_path {
    int body; /* body that gives the path its colour */
    const kt_vec3 *points;
    int count;
} kt_drawn_path;

/* A drawing: one state, several side by side, or several over each other. */
typedef struct kt_drawing {
    const kt_picture *picture;
    kt_camera camera;
    bool is_diagram; /* a planar mechanism in its plane: joints are symbols, and nothing hides parts behind it */
    const kt_picture *pictures; /* for each state, `picture` without the released elements; NULL: none is released */
    int state_count;
    const kt_pose *poses;        /* poses of all bodies in the first state, then in the second, ... */
    const double *times;         /* s; of each state */
    const char *const *captions; /* texts under states side by side; NULL: their times */
    const kt_pose *rest;         /* poses of all bodies, in grey behind each of the states side by side; NULL: none */
    bool is_strobe;              /* over each other, earlier ones paler */
    bool is_moving;              /* the states are frames of an animation */
    bool is_plain;               /* in flat colours, earlier states without symbols and edges */
    const kt_drawn_path *paths;
    int path_count;
    const bool *clear; /* of each body: it is painted so that the parts behind and in it are seen; NULL: none */
    bool shows_axes, shows_names;
    int *nameless;   /* kt_drawing_write counts the names that have no room; NULL: it does not */
    bool shows_gaps; /* loops that are open have a red line from end to end */
    bool is_dark;
    const char *title, *subtitle;
} kt_drawing;

/* The unit, m, to which positions are rounded, for a mechanism so far from the origin that rounding would be visible.
 * The drawing then shows no finer detail. Otherwise the result is 0. */
double kt_drawing_grain(const kt_drawing *drawing);

/* Returns KT_EXIT_DONE, or an exit code after printing the error. The caller has checked the path with
 * kt_plot_check. */
int kt_drawing_write(const kt_drawing *drawing, const char *path);

/* Writes each state as a picture of its own, laid out as the whole: FILE-0001.png, FILE-0002.png, ... for FILE.png.
 * Returns an exit code as above. */
int kt_drawing_write_frames(const kt_drawing *drawing, const char *path);

/* Which paths a frame has: none, or all of each path behind the solids, or all of each path in front of them. */
typedef enum kt_path_layer { KT_PATHS_NONE, KT_PATHS_BEHIND, KT_PATHS_BEFORE } kt_path_layer;

/* The SVG of one state of a strobe drawing, laid out as the whole. *order becomes a hash of the solids in the order in
 * which they are painted. The caller frees the text; NULL after printing the error. */
char *kt_drawing_frame(const kt_drawing *drawing, int state, kt_path_layer layer, uint64_t *order);

/* The parts of a path that are in front of solids in a state, as the value of stroke-dasharray for a path of length 1.
 * The path extends to a share of its points, 0 to 1. The caller frees it; NULL if memory is insufficient. */
char *kt_drawing_front(const kt_drawing *drawing, int state, int path, double share);

/* The share of the length of a path, as seen by the camera, up to a part of its points, 0 to 1. */
double kt_path_share(const kt_drawing *drawing, const kt_drawn_path *path, double part);

/* Writes an animated SVG. The frames are the states of a strobe drawing at equal intervals, and the play takes
 * `seconds`. The file needs no script and repeats. Colours are light or dark as the page prefers; is_dark: always dark.
 *
 * Frames are left out until the file has at most KT_ANIMATION_BYTES, as long as there are several frames a second.
 * *frames: their number. *bytes: the size of the file.
 *
 * Returns KT_EXIT_DONE, or an exit code after printing the error. The caller has checked the path. */
enum { KT_ANIMATION_BYTES = 300000 };
int kt_animation_write(const kt_drawing *drawing, double seconds, const char *path, int *frames, size_t *bytes);

/* The words for the direction in which `kinetree draw` looks. */
typedef struct kt_view_words {
    char text[80];
} kt_view_words;

/* Takes the direction that --view names. view: NULL to take the plane of the mechanism, or one from above. Returns -1,
 * or an exit code after printing the error. */
int kt_draw_direction_choose(const char *view, const kt_picture *picture, const kt_pose *poses, kt_camera *camera,
                             kt_view_words *words);

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
