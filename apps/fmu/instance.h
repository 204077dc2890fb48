/* An instance of an FMU: the scene of its resources, compiled, with its inputs, parameters and state.
 *
 * In co-simulation the state is that of a simulation. In model exchange the importer integrates y = (q, v, x), and the
 * simulation only computes outputs. An instance shares nothing with other instances.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_FMU_INSTANCE_H
#define KT_FMU_INSTANCE_H

#include "fmi3.h"
#include "reference.h"
#include "roles.h"
#include "signal.h"

#include "records/columns.h"

#include "kinetree/scene.h"
#include "scene/tune.h"

typedef enum kt_fmu_phase {
    KT_FMU_INSTANTIATED,
    KT_FMU_INITIALIZATION,
    KT_FMU_EVENT,      /* states may change */
    KT_FMU_CONTINUOUS, /* model exchange: the importer integrates */
    KT_FMU_STEP,       /* co-simulation */
    KT_FMU_TERMINATED,
    KT_FMU_UPDATE, /* the importer reads variables within a step of co-simulation; never in a state that is kept */
} kt_fmu_phase;

enum { KT_FMU_SETTING = 192 }; /* bytes of a setting "NAME=VALUE" */

/* Tunable parameters: variables of the scene (kt_scene_options). */
typedef struct kt_fmu_tunables {
    int count;
    int *parameter; /* [count]: the index among all parameters */
    char (*name)[KT_FMU_SETTING];
    const char **names;
    double *standard; /* values of the file, */
    double *compiled; /* values with which the scene was compiled, */
    double *values;   /* the present values, */
    double *wanted;   /* and values for the next compilation or kt_fmu_tune */
} kt_fmu_tunables;

/* An event in model exchange (event.c): its sign and value of before, and the number of its occurrences so far. */
typedef struct kt_fmu_event {
    double side, value, count;
    bool is_due;
} kt_fmu_event;

/* An input in the place of a function of time (signal.h). */
typedef struct kt_fmu_signal {
    kt_parameter parameter;
    int size;                                                    /* numbers that are variables */
    double start[KT_FMU_SIGNAL_MOST], value[KT_FMU_SIGNAL_MOST]; /* values of the variables */
    double set[KT_FMU_SIGNAL_MOST + 1];                          /* values that the model has */
    bool jumps;                                                  /* at the step that begins */
} kt_fmu_signal;

typedef struct kt_fmu_signals {
    int count;
    kt_fmu_signal *signal;
    kt_parameter_change *changes; /* [count] */
    bool are_set;                 /* the model has the present values */
} kt_fmu_signals;

typedef struct kt_fmu_linear kt_fmu_linear; /* derivatives.c */

typedef struct kt_fmu {
    /* The resource and settings. */
    char *scene_text;
    size_t scene_size;
    kt_fmu_token token;
    const char **settings; /* the settings of given parameters */
    char (*given_text)[KT_FMU_SETTING];
    kt_fmu_role *roles; /* [parameter_count] */
    kt_fmu_tunables tunables;
    kt_fmu_signals signals;

    /* The compiled scene. */
    kt_scene scene;
    kt_model *model;
    kt_simulation *simulation;
    kt_scene_watch *watch; /* NULL: no events */
    kt_tuning *tuning;     /* NULL: no parameter is tunable */
    kt_columns columns;
    kt_data *data; /* for model exchange */
    int nq, nv, nx, parameter_count;

    /* Inputs and state. */
    double *given; /* [parameter_count] */
    bool *is_given;
    double *torque;       /* [nv] */
    double *y;            /* [nq + nv + nx]: in model exchange the state of the importer */
    double *rates;        /* [nq + nv + nx]: derivatives of y */
    double *moved;        /* [nq + nv + nx]: the projected state */
    kt_fmu_event *events; /* [event_count] */
    int event_count;      /* 0 in co-simulation */
    double start, time;
    const double *values;  /* values of the columns; NULL: not evaluated in this state */
    kt_fmu_linear *linear; /* NULL: no derivatives were requested yet */
    bool is_exchange, is_stale, has_rates, has_jacobian, is_over;
    bool has_event_mode, returns_early; /* co-simulation: what the importer uses and allows */
    kt_fmu_phase phase;

    kt_fmi_log *log;
    kt_fmi_update *update; /* NULL: the importer needs no intermediate updates */
    void *environment;
} kt_fmu;

/* Reads the resource in a folder into *fmu, which is zero but for the importer's members, and computes its token.
 * Ownership: kt_fmu_close releases all members, also after an error. */
