/* Reports of faults in a description. Each report names the fault and the item. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/check.h"
#include "model/function.h"

#include <stdarg.h>
#include <stdio.h>

kt_checker kt_checker_make(const kt_description *description, kt_report *report, void *user) {
    return (kt_checker){.description = description, .report = report, .user = user};
}

kt_status kt_checker_result(const kt_checker *checker, kt_error *error) {
    if (checker->first.code != KT_OK && error != NULL)
        *error = checker->first;
    return checker->first.code;
}

bool kt_checker_is_done(const kt_checker *checker) { return checker->report == NULL && checker->first.code != KT_OK; }

int kt_checker_marker_count(const kt_body *body) {
    return body->markers == NULL || body->marker_count < 0 ? 0 : body->marker_count;
}

enum { ITEMS = KT_ITEM_STATE + 1 };

/* Writes the item that is checked: "body 'rod'", or "bodies[3]" if it has no name. */
static void write_where(const kt_checker *checker, char where[KT_WHERE_SIZE]) {
    static const char *const kinds[ITEMS] = {"scene", "body", "loop", "effect", "hold", "state"};
    static const char *const lists[ITEMS] = {"scene", "bodies", "loops", "effects", "hold", "states"};
    const kt_description *d = checker->description;
    const char *name = NULL;
    if (checker->item == KT_ITEM_BODY)
        name = d->bodies[checker->index].name;
    else if (checker->item == KT_ITEM_LOOP)
        name = d->loops[checker->index].name;
    else if (checker->item == KT_ITEM_EFFECT)
        name = d->effects[checker->index].name;
    else if (checker->item == KT_ITEM_STATE)
        name = d->states[checker->index].name;
    if (checker->item == KT_ITEM_SCENE)
        snprintf(where, KT_WHERE_SIZE, "scene");
    else if (name == NULL || *name == '\0')
        snprintf(where, KT_WHERE_SIZE, "%s[%d]", lists[checker->item], checker->index);
    else
        snprintf(where, KT_WHERE_SIZE, "%s %s", kinds[checker->item], kt_name_quote(name).text);
}

void kt_checker_fault(kt_checker *checker, const char *field, int sub, const char *format, ...) {
    if (kt_checker_is_done(checker))
        return;
    char where[KT_WHERE_SIZE], message[2 * KT_MESSAGE_SIZE]; /* kt_error_set shortens long texts, and marks the cut */
    write_where(checker, where);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);

    kt_error error;
    (void)kt_error_set(&error, KT_ERROR_MODEL, where, "%s", message);
    if (checker->first.code == KT_OK)
        checker->first = error;
    if (checker->report != NULL) {
        const kt_place place = {checker->item, checker->index, sub, field};
        checker->report(checker->user, &place, &error);
    }
}
