/* Statements, parts and loops of a function.
 *
 * A node that is used once, and whose text is short, is written into its user.
 *
 * A compiler keeps the variables of a function in few registers. In a long function, the compiler moves most variables
 * to memory and back, often many times. A long function is therefore divided into parts, which are static functions. A
 * number that another part reads is written once, to the array `w`. A loop (roll.c) is a part. A slot in `w` is used
 * again after the last part that reads it, so that the array remains in the cache.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/text_parts.h"

#include <string.h>

enum {
    KT_CODE_WIDTH = 48,  /* the longest text that is written into another */
    KT_CODE_LONG = 1000, /* a function of more statements has loops and parts */
    KT_CODE_PART = 150,  /* statements of a part, about */
    KT_CODE_EARLY =
        2 /* the most parts between a copy and the vectors that read it, because rows occupy memory in between */
};

/* ---- layout ------------------------------------------------------------------------------------------------------ */

/* Whether a node is used once. A sign in between has no variable, and must itself be used once. */
static bool is_used_once(const kt_code_printer *p, kt_op i) {
    const kt_op user = p->user[i];
    if (p->uses[i] != 1)
        return false;
    return user < 0 || p->graph->node[user].kind != KT_OP_NEGATE || p->uses[user] == 1;
}

static int width_of_operand(const kt_code_printer *p, kt_op i) {
    return kt_code_is_leaf(p, i) ? 5 : p->width[i] > 0 ? p->width[i] + 2 : 5;
}

/* The width of the text of a node: its operands, and signs, brackets and names between them. */
static int width_of_node(const kt_code_printer *p, const kt_op_node *n) {
    kt_op operand[3];
    int width = n->kind == KT_OP_NEGATE ? 1 : n->kind == KT_OP_CALL ? 20 : n->kind == KT_OP_CHOOSE ? 12 : 3;
    for (int k = kt_op_operands(n, operand) - 1; k >= 0; k--)
        width += width_of_operand(p, operand[k]);
    return width;
}

/* All nodes that a function needs: outputs, and both sides of its guards. */
static int list_roots(const kt_code_function *f, kt_op *root) {
    int count = 0;
    for (int k = 0; k < f->out_count; k++)
        root[count++] = f->out[k];
    for (int k = 0; k < f->guard_count; k++) {
        root[count++] = f->guard[k].pivot;
        root[count++] = f->guard[k].limit;
    }
    return count;
}

bool kt_code_count_uses(kt_code_printer *p, const kt_code_function *f) {
    kt_op *root = kt_pool_take(&p->pool, (size_t)f->out_count + 2 * (size_t)f->guard_count, sizeof *root);
    if (root != NULL)
        kt_graph_uses(p->graph, root, list_roots(f, root), p->uses);
    return root != NULL;
}

/* Finds which nodes are statements. */
static void lay_out(kt_code_printer *p, const kt_code_function *f) {
    const kt_graph *g = p->graph;
    for (kt_op i = 0; i < g->count; i++)
        p->user[i] = -1;
    for (kt_op i = 0; i < g->count; i++) {
        const kt_op_node *n = &g->node[i];
        if (p->uses[i] == 0 || kt_code_is_leaf(p, i))
            continue;
        kt_op operand[3];
        for (int k = kt_op_operands(n, operand) - 1; k >= 0; k--)
            p->user[operand[k]] = i;
    }
    for (kt_op i = 0; i < g->count; i++) {
        const kt_op_node *n = &g->node[i];
        p->width[i] = 0;
        p->temporary[i] = 0;
        if (p->uses[i] == 0 || kt_code_is_leaf(p, i))
            continue;
        const int width = width_of_node(p, n);
        const bool has_name = n->name[0] != '\0' && p->user[i] >= 0;
        if (n->kind == KT_OP_NEGATE || (is_used_once(p, i) && width <= KT_CODE_WIDTH && !has_name))
            p->width[i] = width;
    }
    for (int k = 0; k < f->guard_count; k++)
        if (p->graph->node[f->guard[k].pivot].kind != KT_OP_NEGATE)
            p->width[f->guard[k].pivot] = 0;
}

