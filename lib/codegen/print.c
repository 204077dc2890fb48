/* Straight-line C of a function, in the order in which its nodes were made.
 *
 * A node that is used once, and whose text is short, is written into its user. Brackets keep the order of operations,
 * so that all compilers round alike. Signs are written into their users.
 *
 * A compiler keeps the variables of a function in few registers. In a long one, it moves most of them to memory and
 * back, often many times. A long function is therefore divided into parts, which are static functions. A number that
 * another part reads is written once, to the array `w`.
 */
#include "codegen/print.h"
#include "document/number.h"
#include "kinetree/loop.h"

#include <stdlib.h>
#include <string.h>

enum {
    KT_CODE_WIDTH = 48,  /* the longest text that is written into another */
    KT_CODE_LONG = 1000, /* a function of more statements has parts */
    KT_CODE_PART = 150   /* statements of a part, about */
};

/* Arguments of a part, behind the arrays of kt_op_array. */
enum {
    CODE_PREPARED = KT_OP_TIME + 1,
    CODE_OUTPUT, /* the first of three */
    CODE_PLACES = CODE_OUTPUT + 3,
    CODE_ARGUMENTS,
    CODE_GUARDS = CODE_ARGUMENTS
};

/* The place of an operand: left or right in a sum, or in a product. */
typedef enum code_place { CODE_SUM, CODE_SUM_RIGHT, CODE_PRODUCT, CODE_PRODUCT_RIGHT } code_place;

bool kt_code_printer_init(kt_code_printer *p, const kt_code_tree *tree, FILE *file) {
    const size_t count = (size_t)tree->graph->count + 1;
    *p = (kt_code_printer){.tree = tree, .graph = tree->graph, .file = file};
    p->uses = malloc(count * sizeof *p->uses);
    p->user = malloc(count * sizeof *p->user);
    p->width = malloc(count * sizeof *p->width);
    p->temporary = malloc(count * sizeof *p->temporary);
    p->prepared = malloc(count * sizeof *p->prepared);
    p->list = malloc(count * sizeof *p->list);
    p->part = malloc(count * sizeof *p->part);
    p->place = malloc(count * sizeof *p->place);
    p->needs = malloc(count * sizeof *p->needs);
    if (p->part == NULL || p->place == NULL || p->needs == NULL || p->uses == NULL || p->user == NULL ||
        p->width == NULL || p->temporary == NULL || p->prepared == NULL || p->list == NULL || tree->graph->failed)
        return false;
    for (size_t i = 0; i < count; i++)
        p->prepared[i] = -1;
    return true;
}

void kt_code_printer_free(kt_code_printer *p) {
    free(p->uses);
    free(p->user);
    free(p->width);
    free(p->temporary);
    free(p->prepared);
    free(p->list);
    free(p->part);
    free(p->place);
    free(p->needs);
}

void kt_code_print_number(FILE *file, double value) {
    char text[KT_NUMBER_SIZE];
    kt_number_format(text, value);
    if (value == (double)(long)value && value > -1e6 && value < 1e6)
        fprintf(file, "%ld", (long)value);
    else
        fprintf(file, "(real)%s", text);
}

/* ---- layout ------------------------------------------------------------------------------------------------------ */

/* Whether a node is not computed by the function that is printed: a number, an input, a prepared number. */
static bool is_leaf_of_code(const kt_code_printer *p, kt_op i) {
    const kt_op_node *n = &p->graph->node[i];
    return n->kind < KT_OP_ADD || n->origin < p->origin;
}

/* Whether a node is used once. A sign in between has no variable, and must itself be used once. */
static bool is_used_once(const kt_code_printer *p, kt_op i) {
    const kt_op user = p->user[i];
    if (p->uses[i] != 1)
        return false;
    return user < 0 || p->graph->node[user].kind != KT_OP_NEGATE || p->uses[user] == 1;
}

static int width_of_operand(const kt_code_printer *p, kt_op i) {
    return is_leaf_of_code(p, i) ? 5 : p->width[i] > 0 ? p->width[i] + 2 : 5;
}

/* The width of the text of a node: its operands, and signs, brackets and names between them. */
static int width_of_node(const kt_code_printer *p, const kt_op_node *n) {
    kt_op operand[3];
    int width = n->kind == KT_OP_NEGATE ? 1 : n->kind == KT_OP_CALL ? 20 : n->kind == KT_OP_CHOOSE ? 12 : 3;
    for (int k = kt_op_operands(n, operand) - 1; k >= 0; k--)
        width += width_of_operand(p, operand[k]);
    return width;
}

