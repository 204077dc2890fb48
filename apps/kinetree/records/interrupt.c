/* The handler of SIGINT calls only functions that POSIX permits in handlers: open, read, write, unlink, raise. A second
 * Ctrl-C ends the program at once, also while the lines of a long file are counted. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/interrupt.h"

#include "command.h"

#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { PATH_SIZE = 4096, HEAD_SIZE = 400, ADVICE_SIZE = 800 };

/* Written before the handler is installed, except for the advice. */
static char partial[PATH_SIZE], unfinished[PATH_SIZE], head[HEAD_SIZE]; /* "": none */
static const char *unit;
static char advices[2][ADVICE_SIZE]; /* the one in use, and the one that is written next */
static _Atomic(const char *) advice;
static struct sigaction before;
static bool is_watching;

/* The message goes out in one piece, since other threads may be drawing a progress bar. */
static char said[HEAD_SIZE + ADVICE_SIZE + 64];
static size_t said_length;

static void interrupt_say(const char *words) {
    for (; *words != '\0' && said_length < sizeof said; words++)
        said[said_length++] = *words;
}

static void interrupt_write(void) {
    for (size_t from = 0; from < said_length;) {
        const ssize_t count = write(STDERR_FILENO, said + from, said_length - from);
        if (count <= 0)
            return;
        from += (size_t)count;
    }
}

/* Returns the number of whole lines behind the first one; -1: the file cannot be read. */
static long long count_lines(void) {
    char block[1 << 14];
    long long lines = -1;
    ssize_t count = -1;
    const int file = open(partial, O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
    while (file >= 0 && (count = read(file, block, sizeof block)) > 0)
        for (ssize_t i = 0; i < count; i++)
            lines += block[i] == '\n';
    if (file >= 0)
        (void)close(file);
    return count < 0 ? -1 : lines < 0 ? 0 : lines;
}

/* " holds 12 records." */
static void interrupt_say_count(long long count) {
    char digits[24];
    size_t at = sizeof digits - 1;
    digits[at] = '\0';
    for (long long rest = count; rest > 0 || at == sizeof digits - 1; rest /= 10)
        digits[--at] = (char)('0' + rest % 10);
    interrupt_say(" holds ");
    interrupt_say(digits + at);
    interrupt_say(" ");
    interrupt_say(unit);
    interrupt_say(count == 1 ? "." : "s.");
}

static void interrupt_report(void) {
    const long long lines = unit != NULL ? count_lines() : -1;
    interrupt_say(head);
    if (lines >= 0)
        interrupt_say_count(lines);
    else
        interrupt_say(" is left.");
    interrupt_say(" ");
    interrupt_say(atomic_load(&advice));
    interrupt_say("\n");
    interrupt_write();
}

static void end_by_interrupt(int number) {
    if (unfinished[0] != '\0')
        (void)unlink(unfinished);
    if (partial[0] != '\0')
        interrupt_report();
    (void)raise(number); /* SA_RESETHAND has restored the default, and SA_NODEFER does not block it */
}

static void take_path(char to[PATH_SIZE], const char *path) {
    const bool fits = path != NULL && strlen(path) < PATH_SIZE;
    (void)snprintf(to, PATH_SIZE, "%s", fits ? path : "");
}

void kt_interrupt_start(const char *path, const char *counted, const char *removed) {
    const struct sigaction action = {.sa_handler = end_by_interrupt, .sa_flags = (int)(SA_RESETHAND | SA_NODEFER)};
    take_path(partial, path);
    take_path(unfinished, removed);
    if ((partial[0] == '\0' && unfinished[0] == '\0') || sigaction(SIGINT, NULL, &before) != 0 ||
        before.sa_handler == SIG_IGN)
        return;
    (void)snprintf(head, sizeof head, "%skinetree: interrupted: %s", isatty(STDERR_FILENO) ? "\n" : "",
                   kt_show(partial).text);
    unit = counted;
    atomic_store(&advice, "");
    is_watching = sigaction(SIGINT, &action, NULL) == 0;
}

void kt_interrupt_advise(const char *format, ...) {
    char *next = atomic_load(&advice) == advices[0] ? advices[1] : advices[0];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(next, ADVICE_SIZE, format, arguments);
    va_end(arguments);
    atomic_store(&advice, next);
}

void kt_interrupt_end(void) {
    if (is_watching)
        (void)sigaction(SIGINT, &before, NULL);
    is_watching = false;
}
