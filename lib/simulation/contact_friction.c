/* Impacts and reactions of touching contacts with Coulomb's friction, with linear/coulomb.h.
 *
 * Impacts: in each phase (contact_impact.c), Coulomb's law relates the impulses and the slip at its end, in one step. A
 * contact sticks if its impulse lies in the cone, and slips against it otherwise. Dry friction of joints has no
 * impulse.
 *
 * Reactions, at accelerations: a slipping contact has a given direction of friction. A resting contact sticks or begins
 * to slip against its friction. Dry friction of joints is among the items.
 */
#include "base/copy.h"
#include "linear/coulomb.h"
#include "simulation/contact.h"

#include <math.h>

/* Relative rounding, as in contact.c. */
static const double rounding = 1e-11;

/* The rows of the problem: the rows of the list that take part. */
typedef struct problem {
    kt_coulomb c;
    kt_coulomb_solution solution;
    int item[KT_COULOMB_ITEMS]; /* the first row of each item in the list */
} problem;

static void begin(problem *p, const struct kt_contacts *c, const double *W) {
    p->c.n = p->c.rows = 0;
    p->c.W = W;
    p->c.stride = c->touching;
    p->c.size = 0.0;
}

static int add_line(problem *p, int line) {
    p->c.line[p->c.rows] = line;
    return p->c.rows++;
}

/* The first row of the list of a contact's friction. */
static int friction_line(const struct kt_contacts *c, int line) {
    for (int i = c->resting; i < c->touching; i++)
        if (c->list[i] == c->item[c->list[line]].of)
            return i;
    return -1;
}

/* Adds the contact or the dry friction of a row of the list, with the rows of its friction. */
static kt_coulomb_item *add_item(problem *p, const kt_simulation *simulation, int line) {
    const struct kt_contacts *c = simulation->contacts;
    const int friction = line < c->meeting ? friction_line(c, line) : -1;
    kt_coulomb_item *item = &p->c.item[p->c.n];
    p->item[p->c.n++] = line;
    *item = (kt_coulomb_item){.type = KT_COULOMB_FRICTIONLESS, .row = add_line(p, line)};
    if (friction >= 0) {
        item->type = KT_COULOMB_CONE;
        item->friction = kt_contact_coefficient(simulation->model, &c->item[c->list[friction]]);
        item->across = add_line(p, friction);
        (void)add_line(p, friction + 1);
    }
    return item;
}

/* ---- impacts ----------------------------------------------------------------------------------------------------- */

bool kt_contacts_solve_with_friction(kt_simulation *simulation, const double *W, kt_impact_phase *phase) {
    const struct kt_contacts *c = simulation->contacts;
    double size;
    problem p;
    begin(&p, c, W);
    for (int i = 0; i < c->meeting; i++)
        add_item(&p, simulation, i)->least = phase->least[i];
    for (int j = 0; j < p.c.rows; j++) {
        (void)kt_contact_rate(c, W, p.c.line[j], &size);
        p.c.size = fmax(p.c.size, size);
        p.c.b[j] = phase->u[p.c.line[j]];
    }
    for (int i = 0; i < p.c.n; i++)
        p.c.b[p.c.item[i].row] -= phase->bound[i];
    if (!kt_coulomb_solve(&p.c, c->cone, false, &p.solution, &simulation->memory.contacts.pivots))
        return false;
    phase->rows = p.c.rows;
    for (int j = 0; j < p.c.rows; j++) {
        phase->line[j] = p.c.line[j];
        phase->p[p.c.line[j]] = p.solution.p[j];
        phase->u[p.c.line[j]] = p.solution.u[j];
    }
    for (int i = 0; i < p.c.n; i++)
        phase->u[i] = phase->p[i] > phase->least[i] ? phase->bound[i] : phase->u[i] + phase->bound[i];
    return true;
}

/* The paradox's problem is that of an impact without approach. Zero impulse is one solution; another one stops slip. */
bool kt_contacts_jam(kt_simulation *simulation, const double *W, double *u, double *lost) {
    struct kt_contacts *c = simulation->contacts;
    double most = 0.0, energy = 0.0;
    problem p;
    begin(&p, c, W);
    for (int i = 0; i < c->meeting; i++)
        if (u[i] <= kt_contact_rest(simulation, W, i))
            (void)add_item(&p, simulation, i);
    for (int j = 0; j < p.c.rows; j++) {
        p.c.b[j] = u[p.c.line[j]];
        p.c.size = fmax(p.c.size, fabs(p.c.b[j]));
    }
    for (int i = 0; i < p.c.n; i++)
        p.c.b[p.c.item[i].row] = 0.0;
    if (p.c.n == 0 || !kt_coulomb_solve(&p.c, c->cone, false, &p.solution, &simulation->memory.contacts.pivots))
        return false;
    for (int j = 0; j < p.c.rows; j++) {
        most = fmax(most, fabs(p.solution.p[j]));
        energy -= 0.5 * p.solution.p[j] * (p.c.b[j] + p.solution.u[j]);
    }
    if (!(most > 0.0) || !(energy >= 0.0))
        return false;
    for (int j = 0; j < p.c.rows; j++)
        for (size_t i = 0; i < simulation->size.nv; i++)
            c->v[i] += p.solution.p[j] * c->response[(size_t)p.c.line[j] * simulation->size.nv + i];
    for (int i = 0; i < c->touching; i++)
        for (int j = 0; j < p.c.rows; j++)
            u[i] += W[i * c->touching + p.c.line[j]] * p.solution.p[j];
    *lost += energy;
    simulation->memory.contacts.jammed++;
    return true;
}

