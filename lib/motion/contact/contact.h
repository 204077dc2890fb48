/* Loops that bound one side (kt_loop.side): hard stops, contacts, slack ropes. Also friction that sticks. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONTACT_CONTACT_H
#define KT_CONTACT_CONTACT_H

#include "cone/coulomb.h"
#include "contact/mask.h"
#include "evaluate/evaluate.h"
#include "evaluate/load_friction.h"
#include "evaluate/slip.h"
#include "model/switching.h"
#include "step/simulation_core.h"

/* One item: a loop that bounds a side, friction of a joint, or friction of a contact. A contact with friction has two
 * items. */
typedef enum kt_contact_side { KT_CONTACT_OFF, KT_CONTACT_ON, KT_CONTACT_BACK, KT_CONTACT_RELEASED } kt_contact_side;

typedef struct kt_contact {
    kt_simulation *simulation;
    int loop, index;      /* of the model; in kt_contacts.item */
    kt_contact_side next; /* of the set that follows: on if it is closed, or sticks; the last two for friction of joints
                             that slips backwards, or that is released */
    kt_contact_side began; /* `next` before reactions are solved (loaded_friction.c) */
    bool meets;            /* its gap closes at this instant: it touches, even if rounding left a gap */
    bool leaves;           /* its reaction, or its stick, has ended at this instant */
    bool grazes;           /* it touches no faster than at rest (kt_contacts_find_grazing) */
    bool flies;            /* it does not touch while impacts accumulate (accumulate.c) */
    bool spared;      /* loops hold its gap while it touches, or hold the joint of friction (kt_contacts_spare_held) */
    double unit;      /* of its gap: the mechanism's length, or 1 rad */
    uint64_t bit;     /* its loop is on; 0: contacts share bits (model/switching.h) */
    double sign;      /* of the residual if the contact is open; 1 for friction */
    int effect;       /* friction: the effect; contacts: -1 */
    uint64_t back;    /* friction of a joint: it slips backwards; with `bit`: it is released */
    int v;            /* friction of a joint: the index of its rate */
    double load;      /* friction of a joint: the part of its limit that comes from a load (loaded_friction.c) */
    int first, count; /* in `coordinate` and `local`: the coordinates on which its rows depend */
    int of;           /* friction of a contact: the contact's index; a contact: the index of its friction; -1: none */
    int island;
} kt_contact;

/* Every array: type, name, count, meaning. n contacts, of which m touch. */
#define KT_CONTACT_FIELDS(X)                                                                                           \
    X(kt_contact, item, s->n, "in the order of the loops")                                                             \
    X(double, value, s->n, "gaps of the open ones, reactions of the others, in the state `at`")                        \
    X(double, at, s->nq + s->nv, "of the values")                                                                      \
    X(double, row, s->rows, "residuals, or multipliers, of all equations")                                             \
    X(double, rate, s->rows, "b' of all equations")                                                                    \
    X(double, drift, s->rows, "b'' of all equations")                                                                  \
    X(double, jacobian, s->entry, "of all equations, by groups (kt_loop_entries)")                                     \
    X(int32_t, coordinate, s->depends, "coordinates on which rows depend, item by item, in ascending order")           \
    X(int32_t, local, s->depends, "their positions in the rows of their group")                                        \
    X(double, reaction, s->rows, "multipliers of contacts that share their load")                                      \
    X(double, v, s->nv, "velocities behind impulses")                                                                  \
    X(double, flight, s->nv, "scratch: accelerations")                                                                 \
    X(double, a, s->nv, "accelerations without the contacts")                                                          \
    X(kt_contact_island, island, s->islands, "of the model in which all contacts are closed")                          \
    X(int, rows, s->list, "the items that touch, those of a contact's friction twice, island by island")               \
    X(int, components, s->list, "of these, which of its rows")                                                         \
    X(double, rates, s->list, "of these")                                                                              \
    X(double, matrix_of_rows, s->W, "W of each island: J M^-1 J' of the rows that touch")                              \
    X(double, response, s->most_rows * s->nv, "M^-1 J': column k is the sum of rows k of all islands")                 \
    X(double, reserve, s->n, "of items that bound the margin of rest: their equal reserves; NAN: they do not")         \
    X(double, rest_rate, s->n, "rates up to which friction of joints is at rest")                                      \
    X(double, gap, s->n, "of all contacts")                                                                            \
    X(double, w, s->most_rows, "accelerations of rows under the reactions; of contacts alone")                         \
    X(double, L, s->factor, "scratch: Cholesky factor of independent rows, and of a row")                              \
    X(int, independent, s->most_rows, "scratch: these rows")                                                           \
    X(double, e, s->most_items, "restitutions of an impact")                                                           \
    X(char, matrices, s->matrices, "of solvers, which never run at once")                                              \
    X(double, bound, s->most_items, "lower bounds of final rates of normal rows, in a phase of an impact")             \
    X(double, least, s->most_items, "lower bounds of their impulses")                                                  \
    X(double, u_mid, s->most_rows, "rates behind compression")                                                         \
    X(double, p_mid, s->most_rows, "impulses of compression")                                                          \
    X(double, u_end, s->most_rows, "rates behind an impact")                                                           \
    X(double, p_end, s->most_rows, "its impulses")                                                                     \
    X(char, problem_memory, s->problem, "a problem with Coulomb's friction")                                           \
    X(char, solution_memory, s->solution, "its solution")                                                              \
    X(char, solver_memory, s->solver, "its solver")                                                                    \
    X(int, posed, s->most_items, "the first row of each of its items in the list")                                     \
    X(int, block, s->most_rows, "of rows that may have a force: their block of W (friction.c); of others -1")          \
    X(double, ahead, s->most_items, "tau of slow slip of each of its items (slip_prediction.c), s")                    \
    X(double, fading, s->most_items, "tau of each if its slip does not grow, s")                                       \
    X(char, data_memory, s->data, "data of the model in which all contacts are closed")                                \
    X(char, inverse_memory, s->inverse, "M^-1")

