/* Whether the formula of an event can change its sign at all.
 *
 * An event is a change of sign (simulation/event.c): from above zero to below, or back. A formula whose values all are
 * on one side never has one. Examples are `a == b` (0 or 1), `abs(x)`, `x^2 + 1`, `max(x, 0)`, and a comparison of
 * constants. The range of a formula follows from interval arithmetic, with every variable anywhere in [-1e30, 1e30].
 * Parameters count as variables: their values are those of one run, and another run may have others.
 */
#include "scene/event.h"

#include "expression/expression.h"
#include "expression/jet.h"
#include "scene/expression.h"
#include "scene/named.h"
#include "scene/reader.h"

#include <string.h>

/* Variables are within this; bounds are widened by less than `rounding` if they are zero. */
static const double reach = 1e30, rounding = 1e-200;

/* All variables are one symbol, since they have the same interval. Their names have been checked. */
typedef struct variables {
    const kt_reader *r;
    const kt_symbols *known;
    int count; /* of those that are no parameters */
} variables;

static bool find_any(void *user, const char *name, kt_symbol *symbol) {
    variables *v = user;
    kt_symbol any = {.index = 0};
    const bool is_variable = v->known->find(v->known->user, name, &any);
    *symbol = (kt_symbol){.index = 0};
    v->count += is_variable;
    return is_variable || kt_is_parameter(v->r, name);
}

static bool compares(kt_operator code) {
    return code == KT_OPERATOR_LESS || code == KT_OPERATOR_LESS_EQUAL || code == KT_OPERATOR_GREATER ||
           code == KT_OPERATOR_GREATER_EQUAL;
}

/* The position in its text of the equality at the top of a formula; -1: there is none. */
static int find_equality(const char *text, kt_operator code) {
    const char *at = strstr(text, code == KT_OPERATOR_EQUAL ? "==" : "!=");
    const char *more = at != NULL ? strpbrk(at + 2, "<>=!") : NULL;
    return at != NULL && more == NULL && strpbrk(text, "<>=!") == at ? (int)(at - text) : -1;
}

static void advise_equality(kt_phrase *to, const char *text, kt_operator code) {
    const int at = find_equality(text, code);
    kt_phrase_add(to,
                  "%s is 1 or 0, which is no change of sign, so that this never happens; write the difference of both "
                  "sides, which changes its sign where they are equal",
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
static void describe(kt_phrase *to, const char *text, kt_operator last, kt_interval range, int variable_count) {
    const kt_name_text quoted = kt_name_quote(text);
    if (variable_count == 0) {
        kt_phrase_add(to,
                      "%s has no variable and never changes, so that this never happens; compare t, position.JOINT, "
                      "velocity.JOINT or a marker with a number",
                      quoted.text);
    } else if (last == KT_OPERATOR_EQUAL || last == KT_OPERATOR_NOT_EQUAL) {
        advise_equality(to, text, last);
    } else if (compares(last)) {
        kt_phrase_add(to,
                      "the sides of %s never change places in any motion, so that the condition never becomes true; "
                      "compare with a value that the left side passes",
                      quoted.text);
    } else {
        const bool is_above = range.lo >= -rounding;
        kt_phrase_add(to,
                      "%s is never %s zero, and only a change of sign is an event, so that this never happens; compare "
                      "it with the value that it has to pass, as in \"%.80s %s\"",
                      quoted.text, is_above ? "below" : "above", text, is_above ? "> 0.5" : "< -0.5");
    }
}

bool kt_check_crossing(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_symbols *known) {
    kt_written written;
    if (!kt_write_out(r, scope, node, known, &written))
        return false;
    const char *text = written.text;
    const size_t size = kt_expression_size(text);
    variables found = {.r = r, .known = known};
    const kt_symbols symbols = {.find = find_any, .user = &found};
    kt_expression *expression = kt_pool_take(&r->scratch, size, 1);
    const kt_expression *parsed = NULL;
    if (expression == NULL)
        return kt_reader_out_of_memory(r);
    if (kt_expression_parse(text, &symbols, expression, size, &parsed, NULL, NULL) != KT_OK || parsed->count == 0)
        return true;
    kt_expression_term *last = &expression->term[expression->count - 1];
    const kt_operator code = (kt_operator)last->code;
    if (compares(code))
        last->code = KT_OPERATOR_SUBTRACT;
    const kt_interval range = kt_expression_bound(parsed, -reach, reach, NULL, NULL).c[0];
    if (found.count > 0 && range.lo < -rounding && range.hi > rounding)
        return true;
    kt_phrase what = {.length = 0};
    describe(&what, text, code, range, found.count);
    return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s", what.text);
}
