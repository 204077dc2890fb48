/* The functions of an FMU of FMI 3.0. Event mode and early returns are not used: the FMU handles its events itself. */
#include "fmu/instance.h"

#include <stdlib.h>

#define GETTERS(id, name, type)                                                                                        \
    kt_fmi_status (*Get##name)(void *, const kt_fmi_reference *, size_t, type *, size_t);                              \
    kt_fmi_status (*Set##name)(void *, const kt_fmi_reference *, size_t, const type *, size_t);

/* Functions that every FMU for co-simulation has. */
#define FUNCTIONS(X)                                                                                                   \
    X(InstantiateCoSimulation, void *,                                                                                 \
      (const char *, const char *, const char *, bool, bool, bool, bool, const kt_fmi_reference *, size_t, void *,     \
       kt_fmi_log *, kt_fmi_update *))                                                                                 \
    X(EnterInitializationMode, kt_fmi_status, (void *, bool, double, double, bool, double))                            \
    X(DoStep, kt_fmi_status, (void *, double, double, bool, bool *, bool *, bool *, double *))
#define MEMBER(name, result, arguments) result(*name) arguments;

typedef struct functions {
    FUNCTIONS(MEMBER)
    KT_FMI_TYPE_LIST(GETTERS)
} functions;

static const functions *fmi3_functions_of(const kt_fmi_instance *f) { return f->functions; }

/* Functions of types that no variable has may be missing. */
static const char *load_fmi3(kt_fmi_instance *f) {
    functions *to = f->functions = calloc(1, sizeof *to);
    if (to == NULL)
        return "for want of memory";
#define LOAD(name, result, arguments)                                                                                  \
    if (!kt_find_symbol(f->library, "fmi3" #name, &to->name))                                                          \
        return "fmi3" #name;
    FUNCTIONS(LOAD)
#undef LOAD
#define LOAD(id, name, type)                                                                                           \
    (void)kt_find_symbol(f->library, "fmi3Get" #name, &to->Get##name);                                                 \
    (void)kt_find_symbol(f->library, "fmi3Set" #name, &to->Set##name);
    KT_FMI_TYPE_LIST(LOAD)
#undef LOAD
    return NULL;
}

static void take_fmi3_message(void *environment, kt_fmi_status status, const char *category, const char *message) {
    kt_fmi_note(environment, status, category, message);
}

static bool instantiate_fmi3(kt_fmi_instance *f) {
    const char *resources = f->resources[0] != '\0' ? f->resources : NULL;
    f->instance = fmi3_functions_of(f)->InstantiateCoSimulation(f->name, f->description.token, resources, false, false,
                                                                false, false, NULL, 0, f, take_fmi3_message, NULL);
    return f->instance != NULL;
}

static kt_fmi_status begin_fmi3(kt_fmi_instance *f, double start) {
    return fmi3_functions_of(f)->EnterInitializationMode(f->instance, false, 0.0, start, false, 0.0);
}

static kt_fmi_status set_fmi3(kt_fmi_instance *f, const kt_fmi_variable *variable, double value) {
    const functions *call = fmi3_functions_of(f);
    switch (variable->type) {
#define SET(id, name, type)                                                                                            \
    case id: {                                                                                                         \
        const type one = (type)value;                                                                                  \
        return call->Set##name != NULL ? call->Set##name(f->instance, &variable->reference, 1, &one, 1)                \
                                       : KT_FMI_ERROR;                                                                 \
    }
        KT_FMI_TYPE_LIST(SET)
#undef SET
    case KT_FMI_OTHER:
        break;
    }
    return KT_FMI_ERROR;
}

static kt_fmi_status get_fmi3(kt_fmi_instance *f, const kt_fmi_variable *variable, double *value) {
    const functions *call = fmi3_functions_of(f);
    switch (variable->type) {
#define GET(id, name, type)                                                                                            \
    case id: {                                                                                                         \
        type one = 0;                                                                                                  \
        const kt_fmi_status status =                                                                                   \
            call->Get##name != NULL ? call->Get##name(f->instance, &variable->reference, 1, &one, 1) : KT_FMI_ERROR;   \
        *value = (double)one;                                                                                          \
        return status;                                                                                                 \
    }
        KT_FMI_TYPE_LIST(GET)
#undef GET
    case KT_FMI_OTHER:
        break;
    }
    return KT_FMI_ERROR;
}

static kt_fmi_status step_fmi3(kt_fmi_instance *f, double from, double h, bool *terminates) {
    bool needs_event = false, early = false;
    double last = from;
    *terminates = false;
    const kt_fmi_status status =
        fmi3_functions_of(f)->DoStep(f->instance, from, h, true, &needs_event, terminates, &early, &last);
    if (kt_fmi_is_fine(status) && early && !*terminates) {
        kt_fmi_note(f, KT_FMI_ERROR, NULL, "the step returned early, which this importer does not allow");
        return KT_FMI_ERROR;
    }
    return status;
}

const kt_fmi_interface kt_fmi3_interface = {load_fmi3, instantiate_fmi3, begin_fmi3, set_fmi3, get_fmi3, step_fmi3};