kt_status kt_fmu_open(kt_fmu *fmu, const char *folder, kt_error *error);
void kt_fmu_close(kt_fmu *fmu);

/* Compiles the scene for the first time, and allocates all memory of the instance. */
kt_status kt_fmu_start(kt_fmu *fmu, kt_error *error);

/* Compiles the scene again, with the given parameters, from the state of its start at the time fmu->start. On failure
 * the instance keeps its model, and remains stale. */
kt_status kt_fmu_compile(kt_fmu *fmu, kt_error *error);

static inline int kt_fmu_size(const kt_fmu *fmu) { return fmu->nq + fmu->nv + fmu->nx; }

/* Returns the state (q, v, x): of the importer, or of the simulation. */
static inline const double *kt_fmu_state(const kt_fmu *fmu) {
    return fmu->is_exchange ? fmu->y : kt_simulation_positions(fmu->simulation);
}

/* Computes the derivatives of the state into fmu->rates, and the columns into fmu->values, unless they are there. */
kt_status kt_fmu_derive(kt_fmu *fmu, kt_error *error);
kt_status kt_fmu_evaluate(kt_fmu *fmu, kt_error *error);

/* Marks that inputs, time or state have changed. */
static inline void kt_fmu_change(kt_fmu *fmu) {
    fmu->values = NULL;
    fmu->has_rates = fmu->has_jacobian = false;
    if (fmu->is_exchange)
        fmu->signals.are_set = false;
}

/* Lets the simulation take over the state of the importer. */
kt_status kt_fmu_take_over(kt_fmu *fmu, kt_error *error);

/* Allocates the events of the simulation; and begins anew, without sides and occurrences. */
kt_status kt_fmu_take_events(kt_fmu *fmu, kt_error *error);
void kt_fmu_forget_events(kt_fmu *fmu);

/* Takes a step of co-simulation. The step ends early at an event, or at the importer's request, if the importer allows
 * that. *needs_event: events are due at its end, which take effect in event mode. *early: the end is not that of the
 * step. Errors: those of kt_simulation_step. */
kt_status kt_fmu_advance(kt_fmu *fmu, double step, bool *needs_event, bool *early, kt_error *error);

/* Applies the events that are due in the simulation. Errors: those of formulas and of actions. */
kt_status kt_fmu_fire(kt_fmu *fmu, kt_error *error);

/* Computes the value of event k in the present state; 1 if it cannot happen again. Errors: those of its formula. */
kt_status kt_fmu_indicate(kt_fmu *fmu, int k, double *value, kt_error *error);

/* Applies the events that are due in the importer's state. Sets *applied if there are any, and *stops if one ends the
 * run. Errors: those of formulas and of actions. */
kt_status kt_fmu_apply_events(kt_fmu *fmu, bool *applied, bool *stops, kt_error *error);

/* Returns the first breakpoint of an event's value, as a function of time, after t. */
double kt_fmu_next_breakpoint(const kt_fmu *fmu, double t);

/* Projects the state of the importer onto the loops and quaternions into fmu->moved. Sets *moves if a number
 * changes by more than 1e-10 of its size or of unity. */
kt_status kt_fmu_project(kt_fmu *fmu, bool *moves, kt_error *error);

/* A direction in (y, u, w) for derivatives, for the caller to fill: y = (q, v, x), u = torque, and w the numbers of the
 * signals. A new direction is zero. The first call of kt_fmu_direction_make allocates the memory of derivatives.
 * Errors: KT_ERROR_MEMORY. */
typedef struct kt_fmu_direction {
    double *y, *u, *w;
} kt_fmu_direction;

kt_status kt_fmu_direction_make(kt_fmu *fmu, kt_fmu_direction *along, kt_error *error);

/* Computes the derivatives of all rates along the direction that was filled last: kt_fmu_size numbers.
 * Errors: those of kt_acceleration_derivatives. */
kt_status kt_fmu_rates_along(kt_fmu *fmu, const double **rates, kt_error *error);

/* Computes the derivatives of all columns, after kt_fmu_rates_along. Columns of coordinates are exact in mechanisms
 * without loops. Others are differences of order eight of the columns themselves. In co-simulation only derivatives by
 * u and w exist. Errors: those of kt_fmu_evaluate. KT_ERROR_UNSUPPORTED for a direction in y in co-simulation. */
kt_status kt_fmu_columns_along(kt_fmu *fmu, const double **columns, kt_error *error);

void kt_fmu_linear_free(kt_fmu_linear *linear);

