/* Structs of a simulation that both its core and several parts use: the results that data hold, breakpoints, events,
 * records, and the work done. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_STEP_SIMULATION_PARTS_H
#define KT_STEP_SIMULATION_PARTS_H

#include "step/phases.h"
#include "step/simulation_memory.h"

/* The struct of a part, in its file. */
struct kt_work_panel;

/* The search for roots of an event along a step. */
typedef struct kt_event_search {
    int side;          /* the sign of its value at the beginning of the next panel; 0: not available */
    int spent;         /* the number of its values that the step has taken */
    double size;       /* the largest |value| so far */
    double breakpoint; /* the next breakpoint; NaN: not available */
} kt_event_search;

/* The number of stored values of an event: five along a panel, and the value at the beginning of the step. */
enum { KT_EVENT_VALUES = 6 };

/* The results of the present state that data hold, so that a second computation is not necessary. */
typedef enum kt_cached {
    KT_CACHED_NOTHING = 0,
    KT_CACHED_POSES,      /* the poses, from the projection or from kinematics */
    KT_CACHED_EVALUATION, /* all results of the evaluation that gave `slope`, if it is the slope of the present state */
} kt_cached;

/* Breakpoints of functions of time and of a caller's own forces (breakpoint.c): the next breakpoints, in s. */
typedef struct kt_breakpoints {
    bool any;             /* steps end at breakpoints */
    bool fixed;           /* breakpoints exist, and steps are fixed: they end at jumps of velocities only */
    double from, next;    /* no breakpoint lies between these times */
    bool jumps, cut;      /* at `next`: the accelerations jump; the search of features reached its limit */
    bool strikes, struck; /* at `next`, at `from`: a velocity or a position that a loop prescribes jumps */
    bool passing;         /* jumps of the state at `from` are a part of passing it: nothing is searched anew */
    double begin, after;  /* a step that begins at a jump: its first slope is the slope at the time `after` */
    double end, before;   /* a step that ends at a jump: its last slope is the slope at the time `before` */
} kt_breakpoints;

/* The source of the first events, which are the events of hard contacts: the search of events queries it. */
typedef struct kt_event_source {
    /* At this instant, at which event k happens, applies all instants of a time that no step resolves, since they
     * accumulate. A contact without a rest velocity has no last one. Returns whether the source has done so. */
    bool (*rest)(kt_simulation *simulation, size_t k, double window);
    /* Whether slip of contact k has come to rest up to its rest velocity, with this value of its event. */
    bool (*ends)(const kt_simulation *simulation, size_t k, double value);
    /* The depth to which contact k may penetrate while it is open, m or rad. For friction that slips, the rate at which
     * it may turn back, m/s or rad/s. Otherwise 0. */
    double (*margin)(const kt_simulation *simulation, size_t k);
    /* A number b so that g (g + b) is smooth along the motion, for the gap g of an open contact; 0: g itself is. */
    double (*kink)(const kt_simulation *simulation, size_t k);
} kt_event_source;

/* Every array of events: type, name, count, meaning. At most n events. */
#define KT_EVENT_FIELDS(X)                                                                                             \
    X(kt_event, list, n, "in the order in which they were added")                                                      \
    X(kt_event_search, search, n, "scratch")                                                                           \
    X(double, value, KT_EVENT_VALUES *n, "at `time`, and along a panel of the last step")

/* Events (event.c). The persistent state of events is event_memory and event_root. */
typedef struct kt_events {
    size_t count;
    size_t latest;                 /* the event of the last instant, or at which a step was repeated; count: none */
    size_t aim;                    /* the event at which the last try was to end and did not; count: none */
    bool fires;                    /* an event happens at the end of the last try */
    bool searched;                 /* events of this step have been searched */
    const kt_event_source *source; /* source of the events of hard contacts */
    double end;                    /* s, the end of the first try of this step */
    int evaluations;               /* the most values of an event that the search of a step takes */
    int most;                      /* the number of values with which the search after this try ends */
    uint64_t cut;                  /* searches of features of events in this try that reached their limit */
    double time;                   /* s, of the values; NaN: not available */
    double lead;                   /* s, the earliest time to which the slope of an event leads that was not reached */
    double reach;                  /* s, the end of the searched part of the last step */
    double rate, rate_end;         /* the largest rate of a turn at `time` and at the end of the step, rad/s */
    KT_ARENA_DECLARE(KT_EVENT_FIELDS)
} kt_events;

/* Records: when they are due, and the quantities that they hold. */
typedef struct kt_record_plan {
    double interval; /* s */
    int64_t count;
    unsigned bits;         /* KT_RECORD_ bits to compute */
    bool kinematics;       /* a record's data are updated */
    bool places;           /* for quantities other than energies */
    uint64_t progress_due; /* the number of steps to the next call of options.progress */
} kt_record_plan;

/* The estimate of the work done from powers at the ends of steps (work_watch.c), and the panel of a balance with
 * adaptive steps (balance.c). */
typedef struct kt_works {
    bool watches;            /* works are estimated at the ends of steps */
    const double *end_slope; /* slope of the evaluation that gave end_power; NULL: none in this step */
    kt_power end_power;      /* power of the evaluation that may become that of the end */
    struct kt_work_panel *panel;
} kt_works;

#endif
