/* Functions of FMI 3.0 for types and capabilities that these FMUs do not have. Getters and setters accept an empty
 * list; all else reports an error. Most of the arguments are never read.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "instance.h"

#pragma GCC diagnostic ignored "-Wunused-parameter"
/* NOLINTBEGIN(misc-unused-parameters): the standard sets the arguments */

/* Getters and setters of a type: references and their number, values and their number. */
#define KT_FMU_ABSENT_TYPES(X)                                                                                         \
    X(Float32)                                                                                                         \
    X(Int8) X(UInt8) X(Int16) X(UInt16) X(Int32) X(UInt32) X(Int64) X(UInt64) X(Boolean) X(String)

#define KT_FMU_ABSENT(type)                                                                                            \
    KT_FMI(kt_fmi_status fmi3Get##type(void *instance, const kt_fmi_reference *references, size_t count, void *values, \
                                       size_t value_count)) {                                                          \
        return kt_fmu_reject_list(instance, count, "this FMU has no variables of the type " #type);                    \
    }                                                                                                                  \
    KT_FMI(kt_fmi_status fmi3Set##type(void *instance, const kt_fmi_reference *references, size_t count,               \
                                       const void *values, size_t value_count)) {                                      \
        return kt_fmu_reject_list(instance, count, "this FMU has no variables of the type " #type);                    \
    }
KT_FMU_ABSENT_TYPES(KT_FMU_ABSENT)

/* Lists of another form: references, their number, and further arguments. */
#define KT_FMU_ABSENT_LIST(name, ...)                                                                                  \
    KT_FMI(kt_fmi_status fmi3##name(void *instance, const kt_fmi_reference *references, size_t count, __VA_ARGS__)) {  \
        return kt_fmu_reject_list(instance, count, "this FMU does not have fmi3" #name);                               \
    }
KT_FMU_ABSENT_LIST(GetBinary, size_t *sizes, const uint8_t **values, size_t value_count)
KT_FMU_ABSENT_LIST(SetBinary, const size_t *sizes, const uint8_t *const *values, size_t value_count)
KT_FMU_ABSENT_LIST(GetClock, bool *values)
KT_FMU_ABSENT_LIST(SetClock, const bool *values)
KT_FMU_ABSENT_LIST(GetIntervalDecimal, double *intervals, int *qualifiers)
KT_FMU_ABSENT_LIST(GetIntervalFraction, uint64_t *counters, uint64_t *resolutions, int *qualifiers)
KT_FMU_ABSENT_LIST(GetShiftDecimal, double *shifts)
KT_FMU_ABSENT_LIST(GetShiftFraction, uint64_t *counters, uint64_t *resolutions)
KT_FMU_ABSENT_LIST(SetIntervalDecimal, const double *intervals)
KT_FMU_ABSENT_LIST(SetIntervalFraction, const uint64_t *counters, const uint64_t *resolutions)
KT_FMU_ABSENT_LIST(SetShiftDecimal, const double *shifts)
KT_FMU_ABSENT_LIST(SetShiftFraction, const uint64_t *counters, const uint64_t *resolutions)
KT_FMU_ABSENT_LIST(GetOutputDerivatives, const int32_t *orders, double *values, size_t value_count)

#define KT_FMU_ABSENT_CALL(name, ...)                                                                                  \
    KT_FMI(kt_fmi_status fmi3##name(__VA_ARGS__)) {                                                                    \
        return kt_fmu_reject_list(instance, 1, "this FMU does not have fmi3" #name);                                   \
    }
KT_FMU_ABSENT_CALL(GetNumberOfVariableDependencies, void *instance, kt_fmi_reference reference, size_t *count)
KT_FMU_ABSENT_CALL(GetVariableDependencies, void *instance, kt_fmi_reference dependent, size_t *dependent_elements,
                   kt_fmi_reference *independents, size_t *independent_elements, int *kinds, size_t count)
KT_FMU_ABSENT_CALL(EnterConfigurationMode, void *instance)
KT_FMU_ABSENT_CALL(ExitConfigurationMode, void *instance)
KT_FMU_ABSENT_CALL(ActivateModelPartition, void *instance, kt_fmi_reference clock, double time)

KT_FMI(void *fmi3InstantiateScheduledExecution(const char *name, const char *token, const char *folder, bool visible,
                                               bool logging, void *environment, kt_fmi_log *log, void *clock_update,
                                               void *lock, void *unlock)) {
    if (log != NULL)
        log(environment, KT_FMI_ERROR, "error", "this FMU has no scheduled execution");
    return NULL;
}
/* NOLINTEND(misc-unused-parameters) */