/* ---- parts ------------------------------------------------------------------------------------------------------- */

static bool is_statement(const kt_code_printer *p, kt_op i) {
    return p->uses[i] > 0 && p->width[i] == 0 && !kt_code_is_leaf(p, i);
}

kt_op kt_code_guard_node(const kt_code_printer *p, const kt_code_guard *guard) {
    const kt_op pivot = kt_code_is_leaf(p, guard->pivot) ? -1 : guard->pivot;
    const kt_op limit = kt_code_is_leaf(p, guard->limit) ? -1 : guard->limit;
    return pivot > limit ? pivot : limit;
}

/* ---- loops ------------------------------------------------------------------------------------------------------- */

static bool is_sign(const kt_code_printer *p, kt_op i) { return p->graph->node[i].kind == KT_OP_NEGATE; }

/* A node of a loop has a variable in all iterations: the texts of all iterations are requested, although only one is
 * printed. */
static void keep_in_loop(kt_code_printer *p, const kt_code_loop_plan *l, int local) {
    for (int i = 0; i < l->count && !is_sign(p, kt_code_roll_node(&p->roll, l, 0, local)); i++)
        p->width[kt_code_roll_node(&p->roll, l, i, local)] = 0;
}

/* A node that another part reads gets its own statement. A sign remains in the text of its user, unless a loop computes
 * the sign. */
static void read_from_outside(kt_code_printer *p, kt_op i) {
    kt_code_roll *r = &p->roll;
    if (kt_code_is_leaf(p, i))
        return;
    if (r->loop[i] >= 0) {
        if (!kt_code_roll_is_left(r, i))
            (void)kt_code_roll_column(r, i);
        keep_in_loop(p, &r->plan[r->loop[i]], kt_code_roll_local(r, i));
    } else if (!is_sign(p, i)) {
        p->width[i] = 0;
    }
}

int kt_code_next_output(const kt_code_function *f, kt_op i, int from) {
    for (int k = from; k < f->out_count; k++)
        if (f->out[k] == i)
            return k;
    return -1;
}

/* Whether the outputs of a node of a loop are in equal distances of the first array. */
static bool is_written_by_loop(const kt_code_roll *r, const kt_code_loop_plan *l, int local,
                               const kt_code_function *f) {
    int last[2] = {-1, -1}, found = 0;
    for (; found < f->out_count; found++) {
        for (int i = 0; i < 2; i++)
            last[i] = kt_code_next_output(f, kt_code_roll_node(r, l, i, local), last[i] + 1);
        if (last[0] < 0 || last[1] < 0 || last[0] >= f->output[0] || last[1] >= f->output[0])
            break;
        for (int i = 2; i < l->count; i++)
            if (last[0] + i * (last[1] - last[0]) >= f->output[0] || last[0] + i * (last[1] - last[0]) < 0 ||
                f->out[last[0] + i * (last[1] - last[0])] != kt_code_roll_node(r, l, i, local))
                return false;
    }
    if (found == 0 || last[0] >= 0 || last[1] >= 0)
        return false;
    for (int i = 2; i < l->count; i++) {
        int own = 0;
        for (int k = -1; (k = kt_code_next_output(f, kt_code_roll_node(r, l, i, local), k + 1)) >= 0;)
            own++;
        if (own != found)
            return false;
    }
    return true;
}

/* Finds the outputs that loops write at once. */
static void write_in_loops(kt_code_printer *p, const kt_code_function *f) {
    for (int k = 0; k < p->roll.plan_count && f->writes_at_once; k++) {
        const kt_code_loop_plan *l = &p->roll.plan[k];
        for (int local = 0; local < l->size; local++) {
            l->is_written[local] = is_written_by_loop(&p->roll, l, local, f);
            if (l->is_written[local])
                keep_in_loop(p, l, local);
        }
    }
}

