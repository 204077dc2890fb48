/* Time stepping over impacts (moreau.c), for the files of this folder and of simulation/. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONTACT_MOREAU_H
#define KT_CONTACT_MOREAU_H

#include "cone/cone.h"
#include "contact/contact.h"

#include <math.h>

/* The reason why a contact takes no part in a step: the contact does not close, or other loops hold its gap. */
enum { KT_MOREAU_NO_PART = -1, KT_MOREAU_HELD = -2 };

/* Every array: type, name, count, meaning. An item is a contact, or dry friction of a joint. The rows of an item are in
 * struct kt_contacts. */
#define KT_MOREAU_FIELDS(X)                                                                                            \
    X(double, y, state, "the state in the middle of the step: q, then the velocities without impulses, and x")         \
    X(double, middle, n->v, "vm")                                                                                      \
    X(double, after, n->v, "velocities at the end")                                                                    \
    X(double, change, n->v, "scratch: displacements")                                                                  \
    X(double, position, n->q, "scratch, or the middle before its displacement")                                        \
    X(double, rate, n->x, "scratch: of auxiliary states")                                                              \
    X(int, item_of, s->n, "of each contact: its item, or a reason why it has none")                                    \
    X(int, item, s->n, "the contact, or dry friction")                                                                 \
    X(kt_moreau_island, island, s->islands, "items of each island of contacts")                                        \
    X(int, chosen, s->most_items, "scratch: items of a problem")                                                       \
    X(double, none, s->most_items, "scratch: zeros")                                                                   \
    X(double, impulse, 3 * s->most_items, "scratch: of a problem")                                                     \
    X(double, coefficient, s->most_items, "likewise: of friction")                                                     \
    X(double, limits, s->most_items, "likewise: of dry friction")                                                      \
    X(uint64_t, branches, s->n, "of the tree: bits of those on which its rows depend")                                 \
    X(int, first, s->n, "its first row in the list of all rows")                                                       \
    X(double, bound, s->n, "the least rate at the end")                                                                \
    X(double, e, s->n, "restitution; 0: it does not bounce")                                                           \
    X(double, mu, s->n, "coefficients of friction")                                                                    \
    X(double, limit, s->n, "impulses of dry friction; negative: a contact")                                            \
    X(double, viscous, s->n, "of dry friction: the viscous force")                                                     \
    X(double, begin, s->list, "rates of rows at the beginning of the step")                                            \
    X(double, free, s->list, "rates of rows at its end, without impulses")                                             \
    X(double, b, 3 * s->most_items, "of the cone solver")                                                              \
    X(double, p, 3 * s->n, "impulses")                                                                                 \
    X(kt_contact_memory, saved, s->n, "of contacts before the last step was accepted")                                 \
    X(double, tau, n->v, "of a record: torques, and forces of contacts in joints")                                     \
    X(kt_wrench, external, n->body, "of a record: wrenches on bodies, and of contacts")                                \
    X(kt_wrench, loop, n->loop, "of a record: wrenches of contacts, as loops have them")                               \
    X(double, multiplier, s->rows, "of a record: of the equations of all contacts")

/* An island of contacts (contact/islands.c). */
typedef struct kt_moreau_island {
    int known;         /* the impulses of so many rows are known; -1: none, since velocities have changed */
    bool fails;        /* the cone solver did not find these impulses */
    double dissipated; /* energy dissipated by these impulses */
} kt_moreau_island;

/* The counts of the last step, which are added once the step is accepted. */
typedef struct kt_moreau_counts {
    uint64_t closed, newton, failures, reduced;
    double penetration, supplied, dissipated;
} kt_moreau_counts;

typedef struct kt_moreau {
    double h, t; /* length of the last step, s, and the time of its middle */
    bool has_inverse;
    bool only_normal; /* the problem of the cone solver has normal rows alone */
    int posed;        /* items in it */
    int count;        /* number of items */
    int dry;          /* number of items of dry friction, which come first */
    kt_cone *cone;
    kt_moreau_counts counts;
    kt_contact_counts saved_counts; /* before the last step was accepted */
    KT_ARENA_DECLARE(KT_MOREAU_FIELDS)
} kt_moreau;

/* Bytes of the memory for simulations of a model with n numbers of state; 0 without contacts. */
size_t kt_moreau_size(const kt_model *model, size_t n);
/* Prepares a simulation whose contacts are laid out (kt_contacts_init). */
void kt_moreau_init(kt_simulation *simulation);

