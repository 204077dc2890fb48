/* Which rows that touch depend on those of closed contacts, in the metric of W = J M^-1 J'.
 *
 * If the row of a joint's friction depends on these rows, the joint does not move, and its friction sticks. A grazing
 * contact is closed without a reaction only if its row does not depend on these rows, so that no equation is
 * redundant. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/contact.h"
#include "linear/cholesky.h"

#include <math.h>

/* The number of times that contacts replace each other within an instant before they stay closed. */
enum { TURNS = 3 };

/* Orthogonalises row i in the metric of W against n independent rows. Returns the square of its remaining length. L
 * gets row n of their Cholesky factor, except its last number. */
static double orthogonalise_row(const struct kt_contacts *c, int n, int i) {
    double *L = c->L + (ptrdiff_t)n * c->touching;
    for (int j = 0; j < n; j++)
        L[j] = kt_contacts_between(c, i, c->independent[j]);
    return kt_cholesky_add_row(c->L, c->touching, n, kt_contacts_own(c, i));
}

static bool is_independent(const struct kt_contacts *c, int i, double left) {
    return left > kt_contact_rounding * kt_contacts_own(c, i);
}

/* Adds row i to the n independent rows, unless it depends on them. Returns their number. */
static int add_independent(struct kt_contacts *c, int n, int i) {
    const double left = orthogonalise_row(c, n, i);
    if (!is_independent(c, i, left) || n >= (int)c->selected->of->v_count)
        return n;
    c->L[(ptrdiff_t)n * c->touching + n] = sqrt(left);
    c->independent[n] = i;
    return n + 1;
}

/* Finds friction of joints that slips at no rate, since closed contacts, loops or other sticking friction hold the
 * joint. Then the row of this friction depends on their rows: orthogonalisation in the metric of W leaves zero. Its
 * rate is rounding until its constraints move. Slip has reversed if it is against its direction and faster than rest.
 * Friction that is spared has no lever at all: loops alone hold its joint. */
static uint64_t find_held_in_island(const kt_simulation *simulation) {
    struct kt_contacts *c = simulation->contacts;
    int n = 0;
    uint64_t held = 0;
    for (int i = 0; i < c->touching; i++)
        if (kt_contact_is_closed(simulation->model, &c->item[c->list[i]]))
            n = add_independent(c, n, i);
    for (int i = c->meeting; i < c->resting; i++) {
        const kt_contact *item = &c->item[c->list[i]];
        if (!kt_contact_is_closed(simulation->model, item) && fabs(c->v[item->v]) <= c->rest_rate[c->list[i]] &&
            !is_independent(c, i, orthogonalise_row(c, n, i)))
            held |= item->bit;
    }
    return held;
}

uint64_t kt_contacts_find_held(const kt_simulation *simulation) {
    struct kt_contacts *c = simulation->contacts;
    uint64_t held = 0;
    for (int i = 0; i < c->islands; i++) {
        (void)kt_contacts_select(c, i);
        held |= find_held_in_island(simulation);
    }
    for (int k = c->sides; k < c->n; k++)
        held |= c->item[k].spared ? c->item[k].bit : 0;
    return held;
}

/* A contact grazes if its gap closes no faster than its rest velocity, or if the contact grazed when it closed and has
 * not opened since. A contact that touches at rest grazes if another one leaves, whose load it may take over: nothing
 * accelerates the next corner of a box that tilts at the instant itself. A grazing contact whose friction leaves has no
 * load, such as in flight, and opens. Otherwise its friction would stick and leave without end. */
void kt_contacts_find_grazing(kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    bool leaves = false;
    for (int i = 0; i < c->meeting; i++)
        leaves = leaves || c->item[c->list[i]].leaves;
    for (int i = 0; i < c->meeting; i++) {
        kt_contact *item = &simulation->contacts->item[c->list[i]];
        const double rest = item->meets ? kt_contact_loop(simulation, i)->rest_velocity : 0.0;
        const bool slow = fabs(c->u[i]) <= fmax(rest, kt_contact_resting(simulation, c->list[i]));
        item->grazes = kt_contact_is_closed(simulation->model, item)
                           ? simulation->contact_state[item->index].opens_at < 0.0 && !item->leaves &&
                                 (item->of < 0 || !c->item[item->of].leaves)
                           : slow && (item->meets || (leaves && !item->leaves));
    }
}

/* The weight of a box on three of its corners may lie on a diagonal. Then two reactions carry the weight, and the third
 * is of the size of rounding; so is the reaction of the fourth corner if this corner replaces the third. If slip is
 * slow, friction changes so fast that either reaction ends as soon as its contact replaces the other contact. After
 * some replacements within one instant, such a contact stays closed like a grazing contact, for a short time regardless
 * of its reaction. Events within that time decide anew. */
static double opening_reaction_of(kt_simulation *simulation, int i) {
    const struct kt_contacts *c = simulation->contacts;
    const int k = c->list[i];
    double size;
    if (c->item[k].next != KT_CONTACT_ON || simulation->contact_state[k].left < TURNS)
        return 0.0;
    kt_contact_hold_turning(simulation, k);
    (void)kt_contact_acceleration(c, i, &size);
    return -2.0 * kt_contact_grazing * size / kt_contacts_own(c, i);
}

/* The weights of the forces of contacts and dry friction that touch (cone/statics.h). */
static void store_metrics(kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    for (int i = 0; i < c->resting; i++)
        simulation->contact_state[c->list[i]].metric = kt_contacts_own(c, i);
    for (int i = c->resting; i < c->touching; i += 2) {
        double *metric = &simulation->contact_state[c->item[c->list[i]].of].metric;
        *metric = (*metric + kt_contacts_own(c, i) + kt_contacts_own(c, i + 1)) / 3.0;
    }
}

void kt_contacts_close_grazing(kt_simulation *simulation) {
    struct kt_contacts *c = simulation->contacts;
    bool any = false;
    int n = 0;
    store_metrics(simulation);
    for (int i = 0; i < c->meeting; i++) {
        simulation->contact_state[c->list[i]].opens_at = opening_reaction_of(simulation, i);
        any = any || (c->item[c->list[i]].grazes && c->item[c->list[i]].next == KT_CONTACT_OFF);
    }
    for (int i = 0; any && i < c->touching; i++)
        if (c->item[c->list[i]].next == KT_CONTACT_ON)
            n = add_independent(c, n, i);
    for (int i = 0; any && i < c->meeting; i++) {
        kt_contact *item = &c->item[c->list[i]];
        double size;
        (void)kt_contact_acceleration(c, i, &size);
        const double left = orthogonalise_row(c, n, i);
        if (!item->grazes || item->next != KT_CONTACT_OFF || !(fabs(c->w[i]) <= kt_contact_grazing * size) ||
            !is_independent(c, i, left) || kt_contact_row_slips(c, i))
            continue;
        item->next = KT_CONTACT_ON;
        if (item->of >= 0)
            c->item[item->of].next = KT_CONTACT_ON;
        simulation->contact_state[item->index].opens_at = -2.0 * kt_contact_grazing * size / left;
        for (int j = i; j < c->touching; j++)
            if (j == i || c->list[j] == item->of)
                n = add_independent(c, n, j);
    }
}