/* An island (islands.c). The order of the rows that touch: one-sided loops, friction of joints, friction of
 * contacts. */
typedef struct kt_contact_island {
    const kt_island *of;
    int row;                        /* the island's first row in the arrays of all rows */
    size_t W;                       /* the island's first number in matrix_of_rows */
    int stored;                     /* W is stored if at most so many rows touch */
    int touching, meeting, resting; /* rows; the first `meeting` rows bound a side, */
    int known;                      /* for time stepping: rows with a response */
    double approach;                /* the largest speed at which a gap closes, in its units per s */
    bool jams;                      /* an impulse without a collision has stopped slip */
} kt_contact_island;

typedef struct kt_contact_sizes {
    size_t n, nq, nv, rows, entry, depends, data, inverse, islands;
    size_t list, W;                   /* rows that may touch, and numbers of W, of all islands */
    size_t most_items, most_rows;     /* the most of an island: contacts and dry friction, rows */
    size_t factor;                    /* the most of an island: numbers of L */
    size_t most;                      /* items that have room in matrices */
    size_t whole;                     /* W of an island is stored if at most so many rows touch */
    size_t problem, solution, solver; /* bytes */
    size_t shares, matrices;          /* bytes */
} kt_contact_sizes;

/* The tries of a step that failed (contact/retry.c). */
typedef struct kt_contact_retry {
    double t_limit; /* s, the end of the whole step */
    int attempt;    /* to free a contact that friction wedges, the next one */
} kt_contact_retry;

struct kt_contacts {
    kt_contact_excess excess; /* of the forces where the present step begins (certificate.c) */
    int n, sides;             /* the number of items; the first `sides` items bound a side, the others are friction */
    int islands;              /* number of islands of `all` */
    /* For the selected island (kt_contacts_select): its rows in the arrays of all rows. Rows up to `resting` are
     * friction of joints, the others friction of contacts. */
    kt_contact_island *selected;
    int touching, meeting, resting;
    int *list, *component; /* the item of each row, and which of its rows */
    double *u;             /* rates */
    double *W;             /* W of the rows, or their diagonal */
    uint64_t mask;         /* the switches of all items: contact_mask */
    uint64_t back;         /* the bits `back` among them */
    double speed, change;  /* at an event: roots of v'M v and a'M a, */
    double fastest;        /* and the largest rate of an item, in units per s (own_time.c) */
    uint64_t set;          /* kt_model.set of the values, as `at` is their state */
    size_t inverse_size;   /* bytes of inverse_memory */
    int most, whole;       /* items that have room in matrices; W is stored if at most `whole` rows touch */
    const kt_model *all;   /* the model of the equations, in which all contacts are closed */
    kt_data *data;         /* data of `all` */
    kt_coulomb *problem;
    kt_coulomb_solution *solution;
    kt_coulomb_solver *solver;
    int present;            /* the block whose forces are solved (friction.c) */
    bool rubs;              /* some contacts have friction */
    double bounded_end;     /* s, the end of the present step before contacts shorten it (bounded_step.c) */
    double window;          /* s, in which impacts accumulate; 0: they do not */
    bool rests;             /* impacts that accumulate have reached their limit: contacts that touch come to rest */
    bool jams;              /* friction wedges a contact that slips: an impulse stops it */
    bool releases, holds;   /* friction wedges a contact: that one is released, or all that are held stick */
    bool holds_slow;        /* with `holds`: all are held that slip about as fast as `wedged`, or slower */
    int wedged;             /* the contact that friction wedges */
    bool strikes;           /* speeds of drives jump: contacts that are closed do not bounce */
    bool stops;             /* ends of slip accumulate: contacts that slip below their rest velocity come to rest */
    kt_contact_retry retry; /* tries of the present step */
    KT_ARENA_DECLARE(KT_CONTACT_FIELDS)
};

