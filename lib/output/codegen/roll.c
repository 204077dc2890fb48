/* Loops in place of repeated operations.
 *
 * The recursions of a tree go over its links in passes. A step of a pass is the work for one link (kt_graph_step). If
 * some steps in a row repeat the operations of those before, with other operands, the steps become iterations of a
 * loop:
 *
 *     link    1     2     3     4     5     6     7     8     9
 *     axis    x     y     z     x     y     z     x     y     z
 *     code    alone [ iteration 0 ] [ iteration 1 ] [ it. 2 ] alone
 *
 * The first and the last links are often simpler than those between, and stay alone. Equal limbs of a tree become
 * iterations, too.
 *
 * An operand from outside of an iteration has one node for each iteration, and these nodes must follow a rule: the same
 * node, inputs or prepared numbers at equal distances, or a node of the previous iteration. All other operands come
 * from columns of memory. A node of a loop has a column if it is read elsewhere, with a row for each iteration. A later
 * loop may read these rows in both directions. Its other operands are copied to rows before it begins, and some parts
 * earlier if compilers make vectors of it. A processor that reads a vector waits until all numbers in it are written.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/roll.h"

#include <string.h>

enum {
    KT_ROLL_PERIOD = 16, /* the most steps in an iteration */
    KT_ROLL_LEAST = 60   /* a loop replaces at least this many nodes */
};

/* The nodes of one step: their indices in `order`. */
typedef struct roll_step {
    int32_t begin, end, pass;
    uint64_t hash;
} roll_step;

void kt_code_roll_free(kt_code_roll *r) {
    for (int i = 0; i < r->plan_count; i++)
        kt_pool_free(r->plan[i].pool.chunks);
    kt_pool_free(r->pool.chunks);
    *r = (kt_code_roll){.failed = true};
}

/* Makes room for one more, in a pool. */
static void *grow_roll(kt_code_roll *r, kt_pool *pool, void *array, int32_t count, size_t *room, size_t size) {
    void *larger = kt_pool_grow(pool, array, (size_t)count, 1, room, size);
    r->failed |= larger == NULL;
    return larger != NULL ? larger : array;
}

static bool is_prepared_node(const kt_graph *g, kt_op i) { return g->node[i].origin == KT_OP_OF_PARAMETERS; }

/* ---- steps ------------------------------------------------------------------------------------------------------- */

static void mix_hash(uint64_t *h, uint64_t x) {
    *h = (*h ^ x) * 0x9e3779b97f4a7c15u;
    *h ^= *h >> 31;
}

/* Hashes the operations of a step, without operands of other steps. */
static uint64_t hash_step(const kt_code_roll *r, const kt_graph *g, int32_t begin, int32_t end) {
    uint64_t h = 0x243f6a8885a308d3u;
    for (int32_t at = begin; at < end; at++) {
        const kt_op_node *n = &g->node[r->order[at]];
        kt_op operand[3];
        mix_hash(&h, n->kind == KT_OP_CALL ? 16u + (uint64_t)n->c : n->kind);
        for (int k = kt_op_operands(n, operand) - 1; k >= 0; k--) {
            const int32_t to = r->at[operand[k]];
            const bool is_leaf = to < 0;
            mix_hash(&h, to >= begin ? 64u + (uint64_t)(to - begin) : is_leaf ? 32u : 33u);
            if (is_leaf && kt_op_is_constant(g, operand[k])) {
                uint64_t bits;
                memcpy(&bits, &g->node[operand[k]].value, sizeof bits);
                mix_hash(&h, bits);
            } else if (is_leaf) {
                mix_hash(&h, is_prepared_node(g, operand[k]) ? 31u : (uint64_t)g->node[operand[k]].a);
            }
        }
    }
    return h;
}

/* Lists the steps. Nodes of none are steps of pass -1. */
static int list_steps(const kt_code_roll *r, const kt_graph *g, roll_step *step) {
    int count = 0, last = -1;
    for (int32_t at = 0; at < r->order_count; at++) {
        const int32_t section = g->node[r->order[at]].section;
        const int32_t own = section >= 0 ? g->section[section].step : -1;
        if (count == 0 || own != last || own < 0)
            step[count++] = (roll_step){.begin = at, .pass = own >= 0 ? g->section[section].pass : -1};
        step[count - 1].end = at + 1;
        last = own;
    }
    for (int k = 0; k < count; k++)
        step[k].hash = step[k].pass >= 0 ? hash_step(r, g, step[k].begin, step[k].end) : 0;
    return count;
}

