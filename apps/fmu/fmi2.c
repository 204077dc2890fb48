/* The C interface of FMI 2.0 (fmi-standard.org), on top of that of FMI 3.0. Names, values and orders are those of the
 * standard. Truth values are int, and modes, references, states and times are those of FMI 3.0.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "fmi2.h"
#include "instance.h"

#include <stdlib.h>
#include <string.h>

typedef struct kt_fmi2_event_info {
    int needs_update, terminate, nominals_changed, values_changed, has_next;
    double next;
} kt_fmi2_event_info;

/* The environment of the instance of FMI 3.0. */
typedef struct kt_fmi2_side {
    kt_fmi2_log *log;
    void *environment;
    char name[];
} kt_fmi2_side;

static void pass_message(void *environment, kt_fmi_status status, const char *category, const char *message) {
    const kt_fmi2_side *side = environment;
    side->log(side->environment, side->name, status, category, "%s", message);
}

/* ---- instances --------------------------------------------------------------------------------------------------- */

static int digit_of(char c) {
    static const char digits[] = "0123456789abcdef0123456789ABCDEF";
    const char *at = c != '\0' ? strchr(digits, c) : NULL;
    return at != NULL ? (int)((at - digits) % 16) : -1;
}

/* Writes the path of a URI "file:///path" or "file:/path" without its escapes; a plain path stays. */
static void write_uri_path(const char *uri, char *path) {
    if (strncmp(uri, "file:", 5) == 0) {
        uri += 5;
        if (strncmp(uri, "//", 2) == 0) /* then a host, which is empty or this one, up to the next slash */
            uri += 2 + strcspn(uri + 2, "/");
        for (; *uri != '\0'; uri++) {
            const int high = *uri == '%' ? digit_of(uri[1]) : -1, low = high >= 0 ? digit_of(uri[2]) : -1;
            *path++ = low >= 0 ? (char)(16 * high + low) : *uri;
            uri += low >= 0 ? 2 : 0;
        }
        *path = '\0';
    } else {
        memcpy(path, uri, strlen(uri) + 1);
    }
}

KT_FMI(const char *fmi2GetTypesPlatform(void)) { return "default"; }

KT_FMI(const char *fmi2GetVersion(void)) { return "2.0"; }

KT_FMI(void *fmi2Instantiate(const char *name, kt_fmi2_kind kind, const char *token, const char *resources,
                             const kt_fmi2_callbacks *callbacks, int visible, int logging)) {
    const char *shown = name != NULL ? name : "";
    const char *uri = resources != NULL ? resources : "";
    kt_fmi2_side *side = malloc(sizeof *side + strlen(shown) + 1);
    char *path = malloc(strlen(uri) + 1);
    void *instance = NULL;
    if (side != NULL && path != NULL) {
        *side = (kt_fmi2_side){callbacks != NULL ? callbacks->log : NULL,
                               callbacks != NULL ? callbacks->environment : NULL};
        memcpy(side->name, shown, strlen(shown) + 1);
        write_uri_path(uri, path);
        kt_fmi_log *log = side->log != NULL ? pass_message : NULL;
        instance = kind == KT_FMI2_SIMULATES
                       ? fmi3InstantiateCoSimulation(shown, token, path, visible != 0, logging != 0, false, false, NULL,
                                                     0, side, log, NULL)
                       : fmi3InstantiateModelExchange(shown, token, path, visible != 0, logging != 0, side, log);
    }
    free(path);
    if (instance == NULL)
        free(side);
    return instance;
}

KT_FMI(void fmi2FreeInstance(void *instance)) {
    kt_fmi2_side *side = instance != NULL ? ((kt_fmu *)instance)->environment : NULL;
    fmi3FreeInstance(instance);
    free(side);
}

KT_FMI(kt_fmi_status fmi2SetDebugLogging(void *instance, int logging, size_t count, const char *const *names)) {
    return fmi3SetDebugLogging(instance, logging != 0, count, names);
}

/* ---- phases ------------------------------------------------------------------------------------------------------ */

