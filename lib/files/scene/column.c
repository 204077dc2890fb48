/* Own columns of the records: formulas over all quantities that a record may have.
 *
 *     output: {columns: {range: "marker.ball.centre.x", power: {value: "effect.motor.torque*velocity.rotor", unit: W}}}
 *
 * The set of columns depends on the compiled model. The reader checks only the beginning of a name, and the writer of
 * the records binds it.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/named.h"
#include "scene/scene_expression.h"
#include "scene/scene_part.h"

#include <stddef.h>
#include <string.h>

/* Columns that are no variables of a description. */
static bool is_recorded(const char *name) {
    static const char *const kinds[] = {
        "acceleration.",        "effect.",  "energy.",  "momentum.", "orientation.", "reaction.",
        "constraint.",          "closure.", "bearing.", "marker.",   "effect[",      "angular_velocity.",
        "angular_acceleration."};
    for (size_t i = 0; i < KT_COUNT_OF(kinds); i++)
        if (strncmp(name, kinds[i], strlen(kinds[i])) == 0)
            return true;
    return false;
}

static bool find_column_symbol(void *user, const char *name, kt_symbol *symbol) {
    const kt_reader *r = user;
    kt_variable variable;
    *symbol = (kt_symbol){.index = 0};
    return kt_variable_find(r->scene->description, name, &variable) || is_recorded(name);
}

static const char *list_column_symbol(void *user, int k) {
    kt_reader *r = user;
    kt_variable variable;
    r->effort -= 1000;
    return r->effort > 0 && kt_variable_at(r->scene->description, k, &variable) ? kt_variable_text(r, &variable) : NULL;
}

/* A unit goes into the first line of CSV files, in square brackets. */
static bool is_unit_text(const kt_node *node) {
    bool fine = node->kind == KT_NODE_TEXT && node->count > 0 && node->count <= 24;
    for (size_t i = 0; fine && i < node->count; i++)
        fine = (unsigned char)node->of.text[i] >= ' ' && strchr("[],\"", node->of.text[i]) == NULL;
    return fine;
}

/* {value: FORMULA, unit: TEXT}: the node of the formula; NULL after a fault. */
static kt_node *read_column_unit(kt_reader *r, const kt_scope *here, kt_node *node, kt_scene_column *column) {
    kt_node *formula = NULL;
    for (kt_node *key = node->of.first; key != NULL; key = key->next->next) {
        const bool is_text = key->kind == KT_NODE_TEXT;
        if (is_text && strcmp(key->of.text, "value") == 0) {
            formula = key->next;
        } else if (!is_text || strcmp(key->of.text, "unit") != 0) {
            (void)kt_fault_at(r, KT_ERROR_SCENE, here, key,
                              "a column has a 'value', a formula, and a 'unit', no other key");
            return NULL;
        } else if (!is_unit_text(key->next)) {
            (void)kt_fault_expected(r, here, key->next,
                                    "a unit: up to 24 letters without brackets, commas and quotes ('m/s')");
            return NULL;
        } else {
            column->unit = kt_reader_text(r, &r->keep, key->next->of.text, key->next->count);
        }
    }
    if (formula == NULL)
        (void)kt_fault_expected(r, here, node, "a formula (\"2*velocity.arm\"), or {value: FORMULA, unit: m}");
    return formula;
}

static void read_column(kt_reader *r, const kt_scope *outer, kt_node *key, kt_scene_column *column) {
    const kt_symbols symbols = {.find = find_column_symbol, .list = list_column_symbol, .user = r};
    if (key->kind != KT_NODE_TEXT) {
        (void)kt_fault_expected(r, outer, key, "the name of a column");
        return;
    }
    const kt_scope here = {.outer = outer, .key = key->of.text};
    kt_node *formula = key->next->kind == KT_NODE_MAP ? read_column_unit(r, &here, key->next, column) : key->next;
    if (strcmp(key->of.text, "time") == 0)
        (void)kt_fault_at(r, KT_ERROR_SCENE, outer, key, "there is a column 'time' already; take another name");
    else if (!kt_name_is_valid(key->of.text))
        (void)kt_fault_at(r, KT_ERROR_SCENE, outer, key,
                          "%s is no name of a column; begin with a letter or _, go on with letters, digits, _ and -",
                          kt_name_quote(key->of.text).text);
    else if (formula != NULL && (formula->kind != KT_NODE_TEXT || formula->count == 0))
        (void)kt_fault_expected(r, &here, formula, "a formula (\"2*velocity.arm\")");
    else if (formula != NULL && kt_variables_are_known(r))
        (void)kt_read_formula(r, &here, formula, &symbols, true, &column->formula);
    column->name = kt_reader_text(r, &r->keep, key->of.text, key->count);
}

