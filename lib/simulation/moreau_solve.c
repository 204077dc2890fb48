/* The impulses of a step (moreau.c): the contacts that take part, their responses, and the problem for the cone
 * solver. */
#include "simulation/moreau.h"

#include "base/copy.h"
#include "control/mass_inverse.h"
#include "dynamics/dynamics.h"
#include "integrator/integrator.h"
#include "mechanism/evaluate.h"

#include <math.h>
#include <stdio.h>

/* Gaps below this part of the mechanism's length, or of 1 m or rad, are rounding. */
static const double rounding = 1e-13;

/* The cone solver ends at this residual. */
static const double enough = 1e-7;
enum { HALVINGS = 10 };

static double tolerance_of(const struct kt_contacts *c) { return rounding * fmax(1.0, c->all->length); }

double kt_moreau_rate(const struct kt_contacts *c, int k, int component, const double *x) {
    const kt_contact *item = &c->item[k];
    const size_t rows = c->all->n.row, row = (size_t)kt_contact_row(c->all, item) + (size_t)component;
    double sum = -c->rate[row];
    for (size_t j = 0; j < c->all->n.v; j++)
        sum += c->jacobian[j * rows + row] * x[j];
    return item->sign * sum;
}

double kt_moreau_right(const struct kt_contacts *c, int k, int component) {
    return c->rate[kt_contact_row(c->all, &c->item[k]) + component];
}

int kt_moreau_rows(const kt_moreau *m, int i) { return m->limit[i] < 0.0 && m->mu[i] > 0.0 ? 3 : 1; }

/* ---- items ------------------------------------------------------------------------------------------------------- */

static void add_moreau_row(kt_simulation *simulation, int k, int component, const double *v) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    m->begin[c->touching] = kt_moreau_rate(c, k, component, v);
    m->free[c->touching] = kt_moreau_rate(c, k, component, m->y + simulation->size.nq);
    c->list[c->touching] = k;
    c->component[c->touching++] = component;
}

static int add_moreau_item(kt_simulation *simulation, int k, const double *v) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    const double *force = simulation->contact_state[k].force;
    const int i = m->count++, of = c->item[k].of;
    m->place[k] = i;
    m->item[i] = k;
    m->first[i] = c->touching;
    m->mu[i] = m->bound[i] = m->e[i] = 0.0;
    m->limit[i] = -1.0;
    for (int r = 0; r < 3; r++)
        m->p[3 * i + r] = m->h * force[r];
    add_moreau_row(simulation, k, 0, v);
    if (k < c->sides && of >= 0) {
        m->mu[i] = kt_contact_coefficient(simulation->model, &c->item[of]);
        for (int component = 0; component < 2 && m->mu[i] > 0.0; component++)
            add_moreau_row(simulation, of, component, v);
    }
    return i;
}

/* The law of a contact: whether it bounces, and the least rate at the end otherwise. */
static void set_law(const kt_simulation *simulation, int i, double h) {
    kt_moreau *m = simulation->moreau;
    const int k = m->item[i];
    const kt_loop_record *loop = &simulation->model->loop[simulation->contacts->item[k].loop];
    const double begin = m->begin[m->first[i]], fall = begin - m->free[m->first[i]];
    const bool bounces = loop->restitution > 0.0 && -begin > fmax(loop->rest_velocity, fall);
    m->e[i] = bounces ? loop->restitution : 0.0;
    m->bound[i] = fmin(-simulation->contacts->gap[k] / h, fmax(-begin, 0.0));
}

/* The dry force of a joint that slips at the rate v: that of its effect, without the viscous part. */
static double dry_force_of(const kt_simulation *simulation, const kt_contact *item, double v) {
    kt_effect_record effect = *kt_effect_record_find(simulation->model, item->effect);
    effect.idle = false;
    if (fabs(v) <= kt_contact_resting)
        return kt_contact_limit(simulation->model, item);
    effect.direction = v > 0.0 ? 1.0 : -1.0;
    effect.viscous = 0.0;
    return fabs(
        kt_value(kt_effect_kind_of(effect.type)
                     ->joint_force(&effect, simulation->model->number, kt_real_of(0.0), kt_real_of(v), 0.0, NULL)));
}