/* Gaps up to this part of the contact's unit touch. */
static const double kt_contact_touching = 1e-11;
/* The depth at which a contact that was left open penetrates, m or rad. */
static inline double kt_contact_depth(const kt_contact *contact) { return 2.0 * kt_contact_touching * contact->unit; }
/* Rates and accelerations below this part of the sum of their terms are rounding. */
static const double kt_contact_rounding = 1e-11;

/* The acceleration of a contact that grazes, as a part of the sum of its terms. */
static const double kt_contact_grazing = 1e-9;

/* Whether the contact is closed, or friction sticks, in a model. */
static inline bool kt_contact_is_closed(const kt_model *model, const kt_contact *contact) {
    return !kt_loop_is_off(&model->loop[contact->loop]);
}

/* Whether the contact is released, so that it does not act at any gap (kt_simulation_set_released). */
bool kt_contact_is_released(const kt_contact *contact);

/* The rate of item k below which it has come to rest, m/s or rad/s, but for rounding of the time. */
static inline double kt_contact_resting(const kt_simulation *simulation, int k) {
    const double time = simulation->memory.own_time;
    return time > 0.0 ? kt_slip_rest * simulation->contacts->item[k].unit / time : 0.0;
}
/* Finds `speed` and `fastest` from the velocities c->v and the equations. Data of the simulation belong to `open`. */
KT_CHECKED kt_status kt_contacts_find_speed(kt_simulation *simulation, const kt_model *open, const double *q,
                                            kt_error *error);
/* Finds the own time (own_time.c) from `fastest` and `change`. Data of the simulation belong to `open`. */
KT_CHECKED kt_status kt_contacts_find_own_time(kt_simulation *simulation, const kt_model *open, const double *q,
                                               kt_error *error);

/* Finds it at the start, at the velocities c->v. */
void kt_contacts_begin_own_time(kt_simulation *simulation, double t, const double *y);

/* The first row of its equations. */
static inline int kt_contact_row(const kt_model *model, const kt_contact *contact) {
    return model->loop[contact->loop].equation;
}

/* Whether a contact is closed, sticks, and shares its load with others in several ways. */
bool kt_contact_shares_load(const kt_model *model, const kt_contact *contact);
/* Whether any contact does, or dry friction of a joint that sticks exceeds its limit in these multipliers. */
bool kt_contacts_share_any(const struct kt_contacts *c, const kt_model *model, const double *multiplier);

/* Whether item k is friction of a contact. */
static inline bool kt_contact_rubs(const struct kt_contacts *c, int k) { return k >= c->sides && c->item[k].of >= 0; }

/* ---- islands (islands.c) ----------------------------------------------------------------------------------------- */

/* Enlarges sizes until the islands of a model fit. */
void kt_contacts_measure_islands(const kt_model *model, kt_contact_sizes *s);
/* The count of stored numbers of W, over all islands. If too many rows of an island touch, only the diagonal of W is
 * stored. */
size_t kt_contacts_count_of_W(const kt_model *model, size_t whole);
/* How many coordinates the rows of all contacts of a model depend on, contact by contact. */
size_t kt_contacts_count_coordinates(const kt_model *model);
/* Lays out the islands of c->all, of which no row touches. */
void kt_contacts_init_islands(struct kt_contacts *c);
/* Empties the lists of rows that touch. */
void kt_contacts_clear_rows(struct kt_contacts *c);
/* Adds the next row of item k, and returns the index of this row in the arrays of all rows. */
int kt_contacts_add_row(struct kt_contacts *c, int k, int component);
/* Selects an island. Returns whether rows of the island touch. */
bool kt_contacts_select(struct kt_contacts *c, int island);
/* How many rows touch in all islands. */
int kt_contacts_total(const struct kt_contacts *c);
/* Adds a multiple of the response to row k of the selected island to velocities (nv). */
void kt_contacts_add_response(const struct kt_contacts *c, int k, double p, double *v);

/* ---- rows of the selected island --------------------------------------------------------------------------------- */

/* The loop of row k of the contacts that touch. */
const kt_loop_record *kt_contact_loop(const kt_simulation *simulation, int k);
/* A row of J over the coordinates of its loop's paths; the others are zero. A heap is one group, in which a row depends
 * on two of many bodies. */
typedef struct kt_contact_line {
    const kt_group *group;
    int count;         /* number of coordinates */
    const int32_t *v;  /* indices of these coordinates */
    const int32_t *at; /* their positions in `row` */
    const double *row; /* the row of the loop's equation over its group: J is `sign` times that */
    double sign;
} kt_contact_line;

