/* The description of an FMU, modelDescription.xml of FMI 3.0 or 2.0; its variables that a scene names, and units. */
#ifndef KT_COMMAND_FMU_DESCRIPTION_H
#define KT_COMMAND_FMU_DESCRIPTION_H

#include "document/xml.h"
#include "kinetree/scene.h"
#include "kinetree/status.h"

#include <stdbool.h>
#include <stdint.h>

/* The types of numbers, with their types in C and the names of FMI 3.0. X(id, name, type). In FMI 2.0, Float64 is Real,
 * and Int32 is Integer and Enumeration. */
#define KT_FMI_TYPE_LIST(X)                                                                                            \
    X(KT_FMI_FLOAT64, Float64, double)                                                                                 \
    X(KT_FMI_FLOAT32, Float32, float)                                                                                  \
    X(KT_FMI_INT8, Int8, int8_t)                                                                                       \
    X(KT_FMI_UINT8, UInt8, uint8_t)                                                                                    \
    X(KT_FMI_INT16, Int16, int16_t)                                                                                    \
    X(KT_FMI_UINT16, UInt16, uint16_t)                                                                                 \
    X(KT_FMI_INT32, Int32, int32_t)                                                                                    \
    X(KT_FMI_UINT32, UInt32, uint32_t)                                                                                 \
    X(KT_FMI_INT64, Int64, int64_t)                                                                                    \
    X(KT_FMI_UINT64, UInt64, uint64_t)                                                                                 \
    X(KT_FMI_BOOLEAN, Boolean, bool)

typedef enum kt_fmi_type {
#define KT_FMI_TYPE_ENUM(id, name, type) id,
    KT_FMI_TYPE_LIST(KT_FMI_TYPE_ENUM)
#undef KT_FMI_TYPE_ENUM
        KT_FMI_OTHER /* text, bytes, clocks */
} kt_fmi_type;

/* The exponents of a unit in kg, m, s, A, K, mol, cd and rad, and the value of the unit. */
typedef struct kt_fmi_unit {
    int exponent[8];
    double factor, offset;
} kt_fmi_unit;

typedef struct kt_fmi_variable {
    const char *name, *type_name, *causality;
    const char *unit; /* NULL: none */
    uint32_t reference;
    kt_fmi_type type;
    bool has_reference, is_array, has_start, is_constant;
} kt_fmi_variable;

typedef struct kt_fmi_description {
    kt_reader reader; /* the memory of all texts */
    const kt_element *root;
    int version;                           /* 2 or 3 */
    const char *name, *token, *identifier; /* of the model, of its binary */
    bool can_serialize;                    /* and restore its state */
    const kt_fmi_variable *variables;
    int count;
} kt_fmi_description;

/* Reads the description in an archive. Errors: KT_ERROR_SCENE, KT_ERROR_UNSUPPORTED, KT_ERROR_FILE, KT_ERROR_MEMORY.
 * kt_fmi_description_free releases it in any case. */
KT_CHECKED kt_status kt_fmi_description_read(const char *path, kt_fmi_description *description, kt_error *error);
void kt_fmi_description_free(kt_fmi_description *description);

/* The variable of a name; NULL: none. */
const kt_fmi_variable *kt_fmi_variable_find(const kt_fmi_description *description, const char *name);

/* Finds the unit of a variable. Returns false if the description does not define it. */
bool kt_fmi_unit_find(const kt_fmi_description *description, const char *name, kt_fmi_unit *unit);

/* Writes the name of the binary for this system within the archive. */
void kt_fmi_binary_name(const kt_fmi_description *description, char *name, size_t size);

/* How a scene uses a variable. */
typedef enum kt_fmu_role { KT_FMU_INPUT, KT_FMU_OUTPUT, KT_FMU_PARAMETER } kt_fmu_role;
enum { KT_FMU_ROLES = KT_FMU_PARAMETER + 1 };

/* Finds the variable of a port. Returns NULL after an error at the place of the port: a name that the FMU lacks, a
 * variable for another role, a type that is no number. */
const kt_fmi_variable *kt_fmu_port_find(const kt_fmi_description *description, const kt_scene_fmu *fmu,
                                        const kt_scene_port *port, kt_fmu_role role, kt_error *error);

/* Returns whether the value can be converted to the type of the variable; else *error has the reason. */
bool kt_fmu_value_fits(const kt_fmi_variable *variable, double value, kt_error *error);

/* Writes the reason why the units of a port differ. Returns false if they are equal, or one of them is unknown. */
bool kt_fmu_units_differ(const kt_description *scene, const kt_fmi_description *description, const kt_scene_port *port,
                         kt_fmu_role role, char *text, size_t size);

#endif
