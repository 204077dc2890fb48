/* Functions of time: a number, {sine: ...}, {ramp: ...}, {polynomial: [...]} or {table: [...], interpolation: ...}. */
#include "scene/part.h"

#include <stddef.h>

/* ---- values ------------------------------------------------------------------------------------------------------ */

/* A value of the function: its unit is that of what the function gives. */
static bool read_ordinate(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_read_number(r, scope, node, (kt_quantity)r->quantity, kt_field_in(object, field));
}

static const kt_kind kind_ordinate = {read_ordinate, kt_number_write, kt_number_same};

static bool take_numbers(kt_reader *r, size_t count, kt_function *out, double **numbers) {
    *numbers = kt_pool_take(&r->keep, count, sizeof **numbers);
    if (*numbers == NULL)
        return kt_reader_out_of_memory(r);
    out->numbers = *numbers;
    out->number_count = (int)count;
    return true;
}

static bool read_polynomial(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)field;
    kt_function *function = object;
    double *numbers;
    if (node->kind != KT_NODE_LIST || node->count == 0)
        return kt_fault_expected(r, scope, node, "a list of coefficients [c0, c1, ...]");
    if (!take_numbers(r, node->count, function, &numbers))
        return false;
    bool good = true;
    int i = 0;
    for (kt_node *item = node->of.first; item != NULL; item = item->next, i++) {
        const kt_scope here = {.outer = scope, .index = i};
        kt_quantity quantity = i == 0 ? (kt_quantity)r->quantity : KT_QUANTITY_NUMBER;
        good = kt_read_number(r, &here, item, quantity, &numbers[i]) && good;
    }
    return good;
}

static bool read_table(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)field;
    kt_function *function = object;
    const kt_quantity quantities[] = {KT_QUANTITY_NUMBER, (kt_quantity)r->quantity};
    double *numbers;
    if (node->kind != KT_NODE_LIST || node->count == 0)
        return kt_fault_expected(r, scope, node, "a list of points [[t, y], [t, y], ...]");
    if (!take_numbers(r, 2 * (size_t)node->count, function, &numbers))
        return false;
    bool good = true;
    int i = 0;
    for (kt_node *item = node->of.first; item != NULL; item = item->next, i++) {
        const kt_scope here = {.outer = scope, .index = i};
        good = kt_read_numbers(r, &here, item, 2, KT_QUANTITY_NUMBER, quantities, &numbers[2 * (ptrdiff_t)i]) && good;
    }
    return good;
}

/* Written by write_function. */
static const kt_kind kind_polynomial = {.read = read_polynomial}, kind_table = {.read = read_table};

/* ---- the forms --------------------------------------------------------------------------------------------------- */

static const char *const interpolation_names[] = {"linear", "cubic", "monotone"};
static const kt_choice interpolations = {"function.interpolation", interpolation_names, 3, 0};

#define AT(member) .offset = offsetof(kt_function, member)
static const kt_field sine_fields[] = {
    {.key = "amplitude", .kind = &kind_ordinate, AT(amplitude), .flags = KT_FIELD_REQUIRED},
    {.key = "frequency", .kind = &kt_kind_number, AT(frequency), .flags = KT_FIELD_REQUIRED},
    {.key = "phase", .kind = &kt_kind_angle, AT(phase)},
    {.key = "offset", .kind = &kind_ordinate, AT(offset)},
};
static const kt_table sine_table = {.where = "function.sine", .fields = sine_fields, .count = 4, .flow = true};

static const kt_field ramp_fields[] = {
    {.key = "from", .kind = &kind_ordinate, AT(from), .flags = KT_FIELD_REQUIRED},
    {.key = "to", .kind = &kind_ordinate, AT(to), .flags = KT_FIELD_REQUIRED},
    {.key = "start", .kind = &kt_kind_number, AT(start), .flags = KT_FIELD_REQUIRED},
    {.key = "end", .kind = &kt_kind_number, AT(end), .flags = KT_FIELD_REQUIRED},
};
static const kt_table ramp_table = {.where = "function.ramp", .fields = ramp_fields, .count = 4, .flow = true};

enum { FORM_COUNT = 4 };
static const kt_field form_fields[] = {
    {.key = "sine", .kind = &kt_kind_map, .detail = &sine_table},
    {.key = "ramp", .kind = &kt_kind_map, .detail = &ramp_table},
    {.key = "polynomial", .kind = &kind_polynomial},
    {.key = "table", .kind = &kind_table},
    {.key = "interpolation", .kind = &kt_kind_choice, AT(interpolation), .detail = &interpolations},
};
static const kt_function_type form_types[FORM_COUNT] = {KT_FUNCTION_SINE, KT_FUNCTION_RAMP, KT_FUNCTION_POLYNOMIAL,
                                                        KT_FUNCTION_TABLE};
static const kt_table form_table = {
    .where = "function", .fields = form_fields, .count = KT_COUNT_OF(form_fields), .flow = true};

