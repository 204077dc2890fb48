/* Text, marks and files of pictures. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "plot/paper.h"

#include "command.h"
#include "records/output.h"

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

const double kt_text_size = 13.0, kt_small_size = 11.5, kt_title_size = 16.0;

void kt_paper_use(cairo_t *c, kt_colour colour) { cairo_set_source_rgb(c, colour.red, colour.green, colour.blue); }

void kt_paper_stroke(cairo_t *c, kt_colour colour, double width) {
    kt_paper_use(c, colour);
    cairo_set_line_width(c, width);
    cairo_stroke(c);
}

void kt_paper_fill(cairo_t *c, kt_colour fill, kt_colour edge, double width) {
    kt_paper_use(c, fill);
    cairo_fill_preserve(c);
    kt_paper_stroke(c, edge, width);
}

/* ---- text -------------------------------------------------------------------------------------------------------- */

double kt_paper_width(cairo_t *c, const char *text) {
    cairo_text_extents_t extents;
    cairo_text_extents(c, kt_show(text).text, &extents);
    return extents.x_advance;
}

static double shift(kt_anchor anchor, double width) {
    return anchor == KT_ANCHOR_LEFT ? 0.0 : anchor == KT_ANCHOR_RIGHT ? width : 0.5 * width;
}

/* In an SVG, cairo would draw each letter as a shape. To keep text as text, <text> elements are collected in a stream.
 * The stream is attached to c under this key and appended to the file at the end. */
static const cairo_user_data_key_t elements_key;

static void write_svg_escaped(FILE *file, const char *text) {
    for (; *text != '\0'; text++)
        if (*text == '&' || *text == '<' || *text == '>')
            fprintf(file, "&#%d;", *text);
        else
            putc(*text, file);
}

static void write_paper_text(cairo_t *c, FILE *file, double x, double y, kt_anchor anchor, const char *text) {
    static const char *const anchors[] = {"", " text-anchor=\"middle\"", " text-anchor=\"end\""};
    double red, green, blue, opaque;
    double right = 1.0, down = 0.0;
    char turned[80] = "";
    cairo_matrix_t font;
    cairo_get_font_matrix(c, &font);
    cairo_user_to_device(c, &x, &y);
    cairo_user_to_device_distance(c, &right, &down);
    const double angle = atan2(down, right) * 90.0 / acos(0.0);
    if (fabs(angle) > 1e-6)
        (void)snprintf(turned, sizeof turned, " transform=\"rotate(%.4g %.2f %.2f)\"", angle, x, y);
    (void)cairo_pattern_get_rgba(cairo_get_source(c), &red, &green, &blue, &opaque);
    const bool bold = cairo_toy_font_face_get_weight(cairo_get_font_face(c)) == CAIRO_FONT_WEIGHT_BOLD;
    fprintf(file, "<text x=\"%.2f\" y=\"%.2f\" font-size=\"%g\" fill=\"#%02x%02x%02x\"%s%s%s>", x, y, font.yy,
            (unsigned)lround(255.0 * red), (unsigned)lround(255.0 * green), (unsigned)lround(255.0 * blue),
            anchors[anchor], bold ? " font-weight=\"bold\"" : "", turned);
    write_svg_escaped(file, text);
    fputs("</text>\n", file);
}

void kt_paper_text(cairo_t *c, double x, double y, kt_anchor anchor, const char *text) {
    FILE *elements = cairo_get_user_data(c, &elements_key);
    const double width = kt_paper_width(c, text); /* also detects text that is not valid UTF-8 */
    if (elements != NULL) {
        write_paper_text(c, elements, x, y, anchor, kt_show(text).text);
        return;
    }
    cairo_move_to(c, x - shift(anchor, width), y);
    cairo_show_text(c, kt_show(text).text);
    cairo_new_path(c); /* the current point would be at the end of the text: a line from there to the next shape */
}

/* The text is cut between characters, not within one. */
void kt_paper_text_within(cairo_t *c, double x, double y, double width, const char *title) {
    const kt_shown shown = kt_show(title);
    const char *text = shown.text;
    char part[260];
    int length = (int)strlen(text);
    if (kt_paper_width(c, text) <= width) {
        kt_paper_text(c, x, y, KT_ANCHOR_LEFT, text);
        return;
    }
    length = length < 240 ? length : 240;
    do {
        while (length > 0 && ((unsigned char)text[--length] & 0xC0U) == 0x80U)
            ;
        snprintf(part, sizeof part, "%.*s\u2026", length, text);
    } while (length > 0 && kt_paper_width(c, part) > width);
    kt_paper_text(c, x, y, KT_ANCHOR_LEFT, part);
}

