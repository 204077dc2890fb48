/* The types of the C interface of FMI 2.0 (fmi-standard.org) that an FMU and an importer need. The order of values is
 * that of the standard. Statuses and references are those of FMI 3.0. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_FMU_FMI2_H
#define KT_FMU_FMI2_H

#include "fmi3.h"

/* A message to the importer: environment, name of the instance, status, category, format and its arguments. */
typedef void kt_fmi2_log(void *environment, const char *name, kt_fmi_status status, const char *category,
                         const char *format, ...);

typedef struct kt_fmi2_callbacks {
    kt_fmi2_log *log;
    void *(*allocate)(size_t count, size_t size);
    void (*release)(void *memory);
    void (*step_finished)(void *environment, kt_fmi_status status);
    void *environment;
} kt_fmi2_callbacks;

typedef enum kt_fmi2_kind { KT_FMI2_CHANGES_STATES, KT_FMI2_SIMULATES } kt_fmi2_kind;
enum { KT_FMI2_LAST_TIME = 2, KT_FMI2_TERMINATED = 3 }; /* members of fmi2StatusKind */

#endif
