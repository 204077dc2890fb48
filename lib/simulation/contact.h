/* Loops that bound one side (kt_loop.side) in a simulation: hard stops, contacts, slack ropes; and friction that sticks. */
#ifndef KT_SIMULATION_CONTACT_H
#define KT_SIMULATION_CONTACT_H

#include "linear/cone.h"
#include "linear/coulomb.h"
#include "model/switching.h"
#include "simulation/mask.h"
#include "simulation/simulation.h"

/* One that bounds a side, or friction: of a joint, or of a contact, of which there is one item more. */
typedef struct kt_contact {
    kt_simulation *simulation;
    int loop, index;
    uint64_t bit;  /* its loop is on */
    double sign;   /* of the residual where the contact is open; 1 of friction */
    int effect;    /* friction: the effect; of contacts -1 */
    uint64_t back; /* friction of a joint: it slips backwards; with `bit`: it is released */
    int v;         /* friction of a joint: its rate */
    int of;        /* friction of a contact: the index of that; of contacts that of their friction; -1: none */
} kt_contact;

/* Every array: type, name, count, meaning. n contacts, of which m touch. */
#define KT_CONTACT_FIELDS(X)                                                                                           \
    X(kt_contact, item, s->n, "in the order of the loops")                                                             \
    X(double, value, s->n, "gaps of the open ones, reactions of the others, in the state `at`")                        \
    X(double, at, s->nq + s->nv, "of the values")                                                                      \
    X(double, row, s->rows, "residuals, or multipliers, of all equations")                                             \
    X(double, rate, s->rows, "b' of all equations")                                                                    \
    X(double, drift, s->rows, "b'' of all equations")                                                                  \
    X(double, jacobian, s->rows * s->nv, "of all equations")                                                           \
    X(double, reaction, s->rows, "the least multipliers")                                                              \
    X(double, v, s->nv, "velocities behind impulses")                                                                  \
    X(double, a, s->nv, "accelerations without the contacts")                                                          \
    X(int, list, 2 * s->n, "rows: the items that touch, those of a contact's friction twice")                          \
    X(int, component, 2 * s->n, "of these, which of its rows")                                                         \
    X(double, response, 2 * s->n * s->nv, "M^-1 J', a column each")                                                    \
    X(double, gap, s->n, "of all contacts")                                                                            \
    X(char, cone_memory, s->cone, "the cone solver, where contacts have friction")                                     \
    X(char, data_memory, s->data, "data of the model in which all contacts are closed")                                \
    X(char, inverse_memory, s->inverse, "M^-1")

typedef struct kt_contact_sizes {
    size_t n, nq, nv, rows, data, inverse, cone;
} kt_contact_sizes;

struct kt_contacts {
    int n, sides;          /* in all; of these, the first ones bound a side, and the others are friction */
    int touching, meeting; /* rows of the list; of these, the first ones bound a side, */
    int resting;           /* and up to here joints have friction; the others are of contacts */
    uint64_t mask;         /* the switches of all: contact_mask */
    uint64_t back;         /* of these, those of `back` */
    uint64_t met;         /* of those whose gaps end at this instant: they touch, whatever rounding has left of these */
    double speed, change; /* at an event: roots of v'M v and a'M a */
    uint64_t set;         /* likewise */
    size_t inverse_size;  /* bytes of inverse_memory */
    const kt_model *all;  /* all are closed: of the equations */
    kt_data *data;        /* of `all` */
    kt_cone *cone;        /* NULL: no contact has friction */
    bool rubs;            /* some have friction */
    bool rests;           /* bounces accumulate: what touches comes to rest */
    bool stops;           /* ends of slip do: what slips slower than its rest velocity comes to rest */
    kt_event_watch watch; /* that of events, with what is done where slip turns */
    kt_status (*begin)(kt_simulation *simulation, kt_error *error); /* that of events */
    KT_ARENA_DECLARE(KT_CONTACT_FIELDS)
};

static inline double kt_contacts_dot(size_t n, const double *x, const double *y) {
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += x[i] * y[i];
    return sum;
}

/* Friction slower than this has come to rest, m/s or rad/s. */
static const double kt_contact_resting = 1e-9;

static inline bool kt_contact_is_closed_in(uint64_t set, const kt_contact *contact) {
    return (set & (contact->bit | contact->back)) == contact->bit;
}
static inline bool kt_contact_is_closed(const kt_model *model, const kt_contact *contact) {
    return kt_contact_is_closed_in(model->set, contact);
}

/* It does not act, whatever its gap (kt_simulation_release). */
bool kt_contact_is_released(const kt_contact *contact);

/* The first row of its equations. */
static inline int kt_contact_row(const kt_model *model, const kt_contact *contact) {
    return model->loop[contact->loop].equation;
}

/* Whether item k is friction of a contact. */
static inline bool kt_contact_rubs(const struct kt_contacts *c, int k) { return k >= c->sides && c->item[k].of >= 0; }

/* Of row k of those that touch: its loop, and the j-th number of its Jacobian. */
const kt_loop_record *kt_contact_loop(const kt_simulation *simulation, int k);
double kt_contact_entry(const struct kt_contacts *c, int k, size_t j);
/* Likewise its rate J v - b' and its acceleration J a - b'', and what rounding of these is relative to: the largest that |J x| can be
 * in the mass metric, sqrt(W_kk) sqrt(x'M x) (Cauchy and Schwarz). The sum of the terms is no measure: of a stop J x is one number, in
 * which forces have cancelled before. */
double kt_contact_rate(const struct kt_contacts *c, const double *W, int k, double *size);
double kt_contact_acceleration(const struct kt_contacts *c, const double *W, int k, double *size);

