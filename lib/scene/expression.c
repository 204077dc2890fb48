/* Expressions of parameters where a scene has a number. */
#include "scene/expression.h"

#include <math.h>
#include <string.h>

/* ---- names ------------------------------------------------------------------------------------------------------- */

static bool find_parameter(void *user, const char *name, kt_symbol *symbol) {
    kt_reader *r = user;
    const int k = r->parameter_count > 0 ? kt_names_find(&r->parameter_names, 0, name) : -1;
    if (k < 0)
        return false;
    r->parameters[k].is_used = true;
    *symbol = (kt_symbol){.index = k, .is_angle = r->parameters[k].is_angle};
    return true;
}

/* No name is suggested once the effort for suggestions is used up. */
static const char *list_parameter(void *user, int k) {
    kt_reader *r = user;
    r->effort -= 100;
    return k < r->parameter_count && r->effort > 0 ? r->parameters[k].name : NULL;
}

bool kt_is_parameter(const kt_reader *r, const char *name) {
    return r->parameter_count > 0 && kt_names_find(&r->parameter_names, 0, name) >= 0;
}

bool kt_is_expression(const kt_node *node) { return node->kind == KT_NODE_TEXT && node->of.text[0] == '='; }

/* The place within an expression: `column` from 1, in bytes, of the text after '='. Texts over several lines have only a
 * beginning. */
static kt_node spot_of(const kt_node *node, int column) {
    kt_node spot = *node;
    const char *text = node->of.text;
    if (strchr(text, '\n') != NULL)
        return spot;
    spot.column += node->plain ? 0 : 1;
    for (int i = 0; i < column && text[i] != '\0'; i++)
        spot.column += ((unsigned char)text[i] & 0xC0U) != 0x80U;
    return spot;
}

const kt_expression *kt_expression_of_node(kt_reader *r, const kt_scope *scope, kt_node *node) {
    const kt_symbols symbols = {.find = find_parameter, .list = list_parameter, .user = r};
    const char *text = node->of.text + 1;
    const size_t size = kt_expression_size(text);
    const kt_expression *expression = NULL;
    void *memory = kt_pool_take(&r->scratch, size, 1);
    int column = 0;
    kt_error error = {0};
    if (memory == NULL) {
        (void)kt_reader_out_of_memory(r);
        return NULL;
    }
    if (kt_expression_parse(text, &symbols, memory, size, &expression, &column, &error) == KT_OK)
        return expression;
    kt_node spot = spot_of(node, column);
    (void)kt_fault_at(r, KT_ERROR_SCENE, scope, &spot, "%s", error.message);
    node->faulty = true;
    return NULL;
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

bool kt_expression_value(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_expression *expression,
                         double *out) {
    const double value = kt_expression_evaluate(expression, r->parameter_values);
    if (isnan(value))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                           "%s has no value: 0/0, a root or logarithm of a negative number, or the like",
                           kt_name_quote(node->of.text).text);
    if (!isfinite(value))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s is not finite: it divides by zero, or is too large",
                           kt_name_quote(node->of.text).text);
    *out = value;
    return true;
}

/* Whether every parameter that an expression uses has a value; if not, that has been reported. */
static bool is_computable(const kt_reader *r, const kt_expression *expression) {
    int used[KT_EXPRESSION_LENGTH_MAX];
    const size_t count = kt_expression_symbols(expression, KT_EXPRESSION_LENGTH_MAX, used);
    for (size_t i = 0; i < count; i++)
        if (!r->parameters[used[i]].is_known)
            return false;
    return true;
}

bool kt_read_expression(kt_reader *r, const kt_scope *scope, kt_node *node, bool angle, double *out) {
    const bool hidden = node->faulty || r->parameters_are_hidden;
    const kt_expression *expression = hidden ? NULL : kt_expression_of_node(r, scope, node);
    if (expression == NULL || !is_computable(r, expression)) {
        node->faulty = true; /* a fault of the parameter has been reported */
        return false;
    }
    if (kt_expression_is_angle(expression) && !angle)
        return kt_fault_at(
            r, KT_ERROR_SCENE, scope, node,
            "expected a number, found the angle %s; divide by 1 rad where its number in radians is meant",
            kt_name_quote(node->of.text).text);
    return kt_expression_value(r, scope, node, expression, out);
}
