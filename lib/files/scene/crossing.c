/* Whether the formula of an event can change its sign at all.
 *
 * An event is a change of sign (simulation/event.c): from above zero to below, or back. A formula whose values all are
 * on one side never has one. Examples are `a == b` (0 or 1), `abs(x)`, `x^2 + 1`, `max(x, 0)`, and a comparison of
 * constants. The range of a formula follows from interval arithmetic, with every variable anywhere in [-1e30, 1e30].
 * Parameters count as variables: their values are those of one run, and another run may have others.
 *
 * Intervals forget that two values are the same. Equal operands are therefore replaced first: x*x by x^2, x*y*x by
 * x^2*y, x - x by 0 and x/x by 1. Zeros that follow from other identities, such as (x + 1)^2 - x^2 - 2*x - 1, are not
 * found: deciding whether an expression is zero is undecidable for formulas with sin. A run names such events at its
 * end.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/scene_event.h"

#include "base/decimal.h"
#include "expression/expression.h"
#include "expression/jet.h"
#include "expression/margin.h"
#include "scene/named.h"
#include "scene/scene_expression.h"
#include "scene/scene_reader.h"

#include <string.h>

/* Variables are within this; bounds are widened by less than `rounding` if they are zero. */
static const double reach = 1e30, rounding = 1e-200;

/* Each name is a symbol of its own. All of them are numbers in the same interval. */
typedef struct variables {
    kt_reader *r;
    const kt_symbols *known;
    const char **names;
    int name_count;
    int count;      /* of those that are no parameters */
    int kept_count; /* of these, the states with the rate 0 */
} variables;

/* Whether a name is an auxiliary state with the rate 0. Only events change it, and not in the motion. */
static bool is_kept(const kt_reader *r, const char *name) {
    const kt_description *d = r->scene->description;
    for (int k = 0; k < d->state_count; k++)
        if (strcmp(d->states[k].name, name) == 0) {
            double rate;
            const char *end;
            return d->states[k].rate != NULL && kt_decimal_read(d->states[k].rate, &rate, &end) && rate == 0.0 &&
                   *end == '\0';
        }
    return false;
}

/* Accepts the names of variables and of parameters, gives each name its number, and counts the variables. */
static bool find_any(void *user, const char *name, kt_symbol *symbol) {
    variables *v = user;
    kt_symbol any = {.index = 0};
    const bool is_variable = v->known->find(v->known->user, name, &any);
    int k = 0;
    while (k < v->name_count && strcmp(v->names[k], name) != 0)
        k++;
    *symbol = (kt_symbol){.index = k};
    v->count += is_variable;
    v->kept_count += is_variable && is_kept(v->r, name);
    if (k == v->name_count && (v->names[v->name_count++] = kt_pool_text(&v->r->scratch, name, strlen(name))) == NULL)
        return false;
    return is_variable || kt_is_parameter(v->r, name);
}

/* ---- equal operands ---------------------------------------------------------------------------------------------- */

/* Terms of an operand, and its power: the terms of u in u^3, and 3. `after`: the term after it. */
typedef struct factor {
    size_t begin, end, after;
    double power; /* 0: there is no such operand */
} factor;

static factor factor_of(const kt_expression_term *term, size_t begin, size_t end) {
    const bool is_power =
        end - begin > 2 && term[end - 1].code == KT_OPERATOR_POWER && term[end - 2].code == KT_OPERATOR_NUMBER;
    return is_power ? (factor){begin, end - 2, end, term[end - 2].number} : (factor){begin, end, end, 1.0};
}

/* Whether two operands are the same terms, which need not be the same text. */
static bool are_same(const kt_expression_term *term, factor a, factor b) {
    bool same = a.end - a.begin == b.end - b.begin;
    for (size_t i = 0; same && i < a.end - a.begin; i++) {
        const kt_expression_term *x = &term[a.begin + i], *y = &term[b.begin + i];
        same =
            x->code == y->code && (x->code != KT_OPERATOR_NUMBER || x->number == y->number) &&
            ((x->code != KT_OPERATOR_SYMBOL && !kt_operator_is_lookup((kt_operator)x->code)) || x->symbol == y->symbol);
    }
    return same;
}

/* The factor of a product u1 u2 ... that is equal to b but for its power. */
static factor find_factor(const kt_expression_term *term, size_t begin, size_t end, factor b) {
    for (;;) {
        const factor all = factor_of(term, begin, end);
        if (are_same(term, all, b))
            return all;
        if (term[end - 1].code != KT_OPERATOR_MULTIPLY)
            return (factor){.power = 0.0};
        const size_t last = kt_expression_operand(term, end - 1);
        const factor a = factor_of(term, last, end - 1);
        if (are_same(term, a, b))
            return a;
        end = last;
    }
}

static kt_expression_term number_term(double number) {
    return (kt_expression_term){.number = number, .code = KT_OPERATOR_NUMBER};
}

/* Replaces the operator of the last two operands, if these are equal or have an equal factor. Returns the number of
 * terms; `end` if not. */
static size_t merge_operator(kt_expression_term *term, size_t first, size_t second, size_t end, kt_operator code) {
    const factor b = factor_of(term, second, end - 1);
    const bool same = are_same(term, (factor){first, second, second, 1.0}, (factor){second, end - 1, end - 1, 1.0});
    if (same && (code == KT_OPERATOR_SUBTRACT || code == KT_OPERATOR_DIVIDE)) {
        term[first] = number_term(code == KT_OPERATOR_DIVIDE);
        return first + 1;
    }
    const factor a = code == KT_OPERATOR_MULTIPLY ? find_factor(term, first, second, b) : (factor){.power = 0.0};
    if (a.power == 0.0)
        return end;
    memmove(&term[a.end + 2], &term[a.after], (second - a.after) * sizeof *term);
    term[a.end] = number_term(a.power + b.power);
    term[a.end + 1] = (kt_expression_term){.code = KT_OPERATOR_POWER};
    return a.end + 2 + (second - a.after);
}

