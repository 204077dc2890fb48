/* The list of built-in methods. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

#include <stdio.h>

static const kt_method *const methods[] = {
#define KT_METHOD_ADDRESS(name) &kt_method_##name,
    KT_METHOD_LIST(KT_METHOD_ADDRESS)
#undef KT_METHOD_ADDRESS
};

enum { COUNT = sizeof methods / sizeof *methods };

int kt_method_count(void) { return COUNT; }

const kt_method *kt_method_at(int index) { return index >= 0 && index < COUNT ? methods[index] : NULL; }

/* Whether two names are equal, with `_` equal to `-`. */
static bool names_are_equal(const char *a, const char *b) {
    while (*a != '\0' && (*a == *b || (*a == '-' && *b == '_'))) {
        a++;
        b++;
    }
    return *a == *b;
}

const kt_method *kt_method_find(const char *name) {
    for (int i = 0; name != NULL && i < COUNT; i++)
        if (names_are_equal(methods[i]->name, name))
            return methods[i];
    return NULL;
}

bool kt_method_is_built_in(const kt_method *method) {
    for (int i = 0; i < COUNT; i++)
        if (methods[i] == method)
            return true;
    return method == &kt_method_moreau_jean;
}

size_t kt_method_names(bool adaptive, char *text, size_t size) {
    char none[1];
    size_t length = 0;
    size = text != NULL ? size : 0;
    text = text != NULL ? text : none;
    if (size > 0)
        text[0] = '\0';
    for (int i = 0; i < COUNT; i++) {
        const size_t at = length < size ? length : size;
        if (!adaptive || kt_method_is_adaptive(methods[i]))
            length += (size_t)snprintf(text + at, size - at, "%s%s", length > 0 ? ", " : "", methods[i]->name);
    }
    return length;
}
