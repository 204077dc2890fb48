/* The struct of a simulation: its arrays, their sizes, and the struct itself. simulation_memory.h has the persistent
 * state, and simulation_parts.h has the structs of events, records, breakpoints and work done.
 *
 * The state is y = (q, v, x), followed by the supplied and the dissipated work if a balance is computed. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_STEP_SIMULATION_STRUCT_H
#define KT_STEP_SIMULATION_STRUCT_H

#include "base/arena.h"
#include "model/switching.h"
#include "step/phases.h"
#include "step/simulation_parts.h"

#include <float.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

/* The number of models of sets of contacts that a simulation has room for (contact/model.c). */
enum { KT_CONTACT_MASKS = 3 };

/* The structs of parts, in their files. */
struct kt_contacts;
struct kt_gaps;
struct kt_moreau;
struct kt_newton_matrices;

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
    X(double, torque, size->nv, "held during the last step")                                                           \
    X(double, torque_next, size->nv, "to be held from the next step on")                                               \
    X(kt_wrench, wrench, size->body, "held during the last step")                                                      \
    X(kt_wrench, wrench_next, size->body, "to be held from the next step on")                                          \
    X(double, state, size->state, "q, v and x at the current time, at an address that does not change")                \
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
    X(kt_curve, curve, size->curve, "functions of time of the model before a change")                                  \
    X(int, quaternion, size->quaternion, "where in q each quaternion begins")                                          \
    KT_SIMULATION_STATICS(X)                                                                                           \
    KT_SIMULATION_CONTACTS(X)                                                                                          \
    X(char, part_memory, size->parts, "the parts' own")                                                                \
    X(char, data_memory, size->data, "the model's data")                                                               \
    X(char, integrator_memory, size->integrator, "the integrator")

struct kt_simulation_sizes {
    size_t nq, nv; /* positions, velocities */
    size_t x;      /* auxiliary states */
    size_t work;   /* index in y of the work done, dissipated and supplied: nq + nv + x, or 1 if that is 0 */
    size_t n;      /* equations of the integrator: work, or work + 2 if a balance is computed: */
    bool integrates_works;
    size_t history;           /* numbers of the integrator that are part of a checkpoint */
    size_t gap;               /* effects that act on one side of a boundary */
    size_t event;             /* the most events, including hard contacts */
    size_t contact, contacts; /* bytes of hard contacts, 0 without; their number */
    size_t moreau;            /* bytes of time stepping; 0 without */
    size_t undo;              /* bytes of `undo`; 0 without */
    size_t mask;              /* bytes of a mask, then of its ranks; 0: each set of contacts has a compiled model */
    size_t ranks;
    size_t balanced; /* n if coordinates move no mass, so that their forces are balanced in every state; else 0 */
    size_t body, reaction, loop_reaction, multiplier, quaternion, data, integrator;
    size_t curve; /* functions of time of the model */
    size_t parts; /* bytes of the parts' own memory */
    size_t panel; /* 1 if a balance is computed with adaptive steps, else 0 */
    size_t free, states, basis, along, turning, vectors, stiffness_work; /* 0 except with an implicit method */
    bool reduced;        /* implicit method: its matrices act on the velocities that the loops leave free */
    bool all_directions; /* implicit method: its Jacobian is exact across the loops, too */
    bool exact;          /* likewise, also without loops */
    size_t rate;         /* 0 without a right-hand side of the caller's */
    size_t state;        /* nq + nv + x */
};

