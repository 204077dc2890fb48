/* The list of built-in methods. */
#include "integrator/integrator.h"

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

/* The cubic through both states and slopes is exact to theta^3, and no better than the states it joins. */
int kt_method_dense_order(const kt_method *method) {
    if (method->dense_order > 0)
        return method->dense_order;
    return method->order < 3 ? method->order : 3;
}
