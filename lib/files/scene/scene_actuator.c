/* Forces by numbers: lists of actuators, polynomial springs, and activations of auxiliary states.
 *
 *     actuators: [{name: a, gear: 2, gain: 5, bias: [0, -5, -1], control: 0.3, lower: -1, upper: 1}]
 *     spring: {stiffness: [10, 0, 4], damping: 0.1, rest: 0.2}
 *     activation: {type: filter, control: 0.5, times: 0.1}
 *
 * A single number stands for a list whose other numbers are 0; of `rest`, for two equal ones.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/effect.h"
#include "model/describe.h"
#include "scene/scene_part.h"

#include <stddef.h>
#include <string.h>

/* ---- numbers ----------------------------------------------------------------------------------------------------- */

static int count_of(const kt_field *field) { return (int)(field->kind->size / sizeof(double)); }

/* These numbers become those of formulas, so that a change of a variable needs another reading. */
static bool read_fixed(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    double *out = kt_field_in(object, field), first;
    if (node->kind == KT_NODE_LIST)
        return kt_read_numbers(r, scope, node, count_of(field), KT_QUANTITY_NUMBER, NULL, out);
    if (!kt_read_number(r, scope, node, KT_QUANTITY_NUMBER, &first))
        return false;
    memset(out, 0, field->kind->size);
    out[0] = first;
    return true;
}

static void write_fixed(kt_emitter *e, const kt_member *m) {
    const double *values = kt_member_value(m);
    int count = count_of(m->field);
    bool is_single = true;
    for (int k = 1; k < count; k++)
        is_single = is_single && values[k] == 0.0;
    if (is_single)
        kt_emit_number(e, values[0]);
    else
        kt_emit_numbers(e, values, count);
}

static bool same_fixed(const kt_member *m) {
    return kt_same_bits(kt_member_value(m), kt_member_standard(m), m->field->kind->size);
}

static bool read_pair(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    double *out = kt_field_in(object, field);
    if (!read_fixed(r, scope, node, field, object))
        return false;
    if (node->kind != KT_NODE_LIST)
        out[1] = out[0];
    return true;
}

static void write_pair(kt_emitter *e, const kt_member *m) { kt_emit_numbers(e, kt_member_value(m), 2); }

#define NUMBERS(count)                                                                                                 \
    { .read = read_fixed, .write = write_fixed, .same = same_fixed, .size = (count) * sizeof(double) }
static const kt_kind number = NUMBERS(1), three = NUMBERS(3), six = NUMBERS(6);
static const kt_kind pair = {.read = read_pair, .write = write_pair, .same = same_fixed, .size = 2 * sizeof(double)};

/* ---- structs behind pointers ------------------------------------------------------------------------------------- */

/* The table and the default of a struct that a member points to: the detail of its kind. */
typedef struct pointed {
    const kt_table *table;
    size_t size;
    void (*set_default)(void *object);
} pointed;

enum { LARGEST = 256 /* bytes of such a struct */ };

static bool read_pointed(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const pointed *p = kt_detail_of(field);
    void *made = kt_pool_take(&r->keep, 1, p->size);
    if (made == NULL)
        return kt_reader_out_of_memory(r);
    p->set_default(made);
    memcpy(kt_field_in(object, field), &made, sizeof made);
    return kt_table_read(r, scope, node, p->table, made);
}

static const void *pointer_of(const kt_member *m) {
    const void *at;
    memcpy(&at, kt_member_value(m), sizeof at);
    return at;
}

static void write_pointed(kt_emitter *e, const kt_member *m) {
    const pointed *p = kt_detail_of(m->field);
    _Alignas(max_align_t) char standard[LARGEST];
    p->set_default(standard);
    kt_table_write(e, p->table, pointer_of(m), standard);
}

static bool same_pointed(const kt_member *m) { return pointer_of(m) == NULL; }

#define POINTED(detail_of)                                                                                             \
    { .read = read_pointed, .write = write_pointed, .same = same_pointed, .detail = &(detail_of) }
#define SET_DEFAULT(name, type)                                                                                        \
    static void name(void *object) {                                                                                   \
        const type standard = type##_default();                                                                        \
        _Static_assert(sizeof standard <= LARGEST, "room for the default");                                            \
        memcpy(object, &standard, sizeof standard);                                                                    \
    }
SET_DEFAULT(set_muscle, kt_muscle)
SET_DEFAULT(set_activation, kt_activation)
SET_DEFAULT(set_polynomial_spring, kt_polynomial_spring)

/* ---- actuators --------------------------------------------------------------------------------------------------- */

#define MUSCLE(member) .offset = offsetof(kt_muscle, member)
static const kt_field muscle_fields[] = {
    {.key = "range", .kind = &pair, MUSCLE(range)},
    {.key = "lengths", .kind = &pair, MUSCLE(lengths), .flags = KT_FIELD_REQUIRED},
    {.key = "force", .kind = &number, MUSCLE(force), .flags = KT_FIELD_REQUIRED},
    {.key = "shortest", .kind = &number, MUSCLE(shortest)},
    {.key = "longest", .kind = &number, MUSCLE(longest)},
    {.key = "speed", .kind = &number, MUSCLE(speed)},
    {.key = "passive", .kind = &number, MUSCLE(passive)},
    {.key = "stretched", .kind = &number, MUSCLE(stretched)},
};
static const kt_table muscle_table = {.fields = muscle_fields, .count = KT_COUNT_OF(muscle_fields), .flow = true};
static const pointed pointed_muscle = {&muscle_table, sizeof(kt_muscle), set_muscle};
static const kt_kind kind_muscle = POINTED(pointed_muscle);

