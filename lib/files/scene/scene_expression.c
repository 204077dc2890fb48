/* Expressions of parameters where a scene has a number. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/scene_expression.h"

#include "document/number.h"
#include "expression/expression.h"
#include "model/function_formula.h"
#include "scene/named.h"
#include "scene/vary.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* The index of a parameter; -1: there is none of this name. */
static int find_parameter(const kt_reader *r, const char *name) {
    return r->scene->parameter_count > 0 ? kt_names_find(&r->scene->parameter_names, 0, name) : -1;
}

/* The formula has a variable of this name. A parameter of the same name is an auxiliary state if an event sets it, and
 * else it is hidden there. */
static void note_variable(kt_reader *r, const char *name, const kt_node *formula) {
    const int k = find_parameter(r, name);
    if (k < 0)
        return;
    kt_named_number *parameter = &r->scene->parameters[k];
    if (parameter->is_assigned) {
        parameter->is_used = true;
    } else if (parameter->hidden_line == 0) {
        parameter->hidden_line = formula->line;
        parameter->hidden_column = formula->column;
    }
}

static bool find_parameter_symbol(void *user, const char *name, kt_symbol *symbol) {
    kt_reader *r = user;
    const int k = find_parameter(r, name);
    if (k < 0)
        return false;
    r->scene->parameters[k].is_used = true;
    *symbol = (kt_symbol){.index = k, .is_angle = r->scene->parameters[k].is_angle};
    return true;
}

/* No name is suggested once the effort for suggestions is used up. */
static const char *list_parameter(void *user, int k) {
    kt_reader *r = user;
    r->effort -= 100;
    return k < r->scene->parameter_count && r->effort > 0 ? r->scene->parameters[k].name : NULL;
}

const char *kt_variable_text(kt_reader *r, const kt_variable *variable) {
    char text[KT_EXPRESSION_NAME_MAX + 1];
    (void)kt_variable_name(r->scene->description, variable, text, sizeof text);
    return kt_pool_text(&r->scratch, text, strlen(text));
}

bool kt_is_parameter(const kt_reader *r, const char *name) { return find_parameter(r, name) >= 0; }

bool kt_is_expression(const kt_node *node) { return node->kind == KT_NODE_TEXT && node->of.text[0] == '='; }

/* Accepts the time, and any name that has no meaning of its own in formulas. */
static bool find_any_name(void *user, const char *name, kt_symbol *symbol) {
    (void)user;
    *symbol = (kt_symbol){.index = 0};
    return !kt_is_reserved(name) || strcmp(name, "t") == 0;
}

/* Whether a fault of an expression may follow from names of the file that could not be read. */
static bool follows_from_names(kt_reader *r, const char *text, const kt_error *error) {
    const kt_symbols any = {.find = find_any_name};
    const kt_expression *expression = NULL;
    const size_t size = kt_expression_size(text);
    if (!r->scene->hides_parameters || strstr(error->message, "did you mean") != NULL)
        return false;
    void *memory = kt_pool_take(&r->scratch, size, 1);
    return memory != NULL && kt_expression_parse(text, &any, memory, size, &expression, NULL, NULL) == KT_OK;
}

/* Reads a text into memory that lasts as long as the reading; at a fault NULL, its place from 0, and the error. */
static const kt_expression *parse_text(kt_reader *r, const char *text, const kt_symbols *symbols, int *at,
                                       kt_error *error) {
    const size_t size = kt_expression_size(text);
    const kt_expression *expression = NULL;
    void *memory = kt_reader_take(r, &r->scratch, size, 1);
    int column = 0;
    if (memory != NULL && kt_expression_parse(text, symbols, memory, size, &expression, &column, error) == KT_OK)
        return expression;
    *at = column - 1;
    return NULL;
}

/* Reads the text of a node behind its '='. */
static const kt_expression *parse_node(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_symbols *symbols) {
    int at = 0;
    kt_error error = {0};
    const kt_expression *expression = parse_text(r, node->of.text + 1, symbols, &at, &error);
    if (expression != NULL || r->out_of_memory)
        return expression;
    node->faulty = node->faulty || follows_from_names(r, node->of.text + 1, &error);
    kt_node spot = kt_spot_of(node, 1 + at);
    (void)kt_fault_at(r, KT_ERROR_SCENE, scope, &spot, "%s", error.message);
    node->faulty = true;
    return NULL;
}

