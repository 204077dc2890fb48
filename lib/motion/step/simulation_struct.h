/* The struct of a simulation, for contact/ and simulation/. The state is y = (q, v, x), followed by the supplied and
 * the dissipated work if a balance is computed. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_STEP_SIMULATION_STRUCT_H
#define KT_STEP_SIMULATION_STRUCT_H

#include "base/arena.h"
#include "kinetree/equations.h"
#include "kinetree/integrator.h"
#include "kinetree/simulation.h"
#include "kinetree/stability.h"
#include "model/model.h"
#include "model/switching.h"
#include "step/phases.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

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
    uint64_t released;    /* contacts that do not act, as bits of the set; for friction of joints both switches */
    uint64_t held;        /* friction that slips in joints that contacts or loops hold, as bits of the set */
    int64_t jumped;       /* forces have jumped since closed contacts were checked last */
    double retried_since; /* s, from where tries that are shortened within one fixed step are counted */
    uint64_t retries;     /* their number */
    double own_time;      /* s, in which the mechanism moves by its own size (contact/own_time.c); 0: not known */
    double shortened;     /* s, the most length of the next step, behind one that failed or missed its event; 0: none */
    int64_t beyond, fires; /* a contact is beyond its boundary since the start; events have not taken effect yet */
} kt_simulation_memory;

