/* The functions of an FMU of FMI 2.0. */
#include "fmu/instance.h"

#include "../fmu/fmi2.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

/* Functions that every FMU for co-simulation has. */
#define FUNCTIONS(X)                                                                                                   \
    X(Instantiate, void *,                                                                                             \
      (const char *, kt_fmi2_kind, const char *, const char *, const kt_fmi2_callbacks *, int, int))                   \
    X(SetupExperiment, kt_fmi_status, (void *, int, double, double, int, double))                                      \
    X(EnterInitializationMode, kt_fmi_status, (void *))                                                                \
    X(DoStep, kt_fmi_status, (void *, double, double, int))                                                            \
    X(GetBooleanStatus, kt_fmi_status, (void *, int, int *))                                                           \
    X(GetReal, kt_fmi_status, (void *, const kt_fmi_reference *, size_t, double *))                                    \
    X(SetReal, kt_fmi_status, (void *, const kt_fmi_reference *, size_t, const double *))                              \
    X(GetInteger, kt_fmi_status, (void *, const kt_fmi_reference *, size_t, int *))                                    \
    X(SetInteger, kt_fmi_status, (void *, const kt_fmi_reference *, size_t, const int *))                              \
    X(GetBoolean, kt_fmi_status, (void *, const kt_fmi_reference *, size_t, int *))                                    \
    X(SetBoolean, kt_fmi_status, (void *, const kt_fmi_reference *, size_t, const int *))
#define MEMBER(name, result, arguments) result(*name) arguments;

typedef struct functions {
    FUNCTIONS(MEMBER)
} functions;

static const functions *fmi2_functions_of(const kt_fmi_instance *f) { return f->functions; }

static const char *load_fmi2(kt_fmi_instance *f) {
    functions *to = f->functions = calloc(1, sizeof *to);
    if (to == NULL)
        return "for want of memory";
#define LOAD(name, result, arguments)                                                                                  \
    if (!kt_find_symbol(f->library, "fmi2" #name, &to->name))                                                          \
        return "fmi2" #name;
    FUNCTIONS(LOAD)
#undef LOAD
    return NULL;
}

/* The format is the FMU's. References such as #r12# to variables stay as they are. */
static void take_fmi2_message(void *environment, const char *name, kt_fmi_status status, const char *category,
                              const char *format, ...) KT_PRINTF(5, 6);

static void take_fmi2_message(void *environment, const char *name, kt_fmi_status status, const char *category,
                              const char *format, ...) {
    char message[KT_FMI_TEXT];
    va_list arguments;
    (void)name;
    if (format == NULL)
        return;
    va_start(arguments, format);
    (void)vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    kt_fmi_note(environment, status, category, message);
}

static bool instantiate_fmi2(kt_fmi_instance *f) {
    kt_fmi2_callbacks *callbacks = f->callbacks != NULL ? f->callbacks : malloc(sizeof *callbacks);
    if (callbacks == NULL)
        return false;
    *callbacks = (kt_fmi2_callbacks){.log = take_fmi2_message, .allocate = calloc, .release = free, .environment = f};
    f->callbacks = callbacks;
    f->instance = fmi2_functions_of(f)->Instantiate(f->name, KT_FMI2_SIMULATES, f->description.token, f->resources,
                                                    callbacks, 0, 0);
    return f->instance != NULL;
}

static kt_fmi_status begin_fmi2(kt_fmi_instance *f, double start) {
    const kt_fmi_status status = fmi2_functions_of(f)->SetupExperiment(f->instance, 0, 0.0, start, 0, 0.0);
    return kt_fmi_is_fine(status) ? fmi2_functions_of(f)->EnterInitializationMode(f->instance) : status;
}

static kt_fmi_status set_fmi2(kt_fmi_instance *f, const kt_fmi_variable *variable, double value) {
    const functions *call = fmi2_functions_of(f);
    const int whole = (int)value, truth = value != 0.0;
    if (variable->type == KT_FMI_FLOAT64)
        return call->SetReal(f->instance, &variable->reference, 1, &value);
    return variable->type == KT_FMI_BOOLEAN ? call->SetBoolean(f->instance, &variable->reference, 1, &truth)
                                            : call->SetInteger(f->instance, &variable->reference, 1, &whole);
}

static kt_fmi_status get_fmi2(kt_fmi_instance *f, const kt_fmi_variable *variable, double *value) {
    const functions *call = fmi2_functions_of(f);
    int whole = 0;
    if (variable->type == KT_FMI_FLOAT64)
        return call->GetReal(f->instance, &variable->reference, 1, value);
    const kt_fmi_status status = variable->type == KT_FMI_BOOLEAN
                                     ? call->GetBoolean(f->instance, &variable->reference, 1, &whole)
                                     : call->GetInteger(f->instance, &variable->reference, 1, &whole);
    *value = whole;
    return status;
}

/* A step that is discarded may end the simulation. */
static kt_fmi_status step_fmi2(kt_fmi_instance *f, double from, double h, bool *terminates) {
    int ended = 0;
    kt_fmi_status status = fmi2_functions_of(f)->DoStep(f->instance, from, h, 1);
    *terminates = false;
    if (status == KT_FMI_DISCARD &&
        kt_fmi_is_fine(fmi2_functions_of(f)->GetBooleanStatus(f->instance, KT_FMI2_TERMINATED, &ended)) && ended != 0) {
        *terminates = true;
        status = KT_FMI_OK;
    }
    return status;
}

const kt_fmi_interface kt_fmi2_interface = {load_fmi2, instantiate_fmi2, begin_fmi2, set_fmi2, get_fmi2, step_fmi2};