static bool continues_character(char byte) { return ((unsigned char)byte & 0xC0U) == 0x80U; }

void kt_paper_text_short(cairo_t *c, double x, double y, double width, kt_anchor anchor, const char *label) {
    const kt_shown shown = kt_show(label);
    const char *text = shown.text;
    char part[sizeof shown.text + 4];
    const size_t length = strlen(text);
    size_t head = length - length / 2, tail = head; /* the part before and the rest after the cut */
    (void)snprintf(part, sizeof part, "%s", text);
    while (kt_paper_width(c, part) > width && (head > 0 || tail < length)) {
        if (head > 0 && (head >= length - tail || tail == length))
            do
                head--;
            while (head > 0 && continues_character(text[head]));
        else
            do
                tail++;
            while (tail < length && continues_character(text[tail]));
        (void)snprintf(part, sizeof part, "%.*s\u2026%s", (int)head, text, text + tail);
    }
    kt_paper_text(c, x, y, anchor, part);
}

void kt_paper_power(cairo_t *c, double x, double y, kt_anchor anchor, const char *exponent, double size) {
    cairo_set_font_size(c, size);
    const double base = kt_paper_width(c, "10");
    cairo_set_font_size(c, 0.75 * size);
    x -= shift(anchor, base + kt_paper_width(c, exponent));
    kt_paper_text(c, x + base, y - 0.4 * size, KT_ANCHOR_LEFT, exponent);
    cairo_set_font_size(c, size);
    kt_paper_text(c, x, y, KT_ANCHOR_LEFT, "10");
}

static double width_at(cairo_t *c, double size, const char *text) {
    cairo_set_font_size(c, size);
    return kt_paper_width(c, text);
}

/* Returns the length of the longest beginning of a text that fits and ends before a space; 0: none does. */
static size_t length_of_line(cairo_t *c, double width, const char *text) {
    char line[300];
    size_t length = 0;
    for (const char *at = strchr(text, ' '); at != NULL; at = strchr(at + 1, ' ')) {
        (void)snprintf(line, sizeof line, "%.*s", (int)(at - text), text);
        if (kt_paper_width(c, line) <= width)
            length = (size_t)(at - text);
    }
    return length;
}

/* Draws a subtitle on at most two lines, or on three on a narrow page. The last line is cut. */
static void draw_subtitle(cairo_t *c, double x, double width, const char *subtitle) {
    enum { LINE = 16 };
    const int lines = width < 500.0 ? 3 : 2;
    double y = 48.0;
    for (int i = 1; i < lines && kt_paper_width(c, subtitle) > width; i++) {
        char line[300];
        const size_t length = length_of_line(c, width, subtitle);
        if (length == 0)
            break;
        (void)snprintf(line, sizeof line, "%.*s", (int)length, subtitle);
        kt_paper_text(c, x, y, KT_ANCHOR_LEFT, line);
        subtitle += length + 1;
        y += LINE;
    }
    kt_paper_text_within(c, x, y, width, subtitle);
}