/* Adds all dry friction of joints that acts. */
static void add_dry_friction(kt_simulation *simulation, double h, const double *v) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    for (int k = c->sides; k < c->n; k++) {
        if (kt_contact_rubs(c, k) || kt_contact_is_released(&c->item[k]))
            continue;
        const int i = add_moreau_item(simulation, k, v);
        m->limit[i] = h * dry_force_of(simulation, &c->item[k], v[c->item[k].v]);
    }
    m->dry = m->count;
}

/* ---- responses --------------------------------------------------------------------------------------------------- */

static kt_status prepare_inverse(kt_simulation *simulation, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    kt_mass_inverse *inverse = NULL;
    kt_status status = kt_mass_inverse_init(simulation->model, 0, c->inverse_memory, c->inverse_size, &inverse, error);
    if (status == KT_OK)
        status = kt_mass_inverse_compute(inverse, simulation->data, m->t, m->y, error);
    m->has_inverse = status == KT_OK;
    return status;
}

/* M^-1 J' of the rows from `first` on, and their entries of W. */
static kt_status respond_to_rows(kt_simulation *simulation, int first, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    const size_t nv = simulation->size.nv;
    kt_status status = m->has_inverse ? KT_OK : prepare_inverse(simulation, error);
    for (int r = first; r < c->touching; r++)
        for (size_t j = 0; j < nv; j++)
            c->response[(size_t)r * nv + j] = kt_contact_entry(c, r, j);
    if (status == KT_OK)
        status = kt_mass_inverse_apply((kt_mass_inverse *)(void *)c->inverse_memory, c->touching - first,
                                       c->response + (size_t)first * nv, error);
    const bool is_stored = c->touching <= m->stride;
    if (!is_stored)
        kt_contacts_keep_rows(c);
    for (int s = 0; status == KT_OK && is_stored && s < c->touching; s++) {
        const int from = s > first ? s : first;
        double *W = c->W + (size_t)s * (size_t)m->stride;
        kt_contacts_multiply(c, s, from, W);
        for (int r = from; r < c->touching; r++)
            c->W[r * m->stride + s] = W[r];
    }
    return status;
}

/* Adds a multiple of the response of row r to velocities. */
static void add_response(const kt_simulation *simulation, int r, double p, double *v) {
    const double *response = simulation->contacts->response + (size_t)r * simulation->size.nv;
    for (size_t j = 0; p != 0.0 && j < simulation->size.nv; j++)
        v[j] += p * response[j];
}

/* Whether a contact closes within the step at the velocities m->after. */
static bool is_closing(const kt_simulation *simulation, int k, double h) {
    const struct kt_contacts *c = simulation->contacts;
    return c->gap[k] + h * kt_moreau_rate(c, k, 0, simulation->moreau->after) < -tolerance_of(c);
}

/* Whether a contact was closed in the last step and does not bounce. It most probably takes part, and does not disturb
 * if it opens: its impulse is then zero. */
static bool was_closed(const kt_simulation *simulation, int k, const double *v) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_loop_record *loop = &simulation->model->loop[c->item[k].loop];
    return simulation->contact_state[k].closed != 0 &&
           (!(loop->restitution > 0.0) || -kt_moreau_rate(c, k, 0, v) <= loop->rest_velocity);
}

/* Adds contacts that take part; begins: with those of the last step. */
static bool list_closing(kt_simulation *simulation, double h, const double *v, bool begins) {
    const struct kt_contacts *c = simulation->contacts;
    bool any = false;
    for (int k = 0; k < c->sides; k++) {
        if (simulation->moreau->place[k] != KT_MOREAU_NO_PART || kt_contact_is_released(&c->item[k]) ||
            !(is_closing(simulation, k, h) || (begins && was_closed(simulation, k, v))))
            continue;
        set_law(simulation, add_moreau_item(simulation, k, v), h);
        any = true;
    }
    return any;
}

