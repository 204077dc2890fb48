/* C of a function, in the order in which its nodes were made: straight lines, or the parts of text_parts.c.
 *
 * Brackets keep the order of operations, so that all compilers round alike. Signs are written into their users.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/text_parts.h"
#include "document/number.h"
#include "kinetree/loop.h"

/* The place of an operand: left or right in a sum, or in a product. */
typedef enum code_place { CODE_SUM, CODE_SUM_RIGHT, CODE_PRODUCT, CODE_PRODUCT_RIGHT } code_place;

bool kt_code_printer_init(kt_code_printer *p, const kt_code_tree *tree, FILE *file) {
    const size_t count = (size_t)tree->graph->count + 1;
    *p = (kt_code_printer){.tree = tree, .graph = tree->graph, .file = file};
    int32_t **const array[] = {&p->uses, &p->user, &p->width, &p->temporary, &p->prepared,
                               &p->list, &p->part, &p->place, &p->needs,     &p->loop_of_part};
    for (size_t k = 0; k < sizeof array / sizeof *array; k++)
        if ((*array[k] = kt_pool_take(&p->pool, count, sizeof **array[k])) == NULL)
            return false;
    p->slot = kt_pool_take(&p->pool, count, sizeof *p->slot);
    p->list_room = count;
    if (p->slot == NULL || tree->graph->failed)
        return false;
    for (size_t i = 0; i < count; i++)
        p->prepared[i] = -1;
    return true;
}

void kt_code_printer_free(kt_code_printer *p) {
    kt_pool_free(p->pool.chunks);
    kt_code_roll_free(&p->roll);
}

/* Prints a number such that C reads back the same bits. */
static void print_code_number(FILE *file, double value) {
    char text[KT_NUMBER_SIZE];
    kt_number_format(text, value);
    if (value == (double)(long)value && value > -1e6 && value < 1e6)
        fprintf(file, "%ld", (long)value);
    else
        fprintf(file, "(number)%s", text);
}

/* ---- expressions ------------------------------------------------------------------------------------------------- */

static void print_operand(kt_code_printer *p, kt_op i, code_place place);

static const char *name_of_input(const kt_code_printer *p, const kt_op_node *n) {
    const char *const name[] = {"q", "v", p->arrays->given, "s", "c", "x"};
    return name[n->a];
}

static void print_input(const kt_code_printer *p, const kt_op_node *n) {
    if (n->a == KT_OP_TIME)
        fputs("time", p->file);
    else
        fprintf(p->file, "%s[%d]", name_of_input(p, n), (int)n->b);
}

/* A number, an input, or a prepared number, which gets its index when it is printed first. */
static void print_leaf(kt_code_printer *p, kt_op i, code_place place) {
    const kt_op_node *n = &p->graph->node[i];
    if (n->kind == KT_OP_CONSTANT) {
        const bool bracket = n->value < 0.0 && place != CODE_SUM;
        fputs(bracket ? "(" : "", p->file);
        print_code_number(p->file, n->value);
        fputs(bracket ? ")" : "", p->file);
    } else if (n->kind == KT_OP_INPUT) {
        print_input(p, n);
    } else if (p->origin == KT_OP_OF_PARAMETERS) {
        fprintf(p->file, "p->%s", p->tree->parameter[n->a].name);
    } else {
        if (p->prepared[i] < 0) {
            p->list[p->prepared_count] = i;
            p->prepared[i] = p->prepared_count++;
        }
        fprintf(p->file, "k[%d]", (int)p->prepared[i]);
    }
}

/* An operand that must be a vector if the file has lanes: numbers of the model are scalars. */
static void print_real(kt_code_printer *p, kt_op i, code_place place) {
    const bool is_number =
        p->origin == KT_OP_OF_STATE && kt_code_is_leaf(p, i) && p->graph->node[i].kind != KT_OP_INPUT;
    fputs(is_number ? "SAME(" : "", p->file);
    print_operand(p, i, is_number ? CODE_SUM : place);
    fputs(is_number ? ")" : "", p->file);
}

/* real_f(a, b) for states, (number)f((double)a, (double)b) for prepared numbers */
static void print_call(kt_code_printer *p, const kt_op_node *n) {
    const bool is_real = p->origin == KT_OP_OF_STATE;
    kt_op operand[3];
    const int count = kt_op_operands(n, operand);
    fprintf(p->file, is_real ? "real_%s(" : "(number)%s(", kt_op_function_name((kt_op_function)n->c));
    for (int k = 0; k < count; k++) {
        fputs(k > 0 ? ", " : "", p->file);
        fputs(is_real ? "" : "(double)", p->file);
        print_real(p, operand[k], is_real ? CODE_SUM : CODE_PRODUCT_RIGHT);
    }
    fputs(")", p->file);
}

