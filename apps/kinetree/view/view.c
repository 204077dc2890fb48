/* Writes the page that shows a motion. The build makes texts of the page's sources (view/embed.py). Between these texts
 * are the description of the mechanism as JSON and the frames in base64. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "view/view.h"

#include "command.h"
#include "records/output.h"
#include "view/page.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- base64 ------------------------------------------------------------------------------------------------------ */

/* Bytes to be written in base64, four letters for three bytes. A whole block is written at once. */
enum { BLOCK = 12288 }; /* bytes, a multiple of 6 */

typedef struct base64 {
    FILE *file;
    char pairs[4096][2];            /* the two letters of twelve bits */
    unsigned char bytes[BLOCK + 2]; /* read eight at a time, of which six are used */
    size_t count;
} base64;

static void start_letters(base64 *out, FILE *file) {
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    out->file = file;
    out->count = 0;
    for (size_t i = 0; i < sizeof out->pairs / sizeof *out->pairs; i++) {
        out->pairs[i][0] = letters[i / 64];
        out->pairs[i][1] = letters[i % 64];
    }
}

/* Writes the eight letters of the first six bytes. */
static void put_letters(const base64 *out, const unsigned char *from, char *to) {
    uint64_t word;
    memcpy(&word, from, sizeof word);
    if (__BYTE_ORDER__ != __ORDER_BIG_ENDIAN__)
        word = __builtin_bswap64(word);
    memcpy(to, out->pairs[word >> 52], 2);
    memcpy(to + 2, out->pairs[word >> 40 & 4095U], 2);
    memcpy(to + 4, out->pairs[word >> 28 & 4095U], 2);
    memcpy(to + 6, out->pairs[word >> 16 & 4095U], 2);
}

/* Writes the block. The last one is filled up to three bytes with zeros, which no reader uses. */
static void flush_letters(base64 *out) {
    char text[BLOCK / 3 * 4];
    const size_t size = (out->count + 2) / 3 * 3;
    memset(out->bytes + out->count, 0, (size + 5) / 6 * 6 + 2 - out->count);
    for (size_t from = 0; from < size; from += 6)
        put_letters(out, out->bytes + from, text + from / 3 * 4);
    if (size > 0)
        (void)fwrite(text, 1, size / 3 * 4, out->file); /* errors are checked at the end */
    out->count = 0;
}

static void put_base64_bytes(base64 *out, const unsigned char *from, size_t size) {
    while (size > 0) {
        const size_t room = BLOCK - out->count, part = size < room ? size : room;
        memcpy(out->bytes + out->count, from, part);
        out->count += part;
        from += part;
        size -= part;
        if (out->count == BLOCK)
            flush_letters(out);
    }
}

/* Numbers of `size` bytes each, little-endian on every machine. */
static void put_base64_numbers(void *user, const void *numbers, size_t count, size_t size) {
    base64 *out = user;
    const unsigned char *from = numbers;
    if (__BYTE_ORDER__ != __ORDER_BIG_ENDIAN__) {
        put_base64_bytes(out, from, count * size);
        return;
    }
    for (size_t i = 0; i < count * size; i++)
        put_base64_bytes(out, &from[i + size - 1 - 2 * (i % size)], 1);
}

static void put_frames(const kt_motion *motion, FILE *file) {
    base64 out;
    start_letters(&out, file);
    kt_motion_write_frames(motion, put_base64_numbers, &out);
    flush_letters(&out);
}

/* ---- the file ---------------------------------------------------------------------------------------------------- */

/* The parts of a page that the motion determines. */
typedef struct view_page {
    const kt_motion *motion;
    const kt_json_writer *json;
    const kt_live *live;  /* NULL: the page shows the motion alone */
    kt_json_writer scene; /* of a live page */
} view_page;

static void put_base64(const kt_bytes *from, FILE *file) {
    base64 out;
    start_letters(&out, file);
    put_base64_bytes(&out, (const unsigned char *)from->text, from->used);
    flush_letters(&out);
}

#define PUT_PART(name, file) (void)fwrite(kt_page_##name, 1, kt_page_##name##_size, file)

static void write_page(FILE *file, const void *what) {
    const view_page *page = what;
    (void)setvbuf(file, NULL, _IONBF, 0); /* the parts are large already */
    PUT_PART(head, file);
    (void)fwrite(page->json->text, 1, page->json->used, file);
    PUT_PART(middle, file);
    put_frames(page->motion, file);
    PUT_PART(tail, file);
}

