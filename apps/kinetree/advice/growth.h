/* Fixed steps that diverge in a scene whose energy nothing watches. */
#ifndef KT_COMMAND_ADVICE_GROWTH_H
#define KT_COMMAND_ADVICE_GROWTH_H

#include "kinetree/simulation.h"

struct kt_outcome;

/* The largest |v| and the largest |x| (auxiliary states) of the records in the first half of a run. */
typedef struct kt_growth {
    double speed, state;
} kt_growth;

/* Takes a record. Cost: O(coordinates). */
void kt_growth_add(kt_growth *growth, const kt_record *record, double duration);

/* Warns at the end of a run with fixed steps if a speed or a state has grown, and only these steps let it grow on.
 * Cost: none, unless a value has grown by KT_GROWTH_LEAST. Then KT_GROWTH_STEPS steps, and adaptive steps over the same
 * time. */
void kt_warn_of_growth(struct kt_outcome *outcome);

#endif
