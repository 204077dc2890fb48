/* The functions of an FMU of FMI 2.0. */
#include "fmu/instance.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

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
    f->callbacks = (kt_fmi2_callbacks){.log = take_fmi2_message, .allocate = calloc, .release = free, .environment = f};
    f->instance =
        f->call.instantiate2(f->name, KT_FMI2_SIMULATES, f->description.token, f->resources, &f->callbacks, 0, 0);
    return f->instance != NULL;
}

static kt_fmi_status begin_fmi2(kt_fmi_instance *f, double start) {
    const kt_fmi_status status = f->call.set_up(f->instance, 0, 0.0, start, 0, 0.0);
    return kt_fmi_is_fine(status) ? f->call.begin2(f->instance) : status;
}

static kt_fmi_status set_fmi2(kt_fmi_instance *f, const kt_fmi_variable *variable, double value) {
    const kt_fmi_functions *call = &f->call;
    const int whole = (int)value, truth = value != 0.0;
    if (variable->type == KT_FMI_FLOAT64)
        return call->SetReal(f->instance, &variable->reference, 1, &value);
    return variable->type == KT_FMI_BOOLEAN ? call->SetTruth(f->instance, &variable->reference, 1, &truth)
                                            : call->SetInteger(f->instance, &variable->reference, 1, &whole);
}

static kt_fmi_status get_fmi2(kt_fmi_instance *f, const kt_fmi_variable *variable, double *value) {
    const kt_fmi_functions *call = &f->call;
    int whole = 0;
    if (variable->type == KT_FMI_FLOAT64)
        return call->GetReal(f->instance, &variable->reference, 1, value);
    const kt_fmi_status status = variable->type == KT_FMI_BOOLEAN
                                     ? call->GetTruth(f->instance, &variable->reference, 1, &whole)
                                     : call->GetInteger(f->instance, &variable->reference, 1, &whole);
    *value = whole;
    return status;
}

/* A step that is discarded may end the simulation. */
static kt_fmi_status step_fmi2(kt_fmi_instance *f, double from, double h, bool *terminates) {
    int ended = 0;
    kt_fmi_status status = f->call.step2(f->instance, from, h, 1);
    *terminates = false;
    if (status == KT_FMI_DISCARD && kt_fmi_is_fine(f->call.get_truth_status(f->instance, KT_FMI2_TERMINATED, &ended)) &&
        ended != 0) {
        *terminates = true;
        status = KT_FMI_OK;
    }
    return status;
}

const kt_fmi_interface kt_fmi2_interface = {instantiate_fmi2, begin_fmi2, set_fmi2, get_fmi2, step_fmi2};