/* Finds which nodes are statements. */
static void lay_out(kt_code_printer *p, const kt_code_function *f) {
    const kt_graph *g = p->graph;
    for (kt_op i = 0; i < g->count; i++)
        p->user[i] = -1;
    for (kt_op i = 0; i < g->count; i++) {
        const kt_op_node *n = &g->node[i];
        if (p->uses[i] == 0 || is_leaf_of_code(p, i))
            continue;
        kt_op operand[3];
        for (int k = kt_op_operands(n, operand) - 1; k >= 0; k--)
            p->user[operand[k]] = i;
    }
    for (kt_op i = 0; i < g->count; i++) {
        const kt_op_node *n = &g->node[i];
        p->width[i] = 0;
        p->temporary[i] = 0;
        if (p->uses[i] == 0 || is_leaf_of_code(p, i))
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
    return p->uses[i] > 0 && p->width[i] == 0 && !is_leaf_of_code(p, i);
}

/* The node behind which a guard is printed; -1: before all. */
static kt_op node_of_guard(const kt_code_printer *p, const kt_code_guard *guard) {
    const kt_op pivot = is_leaf_of_code(p, guard->pivot) ? -1 : guard->pivot;
    const kt_op limit = is_leaf_of_code(p, guard->limit) ? -1 : guard->limit;
    return pivot > limit ? pivot : limit;
}

static void note_operands(kt_code_printer *p, kt_op i, int part);

/* Notes what a part needs for the text of a node. */
static void note_reads(kt_code_printer *p, kt_op i, int part) {
    const kt_op_node *n = &p->graph->node[i];
    if (is_leaf_of_code(p, i)) {
        if (n->kind != KT_OP_CONSTANT)
            p->needs[part] |= 1 << (n->kind == KT_OP_INPUT ? n->a : CODE_PREPARED);
    } else if (p->width[i] == 0) {
        if (p->part[i] == part)
            return;
        if (p->place[i] < 0)
            p->place[i] = p->place_count++;
        p->needs[part] |= 1 << CODE_PLACES;
        p->needs[p->part[i]] |= 1 << CODE_PLACES;
    } else {
        note_operands(p, i, part);
    }
}

static void note_operands(kt_code_printer *p, kt_op i, int part) {
    kt_op operand[3];
    for (int k = kt_op_operands(&p->graph->node[i], operand) - 1; k >= 0; k--)
        note_reads(p, operand[k], part);
}

/* Divides a function into equal parts, and finds what each one needs. */
static void plan_parts(kt_code_printer *p, const kt_code_function *f) {
    const kt_graph *g = p->graph;
    int count = 0, before = 0;
    for (kt_op i = 0; i < g->count; i++) {
        count += is_statement(p, i);
        p->part[i] = 0;
        p->place[i] = -1;
    }
    p->at_part = p->place_count = 0;
    p->part_count = count > KT_CODE_LONG && p->origin == KT_OP_OF_STATE ? count / KT_CODE_PART : 1;
    if (p->part_count == 1)
        return;
    memset(p->needs, 0, (size_t)(p->part_count + 1) * sizeof *p->needs);
    for (kt_op i = 0; i < g->count; i++) {
        const int part = (int)((int64_t)before * p->part_count / count);
        p->part[i] = part < p->part_count ? part : p->part_count - 1;
        before += is_statement(p, i);
    }
    for (kt_op i = 0; i < g->count; i++)
        if (is_statement(p, i))
            note_operands(p, i, p->part[i]);
    for (int k = 0; k < f->guard_count; k++) {
        const kt_op at = node_of_guard(p, &f->guard[k]);
        const int part = at < 0 ? 0 : p->part[at];
        note_reads(p, f->guard[k].pivot, part);
        note_reads(p, f->guard[k].limit, part);
        p->needs[part] |= 1 << CODE_GUARDS;
    }
    for (int k = 0, first = 0, array = 0; k < f->out_count; k++) {
        const int own = is_leaf_of_code(p, f->out[k]) ? 0 : p->part[f->out[k]];
        const int part = f->writes_at_once ? own : p->part_count;
        while (k - first >= f->output[array])
            first += f->output[array++];
        note_reads(p, f->out[k], part);
        p->needs[part] |= 1 << (CODE_OUTPUT + array);
    }
}

/* ---- expressions ------------------------------------------------------------------------------------------------- */

static void print_operand(kt_code_printer *p, kt_op i, code_place place);

static void print_input(const kt_code_printer *p, const kt_op_node *n) {
    const char *const name[] = {"q", "v", p->arrays->given, "s", "c", "x"};
    if (n->a == KT_OP_TIME)
        fputs("t", p->file);
    else
        fprintf(p->file, "%s[%d]", name[n->a], (int)n->b);
}

static void print_leaf(kt_code_printer *p, kt_op i, code_place place) {
    const kt_op_node *n = &p->graph->node[i];
    if (n->kind == KT_OP_CONSTANT) {
        const bool bracket = n->value < 0.0 && place != CODE_SUM;
        fputs(bracket ? "(" : "", p->file);
        kt_code_print_number(p->file, n->value);
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

/* (real)f((double)a, (double)b) */
static void print_call(kt_code_printer *p, const kt_op_node *n) {
    kt_op operand[3];
    const int count = kt_op_operands(n, operand);
    fprintf(p->file, "(real)%s(", kt_op_function_name((kt_op_function)n->c));
    for (int k = 0; k < count; k++) {
        fputs(k > 0 ? ", (double)" : "(double)", p->file);
        print_operand(p, operand[k], CODE_PRODUCT_RIGHT);
    }
    fputs(")", p->file);
}

static void print_choice(kt_code_printer *p, const kt_op_node *n) {
    fputs("(", p->file);
    print_operand(p, n->a, CODE_SUM);
    fputs(" > 0 ? ", p->file);
    print_operand(p, n->b, CODE_SUM);
    fputs(" : ", p->file);
    print_operand(p, n->c, CODE_SUM);
    fputs(")", p->file);
}

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
    const bool swaps =
        inner != NULL && inner->kind == KT_OP_SUBTRACT && p->width[n->a] > 0 && !is_leaf_of_code(p, n->a);
    const bool is_sum = n->kind == KT_OP_ADD || n->kind == KT_OP_SUBTRACT || swaps;
    const bool is_product = n->kind == KT_OP_MULTIPLY || n->kind == KT_OP_DIVIDE;
    const bool bracket = is_sum       ? place != CODE_SUM
                         : is_product ? place == CODE_PRODUCT_RIGHT
                                      : place == CODE_SUM_RIGHT || place == CODE_PRODUCT_RIGHT;
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

static void print_operand(kt_code_printer *p, kt_op i, code_place place) {
    const kt_op_node *n = &p->graph->node[i];
    if (is_leaf_of_code(p, i))
        print_leaf(p, i, place);
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
    for (const char *at = p->graph->section[own]; *at != '\0'; at++)
        if (*at == '\n')
            fputs("\n     * ", p->file);
        else
            fputc(*at, p->file);
    fputs(" */\n", p->file);
}

/* Prints the guards whose numbers are there once node i is: both operands are leaves or at most i, and one is i. */
static void print_guards(kt_code_printer *p, const kt_code_function *f, kt_op i) {
    for (int k = 0; k < f->guard_count; k++) {
        const kt_code_guard *guard = &f->guard[k];
        if (node_of_guard(p, guard) != i)
            continue;
        fputs("    if (!(", p->file);
        print_operand(p, guard->pivot, CODE_SUM);
        fputs(guard->loop == 0 ? " > NO_INERTIA * "
              : guard->is_near ? " > NEAR_SINGULAR * "
                               : " > SINGULAR * ",
              p->file);
        print_operand(p, guard->limit, CODE_PRODUCT_RIGHT);
        fprintf(p->file, "))\n        return %d; /* %s */\n", guard->loop > 0 ? -guard->loop : guard->body,
                guard->loop > 0 ? kt_loop_name(p->tree->model, guard->loop - 1)
                                : kt_joint_name(p->tree->model, guard->body));
    }
}

enum { OUTPUTS_ALL = -2 };

/* Prints the assignment to output k. Equal ones, as in a symmetric matrix, are one statement: that of the first. */
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
    print_operand(p, out, CODE_SUM);
    fputs(";\n", p->file);
}

/* Prints the outputs of node i; -1: those that are leaves; OUTPUTS_ALL: all. */
static void print_outputs(kt_code_printer *p, const kt_code_function *f, kt_op i) {
    for (int k = 0, first = 0, array = 0; k < f->out_count; k++) {
        while (k - first >= f->output[array])
            first += f->output[array++];
        if (i == OUTPUTS_ALL || (i < 0 ? is_leaf_of_code(p, f->out[k]) : f->out[k] == i))
            print_output(p, f, k, first, array);
    }
}

/* Prints the statements of one part, with the outputs if it writes them at once. */
static void print_statements(kt_code_printer *p, const kt_code_function *f, int32_t *temporary) {
    const kt_graph *g = p->graph;
    const bool writes = p->part_count > 1 && f->writes_at_once;
    int32_t section = -1;
    if (p->at_part == 0)
        print_guards(p, f, -1);
    if (p->at_part == 0 && writes)
        print_outputs(p, f, -1);
    for (kt_op i = 0; i < g->count; i++) {
        if (p->uses[i] == 0 || p->part[i] != p->at_part || is_leaf_of_code(p, i))
            continue;
        if (p->width[i] == 0) {
            print_section(p, i, &section);
            p->temporary[i] = ++*temporary;
            fputs("    const real ", p->file);
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
        if (writes)
            print_outputs(p, f, i);
    }
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

static bool count_node_uses(kt_code_printer *p, const kt_code_function *f) {
    kt_op *root = malloc((size_t)(f->out_count + 2 * f->guard_count + 1) * sizeof *root);
    if (root == NULL)
        return false;
    kt_graph_uses(p->graph, root, list_roots(f, root), p->uses);
    free(root);
    return true;
}

bool kt_code_reads(kt_code_printer *p, const kt_code_function *f, kt_op_array array) {
    if (!count_node_uses(p, f))
        return false;
    for (kt_op i = 0; i < p->graph->count; i++)
        if (p->uses[i] > 0 && p->graph->node[i].kind == KT_OP_INPUT && p->graph->node[i].a == (int32_t)array)
            return true;
    return false;
}

bool kt_code_calls(kt_code_printer *p, const kt_code_function *f) {
    if (!count_node_uses(p, f))
        return false;
    for (kt_op i = 0; i < p->graph->count; i++)
        if (p->uses[i] > 0 && p->graph->node[i].kind == KT_OP_CALL)
            return true;
    return false;
}

/* Finds the statements and parts of a function. Returns false if memory is insufficient. */
static bool plan_function(kt_code_printer *p, const kt_code_function *f, int origin, const kt_code_arrays *arrays) {
    p->origin = origin;
    p->arrays = arrays;
    if (!count_node_uses(p, f))
        return false;
    lay_out(p, f);
    plan_parts(p, f);
    return true;
}

/* Prints the arguments of a part, as its declaration or a call has them. */
static void print_arguments(const kt_code_printer *p, int part, bool declares) {
    const kt_code_arrays *a = p->arrays;
    const char *const name[CODE_ARGUMENTS] = {"q", "v", a->given,     "s",          "c",          "x",
                                              "t", "k", a->output[0], a->output[1], a->output[2], "w"};
    bool is_next = false;
    for (int k = 0; k < CODE_ARGUMENTS; k++) {
        if (!(p->needs[part] & 1 << k))
            continue;
        fprintf(p->file, "%s%s%s", is_next ? ", " : "",
                !declares         ? ""
                : k == KT_OP_TIME ? "real "
                : k < CODE_OUTPUT ? "const real *restrict "
                                  : "real *restrict ",
                name[k]);
        is_next = true;
    }
    fputs(")", p->file);
}

void kt_code_print_parts(kt_code_printer *p, const kt_code_function *f, const kt_code_arrays *arrays,
                         const char *name) {
    int32_t temporary = 0;
    if (!plan_function(p, f, KT_OP_OF_STATE, arrays) || p->part_count == 1)
        return;
    p->has_parts = true;
    for (p->at_part = 0; p->at_part < p->part_count; p->at_part++) {
        const bool has_guards = p->needs[p->at_part] & 1 << CODE_GUARDS;
        fprintf(p->file, "/* Part %d of %d. */\nPART static %s %s_%d(", p->at_part + 1, p->part_count,
                has_guards ? "int" : "void", name, p->at_part + 1);
        print_arguments(p, p->at_part, true);
        fputs(" {\n", p->file);
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

void kt_code_print_function(kt_code_printer *p, const kt_code_function *f, const kt_code_arrays *arrays,
                            const char *name) {
    int32_t temporary = 0;
    if (!plan_function(p, f, KT_OP_OF_STATE, arrays))
        return;
    if (p->part_count > 1)
        print_calls(p, f, name);
    else
        print_statements(p, f, &temporary);
    fputs("\n", p->file);
    if (p->part_count == 1 || !f->writes_at_once)
        print_outputs(p, f, OUTPUTS_ALL);
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
