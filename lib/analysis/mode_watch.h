/* The inside of a watch on the fastest mode, for its two files. */
#ifndef KT_ANALYSIS_MODE_WATCH_H
#define KT_ANALYSIS_MODE_WATCH_H

#include "kinetree/analysis.h"

/* Every array: type, name, count, meaning. */
#define KT_MODE_WATCH_FIELDS(X)                                                                                        \
    X(double, unit, nv, "1 rad, or a length of the mechanism")                                                         \
    X(double, direction, 2 * nv, "dq and dv over their units, of length 1")                                            \
    X(double, image, 2 * nv, "J times the direction")                                                                  \
    X(double, step, nv, "dq")                                                                                          \
    X(double, moved_q, nq, "q (+) dq")                                                                                 \
    X(double, moved_v, nv, "v + dv")                                                                                   \
    X(double, a, nv, "acceleration at the state")                                                                      \
    X(double, moved_a, nv, "and beside it")                                                                            \
    X(double, fast_q, nq, "where the mode was fastest")                                                                \
    X(double, fast_v, nv, "there")                                                                                     \
    X(char, data_memory, kt_data_size(model), "scratch")

struct kt_mode_watch {
    void *owned; /* memory of kt_mode_watch_create, or NULL */
    const kt_model *model;
    kt_data *data;
    size_t nq, nv;
    double scale;      /* 1/s, of velocities against positions: the last rate */
    double time, rate; /* of the fastest */
    uint64_t states, evaluations;
#define KT_MODE_WATCH_DECLARE(type, name, count, meaning) type *name;
    KT_MODE_WATCH_FIELDS(KT_MODE_WATCH_DECLARE)
#undef KT_MODE_WATCH_DECLARE
};

#endif
