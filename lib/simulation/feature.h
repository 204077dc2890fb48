/* Searches for breakpoints of the formulas of events. */
#ifndef KT_SIMULATION_FEATURE_H
#define KT_SIMULATION_FEATURE_H

#include "base/inner.h"
#include "expression/expression.h"
#include "kinetree/simulation.h"

/* Returns the first breakpoint after t of formulas of time alone, for kt_event.corner; HUGE_VAL: there is none. The
 * search shares its operations with all other searches of the run (breakpoint.c). A search that is cut is counted with
 * the step that it belongs to. Not in a small library. */
KT_INNER double kt_simulation_next_feature(kt_simulation *simulation, const kt_expression *const *parts, int count,
                                           double t);

#endif
