/* An instance of an FMU for co-simulation: its binary, and its functions in the form of FMI 3.0 or 2.0. */
#ifndef KT_COMMAND_FMU_INSTANCE_H
#define KT_COMMAND_FMU_INSTANCE_H

#include "fmu/archive.h"
#include "fmu/description.h"
#include "native/native.h"

#include "../fmu/fmi3.h"

enum { KT_FMI_TEXT = 400 };

typedef struct kt_fmi_instance kt_fmi_instance;

/* The functions of one version of FMI. Values are doubles, which are converted to the type of the variable. */
typedef struct kt_fmi_interface {
    /* Finds all functions in the binary. Returns the name of a missing one; NULL: none is missing. */
    const char *(*load)(kt_fmi_instance *f);
    bool (*instantiate)(kt_fmi_instance *f);
    kt_fmi_status (*begin)(kt_fmi_instance *f, double start); /* the initialization */
    kt_fmi_status (*set)(kt_fmi_instance *f, const kt_fmi_variable *variable, double value);
    kt_fmi_status (*get)(kt_fmi_instance *f, const kt_fmi_variable *variable, double *value);
    /* *terminates: the FMU ends the simulation. */
    kt_fmi_status (*step)(kt_fmi_instance *f, double from, double step, bool *terminates);
} kt_fmi_interface;

/* The functions that are the same in both versions: member, result, arguments, and the name in FMI 2.0 and 3.0. All
 * FMUs have the first ones. The functions of states serialise an FMU. */
#define KT_FMI_COMMON_LIST(X)                                                                                          \
    X(end, kt_fmi_status, (void *), "ExitInitializationMode", "ExitInitializationMode")                                \
    X(terminate, kt_fmi_status, (void *), "Terminate", "Terminate")                                                    \
    X(free_instance, void, (void *), "FreeInstance", "FreeInstance")
#define KT_FMI_STATE_LIST(X)                                                                                           \
    X(get_state, kt_fmi_status, (void *, void **), "GetFMUstate", "GetFMUState")                                       \
    X(set_state, kt_fmi_status, (void *, void *), "SetFMUstate", "SetFMUState")                                        \
    X(free_state, kt_fmi_status, (void *, void **), "FreeFMUstate", "FreeFMUState")                                    \
    X(state_size, kt_fmi_status, (void *, void *, size_t *), "SerializedFMUstateSize", "SerializedFMUStateSize")       \
    X(serialize, kt_fmi_status, (void *, void *, unsigned char *, size_t), "SerializeFMUstate", "SerializeFMUState")   \
    X(deserialize, kt_fmi_status, (void *, const unsigned char *, size_t, void **), "DeSerializeFMUstate",             \
      "DeserializeFMUState")

#define KT_FMI_MEMBER(member, result, arguments, second, third) result(*member) arguments;
typedef struct kt_fmi_common {
    KT_FMI_COMMON_LIST(KT_FMI_MEMBER)
    KT_FMI_STATE_LIST(KT_FMI_MEMBER)
} kt_fmi_common;
#undef KT_FMI_MEMBER

static inline bool kt_fmi_is_fine(kt_fmi_status status) { return status == KT_FMI_OK || status == KT_FMI_WARNING; }

extern const kt_fmi_interface kt_fmi2_interface, kt_fmi3_interface;

struct kt_fmi_instance {
    const char *name; /* of the FMU in the scene */
    kt_fmi_description description;
    const kt_fmi_interface *calls;
    char folder[KT_FMU_PATH];             /* of the unpacked archive; empty: it has been removed */
    char resources[3 * KT_FMU_PATH + 32]; /* its resources, as the version names them; empty: none */
    void *library, *functions;            /* the binary, and its functions (of the version) */
    kt_fmi_common common;
    void *instance;            /* NULL: none */
    void *callbacks;           /* of the version; NULL: none */
    double time;               /* s, for messages */
    char message[KT_FMI_TEXT]; /* the last warning or error of the FMU; empty: none */
    int messages;              /* how many it has printed */
    bool is_quiet, is_broken;  /* broken: nothing of it may be called any longer */
};

/* Loads the FMU of a file, and makes an instance. Errors: KT_ERROR_SCENE, KT_ERROR_UNSUPPORTED, KT_ERROR_FILE,
 * KT_ERROR_MEMORY. kt_fmi_close releases it in any case; a struct of zeros has nothing to release. */
KT_CHECKED kt_status kt_fmi_open(kt_fmi_instance *f, const char *name, const char *file, kt_error *error);
void kt_fmi_close(kt_fmi_instance *f);

/* Replaces the instance by a new one. Errors: as above. */
KT_CHECKED kt_status kt_fmi_renew(kt_fmi_instance *f, kt_error *error);

/* Keeps and prints a message of the FMU. */
void kt_fmi_note(kt_fmi_instance *f, kt_fmi_status status, const char *category, const char *message);

/* Finds the common functions. Returns the name of a missing one; NULL: none is missing. Without the functions of
 * states, the FMU cannot be serialised. */
const char *kt_fmi_find_common(kt_fmi_instance *f);

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