/* Names are compared with each other. */
enum { COLUMN_COUNT_MAX = 1000 };

/* A fault of one column does not end the section, so that all faults are reported. */
static bool read_columns(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)field;
    kt_scene *scene = object;
    if (node->kind != KT_NODE_MAP)
        return kt_fault_expected(r, scope, node, "names and formulas ('power: \"...\"')");
    if (node->count > COLUMN_COUNT_MAX)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "there are %u columns; a scene has at most %d",
                           (unsigned)node->count, (int)COLUMN_COUNT_MAX);
    kt_scene_column *columns = kt_pool_take(&r->keep, (size_t)node->count + 1, sizeof *columns);
    if (columns == NULL)
        return kt_reader_out_of_memory(r);
    int count = 0;
    for (kt_node *key = node->of.first; key != NULL; key = key->next->next) {
        for (int i = 0; i < count; i++)
            if (key->kind == KT_NODE_TEXT && columns[i].name != NULL && strcmp(columns[i].name, key->of.text) == 0)
                (void)kt_fault_at(r, KT_ERROR_SCENE, scope, key, "there is a column of this name already");
        read_column(r, scope, key, &columns[count++]);
    }
    scene->columns = columns;
    scene->column_count = count;
    return !kt_node_is_faulty(node);
}

static void write_scene_columns(kt_emitter *e, const kt_member *m) {
    const kt_scene *scene = m->object;
    kt_emit_map(e, KT_EMIT_FLOW);
    for (int i = 0; i < scene->column_count; i++) {
        kt_emit_key(e, scene->columns[i].name);
        if (scene->columns[i].unit == NULL) {
            kt_emit_text(e, scene->columns[i].formula);
            continue;
        }
        kt_emit_map(e, KT_EMIT_FLOW);
        kt_emit_key(e, "value");
        kt_emit_text(e, scene->columns[i].formula);
        kt_emit_key(e, "unit");
        kt_emit_text(e, scene->columns[i].unit);
        kt_emit_end(e);
    }
    kt_emit_end(e);
}

const kt_kind kt_kind_columns = {.read = read_columns, .write = write_scene_columns, .size = sizeof(int)};

/* ---- expressions that nothing uses ------------------------------------------------------------------------------- */

static bool find_anywhere(void *user, const char *name, kt_symbol *symbol) {
    *symbol = (kt_symbol){.index = 0};
    return strcmp(name, "length") == 0 || strcmp(name, "speed") == 0 || find_column_symbol(user, name, symbol);
}

/* Other expressions are checked where a formula uses them. */
static void check_unused_expressions(kt_reader *r) {
    const kt_scope outer = {.key = "expressions"};
    const kt_symbols symbols = {.find = find_anywhere, .list = list_column_symbol, .user = r};
    const kt_node *key;
    const char *text;
    for (int k = 0; kt_names_are_known(r) && (key = kt_expression_unused(r, k)) != NULL; k++) {
        const kt_scope here = {.outer = &outer, .key = key->of.text};
        kt_node inner = *key->next;
        if (kt_node_is_faulty(&inner))
            continue;
        if (kt_is_expression(&inner)) {
            inner.of.text++;
            inner.column++;
        }
        (void)kt_read_formula(r, &here, &inner, &symbols, true, &text);
    }
}

/* Expressions that nothing uses are read for their faults. They are no uses of parameters or
 * tables. */
void kt_expressions_check(kt_reader *r) {
    const size_t count = (size_t)r->scene->parameter_count;
    kt_named_number *before = kt_reader_take(r, &r->scratch, count + 1, sizeof *before);
    const size_t tables = (size_t)r->scene->description->table_count;
    bool *used_before = kt_reader_take(r, &r->scratch, tables + 1, sizeof *used_before);
    if (before == NULL || used_before == NULL)
        return;
    if (count > 0)
        memcpy(before, r->scene->parameters, count * sizeof *before);
    if (tables > 0)
        memcpy(used_before, r->scene->table_is_used, tables * sizeof *used_before);
    check_unused_expressions(r);
    if (tables > 0)
        memcpy(r->scene->table_is_used, used_before, tables * sizeof *used_before);
    for (size_t k = 0; k < count; k++) {
        r->scene->parameters[k].is_used = before[k].is_used;
        r->scene->parameters[k].hidden_line = before[k].hidden_line;
    }
}