/* Finds the tunable parameters of the scene that was read, before it is compiled. Errors: KT_ERROR_MEMORY. */
kt_status kt_fmu_find_tunables(kt_fmu *fmu, kt_error *error);
void kt_fmu_free_tunables(kt_fmu *fmu);

/* Returns the tunable parameter that is the i-th of all; -1: it is not tunable. */
int kt_fmu_tunable_at(const kt_fmu *fmu, int i);

/* Copies the values of all tunable parameters. */
void kt_fmu_copy_tunables(const kt_fmu *fmu, const double *from, double *to);

/* Gives the tunable parameters the values fmu->tunables.wanted: in a simulation that goes on, or before its state is
 * set. In model exchange the next update of discrete states projects the state onto the loops (kt_fmu_project).
 * Errors: those of kt_tuning_set; nothing is changed then. */
kt_status kt_fmu_tune(kt_fmu *fmu, bool jumps, kt_error *error);

/* Counts the signals of the resource and allocates their memory. Errors: KT_ERROR_MEMORY. */
kt_status kt_fmu_list_signals(kt_fmu *fmu, kt_error *error);
void kt_fmu_free_signals(kt_fmu *fmu);

/* Binds the signals to a model that was compiled just now, which has their values from the time t on. The first call
 * takes the values of the start from the scene. Errors: those of kt_parameter_find and kt_parameter_set. */
kt_status kt_fmu_bind_signals(kt_fmu *fmu, double t, kt_error *error);

/* Gives all signals their values of the start. */
void kt_fmu_reset_signals(kt_fmu *fmu);

/* Gives the model the values of the signals at the present time, unless it has them (signals.are_set). In co-simulation
 * signals that jump change the state, too. kt_fmu_show_signals does so before outputs are read; in event mode of
 * co-simulation the events that are due come first. Errors: those of kt_simulation_change. */
kt_status kt_fmu_take_signals(kt_fmu *fmu, kt_error *error);
kt_status kt_fmu_show_signals(kt_fmu *fmu, kt_error *error);

/* Returns the i-th number of all signals, KT_FMU_SIGNAL_MOST for each; NULL: it is no variable. */
double *kt_fmu_signal_at(const kt_fmu *fmu, int i);

/* Whether this number moves the state of co-simulation, since loops close again. */
bool kt_fmu_signal_moves(const kt_fmu *fmu, int i);

/* Moves the signals in the model by a distance along a direction, without a change of state or variables. A distance of
 * 0 takes this back. */
kt_status kt_fmu_shift_signals(kt_fmu *fmu, double distance, const double *along, kt_error *error);

/* The signals in a block (block.c): how many numbers they take; writing them, which returns the end; reading them. */
size_t kt_fmu_signal_numbers(const kt_fmu *fmu);
double *kt_fmu_save_signals(const kt_fmu *fmu, double *to);
kt_status kt_fmu_restore_signals(kt_fmu *fmu, const double *from, kt_error *error);

/* Writes the sum of a block (block.c). */
void kt_fmu_seal(void *block, size_t size);

/* Sends a message to the importer. Both return a status of FMI. */
KT_PRINTF(2, 3) kt_fmi_status kt_fmu_report(kt_fmu *fmu, const char *format, ...);
kt_fmi_status kt_fmu_report_status(kt_fmu *fmu, kt_status status, const kt_error *error);

/* Rejects a list of variables that these FMUs do not have, with the reason; an empty list is fine. */
static inline kt_fmi_status kt_fmu_reject_list(void *instance, size_t count, const char *reason) {
    return count == 0 ? KT_FMI_OK : kt_fmu_report(instance, "%s", reason);
}

/* Begins a function of FMI with its instance. Importers go on with NULL if the instantiation failed. */
#define KT_FMU_TAKE(instance)                                                                                          \
    kt_fmu *fmu = instance;                                                                                            \
    if (fmu == NULL)                                                                                                   \
    return KT_FMI_ERROR

/* Returns an error of FMI after a message, unless a condition holds. */
#define KT_FMU_REQUIRE(condition, ...)                                                                                 \
    if (!(condition))                                                                                                  \
    return kt_fmu_report(fmu, __VA_ARGS__)

#define KT_FMU_REQUIRE_NO_UPDATE KT_FMU_REQUIRE(fmu->phase != KT_FMU_UPDATE, "intermediate updates only read variables")

/* Compiles the scene again if parameters were given. */
kt_fmi_status kt_fmu_settle(kt_fmu *fmu);

/* Sets the time of the start, before the initialization. */
kt_fmi_status kt_fmu_set_start(kt_fmu *fmu, double start);

#endif