/* Outside of functions of the state there are no lanes, so that C chooses. */
static void print_choice(kt_code_printer *p, const kt_op_node *n) {
    const bool is_real = p->origin == KT_OP_OF_STATE;
    fputs(is_real ? "CHOOSE(" : "(", p->file);
    print_real(p, n->a, CODE_SUM);
    fputs(is_real ? ", " : " > 0 ? ", p->file);
    print_real(p, n->b, CODE_SUM);
    fputs(is_real ? ", " : " : ", p->file);
    print_real(p, n->c, CODE_SUM);
    fputs(")", p->file);
}

/* An operation with its operands. -(a - b) becomes b - a, if a - b has no variable of its own. */
static void print_expression(kt_code_printer *p, kt_op i, code_place place) {
    static const char *const sign[] = {
        [KT_OP_ADD] = " + ", [KT_OP_SUBTRACT] = " - ", [KT_OP_MULTIPLY] = " * ", [KT_OP_DIVIDE] = " / "};
    const kt_op_node *n = &p->graph->node[i];
    if (n->kind == KT_OP_CALL) {
        print_call(p, n);
        return;
    }
    if (n->kind == KT_OP_CHOOSE) {
        print_choice(p, n);
        return;
    }
    const kt_op_node *inner = n->kind == KT_OP_NEGATE ? &p->graph->node[n->a] : NULL;
    const bool swaps = inner != NULL && inner->kind == KT_OP_SUBTRACT && p->width[n->a] > 0 && p->slot[n->a] == NULL &&
                       !kt_code_is_leaf(p, n->a);
    const bool is_sum = n->kind == KT_OP_ADD || n->kind == KT_OP_SUBTRACT || swaps;
    const bool is_product = n->kind == KT_OP_MULTIPLY || n->kind == KT_OP_DIVIDE;
    const bool bracket = is_sum       ? place != CODE_SUM
                         : is_product ? place == CODE_PRODUCT_RIGHT
                                      : place != CODE_SUM; /* no two signs in a row */
    fputs(bracket ? "(" : "", p->file);
    if (swaps) {
        print_operand(p, inner->b, CODE_SUM);
        fputs(" - ", p->file);
        print_operand(p, inner->a, CODE_SUM_RIGHT);
    } else if (inner != NULL) {
        fputs("-", p->file);
        print_operand(p, n->a, CODE_PRODUCT);
    } else {
        print_operand(p, n->a, is_sum ? CODE_SUM : CODE_PRODUCT);
        fputs(sign[n->kind], p->file);
        print_operand(p, n->b, is_sum ? CODE_SUM_RIGHT : CODE_PRODUCT_RIGHT);
    }
    fputs(bracket ? ")" : "", p->file);
}

/* first + step i */
static void print_index(const kt_code_printer *p, const char *array, int first, int step) {
    fprintf(p->file, step < 0 ? "%s[%d - %d * i]" : "%s[%d + %d * i]", array, first, step < 0 ? -step : step);
}

/* Whether a slot is a sign that no loop computes: such a sign has no variable, and its operand may be another slot. */
static bool is_same_sign(const kt_code_printer *p, const kt_code_slot *s) {
    const kt_op i = s->cell[0];
    return s->kind == KT_SLOT_SAME && !kt_code_is_leaf(p, i) && kt_code_loop_of(p, i) < 0 && p->width[i] > 0;
}

/* An operand of a loop, from outside of the iteration. */
static void print_slot(const kt_code_printer *p, const kt_code_slot *s, kt_op i) {
    const kt_code_loop_plan *own = &p->roll.plan[p->loop_of_part[p->at_part]], *from = &p->roll.plan[s->loop];
    if (s->kind == KT_SLOT_INPUT)
        print_index(p, name_of_input(p, &p->graph->node[i]), s->base, s->step);
    else if (s->kind == KT_SLOT_PREPARED)
        print_index(p, "k", kt_code_roll_prepared(own, s->base, 0), kt_code_roll_prepared_stride(own));
    else if (s->kind == KT_SLOT_CARRIED)
        fprintf(p->file, "carried%d", (int)s->base);
    else if (s->kind == KT_SLOT_SAME)
        fprintf(p->file, "same%d", (int)(s - own->slot));
    else
        print_index(p, "w", kt_code_roll_place(from, s->base, s->row), s->step * kt_code_roll_stride(from));
}