/* The row of an equation of a contact, and row k of those that touch. */
static inline kt_contact_line kt_contact_line_of(const struct kt_contacts *c, const kt_contact *contact,
                                                 int component) {
    const kt_loop_record *loop = &c->all->loop[contact->loop];
    const kt_group *group = &c->all->group[loop->group];
    return (kt_contact_line){.group = group,
                             .count = contact->count,
                             .v = c->coordinate + contact->first,
                             .at = c->local + contact->first,
                             .row = c->jacobian + kt_loop_entry(group, loop, component),
                             .sign = contact->sign};
}
static inline kt_contact_line kt_contacts_line(const struct kt_contacts *c, int k) {
    return kt_contact_line_of(c, &c->item[c->list[k]], c->component[k]);
}
/* The rate J x - b' of an equation of item k. */
static inline double kt_contacts_rate(const struct kt_contacts *c, int k, int component, const double *x) {
    const kt_contact_line line = kt_contact_line_of(c, &c->item[k], component);
    double sum = -c->rate[kt_contact_row(c->all, &c->item[k]) + component];
    for (int j = 0; j < line.count; j++)
        sum += line.row[line.at[j]] * x[line.v[j]];
    return line.sign * sum;
}

/* J x - right likewise. *size: the sum of the terms' magnitudes. */
double kt_contacts_residual(const struct kt_contacts *c, int k, int component, const double *x, const double *right,
                            double *size);

/* Writes row k of J over the coordinates of its group (of nv). */
void kt_contacts_write_row(const struct kt_contacts *c, int k, double *row);
/* J_k x. */
double kt_contacts_along(const struct kt_contacts *c, int k, const double *x);
/* W_ik from the rows of J and M^-1 J'. */
double kt_contacts_product(const struct kt_contacts *c, int i, int k);

/* Whether W of the rows that touch is stored. Otherwise W is its diagonal. */
static inline bool kt_contacts_are_stored(const struct kt_contacts *c) { return c->touching <= c->whole; }
static inline double kt_contacts_between(const struct kt_contacts *c, int i, int k) {
    return kt_contacts_are_stored(c) ? c->W[i * c->touching + k] : kt_contacts_product(c, i, k);
}
static inline double kt_contacts_own(const struct kt_contacts *c, int k) {
    return c->W[kt_contacts_are_stored(c) ? k * c->touching + k : k];
}
/* The rate J v - b' and the acceleration J a - b'' of row k. *size: the magnitude to which their rounding is relative,
 * at least the largest possible |J x| in the mass metric, sqrt(W_kk) sqrt(x'M x), after Cauchy and Schwarz. The sum of
 * the terms alone is no measure: for a stop, J x is one number, in which forces have already cancelled. */
double kt_contact_rate(const struct kt_contacts *c, int k, double *size);
double kt_contact_acceleration(const struct kt_contacts *c, int k, double *size);

/* Whether contact k leaves the active set, because its reaction ends or its friction begins to slip. The contact leaves
 * if its event is due. Friction that has reached its limit twice at this instant does not stick again within this
 * instant. Counts how often contact k leaves at this instant (directions.c). */
bool kt_contact_leaves(kt_simulation *simulation, int k, bool due);
/* The slowest of the contacts that slip slowly in the present state (directions.c); -1: there is none. */
int kt_contacts_find_slow(const kt_simulation *simulation);
/* The speed up to which slip of contact k comes to rest if slow slip stops at this instant, m/s (directions.c). */
double kt_contact_stopping_speed(const kt_simulation *simulation, int k);
/* Holds contact k, or friction, closed for a short time, whatever its reaction (directions.c). */
void kt_contact_hold(kt_simulation *simulation, int k);
/* Whether item k is held at the present time (directions.c). */
bool kt_contact_is_held(const kt_simulation *simulation, int k);
/* Whether the slip of friction k has come to rest up to its rest velocity (directions.c). */
bool kt_contact_slip_ends(const kt_simulation *simulation, size_t k, double slip);
/* Holds contact k likewise if its reaction has ended at this instant, and counts this (directions.c). */
void kt_contact_hold_turning(kt_simulation *simulation, int k);
/* Counts a reversal of slip, at which friction k is due (directions.c). */
void kt_contact_count_reversal(kt_simulation *simulation, int k);
/* Sets the gap at which the open contact of row k, which touches, closes again, and the gap above which it has parted
 * (rows.c). */
void kt_contact_watch_gap(kt_simulation *simulation, int k);
/* Whether the gap of contact k is at most `most` above its boundary (touching.c). */
bool kt_contact_touches(const kt_simulation *simulation, int k, double most);
/* The speed below which a touching contact comes to rest instead of bouncing: its rest_velocity, or the speed of a
 * bounce that rounding hides. Requires the equations, and in c->a the accelerations without contacts. */