/* ---- reactions --------------------------------------------------------------------------------------------------- */

/* Adds a contact that does not part. If it slips, its direction is given. */
static void add_contact(problem *p, const kt_simulation *simulation, int line, const double *u, uint64_t leaving) {
    const struct kt_contacts *c = simulation->contacts;
    kt_coulomb_item *item = add_item(p, simulation, line);
    if ((leaving & c->item[c->list[line]].bit) != 0)
        item->refused = ~(1U << KT_COULOMB_OPEN);
    if (item->type != KT_COULOMB_CONE)
        return;
    const double *slip = u + p->c.line[item->across], speed = hypot(slip[0], slip[1]);
    if (speed > (c->stops ? kt_contact_loop(simulation, line)->rest_velocity : kt_contact_resting)) {
        item->type = KT_COULOMB_SLIPS;
        item->e[0] = slip[0] / speed;
        item->e[1] = slip[1] / speed;
    } else if ((leaving & c->item[c->item[c->list[line]].of].bit) != 0) {
        item->refused |= 1U << KT_COULOMB_STICK;
    }
}

static void add_dry(problem *p, const kt_simulation *simulation, int line, uint64_t leaving) {
    const kt_contact *friction = &simulation->contacts->item[simulation->contacts->list[line]];
    kt_coulomb_item *item = add_item(p, simulation, line);
    item->type = KT_COULOMB_DRY;
    item->friction = kt_contact_limit(simulation->model, friction);
    item->refused = (leaving & friction->bit) != 0 ? 1U << KT_COULOMB_STICK : 0;
}

/* Sets the rows that take part, and their accelerations without reactions. strict: contacts that part below their rest
 * velocity are left out, too. */
static void set_problem(problem *p, const kt_simulation *simulation, const double *W, const double *u, uint64_t leaving,
                        bool strict) {
    const struct kt_contacts *c = simulation->contacts;
    double size;
    begin(p, c, W);
    for (int i = 0; i < c->resting; i++) {
        (void)kt_contact_rate(c, W, i, &size);
        if (i >= c->meeting && fabs(c->v[c->item[c->list[i]].v]) <= kt_contact_resting)
            add_dry(p, simulation, i, leaving);
        else if (i < c->meeting && u[i] <= fmax(strict ? 0.0 : kt_contact_rest(simulation, W, i), rounding * size))
            add_contact(p, simulation, i, u, leaving);
    }
    for (int j = 0; j < p->c.rows; j++) {
        const double free = kt_contact_acceleration(c, W, p->c.line[j], &size);
        p->c.b[j] = fabs(free) <= rounding * size ? 0.0 : free;
        p->c.size = fmax(p->c.size, size);
    }
    /* At rest, the model has friction of joints that slips forwards. */
    for (int k = 0; k < p->c.n; k++)
        for (int j = 0; p->c.item[k].type == KT_COULOMB_DRY && j < p->c.rows; j++)
            p->c.b[j] += kt_coulomb_entry(&p->c, j, p->c.item[k].row) *
                         kt_contact_slip(simulation->model, &c->item[c->list[p->item[k]]]);
}

/* Writes the bits of the set, and the directions of slip. */
static void apply(kt_simulation *simulation, const problem *p, uint64_t *on) {
    const struct kt_contacts *c = simulation->contacts;
    *on = kt_contacts_slipping_set(c, simulation->model) & c->mask;
    for (int i = 0; i < p->c.n; i++) {
        const kt_contact *contact = &c->item[c->list[p->item[i]]];
        const kt_coulomb_mode mode = p->solution.mode[i];
        const kt_coulomb_type type = p->c.item[i].type;
        if (type == KT_COULOMB_DRY) {
            *on |= mode == KT_COULOMB_STICK ? contact->bit : mode == KT_COULOMB_SLIP_BACK ? contact->back : 0;
            continue;
        }
        if (mode == KT_COULOMB_OPEN || !(p->solution.p[p->c.item[i].row] > 0.0))
            continue;
        *on |= contact->bit;
        if (type == KT_COULOMB_CONE && mode == KT_COULOMB_STICK)
            *on |= c->item[contact->of].bit;
        else if (type != KT_COULOMB_FRICTIONLESS)
            memcpy(simulation->memory.slip[contact->index], p->solution.e[i], sizeof p->solution.e[i]);
    }
}

kt_status kt_contacts_press(kt_simulation *simulation, double t, const double *W, const double *u, uint64_t leaving,
                            uint64_t *on, kt_error *error) {
    kt_contact_counts *counts = &simulation->memory.contacts;
    problem p;
    bool found = false;
    /* The second attempt lets leaving contacts stay, since forces have been redistributed. Third attempt: corners of a
     * body may part at different speeds below the rest velocity. They cannot always rest together, since their rates
     * are not those of rest. Then they part. */
    for (int attempt = 0; attempt < 3 && !found; attempt++) {
        if (attempt == 1 && leaving == 0)
            continue;
        set_problem(&p, simulation, W, u, attempt == 0 ? leaving : 0, attempt == 2);
        found = kt_coulomb_solve(&p.c, simulation->contacts->cone, true, &p.solution, &counts->pivots);
    }
    if (!found)
        return kt_contacts_refuse(simulation, t, "reactions", error);
    counts->undecided += p.solution.count > 1;
    counts->shared += p.solution.shares;
    apply(simulation, &p, on);
    return KT_OK;
}