/* Prints a reference to a node: its text, its variable, its number in `w`, or its name in the loop that is printed. */
static void print_operand(kt_code_printer *p, kt_op i, code_place place) {
    const kt_op_node *n = &p->graph->node[i];
    const int loop = kt_code_loop_of(p, i);
    if (p->slot[i] != NULL && (p->slot[i]->kind != KT_SLOT_SAME || is_same_sign(p, p->slot[i])))
        print_slot(p, p->slot[i], i);
    else if (kt_code_is_leaf(p, i))
        print_leaf(p, i, place);
    else if (loop >= 0 && p->part[i] != p->at_part)
        fprintf(p->file, "w[%d]", kt_code_place(p, i));
    else if (p->width[i] > 0)
        print_expression(p, i, place);
    else if (p->part[i] != p->at_part)
        fprintf(p->file, "w[%d]", (int)p->place[i]);
    else if (n->name[0] != '\0')
        fputs(n->name, p->file);
    else
        fprintf(p->file, "t%d", (int)p->temporary[i]);
}

/* ---- statements -------------------------------------------------------------------------------------------------- */

/* Prints the comment of a block if it begins with this node. */
static void print_section(const kt_code_printer *p, kt_op i, int32_t *section) {
    const int32_t own = p->graph->node[i].section;
    if (own == *section || own < 0)
        return;
    *section = own;
    fputs("\n    /* ", p->file);
    for (const char *at = p->graph->section[own].text; *at != '\0'; at++)
        if (*at == '\n')
            fputs("\n     * ", p->file);
        else
            fputc(*at, p->file);
    fputs(" */\n", p->file);
}

/* The body of a guard in iteration i of a loop. The pattern of the body is the second iteration. */
static void print_body_of_loop(const kt_code_printer *p, const kt_code_function *f, const kt_code_guard *guard) {
    const kt_code_loop_plan *l = &p->roll.plan[p->roll.loop[guard->pivot]];
    const kt_op before = kt_code_roll_node(&p->roll, l, 0, kt_code_roll_local(&p->roll, guard->pivot));
    int body = guard->body;
    for (int k = 0; k < f->guard_count; k++)
        body = f->guard[k].pivot == before ? f->guard[k].body : body;
    const int step = guard->body - body;
    fprintf(p->file, step < 0 ? "%d - %d * i;\n" : "%d + %d * i;\n", body, step < 0 ? -step : step);
}

/* Prints the guards whose numbers are known once node i is known: both operands are leaves or at most i, and one is
 * i. */
static void print_guards(kt_code_printer *p, const kt_code_function *f, kt_op i) {
    for (int k = 0; k < f->guard_count; k++) {
        const kt_code_guard *guard = &f->guard[k];
        if (kt_code_guard_node(p, guard) != i)
            continue;
        fputs("    if (!is_above(", p->file);
        print_real(p, guard->pivot, CODE_SUM);
        fputs(guard->loop == 0 ? ", NO_INERTIA * " : guard->is_near ? ", NEAR_SINGULAR * " : ", SINGULAR * ", p->file);
        print_real(p, guard->limit, CODE_PRODUCT_RIGHT);
        fputs("))\n        return ", p->file);
        if (kt_code_loop_of(p, i) >= 0)
            print_body_of_loop(p, f, guard);
        else
            fprintf(p->file, "%d; /* %s */\n", guard->loop > 0 ? -guard->loop : guard->body,
                    guard->loop > 0 ? kt_loop_name(p->tree->model, guard->loop - 1)
                                    : kt_joint_name(p->tree->model, guard->body));
    }
}

enum { OUTPUTS_ALL = -2, OUTPUTS_OF_LOOPS = -3, LEAST_ZEROS = 4 /* in a loop */ };

/* Prints the assignment to output k. Equal outputs, as in a symmetric matrix, are one statement, printed at the first
 * of them. */
static void print_output(kt_code_printer *p, const kt_code_function *f, int k, int first, int array) {
    const kt_op out = f->out[k];
    const bool is_shared = p->graph->node[out].kind != KT_OP_CONSTANT;
    for (int j = first; j < k && is_shared; j++)
        if (f->out[j] == out)
            return;
    fputs("    ", p->file);
    for (int j = k; j < first + f->output[array]; j++)
        if (j == k || (is_shared && f->out[j] == out))
            fprintf(p->file, "%s[%d] = ", p->arrays->output[array], j - first);
    print_real(p, out, CODE_SUM);
    fputs(";\n", p->file);
}

