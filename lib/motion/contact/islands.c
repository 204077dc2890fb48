/* Islands of contacts: their places in the arrays of rows, and the selected one.
 *
 * An impulse in one island (kt_island) changes no rate in another. So W = J M^-1 J' has a block for each island, and
 * impulses and reactions are solved for one island after the other. An island has its own part of the arrays of rows,
 * with room for all its rows. Scratch arrays have room for the largest island, and so have the solvers.
 *
 * Rows of different islands share their columns of M^-1 J': column k is the sum of the responses to row k of every
 * island. Each coordinate moves with one island alone. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/contact.h"
#include "kinetree/loop.h"
#include "loop/loop.h"

#include <assert.h>
#include <math.h>

/* So many contacts always have room in matrices. */
enum { CONTACT_ROOM = 32 };

/* How many items have room in matrices, so that memory grows with the number of contacts and not with its square. As
 * many normal rows as degrees of freedom can be independent; dry friction takes part always, and one more contact may
 * be about to close (cone/cone_members.c). */
static size_t room_for_island(const kt_island *of) {
    const size_t items = (size_t)of->side + (size_t)of->dry, needed = (size_t)of->v_count + (size_t)of->dry + 1;
    const size_t room = needed > CONTACT_ROOM ? needed : CONTACT_ROOM;
    return items < room ? items : room;
}

/* Rows of an island: one of each item, and one more of a contact's friction. */
static int rows_of_island(const kt_island *of) { return of->side + of->dry + 2 * of->rubs; }

void kt_contacts_measure_islands(const kt_model *model, kt_contact_sizes *s) {
    for (size_t i = 0; i < model->n.island; i++) {
        const kt_island *of = &model->island[i];
        const size_t items = (size_t)of->side + (size_t)of->dry, rows = (size_t)rows_of_island(of);
        const size_t room = room_for_island(of), factor = rows * ((size_t)of->v_count + 1);
        s->most = room > s->most ? room : s->most;
        s->most_items = items > s->most_items ? items : s->most_items;
        s->most_rows = rows > s->most_rows ? rows : s->most_rows;
        s->factor = factor > s->factor ? factor : s->factor;
    }
    s->islands = model->n.island > s->islands ? model->n.island : s->islands;
}

/* Rows of an island whose W is stored if all touch. */
static size_t stored_rows(const kt_island *of, size_t whole) {
    const size_t rows = (size_t)rows_of_island(of);
    return rows < whole ? rows : whole;
}

/* Numbers of W of an island: of the rows that are stored, or the diagonal. */
static size_t numbers_of_W(const kt_island *of, size_t whole) {
    const size_t rows = (size_t)rows_of_island(of), stored = stored_rows(of, whole);
    return stored * stored > rows ? stored * stored : rows;
}

size_t kt_contacts_count_of_W(const kt_model *model, size_t whole) {
    size_t count = 0;
    for (size_t i = 0; i < model->n.island; i++)
        count += numbers_of_W(&model->island[i], whole);
    return count;
}

/* Lists the coordinates of the links on the paths of a loop, in ascending order, as positions in its group. Relations
 * have no paths, and get all coordinates of the group. Returns the number. local: NULL, or where the list is stored. */
static int list_coordinates(const kt_model *model, const kt_loop_record *loop, int32_t *local) {
    const int all = loop->term_count != 0 ? model->group[loop->group].v_count : 0;
    int count = 0;
    for (; count < all; count++)
        if (local != NULL)
            local[count] = count;
    for (int end = 0; end < 2 && all == 0; end++)
        for (int i = 0; i < loop->length[end]; i++) {
            const kt_link *link = &model->link[model->path[loop->path[end] + i]];
            for (int j = 0; j < kt_link_dofs(link); j++, count++) {
                int at = count;
                for (; local != NULL && at > 0 && local[at - 1] > link->local + j; at--)
                    local[at] = local[at - 1];
                if (local != NULL)
                    local[at] = link->local + j;
            }
        }
    return count;
}