/* ---- operands ---------------------------------------------------------------------------------------------------- */

/* Whether a slot is the node of the iteration before. */
static bool is_carried(const kt_code_roll *r, const kt_code_loop_plan *l, const kt_op *cell, int32_t *local) {
    const int32_t first = r->at[cell[1]] - l->start;
    if (r->at[cell[1]] < 0 || first < 0 || first >= l->size)
        return false;
    *local = first;
    for (int i = 1; i < l->count; i++)
        if (cell[i] != kt_code_roll_node(r, l, i - 1, first))
            return false;
    return true;
}

/* Whether a slot is the node of the same iteration further back, which its column keeps. */
static bool is_further_back(const kt_code_roll *r, const kt_code_loop_plan *l, const kt_op *cell) {
    int back = 0;
    while (back < l->count && r->at[cell[back]] < l->start)
        back++;
    if (back < 2 || back == l->count || r->at[cell[back]] >= l->start + l->size)
        return false;
    for (int i = back; i < l->count; i++)
        if (cell[i] != kt_code_roll_node(r, l, i - back, r->at[cell[back]] - l->start))
            return false;
    return true;
}

static bool is_in_steps_of_input(const kt_graph *g, const kt_op *cell, int count) {
    const kt_op_node *first = &g->node[cell[0]], *second = &g->node[cell[1]];
    for (int i = 0; i < count; i++) {
        const kt_op_node *n = &g->node[cell[i]];
        if (n->kind != KT_OP_INPUT || n->a != first->a || n->b != first->b + i * (second->b - first->b))
            return false;
    }
    return true;
}

/* The columns of other loops that agree with the cells of a slot: rows step i + row, for a step of 1 or -1. Cells that
 * no loop computes are copied to rows, if these are free. */
static bool is_column(const kt_code_roll *r, int32_t loop, int32_t local, int32_t step, int32_t row, const kt_op *cell,
                      int count) {
    const kt_code_loop_plan *a = &r->plan[loop];
    for (int i = 0; i < count; i++) {
        const int32_t at = step * i + row;
        if (at >= 0 && at < a->count) {
            if (cell[i] != kt_code_roll_node(r, a, at, local))
                return false;
            continue;
        }
        if (r->loop[cell[i]] == loop)
            return false;
        for (int k = 0; k < r->copy_count; k++) {
            const kt_code_copy *c = &r->copy[k];
            if (c->loop == loop && c->column == a->column[local] && c->row == at && c->node != cell[i])
                return false;
        }
    }
    return true;
}

/* Records a copy, and extends the rows. If the copy exists already, the earlier reader makes it. */
static void copy_to_row(kt_code_roll *r, kt_code_copy copy) {
    kt_code_loop_plan *a = &r->plan[copy.loop];
    a->first_row = copy.row < a->first_row ? copy.row : a->first_row;
    a->last_row = copy.row > a->last_row ? copy.row : a->last_row;
    for (int k = 0; k < r->copy_count; k++) {
        kt_code_copy *c = &r->copy[k];
        if (c->loop != copy.loop || c->column != copy.column || c->row != copy.row)
            continue;
        if (r->plan[copy.reader].start < r->plan[c->reader].start)
            c->reader = copy.reader;
        return;
    }
    r->copy = grow_roll(r, &r->pool, r->copy, r->copy_count, &r->copy_room, sizeof *r->copy);
    if (!r->failed)
        r->copy[r->copy_count++] = copy;
}

bool kt_code_roll_is_left(const kt_code_roll *r, kt_op i) {
    const kt_code_loop_plan *l = &r->plan[r->loop[i]];
    const int local = kt_code_roll_local(r, i);
    bool is_carried = false;
    if (l->column[local] >= 0 || l->count < KT_ROLL_WIDE || kt_code_roll_iteration(r, i) < l->count - 1)
        return false;
    for (int k = 0; k < l->slot_count; k++)
        is_carried |= l->slot[k].kind == KT_SLOT_CARRIED && l->slot[k].base == local;
    return is_carried;
}