bool kt_code_is_written(const kt_code_printer *p, kt_op i) {
    const int loop = kt_code_loop_of(p, i);
    return loop >= 0 && p->roll.plan[loop].is_written[kt_code_roll_local(&p->roll, i)];
}

/* Finds the nodes that one part computes and another part reads, if either part is a loop. */
static void read_across_loops(kt_code_printer *p, const kt_code_function *f) {
    kt_code_roll *r = &p->roll;
    for (int k = 0; k < r->plan_count; k++) {
        const kt_code_loop_plan *l = &r->plan[k];
        for (int s = 0; s < l->slot_count; s++) {
            const kt_code_slot *slot = &l->slot[s];
            if (slot->kind == KT_SLOT_SAME || slot->kind == KT_SLOT_CARRIED)
                read_from_outside(p, slot->cell[0]);
            if (slot->kind == KT_SLOT_CARRIED)
                keep_in_loop(p, l, slot->base);
            for (int i = 0; i < l->count && slot->kind == KT_SLOT_COLUMN; i++)
                read_from_outside(p, slot->cell[i]);
        }
    }
    for (int at = 0; at < r->order_count; at++) {
        kt_op operand[3];
        if (r->loop[r->order[at]] >= 0)
            continue;
        for (int k = kt_op_operands(&p->graph->node[r->order[at]], operand) - 1; k >= 0; k--)
            if (r->loop[operand[k]] >= 0)
                read_from_outside(p, operand[k]);
    }
    for (int k = 0; k < f->out_count; k++)
        if (r->loop[f->out[k]] >= 0 && !kt_code_is_written(p, f->out[k]))
            read_from_outside(p, f->out[k]);
    for (int k = 0; k < f->guard_count; k++) {
        const kt_op at = kt_code_guard_node(p, &f->guard[k]);
        const kt_op side[2] = {f->guard[k].pivot, f->guard[k].limit};
        for (int i = 0; i < 2; i++)
            if (r->loop[side[i]] >= 0 && r->loop[side[i]] != kt_code_loop_of(p, at))
                read_from_outside(p, side[i]);
    }
}

/* Makes room for the prepared numbers of loops, one for each iteration. */
static bool prepare_loops(kt_code_printer *p) {
    size_t more = 0;
    for (int k = 0; k < p->roll.plan_count; k++)
        more += (size_t)p->roll.plan[k].count * (size_t)p->roll.plan[k].prepared_count;
    kt_op *larger = more > 0 ? kt_pool_take(&p->pool, p->list_room + more, sizeof *larger) : p->list;
    if (larger == NULL)
        return false;
    if (more > 0)
        p->list = memcpy(larger, p->list, p->list_room * sizeof *larger);
    p->list_room += more;
    for (int k = 0; k < p->roll.plan_count; k++) {
        kt_code_loop_plan *l = &p->roll.plan[k];
        l->prepared = p->prepared_count;
        for (int s = 0; s < l->slot_count; s++)
            for (int i = 0; i < l->count && l->slot[s].kind == KT_SLOT_PREPARED; i++) {
                const int to = kt_code_roll_prepared(l, l->slot[s].base, i);
                p->list[to] = l->slot[s].cell[i];
                if (p->prepared[l->slot[s].cell[i]] < 0)
                    p->prepared[l->slot[s].cell[i]] = to;
            }
        p->prepared_count += l->count * l->prepared_count;
    }
    return true;
}

static void record_operand_reads(kt_code_printer *p, kt_op i, int part);

/* Extends the parts during which the rows of a loop exist: part number `part` writes or reads them. */
static void extend_row_lifetime(kt_code_loop_plan *l, int part) {
    l->first_part = part < l->first_part ? part : l->first_part;
    l->last_part = part > l->last_part ? part : l->last_part;
}

