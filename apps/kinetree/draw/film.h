/* The frames of an animated picture: each is an SVG on a light page and on a dark one, cut into lines. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_DRAW_FILM_H
#define KT_COMMAND_DRAW_FILM_H

#include "draw/draw.h"

#include <stdint.h>
#include <string.h>

enum { KT_FILM_PAGES = 2 /* light, dark */ };

/* An SVG, cut into its lines: cairo writes one for each element. */
typedef struct kt_page_lines {
    char *text;
    char **line;
    int count;
    uint64_t order; /* hash of the painted things, in their order */
} kt_page_lines;

/* All frames on a light page and on a dark one. */
typedef struct kt_film {
    kt_page_lines *page[KT_FILM_PAGES];
    int count;
    char **front; /* [count * paths]: the parts of paths that are in front of solids; NULL: none is, in a diagram */
    int path_count;
} kt_film;

/* Takes all frames. Returns false after printing the error. In both cases, kt_film_free releases them. */
bool kt_film_take(const kt_drawing *drawing, kt_film *film);
void kt_film_free(kt_film *film);

/* Takes one frame, with the paths of the drawing in a layer. The caller frees the lines. */
bool kt_film_take_frame(const kt_drawing *drawing, int page, int state, kt_path_layer layer, kt_page_lines *to);
void kt_page_lines_free(kt_page_lines *lines);

/* Whether a part of a path is in front of solids in a frame from `first` up to, but not including, `end`. */
bool kt_film_has_front(const kt_film *film, int path, int first, int end);

/* Returns the frame behind the last one of the scene that begins with frame `first`. */
int kt_film_scene_end(const kt_film *film, int first, int stride);

/* Returns the length of the number that begins a text. */
static inline size_t kt_film_number_length(const char *text) { return strspn(text, "-.0123456789"); }

#endif