/* The one form that the mapping has; NONE after reporting what is wrong. */
static kt_function_type find_form(kt_reader *r, const kt_scope *scope, kt_node *node) {
    int found = -1;
    for (int i = 0; i < FORM_COUNT; i++) {
        if (kt_node_find(node, form_fields[i].key) == NULL)
            continue;
        if (found >= 0) {
            kt_fault_at(r, KT_ERROR_SCENE, scope, node, "'%s' and '%s' are two functions; leave one of them out",
                        form_fields[found].key, form_fields[i].key);
            return KT_FUNCTION_NONE;
        }
        found = i;
    }
    if (found < 0) {
        if (!kt_node_is_faulty(node))
            kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                        "the function is missing; give a number or one of sine, ramp, polynomial, table");
        return KT_FUNCTION_NONE;
    }
    if (form_types[found] != KT_FUNCTION_TABLE && kt_node_find(node, "interpolation") != NULL)
        kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, "interpolation"),
                    "only a table is interpolated; remove the key");
    return form_types[found];
}

static bool read_function(kt_reader *r, const kt_scope *scope, kt_node *node, kt_quantity quantity, kt_function *out) {
    kt_function function = {.type = KT_FUNCTION_CONSTANT};
    r->quantity = (int)quantity;
    if (node->kind == KT_NODE_LIST)
        return kt_fault_expected(r, scope, node,
                                 "a function of time (a number, or one of sine, ramp, polynomial, table)");
    if (node->kind == KT_NODE_TEXT) {
        if (!kt_read_number(r, scope, node, quantity, &function.value))
            return false;
    } else {
        (void)kt_table_read(r, scope, node, &form_table, &function);
        function.type = find_form(r, scope, node);
        if (kt_node_is_faulty(node) || r->out_of_memory)
            return false;
    }
    *out = function;
    return true;
}

static bool read_plain(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return read_function(r, scope, node, KT_QUANTITY_NUMBER, kt_field_in(object, field));
}

/* The position of the loop's joint, which has been read before: an angle where the joint turns. */
static bool read_motion(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const kt_loop *loop = object;
    return read_function(r, scope, node, kt_joint_quantity(r, loop->joint), kt_field_in(object, field));
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

static void write_points(kt_emitter *e, const kt_function *function) {
    kt_emit_list(e, true);
    for (int i = 0; i + 1 < function->number_count; i += 2)
        kt_emit_numbers(e, function->numbers + i, 2);
    kt_emit_end(e);
}

static void write_function(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    (void)standard;
    static const kt_function zero = {.type = KT_FUNCTION_NONE};
    const kt_function *function = kt_field_of(object, field);
    if (function->type == KT_FUNCTION_CONSTANT) {
        kt_emit_number(e, function->value);
        return;
    }
    kt_emit_map(e, true);
    for (int i = 0; i < FORM_COUNT; i++)
        if (form_types[i] == function->type)
            kt_emit_key(e, form_fields[i].key);
    switch (function->type) {
    case KT_FUNCTION_SINE:
        kt_table_write(e, &sine_table, function, &zero);
        break;
    case KT_FUNCTION_RAMP:
        kt_table_write(e, &ramp_table, function, &zero);
        break;
    case KT_FUNCTION_POLYNOMIAL:
        kt_emit_numbers(e, function->numbers, function->number_count);
        break;
    case KT_FUNCTION_TABLE:
        write_points(e, function);
        if (function->interpolation != KT_INTERPOLATION_LINEAR) {
            kt_emit_key(e, "interpolation");
            kt_emit_word(e, interpolation_names[function->interpolation]);
        }
        break;
    case KT_FUNCTION_NONE:
    case KT_FUNCTION_CONSTANT:
        break;
    }
    kt_emit_end(e);
}

static bool same_function(const kt_field *field, const void *object, const void *standard) {
    (void)standard;
    const kt_function *function = kt_field_of(object, field);
    return function->type == KT_FUNCTION_NONE;
}

static bool read_three(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_function *functions = kt_field_in(object, field);
    if (node->kind != KT_NODE_LIST || node->count != 3)
        return kt_fault_expected(r, scope, node, "a list of three numbers or functions of time");
    bool good = true;
    int i = 0;
    for (kt_node *item = node->of.first; item != NULL; item = item->next, i++) {
        const kt_scope here = {.outer = scope, .index = i};
        good = read_function(r, &here, item, KT_QUANTITY_NUMBER, &functions[i]) && good;
    }
    return good;
}

static void write_three(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    const kt_function *functions = kt_field_of(object, field);
    const kt_field each = {.key = field->key, .kind = field->kind};
    kt_emit_list(e, true);
    for (int i = 0; i < 3; i++)
        write_function(e, &each, &functions[i], standard);
    kt_emit_end(e);
}

const kt_kind kt_kind_functions = {read_three, write_three, same_function};
const kt_kind kt_kind_function = {read_plain, write_function, same_function};
const kt_kind kt_kind_motion = {read_motion, write_function, same_function};