double kt_contact_rest(const kt_simulation *simulation, int k);

/* The speed behind an impact below which steps do not resolve the bounce, so that the contact comes to rest. Adaptive
 * steps: the bounce is lower than ten tolerances of the gap. Fixed steps: this bounce and all later ones end within the
 * length of a step. Requires the same. */
double kt_contact_unresolved(const kt_simulation *simulation, int k);

/* Parameters of friction: mu of a contact, the largest force at rest in a joint, and the force at which a joint slips.
 * The largest force contains the part of a load. The force of slip does not, because friction from a load is left out
 * of accelerations at rest (kt_contacts_put_rests). */
double kt_contact_coefficient(const kt_model *model, const kt_contact *contact);
/* The factor of friction that holds a contact (directions.c). */
static const double kt_contact_holding = 1e3;
double kt_contact_limit(const kt_model *model, const kt_contact *contact);
double kt_contact_slip(const kt_model *model, const kt_contact *contact);

/* Friction of joints that acts on one rate is redundant while it sticks. In the next set, all of this friction sticks
 * or none. The load is shared in proportion to the limits, so that all friction of the rate reaches its limits
 * together. */
static inline bool kt_contacts_share_rate(const struct kt_contacts *c, int i, int k) {
    return i >= c->sides && k >= c->sides && c->item[i].of < 0 && c->item[k].of < 0 && c->item[i].v == c->item[k].v;
}
void kt_contacts_hold_together(struct kt_contacts *c);
void kt_contacts_share_load(const struct kt_contacts *c, const kt_model *model, double *multiplier);
/* Friction slips if other friction of the same rate slips. The events of both are due at one instant, one after the
 * other. Friction that has begun to slip does not stick again within this instant (directions.c). */
void kt_contacts_slip_together(kt_simulation *simulation);

/* Friction from loads (loaded_friction.c).
 *
 * kt_contacts_put_rests leaves this friction out in the data of the simulation if its joint is at rest.
 *
 * kt_contacts_update_loads sets the loads of friction that sticks from the last reactions in the data.
 *
 * kt_contacts_find_loads evaluates these reactions, for the multipliers in c->row.
 *
 * kt_contacts_solve_loads repeats `solve`, which finds the set that follows, until the loads of this set are those from
 * which the set was found. again: impulses have stopped slip at this instant, and may not do so again. */
typedef kt_status kt_contacts_solver(kt_simulation *simulation, double t, bool again, double *lost, kt_error *error);
bool kt_contacts_have_loads(const struct kt_contacts *c);
void kt_contacts_put_rests(kt_simulation *simulation, bool rests);
void kt_contacts_update_loads(struct kt_contacts *c, const kt_model *model, const kt_data *data,
                              const double *multiplier);
KT_CHECKED kt_status kt_contacts_find_loads(struct kt_contacts *c, const kt_instant *at, kt_error *error);
KT_CHECKED kt_status kt_contacts_solve_loads(kt_simulation *simulation, double t, kt_contacts_solver *solve, bool again,
                                             double *lost, kt_error *error);

/* The contact that friction wedged last (slip.c) in the present step; -1: no contact. */
int kt_contacts_find_wedged(const kt_simulation *simulation);

/* Opens all contacts of the set that follows. Friction of joints slips in the direction of the velocities. Friction at
 * rest slips forwards. Friction that is released does not act. */
void kt_contacts_let_slip(struct kt_contacts *c);
/* The set that follows, as bits of the switches. */
uint64_t kt_contacts_set(const kt_simulation *simulation);

/* Selects the model in which all contacts are closed, with the loops and effects that are on in a model, and adapts its
 * data. If this selection changes the model, no row counts as touching any more. */
void kt_contacts_use_closed_model(struct kt_contacts *c, const kt_model *model);
/* Computes the gaps of all contacts. all: also the rates, drifts and the Jacobian of their equations. */
KT_CHECKED kt_status kt_contacts_find_equations(struct kt_contacts *c, const kt_model *model, double t, const double *q,
                                                const double *v, bool all, kt_error *error);

/* Writes multipliers that give the same forces as those in c->row to c->reaction. If contacts at rest share a load in
 * several ways (cone/statics.h), these multipliers have the largest margin, from whose sign events detect whether rest
 * exists; or they are the least multipliers. */
KT_CHECKED kt_status kt_contacts_find_reactions(struct kt_contacts *c, const kt_instant *at, bool least,
                                                kt_error *error);

/* Checks rows that close, u < 0 (rejection.c). Data of the simulation belong to `open`. A row without a lever that
 * closes by less than its kt_contact_resting rests: its u becomes 0. Errors: a contact has no lever on any joint, or
 * its motion is prescribed. */
