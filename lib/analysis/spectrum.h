/* The inside of a spectrum, for its two files. */
#ifndef KT_ANALYSIS_SPECTRUM_H
#define KT_ANALYSIS_SPECTRUM_H

#include "kinetree/analysis.h"

typedef struct kt_spectrum_sizes {
    size_t nq, nv, samples, modes, shapes, linearization, system_modes;
} kt_spectrum_sizes;

/* Every array: type, name, count, meaning. */
#define KT_SPECTRUM_FIELDS(X)                                                                                          \
    X(kt_spectrum_mode, mode, s->modes, "by time, and then by falling |lambda|")                                       \
    X(kt_complex, lambda, s->modes, "the same as plain numbers")                                                       \
    X(double, shape, s->shapes * s->nv, "of the fastest of each state")                                                \
    X(double, position, s->samples * s->nq, "q of each state")                                                         \
    X(char, linearization_memory, s->linearization, "of a state")                                                      \
    X(char, modes_memory, s->system_modes, "of a state")

struct kt_spectrum {
    void *owned; /* memory of kt_spectrum_create, or NULL */
    const kt_model *model;
    kt_linearization *linearization;
    kt_modes *modes;
    kt_spectrum_sizes size;
    int samples, count;
#define KT_SPECTRUM_DECLARE(type, name, count, meaning) type *name;
    KT_SPECTRUM_FIELDS(KT_SPECTRUM_DECLARE)
#undef KT_SPECTRUM_DECLARE
};

#endif