KT_FMI(kt_fmi_status fmi2SetupExperiment(void *instance, int has_tolerance, double tolerance, double start,
                                         int has_stop, double stop)) {
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    KT_FMU_TAKE(instance);
    return kt_fmu_set_start(fmu, start);
}

KT_FMI(kt_fmi_status fmi2EnterInitializationMode(void *instance)) {
    KT_FMU_TAKE(instance);
    return fmi3EnterInitializationMode(fmu, false, 0.0, fmu->start, false, 0.0);
}

KT_FMI(kt_fmi_status fmi2NewDiscreteStates(void *instance, kt_fmi2_event_info *info)) {
    KT_FMU_TAKE(instance);
    bool needs_update, terminate, nominals_changed, values_changed, has_next;
    const kt_fmi_status status = fmi3UpdateDiscreteStates(fmu, &needs_update, &terminate, &nominals_changed,
                                                          &values_changed, &has_next, &info->next);
    info->needs_update = needs_update;
    info->terminate = terminate;
    info->nominals_changed = nominals_changed;
    info->values_changed = values_changed;
    info->has_next = has_next;
    return status;
}

KT_FMI(kt_fmi_status fmi2CompletedIntegratorStep(void *instance, int is_final, int *enter_event, int *terminate)) {
    KT_FMU_TAKE(instance);
    bool enters, terminates;
    const kt_fmi_status status = fmi3CompletedIntegratorStep(fmu, is_final != 0, &enters, &terminates);
    *enter_event = enters;
    *terminate = terminates;
    return status;
}

/* A run that an event of the scene ends within a step discards the rest of this step. */
KT_FMI(kt_fmi_status fmi2DoStep(void *instance, double from, double step, int is_final)) {
    bool needs_event, terminate, early;
    double last;
    const kt_fmi_status status =
        fmi3DoStep(instance, from, step, is_final != 0, &needs_event, &terminate, &early, &last);
    return status == KT_FMI_OK && terminate ? KT_FMI_DISCARD : status;
}

/* ---- variables --------------------------------------------------------------------------------------------------- */

KT_FMI(kt_fmi_status fmi2GetReal(void *instance, const kt_fmi_reference *references, size_t count, double *values)) {
    return fmi3GetFloat64(instance, references, count, values, count);
}

KT_FMI(kt_fmi_status fmi2SetReal(void *instance, const kt_fmi_reference *references, size_t count,
                                 const double *values)) {
    return fmi3SetFloat64(instance, references, count, values, count);
}

KT_FMI(kt_fmi_status fmi2GetDirectionalDerivative(void *instance, const kt_fmi_reference *unknowns,
                                                  size_t unknown_count, const kt_fmi_reference *knowns,
                                                  size_t known_count, const double *seed, double *sensitivity)) {
    return fmi3GetDirectionalDerivative(instance, unknowns, unknown_count, knowns, known_count, seed, known_count,
                                        sensitivity, unknown_count);
}

/* ---- other names ------------------------------------------------------------------------------------------------- */

