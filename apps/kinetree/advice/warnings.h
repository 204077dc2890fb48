/* Warnings: facts that a result does not show and that its reader needs. Each is printed once on standard error, and
 * listed in the JSON summary under "warnings". */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_ADVICE_WARNINGS_H
#define KT_COMMAND_ADVICE_WARNINGS_H

#include "command.h"

#include <jansson.h>
#include <math.h>

/* All warnings given so far. A zero-initialised struct has none. */
typedef struct kt_warnings {
    bool quiet;       /* warnings are listed, but not printed */
    const char *path; /* warnings are printed as those of this file; NULL: of the command */
    json_t *list;     /* NULL: none */
} kt_warnings;

typedef struct kt_warning {
    const char *code;   /* for programs: "unstable_step" */
    double time;        /* s, when it was noticed; NaN: not related to a time */
    double value;       /* the number that the warning is about; NaN: none */
    const char *unit;   /* unit of the value: "J"; NULL: none */
    bool is_said;       /* the warning has been printed in other words and is only listed */
    const char *remedy; /* a sentence without its full stop: "Take steps below 0.01 s" */
} kt_warning;

static inline kt_warning kt_warning_at(const char *code, double time, double value, const char *unit,
                                       const char *remedy) {
    return (kt_warning){.code = code, .time = time, .value = value, .unit = unit, .remedy = remedy};
}

/* Returns a warning that is not related to a time. */
static inline kt_warning kt_warning_of(const char *code, double value, const char *unit, const char *remedy) {
    return kt_warning_at(code, (double)NAN, value, unit, remedy);
}

/* Prints "kinetree: warning: FACT. REMEDY", or "PATH: warning: FACT. REMEDY", and adds the warning to the list. The
 * format gives FACT, a sentence without its full stop. Texts are copied. */
void kt_warn(kt_warnings *warnings, const kt_warning *warning, const char *format, ...) KT_PRINTF(3, 4);

/* Returns whether a warning with this code was given. */
bool kt_warnings_have(const kt_warnings *warnings, const char *code);

/* Returns the list for a summary: [{"code", "what", "remedy", "time", "value", "unit"}, ...], a new reference. */
json_t *kt_warnings_describe(const kt_warnings *warnings);

/* Replaces the list by one that kt_warnings_describe has given. */
void kt_warnings_replace(kt_warnings *warnings, json_t *list);

void kt_warnings_free(kt_warnings *warnings);

#endif
