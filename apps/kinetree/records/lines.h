/* Writes lines of text to a file. The lines are buffered for some milliseconds and then written. Only whole lines are
 * left in the file, even if this process is killed (SIGKILL). On a pipe or a terminal each line is written at once. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_RECORDS_LINES_H
#define KT_COMMAND_RECORDS_LINES_H

#include "text/bytes.h"

typedef struct kt_lines {
    int file; /* descriptor; -1: closed */
    const char *path;
    bool is_regular;   /* a regular file: lines are buffered */
    long long written; /* bytes in the file */
    long long before;  /* bytes of another program in standard output if it is a regular file */
    double last;       /* s, time of the last write (kt_clock) */
    kt_bytes buffer;   /* `whole` bytes of whole lines, then the line being built, unless it is short of memory */
    size_t whole;
    long long lost; /* lines that could not be written; kt_lines_close keeps the number */
} kt_lines;

/* Takes ownership of an open descriptor; standard output (1) is not closed at the end. `written`: bytes that the file
 * already contains. */
void kt_lines_start(kt_lines *lines, int file, const char *path, long long written);
/* Ends the current line, which is in the buffer, and writes the buffer if it is due. Returns 0, or -1 after printing
 * the error. */
int kt_lines_end(kt_lines *lines);
/* Writes the buffer. Returns 0, or -1 after printing the error. */
int kt_lines_flush(kt_lines *lines);
/* Writes the buffer and closes the file. Returns 0, or -1 after printing the error. */
int kt_lines_close(kt_lines *lines);

/* Writes all bytes, in several writes if necessary (as for pipes). *done: how many. Returns 0 or the errno. */
int kt_write_bytes(int file, const void *bytes, size_t size, size_t *done);

#endif