/* Walks over the terms as the evaluation does; `begin` is the stack of the first terms of all operands. */
static void merge_equal_operands(kt_expression *expression) {
    size_t begin[KT_EXPRESSION_DEPTH_MAX], end = 0;
    int top = -1;
    for (size_t i = 0; i < expression->count; i++) {
        const kt_operator code = (kt_operator)expression->term[i].code;
        expression->term[end++] = expression->term[i];
        if (kt_operator_is_leaf(code))
            begin[++top] = end - 1;
        else if (kt_operator_is_binary(code)) {
            top--;
            end = merge_operator(expression->term, begin[top], begin[top + 1], end, code);
        }
    }
    expression->count = end;
    for (size_t i = 0; i < end; i++)
        expression->term[i].symbol = 0; /* in the same interval */
}

/* ---- messages ---------------------------------------------------------------------------------------------------- */

/* The position in its text of the equality at the top of a formula; -1: there is none. */
static int find_equality(const char *text, kt_operator code) {
    const char *at = strstr(text, code == KT_OPERATOR_EQUAL ? "==" : "!=");
    const char *more = at != NULL ? strpbrk(at + 2, "<>=!") : NULL;
    return at != NULL && more == NULL && strpbrk(text, "<>=!") == at ? (int)(at - text) : -1;
}

static void advise_equality(kt_phrase *to, const char *text, kt_operator code) {
    const int at = find_equality(text, code);
    kt_phrase_add(to,
                  "%s is 1 or 0 and never changes its sign, so the event never happens; write the difference of both "
                  "sides, which is zero when they are equal",
                  kt_name_quote(text).text);
    if (at < 0)
        return;
    int left = at, right = at + 2;
    while (left > 0 && text[left - 1] == ' ')
        left--;
    while (text[right] == ' ')
        right++;
    if (strcmp(text + right, "0") == 0)
        kt_phrase_add(to, ": \"%.*s\"", left, text);
    else
        kt_phrase_add(to, ": \"%.*s - (%s)\"", left, text, text + right);
}

/* Describes why the values of a formula are on one side. */
static void describe_side(kt_phrase *to, const char *text, kt_operator last, bool compares, kt_between range,
                          const variables *found) {
    const kt_name_text quoted = kt_name_quote(text);
    if (found->count == 0) {
        kt_phrase_add(to,
                      "%s has no variable and never changes, so the event never happens; compare t, position.JOINT, "
                      "velocity.JOINT or a marker with a number",
                      quoted.text);
    } else if (compares) {
        kt_phrase_add(to,
                      "the sides of %s never change places in any motion, so that the condition never becomes true; "
                      "compare with a value that the left side passes",
                      quoted.text);
    } else if (last == KT_OPERATOR_EQUAL || last == KT_OPERATOR_NOT_EQUAL) {
        advise_equality(to, text, last);
    } else if (range.lo == range.hi) {
        kt_phrase_add(to, "%s is always %.9g, so the event never happens; compare a value that changes with a number",
                      quoted.text, range.lo);
    } else {
        const bool is_above = range.lo >= -rounding;
        kt_phrase_add(to,
                      "%s is never %s zero, and only a change of sign is an event, so the event never happens; compare "
                      "it with a value that it passes, as in \"%.80s %s\"",
                      quoted.text, is_above ? "below" : "above", text, is_above ? "> 0.5" : "< -0.5");
    }
}

bool kt_check_crossing(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_symbols *known) {
    kt_written written;
    if (!kt_write_out(r, scope, node, known, &written))
        return false;
    const char *text = written.text;
    const size_t size = kt_expression_size(text);
    variables found = {
        .r = r, .known = known, .names = kt_pool_take(&r->scratch, strlen(text) + 1, sizeof *found.names)};
    const kt_symbols symbols = {.find = find_any,
                                .user = &found,
                                .tables = r->scene->description->tables,
                                .table_count = r->scene->description->table_count};
    kt_expression *expression = kt_pool_take(&r->scratch, size, 1), *margin = kt_pool_take(&r->scratch, size, 1);
    const kt_expression *parsed = NULL;
    if (expression == NULL || margin == NULL || found.names == NULL)
        return kt_reader_out_of_memory(r);
    if (kt_expression_parse(text, &symbols, expression, size, &parsed, NULL, NULL) != KT_OK || parsed->count == 0)
        return true;
    const kt_operator code = (kt_operator)expression->term[expression->count - 1].code;
    const bool compares = kt_expression_margin(parsed, margin);
    expression = compares ? margin : expression;
    merge_equal_operands(expression);
    const kt_between range = kt_expression_bound(expression, -reach, reach, NULL, NULL).c[0];
    const bool crosses = found.count > 0 && range.lo < -rounding && range.hi > rounding;
    if (crosses && found.kept_count < found.count)
        return true;
    kt_phrase what = {.length = 0};
    if (crosses)
        kt_phrase_add(&what,
                      "%s changes only where events set its values, and that is no change of sign in the motion, "
                      "so the event never happens; use them next to t, position.JOINT, velocity.JOINT or a marker",
                      kt_name_quote(text).text);
    else
        describe_side(&what, text, code, compares, range, &found);
    return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s", what.text);
}
