/* The frames of an animated picture as lines of SVG, and which of them differ only in numbers and colours. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/film.h"

#include "command.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

void kt_page_lines_free(kt_page_lines *lines) {
    free(lines->text);
    free(lines->line);
    *lines = (kt_page_lines){.text = NULL};
}

/* Removes cairo's number of a surface from a line. Nothing refers to these numbers. */
static void forget_surface(char *line) {
    if (strncmp(line, "<g id=\"surface", strlen("<g id=\"surface")) == 0)
        memcpy(line, "<g>", sizeof "<g>");
}

static bool cut_lines(char *text, kt_page_lines *to) {
    int count = 0;
    *to = (kt_page_lines){.text = text};
    for (const char *at = text; at != NULL && *at != '\0'; at++)
        count += *at == '\n';
    to->line = text != NULL ? malloc(((size_t)count + 1) * sizeof *to->line) : NULL;
    for (char *at = text; to->line != NULL && to->count < count; at++) {
        to->line[to->count++] = at;
        at = strchr(at, '\n');
        *at = '\0';
        forget_surface(to->line[to->count - 1]);
    }
    return to->line != NULL;
}

bool kt_film_take_frame(const kt_drawing *drawing, int page, int state, kt_path_layer layer, kt_page_lines *to) {
    kt_drawing own = *drawing;
    own.is_dark = own.is_dark || page == 1;
    uint64_t order = 0;
    char *text = kt_drawing_frame(&own, state, layer, &order);
    if (text != NULL && cut_lines(text, to)) {
        to->order = order;
        return true;
    }
    if (text != NULL)
        kt_say("there is not enough memory for the picture");
    return false;
}

void kt_film_free(kt_film *f) {
    for (int page = 0; page < KT_FILM_PAGES; page++) {
        for (int k = 0; k < f->count && f->page[page] != NULL; k++)
            kt_page_lines_free(&f->page[page][k]);
        free(f->page[page]);
    }
    for (int i = 0; i < f->count * f->path_count && f->front != NULL; i++)
        free(f->front[i]);
    free(f->front);
}

/* ---- what differs ------------------------------------------------------------------------------------------------ */

static bool is_colour(const char *text) {
    for (int i = 1; i <= 6; i++)
        if (text[0] != '#' || !isxdigit((unsigned char)text[i]))
            return false;
    return true;
}

/* Whether two lines are equal except for numbers and colours. Digits within a word, as in an id, are no numbers. */
static bool lines_are_alike(const char *a, const char *b) {
    char before = ' ';
    while (*a != '\0' && *b != '\0') {
        const bool starts = !isalnum((unsigned char)before);
        const size_t one = starts ? kt_film_number_length(a) : 0, other = starts ? kt_film_number_length(b) : 0;
        if (one > 0 && other > 0) {
            a += one;
            b += other;
            before = '0';
        } else if (is_colour(a) && is_colour(b)) {
            a += 7;
            b += 7;
        } else if (*a == *b) {
            before = *a++;
            b++;
        } else {
            return false;
        }
    }
    return *a == *b;
}

static bool are_frames_alike(const kt_page_lines *a, const kt_page_lines *b) {
    bool same = a->count == b->count && a->order == b->order;
    for (int i = 0; i < a->count && same; i++)
        same = lines_are_alike(a->line[i], b->line[i]);
    return same;
}

/* Takes frame k on both pages, which must have the same elements in other colours. Otherwise both pages are light. */
static bool take_pages(const kt_drawing *drawing, kt_film *f, int k) {
    if (!kt_film_take_frame(drawing, 0, k, KT_PATHS_NONE, &f->page[0][k]) ||
        !kt_film_take_frame(drawing, 1, k, KT_PATHS_NONE, &f->page[1][k]))
        return false;
    if (are_frames_alike(&f->page[0][k], &f->page[1][k]))
        return true;
    kt_page_lines_free(&f->page[1][k]);
    return kt_film_take_frame(drawing, 0, k, KT_PATHS_NONE, &f->page[1][k]);
}

/* Takes the parts of paths in front of solids, at all frames. */
static bool take_fronts(const kt_drawing *drawing, kt_film *f) {
    if (drawing->is_diagram || drawing->path_count == 0)
        return true;
    f->path_count = drawing->path_count;
    f->front = calloc((size_t)f->count * (size_t)f->path_count, sizeof *f->front);
    bool fine = f->front != NULL;
    for (int i = 0; i < f->count * f->path_count && fine; i++) {
        const int k = i / f->path_count;
        f->front[i] = kt_drawing_front(drawing, k, i % f->path_count, (double)k / fmax(f->count - 1, 1));
        fine = f->front[i] != NULL;
    }
    if (!fine)
        kt_say("there is not enough memory for the picture");
    return fine;
}

bool kt_film_take(const kt_drawing *drawing, kt_film *f) {
    f->count = drawing->state_count;
    for (int page = 0; page < KT_FILM_PAGES; page++)
        f->page[page] = calloc((size_t)f->count, sizeof *f->page[page]);
    bool fine = f->page[0] != NULL && f->page[1] != NULL;
    if (!fine)
        kt_say("there is not enough memory for the picture");
    for (int k = 0; k < f->count && fine; k++)
        fine = take_pages(drawing, f, k);
    return fine && take_fronts(drawing, f);
}

bool kt_film_has_front(const kt_film *f, int path, int first, int end) {
    bool has_front = false;
    for (int k = first; k < end && k < f->count && !has_front; k++)
        has_front = strcmp(f->front[k * f->path_count + path], "0 1") != 0;
    return has_front;
}

int kt_film_scene_end(const kt_film *f, int first, int stride) {
    int next = first + stride;
    while (next < f->count && are_frames_alike(&f->page[0][first], &f->page[0][next]))
        next += stride;
    return next;
}
