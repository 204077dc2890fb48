/* The size of a picture on the command line. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "plot/plot.h"

#include <stdlib.h>

enum { LEAST = 300, MOST = 10000 };

/* Reads a number of at most five digits; the end of it, or NULL. */
static const char *read_extent(const char *text, int *extent) {
    char *end = NULL;
    const long number = *text >= '0' && *text <= '9' ? strtol(text, &end, 10) : -1;
    *extent = (int)(number < MOST + 1 ? number : MOST + 1);
    return end;
}

int kt_plot_size_read(const char *command, const char *text, kt_plot_size *size) {
    *size = (kt_plot_size){0, 0};
    if (text == NULL)
        return -1;
    const char *end = read_extent(text, &size->width);
    end = end != NULL && *end == 'x' ? read_extent(end + 1, &size->height) : NULL;
    if (end != NULL && *end == '\0' && size->width >= LEAST && size->width <= MOST && size->height >= LEAST &&
        size->height <= MOST)
        return -1;
    return kt_misuse("%s: --size takes WIDTHxHEIGHT from %d to %d, such as 1200x800, not '%s'", command, LEAST, MOST,
                     kt_show(text).text);
}
