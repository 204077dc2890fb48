/* The types of the C interface of FMI 3.0 (fmi-standard.org) that an FMU for model exchange and co-simulation needs.
 * The order of values is that of the standard. */
#ifndef KT_FMU_FMI3_H
#define KT_FMU_FMI3_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum kt_fmi_status { KT_FMI_OK, KT_FMI_WARNING, KT_FMI_DISCARD, KT_FMI_ERROR, KT_FMI_FATAL } kt_fmi_status;

/* A message to the importer. */
typedef void kt_fmi_log(void *environment, kt_fmi_status status, const char *category, const char *message);

/* Called by FMUs with intermediate updates, which these FMUs do not have. */
typedef void kt_fmi_update(void *environment, double time, bool set_requested, bool get_allowed, bool step_finished,
                           bool can_return, bool *return_requested, double *return_time);

typedef uint32_t kt_fmi_reference;

/* Declares a function that importers load, and begins its definition. */
#define KT_FMI(...)                                                                                                    \
    __attribute__((visibility("default"))) __VA_ARGS__;                                                                \
    __VA_ARGS__

#endif
