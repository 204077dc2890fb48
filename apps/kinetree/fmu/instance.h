/* An instance of an FMU for co-simulation: its binary, and its functions in the form of FMI 3.0 or 2.0. */
#ifndef KT_COMMAND_FMU_INSTANCE_H
#define KT_COMMAND_FMU_INSTANCE_H

#include "fmu/archive.h"
#include "fmu/description.h"
#include "native/native.h"

#include "../fmu/fmi2.h"

enum { KT_FMI_TEXT = 400 };

typedef struct kt_fmi_instance kt_fmi_instance;

/* How one version of FMI is called. Values are doubles, which are converted to the type of the variable. */
typedef struct kt_fmi_interface {
    bool (*instantiate)(kt_fmi_instance *f);
    kt_fmi_status (*begin)(kt_fmi_instance *f, double start); /* the initialization */
    kt_fmi_status (*set)(kt_fmi_instance *f, const kt_fmi_variable *variable, double value);
    kt_fmi_status (*get)(kt_fmi_instance *f, const kt_fmi_variable *variable, double *value);
    /* *terminates: the FMU ends the simulation. */
    kt_fmi_status (*step)(kt_fmi_instance *f, double from, double step, bool *terminates);
} kt_fmi_interface;

/* The functions that are called: result, member, arguments, and the name in FMI 2.0 and 3.0; NULL: the version does not
 * have it. All FMUs have the first ones. The functions of states serialise an FMU. Those of FMI 3.0 for the values of a
 * type are missing in an FMU without such variables. */
#define KT_FMI_NEEDED_LIST(X)                                                                                          \
    X(void *, instantiate2,                                                                                            \
      (const char *, kt_fmi2_kind, const char *, const char *, const kt_fmi2_callbacks *, int, int), "Instantiate",    \
      NULL)                                                                                                            \
    X(void *, instantiate3,                                                                                            \
      (const char *, const char *, const char *, bool, bool, bool, bool, const kt_fmi_reference *, size_t, void *,     \
       kt_fmi_log *, kt_fmi_update *),                                                                                 \
      NULL, "InstantiateCoSimulation")                                                                                 \
    X(void, free_instance, (void *), "FreeInstance", "FreeInstance")                                                   \
    X(kt_fmi_status, set_up, (void *, int, double, double, int, double), "SetupExperiment", NULL)                      \
    X(kt_fmi_status, begin2, (void *), "EnterInitializationMode", NULL)                                                \
    X(kt_fmi_status, begin3, (void *, bool, double, double, bool, double), NULL, "EnterInitializationMode")            \
    X(kt_fmi_status, end, (void *), "ExitInitializationMode", "ExitInitializationMode")                                \
    X(kt_fmi_status, step2, (void *, double, double, int), "DoStep", NULL)                                             \
    X(kt_fmi_status, step3, (void *, double, double, bool, bool *, bool *, bool *, double *), NULL, "DoStep")          \
    X(kt_fmi_status, get_truth_status, (void *, int, int *), "GetBooleanStatus", NULL)                                 \
    X(kt_fmi_status, terminate, (void *), "Terminate", "Terminate")                                                    \
    X(kt_fmi_status, GetReal, (void *, const kt_fmi_reference *, size_t, double *), "GetReal", NULL)                   \
    X(kt_fmi_status, SetReal, (void *, const kt_fmi_reference *, size_t, const double *), "SetReal", NULL)             \
    X(kt_fmi_status, GetInteger, (void *, const kt_fmi_reference *, size_t, int *), "GetInteger", NULL)                \
    X(kt_fmi_status, SetInteger, (void *, const kt_fmi_reference *, size_t, const int *), "SetInteger", NULL)          \
    X(kt_fmi_status, GetTruth, (void *, const kt_fmi_reference *, size_t, int *), "GetBoolean", NULL)                  \
    X(kt_fmi_status, SetTruth, (void *, const kt_fmi_reference *, size_t, const int *), "SetBoolean", NULL)
#define KT_FMI_STATE_LIST(X)                                                                                           \
    X(kt_fmi_status, get_state, (void *, void **), "GetFMUstate", "GetFMUState")                                       \
    X(kt_fmi_status, set_state, (void *, void *), "SetFMUstate", "SetFMUState")                                        \
    X(kt_fmi_status, free_state, (void *, void **), "FreeFMUstate", "FreeFMUState")                                    \
    X(kt_fmi_status, state_size, (void *, void *, size_t *), "SerializedFMUstateSize", "SerializedFMUStateSize")       \
    X(kt_fmi_status, serialize, (void *, void *, unsigned char *, size_t), "SerializeFMUstate", "SerializeFMUState")   \
    X(kt_fmi_status, deserialize, (void *, const unsigned char *, size_t, void **), "DeSerializeFMUstate",             \
      "DeserializeFMUState")
