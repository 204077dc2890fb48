/* The persistent state of a simulation: the values that determine the continuation of a run. A checkpoint has these
 * values and the values of the integrator. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_STEP_SIMULATION_MEMORY_H
#define KT_STEP_SIMULATION_MEMORY_H

#include "kinetree/integrator.h"
#include "kinetree/simulation.h"
#include "kinetree/stability.h"
#include "model/model.h"

/* The inputs of a step: torques in joints, wrenches on bodies. */
typedef struct kt_input_flags {
    bool torque, wrenches; /* whether there are any */
} kt_input_flags;

/* The projection's changes of velocities since the start (kt_velocity_correction). */
typedef struct kt_corrections {
    double most, time, fastest; /* 1/s, s, 1/s */
    int64_t v;                  /* the velocity with `most` */
} kt_corrections;

/* Powers at the ends of the last steps, and the work done that follows from these powers (power_points.c,
 * work_watch.c). */
enum { KT_POWER_POINTS = 4 };
typedef struct kt_power_points {
    int count;                 /* the number of points; the last one comes first */
    double t[KT_POWER_POINTS]; /* s */
    double d[KT_POWER_POINTS]; /* divided differences of the net power; the first is that at the last point, W */
    double before, size;       /* net power at the last but one; |dissipated| + |supplied| at the last, W */
    kt_work_estimate sum[2];   /* up to the last but one, and to the last */
} kt_power_points;

/* All values that determine the continuation of the run, except the values of the integrator. A checkpoint contains
 * these values. */
typedef struct kt_simulation_memory {
    int64_t next_record; /* the first that has not been handed over */
    int64_t recorded;    /* the number of records, events included, that have been handed over */
    kt_input_flags now;  /* the inputs of the step that ended at the current time */
    kt_input_flags next; /* the inputs of the next step */
    bool pending;        /* `next` or a parameter was set since the last step */
    bool changed;        /* a parameter was set */
    bool refined;        /* balance.c has integrated the powers of the last step */
    uint64_t balance_evaluations;
    uint64_t joined;        /* states within steps that do not come from the dense output (dense.c) */
    uint64_t cut;           /* searches of features that reached their limit */
    double piece;           /* s, from where the breakpoint after the last step was sought; NaN: not available */
    int64_t sought, before; /* operations of all searches of features; and before the search from `piece` */
    uint64_t factorizations;
    kt_iterations iterations;
    kt_crossings crossings;
    kt_corrections corrections;
    kt_power_points powers;
    double event_last;        /* s, the last instant of events */
    double event_interval;    /* s, from the instant before to the last one */
    double event_chain;       /* s, the instant from which intervals shrink */
    uint64_t event_instants;  /* number of instants of events so far */
    uint64_t event_shrinking; /* the number of last instants whose intervals shrank */
    double event_ratio;       /* the largest ratio of these intervals to the intervals before them */
    uint64_t event_row;       /* the number of last instants that followed each other at once */
    int64_t stopped;          /* the event that ended the last call, from 1; 0: none did */
    uint64_t set;             /* switched loops and effects that are on */
    double event_since;       /* s, from where instants within one fixed step, or one interval, are counted */
    uint64_t event_many;      /* the number of these instants */
    uint64_t event_missed;    /* the number of last steps that were to end at an event and did not reach it */
    uint64_t breakpoints;     /* breakpoints at which steps ended */
    uint64_t event_cuts;      /* searches of events that reached their limit; the first one: */
    double event_cut_time;    /* s, the beginning of its step */
    int64_t event_cut_of;     /* event of the first search that was cut */
    kt_contact_counts contacts;
    kt_contact_excess excess;
    kt_completed_steps completed;
    uint64_t released;    /* contacts that do not act, as bits of the set; for friction of joints both switches */
    uint64_t held;        /* friction that slips in joints that contacts or loops hold, as bits of the set */
    int64_t jumped;       /* forces have jumped since closed contacts were checked last */
    double retried_since; /* s, from where tries that are shortened within one fixed step are counted */
    uint64_t retries;     /* their number */
    double own_time;      /* s, in which the mechanism moves by its own size (contact/own_time.c); 0: not known */
    double slip_noise;    /* m/s, by which rounding of the time of contacts' last decision puts slip off, likewise */
    double shortened;     /* s, the most length of the next step, behind one that failed or missed its event; 0: none */
    int64_t leaps;        /* contacts are resolved by time steps at present (contact/bounded_step.c) */
    int64_t step_grid;    /* the point of the grid at which the present step began, and */
    uint64_t step_begun;  /* the evaluations before it (step_evaluations) */
    double part_since;    /* s, the instant from which evaluations of a part of a step count, and */
    uint64_t part_begun;  /* the evaluations before it (stall_evaluations) */
    int64_t beyond, fires; /* a contact is beyond its boundary since the start; events have not taken effect yet */
} kt_simulation_memory;

/* The memory of a hard contact, or of friction that sticks, in the order of contact.c. */
typedef struct kt_contact_memory {
    double slip[2];        /* for a contact: the direction in which it slips */
    double speed, left_at; /* speed of slip at the beginning of the last step, m/s; s, when the contact left last */
    double closes_at;      /* the gap at which an open contact closes, or the slip that is rest, <= 0 */
    double parts_at;       /* the gap up to which an open contact that touches has not parted, >= closes_at */
    double opens_at;       /* the reaction at which a closed contact opens, N or N m; <= 0, below 0 if it grazes */
    double since, fastest; /* fixed steps: s, from where reversals are counted; the largest speed of slip since */
    double stops_below;    /* slip that is no faster comes to rest at this instant, m/s; else 0 */
    double load, response; /* for slip: the normal force, N; by how much it changes slip by friction, 1/kg */
    int64_t block;         /* contacts that slip act on each other if this number is the same (friction.c) */
    double held;           /* s, until when it stays closed whatever its reaction */
    uint64_t reversals;    /* reversals of slip within the length of a fixed step */
    uint64_t turns, left;  /* how often its slow slip has turned or shrunk; how often it left in the instant */
    double force[3];       /* time stepping: impulses of the last step over its length, normal and tangential; of dry
                              friction in joints, the dry and the viscous force */
    int64_t closed;        /* the contact is closed, or sticks, in the model that the simulation runs on */
    int64_t counted;       /* the contact is closed, or sticks, according to the counts of contacts */
    int64_t shared;        /* the contact rests, and forces of its island are not unique (cone/statics.h) */
    double metric;         /* the mean of the diagonal of its block of W */
} kt_contact_memory;

/* The memory of an event. */
typedef struct kt_event_memory {
    int64_t side;      /* the last sign of its value; 0: not available */
    uint64_t count;    /* how often it has happened */
    double size;       /* the largest |value| along the last step */
    double breakpoint; /* first breakpoint of the value after the beginning of an earlier step; NaN: not available */
    int64_t off;       /* switched off by the caller */
} kt_event_memory;

/* A root of an event in the last step. */
typedef struct kt_event_root {
    int64_t due;      /* a root was found, and the event takes effect at the end of the step */
    int64_t recorded; /* the event's record has been handed over */
    int64_t side;     /* the sign of the value behind it */
    double time;      /* s */
} kt_event_root;

#endif