/* The largest depth in the middle. */
static double depth_of(const struct kt_contacts *c) {
    double most = 0.0;
    for (int k = 0; k < c->sides; k++)
        if (!kt_contact_is_released(&c->item[k]))
            most = fmax(most, -c->gap[k]);
    return most;
}

kt_status kt_moreau_begin(kt_simulation *simulation, double t, double h, const double *v, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    kt_status status = kt_contacts_find_equations(c, simulation->model, t, m->y, v, true, error);
    if (status != KT_OK)
        return status;
    m->counts.penetration = depth_of(c);
    m->has_inverse = false;
    m->t = t;
    c->touching = 0;
    for (int k = 0; k < c->n; k++)
        m->place[k] = KT_MOREAU_NO_PART;
    add_dry_friction(simulation, h, v);
    return m->dry > 0 ? respond_to_rows(simulation, 0, error) : KT_OK;
}

void kt_moreau_take_free(kt_simulation *simulation, double h) {
    const struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    double *free = m->y + simulation->size.nq;
    for (int i = 0; i < m->dry; i++) {
        const kt_contact *item = &c->item[m->item[i]];
        const double viscous = kt_effect_record_find(simulation->model, item->effect)->viscous;
        add_response(simulation, m->first[i], -h * viscous * m->middle[item->v], free);
    }
    for (int r = 0; r < c->touching; r++)
        m->free[r] = kt_moreau_rate(c, c->list[r], c->component[r], free);
    for (int i = m->dry; i < m->count; i++)
        set_law(simulation, i, h);
    kt_copy(m->after, free, simulation->size.nv * sizeof *free);
}

/* Spares contacts from item `from` on that have no lever: other loops hold their gaps (kt_contacts_spare_held). Their
 * rates in the middle are not zero, since v belongs to the beginning. If loops move, they may close a gap.
 * *any: whether any contact is spared. */
static kt_status spare_held_items(kt_simulation *simulation, int from, bool *any, kt_error *error) {
    const struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    double square = 0.0;
    const kt_status status = kt_contacts_find_unit(simulation, simulation->model, m->y, &square, error);
    *any = false;
    for (int i = from; status == KT_OK && i < m->count; i++) {
        const int r = m->first[i];
        const double own = c->touching <= m->stride ? c->W[r * m->stride + r] : kt_contacts_product(c, r, r);
        const bool closes = m->begin[r] < -kt_contact_resting || m->free[r] < -kt_contact_resting;
        if ((c->all->driven && closes) || kt_contact_has_lever(c, m->item[i], own, square))
            continue;
        m->place[m->item[i]] = KT_MOREAU_HELD;
        *any = true;
    }
    return status;
}

kt_status kt_moreau_add_closing(kt_simulation *simulation, double h, const double *v, bool *any, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    const int first = c->touching, from = m->count;
    const bool begins = from == m->dry;
    bool spares = false;
    *any = list_closing(simulation, h, v, begins);
    kt_status status = *any ? respond_to_rows(simulation, first, error) : KT_OK;
    if (status == KT_OK && *any && simulation->model->n.group > 0)
        status = spare_held_items(simulation, from, &spares, error);
    if (status != KT_OK || !spares)
        return status;
    for (int i = from; i < m->count; i++)
        if (m->place[m->item[i]] == i)
            m->place[m->item[i]] = KT_MOREAU_NO_PART;
    m->count = from;
    c->touching = first;
    *any = list_closing(simulation, h, v, begins);
    return *any ? respond_to_rows(simulation, first, error) : KT_OK;
}

/* ---- the problem ------------------------------------------------------------------------------------------------- */

/* The rows of an item in the problem for the cone solver: all, or the normal row alone. */
static int posed_rows(const kt_moreau *m, int i) { return m->only_normal ? 1 : kt_moreau_rows(m, i); }

