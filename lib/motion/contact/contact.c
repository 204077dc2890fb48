/* The memory of hard contacts, and the list of contacts and friction. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/contact.h"

#include "base/copy.h"
#include "base/where.h"
#include "cone/statics.h"
#include "control/mass_inverse.h"
#include "model/switching.h"

KT_ARENA_LAYOUT(lay_out, struct kt_contacts, KT_CONTACT_FIELDS, const kt_contact_sizes *s)

static bool is_watched(const kt_loop_record *loop) { return loop->side != KT_SIDE_NONE || loop->friction > 0; }

size_t kt_contacts_of(const kt_model *model) {
    size_t count = 0;
    for (size_t i = 0; i < model->n.loop; i++)
        count += is_watched(&model->loop[i]);
    return count;
}

/* Whether all contacts are open and no friction sticks, as in the mechanism whose mass matrix is inverted. */
static bool has_no_closed_contact(const kt_model *model) {
    bool open = true;
    for (size_t i = 0; i < model->n.loop && open; i++)
        open = !is_watched(&model->loop[i]) || kt_loop_is_off(&model->loop[i]);
    return open;
}

static size_t least_of(size_t a, size_t b) { return a < b ? a : b; }
static size_t most_of(size_t a, size_t b) { return a > b ? a : b; }

/* Enlarges the memory in which a group's load is shared (rows.c): rows of other loops, and of closed contacts. */
static void measure_shares(const kt_model *model, kt_contact_sizes *s) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        size_t others = 0;
        for (int i = 0; i < group->loop_count; i++) {
            const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
            others += is_watched(loop) ? 0 : (size_t)loop->row_count;
        }
        const size_t rows = least_of((size_t)group->row_count, others + 3 * s->most);
        s->shares = most_of(s->shares, kt_statics_size(rows, (size_t)group->v_count));
    }
}

/* Sizes of the models in which contacts may be closed, and of the solvers. */
static void measure_solvers(const kt_model *model, kt_contact_sizes *s) {
    s->whole = least_of(s->most_rows, 3 * s->most);
    for (uint64_t k = 0; k < kt_variants_count(model->variants); k++)
        measure_shares(kt_variants_model(model->variants, k), s);
    s->matrices = most_of(kt_coulomb_matrices_size(s->most_rows, s->most), s->shares);
    s->problem = kt_coulomb_size(s->most_items, s->most_rows);
    s->solution = kt_coulomb_solution_size(s->most_items, s->most_rows);
    s->solver = kt_coulomb_solver_size(s->most_items, s->most_rows, s->most);
}

kt_contact_sizes kt_contact_sizes_of(const kt_model *model) {
    const size_t n = kt_contacts_of(model);
    kt_contact_sizes s = {.n = n, .nq = model->n.q, .nv = model->n.v, .data = kt_data_size(model), .list = n};
    for (size_t i = 0; i < model->n.loop; i++)
        s.list += model->loop[i].rubs > 0;
    for (uint64_t k = 0; k < kt_variants_count(model->variants); k++) {
        const kt_model *one = kt_variants_model(model->variants, k);
        const size_t inverse = has_no_closed_contact(one) ? kt_mass_inverse_size(one, 0) : 0;
        s.inverse = inverse > s.inverse ? inverse : s.inverse;
        s.rows = one->n.row > s.rows ? one->n.row : s.rows;
        s.entry = one->n.entry > s.entry ? one->n.entry : s.entry;
        kt_contacts_measure_islands(one, &s);
        s.depends = most_of(s.depends, kt_contacts_count_coordinates(one));
    }
    measure_solvers(model, &s);
    for (uint64_t k = 0; k < kt_variants_count(model->variants); k++) {
        const size_t W = kt_contacts_count_of_W(kt_variants_model(model->variants, k), s.whole);
        s.W = W > s.W ? W : s.W;
    }
    return s;
}

size_t kt_contacts_size(const kt_model *model) {
    if (kt_contacts_of(model) == 0)
        return 0;
    const kt_contact_sizes s = kt_contact_sizes_of(model);
    return lay_out(NULL, &s);
}

/* Finds the contact of friction k. The search begins behind the last contact that was found, since contacts and their
 * friction have the same order. */
static void join_friction(struct kt_contacts *c, const kt_model *model, int k, int *from) {
    for (int i = 0; i < c->sides; i++) {
        const int j = (*from + i) % c->sides;
        if (model->loop[c->item[j].loop].rubs != model->loop[c->item[k].loop].friction)
            continue;
        c->item[j].of = k;
        c->item[k].of = j;
        *from = j + 1;
        return;
    }
}