/* Records the arrays that a part of the text needs, so that the part can read node i:
 *     an input or a prepared number      the array that has it
 *     a number of a loop                 the array of stored numbers, and the loop's rows until this part
 *     a number of another part           the array of stored numbers, here and in that part; until slots are assigned,
 *                                        p->place is the last part that reads the number
 *     any other number                   its operands, since its text is written where it is read */
static void record_reads(kt_code_printer *p, kt_op i, int part) {
    const kt_op_node *n = &p->graph->node[i];
    if (kt_code_is_leaf(p, i)) {
        if (n->kind != KT_OP_CONSTANT)
            p->needs[part] |= 1 << (n->kind == KT_OP_INPUT ? n->a : CODE_PREPARED);
    } else if (p->roll.loop[i] >= 0 && !kt_code_roll_is_left(&p->roll, i)) {
        p->needs[part] |= 1 << CODE_PLACES;
        extend_row_lifetime(&p->roll.plan[p->roll.loop[i]], part);
    } else if (p->width[i] == 0 || p->roll.loop[i] >= 0) {
        if (p->part[i] == part)
            return;
        p->place[i] = part > p->place[i] ? part : p->place[i];
        p->needs[part] |= 1 << CODE_PLACES;
        p->needs[p->part[i]] |= 1 << CODE_PLACES;
    } else {
        record_operand_reads(p, i, part);
    }
}

static void record_operand_reads(kt_code_printer *p, kt_op i, int part) {
    kt_op operand[3];
    for (int k = kt_op_operands(&p->graph->node[i], operand) - 1; k >= 0; k--)
        record_reads(p, operand[k], part);
}

/* Records the arrays that a part needs for the text of a loop. Each slot of the loop reads a prepared number, a row of
 * another loop, or a node that is the same in each pass. */
static void record_loop_reads(kt_code_printer *p, int loop, int part) {
    const kt_code_loop_plan *l = &p->roll.plan[loop];
    for (int s = 0; s < l->slot_count; s++) {
        const kt_code_slot *slot = &l->slot[s];
        if (slot->kind == KT_SLOT_PREPARED)
            p->needs[part] |= 1 << CODE_PREPARED;
        else if (slot->kind == KT_SLOT_COLUMN)
            p->needs[part] |= 1 << CODE_PLACES;
        else
            record_reads(p, slot->cell[0], part);
        if (slot->kind == KT_SLOT_COLUMN)
            extend_row_lifetime(&p->roll.plan[slot->loop], part);
    }
    if (l->column_count > 0)
        p->needs[part] |= 1 << CODE_PLACES;
}

int kt_code_part_of_copy(const kt_code_printer *p, const kt_code_copy *copy) {
    const kt_code_loop_plan *reader = &p->roll.plan[copy->reader];
    const int last = p->part[p->roll.order[reader->start]];
    const int first = kt_code_is_leaf(p, copy->node) ? 0 : p->part[copy->node] + 1;
    if (reader->recurs || reader->count < KT_ROLL_WIDE || copy->loop == copy->reader)
        return last;
    return first > last - KT_CODE_EARLY ? first : last - KT_CODE_EARLY;
}

/* Records the nodes that the copies need. */
static void note_copies(kt_code_printer *p) {
    for (int k = 0; k < p->roll.copy_count; k++) {
        const kt_code_copy *copy = &p->roll.copy[k];
        const int part = kt_code_part_of_copy(p, copy);
        record_reads(p, copy->node, part);
        extend_row_lifetime(&p->roll.plan[copy->loop], part);
        p->needs[part] |= 1 << CODE_PLACES;
    }
}

