/* Numbers, vectors, axes, texts, words, mappings, forms of values. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/value.h"

#include "document/number.h"
#include "scene/scene_expression.h"
#include "scene/vary.h"

#include <string.h>

bool kt_same_bits(const void *a, const void *b, size_t size) { return memcmp(a, b, size) == 0; }

bool kt_never_written(const kt_member *m) {
    (void)m;
    return true;
}

/* ---- numbers ----------------------------------------------------------------------------------------------------- */

static const char *expected_number(kt_quantity quantity) {
    switch (quantity) {
    case KT_QUANTITY_ANGLE:
        return "an angle (a number in rad, or '30 deg')";
    case KT_QUANTITY_RATE:
        return "an angular rate (a number in rad/s, or '30 deg' for degrees a second)";
    case KT_QUANTITY_NUMBER:
    case KT_QUANTITY_POSITIVE:
        break;
    }
    return "a number";
}

/* Reports a text that was meant as a number, and how to write it. */
static bool fault_no_number(kt_reader *r, const kt_scope *scope, kt_node *node, kt_quantity quantity) {
    const char *text = node->of.text;
    kt_name_text quoted = kt_name_quote(text);
    bool digit = text[strspn(text, "+-.")] >= '0' && text[strspn(text, "+-.")] <= '9';
    bool angle = quantity == KT_QUANTITY_ANGLE || quantity == KT_QUANTITY_RATE;
    const char *mend = NULL;
    const char *const expected = expected_number(quantity);
    if (node->plain && strpbrk(text, "+-*/^()") != NULL && kt_is_bare_expression(r, text))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "expected %s, found %s; write =%.*s", expected, quoted.text,
                           (int)sizeof quoted.text, text);
    if (digit && strchr(text, ',') != NULL)
        mend = "write a point for the decimal comma";
    else if (digit && strchr(text, '_') != NULL)
        mend = "write the digits without '_'";
    else if (digit && angle)
        mend = "the units of angles are 'deg' and 'rad', after a blank; anything else is in SI units";
    else if (digit && strpbrk(text, "*/^()") == NULL)
        mend = "write the number alone, in SI units";
    else if (digit || strstr(text, "pi") != NULL)
        mend = "an expression begins with '=': write = before it";
    if (kt_is_parameter(r, text))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "expected %s, found %s; write =%s for the parameter",
                           expected_number(quantity), quoted.text, text);
    if (mend == NULL)
        return kt_fault_expected(r, scope, node, expected_number(quantity));
    return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "expected %s, found %s; %s", expected_number(quantity),
                       quoted.text, mend);
}

static bool take_quantity(kt_reader *r, const kt_scope *scope, kt_node *node, kt_quantity quantity, double value,
                          double *out) {
    if (quantity == KT_QUANTITY_POSITIVE && !(value > 0.0))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "'%.40s' must be greater than 0", node->of.text);
    if (!kt_is_expression(node))
        kt_varying_note(r, node, NULL);
    *out = value;
    return true;
}

bool kt_read_number(kt_reader *r, const kt_scope *scope, kt_node *node, kt_quantity quantity, double *out) {
    bool angle = quantity == KT_QUANTITY_ANGLE || quantity == KT_QUANTITY_RATE;
    double value = 0.0;
    if (node->kind != KT_NODE_TEXT)
        return kt_fault_expected(r, scope, node, expected_number(quantity));
    if (kt_is_expression(node))
        return kt_read_expression(r, scope, node, angle, &value) && take_quantity(r, scope, node, quantity, value, out);
    const kt_scalar scalar = kt_scalar_classify(node->of.text, &value);
    if (scalar == KT_SCALAR_ANGLE && angle) /* a text to YAML, which may be in quotes */
        return take_quantity(r, scope, node, quantity, value, out);
    if (!node->plain)
        return kt_fault_expected(r, scope, node, expected_number(quantity));
    switch (scalar) {
    case KT_SCALAR_NUMBER:
        return take_quantity(r, scope, node, quantity, value, out);
    case KT_SCALAR_ANGLE:
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                           "expected a number, found the angle '%.40s'; this is not an angle: write the number alone",
                           node->of.text);
    case KT_SCALAR_NOT_FINITE:
    case KT_SCALAR_INF_WORD:
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "'%s' is not finite; write a finite number", node->of.text);
    case KT_SCALAR_TOO_LARGE:
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s is too large; the largest number is about 1.8e308",
                           kt_name_quote(node->of.text).text);
    case KT_SCALAR_TEXT:
        return fault_no_number(r, scope, node, quantity);
    case KT_SCALAR_NULL:
    case KT_SCALAR_BOOL:
    case KT_SCALAR_HEX:
    case KT_SCALAR_OCTAL:
        break;
    }
    return kt_fault_expected(r, scope, node, expected_number(quantity));
}

