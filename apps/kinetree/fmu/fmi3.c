/* The functions of an FMU of FMI 3.0. Event mode and early returns are not used: the FMU handles its events itself. */
#include "fmu/instance.h"

static void take_fmi3_message(void *environment, kt_fmi_status status, const char *category, const char *message) {
    kt_fmi_note(environment, status, category, message);
}

static bool instantiate_fmi3(kt_fmi_instance *f) {
    const char *resources = f->resources[0] != '\0' ? f->resources : NULL;
    f->instance = f->call.instantiate3(f->name, f->description.token, resources, false, false, false, false, NULL, 0, f,
                                       take_fmi3_message, NULL);
    return f->instance != NULL;
}

static kt_fmi_status begin_fmi3(kt_fmi_instance *f, double start) {
    return f->call.begin3(f->instance, false, 0.0, start, false, 0.0);
}

static kt_fmi_status set_fmi3(kt_fmi_instance *f, const kt_fmi_variable *variable, double value) {
    const kt_fmi_functions *call = &f->call;
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
    const kt_fmi_functions *call = &f->call;
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
    const kt_fmi_status status = f->call.step3(f->instance, from, h, true, &needs_event, terminates, &early, &last);
    if (kt_fmi_is_fine(status) && early && !*terminates) {
        kt_fmi_note(f, KT_FMI_ERROR, NULL, "the step returned early, which this importer does not allow");
        return KT_FMI_ERROR;
    }
    return status;
}

const kt_fmi_interface kt_fmi3_interface = {instantiate_fmi3, begin_fmi3, set_fmi3, get_fmi3, step_fmi3};
