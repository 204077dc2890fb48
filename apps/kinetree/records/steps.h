/* The motion at the ends of steps: extremes of columns, the scale of energies, and how far coordinates move. Records
 * alone do not show these, because they may fall on turning points or skip whole periods. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_RECORDS_STEPS_H
#define KT_COMMAND_RECORDS_STEPS_H

#include "open/simulated.h"
#include "records/columns.h"
#include "records/extremes.h"

#include "kinetree/analysis.h"

#include <stdbool.h>
#include <stdint.h>

/* How far coordinates have moved, as plain numbers, which checkpoints hold. */
typedef struct kt_moved {
    double position, velocity; /* largest |q - q at the start| and largest |v|: m, rad, m/s, rad/s */
    double size;               /* largest |q| of the coordinates: m, rad */
    double state;              /* largest change of an auxiliary state */
    uint64_t steps, next;      /* steps so far, and the next one whose kinematics are computed */
} kt_moved;

/* Takes a state. start: the first positions (nq) and auxiliary states. x may be NULL: auxiliary states are unknown. */
void kt_moved_take(kt_moved *moved, const kt_model *model, const double *start, const double *q, const double *v,
                   const double *x);

/* A zero-initialised struct watches nothing. */
typedef struct kt_steps {
    kt_simulated of; /* the simulation */
    kt_columns *columns;
    kt_extremes *extremes;
    kt_energy_watch *energy; /* NULL: energies are not watched */
    kt_moved *moved;
    bool needs_kinematics; /* columns need kinematics, or energies are watched */
    double *start;         /* the first positions (nq) and auxiliary states */
    bool *is_used;         /* for each column that needs kinematics */
    const kt_model *shown; /* the model that data belong to: events change it */
    kt_data *data;
} kt_steps;

/* Begins the watch of a simulation at its start. All pointers must outlive the watch. Returns false if memory is
 * insufficient. Ownership: kt_steps_free releases the watch in any case. */
bool kt_steps_start(kt_steps *steps);
void kt_steps_free(kt_steps *steps);

/* Takes the present state, at the end of a step. Cost: O(coordinates + columns), and at one step in eight the
 * kinematics. */
void kt_steps_take(kt_steps *steps);

/* Takes the state of a record before or after an impact, whose coordinates jump within a step. */
void kt_steps_take_jump(kt_steps *steps, const kt_record *record);

#endif
