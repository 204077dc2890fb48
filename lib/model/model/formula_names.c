/* Names in the formulas of an effect. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/formula_names.h"

#include "base/aligned.h"
#include "base/arena.h"
#include "expression/lookup.h"
#include "model/model.h"
#include "model/relative.h"

#include <stdio.h>
#include <string.h>

/* Whether `text` joins the two. */
static bool joins(const char *text, const char *before, const char *name) {
    const size_t length = strlen(before);
    return strncmp(text, before, length) == 0 && strcmp(text + length, name) == 0;
}

/* Whether a name denotes the length or coordinate of the effect itself, or its rate. Sets *variable if so. */
static bool is_own_variable(const kt_formula_names *names, const char *name, kt_variable *variable) {
    bool is_length = names->ends == 2 && strcmp(name, "length") == 0;
    bool is_speed = names->ends == 2 && strcmp(name, "speed") == 0;
    if (names->coordinate) {
        is_length = joins(name, "position.", names->coordinate);
        is_speed = joins(name, "velocity.", names->coordinate);
    }
    if (!is_length && !is_speed)
        return false;
    *variable =
        (kt_variable){.type = (kt_variable_type)(is_length ? KT_VARIABLE_LENGTH : KT_VARIABLE_SPEED), .body = -1};
    return true;
}

/* Whether a variable is a component of a quaternion, a position whose rate is not a single velocity. */
static bool is_quaternion(const kt_formula_names *names, const kt_variable *variable) {
    if (variable->type != KT_VARIABLE_POSITION)
        return false;
    const kt_joint_size size = kt_joint_sizes[names->description->bodies[variable->body].joint.type];
    return size.nq > size.nv && variable->component >= size.nq - 4;
}

/* Finds a variable by its name, and appends it to the variables if it is new. Also notes properties that the caller
 * checks later. If the list is full, any valid index is returned, because the formula will be rejected. */
static bool find_formula_symbol(void *user, const char *name, kt_symbol *symbol) {
    kt_formula_names *names = user;
    kt_variable found;
    char full[KT_EXPRESSION_NAME_MAX + 1];
    if (names->lengthen != NULL)
        name = names->lengthen(names->numbers, name, full);
    if (!is_own_variable(names, name, &found) && !kt_variable_find(names->description, name, &found))
        return false;
    names->quaternion = names->quaternion || is_quaternion(names, &found);
    names->gravity = names->gravity || found.type == KT_VARIABLE_GRAVITY;
    int k = 0;
    while (k < names->count &&
           (names->variable[k].type != found.type || names->variable[k].body != found.body ||
            names->variable[k].marker != found.marker || names->variable[k].component != found.component))
        k++;
    names->full = names->full || k == KT_FORMULA_VARIABLE_MAX;
    k = k < KT_FORMULA_VARIABLE_MAX ? k : 0;
    if (k == names->count)
        names->variable[names->count++] = found;
    *symbol = (kt_symbol){.index = k};
    return true;
}

/* The k-th name that a formula may use, for suggestions: first the effect's own two, then those of the description.
 * NULL: there are no more. */
static const char *list_formula_name(void *user, int k) {
    static const char *const own[] = {"length", "speed"}, *const before[] = {"position.", "velocity."};
    kt_formula_names *names = user;
    kt_variable variable;
    const bool has_own = names->ends == 2 || names->coordinate != NULL;
    if (names->coordinate && k < 2) {
        (void)snprintf(names->shown, sizeof names->shown, "%s%s", before[k], names->coordinate);
        return names->shown;
    }
    if (has_own && k < 2)
        return own[k];
    if (!kt_variable_at(names->description, has_own ? k - 2 : k, &variable))
        return NULL;
    (void)kt_variable_name(names->description, &variable, names->shown, sizeof names->shown);
    return names->shown;
}

/* Tables are the first numbers of a model. */
const double *kt_model_tables(const kt_model *model) { return model->number; }

int kt_body_with_joint(const kt_description *description, const char *name) {
    for (int i = 0; i < description->body_count; i++)
        if (kt_joint_name_of(&description->bodies[i]) && strcmp(kt_joint_name_of(&description->bodies[i]), name) == 0)
            return i;
    return -1;
}

kt_formula_names kt_formula_names_of(const kt_description *description, const kt_effect *effect) {
    kt_formula_names names = {.description = description, .ends = effect->end_count};
    if (effect->end_count == 0 && effect->joint && kt_body_with_joint(description, effect->joint) < 0 &&
        kt_coordinate_loop(description, effect->joint, 0) >= 0)
        names.coordinate = effect->joint;
    return names;
}

kt_symbols kt_formula_symbols(kt_formula_names *names) {
    return (kt_symbols){.find = find_formula_symbol,
                        .list = list_formula_name,
                        .user = names,
                        .tables = names->description->tables,
                        .table_count = names->description->table_count};
}

/* ---- couplings --------------------------------------------------------------------------------------------------- */

static const char position[] = "position.";

const char *kt_position_of_joint(const char *name) {
    return strncmp(name, position, sizeof position - 1) == 0 ? name + sizeof position - 1 : NULL;
}