/* W of two of the chosen items, 3 x 3 by rows that are `stride` numbers apart. */
static void write_block(const kt_simulation *simulation, int i, int k, int stride, double *W) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    const int rows = posed_rows(m, m->chosen[i]), columns = posed_rows(m, m->chosen[k]);
    const int a = m->first[m->chosen[i]], b = m->first[m->chosen[k]];
    const double *stored = c->touching <= m->stride ? c->W + a * m->stride + b : NULL;
    for (int r = 0; r < rows; r++)
        for (int s = 0; s < columns; s++)
            W[r * stride + s] = stored != NULL   ? stored[r * m->stride + s]
                                : a + r <= b + s ? kt_contacts_product(c, a + r, b + s)
                                                 : kt_contacts_product(c, b + s, a + r);
}

static void step_block(const void *user, int i, int k, double *w) {
    kt_clear(w, 9 * sizeof *w);
    write_block(user, i, k, 3, w);
}

/* Rates of the chosen items due to impulses, from those of the mechanism. */
static void step_rates(const void *user, const double *p, double *rate) {
    const kt_simulation *simulation = user;
    const struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    const size_t nv = simulation->size.nv;
    kt_clear(m->change, nv * sizeof *m->change);
    kt_clear(rate, 3 * (size_t)m->posed * sizeof *rate);
    for (int i = 0; i < m->posed; i++)
        for (int r = 0; r < posed_rows(m, m->chosen[i]); r++)
            add_response(simulation, m->first[m->chosen[i]] + r, p[3 * i + r], m->change);
    for (int i = 0; i < m->posed; i++)
        for (int r = 0; r < posed_rows(m, m->chosen[i]); r++)
            rate[3 * i + r] = kt_contacts_along(c, m->first[m->chosen[i]] + r, m->change);
}

/* Solves a problem of the chosen items, from p to p. normal: of their normal rows alone. */
static kt_cone_result solve_cones(kt_simulation *simulation, int count, bool normal, double *p) {
    kt_moreau *m = simulation->moreau;
    const int size = 3 * count;
    double *W = kt_cone_matrix(m->cone);
    const kt_cone_blocks blocks = {step_block, step_rates, simulation};
    const bool has_room = count <= kt_cone_room(m->cone);
    m->posed = count;
    m->only_normal = normal;
    if (has_room)
        kt_clear(W, (size_t)(size * size) * sizeof *W);
    for (int i = 0; i < count && has_room; i++)
        for (int k = 0; k < count; k++)
            write_block(simulation, i, k, size, W + 3 * i * size + 3 * k);
    const kt_cone_problem problem = {.n = count,
                                     .W = W,
                                     .blocks = has_room ? NULL : &blocks,
                                     .b = m->b,
                                     .mu = normal ? m->none : m->mu,
                                     .limit = normal ? NULL : m->limit,
                                     .symmetric = true,
                                     .enough = enough};
    const kt_cone_result result = kt_cone_solve(m->cone, &problem, p);
    m->counts.newton += (uint64_t)result.newton;
    return result;
}

/* The energy that the impulses dissipate; *size: the sum of the magnitudes of its terms. */
static double dissipation_of(const kt_simulation *simulation, double *size) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    double lost = 0.0;
    *size = 0.0;
    for (int i = 0; i < m->count; i++)
        for (int k = 0; k < kt_moreau_rows(m, i); k++) {
            const int r = m->first[i] + k;
            const double end = kt_moreau_rate(c, c->list[r], c->component[r], m->after);
            lost -= 0.5 * m->p[3 * i + k] * (m->begin[r] + end);
            *size += 0.5 * fabs(m->p[3 * i + k]) * (fabs(m->begin[r]) + fabs(end));
        }
    return lost;
}

/* The least rate of a contact at the end. */
static double bound_of(const kt_moreau *m, int i) {
    return m->e[i] > 0.0 ? -m->e[i] * m->begin[m->first[i]] : m->bound[i];
}

