/* Extremes, root mean squares and last values of the columns of a run, over its records. */
#ifndef KT_COMMAND_RECORDS_EXTREMES_H
#define KT_COMMAND_RECORDS_EXTREMES_H

#include "records/columns.h"
#include "text/json.h"

#include <stdbool.h>
#include <stddef.h>

/* Extremes of one column: plain numbers, which checkpoints hold. They are NaN until the column has a value. A value
 * that is not finite counts only as a gap. */
typedef struct kt_extreme {
    double least, greatest;           /* values */
    double least_time, greatest_time; /* s, of the first record that has them */
    double square;                    /* integral of the square over time */
    double last, covered, time; /* the latest value; s, all pieces without a gap; of the latest record, NaN: a gap */
    double gaps, gap_time;      /* how many records have no finite value; s, the first of them */
} kt_extreme;

typedef struct kt_extremes {
    kt_extreme *column; /* [count]; NULL: none are kept */
    size_t count;
} kt_extremes;

/* Allocates the extremes of `count` columns. Returns false if memory is insufficient. Ownership: kt_extremes_free
 * releases them in any case. */
bool kt_extremes_start(kt_extremes *extremes, size_t count);
void kt_extremes_free(kt_extremes *extremes);

/* Adds the values of a record, one for each column. */
void kt_extremes_add(kt_extremes *extremes, double time, const double *values);

/* Returns an object that maps the name of each column except time to {min, min_time, max, max_time, rms, end, unit}. A
 * column with gaps also has {gaps: {count, time}}. The square is integrated with the trapezoidal rule. Records on both
 * sides of a gap are not joined. */
json_t *kt_extremes_describe(const kt_extremes *extremes, const kt_columns *columns);

#endif