bool kt_read_numbers(kt_reader *r, const kt_scope *scope, kt_node *node, int count, kt_quantity quantity,
                     const kt_quantity *quantities, double *out) {
    static const char *const words[] = {"no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine"};
    if (node->kind != KT_NODE_LIST || node->count != (uint32_t)count) {
        kt_phrase expected = {.length = 0};
        kt_phrase_add(&expected, "a list of %s numbers", words[count]);
        return kt_fault_expected(r, scope, node, expected.text);
    }
    double values[9] = {0.0};
    bool good = true;
    kt_scope here = {.outer = scope};
    for (kt_node *item = node->of.first; item != NULL; item = item->next, here.index++)
        good = kt_read_number(r, &here, item, quantities == NULL ? quantity : quantities[here.index],
                              &values[here.index]) &&
               good;
    if (good)
        memcpy(out, values, (size_t)count * sizeof *out);
    return good;
}

bool kt_read_vector(kt_reader *r, const kt_scope *scope, kt_node *node, kt_vec3 *out) {
    double v[3] = {0.0, 0.0, 0.0};
    if (!kt_read_numbers(r, scope, node, 3, KT_QUANTITY_NUMBER, NULL, v))
        return false;
    *out = kt_vec3_make(v[0], v[1], v[2]);
    return true;
}

bool kt_read_points(kt_reader *r, const kt_scope *scope, kt_node *node, int size, const kt_quantity *quantities,
                    const char *expected, const double **out, int *count) {
    if (node->kind != KT_NODE_LIST || node->count == 0)
        return kt_fault_expected(r, scope, node, expected);
    double *points = kt_pool_take(&r->keep, (size_t)size * node->count, sizeof *points);
    if (points == NULL)
        return kt_reader_out_of_memory(r);
    bool good = true;
    kt_scope here = {.outer = scope};
    for (kt_node *item = node->of.first; item != NULL; item = item->next, here.index++)
        good =
            kt_read_numbers(r, &here, item, size, KT_QUANTITY_NUMBER, quantities, points + size * here.index) && good;
    *out = points;
    *count = here.index;
    return good;
}

void kt_write_points(kt_emitter *e, const double *points, int size, int count) {
    kt_emit_list(e, KT_EMIT_FLOW);
    for (int i = 0; i < count; i++)
        kt_emit_numbers(e, points + size * i, size);
    kt_emit_end(e);
}

bool kt_put_number(kt_reader *r, const kt_scope *scope, kt_node *node, kt_quantity quantity, double *out) {
    if (!kt_read_number(r, scope, node, quantity, out))
        return false;
    (void)kt_number_follows(r, node, quantity == KT_QUANTITY_POSITIVE, out);
    return true;
}

bool kt_put_numbers(kt_reader *r, const kt_scope *scope, kt_node *node, int count, kt_quantity quantity,
                    const kt_quantity *quantities, double *out) {
    if (!kt_read_numbers(r, scope, node, count, quantity, quantities, out))
        return false;
    kt_numbers_follow(r, node, out);
    return true;
}

static bool read_number(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_put_number(r, scope, node, KT_QUANTITY_NUMBER, kt_field_in(object, field));
}

static bool read_positive(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_put_number(r, scope, node, KT_QUANTITY_POSITIVE, kt_field_in(object, field));
}

static bool read_angle(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_put_number(r, scope, node, KT_QUANTITY_ANGLE, kt_field_in(object, field));
}

static int number_count_of(const kt_field *field) { return (int)(field->kind->size / sizeof(double)); }

bool kt_kind_numbers_read(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_put_numbers(r, scope, node, number_count_of(field), KT_QUANTITY_NUMBER, NULL, kt_field_in(object, field));
}