KT_CHECKED kt_status kt_contacts_check_levers(kt_simulation *simulation, const kt_model *open, double t,
                                              kt_error *error);
/* Writes |x| = sqrt(x'M x) to *norm, for x in which every joint moves by its unit: 1 rad, or the mechanism's length.
 * Data of the simulation belong to `open`. The scale of W is this number: W x'M x >= (J x)^2, and in x a gap moves at
 * most by the mechanism's length or a radian. */
KT_CHECKED kt_status kt_contacts_find_unit(kt_simulation *simulation, const kt_model *open, const double *q,
                                           double *norm, kt_error *error);
/* Whether contact k has a lever on a joint. own: the number of its row in the diagonal of W. */
bool kt_contact_has_lever(const struct kt_contacts *c, int k, double own, double norm);
/* Leaves contacts that touch out of the lists of rows, if other loops hold their gaps, as a foothold at the same point
 * does (rejection.c). Such contacts stay open, because their rows have no lever, so that their reaction has no bound.
 * Requires W, and recomputes W if a contact is left out. Contacts that close faster than kt_contact_resting stay in the
 * lists. Friction of a joint that loops hold at rest is left out, too, and counts as slipping. */
KT_CHECKED kt_status kt_contacts_spare_held(kt_simulation *simulation, const kt_model *open, double t, kt_error *error);
/* Checks the rates after impulses. status: of the projection onto the loops; approach: the speed before; v: the
 * velocities after the projection. Requires the equations at the present state. Errors: contacts continue to close,
 * since their motion is prescribed. */
KT_CHECKED kt_status kt_contacts_check_rates(kt_simulation *simulation, double t, const double *v, double approach,
                                             kt_status status, kt_error *error);
/* Whether contacts may have forces in the state of a record at t: some are closed, or touch (certificate.c). */
bool kt_contacts_may_act(const kt_simulation *simulation, double t);
/* Checks that the multipliers of a record at t obey signs and cones: no reserve is negative. */
KT_CHECKED kt_status kt_contacts_check_reserves(const kt_simulation *simulation, double t, kt_error *error);
/* Compares the residuals `left` of Newton's law in each coordinate with the largest sum of the sizes of terms in its
 * tree of links (certificate.c). Forces count as moments. The forces of a leg may cancel in the moment of its
 * hip. Their rounding remains there, but only the coordinates of the base show how large they are. */
KT_CHECKED kt_status kt_contacts_compare_newton(const kt_simulation *simulation, double t, const double *left,
                                                const double *size, kt_error *error);
/* Checks the forces of a record at t, and Newton's law (phase `check_record`, certificate.c). */
KT_CHECKED kt_status kt_contacts_check_record(const kt_simulation *simulation, double t, kt_error *error);
/* Whether the event's value of item k in the present state, behind a decision, breaks the law. If so, sets an error. */
bool kt_contact_breaks_law(const kt_simulation *simulation, int k, kt_error *error);
/* Finds the largest force beyond the law where a step begins. Requires the values of the events there. */
void kt_contacts_find_excess(kt_simulation *simulation);
KT_CHECKED kt_status kt_contacts_count_excess(kt_simulation *simulation, kt_error *error);
/* Sets the error of contacts without impulses, or without reactions (`what`). */
kt_status kt_contacts_reject(kt_simulation *simulation, double t, const char *what, kt_error *error);

/* Solves a phase of an impact of the closing contacts, from the rates u to u + W p, with friction (friction.c). The
 * tangential impulse p_t lies in Coulomb's cone of the normal impulse, against the slip at the end of the phase.
 * Returns false if there are no such impulses. The rows with impulses are those of c->problem. */
bool kt_contacts_solve_phase(kt_simulation *simulation, double *u, double *p);

/* Computes the accelerations with all contacts open, to c->a, and the equations at the velocities c->v. */
KT_CHECKED kt_status kt_contacts_find_free(kt_simulation *simulation, double t, const double *y, kt_error *error);
/* Applies an impact (impact.c). With W = J M^-1 J' of the touching rows and their rates u: computes impulses of islands
 * in which contacts close. Then u becomes u+, and c->v the velocities after the impact. *lost grows by the dissipated
 * kinetic energy. */
KT_CHECKED kt_status kt_contacts_apply_impact(kt_simulation *simulation, double t, double *lost, kt_error *error);
/* Finds the rates c->u of all rows that touch, in c->v; rates of rounding become 0. Returns the largest
 * speed at which a gap closes, in its units per s. */
double kt_contacts_find_rates(kt_simulation *simulation);
/* Applies impacts that accumulate at the present instant, in the time c->window (accumulate.c). Then rows, W and rates
 * are those of the contacts that touch behind them. Requires the equations. */