/* Solves with the present restitutions. Returns false if there is no finite solution. */
static bool solve_once(kt_simulation *simulation) {
    kt_moreau *m = simulation->moreau;
    kt_clear(m->b, 3 * (size_t)m->count * sizeof *m->b);
    for (int i = 0; i < m->count; i++) {
        const double bound = bound_of(m, i);
        for (int k = 0; k < kt_moreau_rows(m, i); k++)
            m->b[3 * i + k] = m->free[m->first[i] + k];
        m->b[3 * i] -= m->limit[i] < 0.0 ? bound : 0.0;
    }
    const kt_cone_result result = solve_cones(simulation, m->count, false, m->p);
    m->counts.failures += !(result.residual <= enough);
    kt_copy(m->after, m->y + simulation->size.nq, simulation->size.nv * sizeof *m->after);
    for (int i = 0; i < m->count; i++)
        for (int k = 0; k < kt_moreau_rows(m, i); k++)
            add_response(simulation, m->first[i] + k, m->p[3 * i + k], m->after);
    return isfinite(result.residual);
}

static kt_status reject_step(const kt_simulation *simulation, kt_error *error) {
    const kt_moreau *m = simulation->moreau;
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "contact '%.60s' at t = %.9g s",
                   kt_loop_name(simulation->model, simulation->contacts->item[m->item[0]].loop), m->t);
    return kt_error_set(error, KT_ERROR_CONSTRAINT, where,
                        "no impulses satisfy it and the %d other contacts of the step: a prescribed motion drives it "
                        "through its boundary, or no joint has a lever against it; end the motion earlier, or take a "
                        "smaller step",
                        m->count - 1);
}

kt_status kt_moreau_solve(kt_simulation *simulation, kt_error *error) {
    kt_moreau *m = simulation->moreau;
    double size, lost = 0.0;
    bool found = true, bounces = false;
    for (int i = 0; i < m->count; i++) {
        m->chosen[i] = i;
        bounces = bounces || m->e[i] > 0.0;
    }
    for (int halving = 0; found; halving++) {
        found = solve_once(simulation);
        lost = found ? dissipation_of(simulation, &size) : 0.0;
        if (!found || !bounces || !(lost < -1e-12 * size) || halving > HALVINGS)
            break;
        m->counts.reduced += halving == 0;
        for (int i = 0; i < m->count; i++)
            m->e[i] = halving < HALVINGS ? 0.5 * m->e[i] : 0.0;
    }
    m->counts.dissipated = lost;
    m->counts.closed = 0;
    for (int i = m->dry; i < m->count; i++)
        m->counts.closed += m->p[3 * i] > 0.0;
    return found ? KT_OK : reject_step(simulation, error);
}

/* ---- penetration ------------------------------------------------------------------------------------------------- */

void kt_moreau_correct(kt_simulation *simulation, double h) {
    const struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    const size_t nq = simulation->size.nq, nv = simulation->size.nv;
    int count = 0;
    for (int i = m->dry; i < m->count; i++)
        if (c->gap[m->item[i]] + h * bound_of(m, i) < -tolerance_of(c))
            m->chosen[count++] = i;
    if (count == 0)
        return;
    kt_clear(m->b, 3 * (size_t)count * sizeof *m->b);
    kt_clear(m->shift, 3 * (size_t)count * sizeof *m->shift);
    for (int i = 0; i < count; i++)
        m->b[3 * i] = c->gap[m->item[m->chosen[i]]] + h * bound_of(m, m->chosen[i]);
    (void)solve_cones(simulation, count, true, m->shift);
    kt_clear(m->change, nv * sizeof *m->change);
    for (int i = 0; i < count; i++)
        add_response(simulation, m->first[m->chosen[i]], m->shift[3 * i], m->change);
    kt_copy(m->position, m->y, nq * sizeof *m->y);
    kt_position_add(simulation->model, m->position, m->change, m->y);
}