void kt_paper_head(cairo_t *c, const kt_palette *palette, double x, double width, const char *title,
                   const char *subtitle) {
    kt_paper_use(c, palette->paper);
    cairo_paint(c);
    kt_paper_use(c, palette->ink);
    cairo_select_font_face(c, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_BOLD);
    cairo_set_font_size(c, kt_title_size);
    kt_paper_text_within(c, x, 28.0, width, title);
    cairo_select_font_face(c, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(c, kt_text_size);
    kt_paper_use(c, palette->quiet);
    draw_subtitle(c, x, width, subtitle);
}

void kt_paper_quantity(cairo_t *c, double x, double y, kt_anchor anchor, const char *title, const char *unit,
                       int exponent) {
    char text[256], power[16] = "", tail[64] = "";
    snprintf(text, sizeof text, "%s%s%s", title, unit != NULL || exponent != 0 ? ", " : "",
             exponent == 0 && unit != NULL ? unit : "");
    if (exponent == 0) {
        cairo_set_font_size(c, kt_text_size);
        kt_paper_text(c, x, y, anchor, text);
        return;
    }
    snprintf(power, sizeof power, "%s%d", exponent < 0 ? "\u2212" : "", abs(exponent));
    if (unit != NULL)
        snprintf(tail, sizeof tail, " %s", unit);
    const double after = width_at(c, 0.75 * kt_text_size, power), ten = width_at(c, kt_text_size, "10");
    const double before = kt_paper_width(c, text);
    x -= shift(anchor, before + ten + after + kt_paper_width(c, tail));
    kt_paper_text(c, x, y, KT_ANCHOR_LEFT, text);
    kt_paper_power(c, x + before, y, KT_ANCHOR_LEFT, power, kt_text_size);
    if (unit != NULL)
        kt_paper_text(c, x + before + ten + after, y, KT_ANCHOR_LEFT, tail);
}

/* ---- marks ------------------------------------------------------------------------------------------------------- */

static const double pi = 3.14159265358979323846;

/* Adds a regular polygon whose first corner is `turn` quarter turns clockwise from the top. */
static void trace_polygon(cairo_t *c, double x, double y, double radius, int corners, double turn) {
    for (int i = 0; i < corners; i++) {
        const double angle = pi * (2.0 * i / corners + 0.5 * turn);
        cairo_line_to(c, x + radius * sin(angle), y - radius * cos(angle));
    }
}

void kt_paper_trace_mark(cairo_t *c, double x, double y, int mark) {
    static const struct shape {
        int corners; /* 0: a circle */
        double turn, radius;
    } shapes[KT_PLOT_MARK_COUNT] = {{0, 0.0, 3.8}, {4, 0.5, 4.8}, {3, 0.0, 5.0}, {4, 0.0, 4.8},
                                    {3, 2.0, 5.0}, {5, 0.0, 4.8}, {6, 0.0, 4.6}};
    const struct shape *shape = &shapes[(mark - 1) % KT_PLOT_MARK_COUNT];
    cairo_new_sub_path(c);
    if (shape->corners == 0)
        cairo_arc(c, x, y, shape->radius, 0.0, 2.0 * pi);
    else
        trace_polygon(c, x, y, shape->radius, shape->corners, shape->turn);
    cairo_close_path(c);
}

void kt_paper_draw_marks(cairo_t *c, bool hollow, kt_colour colour, kt_colour paper) {
    kt_paper_use(c, hollow ? paper : colour);
    if (!hollow) {
        cairo_fill(c);
        return;
    }
    cairo_fill_preserve(c);
    kt_paper_stroke(c, colour, 1.3);
}

/* ---- the file ---------------------------------------------------------------------------------------------------- */

/* Tests the extension; the picture of a failed run has the additional extension ".partial". */
static bool ends_in(const char *path, const char *ending) {
    const size_t length = strlen(path), tail = strlen(".partial"), size = strlen(ending);
    const bool is_part = length > tail && strcmp(path + length - tail, ".partial") == 0;
    const size_t end = is_part ? length - tail : length;
    return end >= size && strncasecmp(path + end - size, ending, size) == 0;
}

typedef struct job {
    const char *path; /* NULL: to memory */
    char *text;       /* that */
    bool is_svg, is_pdf;
    int width, height;
    kt_paper_draw *draw;
    const void *what;
    cairo_status_t status;
    int reason; /* errno */
} job;

static cairo_status_t draw_on(cairo_surface_t *surface, const job *j, double scale, FILE *elements) {
    cairo_t *c = cairo_create(surface);
    cairo_status_t status = CAIRO_STATUS_SUCCESS;
    cairo_scale(c, scale, scale);
    if (elements != NULL)
        status = cairo_set_user_data(c, &elements_key, elements, NULL);
    j->draw(c, j->what);
    if (status == CAIRO_STATUS_SUCCESS)
        status = cairo_status(c);
    cairo_destroy(c);
    return status;
}

/* Finishes and releases a surface; keeps errno. */
static cairo_status_t end_surface(cairo_surface_t *surface, cairo_status_t status) {
    cairo_surface_finish(surface);
    if (status == CAIRO_STATUS_SUCCESS)
        status = cairo_surface_status(surface);
    const int reason = errno;
    cairo_surface_destroy(surface);
    errno = reason;
    return status;
}

/* PNG pictures have two pixels per unit, for screens of high resolution. */
static cairo_status_t write_png(const job *j) {
    cairo_surface_t *surface = cairo_image_surface_create(CAIRO_FORMAT_RGB24, 2 * j->width, 2 * j->height);
    cairo_status_t status = draw_on(surface, j, 2.0, NULL);
    if (status == CAIRO_STATUS_SUCCESS)
        status = cairo_surface_write_to_png(surface, j->path);
    return end_surface(surface, status);
}

static cairo_status_t append_to_file(void *file, const unsigned char *data, unsigned length) {
    return fwrite(data, 1, length, file) == length ? CAIRO_STATUS_SUCCESS : CAIRO_STATUS_WRITE_ERROR;
}

/* Draws a page of an SVG or a PDF, whose units are points. Cairo's output goes to `shapes`, and the text elements of an
 * SVG go to `elements`. */
static cairo_status_t draw_vectors(FILE *shapes, FILE *elements, const job *j) {
    cairo_surface_t *(*const create)(cairo_write_func_t, void *, double, double) =
        j->is_pdf ? cairo_pdf_surface_create_for_stream : cairo_svg_surface_create_for_stream;
    cairo_surface_t *surface = create(append_to_file, shapes, j->width, j->height);
    return end_surface(surface, draw_on(surface, j, 1.0, elements));
}

/* Cairo does not report that a disk is full: not if it closes the file, and not always if a write fails. */
static cairo_status_t write_pdf(const job *j) {
    FILE *file = fopen(j->path, "wb");
    if (file == NULL)
        return CAIRO_STATUS_WRITE_ERROR;
    cairo_status_t status = draw_vectors(file, NULL, j);
    if (ferror(file) != 0)
        status = CAIRO_STATUS_WRITE_ERROR;
    const int reason = errno;
    if (fclose(file) != 0)
        return CAIRO_STATUS_WRITE_ERROR;
    errno = reason;
    return status;
}

/* Skips a redundant move after 'Z' (close path) and returns the remaining text. After each closed shape cairo writes a
 * move to the current point, and then another move to the next shape. */
static const char *skip_move(const char *text) {
    if (strncmp(text, " M ", 3) != 0)
        return text;
    const char *end = text + 3;
    end += strspn(end, "-.0123456789 ");
    return *end == 'M' ? end - 1 : *end == '"' ? end : text;
}

/* Returns the length of `part` if the text begins with it, else 0. */
static size_t length_at(const char *text, const char *part) {
    const size_t length = strlen(part);
    return strncmp(text, part, length) == 0 ? length : 0;
}

/* Returns the length of a property that has its default value, or 0 for other texts. The property is `name:value;`
 * within a style, as written by cairo before 1.17.6, or ` name="value"`. The miter limit is safe to omit: mitres that
 * long do not occur. */
static size_t default_length(const char *text) {
    static const char *const defaults[][2] = {
        {"stroke-linecap:butt;", " stroke-linecap=\"butt\""},
        {"stroke-opacity:1;", " stroke-opacity=\"1\""},
        {"stroke-miterlimit:10;", " stroke-miterlimit=\"10\""},
        {"stroke-width:1;", " stroke-width=\"1\""},
        {"fill-rule:nonzero;", " fill-rule=\"nonzero\""},
        {"fill-opacity:1;", " fill-opacity=\"1\""},
        {"stop-opacity:1;", " stop-opacity=\"1\""},
    };
    size_t length = 0;
    for (size_t i = 0; length == 0 && i < 2 * sizeof defaults / sizeof defaults[0]; i++)
        length = length_at(text, defaults[i / 2][i % 2]);
    return length;
}

/* Writes a colour such as rgb(100%,50%,0%) in shorter form, #ff8000. Returns the length of the text, or 0 if the text
 * is no colour. */
static size_t write_colour(FILE *file, const char *text) {
    double share[3];
    const char *at = text + strlen("rgb(");
    if (strncmp(text, "rgb(", strlen("rgb(")) != 0)
        return 0;
    for (int i = 0; i < 3; i++) {
        char *end;
        share[i] = strtod(at, &end);
        if (end == at || end[0] != '%' || end[1] != (i < 2 ? ',' : ')'))
            return 0;
        at = end + 2;
    }
    fputc('#', file);
    for (int i = 0; i < 3; i++)
        fprintf(file, "%02x", (unsigned)lround(2.55 * share[i]));
    return (size_t)(at - text);
}

/* Writes shapes in shorter form: without properties at their defaults, without redundant moves, and with short colours.
 * Numbers are cut after the second decimal, since a hundredth of a point is invisible on any screen. */
static void write_short(FILE *file, const char *text) {
    int decimals = -1; /* digits after the decimal point; -1: not after one */
    while (*text != '\0') {
        const size_t left_out = default_length(text);
        if (left_out > 0) {
            text += left_out;
            continue;
        }
        const size_t colour = *text == 'r' ? write_colour(file, text) : 0;
        if (colour > 0) {
            text += colour;
            decimals = -1;
            continue;
        }
        const char letter = *text++;
        const bool digit = letter >= '0' && letter <= '9';
        decimals = letter == '.' ? 0 : digit && decimals >= 0 ? decimals + 1 : -1;
        if (decimals <= 2)
            putc(letter, file);
        if (letter == 'Z')
            text = skip_move(text);
    }
}

/* Writes the shapes with the text elements inserted before their end tag. */
static cairo_status_t write_shapes_and_text(FILE *file, char *shapes, const char *elements) {
    static const char end_tag[] = "</svg>";
    char *end = strstr(shapes, end_tag);
    if (end == NULL)
        return CAIRO_STATUS_WRITE_ERROR;
    *end = '\0';
    write_short(file, shapes);
    fprintf(file, "<g font-family=\"sans-serif\" xml:space=\"preserve\">\n%s</g>\n%s\n", elements, end_tag);
    return ferror(file) == 0 ? CAIRO_STATUS_SUCCESS : CAIRO_STATUS_WRITE_ERROR;
}

/* Writes to the file, or, where there is no path, to memory that the caller frees. */
static cairo_status_t write_paper_file(const char *path, char **text, char *shapes, const char *elements) {
    size_t size;
    FILE *file = path != NULL ? fopen(path, "w") : open_memstream(text, &size);
    if (file == NULL)
        return path != NULL ? CAIRO_STATUS_WRITE_ERROR : CAIRO_STATUS_NO_MEMORY;
    const cairo_status_t status = write_shapes_and_text(file, shapes, elements);
    return fclose(file) == 0 ? status : path != NULL ? CAIRO_STATUS_WRITE_ERROR : CAIRO_STATUS_NO_MEMORY;
}

/* A picture is drawn on a separate stack. The library that finds fonts has nested functions with 17 kB of stack each.
 * Together they may need more stack than the program was given. */
enum { DRAWING_STACK = 1 << 20 };

static cairo_status_t write_svg(job *j) {
    char *shapes = NULL, *elements = NULL;
    size_t shapes_size = 0, elements_size = 0;
    FILE *one = open_memstream(&shapes, &shapes_size), *other = open_memstream(&elements, &elements_size);
    cairo_status_t status = CAIRO_STATUS_NO_MEMORY;
    if (one != NULL && other != NULL)
        status = draw_vectors(one, other, j);
    const bool one_lost = one != NULL && fclose(one) != 0;
    const bool other_lost = other != NULL && fclose(other) != 0;
    const bool lost = one_lost || other_lost;
    if (status == CAIRO_STATUS_SUCCESS)
        status = lost ? CAIRO_STATUS_NO_MEMORY : write_paper_file(j->path, &j->text, shapes, elements);
    const int reason = errno;
    free(shapes);
    free(elements);
    errno = reason;
    return status;
}

static void *write_job(void *user) {
    job *j = user;
    errno = 0;
    j->status = j->is_svg ? write_svg(j) : (j->is_pdf ? write_pdf : write_png)(j);
    j->reason = errno;
    return NULL;
}

static void write_on_own_stack(job *j) {
    pthread_attr_t attributes;
    pthread_t thread;
    bool started = pthread_attr_init(&attributes) == 0;
    if (started) {
        started = pthread_attr_setstacksize(&attributes, DRAWING_STACK) == 0 &&
                  pthread_create(&thread, &attributes, write_job, j) == 0;
        (void)pthread_attr_destroy(&attributes);
    }
    if (!started || pthread_join(thread, NULL) != 0)
        j->status = CAIRO_STATUS_NO_MEMORY;
}

int kt_paper_write(const char *path, int width, int height, kt_paper_draw *draw, const void *what) {
    kt_output output;
    const int code = kt_output_start(&output, path);
    if (code >= 0)
        return code;
    job j = {.path = kt_output_path(&output),
             .is_svg = ends_in(path, ".svg"),
             .is_pdf = ends_in(path, ".pdf"),
             .width = width,
             .height = height,
             .draw = draw,
             .what = what};
    write_on_own_stack(&j);
    const bool fine = j.status == CAIRO_STATUS_SUCCESS;
    if (kt_output_end(&output, fine ? KT_OUTPUT_WHOLE : KT_OUTPUT_NOTHING) != 0)
        return KT_EXIT_INTEGRATION;
    if (fine)
        return KT_EXIT_DONE;
    const bool by_system = j.status == CAIRO_STATUS_WRITE_ERROR && j.reason != 0;
    return kt_reject(KT_EXIT_INTEGRATION, "%s cannot be written: %s", path,
                     by_system ? strerror(j.reason) : cairo_status_to_string(j.status));
}

char *kt_paper_svg(int width, int height, kt_paper_draw *draw, const void *what) {
    job j = {.is_svg = true, .width = width, .height = height, .draw = draw, .what = what};
    write_on_own_stack(&j);
    if (j.status == CAIRO_STATUS_SUCCESS)
        return j.text;
    kt_say("the picture cannot be drawn: %s", cairo_status_to_string(j.status));
    free(j.text);
    return NULL;
}
