/* Formulas of effects: read once more into the model's numbers, and their variables as places in the model; or laws. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/aligned.h"
#include "compile/attach.h"
#include "effect/actuator.h"
#include "expression/part.h"
#include "model/formula_names.h"

/* The numbers that the terms of a formula take at most. */
static size_t formula_numbers_of(const char *text) {
    return (kt_expression_size(text) + sizeof(double) - 1) / sizeof(double);
}

/* ---- parts that depend on time alone ----------------------------------------------------------------------------- */

/* The index of t among the variables of formulas; -1: no formula reads t. */
static int32_t time_of(const kt_formula_names *names) {
    for (int k = 0; k < names->count; k++)
        if (names->variable[k].type == KT_VARIABLE_TIME)
            return k;
    return -1;
}

static size_t numbers_of_part(size_t count) {
    return (kt_expression_part_size(count) + sizeof(double) - 1) / sizeof(double);
}

/* Counts the curve and the numbers of a part of a formula that depends on time alone. */
static void count_formula_part(void *user, const kt_expression_term *term, size_t count) {
    kt_counts *n = user;
    (void)term;
    n->time_part++;
    n->number += numbers_of_part(count);
}

/* The position at which the next part is stored. */
typedef struct kt_part_place {
    kt_model *model;
    size_t *number, part;
} kt_part_place;

/* Stores such a part as a function of time (kt_curve), with numbers of its own. */
static void fill_part(void *user, const kt_expression_term *term, size_t count) {
    kt_part_place *to = user;
    kt_curve *curve = &to->model->time_part[to->part++];
    *curve = (kt_curve){.type = KT_FUNCTION_EXPRESSION, .first = *to->number};
    kt_expression_part_copy(term, count, to->model->number + *to->number);
    *to->number += numbers_of_part(count);
}

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

/* Counts the memory that the formulas of an effect need. */
kt_status kt_attach_count_formulas(const kt_description *description, const kt_effect *effect, kt_formula_names *names,
                                   kt_counts *n, kt_error *error) {
    kt_status status = KT_OK;
    *names = effect->law != NULL ? kt_law_names_of(description, effect) : kt_effect_names_of(description, effect);
    for (int k = 0; k < 6 && effect->type == KT_EFFECT_EXPRESSION && status == KT_OK; k++) {
        kt_formula_text written;
        const char *text = kt_effect_formula(effect, k, &written);
        if (text == NULL)
            continue;
        const size_t size = kt_expression_size(text);
        const kt_symbols symbols = kt_formula_symbols(names);
        const kt_expression *expression;
        void *memory = kt_arena_allocate(size, "reading a formula", error);
        status = memory == NULL ? KT_ERROR_MEMORY
                                : kt_expression_parse(text, &symbols, memory, size, &expression, NULL, error);
        if (status == KT_OK)
            kt_expression_parts(expression, time_of(names), count_formula_part, n);
        kt_aligned_release(memory);
        n->number += formula_numbers_of(text);
    }
    n->variable += (size_t)names->count;
    for (int k = 0; k < names->count; k++)
        n->gravity += names->variable[k].type == KT_VARIABLE_GRAVITY;
    return status;
}

/* The coordinate, link or state in the model that a variable of the description stands for. */
static kt_variable_record variable_record_of(const kt_attach *a, const kt_model *m, const kt_variable *variable) {
    kt_variable_record r = {.type = (int32_t)variable->type};
    r.x = variable->type == KT_VARIABLE_STATE ? variable->component : 0;
    if (variable->body < 0)
        return r;
    const kt_body *body = &a->description->bodies[variable->body];
    const kt_body_record *to = &m->body[kt_body_find(m, body->name)];
    r.q = to->q + variable->component;
    r.v = to->v + variable->component;
    r.component = variable->component;
    r.link = variable->type == KT_VARIABLE_GRAVITY ? kt_attach_link_of_velocity(m, to->link, r.v) : to->link;
    if (variable->type == KT_VARIABLE_MARKER || variable->type == KT_VARIABLE_MARKER_VELOCITY) {
        const kt_pose local = {.position = body->markers[variable->marker].at, .rotation = kt_mat3_identity()};
        r.arm = kt_pose_compose(to->in_link, local).position;
    }
    return r;
}

kt_status kt_attach_fill_formulas(const kt_attach *a, kt_model *m, const kt_effect *effect, kt_effect_record *r,
                                  size_t *number, size_t *variable, size_t *part, kt_error *error) {
    kt_part_place place = {m, number, *part};
    kt_formula_names names =
        effect->law != NULL ? kt_law_names_of(a->description, effect) : kt_effect_names_of(a->description, effect);
    kt_symbols symbols = kt_formula_symbols(&names);
    symbols.compiled = kt_model_tables(m);
    r->variable = (int32_t)*variable;
    r->law = effect->law;
    r->law_derivatives = effect->law_derivatives;
    for (int k = 0; k < 6; k++) {
        const kt_expression *expression;
        kt_formula_text written;
        const char *text = kt_effect_formula(effect, k, &written);
        if (text == NULL)
            continue;
        const kt_status status = kt_expression_parse(text, &symbols, m->number + *number, kt_expression_size(text),
                                                     &expression, NULL, error);
        if (status != KT_OK)
            return status;
        r->formula[k] = *number + 1;
        *number += formula_numbers_of(text);
        kt_expression_parts(expression, time_of(&names), fill_part, &place);
    }
    for (int k = 0; k < names.count; k++)
        m->variable[(*variable)++] = variable_record_of(a, m, &names.variable[k]);
    r->variable_count = (int32_t)names.count;
    *part = place.part;
    return KT_OK;
}