void kt_kind_numbers_write(kt_emitter *e, const kt_member *m) {
    const double *values = kt_member_value(m);
    if (number_count_of(m->field) == 1)
        kt_emit_number(e, *values);
    else
        kt_emit_numbers(e, values, number_count_of(m->field));
}

const kt_kind kt_kind_number = {.read = read_number, .write = kt_kind_numbers_write, .size = sizeof(double)};
const kt_kind kt_kind_positive = {.read = read_positive, .write = kt_kind_numbers_write, .size = sizeof(double)};
const kt_kind kt_kind_angle = {.read = read_angle, .write = kt_kind_numbers_write, .size = sizeof(double)};

/* ---- vectors ----------------------------------------------------------------------------------------------------- */

_Static_assert(sizeof(kt_vec3) == 3 * sizeof(double), "a vector is a list of three numbers");
const kt_kind kt_kind_vector = {.read = kt_kind_numbers_read, .write = kt_kind_numbers_write, .size = sizeof(kt_vec3)};

static const struct {
    const char *word;
    kt_vec3 axis;
} axes[] = {{"x", {1.0, 0.0, 0.0}},   {"y", {0.0, 1.0, 0.0}},   {"z", {0.0, 0.0, 1.0}},
            {"-x", {-1.0, 0.0, 0.0}}, {"-y", {0.0, -1.0, 0.0}}, {"-z", {0.0, 0.0, -1.0}}};

static bool read_axis(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_vec3 *out = kt_field_in(object, field);
    if (node->kind == KT_NODE_LIST && node->count == 3)
        return kt_read_vector(r, scope, node, out);
    if (node->kind == KT_NODE_TEXT) {
        for (size_t i = 0; i < sizeof axes / sizeof *axes; i++) {
            if (strcmp(node->of.text, axes[i].word) == 0) {
                *out = axes[i].axis;
                return true;
            }
        }
    }
    return kt_fault_expected(r, scope, node, "an axis (x, y, z, -x, -y, -z or a list of three numbers)");
}

void kt_axis_write(kt_emitter *e, const kt_member *m) {
    const kt_vec3 *axis = kt_member_value(m);
    for (size_t i = 0; i < sizeof axes / sizeof *axes; i++) {
        if (kt_same_bits(axis, &axes[i].axis, sizeof *axis)) {
            kt_emit_word(e, axes[i].word);
            return;
        }
    }
    kt_kind_numbers_write(e, m);
}

const kt_kind kt_kind_axis = {.read = read_axis, .write = kt_axis_write, .size = sizeof(kt_vec3)};

/* ---- texts and words --------------------------------------------------------------------------------------------- */

static bool keep_scalar_text(kt_reader *r, const kt_node *node, const char **out) {
    const char *text = kt_pool_text(&r->keep, node->of.text, node->count);
    if (text == NULL)
        return kt_reader_out_of_memory(r);
    *out = text;
    return true;
}

/* The type that YAML gives to a scalar. */
static kt_scalar scalar_of(const kt_node *node) {
    double value;
    kt_scalar scalar = node->plain ? kt_scalar_classify(node->of.text, &value) : KT_SCALAR_TEXT;
    return scalar == KT_SCALAR_ANGLE || scalar == KT_SCALAR_INF_WORD ? KT_SCALAR_TEXT : scalar;
}

bool kt_read_text(kt_reader *r, const kt_scope *scope, kt_node *node, const char **out) {
    kt_scalar scalar = node->kind == KT_NODE_TEXT ? scalar_of(node) : KT_SCALAR_NULL;
    if (scalar == KT_SCALAR_NULL)
        return kt_fault_expected(r, scope, node, "a text");
    if (scalar != KT_SCALAR_TEXT)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "expected a text, found the %s %s; put it in quotes",
                           scalar == KT_SCALAR_BOOL ? "boolean" : "number", kt_name_quote(node->of.text).text);
    return keep_scalar_text(r, node, out);
}

bool kt_read_name(kt_reader *r, const kt_scope *scope, kt_node *node, const char *expected, const char **out) {
    kt_scalar scalar = node->kind == KT_NODE_TEXT ? scalar_of(node) : KT_SCALAR_NULL;
    if (scalar == KT_SCALAR_BOOL)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "expected %s, found the boolean %s; put it in quotes",
                           expected, kt_name_quote(node->of.text).text);
    if (scalar != KT_SCALAR_TEXT) {
        kt_phrase phrase = {.length = 0};
        kt_phrase_add(&phrase, "%s, which begins with a letter or _", expected);
        return kt_fault_expected(r, scope, node, phrase.text);
    }
    return keep_scalar_text(r, node, out);
}

