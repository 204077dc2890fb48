/* Reading in tests: scenes from text, and the reported faults. */
#ifndef KT_TEST_SCENE_COLLECT_H
#define KT_TEST_SCENE_COLLECT_H

#include "kinetree/scene.h"

#include <stdbool.h>
#include <stddef.h>

#include "check.h"

/* All faults of a reading, "LINE:COLUMN: MESSAGE" and a line end each. Faults that do not fit are only counted. */
typedef struct kt_collected {
    char path[256]; /* the required beginning of every `where` */
    int count;
    int strange; /* faults whose `where` is not PATH:LINE:COLUMN, that come out of order, or that are cut */
    unsigned line, column;
    kt_error first, last;
    size_t length;
    char text[1 << 16];
} kt_collected;

void kt_collect(void *user, const kt_error *fault);

/* Reads text. */
kt_status kt_collect_parse(kt_collected *faults, const char *text, kt_scene *scene);

/* Reads text that must be right: returns whether it is, and shows the faults where it is not. */
bool kt_parse_right(const char *text, kt_scene *scene);

/* Equal in every byte. */
bool kt_same_bytes(const void *a, const void *b, size_t size);

/* Writes into memory that the caller frees; NULL after showing why not. */
char *kt_write_text(const kt_scene *scene);

/* Checks that a scene cannot be written, with this part of the message, and that nothing is. */
void kt_check_unwritable(const char *what, const kt_scene *scene, kt_status expected, const char *part);

/* Whether a call has succeeded, after a check that shows why not. */
static inline bool fine(const char *what, kt_status status, const kt_error *error) {
    if (status != KT_OK)
        kt_note("%s: %s", error->where, error->message);
    return status == KT_OK || kt_check_true(what, false);
}

#endif
