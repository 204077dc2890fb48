/* Accelerations and reactions of the present state, as records have them. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SIMULATION_RESPONSE_H
#define KT_SIMULATION_RESPONSE_H

#include "base/inner.h"
#include "kinetree/simulation.h"

/* The results. Arrays that `record` does not request may be NULL. */
typedef struct kt_simulation_response {
    unsigned record;       /* KT_RECORD_ bits */
    double *a;             /* nv */
    kt_wrench *joint;      /* a body each */
    kt_wrench *loop;       /* a loop each */
    double *multiplier;    /* an equation each, of any set of switches */
    const kt_model *model; /* result: the loops and equations belong to it */
    const kt_data *data;   /* result: its data, with the motion */
} kt_simulation_response;

/* The result of an event's function within a step if its value belongs to whole steps. Within the step, the value is
 * that at the beginning. The value changes at the end, where the event happens. No function returns this number by
 * chance. */
enum { KT_EVENT_HOLDS = -20264 };

/* Whether contacts are resolved by time stepping. Contact forces then belong to steps, and no evaluation of the model
 * finds them. */
KT_INNER bool kt_simulation_is_stepped(const kt_simulation *simulation);

/* Evaluates a state at the present time with the function that evaluates records. With time stepping, forces of
 * contacts are those of the last step. Errors: those of records. */
KT_INNER KT_CHECKED kt_status kt_simulation_respond(kt_simulation *simulation, const kt_instant *at,
                                                    kt_simulation_response *response, kt_error *error);

#endif