KT_CHECKED kt_status kt_contacts_accumulate(kt_simulation *simulation, const kt_model *open, double t, double *lost,
                                            kt_error *error);
/* Solves contact forces of the selected island, from the accelerations without contacts in c->a. Sets its closed and
 * sticking contacts of the set that follows, and directions of slip. The others have been let slip. */
KT_CHECKED kt_status kt_contacts_solve_forces(kt_simulation *simulation, double t, kt_error *error);

/* The slip of a contact along its direction, from the last evaluation (directions.c). */
double kt_contact_slip_along(const kt_model *model, const kt_data *data, const kt_contact *contact);
/* Writes the directions of slip to the simulation's data. */
void kt_contacts_put_directions(kt_simulation *simulation);
/* Whether steps are fixed, and too long to resolve the turning of slip that friction changes at this rate, m/s^2. */
bool kt_contacts_is_unresolved(const kt_simulation *simulation, double most);
/* Return the largest tau of slip of this speed, for reactions at an instant (slip_prediction.c). The second function
 * assumes adaptive steps. most: the rate at which friction changes slip, m/s^2. */
double kt_contacts_prediction_time(const kt_simulation *simulation, double speed, double most);
double kt_contacts_adaptive_time(const kt_simulation *simulation, double speed);
/* Renews the direction of slip that has reversed in the present state. When slip begins, rounding may leave a small
 * slip against the set direction. This value then counts as zero slip. Returns whether a direction or a value of rest
 * changed. */
bool kt_contacts_follow_slip(kt_simulation *simulation);
/* Begin a step, before and after the values of events are computed. The first function follows slip, and lets slip that
 * turns round its rest come to rest. The second function predicts slip with the present normal forces. */
KT_CHECKED kt_status kt_contacts_begin_slip(kt_simulation *simulation, kt_error *error);
KT_CHECKED kt_status kt_contacts_begin_prediction(kt_simulation *simulation, kt_error *error);

/* Computes impulses without a collision in the selected island, if no accelerations obey Coulomb's law (Painleve's
 * paradox). The impulses stop or reverse the slip. Returns false if no such impulses exist. Otherwise u and c->v become
 * the values after these impulses, and *lost grows by the dissipated energy. */
bool kt_contacts_jam(kt_simulation *simulation, double *lost);
/* Whether kt_contacts_jam must stop a contact that friction wedges. The contact must still slip, since an impact at
 * this instant may have stopped the slip. */
bool kt_contacts_must_jam(const struct kt_contacts *c);

/* Prepares the masks, at the start (model.c). */
void kt_contacts_init_masks(kt_simulation *simulation);
/* Returns the model of the next set, in the present state. The call may adapt data of the simulation to another model.
 * tried: the simulation does not run on the model, and the next trial overwrites the model. */
const kt_model *kt_contacts_model(kt_simulation *simulation, bool tried);
/* The model of a set in which all contacts are open, and friction of joints slips or is released. NULL: there is no
 * such set. */
const kt_model *kt_contacts_open_model(kt_simulation *simulation, uint64_t set);
/* The model of a set with the ranks and the contacts of a checkpoint. NULL: there is no such set. */
const kt_model *kt_contacts_restored_model(kt_simulation *simulation, uint64_t set, const double *ranks,
                                           const kt_contact_memory *state);
/* Writes the ranks of the present model to the persistent state. */
void kt_contacts_store_ranks(kt_simulation *simulation);
/* The model of small motions about the present state, in which all contacts that rest are closed (resting.c). a: the
 * accelerations in the present state. The next trial may overwrite the model. */
const kt_model *kt_contacts_resting_model(kt_simulation *simulation, const double *a);
/* The first row of the friction of the contact of row i in the list of the selected island; -1: none. */
int kt_contact_friction_line(const struct kt_contacts *c, int i);
/* The slip of row i, m/s; 0 without friction. */
double kt_contact_slip_speed(const struct kt_contacts *c, int i);
/* Whether the contact of row i slips, and friction has not come to rest. */
bool kt_contact_row_slips(const struct kt_contacts *c, int i);
/* Whether contact k slips in the present model. */
bool kt_contact_is_slipping(const kt_simulation *simulation, int k);
/* The simulation runs on a model that was made during the run. Copies to this model the parameters that were set
 * since. Cost if nothing has been set: a comparison of two revisions. */
void kt_contacts_renew_model(const kt_simulation *simulation);
/* Takes over parameters that were set, and reports a contact that has been beyond its boundary since the start. */
KT_CHECKED kt_status kt_contacts_start(kt_simulation *simulation, kt_error *error);

/* The number of such loops of a model, closed and open. */
size_t kt_contacts_of(const kt_model *model);

