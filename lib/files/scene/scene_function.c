/* Functions of time: a number, a formula of t, {sine: ...}, {ramp: ...}, {bump: ...}, {polynomial: [...]},
 * {table: [...], interpolation: ...}, {sum: [...]} or {product: [...]}. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/decimal.h"
#include "document/number.h"
#include "model/function_formula.h"
#include "scene/csv.h"
#include "scene/scene_expression.h"
#include "scene/scene_part.h"

#include <stddef.h>
#include <string.h>

/* ---- values ------------------------------------------------------------------------------------------------------ */

/* The contents of a mapping: the function, and a file that it is to be read from. */
typedef struct form_read {
    kt_function function; /* the first member, because the other fields refer to this struct */
    kt_csv_choice choice;
    kt_node *file; /* NULL: none */
} form_read;

static bool read_polynomial_function(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field,
                                     void *object) {
    (void)field;
    kt_function *function = object;
    if (node->kind != KT_NODE_LIST || node->count == 0)
        return kt_fault_expected(r, scope, node, "a list of coefficients [c0, c1, ...]");
    double *numbers = kt_pool_take(&r->keep, node->count, sizeof *numbers);
    if (numbers == NULL)
        return kt_reader_out_of_memory(r);
    function->numbers = numbers;
    function->number_count = (int)node->count;
    bool good = true;
    kt_scope here = {.outer = scope};
    for (kt_node *item = node->of.first; item != NULL; item = item->next, here.index++) {
        kt_quantity quantity = here.index == 0 ? (kt_quantity)r->scene->quantity : KT_QUANTITY_NUMBER;
        good = kt_read_number(r, &here, item, quantity, &numbers[here.index]) && good;
    }
    return good;
}

/* A text is the name of a CSV file, which is read after the other keys, since these choose its columns. */
static bool read_function_table(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field,
                                void *object) {
    (void)field;
    kt_function *function = object;
    const kt_quantity quantities[] = {KT_QUANTITY_NUMBER, (kt_quantity)r->scene->quantity};
    double value;
    if (node->kind == KT_NODE_TEXT && node->count > 0 &&
        (!node->plain || kt_scalar_classify(node->of.text, &value) == KT_SCALAR_TEXT)) {
        ((form_read *)object)->file = node; /* read with the other keys */
        return true;
    }
    const bool good = kt_read_points(r, scope, node, 2, quantities,
                                     "a list of points [[t, y], [t, y], ...], or the name of a CSV file",
                                     &function->numbers, &function->number_count);
    function->number_count *= 2;
    return good;
}

/* Factors may have any units. */
static bool read_function_parts(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field,
                                void *object) {
    kt_function *function = object;
    const char *const unit = r->scene->unit;
    const kt_quantity quantity = (kt_quantity)r->scene->quantity;
    if (node->kind != KT_NODE_LIST || node->count == 0)
        return kt_fault_expected(r, scope, node, "a list of functions of time [f, g, ...]");
    kt_function *parts = kt_pool_take(&r->keep, node->count, sizeof *parts);
    if (parts == NULL)
        return kt_reader_out_of_memory(r);
    if (++r->scene->function_depth > KT_FUNCTION_DEPTH_MAX) {
        r->scene->function_depth--;
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "more than %d sums and products within one another",
                           KT_FUNCTION_DEPTH_MAX);
    }
    bool good = true;
    kt_scope here = {.outer = scope};
    r->scene->unit = strcmp(field->key, "product") == 0 ? NULL : unit;
    for (kt_node *item = node->of.first; item != NULL; item = item->next, here.index++)
        good = kt_read_function(r, &here, item, quantity, &parts[here.index]) && good;
    r->scene->unit = unit;
    r->scene->function_depth--;
    r->scene->quantity = (int)quantity;
    function->parts = parts;
    function->part_count = (int)node->count;
    return good;
}

/* Reads the slopes at both ends: changes of the value per second. Values in degrees (angles and their rates) have
 * slopes in degrees, too. KT_QUANTITY_RATE stands for this unit alone, also if the function is itself a rate. */
static bool read_slopes(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)field;
    kt_function *function = object;
    const bool turns = r->scene->quantity == KT_QUANTITY_ANGLE || r->scene->quantity == KT_QUANTITY_RATE;
    function->has_slopes =
        kt_read_numbers(r, scope, node, 2, turns ? KT_QUANTITY_RATE : KT_QUANTITY_NUMBER, NULL, function->slopes);
    return function->has_slopes;
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

