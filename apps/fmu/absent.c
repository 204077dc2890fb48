/* Functions of FMI 3.0 for types and capabilities that these FMUs do not have. Getters and setters accept an empty
 * list; all else reports an error. Arguments that are never read are left out of the definitions where the calling
 * conventions allow it.
 */
#include "instance.h"

static kt_fmi_status report_absence(void *instance, const char *what, size_t count) {
    const kt_fmu *fmu = instance;
    if (count == 0)
        return KT_FMI_OK;
    if (fmu != NULL && fmu->log != NULL)
        fmu->log(fmu->environment, KT_FMI_ERROR, "error", what);
    return KT_FMI_ERROR;
}

/* Getters and setters of a type: references and their number, values and their number. */
#define KT_FMU_ABSENT_TYPES(X)                                                                                         \
    X(Float32)                                                                                                         \
    X(Int8) X(UInt8) X(Int16) X(UInt16) X(Int32) X(UInt32) X(Int64) X(UInt64) X(Boolean) X(String)

#define KT_FMU_ABSENT(type)                                                                                            \
    KT_FMI(kt_fmi_status fmi3Get##type(void *instance, const kt_fmi_reference *references, size_t count, void *values, \
                                       size_t value_count)) {                                                          \
        (void)references, (void)values, (void)value_count;                                                             \
        return report_absence(instance, "this FMU has no variables of the type " #type, count);                        \
    }                                                                                                                  \
    KT_FMI(kt_fmi_status fmi3Set##type(void *instance, const kt_fmi_reference *references, size_t count,               \
                                       const void *values, size_t value_count)) {                                      \
        (void)references, (void)values, (void)value_count;                                                             \
        return report_absence(instance, "this FMU has no variables of the type " #type, count);                        \
    }
KT_FMU_ABSENT_TYPES(KT_FMU_ABSENT)

/* The sizes of binary values come between references and values. Clocks have no number of values. */
#define KT_FMU_ABSENT_LIST(name)                                                                                       \
    KT_FMI(kt_fmi_status fmi3##name(void *instance, const kt_fmi_reference *references, size_t count)) {               \
        (void)references;                                                                                              \
        return report_absence(instance, "this FMU does not have fmi3" #name, count);                                   \
    }
KT_FMU_ABSENT_LIST(GetBinary)
KT_FMU_ABSENT_LIST(SetBinary)
KT_FMU_ABSENT_LIST(GetClock)
KT_FMU_ABSENT_LIST(SetClock)
KT_FMU_ABSENT_LIST(GetIntervalDecimal)
KT_FMU_ABSENT_LIST(GetIntervalFraction)
KT_FMU_ABSENT_LIST(GetShiftDecimal)
KT_FMU_ABSENT_LIST(GetShiftFraction)
KT_FMU_ABSENT_LIST(SetIntervalDecimal)
KT_FMU_ABSENT_LIST(SetIntervalFraction)
KT_FMU_ABSENT_LIST(SetShiftDecimal)
KT_FMU_ABSENT_LIST(SetShiftFraction)
KT_FMU_ABSENT_LIST(GetOutputDerivatives)

#define KT_FMU_ABSENT_CALL(name)                                                                                       \
    KT_FMI(kt_fmi_status fmi3##name(void *instance)) {                                                                 \
        return report_absence(instance, "this FMU does not have fmi3" #name, 1);                                       \
    }
KT_FMU_ABSENT_CALL(GetNumberOfVariableDependencies)
KT_FMU_ABSENT_CALL(GetVariableDependencies)
KT_FMU_ABSENT_CALL(GetDirectionalDerivative)
KT_FMU_ABSENT_CALL(GetAdjointDerivative)
KT_FMU_ABSENT_CALL(EnterConfigurationMode)
KT_FMU_ABSENT_CALL(ExitConfigurationMode)
KT_FMU_ABSENT_CALL(ActivateModelPartition)