/* The sizes of all arrays: the largest ones that any variant of the model needs. */
kt_contact_sizes kt_contact_sizes_of(const kt_model *model);
/* Bytes of the memory for the contacts of a model, for all its sets; 0 without contacts. */
size_t kt_contacts_size(const kt_model *model);

/* Lays the memory out and lists the contacts. `simulation` has its model, data and memory. */
KT_CHECKED kt_status kt_contacts_lay_out(kt_simulation *simulation, kt_error *error);

/* Writes the values of the events of all contacts to c->value (values.c): gaps of open contacts, reactions of closed
 * contacts. */
KT_CHECKED kt_status kt_contacts_find_values(struct kt_contacts *c, const kt_instant *at, kt_error *error);

/* For two spheres whose contact is open: 2 D, where D is the distance of the centres at which the spheres touch. The
 * gap g has a kink, whereas g (g + 2 D) is smooth. For all other contacts: 0 (values.c). */
double kt_contact_kink(const kt_simulation *simulation, size_t k);
/* kt_event_source.margin (values.c). */
double kt_contact_value_margin(const kt_simulation *simulation, size_t k);

/* Lists the contacts that touch, and all friction (touching.c). Errors: a contact penetrates deeply. */
KT_CHECKED kt_status kt_contacts_find_touching(kt_simulation *simulation, double t, kt_error *error);
/* Lists the rows of contacts that touch and are not spared, and of friction. */
void kt_contacts_list_rows(kt_simulation *simulation);
/* Writes column k of J' of all islands to c->response, for all k from `from` on. Returns their number. */
int kt_contacts_write_columns(struct kt_contacts *c, int from);
/* Computes M^-1 J' and W of the mechanism with all contacts open, from data of the simulation. */
KT_CHECKED kt_status kt_contacts_find_response(kt_simulation *simulation, const kt_model *open, double t,
                                               const double *q, kt_error *error);
/* Computes sqrt(x'M x). Data of the simulation belong to `model`. */
KT_CHECKED kt_status kt_contacts_find_norm(kt_simulation *simulation, const kt_model *model, const double *q,
                                           const double *x, double *norm, kt_error *error);
/* Finds the contacts of the set that follows, from the reactions in the present state (forces.c). *lost grows if an
 * impulse without a collision is needed (kt_contacts_jam). */
KT_CHECKED kt_status kt_contacts_solve_reactions(kt_simulation *simulation, double t, double *lost, kt_error *error);
/* Finds contacts that may graze, at the rates u before impulses. */
void kt_contacts_find_grazing(kt_simulation *simulation);
/* Closes contacts that graze, in the set that follows, after reactions are found. u: the rates; w: the accelerations
 * under the reactions.
 *
 * A corner of a box on a floor may carry nothing: two diagonal corners with friction hold the box. These corners permit
 * a rotation, whose rate is rounding, or a rate of rest. The third corner would reach the floor again and again. A
 * contact that grazes is therefore closed without a reaction. The acceleration w of such a contact is below the part
 * `kt_contact_grazing` of its terms, and w does not depend on the other closed contacts. The contact opens when its
 * reaction falls below twice the reaction that belongs to this part. */
void kt_contacts_close_grazing(kt_simulation *simulation);
/* Finds friction of joints that slips at no rate, since closed contacts, loops or other sticking friction hold the
 * joint. Returns its bits. */
uint64_t kt_contacts_find_held(const kt_simulation *simulation);

/* No gap may be deeper than this part of the mechanism's length, or of 1 rad. */
static const double kt_contact_deep = 1e-6;

/* No contact closes or ends at this instant: clears what an event, or an earlier attempt, has marked. */
static inline void kt_contacts_clear_due(struct kt_contacts *c) {
    for (int k = 0; k < c->n; k++)
        c->item[k].meets = c->item[k].leaves = false;
}

/* The least bound of the evaluations of a fixed step (bounded_step.c). */
uint64_t kt_step_evaluations_least(const kt_method *method);
/* Lets a time step follow, because a step or the contacts at an instant have failed. Returns false if evaluations of
 * steps have no bound, or if no time step helps: a callback has failed. */
bool kt_bounded_step_replaces(kt_simulation *simulation, kt_status failed);

extern const kt_part kt_slip_part, kt_contact_part, kt_moreau_part, kt_retry_part, kt_bounded_step_part;

/* Lists the hard contacts and adds their events before all others (contact_part.c). Requires the model, data and memory
 * of the simulation. */
KT_CHECKED kt_status kt_contacts_init(kt_simulation *simulation, kt_error *error);

/* Frees a contact that friction wedges, from the attempt *attempt on. Returns whether a step may be tried. */
bool kt_contacts_free_wedged(kt_simulation *simulation, int *attempt);

#endif