/* Finds the term of a coupling with a joint's position; its index is the variable's. */
static bool find_term(void *user, const char *name, kt_symbol *symbol) {
    const kt_loop *loop = ((const kt_coupling_names *)user)->loop;
    const char *joint = kt_position_of_joint(name);
    for (int k = 0; k < loop->term_count && joint != NULL; k++)
        if (strcmp(loop->terms[k].joint, joint) == 0) {
            *symbol = (kt_symbol){.index = k};
            return true;
        }
    return false;
}

static const char *list_term(void *user, int k) {
    kt_coupling_names *names = user;
    if (k >= names->loop->term_count)
        return NULL;
    (void)snprintf(names->shown, sizeof names->shown, "%s%.255s", position, names->loop->terms[k].joint);
    return names->shown;
}

kt_symbols kt_coupling_symbols(kt_coupling_names *names) {
    return (kt_symbols){.find = find_term,
                        .list = list_term,
                        .user = names,
                        .tables = names->description->tables,
                        .table_count = names->description->table_count};
}

/* A table of a formula whose slope jumps at rows; NULL: there is none. */
static const char *find_kinked_table(const kt_expression *expression, const kt_symbols *symbols) {
    for (size_t i = 0; i < expression->count; i++) {
        const kt_expression_term *term = &expression->term[i];
        if (kt_operator_is_lookup((kt_operator)term->code) &&
            symbols->tables[term->symbol].interpolation == KT_INTERPOLATION_LINEAR)
            return symbols->tables[term->symbol].name;
    }
    return NULL;
}

/* Reads a text. kinked receives a table whose slope jumps (NULL: not sought). */
static bool check_text(kt_checker *checker, const char *field, const char *text, const kt_symbols *symbols,
                       const char **kinked) {
    const kt_expression *expression = NULL;
    kt_error error = {0};
    const size_t size = kt_expression_size(text);
    void *memory = kt_arena_allocate(size, "reading a formula", &error);
    const bool fine =
        memory != NULL && kt_expression_parse(text, symbols, memory, size, &expression, NULL, &error) == KT_OK;
    if (fine && kinked != NULL)
        *kinked = find_kinked_table(expression, symbols);
    kt_aligned_release(memory);
    if (!fine)
        kt_checker_fault(checker, field, -1, "%s: %s (%s of %s)", field, error.message, error.where,
                         kt_name_quote(text).text);
    return fine;
}

bool kt_checker_text(kt_checker *checker, const char *field, const char *text, const kt_symbols *symbols) {
    return check_text(checker, field, text, symbols, NULL);
}

void kt_checker_coupling(kt_checker *checker, const char *field, const kt_loop *loop) {
    kt_coupling_names names = {.description = checker->description, .loop = loop};
    const kt_symbols symbols = kt_coupling_symbols(&names);
    const char *kinked = NULL;
    for (int k = 0; k < loop->term_count && loop->terms != NULL; k++)
        if (loop->terms[k].joint == NULL)
            return; /* that has been reported */
    if (loop->terms == NULL || loop->term_count < 1)
        return;
    if (loop->term_count > KT_FORMULA_VARIABLE_MAX)
        kt_checker_fault(checker, field, -1, "%s: the coupling has %d joints; with a formula at most %d", field,
                         loop->term_count, KT_FORMULA_VARIABLE_MAX);
    else if (check_text(checker, field, loop->formula, &symbols, &kinked) && loop->side != KT_SIDE_NONE)
        kt_checker_fault(checker, "side", -1, "a coupling with a formula holds; it bounds no side");
    if (kinked != NULL)
        kt_checker_fault(checker, field, -1,
                         "%s: the slope of the table '%.60s' jumps at its rows, and with it the velocity; give the "
                         "table `interpolation: cubic` or `monotone`, and one input",
                         field, kinked);
}

/* ---- forces ------------------------------------------------------------------------------------------------------ */

/* A body whose mass is a function of time; NULL: there is none. */
static const char *body_of_variable_mass(const kt_description *description) {
    for (int i = 0; i < description->body_count; i++)
        if (description->bodies[i].variable_mass != NULL)
            return description->bodies[i].name;
    return NULL;
}

bool kt_checker_gravity(kt_checker *checker, const char *field, int sub, const kt_formula_names *names) {
    const char *changing = names->gravity ? body_of_variable_mass(names->description) : NULL;
    if (changing != NULL)
        kt_checker_fault(checker, field, sub,
                         "%s: formulas of forces and states read gravity in joints only if all masses are constant; "
                         "the mass of body %s is a function of time",
                         field, kt_name_quote(changing).text);
    return changing == NULL;
}

bool kt_checker_formula(kt_checker *checker, const char *field, const char *text, kt_formula_names *names) {
    const kt_symbols symbols = kt_formula_symbols(names);
    if (!kt_checker_text(checker, field, text, &symbols))
        return false;
    if (names->full)
        kt_checker_fault(checker, field, -1, "%s: the formulas use more than %d variables; make two %s of it", field,
                         KT_FORMULA_VARIABLE_MAX, checker->item == KT_ITEM_STATE ? "states" : "effects");
    else if (names->quaternion)
        kt_checker_fault(checker, field, -1,
                         "%s: a component of a quaternion is no variable of forces; take coordinates of markers",
                         field);
    return !names->full && !names->quaternion && kt_checker_gravity(checker, field, -1, names);
}
