/* Words to the user. Data go to standard output, words to standard error. */
#include "command.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

void kt_say(const char *format, ...) {
    va_list arguments;
    fputs("kinetree: ", stderr);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
}

void kt_say_error(const kt_error *error) {
    const char *message = error->message[0] != '\0' ? error->message : kt_status_text(error->code);
    if (error->where[0] != '\0')
        kt_say("%s: %s", error->where, message);
    else
        kt_say("%s", message);
}

kt_question kt_ask(const kt_nearest *nearest, const char *before) {
    kt_question question = {""};
    if (nearest->best != NULL)
        snprintf(question.text, sizeof question.text, "; did you mean '%s%s'?", before, nearest->best);
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

int kt_finish_output(int code) {
    errno = 0;
    if (fflush(stdout) == 0 && !ferror(stdout))
        return code;
    kt_say("standard output cannot be written: %s", errno != 0 ? strerror(errno) : "an earlier write failed");
    return code == KT_EXIT_DONE ? KT_EXIT_INTEGRATION : code;
}

bool kt_speaks_utf8(int descriptor) {
    /* The first that is set and not empty decides, as for setlocale; that itself is not called, for numbers must be
     * read and written with a point. */
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
