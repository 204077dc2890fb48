/* The size of a picture on the command line. */
#include "command.h"
#include "plot/plot.h"

#include <stdio.h>

enum { LEAST = 300, MOST = 10000 };

int kt_plot_size_read(const char *command, const char *text, kt_plot_size *size) {
    int end = 0;
    *size = (kt_plot_size){0, 0};
    if (text == NULL)
        return -1;
    const int read = sscanf(text, "%5dx%5d%n", &size->width, &size->height, &end);
    if (read == 2 && text[end] == '\0' && size->width >= LEAST && size->width <= MOST && size->height >= LEAST &&
        size->height <= MOST)
        return -1;
    kt_say("%s: --size takes WIDTHxHEIGHT from %d to %d, such as 1200x800, not '%s'", command, LEAST, MOST,
           kt_show(text).text);
    return KT_EXIT_USAGE;
}