static void write_live_page(FILE *file, const void *what) {
    const view_page *page = what;
    (void)setvbuf(file, NULL, _IONBF, 0);
    PUT_PART(live_head, file);
    (void)fwrite(page->json->text, 1, page->json->used, file);
    PUT_PART(live_middle, file);
    put_frames(page->motion, file);
    PUT_PART(live_scene, file);
    (void)fwrite(page->scene.text, 1, page->scene.used, file);
    PUT_PART(live_engine, file);
    put_base64(&page->live->engine, file);
    PUT_PART(live_tail, file);
}

int kt_view_write(const kt_motion *motion, const kt_view *view, const char *path) {
    if (motion->count == 0)
        return KT_EXIT_DONE; /* there are no frames, and the reason was printed */
    kt_json_writer json = {0};
    view_page page = {.motion = motion, .json = &json, .live = view->live};
    kt_view_describe(&json, motion, view);
    if (view->live != NULL) {
        kt_put_open(&page.scene, NULL, '{');
        kt_put_text(&page.scene, "scene", view->live->scene.text);
        kt_put_integer(&page.scene, "engine_size", (long long)view->live->engine.used);
        kt_put_close(&page.scene, '}');
    }
    const int code = json.is_short || page.scene.is_short
                         ? kt_say_no_memory("the view")
                         : kt_output_write(path, view->live != NULL ? write_live_page : write_page, &page);
    free(json.text);
    free(page.scene.text);
    return code;
}

/* ---- the initial state ------------------------------------------------------------------------------------------- */

/* Takes the given state and the assembled one. q, v: memory for one state. *error: the result of the assembly. */
static int take_start(kt_motion *motion, const kt_model *model, kt_data *data, double *q, double *v, kt_error *error) {
    kt_model_initial(model, q, v);
    if (kt_motion_take_state(motion, 0.0, q, v) != 0)
        return -1;
    if (kt_state_assemble(model, data, 0.0, q, v, error) == KT_ERROR_CONSTRAINT)
        kt_assembly_reached(model, data, q);
    return kt_motion_take_state(motion, 1.0, q, v);
}

int kt_view_write_recorded(const kt_scene *scene, const kt_model *model, const kt_recorded *recorded, bool boxes,
                           const kt_view *view, const char *path) {
    kt_run run = scene->run;
    run.record = KT_RECORD_POSITION | KT_RECORD_VELOCITY;
    kt_columns columns;
    const size_t nq = (size_t)kt_model_nq(model), nv = (size_t)kt_model_nv(model);
    const bool has_columns = kt_columns_list(&columns, scene, model, &run, run.record);
    kt_motion *motion = has_columns ? kt_motion_start(scene, &columns, (int64_t)recorded->count, false) : NULL;
    int code = motion == NULL ? kt_say_no_memory("the view") : KT_EXIT_DONE;
    if (motion != NULL)
        motion->boxes = boxes;
    for (size_t i = 0; i < recorded->count && code == KT_EXIT_DONE; i++)
        if (kt_motion_take_state(motion, recorded->time[i], recorded->q + i * nq, recorded->v + i * nv) != 0)
            code = KT_EXIT_INTEGRATION;
    if (code == KT_EXIT_DONE)
        code = kt_view_write(motion, view, path);
    kt_motion_free(motion);
    kt_columns_free(&columns);
    return code;
}

int kt_view_write_start(const kt_scene *scene, const kt_model *model, const char *name, const char *path) {
    kt_error error = {0};
    kt_data *data = NULL;
    kt_run run = scene->run;
    run.record = KT_RECORD_POSITION;
    kt_columns columns;
    const bool has_columns = kt_columns_list(&columns, scene, model, &run, KT_RECORD_POSITION);
    const size_t nq = (size_t)kt_model_nq(model), nv = (size_t)kt_model_nv(model);
    double *q = calloc(nq + nv + 1, sizeof *q);
    kt_motion *motion = has_columns ? kt_motion_start(scene, &columns, 2, false) : NULL;
    int code = KT_EXIT_INTEGRATION;
    if (q == NULL || motion == NULL || kt_data_create(model, &data, &error) != KT_OK)
        kt_say("there is not enough memory for the view");
    else if (take_start(motion, model, data, q, q + nq, &error) == 0) {
        const kt_view view = {
            .name = name, .method = "initial state", .failed = error.code != KT_OK ? &error : NULL, .is_overlay = true};
        code = kt_view_write(motion, &view, path);
    }
    kt_data_free(data);
    kt_motion_free(motion);
    kt_columns_free(&columns);
    free(q);
    return code;
}
