/* The types of the C interface of FMI 3.0 (fmi-standard.org) that an FMU for model exchange and co-simulation needs.
 * The order of values is that of the standard. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_FMU_FMI3_H
#define KT_FMU_FMI3_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum kt_fmi_status { KT_FMI_OK, KT_FMI_WARNING, KT_FMI_DISCARD, KT_FMI_ERROR, KT_FMI_FATAL } kt_fmi_status;

/* A message to the importer. */
typedef void kt_fmi_log(void *environment, kt_fmi_status status, const char *category, const char *message);

/* Called within a step of co-simulation. The last two arguments request an earlier end of the step, and its time. */
typedef void kt_fmi_update(void *environment, double time, bool set_requested, bool get_allowed, bool step_finished,
                           bool can_return, bool *return_requested, double *return_time);

typedef uint32_t kt_fmi_reference;

/* Declares a function that importers load. The standard gives the arguments. */
#define KT_FMI_DECLARE(...) __attribute__((visibility("default"))) __VA_ARGS__

/* Declares such a function, and begins its definition. */
#define KT_FMI(...)                                                                                                    \
    KT_FMI_DECLARE(__VA_ARGS__);                                                                                       \
    __VA_ARGS__

/* The functions of FMI 3.0 on which those of FMI 2.0 are built. */
KT_FMI_DECLARE(void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *folder, bool visible,
                                                  bool logging, void *environment, kt_fmi_log *log));
KT_FMI_DECLARE(void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *folder, bool visible,
                                                 bool logging, bool event_mode, bool early_return,
                                                 const kt_fmi_reference *required, size_t required_count,
                                                 void *environment, kt_fmi_log *log, kt_fmi_update *update));
KT_FMI_DECLARE(void fmi3FreeInstance(void *instance));
KT_FMI_DECLARE(kt_fmi_status fmi3SetDebugLogging(void *instance, bool logging, size_t count, const char *const *names));
KT_FMI_DECLARE(kt_fmi_status fmi3EnterInitializationMode(void *instance, bool has_tolerance, double tolerance,
                                                         double start, bool has_stop, double stop));
KT_FMI_DECLARE(kt_fmi_status fmi3ExitInitializationMode(void *instance));
KT_FMI_DECLARE(kt_fmi_status fmi3EnterEventMode(void *instance));
KT_FMI_DECLARE(kt_fmi_status fmi3EnterContinuousTimeMode(void *instance));
KT_FMI_DECLARE(kt_fmi_status fmi3Terminate(void *instance));
KT_FMI_DECLARE(kt_fmi_status fmi3Reset(void *instance));
KT_FMI_DECLARE(kt_fmi_status fmi3GetFloat64(void *instance, const kt_fmi_reference *references, size_t count,
                                            double *values, size_t value_count));
KT_FMI_DECLARE(kt_fmi_status fmi3SetFloat64(void *instance, const kt_fmi_reference *references, size_t count,
                                            const double *values, size_t value_count));
KT_FMI_DECLARE(kt_fmi_status fmi3DoStep(void *instance, double from, double step, bool is_final, bool *needs_event,
                                        bool *terminate, bool *early, double *last));
KT_FMI_DECLARE(kt_fmi_status fmi3SetTime(void *instance, double time));
KT_FMI_DECLARE(kt_fmi_status fmi3SetContinuousStates(void *instance, const double *states, size_t count));
KT_FMI_DECLARE(kt_fmi_status fmi3GetContinuousStates(void *instance, double *states, size_t count));
KT_FMI_DECLARE(kt_fmi_status fmi3GetContinuousStateDerivatives(void *instance, double *derivatives, size_t count));
KT_FMI_DECLARE(kt_fmi_status fmi3GetNominalsOfContinuousStates(void *instance, double *nominals, size_t count));
KT_FMI_DECLARE(kt_fmi_status fmi3GetEventIndicators(void *instance, double *indicators, size_t count));
KT_FMI_DECLARE(kt_fmi_status fmi3CompletedIntegratorStep(void *instance, bool is_final, bool *enter_event,
                                                         bool *terminate));
KT_FMI_DECLARE(kt_fmi_status fmi3UpdateDiscreteStates(void *instance, bool *need_update, bool *terminate,
                                                      bool *nominals_changed, bool *values_changed, bool *has_next,
                                                      double *next));
KT_FMI_DECLARE(kt_fmi_status fmi3GetDirectionalDerivative(void *instance, const kt_fmi_reference *unknowns,
                                                          size_t unknown_count, const kt_fmi_reference *knowns,
                                                          size_t known_count, const double *seed, size_t seed_count,
                                                          double *sensitivity, size_t sensitivity_count));
KT_FMI_DECLARE(kt_fmi_status fmi3GetFMUState(void *instance, void **state));
KT_FMI_DECLARE(kt_fmi_status fmi3SetFMUState(void *instance, void *state));
KT_FMI_DECLARE(kt_fmi_status fmi3FreeFMUState(void *instance, void **state));
KT_FMI_DECLARE(kt_fmi_status fmi3SerializedFMUStateSize(void *instance, void *state, size_t *size));
KT_FMI_DECLARE(kt_fmi_status fmi3SerializeFMUState(void *instance, void *state, unsigned char *bytes, size_t size));
KT_FMI_DECLARE(kt_fmi_status fmi3DeserializeFMUState(void *instance, const unsigned char *bytes, size_t size,
                                                     void **state));

#endif
