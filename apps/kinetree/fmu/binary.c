/* The common part of both versions of FMI: messages, statuses, functions of a binary, states (instance.h). */
#include "command.h"
#include "fmu/instance.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MESSAGES_MOST = 20 };

/* ---- messages ---------------------------------------------------------------------------------------------------- */

void kt_fmi_note(kt_fmi_instance *f, kt_fmi_status status, const char *category, const char *message) {
    if (status == KT_FMI_OK || message == NULL)
        return;
    (void)snprintf(f->message, sizeof f->message, "%s", message);
    for (size_t length = strlen(f->message); length > 0 && strchr(" \r\n", f->message[length - 1]) != NULL; length--)
        f->message[length - 1] = '\0';
    if (f->messages++ >= MESSAGES_MOST)
        return;
    kt_say("FMU '%s' at t = %.9g s: %s%s%s", f->name, f->time, kt_show(f->message).text,
           category != NULL && *category != '\0' ? ", category " : "",
           category != NULL && *category != '\0' ? kt_show(category).text : "");
    if (f->messages == MESSAGES_MOST)
        kt_say("FMU '%s': further messages are not printed", f->name);
}

kt_status kt_fmi_check(kt_fmi_instance *f, kt_fmi_status status, const char *function, kt_error *error) {
    static const char *const words[] = {"OK", "a warning", "discard", "an error", "a fatal error"};
    if (kt_fmi_is_fine(status))
        return KT_OK;
    f->worst = status > f->worst ? status : f->worst;
    return kt_error_set(error, KT_ERROR_CALLBACK, NULL, "FMU '%.60s' at t = %.9g s: %s returned %s%s%s", f->name,
                        f->time, function, (unsigned)status <= KT_FMI_FATAL ? words[status] : "an unknown status",
                        f->message[0] != '\0' ? ": " : "", f->message);
}

/* ---- functions -------------------------------------------------------------------------------------------------- */

typedef struct kt_fmi_symbol {
    const char *names[2]; /* in FMI 2.0 and 3.0; NULL: the version does not have it */
    size_t at;            /* in kt_fmi_functions */
    bool is_needed, is_of_state;
} kt_fmi_symbol;

#define SYMBOL(member, second, third, ...) {{second, third}, offsetof(kt_fmi_functions, member), __VA_ARGS__},
#define NEEDED(result, member, arguments, second, third) SYMBOL(member, second, third, true, false)
#define OF_STATE(result, member, arguments, second, third) SYMBOL(member, second, third, false, true)
#define OF_VALUE(result, member, arguments, second, third) SYMBOL(member, second, third, false, false)
#define OF_TYPE(id, name, type) KT_FMI_VALUE_LIST(OF_VALUE, name, type)
static const kt_fmi_symbol symbols[] = {KT_FMI_NEEDED_LIST(NEEDED) KT_FMI_STATE_LIST(OF_STATE)
                                            KT_FMI_TYPE_LIST(OF_TYPE)};

kt_status kt_fmi_find_functions(kt_fmi_instance *f, const char *file, kt_error *error) {
    const int version = f->description.version;
    for (size_t i = 0; i < sizeof symbols / sizeof symbols[0]; i++) {
        const kt_fmi_symbol *symbol = &symbols[i];
        char name[64];
        if (symbol->names[version - 2] == NULL)
            continue;
        (void)snprintf(name, sizeof name, "fmi%d%s", version, symbol->names[version - 2]);
        if (kt_find_symbol(f->library, name, (char *)&f->call + symbol->at))
            continue;
        if (symbol->is_needed)
            return kt_error_set(error, KT_ERROR_SCENE, NULL, "%.200s: its binary has no function %s", file, name);
        f->description.can_serialize = f->description.can_serialize && !symbol->is_of_state;
    }
    return KT_OK;
}

void kt_fmi_terminate(kt_fmi_instance *f) {
    if (f->instance != NULL && f->worst < KT_FMI_ERROR)
        f->worst = f->call.terminate(f->instance);
}

void kt_fmi_free_instance(kt_fmi_instance *f) {
    if (f->instance != NULL && f->worst != KT_FMI_FATAL)
        f->call.free_instance(f->instance);
    f->instance = NULL;
}

/* ---- states ------------------------------------------------------------------------------------------------------ */

static kt_status reject_state(const kt_fmi_instance *f, kt_error *error) {
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "FMU '%.60s'", f->name);
    return kt_error_set(error, KT_ERROR_UNSUPPORTED, where,
                        "its state cannot be saved (canSerializeFMUState): a run with it can neither write checkpoints "
                        "nor be resumed");
}

kt_status kt_fmi_save(kt_fmi_instance *f, unsigned char **bytes, size_t *size, kt_error *error) {
    const kt_fmi_functions *call = &f->call;
    void *state = NULL;
    *bytes = NULL;
    if (!f->description.can_serialize || f->worst == KT_FMI_FATAL)
        return reject_state(f, error);
    kt_status status = kt_fmi_check(f, call->get_state(f->instance, &state), "GetFMUState", error);
    if (status == KT_OK)
        status = kt_fmi_check(f, call->state_size(f->instance, state, size), "SerializedFMUStateSize", error);
    if (status == KT_OK && (*bytes = malloc(*size + 1)) == NULL)
        status = kt_reject_memory(error);
    if (status == KT_OK)
        status = kt_fmi_check(f, call->serialize(f->instance, state, *bytes, *size), "SerializeFMUState", error);
    if (state != NULL)
        (void)call->free_state(f->instance, &state);
    return status;
}

kt_status kt_fmi_restore(kt_fmi_instance *f, const unsigned char *bytes, size_t size, kt_error *error) {
    const kt_fmi_functions *call = &f->call;
    void *state = NULL;
    if (!f->description.can_serialize)
        return reject_state(f, error);
    kt_status status =
        kt_fmi_check(f, call->deserialize(f->instance, bytes, size, &state), "DeserializeFMUState", error);
    if (status == KT_OK)
        status = kt_fmi_check(f, call->set_state(f->instance, state), "SetFMUState", error);
    if (state != NULL)
        (void)call->free_state(f->instance, &state);
    return status;
}
