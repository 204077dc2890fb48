/* Functionals of the columns of a run (--functionals). */
#ifndef KT_COMMAND_SWEEP_FUNCTIONAL_H
#define KT_COMMAND_SWEEP_FUNCTIONAL_H

#include "sweep/sweep.h"

/* The values of a column: a NaN is none, and the records on both sides of it are not joined. */
typedef struct kt_sweep_range {
    double last, least, greatest;
    double covered, time;     /* of all pieces without a gap; of the last value, NaN: the record has none */
    double integral, squares; /* over time, of the value and of its square */
} kt_sweep_range;

/* Returns ranges without a value, which the caller frees; NULL if memory is insufficient. */
kt_sweep_range *kt_sweep_ranges_create(size_t count);

void kt_sweep_range_extend(kt_sweep_range *of, double time, double value);
double kt_sweep_range_value(const kt_sweep_range *of, kt_functional which);

extern const char *const kt_sweep_functional_names[KT_FUNCTIONALS];

#endif