/* Divides the nodes between two loops into parts. Returns the next part. */
static int divide_nodes(kt_code_printer *p, kt_op begin, kt_op end, int first) {
    int count = 0, before = 0;
    bool is_empty = true;
    for (kt_op i = begin; i < end; i++) {
        count += is_statement(p, i);
        is_empty &= p->roll.at[i] < 0;
    }
    const int parts = is_empty ? 0 : count < 2 * KT_CODE_PART ? 1 : count / KT_CODE_PART;
    for (kt_op i = begin; i < end; i++) {
        const int part = count > 0 ? (int)((int64_t)before * parts / count) : 0;
        p->part[i] = first + (part < parts || parts == 0 ? part : parts - 1);
        before += is_statement(p, i);
    }
    for (int k = 0; k < parts; k++)
        p->loop_of_part[first + k] = -1;
    return first + parts;
}

/* Numbers the parts and loops in the order of the nodes. */
static void number_parts(kt_code_printer *p) {
    const kt_op all = p->graph->count;
    const kt_code_roll *r = &p->roll;
    int part = 0;
    for (kt_op i = 0, end; i < all; i = end) {
        const int loop = r->loop[i];
        for (end = i; end < all && (r->loop[end] == loop || (loop >= 0 && r->at[end] < 0)); end++) {
        }
        if (loop < 0) {
            part = divide_nodes(p, i, end, part);
            continue;
        }
        for (kt_op k = i; k < end; k++)
            p->part[k] = part;
        p->roll.plan[loop].first_part = p->roll.plan[loop].last_part = part;
        p->loop_of_part[part++] = loop;
    }
    p->part_count = part;
}

/* Assigns slots in `w` to numbers. Each number occupies its slot until the last part that reads it; parts follow the
 * order of nodes. Returns false if memory is insufficient. */
static bool place_numbers(kt_code_printer *p) {
    const size_t count = (size_t)p->graph->count + 1;
    kt_pool room = {.chunks = NULL};
    /* by numbers whose last reader is part k, and the next one of these */
    int32_t *held = kt_pool_take(&room, (size_t)p->part_count + 1, sizeof *held);
    int32_t *next = kt_pool_take(&room, count, sizeof *next);
    int32_t *unused = kt_pool_take(&room, count, sizeof *unused), unused_count = 0, part = 0;
    const bool fine = held != NULL && next != NULL && unused != NULL;
    for (int k = 0; fine && k <= p->part_count; k++)
        held[k] = -1;
    for (kt_op i = 0; fine && i < p->graph->count; i++) {
        const int32_t last = p->place[i];
        if (last < 0)
            continue;
        for (; part < p->part[i]; part++)
            for (int32_t k = held[part]; k >= 0; k = next[k])
                unused[unused_count++] = p->place[k];
        p->place[i] = unused_count > 0 ? unused[--unused_count] : p->place_count++;
        next[i] = held[last];
        held[last] = i;
    }
    kt_pool_free(room.chunks);
    return fine;
}

static int count_places(const kt_code_loop_plan *l) { return l->column_count * (l->last_row - l->first_row + 1); }

/* Whether two loops need different slots, because both hold rows in one part. */
static bool hold_places_at_once(const kt_code_loop_plan *a, const kt_code_loop_plan *b) {
    return a->first_part <= b->last_part && b->first_part <= a->last_part;
}

/* Assigns slots in `w` to columns, after the slots of single numbers: the first slots that are unused in all parts that
 * hold rows. */
static void place_columns(kt_code_printer *p) {
    const kt_code_loop_plan *plan = p->roll.plan;
    const int begin = p->place_count;
    for (int k = 0; k < p->roll.plan_count; k++) {
        kt_code_loop_plan *l = &p->roll.plan[k];
        const int count = count_places(l);
        l->place = begin;
        for (int other = 0; other < k; other++) {
            const int end = plan[other].place + count_places(&plan[other]);
            if (!hold_places_at_once(l, &plan[other]) || l->place >= end || plan[other].place >= l->place + count)
                continue;
            l->place = end;
            other = -1; /* the loops before may have places there */
        }
        p->place_count = l->place + count > p->place_count ? l->place + count : p->place_count;
    }
}

