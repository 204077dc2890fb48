/* Lines of text on their way into a file: gathered for some milliseconds, then written so that whatever ends this
 * process, SIGKILL too, leaves whole lines. A pipe or a terminal gets each line at once. */
#ifndef KT_COMMAND_LINES_H
#define KT_COMMAND_LINES_H

#include <stdbool.h>
#include <stddef.h>

typedef struct kt_lines {
    int file; /* descriptor; -1: closed */
    const char *path;
    bool is_regular;   /* a file: lines are gathered */
    long long written; /* bytes in the file */
    double last;       /* s, when they were written */
    char *text;        /* not yet written: `whole` bytes of whole lines, then the one under way */
    size_t whole, used, room;
    bool full; /* no memory for the line */
} kt_lines;

/* Takes over an open descriptor; the standard output (1) stays open at the end. `written`: bytes that stand in the
 * file. */
void kt_lines_start(kt_lines *lines, int file, const char *path, long long written);
/* Room for so many bytes more at text + used, or false: then the line will not be written. */
bool kt_lines_make_room(kt_lines *lines, size_t more);
/* Ends the line under way, and writes where it is time. Returns 0, or -1 where that failed, which has been said. */
int kt_lines_end(kt_lines *lines);
/* Writes what was gathered. Returns 0, or -1 where that failed, which has been said. */
int kt_lines_flush(kt_lines *lines);
/* Writes what was gathered and closes. Returns 0, or -1 where that failed, which has been said. */
int kt_lines_close(kt_lines *lines);

#endif