/* Functions that differ by their names alone: the other name, the arguments and their names. */
#define KT_FMI2_CALL(name, of, arguments, names)                                                                       \
    KT_FMI(kt_fmi_status fmi2##name arguments) { return fmi3##of names; }
#define KT_FMI2_PHASE(name) KT_FMI2_CALL(name, name, (void *instance), (instance))
#define KT_FMI2_NUMBERS(name, of, type)                                                                                \
    KT_FMI2_CALL(name, of, (void *instance, type *numbers, size_t count), (instance, numbers, count))

KT_FMI2_PHASE(ExitInitializationMode)
KT_FMI2_PHASE(EnterEventMode)
KT_FMI2_PHASE(EnterContinuousTimeMode)
KT_FMI2_PHASE(Terminate)
KT_FMI2_PHASE(Reset)
KT_FMI2_CALL(SetTime, SetTime, (void *instance, double time), (instance, time))
KT_FMI2_NUMBERS(SetContinuousStates, SetContinuousStates, const double)
KT_FMI2_NUMBERS(GetContinuousStates, GetContinuousStates, double)
KT_FMI2_NUMBERS(GetDerivatives, GetContinuousStateDerivatives, double)
KT_FMI2_NUMBERS(GetNominalsOfContinuousStates, GetNominalsOfContinuousStates, double)
KT_FMI2_NUMBERS(GetEventIndicators, GetEventIndicators, double)
KT_FMI2_CALL(GetFMUstate, GetFMUState, (void *instance, void **state), (instance, state))
KT_FMI2_CALL(SetFMUstate, SetFMUState, (void *instance, void *state), (instance, state))
KT_FMI2_CALL(FreeFMUstate, FreeFMUState, (void *instance, void **state), (instance, state))
KT_FMI2_CALL(SerializedFMUstateSize, SerializedFMUStateSize, (void *instance, void *state, size_t *size),
             (instance, state, size))
KT_FMI2_CALL(SerializeFMUstate, SerializeFMUState, (void *instance, void *state, unsigned char *bytes, size_t size),
             (instance, state, bytes, size))
KT_FMI2_CALL(DeSerializeFMUstate, DeserializeFMUState,
             (void *instance, const unsigned char *bytes, size_t size, void **state), (instance, bytes, size, state))

/* ---- state of a step --------------------------------------------------------------------------------------------- */

KT_FMI(kt_fmi_status fmi2GetRealStatus(void *instance, int kind, double *value)) {
    if (kind != KT_FMI2_LAST_TIME)
        return KT_FMI_DISCARD;
    KT_FMU_TAKE(instance);
    *value = fmu->time;
    return KT_FMI_OK;
}

KT_FMI(kt_fmi_status fmi2GetBooleanStatus(void *instance, int kind, int *value)) {
    if (kind != KT_FMI2_TERMINATED)
        return KT_FMI_DISCARD;
    KT_FMU_TAKE(instance);
    *value = fmu->is_over;
    return KT_FMI_OK;
}

/* ---- absent ------------------------------------------------------------------------------------------------------ */

/* NOLINTBEGIN(readability-non-const-parameter): the standard sets the arguments */
/* No steps are pending. */
#define KT_FMI2_DISCARDED(name, type)                                                                                  \
    KT_FMI(kt_fmi_status fmi2##name(void *instance, int kind, type *value)) {                                          \
        (void)instance, (void)kind, (void)value;                                                                       \
        return KT_FMI_DISCARD;                                                                                         \
    }
KT_FMI2_DISCARDED(GetStatus, kt_fmi_status)
KT_FMI2_DISCARDED(GetIntegerStatus, int)
KT_FMI2_DISCARDED(GetStringStatus, const char *)

KT_FMI(kt_fmi_status fmi2CancelStep(void *instance)) { return kt_fmu_report(instance, "no step is pending"); }

#define KT_FMI2_ABSENT(type, c_type)                                                                                   \
    KT_FMI(kt_fmi_status fmi2Get##type(void *instance, const kt_fmi_reference *references, size_t count,               \
                                       c_type *values)) {                                                              \
        (void)references, (void)values;                                                                                \
        return kt_fmu_reject_list(instance, count, "all variables of this FMU are real numbers");                      \
    }                                                                                                                  \
    KT_FMI(kt_fmi_status fmi2Set##type(void *instance, const kt_fmi_reference *references, size_t count,               \
                                       const c_type *values)) {                                                        \
        (void)references, (void)values;                                                                                \
        return kt_fmu_reject_list(instance, count, "all variables of this FMU are real numbers");                      \
    }
KT_FMI2_ABSENT(Integer, int)
KT_FMI2_ABSENT(Boolean, int)
KT_FMI2_ABSENT(String, char *)

KT_FMI(kt_fmi_status fmi2SetRealInputDerivatives(void *instance, const kt_fmi_reference *references, size_t count,
                                                 const int *orders, const double *values)) {
    (void)references, (void)orders, (void)values;
    return kt_fmu_reject_list(instance, count, "inputs are constant during a step");
}

KT_FMI(kt_fmi_status fmi2GetRealOutputDerivatives(void *instance, const kt_fmi_reference *references, size_t count,
                                                  const int *orders, double *values)) {
    (void)references, (void)orders, (void)values;
    return kt_fmu_reject_list(instance, count, "outputs have no derivatives by time");
}
/* NOLINTEND(readability-non-const-parameter) */