int kt_code_place(const kt_code_printer *p, kt_op i) {
    const int loop = kt_code_loop_of(p, i);
    if (loop < 0 || kt_code_roll_is_left(&p->roll, i))
        return p->place[i];
    const kt_code_loop_plan *l = &p->roll.plan[loop];
    return kt_code_roll_place(l, l->column[kt_code_roll_local(&p->roll, i)], kt_code_roll_iteration(&p->roll, i));
}

/* Finds the nodes that each part needs. */
static void note_all(kt_code_printer *p, const kt_code_function *f) {
    memset(p->needs, 0, (size_t)(p->part_count + 1) * sizeof *p->needs);
    for (kt_op i = 0; i < p->graph->count; i++)
        if (is_statement(p, i) && p->roll.loop[i] < 0)
            record_operand_reads(p, i, p->part[i]);
    for (int part = 0; part < p->part_count; part++)
        if (p->loop_of_part[part] >= 0)
            record_loop_reads(p, p->loop_of_part[part], part);
    note_copies(p);
    for (int k = 0; k < f->guard_count; k++) {
        const kt_op at = kt_code_guard_node(p, &f->guard[k]);
        const int part = at < 0 ? 0 : p->part[at];
        p->needs[part] |= 1 << CODE_GUARDS;
        if (at >= 0 && p->roll.loop[at] >= 0)
            continue; /* they are operands of the loop */
        record_reads(p, f->guard[k].pivot, part);
        record_reads(p, f->guard[k].limit, part);
    }
    for (int k = 0, first = 0, array = 0; k < f->out_count; k++) {
        const int own = kt_code_is_leaf(p, f->out[k]) ? 0 : p->part[f->out[k]];
        const bool is_at_once = f->writes_at_once && (p->roll.loop[f->out[k]] < 0 || kt_code_is_written(p, f->out[k]));
        const int part = is_at_once ? own : p->part_count;
        while (k - first >= f->output[array])
            first += f->output[array++];
        if (!kt_code_is_written(p, f->out[k]))
            record_reads(p, f->out[k], part);
        p->needs[part] |= 1 << (CODE_OUTPUT + array);
    }
}

bool kt_code_part_is_small(const kt_code_printer *p, int part) {
    int count = 0;
    const kt_code_loop_plan *l = p->loop_of_part[part] >= 0 ? &p->roll.plan[p->loop_of_part[part]] : NULL;
    if (l != NULL) /* vectors need many registers */
        return l->size < KT_CODE_PART / 2 && (l->recurs || l->count < KT_ROLL_WIDE);
    for (kt_op i = 0; i < p->graph->count; i++)
        count += p->part[i] == part && is_statement(p, i) && p->roll.loop[i] < 0;
    return count < KT_CODE_PART / 2;
}

bool kt_code_plan_parts(kt_code_printer *p, const kt_code_function *f) {
    const kt_graph *g = p->graph;
    int count = 0;
    kt_code_roll_free(&p->roll);
    lay_out(p, f);
    for (kt_op i = 0; i < g->count; i++) {
        count += is_statement(p, i);
        p->part[i] = 0;
        p->place[i] = -1;
    }
    p->at_part = p->place_count = 0;
    p->part_count = 1;
    if (count <= KT_CODE_LONG || p->origin != KT_OP_OF_STATE)
        return true;
    if (!kt_code_roll_find(&p->roll, g, p->uses, f->guard, f->guard_count, f->may_roll))
        return false;
    write_in_loops(p, f);
    read_across_loops(p, f);
    number_parts(p);
    if (kt_code_has_parts(p))
        note_all(p, f);
    if (!place_numbers(p))
        return false;
    place_columns(p);
    return prepare_loops(p);
}