/* Opens all contacts of a simulation, and takes the callbacks of the integrator for time steps. */
void kt_moreau_open(kt_simulation *simulation);

/* The steps of the integrator. */
extern const struct kt_leap kt_moreau_leap;

/* b' of the equation of a row of a contact, in the state of the last equations; and the rows of an item. */
static inline double kt_moreau_right(const struct kt_contacts *c, int k, int component) {
    return c->rate[kt_contact_row(c->all, &c->item[k]) + component];
}
/* The least rate of a contact at the end. */
static inline double kt_moreau_bound(const kt_moreau *m, int i) {
    return m->e[i] > 0.0 ? -m->e[i] * m->begin[m->first[i]] : m->bound[i];
}
static inline int kt_moreau_rows(const kt_moreau *m, int i) { return m->limit[i] < 0.0 && m->mu[i] > 0.0 ? 3 : 1; }

/* Gaps down to minus this number are rounding of positions. */
static inline double kt_moreau_tolerance(const struct kt_contacts *c) { return 1e-15 * c->all->length; }
/* The entry of W in rows i and k of the selected island. */
static inline double kt_moreau_entry(const struct kt_contacts *c, int i, int k) {
    const int stride = c->selected->stored;
    return c->touching <= stride ? c->W[(ptrdiff_t)i * stride + k]
           : i <= k              ? kt_contacts_product(c, i, k)
                                 : kt_contacts_product(c, k, i);
}
/* Computes the gaps of all contacts, and the equations of all items but friction of contacts (moreau_items.c). */
KT_CHECKED kt_status kt_moreau_find_gaps(struct kt_contacts *c, const kt_model *model, const kt_dynamic_state *at,
                                         kt_error *error);
/* Whether impulses of item i may change rates of item k. */
static inline bool kt_moreau_couples(const kt_moreau *m, int i, int k) {
    return (m->branches[i] & m->branches[k]) != 0;
}
/* Chooses all items of the selected island (m->chosen). Returns their number. */
int kt_moreau_choose_island(const kt_simulation *simulation);
/* Adds a multiple of the response to row r of item i, which is in the selected island, to velocities
 * (moreau_items.c). */
void kt_moreau_add_response(const kt_simulation *simulation, int i, int r, double p, double *v);

/* Parts of a step, with the middle in m->y and the velocities v at the beginning (moreau_items.c, moreau_solve.c).
 *
 * kt_moreau_begin finds the equations in the middle, and the dry friction of joints, which takes part always.
 *
 * kt_moreau_take_free receives velocities without impulses in m->y, and copies these velocities to m->after.
 *
 * kt_moreau_add_closing adds contacts that close within the step at the velocities m->after.
 *
 * kt_moreau_solve computes the impulses, and m->after with them.
 *
 * kt_moreau_correct moves the middle out of contacts, and updates their gaps. m->position: the middle before.
 * begins: impulses of the step are not known yet. Then closed contacts of bodies at rest become closed exactly, up to
 * kt_moreau_settled_gap: the largest gap that the cone solver's residual explains; negative for any other contact.
 *
 * kt_moreau_settle_gaps sets such gaps to zero, and kt_moreau_renew_laws updates bounds, behind a displacement. */
KT_CHECKED kt_status kt_moreau_begin(kt_simulation *simulation, double t, const double *v, kt_error *error);
void kt_moreau_take_free(kt_simulation *simulation, double h);
KT_CHECKED kt_status kt_moreau_add_closing(kt_simulation *simulation, double h, const double *v, bool *any,
                                           kt_error *error);
KT_CHECKED kt_status kt_moreau_solve(kt_simulation *simulation, kt_error *error);
void kt_moreau_correct(kt_simulation *simulation, double h, bool begins);
void kt_moreau_renew_laws(kt_simulation *simulation, double h);
double kt_moreau_settled_gap(const kt_simulation *simulation, int k, double h);
void kt_moreau_settle_gaps(kt_simulation *simulation, double h);

/* Checks the laws of contacts and Newton's law of the step (moreau_check.c). Scratch arrays change, and
 * m->middle. */
KT_CHECKED kt_status kt_moreau_check(kt_simulation *simulation, double h, kt_error *error);

/* Records (moreau_record.c): adds the forces of contacts to simulation->tau and ->external, and shows a record whose
 * data belong to the model in which all contacts are closed. */
KT_CHECKED kt_status kt_moreau_begin_record(kt_simulation *simulation, double t, kt_error *error);
KT_CHECKED kt_status kt_moreau_end_record(kt_simulation *simulation, kt_record *record, kt_error *error);

#endif
