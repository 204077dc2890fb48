/* Draws a progress bar for runs that take more than a second. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/run.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

enum { BAR_WIDTH = 40 };

static double seconds_of(clockid_t clock) {
    struct timespec time;
    return clock_gettime(clock, &time) == 0 ? (double)time.tv_sec + 1e-9 * (double)time.tv_nsec : 0.0;
}

double kt_clock(void) { return seconds_of(CLOCK_MONOTONIC); }

double kt_cpu_clock(void) { return seconds_of(CLOCK_PROCESS_CPUTIME_ID); }

kt_progress kt_progress_start(bool quiet) {
    kt_progress progress = {0};
    progress.is_shown = !quiet && isatty(STDERR_FILENO);
    progress.has_utf8 = kt_speaks_utf8(STDERR_FILENO);
    progress.start = progress.last = kt_clock();
    return progress;
}

static bool is_time(const kt_progress *progress, double time) {
    return progress->is_shown && time - progress->start >= 1.0 && time - progress->last >= 0.1;
}

/* A line that is longer than this would not be replaced by the next one. */
static int terminal_columns(void) {
    struct winsize size;
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : INT_MAX;
}

void kt_progress_show(kt_progress *progress, double part, const char *words) {
    double time = kt_clock();
    if (!is_time(progress, time))
        return;
    progress->last = time;
    progress->is_drawn = true;
    part = part < 0.0 ? 0.0 : part > 1.0 ? 1.0 : part;
    double left = part > 0.0 ? (time - progress->start) * (1.0 - part) / part : 0.0;
    char text[160];
    snprintf(text, sizeof text, " %3.0f %%  %s, %.0f s left", 100.0 * part, words, left);
    const int most = terminal_columns() - 3, room = most - (int)strlen(text); /* two blanks, and one for the cursor */
    const int width = room < 0 ? 0 : room < BAR_WIDTH ? room : BAR_WIDTH;
    int filled = (int)(part * width);
    fputs("\r  ", stderr);
    for (int i = 0; i < width; i++)
        fputs(i < filled ? (progress->has_utf8 ? "\u2588" : "#") : (progress->has_utf8 ? "\u2591" : "."), stderr);
    fprintf(stderr, "%.*s\033[K", most > 0 ? most : 0, text);
    fflush(stderr);
}

void kt_progress_update(kt_progress *progress, double done, double whole) {
    char words[48];
    if (!(whole > 0.0) || !progress->is_shown)
        return;
    snprintf(words, sizeof words, "t = %.4g s", done);
    kt_progress_show(progress, done / whole, words);
}

void kt_progress_end(kt_progress *progress) {
    if (progress->is_drawn)
        fputs("\r\033[K", stderr);
    progress->is_drawn = false;
}