const kt_expression *kt_expression_of_node(kt_reader *r, const kt_scope *scope, kt_node *node) {
    const kt_symbols symbols = {.find = find_parameter_symbol, .list = list_parameter, .user = r};
    const int named = kt_find_named(r, node->of.text);
    if (named < 0)
        return parse_node(r, scope, node, &symbols);
    kt_node spot = kt_spot_of(node, named);
    (void)kt_fault_at(r, KT_ERROR_SCENE, scope, &spot,
                      "'%.*s' is a formula of `expressions`, which may change during a run, but a number is expected "
                      "here; compute the number from parameters",
                      (int)strcspn(node->of.text + named, " +-*/^(),.=<>!"), node->of.text + named);
    node->faulty = true;
    return NULL;
}

bool kt_is_bare_expression(kt_reader *r, const char *text) {
    const kt_symbols symbols = {.find = find_parameter_symbol, .user = r};
    const kt_expression *expression = NULL;
    const size_t size = kt_expression_size(text);
    void *memory = text[0] != '\0' && size > 0 ? kt_pool_take(&r->scratch, size, 1) : NULL;
    return memory != NULL && kt_expression_parse(text, &symbols, memory, size, &expression, NULL, NULL) == KT_OK;
}

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

/* The names of a formula: variables, then parameters. */
typedef struct kt_formula_names {
    kt_reader *r;
    const kt_symbols *variables;
    const kt_node *node; /* the formula */
    bool waits;          /* a parameter has no value: that has been reported */
    bool varies;         /* a parameter depends on a variable */
    bool is_assigned;    /* or on one that an event sets, where there are no auxiliary states */
} kt_formula_names;

/* A variable, or a parameter whose value is folded. Notes whether the parameter is known yet (waits), varies, or is
 * assigned by an event. */
static bool find_either(void *user, const char *name, kt_symbol *symbol) {
    kt_formula_names *names = user;
    if (names->variables->find(names->variables->user, name, symbol)) {
        note_variable(names->r, name, names->node);
        return true;
    }
    if (!find_parameter_symbol(names->r, name, symbol))
        return false;
    const kt_named_number *parameter = &names->r->scene->parameters[symbol->index];
    names->waits = names->waits || !parameter->is_known;
    names->varies = names->varies || parameter->varies;
    names->is_assigned = names->is_assigned || parameter->is_assigned;
    symbol->is_fixed = true;
    symbol->number = parameter->value;
    return true;
}

static const char *list_either(void *user, int k) {
    kt_formula_names *names = user;
    const int parameters = names->r->scene->parameter_count, named = names->r->scene->named_count;
    if (k < parameters) /* NULL if the effort is used up */
        return list_parameter(names->r, k);
    return k < parameters + named ? kt_expression_name(names->r, k - parameters)
                                  : names->variables->list(names->variables->user, k - parameters - named);
}

/* "(-0.5)", "(0.25 rad)" in place of a parameter: returns the length. */
static size_t put_parameter(const kt_reader *r, const char *name, size_t length, double value, char *to, size_t room) {
    bool is_angle = false;
    for (int k = 0; k < r->scene->parameter_count; k++)
        if (strlen(r->scene->parameters[k].name) == length && strncmp(r->scene->parameters[k].name, name, length) == 0)
            is_angle = r->scene->parameters[k].is_angle;
    char number[KT_NUMBER_SIZE];
    kt_number_format(number, value);
    return (size_t)snprintf(to, room, "(%s%s)", number, is_angle ? " rad" : "");
}

/* The text of a formula with numbers in place of parameters. NULL if it is too long then. */
static const char *fill_in(kt_reader *r, const char *text, const kt_expression *expression) {
    char filled[KT_EXPRESSION_LENGTH_MAX + 1];
    size_t length = 0, from = 0, to = 0;
    for (size_t i = 0; i <= expression->count; i++) {
        const kt_expression_term *term = &expression->term[i];
        if (i < expression->count && (term->code != KT_OPERATOR_NUMBER || term->symbol == 0))
            continue;
        to = i < expression->count ? (size_t)term->symbol - 1 : strlen(text);
        if (length + (to - from) + KT_NUMBER_SIZE + 8 > sizeof filled)
            return NULL;
        memcpy(filled + length, text + from, to - from);
        length += to - from;
        if (i == expression->count)
            break;
        const size_t name = strspn(text + to, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_");
        length += put_parameter(r, text + to, name, term->number, filled + length, sizeof filled - length);
        from = to + name;
    }
    return kt_reader_text(r, &r->keep, filled, length);
}

/* Whether an expression is of the quantity that is expected. Otherwise the function reports the fault. */
static bool is_expected(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_expression *expression,
                        bool angle) {
    if (angle || !kt_expression_is_angle(expression))
        return true;
    return kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                       "expected a number, found the angle %s; divide by 1 rad where its number in radians is meant",
                       kt_name_quote(node->of.text).text);
}

