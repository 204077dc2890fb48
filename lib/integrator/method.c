/* The list of built-in methods, and queries about any method. */
#include "integrator/integrator.h"

#include <stdio.h>
#include <string.h>

static const kt_method *const methods[] = {
#define KT_METHOD_ADDRESS(name) &kt_method_##name,
    KT_METHOD_LIST(KT_METHOD_ADDRESS)
#undef KT_METHOD_ADDRESS
};

enum { COUNT = sizeof methods / sizeof *methods };

int kt_method_count(void) { return COUNT; }

const kt_method *kt_method_at(int index) { return index >= 0 && index < COUNT ? methods[index] : NULL; }

const kt_method *kt_method_find(const char *name) {
    for (int i = 0; name != NULL && i < COUNT; i++)
        if (strcmp(methods[i]->name, name) == 0)
            return methods[i];
    return NULL;
}

bool kt_method_is_built_in(const kt_method *method) {
    for (int i = 0; i < COUNT; i++)
        if (methods[i] == method)
            return true;
    return false;
}

const kt_method_family *kt_method_family_of(const kt_method *method) {
    return method->family != NULL ? method->family : &kt_family_explicit;
}

const char *kt_method_family_name(const kt_method *method) { return kt_method_family_of(method)->name; }

bool kt_method_is_adaptive(const kt_method *method) { return method->embedded_order > 0; }

bool kt_method_stages_vary(const kt_method *method) { return kt_method_family_of(method)->stages_max > 0; }

size_t kt_method_names(bool adaptive, char *text, size_t size) {
    size_t length = 0;
    if (size > 0)
        text[0] = '\0';
    for (int i = 0; i < COUNT; i++) {
        const size_t at = length < size ? length : size;
        if (!adaptive || kt_method_is_adaptive(methods[i]))
            length += (size_t)snprintf(text + at, size - at, "%s%s", length > 0 ? ", " : "", methods[i]->name);
    }
    return length;
}

kt_status kt_method_check_sizes(const kt_method *method, kt_error *error) {
    if (method == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "method", "no method is given; kt_method_find has some by name");
    return kt_method_family_of(method)->check_sizes(method, error);
}

/* The cubic through both states and slopes is exact to theta^3, but its order is at most that of the states it joins.
 */
int kt_method_dense_order(const kt_method *method) {
    if (method->dense_order > 0)
        return method->dense_order;
    return method->order < 3 ? method->order : 3;
}
