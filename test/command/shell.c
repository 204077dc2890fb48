/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "shell.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static char folder[] = "/tmp/kinetree-command-XXXXXX";

static void remove_folder(void) {
    char command[64];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    if (system(command) != 0)
        fprintf(stderr, "%s is left\n", folder);
}

static void make_folder(void) {
    if (mkdtemp(folder) == NULL || chdir(folder) != 0 || setenv("K", KT_COMMAND, 1) != 0) {
        perror(folder);
        exit(1);
    }
    unsetenv("KINETREE_SCENES");
    setenv("LSAN_OPTIONS", "print_suppressions=0:suppressions=" KT_SUPPRESSIONS, 1);
    atexit(remove_folder);
}

__attribute__((constructor)) static void ask_for_a_folder(void) { kt_test_before(make_folder); }

/* ---- files ------------------------------------------------------------------------------------------------------- */

void kt_write_file(const char *name, const char *text) {
    FILE *file = fopen(name, "w");
    if (file == NULL || fputs(text, file) < 0 || fclose(file) != 0)
        kt_check_true(name, false);
}

/* Terminated; the caller frees it. NULL: there is no such file. */
static char *read_all(const char *name) {
    FILE *file = fopen(name, "r");
    char *text = NULL;
    size_t used = 0, count;
    if (file == NULL)
        return NULL;
    do {
        text = realloc(text, used + 65537);
        count = fread(text + used, 1, 65536, file);
        used += count;
    } while (count > 0);
    fclose(file);
    text[used] = '\0';
    return text;
}

const char *kt_read_file(const char *name) {
    static char *text;
    free(text);
    text = read_all(name);
    return text;
}

/* Some versions of cairo write a colour into a style, and others into an attribute of its own. */
double kt_page_lightness(const char *svg) {
    const char *defined = svg == NULL ? NULL : strstr(svg, "</defs>"); /* colours of gradients come before the page's */
    const char *colour = svg == NULL ? NULL : strchr(defined != NULL ? defined : svg, '#');
    unsigned part[3];
    if (colour == NULL || sscanf(colour, "#%2x%2x%2x", &part[0], &part[1], &part[2]) != 3)
        return (double)NAN;
    return (part[0] + part[1] + part[2]) / (3.0 * 255.0);
}

/* ---- running ----------------------------------------------------------------------------------------------------- */

static int exit_code(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status); }

static kt_ran run(const char *format, va_list arguments) __attribute__((format(printf, 1, 0)));

static kt_ran run(const char *format, va_list arguments) {
    static char *out, *err;
    char command[4096];
    int length = snprintf(command, sizeof command, "exec >.out 2>.err; ");
    vsnprintf(command + length, sizeof command - (size_t)length, format, arguments);
    int status = system(command);
    free(out);
    free(err);
    out = read_all(".out");
    err = read_all(".err");
    kt_ran ran = {exit_code(status), out, err};
    return ran;
}

kt_ran kt_shell(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    kt_ran ran = run(format, arguments);
    va_end(arguments);
    return ran;
}

void kt_expect(int code, const char *message, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    kt_ran ran = run(format, arguments);
    va_end(arguments);
    kt_check_equal_int(format, ran.code, code);
    if (message != NULL)
        kt_check_contains("standard error", ran.err, message);
    else
        kt_check_text("standard error", ran.err, "");
}

kt_ran kt_terminal(const char *format, ...) {
    static char text[1 << 16];
    char command[4096];
    size_t used = 0;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(command, sizeof command, format, arguments);
    va_end(arguments);
    int master = posix_openpt(O_RDWR | O_NOCTTY);
    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0) {
        kt_check_true("a terminal is to be had", false);
        return (kt_ran){-1, "", ""};
    }
    pid_t child = fork();
    if (child == 0) {
        int slave = open(ptsname(master), O_RDWR);
        dup2(slave, STDOUT_FILENO);
        dup2(slave, STDERR_FILENO);
        setenv("LC_ALL", "C.UTF-8", 1);
        execl("/bin/sh", "sh", "-c", command, (char *)NULL);
        _exit(127);
    }
    int status = 0;
    bool is_running = true;
    for (;;) {
        if (used + 1 == sizeof text) { /* of a longer text, the end */
            used = sizeof text / 2;
            memmove(text, text + sizeof text - 1 - used, used);
        }
        ssize_t count = read(master, text + used, sizeof text - 1 - used);
        if (count > 0)
            used += (size_t)count;
        else if (count < 0 && errno == EIO) { /* no one has the other side open: not yet, or no more */
            if (!is_running)
                break;
            is_running = waitpid(child, &status, WNOHANG) == 0;
            nanosleep(&(struct timespec){0, 1000000}, NULL);
        }
    }
    if (is_running)
        waitpid(child, &status, 0);
    close(master);
    text[used] = '\0';
    return (kt_ran){exit_code(status), text, ""};
}

/* ---- what was read ----------------------------------------------------------------------------------------------- */

int kt_count_of(const char *text, const char *part) {
    int found = 0;
    for (const char *at = strstr(text, part); at != NULL; at = strstr(at + 1, part))
        found++;
    return found;
}

int kt_count_lines(const char *text) {
    int count = 0;
    for (const char *c = text; *c != '\0'; c++)
        count += *c == '\n';
    return count;
}

static const char *find_line(const char *text, int line) {
    for (; line > 0 && text != NULL; line--) {
        text = strchr(text, '\n');
        text = text != NULL ? text + 1 : NULL;
    }
    return text;
}

double kt_csv_number(const char *text, int line, int column) {
    const char *at = find_line(text, line);
    for (; column > 0 && at != NULL; column--) {
        at += strcspn(at, ",\n");
        at = *at == ',' ? at + 1 : NULL;
    }
    return at != NULL && *at != '\0' ? strtod(at, NULL) : (double)NAN;
}

int kt_csv_column(const char *text, const char *name) {
    size_t length = strlen(name);
    for (int column = 0;; column++) {
        size_t cell = strcspn(text, ",\n");
        if (cell == length && memcmp(text, name, length) == 0)
            return column;
        if (text[cell] != ',')
            return -1;
        text += cell + 1;
    }
}

json_t *kt_json(const char *text) {
    json_error_t error;
    json_t *root = json_loads(text, JSON_REJECT_DUPLICATES, &error);
    if (root == NULL) {
        kt_note("line %d: %s", error.line, error.text);
        kt_check_true("JSON", false);
    }
    return root;
}

const json_t *kt_json_find(const json_t *root, const char *path) {
    char name[128];
    const char *separators = strchr(path, '/') != NULL ? "/[" : ".[";
    const json_t *at = root;
    while (*path != '\0' && at != NULL) {
        if (*path == '[') {
            at = json_array_get(at, (size_t)strtol(path + 1, NULL, 10));
            path = strchr(path, ']') + 1;
        } else {
            size_t length = strcspn(path, separators);
            snprintf(name, sizeof name, "%.*s", (int)length, path);
            at = json_object_get(at, name);
            path += length;
        }
        if (*path == separators[0])
            path++;
    }
    return at;
}

double kt_json_at(const json_t *root, const char *path) {
    const json_t *at = kt_json_find(root, path);
    return json_is_number(at) ? json_number_value(at) : (double)NAN;
}
