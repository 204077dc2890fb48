/* Functionals of the columns of a run: extremes, last values, integrals over time. Functionals are taken at records.
 * Columns that follow from the state alone are also taken at the ends of steps, because a motion may pass its extremes
 * between two records. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_RECORDS_EXTREMES_H
#define KT_COMMAND_RECORDS_EXTREMES_H

#include "records/columns.h"
#include "text/json.h"

#include <stdbool.h>
#include <stddef.h>

/* Extremes of one column: plain numbers, which checkpoints hold. The extremes are NaN until the column has a value. */
typedef struct kt_extreme {
    double least, greatest;           /* values */
    double least_time, greatest_time; /* s, of the first record that has them */
    double integral, square;          /* over time, of the value and of its square, by the trapezoidal rule */
    double last, covered, time; /* the latest value; s, all pieces without a gap; of the latest record, NaN: a gap */
    double gaps, gap_time;      /* how many records have no finite value; s, the first of them */

    /* The motion between records. The path is the sum of |changes| from point to point. */
    double path, shown;           /* over records and ends of steps; over records alone */
    double low, high, record;     /* since the latest record; the value at this record, NaN: a gap or none */
    double between;               /* largest (high - low) - |change of the records| between two records */
    double pending, pending_time; /* the end of the latest step, after the records within that step; NaN: none */

    /* Of a coordinate of a marker: integrals of rates over time, and the latest rates; rate_time is NaN before. A
     * steady turn needs so few steps that their ends do not show it either. */
    double travel, turned;              /* m: of |velocity|; rad: of the body's angular velocity */
    double spans;                       /* how many times between two records these cover */
    double speed, turn_rate, rate_time; /* m/s, rad/s, s */
} kt_extreme;

typedef struct kt_extremes {
    kt_extreme *column; /* [count]; NULL: none are kept */
    size_t count;
} kt_extremes;

/* Allocates the extremes of `count` columns. Returns false if memory is insufficient. Ownership: kt_extremes_free
 * releases them in any case. */
bool kt_extremes_start(kt_extremes *extremes, size_t count);
void kt_extremes_free(kt_extremes *extremes);

/* Adds a value. A gap is none, and the records on both sides of it are not joined. */
void kt_extreme_add(kt_extreme *e, double time, double value, bool is_gap);

/* Adds the value at the end of a step, in the order of time. Records within the step may follow. */
void kt_extreme_step(kt_extreme *e, double time, double value);

/* Adds the rates of a marker's coordinate at a record: its velocity, m/s, and the size of the angular velocity of its
 * body, rad/s. */
void kt_extreme_add_rates(kt_extreme *e, double time, double velocity, double turn_rate);

/* Returns whether a body turns by more than half a turn between two records, on average, and its marker travels more
 * than half as far again as the records show. The other conditions are those below. */
bool kt_extreme_is_turned(const kt_extreme *e, double noise);

/* Returns whether the path of a column between its records is more than half as long again as the path that the records
 * show. For a sine, this is so with less than about 2.1 records a period. Two further conditions exclude harmless
 * cases. Between two records, the column must move by a twentieth of its range more than the records show, since a
 * ripple on a slow motion does not count. In total, it must move by ten ranges more, since a single impact is no
 * oscillation. noise: ranges up to this value do not count. */
bool kt_extreme_is_aliased(const kt_extreme *e, double noise);

/* Returns the mean over time, and the root mean square; without any duration, the last value is taken. */
double kt_extreme_mean(const kt_extreme *e);
double kt_extreme_rms(const kt_extreme *e);

/* Adds the values of a record, one for each column. A value that is not finite is a gap. */
void kt_extremes_add(kt_extremes *extremes, double time, const double *values);

/* Returns an object that maps the name of each column except time to {min, min_time, max, max_time, rms, end, unit,
 * from}. from: "steps" for columns that were also taken at the ends of steps, else "records". A column with gaps also
 * has {gaps: {count, time}}. */
json_t *kt_extremes_describe(const kt_extremes *extremes, const kt_columns *columns);

#endif
