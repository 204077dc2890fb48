/* The columns of a run's records: their names, their quantities, and their values in a record. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_RECORDS_COLUMNS_H
#define KT_COMMAND_RECORDS_COLUMNS_H

#include "records/gravity.h"

#include "kinetree/scene.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

/* The source of the values of a column. */
typedef enum kt_column_source {
    KT_COLUMN_TIME,
    KT_COLUMN_POSITION, /* coordinate `component` of the joint of body `index` */
    KT_COLUMN_VELOCITY,
    KT_COLUMN_ACCELERATION,
    KT_COLUMN_GRAVITY,
    KT_COLUMN_MARKER,               /* coordinate `component` of marker `marker` of body `index` */
    KT_COLUMN_MARKER_VELOCITY,      /* velocity of that marker */
    KT_COLUMN_MARKER_ACCELERATION,  /* acceleration of that marker */
    KT_COLUMN_ORIENTATION,          /* quaternion of body `index`: w, x, y, z, w >= 0 */
    KT_COLUMN_ANGULAR_VELOCITY,     /* body `index`: x, y, z in world axes, x, y, z in body axes */
    KT_COLUMN_ANGULAR_ACCELERATION, /* body `index`: in the same axes */
    KT_COLUMN_MOMENTUM,             /* linear x, y, z, angular x, y, z */
    KT_COLUMN_ENERGY,               /* kinetic, potential, total */
    KT_COLUMN_WORK,                 /* dissipated, supplied, balance */
    KT_COLUMN_RESIDUAL,             /* residual of positions, of velocities */
    KT_COLUMN_SINGULAR_VALUE,       /* the smallest one of the loops' Jacobian */
    KT_COLUMN_REACTION,             /* in the joint of body `index`: force x, y, z, moment x, y, z */
    KT_COLUMN_LOOP_REACTION,        /* in loop `index` */
    KT_COLUMN_BEARING,              /* in the joint of body `index`, without effects and drives: likewise */
    KT_COLUMN_MULTIPLIER,           /* multiplier of equation `component` of loop `index` */
    KT_COLUMN_LOOP_POSITION,        /* coordinate `component` of the joint that loop `index` stands for */
    KT_COLUMN_LOOP_VELOCITY,        /* velocity of coordinate `component` of that joint */
    KT_COLUMN_CLOSURE,              /* loop `index`: d, Euler vector; for a curve the arc length alone */
    KT_COLUMN_OWN,                  /* `index` of output.columns */
    KT_COLUMN_STATE,                /* auxiliary state `index` */
    KT_COLUMN_EFFECT,               /* quantity `component` of effect `index`; at: among all quantities */
} kt_column_source;

typedef struct kt_column {
    kt_column_source source;
    int index, component, marker;
    int at; /* for coordinates and multipliers: the index in q, v, a or among the multipliers */
} kt_column;

typedef struct kt_own_columns kt_own_columns; /* output.columns, with all that their formulas read */

/* The columns of a run, in their order in files. */
typedef struct kt_columns {
    const kt_model *model;
    const kt_description *description; /* the model's description: which effects are hard */
    unsigned record;                   /* KT_RECORD_ bits */
    unsigned empty;                    /* bits of `record` for which the scene has no columns */
    kt_column *columns;
    size_t count, room;
    double *values;                  /* [count], of the record that was evaluated last */
    kt_own_columns *own;             /* NULL: there are none */
    const kt_scene_column *formulas; /* formulas of the scene, with the names of `own` */
    const bool *is_used;             /* [count]: which are evaluated; NULL: all */
    double *quantities;              /* quantities of all effects, in that record; NULL: they are not recorded */
    double *jacobian;                /* room for that of a body; NULL: bearings are not recorded */
    kt_singular *singular;           /* NULL: singular values are not recorded */
    kt_gravity *gravity;             /* NULL: gravity in joints is not recorded */
} kt_columns;

/* Lists the columns of the recorded quantities (`record`: KT_RECORD_ bits). The scene and its model must outlive the
 * list. Returns false if memory is insufficient. Ownership: kt_columns_free releases the list in any case. */
bool kt_columns_list(kt_columns *columns, const kt_scene *scene, const kt_model *model, const kt_run *run,
                     unsigned record);
/* Lists the columns of all quantities and markers, likewise. */
bool kt_columns_list_all(kt_columns *all, const kt_scene *scene, const kt_model *model);
void kt_columns_free(kt_columns *columns);

/* Adds the columns of output.columns. The scene must outlive the list. *record: the KT_RECORD_ bits that simulations
 * must compute for these columns (kt_simulation_options.record). Errors: KT_ERROR_SCENE (a name that is no column),
 * KT_ERROR_MEMORY. */
KT_CHECKED kt_status kt_columns_add_own(kt_columns *columns, const kt_scene *scene, unsigned *record, kt_error *error);

/* Determines only these bits, for callers that create the simulation before the columns. Errors: as above. */
KT_CHECKED kt_status kt_columns_own_record(const kt_scene *scene, const kt_model *model, unsigned *record,
                                           kt_error *error);

/* Writes the name of a column, "position.crank", as snprintf does; returns its length. */
int kt_column_name(const kt_columns *columns, size_t column, char *text, size_t size);

/* Returns the column of this name; columns->count: there is none. The search begins at column `guess`. */
size_t kt_columns_find(const kt_columns *columns, const char *name, size_t guess);

/* Writes the name of a column as in the first line of a file. For quantities of effects, the unit follows:
 * "effect.tyre.force [N]". */
int kt_column_header(const kt_columns *columns, size_t column, char *text, size_t size);

/* The title and the unit that a chart shows for columns on one axis. */
typedef struct kt_measure {
    const char *title, *unit;
} kt_measure;

kt_measure kt_column_quantity(const kt_columns *columns, size_t column);

/* Returns the values of all columns in a record; NaN if the record does not have a value. Ownership: the list owns
 * them, until the next call. */
const double *kt_columns_evaluate(kt_columns *columns, const kt_record *record);

/* Computes these values, without those of own columns. */
void kt_columns_fill(kt_columns *columns, const kt_record *record);

/* Returns whether a column is a coordinate, a velocity or an auxiliary state. Returns whether it also has a value at
 * the ends of steps: such columns follow from the state and its kinematics. Others need accelerations, reactions or
 * the work done, or are formulas that may read these. */
static inline bool kt_column_is_state(kt_column_source source) {
    return source == KT_COLUMN_POSITION || source == KT_COLUMN_VELOCITY || source == KT_COLUMN_STATE;
}

static inline bool kt_column_has_steps(kt_column_source source) {
    return kt_column_is_state(source) || source == KT_COLUMN_MARKER || source == KT_COLUMN_MARKER_VELOCITY ||
           source == KT_COLUMN_ORIENTATION || source == KT_COLUMN_ANGULAR_VELOCITY || source == KT_COLUMN_MOMENTUM ||
           source == KT_COLUMN_ENERGY;
}

/* Returns whether a loop is along a curve, whose columns have the length of the arc. */
bool kt_column_has_arc(const kt_model *model, int loop);

/* Returns kinetic + potential + dissipated - supplied, J. This balance is constant along the exact motion. NaN if the
 * work done is not available. */
static inline double kt_balance_of(const kt_record *record) {
    return record->kinetic + record->potential + record->work.dissipated - record->work.supplied;
}

/* Returns the energy whose change a run shows, J: the balance, or the total energy if the work done is unknown. */
static inline double kt_shown_energy_of(const kt_record *record) {
    const double balance = kt_balance_of(record);
    return isnan(balance) ? record->kinetic + record->potential : balance;
}

#endif