#define KT_FMI_VALUE_LIST(X, name, type)                                                                               \
    X(kt_fmi_status, Get##name, (void *, const kt_fmi_reference *, size_t, type *, size_t), NULL, "Get" #name)         \
    X(kt_fmi_status, Set##name, (void *, const kt_fmi_reference *, size_t, const type *, size_t), NULL, "Set" #name)

#define KT_FMI_MEMBER(result, member, arguments, second, third) result(*member) arguments;
#define KT_FMI_MEMBERS(id, name, type) KT_FMI_VALUE_LIST(KT_FMI_MEMBER, name, type)
typedef struct kt_fmi_functions {
    KT_FMI_NEEDED_LIST(KT_FMI_MEMBER)
    KT_FMI_STATE_LIST(KT_FMI_MEMBER)
    KT_FMI_TYPE_LIST(KT_FMI_MEMBERS)
} kt_fmi_functions;

static inline bool kt_fmi_is_fine(kt_fmi_status status) { return status == KT_FMI_OK || status == KT_FMI_WARNING; }

extern const kt_fmi_interface kt_fmi2_interface, kt_fmi3_interface;

struct kt_fmi_instance {
    const char *name; /* of the FMU in the scene */
    kt_fmi_description description;
    const kt_fmi_interface *calls;
    char folder[KT_FMU_PATH];             /* of the unpacked archive; empty: it has been removed */
    char resources[3 * KT_FMU_PATH + 32]; /* its resources, as the version names them; empty: none */
    void *library;                        /* the binary */
    kt_fmi_functions call;
    void *instance;              /* NULL: none */
    kt_fmi2_callbacks callbacks; /* of FMI 2.0 */
    double time;                 /* s, for messages */
    char message[KT_FMI_TEXT];   /* the last warning or error of the FMU; empty: none */
    int messages;                /* how many it has printed */
    kt_fmi_status worst;         /* of the instance: it is only released after an error, and not even that if fatal */
};

/* Loads the FMU of a file, and makes an instance. Errors: KT_ERROR_SCENE, KT_ERROR_UNSUPPORTED, KT_ERROR_FILE,
 * KT_ERROR_MEMORY. kt_fmi_close releases it in any case; a struct of zeros has nothing to release. */
KT_CHECKED kt_status kt_fmi_open(kt_fmi_instance *f, const char *name, const char *file, kt_error *error);
void kt_fmi_close(kt_fmi_instance *f);

/* Replaces the instance by a new one. Errors: as above. */
KT_CHECKED kt_status kt_fmi_renew(kt_fmi_instance *f, kt_error *error);

/* Checks an FMU as kt_fmi_open does, without running anything of it: its description, its archive, and whether it has a
 * whole binary for this system. */
KT_CHECKED kt_status kt_fmi_inspect(const char *file, kt_error *error);

/* Keeps and prints a message of the FMU. */
void kt_fmi_note(kt_fmi_instance *f, kt_fmi_status status, const char *category, const char *message);

/* Finds the functions in the binary of a file. Errors: KT_ERROR_SCENE: it lacks one that all FMUs have. Without the
 * functions of states, the FMU cannot be serialised. */
KT_CHECKED kt_status kt_fmi_find_functions(kt_fmi_instance *f, const char *file, kt_error *error);

/* Ends the simulation of the instance, unless an error has ended it. */
void kt_fmi_terminate(kt_fmi_instance *f);

/* Releases the instance, unless there is none or nothing of it may be called any longer. */
void kt_fmi_free_instance(kt_fmi_instance *f);

/* The state of the FMU as bytes, which the caller frees; and back. Errors: KT_ERROR_UNSUPPORTED (the FMU cannot),
 * KT_ERROR_CALLBACK, KT_ERROR_MEMORY. */
KT_CHECKED kt_status kt_fmi_save(kt_fmi_instance *f, unsigned char **bytes, size_t *size, kt_error *error);
KT_CHECKED kt_status kt_fmi_restore(kt_fmi_instance *f, const unsigned char *bytes, size_t size, kt_error *error);

/* Reports a status other than OK and WARNING, of a function with this name: KT_ERROR_CALLBACK with the name of the FMU,
 * the time and its last message. */
KT_CHECKED kt_status kt_fmi_check(kt_fmi_instance *f, kt_fmi_status status, const char *function, kt_error *error);

#endif