static const char *const interpolation_names[] = {"linear", "cubic", "monotone"};
static const kt_choice interpolations = {"function.interpolation", interpolation_names, 3, 0, NULL};

static void write_polynomial(kt_emitter *e, const kt_member *m) {
    const kt_function *function = m->object;
    kt_emit_numbers(e, function->numbers, function->number_count);
}

/* The points, and the other keys of a table. */
static void write_function_table(kt_emitter *e, const kt_member *m) {
    const kt_function *function = m->object;
    kt_write_points(e, function->numbers, 2, function->number_count / 2);
    if (function->interpolation != KT_INTERPOLATION_LINEAR) {
        kt_emit_key(e, "interpolation");
        kt_emit_word(e, interpolation_names[function->interpolation]);
    }
    if (function->has_slopes) {
        kt_emit_key(e, "slopes");
        kt_emit_numbers(e, function->slopes, 2);
    }
}

static void write_function_parts(kt_emitter *e, const kt_member *m) {
    const kt_function *function = m->object;
    kt_emit_list(e, KT_EMIT_FLOW);
    for (int i = 0; i < function->part_count; i++)
        kt_write_function(e, &function->parts[i]);
    kt_emit_end(e);
}

static const kt_kind kind_polynomial = {.read = read_polynomial_function, .write = write_polynomial},
                     kind_table = {.read = read_function_table, .write = write_function_table},
                     kind_parts = {.read = read_function_parts, .write = write_function_parts},
                     kind_slopes = {.read = read_slopes};

/* ---- the forms --------------------------------------------------------------------------------------------------- */

static const kt_descriptor *describe_function(int type) { return kt_function_descriptor((kt_function_type)type); }
static const kt_table sine_table = KT_TYPE_TABLE(describe_function, KT_FUNCTION_SINE),
                      ramp_table = KT_TYPE_TABLE(describe_function, KT_FUNCTION_RAMP),
                      bump_table = KT_TYPE_TABLE(describe_function, KT_FUNCTION_BUMP);

enum { FORM_COUNT = 7 };
static const kt_field form_fields[] = {
    {.key = "sine", .kind = &kt_kind_map, .detail = &sine_table},
    {.key = "ramp", .kind = &kt_kind_map, .detail = &ramp_table},
    {.key = "polynomial", .kind = &kind_polynomial},
    {.key = "table", .kind = &kind_table},
    {.key = "bump", .kind = &kt_kind_map, .detail = &bump_table},
    {.key = "sum", .kind = &kind_parts},
    {.key = "product", .kind = &kind_parts},
    {.key = "interpolation",
     .kind = &kt_kind_choice,
     .offset = offsetof(kt_function, interpolation),
     .detail = &interpolations},
    {.key = "slopes", .kind = &kind_slopes},
    {.key = "time", .kind = &kt_kind_text, .offset = offsetof(form_read, choice.time)},
    {.key = "value", .kind = &kt_kind_text, .offset = offsetof(form_read, choice.value)},
    {.key = "unit", .kind = &kt_kind_text, .offset = offsetof(form_read, choice.unit)},
    {.key = "time_unit", .kind = &kt_kind_text, .offset = offsetof(form_read, choice.time_unit)},
};
static const int form_types[FORM_COUNT] = {KT_FUNCTION_SINE,   KT_FUNCTION_RAMP, KT_FUNCTION_POLYNOMIAL,
                                           KT_FUNCTION_TABLE,  KT_FUNCTION_BUMP, KT_FUNCTION_SUM,
                                           KT_FUNCTION_PRODUCT};
#define FORMS "sine, ramp, polynomial, table, bump, sum, product"
static const kt_forms forms = {.several = "functions",
                               .expected = "a function of time (a number, a formula of t, or one of " FORMS ")",
                               .missing = "the function is missing; give a number, a formula of t, or one of " FORMS,
                               .fields = form_fields,
                               .types = form_types,
                               .count = FORM_COUNT};
static const kt_table form_table = {.fields = form_fields, .count = KT_COUNT_OF(form_fields), .flow = true};