static bool read_text_member(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_read_text(r, scope, node, kt_field_in(object, field));
}

static bool read_name(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_read_name(r, scope, node, "a name", kt_field_in(object, field));
}

void kt_text_write(kt_emitter *e, const kt_member *m) {
    const char *const *text = kt_member_value(m);
    kt_emit_text(e, *text);
}

static bool same_text(const kt_member *m) {
    const char *const *a = kt_member_value(m), *const *b = kt_member_standard(m);
    return *a == NULL || *b == NULL ? *a == *b : strcmp(*a, *b) == 0;
}

const kt_kind kt_kind_text = {.read = read_text_member, .write = kt_text_write, .same = same_text};
const kt_kind kt_kind_name = {.read = read_name, .write = kt_text_write, .same = same_text};

bool kt_word_read(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    int value = kt_choice_read(r, scope, node, kt_detail_of(field));
    if (value < 0)
        return false;
    memcpy(kt_field_in(object, field), &value, sizeof value);
    return true;
}

void kt_word_write(kt_emitter *e, const kt_member *m) {
    const kt_choice *choice = kt_detail_of(m->field);
    int value;
    memcpy(&value, kt_member_value(m), sizeof value);
    if (value < choice->first || value >= choice->count)
        kt_emit_reject(e, KT_ERROR_ARGUMENT, "%s is %d, which has no meaning", choice->where, value);
    else
        kt_emit_word(e, choice->names[value]);
}

const kt_kind kt_kind_choice = {.read = kt_word_read, .write = kt_word_write, .size = sizeof(int)};

static bool read_flag(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    double value;
    bool *out = kt_field_in(object, field);
    if (node->kind != KT_NODE_TEXT || !node->plain || kt_scalar_classify(node->of.text, &value) != KT_SCALAR_BOOL)
        return kt_fault_expected(r, scope, node, "true or false");
    *out = node->of.text[0] == 't' || node->of.text[0] == 'T';
    return true;
}

static void write_flag(kt_emitter *e, const kt_member *m) {
    const bool *value = kt_member_value(m);
    kt_emit_word(e, *value ? "true" : "false");
}

const kt_kind kt_kind_flag = {.read = read_flag, .write = write_flag, .size = sizeof(bool)};

/* ---- mappings ---------------------------------------------------------------------------------------------------- */

static bool read_map(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_table_read(r, scope, node, kt_detail_of(field), kt_field_in(object, field));
}

void kt_map_write(kt_emitter *e, const kt_member *m) {
    kt_table_write(e, kt_detail_of(m->field), kt_member_value(m), kt_member_standard(m));
}

bool kt_map_same(const kt_member *m) {
    return kt_table_same(kt_detail_of(m->field), kt_member_value(m), kt_member_standard(m));
}

const kt_kind kt_kind_map = {.read = read_map, .write = kt_map_write, .same = kt_map_same};

/* ---- forms ------------------------------------------------------------------------------------------------------- */

int kt_form_find(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_forms *forms) {
    int found = -1;
    for (int i = 0; i < forms->count; i++) {
        if (kt_node_find(node, forms->fields[i].key) == NULL)
            continue;
        if (found >= 0 && forms->types[found] != forms->types[i]) {
            kt_fault_at(r, KT_ERROR_SCENE, scope, node, "'%s' and '%s' are two %s; leave one of them out",
                        forms->fields[found].key, forms->fields[i].key, forms->several);
            return 0;
        }
        found = i;
    }
    if (found < 0 && !kt_node_is_faulty(node))
        kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s", forms->missing);
    return found < 0 ? 0 : forms->types[found];
}

void kt_form_write(kt_emitter *e, const kt_forms *forms, int type, const void *value, const void *standard) {
    kt_emit_map(e, KT_EMIT_FLOW);
    for (int i = 0; i < forms->count; i++)
        if (forms->types[i] == type) {
            kt_emit_key(e, forms->fields[i].key);
            forms->fields[i].kind->write(e, &(kt_member){&forms->fields[i], value, standard});
        }
    kt_emit_end(e);
}