/* How many outputs from k on are zero; end: of their array. */
static int count_zeros(const kt_code_printer *p, const kt_code_function *f, int k, int end) {
    int count = 0;
    while (k + count < end && kt_op_is(p->graph, f->out[k + count], 0.0))
        count++;
    return count;
}

/* Prints the outputs of node i; -1: outputs that are leaves; OUTPUTS_OF_LOOPS: outputs of loops; OUTPUTS_ALL: all
 * outputs. */
static void print_outputs(kt_code_printer *p, const kt_code_function *f, kt_op i) {
    for (int k = 0, first = 0, array = 0; k < f->out_count; k++) {
        while (k - first >= f->output[array])
            first += f->output[array++];
        const bool is_leaf_pass = i < 0 && i != OUTPUTS_OF_LOOPS && p->origin == KT_OP_OF_STATE;
        const int zeros = is_leaf_pass ? count_zeros(p, f, k, first + f->output[array]) : 0;
        if (zeros >= LEAST_ZEROS) {
            fprintf(p->file, "    for (int i = %d; i < %d; i++)\n        %s[i] = SAME(0);\n", k - first,
                    k - first + zeros, p->arrays->output[array]);
            k += zeros - 1;
            continue;
        }
        if (i == OUTPUTS_ALL ||
            (i == OUTPUTS_OF_LOOPS ? kt_code_loop_of(p, f->out[k]) >= 0 && !kt_code_is_written(p, f->out[k])
             : i < 0               ? kt_code_is_leaf(p, f->out[k])
                                   : f->out[k] == i))
            print_output(p, f, k, first, array);
    }
}

/* If a node of a part is a statement, prints the statement, and the outputs and guards that follow. */
static void print_node(kt_code_printer *p, const kt_code_function *f, kt_op i, int32_t *section, int32_t *temporary) {
    if (p->width[i] == 0) {
        print_section(p, i, section);
        p->temporary[i] = ++*temporary;
        fputs(p->origin == KT_OP_OF_STATE ? "    const real " : "    const number ", p->file);
        print_operand(p, i, CODE_SUM);
        fputs(" = ", p->file);
        print_expression(p, i, CODE_SUM);
        fputs(";\n", p->file);
        if (p->place[i] >= 0) {
            fprintf(p->file, "    w[%d] = ", (int)p->place[i]);
            print_operand(p, i, CODE_SUM);
            fputs(";\n", p->file);
        }
    }
    print_guards(p, f, i);
}

/* Prints, at the beginning of a function, outputs and guards that need no statement. */
static void print_first(kt_code_printer *p, const kt_code_function *f) {
    print_guards(p, f, -1);
    if (kt_code_has_parts(p) && f->writes_at_once)
        print_outputs(p, f, -1);
}

/* Prints the statements of one part, with the outputs if the part writes outputs immediately. */
static void print_statements(kt_code_printer *p, const kt_code_function *f, int32_t *temporary) {
    const kt_graph *g = p->graph;
    const bool writes = kt_code_has_parts(p) && f->writes_at_once;
    int32_t section = -1;
    for (kt_op i = 0; i < g->count; i++) {
        if (p->uses[i] == 0 || p->part[i] != p->at_part || kt_code_is_leaf(p, i) || kt_code_loop_of(p, i) >= 0)
            continue;
        print_node(p, f, i, &section, temporary);
        if (writes)
            print_outputs(p, f, i);
    }
}

/* Prints the copies to rows that a part begins with. */
static void print_copies(kt_code_printer *p) {
    for (int k = 0; k < p->roll.copy_count; k++) {
        const kt_code_copy *copy = &p->roll.copy[k];
        if (kt_code_part_of_copy(p, copy) != p->at_part)
            continue;
        fprintf(p->file, "    w[%d] = ", kt_code_roll_place(&p->roll.plan[copy->loop], copy->column, copy->row));
        print_real(p, copy->node, CODE_SUM);
        fputs(";\n", p->file);
    }
}