/* The memory of a hard contact, or of friction that sticks, in the order of contact.c. */
typedef struct kt_contact_memory {
    double slip[2];        /* for a contact: the direction in which it slips */
    double speed, left_at; /* speed of slip at the beginning of the last step, m/s; s, when the contact left last */
    double closes_at;      /* the gap at which an open contact closes, or the slip that is rest; <= 0 */
    double opens_at;       /* the reaction at which a closed contact opens, N or N m; <= 0, below 0 if it grazes */
    double since, fastest; /* fixed steps: s, from where reversals are counted; the largest speed of slip since */
    double stops_below;    /* slip that is no faster comes to rest at this instant, m/s; else 0 */
    double load, response; /* for slip: the normal force, N; by how much it changes slip by friction, 1/kg */
    double held;           /* s, until when it stays closed whatever its reaction */
    uint64_t reversals;    /* reversals of slip within the length of a fixed step */
    uint64_t turns, left;  /* how often its slow slip has turned or shrunk; how often it left in the instant */
    double force[3];       /* time stepping: impulses of the last step over its length, normal and tangential; of dry
                              friction in joints, the dry and the viscous force */
    int64_t closed;        /* the contact is closed, or sticks, in the model that the simulation runs on */
    int64_t counted;       /* the contact is closed, or sticks, according to the counts of contacts */
    int64_t shared;        /* the contact rests, and forces of its island are not unique (cone/rest.h) */
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

/* The number of models of sets of contacts that a simulation has room for (contact/model.c). */
enum { KT_CONTACT_MASKS = 3 };

/* The structs of parts, in their files. */
struct kt_contacts;
struct kt_gaps;
struct kt_moreau;
struct kt_newton_matrices;
struct kt_work_panel;

#define KT_SIMULATION_CONTACTS(X)                                                                                      \
    X(char, contact_memory, size->contact, "hard contacts")                                                            \
    X(char, moreau_memory, size->moreau, "of time stepping")                                                           \
    X(char, mask_memory, KT_CONTACT_MASKS * size->mask, "models of sets of contacts between none and all")             \
    X(char, undo, size->undo, "scratch: all that a change of the state writes, as it was before (jump.c)")

#define KT_SIMULATION_STATICS(X)                                                                                       \
    X(double, balanced, size->balanced, "quasi-statics: the state of an evaluation, its forces balanced")

/* The persistent state of all parts, which determines the continuation of the run together with the integrator. These
 * arrays follow `memory`, the last member of the struct, without other data in between. Checkpoints and undone changes
 * copy this block as a whole. */
#define KT_SIMULATION_STATE(X)                                                                                         \
    X(double, torque, size->user_nv, "held during the last step")                                                      \
    X(double, torque_next, size->user_nv, "to be held from the next step on")                                          \
    X(kt_wrench, wrench, size->body, "held during the last step")                                                      \
    X(kt_wrench, wrench_next, size->body, "to be held from the next step on")                                          \
    X(double, state, size->state, "q, v and x of the user model at the current time")                                  \
    X(double, ranks, size->ranks / sizeof(double), "of the present model, if that is a mask; else zeros")              \
    X(kt_contact_memory, contact_state, size->contacts, "of hard contacts")                                            \
    X(kt_event_memory, event_memory, size->event, "of events")                                                         \
    X(kt_event_root, event_root, size->event, "of events in the last step")

/* Every array of a simulation: type, name, count, meaning. One list declares, measures and places. */
#define KT_SIMULATION_FIELDS(X)                                                                                        \
    KT_SIMULATION_STATE(X)                                                                                             \
    X(double, y, size->n, "state of a record, and scratch")                                                            \
    X(double, a, size->nv, "acceleration of a record")                                                                 \
    X(double, rate, size->rate, "velocities that positions follow, of the caller's right-hand side")                   \
    X(kt_wrench, reaction, size->reaction, "of a record, in joints")                                                   \
    X(kt_wrench, loop_reaction, size->loop_reaction, "of a record, in loops")                                          \
    X(double, multiplier, size->multiplier, "of a record, of all equations")                                           \
    X(double, shown, size->shown, "transformed: q, v and a of the user model, of a record")                            \
    X(kt_wrench, body_wrench, size->body_wrench, "transformed: on the bodies of the model")                            \
    X(kt_wrench, free_reaction, size->free_reaction, "transformed: of a record, in all loops of the model")            \
    X(char, user_memory, size->user_data, "transformed: the user model's data")                                        \
    X(int, quaternion, size->quaternion, "where in q each quaternion begins")                                          \
    KT_SIMULATION_STATICS(X)                                                                                           \
    KT_SIMULATION_CONTACTS(X)                                                                                          \
    X(char, part_memory, size->parts, "the parts' own")                                                                \
    X(char, data_memory, size->data, "the model's data")                                                               \
    X(char, integrator_memory, size->integrator, "the integrator")

struct kt_simulation_sizes {
    size_t nq, nv;
    size_t x;    /* auxiliary states */
    size_t work; /* index in y of the work done, dissipated and supplied: nq + nv + x, or 1 if that is 0 */
    size_t n;    /* equations of the integrator: work, or work + 2 if a balance is computed: */
    bool integrates_works;
    size_t history; /* numbers of the integrator that are part of a checkpoint */
    size_t user_nq, user_nv;
    size_t gap;               /* effects that act on one side of a boundary */
    size_t event;             /* the most events, including hard contacts */
    size_t contact, contacts; /* bytes of hard contacts, 0 without; their number */
    size_t moreau;            /* bytes of time stepping; 0 without */
    size_t undo;              /* bytes of `undo`; 0 without */
    size_t mask;              /* bytes of a mask, then of its ranks; 0: each set of contacts has a compiled model */
    size_t ranks;
    size_t balanced; /* n if coordinates move no mass, so that their forces are balanced in every state; else 0 */
    size_t body, reaction, loop_reaction, multiplier, quaternion, data, integrator;
    size_t parts; /* bytes of the parts' own memory */
    size_t panel; /* 1 if a balance is computed with adaptive steps, else 0 */
    size_t free, states, basis, along, turning, vectors, stiffness_work; /* 0 except with an implicit method */
    bool reduced;        /* implicit method: its matrices act on the velocities that the loops leave free */
    bool all_directions; /* implicit method: its Jacobian is exact across the loops, too */
    size_t rate;         /* 0 without a right-hand side of the caller's */
    size_t state;        /* user_nq + user_nv + x */
    size_t shown, body_wrench, free_reaction, user_data; /* 0 without a transformation */
};

/* The source of the first events, which are the events of hard contacts: the search of events queries it. */
typedef struct kt_event_source {
    /* At this instant, at which event k happens, applies all instants of a time that no step resolves, since they
     * accumulate. A contact without a rest velocity has no last one. Returns whether the source has done so. */
    bool (*rest)(kt_simulation *simulation, size_t k, double window);
    /* Whether an open contact touches within rounding that is not due. */
    bool (*crowds)(const kt_simulation *simulation);
    /* Whether slip of contact k has come to rest up to its rest velocity, with this value of its event. */
    bool (*ends)(const kt_simulation *simulation, size_t k, double value);
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

struct kt_simulation {
    void *owned; /* memory of kt_simulation_create, or NULL */
    kt_simulation_sizes size;
    const kt_model *model;      /* the model that is integrated: the user model, or that of the transformation */
    const kt_model *user_model; /* in whose coordinates inputs and outputs are expressed */
    const kt_transformation *transformation; /* from one to the other, or NULL */
    kt_data *data, *user_data;               /* scratch; identical if the models are identical */
    kt_integrator *integrator;
    const kt_part *const *parts;   /* all parts, in their order; */
    size_t part_count;             /* their number */
    kt_phases phases;              /* the hooks of the active parts */
    kt_method method;              /* the method of the run, if it is given by rho */
    const double *tau;             /* inputs of the last step: nv, or NULL */
    const kt_wrench *external;     /* one for each body, or NULL */
    int groups;                    /* number of groups of loops */
    kt_simulation_options options; /* options as the caller gave them */
    size_t changed_contact;        /* 1 + the last contact that closed, opened, stuck or slipped; 0: none */
    bool near_singular;            /* the last step computed accelerations next to a singular position */
    bool takes_inputs;             /* inputs or a parameter have been set */
    bool closes_loops;             /* a projection does more than renormalise quaternions: it overwrites data */
    kt_breakpoints breakpoints;
    kt_events events;
    kt_record_plan records;
    kt_works works;
    struct kt_newton_matrices *newton; /* matrices of an implicit method; NULL: none */
    bool watches_ends;      /* adaptive steps do not leap over changes of functions of time behind their last stage */
    bool lacks_end_stage;   /* the method has no stage at the end of its steps */
    bool lacks_inner_stage; /* the method has no stage between the ends of its steps */
    struct kt_gaps *gaps;   /* contacts and stops that a step may leap over (gap.h); NULL: there are none */
    size_t contact_count;   /* the number of hard contacts, which are the first events */
    struct kt_contacts *contacts; /* NULL: there are none */
    bool steps_over_contacts;     /* contacts are resolved by time stepping: */
    struct kt_moreau *moreau;     /* time stepping over contacts (moreau.h); NULL: they are events */
    uint64_t contact_mask;        /* the switches of hard contacts */
    uint64_t contact_friction;    /* switches of joint friction; with both switches of a joint on, it is released */
    uint64_t contact_released;    /* the contacts that are released at first */
    double contact_margin;        /* the depth at which a contact penetrates that was left open, m or rad */
    double contact_time;          /* s, of the values of contacts; NaN: not available */
    double slow_slip; /* the largest slip of hard contacts of which the direction is predicted, m/s; 0: no contacts */
    double step;      /* fixed, or 0 */
    double duration;
    kt_cached cached;    /* the results of the present state that data hold */
    const double *slope; /* y' as the last evaluation returned it to the integrator */
    kt_error cause;      /* error of the last callback that failed; code KT_OK: none failed in this step */
    bool ahead;          /* the callback failed after the present state, so that a smaller step may help */
    const char *within;  /* the caller's function that a call with this simulation runs, and which may not move it in
                          * time; NULL: none */
    KT_ARENA_DECLARE(KT_SIMULATION_FIELDS)
    kt_simulation_memory memory; /* the last member: here the block of the persistent state begins */
};

/* The block of the persistent state, and its bytes. */
static inline char *kt_simulation_block(const kt_simulation *simulation) {
    return (char *)simulation + offsetof(kt_simulation, memory);
}
static inline size_t kt_simulation_block_size(const kt_simulation_sizes *size) {
    size_t used = kt_arena_round(sizeof(kt_simulation)) - offsetof(kt_simulation, memory);
    KT_SIMULATION_STATE(KT_ARENA_MEASURE)
    return used;
}

/* Times that are as near as this are one instant, s: rounding of positions hides their order. */
static inline double kt_simulation_instant(const kt_simulation *simulation) {
    return 3e-12 * simulation->memory.own_time;
}

/* The depth to which an open hard contact may penetrate, m or rad. */
static inline double kt_simulation_contact_margin(const kt_simulation *simulation) {
    return simulation->contact_margin;
}

/* Records that forces have jumped at the present time, so that reactions differ from the reactions at the end of the
 * last step. The beginning of the next step then checks whether contacts stay closed (event.c). */
static inline void kt_simulation_note_jump(kt_simulation *simulation) {
    if (simulation->contact_count == 0)
        return;
    simulation->memory.jumped = true;
    simulation->events.time = simulation->contact_time = (double)NAN;
}
static inline void kt_simulation_clear_jump(kt_simulation *simulation) { simulation->memory.jumped = false; }
static inline bool kt_simulation_has_jumped(const kt_simulation *simulation) { return simulation->memory.jumped != 0; }

/* The number of hard contacts, which are the first events. */
static inline size_t kt_simulation_contact_events(const kt_simulation *simulation) { return simulation->contact_count; }

/* The work done in a state y; NaN if the work is not computed. */
static inline kt_work kt_simulation_work_of(const kt_simulation *simulation, const double *y) {
    kt_work none = {(double)NAN, (double)NAN};
    if (!simulation->size.integrates_works)
        return none;
    kt_work work = {y[simulation->size.work], y[simulation->size.work + 1]};
    return work;
}

/* Lets evaluations with the simulation's data use the auxiliary states of y. */
static inline void kt_simulation_use_states(const kt_simulation *simulation, const double *y) {
    if (simulation->size.x > 0)
        memcpy(simulation->data->x, y + simulation->size.nq + simulation->size.nv, simulation->size.x * sizeof(double));
}

/* The time at which forces at t are evaluated, if steps end at breakpoints. At a breakpoint that ends or begins a step,
 * the time is the limit from inside the step. */
static inline double kt_simulation_time_inside(const kt_simulation *simulation, double t) {
    const kt_breakpoints *c = &simulation->breakpoints;
    return t == c->end ? c->before : t == c->begin ? c->after : t;
}

#endif