int kt_code_roll_column(kt_code_roll *r, kt_op i) {
    kt_code_loop_plan *l = &r->plan[r->loop[i]];
    int32_t *column = &l->column[kt_code_roll_local(r, i)];
    if (*column < 0)
        *column = l->column_count++;
    return *column;
}

/* Finds the column of a slot, or makes one of copies. own: the loop that reads. */
static void place_slot(kt_code_roll *r, int32_t own, kt_code_slot *s) {
    const int count = r->plan[own].count;
    for (int first = 0; first < count; first++) {
        const int32_t loop = r->loop[s->cell[first]];
        if (loop < 0)
            continue;
        const int32_t local = kt_code_roll_local(r, s->cell[first]), row = kt_code_roll_iteration(r, s->cell[first]);
        for (int step = 1; step >= (loop == own ? 1 : -1); step -= 2) {
            if (!is_column(r, loop, local, step, row - step * first, s->cell, count))
                continue;
            s->loop = loop;
            s->base = kt_code_roll_column(r, s->cell[first]);
            s->step = step;
            s->row = row - step * first;
            for (int i = 0; i < count; i++)
                if (r->loop[s->cell[i]] != loop)
                    copy_to_row(r, (kt_code_copy){loop, s->base, step * i + s->row, own, s->cell[i]});
            return;
        }
        break;
    }
    s->loop = own;
    s->base = r->plan[own].column_count++;
    s->step = 1;
    for (int i = 0; i < count; i++)
        copy_to_row(r, (kt_code_copy){own, s->base, i, own, s->cell[i]});
}

/* Decides how a loop reads a slot. Returns false if a loop cannot. Columns are placed when all slots are sound. */
static bool classify_slot(const kt_code_roll *r, const kt_graph *g, kt_code_loop_plan *l, kt_code_slot *s) {
    bool is_same = true, is_number = true;
    for (int i = 0; i < l->count; i++) {
        const kt_op node = s->cell[i];
        is_same &= node == s->cell[0];
        is_number &= is_prepared_node(g, node) || kt_op_is_constant(g, node);
    }
    if (is_same) {
        s->kind = KT_SLOT_SAME;
        return true;
    }
    if (is_in_steps_of_input(g, s->cell, l->count)) {
        s->kind = KT_SLOT_INPUT;
        s->base = g->node[s->cell[0]].b;
        s->step = g->node[s->cell[1]].b - s->base;
        return true;
    }
    if (is_number && is_prepared_node(g, s->cell[1])) {
        s->kind = KT_SLOT_PREPARED;
        s->base = l->prepared_count++;
        return true;
    }
    if (is_carried(r, l, s->cell, &s->base)) {
        s->kind = KT_SLOT_CARRIED;
        return true;
    }
    bool is_before = true;
    for (int i = 0; i < l->count; i++)
        is_before &= r->at[s->cell[i]] < l->start;
    s->kind = KT_SLOT_COLUMN;
    return is_before || is_further_back(r, l, s->cell);
}

/* Adds the nodes of an operand. Returns false if two operands are equal in the pattern, but not in all iterations. */
static bool add_slot(kt_code_roll *r, kt_code_loop_plan *l, const kt_op *cell) {
    for (int k = 0; k < l->slot_count; k++)
        if (l->slot[k].cell[1] == cell[1])
            return memcmp(l->slot[k].cell, cell, (size_t)l->count * sizeof *cell) == 0;
    kt_op *copy = kt_pool_take(&l->pool, (size_t)l->count, sizeof *copy);
    r->failed |= copy == NULL;
    l->slot = grow_roll(r, &l->pool, l->slot, l->slot_count, &l->slot_room, sizeof *l->slot);
    if (copy == NULL || r->failed)
        return false;
    memcpy(copy, cell, (size_t)l->count * sizeof *cell);
    l->slot[l->slot_count++] = (kt_code_slot){.cell = copy};
    return true;
}

/* ---- equal iterations -------------------------------------------------------------------------------------------- */

/* The index of an operand in iteration i; -1: the operand is from outside. */
static int32_t local_of(const kt_code_roll *r, const kt_code_loop_plan *l, int i, kt_op operand) {
    const int32_t at = r->at[operand] - l->start - i * l->size;
    return r->at[operand] >= 0 && at >= 0 && at < l->size ? at : -1;
}

