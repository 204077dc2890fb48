/* Messages to the user, on standard error. Data are written to standard output. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"

#include "base/escape.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { LONGEST = 4096 }; /* bytes of a message; no list is longer */

/* All messages pass through here. The newlines at both ends of the format are the program's own. Those within the text
 * came with a name. A message is one write: messages of two processes do not mix, and nobody reads half of a line. */
KT_PRINTF(2, 0) static void print_once(const char *begin, const char *format, va_list arguments, const char *last) {
    char words[LONGEST], shown[LONGEST + 512];
    const size_t before = strspn(format, "\n");
    size_t after = strlen(format);
    while (after > before && format[after - 1] == '\n')
        after--;
    (void)vsnprintf(words, sizeof words, format, arguments);
    size_t end = strlen(words);
    for (size_t i = strlen(format) - after; i > 0 && end > before && words[end - 1] == '\n'; i--)
        end--;
    words[end] = '\0';
    (void)kt_text_escape(words + before, shown, sizeof shown);
    fprintf(stderr, "%s%.*s%s%s%s", begin, (int)before, format, shown, format + after, last);
}

void kt_print_all(const char *format, va_list arguments) { print_once("", format, arguments, ""); }

void kt_print(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    kt_print_all(format, arguments);
    va_end(arguments);
}

void kt_say(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    print_once("kinetree: ", format, arguments, "\n");
    va_end(arguments);
}

int kt_reject(int code, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    print_once("kinetree: ", format, arguments, "\n");
    va_end(arguments);
    return code;
}

int kt_say_no_memory(const char *what) {
    return kt_reject(KT_EXIT_INTEGRATION, "there is not enough memory%s%s", what != NULL ? " for " : "",
                     what != NULL ? what : "");
}

kt_shown kt_show_result(const char *path) { return kt_show(strcmp(path, "-") == 0 ? "standard output" : path); }

void kt_say_error(const kt_error *error) { kt_say("%s", kt_words_of(error).text); }

int kt_say_status(kt_status status, const kt_error *error) {
    if (status != KT_OK)
        kt_say_error(error);
    return kt_exit_code(status);
}

kt_question kt_ask(const kt_nearest *nearest, const char *before, const char *otherwise) {
    kt_question question;
    if (nearest->best != NULL)
        snprintf(question.text, sizeof question.text, "; did you mean '%s%s'?", before, nearest->best);
    else
        snprintf(question.text, sizeof question.text, "%s", otherwise);
    return question;
}

int kt_exit_code(kt_status status) {
    switch (status) {
    case KT_OK:
        return KT_EXIT_DONE;
    case KT_ERROR_ARGUMENT:
        return KT_EXIT_USAGE;
    case KT_ERROR_MODEL:
    case KT_ERROR_FILE:
    case KT_ERROR_SCENE:
    case KT_ERROR_UNSUPPORTED:
        return KT_EXIT_SCENE;
    case KT_ERROR_CONSTRAINT:
        return KT_EXIT_ASSEMBLY;
    case KT_ERROR_MEMORY:
    case KT_ERROR_SINGULAR:
    case KT_ERROR_NOT_FINITE:
    case KT_ERROR_STEP:
    case KT_ERROR_CALLBACK:
    case KT_ERROR_EFFECT:
        break;
    }
    return KT_EXIT_INTEGRATION;
}

const char *kt_exit_name(int code) {
    return code == KT_EXIT_DONE          ? "done"
           : code == KT_EXIT_ASSEMBLY    ? "assembly"
           : code == KT_EXIT_INTEGRATION ? "integration"
                                         : "scene";
}

int kt_finish_output(int code) {
    errno = 0;
    if (fflush(stdout) == 0 && !ferror(stdout))
        return code;
    kt_say("standard output cannot be written: %s", errno != 0 ? strerror(errno) : "an earlier write failed");
    return code == KT_EXIT_DONE ? KT_EXIT_INTEGRATION : code;
}

bool kt_speaks_utf8(int descriptor) {
    /* The first variable that is set and not empty decides, as for setlocale. The command does not call setlocale,
     * because numbers must be read and written with a decimal point. */
    static const char *const variables[] = {"LC_ALL", "LC_CTYPE", "LANG"};
    if (!isatty(descriptor))
        return false;
    for (size_t i = 0; i < sizeof variables / sizeof variables[0]; i++) {
        const char *value = getenv(variables[i]);
        if (value != NULL && *value != '\0')
            return strstr(value, "UTF-8") != NULL || strstr(value, "utf8") != NULL || strstr(value, "utf-8") != NULL;
    }
    return false;
}