/* Whether a loop bounds a side, or is friction of a joint. Friction of a contact has the paths of its contact. */
static bool has_own_coordinates(const kt_loop_record *loop) {
    return loop->side != KT_SIDE_NONE || (loop->friction > 0 && loop->type == KT_LOOP_RATES);
}

size_t kt_contacts_count_coordinates(const kt_model *model) {
    size_t count = 0;
    for (size_t i = 0; i < model->n.loop; i++)
        if (!kt_loop_is_off(&model->loop[i]) && has_own_coordinates(&model->loop[i]))
            count += (size_t)list_coordinates(model, &model->loop[i], NULL);
    return count;
}

/* Lists the coordinates on which the rows of each item depend. */
static void list_dependences(struct kt_contacts *c) {
    int count = 0;
    for (int k = 0; k < c->n; k++) {
        const kt_loop_record *loop = &c->all->loop[c->item[k].loop];
        if (kt_contact_rubs(c, k)) {
            c->item[k].first = c->item[c->item[k].of].first;
            c->item[k].count = c->item[c->item[k].of].count;
            continue;
        }
        const int32_t *v = c->all->group_v + c->all->group[loop->group].v;
        c->item[k].first = count;
        c->item[k].count = list_coordinates(c->all, loop, c->local + count);
        for (int end = count + c->item[k].count; count < end; count++)
            c->coordinate[count] = v[c->local[count]];
    }
}

void kt_contacts_init_islands(struct kt_contacts *c) {
    const kt_model *all = c->all;
    size_t W = 0;
    int row = 0;
    c->islands = (int)all->n.island;
    for (int i = 0; i < c->islands; i++) {
        const kt_island *of = &all->island[i];
        c->island[i] =
            (kt_contact_island){.of = of, .row = row, .W = W, .stored = (int)stored_rows(of, (size_t)c->whole)};
        row += rows_of_island(of);
        W += numbers_of_W(of, (size_t)c->whole);
    }
    list_dependences(c);
    for (int k = 0; k < c->n; k++)
        c->item[k].unit = kt_loop_unit(all, c->item[k].loop, 0);
    for (int k = 0; k < c->n; k++)
        c->item[k].island = all->group[all->loop[c->item[k].loop].group].island;
}

/* ---- rows that touch --------------------------------------------------------------------------------------------- */

void kt_contacts_clear_rows(struct kt_contacts *c) {
    for (int i = 0; i < c->islands; i++)
        c->island[i].touching = c->island[i].meeting = c->island[i].resting = 0;
    c->touching = c->meeting = c->resting = 0;
}

int kt_contacts_add_row(struct kt_contacts *c, int k, int component) {
    assert(k >= 0 && k < c->n && component >= 0 && component < 3);
    kt_contact_island *at = &c->island[c->item[k].island];
    const int row = at->row + at->touching++;
    c->rows[row] = k;
    c->components[row] = component;
    return row;
}

bool kt_contacts_select(struct kt_contacts *c, int island) {
    assert(island >= 0 && island < c->islands);
    kt_contact_island *at = &c->island[island];
    c->selected = at;
    c->touching = at->touching;
    c->meeting = at->meeting;
    c->resting = at->resting;
    c->list = c->rows + at->row;
    c->component = c->components + at->row;
    c->u = c->rates + at->row;
    c->W = c->matrix_of_rows + at->W;
    return at->touching > 0;
}

int kt_contacts_total(const struct kt_contacts *c) {
    int total = 0;
    for (int i = 0; i < c->islands; i++)
        total += c->island[i].touching;
    return total;
}

void kt_contacts_add_response(const struct kt_contacts *c, int k, double p, double *v) {
    assert(c->selected != NULL && k >= 0 && k < c->touching);
    const double *response = c->response + (size_t)k * c->all->n.v;
    const int32_t *coordinate = c->all->island_coordinate + c->selected->of->v;
    const size_t count = (size_t)c->selected->of->v_count;
    for (size_t j = 0; j < count && count == c->all->n.v; j++) /* all coordinates: faster, with equal bits */
        v[j] += p * response[j];
    for (size_t j = 0; j < count && count < c->all->n.v; j++)
        v[coordinate[j]] += p * response[coordinate[j]];
}