/* Prints signs that are equal in all iterations, and the first values of the variables that iterations carry. */
static void print_start_of_loop(kt_code_printer *p, int loop) {
    const kt_code_loop_plan *l = &p->roll.plan[loop];
    for (int k = 0; k < l->slot_count; k++) {
        if (l->slot[k].kind == KT_SLOT_CARRIED)
            fprintf(p->file, "    real carried%d = ", (int)l->slot[k].base);
        else if (is_same_sign(p, &l->slot[k]))
            fprintf(p->file, "    const real same%d = ", k);
        else
            continue;
        print_real(p, l->slot[k].cell[0], CODE_SUM);
        fputs(";\n", p->file);
    }
    fprintf(p->file,
            "    /* One iteration for each of %d groups of links; comments and names are those of the second. */\n"
            "    for (int i = 0; i < %d; i++) {\n",
            (int)l->count, (int)l->count);
}

/* Prints where an iteration stores a node: in its column, and in outputs. */
static void print_stores(kt_code_printer *p, const kt_code_function *f, const kt_code_loop_plan *l, int local) {
    const kt_op first = kt_code_roll_node(&p->roll, l, 0, local), pattern = kt_code_roll_node(&p->roll, l, 1, local);
    if (l->column[local] < 0 && !l->is_written[local])
        return;
    fputs("    ", p->file);
    if (l->column[local] >= 0) {
        print_index(p, "w", kt_code_roll_place(l, l->column[local], 0), kt_code_roll_stride(l));
        fputs(" = ", p->file);
    }
    for (int a = -1, b = -1; l->is_written[local];) {
        a = kt_code_next_output(f, first, a + 1);
        b = kt_code_next_output(f, pattern, b + 1);
        if (a < 0)
            break;
        print_index(p, p->arrays->output[0], a, b - a);
        fputs(" = ", p->file);
    }
    print_real(p, pattern, CODE_SUM);
    fputs(";\n", p->file);
}

/* Prints the values that the next iteration reads: all values before the first change, because the text of a value may
 * read others. */
static void print_carried(kt_code_printer *p, const kt_code_loop_plan *l) {
    for (int k = 0; k < l->slot_count; k++) {
        if (l->slot[k].kind != KT_SLOT_CARRIED)
            continue;
        fprintf(p->file, "    const real next%d = ", (int)l->slot[k].base);
        print_real(p, kt_code_roll_node(&p->roll, l, 1, l->slot[k].base), CODE_SUM);
        fputs(";\n", p->file);
    }
    for (int k = 0; k < l->slot_count; k++)
        if (l->slot[k].kind == KT_SLOT_CARRIED)
            fprintf(p->file, "    carried%d = next%d;\n", (int)l->slot[k].base, (int)l->slot[k].base);
}

/* Prints a loop: the second iteration with the operands of iteration i. */
static void print_loop(kt_code_printer *p, const kt_code_function *f, int loop, int32_t *temporary) {
    const kt_code_loop_plan *l = &p->roll.plan[loop];
    int32_t section = -1;
    print_start_of_loop(p, loop);
    for (int k = 0; k < l->slot_count; k++)
        p->slot[l->slot[k].cell[1]] = &l->slot[k];
    for (int local = 0; local < l->size; local++)
        print_node(p, f, kt_code_roll_node(&p->roll, l, 1, local), &section, temporary);
    for (int local = 0; local < l->size; local++)
        print_stores(p, f, l, local);
    print_carried(p, l);
    for (int k = 0; k < l->slot_count; k++)
        p->slot[l->slot[k].cell[1]] = NULL;
    fputs("    }\n", p->file);
    for (int k = 0; k < l->slot_count; k++) {
        const kt_code_slot *s = &l->slot[k];
        const kt_op last = s->kind == KT_SLOT_CARRIED ? kt_code_roll_node(&p->roll, l, l->count - 1, s->base) : -1;
        if (last >= 0 && p->place[last] >= 0 && kt_code_roll_is_left(&p->roll, last))
            fprintf(p->file, "    w[%d] = carried%d;\n", (int)p->place[last], (int)s->base);
    }
}

/* Whether a function has a node of this kind. For inputs, the node must read this array. */
static bool has_node(kt_code_printer *p, const kt_code_function *f, kt_op_kind kind, kt_op_array array) {
    p->failed |= !kt_code_count_uses(p, f);
    for (kt_op i = 0; i < p->graph->count && !p->failed; i++) {
        const kt_op_node *n = &p->graph->node[i];
        if (p->uses[i] > 0 && n->kind == kind && (kind != KT_OP_INPUT || n->a == (int32_t)array))
            return true;
    }
    return false;
}

bool kt_code_reads(kt_code_printer *p, const kt_code_function *f, kt_op_array array) {
    return has_node(p, f, KT_OP_INPUT, array);
}