static bool names_motion(const char *text) {
    return strncmp(text, "position.", 9) == 0 || strncmp(text, "velocity.", 9) == 0;
}

static const char name_characters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.";

/* The lookup table with whose name a text begins; -1: there is none. */
static int find_named_table(const kt_reader *r, const char *text) {
    const kt_description *d = r->scene->description;
    const size_t length = strspn(text, name_characters);
    for (int k = 0; k < d->table_count; k++)
        if (strlen(d->tables[k].name) == length && strncmp(d->tables[k].name, text, length) == 0)
            return k;
    return -1;
}

/* Notes which tables a formula calls. */
static void note_used_tables(kt_reader *r, const char *text) {
    if (r->scene->description->table_count == 0)
        return;
    for (text += strcspn(text, name_characters); *text != '\0'; text += strcspn(text, name_characters)) {
        const int table = find_named_table(r, text);
        if (table >= 0)
            r->scene->table_is_used[table] = true;
        text += strspn(text, name_characters);
    }
}

/* Reads a formula whose expressions are written out; NULL after reporting a fault. */
static const kt_expression *parse_written(kt_reader *r, const kt_scope *scope, const kt_written *written,
                                          const kt_symbols *symbols, bool is_of_time) {
    int at = 0;
    kt_error error = {0};
    const kt_expression *expression = parse_text(r, written->text, symbols, &at, &error);
    if (expression == NULL && is_of_time && at >= 0 && names_motion(written->text + at))
        (void)kt_error_set(&error, KT_ERROR_SCENE, "",
                           "a function of time cannot use positions or velocities; for a force that depends on the "
                           "motion, use an effect of the type 'expression'");
    if (expression == NULL && is_of_time && at >= 0 && find_named_table(r, written->text + at) >= 0)
        (void)kt_error_set(
            &error, KT_ERROR_SCENE, "",
            "a function of time calls no lookup table; write {table: ROWS}, or use an effect of the type "
            "'expression'");
    if (expression == NULL && !r->out_of_memory && !follows_from_names(r, written->text, &error))
        (void)kt_written_fault(r, scope, written, at, error.message);
    return expression;
}

bool kt_read_formula(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_symbols *variables, bool angle,
                     const char **text) {
    kt_formula_names names = {.r = r, .variables = variables, .node = node};
    const bool is_of_time = variables->find == kt_time_symbols().find;
    const kt_description *description = r->scene->description;
    const kt_symbols symbols = {.find = find_either,
                                .list = list_either,
                                .user = &names,
                                .tables = description->tables,
                                .table_count = is_of_time ? 0 : description->table_count};
    const bool hidden = node->faulty || r->scene->parameters_are_hidden;
    kt_written written;
    const kt_expression *expression = NULL;
    if (!hidden && kt_write_out(r, scope, node, variables, &written))
        expression = parse_written(r, scope, &written, &symbols, is_of_time);
    if (expression == NULL || names.waits) {
        node->faulty = true;
        return false;
    }
    if (!is_expected(r, scope, node, expression, angle))
        return false;
    note_used_tables(r, written.text);
    const char *filled = fill_in(r, written.text, expression);
    if (filled == NULL)
        return r->out_of_memory ? false
                                : kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                                              "with numbers in place of parameters the formula has more than %d "
                                              "characters; compute a part of it as a parameter",
                                              KT_EXPRESSION_LENGTH_MAX);
    if (names.varies || names.is_assigned || kt_is_varied(r, node) || kt_written_varies(r, &written))
        kt_varying_note_fixed(r, node, names.is_assigned);
    *text = filled;
    return true;
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

bool kt_expression_value(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_expression *expression,
                         double *out) {
    const double value = kt_expression_evaluate(expression, r->scene->parameter_values);
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
        if (!r->scene->parameters[used[i]].is_known)
            return false;
    return true;
}

bool kt_read_expression(kt_reader *r, const kt_scope *scope, kt_node *node, bool angle, double *out) {
    const bool hidden = node->faulty || r->scene->parameters_are_hidden;
    const kt_expression *expression = hidden ? NULL : kt_expression_of_node(r, scope, node);
    if (expression == NULL || !is_computable(r, expression)) {
        node->faulty = true; /* a fault of the parameter has been reported */
        return false;
    }
    if (!is_expected(r, scope, node, expression, angle))
        return false;
    kt_varying_note(r, node, expression);
    return kt_expression_value(r, scope, node, expression, out);
}