/* Reads an operand in all iterations. The iteration may compute the operand itself; otherwise the operand becomes a
 * slot. Returns false if iterations differ. */
static bool read_operand(kt_code_roll *r, kt_code_loop_plan *l, const kt_op *operand) {
    const int32_t local = local_of(r, l, 1, operand[1]);
    for (int i = 0; i < l->count; i++)
        if (local_of(r, l, i, operand[i]) != local)
            return false;
    return local >= 0 || add_slot(r, l, operand);
}

/* Node `local` is the same operation in all iterations. cell: room for one operand of each. */
static bool read_node(kt_code_roll *r, const kt_graph *g, kt_code_loop_plan *l, int local, kt_op *cell) {
    const kt_op_node *n = &g->node[kt_code_roll_node(r, l, 1, local)];
    kt_op operand[3];
    const int count = kt_op_operands(n, operand);
    for (int k = 0; k < count; k++) {
        for (int i = 0; i < l->count; i++) {
            const kt_op_node *o = &g->node[kt_code_roll_node(r, l, i, local)];
            if (o->kind != n->kind || (n->kind == KT_OP_CALL && o->c != n->c) || kt_op_operands(o, operand) != count)
                return false;
            cell[i] = operand[k];
        }
        if (!read_operand(r, l, cell))
            return false;
    }
    return true;
}

/* The guard whose pivot is a node; NULL: there is none. */
static const kt_code_guard *guard_at(const kt_code_guard *guard, int count, kt_op pivot) {
    for (int k = 0; k < count; k++)
        if (guard[k].pivot == pivot)
            return &guard[k];
    return NULL;
}

/* Guards are operands, too, and their bodies have equal distances. */
static bool read_guards(kt_code_roll *r, kt_code_loop_plan *l, const kt_code_guard *guard, int count, kt_op *cell) {
    for (int k = 0; k < count; k++) { /* a limit is known when its pivot is, or follows in the same iteration */
        const int32_t limit = r->at[guard[k].limit], pivot = r->at[guard[k].pivot], end = l->start + l->size * l->count;
        const bool is_inside = limit >= l->start && limit < end;
        const bool is_late = limit > pivot && pivot >= l->start && pivot < end;
        if ((is_inside || is_late) &&
            (pivot < l->start || (pivot - l->start) / l->size != (limit - l->start) / l->size))
            return false;
    }
    for (int local = 0; local < l->size; local++) {
        const kt_code_guard *first[2];
        for (int i = 0; i < 2; i++)
            first[i] = guard_at(guard, count, kt_code_roll_node(r, l, i, local));
        for (int i = 0; i < l->count; i++) {
            const kt_code_guard *own = guard_at(guard, count, kt_code_roll_node(r, l, i, local));
            if ((own == NULL) != (first[0] == NULL) || (own == NULL) != (first[1] == NULL))
                return false;
            if (own == NULL)
                continue;
            if (own->loop > 0 || own->body != first[0]->body + i * (first[1]->body - first[0]->body))
                return false;
            cell[i] = own->limit;
        }
        if (first[0] != NULL && !read_operand(r, l, cell))
            return false;
    }
    return true;
}

