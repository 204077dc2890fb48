/* Animated pictures: the SVGs of all frames, merged line by line into one.
 *
 * The pictures of two states mostly have the same elements, and only numbers and colours in them differ. Frames in a
 * row with equal elements, painted in the same order, are a scene of the play. If the order differs, the element of one
 * body would become that of another. An element of a scene is written once. Each attribute that varies
 * has an <animate> element (SMIL) with its values at all frames. A viewer interpolates between them. A play of several
 * scenes shows them one after the other. Viewers without animation show the first frame.
 *
 * Each frame is painted in the colours of a light page and of a dark one. A colour that differs is a class, and a media
 * query (prefers-color-scheme) chooses between both. Elements whose colours vary with time, and gradients, are written
 * twice, once for each page. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/film.h"

#include "command.h"
#include "records/output.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    ATTRIBUTES_MOST = 24,
    CLASSES_MOST = 400,
    SLOWEST = 4, /* frames a second: no more are left out */
};

/* ---- elements ---------------------------------------------------------------------------------------------------- */

/* An element: its name, its attributes, the properties of `style` among them, and the text behind them: "/>", ">" or
 * more. */
typedef struct element {
    char *text; /* memory of all other texts */
    const char *name;
    const char *key[ATTRIBUTES_MOST], *value[ATTRIBUTES_MOST];
    int count;
    const char *tail;
} element;

static void add_attribute(element *e, const char *key, const char *value) {
    if (e->count < ATTRIBUTES_MOST) {
        e->key[e->count] = key;
        e->value[e->count++] = value;
    }
}

/* "fill:none;stroke:#000000;" */
static void add_style(element *e, char *style) {
    for (char *end; *style != '\0' && (end = strchr(style, ';')) != NULL; style = end + 1) {
        char *colon = strchr(style, ':');
        *end = '\0';
        if (colon == NULL)
            continue;
        *colon = '\0';
        add_attribute(e, style + strspn(style, " "), colon + 1);
    }
}

/* Reads a line; false: it is no element that has attributes, or memory is insufficient. */
static bool read_element(const char *line, element *e) {
    *e = (element){.text = strdup(line)};
    if (e->text == NULL || line[0] != '<' || !isalpha((unsigned char)line[1]))
        return false;
    char *at = e->text + 1;
    e->name = at;
    at += strcspn(at, " />");
    while (*at == ' ') {
        *at++ = '\0';
        char *key = at, *equals = strchr(at, '=');
        char *end = equals != NULL && equals[1] == '"' ? strchr(equals + 2, '"') : NULL;
        if (*at == '/' || *at == '>' || end == NULL)
            break;
        *equals = *end = '\0';
        if (strcmp(key, "style") == 0)
            add_style(e, equals + 2);
        else
            add_attribute(e, key, equals + 2);
        at = end + 1;
    }
    const char *tail = line + (at - e->text);
    e->tail = tail + strspn(tail, " ");
    *at = '\0';
    return true;
}

/* An element at all frames of a scene, on both pages. */
typedef struct strip {
    element *at[KT_FILM_PAGES];
    int count; /* frames */
} strip;

static void free_strip(strip *s) {
    for (int page = 0; page < KT_FILM_PAGES; page++) {
        for (int k = 0; k < s->count && s->at[page] != NULL; k++)
            free(s->at[page][k].text);
        free(s->at[page]);
    }
}

/* The frames of the play that are shown. */
typedef struct cut {
    const kt_film *film;
    int first, end, stride; /* frames of a scene: first, first + stride, ..., before end */
} cut;

static bool read_strip(const cut *c, int line, strip *s) {
    bool fine = true;
    *s = (strip){.count = (c->end - c->first + c->stride - 1) / c->stride};
    for (int page = 0; page < KT_FILM_PAGES && fine; page++) {
        s->at[page] = calloc((size_t)s->count, sizeof *s->at[page]);
        for (int k = 0; k < s->count && fine; k++)
            fine = s->at[page] != NULL &&
                   read_element(c->film->page[page][c->first + k * c->stride].line[line], &s->at[page][k]);
    }
    return fine;
}

/* Coordinates: x, y1, cx, ... */
static bool is_coordinate_key(const char *key) { return strlen(key) <= 2 && strpbrk(key, "xy") != NULL; }

