/* Prints and lists warnings. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/warnings.h"

#include "text/json.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

void kt_warn(kt_warnings *warnings, const kt_warning *warning, const char *format, ...) {
    char what[640];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);
    if (!warnings->quiet && !warning->is_said && warnings->path != NULL)
        kt_print("%s: warning: %s. %s\n", warnings->path, what, warning->remedy);
    else if (!warnings->quiet && !warning->is_said)
        kt_say("warning: %s. %s", what, warning->remedy);
    if (warnings->list == NULL)
        warnings->list = json_array(); /* if memory is insufficient, writing the summary reports it */
    json_t *one = json_object();
    json_object_set_new(one, "code", json_string(warning->code));
    json_object_set_new(one, "what", json_string(what));
    json_object_set_new(one, "remedy", warning->remedy != NULL ? json_string(warning->remedy) : json_null());
    json_object_set_new(one, "time", kt_json_number(warning->time));
    json_object_set_new(one, "value", kt_json_number(warning->value));
    json_object_set_new(one, "unit", warning->unit != NULL ? json_string(warning->unit) : json_null());
    json_array_append_new(warnings->list, one);
}

bool kt_warnings_have(const kt_warnings *warnings, const char *code) {
    for (size_t i = 0; i < json_array_size(warnings->list); i++) {
        const char *given = json_string_value(json_object_get(json_array_get(warnings->list, i), "code"));
        if (given != NULL && strcmp(given, code) == 0)
            return true;
    }
    return false;
}

json_t *kt_warnings_describe(const kt_warnings *warnings) {
    return warnings->list != NULL ? json_incref(warnings->list) : json_array();
}

void kt_warnings_replace(kt_warnings *warnings, json_t *list) {
    json_decref(warnings->list);
    warnings->list = json_incref(list);
}

void kt_warnings_free(kt_warnings *warnings) {
    json_decref(warnings->list);
    warnings->list = NULL;
}