/* The speed up to which a contact that touches comes to rest, rather than that it bounces: its rest_velocity, or that of a bounce which
 * rounding hides. Requires the equations, and in c->a the accelerations without contacts. */
double kt_contact_rest(const kt_simulation *simulation, const double *W, int k);

/* Of friction: mu of a contact, the largest force at rest in a joint, and the force where slip begins there. */
double kt_contact_coefficient(const kt_model *model, const kt_contact *contact);
double kt_contact_limit(const kt_model *model, const kt_contact *contact);
double kt_contact_slip(const kt_model *model, const kt_contact *contact);

/* The set in which all contacts are open, and friction of joints slips as the velocities say; where it rests, forwards; where it is
 * released, not at all. */
uint64_t kt_contacts_slipping_set(const struct kt_contacts *c, const kt_model *model);

/* The gaps of all contacts; `all`: the rates, drifts and the Jacobian of their equations, too. */
KT_CHECKED kt_status kt_contacts_find_equations(struct kt_contacts *c, const kt_model *model, double t, const double *q,
                                                const double *v, bool all, kt_error *error);

/* From the multipliers in c->row the least ones that give the same forces, to c->reaction: in one unit, which tells normal
 * forces, and then tangential ones in roots of these (linear/coulomb.h). */
KT_CHECKED kt_status kt_contacts_find_reactions(struct kt_contacts *c, const kt_instant *at, kt_error *error);

/* contact_refusal.c. Of rows that close, u < 0: an error where a contact has no lever on any joint, or its motion is prescribed. The data
 * are those of `open`. */
KT_CHECKED kt_status kt_contacts_check_levers(kt_simulation *simulation, const kt_model *open, double t,
                                              const double *W, const double *u, kt_error *error);
/* From the status of a projection onto the loops behind impulses of what came at the speed `approach`, with the
 * velocities v: an error where contacts go on to close since their motion is prescribed. Requires the equations at the present state. */
KT_CHECKED kt_status kt_contacts_check_rates(kt_simulation *simulation, double t, const double *v, double approach,
                                             kt_status status, kt_error *error);
/* Of the multipliers of a record at t (kt_contact_calls.check). */
KT_CHECKED kt_status kt_contacts_check_record(const kt_simulation *simulation, double t, kt_error *error);
/* The error of contacts that have no impulses, or no reactions (`what`). */
kt_status kt_contacts_refuse(kt_simulation *simulation, double t, const char *what, kt_error *error);

/* A phase of an impact (contact_impact.c). By rows of the list, of which the first ones meet: */
typedef struct kt_impact_phase {
    double bound[KT_FAMILY_SWITCHES], least[KT_FAMILY_SWITCHES]; /* the rates behind it, and its impulses, at least */
    double u[KT_COULOMB_ROWS], p[KT_COULOMB_ROWS];               /* rates before it, then behind it; impulses */
    int rows, line[KT_COULOMB_ROWS];                             /* rows that have impulses, in this order */
} kt_impact_phase;

/* contact_friction.c. u + W p of what meets, with friction: |p_t| in Coulomb's cone of the normal impulse, against the slip at the end
 * of the phase. Returns false if there are no such impulses. */
bool kt_contacts_solve_with_friction(kt_simulation *simulation, const double *W, kt_impact_phase *phase);

/* contact_impact.c. With W = J M^-1 J' of the rows that touch and u their rates: impulses; u becomes u+, and c->v the
 * velocities behind; *lost: the kinetic energy that is dissipated. */
KT_CHECKED kt_status kt_contacts_strike(kt_simulation *simulation, double t, const double *W, double *u, double *lost,
                                        kt_error *error);
/* From the accelerations without contacts in c->a: which of those that do not part are closed, and what sticks, to the bits of
 * *on; directions of slip to memory.slip. leaving: whose reaction or stick has come to an end. */
KT_CHECKED kt_status kt_contacts_press(kt_simulation *simulation, double t, const double *W, const double *u,
                                       uint64_t leaving, uint64_t *on, kt_error *error);

/* Where no accelerations obey Coulomb's law (Painleve's paradox): impulses without a collision, by which what slips comes to rest, or turns.
 * Returns false if there are none; otherwise u and c->v are those behind them, and *lost grows by the energy that they dissipate. */
bool kt_contacts_jam(kt_simulation *simulation, const double *W, double *u, double *lost);

/* contact_model.c. Prepares the masks, at the start. */
void kt_contacts_init_masks(kt_simulation *simulation);
/* The model of a set of what is closed in the present state; data of the simulation are adapted to any model then. tried: the simulation
 * does not run on it, and the next one that is tried takes its place. */
const kt_model *kt_contacts_model(kt_simulation *simulation, uint64_t set, bool tried);
/* The same with the ranks of a checkpoint, which are saved of the present model; NULL: there is no such set. */
const kt_model *kt_contacts_restored_model(kt_simulation *simulation, uint64_t set, const double *ranks);
void kt_contacts_save_ranks(const kt_simulation *simulation, double *ranks);
/* Takes parameters that have been set over into the model that the simulation runs on. */
void kt_contacts_renew_model(kt_simulation *simulation);

/* How many such loops a model has, closed and open. */
size_t kt_contacts_of(const kt_model *model);

/* Bytes of the memory for n contacts of a model, of all its sets. */
size_t kt_contacts_size(const kt_model *model, size_t n);

/* Lists the contacts and adds their events, the first of all. `simulation` has its model, data and memory. */
KT_CHECKED kt_status kt_contacts_init(kt_simulation *simulation, kt_error *error);

#endif