/* Lists the contacts, and friction after them. */
static void list_items(kt_simulation *simulation, struct kt_contacts *c) {
    const kt_model *model = simulation->model;
    const kt_switches *switches = &model->variants->switches;
    int k = 0, contact = 0;
    for (int friction = 0; friction < 2; friction++) {
        for (size_t i = 0; i < model->n.loop; i++) {
            const kt_loop_record *loop = &model->loop[i];
            if (!is_watched(loop) || (loop->friction > 0) != (friction > 0))
                continue;
            const int effect = loop->friction - 1, back = friction ? kt_effect_switch(model, effect) : -1;
            c->item[k] = (kt_contact){.simulation = simulation,
                                      .loop = (int)i,
                                      .index = k,
                                      .bit = kt_loop_switch(model, (int)i) < switches->own
                                                 ? kt_switch_bits(model, kt_loop_switch(model, (int)i))
                                                 : 0,
                                      .sign = loop->side == KT_SIDE_BELOW ? -1.0 : 1.0,
                                      .effect = effect,
                                      .back = back >= 0 ? (uint64_t)1 << back : 0,
                                      .of = -1};
            c->mask |= kt_switch_bits(model, kt_loop_switch(model, (int)i)) | c->item[k].back;
            c->back |= c->item[k].back;
            if (friction && loop->type != KT_LOOP_RATES)
                join_friction(c, model, k, &contact);
            k++;
        }
        c->sides = friction ? c->sides : k;
    }
}

/* Returns an error if the mass matrix has no inverse at any position. */
static kt_status reject_massless(const kt_simulation *simulation, const struct kt_contacts *c, kt_error *error) {
    const kt_model *model = simulation->model;
    return kt_massless_reject(
        kt_model_switched(model, model->set & ~c->mask),
        kt_where_format("contact '%.60s'", kt_loop_name(model, c->item[0].loop)).text,
        "impacts of a hard contact, stop or slack rope, and friction that sticks, are found by the "
        "inverse of the mass matrix, which does not exist (elastic ones, with stiffness, do not need it)",
        error);
}

/* Lays the solvers' memory out. */
static void init_solvers(struct kt_contacts *c, const kt_contact_sizes *s) {
    c->most = (int)s->most;
    c->whole = (int)s->whole;
    c->problem = kt_coulomb_init(s->most_items, s->most_rows, s->most, c->problem_memory, c->matrices);
    c->solution = kt_coulomb_solution_init(s->most_items, s->most_rows, c->solution_memory);
    c->solver = kt_coulomb_solver_init(s->most_items, s->most_rows, s->most, c->solver_memory, c->matrices);
}

kt_status kt_contacts_lay_out(kt_simulation *simulation, kt_error *error) {
    const kt_model *model = simulation->model;
    const kt_contact_sizes s = kt_contact_sizes_of(model);
    struct kt_contacts *c = (struct kt_contacts *)(void *)simulation->contact_memory;
    (void)lay_out(c, &s);
    c->n = (int)s.n;
    c->inverse_size = s.inverse;
    simulation->contact_time = (double)NAN;
    c->mask = c->back = 0;
    init_solvers(c, &s);
    simulation->contacts = c;
    kt_contacts_init_masks(simulation);
    list_items(simulation, c);
    c->all = kt_model_switched(model, (model->set | c->mask) & ~c->back);
    for (int k = 0; k < c->n; k++) { /* hard.c */
        const uint64_t both = c->item[k].bit | c->item[k].back;
        const bool is_dry = k >= c->sides && !kt_contact_rubs(c, k);
        simulation->contact_friction |= is_dry ? both : 0;
        const bool acts = !model->loop[c->item[k].loop].released;
        const bool is_released = acts ? is_dry && (model->set & both) == both : k < c->sides || is_dry;
        if (is_released)
            simulation->contact_released |= both; /* nothing if contacts share bits */
    }
    simulation->memory.released = simulation->contact_released;
    c->window = 0.0;
    c->rubs = c->rests = c->strikes = c->stops = c->jams = c->releases = c->holds = c->holds_slow = false;
    for (int k = c->sides; k < c->n; k++) /* a loop that is off has no links */
        if (kt_contact_rubs(c, k))
            c->rubs = true;
        else
            c->item[k].v = c->all->link[c->all->loop[c->item[k].loop].link[0]].v;
    kt_status status = reject_massless(simulation, c, error);
    if (status == KT_OK && c->rubs)
        status = kt_load_reject(
            model, "contacts", "hard contacts with friction do not support this; take elastic ones (stiffness)", error);
    if (status == KT_OK)
        status = kt_data_init_followed(c->all, c->data_memory, s.data, &c->data, error);
    if (status == KT_OK)
        kt_contacts_init_islands(c);
    return status;
}