bool kt_code_calls(kt_code_printer *p, const kt_code_function *f) { return has_node(p, f, KT_OP_CALL, KT_OP_POSITION); }

/* Finds the statements and parts of a function. If memory is insufficient, records this and returns false. */
static bool plan_function(kt_code_printer *p, const kt_code_function *f, int origin, const kt_code_arrays *arrays) {
    p->origin = origin;
    p->arrays = arrays;
    p->failed |= !kt_code_count_uses(p, f) || !kt_code_plan_parts(p, f);
    return !p->failed;
}

/* Prints the arguments of a part, in the form of its declaration or of a call. */
static void print_arguments(const kt_code_printer *p, int part, bool declares) {
    const kt_code_arrays *a = p->arrays;
    const char *const name[CODE_ARGUMENTS] = {"q",    "v", a->given,     "s",          "c",          "x",
                                              "time", "k", a->output[0], a->output[1], a->output[2], "w"};
    bool is_next = false;
    for (int k = 0; k < CODE_ARGUMENTS; k++) {
        if (!(p->needs[part] & 1 << k))
            continue;
        fprintf(p->file, "%s%s%s", is_next ? ", " : "",
                !declares            ? ""
                : k == KT_OP_TIME    ? "real "
                : k == CODE_PREPARED ? "const number *restrict "
                : k < CODE_OUTPUT    ? "const real *restrict "
                                     : "real *restrict ",
                name[k]);
        is_next = true;
    }
    fputs(")", p->file);
}

void kt_code_print_parts(kt_code_printer *p, const kt_code_function *f, const kt_code_arrays *arrays,
                         const char *name) {
    int32_t temporary = 0;
    if (!plan_function(p, f, KT_OP_OF_STATE, arrays) || !kt_code_has_parts(p))
        return;
    p->has_parts = true;
    for (p->at_part = 0; p->at_part < p->part_count; p->at_part++) {
        const bool has_guards = p->needs[p->at_part] & 1 << CODE_GUARDS;
        fprintf(p->file, "/* Part %d of %d. */\n%sstatic %s %s_%d(", p->at_part + 1, p->part_count,
                kt_code_part_is_small(p, p->at_part) ? "" : "PART ", has_guards ? "int" : "void", name, p->at_part + 1);
        print_arguments(p, p->at_part, true);
        fputs(" {\n", p->file);
        if (p->at_part == 0)
            print_first(p, f);
        print_copies(p);
        if (p->loop_of_part[p->at_part] >= 0)
            print_loop(p, f, p->loop_of_part[p->at_part], &temporary);
        else
            print_statements(p, f, &temporary);
        fputs(has_guards ? "    return 0;\n}\n\n" : "}\n\n", p->file);
    }
}

/* Prints the calls of all parts. */
static void print_calls(kt_code_printer *p, const kt_code_function *f, const char *name) {
    if (p->place_count > 0)
        fprintf(p->file, "    real w[%d]; /* what parts read of others */\n", p->place_count);
    fputs(f->guard_count > 0 ? "    int code;\n" : "", p->file);
    for (int part = 0; part < p->part_count; part++) {
        const bool has_guards = p->needs[part] & 1 << CODE_GUARDS;
        fprintf(p->file, "    %s%s_%d(", has_guards ? "code = " : "", name, part + 1);
        print_arguments(p, part, false);
        fputs(has_guards ? ";\n    if (code != 0)\n        return code;\n" : ";\n", p->file);
    }
    p->at_part = p->part_count;
}

void kt_code_print_function(kt_code_printer *p, const kt_code_function *f, const char *name) {
    int32_t temporary = 0;
    if (p->failed)
        return;
    if (kt_code_has_parts(p)) {
        print_calls(p, f, name);
    } else {
        print_first(p, f);
        print_statements(p, f, &temporary);
    }
    fputs("\n", p->file);
    print_outputs(p, f, !kt_code_has_parts(p) || !f->writes_at_once ? OUTPUTS_ALL : OUTPUTS_OF_LOOPS);
}

void kt_code_print_prepared(kt_code_printer *p) {
    static const kt_code_arrays arrays = {.output = {"k"}};
    const kt_code_function f = {.out = p->list, .out_count = p->prepared_count, .output = {p->prepared_count}};
    int32_t temporary = 0;
    if (!plan_function(p, &f, KT_OP_OF_PARAMETERS, &arrays))
        return;
    print_statements(p, &f, &temporary);
    fputs("\n", p->file);
    print_outputs(p, &f, OUTPUTS_ALL);
}