static bool read_actuator_terms(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field,
                                void *object) {
    kt_actuator *actuator = object;
    (void)field;
    return kt_terms_read(r, scope, node, kt_read_number, &actuator->terms, &actuator->term_count);
}

static void write_actuator_terms(kt_emitter *e, const kt_member *m) {
    const kt_actuator *actuator = m->object;
    kt_emit_map(e, KT_EMIT_FLOW);
    for (int i = 0; i < actuator->term_count; i++) {
        kt_emit_name(e, actuator->terms[i].joint);
        kt_emit_number(e, actuator->terms[i].coefficient);
    }
    kt_emit_end(e);
}

static bool same_actuator_terms(const kt_member *m) { return ((const kt_actuator *)m->object)->term_count == 0; }

static const kt_kind kind_terms = {
    .read = read_actuator_terms, .write = write_actuator_terms, .same = same_actuator_terms};

#define AT(member) .offset = offsetof(kt_actuator, member)
static const kt_field actuator_fields[] = {
    {.key = "name", .kind = &kt_kind_text, AT(name)},
    {.key = "tendon", .kind = &kt_kind_text, AT(tendon)},
    {.key = "terms", .kind = &kind_terms, AT(terms)},
    {.key = "gear", .kind = &number, AT(gear)},
    {.key = "gain", .kind = &three, AT(gain)},
    {.key = "bias", .kind = &three, AT(bias)},
    {.key = "control", .kind = &number, AT(control)},
    {.key = "control_lower", .kind = &number, AT(control_lower)},
    {.key = "control_upper", .kind = &number, AT(control_upper)},
    {.key = "delay", .kind = &number, AT(delay)},
    {.key = "activation", .kind = &kt_kind_name, AT(activation)},
    {.key = "activation_lower", .kind = &number, AT(activation_lower)},
    {.key = "activation_upper", .kind = &number, AT(activation_upper)},
    {.key = "lower", .kind = &number, AT(lower)},
    {.key = "upper", .kind = &number, AT(upper)},
    {.key = "sum_lower", .kind = &number, AT(sum_lower)},
    {.key = "sum_upper", .kind = &number, AT(sum_upper)},
    {.key = "active", .kind = &kind_muscle, AT(active)},
    {.key = "passive", .kind = &kind_muscle, AT(passive)},
    {.key = "wrench", .kind = &six, AT(wrench)},
};
static const kt_table actuator_table = {.fields = actuator_fields, .count = KT_COUNT_OF(actuator_fields), .flow = true};

static void read_actuator(kt_reader *r, const kt_scope *scope, const kt_item_read *item) {
    kt_actuator *actuator = (kt_actuator *)item->items + item->index;
    *actuator = kt_actuator_default();
    (void)kt_table_read(r, scope, item->nodes[item->index], &actuator_table, actuator);
}

static void write_actuator(kt_emitter *e, const void *item, int index) {
    const kt_actuator standard = kt_actuator_default();
    (void)index;
    kt_table_write(e, &actuator_table, item, &standard);
}

static const kt_items actuator_list = {.expected = "a list of actuators",
                                       .least = 1,
                                       .size = sizeof(kt_actuator),
                                       .array = offsetof(kt_effect, actuators),
                                       .count = offsetof(kt_effect, actuator_count),
                                       .flow = true,
                                       .read = read_actuator,
                                       .write = write_actuator};
const kt_kind kt_kind_actuators = {
    .read = kt_items_read, .write = kt_items_write, .same = kt_items_same, .detail = &actuator_list};

/* ---- polynomial springs ------------------------------------------------------------------------------------------ */

#define SPRING(member) .offset = offsetof(kt_polynomial_spring, member)
static const kt_field spring_fields[] = {
    {.key = "factor", .kind = &number, SPRING(factor)},
    {.key = "stiffness", .kind = &three, SPRING(stiffness)},
    {.key = "rest", .kind = &pair, SPRING(rest)},
    {.key = "damping", .kind = &three, SPRING(damping)},
    {.key = "friction", .kind = &number, SPRING(friction)},
    {.key = "smoothing", .kind = &number, SPRING(smoothing)},
    {.key = "beyond", .kind = &kt_kind_flag, SPRING(beyond)},
};
static const kt_table spring_table = {.fields = spring_fields, .count = KT_COUNT_OF(spring_fields), .flow = true};
static const pointed spring = {&spring_table, sizeof(kt_polynomial_spring), set_polynomial_spring};
const kt_kind kt_kind_spring = POINTED(spring);

/* ---- activations ------------------------------------------------------------------------------------------------- */

static const char *const activation_names[] = {KT_ACTIVATION_LIST(KT_LISTED_NAME)};
static const kt_choice activation_types = {"activation.type", activation_names, KT_ACTIVATION_TYPE_COUNT, 0, NULL};

#define ACTIVATION(member) .offset = offsetof(kt_activation, member)
static const kt_field activation_fields[] = {
    {.key = "type", .kind = &kt_kind_choice, ACTIVATION(type), .flags = KT_FIELD_REQUIRED, .detail = &activation_types},
    {.key = "control", .kind = &number, ACTIVATION(control)},
    {.key = "control_lower", .kind = &number, ACTIVATION(control_lower)},
    {.key = "control_upper", .kind = &number, ACTIVATION(control_upper)},
    {.key = "delay", .kind = &number, ACTIVATION(delay)},
    {.key = "times", .kind = &three, ACTIVATION(times)},
};
static const kt_table activation_table = {
    .fields = activation_fields, .count = KT_COUNT_OF(activation_fields), .flow = true};
static const pointed pointed_activation = {&activation_table, sizeof(kt_activation), set_activation};
const kt_kind kt_kind_activation = POINTED(pointed_activation);