struct kt_simulation {
    /* A simulation is a model, data, an integrator, a state (below), and parts. */
    void *owned; /* memory of kt_simulation_create, or NULL */
    kt_simulation_sizes size;
    const kt_model *model;
    kt_data *data; /* scratch */
    kt_integrator *integrator;
    const kt_part *const *parts; /* all parts, in their order; */
    size_t part_count;           /* their number */
    kt_phases phases;            /* the hooks of the active parts */
    /* Options and inputs. */
    kt_method method;              /* the method of the run, if it is given by rho */
    const double *tau;             /* inputs of the last step: nv, or NULL */
    const kt_wrench *external;     /* one for each body, or NULL */
    int groups;                    /* number of groups of loops */
    kt_simulation_options options; /* options as the caller gave them */
    /* Facts about the model, and about the last step. */
    size_t changed_contact; /* 1 + the last contact that closed, opened, stuck or slipped; 0: none */
    bool near_singular;     /* the last step computed accelerations next to a singular position */
    bool takes_inputs;      /* inputs or a parameter have been set */
    bool closes_loops;      /* a projection does more than renormalise quaternions: it overwrites data */
    /* Parts that are structs of their own. */
    kt_breakpoints breakpoints;
    kt_events events;
    kt_record_plan records;
    kt_works works;
    struct kt_newton_matrices *newton; /* matrices of an implicit method; NULL: none */
    bool watches_ends;      /* adaptive steps do not leap over changes of functions of time behind their last stage */
    bool lacks_end_stage;   /* the method has no stage at the end of its steps */
    bool lacks_inner_stage; /* the method has no stage between the ends of its steps */
    struct kt_gaps *gaps;   /* contacts and stops that a step may leap over (gap.h); NULL: there are none */
    /* Hard contacts. */
    size_t contact_count;         /* the number of hard contacts, which are the first events */
    struct kt_contacts *contacts; /* NULL: there are none */
    bool steps_over_contacts;     /* contacts are resolved by time stepping: */
    struct kt_moreau *moreau;     /* time stepping over contacts (moreau.h); NULL: they are events */
    uint64_t contact_mask;        /* the switches of hard contacts */
    uint64_t contact_friction;    /* switches of joint friction; with both switches of a joint on, it is released */
    uint64_t contact_released;    /* the contacts that are released at first */
    double contact_time;          /* s, of the values of contacts; NaN: not available */
    double slow_slip; /* the largest slip of hard contacts of which the direction is predicted, m/s; 0: no contacts */
    /* The run, and the last evaluation. */
    double step; /* fixed, or 0 */
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

/* Whether time steps complete fixed steps on hard contacts that take too many evaluations (contact/bounded_step.c). */
static inline bool kt_bounds_steps(const kt_simulation_options *options) {
    return options->step_evaluations > 0 || options->stall_evaluations > 0;
}

/* The block of the persistent state, and its bytes. */
static inline char *kt_simulation_block(const kt_simulation *simulation) {
    return (char *)simulation + offsetof(kt_simulation, memory);
}
static inline size_t kt_simulation_block_size(const kt_simulation_sizes *size) {
    size_t used = kt_arena_round(sizeof(kt_simulation)) - offsetof(kt_simulation, memory);
    KT_SIMULATION_STATE(KT_ARENA_MEASURE)
    return used;
}

/* Rounding of times. Events, contacts and breakpoints derive limits of times, and of speeds, from three numbers.
 * Integrators and records have roundings of their own.
 *
 *     kt_time_width       The width to which the root of an event is enclosed at the time t: 4 units of rounding.
 *     kt_time_together    Roots of one state lie within two such widths of each other.
 *     kt_time_step        No step is shorter than 16 such widths. */
static inline double kt_time_width(double t) { return 4.0 * DBL_EPSILON * fabs(t); }
static inline double kt_time_together(double t) { return 2.0 * kt_time_width(t); }
static inline double kt_time_step(double t) { return 16.0 * kt_time_width(t); }

/* Times that are as near as this are one instant, s: rounding of positions hides their order. */
static inline double kt_simulation_instant(const kt_simulation *simulation) {
    return 3e-12 * simulation->memory.own_time;
}

/* Records that forces have jumped at the present time, so that reactions differ from the reactions at the end of the
 * last step. The beginning of the next step then checks whether contacts stay closed (event.c). */
static inline void kt_simulation_mark_jump(kt_simulation *simulation) {
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