/* Whether two values differ by more than the rounding of positions on the page. */
static bool differ(const char *a, const char *b) {
    while (*a != '\0' && *b != '\0') {
        const size_t one = kt_film_number_length(a), other = kt_film_number_length(b);
        if (one > 0 && other > 0) {
            if (!(fabs(strtod(a, NULL) - strtod(b, NULL)) < 0.04))
                return true;
            a += one;
            b += other;
        } else if (*a++ != *b++) {
            return true;
        }
    }
    return *a != *b;
}

static bool varies(const strip *s, int page, int attribute) {
    const char *key = s->at[page][0].key[attribute];
    const bool is_place = strcmp(key, "d") == 0 || is_coordinate_key(key);
    for (int k = 1; k < s->count; k++) {
        const char *first = s->at[page][0].value[attribute], *now = s->at[page][k].value[attribute];
        if (strcmp(first, now) != 0 && (!is_place || differ(first, now)))
            return true;
    }
    return false;
}

static bool has_colour(const element *e, int attribute) {
    const char *key = e->key[attribute];
    return strcmp(key, "fill") == 0 || strcmp(key, "stroke") == 0 || strcmp(key, "stop-color") == 0;
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

/* The pages whose colours an element is written in. */
typedef enum shade { SHADE_BOTH, SHADE_LIGHT, SHADE_DARK } shade;

typedef struct colour_class {
    char property[16], value[KT_FILM_PAGES][48];
} colour_class;

typedef struct writer {
    FILE *file;
    double seconds;
    int last; /* the last frame of the play */
    int scene;
    bool is_alone;    /* it is the only scene */
    bool is_defining; /* gradients and clips */
    colour_class classes[CLASSES_MOST];
    int class_count;
    bool has_twins; /* elements for one page alone */
} writer;

/* Writes a number with one decimal, without a trailing ".0". */
static void write_decimal(FILE *file, double x) {
    char text[48];
    (void)snprintf(text, sizeof text, "%.1f", x);
    const size_t length = strlen(text);
    if (length > 2 && text[length - 1] == '0')
        text[length - 2] = '\0';
    fputs(strcmp(text, "-0") == 0 ? "0" : text, file);
}

/* Writes a value with short numbers; ids have the number of the scene, and those of the dark page a letter. */
static void write_value(const writer *w, const char *key, const char *value, shade of) {
    const bool is_path = strcmp(key, "d") == 0;
    const char *hash = strstr(value, "url(#");
    if (strcmp(key, "id") == 0 || hash != NULL || strcmp(key, "xlink:href") == 0) {
        const size_t before = hash != NULL ? 5 : strcmp(key, "id") != 0 && value[0] == '#' ? 1 : 0;
        if (before == 0 && strcmp(key, "id") != 0) { /* data */
            fputs(value, w->file);
            return;
        }
        fprintf(w->file, "%.*s%s%d%s", (int)before, value, of == SHADE_DARK ? "k" : "s", w->scene, value + before);
        return;
    }
    const bool has_short = is_path || is_coordinate_key(key);
    char before = ' ';
    while (*value != '\0') {
        const size_t length = has_short && !isalpha((unsigned char)before) ? kt_film_number_length(value) : 0;
        if (length > 0) {
            write_decimal(w->file, strtod(value, NULL));
            value += length;
            before = '0';
            continue;
        }
        const bool is_spare =
            is_path && *value == ' ' && (before != '0' || isalpha((unsigned char)value[1]) || value[1] == '\0');
        if (!is_spare)
            fputc(*value, w->file);
        before = is_path ? ' ' : *value;
        value++;
    }
}

/* Writes the instants of frames, if a scene does not take the whole play. */
static void write_instants(const writer *w, const cut *c) {
    if (w->is_alone)
        return;
    fputs(" keyTimes=\"0", w->file);
    for (int k = c->first; k < c->end; k += c->stride)
        fprintf(w->file, ";%.5g", (double)k / w->last);
    fputs(";1\"", w->file);
}

/* Writes the <animate> element of an attribute, with its values at all frames. The values are numbers, between which a
 * viewer interpolates, or colours. of: the page whose values are written; SHADE_BOTH: the light page. */
static void write_animation(const writer *w, const cut *c, const strip *s, int attribute, shade of) {
    const int page = of == SHADE_DARK;
    const char *key = s->at[page][0].key[attribute];
    fprintf(w->file, "<animate attributeName=\"%s\" dur=\"%.4gs\" repeatCount=\"indefinite\"", key, w->seconds);
    write_instants(w, c);
    fputs(" values=\"", w->file);
    const int count = s->count;
    for (int k = w->is_alone ? 0 : -1; k < count + (w->is_alone ? 0 : 1); k++) {
        const int frame = k < 0 ? 0 : k >= count ? count - 1 : k;
        if (k > (w->is_alone ? 0 : -1))
            fputc(';', w->file);
        write_value(w, key, s->at[page][frame].value[attribute], of);
    }
    fputs("\"/>", w->file);
}

/* The number of the class of a property with these values; -1: there are too many. */
static int property_class_of(writer *w, const char *property, const char *light, const char *dark) {
    for (int i = 0; i < w->class_count; i++) {
        const colour_class *one = &w->classes[i];
        if (strcmp(one->property, property) == 0 && strcmp(one->value[0], light) == 0 &&
            strcmp(one->value[1], dark) == 0)
            return i;
    }
    if (w->class_count == CLASSES_MOST)
        return -1;
    colour_class *one = &w->classes[w->class_count];
    (void)snprintf(one->property, sizeof one->property, "%s", property);
    (void)snprintf(one->value[0], sizeof one->value[0], "%s", light);
    (void)snprintf(one->value[1], sizeof one->value[1], "%s", dark);
    return w->class_count++;
}

/* Returns the class of a gradient: "url(#linear0)" becomes the names that gradients have on both pages. */
static int class_of_gradient(writer *w, const char *property, const char *value) {
    char names[KT_FILM_PAGES][48];
    for (int page = 0; page < KT_FILM_PAGES; page++)
        (void)snprintf(names[page], sizeof names[page], "url(#%s%d%.30s", page == 1 ? "k" : "s", w->scene, value + 5);
    return property_class_of(w, property, names[0], names[1]);
}

/* The class of an attribute that differs on the pages; -1: it needs none. */
static int class_of_attribute(writer *w, const strip *s, int i) {
    const element *light = &s->at[0][0], *dark = &s->at[1][0];
    if (!has_colour(light, i))
        return -1;
    if (strncmp(light->value[i], "url(#", 5) == 0)
        return class_of_gradient(w, light->key[i], light->value[i]);
    return strcmp(light->value[i], dark->value[i]) != 0
               ? property_class_of(w, light->key[i], light->value[i], dark->value[i])
               : -1;
}

/* more: further attributes; inner: elements within it; both may be empty. */
static void write_element(writer *w, const cut *c, const strip *s, shade of, const char *more, const char *inner) {
    const int page = of == SHADE_DARK;
    const element *e = &s->at[page][0];
    char classes[64] = "";
    size_t used = 0;
    bool moves = inner[0] != '\0';
    fprintf(w->file, "<%s%s", e->name, more);
    for (int i = 0; i < e->count; i++) {
        const int class = of == SHADE_BOTH ? class_of_attribute(w, s, i) : -1;
        moves = moves || varies(s, page, i);
        if (class >= 0 && used < sizeof classes) {
            used += (size_t)snprintf(classes + used, sizeof classes - used, "%sc%d", used > 0 ? " " : "", class);
            continue;
        }
        fprintf(w->file, " %s=\"", e->key[i]);
        write_value(w, e->key[i], e->value[i], of);
        fputc('"', w->file);
    }
    const bool is_twin = of != SHADE_BOTH && !w->is_defining;
    if (is_twin)
        fprintf(w->file, " class=\"%s\"", of == SHADE_DARK ? "k" : "l");
    else if (used > 0)
        fprintf(w->file, " class=\"%s\"", classes);
    w->has_twins = w->has_twins || is_twin;
    const bool closes = strncmp(e->tail, "/>", 2) == 0;
    if (!moves) {
        fprintf(w->file, "%s\n", e->tail);
        return;
    }
    fprintf(w->file, ">%s", inner);
    for (int i = 0; i < e->count; i++)
        if (varies(s, page, i))
            write_animation(w, c, s, i, of);
    if (closes)
        fprintf(w->file, "</%s>\n", e->name);
    else
        fprintf(w->file, "%s\n", e->tail + 1);
}

/* Whether the colours of an element vary with time. Such an element is written once for each page. */
static bool shines(const strip *s) {
    for (int i = 0; i < s->at[0][0].count; i++)
        for (int page = 0; page < KT_FILM_PAGES; page++)
            if (has_colour(&s->at[0][0], i) && varies(s, page, i))
                return true;
    return false;
}

/* Writes a line at all frames. Lines that are no elements, or have the same words at all frames, are copied. Returns
 * false if memory is insufficient. */
static bool write_moving_line(writer *w, const cut *c, int line, shade of) {
    strip s;
    const char *text = c->film->page[0][c->first].line[line];
    if (text[0] != '<' || !isalpha((unsigned char)text[1]) || strchr(text, ' ') == NULL) {
        fprintf(w->file, "%s\n", text);
        return true;
    }
    const bool fine = read_strip(c, line, &s);
    if (fine && of == SHADE_BOTH && shines(&s)) {
        write_element(w, c, &s, SHADE_LIGHT, "", "");
        write_element(w, c, &s, SHADE_DARK, "", "");
    } else if (fine) {
        write_element(w, c, &s, of, "", "");
    }
    free_strip(&s);
    return fine;
}

/* ---- paths ------------------------------------------------------------------------------------------------------- */

/* Writes a path with an animation within its element. attributes: further attributes of the element. */
static void write_drawn_path(writer *w, const cut *c, const char *const lines[KT_FILM_PAGES], const char *attributes,
                             const char *inner) {
    element pages[KT_FILM_PAGES];
    const strip s = {.at = {&pages[0], &pages[1]}, .count = 1};
    const bool light = read_element(lines[0], &pages[0]), dark = read_element(lines[1], &pages[1]);
    if (light && dark)
        write_element(w, c, &s, SHADE_BOTH, attributes, inner);
    free(pages[0].text);
    free(pages[1].text);
}

/* Writes a path that grows with the motion: a dash as long as the whole path, which extends from its beginning. */
static void write_growing_path(writer *w, const cut *c, const kt_drawing *drawing, int path,
                               const char *const lines[KT_FILM_PAGES]) {
    char *inner = NULL;
    size_t size;
    FILE *file = open_memstream(&inner, &size);
    if (file == NULL)
        return;
    fprintf(file, "<animate attributeName=\"stroke-dashoffset\" dur=\"%.4gs\" repeatCount=\"indefinite\" values=\"1",
            w->seconds);
    for (int k = c->stride; k <= w->last; k += c->stride)
        fprintf(file, ";%.4g", 1.0 - kt_path_share(drawing, &drawing->paths[path], (double)k / w->last));
    fputs("\"/>", file);
    if (fclose(file) == 0)
        write_drawn_path(w, c, lines, " pathLength=\"1\" stroke-dasharray=\"1\"", inner);
    free(inner);
}

/* Writes the parts of a path that are in front of solids, if there are any: dashes, which vary between frames. */
static void write_front_of_path(writer *w, const cut *c, int path, const char *const lines[KT_FILM_PAGES]) {
    const kt_film *film = c->film;
    char *inner = NULL;
    size_t size;
    FILE *file = kt_film_has_front(film, path, c->first, c->end) ? open_memstream(&inner, &size) : NULL;
    if (file == NULL)
        return;
    fprintf(file,
            "<animate attributeName=\"stroke-dasharray\" calcMode=\"discrete\" dur=\"%.4gs\" "
            "repeatCount=\"indefinite\" keyTimes=\"0",
            w->seconds);
    for (int k = c->first; k < c->end; k += c->stride)
        fprintf(file, ";%.5g", (double)k / w->last);
    fprintf(file, "\" values=\"%s", film->front[c->first * film->path_count + path]);
    for (int k = c->first; k < c->end; k += c->stride)
        fprintf(file, ";%s", film->front[k * film->path_count + path]);
    fputs("\"/>", file);
    if (fclose(file) == 0)
        write_drawn_path(w, c, lines, " pathLength=\"1\" stroke-dasharray=\"0 1\"", inner);
    free(inner);
}

/* Returns the position of the paths among the lines of a frame that was drawn without paths. It is the first line that
 * differs if they are drawn. If the counts of lines do not fit, it is the end of the frame. Returns -1 on failure. */
static int find_paths(const kt_drawing *drawing, const cut *c, kt_path_layer layer,
                      kt_page_lines traced[KT_FILM_PAGES]) {
    const kt_page_lines *bare = &c->film->page[0][c->first];
    for (int page = 0; page < KT_FILM_PAGES; page++)
        if (!kt_film_take_frame(drawing, page, c->first, layer, &traced[page]))
            return -1;
    int line = 0;
    while (line < bare->count && line < traced[0].count && strcmp(bare->line[line], traced[0].line[line]) == 0)
        line++;
    const bool fits = traced[0].count == traced[1].count && traced[0].count == bare->count + drawing->path_count;
    return fits ? line : bare->count;
}

/* The paths of a scene: their lines in both layers, and where these are among the lines of a frame without paths. */
typedef struct layers {
    kt_page_lines behind[KT_FILM_PAGES], before[KT_FILM_PAGES];
    int behind_at, before_at; /* -1: failed */
} layers;

static layers find_layers(const kt_drawing *drawing, const cut *c) {
    const int none = c->film->page[0][c->first].count;
    layers l = {.behind_at = none, .before_at = none};
    if (drawing->path_count > 0)
        l.behind_at = find_paths(drawing, c, KT_PATHS_BEHIND, l.behind);
    if (c->film->front != NULL)
        l.before_at = find_paths(drawing, c, KT_PATHS_BEFORE, l.before);
    return l;
}

static void free_layers(layers *l) {
    for (int page = 0; page < KT_FILM_PAGES; page++) {
        kt_page_lines_free(&l->behind[page]);
        kt_page_lines_free(&l->before[page]);
    }
}

/* Writes the paths that belong before a line of a frame. */
static void write_paths_at(writer *w, const cut *c, const kt_drawing *drawing, const layers *l, int line) {
    for (int k = 0; k < drawing->path_count && line == l->behind_at; k++) {
        const char *const both[KT_FILM_PAGES] = {l->behind[0].line[line + k], l->behind[1].line[line + k]};
        write_growing_path(w, c, drawing, k, both);
    }
    for (int k = 0; k < drawing->path_count && line == l->before_at; k++) {
        const char *const both[KT_FILM_PAGES] = {l->before[0].line[line + k], l->before[1].line[line + k]};
        write_front_of_path(w, c, k, both);
    }
}

/* ---- the play ---------------------------------------------------------------------------------------------------- */

/* A scene that does not take the whole play is hidden before and behind. */
static void open_scene(const writer *w, const cut *c) {
    if (w->is_alone)
        return;
    const double from = (double)c->first / w->last, to = (double)c->end / w->last;
    fprintf(w->file,
            "<g visibility=\"%s\"><animate attributeName=\"visibility\" calcMode=\"discrete\" "
            "dur=\"%.4gs\" repeatCount=\"indefinite\" ",
            c->first == 0 ? "visible" : "hidden", w->seconds);
    if (c->first == 0)
        fprintf(w->file, "keyTimes=\"0;%.5g\" values=\"visible;hidden\"/>\n", to);
    else if (c->end > w->last)
        fprintf(w->file, "keyTimes=\"0;%.5g\" values=\"hidden;visible\"/>\n", from);
    else
        fprintf(w->file, "keyTimes=\"0;%.5g;%.5g\" values=\"hidden;visible;hidden\"/>\n", from, to);
}

/* Gradients, once for each page; returns the line behind them, or -1 if memory is insufficient. */
static int write_definitions(writer *w, const cut *c, int line) {
    const kt_page_lines *lines = &c->film->page[0][c->first];
    const int first = line + 1;
    int end = first;
    bool fine = true;
    while (end < lines->count && strcmp(lines->line[end], "</defs>") != 0)
        end++;
    fputs("<defs>\n", w->file);
    w->is_defining = true;
    for (shade of = SHADE_LIGHT; of <= SHADE_DARK; of++)
        for (int i = first; i < end && fine; i++)
            fine = write_moving_line(w, c, i, of);
    w->is_defining = false;
    fputs("</defs>\n", w->file);
    return fine ? end + 1 : -1;
}

static bool write_moving_scene(writer *w, const kt_drawing *drawing, const cut *c) {
    const kt_page_lines *lines = &c->film->page[0][c->first];
    layers paths = find_layers(drawing, c);
    bool fine = paths.behind_at >= 0 && paths.before_at >= 0;
    open_scene(w, c);
    for (int i = 2; i < lines->count - 1 && fine;) { /* between <svg> and </svg> */
        write_paths_at(w, c, drawing, &paths, i);
        const bool defines = strcmp(lines->line[i], "<defs>") == 0;
        const int next = defines ? write_definitions(w, c, i) : i + 1;
        fine = next > 0 && (defines || write_moving_line(w, c, i, SHADE_BOTH));
        i = next;
    }
    free_layers(&paths);
    if (!w->is_alone)
        fputs("</g>\n", w->file);
    return fine;
}

static void write_styles(FILE *file, const writer *w) {
    fputs("<style>\n", file);
    for (int page = 0; page < KT_FILM_PAGES; page++) {
        if (page == 1)
            fputs("@media (prefers-color-scheme:dark){\n", file);
        for (int i = 0; i < w->class_count; i++)
            fprintf(file, ".c%d{%s:%s}\n", i, w->classes[i].property, w->classes[i].value[page]);
        if (w->has_twins)
            fputs(page == 0 ? ".k{display:none}\n" : ".l{display:none}.k{display:inline}\n", file);
    }
    fputs("}\n</style>\n", file);
}

/* Writes all scenes with every stride-th frame; returns the text, which the caller frees, or NULL. */
static char *write_scenes(const kt_drawing *drawing, const kt_film *f, double seconds, int stride, writer *w) {
    char *text = NULL;
    size_t size;
    *w = (writer){.file = open_memstream(&text, &size), .seconds = seconds, .last = f->count - 1};
    bool fine = w->file != NULL;
    for (int first = 0; first < f->count && fine; w->scene++) {
        const cut c = {f, first, kt_film_scene_end(f, first, stride), stride};
        w->is_alone = first == 0 && c.end >= f->count;
        fine = write_moving_scene(w, drawing, &c);
        first = c.end;
    }
    const bool closed = w->file != NULL && fclose(w->file) == 0;
    if (fine && closed)
        return text;
    kt_say("there is not enough memory for the picture");
    free(text);
    return NULL;
}

static char *compose_animation(const kt_drawing *drawing, const kt_film *f, double seconds, int stride, size_t *size) {
    writer *w = malloc(sizeof *w);
    char *content = w != NULL ? write_scenes(drawing, f, seconds, stride, w) : NULL, *text = NULL;
    FILE *file = content != NULL ? open_memstream(&text, size) : NULL;
    if (file != NULL) {
        fprintf(file, "%s\n%s\n", f->page[0][0].line[0], f->page[0][0].line[1]);
        write_styles(file, w);
        fprintf(file, "%s</svg>\n", content);
        if (fclose(file) != 0) {
            free(text);
            text = NULL;
        }
    }
    free(content);
    free(w);
    return text;
}

/* A text, and its size in bytes. */
typedef struct animation {
    const char *text;
    size_t size;
} animation;

static void write_animation_text(FILE *file, const void *what) {
    const animation *a = what;
    (void)fwrite(a->text, 1, a->size, file);
}

int kt_animation_write(const kt_drawing *drawing, double seconds, const char *path, int *frames, size_t *bytes) {
    static const int strides[] = {1, 2, 3, 4, 6, 12};
    kt_film f = {.count = 0};
    char *text = NULL;
    bool fine = kt_film_take(drawing, &f);
    const int last = f.count - 1;
    for (size_t i = 0; i < sizeof strides / sizeof *strides && fine; i++) {
        const int left = last / strides[i]; /* frames */
        if (text != NULL && (*bytes <= KT_ANIMATION_BYTES || last % strides[i] != 0 || left < SLOWEST * seconds))
            break;
        free(text);
        text = compose_animation(drawing, &f, seconds, strides[i], bytes);
        *frames = last / strides[i] + 1;
        fine = text != NULL;
    }
    const int code = fine && text != NULL ? kt_output_write(path, write_animation_text, &(animation){text, *bytes})
                                          : KT_EXIT_INTEGRATION;
    free(text);
    kt_film_free(&f);
    return code;
}