/* Makes a loop of equal steps if their operands follow rules. */
static bool make_loop(kt_code_roll *r, const kt_graph *g, int32_t start, int32_t size, int32_t count,
                      const kt_code_guard *guard, int guard_count) {
    if (count < 2)
        return false;
    r->plan = grow_roll(r, &r->pool, r->plan, r->plan_count, &r->plan_room, sizeof *r->plan);
    if (r->failed)
        return false;
    const int32_t own = r->plan_count;
    kt_code_loop_plan *l = &r->plan[r->plan_count++];
    *l = (kt_code_loop_plan){.start = start, .size = size, .count = count, .last_row = count - 1};
    kt_op *cell = kt_pool_take(&l->pool, (size_t)count, sizeof *cell);
    l->column = kt_pool_take(&l->pool, (size_t)size, sizeof *l->column);
    l->is_written = kt_pool_take(&l->pool, (size_t)size, sizeof *l->is_written);
    r->failed |= cell == NULL || l->column == NULL || l->is_written == NULL;
    bool fine = !r->failed;
    for (int local = 0; fine && local < size; local++) {
        l->column[local] = -1;
        fine = read_node(r, g, l, local, cell);
    }
    fine = fine && read_guards(r, l, guard, guard_count, cell);
    for (int k = 0; fine && k < l->slot_count; k++) {
        fine = classify_slot(r, g, l, &l->slot[k]);
        l->recurs |= l->slot[k].kind == KT_SLOT_CARRIED;
    }
    l->is_wide = !l->recurs || count >= KT_ROLL_WIDE;
    if (!fine) {
        kt_pool_free(r->plan[--r->plan_count].pool.chunks);
        return false;
    }
    for (int32_t at = start; at < start + size * count; at++)
        r->loop[r->order[at]] = own;
    for (int k = 0; k < l->slot_count; k++)
        if (l->slot[k].kind == KT_SLOT_COLUMN)
            place_slot(r, own, &l->slot[k]);
    return true;
}

/* ---- search ------------------------------------------------------------------------------------------------------ */

/* A function on its way: its steps, and the guards. */
typedef struct roll_search {
    kt_code_roll *r;
    const kt_graph *g;
    const kt_code_guard *guard;
    int guard_count;
    const roll_step *step;
} roll_search;

/* How many iterations of `period` steps repeat from a step on. */
static int count_iterations(const roll_step *step, int at, int end, int period) {
    int same = 0;
    while (at + same + period < end && step[at + same].hash == step[at + same + period].hash)
        same++;
    return same / period + 1;
}

/* Makes loops of the steps of one pass: in the order of falling savings. */
static void roll_steps(const roll_search *s, int begin, int end) {
    int best = 0, start = 0, period = 0, count = 0;
    for (int p = 1; p <= KT_ROLL_PERIOD && 2 * p <= end - begin; p++)
        for (int at = begin; at + 2 * p <= end; at++) {
            const int n = count_iterations(s->step, at, end, p);
            const int saved = (n - 1) * (s->step[at + p - 1].end - s->step[at].begin);
            if (saved > best) {
                best = saved;
                start = at;
                period = p;
                count = n;
            }
        }
    if (best < KT_ROLL_LEAST || s->r->failed)
        return;
    roll_steps(s, begin, start);
    int skipped = 0; /* the first iterations may read what the others do not */
    const int32_t size = s->step[start + period - 1].end - s->step[start].begin;
    while (count - skipped > 1 && !make_loop(s->r, s->g, s->step[start].begin + skipped * size, size, count - skipped,
                                             s->guard, s->guard_count))
        skipped++;
    roll_steps(s, start + period * count, end);
}

bool kt_code_roll_find(kt_code_roll *r, const kt_graph *g, const int32_t *uses, const kt_code_guard *guard,
                       int guard_count, bool may_roll) {
    const size_t room = (size_t)g->count + 1;
    *r = (kt_code_roll){.failed = false};
    r->order = kt_pool_take(&r->pool, room, sizeof *r->order);
    r->at = kt_pool_take(&r->pool, room, sizeof *r->at);
    r->loop = kt_pool_take(&r->pool, room, sizeof *r->loop);
    roll_step *step = kt_pool_take(&r->pool, room, sizeof *step);
    r->failed = r->order == NULL || r->at == NULL || r->loop == NULL || step == NULL;
    for (kt_op i = 0; i < g->count && !r->failed; i++) {
        const bool is_computed = uses[i] > 0 && g->node[i].kind >= KT_OP_ADD && g->node[i].origin == KT_OP_OF_STATE;
        r->at[i] = is_computed ? r->order_count : -1;
        r->loop[i] = -1;
        if (is_computed)
            r->order[r->order_count++] = i;
    }
    const int count = r->failed || !may_roll ? 0 : list_steps(r, g, step);
    const roll_search search = {r, g, guard, guard_count, step};
    for (int begin = 0, end; begin < count; begin = end) {
        for (end = begin + 1; end < count && step[end].pass == step[begin].pass; end++) {
        }
        if (step[begin].pass >= 0)
            roll_steps(&search, begin, end);
    }
    if (!r->failed)
        return true;
    kt_code_roll_free(r);
    return false;
}