/* Keys of a table that has none of their kind, and the file of one that has. */
static void read_table_file(kt_reader *r, const kt_scope *scope, kt_node *node, form_read *form) {
    static const char *const keys[] = {"time", "value", "unit", "time_unit"};
    kt_node *slopes = kt_node_find(node, "slopes"), *interpolation = kt_node_find(node, "interpolation");
    if (interpolation != NULL && form->function.type != KT_FUNCTION_NONE && form->function.type != KT_FUNCTION_TABLE)
        kt_fault_at(r, KT_ERROR_SCENE, scope, interpolation, "only a table is interpolated; remove the key");
    for (int k = 0; form->file == NULL && k < KT_COUNT_OF(keys); k++)
        if (kt_node_find(node, keys[k]) != NULL)
            (void)kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, keys[k]),
                              "'%s' is of a column of a file; write {table: FILE.csv}, or remove the key", keys[k]);
    if (slopes != NULL &&
        (form->function.type != KT_FUNCTION_TABLE || form->function.interpolation != KT_INTERPOLATION_CUBIC))
        (void)kt_fault_at(r, KT_ERROR_SCENE, scope, slopes,
                          "slopes at the ends are those of a table with `interpolation: cubic`; write that, or remove "
                          "the key");
    if (form->file != NULL && !kt_node_is_faulty(node))
        (void)kt_read_csv(r, scope, form->file, &form->choice, (kt_quantity)r->scene->quantity, &form->function.numbers,
                          &form->function.number_count);
    form->function.number_count *= form->file != NULL ? 2 : 1;
}

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

/* "30 degrees", "2 N m": a number and words. It is read as a number, which reports unknown units, and not as a
 * formula. */
static bool is_number_with_words(const char *text) {
    const char *end = kt_decimal_end(text), *unit = end + strspn(end, " \t");
    return end > text && unit > end && *unit != '\0' &&
           unit[strspn(unit, " ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz")] == '\0';
}

/* Whether a scalar is the text of a formula: no number, and no word of YAML. */
static bool is_formula(const kt_node *node) {
    double value;
    return !kt_is_expression(node) && !is_number_with_words(node->of.text) &&
           (!node->plain || kt_scalar_classify(node->of.text, &value) == KT_SCALAR_TEXT);
}

static bool read_function_formula(kt_reader *r, const kt_scope *scope, kt_node *node, kt_quantity quantity,
                                  kt_function *out) {
    const kt_symbols time = kt_time_symbols();
    out->type = KT_FUNCTION_EXPRESSION;
    return kt_read_formula(r, scope, node, &time, quantity == KT_QUANTITY_ANGLE, &out->text);
}

/* ---- the whole --------------------------------------------------------------------------------------------------- */

bool kt_read_function(kt_reader *r, const kt_scope *scope, kt_node *node, kt_quantity quantity, kt_function *out) {
    kt_function function = {.type = KT_FUNCTION_CONSTANT};
    r->scene->quantity = (int)quantity;
    if (node->kind == KT_NODE_LIST)
        return kt_fault_expected(r, scope, node, forms.expected);
    if (node->kind == KT_NODE_TEXT && is_formula(node)) {
        if (!read_function_formula(r, scope, node, quantity, &function))
            return false;
    } else if (node->kind == KT_NODE_TEXT) {
        if (!kt_read_number(r, scope, node, quantity, &function.value))
            return false;
    } else {
        form_read form = {.function = function};
        (void)kt_table_read(r, scope, node, &form_table, &form);
        form.function.type = (kt_function_type)kt_form_find(r, scope, node, &forms);
        read_table_file(r, scope, node, &form);
        function = form.function;
        if (kt_node_is_faulty(node) || r->out_of_memory)
            return false;
    }
    *out = function;
    return true;
}

/* A number and a formula are written alone, other forms with their key. */
void kt_write_function(kt_emitter *e, const kt_function *function) {
    static const kt_function zero = {.type = KT_FUNCTION_NONE};
    if (function->type == KT_FUNCTION_CONSTANT) {
        kt_emit_number(e, function->value);
        return;
    }
    if (function->type == KT_FUNCTION_EXPRESSION) {
        kt_emit_text(e, function->text);
        return;
    }
    kt_form_write(e, &forms, (int)function->type, function, &zero);
}
