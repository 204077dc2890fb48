/* Fixed steps that diverge in a scene whose energy nothing watches. */
#ifndef KT_COMMAND_ADVICE_GROWTH_H
#define KT_COMMAND_ADVICE_GROWTH_H

#include "kinetree/simulation.h"
#include "kinetree/study.h"

struct kt_outcome;

/* The largest |v| and the largest |x| (auxiliary states) of the records in the first half of a run. */
typedef struct kt_growth {
    double speed, state;
} kt_growth;

/* Takes a record. Cost: O(coordinates). */
void kt_growth_add(kt_growth *growth, const kt_record *record, double duration);

/* A run that has ended. */
typedef struct kt_grown_run {
    const kt_model *model;
    const kt_absolute *absolute; /* its absolute formulation, if that is integrated; else NULL */
    const kt_run *run;
    const kt_simulation *simulation;
} kt_grown_run;

/* Returns the growth of a speed or a state if steps are fixed and only these steps let it grow on; 0: there is none.
 * The error receives the words. Cost: none, unless a value has grown by KT_GROWTH_LEAST. Then KT_GROWTH_STEPS steps,
 * and adaptive steps over the same time. */
double kt_growth_diverges(const kt_growth *growth, const kt_grown_run *grown, kt_error *error);

/* Warns of this at the end of a run, unless its step or its energy has been reported. */
void kt_warn_of_growth(struct kt_outcome *outcome);

#endif
