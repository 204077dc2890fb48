/* The common part of both versions of FMI: messages, statuses, functions of a binary, states (instance.h). */
#include "command.h"
#include "fmu/instance.h"

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
    if (f->is_quiet || f->messages++ >= MESSAGES_MOST)
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
    f->is_broken = f->is_broken || status == KT_FMI_FATAL;
    return kt_error_set(error, KT_ERROR_CALLBACK, NULL, "FMU '%.60s' at t = %.9g s: %s returned %s%s%s", f->name,
                        f->time, function, (unsigned)status <= KT_FMI_FATAL ? words[status] : "an unknown status",
                        f->message[0] != '\0' ? ": " : "", f->message);
}

/* ---- functions -------------------------------------------------------------------------------------------------- */

const char *kt_fmi_find_common(kt_fmi_instance *f) {
    const bool is_second = f->description.version == 2;
    bool found = true;
#define FIND(member, result, arguments, second, third)                                                                 \
    kt_find_symbol(f->library, is_second ? "fmi2" second : "fmi3" third, &f->common.member)
#define NEED(member, result, arguments, second, third)                                                                 \
    if (!FIND(member, result, arguments, second, third))                                                               \
        return is_second ? "fmi2" second : "fmi3" third;
#define FIND_STATE(member, result, arguments, second, third)                                                           \
    found = FIND(member, result, arguments, second, third) && found;
    KT_FMI_COMMON_LIST(NEED)
    KT_FMI_STATE_LIST(FIND_STATE)
#undef FIND_STATE
#undef NEED
#undef FIND
    f->description.can_serialize = f->description.can_serialize && found;
    return NULL;
}

void kt_fmi_free_instance(kt_fmi_instance *f) {
    if (f->instance != NULL && !f->is_broken)
        f->common.free_instance(f->instance);
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
    const kt_fmi_common *call = &f->common;
    void *state = NULL;
    *bytes = NULL;
    if (!f->description.can_serialize || f->is_broken)
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
    const kt_fmi_common *call = &f->common;
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
